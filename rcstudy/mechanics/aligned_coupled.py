"""Full coupling on aligned cells: pressure and tractions consistent with each other, tractions being on aligned rows.

`coupled.py` solves pressure and tractions together on the mesh's own cells (not aligned). Its tractions have errors of
first order in the cell size, which affect the pressure and are visible in moments. Its solution therefore serves as the
start of a fixed-point iteration. One turn of it solves the pressure under the lift (u_z due to the last tractions),
then the tractions on rows aligned with that pressure. At ordinary friction each turn reduces the error by a factor of
five to ten. Turns go on until the gap under pressure is closed, with the last tractions, to `_OF_TOLERANCE` times the
tolerance, and to `_ENOUGH` at least, when moments are within 0.005 % of the fixed point and largest tractions within
0.02 %. After a single turn these are 0.16 and 0.4 %, on fine meshes more than the discretisation error. As only the
last turns have to be accurate, they start from the solution on the coarser mesh: it is as good a start as that on the
mesh's own cells and costs much less.

At high friction turns gain less. Plain substitution may converge slowly or oscillate, so each turn starts from a
combination of the last ones (`mixing.py`). It may also alternate for ever between two sets of cells in contact, as the
rows move with them. The positions of the rows are therefore frozen after `_MOVING` turns, once these come near. The
pressure on the frozen rows then depends linearly on that of the mesh's own cells. A border cell may still alternate
between two states: where a turn gains next to nothing, `LARGEST_ERROR` suffices. If turns from the coarser mesh's
solution do not settle, they start again from that on the mesh's own cells. If they do not settle then, the nearer end
of both is kept, and the proof reports it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.cascade import coarser_scene, coarser_tolerance
from rcstudy.mechanics.contact import NormalContact, influence_of, solve_rolling
from rcstudy.mechanics.coupled import from_coarser, solve_coupled
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.normal import initial_gap, solve_pressure
from rcstudy.mechanics.numerics.mixing import Mixing
from rcstudy.mechanics.rolling import RollingSolution
from rcstudy.mechanics.scene import Scene, Tolerance

# The error of a turn is the range (largest less smallest value), over the cells in contact, of the change of the lift,
# divided by the approach: the gap that the new tractions open under pressure.
_START = 1e-4  # tolerance of pressure and tractions on the mesh's own cells
_FIRST = 1e-2  # tolerance of the first tractions on aligned cells
_MAX_TURNS = 50  # most turns, from either start
_MOVING = 5  # turns after which the positions of the rows are frozen, as soon as the error is at most
_NEAR = 0.2  # or after
_LONGEST = 10  # turns, whatever the error
_ENOUGH = 2e-5  # error at which turns end, or lower:
_OF_TOLERANCE = 0.5  # times the larger tolerance, so that the tractions keep it
_GAIN = 0.4  # usual ratio of successive errors, which predicts the last turn
_LITTLE = 0.9  # if that ratio is larger, `LARGEST_ERROR` suffices
_TURN = 0.2  # tolerance of pressure and tractions in all turns but the last, over the error
_SLOW_TURN = 1e-2  # the same if turns gain less than usual: mixing takes errors of solutions for changes
LARGEST_ERROR = 5e-4  # largest error that a solution may keep


@dataclass
class _State:
    """State of the iteration: pressure under `lift` ([nx, ny] of the window, mm), tractions under that pressure."""

    contact: AlignedContact
    rolling: RollingSolution
    lift: np.ndarray

    def change_of_lift(self) -> np.ndarray:
        """What the tractions make of the lift, less `lift`, on the box around the contact (elsewhere: no lift)."""
        return self.contact.lift_around(self.rolling.q) - self.lift

    def error(self, change: np.ndarray) -> float:
        """Range of the `change` of the lift over the cells in contact, over the approach."""
        touched = self.contact.solution.p > 0.0
        return float(np.ptp(change[touched])) / max(abs(self.contact.solution.approach), 1e-300)


class _End(NamedTuple):
    """Where turns ended, and the error that is left: 0 if they settled.

    Tractions are None, the error infinite, if the pressure has no solution.
    """

    contact: NormalContact
    rolling: RollingSolution | None
    error: float


def solve_aligned_coupled(scene: Scene) -> tuple[NormalContact, RollingSolution | None]:
    """Pressure and tractions of `scene` under full coupling, on aligned cells.

    Tractions are None if the pressure has no solution within the window or to its tolerance: see the `solution` of the
    returned contact.
    """
    scene = replace(scene, spin_point=0.0)  # of the starts alone, which are not aligned
    influence = influence_of(scene)
    begun = _from_coarser_mesh(scene, influence)
    first = _turns(scene, influence, begun) if begun is not None else None
    if first is not None and first.error == 0.0:
        return first.contact, first.rolling
    own = _from_own_cells(scene, influence)
    again = _End(own, None, np.inf) if isinstance(own, NormalContact) else _turns(scene, influence, own)
    if first is None:
        return again.contact, again.rolling
    nearer, other = sorted((again, first), key=lambda end: end.error)
    if nearer.rolling is None or other.rolling is None:
        return nearer.contact, nearer.rolling
    return nearer.contact, nearer.rolling.after(other.rolling)


def _from_coarser_mesh(scene: Scene, influence: Influence) -> _State | None:
    """First state, under the lift by the coarser mesh's (unaligned) tractions; None if there is no such solution."""
    if coarser_scene(scene) is None:
        return None
    start, q, coarse = from_coarser(scene, influence)
    if coarse is None or start.coarser is None or not (start.coarser.solution.converged and coarse.converged):
        return None
    lift = start.lift_around(q)
    pressure = solve_pressure(scene, influence, initial_gap(scene) + lift, start.solution.p)
    if pressure.edge or not pressure.converged:
        return None
    contact = AlignedContact(NormalContact(scene, influence, pressure, coarser=start.coarser))
    first = solve_rolling(contact, scene, tolerance=max(scene.tolerance.tangential, _FIRST))
    if first.coarser is not None:
        first.coarser = first.coarser.after(coarse)  # counts the products of the coupled coarse solution as well
    return _State(contact, first, lift)


