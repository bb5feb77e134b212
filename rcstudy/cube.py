"""Reads cubes: opening and checking one, its grids, its table of cases; one solved scene as a Dataset."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Hashable, Iterable, Iterator
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import h5py
import numpy as np
import pandas as pd
import xarray as xr

from rcstudy.errors import UserError, first_line, place_of
from rcstudy.mechanics.literature import behind, listed
from rcstudy.result import VARIABLES, Result, Status
from rcstudy.settings import unit_as_written
from rcstudy.storage.cube_writer import checksum
from rcstudy.storage.layout import (
    CASE_KEY,
    CENTRE_ATTRS,
    CHECKSUM,
    GRID,
    LABEL,
    REFERENCES,
    SCHEMA,
    SCHEMA_ATTRIBUTE,
    SETTINGS,
    missing_values,
    result_items,
)
from rcstudy.storage.record import FIELDS, SCALARS
from rcstudy.storage.screen import reason_of, unsafe_content
from rcstudy.studyfile.build import scene_hertz
from rcstudy.studyfile.spec import MAX_CELLS, grid_name_problem
from rcstudy.studyfile.yamltree import shorten

if TYPE_CHECKING:
    from rcstudy.mechanics.scene import Mesh, Scene

_HERTZ = "hertz_radius", "hertz_pressure"
_BLANKS = 16  # meshes whose empty Datasets are kept


def open_cube(path: Path | str, *, chunked: bool = False, any_order: bool = False) -> xr.DataTree:
    """Open a cube lazily: values are read when they are used; close it, or use it in a ``with`` block.

    `chunked`: fields as dask arrays, one chunk for each field of each case, for work on more than the memory holds.
    `any_order`: also one whose variables have their dimensions in another order than those of cubes.

    The root holds the provenance as attributes and, in a study of several grids, a table of all cases; the grids
    are its children (:func:`grids` gives them in either layout).

    Raises UserError when the file is missing, unreadable, not an rcstudy cube, of another layout, or holds what no
    cube holds (:mod:`rcstudy.storage.screen`), and when there is no dask for chunks.
    """
    if str(path) == "":  # as a path it would be the current folder
        raise UserError("the name of a cube must not be empty")
    path = Path(path)
    if chunked and find_spec("dask") is None:
        raise UserError(f"{path}: to open it in chunks install dask: pip install dask")
    if not path.exists():
        raise UserError(f"{path}: no such file")
    if not path.is_file():
        raise UserError(f"{path}: not a file")
    try:
        unsafe, copied = unsafe_content(path)
        if unsafe:
            raise UserError(f"{path}: not an rcstudy cube: {unsafe}")
        # the netCDF library crashes on some of the attributes that it signs with, if they are made up
        tree = xr.open_datatree(path, engine="h5netcdf" if copied else engine(path))
    except UserError:
        raise
    except Exception as error:  # HDF5, h5netcdf and xarray raise errors of any type on foreign files
        reason = reason_of(error) if isinstance(error, OSError) else "damaged: a dimension of it may be missing"
        raise UserError(f"{path}: not a readable rcstudy cube: {reason}") from error
    try:
        schema = tree.attrs.get(SCHEMA_ATTRIBUTE)
        if schema != SCHEMA:
            raise UserError(f"{path}: layout {schema} of the cube is not known here: layout {SCHEMA} is")
        if "axes" in tree.attrs and GRID not in tree.attrs:
            raise UserError(f"{path}: not a whole rcstudy cube: it has no attribute {GRID}")
        found = grids(tree)
        if not found or any(LABEL not in grid for grid in found.values()):
            raise UserError(f"{path}: not a whole rcstudy cube: it has no grids, or grids without labels of cases")
        for name, grid in found.items():
            if problem := _problem_of_grid(name, grid, any_order):
                raise UserError(f"{path}: not an rcstudy cube: grid {shorten(name)}: {problem}")
        if chunked:
            _chunk_fields(tree)
    except BaseException:
        tree.close()
        raise
    return tree


def _chunk_fields(tree: xr.DataTree) -> None:
    """Make dask arrays of the fields of all grids, as they are stored: a chunk for each case.

    Numbers of cases are left as they are: chunks of these, as they are stored, would not agree with those of fields.
    """
    for node in tree.subtree:
        fields = node.to_dataset()[[name for name in FIELDS if name in node.data_vars]].reset_coords(drop=True)
        node.update(fields.chunk({dim: -1 if dim in ("x", "y") else 1 for dim in fields.dims}))


def changed_grids(tree: xr.DataTree) -> list[str]:
    """The grids of an opened cube whose keys, statuses or numbers are not those written, by their checksum."""
    changed = []
    for name, grid in grids(tree).items():
        stored = {n: grid[n].values for n in (CASE_KEY, "status", "status_reason", *SCALARS) if n in grid}
        for text in {CASE_KEY, "status_reason"} & set(stored):
            stored[text] = stored[text].astype(str).astype(object)
        if checksum(stored) != grid.attrs.get(CHECKSUM):
            changed.append(name)
    return changed


@contextlib.contextmanager
def reading(*paths: Path | str) -> Iterator[None]:
    """Turn any error that damaged or hostile content of the cubes `paths` causes in the block into a UserError.

    Where the cubes are found to be as they were written, this says where in rcstudy the error comes from.
    """
    try:
        yield
    except OSError as error:
        if error.filename is not None and str(error.filename) not in map(str, paths):  # an output file
            raise UserError(f"{error.filename}: {error.strerror or error}") from error
        raise UserError(f"{_at_fault(paths)[0]}: cannot be read, or damaged: {first_line(error)}") from error
    except (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError, ValueError) as error:
        what = shorten(first_line(error), 200)
        if not isinstance(error, ValueError):  # whose messages are sentences
            what = f"{type(error).__name__}: {what}"
        # what damaged or hostile content leads to, and a mistake of ours, are errors of the same types
        which, found = _at_fault(paths)
        theirs = found or any(map(_is_changed, paths))
        ours = "" if theirs else f", or a mistake in rcstudy itself ({place_of(error)})"
        raise UserError(f"{which}: damaged, or not as rcstudy writes cubes{ours}: {what}") from error


def _is_changed(path: Path | str) -> bool:
    """Whether a grid of a cube has not its checksum, or this cannot be found out."""
    try:
        with open_cube(path, any_order=True) as tree:
            return bool(changed_grids(tree))
    except Exception:  # h5py and xarray raise errors of any type on damaged files
        return True


def _at_fault(paths: Iterable[Path | str]) -> tuple[str, bool]:
    """Those of the cubes `paths` that cannot be read completely, with the first fault of each; all if none is found.

    And whether one is.
    """
    given = list(dict.fromkeys(map(str, paths)))
    found = {path: next(illegible(path), None) for path in given}
    at_fault = [f"{path}: {fault}" if fault else path for path, fault in found.items() if fault is not None]
    return " or ".join(at_fault or given), bool(at_fault)


def illegible(path: Path | str) -> Iterator[str]:
    """Names of what HDF5 cannot read in a file: variables, for fields with the case; "" for the file itself.

    Nothing if all can be read; whether values are missing or wrong is not examined.
    """
    nodes: list[h5py.Dataset] = []
    try:
        with h5py.File(path, "r") as file:
            file.visititems(lambda _, node: nodes.append(node) if isinstance(node, h5py.Dataset) else None)
            for node in nodes:
                yield from _illegible_chunks(node)
    except Exception:  # h5py raises errors of any type on damaged files
        yield ""


def _illegible_chunks(variable: h5py.Dataset) -> Iterator[str]:
    name = str(variable.name).rpartition("/")[2]
    starts: list[tuple[int, ...]] = []
    try:
        if variable.chunks is None:
            variable[...]
        else:
            variable.id.chunk_iter(lambda stored: starts.append(stored.chunk_offset))
    except Exception:  # as above
        yield name
    for start in starts:
        try:
            variable[tuple(slice(i, i + n) for i, n in zip(start, variable.chunks, strict=True))]
        except Exception:  # as above
            yield f"{name} [{_case_at(variable.parent, start[:-2])}]"


def _case_at(group: h5py.Group, index: tuple[int, ...]) -> str:
    """The grid and the label of a case, as far as they can be read."""
    try:
        return shorten(f"{group.attrs[GRID]}: {group[LABEL].asstr()[index]}", 200)
    except Exception:  # as above
        return f"{shorten(str(group.name))}: case {index}"


def engine(path: Path) -> Literal["netcdf4", "h5netcdf"]:
    """The engine for the file `path`: netCDF4 where it is installed and can open the file, else h5netcdf.

    netCDF4 opens a cube of ten grids ten times as fast (0.3 s, 4 s). It crashes where two threads open files, so that
    only the main one does so with it, and it does not know paths that are not valid in the file system's encoding.
    """
    if find_spec("netCDF4") is None or threading.current_thread() is not threading.main_thread():
        return "h5netcdf"
    try:
        str(path.absolute()).encode()
    except UnicodeEncodeError:
        return "h5netcdf"
    return "netcdf4"


def _problem_of_grid(name: str, grid: xr.Dataset, any_order: bool = False) -> str:
    """What is wrong with a grid's name, or with its variables' dimensions and types; "" if nothing."""
    if reason := grid_name_problem(name):
        return reason  # checked because the name becomes part of file names
    dims = case_dims(grid)
    if gone := [dim for dim in dims if dim not in grid.dims and dim in grid.coords]:
        return f"{gone[0]} is no dimension any more; a list of one value keeps it: ds.sel({gone[0]}=[...])"
    if not _along(grid[LABEL], dims, any_order):
        return "its cases have no labels"
    for key, variable in VARIABLES.items():
        if key not in grid.variables:
            continue
        expected = (*dims, "x", "y") if variable.kind == "field" else dims
        if not _along(grid[key], expected, any_order):
            return f"{key} has other dimensions than {', '.join(expected)}"
        if grid[key].dtype.kind not in {"f": "f", "i": "i", "s": "OTU"}[variable.dtype[0]]:
            return f"{key} is of type {grid[key].dtype}"
    if any(grid.sizes.get(dim, 0) > MAX_CELLS for dim in "xy"):
        return f"more than {MAX_CELLS} cells"
    return ""


def _along(variable: xr.DataArray, dims: tuple[str, ...], any_order: bool) -> bool:
    return variable.dims == dims or (any_order and sorted(map(str, variable.dims)) == sorted(dims))


def grids(tree: xr.DataTree) -> dict[str, xr.Dataset]:
    """The grids of a cube by name, in the study's order, whether the study had one grid or several."""
    if "axes" in tree.attrs:
        return {str(tree.attrs[GRID]): tree.to_dataset()}
    found = {name: node.to_dataset(inherit=False) for name, node in tree.children.items() if "axes" in node.attrs}
    if GRID not in tree.dataset:
        return found
    order = list(dict.fromkeys(str(name) for name in tree.dataset[GRID].values))
    return {name: found[name] for name in sorted(found, key=lambda n: order.index(n) if n in order else len(order))}


