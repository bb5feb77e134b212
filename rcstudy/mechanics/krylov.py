"""GMRES for the Newton steps: right-preconditioned, no restart (few steps), counted by the caller's products."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rcstudy.mechanics.kernels import tractions

Product = Callable[[np.ndarray, np.ndarray], None]

_ROOM = 16  # steps that there is room for at first: most systems take fewer, and room for 100 costs more than a step


class Room:
    """The arrays of GMRES, kept from one system to the next of the same size.

    Basis v [steps + 1, n], preconditioned basis z [steps, n], products w [steps, n + extra], triangle h, rotations and
    right-hand side g. Nothing is read before it is written.
    """

    def __init__(self) -> None:
        self._arrays: tuple[np.ndarray, ...] = ()

    def arrays(self, size: int, extra: int) -> tuple[np.ndarray, ...]:
        """v, z, w, h, rotation and g for at least `_ROOM` steps."""
        if not self._arrays or self._arrays[2].shape[1] != size + extra or self._arrays[1].shape[1] != size:
            self._arrays = self._make(_ROOM, size, extra)
        return self._arrays

    def doubled(self) -> tuple[np.ndarray, ...]:
        """The same with room for twice the steps, filled as far as they were."""
        old = self._arrays
        steps, size = old[1].shape
        self._arrays = self._make(2 * steps, size, old[2].shape[1] - size)
        for array, filled in zip(self._arrays, old, strict=True):
            array[tuple(slice(n) for n in filled.shape)] = filled
        return self._arrays

    @staticmethod
    def _make(steps: int, size: int, extra: int) -> tuple[np.ndarray, ...]:
        return (
            np.empty((steps + 1, size)),
            np.empty((steps, size)),
            np.empty((steps, size + extra)),
            np.empty((steps + 1, steps)),
            np.empty((2, steps)),
            np.empty(steps + 1),
        )


def gmres(
    apply: Product,
    b: np.ndarray,
    precondition: Product,
    relative: float,
    max_steps: int,
    room: Room | None = None,
    extra: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """Solve A x = b to ||b - A x|| <= relative * ||b||, from x = 0, by flexible GMRES (Saad 1993).

    `apply(v, out)` and `precondition(v, out)` write products into `out`. Right preconditioning keeps the residual
    that of the system itself. `apply` may have `extra` more rows, that are no part of the system: returns x and these
    rows' product with x.
    """
    x, more = np.zeros_like(b), np.zeros(extra)
    beta = float(np.sqrt(b @ b))
    if beta == 0.0:
        return x, more
    room = room or Room()
    v, z, w, h, rotation, g = room.arrays(b.size, extra)
    g[0] = beta
    np.divide(b, beta, out=v[0])
    k = 0
    while k < max_steps:
        if k == len(z):
            v, z, w, h, rotation, g = room.doubled()
        precondition(v[k], z[k])
        apply(z[k], w[k])
        residual = tractions.arnoldi_step(v, k, w[k], h, rotation, g)
        k += 1
        if residual <= relative * beta:
            break
    tractions.gmres_update(h, g, z, k, x)
    if extra:
        tractions.gmres_update(h, g, w[:, b.size :], k, more)
    return x, more
