"""Check of the global heaps of an HDF5 file, where its texts of any length and its lists of dimensions are.

The HDF5 library goes through a heap from object to object and never ends at one without size, such as those of a sector
of zeros. No signal that Python handles stops it, so damaged heaps are looked for before any text is read.
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from pathlib import Path

from h5py import h5d

# HDF5 File Format Specification 3.0, section III.E: signature, version and three reserved bytes; then its size
_HEAD = b"GCOL\x01\0\0\0"
_SIZE = struct.Struct("<Q")  # as in all files that h5py writes
_OBJECT = struct.Struct("<H6xQ")  # before the data of an object: index, number of references, reserved; then its size
_ALIGNED = 8  # heaps begin, and their objects end, at multiples
_LEAST = 4096  # bytes of a heap

Chunk = tuple[int, int]
"""Offset and size of a chunk in a file."""


def chunks_of(variable: h5d.DatasetID) -> list[Chunk]:
    """The chunks in which a variable is stored."""
    found: list[Chunk] = []
    if variable.get_create_plist().get_layout() == h5d.CHUNKED:
        variable.chunk_iter(lambda chunk: found.append((chunk.byte_offset, chunk.size)))
    return found


def damaged_heap(path: Path, chunks: list[Chunk]) -> bool:
    """Whether the HDF5 file `path` has a global heap that the HDF5 library would not get to the end of.

    `chunks`: those of all its variables, in which there are no heaps.
    """
    with path.open("rb") as file:
        try:
            data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        except OSError:  # of some file systems; HDF5 reads such files, too
            return False
        with data:
            return any(not _has_end(data, heap) for heap in _heaps(data, chunks))


def _heaps(data: mmap.mmap, chunks: list[Chunk]) -> Iterator[int]:
    """Offsets of all global heaps. Only what is outside of the `chunks` is read."""
    begin = 0
    for offset, size in [*sorted(chunks), (len(data), 0)]:
        at = data.find(_HEAD, begin, offset) if offset - begin >= _LEAST else -1
        while at >= 0:
            if at % _ALIGNED == 0:
                yield at
            at = data.find(_HEAD, at + 1, offset)
        begin = max(begin, offset + size)


def _has_end(data: mmap.mmap, heap: int) -> bool:
    """Whether the objects of the heap at the offset `heap` lead to its end.

    Object 0 is what is free; its size includes its own head.
    """
    at = heap + len(_HEAD) + _SIZE.size
    if at > len(data):
        return False
    end = heap + _SIZE.unpack_from(data, heap + len(_HEAD))[0]
    if not at <= end <= len(data):
        return False
    while at + _OBJECT.size <= end:
        index, size = _OBJECT.unpack_from(data, at)
        step = _OBJECT.size + -(-size // _ALIGNED) * _ALIGNED if index else size
        if step < _OBJECT.size:
            return False
        at += step
    return bool(at <= end)
