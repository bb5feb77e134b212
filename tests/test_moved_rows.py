"""Transforms and convolutions of rows that are moved along x by parts of cells (`convolution.ShiftedTransform`)."""

from __future__ import annotations

import naive
import naive_rows
import numpy as np
import pytest

from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.contact import solve_normal
from rcstudy.mechanics.convolution import (
    PairOperator,
    padded_shape,
    real_symbols,
    row_phases,
    shifted_transform,
    symbols,
    transform,
    upwind_factor,
)
from rcstudy.study import scene_from_mapping

TORI = [(8, 5), (9, 6), (12, 12), (15, 7), (2, 1), (1, 3)]


@pytest.mark.parametrize("padded", TORI)
def test_symbols_with_x_first(padded: tuple[int, int]) -> None:
    """The transform of the torus, halved along x instead of y."""
    quadrant = np.random.default_rng(5).normal(size=(2, padded[0] // 2 + 1, padded[1] // 2 + 1))
    pair = [(quadrant[0], (1, 1)), (quadrant[1], (-1, 1))]
    found = symbols(pair, padded, x_first=True)
    for hat, (of_one, parity) in zip(found, pair, strict=True):
        whole = np.fft.fft2(naive.torus(of_one, parity, padded)) / (padded[0] * padded[1])
        np.testing.assert_allclose(hat, whole[: padded[0] // 2 + 1], atol=1e-14)


@pytest.mark.parametrize("px", [1, 2, 7, 10])
def test_upwind_factor(px: int) -> None:
    row = np.random.default_rng(px).normal(size=px)
    found = np.fft.irfft(np.fft.rfft(row) * upwind_factor(px, 0.3), px)
    np.testing.assert_allclose(found, (row - np.roll(row, -1)) / 0.3, atol=1e-13)


@pytest.mark.parametrize("padded", TORI)
def test_rows_that_are_moved_there_and_back(padded: tuple[int, int]) -> None:
    """The identity, by any shift, with other columns of zeros or none."""
    rng = np.random.default_rng(6)
    for ny in {padded[1], (padded[1] + 1) // 2}:
        moved = shifted_transform(padded, 2, ny).shifted(row_phases(padded[0], rng.uniform(-1.0, 1.0, size=ny)))
        field = rng.normal(size=(2, padded[0], ny))
        moved.by_cell[:] = field
        moved.forward()
        moved.backward()
        np.testing.assert_allclose(moved.by_cell / (padded[0] * padded[1]), field, atol=1e-14)


@pytest.mark.parametrize("padded", TORI)
def test_rows_moved_by_whole_cells(padded: tuple[int, int]) -> None:
    """Rolled towards +x, but for the shortest wave of an even number of cells, which stays as it is."""
    rng = np.random.default_rng(7)
    px, py = padded
    shift = rng.integers(-3, 4, size=py)
    plan = shifted_transform(padded, 1, py)
    moved = plan.shifted(row_phases(px, shift.astype(float)))
    field = rng.normal(size=(px, py))
    alternating = np.zeros((px, py))
    if px % 2 == 0:
        sign = (-1.0) ** np.arange(px)
        alternating = np.outer(sign, sign @ field / px)
    plan.by_cell[0] = field
    moved.forward()
    plan.backward()  # the same buffers, and no phase
    rest = field - alternating
    rolled = np.stack([np.roll(row, n) for row, n in zip(rest.T, shift, strict=True)], axis=1)
    np.testing.assert_allclose(plan.by_cell[0] / (px * py), rolled + alternating, atol=1e-14)


@pytest.mark.parametrize("px", [9, 16, 17])
def test_rows_moved_by_parts_of_cells(px: int) -> None:
    """A sum of waves is at x - shift what it was at x, to rounding."""

    def row(x: np.ndarray) -> np.ndarray:
        k = 2.0 * np.pi / px
        return np.asarray(0.4 + np.sin(k * x + 0.3) - 0.7 * np.cos(3.0 * k * x) + 0.2 * np.sin((px // 2 - 1) * k * x))

    shift = np.array([0.0, 0.37, -0.5, 1.25])
    plan = shifted_transform((px, 6), 1, 4)
    plan.by_cell[0] = row(np.arange(px))[:, None]
    plan.shifted(row_phases(px, shift)).forward()
    plan.backward()
    np.testing.assert_allclose(plan.by_cell[0] / (px * 6), row(np.arange(px)[:, None] - shift), atol=1e-14)


def random_operator(padded: tuple[int, int], seed: int) -> list[tuple[np.ndarray, tuple[int, int]]]:
    """Random coefficients of a symmetric pair with its parities."""
    quadrant = np.random.default_rng(seed).normal(size=(3, padded[0] // 2 + 1, padded[1] // 2 + 1))
    quadrant[1, 0] = quadrant[1, :, 0] = 0.0  # odd in both directions
    return [(quadrant[0], (1, 1)), (quadrant[1], (-1, -1)), (quadrant[2], (1, 1))]


@pytest.mark.parametrize("box", [(1, 1), (1, 4), (5, 1), (4, 6), (5, 4), (8, 8)])
def test_rows_that_are_not_moved(box: tuple[int, int]) -> None:
    """The convolution of `Transform`, by a shift of nothing and without one; padded to good, odd and even lengths."""
    rng = np.random.default_rng(8)
    for padded in (padded_shape(box), (2 * box[0] - 1, 2 * box[1] - 1), (2 * box[0], 2 * box[1])):
        quadrants = random_operator(padded, 9)
        cells = np.argwhere(rng.random(box) < 0.8)
        q = rng.normal(size=(len(cells), 2))
        plan = transform(padded, 2, box[0])
        usual = PairOperator(real_symbols(quadrants, padded), box, plan).on_box(q, cells).copy()
        for other in (
            shifted_transform(padded, 2, box[1]),
            shifted_transform(padded, 2, box[1]).shifted(row_phases(padded[0], np.zeros(box[1]))),
        ):
            found = PairOperator(real_symbols(quadrants, padded, x_first=True), box, other).on_box(q, cells)
            assert found.shape == usual.shape
            np.testing.assert_allclose(found, usual, atol=1e-14 * np.abs(usual).max(initial=1.0))


@pytest.mark.parametrize("padded", [(7, 7), (8, 7), (9, 8)])
def test_convolution_of_moved_rows(padded: tuple[int, int]) -> None:
    """Against sums over all pairs of cells, the kernel between two rows being moved by the difference of their shifts.

    By parts of cells the kernel is a sum of waves; by whole cells (the last shifts) on an odd torus it is just rolled.
    """
    box = (4, 3)
    rng = np.random.default_rng(10)
    quadrants = random_operator(padded, 11)
    xx, xy, yy = (naive.torus(quadrant, parity, padded) for quadrant, parity in quadrants)
    cells = np.argwhere(np.ones(box, dtype=bool))
    field = rng.normal(size=(2, *box))
    for shift in (np.array([0.3, -0.45, 0.1]), np.array([1.0, 0.0, -1.0])):
        plan = shifted_transform(padded, 2, box[1]).shifted(row_phases(padded[0], shift))
        operator = PairOperator(real_symbols(quadrants, padded, x_first=True), box, plan)
        found = operator.on_box(field.reshape(2, -1).T, cells)
        expected = [
            sum(naive_rows.moved_convolution(kernel, part, shift) for kernel, part in zip(pair, field, strict=True))
            for pair in ((xx, xy), (xy, yy))
        ]
        np.testing.assert_allclose(found, expected, atol=1e-12)
    if padded[0] % 2:
        rolled = np.zeros(box)
        for i, j in cells:
            for k, m in cells:
                rolled[i, j] += xx[round(i - k + shift[j] - shift[m]) % padded[0], j - m] * field[0, k, m]
                rolled[i, j] += xy[round(i - k + shift[j] - shift[m]) % padded[0], j - m] * field[1, k, m]
        np.testing.assert_allclose(found[0], rolled, atol=1e-12)


def test_slip_by_pressure_of_a_contact_one_row_wide() -> None:
    """The symbols' transform is then that of the contact: made at the first use or kept from it, they give the same."""
    scene = scene_from_mapping(
        {
            "substrate": {"E": 210000, "nu": 0.3},
            "layers": [],
            "counterbody": "rigid",
            "radius": 50,
            "load": 100,
            "friction": 1.0,
            "mesh": {"size": [1.0, 2.25], "cells": [32, 5]},
        }
    )
    contact = solve_normal(scene)
    first, second = (AlignedContact(contact).slip_by_pressure for _ in range(2))
    assert contact.box.shape[1] == 1
    assert np.abs(second).max() > 1e-4
    np.testing.assert_array_equal(first, second)
