"""The paper's Figures 3 to 10 from the grids of a cube."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rcstudy.errors import UserError
from rcstudy.report import draw
from rcstudy.report.held import settings
from rcstudy.report.labels import literal
from rcstudy.report.layers import layers_text, thickness_text
from rcstudy.report.layout import (
    LINE_SPACING,
    caption,
    conditions,
    heighten,
    legend,
    outer_labels,
    panels,
    share_limits,
)
from rcstudy.report.measures import on_x_axis, slip_ratio, slip_ratio_error, traction
from rcstudy.report.paper import AXES, BARE, panel_letter
from rcstudy.report.style import BLUE, GREEN, LINES, ORANGE, PURPLE, SKY, VERMILLION, WIDTH, traction_colours
from rcstudy.report.views import CaseView, GridView, creepage_text
from rcstudy.settings import unit_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROWS_NEXT_TO_AXIS = (
    "With an even number of cells no row of cells lies on the x-axis: the mean of the two rows next to it is shown."
)


def _symbols(cases: Iterable[CaseView]) -> str:
    """A sentence on the symbols that name the layers of these cases."""
    count = max(len(case.layers) for case in cases)
    moduli = (
        "",
        "$E_1$, $E_s$: moduli of the layer and the substrate, followed by the layer's thickness; ",
        "$E_1$, $E_2$, $E_s$: moduli of the first layer (at the surface), the second and the substrate, followed by "
        "the thickness of each layer; ",
        "$E_1$, $E_2$, ...: moduli of the layers from the surface down, $E_s$: of the substrate, followed by the "
        "thickness of each layer; ",
    )[min(count, 3)]
    return f"{moduli}$a$: Hertz's radius of the uncoated pair."


def paper_figure(name: str, grids: Mapping[str, GridView]) -> Figure:
    """Figure `name` (`figure_3` ... `figure_10`) from the paper's grids; UserError if grid or fields are missing."""
    number = int(name.split("_")[1])
    if number == 3:
        return pressure_figure(grids.get(BARE), grids.get(name))
    if name not in grids:
        raise UserError(f"the cube has no grid {name} like the paper's, with axes {', '.join(sorted(AXES[name]))}")
    if number in (5, 6):
        return lines_figure(number, grids[name])
    cases = list(grids[name].cases())
    figure = maps_figure(cases, paper_title)
    shown = "".join(map(panel_letter, cases))
    more = _symbols(cases) if number != 4 else OTHER_PANELS if shown == "aceg" else ""
    body = "coated body" if any(case.layers for case in cases) else "substrate"
    what = rf"{maps_show(body)}; spin $\varphi$ in {unit_of('spin')}."
    _caption(figure, number, grids[name], what, scales(cases), more)
    return figure


def _caption(figure: Figure, number: int, grid: GridView, *sentences: str, friction: bool = True) -> None:
    """Write these sentences under Figure `number`, and what all cases of `grid` have in common."""
    words = (*sentences, settings(grid), conditions(grid, friction=friction))
    caption(figure, " ".join((f"Fig. {number}.", *filter(None, words))))


