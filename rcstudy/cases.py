"""Study -> grids with their coordinates and ordered cases, each with a content hash.

Cases that share a normal problem stand next to each other, and so do those that share layers and mesh, whichever grid
they come from: code that walks the cases in order can keep what is shared and drop it when it changes.
"""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any

import numpy as np
from pydantic_core import to_json

from rcstudy.mechanics import SOLVER_VERSION
from rcstudy.mechanics.collecting import nothing_collected
from rcstudy.mechanics.scene import Layer, Material, Scene
from rcstudy.settings import DESCRIPTIONS, LENGTH, MODULUS, ratio_name
from rcstudy.study import Study
from rcstudy.studyfile.build import scene_hertz
from rcstudy.studyfile.grid_plan import AxisPlan, GridPlan
from rcstudy.studyfile.quantities import Quantity

CASE_SCHEMA = 2
"""Version of what a case's key covers; goes up when a scene's record, the order of its keys or its meaning changes."""


@dataclass(frozen=True)
class Coord:
    """A coordinate along one axis: `values` (numbers, or text), their `units` and `long_name`."""

    values: Sequence[Any] | np.ndarray
    units: str
    long_name: str


@dataclass(frozen=True)
class Axis:
    """One dimension of a grid: `coords[name]` is the dimension's own coordinate, the others go along with it.

    `labels` are the values as a person writes them ("0.25 a", "1 a").
    """

    name: str
    size: int
    coords: dict[str, Coord]
    labels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Grid:
    """One grid of a study: its dimensions in order, and their sizes."""

    name: str
    description: str
    axes: tuple[Axis, ...]
    shape: tuple[int, ...]


@dataclass(frozen=True)
class Case:
    """One scene to solve and its place: `index` in the grid called `grid`. `key` is its content hash, hex."""

    grid: str
    index: tuple[int, ...]
    scene: Scene
    key: str


@dataclass(frozen=True)
class Expansion:
    """All grids in the study's order, and all cases in the order in which they are best solved."""

    grids: tuple[Grid, ...]
    cases: tuple[Case, ...]

    def groups(self) -> Iterator[tuple[Case, ...]]:
        """The cases, those of one normal problem together."""
        for _, group in itertools.groupby(self.cases, key=lambda case: normal_problem(case.scene)):
            yield tuple(group)

    def by_grid(self) -> dict[str, list[Case]]:
        """The cases of each grid, by its name."""
        found: dict[str, list[Case]] = {grid.name: [] for grid in self.grids}
        for case in self.cases:
            found[case.grid].append(case)
        return found


def scene_record(scene: Scene) -> dict[str, Any]:
    """`scene` as a mapping of plain values with the keys of a study's `scene:`, all in absolute units."""

    def material(body: Material) -> dict[str, float]:
        return {"E": body.E, "nu": body.nu}

    def layer(one: Layer) -> dict[str, float]:
        return {"E": one.E, "nu": one.nu, "thickness": one.thickness}

    creepage = scene.creepage
    return {
        "substrate": material(scene.substrate),
        "layers": [layer(one) for one in scene.layers],
        "counterbody": "rigid" if scene.counterbody is None else material(scene.counterbody),
        "radius": list(scene.radius),
        "load": scene.load,
        "friction": scene.friction,
        "creepage": "none"
        if creepage is None
        else {"longitudinal": creepage.longitudinal, "lateral": creepage.lateral, "spin": creepage.spin},
        "mesh": {"size": list(scene.mesh.size), "cells": list(scene.mesh.cells)},
        "coupling": scene.coupling,
        "method": scene.method,
        "discretisation": scene.discretisation,
        "spin_point": scene.spin_point,
        "tolerance": {"normal": scene.tolerance.normal, "tangential": scene.tolerance.tangential},
    }


def case_key(scene: Scene) -> str:
    """Content hash (sha256, hex) of `scene`, the solver's version and the schema's."""
    identity = {"scene": scene_record(scene), "schema": CASE_SCHEMA, "solver": SOLVER_VERSION}
    return hashlib.sha256(to_json(identity)).hexdigest()  # a third of what the standard library's JSON takes


def normal_problem(scene: Scene) -> Hashable:
    """What the pressure depends on: all of `scene` if tractions act on it, else all but what affects only these."""
    if scene.is_coupled:
        return scene
    mesh, tolerance = scene.mesh, scene.tolerance.normal
    bodies = (scene.substrate, scene.joined.layers, scene.counterbody)
    return (*bodies, scene.radius, scene.load, mesh, tolerance, scene.coupling, scene.discretisation)


def layer_set(scene: Scene) -> Hashable:
    """What the influence coefficients depend on."""
    return (scene.substrate, scene.joined.layers, scene.counterbody, scene.mesh)


@nothing_collected()
def expand(study: Study) -> Expansion:
    """All grids and cases of `study`."""
    ordered: dict[Hashable, dict[Hashable, list[Case]]] = {}
    grids = []
    for plan in study.grids:
        scales, scenes = _Scales(), []
        for index in plan.indices():
            scene = plan.scene(index)
            scales.add(scene)
            scenes.append(scene)
            case = Case(plan.name, index, scene, case_key(scene))
            ordered.setdefault(layer_set(scene), {}).setdefault(normal_problem(scene), []).append(case)
        grids.append(_grid(plan, scales, scenes))
    cases = (case for of_layers in ordered.values() for group in of_layers.values() for case in group)
    return Expansion(tuple(grids), tuple(cases))


