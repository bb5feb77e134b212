"""How honest the error bars are: random contacts against meshes four times finer.

Usage: python scripts/error_bars.py [--cases 64] [--seed 1] [--discretisation kalker] [--contacts mild|full|wild].
Prints, as a table in Markdown, for each scalar the share of cases whose true error lies within the estimate, the median
ratio of estimate to truth, and the true error itself. `full`: as the mild ones, of bodies whose pressure moves their
surfaces, under full coupling; `wild`: up to six layers of any stiffness and thickness, ellipses, friction from 0.03 to
1.6, either coupling. Published: results/error_bars.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rcstudy.errors import UserError
from rcstudy.mechanics.normal import estimated_contact
from rcstudy.mechanics.scene import Creepage, Layer, Material, Mesh, Scene, Tolerance
from rcstudy.result import ESTIMATED, Status
from rcstudy.solve import solve_scene
from rcstudy.study import scene_from_mapping

STEEL = Material(210000.0, 0.3)
CREEPAGES = (
    (0.002, 0.0, 0.0),
    (0.002, 0.001, 0.0),
    (0.002, 0.001, 0.01),
    (0.0, 0.002, 0.0),
    (0.0, 0.0, 0.01),
    (0.001, 0.0, 0.005),
    (0.004, 0.004, 0.01),
    (0.0005, 0.0005, 0.0),
    (0.0005, 0.0, 0.02),
)


def mild_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A contact with up to three layers, any counterbody, circular or elliptic, on a window of 2.6 to 4 semi-axes."""
    layers = tuple(
        Layer(210000.0 * 10 ** rng.uniform(-1.0, 0.7), rng.choice([0.2, 0.3, 0.4, 0.48]), rng.uniform(0.0125, 0.3))
        for _ in range(rng.choice([0, 0, 1, 1, 2, 3]))
    )
    counterbody = (None, None, STEEL, Material(70000.0, 0.33))[rng.integers(4)]
    radius = ((50.0, 50.0), (50.0, 50.0), (80.0, 40.0), (30.0, 90.0))[rng.integers(4)]
    cells = int(rng.choice([24, 32, 40, 48, 64]))
    scene = Scene(
        STEEL,
        radius,
        100.0,
        Mesh((1.0, 1.0), (cells, cells)),
        layers,
        counterbody,
        float(rng.choice([0.3, 0.6, 1.0])),
        Creepage(*CREEPAGES[rng.integers(len(CREEPAGES))]),
        discretisation=discretisation,  # type: ignore[arg-type]
        tolerance=Tolerance(1e-6, 1e-6),
    )
    width = rng.uniform(2.6, 4.0)
    ax, ay = estimated_contact(scene)
    return replace(scene, mesh=Mesh((width * ax, width * ay), scene.mesh.cells))