def pressure_figure(bare: GridView | None, layered: GridView | None) -> Figure:
    """Figure 3: p/p0 on the x-axis against x/a, a panel per number of layers, the uncoated case in each.

    Colour stands for the modulus, dash and marker for the thickness. The exact Hertz pressure is drawn
    too.
    """
    grid = layered or bare
    if grid is None:
        axes_of = ", ".join(sorted(AXES["figure_3"]))
        raise UserError(f"the cube has no grid {BARE} or figure_3 like the paper's, of one case or with axes {axes_of}")
    groups: dict[str, list[CaseView]] = {}
    for case in layered.cases() if layered else ():
        groups.setdefault(panel_letter(case), []).append(case)
    groups = groups or {"": []}
    columns = min(2, len(groups))
    rows = -(-len(groups) // columns)
    figure, axes = panels(rows, columns, 3.9 * rows)
    for ax in axes.flat[len(groups) :]:
        ax.set_visible(False)
    for ax, (letter, cases) in zip(axes.flat, groups.items(), strict=False):
        x = np.linspace(-1.0, 1.0, 401)
        ax.plot(x, np.sqrt(1.0 - x**2), color="0.6", linewidth=0.8, label="no layer, Hertz (exact)", zorder=1)
        failures = []
        plain = list(bare.cases() if bare else ()) or [case for case in cases if not case.layers][:1]
        for case in (*plain, *(case for case in cases if case.layers)):
            label = f"{_surface_text(case)}, {thickness_text(case, math=True)}" if case.layers else "no layer, computed"
            if case.solved:
                draw.pressure_line(ax, case, label, _by_modulus_and_thickness(case))
            else:
                failures.append(f"{label}: {literal(case.failure)}")
        if failures:
            draw.remark(ax, [f"not solved: {failure}" for failure in failures], top=True)
        words = _layers_in_words(len(cases[0].layers) if cases else 0)
        ax.set_title(f"({letter}) {words}" if letter else words, loc="left")
        ax.set_xlabel("$x/a$")
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=2, handlelength=3.4, columnspacing=1.0)
    share_limits(axes)
    for row in axes:
        for ax in row:
            ax.set_ylim(bottom=0.0)
        _make_room(row)
        row[0].set_ylabel("$p/p_0$")
    text = "Pressure on the x-axis over Hertz's peak pressure $p_0$ of the uncoated pair."
    _caption(figure, 3, grid, text, _symbols(grid.cases()), ROWS_NEXT_TO_AXIS, friction=False)
    return figure


def _surface_text(case: CaseView) -> str:
    """The moduli of a case's layers; of more than two, for which legends have no room, that at the surface alone."""
    ratio = case.layers[0][0] / case.substrate_modulus
    if len(case.layers) <= 2 or not np.isfinite(ratio):
        return layers_text(case, math=True)
    return rf"$E_1 = {ratio:.4g}\,E_s$"


def _layers_in_words(count: int) -> str:
    if count < 2:
        return ("no layer", "one layer")[count]
    return f"{'two' if count == 2 else count} layers, each of the thickness given"


_MODULI = BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY
"""Colours of the moduli of Figure 3, of which the paper has two."""


def _by_modulus_and_thickness(case: CaseView) -> dict[str, Any]:
    if not case.layers:
        return {"color": "black", "linestyle": "", "marker": "+", "markersize": 4.5, "markeredgewidth": 0.8}
    look = LINES[case.index[case.grid.axes.index("thickness")] % len(LINES)]
    colour = _MODULI[case.index[case.grid.axes.index("modulus")] % len(_MODULI)]
    return look | {"color": colour, "markerfacecolor": "white", "markeredgewidth": 0.7}


_SEEN = 1e-3
"""Difference of two lines over the largest value from which it is seen."""


def lines_figure(number: int, grid: GridView) -> Figure:
    """Figures 5 and 6: -q_x on the x-axis against x/a; rows by modulus, columns by thickness, a line per creepage."""
    sizes = dict(zip(grid.axes, grid.shape, strict=True))
    figure, axes = panels(sizes["modulus"], sizes["thickness"], 2.3 * sizes["modulus"] + 0.3)
    groups: dict[str, list[CaseView]] = {}
    for case in grid.cases():
        groups.setdefault(panel_letter(case), []).append(case)
    in_order = sorted(groups.items(), key=lambda group: (len(group[0]), group[0]))  # z before aa
    for ax, (letter, cases) in zip(axes.flat, in_order, strict=True):
        solved = [c for c in cases if c.solved]
        if solved:
            draw.bound_line(ax, solved[-1], r"bound $\pm\mu p$")
        for case in solved:
            draw.traction_line(ax, case, creepage_text(case, math=True), _by_creepage(case))
        failures = [f"{creepage_text(c, math=True)}: {literal(c.failure)}" for c in cases if not c.solved]
        if failures:
            draw.remark(ax, [f"not solved: {failure}" for failure in failures], top=True)
        title = f"({letter}) {layers_text(cases[0], math=True)}, {thickness_text(cases[0], math=True)}"
        ax.set_title(title, loc="left")
        if not solved:
            ax.set(xticks=[], yticks=[])
    if any(case.solved for case in grid.cases()):
        share_limits(axes)
        for row in axes:
            _make_room(row)
        outer_labels(axes, "$x/a$", "$-q_x$ (MPa)")
        first = next(iter(groups.values()))
        looks = {r"bound $\pm\mu p$": draw.BOUND} | {creepage_text(c, math=True): _by_creepage(c) for c in first}
        legend(figure, looks, **LINE_SPACING)
    solved = [case for case in grid.cases() if case.solved]
    alone = "" if any(case.creepage[1] or case.creepage[2] for case in solved) else " under longitudinal creepage alone"
    spin = rf"; spin $\varphi$ in {unit_of('spin')}" if any(case.creepage[2] for case in solved) else ""
    text = (
        f"Longitudinal traction on the x-axis{alone}, shown as $-q_x$ (the traction on the "
        rf"counterbody); dashed: the bounds $\pm\mu p${_whose(solved)}{spin}. Rolling towards $+x$."
    )
    _caption(figure, number, grid, text, _small_creepages(grid), _symbols(grid.cases()), ROWS_NEXT_TO_AXIS)
    return figure


