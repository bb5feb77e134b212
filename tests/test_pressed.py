"""Error bars of what pressure, not creepage, makes surfaces slip (`pressed.py`)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from contacts import solved, steel

from rcstudy.bars import pressed
from rcstudy.bars.estimate import error_estimates
from rcstudy.bars.hidden import Hidden
from rcstudy.mechanics.missed import Missed
from rcstudy.mechanics.scene import Creepage, Layer, Mesh, Scene, Tolerance

LEVEL = {"contact_area": 0.2, "contact_radius": 0.25, "pressure_max": 700.0, "approach": 1e-3}


def under_a_rigid_ball(**more: Any) -> Scene:
    return steel(Mesh((1.0, 1.0), (24, 24)), counterbody=None, tolerance=Tolerance(), **more)


def test_powers_are_less_in_doubt_under_peaked_pressures() -> None:
    """By the excess of the pressure's exponent over Hertz's, at most 1."""
    assert pressed.of_edges(0.0) == 1.0
    assert pressed.of_edges(0.8) == pytest.approx(0.5)
    assert pressed.of_edges(7.0) == pressed.of_edges(1.0) == pytest.approx(1.0 / (1.0 + 1.25**2))


@pytest.mark.parametrize(("fastest", "alone"), [(0.0, 1.0), (0.001, 0.25), (0.02, 1.0 / 441.0)])
def test_power_of_slip_by_pressure(fastest: float, alone: float) -> None:
    """Twice as much without creepage; on 16 cells a radius, times 64."""
    hidden = Hidden(by_pressure=0.02, turning=0.5)
    expected = (0.026 * (1.0 + alone) + 0.06 * 0.25) / 64.0 * 0.02
    assert pressed.power(hidden, fastest, 16.0, 0.0) == pytest.approx(expected, rel=1e-12)
    assert pressed.power(hidden, fastest, 16.0, 0.8) == pytest.approx(0.5 * expected, rel=1e-12)
    assert pressed.power(Hidden(), fastest, 16.0, 0.0) == 0.0


def test_forces_across_are_less_sure_where_pressure_turns_slip() -> None:
    """With `aligned` only, by the square of |beta|/(pi mu), which is 1 at most."""
    assert pressed.turned_across(Hidden()) == 1.0
    assert pressed.turned_across(Hidden(turning=0.5)) == pytest.approx(1.15)
    assert pressed.turned_across(Hidden(turning=9.0)) == pytest.approx(1.6)
    level = LEVEL | {"force_x": 10.0, "force_y": 9.0, "moment_z": 1.0, "friction_power": 0.1}
    level |= {"slip_area": 0.1, "traction_max": 200.0}
    for discretisation, factor in (("aligned", 1.6), ("kalker", 1.0)):
        scene = under_a_rigid_ball(creepage=Creepage(0.002, 0.002), discretisation=discretisation)
        plain, found = (
            error_estimates(scene, 314, [level] * 2, Hidden(turning=t))["force_y_error"] for t in (0.0, 9.0)
        )
        assert found == pytest.approx(factor * plain)


@pytest.mark.parametrize(("discretisation", "part"), [("kalker", 0.3), ("aligned", 0.014)])
def test_force_without_creepage(discretisation: str, part: float) -> None:
    hidden = Hidden(by_pressure=0.02)
    assert pressed.force_without_creepage(hidden, discretisation, 0.0, 16.0) == pytest.approx(part / 64.0)
    some = pressed.force_without_creepage(hidden, discretisation, 0.001, 16.0)  # 20 times this is that by pressure
    assert some == pytest.approx(0.25 * part / 64.0)
    assert pressed.force_without_creepage(Hidden(), discretisation, 0.0, 16.0) == 0.0


def test_films_hide_forces_only_where_tractions_are_far_below_their_bound() -> None:
    hidden = Hidden(by_pressure=0.02, missed=Missed(slip=0.05))
    scalars = {"pressure_max": 800.0, "slip_area": 0.038, "contact_area": 0.2}
    found = pressed.missed_on_films(hidden, 0.25, scalars, 0.0, 0.3)
    others = {"traction_max": 0.3 * 0.05 * 800.0, "slip_area": 0.3 * 0.05 / 0.25 * 0.2}
    assert found == pytest.approx({"friction_power": 0.08 * 0.3} | others)
    half = pressed.missed_on_films(hidden, 0.25, scalars, 0.1, 0.3)
    assert half == pytest.approx({name: 0.5 * value for name, value in found.items()})
    assert pressed.missed_on_films(hidden, 0.25, scalars, 0.2, 0.3) == {}


def test_largest_tractions_without_creepage_have_wider_bars() -> None:
    """No longer where the bodies creep at a hundredth of the slip by pressure."""
    hidden = Hidden(by_pressure=0.02)
    assert pressed.wider(hidden, "aligned", 0.0) == {"traction_max": 1.4}
    assert pressed.wider(hidden, "kalker", 0.0) == {"traction_max": 1.3, "slip_area": 1.25}
    assert pressed.wider(hidden, "kalker", 0.0002)["slip_area"] == pytest.approx(1.0 + 0.25 / 21.0**2)
    assert pressed.wider(Hidden(), "aligned", 0.0) == {"traction_max": 1.0}


@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
def test_bars_have_what_pressure_alone_adds(discretisation: str) -> None:
    """Forces, power and largest traction of a contact without creepage; none of them is lost without friction."""
    scene = under_a_rigid_ball(creepage=Creepage(), discretisation=discretisation)
    level = LEVEL | {"force_x": 0.1, "force_y": 0.0, "moment_z": 0.0, "friction_power": 1e-6}
    level |= {"slip_area": 0.0, "traction_max": 0.2}
    hidden = Hidden(by_pressure=0.02, slip_shown=False, largest_of_cells=0.2)
    lost = hidden._replace(missed=Missed(slip=0.05, long_slip=0.04))
    plain, found = (error_estimates(scene, 314, [level] * 2, h) for h in (hidden, lost))
    limited = 2.0 * 0.2 * 0.2 / (scene.friction * scene.load)
    counts = 1.0 - limited / 0.2
    of_long = {"kalker": 0.5, "aligned": 0.75}[discretisation] * 0.04 * 100.0
    more = math.sqrt(found["force_x_error"] ** 2 - plain["force_x_error"] ** 2)
    assert more == pytest.approx(of_long, rel=0.2)  # in quadrature with what meshes show
    of_traction = 0.3 * 0.05 * 700.0 * counts
    if discretisation == "aligned":  # on `kalker` cells the bar of nearly no slip may be larger
        assert found["traction_max_error"] - plain["traction_max_error"] == pytest.approx(of_traction)
    assert found["traction_max_error"] >= of_traction
    of_power = 0.08 * counts * of_long * 0.02 * 10.0 / math.sqrt(314 / math.pi)
    assert found["friction_power_error"] - plain["friction_power_error"] >= 0.5 * of_power
    nil = replace(scene, friction=1e-200, load=1e-200)
    assert error_estimates(nil, 314, [level] * 2, lost)["force_x_error"] >= 0.0


@pytest.mark.heavy
@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
def test_bars_on_a_thin_film_without_creepage(discretisation: str) -> None:
    """On steel under a ball of the same, 0.08 cells thick: cells find a tenth of the force, or less."""

    more: dict[str, Any] = {"layers": (Layer(8650.0, 0.49, 0.012),), "load": 4900.0, "friction": 0.4}
    more |= {"creepage": Creepage(), "tolerance": Tolerance()}
    found = solved(steel(Mesh((3.0, 3.0), (19, 19)), discretisation=discretisation, **more)).scalars
    finer = solved(steel(Mesh((3.0, 3.0), (76, 76)), discretisation="aligned", **more)).scalars
    for name in ("force_x", "friction_power"):
        assert abs(found[name] - finer[name]) < found[f"{name}_error"], name
    assert abs(found["force_x"]) < 0.15 * abs(finer["force_x"])
