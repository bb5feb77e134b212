"""What goes into one panel: lines on the x-axis, a map of traction with stick and slip or of pressure, or why none."""

from __future__ import annotations

import itertools
import math
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rcstudy.report.labels import wrapped
from rcstudy.report.measures import on_x_axis, traction
from rcstudy.report.style import VERMILLION
from rcstudy.report.views import CaseView
from rcstudy.result import CellState

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.ticker import Locator

ARROWS = 9
"""Approximate number of arrows across a contact."""

ARROW = 0.165
"""Width of an arrow's shaft over its length, of which the head takes six tenths, however small the arrow is."""

ARROWS_AT_MOST = 11
"""Approximate largest number of arrows across a panel."""

LEAST_ARROW = 0.02
"""Share of the largest traction above which it has an arrow: below it the direction means little."""

CIRCLES = 44
"""Approximate largest number of circles across a panel: on finer meshes not every cell has a circle."""

_ALIKE = 1.15
"""Largest ratio of the numbers of cells across two contacts that are about the same."""

_FEWEST = 12
"""Approximate number of circles across a panel below which contacts are not made to look alike: too far apart."""

APART = 3.0
"""Ratio of the sizes of two contacts above which each panel has a scale of its own."""

_LARGEST = 0.08
"""Largest diameter of a circle over a panel's longer side, so that few circles do not cover the colours."""

_LONGEST = 0.12
"""Largest length of an arrow over a panel's longer side: circles of that diameter are seen beneath its head."""

ROOM = 1.15
"""Half a panel's side over what has to fit into it."""

MORE = 1.2
"""Factor by which the shorter side of a window is enlarged where the window is low or stretched."""

SHAPES = (0.45, 1.25)
"""Smallest and largest height of a map's panel over its width."""

_SHORT_NUMBERS = 0.1
"""Largest |x| of a panel, mm, below which the numbers along x have three decimals or more."""

_AT_END = 0.04
"""Half the width of a number along x over that of a panel of three beside each other."""

ROOMY = 0.5
"""Least share of a panel's height, or width, for the largest contact; if it would have less, it is stretched."""


def remark(ax: Axes, lines: Sequence[str], *, top: bool = False) -> None:
    """Write in a panel which of its cases have no result and why: in its middle, or at its `top` above the lines.

    Each of `lines` may hold mathematics; text from a study or cube must have passed `labels.literal`.
    """
    ax.text(
        0.5,
        0.97 if top else 0.5,
        "\n".join(part for line in lines for part in wrapped(textwrap.shorten(line, 120), 48 if top else 30)),
        transform=ax.transAxes,
        ha="center",
        va="top" if top else "center",
        fontsize=6 if top else 6.5,
        bbox={"facecolor": "white", "edgecolor": VERMILLION, "linewidth": 0.8, "boxstyle": "square,pad=0.2"},
        zorder=5,
        gid="remark",
    )


def pressure_line(ax: Axes, case: CaseView, label: str, look: dict[str, Any]) -> None:
    """p over Hertz's p0 against x over Hertz's a on the x-axis (mean of the rows next to it, see `on_x_axis`)."""
    a, p0 = case.stored("hertz_radius"), case.stored("hertz_pressure")
    x, p = _on_axis(case, "pressure")
    inside = _with_edges(p > 0)
    ax.plot(x[inside] / a, p[inside] / p0, label=label, **look)


def traction_line(ax: Axes, case: CaseView, label: str, look: dict[str, Any]) -> None:
    """-q_x (traction on the counterbody) in MPa against x/a on the x-axis (mean of the rows next to it)."""
    a = case.stored("hertz_radius")
    x, qx = _on_axis(case, "traction_x")
    inside = _with_edges(_on_axis(case, "pressure")[1] > 0)
    ax.plot(x[inside] / a, -qx[inside], label=label, **look)


BOUND: dict[str, Any] = {"color": "0.35", "linestyle": "--", "linewidth": 0.9}
"""The look of the bound."""
BOUND_LABEL = r"bound $\pm\mu p$"


