"""A stopping rule for iterations: a number of steps in a row without progress."""

from __future__ import annotations

import math


class Patience:
    """Ends an iteration after `steps` steps in a row without progress.

    A step makes progress if its residual is less than `part` times that of the last step that did.
    """

    def __init__(self, steps: int, part: float = 1.0) -> None:
        self._steps, self._part = steps, part
        self._best, self._since_best = math.inf, 0

    def exhausted(self, residual: float) -> bool:
        """Whether the iteration is to end with a step that leaves `residual`."""
        if residual < self._part * self._best:
            self._best, self._since_best = residual, 0
        else:
            self._since_best += 1
        return self._since_best >= self._steps
