"""Extent of a contact, found on a coarse mesh, for windows that fit the contact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from rcstudy.mechanics.contact import NormalContact, influence_of
from rcstudy.mechanics.convolution import Box
from rcstudy.mechanics.normal import estimated_contact, initial_gap, solve_pressure
from rcstudy.mechanics.numerics.mixing import Mixing
from rcstudy.mechanics.scene import Mesh, Scene, Tolerance
from rcstudy.mechanics.turns import one_at_a_time

_CELLS = 24
_WIDER = 1.5  # width of the first window over the estimated contact, and of each window over the one that was too small
_TURNS = 40  # largest number of iterations between pressure and lift by tractions: incompressible films need as many
_ENOUGH = 1e-2  # change of that lift at which the iteration ends, over the approach or, if that is less,
_GAPS = 4.0  # times the undeformed gap at the nearer edge: a fair part of the approach on half-spaces, not under plates
_ROUNDING = 1e-9
_CHECKED = 64  # largest number of cells along a side on which it is checked that a window holds the contact
_WIDEST = 4.0  # largest width of a window that is tried, over that of the contact without friction


def contact_extent(scene: Scene) -> tuple[float, float]:
    """Widths (mm) along x and y of the contact of `scene` without friction, whatever its mesh is.

    Solved on 24 x 24 cells; the window grows until it holds the contact. The edge is placed where p^2, which is nearly
    linear there, extrapolates to zero. Accurate to some 5 %; under stiff films and stacks it is up to 13 % too large.
    On thin soft layers, where p and not p^2 is linear or even that begins with a tangent, it may be up to 16 % too
    small: see `reached_sides`.
    """
    ax, ay = estimated_contact(scene)
    first = 2.0 * _WIDER * ax, 2.0 * _WIDER * ay
    return _extent(scene, first, _pressure, (np.inf, np.inf))


def sliding_extent(scene: Scene, extent: tuple[float, float]) -> tuple[float, float]:
    """Widths (mm) along x and y of a window, centred on the origin, that holds the contact of `scene` in full sliding.

    With full coupling tractions move the contact, most if all of it slips. The window holds the contacts that slide
    along x and along y, in either direction (opposite directions are mirror images). `extent`: that without friction,
    a lower limit of what is returned.
    """
    first, most = (tuple(factor * width for width in extent) for factor in (_WIDER, _WIDEST))
    widths = [extent]
    for along in (0, 1):
        widths.append(_extent(scene, first, partial(_sliding_pressure, along=along), most))
    x, y = np.max(widths, axis=0)
    return float(x), float(y)


def reached_sides(scene: Scene) -> tuple[bool, bool]:
    """Whether the contact of `scene` without friction reaches the outermost cells of its window along x and along y.

    Windows of many cells are replaced by one of fewer whose outermost cells have their centres at the same place.
    """
    mesh = scene.mesh
    cells = min(mesh.cells[0], _CHECKED), min(mesh.cells[1], _CHECKED)
    x, y = (size * (1.0 - 1.0 / n) / (1.0 - 1.0 / m) for size, n, m in zip(mesh.size, mesh.cells, cells, strict=True))
    with one_at_a_time():
        touched = _pressure(replace(scene, mesh=Mesh((x, y), cells))) > 0.0
    return bool(touched[[0, -1]].any()), bool(touched[:, [0, -1]].any())


def _extent(
    scene: Scene,
    size: tuple[float, ...],
    pressure: Callable[[Scene], np.ndarray],
    most: tuple[float, ...],
) -> tuple[float, float]:
    """Twice the distance (mm) that the contact of `scene` reaches from the origin along x and y; zeros if not found.

    `size`: size of the first window, which grows up to `most`; `pressure`: function that solves for the pressure.
    """
    while size[0] <= most[0] and size[1] <= most[1]:
        trial = replace(scene, mesh=Mesh((size[0], size[1]), (_CELLS, _CELLS)), tolerance=Tolerance(1e-4, 1e-4))
        with one_at_a_time():
            squares = pressure(trial) ** 2
        if not squares.any():
            break
        edge = squares[[0, -1]].any(), squares[:, [0, -1]].any()
        if not any(edge):
            (x, y), along = trial.mesh.centres, (squares.max(axis=1), squares.max(axis=0))
            return _reach(x, along[0]), _reach(y, along[1])
        size = size[0] * (_WIDER if edge[0] else 1.0), size[1] * (_WIDER if edge[1] else 1.0)
    return 0.0, 0.0


def _pressure(scene: Scene) -> np.ndarray:
    """Pressure [nx, ny] (MPa) without friction."""
    return solve_pressure(scene, influence_of(scene), initial_gap(scene)).p


def _sliding_pressure(scene: Scene, along: int) -> np.ndarray:
    """Pressure [nx, ny] (MPa) if all of the contact slips along x (0) or y (1), by iteration with lift by tractions."""
    influence, gap = influence_of(scene), initial_gap(scene)
    lift, mixing, whole = np.zeros(gap.shape), Mixing(), Box(0, gap.shape[0], 0, gap.shape[1])
    solution = solve_pressure(scene, influence, gap)
    for _ in range(_TURNS):
        if solution.edge:
            break
        contact = NormalContact(scene, influence, solution)
        q = np.zeros((len(contact.cells), 2))
        q[:, along] = scene.friction * contact.pressure
        change = contact.lift(q, whole) - lift
        touched = solution.p > 0.0
        sides = gap[touched.any(axis=1)].min(axis=1), gap[:, touched.any(axis=0)].min(axis=0)
        at_edges = min(float(np.ptp(side)) for side in sides)
        if np.ptp(change[touched]) <= _ENOUGH * min(solution.approach, _GAPS * at_edges):
            break
        lift = mixing.following(lift, change, touched)
        solution = solve_pressure(scene, influence, gap + lift, solution.p)
    return solution.p


def _reach(x: np.ndarray, squares: np.ndarray) -> float:
    """Twice the larger of the distances from the origin at which `squares` (p^2 at `x`, symmetric) end on either side.

    For symmetric contacts the distance on the positive side is taken, so that rounding does not decide.
    """
    ahead, behind = _end(x, squares), _end(x, squares[::-1])
    return 2.0 * (behind if behind > ahead * (1.0 + _ROUNDING) else ahead)


def _end(x: np.ndarray, squares: np.ndarray) -> float:
    """Position at which `squares` (p^2 at `x`) fall to zero, extrapolated from their last two positive values."""
    last = int(np.flatnonzero(squares > 0.0)[-1])
    step = float(x[1] - x[0])
    slope = squares[last - 1] - squares[last] if last > 0 else 0.0
    beyond = float(squares[last] / slope) if slope > 0.0 else 0.5
    return float(x[last]) + step * min(max(beyond, 0.0), 1.0)
