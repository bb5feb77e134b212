"""What all figures share around their panels: the grid of panels, outer labels, one legend, the caption."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rcstudy.report.labels import KEEP, wrapped
from rcstudy.report.style import DPI, WIDTH
from rcstudy.report.views import GridView, short_number
from rcstudy.studyfile.quantities import number_text

if TYPE_CHECKING:
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

_LINE = 0.155  # height of a line of the caption, inches
_LEGEND = 0.28  # height of a legend of one line, inches: figures have room for it
_LETTERS_PER_INCH, _FEWEST_LETTERS = 19.5, 8.0  # of a caption: of usual text, and of one of the widest letters
_INDENT = 0.012  # of a caption, over the figure's width

DECADE = 10.0

GIVEN = ("load", "friction")
"""Numbers of a caption that the study gives, not computed ones: they keep all their digits."""

LINE_SPACING: dict[str, Any] = {"handlelength": 3.0, "columnspacing": 1.2}
"""Spacing of a legend of lines: long enough to show their dashes."""


def panels(rows: int, columns: int, height: float, *, width: float = WIDTH, **shared: Any) -> tuple[Figure, np.ndarray]:
    """A figure of width x height inches with rows x columns axes, [rows, columns]; no pyplot, no global state.

    `shared`: `sharex` and `sharey`, as matplotlib takes them.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False, **shared)


def share_limits(axes: np.ndarray) -> None:
    """Give all panels the x limits that hold every panel's data, and each row its y limits."""
    left, right = np.array([ax.get_xlim() for ax in axes.flat]).T
    for row in axes:
        low, high = np.array([ax.get_ylim() for ax in row]).T
        for ax in row:
            ax.set(xlim=(left.min(), right.max()), ylim=(low.min(), high.max()))


def outer_labels(axes: np.ndarray, x: str, y: str, *, shared: bool = True) -> None:
    """Label the outer panels only; inner ones keep their ticks, without numbers if all panels have the same limits."""
    rows, columns = axes.shape
    for k, ax in enumerate(axes.flat):
        i, j = divmod(k, columns)
        if i == rows - 1 or not axes[i + 1, j].get_visible():
            ax.set_xlabel(x)
        elif shared:
            ax.tick_params(labelbottom=False)
        if j == 0:
            ax.set_ylabel(y)
        elif shared:
            ax.tick_params(labelleft=False)


def log_ticks(axis: Axis, ends: tuple[float, float]) -> None:
    """Give a logarithmic axis of less than two decades between its `ends` ticks with plain numbers.

    Powers of ten are few there, and Matplotlib's labels between them overlap. Longer axes are left as they are.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

    low, high = ends
    if high >= DECADE**2 * low:
        return
    # steps of 1, 2 and 5 leave two ticks from here on; equal steps would crowd at the upper end
    short = high < 5.0 * low
    axis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]) if short else LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda tick, _: short_number(tick)))
    axis.set_minor_locator(NullLocator())


def legend(figure: Figure, looks: Mapping[str, Mapping[str, Any]], **spacing: Any) -> None:
    """One legend for all panels, above them: a line of each look with its label, in this order.

    It has as many columns as fit into the figure's width, six at most. If it has more than one line, the figure is made
    higher, so that panels keep their size. `spacing` is matplotlib's.
    """
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], label=label, **look) for label, look in looks.items()]
    for rows in range(-(-len(handles) // 6), len(handles) + 1) if handles else ():
        columns = -(-len(handles) // rows)
        drawn = figure.legend(handles=handles, loc="outside upper center", ncols=columns, **spacing)
        box = drawn.get_window_extent()
        if box.width <= figure.bbox.width or columns == 1:
            heighten(figure, max(0.0, box.height / figure.dpi - _LEGEND))
            break
        drawn.remove()


def heighten(figure: Figure, height: float) -> None:
    """Add `height` (inches) to the figure's."""
    width, before = (float(v) for v in figure.get_size_inches())
    figure.set_size_inches(width, before + height)


def caption(figure: Figure, text: str) -> None:
    """Write `text` under the panels, in a strip added to the figure's height."""
    width, height = (float(v) for v in figure.get_size_inches())
    look: dict[str, Any] = {"ha": "left", "fontsize": 7, "linespacing": 1.35}
    lines, letters = wrapped(text, int(width * _LETTERS_PER_INCH)), width * _LETTERS_PER_INCH
    while letters > _FEWEST_LETTERS * width:
        tried = figure.text(_INDENT, 0.0, "\n".join(lines), **look)
        box = tried.get_window_extent()
        tried.remove()
        if box.width / figure.dpi <= (1.0 - 2.0 * _INDENT) * width:
            break
        letters *= 0.96  # of wide letters
        lines = wrapped(text, int(letters))
    # most lines are lower than that: many of them would leave a wide gap above
    strip = min(_LINE * len(lines), box.height / figure.dpi + 0.2) + 0.08
    total = height + strip
    figure.set_size_inches(width, total)
    figure.get_layout_engine().set(rect=(0.0, strip / total, 1.0, height / total))  # type: ignore[union-attr, call-arg]
    figure.text(_INDENT, 0.06 / total, "\n".join(lines), va="bottom", gid="caption", **look)


def conditions(grid: GridView, *, friction: bool = True) -> str:
    """What all cases of a grid share: load, friction, Hertz's radius and pressure of the uncoated pair, cells.

    Empty if they share none of it. Without `friction` where it has no part in what is shown.
    """
    case = grid.first
    texts = []
    for name, form in (
        ("load", "$P$ = {} N"),
        ("friction", r"$\mu$ = {}"),
        ("hertz_radius", "Hertz's $a$ = {} mm"),
        ("hertz_pressure", "$p_0$ = {} MPa"),
    ):
        if name in grid and (friction or name != "friction") and np.ptp(grid.small(name).values) == 0:
            written = number_text if name in GIVEN else short_number
            texts.append(form.format(written(case.stored(name))).replace(" ", KEEP))
    if "x" in grid and "y" in grid:
        dx, dy = case.spacing
        texts.append("cells of " + f"{short_number(dx)} mm × {short_number(dy)} mm".replace(" ", KEEP))
    sentence = f"{', '.join(texts)}." if texts else ""
    return sentence[:1].upper() + sentence[1:]
