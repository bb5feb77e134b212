"""Solution of scenes: runs the solvers, computes the proof and sets the status; a failed case raises no exception."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from rcstudy.bars.estimate import error_estimates
from rcstudy.bars.hidden import Hidden, close_to_border, least_over_largest
from rcstudy.errors import place_of
from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.aligned_coupled import solve_aligned_coupled
from rcstudy.mechanics.contact import NormalContact, solve_normal, solve_rolling
from rcstudy.mechanics.coupled import solve_coupled
from rcstudy.mechanics.jit import seconds_of_compiling
from rcstudy.mechanics.kernels import arrays
from rcstudy.mechanics.layered import BeyondRounding
from rcstudy.mechanics.normal import estimated_contact, initial_gap, solve_pressure
from rcstudy.mechanics.proof import failures, prove_normal, prove_rolling, slips
from rcstudy.mechanics.rolling import UNSETTLED, RollingSolution, within
from rcstudy.mechanics.scene import Creepage, Scene
from rcstudy.mechanics.series import Series
from rcstudy.mechanics.stopping import pressure_tolerance
from rcstudy.mechanics.subcell.pole import rise_at_pole
from rcstudy.mechanics.subcell.slip_zone import SlipZone
from rcstudy.mechanics.subcell.unseen import Unseen, part_within
from rcstudy.mechanics.turns import one_at_a_time
from rcstudy.result import VARIABLES, CellState, Result, Status, expected_scalars

_NOTHING = 1e-6  # tractions over their bounds that count as none: no pressure is sharp enough for them
_POLISHES = 4  # times that the tolerance is divided by ten where the proof fails


class Refusal(Exception):
    """Raised for a scene that is not solved, with the reason."""


def solve_scene(scene: Scene) -> Result:
    """Result of one scene; see `solve_group`."""
    return next(iter(solve_group([scene])))


def solve_group(scenes: Sequence[Scene], *, series: bool = False) -> Iterator[Result]:
    """Solve scenes that share one normal problem and yield a :class:`Result` for each, in order.

    The pressure is solved for once, except under full coupling, where each scene has its own.

    `series`: start the tractions of a scene from those of a close creepage. Results then depend on the order of the
    scenes: with `kalker` within the tolerance, with `aligned` see docs/scaling.md.

    Every failure becomes a status with its reason. The time for the shared pressure is included in the first scene's,
    that for compiling kernels in none.
    Threads of one process take turns, scene by scene.
    """
    shared: _Shared | None = None
    for scene in scenes:
        with one_at_a_time():
            start = time.perf_counter() - seconds_of_compiling()
            try:
                scene = scene.joined
                if scene.conflicts:
                    raise Refusal("; ".join(scene.conflicts.values()))
                if scene.is_coupled:
                    result = _solve_coupled(scene)
                else:
                    shared = shared or _Shared(scene, series)
                    result = _normal_failure(shared.contact) or shared.result(scene)
            except (Refusal, BeyondRounding) as refusal:
                result = Result(Status.REFUSED, str(refusal))
            except Exception as error:  # a batch must go on: any failure of one case becomes its status
                reason = f"{type(error).__name__}: {error}, in {place_of(error)}"
                if isinstance(error, OverflowError | ZeroDivisionError):
                    reason = f"beyond the range of floating point numbers ({reason})"
                result = Result(Status.ERROR, reason)
            result.scalars["solve_seconds"] = time.perf_counter() - seconds_of_compiling() - start
        yield result


def _normal_failure(contact: NormalContact) -> Result | None:
    """The result of all scenes with this pressure if it was not found or reaches the window's edge, else None."""
    solution = contact.solution
    # first, as what rounding leaves unfinished may reach the edge though the contact does not
    if not solution.converged and contact.scene.tolerance.normal < solution.attainable:
        return Result(
            Status.REFUSED,
            f"tolerance.normal {contact.scene.tolerance.normal:g} is below what rounding allows, "
            f"about {solution.attainable:.0e}",
        )
    if solution.edge:
        size = contact.scene.mesh.size
        return Result(
            Status.REFUSED,
            f"the contact reaches the edge of the {size[0]:g} x {size[1]:g} mm window: enlarge mesh.size, or "
            "mesh.margin where it is auto",
        )
    if not solution.converged:
        return Result(
            Status.NOT_CONVERGED,
            f"pressure: residual {solution.residual:.3g} after {solution.iterations} iterations, "
            f"tolerance {contact.scene.tolerance.normal:g}",
            {
                "residual_normal": solution.residual,
                "iterations_normal": solution.iterations,
                "products_normal": solution.products,
            },
        )
    return None


def _solve_coupled(scene: Scene) -> Result:
    """Result of `scene` with full coupling of pressure and tractions."""
    contact: NormalContact
    contact, rolling = solve_aligned_coupled(scene) if scene.discretisation == "aligned" else solve_coupled(scene)
    return _normal_failure(contact) or _result(contact, scene, rolling)


