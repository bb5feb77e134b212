"""At which residuals solvers stop, so that the errors of their solutions keep the tolerance.

A solution's error is not its residual. Measured in L2 against the same discrete equations solved to 1e-4 of the
tolerance, pressures are off by 0.8 to 1 times theirs, tractions by up to twice theirs, and besides by two to five times
what the pressure is, as that moves the bound of cells near the edge, where it is steep.
"""

from __future__ import annotations

_PRESSURE, _TRACTIONS = 0.3, 0.65  # of the tolerance
_LEAST = 1e-11  # tolerance of tractions below which rounding is near


def pressure_residual(tolerance: float, attainable: float) -> float:
    """Residual at which to stop for a pressure to a relative `tolerance`; `attainable`: about what rounding allows."""
    return max(_PRESSURE * tolerance, min(tolerance, attainable))


def traction_residual(tolerance: float) -> float:
    """Residual at which to stop for tractions to a relative `tolerance`."""
    return max(_TRACTIONS * tolerance, min(tolerance, _LEAST))
