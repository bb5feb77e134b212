"""The paper's Figures 3 to 10 from the grids of a cube."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rcstudy.errors import UserError
from rcstudy.report import draw
from rcstudy.report.held import settings
from rcstudy.report.labels import fitted, literal, power_of_ten
from rcstudy.report.layers import NAMED, layers_text, thickness_text
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
from rcstudy.report.maps import scales, title_width, traction_maps, tractions_show
from rcstudy.report.measures import on_x_axis
from rcstudy.report.paper import AXES, BARE, panel_letter
from rcstudy.report.style import BLUE, GREEN, LINES, ORANGE, PURPLE, SKY, VERMILLION, WIDTH
from rcstudy.report.views import CaseView, GridView, creepage_text
from rcstudy.settings import unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BESIDE = 0.9  # width of a title of Figures 5 and 6 over that of its part of the figure, at most

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
    width = title_width([case for case in cases if case.rolling])
    figure = traction_maps(cases, lambda case: paper_title(case, width))
    shown = "".join(map(panel_letter, cases))
    more = _symbols(cases) if number != 4 else OTHER_PANELS if shown == "aceg" else ""
    body = "coated body" if any(case.layers for case in cases) else "substrate"
    what = rf"{tractions_show(body)}; spin $\varphi$ in {unit_of('spin')}."
    _caption(figure, number, grids[name], what, scales([case for case in cases if case.rolling]), more)
    return figure


def _caption(figure: Figure, number: int, grid: GridView, *sentences: str, friction: bool = True) -> None:
    """Write these sentences under Figure `number`, and what all cases of `grid` have in common."""
    words = (*sentences, settings(grid), conditions(grid, friction=friction))
    caption(figure, " ".join((f"Fig. {number}.", *filter(None, words))))


def pressure_figure(bare: GridView | None, layered: GridView | None) -> Figure:
    """Figure 3: p/p0 on the x-axis against x/a, a panel per number of layers, the uncoated case in each.

    Colour stands for the modulus, and so does whether markers are filled, as the colours are alike in grey; dash and
    marker stand for the thickness. The exact Hertz pressure is drawn too. UserError if there is neither grid.
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
            label = _coating_text(case) if case.layers else "no layer, computed"
            if case.solved:
                draw.pressure_line(ax, case, label, _by_modulus_and_thickness(case))
            else:
                failures.append(f"{label}: {literal(case.failure)}")
        if failures:
            draw.remark(ax, [f"not solved: {failure}" for failure in failures], top=True)
        words = _layers_in_words(len(cases[0].layers) if cases else 0)
        ax.set_title(f"({letter}) {words}" if letter else words, loc="left")
        ax.set_xlabel("$x/a$")
    legends = [_legend_below(ax, WIDTH / columns) for ax in axes.flat[: len(groups)]]
    for row in range(rows):
        heighten(figure, max(legends[row * columns : (row + 1) * columns]))
    share_limits(axes)
    for row in axes:
        for ax in row:
            ax.set_ylim(bottom=0.0)
        _make_room(row)
        row[0].set_ylabel("$p/p_0$")
    text = "Pressure on the x-axis over Hertz's peak pressure $p_0$ of the uncoated pair."
    _caption(figure, 3, grid, text, _symbols(grid.cases()), ROWS_NEXT_TO_AXIS, friction=False)
    return figure


def _legend_below(ax: Axes, width: float) -> float:
    """Put a legend under a panel, in two columns if `width` (inches) allows; returns by how much more it is high."""
    heights = []
    for columns in (2, 1):
        drawn = ax.legend(
            loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=columns, handlelength=3.4, columnspacing=1.0
        )
        box = drawn.get_window_extent()
        heights.append(box.height / ax.figure.dpi)
        if box.width <= width * ax.figure.dpi:
            break
    return heights[-1] - heights[0]


def _surface_text(case: CaseView) -> str:
    """The moduli of a case's layers; of more than `NAMED`, for which there is no room, that at the surface alone."""
    if len(case.layers) <= NAMED or not np.isfinite(case.substrate_modulus):
        return layers_text(case, math=True)
    ratio = case.layers[0][0] / case.substrate_modulus
    return rf"$E_1 = {power_of_ten(f'{ratio:.4g}')}\,E_s$"


def _coating_text(case: CaseView) -> str:
    """The layers' moduli and thickness, `no layer` without any."""
    return ", ".join(filter(None, (_surface_text(case), thickness_text(case, math=True))))


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
    modulus = case.index[case.grid.axes.index("modulus")]
    colour = _MODULI[modulus % len(_MODULI)]
    return look | {"color": colour, "markerfacecolor": ("white", colour)[modulus % 2], "markeredgewidth": 0.7}


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
            draw.bound_line(ax, solved[-1])
        for case in solved:
            draw.traction_line(ax, case, creepage_text(case, math=True), _by_creepage(case))
        failures = [f"{creepage_text(c, math=True)}: {literal(c.failure)}" for c in cases if not c.solved]
        if failures:
            draw.remark(ax, [f"not solved: {failure}" for failure in failures], top=True)
        title = fitted(f"({letter}) {_coating_text(cases[0])}", _BESIDE * WIDTH / sizes["thickness"])
        ax.set_title("\n".join(title), loc="left")
        if not solved:
            ax.set(xticks=[], yticks=[])
    if any(case.solved for case in grid.cases()):
        share_limits(axes)
        for row in axes:
            _make_room(row)
        outer_labels(axes, "$x/a$", "$-q_x$ (MPa)")
        first = next(iter(groups.values()))
        looks = {draw.BOUND_LABEL: draw.BOUND} | {creepage_text(c, math=True): _by_creepage(c) for c in first}
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


OTHER_PANELS = "Letters are the paper's, whose b, d, f and h are the same by another method."
"""Remark on the panels of the paper's Figure 4 that are not drawn here, where the others are."""


def paper_title(case: CaseView, width: float) -> str:
    """Panel letter with the layers, and below it the creepages, in lines of at most `width` inches."""
    above = fitted(f"({literal(panel_letter(case))}) {_coating_text(case)}", width)
    return "\n".join((*above, *fitted(creepage_text(case, math=True), width)))
