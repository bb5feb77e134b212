"""GMRES for the Newton steps: right-preconditioned, no restart (few steps), counted by the caller's products."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rcstudy.mechanics.kernels import tractions

Product = Callable[[np.ndarray, np.ndarray], None]


def gmres(apply: Product, b: np.ndarray, precondition: Product, relative: float, max_steps: int) -> np.ndarray:
    """Solve A x = b to ||b - A x|| <= relative * ||b||, from x = 0, by flexible GMRES (Saad 1993).

    `apply(v, out)` and `precondition(v, out)` write products into `out`. Right preconditioning keeps the residual
    that of the system itself.
    """
    x = np.zeros_like(b)
    beta = float(np.linalg.norm(b))
    if beta == 0.0:
        return x
    # memory never touched costs nothing: the arrays are as long as the steps taken need
    w = np.empty_like(b)
    v = np.empty((max_steps + 1, b.size))
    z = np.empty((max_steps, b.size))
    h = np.zeros((max_steps + 1, max_steps))
    rotation = np.zeros((2, max_steps))
    g = np.zeros(max_steps + 1)
    g[0] = beta
    np.divide(b, beta, out=v[0])
    k = 0
    while k < max_steps:
        precondition(v[k], z[k])
        apply(z[k], w)
        residual = tractions.arnoldi_step(v, k, w, h, rotation, g)
        k += 1
        if residual <= relative * beta:
            break
    tractions.gmres_update(h, g, z, k, x)
    return x
