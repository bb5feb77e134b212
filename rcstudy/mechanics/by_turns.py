"""Full coupling by turns alone, where Newton's method (`coupled.py`) fails: pressure and tractions one after the other.

Plates may need that. Newton's method looks at the pressures that would close what is left of the gap if the surface
outside the contact were held, and a plate held down there is stiffer by up to (size of the contact/cell)^3 (`rim.py`).
Pressures that are right to a thousandth look ten times as wrong then, and steps that close such gaps change the set
of cells in contact until it falls into pieces. In turns (Panagiotopoulos 1975) the pressure is solved with the
contact's rim eliminated, and a turn changes it by a fifth of what the last one did, as a rule.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rcstudy.mechanics.contact import NormalContact, solve_rolling
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.kernels import arrays
from rcstudy.mechanics.normal import initial_gap, solve_pressure
from rcstudy.mechanics.normal_operator import NormalSolution
from rcstudy.mechanics.numerics.mixing import Mixing
from rcstudy.mechanics.rolling import RollingSolution, within
from rcstudy.mechanics.scene import Scene, Tolerance
from rcstudy.mechanics.stopping import pressure_residual, traction_residual

_MAX_TURNS = 60
_FIRM = 0.1  # tolerances of each turn's pressure and tractions, over the scene's


@dataclass(frozen=True)
class ByTurns:
    """Pressure (in `contact`) and tractions of the last turn; `products`: of both, in all turns."""

    contact: NormalContact
    rolling: RollingSolution
    turns: int
    products: int
    converged: bool


def solve_by_turns(scene: Scene, influence: Influence, stress: np.ndarray) -> ByTurns:
    """Turns from `stress` [3, nx, ny] (MPa) of the window, qx, qy and p, until neither changes beyond its tolerance.

    Residuals are the changes in the last turn over the norms of pressure and tractions, or those of its own solutions
    if these are larger. The last turn's pressure is solved under the lift (u_z) by the tractions of the one before it:
    changes between combinations of lifts (`mixing.py`), which all others start from, prove nothing.
    """
    own = scene.tolerance
    firm = Tolerance(_FIRM * own.normal, _FIRM * own.tangential)
    gap = initial_gap(scene)
    contact = NormalContact(scene, influence, NormalSolution(stress[2], 0.0, np.inf, 0, 0, converged=False))
    lift = contact.lift_around(np.ascontiguousarray(contact.gather(stress[:2]).T))
    mixing = Mixing()
    plain = True  # whether the lift is that by the last turn's tractions
    turn = products = 0
    while True:
        contact, rolling = one_turn(scene, influence, gap + lift, stress, firm)
        turn += 1
        products += contact.solution.products + rolling.products
        last, stress = stress, stresses(contact, rolling.q)
        solution = replace(contact.solution, residual=max(contact.solution.residual, _change(last[2:], stress[2:])))
        rolling.residual = max(rolling.residual, _change(last[:2], stress[:2]))
        small = _over_permitted(own, solution, rolling) <= 1.0
        solved = solution.converged and rolling.converged and not solution.edge
        if (plain and small) or not solved or turn == _MAX_TURNS:
            converged = solved and plain and small
            return ByTurns(NormalContact(scene, influence, solution), rolling, turn, products, converged)
        change = contact.lift_around(rolling.q) - lift
        mixed = mixing.following(lift, change, solution.p > 0.0)
        plain = small
        lift = lift + change if plain else mixed


def one_turn(
    scene: Scene, influence: Influence, gap: np.ndarray, stress: np.ndarray, tolerance: Tolerance
) -> tuple[NormalContact, RollingSolution]:
    """Pressure under `gap` [nx, ny] (mm), then tractions under that, both to `tolerance` in place of the scene's.

    They start from `stress` [3, nx, ny] (MPa) of the window, qx, qy and p.
    """
    own = replace(scene, tolerance=tolerance)
    contact = NormalContact(scene, influence, solve_pressure(own, influence, gap, stress[2]))
    q = np.ascontiguousarray(contact.gather(stress[:2]).T)
    return contact, solve_rolling(contact, own, within(q, scene.friction * contact.pressure))


def stresses(contact: NormalContact, q: np.ndarray) -> np.ndarray:
    """Stresses [3, nx, ny] (MPa) of the window: tractions `q` [m, 2] and the pressure of `contact`."""
    return contact.spread(np.stack([*q.T, contact.pressure]))


def _change(before: np.ndarray, after: np.ndarray) -> float:
    """Norm of the change from stresses `before` to those `after`, [k, nx, ny] (MPa), over the latter's; 0 for none."""
    change, size = (arrays.norm2(stress.reshape(len(stress), -1)) for stress in (after - before, after))
    return change / size if size > 0.0 else 0.0


def _over_permitted(own: Tolerance, solution: NormalSolution, rolling: RollingSolution) -> float:
    """The larger of the two residuals, each over the value at which to stop for the tolerances `own`."""
    cells = len(rolling.q)
    normal = pressure_residual(own.normal, solution.attainable, cells)
    return max(solution.residual / normal, rolling.residual / traction_residual(own.tangential, cells))
