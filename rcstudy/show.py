"""A cube in words: what was studied, when and where, what each grid holds, what went wrong."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr

from rcstudy.cube import case_dims, case_table, grids
from rcstudy.layout import LABEL
from rcstudy.progress import duration
from rcstudy.result import VARIABLES, Status

_SHOWN_FAILURES = 10
_RANGES = ("pressure_max", "contact_radius", "force_x", "force_y", "moment_z", "traction_max")
_PROVENANCE = {
    "created": "created",
    "command": "command",
    "rcstudy": "rcstudy_version",
    "solver": "solver_version",
    "revision": "git_revision",
    "python": "python_version",
    "machine": "machine_cpu",
    "system": "machine_os",
}


def summary(tree: xr.DataTree) -> str:
    """Summary of an opened cube, several lines; reads scalars only."""
    return "\n".join(_lines(tree))


def _lines(tree: xr.DataTree) -> Iterator[str]:
    attrs = tree.attrs
    table = case_table(tree)
    yield f"study       {attrs.get('study', '')}"
    if attrs.get("description"):
        yield f"            {attrs['description']}"
    for word, name in _PROVENANCE.items():
        if attrs.get(name) not in (None, ""):
            yield f"{word:<11} {attrs[name]}"
    solved = int((table["status"] == Status.SOLVED).sum())
    yield f"cases       {len(table)}: {solved} solved, {len(table) - solved} not"
    yield f"time        {_times(table, float(attrs.get('wall_seconds', np.nan)))}"
    for name, grid in grids(tree).items():
        yield ""
        yield from _grid_lines(name, grid, table[table["grid"] == name])
    yield from _proof_lines(table)
    yield from _failure_lines(table)


def _times(table: pd.DataFrame, wall: float) -> str:
    seconds = table["solve_seconds"].dropna()
    words = [] if np.isnan(wall) else [f"{duration(wall)} in all"]
    if len(seconds):
        words.append(f"{duration(float(seconds.median()))} a case (median), {duration(float(seconds.max()))} at most")
    return ", ".join(words) or "unknown"


def _grid_lines(name: str, grid: xr.Dataset, table: pd.DataFrame) -> Iterator[str]:
    dims = case_dims(grid)
    sizes = " x ".join(f"{dim} {grid.sizes[dim]}" for dim in dims) or "one case"
    cells = f"; {grid.sizes['x']} x {grid.sizes['y']} cells" if "x" in grid.sizes else "; scalars only"
    yield f"{name}: {sizes}{cells}"
    if grid.attrs.get("grid_description"):
        yield f"  {grid.attrs['grid_description']}"
    for dim in dims:
        shown = ", ".join(_text(value) for value in grid[dim].values[:12])
        units = grid[dim].attrs.get("units", "1")
        more = ", ..." if grid.sizes[dim] > 12 else ""
        yield f"  {dim:<16} {shown}{more}{'' if units == '1' else ' ' + units}"
    solved = table[table["status"] == Status.SOLVED]
    for variable in _RANGES:
        if variable in grid and len(values := solved[variable].dropna()):
            low, high = float(values.min()), float(values.max())
            units = VARIABLES[variable].units
            yield (
                f"  {variable:<16} {low:.5g} to {high:.5g} {units}"
                if low != high
                else (f"  {variable:<16} {low:.5g} {units}")
            )


def _text(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float | np.floating) else str(value)


def _proof_lines(table: pd.DataFrame) -> Iterator[str]:
    solved = table[table["status"] == Status.SOLVED]
    names = [name for name in table.columns if str(name).startswith("proof_") and solved[name].notna().any()]
    if not names:
        return
    yield ""
    yield "proof of the solved cases, worst of each:"
    for name in names:
        row = solved.iloc[int(np.nanargmax(solved[name].to_numpy(dtype=float)))]
        yield f"  {name:<18} {float(row[name]):.1e}  {row['grid']}: {row[LABEL]}"


def _failure_lines(table: pd.DataFrame) -> Iterator[str]:
    failed = table[table["status"] != Status.SOLVED]
    if not len(failed):
        return
    yield ""
    yield f"{len(failed)} cases are not solved:"
    for _, row in failed.head(_SHOWN_FAILURES).iterrows():
        word = Status(int(row["status"])).name.lower().replace("_", " ")
        yield f"  {row['grid']}: {row[LABEL]}: {word}: {row['status_reason']}"
    if len(failed) > _SHOWN_FAILURES:
        yield f"  {len(failed) - _SHOWN_FAILURES} more"
