"""The slip zone: its area and the largest values of the contact; on aligned cells with borders found between cells.

`kernels/stick.py` finds where each row sticks. From that follows the fraction of the contact that slips, and the area
of the contact follows from `edges.py`: both refer to the same edges. Where the stick zone is in one piece and extends
to the leading edge, the slip zone lies behind it, with a width that hardly changes from row to row
(`kernels/slip_width.py`); otherwise it is the rest of the contact around the stick zone.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.kernels import rows as row_kernels
from rcstudy.mechanics.kernels import slip_width, stick
from rcstudy.mechanics.rolling import RollingSolution
from rcstudy.mechanics.subcell.cusps import Cusps, Rise, by_room, difference, squares_with_cusps
from rcstudy.mechanics.subcell.edges import Outline
from rcstudy.mechanics.subcell.moved_rows import TIE, MovedRows
from rcstudy.mechanics.subcell.trailing import NARROW

# `slip_width.too_far_back` is for bodies that are alike. Otherwise `stick.border_behind` puts borders less far back
# (cells) by _BOW_BY_PRESSURE s times the curvature of the contact's outline (cells per row squared). s is beta/mu times
# the sum of -q_x over that of |q| in slip cells: the slip due to pressure in the direction of friction, over the
# coefficient of friction.
_BOW_BY_PRESSURE = 0.25
_MOST_UNLIKE = 0.71  # largest (d - c)/sqrt(c d), see `slip_width.too_far_back`: that of incompressible half-spaces
_AS_LARGE = 1e-6  # pressures differ by less, relatively, by rounding and the solver's tolerance
_NOT_KNOWN = np.full(2, np.nan)  # position of the tips of a zone


class SlipZone(NamedTuple):
    """A slip zone and the largest values of the contact.

    `area` (mm^2); largest `traction` and `pressure` (MPa); `cusps`: how these changed them (`aligned`; those of
    `kalker` are values of cells).
    """

    area: float
    traction: float
    pressure: float
    cusps: Cusps = Cusps()


class SlipZones:
    """Slip zones of contacts with the same `rows` and `outline`, between bodies with `influence`."""

    def __init__(self, rows: MovedRows, outline: Outline, influence: Influence, *, cusped: bool = False) -> None:
        self._rows, self._outline, self._cusped = rows, outline, cusped
        self._line = influence.half_line_of_tractions(outline.spacing[0])
        along, across = influence.slip_under_tractions
        self._unlike = min((across - along) / math.sqrt(along * across), _MOST_UNLIKE)
        self._by_pressure = influence.slip_by_pressure_over_tractions
        self._most = influence.most_slip_by_pressure_over_tractions

    def zone(self, rolling: RollingSolution, friction: float) -> SlipZone:
        """The slip zone, its border found between cells, and the largest traction and pressure.

        Tractions are largest at that border, where they equal mu p, or at the largest pressure, if it lies in slip. The
        pressure is largest at its summit or, if `cusped`, at that border (`cusps.py`; Johnson 1985, section 8.3).
        """
        slip, rows, outline = rolling.slip, self._rows, self._outline
        ny = rows.count.size
        widths, length, last = np.empty(ny), np.empty(ny), np.empty(ny, dtype=np.int64)
        borders, cells = np.empty((2 * slip.size, 2)), (rolling.q, slip, rows.pressure, friction)
        of_rows = rows.table, cells, rolling.s_ahead, NARROW, self._line
        found, largest, backwards = stick.stick_zone(*of_rows, widths, (borders, last, length))
        borders = borders[:found]
        at_borders = with_cusps = 0.0
        if found:
            squares = row_kernels.squares_at_borders(rows.profiles, borders)
            at_borders = with_cusps = row_kernels.peak_at_borders(squares, borders)
            if self._cusped:
                of_zone = (borders, last, length), squares, self._rise(borders, last, rolling, friction)
                cusped = squares_with_cusps(outline.p, outline.high, outline.far_field_ends, *of_zone)
                # between rows, too, no border has more than what a cusp adds to the largest pressure without
                rise = float((np.sqrt(cusped) - np.sqrt(squares)).max())
                with_cusps = min(row_kernels.peak_at_borders(cusped, borders), outline.summit[0] + max(rise, 0.0))
        # if the largest pressure lies in the slip zone, so does the largest traction of slip cells
        summit = outline.summit[0]
        of_cells_alone = friction * summit if self.slips_at_top(rolling) else largest
        top = max(summit, with_cusps) if self._cusped else summit
        # no border has a larger traction than mu times the largest pressure
        peak = min(max(of_cells_alone, friction * with_cusps), friction * top)
        smooth = min(max(of_cells_alone, friction * at_borders), friction * summit)
        if slip.any():
            area = self._area_behind((borders, last, length), widths < NARROW, cells, backwards / friction)
            area = self._area_around(length) if area is None else area
        else:
            dx, dy = outline.spacing
            area = min(float(np.nansum(widths)) * dx * dy, outline.within)
        return SlipZone(area, peak, top, Cusps(difference(top, summit), difference(peak, smooth), with_cusps))

    def _rise(self, borders: np.ndarray, last: np.ndarray, rolling: RollingSolution, friction: float) -> Rise:
        """How far pressures rise behind `borders` [n, 2]; last [ny]: as from `stick.stick_rows`."""
        rows, found = self._rows, np.full(len(borders), math.inf)
        j = np.flatnonzero(last >= 0)
        ahead = rows.start[j] - borders[last[j], 0]  # of the border, the row's leading cell (cells)
        step = np.floor(ahead).astype(np.int64) - 1
        j, ahead, step = j[step >= 0], ahead[step >= 0], step[step >= 0]
        second = rows.index[step, j]
        room = friction * rows.pressure[second] - np.hypot(*rolling.q[second].T)
        found[last[j]] = by_room(room, ahead - step, self._most)
        return Rise(friction * self._most, found)

    def slips_at_top(self, rolling: RollingSolution) -> bool:
        """Whether a cell closest to the largest pressure slips."""
        return any(rolling.slip[m] for m in self._top)

    @cached_property
    def _top(self) -> list[int]:
        """Numbers of the cells closest to the largest pressure: two if it lies halfway between two rows.

        If the pressure is as large elsewhere, as in mirror images of a summit, the cells there as well.
        """
        rows, p, (_, x, y) = self._rows, self._outline.p, self._outline.summit
        places = [(x, round(y - TIE)), (x, round(y + TIE))]
        for i, j in np.argwhere(p > (1.0 - _AS_LARGE) * p.max()).tolist():
            if abs(i - x) > 1.0 or abs(j - y) > 1.0:
                places.append((i, j))
        numbers = set()
        for along, row in places:
            count = int(rows.count[row])
            if count > 0:
                numbers.add(int(rows.index[min(max(round(rows.start[row] - along), 0), count - 1), row]))
        return sorted(numbers)

    def _area_behind(
        self,
        zone: tuple[np.ndarray, np.ndarray, np.ndarray],
        hidden: np.ndarray,
        cells: tuple[np.ndarray, np.ndarray, np.ndarray, float],
        backwards: float,
    ) -> float | None:
        """Area of the slip zone (mm^2) behind a stick zone in one piece, from its width in each row.

        zone, cells: as of `stick.stick_zone`; hidden [ny]: whether widths are hidden; backwards: the fraction of the
        slip cells' tractions that points towards -x (`stick.rooms_and_speeds`) over the friction coefficient. None if
        the outline is not smooth or the stick zone is not of this kind.
        """
        outline = self._outline
        if outline.smooth is None:
            return None
        dx, dy = outline.spacing
        bow = -_BOW_BY_PRESSURE * outline.smooth.curvature * backwards * self._by_pressure
        law = dx / dy, bow, self._unlike
        found, slips = slip_width.area_behind(zone, hidden, outline.smooth, self._rows.table, cells, law)
        return self._slipping_part(slips / outline.within_in_cells) if found else None

    def _area_around(self, length: np.ndarray) -> float:
        """Area of the slip zone (mm^2) around a stick zone with lengths length [ny] (cells) in the rows.

        Rows and borders refer to the same edges, so their ratio is the fraction of the contact that sticks.
        """
        slip_width.shorten_tips(length, self._outline.chords[0])
        # what chords miss of the contact's area they also miss of the stick zone's
        return self._slipping_part(1.0 - float(row_kernels.area_under(length, _NOT_KNOWN)) / self._outline.area_by_rows)

    def _slipping_part(self, part: float) -> float:
        """Area of the slip zone (mm^2), from the fraction `part` within the edges that slips or has lifted off."""
        return max(self._outline.within * min(max(part, 0.0), 1.0) - self._outline.lifted, 0.0)
