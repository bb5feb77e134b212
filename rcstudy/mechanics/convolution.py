"""Zero-padded convolutions by pyFFTW on a box of cells: plans, buffers, symbols.

One thread and FFTW_ESTIMATE: the same bits in every process. A plan owns its buffers; plans are kept per shape, so that
no product allocates memory.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rcstudy.mechanics.fftw import pyfftw
from rcstudy.mechanics.keeping import keep_within
from rcstudy.mechanics.kernels import arrays

PLAN_BYTES = 256 * 2**20
"""Held by plans of each kind that are kept: those of one solve on 512 x 512 cells, all of smaller meshes."""

ONE_AT_A_TIME = threading.RLock()
"""Held by whoever solves something: a process has one set of buffers for transforms, and one for linear systems."""


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
        """Smallest box of all true cells of `mask` [nx, ny], which must not be empty."""
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
# The first stage of a transform turns rows into columns, so that both go along what lies side by side in memory (a
# tenth to a third of the time). Columns are longer than they need to be by so many numbers: numbers a power of two
# apart would push each other out of the processor's caches, which takes up to five times as long.
_APART = 2


def _between_stages(fields: int, columns: int, length: int) -> np.ndarray:
    """Zeros [fields, columns, length + _APART] between the stages of transforms."""
    return np.asarray(pyfftw.zeros_aligned((fields, columns, length + _APART), dtype="complex128"))


class _TwoStages:
    """Transforms of a `padded` shape along rows and then along columns, and back.

    Plans are made by those who own the buffers.
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
        """Places [m] of `cells` [m, 2], indices along x and y, in arrays whose rows lie one after the other."""
        places: np.ndarray = cells[:, 0] * self.padded[1] + cells[:, 1]
        return places

    def forward(self) -> None:
        """From what goes in to the coefficients."""
        self._rows()
        self._columns()

    def backward(self) -> None:
        """From the coefficients to what comes out."""
        self._columns_back()
        self._rows_back()


