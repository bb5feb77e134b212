"""Full coupling on aligned cells: the pressure that belongs to tractions on rows that begin where the contact begins.

`coupled.py` finds pressure and tractions together on cells as they are. Their tractions have errors of first order in
the cells' size, and what these do to the pressure shows in moments. So that is only the start: under the lift by its
tractions the pressure is solved, then the tractions on rows aligned with it, and again under the lift by these. With
friction of ordinary size each such turn leaves a fifth to a tenth of what was off before. They go on until the last
tractions leave the gap closed to `_ENOUGH`: moments are then within 0.005 % of the fixed point, largest tractions
within 0.02 % (after one turn, 0.16 and 0.4 %, on fine meshes more than the cells' own errors). As nothing before the
last step need be exact, the coarser mesh's solution is as good a start as that on the mesh's own cells, for much less.

Where friction is high a turn gains less, and `KEPT` is enough. Each turn starts from a mixture of the last ones
(`mixing.py`), as they may creep or swing there. From one set of cells in contact to another, and back, they may swing
for good: rows jump. So after `_MOVING` turns rows stay where they are, while pressure and tractions go on, the one on
the rows linear in the one on the mesh's own cells. What does not settle from the coarser mesh's solution is restarted
from that on the mesh's own cells; what does not settle then either, the proof finds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.cascade import coarser_scene, coarser_tolerance
from rcstudy.mechanics.contact import NormalContact, influence_of, solve_rolling
from rcstudy.mechanics.coupled import from_coarser, solve_coupled
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.mixing import Mixing
from rcstudy.mechanics.normal import initial_gap, solve_pressure
from rcstudy.mechanics.rolling import RollingSolution
from rcstudy.mechanics.scene import Scene, Tolerance

_START = 1e-4  # tolerance of pressure and tractions on cells as they are
_FIRST = 1e-2  # tolerance of the first tractions on aligned cells
_MAX_TURNS = 50  # turns at most, from the mesh's own cells
_TRIED = 12  # turns at most, from the coarser mesh's solution
_MOVING = 5  # turns after which rows stay where they are
_ENOUGH = 2e-5  # what the tractions' own lift leaves of gaps under pressure, over the approach, when turns end
_GAIN = 0.4  # part of that which a turn leaves of it, as a rule; where it leaves more, `KEPT` has to do
_TURN = 1e-2  # how far tractions of a turn that is not the last are solved, over what is left
KEPT = 5e-4  # what a solution may leave
_ROOM = 8  # part of the contact's box that the lift is found for on each side of it: it may grow


@dataclass
class _State:
    """Where turns stand: the pressure under `lift` (mm, [nx, ny] of the window), and tractions under that pressure."""

    contact: AlignedContact
    rolling: RollingSolution
    lift: np.ndarray


def solve_aligned_coupled(scene: Scene) -> tuple[NormalContact, RollingSolution | None]:
    """Pressure and tractions of `scene` on aligned cells.

    No tractions if the pressure has no solution within the window or to its tolerance: see `contact.solution`.
    """
    influence = influence_of(scene)
    spent: RollingSolution | None = None
    begun = _from_coarser_mesh(scene, influence)
    if begun is not None:
        contact, rolling, settled = _turns(scene, influence, begun, _TRIED)
        if rolling is not None and settled:
            return contact, rolling
        spent = rolling
    own = _from_own_cells(scene, influence)
    if isinstance(own, NormalContact):
        return own, None
    contact, rolling, _ = _turns(scene, influence, own, _MAX_TURNS)
    return contact, rolling.after(spent) if rolling is not None and spent is not None else rolling


def _from_coarser_mesh(scene: Scene, influence: Influence) -> _State | None:
    """The first tractions, under the lift by those of the coarser mesh's cells as they are; None without a solution."""
    if coarser_scene(scene) is None:
        return None
    start, q, coarse = from_coarser(scene, influence)
    if coarse is None or start.coarser is None or not (start.coarser.solution.converged and coarse.converged):
        return None
    gap = initial_gap(scene)
    lift = np.zeros(gap.shape)
    box = start.box.wider(_ROOM, scene.mesh.cells)
    lift[box.slices] = start.lift(q, box)
    pressure = solve_pressure(scene, influence, gap + lift, start.solution.p)
    if pressure.edge or not pressure.converged:
        return None
    contact = AlignedContact(NormalContact(scene, influence, pressure, coarser=start.coarser))
    first = solve_rolling(contact, scene, tolerance=max(scene.tolerance.tangential, _FIRST))
    if first.coarser is not None:
        first.coarser = first.coarser.after(coarse)  # its products count, too
    return _State(contact, first, lift)


