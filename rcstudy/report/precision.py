"""Report of speed against error: a table of all cases, the settings that reach a target, and a summary in words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rcstudy.report.writers import Column, Value

TARGETS = (0.01, 0.001, 0.0001)
"""The errors for which settings are looked up."""

QUANTITIES: dict[str, str] = {
    "pressure": "pressure, L2",
    "pressure_max": "largest pressure",
    "traction": "tractions, L2",
    "force": "force",
    "moment": "moment",
    "slip_area": "slip area",
}
"""The errors reported and their names in tables and figures."""

SOLVER = "solver_"
"""Prefix of the errors against the same mesh's tightest solution."""


_FAR = 10_000
"""Cells along a side that no solve will have."""


@dataclass(frozen=True)
class Row:
    """One case: what it is, what it cost, and its errors (by QUANTITIES, and with the prefix SOLVER; may be absent).

    `problem` numbers the problems; `line` names the case without mesh, tolerance and creepage; `cells` along x;
    `radius`: cells per contact radius; `products` of the traction solver on all meshes; `seconds` of the whole solve.
    """

    grid: str
    label: str
    line: str
    problem: int
    method: str
    coupling: str
    cells: int
    radius: float
    tolerance: float
    status: str
    products: float
    iterations_normal: float
    iterations_tangential: float
    seconds: float
    errors: dict[str, float] = field(default_factory=dict)

    @property
    def solved(self) -> bool:
        """Whether the case converged and its proof holds."""
        return self.status == "solved"

    def error(self, name: str) -> float:
        """The error `name`, NaN if there is none."""
        return self.errors.get(name, float("nan"))


@dataclass(frozen=True)
class Setting:
    """The coarsest mesh with the loosest tolerance whose worst error is within `target`, and what it costs.

    `cells` 0: none is; then `needed` cells would be, with the `order` at which the error falls over all meshes.
    """

    quantity: str
    target: float
    cells: int = 0
    radius: tuple[float, float] = (0.0, 0.0)
    tolerance: float = float("nan")
    worst: float = float("nan")
    products: float = float("nan")
    seconds: float = float("nan")
    seconds_full: float = float("nan")
    needed: float = float("nan")
    order: float = float("nan")


def settings(rows: Sequence[Row], quantities: Iterable[str] = tuple(QUANTITIES)) -> list[Setting]:
    """For each quantity and target the coarsest setting of the Newton method that keeps to it in every problem.

    A setting counts if all problems are solved with it, and if all finer meshes with that tolerance keep to the target
    too (errors of coarse meshes can be small by chance).
    """
    newton = [r for r in rows if r.method == "newton"]
    problems = {r.problem for r in newton if np.isfinite(r.error("pressure"))}
    of_setting: dict[tuple[int, float], list[Row]] = {}
    for r in newton:
        if r.problem in problems and np.isfinite(r.error("pressure")):
            of_setting.setdefault((r.cells, r.tolerance), []).append(r)
    whole = {key: group for key, group in of_setting.items() if {r.problem for r in group} == problems}
    found = []
    for quantity in quantities:
        worst = {key: max(r.error(quantity) if r.solved else np.inf for r in group) for key, group in whole.items()}
        for target in TARGETS:
            good = [
                key
                for key in whole
                if all(worst[other] <= target for other in whole if other[1] == key[1] and other[0] >= key[0])
            ]
            if not good:
                found.append(_extrapolated(Setting(quantity, target), whole, worst))
                continue
            key = min(good, key=lambda k: (k[0], -k[1]))
            group = whole[key]
            found.append(
                Setting(
                    quantity,
                    target,
                    key[0],
                    (min(r.radius for r in group), max(r.radius for r in group)),
                    key[1],
                    worst[key],
                    float(np.median([r.products for r in group])),
                    median(r.seconds for r in group if r.coupling == "one-way"),
                    median(r.seconds for r in group if r.coupling == "full"),
                )
            )
    return found


def _extrapolated(
    none: Setting, whole: dict[tuple[int, float], list[Row]], worst: dict[tuple[int, float], float]
) -> Setting:
    """`none` with the cells that its target would take, by a power law through all meshes at the tightest tolerance."""
    tightest = min((key[1] for key in whole), default=0.0)
    points = [(key[0], e) for key, e in worst.items() if key[1] == tightest and 0.0 < e < np.inf]
    if len(points) < 3:
        return none
    slope, start = np.polyfit(np.log([n for n, _ in points]), np.log([e for _, e in points]), 1)
    if slope > -0.1:
        return none
    return replace(none, needed=float(np.exp((np.log(none.target) - start) / slope)), order=-float(slope))


def median(values: Iterable[float]) -> float:
    """Median of what is known, NaN if nothing is."""
    known = [v for v in values if np.isfinite(v)]
    return float(np.median(known)) if known else float("nan")


def worst_of(values: Iterable[float]) -> float:
    """Largest of what is known, NaN if nothing is."""
    known = [v for v in values if np.isfinite(v)]
    return max(known) if known else float("nan")


Table = tuple[str, Sequence[Column], list[dict[str, Value]]]
"""Caption, columns, rows."""


