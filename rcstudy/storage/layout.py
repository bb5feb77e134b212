"""Layout of a cube: its groups, dimensions, coordinates, variables, attributes and case labels.

A study of one grid is one flat file. A study of several has a group per grid, and in the root a table of all
cases (dimension ``entry``), so that opening the file without options shows something useful. Knows nothing of
HDF5: :mod:`rcstudy.storage.cube_writer` writes what is laid out here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rcstudy.errors import UserError
from rcstudy.mechanics.exact import Hertz
from rcstudy.mechanics.scene import Layer, Mesh, Scene
from rcstudy.result import VARIABLES, Variable
from rcstudy.settings import DESCRIPTIONS
from rcstudy.storage.record import Region, field_type
from rcstudy.studyfile.build import scene_hertz

if TYPE_CHECKING:
    from rcstudy.cases import Case, Expansion, Grid

SCHEMA_ATTRIBUTE = "rcstudy_schema"
"""Root attribute that marks a file as an rcstudy cube and holds the version of this layout."""

SCHEMA = 1
"""Version of the layout; goes up when a name, a dimension or the meaning of a variable changes."""

REFERENCES = "references"
"""Root attribute, as in the CF conventions: publications behind the numbers (`mechanics.literature.listed`)."""

MISSING = -1
"""Stored where an integer variable has no value (floats store NaN)."""

ENTRY = "entry"
LAYER = "layer"
LABEL = "label"
GRID = "grid"
CASE_KEY = "case_key"
CHECKSUM = "numbers_sha256"
"""Attribute of a grid: SHA-256 of keys, statuses, reasons and numbers of its cases, checked when these are reused."""


def as_floats(values: np.ndarray) -> np.ndarray:
    """Stored numbers of a variable as float64, NaN where there are none."""
    floats = values.astype(np.float64)
    return np.where(values == MISSING, np.nan, floats) if values.dtype.kind in "iu" else floats


@dataclass(frozen=True)
class Item:
    """One variable of a group.

    `dtype` is a numpy type code, or ``"str"`` for variable-length text. `values` holds what is known before any
    case is solved; None means that it comes from the results. `field` marks variables stored a case at a time.
    """

    name: str
    dims: tuple[str, ...]
    dtype: str
    attrs: dict[str, Any]
    values: np.ndarray | None = None
    field: bool = False
    coordinate: bool = False


@dataclass(frozen=True)
class Layout:
    """One group: `dims` with their sizes, case dimensions first, and its `items`; `attrs` of the group."""

    name: str
    case_dims: tuple[str, ...]
    dims: dict[str, int]
    items: tuple[Item, ...]
    attrs: dict[str, Any]

    @property
    def case_shape(self) -> tuple[int, ...]:
        """Sizes of the case dimensions."""
        return tuple(self.dims[d] for d in self.case_dims)

    def __getitem__(self, name: str) -> Item:
        """The item called `name`; KeyError if there is none."""
        for item in self.items:
            if item.name == name:
                return item
        raise KeyError(name)


@dataclass(frozen=True)
class _Setting:
    """A number of the scene stored with each case."""

    units: str
    long_name: str
    value: Callable[[Scene, Hertz], float]
    tangential: bool = False

    @property
    def attrs(self) -> dict[str, Any]:
        """Attributes of the variable."""
        return {"long_name": self.long_name, "units": self.units}


def _creepage(name: str) -> Callable[[Scene, Hertz], float]:
    return lambda scene, _: getattr(scene.creepage, name) if scene.creepage is not None else np.nan


SETTINGS: dict[str, _Setting] = {
    "friction": _Setting(*DESCRIPTIONS["friction"], lambda s, _: s.friction),
    "load": _Setting(*DESCRIPTIONS["load"], lambda s, _: s.load),
    "hertz_radius": _Setting("mm", "contact radius of the uncoated pair after Hertz", lambda _, h: h.radius),
    "hertz_pressure": _Setting("MPa", "peak pressure of the uncoated pair after Hertz", lambda _, h: h.p0),
    **{
        name: _Setting(*DESCRIPTIONS[name], _creepage(name), tangential=True)
        for name in ("longitudinal", "lateral", "spin")
    },
}

LAYER_SETTINGS: dict[str, tuple[str, str, Callable[[Layer], float]]] = {
    "layer_modulus": ("MPa", "Young's modulus of each layer, from the surface down", lambda layer: layer.E),
    "layer_nu": ("1", "Poisson's ratio of each layer, from the surface down", lambda layer: layer.nu),
    "layer_thickness": ("mm", "thickness of each layer, from the surface down", lambda layer: layer.thickness),
}


CENTRE_ATTRS = {
    dim: {"long_name": f"{word} position of the cell's centre", "units": "mm"}
    for dim, word in (("x", "longitudinal"), ("y", "lateral"))
}
"""Attributes of the coordinates x and y."""


def missing_values(dtype: str, shape: tuple[int, ...]) -> np.ndarray:
    """An array of missing values of an item's `dtype`: NaN, MISSING, or empty text."""
    if dtype == "str":
        return np.full(shape, "", dtype=object)
    return np.full(shape, np.nan if dtype.startswith("f") else MISSING, dtype=dtype)


