"""What layers thinner than a few cells do to edges, against an integration by SciPy and contacts on many more cells."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from contacts import steel
from scipy.integrate import quad

from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.contact import solve_normal
from rcstudy.mechanics.layered import frequency_response
from rcstudy.mechanics.scene import Coupling, Creepage, Discretisation, Layer, Mesh, Scene
from rcstudy.mechanics.skins import EDGES, shift_by_layers, shift_under_soft_layers
from rcstudy.result import Status
from rcstudy.solve import solve_scene

STEEL = steel(Mesh((1.0, 1.0), (8, 8)), counterbody=None).substrate


def integral(layers: tuple[Layer, ...], dx: float) -> tuple[float, float]:
    """The shift by SciPy's quadrature, and by how much more waves at the cut yield than long ones."""

    def g(k: float) -> float:
        return k * float(frequency_response(STEEL, layers, np.array([k]))[0, 0])

    more = max(1.0, g(EDGES / dx) / g(0.05 / dx))
    low = EDGES * more**0.2 / dx
    parts = [
        quad(lambda s: math.log(g(low * math.exp(s)) / g(low)) * math.exp(-s), *ends)[0] for ends in ((0, 4), (4, 40))
    ]
    return sum(parts) / (math.pi * low * dx), more


@pytest.mark.parametrize("thickness", [0.002, 0.02, 0.1])
@pytest.mark.parametrize("modulus", [20000.0, 90000.0, 1e6])
def test_shift_is_the_integral_of_the_response(modulus: float, thickness: float) -> None:
    dx, layers = 0.025, (Layer(modulus, 0.25, thickness), Layer(150000.0, 0.3, 2.0 * thickness))
    expected, more = integral(layers, dx)
    assert more < 30.0
    found = shift_by_layers(lambda k: frequency_response(STEEL, layers, k)[0], dx, EDGES)
    assert found == pytest.approx(expected, rel=2e-2, abs=1e-5)


def test_films_that_do_most_of_the_yielding_are_shifted_by_less() -> None:
    """By the square of 30 over what waves at the cut yield more than long ones."""
    expected, more = integral((Layer(1e-4 * STEEL.E, 0.45, 0.05),), 0.15)
    assert more > 35.0 and expected > 1e-3
    assert shift(1e-4, 0.45, 0.05) == pytest.approx((30.0 / more) ** 2 * expected, rel=2e-2)


@pytest.mark.parametrize(("modulus", "nu", "thickness"), [(0.01, 0.499, 0.05), (1e-4, 0.45, 0.05)])
def test_edges_on_films_that_keep_their_volume_are_moved_back(modulus: float, nu: float, thickness: float) -> None:
    """By up to 0.4 of a cell, as much as g grows faster than k from 0.5 to 1.5 radians a cell, over 0.55."""
    layers = (Layer(modulus * STEEL.E, nu, thickness),)
    all_, few, short = (k * frequency_response(STEEL, layers, np.array([k / 0.15]))[0, 0] for k in (0.05, 0.5, 1.5))
    faster = math.log(short / few / 3.0) / 0.55
    assert 0.3 < faster < 0.9
    expected = 0.011 * math.log(short / few) * math.log(short / all_) + 0.4 * faster
    found = shift_under_soft_layers(lambda k: frequency_response(STEEL, layers, k)[0], 0.15)
    assert found == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("coupling", get_args(Coupling))
def test_plates_on_a_few_cells(coupling: Coupling) -> None:
    """Thousands of times as stiff and a tenth of a cell to a cell thick: edges moved by the integral crossed once."""
    for modulus, thickness in ((4000.0, 0.07), (7000.0, 0.047), (1800.0, 0.0175)):
        layers = (Layer(modulus * STEEL.E, 0.3, thickness),)
        scene = steel(Mesh((1.2, 1.0), (8, 7)), counterbody=None, layers=layers, creepage=Creepage(0.001))
        for load in (0.3, 20.0):
            scene = replace(scene, load=load, discretisation="aligned", coupling=coupling)
            result = solve_scene(scene)
            assert result.status in (Status.SOLVED, Status.REFUSED)
            if result.status == Status.SOLVED:
                assert result.scalars["contact_area"] > 0.5 * (1.2 / 8) * (1.0 / 7)
                assert all(map(math.isfinite, result.scalars.values()))


