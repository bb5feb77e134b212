"""The proof of a solution, of solutions that are wrong in one way each: it has to find that, and say how much."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from contacts import hertz_of, steel, window

from rcstudy.mechanics.contact import NormalContact, influence_of, solve_normal, solve_rolling
from rcstudy.mechanics.normal import initial_gap
from rcstudy.mechanics.normal_operator import NormalOperator, NormalSolution
from rcstudy.mechanics.proof import failures, prove_normal, prove_rolling, slips
from rcstudy.mechanics.scene import Creepage, Scene, Tolerance

A = hertz_of(counterbody=None).a[0]


def ball() -> Scene:
    """A steel ball on a rigid plane, of which some sticks and some slips."""
    return steel(window((A, A), (14, 14), 6), counterbody=None, friction=0.4, creepage=Creepage(0.0006, 0.0003, 0.002))


def test_nothing_is_wrong_with_a_solution() -> None:
    scene = ball()
    contact = solve_normal(scene)
    rolling = solve_rolling(contact, scene)
    assert 0 < rolling.slip.sum() < rolling.slip.size
    proof = prove_normal(contact, scene) | prove_rolling(contact, scene, rolling, slips(contact, scene, rolling))
    assert failures(proof, scene) == []


@pytest.mark.parametrize("name", ["proof_tension", "proof_load", "proof_gap"])
def test_pressures_that_are_wrong(name: str) -> None:
    scene = ball()
    contact = solve_normal(scene)
    solution = contact.solution
    if name == "proof_tension":
        pulling = solution.p.copy()
        pulling[tuple(np.argwhere(pulling > 0.0)[0])] = -0.03 * pulling.max()
        solution = replace(solution, p=pulling)
    elif name == "proof_load":
        solution = replace(solution, p=1.03 * solution.p)
    else:
        solution = replace(solution, approach=solution.approach / 1.03)
    proof = prove_normal(NormalContact(scene, contact.influence, solution), scene)
    assert proof[name] == pytest.approx(0.03, rel=1e-6)
    assert any(text.startswith(f"{name} = 0.03") for text in failures(proof, scene))


def test_overlap_beyond_the_box_of_the_contact() -> None:
    """A punch of eight by eight cells, where the surfaces overlap all around, most of all beside its sides."""
    scene = ball()
    n = scene.mesh.cells[0]
    p = np.zeros(scene.mesh.cells)
    p[n // 2 - 4 : n // 2 + 4, n // 2 - 4 : n // 2 + 4] = 1.0
    p *= scene.load / (p.sum() * math.prod(scene.mesh.spacing))
    influence = influence_of(scene)
    gap = initial_gap(scene) + NormalOperator.of(influence, p.shape).displacement(p)
    approach = float(gap[p > 0.0].max())
    solution = NormalSolution(p, approach, 0.0, 1, 1, converged=True)
    proof = prove_normal(NormalContact(scene, influence, solution), scene)
    overlap = float((approach - gap[p == 0.0]).max()) / approach
    assert overlap > 0.01
    assert proof["proof_penetration"] == pytest.approx(overlap, rel=1e-9)


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ("a stick cell slips", "proof_stick"),
        ("slip along the traction", "proof_slip"),
        ("slip across the traction", "proof_slip"),
        ("a stick cell beyond its bound", "proof_bound"),
        ("a slip cell short of its bound", "proof_bound"),
    ],
)
def test_tractions_that_are_wrong(wrong: str, name: str) -> None:
    """In one cell, by 3 % of the largest slip without tractions, or of the largest bound."""
    scene = ball()
    contact = solve_normal(scene)
    rolling = solve_rolling(contact, scene)
    s, q, bound = slips(contact, scene, rolling), rolling.q.copy(), scene.friction * contact.pressure
    fastest = float(np.hypot(*contact.known_slip(scene).T).max())
    # the cell pressed most of those that stick or slip
    cell = int(np.where(rolling.slip == ("stick" not in wrong), bound, 0.0).argmax())
    along = q[cell] / np.hypot(*q[cell])
    if wrong == "a stick cell slips":
        s[cell] = 0.03 * fastest * along
    elif wrong == "slip along the traction":
        s[cell] = 0.015 * fastest * along
    elif wrong == "slip across the traction":
        s[cell] += 0.03 * fastest * along[::-1] * [-1.0, 1.0]
    elif wrong == "a stick cell beyond its bound":
        q[cell] = along * (bound[cell] + 0.03 * bound.max())
    else:
        q[cell] = along * (bound[cell] - 0.03 * bound.max())
    proof = prove_rolling(contact, scene, replace(rolling, q=q), s)
    assert proof[name] == pytest.approx(0.03, rel=0.1)
    assert [text.split(" = ")[0] for text in failures(proof, scene)] == [name]


def test_limits() -> None:
    """A hundred tolerances; load and bound are kept to 1e-9 at any tolerance, nothing pulls, no number never passes."""
    loose = replace(ball(), tolerance=Tolerance(1e-4, 1e-5))
    limits = {"proof_tension": 0.0, "proof_load": 1e-9, "proof_bound": 1e-9, "proof_gap": 1e-2}
    limits |= {"proof_penetration": 1e-2, "proof_stick": 1e-3, "proof_slip": 1e-3}
    for name, limit in limits.items():
        assert failures({name: 0.99 * limit}, loose) == []
        assert len(failures({name: 1.01 * limit + 1e-300}, loose)) == 1
        assert len(failures({name: math.nan}, loose)) == 1
