"""The cube from the results of its cases: case by case, in bounded memory, in the study's own order.

The order makes two cubes of one study the same to the last byte, whatever order their cases were solved in, but for
times and the attributes of the run. Cases are solved in about that order too, so most of the cube is there when the
last one is solved.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from rcstudy.cube_writer import CubeWriter, writing
from rcstudy.errors import UserError
from rcstudy.record import DamagedRecord, Region

if TYPE_CHECKING:
    from rcstudy.cases import Expansion
    from rcstudy.mechanics.scene import Mesh
    from rcstudy.store import Store
    from rcstudy.study import Study

AT_ONCE = 64  # cases handed to HDF5 while Ctrl-C waits: many, so that its code stays in the processor's caches
_CELLS_AT_ONCE = 2**22  # of all these cases: their records are in memory meanwhile


class Assembly:
    """A cube in the making from the results in `store`, perhaps while others are still being solved.

    When something goes wrong before the end, the file is dropped, so that a disk that is full has room for results; it
    is made again by :meth:`finish`, which publishes it. A block that is left without that leaves no trace.
    """

    def __init__(self, output: Path, study: Study, expansion: Expansion, store: Store) -> None:
        self.output = output
        self._study, self._expansion, self._store = study, expansion, store
        self._cube: CubeWriter | None = None
        self._open = contextlib.ExitStack()
        self._taken = 0  # the first so many cases are in the cube
        meshes = {case.scene.mesh for case in expansion.cases}
        most = max(mesh.cells[0] * mesh.cells[1] for mesh in meshes)
        self._at_once = max(1, min(AT_ONCE, _CELLS_AT_ONCE // most))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._drop()

    def begin(self) -> None:
        """Create the file, unless it is there or what it holds of a case depends on others."""
        if self._cube is None and self._study.outputs.crop != "contact":
            with contextlib.suppress(UserError):
                self._create(None)

    def go_on(self) -> None:
        """Take the next few cases, if their results are final."""
        cases = self._expansion.cases[self._taken : self._taken + self._at_once]
        if self._cube is None or not cases or not all(self._store.is_final(case.key) for case in reversed(cases)):
            return
        try:
            self._take()
        except (OSError, DamagedRecord):
            self._drop()

    def give_way(self) -> bool:
        """Drop the file, whose place the results may need; whether there was one."""
        there = self._cube is not None
        self._drop()
        return there

    def finish(
        self,
        provenance: Mapping[str, str | int | float],
        started: float,
        check_interrupts: Callable[[], None] = lambda: None,
    ) -> None:
        """Take all cases that are left, and publish the cube. `started`: time.monotonic() of the sweep's begin.

        Raises UserError when the cube cannot be written, or a record that was whole when it was found can no longer be
        read.
        """
        if self._cube is None:
            self._create(contacts(self._expansion, self._store) if self._study.outputs.crop == "contact" else None)
        assert self._cube is not None
        try:
            with self._open:
                while self._taken < len(self._expansion.cases):
                    check_interrupts()
                    self._take()
                self._cube.finish(provenance, started)
        except DamagedRecord as error:
            raise UserError(f"{self.output}: not written, a result can no longer be read: {error}") from error

    def _create(self, cropped: Mapping[str, Mapping[Mesh, Region]] | None) -> None:
        self._taken = 0
        self._cube = self._open.enter_context(writing(self.output, self._study, self._expansion, cropped))

    def _take(self) -> None:
        assert self._cube is not None
        cases = self._expansion.cases[self._taken : self._taken + self._at_once]
        self._cube.add([(case, self._store.record(case.key)) for case in cases])
        self._taken += len(cases)

    def _drop(self) -> None:
        """Remove the file, if it is not published."""
        self._cube = None
        with contextlib.suppress(_Dropped, UserError), self._open:
            raise _Dropped


class _Dropped(Exception):
    """Ends the writing of a file that is not wanted."""


def contacts(expansion: Expansion, store: Store) -> dict[str, dict[Mesh, Region]]:
    """The smallest box of cells, for each mesh of each grid, that holds the contacts of all its cases.

    At least two cells each way: who reads the cube tells their size from their centres.
    """
    found: dict[str, dict[Mesh, Region]] = {grid.name: {} for grid in expansion.grids}
    for case in expansion.cases:
        record = store.record(case.key)
        whole = record.shape == record.cells
        i0, i1, j0, j1 = record.contact() if whole else record.region
        if i0 == i1:
            continue
        i0, i1 = _two_wide(i0, i1)
        j0, j1 = _two_wide(j0, j1)
        boxes = found[case.grid]
        a0, a1, b0, b1 = boxes.get(case.scene.mesh, (i0, i1, j0, j1))
        boxes[case.scene.mesh] = min(i0, a0), max(i1, a1), min(j0, b0), max(j1, b1)
    return found


def _two_wide(low: int, high: int) -> tuple[int, int]:
    """The range of cells low to high, not empty, made two wide if it is one; windows have more."""
    if high - low > 1:
        return low, high
    return (low - 1, high) if low > 0 else (low, high + 1)