@dataclass
class _Scales:
    """The values that the scales a (mm) and Es (MPa) take in one grid."""

    found: dict[str, set[float]] = field(default_factory=lambda: {LENGTH: set(), MODULUS: set()})

    def add(self, scene: Scene) -> None:
        self.found[LENGTH].add(scene_hertz(scene).radius)
        self.found[MODULUS].add(scene.substrate.E)

    def of(self, scale: str) -> float | None:
        """The value of `scale` if it is the same for all cases, else None."""
        values = self.found[scale]
        return next(iter(values)) if len(values) == 1 else None


def _grid(plan: GridPlan, scales: _Scales, scenes: Sequence[Scene]) -> Grid:
    axes = []
    for axis in plan.axes:
        coords = _axis_coords(axis, scales)
        if axis.path == "case":  # the only one of its grid
            coords |= _coords_of_list(scenes, scales)
        axes.append(Axis(axis.name, len(axis.values), coords, axis.labels))
    return Grid(plan.name, plan.description, tuple(axes), plan.shape)


def _coords_of_list(scenes: Sequence[Scene], scales: _Scales) -> dict[str, Coord]:
    """Coordinates of the settings that differ in a list of cases, named by their paths.

    Those that the cube holds of each case anyway (`layout.SETTINGS`, layers) are left out.
    """
    coords: dict[str, Coord] = {}
    for path in _LISTED:
        values = [_setting(scene, path) for scene in scenes]
        if len(set(values)) > 1:
            name = path.replace(".", "_")
            text = isinstance(values[0], str)
            coords |= _text(name, values) if text else _value_coords(name, path, values, None, scales)
    return coords


def _setting(scene: Scene, path: str) -> Any:
    """A setting of `scene` by its path, such as `mesh.size`; NaN for what a rigid counterbody has not."""
    if scene.counterbody is None and path.startswith("counterbody."):
        return math.nan
    return attrgetter(path)(scene)


_LISTED = (
    "substrate.E",
    "substrate.nu",
    "counterbody.E",
    "counterbody.nu",
    "radius",
    "mesh.size",
    "mesh.cells",
    "coupling",
    "method",
    "discretisation",
    "spin_point",
    "tolerance.normal",
    "tolerance.tangential",
)


def _axis_coords(axis: AxisPlan, scales: _Scales) -> dict[str, Coord]:
    first = next((value for value in axis.values if value is not None), None)
    mappings = [value for value in axis.values if isinstance(value, dict)]
    if (
        axis.path == "case"
        or axis.path == "layers"
        or not (mappings or isinstance(first, int | float | Quantity | tuple))
    ):
        coords = _text(axis.name, axis.labels)
    elif not mappings:
        coords = _value_coords(axis.name, axis.path, axis.values, axis.labels, scales)
    else:  # labelled mappings, with None (rigid) among them; a key that is None in all (auto) has no coordinate
        coords = _text(axis.name, axis.labels)
        for key in mappings[0]:
            name = key if axis.path == "creepage" else f"{axis.name}_{key}"
            values = [math.nan if value is None else value[key] for value in axis.values]
            if any(value is not None for value in values):
                coords.update(_value_coords(name, key, values, None, scales))
    return coords


def _text(name: str, labels: Sequence[str]) -> dict[str, Coord]:
    return {name: Coord(list(labels), "1", DESCRIPTIONS[name].long_name)}


def _value_coords(
    name: str, path: str, values: Sequence[Any], labels: Sequence[str] | None, scales: _Scales
) -> dict[str, Coord]:
    """Coordinates of numbers, quantities, or pairs of them; pairs as text (`labels`) with one coordinate each way."""
    units, long_name = DESCRIPTIONS[path.split(".")[-1]]
    if path in ("substrate.E", "substrate.nu", "counterbody.E", "counterbody.nu"):
        long_name += f" of the {path.split('.')[0]}"
    if any(isinstance(value, tuple) for value in values):
        if path == "radius" and all(x == y for x, y in values):
            return {name: Coord([x for x, _ in values], units, long_name)}
        coords = {} if labels is None else _text(name, labels)
        for k, way in enumerate("xy"):
            one_way = [math.nan if value is None else value[k] for value in values]
            coords.update(_number_coords(f"{name}_{way}", one_way, units, f"{long_name} along {way}", scales))
        return coords
    return _number_coords(name, values, units, long_name, scales)


def _number_coords(name: str, values: Sequence[Any], units: str, long_name: str, scales: _Scales) -> dict[str, Coord]:
    """The coordinate of plain numbers; of quantities the absolute and the relative one, as far as both are defined.

    Where the scale differs from case to case, relative quantities have no absolute coordinate, and absolute ones no
    relative coordinate; both together are text, empty where there is none.
    """
    if not any(isinstance(value, Quantity) for value in values):
        return {name: Coord(list(values), units, long_name)}
    # NaN: the modulus of a rigid counterbody
    quantities = [value if isinstance(value, Quantity) else Quantity(value) for value in values]
    scale = LENGTH if units == "mm" else MODULUS
    size = scales.of(scale)
    over = ratio_name(long_name, scale)
    if size is not None:
        ratios = [q.value if q.scale else q.value / size for q in quantities]
        return {
            name: Coord([q.resolve(size) for q in quantities], units, long_name),
            f"{name}_ratio": Coord(ratios, "1", over),
        }
    known = [q for q in quantities if not math.isnan(q.value)]
    if all(not q.scale for q in known):
        return {name: Coord([q.value for q in quantities], units, long_name)}
    if all(q.scale for q in known):
        return {name: Coord([q.value for q in quantities], "1", over)}
    texts = ["" if math.isnan(q.value) else str(q) if q.scale else f"{q} {units}" for q in quantities]
    return {name: Coord(texts, "1", long_name)}
