"""How a statement is judged: which cases are compared, in which measure, and when a comparison holds.

Thresholds stand for the paper's adjectives; each is printed in the table next to what it judged.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import chain, product

import numpy as np

from rcstudy.report import measures
from rcstudy.report.paper import Pair, PaperCase, along_thickness, compliant_and_stiff, select, words
from rcstudy.report.statements import Comparison
from rcstudy.report.views import CaseView

Measure = Callable[[CaseView], float]
Cases = Sequence[PaperCase]
Holds = Callable[[float, float], bool]

ALMOST_SYMMETRIC = 0.1
"""Share without a mirror image (`measures.asymmetry`, `slip_asymmetry`) below which a panel is called symmetric."""

BEHIND = 0.9
"""Share of the slip cells behind their row's stick cells from which slip is called located at the trailing edge."""

SMALL = 0.5
"""Ratio of slip below which slip zones are called relatively small."""

SIGNIFICANT = 0.1
"""Relative spread over layers or creepages from which these are called significant."""

SIMILAR = 5.0
"""Angle in degrees between the directions of slip's centroid below which two slip patterns are called similar.

Most patterns of different creepages differ by more.
"""

REPRESENTATIVE = 0.1
"""Estimated error over the value below which a mesh's result is called representative."""

MUCH = 0.9
"""A ratio below this is called much smaller, one above its inverse much larger."""


def grows(pairs: Iterable[Pair], measure: Measure, by: float = 1.0) -> Iterator[Comparison]:
    """Whether `measure` of the second case of each pair is above `by` times that of the first."""
    return _compared(pairs, measure, by, operator.gt)


def shrinks(pairs: Iterable[Pair], measure: Measure, by: float = 1.0) -> Iterator[Comparison]:
    """Whether `measure` of the second case of each pair is below `by` times that of the first."""
    return _compared(pairs, measure, by, operator.lt)


def _compared(pairs: Iterable[Pair], measure: Measure, by: float, holds: Holds) -> Iterator[Comparison]:
    for first, second in pairs:
        left, right = measure(first.view), measure(second.view)
        undecided = _why_undecided(first, second, measure, by)
        what = f"{words(first)} → {words(second)}"
        held = None if undecided else holds(right, by * left)
        yield Comparison(what, left, right, held, undecided, by=by, cases=(first, second))


def at_most(cases: Iterable[PaperCase], measure: Measure, bound: float) -> Iterator[Comparison]:
    """Whether `measure` of each case is below `bound`."""
    return _bounded(cases, measure, bound, operator.lt)


def at_least(cases: Iterable[PaperCase], measure: Measure, bound: float) -> Iterator[Comparison]:
    """Whether `measure` of each case is above `bound`."""
    return _bounded(cases, measure, bound, operator.gt)


def _bounded(cases: Iterable[PaperCase], measure: Measure, bound: float, holds: Holds) -> Iterator[Comparison]:
    for case in cases:
        value = measure(case.view)
        undecided = _unknown(measure, case)
        if not undecided and measure in BARS:
            margin, name = _margin(case.view, measure)
            undecided = _too_close(abs(value - bound), margin, f"differs from the bound by less than {name}")
        held = None if undecided else holds(value, bound)
        yield Comparison(words(case), value, bound, held, undecided, bound=True, cases=(case,))


def _unknown(measure: Measure, *cases: PaperCase) -> str:
    """Which of the cases have no such number, and why; empty if all have one."""
    return "; ".join(f"{c.name} {_why_unknown(c)}" for c in cases if not np.isfinite(measure(c.view)))


def _why_unknown(case: PaperCase) -> str:
    if not case.view.solved:
        return "not solved"
    if not case.view.mapped:
        return "stored without fields"
    return "slips everywhere" if measures.slips_everywhere(case.view) else "has no such cells"


