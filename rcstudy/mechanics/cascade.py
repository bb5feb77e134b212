"""A cascade of meshes for the tractions: each solution is the next finer mesh's first guess.

Coarser levels join 2 x 2 cells of the contact itself; their pressure is the mean, their slip data the mean over the
cells in contact, their coefficients those of cells of twice the size. They steer the iteration and nothing else: the
finest level solves the stated discrete equations.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.kernels import tractions
from rcstudy.mechanics.rolling import RollingSolution, SlipOperator, solve_tractions

_COARSEST = 12  # cells: a level whose box is no larger in some direction starts the cascade
_COARSE_TOLERANCE = 3e-3  # of the coarser levels: their discretisation error is larger


@dataclass(frozen=True, eq=False)
class Level:
    """One mesh of the cascade: its operator, cells in contact [m, 2] and pressures [m] (MPa).

    `parent` [m]: the cell of the next coarser level that holds a cell; `stencil` [m, 4], `weights` [m, 4]: bilinear
    interpolation from that level. Empty on the coarsest level.
    """

    operator: SlipOperator
    cells: np.ndarray
    pressure: np.ndarray
    parent: np.ndarray
    stencil: np.ndarray
    weights: np.ndarray

    def restrict(self, values: np.ndarray, count: int) -> np.ndarray:
        """Means [count, k] over the cells of each parent of `values` [m, k]."""
        members = np.bincount(self.parent, minlength=count)
        return np.stack(
            [np.bincount(self.parent, weights=column, minlength=count) / members for column in values.T], axis=1
        )

    def prolong(self, values: np.ndarray) -> np.ndarray:
        """Interpolate `values` [coarse m, k] to this level's cells."""
        result: np.ndarray = np.einsum("mk,mkc->mc", self.weights, values[self.stencil])
        return result


def build_levels(influence: Influence, shape: tuple[int, int], cells: np.ndarray, pressure: np.ndarray) -> list[Level]:
    """Levels from the finest (`cells` [m, 2] in a box of `shape` with `pressure` [m]) to the
    coarsest.
    """
    levels = []
    while True:
        operator = SlipOperator.of(influence, shape)
        if min(shape) <= _COARSEST:
            none = np.zeros((0, 4))
            levels.append(Level(operator, cells, pressure, np.zeros(0, dtype=np.int64), none.astype(np.int64), none))
            return levels
        coarse_shape = (shape[0] + 1) // 2, (shape[1] + 1) // 2
        number = np.full(coarse_shape, -1)
        number[cells[:, 0] // 2, cells[:, 1] // 2] = 0
        coarse_cells = np.ascontiguousarray(np.argwhere(number == 0))
        number[coarse_cells[:, 0], coarse_cells[:, 1]] = np.arange(coarse_cells.shape[0])
        stencil, weights = np.empty((cells.shape[0], 4), dtype=np.int64), np.empty((cells.shape[0], 4))
        tractions.bilinear_stencil(cells, number, stencil, weights)
        parent = stencil[:, 0]
        levels.append(Level(operator, cells, pressure, parent, stencil, weights))
        # four cells to a parent, those out of contact carrying no pressure
        pressure = np.bincount(parent, weights=pressure) / 4.0
        influence = influence.coarser()
        shape, cells = coarse_shape, coarse_cells


def solve_cascade(levels: list[Level], w: np.ndarray, friction: float, tolerance: float) -> RollingSolution:
    """Tractions on the finest of `levels` from nothing; `w` [m, 2] and `tolerance` as in `solve_tractions`."""
    data = [w]
    for fine, coarse in pairwise(levels):
        data.append(fine.restrict(data[-1], coarse.cells.shape[0]))
    guess: np.ndarray | None = None
    coarse_products = 0
    for (fine, level), values in reversed(list(zip(pairwise(levels), data[1:], strict=True))):
        bound = friction * level.pressure
        solution = solve_tractions(level.operator, level.cells, bound, values, max(_COARSE_TOLERANCE, tolerance), guess)
        coarse_products += solution.products
        # the fraction of the bound is smooth, the bound itself is known on the finer level
        fraction = fine.prolong(solution.q / bound[:, None])
        guess = friction * fine.pressure[:, None] * fraction
    finest = levels[0]
    result = solve_tractions(finest.operator, finest.cells, friction * finest.pressure, w, tolerance, guess)
    result.coarse_products = coarse_products
    return result
