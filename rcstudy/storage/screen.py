"""Check of an HDF5 file before any of its data are read: whether it contains only what cubes consist of.

A cube from elsewhere may be made to read other files (links, external storage, virtual data), to fill the memory (small
files that declare large variables), or to pass unexpected types to other code. Such files are refused by their
metadata, without reading any data. Nothing in a cube is ever executed. Whether the HDF5 library itself survives
arbitrary bytes cannot be ensured here, except for what was seen to occur (:mod:`rcstudy.storage.heaps`).
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np
from h5py import h5a, h5d, h5g, h5l, h5o, h5t, h5z

from rcstudy.storage.heaps import Chunk, chunks_of, damaged_heap
from rcstudy.storage.layout import SCHEMA_ATTRIBUTE
from rcstudy.storage.lock import UNSUPPORTED
from rcstudy.studyfile.yamltree import shorten

MAX_DIMENSIONS = 65_536
MAX_CHUNK_BYTES = 4096 * 4096 * 8  # a case's field at the largest mesh
_SMALL_BYTES = 16_000_000  # declared size up to which a variable may be stored in any number of bytes, even none
_LARGEST_RATIO = 1100  # declared over stored size: the largest ratio of deflate (1032) plus a margin
_CLASSES = (h5t.INTEGER, h5t.FLOAT, h5t.STRING)
_FILTERS = (h5z.FILTER_DEFLATE, h5z.FILTER_SHUFFLE, h5z.FILTER_FLETCHER32)
OTHERS_MARKS = (b"_NCProperties", b"_Netcdf4Coordinates", b"_nc3_strict")  # attributes by which netCDF's libraries sign
_BY_OTHERS = "was saved by another program, such as xarray: only files that sweep or merge wrote are cubes"


def reason_of(error: OSError) -> str:
    """The reason, in words, why HDF5 does not open a file."""
    if isinstance(error, BlockingIOError):
        return "another program has it open for writing"
    if error.errno is not None and error.errno > 0:  # netCDF's own error numbers are negative
        more = " on its file system: set HDF5_USE_FILE_LOCKING=FALSE" if _is_of_locks(error) else ""
        return f"{os.strerror(error.errno)}{more}"
    return "it is no file of HDF5, or damaged"


def _is_of_locks(error: OSError) -> bool:
    """Whether HDF5 does not open a file because its file system has no locks."""
    return error.errno in UNSUPPORTED and "unable to lock file" in str(error)


def opened(path: Path) -> h5py.File:
    """The HDF5 file `path`, opened for reading; without HDF5's lock where the file system has no locks (NFS may not).

    HDF5 itself goes on without one only where the system does not know the call at all. Raises OSError and others.
    """
    try:
        return h5py.File(path, "r")
    except OSError as error:
        # the second: this process has it open already, and without a lock
        if not _is_of_locks(error) and "file locking flag values don't match" not in str(error):
            raise
        return h5py.File(path, "r", locking=False)


def foreign_content(path: Path) -> str:
    """Description of something in the HDF5 file `path` that no cube contains; "" if there is nothing.

    Raises OSError if the file cannot be read, or its texts could not.
    """
    return next(_problems_of_file(path, opened), "")


def unsafe_content(path: Path) -> tuple[str, bool]:
    """As `foreign_content`, but what another program saved of a cube is let pass; and whether there is any such."""
    signed = False
    for problem in _problems_of_file(path, h5py.File):  # whose caller opens it with locks
        if not problem.endswith(_BY_OTHERS):
            return problem, signed
        signed = True
    return "", signed


def _problems_of_file(path: Path, opening: Callable[[Path], h5py.File]) -> Iterator[str]:
    chunks: list[Chunk] = []
    with opening(path) as file:
        if SCHEMA_ATTRIBUTE not in file.attrs:
            yield f"it has no attribute {SCHEMA_ATTRIBUTE}"
        yield from (f"/ {problem}" for problem in _problems_of_attributes(file.id))
        yield from _problems_of_group(file.id, "", 0, chunks)
    if damaged_heap(path, chunks):
        raise OSError("a heap of texts in it is damaged")


def _problems_of_group(group: h5g.GroupID, name: str, depth: int, chunks: list[Chunk]) -> Iterator[str]:
    """Descriptions of what no cube has in a group; the chunks of its variables are added to `chunks`."""
    names: list[bytes] = []
    group.links.iterate(names.append)
    for key in names:
        shown = f"{name}/{key.decode('utf-8', 'replace')}"
        kind = group.links.get_info(key).type
        if kind != h5l.TYPE_HARD:
            yield f"{shown} is a link to elsewhere"
            continue
        found = h5o.open(group, key)
        if isinstance(found, h5d.DatasetID | h5g.GroupID):
            yield from (f"{shown} {problem}" for problem in _problems_of_attributes(found))
        if isinstance(found, h5d.DatasetID):
            yield from (f"{shown} {problem}" for problem in _problems_of_variable(found))
            chunks += chunks_of(found)
        elif not isinstance(found, h5g.GroupID):
            yield f"{shown} is neither a group nor a variable"
        elif depth:
            yield f"{shown} is a group within a group"
        else:
            yield from _problems_of_group(found, shown, depth + 1, chunks)


def _problems_of_attributes(owner: h5d.DatasetID | h5g.GroupID) -> Iterator[str]:
    """Descriptions of attributes that no cube has.

    Attributes that only the netCDF library reads are included, as it crashes on some of them.
    """
    names: list[bytes] = []
    h5a.iterate(owner, names.append)
    for name in names:
        attribute = h5a.open(owner, name)
        kind = attribute.get_type()
        if name == b"_Netcdf4Dimid":
            if kind.get_class() != h5t.INTEGER or attribute.shape != () or kind.get_size() > 4:
                yield "has no proper number of a dimension"
                continue
            number = np.zeros((), dtype="i8")
            attribute.read(number)
            if not 0 <= number < MAX_DIMENSIONS:
                yield "has no proper number of a dimension"
        elif name == b"DIMENSION_LIST":
            if kind.get_class() != h5t.VLEN or attribute.shape != (len(owner.shape),):
                yield "has no proper list of dimensions"
        elif name == b"REFERENCE_LIST":
            if kind.get_class() != h5t.COMPOUND:
                yield "has no proper list of references"
        elif kind.get_class() not in _CLASSES or len(attribute.shape) > 1:
            yield f"has an attribute {shorten(name.decode('utf-8', 'replace'))} that is neither numbers nor text"
        elif name in OTHERS_MARKS:
            yield _BY_OTHERS
        elif name in (b"CLASS", b"NAME") and (kind.get_class() != h5t.STRING or attribute.shape != ()):
            yield "is no proper dimension"
    # h5netcdf before 1.7.1 signs what it adds to a file with nothing but dimensions' numbers on variables
    if b"_Netcdf4Dimid" in names and b"CLASS" not in names:
        yield _BY_OTHERS


def _problems_of_variable(variable: h5d.DatasetID) -> Iterator[str]:
    """Descriptions of properties that no variable of a cube has."""
    kind = variable.get_type()
    if kind.get_class() not in _CLASSES:
        yield "holds neither numbers nor text"
    made = variable.get_create_plist()
    layout = made.get_layout()
    if layout == h5d.VIRTUAL or made.get_external_count():
        yield "keeps its data elsewhere"
    if any(made.get_filter(k)[0] not in _FILTERS for k in range(made.get_nfilters())):
        yield "is compressed in an unknown way"
    shape = variable.shape
    if shape is None:
        yield "holds nothing"
        return
    if shape == ():  # grids have an axis at least; libraries sign no variable that they add without dimensions
        yield f"has no dimensions: it {_BY_OTHERS}"
    size = kind.get_size()
    if layout == h5d.CHUNKED and math.prod(made.get_chunk()) * size > MAX_CHUNK_BYTES:
        yield "has chunks larger than any case's field"
    # the field of each case is read by itself, and there are as many cases as labels: a variable that declares fields
    # of all cases may be large and empty. Any other variable is read as a whole.
    field = layout == h5d.CHUNKED and len(shape) >= 2 and made.get_chunk()[-2:] == shape[-2:]
    declared = math.prod(shape) * size
    if not field and declared > max(_SMALL_BYTES, _LARGEST_RATIO * variable.get_storage_size()):
        yield f"declares {declared / 1e9:.3g} GB and holds {variable.get_storage_size()} bytes"
