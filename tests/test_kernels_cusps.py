"""Pressure at borders behind stick zones, extrapolated from these: against plain loops and parabolas."""

import numpy as np
import pytest

from rcstudy.mechanics.kernels import cusps

NARROW, LEAST, PER_ROOT = 5.0, 5, 1.5


def extrapolated(p: np.ndarray, high: int, edges: tuple[float, float], x: float, length: float, known: float) -> float:
    """p^2 at the border `x` of a row of pressures `p`, as `cusps.squares_from_stick` has it; `known`: what is there."""
    ahead = [i for i in range(len(p)) if i >= x][1:4]  # without the cell beside the border
    inner = [i for i in ahead if i <= high - 2]
    if x < 0.0 or len(inner) < 2 or inner[1] > x + length:
        return known
    wanted = max(LEAST, round(PER_ROOT * length**0.5))
    in_stick = [i for i in range(inner[0], high - 1) if i <= x + length][:wanted]
    if len(in_stick) > 3:
        inner = in_stick
    places, squares = [float(i) for i in inner], [p[i] ** 2 for i in inner]
    if len(inner) == 2:
        places, squares = [*places, edges[1]], [*squares, 0.0]
    square = float(np.polynomial.Polynomial.fit(places, squares, 2)(x))
    if square > known:
        return square
    return 0.5 * (known + max(square, 0.0)) if x - edges[0] >= NARROW else known


@pytest.mark.parametrize("seed", range(8))
def test_squares_from_stick(seed: int) -> None:
    """Rows of any length, with borders anywhere or none, of which the hindmost counts."""
    rng = np.random.default_rng(seed)
    nx, ny = 20, 40
    low = rng.integers(0, 6, ny)
    high = np.maximum(low, rng.integers(4, nx, ny))
    p = np.where(
        (np.arange(nx)[:, None] >= low) & (np.arange(nx)[:, None] <= high), rng.uniform(1.0, 2.0, (nx, ny)), 0.0
    )
    edges = np.array([low - 0.4, high + 0.3])
    last, borders, squares = np.full(ny, -1), [], []
    for j in range(ny):
        for _ in range(rng.integers(0, 3)):
            last[j] = len(borders)
            borders.append((float(rng.choice([rng.uniform(edges[0, j], edges[1, j]), low[j]])), float(j)))
            squares.append(rng.choice([0.0, 1.0, 9.0]))
    length = rng.uniform(0.0, high - low + 1.0)
    expected = list(squares)
    for j, k in enumerate(last):
        if k >= 0:
            of_row = p[:, j], int(high[j]), (float(edges[0, j]), float(edges[1, j]))
            expected[k] = extrapolated(*of_row, borders[k][0], float(length[j]), squares[k])
    found = np.array(squares)
    cusps.squares_from_stick(p, high, edges, (np.array(borders), last, length), NARROW, LEAST, PER_ROOT, found)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
    changed = found != np.array(squares)
    assert changed.sum() > 3


def test_hertz_pressure_is_found_exactly() -> None:
    """Its square is a parabola along x: from the edge or without it, whatever cells behind the border have."""
    centre, radius = 9.3, 8.0
    p = np.sqrt(np.maximum(1.0 - ((np.arange(20.0) - centre) / radius) ** 2, 0.0))
    edges = np.array([[centre - radius], [centre + radius]])
    for x in (3.2, 8.0, 12.7, 13.0):  # the cells ahead of the last one are the outermost ones but for two
        pressures = p.copy()
        pressures[: int(np.ceil(x)) + 1] = 0.1
        found = np.zeros(1)
        of_row = np.array([17]), edges, (np.array([[x, 0.0]]), np.array([0]), np.array([9.0]))
        cusps.squares_from_stick(pressures[:, None].copy(), *of_row, NARROW, LEAST, PER_ROOT, found)
        assert found[0] == pytest.approx(1.0 - ((x - centre) / radius) ** 2, rel=1e-9)


def test_at_origin() -> None:
    for x in ((1.0, 2.0, 3.0), (1.4, 2.4, 2.9), (-1.0, 0.5, 4.0)):
        near, middle, far = (2.0 - 3.0 * place + 0.7 * place * place for place in x)
        assert cusps.at_origin(x, near, middle, far) == pytest.approx(2.0, rel=1e-12)


def test_fitted_at_origin() -> None:
    """Parabolas are found exactly; of other rows it is the one with the least squares."""
    rng = np.random.default_rng(3)
    p = rng.uniform(1.0, 2.0, (16, 2))
    for first, n, t in ((2, 3, 1.2), (2, 4, 1.7), (4, 9, 1.0)):
        places = t + np.arange(n)
        expected = np.polynomial.Polynomial.fit(places, p[first : first + n, 1] ** 2, 2)(0.0)
        assert cusps.fitted_at_origin(p, 1, first, n, t) == pytest.approx(expected, rel=1e-9)
        smooth = np.sqrt(2.0 - 0.3 * (np.arange(16.0) - first + t) + 0.05 * (np.arange(16.0) - first + t) ** 2)
        found = cusps.fitted_at_origin(np.stack([p[:, 0], smooth], axis=1), 1, first, n, t)
        assert found == pytest.approx(2.0, rel=1e-9)
