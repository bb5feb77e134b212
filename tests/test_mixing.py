"""Anderson's mixing of guesses, and the turns of pressure and tractions that it serves."""

from __future__ import annotations

import numpy as np
import pytest

from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.contact import NormalContact, influence_of, solve_normal
from rcstudy.mechanics.half_line import HALF_SPACE
from rcstudy.mechanics.normal import initial_gap, solve_pressure
from rcstudy.mechanics.numerics.mixing import Mixing
from rcstudy.result import Status
from rcstudy.solve import solve_scene
from rcstudy.study import scene_from_mapping


def naive(guesses: list[np.ndarray], changes: list[np.ndarray], where: np.ndarray) -> np.ndarray:
    """The mean of all guesses, each with its change, whose change has the least spread, by its normal equations."""
    spread = np.array([change[where] - change[where].mean() for change in changes])
    n = len(guesses)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n] = spread @ spread.T
    system[n, :n] = system[:n, n] = 1.0
    weights = np.linalg.solve(system, np.eye(n + 1)[n])[:n]
    return sum(weight * (guess + change) for weight, guess, change in zip(weights, guesses, changes, strict=True))


def test_mixing_takes_the_least_change():
    rng = np.random.default_rng(7)
    mixing, guesses, changes = Mixing(), [], []
    where = rng.random((6, 5)) < 0.8
    for _ in range(5):
        guesses.append(rng.normal(size=(6, 5)))
        changes.append(rng.normal(size=(6, 5)))
        following = mixing.following(guesses[-1], changes[-1], where)
        assert following == pytest.approx(naive(guesses, changes, where), rel=1e-9, abs=1e-9)
    mixing.forget()
    assert mixing.following(guesses[0], changes[0], where) == pytest.approx(guesses[0] + changes[0])


def test_guesses_are_not_mixed_where_a_change_is_no_number(capfd: pytest.CaptureFixture[str]) -> None:
    """Be it the last change or an earlier one: the next guess then is what the last one leads to."""
    everywhere, rng = np.ones(6, dtype=np.bool_), np.random.default_rng(4)
    guesses, changes = rng.normal(size=(2, 4, 6))
    for bad in (1, 3):
        mixing, told = Mixing(), changes.copy()
        told[bad, 2] = np.nan
        for guess, change in zip(guesses, told, strict=True):
            following = mixing.following(guess, change, everywhere)
        np.testing.assert_array_equal(following, guess + change)
    assert capfd.readouterr().out == ""


def test_mixing_ends_what_substitution_does_not():
    """A linear turn with four eigenvalues, one beyond -1, is at its fixed point after five, where turns alone swing.

    A constant that all values have in common does not matter to it.
    """
    rng = np.random.default_rng(3)
    basis = np.linalg.qr(np.column_stack([np.ones(9), rng.normal(size=(9, 4))]))[0][:, 1:]
    fixed = rng.normal(size=9)
    everywhere = np.ones(9, dtype=np.bool_)

    def turn(x: np.ndarray) -> np.ndarray:
        return fixed + basis @ (np.array([-1.7, -0.6, 0.4, 0.9]) * (basis.T @ (x - fixed))) + rng.normal()

    mixing, x, plain = Mixing(), basis @ np.ones(4), basis @ np.ones(4)
    for _ in range(6):
        x = mixing.following(x, turn(x) - x, everywhere)
        plain = turn(plain)
    assert np.ptp(turn(x) - x) < 1e-9
    assert np.ptp(turn(plain) - plain) > 10.0


