r"""Rows of cells that begin at the leading edge of the contact (`aligned.py`): their positions and pressures.

The discrete half-line. Take the slip of `rolling.py`, (u_i - u_(i+1))/dx with piecewise-constant tractions, on a row
with a straight leading edge. Its symbol is that of point sources halfway between control points, times a function rho
of the wave number, 1 - (k dx)^2/12 for long waves, which is removed here by `convolution.point_factor`. Under constant
slip the exact traction is proportional to the root of the distance from the edge. That of point sources is proportional
to Gamma(j + 3/2)/Gamma(j + 1), about sqrt(j + theta) with theta = 3/4, where j = 0, 1, ... counts cells from the
leading one. A Wiener-Hopf factorisation of the rest of rho changes theta to 0.748, one of all of rho to 0.825. So the
cells behave as if the contact began theta dx ahead of the leading cell's centre. If instead each cell whose centre is
in contact is used, the contact begins 0 to 1 cell ahead of that centre, 1/2 on average: the stick zone is too long, an
error of first order in dx, and scatters from row to row with the position of the edge between two cells.

Each row of cells is therefore moved along x by up to half a cell, so that its leading cell's centre lies theta dx
behind the far-field edge of the contact in that row: the edge without the local shift by layers thinner than a cell
(`Outline.far_field_ends`). A cell's pressure is the mean, over the cell, of a profile along the row in which p^2 is
piecewise linear (`rows.row_profile`).

A row carries the same force as on the mesh's own cells, except that neighbouring rows exchange the fraction
`HalfLine.excess` of the difference of their forces, as pressures constant in cells come out too concentrated.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from rcstudy.mechanics.convolution import Box
from rcstudy.mechanics.half_line import EDGE, HALF_SPACE
from rcstudy.mechanics.kernels import row_cells, row_fields, rows
from rcstudy.mechanics.subcell.edges import Outline

TIE = 1e-3
"""In cells: a position this close to the middle between two cells counts as a tie.