class _Shared:
    """The pressure that one-way scenes share, its proof and, with `series`, the tractions found so far.

    `proof` exists only if `_normal_failure(contact)` is None, that is, if the pressure was found.
    """

    def __init__(self, scene: Scene, series: bool) -> None:
        self.contact = self._normal = solve_normal(scene)
        if _normal_failure(self._normal) is None:
            self._normal, self.proof = _polished_pressure(self._normal, scene)
            self.contact = _on_rows(self._normal)
        self._series = Series(self.contact.contact_radius) if series else None
        self._sharper: dict[float, tuple[NormalContact, dict[str, float]] | None] = {}  # by tolerance

    def result(self, scene: Scene) -> Result:
        """Result of `scene` under this pressure."""
        if scene.creepage is None:
            return _result(self.contact, scene, None, self.proof)
        neighbour = self._series.neighbour(scene) if self._series is not None else None
        rolling = solve_rolling(self.contact, scene, neighbour=neighbour)
        if self._series is not None:
            self._series.add(scene, rolling)
        return self._under_sharper_pressure(scene, rolling) or _result(self.contact, scene, rolling, self.proof)

    def _under_sharper_pressure(self, scene: Scene, rolling: RollingSolution) -> Result | None:
        """Result under a pressure of a lower tolerance than the one that all share, with its own proof.

        None if the tractions of `rolling` do not need one (`stopping.pressure_tolerance`), or it cannot be had.
        """
        bounds, tractions = scene.friction * arrays.norm2(self.contact.pressure[None]), arrays.norm2(rolling.q)
        if scene.method != "newton" or not rolling.converged or tractions <= _NOTHING * bounds:
            return None
        tolerance = max(pressure_tolerance(scene.tolerance, bounds / tractions), self._normal.solution.attainable)
        sharper = self._sharper_contact(scene, tolerance) if tolerance < scene.tolerance.normal else None
        if sharper is None:
            return None
        contact, proof = sharper
        same = np.array_equal(contact.cells, self.contact.cells)
        guess = within(rolling.q, scene.friction * contact.pressure) if same else None
        further = solve_rolling(contact, scene, guess).after(rolling)
        return _result(contact, scene, further, proof) if further.converged else None

    def _sharper_contact(self, scene: Scene, tolerance: float) -> tuple[NormalContact, dict[str, float]] | None:
        """The contact with its pressure solved further to `tolerance`, and the proof of that; made once.

        None if it does not get there, or is there already.
        """
        if tolerance not in self._sharper:
            normal, found = _sharpened(self._normal, scene, tolerance), None
            if normal is not None and normal.solution.iterations > self._normal.solution.iterations:
                # the coarser meshes are those of the contact with the pressure that all share
                found = _on_rows(normal, self.contact.coarser), prove_normal(normal, scene)
            self._sharper[tolerance] = found
        return self._sharper[tolerance]


def _on_rows(contact: NormalContact, coarser: NormalContact | None = None) -> NormalContact:
    """The contact on rows moved to its edge, if it is to be `aligned`; `coarser`: on such rows already."""
    return AlignedContact(contact, coarser) if contact.scene.discretisation == "aligned" else contact


def _sharpened(contact: NormalContact, scene: Scene, tolerance: float) -> NormalContact | None:
    """The contact without tractions, its pressure solved further to `tolerance`; None if it does not get there."""
    finer = replace(scene, tolerance=replace(scene.tolerance, normal=tolerance))
    solution = solve_pressure(finer, contact.influence, initial_gap(scene), contact.solution.p)
    if not solution.converged or solution.edge:
        return None
    return NormalContact(scene, contact.influence, solution.after(contact.solution), coarser=contact.coarser)


