"""How a statement is judged: which cases are compared, in which measure, and when a comparison holds.

Thresholds stand for the paper's adjectives; each is printed in the table next to what it judged.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from rcstudy.report import measures
from rcstudy.report.layers import layers_text, thickness_text
from rcstudy.report.paper import MAPS, PaperCase, along_thickness, compliant_and_stiff, select
from rcstudy.report.statements import Comparison
from rcstudy.report.views import CaseView, creepage_text

Measure = Callable[[CaseView], float]
Cases = Sequence[PaperCase]
Pairs = Iterator[tuple[PaperCase, PaperCase]]

ALMOST_SYMMETRIC = 0.1
"""Share of a traction's odd part (`measures.asymmetry`) below which it is called almost symmetric."""

BEHIND = 0.9
"""Share of the slip cells behind their row's stick cells from which slip is called located at the trailing edge."""

SMALL = 0.5
"""Ratio of slip below which slip zones are called relatively small."""

SIGNIFICANT = 0.1
"""Relative spread over the layers from which a result is called significantly adjusted."""

SIMILAR = 30.0
"""Angle in degrees between the directions of slip's centroid below which two slip patterns are called similar."""

MUCH = 0.9
"""A ratio below this is called much smaller, one above its inverse much larger."""


def grows(pairs: Iterable[tuple[PaperCase, PaperCase]], measure: Measure) -> Iterator[Comparison]:
    """Whether `measure` is larger for the second case of each pair."""
    for first, second in pairs:
        left, right = measure(first.view), measure(second.view)
        undecided = _why_undecided(first, second, measure)
        yield Comparison(
            f"{words(first)} → {words(second)}", left, right, None if undecided else right > left, undecided
        )


def shrinks(pairs: Iterable[tuple[PaperCase, PaperCase]], measure: Measure) -> Iterator[Comparison]:
    """Whether `measure` is smaller for the second case of each pair."""
    for c in grows(pairs, measure):
        yield c if c.holds is None else replace(c, holds=c.right < c.left)


def at_most(cases: Iterable[PaperCase], measure: Measure, bound: float) -> Iterator[Comparison]:
    """Whether `measure` of each case is below `bound`."""
    return _bounded(cases, measure, bound, lambda value: value < bound)


def at_least(cases: Iterable[PaperCase], measure: Measure, bound: float) -> Iterator[Comparison]:
    """Whether `measure` of each case is above `bound`."""
    return _bounded(cases, measure, bound, lambda value: value > bound)


def _bounded(
    cases: Iterable[PaperCase], measure: Measure, bound: float, holds: Callable[[float], bool]
) -> Iterator[Comparison]:
    for case in cases:
        value = measure(case.view)
        undecided = "" if np.isfinite(value) else f"{case.name} {_why_unknown(case)}"
        yield Comparison(words(case), value, bound, None if undecided else bool(holds(value)), undecided, bound=True)


def _why_unknown(case: PaperCase) -> str:
    if not case.view.solved:
        return "not solved"
    return "has no such cells" if case.view.mapped else "stored without fields"


def spread(cases: Iterable[PaperCase], measure: Measure, least: float, what: str) -> Iterator[Comparison]:
    """Whether `measure` varies over the solved cases by more than `least` of its largest value; by how much it does."""
    values = [measure(c.view) for c in cases if c.view.solved]
    if len(values) > 1:
        part = 1.0 - min(values) / max(values) if any(values) else 0.0
        yield Comparison(what, part, least, part > least, bound=True)


def _why_undecided(first: PaperCase, second: PaperCase, measure: Measure) -> str:
    left, right = measure(first.view), measure(second.view)
    unknown = [case for case, value in ((first, left), (second, right)) if not np.isfinite(value)]
    if unknown:
        return "; ".join(f"{case.name} {_why_unknown(case)}" for case in unknown)
    if measure is not measures.slip_ratio:
        return ""
    if left == right == 1.0:
        return "both slip everywhere"
    if not (first.view.mapped and second.view.mapped):
        return ""
    margins, kinds = zip(*(_margin(case.view) for case in (first, second)), strict=True)
    if not np.isfinite(sum(margins)):
        return "no estimate of their errors"
    within = abs(right - left) <= sum(margins) * (1 + 1e-9)
    return f"differ by less than {' and '.join(dict.fromkeys(kinds))} in each" if within else ""


def _margin(case: CaseView) -> tuple[float, str]:
    """Discretisation error allowed for in a case's slip ratio, and its name in words.

    Where areas are counted in cells it is `measures.CELLS` cells. With `aligned` areas are found within cells, and it
    follows from the estimated errors of both areas (NaN if there are none).
    """
    cells = case.number("contact_area") / float(np.prod(case.spacing))
    if abs(cells - round(cells)) < 1e-6:
        return measures.CELLS / cells, f"{measures.CELLS:g} cells"
    return measures.slip_ratio_error(case), "the estimated error"


