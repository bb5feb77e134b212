"""Where the edge of a contact lies between cells, and the area within it.

p^2 falls almost linearly towards the edge. Where the parabola through it of the outer three cells of a row comes to
zero tells the edge, by a table (`SEEN`, `TRUE`), in columns as in rows; each is taken where the edge is steep to it.
What layers thinner than cells make of the edge, which no cell sees, is added (`skins.py`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.kernels import outline as kernel
from rcstudy.mechanics.kernels import rows, smooth
from rcstudy.mechanics.skins import shift_by_layers, shift_under_soft_layers

# Where the parabola through p^2 of the outer three cells of a row comes to zero, in cells from the outermost centre,
# and where the contact ends in truth: the two-dimensional contact of a cylinder on many cells, moved over the mesh.
# Good to 0.03 cells also for edges at an angle. An edge farther out than 0.85 brings the next cell into contact.
SEEN = np.concatenate(
    (
        [0.0006, 0.0052, 0.0139, 0.0263, 0.0421, 0.0613, 0.0838, 0.1098, 0.1393, 0.1728, 0.2105],
        [0.2529, 0.3009, 0.3552, 0.4172, 0.4884, 0.5712, 0.6690, 0.7871, 0.9338, 1.1200],
    )
)
TRUE = np.linspace(-0.15, 0.85, SEEN.size)

CONCENTRATED = 1.0 / 48.0
"""Of second differences of the pressure, by which it comes out too large on cells.

