"""Tables of the solver's work, residuals and proofs: for each case, and summed up by grid."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from rcstudy.report.cells import Column, Table, Value
from rcstudy.report.views import GridView
from rcstudy.result import VARIABLES, Status

PROOFS = tuple(name for name in VARIABLES if name.startswith("proof_"))

CASES = (
    Column("grid", "Grid", names=True),
    Column("case", "Case", names=True),
    Column("status", "Status"),
    Column("reason", "Reason"),
    Column("iterations_normal", "Iterations, pressure", form=".0f"),
    Column("iterations_tangential", "Iterations, tractions", form=".0f"),
    Column("products_normal", "Products, pressure", form=".0f"),
    Column("operator_products", "Products, tractions", form=".0f"),
    Column("coarse_products", "Products, coarser meshes", form=".0f"),
    Column("solve_seconds", "Seconds", form=".2g"),
    Column("residual_normal", "Residual, pressure", form=".0e"),
    Column("residual_tangential", "Residual, tractions", form=".0e"),
    *(Column(name, name.removeprefix("proof_").capitalize(), form=".0e") for name in PROOFS),
)

SUMMARY = (
    Column("grid", "Grid", names=True),
    Column("cases", "Cases"),
    *(Column(s.name.lower(), s.name.capitalize().replace("_", " ")) for s in Status),
    Column("normal_median", "Products, pressure: median", form=".4g"),
    Column("normal_most", "most", form=".0f"),
    Column("tangential_median", "Products, tractions: median", form=".4g"),
    Column("tangential_most", "most", form=".0f"),
    Column("most_case", "in case"),
    Column("seconds", "Seconds", form=".2g"),
)


def cases_table(found: Iterable[GridView]) -> Table:
    """Status, reason, iterations, products, seconds, residuals and every proof: one row a case, solved or not."""
    caption = (
        "Solver statistics per case. Products: with the operator or the preconditioner; those of the tractions "
        "on coarser meshes, where the solution starts from, apart. Proofs, from Tension on, are relative and computed "
        "apart from the solver. Seconds are those of the run that solved the case; a pressure that cases share is "
        "charged to one of them."
    )
    names = [c.key for c in CASES if c.key in VARIABLES and c.key != "status"]
    rows: list[dict[str, Value]] = []
    for grid in found:
        for case in grid.cases():
            row: dict[str, Value] = {"grid": grid.name, "case": case.label, "status": case.status.words}
            row["reason"] = case.failure.removeprefix(case.status.words).removeprefix(": ")
            rows.append(row | {name: case.recorded(name) for name in names})
    return caption, CASES, rows


def summary_table(found: Sequence[GridView]) -> Table:
    """Cases by status, products in the median and at most, and seconds: a row a grid, and one for all of several."""
    caption = (
        "Solver statistics per grid. Products: with the operator or the preconditioner, on the scene's own "
        "mesh, of solved cases; most: of the case with the most."
    )
    rows = [_summary([grid]) for grid in found]
    if len(rows) > 1:
        name = "all" if all(grid.name != "all" for grid in found) else "all grids"
        rows.append(_summary(found) | {"grid": name})
    return caption, SUMMARY, rows


def _summary(found: Sequence[GridView]) -> dict[str, Value]:
    """The row of one grid, or of several together, which the case with the most products is then named with."""
    cases = [case for grid in found for case in grid.cases()]
    normal = np.array([case.number("products_normal") for case in cases])
    tangential = np.array([case.recorded("operator_products") if case.solved else np.nan for case in cases])
    row: dict[str, Value] = {"grid": found[0].name, "cases": len(cases)}
    row |= {s.name.lower(): sum(case.status is s for case in cases) for s in Status}
    for kind, counts in (("normal", normal), ("tangential", tangential)):
        if np.isfinite(counts).any():
            row |= {f"{kind}_median": float(np.nanmedian(counts)), f"{kind}_most": float(np.nanmax(counts))}
    if np.isfinite(tangential).any():
        most = cases[int(np.nanargmax(tangential))]
        row["most_case"] = most.label if len(found) == 1 else f"{most.grid.name}: {most.label}"
    return row | {"seconds": float(np.nansum([case.recorded("solve_seconds") for case in cases]))}
