"""Rows of cells that begin at the edge of the contact (`moved_rows.py`): edges, profiles, mean pressures, areas.

Positions along x are in cells: the centre of cell i of the box is at i. `line` and `half_space` are half-lines, that is
(b1, b2, total, shift, excess) of `half_line.HalfLine`. Pressures p are in MPa, their squares in MPa^2.
"""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def to_root(v0: float, slope: float, bend: float) -> float:
    """Smallest distance t > 0 at which v0 + slope t + bend t^2 is zero; 1000 if there is none."""
    square = slope * slope - 4.0 * bend * v0
    below = -slope + math.sqrt(square) if square >= 0.0 else 0.0
    return 2.0 * v0 / below if below > 0.0 else 1000.0


@jit
def to_edge(v0: float, slope: float, bend: float) -> float:
    """The distance of `to_root`, limited to one cell."""
    return min(to_root(v0, slope, bend), 1.0)


@jit
def edge_coefficients(three: tuple[float, float, float], line: tuple[float, ...]) -> tuple[float, float, float]:
    """Coefficients rise, gamma, delta (MPa) of the equation for a row's edge, from its outer three pressures (MPa).

    The equation is delta/6 e^3 - gamma/2 e^2 + rise e = p0 (`half_line.py`); three: the outermost pressure first; line:
    the half-line of the row's cells. The term delta (1 - z)^-7/2, the next one of the series there, is that of a
    pressure whose square is a parabola, as Hertz's is. It is used only where gamma is small; elsewhere delta is zero.
    """
    (p0, p1, p2), (b1, b2, _, _, _) = three, line
    q1, q2 = p1 + b1 * p0, p2 + b1 * p1 + b2 * p0
    gamma = q2 - 1.5 * q1 + 0.375 * p0
    rise = -0.5 * q2 + 1.75 * q1 - 0.6875 * p0
    delta = -5.0 / 6.0 * gamma * gamma / rise if -0.5 * rise < gamma < 0.0 else 0.0
    return rise + delta / 3.0, gamma - delta, delta


@jit
def beyond_centre(three: tuple[float, float, float], line: tuple[float, ...]) -> float:
    """Distance (cells) of a row's edge beyond its outermost cell's centre, from its outer three pressures (MPa).

    Arguments as in `edge_coefficients`. The solution e of the equation there is the distance of the edge from where it
    lies when the outermost cell just comes into contact. Before the term with delta is added it is limited to one cell:
    beyond that the next cell would be in contact.
    """
    _, _, _, shift, _ = line
    rise, gamma, delta = edge_coefficients(three, line)
    e = to_edge(three[0], -rise, 0.5 * gamma)
    if delta < 0.0:
        e -= delta / 6.0 * e**3 / (rise - gamma * e)
    return shift + e


@jit
def pressure_at_second_centre(
    three: tuple[float, float, float], beyond: float, line: tuple[float, ...], half_space: tuple[float, ...]
) -> float:
    """Continuous pressure (MPa) at the centre of a row's second cell, which is less than the pressure of that cell.

    three, line: as in `edge_coefficients`; beyond: distance of the edge beyond the outermost centre (cells);
    half_space: the half-line of a half-space. The half-space's part of the filter B+ enters by its sum, `total`; the
    layers' part by its first coefficient, the difference of the two b1.
    """
    (b1, _, _, shift, _), (b1_of_half_space, _, total, _, _) = line, half_space
    rise, gamma, delta = edge_coefficients(three, line)
    e = beyond - shift
    root = rise - gamma * e + 0.5 * delta * e * e
    bend = gamma - delta * e
    second = 0.0
    for k in range(2):
        x = max(beyond + k, 0.0)
        here = math.sqrt(x) * (root + x * (bend / 1.5 + x * delta / 3.75)) / (math.gamma(1.5) * total)
        second = here - (b1 - b1_of_half_space) * second
    return second


