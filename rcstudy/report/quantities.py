"""Numbers of a case that the panels of an overview can show: what their axes say, values and error bars."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from rcstudy.errors import UserError
from rcstudy.report import measures
from rcstudy.report.views import CaseView, GridView
from rcstudy.studyfile.yamltree import suggest

QUANTITIES = {
    "contact_radius": "contact radius (mm)",
    "pressure_max": "peak pressure (MPa)",
    "slip_area": "slip area / contact area",
    "force_x": "$F_x$ (N)",
    "force_y": "$F_y$ (N)",
    "moment_z": "$M_z$ (N mm)",
}
"""What an overview shows unless it is told otherwise, by the stored variable it needs."""

OVER_LOAD = "/load"
"""Ending of the names of forces over the load."""

CHOICES = QUANTITIES | {
    "force_x/load": "$F_x$ / load",
    "force_y/load": "$F_y$ / load",
    "friction_power": "friction power / speed (N)",
    "traction_max": "peak traction (MPa)",
    "approach": "approach (mm)",
    "contact_area": "contact area (mm$^2$)",
}
"""What an overview can show."""

ZERO = 1e-6
"""Share of its natural scale below which a force or moment counts as zero; where it is in all cases it has no panel.

Where symmetry makes a number zero, rounding and the solver's tolerance (1e-7 unless the study says otherwise) leave
less than this; creepages whose forces are as small do not occur.
"""


def chosen(words: str) -> tuple[str, ...]:
    """The quantities named in `words`, separated by commas; UserError for others."""
    names = tuple(dict.fromkeys(word.strip() for word in words.split(",")))
    for name in names:
        if name not in CHOICES:
            problem = f"{name}: no such quantity" if name else "must not be empty"
            raise UserError(f"--quantities: {problem}: {suggest(name, CHOICES)}")
    return names


def variable(name: str) -> str:
    """The stored variable that a quantity needs."""
    return name.removesuffix(OVER_LOAD)


def has_bars(grid: GridView, name: str) -> bool:
    """Whether the grid stores error bars for a quantity."""
    return f"{variable(name)}_error" in grid


def numbers(cases: Sequence[CaseView], name: str) -> tuple[np.ndarray, np.ndarray]:
    """The numbers that a panel shows and how far their error bars reach below and above, [2, cases]."""
    if name == "slip_area":
        values = np.array([measures.slip_ratio(case) for case in cases])
        errors = np.nan_to_num([measures.slip_ratio_error(case) for case in cases])
        # a share is neither below 0 nor above 1, whatever its error
        return values, np.clip([np.fmin(errors, values), np.fmin(errors, 1.0 - values)], 0.0, None)
    unit = np.array([case.stored("load") if name.endswith(OVER_LOAD) else 1.0 for case in cases])
    values, errors = (
        np.array([case.number(stored) for case in cases]) / unit
        for stored in (variable(name), f"{variable(name)}_error")
    )
    errors = np.nan_to_num(errors)
    return values, np.stack([errors, errors])


def vanishes(cases: Iterable[CaseView], name: str) -> bool:
    """Whether a quantity is a force or moment that vanishes in every solved case, up to rounding, by symmetry.

    False if no case is solved.
    """
    needed = variable(name)
    if needed not in ("force_x", "force_y", "moment_z"):
        return False
    ratios = []
    for case in cases:
        natural = case.stored("friction") * case.stored("load")
        if needed == "moment_z":
            natural *= case.number("contact_radius")
        ratios.append(abs(case.number(needed)) / natural)
    known = [ratio for ratio in ratios if np.isfinite(ratio)]
    return bool(known) and max(known) < ZERO
