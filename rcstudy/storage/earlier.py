"""The cases of a published cube as records: a sweep of an edited study takes over those that it still has.

A grid's keys, statuses and numbers have a checksum, its fields those of their zlib streams; what does not match is not
taken over. Fields are copied as they were compressed.
"""

from __future__ import annotations

import contextlib
import errno
import mmap
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from rcstudy.errors import UserError, cannot_be_read, first_line
from rcstudy.mechanics import SOLVER_VERSION
from rcstudy.mechanics.scene import Mesh, Scene
from rcstudy.provenance import REVISION
from rcstudy.result import VARIABLES, Status
from rcstudy.storage.cube_writer import checksum
from rcstudy.storage.deflate import compress
from rcstudy.storage.layout import (
    CASE_KEY,
    CHECKSUM,
    MISSING,
    SCHEMA,
    SCHEMA_ATTRIBUTE,
    Layout,
    as_floats,
    cells_of_centres,
)
from rcstudy.storage.record import FIELDS, SCALARS, DamagedRecord, Keep, PackedField, Record, Region
from rcstudy.storage.screen import OTHERS_MARKS, foreign_content, opened, reason_of

_GZIP = 1  # HDF5's number of the deflate filter
_NAMES = (CASE_KEY, "status_reason", "hertz_radius")
_REVISION = re.compile(r"[0-9a-f]{7,64}(\+changes)?")
_ERRNO = re.compile(r"\berrno = (\d+)")  # in the texts of HDF5's errors
# errors of the system that say nothing about the file (not every system has all): another try may succeed
_NAMES_OF_SYSTEM = "EACCES EINTR EIO EMFILE ENFILE ENODEV ENOLCK ENOMEM ENXIO EPERM EREMOTEIO ESTALE ETIMEDOUT"
_OF_SYSTEM = frozenset(getattr(errno, name) for name in _NAMES_OF_SYSTEM.split() if hasattr(errno, name))
_SIGNATURE = b"\x89HDF\r\n\x1a\n"  # of HDF5 files


def refuse_foreign(output: Path) -> None:
    """Raise UserError unless `output` is free or a cube, perhaps a damaged one: nothing else is replaced by a cube.

    What another program saved is none, even if all of it comes from one: it may hold more than can be computed again. A
    cube that another program has open for writing is not replaced either.
    """
    if not output.exists():
        return
    if output.is_dir():
        raise UserError(f"{output}: is a folder, not a file")
    if not output.is_file():
        raise UserError(f"{output}: is a device or the like, not a file")
    with output.open("rb") as file:
        head = file.read(len(_SIGNATURE))
    if not head:
        return
    try:
        foreign = foreign_content(output) or _without_study(output)
    except BlockingIOError as error:
        raise UserError(f"{output}: {reason_of(error)}: wait until it is closed, or choose another --output") from None
    except Exception as error:  # h5py raises errors of any type on damaged files, as in `EarlierCube`
        refuse_unreadable(output, error)
        was_cube = head == _SIGNATURE and _was_cube(output)
        foreign = "" if was_cube else "it cannot be read as one"
    if foreign:
        raise UserError(
            f"{output}: exists and is not an rcstudy cube ({foreign}); not overwritten: choose another --output"
        )


def refuse_unreadable(path: Path, error: Exception) -> None:
    """Raise UserError if it is the system that failed to read the file (`error`): it may be whole, and is not replaced.

    HDF5 passes such an error on as one of any type, with the system's number in its text.
    """
    found = _ERRNO.search(str(error))
    number = (error.errno if isinstance(error, OSError) else None) or (int(found[1]) if found else 0)
    if number in _OF_SYSTEM:
        raise cannot_be_read(path, OSError(number, os.strerror(number))) from error


def _without_study(path: Path) -> str:
    """Says so if an HDF5 file does not name the study that it is the cube of; else ""."""
    with opened(path) as file:
        return "" if "study" in file.attrs else "it names no study"


def _was_cube(path: Path) -> bool:
    """Whether a file that cannot be opened was a cube.

    It holds names that stand near the beginning of all cubes, and none that other programs leave.
    """
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        ours = all(data.find(name.encode()) >= 0 for name in _NAMES)
        return ours and all(data.find(mark) < 0 for mark in OTHERS_MARKS)


def state_of(path: Path) -> tuple[int, ...]:
    """Numbers that tell whether the file at `path` is still the same one; none if there is no file."""
    with contextlib.suppress(OSError):
        found = path.stat()
        return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns
    return ()


def refuse_cube(path: Path) -> None:
    """Raise UserError if `path` is a cube: what is to be written there is none."""
    is_cube = False
    with contextlib.suppress(Exception), opened(path) as file:  # what cannot be opened is none
        is_cube = SCHEMA_ATTRIBUTE in file.attrs
    if is_cube:
        raise UserError(f"{path}: is a cube; not overwritten: choose another --output")


