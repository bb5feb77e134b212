"""Overview of any grid: its resultants along one of its axes, and the maps of some of its cases."""

from __future__ import annotations

import itertools
import math
import textwrap
from collections.abc import Iterable, Sequence
from functools import partial
from string import ascii_lowercase
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rcstudy.progress import counted
from rcstudy.report.draw import remark
from rcstudy.report.held import held
from rcstudy.report.labels import literal, narrowed, power_of_ten, shortened
from rcstudy.report.layout import DECADE, LINE_SPACING, caption, conditions, heighten, legend, log_ticks, panels
from rcstudy.report.maps import (
    one_colour_scale,
    pressure_maps,
    pressures_show,
    scales,
    title_width,
    traction_maps,
    tractions_show,
)
from rcstudy.report.quantities import CHOICES, QUANTITIES, has_bars, numbers, vanishes, variable
from rcstudy.report.style import LINES
from rcstudy.report.views import CaseView, GridView, short_number
from rcstudy.settings import LENGTH, MODULUS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

MAPS_AT_MOST = 12

_TITLE_LETTERS = 36  # of a line of a map's title, about, at most
_TICKS = 0.2  # height of tick labels along x for which panels have room, inches

_WORDS = {name: f"{name} creepage" for name in ("longitudinal", "lateral")}
_WORDS |= {"normal": "tolerance of the pressure", "tangential": "tolerance of the tractions"}
_CREEPAGES = ("longitudinal", "lateral", "spin")
_CURVE = 3  # values of a creepage from which on curves are drawn along it, whatever other axes there are

_MARKERS = 6.0, 2.8  # sizes of the markers of the first line and, where there are many, of the last, points
_SMALLER = 1.2  # difference of the sizes of the markers of two lines, at most, points
_MARKED = 30  # values along a curve up to which each has a marker and an error bar: more would hide one another
_ASIDE = 0.09  # distance of the points of two lines over a label, in distances of labels
_LETTERS = 20  # of the numbers or words of all ticks along x for which panels have room
_ACROSS = 28  # digits that are as wide as a panel
_LONG = 5  # letters of a tick's number; of longer ones panels have room for few

_PLAIN = 1e-4, 1e6  # largest values of an axis whose numbers are written without a power of ten
_WIDE = 1000.0  # ratio of values of one sign from which on an axis of values is logarithmic
_LEAST_DRAWN = 1e-100  # least value on a logarithmic axis, its inverse the largest: margins must be finite, too

ROUNDED = 1e-3
"""Relative difference of the logarithms of factors that count as equal: values of an axis are rounded to six digits."""


