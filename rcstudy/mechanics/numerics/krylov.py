"""GMRES for the Newton steps: right-preconditioned, without restart (few steps are needed); callers count products."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rcstudy.mechanics.kernels import arrays
from rcstudy.mechanics.kernels import gmres as kernel
from rcstudy.mechanics.numerics.keeping import keep_within

Product = Callable[[np.ndarray, np.ndarray], None]

_FIRST_STEPS = 16  # steps allocated at first: most systems take fewer, and allocating 100 costs more than a step
_MAX_STEPS = 100  # of one linear system
_WORKSPACE_BYTES = 64 * 2**20  # of all kept: enough for one solve on 512 x 512 cells, many on smaller meshes


class Workspace:
    """The work arrays of GMRES for systems of one size.

    Basis v [steps + 1, n], preconditioned basis z [steps, n], products w [steps, n + extra], triangular matrix h
    [steps + 1, steps], Givens rotations [2, steps] and right-hand side g [steps + 1]. Nothing is read before it is
    written.
    """

    def __init__(self, size: int, extra: int) -> None:
        self._size, self._width = size, size + extra
        self.arrays = self._make(_FIRST_STEPS)

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return sum(array.nbytes for array in self.arrays)

    def double(self) -> None:
        """Double the number of steps allocated; the contents are kept."""
        old = self.arrays
        self.arrays = self._make(2 * len(old[1]))
        for array, filled in zip(self.arrays, old, strict=True):
            array[tuple(slice(n) for n in filled.shape)] = filled

    def _make(self, steps: int) -> tuple[np.ndarray, ...]:
        return (
            np.empty((steps + 1, self._size)),
            np.empty((steps, self._size)),
            np.empty((steps, self._width)),
            np.empty((steps + 1, steps)),
            np.empty((2, steps)),
            np.empty(steps + 1),
        )


@keep_within(_WORKSPACE_BYTES)
def workspace(size: int, extra: int) -> Workspace:
    """Work arrays for systems of `size` unknowns, kept: fresh memory would cost up to an eighth of the products."""
    return Workspace(size, extra)


def gmres(
    apply: Product,
    b: np.ndarray,
    precondition: Product,
    relative: float,
    max_steps: int = _MAX_STEPS,
    extra: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """Solution x [n] of A x = b by flexible GMRES (Saad 1993) from x = 0, and extra products with x [extra].

    It ends at ||b - A x|| <= relative * ||b||, or after `max_steps` steps. `apply(v, out)` and `precondition(v, out)`
    write products into `out`. With right preconditioning the residual is that of the system itself. The matrix of
    `apply` may have `extra` more rows that are not part of the system; their product with x is the second result.
    """
    beta = arrays.norm2(b[None])
    if beta == 0.0:
        return np.zeros(b.size), np.zeros(extra)
    work = workspace(b.size, extra)
    v, z, w, h, rotation, g = work.arrays
    g[0] = beta
    np.divide(b, beta, out=v[0])
    k = 0
    while k < max_steps:
        if k == len(z):
            work.double()
            v, z, w, h, rotation, g = work.arrays
        precondition(v[k], z[k])
        apply(z[k], w[k])
        residual = kernel.arnoldi_step(v, k, w[k], h, rotation, g)
        k += 1
        if residual <= relative * beta:
            break
    x, more = np.empty(b.size), np.empty(extra)
    kernel.gmres_update(h, g, z, w, k, x, more)
    return x, more
