"""GMRES for the Newton steps: right-preconditioned, no restart (few steps), counted by the caller's products."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rcstudy.mechanics.kernels import tractions

Product = Callable[[np.ndarray, np.ndarray], None]

_ROOM = 16  # steps that there is room for at first: most systems take fewer, and room for 100 costs more than a step


def gmres(apply: Product, b: np.ndarray, precondition: Product, relative: float, max_steps: int) -> np.ndarray:
    """Solve A x = b to ||b - A x|| <= relative * ||b||, from x = 0, by flexible GMRES (Saad 1993).

    `apply(v, out)` and `precondition(v, out)` write products into `out`. Right preconditioning keeps the residual
    that of the system itself.
    """
    x = np.zeros_like(b)
    beta = float(np.linalg.norm(b))
    if beta == 0.0:
        return x
    w = np.empty_like(b)
    v, z, h, rotation, g = _room(min(_ROOM, max_steps), b.size)
    g[0] = beta
    np.divide(b, beta, out=v[0])
    k = 0
    while k < max_steps:
        if k == len(z):
            v, z, h, rotation, g = _room(min(2 * k, max_steps), b.size, (v, z, h, rotation, g))
        precondition(v[k], z[k])
        apply(z[k], w)
        residual = tractions.arnoldi_step(v, k, w, h, rotation, g)
        k += 1
        if residual <= relative * beta:
            break
    tractions.gmres_update(h, g, z, k, x)
    return x


def _room(steps: int, size: int, filled: tuple[np.ndarray, ...] = ()) -> tuple[np.ndarray, ...]:
    """Basis v, preconditioned basis z, triangle h, rotations and right-hand side g for `steps` steps.

    Nothing is read before it is written; what stands in the smaller arrays `filled` is copied.
    """
    arrays = (
        np.empty((steps + 1, size)),
        np.empty((steps, size)),
        np.empty((steps + 1, steps)),
        np.empty((2, steps)),
        np.empty(steps + 1),
    )
    for array, old in zip(arrays, filled, strict=False):
        array[tuple(slice(n) for n in old.shape)] = old
    return arrays
