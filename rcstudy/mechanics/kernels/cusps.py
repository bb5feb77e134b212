"""Pressure at the border behind the stick zone under full coupling, where it has a cusp.

The derivation is in `cusps.py`, from Carter's strip (Johnson 1985, section 8.3).
"""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def at_origin(x: tuple[float, float, float], near: float, middle: float, far: float) -> float:
    """Value at 0 of the parabola through near, middle and far at x."""
    a, b, c = x
    return b * c / ((a - b) * (a - c)) * near + a * c / ((b - a) * (b - c)) * middle + a * b / ((c - a) * (c - b)) * far


@jit
def fitted_at_origin(p: np.ndarray, j: int, first: int, n: int, t: float) -> float:
    """Value at 0 of the parabola that best fits p^2 of n cells of row j of p [nx, ny], numbers first, first + 1, ...

    Their centres are at t, t + 1, ...; n is 3 at least.
    """
    middle = 0.5 * (n - 1)
    s2 = s4 = v0 = v1 = v2 = 0.0
    for k in range(n):
        u, square = k - middle, p[first + k, j] ** 2
        s2 += u * u
        s4 += u * u * u * u
        v0 += square
        v1 += u * square
        v2 += u * u * square
    bend, u = (n * v2 - s2 * v0) / (n * s4 - s2 * s2), -t - middle
    return (v0 - bend * s2) / n + v1 / s2 * u + bend * u * u


@jit
def squares_from_stick(
    p: np.ndarray,
    high: np.ndarray,
    edges: np.ndarray,
    zone: tuple[np.ndarray, np.ndarray, np.ndarray],
    narrow: float,
    least: int,
    per_root: float,
    squares: np.ndarray,
) -> None:
    """Replace p^2 at the borders behind stick zones by the parabola that best fits p^2 of cells ahead, in place.

    These are the second cell whose centre lies ahead of the border, as the first is not smooth, and those that follow
    it: `least` of them or `per_root` times the root of the stick zone's length, but for the outermost two cells of the
    row and what lies beyond the stick zone. If these are not more than three the second to fourth cells are taken;
    where the fourth is one of the outermost two the leading edge, with p = 0, takes its place. p [nx, ny] (MPa); high
    [ny]: last cell in contact of each row; edges [2, ny]: where the row begins and ends; zone: borders [n, 2], last
    [ny], length [ny], as from `stick.stick_rows`; squares [n] (MPa^2): at the borders. What is there already stays in
    rows without such a border and where the stick zone does not reach so far. Where it is larger, so that the cusp
    points downwards, the mean of both is taken, or, in slip zones less than `narrow` (cells) wide, it stays.
    """
    borders, last, length = zone
    for j in range(last.size):
        k = last[j]
        if k < 0:
            continue
        x = borders[k, 0]
        first = math.ceil(x) + 1
        t, inside = first - x, high[j] - 2 - first  # cells beyond the first that are not outermost ones
        if x < 0.0 or inside < 1 or first + 1 > x + length[j]:
            continue
        stick = min(inside + 1, int(x + length[j]) - first + 1)
        n = min(stick, max(least, int(per_root * math.sqrt(length[j]) + 0.5)))
        if n > 3:
            square = fitted_at_origin(p, j, first, n, t)
        else:
            third, far = (t + 2.0, p[first + 2, j] ** 2) if inside > 1 else (edges[1, j] - x, 0.0)
            square = at_origin((t, t + 1.0, third), p[first, j] ** 2, p[first + 1, j] ** 2, far)
        if square > squares[k]:
            squares[k] = square
        elif x - edges[0, j] >= narrow:
            squares[k] = 0.5 * (squares[k] + max(square, 0.0))
