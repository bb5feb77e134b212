"""Error bars of what skins stiffer than what they lie on, and hardly thicker than a cell or thinner, hide from cells.

- Under full coupling the pressure, and with it the largest traction, rises within the thickness of the skin at the
  border behind the stick zone (`mechanics/skins.py`).
- Under skins tractions begin somewhat within the edge of the contact (`mechanics/half_line.py`). `aligned` places its
  rows by the edge of the pressure alone.
- Skins bend like plates and take load along the rim (`mechanics/plates.py`). Rows of `aligned`, whose pressure ends
  like a root, have it farther inside.

Constants were set on 590 contacts under skins, 2 to 300 times as stiff as what they lie on and 1e-3 to 1.2 cells thick,
against cells 4 to 12 times finer: on polymers, soft layers and metals, of either coupling. Before, 54 to 97 in 100
largest pressures and 38 to 96 largest tractions were held where some cells slip under full coupling, up to 90 bars off;
79 to 86 in 100 forces along y under skins of some nm on soft layers, 62 to 94 moments where plates bear load along the
rim and all slips. Now it is 92 and more of each. Of 110 other skins on polymers, fully coupled, 67 in 100 pressures and
61 tractions were held, now 95 and 98 (`kalker`: 77 and 79, now 98 and 97). Checked on others (results/error_bars.md).
"""

from __future__ import annotations

import math

from rcstudy.bars.hidden import Hidden

# Rise of the pressure at a border of stick, and relative error of the largest traction, over `Hidden.cusp_in_skin`. The
# former counts as far as the pressure there then exceeds the largest one.
_OF_CUSP = {"kalker": (0.2, 0.12), "aligned": (0.3, 0.22)}
# Errors with `aligned` over their scales, per `Hidden.edge_of_tractions` and root of the part that sticks.
_OF_EDGE = {"force_x": 0.5, "force_y": 0.6, "moment_z": 0.35, "slip_area": 2.0}
# Errors with `aligned` over their scales where all slips, per `Hidden.moved_inwards` beyond `_SMOOTH` N^(-3/2), which
# smooth contacts have, too; half of that where all sticks.
_OF_RIM = {"force_x": 0.2, "force_y": 0.2, "moment_z": 1.0, "friction_power": 0.5}
_SMOOTH = 0.03


def at_cusp(hidden: Hidden, discretisation: str) -> tuple[float, float]:
    """Relative errors of the largest pressure and of the largest traction by the cusp within a skin."""
    if hidden.at_borders == 0.0:
        return 0.0, 0.0
    of_pressure, of_traction = _OF_CUSP[discretisation]
    return hidden.beyond_largest(of_pressure * hidden.cusp_in_skin), of_traction * hidden.cusp_in_skin


def at_edges(hidden: Hidden, name: str, slipping: float, per_radius: float) -> float:
    """Error of a scalar with `aligned` over its scale; `slipping`: part of the contact; `per_radius`: N."""
    by_edge = _OF_EDGE.get(name, 0.0) * hidden.edge_of_tractions * math.sqrt(max(1.0 - slipping, 0.0))
    inwards = max(hidden.moved_inwards - _SMOOTH * per_radius**-1.5, 0.0) * 0.5 * (1.0 + slipping)
    return math.hypot(by_edge, _OF_RIM.get(name, 0.0) * inwards)
