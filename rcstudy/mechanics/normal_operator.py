"""Displacement u_z by pressure as a convolution on a box of cells, and its inverse on a torus: pressures by gaps."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from rcstudy.mechanics.convolution import ZZ, convolve, padded_shape, symbols
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.kernels import arrays
from rcstudy.mechanics.wrapped import positive_normal


@dataclass(frozen=True)
class NormalSolution:
    """Pressure `p` [nx, ny] (MPa) on a box of cells or the window, `approach` (mm), and data of the solver.

    `residual`: norm of the preconditioned residual over that of p (an estimate of p's relative error); `converged`: it
    met its tolerance with the set of cells in contact settled; `attainable`: about the least residual that rounding
    allows; `edge`: the contact touches the window's edge.
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
        """This solution with the iterations and products of the `earlier` one that it started from added to its own."""
        if earlier is None:
            return self
        iterations, products = self.iterations + earlier.iterations, self.products + earlier.products
        return replace(self, iterations=iterations, products=products)


@dataclass(frozen=True)
class NormalOperator:
    """u_z (mm) by pressure (MPa) on a box of cells. Belongs to one set of bodies, one mesh and one padded shape.

    `real` [py//2+1, px] (mm/MPa): the symbol over px py, real as the coefficients are even; `inverse` (MPa/mm): symbol
    of pressures by gaps over px py, see `wrapped.py`; `stiffness` (MPa/mm): root mean square of the latter times px py,
    the factor from noise in the gap to noise in the pressure; `coefficients` [> px//2, > py//2] (mm/MPa): u_z at
    offsets i, j >= 0.
    """

    padded: tuple[int, int]
    real: np.ndarray
    inverse: np.ndarray
    stiffness: float
    coefficients: np.ndarray

    @staticmethod
    def of(influence: Influence, shape: tuple[int, int]) -> NormalOperator:
        """The operator for a box of `shape` cells, made once for these coefficients."""
        return NormalOperator.on_torus(influence, padded_shape(shape))

    @staticmethod
    def on_torus(influence: Influence, padded: tuple[int, int]) -> NormalOperator:
        """The operator on a torus of `padded` cells, made once for these coefficients."""
        return influence.once(("normal", padded), lambda: NormalOperator._made(influence, padded))

    @staticmethod
    def _made(influence: Influence, padded: tuple[int, int]) -> NormalOperator:
        coefficients = influence.around(padded)[ZZ]
        real = np.ascontiguousarray(symbols([(coefficients, (1, 1))], padded)[0].real)
        inverse = 1.0 / (positive_normal(real, influence, padded) * (padded[0] * padded[1]) ** 2)
        stiffness = arrays.norm2(inverse) / math.sqrt(inverse.size) * padded[0] * padded[1]
        return NormalOperator(padded, real, inverse, stiffness, coefficients)

    def displacement(self, p: np.ndarray) -> np.ndarray:
        """u_z [nx, ny] (mm) by pressures `p` [nx, ny] (MPa): the paper's Eq. 3."""
        return convolve(self.real, self.padded, p)

    def closing(self, gap: np.ndarray) -> np.ndarray:
        """Pressures [nx, ny] (MPa): those on the torus that cause u_z = `gap` [nx, ny] (mm) here, zero elsewhere."""
        return convolve(self.inverse, self.padded, gap)

    def overlap(self, tolerance: float, approach: float, p: np.ndarray) -> float:
        """Overlap (mm) outside the contact that a relative `tolerance` permits at `approach` (mm), pressures `p` (MPa).

        `p` [nx, ny]. A part of the approach, or of what pressures close within a few cells: the approach of plates is
        much larger.
        """
        return tolerance * min(abs(approach), float(arrays.norm2(p)) / self.stiffness)

    def attainable(self, gap: np.ndarray, g: np.ndarray, p: np.ndarray) -> float:
        """About the least relative residual that rounding allows, at pressure `p` (MPa).

        `gap`, `g`: gaps (mm) undeformed and deformed; all [nx, ny]. Rounding leaves noise in the gap, which the
        inverse operator turns into noise in the pressure.
        """
        noise = np.finfo(float).eps * float(np.abs(gap).max() + np.abs(g).max())
        return noise * self.stiffness * math.sqrt(float(np.count_nonzero(p))) / arrays.norm2(p)