def errors_table(rows: Sequence[Row]) -> Table:
    """All cases."""
    columns = [
        Column("grid", "Grid"),
        Column("case", "Case"),
        Column("status", "Status"),
        *(Column(f"error_{name}", f"Error: {words}", form=".1e") for name, words in QUANTITIES.items()),
        *(
            Column(f"{SOLVER}error_{name}", f"Solver's error: {QUANTITIES[name]}", form=".1e")
            for name in ("pressure", "traction")
        ),
        Column("products", "Products", form=".0f"),
        Column("iterations_normal", "Steps, pressure", form=".0f"),
        Column("iterations_tangential", "Steps, tractions", form=".0f"),
        Column("seconds", "Seconds", form=".3g"),
    ]
    listed: list[dict[str, Value]] = []
    for r in rows:
        row: dict[str, Value] = {"grid": r.grid, "case": r.label, "status": r.status}
        row |= {f"error_{name}": r.error(name) for name in QUANTITIES}
        row |= {f"{SOLVER}error_{name}": r.error(SOLVER + name) for name in ("pressure", "traction")}
        row |= {"products": r.products, "iterations_normal": r.iterations_normal}
        row |= {"iterations_tangential": r.iterations_tangential, "seconds": r.seconds}
        listed.append(row)
    caption = (
        "Error of every case against the converged reference of its problem, and the solver's own error (against the "
        "tightest solution on the same mesh); products on all meshes, preconditioner included; processor time of the "
        "whole solve. Empty where the case is the reference, or has no numbers."
    )
    return caption, columns, listed


def settings_table(chosen: Sequence[Setting]) -> Table:
    """The settings found."""
    columns = (
        Column("quantity", "Quantity"),
        Column("target", "Target", form="g"),
        Column("cells", "Cells"),
        Column("radius", "Cells per contact radius"),
        Column("tolerance", "Tolerance", form=".0e"),
        Column("worst", "Worst error", form=".1e"),
        Column("products", "Products, median", form=".0f"),
        Column("seconds", "Seconds, one-way", form=".2g"),
        Column("seconds_full", "Seconds, full", form=".2g"),
    )
    listed: list[dict[str, Value]] = []
    for s in chosen:
        row: dict[str, Value] = {"quantity": QUANTITIES[s.quantity], "target": s.target, "cells": _none(s)}
        if s.cells:
            row |= {
                "cells": f"{s.cells} x {s.cells}",
                "radius": f"{s.radius[0]:.0f} to {s.radius[1]:.0f}",
                "tolerance": s.tolerance,
                "worst": s.worst,
                "products": s.products,
                "seconds": s.seconds,
                "seconds_full": s.seconds_full,
            }
        listed.append(row)
    caption = (
        "The coarsest mesh, and on it the loosest tolerance, that keeps every problem within the target, on that mesh "
        "and all finer ones; medians over the problems. About: none of the meshes does; extrapolated by a power law."
    )
    return caption, columns, listed


def _none(s: Setting) -> str:
    if not np.isfinite(s.needed):
        return "none"
    needed = f"about {float(f'{s.needed:.1g}'):.0f} along a side" if s.needed < _FAR else "far out of reach"
    return f"{needed} (order {s.order:.1f})"


