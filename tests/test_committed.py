"""Cubes that are committed say how they were made, and nothing of the machine that they were made on."""

from __future__ import annotations

import re
from pathlib import Path

import h5py
import pytest

ROOT = Path(__file__).parent.parent
CUBES = sorted(path.relative_to(ROOT) for folder in ("results", "tests") for path in (ROOT / folder).rglob("*.nc"))
PATH = re.compile(r"(?<![\w.:/)\]}<])(?:~?/\w|[A-Za-z]:[\\/]\w)[^\s'\",;]*")
"""A path from the root of a file system, or from someone's home."""


def test_paths_are_found_in_texts() -> None:
    text = "rcstudy sweep a/b.yaml -o /tmp/x.nc --store=/var/y, ~/z or C:\\w; rad/mm, N / mm, doi:10.1007/s1, https://a.b/c"
    assert PATH.findall(text) == ["/tmp/x.nc", "/var/y", "~/z", "C:\\w"]


def test_there_are_committed_cubes() -> None:
    assert {str(path) for path in CUBES} >= {"tests/reference/small.nc", "results/accuracy/accuracy.nc"}


@pytest.mark.parametrize("path", CUBES, ids=str)
def test_committed_cubes_hold_no_path_of_a_machine(path: Path) -> None:
    """Made from the folder of the project, with paths as from there."""
    with h5py.File(ROOT / path) as cube:
        texts = {name: value.decode() if isinstance(value, bytes) else str(value) for name, value in cube.attrs.items()}
    assert {name: found for name, text in texts.items() if (found := PATH.findall(text))} == {}