def bound_line(ax: Axes, case: CaseView) -> None:
    """Coulomb's bounds mu p and -mu p in MPa against x/a on the x-axis.

    Tractions may be reversed at the leading edge, and slip there at the other bound. The panel shows of it as much as
    its limits leave, which hold the tractions and the bound on the side of the force.
    """
    from matplotlib.lines import Line2D

    a = case.stored("hertz_radius")
    side = -np.sign(case.number("force_x")) or 1.0
    x, p = _on_axis(case, "pressure")
    bound = side * case.stored("friction") * p
    inside = _with_edges(bound != 0)
    ax.plot(x[inside] / a, bound[inside], label=BOUND_LABEL, zorder=1, **BOUND)
    ax.add_artist(Line2D(x[inside] / a, -bound[inside], zorder=1, **BOUND))


def _on_axis(case: CaseView, name: str) -> tuple[np.ndarray, np.ndarray]:
    """x (mm) and the values of a field on the x-axis, with a cell of nothing at either end.

    With `crop: contact` no cell may be stored beside the contact. Values have seven digits of the largest: PDFs would
    differ from machine to machine by its rounding.
    """
    field, x = case.field(name), case.x  # in this order: without fields there is no x
    values = on_x_axis(field, case.y)
    unit = 10.0 ** (math.floor(math.log10(np.abs(values).max(initial=0.0) or 1.0)) - 6)
    return np.array([2.0 * x[0] - x[1], *x, 2.0 * x[-1] - x[-2]]), np.pad(np.round(values / unit) * unit, 1)


def _with_edges(inside: np.ndarray) -> np.ndarray:
    """The cells inside and their neighbours, so that a line comes down to zero."""
    wide = inside.copy()
    wide[1:] |= inside[:-1]
    wide[:-1] |= inside[1:]
    return wide


@dataclass(frozen=True)
class Window:
    """What a map's panel shows: from -`x` to `x` and from -`y` to `y` (mm), y drawn `stretch` times as large as x."""

    x: float
    y: float
    stretch: float = 1.0

    @property
    def shape(self) -> float:
        """Height of the panel over its width."""
        return self.y * self.stretch / self.x

    @property
    def longest(self) -> float:
        """The longer side of the panel as it is drawn, mm along x."""
        return 2.0 * max(self.x, self.y * self.stretch)

    def on(self, ax: Axes) -> None:
        """Give `ax` these limits, at the top of its place: the layout leaves room for titles above that.

        Long numbers along x, those of small contacts, have few ticks, as they would run into each other.
        """
        ax.set(xlim=(-self.x, self.x), ylim=(-self.y, self.y), aspect=self.stretch, anchor="N")
        ax.xaxis.set_major_locator(_inner_ticks(2 if self.x < _SHORT_NUMBERS else "auto"))

    def pitches(self, case: CaseView, steps: tuple[int, int]) -> tuple[float, float]:
        """Distances of every `steps`-th cell along x and y as they are drawn, mm along x."""
        dx, dy = case.spacing
        return steps[0] * dx, steps[1] * dy * self.stretch


def _inner_ticks(most: int | Literal["auto"]) -> Locator:
    """Ticks, `most` + 1 at most, none at the very ends of an axis if others stay.

    A number there would run into that of the panel beside.
    """
    from matplotlib.ticker import MaxNLocator

    class Inner(MaxNLocator):
        def tick_values(self, vmin: float, vmax: float) -> Sequence[float]:
            ticks = np.asarray(super().tick_values(vmin, vmax))
            inner = ticks[np.abs(ticks - 0.5 * (vmin + vmax)) < (0.5 - _AT_END) * (vmax - vmin)]
            return [float(tick) for tick in (inner if inner.size >= 3 else ticks)]

    return Inner(most, steps=[1, 2, 2.5, 5, 10])


def window(cases: Iterable[CaseView]) -> Window:
    """A window that holds the contacts of all these cases; of a unit square if there are none.

    Scales are the same along x and y, and room is left where panels would be too low or too high; only where a contact
    would still be too narrow to see anything in it is it stretched.
    """
    sides = np.array([case.half_sides for case in cases])
    if not len(sides):
        return Window(1.0, 1.0)
    x, y = (ROOM * float(side) for side in sides.max(axis=0))
    low, high = SHAPES
    if y < low * ROOMY * x:
        return Window(x, MORE * y, low * x / (MORE * y))
    if x < ROOMY / high * y:
        return Window(MORE * x, y, high * MORE * x / y)
    # room for the text in the corner, which would cover cells of low panels
    return Window(max(x, y / high), max(y, min(MORE * y, 0.7 * x), low * x))


