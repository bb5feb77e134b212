"""Slip by tractions as a product by FFTs, and the inverse convolutions of the preconditioner (`rolling.py`)."""

from __future__ import annotations

from copy import copy

import numpy as np

from rcstudy.mechanics.convolution import (
    XX,
    YY,
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
from rcstudy.mechanics.kernels import arrays
from rcstudy.mechanics.wrapped import positive_tractions

SHIFT = 2.0
"""d of the preconditioner over b (`rolling.py`), to be multiplied by powers of 4 where slip cells slip faster."""

_SQUARE = 1.5  # about a square cell's displacement by its own traction over that by rows alternating in sign
_LONG = 32  # length of the torus (cells) from which on rows use several preconditioners in turn; others gain little


class SlipOperator:
    """The operator B (slip by tractions, 1/MPa) on a box of cells, and the inverse convolutions of its preconditioner.

    Belongs to one set of bodies, one mesh and one box; used by all creepages. Immutable, except that some symbols of
    the preconditioner are computed at their first use.

    `diagonal`: b of B (1/MPa). `held`: b dx over the displacement by unit traction (mm/MPa) that the preconditioner
    takes slip cells to have where they hardly slip: (1.5 R)^2/A, A being the displacement of a cell by its own traction
    and R that by rows of cells alternating in sign, which is about 0.6 A in square cells on a half-space.
    """

    @staticmethod
    def of(
        influence: Influence, shape: tuple[int, int], *, sharp: bool = False, foundation: float = 0.0
    ) -> SlipOperator:
        """The operator for a box of `shape`, made once for these coefficients; `sharp`: for moved rows (`moved`).

        `foundation`: displacement of cells by their own traction that is added, over the one they have (`yielding.py`).
        """
        return influence.once(
            ("slip", shape, sharp, foundation),
            lambda: SlipOperator(influence, shape, sharp=sharp, foundation=foundation),
        )

    def __init__(
        self, influence: Influence, shape: tuple[int, int], *, sharp: bool = False, foundation: float = 0.0
    ) -> None:
        self.spacing = spacing = influence.spacing
        # displacements are needed one cell ahead as well; sharp: `point_factor` spreads them by one more
        padded = padded_shape((shape[0] + (2 if sharp else 1), shape[1]))
        # for the preconditioner a torus as large as the box is as good in practice, at a quarter of the work
        torus = good_length(shape[0] + (3 if sharp else 1)), good_length(shape[1] + 1)
        # the torus can be larger than the padded shape where the box is a single cell wide
        quadrant = influence.around((max(padded[0], torus[0]), max(padded[1], torus[1])), ahead=1)
        if foundation > 0.0:
            quadrant = quadrant.copy()
            quadrant[[XX, YY], 0, 0] += foundation * quadrant[XX, 0, 0]
        coefficients = traction_quadrants(quadrant)
        # of own row: (A(0) - A(1))/dx, with A sharpened along x by (-1, 14, -1)/12 as by `point_factor`
        difference_of_row = (5.0 / 4.0, -4.0 / 3.0, 1.0 / 12.0) if sharp else (1.0, -1.0, 0.0)
        self.diagonal = min(float(quadrant[c, :3, 0] @ difference_of_row) / spacing[0] for c in (XX, YY))
        # displacements by tractions, in units of dx
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
        # in cells far longer than wide, tractions that alternate from row to row displace far less than a cell's own
        own, alternating = float(quadrant[XX, 0, 0]), torus[0] * torus[1] * _alternating(displacements)
        self.held = self.diagonal * spacing[0] * own / (_SQUARE * alternating) ** 2
        self.torus_inverse = _packed(_inverse(displacements, 0.0, torus))
        self.torus_edge = from_leading_edge(self.torus_inverse, torus) if torus[0] >= _LONG else None
        self._torus, self._difference = torus, difference
        self._shifted: dict[int, np.ndarray] = {}
        self.cross: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None  # see `moved`
        self.torus_plan = pair_transform(torus)
        self.edge = np.zeros((torus[1], 2))

    def moved(self, phase: np.ndarray, cells: np.ndarray, leading: np.ndarray, cross: np.ndarray) -> SlipOperator:
        """A sharp operator for rows moved by `phase` (`row_phases`); the preconditioner is that for rows not moved.

        `leading` [n]: numbers of those of the `cells` [m, 2] whose tractions cause additional slip: along x `cross` [n]
        (1/MPa) times q_y, along y `cross` times q_x. This is not part of `multiply`; the result's `cross` has what
        `tractions.add_cross_slip` needs for it: `leading`, `cross` and the places ahead. Raises TypeError if this
        operator is not sharp.
        """
        if not isinstance(self.plan, ShiftedTransform):
            raise TypeError("rows can be moved in a sharp operator")
        other = copy(self)
        other.plan = self.plan.shifted(phase)
        other.cross = leading, cross, other.plan.places(cells[leading]) + other.ahead
        return other

    def torus_shifted(self, power: int) -> np.ndarray:
        """Packed symbol [3, py//2+1, px] of (1 + d/b) (B + d)^-1 on the torus, with d = `SHIFT` 4^power b; kept."""
        if power not in self._shifted:
            over = SHIFT * 4.0**power
            inverse = _inverse(self._difference, over * self.diagonal, self._torus)
            self._shifted[power] = _packed((1.0 + over) * inverse)
        return self._shifted[power]

    def multiply(self) -> None:
        """From tractions (MPa) to displacements in units of dx, in place in `plan.real`.

        The slip in a cell is its displacement minus that of the cell ahead, which is `ahead` places on in `plan.flat`;
        with `cross`, that of leading cells is not complete (`moved`).
        """
        self.plan.forward()
        arrays.multiply_2x2(self.plan.numbers, self.symbol)
        self.plan.backward()


def _alternating(pair: np.ndarray) -> float:
    """Symbol of displacements by tractions alternating in sign from row to row: the harmonic mean of xx and yy."""
    return 2.0 / float((1.0 / pair[::2, -1, 0].real).sum())


def _inverse(pair: np.ndarray, shift: float, padded: tuple[int, int]) -> np.ndarray:
    """Symbols xx, xy, yy of the inverse of a symmetric pair operator plus `shift` times the identity."""
    size = padded[0] * padded[1]
    out = np.empty_like(pair)
    arrays.inverse_symbol(pair, shift / size, float(size), out)
    return out


def from_leading_edge(inverse: np.ndarray, padded: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Symbols of F^-1 and A^-1 F, which invert a convolution A on rows that end at a leading edge: A^-1 F P F^-1.

    `inverse` [3, py//2+1, px]: packed symbol of A^-1 on the torus `padded`. With A = F G, where F acts towards +x only
    and G towards -x only, the inverse on a half-plane is G^-1 P F^-1 (Wiener and Hopf 1931). P sets to zero what lies
    ahead of the edge, and G^-1 = A^-1 F. F is scalar, from the mean of the two diagonal symbols of A^-1. Returns arrays
    [py//2+1, px] and [3, py//2+1, px].
    """
    px, size = padded[0], padded[0] * padded[1]
    half = (px + 1) // 2
    # log F is the part of log A that acts towards +x, log G its mirror image
    kernel = np.fft.ifft(-np.log(np.abs(inverse[0].real)), axis=1)
    kernel[:, 0] *= 0.5
    kernel[:, half : px - half + 1] *= 0.5  # with an even number of cells the farthest one is on both sides
    kernel[:, px - half + 1 :] = 0.0
    factor = np.exp(np.fft.fft(kernel, axis=1))
    return 1.0 / (factor * size), inverse * factor


def _packed(pair: np.ndarray) -> np.ndarray:
    """Symbols xx, xy, yy in the packed form for a `PairTransform` (`arrays.packed_symbol`)."""
    out = np.empty_like(pair)
    arrays.packed_symbol(pair, out)
    return out
