"""How the paper's statements are judged, on stand-ins for its cases."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rcstudy.report import judge, measures
from rcstudy.report.paper import SPIN, PaperCase, along_creepage, along_thickness, compliant_and_stiff, with_more_spin
from rcstudy.report.paper_statements import STATEMENTS, more_lateral
from rcstudy.report.statements import numbers, verdict
from rcstudy.result import CellState


def named(monkeypatch: pytest.MonkeyPatch, views: dict[str, Any]) -> list[Any]:
    """Stand-ins for cases of the paper, with these views."""
    monkeypatch.setattr(judge, "words", lambda case: case.name)
    return [SimpleNamespace(name=name, view=view) for name, view in views.items()]


def test_much_smaller_is_a_tenth_smaller(monkeypatch: pytest.MonkeyPatch) -> None:
    first, hardly, much = named(monkeypatch, {"a": 1.0, "b": 0.95, "c": 0.85})
    found = judge.much_smaller([(first, hardly), (first, much)], lambda view: view)
    assert [c.holds for c in found] == [False, True]


def test_where_a_ratio_decides_it_is_the_number_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not by how much the numbers change."""
    monkeypatch.setattr(judge, "words", lambda case: "")
    monkeypatch.setattr(judge, "_why_undecided", lambda *_: "")
    pairs: Any = [(SimpleNamespace(view=left), SimpleNamespace(view=right)) for left, right in ((2.0, 1.0), (8.0, 6.0))]
    measure: Any = float
    assert numbers(list(judge.shrinks(pairs, measure, by=0.9))) == "ratio 0.5 to 0.75"
    assert numbers(list(judge.grows(pairs, measure, by=1.1))) == "ratio 0.5 to 0.75"
    assert numbers(list(judge.shrinks(pairs, measure))) == "2 → 1; 8 → 6"


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
    """Of 5 degrees; without slip, or with slip alone, in one of two there is none to tell."""
    at = {"a": (-1.0, 0.0), "b": (-1.0, -0.08), "c": (-1.0, 0.1)}
    states = {"d": [CellState.STICK] * 4, "e": [CellState.SLIP] * 4}
    views: dict[str, Any] = {name: SimpleNamespace(centre=centre) for name, centre in at.items()}
    for name, state in states.items():
        map_of = np.reshape(state, (2, 2))
        views[name] = SimpleNamespace(centre=(np.nan, np.nan), solved=True, mapped=True, state=map_of)
    monkeypatch.setattr(measures, "slip_centre", lambda view: view.centre)
    monkeypatch.setattr(measures, "slip_turn", lambda view: 0.1)
    first, *others = named(monkeypatch, views)
    found = list(judge.similar_patterns((first, other) for other in others))
    assert [c.holds for c in found] == [True, False, None, None]
    assert [c.undecided for c in found[2:]] == ["d has no such cells", "e slips everywhere"]


