"""Compares the structure of two grids before their numbers are compared: dimensions, coordinates, variables."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
import xarray as xr

from rcstudy.cube import unit_text
from rcstudy.errors import UserError
from rcstudy.settings import unit_as_written
from rcstudy.storage.layout import LAYER
from rcstudy.studyfile.written import starting_scene
from rcstudy.studyfile.yamlfile import parse
from rcstudy.studyfile.yamltree import Problems, find

COORDINATE_RTOL = 1e-9
"""Relative difference allowed to coordinates and settings, which both cubes take from a study."""

MEANINGS = ("units", "flag_meanings", "flag_values")
"""Attributes that say what the numbers of a variable mean."""

_SHOWN = 5
_FIELDS = ("x", "y")  # dimensions of cells


def holds_windows(tree: xr.DataTree) -> bool:
    """Whether the study file in a cube says that fields are not cropped; False where it cannot be read."""
    try:
        root = parse(str(tree.attrs.get("study_text", "")), Problems())
    except UserError:
        return False
    return root.is_mapping and find(root, ("outputs", "crop")).value != "contact"


def settings_that_differ(ours: xr.DataTree, theirs: xr.DataTree, names: Iterable[str]) -> list[str]:
    """In which settings of the scenes that grids `names` start from the study files in two cubes differ, in words.

    For instance a counterbody, of which cubes hold no number. Not those that cases set themselves, nor where a study
    file cannot be read. Grids that differ in the same are in one line.
    """
    found: dict[str, list[str]] = {}
    for name in names:
        (one, here), (other, there) = (starting_scene(str(t.attrs.get("study_text", "")), name) for t in (ours, theirs))
        if one is None or other is None:
            continue
        keys = type(one).model_fields.keys() - here - there
        if differ := sorted(key for key in keys if getattr(one, key) != getattr(other, key)):
            found.setdefault(", ".join(differ), []).append(name)
    lines = []
    for settings, grids in found.items():
        more = f" and {len(grids) - _SHOWN} more" if len(grids) > _SHOWN else ""
        lines.append(f"{', '.join(grids[:_SHOWN])}{more}: the studies differ in {settings}")
    return lines


def align(
    ours: xr.Dataset,
    theirs: xr.Dataset,
    our_dims: tuple[str, ...],
    their_dims: tuple[str, ...],
    whole: Callable[[], bool],
) -> tuple[tuple[xr.Dataset, xr.Dataset] | None, list[str]]:
    """Both grids reduced to the cases in both, in the reference's order, and the differences in their structure.

    `our_dims`, `their_dims`: the case dimensions. `whole`: whether neither's fields are cropped, asked only where they
    are on other cells, as a long study file takes long to read. If the dimensions differ so much that no case can be
    matched, None is returned in place of the grids.
    """
    if our_dims != their_dims:
        order = ": the same in another order" if sorted(our_dims) == sorted(their_dims) else ""
        return None, [f"dimensions are {_words(our_dims)}, in the reference {_words(their_dims)}{order}"]
    problems = []
    for dim in their_dims:
        here, there = _matches(ours, theirs, dim)
        units = not _alike(ours, theirs, dim)
        for grid, kept, where in ((theirs, there, "missing in the cube"), (ours, here, "not in the reference")):
            lost = sorted(set(range(grid.sizes[dim])) - set(kept))
            if lost:
                problems.append(f"{dim} {_values(grid, dim, lost, units=units)}: {where}")
        if list(here) != sorted(here):
            problems.append(f"{dim}: in another order than in the reference")
        ours, theirs = _take(ours, dim, here), _take(theirs, dim, there)
    if ours.sizes.get(LAYER) != theirs.sizes.get(LAYER):  # cases left out may have been the only ones with so many
        ours, theirs = _with_layers(ours), _with_layers(theirs)
    told, ours, theirs = _with_fields_of_both(ours, theirs)
    problems += told
    told, ours, theirs = _on_common_cells(ours, theirs, whole)
    problems += told
    others = _other_dims(ours, theirs, their_dims)
    if others:
        return None, problems + others
    problems += _coordinates(ours, theirs, their_dims)
    return (ours, theirs), problems


def _with_layers(grid: xr.Dataset) -> xr.Dataset:
    """The grid without those layers that none of its cases has (NaN)."""
    numbers = [v for v in grid.data_vars.values() if LAYER in v.dims and v.dtype.kind == "f"]
    if not numbers:
        return grid
    has = [np.isfinite(v.transpose(LAYER, ...).values).reshape(grid.sizes[LAYER], -1).any(axis=1) for v in numbers]
    most = int(np.any(has, axis=0).sum())
    return grid.isel({LAYER: slice(most)}) if most else grid.drop_dims(LAYER)


def _other_dims(ours: xr.Dataset, theirs: xr.Dataset, case_dims: tuple[str, ...]) -> list[str]:
    """Differences of the dimensions that are no axis, in words."""
    problems = []
    for dim in theirs.dims:
        if dim not in case_dims and ours.sizes.get(dim) != theirs.sizes[dim]:
            found = ours.sizes.get(dim, "missing")
            problems.append(f"dimension {dim}: {found}, in the reference {theirs.sizes[dim]}")
    return problems + [f"dimension {dim}: not in the reference" for dim in ours.dims if dim not in theirs.dims]


def variables_in_both(ours: xr.Dataset, theirs: xr.Dataset, case_dims: tuple[str, ...]) -> tuple[list[str], list[str]]:
    """Differences in the data variables' names, dimensions, kinds and units; names that can be compared."""
    problems, names = [], []
    for name in map(str, theirs.data_vars):
        if name not in ours.data_vars:
            problems.append(f"variable {name}: missing in the cube")
            continue
        a, b = ours[name], theirs[name]
        if a.dims != b.dims:
            problems.append(f"variable {name}: dimensions are {_words(a.dims)}, in the reference {_words(b.dims)}")
        elif not set(case_dims) <= set(b.dims):
            problems.append(f"variable {name}: dimensions are {_words(b.dims)}, not one value per case")
        elif _kind(a) != _kind(b):
            problems.append(f"variable {name}: holds {_kind(a)}, in the reference {_kind(b)}")
        else:
            names.append(name)
        for attribute in MEANINGS:
            here, there = (np.asarray(v.attrs.get(attribute)).tolist() for v in (a, b))
            if here != there:
                problems.append(f"variable {name}: {attribute} {here!r}, in the reference {there!r}")
    problems += [f"variable {name}: not in the reference" for name in ours.data_vars if name not in theirs.data_vars]
    return problems, names