def summary_text(
    rows: Sequence[Row], chosen: Sequence[Setting], couplings: Sequence[tuple[str, dict[str, float]]]
) -> str:
    """The findings in words (Markdown)."""
    newton = [r for r in rows if r.method == "newton"]
    lines = [
        "# Speed against error",
        "",
        f"{len(rows)} cases of {len({r.problem for r in rows})} problems. Errors are differences from each problem's",
        "finest mesh with the tightest tolerance; fields are compared on the case's own mesh, the reference's cells",
        "averaged over each of its cells. Force is relative to its magnitude, moment to friction x load x contact",
        "radius, slip area to the contact area. The method is of first order: an error against a mesh twice as fine",
        "understates the true one by half, against one four times as fine by a quarter. Seconds are processor time of",
        "one whole solve, coefficients and pressure included.",
        "",
        "## Which setting",
        "",
    ]
    for target in TARGETS:
        lines.append(f"- **{_per_cent(target)}**: {_sentence([s for s in chosen if s.target == target])}")
    lines += [
        "",
        "![Error of the tractions against seconds and products](work_precision.png)",
        "",
        "Above (a, b): against the converged reference, along the meshes (numbers: cells along a side), worst over",
        "the creepages. Below (c, d): against the same mesh's tightest solution, along the tolerances, median over",
        "the problems with one-way coupling. `paper cg`, `paper-cg`: the paper's own iteration.",
        "",
        "![Worst error of each quantity](quantities.png)",
        "",
        "All settings: [settings.md](settings.md); all cases: [errors.md](errors.md).",
        "",
        "## Tolerance",
        "",
        "Difference from the tightest solution on the same mesh, worst and median over all meshes and problems:",
        "",
        "| Tolerance | Solved | Pressure, worst | Tractions, worst | Tractions, median | Products, median |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    found: list[tuple[float, float]] = []
    for tolerance in sorted({r.tolerance for r in newton}, reverse=True):
        group = [r for r in newton if r.tolerance == tolerance and _compared(r, newton)]
        if not group:
            continue
        numbers = (
            worst_of(r.error(SOLVER + "pressure") for r in group),
            worst_of(r.error(SOLVER + "traction") for r in group),
            median(r.error(SOLVER + "traction") for r in group),
        )
        texts = [f"{n:.1e}" if np.isfinite(n) else "-" for n in numbers]
        products = median(r.products for r in group)
        solved = f"{sum(r.solved for r in group)} of {len(group)}"
        lines.append(f"| {tolerance:.0e} | {solved} | {' | '.join(texts)} | {products:.0f} |")
        found += [(tolerance, max(numbers[:2]))] if np.isfinite(numbers[:2]).all() else []
    reach = [
        f"{_per_cent(t)}: {max(k for k, e in found if e <= t):.0e}" for t in TARGETS if any(e <= t for _, e in found)
    ]
    lines += ["", f"Tolerance that keeps pressure and tractions of every case within it: {'; '.join(reach) or 'none'}."]
    lines += _methods(rows) + _couplings(couplings) + _unsolved(rows)
    return "\n".join(lines) + "\n"


def _compared(row: Row, rows: Sequence[Row]) -> bool:
    """Whether `row` is on a mesh that has several tolerances."""
    return len({r.tolerance for r in rows if r.problem == row.problem and r.cells == row.cells}) > 1


def _per_cent(value: float) -> str:
    return f"{100 * value:g} %"


def _sentence(chosen: Sequence[Setting]) -> str:
    parts = []
    of_setting: dict[tuple[int, float], list[Setting]] = {}
    for s in chosen:
        of_setting.setdefault((s.cells, s.tolerance if s.cells else 0.0), []).append(s)
    for (cells, tolerance), group in sorted(of_setting.items(), key=lambda item: item[0][0] or 10**9):
        if not cells:
            reached = ", ".join(f"{QUANTITIES[s.quantity]} ({_none(s)})" for s in group)
            parts.append(f"not reached on these meshes, extrapolated: {reached}")
            continue
        s = group[0]
        names = ", ".join(QUANTITIES[s.quantity] for s in group)
        cost = f"{s.products:.0f} products, {1e3 * s.seconds:.3g} ms one-way"
        cost += f", {1e3 * s.seconds_full:.3g} ms full" if np.isfinite(s.seconds_full) else ""
        where = f"{s.radius[0]:.0f} to {s.radius[1]:.0f} cells per contact radius"
        parts.append(f"{names}: {cells} x {cells} cells ({where}), tolerance {tolerance:.0e}: {cost}")
    return "; ".join(parts) + "."


def _methods(rows: Sequence[Row]) -> list[str]:
    other = [r for r in rows if r.method != "newton" and np.isfinite(r.error(SOLVER + "traction"))]
    lines = []
    for method in sorted({r.method for r in other}):
        own = [r for r in other if r.method == method]
        errors = [r.error(SOLVER + "traction") for r in own]
        tight = min(r.tolerance for r in own)
        products = median(r.products for r in own if r.tolerance == tight)
        force = [r.error(SOLVER + "force") for r in own if r.tolerance == tight]
        lines += [
            "",
            f"## Method {method}",
            "",
            f"Its tractions differ by {_range(errors)} (L2) from the discrete Coulomb solution on the same mesh,",
            f"whatever the tolerance; its forces, at {tight:.0e}, by {_range(force)}, after {products:.0f} products",
            f"(median). {sum(r.solved for r in own)} of {len(own)} cases pass their proof.",
        ]
    return lines


def _range(errors: Sequence[float]) -> str:
    return f"{100 * min(errors):.2g} to {100 * max(errors):.2g} %"


def _couplings(couplings: Sequence[tuple[str, dict[str, float]]]) -> list[str]:
    if not couplings:
        return []
    lines = [
        "",
        "## What one-way coupling leaves out",
        "",
        "References with `coupling: one-way` against those with `full`:",
        "",
        "| Problem | " + " | ".join(QUANTITIES.values()) + " |",
        "| --- |" + " --- |" * len(QUANTITIES),
    ]
    for name, errors in couplings:
        lines.append(
            f"| {name} | "
            + " | ".join(f"{100 * errors[q] if errors[q] > 1e-9 else 0.0:.2g} %" for q in QUANTITIES)
            + " |"
        )
    return lines


def _unsolved(rows: Sequence[Row]) -> list[str]:
    failed = [r for r in rows if not r.solved and r.method == "newton"]
    if not failed:
        return []
    lines = [
        "",
        "## Not solved",
        "",
        "Cases of the Newton method that are not solved, and are not recommended above:",
        "",
    ]
    for status in sorted({r.status for r in failed}):
        own = [r for r in failed if r.status == status]
        tolerances = ", ".join(f"{t:.0e}" for t in sorted({r.tolerance for r in own}, reverse=True))
        lines.append(f"- {status}: {len(own)} (tolerance {tolerances}): {own[0].grid}, {own[0].label} and the like")
    return lines
