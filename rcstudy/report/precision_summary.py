"""Speed against error: the tables and the summary in words."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Collection, Iterable, Sequence

import numpy as np

from rcstudy.progress import counted
from rcstudy.report.cells import Column, Table, Value
from rcstudy.report.precision import (
    LEAST,
    OF_FEWER,
    QUANTITIES,
    REFERENCE,
    SOLVER,
    TARGETS,
    BothTolerances,
    Cells,
    Row,
    Setting,
    costs_of_aligned,
    explained,
    marks,
    median,
    of_both,
    schemes,
    shown_tolerance,
    some_lack,
    worst_of,
)
from rcstudy.report.writers import markdown_lines, markdown_text

FIGURES = ("work_precision", "quantities", "tolerances")
"""Names of the figures that the summary shows if they are drawn."""

_NO_ERRORS = (
    "None can be chosen: no case of method newton has numbers on another mesh than the reference of its problem, and "
    "on the same mesh the difference from it does not show the error of that mesh. This takes a case on a finer mesh."
)

_MOST_CELLS = 10_000
"""Number of cells along a side beyond which no solve is feasible."""


def errors_table(rows: Sequence[Row]) -> Table:
    """Caption, columns and rows: errors and costs, one row a case."""
    columns = [
        Column("grid", "Grid"),
        Column("scheme", "Discretisation"),
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
        row: dict[str, Value] = {"grid": r.grid, "scheme": r.scheme, "case": r.label, "status": r.status}
        row |= {f"error_{name}": r.error(name) for name in QUANTITIES}
        row |= {f"{SOLVER}error_{name}": r.error(SOLVER + name) for name in ("pressure", "traction")}
        row |= {"products": r.products, "iterations_normal": r.iterations_normal}
        row |= {"iterations_tangential": r.iterations_tangential, "seconds": r.seconds}
        listed.append(row)
    caption = (
        "Error of every case against the converged reference of its problem, and the solver's own error (against the "
        "tightest solution on the same mesh); products on all meshes, preconditioner included; processor time of the "
        "whole solve. Empty where the case has no numbers or the quantity is zero by symmetry; errors also on the mesh "
        "of the reference, or where the problem has none; solver's errors also where the case is itself the tightest "
        "solution, or there is none."
    )
    return caption, columns, listed


def settings_table(chosen: Sequence[Setting]) -> Table:
    """Caption, columns and rows: one row a setting, or what is known of one that was not found."""
    columns = (
        Column("coupling", "Coupling"),
        Column("quantity", "Quantity"),
        Column("target", "Target", form="g"),
        Column("discretisation", "Discretisation"),
        Column("cells", "Cells"),
        Column("radius", "Cells per contact radius"),
        *_tolerance_columns(chosen),
        Column("worst", "Worst error", form=".1e"),
        Column("products", "Products, median", form=".0f"),
        Column("seconds", "Seconds, median", form=".2g"),
    )
    listed: list[dict[str, Value]] = []
    names = list(QUANTITIES)
    couplings = list(dict.fromkeys(s.coupling for s in chosen))
    for s in sorted(chosen, key=lambda s: (couplings.index(s.coupling), names.index(s.quantity), -s.target)):
        row: dict[str, Value] = {"coupling": s.coupling, "quantity": QUANTITIES[s.quantity], "target": s.target}
        row |= {"discretisation": s.discretisation, "cells": _none(s)}
        if s.cells is not None and s.tolerance is not None:
            row |= {
                "cells": str(s.cells),
                "radius": _range_of(s.radius, ".0f"),
                **_tolerance_values(s.tolerance),
                "worst": s.worst,
                "products": s.products,
                "seconds": s.seconds,
            }
        listed.append(row)
    caption = (
        "The coarsest mesh, and on it the loosest tolerance, that keeps every problem within the target, on that mesh "
        "and all finer ones; medians over the problems. Errors include the estimated error of the reference. About: "
        "none of the meshes does; extrapolated by a power law, rounded up."
    )
    return caption if listed else _NO_ERRORS, columns, listed


def _tolerance_columns(chosen: Sequence[Setting]) -> list[Column]:
    """One column, or one for pressure and one for tractions if these have different tolerances in some setting."""
    differ = any(s.tolerance is not None and s.tolerance.differ for s in chosen)
    titles = {"normal": ", pressure", "tangential": ", tractions"} if differ else {"": ""}
    tolerances = [t for s in chosen if s.tolerance is not None for t in (s.tolerance.normal, s.tolerance.tangential)]
    form = ".0e" if all(float(f"{t:.0e}") == t for t in tolerances) else "g"
    return [Column(f"tolerance_{key}".rstrip("_"), f"Tolerance{title}", form=form) for key, title in titles.items()]


def _tolerance_values(tolerance: BothTolerances) -> dict[str, Value]:
    """What the columns of `_tolerance_columns` have in a row."""
    normal, tangential = tolerance.normal, tolerance.tangential
    return {"tolerance": normal, "tolerance_normal": normal, "tolerance_tangential": tangential}


def _none(s: Setting) -> str:
    return f"{_needed(s)} (order {s.order:.1f})" if np.isfinite(s.needed) else "none"


def _needed(s: Setting) -> str:
    """How many cells the target of a setting that was not found would take, in words."""
    if not s.finest:
        return "no mesh and tolerance that all problems share"
    if not np.isfinite(s.needed):
        return "no estimate"  # fewer than three meshes, or errors that do not fall
    if s.needed > _MOST_CELLS:
        return "far out of reach"
    if s.needed > s.finest:
        step = 10 ** max(len(str(int(s.needed))) - 2, 0)  # rounded up: all meshes that were tried are too coarse
        return f"about {math.ceil(s.needed / step) * step:.0f} along a side"
    return f"more than {s.finest:.0f} along a side"


def summary_text(
    rows: Sequence[Row],
    chosen: Sequence[Setting],
    couplings: Sequence[tuple[str, dict[str, float]]],
    drawn: Collection[str] = FIGURES,
) -> str:
    """The findings in words (Markdown), with links to the figures `drawn`."""
    lines = [
        "# Speed against error",
        "",
        *_paragraph(
            f"{counted(len(rows), 'case')} of {_problems(rows)}. Errors are differences from each "
            "problem's reference, its solved case on the finest mesh with the tightest tolerance "
            f"({_references(rows)}), each relative to its own value (force: the vector, to its magnitude). Pressure "
            "and tractions are compared on the case's own mesh in the L2 norm, the reference's cells averaged over "
            "each of its cells. The pressure does not depend on the discretisation of the slip, except with full "
            "coupling. Aligned cells find their tractions on moved rows and store them at the mesh's own cell centres: "
            "what that interpolation loses counts as their error. Forces, moment, friction power, slip area and "
            "largest traction come from the moved rows themselves. Seconds are processor time of one whole solve, "
            f"coefficients and pressure included.{explained(r.tolerance for r in rows)}"
        ),
        "",
        "## Which setting",
        "",
        *_side_by_side(rows),
        *_recommended(chosen),
        *(_work_precision(rows) if "work_precision" in drawn else []),
        *_by_mesh(rows),
        *(["", "![Worst error of each quantity](quantities.png)"] if "quantities" in drawn else []),
        *_reference(rows),
        *_tolerances(rows),
        *(["", "![Error of the tractions along the tolerances](tolerances.png)"] if "tolerances" in drawn else []),
        *_methods(rows),
        *_couplings(couplings),
        *_unsolved(rows),
    ]
    return "\n".join(lines) + "\n"


def _work_precision(rows: Sequence[Row]) -> list[str]:
    numbers, dots = marks(rows)
    return [
        "",
        "![Errors against seconds](work_precision.png)",
        "",
        *_paragraph(
            f"Lines along the meshes{numbers}: medians over the problems{dots}. Single errors can be small by chance, "
            "where two of opposite sign meet."
        ),
    ]


def _problems(rows: Iterable[Row]) -> str:
    return counted(len({r.problem for r in rows}), "problem")


def _range_of(numbers: Iterable[float], form: str) -> str:
    """Least and largest of `numbers` in a format, `9 to 18`; a single number if they are the same in it."""
    found = list(numbers)
    return " to ".join(dict.fromkeys(f"{end:{form}}" for end in (min(found), max(found))))


def _references(rows: Sequence[Row]) -> str:
    """What the references are, each kind once, with the number of its problems unless all have the same."""
    kinds = Counter((r.cells, r.discretisation, r.tolerance) for r in rows if r.reference)
    missing = len({r.problem for r in rows}) - kinds.total()
    several = len(kinds) + (missing > 0) > 1
    parts = [
        f"{_whole_words(cells)}, `{discretisation}`, {tolerance}" + (f" for {count} of them" if several else "")
        for (cells, discretisation, tolerance), count in kinds.items()
    ]
    return "; ".join([*parts, f"none for {missing} of them"] if missing else parts)


def _whole_words(cells: Cells) -> str:
    """`32 cells along a side`, or `32 x 16 cells`."""
    return f"{cells.short} cells" + " along a side" * (cells.x == cells.y)


def _paragraph(text: str) -> list[str]:
    """`text` in lines; words that contain spaces or hyphens in Markdown stay whole."""
    return textwrap.wrap(text, 118, break_long_words=False, break_on_hyphens=False)


def _side_by_side(rows: Sequence[Row]) -> list[str]:
    """Ratios of worst errors, `kalker` to `aligned` on the same mesh, and of costs; empty unless there are both."""
    lines: list[str] = []
    newton = [r for r in rows if r.method == "newton" and r.counts]
    for coupling in sorted({r.coupling for r in newton}, reverse=True):
        coupled = [r for r in newton if r.coupling == coupling]
        own = [r for r in coupled if r.tolerance == shown_tolerance(coupled)]
        both = [pair for n in _meshes(own) if all(pair := of_both(r for r in own if r.cells == n))]
        if not both:
            continue
        parts = []
        for quantity, words in QUANTITIES.items():
            worst = [[worst_of(r.error(quantity) for r in group) for group in pair] for pair in both]
            ratios = [pair[0] / pair[1] for pair in worst if min(pair) >= LEAST]
            if ratios and not np.allclose(ratios, 1.0, atol=0.05):
                parts.append(f"{words} {_range_of(ratios, '.1f')}")
        costs = costs_of_aligned(coupled)
        text = (
            f"With {coupling} coupling, worst errors of `kalker` over those of `aligned` on the same mesh: "
            f"{'; '.join(parts) or 'about the same'}."
        )
        if costs:
            text += " In the median over the problems and tolerances of a mesh "
            text += f"`aligned` costs {_range_of(costs, '.2g')} times the time."
        lines += _paragraph(text)
        lines.append("")
    return lines


def _meshes(rows: Iterable[Row]) -> list[Cells]:
    return sorted({r.cells for r in rows})


def _recommended(chosen: Sequence[Setting]) -> list[str]:
    """A list item for each coupling and target, with one below it for each discretisation; or why there is none."""
    if not chosen:
        return _paragraph(f"{_NO_ERRORS} All cases: [errors.md](errors.md).")
    lines = []
    for coupling, target in dict.fromkeys((s.coupling, s.target) for s in chosen):
        lines.append(f"- **{_per_cent(target)}, {coupling} coupling**")
        own = [s for s in chosen if (s.coupling, s.target) == (coupling, target)]
        for name in dict.fromkeys(s.discretisation for s in own):
            lines.append(f"  - `{name}`: {_sentence([s for s in own if s.discretisation == name])}")
    words = ["Errors in this choice include the estimated error of the reference (below)."]
    if any(s.cells is None and np.isfinite(s.needed) for s in chosen):
        words.append("Cells for targets that are not reached are extrapolated by a power law and rounded up.")
    words.append("All settings: [settings.md](settings.md); all cases: [errors.md](errors.md).")
    return [*lines, "", *_paragraph(" ".join(words))]


def _sentence(chosen: Sequence[Setting]) -> str:
    """Quantities grouped by the setting that reaches the target, cheapest first, then those that none reaches."""
    reached: dict[tuple[Cells, BothTolerances], list[Setting]] = {}
    missed: dict[str, list[Setting]] = {}
    for s in sorted(chosen, key=lambda s: (np.isnan(s.needed), s.needed)):
        if s.cells is not None and s.tolerance is not None:
            reached.setdefault((s.cells, s.tolerance), []).append(s)
        else:
            missed.setdefault(_needed(s), []).append(s)
    parts = []
    for (cells, tolerance), group in _coarsest_then_loosest(reached):
        s = group[0]
        where = f"{_range_of(s.radius, '.0f')} per contact radius"
        cost = f"{s.products:.0f} products, {1e3 * s.seconds:.3g} ms"
        parts.append(f"**{_names(group)}**: {cells} cells ({where}), tolerance {tolerance}, {cost}")
    if missed:
        parts.append("not reached: " + "; ".join(f"{_names(group)}: {needed}" for needed, group in missed.items()))
    return "; ".join(parts) + "."


def _coarsest_then_loosest(
    groups: dict[tuple[Cells, BothTolerances], list[Setting]],
) -> list[tuple[tuple[Cells, BothTolerances], list[Setting]]]:
    """The groups by cells and tolerances: of those on one mesh the loosest tolerances come first."""
    loosest = sorted(groups.items(), key=lambda item: item[0][1], reverse=True)
    return sorted(loosest, key=lambda item: item[0][0])


def _names(chosen: Iterable[Setting]) -> str:
    return ", ".join(QUANTITIES[s.quantity] for s in chosen)


def _per_cent(value: float) -> str:
    return f"{100 * value:g} %"


def _by_mesh(rows: Sequence[Row]) -> list[str]:
    """Worst errors of each mesh, both discretisations side by side, a table for each coupling."""
    newton = [r for r in rows if r.method == "newton" and r.counts]
    lines = []
    for coupling in sorted({r.coupling for r in newton}, reverse=True):
        lines += ["", f"## Errors by mesh, {coupling} coupling", "", *mesh_table(newton, coupling)]
    return lines


def mesh_table(rows: Sequence[Row], coupling: str) -> list[str]:
    """Worst errors of the Newton method's problems with this coupling, by mesh and discretisation, in Markdown."""
    own = [r for r in rows if r.method == "newton" and r.counts and r.coupling == coupling]
    tolerance = shown_tolerance(own)
    own = [r for r in own if r.tolerance == tolerance]
    columns = [[r for r in own if r.cells == n] for n in _meshes(own)]
    names = schemes(own)
    heads = [
        f"{n.short} ({_range_of((r.radius for r in c), '.0f')})" for n, c in zip(_meshes(own), columns, strict=True)
    ]
    table = []
    for quantity, words in QUANTITIES.items():
        if not any(np.isfinite(r.error(quantity)) for r in own):
            continue  # zero by symmetry
        cells = [[worst_of(r.error(quantity) for r in c if r.scheme == n) for n in names] for c in columns]
        table.append([f"{words}, %", *_cells([[100.0 * e for e in c] for c in cells])])
    times = [[1e3 * median(r.seconds for r in c if r.scheme == n) for n in names] for c in columns]
    table.append(["processor time, ms", *_cells(times)])
    return [
        f"Worst of {_problems(own)}{OF_FEWER * some_lack(own)} at tolerance {tolerance}, {' / '.join(names)}:",
        "",
        *markdown_lines(["cells along a side (per contact radius)", *heads], table),
    ]