def in_order(grid: xr.Dataset, case_dims: tuple[str, ...]) -> xr.Dataset:
    """The grid with the dimensions of all variables in the order of cubes: those of cases first, x and y last."""
    last = [dim for dim in _FIELDS if dim in grid.dims]
    others = [dim for dim in grid.dims if dim not in (*case_dims, *last)]
    order = [*case_dims, *others, *last]
    mixed = [name for name, v in grid.variables.items() if list(v.dims) != [dim for dim in order if dim in v.dims]]
    return grid.assign({name: grid[name].transpose(*order, missing_dims="ignore") for name in mixed}) if mixed else grid


def _with_fields_of_both(ours: xr.Dataset, theirs: xr.Dataset) -> tuple[list[str], xr.Dataset, xr.Dataset]:
    """Both grids without fields if one has none, and that it has none, in words."""
    lost = [dim for dim in _FIELDS if dim in theirs.dims and dim not in ours.dims]
    more = [dim for dim in _FIELDS if dim in ours.dims and dim not in theirs.dims]
    words = [f"dimension {dim}: missing, in the reference {theirs.sizes[dim]}: fields are not compared" for dim in lost]
    words += [f"dimension {dim}: not in the reference: fields are not compared" for dim in more]
    return words, ours.drop_dims(more), theirs.drop_dims(lost)


class _Common(NamedTuple):
    """The cells that both grids have along one dimension: which of either's they are, in all cases."""

    ours: slice
    theirs: slice
    alike: bool  # whether they are the same in all cases, and there are any


