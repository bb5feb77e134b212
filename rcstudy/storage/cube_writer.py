"""Writes a cube: created up front, filled case by case in bounded memory, published whole or not at all."""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from rcstudy.storage.deflate import compress
from rcstudy.storage.hdf5 import add_attributes, add_variable, attach_scales, fill
from rcstudy.storage.layout import (
    CASE_KEY,
    CHECKSUM,
    MISSING,
    SCHEMA,
    SCHEMA_ATTRIBUTE,
    Item,
    Layout,
    lay_out,
    missing_values,
    regions,
)
from rcstudy.storage.publish import replacing
from rcstudy.storage.record import SCALARS, Record, Region
from rcstudy.storage.steady import SteadyFile, interrupts_held

if TYPE_CHECKING:
    import xarray as xr

    from rcstudy.cases import Case, Expansion
    from rcstudy.mechanics.scene import Mesh
    from rcstudy.study import Study

_COMPRESSION = 1  # deflate level that the file states; the streams are made by rcstudy.storage.deflate


@contextlib.contextmanager
def writing(
    path: Path | str,
    study: Study,
    expansion: Expansion,
    cropped: Mapping[str, Mapping[Mesh, Region]] | None = None,
) -> Iterator[CubeWriter]:
    """The writer of the cube `path`, which replaces an existing file when the block ends without error.

    `cropped`: the cells that fields are cut to, for each mesh of a grid. Raises UserError when the file cannot be
    written.
    """
    outputs = study.outputs
    layouts, root = lay_out(expansion, fields=outputs.fields, precision=outputs.precision, cropped=cropped)
    stored = {name: regions(cases, (cropped or {}).get(name)) for name, cases in expansion.by_grid().items()}
    with replacing(path) as temporary, SteadyFile(temporary) as storage, _created(storage) as file:
        cube = CubeWriter(study, file, storage, layouts, root, stored)
        yield cube
        if not cube.finished:
            raise ValueError(f"{path}: left unfinished")


@contextlib.contextmanager
def _created(storage: SteadyFile) -> Iterator[h5py.File]:
    """A new HDF5 file in `storage`, closed at the end; raises the error of any write that failed."""
    file = None
    try:
        with interrupts_held():  # raises at its end, when the file is open
            file = h5py.File(storage, "w")
        yield file
    finally:
        with interrupts_held():
            if file is not None:
                file.close()
    storage.check()


def write_datasets(path: Path, groups: Mapping[str, xr.Dataset]) -> None:
    """Write a netCDF-4 file of small Datasets, each in the group of its name, whole or not at all; Ctrl-C waits for it.

    Raises UserError when the file cannot be written. The libraries' own errors do not tell why: "NetCDF: HDF error".
    """
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    with replacing(path) as temporary, SteadyFile(temporary) as storage:
        with interrupts_held(), h5netcdf.File(storage, "w") as file:
            for name, dataset in groups.items():
                dataset.dump_to_store(H5NetCDFStore(file, group=name, mode="a"))
        storage.check()


