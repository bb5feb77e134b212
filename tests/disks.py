"""Disks that are nearly full."""

from __future__ import annotations

import errno
from collections.abc import Sequence
from pathlib import Path

import pytest

from rcstudy import store
from rcstudy.units import Unit


def give_room_for(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a sweep write no more than so many results at once."""
    write = store.write_unit

    def within_room(folder: Path, number: int, cases: Sequence[tuple[str, bytes]], study: str) -> Unit:
        if len(cases) > most:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(folder, number, cases, study)

    monkeypatch.setattr(store, "write_unit", within_room)


def fill_up(room: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a sweep write no more than so many results in all."""
    write, written = store.write_unit, [0]

    def within_room(folder: Path, number: int, cases: Sequence[tuple[str, bytes]], study: str) -> Unit:
        if written[0] + len(cases) > room:
            raise OSError(errno.ENOSPC, "No space left on device")
        written[0] += len(cases)
        return write(folder, number, cases, study)

    monkeypatch.setattr(store, "write_unit", within_room)
