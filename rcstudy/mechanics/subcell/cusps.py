r"""The cusp of the pressure at the border behind the stick zone, under full coupling.

Behind a border at b that runs across x, tractions are mu p; ahead of it they fall short of that by C sqrt(x - b), as in
Carter's strip (Johnson 1985, 8.3). Tractions lift the surfaces, which the pressure has to make up for (beta: Dundurs'
constant): it changes by beta/pi times the Hilbert transform of q_x. That of C sqrt(x - b) ahead of b is zero there and

    -+ beta C sqrt(b - x)

behind it. So the pressure is smooth in the stick zone and has a vertical tangent behind it. (That is for small mu beta.
As mu p follows the pressure, the power is 1/2 - arctan(mu beta)/pi in place of 1/2 where the cusp points upwards, 1/2 +
arctan(mu beta)/pi where it points downwards, and beta C/root(1 + (mu beta)^2) stands for beta C. The pressure is smooth
in the stick zone all the same.) Where tractions brake the coated body (q_x < 0, beta > 0) it is a cusp that points
upwards, and often holds the largest pressure and traction. Values of cells at the border approach it with the root of
the cell's size only: between a rigid ball and steel with friction 1 and partial slip by all creepages, 28 cells a
radius, largest pressure and traction are 1 and 2 % too small. The pressure at the border is therefore extrapolated from
the stick zone (`kernels/cusps.py`), as far as C allows: what a mean of the two cells at the border misses is half of
beta C sqrt(dx/2), 0.35 beta C sqrt(dx). More than `_REACH` beta C sqrt(dx) is an error of the extrapolation, as in
zones of a few cells or between bodies that are nearly alike. C is what tractions of the second stick cell ahead of the
border fall short of mu p, over the root of its distance. C sqrt(dx) is no more than mu p, as where tractions come to
nothing within a cell. (Of 3057 random contacts under full coupling this limit changes 218 largest pressures, which were
0.34 % off in the median and 0.59 in the mean with mu p alone in place of C sqrt(dx) and 0.5 for `_REACH`, now 0.22 and
0.46, and 744 largest tractions, which were 0.40 and 1.01 % off, now 0.32 and 0.92. Between steel and steel of another
modulus by 1e-3 that hardly slip, 131 contacts, largest tractions differ by 0.042 mu p0 in the root mean square from
those of bodies alike without any limit, by 0.006 with it.)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rcstudy.mechanics.kernels import cusps

# Cells: in slip zones less wide, what is behind a cusp that points downwards is not known (measured).
NARROW_BEHIND_CUSP = 5.0
_REACH = 0.4
# Cells of the stick zone from which the pressure is extrapolated: so many, or this multiple of the root of the zone's
# length in cells. Beside the border pressures of cells alternate about a smooth line, on any mesh, by as little as
# 1e-3 of themselves, which a parabola through the first three of these multiplies by six to ten.
_LEAST_CELLS, _PER_ROOT = 5, 1.3


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


class Rise(NamedTuple):
    """How far pressures rise, or fall, behind borders [n] within a cell: beta C sqrt(dx).

    `pull`: friction times the magnitude of Dundurs' constant beta; `by_room` [n] (MPa): by the second stick cell ahead.
    """

    pull: float
    by_room: np.ndarray

    def over(self, pressure: np.ndarray) -> np.ndarray:
        """Rise [n] (MPa) over `pressure` [n] (MPa), no more than by tractions that come to nothing within a cell."""
        return np.minimum(self.by_room, self.pull * pressure)


def within_reach(cusped: np.ndarray, smooth: np.ndarray, rise: Rise) -> np.ndarray:
    """p^2 [n] (MPa^2) at borders with cusps, as far as p differs from what is there without (`smooth`) by no more."""
    without = np.sqrt(smooth)
    reach = _REACH * rise.over(without)
    return np.clip(cusped, np.maximum(without - reach, 0.0) ** 2, (without + reach) ** 2)


def by_room(room: np.ndarray, distance: np.ndarray, beta: float) -> np.ndarray:
    """`Rise.by_room` [n] (MPa) from the `room` [n] (MPa) of second stick cells, by which they fall short of mu p.

    `distance` [n]: of their centres from the border (cells); `beta`: magnitude of Dundurs' constant.
    """
    return beta * np.maximum(room, 0.0) / np.sqrt(distance)


def squares_with_cusps(
    p: np.ndarray,
    high: np.ndarray,
    edges: np.ndarray,
    zone: tuple[np.ndarray, np.ndarray, np.ndarray],
    smooth: np.ndarray,
    rise: Rise,
) -> np.ndarray:
    """p^2 [n] (MPa^2) at borders behind stick zones, with cusps as far as these reach (:func:`within_reach`).

    p [nx, ny] (MPa), high [ny], edges [2, ny]: as in `cusps.squares_from_stick`; `zone`: borders [n, 2], last
    [ny], length [ny], as there; `smooth` [n]: p^2 there without cusps.
    """
    cusped = smooth.copy()
    taken = NARROW_BEHIND_CUSP, _LEAST_CELLS, _PER_ROOT
    cusps.squares_from_stick(p, high, edges, zone, *taken, cusped)
    return within_reach(cusped, smooth, rise)


def pressure_at_borders(p: np.ndarray, room: np.ndarray, slip: np.ndarray, friction: float, beta: float) -> float:
    """Largest pressure (MPa) at the borders behind stick zones, halfway between cells; 0 without a border.

    p [nx, ny] (MPa): pressures of cells; room [nx, ny] (MPa): by which their tractions fall short of `friction` times
    these; slip [nx, ny]: flags of slip cells; `beta`: magnitude of Dundurs' constant. Of several borders in a row the
    hindmost counts.
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
    zone = borders, last, stick.sum(axis=0).astype(np.float64)
    rise = Rise(friction * beta, by_room(room[np.minimum(first + 1, nx - 1), rows], np.full(len(rows), 1.5), beta))
    return float(np.sqrt(squares_with_cusps(p, high, edges, zone, smooth, rise).max()))
