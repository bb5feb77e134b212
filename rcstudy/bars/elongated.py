"""Errors of contacts that are long one way, and around a pole of spin.

Cells of a contact that is long along x, as many along it as across, are long themselves. What sticks grows from the
leading edge, and turns into slip, over distances like the contact's half width: cells that are no shorter hardly show
how, and all meshes of a solution miss the same. Of contacts that are long along y moments and their powers are larger
than their mean radius tells.

Around a pole of spin within the slip zone directions of tractions depend on how it lies between cells. On cells that
are long one way tractions turn over within a cell in all rows within its length of the pole.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rcstudy.mechanics.normal import semi_axes_in_cells
from rcstudy.mechanics.scene import Scene

# Errors of forces over their scale, times N^2, where all slips around a pole of spin in the middle of the contact.
# 1/N^2 is no less than the length of cells over the semi-axis that way, times that over the other one up to
# `_WITHIN_CELL`. Those of moments are as large times the pole's distance from the centre, and `OFF_POLE` times the
# radius. The power has the latter part, and all of the moment's error where the pole is in the middle. (354 contacts by
# spin, 0.1 to 12 times as long as wide, on 9 to 80 cells, that slip in 95 in 100 of their area: 97 and 98 in 100 forces
# along x and y are held, none is more than 1.9 bars off; 88, 91 and 18 with cells long along x alone and the pole's
# distance over the mean radius. 480 that are round, on 24 to 64 cells: 95 and 97, without it 87 and 81.)
_AT_POLE, _WITHIN_CELL = 0.14, 5.0
OFF_POLE = 0.1
_AROUND_POLE = 0.2  # part of the contact that sticks from which on the pole is taken to lie there

# Relative error with `aligned` of the largest traction, times N^1.5, where the pole of spin lies in the contact and
# slip does not reach the largest pressure: the border around what sticks is curved on the scale of few cells there. (Of
# 561 contacts by spin that slip in 30 to 90 in 100 of their area, 14 to 44 cells along the window, 88 in 100 were held
# without it, 80 between bodies alike; of 349 others 91.)
_BORDER = 0.05

# Errors with `aligned` of the slip area over that of the contact, and of moments between unlike bodies over their scale
# (in contacts long along x, per unit of 1 - b/a), times N^1.5, where an island sticks around a pole of spin. They
# vanish with the island, below `_ISLAND` of the contact, and where `_LARGE` of it sticks. (Contacts by spin that stick
# in 2 to 30 in 100 of their area: of 244 of bodies alike 82 in 100 slip areas were held, now 92; of 55 long along x
# under rigid bodies 49 in 100 moments, now 98. Of others, 90 and 70: 96 and 97.)
_OF_ISLAND = {"slip_area": 0.22, "moment_z": 0.17}
_ISLAND, _LARGE = 0.03, 0.4

# Factor on bars of area and radius with `aligned`: the length over the width of cells, from `_SQUARE` on and up to
# `_LONGEST`, over the former, to the power `_BY_LENGTH`. Contacts as long as these, on square cells, need none.
# (Set on 1980 bare and coated contacts, up to ten times as long one way, 15 to 55 cells along either side of the
# window: 95 in 100 held, at least 90 of any length of cells. With the length of the contact, to the power 1/2, in its
# place it was 91 in 100, and 77 to 85 where cells are more than five times as long one way. Of 250 others, 96.)
_SQUARE, _LONGEST, _BY_LENGTH = 2.0, 20.0, 0.6
# Factors on bars with `aligned`, where cells are long along y and the contact has fewer rows than cells along x: the
# lesser of both ratios, up to `_FEWEST`, to these powers. N of `per_radius` is larger than the number of rows is then,
# and what varies along y is seen by rows alone. (Set on 1019 round and 2:1 contacts with 12 to 29 rows of cells 1.3 to
# 8 times as long as wide: 79 to 90 in 100 forces along x, moments and powers were held. Of 468 others 95.
# Contacts that are long along y, or x on square cells, need none, nor do cells that are long along x.)
_FEW_ROWS = {
    "force_x": 0.6,
    "force_y": 0.3,
    "moment_z": 0.45,
    "friction_power": 0.4,
    "slip_area": 0.25,
    "traction_max": 0.5,
    "contact_area": 0.15,
    "contact_radius": 0.15,
}
_FEWEST = 8.0

# Errors with `aligned` over the force, the force times the longer semi-axis, the force times the rigid slip, and the
# area, of contacts that are long along x: per unit of (dx/b)^1.5 - (dx/a)^1.5 and of the part that sticks; of slip
# areas, of its root. Of those long along y: per unit of (dy/b)^1.5 or, of moments, (dy/b)^2, of 1 - a/b and of the part
# that sticks. The force is no more than the creepages cause where all sticks. (1155 contacts as above: of the 614 that
# slip in less than 7 tenths of their area 94, 95, 92 and 92 in 100 forces along y, moments, powers and slip areas are
# held, at most 3.5 bars off; 80, 81, 82, 88 and 7.7 without it. Of 599 others of unlike bodies and layers, of either
# coupling, 96, 95, 97 and 95; 92, 89, 95 and 93. Forces along x, which small differences of coarse meshes say less of:
# of the 1980 above 95 in 100 are held, without it 91, and 87 of those that slip in less than half of their area; of 250
# others 94.)
# dx/b counts up to `_MOST`: errors are not larger than the friction force.
_MOST = 4.0
_LONG = {"force_x": 0.04, "force_y": 0.08, "moment_z": 0.04, "friction_power": 0.065, "slip_area": 0.1}
_WIDE = {"force_x": 0.08, "force_y": 0.05, "moment_z": 0.3}
_OF_MOMENT = 0.5  # power, over that of the moment on the spin, of contacts long along y
# Error of the force along x, over the force, of those long along x, per unit of that length and of Dundurs' constant
# over pi times friction: pressure moves unlike surfaces along x. (298 of those others: 90 in 100 held, 86 without it.)
_LONG_UNLIKE = 0.05
# Errors with `kalker` of those long along x, of first order: per unit of dx/b - dx/a and of the root of the part that
# sticks. (Of 442 of the 1155 contacts 96 and 95 in 100 forces along y and moments are held, 90 and 88 without it.)
_LONG_KALKER = {"force_y": 0.3, "moment_z": 0.2}


@dataclass(frozen=True)
class Shape:
    """Semi-axes `along` x and `across` of a contact in cells, sides of these (mm), and the pole of spin's x, y (mm)."""

    along: float
    across: float
    step: tuple[float, float]
    pole: tuple[float, float]

    @property
    def semi_axes(self) -> tuple[float, float]:
        """Semi-axes a along x and b along y, mm."""
        return self.along * self.step[0], self.across * self.step[1]

    @property
    def longer(self) -> float:
        """1 - b/a of contacts long along x, 0 of others."""
        a, b = self.semi_axes
        return max(1.0 - b / a, 0.0)

    @property
    def of_edges(self) -> dict[str, float]:
        """Factors on bars of area and radius: edges cross rows, or columns, of long cells at all places."""
        dx, dy = self.step
        factor = (min(max(dx / dy, dy / dx, _SQUARE), _LONGEST) / _SQUARE) ** _BY_LENGTH
        return {"contact_area": factor, "contact_radius": factor}

    @property
    def of_rows(self) -> dict[str, float]:
        """Factors on bars where cells are long along y, and their rows fewer than the cells of a row."""
        dx, dy = self.step
        fewer = min(max(min(dy / dx, self.along / self.across), 1.0), _FEWEST)
        return {name: fewer**power for name, power in _FEW_ROWS.items()}

    @property
    def away(self) -> float:
        """Distance of the pole of spin from the origin, over that of the contact's edge in its direction."""
        (a, b), (x, y) = self.semi_axes, self.pole
        return math.hypot(x / a, y / b)

    @property
    def per_radius(self) -> float:
        """N, cells per radius.

        The geometric mean of half the number of cells across the narrower side, in cells, and of the mean of both
        sides. A long contact with as many cells along either side has the N of a round one on square cells.
        """
        return math.sqrt(min(self.along, self.across)) * (self.along * self.across) ** 0.25

    def at_pole(self, slipping: float) -> tuple[float, float]:
        """Errors of forces over their scale around a pole of spin, by 1/N^2 and by what the length of cells adds to it.

        `slipping`: part of the contact.
        """
        if self.away >= 1.0:
            return 0.0, 0.0
        (a, b), (dx, dy), by_cells = self.semi_axes, self.step, self.per_radius**-2.0
        turned = max(min(dx / b, _WITHIN_CELL) * dx / a, min(dy / a, _WITHIN_CELL) * dy / b)
        around = _AT_POLE * self.slips_at_pole(slipping) * math.sqrt(1.0 - self.away**2)
        return around * by_cells, around * max(turned - by_cells, 0.0)

    @property
    def border_around_pole(self) -> float:
        """Relative error of the largest traction, if there is a pole of spin within the contact."""
        return _BORDER * self.per_radius**-1.5 if self.away < 1.0 else 0.0

    def slips_at_pole(self, slipping: float) -> float:
        """How far the pole of spin is in slip, from 0 to 1, in a contact of which the part `slipping` slips."""
        return max(1.0 - (1.0 - slipping) / _AROUND_POLE, 0.0)

    def of_island(self, slipping: float) -> tuple[float, float]:
        """Errors of the slip area over the contact's and of the moment over its scale, by an island that sticks.

        It lies around the pole of spin in a contact of which the part `slipping` slips. The latter is between unlike
        bodies only.
        """
        sticks = 1.0 - slipping
        around = math.sqrt(max(1.0 - self.away**2, 0.0)) * self.per_radius**-1.5
        around *= min(sticks / _ISLAND, 1.0) * max(1.0 - sticks / _LARGE, 0.0)
        return _OF_ISLAND["slip_area"] * around, _OF_ISLAND["moment_z"] * around * self.longer

    def of_length(self, slipping: float, spin: float, fastest: float, turning: float) -> dict[str, float]:
        """Errors with `aligned`, over the force, of forces (-), moment (mm), power (-); over the area of the slip area.

        `slipping`: part of the contact; `spin` in rad/mm; `fastest`: largest rigid slip (-); `turning`: see `Hidden`.
        """
        (a, b), (dx, dy), sticks = self.semi_axes, self.step, max(1.0 - slipping, 0.0)
        if a > b:
            longer = max(min(dx / b, _MOST) ** 1.5 - (dx / a) ** 1.5, 0.0)
            sizes = {"force_x": 1.0, "force_y": 1.0, "moment_z": a, "friction_power": fastest}
            parts = {name: _LONG[name] * longer * sticks * size for name, size in sizes.items()}
            parts["slip_area"] = _LONG["slip_area"] * longer * math.sqrt(sticks)
            parts["force_x"] += _LONG_UNLIKE * longer * min(turning, 1.0)
            return parts
        part = (1.0 - a / b) * sticks
        parts = {name: _WIDE[name] * part * (dy / b) ** 1.5 for name in ("force_x", "force_y")}
        moment = _WIDE["moment_z"] * part * (dy / b) ** 2 * b
        return parts | {"moment_z": moment, "friction_power": _OF_MOMENT * abs(spin) * moment}

    def of_length_first_order(self, slipping: float) -> dict[str, float]:
        """As `of_length`, with `kalker`."""
        (a, b), dx = self.semi_axes, self.step[0]
        part = max(min(dx / b, _MOST) - dx / a, 0.0) * math.sqrt(max(1.0 - slipping, 0.0))
        return {"force_y": _LONG_KALKER["force_y"] * part, "moment_z": _LONG_KALKER["moment_z"] * part * a}


def shape(scene: Scene, cells: float) -> Shape:
    """The shape of a contact of `cells` cells, if it is as long over wide as Hertz's."""
    along, across = semi_axes_in_cells(scene)
    mean, root = math.sqrt(cells / math.pi), math.sqrt(along / across)
    pole = scene.creepage.pole if scene.creepage else (math.inf, math.inf)
    return Shape(mean * root, mean / root, scene.mesh.spacing, pole)