def case_dims(grid: xr.Dataset) -> tuple[str, ...]:
    """Names of the case dimensions of a grid, in the study's order; x, y and layer are not among them."""
    return tuple(str(grid.attrs["axes"]).split())


def case_table(tree: xr.DataTree) -> pd.DataFrame:
    """One row per case: grid, label, index within the grid, coordinates of its axes, settings and all scalars.

    Columns that a grid does not have are missing (NaN, None) in its rows; fields are not read.
    """
    return pd.concat([_grid_table(name, grid) for name, grid in grids(tree).items()], ignore_index=True)


def _grid_table(name: str, grid: xr.Dataset) -> pd.DataFrame:
    dims = case_dims(grid)
    shape = tuple(grid.sizes[d] for d in dims)
    count = int(np.prod(shape))
    columns: dict[Hashable, Any] = {
        "grid": [name] * count,
        "label": grid[LABEL].values.reshape(-1),
        "index": list(np.ndindex(*shape)),
    }
    for key, variable in grid.variables.items():
        if key == LABEL or not set(variable.dims) <= set(dims):
            continue
        along = [grid.sizes[d] if d in variable.dims else 1 for d in dims]
        columns[key] = np.broadcast_to(variable.values.reshape(along), shape).reshape(-1)
    return pd.DataFrame(columns)


