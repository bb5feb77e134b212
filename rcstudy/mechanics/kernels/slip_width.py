"""Width of the slip zone behind a stick zone in each row of the contact, and the zone's area, which follows from it.

Borders of the stick zone scatter by 0.02 of a cell, in its outermost rows by ten times as much, while the width has
little curvature from row to row: in and beyond those rows it comes from a smooth line through all (by the discrepancy
principle, Morozov 1966). Positions are in cells.

`zone` is (borders [n, 2], last [ny], length [ny]), as from `stick.stick_rows`. `outline` is an `edges.Smooth`: ends
[2, ny] of the contact's rows, slopes [ny], chords [ny], tips [2] and curvature. `law` is (aspect, bow, unlike): aspect
and unlike as of `too_far_back`, and the distance by which borders are found too far back besides.
"""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def smooth_line(value: np.ndarray, weight: np.ndarray, bend: float, change: float, out: np.ndarray) -> None:
    """Smooth line out [n] through value [n] with weight [n], which is 0 where a value is not known.

    It minimises the sum of weight (out - value)^2, (second differences/bend)^2 and (third differences/change)^2.
    """
    n = value.size
    band = np.zeros((n, 4))  # of the symmetric matrix: diagonal and the three below it
    for j in range(n):
        band[j, 0] = weight[j]
        out[j] = weight[j] * value[j]
    for order in (2, 3):
        factor = 1.0 / (bend * bend) if order == 2 else 1.0 / (change * change)
        stencil = np.array([1.0, -2.0, 1.0, 0.0]) if order == 2 else np.array([-1.0, 3.0, -3.0, 1.0])
        for j in range(n - order):
            for a in range(order + 1):
                for b in range(a + 1):
                    band[j + a, a - b] += factor * stencil[a] * stencil[b]
    # L D L^T in place, columns of a row from the left on
    for j in range(n):
        for k in range(min(3, j), 0, -1):
            total = band[j, k]
            for m in range(k + 1, min(3, j) + 1):
                total -= band[j, m] * band[j - m, 0] * band[j - k, m - k]
            band[j, k] = total / band[j - k, 0]
        for k in range(1, min(3, j) + 1):
            band[j, 0] -= band[j, k] * band[j, k] * band[j - k, 0]
            out[j] -= band[j, k] * out[j - k]
    for j in range(n - 1, -1, -1):
        out[j] /= band[j, 0]
        for k in range(1, min(3, n - 1 - j) + 1):
            out[j] -= band[j + k, k] * out[j + k]


@jit
def turns_behind(q: np.ndarray, slip: np.ndarray, index: np.ndarray, count: np.ndarray, out: np.ndarray) -> None:
    """Directions out [3, ny] of the tractions behind each row's stick cells; zeros in rows without cells.

    Cosine and sine of twice the angle from the rows to the traction of the first cell behind (of the last cell, if none
    slips there), and the angle from there to the traction of the row's last cell. q [m, 2]: of cells; slip [m]: flags;
    index [most, ny]: numbers of the cells of each row from the leading one on, count [ny] of them.
    """
    for j in range(count.size):
        out[0, j] = out[1, j] = out[2, j] = 0.0
        if count[j] == 0:
            continue
        end = count[j] - 1
        k = end
        while k > 0 and slip[index[k, j]] and slip[index[k - 1, j]]:
            k -= 1
        x, y = q[index[k, j], 0], q[index[k, j], 1]
        square = x * x + y * y
        if square > 0.0:
            out[0, j], out[1, j] = (x * x - y * y) / square, 2.0 * x * y / square
            u, v = q[index[end, j], 0], q[index[end, j], 1]
            out[2, j] = abs(math.atan2(x * v - y * u, x * u + y * v))