def _from_own_cells(scene: Scene, influence: Influence) -> _State | NormalContact:
    """First state, under the pressure of the coupled solution on the mesh's own (unaligned) cells.

    Returns the contact alone if that pressure has no solution.
    """
    own = scene.tolerance
    loosened = replace(scene, tolerance=Tolerance(max(own.normal, _START), max(own.tangential, _START)))
    start, rolling = solve_coupled(loosened, influence)
    if start.solution.edge or not start.solution.converged:
        return NormalContact(scene, influence, start.solution)
    contact = AlignedContact(start)
    # the coarser mesh's tractions are needed for the error bars; those on the mesh's own cells are the better guess
    coarse: RollingSolution | None = None
    if contact.coarser is not None:
        coarse = solve_rolling(contact.coarser, scene, tolerance=coarser_tolerance(own).tangential)
    guess = _carried_over(start, rolling.q, contact)
    first = solve_rolling(contact, scene, guess, max(own.tangential, _FIRST))
    return _State(contact, first.after(replace(rolling, coarser=coarse)), np.zeros(scene.mesh.cells))


def _turns(scene: Scene, influence: Influence, state: _State) -> _End:
    """Turns from `state` to their end."""
    own = scene.tolerance
    enough = min(_ENOUGH, _OF_TOLERANCE * max(own.normal, own.tangential))
    began_without = not state.lift.any()
    mixing, error, tolerance = Mixing(), np.inf, own
    resting: AlignedContact | None = None  # contact whose row positions are kept
    for turn in range(_MAX_TURNS + 1):
        change = state.change_of_lift()
        before, error = error, state.error(change)
        settled = turn > 0 and error <= (enough if error < _LITTLE * before else LARGEST_ERROR)
        if settled and tolerance == own:
            return _End(state.contact, state.rolling, 0.0)
        if turn == _MAX_TURNS:
            break
        last = settled or turn == _MAX_TURNS - 1 or _GAIN * error <= enough
        tolerance = own if last else _loosened(own, error, before)
        lift = mixing.following(state.lift, change, state.contact.solution.p > 0.0)
        rests = resting is None and ((turn >= _MOVING and error <= _NEAR) or turn == _LONGEST)
        if rests:
            resting = state.contact
        # changes up to now mislead: rows moved in them, or that from no lift to the whole is one
        if rests or (turn == 0 and began_without):
            mixing.forget()
        following = _following(scene, influence, state, lift, tolerance, resting)
        if isinstance(following, NormalContact):
            return _End(following, None, np.inf)
        state = following
    return _End(state.contact, state.rolling, error)


def _loosened(own: Tolerance, error: float, before: float) -> Tolerance:
    """Tolerance of a turn that is not the last one, after turns with these errors, the last one and that `before`."""
    loose = min(_FIRST, (_TURN if error < _GAIN * before else _SLOW_TURN) * error)
    return Tolerance(max(own.normal, loose), max(own.tangential, loose))


def _following(
    scene: Scene,
    influence: Influence,
    state: _State,
    lift: np.ndarray,
    tolerance: Tolerance,
    resting: AlignedContact | None,
) -> _State | NormalContact:
    """The state after a turn under `lift`, to this `tolerance`; the contact alone if its pressure has no solution.

    Rows are where those of `resting` are, if given.
    """
    gap = initial_gap(scene) + lift
    pressure = solve_pressure(replace(scene, tolerance=tolerance), influence, gap, state.contact.solution.p)
    pressure = pressure.after(state.contact.solution)
    normal = NormalContact(scene, influence, pressure)
    if pressure.edge or not pressure.converged:
        return normal
    contact = AlignedContact(normal, state.contact.coarser, resting)
    guess = _carried_over(state.contact, state.rolling.q, contact)
    rolling = solve_rolling(contact, scene, guess, tolerance.tangential).after(state.rolling)
    return _State(contact, rolling, lift)


def _carried_over(contact: NormalContact, q: np.ndarray, other: AlignedContact) -> np.ndarray:
    """First guess [m, 2] (MPa) on the cells of `other`: the same fractions of the bound as `q` [m, 2] on `contact`."""
    fractions = q.T / contact.pressure
    return np.ascontiguousarray((other.gather(contact.spread(fractions)) * other.pressure).T)
