"""Values of options and arguments of the command line, read from their text."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path

import typer

from rcstudy.errors import UserError


def any_path(text: str | Path) -> Path:
    """The path `text`; a usage error if it is empty, as by an unset variable, which would be the current folder."""
    if text == "":
        raise typer.BadParameter("must not be empty: give the name of a file or folder")
    return Path(text)


def output_path(text: str | Path) -> Path:
    """As `any_path`, for output; a usage error also for -, which would be a file."""
    if str(text) == "-":
        raise typer.BadParameter("-: does not stand for the standard output here: give the name of a file or folder")
    return any_path(text)


def cube_path(text: str | Path) -> Path:
    """As `output_path`; a usage error also for the name of a folder, of which a path keeps no slash at its end."""
    path = output_path(text)
    if path.name and str(text).endswith(os.sep):
        raise typer.BadParameter(f"{text}: is the name of a folder: give that of a file")
    return path


def values_of_axes(texts: Sequence[str]) -> dict[str, str]:
    """Values by axis from ``AXIS=VALUE``, one for each; UserError otherwise."""
    found: dict[str, str] = {}
    for text in texts:
        axis, equals, value = text.partition("=")
        if not (equals and axis.strip() and value.strip()):
            raise UserError(f"--at: {text[:80]}: must be AXIS=VALUE, such as 'modulus=2 Es', and once for an axis")
        if axis.strip() in found:
            raise UserError(f"--at: {text[:80]}: must be AXIS=VALUE once for an axis: {axis.strip()} is given twice")
        found[axis.strip()] = value.strip()
    return found


def shard_of(text: str) -> tuple[int, int]:
    """The numbers i and n of ``I/N``; UserError unless these are a shard."""
    i, slash, n = text.partition("/")
    if not (slash and re.fullmatch("[0-9]{1,9}", i) and re.fullmatch("[0-9]{1,9}", n) and 1 <= int(i) <= int(n)):
        raise UserError(f"--shard: {text[:40]}: I/N, such as 3/8, with I from 1 to N, at most 999999999")
    return int(i), int(n)
