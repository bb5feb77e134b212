"""Outline of the contact from its crossings with rows and columns (`edges.py`), its area, the largest pressure."""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def middle_and_width(lines: np.ndarray) -> tuple[int, float, float]:
    """Number of lines that cross an outline, the mean of all crossings, and half the distance of the outermost ones.

    lines [2, n]: see `accurate_crossings`. If no line crosses it, the number is 0 and the others have no meaning.
    """
    count, total, least, most = 0, 0.0, math.inf, -math.inf
    for k in range(lines.shape[1]):
        if lines[0, k] <= lines[1, k]:
            count += 1
            total += lines[0, k] + lines[1, k]
            least, most = min(least, lines[0, k]), max(most, lines[1, k])
    return count, total / max(2 * count, 1), 0.5 * (most - least)


@jit
def accurate_crossings(
    rows: np.ndarray, columns: np.ndarray, dx: float, dy: float, u: np.ndarray, v: np.ndarray
) -> tuple[int, float, float, float, float]:
    """Points of an outline: those of its crossings with rows and columns that determine it well.

    rows [2, ny]: row j crosses it at x = rows[:, j]; columns [2, nx]: column i at y = columns[:, i]; positions in
    cells, the smaller first, nan in lines that do not cross it; dx, dy (mm): distances of columns and of rows. Returns
    the number of points, and the outline's middle and half width along x, and along y. The points, relative to the
    middle and in units of the half widths, go into u, v [>= 2 (ny + nx)]. There are none if fewer than three rows or
    columns cross the outline.

    A crossing is accurate where the outline is steep to the line, and inaccurate where it runs along it. So rows give
    the parts of the outline that face x, columns those that face y. The points go round in four parts: front, high
    side, back, low side.
    """
    nrows, x0, width = middle_and_width(rows)
    ncolumns, y0, height = middle_and_width(columns)
    found = 0
    if min(nrows, ncolumns) < 3 or not (width > 0.0 and height > 0.0):
        return found, x0, width, y0, height
    for part in range(4):
        lines = rows if part % 2 == 0 else columns
        n = lines.shape[1]
        for step in range(n):
            k = step if part == 0 or part == 3 else n - 1 - step
            if not lines[0, k] <= lines[1, k]:
                continue
            at = lines[1 if part < 2 else 0, k]
            u[found] = ((at if part % 2 == 0 else k) - x0) / width
            v[found] = ((k if part % 2 == 0 else at) - y0) / height
            # the larger component of the normal decides between rows (along x) and columns (along y)
            if (abs(u[found]) * height * dy >= abs(v[found]) * width * dx) == (part % 2 == 0):
                found += 1
    return found, x0, width, y0, height


@jit
def area_within(rows: np.ndarray, columns: np.ndarray, dx: float, dy: float) -> float:
    """Area (cells) within an outline that crosses rows and columns; 0 if there are too few crossings.

    Arguments as in `accurate_crossings`.
    In coordinates scaled by the outline's half widths it is nearly a circle. Its area there is half the integral of r^2
    over the angle, r^2 being linear between crossings.
    """
    most = 2 * (rows.shape[1] + columns.shape[1])
    u, v = np.zeros(most), np.zeros(most)
    n, _, width, _, height = accurate_crossings(rows, columns, dx, dy, u, v)
    if n == 0:
        return 0.0
    total = 0.0
    for k in range(n):
        after = k + 1 if k + 1 < n else 0
        total += sector(u[k], v[k], u[after], v[after])
    return width * height * total


@jit
def sector(u0: float, v0: float, u1: float, v1: float) -> float:
    """Area swept by the radius from the origin on the way from (u0, v0) to (u1, v1), r^2 being linear in the angle."""
    angle = math.atan2(u0 * v1 - v0 * u1, u0 * u1 + v0 * v1)
    return 0.25 * angle * (u0 * u0 + v0 * v0 + u1 * u1 + v1 * v1)


@jit
def summit(p: np.ndarray, along: float, across: float) -> tuple[float, float, float]:
    """Largest pressure (MPa) of p [nx, ny] (MPa), and its position along x and y: the vertex of parabolas through p^2.

    The pressure of the cell with the largest one is too large by `along` and `across` times 2 p - p_before - p_after
    along x and y, which is subtracted. Nothing is subtracted where the sum of these two differences exceeds half the
    pressure, as it does beside the edge of the contact: the error in a ridge, as at the rim under a stiff skin, does
    not follow from parabolas. Nor is more than 30 % subtracted or 5 % added: what `along` and `across` say of long
    waves in films much softer than the body, thinner than a cell or about as thick, does not hold for so few cells.
    """
    nx, ny = p.shape
    i = j = 0
    for k in range(nx):
        for m in range(ny):
            if p[k, m] > p[i, j]:
                i, j = k, m
    top = p[i, j] ** 2
    height, place = top, np.array([float(i), float(j)])
    excess = concentrated = 0.0
    for axis in range(2):
        k, m = (1, 0) if axis == 0 else (0, 1)
        after = p[i + k, j + m] if i + k < nx and j + m < ny else 0.0
        before = p[i - k, j - m] if i >= k and j >= m else 0.0
        bend_of_p = 2.0 * p[i, j] - before - after
        excess += bend_of_p
        concentrated += (along if axis == 0 else across) * bend_of_p
        bend = 2.0 * top - before**2 - after**2
        if bend > 0.0:
            height += (after**2 - before**2) ** 2 / (8.0 * bend)
            place[axis] += (after**2 - before**2) / (2.0 * bend)
    smooth = excess < 0.5 * p[i, j]
    concentrated = min(max(concentrated, -0.05 * p[i, j]), 0.3 * p[i, j])
    return math.sqrt(height) - (concentrated if smooth else 0.0), place[0], place[1]