A tie is always decided the same way, or both cells are taken, so that the result does not depend on rounding.
"""

_LEAST = 1e-9  # least pressure of a cell, over the largest


class RowTable(NamedTuple):
    """Where the rows of a contact begin and end, and which cells are theirs, as kernels take it.

    numbers [most, ny]: of each row's cells from the leading one on, -1 beyond its last; starts [ny]: position of its
    leading cell's centre; counts [ny]: how many cells it has; ends [2, ny]: its trailing and leading far-field edge.
    Positions are in cells, from the centre of the box's first cell.
    """

    numbers: np.ndarray
    starts: np.ndarray
    counts: np.ndarray
    ends: np.ndarray


class MovedRows:
    """Rows of cells along x in a `box` of the window, moved so that they begin at the edges of `outline`.

    `window` (MPa): pressure on the mesh's own cells, those of the whole window; `like`: moved rows whose positions and
    cells are used here, too, where possible.

    `index`, `start`, `count`: numbers, starts and counts of the rows' `table`; `shift` [ny]: distance by which a row is
    moved (in cells). For each cell, `cells` [m, 2]: its indices in the box, rows of constant x first; `held` [nx, ny]:
    flags of these cells in the box; `pressure` [m] (MPa): mean over the cell; `middle` [m]: position along x at which
    its force acts (in cells); `weighted` [m] (MPa): mean of the pressure weighted with itself; `carrying` [m]: whether
    it carries load.
    """

    def __init__(self, window: np.ndarray, box: Box, outline: Outline, like: MovedRows | None = None) -> None:
        self._window, self._box, self._outline = window, box, outline
        p, (back, front) = outline.p, outline.far_field_ends
        touched = outline.high >= outline.low
        # a row shorter than twice theta cells has one cell, in its middle
        self.start = np.where(touched, np.maximum(front - EDGE, 0.5 * (back + front)), 0.0)
        self.count = np.where(touched, np.maximum(1, np.ceil(self.start - back)), 0).astype(np.int64)
        taken = self._keep_positions(like) if like is not None else None
        leading = np.rint(self.start - TIE).astype(np.int64)
        self.shift = self.start - leading
        number = int(self.count.sum())
        self.cells, self.held = np.zeros((number, 2), dtype=np.int64), np.zeros(p.shape, dtype=np.bool_)
        self.index = np.zeros((self.count.max(), self.count.size), dtype=np.int64)
        row_cells.number_cells(leading, self.count, self.held, self.cells, self.index)
        self.pressure, self.middle, self.weighted = np.zeros((3, number))
        self._force = np.zeros(self.count.size)
        row_cells.row_forces(p, self.count, HALF_SPACE.excess, self._force)
        rows.row_pressures(self._force, self.profiles, self.table, self.pressure, self.middle, self.weighted)
        if like is not None and taken is not None:
            self._update_pressures(like, taken)
        # a plate may lift off within a row: its cells carry no load there, but their traction bound must not be zero
        least = _LEAST * self.pressure.max(initial=0.0)
        self.carrying = self.pressure > least
        np.maximum(self.pressure, least, out=self.pressure)

    def _keep_positions(self, other: MovedRows) -> np.ndarray:
        """Use the rows of `other` where both have cells and these fit into the box; returns the rows' indices."""
        ahead, aside = other._box.i0 - self._box.i0, other._box.j0 - self._box.j0
        j = np.arange(max(aside, 0), min(aside + other.count.size, self.count.size))
        start, count = other.start[j - aside] + ahead, other.count[j - aside]
        leading = np.rint(start - TIE)
        room = (leading < self._box.shape[0]) & (leading - count >= -1)
        j, start, count = (values[room & (count > 0) & (self.count[j] > 0)] for values in (j, start, count))
        self.start[j], self.count[j] = start, count
        return j

    def _update_pressures(self, other: MovedRows, taken: np.ndarray) -> None:
        """Set the pressures of rows `taken` from `other`: those there plus the change on the mesh's own cells.

        They are not found from the edges, which jump when a cell comes into contact or leaves it.
        """
        aside = other._box.j0 - self._box.j0
        index = np.zeros((len(other.index), self.count.size), dtype=np.int64)
        index[:, taken] = other.index[:, taken - aside]
        before = np.ascontiguousarray(other._window[self._box.slices])
        of_cells = taken, other.pressure, index, self.pressure
        rows.update_row_pressures(self._outline.p, before, self._force, self.table, *of_cells)

    @cached_property
    def table(self) -> RowTable:
        """The rows as kernels take them."""
        return RowTable(self.index, self.start, self.count, self._outline.far_field_ends)

    @cached_property
    def profiles(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Profiles of p^2 along the rows (`rows.row_profiles`): knots, p^2 (MPa^2) there, number of knots [ny]."""
        outline, (nx, ny) = self._outline, self._outline.p.shape
        knots, squares = np.zeros((2, ny, 2 * nx + 3))
        profiles = knots, squares, np.zeros(ny, dtype=np.int64)
        of_rows = outline.low, outline.high, outline.far_field_ends
        rows.row_profiles(outline.p, *of_rows, outline.by_x.far_field, HALF_SPACE, profiles)
        return profiles

    @cached_property
    def neighbours(self) -> np.ndarray:
        """Numbers [2, m] of the cells ahead of and behind each cell; its own number where there is none."""
        out = np.zeros((2, len(self.cells)), dtype=np.int64)
        row_cells.row_neighbours(self.index, out)
        return out

    @cached_property
    def normals(self) -> np.ndarray:
        """Normal [2, ny] of the leading edge in each row."""
        return self._normals_of(1)

    @cached_property
    def trailing_normals(self) -> np.ndarray:
        """Normal [2, ny] of the trailing edge in each row, pointing inwards."""
        return self._normals_of(0)

    def _normals_of(self, end: int) -> np.ndarray:
        """Normals [2, ny], with a positive component along x, of the edge at this `end` of the rows."""
        dx, dy = self._outline.spacing
        normals = np.zeros((2, self.count.size))
        row_cells.edge_normals(self._outline.far_field_ends[end], self.index, dx / dy, normals)
        return normals

    @property
    def reach(self) -> tuple[int, int]:
        """Number of cells along x, from the hindmost to the foremost one, and number of rows in the box."""
        return int(self.cells[-1, 0] - self.cells[0, 0]) + 1, self.count.size

    def on_window(
        self, q: np.ndarray, s: np.ndarray, slip: np.ndarray, friction: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Tractions [2, nx, ny] (MPa), slips [2, nx, ny] and slip flags [nx, ny] at the centres of the window's cells.

        Interpolated along each row from `q` [m, 2], `s` [m, 2], `slip` [m] on the moved cells: in stick cells the
        traction over its bound, in slip cells the traction's direction and the size of slip. Zero outside the contact.
        """
        (own, pressure), corner = self.own, (self._box.i0, self._box.j0)
        window, states = np.zeros((4, *self._window.shape)), np.zeros(self._window.shape, dtype=np.bool_)
        of_cells = q, s, slip, friction * self.pressure, self.cells, self.held, self.shift
        row_fields.to_window(*of_cells, own, friction * pressure, corner, window, states)
        return window[:2], window[2:], states

    @cached_property
    def own(self) -> tuple[np.ndarray, np.ndarray]:
        """Indices [m, 2] in the box of the mesh's own cells in contact, and their pressures [m] (MPa)."""
        p = self._outline.p
        own = np.ascontiguousarray(np.argwhere(p > 0.0))
        return own, p[own[:, 0], own[:, 1]]
