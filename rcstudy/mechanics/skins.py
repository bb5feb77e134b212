r"""What cells miss of skins thinner than themselves under full coupling: the cusp of the pressure behind stick.

Ahead of the border of the stick zone tractions fall short of mu p by C sqrt(r), r being the distance from it, and the
pressure has a cusp of beta C sqrt(r) (`subcell/cusps.py`). Where bodies respond to waves of number k along x like
c(k)/k per unit of traction, what falls short depends on the scale 1/k. Along x layers are the same everywhere, so that
the integral J of the slopes of tractions and displacements about the border (Rice 1968) is the same on all scales: with
J ~ C^2 c,

    C(k) = mu p0 sqrt(c(1/a)/c(k)) / sqrt(a),

a being the radius of the contact. Under a skin m times as stiff as what it lies on tractions change m^(1/2) times as
steeply within its thickness as they would without it, and the pressure rises by that. All scales together, it rises by

    mu p0 int beta(k) sqrt(c(1/a)/(c(k) k a)) dk/k.

Cells show what comes from waves longer than they are; shorter ones they take for those of the half-space that they see.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

_WAVES = 64  # numbers of waves in that integral
_SHORTEST = 10.0  # the largest of them, over the inverse of the thinnest layer's thickness or of a cell's length


def rise_at_cusp(responses: Callable[[np.ndarray], np.ndarray], side: float, radius: float, thinnest: float) -> float:
    """By how much the pressure rises at a border of stick by waves shorter than cells, over mu p0; 0 on half-spaces.

    `responses`: function of wave numbers [n] (1/mm) that returns the frequency responses (mm/MPa) of u_z to p, u_x to p
    and u_x to q_x, the first three of [.., n]; `side` (mm): of cells along x; `radius` (mm): of the contact;
    `thinnest` (mm): thickness of the thinnest layer.
    """
    waves = np.concatenate(([1.0 / radius], np.geomspace(1.0 / side, _SHORTEST / min(thinnest, side), _WAVES)))
    _, by_pressure, along = responses(waves)[:3]
    compliance, waves = (waves * along)[1:] / (waves[0] * along[0]), waves[1:]
    rises = np.abs(by_pressure / along)[1:] / np.sqrt(compliance * waves * radius)
    of_half_space = rises[0] * np.sqrt(waves[0] / waves)
    return max(float(np.trapezoid(rises - of_half_space, np.log(waves))), 0.0)
