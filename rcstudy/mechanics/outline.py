"""Area within an outline that is known where it crosses the rows and the columns of a mesh (`aligned.py`).

A crossing is found well where the outline is steep to its line, and badly where it runs along it. So rows tell the
parts of the outline that face x, columns those that face y. In coordinates scaled by the outline's half widths it is
nearly a circle, and half the mean of r^2 over the angle is its area but for little.
"""

from __future__ import annotations

import numpy as np

_LEAST = 3  # rows, and columns, of an outline


def area_within(rows: np.ndarray, columns: np.ndarray, spacing: tuple[float, float]) -> float | None:
    """Area (cells) within an outline that crosses row j at x = rows[:, j] and column i at y = columns[:, i].

    `rows` [2, ny], `columns` [2, nx]: positions in cells, the smaller first, nan in lines that it does not reach;
    `spacing` (mm): of columns and rows. None of an outline across fewer than three rows or columns.
    """
    j, i = np.flatnonzero(rows[0] <= rows[1]), np.flatnonzero(columns[0] <= columns[1])
    if min(j.size, i.size) < _LEAST:
        return None
    across, along = rows[:, j], columns[:, i]
    width, height = 0.5 * (across[1].max() - across[0].min()), 0.5 * (along[1].max() - along[0].min())
    if not (width > 0.0 and height > 0.0):
        return None
    # from the middle, in half widths: first where rows are crossed, then where columns are
    u = (np.concatenate([across.ravel(), i, i]) - across.mean()) / width
    v = (np.concatenate([j, j, along.ravel()]) - along.mean()) / height
    # the normal's components, of which the larger one tells whether rows or columns are to be believed
    faces_x = np.abs(u) * height * spacing[1] >= np.abs(v) * width * spacing[0]
    is_row = np.arange(u.size) < 2 * j.size
    believed = faces_x == is_row
    u, v = u[believed], v[believed]
    angle = np.arctan2(v, u)
    order = np.argsort(angle)
    angle, square = angle[order], (u * u + v * v)[order]
    steps = np.diff(angle, append=angle[0] + 2.0 * np.pi)
    return 0.25 * width * height * float(np.sum((square + np.roll(square, -1)) * steps))
