"""Series of creepages under one pressure, in which tractions start from those of a neighbour.

Coarser meshes are there for the error bars anyway, and their tractions are closer to a case's own than a neighbour's
are. What a neighbour adds is what its own mesh found beyond them: that hardly changes from one creepage to the next.
"""

from __future__ import annotations

from dataclasses import replace

from rcstudy.mechanics.rolling import RollingSolution
from rcstudy.mechanics.scene import Creepage, Scene

_KEPT = 8  # solutions, the last ones: so many creepages in a row of a grid of them have the row before at hand
_NEAR = 0.5  # change of the rigid slip, over the rigid slip itself, up to which a neighbour helps


class Series:
    """The last tractions that were found under the pressure of one contact of the radius `radius` (mm)."""

    def __init__(self, radius: float) -> None:
        self._radius = radius
        self._found: list[tuple[Scene, Creepage, RollingSolution]] = []

    def add(self, scene: Scene, rolling: RollingSolution) -> None:
        """Keep the tractions of `scene` for those to come, if they are any good."""
        if scene.creepage is not None and scene.method == "newton" and rolling.converged:
            self._found.append((replace(scene, creepage=None), scene.creepage, rolling))
            del self._found[:-_KEPT]

    def neighbour(self, scene: Scene) -> RollingSolution | None:
        """The tractions closest to those of `scene`, from which it differs in creepage alone; None if far from all."""
        if scene.creepage is None:
            return None
        nearest, least = None, _NEAR * scene.creepage.fastest(self._radius)
        apart_from_creepage = replace(scene, creepage=None)
        for other, creepage, rolling in self._found:
            far = (scene.creepage - creepage).fastest(self._radius)
            if far <= least and other == apart_from_creepage:
                nearest, least = rolling, far
        return nearest
