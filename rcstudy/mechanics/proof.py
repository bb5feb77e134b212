"""The proof stored with every solution: residuals of the contact conditions, computed independently of the solvers.

The conditions are the paper's Eqs 1, 4 and 6 and that slip is opposite to the traction (Kalker 1990).
Displacements come from the influence coefficients by separate convolutions (displacements first, then differences; a
larger box for the gap), not from the operators and residuals of the solvers. Stick and slip cells are those of the
solution, and each is checked for its own condition. On aligned cells the proof also takes from the solution the
positions of the rows, the pressure on them, the corrections of slip in leading cells, and the frozen corrections of
slip of a few cells (`centring.py`).
"""

from __future__ import annotations

import numpy as np

from rcstudy.mechanics.aligned_coupled import LARGEST_ERROR
from rcstudy.mechanics.centring import slip_at_centres
from rcstudy.mechanics.contact import NormalContact
from rcstudy.mechanics.convolution import ZZ, convolve, padded_around, symbols
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.normal import initial_gap
from rcstudy.mechanics.rolling import RollingSolution
from rcstudy.mechanics.scene import Scene

# Limits of numbers that depend on a tolerance: _FACTOR times that, but at least _FLOOR and at most _CEILING. Tolerances
# bound mean errors; the proof takes the worst cell, hence the large factor. Without a ceiling it would prove nothing at
# tolerances of a hundredth and more: with no tractions at all slip in stick cells is 1, as is the gap with no pressure.
_FACTOR = 100.0
_FLOOR, _CEILING = 1e-9, 0.1


def prove_normal(contact: NormalContact, scene: Scene, q: np.ndarray | None = None) -> dict[str, float]:
    """Tension, load imbalance, gap under pressure and overlap outside the contact (keys of `result.VARIABLES`).

    How far the paper's Eqs 1 and 4 are missed. Tension is relative to the largest pressure, the imbalance to the load,
    gap and overlap to the approach. The gap h + u_z - approach is computed on the contact's box widened by half its
    size on each side; farther out h grows and u_z falls. `q` [m, 2]: tractions (MPa) whose u_z is added, with
    `coupling: full`.
    """
    dx, dy = scene.mesh.spacing
    size = contact.touched.shape
    box = contact.box.grown(size[0] // 2 + 2, size[1] // 2 + 2, scene.mesh.cells)
    p = contact.solution.p[box.slices]
    padded = padded_around(contact.touched, box)
    gap = initial_gap(scene)[box.slices] - contact.solution.approach
    gap += convolve(_gap_by_pressure(contact.influence, padded), padded, p)
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


def _gap_by_pressure(influence: Influence, padded: tuple[int, int]) -> np.ndarray:
    """Symbol [py//2+1, px] of the normal displacement due to pressure, made once for these coefficients."""

    def made() -> np.ndarray:
        return symbols([(influence.around(padded)[ZZ], (1, 1))], padded)[0]

    return influence.once(("gap", padded), made)


def slips(contact: NormalContact, scene: Scene, rolling: RollingSolution) -> np.ndarray:
    """Slip [m, 2] under the tractions of `rolling`, by differences of displacements. These are the stored slips.

    With `discretisation: aligned` the slip of slip cells is that at their centres. Raises ValueError without creepage.
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
    if contact.neighbours is None:
        return result
    local = contact.local_slip(scene.friction)
    return slip_at_centres(result, rolling.slip, contact.neighbours, local, rolling.frozen_correction)


def prove_rolling(contact: NormalContact, scene: Scene, rolling: RollingSolution, s: np.ndarray) -> dict[str, float]:
    """Errors of slip in stick cells, of its direction in slip cells, and of the bound (keys of `result.VARIABLES`).

    How far the paper's Eq. 6 is missed, and the direction that it leaves open (Kalker 1990). The first two are relative
    to the largest slip without tractions, the last to the largest bound. `s` [m, 2]: the slip by `slips`. Cells of
    aligned rows from which a plate has lifted off carry nothing, and their slip is arbitrary.
    """
    w = contact.known_slip(scene)
    bound = scene.friction * contact.pressure
    size = np.hypot(rolling.q[:, 0], rolling.q[:, 1])
    speed = np.hypot(s[:, 0], s[:, 1])
    largest = float(np.hypot(w[:, 0], w[:, 1]).max())
    slip, stick = rolling.slip & contact.carrying, ~rolling.slip & contact.carrying
    # |s + |s| q/|q||: zero if slip points against the traction; proportional to the slip, as the direction of a
    # vanishing slip is undefined
    astray = np.hypot(*(s * size[:, None] + speed[:, None] * rolling.q).T) / np.maximum(size, 1e-300)
    excess = np.where(rolling.slip, np.abs(size - bound), np.clip(size - bound, 0.0, None))
    scale = largest if largest > 0.0 else 1.0
    return {
        "proof_stick": float(speed[stick].max(initial=0.0)) / scale,
        "proof_slip": float(astray[slip].max(initial=0.0)) / scale,
        "proof_bound": float(excess.max()) / float(bound.max()),
    }


def failures(proof: dict[str, float], scene: Scene) -> list[str]:
    """One sentence for each number of `proof` beyond its limit; empty if the proof holds. NaN never passes."""
    normal, tangential = (
        min(max(_FACTOR * tolerance, _FLOOR), _CEILING)
        for tolerance in (scene.tolerance.normal, scene.tolerance.tangential)
    )
    if scene.is_coupled:
        normal = max(normal, tangential)
        if scene.discretisation == "aligned":
            normal = max(normal, 2.0 * LARGEST_ERROR)
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
