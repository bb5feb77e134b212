r"""Full coupling of pressure and tractions (`coupling: full`) by one semismooth Newton method (Alart and Curnier 1991).

The unknowns are the pressures p and tractions q on the cells in contact, and the approach. Slip and gap are linear in
both,

    s = w + D p + B q,   g = h + A p + C q,

with B as in `rolling.py`, A as in `normal.py`, D the slip due to pressure and C the displacement u_z due to tractions.
The conditions are p >= 0, g = approach where p > 0, g >= approach elsewhere, sum(p) dx dy = load, and Coulomb's law
with the bound mu p. In a Newton step the cells in contact are those under pressure and those that overlap without
pressure. On them g = approach is imposed, the step of the pressure keeps the load, and Coulomb's law is linearised as
in `rolling.py`, except that the bound changes with p: q = mu p n + tau m in slip cells. Negative pressures are then set
to zero. (Solving pressure and tractions in turn, Panagiotopoulos 1975, took up to seven times as many products, and
under two stiff layers on fine meshes it did not converge.)

GMRES solves each linear system for both at once. In it the gaps are replaced by the pressures that would cause them on
an unpadded torus, less their mean. These have the size of the error in p and need no further preconditioner. The slips
are preconditioned as in `rolling.py`. In the cascade each mesh starts from the pressure and tractions of the coarser
one, the coarsest from the frictionless pressure.

Where coatings bend like plates, the pressure of the coarser mesh may be so inaccurate that the set of cells in contact
does not settle. If its residual exceeds `_FAR`, or if Newton's method fails, pressure and tractions are solved in turn,
and Newton's method goes on from there. If it fails then, turns go on without it (`by_turns.py`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rcstudy.mechanics.by_turns import ByTurns, one_turn, solve_by_turns, stresses
from rcstudy.mechanics.cascade import coarser_scene, in_wider_window, interpolated_pressure
from rcstudy.mechanics.contact import (
    NormalContact,
    influence_of,
    interpolated_tractions,
    solve_normal,
)
from rcstudy.mechanics.convolution import (
    ZZ,
    Box,
    good_length,
    pressure_quadrants,
    symbols,
    transform,
)
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.kernels import arrays, coupled, tractions
from rcstudy.mechanics.normal import LEAST_TOLERANCE, at_edge, clear_of_sides, initial_gap
from rcstudy.mechanics.normal_operator import NormalOperator, NormalSolution
from rcstudy.mechanics.numerics import newton
from rcstudy.mechanics.numerics.krylov import gmres
from rcstudy.mechanics.numerics.mixing import Mixing
from rcstudy.mechanics.rolling import (
    NewtonSystem,
    RollingSolution,
    alternating,
    on_bound,
    rigid_slip,
)
from rcstudy.mechanics.scene import Scene, Tolerance
from rcstudy.mechanics.slip_operator import SlipOperator
from rcstudy.mechanics.stopping import pressure_residual, traction_residual

_MAX_NEWTON = 30
_MAX_TURNS = 60
_CLOSE = 1e-6  # loosest final tolerance of turns: plates are stiff, and Newton's method has to settle from there
_TURN = 0.3  # tolerance of a turn, over the error of the last one
_FAR = 1.0  # normal residual of the first guess beyond which Newton's method is not started from it
_PATIENCE = 2  # Newton steps without a gain of a tenth before steps are shortened (plates need it)
_WEIGHT = 3.0  # of gaps against slips; values of 0.3 to 10 change the number of products by less than a tenth
_LEAST = 1e-6  # least bound of a cell that has just come into contact, over the largest
# Normal residual at which Newton's method is given up. It was 1.8 at most in 882 runs without plates, all of which were
# solved; under plates 2 of 2119 that were solved and 163 of 227 that were not exceeded this.
_LOST = 30.0
_START = 0.1  # tolerance of the frictionless pressure from which the coarsest mesh starts


class CoupledOperator:
    """Slips and gap due to tractions and pressure on a box of cells, and the pressures that cause a given gap.

    Immutable; belongs to one set of bodies, one mesh and one box.
    """

    @staticmethod
    def of(influence: Influence, shape: tuple[int, int]) -> CoupledOperator:
        """The operator for a box of `shape`, made once for these coefficients."""
        return influence.once(("coupled", shape), lambda: CoupledOperator(influence, shape))

    def __init__(self, influence: Influence, shape: tuple[int, int]) -> None:
        self.shape = shape
        self.slip = SlipOperator.of(influence, shape)
        padded = self.slip.plan.padded
        torus = good_length(shape[0] + 1), good_length(shape[1] + 1)
        quadrant = influence.around(padded)
        # tangential displacements due to pressure, in units of dx; these are odd, so their symbols are imaginary
        self.along = symbols(pressure_quadrants(quadrant), padded).imag / influence.spacing[0]
        self.gap = symbols([(quadrant[ZZ], (1, 1))], padded)[0].real
        self.plan = transform(padded, 3, shape[0] + 1)
        self.torus = NormalOperator.on_torus(influence, torus)
        self.torus_plan = transform(torus, 1, torus[0])

    def multiply(self) -> None:
        """Turn stresses in `plan.real` into displacements, in place: tangential ones in units of dx, u_z in mm."""
        self.plan.forward()
        coupled.multiply_3x3(self.plan.numbers, self.slip.symbol, self.along, self.slip.spacing[0], self.gap)
        self.plan.backward()

    def responses(self, stress: np.ndarray) -> np.ndarray:
        """Slips (-) and u_z (mm), [3, nx, ny], due to `stress` [3, nx, ny] (MPa): qx, qy, p."""
        plan, (nx, ny) = self.plan, self.shape
        plan.real[:] = 0.0
        plan.real[:, :nx, :ny] = stress
        self.multiply()
        result: np.ndarray = plan.real[:, :nx, :ny].copy()
        result[:2] -= plan.real[:2, 1:, :ny]
        return result

    def closing(self, gap: np.ndarray, cells: np.ndarray, factor: float, out: np.ndarray) -> None:
        """Write `factor` times the pressures of zero sum that cause `gap` [nx, >= ny] less its mean into `out` [m].

        They are those at `cells` [m, 2] by the inverse operator on the torus, so that they cause the gap approximately.
        """
        plan = self.torus_plan
        coupled.spread_uneven(gap, cells, factor, plan.real[0])
        plan.forward()
        arrays.scale_real(plan.hat[0], self.torus.inverse)
        plan.backward()
        coupled.gather_uneven(plan.real[0], cells, out)


class CoupledSystem:
    """State of Newton's method on one box of cells, and the linear system of its next step.

    `stress` [3, nx, ny] (MPa): qx, qy, p on the box. `residual_normal`, `residual_tangential`: as defined in
    `NormalSolution` and `solve_tractions`.
    """

    def __init__(self, scene: Scene, influence: Influence, box: Box) -> None:
        if scene.creepage is None:
            raise ValueError("a scene without creepage has no tractions")
        self.scene = scene
        self.operator = CoupledOperator.of(influence, box.shape)
        dx, dy = scene.mesh.spacing
        self.total = scene.load / (dx * dy)
        x, y = (c[s] for c, s in zip(scene.mesh.centres, box.slices, strict=True))
        centres = np.repeat(x, y.size), np.tile(y, x.size)
        w = rigid_slip(*centres, scene.creepage, scene.spin_point * dx)
        # slips and gap of the undeformed bodies; `scale`: slips without tractions, `solve` adds those due to pressure
        self.rigid = np.concatenate([w.T.reshape(2, *box.shape), initial_gap(scene)[box.slices][None]])
        self.scale = self.rigid[:2]
        # factor from the pressures of `closing` to slips: weight times the diagonal of B
        self.unit = _WEIGHT * self.operator.slip.diagonal
        self.products = 0
        self.attainable = np.inf  # estimate of the least normal residual that rounding allows; set by `solve`
        self._cells = np.empty((x.size * y.size, 2), dtype=np.int64)

    def look(self, stress: np.ndarray) -> None:
        """Make `stress` the state: find the cells in contact, their states (stick or slip) and the residuals."""
        tolerance, operator = self.scene.tolerance, self.operator
        self.products += 1
        self.stress = stress
        self.response = operator.responses(stress) + self.rigid
        m, deep, self.approach = coupled.touching_cells(stress, self.response, tolerance.normal, self._cells)
        self.settled = deep == 0  # no cell without pressure overlaps by more than the tolerance
        self.cells = self._cells[:m].copy()
        self.p, self.q, self.s = np.empty(m), np.empty((m, 2)), np.empty((m, 2))
        coupled.gather_contact(stress, self.response, self.cells, self.p, self.q, self.s)
        self.closing = np.empty(m)
        operator.closing(self.response[2], self.cells, 1.0, self.closing)
        self.residual_normal = arrays.norm2(self.closing[None]) / arrays.norm2(self.p[None])
        bound = self.scene.friction * self.p
        w = self.scale[:, self.cells[:, 0], self.cells[:, 1]].T
        self.friction = NewtonSystem(operator.slip, self.cells, np.maximum(bound, _LEAST * bound.max()), w)
        self.residual_tangential = self.friction.classify(self.q, self.s)

    @property
    def residual(self) -> float:
        """The larger of the two residuals, each over the value at which to stop."""
        tolerance, cells = self.scene.tolerance, len(self.cells)
        normal = pressure_residual(tolerance.normal, self.attainable, cells)
        tangential = traction_residual(tolerance.tangential, cells)
        return max(self.residual_normal / normal, self.residual_tangential / tangential)

    @property
    def solved(self) -> bool:
        """Whether both residuals are small enough to stop, and no cell without pressure overlaps."""
        return self.residual <= 1.0 and self.settled

    @property
    def normal_converged(self) -> bool:
        """Whether the pressure meets its tolerance, and no cell without pressure overlaps."""
        return self.settled and self.residual_normal <= self.scene.tolerance.normal

    @property
    def tangential_converged(self) -> bool:
        """Whether the tractions meet their tolerance."""
        return self.residual_tangential <= self.scene.tolerance.tangential

    @property
    def converged(self) -> bool:
        """Whether both pressure and tractions meet their tolerances."""
        return self.normal_converged and self.tangential_converged

    def apply(self, v: np.ndarray, out: np.ndarray) -> None:
        """Write the product of the system's matrix with a vector of unknowns `v` [3 m] into `out` [3 m]."""
        self.products += 1
        m, f, plan = len(self.cells), self.friction, self.operator.plan
        coupled.scatter_unknowns(v, self.cells, f.slip, f.normal, self.scene.friction, f.unit, plan.real)
        self.operator.multiply()
        slips = np.empty(2 * m)  # unused: pressures are cut and scaled after the step, which changes the slips
        tractions.gather_slip(plan.flat[:2], v[m:], f.places, f.operator.ahead, *f.rows, slips, out[m:])
        self.operator.closing(plan.real[2], self.cells, self.unit, out[:m])

    def precondition(self, v: np.ndarray, out: np.ndarray, from_edge: bool = False) -> None:
        """Write an approximate solution for the residuals `v` [3 m] into `out` [3 m]; from_edge: `NewtonSystem`'s."""
        self.products += 1
        m = len(self.cells)
        np.divide(v[:m], self.unit, out=out[:m])
        self.friction.precondition(v[m:], out[m:], from_edge)

    def step(self, forcing: float) -> None:
        """Take the full Newton step; the linear system is solved to `forcing` times its initial residual."""
        self._before = self.stress
        self._after = self._stepped(forcing)
        self.look(self._after)

    def shorten(self, length: float) -> None:
        """Go back and take only the fraction `length` of the last Newton step, with tractions within their bound."""
        stress = self._before + length * (self._after - self._before)
        bound = self.scene.friction * stress[2]
        stress[:2] *= np.minimum(bound / np.maximum(np.hypot(stress[0], stress[1]), 1e-300), 1.0)
        self.look(stress)

    def _stepped(self, forcing: float) -> np.ndarray:
        """Stresses [3, nx, ny] (MPa) after the full step."""
        m, f, friction = len(self.cells), self.friction, self.scene.friction
        residual = np.empty(3 * m)
        np.multiply(self.closing, -self.unit, out=residual[:m])
        tractions.newton_residual(self.s, self.q, *f.rows, friction * self.p, f.unit, residual[m:])
        change, _ = gmres(self.apply, residual, alternating(self.precondition), forcing)
        p, q, stress = self.p.copy(), self.q.copy(), np.empty_like(self.stress)
        coupled.move_contact(change, f.slip, f.normal, friction, f.unit, self.total, p, q)
        coupled.scatter_contact(p, q, self.cells, stress)
        return stress

    def solve(self, stress: np.ndarray, farthest: float) -> int:
        """Run Newton's method from `stress` to the scene's tolerances, and return the number of steps.

        No step is taken if the residual of the pressure exceeds `farthest`, or if the normal tolerance is far below
        what rounding allows.
        """
        without_tractions = stress * np.array([0.0, 0.0, 1.0])[:, None, None]
        self.scale = (self.operator.responses(without_tractions) + self.rigid)[:2]
        self.products += 1
        self.look(stress)
        self.attainable = self.operator.torus.attainable(self.rigid[2], self.response[2], self.stress[2])
        hopeless = self.scene.tolerance.normal < LEAST_TOLERANCE * self.attainable
        if hopeless or self.residual_normal > farthest:
            return 0
        return newton.solve(self, _MAX_NEWTON, _PATIENCE, lambda: self.residual_normal > _LOST)