def variable_attrs(variable: Variable) -> dict[str, Any]:
    """Attributes of a variable of the catalogue: units, long_name, and the values and meanings of an enumeration."""
    attrs: dict[str, Any] = {"long_name": variable.long_name, "units": variable.units}
    if variable.enum is not None:
        members = [(m.value, m.name.lower()) for m in variable.enum]
        if variable.kind == "field":
            members.insert(0, (MISSING, "not_computed"))
        attrs["flag_values"] = np.array([value for value, _ in members], dtype=variable.dtype)
        attrs["flag_values"].setflags(write=False)  # Datasets share it
        attrs["flag_meanings"] = " ".join(name for _, name in members)
    elif variable.dtype.startswith("i"):
        attrs["comment"] = f"{MISSING} where not computed"
    return attrs


def case_label(grid: Grid, index: Sequence[int]) -> str:
    """Name of a case within its grid, such as ``thickness=0.25 a, modulus=2 Es, creepage=b``."""
    parts = []
    for axis, i in zip(grid.axes, index, strict=True):
        parts.append(axis.labels[i] if axis.name == "case" else f"{axis.name}={axis.labels[i]}")
    return ", ".join(parts)


def _coordinate_items(grid: Grid) -> Iterator[Item]:
    for axis in grid.axes:
        for name, coord in axis.coords.items():
            values = np.asarray(coord.values)
            text = values.dtype.kind in "UOST"
            attrs = {"long_name": coord.long_name or name, "units": coord.units or "1"}
            values = values.astype(object if text else "i8" if values.dtype.kind in "iu" else "f8")
            dtype = "str" if text else values.dtype.str[1:]
            yield Item(name, (axis.name,), dtype, attrs, values, coordinate=True)


def _setting_items(case_dims: tuple[str, ...], shape: tuple[int, ...], cases: Sequence[Case]) -> Iterator[Item]:
    tangential = any(case.scene.creepage is not None for case in cases)
    known = [scene_hertz(case.scene) for case in cases]
    for name, setting in SETTINGS.items():
        if setting.tangential and not tangential:
            continue
        values = np.empty(shape)
        for case, solution in zip(cases, known, strict=True):
            values[case.index] = setting.value(case.scene, solution)
        yield Item(name, case_dims, "f8", setting.attrs, values)
    keys = np.empty(shape, dtype=object)
    for case in cases:
        keys[case.index] = case.key
    attrs = {"long_name": "content hash of the case: scene, solver version, schema", "units": "1"}
    yield Item(CASE_KEY, case_dims, "str", attrs, keys)


def _layer_items(case_dims: tuple[str, ...], shape: tuple[int, ...], cases: Sequence[Case]) -> Iterator[Item]:
    count = max(len(case.scene.layers) for case in cases)
    if count == 0:
        return
    attrs = {"long_name": "number of the layer, from the surface down", "units": "1"}
    yield Item(LAYER, (LAYER,), "i8", attrs, np.arange(1, count + 1), coordinate=True)
    for name, (units, long_name, value) in LAYER_SETTINGS.items():
        values = np.full((*shape, count), np.nan)
        for case in cases:
            for k, layer in enumerate(case.scene.layers):
                values[(*case.index, k)] = value(layer)
        yield Item(name, (*case_dims, LAYER), "f8", {"long_name": long_name, "units": units}, values)


