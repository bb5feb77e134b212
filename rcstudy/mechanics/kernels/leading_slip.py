"""Slip zones at the leading edge that are narrow beside a cell, row by row (`unseen.py`)."""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def unseen_rows(
    index: np.ndarray,
    front: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    q: np.ndarray,
    slip: np.ndarray,
    pressure: np.ndarray,
    friction: float,
    k: float,
    aspect: float,
    theta: float,
    out: np.ndarray,
) -> None:
    """Sums over the rows, into out [6], see `unseen.py`: force_x, force_y, |force| (MPa), moment (MPa mm), cells.

    Cells twice: without regard to sign, and those that slip unseen less those that are seen to slip by too much.

    index [n, ny]: numbers of the cells of each row from the leading one on, -1 beyond its last; front [ny]: leading
    edge (cells); x, y, pressure, slip [m] and q [m, 2]: of the cells; aspect: dx/dy; theta: from the leading cell's
    centre to the edge (cells).
    """
    most, ny = index.shape
    for j in range(ny):
        if index[0, j] < 0:
            continue
        count, slips, largest = 0, 0, 0.0
        while count < most and index[count, j] >= 0:
            cell = index[count, j]
            largest = max(largest, pressure[cell])
            if slips == count and slip[cell]:
                slips += 1
            count += 1
        if slips == count:
            continue
        before = j - 1 if j > 0 and index[0, j - 1] >= 0 else j
        after = j + 1 if j + 1 < ny and index[0, j + 1] >= 0 else j
        slope = aspect * (front[after] - front[before]) / max(after - before, 1)
        growth_x, growth_y = k / math.hypot(1.0, slope), -k * slope / math.hypot(1.0, slope)
        first = index[slips, j]
        bound = friction * pressure[first]
        v_x, v_y = q[first, 0] / bound, q[first, 1] / bound
        along = (v_x * growth_x + v_y * growth_y) / k**2
        room = max(1.0 - v_x**2 - v_y**2, 0.0) / k**2
        t = min(math.sqrt(along**2 + room) - along, 600.0)
        width = (slips + theta) * math.exp(-t)
        if slips == 0:
            hidden, cells, missing = width, width, width
        else:
            past = min((slips - 1 + theta) / width, 1.0)
            hidden, cells, missing = theta * past**4, past**2, -(past**2)
        force = abs(k) * friction * largest * hidden
        force_x, force_y = force * (v_x + t * growth_x), force * (v_y + t * growth_y)
        leading = index[0, j]
        out[0] += force_x
        out[1] += force_y
        out[2] += force
        out[3] += x[leading] * force_y - y[leading] * force_x
        out[4] += cells
        out[5] += missing
