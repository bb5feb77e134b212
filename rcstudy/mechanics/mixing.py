r"""Fixed points by Anderson's mixing: what turns of pressure and tractions lead to.

Anderson 1965; here in the form of Walker & Ni 2011. A guess x and its change f (x + f is what a turn makes of it) are
linear in each other near the fixed point, as far as they have been tried. So of all combinations of the last guesses,
with weights whose sum is one, the one whose change is least in the mean is taken, and then its change is made. With one
guess that is plain substitution, with two the secant; in a linear problem it is what GMRES does.
"""

from __future__ import annotations

import numpy as np

_KEPT = 15  # guesses before the last one, of which it is made: rubber under high friction asks for many
_RANK = 1e-8  # changes that differ by less are one


class Mixing:
    """The guesses of one fixed point, arrays of any one shape, and how each has changed."""

    def __init__(self) -> None:
        self._guesses: list[np.ndarray] = []
        self._changes: list[np.ndarray] = []

    def forget(self) -> None:
        """Start over: what turns do has changed."""
        self._guesses.clear()
        self._changes.clear()

    def following(self, guess: np.ndarray, change: np.ndarray, where: np.ndarray) -> np.ndarray:
        """The guess after `guess`, of which a turn makes `guess` + `change`.

        `where`: flags of the values that matter, up to a constant that all of them have in common.
        """
        guesses, changes = self._guesses, self._changes
        steps = [(guess - g, change - c) for g, c in zip(guesses, changes, strict=True)]
        guesses.append(guess)
        changes.append(change)
        del guesses[:-_KEPT], changes[:-_KEPT]
        result = guess + change
        if steps:
            columns = np.stack([of_change[where] for _, of_change in steps], axis=1)
            columns -= columns.mean(axis=0)
            if not (np.isfinite(columns).all() and np.isfinite(change).all()):
                return result  # LAPACK would say so on standard output
            weights, *_ = np.linalg.lstsq(columns, change[where] - change[where].mean(), rcond=_RANK)
            for weight, (of_guess, of_change) in zip(weights, steps, strict=True):
                result -= weight * (of_guess + of_change)
        return result
