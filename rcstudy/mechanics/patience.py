"""When an iteration is given up: after so many steps in a row that get nowhere."""

from __future__ import annotations

import math


class Patience:
    """Ends with the last of `steps` steps in a row, none of which left less than `part` of the best residual before."""

    def __init__(self, steps: int, part: float = 1.0) -> None:
        self._steps, self._part = steps, part
        self._best, self._since_best = math.inf, 0

    def ends(self, residual: float) -> bool:
        """Whether it ends with a step that leaves `residual`."""
        if residual < self._part * self._best:
            self._best, self._since_best = residual, 0
        else:
            self._since_best += 1
        return self._since_best >= self._steps
