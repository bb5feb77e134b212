"""Units: files of a sweep's results as they are solved, each complete or absent.

A unit is a line that names the format, a JSON head, the cases one after another, and the SHA-256 of all before it. Of
each case it holds the key (the hash of scene, solver version and schema) and its record. It is written under a
temporary name in the same folder, closed, forced to the disk and renamed; after that it is never touched. Format and
checksum of a unit are verified before anything in it is used.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from rcstudy.mechanics import SOLVER_VERSION
from rcstudy.storage.publish import write_whole
from rcstudy.storage.record import FORM, Form

SUFFIX = ".unit"
_SET_ASIDE = ".set-aside"  # added to the names of those that are no units of this solver
FORMAT = "rcstudy unit 3"
_MAGIC = f"{FORMAT}\n".encode()
_HEAD = struct.Struct("<I")
_CASE = struct.Struct("<32sQ")  # key, length of the record
_DIGEST = 32
_NAME = re.compile(r"(\d{6,})-[0-9a-f]{12}" + re.escape(SUFFIX))


class BadUnit(ValueError):
    """A file that is not a whole unit of this solver; the message says why."""


@dataclass(frozen=True)
class Unit:
    """A unit on the disk, found to be whole: `entries` are key, offset and length of each record in it.

    `form` is that of its records, `study` the name of the study that it was written for.
    """

    path: Path
    form: Form
    entries: tuple[tuple[str, int, int], ...]
    size: int
    study: str


def write_unit(folder: Path, number: int, cases: Sequence[tuple[str, bytes]], study: str) -> Unit:
    """Write the records of `cases` (key, record) of `study` as unit `number`.

    Raises OSError when that fails, leaving nothing.
    """
    head = {"solver": SOLVER_VERSION, "study": study, "scalars": FORM.scalars, "fields": FORM.fields}
    text = json.dumps(head).encode()
    parts = [_MAGIC, _HEAD.pack(len(text)), text]
    at = sum(map(len, parts))
    entries = []
    for key, record in cases:
        parts += [_CASE.pack(bytes.fromhex(key), len(record)), record]
        entries.append((key, at + _CASE.size, len(record)))
        at += _CASE.size + len(record)
    content = b"".join(parts)  # in one piece: other threads go on while it is hashed and written
    digest = hashlib.sha256(content)
    path = folder / f"{number:06d}-{digest.hexdigest()[:12]}{SUFFIX}"
    write_whole(path, (content, digest.digest()))
    return Unit(path, FORM, tuple(entries), at + _DIGEST, study)


def read_unit(path: Path) -> tuple[Unit, bytes]:
    """The unit at `path`, checked from its first byte to its last, and these bytes.

    Raises BadUnit when it is damaged, of another solver or none at all, OSError when it cannot be read.
    """
    data = path.read_bytes()
    if not data.startswith(_MAGIC):
        raise BadUnit("not a unit of rcstudy, or of another version")
    if len(data) < len(_MAGIC) + _HEAD.size + _DIGEST or hashlib.sha256(data[:-_DIGEST]).digest() != data[-_DIGEST:]:
        raise BadUnit("damaged: its checksum does not match")
    try:
        (size,) = _HEAD.unpack_from(data, len(_MAGIC))
        start = len(_MAGIC) + _HEAD.size
        head = json.loads(data[start : start + size])
        solver, study = str(head["solver"]), str(head["study"])
        form = Form(tuple(map(str, head["scalars"])), tuple(map(str, head["fields"])))
        entries = tuple(_entries(data, start + size))
    except (ValueError, KeyError, TypeError, struct.error, RecursionError) as error:
        raise BadUnit(f"not a proper unit: {error}") from error
    if solver != SOLVER_VERSION:
        raise BadUnit(f"of solver version {solver}, this is {SOLVER_VERSION}")
    return Unit(path, form, entries, len(data), study), data


def _entries(data: bytes, at: int) -> Iterator[tuple[str, int, int]]:
    end = len(data) - _DIGEST
    while at < end:
        key, length = _CASE.unpack_from(data, at)
        at += _CASE.size
        if length > end - at:
            raise ValueError("a case is longer than the file")
        yield key.hex(), at, length
        at += length


def unit_paths(folder: Path) -> list[Path]:
    """Files of `folder` that are called units, in the order in which they were written; folders are none."""
    return sorted(_files(folder, SUFFIX), key=lambda p: (number_of(p), p.name))


def paths_set_aside(folder: Path) -> list[Path]:
    """Files of `folder` that were called units and have been set aside."""
    return _files(folder, f"{SUFFIX}{_SET_ASIDE}")


def set_aside(path: Path) -> Path:
    """Rename a file so that it is called a unit no more; returns where it is then."""
    return path.rename(path.with_name(f"{path.name}{_SET_ASIDE}"))


def _files(folder: Path, suffix: str) -> list[Path]:
    if not folder.is_dir():
        return []
    with os.scandir(folder) as inside:
        return [folder / entry.name for entry in inside if entry.name.endswith(suffix) and not entry.is_dir()]


def number_of(path: Path) -> int:
    """The number in a unit's name; -1 where there is none."""
    match = _NAME.fullmatch(path.name)
    return int(match[1]) if match else -1
