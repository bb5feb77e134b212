"""Cubes that are committed say how they were made, and nothing of the machine that they were made on."""

from __future__ import annotations

import re
from pathlib import Path

import h5py
import pytest

ROOT = Path(__file__).parent.parent
CUBES = [*sorted((ROOT / "tests" / "reference").glob("*.nc")), ROOT / "results" / "accuracy" / "accuracy.nc"]
"""Those that .gitignore lets through; a user's own cubes may lie beside them."""
PATH = re.compile(r"(?<![\w.:/)\]}<])(?:~?/\w|[A-Za-z]:[\\/]\w)[^\s'\",;]*")
"""A path from the root of a file system, or from someone's home."""


def test_paths_are_found_in_texts() -> None:
    text = "rcstudy sweep a/b.yaml -o /tmp/x.nc --store=/var/y, ~/z or C:\\w; rad/mm, N / mm, doi:10.1007/s1, https://a.b/c"
    assert PATH.findall(text) == ["/tmp/x.nc", "/var/y", "~/z", "C:\\w"]


def test_there_are_committed_cubes() -> None:
    assert ROOT / "tests" / "reference" / "small.nc" in CUBES
    assert all(path.is_file() for path in CUBES)


@pytest.mark.parametrize("path", CUBES, ids=lambda path: path.name)
def test_committed_cubes_hold_no_path_of_a_machine(path: Path) -> None:
    """Made from the folder of the project, with paths as from there."""
    with h5py.File(path) as cube:
        texts = {name: value.decode() if isinstance(value, bytes) else str(value) for name, value in cube.attrs.items()}
    assert {name: found for name, text in texts.items() if (found := PATH.findall(text))} == {}
