"""Slip at the centres of slip cells, from the points half a cell ahead to which it belongs (`centring.py`).

q, bound, s, slip, normal, share, rho: of the cells, as in `tractions.py`; neighbours, local, weight: as in `centre`.
"""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def slip_at_leading_edge(s: np.ndarray, first: int, second: int) -> float:
    """Magnitude of the slips s [m, 2] at the edge, from a row's first and second cell; at most that of the first.

    By a root through the two, a quarter and five quarters of a cell behind the edge; zero if that is negative.
    """
    size = math.sqrt(s[first, 0] ** 2 + s[first, 1] ** 2)
    behind = math.sqrt(s[second, 0] ** 2 + s[second, 1] ** 2)
    at_edge = size - (behind - size) / (math.sqrt(5.0) - 1.0)
    return min(max(at_edge, 0.0), size)


@jit
def centre(
    s: np.ndarray,
    slip: np.ndarray,
    neighbours: np.ndarray,
    local: np.ndarray,
    weight: np.ndarray,
    out: np.ndarray,
) -> None:
    """Slips out [m, 2], those of slip cells interpolated to their centres from the points half a cell ahead.

    Fills weight [3, m]:

        centred slip = s + weight[0] (s_ahead - s) + weight[1] (s_behind - s) + weight[2] (s_second - s).

    These are a parabola through the three points; at a row's trailing end one through the cell's own point and the next
    two ahead (s_second: of the second cell ahead); a straight line where a point is missing or the cell ahead sticks.
    The correction is reduced so that at least half of s remains along s. neighbours [2, m]: numbers of the cells ahead
    and behind, a cell's own where there is none.

    local [5, m], or [5, 0] if there is none: the part of s that is proportional to the pressure is not interpolated but
    known (Johnson 1985, 2.25a). Components along x and y of that slip per unit pressure (1/MPa), pressures that it has
    in s, and those at the centres (MPa), and the slip s0 at which tractions begin to cancel it: see `local_slip.py`.
    The part S^2/(S^2 + s0^2) of it counts, S being the slip, that at the leading edge if the cell is the first of
    several.
    """
    for m in range(s.shape[0]):
        x, y = s[m, 0], s[m, 1]
        weight[0, m] = weight[1, m] = weight[2, m] = 0.0
        if slip[m]:
            ahead, behind = neighbours[0, m], neighbours[1, m]
            second = neighbours[0, ahead]
            of_ahead, of_behind, of_second = -0.125, 0.375, 0.0
            if ahead == m:
                of_ahead, of_behind = 0.0, 0.5 if behind != m else 0.0
            elif behind == m and second != ahead and slip[ahead] and slip[second]:
                of_ahead, of_behind, of_second = -1.25, 0.0, 0.375
            elif behind == m or not slip[ahead]:
                of_ahead, of_behind = -0.5, 0.0
            more_x = of_ahead * (s[ahead, 0] - x) + of_behind * (s[behind, 0] - x) + of_second * (s[second, 0] - x)
            more_y = of_ahead * (s[ahead, 1] - y) + of_behind * (s[behind, 1] - y) + of_second * (s[second, 1] - y)
            square = x**2 + y**2
            if local.shape[1] > 0 and (local[0, m] != 0.0 or local[1, m] != 0.0):
                at, of_s = local[3, m], local[2]
                more = of_ahead * (of_s[ahead] - of_s[m]) + of_behind * (of_s[behind] - of_s[m])
                missing = at - of_s[m] - more - of_second * (of_s[second] - of_s[m])
                first = ahead == m and behind != m
                there = slip_at_leading_edge(s, m, behind) if first else math.sqrt(square)
                factor = there**2 / (there**2 + local[4, m] ** 2) if there > 0.0 else 0.0
                more_x += factor * missing * local[0, m]
                more_y += factor * missing * local[1, m]
            along = more_x * x + more_y * y
            part = 1.0 if along >= -0.5 * square else -0.5 * square / along
            weight[0, m], weight[1, m], weight[2, m] = part * of_ahead, part * of_behind, part * of_second
            x, y = x + part * more_x, y + part * more_y
        out[m, 0], out[m, 1] = x, y


@jit
def update_directions(
    q: np.ndarray,
    s: np.ndarray,
    bound: np.ndarray,
    rho: float,
    slip: np.ndarray,
    normal: np.ndarray,
    share: np.ndarray,
) -> float:
    """Directions and shares of slip cells as `tractions.classify` sets them, but from another slip s [m, 2].

    Both stay where q - rho s is zero, which has no direction; states are not changed. Returns the squared norm of
    q - Proj(q - rho s), Proj being onto the circle, not the disc, in slip cells.
    """
    residual = 0.0
    for m in range(q.shape[0]):
        tx = q[m, 0] - rho * s[m, 0]
        ty = q[m, 1] - rho * s[m, 1]
        size = math.sqrt(tx * tx + ty * ty)
        if slip[m] and size > 0.0:
            normal[m, 0] = tx / size
            normal[m, 1] = ty / size
            share[m] = min(bound[m] / size, 1.0)
        if size > 0.0 and (slip[m] or size > bound[m]):
            tx *= bound[m] / size
            ty *= bound[m] / size
        residual += (q[m, 0] - tx) ** 2 + (q[m, 1] - ty) ** 2
    return residual


@jit
def centre_and_direct(
    q: np.ndarray,
    s: np.ndarray,
    bound: np.ndarray,
    rho: float,
    slip: np.ndarray,
    normal: np.ndarray,
    share: np.ndarray,
    neighbours: np.ndarray,
    local: np.ndarray,
    weight: np.ndarray,
    out: np.ndarray,
) -> float:
    """`centre`, then `update_directions` by the centred slips out [m, 2]; returns what the latter does."""
    centre(s, slip, neighbours, local, weight, out)
    return update_directions(q, out, bound, rho, slip, normal, share)


@jit
def local_slip(
    pressure: np.ndarray,
    index: np.ndarray,
    count: np.ndarray,
    normals: np.ndarray,
    trailing_normals: np.ndarray,
    slip_under_pressure: float,
    leading: float,
    out: np.ndarray,
) -> None:
    """The first three rows of out [5, m], see `local_slip.local_slip`; those that are zero are left alone.

    pressure [m] (MPa): of the cells; index [most, ny], count [ny]: as in `row_cells.number_cells`; normals,
    trailing_normals [2, ny]: of the rows' edges.
    """
    for j in range(count.size):
        n = count[j]
        ahead = between = 0.0  # of the cell ahead: its pressure, and the mean of those on either side of its own slip
        for k in range(n):
            m = index[k, j]
            here = 0.5 * (pressure[m] + ahead)  # the displacement changes by half of either cell's load
            behind = 0.5 * (pressure[m] + (pressure[index[k + 1, j]] if k + 1 < n else 0.0))
            out[2, m] = here + (2.0 * here - between - behind) / 12.0  # `convolution.point_factor` along the row
            ahead, between = pressure[m], here
        if n > 0:
            first, last = index[0, j], index[n - 1, j]
            out[2, first] -= leading * pressure[first]
            for side in range(2):
                m, normal = (last, trailing_normals) if side == 0 else (first, normals)
                part = slip_under_pressure * normal[0, j]  # n_x: of the slip, only what is along x
                out[0, m], out[1, m] = part * normal[0, j], part * normal[1, j]
