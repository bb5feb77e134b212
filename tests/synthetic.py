"""Made-up studies and results, so that what reads and writes cubes is tested without the solver.

Fields look like rolling contacts (Hertz's pressure, tractions that grow from the leading edge to the bound) and
differ from case to case, so that a mix-up of cases, variables or axes shows.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from rcstudy.cases import Axis, Case, Coord, Expansion, Grid
from rcstudy.mechanics.scene import Creepage, Layer, Material, Mesh, Scene
from rcstudy.result import CellState, Result, Status
from rcstudy.studyfile.build import scene_hertz

if TYPE_CHECKING:
    import xarray as xr

SUBSTRATE = Material(210000.0, 0.3)
MESH = Mesh((2.0, 2.0), (32, 24))
"""Not square: swapped axes show."""

SCENE = Scene(substrate=SUBSTRATE, radius=(50.0, 50.0), load=100.0, mesh=MESH, creepage=Creepage(0.002, 0.001, 0.01))
RADIUS = scene_hertz(SCENE).radius
CREEPAGES = {
    "a": Creepage(0.002),
    "b": Creepage(0.0, 0.001),
    "c": Creepage(0.002, 0.001),
    "d": Creepage(0.002, 0.0, 0.01),
    "e": Creepage(0.0, 0.001, 0.01),
    "f": Creepage(0.002, 0.001, 0.01),
}

TABLE_2 = {
    "a": Creepage(0.002, 0.001),
    "b": Creepage(0.002, 0.002),
    "c": Creepage(0.002, 0.0, 0.005),
    "d": Creepage(0.002, 0.0, 0.01),
    "e": Creepage(0.002, 0.001, 0.005),
    "f": Creepage(0.002, 0.001, 0.01),
}
"""The creepages of the paper's Table 2."""


@dataclass(frozen=True)
class Synthetic:
    """A made-up study with all its results, as `write_cube` takes them."""

    study: Any
    expansion: Expansion
    results: list[tuple[Case, Result]]


def thickness_axis(ratios: tuple[float, ...] = (0.25, 0.5, 1.0), a: float = RADIUS) -> Axis:
    """Axis `thickness` in mm with `thickness_ratio` over a."""
    coords = {
        "thickness": Coord([r * a for r in ratios], "mm", "thickness of each layer"),
        "thickness_ratio": Coord(list(ratios), "1", "thickness of each layer over the Hertz radius a"),
    }
    return Axis("thickness", len(ratios), coords, tuple(f"{r:g} a" for r in ratios))


def modulus_axis(ratios: tuple[float, ...] = (0.5, 2.0)) -> Axis:
    """Axis `modulus` in MPa with `modulus_ratio` over Es."""
    coords = {
        "modulus": Coord([r * SUBSTRATE.E for r in ratios], "MPa", "Young's modulus of the layer on the substrate"),
        "modulus_ratio": Coord(list(ratios), "1", "modulus over that of the substrate"),
    }
    return Axis("modulus", len(ratios), coords, tuple(f"{r:g} Es" for r in ratios))


def creepage_axis(creepages: dict[str, Creepage] = CREEPAGES) -> Axis:
    """Axis `creepage`: labels with their three numbers."""
    sets = list(creepages.values())
    coords = {
        "creepage": Coord(list(creepages), "1", "label of the creepages"),
        "longitudinal": Coord([c.longitudinal for c in sets], "1", "longitudinal creepage"),
        "lateral": Coord([c.lateral for c in sets], "1", "lateral creepage"),
        "spin": Coord([c.spin for c in sets], "rad mm-1", "spin creepage"),
    }
    return Axis("creepage", len(sets), coords, tuple(creepages))


def number_axis(name: str, values: list[float], units: str = "1") -> Axis:
    """An axis of plain numbers."""
    return Axis(name, len(values), {name: Coord(values, units, name)}, tuple(f"{v:g}" for v in values))


def case_axis(labels: list[str]) -> Axis:
    """The axis of an explicit list of cases."""
    return Axis("case", len(labels), {"case": Coord(labels, "1", "case")}, tuple(labels))


def layers_of(count: int, thickness: float, modulus: float) -> tuple[Layer, ...]:
    """The coating of the paper's grids, from the surface down: E1 = m^2 Es on E2 = m Es, and so on."""
    ratio = modulus / SUBSTRATE.E
    return tuple(Layer(SUBSTRATE.E * ratio ** (count - k), SUBSTRATE.nu, thickness) for k in range(count))