def value_text(value: object) -> str:
    """A coordinate's value as people read it: a number with six digits, a word as it is."""
    return f"{value:.6g}" if isinstance(value, float | np.floating) else str(value)


def unit_text(coordinate: xr.DataArray) -> str:
    """A coordinate's unit as people write it, or what its ratios are over ("a", "Es"); "" if neither."""
    attrs = coordinate.attrs
    return unit_as_written(str(attrs.get("units", "1")), str(attrs.get("long_name", "")))


def to_dataset(scene: Scene, result: Result) -> xr.Dataset:
    """One result as a Dataset with the names, units and dimensions (x, y) of a cube.

    It has the scene's `hertz_radius` and `hertz_pressure`, too; floats are NaN where there is no value.
    """
    hertz = scene_hertz(scene)
    values: dict[str, Any] = {name: SETTINGS[name].value(scene, hertz) for name in _HERTZ}
    values |= result.scalars | result.fields
    values |= {"status": Status(result.status).value, "status_reason": result.reason}
    blank = _blank(scene.mesh, tangential=scene.creepage is not None)
    data: dict[Hashable, np.ndarray] = {}
    for name, variable in blank.variables.items():  # not those of data_vars, which are wrapped one by one
        if name not in CENTRE_ATTRS:
            value = values.get(str(name))
            data[name] = variable.values.copy() if value is None else np.asarray(value, dtype=variable.dtype)
    filled = blank.copy(deep=True, data=data)  # else all results of a mesh share indexes, and their names
    filled.attrs[REFERENCES] = listed(behind([scene]))
    return filled


@lru_cache(maxsize=_BLANKS)
def _blank(mesh: Mesh, *, tangential: bool) -> xr.Dataset:
    """The Dataset of a result without any values, not to be changed: filling a copy takes half the time of making one.

    Its fields hold one number each, however many cells there are.
    """
    variables: dict[str, Any] = {}
    for item in result_items((), tangential=tangential, fields=True):
        value = np.broadcast_to(missing_values(item.dtype, ()), mesh.cells if item.field else ())
        variables[item.name] = (item.dims, value, item.attrs)
    for name in _HERTZ:
        variables[name] = ((), np.nan, SETTINGS[name].attrs)
    coords = {dim: ((dim,), mesh.centres[k], CENTRE_ATTRS[dim]) for k, dim in enumerate("xy")}
    return xr.Dataset(variables, coords, {SCHEMA_ATTRIBUTE: SCHEMA, REFERENCES: ""})
