"""Scenes that the tests of the mechanics share."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rcstudy.mechanics.exact import Hertz, contact_modulus, hertz_contact
from rcstudy.mechanics.scene import Material, Mesh, Scene, Tolerance
from rcstudy.result import Result, Status
from rcstudy.solve import solve_scene

STEEL = Material(210000.0, 0.3)
RADIUS = (50.0, 50.0)
LOAD = 100.0
TIGHT = Tolerance(1e-9, 1e-9)
# scalars of a contact, some of which slips
MIDDLING = {"contact_area": 1.0, "contact_radius": 0.8, "approach": 0.03, "pressure_max": 100.0}
MIDDLING |= {"slip_area": 0.2, "traction_max": 50.0}


def hertz_of(
    radius: tuple[float, float] = RADIUS,
    body: Material = STEEL,
    counterbody: Material | None = STEEL,
    load: float = LOAD,
) -> Hertz:
    """Hertz's solution of two half-spaces."""
    return hertz_contact(radius, load, contact_modulus(body, counterbody))


def window(semi_axes: tuple[float, float], cells: tuple[float, float], margin: int = 3) -> Mesh:
    """A mesh with `cells` cells along the *diameters* 2 a of the contact and at least `margin` free cells all round.

    The number of cells is odd, so that one cell's centre is the contact's.
    """
    dx, dy = (2.0 * a / n for a, n in zip(semi_axes, cells, strict=True))
    nx, ny = (2 * (math.ceil(n / 2.0) + margin) + 1 for n in cells)
    return Mesh((nx * dx, ny * dy), (nx, ny))


def centres(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates x [nx, 1], y [1, ny] of the cell centres (mm)."""
    (nx, ny), (dx, dy) = scene.mesh.cells, scene.mesh.spacing
    return ((np.arange(nx) - 0.5 * (nx - 1)) * dx)[:, None], ((np.arange(ny) - 0.5 * (ny - 1)) * dy)[None, :]


def solved(scene: Scene) -> Result:
    """The result of `scene`, which has to be solved and proven."""
    result = solve_scene(scene)
    assert result.status == Status.SOLVED, result.reason
    return result


def steel(mesh: Mesh, **more: Any) -> Scene:
    """Equal steel bodies under the paper's load, tight tolerances; `more` replaces any of it."""
    stated: dict[str, Any] = {
        "substrate": STEEL,
        "counterbody": STEEL,
        "radius": RADIUS,
        "load": LOAD,
        "mesh": mesh,
        "tolerance": TIGHT,
    }
    return Scene(**(stated | more))
