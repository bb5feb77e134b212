"""Errors of a solution that the differences between its meshes do not show, for the error bars (`estimate.py`)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rcstudy.mechanics.missed import Missed
from rcstudy.mechanics.subcell.unseen import Unseen

_CLOSE = 5  # square of a distance in cells: two cells away and one aside


class Hidden(NamedTuple):
    """Errors that differences between meshes do not show.

    With `kalker` `unsettled`, `by_layers`, `slip`, `skin`, `edge_of_tractions` and `moved_inwards` are 0, with
    `aligned` `moved` and `lost_power` are.
    """

    # deviation of the tractions from Coulomb's law over their bounds (`RollingSolution`)
    unsettled: float = 0.0
    # compliance to pressure over that to tractions, at waves of the contact's size: 1 on half-spaces, more under plates
    stiffer_across: float = 1.0
    # area that layers too thin for the cells add to the contact (negative: take from it), over the contact's
    # (`AlignedContact.area_by_layers`)
    by_layers: float = 0.0
    # area between edges as layers move them and those that cells of `kalker` see, over the contact's
    # (`NormalContact.moved_edge`)
    moved: float = 0.0
    # how far the layers respond like an incompressible film, 0 to 1 (`Influence.squeezed`)
    squeezed: float = 0.0
    # effect of slip zones too narrow for the cells (`subcell/unseen.py`)
    slip: Unseen = Unseen()
    # lift of the surface by tractions over the approach (full coupling)
    lift: float = 0.0
    # difference of the largest pressure corrected for layers from that corrected as on half-spaces, over that pressure
    peak_by_layers: float = 0.0
    # by which fraction of themselves cusps change the largest pressure and the largest traction, or would
    # (`subcell/cusps.py`; full coupling)
    cusp_of_pressure: float = 0.0
    cusp_of_traction: float = 0.0
    # smallest slip of all cells over the largest, 1 where it is not known
    least_slip: float = 1.0
    # fraction by which the largest pressure may be too small under stiff skins, and by which it exceeds those farther
    # in, if it is in the outermost cells (`mechanics/plates.py`)
    at_rim: float = 0.0
    beyond_rim: float = 0.0
    # friction times Dundurs' constant, its magnitude (full coupling)
    pull: float = 0.0
    # friction times that of what yields under a stiff skin, times how much more it does (`Influence.pull_under_skin`;
    # full coupling)
    pull_under_skin: float = 0.0
    # largest slip of a cell (-)
    largest_slip: float = 0.0
    # whether any cell slips, and whether one of the largest pressure does
    slip_shown: bool = True
    slips_at_top: bool = True
    # largest traction (MPa) of a cell
    largest_of_cells: float = math.inf
    # slip (-) that the largest pressure causes on the spot (`Influence.most_slip_under_pressure`)
    by_pressure: float = 0.0
    # magnitude of Dundurs' constant over pi times friction
    turning: float = 0.0
    # difference of Dundurs' constant (-) on a scale below that of a cell beside the edge, and that scale (mm)
    # (`Influence.skin_at_edge`)
    skin: tuple[float, float] = (0.0, 0.0)
    # fraction by which the largest pressure may rise at the pole of spin (`subcell/pole.py`; full coupling)
    at_pole: float = 0.0
    # whether the cell of the largest pressure is within two cells of the border of the stick zone (`close_to_border`;
    # full coupling)
    top_at_border: bool = False
    # what cells miss of the bodies' responses (`mechanics/missed.py`)
    missed: Missed = Missed()
    # by how much pressures may rise at borders of stick within a skin thinner than a cell, over mu p0
    # (`Influence.cusp_in_skin`), times friction, and the largest pressure at such a border over the largest one (full
    # coupling)
    cusp_in_skin: float = 0.0
    at_borders: float = 0.0
    # how far within the edge tractions begin under skins, over the contact's radius
    # (`AlignedContact.edge_of_tractions`)
    edge_of_tractions: float = 0.0
    # second moments of the pressure that rows lack, over load times the radius squared (`AlignedContact.moved_inwards`)
    moved_inwards: float = 0.0
    # power (N) that the friction power lacks in its balance with those of creepages and of slip by pressure
    # (`RollingSolution.power_in_balance`)
    lost_power: float = 0.0

    def beyond_largest(self, rise: float) -> float:
        """By which fraction the pressure at borders of stick, with this relative `rise`, exceeds the largest one."""
        return max(self.at_borders * (1.0 + rise) - 1.0, 0.0)


def least_over_largest(slip: np.ndarray) -> float:
    """The smallest magnitude of slips [m, 2] over the largest; 1 if all of them are zero."""
    sizes = np.hypot(slip[:, 0], slip[:, 1])
    return float(sizes.min() / sizes.max()) if sizes.any() else 1.0


def close_to_border(cells: np.ndarray, pressure: np.ndarray, slip: np.ndarray) -> bool:
    """Whether the cell of the largest pressure is within two cells of one that slips, if it sticks, or the reverse.

    `cells` [m, 2]: their indices; `pressure` [m] (MPa); `slip` [m]: flags of those that slip.
    """
    top = int(np.argmax(pressure))
    across = cells[slip != slip[top]] - cells[top]
    return bool(len(across)) and int((across**2).sum(axis=1).min()) <= _CLOSE
