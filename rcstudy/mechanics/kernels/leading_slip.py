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
def leading_cells(cells: np.ndarray, slip: np.ndarray) -> tuple[int, int]:
    """How many cells of a row slip ahead of its first stick cell, and how many there are up to its last stick cell.

    cells [n]: numbers of the row's cells from the leading one on; slip [m]: flags of cells. The second is 0 if none
    sticks.
    """
    slips = sticks = 0
    for step in range(cells.size):
        if not slip[cells[step]]:
            sticks = step + 1
        elif slips == step:
            slips += 1
    return slips, sticks


@jit
def sticks_beside(index: np.ndarray, count: np.ndarray, slip: np.ndarray, j: int) -> bool:
    """Whether cells stick in both rows beside row j; index, count, slip: as in `hidden_leading_slip`."""
    if j == 0 or j == count.size - 1:
        return False
    before, behind = index[: count[j - 1], j - 1], index[: count[j + 1], j + 1]
    return leading_cells(before, slip)[1] > 0 and leading_cells(behind, slip)[1] > 0


@jit
def detached_rows(index: np.ndarray, count: np.ndarray, slip: np.ndarray) -> int:
    """Number of rows that slip at the leading edge, and stick farther behind as both rows beside them do.

    index, count, slip: as in `hidden_leading_slip`.
    """
    rows = 0
    for j in range(count.size):
        slips, sticks = leading_cells(index[: count[j], j], slip)
        if slips > 0 and sticks > 0 and sticks_beside(index, count, slip, j):
            rows += 1
    return rows


@jit
def at_bound(v_x: float, v_y: float, n_x: float, n_y: float, k: float) -> tuple[float, float, float]:
    """t and d of the law of stick towards an edge with normal n: d = v + t k n reaches the bound, |d| = 1.

    v: traction over its bound; k: see `unseen.py`. t is limited to 600, as exp(-t) is used.
    """
    along = (v_x * n_x + v_y * n_y) / k
    room = max(1.0 - v_x**2 - v_y**2, 0.0) / k**2
    t = min(math.sqrt(along**2 + room) - along, 600.0)
    return t, v_x + t * k * n_x, v_y + t * k * n_y


@jit
def unseen_width(v: float, growth: float, slips: int, theta: float, zone: np.ndarray) -> float:
    """Cells of the zone at the leading edge that `slips` slip cells miss, twice E of `leading_zone.py`.

    v: traction of the first stick cell over its bound, along the slip; growth: by how much it grows for each factor e
    towards the edge; theta: distance from the leading cell's centre to the edge (cells); zone [7]: of
    `leading_zone.numbers`. w0 is limited to what it is for so many slip cells if growth is between 0.15 and 1.5.
    """
    # the limits: at most so many times the distance from the first stick cell's centre to the edge, if no cell slips or
    # some do; at least so many times that from the last slip cell's, if one slips or more do
    most_of_none, most_of_some, least_of_one, least_of_more = 1.15, 1.85, 0.8, 1.35
    # v b/g = c0 + c1 ln w0 + c2/g gives w0, and c3 + c4 ln w0 + c5/g what the slip cells have of the zone
    c0, c1, c2, c3, c4, c5, b = zone[0], zone[1], zone[2], zone[3], zone[4], zone[5], zone[6]
    log = ((v * b - c2) / growth - c0) / c1
    if slips == 0:
        log = min(log, math.log(most_of_none * theta))
    else:
        least = least_of_one * theta if slips == 1 else least_of_more * (slips - 1 + theta)
        log = min(max(log, math.log(least)), math.log(most_of_some * (slips + theta)))
    whole = 4.0 * math.exp(log - 2.0)  # w = 4 e^-2 w0
    return 2.0 * (whole - 2.0 * (c3 + log * c4 + c5 / growth))


@jit
def by_the_law(growth: float) -> bool:
    """Whether tractions grow enough towards the edge, for each factor e in the distance, for the law to tell a zone."""
    return growth >= 0.1


@jit
def missing_width(v: float, growth: float, slips: int, width: float, theta: float, zones: np.ndarray) -> float:
    """Cells of the zone at the leading edge that `slips` slip cells miss: `unseen_width`, or width (cells) by the law.

    zones [n, 7]: of `leading_zone.numbers`. Where tractions grow too little (`by_the_law`), or decrease, that width
    stands for it if no cell slips: the bound of a leading cell differs from what stick carries by more than they grow.
    Nothing is missing from zones of n slip cells and more.
    """
    if not by_the_law(growth):
        return width if slips == 0 else 0.0
    return unseen_width(v, growth, slips, theta, zones[slips]) if slips < zones.shape[0] else 0.0


