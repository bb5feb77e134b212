"""Coverage: error bars of `aligned` cells are narrowed by the kind of contact, all but what the solver leaves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from contacts import MIDDLING, STEEL, steel

from rcstudy.bars import coverage
from rcstudy.bars.estimate import error_estimates
from rcstudy.bars.hidden import Hidden
from rcstudy.mechanics.scene import Creepage, Mesh, Scene, Tolerance

MORE = {"force_x": -20.0, "force_y": 1.0, "moment_z": 1.0, "friction_power": 0.2, "approach": 0.03}
LEVELS = [{name: value * part for name, value in (MIDDLING | MORE).items()} for part in (1.0, 1.002, 1.004)]


def bars(scene: Scene, cells: int = 314, levels: Any = LEVELS, hidden: Hidden | None = None) -> dict[str, float]:
    return error_estimates(scene, cells, levels, hidden)


def of(**settings: Any) -> Scene:
    """Steel on 99 x 99 cells, aligned ones if not told otherwise, with tolerances that hardly add to the bars."""
    fine = {"creepage": Creepage(0.002, 0.001, 0.01), "tolerance": Tolerance(1e-12, 1e-12)}
    return replace(steel(Mesh((2.0, 2.0), (99, 99)), **fine), **({"discretisation": "aligned"} | settings))


def peaked(by: float) -> list[dict[str, float]]:
    """Levels whose largest pressure is 3/2 + `by` times the mean one under 100 N."""
    largest = (1.5 + by) * 100.0 / MIDDLING["contact_area"]
    return [level | {"pressure_max": largest * level["pressure_max"] / MIDDLING["pressure_max"]} for level in LEVELS]


@pytest.mark.parametrize(
    ("settings", "cells", "by", "factors"),
    [
        ({"counterbody": None}, 314, 0.0, coverage.UNLIKE),
        ({"counterbody": STEEL}, 314, 0.0, {}),
        ({"counterbody": None, "coupling": "full"}, 314, 0.0, coverage.COUPLED),
        ({"counterbody": None, "coupling": "full"}, 314, 1.0, coverage.COUPLED),
        ({"counterbody": None}, 314, 1.0, coverage.SOFT),
        ({"counterbody": STEEL}, 314, 1.0, coverage.SOFT),
        ({"counterbody": None}, 78, 0.0, coverage.FEW),
        ({"counterbody": None, "coupling": "full"}, 78, 1.0, coverage.FEW),
        ({"counterbody": None, "discretisation": "kalker"}, 314, 1.0, {}),
    ],
)
def test_bars_are_narrowed_by_the_kind_of_contact(
    settings: dict[str, Any], cells: int, by: float, factors: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, levels = of(**settings), peaked(by)
    narrowed = bars(scene, cells, levels)
    monkeypatch.setattr("rcstudy.bars.coverage.factors", lambda **_: {})
    whole = bars(scene, cells, levels)
    for name, bar in whole.items():
        factor = factors.get(name.removesuffix("_error"), 1.0)
        assert narrowed[name] == pytest.approx(factor * bar, rel=1e-7), name
    assert all(0.5 < factor < 1.0 for factor in factors.values())


def test_pressures_get_peaked_by_and_by() -> None:
    """Half way between pressures like Hertz's and those of films the factor is half way, too."""
    found = [coverage.factors(few=False, coupled=False, peaked=p, unlike=True) for p in (0.0, 0.05, 0.15, 0.25, 2.0)]
    assert [f["friction_power"] for f in found] == pytest.approx([0.8, 0.8, 0.68, 0.56, 0.56])
    assert [f["force_x"] for f in found] == pytest.approx([1.0, 1.0, 0.89, 0.78, 0.78])


def test_one_mesh_alone_is_not_narrowed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few cells have laws of their own, which hold for contacts wherever their edges lie between cells."""
    scene = of(counterbody=None)
    found = [bars(scene, cells, LEVELS[:1]) for cells in (30, 314)]
    monkeypatch.setattr("rcstudy.bars.coverage.factors", lambda **_: {})
    assert found == [bars(scene, cells, LEVELS[:1]) for cells in (30, 314)]


def test_what_the_solver_leaves_is_not_narrowed() -> None:
    loose, tight = (bars(of(counterbody=None, tolerance=Tolerance(t, t))) for t in (1e-3, 1e-12))
    assert loose["friction_power_error"] - tight["friction_power_error"] >= 0.999e-3 * 0.2


def test_the_largest_traction_at_the_largest_pressure_goes_with_it() -> None:
    """And the slip area of a contact that slips everywhere keeps its bar."""
    scene = of(counterbody=None, coupling="full")
    slides = {"traction_max": scene.friction * LEVELS[0]["pressure_max"], "slip_area": LEVELS[0]["contact_area"]}
    found = bars(scene, levels=[level | slides for level in LEVELS], hidden=Hidden(slips_at_top=True))
    assert found["traction_max_error"] == pytest.approx(scene.friction * found["pressure_max_error"], rel=1e-12)
    assert found["slip_area_error"] > found["contact_area_error"]
