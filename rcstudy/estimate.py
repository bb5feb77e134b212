"""Estimates of the discretisation error of each scalar, from the coarser meshes that every solution starts from.

What differences between these meshes and the number of cells tell is in `fits.py`. What a contact of one to four cells
is, or a long one of no more than three along one side, cells do not tell at all: it may be of any size below theirs. To
its bars comes by how much it differs from the Hertz contact of what the layers yield to a wave of its size, and cells
per radius count along the narrower side.

The slip area on aligned cells shares the error of the contact's, in quadrature, and a traction that is largest where
the pressure is has that one's; where nothing is seen to slip, `_UNSEEN` of a cell may, and tractions grow towards the
trailing edge beyond what cells show (aligned ones find both, `trailing.py`). Where all cells slip a strip narrower than
one may stick, unless they all slip fast (`_STRIP`). Where bodies are alike friction takes what creepages put in: by how
much it does not, on kalker's cells, is an error that is known (`balance_power`). To all estimates comes what the
solver's tolerances leave, and what is hidden from all meshes alike (`Hidden`): layers and slip zones narrower than
cells, what tractions lift, cusps at the stick zone's border, and what stiff skins gather at the rim. Forces that are
none by symmetry have only the tolerance as bar (`vanishes`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rcstudy.fits import ALIGNED, ALIKE, FITS, Fit
from rcstudy.mechanics.normal import estimated_contact
from rcstudy.mechanics.scene import Creepage, Scene
from rcstudy.mechanics.unseen import Unseen


class Hidden(NamedTuple):
    """What differences between meshes do not show; on kalker's cells `unsettled`, `by_layers` and `slip` are 0.

    `unsettled`: by how much of their bounds tractions are off (`RollingSolution`); `by_layers`: the part of the
    contact's area that layers too thin for the cells take or add (`AlignedContact.beyond_edges`); `slip`: what slip
    zones too narrow for the cells change (`mechanics/unseen.py`); `lift`: the part of the approach that tractions make
    (full coupling); `raised`: of the largest pressure the part by which layers make it less concentrated on cells
    than half-spaces do (`raised_by_layers`); `cusp_of_pressure`, `cusp_of_tractions`: slopes that jump at the
    stick zone's border, over p0/a, where they are largest there (full coupling); `least_slip`: the smallest slip of all
    cells over the largest, 1 where it is not known; `at_rim`: by what part of itself the largest pressure
    may be too small under stiff skins (`mechanics/plates.py`); `shown`: whether some cell slips; `on_cells`:
    the largest traction (MPa) of a cell.
    """

    unsettled: float = 0.0
    by_layers: float = 0.0
    slip: Unseen = Unseen()
    lift: float = 0.0
    raised: float = 0.0
    cusp_of_pressure: float = 0.0
    cusp_of_tractions: float = 0.0
    least_slip: float = 1.0
    at_rim: float = 0.0
    shown: bool = True
    on_cells: float = math.inf


def least_over_largest(slip: np.ndarray) -> float:
    """The smallest of slips [m, 2] over the largest; 1 where there is none."""
    sizes = np.hypot(slip[:, 0], slip[:, 1])
    return float(sizes.min() / sizes.max()) if sizes.any() else 1.0


# Cells per radius, on fewer of which the one coarser mesh tells less: so many times what it does (500 contacts).
_FEW = 6.0
_ON_FEW = {"kalker": 1.15, "aligned": 1.4}
_NARROW = 3  # cells: a longer contact of no more along one side is no better than these
_FEWEST = 5  # cells, of fewer than which a contact may be of any size below theirs

# Of what layers too thin for the cells do to the contact's area, for which their shift of the edge makes up: parts that
# may be left, and that forces, which know nothing of it, may be off.
_BY_LAYERS = {
    "contact_area": 0.37,
    "contact_radius": 0.185,
    "slip_area": 0.12,
    "pressure_max": 0.01,
    "traction_max": 0.3,
    "force_x": 0.27,
    "force_y": 0.1,
    "moment_z": 0.1,
    "friction_power": 0.26,
}
_BY_SKINS = 1.8  # times as much, of layers stiffer than what is below
_RAISED, _SUNK = 0.5, 0.9  # times `raised`: what is left in the largest pressure, and what the approach is off by
# Over cells a radius: what cells round off of such slopes in pressure and in tractions.
_CUSPS = {"kalker": (0.4, 0.4), "aligned": (0.72, 0.4)}
_STUCK = {"force_x": 0.036, "force_y": 0.036, "moment_z": 0.11}  # of themselves over cells a radius, where none slip
# Of the area and the largest traction of slip zones narrower than a cell that aligned cells find (`trailing.py`).
_NARROW_ZONE, _AT_BORDER = 0.25, 0.12
_LEADING = 1.2  # times a leading cell's traction and its bound: the square of the largest where they meet (1 to 1.2)
_LIFT = {"kalker": 0.35, "aligned": 0.03}  # over cells a radius: how far tractions, and so their lift, may be off
_UNDER = 0.9  # times what slip zones at the leading edge hide, and is made up for
_TRACTIONS = 2.0  # largest traction everywhere, times so much: all that friction can do, for forces' scale
_ROUNDING = 1e-9
_BY_FRICTION = {"friction_power", "force_x", "force_y", "moment_z"}
# Where all cells stick a zone narrower than half a cell may slip behind them: so much of the area over cells a radius.
_UNSEEN = 0.3
# Where all cells slip a strip at the leading edge may stick, less than a cell wide and so as long as the root of that
# over the radius: so much of the area over N^(3/2), until the least slip is so many times the largest over N. Slip by
# pressure, which rises steeply towards the edge, hides more. Tractions there do not go as far, or not that way: so much
# of all friction can do. Set on 650 contacts near full slip, on 16 to 64 cells; others: `scripts/error_bars.py`.
_STRIP = 0.25
_BEYOND, _BEYOND_ALIKE = 2.5, 1.0
_IN_STRIP = 0.05


def error_estimates(
    scene: Scene,
    cells: int,
    levels: Sequence[dict[str, float]],
    hidden: Hidden | None = None,
    across: int = _NARROW + 1,
) -> dict[str, float]:
    """`<name>_error` of every scalar in FITS that `levels` has, in the scalar's own unit.

    `levels`: scalars on the mesh of `scene`, then on coarser ones, finest first; `cells`: number of cells in contact;
    `hidden`: what differences between them do not show; `across`: cells in contact along its narrower side.
    """
    dx, dy = scene.mesh.spacing
    # of oblong cells the longer sides count
    per_radius = math.sqrt(cells * min(dx / dy, dy / dx) / math.pi)
    long = across <= _NARROW and cells > _NARROW * across
    if long:
        per_radius = min(per_radius, 0.5 * across)
    case = _Case(scene, levels[0], hidden or Hidden(), per_radius)
    fits = (ALIGNED if scene.moves_by_pressure else ALIKE) if case.aligned else FITS
    hides = case.parts_hidden()
    bars = {}
    for name, fit in fits.items():
        if name in levels[0]:
            bars[name] = case.by_meshes(name, fit, [level[name] for level in levels]) + case.left_by_solver(name)
            bars[name] += hides.get(name, 0.0) * abs(levels[0][name])
    if cells < _FEWEST or long:
        case.add_what_cells_miss(bars)
    if "slip_area" in levels[0]:
        case.add_what_slips(bars, len(levels))
        case.raise_largest_traction(bars)
        case.add_unseen_slip(bars)
        case.balance_power(bars)
    return {f"{name}_error": case.tolerance(name) if case.vanishes(name) else bar for name, bar in bars.items()}


class _Case:
    """One solution: scalars on its own mesh (`finest`), what is hidden, and the scales of its errors.

    `per_radius`: cells per radius of the contact. The methods that begin with a verb change the `bars` they are given,
    by the names of the scalars.
    """

    def __init__(self, scene: Scene, finest: dict[str, float], hidden: Hidden, per_radius: float) -> None:
        self.scene, self.finest, self.hidden, self.per_radius = scene, finest, hidden, per_radius
        self.aligned = scene.discretisation == "aligned"
        force = scene.friction * scene.load
        if "traction_max" in finest:  # where friction is far more than is needed, tractions are what they are
            largest = min(finest["traction_max"], hidden.on_cells)
            force = min(force, _TRACTIONS * largest * finest["contact_area"])
        self.creepage = scene.creepage or Creepage()
        self.fastest = self.creepage.fastest(finest["contact_radius"])  # largest rigid slip, about
        self.power = max(force * self.fastest, abs(finest.get("friction_power", 0.0)))
        moment = force * finest["contact_radius"]
        self.scales = finest | {"force_x": force, "force_y": force, "moment_z": moment, "friction_power": self.power}
        self.slipping = 0.0  # part of the contact
        self.all_slips = False
        if "slip_area" in finest:
            self.scales["slip_area"] = finest["contact_area"]
            self.slipping = finest["slip_area"] / finest["contact_area"]
            self.all_slips = finest["slip_area"] == finest["contact_area"] and hidden.slip.missing == 0.0
        # tractions are mu p where they are largest, where the pressure is
        most = scene.friction * finest.get("pressure_max", math.inf)
        self.at_peak = finest.get("traction_max", 0.0) >= (1.0 - _ROUNDING) * most

    def by_meshes(self, name: str, fit: Fit, values: Sequence[float]) -> float:
        """What the `values` of a scalar on the meshes tell, or the number of cells if there is one mesh only."""
        scale = abs(self.scales[name])
        if len(values) == 1:
            return fit.by_cells(scale, self.per_radius)
        pulling = self.scene.friction if self.scene.is_coupled else 0.0
        by_meshes = fit.by_meshes(values, scale, self.per_radius, self.slipping, pulling)
        few = len(values) == 2 and self.per_radius < _FEW
        return by_meshes * (_ON_FEW[self.scene.discretisation] if few else 1.0)

    def vanishes(self, name: str) -> bool:
        """Whether the contact is its own mirror image so that there is no such force or moment, on any mesh."""
        creepage = self.creepage
        if name == "force_x":
            return creepage.longitudinal == 0.0 and not self.scene.moves_by_pressure
        return name in ("force_y", "moment_z") and creepage.lateral == creepage.spin == 0.0

    def add_what_cells_miss(self, bars: dict[str, float]) -> None:
        """By how much a contact of too few cells, or on too narrow ones, differs from the Hertz contact it is about."""
        finest, (ax, ay) = self.finest, estimated_contact(self.scene)
        pressure = abs(1.5 * self.scene.load / (math.pi * ax * ay) - finest["pressure_max"])
        area = abs(math.pi * ax * ay - finest["contact_area"])
        radius = abs(math.sqrt(ax * ay) - finest["contact_radius"])
        approach = abs(ax * ay / math.sqrt(math.prod(self.scene.radius)) - finest["approach"])
        missed = {
            "pressure_max": pressure,
            "contact_area": area,
            "contact_radius": radius,
            "slip_area": area,
            "traction_max": self.scene.friction * pressure,
            "approach": max(0.5 * radius / finest["contact_radius"] * abs(finest["approach"]), approach),
            "moment_z": 0.6 * self.scales["moment_z"],
        }
        for name in bars:
            bars[name] += missed.get(name, 0.0)

    def left_by_solver(self, name: str) -> float:
        """What the tolerances leave, unsettled directions of slip, and layers too thin for the cells."""
        off = self.hidden.unsettled if name in _BY_FRICTION else 0.0
        by_layers = self.hidden.by_layers
        off += _BY_LAYERS.get(name, 0.0) * max(by_layers, -_BY_SKINS * by_layers)
        return self.tolerance(name) + off * abs(self.scales[name])

    def tolerance(self, name: str) -> float:
        """What the tolerances leave of a scalar's error, in its unit."""
        tolerance = self.scene.tolerance
        return max(tolerance.normal, tolerance.tangential) * abs(self.scales[name])

    def parts_hidden(self) -> dict[str, float]:
        """Of scalars, parts of themselves that soft layers, cusps and the lift by tractions hide."""
        hidden, discretisation = self.hidden, self.scene.discretisation
        of_pressure, of_tractions = (part / self.per_radius for part in _CUSPS[discretisation])
        lift = _LIFT[discretisation] / self.per_radius * abs(hidden.lift)
        return {
            "pressure_max": of_pressure * hidden.cusp_of_pressure + _RAISED * hidden.raised + hidden.at_rim,
            "traction_max": of_tractions * hidden.cusp_of_tractions,
            "approach": lift + _SUNK * hidden.raised,
        }

    def add_what_slips(self, bars: dict[str, float], meshes: int) -> None:
        """Slip areas where all slips, and all that follows from slip where cells show none."""
        scene, finest = self.scene, self.finest
        dx, dy = scene.mesh.spacing
        slip = finest["slip_area"]
        if self.all_slips:
            bars["slip_area"] = bars["contact_area"]
            if self.creepage.turns_within(finest["contact_radius"]):
                bars["slip_area"] += dx * dy  # that may stick around the pole of spin
            else:
                self.add_strip_that_sticks(bars)
        elif finest["traction_max"] == 0.0:
            bars["slip_area"] = self.left_by_solver("slip_area")
        elif not self.hidden.shown:
            if self.aligned:
                bars["slip_area"] += _NARROW_ZONE * slip
            else:
                bars["slip_area"] = max(bars["slip_area"], _UNSEEN / self.per_radius * finest["contact_area"])
            # and what pressure it has, that goes like the root of the distance from the edge
            unseen = (_UNSEEN / self.per_radius) ** 1.5 * self.power
            bars["friction_power"] = max(bars["friction_power"], unseen)
            if self.aligned:  # tractions that grow without bound towards the trailing edge
                for name, part in _STUCK.items():
                    bars[name] += part / self.per_radius * abs(finest[name])
        elif slip and self.aligned and meshes > 1:
            # its borders are found within the contact's edge
            bars["slip_area"] = math.hypot(bars["slip_area"], bars["contact_area"])

    def add_strip_that_sticks(self, bars: dict[str, float]) -> None:
        """What sticks along the leading edge, where slip falls to nothing, in less than a cell; forces know of it."""
        unlike = self.scene.moves_by_pressure
        left = max(1.0 - self.hidden.least_slip * self.per_radius / (_BEYOND if unlike else _BEYOND_ALIKE), 0.0)
        part = left * self.per_radius**-1.5
        bars["slip_area"] += _STRIP * part * self.finest["contact_area"]
        if self.aligned and unlike:
            for name in ("force_x", "force_y", "friction_power"):
                if name in bars:
                    bars[name] += _IN_STRIP * part * self.scales[name]

    def balance_power(self, bars: dict[str, float]) -> None:
        """What creepages put into bodies that are alike goes somewhere: all of it, but for what kalker's cells lose."""
        creepage, finest = self.scene.creepage, self.finest
        if self.scene.moves_by_pressure or creepage is None or not bars.keys() >= _BY_FRICTION:
            return
        lost = abs(finest["friction_power"] + creepage.power(finest["force_x"], finest["force_y"], finest["moment_z"]))
        sizes = Creepage(abs(creepage.longitudinal), abs(creepage.lateral), abs(creepage.spin))
        doubt = sizes.power(bars["force_x"], bars["force_y"], bars["moment_z"])
        if self.aligned and not self.hidden.shown:
            bars["friction_power"] = min(bars["friction_power"], doubt)
        elif not self.aligned:
            bars["friction_power"] = max(bars["friction_power"], lost + doubt)

    def raise_largest_traction(self, bars: dict[str, float]) -> None:
        """The largest traction where nearly all sticks, and where it is that of the largest pressure."""
        finest, friction = self.finest, self.scene.friction
        slip = finest["slip_area"]
        hardly = slip - self.hidden.slip.missing <= _UNSEEN / self.per_radius * finest["contact_area"]
        if hardly and self.aligned:
            bars["traction_max"] += _AT_BORDER * finest["traction_max"]
        elif hardly:
            # where nearly all stick tractions grow like K/sqrt(r) until they meet the bound, p0 sqrt(2 r/a)
            found, bound = finest["traction_max"], friction * finest["pressure_max"] * math.sqrt(2.0 / self.per_radius)
            bars["traction_max"] = max(bars["traction_max"], math.sqrt(_LEADING * found * bound) - found)
        if self.at_peak:
            bars["traction_max"] = friction * bars["pressure_max"]
        elif slip and self.hidden.at_rim > 0.0:  # what slips at the rim carries what pressure there is
            at_rim = friction * finest["pressure_max"] * (1.0 + self.hidden.at_rim)
            bars["traction_max"] = max(bars["traction_max"], at_rim - finest["traction_max"])

    def add_unseen_slip(self, bars: dict[str, float]) -> None:
        """What slip zones at the leading edge hide that are narrower than a cell."""
        slip = self.hidden.slip
        if slip.force <= 0.0:
            return
        bars["force_x"] += _UNDER * abs(slip.force_x)
        bars["force_y"] += _UNDER * abs(slip.force_y)
        bars["moment_z"] += _UNDER * abs(slip.moment_z)
        bars["friction_power"] += _UNDER * (slip.force * self.fastest + slip.power)
        bars["traction_max"] += 0.5 * slip.force / self.finest["contact_area"]
        bars["slip_area"] += 0.0 if self.all_slips else 0.4 * slip.area
