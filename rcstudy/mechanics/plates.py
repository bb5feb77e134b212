"""Errors of the largest pressure where it is in the contact's outermost cells.

**Too small.** A skin (outer layers) much stiffer than what is below bends like a plate and takes its load along the
contact's rim: by plate theory a force per unit length, which the skin itself spreads over about its own thickness h.
Cells longer than h spread it over their own length, so that the largest pressure is too small by a factor of up to
dx/h. Meshes too coarse to have their largest pressure at the rim agree with each other on a wrong value. In a smooth
contact, where the pressure ends like a root, rim cells carry up to `_SMOOTH` of those behind them; what exceeds it
counts as that force.

The constants are fitted to 918 random contacts with layers stiffer than what is below, in some twenty of which the
effect matters, against cells four times finer. These do not resolve all of it either: hence `_MOST`.

Rims are steep for other reasons, too. But a skin of modulus E and thickness h on a body of modulus E', bent to the
counterbody's curvature 1/R in a contact of radius a, bears a force E h^3/(12 R l) along the rim, with the length
l = h (E/3 E')^(1/3) over which it bends back: spread over h, 0.4 (h/a) (E/3 E')^(2/3) of Hertz's largest pressure. (In
3457 random contacts under skins of 2e-4 to 0.5 a, up to 2000 times as stiff, largest pressures under single ones were
short of finer cells' by at most 1.6 (h/a) (E/3 E')^(2/3) of themselves: hence `_BY_PLATE`.)

**Too large.** Where pressure rises to its largest value within one or two cells of the edge, that value depends on how
these cells lie along the edge, in about the same way on all meshes. Under skins 1 to 3 cells thick it is 2 to 14 % too
large; with full coupling, where friction times Dundurs' constant exceeds about 1.5 and pressure rises steeply at the
trailing edge, up to two fifths. How far it exceeds the pressure two cells farther in tells how much.
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import mul

import numpy as np

from rcstudy.mechanics.scene import Layer, Material

_SMOOTH = 0.7
_LOSS = 1.3  # factor on the force found: even cells no longer than the skin's thickness lose some of it
_WITHIN_TWO = np.add.outer(*2 * [abs(np.arange(-2, 3))]) <= 2  # cells that are no more than two steps away
_MOST = 8.0  # largest length of a cell over the skin's thickness that is allowed for
_BY_PLATE = 3.0  # see above


def missing_at_rim(p: np.ndarray, layers: Sequence[Layer], substrate: Material, side: float) -> float:
    """Fraction of itself by which the largest of pressures `p` [nx, ny] (MPa) may be too small; 0 without a stiff skin.

    `side`: the longer side of a cell (mm).
    """
    thickness = skin(layers, substrate, side)
    if thickness == 0.0:
        return 0.0
    carrying = p > 0.0
    behind = carrying & all_around(carrying)
    second = behind & ~all_around(behind)
    rim = carrying & ~behind
    if not second.any():
        return 0.0
    most = float(p.max())
    smooth = _SMOOTH * float(p[second].max())
    beyond = float(p[rim].max()) - smooth
    spread = _LOSS * min(side / thickness, _MOST)
    return max((smooth + beyond * spread) / most - 1.0, 0.0)


def beyond_rim(p: np.ndarray) -> float:
    """Fraction of the largest of pressures `p` [nx, ny] (MPa) by which it exceeds those two cells farther in.

    0 unless that largest pressure is in the outermost two rings of cells. The smaller one of the largest pressures in
    the third and the fourth ring counts; that in the third one if there is no fourth.
    """
    i, j = divmod(int(p.argmax()), p.shape[1])
    around = p[max(i - 2, 0) : i + 3, max(j - 2, 0) : j + 3]
    if around.shape == _WITHIN_TWO.shape and around[_WITHIN_TWO].min() > 0.0:
        return 0.0
    inside = p > 0.0
    largest = []
    for _ in range(4):
        within = all_around(inside)
        largest.append(float(p[inside & ~within].max(initial=0.0)))
        inside = within
    third, fourth = largest[2:]
    return 1.0 - min(third, fourth or third) / max(largest) if third > 0.0 else 0.0


def skin(layers: Sequence[Layer], substrate: Material, side: float) -> float:
    """Depth (mm) to the bottom of a stiff skin, at most `side`; 0 where no layer is stiffer than what is below it.

    Of several interfaces below which the material is softer it is a mean depth, weighted with the bending stiffness
    that ends there: the step of E times the cube of the depth. It thus does not depend on how finely a coating is
    divided into layers.
    """
    return _mean(*_bending(layers, substrate, side))


def most_by_plate(layers: Sequence[Layer], substrate: Material, radius: float) -> float:
    """Largest fraction of itself by which cells may have the largest pressure too small for want of a plate's force.

    `radius`: of the contact, the shorter one (mm). 0 without a stiff skin. What is softest below the skin counts.
    """
    depths, weights = _bending(layers, substrate, radius)
    depth = _mean(depths, weights)
    if depth == 0.0:
        return 0.0
    top = next(i for i, weight in enumerate(weights) if weight > 0.0)
    softest = min(below.E for below in (*layers, substrate)[top + 1 :])
    return _BY_PLATE * depth / radius * (sum(weights) / (3.0 * softest * depth**3)) ** (2.0 / 3.0)


def _bending(layers: Sequence[Layer], substrate: Material, most: float) -> tuple[list[float], list[float]]:
    """Depths (mm) of the interfaces, at most `most`, and the bending stiffness (N mm) that ends at each of them."""
    depths, weights, depth = [], [], 0.0
    for layer, below in zip(layers, (*layers, substrate)[1:], strict=True):
        depth += layer.thickness
        depths.append(min(depth, most))
        weights.append(max(layer.E - below.E, 0.0) * depths[-1] ** 3)
    return depths, weights


def _mean(depths: Sequence[float], weights: Sequence[float]) -> float:
    """The mean of `depths` by `weights`, 0 without weights."""
    total = sum(weights)
    return sum(map(mul, depths, weights)) / total if total > 0.0 else 0.0


def all_around(flags: np.ndarray) -> np.ndarray:
    """Flags [nx, ny] of cells whose four neighbours are flagged; false in the outermost cells, which have fewer."""
    within = np.zeros_like(flags)
    within[1:-1, 1:-1] = flags[2:, 1:-1] & flags[:-2, 1:-1] & flags[1:-1, 2:] & flags[1:-1, :-2]
    return within