def _cells(numbers: Sequence[Sequence[float]]) -> list[str]:
    """Cells of a row, the numbers in each side by side with two figures; a dash where there is none."""
    return [" / ".join("-" if np.isnan(n) else f"{float(f'{n:.2g}'):g}" for n in cell) for cell in numbers]


def _reference(rows: Sequence[Row]) -> list[str]:
    """Section on the references' own errors."""
    doubts = {name: [r.error(REFERENCE + name) for r in rows if r.method == "newton"] for name in QUANTITIES}
    known = {name: found for name, found in doubts.items() if np.isfinite(found).any()}
    if not known:
        return []
    return [
        "",
        "## How good the references are",
        "",
        *_paragraph(
            "Largest differences of the references from the same discretisation on the next coarser mesh: "
            + "; ".join(f"{QUANTITIES[name]} {100 * worst_of(found):.2g} %" for name, found in known.items())
            + ". Errors of first order halve with the size of cells, so that against half as many along a side this is "
            "the estimated error of the reference, and errors much below it are not known. That of the two fields is "
            "given on the finest mesh; averaged over larger cells it is less."
        ),
    ]


def _tolerances(rows: Sequence[Row]) -> list[str]:
    newton = [r for r in rows if r.method == "newton"]
    titles = ["Tolerance", "Discretisation", "Solved", "Pressure, worst", "Tractions, worst", "Tractions, median"]
    cells: list[list[str]] = []
    found: dict[BothTolerances, float] = {}
    for tolerance in sorted({r.tolerance for r in newton}, reverse=True):
        for name in schemes(newton):
            own = [r for r in newton if (r.tolerance, r.scheme) == (tolerance, name) and _several(r, newton)]
            if not own:
                continue
            known = [r for r in own if r.solved]
            numbers = (
                worst_of(r.error(SOLVER + "pressure") for r in known),
                worst_of(r.error(SOLVER + "traction") for r in known),
                median(r.error(SOLVER + "traction") for r in known),
            )
            texts = [f"{n:.1e}" if np.isfinite(n) else "-" for n in numbers]
            products = f"{median(r.products for r in known):.0f}" if known else "-"
            cells.append([str(tolerance), name, f"{len(known)} of {len(own)}", *texts, products])
            of_fields = numbers[:2] if len(known) == len(own) else (np.inf,)  # NaN: nothing to compare with
            if not np.isnan(of_fields).any():
                found[tolerance] = max(found.get(tolerance, 0.0), *of_fields)
    if not cells:
        return []
    reach = [
        f"{_per_cent(target)}: {max(t for t, e in found.items() if e <= target)}"
        for target in TARGETS
        if any(e <= target for e in found.values())
    ]
    return [
        "",
        "## Tolerance",
        "",
        "Difference from the tightest solution of the same discretisation on the same mesh, over meshes and problems:",
        "",
        *markdown_lines([*titles, "Products, median"], cells),
        "",
        f"Tolerance that keeps both fields of every case within it: {'; '.join(reach) or 'none'}.",
    ]


