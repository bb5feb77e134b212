"""A smooth outline of the contact: r^2 as a few waves of the angle, fitted to edges that scatter by 0.03 of a cell.

From it follow the slopes of edges and the ends of rows at the contact's tips, where single edges are inaccurate.
Positions are in cells.
"""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def waves(u: float, v: float, out: np.ndarray) -> None:
    """Fill out [n], n being odd, with 1, cos(angle), sin(angle), cos(2 angle), ... of the direction of (u, v)."""
    r = math.sqrt(u * u + v * v)
    c, s = (u / r, v / r) if r > 0.0 else (1.0, 0.0)
    out[0] = 1.0
    a, b = 1.0, 0.0
    for m in range((out.size - 1) // 2):
        a, b = a * c - b * s, a * s + b * c
        out[2 * m + 1], out[2 * m + 2] = a, b


@jit
def normal_equations(u: np.ndarray, v: np.ndarray, matrix: np.ndarray, right: np.ndarray) -> None:
    """Normal equations, matrix [k, k] and right [k], of a fit to r^2 of points u, v [n] by `waves` of their angle."""
    wave = np.zeros(right.size)
    matrix[:, :] = 0.0
    right[:] = 0.0
    for k in range(u.size):
        waves(u[k], v[k], wave)
        square = u[k] * u[k] + v[k] * v[k]
        for a in range(wave.size):
            right[a] += wave[a] * square
            for b in range(wave.size):
                matrix[a, b] += wave[a] * wave[b]


@jit
def squared_radius(terms: np.ndarray, u: float, v: float, wave: np.ndarray) -> float:
    """r^2 of an outline in the direction from 0 to (u, v): the sum of `waves` times terms [n]; wave [n]: work array."""
    waves(u, v, wave)
    total = 0.0
    for m in range(terms.size):
        total += terms[m] * wave[m]
    return total


@jit
def off_outline(terms: np.ndarray, u: np.ndarray, v: np.ndarray) -> float:
    """Root mean square radial distance of points u, v [n] from an outline, see `squared_radius`."""
    off, wave = 0.0, np.zeros(terms.size)
    for k in range(u.size):
        square = u[k] * u[k] + v[k] * v[k]
        off += (squared_radius(terms, u[k], v[k], wave) - square) ** 2 / (4.0 * square)
    return math.sqrt(off / u.size)


@jit
def tip_position(terms: np.ndarray, side: float, wave: np.ndarray) -> float:
    """Coordinate v of the tip of an outline on the side (1 or -1) along v, looked for within 0.11 of the axis by angle.

    terms [n], wave [n]: as of `squared_radius`. v is in the units of the outline's r.
    """
    at, height = 0.5 * math.pi * side, np.zeros(3)
    for step in (0.1, 0.01):
        for k in range(3):
            c, s = math.cos(at + (k - 1) * step), math.sin(at + (k - 1) * step)
            height[k] = math.sqrt(max(squared_radius(terms, c, s, wave), 0.0)) * s * side
        bend = 2.0 * height[1] - height[0] - height[2]
        if bend > 0.0:
            at += min(max(0.5 * (height[2] - height[0]) / bend, -1.0), 1.0) * step
    return math.sqrt(max(squared_radius(terms, math.cos(at), math.sin(at), wave), 0.0)) * math.sin(at)


@jit
def crossing(terms: np.ndarray, v: float, side: float, wave: np.ndarray) -> float:
    """Coordinate u where an outline crosses the line of this v, on the side (1, -1) along u; 0 beyond the outline.

    terms [n], wave [n]: as of `squared_radius`. u and v are in the units of the outline's r.
    """
    u = side * math.sqrt(max(terms[0] - v * v, 0.0))
    for _ in range(6):  # converges fast, as r^2 hardly depends on the angle
        u = side * math.sqrt(max(squared_radius(terms, u, v, wave) - v * v, 0.0))
    return u


@jit
def smooth_ends(
    terms: np.ndarray, x0: float, width: float, y0: float, height: float, ends: np.ndarray, slopes: np.ndarray
) -> tuple[float, float]:
    """Lowest and highest row position of a smooth outline; fills ends [2, ny], where it crosses rows, and slopes [ny].

    terms: of the outline, see `off_outline`, about x0, y0 and in units of width and height. ends: the smaller x first;
    slopes: of the first end, in cells per row, as of an ellipse of these half axes. Both are nan in rows it does not
    reach.
    """
    wave = np.zeros(terms.size)
    low, high = y0 + height * tip_position(terms, -1.0, wave), y0 + height * tip_position(terms, 1.0, wave)
    for j in range(slopes.size):
        ends[0, j] = ends[1, j] = slopes[j] = math.nan
        if low < j < high:
            v = (j - y0) / height
            back = crossing(terms, v, -1.0, wave)
            ends[0, j], ends[1, j] = x0 + width * back, x0 + width * crossing(terms, v, 1.0, wave)
            # at least a quarter of a cell from the middle, as a guard: near a tip the end may lie at the middle or
            # beyond it, where the slope would be infinite
            slopes[j] = width / height * v / max(-back, 0.25 / width)
    return low, high
