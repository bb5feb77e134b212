"""One contact, one-way coupling: first its pressure, then its tractions. Both together: `coupled.py`.

`NormalContact` holds all that different creepages under the same pressure share: the influence coefficients of the
bodies, the pressure, the cells in contact, the slip due to pressure and the slip operator.
"""

from __future__ import annotations

import math
from functools import cached_property, lru_cache

import numpy as np

from rcstudy.mechanics.cascade import (
    coarser_scene,
    coarser_tolerance,
    in_wider_window,
    interpolate,
    interpolated_pressure,
    place_among_coarser,
)
from rcstudy.mechanics.convolution import (
    Box,
    PairOperator,
    convolve,
    difference_symbols,
    padded_around,
    padded_shape,
    pressure_quadrants,
    real_symbols,
    symbols,
    traction_quadrants,
    transform,
)
from rcstudy.mechanics.half_line import HALF_SPACE
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.kernels import meshes, outline
from rcstudy.mechanics.missed import Missed
from rcstudy.mechanics.normal import initial_gap, solve_pressure
from rcstudy.mechanics.normal_operator import NormalSolution
from rcstudy.mechanics.paper_cg import solve_paper_cg
from rcstudy.mechanics.plates import beyond_rim, missing_at_rim, most_by_plate
from rcstudy.mechanics.rolling import RollingSolution, rigid_slip, solve_tractions, within
from rcstudy.mechanics.scene import Creepage, Scene
from rcstudy.mechanics.slip_operator import SlipOperator
from rcstudy.mechanics.subcell.cusps import Cusps, difference, pressure_at_borders
from rcstudy.mechanics.subcell.slip_zone import SlipZone
from rcstudy.mechanics.subcell.trailing import Ending
from rcstudy.mechanics.subcell.unseen import Unseen
from rcstudy.mechanics.yielding import FOUNDATIONS, LOOSE, TRIED, bend

_ROOM = 8  # the lift is computed on the contact's box and 1/8 of it more on each side, as the contact may grow
_AS_LARGE = 1e-9  # relative difference below which pressures count as equal
# Distance up to which layers' contribution is tabulated (beyond, it would be extrapolated without a word), over the
# window's diagonal. Padded boxes, also of coarser meshes, whose windows may be larger, ask for at most 1.9 (4 to 1024
# cells along a side, both kinds of cells, fitted and other windows, contacts up to 250 times as long as wide).
_REACH = 2.5


def influence_of(scene: Scene) -> Influence:
    """The influence coefficients of `scene`'s bodies on its mesh; those of the last scene are reused if they match."""
    reach = _REACH * float(np.hypot(*scene.mesh.size))
    return _influence(scene.substrate, scene.layers, scene.counterbody, scene.mesh.spacing, reach)


# studies are solved layer set by layer set (`cases.py`)
_influence = lru_cache(maxsize=1)(Influence)


def forget_influence() -> None:
    """Clear the cache of influence coefficients, so that the next solution computes its own: for timing."""
    _influence.cache_clear()


def along_by_pressure(influence: Influence, padded: tuple[int, int], *, x_first: bool = False) -> np.ndarray:
    """Symbols of the tangential displacements due to pressure, made once for these coefficients; see `symbols`."""

    def made() -> np.ndarray:
        return symbols(pressure_quadrants(influence.around(padded)), padded, x_first=x_first)

    return influence.once(("along", padded, x_first), made)


def along_by_tractions(influence: Influence, padded: tuple[int, int], *, x_first: bool = False) -> np.ndarray:
    """Symbols of the tangential displacements due to tractions, made once for these coefficients: `real_symbols`."""

    def made() -> np.ndarray:
        return real_symbols(traction_quadrants(influence.around(padded)), padded, x_first=x_first)

    return influence.once(("along by tractions", padded, x_first), made)


