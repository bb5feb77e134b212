"""Values from a mesh to the next finer one, whose cells are of half the size (`cascade.py`)."""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def spread_fractions(q: np.ndarray, bound: np.ndarray, cells: np.ndarray, values: np.ndarray, mask: np.ndarray) -> None:
    """Tractions q [m, 2] over their bound [m], at the cells [m, 2] of values [2, nx, ny].

    mask [nx, ny]: set to true in these cells. Elsewhere both are left alone, as zeros.
    """
    for m in range(cells.shape[0]):
        i, j = cells[m, 0], cells[m, 1]
        values[0, i, j] = q[m, 0] / bound[m]
        values[1, i, j] = q[m, 1] / bound[m]
        mask[i, j] = True


@jit
def interpolate_cells(
    values: np.ndarray, mask: np.ndarray, cells: np.ndarray, x0: float, y0: float, out: np.ndarray, weight: np.ndarray
) -> None:
    """Bilinear interpolation to `cells` [m, 2] from cells of twice the size, among which cell (0, 0) is at x0, y0.

    values [k, cx, cy], mask [cx, cy]: which coarse cells count; out [m, k] and weight [m], both zero at first: the
    interpolated values and the sum of the weights that counted.
    """
    kinds, cx, cy = values.shape
    for m in range(cells.shape[0]):
        x, y = x0 + 0.5 * cells[m, 0], y0 + 0.5 * cells[m, 1]
        i, j = math.floor(x), math.floor(y)
        for a in range(2):
            for b in range(2):
                share = (x - i if a == 1 else 1.0 - (x - i)) * (y - j if b == 1 else 1.0 - (y - j))
                if share > 0.0 and 0 <= i + a < cx and 0 <= j + b < cy and mask[i + a, j + b]:
                    weight[m] += share
                    for k in range(kinds):
                        out[m, k] += share * values[k, i + a, j + b]
        if weight[m] > 0.0:
            for k in range(kinds):
                out[m, k] /= weight[m]