def grid_cases(grid: Grid, scene: Scene, **fixed: Any) -> list[Case]:
    """All cases of a grid: `scene` with what the axes (and `fixed`: layer_count, thickness, modulus) say."""
    cases = []
    for index in itertools.product(*(range(n) for n in grid.shape)):
        values = {axis.name: axis.coords[axis.name].values[i] for axis, i in zip(grid.axes, index, strict=True)}
        values = {**fixed, **values}
        changes: dict[str, Any] = {}
        if "thickness" in values:
            changes["layers"] = layers_of(values.get("layer_count", 1), values["thickness"], values["modulus"])
        if "creepage" in values:
            changes["creepage"] = CREEPAGES[values["creepage"]]
        for name in ("load", "friction"):
            if name in values:
                changes[name] = values[name]
        if "cells" in values:
            nx, ny = values["cells"].split(" x ")
            changes["mesh"] = Mesh(scene.mesh.size, (int(nx), int(ny)))
        built = replace(scene, **changes)
        key = hashlib.sha256(f"{grid.name}{index}{built}".encode()).hexdigest()
        cases.append(Case(grid.name, index, built, key))
    return cases


def make_grid(name: str, *axes: Axis, description: str = "") -> Grid:
    """A grid with these axes."""
    return Grid(name, description, tuple(axes), tuple(axis.size for axis in axes))


def made_up_result(scene: Scene, status: Status = Status.SOLVED) -> Result:
    """A result that looks like a rolling contact; exact sums and extrema of its own fields."""
    if status in (Status.REFUSED, Status.ERROR):
        return Result(status, "made up to fail")
    h = scene_hertz(scene)
    stiffness = 1.0
    for k, layer in enumerate(scene.layers):
        stiffness *= (layer.E / scene.substrate.E) ** (layer.thickness / (layer.thickness + h.radius) / (k + 1))
    a = h.radius / stiffness ** (1 / 3)
    dx, dy = scene.mesh.spacing
    nx, ny = scene.mesh.cells
    x = (np.arange(nx) - (nx - 1) / 2)[:, None] * dx
    y = (np.arange(ny) - (ny - 1) / 2)[None, :] * dy
    pressure = h.p0 * (h.radius / a) ** 2 * np.sqrt(np.clip(1 - (x**2 + y**2) / a**2, 0, None))
    pressure *= scene.load / (pressure.sum() * dx * dy)
    contact = pressure > 0
    fields = {"pressure": pressure}
    area = float(contact.sum()) * dx * dy
    scalars: dict[str, float] = {
        "pressure_max": float(pressure.max()),
        "contact_area": area,
        "contact_radius": float(np.sqrt(area / np.pi)),
        "approach": h.approach / stiffness,
        "residual_normal": 3e-6,
        "iterations_normal": 7,
        "products_normal": 9,
        "solve_seconds": 0.05,
        "proof_load": 1e-15,
        "proof_gap": 2e-6,
        "proof_penetration": 0.0,
    }
    if scene.creepage is not None:
        c = scene.creepage
        wx, wy = c.longitudinal - c.spin * y, c.lateral + c.spin * x
        grow = np.clip(np.sqrt(np.clip(a**2 - y**2, 0, None)) - x, 0, None) * 80000.0 * stiffness / a
        qx, qy = -grow * wx * contact, -grow * wy * contact
        bound = scene.friction * pressure
        size = np.hypot(qx, qy)
        slip = contact & (size >= bound)
        shrink = np.where(slip, bound / np.where(size > 0, size, 1), 1.0)
        qx, qy = qx * shrink, qy * shrink
        excess = np.where(slip, 1 - shrink, 0.0)
        sx, sy = wx * excess, wy * excess
        state = np.where(slip, CellState.SLIP, np.where(contact, CellState.STICK, CellState.EXTERIOR)).astype("i1")
        fields |= {"traction_x": qx, "traction_y": qy, "slip_x": sx, "slip_y": sy, "state": state}
        scalars |= {
            "force_x": float(qx.sum()) * dx * dy,
            "force_y": float(qy.sum()) * dx * dy,
            "moment_z": float((x * qy - y * qx).sum()) * dx * dy,
            "slip_area": float(slip.sum()) * dx * dy,
            "traction_max": float(np.hypot(qx, qy).max()),
            "friction_power": float(-(qx * sx + qy * sy).sum()) * dx * dy,
            "residual_tangential": 4e-8,
            "iterations_tangential": 5,
            "operator_products": 61,
            "proof_stick": 5e-8,
            "proof_slip": 6e-8,
            "proof_bound": 0.0,
        }
    fields = {name: values + np.zeros_like(values) for name, values in fields.items()}  # no -0 outside the contact
    reason = "" if status is Status.SOLVED else "made up not to converge"
    return Result(status, reason, scalars, fields)


def make_study(name: str = "made up", *, fields: bool = True, precision: str = "float64") -> Any:
    """What `write_cube` reads of a Study."""
    text = f"study: {name}\n# μ, Poisson’s ratio: text beyond ASCII\n"
    return SimpleNamespace(
        name=name,
        description="made up for tests",
        text=text,
        path=Path("made_up.yaml"),
        sha256=hashlib.sha256(text.encode()).hexdigest(),
        outputs=SimpleNamespace(fields=fields, precision=precision, crop="none"),
    )


