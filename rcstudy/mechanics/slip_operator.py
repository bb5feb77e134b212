"""Slip by tractions as a product by FFTs, and the inverse convolutions of the preconditioner (`rolling.py`)."""

from __future__ import annotations

from copy import copy

import numpy as np

from rcstudy.mechanics.convolution import (
    ShiftedTransform,
    Transform,
    difference_symbols,
    good_length,
    padded_shape,
    pair_transform,
    point_factor,
    real_symbols,
    shifted_transform,
    symbols,
    traction_quadrants,
    transform,
)
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.kernels import arrays, row_cells
from rcstudy.mechanics.wrapped import positive_tractions

SHIFT = 2.0
"""d of the preconditioner, over b (`rolling.py`); where all cells slip by more it is larger by powers of 4."""

_LONG = 32  # cells of rows for which preconditioners take turns; shorter ones gain little


class SlipOperator:
    """The operator B (slip by tractions, 1/MPa) on a box of cells, and the inverse convolution of its preconditioner.

    Belongs to one set of bodies, one mesh and one box; used by all creepages. Nothing in it changes once made, but that
    symbols of the preconditioner are made when they are first wanted.
    """

    @staticmethod
    def of(influence: Influence, shape: tuple[int, int], *, sharp: bool = False) -> SlipOperator:
        """The operator for a box of `shape`, made once for these coefficients; `sharp`: for rows that move."""
        return influence.once(("slip", shape, sharp), lambda: SlipOperator(influence, shape, sharp=sharp))

    def __init__(self, influence: Influence, shape: tuple[int, int], *, sharp: bool = False) -> None:
        self.spacing = spacing = influence.spacing
        # displacements are wanted one cell ahead, too; sharp: `point_factor` spreads them by another
        padded = padded_shape((shape[0] + (2 if sharp else 1), shape[1]))
        # the preconditioner makes do with a torus as large as the box: a quarter of the work, as good in practice
        torus = good_length(shape[0] + (3 if sharp else 1)), good_length(shape[1] + 1)
        # the torus is the larger one where the box is a single cell wide
        quadrant = influence.around((max(padded[0], torus[0]), max(padded[1], torus[1])), ahead=1)
        coefficients = traction_quadrants(quadrant)
        # diagonal of B: (A(0) - A(1))/dx
        self.diagonal = min(float(quadrant[c, 0, 0] - quadrant[c, 1, 0]) / spacing[0] for c in (1, 2))
        self.own_displacement = float(quadrant[1, 0, 0])  # u_x of a cell by unit q_x on it (mm/MPa)
        # displacements by tractions, in cells
        self.symbol = real_symbols(coefficients, padded, x_first=sharp) / spacing[0]
        self.plan: Transform
        sharpened: np.ndarray | float = 1.0
        if sharp:
            self.symbol *= point_factor(padded[0], padded[0] // 2 + 1)[:, None]
            sharpened = point_factor(torus[0], torus[0])
            self.plan, self.ahead = shifted_transform(padded, 2, shape[1]), 1
        else:
            self.plan, self.ahead = transform(padded, 2, shape[0] + 1), padded[1]
        difference = difference_symbols(coefficients, torus, spacing[0]) * sharpened
        self.torus_symbol = _packed(difference)
        displacements = positive_tractions(symbols(coefficients, torus), influence, torus) * sharpened
        self.torus_inverse = _packed(_inverse(displacements, 0.0, torus))
        self.torus_edge = from_leading_edge(self.torus_inverse, torus) if torus[0] >= _LONG else None
        self._torus, self._difference = torus, difference
        self._shifted: dict[int, np.ndarray] = {}
        # of moved rows: places of the leading cells and of those ahead, `cross` of `moved`, and room for tractions
        self._cross_slip_terms: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None = None
        self.torus_plan = pair_transform(torus)
        self.edge = np.zeros((torus[1], 2))

    def moved(self, phase: np.ndarray, leading: np.ndarray, cross: np.ndarray) -> SlipOperator:
        """A sharp operator for rows moved by `phase` (`row_phases`); the preconditioner does without.

        Tractions in the cells `leading` [n, 2] cause slip across them, besides, `cross` [n] (1/MPa) times as large.
        """
        if not isinstance(self.plan, ShiftedTransform):
            raise TypeError("rows can be moved in a sharp operator")
        other = copy(self)
        other.plan = self.plan.shifted(phase)
        places = other.plan.places(leading)
        other._cross_slip_terms = places, places + other.ahead, cross, np.zeros((2, len(places)))
        return other

    def torus_shifted(self, power: int) -> np.ndarray:
        """Symbol of the inverse of B + d, times 1 + d/b, with d = `SHIFT` 4^power b."""
        if power not in self._shifted:
            over = SHIFT * 4.0**power
            inverse = _inverse(self._difference, over * self.diagonal, self._torus)
            self._shifted[power] = _packed((1.0 + over) * inverse)
        return self._shifted[power]

    def multiply(self) -> None:
        """From tractions to displacements in cells, in place in `plan.real`.

        The slip in a cell is what its own is more than that of the cell ahead, `ahead` places on in `plan.flat`.
        """
        if self._cross_slip_terms is not None:
            leading, _, _, q = self._cross_slip_terms
            row_cells.tractions_at(self.plan.flat, leading, q)
        self.plan.forward()
        arrays.multiply_2x2(self.plan.numbers, self.symbol)
        self.plan.backward()
        if self._cross_slip_terms is not None:
            _, ahead, cross, q = self._cross_slip_terms
            row_cells.add_cross_slip(q, cross, ahead, self.plan.flat)


def _inverse(pair: np.ndarray, shift: float, padded: tuple[int, int]) -> np.ndarray:
    """Symbols xx, xy, yy of the inverse of a symmetric pair operator plus `shift` times the identity."""
    size = padded[0] * padded[1]
    out = np.empty_like(pair)
    arrays.inverse_symbol(pair, shift / size, float(size), out)
    return out


def from_leading_edge(inverse: np.ndarray, padded: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """What inverts a convolution A on rows that end at their leading edge: symbols before and after the cut there.

    From the packed symbol `inverse` [3, py//2+1, px] of its inverse, on the torus `padded`. With A = F G, F acting
    towards +x only and G towards -x only, the inverse on a half-plane is G^-1 P F^-1, P being the cut (Wiener and Hopf
    1931); here A^-1 F P F^-1. F is that of the mean of A's diagonal. Symbols [py//2+1, px] and [3, py//2+1, px].
    """
    px, size = padded[0], padded[0] * padded[1]
    half = (px + 1) // 2
    # log F is the half of log A that acts towards +x, log G its mirror image
    kernel = np.fft.ifft(-np.log(np.abs(inverse[0].real)), axis=1)
    kernel[:, 0] *= 0.5
    kernel[:, half : px - half + 1] *= 0.5  # the farthest cell of an even number is on both sides
    kernel[:, px - half + 1 :] = 0.0
    factor = np.exp(np.fft.fft(kernel, axis=1))
    return 1.0 / (factor * size), inverse * factor


def _packed(pair: np.ndarray) -> np.ndarray:
    """Symbols xx, xy, yy as a `PairTransform` wants them."""
    out = np.empty_like(pair)
    arrays.packed_symbol(pair, out)
    return out
