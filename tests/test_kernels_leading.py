"""Kernels of what rows' leading and trailing ends hide against plain NumPy."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rcstudy.mechanics.kernels import leading_slip, stick
from rcstudy.mechanics.subcell import leading_zone
from rcstudy.mechanics.subcell.moved_rows import RowTable

THETA, REACH = 0.748, 0.7
ZONES = leading_zone.numbers(4, THETA, 0.0264)


def numbered(counts: np.ndarray) -> tuple[np.ndarray, int]:
    """Numbers [most, ny] of the cells of rows of so many, row after row, -1 beyond their last; how many there are."""
    index = np.full((counts.max(), counts.size), -1)
    total = 0
    for row in np.flatnonzero(counts):
        index[: counts[row], row] = np.arange(total, total + counts[row])
        total += counts[row]
    return index, total


def table_of(index: np.ndarray, counts: np.ndarray, ends: np.ndarray) -> RowTable:
    """Rows whose leading cells lie where they should."""
    return RowTable(index, ends[1] - THETA, counts, ends)


def mean_slip(cells: np.ndarray, by_pressure: np.ndarray, length: float) -> np.ndarray:
    """As `leading_slip.slip_behind`."""
    weights = np.sqrt(np.maximum(length / (np.arange(cells.size) + THETA) - 1.0, 0.0))
    return weights @ by_pressure[cells] / weights.sum() if weights.any() else np.zeros(2)


def unseen_width(v: float, growth: float, slips: int) -> float:
    """As `leading_slip.unseen_width`."""
    c = ZONES[slips]
    w0 = math.exp(min(((v * c[6] - c[2]) / growth - c[0]) / c[1], 50.0))
    most = 1.15 * THETA if slips == 0 else 1.85 * (slips + THETA)
    least = (0.0, 0.8 * THETA)[slips] if slips < 2 else 1.35 * (slips - 1 + THETA)
    w0 = np.clip(w0, least, most)
    return 2.0 * (4.0 * np.exp(-2.0) * w0 - 2.0 * (c[3] + math.log(w0) * c[4] + c[5] / growth))


@pytest.mark.parametrize("slips", [0, 1, 2, 3])
def test_unseen_width(slips: int) -> None:
    for v in (0.1, 0.6, 0.9, 0.99, 1.0):
        for growth in (0.12, 0.4, 1.3):
            found = leading_slip.unseen_width(v, growth, slips, THETA, ZONES[slips])
            assert found == pytest.approx(unseen_width(v, growth, slips), rel=1e-12, abs=1e-14)


@pytest.mark.parametrize(
    ("flags", "expected"),
    [("ss--s-s", (2, 6)), ("---", (0, 3)), ("s-", (1, 2)), ("-s", (0, 1)), ("sss", (3, 0)), ("", (0, 0))],
)
def test_leading_cells(flags: str, expected: tuple[int, int]) -> None:
    """s: slips. The cells are numbered from the other end."""
    slip = np.array([flag == "s" for flag in reversed(flags)], dtype=np.bool_)
    assert leading_slip.leading_cells(np.arange(slip.size)[::-1].copy(), slip) == expected


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        (["--", "s-", "s--", "ss-", "--"], 3),
        (["s-", "s-", "s-"], 1),  # nothing is known beyond the first and the last row
        (["--", "s-", "ss", "s-", "--"], 0),  # each has a row beside it in which nothing sticks
        (["--", "s-", "", "ss", "-s", "s-s", "--"], 1),
        (["-s", "-s", "-s"], 0),
        (["s-"], 0),
    ],
)
def test_detached_rows(rows: list[str], expected: int) -> None:
    """s: slips, from the leading edge on."""
    counts = np.array([len(row) for row in rows])
    index, _ = numbered(counts)
    slip = np.array([flag == "s" for flag in "".join(rows)], dtype=np.bool_)
    assert leading_slip.detached_rows(index, counts, slip) == expected
    sticks = [0, *("-" in row for row in rows), 0]
    beside = [leading_slip.sticks_beside(index, counts, slip, j) for j in range(len(rows))]
    assert beside == [bool(sticks[j] and sticks[j + 2]) for j in range(len(rows))]


@pytest.mark.parametrize("k", [-0.6, 0.2, 1.1])
def test_at_bound(k: float) -> None:
    """Where v + t k n meets the unit circle, farther ahead; where v is at its bound and along the edge, at once."""
    angle = 0.3
    n = np.array([math.cos(angle), math.sin(angle)])
    for v in ([0.3, -0.4], [0.0, 0.0], [-0.9, 0.1]):
        t, *d = leading_slip.at_bound(*v, *n, k)
        assert t > 0.0
        np.testing.assert_allclose(d, v + t * k * n, rtol=1e-14)
        assert math.hypot(*d) == pytest.approx(1.0, rel=1e-14)
    assert leading_slip.at_bound(-n[1], n[0], *n, k)[0] == pytest.approx(0.0, abs=1e-7)
    assert leading_slip.at_bound(0.0, 0.0, *n, 1e-5)[0] == 600.0


def test_by_the_law() -> None:
    assert [leading_slip.by_the_law(growth) for growth in (-0.3, 0.0999, 0.1, 2.0)] == [False, False, True, True]


def test_missing_width() -> None:
    """By the law where tractions hardly grow and no cell slips; nothing in zones of more cells than there are laws."""
    of_law = 0.37
    assert leading_slip.missing_width(0.5, 0.09, 0, of_law, THETA, ZONES) == of_law
    assert leading_slip.missing_width(0.5, -0.3, 1, of_law, THETA, ZONES) == 0.0
    assert leading_slip.missing_width(0.9, 0.4, 4, of_law, THETA, ZONES) == 0.0
    assert leading_slip.missing_width(0.9, 0.0999, 0, of_law, THETA, ZONES) == of_law
    for slips, growth in ((0, 0.4), (3, 0.4), (0, 0.1001)):
        found = leading_slip.missing_width(0.9, growth, slips, of_law, THETA, ZONES)
        assert found == leading_slip.unseen_width(0.9, growth, slips, THETA, ZONES[slips]) != of_law


def test_doubts() -> None:
    assert leading_slip.doubts(0, 0.2, THETA) == (0.2, 0.2, 0.2)
    past = (1.0 + THETA) / 2.5
    np.testing.assert_allclose(leading_slip.doubts(2, 2.5, THETA), [THETA * past**4, past**2, -(past**2)], rtol=1e-14)
    assert leading_slip.doubts(2, 0.5, THETA) == (THETA, 1.0, -1.0)


def sums_over_rows(
    index: np.ndarray,
    ends: np.ndarray,
    normals: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    q: np.ndarray,
    slip: np.ndarray,
    pressure: np.ndarray,
    by_pressure: np.ndarray,
    friction: float,
    k: float,
    along_over_across: float,
    dx: float,
) -> np.ndarray:
    """As `leading_slip.hidden_leading_slip`, row by row with vectors."""
    total = np.zeros(8)
    sticking = np.array([0, *[not slip[column[column >= 0]].all() for column in index.T], 0])
    for j, (column, (back, front), normal) in enumerate(zip(index.T, ends.T, normals.T, strict=True)):
        cells = column[column >= 0]
        if not cells.size or slip[cells].all():
            continue
        slips = int(np.flatnonzero(~slip[cells])[0])
        sticks = int(np.flatnonzero(~slip[cells])[-1]) + 1
        v = q[cells[slips]] / (friction * pressure[cells[slips]])
        # the larger root of |v + t k n| = 1, a quadratic in t
        t = min(np.roots([k * k, 2.0 * k * (v @ normal), v @ v - 1.0]).real.max(), 600.0)
        d = v + t * k * normal
        tangent = np.array([-normal[1], normal[0]])
        resistance = np.outer(normal, normal) + along_over_across * np.outer(tangent, tangent)
        width = (slips + THETA) * np.exp(-t)
        past = min((slips - 1 + THETA) / width, 1.0) if slips else 0.0
        growth = k * (d @ normal)
        if growth < 0.1:
            hidden = 0.0 if slips else width
        else:
            hidden = unseen_width(v @ d, growth, slips) if slips < len(ZONES) else 0.0
        length = min(sticks - 0.5 + THETA, front - back)
        largest = pressure[cells].max()
        size = 0.5 * np.pi * friction * largest * np.sqrt(length / (front - back)) * growth * hidden * REACH
        force = size * resistance @ d / (d @ resistance @ d)
        lever = np.array([x[cells[0]] + (THETA - 0.5 * length) * dx, y[cells[0]]])
        total[:2] += force
        total[2] += lever[0] * force[1] - lever[1] * force[0]
        total[3] += force @ mean_slip(cells[:sticks], by_pressure, length)
        total[4] += abs(k) * friction * largest * (THETA * past**4 if slips else width)
        total[5] += past**2 if slips else width
        if slips and growth < 0.1:
            total[7] += sticking[j] * sticking[j + 2]
        else:
            total[6] += -(past**2) if slips else width
    return total


@pytest.mark.parametrize("seed", [*range(6), 9, 19, 53, 79, 190])
def test_sums_over_rows(seed: int) -> None:
    """9 and 19 have rows of three and of four slip cells, 53 and those that follow tractions that hardly grow there."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(1, 7, 9)
    counts[:2] = counts[-1] = 0  # no contact there
    index, cells = numbered(counts)
    pressure, x, y = rng.uniform(1.0, 5.0, (3, cells))
    friction, k = 0.3, rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 1.0)
    angle, part = rng.uniform(0.0, 7.0, cells), rng.uniform(0.2, 0.99, cells)
    slip = rng.random(cells) < 0.4
    part[slip] = 1.0
    q = (friction * part * pressure * np.array([np.cos(angle), np.sin(angle)])).T
    ends = np.array([np.zeros(9), rng.uniform(2.0, 9.0, 9)])
    slope = rng.uniform(-1.0, 1.0, 9)
    normals = np.array([np.cos(slope), np.sin(slope)])
    by_pressure, along_over_across, dx = rng.normal(size=(cells, 2)), rng.uniform(0.5, 1.0), 0.1
    expected = sums_over_rows(
        index, ends, normals, x, y, q, slip, pressure, by_pressure, friction, k, along_over_across, dx
    )
    of_rows, of_cells = (table_of(index, counts, ends), normals), ((q, slip, pressure, friction), x, y, by_pressure)
    found = np.zeros(8)
    leading_slip.hidden_leading_slip(*of_rows, *of_cells, (k, along_over_across, REACH), dx, THETA, ZONES, found)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("length", [0.5, 2.2, 5.2])
