"""Error bars of zones narrower than a cell: of slip behind or ahead of stick, or of stick where all cells slip.

- If no cell slips, a zone narrower than half a cell may slip behind those that stick. There tractions grow towards the
  trailing edge beyond those of the cells (`aligned` corrects for both, `mechanics/subcell/trailing.py`).
- Slip zones at the leading edge that cells do not see are corrected for with `aligned`
  (`mechanics/subcell/unseen.py`), and the corrections are uncertain.
- If all cells slip, a strip at the leading edge may stick unless all of them slip fast.

N is the number of cells per radius of the contact.
"""

from __future__ import annotations

import math

from rcstudy.mechanics.subcell.unseen import Unseen

# Where all cells stick, a zone narrower than half a cell may slip behind them, of `_UNSEEN`/N of the contact's area.
_UNSEEN = 0.3
# Relative error of the area of such zones with `aligned`, and relative errors times N of forces and moment then.
_NARROW_ZONE = 0.14
_STUCK = {"force_x": 0.036, "force_y": 0.036, "moment_z": 0.11}
# Relative error with `aligned` of the largest traction in such zones, and the power of the width with which it falls in
# wider ones (350 solutions of 70 contacts that hardly slip, on 24 to 96 cells).
_AT_BORDER, _NARROWING = 0.105, 3.0
# The same where one coarser mesh says too little of it, in zones one cell wide; it falls as fast from there.
# (Of 1280 largest tractions of random contacts 12 to 24 cells across 94 in 100 were held without it, 96 with it; of
# contacts bred for errors beyond their bars the largest was 10 bars off, now 6.)
_AT_WIDER_BORDER = 0.04
# Where all but a narrow zone slips, error with `aligned` of the slip area over that zone's. It falls with the cube of
# the zone's width above 0.3 cells; in contacts long along x with its square above half a cell. (Of 2249 random contacts
# 96 in 100 slip areas are held either way, the worst is 2.5 instead of 3.4 bars off. Of 85 that were bred for errors
# beyond their bars 13 were more than three bars off, now 6.)
_OF_STICK, _NARROW, _HALF_A_CELL = 0.25, 0.3, 0.5
# Square of the largest traction over the product of that of a cell and the bound one cell from the edge (1 to 1.2).
_AT_MEETING = 1.2
# Where all cells slip, a strip at the leading edge may stick. It is less than 1/N radii wide and so about N^(-1/2)
# radii long: `_STRIP` N^(-3/2) of the contact's area, falling to zero as the least slip of all cells rises to
# `_BEYOND`/N of the largest. That limit is lower for quasi-identical bodies (`_BEYOND_ALIKE`), which have no slip by
# pressure, as this rises steeply towards the edge. As tractions in the strip are below the bound or point elsewhere,
# forces have a bar of `_IN_STRIP` N^(-3/2) of their scale. Set on 650 contacts near full slip, on 16 to 64 cells;
# checked on others (`scripts/error_bars.py`).
_STRIP = 0.22
_BEYOND, _BEYOND_ALIKE = 2.8, 1.0
_IN_STRIP = 0.03
# Errors of the corrections for slip zones at the leading edge over themselves, of the power in these zones over that of
# the doubtful forces, of the slip area over the doubtful area, and of the largest traction over what the doubtful
# forces are per area of the contact.
_OF_CORRECTION, _OF_POWER, _OF_AREA, _OF_TRACTION = 0.9, 0.4, 0.4, 0.5


def unseen_zone(per_radius: float) -> float:
    """Area, over the contact's, of the widest zone that may slip where all cells stick; `per_radius`: N."""
    return _UNSEEN / per_radius


def corrected_zone(slip_area: float) -> float:
    """Error of the area of a zone narrower than a cell, found by `aligned`, in its unit."""
    return _NARROW_ZONE * slip_area


def singular_tractions(per_radius: float) -> dict[str, float]:
    """Relative errors by name with `aligned` where all cells stick: tractions are singular at the trailing edge."""
    return {name: part / per_radius for name, part in _STUCK.items()}


def traction_at_border(width: float) -> float:
    """Relative error of the largest traction with `aligned`, at the border of a slip zone.

    `width`: area of the zone over the contact's, times N.
    """
    narrow = min(1.0, _UNSEEN / width) ** _NARROWING if width > 0.0 else 1.0
    return _AT_BORDER * narrow


def traction_on_two(width: float) -> float:
    """As `traction_at_border` with one coarser mesh, in addition; `width`: along x, in cells, about."""
    return _AT_WIDER_BORDER * min(1.0, 1.0 / width) ** _NARROWING if width > 0.0 else _AT_WIDER_BORDER


def stick_in_slip(sticking: float, per_radius: float, longer: float) -> float:
    """Error with `aligned` of the slip area over the contact's, of which `sticking` sticks in a narrow zone.

    `longer`: 1 - b/a of a contact long along x, 0 of others.
    """
    if (width := sticking * per_radius) <= 0.0:
        return 0.0
    of_long = longer * min(1.0, _HALF_A_CELL / width) ** 2
    return _OF_STICK * sticking * max(of_long, min(1.0, _NARROW / width) ** 3)


def traction_beyond_cells(found: float, width: float, bound: float, per_radius: float) -> float:
    """By how much (MPa) tractions may exceed the largest of a cell, `found`, with `kalker`, in a zone it does not see.

    Tractions in stick grow like K/sqrt(r) towards the edge until they meet the bound, `bound` sqrt(2 r/a), `bound`
    being mu p0. `width`: as in `traction_at_border`; 0 for wider zones.
    """
    if width > _UNSEEN:
        return 0.0
    bound *= math.sqrt(2.0 / per_radius)  # one cell from the edge
    return math.sqrt(_AT_MEETING * found * bound) - found


def strip_that_sticks(least_slip: float, per_radius: float, *, unlike: bool) -> tuple[float, float]:
    """Errors of the slip area over the contact's, and of forces over their scales, where all cells slip.

    `least_slip`: smallest slip of all cells over the largest; `unlike`: whether the bodies slip by pressure.
    """
    left = max(1.0 - least_slip * per_radius / (_BEYOND if unlike else _BEYOND_ALIKE), 0.0)
    part = left * per_radius**-1.5
    return _STRIP * part, _IN_STRIP * part


def leading_zones(slip: Unseen, fastest: float, of_edges: float, contact_area: float) -> dict[str, float]:
    """Errors by name, in their units, of what slip zones at the leading edge hide and of the corrections for them.

    `fastest`: largest rigid slip; `of_edges`: factor on the power, `pressed.of_edges`; `contact_area` (mm^2).
    """
    power = slip.doubtful_force * fastest + slip.doubtful_power
    return {
        "force_x": _OF_CORRECTION * abs(slip.force_x),
        "force_y": _OF_CORRECTION * abs(slip.force_y),
        "moment_z": _OF_CORRECTION * abs(slip.moment_z),
        "friction_power": _OF_POWER * of_edges * power,
        "slip_area": _OF_AREA * slip.doubtful_area,
        "traction_max": _OF_TRACTION * slip.doubtful_force / contact_area,
    }
