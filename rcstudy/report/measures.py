"""Measures of one case that figures, tables and statements share; NaN where it was not solved or not stored.

Rolling is in +x: the trailing half of the contact is x < 0.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rcstudy.report.views import CaseView
from rcstudy.result import CellState


def on_x_axis(field: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Values of `field` [nx, ny] on the x-axis, [nx].

    With an odd number of cells a row of centres lies on y = 0 and is taken. With an even number no row
    does: the mean of the two rows next to the axis is taken (error of second order in dy for a field that
    is smooth across the axis).
    """
    return np.asarray(field[:, _next_to_axis(y)].mean(axis=1))


def _next_to_axis(y: np.ndarray) -> np.ndarray:
    """Which rows of cells are on the x-axis, or next to it: one or two, [ny]."""
    distance = np.abs(y)
    return np.asarray(distance <= distance.min() + 1e-7 * np.ptp(y))


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


def mean_pressure_error(case: CaseView) -> float:
    """Estimated error of `mean_pressure`, by that of the area, MPa."""
    return mean_pressure(case) * case.number("contact_area_error") / case.number("contact_area")


def tangential_force(case: CaseView) -> float:
    """Magnitude of the tangential force, N."""
    return float(np.hypot(case.number("force_x"), case.number("force_y")))


def tangential_force_error(case: CaseView) -> float:
    """Upper limit of the change of `tangential_force` by the estimated errors of both components, N."""
    return float(np.hypot(case.number("force_x_error"), case.number("force_y_error")))


def worst_proof(case: CaseView) -> tuple[float, str]:
    """The largest of the case's proof numbers and its name; (NaN, '') if it has none."""
    names = [str(n) for n in case.grid.dataset.data_vars if str(n).startswith("proof_")]
    proofs = [(case.number(n), n) for n in names if np.isfinite(case.number(n))]
    return max(proofs, default=(float("nan"), ""))


def traction(case: CaseView) -> tuple[np.ndarray, np.ndarray]:
    """Traction on the coated body, (qx, qy), each [nx, ny], MPa; UserError as by `CaseView.field`."""
    return case.field("traction_x"), case.field("traction_y")


def asymmetry(case: CaseView) -> float:
    """Share of the traction's magnitude, which maps show, that is odd in y: | |q(x,y)| - |q(x,-y)| | / (2 |q|).

    In L2 norms, from 0 to 1, as `vector_asymmetry`.
    """
    return _odd_part(np.hypot(*traction(case))[None], case.y, [1.0]) if case.mapped else float("nan")


def vector_asymmetry(case: CaseView) -> float:
    """Share of the traction that is not its own mirror image about the x-axis, in which q_x is even and q_y odd in y.

    Lateral creepage is its own mirror image with the sign reversed, and has such a share by itself.
    """
    return _odd_part(np.stack(traction(case)), case.y, [1.0, -1.0]) if case.mapped else float("nan")


def _odd_part(fields: np.ndarray, y: np.ndarray, signs: Sequence[float]) -> float:
    """L2 norm of what distinguishes `fields` [k, nx, ny] from their mirror image about y = 0, over twice theirs.

    `y` [ny]: the cells' centres; `signs`: those that the fields take in the image.
    """
    whole = _about_axis(fields, y)
    image = np.reshape(signs, (-1, 1, 1)) * whole[:, :, ::-1]
    return _part(float(np.linalg.norm(whole - image)), 2.0 * float(np.linalg.norm(whole)))


def _part(part: float, whole: float) -> float:
    """`part` over `whole`; NaN if that is nothing, as on few cells, or without tractions."""
    return float(part / whole) if whole else float("nan")


def _about_axis(fields: np.ndarray, y: np.ndarray) -> np.ndarray:
    """`fields` [..., ny] at the centres `y` with zeros beside them, so that their cells lie evenly about y = 0.

    Windows do so; what is stored of them (`crop: contact`) does not where full coupling shifts the contact along y.
    """
    more = round((y[0] + y[-1]) / (y[1] - y[0]))  # cells at y > 0 than at y < 0
    beside = (max(more, 0), max(-more, 0))
    return np.pad(fields, [(0, 0)] * (fields.ndim - 1) + [beside])


def slip_asymmetry(case: CaseView) -> float:
    """Share of the slip cells whose mirror image about the x-axis is no slip cell; NaN without slip."""
    if not _slips(case).any():
        return float("nan")
    slips = _about_axis(_slips(case), case.y)
    return float((slips & ~slips[:, ::-1]).sum() / slips.sum())


def slips_everywhere(case: CaseView) -> bool:
    """Whether the case is mapped and has slip cells, but no stick cells."""
    return bool(_slips(case).any() and not (case.state == CellState.STICK).any())


def _slips(case: CaseView) -> np.ndarray:
    """Where cells slip, [nx, ny]; nowhere if that is not stored."""
    return case.state == CellState.SLIP if case.mapped else np.zeros((1, 1), dtype=bool)


def slip_centre(case: CaseView) -> tuple[float, float]:
    """Centroid of the slip cells over the contact radius, (x, y).

    NaN without slip, and where all cells slip: it is that of the contact then, and tells nothing of slip.
    """
    if not _slips(case).any() or slips_everywhere(case):
        return float("nan"), float("nan")
    i, j = np.nonzero(_slips(case))
    radius = case.number("contact_radius")
    return float(case.x[i].mean() / radius), float(case.y[j].mean() / radius)


def slip_turn(case: CaseView) -> float:
    """Angle in degrees, up to 180, by which `CELLS` slip cells more or less at the contact's rim turn `slip_centre`."""
    distance = float(np.hypot(*slip_centre(case)))
    return min(float(np.degrees(CELLS / (_slips(case).sum() * distance))), 180.0) if distance else 180.0


def slip_on_axis(case: CaseView) -> float:
    """Slip cells over contact cells in the row on the x-axis, or in the two rows next to it."""
    if not case.mapped:
        return float("nan")
    state = case.state[:, _next_to_axis(case.y)]
    return _part((state == CellState.SLIP).sum(), (state != CellState.EXTERIOR).sum())


def cell_on_axis(case: CaseView) -> float:
    """Share of one cell in the contact on the x-axis, by which `slip_on_axis` is uncertain."""
    if not case.mapped:
        return float("nan")
    state = case.state[:, _next_to_axis(case.y)]
    return _part(state.shape[1], (state != CellState.EXTERIOR).sum())


def slip_behind_stick(case: CaseView) -> float:
    """Of the slip cells in rows that have stick cells, the share behind (at smaller x than) all of them."""
    if not case.mapped:
        return float("nan")
    state = case.state
    sticks, slips = state == CellState.STICK, state == CellState.SLIP
    rows = sticks.any(axis=0)
    first_stick = np.argmax(sticks, axis=0)
    behind = slips & (np.arange(state.shape[0])[:, None] < first_stick[None, :])
    return _part(behind[:, rows].sum(), slips[:, rows].sum())


def trailing_slip(case: CaseView, *, upper: bool) -> float:
    """Slip cells over contact cells in the trailing quarter x < 0, y > 0 (`upper`) or x < 0, y < 0."""
    if not case.mapped:
        return float("nan")
    state = case.state
    quarter = state[np.ix_(case.x < 0, case.y > 0 if upper else case.y < 0)]
    return _part((quarter == CellState.SLIP).sum(), (quarter != CellState.EXTERIOR).sum())
