r"""Slip by pressure beside a leading edge: how much cells exaggerate it, for given bodies (Wiener and Hopf 1931).

Pressure moves the surfaces of unlike or layered bodies along each other. Tractions answer to this slip f(x), x being
the distance behind a straight leading edge in cells. Where all sticks, they go like A x^(-1/2) far behind the edge, and

    A = int_0^inf f(x) w(x) dx    without cells,    A = sum_j f_j w_j    with cells,

w being the tractions' response: x^(-1/2) and, counted from the leading cell, Gamma(j + 1/2)/Gamma(j + 1) on a
half-space. Between half-spaces f is proportional to the pressure, a root at the edge, for which the discrete weights
are too large: the sum exceeds the integral by what 0.0264 of f does in the leading cell alone (`OF_HALF_SPACE`). A soft
layer bulges at the edge; f is largest within a distance as short as the layer is thin, of either sign, and where that
is a fraction of a cell the sum may be off by more than the integral. `exaggeration` gives for any layers

    part = (sum_j f_j w_j - int f w dx)/(w_0 p_0),

which `aligned.py` subtracts from the leading cell's slip per unit of its pressure p_0, so that sum and integral agree.
What the quadrature misses of it on a half-space is added, s being taken at k = 1: a layer that is none changes nothing.

Waves across the edge have the responses g(k)/k of u_z to pressure, t(k)/k of u_x to tractions and s(k)/k of u_x to
pressure (`layered.py`: a, c and b). With G+ and T+ the factors of g = |G+(i k)|^2 and t = |T+(i k)|^2 that act to one
side only, pressure and weights without cells have the Laplace transforms

    p = z^(-3/2)/G+(z),    w = z^(-1/2)/T+(z),    f = s p,    int f w dx = 1/pi Re int_0^inf f(i k) w(-i k) dk.

On the cells of `moved_rows.py` pressures are means over cells, the first of which lies `half_line.EDGE` behind the
far-field edge and carries what is ahead of it. Slips are differences of displacements half a cell ahead of them, so
that all waves k_n = k + 2 pi n that look alike add up: with sinc = sin(k_n/2)/(k_n/2) and `convolution.point_factor`

    t_d = point_factor sum_n (-1)^n sgn(k_n) t(k_n) sinc^2,    s_d = point_factor sum_n (-1)^n s(k_n) sinc^2,

and with z = e^(-i k) the weights are (1 - z)^(-1/2)/T_d+(z). The phase of a factor on the imaginary axis is

    phase(k) = 1/(2 pi) PV int log t(k')/sinh(v' - v) dv',    v = log k,

by the trapezoidal rule at odd distances, which leaves the pole out. That of a periodic response is the same integral
over y = 2 tan(k/2), as (1 - z)/(1 + z) maps the circle onto the half-plane.

To waves longer than a cell the weights with cells are those without, but for a shift of the edge, where the layers
move that of tractions by another distance than that of pressures. It misplaces slip of any kind, also that by creepage,
and is left alone (docs/mechanics.md): here the weights with cells are shifted back for such waves (`_SHIFTED`). With
the shift `part` is that of strips of cells (`tests/test_edge_slip.py`).
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from rcstudy.mechanics.convolution import sharpening
from rcstudy.mechanics.half_line import EDGE, alike

OF_HALF_SPACE = 0.0264
"""The part between half-spaces, over the slip per unit pressure on the spot.

