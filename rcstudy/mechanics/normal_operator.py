"""Gap by pressure on a box of cells as a convolution, and pressures by gaps: its inverse on a torus."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from rcstudy.mechanics.convolution import convolve, padded_shape, symbols
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.kernels import arrays
from rcstudy.mechanics.wrapped import positive_normal


@dataclass(frozen=True)
class NormalSolution:
    """Pressure `p` [nx, ny] (MPa) on a box of cells or the window, `approach` (mm), and how they were found.

    `residual`: norm of the preconditioned residual over that of p (an estimate of p's relative error); `converged`: it
    met its tolerance with no cell changing sides; `attainable`: about the least residual that rounding allows; `edge`:
    the contact touches the window's edge.
    """

    p: np.ndarray
    approach: float
    residual: float
    iterations: int
    products: int
    converged: bool
    attainable: float = 0.0
    edge: bool = False

    def after(self, earlier: NormalSolution | None) -> NormalSolution:
        """This one with the iterations and products of an `earlier` one, which it went on from, added to its own."""
        if earlier is None:
            return self
        iterations, products = self.iterations + earlier.iterations, self.products + earlier.products
        return replace(self, iterations=iterations, products=products)


@dataclass(frozen=True)
class NormalOperator:
    """u_z (mm) by pressure (MPa) on a box of cells. Belongs to one set of bodies, one mesh and one padded shape.

    `real` [py//2+1, px] (mm/MPa): the symbol, with 1/(px py) in it, real as the coefficients are even; `inverse`
    (MPa/mm): symbol of pressures by gaps, likewise, see `wrapped.py`; `stiffness` (MPa/mm): root mean square of the
    latter without that factor, by which noise in the gap makes noise in the pressure; `coefficients`
    [> px//2, > py//2] (mm/MPa): u_z at offsets i, j >= 0.
    """

    padded: tuple[int, int]
    real: np.ndarray
    inverse: np.ndarray
    stiffness: float
    coefficients: np.ndarray

    @staticmethod
    def of(influence: Influence, shape: tuple[int, int]) -> NormalOperator:
        """The operator for a box of `shape`, made once for these coefficients."""
        return NormalOperator.on_torus(influence, padded_shape(shape))

    @staticmethod
    def on_torus(influence: Influence, padded: tuple[int, int]) -> NormalOperator:
        """The operator on a torus of `padded` cells, made once for these coefficients."""
        return influence.once(("normal", padded), lambda: NormalOperator._made(influence, padded))

    @staticmethod
    def _made(influence: Influence, padded: tuple[int, int]) -> NormalOperator:
        coefficients = influence.around(padded)[0]
        real = np.ascontiguousarray(symbols([(coefficients, (1, 1))], padded)[0].real)
        inverse = 1.0 / (positive_normal(real, influence, padded) * (padded[0] * padded[1]) ** 2)
        stiffness = arrays.norm2(inverse) / math.sqrt(inverse.size) * padded[0] * padded[1]
        return NormalOperator(padded, real, inverse, stiffness, coefficients)

    def displacement(self, p: np.ndarray) -> np.ndarray:
        """u_z [nx, ny] (mm) by pressures `p` [nx, ny] (MPa)."""
        return convolve(self.real, self.padded, p)

    def closing(self, gap: np.ndarray) -> np.ndarray:
        """Pressures [nx, ny] (MPa) that make gaps `gap` [nx, ny] (mm) on a torus, zero on the rest of it."""
        return convolve(self.inverse, self.padded, gap)

    def attainable(self, gap: np.ndarray, g: np.ndarray, p: np.ndarray) -> float:
        """About the least relative residual that rounding allows, at pressure `p` (MPa).

        `gap`, `g`: gaps (mm) undeformed and deformed; all [nx, ny]. Rounding leaves noise in the gap, and the inverse
        makes pressures of it.
        """
        noise = np.finfo(float).eps * float(np.abs(gap).max() + np.abs(g).max())
        return noise * self.stiffness * math.sqrt(float(np.count_nonzero(p))) / arrays.norm2(p)
