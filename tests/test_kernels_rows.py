"""Compiled kernels of rows that begin where the contact begins, against naive twins and what is known exactly.

As `test_kernels.py`, whose rules they keep; the twins stand in `naive_rows.py`. Positions are in cells.
"""

from __future__ import annotations

import math

import naive_rows
import numpy as np
import pytest
from scipy.integrate import quad

from rcstudy.mechanics.half_line import HALF_SPACE, HalfLine
from rcstudy.mechanics.kernels import arrays, centring, row_cells, row_fields, rows, tractions
from rcstudy.mechanics.subcell.moved_rows import RowTable

LINE = HalfLine(-0.3, -0.1, 0.7, -0.12, 0.01)  # something like a soft layer's
LINES = LINE, HALF_SPACE


# --- roots ---


@pytest.mark.parametrize("bend", [-1.3, -0.4, 0.0, 1e-18, 0.2, 3.0])
@pytest.mark.parametrize("slope", [-2.0, -0.5, 0.0, 0.7])
def test_to_root_and_to_edge(slope: float, bend: float) -> None:
    """One root, two of them, roots behind, none."""
    for v0 in (0.02, 0.3, 2.0):
        expected = naive_rows.first_root(v0, slope, bend)
        assert rows.to_root(v0, slope, bend) == pytest.approx(expected, rel=1e-12)
        assert rows.to_edge(v0, slope, bend) == pytest.approx(min(expected, 1.0), rel=1e-12)


def test_to_root_where_the_parabola_only_touches_zero() -> None:
    assert rows.to_root(1.0, -2.0, 1.0) == 1.0
    assert rows.to_root(1.0, 2.0, 1.0) == naive_rows.NEVER
    assert rows.to_root(1.0, 0.0, 0.0) == naive_rows.NEVER


# --- edges ---


def found_edges(p: np.ndarray, line: HalfLine = LINE) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First and last cells and edges as the kernel finds them."""
    ny = p.shape[1]
    low, high, edges = np.full(ny, -7), np.full(ny, -7), np.full((2, ny), np.nan)
    rows.row_edges(p, line, low, high, edges)
    return low, high, edges


def ellipse(shape: tuple[int, int], centre: tuple[float, float], axes: tuple[float, float]) -> np.ndarray:
    """1 - (x/a)^2 - (y/b)^2 at the centres of cells: the square of Hertz's pressure, less than nothing outside."""
    i, j = np.indices(shape)
    return 1.0 - ((i - centre[0]) / axes[0]) ** 2 - ((j - centre[1]) / axes[1]) ** 2


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("line", [HALF_SPACE, LINE], ids=["half-space", "layer"])
def test_rows_of_pressures_that_half_lines_have(line: HalfLine, seed: int) -> None:
    """Coefficients of powers of 1 - z over those of B+ (`half_line.py`): the edge is where they come from, exactly.

    Its place e and the two factors of the continuous pressure; so far there is no third term.
    """
    rng = np.random.default_rng(seed)
    e, root, bend = rng.uniform(0.0, 1.0), rng.uniform(0.5, 2.0), rng.uniform(0.0, 0.3)
    alpha = root + bend * e - 1.5 * bend
    sources = [naive_rows.point_sources(power) for power in (2.5, 1.5, 0.5)]
    beta = root * e + 0.5 * bend * e * e - bend - alpha
    three = np.zeros(3)
    for factor, coefficients in zip((bend, alpha, beta), sources, strict=True):
        three += factor * coefficients
    # freed of B+ again, term by term
    p0 = three[0]
    p1 = three[1] - line.b1 * p0
    p2 = three[2] - line.b1 * p1 - line.b2 * p0
    assert rows.beyond_centre((p0, p1, p2), line) == pytest.approx(line.shift + e, abs=1e-12)
    p = np.array([[0.0], [p0], [p1], [p2], [p2], [0.0]])
    _, _, edges = found_edges(p, line)
    assert edges[0, 0] == pytest.approx(1.0 - line.shift - e, abs=1e-12)
    found = rows.pressure_at_second_centre((p0, p1, p2), line.shift + e, line, HALF_SPACE)
    at = [
        (root * math.sqrt(x) / math.gamma(1.5) + bend * x**1.5 / math.gamma(2.5)) / HALF_SPACE.total if x > 0.0 else 0.0
        for x in (line.shift + e, line.shift + e + 1.0)
    ]
    assert found == pytest.approx(at[1] - (line.b1 - HALF_SPACE.b1) * at[0], rel=1e-12)


@pytest.mark.parametrize("seed", range(40))
def test_rise_and_bends_and_what_follows(seed: int) -> None:
    """Against the twin: of pressures like a contact's there is a third term, of others none."""
    rng = np.random.default_rng(seed)
    three = np.sqrt(np.arange(3.0) + rng.uniform(0.05, 1.0)) * rng.uniform(0.9, 1.1, size=3)
    if seed % 2:
        three = rng.uniform(0.1, 2.0, size=3)
    found = rows.edge_coefficients(tuple(three), LINE)
    np.testing.assert_allclose(found, naive_rows.of_three(three, LINE), atol=1e-12)
    expected = naive_rows.outwards(three**2, 0.0, LINE)
    assert rows.beyond_centre(tuple(three), LINE) == pytest.approx(expected, abs=1e-9)
    second = naive_rows.second_pressure(three, 0.4, LINE, HALF_SPACE)
    assert rows.pressure_at_second_centre(tuple(three), 0.4, LINE, HALF_SPACE) == pytest.approx(second, rel=1e-10)


@pytest.mark.parametrize(
    ("centre", "axes", "lengths"),
    [
        ((6.8, 5.6), (2.7, 4.8), {0, 1, 2, 3, 4, 5}),
        ((5.9, 4.6), (2.6, 3.7), {0, 1, 2, 3, 4, 5}),
        ((6.0, 5.0), (4.4, 4.1), {0, 1, 5, 7, 9}),
        ((6.5, 5.3), (4.6, 4.35), {0, 2, 4, 6, 8, 10}),
        ((6.3, 4.7), (5.1, 0.6), {0, 9}),
    ],
)
def test_row_edges_of_a_paraboloid(centre: tuple[float, float], axes: tuple[float, float], lengths: set[int]) -> None:
    """Edges of p^2 = 1 - (x/a)^2 - (y/b)^2 are exact in rows of two cells, a longer row being there.

    One cell does not tell where in it the row's middle is: its centre is taken, which is right in the third case. Three
    and more are taken for what cells make of an edge, which this is not.
    """
    square = ellipse((14, 11), centre, axes)
    p = np.sqrt(np.maximum(square, 0.0))
    low, high, edges = found_edges(p)
    counts = (p > 0.0).sum(axis=0)
    assert set(counts.tolist()) == lengths
    for j, count in enumerate(counts):
        if count == 0:
            assert high[j] < low[j]
            continue
        assert (low[j], high[j]) == (np.flatnonzero(p[:, j])[0], np.flatnonzero(p[:, j])[-1])
        if count > 2:
            continue
        if count == 2:
            middle, half = centre[0], axes[0] * math.sqrt(1.0 - ((j - centre[1]) / axes[1]) ** 2)
        else:
            middle, half = float(low[j]), min(1.0, axes[0] * p[low[j], j])
        np.testing.assert_allclose(edges[:, j], [middle - half, middle + half], atol=1e-9)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("shape", [(1, 1), (1, 5), (2, 4), (3, 3), (9, 8), (12, 5)])
def test_row_edges(shape: tuple[int, int], seed: int) -> None:
    """Against the twin: contacts that need not be ellipses, reach the box's sides or leave rows out."""
    rng = np.random.default_rng([*shape, seed])
    middle = [n / 2.0 + rng.uniform(-1.0, 0.0) for n in shape]
    square = ellipse(shape, (middle[0], middle[1]), (0.3 + rng.uniform(0.1, 0.8) * shape[0], rng.uniform(0.6, 6.0)))
    p = np.sqrt(np.maximum(square, 0.0)) * rng.uniform(0.9, 1.1, size=shape)
    p[round(middle[0]), round(middle[1])] = 1.2
    if seed % 3 == 0:
        p[:, rng.integers(shape[1])] = 0.0
        p[0, 0] = 0.4
    low, high, edges = found_edges(p)
    expected = naive_rows.edges(p, LINE)
    for j in range(shape[1]):
        assert (high[j] >= low[j]) == (j in expected)
        if j in expected:
            np.testing.assert_allclose(edges[:, j], expected[j], atol=1e-9)


