"""What a stiff skin gathers at the contact's rim, within less than a cell.

A skin much stiffer than what it lies on bends like a plate and takes its load along the contact's rim: by the theory
of plates a force per length there, which the skin itself spreads over about its own thickness h. Cells longer than h
spread it over themselves, so that the largest pressure is too small by a factor of up to dx/h, and meshes that see it
nowhere near the rim agree on a wrong one. What cells at the rim carry beyond `_SMOOTH` of what those behind them do, as
the root of a smooth contact would have it, counts as that force.

Set on 918 random contacts with layers stiffer than what is below, in some twenty of which it matters, against cells
four times finer, which do not resolve all of it either: hence `_MOST`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rcstudy.mechanics.scene import Layer, Material

_SMOOTH = 0.7
_SHORT = 1.3  # times what is found: even cells no longer than the skin is thick round some of it off
_MOST = 8.0  # cells' length over the skin's thickness


def missing_at_rim(p: np.ndarray, layers: Sequence[Layer], substrate: Material, side: float) -> float:
    """By what part of itself the largest of pressures `p` [nx, ny] (MPa) may be too small, or 0 without stiff skins.

    `side`: the shorter side of a cell (mm).
    """
    thickness = skin(layers, substrate, side)
    if thickness == 0.0:
        return 0.0
    carrying = p > 0.0
    behind = carrying & _all_around(carrying)
    second = behind & ~_all_around(behind)
    rim = carrying & ~behind
    if not second.any():
        return 0.0
    most = float(p.max())
    smooth = _SMOOTH * float(p[second].max())
    beyond = float(p[rim].max()) - smooth
    spread = _SHORT * min(side / thickness, _MOST)
    return max((smooth + beyond * spread) / most - 1.0, 0.0)


def skin(layers: Sequence[Layer], substrate: Material, side: float) -> float:
    """Depth (mm) to the bottom of a stiff skin, at most `side`; 0 where no layer is stiffer than what is below it.

    Of skins thinner than `side` that which bends least (E h^3) counts.
    """
    depth, found, stiffest = 0.0, 0.0, 0.0
    for layer, below in zip(layers, (*layers, substrate)[1:], strict=True):
        depth += layer.thickness
        bending = layer.E * layer.thickness**3
        if layer.E > below.E and (found == 0.0 or (depth < side and bending > stiffest)):
            found, stiffest = min(depth, side), bending
    return found


def _all_around(flags: np.ndarray) -> np.ndarray:
    """Where all four neighbours are flagged; not in the outermost cells, beyond which there are none."""
    within = np.zeros_like(flags)
    within[1:-1, 1:-1] = flags[2:, 1:-1] & flags[:-2, 1:-1] & flags[1:-1, 2:] & flags[1:-1, :-2]
    return within
