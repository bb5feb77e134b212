"""Error bars of largest pressures and tractions: at cusps and rims, and between the centres of cells.

What the lift by tractions adds to them under full coupling is in `pulled.py`.
"""

from __future__ import annotations

import math

from rcstudy.bars.hidden import Hidden

# Relative errors of the largest pressure and traction over what cusps change of them.
_CUSPS = {"kalker": (0.7, 0.9), "aligned": (0.9, 0.22)}
# Error with `aligned` of a largest pressure within two cells of the stick zone's border, over the difference of the
# finest two meshes: there it converges with dx or its root. (69 of 350 contacts: held in 84 of 100 without it, now 92.)
_AT_CUSP = 1.0
# Rise of the pressure at that border that cells may not show, per pull and over the root of N: the cusp there may then
# exceed the largest pressure that they do. (Of 3057 random contacts under full coupling with `aligned` it widens the
# bars of 78, of which 77 in 100 held before, the worst 21 bars off, now 95; with `kalker` those of 19, 74 and 95.)
_UNSEEN_CUSP = 0.16
# Relative error of a largest pressure in the outermost cells: this part of `beyond_rim`, no more than
# `_MOST_BEYOND_RIM` (57 pressures under stiff skins, on 24 to 128 cells); `_ALL_OF_IT` where `pull` is 1 beyond
# `_STEEP`. (Of 57 such largest pressures with `aligned` 74 in 100 are held with the factor of `kalker`, now 93.)
_BEYOND_RIM, _MOST_BEYOND_RIM, _STEEP = 0.5, 0.12, 0.5
_ALL_OF_IT = {"kalker": 1.15, "aligned": 1.6}
# Errors with `kalker` under pressures more peaked than Hertz's, per unit of `peaked`. The largest pressure may lie half
# a cell from the next centre along either side, which misses m/(2 N^2) of p0 (1 - r^2/a^2)^m: 0.4 of the at most 0.5 by
# which that is beyond Hertz's, and up to 1.2 times the bar of the largest traction. (Set on 850 contacts on soft
# films: bars of pressures were held in 88 of 100, now 97, of tractions in 89, now 95.)
_BETWEEN_CELLS, _OF_PEAKED = 0.4, 0.4


def of_cusps(hidden: Hidden, discretisation: str) -> tuple[float, float]:
    """Relative errors of the largest pressure and of the largest traction by cusps at the border of the stick zone."""
    of_pressure, of_traction = _CUSPS[discretisation]
    return of_pressure * hidden.cusp_of_pressure, of_traction * hidden.cusp_of_traction


def at_cusp(pressures: tuple[float, float]) -> float:
    """Least error (MPa) with `aligned` of the largest pressure beside that border, from `pressures` on two meshes."""
    return _AT_CUSP * abs(pressures[0] - pressures[1])


def at_border(hidden: Hidden, per_radius: float) -> float:
    """By which fraction the pressure at the border of the stick zone may exceed the largest one; `per_radius`: N."""
    return hidden.beyond_largest(_UNSEEN_CUSP * hidden.pull / math.sqrt(per_radius))


def beyond_rim(hidden: Hidden, discretisation: str) -> float:
    """Relative error of a largest pressure in the outermost cells."""
    counts = _ALL_OF_IT[discretisation] * min(max(hidden.pull - _STEEP, 0.0), 1.0)
    return max(min(_BEYOND_RIM * hidden.beyond_rim, _MOST_BEYOND_RIM), counts * hidden.beyond_rim)


def between_cells(peaked: float, per_radius: float) -> float:
    """Relative error with `kalker` of the largest pressure, beyond that of Hertz's; `per_radius`: N."""
    return _BETWEEN_CELLS * peaked * per_radius**-2.0


def of_peaked_tractions(peaked: float) -> float:
    """Factor with `kalker` on the bar of the largest traction under peaked pressures."""
    return 1.0 + _OF_PEAKED * min(peaked, 0.5)
