"""How the paper's statements are judged, on stand-ins for its cases."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rcstudy.report import judge, measures


def named(monkeypatch: pytest.MonkeyPatch, views: dict[str, Any]) -> list[Any]:
    """Stand-ins for cases of the paper, with these views."""
    monkeypatch.setattr(judge, "words", lambda case: case.name)
    return [SimpleNamespace(name=name, view=view) for name, view in views.items()]


def test_much_smaller_is_a_tenth_smaller(monkeypatch: pytest.MonkeyPatch) -> None:
    first, hardly, much = named(monkeypatch, {"a": 1.0, "b": 0.95, "c": 0.85})
    found = judge.much_smaller([(first, hardly), (first, much)], lambda view: view)
    assert [c.holds for c in found] == [False, True]


def test_much_larger_is_the_same_the_other_way_round(monkeypatch: pytest.MonkeyPatch) -> None:
    hardly, much, last = named(monkeypatch, {"a": 0.95, "b": 0.85, "c": 1.0})
    found = judge.much_larger([(hardly, last), (much, last), (last, much)], lambda view: view)
    assert [c.holds for c in found] == [False, True, False]


def test_the_top_of_the_trailing_end_is_behind_and_above(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measures, "slip_centre", lambda view: view)
    cases = named(monkeypatch, {"a": (-0.3, 0.2), "b": (0.3, 0.2), "c": (-0.3, -0.2), "d": (0.3, -0.2)})
    top, bottom = (judge.top_of_trailing_end(cases, upwards=upwards) for upwards in (True, False))
    assert [c.holds for c in top] == [True, False, False, False]
    assert [c.holds for c in bottom] == [False, False, True, False]


def ratio_of_slip(slip: float, error: float, area_error: float, cells: float = 100.3) -> Any:
    """A solved case with a contact area of 2 mm^2, `cells` cells, and errors of both areas."""
    numbers = {"slip_area": slip, "slip_area_error": error, "contact_area": 2.0, "contact_area_error": area_error}
    spacing = (2.0 / cells, 1.0)
    return SimpleNamespace(mapped=True, solved=True, spacing=spacing, number=numbers.__getitem__)


@pytest.mark.parametrize(
    ("errors", "holds"),
    [((0.01, 0.0), True), ((0.06, 0.0), None), ((0.01, 0.05), True), ((0.01, 0.1), None), ((0.04, 0.04), None)],
)
def test_ratios_of_slip_differ_by_more_than_both_areas_errors(
    monkeypatch: pytest.MonkeyPatch, errors: tuple[float, float], holds: bool | None
) -> None:
    """From 0.5 to 0.55: undecided where the errors of both cases, added up, come to 0.05."""
    views = {"a": ratio_of_slip(1.0, *errors), "b": ratio_of_slip(1.1, *errors)}
    (found,) = judge.grows([tuple(named(monkeypatch, views))], measures.slip_ratio)  # type: ignore[list-item]
    assert found.holds is holds


def test_slip_patterns_are_similar_within_an_angle(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 30 degrees; without slip in one of two there is none to tell."""
    centres = {"a": (-1.0, 0.0), "b": (-1.0, -0.5), "c": (-1.0, 0.7), "d": (np.nan, np.nan)}
    views = {name: SimpleNamespace(centre=at, solved=True, mapped=True) for name, at in centres.items()}
    monkeypatch.setattr(measures, "slip_centre", lambda view: view.centre)
    first, *others = named(monkeypatch, views)
    monkeypatch.setattr(judge, "between_kinds", lambda cases, figures: [(first, other) for other in others])
    found = list(judge.similar_patterns([]))
    assert [c.holds for c in found] == [True, False, None]
    assert found[2].undecided == "d has no such cells"


@pytest.mark.parametrize(("slips", "part"), [((0.0, 0.0), 0.0), ((0.0, 0.2), 1.0), ((0.15, 0.2), 0.25)])
def test_spread_is_a_part_of_the_largest(slips: tuple[float, float], part: float) -> None:
    """Nothing of nothing, where no case slips."""
    cases = [SimpleNamespace(view=SimpleNamespace(slip=slip, solved=True)) for slip in slips]
    (found,) = judge.spread(cases, lambda view: view.slip, 0.2, "slip")
    assert (found.left, found.holds) == (pytest.approx(part), part > 0.2)


def test_what_stays_the_same_neither_grows_nor_shrinks(monkeypatch: pytest.MonkeyPatch) -> None:
    pair = tuple(named(monkeypatch, {"a": 1.0, "b": 1.0}))
    for judged in (judge.grows, judge.shrinks):
        (found,) = judged([pair], lambda view: view)  # type: ignore[list-item]
        assert found.holds is False
