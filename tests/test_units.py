"""Units by themselves: the order of their files."""

from __future__ import annotations

from pathlib import Path

from rcstudy.storage.units import number_of, unit_paths, write_unit


def test_units_come_in_the_order_in_which_they_were_written(tmp_path: Path) -> None:
    """By number, not by name; files that no sweep wrote come first."""
    written = [write_unit(tmp_path, number, [], "s").path for number in (2, 999_999, 1_000_000)]
    foreign = tmp_path / "z.unit"
    foreign.touch()
    (tmp_path / "notes.txt").touch()
    assert unit_paths(tmp_path) == [foreign, *written]
    assert [number_of(path) for path in unit_paths(tmp_path)] == [-1, 2, 999_999, 1_000_000]
    assert unit_paths(tmp_path / "none") == []