@jit
def row_edges(p: np.ndarray, line: tuple[float, ...], low: np.ndarray, high: np.ndarray, edges: np.ndarray) -> None:
    """First and last cell and edges of the contact in each row: p [nx, ny] (MPa) -> low, high [ny], edges [2, ny].

    Edges (trailing, leading) follow from the outer three cells, see `beyond_centre`. A row of fewer cells takes the
    curvature of the parabola through p^2 from its neighbour on the side of the longest row (if there are several, of
    the one with the largest pressure in the middle). If that row itself has fewer than three cells, the curvature is
    that of a semicircle (of p) over its cells. Of an even number of cells the middle two are averaged, so that mirrored
    pressures have mirrored edges. Rows without contact: high < low.
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
    """Integral of sqrt(v) over a length on which v varies linearly from v0 to v1."""
    a, b = math.sqrt(v0), math.sqrt(v1)
    return 2.0 / 3.0 * length * (a * a + a * b + b * b) / (a + b) if a + b > 0.0 else 0.0


@jit
def row_profile(
    p: np.ndarray,
    ends: np.ndarray,
    edges: np.ndarray,
    line: tuple[float, ...],
    half_space: tuple[float, ...],
    knots: np.ndarray,
    squares: np.ndarray,
) -> int:
    """Number of knots of the piecewise linear p^2 along a row p [nx] (MPa); fills knots and squares [>= 2 nx + 3].

    ends [2]: first and last cell in contact; edges [2]: where the contact ends; line: the half-line by which the edges
    were found; half_space: that of one. Knots are the edges, the centres, and the points halfway between these, at
    which p^2 is such that two straight lines enclose the same area as a parabola. p^2 of the outermost two cells is
    replaced: at the second centre by `pressure_at_second_centre`, at the outermost one by the parabola through the edge
    and the next two centres. Both stay where this parabola does not rise from the edge. In rows of fewer than six
    cells p^2 is linear between edges and centres.
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
            t = (ends[side] - edges[side]) * inward  # distance of the outermost centre inside the edge
            three = p[ends[side]], p[ends[side] + inward], p[ends[side] + 2 * inward]
            second = pressure_at_second_centre(three, t, line, half_space) ** 2
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
            continue  # an outermost centre outside its edge
        if enough:
            bend = 0.5 * (bends[min(k, v.size - 1)] + bends[max(k - 1, 0)])
            length = x - knots[n - 1]
            knots[n] = 0.5 * (knots[n - 1] + x)
            straight = 0.5 * (squares[n - 1] + value)
            # at least a quarter, as a guard: where p^2 curves upwards much more than it rises it would be negative
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
    half_space: tuple[float, ...],
    profiles: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    """`row_profile` of each row of p [nx, ny] (MPa), into profiles.

    These are knots (cells), squares (MPa^2) [ny, >= 2 nx + 3] and their number known [ny]. low, high [ny], edges [2,
    ny] as in `row_edges`; no knots in rows without contact.
    """
    knots, squares, known = profiles
    for j in range(p.shape[1]):
        known[j] = 0
        if high[j] >= low[j]:
            ends, of_row = np.array([low[j], high[j]]), edges[:, j].copy()
            known[j] = row_profile(p[:, j].copy(), ends, of_row, line, half_space, knots[j], squares[j])


@jit
def piece_moment(v0: float, v1: float, length: float) -> float:
    """Integral of t sqrt(v), t being the distance from where v is v0; arguments as in `piece`."""
    a, b = math.sqrt(v0), math.sqrt(v1)
    if a + b == 0.0:
        return 0.0
    return 2.0 / 15.0 * length**2 * (3.0 * b**3 + 6.0 * a * b * b + 4.0 * a * a * b + 2.0 * a**3) / (a + b) ** 2


