"""Tractions and slips from the cells of moved rows to the window's own (`moved_rows.py`).

Positions along x are in cells: the centre of cell i of the box is at i.
"""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def on_box(
    q: np.ndarray,
    s: np.ndarray,
    slip: np.ndarray,
    bound: np.ndarray,
    cells: np.ndarray,
    values: np.ndarray,
    flags: np.ndarray,
) -> None:
    """Tractions q [m, 2] over their bound [m], slips s [m, 2] and slip flags [m] at the places of the cells [m, 2].

    Into values [4, nx, ny] and flags [nx, ny], which are zero elsewhere.
    """
    for m in range(cells.shape[0]):
        i, j = cells[m, 0], cells[m, 1]
        for k in range(2):
            values[k, i, j] = q[m, k] / bound[m]
            values[2 + k, i, j] = s[m, k]
        flags[i, j] = slip[m]


@jit
def to_centres(
    values: np.ndarray, held: np.ndarray, shift: np.ndarray, cells: np.ndarray, out: np.ndarray, nearest: np.ndarray
) -> None:
    """Values at the centres of cells from those at cells moved by shift [ny] along x, linearly along each row.

    shift: half a cell at most; values [k, nx, ny], held [nx, ny]: which of them count; cells [m, 2] -> out [m, k];
    nearest [m]: index i of the closest moved cell. If only one of the two around a centre counts, its value is taken;
    if neither does, that of the closest one of the row.
    """
    kinds, nx, _ = values.shape
    for m in range(cells.shape[0]):
        i, j = cells[m, 0], cells[m, 1]
        side = -1 if shift[j] > 0.0 else 1
        other = i + side
        here = held[i, j]
        there = 0 <= other < nx and held[other, j]
        if here and not there:
            other = i  # the neighbour may lie outside the box
        elif not there:
            # of two cells as many indices away, the one on the neighbour's side is closer
            for distance in range(1, nx):
                nearer, farther = i + side * distance, i - side * distance
                if 0 <= nearer < nx and held[nearer, j]:
                    other = nearer
                    break
                if 0 <= farther < nx and held[farther, j]:
                    other = farther
                    break
        weight = abs(shift[j]) if here and there else 1.0
        nearest[m] = i if here else other
        for k in range(kinds):
            out[m, k] = (1.0 - weight) * values[k, i, j] + weight * values[k, other, j]


@jit
def by_law(
    found: np.ndarray, slip: np.ndarray, bound: np.ndarray, cells: np.ndarray, corner: tuple[int, int], out: np.ndarray
) -> None:
    """Tractions (MPa) and slips of cells [m, 2] that satisfy Coulomb's law, from interpolated values found [m, 4].

    found: traction over bound, x and y, and slip, x and y; slip [m]: flags; bound mu p [m] (MPa). Into out [4, nx, ny],
    in which the cells' indices begin at corner. In slip cells the traction is as large as the bound and slip points
    against it; in stick cells slip is zero.
    """
    for m in range(cells.shape[0]):
        i, j = cells[m, 0] + corner[0], cells[m, 1] + corner[1]
        size = math.sqrt(found[m, 0] ** 2 + found[m, 1] ** 2)
        speed = math.sqrt(found[m, 2] ** 2 + found[m, 3] ** 2) if slip[m] else 0.0
        scale = max(size, 1e-300 if slip[m] else 1.0)
        for k in range(2):
            out[k, i, j] = found[m, k] / scale * bound[m]
            out[2 + k, i, j] = -found[m, k] / scale * speed


@jit
def to_window(
    q: np.ndarray,
    s: np.ndarray,
    slip: np.ndarray,
    bound: np.ndarray,
    cells: np.ndarray,
    held: np.ndarray,
    shift: np.ndarray,
    own: np.ndarray,
    own_bound: np.ndarray,
    corner: tuple[int, int],
    out: np.ndarray,
    states: np.ndarray,
) -> None:
    """Tractions and slips, out [4, nx, ny], and slip flags states [nx, ny] of the window's own cells in contact.

    By `on_box` (q, s, slip, bound, cells), `to_centres` (held, shift, and own [n, 2] for cells) and `by_law` (own_bound
    [n] for bound, corner).
    """
    nx, ny = held.shape
    values, flags = np.zeros((4, nx, ny)), np.zeros((nx, ny), dtype=np.bool_)
    on_box(q, s, slip, bound, cells, values, flags)
    n = own.shape[0]
    found, nearest, slips = np.zeros((n, 4)), np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.bool_)
    to_centres(values, held, shift, own, found, nearest)
    for m in range(n):
        slips[m] = flags[nearest[m], own[m, 1]]
        states[own[m, 0] + corner[0], own[m, 1] + corner[1]] = slips[m]
    by_law(found, slips, own_bound, own, corner, out)