def _result(
    contact: NormalContact,
    scene: Scene,
    rolling: RollingSolution | None,
    proof_of_pressure: dict[str, float] | None = None,
) -> Result:
    """Result from a solution, with proof and status.

    Without `proof_of_pressure` the pressure is proved here, including the lift by the tractions of `rolling`.
    """
    fields, scalars = {"pressure": contact.solution.p}, _normal_numbers(contact)
    status, reasons = Status.SOLVED, []
    proof_of_tractions: dict[str, float] = {}
    zone, unseen = None, Unseen()
    if rolling is not None:
        rolling, proof_of_tractions = _polished(contact, scene, rolling)
        fields |= _rolling_fields(contact, scene, rolling)
        unseen = contact.unseen_slip(rolling, scene.friction)
        zone = contact.slip_zone(rolling, scene.friction)
        scalars |= _rolling_numbers(contact, scene, rolling, zone, unseen)
        if rolling.unsettled > UNSETTLED:
            status = Status.NOT_CONVERGED
            reasons.append(
                f"tractions: directions of slip at the centres of cells do not settle, by {rolling.unsettled:.2g} of "
                "the bound"
            )
        if not rolling.converged:
            status = Status.NOT_CONVERGED
            reasons.append(
                f"tractions: residual {rolling.residual:.4g} after {rolling.iterations} iterations, "
                f"tolerance {scene.tolerance.tangential:g}"
            )
    proof = proof_of_pressure or prove_normal(contact, scene, None if rolling is None else rolling.q)
    proof = proof | proof_of_tractions
    levels = [scalars, *_coarser_numbers(contact, scene, rolling)]
    hidden = _hidden(contact, scene, rolling, zone, unseen)
    scalars |= error_estimates(scene, contact.cells.shape[0], levels, hidden)
    if rolling is not None and scene.discretisation == "aligned":
        # a difference of two larger powers where little slips; only now, as its error is told by those of all meshes
        scalars["friction_power"] = max(scalars["friction_power"], 0.0)
    missed = failures(proof, scene)
    if missed and status == Status.SOLVED:
        status = Status.PROOF_FAILED
    # the proof covers pressure, tractions and slip on the solver's cells, not the scalars and fields derived from them
    sums = scalars | {name: float(fields[name].sum()) for name in fields if name.startswith(("traction", "slip"))}
    # a scalar that is not there would be stored as NaN, as one whose error has no estimate
    absent = expected_scalars(tangential=rolling is not None) - scalars.keys() - proof.keys()
    no_numbers = [name for name, value in sums.items() if not math.isfinite(value)]
    no_numbers += sorted(name for name in absent if not VARIABLES[name].timing)
    negative = [name for name in scalars if VARIABLES[name].nonnegative and scalars[name] < 0.0]
    for names, problem in ((no_numbers, "no finite numbers"), (negative, "negative")):
        if names and status == Status.SOLVED:
            status = Status.ERROR
            reasons.append(f"{problem}: {', '.join(names)}")
    return Result(status, "; ".join(reasons + missed), scalars | proof, fields)


def _hidden(
    contact: NormalContact, scene: Scene, rolling: RollingSolution | None, zone: SlipZone | None, unseen: Unseen
) -> Hidden:
    """The errors that differences between meshes do not show, for the error bars."""
    hidden = Hidden(
        by_layers=contact.area_by_layers / contact.area,
        moved=contact.moved_edge / contact.area,
        squeezed=contact.squeezed,
        peak_by_layers=contact.peak_by_layers / contact.pressure_max,
        at_rim=contact.missing_at_rim,
        beyond_rim=contact.beyond_rim,
        missed=contact.missed,
    )
    if rolling is None or zone is None:
        return hidden
    slip = rolling.s[contact.carrying]
    beta = abs(contact.influence.slip_by_pressure_over_tractions)  # Dundurs' constant
    lost_power = 0.0  # with `aligned`: its friction power is what the balance leaves
    if scene.discretisation == "kalker":
        lost_power = abs(rolling.power_in_balance(contact.known_slip(scene))) * math.prod(scene.mesh.spacing)
    hidden = hidden._replace(
        unsettled=rolling.unsettled,
        stiffer_across=contact.influence.stiffer_across(math.sqrt(math.prod(estimated_contact(scene)))),
        slip=unseen,
        least_slip=least_over_largest(slip),
        largest_slip=float(np.hypot(*slip.T).max(initial=0.0)),
        slip_shown=bool(rolling.slip.any()),
        slips_at_top=contact.slips_at_top(rolling),
        lost_power=lost_power,
        largest_of_cells=float(np.hypot(*rolling.q.T).max()),
        by_pressure=contact.influence.most_slip_under_pressure * contact.pressure_max,
        turning=beta / (math.pi * scene.friction),
        skin=contact.skin_at_edge,
        edge_of_tractions=contact.edge_of_tractions,
        moved_inwards=contact.moved_inwards,
    )
    if not scene.is_coupled:
        return hidden
    cusps = contact.cusps(zone, rolling, scene.friction)
    pull = scene.friction * beta  # of tractions at their bounds at the pressure
    fractions = rolling.q / (scene.friction * contact.pressure)[:, None]
    return hidden._replace(
        lift=contact.relative_lift(rolling),
        cusp_of_pressure=cusps.of_pressure,
        cusp_of_traction=cusps.of_traction,
        cusp_in_skin=scene.friction * contact.influence.cusp_in_skin(contact.contact_radius),
        at_borders=cusps.at_borders / zone.pressure,
        pull=pull,
        pull_under_skin=scene.friction * contact.influence.pull_under_skin,
        at_pole=rise_at_pole(contact.cells, contact.pressure, fractions, pull),
        top_at_border=close_to_border(contact.cells, contact.pressure, rolling.slip),
    )