@jit
def doubts(slips: int, width: float, theta: float) -> tuple[float, float, float]:
    """What is uncertain of a zone of this width (cells) in a row with so many slip cells, in cells.

    The part of the zone whose tractions are doubtful; the area; and the area that slips unseen, less that by which a
    visible slip zone is too large (`unseen.py`). Of a visible zone the first falls with the fourth power, the others
    with the square, of the distance from its last slip cell's centre to the edge over the zone's width.
    """
    if slips == 0:
        return width, width, width
    past = min((slips - 1 + theta) / width, 1.0)
    return theta * past**4, past**2, -(past**2)


@jit
def hidden_leading_slip(
    table: tuple[np.ndarray, ...],
    normals: np.ndarray,
    cells: tuple[np.ndarray, np.ndarray, np.ndarray, float],
    x: np.ndarray,
    y: np.ndarray,
    by_pressure: np.ndarray,
    bodies: tuple[float, float, float],
    dx: float,
    theta: float,
    zones: np.ndarray,
    out: np.ndarray,
) -> None:
    """Add the effects of narrow slip zones at the leading edge, summed over the rows, to out [8]; see `unseen.py`.

    First the excess of the sums of tractions: force_x, force_y (MPa), moment (MPa mm), power (MPa). Then what is
    uncertain: force (MPa), area (cells). Then the area (cells) that slips unseen, less that by which a visible slip
    zone is too large. Last the number of rows whose visible slip zone is none by the law (`by_the_law`): of those that
    `detached_rows` counts.

    table: a `moved_rows.RowTable`: index [most, ny], numbers of the cells of each row from the leading one on; start
    [ny]; count [ny] of them; ends [2, ny], trailing and leading edge of each row (cells). normals [2, ny]: of the
    leading edge. cells: tractions q [m, 2] (MPa), slip flags [m], pressure [m] (MPa), friction coefficient. x, y [m]
    (mm): of their centres; by_pressure [m, 2]: slip by pressure there. bodies: k, see `unseen.py`; ratio of the
    responses to tractions along and across waves; reach, see `unseen.py`. dx: length of the cells (mm); theta: distance
    from the leading cell's centre to the edge (cells); zones [n, 7]: of `leading_zone.numbers`.
    """
    (index, _, count, ends), (q, slip, pressure, friction) = table, cells
    k, along_over_across, reach = bodies
    for j in range(count.size):
        row = index[: count[j], j]
        slips, sticks = leading_cells(row, slip)
        if sticks == 0:
            continue
        largest = 0.0
        for step in range(row.size):
            largest = max(largest, pressure[row[step]])
        n_x, n_y = normals[0, j], normals[1, j]
        first = row[slips]
        bound = friction * pressure[first]
        v_x, v_y = q[first, 0] / bound, q[first, 1] / bound
        # the zone slips opposite to d; |d| grows by `growth` with each factor e in the distance towards the edge
        t, d_x, d_y = at_bound(v_x, v_y, n_x, n_y, k)
        width = (slips + theta) * math.exp(-t)
        across_edge, along_edge = d_x * n_x + d_y * n_y, along_over_across * (d_y * n_x - d_x * n_y)
        growth = k * across_edge
        missing = missing_width(v_x * d_x + v_y * d_y, growth, slips, width, theta, zones)
        # pi/2 mu max(p) g (2 E) sqrt(l/L), the component along d of the tractions that resist slip along it
        length = max(ends[1, j] - ends[0, j], 1e-3)
        sticking = min(sticks - 0.5 + theta, length)
        unit = 0.5 * math.pi * friction * largest * math.sqrt(sticking / length) * reach
        size = unit * growth * missing / (across_edge**2 + along_edge**2 / along_over_across)
        force_x = size * (across_edge * n_x - along_edge * n_y)
        force_y = size * (across_edge * n_y + along_edge * n_x)
        lever = x[row[0]] + (theta - 0.5 * sticking) * dx
        slip_x, slip_y = slip_behind(row[:sticks], by_pressure, sticking, theta)
        doubtful, area, unseen = doubts(slips, width, theta)
        out[0] += force_x
        out[1] += force_y
        out[2] += lever * force_y - y[row[0]] * force_x
        out[3] += force_x * slip_x + force_y * slip_y
        out[4] += abs(k) * friction * largest * doubtful
        out[5] += area
        if slips == 0 or by_the_law(growth):
            out[6] += unseen
        elif sticks_beside(index, count, slip, j):
            out[7] += 1.0
