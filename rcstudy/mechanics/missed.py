r"""What cells miss of the responses of layers thinner than themselves, to waves longer than cells.

Pressures constant in cells, with displacements taken at their centres, respond to a wave of number k like

    A(k) = sum C(k_n) sin(k_n dx/2)/(k_n dx/2),   k_n = k + 2 pi n/dx,   n = ..., -1, 0, 1, ...,

not like C(k): all waves k_n look alike on the cells. On half-spaces, and with layers thicker than cells, the two differ
by some (k dx)^2/24, and what that means near edges is known (`half_line.py`). On a soft, nearly incompressible film h
thick on stiff bodies they differ for all waves: the film gives way to long ones as (kh)^2 only, and the shorter ones
among k_n, to which it is compliant, are seen in their place. Contacts are then as large as on films 15 % more
compliant (h = 0.5 to 1 dx), or on stiffer ones. Slip by pressure is lost: it is h^2 dp/dx, and pressures that are
constant in cells have slopes between these only, h/dx of which reaches the centres.

Finer cells help, nothing else does. The numbers here tell of it, for the error bars (`rcstudy/bars`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rcstudy.mechanics.half_line import OWN, alike

_LEAST = 1e-3  # lower limit of A over C, as the logarithm is needed


class Missed(NamedTuple):
    """Misrepresented responses, beyond what cells miss on half-spaces.

    compliance (-): |log(A/C)| for u_z by p at k = 1/radius. slip (-): part missed of u_x by p, the lesser of those at
    k = 3/radius and at 1/dx, times Dundurs' constant at the latter: tractions by it are largest near the edge.
    long_slip, short_slip (-): the parts missed at k = 3/radius and at 1/dx, each times Dundurs' constant there.
    """

    compliance: float = 0.0
    slip: float = 0.0
    long_slip: float = 0.0
    short_slip: float = 0.0


def missed(responses: Callable[[np.ndarray], np.ndarray], side: float, radius: float) -> Missed:
    """What cells of length `side` (mm) miss in a contact of this `radius` (mm).

    `responses`: function of wave numbers [n] (1/mm) that returns the frequency responses (mm/MPa) of u_z to p, u_x to p
    and u_x to q_x, the first three of [.., n].
    """
    t = np.minimum([side / radius, 3.0 * side / radius, 1.0], 1.0)
    waves, seen = alike(t)
    normal, by_pressure, along = responses(np.abs(waves).ravel() / side)[:3].reshape(3, *waves.shape)
    own = by_pressure[:, OWN]
    # A and C over those of half-spaces, 1/k
    lift = (seen @ normal[0])[0] / (seen @ (1.0 / np.abs(waves[0])))[0] / (normal[0, OWN] * t[0])
    slips = (seen * np.sign(waves) * by_pressure).sum(axis=1) / ((seen / waves).sum(axis=1) * t)
    off = np.abs(slips - own)
    parts = off / np.maximum(np.maximum(np.abs(own), off), np.finfo(float).tiny)  # at most 1
    long, short = parts[1:].tolist()
    beta_of_long, beta = np.abs(own / along[:, OWN])[1:].tolist()
    compliance = abs(math.log(max(float(lift), _LEAST)))
    return Missed(compliance, min(long, short) * beta, long * beta_of_long, short * beta)