def _several(row: Row, rows: Sequence[Row]) -> bool:
    """Whether `row` is on a mesh that has several tolerances."""
    return len({r.tolerance for r in rows if r.problem == row.problem and r.cells == row.cells}) > 1


def _methods(rows: Sequence[Row]) -> list[str]:
    other = [r for r in rows if r.method != "newton" and np.isfinite(r.error(SOLVER + "traction"))]
    lines = []
    for method in sorted({r.method for r in other}):
        own = [r for r in other if r.method == method]
        tight = min(r.tolerance for r in own)
        products = median(r.products for r in own if r.tolerance == tight)
        lines += [
            "",
            f"## Method {method}",
            "",
            *_paragraph(
                f"Its tractions differ by {_range(r.error(SOLVER + 'traction') for r in own)} (L2) from the discrete "
                "Coulomb solution on the same mesh, whatever the tolerance; its forces, at "
                f"{tight}, by {_range(r.error(SOLVER + 'force') for r in own if r.tolerance == tight)}, after "
                f"{products:.0f} products (median). {sum(r.solved for r in own)} of {len(own)} cases pass their proof."
            ),
        ]
    return lines


def _range(errors: Iterable[float]) -> str:
    return f"{_range_of((100 * e for e in errors), '.2g')} %"


def _couplings(couplings: Sequence[tuple[str, dict[str, float]]]) -> list[str]:
    if not couplings:
        return []
    cells = [
        [name, *(f"{100 * errors[q]:.2g} %" if np.isfinite(errors[q]) else "-" for q in QUANTITIES)]
        for name, errors in couplings
    ]
    return [
        "",
        "## What one-way coupling leaves out",
        "",
        "References with `coupling: one-way` against those with `full`:",
        "",
        *markdown_lines(["Problem", *QUANTITIES.values()], cells),
    ]


def _unsolved(rows: Sequence[Row]) -> list[str]:
    failed = [r for r in rows if not r.solved and r.method == "newton"]
    if not failed:
        return []
    lines = [
        "",
        "## Not solved",
        "",
        "Cases of the Newton method that are not solved; no errors above are theirs, and none is recommended:",
        "",
    ]
    for status in sorted({r.status for r in failed}):
        own = [r for r in failed if r.status == status]
        tolerances = ", ".join(map(str, sorted({r.tolerance for r in own}, reverse=True)))
        example = f"{own[0].grid}, {markdown_text(own[0].label)}"
        lines.append(f"- {status}: {len(own)} (tolerance {tolerances}): {example} and the like")
    return lines
