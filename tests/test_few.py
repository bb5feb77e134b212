"""Error bars of contacts on few cells: the laws that they follow, and that they hold."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest
from contacts import MIDDLING, STEEL, hertz_of, steel

from rcstudy.bars import few
from rcstudy.bars.estimate import error_estimates
from rcstudy.bars.hidden import Hidden
from rcstudy.mechanics.scene import Creepage, Discretisation, Layer, Mesh, Scene, Tolerance
from rcstudy.result import ESTIMATED, Status
from rcstudy.solve import solve_scene
from rcstudy.studyfile.build import fitted_size

SCALARS = MIDDLING | {"force_x": -40.0, "force_y": 20.0, "moment_z": 3.0, "friction_power": 0.2}


def on_cells(size: float, **more: Any) -> Scene:
    """Steel on steel under all creepages, on cells of `size` (mm)."""
    return steel(Mesh((16.0 * size, 16.0 * size), (16, 16)), creepage=Creepage(0.003, 0.001, 0.01), **more)


def test_every_estimated_scalar_has_a_law() -> None:
    for laws in few.LAWS.values():
        assert laws.keys() == set(ESTIMATED)


def test_a_law_has_a_limit_and_two_powers() -> None:
    law = few.Law(0.8, 0.1, 3.0, 0.05)
    assert law.at(0.1, 1.5) == 0.8
    assert law.at(4.0, 1.5) == pytest.approx(0.1 / 64.0 + 0.05 / 8.0, rel=1e-12)


@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
def test_forces_of_bodies_alike_are_less_in_doubt(discretisation: Any) -> None:
    alike, unlike = (few.laws(on_cells(1.0, discretisation=discretisation, counterbody=c)) for c in (STEEL, None))
    for n in (0.3, 1.0, 5.0):
        assert alike["force_x"].at(n, 1.0) < unlike["force_x"].at(n, 1.0)


def test_cells_a_radius_are_the_least_of_those_counted_and_those_of_hertz() -> None:
    """On oblong cells and of ellipses across the narrower side."""
    a = hertz_of().radius
    for counted, size, expected in ((1.1, 2.0 * a, 0.5), (1.1, 0.5 * a, 1.1)):
        assert few.cells_per_radius(on_cells(size), counted) == pytest.approx(expected, rel=1e-6)
    oblong = replace(on_cells(a), mesh=Mesh((16.0 * a, 32.0 * a), (16, 16)))
    assert few.cells_per_radius(oblong, 9.0) == pytest.approx(0.5, rel=1e-6)
    radius = 20.0, 100.0
    narrow = min(hertz_of(radius).a)
    assert few.cells_per_radius(on_cells(a, radius=radius), 9.0) == pytest.approx(narrow / a, rel=1e-6)


def test_scales_are_no_less_than_those_of_hertz() -> None:
    """Nor are forces less than what sticking bodies would transmit, though one cell shows no tractions by spin."""
    hertz = hertz_of()
    small = {"pressure_max": 1.0, "contact_area": 1e-6, "contact_radius": 1e-3, "approach": 1e-6}
    found = few.scales(on_cells(1.0), small, math.inf, 0.0)
    assert found["pressure_max"] == pytest.approx(hertz.p0, rel=1e-6)
    assert found["contact_area"] == pytest.approx(math.pi * hertz.radius**2, rel=1e-6)
    assert found["contact_radius"] == pytest.approx(hertz.radius, rel=1e-6)
    assert found["approach"] == pytest.approx(hertz.approach, rel=1e-6)
    large = dict.fromkeys(small, 1000.0)
    assert few.scales(on_cells(1.0), large, math.inf, 0.0) == large

    assert few.scales(on_cells(1.0), large | {"approach": -1000.0}, math.inf, 0.0) == large
    for radius in ((20.0, 100.0), (100.0, 20.0)):  # of an ellipse about that of the circle of its area
        found = few.scales(on_cells(1.0, radius=radius), small, math.inf, 0.0)
        assert found["approach"] == pytest.approx(hertz_of(radius).approach, rel=0.1)

    # slip by pressure is known for the pressure of the cells: under Hertz's it is as much larger
    moving, low = on_cells(1.0), SCALARS | {"pressure_max": 0.5 * hertz.p0}
    slip = moving.creepage.fastest(SCALARS["contact_radius"]) + 0.5 * 0.004 * 2.0  # type: ignore[union-attr]
    found = few.scales(moving, low, math.inf, 0.004)
    assert found["friction_power"] == pytest.approx(found["force_x"] * slip, rel=1e-6)

    turning = replace(on_cells(1.0), creepage=Creepage(spin=1e-4))
    none = {"force_x": 0.0, "force_y": 0.0, "moment_z": 0.0, "slip_area": 0.0, "traction_max": 0.0}
    found = few.scales(turning, SCALARS | none | {"friction_power": 0.0}, 0.0, 0.0)
    assert found["force_y"] == pytest.approx(turning.load * 1e-4 * 50.0, rel=1e-6)
    assert all(found[name] > 0.0 for name in ESTIMATED)
    still = few.scales(replace(turning, creepage=Creepage()), SCALARS | none | {"friction_power": 0.0}, 0.0, 0.0)
    assert still["slip_area"] == still["traction_max"] == still["force_x"] == still["friction_power"] == 0.0


def test_scale_of_forces_is_friction_unless_tractions_and_creepages_are_small() -> None:
    """Of tractions the smaller one of the largest that was found and that of the cells."""
    creeping, weak = replace(on_cells(1.0), creepage=Creepage(1e-9)), SCALARS | {"traction_max": 3.0}
    for largest, counts in ((2.0, 2.0), (9.0, 3.0)):
        force = few.scales(creeping, weak, largest, 0.0)["force_x"]
        assert force == pytest.approx(2.0 * counts * SCALARS["contact_area"], rel=1e-12)
    bound = creeping.friction * max(SCALARS["pressure_max"], hertz_of().p0)
    assert few.scales(creeping, weak, 1.0, 0.0)["traction_max"] == pytest.approx(math.sqrt(3.0 * bound), rel=1e-6)
    for creepage, traction in ((Creepage(1e-9), 1e4), (Creepage(0.1), 3.0)):
        found = few.scales(replace(creeping, creepage=creepage), SCALARS | {"traction_max": traction}, 1e4, 0.0)
        assert found["force_y"] == creeping.friction * creeping.load


@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
def test_estimates_without_a_coarser_mesh_follow_the_laws(discretisation: Any) -> None:
    """Largest tractions at the bound follow the pressure; twelve cells across and beyond there is another estimate."""
    a = hertz_of().radius
    scene = on_cells(0.8 * a, discretisation=discretisation, tolerance=Tolerance(1e-9, 1e-9))
    bars = error_estimates(scene, 4, [SCALARS], Hidden(largest_of_cells=40.0))
    scales = few.scales(scene, SCALARS, 40.0, 0.0)
    for name, law in few.laws(scene).items():
        n = min(1.25, math.sqrt(4 / math.pi))
        expected = scales[name] * law.at(n, few.ORDER[discretisation])
        if name == "traction_max":  # the largest pressure says more of it (`bounds.py`)
            expected = min(expected, scene.friction * (100.0 + bars["pressure_max_error"]) - SCALARS[name])
        assert bars[f"{name}_error"] == pytest.approx(expected, rel=1e-6), name
    at_bound = error_estimates(scene, 4, [SCALARS | {"traction_max": 100.0 * scene.friction}])
    assert at_bound["traction_max_error"] == scene.friction * at_bound["pressure_max_error"]
    fine = on_cells(a / 6.1, discretisation=discretisation)
    coarse = on_cells(a / 5.9, discretisation=discretisation)
    of_fine, of_coarse = (error_estimates(scene, 314, [SCALARS])["force_y_error"] for scene in (fine, coarse))
    assert of_coarse != pytest.approx(of_fine, rel=0.06)


@pytest.mark.usefixtures("whole_bars")
def test_estimates_with_one_coarser_mesh_are_no_less_than_half_of_the_laws() -> None:
    """Though both meshes agree; than all of it where errors depend on how edges lie between cells."""
    a = hertz_of().radius
    scene = on_cells(a / 2.4, discretisation="aligned", tolerance=Tolerance(1e-12, 1e-12))
    bars = error_estimates(scene, 18, [SCALARS] * 2)
    scales, laws = few.scales(scene, SCALARS, math.inf, 0.0), few.laws(scene)
    for name, part in (("force_x", 0.5), ("force_y", 0.5), ("moment_z", 1.0), ("contact_area", 1.0), ("approach", 1.0)):
        law = laws[name].at(math.sqrt(18 / math.pi), 1.5)
        assert bars[f"{name}_error"] == pytest.approx(part * law * scales[name], rel=1e-6), name


@pytest.mark.heavy
@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
def test_bars_of_the_first_example_on_four_to_twelve_cells(discretisation: str) -> None:
    """Four cells in contact on four to ten along the window: bars are as wide as these cells are large."""
    body = {"substrate": STEEL, "radius": (50.0, 50.0), "load": 100.0, "creepage": Creepage(0.002, 0.001, 0.01)}
    true = solve_scene(Scene(mesh=Mesh((2.0, 2.0), (200, 200)), discretisation="aligned", **body)).scalars  # type: ignore[arg-type]
    bars = []
    for cells in (4, 6, 8, 10, 12):
        scene = Scene(mesh=Mesh((2.0, 2.0), (cells, cells)), discretisation=discretisation, **body)  # type: ignore[arg-type]
        found = solve_scene(scene).scalars
        for name in ESTIMATED:
            assert abs(found[name] - true[name]) <= found[f"{name}_error"], (cells, name)
        bars.append(found["force_x_error"])
    assert bars == sorted(bars, reverse=True)
    assert bars[0] > 3.0 * bars[-1]


@pytest.mark.heavy
def test_bars_hold_on_one_to_twelve_cells_across() -> None:
    """Random bodies and creepages in windows of any size; each scalar, and each number of cells over all scalars."""
    rng = np.random.default_rng(5)
    numbers = 1, 2, 3, 4, 6, 8, 11
    held: dict[Any, list[bool]] = {}
    for case in range(24):
        layers = tuple(
            Layer(2.1e5 * 10 ** rng.uniform(-0.7, 0.7), 0.3, rng.uniform(0.05, 0.3)) for _ in range(case % 3)
        )
        xi, eta, phi = rng.normal(size=3) * (0.002, 0.002, 0.01)
        scene = Scene(STEEL, (50.0, rng.uniform(30.0, 80.0)), 100.0, Mesh((1.0, 1.0), (100, 100)), layers)
        scene = replace(scene, counterbody=(None, STEEL)[case % 2], friction=rng.uniform(0.2, 1.0))
        scene = replace(scene, creepage=Creepage(xi, eta, phi), coupling=("one-way", "full")[case // 2 % 2])
        scene = replace(scene, mesh=Mesh(fitted_size(scene, 1.25, (100, 100)), (100, 100)), discretisation="aligned")
        true = solve_scene(scene).scalars
        for across in numbers:
            cells = across + int(rng.integers(5, 9))
            sides = 2.0 * true["contact_radius"] / across * rng.uniform(0.85, 1.15, size=2) * cells
            scene = replace(scene, mesh=Mesh((float(sides[0]), float(sides[1])), (cells, cells)))
            for discretisation in get_args(Discretisation):
                found = solve_scene(replace(scene, discretisation=discretisation))
                assert found.status == Status.SOLVED, found.reason
                for name in ESTIMATED:
                    within = abs(found.scalars[name] - true[name]) <= found.scalars[f"{name}_error"]
                    for key in ((name,), (across,), (name, across)):
                        held.setdefault((discretisation, *key), []).append(within)
    for key, flags in held.items():
        assert np.mean(flags) >= (0.75 if len(key) == 3 else 0.9), key
