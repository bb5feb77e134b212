r"""The cusp of the pressure at the border behind the stick zone, under full coupling.

Behind a border at b that runs across x, tractions are mu p; ahead of it they fall short of that by C sqrt(x - b), as in
Carter's strip (Johnson 1985, 8.3). Tractions lift the surfaces, which the pressure has to make up for (beta: Dundurs'
constant): it changes by beta/pi times the Hilbert transform of q_x. That of C sqrt(x - b) ahead of b is zero there and

    -+ beta C sqrt(b - x)

behind it. So the pressure is smooth in the stick zone and has a vertical tangent behind it. Where tractions brake the
coated body (q_x < 0, beta > 0) it is a cusp that points upwards, and often holds the largest pressure and traction.
Values of cells at the border approach it with the root of the cell's size only: between a rigid ball and steel with
friction 1 and partial slip by all creepages, 28 cells a radius, largest pressure and traction are 1 and 2 % too small.
The pressure at the border is therefore extrapolated from the stick zone (`kernels/cusps.py`), as far as C allows:
C sqrt(dx) is what tractions fall short of mu p one cell ahead, mu p itself where they come to nothing within a cell.
What a mean of the two cells at the border then misses, half of beta C sqrt(dx/2), is less than `_REACH` beta mu p. More
than that is an error of the extrapolation, as in narrow slip zones between bodies that are nearly alike. (On 275 of
these that hardly slip, steel on steel of another modulus by 1e-3, largest tractions were off by 0.038 mu p0 in the root
mean square without this limit, 0.008 with it; on 1145 others under full coupling nothing becomes worse.)
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rcstudy.mechanics.kernels import cusps

# Cells: in slip zones less wide, what is behind a cusp that points downwards is not known (measured).
NARROW_BEHIND_CUSP = 5.0
_REACH = 0.5


class Cusps(NamedTuple):
    """Cusps behind a stick zone, for the error bars.

    `of_pressure`, `of_traction`: by which fractions of themselves they change the largest pressure and traction, or
    would; `at_borders`: largest pressure (MPa) at such borders, 0 without one.
    """

    of_pressure: float = 0.0
    of_traction: float = 0.0
    at_borders: float = 0.0


def difference(one: float, other: float) -> float:
    """Magnitude of the difference of two values over the larger of them; 0 if both are nil."""
    largest = max(one, other)
    return abs(one - other) / largest if largest > 0.0 else 0.0


def within_reach(cusped: np.ndarray, smooth: np.ndarray, pull: float) -> np.ndarray:
    """p^2 [n] (MPa^2) at borders with cusps, as far as they differ from what is there without (`smooth`) by no more.

    `pull`: friction times the magnitude of Dundurs' constant.
    """
    return np.clip(cusped, smooth * max(1.0 - _REACH * pull, 0.0) ** 2, smooth * (1.0 + _REACH * pull) ** 2)


def squares_with_cusps(
    p: np.ndarray,
    high: np.ndarray,
    edges: np.ndarray,
    zone: tuple[np.ndarray, np.ndarray, np.ndarray],
    smooth: np.ndarray,
    pull: float,
) -> np.ndarray:
    """p^2 [n] (MPa^2) at borders behind stick zones, with cusps as far as these reach (:func:`within_reach`).

    p [nx, ny] (MPa), high [ny], edges [2, ny]: as in `cusps.squares_from_stick`; `zone`: last [ny], length [ny],
    borders [n, 2], as there; `smooth` [n]: p^2 there without cusps.
    """
    last, length, borders = zone
    cusped = smooth.copy()
    cusps.squares_from_stick(p, high, edges, last, length, NARROW_BEHIND_CUSP, borders, cusped)
    return within_reach(cusped, smooth, pull)


def pressure_at_borders(p: np.ndarray, slip: np.ndarray, pull: float = math.inf) -> float:
    """Largest pressure (MPa) at the borders behind stick zones, halfway between cells; 0 without a border.

    p [nx, ny] (MPa): pressures of cells; slip [nx, ny]: flags of slip cells; `pull`: as in :func:`within_reach`. Of
    several borders in a row the hindmost counts.
    """
    touched = p > 0.0
    stick = touched & ~slip
    before_slip = stick.copy()
    before_slip[0] = False
    before_slip[1:] &= slip[:-1]
    rows = np.flatnonzero(before_slip.any(axis=0))
    if not len(rows):
        return 0.0
    nx, ny = p.shape
    first = before_slip.argmax(axis=0)[rows]
    borders = np.stack([first - 0.5, rows.astype(np.float64)], axis=1)
    last = np.full(ny, -1)
    last[rows] = np.arange(len(rows))
    high = nx - 1 - touched[::-1].argmax(axis=0)
    edges = np.stack([touched.argmax(axis=0) - 0.5, high + 0.5])
    smooth = 0.5 * (p[first - 1, rows] ** 2 + p[first, rows] ** 2)
    zone = last, stick.sum(axis=0).astype(np.float64), borders
    return float(np.sqrt(squares_with_cusps(p, high, edges, zone, smooth, pull).max()))
