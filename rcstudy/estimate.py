"""Estimates of the discretisation error of each scalar, from the coarser meshes that every solution starts from.

With S(h) a scalar on cells of size h the estimate is

    sqrt((c max(|S(h) - S(2h)|, |S(2h) - S(4h)|/2))^2 + (k N^(-3/2) scale)^2) + tolerance scale,

N being the cells per radius of the contact. The first part is what a method of first order makes of the difference
between two meshes; half the difference one mesh up guards against two meshes that agree by chance. The second is the
noise of edges that fall between cells, which no difference of two meshes shows reliably. c and k were set on 500
random contacts of either discretisation against meshes four times finer, and checked on others
(`scripts/error_bars.py`). A contact too small for a coarser mesh gets k0 scale/N, what 19 of 20 such contacts kept.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from rcstudy.mechanics.scene import Scene


@dataclass(frozen=True)
class Fit:
    """Constants of one scalar's estimate (see above) and the scalar or resultant that sets its scale.

    `noise_of`: the whole contact; the part of it that sticks, so that the noise counts by that; or the border of what
    slips, so that it counts by the root of that part.
    """

    c: float
    k: float
    k0: float
    scale: str
    noise_of: Literal["contact", "stick", "border"] = "contact"


FITS: dict[str, Fit] = {
    "force_x": Fit(1.0, 0.25, 0.35, "friction force"),
    "force_y": Fit(1.0, 0.22, 0.35, "friction force"),
    "moment_z": Fit(1.0, 0.11, 0.2, "friction moment"),
    "pressure_max": Fit(0.5, 0.01, 0.1, "pressure_max"),
    "contact_area": Fit(0.5, 1.1, 0.45, "contact_area"),
    "slip_area": Fit(0.5, 1.4, 0.6, "contact_area"),
    "contact_radius": Fit(0.5, 0.55, 0.22, "contact_radius"),
    "approach": Fit(0.2, 0.02, 0.02, "approach"),
    "traction_max": Fit(0.5, 2.0, 1.0, "traction_max", noise_of="stick"),
    "friction_power": Fit(1.5, 0.25, 8.0, "friction_power"),
}

# cells that begin where the contact begins (`mechanics/aligned.py`) have less noise and gain more from a finer mesh
ALIGNED: dict[str, Fit] = {
    "force_x": Fit(0.5, 0.027, 0.35, "friction force"),
    "force_y": Fit(0.2, 0.033, 0.35, "friction force"),
    "moment_z": Fit(0.1, 0.028, 0.2, "friction moment"),
    "pressure_max": Fit(0.1, 0.027, 0.1, "pressure_max"),
    "contact_area": Fit(0.3, 0.032, 0.45, "contact_area"),
    "slip_area": Fit(0.38, 0.18, 0.6, "contact_area", noise_of="border"),
    "contact_radius": Fit(0.3, 0.016, 0.22, "contact_radius"),
    "approach": Fit(0.1, 0.02, 0.02, "approach"),
    "traction_max": Fit(0.55, 0.028, 1.0, "traction_max"),
    "friction_power": Fit(0.3, 0.074, 8.0, "friction_power"),
}


# Where all cells stick a zone narrower than half a cell may slip behind them: so much of the area over cells a radius.
_UNSEEN = 0.3


def error_estimates(scene: Scene, cells: int, levels: Sequence[dict[str, float]]) -> dict[str, float]:
    """`<name>_error` of every scalar in FITS that `levels` has, in the scalar's own unit.

    `levels`: scalars on the mesh of `scene`, then on coarser ones, finest first; `cells`: number of cells in contact.
    """
    finest = levels[0]
    per_radius = math.sqrt(cells / math.pi)
    force = scene.friction * scene.load
    scales = {"friction force": force, "friction moment": force * finest["contact_radius"], **finest}
    tolerance = max(scene.tolerance.normal, scene.tolerance.tangential)
    out = {}
    for name, fit in (ALIGNED if scene.discretisation == "aligned" else FITS).items():
        if name not in finest:
            continue
        scale = abs(scales[fit.scale])
        values = [level[name] for level in levels]
        if len(values) == 1:
            estimate = fit.k0 / per_radius * scale
        else:
            difference = abs(values[0] - values[1])
            if len(values) > 2:
                difference = max(difference, 0.5 * abs(values[1] - values[2]))
            noise = fit.k * per_radius**-1.5 * scale * _part(fit, finest)
            estimate = math.hypot(fit.c * difference, noise)
        out[f"{name}_error"] = estimate + tolerance * scale
    if "slip_area" in finest and finest["slip_area"] == finest["contact_area"]:
        out["slip_area_error"] = out["contact_area_error"]  # all slips
    if finest.get("slip_area") == 0.0 and finest["traction_max"] > 0.0:
        out["slip_area_error"] = max(out["slip_area_error"], _UNSEEN / per_radius * finest["contact_area"])
    return out


def _part(fit: Fit, finest: dict[str, float]) -> float:
    """What of the noise of a whole contact counts."""
    if fit.noise_of == "contact":
        return 1.0
    slipping = finest["slip_area"] / finest["contact_area"]
    return max(1.0 - slipping, 0.0) if fit.noise_of == "stick" else math.sqrt(slipping)
