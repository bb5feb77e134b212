"""Slip at the centres of slip cells, interpolated from the points half a cell ahead of them (`aligned.py`).

The discrete slip belongs to these points, but Coulomb's law relates traction and slip at the same point. The slip is
interpolated along each row by a parabola through the cell's own point and those ahead and behind. At the row's trailing
end the parabola goes through the next two points ahead; at its leading end, and behind a stick cell, a straight line is
used. (With a straight line at the trailing end as well, moments under spin had errors larger by 0.1 (dx/a)^2.) The part
of the slip by pressure that goes like the pressure itself, a root at the edges, is known (`local_slip.py`; Johnson
1985, 2.25a). Where the slip reverses within a cell or two (at the pole of spin) the correction, i.e. the centred slip
less the cell's own slip, is reduced, so that at least half of the cell's own slip remains along its direction.

The correction depends on the slip and on which cells slip, while the states (stick or slip) follow from the slip at its
own points. This is nearly always consistent, but a few cells beside a pole may change their state in every iteration.
When updating the correction makes no progress it is therefore frozen: it becomes part of the known slip, and Coulomb's
law is solved with it. Then it is updated again, as long as this reduces the difference between the tractions and those
that Coulomb's law gives for the updated slip. Where that remains large, as one correction leads to another and back, it
is moved half the way (`go_part`), or less. The final difference is reported (`RollingSolution.unsettled`).
"""

from __future__ import annotations

import numpy as np

from rcstudy.mechanics.kernels import centring as kernel
from rcstudy.mechanics.numerics.patience import Patience

Law = tuple[np.ndarray, float, np.ndarray, np.ndarray, np.ndarray]
"""Bounds [m] (MPa), rho (MPa), slip flags [m], directions [m, 2] and shares [m] of cells, see `rolling.py`."""

_PATIENCE = 4  # updates in a row, none of which halves the least residual, after which the correction is frozen


class Centring:
    """The correction that moves the slip of slip cells to their centres, updated from the slip or frozen.

    `neighbours` [2, m]: numbers of the cells ahead and behind, a cell's own where there is none; `local` [5, m]: the
    part of the slip that is known at the centres (`local_slip.py`), if there is one; `weight` [3, m]: interpolation
    weights of the cells ahead, behind and second ahead, from the last update; `frozen` [m, 2]: the frozen correction,
    None as long as it is updated.
    """

    def __init__(self, neighbours: np.ndarray, local: np.ndarray | None = None) -> None:
        self.weight = np.zeros((3, neighbours.shape[1]))
        self.neighbours, self._local = neighbours, np.zeros((5, 0)) if local is None else local
        self.restart()

    def restart(self) -> None:
        """Start, or resume, updating the correction from the slip."""
        self.frozen: np.ndarray | None = None
        self._patience = Patience(_PATIENCE, 0.5)

    def update(self, s: np.ndarray, slip: np.ndarray) -> np.ndarray:
        """Slips [m, 2], those of `slip` cells at their centres, from `s` [m, 2]; sets `weight`."""
        centred = np.empty(s.shape)
        kernel.centre(s, slip, self.neighbours, self._local, self.weight, centred)
        return centred

    def update_with_law(self, q: np.ndarray, s: np.ndarray, of_law: Law) -> tuple[np.ndarray, float]:
        """`update`, and directions and shares of slip cells by the result, in place in `of_law`.

        `s` [m, 2]: slips half a cell ahead; `of_law`: as `update_directions` takes them. Returns the centred slips
        [m, 2] and the squared residual (MPa^2) of Coulomb's law for tractions `q` [m, 2] (MPa).
        """
        centred = np.empty(s.shape)
        of_cells = self.neighbours, self._local, self.weight
        return centred, kernel.centre_and_direct(q, s, *of_law, *of_cells, centred)

    def freeze_if_stalled(self, s: np.ndarray, centred: np.ndarray, residual: float) -> None:
        """Freeze the correction `centred` - `s` if `residual` and those before it show that updates do not help.

        `s`, `centred` [m, 2]: slips before and after centring.
        """
        if self._patience.exhausted(residual):
            self.frozen = centred - s

    def go_part(self, s: np.ndarray, slip: np.ndarray, part: float) -> None:
        """Move the frozen correction by `part` of the way to that of slips `s` [m, 2]; nothing while it is updated."""
        if self.frozen is not None:
            self.frozen = (1.0 - part) * self.frozen + part * (self.update(s, slip) - s)


def slip_at_centres(
    s: np.ndarray,
    slip: np.ndarray,
    neighbours: np.ndarray,
    local: np.ndarray | None = None,
    frozen: np.ndarray | None = None,
) -> np.ndarray:
    """Slip [m, 2], that of `slip` cells at their centres, from `s` [m, 2] at the points half a cell ahead.

    `neighbours`, `local`: as in `Centring`; `frozen` [m, 2]: the frozen correction of the solution, if it has one.
    """
    if frozen is not None:
        result: np.ndarray = s + frozen
        return result
    return Centring(neighbours, local).update(s, slip)
