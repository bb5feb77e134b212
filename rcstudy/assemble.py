"""Assembles a cube from the results of its cases: case by case, in bounded memory, in the study's own order.

Because of that order two cubes of one study are equal to the last byte, except for times and the attributes of the run,
whatever order their cases were solved in. Cases are solved in about the same order, so most of the cube is written when
the last one is solved.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from rcstudy.errors import UserError
from rcstudy.mechanics.literature import behind, listed
from rcstudy.storage.cube_writer import CubeWriter, writing
from rcstudy.storage.earlier import refuse_foreign, refuse_other_study, state_of
from rcstudy.storage.layout import REFERENCES
from rcstudy.storage.record import DamagedRecord, Region

if TYPE_CHECKING:
    from rcstudy.cases import Expansion
    from rcstudy.mechanics.scene import Mesh
    from rcstudy.store import Store
    from rcstudy.study import Study

AT_ONCE = 64  # cases handed to HDF5 while Ctrl-C waits; many, so that HDF5's code stays in the processor's caches
_CELLS_AT_ONCE = 2**22  # most cells of these cases together, as their records are in memory meanwhile


class Assembly:
    """A cube being made from the results in `store`, possibly while other cases are still being solved.

    If something goes wrong before the end, the file is removed, so that results have room on a full disk, and made
    again by :meth:`finish`. Only :meth:`finish` publishes the cube: a ``with`` block that ends without it leaves no
    file.
    """

    def __init__(self, output: Path, study: Study, expansion: Expansion, store: Store) -> None:
        self.output = output
        self._study, self._expansion, self._store = study, expansion, store
        self._cube: CubeWriter | None = None
        self._open = contextlib.ExitStack()
        self._taken = 0  # so many cases, in order, are in the cube
        meshes = {case.scene.mesh for case in expansion.cases}
        most = max(mesh.cells[0] * mesh.cells[1] for mesh in meshes)
        self._at_once = max(1, min(AT_ONCE, _CELLS_AT_ONCE // most))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._drop()

    def begin(self) -> None:
        """Create the file, unless it exists or its fields are to be cropped, which needs the contacts of all cases."""
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
        """Remove the file, as the results may need its disk space; whether there was one."""
        there = self._cube is not None
        self._drop()
        return there

    def finish(
        self,
        provenance: Mapping[str, str | int | float],
        started: float,
        check_interrupts: Callable[[], None] = lambda: None,
    ) -> None:
        """Take all cases that are left, and publish the cube. `started`: time.monotonic() at the sweep's start.

        Raises UserError when the cube cannot be written, a record that was whole when it was found can no longer be
        read, or something else than a cube of this study has come to be where the cube goes meanwhile.
        """
        try:
            if self._cube is None:
                self._create(contacts(self._expansion, self._store) if self._study.outputs.crop == "contact" else None)
            assert self._cube is not None
            with self._open:
                while self._taken < len(self._expansion.cases):
                    check_interrupts()
                    self._take()
                sources = listed(behind(case.scene for case in self._expansion.cases))
                self._cube.finish({**provenance, REFERENCES: sources}, started)
                if state_of(self.output) != self._store.checked:
                    refuse_foreign(self.output)
                    refuse_other_study(self.output, self._study.name)
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
    """Raised to abandon the file that is being written."""


def contacts(expansion: Expansion, store: Store) -> dict[str, dict[Mesh, Region]]:
    """The smallest box of cells, for each mesh of each grid, that holds the contacts of all its cases.

    It has at least two cells each way, since readers of the cube derive the cells' size from their centres.
    """
    found: dict[str, dict[Mesh, Region]] = {grid.name: {} for grid in expansion.grids}
    for case in expansion.cases:
        record = store.record(case.key)
        # cut to the contact of this case alone, unless it is whole, or from a cube, which holds those of other cases
        own = record.shape != record.cells and not store.index.in_cube(case.key)
        i0, i1, j0, j1 = record.region if own else record.contact()
        if i0 == i1:
            continue
        i0, i1 = _two_wide(i0, i1)
        j0, j1 = _two_wide(j0, j1)
        boxes = found[case.grid]
        a0, a1, b0, b1 = boxes.get(case.scene.mesh, (i0, i1, j0, j1))
        boxes[case.scene.mesh] = min(i0, a0), max(i1, a1), min(j0, b0), max(j1, b1)
    return found


def _two_wide(low: int, high: int) -> tuple[int, int]:
    """The range of cells low <= i < high, not empty, widened to two cells if it is one; windows have more."""
    if high - low > 1:
        return low, high
    return (low - 1, high) if low > 0 else (low, high + 1)
