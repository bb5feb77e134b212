"""The part of the local slip by pressure that a strip's leading cell needs, against which `local_slip.py` was set."""

from __future__ import annotations

import math
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rcstudy.mechanics.edge_slip import OF_HALF_SPACE
from rcstudy.mechanics.kernels import centring
from rcstudy.mechanics.subcell import local_slip
from rcstudy.mechanics.subcell.moved_rows import EDGE

LENGTH = 40.0  # of the strip, in cells
OF_THEORY = 0.57  # largest part that counts in strips


def pressure(r: np.ndarray) -> np.ndarray:
    """A root at the leading edge, and so smooth at the trailing one that nothing is to be corrected there."""
    return np.asarray(np.sqrt(r) * np.maximum(1.0 - r / LENGTH, 0.0) ** 1.5)


def means(cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Means [cells] of the pressure over the cells, and those weighted with the pressure."""
    edges = np.append(0.0, np.arange(1, cells + 1) + EDGE - 0.5) * LENGTH / cells
    nodes, weights = np.polynomial.legendre.leggauss(16)
    a, b = np.sqrt(edges[:-1, None]), np.sqrt(edges[1:, None])  # smooth in the root of r
    t = 0.5 * (b - a) * nodes + 0.5 * (a + b)
    p, weights = pressure(t * t), (b - a) * weights * t
    force = (weights * p).sum(axis=1)
    return force * cells / LENGTH, (weights * p * p).sum(axis=1) / np.maximum(force, 1e-300)


def force_across(cells: int, slip: float, part: float) -> float:
    """Force of the tractions across the slip, mu, C and kappa being 1; `part` of the first cell's local slip counts.

    The rows of `aligned.py` for small turns: across the slip, that at the cells' centres is -slip q/(mu p).
    """
    p, weighted = means(cells)
    m = np.arange(cells)
    out, edges = np.zeros((5, cells)), np.array([[1.0], [0.0]])
    centring.local_slip(p, m[:, None], np.array([cells]), edges, edges, 1.0, OF_HALF_SPACE, out)
    by_tractions = -1.0 / (math.pi * (m[:, None] - m - 0.5))
    ahead, behind = np.maximum(m - 1, 0), np.minimum(m + 1, cells - 1)
    weight, slips = np.empty((3, cells)), np.ones((cells, 2))
    centring.centre(slips, slips[:, 0] > 0.0, np.array([ahead, behind]), np.zeros((5, 0)), weight, slips.copy())
    to_centres = np.diag(1.0 - weight.sum(axis=0))
    for of_neighbour, neighbour in zip(weight, (ahead, behind, ahead[ahead]), strict=True):
        to_centres[m, neighbour] += of_neighbour
    local = to_centres @ out[2]
    local[0] += part * (weighted[0] - local[0])
    law = np.diag(slip / np.maximum(p, 1e-12))
    return float(np.linalg.solve(to_centres @ by_tractions + law, -local).sum()) * LENGTH / cells


def row_of_three() -> Any:
    """A row of moved cells, with edges at an angle."""
    return SimpleNamespace(
        index=np.arange(3)[:, None],
        count=np.array([3]),
        pressure=np.array([2.0, 5.0, 3.0]),
        weighted=np.array([2.5, 5.5, 3.5]),
        neighbours=np.array([[0, 0, 1], [1, 2, 2]]),
        normals=np.array([[0.8], [0.6]]),
        trailing_normals=np.array([[0.6], [-0.8]]),
    )


UNLIKE: Any = SimpleNamespace(slip_under_pressure=-2e-6, slip_under_tractions=(5e-6, 7e-6))


def test_what_is_known_of_the_local_slip() -> None:
    """A part of it counts, in outermost cells, along their edges' normals, unless tractions across edges cancel it."""
    rows = row_of_three()
    found, at_edge = (local_slip.local_slip(rows, UNLIKE, 0.3, leading) for leading in (0.0, 0.1))
    directions = np.array([[0.8 * 0.8, 0.8 * 0.6], [0.0, 0.0], [0.6 * 0.6, -0.6 * 0.8]])
    np.testing.assert_allclose(found[:2].T, -0.8 * 2e-6 * directions, rtol=1e-14)
    np.testing.assert_allclose(at_edge[2], found[2] - [0.1 * 2.0, 0.0, 0.0], rtol=1e-14)
    np.testing.assert_array_equal(found[3], rows.weighted)
    np.testing.assert_allclose(found[4], 0.12 * math.hypot(0.3 * 5e-6, 2e-6) * rows.weighted, rtol=1e-14)


def test_slip_by_pressure_alone_is_known_at_the_centres() -> None:
    """All of its local part, which no tractions cancel; what is the same in all cells stays as it is."""
    rows = row_of_three()
    known = local_slip.local_slip(rows, UNLIKE, 0.3, 0.1)
    per_pressure, ahead = known[:2] / 0.8, known[2]
    for m in (0, 2):
        rest = np.array([3e-4, 1e-4])
        found = local_slip.by_pressure_at_centres(rest + np.outer(ahead, per_pressure[:, m]), rows, UNLIKE, 0.1)
        np.testing.assert_allclose(found[m], rest + per_pressure[:, m] * rows.weighted[m], rtol=1e-12)


@pytest.mark.heavy
def test_part_of_the_local_slip_in_strips() -> None:
    """The table of `local_slip.py` to its last digit, and the part that approximates it."""
    slips, parts = (
        [float(word) for word in re.findall(r"  (\d\S*)", line)]
        for line in str(local_slip.__doc__).splitlines()
        if line.startswith(("    S/(mu C)", "    part"))
    )
    weighted = means(40)[1][0]
    assert len(slips) == 9
    for slip, part in zip(slips, parts, strict=True):
        fine, finest = (force_across(cells, slip, OF_THEORY) for cells in (640, 1280))
        without, whole = (force_across(40, slip, part) for part in (0.0, 1.0))
        found = (finest + 0.6 * (finest - fine) - without) / (whole - without)  # errors like h^1.4
        assert found == pytest.approx(part, abs=0.006)
        close = 0.03 if slip < 0.2 else 0.05 if slip < 5.0 else 0.1 if slip < 20.0 else 0.17
        assert OF_THEORY * slip**2 / (slip**2 + (local_slip._BEGINS * weighted) ** 2) == pytest.approx(part, abs=close)
