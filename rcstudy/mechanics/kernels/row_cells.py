"""Cells of rows that begin where the contact begins (`aligned.py`): numbers, neighbours, leading ones."""

from __future__ import annotations

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def number_cells(
    leading: np.ndarray, count: np.ndarray, held: np.ndarray, cells: np.ndarray, index: np.ndarray
) -> None:
    """Numbers m of the count[j] cells of each row of constant y that ends, towards +x, with cell leading[j].

    Into index [max count, ny], from the leading one on, -1 where there are no more; their i, j into cells [m, 2], rows
    of constant x first; which these are into held [nx, ny].
    """
    held[:, :] = False
    index[:, :] = -1
    m = 0
    for i in range(held.shape[0]):
        for j in range(held.shape[1]):
            k = leading[j] - i
            if 0 <= k < count[j]:
                held[i, j] = True
                index[k, j] = m
                cells[m, 0] = i
                cells[m, 1] = j
                m += 1


@jit
def row_neighbours(index: np.ndarray, out: np.ndarray) -> None:
    """Numbers of the cells ahead of and behind each cell, its own where there is none, into out [2, m].

    index as in `number_cells`.
    """
    for k in range(index.shape[0]):
        for j in range(index.shape[1]):
            m = index[k, j]
            if m >= 0:
                out[0, m] = index[k - 1, j] if k > 0 else m
                behind = index[k + 1, j] if k + 1 < index.shape[0] else -1
                out[1, m] = behind if behind >= 0 else m


@jit
def ease_leading_cells(
    front: np.ndarray, index: np.ndarray, pressure: np.ndarray, part: float, aspect: float, s: np.ndarray
) -> None:
    """Take from slips by pressure s [m, 2] of rows' leading cells what these make too large, in place.

    Along x that is part times the pressure [m] (MPa), across by the direction of the contact's edge: twice the product
    of its normal's components as much. front [ny]: where it is, in cells; aspect: dx/dy; index as in `number_cells`.
    """
    ny = front.size
    for j in range(ny):
        m = index[0, j]
        if m >= 0:
            low = j - 1 if j > 0 and index[0, j - 1] >= 0 else j
            high = j + 1 if j + 1 < ny and index[0, j + 1] >= 0 else j
            slope = aspect * (front[high] - front[low]) / (high - low) if high > low else 0.0
            less = part * pressure[m]
            s[m, 0] -= less
            s[m, 1] += 2.0 * slope / (1.0 + slope * slope) * less
