r"""What layers thinner than a few cells do to the edge of a contact, which cells do not see.

Take a straight edge and waves across it, to which the bodies yield as g(k)/k, g being constant for a half-space. Far
from the edge the pressure goes like the root of the distance from where the contact seems to end. With g = G+ G-, each
half of which acts to one side only (Wiener and Hopf 1931), log G+ is for waves longer than 1/c their wave number times

    1/pi int ln(g(k)/g(c))/k^2 dk, k from c to infinity,

and by as much the true edge lies farther out: for a layer h of E1 on E of the order of h/pi ln(E/E1), and more the
longer the waves are that c leaves out (like the logarithm of 1/(c h), as a thin layer yields like a spring). Cells find
the waves that they can carry right, but not shorter ones: the integral begins at a wave number `cut`/dx. The cut is the
higher the more the layers yield to waves of a few cells already (`_SOFT`), and where they do nearly all of the yielding
(`_FILM`) the pressure has no root at the edge, and there is no such shift.

`EDGES`, the cut for edges of contacts, `_SOFT` and `_FILM` were set on areas of 150 contacts with single and double
layers, 0.004 to 1 of their radius thick and 3e-5 to 100 times as stiff as the substrate, at 6 to 70 cells per radius.
Of what these miss, 0.02 to 0.1 of a cell all around, a fifth to a third is left; bodies without layers have none of it.
Borders of stick zones are found too far back in the same way, by the response to tractions (borders of the paper's
contacts and of 140 random ones, row by row).

Layers softer than what is below and half a cell to six cells thick let the pressure go from one law to the other within
the cells that tell the edge, which is found too far out: by 0.011 ln(g(1.5/dx)/g(0.5/dx)) ln(g(1.5/dx)/g(0.05/dx)) of a
cell (1200 contacts on layers 1e-3 to 10 times as stiff; of 0.01 to 0.05 of a cell a third to a half is left). Where g
grows faster than k (thin films that keep their volume) the pressure ends more smoothly than by a root and seems to end
0.4 of a cell too far out (600 contacts on films of 1e-5 to 1e-2 of the modulus; a quarter of that is left).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

EDGES = 1.5
"""The cut for edges of contacts, of bodies without layers (radians a cell)."""

BORDERS = 0.7
"""The cut for borders of stick zones, likewise; set on such borders, see above."""

_SOFT = 0.2  # power of what waves at the cut yield more than long ones
_FILM = 30.0  # times as much
_SOFTENED = 0.011
_SMOOTHLY = 0.4  # cells at most, reached when g grows by this more than k does over the band:
_FASTER = 0.55
_BAND = np.array([0.05, 0.5, 1.5])  # radians a cell
_LONG = 0.05  # radians a cell
_FARTHEST = 0.3  # cells that an edge is moved at most: under plates on few cells the integral tells nothing

# int f(ln(k/cut)) cut/k^2 dk is int f(s) exp(-s) ds; what is beyond e^30 cells is nothing
_LOGS, _WEIGHTS = np.polynomial.laguerre.laggauss(16)
_OVER = np.exp(np.minimum(np.concatenate(([0.0], _LOGS)), 30.0))


def shift_by_layers(response: Callable[[np.ndarray], np.ndarray], spacing: float, cut: float = EDGES) -> float:
    """By how many cells of length `spacing` (mm) the edge lies farther out than cells find it.

    `response`: displacement by stress (mm/MPa) at wave numbers [n] (1/mm); `cut`: see above, of bodies without layers.
    """

    def g(over_spacing: np.ndarray) -> np.ndarray:
        k = over_spacing / spacing
        return k * response(k)

    long, short = g(np.array([_LONG, cut]))
    more = max(1.0, float(short / long))
    cut *= more**_SOFT
    yielding = g(cut * _OVER)
    shift = float(_WEIGHTS @ np.log(yielding[1:] / yielding[0])) / (math.pi * cut)
    return min(max(shift * min(1.0, _FILM / more) ** 2, -_FARTHEST), _FARTHEST)


def shift_under_soft_layers(response: Callable[[np.ndarray], np.ndarray], spacing: float) -> float:
    """By how many cells of length `spacing` (mm) edges are found too far out on soft layers; `response` as above."""
    k = _BAND / spacing
    of_all, of_few, short = np.log(k * response(k))
    over_few = float(max(short - of_few, 0.0))
    faster = min(max(over_few - math.log(_BAND[2] / _BAND[1]), 0.0) / _FASTER, 1.0)
    return _SOFTENED * over_few * float(max(short - of_all, 0.0)) + _SMOOTHLY * faster