def test_slip_patterns_of_few_cells_decide_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two of 100 slip cells, half a radius from the middle, turn the centroid by 2.3 degrees, of 10000 by none."""
    monkeypatch.setattr(measures, "slip_centre", lambda view: view.centre)
    held = {}
    for cells in (10, 100):
        state = np.full((cells, cells), CellState.SLIP)
        turned = [(-0.5, -0.5 * np.tan(np.radians(angle))) for angle in (0.0, 2.0, 6.0)]
        views = {
            name: SimpleNamespace(centre=centre, state=state, mapped=True)
            for name, centre in zip("abc", turned, strict=True)
        }
        first, *others = named(monkeypatch, views)
        found = judge.similar_patterns((first, other) for other in others)
        held[cells] = [c.holds for c in found]
    assert held == {10: [None, None], 100: [True, False]}


@pytest.mark.parametrize(("slips", "holds"), [((0.0, 0.0), False), ((0.2, 0.0), True), ((0.2, 0.15, 0.17), True)])
def test_spread_is_a_part_of_the_largest(
    monkeypatch: pytest.MonkeyPatch, slips: tuple[float, ...], holds: bool
) -> None:
    """Nothing of nothing, where no case slips."""
    cases = named(monkeypatch, dict(zip("abc", slips, strict=False)))
    (found,) = judge.spread(cases, lambda view: view, 0.2)
    assert (found.left, found.right, found.holds) == (max(slips), min(slips), holds)


@pytest.mark.parametrize("unsolved", ["b", "c", "abc"])
def test_spread_over_cases_that_are_not_solved_is_undecided(monkeypatch: pytest.MonkeyPatch, unsolved: str) -> None:
    values = {name: np.nan if name in unsolved else value for name, value in zip("abc", (1.0, 2.0, 3.0), strict=True)}
    views = {name: SimpleNamespace(value=value, solved=name not in unsolved) for name, value in values.items()}
    (found,) = judge.spread(named(monkeypatch, views), lambda view: view.value, 0.2)
    assert found.holds is None and "not solved" in found.undecided


@pytest.mark.parametrize(("error", "holds"), [(4.6, True), (5.0, None), (np.nan, None)])
def test_numbers_with_error_bars_differ_by_more_than_these(
    monkeypatch: pytest.MonkeyPatch, error: float, holds: bool | None
) -> None:
    """100 and 110 MPa; 110 and 90 by a factor of MUCH; a value against a bound."""

    def view(peak: float) -> Any:
        return SimpleNamespace(number={"pressure_max": peak, "pressure_max_error": error}.__getitem__)

    low, high, lower = named(monkeypatch, {"a": view(100.0), "b": view(110.0), "c": view(90.0)})  # 0.9 · 110 - 90 = 9
    assert [c.holds for c in judge.grows([(low, high)], judge.peak)] == [holds]
    assert [c.holds for c in judge.much_smaller([(high, lower)], judge.peak)] == [True if error == 4.6 else None]
    assert [c.holds for c in judge.at_most([low], judge.peak, 105.0)] == [holds]


@pytest.mark.parametrize(("error", "holds"), [(9.0, True), (11.0, None)])
def test_only_small_error_bars_tell_that_a_mesh_is_representative(
    monkeypatch: pytest.MonkeyPatch, error: float, holds: bool | None
) -> None:
    """Of 100 MPa; a larger bar does not tell that the error is as large."""
    view = SimpleNamespace(number={"pressure_max": 100.0, "pressure_max_error": error}.__getitem__)
    (found,) = judge.representative(named(monkeypatch, {"a": view}), judge.peak)
    assert found.holds is holds


def test_a_ratio_of_nothing_does_not_tell_whether_a_mesh_is_representative(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no cell slips the error was divided by zero, and the cube taken to be damaged."""
    none = ratio_of_slip(0.0, 0.01, 0.01)
    none.state = np.full((2, 2), CellState.STICK)
    (found,) = judge.representative(named(monkeypatch, {"a": none}), measures.slip_ratio)
    assert (found.holds, found.undecided) == (None, "a has no such cells")


def of_paper(modulus: float, thickness: float = 0.5, creepage: tuple[float, float, float] = (0.002, 0.0, 0.0)) -> Any:
    """A case of Figure 5 with one layer of this modulus, over the substrate's."""
    kind = "compliant" if modulus < 1.0 else "stiff"
    return PaperCase(None, 5, "a", kind, (modulus,), thickness, creepage)  # type: ignore[arg-type]


def test_pairs_along_thickness_have_one_modulus() -> None:
    cases = [of_paper(modulus, thickness) for thickness in (1.0, 0.25, 0.5) for modulus in (0.5, 0.25)]
    found = [(a.moduli == b.moduli, a.thickness, b.thickness) for a, b in along_thickness(cases)]
    assert found == [(True, 0.25, 0.5), (True, 0.5, 1.0)] * 2


def test_each_compliant_layer_is_compared_with_each_stiff_one() -> None:
    found = compliant_and_stiff([of_paper(modulus) for modulus in (4.0, 0.5, 2.0, 0.25)])
    assert [(a.moduli[0], b.moduli[0]) for a, b in found] == [(0.5, 4.0), (0.5, 2.0), (0.25, 4.0), (0.25, 2.0)]


def test_other_creepages_are_compared_at_one_thickness() -> None:
    cases = [of_paper(m, h, (xi, 0.0, 0.0)) for m in (0.5, 2.0) for h in (0.5, 1.0) for xi in (0.001, 0.002)]
    found = list(judge.between_creepages(cases, [5]))
    assert len(found) == 4
    assert all(a.thickness == b.thickness and a.creepage != b.creepage for a, b in found)