As found over 200 cells (`tests/test_aligned.py`); the limit of ever more is 0.02625.
"""

_STEP = 0.25  # of log k; a quarter of it and more aliases change parts by 0.0026 of the largest s at most (300 stacks)
_SHORTEST, _LAST = 3e-3, 2e3  # range of k and y (1/cell); responses are constant beyond
_MIDDLE, _HALF = 1.15, 4.15  # range of log y, about its middle, in which waves that look alike are added up
_ALIASES = 4  # of them, to either side
_SHIFTED = 1.0  # k (1/cell) below which the weights of waves are shifted back
_AT = 0.1  # k (1/cell) at which the shift is found
_LEAST = 1e-3  # least t_d over t, as its logarithm is needed

_N = 2 * math.ceil(0.5 * math.log(_LAST / _SHORTEST) / _STEP)
_V = math.log(_SHORTEST) + _STEP * np.arange(_N)
_K = np.exp(_V)
_ROOT = (1j * _K) ** -0.5  # transforms of pressure and weights behind the edge of a half-space: their powers
_ROOT_3 = _ROOT**3
_LONG = int(np.argmin(np.abs(_K - _AT)))
_AS_CELLS = int(np.argmin(np.abs(_V)))  # a wave of number 1 (1/cell)

# on the circle, at y = _K
_ON_CIRCLE = 2.0 * np.arctan(0.5 * _K)  # wave numbers k
_Z = np.exp(-1j * _ON_CIRCLE)
_OF_POINTS = (1.0 - _Z) ** -0.5
_HALF_A_CELL = np.sqrt(_Z)
_TWO_DIFFERENCES = (1.0 - _Z) ** 2
_FROM_AHEAD = 1.0 - 1.0 / _Z
_WITHIN = np.flatnonzero(np.abs(_V - _MIDDLE) < _HALF)
_LAST_WITHIN = int(_WITHIN[-1])

# weights of integrals over k
_OF_K, _OF_CIRCLE = _STEP * _K, _STEP * _K / (1.0 + 0.25 * _K**2)
_AT_ZERO = 2.0 / math.pi * _OF_K / (_K**2 + 4.0)  # makes of a logarithm that of its factor at z = 0

# waves that look alike on the cells
_ALIKE, _SEEN = alike(_ON_CIRCLE[_WITHIN], _ALIASES)
_LOG_ALIKE, _SIGN = np.log(np.abs(_ALIKE)), np.sign(_ALIKE)
_HALF_AHEAD = np.where(np.arange(-_ALIASES, _ALIASES + 1) % 2 == 0, 1.0, -1.0)
_SLIPS = sharpening(_ON_CIRCLE[_WITHIN, None]) * _HALF_AHEAD * (_SEEN * np.sinc(_ALIKE / (2.0 * math.pi)))
_TRACTIONS = _SLIPS * _SIGN
_MEANS = (1j * _ALIKE) ** -1.5 * _SEEN
_LONG_MEANS = np.sinc(_K / (2.0 * math.pi))
_WAVES = np.concatenate((_K, np.abs(_ALIKE).ravel()))


def wave_numbers(side: float) -> np.ndarray:
    """Wave numbers [n] (1/mm) at which cells of length `side` (mm) need the bodies' responses."""
    return _WAVES / side


def exaggeration(responses: np.ndarray, side: float, shift: float) -> float:
    """Slip (1/MPa) to be subtracted in leading cells, per unit of their pressure: `part` of the module's description.

    `responses` [3, n] (mm/MPa): of u_z to pressure, u_x to pressure and u_x to tractions, both bodies together, at the
    `wave_numbers` of cells of length `side` (mm); `shift`: distance of the far-field edge behind the actual one
    (cells). The leading cell's centre lies `half_line.EDGE` behind the former.
    """
    response = _WAVES / side * responses
    missed = OF_HALF_SPACE - _of_half_space()
    return _part(response, shift) + missed * float(response[1, _AS_CELLS])


@cache
def _of_half_space() -> float:
    """`OF_HALF_SPACE` by the quadrature used here, which misses some of it; cells are as in `exaggeration`."""
    return _part(np.ones((3, _WAVES.size)), 0.0)


def _part(response: np.ndarray, shift: float) -> float:
    """`exaggeration`, from the responses [3, n] (1/MPa) to waves of `_WAVES`, times their wave numbers."""
    (g, s, t), alike = response[:, :_N], response[:, _N:].reshape(3, *_ALIKE.shape)
    phase = _PHASE @ np.log(g)
    pressure = _ROOT_3 * np.exp(-1j * phase) * np.sqrt(g[0] / g)
    weights = _ROOT * _one_sided(t)
    without_cells = (s * pressure * weights.conj()).real @ _OF_K

    means, first = _means_over_cells(pressure, phase, alike[0] / g[0], EDGE + shift)
    s = _on_cells(s, (_SLIPS * alike[1]).sum(axis=1))
    t = np.maximum(_on_cells(t, (_TRACTIONS * alike[2]).sum(axis=1)), _LEAST * t)
    first_weight = math.exp(-float(_AT_ZERO @ np.log(t / t[0]))) / math.sqrt(t[0])
    weights = _shifted_back(_OF_POINTS * _one_sided(t), weights, EDGE + shift - 0.5)
    with_cells = (s * _HALF_A_CELL * means * weights.conj()).real @ _OF_CIRCLE
    return float((with_cells - without_cells) / (math.pi * first_weight * first))


