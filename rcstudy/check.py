"""Damage to a cube: what cannot be read, and what has changed since it was written, with how to repair it.

Changes are found in numbers and labels, in the root's table of all cases, and in whatever the cube's study states.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from rcstudy.cases import expand
from rcstudy.cube import case_dims, changed_grids, grids, illegible
from rcstudy.errors import UserError
from rcstudy.result import VARIABLES
from rcstudy.storage.layout import CASE_KEY, GRID, LABEL, MISSING, SETTINGS, Layout, cells_of_centres, lay_out
from rcstudy.structure import COORDINATE_RTOL, MEANINGS
from rcstudy.study import study_from_text

_SHOWN_FAULTS = 20
_ONCE_EDITED = "once the study file is edited, if only by a comment"
_CHANGED = "not as its study states, changed after writing"
_OF_STUDY = ("study", "title", "description", "study_text", "study_sha256")  # attributes of the root
_IN_TABLE = (LABEL, CASE_KEY, *SETTINGS, *(name for name, v in VARIABLES.items() if v.kind != "field"))


def changes(tree: xr.DataTree) -> list[str]:
    """Groups of an opened cube whose numbers are not those written, in words; no fields are read.

    Those of a grid are checked by its checksum, those of the table of all cases against the grids'.
    """
    told = [f"grid {name}: checksum mismatch: its numbers were changed after writing" for name in changed_grids(tree)]
    if wrong := _wrong_in_table(tree):
        told.append(f"table of all cases: {', '.join(wrong)}: not as in the grids, changed after writing")
    return told


def _wrong_in_table(tree: xr.DataTree) -> list[str]:
    """The variables of the table of all cases that are missing or do not repeat those of the grids."""
    found = grids(tree)
    if "axes" in tree.attrs:  # a single grid, which needs no table
        return []
    wrong = []
    for name in (GRID, *(name for name in _IN_TABLE if any(name in grid.variables for grid in found.values()))):
        if name not in tree.dataset.variables:
            wrong.append(name)
            continue
        stored = tree.dataset[name].values
        expected = [_in_cases(name, key, grid, stored.dtype) for key, grid in found.items()]
        if not _equal(stored, np.concatenate(expected)):
            wrong.append(name)
            if name == GRID:  # other rows than cases: all else differs as well
                break
    return wrong


def _in_cases(name: str, key: str, grid: xr.Dataset, dtype: np.dtype) -> np.ndarray:
    """Variable `name` in all cases of the grid called `key`; the missing value of `dtype` where it has none."""
    dims = case_dims(grid)
    shape = tuple(grid.sizes[dim] for dim in dims)
    if name == GRID:
        values = np.full(shape, key, dtype=object)
    elif name in grid.variables:
        values = grid.variables[name].set_dims(dict(zip(dims, shape, strict=True))).values
    else:
        values = np.full(shape, {"f": np.nan, "i": MISSING}.get(dtype.kind, ""), dtype=dtype)
    return values.reshape(-1)


def _equal(stored: np.ndarray, expected: np.ndarray, rtol: float = 0.0) -> bool:
    if stored.shape != expected.shape:
        return False
    if {stored.dtype.kind, expected.dtype.kind} <= set("fi"):
        return bool(np.allclose(stored, expected, rtol=rtol, atol=0.0, equal_nan=True))
    return bool(np.array_equal(stored.astype(str), expected.astype(str)))


def damage(path: Path, tree: xr.DataTree, changed: Sequence[str]) -> list[str]:
    """All damage to the cube at `path`, opened as `tree`, in lines, with how to repair it; nothing if there is none.

    `changed`: lines on the :func:`changes`. All fields are read.
    """
    lines = [*changed, *(f"{path}: {fault}" for fault in _unlike_study(tree))]
    if any("checksum mismatch" in line for line in changed):
        lines.append("rcstudy sweep solves all cases again: it takes none from a cube whose checksum does not match")
    elif "study" not in tree.attrs:
        lines.append("rcstudy sweep does not replace a cube that names no study: choose another --output")
    elif lines:
        lines.append(f"rcstudy sweep writes the cube again from its cases {_ONCE_EDITED}")
    faults = list(illegible(path))
    if "" in faults:
        faults.remove("")
        lines.append(f"{path}: HDF5 fails to read it as a whole: an error of the disk, or damage: try again")
    if faults:
        lines.append(f"{path}: damaged, cannot be read:")
        lines += [f"  {fault}" for fault in faults[:_SHOWN_FAULTS]]
        lines += [f"  {len(faults) - _SHOWN_FAULTS} more"] if len(faults) > _SHOWN_FAULTS else []
        lines.append(f"rcstudy sweep solves these cases again {_ONCE_EDITED}: all others are taken from the cube")
    return lines


def _unlike_study(tree: xr.DataTree) -> list[str]:
    """Whatever is missing from an opened cube, or other than its study's text states, in words; no fields are read.

    Of what the text states, name and description of the study, the numbers of settings and axes, labels, the cells'
    centres and the units and meanings of all variables are compared. Nothing is known of a cube with a text that this
    version does not understand.
    """
    if missing := [name for name in _OF_STUDY if name not in tree.attrs]:
        return [f"attributes {', '.join(missing)}: missing: what depends on its study is not checked"]
    text = str(tree.attrs["study_text"])
    if hashlib.sha256(text.encode()).hexdigest() != tree.attrs["study_sha256"]:
        return ["the text of its study was changed after writing"]
    try:
        study = study_from_text(text, "")
    except UserError:
        return []
    stated = {"study": study.name, "title": study.name, "description": study.description}
    other = [name for name, value in stated.items() if str(tree.attrs[name]) != value]
    told = [f"attributes {', '.join(other)}: {_CHANGED}"] if other else []
    outputs = study.outputs
    layouts, root = lay_out(expand(study), fields=outputs.fields, precision=outputs.precision)
    found = grids(tree)
    told += [] if root is None else _unlike("table of all cases", tree.dataset, root)
    for layout in layouts:
        if layout.name in found:
            told += _unlike(f"grid {layout.name}", found[layout.name], layout)
        else:
            told.append(f"grid {layout.name}: missing")
    return told


def _cells_among(stored: np.ndarray, whole: np.ndarray, meshes: Sequence[bytes], rtol: float) -> bool:
    """Whether the cells' centres `stored` [..., n] of each case are neighbours among those of its `whole` window.

    Which cells are stored depends on results, but not on the case if `meshes`, a name of each case's mesh, are the
    same: windows alike along x may differ along y. Missing ones, of windows with fewer cells than others, are nan, at
    the end.
    """
    if stored.dtype.kind != "f" or stored.shape[:-1] != whole.shape[:-1] or not stored.size:
        return False
    of_mesh: dict[bytes, tuple[int, int]] = {}
    rows = (stored.reshape(-1, stored.shape[-1]), whole.reshape(-1, whole.shape[-1]))
    for centres, window, mesh in zip(*rows, meshes, strict=True):
        cells = cells_of_centres(centres, window, rtol)
        if cells is None or of_mesh.setdefault(mesh, cells) != cells:
            return False
    return max(last - first for first, last in of_mesh.values()) == stored.shape[-1]


def _meshes(layout: Layout) -> list[bytes]:
    """A name of the mesh of each case, of its centres along x and y; a single one where all cases have the same."""
    along = [item.values for item in layout.items if item.coordinate and {"x", "y"} & set(item.dims)]
    rows = [values.reshape(-1, values.shape[-1]) for values in along if values is not None]
    return [row.tobytes() for row in np.concatenate(rows, axis=-1)] if rows else []


def _unlike(where: str, group: xr.Dataset, layout: Layout) -> Iterator[str]:
    """What is missing from a group, or not as laid out."""
    missing = [item.name for item in layout.items if item.name not in group.variables]
    if missing:
        yield f"{where}: {', '.join(missing)}: missing"
    meshes = _meshes(layout)
    changed = []
    for item in layout.items:
        if item.values is None or item.name in missing or item.name == CASE_KEY:  # keys follow from the version, too
            continue
        if item.dtype == "str" and not layout.name:  # the table of all cases, whose texts are held against the grids'
            continue
        stored = group[item.name].values
        if {"x", "y"} & set(item.dims):
            same = _cells_among(stored, item.values, meshes, COORDINATE_RTOL)
        else:
            same = _equal(stored, item.values, COORDINATE_RTOL)
        if not same:
            changed.append(item.name)
    if changed:
        yield f"{where}: {', '.join(changed)}: {_CHANGED}"
    for attribute in MEANINGS:
        other = [
            item.name
            for item in layout.items
            if item.name not in missing and not _same(group[item.name].attrs.get(attribute), item.attrs.get(attribute))
        ]
        if other:
            yield f"{where}: {attribute} of {', '.join(other)}: changed after writing"


def _same(stored: object, expected: object) -> bool:
    """Whether two attributes are the same; None: there is none."""
    return bool(np.array_equal(np.asarray(stored), np.asarray(expected)))
