"""Bound-constrained conjugate gradients for the pressure (`normal.py`), and the elimination of a rim (`rim.py`).

The former as by Polonsky and Keer 1999, with the preconditioner of Vollebregt 2014. Pressures p and directions d, z
are in MPa, gaps g, their residuals r and the approach in mm, influence coefficients in mm/MPa.
"""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def normal_residual(
    p: np.ndarray,
    g: np.ndarray,
    approach: float,
    mask: np.ndarray,
    r: np.ndarray,
    r_old: np.ndarray,
    out: np.ndarray,
) -> tuple[float, int]:
    """Set the active cells, approach, and residual r = approach - g on them, which has zero mean.

    A cell is active if p > 0 or if, at p = 0, the surfaces overlap there (g < approach). p, g, mask, r, r_old [nx, ny];
    r_old: filled with the last r; out: padded copy of r. Returns the new approach (mean of g over the active cells) and
    the number of cells that became active.
    """
    nx, ny = p.shape
    total = 0.0
    count = 0
    entered = 0
    for i in range(nx):
        for j in range(ny):
            active = p[i, j] > 0.0 or g[i, j] < approach
            if active:
                # without the common part: its rounding error would be in all residuals, where no direction removes it
                total += g[i, j] - approach
                count += 1
                if p[i, j] <= 0.0:
                    entered += 1
            mask[i, j] = active
    mean = approach + total / max(count, 1)
    for i in range(nx):
        for j in range(ny):
            r_old[i, j] = r[i, j]
            r[i, j] = mean - g[i, j] if mask[i, j] else 0.0
            out[i, j] = r[i, j]
        for j in range(ny, out.shape[1]):
            out[i, j] = 0.0
    return mean, entered


@jit
def normal_direction(
    z: np.ndarray,
    mask: np.ndarray,
    r: np.ndarray,
    r_old: np.ndarray,
    d: np.ndarray,
    zr_old: float,
) -> tuple[float, float]:
    """New search direction d = z + beta d (Polak-Ribiere, beta >= 0), z made zero-mean on the active cells.

    z [>= nx, >= ny]: preconditioned residual (MPa) in the corner of a padded array, which becomes the padded copy of d;
    mask, r, r_old (mm) [nx, ny]: as of `normal_residual`; d [nx, ny]: the last direction (MPa), replaced; zr_old: the
    last z.r, a restart if it is not positive. Returns z.r and the norm of z.
    """
    nx, ny = r.shape
    total = 0.0
    count = 0
    for i in range(nx):
        for j in range(ny):
            if mask[i, j]:
                total += z[i, j]
                count += 1
    mean = total / max(count, 1)
    zr = zr_change = zz = 0.0
    for i in range(nx):
        for j in range(ny):
            if mask[i, j]:
                v = z[i, j] - mean
                zz += v * v
                zr += v * r[i, j]
                zr_change += v * (r[i, j] - r_old[i, j])
    beta = max(zr_change / zr_old, 0.0) if zr_old > 0.0 else 0.0
    # the mean of beta d over the active set is not zero once the set has changed; the load is restored by scaling
    for i in range(nx):
        for j in range(ny):
            d[i, j] = z[i, j] - mean + beta * d[i, j] if mask[i, j] else 0.0
        for j in range(ny):
            z[i, j] = d[i, j]
        for j in range(ny, z.shape[1]):
            z[i, j] = 0.0
    return zr, math.sqrt(zz)


@jit
def normal_step(
    p: np.ndarray, g: np.ndarray, d: np.ndarray, ad: np.ndarray, r: np.ndarray, total: float
) -> tuple[int, float]:
    """Step along d: negative pressures are set to zero, then all are scaled to the sum `total`.

    p (MPa), g (mm) [nx, ny]: pressures and gaps, in place; d (MPa), r (mm) [nx, ny]: direction and residual; ad
    [>= nx, >= ny] (mm): operator times d in the corner of a padded array; total (MPa). g follows by linearity, before
    the scaling, and holds only if no pressure was cut. Returns the number of cells cut and the scale applied.
    """
    nx, ny = p.shape
    rd = dad = 0.0
    for i in range(nx):
        for j in range(ny):
            rd += r[i, j] * d[i, j]
            dad += d[i, j] * ad[i, j]
    step = rd / dad if dad > 0.0 else 0.0
    cut = 0
    new_total = 0.0
    for i in range(nx):
        for j in range(ny):
            v = p[i, j] + step * d[i, j]
            if v <= 0.0:
                if d[i, j] != 0.0:
                    cut += 1
                v = 0.0
            p[i, j] = v
            g[i, j] += step * ad[i, j]
            new_total += v
    scale = total / new_total
    for i in range(nx):
        for j in range(ny):
            p[i, j] *= scale
    return cut, scale


@jit
def displacement_matrix(coefficients: np.ndarray, cells: np.ndarray, out: np.ndarray) -> None:
    """u_z on each of `cells` [n, 2] by unit pressure on each: the upper triangle of the symmetric out [n, n].

    coefficients: at offsets i, j >= 0, even in both.
    """
    for a in range(cells.shape[0]):
        for b in range(a, cells.shape[0]):
            out[a, b] = coefficients[abs(cells[a, 0] - cells[b, 0]), abs(cells[a, 1] - cells[b, 1])]


@jit
def add_displacement(
    coefficients: np.ndarray, p: np.ndarray, loaded: np.ndarray, cells: np.ndarray, out: np.ndarray
) -> None:
    """Add to out [n] the u_z on `cells` [n, 2] by pressures p [nx, ny] of the cells `loaded` [m, 2].

    coefficients: at offsets i, j >= 0, even in both.
    """
    for a in range(cells.shape[0]):
        total = 0.0
        for b in range(loaded.shape[0]):
            i, j = loaded[b, 0], loaded[b, 1]
            total += coefficients[abs(cells[a, 0] - i), abs(cells[a, 1] - j)] * p[i, j]
        out[a] += total


@jit
def factorise(matrix: np.ndarray) -> bool:
    """Cholesky factor U, matrix = U^T U, in place of the upper triangle of matrix [n, n]; returns whether there is one.

    As fast as LAPACK's, whose last bits depend on the number of threads.
    """
    for a in range(matrix.shape[0]):
        row = matrix[a, a:]
        # four rows at a time: most of the time is spent on reading and writing this one
        for b in range(0, a - 3, 4):
            r0, r1, r2, r3 = matrix[b, a:], matrix[b + 1, a:], matrix[b + 2, a:], matrix[b + 3, a:]
            f0, f1, f2, f3 = r0[0], r1[0], r2[0], r3[0]
            for k in range(row.size):
                row[k] -= f0 * r0[k] + f1 * r1[k] + f2 * r2[k] + f3 * r3[k]
        for b in range(a - a % 4, a):
            above = matrix[b, a:]
            factor = above[0]
            for k in range(row.size):
                row[k] -= factor * above[k]
        if not row[0] > 0.0:
            return False
        row /= math.sqrt(row[0])
    return True


@jit
def solve_factorised(factor: np.ndarray, x: np.ndarray) -> None:
    """Solve U^T U y = x, U [n, n] upper triangular; y takes the place of x [n]."""
    n = x.size
    for a in range(n):
        value = x[a] / factor[a, a]
        x[a] = value
        for b in range(a + 1, n):
            x[b] -= factor[a, b] * value
    for a in range(n - 1, -1, -1):
        total = x[a]
        for b in range(a + 1, n):
            total -= factor[a, b] * x[b]
        x[a] = total / factor[a, a]
