"""Symbols of influence coefficients wrapped on a torus as small as the contact, made positive for inversion.

Wrapping leaves a kink at the seam of the torus, where the two halves of the coefficients meet. The symbols are positive
except under layers so stiff that they bend like plates: their response to short waves is smaller than the contribution
of the kink. For such waves the frequency response, averaged over a cell, takes the place of the symbol. Only
preconditioners use these symbols; the operators' own convolutions are padded, and their symbols stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rcstudy.mechanics.influence import Influence

_SOUND = 1e-4  # ratio of the smallest to the largest value above which a symbol is not corrected
_SHORT = 0.9  # fraction of the response; lower values of a symbol are due to the seam and are replaced
_NODES = 400  # number in the table of the response, a smooth function of the logarithm of the wave number


def positive_normal(hat: np.ndarray, influence: Influence, padded: tuple[int, int]) -> np.ndarray:
    """The symbol `hat` [py//2+1, px] of u_z by p, with the frequency response where `hat` is too small."""
    if hat.min() > _SOUND * hat.max():
        return hat
    (response,) = _responses(influence, padded, influence.normal_response)
    result: np.ndarray = np.where(hat < _SHORT * response, response, hat)
    return result


def positive_tractions(pair: np.ndarray, influence: Influence, padded: tuple[int, int]) -> np.ndarray:
    """The symbols `pair` (xx, xy, yy) of displacements by tractions, with the response where they are too small.

    Arrays [3, py//2+1, px]. A wave is replaced if the smaller principal value of its matrix is too small.
    """
    smaller, larger = _principal(pair.real)
    if smaller.min() > _SOUND * larger.max():
        return pair
    along, across = _responses(influence, padded, influence.traction_responses)
    kx, ky = _waves(influence, padded)
    square = kx**2 + ky**2
    square[0, 0] = 1.0  # the mean has no direction; that of x is taken, as responses hardly depend on it
    xx, xy = kx**2 / square, kx * ky / square
    xx[0, 0] = 1.0
    response = np.stack([xx * along + (1.0 - xx) * across, xy * (along - across), (1.0 - xx) * along + xx * across])
    result: np.ndarray = np.where(smaller < _SHORT * _principal(response)[0], response, pair)
    return result


def _principal(pair: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smaller and larger principal values of the symmetric matrices xx, xy, yy [3, ...]."""
    mean, half = 0.5 * (pair[0] + pair[2]), np.hypot(0.5 * (pair[0] - pair[2]), pair[1])
    return mean - half, mean + half


def _waves(influence: Influence, padded: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Wave numbers kx [1, px], ky [py//2+1, 1] (1/mm)."""
    kx = 2.0 * math.pi * np.fft.fftfreq(padded[0], influence.spacing[0])[None, :]
    ky = 2.0 * math.pi * np.fft.rfftfreq(padded[1], influence.spacing[1])[:, None]
    return kx, ky


def _responses(
    influence: Influence, padded: tuple[int, int], of_waves: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """Responses [k, py//2+1, px] (mm/MPa) averaged over a cell, over px py like symbols, from `of_waves`.

    `of_waves`: responses [k, n] (mm/MPa) at wave numbers [n] (1/mm).
    """
    kx, ky = _waves(influence, padded)
    alpha = np.hypot(kx, ky)
    alpha[0, 0] = alpha[0, 1] if padded[0] > 1 else 1.0
    nodes = np.geomspace(alpha.min(), alpha.max() * (1.0 + 1e-12), _NODES)
    tables = np.log(np.atleast_2d(of_waves(nodes)))
    responses = np.stack([np.exp(np.interp(np.log(alpha), np.log(nodes), table)) for table in tables])
    responses *= np.sinc(kx * influence.spacing[0] / (2.0 * math.pi))
    responses *= np.sinc(ky * influence.spacing[1] / (2.0 * math.pi))
    responses /= padded[0] * padded[1]
    return responses
