"""What is made of solutions: fields, numbers and what error bars are told of them."""

from __future__ import annotations

import math
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from contacts import STEEL, steel

from rcstudy.bars.hidden import least_over_largest
from rcstudy.mechanics import contact as one_contact
from rcstudy.mechanics import influence
from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.contact import NormalContact, solve_normal, solve_rolling
from rcstudy.mechanics.normal_operator import NormalOperator, NormalSolution
from rcstudy.mechanics.proof import prove_normal, prove_rolling, slips
from rcstudy.mechanics.rolling import RollingSolution
from rcstudy.mechanics.scene import Creepage, Layer, Mesh, Scene, Tolerance
from rcstudy.mechanics.subcell.trailing import Ending
from rcstudy.mechanics.subcell.unseen import Unseen
from rcstudy.result import Status
from rcstudy.study import scene_from_mapping

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
    found = solve._result(contact, SCENE, rolling, prove_normal(contact, SCENE))
    assert (found.status, found.reason) == (Status.ERROR, f"no finite numbers: {name}")


@pytest.mark.parametrize("name", ["traction_max_error", "approach_error"])
def test_scalars_without_an_estimate_are_no_result(
    name: str, solution: tuple[AlignedContact, RollingSolution], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A scalar of ESTIMATED that has no fit had NaN as its estimate, in cases said to be solved."""
    made = solve.error_estimates
    monkeypatch.setattr(solve, "error_estimates", lambda *of: {n: x for n, x in made(*of).items() if n != name})
    contact, rolling = solution
    found = solve._result(contact, SCENE, rolling, prove_normal(contact, SCENE))
    assert (found.status, found.reason) == (Status.ERROR, f"no finite numbers: {name}")


@pytest.mark.parametrize(("converged", "edge"), [(False, False), (True, False), (True, True)])
def test_pressures_are_solved_further_only_if_that_converges(
    converged: bool, edge: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ten times as far, four times, and within the window; what each took counts."""
    contact = solve_normal(SCENE)
    asked = []

    def further(scene: Scene, *_: object) -> NormalSolution:
        asked.append(scene.tolerance.normal)
        return replace(contact.solution, converged=converged, edge=edge, products=5)

    monkeypatch.setattr(solve, "solve_pressure", further)
    monkeypatch.setattr(solve, "failures", lambda proof, scene: ["missed"])
    polished, _ = solve._polished_pressure(contact, SCENE)
    taken = converged and not edge
    assert (polished.solution is contact.solution) != taken
    assert asked == pytest.approx([1e-8, 1e-9, 1e-10, 1e-11] if taken else [1e-8])
    assert polished.solution.products == contact.solution.products + (20 if taken else 0)


@pytest.mark.parametrize(("attainable", "status"), [(2.0, Status.REFUSED), (0.5, Status.NOT_CONVERGED)])
def test_pressures_without_end_are_refused_where_rounding_is_the_reason(attainable: float, status: Status) -> None:
    """`attainable`: over the tolerance that is asked for."""
    contact = solve_normal(SCENE)
    off = replace(contact.solution, converged=False, attainable=attainable * SCENE.tolerance.normal)
    found = solve._normal_failure(NormalContact(SCENE, contact.influence, off))
    assert found is not None and found.status == status


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
    assert hidden.largest_slip == np.hypot(*rolling.s.T).max() > 0.0


def test_slip_of_cells_that_carry_nothing_is_none(
    solution: tuple[AlignedContact, RollingSolution], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where a plate has lifted off, however slow: it does not tell whether all slips fast, nor whether law is kept."""
    contact, rolling = solution
    proved, s = slips(contact, SCENE, rolling), slips(contact, SCENE, rolling)
    cells = [int(np.flatnonzero(rolling.slip == slip)[0]) for slip in (False, True)]
    s[cells] = (0.1, -0.1)
    held, broken = (prove_rolling(contact, SCENE, rolling, either) for either in (proved, s))
    assert min(broken["proof_stick"], broken["proof_slip"]) > 1.0
    carrying = np.ones(len(s), dtype=bool)
    carrying[cells] = False
    with monkeypatch.context() as lifted:
        lifted.setattr(contact, "carrying", carrying)
        without = prove_rolling(contact, SCENE, rolling, s)
    assert all(value <= held[key] for key, value in without.items())
    slow = replace(rolling, s=np.full(rolling.s.shape, 0.002))
    slow.s[7] = 1e-9
    slow.s[8] = 0.3
    carrying = np.abs(np.arange(len(slow.s)) - 7.5) > 1.0
    monkeypatch.setattr(contact, "carrying", carrying)
    hidden = solve._hidden(contact, SCENE, slow, contact.slip_zone(rolling, SCENE.friction), Unseen())
    assert hidden.least_slip == 1.0
    assert hidden.largest_slip == pytest.approx(0.002 * math.sqrt(2.0), rel=1e-12)


@pytest.mark.parametrize("large", [1.0, 1e3])
def test_sums_of_cells_are_given_what_these_miss(
    large: float, solution: tuple[AlignedContact, RollingSolution], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What ends of rows lack and less of what leading cells have too much; all of it in part, if friction has no more.

    Power is that of the creepages on these forces, and of what leading cells hide.
    """
    contact, rolling = solution
    zone = contact.slip_zone(rolling, SCENE.friction)
    force_x, force_y, moment = contact.resultant(rolling, SCENE.friction)
    monkeypatch.setattr(contact, "ending", lambda *_: Ending(0.3 * large, 0.1 * large, 0.02 * large))
    unseen = Unseen(force_x=0.05 * large, force_y=-0.04 * large, moment_z=0.007 * large, work=1e-3 * large)
    found = solve._rolling_numbers(contact, SCENE, rolling, zone, unseen)
    part = (found["force_x"] - force_x) / (0.25 * large)
    if large == 1.0:
        assert part == pytest.approx(1.0, rel=1e-9)
    else:
        assert np.hypot(found["force_x"], found["force_y"]) == pytest.approx(SCENE.friction * SCENE.load, rel=1e-9)
        assert 0.0 < part < 1.0
    assert found["force_y"] - force_y == pytest.approx(part * 0.14 * large, rel=1e-9)
    assert found["moment_z"] - moment == pytest.approx(part * 0.013 * large, rel=1e-9)
    forces = found["force_x"], found["force_y"], found["moment_z"]
    power = contact.friction_power(rolling, SCENE.creepage, forces)
    assert found["friction_power"] - power == pytest.approx(part * 1e-3 * large, rel=1e-6)


def test_power_is_no_less_than_nothing_but_its_bar_is_what_it_was(
    solution: tuple[AlignedContact, RollingSolution], monkeypatch: pytest.MonkeyPatch
) -> None:
    """On rubber covers it is the difference of two that are several times as large, and was below zero."""
    contact, rolling = solution
    bars, powers = [], []
    for lost in (0.0, 1.0):
        numbers = solve._rolling_numbers

        def less(*of: Any, numbers: Any = numbers, lost: float = lost) -> dict[str, float]:
            found: dict[str, float] = numbers(*of)
            return found | {"friction_power": found["friction_power"] - lost}

        with monkeypatch.context() as patched:
            patched.setattr(solve, "_rolling_numbers", less)
            scalars = solve._result(contact, SCENE, rolling).scalars
        powers.append(scalars["friction_power"])
        bars.append(scalars["friction_power_error"])
    assert 0.0 < powers[0] < 1.0 and powers[1] == 0.0
    assert bars[1] >= bars[0] > 0.0


def test_tractions_that_did_not_converge_are_that_whatever_the_proof_says(
    solution: tuple[AlignedContact, RollingSolution],
) -> None:
    """The reasons of both are given."""
    contact, rolling = solution
    found = solve._result(contact, SCENE, replace(rolling, converged=False), {"proof_gap": 1.0})
    assert found.status == Status.NOT_CONVERGED
    assert found.reason.startswith("tractions: residual") and "proof_gap = 1 exceeds" in found.reason


def test_small_tractions_ask_for_a_sharper_pressure(monkeypatch: pytest.MonkeyPatch) -> None:
    """By how far they are below their bounds, as far as rounding allows; without one the shared pressure stays."""
    shared, ratios, asked = solve._Shared(SCENE, False), [], []
    rolling = solve_rolling(shared.contact, SCENE)

    def sharper(scene: Scene, tolerance: float) -> tuple[AlignedContact, dict[str, float]]:
        asked.append(tolerance)
        return shared.contact, shared.proof

    monkeypatch.setattr(solve, "pressure_tolerance", lambda tolerance, ratio: ratios.append(ratio) or 0.0)
    monkeypatch.setattr(shared, "_sharper_contact", sharper)
    for converged in (True, False):
        monkeypatch.setattr(solve, "solve_rolling", lambda *_, end=converged: replace(rolling, converged=end))
        found = shared._under_sharper_pressure(SCENE, rolling)
        assert (found is not None) == converged
    bounds = SCENE.friction * np.linalg.norm(shared.contact.pressure)
    assert ratios == pytest.approx([bounds / np.linalg.norm(rolling.q)] * 2, rel=1e-9)
    assert asked == [shared.contact.solution.attainable] * 2 and asked[0] > 0.0


def test_residual_that_rounding_allows() -> None:
    """Noise of both gaps, by the stiffness, on each loaded cell, over the pressure."""
    none = np.zeros((2, 2))
    operator = NormalOperator((2, 2), none, none, 3.0, none)
    p, noise = np.array([[2.0, 0.0], [2.0, 1.0]]), np.finfo(float).eps * 3.0 * np.sqrt(3.0) / 3.0
    gaps = np.array([[0.0, 1.0], [-5.0, 0.5]]), np.array([[0.0, -0.25], [0.0, 0.125]])
    assert operator.attainable(*gaps, p) == pytest.approx(5.25 * noise, rel=1e-12, abs=0.0)
    assert operator.attainable(*gaps[::-1], p) == pytest.approx(5.25 * noise, rel=1e-12, abs=0.0)


@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
@pytest.mark.parametrize(("cells", "radius"), [((4, 33), 200_000.0), ((7, 7), 50.0), ((9, 9), 5000.0)])
def test_no_coefficients_beyond_the_tables_are_asked_for(
    monkeypatch: pytest.MonkeyPatch, discretisation: str, cells: tuple[int, int], radius: float
) -> None:
    """In windows of few cells, whose boxes are padded most, also of the coarser mesh."""
    farthest = []

    def noted(tables: Any, spacing: tuple[float, float], have: Any, out: np.ndarray, softness: float) -> None:
        farthest.append(math.hypot(*((n - 0.5) * side for n, side in zip(out.shape[1:], spacing, strict=True))))
        made(tables, spacing, have, out, softness)

    made = influence.layer_integrals
    monkeypatch.setattr(influence, "layer_integrals", noted)
    one_contact.forget_influence()
    scene = scene_from_mapping(
        {
            "substrate": {"E": 210000, "nu": 0.3},
            "radius": [radius, 50],
            "load": 100,
            "layers": [{"E": "0.5 Es", "nu": 0.3, "thickness": 0.05}],
            "creepage": {"spin": 0.001},
            "mesh": {"size": "auto", "cells": list(cells), "margin": 1.05},
            "coupling": "full",
            "discretisation": discretisation,
        }
    )
    assert solve.solve_scene(scene).status == Status.SOLVED
    assert max(farthest) / math.hypot(*scene.mesh.size) < 2.0 < one_contact._REACH
