"""Residuals at which the solvers stop, so that the errors of their solutions keep the tolerance.

The error of a solution differs from its residual. Errors were measured in L2 against the same discrete equations solved
to 1e-4 of the tolerance. That of the pressure is 0.8 to 1 times its residual, that of the tractions up to twice theirs,
plus two to five times the error of the pressure, which changes the bound of cells near the edge, where it is steep.
These ratios grow with the number of cells in contact, for tractions about like the root of the number along a side.

Where tractions are small beside their bounds, what the pressure's error changes is large beside them: they need a
pressure of a lower tolerance (`pressure_tolerance`).
"""

from __future__ import annotations

import math

from rcstudy.mechanics.scene import Tolerance

_PRESSURE, _TRACTIONS = 0.3, 0.65  # residuals over the tolerance
_FEW = 1500  # number of cells in contact up to which these hold
_SMALL = 3.0  # bounds over tractions up to which the pressure's own tolerance is enough
_LEAST = 1e-11  # residual of tractions close to what rounding allows; smaller ones for smaller tolerances only


def pressure_residual(tolerance: float, attainable: float, cells: int) -> float:
    """Residual at which to stop for a pressure to a relative `tolerance`.

    `attainable`: residual that rounding allows, about; `cells`: number of cells in contact, about.
    """
    part = _PRESSURE * min(1.0, _FEW / max(cells, 1)) ** 0.125
    return max(part * tolerance, min(tolerance, attainable))


def pressure_tolerance(tolerance: Tolerance, bounds_over_tractions: float) -> float:
    """Tolerance of the pressure under which tractions keep the larger one of the two in `tolerance`.

    `bounds_over_tractions`: ratio of their L2 norms. The pressure's own tolerance is divided by a power of two, so that
    many tractions share one pressure.
    """
    part = tolerance.normal / max(tolerance.normal, tolerance.tangential) * bounds_over_tractions / _SMALL
    # numbers that are none need no sharper pressure: their proof fails
    return tolerance.normal * 0.5 ** math.ceil(math.log2(part)) if 1.0 < part < math.inf else tolerance.normal


def traction_residual(tolerance: float, cells: int) -> float:
    """Residual at which to stop for tractions on `cells` cells in contact to a relative `tolerance`."""
    part = _TRACTIONS * min(1.0, _FEW / max(cells, 1)) ** 0.25
    return max(part * tolerance, min(tolerance, _LEAST))