def _mesh_items(
    case_dims: tuple[str, ...], shape: tuple[int, ...], cases: Sequence[Case], stored: Mapping[Mesh, Region]
) -> Iterator[Item]:
    """Coordinates x and y of the cells `stored` of each mesh; where the mesh varies, each case's centres instead."""
    first = cases[0].scene.mesh
    varies = any(case.scene.mesh != first for case in cases)
    for k, dim in enumerate(("x", "y")):
        attrs = CENTRE_ATTRS[dim]
        if not varies:
            yield Item(dim, (dim,), "f8", attrs, _centres(first, stored[first], k), coordinate=True)
            continue
        values = np.full((*shape, _most(stored, k)), np.nan)
        for case in cases:
            centres = _centres(case.scene.mesh, stored[case.scene.mesh], k)
            values[case.index][: centres.size] = centres
        yield Item(f"{dim}_centre", (*case_dims, dim), "f8", attrs, values, coordinate=True)


def _centres(mesh: Mesh, region: Region, k: int) -> np.ndarray:
    """Centres along x (k = 0) or y of the cells of `mesh` in `region`."""
    return mesh.centres[k][region[2 * k] : region[2 * k + 1]]


def cells_of_centres(centres: np.ndarray, window: np.ndarray, rtol: float = 0.0) -> tuple[int, int] | None:
    """The first cell of a `window` that is stored, and the one after the last, from the stored `centres` along an axis.

    None if these are no neighbours among the window's; nan at the end of either is left out. `rtol`: how far centres
    may be off, over themselves and over the cells' length.
    """
    centres, window = (values[: values.size - int(np.isnan(values).sum())] for values in (centres, window))
    if not centres.size or np.isnan(centres).any():
        return None
    first = int(np.argmin(np.abs(window - centres[0])))
    expected = window[first : first + centres.size]
    atol = rtol * float(np.ptp(window[:2]))
    if expected.size < centres.size or not np.allclose(centres, expected, rtol=rtol, atol=atol):
        return None
    return first, first + centres.size


def _most(stored: Mapping[Mesh, Region], k: int) -> int:
    """The largest number of cells along x (k = 0) or y that is stored of any mesh."""
    return max(region[2 * k + 1] - region[2 * k] for region in stored.values())


def regions(cases: Sequence[Case], cropped: Mapping[Mesh, Region] | None) -> dict[Mesh, Region]:
    """The cells stored of each mesh among `cases`: all of them, or those that `cropped` names (if it names any)."""
    stored = {}
    for mesh in {case.scene.mesh for case in cases}:
        i0, i1, j0, j1 = (cropped or {}).get(mesh, (0, 0, 0, 0))
        stored[mesh] = (i0, i1, j0, j1) if i0 < i1 and j0 < j1 else (0, mesh.cells[0], 0, mesh.cells[1])
    return stored


def result_items(
    case_dims: tuple[str, ...], *, tangential: bool, fields: bool, precision: str = "float64"
) -> Iterator[Item]:
    """The variables of the catalogue that a group holds, dimensions `case_dims` (fields: and x, y)."""
    for name, variable in VARIABLES.items():
        if variable.tangential and not tangential:
            continue
        if variable.kind != "field":
            yield Item(name, case_dims, variable.dtype, variable_attrs(variable))
        elif fields:
            yield Item(name, (*case_dims, "x", "y"), field_type(name, precision), variable_attrs(variable), field=True)


