r"""Pressure under layers that bend like plates: the rim of the contact is solved for directly.

With the cells in contact I known, A_II p = approach - gap is to be solved. What the conjugate gradients of `normal.py`
take for (A_II)^-1 is B_II, the inverse B of the operator on a torus cut down to the contact. These differ by what is
beyond the contact, O:

    (A_II)^-1 = B_II - B_IO (B_OO)^-1 B_OI.

The right-hand side lets the surface beyond the contact go where it will; B_II holds it down. On a half-space
that matters little: the eigenvalues of B_II A_II are 1 to 3. A plate held down at its edge has to bend within a cell
there, and they reach (size of the contact/cell)^3, two for each wave along the edge that is long against a cell: 35 of
them above 2 and the largest 350 for six layers of 3 to 729 times the substrate's modulus on 64 x 64 cells.

So the cells of the contact that have a neighbour beyond it, its rim b, are eliminated by a Cholesky factorisation, and
what remains for the cells J inside it is S = A_JJ - A_Jb (A_bb)^-1 A_bJ. Its inverse is that of A_II cut down to J:
the surface stays down on the rim and is free beyond it. B_JJ holds it down beyond as well, and the plate hardly feels
the difference, clamped as it is by the rim: the eigenvalues of B_JJ S are 0.7 to 1.6, whatever the layers and the mesh.
A step of conjugate gradients gains a factor of six, at three products instead of two.

Which cells are in contact is found by Newton's method: where the pressure comes out negative they leave, where the
surfaces overlap they enter (the primal-dual active set method: Hintermueller, Ito and Kunisch 2003).
"""

from __future__ import annotations

import numpy as np

from rcstudy.mechanics.kernels import arrays, pressure
from rcstudy.mechanics.normal_operator import NormalOperator, NormalSolution
from rcstudy.mechanics.patience import Patience

_MAX_SETS = 40  # of cells in contact that are tried
_MAX_STEPS = 60  # on one set
_PATIENCE = 8  # steps without a smaller residual
_FORCING = 0.1  # how far a set that is not the right one is solved, of its first residual
_LONGEST = 4  # cells of a rim over those along two sides of the box; longer ones are of no contact in one piece


