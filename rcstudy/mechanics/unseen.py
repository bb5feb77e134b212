r"""What slip zones at the leading edge hide that are narrow beside a cell: for aligned slip areas and error bars.

Where pressure displaces the surfaces along each other, stick asks for q = p (b + (beta/pi) n ln(1/r)) at a distance r
behind the edge (n: its normal, beta: Dundurs' constant): ever so close to it that is more than the bound, whatever the
creepage. So a zone of width w (in cells) slips there: behind m slip cells, from the first stick cell's v = q/(mu p) on,

    |v + t k n| = 1,   k = beta/(pi mu),   w = (m + theta) exp(-t).

Slip takes from the tractions behind it what goes like r^(-1/2), in all some k mu max(p) w a row. A leading cell that
sticks, on this mesh as on coarser ones, shows nothing of it, one that has just begun to slip hardly more; with wider
zones the mesh's own slip makes up for it, and errors go like ((m - 1 + theta)/w)^4, in areas to the power 2 (2800
contacts of unlike bodies with and without layers, friction 0.15 to 0.7, against 384 x 384 cells).

Areas, which borders between cells tell, are given what they miss: of 508 other such contacts slip areas were 0.9 to
1.0 % of the contact off (root of mean square, 24 to 64 cells against 256 x 256; friction 0.1 to 1, both couplings) and
are 0.4 %.
Tractions stay as they are: forces are their sum, and bars have to know.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rcstudy.mechanics.kernels import leading_slip

if TYPE_CHECKING:
    from rcstudy.mechanics.influence import Influence

_LEAST = 1e-9  # k: less is nothing
_NOTHING = 1e-12  # of a cell
_MISSED = 0.85  # of the area that is missing by the law above: fits of those contacts' areas give 0.79 to 0.95 of it
_BY_PRESSURE = 0.2  # of the slip that the largest pressure causes on the spot, beside the rigid slip, for the power


class Unseen(NamedTuple):
    """What slip zones at leading edges hide, about, before the constants of `estimate.py`.

    force_x, force_y (N), moment_z (N mm): what tractions make too large, with signs; force (N): the same of all rows
    without regard to direction; area (mm^2): of what slips unseen, or is seen to slip by too much; missing (mm^2): by
    how much the slip area is too small; power (N): of the slip that pressure causes.
    """

    force_x: float = 0.0
    force_y: float = 0.0
    force: float = 0.0
    moment_z: float = 0.0
    area: float = 0.0
    missing: float = 0.0
    power: float = 0.0


def unseen_slip(
    rows: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    q: np.ndarray,
    slip: np.ndarray,
    pressure: np.ndarray,
    friction: float,
    theta: float,
    influence: Influence,
) -> Unseen:
    """What is hidden under tractions `q` [m, 2] (MPa) with slip flags `slip` [m] and pressures `pressure` [m] (MPa).

    `rows`: numbers [n, ny] of their cells from the leading one on, leading edge [ny] (in cells), coordinates x, y [m]
    (mm) of the cells' centres; `theta`: from a leading cell's centre to the edge (in cells).
    """
    dx, dy = influence.spacing
    k = influence.slip_by_pressure_over_tractions / (math.pi * friction)
    if abs(k) < _LEAST:
        return Unseen()
    sums = np.zeros(6)
    leading_slip.unseen_rows(*rows, q, slip, pressure, friction, k, dx / dy, theta, sums)
    force_x, force_y, force, moment, area, missing = (float(value) * dx * dy for value in sums)
    if abs(missing) < _NOTHING * dx * dy:
        missing = 0.0
    power = force * _BY_PRESSURE * abs(influence.slip_under_pressure) * float(pressure.max())
    return Unseen(force_x, force_y, force, moment, area, _MISSED * missing, power)
