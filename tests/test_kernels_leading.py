"""Kernels of slip zones at the leading edge against plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from rcstudy.mechanics.kernels import leading_slip

THETA = 0.748


def sums_over_rows(
    index: np.ndarray,
    front: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    q: np.ndarray,
    slip: np.ndarray,
    pressure: np.ndarray,
    friction: float,
    k: float,
    aspect: float,
    theta: float,
) -> np.ndarray:
    """As `leading_slip.unseen_rows`, all rows at once; these must lie side by side."""
    rows = np.flatnonzero(index[0] >= 0)
    numbers = index[:, rows]
    held = numbers >= 0
    slips = np.logical_and.accumulate(held & slip[numbers], axis=0).sum(axis=0)
    some = slips < held.sum(axis=0)
    first = numbers[np.where(some, slips, 0), np.arange(rows.size)]
    slope = np.gradient(front[rows]) * aspect if rows.size > 1 else np.zeros(1)
    growth = k * np.array([np.ones(rows.size), -slope]) / np.hypot(1.0, slope)
    v = q[first].T / (friction * pressure[first])
    along, room = (v * growth).sum(axis=0) / k**2, np.maximum(1.0 - (v * v).sum(axis=0), 0.0) / k**2
    t = np.minimum(np.sqrt(along**2 + room) - along, 600.0)
    width = (slips + theta) * np.exp(-t)
    past = np.minimum((slips - 1 + theta) / width, 1.0)
    hidden = np.where(some, np.where(slips == 0, width, theta * past**4), 0.0)
    force = abs(k) * friction * np.where(held, pressure[numbers], 0.0).max(axis=0) * hidden
    fx, fy = force * (v + t * growth)
    moment = x[numbers[0]] * fy - y[numbers[0]] * fx
    cells = np.where(some, np.where(slips == 0, width, past**2), 0.0)
    missing = np.where(slips == 0, cells, -cells)
    return np.array([fx.sum(), fy.sum(), force.sum(), moment.sum(), cells.sum(), missing.sum()])


@pytest.mark.parametrize("seed", range(6))
def test_sums_over_rows(seed: int) -> None:
    rng = np.random.default_rng(seed)
    counts = rng.integers(1, 7, 9)
    counts[:2] = counts[-1] = 0  # no contact there
    index = np.full((7, 9), -1)
    cells = 0
    for row in np.flatnonzero(counts):
        index[: counts[row], row] = np.arange(cells, cells + counts[row])
        cells += counts[row]
    pressure, x, y = rng.uniform(1.0, 5.0, (3, cells))
    friction, k = 0.3, rng.choice([-1.0, 1.0]) * rng.uniform(0.02, 0.5)
    angle, part = rng.uniform(0.0, 7.0, cells), rng.uniform(0.2, 1.0, cells)
    slip = rng.random(cells) < 0.4
    part[slip] = 1.0
    q = (friction * part * pressure * np.array([np.cos(angle), np.sin(angle)])).T
    arguments = index, rng.uniform(8.0, 9.0, 9), x, y, q, slip, pressure, friction, k, 1.3, THETA
    found = np.zeros(6)
    leading_slip.unseen_rows(*arguments, found)
    np.testing.assert_allclose(found, sums_over_rows(*arguments), rtol=1e-11)
