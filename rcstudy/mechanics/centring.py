"""Slip at the centres of slip cells, from the points half a cell ahead to which it belongs (`aligned.py`).

Coulomb's law wants traction and slip at one place. Between three points along a row slip goes by a parabola; at a
row's ends, and beside a stick cell ahead, by a straight line. Where slip turns round within a cell or two (the pole of
spin) less is added, so that half of a cell's own slip along its own direction is left at least.

What is added depends on the slip and on which cells slip, while states follow from slip where it belongs. That is
consistent nearly always, but a few cells beside a pole may want to stick as soon as they slip, and to slip as soon as
they stick. So after some looks at the slip what is added is kept as it is: it is part of the known slip then, and the
rest is Coulomb's law for that.
"""

from __future__ import annotations

import numpy as np

from rcstudy.mechanics.kernels import tractions

_LOOKS = 8  # as many iterations as nearly all solutions need


class Centring:
    """What is added to the slip of the cells with `neighbours` [2, m]: see `slip_at_centres`.

    `rows`: number of rows of constant y in the operator's fields.
    """

    def __init__(self, neighbours: np.ndarray, rows: int) -> None:
        self.kept: np.ndarray | None = None
        self._neighbours = neighbours
        self._weight = np.zeros(neighbours.shape)
        self._behind = np.zeros((2, rows))
        self._looks = 0

    def look(self, s: np.ndarray, slip: np.ndarray) -> np.ndarray:
        """Slips [m, 2] at the centres of `slip` cells by `s` [m, 2], and from now on by what that says."""
        tractions.lean_weights(s, slip, self._neighbours, self._weight)
        centred = self.of(s, slip)
        self._looks += 1
        if self._looks == _LOOKS:
            self.kept = centred - s
        return centred

    def of(self, s: np.ndarray, slip: np.ndarray) -> np.ndarray:
        """Slips [m, 2] at the centres of `slip` cells by `s` [m, 2]."""
        if self.kept is not None:
            return s + self.kept
        out = np.empty(s.shape)
        tractions.lean(s, slip, self._neighbours, self._weight, out)
        return out

    def of_changes(self, field: np.ndarray, places: np.ndarray, slip: np.ndarray) -> None:
        """The same for changes of slip in `field` [2, rows, >= nx] at `places` [m, 2], in place."""
        if self.kept is None:
            tractions.lean_back(field, places, slip, self._weight, self._behind)


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
    return Centring(neighbours, 0).look(s, slip)
