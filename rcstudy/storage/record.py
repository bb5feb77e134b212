"""Records: results as bytes, which workers send, units store, and cubes are made from.

A record is plain data; nothing in it is ever executed. It consists of a head of numbers, the scalars as doubles, and
each field compressed as a cube stores it. So these bytes are made once, where the case is solved, and only copied from
then on. Fields of cropped outputs are cut to the box of the case's own contact, outside of which they are zero.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rcstudy.result import VARIABLES, Result, Status
from rcstudy.storage.deflate import compress, decompress

if TYPE_CHECKING:
    from rcstudy.mechanics.scene import Scene

SCALARS = tuple(name for name, v in VARIABLES.items() if v.kind == "scalar" and name != "status")
"""Scalars of a record, in the order in which they are stored."""

FIELDS = tuple(name for name, v in VARIABLES.items() if v.kind == "field")

_SCALARS, _FIELDS = frozenset(SCALARS), frozenset(FIELDS)
_KINDS = ("f8", "f4", "i1")  # types of fields; a record stores their number in this list, from 1 on
_BEFORE_FIELDS = 8  # count of the numbers of a head that precede those of the fields
_MOST_CELLS = 2**28  # largest window that is accepted from a file, which may be hostile

Region = tuple[int, int, int, int]
"""Cells i0 <= i < i1, j0 <= j < j1 of a window."""


class DamagedRecord(ValueError):
    """Raised for bytes that are not a record."""


@dataclass(frozen=True)
class Form:
    """The structure of records: the names of their scalars and fields, in the order in which these are stored."""

    scalars: tuple[str, ...] = SCALARS
    fields: tuple[str, ...] = FIELDS

    @cached_property
    def head(self) -> struct.Struct:
        """Format of the head: status, cells, region, length of the reason, types (0: absent), lengths, scalars.

        Each field has a type and a length.
        """
        return struct.Struct(f"<B7I{'BI' * len(self.fields)}{len(self.scalars)}d")


FORM = Form()
"""The structure of the records of this version."""


@dataclass(frozen=True)
class Keep:
    """The part of a result that is kept.

    `fields`: fields as well as scalars; `precision` of fields: float64 or float32; `crop`: cut fields to the contact.
    """

    fields: bool = True
    precision: str = "float64"
    crop: bool = False

    def covers(self, wanted: Keep) -> bool:
        """Whether results kept like this contain all that is `wanted`; cropping loses nothing but zeros."""
        return not wanted.fields or (self.fields and (self.precision == "float64" or wanted.precision == "float32"))


class Packed(NamedTuple):
    """A result to be sent or stored: `status`, and the whole record as bytes."""

    status: int
    body: bytes


class PackedField(NamedTuple):
    """A field of a record: its type ("f8", "f4" or "i1") and the zlib stream of its region."""

    dtype: str
    stream: bytes


@dataclass(frozen=True)
class Record:
    """A record read back.

    `cells`: number of cells of the window; `region`: the part of it that the fields cover (outside they are zero);
    `numbers`: the scalars in the order of SCALARS, NaN for those without a value.
    """

    status: Status
    reason: str
    cells: tuple[int, int]
    region: Region
    numbers: tuple[float, ...]
    fields: Mapping[str, PackedField]

    @property
    def scalars(self) -> dict[str, float]:
        """The scalars that have a value, by name."""
        return {name: x for name, x in zip(SCALARS, self.numbers, strict=True) if x == x}

    @property
    def shape(self) -> tuple[int, int]:
        """Number of cells of the region along x and y."""
        i0, i1, j0, j1 = self.region
        return i1 - i0, j1 - j0

    def values(self, name: str) -> np.ndarray:
        """Field `name` on the region. Raises DamagedRecord if its bytes have changed since they were written."""
        packed = self.fields[name]
        try:
            data = decompress(packed.stream, math.prod(self.shape) * int(packed.dtype[1]))
        except ValueError as error:
            raise DamagedRecord(f"{name}: {error}") from error
        return np.frombuffer(data, dtype=packed.dtype).reshape(self.shape)

    def cut(self, name: str, wanted: Region) -> np.ndarray:
        """Field `name` on the region `wanted` of the window; zero where it is not stored."""
        i0, i1, j0, j1 = wanted
        own_i0, own_i1, own_j0, own_j1 = self.region
        out = np.zeros((i1 - i0, j1 - j0), dtype=self.fields[name].dtype)
        a0, a1, b0, b1 = max(i0, own_i0), min(i1, own_i1), max(j0, own_j0), min(j1, own_j1)
        if a0 < a1 and b0 < b1:
            inner = self.values(name)[a0 - own_i0 : a1 - own_i0, b0 - own_j0 : b1 - own_j0]
            out[a0 - i0 : a1 - i0, b0 - j0 : b1 - j0] = inner
        return out

    def contact(self) -> Region:
        """The smallest box of the window outside of which all fields are zero; empty if they are zero everywhere."""
        if not self.fields:
            return 0, 0, 0, 0
        i0, i1, j0, j1 = contact_box([self.values(name) for name in self.fields])
        return self.region[0] + i0, self.region[0] + i1, self.region[2] + j0, self.region[2] + j1

    def contradicts(self, other: Record) -> str:
        """The name of a scalar or field in which two solved records of one case differ, timings apart; "" if none.

        Fields that both records have are compared in the lower of their precisions.
        """
        if Status.SOLVED not in (self.status, other.status) or self.status != other.status:
            return ""  # a failure does not say that a solution is wrong
        ours, theirs = self.scalars, other.scalars
        for name in SCALARS:
            if not VARIABLES[name].timing and ours.get(name) != theirs.get(name):
                return name
        whole = (0, self.cells[0], 0, self.cells[1])
        for name in FIELDS:
            if name not in self.fields or name not in other.fields:
                continue
            dtype = min(self.fields[name].dtype, other.fields[name].dtype)
            if not np.array_equal(self.cut(name, whole).astype(dtype), other.cut(name, whole).astype(dtype)):
                return name
        return ""


class Packing:
    """A solver that packs its results where they are solved; it can be pickled if `solve` can.

    A result that cannot be packed, because its names or shapes do not fit its scene, is replaced by one with status
    ERROR.
    """

    def __init__(self, solve: Callable[[Sequence[Scene]], Iterator[Result]], keep: Keep) -> None:
        self.solve = solve
        self.keep = keep

    def __call__(self, scenes: Sequence[Scene]) -> Iterator[Packed]:
        """Yield a packed result for each scene, in order."""
        packer = Packer(self.keep)
        for scene, result in zip(scenes, self.solve(scenes), strict=True):
            cells = scene.mesh.cells
            try:
                yield packer.pack(result, cells)
            except ValueError as error:
                yield packer.pack(Result(Status.ERROR, f"the solver gave no proper result: {error}"), cells)


class Packer:
    """Packs results one after another; a pressure that several of them share is compressed once."""

    def __init__(self, keep: Keep) -> None:
        self.keep = keep
        self._kinds = {name: _KINDS.index(field_type(name, keep.precision)) + 1 for name in FIELDS}
        self._pressure = self._stream = b""

    def pack(self, result: Result, cells: tuple[int, int]) -> Packed:
        """The packed `result` of a scene with `cells` along x and y. Raises ValueError if names or shapes are wrong."""
        if not (result.scalars.keys() <= _SCALARS and result.fields.keys() <= _FIELDS):
            unknown = (result.scalars.keys() - _SCALARS) | (result.fields.keys() - _FIELDS)
            raise ValueError(f"unknown variables {sorted(unknown)}")
        for name, values in result.fields.items():
            if values.shape != cells:
                raise ValueError(f"{name} has shape {values.shape}, the mesh {cells}")
        fields = result.fields if self.keep.fields else {}
        i0, i1, j0, j1 = contact_box(fields.values()) if self.keep.crop and fields else (0, cells[0], 0, cells[1])
        entries: list[int] = []
        streams = []
        for name in FIELDS:
            if name not in fields:
                entries += (0, 0)
                continue
            kind = self._kinds[name]
            with np.errstate(over="ignore"):
                inner = np.ascontiguousarray(fields[name][i0:i1, j0:j1], dtype=_KINDS[kind - 1])
            if np.isinf(inner).any() and np.isfinite(fields[name]).all():
                raise ValueError(f"{name} has numbers beyond {np.finfo(inner.dtype).max:.2g}, the largest of its type")
            stream = self._shared(inner) if name == "pressure" else compress(inner)
            entries += (kind, len(stream))
            streams.append(stream)
        numbers = [result.scalars.get(name, math.nan) for name in SCALARS]
        if not math.isfinite(sum(numbers)):
            numbers = [x if math.isfinite(x) else math.nan for x in numbers]
        reason = result.reason.encode(errors="backslashreplace")
        status = Status(result.status).value
        head = FORM.head.pack(status, *cells, i0, i1, j0, j1, len(reason), *entries, *numbers)
        return Packed(status, b"".join((head, reason, *streams)))

    def _shared(self, pressure: np.ndarray) -> bytes:
        """The compressed stream of `pressure`, reused from the last call if the bits are the same."""
        data = pressure.tobytes()
        if data != self._pressure:
            self._pressure, self._stream = data, compress(pressure)
        return self._stream


def contact_box(fields: Iterable[np.ndarray]) -> Region:
    """The smallest box outside of which all `fields` (of one shape) are zero; empty if they are zero everywhere."""
    held = np.logical_or.reduce([values != 0 for values in fields])
    i, j = np.flatnonzero(held.any(axis=1)), np.flatnonzero(held.any(axis=0))
    if i.size == 0:
        return 0, 0, 0, 0
    return int(i[0]), int(i[-1]) + 1, int(j[0]), int(j[-1]) + 1


def field_type(name: str, precision: str) -> str:
    """The type ("f8", "f4" or "i1") of a field that is kept in `precision`."""
    dtype = VARIABLES[name].dtype
    return "f4" if dtype == "f8" and precision == "float32" else dtype


def read_head(body: bytes, form: Form) -> tuple[Status, tuple[int, int], Keep]:
    """Status, number of cells and kept part of a record, from its head alone.

    Raises DamagedRecord if there is no valid head.
    """
    status, nx, ny, *_ = head = _head(body, form)
    kind = head[_BEFORE_FIELDS + 2 * form.fields.index("pressure")] if "pressure" in form.fields else 0
    return Status(status), (nx, ny), Keep(kind != 0, "float64" if kind == 1 else "float32")


def parse(body: bytes, form: Form = FORM) -> Record:
    """The record in the bytes `body`; `form` is that of the version that wrote it.

    Raises DamagedRecord unless the bytes are a record. The streams of fields are checked only when they are used.
    """
    head = _head(body, form)
    status, nx, ny, i0, i1, j0, j1, size = head[:_BEFORE_FIELDS]
    if not (i0 <= i1 <= nx and j0 <= j1 <= ny and nx * ny <= _MOST_CELLS):
        raise DamagedRecord("its cells are not those of a mesh")
    at = form.head.size
    try:
        reason = body[at : at + size].decode()
    except UnicodeDecodeError as error:
        raise DamagedRecord(f"its reason is no text: {error}") from error
    at += size
    fields = {}
    for k, name in enumerate(form.fields):
        kind, length = head[_BEFORE_FIELDS + 2 * k : _BEFORE_FIELDS + 2 * k + 2]
        if kind == 0:
            continue
        if name not in _FIELDS or kind > len(_KINDS):
            raise DamagedRecord("a field is not what it should be")
        fields[name] = PackedField(_KINDS[kind - 1], body[at : at + length])
        at += length
    if at != len(body):
        raise DamagedRecord("it is not as long as it says")
    numbers = head[_BEFORE_FIELDS + 2 * len(form.fields) :]
    if form.scalars != SCALARS:
        of_name = dict(zip(form.scalars, numbers, strict=True))
        numbers = tuple(of_name.get(name, math.nan) for name in SCALARS)
    return Record(Status(status), reason, (nx, ny), (i0, i1, j0, j1), numbers, fields)


def _head(body: bytes, form: Form) -> tuple[Any, ...]:
    """The numbers in the head of a record. Raises DamagedRecord if there is no valid head."""
    try:
        head = form.head.unpack_from(body)
        Status(head[0])
    except (struct.error, ValueError) as error:
        raise DamagedRecord(f"{type(error).__name__}: {error}") from error
    return head