def _whose(solved: Iterable[CaseView]) -> str:
    """Of which creepage the bounds of Figures 5 and 6 are, where pressures visibly depend on it (full coupling).

    With one-way coupling all creepages have one pressure, up to the solver's tolerance.
    """
    lines: dict[tuple[int, ...], np.ndarray] = {}
    for case in solved:
        place = tuple(i for axis, i in zip(case.grid.axes, case.index, strict=True) if axis != "creepage")
        line = on_x_axis(case.field("pressure"), case.y)
        if np.abs(line - lines.setdefault(place, line)).max() > _SEEN * line.max():
            return " of the last creepage, on which the pressure depends"
    return ""


def _small_creepages(grid: GridView) -> str:
    """A remark that the paper's creepages, 0.02 to 0.1, are in per cent, if those of `grid` are a hundredth of them."""
    largest = max(abs(case.stored("longitudinal")) for case in grid.cases())
    words = "Creepages: the paper's range for Fig. 5, 0.02 to 0.1, read as per cent."
    return words if np.isclose(largest, 0.001) else ""


def _make_room(row: np.ndarray) -> None:
    """Raise the y limits of a row of panels for the remarks at their tops."""
    lines = [text.get_text().count("\n") + 1 for ax in row for text in ax.texts if text.get_gid() == "remark"]
    for ax in row if lines else ():
        bottom, top = ax.get_ylim()
        ax.set_ylim(bottom, top + (0.04 + 0.065 * max(lines)) * (top - bottom))


def _by_creepage(case: CaseView) -> dict[str, Any]:
    return LINES[case.index[case.grid.axes.index("creepage")] % len(LINES)]


_BESIDE = 0.35  # width of the labels beside a map's panel, inches
_NUMBERS = 0.17  # by which they are wider where all panels have numbers, inches
_TITLE_LINE = 0.145  # height of a line of a title, inches


def maps_show(body: str = "coated body") -> str:
    """What maps of the traction on this body show, without the last full stop."""
    return (
        f"Magnitude $|q|$ (colour) and direction (arrows, where it is above {100 * draw.LEAST_ARROW:g} % of "
        f"its largest) of the traction on the {body}. Rolling towards $+x$: the leading edge is at $+x$. In each "
        "panel: area of slip over area of contact"
    )


OTHER_PANELS = "Letters are the paper's, whose b, d, f and h are the same by another method."
"""Remark on the panels of the paper's Figure 4 that are not drawn here, where the others are."""


def paper_title(case: CaseView) -> str:
    """Two lines: panel letter with the layers, and the creepages."""
    layers = layers_text(case, math=True) + (f", {thickness_text(case, math=True)}" if case.layers else "")
    return f"({literal(panel_letter(case))}) {layers}\n{creepage_text(case, math=True)}"


