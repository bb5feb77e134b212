"""Estimates of the discretisation error of each scalar, from the coarser meshes on which each solution is started.

`fits.py` estimates it from the differences between these meshes and from N, the number of cells per radius of the
contact. Here the other contributions are added:

- Contacts without a coarser mesh have the errors that contacts on so few cells have (`few.py`). Those with one coarser
  mesh have at least half of these below twelve cells across, or all of it (`_OF_FEW`, `_BY_PLACE`).
- The slip area with `aligned` has the error of the contact area, too, in quadrature, unless no cell slips. Zones of
  slip or of stick narrower than a cell have errors of their own (`narrow.py`).
- The largest traction, where it is mu times the largest pressure, has the error of that pressure. Both have parts of
  their own at cusps, rims and between cells (`peaks.py`).
- The friction power equals that of the creepages and of tractions on slip by pressure. The difference of the two, with
  `kalker`, is a known error (`balance_power`, `pressed.least_power`).
- Estimates of forces along y and of moments fall with the creepages where bodies slip by pressure (`_BY_CREEPAGE`).
- What pressure, not creepage, makes surfaces slip has parts of its own (`pressed.py`), as have edges under strong
  friction (`pulled.py`), layers thinner than a cell (`thin_layers.py`), films much softer than the bodies (`films.py`),
  long contacts and the pole of spin (`elongated.py`).
- With `aligned` whole bars are narrowed in kinds of contacts where more than 95 in 100 hold (`coverage.py`).
- All estimates include what the solver's tolerances leave, and errors that all meshes have in common (`hidden.py`).
- Forces, slip areas and largest tractions are not in doubt by more than the load and friction allow (`bounds.py`).

Forces and moments that vanish by symmetry have only what the solver leaves as error bar (`by_odd_creepage`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

from rcstudy.bars import bounds, coverage, elongated, few, films, narrow, peaks, pressed, pulled, skins, thin_layers
from rcstudy.bars.fits import ALIGNED, ALIKE, COUPLED, FITS, Fit
from rcstudy.bars.hidden import Hidden
from rcstudy.mechanics.normal import estimated_contact
from rcstudy.mechanics.scene import Creepage, Scene

# With fewer cells per radius and only one coarser mesh the estimate by meshes is too small, as that mesh, of three to
# six cells, may agree by chance: it is multiplied by these factors (set on 500 contacts) and is no less than half of
# what so few cells miss (`few.py`); than all of it where errors depend on how edges lie between cells (`_BY_PLACE`).
# That of the largest pressure with `aligned` is too small on more cells as well: round contacts 21 to 23 cells across
# hardly differ from those on half as many (1400 contacts).
_FEW = 6.0
_ON_FEW = {"kalker": 1.15, "aligned": 1.2}
_OF_FEW = 0.5
_BY_PLACE = {"pressure_max", "contact_area", "contact_radius", "approach", "traction_max", "moment_z"}
_PEAK_ON_TWO = 1.85

_LIFT = {"kalker": 0.35, "aligned": 0.03}  # relative error of tractions, and so of their lift, times N
# Errors of forces along y and of moments of bodies that slip by pressure fall, where creepages are small, with this
# multiple of the force that these cause where all sticks, over the friction force, to the power `_FALLING`. (Without it
# 97 to 98 in 100 bars hold in contacts that hardly slip, and are more than six times the error.)
_BY_CREEPAGE, _FALLING = 2.0, 1.0 / 3.0
# Forces and moments that vanish by symmetry, over their scales and what directions of slip are unsettled by: these need
# not be symmetric. (49 such numbers of 720 contacts by spin or longitudinal creepage alone: at most 0.14, 11 beyond the
# tolerance.)
_ASYMMETRY = 0.15
# Largest error of forces by a small creepage, over the force, about, that it causes where all sticks. (Of 600 forces
# across and moments of 300 random contacts under lateral creepage and spin of 1e-6 to 0.03 times the others none is off
# by more than half of that force, some on one to four cells by more than twice; bars are up to 1e5 times the error
# without it. That force follows from how far bodies yield to pressure; plates yield up to thousands of times less to
# tractions, so it is more by `Hidden.stiffer_across` there.)
_STICKING = 4.0
_ROUNDING = 1e-9
_BY_FRICTION = {"friction_power", "force_x", "force_y", "moment_z"}


def error_estimates(
    scene: Scene,
    cells: int,
    levels: Sequence[dict[str, float]],
    hidden: Hidden | None = None,
) -> dict[str, float]:
    """Error bars `<name>_error` of every scalar in FITS that `levels` has, in the scalar's own unit.

    `levels`: scalars on the mesh of `scene`, then on coarser ones, finest first; `cells`: number of cells in contact;
    `hidden`: errors that differences between the meshes do not show.
    """
    case = _Case(scene, levels[0], hidden or Hidden(), elongated.shape(scene, cells))
    fits = (ALIGNED if scene.moves_by_pressure else ALIKE) if case.aligned else FITS
    if scene.is_coupled:
        fits = fits | COUPLED[scene.discretisation]
    hides = case.parts_hidden()
    factors = [case.shape.of_edges, case.shape.of_rows] if case.aligned else []
    factors += [] if case.all_slips else [pulled.of_peaks(case.hidden.pull, aligned=case.aligned)]
    bars = {}
    for name, fit in fits.items():
        if name in levels[0]:
            by_meshes = case.by_meshes(name, fit, [level[name] for level in levels])
            by_meshes = math.hypot(by_meshes, case.besides_meshes(name))
            of_cells = by_meshes + hides.get(name, 0.0) * abs(levels[0][name])
            bars[name] = math.prod(factor.get(name, 1.0) for factor in factors) * of_cells + case.unscaled(name)
    case.add_squeezed_films(bars)
    if "slip_area" in levels[0]:
        case.add_turned_force(bars)
        if len(levels) == 1 and case.on_few:  # the laws of few cells hold for all parts of the errors
            if case.at_peak:
                bars["traction_max"] = scene.friction * bars["pressure_max"]
            case.add_pole_of_spin(bars, few_cells=True)
            case.add_length(bars)
        else:
            case.add_lift_at_edges(bars)
            case.add_slip_without_creepage(bars)
            case.add_what_slips(bars, len(levels))
            case.raise_largest_traction(bars, len(levels))
            case.add_unseen_slip(bars)
            case.add_skin_at_edge(bars)
            case.add_slip_by_pressure(bars)
            case.add_pole_of_spin(bars)
            case.add_island_that_sticks(bars)
            case.add_length(bars)
            case.balance_power(bars)
    if len(levels) > 1 and case.aligned:
        case.cover(bars)
    bars = bounds.within(bars, levels[0], scene)
    return {f"{name}_error": min(bar, case.by_odd_creepage(name)) for name, bar in bars.items()}


class _Case:
    """One solution: scalars on its own mesh (`finest`), hidden errors, and the scales of its errors.

    `shape`: that of the contact. Methods with an argument `bars` (error bars by the names of the scalars) change it in
    place.
    """

    def __init__(self, scene: Scene, finest: dict[str, float], hidden: Hidden, shape: elongated.Shape) -> None:
        self.scene, self.finest, self.hidden = scene, finest, hidden
        self.shape, self.per_radius = shape, shape.per_radius  # N
        self.aligned = scene.discretisation == "aligned"
        force = scene.friction * scene.load
        if "traction_max" in finest:  # tractions far below the bound limit forces more than mu P does
            largest = min(finest["traction_max"], hidden.largest_of_cells)
            force = min(force, few.BY_TRACTION * largest * finest["contact_area"])
        self.creepage = scene.creepage or Creepage()
        self.fastest = self.creepage.fastest(finest["contact_radius"])  # largest rigid slip, about
        slip = self.fastest
        if not self.aligned:
            slip += few.BY_PRESSURE * pressed.of_edges(self.peaked) * hidden.by_pressure
        self.power = max(force * slip, abs(finest.get("friction_power", 0.0)))
        moment = force * finest["contact_radius"]
        self.scales = finest | {"force_x": force, "force_y": force, "moment_z": moment, "friction_power": self.power}
        self.slipping = 0.0  # part of the contact
        self.all_slips = False
        if "slip_area" in finest:
            self.scales["slip_area"] = finest["contact_area"]
            self.slipping = finest["slip_area"] / finest["contact_area"]
            self.all_slips = finest["slip_area"] == finest["contact_area"] and hidden.slip.missing == 0.0
        # whether the largest traction is mu p at the largest pressure
        most = scene.friction * finest.get("pressure_max", math.inf)
        self.at_peak = hidden.slips_at_top and finest.get("traction_max", 0.0) >= (1.0 - _ROUNDING) * most

    @cached_property
    def on_few(self) -> bool:
        """Whether the contact is less than twelve cells across its narrower side."""
        return self.per_narrow_radius < (1.0 - _ROUNDING) * _FEW

    @cached_property
    def per_narrow_radius(self) -> float:
        """Cells per radius across the narrower side (`few.cells_per_radius`)."""
        return few.cells_per_radius(self.scene, self.per_radius)

    @cached_property
    def peaked(self) -> float:
        """Excess of m over Hertz's 1/2, at least 0, of pressures like p0 (1 - r^2/a^2)^m.

        Largest pressures are m + 1 times the mean ones. m is 1 and 2 on thin compressible and incompressible films.
        """
        return max(self.finest["pressure_max"] * self.finest["contact_area"] / self.scene.load - 1.5, 0.0)

    @cached_property
    def of_small_creepage(self) -> float:
        """Factor on errors of forces along y and of moments: pressure causes forces along x only (`_BY_CREEPAGE`)."""
        force = self.scales["force_x"]
        if not self.scene.moves_by_pressure or force == 0.0:
            return 1.0
        sticking = self.sticking_force(self.finest["contact_radius"], self.fastest)
        return math.pow(min(1.0, _BY_CREEPAGE * sticking / force), _FALLING)

    def sticking_force(self, radius: float, slip: float) -> float:
        """Force (N), by a rigid `slip` (-) where all sticks, about: within `_STICKING` times it, also under plates."""
        force = few.sticking_force(self.scene, radius, slip)
        return force * max(1.0, self.hidden.stiffer_across / _STICKING)

    def by_meshes(self, name: str, fit: Fit, values: Sequence[float]) -> float:
        """Estimate from the `values` of a scalar on the meshes; from the number of cells if there is only one mesh."""
        scale = abs(self.scales[name])
        if len(values) == 1:
            return self.by_few_cells(name) if self.on_few else fit.by_cells(scale, self.per_radius)
        pulling = self.scene.friction if self.scene.is_coupled else 0.0
        if name in ("force_y", "moment_z"):
            scale *= self.of_small_creepage
        by_meshes = fit.by_meshes(values, scale, self.per_radius, self.slipping, pulling)
        if self.hidden.top_at_border and not self.aligned:
            by_meshes = max(by_meshes, pulled.beside_cusp(self.hidden.pull, self.per_radius).get(name, 0.0) * scale)
        elif self.hidden.top_at_border and name == "pressure_max":
            by_meshes = max(by_meshes, peaks.at_cusp((values[0], values[1])))
        if len(values) > 2:
            return by_meshes
        if self.per_radius < _FEW:
            part = 1.0 if name in _BY_PLACE else _OF_FEW
            return max(by_meshes * _ON_FEW[self.scene.discretisation], part * self.by_few_cells(name))
        by_meshes *= _PEAK_ON_TWO if self.aligned and name == "pressure_max" else 1.0
        least = few.LEAST[self.scene.discretisation].get(name, 0.0)
        return max(by_meshes, least * self.by_few_cells(name)) if least else by_meshes

    def by_few_cells(self, name: str) -> float:
        """Estimate from the number of cells by the laws of few cells (`few.py`)."""
        scene = self.scene
        law = few.laws(scene)[name]
        part = law.at(self.per_narrow_radius, few.ORDER[scene.discretisation])
        return part * self.scales_on_few[name]

    @cached_property
    def scales_on_few(self) -> dict[str, float]:
        """Scales of the errors by the laws of few cells (`few.scales`)."""
        return few.scales(self.scene, self.finest, self.hidden.largest_of_cells, self.hidden.by_pressure)

    def odd_creepage(self, name: str) -> float | None:
        """Rigid slip (-) without which a force or moment vanishes by the mirror symmetry of the contact, on any mesh.

        None of other scalars.
        """
        creepage = self.creepage
        if name == "force_x" and not self.scene.moves_by_pressure:
            return abs(creepage.longitudinal)
        if name in ("force_y", "moment_z"):
            return math.hypot(creepage.lateral, creepage.spin * self.finest["contact_radius"])
        return None

    def unscaled(self, name: str) -> float:
        """What no factor on a bar changes: left by tolerances, unsettled directions, layers too thin for the cells."""
        off = self.hidden.unsettled if name in _BY_FRICTION else 0.0
        off += thin_layers.by_layers(self.hidden, name, self.slipping) + films.of_compliance(self.hidden, name)
        return self.tolerance(name) + off * abs(self.scales[name])

    def by_odd_creepage(self, name: str) -> float:
        """Largest error of a force or moment by the creepage without which it vanishes: as where all sticks.

        To this come the tolerances and unsettled directions of slip, which need not be symmetric. Infinite of others.
        """
        slip = self.odd_creepage(name)
        if slip is None:
            return math.inf
        radius = self.finest["contact_radius"]  # of contacts smaller than a cell far too large
        smaller = min(radius, math.sqrt(math.prod(estimated_contact(self.scene))))
        sticking = _STICKING * self.sticking_force(smaller, slip) * (radius if name == "moment_z" else 1.0)
        return sticking + self.tolerance(name) + _ASYMMETRY * self.hidden.unsettled * abs(self.scales[name])

    def tolerance(self, name: str) -> float:
        """Error that the solver's tolerances leave in a scalar, in its unit."""
        tolerance = self.scene.tolerance
        return max(tolerance.normal, tolerance.tangential) * abs(self.scales[name])

    def parts_hidden(self) -> dict[str, float]:
        """Relative errors of scalars from layers and rims (`Hidden`), cusps and the lift by tractions."""
        hidden, discretisation = self.hidden, self.scene.discretisation
        cusp_of_pressure, cusp_of_traction = peaks.of_cusps(hidden, discretisation)
        lift = _LIFT[discretisation] / self.per_radius * abs(hidden.lift)
        between = 0.0 if self.aligned else peaks.between_cells(self.peaked, self.per_radius)
        pressure_in_skin, traction_in_skin = skins.at_cusp(hidden, discretisation)
        at_border = max(cusp_of_pressure + pressure_in_skin, peaks.at_border(hidden, self.per_radius))
        missed = hidden.at_rim + peaks.beyond_rim(hidden, discretisation) + hidden.at_pole + between
        return {
            "pressure_max": at_border + thin_layers.of_peak(hidden) + missed,
            "traction_max": cusp_of_traction + traction_in_skin,
            "approach": lift + thin_layers.of_approach(hidden),
        }

    @cached_property
    def lost_force(self) -> float:
        """Error of the force along x (N) by slip by pressure that cells miss on films."""
        return films.of_missed_slip(self.hidden, self.scene, self.slipping, self.per_radius)

    def besides_meshes(self, name: str) -> float:
        """What is added in quadrature: to areas, the force along x and the power on films, to others on stiff skins."""
        hidden, scale = self.hidden, abs(self.scales[name])
        if name == "friction_power" and not self.aligned:
            return 0.0
        if name == "force_x":
            off = self.lost_force
        elif name == "friction_power":
            off = self.lost_force * self.fastest
        elif self.aligned and hidden.pull_under_skin:
            off = pulled.under_skins(name, hidden.pull_under_skin, self.per_radius, self.slipping) * scale
        else:
            off = films.of_moved_edges(hidden, name) * scale
        return math.hypot(off, skins.at_edges(hidden, name, self.slipping, self.per_radius) * scale)

    def add_squeezed_films(self, bars: dict[str, float]) -> None:
        """Add, in quadrature, what the largest pressure is off by where the approach is, on incompressible films."""
        if not bars.keys() >= {"pressure_max", "approach"}:
            return
        over_approach = films.of_squeezed(self.hidden, self.peaked) * self.finest["pressure_max"]
        off = over_approach * bars["approach"] / self.finest["approach"]
        bars["pressure_max"] = math.hypot(bars["pressure_max"], off)

    def add_what_slips(self, bars: dict[str, float], meshes: int) -> None:
        """Set the bar of the slip area and, where no cell slips, those of power, forces and moment."""
        scene, finest = self.scene, self.finest
        dx, dy = scene.mesh.spacing
        slip, unseen = finest["slip_area"], narrow.unseen_zone(self.per_radius)
        if self.all_slips:
            bars["slip_area"] = bars["contact_area"]
            if self.shape.away < 1.0:
                bars["slip_area"] += dx * dy  # a cell may stick around the pole of spin
            else:
                self.add_strip_that_sticks(bars)
        elif finest["traction_max"] == 0.0:
            bars["slip_area"] = self.unscaled("slip_area")
        elif not self.hidden.slip_shown:
            if self.aligned:
                bars["slip_area"] += narrow.corrected_zone(slip)
                for name, part in narrow.singular_tractions(self.per_radius).items():
                    bars[name] += part * abs(finest[name])
            else:
                bars["slip_area"] = max(bars["slip_area"], unseen * finest["contact_area"])
            # pressure goes like the root of the distance from the edge, so power like the width of the zone to 3/2
            bars["friction_power"] = max(bars["friction_power"], unseen**1.5 * self.power)
        elif slip and self.aligned and meshes > 1:
            # the slip zone ends at the edge of the contact, whose error it shares
            sticks = narrow.stick_in_slip(1.0 - self.slipping, self.per_radius, self.shape.longer)
            of_area = bars["contact_area"], sticks * finest["contact_area"]
            bars["slip_area"] = math.hypot(bars["slip_area"], *of_area)

    def add_strip_that_sticks(self, bars: dict[str, float]) -> None:
        """Add what may stick in a strip narrower than a cell at the leading edge, where slip vanishes (`narrow.py`)."""
        unlike = self.scene.moves_by_pressure
        of_area, of_forces = narrow.strip_that_sticks(self.hidden.least_slip, self.per_radius, unlike=unlike)
        bars["slip_area"] += of_area * self.finest["contact_area"]
        if self.aligned and unlike:
            for name in ("force_x", "force_y", "friction_power"):
                if name in bars:
                    bars[name] += of_forces * self.scales[name]

    def add_slip_by_pressure(self, bars: dict[str, float]) -> None:
        """Add what `aligned` misses of the power of tractions on slip by pressure, in quadrature."""
        if self.aligned and "friction_power" in bars:
            over_force = pressed.power(self.hidden, self.fastest, self.per_radius, self.peaked)
            bars["friction_power"] = math.hypot(bars["friction_power"], over_force * self.scales["force_x"])

    def add_turned_force(self, bars: dict[str, float]) -> None:
        """Add what `aligned` misses of forces where pressure decides which way surfaces slip."""
        if self.aligned and "force_x" in bars:
            bars["force_y"] *= pressed.turned_across(self.hidden)
            part = pressed.turned_force(self.hidden, self.fastest, self.per_radius)
            bars["force_x"] = math.hypot(bars["force_x"], part * self.scales["force_x"])

    def add_slip_without_creepage(self, bars: dict[str, float]) -> None:
        """Add what is missed where pressure alone makes surfaces slip (`pressed.py`)."""
        scene, hidden, scale = self.scene, self.hidden, self.scales["force_x"]
        limited = scale / force if (force := scene.friction * scene.load) > 0.0 else 1.0
        for name, factor in pressed.wider(hidden, scene.discretisation, self.fastest).items():
            if name in bars:
                bars[name] *= factor
        lost_power = self.lost_force * hidden.by_pressure * films.AT_EDGES / self.per_radius
        parts = pressed.missed_on_films(hidden, scene.friction, self.finest, limited, lost_power)
        part = pressed.force_without_creepage(hidden, scene.discretisation, self.fastest, self.per_radius)
        parts["force_x"] = part * scale
        for name in parts.keys() & bars.keys():
            bars[name] += parts[name]
        if "friction_power" in bars:
            least = pressed.least_power(hidden, scene.discretisation, self.fastest, lost_power)
            bars["friction_power"] = max(bars["friction_power"], least)

    def add_lift_at_edges(self, bars: dict[str, float]) -> None:
        """Add what `aligned` misses of the lift by tractions at the edges of the contact (`pulled.py`)."""
        if self.aligned:
            parts = pulled.at_edges(self.hidden.pull, self.per_radius, self.slipping)
            for name in parts.keys() & bars.keys():
                bars[name] += parts[name] * self.scales[name]

    def add_pole_of_spin(self, bars: dict[str, float], *, few_cells: bool = False) -> None:
        """Add what is missed of forces, moment, power around a pole of spin within the slip zone (`elongated.py`).

        `few_cells`: the bars follow from the laws of few cells, which have it but for long cells, as those of `kalker`.
        """
        shape, spin = self.shape, abs(self.creepage.spin)
        if shape.away >= 1.0 or "force_x" not in bars:
            return
        by_cells, by_length = shape.at_pole(self.slipping)
        by_cells = 0.0 if few_cells or not self.aligned else by_cells
        of_moment = (by_cells + by_length) * elongated.OFF_POLE * self.scales["moment_z"]
        if self.aligned:  # the power is that of the moment about the pole
            about_pole = spin * bars["moment_z"] * shape.slips_at_pole(self.slipping) * (1.0 - shape.away)
            bars["friction_power"] = max(bars["friction_power"], about_pole) + spin * of_moment
        for name, arm in (("force_x", 1.0), ("force_y", 1.0), ("moment_z", math.hypot(*self.creepage.pole))):
            scale = self.scales["force_x"] * arm
            bars[name] = math.hypot(bars[name] + by_cells * scale, by_length * scale)
        bars["moment_z"] += of_moment

    def add_island_that_sticks(self, bars: dict[str, float]) -> None:
        """Add what `aligned` misses of an island that sticks around the pole of spin (`elongated.py`)."""
        if self.aligned and "moment_z" in bars:
            of_area, of_moment = self.shape.of_island(self.slipping)
            bars["slip_area"] = math.hypot(bars["slip_area"], of_area * self.scales["slip_area"])
            if self.scene.moves_by_pressure:
                bars["moment_z"] += of_moment * self.scales["moment_z"]

    def add_length(self, bars: dict[str, float]) -> None:
        """Add, in quadrature, what is missed in contacts that are long one way (`elongated.py`)."""
        force = min(self.scales["force_x"], few.sticking_force(self.scene, self.finest["contact_radius"], self.fastest))
        if force == 0.0:
            return
        if self.aligned:
            errors = self.shape.of_length(self.slipping, self.creepage.spin, self.fastest, self.hidden.turning)
        else:
            errors = self.shape.of_length_first_order(self.slipping)
        over_friction = self.finest["contact_area"] / (self.scene.friction * self.scene.load)
        for name in errors.keys() & bars.keys():
            bars[name] = math.hypot(bars[name], errors[name] * force * (over_friction if name == "slip_area" else 1.0))

    def balance_power(self, bars: dict[str, float]) -> None:
        """Bound the power of quasi-identical bodies by its balance: friction takes the power of the creepages.

        `kalker` misses that balance by a known error; with `aligned`, where no cell slips, errors of forces limit that
        of the power.
        """
        creepage, finest = self.scene.creepage, self.finest
        if self.scene.moves_by_pressure or creepage is None or not bars.keys() >= _BY_FRICTION:
            return
        lost = abs(finest["friction_power"] + creepage.power(finest["force_x"], finest["force_y"], finest["moment_z"]))
        sizes = Creepage(abs(creepage.longitudinal), abs(creepage.lateral), abs(creepage.spin))
        doubt = sizes.power(bars["force_x"], bars["force_y"], bars["moment_z"])
        if self.aligned and not self.hidden.slip_shown:
            bars["friction_power"] = min(bars["friction_power"], doubt)
        elif not self.aligned:
            bars["friction_power"] = max(bars["friction_power"], lost + doubt)

    def cover(self, bars: dict[str, float]) -> None:
        """Narrow bars to what is needed in this kind of contact (`coverage.py`), all but `unscaled`.

        The largest traction at the largest pressure goes with that. Slip areas that are all of the contact stay.
        """
        scene = self.scene
        factors = coverage.factors(
            few=self.on_few, coupled=scene.is_coupled, peaked=self.peaked, unlike=scene.moves_by_pressure
        )
        for name in bars.keys() & factors.keys():
            if name != "slip_area" or not self.all_slips:
                left = self.unscaled(name)
                bars[name] = min(bars[name], left + factors[name] * (bars[name] - left))
        if self.at_peak:
            bars["traction_max"] = scene.friction * bars["pressure_max"]

    def raise_largest_traction(self, bars: dict[str, float], meshes: int) -> None:
        """Set the bar of the largest traction where nearly all sticks, or where it follows from the pressure.

        Before that it is raised, with `kalker`, where pressures are more peaked than Hertz's.
        """
        finest, friction = self.finest, self.scene.friction
        slip = finest["slip_area"]
        part = (slip - self.hidden.slip.missing) / finest["contact_area"]
        width = part * self.per_radius
        if self.aligned:
            if meshes == 2 and 0.0 < self.slipping < 1.0:
                on_two = narrow.traction_on_two(part * self.shape.along) * finest["traction_max"]
                bars["traction_max"] = math.hypot(bars["traction_max"], on_two)
            bars["traction_max"] += narrow.traction_at_border(width) * finest["traction_max"]
            around_pole = self.shape.border_around_pole * finest["traction_max"]
            missed = films.of_missed_traction(self.hidden, self.slipping) if self.scene.is_coupled else 0.0
            bars["traction_max"] = math.hypot(bars["traction_max"], around_pole, missed * finest["pressure_max"])
        else:
            bars["traction_max"] *= peaks.of_peaked_tractions(self.peaked)
            of_zone = finest["traction_max"], width, friction * finest["pressure_max"], self.per_radius
            bars["traction_max"] = max(bars["traction_max"], narrow.traction_beyond_cells(*of_zone))
        if self.at_peak:
            bars["traction_max"] = friction * bars["pressure_max"]
        elif slip and self.hidden.at_rim > 0.0:  # cells that slip at the rim carry mu times the pressure there
            at_rim = friction * finest["pressure_max"] * (1.0 + self.hidden.at_rim)
            bars["traction_max"] = max(bars["traction_max"], at_rim - finest["traction_max"])

    def add_skin_at_edge(self, bars: dict[str, float]) -> None:
        """Add, in quadrature, what `aligned` misses of tractions and slip by layers thinner than a cell."""
        finest = self.finest
        if self.hidden.skin[0] == 0.0 or not self.aligned:
            return
        of_contact = self.scene.friction, finest["contact_radius"], self.slipping
        sticks, turned = thin_layers.skin_at_edge(self.hidden, *of_contact)
        for name in ("force_x", "slip_area"):
            bars[name] = math.hypot(bars[name], sticks * self.scales[name])
        of_power = thin_layers.power_at_edge(self.hidden, sticks, self.fastest) * self.scales["force_x"]
        bars["friction_power"] = math.hypot(bars["friction_power"], of_power)
        across = turned * abs(finest["force_x"])
        bars["force_y"] = math.hypot(bars["force_y"], across)
        bars["moment_z"] = math.hypot(bars["moment_z"], across * finest["contact_radius"])

    def add_unseen_slip(self, bars: dict[str, float]) -> None:
        """Add the errors due to slip zones narrower than a cell at the leading edge.

        The largest traction at the largest pressure has none of them, nor the slip area if all cells slip.
        """
        slip = self.hidden.slip
        if slip.doubtful_force <= 0.0:
            return
        errors = narrow.leading_zones(slip, self.fastest, pressed.of_edges(self.peaked), self.finest["contact_area"])
        if self.at_peak:
            del errors["traction_max"]
        if self.all_slips:
            del errors["slip_area"]
        for name, error in errors.items():
            bars[name] += error
