r"""The part of the slip by pressure that is proportional to the pressure, where slip cells need it: at their centres.

Where pressure varies in one direction n, as beside the edge of a contact, it causes the slip kappa p n_x n on the spot,
kappa = (1 - 2 nu)/(2 G) of one body less that of the other (Johnson 1985, 2.25a). It goes like a root of the distance
from the edge, which `centring.py` cannot interpolate. With p = sqrt(r), r in cells behind the leading edge,

    slip at r = 1/4 and 5/4 from cells that carry the means of p:     0.424, 1.148   (sqrt(r): 0.498, 1.117),
    the first cell's slip, by a straight line between them:           0.786,
    the mean over that cell, weighted with p, to 5/4 behind the edge: 0.838.

So in the outermost cells of a row this part, or as much of it as counts (below), is taken out of the slips before these
are interpolated, and its mean over the cell, weighted with the traction that it directs, is put in its place. (In the
next two cells as well: forces along x of mild contacts are a tenth closer, but Newton's method takes 2 to 5 % more
products.) Bodies unlike in kappa and with low friction gain, as their slip changes its direction towards the edge. A
steel ball with friction 0.15 on a rigid plane that slips everywhere has forces 0.0 to 0.2 % of mu P off at ten cells a
radius, without it 0.1 to 0.35 %.

Tractions cancel it where slip is small. They turn until what they cause across the slip S themselves makes up for the
slip by pressure there, and then nothing like a root is left. For small turns tractions q across the slip follow from

    S q/(mu p) + C H q = -kappa p,      H: Hilbert transform, C: compliance to tractions (`slip_under_tractions`).

With p = sqrt(r) (1 - r/40)^1.5 the first of 40 cells needs this part of the local slip, for forces as on 16 and 32
times as many cells:

    S/(mu C), p being 1 at r = 1      0.03   0.1    0.3    0.6    1      2      4      10     30
    part                              0.06   0.28   0.48   0.56   0.56   0.53   0.57   0.66   0.73

which is 0.57 S^2/(S^2 + (0.12 mu C p)^2) to 0.03 or 0.05 up to S/(mu C) = 4. p is the cell's weighted pressure and S
the slip at the edge: if slip grows from zero there, the part is zero or less. In contacts 0.8 is used for 0.57: with
their edges at all angles bodies unlike in kappa are closer for it, and those of the paper hardly farther off
(docs/experiments.md). What lies along the slip turns nothing and is reduced all the same, as Newton's method then takes
an eighth fewer products. In place of mu C stands the root of (mu C)^2 + kappa^2: otherwise, with next to no friction,
the part would switch between 0 and 0.8 where slip grows from about zero, and directions of slip would not settle.
"""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.kernels import centring as kernel
from rcstudy.mechanics.subcell.moved_rows import MovedRows

_MOST = 0.8  # largest part of the local slip that counts
_BEGINS = 0.12  # slip at which half of the largest part counts, over mu C p


def by_pressure_at_centres(s: np.ndarray, rows: MovedRows, influence: Influence, leading: float) -> np.ndarray:
    """Slips [m, 2] by pressure at the centres of the cells of `rows`, from `s` [m, 2] half a cell ahead of them.

    By parabolas, as in `centring.py`; all of the local part is known, as tractions do not enter. `leading`: as in
    `local_slip`.
    """
    local, everywhere = _local(rows, influence.slip_under_pressure, leading), np.ones(len(s), dtype=np.bool_)
    out = np.empty(s.shape)
    kernel.centre(s, everywhere, rows.neighbours, local, np.zeros((3, len(s))), out)
    return out


def local_slip(rows: MovedRows, influence: Influence, friction: float, leading: float) -> np.ndarray:
    """The local slip by pressure on the cells of `rows`, [5, m], as `kernels/centring.centre` needs it.

    Components along x and y of the slip per unit pressure (1/MPa), as far as it counts, zero but in the outermost cells
    of rows; the pressures (MPa) that it has half a cell ahead of the cells' centres, by differences of displacements;
    those at the centres, weighted means over the cells; the slips at which tractions begin to cancel it. `leading`: the
    part by which the slip is reduced in leading cells (`aligned.py`).
    """
    kappa, compliance = influence.slip_under_pressure, influence.slip_under_tractions[0]
    local = _local(rows, _MOST * kappa, leading)
    local[4] = _BEGINS * math.hypot(friction * compliance, kappa) * rows.weighted
    return local


def _local(rows: MovedRows, per_pressure: float, leading: float) -> np.ndarray:
    """`local_slip` with `per_pressure` (1/MPa) for the slip per unit pressure, which no tractions cancel."""
    local = np.zeros((5, rows.pressure.size))
    local[3] = rows.weighted
    of_rows = rows.index, rows.count, rows.normals, rows.trailing_normals
    kernel.local_slip(rows.pressure, *of_rows, per_pressure, leading, local)
    return local
