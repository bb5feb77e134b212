"""Full coupling on aligned cells: the pressure that belongs to tractions on rows that begin where the contact begins.

`coupled.py` finds pressure and tractions together on cells as they are. Their tractions have errors of first order in
the cells' size, and what these do to the pressure shows in moments. So its pressure is only the start: tractions on the
rows aligned with it lift the surface, under that lift the pressure is solved once more, and then the tractions. One
such turn brings the pressure within some 0.05 % of the fixed point, a tenth of what it was off before, and further
turns change no error. As nothing before the last step need be exact, it takes no longer than the exact solution on
cells as they are with tractions on aligned cells after it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.contact import NormalContact, displacement_by_tractions, influence_of, solve_rolling
from rcstudy.mechanics.convolution import Box, padded_shape, pressure_quadrants, row_phases, shifted_transform, symbols
from rcstudy.mechanics.coupled import solve_coupled
from rcstudy.mechanics.normal import initial_gap, solve_pressure
from rcstudy.mechanics.rolling import RollingSolution
from rcstudy.mechanics.scene import Scene, Tolerance

_START = 1e-4  # tolerance of pressure and tractions on cells as they are
_FIRST = 1e-2  # of the first tractions on aligned cells

Lift = Callable[[Box], np.ndarray]
"""u_z (mm, [nx, ny] of a box) by the tractions that a pressure was found under."""


def solve_aligned_coupled(scene: Scene) -> tuple[NormalContact, RollingSolution | None, Lift]:
    """Pressure and tractions of `scene` on aligned cells, and the lift that the pressure belongs to.

    No tractions if the pressure has no solution within the window or to its tolerance: see `contact.solution`.
    """
    influence = influence_of(scene)
    own = scene.tolerance
    eased = replace(scene, tolerance=Tolerance(max(own.normal, _START), max(own.tangential, _START)))
    start, cells_as_they_are = solve_coupled(eased, influence)

    def first_lift(box: Box) -> np.ndarray:
        return displacement_by_tractions(start, cells_as_they_are, box)

    if start.solution.edge or not start.solution.converged:
        return start, None, first_lift
    contact = AlignedContact(start)
    first = solve_rolling(contact, replace(scene, tolerance=Tolerance(own.normal, max(own.tangential, _FIRST))))

    def lift(box: Box) -> np.ndarray:
        return lift_by_moved_rows(contact, first.q, box)

    box = contact.box.grown(contact.box.shape[0] // 8 + 2, contact.box.shape[1] // 8 + 2, scene.mesh.cells)
    gap = initial_gap(scene)
    gap[box.slices] += lift(box)
    pressure = solve_pressure(scene, influence, gap, start.solution.p)
    pressure.iterations += start.solution.iterations
    pressure.products += start.solution.products
    if pressure.edge or not pressure.converged:
        return NormalContact(scene, influence, pressure), None, lift
    last = AlignedContact(NormalContact(scene, influence, pressure))
    last.coarser = contact.coarser
    rolling = solve_rolling(last, scene, _carried_over(contact, first.q, last))
    rolling.coarser = first.coarser
    rolling.iterations += first.iterations + cells_as_they_are.iterations
    rolling.products += first.products + cells_as_they_are.products
    return last, rolling, lift


def lift_by_moved_rows(contact: AlignedContact, q: np.ndarray, box: Box) -> np.ndarray:
    """u_z (mm, [nx, ny] of `box`) at the cells as they are by tractions `q` [m, 2] on the moved rows.

    As `contact.displacement_by_tractions`: rows are moved on the way there and not back. `box` must hold the contact.
    """
    padded = padded_shape(box.shape)

    def make() -> np.ndarray:
        quadrant = contact.influence.quadrant(padded[0] // 2 + 1, padded[1] // 2 + 1)
        return symbols(pressure_quadrants(quadrant), padded, x_first=True)

    # first of all: of a contact one row wide the symbols are made in this very plan
    hat = contact.influence.once(("lift, x first", padded), make)
    corner = contact.box.i0 - box.i0, contact.box.j0 - box.j0
    shift = np.zeros(box.shape[1])
    shift[corner[1] : corner[1] + contact.shift.size] = contact.shift
    plan = shifted_transform(padded, 2, box.shape[1])
    there = plan.shifted(row_phases(padded[0], shift))
    there.real[:] = 0.0
    there.by_cell[:, contact.cells[:, 0] + corner[0], contact.cells[:, 1] + corner[1]] = q.T
    there.forward()
    there.hat *= hat
    plan.backward()
    lift: np.ndarray = -plan.by_cell[:, : box.shape[0]].sum(axis=0)
    return lift


def _carried_over(contact: AlignedContact, q: np.ndarray, other: AlignedContact) -> np.ndarray:
    """Tractions [m, 2] (MPa) to start from on the cells of `other`: the same fractions of the bound as `q`."""
    fraction = q / contact.pressure[:, None]
    carried = [other.gather(contact.spread(np.ascontiguousarray(component))) for component in fraction.T]
    result: np.ndarray = np.stack(carried, axis=1) * other.pressure[:, None]
    return result
