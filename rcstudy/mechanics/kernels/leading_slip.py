"""Slip zones at the leading edge that are narrow compared with a cell, row by row (`unseen.py`)."""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def slip_behind(cells: np.ndarray, by_pressure: np.ndarray, length: float, theta: float) -> tuple[float, float]:
    """Mean of slips by_pressure [m, 2] over a row's cells, weighted with sqrt(length/r - 1), r behind the edge.

    That is the distribution of tractions that resist slip at the edge, in a stick zone of this length (cells).
    cells [n]: numbers of the row's cells from the leading one on; theta: distance from the leading cell's centre to the
    edge (cells).
    """
    slip_x = slip_y = weights = 0.0
    for step in range(cells.size):
        weight = math.sqrt(max(length / (step + theta) - 1.0, 0.0))
        slip_x += weight * by_pressure[cells[step], 0]
        slip_y += weight * by_pressure[cells[step], 1]
        weights += weight
    return (slip_x / weights, slip_y / weights) if weights > 0.0 else (0.0, 0.0)


@jit
def unseen_width(v: float, growth: float, slips: int, theta: float, zone: np.ndarray) -> float:
    """Cells of the zone at the leading edge that `slips` slip cells miss, twice E of `leading_zone.py`.

    v: traction of the first stick cell over its bound, along the slip; growth: by how much it grows for each factor e
    towards the edge; theta: distance from the leading cell's centre to the edge (cells); zone [7]: of
    `leading_zone.numbers`. w0 is limited to what it is for so many slip cells if growth is between 0.15 and 1.5.
    """
    log = ((v * zone[6] - zone[2]) / growth - zone[0]) / zone[1]
    if slips == 0:
        log = min(log, math.log(1.15 * theta))
    else:
        least = 0.8 * theta if slips == 1 else 1.35 * (slips - 1 + theta)
        log = min(max(log, math.log(least)), math.log(1.85 * (slips + theta)))
    return 2.0 * (4.0 * math.exp(log - 2.0) - 2.0 * (zone[3] + log * zone[4] + zone[5] / growth))


@jit
def hidden_leading_slip(
    index: np.ndarray,
    count: np.ndarray,
    ends: np.ndarray,
    normals: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    q: np.ndarray,
    slip: np.ndarray,
    pressure: np.ndarray,
    by_pressure: np.ndarray,
    friction: float,
    k: float,
    along_over_across: float,
    dx: float,
    theta: float,
    zones: np.ndarray,
    reach: float,
    out: np.ndarray,
) -> None:
    """Add the effects of narrow slip zones at the leading edge, summed over the rows, to out [7]; see `unseen.py`.

    First the excess of the sums of tractions: force_x, force_y (MPa), moment (MPa mm), power (MPa). Then what is
    uncertain: force (MPa), area (cells). Last the area (cells) that slips unseen, less that by which a visible slip
    zone is too large.

    index [most, ny]: numbers of the cells of each row from the leading one on, count [ny] of them; ends [2, ny]:
    trailing and leading edge of each row (cells); normals [2, ny]: of the leading edge; x, y [m] (mm), slip [m]
    (flags), pressure [m] (MPa), q [m, 2] (MPa): of the cells; by_pressure [m, 2]: slip by pressure at their centres; k:
    see `unseen.py`; along_over_across: ratio of the responses to tractions along and across waves; dx: length of the
    cells (mm); theta: distance from the leading cell's centre to the edge (cells); zones [n, 7]: of
    `leading_zone.numbers`; reach: see `unseen.py`.
    """
    for j in range(count.size):
        slips, sticks, largest = 0, 0, 0.0
        for step in range(count[j]):
            cell = index[step, j]
            largest = max(largest, pressure[cell])
            if not slip[cell]:
                sticks = step + 1
            elif slips == step:
                slips += 1
        if sticks == 0:
            continue
        n_x, n_y = normals[0, j], normals[1, j]
        first = index[slips, j]
        bound = friction * pressure[first]
        v_x, v_y = q[first, 0] / bound, q[first, 1] / bound
        along = (v_x * n_x + v_y * n_y) / k
        room = max(1.0 - v_x**2 - v_y**2, 0.0) / k**2
        t = min(math.sqrt(along**2 + room) - along, 600.0)
        width = (slips + theta) * math.exp(-t)
        # the zone slips opposite to d; |d| grows by `growth` with each factor e in the distance towards the edge
        d_x, d_y = v_x + t * k * n_x, v_y + t * k * n_y
        across_edge, along_edge = d_x * n_x + d_y * n_y, along_over_across * (d_y * n_x - d_x * n_y)
        growth = k * across_edge
        length = max(ends[1, j] - ends[0, j], 1e-3)
        sticking = min(sticks - 0.5 + theta, length)
        unit = 0.5 * math.pi * friction * largest * math.sqrt(sticking / length) * reach
        if slips == 0:
            doubtful, cells, missing = width, width, width
        else:
            past = min((slips - 1 + theta) / width, 1.0)
            doubtful, cells, missing = theta * past**4, past**2, -(past**2)
        hidden = 0.0
        if growth < 0.1:  # the bound of a leading cell differs from what stick carries by more than this
            hidden = width if slips == 0 else 0.0
        elif slips < zones.shape[0]:
            hidden = unseen_width(v_x * d_x + v_y * d_y, growth, slips, theta, zones[slips])
        # tractions that resist slip along d, whose component along d is what is too large
        size = unit * growth * hidden / (across_edge**2 + along_edge**2 / along_over_across)
        force_x = size * (across_edge * n_x - along_edge * n_y)
        force_y = size * (across_edge * n_y + along_edge * n_x)
        leading = index[0, j]
        lever = x[leading] + (theta - 0.5 * sticking) * dx
        out[0] += force_x
        out[1] += force_y
        out[2] += lever * force_y - y[leading] * force_x
        slip_x, slip_y = slip_behind(index[:sticks, j], by_pressure, sticking, theta)
        out[3] += force_x * slip_x + force_y * slip_y
        out[4] += abs(k) * friction * largest * doubtful
        out[5] += cells
        out[6] += missing
