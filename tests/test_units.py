"""Units by themselves: the order of their files."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from rcstudy.storage.units import BadUnit, number_of, read_unit, unit_paths, write_unit


def test_units_come_in_the_order_in_which_they_were_written(tmp_path: Path) -> None:
    """By number, not by name; files that no sweep wrote come first."""
    written = [write_unit(tmp_path, number, [], "s").path for number in (2, 999_999, 1_000_000)]
    foreign = tmp_path / "z.unit"
    foreign.touch()
    (tmp_path / "notes.txt").touch()
    assert unit_paths(tmp_path) == [foreign, *written]
    assert [number_of(path) for path in unit_paths(tmp_path)] == [-1, 2, 999_999, 1_000_000]
    assert unit_paths(tmp_path / "none") == []


def test_units_with_a_whole_checksum_that_are_none_are_bad(tmp_path: Path) -> None:
    """Made up, or written by a program that broke off: no sweep may stumble over them."""
    path = write_unit(tmp_path, 1, [("ab" * 32, b"record")], "s").path
    whole = path.read_bytes()[:-32]
    for content, words in (
        (whole[:-1], "a case is longer than the file"),
        (whole + b"1", "not a proper unit"),
        (whole.replace(b'"scalars"', b'"scalar_"'), "not a proper unit: 'scalars'"),
    ):
        path.write_bytes(content + hashlib.sha256(content).digest())
        with pytest.raises(BadUnit, match=words):
            read_unit(path)