@jit
def row_pressures(
    force: np.ndarray,
    profiles: tuple[np.ndarray, np.ndarray, np.ndarray],
    table: tuple[np.ndarray, ...],
    out: np.ndarray,
    middle: np.ndarray,
    weighted: np.ndarray,
) -> None:
    """Mean pressure of the cells with centres at start[j] - k, k < count[j], into out [m] (MPa).

    The place along x where the force of each acts goes into middle [m], the mean of the pressure weighted with itself
    into weighted [m] (MPa). table: a `moved_rows.RowTable`, index, start, count and ends. Pressures follow from
    profiles, of `row_profiles`, scaled so that the cells of a row together carry its force [ny] (MPa). The first and
    the last cell also carry what lies beyond them; cells outside the edges carry nothing.
    """
    (all_knots, all_squares, known), (index, start, count, _) = profiles, table
    most = all_knots.shape[1]
    mass, moment, square_mass = np.zeros((3, most))
    for j in range(force.size):
        if count[j] == 0:
            continue
        n, knots, squares = known[j], all_knots[j], all_squares[j]
        for k in range(1, n):
            length = knots[k] - knots[k - 1]
            own = piece(squares[k - 1], squares[k], length)
            mass[k] = mass[k - 1] + own
            moment[k] = moment[k - 1] + knots[k - 1] * own + piece_moment(squares[k - 1], squares[k], length)
            square_mass[k] = square_mass[k - 1] + 0.5 * length * (squares[k - 1] + squares[k])
        scale = force[j] / mass[n - 1]
        beyond, moment_beyond, square_beyond = mass[n - 1], moment[n - 1], square_mass[n - 1]
        m = n - 2
        for k in range(count[j]):
            x = start[j] - k - 0.5
            here = moment_here = square_here = 0.0
            if k < count[j] - 1 and x >= knots[n - 1]:  # beyond the edge of rows kept in place (`aligned_coupled.py`)
                here, moment_here, square_here = mass[n - 1], moment[n - 1], square_mass[n - 1]
            elif k < count[j] - 1 and x > knots[0]:
                while knots[m] > x:
                    m -= 1
                length = x - knots[m]
                square = squares[m] + length / (knots[m + 1] - knots[m]) * (squares[m + 1] - squares[m])
                own = piece(squares[m], square, length)
                here = mass[m] + own
                moment_here = moment[m] + knots[m] * own + piece_moment(squares[m], square, length)
                square_here = square_mass[m] + 0.5 * length * (squares[m] + square)
            out[index[k, j]] = scale * (beyond - here)
            loaded = beyond > here
            middle[index[k, j]] = (moment_beyond - moment_here) / (beyond - here) if loaded else start[j] - k
            weighted[index[k, j]] = scale * (square_beyond - square_here) / (beyond - here) if loaded else 0.0
            beyond, moment_beyond, square_beyond = here, moment_here, square_here


@jit
def update_row_pressures(
    p: np.ndarray,
    p_before: np.ndarray,
    force: np.ndarray,
    table: tuple[np.ndarray, ...],
    taken: np.ndarray,
    bounds_before: np.ndarray,
    index_before: np.ndarray,
    out: np.ndarray,
) -> None:
    """Mean pressure of cells with centres start[j] - k in rows j of `taken`, into out [m] (MPa), by its change.

    The change of the pressures of the mesh's own cells, from p_before to p [nx, ny], is shared between the closest two
    cells of the row and added to their earlier pressures, bounds_before [m'] (index_before [>= max count, ny]: their
    numbers). Negative pressures are set to zero, and the cells of a row are scaled to carry its force [ny] (MPa)
    together. table: as in `row_pressures`.
    """
    index, start, count, _ = table
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
def squares_at_borders(profiles: tuple[np.ndarray, np.ndarray, np.ndarray], borders: np.ndarray) -> np.ndarray:
    """p^2 [n] (MPa^2) at borders [n, 2] (x and row j), interpolated between the knots of profiles, of `row_profiles`.

    Beyond the outermost knots p^2 is that of these.
    """
    knots, squares, known = profiles
    out = np.zeros(borders.shape[0])
    for k in range(out.size):
        x, j = borders[k, 0], int(borders[k, 1])
        m, end = 0, known[j]  # m becomes that of the first knot that is not below x
        while m < end:
            middle = (m + end) // 2
            if knots[j, middle] < x:
                m = middle + 1
            else:
                end = middle
        if m == 0 or m == known[j]:
            out[k] = squares[j, min(m, known[j] - 1)]
        else:
            part = (x - knots[j, m - 1]) / (knots[j, m] - knots[j, m - 1])
            out[k] = squares[j, m - 1] + part * (squares[j, m] - squares[j, m - 1])
    return out


