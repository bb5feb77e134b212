"""Zero-padded convolutions by pyFFTW on a box of cells: plans, buffers, symbols.

The symbol of an operator is the discrete Fourier transform of its coefficients. One thread and FFTW_ESTIMATE give the
same bits in every process. A plan owns its buffers; plans are cached by shape, so that no product allocates memory.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rcstudy.mechanics.kernels import arrays
from rcstudy.mechanics.numerics.fftw import pyfftw
from rcstudy.mechanics.numerics.keeping import keep_within

PLAN_BYTES = 256 * 2**20
"""Most bytes held by cached plans of each kind: enough for one solve on 512 x 512 cells, and for all smaller meshes."""

COMPONENTS = ("zz", "xx", "yy", "xy", "xp", "yp")
"""Components of an array of influence coefficients, in this order.

zz is u_z due to p; xx and yy are u_x due to q_x and u_y due to q_y; xy is u_x due to q_y (and u_y due to q_x); xp and
yp are u_x and u_y due to p. Signs as in tests/reference/ic.json.
"""

ZZ, XX, YY, XY, XP, YP = range(len(COMPONENTS))
# components with their parities in x and y
TRACTION_PARITY = ((XX, (1, 1)), (XY, (-1, -1)), (YY, (1, 1)))
PRESSURE_PARITY = ((XP, (-1, 1)), (YP, (1, -1)))


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

    def holds(self, other: Box) -> bool:
        """Whether all cells of `other` are in this box."""
        return self.i0 <= other.i0 and self.i1 >= other.i1 and self.j0 <= other.j0 and self.j1 >= other.j1

    @staticmethod
    def around(mask: np.ndarray) -> Box:
        """Smallest box of all true cells of `mask` [nx, ny]. ValueError if there is none."""
        box = Box(*arrays.bounds(mask))
        if box.i1 == 0:
            raise ValueError("no cell to put a box around")
        return box

    def wider(self, part: int, window: tuple[int, int]) -> Box:
        """This box grown on each side by 1/`part` of its cells plus two, cut to the window."""
        nx, ny = self.shape
        return self.grown(nx // part + 2, ny // part + 2, window)

    def grown(self, i: int, j: int, window: tuple[int, int]) -> Box:
        """This box with `i` and `j` more cells on each side, cut to the window."""
        return Box(max(0, self.i0 - i), min(window[0], self.i1 + i), max(0, self.j0 - j), min(window[1], self.j1 + j))


_OPTIONS: dict[str, Any] = {"flags": ("FFTW_ESTIMATE",), "threads": 1}
_SPENT: dict[str, Any] = {"flags": ("FFTW_ESTIMATE", "FFTW_DESTROY_INPUT"), "threads": 1}
_BACK: dict[str, Any] = {"direction": "FFTW_BACKWARD"}
# The first stage of a transform also transposes, so that both stages run along contiguous memory (this saves a tenth to
# a third of the time). Columns are lengthened by this many numbers: strides of a power of two would make numbers evict
# each other from the processor's caches, which takes up to five times as long.
_APART = 2


def _between_stages(fields: int, columns: int, length: int) -> np.ndarray:
    """Zeroed buffer [fields, columns, length + _APART] between the two stages of a transform."""
    return np.asarray(pyfftw.zeros_aligned((fields, columns, length + _APART), dtype="complex128"))


class _TwoStages:
    """Two-dimensional transforms of a `padded` shape, first along rows and then along columns, and back.

    The subclasses own the buffers and make the plans.
    """

    padded: tuple[int, int]
    _rows: Any
    _columns: Any
    _columns_back: Any
    _rows_back: Any
    _buffers: tuple[np.ndarray, ...]

    @property
    def nbytes(self) -> int:
        """Bytes of all buffers."""
        return sum(buffer.nbytes for buffer in self._buffers)

    def places(self, cells: np.ndarray) -> np.ndarray:
        """Flat indices [m], in an array of the padded shape, of `cells` [m, 2] (indices along x and y)."""
        places: np.ndarray = cells[:, 0] * self.padded[1] + cells[:, 1]
        return places

    def forward(self) -> None:
        """Transform the input to Fourier coefficients."""
        self._rows()
        self._columns()

    def backward(self) -> None:
        """Transform Fourier coefficients to the output."""
        self._columns_back()
        self._rows_back()


class Transform(_TwoStages):
    """Real FFTs of `fields` zero-padded arrays at once, and back, in two stages so that padding costs little.

    `real` [fields, rows, py] holds the first `rows` of px rows (of constant x). The others are zero (forward) or not
    needed (backward) and are not transformed along y. `flat` [fields, rows py]: the same memory. `hat`
    [fields, py//2+1, px]: the Fourier coefficients, waves along y first, which may be changed between the two
    transforms; `numbers` [fields, py//2+1, 2 px]: their real and imaginary parts. The transforms are unnormalised: the
    factor 1/(px py) is contained in the symbols.
    """

    def __init__(self, padded: tuple[int, int], fields: int, rows: int) -> None:
        px, py = self.padded = padded
        half = py // 2 + 1
        self.real = pyfftw.zeros_aligned((fields, rows, py), dtype="float64")
        self.flat = self.real.reshape(fields, rows * py)
        self.hat = pyfftw.zeros_aligned((fields, half, px), dtype="complex128")
        self.numbers = self.hat.view(np.float64)
        # what lies beyond `rows` in the columns of the first stage stays zero; the last stage may destroy its input
        self._first, self._last = (_between_stages(fields, half, px) for _ in range(2))
        self._buffers = self.real, self.hat, self._first, self._last
        turned, turned_back = (columns[:, :, :rows].transpose(0, 2, 1) for columns in (self._first, self._last))
        # the plans keep their arrays alive; only their bound `execute` is called
        self._rows = pyfftw.FFTW(self.real, turned, axes=(2,), **_OPTIONS).execute
        self._columns = pyfftw.FFTW(self._first[:, :, :px], self.hat, axes=(2,), **_OPTIONS).execute
        self._columns_back = pyfftw.FFTW(self.hat, self._last[:, :, :px], axes=(2,), **_BACK, **_OPTIONS).execute
        self._rows_back = pyfftw.FFTW(turned_back, self.real, axes=(2,), **_BACK, **_SPENT).execute

    @property
    def by_cell(self) -> np.ndarray:
        """`real` as an array [fields, i, j] by the cells' indices along x and y."""
        return self.real


@keep_within(PLAN_BYTES)
def transform(padded: tuple[int, int], fields: int, rows: int) -> Transform:
    """The plans for `fields` arrays with `rows` rows in use of a `padded` shape, made once per process."""
    return Transform(padded, fields, rows)


class PairTransform(_TwoStages):
    """FFTs of pairs (a, b) of real arrays on a torus, as one transform of complex numbers a + i b, and back.

    The forward transform takes `field` [px py, 2] (rows of constant x one after the other), which it leaves unchanged,
    to `hat` [py, px]. The backward one takes `hat`, which it destroys, to `result` [px py, 2]. This is faster than two
    real transforms, as FFTW's complex ones use the vector units. Unnormalised.
    """

    def __init__(self, torus: tuple[int, int]) -> None:
        px, py = self.padded = torus
        field, result = (pyfftw.zeros_aligned(torus, dtype="complex128") for _ in range(2))
        self.field, self.result = (a.view(np.float64).reshape(px * py, 2) for a in (field, result))
        self.hat = pyfftw.zeros_aligned((py, px), dtype="complex128")
        self._buffers = field, result, self.hat, *(_between_stages(1, py, px) for _ in range(2))
        between, last = (columns[0, :, :px] for columns in self._buffers[-2:])
        self._rows = pyfftw.FFTW(field, between.T, axes=(1,), **_OPTIONS).execute
        self._columns = pyfftw.FFTW(between, self.hat, axes=(1,), **_OPTIONS).execute
        self._columns_back = pyfftw.FFTW(self.hat, last, axes=(1,), **_BACK, **_SPENT).execute
        self._rows_back = pyfftw.FFTW(last.T, result, axes=(1,), **_BACK, **_SPENT).execute


@keep_within(PLAN_BYTES)
def pair_transform(torus: tuple[int, int]) -> PairTransform:
    """The plans for pairs on a `torus`, made once per process."""
    return PairTransform(torus)


class ShiftedTransform(Transform):
    """As `Transform`, but x first: each row of constant y can be moved along x by a fraction of a cell in between.

    `real` [fields, rows, px]: the first `rows` of py rows of constant y, the others being zero; `hat`
    [fields, px//2+1, py]. A row is moved by multiplying its Fourier coefficients along x by phase factors
    [px//2+1, rows] between the stages of the forward transform, and moved back by their conjugates.
    """

    def __init__(self, padded: tuple[int, int], fields: int, rows: int) -> None:
        super().__init__((padded[1], padded[0]), fields, rows)
        self.padded = padded
        self._there: np.ndarray | None = None
        self._back: np.ndarray | None = None

    @property
    def by_cell(self) -> np.ndarray:
        """`real` as an array [fields, i, j] by the cells' indices along x and y."""
        return self.real.transpose(0, 2, 1)

    def places(self, cells: np.ndarray) -> np.ndarray:
        """Flat indices [m] of `cells` [m, 2] (indices along x and y) in an array whose rows have constant y."""
        places: np.ndarray = cells[:, 1] * self.padded[0] + cells[:, 0]
        return places

    def forward(self) -> None:
        """From `real` to `hat`."""
        self._rows()
        if self._there is not None:
            arrays.multiply_phases(self._first, self._there)
        self._columns()

    def backward(self) -> None:
        """From `hat` to `real`."""
        self._columns_back()
        if self._back is not None:
            arrays.multiply_phases(self._last, self._back)
        self._rows_back()

    def shifted(self, phase: np.ndarray, symbol: np.ndarray | None = None) -> ShiftedTransform:
        """The same plans and buffers, for rows moved by `phase` (`row_phases`).

        `symbol` [px//2+1]: of a convolution along x, which the backward transform applies at no cost.
        """
        other = copy(self)
        other._there = phase
        other._back = phase.conj() if symbol is None else phase.conj() * symbol[:, None]
        return other


def row_phases(px: int, shift: np.ndarray) -> np.ndarray:
    """Phase factors [px//2+1, rows] that move rows of constant y, of px cells, by `shift` [rows] cells towards +x."""
    phase: np.ndarray = np.exp(-2j * np.pi / px * np.outer(np.arange(px // 2 + 1), shift))
    if px % 2 == 0:
        phase[-1] = 1.0  # the shortest wave of a real field has no phase and cannot be moved
    return phase


@keep_within(PLAN_BYTES)
def shifted_transform(padded: tuple[int, int], fields: int, rows: int) -> ShiftedTransform:
    """The plans for `fields` arrays with `rows` rows of constant y in use, made once per process."""
    return ShiftedTransform(padded, fields, rows)


@lru_cache(maxsize=1024)
def good_length(n: int) -> int:
    """Transform length for at least `n` points, chosen for speed among lengths up to n + max(4, n/4).

    The cost per point and log(length) was measured for all lengths up to 800; the table holds ratios. Factors of 2 are
    the cheapest, each 3, 5 or 7 costs a little more and each 11 or 13 a third more. For a length that is not a
    multiple of 4 the vector units lose half of their speed or more.
    """

    def cost(length: int) -> float:
        rest, slowdown = length, 1.0
        for factor, price in ((2, 1.0), (3, 1.12), (5, 1.12), (7, 1.16), (11, 1.34), (13, 1.3)):
            while rest % factor == 0:
                rest //= factor
                slowdown *= price
        if rest > 1:
            return float("inf")
        slowdown *= 1.0 if length % 4 == 0 else 1.35 if length % 2 == 0 else 2.5
        return slowdown * length * max(1.0, math.log2(length))

    return min(range(n, max(n + 4, (5 * n) // 4) + 1), key=cost)


def padded_shape(box: tuple[int, int]) -> tuple[int, int]:
    """Padded shape for a linear convolution on `box` cells: lengths of at least 2n - 1."""
    return good_length(2 * box[0] - 1), good_length(2 * box[1] - 1)


def padded_around(source: Box, box: Box) -> tuple[int, int]:
    """Padded shape for a linear convolution from the cells of `source`, a part of `box`, to all cells of `box`."""
    # largest distance, in cells, between a cell of `source` and a cell of `box`
    reach = (
        max(box.i1 - 1 - source.i0, source.i1 - 1 - box.i0),
        max(box.j1 - 1 - source.j0, source.j1 - 1 - box.j0),
    )
    return good_length(2 * reach[0] + 1), good_length(2 * reach[1] + 1)


def symbols(
    quadrants: Sequence[tuple[np.ndarray, tuple[int, int]]], padded: tuple[int, int], *, x_first: bool = False
) -> np.ndarray:
    """Symbols: discrete Fourier transforms, divided by px py, of coefficients given at offsets i, j >= 0.

    `quadrants`: k pairs of an array [> px//2, > py//2] and its parity (+1 even, -1 odd) in x and y, from which the
    coefficients at negative offsets follow. Returns a complex array [k, py//2+1, px], or [k, px//2+1, py] with
    `x_first` (for `ShiftedTransform`).
    """
    px, py = padded
    plan: Transform
    if x_first:
        plan = shifted_transform(padded, len(quadrants), py)
        quadrants = [
            (np.ascontiguousarray(quadrant[: px // 2 + 1, : py // 2 + 1].T), (parity[1], parity[0]))
            for quadrant, parity in quadrants
        ]
    else:
        plan = transform(padded, len(quadrants), px)
    for real, (quadrant, parity) in zip(plan.real, quadrants, strict=True):
        arrays.unfold(quadrant, *parity, real)
    return _normalised(plan)


def real_symbols(
    quadrants: Sequence[tuple[np.ndarray, tuple[int, int]]], padded: tuple[int, int], *, x_first: bool = False
) -> np.ndarray:
    """Symbols of coefficients that are even, or odd, in both directions: real numbers [k, ..., 2 waves], each twice.

    The arguments are those of `symbols`; `arrays.multiply_2x2` requires this layout.
    """
    return np.repeat(symbols(quadrants, padded, x_first=x_first).real, 2, axis=2)


def difference_symbols(
    quadrants: Sequence[tuple[np.ndarray, tuple[int, int]]], padded: tuple[int, int], dx: float
) -> np.ndarray:
    """Symbols of the upwind difference (u_i - u_(i+1))/dx of displacements u with coefficients `quadrants`.

    As `symbols`, but with arrays [> px//2 + 1, > py//2].
    """
    plan = transform(padded, len(quadrants), padded[0])
    for real, (quadrant, parity) in zip(plan.real, quadrants, strict=True):
        arrays.upwind_difference(quadrant, *parity, dx, real)
    return _normalised(plan)


def _normalised(plan: Transform) -> np.ndarray:
    """Transform of the plan's input divided by the number of points, so that products need no further factor."""
    plan.forward()
    hat: np.ndarray = plan.hat / math.prod(plan.padded)
    return hat


def upwind_factor(px: int, dx: float) -> np.ndarray:
    """Symbol [px//2+1] of the upwind difference (u_i - u_(i+1))/dx on a torus of px cells."""
    return (1.0 - np.exp(2j * np.pi / px * np.arange(px // 2 + 1))) / dx


def point_factor(px: int, waves: int) -> np.ndarray:
    """Factor 1 + (1 - cos k)/6 [waves] that compensates the damping of waves along x by the finite length of cells.

    k = 2 pi n/px, n = 0, ..., waves - 1, is the phase per cell. Tractions that are constant in each cell damp a wave by
    1 - k^2/24, and the difference of displacements over a cell does so again; in real space the factor spreads a field
    to the two neighbouring cells. An error of order k^3 remains, by the waves that look alike on the cells.
    """
    return sharpening(2.0 * np.pi / px * np.arange(waves))


def sharpening(k: np.ndarray) -> np.ndarray:
    """The factor 1 + (1 - cos k)/6 of `point_factor`, of the shape of the phases per cell `k`."""
    result: np.ndarray = 1.0 + (1.0 - np.cos(k)) / 6.0
    return result


def sharp_difference(px: int, dx: float) -> np.ndarray:
    """Symbol [px//2+1] of the upwind difference without damping: `upwind_factor` times `point_factor`."""
    result: np.ndarray = upwind_factor(px, dx) * point_factor(px, px // 2 + 1)
    return result


def convolve(hat: np.ndarray, padded: tuple[int, int], field: np.ndarray) -> np.ndarray:
    """Convolution [nx, ny] of `field` [nx, ny] with the operator of symbol `hat` [py//2+1, px], on the same cells."""
    nx, ny = field.shape
    plan = transform(padded, 1, nx)
    plan.real[0, :, :ny] = field
    plan.real[0, :, ny:] = 0.0
    plan.forward()
    plan.hat[0] *= hat
    plan.backward()
    return plan.real[0, :, :ny].copy()


def traction_quadrants(quadrant: np.ndarray) -> list[tuple[np.ndarray, tuple[int, int]]]:
    """The coefficients xx, xy, yy of `quadrant` [6, ...] (see `COMPONENTS`) with their parities."""
    return [(quadrant[component], parity) for component, parity in TRACTION_PARITY]


def pressure_quadrants(quadrant: np.ndarray) -> list[tuple[np.ndarray, tuple[int, int]]]:
    """The coefficients xp, yp (tangential displacements due to pressure) of `quadrant` with their parities."""
    return [(quadrant[component], parity) for component, parity in PRESSURE_PARITY]


class PairOperator:
    """Two displacements due to two tractions: a symmetric 2x2 matrix of convolutions on a box of cells.

    The sums over cells of the paper's Eq. 10. `symbols`: `real_symbols` of xx, xy = yx, yy, with x first if
    `plan` is a `ShiftedTransform`.
    """

    def __init__(self, symbols: np.ndarray, box: tuple[int, int], plan: Transform) -> None:
        self.symbols = symbols
        self.box = box
        self.plan = plan

    def on_box(self, q: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Displacements [2, nx, ny] on the box due to `q` [m, 2] at `cells` [m, 2]; valid until the plan's next use."""
        plan = self.plan
        plan.real[:] = 0.0
        field = plan.by_cell
        field[:, cells[:, 0], cells[:, 1]] = q.T
        plan.forward()
        arrays.multiply_2x2(plan.numbers, self.symbols)
        plan.backward()
        result: np.ndarray = field[:, : self.box[0], : self.box[1]]
        return result
