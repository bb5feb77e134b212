r"""Pressure under layers that bend like plates: the rim of the contact is eliminated by a direct factorisation.

With the set I of cells in contact known, A_II p = approach - gap is to be solved. The conjugate gradients of
`normal.py` are preconditioned by B_II instead of (A_II)^-1, where B is the inverse of the operator on a torus, and B_II
its part on the contact. The two differ by a term that involves the cells O outside the contact:

    (A_II)^-1 = B_II - B_IO (B_OO)^-1 B_OI.

With (A_II)^-1 the surface outside the contact is free; with B_II its displacement there is zero. On a half-space that
matters little: the eigenvalues of B_II A_II are 1 to 3. A plate held down outside the contact has to bend within a cell
at the edge, and they reach (size of the contact/cell)^3, two for each wave along the edge that is long compared with a
cell: for six layers of 3 to 729 times the substrate's modulus on 64 x 64 cells, 35 exceed 2, and the largest is 350.

Therefore the rim b of the contact, its cells with a neighbour outside it, is eliminated by a Cholesky factorisation.
The system for the cells J inside the rim is then S = A_JJ - A_Jb (A_bb)^-1 A_bJ. Its inverse is the part of (A_II)^-1
on J: the displacement is zero on the rim and free outside. With B_JJ it is zero outside, too, which hardly matters to a
plate already clamped at the rim: the eigenvalues of B_JJ S are 0.7 to 1.6, whatever the layers and the mesh.
A step of conjugate gradients reduces the error by a factor of six, at three products instead of two.

The set of cells in contact is found by Newton's method: cells with negative pressure leave it, cells where the
surfaces overlap enter it (the primal-dual active set method: Hintermüller, Ito and Kunisch 2003).
"""

from __future__ import annotations

import numpy as np

from rcstudy.mechanics.kernels import arrays, pressure
from rcstudy.mechanics.normal_operator import NormalOperator, NormalSolution
from rcstudy.mechanics.plates import all_around

_MAX_SETS = 40  # sets of cells in contact that are tried
_MAX_STEPS = 60  # of conjugate gradients on one set
_FORCING = 0.1  # residual, over the initial one, to which a set of cells that will change is solved
_LONGEST = 4  # most rim cells, over nx + ny of the box: a contact in one piece has fewer
# Rims of so many cells are eliminated in any case: from a first set far from the solution's, contacts fall into many
# pieces before they are whole again. (Of 250 under plates 1e3 to 1e7 times as stiff as the body that they lie on 21
# were not solved without it, many others by conjugate gradients; it takes 0.2 s and 33 MB.)
_ANY_RIM = 2048


class RimSolver:
    """Iterates of the solution on a box of cells: pressures `p` of sum `total` (MPa), and gaps `g` (mm) under these.

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
        """The pressure with a residual of at most `tolerance`, or as near as the iteration comes."""
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
        """Flags [nx, ny] of cells of the contact `inside` under tension, and of cells outside it that overlap."""
        return inside & (self.p <= 0.0), ~inside & (self.g < self.approach)

    def _matters(self, leaving: np.ndarray, entering: np.ndarray, tolerance: float) -> bool:
        """Whether tension in `leaving` or overlap in `entering` cells exceeds the relative tolerance anywhere."""
        permitted = self.operator.overlap(tolerance, self.approach, self.p)
        tension = self.p[leaving].min(initial=0.0) < -tolerance * self.p.max()
        overlap = self.g[entering].min(initial=np.inf) < self.approach - permitted
        return bool(tension or overlap)

    def _enter(self, rim: _Rim, leaving: np.ndarray) -> None:
        """Set the pressure of `leaving` cells to zero; change the rim's so that its gaps close and the load is kept."""
        change = np.where(leaving, -self.p, 0.0)
        gap = self.g[rim.at]
        rim.add_lift(change, gap)
        change[rim.at], self.approach = rim.close(gap, -float(change.sum()))
        self.p += change
        self.g += self._image(change)
        self.iterations += 1
        self.change = float(arrays.norm2(change) / arrays.norm2(self.p))

    def _settle(self, rim: _Rim, inside: np.ndarray, tolerance: float) -> None:
        """Conjugate gradients for the cells inside the rim; the gaps on the rim stay equal to the approach.

        They end at `tolerance`, or at `_FORCING` times the initial residual if other cells are found in contact.
        """
        r = np.zeros_like(self.p)
        d, image = np.zeros_like(r), np.zeros_like(r)
        zr = rise = 0.0
        first = 1.0
        for step in range(_MAX_STEPS):
            last, r = r, np.where(rim.interior, self.approach - self.g, 0.0)
            z = np.where(rim.interior, self.operator.closing(r), 0.0)
            self.products += 1
            self.residual = float(arrays.norm2(z) / arrays.norm2(self.p))
            if step == 0:
                first = min(max(self.residual, self.change), 1.0)
            if self.residual <= tolerance:
                break
            if self.residual <= _FORCING * first and self._matters(*self._misplaced(inside), tolerance):
                break
            previous, zr = zr, _dot(z, r)
            beta = max((zr - _dot(z, last)) / previous, 0.0) if step else 0.0  # Polak and Ribiere
            z_image = self._image(z)
            answer = np.zeros_like(z)
            answer[rim.at], z_rise = rim.close(z_image[rim.at], -float(z.sum()))
            z_image += self._image(answer)
            d = z + answer + beta * d
            image = z_image + beta * image
            rise = z_rise + beta * rise
            curvature = _dot(d, image)
            if curvature <= 0.0:  # only rounding errors are left
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
    """Sum of products, without the BLAS, so that it does not depend on the number of threads."""
    return float((a * b).sum())


class _Rim:
    """The rim of the contact `inside` [nx, ny], its cells with a neighbour outside it, with A_bb factorised.

    `at`: their indices along x and y, [nb] each; `interior` [nx, ny]: flags of the other cells in contact. Raises
    LinAlgError if A_bb is not positive definite to rounding, or the rim is too long (`_LONGEST`, `_ANY_RIM`).
    """

    def __init__(self, operator: NormalOperator, inside: np.ndarray) -> None:
        self.interior = inside & all_around(inside)
        self._cells = np.argwhere(inside & ~self.interior)
        self.at = self._cells[:, 0], self._cells[:, 1]
        count = len(self._cells)
        if count > max(_LONGEST * sum(inside.shape), _ANY_RIM):
            raise np.linalg.LinAlgError(f"a rim of {count} cells")
        self._coefficients = operator.coefficients
        self._factor = np.zeros((count, count))
        pressure.displacement_matrix(self._coefficients, self._cells, self._factor)
        if not pressure.factorise(self._factor):
            raise np.linalg.LinAlgError("a matrix that is not positive")
        self._uniform = np.ones(count)
        pressure.solve_factorised(self._factor, self._uniform)

    def add_lift(self, p: np.ndarray, gap: np.ndarray) -> None:
        """Add to the rim's gaps `gap` [nb] (mm) the u_z by pressures `p` [nx, ny] (MPa), of which few are nonzero."""
        pressure.add_displacement(self._coefficients, p, np.argwhere(p), self._cells, gap)

    def close(self, gap: np.ndarray, load: float) -> tuple[np.ndarray, float]:
        """Pressures [nb] (MPa) of sum `load` that make the rim's gaps `gap` [nb] (mm) equal, and these gaps' value."""
        p = -gap
        pressure.solve_factorised(self._factor, p)
        level = (load - float(p.sum())) / float(self._uniform.sum())
        return p + level * self._uniform, level
