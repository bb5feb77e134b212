"""Where the edge of a contact lies between cells, and the area within it.

The outer three pressures of a row tell where it ends, and of a column, by what cells make of a straight edge on the
bodies at hand (`half_line.py`); each is taken where the edge is steep to it.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rcstudy.mechanics.half_line import HalfLine
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.kernels import outline as kernel
from rcstudy.mechanics.kernels import rows, smooth

# Edges at an angle are found so many cells too far in, in the mean over a contact of cells as long as wide; less where
# they are oblong (Hertz contacts of 4 to 40 cells per radius, round or 1 to 2.1: 0.0013 to 0.0025).
_AT_AN_ANGLE = 0.002
_OUTWARDS = np.array([[-1.0], [1.0]])  # of ends

_TERMS = 9  # of a smooth outline
_ROUGH = 0.1  # cells that the edges are off a smooth outline: more, and it has none


class Smooth(NamedTuple):
    """A smooth outline through the edges, which scatter by some 0.03 of a cell. Positions are in cells.

    ends [2, ny]: between which x the contact lies in each row, nan in rows that it does not reach; slopes [ny]: of the
    first of these, in cells per row; chords [ny]: between them, zero in rows that it does not reach; tips [2]: between
    which rows it lies; curvature: of its foremost and hindmost parts, in cells per row squared, about.
    """

    ends: np.ndarray
    slopes: np.ndarray
    chords: np.ndarray
    tips: np.ndarray
    curvature: float


class Outline:
    """The outline of the contact whose cells, of sides `spacing` (mm), have pressures `p` [nx, ny] (MPa).

    Rows are along x. `low`, `high` [ny]: the first and last cell in contact of each (`high` < `low` if there are none);
    `ends` [2, ny]: where its contact begins and ends, in cells from the centre of cell 0 of `p`; `ends_from_afar`
    [2, ny]: where it seems to, without what layers thinner than a cell do beside the edge. Aligned cells go by these,
    as layers do the same to tractions. `influence`: of the bodies; `by_x`, `by_y`: their half-lines.
    """

    def __init__(self, p: np.ndarray, spacing: tuple[float, float], influence: Influence) -> None:
        self.p, self.spacing, self.influence = p, spacing, influence
        self.by_x, self.by_y = (influence.half_line(side) for side in spacing)
        self.low, self.high, self.ends_from_afar, self.ends = self._ends(p, self.by_x)
        # a contact at the window's edge is refused later on; until then its cells must not leave the array
        for ends in (self.ends_from_afar, self.ends):
            np.clip(ends, -0.49, p.shape[0] - 0.51, out=ends)

    def _ends(self, p: np.ndarray, line: HalfLine) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """`low`, `high`, `ends_from_afar` and `ends` of pressures `p` in rows of cells whose half-line is `line`."""
        ny, seen = p.shape[1], line.from_afar
        low, high, from_afar = np.zeros(ny, dtype=np.int64), np.zeros(ny, dtype=np.int64), np.zeros((2, ny))
        rows.row_edges(p, seen, low, high, from_afar)
        farther = line.shift - seen.shift + _AT_AN_ANGLE * min(self.spacing) / max(self.spacing)
        # less than three cells do not tell so much
        return low, high, from_afar, from_afar + farther * _OUTWARDS * (high - low >= 2)

    @cached_property
    def area(self) -> float:
        """Area of the contact (mm^2), within its edges."""
        return self.within - self.lifted

    @cached_property
    def within(self) -> float:
        """Area (mm^2) within the edges, be there contact or not."""
        dx, dy = self.spacing
        return self.within_in_cells * dx * dy

    @cached_property
    def within_in_cells(self) -> float:
        """The same in cells."""
        return self._area_within(*self._crossings)

    @cached_property
    def beyond_edges(self) -> float:
        """Area (mm^2) between the edges that are seen from afar and those that layers make."""
        if not self.influence.layered:
            return 0.0
        (dx, dy), (low, high, from_afar, _) = self.spacing, self._columns
        seen = np.where(self.high >= self.low, self.ends_from_afar, np.nan), np.where(high >= low, from_afar, np.nan)
        return self.within - self._area_within(*seen) * dx * dy

    def _area_within(self, along: np.ndarray, across: np.ndarray) -> float:
        """Area in cells within an outline that crosses rows `along` [2, ny] and columns `across` [2, nx]."""
        found = kernel.area_within(along, across, *self.spacing)
        return float(found) if found > 0.0 else self.area_by_rows

    @cached_property
    def lifted(self) -> float:
        """Area (mm^2) where plates lift off within the contact, by cells.

        Those that both their row and their column hold between cells in contact: notches are outside the edges.
        """
        dx, dy = self.spacing
        nx, ny = self.p.shape
        low, high, _, _ = self._columns
        i, j = np.arange(nx)[:, None], np.arange(ny)
        held = (self.low <= i) & (i <= self.high) & (low[:, None] <= j) & (j <= high[:, None])
        return float(np.count_nonzero(held & (self.p <= 0.0))) * dx * dy

    @cached_property
    def _crossings(self) -> tuple[np.ndarray, np.ndarray]:
        """Where the contact's edge crosses rows [2, ny] and columns [2, nx], nan in those without contact."""
        low, high, _, ends = self._columns
        return np.where(self.high >= self.low, self.ends, np.nan), np.where(high >= low, ends, np.nan)

    @cached_property
    def _columns(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Of the contact's columns as if they were rows: `low`, `high`, `ends_from_afar` and `ends`."""
        return self._ends(np.ascontiguousarray(self.p.T), self.by_y)

    @cached_property
    def chords(self) -> tuple[np.ndarray, np.ndarray]:
        """Chords [ny] of the contact's rows, as seen from afar, in cells, and between which positions [2] it lies."""
        _, sides = self._crossings
        tips = np.array([np.nanmin(sides[0]), np.nanmax(sides[1])])
        chords = self.ends_from_afar[1] - self.ends_from_afar[0]
        rows.between_tips(chords, tips)
        return chords, tips

    @cached_property
    def smooth(self) -> Smooth | None:
        """The outline without the scatter of its edges, enclosing as much; None if it is not smooth."""
        dx, dy = self.spacing
        u, v = np.zeros((2, 2 * sum(self.p.shape)))
        n, x0, width, y0, height = kernel.trusted(*self._crossings, dx, dy, u, v)
        terms = fit_outline(u[:n], v[:n])
        if terms is None or smooth.off_outline(terms, u[:n], v[:n]) * math.sqrt(width * height) > _ROUGH:
            return None
        terms *= self.within_in_cells / (math.pi * terms[0] * width * height)
        ends, slopes = np.zeros((2, self.low.size)), np.zeros(self.low.size)
        tips = smooth.smooth_ends(terms, x0, width, y0, height, ends, slopes)
        return Smooth(ends, slopes, np.nan_to_num(ends[1] - ends[0]), np.array(tips), width / height**2)

    @cached_property
    def area_by_rows(self) -> float:
        """Area of the contact in cells, from its chords."""
        return float(rows.area_under(*self.chords))

    @cached_property
    def summit(self) -> tuple[float, float, float]:
        """Largest pressure (MPa), less what cells make too much of it, and its place along x and y, in cells."""
        summit: tuple[float, float, float] = kernel.summit(self.p, self.by_x.concentrated, self.by_y.concentrated)
        return summit


def fit_outline(u: np.ndarray, v: np.ndarray) -> np.ndarray | None:
    """Factors [9] of the mean and of four waves of the angle that fit r^2 of points u, v [n] best; None of too few."""
    if u.size < 2 * _TERMS:
        return None
    matrix, right = np.zeros((_TERMS, _TERMS)), np.zeros(_TERMS)
    smooth.normal_equations(u, v, matrix, right)
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return None
