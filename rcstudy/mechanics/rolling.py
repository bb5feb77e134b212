r"""Tractions in steady rolling: a semismooth Newton method with FFT products.

The unknowns are the tractions q on the cells in contact. The slip in cell (i, j), as defined in ``tests/reference``, is

    s = w + s_p + B q,   w = (xi_x - phi y, xi_y + phi x),   (B q)_ij = (u_ij - u_(i+1)j)/dx,  u = A q,

with s_p the same difference of the displacement by pressure (the paper's Eq. 5 with an upwind difference;
Kalker 1990, section 4). Coulomb's law (Eq. 6, with the traction of slip cells opposite to their slip, which it leaves
open; Kalker 1990) is equivalent to q = Proj(q - rho s), with Proj the projection onto the disc of radius mu p and any
rho > 0. In its semismooth Newton step, with t = q - rho s at the last iterate, a cell with |t| <= mu p sticks, s = 0;
elsewhere q = mu p n + tau m with n = t/|t|, m perpendicular to n, and

    c m.s + (1 - c) b tau = 0,   c = mu p/|t|,   b = 1/rho.

This is m.s + d tau = 0 with d = (1/c - 1) b, at the solution |s|/(mu p). As d may be a millionth of b in one cell and a
million times b in another, each row is scaled by c, so that residuals of all rows count like errors of tractions.

Iterates are not projected onto the bound: that would take one more product, for the slips of the projected tractions,
and would save no step. Slips are linear in q and follow from the products of the linear system.

The linear systems are solved by GMRES. Its preconditioner has two parts, both on a torus hardly larger than the box.

1. Stick cells (rows s). B is the upwind difference of the convolution A. So B^-1 is about a sum along each row from the
   leading edge back, which undoes the difference, followed by A^-1. Slip cells with d <= 2 b, which are those beside
   the stick zone, hardly slip across their bounds: their rows, c m.s + ..., take part like those of stick cells, and
   displacements across their bounds are passed on along the row, less d tau (tau: by `SlipOperator.held`).
2. Slip cells (rows c (m.s + d tau)), with the residual that part 1 leaves. (B + d)^-1 is a convolution if d is the same
   for all: 2 b 4^n, n >= 0, as near as that comes to the d of a cell of mean c. The residual is multiplied by
   root(1/c), by (1 + d/b) (B + d)^-1 and by root(c). For short waves, where B is about b, that inverts the row exactly.
   Where slip is centred (`centring.py`: C B in place of B), the residual is first divided by 1 + c (C - 1), a
   tridiagonal matrix along each row; without that there are a tenth to a third more products.

Part 1 takes the displacement ahead of the leading edge for zero, which costs products on fine meshes. Flexible GMRES
allows another preconditioner in each step. In contacts of 28 cells along x and more (`aligned`: 26) every second one is
therefore exact at the leading edge (`slip_operator.from_leading_edge`). The number of products then hardly depends on
the mesh: 23, 21, 23 and 23 in the median of the paper's cases on 64, 128, 256 and 512 cells.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import cycle
from typing import NamedTuple

import numpy as np

from rcstudy.mechanics.centring import Centring
from rcstudy.mechanics.kernels import arrays, tractions
from rcstudy.mechanics.numerics import newton
from rcstudy.mechanics.numerics.krylov import Product, gmres
from rcstudy.mechanics.scene import Creepage
from rcstudy.mechanics.slip_operator import SHIFT, SlipOperator
from rcstudy.mechanics.stopping import traction_residual

_MAX_NEWTON = 100  # of 6000 aligned contacts with spin 99 % took 35 steps or fewer, the slowest 66
_PATIENCE = 5  # Newton steps without a gain of a tenth before steps are shortened
_SETTLED = 1e-4  # error of tractions by the frozen correction of slip, over the sum of bounds, that needs no other look
UNSETTLED = 1e-2
"""Largest error of tractions by the frozen correction of slip, over the sum of bounds, of a solution."""
_SMALLEST = 1e-2  # part of the way to the updated correction, after which no less is tried
_LARGEST = 1e30  # largest d of the preconditioner, over `SHIFT` b
_WEIGHT = 2.0  # of the residual mu p - n.q against slips; with 0.1 to 6 the number of products differs by a tenth


@dataclass
class RollingSolution:
    """Tractions `q` and slips `s` [m, 2] (MPa, -) and slip flags [m] of the contact cells, and data of the solver.

    `residual`: see `solve_tractions`; `products`: operator and preconditioner products on the mesh itself;
    `s_ahead` [m, 2]: slips half a cell ahead of the cells' centres, where differences of displacements belong (`s` has
    those of slip cells at the centres, see `centring.py`; without centring both are the same); `frozen_correction`
    [m, 2]: the correction of slip to the centres if it was frozen, and `unsettled`: the error of the tractions due to
    that, over the sum of the bounds; `coarser`: the solution with cells of twice the size that this one started from,
    and `interpolated` [m, 2] (MPa): the tractions interpolated from it.
    """

    q: np.ndarray
    s: np.ndarray
    slip: np.ndarray
    residual: float
    iterations: int
    products: int
    converged: bool
    s_ahead: np.ndarray
    coarser: RollingSolution | None = None
    frozen_correction: np.ndarray | None = None
    unsettled: float = 0.0
    interpolated: np.ndarray | None = None

    def after(self, earlier: RollingSolution) -> RollingSolution:
        """This solution with the iterations and products of the `earlier` one that it started from added to its own.

        `coarser` is that of the earlier one if this one has none.
        """
        iterations, products = self.iterations + earlier.iterations, self.products + earlier.products
        return replace(self, iterations=iterations, products=products, coarser=self.coarser or earlier.coarser)

    @property
    def coarse_products(self) -> int:
        """Products on all coarser meshes."""
        return self.coarser.products + self.coarser.coarse_products if self.coarser is not None else 0

    def power_in_balance(self, w: np.ndarray) -> float:
        """Power of tractions on the slip that they cause, per unit rolling speed and cell: sum(q.(s - w)) (MPa).

        `w` [m, 2]: slip without tractions. The power is nil for surfaces, as the operator of slip is antisymmetric, but
        not with `kalker`'s differences over a cell: what friction takes at edges that slip in less than a cell is
        missing from -sum(q.s) by it. The more nearly all sticks, the larger a part of all power that is: the power at a
        trailing edge where tractions are singular stays as it is while its slip zone vanishes, as energy is released at
        the tip of a crack (Rice 1968).
        """
        return float(np.sum(self.q * (self.s - w)))


def rigid_slip(x: np.ndarray, y: np.ndarray, creepage: Creepage, ahead: float) -> np.ndarray:
    """Rigid slip [m, 2] per unit rolling speed at x, y [m] (mm): (xi_x - phi y, xi_y + phi (x + ahead)).

    The paper's Eq. 5; `ahead` (mm): distance ahead of x at which the spin part is taken.
    """
    w = np.empty((x.size, 2))
    tractions.rigid_slip(x, y, creepage.longitudinal, creepage.lateral, creepage.spin, ahead, w)
    return w


class NewtonSystem:
    """The linear system of a Newton step: flags of slip cells, directions of their bounds, products with the matrix.

    `neighbours`, `local`: see `solve_tractions`.
    """

    def __init__(
        self,
        operator: SlipOperator,
        cells: np.ndarray,
        bound: np.ndarray,
        w: np.ndarray,
        neighbours: np.ndarray | None = None,
        local: np.ndarray | None = None,
    ) -> None:
        n = cells.shape[0]
        self.centring = Centring(neighbours, local) if neighbours is not None else None
        self.operator, self.cells, self.bound, self.w = operator, cells, bound, w
        self.places, self._places = operator.plan.places(cells), operator.torus_plan.places(cells)
        self.rho = 1.0 / operator.diagonal
        self.unit = self.rho / _WEIGHT  # of the unknowns of slip cells along the bound's direction (MPa)
        # largest scale of residuals: converged tractions are within their bounds, so the residual of an iterate far
        # beyond them must not look small in relation to that iterate
        self._scale = min(self.rho * arrays.norm2(w), arrays.norm2(bound[None]))
        self.slip = np.zeros(n, dtype=np.bool_)
        self.normal = np.zeros((n, 2))
        self.share, self._damping, self._root = np.zeros((3, n))
        self._work = np.zeros((2, n))
        self._power = 0  # of 4 in d = `SHIFT` 4^power b of the preconditioner
        self.products = 0
        self.rows = self.slip, self.normal, self.share, operator.diagonal  # these define the rows
        self._no_slip = np.zeros(n, dtype=np.bool_)
        self._slipping = 0  # number of slip cells
        self._near = n  # number of cells that stick or hardly slip
        # slips to which Coulomb's law was last applied: as they are, at cell centres, or with the frozen correction
        self.lawful = w

    @property
    def frozen_correction(self) -> np.ndarray | None:
        """The frozen correction of slip [m, 2]; None while `centring` finds it from the slip, or without centring."""
        return None if self.centring is None else self.centring.frozen

    @property
    def _active_centring(self) -> Centring | None:
        """The `centring` while it finds its correction from the slip; None once that is frozen, or without centring."""
        return self.centring if self.frozen_correction is None else None

    def classify(self, q: np.ndarray, s: np.ndarray) -> float:
        """Relative residual (`solve_tractions`) of tractions and slips [m, 2]; sets stick and slip from q - rho s."""
        centring = self._active_centring
        self.lawful = s if self.frozen_correction is None else s + self.frozen_correction
        of_law = self.bound, self.rho, self.slip, self.normal, self.share
        self._slipping, miss, square = tractions.classify(q, self.lawful, *of_law)
        if centring is not None:
            self.lawful, miss = centring.update_with_law(q, s, of_law)
        operator = self.operator
        shares, near = tractions.slip_damping(self.share, self.slip, operator.held, self._damping, self._root)
        self._near = near + self.slip.size - self._slipping
        over = (self._slipping / shares - 1.0) / SHIFT if shares > 0.0 else 1.0
        self._power = round(math.log(min(max(over, 1.0), _LARGEST), 4.0))
        residual = _relative(math.sqrt(miss), min(math.sqrt(square), self._scale))
        if centring is not None:
            centring.freeze_if_stalled(s, self.lawful, residual)
        return residual

    def unsettled(self, q: np.ndarray, s: np.ndarray) -> float:
        """Error of tractions `q` [m, 2] (MPa) by Coulomb's law, over the sum of bounds, with the centring up to date.

        That is computed from slips `s` [m, 2], half a cell ahead of the centres. Zero without centring.
        """
        if self.centring is None:
            return 0.0
        rest = q - self.rho * self.centring.update(s, self.slip)
        direction = rest / np.maximum(np.hypot(*rest.T), 1e-300)[:, None]
        lawful = on_bound(rest, self.slip, direction, self.bound)
        return float(np.hypot(*(q - lawful).T).sum() / self.bound.sum())

    def slips(self, q: np.ndarray) -> np.ndarray:
        """Slip [m, 2] under tractions `q` [m, 2]."""
        s = np.empty(q.shape)
        self._multiply(q.reshape(-1), self._no_slip)
        tractions.gather_slips(self.operator.plan.flat, self.places, self.operator.ahead, s.reshape(-1))
        s += self.w
        return s

    def apply(self, v: np.ndarray, out: np.ndarray) -> None:
        """Product of the system's matrix with a vector of unknowns `v` [2 m], then slips by `v`, into `out` [4 m]."""
        rows, slips = out[: v.size], out[v.size :]
        self._multiply(v, self.slip)
        centring = self._active_centring
        of_rows = self.operator.plan.flat, v, self.places, self.operator.ahead, *self.rows
        if centring is None:
            tractions.gather_slip(*of_rows, slips, rows)
        else:
            tractions.gather_centred_slip(*of_rows, centring.weight, slips, rows)

    def _multiply(self, v: np.ndarray, slip: np.ndarray) -> None:
        """Displacements by unknowns `v` [2 m], those of slip cells being flagged in `slip` [m], into `plan.real`."""
        self.products += 1
        operator, of_unknowns = self.operator, (slip, self.normal, self.unit)
        tractions.scatter_traction(v, self.places, *of_unknowns, operator.plan.flat)
        operator.multiply()
        if operator.cross is not None:
            leading, cross, ahead = operator.cross
            tractions.add_cross_slip(v, leading, *of_unknowns, cross, ahead, operator.plan.flat)

    def precondition(self, v: np.ndarray, out: np.ndarray, from_edge: bool = False) -> None:
        """Approximate solution `out` [2 m] for the residuals `v` [2 m]: stick cells, then slip cells with the rest.

        `from_edge`: part 1 is right at the leading edge (Wiener and Hopf 1931), on boxes long enough for that.
        """
        self.products += 1
        operator = self.operator
        plan = operator.torus_plan
        of_cells = self._places, self.slip, self.normal
        if self._near > 0:
            # the first of these kernels sets plan.field to zero outside the cells; the others leave it so
            tractions.near_residual(v, *of_cells, self.share, self._damping, plan.field)
            slips, inverse = plan.field, operator.torus_inverse
            if from_edge and operator.torus_edge is not None:
                before, inverse = operator.torus_edge
                plan.forward()
                arrays.scale_packed(plan.hat, before)
                plan.backward()
                slips = plan.result
            of_rows = *of_cells, self._damping, operator.spacing[0], operator.edge
            tractions.integrate_rows(slips, self.cells, *of_rows, plan.field)
            self._on_torus(inverse)
        else:
            plan.field[:] = 0.0
        tractions.store_near(plan.result, v, *of_cells, self._damping, self.unit, out, plan.field)
        if self._slipping > 0:
            self._on_torus(operator.torus_symbol)
            centring, of_slip = self._active_centring, (plan.result, v, *of_cells, self._root, operator.diagonal, out)
            if centring is None:
                tractions.slip_residual(*of_slip, plan.field)
            else:
                tractions.centred_slip_residual(*of_slip, centring.neighbours, centring.weight, self._work, plan.field)
            self._on_torus(operator.torus_shifted(self._power))
            tractions.gather_slip_traction(plan.result, *of_cells, self._root, out)

    def _on_torus(self, symbol: np.ndarray) -> None:
        """Product of the convolution with `symbol` and the preconditioner's `field`, into its `result`."""
        plan = self.operator.torus_plan
        plan.forward()
        arrays.multiply_packed(plan.hat, symbol)
        plan.backward()

    def step(self, q: np.ndarray, s: np.ndarray, forcing: float) -> tuple[np.ndarray, np.ndarray]:
        """Tractions and slips [m, 2] after the Newton step from `q` and `s`, the last ones that were classified.

        The linear system is solved to `forcing` times its initial residual. Slips are linear in tractions, so those of
        the step follow from the products of the linear system; no other product is needed.
        """
        residual = np.empty(q.size)
        tractions.newton_residual(self.lawful, q, *self.rows, self.bound, self.unit, residual)
        change, slips = gmres(self.apply, residual, alternating(self.precondition), forcing, extra=q.size)
        after = np.empty(q.shape)
        tractions.add_step(q, change, self.slip, self.normal, self.unit, after)
        return after, s + slips.reshape(s.shape)


