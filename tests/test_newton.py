"""Newton's method for contact and friction: forcing terms and step lengths, on states that follow a script."""

from __future__ import annotations

import math

import pytest

from rcstudy.mechanics import newton
from rcstudy.mechanics.patience import Patience


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


def test_steps_are_shortened_once_patience_is_at_its_end() -> None:
    """To the first length at which the residual falls; where it falls at none, the full step stays."""
    quarter = (12.0, {0.5: 11.0, 0.25: 9.5})
    none = (30.0, {0.5: 29.0, 0.25: 28.0, 0.125: 27.0, 0.0625: 26.0})
    state = Scripted(10.0, [(11.0, {}), (10.0, {}), quarter, none, (0.9, {})])
    assert newton.solve(state, 10, 3) == 5
    assert state.lengths == [[], [], [0.5, 0.25], [0.5, 0.25, 0.125, 0.0625, 1.0], []]


@pytest.mark.parametrize(
    ("steps", "part", "expected"),
    [(3, 1.0, [0, 0, 0, 0, 0, 0, 1, 0]), (2, 0.5, [0, 0, 1, 0, 0, 1, 1, 1]), (1, 0.1, [0, 1, 1, 0, 1, 1, 1, 1])],
)
def test_patience_ends_after_steps_that_get_nowhere(steps: int, part: float, expected: list[int]) -> None:
    """A residual that is not a number is no gain, either."""
    patience = Patience(steps, part)
    found = [patience.ends(residual) for residual in (9.0, 8.0, 7.0, 0.8, 0.8, 0.9, math.nan, 0.7999)]
    assert found == [bool(end) for end in expected]
