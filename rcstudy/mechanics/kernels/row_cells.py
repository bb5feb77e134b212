"""Cells of rows that begin at the edge of the contact (`moved_rows.py`): numbers, neighbours, leading cells, sums."""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def number_cells(
    leading: np.ndarray, count: np.ndarray, held: np.ndarray, cells: np.ndarray, index: np.ndarray
) -> None:
    """Number the count[j] cells of each row of constant y, the leading one of which (towards +x) is cell leading[j].

    The numbers m go into index [max count, ny], from the leading cell on, -1 beyond the last one; the indices i, j of
    cells into cells [m, 2], ordered by i, then by j; held [nx, ny] is set to whether a cell is one of them.
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
def row_forces(p: np.ndarray, count: np.ndarray, part: float, out: np.ndarray) -> None:
    """Sums of p [nx, ny] (MPa) along rows of constant y, into out [ny], with `part` of their differences evened out.

    That is done between neighbouring rows that both have cells, count [ny]: `part` of the difference passes from the
    larger sum to the smaller, so that the total is unchanged.
    """
    ny = p.shape[1]
    for j in range(ny):
        out[j] = p[:, j].sum()
    across = 0.0  # what the row before has given
    for j in range(ny):
        here, out[j] = out[j], out[j] + across
        across = part * (here - out[j + 1]) if j + 1 < ny and count[j] > 0 and count[j + 1] > 0 else 0.0
        out[j] -= across


@jit
def row_neighbours(index: np.ndarray, out: np.ndarray) -> None:
    """Numbers of the cells ahead of and behind each cell, into out [2, m]; its own number where there is none.

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
def edge_normals(front: np.ndarray, index: np.ndarray, aspect: float, out: np.ndarray) -> None:
    """Normal of an edge of the contact in each row, with a positive part along x, into out [2, ny].

    front [ny]: position of the edge, in cells; aspect: dx/dy; index as in `number_cells`. In a row without a neighbour
    the normal points along x.
    """
    ny = front.size
    for j in range(ny):
        slope = 0.0
        if index[0, j] >= 0:
            low = j - 1 if j > 0 and index[0, j - 1] >= 0 else j
            high = j + 1 if j + 1 < ny and index[0, j + 1] >= 0 else j
            slope = aspect * (front[high] - front[low]) / (high - low) if high > low else 0.0
        out[0, j] = 1.0 / math.sqrt(1.0 + slope * slope)
        out[1, j] = -slope * out[0, j]


@jit
def correct_leading_cells(
    normals: np.ndarray, index: np.ndarray, pressure: np.ndarray, part: float, s: np.ndarray
) -> None:
    """Subtract from slips by pressure s [m, 2] of the rows' leading cells what cells make too large there, in place.

    That is part (1/MPa) times the pressure [m] (MPa) in the direction of the edge's normal, normals [2, ny], times its
    component along x, with which that slip itself decreases; index as in `number_cells`.
    """
    for j in range(normals.shape[1]):
        m = index[0, j]
        if m >= 0:
            less = part * pressure[m] * normals[0, j]
            s[m, 0] -= less * normals[0, j]
            s[m, 1] -= less * normals[1, j]


@jit
def resultant(
    q: np.ndarray,
    slip: np.ndarray,
    bound: np.ndarray,
    centres: np.ndarray,
    levers: np.ndarray,
    y: np.ndarray,
    table: tuple[np.ndarray, ...],
    dx: float,
) -> tuple[float, float, float]:
    """Sums (MPa, MPa mm) of q_x, q_y and x q_y - y q_x over all cells, with directions that vary within slip cells.

    In a slip cell q_y = n p: n at the cell's centre is that of q [m, 2] (MPa); p is the bound, with the mean bound [m]
    (MPa) and its centroid at levers [m] (mm). n varies with the distance from centres [m] (mm), to second order:

        int n x p = n lever bound + n' int (x - centre) x p + n''/2 int (x - centre)^2 x p over the cell's length.

    n' and n'' are difference quotients between slip cells of one row. The variance of x under p is dx^2/12, or in the
    first and the last cell of a row, where p goes like a root, 12/175 of the square of the length from the cell's inner
    side to the edge (cells). y [m] (mm): of the cells; table: a `moved_rows.RowTable`, index, start, count and ends.
    """
    index, start, _, ends = table
    force_x = force_y = moment = 0.0
    for j in range(index.shape[1]):
        for k in range(index.shape[0]):
            m = index[k, j]
            if m < 0:
                break
            force_x += q[m, 0]
            force_y += q[m, 1]
            moment += levers[m] * q[m, 1] - y[m] * q[m, 0]
            if not slip[m]:
                continue
            after = index[k + 1, j] if k + 1 < index.shape[0] else -1
            one = index[k - 1, j] if k > 0 and slip[index[k - 1, j]] else m
            other = after if after >= 0 and slip[after] else m
            if one == other:
                continue
            length = 1.0
            if k == 0:
                length = math.sqrt(144.0 / 175.0) * (ends[1, j] - start[j] + 0.5)
            elif after < 0:
                length = math.sqrt(144.0 / 175.0) * (start[j] - k + 0.5 - ends[0, j])
            spread = length * length / 12.0 * dx * dx
            off = levers[m] - centres[m]
            n_one, n, n_other = q[one, 1] / bound[one], q[m, 1] / bound[m], q[other, 1] / bound[other]
            both = one != m and other != m
            slope = (n_one - n_other) / ((2.0 if both else 1.0) * dx)
            moment += slope * bound[m] * (centres[m] * off + spread + off * off)
            if both:
                bend = (n_one - 2.0 * n + n_other) / (dx * dx)
                moment += 0.5 * bend * bound[m] * levers[m] * spread
    return force_x, force_y, moment


@jit
def work_on_slip(
    q: np.ndarray, slip: np.ndarray, s: np.ndarray, neighbours: np.ndarray, in_slip: float, in_stick: float
) -> float:
    """Sum (MPa) of q.s over all cells, of tractions q [m, 2] (MPa) on slips s [m, 2] at the cells' centres.

    Both vary within a cell: its mean of q.s exceeds the product by the product of their changes over the cell, half the
    differences between the cells ahead and behind (neighbours [2, m], as from `row_neighbours`), times `in_stick`; in
    slip [m] (flags) cells times `in_slip`. A row's first and last cell have no such difference.
    """
    total = 0.0
    for m in range(q.shape[0]):
        total += q[m, 0] * s[m, 0] + q[m, 1] * s[m, 1]
        ahead, behind = neighbours[0, m], neighbours[1, m]
        if ahead != m and behind != m:
            changes = (q[ahead, 0] - q[behind, 0]) * (s[ahead, 0] - s[behind, 0])
            changes += (q[ahead, 1] - q[behind, 1]) * (s[ahead, 1] - s[behind, 1])
            total += 0.25 * (in_slip if slip[m] else in_stick) * changes
    return total