def test_short_rows_are_straight_beside_one_whose_pressure_is_least_in_the_middle() -> None:
    """p^2 of a parabola that opens upwards never comes to zero; that of two cells, 0.2 and 1, does a quarter ahead."""
    p = np.sqrt(np.array([[1.0, 0.0], [0.7, 0.2], [0.6, 1.0], [0.7, 0.0], [1.0, 0.0]]))
    _, _, edges = found_edges(p)
    np.testing.assert_allclose(edges[:, 1], [1.0 - 0.25, 2.0 + 1.0], atol=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_row_edges_of_what_is_mirrored(seed: int) -> None:
    """Along either axis; of an even number of cells, and of rows as long as each other, neither is the first."""
    rng = np.random.default_rng(seed)
    p = np.where(ellipse((8, 6), (3.5, 2.5), (2.2 + 0.3 * seed, 3.2)) > 0.0, rng.uniform(0.2, 1.0, size=(8, 6)), 0.0)
    low, high, edges = found_edges(p)
    touched = high >= low
    _, _, along = found_edges(np.ascontiguousarray(p[::-1]))
    np.testing.assert_allclose((7.0 - along[::-1])[:, touched], edges[:, touched], atol=1e-12)
    _, _, across = found_edges(np.ascontiguousarray(p[:, ::-1]))
    np.testing.assert_allclose(across[:, ::-1][:, touched], edges[:, touched], atol=1e-12)


# --- cells of moved rows ---


def numbered(leading: np.ndarray, count: np.ndarray, nx: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which cells are held [nx, ny], their indices [m, 2] and numbers [max count, ny] as the kernel finds them."""
    held, of_cells = np.ones((nx, count.size), dtype=np.bool_), np.full((count.sum(), 2), -7)
    index = np.full((count.max(), count.size), -7)
    row_cells.number_cells(leading, count, held, of_cells, index)
    return held, of_cells, index


@pytest.mark.parametrize("seed", range(6))
def test_number_cells_and_row_neighbours(seed: int) -> None:
    """Each cell has the number that its place in the order has; neighbours are one cell on along the row."""
    rng = np.random.default_rng(seed)
    nx, ny = 9, 6
    count = rng.integers(0, 6, size=ny)
    count[seed % ny] = 0
    count[(seed + 2) % ny] = 4
    leading = rng.integers(count.max() - 1, nx, size=ny)
    held, of_cells, index = numbered(leading, count, nx)
    places = sorted((leading[j] - k, j) for j in range(ny) for k in range(count[j]))
    assert [tuple(c) for c in of_cells] == places
    assert set(zip(*np.nonzero(held), strict=True)) == set(places)
    for j in range(ny):
        assert index[:, j].tolist() == [
            places.index((leading[j] - k, j)) if k < count[j] else -1 for k in range(count.max())
        ]
    neighbours = np.full((2, len(places)), -7)
    row_cells.row_neighbours(index, neighbours)
    for m, (i, j) in enumerate(places):
        for side, other in enumerate(((i + 1, j), (i - 1, j))):
            assert neighbours[side, m] == (places.index(other) if other in places else m)


def test_correct_leading_cells() -> None:
    """By the normal of the edge, n: n_x n times part p; other cells keep theirs."""
    count, leading = np.array([0, 2, 3, 1, 2, 0, 1]), np.array([0, 4, 5, 3, 4, 0, 4])
    _, of_cells, index = numbered(leading, count, 6)
    front = np.array([0.0, 4.3, 5.1, 3.2, 4.9, 0.0, 4.4])
    rng = np.random.default_rng(4)
    pressure, before = rng.uniform(1.0, 2.0, size=len(of_cells)), rng.normal(size=(len(of_cells), 2))
    s = before.copy()
    normals = np.full((2, 7), np.nan)
    row_cells.edge_normals(front, index, 0.8, normals)
    row_cells.correct_leading_cells(normals, index, pressure, 0.3, s)
    slopes = {1: front[2] - front[1], 2: (front[3] - front[1]) / 2, 3: (front[4] - front[2]) / 2}
    slopes |= {4: front[4] - front[3], 6: 0.0}  # a row alone shows no direction
    for m, (i, j) in enumerate(of_cells):
        less = np.zeros(2)
        if i == leading[j]:
            angle = -math.atan(0.8 * slopes[j])
            less = 0.3 * pressure[m] * math.cos(angle) * np.array([math.cos(angle), math.sin(angle)])
        np.testing.assert_allclose(s[m], before[m] - less, atol=1e-14)
    np.testing.assert_allclose(np.hypot(*normals), 1.0, rtol=1e-15)
    np.testing.assert_array_equal(normals[:, [0, 5, 6]].T, [[1.0, 0.0]] * 3)  # no cells, or a row alone


def test_the_very_first_cell_may_be_a_leading_one() -> None:
    """Cells are numbered from the back, so that cell 0 leads a row of one cell behind all others."""
    _, _, index = numbered(np.array([2, 3]), np.array([1, 1]), 5)
    s = np.ones((2, 2))
    row_cells.correct_leading_cells(np.array([[1.0, 0.6], [0.0, 0.8]]), index, np.array([2.0, 1.0]), 0.3, s)
    np.testing.assert_allclose(s, [[1.0 - 0.6, 1.0], [1.0 - 0.3 * 0.36, 1.0 - 0.3 * 0.48]], atol=1e-15)


def test_normals_of_edges_in_a_contact_that_reaches_both_sides_of_the_window() -> None:
    """The outermost rows have one neighbour each: the row at the other side of the window is none."""
    front = np.array([4.0, 4.6, 4.9, 3.7])
    slopes = 0.8 * np.array([0.6, 0.45, -0.45, -1.2])
    for numbers in ([0, 1, 2, 3], [3, 2, 1, 0], [2, 0, 1, 3]):  # cell 0 is as good as any
        normals = np.full((2, 4), np.nan)
        row_cells.edge_normals(front, np.array([numbers]), 0.8, normals)
        np.testing.assert_allclose(normals, np.array([np.ones(4), -slopes]) / np.sqrt(1.0 + slopes**2), rtol=1e-14)


# --- moments ---


def test_resultant() -> None:
    """Row by row, cell by cell, as the formula has it; to stick cells' neighbours it is as if these were not there.

    One cell slips alone between two that stick, and has more behind it.
    """
    rng = np.random.default_rng(12)
    count, start, dx = np.array([1, 5, 0, 2, 6, 4]), np.array([4.3, 6.2, 0.0, 4.8, 8.1, 7.4]), 0.3
    _, of_cells, index = numbered(np.rint(start).astype(np.int64), count, 9)
    m = len(of_cells)
    slip = np.ones(m, dtype=np.bool_)
    slip[index[[0, 2], 4]] = slip[index[2, 5]] = False
    q, bound, y = rng.normal(size=(m, 2)), rng.uniform(0.5, 2.0, size=m), rng.normal(size=m)
    centres = of_cells[:, 0] * dx - 1.1
    levers = centres + rng.uniform(-0.1, 0.1, size=m)
    edges = np.array([start - count + 1 - rng.uniform(0.1, 1.0, size=6), start + rng.uniform(0.4, 0.8, size=6)])
    n = q[:, 1] / bound
    expected = np.array([q[:, 0].sum(), q[:, 1].sum(), (levers * q[:, 1] - y * q[:, 0]).sum()])
    for j in range(6):
        for k in range(count[j]):
            here = index[k, j]
            sides = [index[i, j] for i in (k - 1, k + 1) if 0 <= i < count[j] and slip[index[i, j]]]
            if not slip[here] or not sides:
                continue
            line = np.polynomial.Polynomial.fit(centres[[here, *sides]], n[[here, *sides]], len(sides))
            slope, bend = line.deriv(1)(centres[here]), line.deriv(2)(centres[here])
            spread = dx * dx / 12.0
            if k == 0:
                spread = 12.0 / 175.0 * (dx * (edges[1, j] - (start[j] - 0.5))) ** 2
            elif k == count[j] - 1:
                spread = 12.0 / 175.0 * (dx * (start[j] - k + 0.5 - edges[0, j])) ** 2
            off = levers[here] - centres[here]
            turning = slope * (centres[here] * off + spread + off**2) + 0.5 * bend * levers[here] * spread
            expected[2] += bound[here] * turning
    found = row_cells.resultant(q, slip, bound, centres, levers, y, RowTable(index, start, count, edges), dx)
    np.testing.assert_allclose(found, expected, rtol=1e-10)


@pytest.mark.parametrize("n", [6, 7, 12, 13])
@pytest.mark.parametrize("last", [0.6, 1.0, 1.4])
def test_resultant_of_a_root(n: int, last: float) -> None:
    """A row with p = sqrt(1 - x^2) and a direction like x: int x^2 p is pi/8; 0.1 to 0.4 h^2.5 less if still."""
    first = 1.25
    dx = 2.0 / (n - 2 + first + last)
    borders = np.array([1.0, *(1.0 - dx * (first + np.arange(n - 1))), -1.0])
    mass, moment = 0.5 * (borders * np.sqrt(1.0 - borders**2) + np.arcsin(borders)), -((1.0 - borders**2) ** 1.5) / 3.0
    centres, bound = borders[1] + dx * (0.5 - np.arange(n)), -np.diff(mass) / dx
    levers, index, slip = np.diff(moment) / np.diff(mass), np.arange(n)[:, None], np.ones(n, dtype=np.bool_)
    q = np.stack([np.zeros(n), centres * bound], axis=1)
    start = np.array([centres[0] / dx])
    table = RowTable(index, start, np.array([n]), np.array([[-1.0 / dx], [1.0 / dx]]))
    of_row = centres, levers, np.zeros(n), table, dx
    still = row_cells.resultant(q, np.zeros(n, dtype=np.bool_), bound, *of_row)[2] * dx
    assert np.pi / 8.0 - still > 0.09 * dx**2.5
    assert abs(row_cells.resultant(q, slip, bound, *of_row)[2] * dx - np.pi / 8.0) < 0.0015 * dx**2.5


# --- bounds ---


@pytest.mark.parametrize("count", [(0, 3, 4, 2, 0), (1, 2, 0, 3, 1), (0, 0, 2, 0, 0), (2, 2, 2, 2, 2)])
def test_row_forces(count: tuple[int, ...]) -> None:
    """Neighbours that both have cells even out a part of what they differ by; all that is carried stays."""
    p = np.random.default_rng(sum(count)).random((4, 5)) * (np.array(count) > 0)
    expected = p.sum(axis=0)
    for j in range(4):
        if count[j] and count[j + 1]:
            given = 0.1 * (p[:, j].sum() - p[:, j + 1].sum())
            expected[j] -= given
            expected[j + 1] += given
    found = np.full(5, np.nan)
    row_cells.row_forces(p, np.array(count), 0.1, found)
    np.testing.assert_allclose(found, expected, atol=1e-14)
    assert found.sum() == pytest.approx(p.sum(), rel=1e-14)


@pytest.mark.parametrize("v", [(0.0, 2.0), (2.0, 0.0), (1.0, 1.0), (0.3, 5.0), (0.0, 0.0)])
def test_piece(v: tuple[float, float]) -> None:
    expected = quad(lambda t: math.sqrt(v[0] + (v[1] - v[0]) * t / 0.7), 0.0, 0.7, epsabs=1e-12)[0]
    assert rows.piece(*v, 0.7) == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize("v", [(0.0, 2.0), (2.0, 0.0), (1.0, 1.0), (0.3, 5.0), (0.0, 0.0)])
def test_piece_moment(v: tuple[float, float]) -> None:
    expected = quad(lambda t: t * math.sqrt(v[0] + (v[1] - v[0]) * t / 0.7), 0.0, 0.7, epsabs=1e-12)[0]
    assert rows.piece_moment(*v, 0.7) == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize(("cells", "back", "front"), [(4, 0.3, 0.6), (6, 0.5, 0.7), (9, -0.1, 0.4), (9, 0.2, -0.12)])
def test_row_profile(cells: int, back: float, front: float) -> None:
    """Straight of few cells; of more by parabolas, also where an outermost centre is beyond the edge."""
    p = np.zeros(14)
    p[3 : 3 + cells] = np.random.default_rng(cells).uniform(0.5, 1.5, size=cells)
    edges = np.array([3.0 - back, 2.0 + cells + front])
    knots, squares = np.full((2, 31), np.nan)
    n = rows.row_profile(p, np.array([3, 2 + cells]), edges, LINE, HALF_SPACE, knots, squares)
    expected_knots, expected_squares = naive_rows.profile(p, *edges, *LINES)
    np.testing.assert_allclose(knots[:n], expected_knots, atol=1e-14)
    np.testing.assert_allclose(squares[:n], expected_squares, atol=1e-12)
    assert np.isnan(knots[n:]).all()


@pytest.mark.heavy
def test_row_bounds_are_above_nothing() -> None:
    """Whatever the pressures are: where parabolas fall below nothing, too."""
    rng = np.random.default_rng(8)
    for _ in range(200):
        p = np.zeros((14, 1))
        p[2:12, 0] = 10.0 ** rng.uniform(-3.0, 0.0, size=10)
        edges = np.array([[rng.uniform(1.2, 2.14)], [rng.uniform(10.86, 11.8)]])
        start = edges[1] - 0.748
        assert (found_bounds(p, edges, start, np.ceil(start - edges[0]).astype(np.int64)) > 0.0).all()


def found_profiles(
    p: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    edges: np.ndarray,
    lines: tuple[HalfLine, HalfLine] = LINES,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Knots, squares and their number of each row as the kernel finds them, none where there is no cell."""
    knots, squares = np.full((2, p.shape[1], 2 * p.shape[0] + 3), np.nan)
    known = np.full(p.shape[1], -1)
    rows.row_profiles(p, low, high, edges, *lines, (knots, squares, known))
    for j in range(p.shape[1]):
        assert np.isnan(knots[j, known[j] :]).all()
        assert (known[j] > 0) == p[:, j].any()
        if known[j]:
            expected = naive_rows.profile(p[:, j], *edges[:, j], *lines)
            np.testing.assert_allclose([knots[j, : known[j]], squares[j, : known[j]]], expected, atol=1e-12)
    return knots, squares, known


def found_bounds(
    p: np.ndarray, edges: np.ndarray, start: np.ndarray, count: np.ndarray, lines: tuple[HalfLine, HalfLine] = LINES
) -> np.ndarray:
    """Bounds [max count, ny] as the kernel finds them, none where there is no cell; cells are numbered row by row."""
    inside = [np.flatnonzero(row) if row.any() else np.array([len(row), -1]) for row in p.T]
    low, high = np.array([row[0] for row in inside]), np.array([row[-1] for row in inside])
    numbers = np.arange(count.sum())
    taken = np.arange(count.max())[:, None] < count
    index = np.full(taken.shape, -1)
    index.T[taken.T] = numbers[::-1]
    found = np.full((3, numbers.size), np.nan)
    table = RowTable(index, start, count, edges)
    rows.row_pressures(p.sum(axis=0), found_profiles(p, low, high, edges, lines), table, *found)
    assert not np.isnan(found).any()
    out, middle, weighted = np.full((3, *taken.shape), np.nan)
    out[taken], middle[taken], weighted[taken] = found[:, index[taken]]
    for j in range(p.shape[1]):
        n = count[j]
        if n:
            _, expected, mean = naive_rows.bounds(p[:, j], edges[:, j], lines, start[j], n)
            np.testing.assert_allclose(middle[:n, j], expected, atol=1e-7)
            np.testing.assert_allclose(weighted[:n, j], mean, rtol=1e-6)
    return out


@pytest.mark.parametrize("ahead", [0.1, 0.5, 0.82535, 1.0])
def test_row_bounds(ahead: float) -> None:
    """By quadrature; rows of one to many cells and an empty one, which is left alone."""
    rng = np.random.default_rng(3)
    square = ellipse((16, 9), (7.3, 3.6), (6.4, 3.9))
    p = np.sqrt(np.maximum(square, 0.0)) * rng.uniform(0.8, 1.2, size=square.shape)
    p[:, [1, 3, 8]] = 0.0
    p[7, 8], p[5:7, 1] = 0.3, (0.7, 0.6)
    edges, start, count = np.full((2, 9), np.nan), np.zeros(9), np.zeros(9, dtype=np.int64)
    for j in np.flatnonzero(p.any(axis=0)):
        cells = np.flatnonzero(p[:, j])
        edges[:, j] = cells[0] - rng.uniform(0.6 if j == 1 else 0.05, 0.9), cells[-1] + rng.uniform(0.45, 0.9)
        if j == 4:  # within the outermost cells' centres
            edges[:, j] = cells[0] + 0.1, cells[-1] - 0.12
        start[j] = max(edges[1, j] - ahead, edges[:, j].mean())
        count[j] = max(1, math.ceil(start[j] - edges[0, j]))
    out = found_bounds(p, edges, start, count)
    assert ahead < 0.5 or {0, 1, 2} < set(count.tolist())
    for j in range(9):
        n = count[j]
        assert np.isnan(out[n:, j]).all()
        if n:
            expected, *_ = naive_rows.bounds(p[:, j], edges[:, j], LINES, start[j], n)
            np.testing.assert_allclose(out[:n, j], expected, rtol=1e-8)
            assert out[:n, j].sum() == pytest.approx(p[:, j].sum(), rel=1e-14)


def test_row_bounds_when_the_edge_is_within_the_outermost_cells() -> None:
    """Short of their centres, as the table has it: the force is kept, every cell has a bound, and much the same one."""
    p = np.sqrt(np.maximum(ellipse((12, 1), (5.5, 0.0), (5.02, 1.0)), 0.0))
    start, count = np.array([9.9 - 0.82535]), np.array([9])
    lines = HALF_SPACE, HALF_SPACE
    within = found_bounds(p, np.array([[1.1], [9.9]]), start, count, lines)[:, 0]
    at = found_bounds(p, np.array([[0.98], [10.02]]), start, count, lines)[:, 0]
    assert within.sum() == pytest.approx(p.sum(), rel=1e-14)
    assert (within > 0.0).all()
    np.testing.assert_allclose(within, at, atol=0.08)


@pytest.mark.parametrize("ahead", [-1.7, -0.6, -0.2, 0.3])
def test_row_bounds_of_rows_that_stay(ahead: float) -> None:
    """Cells that begin ahead of the contact, or end behind it, carry nothing; all the others, as ever, everything."""
    p = np.sqrt(np.maximum(ellipse((18, 1), (8.5, 0.0), (5.3, 1.0)), 0.0))
    edges = np.array([[3.2], [13.8]])
    start, count = np.array([edges[1, 0] - ahead]), np.array([14])
    inside = np.flatnonzero(p[:, 0])
    found, index = np.full((3, 14), np.nan), np.arange(14)[:, None]
    profiles = found_profiles(p, inside[:1], inside[-1:], edges)
    rows.row_pressures(p.sum(axis=0), profiles, RowTable(index, start, count, edges), *found)
    assert np.isfinite(found).all()
    pressure, middle, weighted = found
    assert pressure.sum() == pytest.approx(p.sum(), rel=1e-14)
    centres_ = start[0] - np.arange(14)
    empty = (centres_ - 0.5 >= edges[1, 0]) | (centres_ + 0.5 <= edges[0, 0])
    assert empty.any() and not empty.all()
    assert (pressure[empty] == 0.0).all() and (pressure[~empty] > 0.0).all()
    assert (weighted[empty] == 0.0).all() and (weighted[~empty] > 0.0).all()
    assert (np.abs(middle - centres_)[~empty] < 1.01).all()
    np.testing.assert_array_equal(middle[empty], centres_[empty])


def test_row_bounds_of_a_row_whose_only_cell_is_ahead_of_the_contact() -> None:
    """It carries what lies beyond it: all of the row."""
    p, found = np.array([[0.0], [0.7], [0.0]]), np.full((3, 1), np.nan)
    one, edges = np.array([1]), np.array([[0.6], [1.4]])
    profiles = found_profiles(p, one, one, edges)
    table = RowTable(np.zeros((1, 1), dtype=np.int64), np.array([2.3]), one, edges)
    rows.row_pressures(p.sum(axis=0), profiles, table, *found)
    assert found[:2, 0] == pytest.approx([0.7, 1.0], rel=1e-12)


def test_row_bounds_of_a_row_all_of_which_is_in_the_last_cell() -> None:
    """The cell before begins where the contact ends, or ahead of that: it carries nothing."""
    p, index = np.array([[0.0], [0.7], [0.0]]), np.array([[0], [1]])
    one, two, edges = np.array([1]), np.array([2]), np.array([[0.6], [1.4]])
    profiles = found_profiles(p, one, one, edges)
    for start in (1.9, 2.3):
        found = np.full((3, 2), np.nan)
        rows.row_pressures(p.sum(axis=0), profiles, RowTable(index, np.array([start]), two, edges), *found)
        np.testing.assert_allclose(found[:2], [[0.0, 0.7], [start, 1.0]], rtol=1e-12)


def test_carry_on() -> None:
    """Against sums over all pairs of cells; rows not taken stay as they are, and a row's only cell holds all of it."""
    rng = np.random.default_rng(11)
    before = rng.random((9, 5))
    p = before + 0.1 * rng.random((9, 5))
    start, count = np.array([6.3, 7.0, 5.6, 6.9, 4.2]), np.array([6, 5, 4, 6, 1])
    taken = np.array([0, 2, 3, 4])
    index = np.full((6, 5), -1)
    numbers = iter(rng.permutation(count.sum()))
    for j, n in enumerate(count):
        index[:n, j] = [next(numbers) for _ in range(n)]
    index_before = np.full((7, 5), -1)
    index_before[:6] = np.where(index >= 0, count.sum() - 1 - index, -1)
    bounds = rng.random(count.sum())
    bounds[index_before[5, 3]] = -0.6  # and what it changes by leaves it below nothing
    out = np.full(count.sum(), np.nan)
    force = p.sum(axis=0) * rng.uniform(0.9, 1.1, size=5)
    table = RowTable(index, start, count, np.zeros((2, 5)))
    rows.update_row_pressures(p, before, force, table, taken, bounds, index_before, out)
    assert np.isnan(out[index[: count[1], 1]]).all()
    for j in taken:
        n = count[j]
        places = start[j] - np.arange(n)
        expected = bounds[index_before[:n, j]].copy()
        for i in range(len(p)):
            nearest = np.clip(i, places[-1], places[0])
            expected += np.maximum(1.0 - np.abs(places - nearest), 0.0) * (p[i, j] - before[i, j])
        expected = np.maximum(expected, 0.0)
        expected *= force[j] / expected.sum()
        np.testing.assert_allclose(out[index[:n, j]], expected, atol=1e-13)
    assert out[index[5, 3]] == 0.0
    assert out[index[0, 4]] == pytest.approx(force[4])


def test_carry_on_rows_of_one_cell() -> None:
    """There is no second cell to share a change with."""
    p, out = np.array([[0.5, 0.0], [0.3, 0.7]]), np.full(2, np.nan)
    index, one = np.array([[0, 1]]), np.ones(2, dtype=np.int64)
    table = RowTable(index, np.array([0.6, 1.0]), one, np.zeros((2, 2)))
    rows.update_row_pressures(p, np.zeros((2, 2)), p.sum(axis=0), table, np.arange(2), np.zeros(2), index, out)
    np.testing.assert_allclose(out, [0.8, 0.7], rtol=1e-14)


# --- between cells ---


def centres(values: np.ndarray, held: np.ndarray, shift: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, ...]:
    """Values and numbers of the closest cell as the kernel finds them."""
    out, nearest = np.full((len(cells), len(values)), np.nan), np.full(len(cells), -7)
    row_fields.to_centres(values, held, shift, cells, out, nearest)
    return out, nearest


SHIFTS = np.array([-0.5, -0.3, 0.0, 0.2, 0.5])


def test_to_centres_of_linear_fields() -> None:
    """Exact between two cells, for each row's own slope; the closest cell is the one less than half a cell away."""
    i, j = np.indices((9, len(SHIFTS)))
    values = np.stack([2.0 + (1.0 + j) * (i + SHIFTS[j]), 1.0 - 3.0 * (i + SHIFTS[j])])
    cells = np.argwhere((i > 0) & (i < 8))
    out, nearest = centres(values, np.ones(i.shape, dtype=np.bool_), SHIFTS, cells)
    x, row = cells.T
    np.testing.assert_allclose(out, np.stack([2.0 + (1.0 + row) * x, 1.0 - 3.0 * x], axis=1), atol=1e-13)
    assert (np.abs(nearest + SHIFTS[row] - x) <= 0.5).all()


@pytest.mark.parametrize("seed", range(10))
def test_to_centres(seed: int) -> None:
    """Both neighbours, one, none, at either side; values of cells that do not count are never seen."""
    rng = np.random.default_rng(seed)
    shape = (7, 12)
    held = rng.random(shape) < (0.15, 0.4, 0.8)[seed % 3]
    held[rng.integers(7), ~held.any(axis=0)] = True
    shift = rng.uniform(-0.5, 0.5, size=12)
    values = np.where(held, rng.normal(size=(3, *shape)), 1e9)
    cells = np.argwhere(np.ones(shape, dtype=bool))
    out, nearest = centres(values, held, shift, cells)
    for m, (i, j) in enumerate(cells):
        expected, closest = naive_rows.at_centre(values[:, :, j], held[:, j], shift[j], i)
        np.testing.assert_allclose(out[m], expected, rtol=1e-12, atol=1e-13)
        assert nearest[m] == closest


@pytest.mark.parametrize(
    ("held", "shift", "i", "closest"),
    [
        ([3, 4], 0.3, 2, 3),  # on the side away from the neighbours, one cell on
        ([3, 4], -0.3, 5, 4),
        ([3, 4], -0.3, 2, 3),
        ([3], 0.3, 0, 3),
        ([0, 5], 0.2, 3, 5),  # 2.2 against 2.8
        ([1, 5], 0.2, 3, 1),  # 1.8 against 2.2
        ([1, 5], -0.2, 3, 5),
    ],
)
def test_to_centres_far_from_any_cell(held: list[int], shift: float, i: int, closest: int) -> None:
    """The closest cell of the row, and not another row's."""
    mask = np.ones((7, 3), dtype=np.bool_)
    mask[:, 1] = False
    mask[held, 1] = True
    values = np.arange(21.0).reshape(1, 7, 3)
    out, nearest = centres(values, mask, np.array([0.0, shift, 0.0]), np.array([[i, 1]]))
    assert nearest == [closest]
    assert out == [[values[0, closest, 1]]]


def test_squares_at_borders() -> None:
    """By the profile of the border's own row, also at an edge and next to it."""
    p = np.sqrt(np.maximum(ellipse((16, 9), (7.3, 3.6), (6.4, 3.9)), 0.0))
    low, high, edges = found_edges(p)
    borders = [(edges[0, j] + part * (edges[1, j] - edges[0, j]), j) for j in (2, 5, 3, 2) for part in (0.0, 0.07, 0.5)]
    found = rows.squares_at_borders(found_profiles(p, low, high, edges), np.array(borders))
    for (x, j), square in zip(borders, found, strict=True):
        places, squares = naive_rows.profile(p[:, j], *edges[:, j], *LINES)
        assert square == pytest.approx(np.interp(x, places, squares), abs=1e-12)


def test_squares_at_borders_beyond_the_edges() -> None:
    """Those at the edges; of a row with one knot, that one."""
    knots, squares = np.array([[1.0, 2.0, 4.0, 99.0], [3.0, 99.0, 99.0, 99.0]]), np.array([[5.0, 7.0, 6.0, 99.0]] * 2)
    borders = np.array([[x, 0.0] for x in (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0)] + [[x, 1.0] for x in (2.0, 3.0, 4.0)])
    found = rows.squares_at_borders((knots, squares, np.array([3, 1])), borders)
    np.testing.assert_array_equal(found, [5.0, 5.0, 6.0, 7.0, 6.5, 6.0, 6.0, 5.0, 5.0, 5.0])


@pytest.mark.parametrize("seed", range(12))
def test_peak_at_borders(seed: int) -> None:
    """None to two borders a row; the rows beside the highest one may have none. A contact's own pressures, or any."""
    rng = np.random.default_rng(seed)
    borders = [(float(x), int(j)) for j in range(12) for x in rng.uniform(0.0, 8.0, size=rng.integers(seed % 2, 3))]
    squares = [max(1.0 - (row - 6.3) ** 2 / 50.0 - (x - 4.0) ** 2 / 90.0, 0.0) for x, row in borders]
    if seed % 3 == 0:
        squares = rng.uniform(size=len(borders)).tolist()
    found = rows.peak_at_borders(np.array(squares), np.array(borders, dtype=float))
    assert found == pytest.approx(naive_rows.peak_at_borders(squares, borders), rel=1e-11)


@pytest.mark.parametrize("seed", range(4))
def test_peak_at_borders_in_any_order(seed: int) -> None:
    """The first one may be the top, or one of two of any row."""
    rng = np.random.default_rng(seed)
    borders = np.stack([rng.uniform(0.0, 8.0, size=18), np.repeat(np.arange(9.0), 2)], axis=1)
    squares = 1.0 - (borders[:, 1] - 4.2 + 0.3 * seed) ** 2 / 30.0 - (borders[:, 0] - 4.0) ** 2 / 90.0
    expected = naive_rows.peak_at_borders(squares.tolist(), [(x, int(j)) for x, j in borders])
    for first in range(18):
        order = np.array([first, *rng.permutation(np.delete(np.arange(18), first))])
        assert rows.peak_at_borders(squares[order], borders[order]) == pytest.approx(expected, rel=1e-11)


def test_largest_pressure_at_borders() -> None:
    """Of a border that runs along y, in a contact whose pressure is largest between rows 3 and 4."""
    p = np.sqrt(np.maximum(ellipse((16, 9), (7.3, 3.6), (6.4, 3.9)), 0.0))
    low, high, edges = found_edges(p)
    borders = np.array([(5.0, j) for j in range(1, 7)])
    found = rows.peak_at_borders(rows.squares_at_borders(found_profiles(p, low, high, edges), borders), borders)
    squares = [np.interp(5.0, *naive_rows.profile(p[:, j], *edges[:, j], *LINES)) for j in range(1, 7)]
    assert found == pytest.approx(naive_rows.peak_at_borders(squares, [(5.0, j) for j in range(1, 7)]), rel=1e-11)
    assert found == pytest.approx(math.sqrt(1.0 - (2.3 / 6.4) ** 2), rel=5e-3)


def test_largest_pressure_at_borders_that_fall_off_steeply() -> None:
    """The parabola through seven rows overshoots there; that through three counts if it is lower by a per cent."""
    borders = np.array([(5.0, j) for j in range(7)])
    for fall, wide in ((0.15, True), (0.25, False)):
        squares = [1.0 - fall, 0.98, 0.99, 1.0, 0.99, 0.98, 1.0 - fall]
        found = rows.peak_at_borders(np.array(squares), borders)
        assert found == pytest.approx(naive_rows.peak_at_borders(squares, [(x, int(j)) for x, j in borders]), rel=1e-11)
        assert (found > 1.0 + 1e-3) == wide


def test_top_of_parabola() -> None:
    """Of a parabola the very top; without one inside, the value in the middle."""
    y = np.array([0.0, -1.0, 1.0, -2.0, 2.0])
    for top in (0.7, -1.6, 1.9, -1.99):
        assert rows.top_of_parabola(y, 3.0 - 0.5 * (y - top) ** 2) == pytest.approx(3.0, rel=1e-12)
    for top in (2.2, -2.01):
        assert rows.top_of_parabola(y, 3.0 - 0.5 * (y - top) ** 2) == pytest.approx(3.0 - 0.5 * top**2, rel=1e-14)
    assert rows.top_of_parabola(y, 1.0 + y**2) == 1.0
    assert rows.top_of_parabola(y, 1.0 + (y - 0.5) ** 2) == 1.25
    assert rows.top_of_parabola(y[:1], np.array([2.0])) == 2.0
    assert rows.top_of_parabola(y, np.full(5, 2.0)) == 2.0  # neither top nor bottom
    assert rows.peak_at_borders(np.zeros(3), np.array([[5.0, 0.0], [5.0, 1.0], [5.0, 2.0]])) == 0.0


def test_on_box() -> None:
    """In the cells' places; others are not touched."""
    rng = np.random.default_rng(5)
    cells = np.array([[0, 1], [1, 0], [2, 3]])
    q, s, bound, slip = rng.normal(size=(3, 2)), rng.normal(size=(3, 2)), rng.uniform(1.0, 2.0, size=3), cells[:, 0] > 0
    values, flags = np.zeros((4, 3, 4)), np.zeros((3, 4), dtype=np.bool_)
    row_fields.on_box(q, s, slip, bound, cells, values, flags)
    expected = np.zeros_like(values)
    expected[:, cells[:, 0], cells[:, 1]] = np.concatenate([q / bound[:, None], s], axis=1).T
    np.testing.assert_array_equal(values, expected)
    assert sorted(zip(*np.nonzero(flags), strict=True)) == [(1, 0), (2, 3)]


def test_by_law() -> None:
    """Slip cells are on the bound and slip against it, stick cells within it and at rest; others are not touched."""
    rng = np.random.default_rng(3)
    cells = np.array([[0, 1], [1, 0], [2, 2], [2, 3]])
    slip, bound = np.array([True, False, False, True]), rng.uniform(0.5, 2.0, size=4)
    found = rng.normal(size=(4, 4))
    found[1, :2], found[2, :2], found[3, :2] = (0.3, -0.4), (3.0, 4.0), 0.0
    out = np.full((4, 6, 7), 7.0)
    row_fields.by_law(found, slip, bound, cells, (2, 1), out)
    at = out[:, 2 + cells[:, 0], 1 + cells[:, 1]].T
    size, speed = np.hypot(*found[:, :2].T), np.hypot(*found[:, 2:].T)
    np.testing.assert_allclose(at[0, :2], found[0, :2] / size[0] * bound[0], rtol=1e-14)
    np.testing.assert_allclose(at[0, 2:], -found[0, :2] / size[0] * speed[0], rtol=1e-14)
    np.testing.assert_allclose(at[1, :2], found[1, :2] * bound[1], rtol=1e-14)
    np.testing.assert_allclose(at[2, :2], found[2, :2] / 5.0 * bound[2], rtol=1e-14)
    assert (at[1:3, 2:] == 0.0).all()
    assert (at[3] == 0.0).all()
    assert (out == 7.0).sum() == out.size - 16


def test_to_window() -> None:
    """What the three make of tractions one after the other, states as of the closest cells; others are not touched."""
    rng = np.random.default_rng(9)
    held = rng.random((7, 5)) < 0.7
    held[3] = True  # no row without cells
    cells, own = np.argwhere(held), np.argwhere(rng.random((7, 5)) < 0.6)
    shift, m = rng.uniform(-0.5, 0.5, 5), len(cells)
    q, s, slip, bound = rng.normal(size=(m, 2)), rng.normal(size=(m, 2)), rng.random(m) < 0.5, rng.uniform(1.0, 2.0, m)
    own_bound = rng.uniform(1.0, 2.0, len(own))
    values, flags = np.zeros((4, 7, 5)), np.zeros((7, 5), dtype=np.bool_)
    row_fields.on_box(q, s, slip, bound, cells, values, flags)
    found, nearest = centres(values, held, shift, own)
    states, expected = np.zeros((9, 8), dtype=np.bool_), np.full((4, 9, 8), 7.0)
    of_own = flags[nearest, own[:, 1]]
    row_fields.by_law(found, of_own, own_bound, own, (2, 1), expected)
    out = np.full((4, 9, 8), 7.0)
    row_fields.to_window(q, s, slip, bound, cells, held, shift, own, own_bound, (2, 1), out, states)
    np.testing.assert_array_equal(out, expected)
    assert 0 < of_own.sum() < len(own)
    np.testing.assert_array_equal(states[2 + own[:, 0], 1 + own[:, 1]], of_own)
    assert states.sum() == of_own.sum()


# --- area ---


NOT_KNOWN = np.full(2, np.nan)


def ellipse_chords(diameter: int, offset: float) -> tuple[np.ndarray, np.ndarray]:
    """Chords of an ellipse of `diameter` rows, and rows on which its tips are."""
    middle = 0.5 * (diameter + 3) - offset
    y = (np.arange(diameter + 4) - middle) / (0.5 * diameter)
    return 3.0 * np.sqrt(np.maximum(1.0 - y * y, 0.0)), middle + np.array([-0.5, 0.5]) * diameter


@pytest.mark.parametrize(("diameter", "tolerance"), [(4, 6e-4), (8, 1e-4), (12, 4e-5), (20, 1e-5), (60, 7e-7)])
def test_area_under_an_ellipse(diameter: int, tolerance: float) -> None:
    """Wherever its rows are; the error falls faster than the square of their distance, and is one of too little."""
    for offset in np.linspace(0.0, 1.0, 9):
        length, tips = ellipse_chords(diameter, offset)
        for ends in (tips, NOT_KNOWN):
            error = rows.area_under(length, ends) / (math.pi / 4.0 * 3.0 * diameter) - 1.0
            assert -tolerance < error < 0.0


def test_area_under_parabolas() -> None:
    """Squares of the chords that bend at one place: half of what the bend encloses is taken from either side of it."""
    length = np.sqrt(np.array([0.0, 0.0, 0.3, 1.3, 2.3, 3.3, 2.3, 1.3, 0.3, 0.0]))
    assert rows.area_under(length, NOT_KNOWN) == pytest.approx(2.0 * 2.0 / 3.0 * 3.3**1.5, rel=0.015)
    length = np.sqrt(np.array([0.3, 1.3, 2.3, 3.3, 4.3]))  # straight, and as far again as it takes at its ends
    expected = 2.0 / 3.0 * 4.3**1.5 + rows.piece_of_parabola(4.3, 0.0, 1.0, 0.0)
    assert rows.area_under(length, NOT_KNOWN) == pytest.approx(expected, rel=1e-14)
    assert rows.area_under(length, np.array([-0.3, 4.0])) == pytest.approx(2.0 / 3.0 * 4.3**1.5, rel=1e-14)


@pytest.mark.parametrize(
    ("length", "expected"),
    [
        ([], 0.0),
        ([0.0, 0.0], 0.0),
        ([0.0, 3.0, 0.0], 2.0),  # half a cell to each side, two thirds of it
        ([3.0], 2.0),
        ([2.0, 2.0], 2.0 + 2.0 * 4.0 / 3.0),  # a cell to each side: nothing says where they end
        ([3.0, 0.0, 3.0, 0.0], 4.0),
    ],
)
def test_area_under_few_chords(length: list[float], expected: float) -> None:
    assert rows.area_under(np.array(length), NOT_KNOWN) == pytest.approx(expected, rel=1e-14)


def test_area_under_chords_of_which_one_is_beyond_the_tip() -> None:
    """There is nothing beyond it, and nothing less than that."""
    length, inside, at = np.array([0.0, 1.0, 2.0, 0.0]), np.array([1.2, 2.5]), np.array([1.0, 2.5])
    assert rows.area_under(length, inside) == rows.area_under(length, at)


@pytest.mark.parametrize("seed", range(10))
def test_area_under(seed: int) -> None:
    """Zones of any shape, several of them, up to the box's sides."""
    rng = np.random.default_rng(seed)
    length = rng.uniform(0.5, 4.0, size=15) * (rng.random(15) < (0.5, 0.9)[seed % 2])
    assert rows.area_under(length, NOT_KNOWN) == pytest.approx(naive_rows.area(length), rel=1e-8)


@pytest.mark.parametrize("offset", np.linspace(0.0, 0.9, 7))
def test_outermost_chords_of_an_ellipse(offset: float) -> None:
    """Whatever the outermost rows' cells said: their chords are those of the ellipse, or nothing beyond its tips."""
    length, tips = ellipse_chords(10, offset)
    touched = np.flatnonzero(length)
    seen = length.copy()
    seen[[touched[0] - 1, touched[-1] + 1]] = 1.3  # pressed, though their middles are outside
    rows.between_tips(seen, tips)
    np.testing.assert_allclose(seen, length, atol=1e-12)
    seen[[touched[0], touched[-1]]] += 0.8
    rows.between_tips(seen, tips)
    np.testing.assert_allclose(seen, length, atol=1e-12)


def test_chords_of_three_rows_are_alike_on_both_sides() -> None:
    chords = np.array([0.0, 19.695, 23.669, 19.695, 0.0])
    rows.between_tips(chords, np.array([0.35, 3.65]))
    assert chords[1] == pytest.approx(chords[3], rel=1e-14)
    assert chords[1] < 19.6


def test_a_row_beyond_the_tip_has_no_chord() -> None:
    """However the parabola through the next two rows continues; nor has a row within it where that is below nothing."""
    for tips in ((0.5, 5.5), (-0.5, 6.5)):
        length = np.array([2.0, 1.0, 5.0, 6.0, 5.0, 1.0, 2.0])
        rows.between_tips(length, np.array(tips))
        np.testing.assert_array_equal(length, [0.0, 1.0, 5.0, 6.0, 5.0, 1.0, 0.0])


def test_one_side_of_a_contact_may_keep_its_chord() -> None:
    """Where the third row has lifted off there is no parabola; the other side's is taken all the same."""
    length = np.array([0.0, 2.0, 3.0, 0.0, 5.0, 4.0, 2.5, 0.0])
    for chords, tips in ((length, (0.6, 6.3)), (length[::-1], (0.7, 6.4))):
        found = chords.copy()
        rows.between_tips(found, np.array(tips))
        expected = chords.copy()
        # v = a t + b t^2 is 4^2 a cell and 5^2 two cells farther inside than the last row, 0.3 from the tip
        a, b = np.linalg.solve([[1.3, 1.3**2], [2.3, 2.3**2]], [16.0, 25.0])
        expected[chords == 2.5] = math.sqrt(0.3 * a + 0.09 * b)
        np.testing.assert_allclose(found, expected, rtol=1e-13)


def test_contacts_of_two_rows_keep_their_chords() -> None:
    for length in ([0.0, 2.0, 3.0, 0.0], [2.0, 3.0], [0.0, 2.0, 3.0], [0.0, 0.0], [1.0]):
        chords = np.array(length)
        rows.between_tips(chords, np.array([0.4, 2.6]))
        np.testing.assert_array_equal(chords, length)


# --- slip at the centres of cells ---


NOTHING_LOCAL = np.zeros((5, 0))


class MovedCells:
    """Cells of a box, one row of it empty, with the cells ahead and behind, slips, and which of them slip."""

    def __init__(self, seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        inside = ellipse((9, 8), (4.2, 3.3), (3.9, 3.6)) > 0.0
        self.cells = np.ascontiguousarray(np.argwhere(inside))
        self.m = m = len(self.cells)
        number = {(i, j): k for k, (i, j) in enumerate(self.cells.tolist())}
        self.neighbours = np.array(
            [[number.get((i + step, j), number[i, j]) for i, j in self.cells.tolist()] for step in (1, -1)]
        )
        self.leading, self.last = self.neighbours == np.arange(m)
        self.slip = rng.random(m) < 0.6
        self.s = rng.normal(size=(m, 2)) + 0.7
        self.rng = rng


def slip_at_edge(first: float, second: float) -> float:
    """a + b sqrt(r) at r = 0 through values at 1/4 and 5/4, between zero and the first of them."""
    at_edge = np.linalg.solve([[1.0, math.sqrt(0.25)], [1.0, math.sqrt(1.25)]], [first, second])[0]
    return float(np.clip(at_edge, 0.0, first))


def test_slip_at_leading_edge() -> None:
    seen = set()
    for s in np.random.default_rng(6).normal(size=(30, 2, 2)):
        one, two = np.linalg.norm(s, axis=1)
        found = centring.slip_at_leading_edge(s, 0, 1)
        assert found == pytest.approx(slip_at_edge(one, two), rel=1e-12, abs=1e-12)
        seen.add("zero" if found == 0.0 else "first" if found == pytest.approx(one) else "between")
    assert len(seen) == 3


def test_known_slip_of_a_cell_without_slip() -> None:
    """It has no direction, so that the local slip is left out; nor has one without slip at the edge. Nothing is nan."""
    local = np.ones((5, 2))
    local[4] = 0.0
    weight, out = np.full((3, 2), np.nan), np.full((2, 2), np.nan)
    for s, expected in (([[0.0, 0.0], [0.0, 0.0]], [0.0, 0.0]), ([[0.1, 0.0], [9.0, 0.0]], [4.55, 0.0])):
        slips = np.array(s)
        centring.centre(slips, np.ones(2, dtype=np.bool_), np.array([[0, 0], [1, 1]]), local, weight, out)
        np.testing.assert_allclose(out[0], expected, rtol=1e-14)
        assert np.isfinite(out).all()


@pytest.mark.parametrize("axis", [0, 1])
def test_known_slip_along_one_axis(axis: int) -> None:
    """It counts wherever it has a component: 2 per MPa times the 0.3 MPa that are missing, in a row's only cell."""
    local, out = np.zeros((5, 1)), np.full((1, 2), np.nan)
    local[axis], local[3] = 2.0, 0.3
    one = np.ones((1, 2)), np.ones(1, dtype=np.bool_), np.zeros((2, 1), dtype=np.int64)
    centring.centre(*one, local, np.full((3, 1), np.nan), out)
    np.testing.assert_allclose(out[0], 1.0 + 0.6 * np.eye(2)[axis], rtol=1e-14)


@pytest.mark.parametrize("cells", [1, 2, 3])
def test_centre_of_rows_of_a_few_slip_cells(cells: int) -> None:
    """A row of two has no second cell ahead: the straight line through both goes on at the trailing end."""
    s = np.array([[1.0, 0.3], [1.2, 0.4], [1.7, 0.2]])[:cells]
    m = np.arange(cells)
    neighbours = np.array([np.maximum(m - 1, 0), np.minimum(m + 1, cells - 1)])  # numbered from the leading cell on
    weight, out = np.full((3, cells), np.nan), np.full((cells, 2), np.nan)
    centring.centre(s, np.ones(cells, dtype=np.bool_), neighbours, NOTHING_LOCAL, weight, out)
    expected = s.copy()
    if cells == 2:
        expected = np.array([0.5 * (s[0] + s[1]), 1.5 * s[1] - 0.5 * s[0]])
    if cells == 3:
        parabola = np.polyfit(m, s, 2)
        expected[0] = 0.5 * (s[0] + s[1])
        expected[1:] = [parabola.T @ [x * x, x, 1.0] for x in (1.5, 2.5)]
    np.testing.assert_allclose(out, expected, rtol=1e-12)


@pytest.mark.parametrize("known", [False, True])
def test_centre(known: bool) -> None:
    """By the polynomial through the points there are, half a cell ahead of the cells, at a cell's own centre.

    At a trailing end through the second point ahead, too, if all slip. A stick cell is used by the slip cell behind it
    only. At least half of a cell's slip is left where it turns round. Stick cells' slip stays. The polynomial of the
    part that is known is replaced by its known value, by less where slip is small. A slip that is linear along x comes
    out right at the centres, half a cell behind.
    """
    seen = set()
    for seed in range(10 if known else 5):
        c = MovedCells(seed)
        c.s *= c.rng.uniform(0.1, 1.0, size=(c.m, 1))
        weight, out = np.full((3, c.m), np.nan), np.full((c.m, 2), np.nan)
        local = c.rng.normal(size=(5, c.m)) if known else NOTHING_LOCAL
        centring.centre(c.s, c.slip, c.neighbours, local, weight, out)
        np.testing.assert_array_equal(weight[:, ~c.slip], 0.0)
        np.testing.assert_array_equal(out[~c.slip], c.s[~c.slip])
        for k in np.flatnonzero(c.slip):
            there = [step for step, none in zip((1, -1), (c.leading[k], c.last[k]), strict=True) if not none]
            if 1 in there and not c.slip[c.neighbours[0, k]]:
                there = [1]
            others = {1: c.neighbours[0, k], -1: c.neighbours[1, k], 2: c.neighbours[0, c.neighbours[0, k]]}
            if there == [1] and c.last[k] and others[2] != others[1] and c.slip[[others[1], others[2]]].all():
                there = [1, 2]
            values = [c.s[k], *(c.s[others[step]] for step in there)]
            points = np.array([0.5, *(0.5 + step for step in there)])
            by_polynomial = np.polyfit(points, values, points.size - 1)[-1] - c.s[k]
            added = by_polynomial
            if known:
                pressures = [local[2, k], *(local[2, others[step]] for step in there)]
                missing = local[:2, k] * (local[3, k] - np.polyfit(points, pressures, points.size - 1)[-1])
                first = c.leading[k] and not c.last[k]
                size = np.linalg.norm(c.s[k])
                speed = slip_at_edge(size, np.linalg.norm(c.s[others[-1]])) if first else size
                added = added + speed**2 / (speed**2 + local[4, k] ** 2) * missing
            along, square = added @ c.s[k], c.s[k] @ c.s[k]
            capped = bool(along < -0.5 * square)
            part = -0.5 * square / along if capped else 1.0
            added = part * added
            found = sum(weight[at, k] * (c.s[others[step]] - c.s[k]) for at, step in enumerate((1, -1, 2)))
            np.testing.assert_allclose(found, part * by_polynomial, atol=1e-12)
            np.testing.assert_allclose(out[k], c.s[k] + added, atol=1e-13)
            seen.add((*there, capped))
    assert seen >= {(*there, capped) for there in ((1, -1), (1,), (-1,), (1, 2)) for capped in (False, True)}
    x = c.cells[:, :1] + 0.5
    s = np.hstack([1.0 + 0.02 * x, 0.5 - 0.03 * x])
    centring.centre(s, c.slip, c.neighbours, NOTHING_LOCAL, weight, out)
    at_centres = np.where(c.slip[:, None], s - 0.5 * np.array([0.02, -0.03]), s)
    alone = (c.leading & c.last)[:, None]
    np.testing.assert_allclose(out, np.where(alone, s, at_centres), rtol=1e-14)
    alone, out = np.full((3, 1), np.nan), np.full((1, 2), np.nan)
    of_one = np.ones((1, 2)), np.ones(1, dtype=np.bool_), np.zeros((2, 1), dtype=np.int64)
    centring.centre(*of_one, NOTHING_LOCAL, alone, out)
    assert (alone == 0.0).all()
    assert (out == 1.0).all()


def test_gather_centred_slip() -> None:
    """Rows of `gather_slip` with slips that are brought to the cells' centres first."""
    c = MovedCells(1)
    i, j = c.cells.T
    field = c.rng.normal(size=(2, 8, 12))
    s = np.ascontiguousarray((field[:, j, i] - field[:, j, i + 1]).T)
    weight, centred = np.full((3, c.m), np.nan), np.full((c.m, 2), np.nan)
    centring.centre(s, c.slip, c.neighbours, NOTHING_LOCAL, weight, centred)
    assert (weight != 0.0).any(axis=1).all()
    angle = c.rng.uniform(0.0, 7.0, size=c.m)
    normal, share = np.stack([np.cos(angle), np.sin(angle)], axis=1), c.rng.uniform(size=c.m)
    v = c.rng.normal(size=2 * c.m)
    slips, out = np.full((2, 2 * c.m), np.nan)
    of_rows = 12 * j + i, 1, c.slip, normal, share, 0.8
    tractions.gather_centred_slip(field.reshape(2, -1), v, *of_rows, weight, slips, out)
    np.testing.assert_array_equal(slips.reshape(-1, 2), s)
    unknowns = v.reshape(-1, 2)
    across = normal[:, 0] * centred[:, 1] - normal[:, 1] * centred[:, 0]
    of_slip = np.stack([unknowns[:, 0], share * across + (1.0 - share) * 0.8 * unknowns[:, 1]], axis=1)
    np.testing.assert_allclose(out.reshape(-1, 2), np.where(c.slip[:, None], of_slip, s), rtol=1e-12, atol=1e-13)


def test_of_line_ahead() -> None:
    """Slips in line: what the weights of the cell ahead and of the second one add is what this one adds alone."""
    weight, s = np.array([[-1.25, 0.4], [0.0, 0.2], [0.375, 0.0]]), 0.7 + 0.3 * np.arange(3)
    for m in range(2):
        together = weight[0, m] * (s[1] - s[0]) + weight[2, m] * (s[2] - s[0])
        assert tractions.of_line_ahead(weight, m) * (s[1] - s[0]) == pytest.approx(together, rel=1e-14)


def test_centred_slip_residual() -> None:
    """Dense: (1 + c (C - 1))^-1 of residuals less c m.C s and (1 - c) b tau, by the matrix C of what is across bounds.

    The second slip ahead of a trailing end is as far from the first as that is from its own. Where slip is not centred
    it is `slip_residual`, and what does not slip stays empty.
    """
    for seed in range(4):
        c = MovedCells(seed)
        weight = np.full((3, c.m), np.nan)
        centring.centre(c.s, c.slip, c.neighbours, NOTHING_LOCAL, weight, np.full((c.m, 2), np.nan))
        angle = c.rng.uniform(0.0, 7.0, size=c.m)
        normal, share = np.stack([np.cos(angle), np.sin(angle)], axis=1), c.rng.uniform(0.1, 1.0, size=c.m)
        across = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
        (v, found), root, diagonal = c.rng.normal(size=(2, 2 * c.m)), np.sqrt(share), 0.8
        places = 12 * c.cells[:, 0] + c.cells[:, 1]
        field, out = np.full((200, 2), np.nan), np.full((200, 2), 7.0)
        field[places] = c.s
        matrix, centred = np.eye(c.m), c.s.copy()
        in_line = np.array([weight[0] + 2.0 * weight[2], weight[1]])
        for k in np.flatnonzero(c.slip):
            for side in (0, 1):
                other = c.neighbours[side, k]
                centred[k] += in_line[side, k] * (c.s[other] - c.s[k])
                matrix[k, k] -= share[k] * in_line[side, k]
                if c.slip[other]:
                    matrix[k, other] += share[k] * in_line[side, k] * (across[k] @ across[other])
        rest = v[1::2] - share * (across * centred).sum(axis=1) - (1.0 - share) * diagonal * found[1::2]
        rest[~c.slip] = 0.0
        expected = (np.linalg.solve(matrix, rest) / root)[:, None] * across
        of_rows = field, v, places, c.slip, normal, root, diagonal, found
        tractions.centred_slip_residual(*of_rows, c.neighbours, weight, np.full((2, c.m), np.nan), out)
        np.testing.assert_allclose(out[places], expected, rtol=1e-10, atol=1e-12)
        assert (np.delete(out, places, axis=0) == 7.0).all()
        assert (np.abs(expected[c.slip]).sum(axis=1) > 0.0).all()
        alone = np.full((200, 2), 7.0)
        tractions.slip_residual(*of_rows, alone)
        tractions.centred_slip_residual(*of_rows, c.neighbours, np.zeros((3, c.m)), np.full((2, c.m), np.nan), out)
        np.testing.assert_allclose(out, alone, rtol=1e-12, atol=1e-13)


def test_update_directions_is_classify_when_the_slip_is_the_same() -> None:
    """As it is where slip does not change along x; what belongs to stick cells stays."""
    c = MovedCells()
    q, bound, rho = c.rng.normal(size=(c.m, 2)), c.rng.uniform(0.2, 2.0, size=c.m), 0.6
    s = np.stack([0.3 + 0.1 * c.cells[:, 1], np.full(c.m, -0.8)], axis=1)
    by_classify, updated = ((np.full((c.m, 2), 7.0), np.full(c.m, 7.0)) for _ in range(2))
    weight, centred = np.full((3, c.m), np.nan), np.full((c.m, 2), np.nan)
    _, square, _ = tractions.classify(q, s, bound, rho, c.slip, *by_classify)
    centring.centre(s, c.slip, c.neighbours, NOTHING_LOCAL, weight, centred)
    before = c.slip.copy()
    miss = centring.update_directions(q, centred, bound, rho, c.slip, *updated)
    assert miss == pytest.approx(square, rel=1e-14)
    assert 0 < c.slip.sum() < c.m
    np.testing.assert_array_equal(c.slip, before)
    for found, expected in zip(updated, by_classify, strict=True):
        np.testing.assert_array_equal(found, expected)


def test_centre_and_direct() -> None:
    """Both, one after the other."""
    c = MovedCells(2)
    q, bound, rho, local = (
        c.rng.normal(size=(c.m, 2)),
        c.rng.uniform(0.2, 2.0, size=c.m),
        0.6,
        c.rng.normal(size=(5, c.m)),
    )

    def empty() -> tuple[np.ndarray, ...]:
        return np.full((c.m, 2), 7.0), np.full(c.m, 7.0), np.full((3, c.m), np.nan), np.full((c.m, 2), np.nan)

    (normal, share, weight, centred), at_once = empty(), empty()
    centring.centre(c.s, c.slip, c.neighbours, local, weight, centred)
    miss = centring.update_directions(q, centred, bound, rho, c.slip, normal, share)
    found = centring.centre_and_direct(q, c.s, bound, rho, c.slip, *at_once[:2], c.neighbours, local, *at_once[2:])
    assert found == miss > 0.0
    for ours, theirs in zip(at_once, (normal, share, weight, centred), strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_update_directions() -> None:
    """Any slip: slip cells go to the circle, be they within it or not, stick cells into it; states are not changed."""
    c = MovedCells(1)
    q, bound, rho = c.rng.normal(size=(c.m, 2)), c.rng.uniform(0.5, 3.0, size=c.m), 0.6
    normal, share = np.full((c.m, 2), 7.0), np.full(c.m, 7.0)
    before, expected = c.slip.copy(), 0.0
    square = centring.update_directions(q, c.s, bound, rho, c.slip, normal, share)
    np.testing.assert_array_equal(c.slip, before)
    seen = set()
    for k in range(c.m):
        t = q[k] - rho * c.s[k]
        size = np.linalg.norm(t)
        seen.add((bool(c.slip[k]), bool(size > bound[k])))
        on_circle = bound[k] * t / size
        projected = on_circle if c.slip[k] or size > bound[k] else t
        expected += float(((q[k] - projected) ** 2).sum())
        np.testing.assert_allclose(normal[k], t / size if c.slip[k] else [7.0, 7.0], rtol=1e-13)
        assert share[k] == (pytest.approx(min(bound[k] / size, 1.0), rel=1e-13) if c.slip[k] else 7.0)
    assert len(seen) == 4
    assert square == pytest.approx(expected, rel=1e-12)


# --- phases ---


def test_multiply_phases() -> None:
    """Columns without a factor are left alone."""
    rng = np.random.default_rng(4)
    hat = rng.normal(size=(2, 5, 9)) + 1j * rng.normal(size=(2, 5, 9))
    factor = rng.normal(size=(5, 6)) + 1j * rng.normal(size=(5, 6))
    expected = hat.copy()
    expected[:, :, :6] *= factor
    arrays.multiply_phases(hat, factor)
    np.testing.assert_allclose(hat, expected, rtol=1e-14)


def test_update_directions_without_a_direction() -> None:
    """Where q - rho s is zero the direction and the share of a slip cell stay, and nothing becomes nan."""
    q, normal, share = np.array([[0.5, 0.25]]), np.array([[0.6, 0.8]]), np.array([0.3])
    miss = centring.update_directions(q, q / 0.5, np.array([1.0]), 0.5, np.array([True]), normal, share)
    assert (normal.tolist(), share.tolist(), miss) == ([[0.6, 0.8]], [0.3], pytest.approx(0.3125))


def test_local_slip() -> None:
    """Against the formula with arrays; rows without cells, which change no others, one of one cell, and longer ones."""
    rng = np.random.default_rng(5)
    count = np.array([0, 1, 4, 7, 0])
    index = np.full((7, 5), -1)
    for j, n in enumerate(count):
        index[:n, j] = count[:j].sum() + np.arange(n)
    p, angle, leading, kappa = rng.uniform(1.0, 5.0, 12), rng.uniform(-1.0, 1.0, (2, 5)), 0.03, -0.2
    normals, trailing = (np.array([np.cos(a), np.sin(a)]) for a in angle)
    out = np.zeros((5, 12))
    centring.local_slip(p, index, count, normals, trailing, kappa, leading, out)
    for j in range(1, 4):
        cells = index[: count[j], j]
        between = 0.5 * (np.append(p[cells], 0.0) + np.append(0.0, p[cells]))  # one more, of the cell behind
        nearest = np.append(0.0, between[:-2]) + between[1:]
        expected = between[:-1] + (2.0 * between[:-1] - nearest) / 12.0
        expected[0] -= leading * p[cells[0]]
        np.testing.assert_allclose(out[2, cells], expected, rtol=1e-14)
        direction = np.zeros((2, cells.size))
        direction[:, -1], direction[:, 0] = (kappa * n[0, j] * n[:, j] for n in (trailing, normals))
        if cells.size == 1:
            direction[:, 0] = kappa * normals[0, j] * normals[:, j]
        np.testing.assert_allclose(out[:2, cells], direction, rtol=1e-14)
    assert (out[3:] == 0.0).all()


@pytest.mark.parametrize("seed", range(3))
def test_work_on_slip(seed: int) -> None:
    """Cell by cell; what varies within a cell by the cells ahead and behind it, where it has both."""
    rng = np.random.default_rng(seed)
    rows = [np.arange(first, last) for first, last in ((0, 5), (5, 6), (6, 8), (8, 12))]
    q, s, slip = *rng.normal(size=(2, 12, 2)), rng.random(12) < 0.5
    neighbours = np.tile(np.arange(12), (2, 1))
    expected = float((q * s).sum())
    for row in rows:
        neighbours[0, row[1:]], neighbours[1, row[:-1]] = row[:-1], row[1:]
        for m in row[1:-1]:
            expected += (0.4 if slip[m] else 0.1) * float((q[m - 1] - q[m + 1]) @ (s[m - 1] - s[m + 1])) / 4.0
    assert row_cells.work_on_slip(q, slip, s, neighbours, 0.4, 0.1) == pytest.approx(expected, rel=1e-12)