class CubeWriter:
    """Takes the cases of a cube, and finally the attributes of the whole cube: see :func:`writing`.

    Fields go to the disk as they come; scalars (some hundred bytes per case) are kept until the end.
    """

    def __init__(
        self,
        study: Study,
        file: h5py.File,
        storage: SteadyFile,
        layouts: Sequence[Layout],
        root: Layout | None,
        stored: Mapping[str, Mapping[Mesh, Region]],
    ) -> None:
        self.finished = False
        self._study, self._file, self._storage = study, file, storage
        with interrupts_held():
            numbers = itertools.count()
            self._table = _Group(file, root, numbers) if root is not None else None
            self._grids = {
                layout.name: _Group(
                    file if root is None else file.create_group(layout.name), layout, numbers, stored[layout.name]
                )
                for layout in layouts
            }
        storage.check()

    def add(self, some: Sequence[tuple[Case, Record]]) -> None:
        """Add cases, few enough that Ctrl-C may wait for them. Raises OSError when the file cannot be written."""
        with interrupts_held():
            for case, record in some:
                self._grids[case.grid].add(case, record)
        self._storage.check()

    def finish(self, provenance: Mapping[str, str | int | float], started: float) -> None:
        """Write scalars and attributes: `provenance`, the study's, and the wall time since `started` (monotonic).

        Raises ValueError when a case has no result.
        """
        study = self._study
        with interrupts_held():
            for group in self._grids.values():
                group.finish()
            if self._table is not None:
                self._table.fill_from(list(self._grids.values()))
            add_attributes(
                self._file,
                {
                    "title": study.name,
                    "study": study.name,
                    "description": study.description,
                    "study_text": study.text,
                    "study_sha256": study.sha256,
                    SCHEMA_ATTRIBUTE: SCHEMA,
                    **provenance,
                    "wall_seconds": round(time.monotonic() - started, 3),
                },
            )
        self.finished = True


