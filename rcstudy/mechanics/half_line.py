r"""The discrete half-line: where a straight edge lies between cells, from the pressures beside it, for given bodies.

A half-line is a contact with one straight edge and no other end. Solved with cells it has pressures p_0, p_1, ... from
the outermost cell inwards; solved without cells a pressure p(x) at x behind its edge. The two have to agree far from
the edge. That tells how far ahead of the outermost centre the edge lies (xi, in cells).

Only waves across the edge matter. The frequency response of the bodies to them is C(k) = g(k)/k (mm/MPa), g being
constant for a half-space; k is in units of 1/h from here on, h being the length of a cell. Pressures constant in cells,
with displacements taken at their centres, have a periodic response, as all waves k that look alike on the cells add up:

    A(t) = sum C(k) sin(k/2)/(k/2),   k = t + 2 pi n,   n = ..., -1, 0, 1, ...

C and A are factorised into parts that act to one side only (Wiener and Hopf 1931). Let A = |2 sin(t/2)|^-1 B, the
first factor being the response of point sources on a half-space. The factor of B is, but for a constant,
B+(z) = 1 + b1 z + b2 z^2 + ...; its logarithm is half the Fourier series of log B. Discrete pressures that keep a plane
contact closed are the coefficients p_j of z^j in

    (gamma (1 - z)^-5/2 + alpha (1 - z)^-3/2 + beta (1 - z)^-1/2)/B+(z),

three solutions that go like j^(3/2), j^(1/2) and j^(-1/2) inside the contact. The Laplace transform of the continuous
pressure is exp(s xi) (c s^-5/2 + a s^-3/2)/G+(s), with x^(3/2) and x^(1/2), but not x^(-1/2), as it ends at zero. With
z = exp(-s) both have to agree for s -> 0. There B+/G+ is exp(-d s), and the cells move the edge by

    shift = d - 1/4 = -1/4 - 1/pi (int_0^pi log B/(4 sin^2(t/2)) dt - int_0^inf log g/k^2 dk),

1/4 being the part of the point sources; in the first integral the sum of 1/k^2 over all n has taken the place of 1/k^2.
Three pressures determine alpha, beta and gamma. With q = B+ p, i.e. q0 = p0, q1 = p1 + b1 p0, q2 = p2 + b1 p1 + b2 p0,

    gamma = q2 - 3/2 q1 + 3/8 q0,   rise = 3/2 gamma + alpha = -1/2 q2 + 7/4 q1 - 11/16 q0,

and e, the distance of the edge from where it is when p0 is zero, follows from the condition on x^(-1/2):

    xi = shift + e,   gamma/2 e^2 - rise e + q0 = 0   (`kernels/rows.py`).

Nothing is fitted. In a strip the error of the edge, averaged over its positions between cells, is 1e-4 of a cell.
Layers thinner than a cell are covered as well, since their effect is contained in g. For 260 contacts with films of
0.1 to 100 GPa, 0.006 to 0.3 mm thick, with or without stiff skins, on 16 to 40 cells against six times as many, the
error of the area is 0.5 % (root mean square) and 0.25 % (median); with rules fitted to such contacts instead it is 2.7
and 0.7 %.

Inside the contact the discrete pressure of a wave is too large by the factor C/A. For long waves this is 1 + t^2/24 on
a half-space. As the load is given, half of this error remains (second moments and largest pressures of Hertz contacts:
0.018 to 0.021 of second differences). It is `excess`, log(C/A)/(2 t^2), taken at t = 0.24, a wave of 26 cells: 1/52 on
a half-space, 1/48 for t -> 0. On incompressible films of 1e-3 and 1e-4 of the substrate's modulus it is down to -0.5
and -1.0 (0.5 and 0.4 of a cell thick), and up to 0.04 and 0.23 (a tenth of a cell). On softer ones, 5e-6 of it, it
is up to 4: contacts of few cells have no waves so long, and `kernels/outline.py` limits what comes of it.

The border of a stick zone is such an edge, too: there the room, i.e. mu p - |q|, by which tractions in stick stay below
the bound, and the slip behind the border vary like the root of the distance. The cells of `aligned.py` are point
sources on a half-space in this case, so that B is the ratio of A with and without layers.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

EDGE = 0.7480
"""theta: distance (cells) from a leading cell's centre to the edge where stick begins for cells (`moved_rows.py`)."""

OWN = 8
"""Terms of the sum A(t) to either side, and the place of the wave itself; others change the edge by less than 1e-4."""

_LONG = 1e-6  # wave number (1/h) at which g is that of the substrate
_FARTHEST = 13  # doublings of pi/h at which g is taken for all waves shorter than half as many
_LEAST = 1e-3  # lower limit of A(t) over C(t), as the logarithm of A is needed