def _polished_pressure(contact: NormalContact, scene: Scene) -> tuple[NormalContact, dict[str, float]]:
    """The contact without tractions and its proof; solved further as in `_polished`."""
    proof, tolerance = prove_normal(contact, scene), scene.tolerance.normal
    for _ in range(_POLISHES):
        if not failures(proof, scene):
            break
        tolerance *= 0.1
        sharpened = _sharpened(contact, scene, tolerance)
        if sharpened is None:
            break
        contact = sharpened
        proof = prove_normal(contact, scene)
    return contact, proof


def _polished(
    contact: NormalContact, scene: Scene, rolling: RollingSolution
) -> tuple[RollingSolution, dict[str, float]]:
    """Tractions, with the slip recomputed for the proof, and their proof; solved further while this proof fails.

    The tolerance limits the mean error, the proof that of the worst cell: this can require some more digits, most where
    cells bear hardly any pressure. (Of 3000 contacts with eight such cells 139 fail after two more, 1 after four.)
    """
    tolerance = scene.tolerance.tangential
    s = slips(contact, scene, rolling)
    proof = prove_rolling(contact, scene, rolling, s)
    for _ in range(_POLISHES):
        if scene.method != "newton" or not rolling.converged or not failures(proof, scene):
            break
        tolerance *= 0.1
        further = solve_rolling(contact, scene, rolling.q, tolerance).after(rolling)
        if not further.converged:
            break
        rolling = further
        s = slips(contact, scene, rolling)
        proof = prove_rolling(contact, scene, rolling, s)
    return replace(rolling, s=s), proof


def _coarser_numbers(
    contact: NormalContact, scene: Scene, rolling: RollingSolution | None
) -> Iterator[dict[str, float]]:
    """Scalars on the coarser meshes from which the solution was started, finest first, as far as these were solved."""
    coarser = contact.coarser
    while coarser is not None and coarser.solution.converged and not coarser.solution.edge:
        scalars = _normal_numbers(coarser)
        if rolling is not None:
            if rolling.coarser is None:
                return
            rolling = rolling.coarser
            unseen = coarser.unseen_slip(rolling, scene.friction)
            zone = coarser.slip_zone(rolling, scene.friction)
            scalars |= _rolling_numbers(coarser, scene, rolling, zone, unseen)
        yield scalars
        coarser = coarser.coarser


def _normal_numbers(contact: NormalContact) -> dict[str, float]:
    """Scalars that follow from the pressure."""
    solution = contact.solution
    return {
        "pressure_max": contact.pressure_max,
        "contact_area": contact.area,
        "contact_radius": contact.contact_radius,
        "approach": solution.approach,
        "residual_normal": solution.residual,
        "iterations_normal": solution.iterations,
        "products_normal": solution.products,
    }


def _rolling_fields(contact: NormalContact, scene: Scene, rolling: RollingSolution) -> dict[str, np.ndarray]:
    """Fields [nx, ny] that follow from the tractions."""
    q, s, slip = contact.on_window(rolling.q, rolling.s, rolling.slip, scene.friction)
    state = np.where(slip, CellState.SLIP, CellState.STICK)
    return {
        "traction_x": q[0],
        "traction_y": q[1],
        "slip_x": s[0],
        "slip_y": s[1],
        "state": np.where(contact.solution.p > 0.0, state, CellState.EXTERIOR).astype(np.int8),
    }


def _rolling_numbers(
    contact: NormalContact, scene: Scene, rolling: RollingSolution, zone: SlipZone, unseen: Unseen
) -> dict[str, float]:
    """Scalars that follow from the tractions on the mesh of `contact`, which slips in `zone`, corrected by `unseen`.

    The largest pressure is among them, as it may lie at the border of the stick zone (`mechanics/subcell/cusps.py`).
    """
    force_x, force_y, moment = contact.resultant(rolling, scene.friction)
    ending = contact.ending(rolling, scene.friction)
    more_x, more_y = ending.force_x - unseen.force_x, ending.force_y - unseen.force_y
    part = part_within(scene.friction * scene.load, (force_x, force_y), (more_x, more_y))
    force_x += part * more_x
    force_y += part * more_y
    moment += part * (ending.moment_z - unseen.moment_z)
    creepage = scene.creepage or Creepage()
    return {
        "force_x": force_x,
        "force_y": force_y,
        "moment_z": moment,
        "slip_area": min(max(zone.area + unseen.missing, 0.0), contact.area),
        "traction_max": zone.traction,
        "pressure_max": zone.pressure,
        "friction_power": contact.friction_power(rolling, creepage, (force_x, force_y, moment)) + part * unseen.work,
        "residual_tangential": rolling.residual,
        "iterations_tangential": rolling.iterations,
        "operator_products": rolling.products,
        "coarse_products": rolling.coarse_products,
    }
