"""Series of creepages under one pressure, in which tractions start from those of a neighbouring creepage.

The tractions of a case on coarser meshes, needed for its error bars anyway, are closer to its solution than those of a
neighbour. The neighbour contributes the difference between its own solution and that interpolated from its coarser
meshes, which hardly changes from one creepage to the next (`contact.solve_rolling`).
"""

from __future__ import annotations

from dataclasses import replace

from rcstudy.mechanics.rolling import RollingSolution
from rcstudy.mechanics.scene import Creepage, Scene

_KEPT = 8  # number of last solutions kept: in a grid with rows of up to so many creepages the previous row is available
_NEAR = 0.5  # change of the rigid slip over the rigid slip itself, up to which a neighbour helps


class Series:
    """The last solutions for tractions under the pressure of one contact, of radius `radius` (mm)."""

    def __init__(self, radius: float) -> None:
        self._radius = radius
        self._found: list[tuple[Scene, Creepage, RollingSolution]] = []

    def add(self, scene: Scene, rolling: RollingSolution) -> None:
        """Keep the solution `rolling` of `scene` for later scenes if it was found by Newton's method and converged."""
        if scene.creepage is not None and scene.method == "newton" and rolling.converged:
            self._found.append((replace(scene, creepage=None), scene.creepage, rolling))
            del self._found[:-_KEPT]

    def neighbour(self, scene: Scene) -> RollingSolution | None:
        """The kept solution of the creepage nearest to that of `scene`, all else being equal; None if none is near."""
        if scene.creepage is None:
            return None
        nearest, least = None, _NEAR * scene.creepage.fastest(self._radius)
        apart_from_creepage = replace(scene, creepage=None)
        for other, creepage, rolling in self._found:
            far = (scene.creepage - creepage).fastest(self._radius)
            if far <= least and other == apart_from_creepage:
                nearest, least = rolling, far
        return nearest