class _Group:
    """One group of the file: creates its variables and writes what is known, then takes results.

    Dimensions are HDF5 dimension scales as netCDF-4 has them (NetCDF-4 format, appendix C of the netCDF user's
    guide). Made with h5py's lower level, not h5netcdf, which takes ten times as long: seconds for a study of ten grids.
    `numbers` counts the file's dimensions; `stored`: the cells to store of each mesh.
    """

    def __init__(
        self, group: h5py.Group, layout: Layout, numbers: Iterator[int], stored: Mapping[Mesh, Region] | None = None
    ) -> None:
        self.layout = layout
        self._stored = stored or {}
        self._group = group
        self._missing: dict[str, bytes] = {}
        self._variables: dict[str, h5py.Dataset] = {}
        self._fields = [item for item in layout.items if item.field]
        self._numbers = np.full((*layout.case_shape, len(SCALARS)), np.nan)
        self._statuses = np.full(layout.case_shape, MISSING)
        self._reasons = missing_values("str", layout.case_shape)
        self._scalars: dict[str, np.ndarray] = {}  # by name, once all cases are there
        for item in layout.items:
            self._variables[item.name] = self._create(group, item)
        scales = {dim: self._scale(group, dim, next(numbers)) for dim in layout.dims}
        for item in layout.items:
            variable = self._variables[item.name]
            if item.name not in layout.dims:
                attach_scales(variable, [scales[dim] for dim in item.dims])
            add_attributes(variable, item.attrs)
            if item.values is not None:
                fill(variable, item.values)
        add_attributes(group, layout.attrs)
        coordinates = [i.name for i in layout.items if i.coordinate and i.name not in layout.dims]
        if coordinates:
            add_attributes(group, {"coordinates": " ".join(coordinates)})  # as xarray writes and reads it

    def _create(self, group: h5py.Group, item: Item) -> h5py.Dataset:
        shape = tuple(self.layout.dims[d] for d in item.dims)
        chunk = (1,) * len(self.layout.case_dims) + shape[-2:] if item.field else None
        missing = np.array([np.nan], dtype=item.dtype) if item.dtype.startswith("f") and not item.coordinate else None
        variable = add_variable(group, item.name, shape, item.dtype, missing=missing, chunk=chunk, deflate=_COMPRESSION)
        if missing is not None:
            add_attributes(variable, {"_FillValue": missing})
        return variable

    def _scale(self, group: h5py.Group, dim: str, number: int) -> h5py.Dataset:
        """The dimension scale of a dimension: its coordinate, or a mere place holder where it has none."""
        if dim in self._variables:
            scale, name = self._variables[dim], dim
        else:
            size = self.layout.dims[dim]
            scale = add_variable(group, dim, (size,), ">f4")
            name = f"This is a netCDF dimension but not a netCDF variable. {size:10d}"
        scale.make_scale(name)
        add_attributes(scale, {"_Netcdf4Dimid": np.int32(number)})
        return scale

    def add(self, case: Case, record: Record) -> None:
        """Take one case's record; its fields go to the disk now.

        ValueError if the case has one already, or if the record has not the cells of the case's mesh.
        """
        if self._statuses[case.index] != MISSING:
            raise ValueError(f"{case.grid}, case {case.index}: has two results")
        if record.cells != case.scene.mesh.cells:
            raise ValueError(
                f"{case.grid}, case {case.index}: its result has {record.cells} cells, the mesh {case.scene.mesh.cells}"
            )
        place = (*case.index, 0, 0)
        stored = self._stored[case.scene.mesh] if self._fields else record.region
        for item in self._fields:
            # a case's field is a chunk: written as it was compressed, in half the time that h5py takes
            self._variables[item.name].id.write_direct_chunk(place, self._chunk(item, stored, record))
        self._numbers[case.index] = record.numbers
        self._statuses[case.index] = record.status.value
        self._reasons[case.index] = record.reason

    def _chunk(self, item: Item, stored: Region, record: Record) -> bytes:
        """The bytes of one case's field at the group's size: missing values where the case has none, or fewer cells."""
        shape = (self.layout.dims["x"], self.layout.dims["y"])
        packed = record.fields.get(item.name)
        if packed is None:
            if item.name not in self._missing:
                self._missing[item.name] = compress(missing_values(item.dtype, shape))
            return self._missing[item.name]
        if record.region == stored and record.shape == shape and packed.dtype == item.dtype:
            return packed.stream
        slab = missing_values(item.dtype, shape)
        slab[: stored[1] - stored[0], : stored[3] - stored[2]] = record.cut(item.name, stored)
        return compress(slab)

    def finish(self) -> None:
        """Write the scalars; ValueError when a case has no result."""
        missing = int(np.count_nonzero(self._statuses == MISSING))
        if missing:
            raise ValueError(f"grid {self.layout.name}: {missing} of {self._statuses.size} cases have no result")
        known: dict[str, np.ndarray] = {name: self._numbers[..., k] for k, name in enumerate(SCALARS)}
        known |= {"status": self._statuses, "status_reason": self._reasons}
        for item in self.layout.items:
            if item.values is None and not item.field:
                self._scalars[item.name] = _typed(known[item.name], item.dtype)
                fill(self._variables[item.name], self._scalars[item.name])
        keys = self.layout[CASE_KEY].values
        assert keys is not None
        add_attributes(self._group, {CHECKSUM: checksum({CASE_KEY: keys, **self._scalars})})

    def fill_from(self, groups: list[_Group]) -> None:
        """Write this table's scalars from those of the grids, one after another."""
        for item in self.layout.items:
            if item.values is None:
                parts = [
                    group._scalars[item.name].reshape(-1)
                    if item.name in group._scalars
                    else missing_values(item.dtype, (group._statuses.size,))
                    for group in groups
                ]
                fill(self._variables[item.name], np.concatenate(parts))


def _typed(values: np.ndarray, dtype: str) -> np.ndarray:
    """`values` in the type that they are stored in; where an integer has no value, MISSING."""
    if dtype == "str" or dtype.startswith("f"):
        return values if dtype == "str" else values.astype(dtype)
    return np.where(np.isnan(values), MISSING, values).astype(dtype)


def checksum(numbers: Mapping[str, np.ndarray]) -> str:
    """SHA-256 (hex) of the values of all cases of a grid by name, text and numbers, in the order of the names."""
    digest = hashlib.sha256()
    for name in sorted(numbers):
        values = numbers[name].reshape(-1)
        if values.dtype == object:
            data = "\0".join(map(str, values)).encode()
        else:
            data = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<")).tobytes()
        digest.update(f"{name} {len(data)} ".encode() + data)
    return digest.hexdigest()
