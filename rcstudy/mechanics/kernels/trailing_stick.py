"""Rows that stick up to their trailing end: hidden slip zones there, and forces that cells miss (`trailing.py`)."""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def hidden_widths(
    index: np.ndarray,
    count: np.ndarray,
    ends: np.ndarray,
    q: np.ndarray,
    slip: np.ndarray,
    pressure: np.ndarray,
    friction: float,
    out: np.ndarray,
) -> None:
    """Width out [ny] (cells) of the slip zone hidden behind the last cell, if it sticks, of each row; else nan.

    See `trailing.py`. index [most, ny]: numbers of the cells of each row from the leading one on, count [ny] of them;
    ends [2, ny]: trailing and leading edge of each row (cells); pressure [m] (MPa), slip [m] (flags), q [m, 2] (MPa):
    of the cells.
    """
    for j in range(count.size):
        length = ends[1, j] - ends[0, j]
        if count[j] == 0 or length <= 0.0 or slip[index[count[j] - 1, j]]:
            out[j] = math.nan
        else:
            largest = 0.0
            for step in range(count[j]):
                largest = max(largest, pressure[index[step, j]])
            last = index[count[j] - 1, j]
            size = math.hypot(q[last, 0], q[last, 1])
            out[j] = size * math.sqrt(length / math.pi) / (friction * largest)


@jit
def ending_rows(
    index: np.ndarray,
    count: np.ndarray,
    ends: np.ndarray,
    widths: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    q: np.ndarray,
    dx: float,
    theta: float,
    out: np.ndarray,
) -> None:
    """Sums of force_x, force_y (MPa) and moment (MPa mm) by which such rows carry too little, added to out [3].

    See `trailing.py`. index, count, ends, q as in `hidden_widths`, which gives widths [ny]; x, y [m] (mm): of the
    cells; dx: their length (mm); theta: distance from the leading cell's centre to the edge (cells).
    """
    for j in range(count.size):
        if math.isnan(widths[j]):
            continue
        leading, last = index[0, j], index[count[j] - 1, j]
        length = ends[1, j] - ends[0, j]
        part = 0.5 * math.sqrt(math.pi / length) * (length - count[j] - 0.5 * widths[j])
        lever = x[leading] + (theta - 1.5 * length) * dx
        out[0] += part * q[last, 0]
        out[1] += part * q[last, 1]
        out[2] += part * (lever * q[last, 1] - y[leading] * q[last, 0])