def solve_coupled(
    scene: Scene, influence: Influence | None = None, level: int = 0
) -> tuple[NormalContact, RollingSolution]:
    """Pressure and tractions of `scene` under full coupling, starting from coarser meshes.

    Both are found by the same Newton steps (Alart and Curnier 1991), whose products are counted with the tractions.
    `level`: how many times the mesh has been coarsened already (`coarser_scene`).
    """
    influence = influence or influence_of(scene)
    contact, q, coarse = from_coarser(scene, influence, level)
    began_at_edge = at_edge(contact.touched, scene.mesh.cells)
    stress = stresses(contact, q)
    box = contact.box.wider(16, scene.mesh.cells)
    start, farthest = stress, _FAR
    iterations = products = 0
    turned: _Turned | None = None
    while True:
        system = CoupledSystem(scene, influence, box)
        steps = system.solve(np.ascontiguousarray(stress[:, *box.slices]), farthest)
        iterations += steps
        products += system.products
        stress = np.zeros(stress.shape)
        stress[:, *box.slices] = system.stress
        touched = Box.around(stress[2] > 0.0)
        if not system.converged and scene.tolerance.normal >= system.attainable:
            # Newton's method was not started, as the pressure was too far off, or it failed
            if turned is not None:
                found = solve_by_turns(scene, influence, turned.stress)
                iterations += found.turns
                products += found.products
                if found.converged:
                    return _after(found, contact, coarse, iterations, products)
                break
            farthest = np.inf
            turned = _in_turn(scene, influence, start)
            stress, box = turned.stress, turned.box
            iterations += turned.turns
            products += turned.products
            continue
        if clear_of_sides(touched, box, scene.mesh.cells):
            break
        box = touched.wider(8, scene.mesh.cells)
    solution = NormalSolution(
        stress[2],
        system.approach,
        system.residual_normal,
        contact.solution.iterations + iterations,
        contact.solution.products,
        system.normal_converged,
        system.attainable,
        # an unconverged pressure that reaches the edge is no evidence, unless the first guess did so too
        at_edge(touched, scene.mesh.cells) and (system.converged or began_at_edge),
    )
    rolling = _tractions(system)
    rolling.iterations, rolling.products, rolling.coarser = iterations, products, coarse
    return NormalContact(scene, influence, solution, coarser=contact.coarser), rolling


