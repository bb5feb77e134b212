"""What rows that stick up to their trailing end carry too little."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from contacts import steel

from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.contact import NormalContact, solve_normal, solve_rolling
from rcstudy.mechanics.scene import Creepage, Material, Mesh, Scene
from rcstudy.mechanics.subcell.moved_rows import EDGE
from rcstudy.mechanics.subcell.trailing import Ending, ending_of_rows
from rcstudy.solve import solve_scene


@pytest.mark.parametrize("cells", [1, 2, 5, 12])
def test_sources_that_stick_have_the_sum_of_a_strip(cells: int) -> None:
    """As long as there are cells: q = c (s/(L - s))^(1/2), whose sum is pi/2 c L; the last tells c."""
    places = np.arange(cells)
    sources = np.linalg.solve(1.0 / (np.pi * (places[None, :] - places[:, None] + 0.5)), np.ones(cells))
    assert sources.sum() == pytest.approx(0.5 * np.pi * cells, rel=1e-12)
    assert sources[-1] == pytest.approx(math.gamma(0.5) * math.gamma(cells + 0.5) / math.gamma(cells), rel=1e-12)


@pytest.mark.parametrize("longer", [0.01, 0.5, -3.0])
def test_an_end_that_moves(longer: float) -> None:
    """The force pi/2 c e at 3/4 (L' + L), in cells behind the leading edge, is between strips of lengths L' and L."""

    def sums(length: float) -> np.ndarray:
        """Force and moment of q = (s/(L - s))^(1/2)."""
        s = length * np.sin(np.linspace(0.0, 0.5 * np.pi, 4001)[:-1] + np.pi / 16000) ** 2
        weight = np.pi / 4000 * s  # q ds
        return np.array([weight.sum(), (weight * s).sum()])

    force, moment = sums(10.0 + longer) - sums(10.0)
    assert force == pytest.approx(0.5 * np.pi * longer, rel=1e-9)
    assert moment / force == pytest.approx(0.75 * (20.0 + longer), rel=1e-9)


def test_cells_as_they_are_know_nothing_of_it() -> None:
    contact = solve_normal(steel(Mesh((1.0, 1.0), (24, 24)), creepage=Creepage(1e-5)))
    assert type(contact) is NormalContact
    rolling = solve_rolling(contact, contact.scene)
    assert contact.ending(rolling, contact.scene.friction) == Ending()


@pytest.mark.heavy
@pytest.mark.parametrize("per_radius", [10, 20])
def test_kalkers_creep_coefficients(per_radius: int) -> None:
    """A round contact that hardly slips: C11, C22, C23 = 4.1128, 3.6683, 1.4661 at nu = 0.25, mean of four meshes.

    (Kalker 1967, made anew with polynomials over the root of what is left to the edge.) Forces were 1.6 and 0.9 % off,
    moments 5.6 and 2.9 %, at ten and at twenty cells a radius.
    """
    body = Material(210000.0, 0.25)
    found = []
    for wide in (2.43, 2.52, 2.64, 2.77):
        cells = round(per_radius * wide)
        scene = Scene(
            body,
            (50.0, 50.0),
            100.0,
            Mesh((1.0, 1.0), (cells, cells)),
            (),
            body,
            0.3,
            Creepage(),
            discretisation="aligned",
        )
        contact = solve_normal(scene)
        a = math.sqrt(50.0 * contact.solution.approach)
        scene = replace(scene, mesh=Mesh((wide * a, wide * a), (cells, cells)))
        longitudinal, lateral = (
            solve_scene(replace(scene, creepage=creepage)).scalars for creepage in (Creepage(1e-7), Creepage(0.0, 1e-7))
        )
        unit = body.G * a * a * 1e-7
        forces = longitudinal["force_x"] / 4.1128, lateral["force_y"] / 3.6683, lateral["moment_z"] / (1.4661 * a)
        found.append(-np.array(forces) / unit)
    off = np.abs(np.mean(found, axis=0)) - 1.0
    assert np.abs(off[:2]).max() < 0.04 / per_radius
    assert abs(off[2]) < 0.12 / per_radius


def test_ends_of_rows_twice_as_wide_lack_twice_as_much() -> None:
    """Under the same tractions, whatever the length of their cells."""
    scene = steel(Mesh((1.0, 0.7), (20, 24)), creepage=Creepage(1e-5, 2e-5), discretisation="aligned")
    contact = AlignedContact(solve_normal(scene))
    rolling, (dx, dy) = solve_rolling(contact, scene), scene.mesh.spacing
    of_cells = contact.rows, contact.centres, rolling.q, rolling.slip, scene.friction
    one = np.array(contact.ending(rolling, scene.friction))
    wide, long = (np.array(ending_of_rows(*of_cells, sides, EDGE)) for sides in ((dx, 2.0 * dy), (2.0 * dx, dy)))
    assert wide == pytest.approx(2.0 * one, rel=1e-12, abs=0.0)
    assert long[:2] == pytest.approx(2.0 * one[:2], rel=1e-12, abs=0.0)
    assert abs(one).min() > 0.0


@pytest.mark.heavy
@pytest.mark.parametrize("creepage", [Creepage(2e-5), Creepage(0.0, 3e-5), Creepage(1e-5, 3e-5)])
def test_where_little_slips(creepage: Creepage) -> None:
    """Slip zones narrower than a cell: two fifths of what sums of tractions are off are left, or less."""
    scene = replace(steel(Mesh((1.0, 1.0), (32, 32)), creepage=creepage), discretisation="aligned")
    fine = solve_scene(replace(scene, mesh=Mesh((1.0, 1.0), (320, 320)))).scalars
    found = solve_scene(scene).scalars
    contact = AlignedContact(solve_normal(scene))
    ending = contact.ending(solve_rolling(contact, scene), scene.friction)
    for name in ("force_x", "force_y"):
        summed = found[name] - getattr(ending, name)
        assert abs(found[name] - fine[name]) <= 0.4 * abs(summed - fine[name]) + 1e-6
