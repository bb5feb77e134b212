"""Coverage: factors on whole error bars of `aligned` cells, by the kind of contact.

The parts of a bar were set one after the other, each on the contacts that need it. Together they are wider than 95 in
100 need in some kinds of contacts, where they were more than five times the error in the median. The factors were set
on 4000 contacts: random ones of all kinds of `scripts/error_bars.py`, the paper's cases, round contacts in windows that
fit and contacts around the pole of spin, which have their edges or poles at the same places between cells. At least 95
in 100 of each kind below hold with them. There is no factor where less room was found than a twentieth, where bars were
within five times the error, as between bodies alike, or where contacts that always lie in the same place need all of
the bar. Contacts without a coarser mesh have none, either (`few.py`). Checked on others (results/error_bars.md).
"""

from __future__ import annotations

FEW = {
    "force_y": 0.78,
    "moment_z": 0.66,
    "pressure_max": 0.9,
    "contact_area": 0.84,
    "contact_radius": 0.84,
    "slip_area": 0.82,
    "traction_max": 0.78,
    "friction_power": 0.82,
}
COUPLED = {
    "force_x": 0.8,
    "pressure_max": 0.9,
    "contact_area": 0.92,
    "contact_radius": 0.92,
    "traction_max": 0.92,
    "friction_power": 0.82,
}
SOFT = {"force_x": 0.78, "pressure_max": 0.85, "slip_area": 0.88, "friction_power": 0.56}
UNLIKE = {"friction_power": 0.8}
# Pressures more peaked than Hertz's by these (see `estimate._Case.peaked`) begin to be, and are, those of soft films.
_PEAKED = 0.05, 0.25


def factors(*, few: bool, coupled: bool, peaked: float, unlike: bool) -> dict[str, float]:
    """Factors on the bars of scalars, by their names; 1 for those without.

    `few`: less than twelve cells across the narrower side (`few.py`); `coupled`: full coupling; `peaked`: how much more
    peaked the pressure is than Hertz's; `unlike`: pressure moves the surfaces along each other.
    """
    if few:
        return FEW
    if coupled:
        return COUPLED
    low, high = _PEAKED
    soft, hard = min(max((peaked - low) / (high - low), 0.0), 1.0), UNLIKE if unlike else {}
    return {name: soft * SOFT.get(name, 1.0) + (1.0 - soft) * hard.get(name, 1.0) for name in SOFT | hard}
