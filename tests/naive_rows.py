"""Naive twins of rows of cells that begin where the contact begins: roots of polynomials, quadrature, sums of waves.

Written from what the kernels of `rows.py`, `stick.py` and `convolution.ShiftedTransform` promise. Positions are in
cells.
"""

from __future__ import annotations

import math
from itertools import groupby, pairwise

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import gamma

NEVER = 1000.0  # the distance of an edge that is not there


def first_root(v0: float, slope: float, bend: float) -> float:
    """Smallest t > 0 with v0 + slope t + bend t^2 = 0, v0 > 0; solved for 1/t, so that bend may be nothing."""
    inverse = np.roots([v0, slope, bend])
    return float(min((1.0 / root.real for root in inverse if root.imag == 0.0 and root.real > 0.0), default=NEVER))


def integral_of_root(x: np.ndarray, v: np.ndarray, low: float, high: float, power: int = 0) -> float:
    """Integral from `low` to `high` of x^power sqrt(v), v [n] >= 0 at rising x [n] being joined by straight lines."""
    total = 0.0
    for a, b in pairwise(x):
        a, b = max(a, low), min(b, high)
        if a < b:
            total += quad(lambda t: t**power * np.sqrt(np.interp(t, x, v)), a, b, epsabs=1e-11, epsrel=1e-11)[0]
    return float(total)


# --- edges and bounds ---


def cells_of_row(p: np.ndarray) -> np.ndarray:
    """Numbers from the first to the last cell of a row that is under pressure p [nx]; none without contact."""
    touched = np.flatnonzero(p > 0.0)
    return np.arange(touched[0], touched[-1] + 1) if touched.size else touched


def point_sources(power: float) -> np.ndarray:
    """The first three coefficients of (1 - z)^-power."""
    j = np.arange(3)
    return np.asarray(gamma(j + power) / gamma(power) / gamma(j + 1.0))


def of_three(three: np.ndarray, line: tuple[float, ...]) -> tuple[float, float, float]:
    """rise, gamma and delta of the outer three pressures of a row, as in the equation for e (`half_line.py`)."""
    q = np.convolve([1.0, *line[:2]], three)[:3]
    matrix = np.array([point_sources(2.5), point_sources(1.5), point_sources(0.5)]).T
    bend, alpha, _ = np.linalg.solve(matrix, q)
    rise = 1.5 * bend + alpha
    delta = -5.0 / 6.0 * bend**2 / rise if -0.5 * rise < bend < 0.0 else 0.0
    bend, alpha, _ = np.linalg.solve(matrix, q - delta * point_sources(3.5))
    return float(11.0 / 6.0 * delta + 1.5 * bend + alpha), float(bend + 2.0 * delta), float(delta)


def second_pressure(three: np.ndarray, beyond: float, line: tuple[float, ...], cells: tuple[float, ...]) -> float:
    """Pressure at the second centre: powers of the distance from the edge, then what layers make of them."""
    rise, bend, delta = of_three(three, line)
    e = beyond - line[3]
    factors = rise - bend * e + 0.5 * delta * e * e, bend - delta * e, delta

    def on_half_space(x: float) -> float:
        terms = (factor * x**power / gamma(power + 1.0) for factor, power in zip(factors, (0.5, 1.5, 2.5), strict=True))
        return float(sum(terms)) / cells[2] if x > 0.0 else 0.0

    return on_half_space(beyond + 1.0) - (line[0] - cells[0]) * on_half_space(beyond)


def edges(p: np.ndarray, line: tuple[float, ...]) -> dict[int, tuple[float, float]]:
    """Where the contact of each row under pressure p [nx, ny] begins and ends: {row: (back, front)}."""
    rows = {j: cells for j in range(p.shape[1]) if (cells := cells_of_row(p[:, j])).size}
    tops = {j: float(np.mean(p[middles(cells), j] ** 2)) for j, cells in rows.items()}
    longest = max(rows, key=lambda j: (len(rows[j]), tops[j], -j))
    found: dict[int, tuple[float, float]] = {}
    for order in (sorted(j for j in rows if j >= longest), sorted((j for j in rows if j <= longest), reverse=True)):
        cells = rows[longest]
        # a semicircle of the row's length; for want of three cells in the longest row
        bend = -tops[longest] / (0.5 * len(cells)) ** 2
        for j in order:
            cells, v = rows[j], p[rows[j], j] ** 2
            if len(cells) >= 3:
                around = [v[k - 1 : k + 2] for k in middles(np.arange(len(v)))]
                bend = min(0.0, float(np.mean([np.polyfit([-1.0, 0.0, 1.0], three, 2)[0] for three in around])))
            # outwards from the outermost cell's centre, the others lie behind it at -1, -2
            back, front = (outwards(side, bend, line) for side in (v, v[::-1]))
            found[j] = (float(cells[0] - back), float(cells[-1] + front))
    return found


