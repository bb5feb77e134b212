"""What cells miss of the responses of thin layers, against waves on fine meshes and contacts on finer cells."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import rcstudy
from rcstudy.bars.estimate import error_estimates
from rcstudy.bars.hidden import Hidden
from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.contact import solve_normal
from rcstudy.mechanics.half_line import HALF_SPACE
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.layered import frequency_response
from rcstudy.mechanics.missed import Missed
from rcstudy.mechanics.scene import Layer, Material, Mesh, Scene
from rcstudy.study import scene_from_mapping

STEEL = Material(210000.0, 0.3)
RUBBER = (Layer(10.0, 0.5, 0.01),)
CELLS, FINE = 40, 256  # cells in one wave; points in a cell


def influence(layers: tuple[Layer, ...], counterbody: Material | None, side: float) -> Influence:
    return Influence(STEEL, layers, counterbody, (side, side), 1.0)


def seen(bodies: Influence, side: float) -> tuple[float, float]:
    """Amplitudes of u_z and u_x at the cells' centres, over what a wave of the same pressure without cells causes."""
    n = CELLS * FINE
    centres = np.arange(CELLS) * FINE + FINE // 2
    phase = 2.0 * math.pi * (np.arange(CELLS) + 0.5) / CELLS
    spectrum = np.fft.rfft(np.repeat(np.cos(phase), FINE))
    # the piece-wise constant values lie half a point off
    spectrum *= np.exp(1j * math.pi * np.arange(spectrum.size) / n)
    alpha = 2.0 * math.pi * np.arange(1, spectrum.size) / (CELLS * side)
    lift, along = np.zeros_like(spectrum), np.zeros_like(spectrum)
    responses = bodies._responses(alpha)
    lift[1:], along[1:] = spectrum[1:] * responses[0], spectrum[1:] * 1j * responses[1]
    u_z, u_x = np.fft.irfft(lift, n)[centres], np.fft.irfft(along, n)[centres]
    return (
        2.0 * float(u_z @ np.cos(phase)) / CELLS / float(responses[0, 0]),
        -2.0 * float(u_x @ np.sin(phase)) / CELLS / float(responses[1, 0]),
    )


@pytest.mark.parametrize("counterbody", [None, STEEL])
@pytest.mark.parametrize("thickness", [0.004, 0.01, 0.03])
def test_responses_to_pressure_constant_in_cells(thickness: float, counterbody: Material | None) -> None:
    side = 0.02
    layers = (Layer(10.0, 0.499, thickness),)
    radius = CELLS * side / (2.0 * math.pi)  # whose 1/radius is the wave's number
    bodies, bare = influence(layers, counterbody, side), influence((), None, side)
    found, also = bodies.missed(radius), bodies.missed(3.0 * radius)
    (lift, along), (lift_bare, along_bare) = seen(bodies, side), seen(bare, side)
    assert found.compliance == pytest.approx(abs(math.log(lift / lift_bare)), rel=0.02, abs=2e-5)
    beta = bodies.slip_by_pressure_over_tractions
    # the wave 3/radius' is that of this mesh; the part missed at 1/dx is larger
    missed = abs(along / along_bare - 1.0)
    assert also.slip == pytest.approx(missed * abs(beta), rel=0.05, abs=2e-5)
    assert also.short_slip >= also.slip
    response = bodies._responses(np.array([1.0 / radius]))[:, 0]
    assert also.long_slip == pytest.approx(missed * abs(response[1] / response[2]), rel=0.05, abs=2e-5)


def test_nothing_is_missed_without_thin_layers() -> None:
    for counterbody in (None, STEEL):
        assert influence((), counterbody, 0.05).missed(0.5) == Missed(0.0, 0.0)
        own = influence((Layer(STEEL.E, STEEL.nu, 0.01),), counterbody, 0.05).missed(0.5)
        assert max(own) < 1e-12
        thick = influence((Layer(0.5 * STEEL.E, 0.3, 0.25),), counterbody, 0.025).missed(0.5)
        assert max(thick[:2]) < 2e-5
        assert max(thick) < 2e-4
    assert min(influence(RUBBER, None, 0.05).missed(0.5)) > 0.01


def test_either_side_of_oblong_cells_misses_compliance() -> None:
    """Frictionless bodies know no direction; slip is along x.

    Bars of areas and approaches were too small where cells are long along y, and large enough where they are along x.
    """
    short, long = (influence(RUBBER, None, side).missed(0.5) for side in (0.01, 0.04))
    assert long.compliance > 5.0 * short.compliance > 0.0
    for sides in ((0.01, 0.04), (0.04, 0.01)):
        found = Influence(STEEL, RUBBER, None, sides, 1.0).missed(0.5)
        assert found == (short if sides[0] == 0.01 else long)._replace(compliance=long.compliance)


