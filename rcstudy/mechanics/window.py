"""How far a contact reaches, found on a coarse mesh: for windows that fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rcstudy.mechanics.contact import influence_of
from rcstudy.mechanics.convolution import ONE_AT_A_TIME
from rcstudy.mechanics.normal import estimated_contact, initial_gap, solve_pressure
from rcstudy.mechanics.scene import Mesh, Scene, Tolerance

_CELLS = 24
_WIDER = 1.5  # first window over the estimated contact, and each window over the last one that was too small


def contact_extent(scene: Scene) -> tuple[float, float]:
    """Widths (mm) along x and y of the contact of `scene` without friction, whatever its mesh is.

    Solved on 24 x 24 cells; the window grows until the contact is inside. The edge lies within a cell where p^2, nearly
    linear there, would vanish. Right to about 3 %.
    """
    ax, ay = estimated_contact(scene)
    size = 2.0 * _WIDER * ax, 2.0 * _WIDER * ay
    while True:
        trial = replace(scene, mesh=Mesh(size, (_CELLS, _CELLS)), tolerance=Tolerance(1e-4, 1e-4))
        with ONE_AT_A_TIME:
            solution = solve_pressure(trial, influence_of(trial), initial_gap(trial))
        touched = solution.p > 0.0
        edge = touched[[0, -1]].any(), touched[:, [0, -1]].any()
        if not any(edge):
            x, y = trial.mesh.centres
            squares = solution.p**2
            return 2.0 * _half_width(x, squares.max(axis=1)), 2.0 * _half_width(y, squares.max(axis=0))
        size = size[0] * (_WIDER if edge[0] else 1.0), size[1] * (_WIDER if edge[1] else 1.0)


def _half_width(x: np.ndarray, squares: np.ndarray) -> float:
    """Distance from the origin at which `squares` (p^2 at `x`, symmetric) falls to zero, from its last two values."""
    last = int(np.flatnonzero(squares > 0.0)[-1])
    step = float(x[1] - x[0])
    slope = squares[last - 1] - squares[last] if last > 0 else 0.0
    beyond = float(squares[last] / slope) if slope > 0.0 else 0.5
    return float(x[last]) + step * min(max(beyond, 0.0), 1.0)
