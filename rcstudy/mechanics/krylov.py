"""GMRES for the Newton steps: right-preconditioned, no restart (few steps), counted by the caller's products."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Product = Callable[[np.ndarray], np.ndarray]


def gmres(
    apply: Product,
    b: np.ndarray,
    x0: np.ndarray,
    precondition: Product,
    relative: float,
    max_products: int,
) -> np.ndarray:
    """Solve A x = b to ||b - A x|| <= relative * ||b - A x0|| by flexible GMRES (Saad 1993).

    Right preconditioning keeps the residual that of the system itself. Classical Gram-Schmidt, twice.
    """
    r = b - apply(x0)
    beta = float(np.linalg.norm(r))
    if beta == 0.0:
        return x0
    steps = max_products // 2
    n = b.size
    v = np.empty((steps + 1, n))
    z = np.empty((steps, n))
    h = np.zeros((steps + 1, steps))
    rotation = np.zeros((2, steps))
    g = np.zeros(steps + 1)
    g[0] = beta
    v[0] = r / beta
    k = 0
    while k < steps:
        z[k] = precondition(v[k])
        w = apply(z[k])
        basis = v[: k + 1]
        first = basis @ w
        w = w - first @ basis
        second = basis @ w
        w = w - second @ basis
        h[: k + 1, k] = first + second
        norm = float(np.linalg.norm(w))
        h[k + 1, k] = norm
        for i in range(k):
            c, s = rotation[:, i]
            h[i, k], h[i + 1, k] = c * h[i, k] + s * h[i + 1, k], -s * h[i, k] + c * h[i + 1, k]
        rho = float(np.hypot(h[k, k], h[k + 1, k]))
        c, s = h[k, k] / rho, h[k + 1, k] / rho
        rotation[:, k] = c, s
        h[k, k], h[k + 1, k] = rho, 0.0
        g[k], g[k + 1] = c * g[k], -s * g[k]
        k += 1
        if abs(g[k]) <= relative * beta or norm == 0.0:
            break
        v[k] = w / norm
    y = np.linalg.solve(h[:k, :k], g[:k]) if k else np.zeros(0)
    return x0 + y @ z[:k]
