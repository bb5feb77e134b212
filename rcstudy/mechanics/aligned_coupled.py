"""Full coupling on aligned cells: the pressure that belongs to tractions on rows that begin where the contact begins.

`coupled.py` finds pressure and tractions together on cells as they are. Their tractions have errors of first order in
the cells' size, and what these do to the pressure shows in moments. So its pressure is only the start: tractions on the
rows aligned with it lift the surface, under that lift the pressure is solved once more, and then the tractions. With
friction of ordinary size each such turn leaves a tenth of what was off before. They go on until the last tractions
leave the gap closed to `_ENOUGH`: moments are then within 0.005 % of the fixed point, largest tractions within 0.02 %
(after one turn, 0.16 and 0.4 %, on fine meshes more than the cells' own errors). As nothing before the last step need
be exact, that takes little longer than the exact solution on cells as they are with tractions on aligned ones after it.

Where friction is high a turn gains less, and `KEPT` is enough. Each turn starts from a mixture of the last ones
(`mixing.py`), as they may creep or swing there. From one set of cells in contact to another, and back, they may swing
for good: rows jump. So after `_MOVING` turns rows stay where they are, while pressure and tractions go on, the one on
the rows linear in the one on the mesh's own cells. What does not settle then either, the proof finds.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.cascade import coarser_tolerance
from rcstudy.mechanics.contact import NormalContact, influence_of, solve_rolling
from rcstudy.mechanics.coupled import solve_coupled
from rcstudy.mechanics.mixing import Mixing
from rcstudy.mechanics.normal import initial_gap, solve_pressure
from rcstudy.mechanics.rolling import RollingSolution
from rcstudy.mechanics.scene import Scene, Tolerance

_START = 1e-4  # tolerance of pressure and tractions on cells as they are
_FIRST = 1e-2  # of the first tractions on aligned cells
_MAX_TURNS = 30
_MOVING = 5  # of them, in which rows go to where the contact begins
_ENOUGH = 2e-5  # what the tractions' own lift leaves of gaps under pressure, over the approach, when turns end
_GAIN = 0.4  # part of that which a turn leaves of it, as a rule; where it leaves more, `KEPT` has to do
_TURN = 1e-2  # how far tractions of a turn that is not the last are solved, over what is left
KEPT = 5e-4  # what a solution may leave


def solve_aligned_coupled(scene: Scene) -> tuple[NormalContact, RollingSolution | None]:
    """Pressure and tractions of `scene` on aligned cells.

    No tractions if the pressure has no solution within the window or to its tolerance: see `contact.solution`.
    """
    influence = influence_of(scene)
    own = scene.tolerance
    eased = replace(scene, tolerance=Tolerance(max(own.normal, _START), max(own.tangential, _START)))
    start, rolling = solve_coupled(eased, influence)
    if start.solution.edge or not start.solution.converged:
        return NormalContact(scene, influence, start.solution), None
    contact = AlignedContact(start)
    # the coarser mesh's tractions are for the error bars; those on the mesh's own cells are a better guess
    coarse: RollingSolution | None = None
    if contact.coarser is not None:
        coarse = solve_rolling(contact.coarser, scene, tolerance=coarser_tolerance(own).tangential)
    guess = _carried_over(start, rolling.q, contact)
    first = solve_rolling(contact, scene, guess, max(own.tangential, _FIRST))
    rolling = first.after(replace(rolling, coarser=coarse))
    gap = initial_gap(scene)
    lift = np.zeros(gap.shape)
    mixing, error = Mixing(), np.inf
    resting: AlignedContact | None = None  # whose rows the others' take
    for turn in range(_MAX_TURNS):
        box = contact.box.grown(contact.box.shape[0] // 8 + 2, contact.box.shape[1] // 8 + 2, scene.mesh.cells)
        change = -lift
        change[box.slices] += contact.lift(rolling.q, box)
        touched = contact.solution.p > 0.0
        before, error = error, float(np.ptp(change[touched])) / max(abs(contact.solution.approach), 1e-300)
        if turn > 0 and error <= (_ENOUGH if error < _GAIN * before else KEPT):
            break
        if turn in (1, _MOVING + 1):  # the first change is from none to all
            mixing.forget()
        lift = mixing.following(lift, change, touched)
        pressure = solve_pressure(scene, influence, gap + lift, contact.solution.p).after(contact.solution)
        if pressure.edge or not pressure.converged:
            return NormalContact(scene, influence, pressure), None
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
    return contact, rolling


def _carried_over(contact: NormalContact, q: np.ndarray, other: AlignedContact) -> np.ndarray:
    """Tractions [m, 2] (MPa) to start from on the cells of `other`: the same fractions of the bound as `q`."""
    fractions = q.T / contact.pressure
    return np.ascontiguousarray((other.gather(contact.spread(fractions)) * other.pressure).T)
