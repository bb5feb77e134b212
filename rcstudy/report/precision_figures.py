"""Figures of speed against error."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from string import ascii_lowercase
from typing import TYPE_CHECKING, Any

from rcstudy.report.draw import remark
from rcstudy.report.layout import caption, log_ticks, panels
from rcstudy.report.precision import (
    LEAST,
    OF_FEWER,
    QUANTITIES,
    SHOWN,
    SOLVER,
    BothTolerances,
    Cells,
    Row,
    explained,
    marks,
    median,
    proven,
    schemes,
    shown_coupling,
    shown_tolerance,
    shown_tolerances,
    some_lack,
    worst_of,
)
from rcstudy.report.style import BLUE, LINES, VERMILLION

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SECONDS, _PRODUCTS = "processor time of the whole solve (s)", "products of the traction solver, all meshes"

_OTHER = "0.45"  # colour of methods that are shown for comparison
_SCHEMES: dict[str, dict[str, Any]] = {
    "kalker": {"color": VERMILLION, "marker": "s"},
    "aligned": {"color": BLUE, "marker": "o"},
}


def work_precision(rows: Sequence[Row]) -> Figure | None:
    """Error against the reference over seconds, a panel for each quantity; None without cases that have such errors.

    Lines run along the meshes: medians over the problems of one discretisation and coupling. Dots: one-way problems.
    """
    rows = [r for r in rows if r.counts]
    if not any(r.error(quantity) > 0.0 for r in rows for quantity in SHOWN):
        return None
    figure, axes = panels(2, 3, 4.6, sharex=True, sharey=True)
    tolerances = shown_tolerances(rows)
    for k, (ax, quantity) in enumerate(zip(axes.flat, SHOWN, strict=True)):
        for scheme, tolerance in tolerances.items():
            own = [r for r in rows if r.scheme == scheme and r.tolerance == tolerance]
            for coupling in sorted({r.coupling for r in own}, reverse=True):
                _medians(ax, [r for r in own if r.coupling == coupling], quantity)
        ax.set(xscale="log", yscale="log")
        ax.set_title(f"({ascii_lowercase[k]}) {QUANTITIES[quantity]}", loc="left", fontweight="bold")
        ax.grid(True, which="major", linewidth=0.4, color="0.88")
        if not ax.lines:
            symmetric = all(math.isnan(r.error(quantity)) for r in rows)  # see docs/study.md
            remark(ax, ["zero by symmetry" if symmetric else "no errors"])
    drawn = [float(y) for ax in axes.flat for line in ax.lines for y in line.get_ydata()]
    # all share it: no line, nor its labels, leaves the panels
    axes[0, 0].set_ylim(0.2 * min([LEAST, *drawn]), max([1.0, *(1.3 * y for y in drawn)]))
    log_ticks(axes[0, 0].xaxis, axes[0, 0].get_xlim())
    for ax in axes[1]:
        ax.set_xlabel(_SECONDS)
    for ax in axes[:, 0]:
        ax.set_ylabel("relative error")
    named = {name: line for ax in axes.flat for line, name in zip(*ax.get_legend_handles_labels(), strict=True)}
    figure.legend(named.values(), named.keys(), loc="outside upper center", ncols=5, handlelength=3.6)
    each = _by_scheme({name: str(tolerance) for name, tolerance in tolerances.items()})
    numbers, dots = marks(rows)
    if dots:
        dots += f", where its error is {LEAST:.0e} or more"
    caption(
        figure,
        f"Lines: medians over the problems along the meshes{numbers}{dots}. "
        f"Tolerance: {each}.{explained(tolerances.values())} "
        + proven(r for r in rows if r.tolerance == tolerances[r.scheme]),
    )
    return figure


def _by_scheme(words: dict[str, str]) -> str:
    """Words for each scheme, once if they are the same for all."""
    if len(set(words.values())) == 1:
        return next(iter(words.values()))
    return "; ".join(f"{name} {text}" for name, text in words.items())


def _medians(ax: Axes, rows: Sequence[Row], quantity: str) -> None:
    """Draw the line through the medians of each mesh, labelled with cells in one panel; one-way problems as dots."""
    rows = [r for r in rows if r.error(quantity) > 0.0]
    groups = [[r for r in rows if r.cells == n] for n in sorted({r.cells for r in rows})]
    if not groups:
        return
    first, one_way = rows[0], rows[0].coupling == "one-way"
    look = dict(_SCHEMES.get(first.scheme, {"color": _OTHER, "marker": "D"}))
    marker = look.pop("marker")
    if one_way:
        dots = {"linestyle": "none", "marker": marker, "markersize": 2.2, "alpha": 0.5, "markeredgewidth": 0}
        shown = [r for r in rows if r.error(quantity) >= LEAST]
        ax.plot([r.seconds for r in shown], [r.error(quantity) for r in shown], **look, **dots, zorder=2)
    else:
        look |= {"linestyle": (0, (4, 1.5)), "markerfacecolor": "white"}
    x = [median(r.seconds for r in group) for group in groups]
    y = [median(r.error(quantity) for r in group) for group in groups]
    name = f"{first.scheme}, {first.coupling}" if first.method == "newton" else first.scheme
    ax.plot(x, y, **look, marker=marker, markersize=3.4, linewidth=1.3, zorder=3, label=name)
    if quantity == "friction_power" and one_way and first.scheme == "aligned":  # has room for labels
        for group, *place in zip(groups, x, y, strict=True):
            _name_mesh(ax, group[0].cells, (place[0], place[1]), (-8, -9), look["color"])


def _name_mesh(ax: Axes, cells: Cells, place: tuple[float, float], away: tuple[float, float], colour: str) -> None:
    """Write the number of cells along a side beside a point of a line, `away` points from it."""
    from matplotlib.patheffects import withStroke

    # outlined in white, as other lines may run behind it; a box would cut dots beside it
    outline = [withStroke(linewidth=1.5, foreground="white")]
    look: dict[str, Any] = {"ha": "center", "fontsize": 6, "color": colour, "path_effects": outline, "zorder": 4}
    ax.annotate(cells.short, place, away, textcoords="offset points", **look)


def tolerances_figure(rows: Sequence[Row]) -> Figure | None:
    """Solver's error over seconds and products, along the tolerances: medians over the problems of one coupling.

    None without cases that have such an error.
    """
    usable = [r for r in rows if r.shown and r.error(SOLVER + "traction") > 0.0]
    usable = [r for r in usable if r.coupling == shown_coupling(usable)]
    if not usable:
        return None
    figure, (axes,) = panels(1, 2, 3.3, sharey=True)
    costs: tuple[Callable[[Row], float], ...] = (lambda r: r.seconds, lambda r: r.products)
    tolerances: dict[str, list[BothTolerances]] = {}
    for scheme in schemes(usable):
        named = False
        tolerances[scheme] = sorted({r.tolerance for r in usable if r.scheme == scheme}, reverse=True)
        for cells in sorted({r.cells for r in usable if r.scheme == scheme}):
            own = [r for r in usable if r.scheme == scheme and r.cells == cells]
            groups = [[r for r in own if r.tolerance == t] for t in sorted({r.tolerance for r in own}, reverse=True)]
            look = _SCHEMES.get(scheme, {"color": _OTHER, "marker": "D", "markerfacecolor": "white"})
            y = [median(r.error(SOLVER + "traction") for r in group) for group in groups]
            for ax, cost in zip(axes, costs, strict=True):
                x = [median(map(cost, group)) for group in groups]
                ax.plot(x, y, **look, label=None if named else scheme)
            if scheme == "kalker":
                _name_mesh(axes[0], cells, (median(map(costs[0], groups[0])), y[0]), (-4, 5), look["color"])
            named = True
    for ax, title, words in zip(axes, ("(a) time", "(b) products"), (_SECONDS, _PRODUCTS), strict=True):
        ax.set(xscale="log", yscale="log", xlabel=words)
        log_ticks(ax.xaxis, ax.get_xlim())
        ax.set_title(title, loc="left", fontweight="bold")
        ax.grid(True, which="major", linewidth=0.4, color="0.88")
    axes[0].set_ylabel("error of the tractions, L2, against\nthe same mesh's tightest solution")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    each = _by_scheme({name: ", ".join(map(str, found)) for name, found in tolerances.items()})
    both = explained(t for found in tolerances.values() for t in found)
    numbers = " (numbers: cells along a side)" if "kalker" in tolerances else ""
    shown = f"A point for each mesh{numbers}, tolerance"
    if any(len(found) > 1 for found in tolerances.values()):
        order = "from the loosest tolerance to the tightest but the reference's"
        shown = f"A line for each mesh{numbers}, its points {order}"
    caption(
        figure,
        f"{shown}: {each}.{both} Medians over the problems with {shown_coupling(usable)} coupling. {proven(usable)}",
    )
    return figure


def quantities_figure(rows: Sequence[Row]) -> Figure | None:
    """Worst error of each quantity over cells per radius, a panel for each discretisation; None without such errors.

    The worst is taken over the Newton method's problems with one-way coupling, or with full coupling if there are no
    others.
    """
    newton = [r for r in rows if r.method == "newton" and r.counts]
    newton = [r for r in newton if r.coupling == shown_coupling(newton)]
    tolerance = shown_tolerance(newton)
    newton = [r for r in newton if r.tolerance == tolerance]
    names = schemes(newton)
    if not names:
        return None
    # one that is zero by symmetry has no error, nor a line in the legend
    shown = [quantity for quantity in QUANTITIES if any(math.isfinite(r.error(quantity)) for r in newton)]
    figure, (axes,) = panels(1, len(names), 3.4, sharey=True)
    for ax, name, letter in zip(axes, names, "abcd", strict=False):
        own = [r for r in newton if r.scheme == name]
        groups = [[r for r in own if r.cells == n] for n in sorted({r.cells for r in own})]
        x = [median(r.radius for r in group) for group in groups]
        for k, (quantity, words) in enumerate(QUANTITIES.items()):
            if quantity in shown:
                ax.plot(x, [worst_of(r.error(quantity) for r in group) for group in groups], label=words, **_look(k))
        ax.set(xscale="log", yscale="log", xlabel="cells per contact radius, median")
        log_ticks(ax.xaxis, ax.get_xlim())
        ax.set_title(f"({letter}) {name}", loc="left", fontweight="bold")
        ax.grid(True, which="major", linewidth=0.4, color="0.88")
    axes[0].set_ylabel("worst relative error")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=4, columnspacing=1.6)
    caption(
        figure,
        f"Worst error of each quantity, relative to its own value, over the problems with {shown_coupling(newton)} "
        f"coupling{OF_FEWER * some_lack(newton)} at tolerance {tolerance}, along the meshes; "
        f"fields in the L2 norm.{explained([tolerance])}",
    )
    return figure


def _look(k: int) -> dict[str, Any]:
    """The k-th look: those of the style, then the same lines in grey."""
    look = dict(LINES[k % len(LINES)])
    if k >= len(LINES):
        look |= {"color": _OTHER, "markerfacecolor": "white"}
    return look