def overview_figure(grid: GridView, along: str = "", quantities: Sequence[str] = tuple(QUANTITIES)) -> Figure:
    """Resultants along one axis, a line per value of another; further axes at their first value.

    The abscissa is the axis of numbers `along`, or, if the grid has no such axis, an axis of numbers that is chosen:
    a creepage with three or more values, or else the one with most values. Lines stand for an axis of words if there is
    one. An axis of labels (or of several numbers) is drawn evenly spaced with its labels. Cases that were not solved
    leave gaps, which the caption counts; where none of those shown is solved, panels say so and have no scales. What no
    solved case shown has, and forces and moment that are zero in all of them, have no panel. `quantities`: what panels
    show, of `quantities.CHOICES`.
    """
    along, across = _axes(grid, along)
    lines = _chosen(grid.dataset.sizes[across]) if across else [0]
    x = _positions(grid, along)
    order = np.argsort(x, kind="stable")
    shown = [[_case(grid, {along: i, across: at}) for i in order] for at in lines]
    solved = [case for cases in shown for case in cases if case.solved]
    stored = [name for name in quantities if variable(name) in grid]
    zero = [name for name in stored if vanishes(solved, name)]
    # what no case has, such as forces where tractions are not solved, has no panel
    known = [name for name in stored if not solved or any(np.isfinite(case.number(variable(name))) for case in solved)]
    names = [name for name in known if name not in zero]
    columns = 2 if len(names) == 4 else min(3, max(len(names), 1))
    rows = -(-max(len(names), 1) // columns)
    figure, axes = panels(rows, columns, 2.2 * rows + 0.3)
    for ax in axes.flat[max(len(names), 1) :]:
        ax.set_visible(False)
    if not names:
        axes.flat[0].set(xticks=[], yticks=[])
        remark(axes.flat[0], ["no quantity to show"])
    looks = _looks(grid, along, len(lines))
    every = -(-len(x) // _MARKED) if grid.numeric(along) else 1
    for k, (ax, name) in enumerate(zip(axes.flat, names, strict=False)):
        drawn_here: list[np.ndarray] = []
        for cases, look, aside in zip(shown, looks, _asides(grid, along, len(lines)), strict=True):
            values, bars = numbers(cases, name)
            drawn_here.append(values)
            at = _marked(values, every)
            ax.plot(x[order] + aside, values, markevery=at, **look)
            ax.errorbar(x[order][at] + aside, values[at], bars[:, at], fmt="none", ecolor=look["color"], elinewidth=0.8)
        # cases that are not solved leave gaps at the ends of the axis, too
        ax.update_datalim([(x.min(), 0.0), (x.max(), 0.0)], updatey=False)
        ax.autoscale_view()
        _scale_values(ax, np.concatenate(drawn_here))
        ax.set_ylabel(CHOICES[name])
        ax.set_title(f"({ascii_lowercase[k]})", loc="left")
        _label_axis(ax, grid, along)
        if not solved:
            ax.set(xticks=[], yticks=[])
            remark(ax, ["none of these cases is solved"])
    heighten(figure, rows * max(0.0, _ticks_height(axes.flat[0]) - _TICKS))
    if across:
        words = [_lines_label(f"{grid.name_of(across)} = {value}") for value in grid.axis_values(across)]
        legend(figure, {words[at]: look for at, look in zip(lines, looks, strict=True)}, **LINE_SPACING)
    bars_shown = bool(solved) and any(has_bars(grid, name) for name in names)
    marked = f"One point in {every} has a marker." if every > 1 else ""
    errors = f"Estimated discretisation errors as bars{' at markers' if marked else ''}." if bars_shown else ""
    places = {across: lines, along: range(len(x))}
    drawn = grid.at({axis: places.get(axis, [0]) for axis in grid.axes})
    caption(figure, _caption(drawn, marked, errors, _remarks(grid, drawn, along, across, zero)))
    return figure


def _marked(values: np.ndarray, every: int) -> list[int]:
    """Places of the markers: one in `every`, and those between gaps, which no line shows."""
    gaps = np.concatenate([[True], ~np.isfinite(values), [True]])
    alone = ~gaps[1:-1] & gaps[:-2] & gaps[2:]
    alone[::every] = True
    return np.flatnonzero(alone).tolist()


def case_maps(grid: GridView) -> Figure | None:
    """Maps of at most twelve cases, evenly chosen along all axes: of their tractions, or else their pressures.

    The caption says how many of the values of each axis are shown. None if the grid stores neither.
    """
    stored = set(map(str, grid.dataset.data_vars))
    tractions = {"traction_x", "traction_y", "state"} <= stored
    if not tractions and "pressure" not in stored:
        return None
    counts = _counts(grid.shape)
    places = [_spread(size, count) for size, count in zip(grid.shape, counts, strict=True)]
    cases = [grid.case(*index) for index in itertools.product(*places)]
    mapped = [case for case in cases if (case.rolling if tractions else case.solved)]
    width = title_width(mapped)
    if tractions:
        body = "coated body" if any(case.layers for case in cases) else "substrate"
        alike = one_colour_scale(mapped, "traction_max")
        figure = traction_maps(cases, lambda case: _title(case, width), alike=alike)
        what = f"{tractions_show(body, alike=alike)}."
    else:
        figure, what = pressure_maps(cases, lambda case: _title(case, width)), pressures_show(mapped)
    drawn = grid.at(dict(zip(grid.axes, places, strict=True)))
    caption(figure, _caption(drawn, what if mapped else "", scales(mapped), _chosen_cases(grid, counts)))
    return figure


def _counts(shape: Sequence[int]) -> list[int]:
    """How many values of each axis maps show: the same number of each as far as possible, of the first axes more."""
    counts = [1] * len(shape)
    while True:
        room = [
            k
            for k, (count, size) in enumerate(zip(counts, shape, strict=True))
            if count < size and math.prod(counts) // count * (count + 1) <= MAPS_AT_MOST
        ]
        if not room:
            return counts
        counts[min(room, key=lambda k: counts[k])] += 1


def _chosen_cases(grid: GridView, counts: Sequence[int]) -> str:
    """A sentence on which cases the maps show; empty if all."""
    total, shown = math.prod(grid.shape), math.prod(counts)
    if shown == total:
        return ""
    parts = [
        f"{count} of {counted(size, 'value')} of {grid.name_of(axis)}"
        for axis, size, count in zip(grid.axes, grid.shape, counts, strict=True)
        if size > 1
    ]
    which = f": {', '.join(parts)}" if len(parts) > 1 else ""
    return f"{shown} of {total} cases, evenly chosen{which}."


def _caption(drawn: GridView, *sentences: str) -> str:
    """Sentences under a figure, with what the cases that it shows have in common."""
    shared = conditions(drawn, friction="force_x" in drawn)  # a pressure alone does not depend on friction
    words = " ".join(text for text in (*sentences, held(drawn), shared) if text)
    return f"{drawn.name}: {words}" if words else drawn.name


def _title(case: CaseView, width: float) -> str:
    """The case's settings in lines of at most `width` inches."""
    return literal("\n".join(narrowed(partial(_title_lines, case.settings), _TITLE_LETTERS, width)))


def _title_lines(settings: Sequence[str], letters: int) -> list[str]:
    lines = [""]
    for part in settings:
        if lines[-1] and len(lines[-1]) + len(part) > letters:
            lines.append("")
        lines[-1] += (", " if lines[-1] else "") + part
    return [piece for line in lines for piece in textwrap.wrap(line, letters + 2)]


def _axes(grid: GridView, along: str) -> tuple[str, str]:
    """The axis to draw along, `along` if the grid has it, and that of the lines; empty where it has no more axes."""
    sizes = dict(zip(grid.axes, grid.shape, strict=True))
    numeric = {axis: grid.numeric(axis) for axis in sizes}
    if not numeric.get(along):
        along = max(
            sizes,
            key=lambda a: (sizes[a] > 1, numeric[a], a in _CREEPAGES and sizes[a] >= _CURVE, sizes[a] * numeric[a]),
            default="",
        )
    rest = [axis for axis in sizes if axis != along]
    return along, max(rest, key=lambda a: (sizes[a] > 1, not numeric[a]), default="")


def _case(grid: GridView, at: dict[str, int]) -> CaseView:
    """The case at these positions, and the first one along all other axes."""
    return grid.case(*(at.get(axis, 0) for axis in grid.axes))


def _chosen(size: int) -> list[int]:
    """Positions of the lines: all, or as many as there are looks, evenly spread."""
    return _spread(size, min(size, len(LINES)))


def _spread(size: int, count: int) -> list[int]:
    """`count` of the positions 0 to `size` - 1, evenly spread, the first one among them."""
    return np.linspace(0, size - 1, count).round().astype(int).tolist()


def _looks(grid: GridView, along: str, lines: int) -> list[dict[str, Any]]:
    """The looks of the lines; points over labels are not joined, as there is nothing between labels.

    Markers are open, each smaller than that of the line before, so that lines with the same values are all seen.
    """
    joined = {} if grid.numeric(along) else {"linestyle": ""}
    first, least = _MARKERS
    sizes = np.linspace(first, max(least, first - _SMALLER * (lines - 1)), lines)
    return [
        look | joined | {"markerfacecolor": "none", "markeredgewidth": 0.7, "markersize": float(size)}
        for look, size in zip(LINES, sizes, strict=False)
    ]


def _asides(grid: GridView, along: str, lines: int) -> np.ndarray:
    """Distances of the points of each line from the labels of `along`, so that none hides another; 0 on numbers."""
    return np.zeros(lines) if grid.numeric(along) else _ASIDE * (np.arange(lines) - (lines - 1) / 2)


def _positions(grid: GridView, along: str) -> np.ndarray:
    if grid.numeric(along):
        return np.asarray(grid.small(along).values, dtype=float)
    return np.arange(grid.dataset.sizes[along] if along else 1, dtype=float)


def _label_axis(ax: Axes, grid: GridView, axis: str) -> None:
    if not axis:
        ax.set_xticks([])
        return
    words = _WORDS.get(axis, grid.name_of(axis).replace("_", " "))
    units = grid.units(axis) if grid.numeric(axis) else ""
    ax.set_xlabel(f"{words} / {units}" if units in (LENGTH, MODULUS) else f"{words} ({units})" if units else words)
    if grid.numeric(axis):
        _scale_axis(ax, _positions(grid, axis))
    else:
        labels = [literal(text) for text in shortened(grid.axis_values(axis), 18)]
        every = -(-len(labels) // 12)
        longest, shown = max(map(len, labels)), labels[::every]
        turned: dict[str, Any] = {"rotation": 30, "ha": "right"}
        if longest * len(shown) <= _LETTERS:
            turned = {}
        elif longest > 8:  # upright: inclined they would take the width of their panel
            turned = {"rotation": 90}
        ax.set_xticks(range(0, len(labels), every), shown, **turned)


def _scale_axis(ax: Axes, values: np.ndarray) -> None:
    """Make the x axis logarithmic if `values` are more even on it, with plain numbers where powers of ten are few.

    That of negative values is the mirror image of that of their amounts. On a linear axis whole numbers have ticks at
    whole numbers, long numbers have few ticks, and very small and large ones a power of ten each.
    """
    from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator

    values = np.unique(values[np.isfinite(values)])
    if not values.size:
        return
    if not geometric(values):
        if values.any() and not _PLAIN[0] <= np.abs(values).max() < _PLAIN[1]:
            # Matplotlib's formatter would write a power of ten of all numbers into the axis's label
            ax.xaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10]))
            ax.xaxis.set_major_formatter(FuncFormatter(lambda tick, _: f"${power_of_ten(short_number(tick))}$"))
            return
        whole = bool(np.all(values == np.round(values)))
        # ticks between short numbers may be long
        usual = ax.xaxis.get_major_locator().tick_values(values[0], values[-1])
        if whole or _long(values) or _long(usual):
            some = MaxNLocator(4 if _long(values) else 5, steps=[1, 2, 5, 10], integer=whole)
            few = MaxNLocator(3, steps=[1, 2, 5, 10], integer=whole)
            # the ticks' own numbers decide: those of a range in equal steps are long where the ticks' are not
            ax.xaxis.set_major_locator(few if _long(some.tick_values(values[0], values[-1])) else some)
        return
    negative = bool(values[-1] < 0.0)
    values = -values[::-1] if negative else values
    _logarithmic(ax, "x", values[0], values[-1], negative=negative)
    log_ticks(ax.xaxis, (values[0], values[-1]))
    if values[-1] < DECADE * values[0] and sum(len(short_number(value)) + negative for value in values) <= _LETTERS:
        ax.xaxis.set_major_locator(FixedLocator(values.tolist()))  # else there may be none at the ends
    elif values[-1] < DECADE**2 * values[0]:
        ticks = ax.xaxis.get_major_locator().tick_values(values[0], values[-1])
        ax.xaxis.set_major_locator(FixedLocator(_apart(ticks, values[0], values[-1], signs=negative)))
    if negative:
        _mirrored(ax.xaxis, values[0], values[-1])


