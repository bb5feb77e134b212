"""Stick zone of cells in rows that begin at the edge of the contact (`slip_zone.py`): its borders between cells.

Room: mu p - |q|, how far the traction of a stick cell stays below its bound.
"""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def border_ahead(near: float, next_one: float) -> float:
    """Distance, at most a cell, from the first stick cell of a row to the border of the stick zone ahead of it.

    near, next_one: rooms of that and of the next stick cell; the room falls like the root of the distance to the
    border. Without a next stick cell (0), or if its room is not larger, the border is half a cell away.
    """
    return min(near * near / (next_one * next_one - near * near), 1.0) if next_one > near else 0.5


@jit
def border_by_rooms(ratio: float, cells: int) -> float:
    """Distance from the last of two or more stick cells back to the border behind it, between -1/4 and 1 cell.

    ratio: of its room to that of the next cell ahead; cells: number of stick cells. See `border_behind`.
    """
    part = min(0.5 * ratio * math.sqrt((cells - 1.0) / (cells - 0.5)), 5.0 / 13.0)  # at most as at d = 1
    return (2.25 * part - 0.25) / (1.0 - part)


@jit
def border_by_slips(ratio: float, cells: int) -> float:
    """The same distance, -1/4 to 3/4 cell, from the ratio of the first two slips behind the stick cells."""
    part = min(0.5 * max(ratio, 0.0) * math.sqrt((cells + 1.0) / (cells + 0.5)), 1.0 / 3.0)  # at most as at d = -1/4
    return (0.75 - 2.75 * part) / (1.0 - part)


@jit
def border_behind(rooms: tuple[float, float], slips: tuple[float, float], cells: int) -> float:
    """Distance from the last stick cell of a row back to the border behind it, between -1/4 and 1 cell.

    rooms: of the last stick cell and the next one ahead; slips: against the traction, half a cell ahead of the centres
    of the first and the second slip cell behind. The second of a pair is 0 if there is none. cells: number k of stick
    cells.

    In a strip, z counts cells back from the leading edge, and x_j = 3/4 + j, j = 0, ..., k - 1, are the stick cells.
    With full slip under Hertz's pressure the slip would be linear in z, and zero in the middle of the stick zone, L/2.
    The rooms r_j, by which tractions fall short of mu p, act as point sources and change it by -r_j/(z - x_j) each. The
    sum has to vanish halfway ahead of each stick cell, at x_j - 1/2. With these zeros and poles it is in suitable units

        z - L/2 - sum r_j/(z - x_j) = (z - (L + k)/2) prod (z - x_j + 1/2)/(z - x_j).

    (The last zero follows from large z.) Its residues are the rooms, its values behind the zone the slips. With d from
    the last stick cell to the border, L = x_(k-1) + d, the last two rooms have the ratio
    (2 k - 1)/(k - 1) (d + 1/4)/(d + 9/4), the first two slips (2 k + 1)/(k + 1) (3/4 - d)/(11/4 - d). In a zone of
    infinite length both factors in front are 2. In contacts, with 1 to 25 stick cells, the finite length had half of
    that effect, so each factor is replaced by its geometric mean with 2. Each of the two ratios is the more accurate
    one where it approaches zero; there its result has the weight 3/4, the other 1/4. Rooms of fewer than four cells are
    less accurate than slips and only used without these; a single one gives no ratio. Without either ratio the distance
    is 1/4.
    """
    if slips[1] > 0.0 and (rooms[1] <= 0.0 or cells < 4):
        return border_by_slips(slips[0] / slips[1], cells)
    if rooms[1] <= 0.0:
        return 0.25
    by_rooms = border_by_rooms(rooms[0] / rooms[1], cells)
    if slips[1] <= 0.0:
        return by_rooms
    by_slips = border_by_slips(slips[0] / slips[1], cells)
    share = 0.375 + 0.25 * (by_rooms + by_slips)
    return by_rooms + share * (by_slips - by_rooms)


@jit
def rooms_and_speeds(
    q: np.ndarray,
    s: np.ndarray,
    slip: np.ndarray,
    friction: float,
    pressure: np.ndarray,
    room: np.ndarray,
    speed: np.ndarray,
) -> tuple[float, float]:
    """Room [m] (MPa) of tractions q [m, 2] (MPa) below friction times pressure [m], and speed [m] of slips s [m, 2].

    The speed is the slip against the traction, 0 without one. Returns the largest traction (MPa) and the part of the
    slip cells' tractions that points backwards, the sum of -q_x over that of |q|; 0 if no cell slips.
    """
    largest = 0.0
    backwards = sizes = 0.0
    for m in range(room.size):
        size = math.sqrt(q[m, 0] * q[m, 0] + q[m, 1] * q[m, 1])
        room[m] = friction * pressure[m] - size
        speed[m] = -(s[m, 0] * q[m, 0] + s[m, 1] * q[m, 1]) / size if size > 0.0 else 0.0
        largest = max(largest, size)
        if slip[m]:
            backwards -= q[m, 0]
            sizes += size
    return largest, backwards / sizes if sizes > 0.0 else 0.0


