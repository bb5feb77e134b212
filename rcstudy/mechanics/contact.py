"""One contact: its pressure, then its tractions, or both together.

`NormalContact` is all that the creepages of one pressure share: bodies' coefficients, pressure, cells in contact, slip
by pressure, slip operator. With `coupling: full` pressure and tractions are made consistent by repeated substitution.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rcstudy.mechanics.cascade import Level, build_levels, solve_cascade
from rcstudy.mechanics.convolution import (
    Box,
    PairOperator,
    convolve,
    difference_symbols,
    padded_shape,
    symbols,
    traction_quadrants,
)
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.normal import NormalSolution, cell_centres, initial_gap, solve_pressure
from rcstudy.mechanics.paper_cg import solve_paper_cg
from rcstudy.mechanics.rolling import RollingSolution, rigid_slip
from rcstudy.mechanics.scene import Creepage, Scene

_MAX_COUPLING = 60


def influence_of(scene: Scene) -> Influence:
    """The influence coefficients of `scene`'s bodies on its mesh."""
    reach = 2.5 * float(np.hypot(*scene.mesh.size))
    return Influence(scene.substrate, scene.layers, scene.counterbody, scene.mesh.spacing, reach)


@dataclass(eq=False)
class NormalContact:
    """The pressure of a contact and what follows from it for every creepage. Nothing in it changes once made."""

    scene: Scene
    influence: Influence
    solution: NormalSolution

    @cached_property
    def box(self) -> Box:
        """Bounding box of the cells in contact."""
        return Box.around(self.solution.p > 0.0)

    @cached_property
    def cells(self) -> np.ndarray:
        """Indices [m, 2] in the box of the cells in contact, rows of constant x first."""
        return np.ascontiguousarray(np.argwhere(self.solution.p[self.box.slices] > 0.0))

    @cached_property
    def pressure(self) -> np.ndarray:
        """Pressure [m] (MPa) of the cells in contact."""
        return self.gather(self.solution.p)

    @cached_property
    def centres(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates x [m], y [m] (mm) of the cells in contact."""
        x, y = cell_centres(self.scene)
        return x[self.box.i0 + self.cells[:, 0]], y[self.box.j0 + self.cells[:, 1]]

    @cached_property
    def slip_by_pressure(self) -> np.ndarray:
        """Slip [m, 2] by the displacement along the surface that the pressure causes.

        Zero for quasi-identical bodies.
        """
        out = np.zeros((self.cells.shape[0], 2))
        if not self.influence.moves_by_pressure:
            return out
        shape = self.box.shape
        padded = padded_shape(shape)
        quadrant = self.influence.quadrant(padded[0] // 2 + 2, padded[1] // 2 + 1)
        p = self.solution.p[self.box.slices]
        by_pressure = [(quadrant[4], (-1, 1)), (quadrant[5], (1, -1))]
        for component, hat in enumerate(difference_symbols(by_pressure, padded, self.scene.mesh.spacing[0])):
            out[:, component] = convolve(hat, padded, p)[self.cells[:, 0], self.cells[:, 1]]
        return out

    @cached_property
    def levels(self) -> list[Level]:
        """The cascade of meshes of the traction solver, finest first."""
        return build_levels(self.influence, self.scene.mesh.spacing, self.box.shape, self.cells, self.pressure)

    @cached_property
    def displacement(self) -> PairOperator:
        """Displacements by tractions on the box and one more row of cells ahead of it (+x)."""
        shape = self.box.shape[0] + 1, self.box.shape[1]
        padded = padded_shape(shape)
        quadrant = self.influence.quadrant(padded[0] // 2 + 1, padded[1] // 2 + 1)
        return PairOperator(symbols(traction_quadrants(quadrant), padded), padded, shape)

    def gather(self, window: np.ndarray) -> np.ndarray:
        """Values [m] at the cells in contact of an array [nx, ny] of the window."""
        return np.ascontiguousarray(window[self.box.slices][self.cells[:, 0], self.cells[:, 1]])

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Array [nx, ny] of the window with `values` [m] at the cells in contact, zero elsewhere."""
        out = np.zeros(self.scene.mesh.cells, dtype=values.dtype)
        out[self.box.slices][self.cells[:, 0], self.cells[:, 1]] = values
        return out

    def rigid_slip(self, creepage: Creepage, spin_point: float) -> np.ndarray:
        """Rigid slip [m, 2] at the cells in contact."""
        return rigid_slip(*self.centres, creepage, spin_point * self.scene.mesh.spacing[0])


def solve_normal(scene: Scene, influence: Influence | None = None) -> NormalContact:
    """Pressure of `scene` without any influence of tractions."""
    if influence is None:
        influence = influence_of(scene)
    return NormalContact(scene, influence, solve_pressure(scene, influence, initial_gap(scene)))


def solve_rolling(contact: NormalContact, scene: Scene, guess: np.ndarray | None = None) -> RollingSolution:
    """Tractions of `scene` under the pressure of `contact`. `guess`: tractions [m, 2] (MPa) to start from."""
    if scene.creepage is None:
        raise ValueError("a scene without creepage has no tractions")
    w = contact.rigid_slip(scene.creepage, scene.spin_point) + contact.slip_by_pressure
    tolerance = scene.tolerance.tangential
    if scene.method == "paper-cg":
        dx = scene.mesh.spacing[0]
        return solve_paper_cg(contact.displacement, contact.cells, scene.friction * contact.pressure, w, dx, tolerance)
    return solve_cascade(contact.levels, w, scene.friction, tolerance, guess)


def displacement_by_tractions(contact: NormalContact, rolling: RollingSolution, box: Box) -> np.ndarray:
    """u_z (mm, [nx, ny] of `box`) that the tractions cause, by reciprocity: u_z by q_x is minus u_x by p, mirrored.

    `box` must hold the contact; zero for quasi-identical bodies.
    """
    padded = padded_shape(box.shape)
    quadrant = contact.influence.quadrant(padded[0] // 2 + 1, padded[1] // 2 + 1)
    out = np.zeros(box.shape)
    for component, hat in enumerate(symbols([(quadrant[4], (-1, 1)), (quadrant[5], (1, -1))], padded)):
        out -= convolve(hat, padded, contact.spread(rolling.q[:, component])[box.slices])
    return out


def solve_coupled(scene: Scene, contact: NormalContact) -> tuple[NormalContact, RollingSolution]:
    """Pressure and tractions consistent with each other, starting from the frictionless `contact`.

    Substitution in turn (Panagiotopoulos 1975): the pressure with the gap changed by u_z(q), then the tractions under
    that pressure, until the tractions of one turn no longer move the pressure..
    """
    gap = initial_gap(scene)
    rolling = solve_rolling(contact, scene)
    window = Box(0, scene.mesh.cells[0], 0, scene.mesh.cells[1])
    turns = 0
    while contact.influence.moves_by_pressure and turns < _MAX_COUPLING:
        lifted = gap + displacement_by_tractions(contact, rolling, window)
        solution = solve_pressure(scene, contact.influence, lifted, contact.solution.p)
        change = float(np.linalg.norm(solution.p - contact.solution.p) / np.linalg.norm(solution.p))
        solution.iterations += contact.solution.iterations
        solution.products += contact.solution.products
        guess_field = contact.spread(rolling.q[:, 0]), contact.spread(rolling.q[:, 1])
        previous = rolling
        contact = NormalContact(scene, contact.influence, solution)
        guess = np.stack([contact.gather(component) for component in guess_field], axis=1)
        rolling = solve_rolling(contact, scene, guess)
        rolling.iterations += previous.iterations
        rolling.products += previous.products
        rolling.coarse_products += previous.coarse_products
        turns += 1
        if change <= max(scene.tolerance.normal, scene.tolerance.tangential):
            break
    return contact, rolling