def test_without_layers_nothing_is_shifted() -> None:
    assert shift_by_layers(lambda k: 2.0 / k, 0.1, EDGES) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("modulus", "thickness"), [(30000.0, 0.006), (60000.0, 0.02), (800000.0, 0.005), (1.2e6, 0.01)]
)
def test_areas_of_contacts_with_skins(modulus: float, thickness: float) -> None:
    """A fifth of a cell to a whole one thick: cells alone find areas 0.8 to 4 % too small or large."""
    scene = steel(
        Mesh((0.68, 0.68), (26, 26)), counterbody=None, layers=(Layer(modulus, 0.3, thickness),), creepage=None
    )
    scene = replace(scene, discretisation="aligned")

    fine = AlignedContact(solve_normal(replace(scene, mesh=Mesh((0.68, 0.68), (416, 416))))).area
    contact = AlignedContact(solve_normal(scene))
    by_cells_alone = abs(contact.area - contact.beyond_edges - fine) / fine
    assert 0.008 < by_cells_alone < 0.04
    assert abs(contact.area - fine) / fine < 0.4 * by_cells_alone
    result = solve_scene(scene)
    assert abs(result.scalars["contact_area"] - fine) <= result.scalars["contact_area_error"]


def test_edges_are_moved_back_on_soft_layers_of_a_few_cells() -> None:
    """0.011 ln(g(1.5)/g(0.5)) ln(g(1.5)/g(0.05)): not on stiff layers, hardly on thick or infinitely thin ones."""

    def shift(modulus: float, thickness: float) -> float:
        layers = (Layer(modulus * STEEL.E, 0.3, thickness),)
        return shift_under_soft_layers(lambda k: frequency_response(STEEL, layers, k)[0], 0.02)

    assert shift(1.0, 0.02) == pytest.approx(0.0, abs=1e-12)
    assert shift(10.0, 0.02) == 0.0
    assert shift(0.01, 0.02) > 10.0 * max(shift(0.01, 0.3), shift(0.01, 1e-5))
    layers = (Layer(0.01 * STEEL.E, 0.3, 0.02),)
    all_, few, short = (k * frequency_response(STEEL, layers, np.array([k]))[0, 0] for k in (2.5, 25.0, 75.0))
    assert shift(0.01, 0.02) == pytest.approx(0.011 * math.log(short / few) * math.log(short / all_), rel=1e-12)


@pytest.mark.heavy
@pytest.mark.parametrize("discretisation", get_args(Discretisation))
def test_areas_on_films_that_keep_their_volume(discretisation: Discretisation) -> None:
    """Thinner than a cell they made areas 9 % too large, and bars of 0.1 % beside that."""
    layers = (Layer(2.763, 0.4977, 0.047),)
    found, fine = (
        solve_scene(
            Scene(STEEL, (50.0, 54.4), 100.0, Mesh((3.55, 3.7), (n, n)), layers, STEEL, discretisation=discretisation)
        ).scalars
        for n in (32, 256)
    )
    for name in ("contact_area", "contact_radius", "pressure_max", "approach"):
        assert abs(found[name] - fine[name]) <= found[f"{name}_error"]
    assert found["contact_area"] == pytest.approx(
        fine["contact_area"], rel=0.04 if discretisation == "aligned" else 0.06
    )


@pytest.mark.heavy
def test_areas_on_soft_layers_a_few_cells_thick() -> None:
    """Half of what they were off by, and within their bars."""
    before, now = [], []
    for cells, modulus, thickness in (
        (28, 0.01, 3.0),
        (56, 0.003, 2.0),
        (56, 0.03, 1.5),
        (64, 0.03, 1.5),
        (64, 0.01, 2.0),
    ):
        layers = (Layer(modulus * STEEL.E, 0.4, thickness * 2.4 / cells),)
        scene = steel(Mesh((2.4, 2.4), (cells, cells)), counterbody=None, layers=layers, creepage=None)
        scene = replace(scene, discretisation="aligned")
        contact = AlignedContact(solve_normal(scene))
        found = solve_scene(scene).scalars
        fine = solve_scene(replace(scene, mesh=Mesh((2.4, 2.4), (4 * cells, 4 * cells)))).scalars["contact_area"]
        assert abs(found["contact_area"] - fine) <= found["contact_area_error"]
        now.append(abs(found["contact_area"] - fine) / fine)
        before.append(abs(contact.area + contact.short_of_edges - fine) / fine)
    assert np.linalg.norm(now) < 0.6 * np.linalg.norm(before)


def shift(modulus: float, nu: float, thickness: float) -> float:
    layers = (Layer(modulus * STEEL.E, nu, thickness),)

    def response(k: np.ndarray) -> np.ndarray:
        result: np.ndarray = frequency_response(STEEL, layers, k)[0]
        return result

    return shift_by_layers(response, 0.15, EDGES)


def test_edges_are_moved_by_less_than_a_third_of_a_cell() -> None:
    """A plate and a film of a tenth of a cell: by the integral -0.51 and 0.34."""
    assert shift(4000.0, 0.3, 0.015) == -0.3
    assert shift(0.001, 0.499, 0.015) == 0.3


def test_edges_on_films_that_do_all_of_the_yielding_are_not_shifted() -> None:
    """The pressure has no root there, and by the integral alone it would be 0.035 and 0.022 of a cell."""
    assert 0.0 < shift(1e-4, 0.499, 0.05) < 1e-3
    assert 0.0 <= shift(1e-5, 0.499, 0.05) < 1e-4