def test_slip_behind(length: float) -> None:
    """Of cells beyond the length none counts; where none is within it, there is none."""
    cells, by_pressure = np.array([4, 1, 3, 0]), np.random.default_rng(3).normal(size=(6, 2))
    found = leading_slip.slip_behind(cells, by_pressure, length, THETA)
    np.testing.assert_allclose(found, mean_slip(cells, by_pressure, length), rtol=1e-12)
    assert (length > THETA) == np.any(found)


@pytest.mark.parametrize("length", [0.0, 1.0])
def test_slip_hidden_ahead_of_a_cell_at_its_bound_is_finite(length: float) -> None:
    """Its traction is along the edge, and rounding has left it beyond the bound; in a row of no length, too."""
    row, count = np.zeros((1, 1), dtype=np.int64), np.ones(1, dtype=np.int64)
    ends, normal = np.array([[0.0], [length]]), np.array([[1.0], [0.0]])
    cells = np.array([[0.0, 0.3 * (1.0 + 4e-16)]]), np.zeros(1, dtype=np.bool_), np.ones(1), 0.3
    at_centres, found = (np.zeros(1), np.zeros(1), np.ones((1, 2))), np.zeros(8)
    of_row = table_of(row, count, ends), normal, cells
    leading_slip.hidden_leading_slip(*of_row, *at_centres, (0.2, 0.8, REACH), 0.1, THETA, ZONES, found)
    np.testing.assert_allclose(found, [0.0, 0.0, 0.0, 0.0, 0.2 * 0.3 * THETA, THETA, THETA, 0.0], rtol=1e-6)


