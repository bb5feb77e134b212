"""Outline of a contact: where it crosses rows and columns, and the area within, of shapes whose area is known."""

import naive_rows
import numpy as np
import pytest

from rcstudy.mechanics.kernels import outline


def crossings(inside, reach, lines):
    """Where `inside` [x, y] begins and ends in each of the lines [2, n], by bisection from a point within."""
    found = np.full((2, lines), np.nan)
    for k in range(lines):
        fine = np.linspace(-1.0, reach, 4001)
        held = np.flatnonzero(inside(fine, k))
        if held.size:
            for side, at in enumerate((held[0], held[-1])):
                a, b = fine[at], fine[at] + (fine[1] - fine[0]) * (1 if side else -1)
                for _ in range(40):
                    middle = 0.5 * (a + b)
                    a, b = (middle, b) if inside(middle, k) else (a, middle)
                found[side, k] = a
    return found


def both(shape, nx, ny):
    """Crossings of rows and of columns."""
    return (
        crossings(lambda x, j: shape(x, float(j)), nx, ny),
        crossings(lambda y, i: shape(float(i), y), ny, nx),
    )


@pytest.mark.parametrize(
    ("a", "b", "x0", "y0"),
    [
        (6.0, 6.0, 7.0, 7.0),
        (5.3, 5.3, 6.4, 6.7),
        (9.1, 4.2, 10.3, 5.2),
        (2.2, 14.0, 3.4, 15.1),
        (12.4, 12.4, 13.1, 13.9),
    ],
)
def test_ellipses(a, b, x0, y0):
    rows, columns = both(
        lambda x, y: ((x - x0) / a) ** 2 + ((y - y0) / b) ** 2 <= 1.0, int(x0 + a) + 2, int(y0 + b) + 2
    )
    assert outline.area_within(rows, columns, 0.1, 0.1) == pytest.approx(np.pi * a * b, rel=1e-6 if a == b else 2e-3)


def test_an_egg():
    """Wider on one side, as contacts of moving bodies may be: r = 8 (1 + 0.1 cos t)."""

    def shape(x, y):
        return np.hypot(x - 9.3, y - 8.9) <= 8.0 * (1.0 + 0.1 * np.cos(np.arctan2(y - 8.9, x - 9.3)))

    assert outline.area_within(*both(shape, 20, 19), 0.1, 0.1) == pytest.approx(64.0 * np.pi * 1.005, rel=1e-3)


def test_errors_where_the_outline_runs_along_a_line_do_not_count():
    """A circle whose rows near the top are off by a tenth of a cell, as are columns near the sides."""
    rows, columns = both(lambda x, y: (x - 9.4) ** 2 + (y - 9.6) ** 2 <= 64.0, 19, 19)
    assert outline.area_within(rows, columns, 0.2, 0.2) == pytest.approx(64.0 * np.pi, rel=1e-6)
    off = np.array([[-0.1], [0.1]])
    for lines, middle in ((rows, 9.6), (columns, 9.4)):
        lines += np.where(abs(np.arange(19) - middle) > 6.5, off, 0.0)
    assert outline.area_within(rows, columns, 0.2, 0.2) == pytest.approx(64.0 * np.pi, rel=1e-4)


def test_long_cells_tell_by_their_true_directions():
    """Cells four times longer than wide: where the outline is at 45 degrees in cells it runs along the rows."""
    rows, columns = both(lambda x, y: ((x - 5.2) / 4.0) ** 2 + ((y - 17.3) / 16.0) ** 2 <= 1.0, 11, 35)
    exact = outline.area_within(rows, columns, 0.4, 0.1)
    assert exact == pytest.approx(64.0 * np.pi, rel=5e-3)
    j = np.flatnonzero((abs(np.arange(35) - 17.3) > 13.0) & ~np.isnan(rows[0]))  # rows that face y in truth
    rows[:, j] += [[-0.3], [0.3]]
    assert outline.area_within(rows, columns, 0.4, 0.1) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_against_crossings_sorted_by_their_angle(seed):
    """Ellipses along and across, crossings a tenth of a cell off at random."""
    rng = np.random.default_rng(seed)
    a, b, x0, y0 = rng.uniform(3.0, 9.0, size=4) + np.array([0.0, 0.0, 6.0, 6.0])
    rows, columns = both(lambda x, y: ((x - x0) / a) ** 2 + ((y - y0) / b) ** 2 <= 1.0, 26, 25)
    for lines in (rows, columns):
        lines += rng.uniform(-0.1, 0.1, size=lines.shape)
    dx, dy = rng.uniform(0.1, 0.3, size=2)
    expected = naive_rows.area_within(rows, columns, dx, dy)
    assert outline.area_within(rows, columns, dx, dy) == pytest.approx(expected, rel=1e-12)