A pressure that is constant in each cell causes less of short waves, by 1 - (k dx)^2/24 along x and as much along y, and
so it comes out too concentrated. Half of what that would make is measured, in Hertz contacts of 5 to 43 cells per
radius, round or 1 to 3.3, on cells as long as wide and half or twice as long: sums over rows are off by -1/48 of their
second differences, the outermost carrying too little by what all others carry too much (0.018 to 0.020 of it makes the
second moment right), and the largest pressure by -1/48 of its own along x and along y (of its error a sixth is left).
"""

_TERMS = 9  # of a smooth outline
_ROUGH = 0.1  # cells that the edges are off a smooth outline: more, and it has none
_MOST_BEYOND = 0.25  # of the area that cells find, that layers make it larger or smaller: of contacts of a few cells


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
    `ends` [2, ny]: where its contact begins and ends, in cells from the centre of cell 0 of `p`. `influence`: of the
    bodies.
    """

    def __init__(self, p: np.ndarray, spacing: tuple[float, float], influence: Influence) -> None:
        self.p, self.spacing, self.influence = p, spacing, influence
        self.low, self.high, self.ends = _edges_of(p)
        # a contact at the window's edge is refused later on; until then its cells must not leave the array
        np.clip(self.ends, -0.49, p.shape[0] - 0.51, out=self.ends)

    @cached_property
    def area(self) -> float:
        """Area of the contact (mm^2), within its edges: by parabolas, moved by what these and thin layers miss."""
        return self.within - self.lifted

    @cached_property
    def within(self) -> float:
        """Area (mm^2) within the edges, be there contact or not."""
        dx, dy = self.spacing
        return self._area_within(bent=True) * dx * dy + self.beyond_edges - self.short_of_edges

    @cached_property
    def beyond_edges(self) -> float:
        """Area (mm^2) between the edges that cells find and those that layers make (`skins.py`); that of an ellipse."""
        return self._along_outline(shift_by_layers)

    @cached_property
    def short_of_edges(self) -> float:
        """Area (mm^2) by which edges are found too far out on soft layers a few cells thick (`skins.py`)."""
        return self._along_outline(shift_under_soft_layers)

    def _along_outline(self, width: Callable[[Callable[[np.ndarray], np.ndarray], float], float]) -> float:
        """Area (mm^2) along an ellipse of a `width` in cells that follows from how layers yield to pressure."""
        if not self.influence.layered:
            return 0.0
        spacing = self.spacing
        response, once = self.influence.normal_response, self.influence.once
        by_x, by_y = (side * once((width, side), partial(width, response, side)) for side in spacing)
        _, tips = self.chords
        area = self.area_by_parabolas * spacing[0] * spacing[1]
        b = 0.5 * float(tips[1] - tips[0]) * spacing[1]
        a = area / (math.pi * b)
        outline = math.pi * (3.0 * (a + b) - math.sqrt((3.0 * a + b) * (a + 3.0 * b)))  # Ramanujan 1914
        along = outline * (by_x * b + by_y * a) / (a + b)
        return min(max(along, -_MOST_BEYOND * area), _MOST_BEYOND * area)

    @cached_property
    def lifted(self) -> float:
        """Area (mm^2) where plates lift off within the contact, by cells.

        Those that both their row and their column hold between cells in contact: notches are outside the edges.
        """
        dx, dy = self.spacing
        nx, ny = self.p.shape
        _, low, high, _ = self._columns
        i, j = np.arange(nx)[:, None], np.arange(ny)
        held = (self.low <= i) & (i <= self.high) & (low[:, None] <= j) & (j <= high[:, None])
        return float(np.count_nonzero(held & (self.p <= 0.0))) * dx * dy

    @cached_property
    def area_by_parabolas(self) -> float:
        """Area in cells within the edges that rows have."""
        return self._area_within(bent=False)

    def _area_within(self, *, bent: bool) -> float:
        """Area in cells within the edges of rows and columns, by parabolas or moved by what these miss (`bent`)."""
        dx, dy = self.spacing
        found = kernel.area_within(*(self._crossings_by(bent=True) if bent else self._crossings), dx, dy)
        return float(found) if found > 0.0 else self.area_by_rows

    @cached_property
    def _crossings(self) -> tuple[np.ndarray, np.ndarray]:
        """Where the contact's edge crosses rows [2, ny] and columns [2, nx], by parabolas."""
        return self._crossings_by(bent=False)

    def _crossings_by(self, *, bent: bool) -> tuple[np.ndarray, np.ndarray]:
        """The same, or moved by what parabolas miss (`bent`)."""
        rows_and_columns = (self.p, self.low, self.high, self.ends), self._columns
        along, across = (_crossings(*lines, bent=bent) for lines in rows_and_columns)
        return along, across

    @cached_property
    def _columns(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The contact's columns as if they were rows: pressures [ny, nx], and what `_edges_of` finds."""
        p = np.ascontiguousarray(self.p.T)
        return p, *_edges_of(p)

    @cached_property
    def chords(self) -> tuple[np.ndarray, np.ndarray]:
        """Chords [ny] of the contact's rows, in cells, and between which positions [2], in rows, it lies."""
        _, sides = self._crossings
        tips = np.array([np.nanmin(sides[0]), np.nanmax(sides[1])])
        chords = self.ends[1] - self.ends[0]
        rows.between_tips(chords, tips)
        return chords, tips

    @cached_property
    def smooth(self) -> Smooth | None:
        """The outline without the scatter of its edges, enclosing `area_by_parabolas`; None if it is not smooth."""
        dx, dy = self.spacing
        u, v = np.zeros((2, 2 * sum(self.p.shape)))
        n, x0, width, y0, height = kernel.trusted(*self._crossings, dx, dy, u, v)
        terms = fit_outline(u[:n], v[:n])
        if terms is None or smooth.off_outline(terms, u[:n], v[:n]) * math.sqrt(width * height) > _ROUGH:
            return None
        terms *= self.area_by_parabolas / (math.pi * terms[0] * width * height)
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
        summit: tuple[float, float, float] = kernel.summit(self.p, CONCENTRATED)
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


def _crossings(
    p: np.ndarray, low: np.ndarray, high: np.ndarray, edges: np.ndarray, *, bent: bool = False
) -> np.ndarray:
    """Where the contact begins and ends [2, ny] in rows of pressures `p` [nx, ny], nan in those without contact.

    low, high, edges: as `_edges_of` finds them; `bent`: edges moved by `outline.bend_edges`.
    """
    if bent:
        edges = edges.copy()
        kernel.bend_edges(p, low, high, edges)
    return np.where(high >= low, edges, np.nan)


def _edges_of(p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First and last cell [ny] in contact of each row of pressures `p` [nx, ny], and where its contact ends [2, ny]."""
    ny = p.shape[1]
    low, high, edges = np.zeros(ny, dtype=np.int64), np.zeros(ny, dtype=np.int64), np.zeros((2, ny))
    rows.row_edges(p, SEEN, TRUE, low, high, edges)
    return low, high, edges
