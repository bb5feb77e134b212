r"""Rolling contact on rows of cells aligned with the leading edge (`discretisation: aligned`).

- Each row of cells (cells along x) is moved along x by up to half a cell, so that its leading cell lies at the distance
  from the edge of the contact that the discrete half-line requires. The traction bound is the mean of mu p over the
  moved cell (`moved_rows.py`, with the derivation). Rows are moved by phase factors between the two stages of the
  Fourier transforms. The moment uses the point of action of each cell's force and its turning direction (`resultant`).
- In the leading cells two discretisation errors are corrected: the slip due to pressure is reduced by what cells
  exaggerate (`edge_slip.py`; at an oblique edge along the edge's normal n, and n_x times as much), and the slip across
  the tractions is increased (`_CROSS`).
- The difference of displacements between a cell and the one ahead is the slip at x + dx/2. Spin is therefore taken
  there, whatever `spin_point`. In slip cells the slip is interpolated to the cell's centre by a parabola through such
  points (`centring.py`).
- The contact's area is that within its edge. The edge is located between cells, in each row and column, from the
  outer pressures and the discrete half-line of the bodies (`edges.py`, `half_line.py`). The slip area lies between the
  borders of the stick zone and the edge behind them (`slip_zone.py`).

The remaining errors are small and of order dx^1.5. Results are interpolated to the mesh's own cells: the fraction of
the bound in stick cells, the direction of the traction and the slip in slip cells.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from rcstudy.mechanics.contact import NormalContact, along_by_pressure, along_by_tractions
from rcstudy.mechanics.convolution import (
    Box,
    PairOperator,
    ShiftedTransform,
    padded_around,
    padded_shape,
    point_factor,
    row_phases,
    sharp_difference,
    shifted_transform,
)
from rcstudy.mechanics.edge_slip import OF_HALF_SPACE
from rcstudy.mechanics.half_line import EDGE
from rcstudy.mechanics.kernels import row_cells
from rcstudy.mechanics.rolling import RollingSolution
from rcstudy.mechanics.scene import Creepage
from rcstudy.mechanics.slip_operator import SlipOperator
from rcstudy.mechanics.subcell import leading_zone
from rcstudy.mechanics.subcell.cusps import Cusps
from rcstudy.mechanics.subcell.edges import Outline
from rcstudy.mechanics.subcell.local_slip import by_pressure_at_centres, local_slip
from rcstudy.mechanics.subcell.moved_rows import MovedRows
from rcstudy.mechanics.subcell.slip_zone import SlipZone, SlipZones
from rcstudy.mechanics.subcell.trailing import Ending, ending_of_rows
from rcstudy.mechanics.subcell.unseen import Unseen, UnseenSlip, of_alike

_SPIN_POINT = 0.5  # in cells ahead of the centre
# At an oblique leading edge the discrete equations underestimate the slip across the tractions of the leading cells.
# The slip added per unit traction is this fraction of n_x n_y (c - d): n is the edge's normal, and c and d are those of
# `Influence.slip_under_tractions`. A value of 0.09 removes the first-order errors of moments under lateral creepage and
# of lateral forces under spin (round contacts, nu 0.3 to 0.5); 0.07 leaves smaller errors of second order at ten to
# twenty cells per radius.
_CROSS = 0.07
# The mean over a cell of tractions times slip by pressure exceeds the product of their means by 1/12 of the product of
# their changes over the cell. That is taken for stick cells. (There both are values at centres, of which nothing would
# be missing if they were smooth; but of ten random contacts on 20, 27, 40 and 57 cells, against 480, powers over mu P
# times slip are 0.54, 0.36, 0.29 and 0.21 per mille off with it, 0.59, 0.40, 0.31 and 0.21 without.) In slip cells both
# go like a root at the edge, where differences between cells are too small: 0.33 fits the paper's cases best, 0.25
# random contacts. The slip does so as far as it is that of the top layer on the spot (`Influence.local_part_of_slip`):
# on incompressible covers it is smooth. (180 of these, 0.1 to 1 radius thick: with 0.3 powers are too large in 95 of
# 100, by 0.5 % in one of ten, now by 0.2 %; other contacts' errors are smaller by up to a fifth in the median.)
_WITHIN_SLIP, _WITHIN_STICK = 0.3, 1.0 / 12.0
_MOST_SLIPPING = 16  # slip cells at the leading end of a row, from which on what they miss of the zone is nothing


class AlignedContact(NormalContact):
    """A contact whose tractions are found on rows of cells aligned with the leading edge.

    Its cells are those of the moved rows `rows`; `outline` is the outline of the contact. `coarser`: the coarser
    contact to use instead of one made from `contact.coarser`. `like`: a contact whose rows keep their positions and
    cells here, where possible.
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
        self._local_slip: tuple[float, np.ndarray] | None = None  # and the coefficient of friction that it is for

    @cached_property
    def centres(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates x [m], y [m] (mm) of the centres of the moved cells."""
        x, y = self.scene.mesh.centres
        i, j = self.cells.T
        return x[self.box.i0 + i] + self.rows.shift[j] * self.scene.mesh.spacing[0], y[self.box.j0 + j]

    @cached_property
    def levers(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates x [m], y [m] (mm) of the point of action of each cell's pressure.

        The outermost cells of a row include the pressure between them and the edge.
        """
        dx = self.scene.mesh.spacing[0]
        i, j = self.cells.T
        x, y = self.centres
        return x + (self.rows.middle - (i + self.rows.shift[j])) * dx, y

    @cached_property
    def neighbours(self) -> np.ndarray:
        """Numbers [2, m] of the cells ahead of and behind each cell; its own number where there is none."""
        return self.rows.neighbours

    @cached_property
    def slip_by_pressure(self) -> np.ndarray:
        """Slip [m, 2] due to the tangential displacements that the pressure on the moved cells causes."""
        if not self.scene.moves_by_pressure:
            return np.zeros((len(self.cells), 2))
        padded = self._padded

        def make() -> np.ndarray:
            along = along_by_pressure(self.influence, padded, x_first=True)
            return along * sharp_difference(padded[0], self.influence.spacing[0])[:, None]

        # before the plan is filled: for a contact one row wide its symbols are made with the same plan
        hat = self.influence.once(("by pressure, x first", padded), make)
        plan = shifted_transform(padded, 2, self.box.shape[1]).shifted(self._phase)
        slips = self._convolved(self.pressure, hat, plan, plan)[:, self.cells[:, 0], self.cells[:, 1]]
        return self.corrected_at_leading_edge(np.ascontiguousarray(slips.T))

    def corrected_at_leading_edge(self, s: np.ndarray) -> np.ndarray:
        """Slips `s` [m, 2] due to pressure, reduced in the leading cells (`edge_slip.py`); `s` is changed in place."""
        part = self.influence.exaggerated_slip
        row_cells.correct_leading_cells(self.rows.normals, self.rows.index, self.pressure, part, s)
        return s

    @property
    def _exaggerated(self) -> float:
        """What `corrected_at_leading_edge` takes off, over the slip that the pressure there causes on the spot."""
        on_the_spot = self.influence.slip_under_pressure
        return self.influence.exaggerated_slip / on_the_spot if on_the_spot != 0.0 else 0.0

    @cached_property
    def _cross_slip_terms(self) -> tuple[np.ndarray, np.ndarray]:
        """Numbers [n] of the rows' leading cells, and the extra slip across a unit traction there [n] (1/MPa)."""
        rows = self.rows
        held = rows.count > 0
        along, across = self.influence.slip_under_tractions
        return rows.index[0, held], _CROSS * (along - across) * rows.normals[:, held].prod(axis=0)

    def cross_slip(self, q: np.ndarray) -> np.ndarray:
        """Extra slips [m, 2] across the tractions `q` [m, 2] (MPa) of the leading cells (`_CROSS`), zero elsewhere."""
        leading, part = self._cross_slip_terms
        s = np.zeros(q.shape)
        s[leading] = part[:, None] * q[leading, ::-1]
        return s

    @cached_property
    def displacement_by_pressure(self) -> np.ndarray:
        """Tangential displacements [2, nx + 1, ny] (mm) due to the pressure on the moved rows, for the proof."""
        nx, ny = self.box.shape
        if not self.scene.moves_by_pressure:
            return np.zeros((2, nx + 1, ny))
        padded = self._padded
        hat = along_by_pressure(self.influence, padded, x_first=True)
        plan = shifted_transform(padded, 2, ny).shifted(self._phase, point_factor(padded[0], hat.shape[1]))
        return self._convolved(self.pressure, hat, plan, plan)[:, : nx + 1].copy()

    def lift(self, q: np.ndarray, box: Box) -> np.ndarray:
        """u_z [nx, ny] (mm) at the mesh's own cells of `box`, due to tractions `q` [m, 2] (MPa) on the moved rows.

        Rows are moved in the forward transform only. `box` must hold the contact's box.
        """
        padded = padded_around(self.box, box)
        # before the plan is filled: for a contact one row wide its symbols are made with the same plan
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
        """Convolution [2, nx, ny] with `symbol` of `stress` [m] or [2, m] on the moved cells, in the array of `back`.

        `there`, `back`: plans of the forward and backward transform, which share their arrays and may move rows;
        `corner`: the cell of these arrays at which the box begins.
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
        """Phase factors that move the rows on the torus `_padded`, see `row_phases`."""
        return row_phases(self._padded[0], self.rows.shift)

    @cached_property
    def operator(self) -> SlipOperator:
        """The slip operator of the moved rows, for the cells along x that these occupy (`MovedRows.reach`)."""
        return self.operator_on(0.0)

    def operator_on(self, foundation: float) -> SlipOperator:
        """As that of :class:`NormalContact`, of the moved rows."""
        leading, part = self._cross_slip_terms
        operator = SlipOperator.of(self.influence, self.rows.reach, sharp=True, foundation=foundation)
        return operator.moved(self._phase, self.cells_of_operator, leading, part)

    @cached_property
    def cells_of_operator(self) -> np.ndarray:
        """Indices [m, 2] of the cells in the box of the `operator`."""
        return self.cells - [self.cells[0, 0], 0]

    @cached_property
    def displacement(self) -> PairOperator:
        """Operator of the displacements due to tractions on the moved rows, for the box and one more cell along x."""
        shape = self.box.shape[0] + 1, self.box.shape[1]
        symbol = along_by_tractions(self.influence, self._padded, x_first=True)
        sharpened = point_factor(self._padded[0], symbol.shape[1])
        plan = shifted_transform(self._padded, 2, shape[1]).shifted(self._phase, sharpened)
        return PairOperator(symbol, shape, plan)

    @property
    def _padded(self) -> tuple[int, int]:
        """Shape of the torus for displacements at the cells.

        Along x it has room for two more cells: the one ahead, and one over which `point_factor` spreads.
        """
        nx, ny = self.rows.reach
        return padded_shape((nx + 2, ny))

    def rigid_slip(self, creepage: Creepage, spin_point: float) -> np.ndarray:
        """Rigid slip [m, 2], spin being taken half a cell ahead of the centres; `spin_point` is not used."""
        return super().rigid_slip(creepage, _SPIN_POINT)

    def local_slip(self, friction: float) -> np.ndarray | None:
        """The part [5, m] of the slip by pressure that is known at the cells' centres (`local_slip.py`)."""
        if not self.scene.moves_by_pressure:
            return None
        if self._local_slip is None or self._local_slip[0] != friction:  # creepages of one friction share it
            self._local_slip = friction, local_slip(self.rows, self.influence, friction, self._exaggerated)
        return self._local_slip[1]

    @cached_property
    def _slip_by_pressure_at_centres(self) -> np.ndarray:
        """Slip [m, 2] due to pressure at the cells' centres, of bodies whose surfaces pressure moves."""
        return by_pressure_at_centres(self.slip_by_pressure, self.rows, self.influence, self._exaggerated)

    def resultant(self, rolling: RollingSolution, friction: float) -> tuple[float, float, float]:
        """Forces along x and y (N) and moment about z (N mm) of the tractions.

        The moment's part x q_y allows for the change of the traction's direction within slip cells, to second order. In
        the forces and in -y q_x that change is neglected: forces have larger errors with it, as it cancels other ones,
        and the moment does not gain by the latter.
        """
        rows, (dx, dy) = self.rows, self.scene.mesh.spacing
        centres, y = self.centres
        of_cells = rolling.q, rolling.slip, friction * rows.pressure, centres, self.levers[0], y
        force_x, force_y, moment = row_cells.resultant(*of_cells, rows.table, dx)
        return force_x * dx * dy, force_y * dx * dy, moment * dx * dy

    def friction_power(
        self, rolling: RollingSolution, creepage: Creepage, resultant: tuple[float, float, float]
    ) -> float:
        """Power dissipated by friction per unit rolling speed (N): that of the creepages, less sum(q.s_p) dx dy.

        s_p is the slip due to pressure. In -sum(q.s) the slip due to tractions is left out: its operator is
        antisymmetric, so that it contributes errors of order dx only. `resultant`: forces (N) and moment (N mm) of the
        tractions.
        """
        if not self.scene.moves_by_pressure:
            return -creepage.power(*resultant)
        dx, dy = self.scene.mesh.spacing
        of_cells = rolling.q, rolling.slip, self._slip_by_pressure_at_centres, self.neighbours
        within_slip = _WITHIN_STICK + self.influence.local_part_of_slip * (_WITHIN_SLIP - _WITHIN_STICK)
        work = row_cells.work_on_slip(*of_cells, within_slip, _WITHIN_STICK)
        return -creepage.power(*resultant) - work * dx * dy

    def on_window(
        self, q: np.ndarray, s: np.ndarray, slip: np.ndarray, friction: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Tractions [2, nx, ny] (MPa), slips [2, nx, ny] and slip flags [nx, ny] at the centres of the window's cells.

        They are interpolated from `q` [m, 2], `s` [m, 2] and `slip` [m] on the moved cells; zero outside the contact.
        """
        return self.rows.on_window(q, s, slip, friction)

    @property
    def area(self) -> float:
        """Area of the contact (mm^2), within its edges."""
        return self.outline.area

    @property
    def area_by_layers(self) -> float:
        """Area (mm^2) between the far-field edge and the actual one, which thin layers move (`edges.py`)."""
        return self.outline.area_by_layers

    @property
    def moved_edge(self) -> float:
        """Nothing: edges are found."""
        return 0.0

    @property
    def pressure_max(self) -> float:
        """Largest pressure (MPa), interpolated between cells."""
        return self.outline.summit[0]

    @property
    def skin_at_edge(self) -> tuple[float, float]:
        """Layers thinner than a cell beside the edge (`Influence.skin_at_edge`)."""
        return self.influence.skin_at_edge

    @property
    def edge_of_tractions(self) -> float:
        """How far within the edge tractions begin under skins thinner than a cell, over the contact's radius."""
        dx = self.scene.mesh.spacing[0]
        return max(-self.influence.half_line_of_tractions(dx).shift, 0.0) * dx / self.contact_radius

    @property
    def moved_inwards(self) -> float:
        """Difference of the pressure's second moments on rows and on the mesh's own cells, over load times radius^2.

        Hardly anything where pressure ends like a root. Under skins that bear load along the rim rows lack it there.
        """
        if not self.influence.layered:
            return 0.0
        x, y = self.scene.mesh.centres
        own, p = self.rows.own
        of_cells = x[self.box.i0 + own[:, 0]] ** 2 + y[self.box.j0 + own[:, 1]] ** 2
        of_rows = self.levers[0] ** 2 + self.levers[1] ** 2
        on_rows, on_cells = of_rows @ self.pressure / self.pressure.sum(), of_cells @ p / p.sum()
        return float(abs(on_rows - on_cells)) * math.pi / self.area

    def unseen_slip(self, rolling: RollingSolution, friction: float) -> Unseen:
        """Effects of slip zones at the leading edge that are narrower than a cell (`unseen.py`)."""
        if not self.scene.moves_by_pressure:
            return of_alike(self.rows.table, rolling.slip, math.prod(self.scene.mesh.spacing))
        return self._unseen_slip.of(rolling.q, rolling.slip, friction)

    @cached_property
    def _unseen_slip(self) -> UnseenSlip:
        of_cells = self.centres, self.pressure, self._slip_by_pressure_at_centres
        zones = leading_zone.numbers(_MOST_SLIPPING, EDGE, OF_HALF_SPACE)
        rows = self.rows
        return UnseenSlip(rows.table, rows.normals, *of_cells, EDGE, zones, self._reach, self.influence)

    @cached_property
    def _reach(self) -> float:
        """`Influence.reach_of_tractions` for the longest row; 1 without layers."""
        if not self.influence.layered:
            return 1.0
        back, front = self.outline.far_field_ends
        return self.influence.reach_of_tractions(float(np.max(front - back)) * self.scene.mesh.spacing[0])

    def ending(self, rolling: RollingSolution, friction: float) -> Ending:
        """Forces and moment that are missing in rows which stick up to their trailing end (`trailing.py`)."""
        of_cells = self.centres, rolling.q, rolling.slip
        return ending_of_rows(self.rows, *of_cells, friction, self.scene.mesh.spacing, EDGE)

    def slip_zone(self, rolling: RollingSolution, friction: float) -> SlipZone:
        """Area of the slip zone (mm^2), largest traction and pressure (MPa), all found between cells."""
        return self.slip_zones.zone(rolling, friction)

    def cusps(self, zone: SlipZone, rolling: RollingSolution, friction: float) -> Cusps:
        """What cusps changed of the largest pressure and traction of `zone`."""
        return zone.cusps

    def slips_at_top(self, rolling: RollingSolution) -> bool:
        """Whether a cell closest to the largest pressure slips."""
        return self.slip_zones.slips_at_top(rolling)

    @cached_property
    def slip_zones(self) -> SlipZones:
        """Evaluates slip area and largest traction of any creepage under this pressure."""
        return SlipZones(self.rows, self.outline, self.influence, cusped=self.scene.is_coupled)
