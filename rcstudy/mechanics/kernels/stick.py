"""Stick zone of cells that begin where the contact begins (`aligned.py`): its borders between cells, row by row."""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def border_ahead(near: float, next_one: float) -> float:
    """Distance, at most a cell, from the first stick cell of a row to the border of the stick zone ahead of it.

    From the room mu p - |q| there and in the next stick cell: it falls like the root of the distance. Where there is no
    next one (0) or its room is not larger, the border is half a cell away.
    """
    return min(near * near / (next_one * next_one - near * near), 1.0) if next_one > near else 0.5


@jit
def border_behind(near: float, next_one: float, length: float) -> float:
    """The same from the last stick cell of a row back to the border behind it, between -1/4 and 1 cell.

    There the discrete half-line tells where between cells the border is: with j counted forward from it the room is
    (j + 1/2 + e) Gamma(j + 1/2)/Gamma(j + 1), which far away is sqrt(j + 3/4 + 2 e). Of one cell alone: 1/4.

    That is of a zone without end. Where it goes on for `length` cells from the last cell's centre only, the room bends
    more than the root does: like sqrt(d (length + d)) in strips, which makes the quotient of the two rooms larger by
    (length/(length - 1))^(1/2). In contacts it was half as much, of lengths from 2 to 25 cells.
    """
    if next_one <= 0.0:
        return 0.25
    ratio = near / next_one
    if length > 1.5:
        ratio *= ((length - 1.0) / length) ** 0.25
    ratio = min(ratio, 10.0 / 13.0)
    return 0.75 + (3.0 * ratio - 2.0) / (2.0 - ratio)


@jit
def stick_rows(
    room: np.ndarray,
    slip: np.ndarray,
    index: np.ndarray,
    start: np.ndarray,
    count: np.ndarray,
    edges: np.ndarray,
    length: np.ndarray,
    last: np.ndarray,
    borders: np.ndarray,
) -> int:
    """Length of the stick zone in each row, length [ny], in cells, and the borders between stick and slip.

    room [m]: mu p - |q| (MPa), slip [m]: state of the cells; index [max count, ny]: numbers m of a row's cells from the
    leading one on; start, count [ny], edges [2, ny] as in `row_bounds`. borders [>= 2 m, 2]: x and j of each; last
    [ny]: number of the one at the row's trailing end, -1 if it has none. Returns their number.
    """
    found = 0
    for j in range(count.size):
        length[j], last[j] = 0.0, -1
        front = edges[1, j]
        for k in range(count[j]):
            m = index[k, j]
            if slip[m]:
                continue
            x = start[j] - k
            ahead = k > 0 and not slip[index[k - 1, j]]
            behind = k + 1 < count[j] and not slip[index[k + 1, j]]
            if not ahead:
                last[j] = -1
            if not ahead and k > 0:
                front = x + border_ahead(room[m], room[index[k + 1, j]] if behind else 0.0)
                borders[found, 0], borders[found, 1] = front, j
                found += 1
            if not behind:
                back = edges[0, j]
                # a slip zone narrower than a cell shows in the room alone
                if k + 1 < count[j] or ahead:
                    border = x - border_behind(room[m], room[index[k - 1, j]] if ahead else 0.0, front - x)
                    if k + 1 < count[j] or border > back:
                        back = border
                        borders[found, 0], borders[found, 1] = back, j
                        last[j] = found
                        found += 1
                length[j] += front - back
    return found