def maps_figure(cases: Sequence[CaseView], title: Callable[[CaseView], str]) -> Figure:
    """Maps of |q|, a panel per case, with slip cells filled, stick cells open, arrows along q, one colour bar.

    One column for one case, two for up to four, else three. Panels have the same limits, or each its own if contacts
    differ much in size; no scales where no case has a map. UserError if the cube does not store the fields.
    """
    from matplotlib.colors import Normalize

    columns = 1 if len(cases) == 1 else 2 if len(cases) <= 4 else 3
    rows = -(-len(cases) // columns)
    width = (3.4, 5.2, WIDTH)[columns - 1]
    solved = [c for c in cases if c.rolling]
    shown = draw.window(solved)
    windows = dict(zip(solved, draw.windows(solved), strict=True))
    shared = len(set(windows.values())) <= 1
    beside = _BESIDE if shared else _BESIDE + _NUMBERS
    height = (width / columns - beside) * shown.shape + beside
    figure, axes = panels(rows, columns, (height + 0.12) * rows + 0.7, width=width)
    titles = {case: title(case) for case in cases}
    for row in range(rows):  # there is room for titles of two lines
        lines = max(titles[case].count("\n") + 1 for case in cases[row * columns : (row + 1) * columns])
        heighten(figure, _TITLE_LINE * max(0, lines - 2))
    # of what is drawn: aligned cells may store more than `traction_max`; without any traction there is no scale
    norm = Normalize(0.0, max((float(np.hypot(*traction(c)).max()) for c in solved), default=0.0) or 1.0)
    colours = traction_colours()
    for ax in axes.flat[len(cases) :]:
        ax.set_visible(False)
    steps = dict(zip(solved, draw.circle_steps(solved, list(windows.values())), strict=True))
    for ax, case in zip(axes.flat, cases, strict=False):
        shown.on(ax)
        ax.set_title(titles[case], loc="left", linespacing=1.35)
        if not case.rolling:
            if not shared:
                ax.set(xticks=[], yticks=[])
            draw.remark(ax, [f"not solved: {literal(case.failure)}" if case.failure else "pressure only"])
            continue
        draw.traction_map(ax, case, norm, colours, windows[case], steps[case])
        decimals = 1 if slip_ratio_error(case) < 0.005 and slip_ratio(case) < 1.0 else 0
        ratio = f"slip {100 * slip_ratio(case):.{decimals}f} %"
        ax.text(
            0.98,
            0.02,
            ratio,
            transform=ax.transAxes,
            ha="right",
            va="bottom",
            fontsize=6.5,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
            gid="slip-ratio",
        )
    if not solved:
        for ax in axes.flat:
            ax.set(xticks=[], yticks=[])
        return figure
    outer_labels(axes, "$x$ (mm), rolling $\\rightarrow$", "$y$ (mm)", shared=shared)
    _map_legend(figure, axes, norm, colours, list(steps.values()))
    return figure


def one_scale(cases: Iterable[CaseView]) -> bool:
    """Whether maps of these cases have the same limits in all panels."""
    return len(set(draw.windows([c for c in cases if c.rolling]))) <= 1


def scales(cases: Sequence[CaseView]) -> str:
    """Sentences on maps of these cases that are not to scale, or not to one scale; empty if they are."""
    words = [] if one_scale(cases) else ["Each panel has its own scale, as contacts differ much in size."]
    factor = draw.window(c for c in cases if c.rolling).stretch
    if factor != 1.0:
        one, other, times = ("y", "x", factor) if factor > 1.0 else ("x", "y", 1.0 / factor)
        words.append(f"Drawn {times:.2g} times as large along ${one}$ as along ${other}$, arrows at their true angles.")
    return " ".join(words)


def _map_legend(figure: Figure, axes: np.ndarray, norm: Any, colours: Any, steps: Sequence[tuple[int, int]]) -> None:
    from matplotlib.cm import ScalarMappable

    shown = [ax for ax in axes.flat if ax.get_visible()]
    bar = figure.colorbar(ScalarMappable(norm, colours), ax=shown, location="bottom", shrink=0.62, aspect=45, pad=0.015)
    bar.set_label("$|q|$ (MPa)")
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
