"""Kernels of the stick zone of aligned cells: its borders between cells."""

from __future__ import annotations

import math

import naive_rows
import numpy as np
import pytest
from scipy.special import gammaln

from rcstudy.mechanics.half_line import HalfLine
from rcstudy.mechanics.kernels import stick
from rcstudy.mechanics.subcell.moved_rows import RowTable

FAR = 10**15  # cells: of a zone without end


def test_rooms_and_speeds() -> None:
    """The component of slip against the traction; none where there is no traction."""
    rng = np.random.default_rng(2)
    q, s, pressure, slip = *rng.normal(size=(2, 7, 2)), rng.uniform(1.0, 9.0, size=7), rng.random(7) < 0.5
    q[3] = 0.0
    room, speed = np.full((2, 7), np.nan)
    found = stick.rooms_and_speeds((q, slip, pressure, 0.4), s, room, speed)
    size = np.linalg.norm(q, axis=1)
    assert 0 < slip.sum() < 7
    assert found == pytest.approx((size.max(), -q[slip, 0].sum() / size[slip].sum()), rel=1e-14)
    np.testing.assert_allclose(room, 0.4 * pressure - size, rtol=1e-14)
    for m in range(7):
        direction = -q[m] / size[m] if m != 3 else np.zeros(2)
        assert speed[m] == pytest.approx(s[m] @ direction, abs=1e-14)
    assert stick.rooms_and_speeds((q, np.zeros(7, dtype=np.bool_), pressure, 0.4), s, room, speed)[1] == 0.0


def test_border_ahead() -> None:
    """Exact where the square of the room grows linearly; a cell at most; half a cell if nothing tells."""
    for distance in (0.0, 0.2, 0.5, 1.0):
        found = stick.border_ahead(math.sqrt(0.7 * distance), math.sqrt(0.7 * (distance + 1.0)))
        assert found == pytest.approx(distance, abs=1e-15)
    assert stick.border_ahead(math.sqrt(3.0), 2.0) == 1.0
    assert stick.border_ahead(1e-170, 2e-170) == 0.5  # squares that are zero in floating point
    assert stick.border_ahead(math.nextafter(1.0, 0.0), 1.0) == stick.border_ahead(3.0, math.nextafter(3.0, 4.0)) == 1.0
    assert stick.border_ahead(0.4, 0.0) == stick.border_ahead(0.4, 0.4) == stick.border_ahead(0.0, 0.0) == 0.5


@pytest.mark.parametrize("d", [-0.25, 0.0, 0.3, 0.6, 0.75])
def test_border_of_a_half_line(d: float) -> None:
    """From room that goes like a root far inside and whose sources cause no slip halfway between them."""
    e = 0.5 * (d - 0.75)
    j = np.arange(40000.0)
    room = 0.3 * (j + 0.5 + e) * np.exp(gammaln(j + 0.5) - gammaln(j + 1.0))
    assert stick.border_by_rooms(room[0] / room[1], FAR) == pytest.approx(d, abs=1e-12)
    far = room[20000:20100] ** 2
    assert far[-1] / (far[-1] - far[-2]) - 20099.0 == pytest.approx(d, abs=1e-3)
    # slip halfway between sources, from the fifth one inside to the fourth behind; the far end adds a straight line
    place = np.arange(5.5, -4.0, -1.0)
    slip = (room / (j - place[:, None])).sum(axis=1)
    inside = place > 0.0
    slip -= np.polyval(np.polyfit(place[inside], slip[inside], 1), place)
    assert np.abs(slip[inside]).max() < 1e-5 * np.abs(slip[~inside]).max()
    found = stick.border_by_slips(slip[~inside][0] / slip[~inside][1], FAR)
    assert found == pytest.approx(d, abs=1e-4)


@pytest.mark.parametrize("cells", [1, 2, 3, 4, 5, 20])
@pytest.mark.parametrize("d", [-0.25, 0.0, 0.3, 0.7])
def test_border_of_a_strip(cells: int, d: float) -> None:
    """Of k stick cells the ratios have factors in front; half of what these do is taken out."""
    rooms, slips = naive_rows.strip(d, cells)
    assert (rooms > -1e-12).all()
    assert (slips > -1e-12).all()
    factor = math.sqrt((cells + 0.5) / (cells + 1.0))
    assert stick.border_by_slips(slips[0] / slips[1] / factor, cells) == pytest.approx(d, abs=1e-12)
    if cells > 1:
        factor = math.sqrt((cells - 0.5) / (cells - 1.0))
        assert stick.border_by_rooms(rooms[0] / rooms[1] / factor, cells) == pytest.approx(d, abs=1e-12)