def alternating(precondition: Callable[[np.ndarray, np.ndarray, bool], None]) -> Product:
    """`precondition` as GMRES takes it: the first time and every other time after that right at the leading edge."""
    from_edge = cycle((True, False))
    return lambda v, out: precondition(v, out, next(from_edge))


def solve_tractions(
    operator: SlipOperator,
    cells: np.ndarray,
    bound: np.ndarray,
    w: np.ndarray,
    tolerance: float,
    guess: np.ndarray | None = None,
    neighbours: np.ndarray | None = None,
    local: np.ndarray | None = None,
    most_steps: int | None = None,
) -> RollingSolution:
    """Tractions, slips and slip flags of the cells in contact by Coulomb's law.

    `cells` [m, 2]: indices in the operator's box; `bound` [m]: mu p > 0 (MPa); `w` [m, 2]: rigid slip plus slip by
    pressure; `guess` [m, 2]: tractions (MPa) to start from; `neighbours` [2, m]: numbers of the cells ahead and behind;
    if given, the direction of slip is taken at the centres of slip cells, `local` [5, m] being the part of the slip
    that is known there (`centring.py`). The residual, to be less than `tolerance`, is ||q - Proj(q - rho s)|| over the
    smallest of ||q||, ||mu p|| and rho ||w||, 1/rho being the diagonal of B: tractions and slip are then right to about
    that fraction of their own size. `most_steps`: of Newton's method, by default `_MAX_NEWTON`.
    """
    system = NewtonSystem(operator, cells, bound, w, neighbours, local)
    stop = traction_residual(tolerance, len(cells))
    state = _Tractions(system, guess, stop)
    iterations = newton.solve(state, most_steps or _MAX_NEWTON, _PATIENCE)
    looks, unsettled = _look_again(state)
    residual = state.residual * stop
    # slip cells, also those that changed their state in the last step, miss the bound by no more than the residual
    return RollingSolution(
        q=on_bound(state.q, system.slip, system.normal, bound),
        s=system.lawful,
        slip=system.slip,
        residual=residual,
        iterations=iterations + looks,
        products=system.products,
        converged=residual <= tolerance,
        s_ahead=state.s,
        frozen_correction=system.frozen_correction,
        unsettled=unsettled,
    )


