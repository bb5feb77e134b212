"""Newton's method for contact and friction: how far linear systems are solved, and what is done when steps fail.

Common to tractions alone (`rolling.py`) and to pressure and tractions together (`coupled.py`).
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from rcstudy.mechanics.patience import Patience

_LOOSEST = 0.45  # linear residual of a Newton step, over its first one
_ENOUGH = 0.8  # of the tolerance: how far the last linear system is solved
_SHORTEST = 0.05  # step length


class State(Protocol):
    """Where Newton's method stands."""

    @property
    def residual(self) -> float:
        """Residual in units of its tolerance."""

    @property
    def solved(self) -> bool:
        """Whether nothing is left to do."""

    def step(self, forcing: float) -> None:
        """Take a full step, its linear system solved to `forcing` of its first residual."""

    def shorten(self, length: float) -> None:
        """Go back, and take the part `length`, up to 1, of the last full step."""


def solve(state: State, max_steps: int, patience: int) -> int:
    """Newton's method from `state` until it is solved, or for `max_steps` steps. Returns the steps taken.

    Full steps as long as they get anywhere: a gain of a tenth in `patience` steps. Then shorter ones, down to where
    the residual falls, which break a cycle of active sets. Where it falls for none the full step is taken after all:
    tiny ones would end where they began.
    """
    previous, steps = np.inf, 0
    gains = Patience(patience - 1, 0.9)  # the step that is about to be taken is one of them
    while not state.solved and steps < max_steps:
        residual = state.residual
        if np.isnan(residual):
            break
        nowhere = gains.ends(residual)
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
    """How far to solve the next linear system: Eisenstat and Walker (1996), choice 2.

    As far as the last Newton step got on with the nonlinear problem, no looser than `_LOOSEST`, and never past
    `_ENOUGH` of the tolerance, which is the unit of `residual` and the `previous` one. No further where steps gain
    little: that is because of cells that change their state one after another, not of linear systems.
    """
    if not np.isfinite(previous):
        return _LOOSEST
    return min(_LOOSEST, max(0.9 * (residual / previous) ** 2, _ENOUGH / residual))