class RimSolver:
    """Pressures `p` of sum `total` (MPa) on a box of cells, and the gaps `g` (mm) that they leave, on their way.

    `gap` [nx, ny] (mm): undeformed distance; `p` [nx, ny] (MPa): pressures >= 0 to start from.
    """

    def __init__(self, operator: NormalOperator, gap: np.ndarray, p: np.ndarray, total: float) -> None:
        self.operator = operator
        self.total = total
        self.p = p * (total / p.sum())
        self.g = gap + operator.displacement(self.p)
        self.products = 1
        self.iterations = 0
        self.residual = self.change = np.inf
        self.approach = float(self.g[self.p > 0.0].mean())
        self.attainable = operator.attainable(gap, self.g, self.p)

    def solve(self, tolerance: float) -> NormalSolution:
        """The pressure to `tolerance`, or as far as it goes."""
        inside = (self.p > 0.0) | (self.g < self.approach)
        leaving = np.zeros_like(inside)
        converged = False
        for _ in range(_MAX_SETS):
            try:
                rim = _Rim(self.operator, inside)
            except np.linalg.LinAlgError:
                break
            self._enter(rim, leaving)
            self._settle(rim, inside, tolerance)
            leaving, entering = self._misplaced(inside)
            if not self._matters(leaving, entering, tolerance):
                converged = self.residual <= tolerance
                break
            inside = (inside & ~leaving) | entering
        p = np.maximum(self.p, 0.0)
        p *= self.total / p.sum()
        numbers = self.approach, self.residual, self.iterations, self.products
        return NormalSolution(p, *numbers, converged, self.attainable)

    def _misplaced(self, inside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Cells [nx, ny] under tension, which are to leave the contact `inside`, and cells that overlap beyond it."""
        return inside & (self.p <= 0.0), ~inside & (self.g < self.approach)

    def _matters(self, leaving: np.ndarray, entering: np.ndarray, tolerance: float) -> bool:
        """Whether any of these cells is out of place by more than the tolerance."""
        tension = self.p[leaving].min(initial=0.0) < -tolerance * self.p.max()
        overlap = self.g[entering].min(initial=np.inf) < self.approach - tolerance * abs(self.approach)
        return bool(tension or overlap)

    def _enter(self, rim: _Rim, leaving: np.ndarray) -> None:
        """Take the pressure off the cells `leaving`; the rim makes up for it, and for the load, and closes its gaps."""
        change = np.where(leaving, -self.p, 0.0)
        gap = self.g[rim.at]
        rim.add_lift(change, gap)
        change[rim.at], self.approach = rim.close(gap, -float(change.sum()))
        self.p += change
        self.g += self._image(change)
        self.iterations += 1
        self.change = float(arrays.norm2(change) / arrays.norm2(self.p))

    def _settle(self, rim: _Rim, inside: np.ndarray, tolerance: float) -> None:
        """Conjugate gradients for the cells inside the rim, whose own gaps stay equal.

        As far as `tolerance`, or to `_FORCING` if it is seen that other cells are in contact.
        """
        r = np.zeros_like(self.p)
        d, image = np.zeros_like(r), np.zeros_like(r)
        zr = rise = 0.0
        first, patience = 1.0, Patience(_PATIENCE)
        for step in range(_MAX_STEPS):
            last, r = r, np.where(rim.interior, self.approach - self.g, 0.0)
            z = np.where(rim.interior, self.operator.closing(r), 0.0)
            self.products += 1
            self.residual = float(arrays.norm2(z) / arrays.norm2(self.p))
            if step == 0:
                first = min(max(self.residual, self.change), 1.0)
            if self.residual <= tolerance or patience.ends(self.residual):
                break
            if self.residual <= _FORCING * first and self._matters(*self._misplaced(inside), tolerance):
                break
            previous, zr = zr, _dot(z, r)
            beta = max((zr - _dot(z, last)) / previous, 0.0) if step else 0.0  # Polak and Ribiere's
            z_image = self._image(z)
            answer = np.zeros_like(z)
            answer[rim.at], z_rise = rim.close(z_image[rim.at], -float(z.sum()))
            z_image += self._image(answer)
            d = z + answer + beta * d
            image = z_image + beta * image
            rise = z_rise + beta * rise
            curvature = _dot(d, image)
            if curvature <= 0.0:  # nothing but rounding
                break
            length = zr / curvature
            self.p += length * d
            self.g += length * image
            self.approach += length * rise
            self.iterations += 1

    def _image(self, p: np.ndarray) -> np.ndarray:
        self.products += 1
        return self.operator.displacement(p)


def _dot(a: np.ndarray, b: np.ndarray) -> float:
    """Sum of products, on one thread whatever the BLAS does."""
    return float((a * b).sum())


class _Rim:
    """The cells of the contact `inside` [nx, ny] that have a neighbour beyond it, factorised.

    `at`: their indices along x and y, [nb] each; `interior` [nx, ny]: the other cells in contact. Raises LinAlgError
    if rounding leaves no factorisation, or the rim is longer than that of a contact in one piece.
    """

    def __init__(self, operator: NormalOperator, inside: np.ndarray) -> None:
        ringed = np.pad(inside, 1)
        self.interior = inside & ringed[2:, 1:-1] & ringed[:-2, 1:-1] & ringed[1:-1, 2:] & ringed[1:-1, :-2]
        self._cells = np.argwhere(inside & ~self.interior)
        self.at = self._cells[:, 0], self._cells[:, 1]
        count = len(self._cells)
        if count > _LONGEST * sum(inside.shape):
            raise np.linalg.LinAlgError(f"a rim of {count} cells")
        self._coefficients = operator.coefficients
        self._factor = np.zeros((count, count))
        pressure.displacement_matrix(self._coefficients, self._cells, self._factor)
        if not pressure.factorise(self._factor):
            raise np.linalg.LinAlgError("a matrix that is not positive")
        self._uniform = np.ones(count)
        pressure.solve_factorised(self._factor, self._uniform)

    def add_lift(self, p: np.ndarray, gap: np.ndarray) -> None:
        """Add to the rim's gaps `gap` [nb] (mm) what a few pressures `p` [nx, ny] do to them."""
        pressure.add_displacement(self._coefficients, p, np.argwhere(p), self._cells, gap)

    def close(self, gap: np.ndarray, load: float) -> tuple[np.ndarray, float]:
        """Pressures [nb] of sum `load` on the rim that make its gaps `gap` [nb] (mm) all the same, and that gap."""
        p = -gap
        pressure.solve_factorised(self._factor, p)
        level = (load - float(p.sum())) / float(self._uniform.sum())
        return p + level * self._uniform, level