def endings(
    index: np.ndarray, ends: np.ndarray, q: np.ndarray, slip: np.ndarray, pressure: np.ndarray, friction: float
) -> list[tuple[int, np.ndarray, float, np.ndarray, float]]:
    """Rows that stick to their end: number, cells, length, amplitude and hidden width, by `trailing.py`."""
    rows = []
    for j, (column, (back, front)) in enumerate(zip(index.T, ends.T, strict=True)):
        cells = column[column >= 0]
        if cells.size and not slip[cells[-1]]:
            amplitude = q[cells[-1]] / math.gamma(0.5)
            steep = friction * 2.0 * pressure[cells].max() / np.sqrt(front - back)
            rows.append((j, cells, front - back, amplitude, 2.0 * np.hypot(*amplitude) / steep))
    return rows


@pytest.mark.parametrize("seed", range(4))
def test_rows_that_stick_to_their_end(seed: int) -> None:
    rng = np.random.default_rng(seed)
    counts = rng.integers(1, 7, 9)
    counts[4] = 0  # no contact there
    index, cells = numbered(counts)
    pressure, x, y = rng.uniform(1.0, 5.0, (3, cells))
    back = rng.uniform(0.2, 5.0, 9)
    ends = np.array([back, back + counts + rng.uniform(-0.5, 0.5, 9)])
    q, slip = rng.normal(size=(cells, 2)), rng.random(cells) < 0.4
    widths, expected = np.zeros(9), np.full(9, np.nan)
    of_rows = table_of(index, counts, ends), (q, slip, pressure, 0.3)
    stick.hidden_widths(*of_rows, widths)
    found, total = np.zeros(3), np.zeros(3)
    stick.ending_rows(*of_rows, x, y, 0.1, THETA, found)
    for j, row, length, amplitude, width in endings(index, ends, q, slip, pressure, 0.3):
        expected[j] = width
        reach = max(length - 0.5 * width, 0.0)
        of_slip = amplitude * math.gamma(row.size) / math.gamma(row.size + 0.5)
        force = 0.5 * np.pi * of_slip * (reach - row.size)
        lever = x[row[0]] + (THETA - 0.75 * (reach + row.size)) * 0.1
        total += force[0], force[1], lever * force[1] - y[row[0]] * force[0]
    assert 0 < np.isnan(expected).sum() < 9
    np.testing.assert_allclose(widths, expected, rtol=1e-12)
    np.testing.assert_allclose(found, total, rtol=1e-11)


@pytest.mark.parametrize("length", [1e-9, 1e-3, 0.03])
def test_a_row_of_next_to_no_length_carries_next_to_nothing(length: float) -> None:
    """At the sides of a contact: what its one cell carries is taken off, and no more."""
    one, q = np.zeros((1, 1), dtype=np.int64), np.array([[0.2, -0.1]])
    table = table_of(one, np.ones(1, dtype=np.int64), np.array([[0.0], [length]]))
    found = np.zeros(3)
    cells = q, np.zeros(1, dtype=np.bool_), np.ones(1), 0.3
    stick.ending_rows(table, cells, np.zeros(1), np.zeros(1), 0.1, THETA, found)
    np.testing.assert_allclose(found[:2], -q[0], rtol=length + 1e-12)
