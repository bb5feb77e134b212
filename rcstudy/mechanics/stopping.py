"""At which residuals solvers stop, so that the errors of their solutions keep the tolerance.

A solution's error is not its residual. Measured in L2 against the same discrete equations solved to 1e-4 of the
tolerance, pressures are off by 0.8 to 1 times theirs, tractions by up to twice theirs, and besides by two to five times
what the pressure is, as that moves the bound of cells near the edge, where it is steep. Both grow with the number of
cells in contact, tractions about like the root of how many there are along a side.
"""

from __future__ import annotations

_PRESSURE, _TRACTIONS = 0.3, 0.65  # of the tolerance
_FEW = 1500  # cells in contact, up to which these hold
_LEAST = 1e-11  # tolerance of tractions below which rounding is near


def pressure_residual(tolerance: float, attainable: float, cells: int) -> float:
    """Residual at which to stop for a pressure to a relative `tolerance`.

    `attainable`: about what rounding allows; `cells`: how many are in contact, about.
    """
    part = _PRESSURE * min(1.0, _FEW / max(cells, 1)) ** 0.125
    return max(part * tolerance, min(tolerance, attainable))


def traction_residual(tolerance: float, cells: int) -> float:
    """Residual at which to stop for tractions on so many `cells` to a relative `tolerance`."""
    part = _TRACTIONS * min(1.0, _FEW / max(cells, 1)) ** 0.25
    return max(part * tolerance, min(tolerance, _LEAST))
