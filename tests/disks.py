"""Disks that are nearly full."""

from __future__ import annotations

import errno
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from rcstudy import store
from rcstudy.storage.units import Unit


def give_room_for(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a sweep write no more than so many results at once."""
    _limit(monkeypatch, lambda count, written: count <= most)


def fill_up(room: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a sweep write no more than so many results in all."""
    _limit(monkeypatch, lambda count, written: written + count <= room)


def _limit(monkeypatch: pytest.MonkeyPatch, fits: Callable[[int, int], bool]) -> None:
    """Let a unit be written only if it `fits`: by the number of its results, and of those written before it."""
    write, written = store.write_unit, 0

    def within_room(folder: Path, number: int, cases: Sequence[tuple[str, bytes]], study: str) -> Unit:
        nonlocal written
        if not fits(len(cases), written):
            raise OSError(errno.ENOSPC, "No space left on device")
        written += len(cases)
        return write(folder, number, cases, study)

    monkeypatch.setattr(store, "write_unit", within_room)
