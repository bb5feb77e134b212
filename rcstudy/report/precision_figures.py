"""Figures of speed against error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rcstudy.report.precision import QUANTITIES, SOLVER, TARGETS, Row, median, worst_of
from rcstudy.report.style import COLOURS, LINES, WIDTH

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def work_precision(rows: Sequence[Row]) -> Figure:
    """Error of the tractions against seconds and products: along the meshes, and along the tolerances."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, 6.6), layout="constrained")
    halves: Any = figure.subfigures(2, 1)
    for half, letters, draw in zip(halves, ("ab", "cd"), (_along_meshes, _along_tolerances), strict=True):
        axes = half.subplots(1, 2, sharey=True)
        draw(axes, rows)
        costs = "processor time of the whole solve (s)", "products of the traction solver, all meshes"
        for ax, letter, words in zip(axes, letters, costs, strict=True):
            ax.set(xscale="log", yscale="log", xlabel=words)
            ax.set_title(f"({letter})", loc="left", fontweight="bold")
            ax.grid(True, which="major", linewidth=0.4, color="0.88")
        half.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, handlelength=3.2)
    return figure


_COSTS: tuple[Callable[[Row], float], ...] = (lambda r: r.seconds, lambda r: r.products)


def _along_meshes(axes: Sequence[Axes], rows: Sequence[Row]) -> None:
    """Error against the reference along the meshes at one tolerance, worst over the creepages of each line."""
    rows = [r for r in rows if np.isfinite(r.error("traction")) and (r.solved or r.method != "newton")]
    names = list(dict.fromkeys(r.line for r in rows))
    for k, name in enumerate(names):
        own = [r for r in rows if r.line == name]
        tolerance = _shown_tolerance(own)
        groups = [[r for r in own if r.cells == n and r.tolerance == tolerance] for n in sorted({r.cells for r in own})]
        look = _look(k)
        if own[0].method != "newton":
            look |= {"color": "0.45", "markerfacecolor": "white"}
        for ax, cost in zip(axes, _COSTS, strict=True):
            x = [median(map(cost, group)) for group in groups if group]
            y = [worst_of(r.error("traction") for r in group) for group in groups if group]
            ax.plot(x, y, label=name, **look)
        if k == 0:
            for group in filter(None, groups):
                place = median(r.seconds for r in group), worst_of(r.error("traction") for r in group)
                axes[0].annotate(
                    f"{group[0].cells}", place, (-4, -3), textcoords="offset points", ha="right", va="top", fontsize=6
                )
    axes[0].set_ylabel("error of the tractions, L2\nagainst the converged reference")
    axes[0].margins(x=0.1)


def _shown_tolerance(rows: Sequence[Row]) -> float:
    """The loosest tolerance but one: of those that count, the one that is enough for all meshes."""
    found = sorted({r.tolerance for r in rows}, reverse=True)
    return found[min(1, len(found) - 1)]


def _along_tolerances(axes: Sequence[Axes], rows: Sequence[Row]) -> None:
    """Solver's error along the tolerances: medians over the problems, a line a mesh and method."""
    usable = [r for r in rows if np.isfinite(r.error(SOLVER + "traction")) and r.error(SOLVER + "traction") > 0.0]
    k = 0
    for method in sorted({r.method for r in usable}):
        for cells in sorted({r.cells for r in usable if r.method == method}):
            own = [r for r in usable if r.method == method and r.cells == cells and r.coupling == "one-way"]
            groups = [[r for r in own if r.tolerance == t] for t in sorted({r.tolerance for r in own}, reverse=True)]
            look = _look(k)
            if method != "newton":
                look |= {"color": "0.45", "markerfacecolor": "white"}
            for ax, cost in zip(axes, _COSTS, strict=True):
                x = [median(map(cost, group)) for group in groups]
                y = [median(r.error(SOLVER + "traction") for r in group) for group in groups]
                ax.plot(x, y, label=f"{method}, {cells} x {cells}", **look)
            k += 1
    axes[0].set_ylabel("error of the tractions, L2\nagainst the same mesh's tightest solution")


def quantities_figure(rows: Sequence[Row]) -> Figure:
    """Worst error of each quantity over the Newton method's problems, against cells per radius and seconds."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, 3.2), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    newton = [r for r in rows if r.method == "newton" and np.isfinite(r.error("pressure"))]
    tolerance = _shown_tolerance(newton)
    groups = [
        [r for r in newton if r.cells == n and r.tolerance == tolerance] for n in sorted({r.cells for r in newton})
    ]
    groups = [group for group in groups if group]
    for k, (name, words) in enumerate(QUANTITIES.items()):
        y = [worst_of(r.error(name) for r in group) for group in groups]
        for ax, cost in zip(axes, (lambda r: r.radius, lambda r: r.seconds), strict=True):
            ax.plot([median(map(cost, group)) for group in groups], y, label=words, **_look(k))
    for ax, letter, words in zip(axes, "ab", ("cells per contact radius", "processor time (s), median"), strict=True):
        ax.set(xscale="log", yscale="log", xlabel=words)
        ax.set_title(f"({letter})", loc="left", fontweight="bold")
        for target in TARGETS:
            ax.axhline(target, color="0.7", linewidth=0.6, linestyle=(0, (1, 2)), zorder=0)
    axes[0].set_ylabel(f"worst error, tolerance {tolerance:.0e}")
    handles = axes[0].get_legend_handles_labels()
    figure.legend(*handles, loc="outside lower center", ncols=len(QUANTITIES), columnspacing=1.2)
    return figure


def _look(k: int) -> dict[str, Any]:
    """The k-th look: those of the style, then the same lines in other colours."""
    look = dict(LINES[k % len(LINES)])
    if k >= len(LINES):
        look["color"] = COLOURS[(k + 3) % len(COLOURS)]
    return look
