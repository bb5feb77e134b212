"""Maps of several cases, a panel each: tractions with stick and slip, or pressures."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rcstudy.report import draw
from rcstudy.report.labels import literal
from rcstudy.report.layout import heighten, legend, outer_labels, panels
from rcstudy.report.measures import slip_ratio, slip_ratio_error, traction
from rcstudy.report.style import VERMILLION, WIDTH, map_colours
from rcstudy.report.views import CaseView, short_number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

_BESIDE = 0.35  # width of the labels beside a map's panel, inches
_NUMBERS = 0.17  # by which they are wider where all panels have numbers, inches
_TITLE, _NARROW = 2.0, 1.85  # width of a title, no more than its panel's, and where all panels have numbers, inches
_TITLE_LINE = 0.145  # height of a line of a title, inches
_BAR, _MARKS = 0.45, 0.25  # heights of the colour bar and of the legend of marks, inches
_OWN = ", to which its colours refer"
_X_ROLLING = r"$x$ (mm), rolling $\rightarrow$"

MUCH = 5.0
"""Ratio of largest pressures, or tractions, above which each panel is coloured by its own.

Those with lower ones would have one colour.
"""


def pressures_show(mapped: Sequence[CaseView]) -> str:
    """What maps of the pressures of these cases show."""
    own = "" if one_colour_scale(mapped, "pressure_max") else _OWN
    return f"Pressure $p$. In each panel: its largest value{own}."


def tractions_show(body: str, *, alike: bool = True) -> str:
    """What maps of the traction on this body show, all with the same colours or not, without the last full stop."""
    own = "" if alike else f", and the largest $|q|$ of a cell{_OWN}"
    return (
        f"Magnitude $|q|$ (colour) and direction (arrows, where it is above {100 * draw.LEAST_ARROW:g} % of "
        f"its largest) of the traction on the {body}. Rolling towards $+x$: the leading edge is at $+x$. In each "
        f"panel: area of slip over area of contact{own}"
    )


def traction_maps(cases: Sequence[CaseView], title: Callable[[CaseView], str], *, alike: bool = True) -> Figure:
    """Maps of |q|, a panel per case, with slip cells filled, stick cells open, arrows along q, one colour bar.

    One column for one case, two for up to four, else three. Panels have the same limits, or each its own if contacts
    differ much in size, and the same colours if these are to be `alike`; no scales where no case has a map. UserError
    if the cube does not store the fields.
    """
    mapped = [case for case in cases if case.rolling]
    figure, drawn, windows = _panels(cases, mapped, title, _BAR + _MARKS)
    # of what is drawn: aligned cells may store more than `traction_max`
    scale = _Colours("|q|", {case: float(np.hypot(*traction(case)).max()) for case in mapped}, alike)
    steps = dict(zip(mapped, draw.circle_steps(mapped, list(windows.values())), strict=True))
    for case in mapped:
        draw.traction_map(drawn[case], case, scale.of(case), scale.colours, windows[case], steps[case])
        largest = "" if alike else f"\n{short_number(scale.tops[case])} MPa"
        _corner(drawn[case], f"slip {_per_cent(slip_ratio(case), slip_ratio_error(case))}{largest}", "slip-ratio")
    if mapped:
        scale.draw_bar(figure, drawn.values())
        _marks(figure, list(steps.values()))
    return figure


def pressure_maps(cases: Sequence[CaseView], title: Callable[[CaseView], str]) -> Figure:
    """Maps of p, a panel per case, with its largest value and one colour bar; panels as those of `traction_maps`."""
    mapped = [case for case in cases if case.solved]
    figure, drawn, windows = _panels(cases, mapped, title, _BAR)
    # aligned cells: the largest pressure may lie between their centres
    tops = {case: max(case.number("pressure_max"), float(case.field("pressure").max())) for case in mapped}
    scale = _Colours("p", tops, alike := one_colour_scale(mapped, "pressure_max"))
    for case in mapped:
        draw.pressure_map(drawn[case], case, scale.of(case), scale.colours, windows[case])
        largest = case.number("pressure_max") if alike else tops[case]
        _corner(drawn[case], f"{short_number(largest)} MPa", "pressure-max")
    if mapped:
        scale.draw_bar(figure, drawn.values())
    return figure


def one_colour_scale(mapped: Sequence[CaseView], largest: str) -> bool:
    """Whether maps of these cases have the same colours for the same values, of which `largest` names the largest."""
    tops = [top for case in mapped if (top := case.number(largest)) > 0.0]
    return not tops or max(tops) <= MUCH * min(tops)


class _Colours:
    """Colours of maps of the quantity `symbol` (MPa): of one scale for all cases if they are `alike`, else their own.

    `tops`: the largest value of each case. Where there is none but zero, there is no scale.
    """

    def __init__(self, symbol: str, tops: Mapping[CaseView, float], alike: bool) -> None:
        self._symbol, self.tops, self.alike = symbol, tops, alike
        self.colours = map_colours()

    def of(self, case: CaseView) -> Normalize:
        from matplotlib.colors import Normalize

        return Normalize(0.0, (max(self.tops.values()) if self.alike else self.tops[case]) or 1.0)

    def draw_bar(self, figure: Figure, shown: Collection[Axes]) -> None:
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        norm = self.of(next(iter(self.tops))) if self.alike else Normalize(0.0, 1.0)
        bar = figure.colorbar(
            ScalarMappable(norm, self.colours), ax=list(shown), location="bottom", shrink=0.62, aspect=45, pad=0.015
        )
        bar.set_label(f"${self._symbol}$ (MPa)" if self.alike else f"${self._symbol}$ / largest ${self._symbol}$")


def _panels(
    cases: Sequence[CaseView], mapped: Sequence[CaseView], title: Callable[[CaseView], str], besides: float
) -> tuple[Figure, dict[CaseView, Axes], dict[CaseView, draw.Window]]:
    """A figure with a panel for each case, which has its title, and the windows of those cases that have a map.

    Panels of the others say why they have none. `besides`: height of what else the figure shows if there is any map,
    inches.
    """
    columns = 1 if len(cases) == 1 else 2 if len(cases) <= 4 else 3
    rows = -(-len(cases) // columns)
    width = (3.4, 5.2, WIDTH)[columns - 1]
    shown = draw.window(mapped)
    windows = dict(zip(mapped, draw.windows(mapped), strict=True))
    shared = one_scale(mapped)
    beside = _BESIDE if shared else _BESIDE + _NUMBERS
    height = (width / columns - beside) * shown.shape + beside
    figure, axes = panels(rows, columns, (height + 0.12) * rows + (besides if mapped else 0.1), width=width)
    titles = {case: title(case) for case in cases}
    for row in range(rows):  # there is room for titles of two lines
        lines = max(titles[case].count("\n") + 1 for case in cases[row * columns : (row + 1) * columns])
        heighten(figure, _TITLE_LINE * max(0, lines - 2))
    for ax in axes.flat[len(cases) :]:
        ax.set_visible(False)
    drawn = dict(zip(cases, axes.flat, strict=False))
    for case, ax in drawn.items():
        shown.on(ax)
        ax.set_title(titles[case], loc="left", linespacing=1.35)
        if case not in windows:
            if not shared or not mapped:
                ax.set(xticks=[], yticks=[])
            draw.remark(ax, [f"not solved: {literal(case.failure)}" if case.failure else "pressure only"])
    if mapped:
        rolling = any(case.rolling for case in mapped)
        outer_labels(axes, _X_ROLLING if rolling else "$x$ (mm)", "$y$ (mm)", shared=shared)
    return figure, drawn, windows


def title_width(mapped: Sequence[CaseView]) -> float:
    """Largest width (inches) of titles of the maps of these cases."""
    return _TITLE if one_scale(mapped) else _NARROW


def one_scale(mapped: Sequence[CaseView]) -> bool:
    """Whether maps of these cases have the same limits in all panels."""
    return len(set(draw.windows(mapped))) <= 1


def scales(mapped: Sequence[CaseView]) -> str:
    """Sentences on maps of these cases that are not to scale, or not to one scale; empty if they are."""
    words = [] if one_scale(mapped) else ["Each panel has its own scale of lengths, as contacts differ much in size."]
    factor = draw.window(mapped).stretch
    if factor != 1.0:
        one, other, times = ("y", "x", factor) if factor > 1.0 else ("x", "y", 1.0 / factor)
        angles = ", arrows at their true angles" if any(case.rolling for case in mapped) else ""
        words.append(f"Drawn {times:.2g} times as large along ${one}$ as along ${other}${angles}.")
    return " ".join(words)


def _per_cent(ratio: float, error: float) -> str:
    """A ratio in per cent, with a decimal where its error leaves one; no less than all is called all."""
    decimals = 1 if error < 0.005 and ratio < 1.0 else 0
    text = f"{100 * ratio:.{decimals}f}"
    return f"> {100 - 10.0**-decimals:.{decimals}f} %" if ratio < 1.0 and float(text) == 100.0 else f"{text} %"


def _corner(ax: Axes, text: str, gid: str) -> None:
    """Write a number in the lower right corner of a map."""
    ax.text(
        0.98,
        0.02,
        text,
        transform=ax.transAxes,
        ha="right",
        va="bottom",
        fontsize=6.5,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
        zorder=5,  # over the arrows
        gid=gid,
    )


def _marks(figure: Figure, steps: Sequence[tuple[int, int]]) -> None:
    """A legend of the marks of cells and of arrows; `steps`: cells from one mark to the next, in each panel."""
    fine = {pair for pair in steps if pair != (1, 1)}
    every = f" (one of {' × '.join(map(str, min(fine)))} where fine)" if fine else ""
    if len(fine) > 1:
        every = " (one of several where fine)"
    circle: dict[str, Any] = {"marker": "o", "linestyle": "", "color": "black", "markersize": 4, "markeredgewidth": 0.6}
    arrow: dict[str, Any] = {"marker": r"$\rightarrow$", "linestyle": "", "color": VERMILLION, "markersize": 9}
    looks = {
        f"slip cell{every}": circle,
        f"stick cell{every}": circle | {"markerfacecolor": "none"},
        "direction of $q$": arrow,
    }
    legend(figure, looks)
