"""Newton's method for contact and friction: tolerances of its linear systems, and shorter steps where full ones fail.

Used for tractions alone (`rolling.py`) and for pressure and tractions together (`coupled.py`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from rcstudy.mechanics.numerics.patience import Patience

_LOOSEST = 0.45  # largest linear residual at the end of a Newton step, over its initial one
_ENOUGH = 0.8  # of the tolerance: no linear system is solved further
_SHORTEST = 0.05  # least length of a shortened step, over the full one


class State(Protocol):
    """An iterate of Newton's method."""

    @property
    def residual(self) -> float:
        """Residual over its tolerance."""

    @property
    def solved(self) -> bool:
        """Whether the iterate is a solution to its tolerance."""

    def step(self, forcing: float) -> None:
        """Take a full step, its linear system solved to `forcing` times its initial residual."""

    def shorten(self, length: float) -> None:
        """Return to the iterate before the last full step and take the part `length`, up to 1, of that step."""


def solve(state: State, max_steps: int, patience: int, lost: Callable[[], bool] = lambda: False) -> int:
    """Run Newton's method from `state` until it is solved, or for `max_steps` steps; returns the number of steps.

    It is given up as soon as it is `lost`.

    Full steps are taken as long as the residual falls by a tenth within `patience` steps. After that a step that does
    not reduce the residual is halved until it does, which breaks cycles of active sets. If no length reduces it, the
    full step is taken after all: tiny steps would make no progress.
    """
    previous, steps = np.inf, 0
    gains = Patience(patience - 1, 0.9)  # one less: the step about to be taken counts, too
    while not state.solved and steps < max_steps:
        residual = state.residual
        if np.isnan(residual) or lost():
            break
        nowhere = gains.exhausted(residual)
        state.step(forcing_term(residual, previous))
        steps += 1
        previous = residual
        length = 1.0
        while nowhere and state.residual >= previous:
            length = 0.5 * length if length >= 2.0 * _SHORTEST else 1.0
            state.shorten(length)
            if length == 1.0:
                break
    return steps


def forcing_term(residual: float, previous: float) -> float:
    """Residual to which to solve the next linear system, over its initial one: Eisenstat and Walker (1996), choice 2.

    0.9 (residual/previous)^2 by the residuals after and before the last Newton step, both over the tolerance; at most
    `_LOOSEST`, and no further than to `_ENOUGH` times the tolerance. After a step that gains little the next system is
    solved loosely again: slow progress is due to cells that change their state one after another, not to the accuracy
    of linear systems.
    """
    if not np.isfinite(previous):
        return _LOOSEST
    return min(_LOOSEST, max(0.9 * (residual / previous) ** 2, _ENOUGH / residual))
