"""Overview of any grid: its resultants along its first axis, and the maps of its first cases."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rcstudy.report import measures
from rcstudy.report.labels import literal
from rcstudy.report.layout import caption, conditions, legend, panels
from rcstudy.report.paper_figures import MAPS, maps_figure
from rcstudy.report.style import LINES
from rcstudy.report.views import CaseView, GridView
from rcstudy.result import Status

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

QUANTITIES = {
    "contact_radius": "contact radius (mm)",
    "pressure_max": "peak pressure (MPa)",
    "slip_area": "slip area / contact area",
    "force_x": "$F_x$ (N)",
    "force_y": "$F_y$ (N)",
    "moment_z": "$M_z$ (N mm)",
}
"""What an overview shows, by the stored variable it needs."""

MAPS_AT_MOST = 12

NIL = 1e-6
"""Share of its natural scale below which a force or moment is nil in all cases of a grid and has no panel.

Where symmetry makes a number nil, rounding and the solver's tolerance (1e-7 unless the study says otherwise) leave
less than this; creepages whose forces are as small do not occur.
"""


def overview_figure(grid: GridView) -> Figure:
    """Resultants against the first axis, a line per value of the second; further axes at their first value.

    An axis of labels (or of several numbers) is drawn evenly spaced with its labels. Cases that were not
    solved leave gaps, which the caption counts.
    """
    names = [name for name in QUANTITIES if name in grid and not _nil(grid, name)]
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    figure, axes = panels(rows, columns, 2.2 * rows + 0.3)
    for ax in axes.flat[len(names) :]:
        ax.set_visible(False)
    lines = _chosen(grid.shape[1]) if len(grid.axes) > 1 else [0]
    for ax, name in zip(axes.flat, names, strict=False):
        for line, at in enumerate(lines):
            cases = [grid.case(*_index(grid, i, at)) for i in range(grid.shape[0] if grid.axes else 1)]
            values = [measures.slip_ratio(c) if name == "slip_area" else c.number(name) for c in cases]
            ax.plot(_positions(grid), values, **_look(grid, line))
        ax.set_ylabel(QUANTITIES[name])
        _label_axis(ax, grid)
    if len(grid.axes) > 1:
        words = [literal(value) for value in grid.axis_values(grid.axes[1])]
        legend(figure, {f"{grid.axes[1]} = {words[at]}": _look(grid, k) for k, at in enumerate(lines)})
    caption(figure, f"{grid.name}: {_remarks(grid, len(lines))}{conditions(grid)}")
    return figure


def _nil(grid: GridView, name: str) -> bool:
    """Whether a force or moment is nothing but rounding in every case: symmetry makes it nil."""
    if name not in ("force_x", "force_y", "moment_z"):
        return False
    natural = grid.small("friction") * grid.small("load")
    if name == "moment_z":
        natural = natural * grid.small("contact_radius")
    largest = abs(grid.small(name) / natural).where(grid.small("status") == Status.SOLVED).max()
    return bool(largest < NIL)  # not where no case is solved: NaN


def case_maps(grid: GridView) -> Figure | None:
    """Traction maps of the grid's first cases (at most twelve); None if it stores no tractions."""
    if not {"traction_x", "traction_y", "state"} <= set(map(str, grid.dataset.data_vars)):
        return None
    cases = [case for case, _ in zip(grid.cases(), range(MAPS_AT_MOST), strict=False)]
    figure = maps_figure(cases, _title)
    total = int(np.prod(grid.shape))
    shown = f" The first {MAPS_AT_MOST} of {total} cases." if total > MAPS_AT_MOST else ""
    caption(figure, f"{grid.name}: {MAPS}{shown} {conditions(grid)}")
    return figure


def _title(case: CaseView) -> str:
    words, lines = case.label.split(", "), [""]
    for word in words:
        if lines[-1] and len(lines[-1]) + len(word) > 36:
            lines.append("")
        lines[-1] += (", " if lines[-1] else "") + word
    return literal("\n".join(lines))


def _index(grid: GridView, first: int, second: int) -> tuple[int, ...]:
    return (first, second, *(0 for _ in grid.axes[2:]))[: len(grid.axes)]


def _chosen(size: int) -> list[int]:
    """Positions of the lines: all, or as many as there are looks, evenly spread."""
    return sorted(set(np.linspace(0, size - 1, min(size, len(LINES))).round().astype(int).tolist()))


def _look(grid: GridView, line: int) -> dict[str, Any]:
    """The look of a line; labels are not joined, for nothing lies between them."""
    return LINES[line] if _numeric(grid) else LINES[line] | {"linestyle": "", "markersize": 4}


def _numeric(grid: GridView) -> bool:
    return bool(grid.axes) and grid.axes[0] in grid and grid.small(grid.axes[0]).dtype.kind in "if"


def _positions(grid: GridView) -> np.ndarray:
    if _numeric(grid):
        return np.asarray(grid.small(grid.axes[0]).values, dtype=float)
    return np.arange(grid.shape[0] if grid.axes else 1, dtype=float)


def _label_axis(ax: Axes, grid: GridView) -> None:
    if not grid.axes:
        ax.set_xticks([])
        return
    axis = grid.axes[0]
    units = str(grid.small(axis).attrs.get("units", "1")) if axis in grid else "1"
    ax.set_xlabel(axis.replace("_", " ") + (f" ({units})" if _numeric(grid) and units not in ("1", "") else ""))
    if not _numeric(grid):
        labels = [literal(value) for value in grid.axis_values(axis)]
        every = -(-len(labels) // 12)
        ax.set_xticks(range(0, len(labels), every), labels[::every], rotation=30, ha="right")


def _remarks(grid: GridView, lines: int) -> str:
    remarks = []
    failed = int((grid.small("status").values != 0).sum())
    if failed:
        remarks.append(f"{failed} of {grid.small('status').size} cases not solved (gaps).")
    if len(grid.axes) > 1 and lines < grid.shape[1]:
        remarks.append(f"{lines} of {grid.shape[1]} values of {grid.axes[1]}.")
    nil = [QUANTITIES[name].split(" (")[0] for name in QUANTITIES if name in grid and _nil(grid, name)]
    if nil:
        remarks.append(f"Nil in all cases: {', '.join(nil)}.")
    held = [f"{axis} = {literal(grid.axis_values(axis)[0])}" for axis in grid.axes[2:]]
    if held:
        remarks.append(f"Shown for {', '.join(held)}.")
    return " ".join([*remarks, ""])
