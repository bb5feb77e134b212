r"""The part of the slip by pressure that is proportional to the pressure, where slip cells need it: at their centres.

Where pressure varies in one direction n, as beside the edge of a contact, it causes the slip kappa p n_x n on the spot,
kappa = (1 - 2 nu)/(2 G) of one body less that of the other (Johnson 1985, 2.25a). It goes like a root of the distance
from the edge, which `centring.py` cannot interpolate. With p = sqrt(r), r in cells behind the leading edge,

    slip at r = 1/4 and 5/4 from cells that carry the means of p:     0.424, 1.148   (sqrt(r): 0.498, 1.117),
    the first cell's slip, by a straight line between them:           0.786,
    the mean over that cell, weighted with p, to 5/4 behind the edge: 0.838.

So in the outermost cells of a row this part is taken out of the slips before these are interpolated, and its mean over
the cell, weighted with the traction that it directs, is put in its place. (In the next two cells as well: forces along
x of mild contacts are a tenth closer, but Newton's method takes 2 to 5 % more products.) Bodies unlike in kappa and
with low friction gain, as their slip changes its direction towards the edge. A steel ball with friction 0.15 on a rigid
plane that slips everywhere has forces 0.0 to 0.2 % of mu P off at ten cells a radius, without it 0.1 to 0.35 %.

Oblique edges: what rows of cells make of them is known less well, so the part is reduced by n_x^3 there (150 random
contacts with up to three layers: forces along x have errors larger by a tenth without that).
"""

from __future__ import annotations

import numpy as np

from rcstudy.mechanics.kernels import centring as kernel
from rcstudy.mechanics.moved_rows import MovedRows


def local_slip(rows: MovedRows, slip_under_pressure: float, leading: float) -> np.ndarray:
    """The local slip by pressure on the cells of `rows`, [4, m], as `kernels/centring.centre` needs it.

    Components along x and y of the slip per unit pressure (1/MPa), zero but in the outermost cells of rows; the
    pressures (MPa) that it has half a cell ahead of the cells' centres, by differences of displacements; those at the
    centres, weighted means over the cells. `slip_under_pressure`: kappa (1/MPa); `leading`: the part by which the slip
    is reduced in leading cells (`aligned.py`).
    """
    local = np.zeros((4, rows.pressure.size))
    local[3] = rows.weighted
    edges = rows.normals, rows.trailing_normals
    kernel.local_slip(rows.pressure, rows.index, rows.count, *edges, slip_under_pressure, leading, local)
    return local