def assemble(study: Any, *parts: tuple[Grid, list[Case]], failing: dict[str, Status] | None = None) -> Synthetic:
    """A study from grids with their cases; `failing` maps case keys to the status they end with."""
    cases = tuple(case for _, cases in parts for case in cases)
    statuses = failing or {}
    results = [(case, made_up_result(case.scene, statuses.get(case.key, Status.SOLVED))) for case in cases]
    return Synthetic(study, Expansion(tuple(grid for grid, _ in parts), cases), results)


def small(**study: Any) -> Synthetic:
    """One grid: 2 moduli x 3 creepages."""
    grid = make_grid("tiny", modulus_axis(), creepage_axis({k: CREEPAGES[k] for k in "acf"}), description="tiny grid")
    return assemble(make_study(**study), (grid, grid_cases(grid, SCENE, layer_count=1, thickness=0.5 * RADIUS)))


def several(**study: Any) -> Synthetic:
    """Three grids: a product with two layers, pressure only, and a list of cases."""
    product = make_grid("product", thickness_axis((0.25, 1.0)), modulus_axis(), creepage_axis({"a": CREEPAGES["a"]}))
    pressure = make_grid("pressure_only", number_axis("load", [50.0, 100.0, 150.0], "N"))
    listed = make_grid("listed", case_axis(["bare", "soft"]))
    soft = replace(SCENE, layers=(Layer(105000.0, 0.3, 0.1),))
    listed_cases = [Case("listed", (0,), SCENE, "0" * 64), Case("listed", (1,), soft, "1" * 64)]
    return assemble(
        make_study(**study),
        (product, grid_cases(product, SCENE, layer_count=2)),
        (pressure, grid_cases(pressure, replace(SCENE, creepage=None))),
        (listed, listed_cases),
    )


def paper(cells: tuple[int, int] = (64, 64), maps: dict[str, Creepage] = CREEPAGES) -> Synthetic:
    """All grids of configs/paper.yaml with made-up fields: names, axes and shapes are the real study's.

    maps: the creepages of Figures 7 to 10, six of them.
    """
    scene = replace(SCENE, mesh=Mesh((2.0, 2.0), cells))
    bare_pressure = replace(scene, creepage=None)
    parts: list[tuple[Grid, list[Case]]] = []

    def add(grid: Grid, base: Scene, **fixed: Any) -> None:
        parts.append((grid, grid_cases(grid, base, **fixed)))

    add(make_grid("figure_3_bare", case_axis(["bare"])), bare_pressure)
    counts = Axis("layer_count", 2, {"layer_count": Coord([1, 2], "1", "number of layers")}, ("1", "2"))
    add(make_grid("figure_3", counts, thickness_axis(), modulus_axis()), bare_pressure)
    panels = {"a": "a", "c": "c", "e": "d", "g": "f"}
    fig4 = creepage_axis({panel: CREEPAGES[k] for panel, k in panels.items()})
    grid4 = make_grid("figure_4", fig4)
    cases4 = [
        Case("figure_4", (i,), replace(scene, creepage=CREEPAGES[k]), f"{i:064x}")
        for i, k in enumerate(panels.values())
    ]
    parts.append((grid4, cases4))
    pure = {label: Creepage(0.002 * (k + 1)) for k, label in enumerate("abcde")}
    for name, count in (("figure_5", 1), ("figure_6", 2)):
        grid = make_grid(name, thickness_axis(), modulus_axis(), creepage_axis(pure))
        cases = [
            replace(case, scene=replace(case.scene, creepage=list(pure.values())[case.index[-1]]))
            for case in grid_cases(grid, scene, layer_count=count)
        ]
        parts.append((grid, cases))
    for name, count, ratio in (
        ("figure_7", 1, 0.5),
        ("figure_8", 1, 1.0),
        ("figure_9", 2, 0.25),
        ("figure_10", 2, 0.5),
    ):
        grid = make_grid(name, modulus_axis(), creepage_axis(maps))
        cases = [
            replace(case, scene=replace(case.scene, creepage=list(maps.values())[case.index[-1]]))
            for case in grid_cases(grid, scene, layer_count=count, thickness=ratio * RADIUS)
        ]
        parts.append((grid, cases))
    return assemble(make_study("paper"), *parts)


def shuffled(results: list[tuple[Case, Result]], seed: int = 0) -> Iterator[tuple[Case, Result]]:
    """The same results in another order, as workers would deliver them."""
    for i in np.random.default_rng(seed).permutation(len(results)):
        yield results[i]


def write(path: Path, synthetic: Synthetic) -> Path:
    """Write a made-up cube; returns `path`."""
    from cubes import write_cube

    write_cube(path, synthetic.study, synthetic.expansion, iter(synthetic.results), {"command": "made up"})
    return path


def synthetic_tree(folder: Path, synthetic: Synthetic | None = None) -> xr.DataTree:
    """A made-up cube of the paper's grids, written to `folder` and opened as users open it."""
    from rcstudy.cube import open_cube

    return open_cube(write(folder / "made_up.nc", synthetic or paper()))