def test_only_cells_of_its_size_are_those_of_the_papers_mesh() -> None:
    cases: Any = [
        SimpleNamespace(creepage=(0.002, 0.0, 0.0), view=SimpleNamespace(grid="xy", spacing=(2.0 / n, 2.0 / 64)))
        for n in (60, 64)
    ]
    assert judge.papers_mesh(cases) == cases[1:]


def test_pairs_along_a_creepage_have_the_others_in_common() -> None:
    spins = [(0.0, -0.01), (0.001, 0.01), (0.0, 0.0), (0.001, 0.005), (0.001, 0.0)]
    cases = [of_paper(0.5, creepage=(0.002, *at)) for at in spins]
    pairs = [(a.creepage[1:], b.creepage[1:]) for a, b in along_creepage(cases, SPIN)]
    assert pairs == [((0.0, 0.0), (0.0, -0.01)), ((0.001, 0.0), (0.001, 0.005)), ((0.001, 0.005), (0.001, 0.01))]
    assert len(list(with_more_spin(cases))) == 4


def test_more_lateral_creepage_is_more_than_some() -> None:
    """Of the paper's a and b: what the first of it changes is another matter."""
    creepages = [(0.002, lateral, spin) for lateral in (0.0, 0.002, 0.001) for spin in (0.0, 0.01)]
    cases = [PaperCase(None, 7, "", "compliant", (0.5,), 0.5, at) for at in creepages]  # type: ignore[arg-type]
    pairs = [(a.creepage, b.creepage) for a, b in more_lateral(cases, [7])]
    assert pairs == [((0.002, 0.001, 0.0), (0.002, 0.002, 0.0))]


def test_statements_on_spin_compare_the_panels_and_the_sides_that_they_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """One of them not those without spin; of each side of the contact one, whose rival is of the other side."""
    monkeypatch.setattr(judge, "words", lambda case: case.panel)
    monkeypatch.setattr(measures, "trailing_slip", lambda view, upper: view.sides[upper])
    creepages = {"a": (0.001, 0.0), "c": (0.0, 0.005), "d": (0.0, 0.01), "e": (0.001, 0.005), "f": (0.001, 0.01)}
    cases = []
    for panel, (lateral, spin) in creepages.items():
        view = ratio_of_slip(1.0, 0.0, 0.0)
        view.sides = (0.5 - spin, 0.5 + spin)  # at y < 0 and at y > 0
        cases.append(PaperCase(view, 7, panel, "compliant", (0.5,), 0.5, (0.002, lateral, spin)))
    ratios, above, below = (
        next(statement for statement in STATEMENTS if words in statement.quote)
        for words in (
            "more stick zones can be found for smaller spin",
            "spin creepage can enhance",
            "partly by the spin",
        )
    )
    assert [c.what for c in ratios.judge(cases)] == ["c → d", "e → f"]
    for one in (above, below):
        verdicts = [verdict(list(judged(cases))) for judged in (one.judge, one.instead)]
        assert verdicts == ["borne out (4 of 4)", "not borne out (0 of 4)"]


def test_what_stays_the_same_neither_grows_nor_shrinks(monkeypatch: pytest.MonkeyPatch) -> None:
    pair = tuple(named(monkeypatch, {"a": 1.0, "b": 1.0}))
    for judged in (judge.grows, judge.shrinks):
        (found,) = judged([pair], lambda view: view)  # type: ignore[list-item]
        assert found.holds is False


def test_cases_that_slip_everywhere_are_said_to(monkeypatch: pytest.MonkeyPatch) -> None:
    views = {name: ratio_of_slip(2.0, 0.01, 0.0) for name in "ab"}
    (found,) = judge.grows([tuple(named(monkeypatch, views))], measures.slip_ratio)  # type: ignore[list-item]
    assert (found.holds, found.undecided) == (None, "both slip everywhere")


@pytest.mark.parametrize(("count", "text"), [(3, "0, 0.125, 0.25"), (4, "0 to 0.375")])
def test_many_numbers_beside_a_bound_are_told_by_their_range(
    monkeypatch: pytest.MonkeyPatch, count: int, text: str
) -> None:
    cases = named(monkeypatch, {str(k): 0.125 * k for k in range(count)})
    assert numbers(list(judge.at_most(cases, lambda view: view, 0.3))) == text
