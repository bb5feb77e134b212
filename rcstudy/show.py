"""Summary of a cube: what was studied, when and where, what each grid holds, what went wrong."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Collection, Iterator

import numpy as np
import pandas as pd
import xarray as xr

from rcstudy.cube import case_dims, case_table, grids, unit_text, value_text
from rcstudy.progress import duration, not_solved
from rcstudy.result import VARIABLES, Status
from rcstudy.storage.layout import LABEL, REFERENCES
from rcstudy.studyfile.spec import SceneSpec
from rcstudy.studyfile.written import starting_scene

_WIDTH = 110  # of a line of words
_SHOWN_FAILURES = 10
_SHOWN_MESHES = 4
_NIL = 1e-9  # of a number's scale: less is shown as 0
_RANGES = ("pressure_max", "contact_radius", "force_x", "force_y", "moment_z", "traction_max")
_RELATIVE = re.compile(r"\b(a|Es)\b")
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


def summary(tree: xr.DataTree, *, checked: bool = False) -> str:
    """Summary of an opened cube, several lines; reads scalars only. `checked`: its fields are known to be readable."""
    return "\n".join(_lines(tree, checked))


def _lines(tree: xr.DataTree, checked: bool) -> Iterator[str]:
    attrs = tree.attrs
    table = case_table(tree)
    yield f"study       {attrs.get('study', '')}"
    yield from _indented(str(attrs.get("description", "")), 12)
    for word, name in _PROVENANCE.items():
        if attrs.get(name) not in (None, ""):
            yield f"{word:<11} {attrs[name]}"
    solved = int((table["status"] == Status.SOLVED).sum())
    yield f"cases       {len(table)}: {solved} solved, {len(table) - solved} not"
    if any("pressure" in grid for grid in grids(tree).values()):
        yield f"fields      {'read, none is damaged' if checked else 'not read: show --check reads them all'}"
    yield f"time        {_times(table, float(attrs.get('wall_seconds', np.nan)))}"
    if sources := [line.partition(":")[0] for line in str(attrs.get(REFERENCES, "")).splitlines()]:
        words = f"{'; '.join(sources)} (in full: attribute {REFERENCES})"
        yield textwrap.fill(words, _WIDTH, initial_indent="based on    ", subsequent_indent=12 * " ")
    for name, grid in grids(tree).items():
        yield ""
        yield from _grid_lines(name, grid, table[table["grid"] == name], str(attrs.get("study_text", "")))
    yield from _proof_lines(table)
    yield from _failure_lines(table)


def _times(table: pd.DataFrame, wall: float) -> str:
    seconds = table["solve_seconds"].dropna()
    words = [] if np.isnan(wall) else [f"{duration(wall)} in the last run"]
    if len(seconds):
        words.append(f"{duration(float(seconds.median()))} a case (median), {duration(float(seconds.max()))} at most")
    return ", ".join(words) or "unknown"


def _grid_lines(name: str, grid: xr.Dataset, table: pd.DataFrame, text: str) -> Iterator[str]:
    dims = case_dims(grid)
    sizes = " x ".join(f"{dim} {grid.sizes[dim]}" for dim in dims) or "one case"
    cells = _cells(grid, starting_scene(text, name)) if "x" in grid.sizes else "scalars only"
    yield f"{name}: {sizes}; {cells}"
    yield from _indented(str(grid.attrs.get("grid_description", "")), 2)
    for dim in dims:
        labels = [value_text(value) for value in grid[dim].values[:12]]
        apart = "; " if any("," in label for label in labels) else ", "
        shown, more = apart.join(labels), f"{apart}..." if grid.sizes[dim] > 12 else ""
        yield f"  {dim:<16} {shown}{more} {_unit(grid, dim)}".rstrip()
    solved = table[table["status"] == Status.SOLVED]
    for variable in _RANGES:
        if variable in grid and len(known := solved.dropna(subset=[variable])):
            values = known[variable].mask(known[variable].abs() <= _NIL * _scale(variable, known), 0.0)
            low, high = float(values.min()), float(values.max())
            found = " to ".join(dict.fromkeys(f"{end:.5g}" for end in (low, high)))  # one number if as written
            yield f"  {variable:<16} {found} {VARIABLES[variable].units}{_error(solved, variable)}"


def _indented(text: str, width: int) -> list[str]:
    """The lines of a text, moved to the right, without what is empty at its end."""
    return textwrap.indent(text.rstrip(), " " * width).splitlines()


def _unit(grid: xr.Dataset, dim: str) -> str:
    """Unit of the values of an axis; of pairs, which are stored as text, that of their numbers unless relative."""
    pairs = f"{dim}_x"
    if pairs not in grid.coords or any(_RELATIVE.search(str(value)) for value in grid[dim].values):
        return unit_text(grid[dim])
    return unit_text(grid[pairs])


def _error(solved: pd.DataFrame, variable: str) -> str:
    """The largest estimated error among the solved cases, as an addition to a variable's line."""
    name = f"{variable}_error"
    most = float(solved[name].max()) if name in solved else np.nan
    return f", ± {most:.2g} at most" if np.isfinite(most) else ""


