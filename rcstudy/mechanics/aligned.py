r"""Cells that begin where the contact begins (`discretisation: aligned`).

The discrete half-line. Take the slip of `rolling.py`, (u_i - u_(i+1))/dx with piecewise-constant tractions, on a row
with a straight leading edge. Its symbol is that of point sources halfway between control points, times a function rho
of the wave number, 1 - (k dx)^2/12 for long waves; here `point_factor` takes that out. Under constant slip the exact
traction goes like the root of the distance from the edge, that of point sources like Gamma(j + 3/2)/Gamma(j + 1), which
is sqrt(j + theta) with theta = 3/4, j = 0, 1, ... counted from the leading cell; factoring what is left of rho (Wiener
and Hopf) makes it 0.748, factoring all of it 0.825. So the cells behave as if the contact began theta dx ahead of the
leading cell's centre. Where cells are taken by their centres it begins 0 to 1 cell ahead, 1/2 on average: too long a
stick zone, of first order in dx, plus a noise of rows that end between cells.

Hence:

- each row of cells is moved along x, by up to half a cell, so that its leading cell's centre lies theta dx behind the
  edge of the contact in that row. That edge is where p^2, which falls almost linearly, comes to zero. Rows are moved
  by phases between the two stages of the transforms;
- the bound is the mean of mu p over the moved cell; each row keeps its force, and moments take it where it is;
- slip by pressure loses in the leading cells what the half-line makes too much of it (`_LEADING`), and slip across
  tractions gains there what it makes too little (`_CROSS`);
- slip belongs to the point x + dx/2 between a cell and the one ahead, so spin is taken there, whatever `spin_point`;
  in slip cells the direction of slip is taken at the cell's centre, by a parabola through the points half a cell ahead,
  half behind and one and a half ahead (`centring.py`);
- the contact's area is that within its edge, found between cells in each row and column (`kernels/outline.py`) and
  moved by what layers thinner than cells do to it (`skins.py`); the part of it that slips lies between the borders of
  the stick zone and the edge behind them (`kernels/stick.py`).

Errors are then of order dx^1.5, and small. Results on the mesh's own cells are interpolated: the fraction of the bound
in stick cells, direction and slip in slip cells.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from rcstudy.mechanics.contact import NormalContact
from rcstudy.mechanics.convolution import (
    Box,
    PairOperator,
    ShiftedTransform,
    padded_around,
    padded_shape,
    point_factor,
    pressure_quadrants,
    real_symbols,
    row_phases,
    sharp_difference,
    shifted_transform,
    symbols,
    traction_quadrants,
)
from rcstudy.mechanics.edges import TRUE, Outline
from rcstudy.mechanics.kernels import row_cells, rows, smooth, stick
from rcstudy.mechanics.rolling import RollingSolution
from rcstudy.mechanics.scene import Creepage, Scene
from rcstudy.mechanics.skins import BORDERS, shift_by_layers
from rcstudy.mechanics.slip_operator import SlipOperator
from rcstudy.mechanics.unseen import Unseen, unseen_slip

_EDGE = 0.7480  # theta: distance from the leading cell's centre to where the contact seems to begin, in cells
_SPIN_POINT = 0.5  # in cells ahead of the centre
# Pressure causes slip on the spot in proportion (Johnson 1985, 2.25a), so that it goes like the root of the distance
# from the edge, too. What tractions make of slips is their sum with weights of nearly Gamma(j + 1/2)/Gamma(j + 1), by
# which equal ones come out right. Slips by such a pressure come out too large, by what this part of it does in the
# leading cell. Where the edge is at an angle they point along its normal and are smaller by its component along x.
_LEADING = 0.0264
# Where the leading edge is at an angle tractions of the leading cells make too little of the slip across them: by the
# product of the components of the edge's normal times so much of what waves of wave number 1/dx along them yield more
# than across. 0.09 takes errors of first order from moments by lateral creepage and lateral forces by spin (round
# contacts, nu 0.3 to 0.5); with 0.07 those of second order are smaller at ten to twenty cells a radius.
_CROSS = 0.07

# By how much the cell beside the outermost one is pressed more than its centre in the true contact, of that
# cylinder of which `edges.TRUE` is.
_PRESSED = np.concatenate(
    (
        [1.0465, 1.0384, 1.0315, 1.0257, 1.0208, 1.0167, 1.0134, 1.0106, 1.0083, 1.0065, 1.0051],
        [1.0042, 1.0036, 1.0033, 1.0033, 1.0036, 1.0041, 1.0048, 1.0058, 1.0069, 1.0080],
    )
)
# Borders of the stick zone that run along y are found too far back by so much of their curvature, less where pressure
# helps friction; oblique ones by more where tractions go along y (35 contacts on 32 and 64 cells against 512).
_BOW, _BOW_BY_PRESSURE, _ACROSS = 0.09, 0.25, 0.5
_NOT_KNOWN = np.full(2, np.nan)  # where a zone's tips are
_LEAST = 1e-9  # least pressure of a cell, over the largest
_HALFWAY = 1e-3  # in cells: closer to the middle between two, either or both are taken, whatever rounding says


class AlignedContact(NormalContact):
    """A contact for the tractions on rows of cells that begin where the contact begins.

    In place of the mesh's cells in contact it has `cells` of rows moved by `shift` [ny] cells along x. `coarser`: other
    than made from that of `contact`. `like`: rows have the places and cells that they have there, as far as they can.
    `carrying` [m]: flags of the cells that carry something.
    """

    def __init__(
        self, contact: NormalContact, coarser: NormalContact | None = None, like: AlignedContact | None = None
    ) -> None:
        box = contact.box.grown(1, 0, contact.scene.mesh.cells)
        if coarser is None and contact.coarser is not None:
            coarser = AlignedContact(contact.coarser)
        super().__init__(contact.scene, contact.influence, contact.solution, box, coarser)
        self._p = p = np.ascontiguousarray(self.solution.p[box.slices])
        ny = p.shape[1]
        self.outline = outline = Outline(p, contact.scene.mesh.spacing, contact.influence)
        touched = outline.high >= outline.low
        back, front = outline.ends
        # a row shorter than twice theta cells has one cell, in its middle
        self._start = np.where(touched, np.maximum(front - _EDGE, 0.5 * (back + front)), 0.0)
        self._count = np.where(touched, np.maximum(1, np.ceil(self._start - back)), 0).astype(np.int64)
        taken = self._take_rows(like) if like is not None else None
        leading = np.rint(self._start - _HALFWAY).astype(np.int64)
        self.shift = self._start - leading
        number = int(self._count.sum())
        # ordered as everywhere: rows of constant x first
        self._cells, self._held = np.zeros((number, 2), dtype=np.int64), np.zeros(p.shape, dtype=np.bool_)
        self._index = np.zeros((self._count.max(), ny), dtype=np.int64)
        row_cells.number_cells(leading, self._count, self._held, self._cells, self._index)
        knots, squares = np.zeros((2, ny, 2 * p.shape[0] + 3))
        self._profiles = knots, squares, np.zeros(ny, dtype=np.int64)
        rows.row_profiles(p, outline.low, outline.high, outline.ends, TRUE, _PRESSED, *self._profiles)
        self._pressure, self._middle = np.zeros(number), np.zeros(number)
        of_cells = self._start, self._count, self._index, self._pressure, self._middle
        rows.row_bounds(p, *self._profiles, *of_cells)
        if like is not None and taken is not None:
            self._carry_on(like, taken)
        # plates can lift off within a row: what they carry there is nothing, but a bound must not be
        least = _LEAST * self._pressure.max(initial=0.0)
        self.carrying = self._pressure > least
        np.maximum(self._pressure, least, out=self._pressure)

    def _take_rows(self, other: AlignedContact) -> np.ndarray:
        """Take the rows of `other`, where both have cells and the box has room for them; returns which."""
        ahead, aside = other.box.i0 - self.box.i0, other.box.j0 - self.box.j0
        j = np.arange(max(aside, 0), min(aside + other._count.size, self._count.size))
        start, count = other._start[j - aside] + ahead, other._count[j - aside]
        leading = np.rint(start - _HALFWAY)
        room = (leading < self.box.shape[0]) & (leading - count >= -1)
        j, start, count = (values[room & (count > 0) & (self._count[j] > 0)] for values in (j, start, count))
        self._start[j], self._count[j] = start, count
        return j

    def _carry_on(self, other: AlignedContact, taken: np.ndarray) -> None:
        """Pressures of the rows `taken` from `other`: as there, but for what that of the mesh's own cells changed by.

        Edges between cells jump when a cell comes into contact or leaves it, and pressures by them do.
        """
        aside = other.box.j0 - self.box.j0
        index = np.zeros((len(other._index), self._count.size), dtype=np.int64)
        index[:, taken] = other._index[:, taken - aside]
        before = np.ascontiguousarray(other.solution.p[self.box.slices])
        of_cells = self._start, self._count, self._index, taken
        rows.carry_on(self._p, before, *of_cells, other._pressure, index, self._pressure)

    @cached_property
    def cells(self) -> np.ndarray:
        """Indices [m, 2] in the box of the cells with tractions, rows of constant x first."""
        return self._cells

    @cached_property
    def pressure(self) -> np.ndarray:
        """Mean pressure [m] (MPa) over the moved cells."""
        return self._pressure

    @cached_property
    def centres(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates x [m], y [m] (mm) of the moved cells."""
        x, y = self.scene.mesh.centres
        i, j = self.cells.T
        return x[self.box.i0 + i] + self.shift[j] * self.scene.mesh.spacing[0], y[self.box.j0 + j]

    @cached_property
    def levers(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates x [m], y [m] (mm) of the middle of each cell's force; outermost cells hold what lies beyond."""
        dx = self.scene.mesh.spacing[0]
        i, j = self.cells.T
        x, y = self.centres
        return x + (self._middle - (i + self.shift[j])) * dx, y

    @cached_property
    def neighbours(self) -> np.ndarray:
        """Numbers [2, m] of the cells ahead and behind each cell, its own where there is none."""
        out = np.zeros((2, len(self.cells)), dtype=np.int64)
        row_cells.row_neighbours(self._index, out)
        return out

    @cached_property
    def slip_by_pressure(self) -> np.ndarray:
        """Slip [m, 2] by the displacement along the surface that the pressure, as on the moved cells, causes."""
        if not self.scene.moves_by_pressure:
            return np.zeros((len(self.cells), 2))
        padded = self._padded

        def make() -> np.ndarray:
            symbol = symbols(pressure_quadrants(self.influence.around(padded)), padded, x_first=True)
            symbol *= sharp_difference(padded[0], self.influence.spacing[0])[:, None]
            return symbol

        # first of all: of a contact one row wide the symbols are made in this very plan
        hat = self.influence.once(("by pressure, x first", padded), make)
        plan = shifted_transform(padded, 2, self.box.shape[1]).shifted(self._phase)
        slips = self._convolved(self.pressure, hat, plan, plan)[:, self.cells[:, 0], self.cells[:, 1]]
        return self.eased(np.ascontiguousarray(slips.T))

    def eased(self, s: np.ndarray) -> np.ndarray:
        """Slips `s` [m, 2] by pressure, changed in place, without what leading cells make too much of them."""
        part = _LEADING * self.influence.slip_under_pressure
        row_cells.ease_leading_cells(self._edge_normals, self._index, self.pressure, part, s)
        return s

    @cached_property
    def _edge_normals(self) -> np.ndarray:
        """Normal [2, ny] of the leading edge in each row."""
        dx, dy = self.scene.mesh.spacing
        normals = np.zeros((2, self._count.size))
        row_cells.edge_normals(self.outline.ends[1], self._index, dx / dy, normals)
        return normals

    @cached_property
    def _crossing(self) -> tuple[np.ndarray, np.ndarray]:
        """Numbers [n] of the rows' leading cells, and what slip across them a unit of traction causes there besides."""
        held = self._count > 0
        dx = self.scene.mesh.spacing[0]
        along, across = self.influence.traction_responses(np.array([1.0 / dx]))[:, 0] / dx
        return self._index[0, held], _CROSS * (along - across) * self._edge_normals[:, held].prod(axis=0)

    def cross_slip(self, q: np.ndarray) -> np.ndarray:
        """Slips [m, 2] that leading cells' tractions `q` [m, 2] cause across them beside their displacements."""
        leading, part = self._crossing
        s = np.zeros(q.shape)
        s[leading] = part[:, None] * q[leading, ::-1]
        return s

    @cached_property
    def displacement_by_pressure(self) -> np.ndarray:
        """Displacements [2, nx + 1, ny] (mm) along the surface by the pressure on the moved rows, for the proof."""
        nx, ny = self.box.shape
        if not self.scene.moves_by_pressure:
            return np.zeros((2, nx + 1, ny))
        padded = self._padded
        hat = self._along_by_pressure(padded)
        plan = shifted_transform(padded, 2, ny).shifted(self._phase, point_factor(padded[0], hat.shape[1]))
        return self._convolved(self.pressure, hat, plan, plan)[:, : nx + 1].copy()

    def _along_by_pressure(self, padded: tuple[int, int]) -> np.ndarray:
        """Symbols of displacements along the surface by pressure, waves along x first."""
        influence = self.influence

        def make() -> np.ndarray:
            return symbols(pressure_quadrants(influence.around(padded)), padded, x_first=True)

        return influence.once(("along, x first", padded), make)

    def lift(self, q: np.ndarray, box: Box) -> np.ndarray:
        """u_z (mm, [nx, ny] of `box`) at the cells as they are by tractions `q` [m, 2] on the moved rows.

        As without moved rows: they are moved on the way there and not back. `box` must hold the contact.
        """
        padded = padded_around(self.box, box)
        # first of all: of a contact one row wide the symbols are made in this very plan
        hat = self._along_by_pressure(padded)
        corner = self.box.i0 - box.i0, self.box.j0 - box.j0
        shift = np.zeros(box.shape[1])
        shift[corner[1] : corner[1] + self.shift.size] = self.shift
        plan = shifted_transform(padded, 2, box.shape[1])
        there = plan.shifted(row_phases(padded[0], shift))
        lift: np.ndarray = -self._convolved(q.T, hat, there, plan, corner)[:, : box.shape[0]].sum(axis=0)
        return lift

    def _convolved(
        self,
        stress: np.ndarray,
        symbol: np.ndarray,
        there: ShiftedTransform,
        back: ShiftedTransform,
        corner: tuple[int, int] = (0, 0),
    ) -> np.ndarray:
        """Products [2, nx, ny] with `symbol` of `stress` [m] or [2, m] on the moved cells, in the array of `back`.

        `there` and `back` are plans of the same arrays, moved or not; the box begins at their cell `corner`.
        """
        there.real[:] = 0.0
        there.by_cell[:, self.cells[:, 0] + corner[0], self.cells[:, 1] + corner[1]] = stress
        there.forward()
        there.hat *= symbol
        back.backward()
        products: np.ndarray = back.by_cell
        return products

    @cached_property
    def _phase(self) -> np.ndarray:
        """What moves the rows on the torus `_padded`."""
        return row_phases(self._padded[0], self.shift)

    @cached_property
    def operator(self) -> SlipOperator:
        """Slip by tractions on the moved rows, as far as these have cells."""
        leading, part = self._crossing
        operator = SlipOperator.of(self.influence, self._reach, sharp=True)
        return operator.moved(self._phase, self.cells_of_operator[leading], part)

    @cached_property
    def cells_of_operator(self) -> np.ndarray:
        """Indices [m, 2] of the cells among those of the `operator`."""
        return self.cells - [self.cells[0, 0], 0]

    @cached_property
    def displacement(self) -> PairOperator:
        """Displacements by tractions on the moved rows of the box and one more row of cells ahead of it (+x)."""
        shape = self.box.shape[0] + 1, self.box.shape[1]
        symbol = real_symbols(traction_quadrants(self.influence.around(self._padded)), self._padded, x_first=True)
        sharpened = point_factor(self._padded[0], symbol.shape[1])
        plan = shifted_transform(self._padded, 2, shape[1]).shifted(self._phase, sharpened)
        return PairOperator(symbol, shape, plan)

    @property
    def _padded(self) -> tuple[int, int]:
        """Shape of the torus for displacements on `_reach` and a row ahead, and `point_factor`'s spread by one more."""
        return padded_shape((self._reach[0] + 2, self._reach[1]))

    @cached_property
    def _reach(self) -> tuple[int, int]:
        """How many cells there are along x, from the hindmost to the foremost one, and rows in the box."""
        return int(self.cells[-1, 0] - self.cells[0, 0]) + 1, self.box.shape[1]

    def rigid_slip(self, creepage: Creepage, spin_point: float) -> np.ndarray:
        """Rigid slip [m, 2] where slip belongs, half a cell ahead; `spin_point` is for cells that are not moved."""
        return super().rigid_slip(creepage, _SPIN_POINT)

    @cached_property
    def _slip_by_pressure_at_centres(self) -> np.ndarray:
        result: np.ndarray = 0.5 * (self.slip_by_pressure + self.slip_by_pressure[self.neighbours[1]])
        return result

    def friction_power(self, rolling: RollingSolution, scene: Scene) -> float:
        """Power that friction takes, per unit rolling speed (N): -sum q.(w + s_p) dx dy, both at the cells' centres.

        In -sum q.s the elastic slip by tractions does no work on the whole (its operator is antisymmetric) but for
        errors of order dx, so it is left out.
        """
        if scene.creepage is None:
            return 0.0
        w = super().rigid_slip(scene.creepage, 0.0) + self._slip_by_pressure_at_centres
        dx, dy = self.scene.mesh.spacing
        return -float(np.sum(rolling.q * w)) * dx * dy

    def on_window(
        self, q: np.ndarray, s: np.ndarray, slip: np.ndarray, friction: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Tractions [2, nx, ny] (MPa), slips [2, nx, ny] and slip flags [nx, ny] at the centres of the window's cells.

        From those `q` [m, 2], `s` [m, 2], `slip` [m] on the moved cells; zero outside the contact.
        """
        values, flags = np.zeros((4, *self.box.shape)), np.zeros(self.box.shape, dtype=np.bool_)
        rows.on_box(q, s, slip, friction * self.pressure, self.cells, values, flags)
        own = self._own
        found, nearest = np.zeros((len(own), 4)), np.zeros(len(own), dtype=np.int64)
        rows.to_centres(values, self._held, self.shift, own, found, nearest)
        slips = flags[nearest, own[:, 1]]
        window, states = np.zeros((4, *self.scene.mesh.cells)), np.zeros(self.scene.mesh.cells, dtype=np.bool_)
        corner = self.box.i0, self.box.j0
        rows.by_law(found, slips, friction * self._own_pressure, own, corner, window)
        states[corner[0] + own[:, 0], corner[1] + own[:, 1]] = slips
        return window[:2], window[2:], states

    @cached_property
    def _own(self) -> np.ndarray:
        """Indices [m, 2] in the box of the mesh's own cells in contact."""
        return np.ascontiguousarray(np.argwhere(self._p > 0.0))

    @cached_property
    def _own_pressure(self) -> np.ndarray:
        pressure: np.ndarray = self._p[self._own[:, 0], self._own[:, 1]]
        return pressure

    @property
    def area(self) -> float:
        """Area of the contact (mm^2), within its edges."""
        return self.outline.area

    @property
    def beyond_edges(self) -> float:
        """Area (mm^2) between the edges that cells find and those that layers make."""
        return self.outline.beyond_edges

    @property
    def short_of_edges(self) -> float:
        """Area (mm^2) by which edges are found too far out on soft layers a few cells thick."""
        return self.outline.short_of_edges

    @property
    def pressure_max(self) -> float:
        """Largest pressure (MPa), between cells."""
        return self.outline.summit[0]

    @cached_property
    def _top(self) -> np.ndarray:
        """Numbers of the cells closest to the largest pressure: two where it is halfway between two rows."""
        _, x, y = self.outline.summit
        nearest = sorted({round(y - _HALFWAY), round(y + _HALFWAY)})
        j = np.array([row for row in nearest if self._count[row] > 0], dtype=np.int64)
        k = np.clip(np.rint(self._start[j] - x).astype(np.int64), 0, self._count[j] - 1)
        numbers: np.ndarray = self._index[k, j]
        return numbers

    def unseen_slip(self, rolling: RollingSolution, friction: float) -> Unseen:
        """What slip zones hide that are narrower than a cell."""
        if not self.scene.moves_by_pressure:
            return Unseen()
        rows = self._index, self.outline.ends[1], *self.centres
        return unseen_slip(rows, rolling.q, rolling.slip, self.pressure, friction, _EDGE, self.influence)

    def slip_area_and_peak(self, rolling: RollingSolution, friction: float) -> tuple[float, float]:
        """Area of the slip zone (mm^2), to its border between cells, and the largest traction (MPa).

        Tractions peak at that border, where they are mu p, or where the pressure does.
        """
        slip = rolling.slip
        room, speed = np.zeros((2, slip.size))
        of_cells = rolling.q, rolling.s_ahead, slip, friction, self.pressure
        largest, sticking, backwards, across = stick.rooms_and_speeds(*of_cells, room, speed)
        if not slip.any():
            return 0.0, largest
        ny = self.box.shape[1]
        length, last, borders = np.zeros(ny), np.zeros(ny, dtype=np.int64), np.zeros((2 * slip.size, 2))
        of_rows = self._index, self._start, self._count, self.outline.ends
        found = stick.stick_rows(room, speed, slip, *of_rows, length, last, borders)
        # where the pressure peaks in the slip zone, so do the slip cells' tractions
        peaks = [friction * self.pressure_max if slip[self._top].any() else largest]
        if found:
            # the area takes them as they are found: what layers do to the contact's edge makes up for it
            there = borders[:found].copy()
            there[last[last >= 0], 0] -= self._border_shift
            squares = rows.squares_at_borders(*self._profiles, there)
            peaks += [friction * rows.peak_at_borders(squares, there), sticking]
        area = self._area_behind((borders, last, length), slip, backwards / friction, across)
        if area is None:
            area = self._area_around(length)
        # no border carries more than where the pressure is largest
        return area, min(max(peaks), friction * self.pressure_max)

    @cached_property
    def _border_shift(self) -> float:
        """By how many cells the borders behind stick zones lie farther back than they are found."""
        if not self.influence.layered:
            return 0.0
        return shift_by_layers(lambda k: self.influence.traction_responses(k)[0], self.scene.mesh.spacing[0], BORDERS)

    def _area_behind(
        self, of_rows: tuple[np.ndarray, np.ndarray, np.ndarray], slip: np.ndarray, backwards: float, across: float
    ) -> float | None:
        """Area of the slip zone (mm^2) behind a stick zone in one piece, by how wide it is in each row.

        of_rows: borders, last and length as `stick.stick_rows` leaves them; backwards: the part of the slip cells'
        tractions that points so, over the friction; across: the part of their squares that does. None if the rows do
        not tell.
        """
        outline = self.outline
        if outline.smooth is None:
            return None
        ends, slopes, chords, tips, curvature = outline.smooth
        dx, dy = self.scene.mesh.spacing
        lean = dx / dy * (1.0 + _ACROSS * across * across)
        by_pressure = backwards * self.influence.slip_by_pressure_over_tractions
        bow = curvature * (_BOW - _BOW_BY_PRESSURE * by_pressure)
        widths = np.zeros(slopes.size)
        if not smooth.slip_widths(*of_rows, ends, slopes, slip, self._index[0], lean, bow, widths):
            return None
        slips = stick.area_of_slip(chords, tips, widths)
        return self._slipping_part(float(slips) / outline.area_by_parabolas)

    def _area_around(self, length: np.ndarray) -> float:
        """Area of the slip zone (mm^2) around a stick zone of rows length [ny] (cells).

        Rows and borders go by the same edges, so they tell which part of the contact slips.
        """
        stick.shorten_tips(length, self.outline.chords[0])
        # what chords miss of the contact they miss of the stick zone, too
        return self._slipping_part(1.0 - float(rows.area_under(length, _NOT_KNOWN)) / self.outline.area_by_rows)

    def _slipping_part(self, part: float) -> float:
        """Area of the slip zone (mm^2), by what `part` of all within the edges slips, with what has lifted off."""
        return max(self.outline.within * min(max(part, 0.0), 1.0) - self.outline.lifted, 0.0)
