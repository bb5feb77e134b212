"""Stick zone of cells in rows that begin at the edge of the contact (`slip_zone.py`): its borders between cells.

And rows that stick up to their trailing end: slip zones hidden there, and forces that cells miss (`trailing.py`).

Room: mu p - |q|, how far the traction of a stick cell stays below its bound.

`table` is a `moved_rows.RowTable`: index [most, ny], numbers of the cells of each row from the leading one on; start
[ny], position of the leading one; count [ny], how many there are; ends [2, ny], trailing and leading edge of each row
(cells). `cells` are (q, slip, pressure, friction): tractions q [m, 2] (MPa), flags of slip cells slip [m], pressure [m]
(MPa), and the friction coefficient. `zone` is (borders, last, length), what `stick_rows` fills.
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
    ahead = (next_one - near) * (next_one + near)  # the difference of their squares, which may round to zero
    return min(near * near / ahead, 1.0) if ahead > 0.0 else 0.5


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
    cells: tuple[np.ndarray, np.ndarray, np.ndarray, float], s: np.ndarray, room: np.ndarray, speed: np.ndarray
) -> tuple[float, float]:
    """Room [m] (MPa) of the cells' tractions below friction times pressure, and speed [m] of slips s [m, 2].

    The speed is the slip against the traction, 0 without one. Returns the largest traction (MPa) and the part of the
    slip cells' tractions that points backwards, the sum of -q_x over that of |q|; 0 if no cell slips.
    """
    q, slip, pressure, friction = cells
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
def hidden_widths(
    table: tuple[np.ndarray, ...], cells: tuple[np.ndarray, np.ndarray, np.ndarray, float], out: np.ndarray
) -> None:
    """Width out [ny] (cells) of the slip zone hidden behind the last cell, if it sticks, of each row; else nan.

    See `trailing.py`.
    """
    (index, _, count, ends), (q, slip, pressure, friction) = table, cells
    for j in range(count.size):
        length = ends[1, j] - ends[0, j]
        if count[j] == 0 or length <= 0.0 or slip[index[count[j] - 1, j]]:
            out[j] = math.nan
        else:
            largest = 0.0
            for step in range(count[j]):
                largest = max(largest, pressure[index[step, j]])
            last = index[count[j] - 1, j]
            size = math.hypot(q[last, 0], q[last, 1])
            out[j] = size * math.sqrt(length / math.pi) / (friction * largest)


@jit
def lower_room_at_ends(
    room: np.ndarray, table: tuple[np.ndarray, ...], cells: tuple[np.ndarray, np.ndarray, np.ndarray, float]
) -> None:
    """Take what does not belong to it off the room [m] (MPa) of each row's last cell, if this sticks; in place.

    A last cell carries all of the load up to the edge, which may lie e = 1/2 to 1 cell behind its centre. Of its bound,
    friction times pressure, the part ((e - 1/2)/(e + 1/2))^(3/2), by p = K r^(1/2), lies behind the cell and slips.
    Half of that is taken off: in the mean over 300 contacts that hardly slip and 100 of steel on steel borders are then
    closest. Slip areas of the latter are off by 0.6 of what they were, largest tractions too. (All of it moves borders
    too far.)
    """
    (index, start, count, ends), (_, slip, pressure, friction) = table, cells
    for j in range(count.size):
        if count[j] > 1:
            last = index[count[j] - 1, j]
            end = start[j] - (count[j] - 1) - ends[0, j]
            if end > 0.5 and not slip[last]:
                room[last] -= 0.5 * (friction * pressure[last]) * ((end - 0.5) / (end + 0.5)) ** 1.5


@jit
def stick_rows(
    room: np.ndarray,
    speed: np.ndarray,
    slip: np.ndarray,
    table: tuple[np.ndarray, ...],
    widths: np.ndarray,
    narrow: float,
    line: tuple[float, ...],
    zone: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> int:
    """Number of borders between stick and slip; fills zone: borders, last, length [ny] (cells) of rows' stick zones.

    room [m] (MPa): of the cells; speed [m]: slip against the traction, half a cell ahead of them; slip [m]: flags of
    slip cells; widths [ny]: of slip zones behind the row's last cell that are hidden within a cell (`trailing.py`),
    used where less than narrow, nan in rows without; line: the half-line of tractions, (b1, b2, total, shift, excess)
    of `half_line.HalfLine`. borders [>= 2 m, 2]: x and j of each; last [ny]: number of the border behind the row's last
    stick cells, -1 if there is none.
    """
    (index, start, count, ends), (borders, last, length), (b1, _, _, shift, _) = table, zone, line
    found = 0
    for j in range(count.size):
        length[j], last[j] = 0.0, -1
        front = ends[1, j]
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
                back = ends[0, j]
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
def stick_zone(
    table: tuple[np.ndarray, ...],
    cells: tuple[np.ndarray, np.ndarray, np.ndarray, float],
    s: np.ndarray,
    narrow: float,
    line: tuple[float, ...],
    widths: np.ndarray,
    zone: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> tuple[int, float, float]:
    """`stick_rows`, its rooms and speeds found by `rooms_and_speeds`, its widths by `hidden_widths`.

    Rooms at the rows' ends are lowered (`lower_room_at_ends`). s [m, 2]: slips; other arguments as there; widths [ny]
    is filled. Returns the number of borders and what `rooms_and_speeds` returns.
    """
    _, slip, _, _ = cells
    room, speed = np.zeros(slip.size), np.zeros(slip.size)
    largest, backwards = rooms_and_speeds(cells, s, room, speed)
    hidden_widths(table, cells, widths)
    lower_room_at_ends(room, table, cells)
    found = stick_rows(room, speed, slip, table, widths, narrow, line, zone)
    return found, largest, backwards


@jit
def ending_rows(
    table: tuple[np.ndarray, ...],
    cells: tuple[np.ndarray, np.ndarray, np.ndarray, float],
    x: np.ndarray,
    y: np.ndarray,
    dx: float,
    theta: float,
    out: np.ndarray,
) -> None:
    """Sums of force_x, force_y (MPa) and moment (MPa mm) by which such rows carry too little, added to out [3].

    See `trailing.py`. x, y [m] (mm): of the cells; dx: their length (mm); theta: distance from the leading cell's
    centre to the edge (cells).
    """
    (index, _, count, ends), (q, _, _, _) = table, cells
    widths = np.zeros(count.size)
    hidden_widths(table, cells, widths)
    for j in range(count.size):
        if math.isnan(widths[j]):
            continue
        k = count[j]
        leading, last = index[0, j], index[k - 1, j]
        length = max(ends[1, j] - ends[0, j] - 0.5 * widths[j], 0.0)
        over_root = math.exp(math.lgamma(k) - math.lgamma(k + 0.5))  # 1/sqrt(k), about
        part = 0.5 * math.sqrt(math.pi) * over_root * (length - k)
        lever = x[leading] + (theta - 0.75 * (length + k)) * dx
        out[0] += part * q[last, 0]
        out[1] += part * q[last, 1]
        out[2] += part * (lever * q[last, 1] - y[leading] * q[last, 0])
