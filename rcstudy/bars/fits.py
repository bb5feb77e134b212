"""Fits for error bars: the error of a scalar from differences between meshes and from the number of cells.

With S(h) a scalar on cells of size h and D = max(|S(h) - S(2h)|, |S(2h) - S(4h)|/2) the estimate is

    sqrt((c D)^2 + (noise + pull)^2 + shift^2) + x max(D - 6 noise, 0),
    noise = (k part + k1) N^-s scale,   pull = f mu part N^-s scale,   shift = g part scale/N,
    part = (1 - slip)^m slip^n,

with N the number of cells per radius of the contact (`estimate.py`) and slip the fraction of it that slips.

- c D: error of a method of some order. Half the difference of the two coarser meshes guards against two meshes that
  agree by chance; with two meshes only, D is `_NO_GUARD` times their difference.
- noise: scatter due to edges that fall between cells, which the difference of two meshes does not show reliably. The
  part that stems from the border of the stick zone depends on the size of that zone.
- pull: additional noise under full coupling, where friction mu acts on the pressure.
- shift: `kalker` has an error of first order and of one sign, as its contacts reach about a fifth of a cell too far.
  The shift is the part of it that is known without a coarser mesh; where c is above 1, the difference covers the rest.
  In windows that fit the contact all edges lie at one place between cells, which makes all of this error systematic: c
  alone, fitted to windows of random size, held in as few as six of ten of them.
- x max(D - 6 noise, 0): differences far beyond the noise show a mesh too coarse for the bodies, for example for layers
  thinner than a cell.

Without a coarser mesh the estimate is the larger of k0 scale/N and q scale/N^r. This is for contacts of six cells a
radius and more whose coarser mesh ends too close to them; those too small for a coarser mesh are in `few.py`.

Constants of `aligned` were set on 5900 random contacts, 600 of them wild, those of `kalker` on 2100: of all kinds of
`scripts/error_bars.py`, with one or two coarser meshes, such that 95 in 100 bars hold and, as far as that leaves room,
none is more than five times the error in the median. Those of `COUPLED` were set on 1800 and 1500 fully coupled
contacts, those without a coarser mesh on 560 (`aligned`: and 300). The reference was `aligned` on cells four times
finer (eight times without a coarser mesh); checked on others (results/error_bars.md). 4200 others showed bars with
`aligned` to be wider than these shares need: constants were lowered where 95 in 100 hold nevertheless, kind by kind, on
these and on 4200 more (docs/experiments.md).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

_NO_GUARD = 1.3  # factor on the difference of two meshes where there is no third one
_HARDLY = 0.01  # lower limit of the fraction that slips (or sticks) where its exponent is negative
_FAR = 6.0  # multiple of the noise that differences between meshes exceed only if the mesh is too coarse


@dataclass(frozen=True)
class Fit:
    """Constants of one scalar's error estimate, see the formulas above.

    (q, r) = `few`, m = `stick`, n = `slip`, k1 = `rest`, x = `excess`, f = `coupled`, g = `first`, s = `order`.
    """

    c: float
    k: float
    k0: float
    few: tuple[float, float]
    stick: float = 0.0
    slip: float = 0.0
    rest: float = 0.0
    excess: float = 0.0
    coupled: float = 0.0
    first: float = 0.0
    order: float = 1.5

    def by_meshes(
        self, values: Sequence[float], scale: float, per_radius: float, slipping: float, pulling: float
    ) -> float:
        """Error estimated from the `values` on two or more meshes, in the unit of `scale`.

        `values`: finest first; `scale`: of the scalar's error; `per_radius`: N; `slipping`: fraction of the contact
        that slips; `pulling`: friction coefficient mu under full coupling, else 0.
        """
        difference = abs(values[0] - values[1])
        guard = 0.5 * abs(values[1] - values[2]) if len(values) > 2 else _NO_GUARD * difference
        difference = max(difference, guard)
        unit, part = per_radius**-self.order * scale, self._part(slipping)
        noise, pull = (self.k * part + self.rest) * unit, self.coupled * pulling * part * unit
        shifted = self.first * part * scale / per_radius
        return math.hypot(self.c * difference, noise + pull, shifted) + self.excess * max(
            difference - _FAR * noise, 0.0
        )

    def by_cells(self, scale: float, per_radius: float) -> float:
        """Error estimated from the number of cells alone, without a coarser mesh; arguments as in `by_meshes`."""
        q, r = self.few
        return max(self.k0 / per_radius, q * per_radius**-r) * scale

    def _part(self, slipping: float) -> float:
        """Factor (1 - slip)^m slip^n of the noise, from the fraction of the contact that slips."""
        if self.stick == self.slip == 0.0:
            return 1.0
        least = _HARDLY if self.slip < 0.0 else 0.0
        left = _HARDLY if self.stick < 0.0 else 0.0
        result: float = max(1.0 - slipping, left) ** self.stick * max(slipping, least) ** self.slip
        return result


FITS: dict[str, Fit] = {
    "force_x": Fit(1.3, 0.22, 0.35, (0.4, 1.5), stick=0.5, rest=0.35, first=0.03),
    "force_y": Fit(1.25, 1.15, 0.35, (0.55, 1.35), stick=0.65, slip=0.6, rest=0.03),
    "moment_z": Fit(1.4, 0.1, 0.2, (0.22, 1.5), stick=0.5, rest=0.045),
    "pressure_max": Fit(0.3, 0.088, 0.16, (0.45, 2.2), excess=2.0),
    "contact_area": Fit(0.3, 0.0, 0.45, (1.4, 1.6), first=0.46),
    "slip_area": Fit(0.4, 0.0, 0.6, (1.9, 1.5), slip=0.2, first=0.65),
    "contact_radius": Fit(0.3, 0.0, 0.22, (0.65, 1.6), first=0.23),
    "approach": Fit(0.2, 0.02, 0.02, (0.15, 2.4), coupled=0.01),
    "traction_max": Fit(0.75, 1.7, 1.0, (0.5, 1.9), stick=1.2, slip=-0.7),
    "friction_power": Fit(2.0, 1.5, 0.95, (1.3, 2.0), stick=0.5, rest=0.25, first=0.28),
}

# cells aligned with the edge of the contact (`mechanics/aligned.py`) have less noise and gain more from a finer mesh
ALIGNED: dict[str, Fit] = {
    "force_x": Fit(0.22, 0.0, 0.04, (0.06, 3.0), rest=0.005, excess=0.045, coupled=0.005),
    "force_y": Fit(0.28, 0.0, 0.034, (0.13, 2.5), rest=0.02, excess=0.035, coupled=0.0026, order=1.75),
    "moment_z": Fit(0.23, 0.0073, 0.048, (0.08, 2.0), stick=0.25, rest=0.009, excess=0.063),
    "pressure_max": Fit(0.05, 0.0, 0.07, (0.0, 1.0), rest=0.0238, excess=0.11, order=2.0),
    "contact_area": Fit(0.06, 0.0, 0.13, (0.0, 1.0), rest=0.027, excess=0.55),
    "slip_area": Fit(0.17, 0.085, 0.0, (0.22, 1.5), slip=0.35, excess=0.5),
    "contact_radius": Fit(0.06, 0.0, 0.06, (0.0, 1.0), rest=0.0135, excess=0.55),
    "approach": Fit(0.115, 0.0, 0.0, (0.05, 1.5), rest=0.0195, excess=0.115),
    "traction_max": Fit(0.145, 0.0115, 0.16, (0.25, 2.0), stick=1.0, slip=-1.0, rest=0.009, excess=1.3),
    "friction_power": Fit(0.21, 0.002, 0.12, (0.0, 1.0), slip=2.0, rest=0.0065, excess=0.04, coupled=0.004, order=1.75),
}
# quasi-identical bodies: without slip by pressure tractions rise from zero at the leading edge, and errors are smaller
ALIKE = ALIGNED | {
    "force_x": Fit(0.18, 0.002, 0.04, (0.06, 3.0), stick=1.0, rest=0.008),
    "moment_z": Fit(0.19, 0.019, 0.048, (0.08, 2.0), stick=0.4, rest=0.005, excess=0.7),
    "pressure_max": Fit(0.036, 0.0, 0.07, (0.0, 1.0), rest=0.034, excess=0.086, order=2.0),
    "contact_area": Fit(0.042, 0.0, 0.13, (0.0, 1.0), rest=0.037, excess=0.63),
    "slip_area": Fit(0.17, 0.054, 0.0, (0.22, 1.5), stick=-0.3, slip=0.75, excess=0.34),
    "contact_radius": Fit(0.042, 0.0, 0.06, (0.0, 1.0), rest=0.0185, excess=0.63),
    "traction_max": Fit(0.5, 0.0175, 0.16, (0.25, 2.0), stick=1.0, slip=-0.9, rest=0.007, excess=0.8),
    "friction_power": Fit(0.31, 0.015, 0.12, (0.0, 1.0), stick=0.15, rest=0.0011),
}
# largest values under full coupling, which may be those of a cusp (`mechanics/subcell/cusps.py`)
COUPLED: dict[str, dict[str, Fit]] = {
    "kalker": {
        "pressure_max": Fit(0.35, 0.03, 0.16, (0.45, 2.2), excess=0.2, first=0.015),
        "traction_max": Fit(0.6, 0.9, 1.0, (0.5, 1.9), stick=1.2, slip=-0.7, coupled=0.5),
    },
    "aligned": {
        "pressure_max": Fit(0.02, 0.0, 0.07, (0.0, 1.0), rest=0.0235, excess=0.05, coupled=0.0022, order=2.0),
        "traction_max": Fit(
            0.6, 0.0115, 0.16, (0.25, 2.0), stick=1.0, slip=-1.0, rest=0.003, excess=0.02, coupled=0.07
        ),
    },
}
