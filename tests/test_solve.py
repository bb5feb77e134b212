"""What is made of solutions: fields, numbers and what error bars are told of them."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from contacts import STEEL, steel

from rcstudy.estimate import least_over_largest
from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.contact import solve_normal, solve_rolling
from rcstudy.mechanics.normal_operator import NormalSolution
from rcstudy.mechanics.proof import slips
from rcstudy.mechanics.rolling import RollingSolution
from rcstudy.mechanics.scene import Creepage, Layer, Mesh, Scene, Tolerance
from rcstudy.mechanics.unseen import Unseen
from rcstudy.result import Status

solve: Any = import_module("rcstudy.solve")  # in the package a function has its name

SCENE = steel(
    Mesh((1.0, 1.0), (28, 28)),
    layers=(Layer(0.3 * STEEL.E, 0.3, 0.03),),
    counterbody=None,
    friction=0.3,
    creepage=Creepage(-0.0005, 0.0002, 0.001),
    tolerance=Tolerance(1e-7, 1e-7),
    discretisation="aligned",
)


@pytest.fixture(scope="module")
def solution() -> tuple[AlignedContact, RollingSolution]:
    """Of SCENE, before anything is made of it."""
    contact = AlignedContact(solve_normal(SCENE))
    return contact, solve_rolling(contact, SCENE)


@pytest.mark.parametrize("name", ["traction_y", "slip_x"])
def test_fields_without_numbers_are_no_result(
    name: str, solution: tuple[AlignedContact, RollingSolution], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is made of solutions that are proved, on the mesh's own cells: any of it."""
    contact, rolling = solution
    made = solve._rolling_fields(contact, SCENE, rolling)
    made[name][14, 14] = np.nan
    monkeypatch.setattr(solve, "_rolling_fields", lambda *_: made)
    found = solve._result(contact, SCENE, rolling, {"proof_gap": 0.0})
    assert (found.status, found.reason) == (Status.ERROR, f"no finite numbers: {name}")


@pytest.mark.parametrize("converged", [False, True])
def test_pressures_are_solved_further_only_if_that_converges(converged: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten times as far, twice; what each took counts."""
    contact = solve_normal(SCENE)
    asked = []

    def further(scene: Scene, *_: object) -> NormalSolution:
        asked.append(scene.tolerance.normal)
        return replace(contact.solution, converged=converged, products=5)

    monkeypatch.setattr(solve, "solve_pressure", further)
    monkeypatch.setattr(solve, "failures", lambda proof, scene: ["missed"])
    polished, _ = solve._polished_pressure(contact, SCENE)
    assert (polished.solution is contact.solution) != converged
    assert asked == pytest.approx([1e-8, 1e-9] if converged else [1e-8])
    assert polished.solution.products == contact.solution.products + (10 if converged else 0)


def test_slips_that_are_stored_are_those_that_are_proved(solution: tuple[AlignedContact, RollingSolution]) -> None:
    """Not those that the solver went on with."""
    contact, rolling = solution
    found, _ = solve._polished(contact, SCENE, replace(rolling, s=np.zeros(rolling.s.shape)))
    np.testing.assert_array_equal(found.s, slips(contact, SCENE, rolling))


def test_slip_areas_are_no_larger_than_contacts(solution: tuple[AlignedContact, RollingSolution]) -> None:
    contact, rolling = solution
    zone = contact.slip_zone(rolling, SCENE.friction)
    for missing, area in ((10.0, contact.area), (-10.0, 0.0)):
        numbers = solve._rolling_numbers(contact, SCENE, rolling, zone, Unseen(missing=missing))
        assert numbers["slip_area"] == area


def test_coarser_meshes_are_given_what_their_own_cells_miss(solution: tuple[AlignedContact, RollingSolution]) -> None:
    contact, rolling = solution
    coarser, coarse = contact.coarser, rolling.coarser
    assert coarser is not None and coarse is not None
    missing = coarser.unseen_slip(coarse, SCENE.friction).missing
    assert missing != 0.0
    first, *_ = solve._coarser_numbers(contact, SCENE, rolling)
    area = coarser.slip_zone(coarse, SCENE.friction).area
    assert first["slip_area"] == pytest.approx(area + missing, rel=1e-12)


def test_bars_are_told_what_meshes_hide(solution: tuple[AlignedContact, RollingSolution]) -> None:
    contact, rolling = solution
    unseen, zone = contact.unseen_slip(rolling, SCENE.friction), contact.slip_zone(rolling, SCENE.friction)
    hidden = solve._hidden(contact, SCENE, replace(rolling, unsettled=0.003), zone, unseen)
    assert (hidden.unsettled, hidden.slip) == (0.003, unseen)
    assert hidden.by_layers == contact.outline.area_by_layers / contact.area != 0.0
    assert hidden.peak_by_layers == contact.peak_by_layers / contact.pressure_max > 0.0
    assert hidden.least_slip == least_over_largest(rolling.s) < 1.0
