"""Figures of a cube: the paper's Figures 3 to 10 as it lays them out, and an overview of every other grid.

Entry: :func:`make_figures`. Matplotlib is imported only when a figure is drawn, and its global state is
left as it was.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rcstudy.errors import UserError
from rcstudy.report.overview import case_maps, overview_figure
from rcstudy.report.paper import AXES, paper_grids
from rcstudy.report.paper_figures import paper_figure
from rcstudy.report.quantities import QUANTITIES
from rcstudy.report.style import check_formats, log, save, style
from rcstudy.report.views import GridView, grids
from rcstudy.storage.publish import make_folder
from rcstudy.studyfile.yamltree import suggest

if TYPE_CHECKING:
    import xarray as xr


def make_figures(
    tree: xr.DataTree,
    out: Path,
    formats: Sequence[str] = ("png", "pdf"),
    at: Mapping[str, str] | None = None,
    along: str = "",
    quantities: Sequence[str] = tuple(QUANTITIES),
) -> list[Path]:
    """Draw what the cube has: the paper's figures from its grids, an overview of each other grid.

    `tree` is an opened cube (`rcstudy.open`), `out` the folder to write into (made if need be), `formats`
    of png, pdf, svg (each is written once). `at`: values of axes that overviews are to show, by the names of the axes,
    in place of a grid's first ones; see `GridView.held_at`. `along`: axis of numbers along which curves are drawn in
    overviews of the grids that have it. `quantities`: what their panels show, of `quantities.CHOICES`. Returns the
    files written. A figure of the paper whose grid is missing from a cube that has others, or whose fields are not
    stored, is left out with a logged warning. UserError if nothing can be drawn, if no grid that has an overview has a
    value of `at` or the axis `along`, if `at` has a value of `along`, or if no overview is there to show other
    `quantities`.
    """
    check_formats(formats)
    if along in (at or {}):
        raise UserError(f"--along: {along}: --at gives it a single value: only one of the two may name an axis")
    formats = tuple(dict.fromkeys(formats))
    found = grids(tree)
    paper = paper_grids(found)
    of_paper = {axis for grid in paper.values() for axis in grid.axes}
    for axis, value in (at or {}).items():
        found |= _held_at({name: grid for name, grid in found.items() if name not in paper}, axis, value, of_paper)
    if along:
        _check_along([grid for name, grid in found.items() if name not in paper], along, of_paper)
    if tuple(quantities) != tuple(QUANTITIES) and not found.keys() - paper.keys():
        raise UserError("--quantities: the cube has no grid but the paper's, whose figures show what they do in print")
    make_folder(out)
    paths: list[Path] = []
    with style():
        for name in AXES if paper else ():
            try:
                figure = paper_figure(name, paper)
            except UserError as error:
                log.warning("%s skipped: %s", name.replace("_", " "), error)
            else:
                paths += save(figure, out, name, formats)
        for name, grid in found.items():
            if name not in paper:
                paths += save(overview_figure(grid, along, quantities), out, name, formats)
                maps = case_maps(grid)
                if maps is not None:
                    paths += save(maps, out, _name_of_maps(name, found), formats)
    if not paths:
        raise UserError("the cube has nothing to draw: it stores none of the fields that the paper's figures show")
    return paths


def _name_of_maps(grid: str, grids: Collection[str]) -> str:
    """Name of the file of a grid's maps, which no grid's overview has: GRID_maps, or the same with more of `_`."""
    name = f"{grid}_maps"
    while name in grids:
        name += "_"
    return name


_ALL_SHOWN = "is an axis of the paper's figures alone, which show all of it"


def _held_at(found: Mapping[str, GridView], axis: str, value: str, of_paper: Collection[str]) -> dict[str, GridView]:
    """Those of the grids that have `value` on `axis`, with that alone; UserError if none has.

    `of_paper`: the axes of the paper's grids, which are not among `found`.
    """
    held = {name: narrow for name, grid in found.items() if (narrow := grid.held_at(axis, value)) is not None}
    if held:
        return held
    having = [f"{name}: {', '.join(grid.axis_values(axis))}" for name, grid in found.items() if axis in grid.axes]
    if having:
        raise UserError(f"--at: {axis}={value}: {axis} must be a value of a grid ({'; '.join(having)})")
    if axis in of_paper:
        raise UserError(f"--at: {axis}={value}: {axis} {_ALL_SHOWN}")
    axes = dict.fromkeys(axis for grid in found.values() for axis in grid.axes)
    raise UserError(f"--at: {axis}={value}: no grid has this axis: {suggest(axis, axes)}")


def _check_along(found: Sequence[GridView], along: str, of_paper: Collection[str]) -> None:
    """UserError unless `along` is an axis of numbers of one of the grids; `of_paper`: as above."""
    numeric = dict.fromkeys(axis for grid in found for axis in grid.axes if grid.numeric(axis))
    if along not in numeric:
        known = any(along in grid.axes for grid in found)
        if along in of_paper and not known:
            raise UserError(f"--along: {along}: {along} {_ALL_SHOWN}")
        problem = "not an axis of numbers" if known else "no grid has this axis"
        allowed = suggest(along, numeric) if numeric else "no grid has an axis of numbers"
        raise UserError(f"--along: {along}: {problem}: {allowed}")
