r"""What slip zones at the leading edge hide that are narrow beside a cell: for aligned cells' numbers and error bars.

Where pressure displaces the surfaces along each other, stick asks for q = p (b + (beta/pi) n ln(1/r)) at a distance r
behind the edge (n: its normal, beta: Dundurs' constant): ever so close to it that is more than the bound, whatever the
creepage. So a zone of width w (in cells) slips there: behind m slip cells, from the first stick cell's v = q/(mu p) on,

    |d| = 1,   d = v + t k n,   k = beta/(pi mu),   w = (m + theta) exp(-t).

A leading cell that sticks, on this mesh as on coarser ones, shows nothing of it, one that has just begun to slip hardly
more; with wider zones the mesh's own slip makes up for it, and areas are off like (w/(m - 1 + theta))^-2.

What slip takes from tractions. In a strip with p = K sqrt(r) the part f = mu K g sqrt(r) ln(w0/r) of those that stick
asks for is too much, g = k n.d being what |q|/(mu p) grows by for each factor e in r. With no slip behind w, and slip
that ends there smoothly (by the sign of slip before a stick zone no other end is possible),
int_0^w f'/sqrt(w - r) dr = 0, so w = 4 e^-2 w0. Farther behind tractions are less by
(1/pi) int_0^w f/sqrt(w - r) dr r^(-1/2) = mu K g w/2 r^(-1/2). In a stick zone as long as l of a row as long as L,
bounded at its end, too, this is a force per width of pi/2 sqrt(l) mu K g w/2, or with Hertz's K = 2 max(p)/sqrt(L)

    pi/2 mu max(p) g w sqrt(l/L),

which acts about l/2 behind the edge (l/4 to l/2, by how much slips behind). On cells w is w0, as a leading cell's
traction is less than that law's. Slip against d has tractions along C d, C being what the bodies resist along and
across waves, of which the component along d is the one that is too large. So forces are too large by that where leading
cells stick, and by theta/w to the power 8 of it, w = theta, where one has begun to slip.

Of 550 random contacts of unlike bodies (mild ones, coatings and rails, either coupling, 20 to 68 cells, against four to
six times as many) forces along x were 0.18 % of mu P off (root of mean square) and are 0.10 %.

Areas, which borders between cells tell, are given what they miss: of 508 other such contacts slip areas were 0.9 to
1.0 % of the contact off (root of mean square, 24 to 64 cells against 256 x 256; friction 0.1 to 1, both couplings) and
are 0.4 %. The fields of tractions stay as they are. What is made up for is in doubt, and bars have to know.
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
_WORK = 1.5  # times that of those tractions: against slip by pressure (450 contacts)
_BY_PRESSURE = 0.2  # of the slip that the largest pressure causes on the spot, beside the rigid slip, for the power


class Unseen(NamedTuple):
    """What slip zones at leading edges hide.

    force_x, force_y (N), moment_z (N mm): what tractions make too large, with signs; work (N): that of these tractions
    against the slip by pressure; missing (mm^2): by how much the slip area is too small. In doubt before the constants
    of `estimate.py` are force (N): tractions of all rows without regard to direction; area (mm^2): what slips unseen,
    or is seen to slip by too much; power (N): of the slip that pressure causes.
    """

    force_x: float = 0.0
    force_y: float = 0.0
    moment_z: float = 0.0
    work: float = 0.0
    missing: float = 0.0
    force: float = 0.0
    area: float = 0.0
    power: float = 0.0


def unseen_slip(
    rows: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    centres: tuple[np.ndarray, np.ndarray],
    q: np.ndarray,
    slip: np.ndarray,
    pressure: np.ndarray,
    by_pressure: np.ndarray,
    friction: float,
    theta: float,
    influence: Influence,
) -> Unseen:
    """What is hidden under tractions `q` [m, 2] (MPa) with slip flags `slip` [m] and pressures `pressure` [m] (MPa).

    `by_pressure` [m, 2]: slip that the pressure causes, at the cells' centres; `rows`: numbers [most, ny] of their
    cells from the leading one on, how many these are [ny], their trailing and leading edges [2, ny] (in cells), and the
    normal [2, ny] of the latter;
    `centres`: coordinates x, y [m] (mm) of the cells; `theta`: from a leading cell's centre to the edge (in cells).
    """
    dx, dy = influence.spacing
    k = influence.slip_by_pressure_over_tractions / (math.pi * friction)
    if abs(k) < _LEAST:
        return Unseen()
    sums = np.zeros(7)
    ratio = influence.along_over_across
    leading_slip.unseen_rows(*rows, *centres, q, slip, pressure, by_pressure, friction, k, ratio, dx, theta, sums)
    force_x, force_y, moment, work, force, area, missing = (float(value) * dx * dy for value in sums)
    if abs(missing) < _NOTHING * dx * dy:
        missing = 0.0
    power = force * _BY_PRESSURE * abs(influence.slip_under_pressure) * float(pressure.max())
    return Unseen(force_x, force_y, moment, _WORK * work, _MISSED * missing, force, area, power)