def _means_over_cells(
    pressure: np.ndarray, phase: np.ndarray, alike: np.ndarray, place: float
) -> tuple[np.ndarray, float]:
    """Transform [_N] of the means over cells of a pressure that begins `place` cells ahead of the first one's centre.

    Also the mean over the first cell, which carries what is ahead of it. `pressure` [_N]: the transform without cells;
    `phase` [_N]: that of G+; `alike`: g at the waves `_ALIKE` over g[0].
    """
    phases = np.interp(_LOG_ALIKE, _V, phase) * _SIGN
    waves = _MEANS * np.exp(1j * (place * _ALIKE - phases)) / np.sqrt(alike)
    means = _on_cells(pressure * np.exp(1j * place * _K) * _LONG_MEANS, waves.sum(axis=1))
    # coefficients of z^-1 and z^0: (1 - z)^2 makes the integrals converge and adds -2 times the first to the second
    differences = _TWO_DIFFERENCES * means
    ahead = float((differences * _Z).real @ _OF_CIRCLE) / math.pi
    first = float(differences.real @ _OF_CIRCLE) / math.pi + 2.0 * ahead
    return means + ahead * _FROM_AHEAD, first + ahead


def _one_sided(t: np.ndarray) -> np.ndarray:
    """1/T+ [_N] on the imaginary axis, or on the circle: the factor of the response `t` [_N]."""
    return np.exp(-1j * (_PHASE @ np.log(t))) / np.sqrt(t)


def _shifted_back(weights: np.ndarray, without_cells: np.ndarray, place: float) -> np.ndarray:
    """`weights` [_N] of slips from `place` cells behind the edge on, less the shift against those `without_cells`."""
    phase = np.angle(weights[_LONG] * np.exp(-1j * place * _ON_CIRCLE[_LONG]) / without_cells[_LONG])
    shifted: np.ndarray = weights * np.exp(-1j * phase / _K[_LONG] * _ON_CIRCLE / (1.0 + (_ON_CIRCLE / _SHIFTED) ** 2))
    return shifted


def _on_cells(without_cells: np.ndarray, within: np.ndarray) -> np.ndarray:
    """Values [_N] on cells: those `within` the range of `_WITHIN`, before it those of long waves, then the last."""
    out = without_cells.astype(within.dtype)
    out[_WITHIN] = within
    out[_LAST_WITHIN:] = within[-1]
    return out


def _phases() -> np.ndarray:
    """Matrix [_N, _N] that makes of a logarithm at `_K`, constant beyond, the phase of its factor there."""
    distance = _V - _V[:, None]
    odd = (np.arange(_N) - np.arange(_N)[:, None]) % 2 != 0
    out = np.zeros((_N, _N))
    out[odd] = _STEP / (math.pi * np.sinh(distance[odd]))
    # beyond the ends int dv'/sinh(v' - v) is known; the rule reaches one step beyond its outermost nodes
    even = np.arange(_N) % 2 == 0
    below, above = _V - (_V[0] - _STEP * ~even), _V[-1] + _STEP * even - _V
    below, above = np.maximum(below, _STEP), np.maximum(above, _STEP)
    out[:, 0] += np.log(np.tanh(0.5 * below)) / (2.0 * math.pi)
    out[:, -1] -= np.log(np.tanh(0.5 * above)) / (2.0 * math.pi)
    out[np.diag_indices(_N)] -= out.sum(axis=1)  # a constant has no phase
    return out


_PHASE = _phases()
