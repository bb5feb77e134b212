"""Error bars under full coupling where friction pulls at the pressure much: errors at edges, and of peaks.

`pull` is the friction coefficient times Dundurs' constant beta, its magnitude (`hidden.py`). Where all slips, pressures
p and tractions mu p tilt the surface like the principal value of the integral of p(s)/(x - s) and pi pull p(x)
(Johnson 1985, Eqs 2.25). At an edge p therefore goes like a power of the distance to it, which is

    1/2 + arctan(pull)/pi   on one side of the contact,   1/2 - arctan(pull)/pi   on the other.

Rows of `aligned` end like a root on both, and with tractions that are constant in cells. Its errors under strong pull
are therefore of first order in 1/N, N being the number of cells a radius. Those of `kalker` are so anyway.

Constants were set on 316 round and elliptic contacts under rigid bodies, a third of them layered, half of them in full
slip, pull 0.3 to 2, on 24 to 64 cells along the window; limits were extrapolated from `aligned` on 160 and 320 cells.
Of 342 others, pull 0.16 to 1.6 and 24 to 72 cells, bars were held in 73 of 100 areas with `aligned` (50 above a pull of
1), 82 approaches (44), 84 largest pressures and 81 powers where some cells stick. It is 94, 98, 95 and 94 now; with
`kalker`, which lacks a part of the peaks only, 95 to 100.
"""

from __future__ import annotations

import math

# Errors with `aligned` over their scales per unit of pull, at most `_WEAK`, times N^(3/2): tractions constant in cells
# lift the surfaces otherwise at the edges than those that end like a root, contacts are 0.02 to 0.06 N^(-3/2) too
# small. (720 contacts under rigid bodies, friction 0.3 to 2, 18 to 40 cells: contact areas held in 82 of 100 without,
# the others in 88 to 92; 93, and 91 to 95 with it.)
_BY_WEAK = {"contact_area": 0.09, "contact_radius": 0.045, "slip_area": 0.12, "force_x": 0.02}
_WEAK = 0.5
# More of that of contact areas where hardly any cell slips, as tractions then are largest at the edge (150 contacts:
# held in 84 of 100 without).
_MORE_IN_STICK = 5.0
# The same per pull, and per pull up to 1, with the power of N that they fall with.
_BY_STRONG = {
    "contact_area": (0.045, 1.0),
    "contact_radius": (0.0225, 1.0),
    "slip_area": (0.06, 1.0),
    "approach": (0.035, 1.5),
    "pressure_max": (0.35, 2.0),
    "moment_z": (0.005, 1.0),
}
# The same per pull up to 1, times N, and times the root of the part that sticks: what slips everywhere has forces and
# power that follow from the load.
_OF_STICK = {"friction_power": 0.04, "force_x": 0.03}
# What bars with `kalker` are short of per pull up to 1, and those of all peaks per pull beyond `_STRONG` (up to 1),
# where some cells stick.
_OF_KALKER = {"pressure_max": 0.6, "approach": 0.6}
_OF_PEAKS, _STRONG = 0.6, 0.7
# Least relative errors with `kalker` of largest pressures within two cells of the border of the stick zone, and of the
# largest traction then, per pull and times the root of N: both rise from the border like a root of the distance, and
# coarser meshes may agree by chance. (Set on 154 contacts of unlike bodies. 95 in 100 of both are held of 127 others,
# at most 3.1 bars off, without it 89 pressures and 94 tractions, up to 14 bars off.)
_BESIDE_CUSP = {"pressure_max": 0.12, "traction_max": 0.4}

# Errors with `aligned` over their scales per `Hidden.pull_under_skin`, in quadrature, times N^(3/2): stiff skins turn
# errors of the lift by tractions, near borders that lie between cells, into pressure anywhere. That of the largest
# pressure counts in full where more than `_STICKING` of the contact sticks. (Set on 349 contacts on skins of 120 to 300
# GPa, 0.1 to 0.35 radii thick, on layers of 1.5 to 20 GPa, 20 to 59 cells along the window: 82 in 100 largest pressures
# are held without it, 71 where some stick, up to 22 bars off; of 881 others 99 with it. Forces across and moments, of
# 984: 91 to 96 and 86 to 94 without, 95 to 98 and 94 to 98 with it.)
_UNDER_SKINS, _STICKING = {"pressure_max": 0.3, "force_y": 0.12, "moment_z": 0.16}, 0.1


def at_edges(pull: float, per_radius: float, slipping: float) -> dict[str, float]:
    """Errors of scalars with `aligned`, over their scales, by what tractions do to the pressure at the edges.

    `per_radius`: N; `slipping`: part of the contact that slips, 0 to 1.
    """
    weak, strong = min(pull, _WEAK) * per_radius**-1.5, pull * min(pull, 1.0)
    sticks = max(1.0 - slipping, 0.0)
    errors = {name: part * weak for name, part in _BY_WEAK.items()}
    for name in ("contact_area", "contact_radius"):
        errors[name] *= 1.0 + _MORE_IN_STICK * sticks**4
    for name, (part, order) in _BY_STRONG.items():
        errors[name] = errors.get(name, 0.0) + part * strong * per_radius**-order
    for name, part in _OF_STICK.items():
        errors[name] = errors.get(name, 0.0) + part * min(pull, 1.0) * math.sqrt(sticks) / per_radius
    return errors


def under_skins(name: str, pull_under_skin: float, per_radius: float, slipping: float) -> float:
    """Error of a scalar with `aligned` on stiff skins, over its scale; arguments as in `at_edges`."""
    sticks = min(1.0, (1.0 - slipping) / _STICKING) if name == "pressure_max" else 1.0
    return _UNDER_SKINS.get(name, 0.0) * sticks * pull_under_skin * per_radius**-1.5


def of_peaks(pull: float, *, aligned: bool) -> dict[str, float]:
    """Factors on bars of contacts that stick in part: pressures and tractions peak behind the stick zone."""
    factor = 1.0 + _OF_PEAKS * min(max(pull - _STRONG, 0.0), 1.0)
    factors = {"pressure_max": factor, "traction_max": factor}
    if not aligned:
        factors |= {name: 1.0 + part * min(pull, 1.0) for name, part in _OF_KALKER.items()}
    return factors


def beside_cusp(pull: float, per_radius: float) -> dict[str, float]:
    """Least relative errors with `kalker` where the pressure is largest beside the border of the stick zone.

    `per_radius`: N.
    """
    return {name: part * pull / math.sqrt(per_radius) for name, part in _BESIDE_CUSP.items()}
