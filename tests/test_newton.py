"""Newton's method for contact and friction: forcing terms and step lengths, on states that follow a script."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from contacts import steel

from rcstudy.mechanics import rolling
from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.contact import solve_normal
from rcstudy.mechanics.numerics import newton
from rcstudy.mechanics.numerics.patience import Patience
from rcstudy.mechanics.scene import Creepage, Mesh


class Scripted:
    """A state whose residuals are told beforehand: after each full step, and after each part of it."""

    def __init__(self, first: float, steps: list[tuple[float, dict[float, float]]]) -> None:
        self.residual = first
        self.steps = iter(steps)
        self.asked: list[float] = []
        self.lengths: list[list[float]] = []

    @property
    def solved(self) -> bool:
        return self.residual <= 1.0

    def step(self, forcing: float) -> None:
        self.asked.append(forcing)
        self.lengths.append([])
        self.full, self.parts = next(self.steps)
        self.residual = self.full

    def shorten(self, length: float) -> None:
        self.lengths[-1].append(length)
        self.residual = self.parts.get(length, self.full)


def test_linear_systems_are_solved_as_far_as_newton_gets_on() -> None:
    """Loosely at first, then as the residual fell; never past the tolerance; loosely after little gain."""
    state = Scripted(1e4, [(1e3, {}), (1.0e2, {}), (2.0, {}), (1.9, {}), (0.5, {})])
    assert newton.solve(state, 10, 5) == 5
    assert state.asked == pytest.approx([0.45, 0.009, 0.009, 0.4, 0.45])
    assert state.lengths == [[], [], [], [], []]


def test_nothing_is_done_for_a_solved_state_and_no_more_than_allowed() -> None:
    assert newton.solve(Scripted(1.0, []), 10, 5) == 0
    endless = Scripted(9.0, [(9.0, {})] * 3)
    assert newton.solve(endless, 3, 5) == 3
    assert endless.residual == 9.0


def test_steps_end_where_the_state_is_lost() -> None:
    state = Scripted(9.0, [(90.0, {}), (900.0, {}), (0.5, {})])
    assert newton.solve(state, 10, 5, lambda: state.residual > 100.0) == 2
    assert state.residual == 900.0


def test_nothing_is_done_once_the_residual_is_not_a_number() -> None:
    assert newton.solve(Scripted(math.nan, []), 10, 5) == 0
    assert newton.solve(Scripted(9.0, [(math.nan, {})]), 10, 5) == 1


def test_steps_are_shortened_once_patience_is_at_its_end() -> None:
    """To the first length at which the residual falls; where it falls at none, the full step stays."""
    quarter = (12.0, {0.5: 11.0, 0.25: 9.5})
    none = (30.0, {0.5: 29.0, 0.25: 28.0, 0.125: 27.0, 0.0625: 26.0})
    state = Scripted(10.0, [(11.0, {}), (10.0, {}), quarter, none, (0.9, {})])
    assert newton.solve(state, 10, 3) == 5
    assert state.lengths == [[], [], [0.5, 0.25], [0.5, 0.25, 0.125, 0.0625, 1.0], []]


def test_a_step_that_changes_nothing_is_shortened() -> None:
    """As one that makes the residual larger; a part of it that changes nothing, either, is no gain."""
    state = Scripted(10.0, [(10.0, {}), (10.0, {}), (10.0, {0.5: 10.0, 0.25: 9.5}), (0.9, {})])
    assert newton.solve(state, 10, 3) == 4
    assert state.lengths == [[], [], [0.5, 0.25], []]


@pytest.mark.parametrize(
    ("steps", "part", "expected"),
    [(3, 1.0, [0, 0, 0, 0, 0, 0, 1, 0]), (2, 0.5, [0, 0, 1, 0, 0, 1, 1, 1]), (1, 0.1, [0, 1, 1, 0, 1, 1, 1, 1])],
)
def test_patience_ends_after_steps_that_get_nowhere(steps: int, part: float, expected: list[int]) -> None:
    """A residual that is not a number is no gain, either."""
    patience = Patience(steps, part)
    found = [patience.exhausted(residual) for residual in (9.0, 8.0, 7.0, 0.8, 0.8, 0.9, math.nan, 0.7999)]
    assert found == [bool(end) for end in expected]
    assert not Patience(2).exhausted(math.nan)


@pytest.mark.parametrize(
    ("unsettled", "looks", "left"),
    [([9e-5], 0, 9e-5), ([2e-4, 9e-5], 1, 9e-5), ([8e-3, 3e-3, 1e-3, 6e-4], 3, 6e-4), ([2e-3, 1.1e-3], 1, 1.1e-3)],
)
def test_slip_is_looked_at_again_while_that_halves_what_is_unsettled(
    unsettled: list[float], looks: int, left: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Down to a ten-thousandth of the bounds; Newton's steps after each look count."""
    looked = []
    system = SimpleNamespace(frozen_correction=0.0, unsettled=lambda q, s: unsettled[len(looked)])
    state: Any = SimpleNamespace(system=system, solved=True, q=None, s=None, look_again=lambda: looked.append(1))
    monkeypatch.setattr(newton, "solve", lambda *_: 4)
    assert rolling._look_again(state) == (4 * looks, left)


