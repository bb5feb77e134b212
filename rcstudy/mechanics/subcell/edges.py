"""Outline of a contact: where its edge lies between cells, and the area within it.

The position of the edge in a row or column of cells follows from its outer three pressures and the discrete half-line
of the bodies (`half_line.py`). Rows are used where the edge runs across them, columns elsewhere.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rcstudy.mechanics.half_line import HalfLine
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.kernels import outline as kernel
from rcstudy.mechanics.kernels import rows, smooth_outline

# Oblique edges are found this many cells too far inside, on average over a contact on square cells, and less on oblong
# cells (Hertz contacts of 4 to 40 cells per radius, round or elliptic, 1 to 2.1: 0.0013 to 0.0025).
_AT_AN_ANGLE = 0.002
_OUTWARDS = np.array([[-1.0], [1.0]])  # outward direction at the two ends of a row

_TERMS = 9  # Fourier coefficients of a smooth outline
_ROUGH = 0.1  # largest root mean square distance (cells) of the edges from a smooth outline, for it to be used


class Smooth(NamedTuple):
    """A smooth outline fitted to the edges, which scatter by about 0.03 cells. Positions are in cells.

    ends [2, ny]: positions along x of the trailing and leading edge in each row, nan in rows outside; slopes [ny]:
    slope of the trailing edge, in cells per row; chords [ny]: distances between the two ends, zero in rows outside;
    tips [2]: positions along y between which the contact lies; curvature: about that of its foremost and hindmost
    parts, in cells per row squared.
    """

    ends: np.ndarray
    slopes: np.ndarray
    chords: np.ndarray
    tips: np.ndarray
    curvature: float


class Outline:
    """The outline of a contact with pressures `p` [nx, ny] (MPa) in cells of sides `spacing` (mm).

    Rows are along x. `low`, `high` [ny]: first and last cell in contact of each row (`high` < `low` if there is none);
    `ends` [2, ny]: positions of its trailing and leading edge, in cells from the centre of cell 0 of `p`.
    `far_field_ends` [2, ny]: the same for the far-field edge, i.e. the edge of a contact of half-spaces with the same
    pressure away from the edge; the displacement of the edge by layers thinner than a cell is not included in it.
    Aligned cells are placed by the far-field edge, as such layers affect tractions in the same way. `influence`:
    coefficients of the bodies; `by_x`, `by_y`: their half-lines for rows and for columns.
    """

    def __init__(self, p: np.ndarray, spacing: tuple[float, float], influence: Influence) -> None:
        self.p, self.spacing, self.influence = p, spacing, influence
        self.by_x, self.by_y = (influence.half_line(side) for side in spacing)
        self.low, self.high, self.far_field_ends, self.ends = self._ends(p, self.by_x)
        # a contact at the window's edge is refused later; until then its cells must stay within the array
        for ends in (self.far_field_ends, self.ends):
            np.clip(ends, -0.49, p.shape[0] - 0.51, out=ends)

    def _ends(self, p: np.ndarray, line: HalfLine) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """`low`, `high`, `far_field_ends` and `ends` of the rows of pressures `p`; `line`: half-line of their cells."""
        ny, seen = p.shape[1], line.far_field
        low, high, far_field = np.zeros(ny, dtype=np.int64), np.zeros(ny, dtype=np.int64), np.zeros((2, ny))
        rows.row_edges(p, seen, low, high, far_field)
        return low, high, far_field, far_field + self._outwards(low, high, line.shift - seen.shift)

    def _outwards(self, low: np.ndarray, high: np.ndarray, by_layers: float = 0.0) -> np.ndarray:
        """How far the ends [2, n] of rows of cells `low` to `high` lie outside their far-field ends, in cells.

        `by_layers`: how far layers move them; to this comes what oblique edges are off by.
        """
        farther = by_layers + _AT_AN_ANGLE * min(self.spacing) / max(self.spacing)
        # fewer than three cells do not determine the edge well enough for this
        outwards: np.ndarray = farther * _OUTWARDS * (high - low >= 2)
        return outwards

    @cached_property
    def area(self) -> float:
        """Area of the contact (mm^2): that within its edges less where it has lifted off."""
        return self.within - self.lifted

    @cached_property
    def within(self) -> float:
        """Area (mm^2) within the edges, including regions that have lifted off."""
        dx, dy = self.spacing
        return self.within_in_cells * dx * dy

    @cached_property
    def within_in_cells(self) -> float:
        """Area within the edges, in cells, including regions that have lifted off."""
        return self._area_within(*self._crossings)

    @cached_property
    def area_by_layers(self) -> float:
        """Area (mm^2) within the edges less that within the far-field ones; 0 without layers.

        Both have the same correction of oblique edges, so that layers of no effect add nothing.
        """
        if not self.influence.layered:
            return 0.0
        (dx, dy), (low, high, far_field, _) = self.spacing, self._columns
        along, across = self.far_field_ends + self._outwards(self.low, self.high), far_field + self._outwards(low, high)
        seen = np.where(self.high >= self.low, along, np.nan), np.where(high >= low, across, np.nan)
        return self.within - self._area_within(*seen) * dx * dy

    def _area_within(self, along: np.ndarray, across: np.ndarray) -> float:
        """Area, in cells, within an outline that crosses rows at `along` [2, ny] and columns at `across` [2, nx]."""
        found = kernel.area_within(along, across, *self.spacing)
        return float(found) if found > 0.0 else self.area_by_rows

    @cached_property
    def lifted(self) -> float:
        """Area (mm^2) of the cells within the contact where plates have lifted off.

        They have no pressure and lie between cells in contact both in their row and in their column. Notches do not
        count: they are outside the edges.
        """
        dx, dy = self.spacing
        nx, ny = self.p.shape
        low, high, _, _ = self._columns
        i, j = np.arange(nx)[:, None], np.arange(ny)
        held = (self.low <= i) & (i <= self.high) & (low[:, None] <= j) & (j <= high[:, None])
        return float(np.count_nonzero(held & (self.p <= 0.0))) * dx * dy

    @cached_property
    def _crossings(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions of the contact's edge in rows [2, ny] and columns [2, nx], nan in those without contact."""
        low, high, _, ends = self._columns
        return np.where(self.high >= self.low, self.ends, np.nan), np.where(high >= low, ends, np.nan)

    @cached_property
    def _columns(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """`low`, `high`, `far_field_ends` and `ends` of the contact's columns."""
        return self._ends(np.ascontiguousarray(self.p.T), self.by_y)

    @cached_property
    def chords(self) -> tuple[np.ndarray, np.ndarray]:
        """Chords [ny] of the contact's rows between the far-field edges, and its extent along y [2], in cells."""
        _, sides = self._crossings
        tips = np.array([np.nanmin(sides[0]), np.nanmax(sides[1])])
        chords = self.far_field_ends[1] - self.far_field_ends[0]
        rows.between_tips(chords, tips)
        return chords, tips

    @cached_property
    def smooth(self) -> Smooth | None:
        """Smooth outline fitted to the edges, with the same area within; None if the edges are not close to one."""
        dx, dy = self.spacing
        u, v = np.zeros((2, 2 * sum(self.p.shape)))
        n, x0, width, y0, height = kernel.accurate_crossings(*self._crossings, dx, dy, u, v)
        terms = fit_outline(u[:n], v[:n])
        if terms is None or smooth_outline.off_outline(terms, u[:n], v[:n]) * math.sqrt(width * height) > _ROUGH:
            return None
        terms *= self.within_in_cells / (math.pi * terms[0] * width * height)
        ends, slopes = np.zeros((2, self.low.size)), np.zeros(self.low.size)
        tips = smooth_outline.smooth_ends(terms, x0, width, y0, height, ends, slopes)
        return Smooth(ends, slopes, np.nan_to_num(ends[1] - ends[0]), np.array(tips), width / height**2)

    @cached_property
    def area_by_rows(self) -> float:
        """Area of the contact, in cells, from the chords of its rows."""
        return float(rows.area_under(*self.chords))

    @cached_property
    def summit(self) -> tuple[float, float, float]:
        """Largest pressure (MPa), corrected for the discretisation error, and its position along x and y in cells."""
        summit: tuple[float, float, float] = kernel.summit(self.p, self.by_x.excess, self.by_y.excess)
        return summit


def fit_outline(u: np.ndarray, v: np.ndarray) -> np.ndarray | None:
    """Least-squares Fourier coefficients [9], up to order 4, of r^2 of points u, v [n] over the angle.

    None if the points are too few or do not determine them.
    """
    if u.size < 2 * _TERMS:
        return None
    matrix, right = np.zeros((_TERMS, _TERMS)), np.zeros(_TERMS)
    smooth_outline.normal_equations(u, v, matrix, right)
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return None