@jit
def too_far_back(
    slope: float, length: float, width: float, aspect: float, turns: tuple[float, float, float], unlike: float
) -> float:
    """Distance (cells) by which the border behind stick cells is found too far back.

    slope: of the border, in cells per row; length l: of the row's stick cells, width w: of the slip behind them; aspect
    a: dx/dy; turns: cos 2 t, sin 2 t and turn of `turns_behind`; unlike: (d - c)/sqrt(c d), with the responses c and d
    to tractions along and across waves. With s = slope sqrt(a) and the border's normal n it is

        exp(-turn^4) (0.0225 exp(-w/4) + 0.9 (1 - exp(-b/0.9)) - 0.03 s^2/sqrt(1 + (s/1.2)^4) exp(-(w/3.2)^2) g),
        b = 0.22 g s^2/(l + 0.9) + (unlike n_x n_y cos 2 t)^2/4 - 0.038 unlike s sin 2 t,   g = 1 - unlike cos 2 t,

    with b no less than -0.1, and no more than l in all.

    Fitted to 100 000 rows of bodies that are alike, in round contacts with 12 and 25 cells per radius, of any
    Poisson's ratio and direction of friction, against meshes 12 and 24 times as fine: it is then right to 0.01 of a
    cell in the mean over rows of like slope and width, at slopes up to 6, where borders are found up to 0.7 of a cell
    too far back. Where tractions turn by about one on their way to the edge, as under much spin, nothing is left of it.
    """
    normal = aspect * slope / (1.0 + (aspect * slope) ** 2)
    s, w = slope * math.sqrt(aspect), max(width, 0.0)
    cos2, sin2, turn = turns
    g = 1.0 - unlike * cos2
    b = 0.22 * g * s * s / (length + 0.9) + 0.25 * (unlike * normal * cos2) ** 2 - 0.038 * unlike * s * sin2
    narrow = 0.03 * s * s / math.sqrt(1.0 + (s / 1.2) ** 4) * math.exp(-((w / 3.2) ** 2)) * g
    far = 0.0225 * math.exp(-0.25 * w) + 0.9 * (1.0 - math.exp(-max(b, -0.1) / 0.9)) - narrow
    return min(math.exp(-(turn**4)) * far, length)


@jit
def noise(length: float, inside: int) -> float:
    """Scatter (cells) of the border behind the stick cells of a row.

    length: of the stick zone in this row (cells); inside: how many rows it is away from the zone's outermost row.
    """
    if inside == 0:
        return 0.04 + 0.16 * math.exp(-0.5 * length)
    return 0.035 if inside == 1 else (0.028 if inside == 2 else 0.023)


@jit
def stick_range(length: np.ndarray, ends: np.ndarray, slip: np.ndarray, leading: np.ndarray) -> tuple[int, int]:
    """First and last row of a stick zone that determines the width of the slip zone behind it, or 0 and -1.

    It must be in one piece, extend to the contact's leading edge, and have enough rows and cells. length [ny]: of its
    rows; ends [2, ny]: smooth ones of the contact's rows (`smooth_outline.smooth_ends`); slip [m]: flags of cells,
    leading [ny]: number of a row's leading cell.
    """
    least_chord, rows, cells = 3.0, 5, 2.0  # shorter or fewer rows are not accurate enough
    first, last, longest = 0, -1, 0.0
    for j in range(length.size):
        if length[j] > 0.0 and ends[1, j] - ends[0, j] > least_chord:
            if slip[leading[j]] or (last >= 0 and last < j - 1):
                return 0, -1
            if last < 0:
                first = j
            last = j
            longest = max(longest, length[j])
    return (first, last) if last - first + 1 >= rows and longest >= cells else (0, -1)


@jit
def in_one_piece(borders: np.ndarray, last: np.ndarray, first: int, end: int) -> bool:
    """Whether each row from first to end has one border at most: borders [n, 2], last [ny] of `stick.stick_rows`."""
    for n in range(borders.shape[0]):
        j = int(borders[n, 1])
        if first <= j <= end and last[j] != n:
            return False
    return True


@jit
def corrected_widths(
    zone: tuple[np.ndarray, np.ndarray, np.ndarray],
    hidden: np.ndarray,
    outline: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float],
    law: tuple[float, float, float],
    turns: np.ndarray,
    first: int,
    end: int,
    out: np.ndarray,
) -> None:
    """Widths of the slip zone in rows from first to end, each from its own border; fills these rows of out [ny].

    Arguments as in `slip_widths`. Borders are moved by `too_far_back` and bow, those of hidden widths, which are found
    otherwise (from the edge itself), by half of it.
    """
    (borders, last, length), (ends, slopes, _, _, _), (aspect, bow, unlike) = zone, outline, law
    found = np.zeros(length.size)
    for j in range(first, end + 1):
        found[j] = borders[last[j], 0] - ends[0, j] if last[j] >= 0 else 0.0
    for j in range(first, end + 1):
        # the outermost rows' own widths are too inaccurate for a slope
        low, high = max(j - 1, first), min(j + 1, end)
        if j in (first, end):
            low, high = (first + 1, first + 2) if j == first else (end - 2, end - 1)
        slope = slopes[j] + (found[high] - found[low]) / (high - low)
        out[j] = found[j]
        if last[j] >= 0:
            part = 0.5 if hidden[j] else 1.0
            turn = turns[0, j], turns[1, j], turns[2, j]
            out[j] += part * (bow + too_far_back(slope, length[j], found[j], aspect, turn, unlike))


