r"""Tractions in steady rolling: a semismooth Newton method with FFT products.

Unknown: tractions q on the cells in contact. Slip in cell (i, j), the contract of ``tests/reference``:

    s = w + s_p + B q,   w = (xi_x - phi y, xi_y + phi x),   (B q)_ij = (u_ij - u_(i+1)j)/dx,  u = A q,

with s_p the same difference of the displacement by pressure (the paper's Eq. 5 with an upwind difference; Kalker 1990,
section 4). Coulomb's law (Eq. 6) is the equation q = Proj(q - rho s) with Proj onto the disc of radius mu p, any rho > 0.
Its semismooth Newton step, with t = q - rho s at the last iterate: where |t| <= mu p the cell sticks, s = 0; elsewhere
q = mu p n + tau m with n = t/|t|, m across it, and

    m.s + d tau = 0,   d = (|t| - mu p)/(rho mu p)   (at the solution |s|/(mu p)).

The linear system is solved by GMRES; one product with B costs four real FFTs of the contact's own padded box.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rcstudy.mechanics import kernels
from rcstudy.mechanics.convolution import difference_symbol, padded_shape, transform
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.krylov import gmres
from rcstudy.mechanics.scene import Creepage

_MAX_NEWTON = 60
_SHIFT = 0.06  # of the preconditioner's symbol, over the operator's diagonal


@dataclass
class RollingSolution:
    """Tractions `q` and slips `s` [m, 2] (MPa, -) and slip flags [m] of the contact cells, and how they were found.

    `residual`: ||q - Proj(q - rho s)|| / ||mu p||; `products`: operator and preconditioner products together.
    """

    q: np.ndarray
    s: np.ndarray
    slip: np.ndarray
    residual: float
    iterations: int
    products: int
    converged: bool


class SlipOperator:
    """The operator B (slip by tractions, 1/MPa) on a box of cells, and its shifted inverse as a preconditioner.

    Immutable once made: belongs to one set of bodies, one mesh and one box; used by all creepages.
    """

    def __init__(self, influence: Influence, spacing: tuple[float, float], shape: tuple[int, int]) -> None:
        padded = padded_shape(shape)
        size = padded[0] * padded[1]
        quadrant = influence.quadrant(padded[0] // 2 + 2, padded[1] // 2 + 1)
        xx, xy, yy = (
            difference_symbol(quadrant[component], padded, (parity, parity), spacing[0])
            for component, parity in ((1, 1), (3, -1), (2, 1))
        )
        self.padded = padded
        self.symbol = np.stack([xx, xy, xy, yy])
        # diagonal of B: (A(0) - A(1))/dx
        self.diagonal = float(
            min(
                (quadrant[1, 0, 0] - quadrant[1, 1, 0]) / spacing[0],
                (quadrant[2, 0, 0] - quadrant[2, 1, 0]) / spacing[0],
            )
        )
        shift = _SHIFT * self.diagonal / size
        det = (xx + shift) * (yy + shift) - xy * xy
        self.inverse = np.stack([yy + shift, -xy, -xy, xx + shift]) / (det * size * size)
        self.plan = transform(padded, 2)


def rigid_slip(x: np.ndarray, y: np.ndarray, creepage: Creepage, ahead: float) -> np.ndarray:
    """Rigid slip [m, 2] per unit rolling speed at x, y [m] (mm): (xi_x - phi y, xi_y + phi (x + ahead)).

    The paper's Eq. 5; `ahead` (mm) moves the point at which the spin part is taken.
    """
    return np.stack(
        (creepage.longitudinal - creepage.spin * y, creepage.lateral + creepage.spin * (x + ahead)), axis=1
    )


def solve_tractions(
    operator: SlipOperator,
    cells: np.ndarray,
    bound: np.ndarray,
    w: np.ndarray,
    tolerance: float,
    guess: np.ndarray | None = None,
) -> RollingSolution:
    """Solve Coulomb's law on the cells in contact.

    `cells` [m, 2]: indices in the operator's box; `bound` [m]: mu p > 0 (MPa); `w` [m, 2]: rigid slip plus slip by pressure;
    `guess` [m, 2]: tractions to start from. The relative tolerance is on ||q - Proj(q - rho s)||/||mu p||.
    """
    n = cells.shape[0]
    rho = 1.0 / operator.diagonal
    plan = operator.plan
    slip = np.zeros(n, dtype=np.bool_)
    none = np.zeros(n, dtype=np.bool_)
    normal, diagonal = np.zeros((n, 2)), np.zeros(n)
    scale = float(np.linalg.norm(bound))
    products = 0

    def multiply(v: np.ndarray, flags: np.ndarray, hat: np.ndarray, diag: np.ndarray) -> np.ndarray:
        nonlocal products
        products += 1
        kernels.scatter_traction(v, cells, flags, normal, plan.real)
        plan.forward()
        kernels.multiply_2x2(plan.hat, hat)
        plan.backward()
        out = np.empty(2 * n)
        kernels.gather_slip(plan.real, v, cells, flags, normal, diag, out)
        return out

    def slips(q: np.ndarray) -> np.ndarray:
        return w + multiply(q.reshape(-1), none, operator.symbol, diagonal).reshape(n, 2)

    q = np.zeros((n, 2)) if guess is None else guess.copy()
    s = slips(q) if guess is not None else w.copy()
    residual = np.inf
    converged = False
    iteration = 0
    previous = np.inf
    while True:
        changed, square = kernels.classify(q, s, bound, rho, slip, normal, diagonal)
        residual = float(np.sqrt(square)) / scale
        if residual <= tolerance or iteration >= _MAX_NEWTON:
            converged = residual <= tolerance
            break
        # the part of q that the step fixes: mu p n in slip cells; the rest is unknown
        known = np.where(slip[:, None], bound[:, None] * normal, 0.0)
        rhs = -(w + multiply(known.reshape(-1), none, operator.symbol, diagonal).reshape(n, 2))
        b = rhs.reshape(-1).copy()
        across = -normal[:, 1] * rhs[:, 0] + normal[:, 0] * rhs[:, 1]
        b[0::2] = np.where(slip, 0.0, rhs[:, 0])
        b[1::2] = np.where(slip, across, rhs[:, 1])
        start = q.reshape(-1).copy()
        start[0::2] = np.where(slip, 0.0, q[:, 0])
        start[1::2] = np.where(slip, -normal[:, 1] * q[:, 0] + normal[:, 0] * q[:, 1], q[:, 1])
        # slip rows carry the bound's curvature on the diagonal: the preconditioner's rows are scaled to match
        weight = np.where(slip, 1.0 / (1.0 + diagonal / operator.diagonal), 1.0)
        forcing = min(1e-2, max(0.1 * residual, 1e-12)) if previous < np.inf else 1e-2

        def apply(v: np.ndarray) -> np.ndarray:
            return multiply(v, slip, operator.symbol, diagonal)

        def precondition(v: np.ndarray, weight: np.ndarray = weight) -> np.ndarray:
            out = multiply(v, slip, operator.inverse, np.zeros(n))
            out[1::2] *= weight
            return out

        x = gmres(apply, b, start, precondition, relative=forcing, max_products=400)
        q = known.copy()
        tau = x[1::2]
        q[:, 0] += np.where(slip, -normal[:, 1] * tau, x[0::2])
        q[:, 1] += np.where(slip, normal[:, 0] * tau, tau)
        # the tangent step leaves the circle by second order: back onto it
        size = np.hypot(q[:, 0], q[:, 1])
        shrink = np.where(slip, bound / np.maximum(size, 1e-300), 1.0)
        q *= shrink[:, None]
        s = slips(q)
        previous = residual
        iteration += 1
    return RollingSolution(q, s, slip, residual, iteration, products, converged)
