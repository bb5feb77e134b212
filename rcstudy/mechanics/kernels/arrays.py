"""Padded arrays, symbols and norms (`convolution.py`)."""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def unfold(quadrant: np.ndarray, parity_x: int, parity_y: int, out: np.ndarray) -> None:
    """Coefficients of all offsets, in the order of a circular convolution, from those at offsets >= 0.

    quadrant [> px//2, > py//2]; out [px, py]: offset -i is at p - i. All of the torus is filled: offsets beyond a box
    of (p + 1)/2 cells have no effect on a linear convolution, and filling them keeps the symbol of a positive kernel
    positive.
    """
    px, py = out.shape
    for i in range(px):
        fold_x = i > px // 2
        a = px - i if fold_x else i
        for j in range(py):
            fold_y = j > py // 2
            b = py - j if fold_y else j
            c = quadrant[a, b]
            if fold_x:
                c *= parity_x
            if fold_y:
                c *= parity_y
            # the offset p/2 is its own mirror image: odd coefficients are zero there
            if (parity_x < 0 and 2 * a == px) or (parity_y < 0 and 2 * b == py):
                c = 0.0
            out[i, j] = c


@jit
def upwind_difference(quadrant: np.ndarray, parity_x: int, parity_y: int, dx: float, out: np.ndarray) -> None:
    """Coefficients of (u_i - u_(i+1))/dx at all offsets of the torus out [px, py], from those of u at offsets >= 0.

    quadrant [> px//2 + 1, > py//2]. Offsets as in `unfold`. Differences are taken before folding, so that only the seam
    of the torus, which no linear convolution on the box reaches, differs from those on a plane.
    """
    px, py = out.shape
    for i in range(px):
        a = i if i <= px // 2 else i - px
        low = abs(a)
        high = abs(a + 1)
        sign_low = parity_x if a < 0 else 1
        sign_high = parity_x if a + 1 < 0 else 1
        for j in range(py):
            fold_y = j > py // 2
            b = py - j if fold_y else j
            c = (sign_low * quadrant[low, b] - sign_high * quadrant[high, b]) / dx
            if fold_y:
                c *= parity_y
            if parity_y < 0 and 2 * b == py:
                c = 0.0
            out[i, j] = c


@jit
def bounds(mask: np.ndarray) -> tuple[int, int, int, int]:
    """Smallest i0, i1, j0, j1 with all true cells of mask [nx, ny] in i0 <= i < i1 and j0 <= j < j1.

    Without any, i1 = j1 = 0.
    """
    nx, ny = mask.shape
    i0, i1, j0, j1 = nx, 0, ny, 0
    for i in range(nx):
        first = ny
        for j in range(ny):
            if mask[i, j]:
                first = j
                break
        if first < ny:
            last = ny - 1
            while not mask[i, last]:
                last -= 1
            i0, i1 = min(i0, i), i + 1
            j0, j1 = min(j0, first), max(j1, last + 1)
    return i0, i1, j0, j1


@jit
def multiply_2x2(hat: np.ndarray, k: np.ndarray) -> None:
    """Multiply the pair hat [2, m, 2 n], in place, by the symmetric matrix k [3, m, 2 n] = (xx, xy, yy).

    There are m n waves. hat has real and imaginary parts side by side, and k each of its real numbers twice: loops over
    real numbers use the vector units, those over complex ones take three times as long.
    """
    for i in range(hat.shape[1]):
        for j in range(hat.shape[2]):
            a = hat[0, i, j]
            b = hat[1, i, j]
            hat[0, i, j] = k[0, i, j] * a + k[1, i, j] * b
            hat[1, i, j] = k[1, i, j] * a + k[2, i, j] * b


@jit
def packed_symbol(pair: np.ndarray, out: np.ndarray) -> None:
    """The symmetric matrix pair = (xx, xy, yy) as alpha, beta, gamma of `multiply_packed`, into out [3, ...]."""
    for i in range(pair.shape[1]):
        for j in range(pair.shape[2]):
            half = 0.5 * (pair[0, i, j] - pair[2, i, j])
            out[0, i, j] = 0.5 * (pair[0, i, j] + pair[2, i, j])
            out[1, i, j] = half + 1j * pair[1, i, j]
            out[2, i, j] = half - 1j * pair[1, i, j]


@jit
def inverse_symbol(pair: np.ndarray, shift: float, size: float, out: np.ndarray) -> None:
    """The inverse, into out [3, ...], of the symmetric matrix pair = (xx, xy, yy) plus shift, over size^2."""
    for i in range(pair.shape[1]):
        for j in range(pair.shape[2]):
            xx, xy, yy = pair[0, i, j] + shift, pair[1, i, j], pair[2, i, j] + shift
            factor = 1.0 / ((xx * yy - xy * xy) * size * size)
            out[0, i, j] = yy * factor
            out[1, i, j] = -xy * factor
            out[2, i, j] = xx * factor


@jit
def multiply_packed(hat: np.ndarray, k: np.ndarray) -> None:
    """Multiply a pair (a, b) of real arrays by a symmetric matrix, in place, in the transform hat [py, px] of a + i b.

    With z = hat[k] and c = hat[-k]*, the transforms of a and b are (z + c)/2 and (z - c)/2i. So, for the matrix xx, xy,
    yy, z becomes alpha z + beta c, and c becomes gamma z + alpha c (`packed_symbol`). k [3, py//2+1, px].
    """
    py, px = hat.shape
    for j in range(py // 2 + 1):
        opposite = py - j if j > 0 else 0
        # rows that are their own mirror images contain both waves, k and -k, of each pair
        waves = px // 2 + 1 if opposite == j else px
        for i in range(waves):
            mirrored = px - i if i > 0 else 0
            z = hat[j, i]
            c = hat[opposite, mirrored].conjugate()
            hat[opposite, mirrored] = (k[2, j, i] * z + k[0, j, i] * c).conjugate()
            hat[j, i] = k[0, j, i] * z + k[1, j, i] * c


@jit
def scale_packed(hat: np.ndarray, k: np.ndarray) -> None:
    """Multiply both real arrays of a pair (a, b) by the symbol k, in place, in the transform hat [py, px] of a + i b.

    k [py//2+1, px], the same for ky and -ky.
    """
    py, px = hat.shape
    for j in range(py):
        row = j if j < k.shape[0] else py - j
        for i in range(px):
            hat[j, i] *= k[row, i]


@jit
def multiply_phases(hat: np.ndarray, factor: np.ndarray) -> None:
    """Multiply hat [fields, k, >= rows], in place, by factor [k, rows]."""
    for i in range(factor.shape[0]):
        for f in range(hat.shape[0]):
            for j in range(factor.shape[1]):
                hat[f, i, j] *= factor[i, j]


@jit
def scale_real(hat: np.ndarray, symbol_real: np.ndarray) -> None:
    """Multiply the half-complex array hat [k, rows] by the real symbol symbol_real [k, rows], in place."""
    for i in range(hat.shape[0]):
        for j in range(hat.shape[1]):
            value, factor = hat[i, j], symbol_real[i, j]
            hat[i, j] = complex(value.real * factor, value.imag * factor)


@jit
def norm2(a: np.ndarray) -> float:
    """Euclidean norm of a 2-D array."""
    total = 0.0
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            total += a[i, j] * a[i, j]
    return math.sqrt(total)