@pytest.mark.parametrize(
    ("unsettled", "looks", "parts", "left"),
    [
        ([0.03, 0.031, 0.018, 0.0095], 1, [0.5, 0.5], 0.0095),
        ([0.03, 0.014, 0.0069, 0.008], 3, [], 0.008),
        ([0.03, 0.031, *[0.04] * 20], 1, [0.5**k for k in range(1, 7)], 0.03),
        ([0.03, 0.031, 0.02, 0.021, 0.012, 0.013, 0.009], 1, [0.5, 0.5, 0.25, 0.25, 0.125], 0.009),
    ],
)
def test_slip_is_moved_part_of_the_way_where_looking_again_gets_nowhere(
    unsettled: list[float], looks: int, parts: list[float], left: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where that leaves more than a hundredth of the bounds: half of it, from the best, less if this is no better."""
    looked: list[float] = []
    system = SimpleNamespace(frozen_correction=0.0, unsettled=lambda q, s: unsettled[len(looked)])
    state: Any = SimpleNamespace(system=system, solved=True, q=None, s=None, resume=lambda *_: None)
    state.look_again, state.go_part = lambda: looked.append(1.0), looked.append
    monkeypatch.setattr(newton, "solve", lambda *_: 4)
    steps, reached = rolling._look_again(state)
    assert looked == [1.0] * looks + parts
    assert (steps, reached) == (4 * len(looked), left)


def test_nothing_is_unsettled_once_the_slip_itself_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    system = SimpleNamespace(frozen_correction=0.0, unsettled=lambda q, s: 0.01)
    state: Any = SimpleNamespace(system=system, solved=True, q=None, s=None)
    state.look_again = lambda: setattr(system, "frozen_correction", None)
    monkeypatch.setattr(newton, "solve", lambda *_: 3)
    assert rolling._look_again(state) == (3, 0.0)


def test_unsettled_tractions_are_measured_by_all_bounds() -> None:
    """Two slip cells that fall short of theirs by a tenth: a tenth of these two, over the sum of all."""
    scene = steel(Mesh((1.0, 1.0), (20, 20)), creepage=Creepage(0.002, 0.0, 0.01), friction=0.3)
    contact = AlignedContact(solve_normal(scene))
    operator, cells = contact.operator, contact.cells_of_operator
    bound, w = scene.friction * contact.pressure, contact.known_slip(scene)
    system = rolling.NewtonSystem(operator, cells, bound, w, contact.neighbours)
    found = rolling.solve_tractions(operator, cells, bound, w, 1e-10, None, contact.neighbours)
    system.slip[:] = found.slip
    assert system.unsettled(found.q, found.s_ahead) < 1e-8
    q, short = found.q.copy(), np.flatnonzero(found.slip)[[3, 20]]
    q[short] *= 0.9
    assert system.unsettled(q, found.s_ahead) == pytest.approx(0.1 * bound[short].sum() / bound.sum(), rel=1e-6)