def spread(cases: Iterable[PaperCase], measure: Measure, least: float) -> Iterator[Comparison]:
    """Whether `measure` varies by more than `least` of its largest value: from the case with that to the smallest."""
    # a case without the number comes last, and the comparison with it decides nothing
    ranked = sorted(cases, key=lambda c: np.nan_to_num(measure(c.view), nan=np.inf))
    if len(ranked) > 1:
        yield from shrinks([(ranked[-1], ranked[0])], measure, by=1.0 - least)


def spreads(groups: Iterable[Cases], measure: Measure) -> Iterator[Comparison]:
    """Whether `measure` varies significantly within each group of cases."""
    return chain.from_iterable(spread(group, measure, SIGNIFICANT) for group in groups)


def _why_undecided(first: PaperCase, second: PaperCase, measure: Measure, by: float) -> str:
    """Why a pair decides nothing: no number, slip everywhere in both, or discretisation errors that are larger."""
    unknown = _unknown(measure, first, second)
    if unknown or measure not in BARS:
        return unknown
    left, right = measure(first.view), measure(second.view)
    if measure is measures.slip_ratio and left == right == 1.0:
        return "both slip everywhere"
    (of_left, one), (of_right, other) = (_margin(case.view, measure) for case in (first, second))
    names = " and ".join(dict.fromkeys((one, other)))
    how = "differ" if by == 1.0 else f"differ from a ratio of {by:.3g}"
    return _too_close(abs(right - by * left), of_right + by * of_left, f"{how} by less than {names} in each")


def _too_close(difference: float, margin: float, words: str) -> str:
    if not np.isfinite(margin):
        return "no estimate of their errors"
    return words if difference <= margin * (1 + 1e-9) else ""


def _margin(case: CaseView, measure: Measure) -> tuple[float, str]:
    """Discretisation error allowed for in a measure that has a bar, and its name in words.

    It is the estimated one (NaN if there is none); but for slip ratios whose areas are counted in cells it is
    `measures.CELLS` cells. With `aligned` areas are found within cells.
    """
    if measure is measures.slip_on_axis:
        return BARS[measure](case), "one cell"
    if measure is measures.slip_ratio and case.mapped:
        cells = case.number("contact_area") / float(np.prod(case.spacing))
        if abs(cells - round(cells)) < 1e-6:
            return measures.CELLS / cells, f"{measures.CELLS:g} cells"
    return BARS[measure](case), "the estimated error"


def number(name: str) -> Measure:
    """The measure that is the stored scalar `name`."""

    def measure(case: CaseView) -> float:
        return case.number(name)

    return measure


radius, area, peak = number("contact_radius"), number("contact_area"), number("pressure_max")
largest_traction = number("traction_max")

BARS: dict[Measure, Measure] = {
    radius: number("contact_radius_error"),
    area: number("contact_area_error"),
    peak: number("pressure_max_error"),
    largest_traction: number("traction_max_error"),
    measures.slip_ratio: measures.slip_ratio_error,
    measures.slip_on_axis: measures.cell_on_axis,
    measures.mean_pressure: measures.mean_pressure_error,
    measures.tangential_force: measures.tangential_force_error,
}
"""Measures that have an error bar, and the bar. Differences within them decide nothing."""


def slip_x(case: CaseView) -> float:
    """Centroid of the slip cells along x over the contact radius."""
    return measures.slip_centre(case)[0]


def slip_y(case: CaseView) -> float:
    """Centroid of the slip cells along y over the contact radius."""
    return measures.slip_centre(case)[1]


def upper(case: CaseView) -> float:
    """Slip cells over contact cells at x < 0, y > 0."""
    return measures.trailing_slip(case, upper=True)


def lower(case: CaseView) -> float:
    """Slip cells over contact cells at x < 0, y < 0."""
    return measures.trailing_slip(case, upper=False)


def bare_to(cases: Cases, kind: str) -> Iterator[Pair]:
    """Pairs (uncoated, coated) of the pressures of Figure 3."""
    bare = select(cases, [3], "none")
    return ((bare[0], coated) for coated in select(cases, [3], kind) if bare)