def on_rubber(modulus: float, nu: float, thickness: float, friction: float, creepage: dict[str, float]):
    """A case of rubber on steel, aligned cells, full coupling."""
    return scene_from_mapping(
        {
            "substrate": {"E": 210000, "nu": 0.3},
            "layers": [{"E": modulus, "nu": nu, "thickness": thickness}],
            "radius": 50,
            "load": 50,
            "friction": friction,
            "coupling": "full",
            "creepage": creepage,
            "mesh": {"size": "auto", "cells": [40, 40]},
            "discretisation": "aligned",
        }
    )


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("layer", "friction", "creepage"),
    [
        ((36.7, 0.4728, 0.177), 1.5, {"longitudinal": 0.3, "lateral": 0.02, "spin": 0.05}),
        ((1.146, 0.4287, 0.129), 1.0, {"longitudinal": 0.3, "lateral": -0.3}),
        ((1.1, 0.4974, 0.18), 0.5, {"longitudinal": 0.02, "lateral": 0.3, "spin": 0.05}),
        ((1.247, 0.3675, 0.1113), 1.0, {"longitudinal": 0.02}),
        ((1.859, 0.4431, 0.1019), 1.5, {"longitudinal": -0.3, "lateral": -0.3, "spin": 0.05}),
        # pressures on rows that stay jumped with each cell that came into contact or left it
        ((1.117, 0.4762, 0.1536), 1.0, {"longitudinal": 0.02, "lateral": -0.3, "spin": -0.05}),
        ((1.33, 0.4931, 0.7373), 1.0, {"lateral": -0.02}),
        ((3.099, 0.4865, 0.133), 1.5, {"longitudinal": 0.3, "lateral": 0.02}),
        # many modes of a film grow: 16 turns, or mixtures of eight, were too few
        ((14.663, 0.4971, 0.1148), 1.5, {"longitudinal": -0.02, "lateral": -0.3}),
        # windows were too small: eight turns of a sliding film told too little of where it reaches
        ((37.728, 0.4916, 0.1272), 1.5, {"longitudinal": 0.02, "lateral": 0.3, "spin": 0.05}),
        ((5.905, 0.4987, 0.3416), 1.5, {"longitudinal": 0.3}),
    ],
)
def test_turns_on_rubber_settle(layer, friction, creepage):
    """They crept, or swung between two sets of cells, and left gaps of 1e-3 to 1e-2 of the approach."""
    result = solve_scene(on_rubber(*layer, friction, creepage))
    assert result.status == Status.SOLVED, result.reason


@pytest.mark.heavy
def test_rows_that_stay():
    """Rows taken from another contact have its places and cells, also in another box; each carries its own force."""
    scene = on_rubber(5.0, 0.4, 0.5, 0.5, {"longitudinal": 0.02})
    influence, gap = influence_of(scene), initial_gap(scene)
    contact = AlignedContact(solve_normal(scene, influence))
    x, _ = scene.mesh.centres
    tilted = solve_pressure(scene, influence, gap + 0.03 * (x[:, None] / x[-1]), contact.solution.p)
    other = NormalContact(scene, influence, tilted)
    free, held = AlignedContact(other), AlignedContact(other, like=contact)
    assert free.box != contact.box
    places, of_free, of_held = ({*zip(*np.round(c.centres, 9), strict=True)} for c in (contact, free, held))
    assert of_held <= places
    assert not of_free <= places
    rows = np.unique(held.cells[:, 1])
    assert np.array_equal(rows, np.unique(free.cells[:, 1]))
    assert free.carrying.all()
    assert not held.carrying.all()  # the tilt has left cells of rows that stay
    assert (np.diff(rows) == 1).all()
    force = tilted.p[:, held.box.j0 + rows].sum(axis=0)
    evened = force + np.diff([0.0, *np.diff(force), 0.0]) * HALF_SPACE.excess  # nothing goes beyond the outermost
    for made in (held, free):
        carried = [made.pressure[made.carrying & (made.cells[:, 1] == row)].sum() for row in rows]
        np.testing.assert_allclose(carried, evened, rtol=1e-12)


@pytest.mark.heavy
@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-6])
@pytest.mark.parametrize(
    ("substrate", "layer", "ry", "friction", "creepage"),
    [
        (4656.0, (19.42e6, 0.3285, "0.034536 a"), 27.34, 0.7334, {"longitudinal": 3.14e-4, "lateral": 2.517e-3}),
        (46379.0, (43.68e6, 0.068, "0.040449 a"), 96.67, 0.588, {"longitudinal": 3.96e-3, "lateral": 1.169e-2}),
    ],
)
def test_plates_at_any_tolerance(discretisation, tolerance, substrate, layer, ry, friction, creepage):
    """Turns that were solved no further than a loose tolerance left Newton's method where it found no way."""
    modulus, nu, thickness = layer
    scene = scene_from_mapping(
        {
            "substrate": {"E": substrate, "nu": 0.3},
            "layers": [{"E": modulus, "nu": nu, "thickness": thickness}],
            "radius": [50, ry],
            "load": 100,
            "friction": friction,
            "coupling": "full",
            "creepage": creepage,
            "mesh": {"size": "auto", "cells": [64, 64], "margin": 1.6},
            "tolerance": {"normal": tolerance, "tangential": tolerance},
            "discretisation": discretisation,
        }
    )
    result = solve_scene(scene)
    assert result.status == Status.SOLVED, result.reason
