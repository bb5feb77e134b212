"""Kernels of smooth lines: the contact's outline, the slip zone's width and area."""

from __future__ import annotations

import math

import naive_rows
import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from rcstudy.mechanics.kernels import smooth
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
    smooth.waves(2.0 * math.cos(0.7), 2.0 * math.sin(0.7), out)
    orders = np.arange(1, TERMS // 2 + 1) * 0.7
    np.testing.assert_allclose(out[0::2][1:], np.sin(orders), atol=1e-15)
    np.testing.assert_allclose(out[1::2], np.cos(orders), atol=1e-15)
    assert out[0] == 1.0


def test_waves_without_a_direction() -> None:
    out = np.full(TERMS, np.nan)
    smooth.waves(0.0, 0.0, out)
    np.testing.assert_array_equal(out, [1.0] + [1.0, 0.0] * (TERMS // 2))


def test_squared_radius() -> None:
    for angle in (-2.0, 0.0, 0.7):
        found = smooth.squared_radius(egg(3), 3.0 * math.cos(angle), 3.0 * math.sin(angle), np.zeros(TERMS))
        assert found == pytest.approx(naive_rows.radius(egg(3), angle) ** 2, rel=1e-14)


@pytest.mark.parametrize("seed", range(4))
def test_an_outline_of_waves_is_found(seed: int) -> None:
    """To rounding, where it has no others; by least squares of r^2 where it is noisy."""
    terms = egg(seed)
    u, v = points(terms, 40, seed)
    found = fit_outline(u, v)
    assert found is not None
    np.testing.assert_allclose(found, terms, atol=1e-11)
    assert smooth.off_outline(found, u, v) < 1e-11
    noise = 1.0 + np.random.default_rng(seed).uniform(-0.02, 0.02, u.size)
    found = fit_outline(noise * u, noise * v)
    assert found is not None
    angle, square = np.arctan2(v, u), noise**2 * (u**2 + v**2)
    columns = [np.ones(u.size)] + [f(m * angle) for m in range(1, TERMS // 2 + 1) for f in (np.cos, np.sin)]
    expected = np.linalg.lstsq(np.column_stack(columns), square, rcond=None)[0]
    np.testing.assert_allclose(found, expected, atol=1e-10)
    miss = (np.column_stack(columns) @ expected - square) / (2.0 * np.sqrt(square))
    assert smooth.off_outline(found, noise * u, noise * v) == pytest.approx(math.sqrt(np.mean(miss**2)), rel=1e-9)


def test_normal_equations() -> None:
    u, v = points(egg(2), 25)
    matrix, right = np.full((TERMS, TERMS), np.nan), np.full(TERMS, np.nan)
    smooth.normal_equations(u, v, matrix, right)
    columns = np.zeros((25, TERMS))
    for k in range(25):
        smooth.waves(u[k], v[k], columns[k])
    np.testing.assert_allclose(matrix, columns.T @ columns, atol=1e-12)
    np.testing.assert_allclose(right, columns.T @ (u**2 + v**2), atol=1e-12)


def test_few_points_tell_no_outline() -> None:
    assert fit_outline(*points(egg(0), 2 * TERMS - 1)) is None
    assert fit_outline(np.zeros(40), np.zeros(40)) is None  # no direction


@pytest.mark.parametrize("seed", range(4))
def test_where_an_outline_crosses_a_line(seed: int) -> None:
    """Tips, and crossings of lines between them; near a tip the outline runs along the line."""
    terms, wave = egg(seed), np.zeros(TERMS)

    def height(angle: float) -> float:
        return float(naive_rows.radius(terms, angle) * math.sin(angle))

    top = minimize_scalar(lambda t: -height(t), bounds=(1.0, 2.2), method="bounded", options={"xatol": 1e-9})
    bottom = minimize_scalar(height, bounds=(-2.2, -1.0), method="bounded", options={"xatol": 1e-9})
    assert smooth.tip_position(terms, 1.0, wave) == pytest.approx(-top.fun, abs=1e-6)
    assert smooth.tip_position(terms, -1.0, wave) == pytest.approx(bottom.fun, abs=1e-6)
    for v in (0.9 * bottom.fun, -0.3, 0.0, 0.5, -0.9 * top.fun):
        front = brentq(lambda t, v=v: height(t) - v, bottom.x, top.x, xtol=1e-14)
        back = brentq(lambda t, v=v: height(t) - v, top.x, bottom.x + 2.0 * math.pi, xtol=1e-14)
        for angle, side in ((front, 1.0), (back, -1.0)):
            expected = float(naive_rows.radius(terms, angle) * math.cos(angle))
            assert smooth.crossing(terms, v, side, wave) == pytest.approx(expected, abs=2e-4)


@pytest.mark.parametrize("height", [5.5, 5.3005])
def test_ends_of_an_ellipse(height: float) -> None:
    """Ends and slopes of rows within its tips, to rounding; nan beyond.

    The second one hardly reaches a row, whose half chord is a tenth of a cell: a quarter limits its slope.
    """
    terms = np.zeros(TERMS)
    terms[0] = 1.0
    ends, slopes = np.full((2, 14), 9.0), np.full(14, 9.0)
    low, high = smooth.smooth_ends(terms, 7.2, 8.0, 6.3, height, ends, slopes)
    assert (low, high) == pytest.approx((6.3 - height, 6.3 + height), abs=1e-12)
    j = np.arange(14)
    inside = (j > low) & (j < high)
    assert np.isnan(ends[:, ~inside]).all()
    assert np.isnan(slopes[~inside]).all()
    half = 8.0 * np.sqrt(1.0 - ((j[inside] - 6.3) / height) ** 2)
    np.testing.assert_allclose(ends[:, inside], [7.2 - half, 7.2 + half], atol=1e-12)
    expected = (8.0 / height) ** 2 * (j[inside] - 6.3) / np.maximum(half, 0.25)
    np.testing.assert_allclose(slopes[inside], expected, rtol=1e-12)


@pytest.mark.parametrize("n", [4, 5, 9, 30])
@pytest.mark.parametrize("seed", range(3))
def test_smooth_line(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    value, weight = rng.normal(size=n), rng.uniform(1.0, 2000.0, size=n)
    weight[rng.permutation(n)[: n - 4]] *= rng.integers(0, 2, n - 4)
    out = np.full(n, np.nan)
    smooth.smooth_line(value, weight, 0.1, 0.02, out)
    np.testing.assert_allclose(out, naive_rows.smooth_line(value, weight, 0.1, 0.02), atol=1e-9)


def test_a_straight_line_stays_and_goes_on() -> None:
    value, weight, out = 0.3 * np.arange(12.0) - 1.0, np.zeros(12), np.zeros(12)
    weight[3:8] = 100.0
    smooth.smooth_line(np.where(weight > 0.0, value, 99.0), weight, 0.1, 0.01, out)
    np.testing.assert_allclose(out, value, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_turns_behind(seed: int) -> None:
    """Rows that slip or stick in parts, stick or slip throughout, and one without cells."""
    rng = np.random.default_rng(seed)
    states = [
        "",
        "-",
        "s",
        "ss",
        "---",
        "s--ss",
        "-s-s",
        "--ssss",
        *("".join(rng.choice(list("s-"), 7)) for _ in "abc"),
    ]
    count = np.array([len(row) for row in states])
    m = int(count.sum())
    index, number = np.full((7, count.size), -1), rng.permutation(m)
    for j, firsts in enumerate(np.cumsum(count) - count):
        index[: count[j], j] = number[firsts : firsts + count[j]]
    q, slip, out = rng.normal(size=(m, 2)), np.zeros(m, dtype=np.bool_), np.full((3, count.size), np.nan)
    slip[number] = [state == "s" for row in states for state in row]
    smooth.turns_behind(q, slip, index, count, out)
    for j, row in enumerate(states):
        expected = naive_rows.turns_behind(row, q[index[: count[j], j]])
        np.testing.assert_allclose(out[:, j], expected, atol=1e-12)
    q[:] = 0.0
    smooth.turns_behind(q, slip, index, count, out)
    np.testing.assert_array_equal(out, 0.0)


def test_too_far_back() -> None:
    """Most at steep borders and under friction across the rows, less in long rows, nothing where tractions turn."""
    along, across, slanting = (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    assert smooth.too_far_back(0.0, 5.0, 0.0, 1.0, along, 0.4) == pytest.approx(0.0225)
    assert smooth.too_far_back(0.0, 5.0, -4.0, 1.0, along, 0.4) == pytest.approx(0.0225)
    assert smooth.too_far_back(0.0, 0.01, 0.0, 1.0, along, 0.4) == 0.01
    # 0.22 s^2/(l + 0.9) where nothing else is left
    for aspect in (1.0, 2.0):
        found = smooth.too_far_back(-0.3, 8.1, 40.0, aspect, along, 0.0)
        assert found == pytest.approx(0.22 * aspect * 0.09 / 9.0, rel=5e-3)
    of_row = 1.0, 20.0, 40.0, 1.0
    assert smooth.too_far_back(*of_row, across, 0.7) - smooth.too_far_back(*of_row, along, 0.7) > 0.012
    assert smooth.too_far_back(*of_row, slanting, 0.7) == pytest.approx(0.0105 - 0.0266, abs=3e-4)
    assert smooth.too_far_back(-1.0, *of_row[1:], slanting, 0.7) == pytest.approx(0.0105 + 0.0266, abs=1e-3)
    assert smooth.too_far_back(6.0, 8.0, 3.0, 1.0, across, 0.4) == pytest.approx(0.66, abs=0.01)
    turned = smooth.too_far_back(1.0, 20.0, 4.0, 1.0, (1.0, 0.0, 1.5), 0.0)
    assert abs(turned) < 0.01 * smooth.too_far_back(1.0, 20.0, 4.0, 1.0, along, 0.0)


def test_noise() -> None:
    """Outermost rows of few cells tell worst."""
    assert smooth.noise(0.0, 0) == pytest.approx(0.2)
    levels = [smooth.noise(4.0, inside) for inside in range(5)]
    assert levels == sorted(levels, reverse=True)
    assert levels[3] == levels[4]


def contact(seed: int) -> dict[str, np.ndarray]:
    """Rows of an elliptic contact, stick cells ahead of borders that scatter, the outermost ones' by more."""
    rng = np.random.default_rng(seed)
    ny = int(rng.integers(12, 30))
    terms = np.zeros(TERMS)
    terms[0] = 1.0
    ends, slopes = np.zeros((2, ny)), np.zeros(ny)
    height = 0.5 * ny - rng.uniform(0.6, 1.9)
    smooth.smooth_ends(
        terms, 9.0, rng.uniform(5.0, 14.0), 0.5 * (ny - 1) + rng.uniform(-0.3, 0.3), height, ends, slopes
    )
    y = (np.arange(ny) - 0.5 * ny) / height
    width = rng.uniform(0.5, 6.0) * (1.0 - 0.3 * y**2 + rng.uniform(-0.5, 0.5) * y) + rng.normal(0.0, 0.02, ny)
    length = np.nan_to_num(np.maximum(ends[1] - ends[0] - width, 0.0))
    border = np.where((length > 0.0) & (rng.random(ny) > 0.1), ends[0] + width, np.nan)
    flags = {"leading_slips": length == 0.0, "in_parts": np.zeros(ny, dtype=np.bool_), "hidden": rng.random(ny) < 0.3}
    return {"border": border, "length": length, "ends": ends, "slopes": slopes} | flags


def numbered(rows: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Borders, from the last row on, and their numbers in rows; slip flags of cells, and numbers of leading ones.

    Rows in parts have one border more.
    """
    border, slips = rows["border"], rows["leading_slips"]
    ny = border.size
    with_border = np.flatnonzero(~np.isnan(border) | rows["in_parts"])[::-1]
    last = np.full(ny, -1)
    last[with_border] = np.arange(with_border.size)
    last[np.isnan(border)] = -1
    more = np.flatnonzero(rows["in_parts"] & ~np.isnan(border))
    with_border = np.concatenate([with_border, more])
    leading = np.random.default_rng(0).permutation(ny)
    slip = np.zeros(ny, dtype=np.bool_)
    slip[leading] = slips
    return np.column_stack([border[with_border], with_border]), last, slip, leading


def widths_of(
    rows: dict[str, np.ndarray], aspect: float, bow: float, turns: np.ndarray | None = None, unlike: float = 0.0
) -> np.ndarray | None:
    """What the kernel finds."""
    borders, last, slip, leading = numbered(rows)
    widths = np.zeros(last.size)
    of_rows = borders, last, rows["length"], rows["hidden"], rows["ends"], rows["slopes"], slip, leading
    turns = np.zeros((3, last.size)) if turns is None else turns
    return widths if smooth.slip_widths(*of_rows, aspect, bow, turns, unlike, widths) else None


@pytest.mark.parametrize("seed", range(40))
def test_slip_widths(seed: int) -> None:
    """Against the naive twin: stick zones that tell, and some in parts, or with slip at the leading edge."""
    of_rows = contact(seed)
    rng = np.random.default_rng(seed)
    stuck = np.flatnonzero(of_rows["length"])
    if seed % 8 == 5:
        of_rows["length"][rng.choice(stuck)] = 0.0
    if seed % 8 == 6:
        of_rows["leading_slips"][rng.choice(stuck)] = True
    if seed % 8 == 4:
        of_rows["in_parts"][rng.choice(stuck)] = True
    if seed % 8 == 7:
        of_rows["length"] *= 1.9 / of_rows["length"].max()
    aspect, bow = rng.uniform(0.5, 2.0), rng.uniform(-0.02, 0.02)
    angle = rng.uniform(0.0, 7.0, of_rows["slopes"].size)
    turns = np.array([np.cos(angle), np.sin(angle), rng.uniform(0.0, 1.5, angle.size)])
    corrections = aspect, bow, turns, rng.uniform(0.0, 0.7)
    expected, found = naive_rows.slip_widths(*of_rows.values(), *corrections), widths_of(of_rows, *corrections)
    assert (found is None) == (expected is None)
    if expected is not None:
        np.testing.assert_allclose(found, expected, atol=1e-8)


def test_stick_range() -> None:
    """Rows of chords of more than three cells, in one piece, five at least, one of two cells, to the leading edge."""
    length, leading = np.array([0.5, 1.0, 2.0, 1.0, 1.0, 1.0, 0.0]), np.array([3, 2, 1, 0, 6, 5, 4])
    ends, slip = np.stack([np.zeros(7), np.full(7, 5.0)]), np.zeros(7, dtype=np.bool_)
    assert smooth.stick_range(length, ends, slip, leading) == (0, 5)
    ends[1, 0] = 2.9
    assert smooth.stick_range(length, ends, slip, leading) == (1, 5)
    ends[1, 5] = np.nan
    assert smooth.stick_range(length, ends, slip, leading) == (0, -1)  # four rows
    ends[1] = 5.0
    assert smooth.stick_range(0.9 * length, ends, slip, leading) == (0, -1)
    slip[leading[4]] = True
    assert smooth.stick_range(length, ends, slip, leading) == (0, -1)
    slip[:] = False
    length[6], length[5] = 1.0, 0.0
    assert smooth.stick_range(length, ends, slip, leading) == (0, -1)  # in parts


def test_no_row_of_a_stick_zone_that_tells_is_in_parts() -> None:
    """The outermost ones are not either, although little of their width is taken."""
    of_rows = contact(0)
    stuck = np.flatnonzero((of_rows["length"] > 0.0) & (of_rows["ends"][1] - of_rows["ends"][0] > 3.0))
    assert widths_of(of_rows, 1.0, 0.0) is not None
    for j in stuck[[0, 2, -1]]:
        of_rows["in_parts"][:] = np.arange(of_rows["length"].size) == j
        assert widths_of(of_rows, 1.0, 0.0) is None


def test_most_of_these_stick_zones_tell() -> None:
    told = [widths_of(contact(seed), 1.0, 0.0) is not None for seed in range(40)]
    assert sum(told) >= 20


def test_a_bad_outermost_row_hardly_counts() -> None:
    """A row of few stick cells whose border is half a cell off moves its width by a fifth of that at most."""
    rows = contact(3)
    low = int(np.flatnonzero((rows["length"] > 0.0) & (np.nan_to_num(rows["ends"][1] - rows["ends"][0]) > 3.0))[0])
    rows["border"][low], rows["length"][low] = rows["ends"][0, low] + 2.0, 0.8
    before = widths_of(rows, 1.0, 0.0)
    rows["border"][low] += 0.5
    after = widths_of(rows, 1.0, 0.0)
    assert before is not None
    assert after is not None
    assert 0.0 < after[low] - before[low] < 0.1


def test_outermost() -> None:
    assert smooth.outermost(np.array([0.0, 0.0, 2.0, 0.0, 3.0, 0.0])) == (2, 4)
    assert smooth.outermost(np.array([1.0, 2.0])) == (0, 1)
    assert smooth.outermost(np.array([0.0, 1.0, 0.0])) == (1, 1)


@pytest.mark.parametrize("width", [0.3, 2.0, 7.0])
def test_area_of_slip_in_strips(width: float) -> None:
    """As much of each row of an elliptic contact slips, as far as it has it (Haines and Ollerton, 1963).

    Widths of rows beyond the contact mean nothing.
    """
    half, y = 9.4, np.arange(21.0) - 0.2
    inside = np.abs(y - 10.0) < half
    chords = np.where(inside, 14.0 * np.sqrt(np.maximum(1.0 - ((y - 10.0) / half) ** 2, 0.0)), 0.0)
    tips = np.array([10.0 - half, 10.0 + half]) + 0.2
    edge = half * math.sqrt(1.0 - (width / 14.0) ** 2)  # rows farther out have less
    angle = math.acos(edge / half)
    expected = 2.0 * (width * edge + 14.0 * half * 0.5 * (angle - math.sin(angle) * math.cos(angle)))
    found = smooth.area_of_slip(chords, tips, np.where(inside, width, 99.0))
    assert found == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("seed", range(6))
def test_area_of_slip(seed: int) -> None:
    """Any widths, in a contact with tips close to its outermost rows and far from them."""
    rng = np.random.default_rng(seed)
    chords = np.zeros(14)
    chords[2:12] = np.sort(rng.uniform(2.0, 6.0, 10))[[0, 2, 4, 6, 8, 9, 7, 5, 3, 1]]
    tips = np.array([1.0 + rng.uniform(0.1, 1.4), 12.0 - rng.uniform(0.1, 1.4)])
    widths = rng.uniform(0.0, 4.0, 14)
    found = smooth.area_of_slip(chords, tips, widths)
    assert found == pytest.approx(naive_rows.slipping(chords, tips, widths), rel=2e-3)


def test_shorten_tips() -> None:
    """As much of an outermost row slips as of the one beside it, be there a stick zone or not; no row gains."""
    chords = np.array([0.0, 2.0, 5.0, 6.0, 5.0, 3.0, 0.0])
    length = np.array([0.0, 1.7, 3.5, 4.5, 4.0, 1.0, 0.0])
    smooth.shorten_tips(length, chords)
    np.testing.assert_allclose(length, [0.0, 0.5, 3.5, 4.5, 4.0, 1.0, 0.0], atol=1e-15)
    length = np.array([0.0, 1.7, 1.0, 0.0, 4.0, 2.5, 0.0])
    smooth.shorten_tips(length, chords)
    np.testing.assert_allclose(length, [0.0, 0.0, 1.0, 0.0, 4.0, 2.0, 0.0], atol=1e-15)
    two = np.array([0.0, 1.5, 1.2, 0.0])
    smooth.shorten_tips(two, np.array([0.0, 2.0, 3.0, 0.0]))
    np.testing.assert_array_equal(two, [0.0, 1.5, 1.2, 0.0])


@pytest.mark.parametrize("seed", [0, 5, 7, 9])
def test_area_behind(seed: int) -> None:
    """Of the widths above, where these follow from the stick zone."""
    of_rows = contact(seed)
    if seed == 7:
        of_rows["length"] *= 1.9 / of_rows["length"].max()
    ends, slopes = of_rows["ends"], of_rows["slopes"]
    chords, tips = np.nan_to_num(ends[1] - ends[0]), np.array([0.3, slopes.size - 1.3])
    borders, last, slip, leading = numbered(of_rows)
    # rows of a single cell
    q, index, count = np.random.default_rng(seed).normal(size=(slip.size, 2)), leading[None], np.ones_like(leading)
    of_rows_ = borders, last, of_rows["length"], of_rows["hidden"], ends, slopes, chords, tips
    found, area = smooth.area_behind(*of_rows_, q, slip, index, count, 0.8, 0.01, 0.4)
    turns = np.array([naive_rows.turns_behind("s" if slip[m] else "-", q[[m]]) for m in leading]).T
    expected = naive_rows.slip_widths(*of_rows.values(), 0.8, 0.01, turns, 0.4)
    if seed == 7:
        assert expected is None
        assert (found, area) == (False, 0.0)
    else:
        assert expected is not None
        assert found
        assert area == pytest.approx(naive_rows.slipping(chords, tips, expected), rel=2e-3)
