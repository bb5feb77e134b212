"""Error bars of what layers thinner than a cell hide from cells.

Areas are corrected for such layers, by the shift of the edge (`mechanics/half_line.py`): their errors are the parts
that may be left. Forces are not corrected. Films much softer than the bodies, and nearly incompressible ones, have a
file of their own (`films.py`), as have stiff skins under full coupling (`pulled.py`).
"""

from __future__ import annotations

import math

from rcstudy.bars.hidden import Hidden

# Errors over their scales per unit of `Hidden.by_layers`. (Of 1138 contacts on soft films between bodies forces along y
# are held in 93 of 100 with 0.1, now 96, slip areas in 95 with 0.18, now 97.)
_BY_LAYERS = {
    "contact_area": 0.37,
    "contact_radius": 0.185,
    "slip_area": 0.24,
    "pressure_max": 0.01,
    "traction_max": 0.4,
    "force_x": 0.26,
    "force_y": 0.13,
    "moment_z": 0.085,
    "friction_power": 0.34,
}
# What is added to these if little slips, and the power of the part that sticks: slip zones are then within a few cells
# of the edge. (Of 180 such contacts with layers thinner than a cell 57 to 84 in 100 slip areas are held without it. Of
# 850 on soft films friction powers are held in 91 of 100 without it, now 93, largest tractions in 90, now 92.)
_WITH_LITTLE_SLIP = {"slip_area": (1.2, 8), "friction_power": (0.7, 4), "traction_max": (1.0, 4)}
_BY_SKINS = 1.8  # factor on that for layers stiffer than what is below, whose `by_layers` is negative
_PEAK, _APPROACH = 0.5, 0.9  # relative errors of the largest pressure and of the approach, over `peak_by_layers`
# What `aligned` misses of forces and slip areas beside the edge where there is stick, and of the force across that in
# x, over the estimates of `skin_at_edge` (800 contacts).
_IN_SKIN, _TURNED = 0.5, 0.06


def by_layers(hidden: Hidden, name: str, slipping: float) -> float:
    """Error of a scalar over its scale by layers that move the edge; `slipping`: part of the contact that slips."""
    part = _BY_LAYERS.get(name, 0.0)
    if name in _WITH_LITTLE_SLIP:
        most, power = _WITH_LITTLE_SLIP[name]
        part += most * (1.0 - slipping) ** power
    return part * max(hidden.by_layers, -_BY_SKINS * hidden.by_layers)


def of_peak(hidden: Hidden) -> float:
    """Relative error of the largest pressure."""
    return _PEAK * hidden.peak_by_layers


def of_approach(hidden: Hidden) -> float:
    """Relative error of the approach."""
    return _APPROACH * hidden.peak_by_layers


def skin_at_edge(hidden: Hidden, friction: float, radius: float, slipping: float) -> tuple[float, float]:
    """What `aligned` misses beside the edge by layers thinner than a cell; `radius`: of the contact (mm).

    Slip by pressure follows their constants there. In a strip as wide as their scale tractions differ by mu p0 times
    the difference of beta/(pi mu) (`mechanics/subcell/unseen.py`), at most by 2 mu p0, if there is stick: the first
    number, the error of force_x and of the slip area over their scales. In slip tractions turn, from the direction of
    force_x to that of force_y: the second number, an error of force_y over force_x. See `power_at_edge`, too.
    """
    difference, width = hidden.skin
    strip = 3.0 / math.pi * width / radius  # mu p0 on it, over mu P
    part = strip * min(difference / (math.pi * friction), 2.0)
    return _IN_SKIN * part * math.sqrt(max(1.0 - slipping, 0.0)), _TURNED * part


def power_at_edge(hidden: Hidden, in_strip: float, fastest: float) -> float:
    """Error of the friction power over the friction force, by the same: the force missed times the largest slip.

    `in_strip`: the first number of `skin_at_edge`; `fastest`: largest rigid slip. Incompressible films have none of it:
    errors on these, which give way otherwise, are large enough without it. (Of 744 contacts between steel or other
    bodies with one or two soft films, 0.02 to 1 cell thick, 89 in 100 powers were held without this and what films miss
    elsewhere, with both 96. With the slip that the largest pressure causes, where the strip is beside the edge, bars on
    160 polymer films between bodies were 14 times the error in the median and 100 times in one of ten, now 8 and 45.)
    """
    return (1.0 - hidden.squeezed) * in_strip * max(hidden.largest_slip, fastest)
