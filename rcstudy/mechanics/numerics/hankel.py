r"""Fast Hankel transforms on logarithmic grids (Hamilton 2000), and integrals of functions tabulated on such grids.

In the logarithms of k and r the transform F(r) = int f(k) J(k r) dk, J of order n, is a convolution. The Fourier
transform of its kernel is a quotient of gamma functions:

    U(z) = 2^z Gamma((n + 1 + z)/2) / Gamma((n + 1 - z)/2),   z = q + i t,

with a bias q for which f k^-q vanishes at both ends of the grid. U depends on the grid only, so that it is evaluated
once for all functions on grids of the same size and step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

# B_2k / (2k (2k - 1)), k = 1..7, of Stirling's series
_STIRLING = (1 / 12, -1 / 360, 1 / 1260, -1 / 1680, 1 / 1188, -691 / 360360, 1 / 156)
_SHIFT = 10  # Re z from which these seven terms are accurate to rounding


# not scipy.special.loggamma: importing it takes 0.16 to 0.29 s at each start, and circular contacts need nothing else
# of scipy.special
def log_gamma(z: np.ndarray) -> np.ndarray:
    """A logarithm of the gamma function of complex `z`, Re z > 0, to 1e-13 (|z| < 50), up to multiples of 2 pi i.

    Arrays of any shape.
    """
    far = z + _SHIFT
    series = sum(b * far ** (1 - 2 * k) for k, b in enumerate(_STIRLING, 1))
    steps = sum(np.log(z + k) for k in range(_SHIFT))
    result: np.ndarray = (far - 0.5) * np.log(far) - far + 0.5 * math.log(2.0 * math.pi) + series - steps
    return result


@lru_cache(maxsize=16)
def _kernels(n: int, step: float, orders: tuple[int, ...], bias: float) -> np.ndarray:
    """U at the frequencies of a grid of `n` nodes (even): [orders, n//2+1], real at the last one."""
    z = bias + 1j * np.linspace(0.0, math.pi / step, n // 2 + 1)
    middle = 0.5 * (np.array(orders)[:, None] + 1)
    u: np.ndarray = 2.0**z * np.exp(log_gamma(middle + 0.5 * z) - log_gamma(middle - 0.5 * z))
    u[:, -1] = u[:, -1].real
    u.setflags(write=False)
    return u


def hankel_transforms(
    functions: np.ndarray, log_k: np.ndarray, step: float, orders: Sequence[int], bias: float, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Hankel transforms int f(k) J(k r) dk of several functions f, at the `count` smallest radii.

    `functions` [m, n] on the grid `log_k` [n] of equal `step`, n even; `orders` [m] of the Bessel functions J.
    f k^-bias must vanish at both ends of the grid. Returns the smallest log r [count] of the mirrored grid,
    log r = -log k, and the transforms [m, count] there.
    """
    n = log_k.size
    middle = 0.5 * (log_k[0] + log_k[-1])
    spectrum = np.fft.rfft(functions * np.exp(-bias * (log_k - middle)))
    spectrum *= _kernels(n, step, tuple(orders), bias)
    mirrored = slice(-1, -count - 1, -1)
    log_r = -log_k[mirrored]
    transforms = np.fft.irfft(spectrum, n)[:, mirrored]
    # removes the bias; the convolution gives r F(r)
    return log_r, transforms * np.exp(-bias * (log_r + middle) - log_r)


@lru_cache(maxsize=1)
def _interval_weights() -> np.ndarray:
    """Integrals over [i, i + 1], i = 0..6, of the Lagrange polynomials of nodes 0..7: [7, 8]."""
    nodes = np.arange(8.0)
    points, weights = np.polynomial.legendre.leggauss(4)  # exact to degree 7
    x = nodes[:7, None] + 0.5 * (1.0 + points)
    lagrange = [np.prod([(x - m) / (k - m) for m in nodes if m != k], axis=0) for k in nodes]
    result = np.stack([values @ (0.5 * weights) for values in lagrange], axis=1)
    result.setflags(write=False)
    return result


def running_integral(values: np.ndarray, step: float) -> np.ndarray:
    """Integrals [n, m] of `values` [n, m] from the first node to each of n >= 8, by polynomials of degree 7."""
    weights = _interval_weights()
    inner = len(values) - 7
    pieces = np.zeros(values.shape)  # integral over the interval that ends at each node
    # by the polynomial through the 8 nodes around the interval; near the ends through the first or last 8
    pieces[1:4], pieces[-3:] = weights[:3] @ values[:8], weights[4:] @ values[-8:]
    pieces[4:-3] = sum(weight * values[k : k + inner] for k, weight in enumerate(weights[3]))
    result: np.ndarray = np.cumsum(step * pieces, axis=0)
    return result
