"""Tables of a cube: results and the solver's work per case; for the paper's study its own tables and statements too.

Entry: :func:`make_tables`. Every table is written as CSV, Markdown and LaTeX.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from rcstudy.report import measures
from rcstudy.report.cells import Column, Table, Value, without_empty
from rcstudy.report.layers import coating_text, layers_text, thickness_text
from rcstudy.report.listed import CREEPAGES, listed_numbers, listed_pairs, listed_settings, shared_settings
from rcstudy.report.paper import MAPS, PaperCase, paper_cases, paper_grids, select
from rcstudy.report.paper_statements import STATEMENTS
from rcstudy.report.solver import cases_table, summary_table
from rcstudy.report.statements import comparisons_table, judged, statements_table
from rcstudy.report.views import CaseView, GridView, creepage_text, grids
from rcstudy.report.writers import write_table
from rcstudy.result import VARIABLES
from rcstudy.storage.publish import make_folder

if TYPE_CHECKING:
    import xarray as xr


def _measured(key: str, title: str, latex: str = "", *, form: str) -> Column:
    """A column of numbers with their estimated errors."""
    return Column(key, title, latex, form, error=f"{key}_error")


def _stored(variable: str, title: str, latex: str = "", *, form: str) -> Column:
    """A column of a scalar of the cube, by its name and unit (`moment_z_N_mm`), with its estimated error."""
    units = VARIABLES[variable].units
    key = variable if units == "1" else f"{variable}_{units.replace(' ', '_')}"
    return replace(_measured(key, title, latex, form=form), variable=variable)


_WORDS = (Column("layers", "Layers", math="layers_math"), Column("creepage", "Creepage", math="creepage_math"))

RESULTS = (
    Column("status", "Status"),
    _stored("contact_radius", "Contact radius (mm)", form=".4f"),
    _stored("approach", "Approach (mm)", form=".6f"),
    _stored("pressure_max", "Peak pressure (MPa)", form=".1f"),
    _measured("pressure_ratio", "Peak pressure / p0", "$p_{\\max}/p_0$", form=".4f"),
    _measured("slip_ratio", "Slip area / contact area", form=".4f"),
    _stored("force_x", "Fx (N)", "$F_x$ (N)", form=".3f"),
    _stored("force_y", "Fy (N)", "$F_y$ (N)", form=".3f"),
    _stored("moment_z", "Mz (N mm)", "$M_z$ (N\\,mm)", form=".4f"),
    _stored("traction_max", "Largest traction (MPa)", form=".1f"),
    _stored("friction_power", "Friction power per unit speed (N)", form=".4f"),
    Column("proof_worst", "Worst proof", form=".1e", digits=2),  # more differ between processors
    Column("proof_name", "Which proof"),
)
"""Columns of results after those that describe the case; lengths in mm, stresses in MPa, forces in N."""


def make_tables(tree: xr.DataTree, out: Path) -> list[Path]:
    """Write the tables of an opened cube into the folder `out` (made if need be); returns the files written.

    Any cube: `results` (one row per case, with the settings in which cases differ), `solver` (its work and proofs, one
    row per case) and `solver_summary` (one row per grid). With grids of the paper also `table_1`, `table_2`
    (from the cube's coordinates), `statements` (what the paper says of its results, judged by the cube's) and
    `statements_comparisons` (every comparison behind them). UserError if the cube has no grid.
    """
    found = grids(tree)
    make_folder(out)
    cases = paper_cases(found)
    papers = paper_grids(found)
    others = [grid for name, grid in found.items() if name not in papers]
    paths: list[Path] = []
    if cases:
        maps = select(cases, MAPS)
        if maps:
            paths += write_table(out, "table_1", *layer_table(maps))
            paths += write_table(out, "table_2", *creepage_table(maps))
        paths += write_table(out, "results", *panel_table(cases))
        statements = judged(STATEMENTS, cases)
        paths += write_table(out, "statements", *statements_table(statements, cases))
        paths += write_table(out, "statements_comparisons", *comparisons_table(statements))
    if others:
        paths += write_table(out, "results_of_other_grids" if cases else "results", *without_empty(case_table(others)))
    paths += write_table(out, "solver", *without_empty(cases_table(found.values())))
    paths += write_table(out, "solver_summary", *without_empty(summary_table(list(found.values()))))
    return paths


def layer_table(cases: Sequence[PaperCase]) -> Table:
    """The paper's Table 1: moduli and thickness of each layer, a row per run of panels with the same layers."""
    columns = (
        Column("figure", "Figure"),
        Column("modulus", "Elastic modulus", math="modulus_math"),
        Column("thickness", "Thickness for each layer", math="thickness_math"),
    )
    rows: list[dict[str, Value]] = []
    for (modulus, thickness, _), group in groupby(
        cases, key=lambda c: (layers_text(c.view), thickness_text(c.view), c.figure)
    ):
        panels = list(group)
        first, last = panels[0], panels[-1]
        span = first.name if len(panels) == 1 else f"{first.name}-{last.name}"
        math = {
            "modulus_math": layers_text(first.view, math=True),
            "thickness_math": thickness_text(first.view, math=True),
        }
        rows.append({"figure": span, "modulus": modulus, "thickness": thickness, **math})
    caption = (
        "Layer parameters (the paper's Table 1, rebuilt from the cube's coordinates). Es: modulus of the substrate; "
        "a: Hertz's radius of the uncoated pair; layer 1 is at the surface."
    )
    return caption, columns, rows