def _scale_values(ax: Axes, values: np.ndarray) -> None:
    """Make the y axis logarithmic if `values`, all above 0 or all below, extend over more than three decades."""
    known = np.sort(values[np.isfinite(values)])
    ends = known[[0, -1]] if known.size else known
    if not geometric(ends):
        return
    negative = bool(ends[1] < 0.0)
    low, high = np.sort(np.abs(ends))
    _logarithmic(ax, "y", low, high, negative=negative)
    if negative:
        _mirrored(ax.yaxis, low, high)


def _logarithmic(ax: Axes, which: Literal["x", "y"], low: float, high: float, *, negative: bool) -> None:
    """Make an axis logarithmic, for numbers from `low` to `high` or, `negative`, for their negatives.

    It is no longer than for these, though bars may end near zero.
    """
    from matplotlib.ticker import LogLocator

    scale, limits = getattr(ax, f"set_{which}scale"), getattr(ax, f"set_{which}lim")
    aside = (high / low) ** ax.margins()[0]  # type: ignore[index]
    if not negative:
        scale("log")
        limits(low / aside, high * aside)
        return
    # logarithmic on either side of a stretch around zero, which ends nearer to zero than the axis does
    scale("symlog", linthresh=low / aside**2)
    limits(-high * aside, -low / aside)
    axis = ax.xaxis if which == "x" else ax.yaxis
    axis.set_major_locator(LogLocator())
    axis.set_minor_locator(LogLocator(subs="auto"))


