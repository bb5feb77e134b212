"""A result as bytes: what workers send, units keep, and cubes are made from.

A record is plain data with its lengths, nothing in it is ever executed: a JSON head, the scalars as doubles, and each
field compressed as a cube stores it, so that its bytes are made once, where the case is solved, and only copied from
then on. Fields of cropped outputs are cut to the box of the case's own contact, outside of which they are zero.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rcstudy.deflate import compress, decompress
from rcstudy.result import VARIABLES, Result, Status

if TYPE_CHECKING:
    from rcstudy.mechanics.scene import Scene

SCALARS = tuple(name for name, v in VARIABLES.items() if v.kind == "scalar" and name != "status")
"""Scalars of a record, in the order in which they are stored."""

FIELDS = tuple(name for name, v in VARIABLES.items() if v.kind == "field")

_HEAD = struct.Struct("<I")
_NUMBERS = struct.Struct(f"<{len(SCALARS)}d")
_SCALARS, _FIELDS = frozenset(SCALARS), frozenset(FIELDS)
_KINDS = {"f8": 8, "f4": 4, "i1": 1}
_MOST_CELLS = 2**28  # of a window, in a file that may be hostile

Region = tuple[int, int, int, int]
"""Cells i0 <= i < i1, j0 <= j < j1 of a window."""


class DamagedRecord(ValueError):
    """Bytes that are no record."""


@dataclass(frozen=True)
class Keep:
    """What is kept of a result: `fields` or scalars only, in `precision` (float64, float32), `crop` to the contact."""

    fields: bool = True
    precision: str = "float64"
    crop: bool = False

    def covers(self, wanted: Keep) -> bool:
        """Whether what was kept like this holds all that is `wanted`: fields outside the contact are zero."""
        return not wanted.fields or (self.fields and (self.precision == "float64" or wanted.precision == "float32"))


class Packed(NamedTuple):
    """A result on its way: `status`, `reason`, and the whole record as bytes."""

    status: int
    reason: str
    body: bytes


class PackedField(NamedTuple):
    """A field of a record: its type ("f8", "f4" or "i1") and the zlib stream of its region."""

    dtype: str
    stream: bytes


@dataclass(frozen=True)
class Record:
    """A record read back. `cells` of the window, `region` of it that the fields hold (outside they are zero)."""

    status: Status
    reason: str
    cells: tuple[int, int]
    region: Region
    scalars: dict[str, float]
    fields: dict[str, PackedField]

    @property
    def shape(self) -> tuple[int, int]:
        """Cells of the region."""
        i0, i1, j0, j1 = self.region
        return i1 - i0, j1 - j0

    def values(self, name: str) -> np.ndarray:
        """Field `name` on the region. Raises DamagedRecord when its bytes are not those that were written."""
        packed = self.fields[name]
        try:
            data = decompress(packed.stream, math.prod(self.shape) * _KINDS[packed.dtype])
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
        """The box of the window outside of which all fields are zero; of no cells if there is nothing in them."""
        if not self.fields:
            return 0, 0, 0, 0
        i0, i1, j0, j1 = contact_box([self.values(name) for name in self.fields])
        return self.region[0] + i0, self.region[0] + i1, self.region[2] + j0, self.region[2] + j1

    def contradicts(self, other: Record) -> str:
        """The name of something in which two solved records of one case differ, timings apart; "" if nothing does.

        Fields are compared in the precision of the coarser of both, as far as both have them.
        """
        if Status.SOLVED not in (self.status, other.status) or self.status != other.status:
            return ""  # a failure does not say that a solution is wrong
        for name in SCALARS:
            if not VARIABLES[name].timing and self.scalars.get(name) != other.scalars.get(name):
                return name
        whole = (0, self.cells[0], 0, self.cells[1])
        for name in self.fields.keys() & other.fields.keys():
            dtype = min(self.fields[name].dtype, other.fields[name].dtype)
            if not np.array_equal(self.cut(name, whole).astype(dtype), other.cut(name, whole).astype(dtype)):
                return name
        return ""

    def body(self) -> bytes:
        """The record as bytes."""
        # written out by hand: a third of the time that an encoder takes
        fields = ",".join(f'["{name}","{f.dtype}",{len(f.stream)}]' for name, f in self.fields.items())
        reason = json.dumps(self.reason) if self.reason else '""'
        text = (
            f'{{"status":{self.status.value},"reason":{reason},"cells":{[*self.cells]},"region":{[*self.region]},'
            f'"fields":[{fields}]}}'
        ).encode()
        numbers = _NUMBERS.pack(*[self.scalars.get(name, math.nan) for name in SCALARS])
        return b"".join((_HEAD.pack(len(text)), text, numbers, *(f.stream for f in self.fields.values())))


class Packing:
    """A solver whose results are packed where they are solved; importable by name if the solver is.

    A result that cannot be packed, because its names or shapes are not those of its scene, becomes an error.
    """

    def __init__(self, solve: Callable[[Sequence[Scene]], Iterator[Result]], keep: Keep) -> None:
        self.solve = solve
        self.keep = keep

    def __call__(self, scenes: Sequence[Scene]) -> Iterator[Packed]:
        """A packed result a scene, in order."""
        packer = Packer(self.keep)
        for scene, result in zip(scenes, self.solve(scenes), strict=True):
            try:
                yield packer.pack(result, scene.mesh.cells)
            except ValueError as error:
                yield packer.pack(Result(Status.ERROR, f"the solver gave no proper result: {error}"), scene.mesh.cells)


class Packer:
    """Packs results one after another; a pressure that several of them share is compressed once."""

    def __init__(self, keep: Keep) -> None:
        self.keep = keep
        self._pressure = np.empty((0, 0))
        self._stream = b""

    def pack(self, result: Result, cells: tuple[int, int]) -> Packed:
        """`result` of a scene with so many `cells`. ValueError when its names or shapes are wrong."""
        if not (result.scalars.keys() <= _SCALARS and result.fields.keys() <= _FIELDS):
            unknown = (result.scalars.keys() - _SCALARS) | (result.fields.keys() - _FIELDS)
            raise ValueError(f"unknown variables {sorted(unknown)}")
        for name, values in result.fields.items():
            if values.shape != cells:
                raise ValueError(f"{name} has shape {values.shape}, the mesh {cells}")
        fields = result.fields if self.keep.fields else {}
        region = contact_box(fields.values()) if self.keep.crop and fields else (0, cells[0], 0, cells[1])
        i0, i1, j0, j1 = region
        packed = {}
        for name, values in fields.items():
            dtype = VARIABLES[name].dtype
            dtype = "f4" if dtype == "f8" and self.keep.precision == "float32" else dtype
            inner = np.ascontiguousarray(values[i0:i1, j0:j1], dtype=dtype)
            packed[name] = PackedField(dtype, self._shared(inner) if name == "pressure" else compress(inner))
        scalars = {name: value for name, value in result.scalars.items() if math.isfinite(value)}
        record = Record(Status(result.status), result.reason, cells, region, scalars, packed)
        return Packed(record.status.value, record.reason, record.body())

    def _shared(self, pressure: np.ndarray) -> bytes:
        """The stream of `pressure`; that of the last one if it is the same, bit for bit."""
        bits = f"i{pressure.itemsize}"  # so that -0 is not 0
        if not np.array_equal(self._pressure.view(bits), pressure.view(bits)):
            self._pressure, self._stream = pressure.copy(), compress(pressure)
        return self._stream


def contact_box(fields: Iterable[np.ndarray]) -> Region:
    """The smallest box outside of which all `fields` of one shape are zero; of no cells if they are zero all over."""
    held = np.logical_or.reduce([values != 0 for values in fields])
    i, j = np.flatnonzero(held.any(axis=1)), np.flatnonzero(held.any(axis=0))
    if i.size == 0:
        return 0, 0, 0, 0
    return int(i[0]), int(i[-1]) + 1, int(j[0]), int(j[-1]) + 1


def glance(body: bytes) -> tuple[Status, tuple[int, int], Keep]:
    """Status, number of cells and what was kept of a record, from its head alone.

    Raises DamagedRecord if it has none.
    """
    try:
        (size,) = _HEAD.unpack_from(body)
        head = json.loads(body[_HEAD.size : _HEAD.size + size])
        nx, ny = map(int, head["cells"])
        types = {name: dtype for name, dtype, _ in head["fields"]}
        keep = Keep("pressure" in types, "float64" if types.get("pressure") == "f8" else "float32")
        return Status(head["status"]), (nx, ny), keep
    except (ValueError, KeyError, TypeError, struct.error, RecursionError) as error:
        raise DamagedRecord(f"{type(error).__name__}: {error}") from error


def parse(body: bytes, names: Sequence[str] = SCALARS) -> Record:
    """The record of these bytes; `names` are those of the scalars when it was written.

    Raises DamagedRecord unless the bytes are a record; the streams of its fields are looked into when they are used.
    """
    try:
        (size,) = _HEAD.unpack_from(body)
        head = json.loads(body[_HEAD.size : _HEAD.size + size])
        at = _HEAD.size + size
        numbers = struct.unpack_from(f"<{len(names)}d", body, at)
        at += 8 * len(names)
        fields = {}
        for name, dtype, length in head["fields"]:
            if name not in _FIELDS or dtype not in _KINDS or not 0 <= length <= len(body) - at:
                raise DamagedRecord("a field is not what it should be")
            fields[name] = PackedField(dtype, body[at : at + length])
            at += length
        if at != len(body):
            raise DamagedRecord("it is not as long as it says")
        nx, ny = map(int, head["cells"])
        i0, i1, j0, j1 = map(int, head["region"])
        if not (0 <= i0 <= i1 <= nx and 0 <= j0 <= j1 <= ny and nx * ny <= _MOST_CELLS):
            raise DamagedRecord("its cells are not those of a mesh")
        status, reason = Status(head["status"]), str(head["reason"])
        scalars = {name: x for name, x in zip(names, numbers, strict=True) if x == x}  # NaN: no value
        return Record(status, reason, (nx, ny), (i0, i1, j0, j1), scalars, fields)
    except DamagedRecord:
        raise
    except (ValueError, KeyError, TypeError, struct.error, RecursionError) as error:
        raise DamagedRecord(f"{type(error).__name__}: {error}") from error