def other_study(output: Path, study: str) -> str | None:
    """The name of the study that `output` is the cube of, of whatever version, if it is another one than `study`."""
    name = study
    try:
        foreign_content(output)  # raises an error if texts of it cannot be read
        with opened(output) as cube:
            found = cube.attrs.get("study", study)
        name = found.decode() if isinstance(found, bytes) else str(found)  # bytes: saved again by another program
    except Exception as error:  # a damaged one is replaced, see above
        refuse_unreadable(output, error)
    return None if name == study else name


def refuse_other_study(output: Path, study: str) -> None:
    """Raise UserError if `output` is the cube of a study of another name than `study`, of whatever version."""
    if (name := other_study(output, study)) is not None:
        raise UserError(
            f"{output}: is the cube of another study, {name}; not overwritten: choose another --output, or remove it "
            "(rcstudy sweep --fresh replaces it)"
        )


def is_replaced(output: Path, study: str) -> bool:
    """Whether what is at `output` will be replaced by the cube of `study`; else a sweep is refused, as above."""
    try:
        refuse_foreign(output)
        refuse_other_study(output, study)
    except (UserError, OSError):
        return False
    return True


class EarlierCube:
    """A cube opened for its cases. `sha256` is that of the study it was made from; close it after use.

    `revision`: of rcstudy, which wrote the cube; "" where it is not known.

    Raises ValueError, with a reason, for a file whose cases cannot be taken over, UserError if it cannot be read now.
    """

    def __init__(self, path: Path) -> None:
        try:
            if foreign := foreign_content(path):
                raise ValueError(foreign)
            self._file = opened(path)
        except Exception as error:  # h5py raises errors of any type on damaged or hostile files
            refuse_unreadable(path, error)
            raise ValueError(reason_of(error) if isinstance(error, OSError) else first_line(error)) from error
        try:
            attrs = self._file.attrs
            if attrs.get(SCHEMA_ATTRIBUTE) != SCHEMA or attrs.get("solver_version") != SOLVER_VERSION:
                raise ValueError("it is no cube of this version and its solver")
            self.sha256 = str(attrs.get("study_sha256", ""))
            revision = str(attrs.get(REVISION, ""))
            self.revision = revision if _REVISION.fullmatch(revision) else ""
            nodes = [self._file[name] for name in self._file]  # `values` passes over those that cannot be read
            found = [self._file, *(node for node in nodes if isinstance(node, h5py.Group))]
            self.grids = [_EarlierGrid(group) for group in found if "axes" in group.attrs]
        except Exception as error:  # h5py and NumPy raise errors of any type on such files
            self._file.close()
            refuse_unreadable(path, error)
            raise ValueError(first_line(error)) from error

    def close(self) -> None:
        """Close the file; an error in doing so is none of what was read."""
        with contextlib.suppress(Exception):  # h5py raises errors of any type
            self._file.close()

    def places(self) -> Iterator[tuple[str, Status, int, int]]:
        """Key and status of each case, the number of its grid and its number in it."""
        for number, grid in enumerate(self.grids):
            for flat, (key, status) in enumerate(zip(grid.keys, grid.statuses, strict=True)):
                yield key, status, number, flat

    def missing(self, groups: Mapping[str, Layout]) -> list[str]:
        """The paths of all variables and dimensions of `groups`, by name ("": the root), that are not there."""
        names = {group: {*layout.dims, *(item.name for item in layout.items)} for group, layout in groups.items()}
        return [
            path for group in names for name in sorted(names[group]) if (path := f"{group}/{name}") not in self._file
        ]

    def is_whole(self, grid: int, flat: int, scene: Scene) -> bool:
        """Whether the fields of a case, whose scene is `scene`, are there and hold all cells of its mesh."""
        return self.grids[grid].is_whole(flat, scene.mesh)

    def record(self, grid: int, flat: int, scene: Scene, *, checked: bool = False) -> Record:
        """The record of a case, whose scene is `scene`. Raises DamagedRecord when there is something wrong with it.

        `checked`: it is solved and was read before without an error, so its fields are copied without a check.
        """
        try:
            return self.grids[grid].record(flat, scene, checked)
        except DamagedRecord:
            raise
        except Exception as error:  # h5py and NumPy raise errors of any type on such files
            raise DamagedRecord(first_line(error)) from error


