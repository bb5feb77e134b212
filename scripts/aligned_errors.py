"""Errors of the `aligned` discretisation over the paper's rolling cases.

Usage: python scripts/aligned_errors.py [--cells 80 160] [--reference 1024] [--places 1] [--study configs/paper.yaml]
[--discretisation aligned] [--per-radius] [--over itself]; the tables of docs/mechanics.md are made with
`--reference 2048`. The reference is always aligned. Prints, as a table in Markdown, errors of scalars against many more
cells (median / 90 % / worst, in per cent of each scalar) and how many cases are beyond 0.5 and 0.2 %. On a single mesh
the errors partly depend on chance: on where the borders of the contact and of the stick zone lie between cells.
`--places 25` therefore takes that many meshes, of windows up to 6 % smaller and larger, and gives the number of cases
per mesh. `--per-radius` takes the numbers of cells per radius of each case's own contact, not per window. `--over
scales` takes errors of forces over friction times load, of moments over that times the contact's radius, of slip areas
over the contact's area, of the largest traction over friction times the largest pressure, and of friction power over
friction times load and the largest rigid slip, instead of each over the scalar itself.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from rcstudy.cases import expand
from rcstudy.mechanics.scene import Creepage, Mesh, Scene
from rcstudy.result import ESTIMATED, Status
from rcstudy.solve import solve_group
from rcstudy.study import load_study

BARS = 0.5, 0.2  # per cent
WIDEST = 0.06  # largest relative change of a window's size, either way
NIL = 1e-5  # of the largest of all cases: less is zero by symmetry, up to the tolerance


def scalars(
    groups: Iterable[Sequence[Scene]],
    meshes: Iterable[Mesh],
    discretisation: Literal["aligned", "kalker"] = "aligned",
) -> list[dict[str, float]]:
    """Scalars of each scene, those of each group on its mesh.

    groups: scenes of one normal problem each, solved together.
    """
    found = []
    for group, mesh in zip(groups, meshes, strict=True):
        for result in solve_group([replace(scene, mesh=mesh, discretisation=discretisation) for scene in group]):
            if result.status != Status.SOLVED:
                raise SystemExit(f"not solved, on {mesh.cells[0]} cells: {result.reason}")
            found.append(result.scalars)
    return found


def windows(groups: Iterable[Sequence[Scene]], cells: int, wider: float = 1.0) -> list[Mesh]:
    """For each group `cells` x `cells` cells, on its own window made `wider` times as wide."""
    sizes = (group[0].mesh.size for group in groups)
    return [Mesh((x * wider, y * wider), (cells, cells)) for x, y in sizes]


def of_radius(groups: Sequence[Sequence[Scene]], cells: int, radii: Sequence[float], wider: float = 1.0) -> list[Mesh]:
    """For each group square cells, `cells` of them in its radius if `wider` is 1, on about its own window.

    radii: of the groups' contacts, mm.
    """
    meshes = []
    for group, radius in zip(groups, radii, strict=True):
        width = radius / cells * wider
        x, y = (round(length / width) for length in group[0].mesh.size)
        meshes.append(Mesh((x * width, y * width), (x, y)))
    return meshes


def rolling_groups(study: Path) -> list[list[Scene]]:
    """The rolling cases of a study that are solved by Newton's method, those of one normal problem together."""
    found = []
    for cases in expand(load_study(study)).groups():
        scenes = [case.scene for case in cases if case.scene.creepage is not None and case.scene.method == "newton"]
        if scenes:
            found.append(scenes)
    return found


def scales(scene: Scene, found: dict[str, float]) -> dict[str, float]:
    """What errors of the scalars `found` of `scene` are taken over with `--over scales`, in their units."""
    friction, radius = scene.friction * scene.load, found["contact_radius"]
    fastest = (scene.creepage or Creepage()).fastest(radius)
    return found | {
        "force_x": friction,
        "force_y": friction,
        "moment_z": friction * radius,
        "slip_area": found["contact_area"],
        "traction_max": scene.friction * found["pressure_max"],
        "friction_power": friction * fastest,
    }


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, nargs="+", default=[80, 160])
    parser.add_argument("--reference", type=int, default=1024)
    parser.add_argument("--places", type=int, default=1)
    parser.add_argument("--study", type=Path, default=Path(__file__).resolve().parents[1] / "configs" / "paper.yaml")
    parser.add_argument("--discretisation", default="aligned", choices=["aligned", "kalker"])
    parser.add_argument("--per-radius", action="store_true")
    parser.add_argument("--over", default="itself", choices=["itself", "scales"])
    options = parser.parse_args()
    groups = rolling_groups(options.study)
    reference = scalars(groups, windows(groups, options.reference))
    sizes = reference
    if options.over == "scales":
        cases = [scene for group in groups for scene in group]
        sizes = [scales(*case) for case in zip(cases, reference, strict=True)]
    firsts = np.cumsum([0, *map(len, groups)])[:-1]
    radii = [reference[first]["contact_radius"] for first in firsts]
    factors = 1.0 + np.linspace(-WIDEST, WIDEST, options.places) if options.places > 1 else np.ones(1)
    print(f"{len(reference)} cases, against {options.reference} cells; errors: median / 90 % / worst, %")
    for cells in options.cells:
        found = []
        for wider in factors:
            meshes = of_radius(groups, cells, radii, wider) if options.per_radius else windows(groups, cells, wider)
            found.append(scalars(groups, meshes, options.discretisation))
        print(f"\n## {cells} cells{' per radius' * options.per_radius}, {len(factors)} meshes\n")
        print("| scalar | errors | rms | " + " | ".join(f"cases beyond {bar} %" for bar in BARS) + " |")
        print("| --- " * (3 + len(BARS)) + "|")
        for name in ESTIMATED:
            truth = np.array([of_case[name] for of_case in reference])
            over = abs(np.array([of_case[name] for of_case in sizes]))
            there = over > NIL * over.max()
            values = np.array([[of_case[name] for of_case in mesh] for mesh in found])
            errors = 100.0 * abs(values - truth)[:, there] / over[there]
            spread = " / ".join(f"{value:.2g}" for value in (np.median(errors), np.quantile(errors, 0.9), errors.max()))
            counts = " | ".join(f"{(errors > bar).sum() / len(factors):.3g}" for bar in BARS)
            print(f"| {name} | {spread} | {np.sqrt((errors**2).mean()):.2g} | {counts} |")


if __name__ == "__main__":
    main()
