r"""Anderson mixing for the fixed-point iteration of full coupling, which solves pressure and tractions in turn.

Anderson 1965; here in the form of Walker & Ni 2011. A turn (one solution of pressure and tractions) maps a guess x to
x + f, f being the change of that guess. Near the fixed point f is nearly linear in x over the span of the guesses tried
so far. Of all combinations of the last guesses, with weights whose sum is one, the one with the smallest change (root
of mean square) is taken, and that change is added to it. With one guess this is plain substitution, with two the secant
method; for a linear problem it does what GMRES does.
"""

from __future__ import annotations

import numpy as np

_KEPT = 15  # earlier guesses that are combined with the last one: rubber under high friction needs many
_RANK = 1e-8  # least relative singular value: changes closer to each other than that count as dependent


class Mixing:
    """The guesses of one fixed-point iteration, arrays of one shape, and the change that each has led to."""

    def __init__(self) -> None:
        self._guesses: list[np.ndarray] = []
        self._changes: list[np.ndarray] = []

    def forget(self) -> None:
        """Drop all guesses, as the map from a guess to its change is another one from here on."""
        self._guesses.clear()
        self._changes.clear()

    def following(self, guess: np.ndarray, change: np.ndarray, where: np.ndarray) -> np.ndarray:
        """The next guess after `guess`, which a turn maps to `guess` + `change`; all arrays of one shape, in any unit.

        `where`: flags of the values whose change is to be small; a constant common to all of them does not count.
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
                return result  # given these numbers LAPACK would print a message on standard output
            weights, *_ = np.linalg.lstsq(columns, change[where] - change[where].mean(), rcond=_RANK)
            for weight, (of_guess, of_change) in zip(weights, steps, strict=True):
                result -= weight * (of_guess + of_change)
        return result
