"""Steps of flexible GMRES (`krylov.py`; Saad 1993): basis, triangular system and its solution."""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def arnoldi_step(v: np.ndarray, k: int, w: np.ndarray, h: np.ndarray, rotation: np.ndarray, g: np.ndarray) -> float:
    """One step of GMRES: adds a vector to the basis and a column to the triangular matrix; returns the residual's norm.

    v[k+1] is w orthogonalised against v[0..k] (modified Gram-Schmidt), of norm 1; column k of the Hessenberg matrix h
    is brought to triangular form by Givens rotations. v [k_max + 1, n], w [>= n], h [k_max + 1, k_max], rotation
    [2, k_max], g [k_max + 1]: right-hand side under the rotations. The residual's norm is |g[k+1]|.
    """
    n = v.shape[1]
    even = n - n % 4
    new = v[k + 1]
    for m in range(n):
        new[m] = w[m]
    for i in range(k + 1):
        row = v[i]
        # four sums at once: in a single one each addition would wait for the one before it
        a = b = c = d = 0.0
        for m in range(0, even, 4):
            a += row[m] * new[m]
            b += row[m + 1] * new[m + 1]
            c += row[m + 2] * new[m + 2]
            d += row[m + 3] * new[m + 3]
        for m in range(even, n):
            a += row[m] * new[m]
        dot = (a + b) + (c + d)
        h[i, k] = dot
        for m in range(n):
            new[m] -= dot * row[m]
    a = b = c = d = 0.0
    for m in range(0, even, 4):
        a += new[m] * new[m]
        b += new[m + 1] * new[m + 1]
        c += new[m + 2] * new[m + 2]
        d += new[m + 3] * new[m + 3]
    for m in range(even, n):
        a += new[m] * new[m]
    norm = math.sqrt((a + b) + (c + d))
    for i in range(k):
        upper = rotation[0, i] * h[i, k] + rotation[1, i] * h[i + 1, k]
        h[i + 1, k] = -rotation[1, i] * h[i, k] + rotation[0, i] * h[i + 1, k]
        h[i, k] = upper
    size = math.sqrt(h[k, k] * h[k, k] + norm * norm)
    cosine = h[k, k] / size if size > 0.0 else 1.0
    sine = norm / size if size > 0.0 else 0.0
    rotation[0, k] = cosine
    rotation[1, k] = sine
    h[k, k] = size
    g[k + 1] = -sine * g[k]
    g[k] = cosine * g[k]
    inverse = 1.0 / norm if norm > 0.0 else 0.0
    for m in range(n):
        new[m] *= inverse
    return abs(g[k + 1])


@jit
def gmres_update(
    h: np.ndarray, g: np.ndarray, z: np.ndarray, w: np.ndarray, k: int, x: np.ndarray, more: np.ndarray
) -> None:
    """Solution x [n]: the sum of y[i] z[i], i < k, with h y = g, h triangular; more: that of w[i] beyond n.

    z [>= k, n], w [>= k, n + size of more].
    """
    y = np.zeros(k)
    for i in range(k - 1, -1, -1):
        total = g[i]
        for j in range(i + 1, k):
            total -= h[i, j] * y[j]
        y[i] = total / h[i, i] if h[i, i] != 0.0 else 0.0
    x[:] = 0.0
    more[:] = 0.0
    for i in range(k):
        for m in range(x.size):
            x[m] += y[i] * z[i, m]
        for m in range(more.size):
            more[m] += y[i] * w[i, x.size + m]
