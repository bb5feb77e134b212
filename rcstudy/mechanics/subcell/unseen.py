r"""Slip zones narrower than a cell at the leading edge: corrections of scalars with `aligned`, and their uncertainty.

Width of the zone. Where pressure displaces the surfaces along each other (beta, Dundurs' constant, is not zero), stick
requires q = p (b + (beta/pi) n ln(1/r)), b being constant, at a distance r behind the edge, whose normal is n. Close
enough to the edge this exceeds the bound, however small the creepage. So a zone slips there. With m slip cells at the
leading end of a row and v = q/(mu p) in the first stick cell, at the distance m + theta, the law reaches the bound at

    w0 = (m + theta) exp(-t),   |d| = 1,   d = v + t k n,   k = beta/(pi mu)

(in cells; `width` in `kernels/leading_slip.py`). In a strip w = 4 e^-2 w0 = 0.54 w0 of that slips, see below.

If the leading cell sticks, neither this mesh nor the coarser ones show the zone; if one cell has just begun to slip,
they hardly do. Wider zones are described by the slip cells, and slip areas are too large by ((m - 1 + theta)/w0)^2
cells, at most one, in such a row.

Other rows slip at the leading edge as spin turns the traction there, also between bodies that are alike: these are
rows in which g, see below, is less than 0.1. Slip of a cell is that half a cell ahead of its centre, and so is, in the
mean, the border behind which it is zero: half a cell of each such row is counted too much (`_DETACHED`; of 350
contacts of bodies that are alike 0.56 are found, 0.49 of 227 others). This holds within the stick zone; the first and
the last of its rows end between cells across, and are off by as much either way.

Effect on tractions, in a strip with p = K sqrt(r). Tractions in stick would exceed the bound by
f = mu K g sqrt(r) ln(w0/r) for r < w0, with g = k n.d the increase of |q|/(mu p) as r falls by a factor e. There is no
slip behind w, and slip vanishes smoothly there (the sign of slip ahead of a stick zone permits no other end):
int_0^w f'/sqrt(w - r) dr = 0, so w = 4 e^-2 w0. Farther behind, tractions are smaller by
(1/pi) int_0^w f/sqrt(w - r) dr r^(-1/2) = mu K g w/2 r^(-1/2). Over a stick zone of length l in a row of length L,
whose trailing border moves, this is a force per width of pi sqrt(l) mu K g w/2. With Hertz's K = 2 max(p)/sqrt(L) it is

    pi/2 mu max(p) g (2 w) sqrt(l/L),

and acts about l/2 behind the edge (l/4 to l/2, depending on how much slips behind the stick zone). On cells a part of
it is there already: of w the part E is missing, which `leading_zone.py` derives for any number of slip cells.

Layers. The law holds near the edge, for zones over whose width the layer at the surface is as good as a half-space:
under others it is used for two slip cells at most (`_LIKE`, `Influence.as_half_space`; layers twice as stiff as the
substrate allow a slip cell for each four cells of their thickness, those of nearly its own material any number). Over
layers softer than what is below the edge has less pressure than Hertz's K, by the root of the ratio of u_z by waves as
long as half the row and as short as cells, times their numbers (Wiener and Hopf). That of u_x by tractions stands for
it, `reach`. (Tractions at the edge are the inverse of it larger farther behind, by the same theory, but in contacts on
layers of 0.06 to 0.35 radii 0.6 to 0.8 of the force are left, as by `reach`. Stiff skins: not done.)

Slip against d changes tractions along C d, C being the resistance of the bodies along and across waves; the component
along d is the one given above. Where g is less than 0.1 the w0 found from cells stands for 2 E if no cell slips (2 w =
1.08 w0).

Of 110 random contacts, bare or with a layer, under bodies of another (1 - 2 nu)/G and with friction of 0.08 to 0.28, on
20 to 49 cells against five times as many, forces along x have errors (root of mean square, with `local_slip.py`) of
0.14 and 0.20 % of mu P for k of 0.3 to 0.6 and beyond, 0.27 and 0.35 % by w alone; along y 0.10 and 0.07 (0.15 and
0.13), moments 0.07 and 0.06 % of mu P a (0.08 and 0.10).

Slip areas, found from borders between cells, are corrected as well: of 508 other such contacts (24 to 64 cells against
256 x 256, friction 0.1 to 1, both couplings) they have errors of 0.4 % of the contact area with the correction, 0.9 to
1.0 % without (root mean square). The traction fields are not corrected. The corrections are uncertain, which enters the
error bars (`rcstudy/bars`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rcstudy.mechanics.kernels import leading_slip

if TYPE_CHECKING:
    from rcstudy.mechanics.influence import Influence
    from rcstudy.mechanics.subcell.moved_rows import RowTable

_LEAST = 1e-9  # smaller |k| counts as zero: nothing is hidden
_NOTHING = 1e-12  # smaller missing areas, in cells, count as zero
_LIKE = 0.02  # largest part by which responses to waves as long as the slip zone may deviate
# Missing area over that of zones w0 wide: fits to the areas of those 508 contacts give 0.79 to 0.95. (The zone in a
# strip has 0.54. Stick zones' trailing borders move as well.)
_MISSED = 0.85
_DETACHED = 0.5  # cells counted too much in a row that slips for other reasons
_WORK = 1.5  # factor on the work of those tractions against slip by pressure (set on 450 contacts)
_BY_PRESSURE = 0.2  # slip by pressure for the uncertainty of the power, over that by the largest pressure on the spot


class Unseen(NamedTuple):
    """Errors of sums over cells due to slip zones at the leading edge that are narrower than a cell.

    Corrections: force_x, force_y (N), moment_z (N mm): excess of the sums of tractions, with signs; work (N): of the
    excess tractions against the slip by pressure; missing (mm^2): by how much the slip area is too small. Uncertain
    amounts, still to be multiplied by constants of `rcstudy/bars`: doubtful_force (N): excess tractions of all rows, by
    magnitude; doubtful_area (mm^2): that slips unseen or is wrongly counted as slipping; doubtful_power (N): of
    doubtful_force on the slip by pressure.
    """

    force_x: float = 0.0
    force_y: float = 0.0
    moment_z: float = 0.0
    work: float = 0.0
    missing: float = 0.0
    doubtful_force: float = 0.0
    doubtful_area: float = 0.0
    doubtful_power: float = 0.0


def of_alike(table: RowTable, slip: np.ndarray, cell: float) -> Unseen:
    """Corrections for quasi-identical bodies: of the slip area of rows that slip at the leading edge.

    `table`: the rows; `slip` [m]: flags of their cells; `cell` (mm^2): area of a cell.
    """
    return Unseen(missing=-_DETACHED * cell * leading_slip.detached_rows(table.numbers, table.counts, slip))


def part_within(most: float, force: tuple[float, float], more: tuple[float, float]) -> float:
    """Largest part, up to 1, of the forces `more` (N) that together with `force` (N) does not exceed `most` (N).

    Slip zones and ends that a few cells do not show may be far larger by their laws than the friction force allows.
    """
    square, half = math.hypot(*more) ** 2, force[0] * more[0] + force[1] * more[1]
    room = most * most - math.hypot(*force) ** 2
    if square == 0.0 or square + 2.0 * half <= room:
        return 1.0
    return max((math.sqrt(max(half * half + square * room, 0.0)) - half) / square, 0.0)


class UnseenSlip:
    """Corrections for narrow slip zones under one pressure, for any tractions.

    `table`: the rows; `normals` [2, ny]: of their leading edges; `centres`: coordinates x, y [m] (mm) of the cells;
    `pressure` [m] (MPa); `by_pressure` [m, 2]: slip by pressure at the centres of the cells; `theta`: distance from the
    centre of a leading cell to the edge (in cells); `zones` [n, 7]: `leading_zone.numbers`; `reach`:
    `influence.Influence.reach_of_tractions`.
    """

    def __init__(
        self,
        table: RowTable,
        normals: np.ndarray,
        centres: tuple[np.ndarray, np.ndarray],
        pressure: np.ndarray,
        by_pressure: np.ndarray,
        theta: float,
        zones: np.ndarray,
        reach: float,
        influence: Influence,
    ) -> None:
        dx, dy = influence.spacing
        zones = zones[: max(2, influence.as_half_space(len(zones) - 1, _LIKE)) + 1]
        along, across = influence.slip_under_tractions
        self._table, self._normals, self._pressure = table, normals, pressure
        self._at_centres = *centres, by_pressure
        self._along_over_across, self._reach = along / across, reach
        self._zones = dx, theta, zones
        self._beta = influence.slip_by_pressure_over_tractions
        self._cell = dx * dy
        # slip for the uncertainty of the power
        self._slip = _BY_PRESSURE * abs(influence.slip_under_pressure) * float(pressure.max())

    def of(self, q: np.ndarray, slip: np.ndarray, friction: float) -> Unseen:
        """Corrections for tractions `q` [m, 2] (MPa) with slip flags `slip` [m]."""
        k = self._beta / (math.pi * friction)
        if abs(k) < _LEAST:
            return of_alike(self._table, slip, self._cell)
        sums = np.zeros(8)
        cells, bodies = (q, slip, self._pressure, friction), (k, self._along_over_across, self._reach)
        of_rows = self._table, self._normals, cells
        leading_slip.hidden_leading_slip(*of_rows, *self._at_centres, bodies, *self._zones, sums)
        force_x, force_y, moment, work, force, area, missing, detached = (self._cell * sums).tolist()
        if abs(missing) < _NOTHING * self._cell:
            missing = 0.0
        missing = _MISSED * missing - _DETACHED * detached
        return Unseen(force_x, force_y, moment, _WORK * work, missing, force, area, force * self._slip)
