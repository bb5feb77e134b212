"""Error bars are no wider than load and friction allow."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from contacts import MIDDLING, steel

from rcstudy.bars import bounds
from rcstudy.bars.estimate import error_estimates
from rcstudy.bars.hidden import Hidden
from rcstudy.mechanics.scene import Creepage, Material, Mesh, Scene

FOUND = MIDDLING | {"force_x": -40.0, "force_y": 0.5, "moment_z": 3.0, "friction_power": 0.2}
SCENE = replace(steel(Mesh((1.0, 1.0), (24, 24)), creepage=Creepage(0.003, 0.004, 0.01)), friction=0.6, load=200.0)


@pytest.mark.parametrize(
    ("name", "found", "most"),
    [
        ("force_x", -40.0, 160.0),  # the true one is -120 N to 120 N
        ("force_y", 0.5, 120.5),
        ("slip_area", 0.2, 1.1 - 0.2),  # 0 to 1.1 mm^2
        ("slip_area", 0.9, 0.9),
        ("traction_max", 20.0, 0.6 * 105.0 - 20.0),  # 0 to 0.6 times 105 MPa
        ("traction_max", 60.0, 60.0),
    ],
)
def test_bars_end_where_no_true_value_can_be(name: str, found: float, most: float) -> None:
    """Those that do not reach it are left, as are all of other scalars."""
    scalars = FOUND | {name: found}
    bars = dict.fromkeys(scalars, 1e9) | {"contact_area": 0.1, "pressure_max": 5.0}
    assert bounds.within(bars, scalars, SCENE)[name] == pytest.approx(most, rel=1e-12)
    less = bars | {name: 0.99 * most}
    assert bounds.within(less, scalars, SCENE)[name] == 0.99 * most
    others = bars.keys() - {"force_x", "force_y", "slip_area", "traction_max"}
    assert {other: bounds.within(bars, scalars, SCENE)[other] for other in others} == {
        other: bars[other] for other in others
    }


def test_contacts_without_tractions_have_no_such_bounds() -> None:
    scalars = {name: FOUND[name] for name in ("pressure_max", "contact_area", "contact_radius", "approach")}
    bars = dict.fromkeys(scalars, 1e9)
    assert bounds.within(bars, scalars, SCENE) == bars


@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
@pytest.mark.parametrize(("cells", "meshes"), [(1, 1), (30, 2), (314, 3)])
def test_estimates_are_within_these_bounds(discretisation: Any, cells: int, meshes: int) -> None:
    """Of whatever is hidden, on few cells or many; it would be more than the friction force otherwise."""
    scene: Scene = replace(SCENE, discretisation=discretisation, counterbody=Material(70000.0, 0.3))
    hidden = Hidden(by_layers=9.0, unsettled=9.0, cusp_of_traction=9.0, turning=3.0, by_pressure=10.0)
    bars = error_estimates(scene, cells, [FOUND] * meshes, hidden)
    assert bars["force_x_error"] == pytest.approx(160.0, rel=1e-12)
    assert bars["force_y_error"] == pytest.approx(120.5, rel=1e-12)
    assert bars["slip_area_error"] <= 1.0 + bars["contact_area_error"] - 0.2
    assert bars["traction_max_error"] <= max(0.6 * (100.0 + bars["pressure_max_error"]) - 50.0, 50.0)
