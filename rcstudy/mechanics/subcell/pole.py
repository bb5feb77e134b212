r"""The largest pressure at the pole of spin, under full coupling: it grows with ever finer meshes.

Where slip turns about a point inside the contact (the pole of spin) tractions mu p d turn as well, their direction d
being undefined there. As the pole's surroundings deform, d points a little inwards or outwards. With m as mean radial
component, the divergence of d is m/r at a distance r from the pole. In Fourier space tractions q lift surfaces like a
pressure beta i k.q/|k| (beta: Dundurs' constant); with i k.q = mu p m 2 pi/k that is the transform of

    mu beta p m ln(1/r),

which the pressure has to make up for. So it has a logarithmic peak: cells average over it, and each halving of their
size adds about the same. m itself, found from cells, grows as well, as only close to the pole slip by tractions
outweighs that of spin. The rise on a mesh four times finer is therefore estimated without it, from how much directions
turn around a cell. `_RISE` was set on 360 contacts (nu 0.2 and 0.35, friction 0.1 to 1, spin of 0.02 to 1 rad/mm, 16 to
32 cells across the window): bars hold in 99 (`aligned`) and 100 of 100, 58 and 82 without.
"""

from __future__ import annotations

import numpy as np

_RISE = 0.5  # on a mesh four times finer, over mu beta p, where directions turn once around a cell
_AROUND = np.stack(np.meshgrid(np.arange(-2, 3), np.arange(-2, 3))).reshape(2, -1)  # a cell and two around it


def rise_at_pole(cells: np.ndarray, pressure: np.ndarray, fractions: np.ndarray, pulling: float) -> float:
    """Fraction of itself by which the largest pressure may rise on a mesh four times finer.

    `cells` [m, 2]: their indices; `pressure` [m] (MPa); `fractions` [m, 2]: tractions over their bounds; `pulling`:
    friction times the magnitude of Dundurs' constant. Cells at the border of the contact do not count.
    """
    most = float(pressure.max())
    top = cells[pressure * (1.0 + _RISE * pulling) > most] + 2
    numbers = np.full(cells.max(axis=0) + 5, -1)
    numbers[tuple((cells + 2).T)] = np.arange(len(cells))
    around = numbers[top[:, :1] + _AROUND[0], top[:, 1:] + _AROUND[1]]
    around = around[(around >= 0).all(axis=1)]
    if not len(around):
        return 0.0
    parts = fractions[around]
    turning = np.hypot(parts[..., 0], parts[..., 1]).mean(axis=1) - np.hypot(*parts.mean(axis=1).T)
    middle = _AROUND.shape[1] // 2
    risen = pressure[around[:, middle]] * (1.0 + _RISE * pulling * turning)
    return max(float(risen.max()) / most - 1.0, 0.0)