class HalfLine(NamedTuple):
    """Numbers of a discrete half-line: the filter B+, the shift of the edge, and the excess of pressures.

    b1, b2, total: coefficients of z and z^2, and sum of all coefficients, of the filter B+ = 1 + b1 z + ..., by which
    pressures in cells become those of point sources on a half-space. shift: distance, in cells, by which the edge lies
    farther out than such sources indicate. excess: excess of the pressures in cells, as a fraction of their
    second differences. See the module's description.
    """

    b1: float
    b2: float
    total: float
    shift: float
    excess: float

    @property
    def far_field(self) -> HalfLine:
        """The same with the shift of a half-space, for the far-field edge (`edges.Outline`)."""
        return self._replace(shift=HALF_SPACE.shift)


def _panels(ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of Gauss-Legendre quadrature, eight in each panel between successive `ends`."""
    x, weights = np.polynomial.legendre.leggauss(8)
    middle, half = 0.5 * (ends[1:] + ends[:-1]), 0.5 * (ends[1:] - ends[:-1])
    return (middle[:, None] + half[:, None] * x).ravel(), (half[:, None] * weights).ravel()


_T, _WEIGHTS = _panels(np.concatenate(([0.0], math.pi * 2.0 ** np.arange(-7, 1))))
_FAR, _FAR_WEIGHTS = _panels(math.pi * 2.0 ** np.arange(_FARTHEST))


def alike(t: np.ndarray, aliases: int = OWN) -> tuple[np.ndarray, np.ndarray]:
    """Waves [n, 2 aliases + 1] that look on cells like those of numbers `t` [n], and their weights in A(t).

    `aliases`: how many to either side; wave numbers are over the cells' length.
    """
    number = np.arange(-aliases, aliases + 1)
    waves = t[:, None] + 2.0 * math.pi * number
    # the terms of the sum alternate in sign: the mean of the last two partial sums is taken
    averaged = np.where(np.abs(number) == aliases, 0.5, 1.0)
    return waves, averaged * np.sinc(waves / (2.0 * math.pi))


_K, _OF_K = alike(_T)
_SEEN = _OF_K / np.abs(_K)
_OF_HALF_SPACE = _SEEN.sum(axis=1)
_SIN = 2.0 * np.sin(0.5 * _T)
_COSINES = np.cos(np.arange(3)[:, None] * _T)
_WAVES = np.concatenate(([_LONG], np.abs(_K).ravel(), _FAR, [math.pi * 2.0**_FARTHEST]))
_OF_CONTACTS = int(np.argmin(np.abs(_T - 0.25)))  # the wave that represents contacts some ten cells wide


def wave_numbers(side: float) -> np.ndarray:
    """Wave numbers [n] (1/mm) at which half-lines of cells of length `side` (mm) need the bodies' responses."""
    return _WAVES / side


def for_pressure(response: np.ndarray) -> HalfLine:
    """The half-line of pressures; `response` [n]: of u_z to pressure (mm/MPa) at the cells' `wave_numbers`."""
    return _half_line(response, 1.0 / _SIN, -0.25)


def for_tractions(response: np.ndarray) -> HalfLine:
    """The half-line of tractions in aligned cells; without layers it is `OF_NO_LAYERS`.

    `response` [n]: of displacements to tractions in their direction (mm/MPa) at the cells' `wave_numbers`.
    """
    return _half_line(response, _OF_HALF_SPACE, 0.0)


def _half_line(response: np.ndarray, point_sources: np.ndarray, shift: float) -> HalfLine:
    """The half-line with the frequency response `response` [n] at the cells' `wave_numbers`.

    B is A divided by `point_sources` [k], the response of the reference at the k nodes `_T`; `shift`: its own shift.
    """
    g = _WAVES * response
    g /= g[0]
    near, far = g[1 : 1 + _K.size].reshape(_K.shape), g[1 + _K.size : -1]
    own = near[:, OWN]
    seen = np.maximum((_SEEN * near).sum(axis=1), _LEAST * own / _T)
    log_b = np.log(seen / point_sources)
    c0, c1, c2 = (float(_WEIGHTS @ (log_b * cosine)) / math.pi for cosine in _COSINES)
    below = float(_WEIGHTS @ (log_b / _SIN**2 - np.log(own) / _T**2))
    beyond = float(_FAR_WEIGHTS @ (np.log(far) / _FAR**2)) + math.log(g[-1]) / (math.pi * 2.0 ** (_FARTHEST - 1))
    at = _OF_CONTACTS
    excess = -0.5 * math.log(seen[at] * _T[at] / own[at]) / float(_T[at]) ** 2
    return HalfLine(c1, c2 + 0.5 * c1 * c1, math.exp(-0.5 * c0), shift - (below - beyond) / math.pi, excess)


HALF_SPACE = for_pressure(1.0 / wave_numbers(1.0))
"""The half-line of pressures on bodies without layers."""

OF_NO_LAYERS = HalfLine(0.0, 0.0, 1.0, 0.0, 0.0)
"""The half-line of tractions on bodies without layers, on which aligned cells are point sources."""