@jit
def move_oblique(borders: np.ndarray, last: np.ndarray, length: np.ndarray) -> None:
    """Move the borders at the trailing ends of rows to where they are if they do not run across the rows, in place.

    They were found too far back by 0.014 of the square of the slope, in cells a row, to which the neighbours' borders
    tell it (from the paper's contacts on 80 x 80 cells against 512 x 512). borders, last and length as `stick_rows`
    leaves them; lengths change alike.
    """
    ny = last.size
    shift = np.zeros(ny)
    for j in range(ny):
        if last[j] < 0:
            continue
        low = j - 1 if j > 0 and last[j - 1] >= 0 else j
        high = j + 1 if j + 1 < ny and last[j + 1] >= 0 else j
        if high > low:
            slope = (borders[last[high], 0] - borders[last[low], 0]) / (high - low)
            if high - low == 1:
                slope *= 1.3  # it is the outermost row, and borders bend there
            shift[j] = min(0.014 * min(abs(slope), 5.0) ** 2, length[j])
    for j in range(ny):
        if last[j] >= 0:
            borders[last[j], 0] += shift[j]
            length[j] -= shift[j]


@jit
def outermost(chords: np.ndarray) -> tuple[int, int]:
    """First and last row of a contact with chords [ny]."""
    low, high = 0, chords.size - 1
    while low < high and chords[low] == 0.0:
        low += 1
    while high > low and chords[high] == 0.0:
        high -= 1
    return low, high


@jit
def slip_widths(
    length: np.ndarray, slip: np.ndarray, index: np.ndarray, count: np.ndarray, edges: np.ndarray, widths: np.ndarray
) -> tuple[int, int]:
    """How much of each row slips, widths [ny] (cells): first and last row for which `area_of_slip` may take it.

    Arguments as in `stick_rows`. Cells of the contact's outermost rows do not tell chords; of the next one outwards all
    slips, and would if it were wider. No rows (0, 0) where the stick zone has less than five, is in parts, or does not
    go on to the leading edge.
    """
    touched_low, touched_high, low, high = -1, -1, -1, -1
    for j in range(length.size):
        widths[j] = edges[1, j] - edges[0, j] - length[j]
        if count[j] > 0:
            touched_high = j
            if touched_low < 0:
                touched_low = j
        if length[j] > 0.0:
            if slip[index[0, j]] or (low >= 0 and high < j - 1):
                return 0, 0
            high = j
            if low < 0:
                low = j
    if low < 0:
        return 0, 0
    low, high = max(low, touched_low + 1), min(high, touched_high - 1)
    if high - low < 4:
        return 0, 0
    low_inner, high_inner = widths[low], widths[high]
    low_beyond, high_beyond = 2.0 * low_inner - widths[low + 1], 2.0 * high_inner - widths[high - 1]
    if touched_low < low - 1:
        low -= 1
        widths[low] = max(widths[low], low_beyond)
    if high + 1 < touched_high:
        high += 1
        widths[high] = max(widths[high], high_beyond)
    return low, high


@jit
def area_of_slip(chords: np.ndarray, tips: np.ndarray, widths: np.ndarray, low: int, high: int) -> float:
    """Area (cells) of a slip zone behind a stick zone that goes on to the contact's leading edge.

    chords [ny]: those of the contact, which lies between the rows tips [2]; widths [ny]: how much of each row slips,
    known from row low to row high. That goes straight from row to row, and on beyond those, as it hardly changes (in
    strips: not at all, Haines and Ollerton, 1963); the squares of chords go by parabolas. No more slips than there is.
    """
    parts = 32  # of the way from row to row
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
            j = min(max(math.floor(y), low), high - 1)
            width = widths[j] + (y - j) * (widths[j + 1] - widths[j])
            total += min(max(width, 0.0), math.sqrt(max(v, 0.0))) * step / parts
    return total


@jit
def shorten_tips(length: np.ndarray, chords: np.ndarray) -> None:
    """Chords length [ny] of the stick zone in the contact's outermost rows, whose cells do not tell them, in place.

    chords [ny]: those of the contact. As much of an outermost row slips as of the one beside it.
    """
    low, high = outermost(chords)
    if high - low < 2:
        return
    for outer, inner in ((low, low + 1), (high, high - 1)):
        length[outer] = max(0.0, min(length[outer], chords[outer] - (chords[inner] - length[inner])))
