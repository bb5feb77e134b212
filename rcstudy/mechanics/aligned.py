r"""Cells that begin where the contact begins (`discretisation: aligned`).

- Each row of cells is moved along x, by up to half a cell, to where the discrete half-line asks for it, and the
  bound is the mean of mu p over the moved cell (`moved_rows.py`, with the derivation). Rows are moved by phases between
  the two stages of the transforms; moments take each cell's force where it is, and as it turns (`resultant`).
- Slip by pressure loses in the leading cells what the half-line makes too much of it (`_LEADING`), and slip across
  tractions gains there what it makes too little (`_CROSS`).
- Slip belongs to the point x + dx/2 between a cell and the one ahead, so spin is taken there, whatever `spin_point`;
  in slip cells the direction of slip is taken at the cell's centre, by a parabola through such points (`centring.py`).
- The contact's area is that within its edge, found between cells in each row and column by what cells make of one on
  these bodies (`edges.py`, `half_line.py`); the part of it that slips lies between the borders of the stick zone and
  the edge behind them (`slip_zone.py`).

Errors are then of order dx^1.5, and small. Results on the mesh's own cells are interpolated: the fraction of the bound
in stick cells, direction and slip in slip cells.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from rcstudy.mechanics.contact import NormalContact, along_by_pressure
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
from rcstudy.mechanics.edges import Outline
from rcstudy.mechanics.kernels import row_cells
from rcstudy.mechanics.moved_rows import EDGE, MovedRows
from rcstudy.mechanics.rolling import RollingSolution
from rcstudy.mechanics.scene import Creepage
from rcstudy.mechanics.slip_operator import SlipOperator
from rcstudy.mechanics.slip_zone import SlipZones
from rcstudy.mechanics.trailing import Ending, ending_of_rows
from rcstudy.mechanics.unseen import Unseen, unseen_slip

_SPIN_POINT = 0.5  # in cells ahead of the centre
# Pressure causes slip on the spot in proportion (Johnson 1985, 2.25a), so that it goes like the root of the distance
# from the edge, too. Tractions follow from slips by sums with weights of nearly Gamma(j + 1/2)/Gamma(j + 1). These are
# right for constant slip and too large for one that falls like a root at the edge; taking this part of the pressure's
# slip off in the leading cell makes up for it. Where the edge is at an angle that slip points along its normal and is
# smaller by its component along x.
_LEADING = 0.0264
# Where the leading edge is at an angle tractions of the leading cells make too little of the slip across them: by the
# product of the components of the edge's normal times so much of what waves of wave number 1/dx along them yield more
# than across. 0.09 takes errors of first order from moments by lateral creepage and lateral forces by spin (round
# contacts, nu 0.3 to 0.5); with 0.07 those of second order are smaller at ten to twenty cells a radius.
_CROSS = 0.07


class AlignedContact(NormalContact):
    """A contact for the tractions on rows of cells that begin where the contact begins.

    Its cells are those of the moved rows `rows`. `coarser`: the coarser contact to use instead of one made from
    `contact.coarser`. `like`: a contact whose rows keep their places and cells here, where that is possible.
    """

    def __init__(
        self, contact: NormalContact, coarser: NormalContact | None = None, like: AlignedContact | None = None
    ) -> None:
        box = contact.box.grown(1, 0, contact.scene.mesh.cells)
        if coarser is None and contact.coarser is not None:
            coarser = AlignedContact(contact.coarser)
        super().__init__(contact.scene, contact.influence, contact.solution, box, coarser)
        p = np.ascontiguousarray(self.solution.p[box.slices])
        self.outline = Outline(p, contact.scene.mesh.spacing, contact.influence)
        self.rows: MovedRows = MovedRows(self.solution.p, box, self.outline, None if like is None else like.rows)
        self.cells, self.pressure, self.carrying = self.rows.cells, self.rows.pressure, self.rows.carrying

    @cached_property
    def centres(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates x [m], y [m] (mm) of the moved cells."""
        x, y = self.scene.mesh.centres
        i, j = self.cells.T
        return x[self.box.i0 + i] + self.rows.shift[j] * self.scene.mesh.spacing[0], y[self.box.j0 + j]

    @cached_property
    def levers(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates x [m], y [m] (mm) of the middle of each cell's force; outermost cells hold what lies beyond."""
        dx = self.scene.mesh.spacing[0]
        i, j = self.cells.T
        x, y = self.centres
        return x + (self.rows.middle - (i + self.rows.shift[j])) * dx, y

    @cached_property
    def neighbours(self) -> np.ndarray:
        """Numbers [2, m] of the cells ahead and behind each cell, its own where there is none."""
        return self.rows.neighbours

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
        return self.corrected_at_leading_edge(np.ascontiguousarray(slips.T))

    def corrected_at_leading_edge(self, s: np.ndarray) -> np.ndarray:
        """Slips `s` [m, 2] by pressure, changed in place, without what leading cells make too much of them."""
        part = _LEADING * self.influence.slip_under_pressure
        row_cells.correct_leading_cells(self.rows.normals, self.rows.index, self.pressure, part, s)
        return s

    @cached_property
    def _cross_slip_terms(self) -> tuple[np.ndarray, np.ndarray]:
        """Numbers [n] of the rows' leading cells, and what slip across them a unit of traction causes there besides."""
        rows = self.rows
        held = rows.count > 0
        dx = self.scene.mesh.spacing[0]
        along, across = self.influence.traction_responses(np.array([1.0 / dx]))[:, 0] / dx
        return rows.index[0, held], _CROSS * (along - across) * rows.normals[:, held].prod(axis=0)

    def cross_slip(self, q: np.ndarray) -> np.ndarray:
        """Slips [m, 2] that leading cells' tractions `q` [m, 2] cause across them beside their displacements."""
        leading, part = self._cross_slip_terms
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
        hat = along_by_pressure(self.influence, padded, x_first=True)
        plan = shifted_transform(padded, 2, ny).shifted(self._phase, point_factor(padded[0], hat.shape[1]))
        return self._convolved(self.pressure, hat, plan, plan)[:, : nx + 1].copy()

    def lift(self, q: np.ndarray, box: Box) -> np.ndarray:
        """u_z (mm, [nx, ny] of `box`) at the cells as they are by tractions `q` [m, 2] on the moved rows.

        As without moved rows: they are moved on the way there and not back. `box` must hold the contact.
        """
        padded = padded_around(self.box, box)
        # first of all: of a contact one row wide the symbols are made in this very plan
        hat = along_by_pressure(self.influence, padded, x_first=True)
        corner = self.box.i0 - box.i0, self.box.j0 - box.j0
        shift = np.zeros(box.shape[1])
        shift[corner[1] : corner[1] + self.rows.shift.size] = self.rows.shift
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
        return row_phases(self._padded[0], self.rows.shift)

    @cached_property
    def operator(self) -> SlipOperator:
        """Slip by tractions on the moved rows, as far as these have cells."""
        leading, part = self._cross_slip_terms
        operator = SlipOperator.of(self.influence, self.rows.reach, sharp=True)
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
        """Shape of the torus for displacements on the cells, a row ahead, and one more by `point_factor`'s spread."""
        nx, ny = self.rows.reach
        return padded_shape((nx + 2, ny))

    def rigid_slip(self, creepage: Creepage, spin_point: float) -> np.ndarray:
        """Rigid slip [m, 2] where slip belongs, half a cell ahead; `spin_point` is for cells that are not moved."""
        return super().rigid_slip(creepage, _SPIN_POINT)

    @cached_property
    def _slip_by_pressure_at_centres(self) -> np.ndarray:
        result: np.ndarray = 0.5 * (self.slip_by_pressure + self.slip_by_pressure[self.neighbours[1]])
        return result

    def resultant(self, rolling: RollingSolution, friction: float) -> tuple[float, float, float]:
        """Forces along x and y (N) and moment about z (N mm) of the tractions, which turn within slip cells.

        To first order that changes forces, too, but those are farther off with it: other errors make up for it there.
        """
        rows, (dx, dy) = self.rows, self.scene.mesh.spacing
        centres, y = self.centres
        of_cells = rolling.q, rolling.slip, friction * rows.pressure, centres, self.levers[0], y
        of_rows = rows.index, rows.start, self.outline.ends_from_afar
        force_x, force_y, moment = row_cells.resultant(*of_cells, *of_rows, dx)
        return force_x * dx * dy, force_y * dx * dy, moment * dx * dy

    def friction_power(
        self, rolling: RollingSolution, creepage: Creepage, resultant: tuple[float, float, float]
    ) -> float:
        """Power that friction takes, per unit rolling speed (N): that of the creepages, less sum q.s_p dx dy.

        In -sum q.s the elastic slip by tractions does no work on the whole (its operator is antisymmetric) but for
        errors of order dx, so it is left out. `resultant`: of the tractions.
        """
        dx, dy = self.scene.mesh.spacing
        by_pressure = float(np.vdot(rolling.q, self._slip_by_pressure_at_centres)) * dx * dy
        return -creepage.power(*resultant) - by_pressure

    def on_window(
        self, q: np.ndarray, s: np.ndarray, slip: np.ndarray, friction: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Tractions [2, nx, ny] (MPa), slips [2, nx, ny] and slip flags [nx, ny] at the centres of the window's cells.

        From those `q` [m, 2], `s` [m, 2], `slip` [m] on the moved cells; zero outside the contact.
        """
        return self.rows.on_window(q, s, slip, friction)

    @property
    def area(self) -> float:
        """Area of the contact (mm^2), within its edges."""
        return self.outline.area

    @property
    def beyond_edges(self) -> float:
        """Area (mm^2) between the edges that cells find and those that layers make."""
        return self.outline.beyond_edges

    @property
    def pressure_max(self) -> float:
        """Largest pressure (MPa), between cells."""
        return self.outline.summit[0]

    def unseen_slip(self, rolling: RollingSolution, friction: float) -> Unseen:
        """What slip zones hide that are narrower than a cell."""
        if not self.scene.moves_by_pressure:
            return Unseen()
        of_rows = self.rows.index, self.rows.count, self.outline.ends_from_afar, self.rows.normals
        of_cells = rolling.q, rolling.slip, self.pressure, self._slip_by_pressure_at_centres
        return unseen_slip(of_rows, self.centres, *of_cells, friction, EDGE, self.influence)

    def ending(self, rolling: RollingSolution, friction: float) -> Ending:
        """What rows carry too little that stick up to their trailing end."""
        of_cells, ends = (self.centres, rolling.q, rolling.slip), self.outline.ends_from_afar
        return ending_of_rows(self.rows, ends, *of_cells, friction, self.scene.mesh.spacing, EDGE)

    def slip_area_and_peak(self, rolling: RollingSolution, friction: float) -> tuple[float, float]:
        """Area of the slip zone (mm^2), to its border between cells, and the largest traction (MPa)."""
        return self.slip_zones.area_and_peak(rolling, friction)

    @cached_property
    def slip_zones(self) -> SlipZones:
        """What tells the slip zone of any creepage under this pressure."""
        return SlipZones(self.rows, self.outline, self.influence)