def _from_own_cells(scene: Scene, influence: Influence) -> _State | NormalContact:
    """The first tractions, under the pressure that belongs to those on the mesh's cells as they are.

    The contact alone if that has no solution.
    """
    own = scene.tolerance
    loosened = replace(scene, tolerance=Tolerance(max(own.normal, _START), max(own.tangential, _START)))
    start, rolling = solve_coupled(loosened, influence)
    if start.solution.edge or not start.solution.converged:
        return NormalContact(scene, influence, start.solution)
    contact = AlignedContact(start)
    # the coarser mesh's tractions are for the error bars; those on the mesh's own cells are a better guess
    coarse: RollingSolution | None = None
    if contact.coarser is not None:
        coarse = solve_rolling(contact.coarser, scene, tolerance=coarser_tolerance(own).tangential)
    guess = _carried_over(start, rolling.q, contact)
    first = solve_rolling(contact, scene, guess, max(own.tangential, _FIRST))
    return _State(contact, first.after(replace(rolling, coarser=coarse)), np.zeros(scene.mesh.cells))


def _turns(
    scene: Scene, influence: Influence, state: _State, most: int
) -> tuple[NormalContact, RollingSolution | None, bool]:
    """Turns of pressure and tractions from `state` on; whether they have settled. No tractions without a pressure."""
    contact, rolling, lift = state.contact, state.rolling, state.lift
    own, gap = scene.tolerance, initial_gap(scene)
    began_without = not lift.any()
    mixing, error, settled = Mixing(), np.inf, False
    resting: AlignedContact | None = None  # whose rows the others' take
    for turn in range(most):
        box = contact.box.wider(_ROOM, scene.mesh.cells)
        change = -lift
        change[box.slices] += contact.lift(rolling.q, box)
        touched = contact.solution.p > 0.0
        before, error = error, float(np.ptp(change[touched])) / max(abs(contact.solution.approach), 1e-300)
        settled = turn > 0 and error <= (_ENOUGH if error < _GAIN * before else KEPT)
        if settled:
            break
        if (turn == 1 and began_without) or turn == _MOVING + 1:  # the first change is from none to all
            mixing.forget()
        lift = mixing.following(lift, change, touched)
        pressure = solve_pressure(scene, influence, gap + lift, contact.solution.p).after(contact.solution)
        if pressure.edge or not pressure.converged:
            return NormalContact(scene, influence, pressure), None, False
        if turn == _MOVING:
            resting = contact
        following = AlignedContact(NormalContact(scene, influence, pressure), contact.coarser, resting)
        last_turn = _GAIN * error <= _ENOUGH
        tolerance = own.tangential if last_turn else max(own.tangential, min(_FIRST, _TURN * error))
        guess = _carried_over(contact, rolling.q, following)
        rolling = solve_rolling(following, scene, guess, tolerance).after(rolling)
        contact = following
    if rolling.converged and rolling.residual > own.tangential:  # turns ended sooner than was to be expected
        rolling = solve_rolling(contact, scene, rolling.q).after(rolling)
    return contact, rolling, settled


def _carried_over(contact: NormalContact, q: np.ndarray, other: AlignedContact) -> np.ndarray:
    """Tractions [m, 2] (MPa) to start from on the cells of `other`: the same fractions of the bound as `q`."""
    fractions = q.T / contact.pressure
    return np.ascontiguousarray((other.gather(contact.spread(fractions)) * other.pressure).T)
