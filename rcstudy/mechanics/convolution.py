"""Zero-padded convolutions by pyFFTW on a box of cells: plans, buffers, symbols.

One thread and FFTW_ESTIMATE: the same bits in every process. A plan owns its buffers; plans are kept per shape, so that
no product allocates memory.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pyfftw

from rcstudy.mechanics.kernels import arrays


@dataclass(frozen=True)
class Box:
    """Cells i0 <= i < i1, j0 <= j < j1 of the window."""

    i0: int
    i1: int
    j0: int
    j1: int

    @property
    def shape(self) -> tuple[int, int]:
        """Number of cells along x and y."""
        return self.i1 - self.i0, self.j1 - self.j0

    @property
    def slices(self) -> tuple[slice, slice]:
        """Index of the box in an array of the window."""
        return slice(self.i0, self.i1), slice(self.j0, self.j1)

    @staticmethod
    def around(mask: np.ndarray) -> Box:
        """Smallest box of all true cells of `mask` [nx, ny], which must not be empty."""
        i = np.flatnonzero(mask.any(axis=1))
        j = np.flatnonzero(mask.any(axis=0))
        return Box(int(i[0]), int(i[-1]) + 1, int(j[0]), int(j[-1]) + 1)

    def grown(self, i: int, j: int, window: tuple[int, int]) -> Box:
        """This box with `i` and `j` more cells on each side, cut to the window."""
        return Box(max(0, self.i0 - i), min(window[0], self.i1 + i), max(0, self.j0 - j), min(window[1], self.j1 + j))


class Transform:
    """Real FFT of `fields` padded arrays at once, and back: `real` [fields, px, py], `hat` [fields, px, py//2+1]."""

    def __init__(self, shape: tuple[int, int], fields: int) -> None:
        px, py = shape
        self.shape = shape
        self.real = pyfftw.zeros_aligned((fields, px, py), dtype="float64")
        self.hat = pyfftw.zeros_aligned((fields, px, py // 2 + 1), dtype="complex128")
        options = {"axes": (1, 2), "flags": ("FFTW_ESTIMATE",), "threads": 1}
        self._forward = pyfftw.FFTW(self.real, self.hat, direction="FFTW_FORWARD", **options)
        # a multi-dimensional c2r destroys its input; `hat` is spent after it
        backward = {**options, "flags": ("FFTW_ESTIMATE", "FFTW_DESTROY_INPUT")}
        self._backward = pyfftw.FFTW(self.hat, self.real, direction="FFTW_BACKWARD", **backward)
        self.forward = self._forward.execute
        self.backward = self._backward.execute  # unnormalised: 1/(px py) sits in the symbols


@lru_cache(maxsize=32)
def transform(shape: tuple[int, int], fields: int) -> Transform:
    """The plan for `fields` arrays of padded `shape`, made once per process."""
    return Transform(shape, fields)


def padded_shape(box: tuple[int, int]) -> tuple[int, int]:
    """Smallest shape with small prime factors that holds a linear convolution on `box` cells: at least 2n - 1."""
    return pyfftw.next_fast_len(2 * box[0] - 1), pyfftw.next_fast_len(2 * box[1] - 1)


def symbol(quadrant: np.ndarray, padded: tuple[int, int], parity: tuple[int, int] = (1, 1)) -> np.ndarray:
    """Discrete Fourier transform, over px py, of coefficients given at offsets i, j >= 0.

    `quadrant` [> px//2, > py//2]; `parity` (+1 even, -1 odd) in x and y gives the negative offsets.
    Complex [px, py//2+1].
    """
    px, py = padded
    plan = transform(padded, 1)
    arrays.unfold(quadrant, parity[0], parity[1], plan.real[0])
    plan.forward()
    hat: np.ndarray = plan.hat[0] / (px * py)
    return hat


def difference_symbol(quadrant: np.ndarray, padded: tuple[int, int], parity: tuple[int, int], dx: float) -> np.ndarray:
    """Symbol, over px py, of the upwind difference (u_i - u_(i+1))/dx of the displacement u with coefficients
    `quadrant`.

    `quadrant` [> px//2 + 1, > py//2], else as in `symbol`.
    """
    px, py = padded
    plan = transform(padded, 1)
    arrays.upwind_difference(quadrant, parity[0], parity[1], dx, plan.real[0])
    plan.forward()
    hat: np.ndarray = plan.hat[0] / (px * py)
    return hat


def convolve(hat: np.ndarray, padded: tuple[int, int], field: np.ndarray) -> np.ndarray:
    """Product of the operator with symbol `hat` and `field` [nx, ny], on the same cells."""
    plan = transform(padded, 1)
    arrays.pad(field, plan.real[0])
    plan.forward()
    plan.hat[0] *= hat
    plan.backward()
    return plan.real[0, : field.shape[0], : field.shape[1]].copy()


class PairOperator:
    """Two displacements (or slips) by two tractions: a symmetric 2x2 array of convolutions on a box of cells.

    `symbols` [4, px, py//2+1]: xx, xy, yx, yy, with 1/(px py) in them.
    """

    def __init__(self, symbols: np.ndarray, padded: tuple[int, int], box: tuple[int, int]) -> None:
        self.symbols = symbols
        self.padded = padded
        self.box = box
        self.plan = transform(padded, 2)

    def on_box(self, q: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Result [2, nx, ny] on the box of `q` [m, 2] given at `cells` [m, 2]; valid until the plan's next use."""
        plan = self.plan
        plan.real[:] = 0.0
        plan.real[0][cells[:, 0], cells[:, 1]] = q[:, 0]
        plan.real[1][cells[:, 0], cells[:, 1]] = q[:, 1]
        plan.forward()
        arrays.multiply_2x2(plan.hat, self.symbols)
        plan.backward()
        result: np.ndarray = plan.real[:, : self.box[0], : self.box[1]]
        return result


def displacement_operator(
    quadrant: np.ndarray, box: tuple[int, int], padded: tuple[int, int] | None = None
) -> PairOperator:
    """u_x, u_y by q_x, q_y on `box` cells from the coefficients `quadrant` [6, ...] (see `influence.py`).

    A torus `padded` smaller than 2n - 1 gives a circular convolution: an approximation, fit for preconditioners only.
    """
    padded = padded or padded_shape(box)
    xx = symbol(quadrant[1], padded)
    yy = symbol(quadrant[2], padded)
    xy = symbol(quadrant[3], padded, (-1, -1))
    return PairOperator(np.stack([xx, xy, xy, yy]), padded, box)
