"""Series of creepages whose cases start from one another: the same results, for fewer products."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from contacts import STEEL, steel

from rcstudy import sweep
from rcstudy.cube import case_table, open_cube
from rcstudy.mechanics.contact import solve_normal, solve_rolling
from rcstudy.mechanics.rolling import RollingSolution, rigid_slip
from rcstudy.mechanics.scene import Creepage, Layer, Mesh, Scene, Tolerance
from rcstudy.mechanics.series import Series
from rcstudy.result import Result, Status
from rcstudy.solve import solve_group, solve_scene
from rcstudy.study import load_study

ONE = steel(
    Mesh((1.0, 1.0), (48, 48)),
    layers=(Layer(0.5 * STEEL.E, 0.3, 0.1),),
    counterbody=None,
    creepage=Creepage(),
    tolerance=Tolerance(1e-6, 1e-6),
)
CREEPAGES = [Creepage(0.0004 + 0.0001 * k, 0.0003, 0.004) for k in range(8)]


def products(results: Sequence[Result]) -> float:
    return sum(result.scalars["operator_products"] + result.scalars["coarse_products"] for result in results)


@pytest.mark.parametrize("spin", [0.0, 0.015, -0.04])
def test_rigid_slip_within_a_circle(spin: float) -> None:
    """Its largest value, and whether it vanishes somewhere: as on many points."""
    radius, angle = np.linspace(0.0, 0.5, 201)[:, None], np.linspace(0.0, 2.0 * np.pi, 721)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    creepage = Creepage(0.005, -0.007, 0.01) - Creepage(-0.001, 0.001, 0.01 - spin)
    w = rigid_slip(x.ravel(), y.ravel(), creepage, 0.0)
    speed = np.hypot(w[:, 0], w[:, 1])
    assert creepage.fastest(0.5) == pytest.approx(speed.max(), rel=1e-4)
    assert (math.hypot(*creepage.pole) < 0.5) == (speed.min() < 0.005 * speed.max())


@pytest.mark.heavy
@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
@pytest.mark.parametrize("order", [1, -1])
def test_results_are_those_of_cases_alone(discretisation: str, order: int) -> None:
    scenes = [replace(ONE, creepage=creepage, discretisation=discretisation) for creepage in CREEPAGES]  # type: ignore[arg-type]
    alone = [solve_scene(scene) for scene in scenes]
    found = list(solve_group(scenes[::order], series=True))[::order]
    for one, other in zip(alone, found, strict=True):
        assert one.status == other.status == Status.SOLVED
        for name in ("traction_x", "traction_y"):
            off = np.linalg.norm(one.fields[name] - other.fields[name])
            assert off <= 1e-5 * np.hypot(*(np.linalg.norm(one.fields[key]) for key in ("traction_x", "traction_y")))
        for name in ("force_x", "force_y", "moment_z", "friction_power"):
            assert other.scalars[name] == pytest.approx(one.scalars[name], rel=1e-5)
            # coarser meshes are solved to 2e-3, and bars are made of what they differ by
            assert other.scalars[f"{name}_error"] == pytest.approx(one.scalars[f"{name}_error"], rel=0.4)
    assert products(found) < 0.85 * products(alone)


@pytest.mark.heavy
def test_far_creepages_start_from_coarser_meshes() -> None:
    """To the last bit what they are alone."""
    scenes = [replace(ONE, creepage=Creepage(*c)) for c in ((0.0005, 0.0, 0.0), (0.0, 0.002, 0.0), (0.0, 0.0, 0.01))]
    for scene, other in zip(scenes, solve_group(scenes, series=True), strict=True):
        alone = solve_scene(scene)
        assert products([alone]) == products([other])
        np.testing.assert_array_equal(alone.fields["traction_x"], other.fields["traction_x"])


def test_neighbour_is_the_closest_that_differs_in_creepage_alone() -> None:
    contact = solve_normal(replace(ONE, mesh=Mesh((1.0, 1.0), (24, 24))))

    def solved(creepage: Creepage, friction: float = 0.3) -> tuple[Scene, RollingSolution]:
        scene = replace(contact.scene, creepage=creepage, friction=friction)
        return scene, solve_rolling(contact, scene)

    series = Series(0.25)
    sought = replace(contact.scene, creepage=Creepage(0.001, 0.0, 0.004), friction=0.3)
    assert series.neighbour(sought) is None
    near, nearer = solved(Creepage(0.00125, 0.0, 0.004)), solved(Creepage(0.001, 0.0001, 0.0042))
    series.add(*solved(Creepage(0.001, 0.0, 0.004), friction=0.4))
    series.add(*solved(Creepage(0.001, 0.0, -0.004)))  # changes by 0.002, more than half of 0.002
    assert series.neighbour(sought) is None
    series.add(*near)
    assert series.neighbour(sought) is near[1]
    series.add(*nearer)
    series.add(sought, replace(nearer[1], converged=False))
    series.add(replace(sought, method="paper-cg"), nearer[1])
    series.add(*near)
    assert series.neighbour(sought) is nearer[1]
    assert series.neighbour(replace(sought, method="paper-cg")) is None
    for k in range(8):
        series.add(*solved(Creepage(0.02 + 0.01 * k)))
    assert series.neighbour(sought) is None  # of long ago
    assert series.neighbour(replace(sought, creepage=None)) is None
    series.add(*(turning := solved(Creepage(spin=0.005))))
    assert series.neighbour(replace(sought, creepage=Creepage(spin=0.004))) is turning[1]


@pytest.mark.heavy
def test_sweep_in_series(tmp_path: Path) -> None:
    path = tmp_path / "series.yaml"
    path.write_text(
        "study: series\n"
        "scene: {substrate: {E: 210000, nu: 0.3}, counterbody: {E: 210000, nu: 0.3}, radius: 50, load: 100,\n"
        "  mesh: {size: auto, cells: [40, 40]}, creepage: {spin: 0.003}}\n"
        "grids: {a: {axes: {creepage.longitudinal: [5e-4, 6e-4, 7e-4, 8e-4, 9e-4, 10e-4, 11e-4, 12e-4]}}}\n"
    )
    found = {}
    for series in (False, True):
        cube = tmp_path / f"{series}.nc"
        assert sweep.run(load_study(path), cube, workers=1, series=series).failed == 0
        with open_cube(cube) as tree:
            found[series] = case_table(tree)
    spent = {series: (table.operator_products + table.coarse_products).sum() for series, table in found.items()}
    assert spent[True] < 0.9 * spent[False]
    np.testing.assert_allclose(found[True].force_x, found[False].force_x, rtol=1e-4)
