r"""A slip zone at the leading edge on discrete cells: what m slip cells in front of a stick zone make of it.

In a strip with the pressure K sqrt(r), r in cells behind the leading edge, stick requires (`unseen.py`)

    q = mu K g sqrt(r) (1/g + ln(w0/r)),

g being what |q|/(mu p) grows by for each factor e: more than the bound for r < w0. Let f be that excess. On the
continuum the zone ends at w = 4 e^-2 w0, and tractions behind it are smaller by A r^(-1/2), A = mu K g w/2.

On cells, point sources with slip half a cell ahead of each (`moved_rows.py`), stick alone has tractions
mu K g (h_j + (1/g + ln w0) g_j) in cell j, with g_j = Gamma(j + 3/2)/Gamma(j + 1), which is nearly sqrt(r), and h_j
nearly -sqrt(r) ln r. If cells 0 to m - 1 slip, they carry their bounds mu K b_j instead, b_j being the mean of sqrt(r)
over the cell. Tractions in stick then change so that the slip there stays zero, and with f_j the excess of cell j

    in the first stick cell by        -sum_(j<m) f_j |binom(1/2, m - j)|,
    far behind like A r^(-1/2), A  =   sum_(j<m) f_j Gamma(m - j - 1/2)/(pi Gamma(m - j)),

the discrete counterpart of (1/pi) int f/sqrt(w - r) dr. All this is linear in ln w0 and in 1/g. So v, the first stick
cell's q/(mu p), tells w0, and cells miss E = w - 2 A/(mu K g) cells of the zone: w if none slips, +-0.1 of a cell if
one or two do. `numbers` has the coefficients of the two linear functions.

Tractions that are too large by E mu K g/2 r^(-1/2) at the edge are so by E mu K g/2 (l/(r (l - r)))^(1/2) in a stick
zone of length l: they are not bounded at its end, which moves instead. That is a force of pi/2 sqrt(l) mu K g E, which
acts in the middle of the zone.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

_TERMS = 1 << 13  # of a sum; what is left of it is added
_FAR = slice(40, 200)  # cells that are far behind the edge: h there defines its multiple of g


@lru_cache(8)
def numbers(most: int, theta: float, leading: float) -> np.ndarray:
    """Coefficients [most, 7] of the zone with m = 0, ..., `most` - 1 slip cells.

    v b_m/g = c0 + c1 ln w0 + c2/g and A/(mu K g) = c3 + c4 ln w0 + c5/g, with b_m = c6. `theta`: distance from the
    leading cell's centre to the edge (cells); `leading`: the part of the pressure by which slip by pressure is reduced
    in leading cells (`aligned.py`).
    """
    g, b = _roots(_FAR.stop, theta)
    h = _stick(theta, leading)
    r = np.arange(_FAR.stop) + theta
    law = np.stack([np.ones(r.size), 1.0 / r, r], axis=1)[_FAR]
    h -= np.linalg.lstsq(law, (h / g + np.log(r))[_FAR], rcond=None)[0][0] * g
    d = np.arange(2, most + 1)
    at_border = np.cumprod([0.5, *((2.0 * d - 3.0) / (2.0 * d))])
    far_behind = np.cumprod([1.0 / math.sqrt(math.pi), *((d - 1.5) / (d - 1.0))])
    out = np.zeros((most, 7))
    for m in range(most):
        near, far = at_border[:m][::-1], far_behind[:m][::-1]
        # the excess f_j/(mu K g) = h_j + ln w0 g_j + (g_j - b_j)/g
        excess = np.stack([h[:m], g[:m], g[:m] - b[:m]])
        out[m] = *([h[m], g[m], g[m]] - excess @ near), *(excess @ far), b[m]
    out.setflags(write=False)  # kept for all who ask
    return out


def _roots(count: int, theta: float) -> tuple[np.ndarray, np.ndarray]:
    """g_j and b_j [count]: the root of the distance from the edge as discrete stick has it, and its mean over cells."""
    j = np.arange(count)
    ahead = np.where(j > 0, j + theta - 0.5, 0.0)  # the first cell carries what is ahead of it
    g = 0.5 * math.sqrt(math.pi) * np.cumprod([1.0, *((j[1:] + 0.5) / j[1:])])
    return g, ((j + theta + 0.5) ** 1.5 - ahead**1.5) / 1.5


def _stick(theta: float, leading: float) -> np.ndarray:
    """Tractions [_FAR.stop] of discrete stick against the slip by a pressure sqrt(r), but for a multiple of g_j.

    The slip by pressure is that of `local_slip.py`. The matrix of point sources, 1/(pi (i - j - 1/2)), has the symbol
    (1 - z)^(1/2) (1 - 1/z)^(-1/2), so that its inverse is applied by two series.
    """
    _, b = _roots(2 * _TERMS, theta)
    s = 0.5 * (b + np.append(0.0, b[:-1]))
    s[:-1] += (2.0 * s[:-1] - s[1:] - np.append(0.0, s[:-2])) / 12.0
    s[0] -= leading * b[0]
    series = np.cumprod([1.0, *((np.arange(1, _TERMS) - 0.5) / np.arange(1, _TERMS))])  # of (1 - z)^(-1/2)
    fall = s[:-2] - s[1:-1]
    ahead = np.array([series @ (fall[i : i + _TERMS] - fall[:_TERMS]) for i in range(_FAR.stop)])
    ahead += np.arange(_FAR.stop) / (4.0 * math.sqrt(math.pi) * _TERMS)  # beyond the last term
    return -math.pi * np.array([series[i::-1] @ ahead[: i + 1] for i in range(_FAR.stop)])
