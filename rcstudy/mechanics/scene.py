"""A scene: one rolling contact, fully stated in absolute units (N, mm, MPa, rad).

A :class:`Scene` holds everything the solver needs and nothing else. Scenes are immutable, so that no
derived quantity (influence coefficients, Fourier symbols) can become outdated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

Coupling = Literal["one-way", "full"]
Method = Literal["newton", "paper-cg"]
Discretisation = Literal["kalker", "aligned"]


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic material: Young's modulus `E` (MPa), Poisson's ratio `nu` (-)."""

    E: float
    nu: float

    @property
    def G(self) -> float:
        """Shear modulus (MPa)."""
        return self.E / (2.0 * (1.0 + self.nu))

    @property
    def compliance(self) -> float:
        """(1 - nu^2)/E (1/MPa) of a half-space: its share of 1/E* (Johnson 1985, section 4.2)."""
        return (1.0 - self.nu**2) / self.E

    def is_like(self, other: Material) -> bool:
        """Whether `other` has the same constants."""
        return (self.E, self.nu) == (other.E, other.nu)


def quasi_identical(one: Material, other: Material | None) -> bool:
    """Whether pressure displaces the surfaces of two half-spaces equally along the surface (Dundurs' beta is zero).

    `other` None is rigid. It is quasi-identical to an incompressible body (`nu` 0.5). What rounding of `nu` leaves of
    1 - 2 `nu` is no difference.
    """
    beta = tuple(0.0 if body is None else (1.0 - 2.0 * body.nu) / body.G for body in (one, other))
    rounding = 2e-15 / min(body.G for body in (one, other) if body is not None)
    return math.isclose(*beta, rel_tol=1e-14, abs_tol=rounding)


@dataclass(frozen=True)
class Layer(Material):
    """A bonded elastic layer: material and `thickness` (mm)."""

    thickness: float


@dataclass(frozen=True)
class Creepage:
    """Creepages `longitudinal`, `lateral` (-) and `spin` (rad/mm)."""

    longitudinal: float = 0.0
    lateral: float = 0.0
    spin: float = 0.0

    def __sub__(self, other: Creepage) -> Creepage:
        return Creepage(self.longitudinal - other.longitudinal, self.lateral - other.lateral, self.spin - other.spin)

    def fastest(self, radius: float) -> float:
        """Largest rigid slip (-) within `radius` (mm) of the origin, |xi| + |phi| r (the paper's Eq. 5)."""
        return self._translation + abs(self.spin) * radius

    def power(self, force_x: float, force_y: float, moment: float) -> float:
        """Power per unit rolling speed (N) of forces (N) and a moment (N mm) on the rigid slip: xi.F + phi M."""
        return self.longitudinal * force_x + self.lateral * force_y + self.spin * moment

    @property
    def pole(self) -> tuple[float, float]:
        """Place x, y (mm) of the pole of spin, where the rigid slip vanishes; infinitely far away without spin."""
        return (-self.lateral / self.spin, self.longitudinal / self.spin) if self.spin else (math.inf, math.inf)

    @property
    def _translation(self) -> float:
        """Size of the creepage without spin (-)."""
        return math.hypot(self.longitudinal, self.lateral)


@dataclass(frozen=True)
class Mesh:
    """Potential contact area: `size` (mm) and number of `cells` along x (rolling) and y, centred on the origin."""

    size: tuple[float, float]
    cells: tuple[int, int]

    @property
    def spacing(self) -> tuple[float, float]:
        """Cell sizes dx, dy (mm)."""
        return self.size[0] / self.cells[0], self.size[1] / self.cells[1]

    @property
    def centres(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates x [nx], y [ny] of the cells' centres (mm), not to be changed."""
        return _centres(self)


@lru_cache(maxsize=64)
def _centres(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """As `Mesh.centres`."""
    x, y = ((np.arange(n) - 0.5 * (n - 1)) * step for n, step in zip(mesh.cells, mesh.spacing, strict=True))
    x.setflags(write=False)
    y.setflags(write=False)
    return x, y


@dataclass(frozen=True)
class Tolerance:
    """Relative stopping tolerances of the pressure and of the traction solver (-)."""

    normal: float = 1e-5
    tangential: float = 1e-7


@dataclass(frozen=True)
class Scene:
    """One rolling contact. Signs and units: rolling in +x, N, mm, MPa.

    `layers` run from the surface down. `counterbody` None means rigid. `creepage` None means that only
    the pressure is wanted (no tractions are computed). `spin_point` is the point, in cells ahead of the
    centre, at which the spin part of the rigid slip is evaluated.
    """

    substrate: Material
    radius: tuple[float, float]
    load: float
    mesh: Mesh
    layers: tuple[Layer, ...] = ()
    counterbody: Material | None = None
    friction: float = 1.0
    creepage: Creepage | None = None
    coupling: Coupling = "one-way"
    method: Method = "newton"
    discretisation: Discretisation = "kalker"
    spin_point: float = 0.0
    tolerance: Tolerance = Tolerance()

    @property
    def conflicts(self) -> dict[str, str]:
        """Reasons, by the keys of the settings, why these conflict with the method; empty if none does."""
        found: dict[str, str] = {}
        if self.method == "newton":
            return found
        if self.coupling == "full" and self.creepage is not None:
            found["coupling"] = f"method {self.method} is for coupling one-way only"
        if self.discretisation == "aligned":
            found["discretisation"] = f"method {self.method} is for discretisation kalker only"
        return found

    @property
    def joined(self) -> Scene:
        """The same body in as few layers as possible, which is what is solved: results do not depend on its wording.

        Neighbours of one material are one layer; those of the substrate's own, at the bottom, belong to it.
        """
        layers: list[Layer] = []
        for layer in self.layers:
            if layers and layers[-1].is_like(layer):
                layer = replace(layer, thickness=layers.pop().thickness + layer.thickness)
            layers.append(layer)
        if layers and layers[-1].is_like(self.substrate):
            layers.pop()
        return self if len(layers) == len(self.layers) else replace(self, layers=tuple(layers))

    @cached_property
    def moves_by_pressure(self) -> bool:
        """Whether pressure displaces the surfaces along each other: not for quasi-identical bodies without layers."""
        return not quasi_identical(self.substrate, self.counterbody) or bool(self.joined.layers)

    @property
    def is_coupled(self) -> bool:
        """Whether pressure and tractions are solved for together: full coupling of bodies with slip by pressure."""
        return self.coupling == "full" and self.creepage is not None and self.moves_by_pressure
