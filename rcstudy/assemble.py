"""The cube from the results that are on the disk: case by case, in bounded memory, in the study's own order.

The order makes two cubes of one study the same to the last byte, whatever order their cases were solved in, but for
times and what is told of the run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rcstudy.cube_writer import write_cube
from rcstudy.errors import UserError
from rcstudy.record import DamagedRecord, Record, Region

if TYPE_CHECKING:
    from rcstudy.cases import Case, Expansion
    from rcstudy.index import Index
    from rcstudy.mechanics.scene import Mesh
    from rcstudy.study import Study


def assemble(
    output: Path,
    study: Study,
    expansion: Expansion,
    index: Index,
    provenance: Mapping[str, str | int | float],
    started: float,
    check_interrupts: Callable[[], None] = lambda: None,
) -> None:
    """Publish the cube `output` from the records in `index`, which has one for each case.

    `started`: time.monotonic() of the sweep's begin. Raises UserError when the cube cannot be written, or a record
    that was whole when it was found can no longer be read.
    """

    def records() -> Iterator[tuple[Case, Record]]:
        for case in expansion.cases:
            check_interrupts()
            yield case, index.record(case.key)

    try:
        cropped = contacts(expansion, index) if study.outputs.crop == "contact" else None
        write_cube(output, study, expansion, records(), provenance, started=started, cropped=cropped)
    except DamagedRecord as error:
        raise UserError(f"{output}: not written, a result can no longer be read: {error}") from error


def contacts(expansion: Expansion, index: Index) -> dict[str, dict[Mesh, Region]]:
    """The smallest box of cells, for each mesh of each grid, that holds the contacts of all its cases."""
    found: dict[str, dict[Mesh, Region]] = {grid.name: {} for grid in expansion.grids}
    for case in expansion.cases:
        record = index.record(case.key)
        whole = record.shape == record.cells
        i0, i1, j0, j1 = record.contact() if whole else record.region
        if i0 == i1:
            continue
        boxes = found[case.grid]
        a0, a1, b0, b1 = boxes.get(case.scene.mesh, (i0, i1, j0, j1))
        boxes[case.scene.mesh] = min(i0, a0), max(i1, a1), min(j0, b0), max(j1, b1)
    return found