def _cells(grid: xr.Dataset, start: tuple[SceneSpec | None, Collection[str]]) -> str:
    """How many cells the cases have, and how many of them are stored if that differs; `start`: `starting_scene`."""
    stored, meshes = _listed(_stored(grid)), _listed(_meshes(grid, *start))
    return f"{meshes} cells, {stored} of them stored" if meshes not in ("", stored) else f"{stored} cells"


def _stored(grid: xr.Dataset) -> set[tuple[int, int]]:
    """Numbers of cells that are stored; where the mesh varies, fields are padded, and the centres there are NaN."""
    if "x_centre" not in grid:
        return {(grid.sizes["x"], grid.sizes["y"])}
    along = [np.isfinite(grid[f"{dim}_centre"].values).sum(axis=-1).reshape(-1).tolist() for dim in ("x", "y")]
    return set(zip(*along, strict=True))


def _meshes(grid: xr.Dataset, scene: SceneSpec | None, varied: Collection[str]) -> set[tuple[int, int]]:
    """Numbers of cells of the meshes, of which stored fields may be a part; empty if the cube does not say."""
    for name in ("cells", "mesh_cells"):
        if f"{name}_x" in grid and f"{name}_y" in grid:
            along = [grid[f"{name}_{way}"].values.astype(int).tolist() for way in "xy"]
            return set(zip(*along, strict=True))
    # only listed cases that all give the same cells are left: those of axes and of other lists have coordinates
    return {scene.mesh.cells} if scene is not None and "mesh.cells" not in varied else set()


def _listed(meshes: Collection[tuple[int, int]]) -> str:
    if len(meshes) <= _SHOWN_MESHES:
        return " and ".join(f"{nx} x {ny}" for nx, ny in sorted(meshes))
    along = list(zip(*meshes, strict=True))
    return " to ".join(f"{end(along[0])} x {end(along[1])}" for end in (min, max))


def _scale(variable: str, solved: pd.DataFrame) -> pd.Series:
    """Natural size of a variable in each case, as loads may differ by powers of ten: friction times load for forces.

    A variable without a natural size has that of its own number.
    """
    if variable not in ("force_x", "force_y", "moment_z"):
        return solved[variable].abs()
    return solved["friction"] * solved["load"] * (solved["hertz_radius"] if variable == "moment_z" else 1.0)


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
    yield f"{not_solved(len(failed))}:"
    for _, row in failed.head(_SHOWN_FAILURES).iterrows():
        word = Status(int(row["status"])).words
        yield f"  {row['grid']}: {row[LABEL]}: {word}: {row['status_reason']}"
    if len(failed) > _SHOWN_FAILURES:
        yield f"  {len(failed) - _SHOWN_FAILURES} more"