class NormalContact:
    """The pressure of a contact and what follows from it for every creepage. It does not change.

    `box`: a box that contains the cells in contact, by default their bounding box. `coarser`: the same contact with
    cells of twice the size, None if it has too few cells.
    """

    def __init__(
        self,
        scene: Scene,
        influence: Influence,
        solution: NormalSolution,
        box: Box | None = None,
        coarser: NormalContact | None = None,
    ) -> None:
        self.scene = scene
        self.influence = influence
        self.solution = solution
        self.box = box or self.touched
        self.coarser = coarser

    @cached_property
    def touched(self) -> Box:
        """The bounding box of the mesh's own cells in contact."""
        return Box.around(self.solution.p > 0.0)

    @cached_property
    def cells(self) -> np.ndarray:
        """Indices [m, 2] in the box of the cells in contact, sorted by x, then by y."""
        return np.ascontiguousarray(np.argwhere(self.solution.p[self.box.slices] > 0.0))

    @cached_property
    def pressure(self) -> np.ndarray:
        """Pressure [m] (MPa) of the cells in contact."""
        return self.gather(self.solution.p)

    @cached_property
    def carrying(self) -> np.ndarray:
        """Flags [m] of the cells that carry part of the load: all of them."""
        return np.ones(len(self.cells), dtype=np.bool_)

    @property
    def pressure_max(self) -> float:
        """Largest pressure (MPa)."""
        return float(self.solution.p.max())

    @cached_property
    def centres(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates x [m], y [m] (mm) of the cells in contact."""
        x, y = self.scene.mesh.centres
        return x[self.box.i0 + self.cells[:, 0]], y[self.box.j0 + self.cells[:, 1]]

    @property
    def levers(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates x [m], y [m] (mm) of the point of action of each cell's force: its centre."""
        return self.centres

    @cached_property
    def neighbours(self) -> np.ndarray | None:
        """None; on aligned cells, where slips are taken at centres: numbers [2, m] of the cells ahead and behind."""
        return None

    def local_slip(self, friction: float) -> np.ndarray | None:
        """None; on aligned cells: the part [5, m] of slip by pressure that is known at centres (`local_slip.py`)."""
        return None

    @cached_property
    def slip_by_pressure(self) -> np.ndarray:
        """Slip [m, 2] due to the tangential displacements that the pressure causes; zero for quasi-identical bodies.

        Differences of displacements between a cell and the one ahead (the paper's Eq. 5; Kalker 1990).
        """
        out = np.zeros((self.cells.shape[0], 2))
        if not self.scene.moves_by_pressure:
            return out
        padded = padded_shape(self.box.shape)
        p = self.solution.p[self.box.slices]
        for component, hat in enumerate(
            self.influence.once(("by pressure", padded), lambda: self._by_pressure(padded))
        ):
            out[:, component] = convolve(hat, padded, p)[self.cells[:, 0], self.cells[:, 1]]
        return out

    def _by_pressure(self, padded: tuple[int, int]) -> np.ndarray:
        """Symbols [2, py//2+1, px] of the slips along x and y due to pressure."""
        along = pressure_quadrants(self.influence.around(padded, ahead=1))
        return difference_symbols(along, padded, self.influence.spacing[0])

    @cached_property
    def displacement_by_pressure(self) -> np.ndarray:
        """Tangential displacements [2, nx + 1, ny] (mm) due to the pressure, on the box and one more cell along x.

        Their part of the paper's Eq. 10. For the proof: `slip_by_pressure` does not use them. Zero for
        quasi-identical bodies.
        """
        p = np.pad(self.solution.p[self.box.slices], ((0, 1), (0, 0)))
        if not self.scene.moves_by_pressure:
            return np.zeros((2, *p.shape))
        padded = padded_shape(p.shape)
        return np.stack([convolve(hat, padded, p) for hat in along_by_pressure(self.influence, padded)])

    def corrected_at_leading_edge(self, s: np.ndarray) -> np.ndarray:
        """Slips `s` [m, 2] due to pressure, unchanged; `aligned.py` corrects them in the leading cells."""
        return s

    def cross_slip(self, q: np.ndarray) -> np.ndarray:
        """Correction [m, 2] of the slips due to tractions `q` [m, 2] (MPa): zero except on aligned cells."""
        return np.zeros(q.shape)

    def lift(self, q: np.ndarray, box: Box) -> np.ndarray:
        """u_z [nx, ny] (mm) on `box` due to tractions `q` [m, 2] (MPa): the lift of the surface.

        By reciprocity the response of u_z to q_x is minus that of u_x to p. `box` must hold the contact's box. Zero for
        quasi-identical bodies.
        """
        padded = padded_around(self.box, box)
        out = np.zeros(box.shape)
        for hat, component in zip(along_by_pressure(self.influence, padded), self.spread(q.T), strict=True):
            out -= convolve(hat, padded, component[box.slices])
        return out

    def lift_around(self, q: np.ndarray) -> np.ndarray:
        """`lift` [nx, ny] (mm) of the window, due to tractions `q` [m, 2] (MPa); zero where the contact will not grow.

        That is, beyond 1/`_ROOM` of the contact's box, and two cells, on each side of it.
        """
        lift = np.zeros(self.scene.mesh.cells)
        box = self.box.wider(_ROOM, lift.shape)
        lift[box.slices] = self.lift(q, box)
        return lift

    @property
    def operator(self) -> SlipOperator:
        """The operator that gives the slip due to tractions on the box."""
        return self.operator_on(0.0)

    def operator_on(self, foundation: float) -> SlipOperator:
        """The operator with the cells' own displacement raised by `foundation` times that (`yielding.py`)."""
        return SlipOperator.of(self.influence, self.box.shape, foundation=foundation)

    @property
    def cells_of_operator(self) -> np.ndarray:
        """Indices [m, 2] of the cells in contact in the box of the `operator`."""
        return self.cells

    @cached_property
    def displacement(self) -> PairOperator:
        """Operator of the displacements (mm) due to tractions (MPa), on the box and one more cell along x.

        Their part of the paper's Eq. 10.
        """
        shape = self.box.shape[0] + 1, self.box.shape[1]
        padded = padded_shape(shape)
        return PairOperator(along_by_tractions(self.influence, padded), shape, transform(padded, 2, shape[0]))

    @cached_property
    def _places(self) -> np.ndarray:
        """Flat indices [m] of the cells in an array [nx, ny] of the window."""
        i, j = self.cells.T
        return (self.box.i0 + i) * self.scene.mesh.cells[1] + self.box.j0 + j

    def gather(self, window: np.ndarray) -> np.ndarray:
        """Values [..., m] at the cells in contact of arrays [..., nx, ny] of the window."""
        return window.reshape(*window.shape[:-2], -1).take(self._places, axis=-1)

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Arrays [..., nx, ny] of the window with `values` [..., m] at the cells in contact, zero elsewhere."""
        nx, ny = self.scene.mesh.cells
        out = np.zeros((*values.shape[:-1], nx, ny), dtype=values.dtype)
        # one array at a time: a single assignment to all takes twice as long
        for window, own in zip(out.reshape(-1, nx * ny), values.reshape(-1, values.shape[-1]), strict=True):
            window[self._places] = own
        return out

    def on_window(
        self, q: np.ndarray, s: np.ndarray, slip: np.ndarray, friction: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Tractions [2, nx, ny] (MPa), slips [2, nx, ny] and slip flags [nx, ny] of the window.

        They are `q` [m, 2], `s` [m, 2] and `slip` [m] at the cells in contact; zero outside.
        """
        return self.spread(q.T), self.spread(s.T), self.spread(slip)

    @cached_property
    def area(self) -> float:
        """Area of the contact (mm^2): the total area of its cells."""
        dx, dy = self.scene.mesh.spacing
        return len(self.cells) * dx * dy

    @property
    def contact_radius(self) -> float:
        """Radius (mm) of a circle with the contact's area."""
        return math.sqrt(self.area / math.pi)

    @property
    def area_by_layers(self) -> float:
        """Area (mm^2) that thin layers add at the contact's edge: 0, known on aligned cells only."""
        return 0.0

    @property
    def moved_edge(self) -> float:
        """Area (mm^2) between the edge as layers move it (`half_line.py`) and that seen by cells; 0 without layers.

        Aligned cells, which find the edge, correct for it.
        """
        if not self.influence.layered:
            return 0.0
        along, across = (
            abs(self.influence.half_line(side).shift - HALF_SPACE.shift) * side for side in self.scene.mesh.spacing
        )
        return (along + across) * math.sqrt(math.pi * self.area)

    @cached_property
    def squeezed(self) -> float:
        """How far the layers respond like an incompressible film in this contact (`Influence.squeezed`)."""
        return self.influence.squeezed(self.contact_radius)

    @cached_property
    def peak_by_layers(self) -> float:
        """Change (MPa) of the largest pressure's discretisation correction by the layers, for the error bars.

        This is the difference between the corrections for the layered bodies and for half-spaces
        (`HalfLine.excess`), in absolute value; 0 without layers.
        """
        if not self.influence.layered:
            return 0.0
        p = np.ascontiguousarray(self.solution.p[self.touched.slices])
        along, across = (self.influence.half_line(side).excess for side in self.scene.mesh.spacing)
        part = HALF_SPACE.excess
        return float(abs(outline.summit(p, along, across)[0] - outline.summit(p, part, part)[0]))

    @cached_property
    def missing_at_rim(self) -> float:
        """Fraction of itself by which the largest pressure may be too small under stiff skins (`plates.py`)."""
        scene, pressures = self.scene, self.solution.p[self.touched.slices]
        coating = scene.layers, scene.substrate
        radius = 0.5 * min(count * side for count, side in zip(pressures.shape, scene.mesh.spacing, strict=True))
        return min(missing_at_rim(pressures, *coating, max(scene.mesh.spacing)), most_by_plate(*coating, radius))

    @cached_property
    def beyond_rim(self) -> float:
        """Fraction by which the largest pressure, if close to the edge, exceeds those farther in (`plates.py`)."""
        return beyond_rim(self.solution.p[self.touched.slices])

    @cached_property
    def missed(self) -> Missed:
        """What the cells miss of the responses of layers thinner than themselves (`missed.py`)."""
        return self.influence.missed(self.contact_radius)

    @property
    def skin_at_edge(self) -> tuple[float, float]:
        """Layers thinner than a cell beside the edge: none, as bars of aligned cells alone need them."""
        return 0.0, 0.0

    @property
    def edge_of_tractions(self) -> float:
        """Where tractions begin under skins: nothing, as bars of aligned cells alone need it."""
        return 0.0

    @property
    def moved_inwards(self) -> float:
        """Second moments that rows lack: nothing, as these are the mesh's own cells."""
        return 0.0

    def unseen_slip(self, rolling: RollingSolution, friction: float) -> Unseen:
        """Effects of slip zones narrower than a cell: none, known on aligned cells only (`unseen.py`)."""
        return Unseen()

    def ending(self, rolling: RollingSolution, friction: float) -> Ending:
        """Missing forces of rows that stick up to their end: none, known on aligned cells only (`trailing.py`)."""
        return Ending()

    def slip_zone(self, rolling: RollingSolution, friction: float) -> SlipZone:
        """Area of the slip zone (mm^2), the total area of its cells, largest traction and pressure (MPa) of cells."""
        dx, dy = self.scene.mesh.spacing
        return SlipZone(float(rolling.slip.sum()) * dx * dy, float(np.hypot(*rolling.q.T).max()), self.pressure_max)

    def cusps(self, zone: SlipZone, rolling: RollingSolution, friction: float) -> Cusps:
        """What cusps would add to the largest pressure of `zone`, and change of its largest traction."""
        beta = self.influence.most_slip_by_pressure_over_tractions
        room = friction * self.pressure - np.hypot(*rolling.q.T)
        p, rooms, slip = (a[self.box.slices] for a in (self.solution.p, self.spread(room), self.spread(rolling.slip)))
        at_borders = pressure_at_borders(p, rooms, slip, friction, beta)
        if at_borders == 0.0:
            return Cusps()
        of_pressure = difference(max(at_borders, zone.pressure), zone.pressure)
        return Cusps(of_pressure, difference(friction * at_borders, zone.traction), at_borders)

    def slips_at_top(self, rolling: RollingSolution) -> bool:
        """Whether a cell with the largest pressure slips; of mirror images, which differ by rounding, either does."""
        return bool(rolling.slip[self.pressure >= (1.0 - _AS_LARGE) * self.pressure.max()].any())

    def resultant(self, rolling: RollingSolution, friction: float) -> tuple[float, float, float]:
        """Forces along x and y (N) and moment about z (N mm) of the tractions: sums of q and x q_y - y q_x."""
        x, y = self.levers
        area = self.scene.mesh.spacing[0] * self.scene.mesh.spacing[1]
        qx, qy = rolling.q.T
        return float(qx.sum()) * area, float(qy.sum()) * area, float(np.sum(x * qy - y * qx)) * area

    def relative_lift(self, rolling: RollingSolution) -> float:
        """Mean lift by tractions, weighted with the pressure, over the approach; found by reciprocity."""
        i, j = self.cells.T
        work = float(np.sum(rolling.q.T * self.displacement_by_pressure[:, i, j]))
        return work / (float(self.pressure.sum()) * self.solution.approach)

    def friction_power(
        self, rolling: RollingSolution, creepage: Creepage, resultant: tuple[float, float, float]
    ) -> float:
        """Power dissipated by friction per unit rolling speed (N): -sum(q.s) dx dy."""
        dx, dy = self.scene.mesh.spacing
        return -float(np.sum(rolling.q * rolling.s)) * dx * dy

    def rigid_slip(self, creepage: Creepage, spin_point: float) -> np.ndarray:
        """Rigid slip [m, 2] at the cells in contact, spin being taken `spin_point` cells ahead of the centres."""
        return rigid_slip(*self.centres, creepage, spin_point * self.scene.mesh.spacing[0])

    def known_slip(self, scene: Scene) -> np.ndarray:
        """Slip [m, 2] of `scene` without tractions: rigid slip plus slip due to pressure.

        ValueError without creepage.
        """
        if scene.creepage is None:
            raise ValueError("a scene without creepage has no slip")
        return self.rigid_slip(scene.creepage, scene.spin_point) + self.slip_by_pressure


def solve_normal(scene: Scene, influence: Influence | None = None, level: int = 0) -> NormalContact:
    """Contact with the pressure of `scene` without any influence of tractions, starting from coarser meshes.

    `level`: how many times the mesh has been coarsened already (`coarser_scene`).
    """
    influence = influence or influence_of(scene)
    coarse_scene = coarser_scene(scene, level)
    if coarse_scene is None:
        return NormalContact(scene, influence, solve_pressure(scene, influence, initial_gap(scene)))
    coarser = solve_normal(coarse_scene, influence.coarser(), level + 1)
    guess = interpolated_pressure(coarser.solution.p, scene.mesh.cells)
    solution = solve_pressure(scene, influence, initial_gap(scene), guess)
    if coarser.solution.edge and not solution.edge:
        coarser = solve_normal(in_wider_window(coarse_scene), influence.coarser(), level + 1)
    return NormalContact(scene, influence, solution, coarser=coarser)


def solve_rolling(
    contact: NormalContact,
    scene: Scene,
    guess: np.ndarray | None = None,
    tolerance: float | None = None,
    neighbour: RollingSolution | None = None,
) -> RollingSolution:
    """Tractions of `scene` under the pressure of `contact`, whose mesh may be coarser than that of `scene`.

    `guess`: tractions [m, 2] (MPa) to start from; by default they are interpolated from the coarser mesh. `tolerance`:
    replaces that of `scene`. `neighbour`: a solution for a similar creepage under the same pressure. The difference
    between its tractions and those interpolated from its own coarser mesh is added to the interpolated guess.
    """
    w = contact.known_slip(scene)
    bound = scene.friction * contact.pressure
    tolerance = tolerance or scene.tolerance.tangential
    if scene.method == "paper-cg":
        return solve_paper_cg(contact.displacement, contact.cells, bound, w, contact.scene.mesh.spacing[0], tolerance)
    coarse: RollingSolution | None = None
    interpolated: np.ndarray | None = None
    if guess is None and contact.coarser is not None:
        of_neighbour = None if neighbour is None else neighbour.coarser
        loosened = coarser_tolerance(scene.tolerance).tangential
        coarse = solve_rolling(contact.coarser, scene, tolerance=loosened, neighbour=of_neighbour)
        guess = interpolated = interpolated_tractions(contact.coarser, coarse, contact, scene.friction)
        if neighbour is not None and neighbour.interpolated is not None:
            guess = within(interpolated + (neighbour.q - neighbour.interpolated), bound)
    elif guess is None and neighbour is not None:
        guess = neighbour.q
    cells = contact.cells_of_operator
    local = contact.local_slip(scene.friction)
    of_cells = contact.neighbours, local
    tried = TRIED[contact.neighbours is not None] if bend(contact.influence, contact.box.shape) else None
    rolling = solve_tractions(contact.operator, cells, bound, w, tolerance, guess, *of_cells, tried)
    if not rolling.converged:
        for foundation in FOUNDATIONS:
            yielding = contact.operator_on(foundation)
            found = solve_tractions(yielding, cells, bound, w, max(LOOSE, tolerance), guess, *of_cells)
            rolling, guess = found.after(rolling), found.q
        rolling = solve_tractions(contact.operator, cells, bound, w, tolerance, guess, *of_cells).after(rolling)
    rolling.coarser, rolling.interpolated = coarse, interpolated
    return rolling


def interpolated_tractions(
    coarser: NormalContact, rolling: RollingSolution, contact: NormalContact, friction: float
) -> np.ndarray:
    """First guess [m, 2] (MPa) of the tractions of `contact`, from the solution `rolling` of its `coarser` contact.

    The fraction q/(mu p) is interpolated, as it is smooth; the bound mu p is known on the finer mesh.
    """
    values, mask = np.zeros((2, *coarser.box.shape)), np.zeros(coarser.box.shape, dtype=np.bool_)
    meshes.spread_fractions(rolling.q, friction * coarser.pressure, coarser.cells, values, mask)
    x, y = place_among_coarser(contact.scene.mesh.cells, coarser.scene.mesh.cells)
    # position of the box's first cell in the coarser contact's box
    place = x + 0.5 * contact.box.i0 - coarser.box.i0, y + 0.5 * contact.box.j0 - coarser.box.j0
    fine, _ = interpolate(values, mask, contact.cells, place)
    guess: np.ndarray = fine * (friction * contact.pressure)[:, None]
    return guess