def from_coarser(
    scene: Scene, influence: Influence, level: int = 0
) -> tuple[NormalContact, np.ndarray, RollingSolution | None]:
    """Contact with the first guess of the pressure, that of the tractions [m, 2] (MPa), and the coarser solution.

    The guess is interpolated from the coarser mesh's pressure and tractions. Without a coarser mesh it is the
    frictionless pressure with zero tractions, and the coarser solution is None.
    """
    coarse_scene = coarser_scene(scene, level)
    if coarse_scene is None:
        own = scene.tolerance
        loose = replace(scene, tolerance=Tolerance(max(_START, own.normal), own.tangential))
        contact = solve_normal(loose, influence, level)
        return contact, np.zeros((len(contact.cells), 2)), None
    coarser, coarse = solve_coupled(coarse_scene, influence.coarser(), level + 1)
    if coarser.solution.edge:
        coarser, coarse = solve_coupled(in_wider_window(coarse_scene), influence.coarser(), level + 1)
    p = interpolated_pressure(coarser.solution.p, scene.mesh.cells)
    dx, dy = scene.mesh.spacing
    p *= scene.load / (float(p.sum()) * dx * dy)
    guess = NormalSolution(p, coarser.solution.approach, np.inf, 0, 0, converged=False)
    contact = NormalContact(scene, influence, guess, coarser=coarser)
    return contact, interpolated_tractions(coarser, coarse, contact, scene.friction), coarse