def _look_again(state: _Tractions) -> tuple[int, float]:
    """Resume a solution with a frozen correction of slip, recomputing that correction for as long as this helps.

    One correction may lead to another and that one back, with more than `UNSETTLED` left: parts of the way from the
    best solution end this (`_approach`). Returns the number of Newton steps, and the error of the tractions over the
    sum of bounds due to the frozen correction; 0 if that is not frozen any more or there is no solution.
    """
    steps, before = 0, np.inf
    least: _Look | None = None
    while state.system.frozen_correction is not None and state.solved:
        unsettled = state.system.unsettled(state.q, state.s)
        if least is None or unsettled < least.unsettled:
            least = _Look(unsettled, state.q, state.s, state.system.frozen_correction)
        if not _SETTLED < unsettled < 0.5 * before:
            if unsettled <= UNSETTLED:
                return steps, unsettled
            break
        before = unsettled
        state.look_again()
        steps += newton.solve(state, _MAX_NEWTON, _PATIENCE)
    if least is None or (state.solved and state.system.frozen_correction is None):
        return steps, 0.0
    more, unsettled = _approach(state, least)
    return steps + more, unsettled


class _Look(NamedTuple):
    """A solution with a frozen correction, and the error of its tractions due to that."""

    unsettled: float
    q: np.ndarray
    s: np.ndarray
    frozen: np.ndarray


