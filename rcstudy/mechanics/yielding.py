"""Tractions under plates, by way of cells that yield more.

Where layers bend like plates, waves of the contact's size meet far more compliance than those of a few cells. A cell
that is mistaken for stick or slip then moves all others, and Newton's method from a coarser mesh's tractions, which
have many such cells, takes far more steps or never ends. So the same contact is first solved on bodies on which lies a
foundation of independent springs, which adds to the displacement of each cell by its own traction and to no other
(Kalker 1990, section 3, calls what is left in the limit the simplified theory). Springs are as soft as the cells at
first, then stiffer and stiffer, and then there are none; each solution, a loose one, is the guess of the next.
"""

from __future__ import annotations

from rcstudy.mechanics.influence import Influence

LOOSE = 0.05
"""Tolerance of tractions on a foundation."""

TRIED = {False: 12, True: 36}
"""Newton steps that are tried without foundations, by whether slip is centred (`centring.py`), which takes more."""

FOUNDATIONS = 1.0, 1 / 4, 1 / 16, 1 / 64
"""Displacements that foundations add to that of a cell by its own traction, over it."""

_PLATE = 5.0  # tangential compliance to long waves over that to short ones from which on foundations are used


def bend(influence: Influence, shape: tuple[int, int]) -> bool:
    """Whether layers bend like plates under tractions, on a box of `shape` cells."""
    return influence.once(("yields", shape), lambda: influence.contrast(shape, influence.traction_responses) > _PLATE)
