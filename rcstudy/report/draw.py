"""What goes into one panel: lines on the x-axis, a map of traction with stick and slip, or why there is none."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rcstudy.report.labels import wrapped
from rcstudy.report.measures import on_x_axis, traction
from rcstudy.report.style import VERMILLION
from rcstudy.report.views import CaseView
from rcstudy.result import CellState

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, Normalize

ARROWS = 9
"""Arrows across a contact, about."""

CIRCLES = 44
"""Circles across a panel at most: on finer meshes not every cell has its own."""


def remark(ax: Axes, lines: Sequence[str], *, top: bool = False) -> None:
    """Say in a panel which of its cases have no result and why: in its middle, or at its `top` above the lines.

    Each of `lines` may hold mathematics; words that are not ours come through `labels.literal`.
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
    a, p0 = case.setting("hertz_radius"), case.setting("hertz_pressure")
    p = on_x_axis(case.field("pressure"), case.y)
    inside = _with_edges(p > 0)
    ax.plot(case.x[inside] / a, p[inside] / p0, label=label, **look)


def traction_line(ax: Axes, case: CaseView, label: str, look: dict[str, Any]) -> None:
    """-q_x (traction on the counterbody) in MPa against x/a on the x-axis (mean of the rows next to it)."""
    a = case.setting("hertz_radius")
    qx = on_x_axis(case.field("traction_x"), case.y)
    inside = _with_edges(on_x_axis(case.field("pressure"), case.y) > 0)
    ax.plot(case.x[inside] / a, -qx[inside], label=label, **look)


BOUND: dict[str, Any] = {"color": "0.35", "linestyle": "--", "linewidth": 0.9}
"""The look of the bound."""


def bound_line(ax: Axes, case: CaseView, label: str) -> None:
    """Coulomb's bound mu p in MPa against x/a on the x-axis, on the side where the traction is."""
    a = case.setting("hertz_radius")
    side = -np.sign(case.number("force_x")) or 1.0
    bound = side * case.setting("friction") * on_x_axis(case.field("pressure"), case.y)
    inside = _with_edges(bound != 0)
    ax.plot(case.x[inside] / a, bound[inside], label=label, zorder=1, **BOUND)


def _with_edges(inside: np.ndarray) -> np.ndarray:
    """The cells inside and their neighbours, so that a line comes down to zero."""
    wide = inside.copy()
    wide[1:] |= inside[:-1]
    wide[:-1] |= inside[1:]
    return wide


def contact_extent(case: CaseView) -> float:
    """Largest |x| or |y| of a contact cell's outer edge, mm."""
    i, j = np.nonzero(case.field("state") != CellState.EXTERIOR)
    dx, dy = case.spacing
    return float(max(np.abs(case.x[i]).max() + dx / 2, np.abs(case.y[j]).max() + dy / 2))


def traction_map(ax: Axes, case: CaseView, norm: Normalize, colours: Colormap, extent: float) -> None:
    """Map of |q| with one marker per contact cell and arrows along q.

    Cells are coloured by |q| (MPa, `norm`); slip cells carry a filled circle, stick cells an open one (every
    `circle_step`-th cell in each direction where cells are finer than circles can be told apart); arrows of
    equal length give the direction of the traction on a coarser grid. Axes in mm, from -extent to extent.
    """
    from matplotlib.collections import EllipseCollection

    qx, qy = traction(case)
    state, (dx, dy) = case.field("state"), case.spacing
    contact = state != CellState.EXTERIOR
    i, j = np.nonzero(contact)
    box = np.s_[i.min() : i.max() + 1, j.min() : j.max() + 1]
    size = np.ma.array(np.hypot(qx, qy), mask=~contact)
    x, y = case.x[box[0]], case.y[box[1]]
    ax.imshow(
        size[box].T,
        origin="lower",
        interpolation="nearest",
        cmap=colours,
        norm=norm,
        extent=(x[0] - dx / 2, x[-1] + dx / 2, y[0] - dy / 2, y[-1] + dy / 2),
    )
    ax.set(xlim=(-extent, extent), ylim=(-extent, extent), aspect="equal")
    every = _arrow_step(contact)
    _arrows(ax, case, qx, qy, contact, every)
    step = circle_step(case, extent)
    # beneath an arrow in each cell a circle has to be wider than the arrow's head
    diameter = (0.75 if every == 1 else 0.5) * step * min(dx, dy)
    shown = np.zeros_like(contact)
    shown[np.ix_(_spread(case.x.size, step), _spread(case.y.size, step))] = True
    for which, face in ((CellState.SLIP, "black"), (CellState.STICK, "none")):
        i, j = np.nonzero(shown & (state == which))
        # circles in the axes' own units, so that they keep to their cells at any size of the panel
        ax.add_collection(
            EllipseCollection(
                widths=[diameter],
                heights=[diameter],
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


def circle_step(case: CaseView, extent: float) -> int:
    """Cells from one circle to the next in a panel from -extent to extent: 1 unless the mesh is fine; odd."""
    return 2 * int(2 * extent / min(case.spacing) / CIRCLES / 2 + 0.5) + 1


def _arrow_step(contact: np.ndarray) -> int:
    """Cells from one arrow to the next; odd, so that a symmetric traction gives a symmetric picture on any grid."""
    across = max(np.ptp(np.nonzero(contact)[k]) + 1 for k in (0, 1))
    return 2 * round(across / ARROWS / 2) + 1


def _arrows(ax: Axes, case: CaseView, qx: np.ndarray, qy: np.ndarray, contact: np.ndarray, step: int) -> None:
    dx, dy = case.spacing
    size = np.hypot(qx, qy)
    chosen = np.zeros_like(contact)
    chosen[np.ix_(_spread(case.x.size, step), _spread(case.y.size, step))] = True
    chosen &= contact & (size > 0.02 * size.max())
    length = 0.62 * step * min(dx, dy)
    i, j = np.nonzero(chosen)
    ax.quiver(
        case.x[i],
        case.y[j],
        length * qx[i, j] / size[i, j],
        length * qy[i, j] / size[i, j],
        angles="xy",
        scale_units="xy",
        scale=1,
        pivot="mid",
        width=0.012,
        headwidth=3.4,
        headlength=3.6,
        headaxislength=3.2,
        color=VERMILLION,
        edgecolor="white",
        linewidth=0.5,
        zorder=4,  # over the circles: black discs would hide them where all slips
        gid="direction",
    )


def _spread(n: int, step: int) -> np.ndarray:
    """Every step-th of n cells, as many on one side of the middle as on the other (`step` odd)."""
    return np.arange((n - 1) * (step + 1) // 2 % step, n, step)
