"""Cascade of meshes: each scene is first solved with cells of twice the size.

The coarser solution is the first guess for pressure and tractions, and the difference between the two solutions serves
to estimate the discretisation error (`rcstudy/bars/estimate.py`). It never enters the finer solution, which solves its
own discrete equations.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from rcstudy.mechanics.convolution import Box
from rcstudy.mechanics.kernels import meshes
from rcstudy.mechanics.normal import semi_axes_in_cells
from rcstudy.mechanics.scene import Mesh, Scene, Tolerance

# A mesh has a coarser one if the contact is at least this many of that mesh's own cells across: the scene's mesh, the
# first coarser one, and any further one (`_FURTHER`). So contacts of 6 to 24 cells have one coarser mesh, up to 96 two.
# The first is the most important for the error bars and the second adds a little; others only provide a first guess.
_COARSEST = 6.0, 12.0
_FURTHER = 24.0
_ROUNDING = 1e-9  # windows given in radii make contacts exactly that many cells across, up to rounding
_TOLERANCE = Tolerance(3e-3, 2e-3)  # on coarser meshes (residuals of 1e-3): well below their discretisation error


def coarser_scene(scene: Scene, level: int = 0) -> Scene | None:
    """`scene` with cells of twice the size and looser tolerances; None if the contact has too few cells.

    `level`: how many times the mesh has been coarsened already. An odd number of cells is rounded up: the window grows
    by half a fine cell on each side.
    """
    dx, dy = scene.mesh.spacing
    least = _COARSEST[level] if level < len(_COARSEST) else _FURTHER
    if 2.0 * min(semi_axes_in_cells(scene)) < (1.0 - _ROUNDING) * least:
        return None
    nx, ny = ((n + 1) // 2 for n in scene.mesh.cells)
    mesh = Mesh((2.0 * dx * nx, 2.0 * dy * ny), (nx, ny))
    return replace(scene, mesh=mesh, tolerance=coarser_tolerance(scene.tolerance))


def in_wider_window(coarse: Scene) -> Scene:
    """The scene on a coarser mesh, `coarse`, with one more cell on each side of its window.

    A contact that its own mesh shows within the window may reach the outermost cells of a coarser one, most often on
    few cells in windows that are fitted. (Of 1100 random ones, 7 to 57 cells across with margins of 1.06 and 1.25, 210
    do, and none of them with this cell more.)
    """
    nx, ny = (n + 2 for n in coarse.mesh.cells)
    dx, dy = coarse.mesh.spacing
    return replace(coarse, mesh=Mesh((nx * dx, ny * dy), (nx, ny)))


def coarser_tolerance(own: Tolerance) -> Tolerance:
    """Tolerances on the coarser meshes of a scene with tolerances `own`: never tighter than `_TOLERANCE`."""
    return Tolerance(max(_TOLERANCE.normal, own.normal), max(_TOLERANCE.tangential, own.tangential))


def interpolate(
    values: np.ndarray, mask: np.ndarray, cells: np.ndarray, place: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Values at `cells` [m, 2], interpolated bilinearly from a mesh with cells of twice the size.

    `values` [k, nx, ny]: on the coarse cells, of which only those in `mask` [nx, ny] are used; the weights of the
    others are distributed among them. `place`: position of fine cell (0, 0) among the coarse cells, as fractional
    indices of the latter. Returns values [m, k] (zero where no coarse cell is used) and the total weight [m] of the
    coarse cells used.
    """
    out = np.zeros((cells.shape[0], values.shape[0]))
    weight = np.zeros(cells.shape[0])
    meshes.interpolate_cells(values, mask, cells, place[0], place[1], out, weight)
    return out, weight


def place_among_coarser(fine: tuple[int, ...], coarse: tuple[int, ...]) -> tuple[float, float]:
    """Position of the first cell of a window of `fine` cells, as fractional indices of cells of twice the size.

    These form a window of `coarse` cells with the same centre.
    """
    x, y = (0.5 * (c - 1) - 0.25 * (f - 1) for c, f in zip(coarse, fine, strict=True))
    return x, y


def interpolated_pressure(p: np.ndarray, window: tuple[int, int]) -> np.ndarray:
    """First guess of the pressure [nx, ny] (MPa) on a `window` of nx x ny cells, from `p` on cells of twice the size.

    p^2 is interpolated, as it is nearly linear at the edge of a contact. Cells for which the coarse cells in contact
    have less than half of the weight get none.
    """
    mask = p > 0.0
    box = _reached(Box.around(mask), p.shape, window)
    # contiguous like the cells of a contact: the kernel is compiled once
    cells = np.ascontiguousarray(np.array([box.i0, box.j0]) + np.argwhere(np.ones(box.shape, dtype=np.bool_)))
    squares, weight = interpolate((p * p)[None], mask, cells, place_among_coarser(window, p.shape))
    guess = np.zeros(window)
    guess[box.slices] = np.where(weight >= 0.5, np.sqrt(squares[:, 0]), 0.0).reshape(box.shape)
    return guess


def _reached(box: Box, coarse: tuple[int, ...], fine: tuple[int, int]) -> Box:
    """Box of all cells of a window of `fine` cells whose bilinear interpolation uses coarse cells in `box`.

    `box` is one of a window of `coarse` cells of twice the size; both windows have the same centre.
    """

    def along(low: int, high: int, axis: int) -> tuple[int, int]:
        shift = 0.5 * (fine[axis] - 1) - (coarse[axis] - 1)
        return max(0, math.floor(2 * (low - 1) + shift)), min(fine[axis], math.ceil(2 * high + shift) + 1)

    return Box(*along(box.i0, box.i1, 0), *along(box.j0, box.j1, 1))