def _on_common_cells(
    ours: xr.Dataset, theirs: xr.Dataset, whole: Callable[[], bool]
) -> tuple[list[str], xr.Dataset, xr.Dataset]:
    """Both grids on the cells that both have, if these are not all cells of either, and that they are, in words.

    Where those are not the same for all cases, as in grids of several meshes, or none, both grids are without fields.
    Grids on cells of other meshes are left as they are.
    """
    cells = [tuple(grid.sizes.get(dim, 0) for dim in _FIELDS) for grid in (ours, theirs)]
    along, across = (_common(_centres(ours, dim), _centres(theirs, dim)) for dim in _FIELDS)
    if along is None or across is None:
        return [], ours, theirs
    both = along, across
    alike = along.alike and across.alike
    if alike and all(
        (common.ours, common.theirs) == (slice(0, n), slice(0, m)) for common, n, m in zip(both, *cells, strict=True)
    ):
        return [], ours, theirs
    here, there = (" x ".join(map(str, counts)) for counts in cells)
    reason = "cropped in another way (outputs: crop), or to other contacts"
    if whole():
        reason = "the windows differ (mesh: size, margin), neither is cropped"
    words = f"x, y: fields on {here} cells, {_part(both, cells, there)}: {reason}"
    if not alike:
        words += ", not alike in all cases: fields are not compared"
        return [words], ours.drop_dims(_FIELDS), theirs.drop_dims(_FIELDS)
    ours = ours.isel({dim: common.ours for dim, common in zip(_FIELDS, both, strict=True)})
    theirs = theirs.isel({dim: common.theirs for dim, common in zip(_FIELDS, both, strict=True)})
    return [words], ours, theirs


def _part(both: tuple[_Common, _Common], cells: list[tuple[int, ...]], there: str) -> str:
    """How the `cells` of the cube go together with those of the reference, of which it has `there`, in words."""
    ours, theirs = cells
    if all(common.ours == slice(0, n) for common, n in zip(both, ours, strict=True)):
        return f"a part of the reference's, {there}"
    if all(common.theirs == slice(0, n) for common, n in zip(both, theirs, strict=True)):
        return f"of which the reference's are a part, {there}"
    if not all(common.alike for common in both):
        return f"in the reference on others, {there}"
    same = " x ".join(str(common.ours.stop - common.ours.start) for common in both)
    return f"{same} of them among the reference's, {there}"


def _centres(grid: xr.Dataset, dim: str) -> np.ndarray:
    """Centres of the cells along `dim`, of each case where windows fit the contacts: [cases or 1, n]; n = 0 if none."""
    name = dim if dim in grid.coords else f"{dim}_centre"
    if name not in grid or dim not in grid[name].dims:
        return np.empty((1, 0))
    centres: np.ndarray = grid[name].transpose(..., dim).values
    return centres.reshape(-1, grid.sizes[dim])


def _common(ours: np.ndarray, theirs: np.ndarray) -> _Common | None:
    """Which of the centres of cells [cases, n] of either grid are in both; None if they are those of other meshes.

    Where meshes differ from case to case the last centres of some are NaN; all are where the window is not known.
    """
    n, m = ours.shape[1], theirs.shape[1]
    if ours.shape[0] != theirs.shape[0]:
        return None
    found: set[tuple[int, int]] = set()
    alike = True
    for ours_padded, theirs_padded in zip(ours, theirs, strict=True):
        a, b = (row[np.isfinite(row)] for row in (ours_padded, theirs_padded))
        if not a.size or not b.size:
            continue
        off = _offset(a, b)
        if off is None:
            return None
        first, other = max(off, 0), max(-off, 0)
        count = min(a.size - first, b.size - other)
        size = min(n - first, m - other)
        # the rest of the arrays has to be padding in both
        alike &= count > 0 and all(min(row.size - at, size) == count for row, at in ((a, first), (b, other)))
        found.add((first, other))
    if not found:
        return None
    first, other = min(found)
    size = min(n - first, m - other)
    return _Common(slice(first, first + size), slice(other, other + size), alike and len(found) == 1)


def _offset(ours: np.ndarray, theirs: np.ndarray) -> int | None:
    """At which of the equidistant centres `ours` [n] those of `theirs` [m] begin, maybe beyond; None if at none."""
    steps = [row[1] - row[0] for row in (ours, theirs) if row.size > 1]
    rounding = COORDINATE_RTOL * max(np.abs(ours).max(), np.abs(theirs).max())
    off = (theirs[0] - ours[0]) / steps[0] if steps else 0.0
    whole = round(off)
    start = ours[0] + whole * (steps[0] if steps else 0.0)
    if abs(theirs[0] - start) > rounding:
        return None
    if len(steps) == 2 and abs(steps[1] - steps[0]) * max(ours.size, theirs.size) > 2.0 * rounding:
        return None
    return whole


def _kind(variable: xr.DataArray) -> str:
    return {"f": "numbers", "i": "whole numbers", "u": "whole numbers"}.get(variable.dtype.kind, "text")


def _words(dims: tuple[object, ...]) -> str:
    return f"({', '.join(map(str, dims))})"