def papers_mesh(cases: Cases) -> list[PaperCase]:
    """Rolling cases with cells of the paper's size, 64 to 2 mm, as far as the cube says."""
    located = (c for c in cases if any(c.creepage) and "x" in c.view.grid and "y" in c.view.grid)
    return [c for c in located if np.allclose(c.view.spacing, 2.0 / 64.0, rtol=1e-6)]


def representative(cases: Cases, measure: Measure) -> Iterator[Comparison]:
    """Whether the measure's error bar is below REPRESENTATIVE of its value; larger bars decide nothing, nor does 0."""

    def relative(case: CaseView) -> float:
        value = measure(case)
        return BARS[measure](case) / value if value else math.nan

    for c in at_most(cases, relative, REPRESENTATIVE):
        yield replace(c, holds=None, undecided="the error may be less than its estimate") if c.holds is False else c


def between_kinds(cases: Cases, figures: Iterable[int]) -> Iterator[Pair]:
    """Pairs (compliant, stiff), all else equal."""
    return compliant_and_stiff(select(cases, figures))


def thicker(cases: Cases, figures: Iterable[int], kind: str) -> Iterator[Pair]:
    """Pairs (thinner, thicker), all else equal."""
    return along_thickness(select(cases, figures, kind))


def top_of_trailing_end(cases: Iterable[PaperCase], *, upwards: bool) -> Iterator[Comparison]:
    """Whether the centroid of slip is in the trailing half and at y > 0, or, if not `upwards`, at y < 0."""
    chosen = list(cases)
    trailing = at_most(chosen, slip_x, 0.0)
    side = at_least(chosen, slip_y, 0.0) if upwards else at_most(chosen, slip_y, 0.0)
    for behind, beside in zip(trailing, side, strict=True):
        holds = None if beside.holds is None else bool(beside.holds and behind.holds)
        yield replace(beside, holds=holds)


def much_smaller(pairs: Iterable[Pair], measure: Measure) -> Iterator[Comparison]:
    """Whether `measure` of the second case is below MUCH times that of the first."""
    return shrinks(pairs, measure, by=MUCH)


def much_larger(pairs: Iterable[Pair], measure: Measure) -> Iterator[Comparison]:
    """Whether `measure` of the second case is above 1/MUCH times that of the first."""
    return grows(pairs, measure, by=1.0 / MUCH)


def similar_patterns(pairs: Iterable[Pair]) -> Iterator[Comparison]:
    """Angle (degrees) between the directions in which slip's centroid lies in the two cases of each pair.

    Undecided where `measures.CELLS` slip cells more or less in each may bring it across the bound.
    """
    for one, other in pairs:
        (x1, y1), (x2, y2) = measures.slip_centre(one.view), measures.slip_centre(other.view)
        angle = float(np.degrees(np.abs(np.arctan2(x1 * y2 - x2 * y1, x1 * x2 + y1 * y2))))
        undecided = _unknown(slip_x, one, other) or _too_close(
            abs(angle - SIMILAR),
            measures.slip_turn(one.view) + measures.slip_turn(other.view),
            f"differs from the bound by less than {measures.CELLS:g} cells in each turn it",
        )
        holds = None if undecided else angle < SIMILAR
        yield Comparison(f"{one.name}, {other.name}", angle, SIMILAR, holds, undecided, bound=True)


def between_creepages(cases: Cases, figures: Iterable[int]) -> Iterator[Pair]:
    """Pairs (compliant, stiff) of one figure and thickness that differ in creepage as well."""
    pairs = product(select(cases, figures, "compliant"), select(cases, figures, "stiff"))
    return (
        (soft, hard)
        for soft, hard in pairs
        if (soft.figure, soft.thickness) == (hard.figure, hard.thickness) and soft.creepage != hard.creepage
    )