def _after(
    found: ByTurns, first: NormalContact, coarse: RollingSolution | None, iterations: int, products: int
) -> tuple[NormalContact, RollingSolution]:
    """What turns alone have `found`, with the numbers of iterations and products since the guess in `first`.

    `coarse`: the coarser mesh's tractions.
    """
    begun = first.solution
    solution = replace(found.contact.solution, iterations=begun.iterations + iterations, products=begun.products)
    rolling = replace(found.rolling, iterations=iterations, products=products, coarser=coarse)
    return NormalContact(first.scene, first.influence, solution, coarser=first.coarser), rolling


class _Turned(NamedTuple):
    """Stresses [3, nx, ny] (MPa) of the window after turns, and a box that contains the cells in contact."""

    stress: np.ndarray
    box: Box
    turns: int
    products: int


def _in_turn(scene: Scene, influence: Influence, stress: np.ndarray) -> _Turned:
    """Pressure and tractions solved in turn, from `stress` [3, nx, ny] (MPa) of the window.

    The error of a turn is the change of the lift (u_z due to tractions) over the overlap of the undeformed bodies (L2
    norms). Turns end when it meets the tolerances. The tolerances of each turn follow from the error of the last one.
    Each turn starts from a combination of the last lifts (`mixing.py`), as plain substitution may oscillate or converge
    slowly.
    """
    own = Tolerance(min(scene.tolerance.normal, _CLOSE), min(scene.tolerance.tangential, _CLOSE))
    gap = initial_gap(scene)
    box = Box(0, 0, 0, 0)
    lift = np.zeros(gap.shape)
    mixing = Mixing()
    error = 1.0
    turn = products = 0
    tolerance = Tolerance(1.0, 1.0)
    # a small change of the lift is not enough if the last turn was solved to a loose tolerance
    while turn < _MAX_TURNS and not (error <= max(own.normal, own.tangential) and tolerance == own):
        tolerance = Tolerance(max(own.normal, _TURN * error), max(own.tangential, _TURN * error))
        contact, rolling = one_turn(scene, influence, gap + lift, stress, tolerance)
        pressure = contact.solution
        products += pressure.products + rolling.products
        stress = stresses(contact, rolling.q)
        if not box.holds(contact.box):
            box = contact.box.wider(4, scene.mesh.cells)
        change = -lift
        change[box.slices] += contact.lift(rolling.q, box)
        error = arrays.norm2(change) / arrays.norm2(np.maximum(pressure.approach - gap - lift, 0.0))
        turn += 1
        if turn == 2:  # the first change, from no lift to the whole, is not used
            mixing.forget()
        lift = mixing.following(lift, change, pressure.p > 0.0)
    return _Turned(stress, box, turn, products)


def _tractions(system: CoupledSystem) -> RollingSolution:
    """The tractions of the cells under pressure; slip cells, off the bound within the residual, are put on it."""
    kept = system.p > 0.0
    q, s, slip, normal = system.q[kept], system.s[kept], system.friction.slip[kept], system.friction.normal[kept]
    bound = system.scene.friction * system.p[kept]
    q = on_bound(q, slip, normal, bound)
    return RollingSolution(q, s, slip, system.residual_tangential, 0, 0, system.tangential_converged, s)
