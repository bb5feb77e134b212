"""Kernels of the contact's smooth outline."""

from __future__ import annotations

import math

import naive_rows
import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from rcstudy.mechanics.kernels import smooth_outline
from rcstudy.mechanics.subcell.edges import fit_outline

TERMS = 9


def egg(seed: int, size: float = 0.03) -> np.ndarray:
    """Factors of an outline that is a circle but for waves of this size."""
    terms = np.random.default_rng(seed).uniform(-size, size, TERMS)
    terms[0] = 1.1
    return terms


def points(terms: np.ndarray, n: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    angle = np.random.default_rng(seed).uniform(-math.pi, math.pi, n)
    r = naive_rows.radius(terms, angle)
    return r * np.cos(angle), r * np.sin(angle)


def test_waves() -> None:
    out = np.zeros(TERMS)
    smooth_outline.waves(2.0 * math.cos(0.7), 2.0 * math.sin(0.7), out)
    orders = np.arange(1, TERMS // 2 + 1) * 0.7
    np.testing.assert_allclose(out[0::2][1:], np.sin(orders), atol=1e-15)
    np.testing.assert_allclose(out[1::2], np.cos(orders), atol=1e-15)
    assert out[0] == 1.0


def test_waves_without_a_direction() -> None:
    out = np.full(TERMS, np.nan)
    smooth_outline.waves(0.0, 0.0, out)
    np.testing.assert_array_equal(out, [1.0] + [1.0, 0.0] * (TERMS // 2))


def test_squared_radius() -> None:
    for angle in (-2.0, 0.0, 0.7):
        found = smooth_outline.squared_radius(egg(3), 3.0 * math.cos(angle), 3.0 * math.sin(angle), np.zeros(TERMS))
        assert found == pytest.approx(naive_rows.radius(egg(3), angle) ** 2, rel=1e-14)


@pytest.mark.parametrize("seed", range(4))
def test_an_outline_of_waves_is_found(seed: int) -> None:
    """To rounding, where it has no others; by least squares of r^2 where it is noisy."""
    terms = egg(seed)
    u, v = points(terms, 40, seed)
    found = fit_outline(u, v)
    assert found is not None
    np.testing.assert_allclose(found, terms, atol=1e-11)
    assert smooth_outline.off_outline(found, u, v) < 1e-11
    noise = 1.0 + np.random.default_rng(seed).uniform(-0.02, 0.02, u.size)
    found = fit_outline(noise * u, noise * v)
    assert found is not None
    angle, square = np.arctan2(v, u), noise**2 * (u**2 + v**2)
    columns = [np.ones(u.size)] + [f(m * angle) for m in range(1, TERMS // 2 + 1) for f in (np.cos, np.sin)]
    expected = np.linalg.lstsq(np.column_stack(columns), square, rcond=None)[0]
    np.testing.assert_allclose(found, expected, atol=1e-10)
    miss = (np.column_stack(columns) @ expected - square) / (2.0 * np.sqrt(square))
    assert smooth_outline.off_outline(found, noise * u, noise * v) == pytest.approx(
        math.sqrt(np.mean(miss**2)), rel=1e-9
    )


def test_normal_equations() -> None:
    u, v = points(egg(2), 25)
    matrix, right = np.full((TERMS, TERMS), np.nan), np.full(TERMS, np.nan)
    smooth_outline.normal_equations(u, v, matrix, right)
    columns = np.zeros((25, TERMS))
    for k in range(25):
        smooth_outline.waves(u[k], v[k], columns[k])
    np.testing.assert_allclose(matrix, columns.T @ columns, atol=1e-12)
    np.testing.assert_allclose(right, columns.T @ (u**2 + v**2), atol=1e-12)


def test_few_points_tell_no_outline() -> None:
    assert fit_outline(*points(egg(0), 2 * TERMS - 1)) is None
    assert fit_outline(*points(egg(0), 2 * TERMS)) is not None
    assert fit_outline(np.zeros(40), np.zeros(40)) is None  # no direction


@pytest.mark.parametrize("seed", range(4))
def test_where_an_outline_crosses_a_line(seed: int) -> None:
    """Tips, and crossings of lines between them; near a tip the outline runs along the line."""
    terms, wave = egg(seed), np.zeros(TERMS)

    def height(angle: float) -> float:
        return float(naive_rows.radius(terms, angle) * math.sin(angle))

    top = minimize_scalar(lambda t: -height(t), bounds=(1.0, 2.2), method="bounded", options={"xatol": 1e-9})
    bottom = minimize_scalar(height, bounds=(-2.2, -1.0), method="bounded", options={"xatol": 1e-9})
    assert smooth_outline.tip_position(terms, 1.0, wave) == pytest.approx(-top.fun, abs=1e-6)
    assert smooth_outline.tip_position(terms, -1.0, wave) == pytest.approx(bottom.fun, abs=1e-6)
    for v in (0.9 * bottom.fun, -0.3, 0.0, 0.5, -0.9 * top.fun):
        front = brentq(lambda t, v=v: height(t) - v, bottom.x, top.x, xtol=1e-14)
        back = brentq(lambda t, v=v: height(t) - v, top.x, bottom.x + 2.0 * math.pi, xtol=1e-14)
        for angle, side in ((front, 1.0), (back, -1.0)):
            expected = float(naive_rows.radius(terms, angle) * math.cos(angle))
            assert smooth_outline.crossing(terms, v, side, wave) == pytest.approx(expected, abs=2e-4)


def outline(**terms: float) -> np.ndarray:
    """Factors of r^2 = 1 + cos2 cos 2t + sin2 sin 2t."""
    out = np.zeros(TERMS)
    out[0], out[3], out[4] = 1.0, terms.get("cos2", 0.0), terms.get("sin2", 0.0)
    return out


def test_an_outline_without_a_tip_has_it_in_the_middle() -> None:
    """Where r^2 is negative that way, as rough edges may have it: neither a root of it nor 0/0."""
    for side in (1.0, -1.0):
        assert smooth_outline.tip_position(outline(cos2=2.0), side, np.zeros(TERMS)) == 0.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_tip_is_looked_for_near_the_axis(side: float) -> None:
    """Within 0.11 of it by angle: a step is as long as the parabola's points are apart."""
    for sin2 in (0.9, -0.9):
        terms = outline(sin2=sin2)
        at = 0.5 * math.pi * side - math.copysign(0.11, sin2)
        expected = float(naive_rows.radius(terms, at)) * math.sin(at)
        assert smooth_outline.tip_position(terms, side, np.zeros(TERMS)) == pytest.approx(expected, rel=1e-12)


def test_lines_beyond_an_outline_cross_it_in_the_middle() -> None:
    """And one beyond the circle of its mean, but not beyond it, does where it crosses: here at X of a quadratic."""
    wave = np.zeros(TERMS)
    for side in (1.0, -1.0):
        assert smooth_outline.crossing(outline(), 1.5, side, wave) == 0.0
        # (X + Y)^2 = X + Y - 0.5 (X - Y), X and Y being the squares
        found = smooth_outline.crossing(outline(cos2=-0.5), math.sqrt(1.2), side, wave)
        assert found == pytest.approx(side * math.sqrt(0.5 * (math.sqrt(1.9**2 + 4.0 * 0.36) - 1.9)), abs=0.02)


@pytest.mark.parametrize("height", [5.5, 5.3005])
def test_ends_of_an_ellipse(height: float) -> None:
    """Ends and slopes of rows within its tips, to rounding; nan beyond.

    The second one hardly reaches a row, whose half chord is a tenth of a cell: a quarter limits its slope.
    """
    terms = np.zeros(TERMS)
    terms[0] = 1.0
    ends, slopes = np.full((2, 14), 9.0), np.full(14, 9.0)
    low, high = smooth_outline.smooth_ends(terms, 7.2, 8.0, 6.3, height, ends, slopes)
    assert (low, high) == pytest.approx((6.3 - height, 6.3 + height), abs=1e-12)
    j = np.arange(14)
    inside = (j > low) & (j < high)
    assert np.isnan(ends[:, ~inside]).all()
    assert np.isnan(slopes[~inside]).all()
    half = 8.0 * np.sqrt(1.0 - ((j[inside] - 6.3) / height) ** 2)
    np.testing.assert_allclose(ends[:, inside], [7.2 - half, 7.2 + half], atol=1e-12)
    expected = (8.0 / height) ** 2 * (j[inside] - 6.3) / np.maximum(half, 0.25)
    np.testing.assert_allclose(slopes[inside], expected, rtol=1e-12)


def test_ends_of_a_smooth_outline_of_another_size() -> None:
    """Whatever its terms are relative to: a circle of 1.1 in units of half axes has axes 1.1 times as long."""
    found = []
    for size in (1.0, 1.1):
        ends, slopes = np.zeros((2, 12)), np.zeros(12)
        tips = smooth_outline.smooth_ends(size**2 * outline(), 6.1, 4.4 / size, 5.3, 5.5 / size, ends, slopes)
        found.append(np.array([*tips, *ends[0], *ends[1], *slopes]))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-12)
