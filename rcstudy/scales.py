"""Scales of numbers that are compared, by case: the sizes beside which a difference counts (`compare.py`)."""

from __future__ import annotations

import numpy as np
import xarray as xr


def natural_scales(grid: xr.Dataset, dims: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Natural size of each quantity, from the settings (mu load for forces): {variable: array of the cases' shape}."""
    mu, load, a, p0 = (_by_case(grid, dims, n) for n in ("friction", "load", "hertz_radius", "hertz_pressure"))
    slide = np.maximum(_creepage(grid, dims), _over(np.abs(_by_case(grid, dims, "approach")), a))
    return {
        "pressure": p0,
        "pressure_max": p0,
        "traction_x": mu * p0,
        "traction_y": mu * p0,
        "traction_max": mu * p0,
        "slip_x": slide,
        "slip_y": slide,
        "force_x": mu * load,
        "force_y": mu * load,
        "moment_z": mu * load * a,
        "friction_power": mu * load * slide,
        "contact_area": np.pi * a**2,
        "slip_area": np.pi * a**2,
    }


def shared_scales(grid: xr.Dataset, dims: tuple[str, ...], natural: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Scales shared by related quantities, any of which may vanish; shaped as `natural_scales`, 0 for all others.

    Forces and moment: the largest of |Fx|, |Fy| and |Mz|/a; slip area: the contact area; friction power: that force
    times the creepage.
    """
    x, y, moment, contact = (
        np.abs(_by_case(grid, dims, n)) for n in ("force_x", "force_y", "moment_z", "contact_area")
    )
    a = _by_case(grid, dims, "hertz_radius")
    force = np.maximum(np.maximum(x, y), _over(moment, a))
    kinds = {"force_x": force, "force_y": force, "moment_z": force * a}
    kinds |= {"slip_area": contact, "friction_power": force * _creepage(grid, dims)}
    return {name: kinds.get(name, np.zeros_like(a)) for name in natural}


def _over(values: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """`values` over the radius, of the same shape; 0 where it is not known."""
    return np.divide(values, radius, out=np.zeros_like(radius), where=radius > 0.0)


def _creepage(grid: xr.Dataset, dims: tuple[str, ...]) -> np.ndarray:
    """Size of the creepage of each case, spin at Hertz's radius."""
    along, across, spin, a = (_by_case(grid, dims, n) for n in ("longitudinal", "lateral", "spin", "hertz_radius"))
    size: np.ndarray = np.sqrt(along**2 + across**2 + (spin * a) ** 2)
    return size


def _by_case(grid: xr.Dataset, dims: tuple[str, ...], name: str) -> np.ndarray:
    """Variable `name` as an array of the cases' shape; 0 where it has no finite value."""
    shape = tuple(grid.sizes[d] for d in dims)
    if name not in grid or not set(grid[name].dims) <= set(dims):
        return np.zeros(shape)
    values = grid[name].variable.set_dims(dict(zip(dims, shape, strict=True))).values
    return np.nan_to_num(values.astype(float), posinf=0.0, neginf=0.0)
