"""Two cubes held to be the same to the last bit, but for times and what is told of the run."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from rcstudy.layout import CHECKSUM
from rcstudy.result import VARIABLES

HISTORY = ("created", "command", "wall_seconds", "git_revision", CHECKSUM)
TIMINGS = tuple(name for name, variable in VARIABLES.items() if variable.timing)


def content(path: Path) -> dict[str, object]:
    """All attributes and values of a cube by path, as bytes where they are numbers; fields as they are compressed."""
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
