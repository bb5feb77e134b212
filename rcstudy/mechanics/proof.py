"""The proof that goes with every solution, computed apart from the solvers.

Displacements come from the influence coefficients by convolutions of their own (displacements first, differences after;
a larger box for the gap), not from the operators and residuals that the solvers keep. Which cells slip is what the
solution says, and is held to. On aligned cells it takes over where their rows are, the pressure on them, what leading
cells make too much of slips by pressure, and what `centring.py` added to the slip in a few cells.
"""

from __future__ import annotations

import numpy as np

from rcstudy.mechanics.aligned_coupled import KEPT
from rcstudy.mechanics.centring import slip_at_centres
from rcstudy.mechanics.contact import NormalContact
from rcstudy.mechanics.convolution import convolve, padded_around, symbols
from rcstudy.mechanics.normal import initial_gap
from rcstudy.mechanics.rolling import RollingSolution
from rcstudy.mechanics.scene import Scene

# How far a proof may miss, in units of the tolerance asked for, and never asked to be better than _FLOOR.
# Tolerances bound errors in the mean; the proof looks at the worst cell, hence the room.
_ROOM = 100.0
_FLOOR = 1e-9


def prove_normal(contact: NormalContact, scene: Scene, q: np.ndarray | None = None) -> dict[str, float]:
    """Tension, load balance, gap under pressure and overlap outside the contact (keys of `result.VARIABLES`).

    Tension is relative to the largest pressure, the balance to the load, gap and overlap to the approach.
    The gap h + u_z - approach is computed on the contact's box and half as much again on each side; farther out h
    grows and u_z falls. `q` [m, 2]: tractions (MPa) that lift the surface, with `coupling: full`.
    """
    dx, dy = scene.mesh.spacing
    size = contact.touched.shape
    box = contact.box.grown(size[0] // 2 + 2, size[1] // 2 + 2, scene.mesh.cells)
    p = contact.solution.p[box.slices]
    padded = padded_around(contact.touched, box)
    quadrant = contact.influence.around(padded)
    gap = initial_gap(scene)[box.slices] - contact.solution.approach
    gap += convolve(symbols([(quadrant[0], (1, 1))], padded)[0], padded, p)
    if q is not None:
        gap += contact.lift(q, box)
    inside = p > 0.0
    scale = abs(contact.solution.approach)
    return {
        "proof_tension": max(0.0, -float(contact.solution.p.min()) / float(contact.solution.p.max())),
        "proof_load": abs(float(p.sum()) * dx * dy - scene.load) / scene.load,
        "proof_gap": float(np.abs(gap[inside]).max()) / scale,
        "proof_penetration": float(np.clip(-gap[~inside], 0.0, None).max(initial=0.0)) / scale,
    }


def slips(contact: NormalContact, scene: Scene, rolling: RollingSolution) -> np.ndarray:
    """Slip [m, 2] under the tractions of `rolling`: displacements first, differences after. This is what is stored.

    With `discretisation: aligned` that of slip cells at their centres.
    """
    if scene.creepage is None:
        raise ValueError("a scene without creepage has no slip")
    i, j = contact.cells.T

    def slip(u: np.ndarray) -> np.ndarray:
        s: np.ndarray = (u[:, i, j] - u[:, i + 1, j]).T / scene.mesh.spacing[0]
        return s

    result = contact.rigid_slip(scene.creepage, scene.spin_point)
    result += contact.corrected_at_leading_edge(slip(contact.displacement_by_pressure))
    result += slip(contact.displacement.on_box(rolling.q, contact.cells)) + contact.cross_slip(rolling.q)
    return (
        result
        if contact.neighbours is None
        else slip_at_centres(result, rolling.slip, contact.neighbours, rolling.centring)
    )


def prove_rolling(contact: NormalContact, scene: Scene, rolling: RollingSolution, s: np.ndarray) -> dict[str, float]:
    """Slip in stick cells, direction of slip cells' tractions, and the bound (keys of `result.VARIABLES`).

    The first two are relative to the largest slip without tractions, the bound to its own largest value, mu p_max.
    `s` [m, 2]: the slip by `slips`. Where a plate has lifted off within a row of aligned cells nothing is carried, and
    slip is free to be anything.
    """
    w = contact.known_slip(scene)
    bound = scene.friction * contact.pressure
    size = np.hypot(rolling.q[:, 0], rolling.q[:, 1])
    speed = np.hypot(s[:, 0], s[:, 1])
    largest = float(np.hypot(w[:, 0], w[:, 1]).max())
    slip, stick = rolling.slip & contact.carrying, ~rolling.slip & contact.carrying
    # slip has to point against the traction; weighted by the slip itself, whose direction means nothing where it
    # vanishes
    astray = np.hypot(*(s * size[:, None] + speed[:, None] * rolling.q).T) / np.maximum(size, 1e-300)
    excess = np.where(rolling.slip, np.abs(size - bound), np.clip(size - bound, 0.0, None))
    scale = largest if largest > 0.0 else 1.0
    return {
        "proof_stick": float(speed[stick].max(initial=0.0)) / scale,
        "proof_slip": float(astray[slip].max(initial=0.0)) / scale,
        "proof_bound": float(excess.max()) / float(bound.max()),
    }


def failures(proof: dict[str, float], scene: Scene) -> list[str]:
    """The parts of `proof` that miss their limit, in words; empty if the proof holds. NaN never passes."""
    normal = max(_ROOM * scene.tolerance.normal, _FLOOR)
    tangential = max(_ROOM * scene.tolerance.tangential, _FLOOR)
    if scene.is_coupled:
        normal = max(normal, tangential)
        if scene.discretisation == "aligned":
            normal = max(normal, 2.0 * KEPT)
    limits = {
        "proof_tension": 0.0,
        "proof_load": _FLOOR,
        "proof_gap": normal,
        "proof_penetration": normal,
        "proof_stick": tangential,
        "proof_slip": tangential,
        "proof_bound": _FLOOR,
    }
    return [
        f"{key} = {value:.3g} exceeds {limits[key]:.3g}" for key, value in proof.items() if not value <= limits[key]
    ]
