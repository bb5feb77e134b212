"""Made-up solutions whose error bars are stored: scalars, meshes and hidden errors at random, of all kinds of contacts.

`python tests/pinned_bars.py` writes their bars, `tests/reference/bars.json`, anew.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np

from rcstudy.bars.estimate import error_estimates
from rcstudy.bars.hidden import Hidden
from rcstudy.mechanics.missed import Missed
from rcstudy.mechanics.scene import Creepage, Material, Mesh, Scene
from rcstudy.mechanics.subcell.unseen import Unseen

REFERENCE = Path(__file__).parent / "reference" / "bars.json"
CASES = 1000


def bars_of(seed: int) -> dict[str, float]:
    """Error bars of one of these solutions."""
    rng = np.random.default_rng([seed, 66])
    scene, area = _scene(rng)
    finest = _scalars(rng, scene, area)
    meshes = int(rng.integers(1, 4))
    levels = [finest] + [
        {name: value * (1.0 + 0.03 * 2.0**k * rng.normal()) for name, value in finest.items()} for k in range(1, meshes)
    ]
    in_contact = max(1, round(area / math.prod(scene.mesh.spacing)))
    return error_estimates(scene, in_contact, levels, _hidden(rng, finest, hardly=rng.random() < 0.2))


def _scene(rng: np.random.Generator) -> tuple[Scene, float]:
    """A scene, whose contact fills a third to two thirds of its window, and the contact's area (mm^2)."""
    cells = int(rng.integers(1, 14) if rng.random() < 0.5 else rng.integers(14, 90))
    width = float(rng.choice([1.0, 0.3, 3.0, 0.05, 20.0], p=[0.5, 0.15, 0.15, 0.1, 0.1]))
    rows = max(1, int(cells * rng.choice([1.0, width, 0.5], p=[0.5, 0.4, 0.1])))
    spin = rng.choice([0.01, 0.1])
    creepages = (rng.choice([0.0, 1e-5, 1.0], 3, p=[0.4, 0.1, 0.5]) * [0.002, 0.001, spin]).tolist()
    scene = Scene(
        Material(210000.0, float(rng.choice([0.3, 0.5]))),
        (50.0, 50.0 * float(rng.choice([1.0, 0.4, 8.0]))),
        100.0,
        Mesh((1.0, width), (cells, min(rows, 120))),
        counterbody=None if rng.random() < 0.5 else Material(210000.0, 0.3),
        friction=float(rng.uniform(0.05, 1.5)),
        creepage=Creepage(*creepages),
        coupling=rng.choice(["one-way", "full"]),
        discretisation=rng.choice(["kalker", "aligned"]),
    )
    return scene, width * float(rng.uniform(0.3, 0.6))


def _scalars(rng: np.random.Generator, scene: Scene, area: float) -> dict[str, float]:
    slipping = float(rng.choice([0.0, 1.0, rng.random(), 0.05 * rng.random()]))
    pressure, force = scene.load / area * rng.uniform(1.4, 2.4), scene.friction * scene.load
    little = float(rng.choice([1.0, 0.8, 0.02]))
    radius = math.sqrt(area / math.pi)
    scalars = {
        "pressure_max": pressure,
        "contact_area": area,
        "contact_radius": radius,
        "approach": 0.001,
        "force_x": little * force * rng.uniform(-1.0, 1.0),
        "force_y": little * force * rng.uniform(-0.5, 0.5),
        "moment_z": little * force * radius * rng.uniform(-0.3, 0.3),
        "slip_area": slipping * area,
        "traction_max": little * scene.friction * pressure,
        "friction_power": little * force * 0.001 * rng.random(),
    }
    return {name: float(value) for name, value in scalars.items()}


def _hidden(rng: np.random.Generator, finest: dict[str, float], *, hardly: bool) -> Hidden:
    """Hidden errors: some of all; of bodies that `hardly` creep if so."""

    def some(most: float) -> float:
        return float(most * rng.random() * (rng.random() < 0.6))

    return Hidden(
        unsettled=some(0.01),
        by_layers=some(0.05) * float(rng.choice([-1.0, 1.0])),
        moved=some(0.1),
        squeezed=some(1.0),
        slip=Unseen(*(some(0.3) for _ in range(4)), 0.0, *(some(0.3) for _ in range(3))),
        lift=some(0.1),
        peak_by_layers=some(0.05),
        cusp_of_pressure=some(0.05),
        cusp_of_traction=some(0.05),
        least_slip=some(0.3),
        at_rim=some(0.2),
        beyond_rim=some(0.4),
        pull=some(2.0),
        pull_under_skin=some(1.0),
        slip_shown=bool(rng.random() < 0.8),
        slips_at_top=bool(rng.random() < 0.4),
        largest_of_cells=finest["traction_max"] * float(rng.uniform(0.7, 1.0)),
        by_pressure=1.0 if hardly else some(0.01),
        turning=some(1.5),
        skin=(some(0.3), some(0.02)),
        at_pole=some(0.1),
        top_at_border=bool(rng.random() < 0.4),
        missed=Missed(some(0.2), some(0.1), some(0.05), some(0.1)),
        largest_slip=some(0.01),
        cusp_in_skin=some(0.5),
        at_borders=some(1.0),
        edge_of_tractions=some(0.02),
        moved_inwards=some(0.03),
        lost_power=some(1.0) if hardly else 0.0,
    )


if __name__ == "__main__":
    stored = [{name: float(f"{bar:.9g}") for name, bar in bars_of(seed).items()} for seed in range(CASES)]
    REFERENCE.write_text("[\n" + ",\n".join(json.dumps(bars) for bars in stored) + "\n]\n", encoding="utf-8")