def creepage_table(cases: Sequence[PaperCase]) -> Table:
    """The paper's Table 2: the creepages of each letter; letters share a row where their creepages are the same.

    A letter that has different creepages in different figures gets a row for each, with the figures named.
    """
    columns = (Column("panels", "Figure"), *CREEPAGES)
    panels: dict[tuple[float, float, float], dict[str, set[int]]] = {}
    for c in cases:
        panels.setdefault(c.creepage, {}).setdefault(c.panel, set()).add(c.figure)
    everywhere = {c.figure for c in cases}
    rows: list[dict[str, Value]] = []
    for (longitudinal, lateral, spin), letters in panels.items():
        names = [
            letter if figures == everywhere else f"{letter} of {', '.join(map(str, sorted(figures)))}"
            for letter, figures in letters.items()
        ]
        rows.append(
            {
                "panels": f"({'/'.join(names)})",
                "longitudinal": longitudinal,
                "lateral": lateral,
                "spin_rad_per_mm": spin,
            }
        )
    return "Creepage parameters (the paper's Table 2, rebuilt from the cube's coordinates).", columns, rows


def panel_table(cases: Sequence[PaperCase]) -> Table:
    """Results per case of the paper, named by figure and panel; the other columns are those of `case_table`."""
    names = (Column("figure", "Figure", names=True), Column("panel", "Panel", names=True))
    columns, rows, shared = _described([c.view for c in cases])
    rows = [{"figure": c.figure, "panel": c.panel, **row} for c, row in zip(cases, rows, strict=True)]
    return f"Results per panel of the paper's figures. {shared}{RESULTS_NOTE}", (*names, *columns), rows


def case_table(found: Sequence[GridView]) -> Table:
    """Results per case of any grid, named by the grid's axes, with the settings in which the cases differ.

    Creepages and axes are in the CSV as numbers, too.
    """
    names = (Column("grid", "Grid", names=True), Column("case", "Case", names=True))
    cases = [case for grid in found for case in grid.cases()]
    columns, rows, shared = _described(cases)
    rows = [{"grid": case.grid.name, "case": case.label, **row} for case, row in zip(cases, rows, strict=True)]
    # what the note says of a coated body, and of several layers, is only true of studies that have them
    most = max((len(case.layers) for case in cases), default=0)
    note = RESULTS_NOTE if any(case.rolling for case in cases) else RESULTS_NOTE.replace(_FORCES, "")
    note = note if most else note.replace("the coated body", "the substrate")
    order = "layer 1 is at the surface; " if most > 1 else ""
    return f"Results per case. {shared}{order}{note}", (*names, *columns), rows


def _described(cases: Sequence[CaseView]) -> tuple[Sequence[Column], list[dict[str, Value]], str]:
    """Columns and rows of what each case is, in which settings it differs from others, and of its results.

    And a sentence on the settings in which none differs, which another one follows.
    """
    settings, differing = listed_settings(cases)
    numbers, given = listed_numbers(cases)
    pairs, split = listed_pairs(settings, differing)
    parts = zip(cases, differing, given, split, strict=True)
    rows = [{**own, **along, **sides, **results_row(case)} for case, own, along, sides in parts]
    shared = f"{shared_settings(differing)} ".lstrip()
    return (*settings, *_WORDS, *numbers, *pairs, *RESULTS), rows, shared


_FORCES = "forces and moment act on the coated body, which rolls towards +x; "
RESULTS_NOTE = (
    f"p0: Hertz's peak pressure of the uncoated pair; contact radius: of a circle of its area; {_FORCES}±: the "
    "estimated discretisation error, meant to hold in nineteen of twenty cases; worst proof: the largest of the case's "
    "own checks (relative). Cases that were not solved have no numbers."
)


def results_row(case: CaseView) -> Mapping[str, Value]:
    """What a case is in words, and the columns RESULTS of it; NaN (written empty) where it was not solved."""
    proof, proof_name = measures.worst_proof(case)
    return {
        "layers": coating_text(case),
        "layers_math": coating_text(case, math=True),
        "creepage": creepage_text(case),
        "creepage_math": creepage_text(case, math=True, units=True),
        "status": case.failure or "solved",
        **_with_errors(case),
        "pressure_ratio": measures.pressure_ratio(case),
        "pressure_ratio_error": case.number("pressure_max_error") / case.stored("hertz_pressure"),
        "slip_ratio": measures.slip_ratio(case),
        "slip_ratio_error": measures.slip_ratio_error(case),
        "proof_worst": proof,
        "proof_name": proof_name,
    }


def _with_errors(case: CaseView) -> dict[str, Value]:
    """The numbers of RESULTS that the cube stores directly, by their columns, and their estimated errors."""
    row: dict[str, Value] = {}
    for column in RESULTS:
        if name := column.variable:
            row |= {column.key: case.number(name), column.error: case.number(f"{name}_error")}
    return row