def _mirrored(axis: Axis, low: float, high: float) -> None:
    """Turn the ticks of `axis`, which are for the numbers from `low` to `high`, into those for their negatives."""
    from matplotlib.ticker import FixedLocator, FuncFormatter

    major, minor = (
        FixedLocator([-tick for tick in locator.tick_values(low, high)])
        for locator in (axis.get_major_locator(), axis.get_minor_locator())
    )
    axis.set_major_locator(major)
    axis.set_minor_locator(minor)
    if isinstance(axis.get_major_formatter(), FuncFormatter):  # else it writes powers of ten
        axis.set_major_formatter(FuncFormatter(lambda tick, _: short_number(tick).replace("-", "\N{MINUS SIGN}", 1)))


def _long(values: Iterable[float]) -> bool:
    """Whether some number is so long that a panel has room for few of its kind."""
    return max((len(short_number(value)) for value in values), default=0) > _LONG


def _apart(ticks: Iterable[float], low: float, high: float, *, signs: bool) -> list[float]:
    """Of `ticks` on a logarithmic axis from `low` to `high` those whose numbers have room beside each other.

    `signs`: there is a minus before each of them.
    """
    beside = 1.8 if signs else 1.0  # the space between two numbers, and the sign, in digits
    shown = [float(tick) for tick in ticks if low <= tick <= high]
    room = [(len(short_number(tick)) + beside) / _ACROSS * math.log(high / low) for tick in shown]
    kept: list[int] = []
    for k in sorted(range(len(shown)), key=lambda k: not math.log10(shown[k]).is_integer()):  # decades first
        if all(abs(math.log(shown[k] / shown[other])) >= 0.5 * (room[k] + room[other]) for other in kept):
            kept.append(k)
    return [shown[k] for k in sorted(kept)]