class _EarlierGrid:
    def __init__(self, group: h5py.Group) -> None:
        self.group = group
        numbers = {name: group[name][...].reshape(-1) for name in ("status", *SCALARS) if name in group}
        texts = {name: group[name].asstr()[...] for name in (CASE_KEY, "status_reason")}
        self.shape = texts[CASE_KEY].shape
        texts = {name: np.asarray(values, dtype=object).reshape(-1) for name, values in texts.items()}
        if checksum({**texts, **numbers}) != group.attrs.get(CHECKSUM):
            raise ValueError("the checksum of its numbers does not match")
        self.keys: list[str] = list(texts[CASE_KEY])
        self.reasons: list[str] = list(texts["status_reason"])
        self.statuses = [Status(status) for status in numbers.pop("status").tolist()]
        self.scalars = frozenset(numbers)  # names of those that it has
        self.numbers = np.stack([_as_doubles(numbers.get(name), len(self.keys)) for name in SCALARS], axis=-1)
        self.fields = {name: group[name] for name in FIELDS if name in group}
        # datasets of centres that are stored for each case; regions, by mesh and, where there are such, by case
        self._centres = {name: group[name] for name in ("x_centre", "y_centre") if name in group}
        self._regions: dict[tuple[Mesh, tuple[Any, ...]], Region] = {}
        for dataset in self.fields.values():
            _check_chunks(dataset, len(self.shape))

    @property
    def keep(self) -> Keep:
        """What the grid holds of each case."""
        if "pressure" not in self.fields:
            return Keep(fields=False)
        return Keep(precision="float64" if self.fields["pressure"].dtype == np.float64 else "float32")

    def is_whole(self, flat: int, mesh: Mesh) -> bool:
        index = tuple(map(int, np.unravel_index(flat, self.shape)))
        return bool(self.fields) and self._region(index, mesh) == (0, mesh.cells[0], 0, mesh.cells[1])

    def record(self, flat: int, scene: Scene, checked: bool) -> Record:
        index = tuple(map(int, np.unravel_index(flat, self.shape)))
        status = self.statuses[flat]
        numbers = tuple(self.numbers[flat].tolist())
        nx, ny = scene.mesh.cells
        region = self._region(index, scene.mesh) if self.fields else (0, nx, 0, ny)
        fields = {}
        for name in FIELDS if self.fields else ():
            if scene.creepage is None and VARIABLES[name].tangential:
                continue
            packed = _field(name, self.fields[name], index, region, checked) if name in self.fields else None
            if packed is not None:
                fields[name] = packed
            elif status == Status.SOLVED:
                raise DamagedRecord(f"{name} is missing")
        return Record(status, self.reasons[flat], scene.mesh.cells, region, numbers, fields)

    def _region(self, index: tuple[Any, ...], mesh: Mesh) -> Region:
        """The cells of the window that a case's fields hold, from the coordinates of their centres."""
        # centres of another case of that mesh may be different in a cube that was changed
        key = (mesh, index if self._centres else ())
        if key in self._regions:
            return self._regions[key]
        found: list[int] = []
        for k, dim in enumerate("xy"):
            own = self._centres.get(f"{dim}_centre")
            cells = cells_of_centres(self.group[dim][...] if own is None else own[index], mesh.centres[k])
            if cells is None:
                raise DamagedRecord("its coordinates are not those of its mesh")
            found += cells
        i0, i1, j0, j1 = found
        self._regions[key] = i0, i1, j0, j1
        return i0, i1, j0, j1


def _as_doubles(values: np.ndarray | None, count: int) -> np.ndarray:
    """The values of a scalar in `count` cases as records hold them: NaN where there is none."""
    return np.full(count, np.nan) if values is None else as_floats(values)


def _check_chunks(dataset: h5py.Dataset, case_dims: int) -> None:
    """ValueError unless the dataset is chunked by case and compressed as cubes are."""
    plist = dataset.id.get_create_plist()
    filters = [plist.get_filter(k)[0] for k in range(plist.get_nfilters())]
    if dataset.chunks != (1,) * case_dims + dataset.shape[case_dims:] or filters != [_GZIP]:
        raise ValueError("its fields are not stored as this version stores them")


def _field(
    name: str, dataset: h5py.Dataset, index: tuple[Any, ...], region: Region, checked: bool
) -> PackedField | None:
    """A case's field, checked to its last byte unless `checked` before; None if all of its values are missing."""
    _, stream = dataset.id.read_direct_chunk((*index, 0, 0))
    shape = dataset.shape[-2:]
    dtype = dataset.dtype.str[1:]
    held = (region[1] - region[0], region[3] - region[2])
    if checked and held == shape:
        return PackedField(dtype, bytes(stream))
    region_of_all = (0, shape[0], 0, shape[1])
    whole = Record(Status.SOLVED, "", shape, region_of_all, (), {name: PackedField(dtype, stream)}).values(name)
    inner = whole[: held[0], : held[1]]
    if _is_missing(inner[:1, :1]) and _is_missing(inner):  # the first cell is enough to rule out most fields
        return None
    return PackedField(dtype, bytes(stream) if held == shape else compress(np.ascontiguousarray(inner)))


def _is_missing(values: np.ndarray) -> bool:
    """Whether all values of a field are missing."""
    return bool((np.isnan(values) if values.dtype.kind == "f" else values == MISSING).all())