def windows(cases: Sequence[CaseView]) -> list[Window]:
    """The window of each of these cases: that of all, or, if sizes of contacts differ by more than `APART`, its own.

    Windows of different size have the same shape and stretch.
    """
    shared = window(cases)
    sizes = [max(x / shared.x, y / shared.y) for x, y in (case.half_sides for case in cases)]
    if not sizes or max(sizes) <= APART * min(sizes):
        return [shared] * len(sizes)
    return [Window(shared.x * size / max(sizes), shared.y * size / max(sizes), shared.stretch) for size in sizes]


def traction_map(
    ax: Axes, case: CaseView, norm: Normalize, colours: Colormap, shown: Window, steps: tuple[int, int]
) -> None:
    """Map of |q| with one marker per contact cell and arrows along q.

    Cells are coloured by |q| (MPa, `norm`); slip cells carry a filled circle, stick cells an open one (every
    `steps`-th cell along x and y, see `circle_steps`); arrows of equal length give the direction of the traction on a
    coarser grid, at its true angle, where |q| is above `LEAST_ARROW` of its largest. Axes in mm.
    """
    from matplotlib.collections import EllipseCollection

    qx, qy = traction(case)
    _coloured(ax, case, np.hypot(qx, qy), norm, colours)
    shown.on(ax)
    i, j = np.nonzero(case.contact)
    longest = max(shown.pitches(case, (int(np.ptp(i)) + 1, int(np.ptp(j)) + 1)))
    # in small contacts fewer: arrows that can be seen
    wanted = _steps(shown.pitches(case, (1, 1)), max(longest / ARROWS, shown.longest / ARROWS_AT_MOST))
    # larger steps would leave marks at the tips of a narrow contact alone, or none: those next to the axis are half a
    # step away from it where the number of cells is even
    every = min(wanted[0], int(np.ptp(i)) // 2 | 1), min(wanted[1], int(np.ptp(j)) // 2 | 1)
    _arrows(ax, case, qx, qy, every, shown)
    # beneath an arrow in each cell a circle has to be wider than the arrow's head
    diameter = (0.75 if every == (1, 1) else 0.5) * min(shown.pitches(case, steps))
    diameter = min(diameter, _LARGEST * shown.longest)
    chosen = _chosen(case, steps)
    for which, face in ((CellState.SLIP, "black"), (CellState.STICK, "none")):
        i, j = np.nonzero(chosen & (case.state == which))
        # circles in the axes' own units, so that they keep to their cells at any size of the panel
        ax.add_collection(
            EllipseCollection(
                widths=[diameter],
                heights=[diameter / shown.stretch],
                angles=[0.0],
                units="xy",
                offsets=np.column_stack([case.x[i], case.y[j]]),
                offset_transform=ax.transData,
                facecolors=face,
                edgecolors="black",
                linewidths=0.45,
                zorder=3,
                gid=which.name.lower(),
            ),
            autolim=False,
        )


def pressure_map(ax: Axes, case: CaseView, norm: Normalize, colours: Colormap, shown: Window) -> None:
    """Map of p: contact cells are coloured by it (MPa, `norm`). Axes in mm."""
    _coloured(ax, case, case.field("pressure"), norm, colours)
    shown.on(ax)


def _coloured(ax: Axes, case: CaseView, values: np.ndarray, norm: Normalize, colours: Colormap) -> None:
    """Colour the cells in contact by `values`, [nx, ny]."""
    i, j = np.nonzero(case.contact)
    box = np.s_[i.min() : i.max() + 1, j.min() : j.max() + 1]
    dx, dy = case.spacing
    x, y = case.x[box[0]], case.y[box[1]]
    ax.imshow(
        np.ma.array(values, mask=~case.contact)[box].T,
        origin="lower",
        interpolation="nearest",
        cmap=colours,
        norm=norm,
        extent=(x[0] - dx / 2, x[-1] + dx / 2, y[0] - dy / 2, y[-1] + dy / 2),
    )


def circle_steps(cases: Sequence[CaseView], shown: Sequence[Window]) -> list[tuple[int, int]]:
    """Cells from one circle to the next along x and y in the panel of each case: 1 unless the mesh is fine; odd.

    `shown`: the windows of the panels. On a fine mesh cells are left out as circles could not be told apart. A contact
    of about as many cells as one where that is so, or of more, has no more circles, even if its cells are larger:
    windows that fit their contacts give all of them the same number of cells. It keeps its own circles where that would
    leave too few.
    """
    sizes = [window.pitches(case, (1, 1)) for case, window in zip(cases, shown, strict=True)]
    steps = [_steps(size, window.longest / CIRCLES) for size, window in zip(sizes, shown, strict=True)]
    across = [_cells_across(case) for case in cases]
    found = []
    for own, size, cells, window in zip(steps, sizes, across, shown, strict=True):
        most = (window.longest / _FEWEST) ** 2 / math.prod(size)
        alike = [math.prod(pair) for pair, n in zip(steps, across, strict=True) if n <= _ALIKE * cells]
        thinned = max((count for count in alike if count <= most), default=1)
        # a little less than the distance wanted, so that rounding does not leave out more
        wanted = (1.0 - 1e-9) * math.sqrt(thinned * math.prod(size))
        found.append(_steps(size, wanted) if thinned > math.prod(own) else own)
    return found


def _cells_across(case: CaseView) -> float:
    """Number of cells across the contact, the geometric mean of those along x and y."""
    return math.sqrt(math.prod(2.0 * side / step for side, step in zip(case.half_sides, case.spacing, strict=True)))


def _steps(cells: tuple[float, float], pitch: float) -> tuple[int, int]:
    """Steps from one mark to the next along x and y, in cells of the sizes `cells`, mm.

    Marks are about equally far from each other either way, and as many as if they were `pitch` apart or fewer. Steps
    are odd, so that a symmetric traction gives a symmetric picture on any mesh.
    """
    above = [2 * math.ceil(max(pitch / size - 1.0, 0.0) / 2.0) + 1 for size in cells]
    pairs = itertools.product(*({max(step - 2, 1), step, step + 2} for step in above))

    def badness(pair: tuple[int, ...]) -> float:
        """Deviation of the distances from the pitch and from each other; infinite if there are too many marks."""
        one, other = (math.log(step * size / pitch) for step, size in zip(pair, cells, strict=True))
        return (
            abs(one + other) / 2.0 + 2.0 * abs(one - other) if one + other >= 0.0 or list(pair) == above else math.inf
        )

    x, y = min(sorted(pairs, reverse=True), key=badness)
    return x, y


def _arrows(
    ax: Axes,
    case: CaseView,
    qx: np.ndarray,
    qy: np.ndarray,
    steps: tuple[int, int],
    shown: Window,
) -> None:
    size = np.hypot(qx, qy)
    chosen = _chosen(case, steps) & case.contact & (size > LEAST_ARROW * size.max())
    pitches = shown.pitches(case, steps)
    length = min(0.62 * math.sqrt(math.prod(pitches)), 0.9 * min(pitches), _LONGEST * shown.longest)
    i, j = np.nonzero(chosen)
    ax.quiver(
        case.x[i],
        case.y[j],
        length * qx[i, j] / size[i, j],
        length * qy[i, j] / size[i, j],
        angles="uv",
        scale_units="x",
        scale=1,
        pivot="mid",
        units="x",
        width=ARROW * length,
        headwidth=3.4,
        headlength=3.6,
        headaxislength=3.2,
        color=VERMILLION,
        edgecolor="white",
        linewidth=0.5,
        zorder=4,  # over the circles: black discs would hide them where all slips
        gid="direction",
    )


def _chosen(case: CaseView, steps: tuple[int, int]) -> np.ndarray:
    """Cells that carry a mark, [nx, ny]: every so many along x and y."""
    chosen = np.zeros((case.x.size, case.y.size), dtype=bool)
    chosen[np.ix_(_spread(case.x.size, steps[0]), _spread(case.y.size, steps[1]))] = True
    return chosen


def _spread(n: int, step: int) -> np.ndarray:
    """Every step-th of n cells, as many on one side of the middle as on the other (`step` odd)."""
    return np.arange((n - 1) * (step + 1) // 2 % step, n, step)
