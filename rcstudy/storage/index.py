"""Index of the results of a study's cases: in units on the disk, or in the cube of an earlier sweep.

Only the place of each result is in memory, some hundred bytes per case; records are read when they are needed.
"""

from __future__ import annotations

import os
from collections import Counter, OrderedDict
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from rcstudy.progress import counted
from rcstudy.result import Status, expected_scalars
from rcstudy.storage.earlier import EarlierCube
from rcstudy.storage.record import DamagedRecord, Form, Keep, Record, parse, read_head
from rcstudy.storage.units import BadUnit, Unit

if TYPE_CHECKING:
    from rcstudy.cases import Case
    from rcstudy.mechanics.scene import Scene

_OPEN_FILES = 32


class Index:
    """Where the result of each of `cases` is, by the case's key.

    Solutions that lack some of what is to be kept (`keep`), or a scalar that this version has, do not count.
    """

    def __init__(self, cases: Iterable[Case], keep: Keep) -> None:
        self.keep = keep
        self.cube: EarlierCube | None = None
        self._checked = False  # whether all solved cases that are taken from the cube were read
        self._leaving: set[str] = set()  # solved cases on the disk that are not among `cases`
        self._scenes: dict[str, Scene] = {}
        for case in cases:
            self._scenes.setdefault(case.key, case.scene)
        self._units: list[tuple[Path, Form]] = []
        # status, number of the unit (-1: the cube), then offset and length (in the cube: numbers of grid and case)
        self._places: dict[str, tuple[Status, int, int, int]] = {}
        self._open: OrderedDict[int, int] = OrderedDict()

    def close(self) -> None:
        """Close all files."""
        for descriptor in self._open.values():
            os.close(descriptor)
        self._open.clear()
        if self.cube is not None:
            self.cube.close()
            self.cube = None

    @property
    def is_empty(self) -> bool:
        """Whether no case has a result."""
        return not self._places

    def status(self, key: str) -> Status | None:
        """How the case ended; None if it has no result yet."""
        place = self._places.get(key)
        return None if place is None else place[0]

    def kept(self, keys: Iterable[str]) -> int:
        """How many of these cases are solved with a result that is still there: a user may have taken units away."""
        there = [path.exists() for path, _ in self._units]
        places = (self._places.get(key) for key in keys)
        return sum(p is not None and p[0] == Status.SOLVED and (p[1] < 0 or there[p[1]]) for p in places)

    def in_cube(self, key: str) -> bool:
        """Whether the result of a case is that of the earlier cube."""
        return key in self._places and self._places[key][1] < 0

    @property
    def in_cube_count(self) -> int:
        """How many cases have their result in the earlier cube."""
        return sum(place[1] < 0 for place in self._places.values())

    def is_at(self, key: str, path: Path, offset: int) -> bool:
        """Whether the result of a case is the one in the unit at `path` and `offset`."""
        place = self._places.get(key)
        return place is not None and place[1] >= 0 and self._units[place[1]][0] == path and place[2] == offset

    def where(self, key: str) -> str:
        """The file that holds the result of a case, which must have one."""
        unit = self._places[key][1]
        return "the cube" if unit < 0 else str(self._units[unit][0])

    def take_cube(self, cube: EarlierCube) -> Counter[tuple[str, ...]]:
        """Note the cases of a cube, which this index owns, and closes, from now on.

        Returns how many solved cases of the study in it do not count, by the names of the scalars that they lack; by
        none if they lack fields that are to be kept.
        """
        self.cube = cube
        lacking: Counter[tuple[str, ...]] = Counter()
        serves = [grid.keep.covers(self.keep) for grid in cube.grids]
        places = list(cube.places())
        self._leaving |= {key for key, status, _, _ in places if key not in self._scenes and status == Status.SOLVED}
        for key, status, grid, flat in places:
            if key not in self._scenes:
                continue
            lacks = _lacks(cube.grids[grid].scalars, self._scenes[key])
            if status == Status.SOLVED and (lacks or not serves[grid]):
                lacking[tuple(sorted(lacks))] += 1
            else:
                self._put(key, (status, -1, grid, flat))
        return lacking

    def losses(self) -> str:
        """What will not be in the next cube, in words, "" if nothing: cases of cube and units, fields of the cube.

        Fields of units are not told of: no cube has held them, and outputs that ask for less were meant to.
        """
        leaving = len(self._leaving)
        lost = [f"{counted(leaving, 'solved case')} that the study no longer has"] if leaving else []
        kept = [] if self.cube is None else [grid.keep for grid in self.cube.grids if grid.keep.fields]
        if kept and not self.keep.fields:
            lost.append("all fields")
        elif any(keep.precision == "float64" for keep in kept) and self.keep.precision == "float32":
            lost.append("fields in float64 (precision: float32)")
        if self.keep.fields and self.keep.crop and self._holds_whole_windows():
            lost.append("cells outside the contacts (crop: contact)")
        return " and ".join(lost)

    def _holds_whole_windows(self) -> bool:
        """Whether the cube has a case whose fields are not cropped."""
        return any(
            self.cube is not None and self.cube.is_whole(first, second, self._scenes[key])
            for key, (status, unit, first, second) in self._places.items()
            if unit < 0 and status == Status.SOLVED
        )

    def check_cube(self) -> int:
        """Read all cases that are taken from the cube, and forget the damaged ones; how many those are."""
        damaged = []
        for key, (_, unit, _, _) in self._places.items():
            if unit < 0:
                try:
                    self.record(key)
                except DamagedRecord:
                    damaged.append(key)
        for key in damaged:
            del self._places[key]
        self._checked = True
        return len(damaged)

    def take_unit(self, unit: Unit, data: bytes, *, thoroughly: bool = False) -> int:
        """Note the cases of a unit, whose bytes are `data`; the number of cases in it that are not of this study.

        `thoroughly`: decompress all fields. Raises BadUnit, having noted nothing, when the unit's content is invalid.
        """
        found, foreign, leaving, scalars = [], 0, set(), frozenset(unit.form.scalars)
        for key, offset, length in unit.entries:
            scene = self._scenes.get(key)
            body = data[offset : offset + length]
            try:
                status, cells, keep = read_head(body, unit.form)
                if scene is None:
                    foreign += 1
                    if status == Status.SOLVED:
                        leaving.add(key)
                    continue
                if thoroughly:
                    record = parse(body, unit.form)
                    for name in record.fields:
                        record.values(name)
            except DamagedRecord as error:
                raise BadUnit(f"case {key[:12]}: {error}") from error
            if cells != scene.mesh.cells:
                raise BadUnit(f"case {key[:12]} has {cells[0]} x {cells[1]} cells, its mesh another number")
            if status != Status.SOLVED or (keep.covers(self.keep) and not _lacks(scalars, scene)):
                found.append((key, status, offset, length))
        self._add(unit, found)
        self._leaving |= leaving
        return foreign

    def take_written(self, unit: Unit, statuses: Iterable[Status]) -> None:
        """Note the cases of a unit that has just been written, with their statuses."""
        entries = zip(unit.entries, statuses, strict=True)
        self._add(unit, [(key, status, offset, length) for (key, offset, length), status in entries])

    def _add(self, unit: Unit, found: Iterable[tuple[str, Status, int, int]]) -> None:
        number = len(self._units)
        self._units.append((unit.path, unit.form))
        for key, status, offset, length in found:
            self._put(key, (status, number, offset, length))

    def _put(self, key: str, place: tuple[Status, int, int, int]) -> None:
        """Note a place. A failure never replaces a solution; else units replace the cube, later units earlier ones."""
        before = self._places.get(key)
        if before is None or _rank(place) >= _rank(before):
            self._places[key] = place

    def record(self, key: str) -> Record:
        """The record of a case. Raises KeyError where there is none, DamagedRecord if it cannot be read."""
        status, unit, first, second = self._places[key]
        if unit < 0:
            assert self.cube is not None
            checked = self._checked and status == Status.SOLVED
            return self.cube.record(first, second, self._scenes[key], checked=checked)
        path, form = self._units[unit]
        try:
            body = os.pread(self._descriptor(unit), second, first)
        except OSError as error:  # a user may have taken the unit away
            raise DamagedRecord(f"{path}: {error.strerror or error}") from error
        return parse(body, form)

    def _descriptor(self, unit: int) -> int:
        """The open file of a unit; if too many are open, the least recently used one is closed."""
        if unit in self._open:
            self._open.move_to_end(unit)
            return self._open[unit]
        if len(self._open) >= _OPEN_FILES:
            os.close(self._open.popitem(last=False)[1])
        descriptor = os.open(self._units[unit][0], os.O_RDONLY | os.O_CLOEXEC)
        self._open[unit] = descriptor
        return descriptor


def _rank(place: tuple[Status, int, int, int]) -> tuple[bool, int]:
    return place[0] == Status.SOLVED, place[1]


def _lacks(scalars: frozenset[str], scene: Scene) -> frozenset[str]:
    """The scalars that a solution of `scene` has to have, besides those that it has."""
    return expected_scalars(tangential=scene.creepage is not None) - scalars