class Transform(_TwoStages):
    """Real FFTs of `fields` zero-padded arrays at once, and back, stage by stage so that padding costs little.

    `real` [fields, rows, py] holds the first `rows` of px rows; the others are zero (forward) or not wanted
    (backward), and are not transformed along y; `flat` [fields, rows py]: the same numbers. `hat`
    [fields, py//2+1, px]: the coefficients, waves along y first, free to be changed between the two; `numbers`
    [fields, py//2+1, 2 px]: their real and imaginary parts. Unnormalised: 1/(px py) sits in the symbols.
    """

    def __init__(self, padded: tuple[int, int], fields: int, rows: int) -> None:
        px, py = self.padded = padded
        half = py // 2 + 1
        self.real = pyfftw.zeros_aligned((fields, rows, py), dtype="float64")
        self.flat = self.real.reshape(fields, rows * py)
        self.hat = pyfftw.zeros_aligned((fields, half, px), dtype="complex128")
        self.numbers = self.hat.view(np.float64)
        # columns beyond `rows` of the first stage stay zero for good; the last stage may destroy what it reads
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
    """FFTs of pairs (a, b) of real arrays on a torus, as one of complex numbers a + i b, and back.

    `field` [px py, 2], rows of constant x one after the other, is transformed, and left as it is, into `hat` [py, px];
    `result` [px py, 2] comes back from it, and `hat` is spent. Faster than two real transforms: FFTW's complex ones
    make use of the vector units. Unnormalised.
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
    """As `Transform`, x first: between the stages each row of constant y can be moved along x by a part of a cell.

    `real` [fields, rows, px]: the first `rows` of py rows of constant y, the others are zero; `hat`
    [fields, px//2+1, py]. A row moves by the phase of its Fourier coefficients, and back by the conjugate: factors
    [px//2+1, rows] on the way there and back.
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
        """As for other transforms, rows being those of constant y."""
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
        """The same plans and buffers for rows moved by `phase` (`row_phases`).

        `symbol` [px//2+1]: of a convolution along x that is made on the way back, at no cost.
        """
        other = copy(self)
        other._there = phase
        other._back = phase.conj() if symbol is None else phase.conj() * symbol[:, None]
        return other


def row_phases(px: int, shift: np.ndarray) -> np.ndarray:
    """What moves rows of constant y, of px cells, by `shift` [rows] cells towards +x: factors [px//2+1, rows]."""
    phase: np.ndarray = np.exp(-2j * np.pi / px * np.outer(np.arange(px // 2 + 1), shift))
    if px % 2 == 0:
        phase[-1] = 1.0  # the shortest wave has no phase that a real field could show
    return phase


@keep_within(PLAN_BYTES)
def shifted_transform(padded: tuple[int, int], fields: int, rows: int) -> ShiftedTransform:
    """The plans for `fields` arrays with `rows` rows of constant y in use, made once per process."""
    return ShiftedTransform(padded, fields, rows)


@lru_cache(maxsize=1024)
def good_length(n: int) -> int:
    """A transform length of at least `n` and at most a quarter more, or four, chosen for speed.

    Cost per point and log(length): 2 is the best factor, 3, 5 and 7 cost a little more each, 11 and 13 a third, and a
    length that is not a multiple of 4 costs the vector units half their speed or more (measured over all lengths to
    800; the figures of the table are ratios).
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
    """A shape that holds a linear convolution on `box` cells: lengths of at least 2n - 1."""
    return good_length(2 * box[0] - 1), good_length(2 * box[1] - 1)


def padded_around(source: Box, box: Box) -> tuple[int, int]:
    """The same for a convolution that takes the cells of `source`, a part of `box`, to all of that."""
    # the farthest that a cell of the one is from a cell of the other
    reach = (
        max(box.i1 - 1 - source.i0, source.i1 - 1 - box.i0),
        max(box.j1 - 1 - source.j0, source.j1 - 1 - box.j0),
    )
    return good_length(2 * reach[0] + 1), good_length(2 * reach[1] + 1)


def symbols(
    quadrants: Sequence[tuple[np.ndarray, tuple[int, int]]], padded: tuple[int, int], *, x_first: bool = False
) -> np.ndarray:
    """Discrete Fourier transforms, over px py, of coefficients given at offsets i, j >= 0.

    `quadrants`: pairs of an array [> px//2, > py//2] and its parity (+1 even, -1 odd) in x and y, which gives the
    negative offsets. Complex [k, py//2+1, px], with `x_first` (for `ShiftedTransform`) [k, px//2+1, py].
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
    """The same of coefficients that are even, or odd in both directions: real numbers, each twice [k, ..., 2 waves].

    So `arrays.multiply_2x2` wants them.
    """
    return np.repeat(symbols(quadrants, padded, x_first=x_first).real, 2, axis=2)


def difference_symbols(
    quadrants: Sequence[tuple[np.ndarray, tuple[int, int]]], padded: tuple[int, int], dx: float
) -> np.ndarray:
    """Symbols of the upwind difference (u_i - u_(i+1))/dx of displacements u with coefficients `quadrants`.

    Arrays [> px//2 + 1, > py//2], else as in `symbols`.
    """
    plan = transform(padded, len(quadrants), padded[0])
    for real, (quadrant, parity) in zip(plan.real, quadrants, strict=True):
        arrays.upwind_difference(quadrant, *parity, dx, real)
    return _normalised(plan)


def _normalised(plan: Transform) -> np.ndarray:
    """What the plan transforms, over the number of points, so that products need no other factor."""
    plan.forward()
    hat: np.ndarray = plan.hat / math.prod(plan.padded)
    return hat


def upwind_factor(px: int, dx: float) -> np.ndarray:
    """Symbol [px//2+1] of the upwind difference (u_i - u_(i+1))/dx on a torus of px cells."""
    return (1.0 - np.exp(2j * np.pi / px * np.arange(px // 2 + 1))) / dx


def point_factor(px: int, waves: int) -> np.ndarray:
    """Gives the first `waves` of px waves along x back what cells of a finite length take from them: 1 + (1 - cos k)/6.

    Tractions that are constant in each cell, and the difference of displacements over a cell, damp a wave of k a cell
    by 1 - k^2/12; with the factor what is left is of order k^3.
    """
    result: np.ndarray = 1.0 + (1.0 - np.cos(2.0 * np.pi / px * np.arange(waves))) / 6.0
    return result


def sharp_difference(px: int, dx: float) -> np.ndarray:
    """Symbol [px//2+1] of the upwind difference in which waves along x lose nothing: both of these factors."""
    result: np.ndarray = upwind_factor(px, dx) * point_factor(px, px // 2 + 1)
    return result


def convolve(hat: np.ndarray, padded: tuple[int, int], field: np.ndarray) -> np.ndarray:
    """Product of the operator with symbol `hat` [py//2+1, px] and `field` [nx, ny], on the same cells."""
    nx, ny = field.shape
    plan = transform(padded, 1, nx)
    plan.real[0, :, :ny] = field
    plan.real[0, :, ny:] = 0.0
    plan.forward()
    plan.hat[0] *= hat
    plan.backward()
    return plan.real[0, :, :ny].copy()


TRACTION_PARITY = ((1, (1, 1)), (3, (-1, -1)), (2, (1, 1)))  # component of a coefficient array and parity: xx, xy, yy


def traction_quadrants(quadrant: np.ndarray) -> list[tuple[np.ndarray, tuple[int, int]]]:
    """The coefficients xx, xy, yy of `quadrant` [6, ...] (see `influence.py`) with their parities."""
    return [(quadrant[component], parity) for component, parity in TRACTION_PARITY]


PRESSURE_PARITY = ((4, (-1, 1)), (5, (1, -1)))  # the same of xp, yp


def pressure_quadrants(quadrant: np.ndarray) -> list[tuple[np.ndarray, tuple[int, int]]]:
    """The coefficients xp, yp (displacements along the surface by pressure) of `quadrant` with their parities."""
    return [(quadrant[component], parity) for component, parity in PRESSURE_PARITY]


class PairOperator:
    """Two displacements by two tractions: a symmetric 2x2 array of even convolutions on a box of cells.

    `symbols`: `real_symbols` of xx, xy = yx, yy, those with x first for a `plan` for moved rows.
    """

    def __init__(self, symbols: np.ndarray, box: tuple[int, int], plan: Transform) -> None:
        self.symbols = symbols
        self.box = box
        self.plan = plan

    def on_box(self, q: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Result [2, nx, ny] on the box of `q` [m, 2] given at `cells` [m, 2]; valid until the plan's next use."""
        plan = self.plan
        plan.real[:] = 0.0
        field = plan.by_cell
        field[:, cells[:, 0], cells[:, 1]] = q.T
        plan.forward()
        arrays.multiply_2x2(plan.numbers, self.symbols)
        plan.backward()
        result: np.ndarray = field[:, : self.box[0], : self.box[1]]
        return result
