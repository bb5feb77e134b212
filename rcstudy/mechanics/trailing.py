r"""What rows that stick up to their trailing end carry too little: cells end elsewhere than the contact does.

Where creepage is small bodies stick nearly up to the trailing edge, where tractions go like A r^(-1/2), r ahead of it,
until they reach the bound mu K r^(1/2). There a zone of width w slips that cells do not see if it is narrower than one.

- Under constant slip the k point sources of a row, with slip asked for halfway ahead of each, have the sum of a strip
  that begins 3/4 of a cell ahead of the first and ends 1/4 behind the last one (as lattices of vortices lift like
  plates): it is k cells long, while the row is L. The last source is A Gamma(1/2)/Gamma(1), so A = q/pi^(1/2).
- Tractions in stick ahead of the zone are bounded at its end, r = w, and mu K r^(1/2) behind that:
  (1/pi) (r - w)^(1/2) int_0^w mu K t^(1/2) (w - t)^(-1/2)/(r - t) dt = (mu K w/2) r^(-1/2) (1 + w/(4 r) + ...).
  So w = 2 A/(mu K), with Hertz's K = 2 max(p)/L^(1/2), and they are those of a strip that sticks all along and is w/2
  shorter.
- An end that moves by e changes tractions by e A/2 (s/L)^(1/2) (L - s)^(-3/2), s behind the leading edge, in all by

      pi/2 A e/L^(1/2),   e = L - k - w/2 (in cells),

  with the lever 3/2 L behind the leading edge. In contacts, whose tractions in stick are larger than those of strips
  (1.25 times in round ones, Kalker 1967), that is `_IN_CONTACTS` times as much.

The border of the slip zone is r = w, while that is less than `NARROW`: wider ones show in what room cells leave.

Of 240 random contacts at 0.003 to 0.5 of the creepages of other samples, on 20 to 68 cells against four to six times as
many, forces along x and y and moments of steel on steel were 0.62, 0.51 and 0.74 % off (root of mean square, of the
force itself) and are 0.10, 0.18 and 0.25 %; lateral forces and moments of mild contacts 0.22 and 0.34, and are 0.08 and
0.16 %. Slip areas of those with 0.1 to 2 % of slip were 0.7 % of the contact off and are 0.07 to 0.2 %, their largest
tractions 40 to 50 % (by the largest of a cell) and are 8 %.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rcstudy.mechanics.kernels import trailing_stick

if TYPE_CHECKING:
    from rcstudy.mechanics.moved_rows import MovedRows

NARROW = 0.5
"""In cells: zones that are narrower are found here, others by the room of the last cells (`kernels/stick.py`)."""

_IN_CONTACTS = 1.3  # times what a strip's row gains


class Ending(NamedTuple):
    """Force along x and y (N) and moment about z (N mm) that rows carry too little which stick up to their end."""

    force_x: float = 0.0
    force_y: float = 0.0
    moment_z: float = 0.0


def hidden_widths(rows: MovedRows, ends: np.ndarray, q: np.ndarray, slip: np.ndarray, friction: float) -> np.ndarray:
    """How much of each row slips behind its last cell that sticks, w [ny] (in cells); nan in rows that do not.

    Arguments as in `ending_of_rows`.
    """
    widths = np.zeros(rows.count.size)
    trailing_stick.hidden_widths(rows.index, rows.count, ends, q, slip, rows.pressure, friction, widths)
    return widths


def ending_of_rows(
    rows: MovedRows,
    ends: np.ndarray,
    centres: tuple[np.ndarray, np.ndarray],
    q: np.ndarray,
    slip: np.ndarray,
    friction: float,
    spacing: tuple[float, float],
    theta: float,
) -> Ending:
    """What `rows` carry too little under tractions `q` [m, 2] (MPa) with slip flags `slip` [m].

    `ends` [2, ny]: their trailing and leading edges (in cells); `centres`: coordinates x, y [m] (mm) of the cells, of
    sides `spacing` (mm); `theta`: from a leading cell's centre to the edge (in cells).
    """
    (dx, dy), sums = spacing, np.zeros(3)
    widths = hidden_widths(rows, ends, q, slip, friction)
    trailing_stick.ending_rows(rows.index, rows.count, ends, widths, *centres, q, dx, theta, sums)
    return Ending(*(_IN_CONTACTS * dx * dy * sums).tolist())