@jit
def peak_at_borders(squares: np.ndarray, borders: np.ndarray) -> float:
    """Largest pressure (MPa), also between rows, along borders [n, 2] (x and row j) with p^2 = squares [n].

    It is the top of a parabola fitted to the row with the largest value and up to three rows on either side: the
    largest of several values that each have an error would be too large. If that through the nearest two rows alone has
    a top that is lower by a per cent, the border ends in a point, which the wide one overshoots, and the narrow one
    counts. From row to row the border continues at the nearest x.
    """
    n, most, pointed = squares.size, 7, 0.98
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
        if reached[0] < 0 or reached[1] < 0:
            break
        for side in range(2):
            y[found], value[found] = row if side == 1 else -row, squares[reached[side]]
            found += 1
    near = min(found, 3)
    wide, narrow = top_of_parabola(y[:found], value[:found]), top_of_parabola(y[:near], value[:near])
    return math.sqrt(max(narrow if narrow < pointed * wide else wide, 0.0))


@jit
def top_of_parabola(y: np.ndarray, value: np.ndarray) -> float:
    """Largest value of the parabola that best fits value [n] at y [n], which is symmetric about its first element, 0.

    It is the value at 0 where the parabola opens upwards or has its top beyond the outermost y.
    """
    n = y.size
    if n < 3:
        return value[0]
    s2, s4 = np.sum(y**2), np.sum(y**4)
    v0, v1, v2 = np.sum(value), np.sum(y * value), np.sum(y**2 * value)
    bend, slope = (n * v2 - s2 * v0) / (n * s4 - s2 * s2), v1 / s2
    furthest = 0.0
    for k in range(n):
        furthest = max(furthest, y[k])
    if bend >= 0.0 or abs(slope) > -2.0 * bend * furthest:
        return value[0]
    return (v0 - bend * s2) / n - slope * slope / (4.0 * bend)


@jit
def piece_of_parabola(v0: float, v1: float, length: float, bend: float) -> float:
    """Integral as in `piece` of a v with the second derivative `bend`.

    The parabola is replaced by two straight lines that enclose the same area.
    """
    middle = max(0.5 * (v0 + v1) - bend * length * length / 6.0, 0.0)
    return piece(v0, middle, 0.5 * length) + piece(middle, v1, 0.5 * length)


@jit
def between_tips(length: np.ndarray, tips: np.ndarray) -> None:
    """Correct the outermost chords of a contact, length [ny], in place, by the rows tips [2] where it ends.

    Cells of the outermost row may be in contact although the contact does not reach the centre of that row. The square
    of its chord is taken from the parabola that is zero at the tip and goes through the next two rows' uncorrected
    squares.
    """
    before = length.copy()
    for side in range(2):
        inward = 1 if side == 0 else -1
        j = 0 if side == 0 else length.size - 1
        while 0 <= j < length.size and before[j] == 0.0:
            j += inward
        if not 0 <= j + 2 * inward < length.size or before[j + 2 * inward] == 0.0:
            continue
        t = (j - tips[side]) * inward  # distance of the row inside the tip
        v1, v2 = before[j + inward] ** 2, before[j + 2 * inward] ** 2
        # divided differences about the tip
        slope = v1 / (t + 1.0)
        bend = v2 / (t + 2.0) - slope
        length[j] = math.sqrt(max(t * (slope - bend), 0.0)) if t > 0.0 else 0.0


@jit
def area_under(length: np.ndarray, tips: np.ndarray) -> float:
    """Area (cells) of a zone with chords length [ny] one cell apart, whose squares are parabolas in between.

    Between two chords the parabola has the curvature of those through three chords around them. At its sides the zone
    ends at the rows tips [2]; where these are not known (nan), it ends where the parabola through the outer three is
    zero, at most one cell beyond the outermost.
    """
    ny = length.size
    square = np.zeros(ny + 4)  # two empty rows on each side
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
            total += piece_of_parabola(here, square[j + 1], 1.0, bend / max(known, 1))
        for side in range(2):
            outward = -1 if side == 0 else 1
            if square[j + outward] > 0.0:
                continue
            v1, v2 = square[j - outward], square[j - 2 * outward]
            reach, bend = 0.5, 0.0  # for a zone of one row
            if v1 > 0.0:
                bend = v2 - 2.0 * v1 + here if v2 > 0.0 else 0.0
                reach = to_edge(here, here - v1 + 0.5 * bend, 0.5 * bend)
            if not math.isnan(tips[side]):
                reach = max((tips[side] - (j - 2)) * outward, 0.0)
            total += piece_of_parabola(here, 0.0, reach, bend)
    return total
