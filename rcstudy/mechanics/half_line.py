r"""The discrete half-line: what cells make of the edge of a contact, for the bodies at hand.

Near a straight edge only waves across it matter. Bodies yield to them by C(k) = g(k)/k (mm/MPa), g being constant for a
half-space. Cells of length h (k in 1/h from here on), pressed evenly and looked at in their middles, yield by

    A(t) = sum C(k) sin(k/2)/(k/2),   k = t + 2 pi n,   n = ..., -1, 0, 1, ...

Both are split into factors that act to one side only (Wiener and Hopf 1931). With A = |2 sin(t/2)|^-1 B that of B is
B+(z) = 1 + b1 z + b2 z^2 + ..., its logarithm being half the Fourier series of log B. Pressures p_j, j cells behind the
outermost one, that leave the surface plane in the contact are the coefficients of

    (gamma (1 - z)^-3 + alpha (1 - z)^-2 + beta (1 - z)^-1) (1 - z)^(1/2)/B+(z),

continuous ones, whose edge lies xi ahead of the outermost centre, have exp(s xi) (c s^-3 + a s^-2) s^(1/2)/G+(s) for
their Laplace transform, without a third term, as they end like the root of the distance. With z = exp(-s) both are to
be the same far from the edge, s -> 0. There B+/G+ is exp(-d s), which tells by how much cells move the edge,

    shift = d - 1/4 = -1/4 - 1/pi (int_0^pi log B/(4 sin^2(t/2)) dt - int_0^inf log g/k^2 dk),

as A is periodic, so that 1/k^2 becomes its sum over all n. From there on it is algebra. With q = B+ p, pressures tell
gamma = q2 - 3/2 q1 + 3/8 q0 and, in place of alpha, rise = 3/2 gamma + alpha; and then

    xi = shift + e,   gamma/2 e^2 - rise e + q0 = 0   (`kernels/rows.py`).

Nothing is fitted. In a strip edges come out right to 1e-4 of a cell in the mean over where they lie between cells; on
layers that are not resolved, too, as what these do to the edge is in g: a layer h of E1 on E moves it by about
h/pi log(E/E1). Of 260 contacts with films of 0.1 to 100 GPa, 0.006 to 0.3 mm, with stiff skins or without, on 16 to 40
cells against six times as many, areas are 0.5 % off (root of mean square; 0.25 % in the median; by rules fitted to such
contacts, which this replaces, 2.7 and 0.7 %).

Inside the contact a wave of pressure comes out C/A times too large. For long ones that is 1 + t^2/24 on a half-space,
and as little as 1 - 1.4 t^2 on films that keep their volume, thinner than a cell. The load being given, half of it is
left (second moments and largest pressures of Hertz's contacts: 0.018 to 0.021 of second differences): `concentrated`,
by a wave as long as contacts some ten cells wide.

Borders of stick zones are such edges, too, for the room that tractions leave: slip between it and the bound, both of
which go like roots. There the cells of `aligned.py` are point sources on a half-space, so B is what layers make of A.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

_ALIASES = 8  # of a wave, to either side; what is left out is less than 1e-4 of a cell
_LONG = 1e-6  # a wave number (1/h) at which g is that of the substrate
_FARTHEST = 13  # g is constant beyond so many doublings of pi/h
_LEAST = 1e-3  # of what the bodies yield to a wave, that cells yield at least: it has a logarithm


class HalfLine(NamedTuple):
    """b1, b2, total: of the filter B+ that leaves point sources on a half-space, two factors and the sum of all.

    shift: by how many cells the edge lies farther out than such sources show. concentrated: by how much of their second
    differences pressures come out too large. See above.
    """

    b1: float
    b2: float
    total: float
    shift: float
    concentrated: float

    @property
    def from_afar(self) -> HalfLine:
        """The same with edges where they are seen from afar: as far out as a half-space's cells show them."""
        return self._replace(shift=HALF_SPACE.shift)


def _panels(ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of Gauss and Legendre between all `ends`, eight in each panel."""
    x, weights = np.polynomial.legendre.leggauss(8)
    middle, half = 0.5 * (ends[1:] + ends[:-1]), 0.5 * (ends[1:] - ends[:-1])
    return (middle[:, None] + half[:, None] * x).ravel(), (half[:, None] * weights).ravel()


_T, _WEIGHTS = _panels(np.concatenate(([0.0], math.pi * 2.0 ** np.arange(-7, 1))))
_FAR, _FAR_WEIGHTS = _panels(math.pi * 2.0 ** np.arange(_FARTHEST))
_N = np.arange(-_ALIASES, _ALIASES + 1)
_K = _T[:, None] + 2.0 * math.pi * _N
# of the alternating sum the last two partial sums' mean
_AVERAGED = np.where(np.abs(_N) == _ALIASES, 0.5, 1.0)
_SEEN = _AVERAGED * np.sinc(_K / (2.0 * math.pi)) / np.abs(_K)
_OF_HALF_SPACE = _SEEN.sum(axis=1)
_SIN = 2.0 * np.sin(0.5 * _T)
_OF_CONTACTS = int(np.argmin(np.abs(_T - 0.25)))  # a wave as long as they are


def for_pressure(response: Callable[[np.ndarray], np.ndarray], spacing: float) -> HalfLine:
    """The half-line of pressures in cells of length `spacing` (mm).

    `response`: displacement by stress (mm/MPa) at wave numbers [n] (1/mm).
    """
    return _half_line(response, spacing, 1.0 / _SIN, -0.25)


def for_tractions(response: Callable[[np.ndarray], np.ndarray], spacing: float) -> HalfLine:
    """That of what layers do to tractions in aligned cells; `response` as above. Of none it is `OF_NO_LAYERS`."""
    return _half_line(response, spacing, _OF_HALF_SPACE, 0.0)


def _half_line(
    response: Callable[[np.ndarray], np.ndarray], spacing: float, point_sources: np.ndarray, shift: float
) -> HalfLine:
    """The half-line of cells, B being what they yield over what `point_sources` [n] do, with their own `shift`."""
    k = np.concatenate(([_LONG], np.abs(_K).ravel(), _FAR, [math.pi * 2.0**_FARTHEST]))
    g = k * response(k / spacing)
    g /= g[0]
    near, far = g[1 : 1 + _K.size].reshape(_K.shape), g[1 + _K.size : -1]
    own = near[:, _ALIASES]
    seen = np.maximum((_SEEN * near).sum(axis=1), _LEAST * own / _T)
    log_b = np.log(seen / point_sources)
    c0, c1, c2 = (float(_WEIGHTS @ (log_b * np.cos(n * _T))) / math.pi for n in range(3))
    below = float(_WEIGHTS @ (log_b / _SIN**2 - np.log(own) / _T**2))
    beyond = float(_FAR_WEIGHTS @ (np.log(far) / _FAR**2)) + math.log(g[-1]) / (math.pi * 2.0 ** (_FARTHEST - 1))
    at = _OF_CONTACTS
    concentrated = -0.5 * math.log(seen[at] * _T[at] / own[at]) / float(_T[at]) ** 2
    return HalfLine(c1, c2 + 0.5 * c1 * c1, math.exp(-0.5 * c0), shift - (below - beyond) / math.pi, concentrated)


HALF_SPACE = for_pressure(lambda k: 1.0 / k, 1.0)
"""The half-line of pressures on bodies without layers."""

OF_NO_LAYERS = HalfLine(0.0, 0.0, 1.0, 0.0, 0.0)
"""That of tractions on such bodies: aligned cells are point sources."""
