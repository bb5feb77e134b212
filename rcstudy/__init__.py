"""Batch parameter studies of three-dimensional rolling contact of bodies with elastic layers.

``solve(scene)`` solves one contact, ``open(path)`` opens a cube of results; both raise ``UserError`` for input that a
user can put right. The command line does the rest. Nothing heavy is imported before it is used.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

    from rcstudy.errors import UserError

    __version__: str

__all__ = ["UserError", "__version__", "open", "solve"]


def solve(scene: Mapping[str, Any]) -> xr.Dataset:
    """Solve one scene: a mapping with the keys of a study's ``scene:`` (N, mm, MPa, rad).

    Returns a Dataset with the names and units of a cube, fields over x, y. Look at its ``status`` first: 0 is
    solved, anything else is no result, and ``status_reason`` says why. Raises UserError for a scene that is not
    valid, before anything is computed.
    """
    from rcstudy.cube import to_dataset
    from rcstudy.solve import solve_scene
    from rcstudy.study import scene_from_mapping

    stated = scene_from_mapping(scene)
    return to_dataset(stated, solve_scene(stated))


def open(path: str | Path, *, chunked: bool = False) -> xr.DataTree:
    """Open a cube lazily; close it after use, or use it in a ``with`` block. See :func:`rcstudy.cube.open_cube`.

    `chunked`: fields as dask arrays, one chunk for each field of each case; needs dask.

    Raises UserError when the file is missing, unreadable, not an rcstudy cube, or one of another layout, and when there
    is no dask for chunks.
    """
    from rcstudy.cube import open_cube

    return open_cube(path, chunked=chunked)


if not TYPE_CHECKING:  # which would take any name for one of the package's

    def __getattr__(name: str) -> Any:
        if name == "__version__":
            from rcstudy.provenance import version

            return version("rcstudy")
        if name == "UserError":
            from rcstudy.errors import UserError

            return UserError
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


class _Package(ModuleType):
    """Type of the package: its function `solve` is not replaced when the module of that name is imported."""

    def __setattr__(self, name: str, value: object) -> None:
        if name == "solve" and isinstance(value, ModuleType):
            return
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
