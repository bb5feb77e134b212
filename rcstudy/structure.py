"""Compares the structure of two grids before their numbers are compared: dimensions, coordinates, variables."""

from __future__ import annotations

import numpy as np
import xarray as xr

from rcstudy.storage.layout import LAYER

COORDINATE_RTOL = 1e-9
"""Relative difference allowed to coordinates and settings, which both cubes take from a study."""

MEANINGS = ("units", "flag_meanings", "flag_values")
"""Attributes that say what the numbers of a variable mean."""

_SHOWN = 5


def align(
    ours: xr.Dataset, theirs: xr.Dataset, our_dims: tuple[str, ...], their_dims: tuple[str, ...]
) -> tuple[tuple[xr.Dataset, xr.Dataset] | None, list[str]]:
    """Both grids reduced to the cases in both, in the reference's order, and the differences in their structure.

    `our_dims`, `their_dims`: the case dimensions. If the dimensions differ so much that no case can be matched, None is
    returned in place of the grids.
    """
    if our_dims != their_dims:
        order = ": the same in another order" if sorted(our_dims) == sorted(their_dims) else ""
        return None, [f"dimensions are {_words(our_dims)}, in the reference {_words(their_dims)}{order}"]
    problems = []
    for dim in their_dims:
        here, there = _matches(ours, theirs, dim)
        for grid, kept, where in ((theirs, there, "missing in the cube"), (ours, here, "not in the reference")):
            lost = sorted(set(range(grid.sizes[dim])) - set(kept))
            if lost:
                problems.append(f"{dim} {_values(grid, dim, lost)}: {where}")
        if list(here) != sorted(here):
            problems.append(f"{dim}: in another order than in the reference")
        ours, theirs = _take(ours, dim, here), _take(theirs, dim, there)
    if ours.sizes.get(LAYER) != theirs.sizes.get(LAYER):  # cases left out may have been the only ones with so many
        ours, theirs = _with_layers(ours), _with_layers(theirs)
    cropped, ours, theirs = _on_common_cells(ours, theirs)
    problems += cropped
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


def _on_common_cells(ours: xr.Dataset, theirs: xr.Dataset) -> tuple[list[str], xr.Dataset, xr.Dataset]:
    """Both grids on the cells that both have where one's are a part of the other's, and that they are, in words.

    Where that part is not the same for all cases, as in grids of several meshes, both grids are without fields.
    """
    cells = [tuple(grid.sizes.get(dim, 0) for dim in "xy") for grid in (ours, theirs)]
    if cells[0] == cells[1]:
        return [], ours, theirs
    small, large = (ours, theirs) if cells[0] <= cells[1] else (theirs, ours)
    places = [_places(_centres(large, dim), _centres(small, dim)) for dim in "xy"]
    if not all(places):
        return [], ours, theirs
    here, there = (" x ".join(map(str, counts)) for counts in cells)
    part = "a part of the reference's" if small is ours else "of which the reference's are a part"
    words = (
        f"x, y: fields on {here} cells, {part}, {there}: cropped in another way (outputs: crop), or to other contacts"
    )
    if any(len(of_cases) > 1 or surplus for of_cases in places for _, surplus in of_cases):
        words += ", not alike in all cases: fields are not compared"
        return [words], ours.drop_dims(["x", "y"]), theirs.drop_dims(["x", "y"])
    (i, _), (j, _) = (next(iter(of_cases)) for of_cases in places)
    large = large.isel(x=slice(i, i + small.sizes["x"]), y=slice(j, j + small.sizes["y"]))
    return [words], *((small, large) if small is ours else (large, small))


def _centres(grid: xr.Dataset, dim: str) -> np.ndarray:
    """Centres of the cells along `dim`, of each case where windows fit the contacts: [cases or 1, n]; n = 0 if none."""
    name = dim if dim in grid.coords else f"{dim}_centre"
    if name not in grid or dim not in grid[name].dims:
        return np.empty((1, 0))
    centres: np.ndarray = grid[name].transpose(..., dim).values
    return centres.reshape(-1, grid.sizes[dim])


def _places(large: np.ndarray, small: np.ndarray) -> set[tuple[int, int]]:
    """At which of the centres `large` [cases, n] the consecutive ones `small` [cases, m] of them begin, in any case.

    With how many of the m centres from there are in `large` alone. Empty if in any case they are no part of these.
    Where meshes differ from case to case the last centres of some are NaN; all are where the window is not known.
    """
    found: set[tuple[int, int]] = set()
    if large.shape[0] != small.shape[0] or not 0 < small.shape[1] <= large.shape[1]:
        return found
    for row, padded in zip(large, small, strict=True):
        known = padded[np.isfinite(padded)]
        if not known.size or not np.isfinite(row).any():
            continue
        first = int(np.nanargmin(np.abs(row - known[0])))
        part, rounding = row[first : first + known.size], COORDINATE_RTOL * np.nanmax(np.abs(row))
        if part.shape != known.shape or not np.allclose(part, known, rtol=0.0, atol=rounding):
            return set()
        found.add((first, int(np.isfinite(row[first : first + padded.size]).sum()) - known.size))
    return found


def _kind(variable: xr.DataArray) -> str:
    return {"f": "numbers", "i": "whole numbers", "u": "whole numbers"}.get(variable.dtype.kind, "text")


def _words(dims: tuple[object, ...]) -> str:
    return f"({', '.join(map(str, dims))})"


def _take(grid: xr.Dataset, dim: str, kept: list[int]) -> xr.Dataset:
    return grid if kept == list(range(grid.sizes[dim])) else grid.isel({dim: kept})


def _values(grid: xr.Dataset, dim: str, positions: list[int]) -> str:
    values = grid[dim].values if dim in grid.coords else np.arange(grid.sizes[dim])
    shown = ", ".join(str(values[i]) for i in positions[:_SHOWN])
    return f"{shown}, ..." if len(positions) > _SHOWN else shown


def _matches(ours: xr.Dataset, theirs: xr.Dataset, dim: str) -> tuple[list[int], list[int]]:
    """Positions in both grids of the values of `dim` that are in both, in the reference's order."""
    if dim not in ours.coords or dim not in theirs.coords:
        count = min(ours.sizes[dim], theirs.sizes[dim])
        return list(range(count)), list(range(count))
    a, b = ours[dim].values, theirs[dim].values
    here, there = [], []
    if a.dtype.kind in "fiu" and b.dtype.kind in "fiu":
        rounding = np.finfo(float).eps * np.abs(b).max(initial=0.0)
        for j, value in enumerate(b):
            i = int(np.argmin(np.abs(a - value))) if a.size else -1
            if i >= 0 and abs(a[i] - value) <= COORDINATE_RTOL * abs(value) + rounding:
                here.append(i)
                there.append(j)
        return here, there
    position = {str(value): i for i, value in enumerate(a)}
    for j, value in enumerate(b):
        if str(value) in position:
            here.append(position[str(value)])
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
