"""Writes a cube: created up front, filled case by case in bounded memory, published whole or not at all."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5netcdf
import h5py
import numpy as np

from rcstudy.layout import MISSING, SCHEMA, SCHEMA_ATTRIBUTE, Item, Layout, lay_out
from rcstudy.publish import replacing
from rcstudy.result import VARIABLES, Result, Status
from rcstudy.steady import SteadyFile, interrupts_held

if TYPE_CHECKING:
    from rcstudy.cases import Case, Expansion
    from rcstudy.study import Study


def write_cube(
    path: Path | str,
    study: Study,
    expansion: Expansion,
    results: Iterable[tuple[Case, Result]],
    provenance: Mapping[str, str | int | float],
) -> None:
    """Write all results of a study to a netCDF-4 file at `path`, replacing what is there only when all is written.

    `results` may be lazy and come in any order; each case of `expansion` exactly once. The file is created before
    the first result is asked for, so an unwritable place is found out early. Fields go to the disk as they come;
    scalars (some hundred bytes a case) are kept until the end. `provenance` becomes root attributes, together
    with the study's text and hash and the wall time from here to the end.

    Raises UserError when the file cannot be written, ValueError when a case has no result, two, or one whose
    names or shapes are not those of its grid.
    """
    started = time.monotonic()
    layouts, root = lay_out(expansion, fields=study.outputs.fields, precision=study.outputs.precision)
    attrs: dict[str, Any] = {
        "title": study.name,
        "study": study.name,
        "description": study.description or "",
        "study_text": study.text,
        "study_sha256": study.sha256,
        SCHEMA_ATTRIBUTE: SCHEMA,
        **provenance,
    }
    with replacing(path) as temporary, SteadyFile(temporary) as storage:
        with interrupts_held(), h5netcdf.File(storage, "w") as file:
            for layout in layouts:
                _create(file.create_group(layout.name) if root is not None else file, layout)
            if root is not None:
                _create(file, root)
        storage.check()
        # h5py from here on: through h5netcdf each write of a field costs several times the writing itself
        with _opened(storage) as file:
            with interrupts_held():
                grids = {
                    layout.name: _Group(file[layout.name] if root is not None else file, layout) for layout in layouts
                }
            for case, result in results:
                with interrupts_held():
                    grids[case.grid].add(case, result)
                storage.check()
            with interrupts_held():
                for group in grids.values():
                    group.finish()
                if root is not None:
                    _Group(file, root).fill_from(list(grids.values()))
                attrs["wall_seconds"] = round(time.monotonic() - started, 3)
                for name, value in attrs.items():
                    file.attrs[name] = value
        storage.check()


@contextlib.contextmanager
def _opened(storage: SteadyFile) -> Iterator[h5py.File]:
    with interrupts_held():
        file = h5py.File(storage, "r+")
    try:
        yield file
    finally:
        with interrupts_held():
            file.close()


def _create(group: Any, layout: Layout) -> None:
    """Dimensions and empty variables of one group, as netCDF-4 wants them."""
    for dim, size in layout.dims.items():
        group.dimensions[dim] = size
    for item in layout.items:
        options: dict[str, Any] = {}
        if item.field:
            shape = tuple(layout.dims[d] for d in item.dims)
            chunk = (1,) * len(layout.case_dims) + shape[-2:]
            options = {"chunks": chunk, "compression": "gzip", "compression_opts": 1, "shuffle": False}
        if item.dtype.startswith("f") and not item.coordinate:
            options["fillvalue"] = np.array(np.nan, dtype=item.dtype)[()]
        dtype = h5py.string_dtype("utf-8") if item.dtype == "str" else np.dtype(item.dtype)
        group.create_variable(item.name, item.dims, dtype, **options)


class _Group:
    """One group of the file: writes what is known, then takes results."""

    def __init__(self, group: h5py.Group, layout: Layout) -> None:
        self.layout = layout
        self._variables: dict[str, h5py.Dataset] = {item.name: group[item.name] for item in layout.items}
        self._fields = {item.name: item for item in layout.items if item.field}
        self._scalars: dict[str, np.ndarray] = {}
        self._written = np.zeros(layout.case_shape, dtype=bool)
        for name, value in layout.attrs.items():
            group.attrs[name] = value
        coordinates = [i.name for i in layout.items if i.coordinate and i.name not in layout.dims]
        if coordinates:
            group.attrs["coordinates"] = " ".join(coordinates)  # what xarray writes and reads for them
        for item in layout.items:
            self._variables[item.name].attrs.update(item.attrs)
            if item.values is not None:
                self._variables[item.name][...] = item.values
            elif not item.field:
                self._scalars[item.name] = _empty(item.dtype, layout.case_shape)

    def add(self, case: Case, result: Result) -> None:
        """Take one case's result; its fields go to the disk now."""
        where = f"{case.grid}, case {case.index}"
        if self._written[case.index]:
            raise ValueError(f"{where}: has two results")
        unknown = (result.scalars.keys() | result.fields.keys()) - VARIABLES.keys()
        if unknown:
            raise ValueError(f"{where}: unknown variables {sorted(unknown)}")
        for name, item in self._fields.items():
            self._variables[name][case.index] = self._slab(item, case, result.fields.get(name), where)
        for name, value in result.scalars.items():
            if name in self._scalars and np.isfinite(value):
                self._scalars[name][case.index] = value
        self._scalars["status"][case.index] = Status(result.status).value
        self._scalars["status_reason"][case.index] = result.reason
        self._written[case.index] = True

    def _slab(self, item: Item, case: Case, values: np.ndarray | None, where: str) -> np.ndarray:
        """One case's field at the group's size: missing values where the case has none, or has fewer cells."""
        shape = (self.layout.dims["x"], self.layout.dims["y"])
        if values is not None and values.shape != case.scene.mesh.cells:
            raise ValueError(f"{where}: {item.name} has shape {values.shape}, the mesh {case.scene.mesh.cells}")
        if values is not None and values.shape == shape:
            return np.ascontiguousarray(values, dtype=item.dtype)
        slab = _empty(item.dtype, shape)
        if values is not None:
            slab[: values.shape[0], : values.shape[1]] = values
        return slab

    def finish(self) -> None:
        """Write the scalars; ValueError when a case has no result."""
        missing = int(np.count_nonzero(~self._written))
        if missing:
            raise ValueError(f"grid {self.layout.name}: {missing} of {self._written.size} cases have no result")
        for name, values in self._scalars.items():
            self._variables[name][...] = values

    def fill_from(self, groups: list[_Group]) -> None:
        """Write this table's scalars from those of the grids, one after another."""
        for name in self._scalars:
            dtype = self.layout[name].dtype
            parts = [
                group._scalars[name].reshape(-1) if name in group._scalars else _empty(dtype, (group._written.size,))
                for group in groups
            ]
            self._variables[name][...] = np.concatenate(parts)


def _empty(dtype: str, shape: tuple[int, ...]) -> np.ndarray:
    """An array of missing values: NaN, MISSING, or empty text."""
    if dtype == "str":
        return np.full(shape, "", dtype=object)
    return np.full(shape, np.nan if dtype.startswith("f") else MISSING, dtype=dtype)