def test_trusted_points_are_on_the_outline_and_go_round():
    """Those of rows face x, those of columns y; scaled by half widths they are on a circle, one after the other."""
    rows, columns = both(lambda x, y: ((x - 9.3) / 7.4) ** 2 + ((y - 8.1) / 5.2) ** 2 <= 1.0, 18, 15)
    u, v = np.full((2, 2 * (18 + 15)), np.nan)
    n, x0, width, y0, height = outline.accurate_crossings(rows, columns, 0.2, 0.1, u, v)
    assert (x0, width, y0, height) == pytest.approx((9.3, 7.4, 8.1, 5.2), abs=0.1)
    x, y = x0 + width * u[:n], y0 + height * v[:n]
    np.testing.assert_allclose(((x - 9.3) / 7.4) ** 2 + ((y - 8.1) / 5.2) ** 2, 1.0, atol=1e-9)
    angle = np.unwrap(np.arctan2(v[:n], u[:n]))
    assert (np.diff(angle) > 0.0).all()
    assert 0.8 * 2.0 * np.pi < np.ptp(angle) < 2.0 * np.pi
    of_row = np.abs(y - np.rint(y)) < 1e-9
    faces_x = np.abs(u[:n]) * height * 0.1 >= np.abs(v[:n]) * width * 0.2
    np.testing.assert_array_equal(of_row[faces_x], True)


def test_three_lines_are_enough():
    """Of an ellipse in three rows, or in three columns, none of them beyond it; cells of any shape."""
    along, across = both(lambda x, y: ((x - 2.2) / 2.4) ** 2 + ((y - 1.1) / 1.45) ** 2 <= 1.0, 5, 3)
    assert np.isfinite(along).all() and np.isfinite(across).all()
    for rows, columns in ((along, across), (across, along)):
        for dx, dy in ((0.1, 0.1), (0.1, 0.3), (0.3, 0.1)):
            expected = naive_rows.area_within(rows, columns, dx, dy)
            assert outline.area_within(rows, columns, dx, dy) == pytest.approx(expected, rel=1e-12)
            assert expected == pytest.approx(np.pi * 2.4 * 1.45, rel=0.1)


@pytest.mark.parametrize("lines", [0, 1, 2])
def test_nothing_of_an_outline_of_few_lines(lines):
    many, few = np.full((2, 7), np.nan), np.full((2, 7), np.nan)
    many[:, :5], few[:, :lines] = [[0.0], [1.5]], [[0.0], [4.0]]
    assert outline.area_within(few, many, 1.0, 1.0) == 0.0
    assert outline.area_within(many, few, 1.0, 1.0) == 0.0


def test_middle_and_width():
    lines = np.array([[np.nan, 1.0, 2.0, 3.0, np.nan], [np.nan, 1.5, 5.0, 2.9, np.nan]])
    assert outline.middle_and_width(lines) == (2, 2.375, 2.0)
    assert outline.middle_and_width(lines[:, :1])[0] == 0


@pytest.mark.parametrize("turn", [0.7, -0.7])
def test_sector(turn):
    """Of a circle: half of r^2 times the angle, whichever way round; of two radii the mean of their squares."""
    for angle in (0.0, 2.0, 3.0, -1.4):
        for r in (2.0, 3.0):
            ends = 2.0 * np.cos(angle), 2.0 * np.sin(angle), r * np.cos(angle + turn), r * np.sin(angle + turn)
            assert outline.sector(*ends) == pytest.approx(0.25 * turn * (4.0 + r * r), rel=1e-12)


@pytest.mark.parametrize("weights", [(0.1, -0.3), (2.0, 3.0), (-1.0, 0.1)])
@pytest.mark.parametrize("shape", [(1, 1), (1, 5), (6, 1), (5, 4), (8, 9)])
def test_summit(shape: tuple[int, int], weights: tuple[float, float]) -> None:
    """Anywhere, beside the box's sides as well, where no pressure is; two as large; all the same; and on a ridge."""
    taken = set()
    for seed in range(12):
        p = np.random.default_rng(seed).uniform(0.1 if seed % 2 else 0.9, 1.0, size=shape)
        around = np.pad(p, 1)
        i, j = np.unravel_index(np.argmax(around), around.shape)
        height, place, excess = around[i, j] ** 2, [i - 1.0, j - 1.0], 0.0
        concentrated = 0.0
        for axis, line in enumerate((around[i - 1 : i + 2, j], around[i, j - 1 : j + 2])):
            a, b, c = np.polyfit([-1.0, 0.0, 1.0], line**2, 2)
            height += c - b * b / (4.0 * a) - around[i, j] ** 2
            place[axis] -= b / (2.0 * a)
            bend = -np.diff(line, 2)[0] if (line > 0.0).all() else np.inf
            excess += bend
            concentrated += weights[axis] * bend
        smooth = bool(excess < 0.5 * around[i, j])
        taken.add(smooth)
        limited = min(max(concentrated / around[i, j], -0.05), 0.3) * around[i, j]
        expected = np.sqrt(height) - (limited if smooth else 0.0)
        np.testing.assert_allclose(outline.summit(p, *weights), [expected, *place], rtol=1e-12, atol=1e-12)
    assert taken == ({False, True} if min(shape) > 3 else {False})
    if min(shape) > 3:
        p = np.full(shape, 0.2)
        p[2:4, 1] = 1.0
        np.testing.assert_allclose(outline.summit(p, 0.1, -0.3)[1:], [2.5, 1.0])
        p[2:4, 1] = 1.0, 1.0 + 1e-15
        np.testing.assert_allclose(outline.summit(p, 0.1, -0.3)[1:], [2.5, 1.0])
    assert outline.summit(np.full((5, 5), 2.0), 0.1, 0.1)[0] >= 2.0