@pytest.mark.parametrize("cells", [1, 2, 3, 4, 20])
def test_border_behind(cells: int) -> None:
    """From what is known: of few cells by the slips, of more by both, each counting more the closer it is."""
    for rooms in ((0.1, 1.0), (0.4, 1.0), (0.6, 0.0), (2.0, 1.0), (0.0, 1.0)):
        known = rooms if cells > 1 else (rooms[0], 0.0)
        for slips in ((0.05, 0.3), (0.4, 1.0), (0.0, 0.0), (-0.1, 1.0), (0.9, 1.0), (0.3, -0.2)):
            found = stick.border_behind(known, slips, cells)
            assert found == pytest.approx(naive_rows.border_behind(known, slips, cells), abs=1e-12)
            assert -0.25 <= found <= 1.0


def test_border_behind_that_little_tells() -> None:
    none = 0.0, 0.0
    assert stick.border_behind((0.4, 0.0), none, 1) == stick.border_behind(none, none, 3) == 0.25
    assert stick.border_behind((0.4, 0.4), none, FAR) == stick.border_behind((3.0, 2.0), none, 9) == pytest.approx(1.0)
    assert stick.border_behind((0.0, 2.0), none, 9) == -0.25
    assert stick.border_behind(none, (3.0, 2.0), 9) == pytest.approx(-0.25)
    assert stick.border_behind((0.4, 0.0), (-1.0, 2.0), 1) == 0.75


def half_line_of(b1: float, shift: float) -> HalfLine:
    """Of which stick zones need no more than these."""
    return HalfLine(b1, math.nan, math.nan, shift, math.nan)


def found_zone(
    states: list[str],
    room: np.ndarray,
    start: list[float],
    edges: list[tuple[float, float]],
    speed: np.ndarray | None = None,
    widths: list[float] | None = None,
    layers: tuple[float, float] = (0.0, 0.0),
) -> tuple[np.ndarray, list[tuple[float, float]]]:
    """Lengths [ny] and borders as the kernel finds them, cells of all rows being numbered from the last row on.

    states: s and - for slip and stick from the leading cell on; room, and speed if it is known: of the rows' cells one
    after the other; widths: of slip zones behind the rows' last cells; layers: b1 and shift that these give borders.
    """
    count = np.array([len(row) for row in states])
    index = np.full((max(1, count.max()), len(states)), -1)
    numbers = np.arange(count.sum())[::-1]
    slip, of_cells, speeds = np.zeros(count.sum(), dtype=np.bool_), np.zeros(count.sum()), np.zeros(count.sum())
    first = 0
    for j, row in enumerate(states):
        index[: len(row), j] = own = numbers[first : first + len(row)]
        slip[own], of_cells[own] = [state == "s" for state in row], room[first : first + len(row)]
        if speed is not None:
            speeds[own] = speed[first : first + len(row)]
        first += len(row)
    length, borders = np.full(len(states), np.nan), np.full((2 * count.sum(), 2), np.nan)
    last = np.full(len(states), 99)
    hidden = np.full(len(states), np.nan) if widths is None else np.array(widths)
    of_rows = RowTable(index, np.array(start), count, np.array(edges).T), hidden, 0.5, half_line_of(*layers)
    found = stick.stick_rows(of_cells, speeds, slip, *of_rows, (borders, last, length))
    assert np.isnan(borders[found:]).all()
    for j, row in enumerate(states):
        own = [k for k in range(found) if borders[k, 1] == j]
        behind = last[j] >= 0
        assert last[j] == (own[-1] if behind else -1)
        if "-" in row and row.endswith("s"):
            assert behind
    return length, [(float(x), float(j)) for x, j in borders[:found]]


def test_stick_rows_that_stick_or_slip() -> None:
    """From edge to edge, or nothing; no borders. Rows without cells have nothing either."""
    edges = [(2.3, 6.9), (1.0, 1.4), (3.0, 5.5), (4.0, 4.5), (0.0, 0.0)]
    length, borders = found_zone(["----", "-", "sss", "s", ""], np.ones(9), [6.1, 1.2, 4.7, 4.2, 0.0], edges)
    np.testing.assert_allclose(length, [4.6, 0.4, 0.0, 0.0, 0.0], atol=1e-15)
    assert borders == []