def _approach(state: _Tractions, least: _Look) -> tuple[int, float]:
    """Go from the `least` unsettled solution by ever smaller parts of the way, while it is worse than `UNSETTLED`.

    Half the way is tried first, and less where that is no better: where a cell at the limit of stick and slip changes
    its state, the error jumps, and it is least just before the jump. `state` is then the best solution; returns the
    number of Newton steps and its error.
    """
    steps, part = 0, 0.5
    state.resume(least.q, least.s, least.frozen)
    while least.unsettled > UNSETTLED and part >= _SMALLEST:
        state.go_part(part)
        steps += newton.solve(state, _MAX_NEWTON, _PATIENCE)
        frozen = state.system.frozen_correction
        unsettled = state.system.unsettled(state.q, state.s) if state.solved else np.inf
        if frozen is not None and unsettled < least.unsettled:
            least = _Look(unsettled, state.q, state.s, frozen)
        else:
            part *= 0.5
            state.resume(least.q, least.s, least.frozen)
    return steps, least.unsettled


class _Tractions:
    """Iterates of tractions `q` and slips `s` [m, 2] for Coulomb's law: a `newton.State`."""

    def __init__(self, system: NewtonSystem, guess: np.ndarray | None, tolerance: float) -> None:
        self.system, self._tolerance = system, tolerance
        self._take(np.zeros(system.w.shape), system.w) if guess is None else self._take(guess, system.slips(guess))

    def _take(self, q: np.ndarray, s: np.ndarray) -> None:
        self.q, self.s = q, s
        self.residual = self.system.classify(q, s) / self._tolerance

    @property
    def solved(self) -> bool:
        return self.residual <= 1.0

    def look_again(self) -> None:
        """Classify the cells again at the present tractions, with the centring computed from the slip, not frozen."""
        if self.system.centring is not None:
            self.system.centring.restart()
        self._take(self.q, self.s)

    def go_part(self, part: float) -> None:
        """Move the frozen correction by `part` of the way to the one computed from the slip."""
        if self.system.centring is not None:
            self.system.centring.go_part(self.s, self.system.slip, part)
        self._take(self.q, self.s)

    def resume(self, q: np.ndarray, s: np.ndarray, frozen: np.ndarray) -> None:
        """Return to tractions `q` and slips `s` [m, 2] with this `frozen` correction."""
        if self.system.centring is not None:
            self.system.centring.frozen = frozen
        self._take(q, s)

    def step(self, forcing: float) -> None:
        self._before = self.q
        self._take(*self.system.step(self.q, self.s, forcing))
        self._after = self.q

    def shorten(self, length: float) -> None:
        q = within(self._before + length * (self._after - self._before), self.system.bound)
        self._take(q, self.system.slips(q))


def on_bound(q: np.ndarray, slip: np.ndarray, normal: np.ndarray, bound: np.ndarray) -> np.ndarray:
    """Tractions `q` [m, 2] (MPa) scaled back to `bound` [m]; those of slip cells short of it are put on it.

    The latter along `normal` [m, 2]. Tractions that miss the bound by rounding alone stay as they are.
    """
    result = np.empty(q.shape)
    tractions.put_on_bound(q, slip, normal, bound, result)
    return result


def within(q: np.ndarray, bound: np.ndarray) -> np.ndarray:
    """Tractions `q` [m, 2] (MPa), scaled back to `bound` [m] (MPa) where they exceed it."""
    size = np.hypot(q[:, 0], q[:, 1])
    beyond = size > bound
    result: np.ndarray = q * (np.where(beyond, bound, 1.0) / np.where(beyond, size, 1.0))[:, None]
    return result


def _relative(size: float, scale: float) -> float:
    """size/scale, with 0/0 = 0, as without creepage there are no tractions and no residual. NaN if both are NaN."""
    if scale == 0.0:
        return 0.0 if size == 0.0 else np.inf
    return size / scale