def full_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A mild contact whose pressure moves the surface, under full coupling."""
    while True:
        scene = replace(mild_scene(rng, discretisation), coupling="full")
        if scene.moves_by_pressure:
            return scene


def wild_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A contact of nearly any bodies, half of them with layers that are not extreme; creepage that makes part slip."""
    while True:
        stiffness, thickness = ((-1.5, 1.2), (-1.5, 0.5)) if rng.random() < 0.5 else ((-4.0, 3.0), (-3.0, 1.0))
        radius = [_power(rng, 0.0, 3.0), _power(rng, 0.0, 3.0)] if rng.random() < 0.4 else _power(rng, 0.0, 3.0)
        cells = [int(n) for n in rng.integers(16, 56, size=2)]
        layers = [
            {
                "E": f"{_power(rng, *stiffness)} Es",
                "nu": _poisson(rng),
                "thickness": f"{_power(rng, *thickness)} a",
            }
            for _ in range(rng.choice([0, 1, 1, 1, 2, 3, 4, 5, 6]))
        ]
        counterbodies = "rigid", "rigid", {"E": "1 Es", "nu": 0.3}, {"E": f"{_power(rng, -4.0, 1.0)} Es", "nu": 0.4}
        mapping = {
            "substrate": {"E": 210000.0 if rng.random() < 0.7 else _power(rng, 1.0, 6.0), "nu": _poisson(rng)},
            "layers": layers,
            "counterbody": counterbodies[rng.integers(4)],
            "radius": radius,
            "load": _power(rng, -6.0, 6.0) if rng.random() < 0.5 else _power(rng, 0.0, 3.0),
            "friction": _power(rng, -1.5, 0.2),
            "creepage": {"longitudinal": 0.001},
            "mesh": {"size": "auto", "cells": cells if rng.random() < 0.5 else cells[:1] * 2, "margin": 1.6},
            "coupling": rng.choice(["one-way", "full"]),
            "discretisation": discretisation,
            "tolerance": {"normal": 1e-6, "tangential": 1e-6},
        }
        try:
            scene = scene_from_mapping(mapping)
        except UserError as error:
            if "mesh" not in str(error):  # what is refused is a window that cannot be fitted
                raise
            continue
        ax, ay = estimated_contact(scene)
        size = scene.friction * ax / scene.radius[0] * np.array([1.0, 1.0, 1.0 / np.sqrt(ax * ay)])
        parts = rng.choice([-1.0, 1.0], size=3) * 10.0 ** rng.uniform(-2.0, 0.7, size=3) * size
        parts *= [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, 1), (1, 1, 1)][rng.integers(6)]
        return replace(scene, creepage=Creepage(*np.clip(parts, (-1.0, -1.0, -1000.0), (1.0, 1.0, 1000.0)).tolist()))


def _power(rng: np.random.Generator, low: float, high: float) -> float:
    """A number between 10^low and 10^high, evenly in its logarithm."""
    return float(10.0 ** rng.uniform(low, high))


def _poisson(rng: np.random.Generator) -> float:
    return float(rng.choice([0.0, 0.1, 0.3, 0.3, 0.45, 0.49, 0.4999]))


CONTACTS: dict[str, Callable[[np.random.Generator, str], Scene]] = {
    "mild": mild_scene,
    "full": full_scene,
    "wild": wild_scene,
}


def main() -> None:
    """Solve each contact on its own mesh and on one four times finer, and compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=64)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--discretisation", default="kalker")
    parser.add_argument("--contacts", choices=CONTACTS, default="mild")
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    truth: dict[str, list[float]] = {name: [] for name in ESTIMATED}
    estimate: dict[str, list[float]] = {name: [] for name in ESTIMATED}
    scale: dict[str, list[float]] = {name: [] for name in ESTIMATED}
    count = unsolved = 0
    while count < options.cases:
        scene = CONTACTS[options.contacts](rng, options.discretisation)
        fine_mesh = Mesh(scene.mesh.size, (4 * scene.mesh.cells[0], 4 * scene.mesh.cells[1]))
        own, fine = solve_scene(scene), solve_scene(replace(scene, mesh=fine_mesh))
        if own.status != Status.SOLVED or fine.status != Status.SOLVED:
            unsolved += 1
            continue
        count += 1
        force = scene.friction * scene.load
        for name in ESTIMATED:
            truth[name].append(abs(own.scalars[name] - fine.scalars[name]))
            estimate[name].append(own.scalars[f"{name}_error"])
            by = {"force_x": force, "force_y": force, "moment_z": force * fine.scalars["contact_radius"]}
            scale[name].append(by.get(name, abs(fine.scalars[name]) or 1.0))
    print(f"`--discretisation {options.discretisation} --contacts {options.contacts}", end=" ")
    print(f"--seed {options.seed} --cases {count}`: {unsolved} others were not solved, on one of their meshes.\n")
    print("| scalar | within estimate, % | estimate over truth, median | true error, median, % | 90 %, % |")
    print("| --- | --- | --- | --- | --- |")
    for name in ESTIMATED:
        e, b, s = (np.array(values[name]) for values in (truth, estimate, scale))
        seen = e > 1e-9 * s
        ratio, (middle, most) = np.median(b[seen] / e[seen]), 100.0 * np.percentile(e / s, (50, 90))
        print(f"| {name} | {100 * np.mean(e <= b):.0f} | {ratio:.1f} | {middle:.2g} | {most:.2g} |")


if __name__ == "__main__":
    main()