def middles(cells: np.ndarray) -> np.ndarray:
    """The middle one of `cells`, the middle two of an even number."""
    return cells[(len(cells) - 1) // 2 : len(cells) // 2 + 1]


def outwards(v: np.ndarray, bend: float, line: tuple[float, ...]) -> float:
    """Distance from the outermost centre to the edge; v: squares of the pressure, the outermost first."""
    if len(v) >= 3:
        rise, gamma_, delta = of_three(np.sqrt(v[:3]), line)
        e = min(1.0, first_root(math.sqrt(v[0]), -rise, 0.5 * gamma_))
        return line[3] + e - (delta / 6.0 * e**3 / (rise - gamma_ * e) if delta < 0.0 else 0.0)
    # v0 + slope t + bend t^2 goes through v1 at t = -1; of one cell alone it is level at the centre
    slope = v[0] - v[1] + bend if len(v) == 2 else 0.0
    return min(1.0, first_root(v[0], slope, bend))


def area_within(rows: np.ndarray, columns: np.ndarray, dx: float, dy: float) -> float:
    """Area (cells) within an outline that crosses row j at rows[:, j] and column i at columns[:, i], nan where not.

    In half widths from the middle: of rows the crossings that face x count, of columns those that face y.
    """
    j, i = np.flatnonzero(rows[0] <= rows[1]), np.flatnonzero(columns[0] <= columns[1])
    across, along = rows[:, j], columns[:, i]
    width, height = 0.5 * (across[1].max() - across[0].min()), 0.5 * (along[1].max() - along[0].min())
    u = (np.concatenate([across.ravel(), i, i]) - across.mean()) / width
    v = (np.concatenate([j, j, along.ravel()]) - along.mean()) / height
    faces_x = np.abs(u) * height * dy >= np.abs(v) * width * dx
    counts = faces_x == (np.arange(u.size) < 2 * j.size)
    order = np.argsort(np.arctan2(v[counts], u[counts]))
    angle, square = np.arctan2(v, u)[counts][order], (u * u + v * v)[counts][order]
    steps = np.diff(angle, append=angle[0] + 2.0 * np.pi)
    return 0.25 * width * height * float(np.sum((square + np.roll(square, -1)) * steps))


def profile(
    p: np.ndarray, back: float, front: float, line: tuple[float, ...], of_half_space: tuple[float, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Places and squares of the pressure p [nx] of a row between which p^2 is taken as a straight line.

    line, of_half_space: half-lines by which the second cell's pressure is found at its centre.
    """
    cells = cells_of_row(p)
    x, v = cells.astype(float), p[cells] ** 2
    if len(cells) < 6:
        return np.concatenate([[back], x, [front]]), np.concatenate([[0.0], v, [0.0]])
    for edge, outer, inner, inward in ((back, [0, 1], [1, 2], 1.0), (front, [-1, -2], [-2, -3], -1.0)):
        value = v.copy()
        three = np.sqrt(value[[outer[0], *inner]])
        value[outer[1]] = second_pressure(three, inward * (x[outer[0]] - edge), line, of_half_space) ** 2
        parabola = np.polyfit([edge, *x[inner]], [0.0, *value[inner]], 2)
        if inward * np.polyval(np.polyder(parabola), edge) > 0.0:
            v[outer] = np.where(inward * (x[outer] - edge) > 0.0, np.polyval(parabola, x[outer]), 0.0)
    second = np.concatenate([[0.0], np.diff(v, 2), [0.0]])
    second[[0, -1]] = second[[1, -2]]
    # of the pieces between edge, cells and edge; those of an outermost cell beyond its edge are not there
    bends = np.concatenate([second[:1], 0.5 * (second[1:] + second[:-1]), second[-1:]])
    places, values = np.concatenate([[back], x, [front]]), np.concatenate([[0.0], v, [0.0]])
    if x[0] <= back:
        places, values, bends = np.delete(places, 1), np.delete(values, 1), np.delete(bends, 0)
    if x[-1] >= front:
        places, values, bends = np.delete(places, -2), np.delete(values, -2), np.delete(bends, -2)
        bends[-1] = second[-1]
    straight = 0.5 * (values[1:] + values[:-1])
    halves = np.maximum(straight - bends * np.diff(places) ** 2 / 6.0, 0.25 * straight)
    knots = np.empty(2 * len(places) - 1)
    squares = np.empty(len(knots))
    knots[::2], knots[1::2] = places, 0.5 * (places[1:] + places[:-1])
    squares[::2], squares[1::2] = values, halves
    return knots, squares


def bounds(
    p: np.ndarray,
    ends: tuple[float, float],
    lines: tuple[tuple[float, ...], tuple[float, ...]],
    start: float,
    count: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pressures [count] of cells at start - k that carry what a row p [nx] carries, and where, by quadrature.

    And the means of the pressure weighted with itself.
    """
    x, v = profile(p, *ends, *lines)
    between = [ends[1], *(start - k - 0.5 for k in range(count - 1)), ends[0]]
    parts, moments = (
        [integral_of_root(x, v, between[k + 1], between[k], power) for k in range(count)] for power in (0, 1)
    )
    fine = [np.linspace(between[k + 1], between[k], 20001) for k in range(count)]
    squares = [np.trapezoid(np.interp(at, x, v, left=0.0, right=0.0), at) for at in fine]
    scale = p.sum() / sum(parts)
    return np.array(parts) * scale, np.array(moments) / np.array(parts), scale * np.array(squares) / np.array(parts)


# --- between cells ---


def at_centre(values: np.ndarray, held: np.ndarray, shift: float, i: int) -> tuple[np.ndarray, int]:
    """Value [k] at i from values [k, nx] of the held cells of one row, each of them at its number plus `shift`.

    And the number of the cell closest to i; of two that are equally close the one of this number.
    """
    cells = np.flatnonzero(held)
    closest = min(cells, key=lambda c: (abs(c + shift - i), c != i))
    about = [c for c in cells if abs(c + shift - i) < 1.0] or [closest]
    return np.array([np.interp(i, np.array(about) + shift, of[about]) for of in values]), int(closest)


def stick_runs(slip: list[bool]) -> list[tuple[int, int]]:
    """First and last place of each run of stick cells along a row."""
    runs = [[k for k, _ in group] for sticks, group in groupby(enumerate(slip), lambda pair: not pair[1]) if sticks]
    return [(run[0], run[-1]) for run in runs]


def border_ahead(near: float, next_one: float) -> float:
    """From the first stick cell to the border ahead: room^2 is a straight line through the two cells."""
    if next_one <= near:
        return 0.5
    return min(1.0, float(np.roots(np.polyfit([0.0, -1.0], [near**2, next_one**2], 1))[0]))


def strip(d: float, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Rooms of k stick cells of a strip, from the last one on, and the two slips behind; the border d behind the last.

    Point sources 3/4 of a cell and more from the leading edge make the slip halfway between them vanish that would
    grow straight from the middle of the zone on (full slip under Hertz's pressure).
    """
    source, point = 0.75 + np.arange(k), 0.25 + np.arange(k + 2)
    slip_by = 1.0 / (point[:, None] - source)
    full = point - 0.5 * (k - 0.25 + d)
    room = np.linalg.solve(slip_by[:k], full[:k])
    return room[::-1], (full - slip_by @ room)[k:]


def half_line(d: float) -> tuple[np.ndarray, np.ndarray]:
    """The same of stick cells without end."""
    e, j = 0.5 * (d - 0.75), np.arange(2.0)
    of_both = gamma(j + 0.5) / gamma(j + 1.0)
    return (j + 0.5 + e) * of_both, (j - e) * of_both


def border_behind(rooms: tuple[float, float], slips: tuple[float, float], cells: int) -> float:
    """From the last stick cell to the border behind: where rooms and slips have their ratios, each of them if known.

    Halfway (in ratios) between a strip's and a half-line's. Where the border is near the last stick cell its room
    counts more, where it is near the first slip cell its slip does.
    """

    def where(which: int, ratio: float, low: float, high: float) -> float:
        def less(d: float) -> float:
            # at the very ends of where it may be one of the two is nothing
            of_strip, of_line = (max(pair[which][0] / pair[which][1], 0.0) for pair in (strip(d, cells), half_line(d)))
            return math.sqrt(of_strip * of_line) - ratio

        if less(low) * less(high) >= 0.0:
            return min(low, high, key=lambda d: abs(less(d)))
        return float(brentq(less, low, high, xtol=1e-15))

    by_rooms = where(0, rooms[0] / rooms[1], -0.25, 1.0) if rooms[1] > 0.0 else None
    by_slips = where(1, slips[0] / slips[1], -0.25, 0.75) if slips[1] > 0.0 else None
    if by_slips is None:
        return 0.25 if by_rooms is None else by_rooms
    if by_rooms is None or cells <= 3:
        return by_slips
    share = min(0.5 + 0.5 * (0.5 * (by_rooms + by_slips) - 0.25), 1.0)
    return (1.0 - share) * by_rooms + share * by_slips


def stick_zone(
    room: np.ndarray,
    speed: np.ndarray,
    slip: np.ndarray,
    start: float,
    ends: tuple[float, float],
    layers: tuple[float, float],
) -> tuple[float, list[float]]:
    """Length of a row's stick zone and its borders from the leading one on.

    room, speed, slip [n] from the leading cell on. layers: b1 of what these make of rooms behind a border, and by how
    much it lies farther back.
    """
    (back, front), (b1, shift) = ends, layers
    length, borders = 0.0, []
    for first, last in stick_runs(slip.tolist()):
        zone = [front, back]
        for side, (outermost, inner) in enumerate([(first, first + 1), (last, last - 1)]):
            of_row = outermost == (0, len(slip) - 1)[side]
            if of_row and (side == 0 or first == last):
                continue
            near, next_one = room[outermost], room[inner] if first < last else 0.0
            if side == 0:
                distance = border_ahead(near, next_one)
            else:
                behind = slip[last + 1 : last + 3].all() and last + 3 < len(slip)
                slips = (speed[last + 1], speed[last + 2]) if behind else (0.0, 0.0)
                # B+ takes off rooms what layers make of them, and slips, which go the other way, are freed by 1/B+
                if first < last:
                    next_one = max(next_one + b1 * near, 0.0)
                slips = (slips[0], max(slips[1] - b1 * slips[0], 0.0)) if behind else slips
                distance = border_behind((near, next_one), slips, last - first + 1) + shift
            place = start - outermost + (distance if side == 0 else -distance)
            if of_row and place <= back:
                continue  # a slip zone narrower than a cell shows in the room alone
            zone[side] = place
            borders.append(place)
        length += zone[0] - zone[1]
    return length, borders


def slipping(chords: np.ndarray, tips: np.ndarray, widths: np.ndarray) -> float:
    """Area of what slips, `widths` of the rows and straight beyond these, in a contact with `chords`."""
    held = np.flatnonzero(chords)
    low, high = held[0], held[-1]
    y = np.array([min(tips[0], held[0] - 1e-6), *held, max(tips[1], held[-1] + 1e-6)])
    v = np.array([0.0, *chords[held] ** 2, 0.0])
    slope = np.diff(v) / np.diff(y)
    bends = np.concatenate([[np.nan], np.diff(slope) / (y[2:] - y[:-2]), [np.nan]])
    total = 0.0
    for k in range(len(y) - 1):
        t = np.linspace(y[k], y[k + 1], 4001)
        bend = np.nanmean(bends[k : k + 2])
        square = v[k] + slope[k] * (t - y[k]) + bend * (t - y[k]) * (t - y[k + 1])
        wide = np.interp(t, held, widths[held])
        below, above = t < low, t > high
        wide[below] = widths[low] + (t[below] - low) * (widths[low + 1] - widths[low])
        wide[above] = widths[high] + (t[above] - high) * (widths[high] - widths[high - 1])
        total += np.trapezoid(np.minimum(np.maximum(wide, 0.0), np.sqrt(np.maximum(square, 0.0))), t)
    return float(total)


def area(length: np.ndarray) -> float:
    """Area of the zones with chords `length` [ny], by quadrature; a zone ends where a chord is nothing."""
    total = 0.0
    for first, last in stick_runs([chord == 0.0 for chord in length]):
        v = length[first : last + 1] ** 2
        n = len(v)
        second = np.full(n, np.nan)  # differences about each row, not known at the ends
        second[1:-1] = np.diff(v, 2)
        x, values, bends = [float(k) for k in range(n)], list(v), []
        for k in range(n - 1):
            about = second[k : k + 2]
            bends.append(float(np.nanmean(about)) if np.isfinite(about).any() else 0.0)
        for side, end in ((v, 0), (v[::-1], n)):
            if n == 1:
                reach = 0.5
            else:
                # a parabola through three, a line through two
                known = min(3, n)
                curve = np.polyfit(-np.arange(known), side[:known], known - 1)[::-1]
                reach = min(1.0, first_root(*curve, *([0.0] * (3 - known))))
            bend = float(second[1 if end == 0 else -2]) if n > 2 else 0.0
            x.insert(len(x) if end else 0, x[-1] + reach if end else -reach)
            values.insert(len(values) if end else 0, 0.0)
            bends.insert(len(bends) if end else 0, bend)
        for k, bend in enumerate(bends):
            # two lines that enclose as much as the parabola with this second derivative
            wide = x[k + 1] - x[k]
            middle = max(0.0, 0.5 * (values[k] + values[k + 1]) - bend * wide**2 / 6.0)
            knots = np.array([x[k], 0.5 * (x[k] + x[k + 1]), x[k + 1]])
            total += integral_of_root(knots, np.array([values[k], middle, values[k + 1]]), knots[0], knots[-1])
    return total


def peak_at_borders(squares: list[float], borders: list[tuple[float, int]]) -> float:
    """Largest pressure at borders (x, row), p^2 of which are squares: the top of a parabola over up to seven rows.

    Or of that over three rows, if that is lower by a per cent.
    """
    top = int(np.argmax(squares))
    paths = []
    for way in (-1, 1):
        path = [top]
        while len(path) < 4:
            x, row = borders[path[-1]]
            of_row = [k for k, border in enumerate(borders) if border[1] == row + way]
            if not of_row:
                break
            path.append(min(of_row, key=lambda k: abs(borders[k][0] - x)))
        paths.append(path)
    reach = min(map(len, paths)) - 1
    if reach == 0:
        return math.sqrt(squares[top])
    tops = []
    for rows in (1, reach):
        taken = [*paths[0][rows:0:-1], *paths[1][: rows + 1]]
        a, b, c = np.polyfit(np.arange(-rows, rows + 1), [squares[k] for k in taken], 2)
        inside = a < 0.0 and abs(b / (2.0 * a)) <= rows
        tops.append(c - b * b / (4.0 * a) if inside else squares[top])
    narrow, wide = tops
    return math.sqrt(max(narrow if narrow < 0.98 * wide else wide, 0.0))


# --- moved rows ---


def moved_value(row: np.ndarray, i: int, shift: float) -> float:
    """The row [n] at i + shift, as a sum of waves; the shortest of an even n, which has no phase to show, at i."""
    n = len(row)
    total = 0.0
    for k in range(n // 2 + 1):
        waves = np.cos(2.0 * np.pi * k / n * (i + (0.0 if 2 * k == n else shift) - np.arange(n)))
        total += (1.0 if k == 0 or 2 * k == n else 2.0) / n * float(row @ waves)
    return total


def moved_convolution(kernel: np.ndarray, field: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """sum of kernel [px, py], a torus, at the offset between cells times field [nx, ny], row j moved by shift[j]."""
    nx, ny = field.shape
    out = np.zeros((nx, ny))
    for j in range(ny):
        for m in range(ny):
            column = kernel[:, (j - m) % kernel.shape[1]]
            for i in range(nx):
                for k in range(nx):
                    out[i, j] += moved_value(column, i - k, shift[j] - shift[m]) * field[k, m]
    return out


# --- smooth lines ---


def smooth_line(value: np.ndarray, weight: np.ndarray, bend: float, change: float) -> np.ndarray:
    """Least squares of the weighted misses and of the second and third differences, each over its scale."""
    n = len(value)
    parts = [np.diag(np.sqrt(weight)), np.diff(np.eye(n), 2, axis=0) / bend, np.diff(np.eye(n), 3, axis=0) / change]
    wanted = np.concatenate([np.sqrt(weight) * value, np.zeros(len(parts[1]) + len(parts[2]))])
    found: np.ndarray = np.linalg.lstsq(np.concatenate(parts), wanted, rcond=None)[0]
    return found


def radius(terms: np.ndarray, angle: np.ndarray | float) -> np.ndarray:
    """r of an outline whose square has these factors of 1, cos, sin, cos 2, ... of the angle."""
    square = terms[0] + sum(
        terms[2 * m - 1] * np.cos(m * angle) + terms[2 * m] * np.sin(m * angle) for m in range(1, len(terms) // 2 + 1)
    )
    return np.sqrt(square)


def turns_behind(states: str, q: np.ndarray) -> tuple[float, float, float]:
    """cos and sin of twice the direction of the traction behind a row's last "-", and its turn from there to the end.

    states: "s" for slip cells, from the leading one on; q [cells, 2].
    """
    if not states:
        return 0.0, 0.0, 0.0
    behind = q[min(states.rfind("-") + 1, len(states) - 1)]
    first, last = complex(*behind), complex(*q[-1])
    twice = (first / abs(first)) ** 2
    return twice.real, twice.imag, abs(float(np.angle(last / first)))


def too_far_back(
    slope: np.ndarray, length: np.ndarray, width: np.ndarray, aspect: float, turns: np.ndarray, unlike: float
) -> np.ndarray:
    """By the formula of the kernel, with angles: of the border's normal, and of the traction behind it."""
    normal, traction = np.arctan(aspect * slope), 0.5 * np.arctan2(turns[1], turns[0])
    square, w = aspect * slope**2, np.maximum(width, 0.0)
    more = np.where(turns[0] ** 2 + turns[1] ** 2 > 0.0, 1.0 - unlike * np.cos(2.0 * traction), 1.0)
    shear = unlike * 0.5 * np.sin(2.0 * normal) * np.where(more == 1.0, 0.0, np.cos(2.0 * traction))
    b = 0.22 * more * square / (length + 0.9) + 0.25 * shear**2
    b -= 0.038 * unlike * np.sqrt(aspect) * slope * turns[1]
    out = 0.0225 * np.exp(-w / 4.0) + 0.9 * (1.0 - np.exp(-np.maximum(b, -0.1) / 0.9))
    out -= 0.03 * more * square / np.sqrt(1.0 + (square / 1.44) ** 2) * np.exp(-((w / 3.2) ** 2))
    return np.minimum(out * np.exp(-(turns[2] ** 4)), length)


def slip_widths(
    border: np.ndarray,
    length: np.ndarray,
    ends: np.ndarray,
    slopes: np.ndarray,
    leading_slips: np.ndarray,
    in_parts: np.ndarray,
    hidden: np.ndarray,
    aspect: float,
    bow: float,
    turns: np.ndarray,
    unlike: float,
) -> np.ndarray | None:
    """Widths [ny] of the slip zone behind the stick zone's rows, or None.

    border [ny]: of each row, nan where nothing slips behind; leading_slips, in_parts, hidden [ny]: flags of rows; the
    others as of the kernel.
    """
    chords = ends[1] - ends[0]
    stuck = np.flatnonzero((length > 0.0) & (np.nan_to_num(chords) > 3.0))
    whole = len(stuck) >= 5 and np.ptp(stuck) == len(stuck) - 1
    if not whole or leading_slips[stuck].any() or in_parts.any() or length[stuck].max() < 2.0:
        return None
    found = np.nan_to_num(border[stuck] - ends[0, stuck])
    rates = np.gradient(found)
    rates[0], rates[-1] = found[2] - found[1], found[-2] - found[-3]
    back = too_far_back(slopes[stuck] + rates, length[stuck], found, aspect, turns[:, stuck], unlike)
    back = (bow + back) * np.where(hidden[stuck], 0.5, 1.0)
    value, noise = found + np.where(np.isnan(border[stuck]), 0.0, back), np.full(len(stuck), 0.023)
    for k, of_row in enumerate((None, 0.035, 0.028)):
        for j in (k, len(stuck) - 1 - k):
            if k <= len(stuck) - 1 - k:
                noise[j] = 0.04 + 0.16 * math.exp(-0.5 * length[stuck[j]]) if of_row is None else of_row
    values, weights = np.zeros((2, len(length)))
    values[stuck], weights[stuck] = value, noise**-2.0
    for change in (0.002, 0.005, 0.01, 0.02, 0.04, 0.08):
        widths = smooth_line(values, weights, 2.0 / np.nanmax(chords), change)
        if np.sum(((widths[stuck] - value) / noise)[1:-1] ** 2) < 1.4 * (len(stuck) - 2):
            break
    widths[stuck[1:-1]] = value[1:-1]
    reached = ~np.isnan(slopes)
    for j in range(1, len(length) - 1):
        if not stuck[0] <= j <= stuck[-1] and reached[j - 1 : j + 2].all():
            widths[j] = max(widths[j], chords[j])
    return widths
