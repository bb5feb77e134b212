"""The paper's own conjugate gradients for the tractions (its Eqs 9 and 18 to 23), implemented as published.

Kept so that its error can be reported. It iterates on Eq. 8, the no-slip condition (Eq. 7) integrated along x, and
scales tractions beyond the bound back onto it (Eq. 23). That keeps q parallel to the accumulated displacement instead
of the slip: the result does not satisfy Coulomb's law where cells slip, and the iteration may not reach its tolerance.
"""

from __future__ import annotations

import numpy as np

from rcstudy.mechanics.convolution import PairOperator
from rcstudy.mechanics.kernels import arrays
from rcstudy.mechanics.rolling import RollingSolution, within

_MAX_ITERATIONS = 2000


def solve_paper_cg(
    displacement: PairOperator,
    cells: np.ndarray,
    bound: np.ndarray,
    w: np.ndarray,
    dx: float,
    tolerance: float,
) -> RollingSolution:
    """Tractions, slips and slip flags by the paper's iteration.

    `displacement`: u (mm) by q (MPa) on the contact's box and one more row of cells ahead of it (+x); `cells` [m, 2]:
    indices in the box; `bound` [m]: mu p (MPa); `w` [m, 2]: rigid slip plus slip by pressure; `dx` (mm).

    The residual of Eq. 18 is u_x - (xi_x x - phi x y + f_j), and likewise for u_y with g_j. Eq. 9 sets f_j, g_j at the
    point where the residual vanishes: the leading edge of each row, here the centre of the cell ahead of its first cell
    in contact (with this reading zero residual means zero discrete slip). A row that lifts off in between is two rows,
    each with a leading edge. The sum of Eq. 19, also where Eqs 20 and 21 use it, is over stick cells. `residual` of the
    result: relative change of the tractions in the last iteration, to which the paper's tolerance is taken to apply.
    """
    n = cells.shape[0]
    # rows of adjacent cells of equal y, each from its leading edge backwards
    order = np.lexsort((-cells[:, 0], cells[:, 1]))
    steps = np.diff(cells[order], axis=0)
    first = np.flatnonzero(np.r_[True, (steps != (-1, 0)).any(axis=1)])
    lengths = np.diff(np.r_[first, n])
    ahead = cells[order[first]] + np.array([1, 0])
    leading = np.empty(n, dtype=int)
    leading[order] = np.repeat(np.arange(first.size), lengths)
    # integral of w from the leading edge backwards: u has to decrease by it
    target = np.empty((n, 2))
    total = np.cumsum(w[order], axis=0)
    target[order] = -dx * (total - np.repeat(total[first] - w[order[first]], lengths, axis=0))

    products = 0

    def displaced(q: np.ndarray) -> np.ndarray:
        """Displacements [2, nx, ny] on the box, until the next call."""
        nonlocal products
        products += 1
        return displacement.on_box(q, cells)

    q = np.zeros((n, 2))
    t = np.zeros((n, 2))
    u = displaced(q)
    square_old = change = np.inf
    iteration = 0
    while iteration < _MAX_ITERATIONS and change > tolerance:
        r = _at(cells, u) - _at(ahead, u)[leading] - target  # Eqs 9, 18
        stick = np.hypot(q[:, 0], q[:, 1]) < bound * (1.0 - 1e-12)
        square = float(np.sum(r[stick] ** 2))  # Eq. 19
        if square < square_old:  # Eq. 20; else the old direction is kept
            t = r + square / square_old * t
        curvature = float(np.sum(t * _at(cells, displaced(t))))  # Eq. 21
        new = within(q - (square / curvature if curvature > 0.0 else 0.0) * t, bound)  # Eqs 22, 23
        norm = arrays.norm2(new)
        change = arrays.norm2(new - q) / norm if norm > 0.0 else 0.0
        q, square_old = new, square
        u = displaced(q)
        iteration += 1
    slip = np.hypot(q[:, 0], q[:, 1]) >= bound * (1.0 - 1e-12)
    s = (_at(cells, u) - _at(cells + np.array([1, 0]), u)) / dx + w
    return RollingSolution(q, s, slip, change, iteration, products, change <= tolerance, s)


def _at(cells: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Displacements [m, 2] at `cells` [m, 2] from `u` [2, nx, ny] on the box."""
    return np.ascontiguousarray(u[:, cells[:, 0], cells[:, 1]].T)