def test_stick_rows_between_borders() -> None:
    """Room like the root of the distance ahead, by rooms and slips behind: both borders are found exactly."""
    start, back, front = 9.7, 0.2, 10.5
    x = start - np.arange(10)
    room, speed = np.ones(10), np.full(10, np.nan)
    rooms, slips = naive_rows.half_line(0.6)
    room[2:5], room[4:7] = np.sqrt(8.1 - x[2:5]), [1.0, rooms[1], rooms[0] * math.sqrt(4.5 / 4.0)]
    speed[7:9] = slips * np.array([math.sqrt(5.5 / 6.0), 1.0])
    for known in (None, speed):
        length, borders = found_zone(["ss-----sss"], room, [start], [(back, front)], known)
        assert length == pytest.approx([8.1 - 3.1])
        assert borders == [(pytest.approx(8.1), 0.0), (pytest.approx(3.1), 0.0)]
    room[6], speed[7] = rooms[0] * math.sqrt(6.5 / 6.0), slips[0] * math.sqrt(7.5 / 8.0)
    for known in (None, speed):
        length, borders = found_zone(["-------sss"], room, [start], [(back, front)], known)
        assert length == pytest.approx([front - 3.1])
        assert borders == [(pytest.approx(3.1), 0.0)]
    length, borders = found_zone(["ss--------"], room, [start], [(back, front)])
    assert length == pytest.approx([8.1 - back])
    assert borders == [(pytest.approx(8.1), 0.0)]
    room[-2:] = rooms[1], rooms[0] * math.sqrt(9.5 / 9.0)  # all stick, but for the last 0.3 cells
    length, borders = found_zone(["----------"], room, [start], [(-0.2, front)])
    assert length == pytest.approx([front - 0.1])
    assert borders == [(pytest.approx(0.1), 0.0)]


def test_stick_rows_with_narrow_slip_zones_behind_them() -> None:
    """Zones narrower than half a cell are as wide as is known, no wider than the row; others are left to the rooms."""
    edges = [(2.0, 6.0), (2.0, 6.0), (2.0, 2.2)]
    length, borders = found_zone(["----", "s---", "-"], np.ones(9), [5.3, 5.3, 2.1], edges, widths=[0.3, 0.1, 0.4])
    np.testing.assert_allclose(length, [3.7, 4.8 - 2.1, 0.0], atol=1e-12)
    assert borders == [(pytest.approx(x), j) for x, j in ((2.3, 0.0), (4.8, 1.0), (2.1, 1.0), (2.2, 2.0))]
    wide, _ = found_zone(["----"], np.ones(4), [5.3], edges[:1], widths=[0.6])
    assert wide == found_zone(["----"], np.ones(4), [5.3], edges[:1])[0]
    # a row's other zones end where their own rooms say
    narrow, not_known = (found_zone(["--s-"], np.ones(4), [5.3], edges[:1], widths=w)[1] for w in ([0.3], None))
    assert narrow == [*not_known[:2], (pytest.approx(2.3), 0.0)]


def test_stick_rows_of_single_cells() -> None:
    """One cell between slip cells, from the edge to its border at the ends."""
    edges = [(2.0, 6.0)] * 3
    length, borders = found_zone(["s-s", "-ss", "ss-"], np.ones(9), [5.0, 5.0, 5.0], edges)
    np.testing.assert_allclose(length, [0.75, 1.25, 1.5], atol=1e-15)
    assert borders == [(4.5, 0.0), (3.75, 0.0), (4.75, 1.0), (3.5, 2.0)]
    # the slips behind tell more, if there are two before the last cell
    slips = naive_rows.strip(0.5, 1)[1] / math.sqrt(1.5 / 2.0) * np.array([1.0, math.sqrt(1.5 / 2.0)])
    speed = np.array([0.0, *slips, 0.2, 0.0, *slips])
    length, borders = found_zone(["-sss", "-ss"], np.ones(7), [5.0, 5.0], [(1.0, 6.0), (2.0, 6.0)], speed)
    assert borders == [(pytest.approx(4.5), 0.0), (4.75, 1.0)]
    np.testing.assert_allclose(length, [1.5, 1.25], atol=1e-12)


