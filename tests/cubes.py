"""Cubes from results at hand; two held to be the same to the last bit, but for times and what is told of the run."""

from __future__ import annotations

import functools
import itertools
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from rcstudy.result import VARIABLES, Result
from rcstudy.storage.cube_writer import writing
from rcstudy.storage.layout import CHECKSUM
from rcstudy.storage.record import Keep, Packer, Record, parse

if TYPE_CHECKING:
    from rcstudy.cases import Case, Expansion
    from rcstudy.study import Study

HISTORY = ("created", "command", "wall_seconds", "git_revision", CHECKSUM)
TIMINGS = tuple(name for name, variable in VARIABLES.items() if variable.timing)


AT_ONCE = 16  # cases handed to HDF5 before it is asked how it goes


def write_cube(
    path: Path | str,
    study: Study,
    expansion: Expansion,
    results: Iterable[tuple[Case, Result | Record]],
    provenance: Mapping[str, str | int | float],
    *,
    started: float | None = None,
) -> None:
    """Write all results of a study to a netCDF-4 file at `path`, replacing what is there only when all is written.

    `results` may be lazy and come in any order; each case of `expansion` exactly once. The file is created before
    the first result is asked for, so an unwritable place is found out early.

    Raises UserError when the file cannot be written, ValueError when a case has no result, two, or one whose
    names or shapes are not those of its grid.
    """
    started = time.monotonic() if started is None else started
    packer = Packer(Keep(study.outputs.fields, study.outputs.precision))
    with writing(path, study, expansion) as cube:
        records = ((case, _record(packer, case, r) if isinstance(r, Result) else r) for case, r in results)
        while some := list(itertools.islice(records, AT_ONCE)):
            cube.add(some)
            del some
        cube.finish(provenance, started)


def _record(packer: Packer, case: Case, result: Result) -> Record:
    try:
        return parse(packer.pack(result, case.scene.mesh.cells).body)
    except ValueError as error:
        raise ValueError(f"{case.grid}, case {case.index}: {error}") from error


def content(path: Path) -> dict[str, object]:
    """All attributes and values of a cube by path, as bytes where they are numbers; fields as they are compressed."""
    state = path.stat()
    return _content(path, state.st_ino, state.st_mtime_ns, state.st_size)


@functools.lru_cache(maxsize=16)  # one cube is what many are held against
def _content(path: Path, *state: int) -> dict[str, object]:
    found: dict[str, object] = {}

    def take(name: str, node: h5py.Group | h5py.Dataset) -> None:
        for key, value in node.attrs.items():
            if key not in (*HISTORY, "DIMENSION_LIST", "REFERENCE_LIST"):
                found[f"{name}@{key}"] = np.asarray(value).tobytes() if not isinstance(value, str) else value
        if not isinstance(node, h5py.Dataset) or name.rpartition("/")[2] in TIMINGS:
            return
        found[f"{name} shape"] = node.shape
        if node.dtype.kind == "O":
            found[name] = [text.decode() for text in node[...].reshape(-1)]
        elif node.chunks is None:
            found[name] = node[...].tobytes()
        else:
            for k in range(node.id.get_num_chunks()):
                at = node.id.get_chunk_info(k).chunk_offset
                found[f"{name} {at}"] = node.id.read_direct_chunk(at)[1]

    with h5py.File(path, "r") as file:
        take("", file)
        file.visititems(take)
    return found


def assert_same(one: Path, two: Path) -> None:
    """Both cubes hold the same bits."""
    ours, theirs = content(one), content(two)
    assert ours.keys() == theirs.keys()
    differ = [key for key in ours if ours[key] != theirs[key]]
    assert not differ, differ[:5]
    assert len(ours) > 50