@jit
def stick_rows(
    room: np.ndarray,
    speed: np.ndarray,
    slip: np.ndarray,
    index: np.ndarray,
    start: np.ndarray,
    count: np.ndarray,
    edges: np.ndarray,
    widths: np.ndarray,
    narrow: float,
    b1: float,
    shift: float,
    length: np.ndarray,
    last: np.ndarray,
    borders: np.ndarray,
) -> int:
    """Number of borders between stick and slip; fills borders, and length [ny] (cells) of each row's stick zone.

    room [m] (MPa): of the cells; speed [m]: slip against the traction, half a cell ahead of them; slip [m]: flags of
    slip cells; index [max count, ny]: numbers m of a row's cells from the leading one on; start, count [ny], edges
    [2, ny]: as in `rows.row_pressures` and `rows.row_edges`; widths [ny]: of slip zones behind the row's last cell that
    are hidden within a cell (`trailing.py`), used where less than narrow, nan in rows without; b1, shift: of the
    half-line of tractions (`half_line.py`). borders [>= 2 m, 2]: x and j of each; last [ny]: number of the border
    behind the row's last stick cells, -1 if there is none.
    """
    found = 0
    for j in range(count.size):
        length[j], last[j] = 0.0, -1
        front = edges[1, j]
        cells = 0
        for k in range(count[j]):
            m = index[k, j]
            if slip[m]:
                cells = 0
                continue
            cells += 1
            x = start[j] - k
            ahead = cells > 1
            behind = k + 1 < count[j] and not slip[index[k + 1, j]]
            if not ahead:
                last[j] = -1
            if not ahead and k > 0:
                front = x + border_ahead(room[m], room[index[k + 1, j]] if behind else 0.0)
                borders[found, 0], borders[found, 1] = front, j
                found += 1
            if not behind:
                back = edges[0, j]
                # behind a last cell that sticks a narrow slip zone shows in the rooms only, if at all
                if k + 1 == count[j] and widths[j] < narrow:
                    back = min(back + widths[j], front)
                    borders[found, 0], borders[found, 1] = back, j
                    last[j] = found
                    found += 1
                elif k + 1 < count[j] or ahead:
                    # the effect of layers is removed: from rooms by the filter B+, from slips by its inverse
                    rooms, slips = (room[m], 0.0), (0.0, 0.0)
                    if ahead:
                        rooms = room[m], max(room[index[k - 1, j]] + b1 * room[m], 0.0)
                    # slip in the row's last cell depends on the edge of the contact and is not used
                    if k + 3 < count[j] and slip[index[k + 2, j]]:
                        first = speed[index[k + 1, j]]
                        slips = first, max(speed[index[k + 2, j]] - b1 * first, 0.0)
                    border = x - border_behind(rooms, slips, cells) - shift
                    if k + 1 < count[j] or border > back:
                        back = border
                        borders[found, 0], borders[found, 1] = back, j
                        last[j] = found
                        found += 1
                length[j] += front - back
    return found


@jit
def outermost(chords: np.ndarray) -> tuple[int, int]:
    """First and last row of a contact with chords [ny], zero in rows that it does not reach."""
    low, high = 0, chords.size - 1
    while low < high and chords[low] == 0.0:
        low += 1
    while high > low and chords[high] == 0.0:
        high -= 1
    return low, high


@jit
def area_of_slip(chords: np.ndarray, tips: np.ndarray, widths: np.ndarray) -> float:
    """Area (cells) of the slip zone behind a stick zone that extends to the contact's leading edge.

    chords [ny]: of the contact, which lies between the rows tips [2]; widths [ny]: of the slip zone in each row. The
    width is linear from row to row and beyond the outermost rows to the tips, as it hardly changes (in strips not at
    all, Haines and Ollerton 1963); the squares of chords are parabolas. The width is limited to the chord.
    """
    parts = 32  # points of the midpoint rule from row to row
    first, end = outermost(chords)
    n = end - first + 1
    at, square = np.zeros(n + 2), np.zeros(n + 2)
    for k in range(n):
        at[k + 1], square[k + 1] = first + k, chords[first + k] ** 2
    at[0], at[n + 1] = min(tips[0], first - 1e-6), max(tips[1], end + 1e-6)
    total = 0.0
    for k in range(n + 1):
        step = at[k + 1] - at[k]
        bend, known = 0.0, 0
        for m in (k, k + 1):
            if 0 < m < n + 1:
                after = (square[m + 1] - square[m]) / (at[m + 1] - at[m])
                before = (square[m] - square[m - 1]) / (at[m] - at[m - 1])
                bend += (after - before) / (at[m + 1] - at[m - 1])
                known += 1
        bend /= max(known, 1)
        for part in range(parts):
            t = (part + 0.5) / parts
            y = at[k] + t * step
            v = square[k] + t * (square[k + 1] - square[k]) - bend * t * (1.0 - t) * step * step
            j = min(max(math.floor(y), first), end - 1)
            width = widths[j] + (y - j) * (widths[j + 1] - widths[j])
            total += min(max(width, 0.0), math.sqrt(max(v, 0.0))) * step / parts
    return total


@jit
def shorten_tips(length: np.ndarray, chords: np.ndarray) -> None:
    """Correct the chords length [ny] of the stick zone, in place, in outermost rows, whose cells are too inaccurate.

    chords [ny]: those of the contact. At least as much of an outermost row slips as of the one beside it.
    """
    low, high = outermost(chords)
    if high - low < 2:
        return
    for outer, inner in ((low, low + 1), (high, high - 1)):
        length[outer] = max(0.0, min(length[outer], chords[outer] - (chords[inner] - length[inner])))
