"""Kernels of the width of the slip zone, and of its area."""

from __future__ import annotations

import math

import naive_rows
import numpy as np
import pytest

from rcstudy.mechanics.kernels import slip_width, smooth_outline
from rcstudy.mechanics.subcell.edges import Smooth
from rcstudy.mechanics.subcell.moved_rows import RowTable


@pytest.mark.parametrize("n", [4, 5, 9, 30])
@pytest.mark.parametrize("seed", range(3))
def test_smooth_line(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    value, weight = rng.normal(size=n), rng.uniform(1.0, 2000.0, size=n)
    weight[rng.permutation(n)[: n - 4]] *= rng.integers(0, 2, n - 4)
    out = np.full(n, np.nan)
    slip_width.smooth_line(value, weight, 0.1, 0.02, out)
    np.testing.assert_allclose(out, naive_rows.smooth_line(value, weight, 0.1, 0.02), atol=1e-9)


def test_a_straight_line_stays_and_goes_on() -> None:
    value, weight, out = 0.3 * np.arange(12.0) - 1.0, np.zeros(12), np.zeros(12)
    weight[3:8] = 100.0
    slip_width.smooth_line(np.where(weight > 0.0, value, 99.0), weight, 0.1, 0.01, out)
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
    slip_width.turns_behind(q, slip, index, count, out)
    for j, row in enumerate(states):
        expected = naive_rows.turns_behind(row, q[index[: count[j], j]])
        np.testing.assert_allclose(out[:, j], expected, atol=1e-12)
    q[:] = 0.0
    slip_width.turns_behind(q, slip, index, count, out)
    np.testing.assert_array_equal(out, 0.0)


def test_too_far_back() -> None:
    """Most at steep borders and under friction across the rows, less in long rows, nothing where tractions turn."""
    along, across, slanting = (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    assert slip_width.too_far_back(0.0, 5.0, 0.0, 1.0, along, 0.4) == pytest.approx(0.0225)
    assert slip_width.too_far_back(0.0, 5.0, -4.0, 1.0, along, 0.4) == pytest.approx(0.0225)
    assert slip_width.too_far_back(0.0, 0.01, 0.0, 1.0, along, 0.4) == 0.01
    # 0.22 s^2/(l + 0.9) where nothing else is left
    for aspect in (1.0, 2.0):
        found = slip_width.too_far_back(-0.3, 8.1, 40.0, aspect, along, 0.0)
        assert found == pytest.approx(0.22 * aspect * 0.09 / 9.0, rel=5e-3)
    of_row = 1.0, 20.0, 40.0, 1.0
    assert slip_width.too_far_back(*of_row, across, 0.7) - slip_width.too_far_back(*of_row, along, 0.7) > 0.012
    assert slip_width.too_far_back(*of_row, slanting, 0.7) == pytest.approx(0.0105 - 0.0266, abs=3e-4)
    assert slip_width.too_far_back(-1.0, *of_row[1:], slanting, 0.7) == pytest.approx(0.0105 + 0.0266, abs=1e-3)
    assert slip_width.too_far_back(6.0, 8.0, 3.0, 1.0, across, 0.4) == pytest.approx(0.66, abs=0.01)
    # b, of a long row under much slanting friction, is -0.15, and counts as -0.1
    assert slip_width.too_far_back(6.0, 1000.0, 40.0, 1.0, slanting, 0.7) == pytest.approx(-0.1058, abs=2e-4)
    turned = slip_width.too_far_back(1.0, 20.0, 4.0, 1.0, (1.0, 0.0, 1.5), 0.0)
    assert abs(turned) < 0.01 * slip_width.too_far_back(1.0, 20.0, 4.0, 1.0, along, 0.0)


def test_noise() -> None:
    """Outermost rows of few cells tell worst."""
    assert slip_width.noise(0.0, 0) == pytest.approx(0.2)
    levels = [slip_width.noise(4.0, inside) for inside in range(5)]
    assert levels == sorted(levels, reverse=True)
    assert levels[3] == levels[4]


def contact(seed: int, beyond: float = 0.0) -> dict[str, np.ndarray]:
    """Rows of an elliptic contact, stick cells ahead of borders that scatter, the outermost ones' by more.

    Its tips lie within the rows or, by `beyond` or less, outside.
    """
    rng = np.random.default_rng(seed)
    ny = int(rng.integers(12, 30))
    terms = np.zeros(9)
    terms[0] = 1.0
    ends, slopes = np.zeros((2, ny)), np.zeros(ny)
    height = 0.5 * ny - rng.uniform(0.6, 1.9) + beyond
    smooth_outline.smooth_ends(
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


def outline_of(rows: dict[str, np.ndarray]) -> Smooth:
    """The outline that rows with such ends and slopes have."""
    chords = np.nan_to_num(rows["ends"][1] - rows["ends"][0])
    return Smooth(rows["ends"], rows["slopes"], chords, np.array([0.3, chords.size - 1.3]), 0.0)


def widths_of(
    rows: dict[str, np.ndarray], aspect: float, bow: float, turns: np.ndarray | None = None, unlike: float = 0.0
) -> np.ndarray | None:
    """What the kernel finds."""
    borders, last, slip, leading = numbered(rows)
    widths = np.zeros(last.size)
    of_rows = (borders, last, rows["length"]), rows["hidden"], outline_of(rows), slip, leading
    turns = np.zeros((3, last.size)) if turns is None else turns
    return widths if slip_width.slip_widths(*of_rows, (aspect, bow, unlike), turns, widths) else None


def test_in_one_piece() -> None:
    """A second border in a row counts between the two rows, not beyond."""
    last = np.array([0, 1, 3, -1])
    borders = np.array([[2.0, 0.0], [2.1, 1.0], [1.0, 2.0], [2.2, 2.0]])
    assert slip_width.in_one_piece(borders[:2], last, 0, 1)
    assert slip_width.in_one_piece(borders, last, 0, 1)
    assert not slip_width.in_one_piece(borders, last, 0, 2)
    assert not slip_width.in_one_piece(borders, last, 2, 3)


def test_corrected_widths() -> None:
    """A straight border: all rows have its slope; hidden widths get half, a row without a border none."""
    ny, bow = 7, 0.01
    ends, slopes = np.stack([0.3 * np.arange(ny), np.full(ny, 20.0)]), np.full(ny, 0.3)
    widths = 2.0 + 0.5 * np.arange(ny)
    last = np.array([-1, 0, 1, 2, 3, -1, -1])
    borders = np.column_stack([(ends[0] + widths)[1:5], np.arange(1.0, 5.0)])
    length, hidden = np.full(ny, 4.0), np.arange(ny) == 3
    turns, out = np.zeros((3, ny)), np.zeros(ny)
    of_rows = (borders, last, length), hidden, outline_of({"ends": ends, "slopes": slopes}), (1.2, bow, 0.3), turns
    slip_width.corrected_widths(*of_rows, 1, 4, out)
    moved = [bow + slip_width.too_far_back(0.8, 4.0, width, 1.2, (0.0, 0.0, 0.0), 0.3) for width in widths]
    assert min(moved) > 0.02
    expected = widths + np.where(hidden, 0.5, 1.0) * moved
    np.testing.assert_allclose(out, np.where(last >= 0, expected, 0.0), atol=1e-13)
    out[:] = 0.0
    slip_width.corrected_widths(*of_rows, 1, 5, out)
    assert out[5] == 0.0


def test_smoothest_line() -> None:
    """The first of the lines that passes the inner rows within their noise, here of values bent ever more.

    None passes the last ones: the line then is the one that bends most.
    """
    at, inner, weight, taken = np.arange(15.0), slice(3, 12), np.zeros(15), set()
    weight[inner] = 0.023**-2.0
    weight[[2, 12]] = 1.0  # the outermost ones do not count
    for size in (0.0, 0.03, 0.1, 0.2, 0.4, 0.8, 9.0):
        value = 3.0 + size * np.sin(0.6 * at)
        value[[2, 12]] += 0.3
        for change in (0.002, 0.005, 0.01, 0.02, 0.04, 0.08):
            line = naive_rows.smooth_line(value, weight, 0.1, change)
            if np.mean(((line - value) ** 2 * weight)[inner]) < 1.4:
                taken.add(change)
                break
        found = np.zeros(15)
        slip_width.smoothest_line(value, weight, 0.1, 2, 12, found)
        np.testing.assert_allclose(found, line, atol=1e-8)
    assert taken == {0.002, 0.01, 0.02, 0.04}


@pytest.mark.parametrize("change", [0.002, 0.01, 0.04])
def test_the_noise_within_which_a_line_is_smooth_enough(change: float) -> None:
    """A mean square of 1.4: distances grow with what bends the values, and just below it the line is that of change."""
    at, weight = np.arange(15.0), np.full(15, 0.023**-2.0)
    value = np.sin(0.6 * at)
    line = naive_rows.smooth_line(value, weight, 0.1, change)
    whole = np.mean(((line - value) ** 2 * weight)[1:14])
    for part, expected in ((1.399, change), (1.401, 2.0 * change if change != 0.002 else 0.005)):
        size, found = math.sqrt(part / whole), np.zeros(15)
        slip_width.smoothest_line(size * value, weight, 0.1, 0, 14, found)
        np.testing.assert_allclose(found, size * naive_rows.smooth_line(value, weight, 0.1, expected), atol=1e-7)


@pytest.mark.parametrize("seed", range(48))
def test_slip_widths(seed: int) -> None:
    """Against the naive twin: stick zones that tell, and some in parts, or with slip at the leading edge.

    The last ones are of contacts that reach over all rows, so that those beside the first and the last one are inner.
    """
    of_rows = contact(seed, 0.0 if seed < 40 else 2.5)
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
    assert slip_width.stick_range(length, ends, slip, leading) == (0, 5)
    ends[1, 0] = 2.9
    assert slip_width.stick_range(length, ends, slip, leading) == (1, 5)
    ends[1, 5] = np.nan
    assert slip_width.stick_range(length, ends, slip, leading) == (0, -1)  # four rows
    ends[1] = 5.0
    assert slip_width.stick_range(0.9 * length, ends, slip, leading) == (0, -1)
    slip[leading[4]] = True
    assert slip_width.stick_range(length, ends, slip, leading) == (0, -1)
    slip[:] = False
    length[6], length[5] = 1.0, 0.0
    assert slip_width.stick_range(length, ends, slip, leading) == (0, -1)  # in parts
    apart = np.array([1.0, 0.0, 1.0, 2.0, 1.0, 1.0, 1.0])
    assert slip_width.stick_range(apart, ends, slip, leading) == (0, -1)


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
    assert slip_width.outermost(np.array([0.0, 0.0, 2.0, 0.0, 3.0, 0.0])) == (2, 4)
    assert slip_width.outermost(np.array([1.0, 2.0])) == (0, 1)
    assert slip_width.outermost(np.array([0.0, 1.0, 0.0])) == (1, 1)
    assert slip_width.outermost(np.zeros(3)) == (2, 2)


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
    found = slip_width.area_of_slip(chords, tips, np.where(inside, width, 99.0))
    assert found == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("seed", range(6))
def test_area_of_slip(seed: int) -> None:
    """Any widths, in a contact with tips close to its outermost rows and far from them."""
    rng = np.random.default_rng(seed)
    chords = np.zeros(14)
    chords[2:12] = np.sort(rng.uniform(2.0, 6.0, 10))[[0, 2, 4, 6, 8, 9, 7, 5, 3, 1]]
    tips = np.array([1.0 + rng.uniform(0.1, 1.4), 12.0 - rng.uniform(0.1, 1.4)])
    widths = rng.uniform(0.0, 4.0, 14)
    found = slip_width.area_of_slip(chords, tips, widths)
    assert found == pytest.approx(naive_rows.slipping(chords, tips, widths), rel=2e-4)


def test_area_of_slip_in_a_contact_with_points() -> None:
    """Where chords grow so fast that the parabola of their squares falls below nothing, nothing slips."""
    chords, tips = np.array([0.0, 0.1, 0.3, 4.0, 5.0, 4.0, 0.3, 0.1, 0.0]), np.array([0.3, 7.7])
    widths = np.linspace(0.5, 1.5, 9)
    found = slip_width.area_of_slip(chords, tips, widths)
    assert found == pytest.approx(naive_rows.slipping(chords, tips, widths), rel=5e-3)


def test_shorten_tips() -> None:
    """As much of an outermost row slips as of the one beside it, be there a stick zone or not; no row gains."""
    chords = np.array([0.0, 2.0, 5.0, 6.0, 5.0, 3.0, 0.0])
    length = np.array([0.0, 1.7, 3.5, 4.5, 4.0, 1.0, 0.0])
    slip_width.shorten_tips(length, chords)
    np.testing.assert_allclose(length, [0.0, 0.5, 3.5, 4.5, 4.0, 1.0, 0.0], atol=1e-15)
    length = np.array([0.0, 1.7, 1.0, 0.0, 4.0, 2.5, 0.0])
    slip_width.shorten_tips(length, chords)
    np.testing.assert_allclose(length, [0.0, 0.0, 1.0, 0.0, 4.0, 2.0, 0.0], atol=1e-15)
    three = np.array([0.0, 1.7, 1.5, 0.2, 0.0])
    slip_width.shorten_tips(three, np.array([0.0, 2.0, 3.0, 2.0, 0.0]))
    np.testing.assert_array_equal(three, [0.0, 0.5, 1.5, 0.2, 0.0])
    two = np.array([0.0, 1.5, 1.2, 0.0])
    slip_width.shorten_tips(two, np.array([0.0, 2.0, 3.0, 0.0]))
    np.testing.assert_array_equal(two, [0.0, 1.5, 1.2, 0.0])


@pytest.mark.parametrize("seed", [0, 5, 7, 9])
def test_area_behind(seed: int) -> None:
    """Of the widths above, where these follow from the stick zone."""
    of_rows = contact(seed)
    if seed == 7:
        of_rows["length"] *= 1.9 / of_rows["length"].max()
    outline = outline_of(of_rows)
    borders, last, slip, leading = numbered(of_rows)
    # rows of a single cell
    q, index, count = np.random.default_rng(seed).normal(size=(slip.size, 2)), leading[None], np.ones_like(leading)
    table, cells = RowTable(index, np.zeros(count.size), count, outline.ends), (q, slip, np.ones(slip.size), 0.3)
    zone = borders, last, of_rows["length"]
    found, area = slip_width.area_behind(zone, of_rows["hidden"], outline, table, cells, (0.8, 0.01, 0.4))
    turns = np.array([naive_rows.turns_behind("s" if slip[m] else "-", q[[m]]) for m in leading]).T
    expected = naive_rows.slip_widths(*of_rows.values(), 0.8, 0.01, turns, 0.4)
    if seed == 7:
        assert expected is None
        assert (found, area) == (False, 0.0)
    else:
        assert expected is not None
        assert found
        assert area == pytest.approx(naive_rows.slipping(outline.chords, outline.tips, expected), rel=1e-3)
