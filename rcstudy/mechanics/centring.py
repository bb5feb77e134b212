"""Slip at the centres of slip cells, from the points half a cell ahead to which it belongs (`aligned.py`).

Coulomb's law wants traction and slip at one place. Between three points along a row slip goes by a parabola, at its
trailing end by the one through the next two; at its leading end, and beside a stick cell ahead, by a straight line. (By
a straight line at the trailing end, too, moments by spin were farther off by 0.1 (dx/a)^2.) Where slip turns round
within a cell or two (the pole of spin) less is added, so that half of a cell's own slip along its own direction is left
at least.

What is added depends on the slip and on which cells slip, while states follow from slip where it belongs. That is
consistent nearly always, but a few cells beside a pole may want to stick as soon as they slip, and to slip as soon as
they stick. So when recomputing the slip gets nowhere, what is added is kept as it is: it is part of the known slip
then, and the rest is Coulomb's law for that. Once that is solved, it is looked at again, for as long as tractions come
nearer to what the slip asks for; how far off they end is reported (`RollingSolution.unsettled`).
"""

from __future__ import annotations

import numpy as np

from rcstudy.mechanics.kernels import tractions
from rcstudy.mechanics.patience import Patience

_PATIENCE = 4  # looks in which the residual is not halved


class Centring:
    """What is added to the slip of the cells with `neighbours` [2, m], ahead and behind, their own where there is none.

    `weight` [3, m]: of the cells ahead, behind and second ahead, from the last look at the slip; `kept` [m, 2]: what is
    added, if it no longer depends on the slip.
    """

    def __init__(self, neighbours: np.ndarray) -> None:
        self.weight = np.zeros((3, neighbours.shape[1]))
        self.neighbours = neighbours
        self.begin()

    def begin(self) -> None:
        """Look at the slip from now on."""
        self.kept: np.ndarray | None = None
        self._patience = Patience(_PATIENCE, 0.5)

    def look(self, s: np.ndarray, slip: np.ndarray) -> np.ndarray:
        """Slips [m, 2] at the centres of `slip` cells by `s` [m, 2]; sets `weight`, of the next linear system."""
        centred = np.empty(s.shape)
        tractions.centre(s, slip, self.neighbours, self.weight, centred)
        return centred

    def judge(self, s: np.ndarray, centred: np.ndarray, residual: float) -> None:
        """Keep what a look made of `s`, if this one's residual and those before it show that looking gets nowhere."""
        if self._patience.ends(residual):
            self.kept = centred - s


def slip_at_centres(
    s: np.ndarray, slip: np.ndarray, neighbours: np.ndarray, kept: np.ndarray | None = None
) -> np.ndarray:
    """Slip `s` [m, 2], which belongs to the points half a cell ahead, at the centres of `slip` cells.

    `neighbours` [2, m]: numbers of the cells ahead and behind, a cell's own where there is none; `kept` [m, 2]: what is
    added, if a solution kept it.
    """
    if kept is not None:
        result: np.ndarray = s + kept
        return result
    return Centring(neighbours).look(s, slip)