def test_error_bars_of_what_cells_miss() -> None:
    scene = scene_from_mapping(
        {
            "substrate": {"E": 210000, "nu": 0.3},
            "counterbody": "rigid",
            "radius": 50,
            "load": 100,
            "friction": 0.25,
            "creepage": {"longitudinal": 0.001, "spin": 0.001},
            "mesh": {"size": [1.0, 1.0], "cells": [32, 32]},
        }
    )
    level = {
        "force_x": -10.0,
        "force_y": 1.0,
        "moment_z": 0.5,
        "contact_area": 0.4,
        "contact_radius": 0.35,
        "slip_area": 0.3,
        "approach": 0.01,
        "pressure_max": 400.0,
        "traction_max": 80.0,
        "friction_power": 0.01,
    }

    def bars(missed: Missed) -> dict[str, float]:
        return error_estimates(scene, 300, [level] * 2, Hidden(missed=missed, slips_at_top=False))

    none, compliance = bars(Missed()), bars(Missed(compliance=0.1))
    slip = bars(Missed(slip=0.01, long_slip=0.02, short_slip=0.03))
    more = {name: compliance[name] - none[name] for name in none}
    assert more["contact_area_error"] == pytest.approx(0.045 * 0.4)
    assert more["contact_radius_error"] == pytest.approx(0.022 * 0.35)
    assert more["approach_error"] == pytest.approx(0.04 * 0.01)
    assert more["pressure_max_error"] == pytest.approx(0.07 * 400.0)
    peaked = 400.0 * 0.4 / 100.0 - 1.5
    assert more["traction_max_error"] == pytest.approx(0.05 * 80.0 * (1.0 + 0.4 * peaked))
    assert more["force_x_error"] == pytest.approx(more["force_y_error"]) == pytest.approx(0.02 * 25.0)
    assert more["moment_z_error"] == pytest.approx(0.02 * 25.0 * 0.35)
    per_radius = math.sqrt(300 / math.pi)
    of_stick = (0.5 * 0.02 + 0.1 * 0.03 * 10.0 / per_radius) * math.sqrt(1.0 - 0.3 / 0.4) * 100.0
    by_solver = 1e-5 * 25.0  # the tolerance
    by_meshes = none["force_x_error"] - by_solver
    assert slip["force_x_error"] == pytest.approx(math.hypot(by_meshes, of_stick) + by_solver)
    assert {name for name in none if slip[name] != none[name]} == {"force_x_error"}


@pytest.mark.parametrize(
    ("layers", "power"),
    [
        ((Layer(10.0, 0.5, 1e-3),), 1.0),  # gives way by being squeezed out, like k^2
        ((Layer(10.0, 0.3, 1e-3),), 0.0),  # gives way on the spot
        ((Layer(10.0, 0.5, 10.0),), 0.0),  # a body of its own
        ((Layer(1e6, 0.5, 1e-3),), 0.0),  # stiffer than the substrate
        ((Layer(1000.0, 0.48, 1e-3), Layer(10.0, 0.5, 1e-3)), 1.0),
        ((), 0.0),
    ],
)
def test_how_far_films_are_squeezed_out(layers: tuple[Layer, ...], power: float) -> None:
    """It does not depend on the counterbody or on the cells."""
    found = influence(layers, None, 0.02).squeezed(0.3)
    assert found == pytest.approx(power, abs=0.06)
    assert influence(layers, Material(100.0, 0.4), 0.01).squeezed(0.3) == found


@pytest.mark.parametrize("nu", [0.499, 0.4999, 0.49999, 0.499999, 0.5])
def test_how_far_nearly_incompressible_films_are(nu: float) -> None:
    """Thin films answer k^2 h^3/(3 G) and (1 + nu)(1 - 2 nu) h/((1 - nu) E): exponents 2 and 0, by their parts."""
    film, k = Layer(1e-3, nu, 1e-3), 4.0
    squeezed = (k * film.thickness) ** 2 / (3.0 * film.G)
    compressed = (1.0 + nu) * (1.0 - 2.0 * nu) / ((1.0 - nu) * film.E)
    expected = min(1.0, 2.0 * squeezed / (squeezed + compressed))
    assert influence((film,), None, 0.02).squeezed(4.0 / k) == pytest.approx(expected, rel=6e-3)


