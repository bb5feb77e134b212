"""Rows of cells that begin where the contact begins (`moved_rows.py`): edges, profiles and bounds, areas.

Positions along x are in cells: the centre of cell i of the box is at i.
"""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def to_root(v0: float, slope: float, bend: float) -> float:
    """Distance t > 0 at which v0 + slope t + bend t^2 comes to zero; a thousand if it does not."""
    square = slope * slope - 4.0 * bend * v0
    below = -slope + math.sqrt(square) if square >= 0.0 else 0.0
    return 2.0 * v0 / below if below > 0.0 else 1000.0


@jit
def to_edge(v0: float, slope: float, bend: float) -> float:
    """As `to_root`, at most a cell."""
    return min(to_root(v0, slope, bend), 1.0)


@jit
def rise_and_bends(three: tuple[float, float, float], line: tuple[float, ...]) -> tuple[float, float, float]:
    """Of a row's outer three pressures (MPa): rise, gamma, delta; line: the `half_line.HalfLine` of its cells.

    delta (1 - z)^-4, the next term, is that of a pressure whose square is a parabola, as Hertz's is; where gamma is not
    small there is none. With it the equation for e is delta/6 e^3 - gamma/2 e^2 + rise e = p0.
    """
    (p0, p1, p2), (b1, b2, _, _, _) = three, line
    q1, q2 = p1 + b1 * p0, p2 + b1 * p1 + b2 * p0
    gamma = q2 - 1.5 * q1 + 0.375 * p0
    rise = -0.5 * q2 + 1.75 * q1 - 0.6875 * p0
    delta = -5.0 / 6.0 * gamma * gamma / rise if -0.5 * rise < gamma < 0.0 else 0.0
    return rise + delta / 3.0, gamma - delta, delta


@jit
def beyond_centre(three: tuple[float, float, float], line: tuple[float, ...]) -> float:
    """How far beyond its outermost cell's centre a row's contact ends, by its outer three pressures (MPa), in cells.

    An edge farther out than a cell from where it is when the outermost one comes into contact would bring in the next.
    """
    rise, gamma, delta = rise_and_bends(three, line)
    e = to_edge(three[0], -rise, 0.5 * gamma)
    if delta < 0.0:
        e -= delta / 6.0 * e**3 / (rise - gamma * e)
    return line[3] + e


@jit
def pressed_second(
    three: tuple[float, float, float], beyond: float, line: tuple[float, ...], cells: tuple[float, ...]
) -> float:
    """Pressure (MPa) at the centre of a row's second cell, which is pressed more than that; arguments as above.

    beyond: how far beyond the outermost centre the contact ends; cells: those of a half-space. These are taken off,
    then what layers make of it is put on again.
    """
    rise, gamma, delta = rise_and_bends(three, line)
    e = beyond - line[3]
    root = rise - gamma * e + 0.5 * delta * e * e
    bend = gamma - delta * e
    second = 0.0
    for k in range(2):
        x = max(beyond + k, 0.0)
        here = math.sqrt(x) * (root + x * (bend / 1.5 + x * delta / 3.75)) / (math.gamma(1.5) * cells[2])
        second = here - (line[0] - cells[0]) * second
    return second