def _take(grid: xr.Dataset, dim: str, kept: list[int]) -> xr.Dataset:
    return grid if kept == list(range(grid.sizes[dim])) else grid.isel({dim: kept})


def _values(grid: xr.Dataset, dim: str, positions: list[int], *, units: bool) -> str:
    values = _written(grid, dim) if units else grid[dim].values if dim in grid.coords else np.arange(grid.sizes[dim])
    shown = ", ".join(str(values[i]) for i in positions[:_SHOWN])
    return f"{shown}, ..." if len(positions) > _SHOWN else shown


def _written(grid: xr.Dataset, dim: str) -> list[str]:
    """The values of `dim` as a study writes them, numbers with their unit or what they are over."""
    unit = unit_text(grid[dim])
    words = grid[dim].values.tolist()
    return [word if isinstance(word, str) else f"{word:.12g} {unit}".rstrip() for word in words]


def _alike(ours: xr.Dataset, theirs: xr.Dataset, dim: str) -> bool:
    """Whether the values of `dim` are numbers in one unit, or words, in both grids."""
    if dim not in ours.coords or dim not in theirs.coords:
        return True
    a, b = ours[dim], theirs[dim]
    numbers = [coordinate.dtype.kind in "fiu" for coordinate in (a, b)]
    over = [unit_as_written("1", str(coordinate.attrs.get("long_name", ""))) for coordinate in (a, b)]
    return numbers[0] == numbers[1] and (not numbers[0] or over[0] == over[1])


def _matches(ours: xr.Dataset, theirs: xr.Dataset, dim: str) -> tuple[list[int], list[int]]:
    """Positions in both grids of the values of `dim` that are in both, in the reference's order."""
    if dim not in ours.coords or dim not in theirs.coords:
        count = min(ours.sizes[dim], theirs.sizes[dim])
        return list(range(count)), list(range(count))
    a, b = ours[dim].values, theirs[dim].values
    here, there = [], []
    alike = _alike(ours, theirs, dim)
    if a.dtype.kind in "fiu" and alike:
        rounding = np.finfo(float).eps * np.abs(b).max(initial=0.0)
        for j, value in enumerate(b):
            i = int(np.argmin(np.abs(a - value))) if a.size else -1
            if i >= 0 and abs(a[i] - value) <= COORDINATE_RTOL * abs(value) + rounding:
                here.append(i)
                there.append(j)
        return here, there
    words, model = (_written(grid, dim) for grid in (ours, theirs))
    position = {word: i for i, word in enumerate(words)}
    for j, word in enumerate(model):
        if word in position:
            here.append(position[word])
            there.append(j)
    return here, there


def _coordinates(ours: xr.Dataset, theirs: xr.Dataset, case_dims: tuple[str, ...]) -> list[str]:
    """Differences of all coordinates, but for the values of case dimensions, which have been matched."""
    problems = []
    for name in map(str, theirs.coords):
        if name not in ours.coords:
            problems.append(f"coordinate {name}: missing in the cube")
            continue
        a, b = ours[name], theirs[name]
        if a.attrs.get("units") != b.attrs.get("units"):
            here, there = a.attrs.get("units"), b.attrs.get("units")
            problems.append(f"coordinate {name}: units {here!r}, in the reference {there!r}")
        if a.dims != b.dims:
            problems.append(f"coordinate {name}: dimensions are {_words(a.dims)}, in the reference {_words(b.dims)}")
        elif name not in case_dims and not _equal(a.values, b.values, centres=bool({"x", "y"} & set(b.dims))):
            problems.append(f"coordinate {name}: its values differ")
    problems += [f"coordinate {name}: not in the reference" for name in ours.coords if name not in theirs.coords]
    return problems


def _equal(a: np.ndarray, b: np.ndarray, *, centres: bool) -> bool:
    """Whether two coordinates are the same: each value over itself, `centres` of cells over the largest of them."""
    if a.dtype.kind not in "fiu" or b.dtype.kind not in "fiu":
        return bool(np.array_equal(a.astype(str), b.astype(str)))
    scale = np.abs(b[np.isfinite(b)]).max(initial=0.0)
    rtol, rounding = (0.0, COORDINATE_RTOL) if centres else (COORDINATE_RTOL, np.finfo(float).eps)
    return bool(np.allclose(a, b, rtol=rtol, atol=rounding * scale, equal_nan=True))