def geometric(values: np.ndarray) -> bool:
    """Whether increasing numbers are in geometric progression, exactly, or roughly and over more than a decade.

    All are above 0, or all below. Over more than three decades it is enough that their factors are more even than their
    steps: all but the largest would coincide on a linear axis. Two numbers are if they are as far apart.
    """
    if values.size < 2 or values[0] <= 0.0 <= values[-1]:
        return False
    values = -values[::-1] if values[-1] < 0.0 else values
    if not (values[0] > _LEAST_DRAWN and values[-1] < 1.0 / _LEAST_DRAWN):
        return False
    if values.size == 2:
        return bool(values[1] > _WIDE * values[0])
    steps, factors = np.diff(values), np.diff(np.log(values))
    least, largest = values[0], values[-1]
    most = math.inf if largest > _WIDE * least else 2.0 if largest > DECADE * least else 1.0 + ROUNDED
    return bool(factors.max() / factors.min() < min(most, steps.max() / steps.min()))


def _ticks_height(ax: Axes) -> float:
    """Height of the tick labels along x, inches."""
    heights = [label.get_window_extent().height for label in ax.get_xticklabels()]
    return max(heights, default=0.0) / ax.figure.dpi


def _lines_label(text: str) -> str:
    return literal("\n".join(textwrap.wrap(text, 60)))


def _remarks(grid: GridView, drawn: GridView, along: str, across: str, zero: Sequence[str]) -> str:
    remarks = []
    failed = int((drawn.small("status").values != 0).sum())
    if failed:
        remarks.append(f"{failed} of {drawn.small('status').size} cases not solved (gaps).")
    if across and drawn.dataset.sizes[across] < grid.dataset.sizes[across]:
        remarks.append(
            f"{drawn.dataset.sizes[across]} of {grid.dataset.sizes[across]} values of {grid.name_of(across)}."
        )
    if zero:
        remarks.append(f"Zero in all cases shown: {', '.join(CHOICES[name].split(' (')[0] for name in zero)}.")
    rest = [axis for axis in grid.axes if axis not in (along, across)]
    fixed = [f"{grid.name_of(axis)} = {literal(shortened(grid.axis_values(axis)[:1], 60)[0])}" for axis in rest]
    if fixed:
        remarks.append(f"Shown for {', '.join(fixed)}.")
    return " ".join(remarks)
