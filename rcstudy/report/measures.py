"""Measures of one case that figures, tables and statements share; NaN where it was not solved or not stored.

Rolling is in +x: the trailing half of the contact is x < 0.
"""

from __future__ import annotations

import numpy as np

from rcstudy.report.views import CaseView
from rcstudy.result import CellState


def on_x_axis(field: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Values of `field` [nx, ny] on the x-axis, [nx].

    With an odd number of cells a row of centres lies on y = 0 and is taken. With an even number no row
    does: the mean of the two rows next to the axis is taken (error of second order in dy for a field that
    is smooth across the axis).
    """
    distance = np.abs(y)
    nearest = distance <= distance.min() * (1.0 + 1e-6) + 1e-12
    return np.asarray(field[:, nearest].mean(axis=1))


CELLS = 2.0
"""Cells in each case by which slip ratios must differ to count as different, where areas are counted in cells.

Over the paper's 169 pairs of cases the error of such differences is 2.7 cells in each case (root mean square, 64 x 64
cells against 256 x 256 aligned ones). Of 160 pairs that differ by more than one cell in each case two have the wrong
sign, of 138 that differ by more than two none.
"""


def slip_ratio(case: CaseView) -> float:
    """Area of slip over area of contact."""
    return case.number("slip_area") / case.number("contact_area")


def slip_ratio_error(case: CaseView) -> float:
    """The largest change of `slip_ratio` by the estimated errors of both areas.

    Where all cells slip, both areas have the same edge, and equal errors cancel. If the error of the slip area is
    larger, a stick zone may be too small to be seen, and that whole error counts.
    """
    ratio, area = slip_ratio(case), case.number("contact_area")
    of_slip, of_contact = case.number("slip_area_error"), case.number("contact_area_error")
    if ratio == 1.0:
        return 0.0 if of_slip <= of_contact else of_slip / area
    return (of_slip + ratio * of_contact) / area


def pressure_ratio(case: CaseView) -> float:
    """Peak pressure over Hertz's peak pressure of the uncoated pair."""
    return case.number("pressure_max") / case.stored("hertz_pressure")


def mean_pressure(case: CaseView) -> float:
    """Load over area of contact, MPa."""
    return case.stored("load") / case.number("contact_area")


def tangential_force(case: CaseView) -> float:
    """Magnitude of the tangential force, N."""
    return float(np.hypot(case.number("force_x"), case.number("force_y")))


def worst_proof(case: CaseView) -> tuple[float, str]:
    """The largest of the case's proof numbers and its name; (NaN, '') if it has none."""
    names = [str(n) for n in case.grid.dataset.data_vars if str(n).startswith("proof_")]
    proofs = [(case.number(n), n) for n in names if np.isfinite(case.number(n))]
    return max(proofs, default=(float("nan"), ""))


def traction(case: CaseView) -> tuple[np.ndarray, np.ndarray]:
    """Traction on the coated body, (qx, qy), each [nx, ny], MPa."""
    return case.field("traction_x"), case.field("traction_y")


def asymmetry(case: CaseView) -> float:
    """Share of the traction that is odd in y: |q(x, y) - q(x, -y)| / (2 |q|) in L2 norms, from 0 to 1.

    Both components are taken as even in a symmetric traction: that is the symmetry of a traction that has the
    same direction everywhere, which longitudinal and lateral creepage give nearly.
    """
    if not case.mapped:
        return float("nan")
    q = np.stack(traction(case))
    return float(np.linalg.norm(q - q[:, :, ::-1]) / (2.0 * np.linalg.norm(q)))


def slip_centre(case: CaseView) -> tuple[float, float]:
    """Centroid of the slip cells over the contact radius, (x, y); NaN without slip."""
    if not case.mapped:
        return float("nan"), float("nan")
    slips = case.field("state") == CellState.SLIP
    if not slips.any():
        return float("nan"), float("nan")
    i, j = np.nonzero(slips)
    radius = case.number("contact_radius")
    return float(case.x[i].mean() / radius), float(case.y[j].mean() / radius)


def slip_behind_stick(case: CaseView) -> float:
    """Of the slip cells in rows that have stick cells, the share behind (at smaller x than) all of them."""
    if not case.mapped:
        return float("nan")
    state = case.field("state")
    sticks, slips = state == CellState.STICK, state == CellState.SLIP
    rows = sticks.any(axis=0)
    first_stick = np.argmax(sticks, axis=0)
    behind = slips & (np.arange(state.shape[0])[:, None] < first_stick[None, :])
    total = slips[:, rows].sum()
    return float(behind[:, rows].sum() / total) if total else float("nan")


def trailing_slip(case: CaseView, *, upper: bool) -> float:
    """Slip cells over contact cells in the trailing quarter x < 0, y > 0 (`upper`) or x < 0, y < 0."""
    if not case.mapped:
        return float("nan")
    state = case.field("state")
    quarter = state[np.ix_(case.x < 0, case.y > 0 if upper else case.y < 0)]
    return float((quarter == CellState.SLIP).sum() / (quarter != CellState.EXTERIOR).sum())