def words(case: PaperCase) -> str:
    """A case in words: figure and panel, layers, creepage (`7a: E1 = 0.5 Es, 0.5 a, xi_x = 0.002`)."""
    parts = [layers_text(case.view)]
    if case.layer_count:
        parts.append(thickness_text(case.view))
    if any(case.creepage):
        parts.append(creepage_text(case.view))
    return f"{case.name}: {', '.join(parts)}"


def number(name: str) -> Measure:
    """The measure that is the stored scalar `name`."""

    def measure(case: CaseView) -> float:
        return case.number(name)

    return measure


radius, area, peak = number("contact_radius"), number("contact_area"), number("pressure_max")
largest_traction = number("traction_max")


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


def bare_to(cases: Cases, kind: str) -> Pairs:
    """Pairs (uncoated, coated) of the pressures of Figure 3."""
    bare = select(cases, [3], kind="none")
    return ((bare[0], coated) for coated in select(cases, [3], kind=kind) if bare)


def panels(cases: Cases, steps: Iterable[str], figures: Iterable[int]) -> Pairs:
    """Pairs of panels of one figure: the step `cd` is (c, d)."""
    named = {c.name: c for c in cases}
    for figure in figures:
        for first, second in (tuple(step) for step in steps):
            pair = named.get(f"{figure}{first}"), named.get(f"{figure}{second}")
            if pair[0] and pair[1]:
                yield pair[0], pair[1]


def between_kinds(cases: Cases, figures: Iterable[int]) -> Pairs:
    """Pairs (compliant, stiff), all else equal."""
    return compliant_and_stiff(select(cases, figures))


def thicker(cases: Cases, figures: Iterable[int], kind: str) -> Pairs:
    """Pairs (thinner, thicker), all else equal."""
    return along_thickness(select(cases, figures, kind=kind))


def top_of_trailing_end(cases: Iterable[PaperCase], *, upwards: bool) -> Iterator[Comparison]:
    """Whether the centroid of slip is in the trailing half and at y > 0, or, if not `upwards`, at y < 0."""
    chosen = list(cases)
    trailing = at_most(chosen, slip_x, 0.0)
    side = at_least(chosen, slip_y, 0.0) if upwards else at_most(chosen, slip_y, 0.0)
    for behind, beside in zip(trailing, side, strict=True):
        holds = None if beside.holds is None else bool(beside.holds and behind.holds)
        yield Comparison(beside.what, beside.left, 0.0, holds, beside.undecided, bound=True)


def spreads(cases: Cases, measure: Measure) -> Iterator[Comparison]:
    """Spread of a measure over the layers of Figures 7 to 10, creepage set by creepage set."""
    chosen = select(cases, MAPS)
    for creepage in dict.fromkeys(c.creepage for c in chosen):
        same = [c for c in chosen if c.creepage == creepage]
        text = "spread over the largest at xi_x = {:g}, xi_y = {:g}, phi = {:g}".format(*creepage)
        yield from spread(same, measure, SIGNIFICANT, text)


def much_smaller(pairs: Pairs, measure: Measure) -> Iterator[Comparison]:
    """Whether `measure` of the second case is below MUCH times that of the first."""
    for c in shrinks(pairs, measure):
        yield c if c.holds is None else replace(c, holds=c.right < MUCH * c.left)


def much_larger(pairs: Pairs, measure: Measure) -> Iterator[Comparison]:
    """Whether `measure` of the second case is above 1/MUCH times that of the first."""
    for c in grows(pairs, measure):
        yield c if c.holds is None else replace(c, holds=MUCH * c.right > c.left)


def similar_patterns(cases: Cases) -> Iterator[Comparison]:
    """Angle (degrees) between the directions in which slip's centroid lies, compliant and stiff panels of Figure 7."""
    for compliant, stiff in between_kinds(cases, [7]):
        (x1, y1), (x2, y2) = measures.slip_centre(compliant.view), measures.slip_centre(stiff.view)
        angle = float(np.degrees(np.abs(np.arctan2(x1 * y2 - x2 * y1, x1 * x2 + y1 * y2))))
        unknown = [c for c in (compliant, stiff) if not np.isfinite(slip_x(c.view))]
        undecided = "; ".join(f"{c.name} {_why_unknown(c)}" for c in unknown)
        holds = None if undecided else angle < SIMILAR
        yield Comparison(f"{compliant.name}, {stiff.name}", angle, SIMILAR, holds, undecided, bound=True)