@pytest.mark.parametrize("seed", range(10))
def test_stick_rows(seed: int) -> None:
    """Any states, several zones in a row; with layers and without."""
    rng = np.random.default_rng(seed)
    states = ["".join(rng.choice(list("s-"), size=rng.integers(0, 12))) for _ in range(9)]
    room, speed = rng.uniform(0.1, 1.0, size=(2, sum(map(len, states))))
    start = rng.uniform(12.0, 14.0, size=9).tolist()
    edges = [(x - max(1, len(row)) + rng.uniform(0.0, 1.0), x + 0.8) for x, row in zip(start, states, strict=True)]
    layers = (0.0, 0.0) if seed % 2 else (rng.uniform(-0.8, 0.4), rng.uniform(-0.1, 0.2))
    length, borders = found_zone(states, room, start, edges, speed, layers=layers)
    expected_borders = []
    first = 0
    for j, row in enumerate(states):
        slip = np.array([state == "s" for state in row], dtype=bool)
        of_cells = room[first : first + len(row)], speed[first : first + len(row)], slip
        expected, of_row = naive_rows.stick_zone(*of_cells, start[j], edges[j], layers)
        assert length[j] == pytest.approx(expected, abs=1e-12)
        expected_borders += [(pytest.approx(x, abs=1e-12), float(j)) for x in of_row]
        first += len(row)
    assert borders == expected_borders


def test_room_of_last_cells() -> None:
    """Half of what lies more than half a cell behind their centres; nothing in slip, single cells and full ones."""
    index, count = np.array([[0, 2, 4, 6, 8], [1, 3, 5, 7, -1]]), np.array([2, 2, 2, 2, 1])
    start, end = np.array([5.0, 6.0, 5.5, 5.0, 5.0]), np.array([0.9, 0.75, 0.5, 0.9, 0.9])
    edges = np.array([start - (count - 1) - end, start + 0.7])
    room, bound, slip = np.linspace(1.0, 2.0, 9), np.linspace(3.0, 4.0, 9), np.zeros(9, dtype=np.bool_)
    slip[7] = True
    found = room.copy()
    cells = np.zeros((9, 2)), slip, bound / 0.3, 0.3
    stick.lower_room_at_ends(found, RowTable(index, start, count, edges), cells)
    r = np.linspace(0.0, 1.4, 200001)  # from the edge of the first row to the front of its last cell
    behind = np.trapezoid(np.sqrt(r[r <= 0.4]), r[r <= 0.4]) / np.trapezoid(np.sqrt(r), r)
    expected = room.copy()
    expected[1] -= 0.5 * behind * bound[1]
    expected[3] -= 0.5 * 0.2**1.5 * bound[3]
    np.testing.assert_allclose(found, expected, rtol=1e-5)
    np.testing.assert_array_equal(np.delete(found, [1, 3]), np.delete(room, [1, 3]))


@pytest.mark.parametrize("seed", range(4))
def test_stick_zone(seed: int) -> None:
    """From tractions and slips: what `stick_rows` makes of rooms and speeds, and of zones hidden behind last cells."""
    rng = np.random.default_rng(seed)
    count = rng.integers(0, 9, 7)
    m, ny = int(count.sum()), count.size
    index = np.full((max(1, count.max()), ny), -1)
    for j in range(ny):
        index[: count[j], j] = np.arange(m)[count[:j].sum() : count[: j + 1].sum()]
    start = rng.uniform(9.0, 10.0, ny)
    ends = np.array([start - count + rng.uniform(0.0, 1.0, ny), start + 0.8])
    slip, pressure, friction, angle = rng.random(m) < 0.4, rng.uniform(1.0, 2.0, m), 0.3, rng.uniform(0.0, 7.0, m)
    size = friction * pressure * np.where(slip, 1.0, rng.uniform(0.0, 0.9, m))
    q, s = (size * np.array([np.cos(angle), np.sin(angle)])).T.copy(), rng.normal(size=(m, 2))
    (room, speed), widths = np.zeros((2, m)), np.zeros(ny)
    table, cells, line = RowTable(index, start, count, ends), (q, slip, pressure, friction), half_line_of(0.2, -0.1)
    expected = stick.rooms_and_speeds(cells, s, room, speed)
    stick.hidden_widths(table, cells, widths)
    stick.lower_room_at_ends(room, table, cells)

    def empty() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return np.zeros((2 * m, 2)), np.zeros(ny, dtype=np.int64), np.zeros(ny)

    zone, all_at_once, all_widths = empty(), empty(), np.zeros(ny)
    borders = stick.stick_rows(room, speed, slip, table, widths, 0.5, line, zone)
    found = stick.stick_zone(table, cells, s, 0.5, line, all_widths, all_at_once)
    assert found == (borders, *expected)
    assert borders > 0
    for ours, theirs in zip((all_widths, *all_at_once), (widths, *zone), strict=True):
        np.testing.assert_array_equal(ours, theirs)