def test_slip_by_pressure_of_the_bodys_own_waves() -> None:
    """A top layer that moves like the counterbody does not slip under waves shorter than itself, but under others."""
    side = 0.02
    bare = influence((), None, side)
    assert bare.most_slip_under_pressure == abs(bare.slip_under_pressure) > 0.0
    rigid = influence((Layer(52000.0, 0.5, 5.0 * side),), None, side)
    assert abs(rigid.slip_under_pressure) < 0.05 * rigid.most_slip_under_pressure
    alpha = 1.0 / (side * np.arange(1, 17))
    assert rigid.most_slip_under_pressure == pytest.approx(np.abs(alpha * rigid._responses(alpha)[1]).max(), rel=1e-12)
    assert rigid.most_slip_under_pressure > 2.0 * bare.most_slip_under_pressure  # squeezed out sideways
    part = abs(rigid.slip_under_pressure) / rigid.most_slip_under_pressure
    assert (bare.local_part_of_slip, rigid.local_part_of_slip) == (1.0, pytest.approx(part, rel=1e-12))
    assert influence((), STEEL, side).local_part_of_slip == 1.0  # alike: no slip at all


def test_reach_of_tractions() -> None:
    """The root of compliances times wave number, of long waves over short ones: soft films let tractions end sooner."""
    side, length = 0.02, 0.6
    for layers in ((Layer(2000.0, 0.4, 0.004),), (Layer(2.0 * STEEL.E, 0.25, 0.03), Layer(5000.0, 0.45, 0.01))):
        far, near = (
            alpha * frequency_response(STEEL, layers, np.array([alpha]))[2][0] for alpha in (2 / length, 1 / side)
        )
        assert influence(layers, None, side).reach_of_tractions(length) == pytest.approx(min(1.0, (far / near) ** 0.5))
    assert influence((Layer(2000.0, 0.4, 0.004),), None, side).reach_of_tractions(length) < 0.6
    assert influence((Layer(10.0 * STEEL.E, 0.3, 0.01),), None, side).reach_of_tractions(length) == 1.0


@pytest.mark.parametrize("side", [0.005, 0.02])
def test_layers_beside_the_edge_respond_on_scales_of_a_cell_at_most(side: float) -> None:
    """The largest product of a difference of Dundurs' constant and the scale that it is found on, wave by wave."""
    for thickness in (0.2, 0.5, 1.0, 2.0):
        layers = (Layer(3.0 * STEEL.E, 0.2, thickness * side),)
        best = 0.0
        for alpha in np.geomspace(1.0 / side, 10.0 / (min(thickness, 1.0) * side), 40):
            own, other = (frequency_response(STEEL, layers, np.array([a]))[:, 0] for a in (1.0 / side, alpha))
            best = max(best, abs(other[1] / other[2] - own[1] / own[2]) * min(1.5 / alpha, side))
        difference, scale = influence(layers, None, side).skin_at_edge
        assert difference * scale == pytest.approx(best, rel=1e-9)
        assert 0.0 < scale <= side


@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
def test_area_between_edges_that_layers_move(discretisation: Any) -> None:
    """Along either axis the shift by a half-line of such cells, over the whole outline; aligned cells know it."""
    mesh = Mesh((1.2, 0.9), (12, 18))
    scene = Scene(STEEL, (50.0, 50.0), 100.0, mesh, layers=RUBBER, discretisation=discretisation)
    contact = solve_normal(scene)
    contact = AlignedContact(contact) if discretisation == "aligned" else contact
    shifts = (abs(contact.influence.half_line(side).shift - HALF_SPACE.shift) for side in (0.1, 0.05))
    moved = sum(shift * side for shift, side in zip(shifts, (0.1, 0.05), strict=True))
    expected = moved * math.sqrt(math.pi * contact.area)
    assert contact.moved_edge == (0.0 if discretisation == "aligned" else pytest.approx(expected, rel=1e-12))
    assert expected > 0.01
    bare = replace(scene, layers=())
    assert solve_normal(bare).moved_edge == 0.0


@pytest.mark.heavy
@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
def test_bars_on_a_film_of_rubber_a_quarter_of_a_cell_thick(discretisation: str) -> None:
    def contact(cells: int, discretisation: str):
        return rcstudy.solve(
            {
                "substrate": {"E": 210000, "nu": 0.3},
                "counterbody": "rigid",
                "layers": [{"E": 10, "nu": 0.5, "thickness": 0.01}],
                "radius": 50,
                "load": 100,
                "friction": 0.3,
                "creepage": {"longitudinal": 0.02, "spin": 0.02},
                "discretisation": discretisation,
                "mesh": {"size": [1.25, 1.25], "cells": [cells, cells]},
            }
        )

    found, finer = contact(32, discretisation), contact(128, "aligned")
    for name in ("contact_area", "pressure_max", "approach", "force_x", "force_y", "moment_z", "friction_power"):
        assert abs(float(found[name] - finer[name])) < float(found[f"{name}_error"]), name
    assert abs(float(found.force_x - finer.force_x)) > 0.1 * abs(float(finer.force_x))