def grid_layout(
    grid: Grid,
    cases: Sequence[Case],
    *,
    fields: bool,
    precision: str,
    cropped: Mapping[Mesh, Region] | None = None,
) -> Layout:
    """Layout of one grid. `cases` are the grid's cases, in any order; fields are cut to `cropped`.

    Raises UserError where a name of the grid's axes is also the name of a variable.
    """
    case_dims = tuple(axis.name for axis in grid.axes)
    shape = tuple(grid.shape)
    tangential = any(case.scene.creepage is not None for case in cases)
    items = list(_coordinate_items(grid))
    if fields:
        stored = regions(cases, cropped)
        items += _mesh_items(case_dims, shape, cases, stored)
    labels = np.empty(shape, dtype=object)
    for case in cases:
        labels[case.index] = case_label(grid, case.index)
    items.append(Item(LABEL, case_dims, "str", {"long_name": "name of the case within its grid", "units": "1"}, labels))
    taken = {item.name for item in items}
    # a setting that is an axis, or goes with one, is already there as its coordinate
    items += [item for item in _setting_items(case_dims, shape, cases) if item.name not in taken]
    items += [item for item in _layer_items(case_dims, shape, cases) if item.name not in taken]
    items += result_items(case_dims, tangential=tangential, fields=fields, precision=precision)
    names = [item.name for item in items]
    for axis in grid.axes:
        if any(names.count(name) > 1 for name in axis.coords) or axis.name in (LAYER, ENTRY):
            raise UserError(f"grid {grid.name}: axis {axis.name}: is also the name of a variable of the cube")
    dims = dict(zip(case_dims, shape, strict=True))
    if any(LAYER in item.dims for item in items):
        dims[LAYER] = max(len(case.scene.layers) for case in cases)
    if fields:
        dims |= {"x": _most(stored, 0), "y": _most(stored, 1)}
    attrs = {"grid": grid.name, "grid_description": grid.description, "axes": " ".join(case_dims)}
    return Layout(grid.name, case_dims, dims, tuple(items), attrs)


def table_layout(layouts: Sequence[Layout]) -> Layout:
    """The root of a study of several grids: every scalar of every case, grids one after another."""
    count = sum(int(np.prod(layout.case_shape)) for layout in layouts)
    names = np.concatenate([np.full(int(np.prod(g.case_shape)), g.name, dtype=object) for g in layouts])
    items = [Item(GRID, (ENTRY,), "str", {"long_name": "grid of the case", "units": "1"}, names)]
    for name in (LABEL, *SETTINGS, CASE_KEY):
        parts = [_flat(layout, name) for layout in layouts]
        model = next((layout[name] for layout in layouts if _has(layout, name)), None)
        if model is not None:
            items.append(Item(name, (ENTRY,), model.dtype, model.attrs, np.concatenate(parts)))
    tangential = any(_has(layout, "force_x") for layout in layouts)
    items += result_items((ENTRY,), tangential=tangential, fields=False)
    return Layout("", (ENTRY,), {ENTRY: count}, tuple(items), {})


def _has(layout: Layout, name: str) -> bool:
    return any(item.name == name for item in layout.items)


def _flat(layout: Layout, name: str) -> np.ndarray:
    """A known variable or coordinate of a grid for each of its cases, in C order; NaN where it has none."""
    shape = layout.case_shape
    if not _has(layout, name):
        return np.full(int(np.prod(shape)), np.nan)
    item = layout[name]
    assert item.values is not None
    along = [shape[k] if dim in item.dims else 1 for k, dim in enumerate(layout.case_dims)]
    return np.broadcast_to(item.values.reshape(along), shape).reshape(-1)


def lay_out(
    expansion: Expansion, *, fields: bool, precision: str, cropped: Mapping[str, Mapping[Mesh, Region]] | None = None
) -> tuple[list[Layout], Layout | None]:
    """Layouts of all grids, and that of the root table when there are several grids (else None).

    `cropped`: the cells to store of each mesh of a grid; by default all.

    Raises UserError where a grid's name is also the name of a variable, or an axis's is.
    """
    of_grid = expansion.by_grid()
    layouts = [
        grid_layout(g, of_grid[g.name], fields=fields, precision=precision, cropped=(cropped or {}).get(g.name))
        for g in expansion.grids
    ]
    if len(layouts) == 1:
        return layouts, None
    root = table_layout(layouts)
    for layout in layouts:
        if _has(root, layout.name) or layout.name in (ENTRY, "x", "y"):
            raise UserError(f"grid {layout.name}: is also the name of a variable of the cube: rename it")
    return layouts, root
