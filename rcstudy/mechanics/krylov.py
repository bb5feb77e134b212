"""GMRES for the Newton steps: right-preconditioned, no restart (few steps), counted by the caller's products."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rcstudy.mechanics.keeping import keep_within
from rcstudy.mechanics.kernels import arrays
from rcstudy.mechanics.kernels import gmres as kernel

Product = Callable[[np.ndarray, np.ndarray], None]

_ROOM = 16  # steps that there is room for at first: most systems take fewer, and room for 100 costs more than a step
_ROOM_BYTES = 64 * 2**20  # held by rooms that are kept: those of one solve on 512 x 512 cells, many of smaller meshes


class Room:
    """The arrays of GMRES for systems of one size.

    Basis v [steps + 1, n], preconditioned basis z [steps, n], products w [steps, n + extra], triangle h, rotations and
    right-hand side g. Nothing is read before it is written.
    """

    def __init__(self, size: int, extra: int) -> None:
        self._size, self._width = size, size + extra
        self.arrays = self._make(_ROOM)

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return sum(array.nbytes for array in self.arrays)

    def double(self) -> None:
        """Make room for twice the steps, filled as far as it was."""
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


@keep_within(_ROOM_BYTES)
def room_for(size: int, extra: int) -> Room:
    """Room for systems of `size` unknowns: fresh memory would cost as much as an eighth of the products."""
    return Room(size, extra)


def gmres(
    apply: Product,
    b: np.ndarray,
    precondition: Product,
    relative: float,
    max_steps: int,
    extra: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """Solve A x = b by flexible GMRES (Saad 1993) from x = 0.

    It ends at ||b - A x|| <= relative * ||b||, or after `max_steps` steps. `apply(v, out)` and `precondition(v, out)`
    write products into `out`. Right preconditioning keeps the residual that of the system itself. `apply` may have
    `extra` more rows, that are no part of the system: returns x and these rows' product with x.
    """
    beta = arrays.norm2(b[None])
    if beta == 0.0:
        return np.zeros(b.size), np.zeros(extra)
    room = room_for(b.size, extra)
    v, z, w, h, rotation, g = room.arrays
    g[0] = beta
    np.divide(b, beta, out=v[0])
    k = 0
    while k < max_steps:
        if k == len(z):
            room.double()
            v, z, w, h, rotation, g = room.arrays
        precondition(v[k], z[k])
        apply(z[k], w[k])
        residual = kernel.arnoldi_step(v, k, w[k], h, rotation, g)
        k += 1
        if residual <= relative * beta:
            break
    x, more = np.empty(b.size), np.empty(extra)
    kernel.gmres_update(h, g, z, w, k, x, more)
    return x, more