@jit
def row_edges(p: np.ndarray, line: tuple[float, ...], low: np.ndarray, high: np.ndarray, edges: np.ndarray) -> None:
    """Where each row's contact begins and ends: p [nx, ny] (MPa) -> first and last cell low, high [ny], edges [2, ny].

    By the outer three cells, see `beyond_centre`. A row of fewer cells takes the curvature of a parabola through p^2
    from its neighbour on the side of the longest row (of the one pressed most in the middle, if there are several);
    that row itself, if it is one, from a semicircle (of p) over its cells. An even number of cells has two middle ones,
    and edges of what is mirrored are mirrored. Rows without contact: high < low.
    """
    nx, ny = p.shape
    longest, top = 0, 0.0
    for j in range(ny):
        low[j], high[j] = nx, -1
        for i in range(nx):
            if p[i, j] > 0.0:
                low[j] = min(low[j], i)
                high[j] = i
        if high[j] < low[j]:
            continue
        a, b = (low[j] + high[j]) // 2, (low[j] + high[j] + 1) // 2
        middle = 0.5 * (p[a, j] ** 2 + p[b, j] ** 2)
        longer = (high[j] - low[j]) - (high[longest] - low[longest])
        if longer > 0 or (longer == 0 and middle > top):
            longest, top = j, middle
    for sense in (1, -1):
        bend = -top / (0.5 * (high[longest] - low[longest] + 1)) ** 2
        for j in range(longest, ny if sense > 0 else -1, sense):
            a, b = low[j], high[j]
            if b < a:
                continue
            if b - a >= 2:
                here = 0.0
                for k in ((a + b) // 2, (a + b + 1) // 2):
                    here += 0.25 * (p[k + 1, j] ** 2 - 2.0 * p[k, j] ** 2 + p[k - 1, j] ** 2)
                bend = min(here, 0.0)
            for side in range(2):
                first = a if side == 0 else b
                inward = 1 if side == 0 else -1
                v0 = p[first, j] ** 2
                if b - a >= 2:
                    t = beyond_centre((p[first, j], p[first + inward, j], p[first + 2 * inward, j]), line)
                elif b - a == 1:
                    t = to_edge(v0, v0 - p[first + inward, j] ** 2 + bend, bend)
                else:
                    t = to_edge(v0, 0.0, bend)
                edges[side, j] = first - inward * t


@jit
def piece(v0: float, v1: float, length: float) -> float:
    """Integral of sqrt(v) over a length on which v goes linearly from v0 to v1."""
    a, b = math.sqrt(v0), math.sqrt(v1)
    return 2.0 / 3.0 * length * (a * a + a * b + b * b) / (a + b) if a + b > 0.0 else 0.0


@jit
def row_profile(
    p: np.ndarray,
    ends: np.ndarray,
    edges: np.ndarray,
    line: tuple[float, ...],
    cells: tuple[float, ...],
    knots: np.ndarray,
    squares: np.ndarray,
) -> int:
    """Where p^2 is taken as a straight line in between: knots and squares [>= 2 nx + 3] of a row p [nx] (MPa).

    ends [2]: first and last cell in contact, edges [2]: where the contact ends. Returns the number of knots: edges,
    centres, and halfway between these what lets two lines enclose as much as a parabola does. Of the two outermost
    cells p^2 at the second one's centre is as `pressed_second` has it, for the `line` by which the edges are found,
    and at the first one's on the parabola through the edge and the next two, if it rises from the edge. Of less than
    six cells p^2 goes straight.
    """
    low, high = ends[0], ends[1]
    enough = high - low >= 5
    v = np.zeros(high - low + 1)
    for k in range(v.size):
        v[k] = p[low + k] ** 2
    bends = np.zeros(v.size)
    if enough:
        for side in range(2):
            inward = 1 if side == 0 else -1
            outer = 0 if side == 0 else v.size - 1
            t = (ends[side] - edges[side]) * inward  # how far the outermost centre is inside the edge
            three = p[ends[side]], p[ends[side] + inward], p[ends[side] + 2 * inward]
            second = pressed_second(three, t, line, cells) ** 2
            near, far = second / (t + 1.0), v[outer + 2 * inward] / (t + 2.0)
            slope = near - (far - near) * (t + 1.0)
            if slope > 0.0:
                v[outer] = max(t, 0.0) * (slope + (far - near) * t)
                v[outer + inward] = second
        for k in range(1, v.size - 1):
            bends[k] = v[k + 1] - 2.0 * v[k] + v[k - 1]
        bends[0], bends[-1] = bends[1], bends[-2]
    knots[0], squares[0] = edges[0], 0.0
    n = 1
    for k in range(v.size + 1):
        last = k == v.size
        x, value = (edges[1], 0.0) if last else (float(low + k), v[k])
        if x <= knots[n - 1] or (not last and x >= edges[1]):
            continue  # an outermost centre beyond its edge
        if enough:
            bend = 0.5 * (bends[min(k, v.size - 1)] + bends[max(k - 1, 0)])
            length = x - knots[n - 1]
            knots[n] = 0.5 * (knots[n - 1] + x)
            straight = 0.5 * (squares[n - 1] + value)
            # no less than a quarter, as a guard: where p^2 bends up much more than it rises it would turn negative
            squares[n] = max(straight - bend * length * length / 6.0, 0.25 * straight)
            n += 1
        knots[n], squares[n] = x, value
        n += 1
    return n


@jit
def row_profiles(
    p: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    edges: np.ndarray,
    line: tuple[float, ...],
    cells: tuple[float, ...],
    knots: np.ndarray,
    squares: np.ndarray,
    known: np.ndarray,
) -> None:
    """`row_profile` of each row of p [nx, ny] (MPa): knots and squares [ny, >= 2 nx + 3], and how many, known [ny].

    low, high [ny], edges [2, ny] as in `row_edges`; none of a row without contact.
    """
    for j in range(p.shape[1]):
        known[j] = 0
        if high[j] >= low[j]:
            ends, of_row = np.array([low[j], high[j]]), edges[:, j].copy()
            known[j] = row_profile(p[:, j].copy(), ends, of_row, line, cells, knots[j], squares[j])


@jit
def piece_moment(v0: float, v1: float, length: float) -> float:
    """Integral of t sqrt(v), t from where v is v0: see `piece`."""
    a, b = math.sqrt(v0), math.sqrt(v1)
    if a + b == 0.0:
        return 0.0
    return 2.0 / 15.0 * length**2 * (3.0 * b**3 + 6.0 * a * b * b + 4.0 * a * a * b + 2.0 * a**3) / (a + b) ** 2


@jit
def row_bounds(
    force: np.ndarray,
    all_knots: np.ndarray,
    all_squares: np.ndarray,
    known: np.ndarray,
    start: np.ndarray,
    count: np.ndarray,
    index: np.ndarray,
    out: np.ndarray,
    middle: np.ndarray,
) -> None:
    """Mean pressure of cells with centres start[j] - k, k < count[j], into out [m] (MPa).

    And the middle of its force, a position along x, into middle [m]. index: as in `row_cells.number_cells`. From
    `row_profiles` (all_knots, all_squares, known), scaled so that a row's cells together carry its force [ny] (MPa).
    The first and last one take what lies beyond them; cells ahead or behind where the contact ends carry nothing.
    """
    most = all_knots.shape[1]
    mass, moment = np.zeros(most), np.zeros(most)
    for j in range(force.size):
        if count[j] == 0:
            continue
        n, knots, squares = known[j], all_knots[j], all_squares[j]
        for k in range(1, n):
            length = knots[k] - knots[k - 1]
            own = piece(squares[k - 1], squares[k], length)
            mass[k] = mass[k - 1] + own
            moment[k] = moment[k - 1] + knots[k - 1] * own + piece_moment(squares[k - 1], squares[k], length)
        scale = force[j] / mass[n - 1]
        beyond, moment_beyond = mass[n - 1], moment[n - 1]
        m = n - 2
        for k in range(count[j]):
            x = start[j] - k - 0.5
            here = moment_here = 0.0
            if k < count[j] - 1 and x >= knots[n - 1]:  # a cell of rows kept where they were (`aligned_coupled.py`)
                here, moment_here = mass[n - 1], moment[n - 1]
            elif k < count[j] - 1 and x > knots[0]:
                while knots[m] > x:
                    m -= 1
                length = x - knots[m]
                square = squares[m] + length / (knots[m + 1] - knots[m]) * (squares[m + 1] - squares[m])
                own = piece(squares[m], square, length)
                here = mass[m] + own
                moment_here = moment[m] + knots[m] * own + piece_moment(squares[m], square, length)
            out[index[k, j]] = scale * (beyond - here)
            middle[index[k, j]] = (moment_beyond - moment_here) / (beyond - here) if beyond > here else start[j] - k
            beyond, moment_beyond = here, moment_here


@jit
def carry_on(
    p: np.ndarray,
    p_before: np.ndarray,
    force: np.ndarray,
    start: np.ndarray,
    count: np.ndarray,
    index: np.ndarray,
    taken: np.ndarray,
    bounds_before: np.ndarray,
    index_before: np.ndarray,
    out: np.ndarray,
) -> None:
    """Mean pressure of cells with centres start[j] - k in rows j of `taken`, into out [m] (MPa), from what it was.

    As much as the pressure of the mesh's own cells changed from p_before to p [nx, ny], shared out among the two
    closest cells of the row, comes to what it was in each, bounds_before [m'] (index_before [>= max count, ny]: their
    numbers). None is less than nothing, and the cells of a row carry its force [ny] (MPa) together.
    """
    for j in taken:
        last = count[j] - 1
        for k in range(last + 1):
            out[index[k, j]] = bounds_before[index_before[k, j]]
        for i in range(p.shape[0]):
            change = p[i, j] - p_before[i, j]
            if change != 0.0:
                place = min(max(start[j] - i, 0.0), float(last))
                near = min(int(place), max(last - 1, 0))
                part = place - near
                out[index[near, j]] += (1.0 - part) * change
                if part > 0.0:
                    out[index[near + 1, j]] += part * change
        total = 0.0
        for k in range(last + 1):
            m = index[k, j]
            out[m] = max(out[m], 0.0)
            total += out[m]
        scale = force[j] / total
        for k in range(last + 1):
            out[index[k, j]] *= scale


@jit
def squares_at_borders(knots: np.ndarray, squares: np.ndarray, known: np.ndarray, borders: np.ndarray) -> np.ndarray:
    """p^2 [n] (MPa^2) at borders [n, 2], positions x and rows j, by `row_profiles` (knots, squares, known)."""
    out = np.zeros(borders.shape[0])
    for k in range(out.size):
        j = int(borders[k, 1])
        out[k] = np.interp(borders[k, 0], knots[j, : known[j]], squares[j, : known[j]])
    return out


@jit
def peak_at_borders(squares: np.ndarray, borders: np.ndarray) -> float:
    """Largest pressure (MPa) at borders [n, 2], positions x and rows j, from p^2 there, squares [n]; between rows, too.

    By the parabola that fits best over the row of the largest one and up to three on either side: the largest of values
    that each are a little off would be too large. From row to row the border goes on at the nearest one.
    """
    n, most = squares.size, 7
    top = int(np.argmax(squares))
    y, value = np.zeros(most), np.zeros(most)
    value[0] = squares[top]
    found = 1
    reached = np.array([top, top])
    while found < most:
        row = (found + 1) // 2
        for side in range(2):
            target, here, best = borders[top, 1] + (row if side == 1 else -row), borders[reached[side], 0], -1
            for k in range(n):
                nearer = best < 0 or abs(borders[k, 0] - here) < abs(borders[best, 0] - here)
                if borders[k, 1] == target and nearer:
                    best = k
            reached[side] = best
        if reached.min() < 0:
            break
        for side in range(2):
            y[found], value[found] = row if side == 1 else -row, squares[reached[side]]
            found += 1
    return math.sqrt(max(top_of_parabola(y[:found], value[:found]), 0.0))


@jit
def top_of_parabola(y: np.ndarray, value: np.ndarray) -> float:
    """Largest value of the parabola that fits value [n] at y [n] best. y [n] is symmetric about 0, its first element.

    Where the parabola opens upwards, or has its top beyond the outermost y, the value at 0.
    """
    n = y.size
    if n < 3:
        return value[0]
    s2, s4 = np.sum(y**2), np.sum(y**4)
    v0, v1, v2 = np.sum(value), np.sum(y * value), np.sum(y**2 * value)
    bend, slope = (n * v2 - s2 * v0) / (n * s4 - s2 * s2), v1 / s2
    if bend >= 0.0 or abs(slope) > -2.0 * bend * np.max(y):
        return value[0]
    return (v0 - bend * s2) / n - slope * slope / (4.0 * bend)


@jit
def bulging(v0: float, v1: float, length: float, bend: float) -> float:
    """As `piece`, v having the second derivative `bend`: by two straight lines that enclose what the parabola does."""
    middle = max(0.5 * (v0 + v1) - bend * length * length / 6.0, 0.0)
    return piece(v0, middle, 0.5 * length) + piece(middle, v1, 0.5 * length)


@jit
def between_tips(length: np.ndarray, tips: np.ndarray) -> None:
    """The outermost chords of a contact with chords length [ny], made to fit where it ends across: rows tips [2].

    Cells of the outermost row are pressed even where the contact does not reach the row's centre. The square of its
    chord goes by a parabola through those of the two rows beside it, as they were, and nothing at the tip.
    """
    before = length.copy()
    for side in range(2):
        inward = 1 if side == 0 else -1
        j = 0 if side == 0 else length.size - 1
        while 0 <= j < length.size and before[j] == 0.0:
            j += inward
        if not 0 <= j + 2 * inward < length.size or before[j + 2 * inward] == 0.0:
            continue
        t = (j - tips[side]) * inward  # how far the row is inside the tip
        v1, v2 = before[j + inward] ** 2, before[j + 2 * inward] ** 2
        # divided differences about the tip
        slope = v1 / (t + 1.0)
        bend = v2 / (t + 2.0) - slope
        length[j] = math.sqrt(max(t * (slope - bend), 0.0)) if t > 0.0 else 0.0


@jit
def area_under(length: np.ndarray, tips: np.ndarray) -> float:
    """Area of a zone with chords length [ny], a cell apart, in cells: their squares are taken as parabolas in between.

    Between two chords the parabola bends like those through three chords around them. At its sides the zone goes on to
    the rows tips [2]; where these are not known (nan), by as much as three chords tell, at most a cell.
    """
    ny = length.size
    square = np.zeros(ny + 4)  # two rows more on each side
    square[2:-2] = length * length
    total = 0.0
    for j in range(2, ny + 2):
        here = square[j]
        if here == 0.0:
            continue
        if square[j + 1] > 0.0:
            bend, known = 0.0, 0
            for k in (j, j + 1):
                if square[k - 1] > 0.0 and square[k + 1] > 0.0:
                    bend += square[k - 1] - 2.0 * square[k] + square[k + 1]
                    known += 1
            total += bulging(here, square[j + 1], 1.0, bend / max(known, 1))
        for side in range(2):
            outward = -1 if side == 0 else 1
            if square[j + outward] > 0.0:
                continue
            v1, v2 = square[j - outward], square[j - 2 * outward]
            reach, bend = 0.5, 0.0  # of a zone of one row
            if v1 > 0.0:
                bend = v2 - 2.0 * v1 + here if v2 > 0.0 else 0.0
                reach = to_edge(here, here - v1 + 0.5 * bend, 0.5 * bend)
            if not math.isnan(tips[side]):
                reach = max((tips[side] - (j - 2)) * outward, 0.0)
            total += bulging(here, 0.0, reach, bend)
    return total