@jit
def smoothest_line(value: np.ndarray, weight: np.ndarray, bend: float, first: int, end: int, out: np.ndarray) -> None:
    """The smoothest line out [ny] that passes the values of rows between first and end within their noise.

    value, weight, bend: as of `smooth_line`, weight being the noise to the power -2. `change` there is the least of six
    with which the mean square of the distances over the noise is below 1.4 (discrepancy principle, Morozov 1966), or
    the largest.
    """
    for change in (0.002, 0.005, 0.01, 0.02, 0.04, 0.08):
        smooth_line(value, weight, bend, change, out)
        off = 0.0
        for j in range(first + 1, end):
            off += weight[j] * (out[j] - value[j]) ** 2
        if off < 1.4 * (end - first - 1):
            break


@jit
def slip_widths(
    zone: tuple[np.ndarray, np.ndarray, np.ndarray],
    hidden: np.ndarray,
    outline: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float],
    slip: np.ndarray,
    leading: np.ndarray,
    law: tuple[float, float, float],
    turns: np.ndarray,
    widths: np.ndarray,
) -> bool:
    """Whether the slip zone's width behind the stick zone can be found in each row; if so it is in widths [ny].

    hidden [ny]: whether a row's width is hidden within a cell; slip, leading: as in `stick_range`; turns [3, ny]: as of
    `too_far_back`.

    Inner rows keep their own width (`corrected_widths`). The outermost rows with stick cells, and those beyond, take
    theirs from the smoothest line through the widths of all rows (discrepancy principle, Morozov 1966), whose second
    differences are held to 1/(half chord). Rows without stick cells slip over their whole chord.
    """
    (borders, last, length), (ends, slopes, _, _, _) = zone, outline
    first, end = stick_range(length, ends, slip, leading)
    if end < first or not in_one_piece(borders, last, first, end):
        return False
    ny = length.size
    half_chord = 0.0
    for j in range(ny):
        if not math.isnan(slopes[j]):
            half_chord = max(half_chord, 0.5 * (ends[1, j] - ends[0, j]))
    value, weight = np.zeros((2, ny))
    corrected_widths(zone, hidden, outline, law, turns, first, end, value)
    for j in range(first, end + 1):
        weight[j] = noise(length[j], min(j - first, end - j)) ** -2
    smoothest_line(value, weight, 1.0 / half_chord, first, end, widths)
    for j in range(1, ny - 1):
        if first < j < end:
            widths[j] = value[j]
        elif not first <= j <= end and not math.isnan(slopes[j - 1] + slopes[j] + slopes[j + 1]):
            widths[j] = max(widths[j], ends[1, j] - ends[0, j])
    return True


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


@jit
def area_behind(
    zone: tuple[np.ndarray, np.ndarray, np.ndarray],
    hidden: np.ndarray,
    outline: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float],
    table: tuple[np.ndarray, ...],
    cells: tuple[np.ndarray, np.ndarray, np.ndarray, float],
    law: tuple[float, float, float],
) -> tuple[bool, float]:
    """Whether `slip_widths` finds the width of the slip zone behind a stick zone; its area (cells) by `area_of_slip`.

    Arguments as there; table, cells: as in `stick.stick_zone`. The area is zero if the width is not found.
    """
    (index, _, count, _), (q, slip, _, _), (_, slopes, chords, tips, _) = table, cells, outline
    widths, turns = np.zeros(slopes.size), np.zeros((3, slopes.size))
    turns_behind(q, slip, index, count, turns)
    if not slip_widths(zone, hidden, outline, slip, index[0], law, turns, widths):
        return False, 0.0
    return True, area_of_slip(chords, tips, widths)
