"""Solutions keep their tolerance: not their residuals alone, but what they are off by."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from contacts import STEEL

from rcstudy.mechanics.contact import solve_normal
from rcstudy.mechanics.rolling import solve_tractions
from rcstudy.mechanics.scene import Coupling, Creepage, Layer, Material, Mesh, Scene, Tolerance
from rcstudy.mechanics.stopping import pressure_residual, pressure_tolerance, traction_residual
from rcstudy.result import Status
from rcstudy.solve import solve_group, solve_scene

SOFT = (Layer(52500.0, 0.3, 0.06),)
STIFF = (Layer(840000.0, 0.3, 0.06), Layer(420000.0, 0.3, 0.06))


@pytest.mark.heavy
@pytest.mark.parametrize("cells", [64, 96, 128, 256])
@pytest.mark.parametrize(
    ("layers", "counterbody", "coupling"),
    [((), STEEL, "one-way"), (SOFT, None, "one-way"), (STIFF, None, "one-way"), (SOFT, None, "full")],
)
def test_tractions_and_pressure_are_within_the_tolerance(
    layers: tuple[Layer, ...], counterbody: Material | None, coupling: Coupling, cells: int
) -> None:
    """In L2, against the same equations solved to 1e-10. Residuals alone left 1.2 to 3 times the tolerance."""
    scene = Scene(
        STEEL,
        (50.0, 50.0),
        100.0,
        Mesh((1.2, 1.2), (cells, cells)),
        layers,
        counterbody,
        creepage=Creepage(0.002, 0.001, 0.01),
        coupling=coupling,
        tolerance=Tolerance(1e-5, 1e-5),
    )
    found, true = (solve_scene(replace(scene, tolerance=Tolerance(t, t))) for t in (1e-5, 1e-10))
    assert found.status == true.status == Status.SOLVED
    for names in (("pressure",), ("traction_x", "traction_y")):
        ours, far = (np.stack([result.fields[name] for name in names]) for result in (found, true))
        assert np.linalg.norm(ours - far) <= 1e-5 * np.linalg.norm(far), names


def test_where_solvers_stop() -> None:
    """Below the tolerance, but not below what rounding allows, and at the tolerance where that is less."""
    assert pressure_residual(1e-5, 1e-13, 300) == pytest.approx(3e-6)
    assert pressure_residual(1e-5, 1e-13, 1500 * 256) == pytest.approx(1.5e-6)
    assert pressure_residual(1e-5, 5e-6, 300) == 5e-6
    assert pressure_residual(1e-5, 1e-4, 300) == 1e-5
    assert traction_residual(1e-5, 300) == pytest.approx(6.5e-6)
    assert traction_residual(1e-5, 1500 * 256) == pytest.approx(1.625e-6)
    assert traction_residual(1.2e-11, 300) == 1e-11
    assert traction_residual(1e-12, 300) == 1e-12


def test_residuals_are_relative_to_the_slip_where_all_sticks() -> None:
    """To the rigid slip by the operator's diagonal: tractions add up along rows, and bounds are never reached."""
    mesh = Mesh((1.2, 1.2), (40, 40))
    scene = Scene(STEEL, (50.0, 50.0), 100.0, mesh, (), STEEL, creepage=Creepage(0.002, 0.001), friction=1e4)
    contact = solve_normal(scene)
    bound, w = scene.friction * contact.pressure, contact.known_slip(scene)
    found = solve_tractions(contact.operator, contact.cells, bound, w, 1e-6)
    assert not found.slip.any()
    rho = 1.0 / contact.operator.diagonal
    assert rho * np.linalg.norm(w) < 0.9 * min(np.linalg.norm(found.q), np.linalg.norm(bound))
    assert found.residual == pytest.approx(np.linalg.norm(found.s) / np.linalg.norm(w), rel=1e-6, abs=0.0)
    assert found.residual <= 1e-6


def test_tolerance_of_the_pressure_for_small_tractions() -> None:
    """Lower by the ratio from a third of the bounds on, as far as the larger of the two tolerances asks for it.

    By powers of two, so that neighbours share one pressure.
    """
    both = Tolerance(1e-5, 1e-7)
    assert pressure_tolerance(both, 1.0) == pressure_tolerance(both, 3.0) == 1e-5
    assert pressure_tolerance(both, 3.01) == pressure_tolerance(both, 6.0) == 1e-5 / 2
    assert pressure_tolerance(both, 30.0) == 1e-5 / 16
    assert pressure_tolerance(both, np.nan) == pressure_tolerance(both, np.inf) == 1e-5
    assert pressure_tolerance(Tolerance(1e-7, 1e-5), 30.0) == 1e-7
    assert pressure_tolerance(Tolerance(1e-6, 1e-5), 300.0) == 1e-6 / 16


@pytest.mark.heavy
@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
def test_small_tractions_are_within_the_tolerance(discretisation: Any) -> None:
    """They were up to 7 times farther off; cases that share the pressure are what they are alone."""
    mesh = Mesh((0.7, 0.7), (48, 48))
    few: dict[str, Any] = {"friction": 0.4, "discretisation": discretisation, "tolerance": Tolerance(1e-5, 1e-5)}
    creepages = Creepage(-2e-5, 1e-5), Creepage(0.004, 0.0), Creepage(2e-5, 0.0, 2e-5)
    scenes = [Scene(STEEL, (50.0, 50.0), 100.0, mesh, (), STEEL, creepage=c, **few) for c in creepages]
    for scene, shared in zip(scenes, solve_group(scenes), strict=True):
        found, true = solve_scene(scene), solve_scene(replace(scene, tolerance=Tolerance(1e-10, 1e-10)))
        assert shared.status == found.status == true.status == Status.SOLVED
        ours, far = (np.stack([r.fields[f"traction_{k}"] for k in "xy"]) for r in (found, true))
        assert np.linalg.norm(ours - far) <= 1e-5 * np.linalg.norm(far)
        for name, values in found.fields.items():
            np.testing.assert_array_equal(values, shared.fields[name])
        assert found.scalars["products_normal"] == shared.scalars["products_normal"]
