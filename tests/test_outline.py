"""Area within an outline, from where it crosses rows and columns: of shapes whose area is known."""

import numpy as np
import pytest

from rcstudy.mechanics.outline import area_within


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
    assert area_within(rows, columns, (0.1, 0.1)) == pytest.approx(np.pi * a * b, rel=1e-6 if a == b else 2e-3)


def test_an_egg():
    """Wider on one side, as contacts of moving bodies may be: r = 8 (1 + 0.1 cos t)."""

    def shape(x, y):
        return np.hypot(x - 9.3, y - 8.9) <= 8.0 * (1.0 + 0.1 * np.cos(np.arctan2(y - 8.9, x - 9.3)))

    assert area_within(*both(shape, 20, 19), (0.1, 0.1)) == pytest.approx(64.0 * np.pi * 1.005, rel=1e-3)


def test_errors_where_the_outline_runs_along_a_line_do_not_count():
    """A circle whose rows near the top are off by a tenth of a cell, as are columns near the sides."""
    rows, columns = both(lambda x, y: (x - 9.4) ** 2 + (y - 9.6) ** 2 <= 64.0, 19, 19)
    assert area_within(rows, columns, (0.2, 0.2)) == pytest.approx(64.0 * np.pi, rel=1e-6)
    off = np.array([[-0.1], [0.1]])
    for lines, middle in ((rows, 9.6), (columns, 9.4)):
        lines += np.where(abs(np.arange(19) - middle) > 6.5, off, 0.0)
    assert area_within(rows, columns, (0.2, 0.2)) == pytest.approx(64.0 * np.pi, rel=1e-4)


def test_long_cells_tell_by_their_true_directions():
    """Cells four times longer than wide: where the outline is at 45 degrees in cells it runs along the rows."""
    rows, columns = both(lambda x, y: ((x - 5.2) / 4.0) ** 2 + ((y - 17.3) / 16.0) ** 2 <= 1.0, 11, 35)
    exact = area_within(rows, columns, (0.4, 0.1))
    assert exact == pytest.approx(64.0 * np.pi, rel=5e-3)
    j = np.flatnonzero((abs(np.arange(35) - 17.3) > 13.0) & ~np.isnan(rows[0]))  # rows that face y in truth
    rows[:, j] += [[-0.3], [0.3]]
    assert area_within(rows, columns, (0.4, 0.1)) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("lines", [0, 1, 2])
def test_none_of_an_outline_of_few_lines(lines):
    many, few = np.full((2, 7), np.nan), np.full((2, 7), np.nan)
    many[:, :5], few[:, :lines] = [[0.0], [1.5]], [[0.0], [4.0]]
    assert area_within(few, many, (1.0, 1.0)) is None
    assert area_within(many, few, (1.0, 1.0)) is None
