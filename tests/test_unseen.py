"""What slip zones narrower than a cell hide, and bars that know of it."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from contacts import steel

from rcstudy.estimate import Hidden, error_estimates
from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.contact import solve_normal, solve_rolling
from rcstudy.mechanics.scene import Creepage, Layer, Material, Mesh, Scene
from rcstudy.mechanics.unseen import Unseen, slip_by_pressure_over_tractions
from rcstudy.result import ESTIMATED
from rcstudy.solve import solve_scene


def test_dundurs_constant() -> None:
    """(1 - 2 nu)/(2 (1 - nu)) of a body on a rigid one, none of bodies alike, that of the layer where it is thick."""

    def beta(scene: Scene) -> float:
        return slip_by_pressure_over_tractions(solve_normal(scene).influence)

    scene = steel(Mesh((1.0, 1.0), (20, 20)), counterbody=None)
    assert beta(scene) == pytest.approx(0.4 / 1.4, rel=1e-12)
    assert beta(replace(scene, counterbody=scene.substrate)) == pytest.approx(0.0, abs=1e-15)
    assert beta(replace(scene, layers=(Layer(90000.0, 0.2, 0.6),))) == pytest.approx(0.6 / 1.6, rel=1e-3)


def test_bodies_alike_hide_nothing() -> None:
    scene = replace(steel(Mesh((1.0, 1.0), (32, 32)), creepage=Creepage(0.0005)), discretisation="aligned")
    contact = AlignedContact(solve_normal(scene))
    assert contact.unseen_slip(solve_rolling(contact, scene), scene.friction) == Unseen()


@pytest.mark.heavy
@pytest.mark.parametrize("cells", [24, 32, 48])
@pytest.mark.parametrize(
    ("counterbody", "friction", "creepage"),
    [(None, 0.3, Creepage(0.0, 0.0002)), (None, 0.3, Creepage(-0.0003)), (Material(70000.0, 0.33), 0.1, Creepage())],
)
def test_bars_where_slip_zones_are_narrower_than_cells(
    counterbody: Material | None, friction: float, creepage: Creepage, cells: int
) -> None:
    """Forces are up to 7 % off there, and meshes agree with each other: bars held a twentieth of that once."""
    scene = steel(Mesh((1.0, 1.0), (cells, cells)), counterbody=counterbody, friction=friction, creepage=creepage)
    scene = replace(scene, discretisation="aligned")
    found = solve_scene(scene).scalars
    fine = solve_scene(replace(scene, mesh=Mesh((1.0, 1.0), (320, 320)))).scalars
    for name in ("force_x", "force_y", "slip_area"):
        assert abs(found[name] - fine[name]) <= found[f"{name}_error"] + 1.1 * fine[f"{name}_error"]


@pytest.mark.parametrize("cells", [24, 32])
@pytest.mark.parametrize(
    ("friction", "creepage"),
    [(0.3, Creepage(0.0, 0.0002)), (0.3, Creepage(-0.0003)), (0.15, Creepage(0.0, 0.0, 0.001))],
)
def test_slip_areas_are_given_what_cells_miss(friction: float, creepage: Creepage, cells: int) -> None:
    """A rigid ball's slip areas are half as far off as what borders between slip and stick cells tell, or less."""
    scene = steel(Mesh((1.0, 1.0), (cells, cells)), counterbody=None, friction=friction, creepage=creepage)
    scene = replace(scene, discretisation="aligned")
    contact = AlignedContact(solve_normal(scene))
    missing = contact.unseen_slip(solve_rolling(contact, scene), scene.friction).missing
    found = solve_scene(scene).scalars["slip_area"]
    fine = solve_scene(replace(scene, mesh=Mesh((1.0, 1.0), (160, 160)))).scalars["slip_area"]
    assert abs(found - fine) < 0.5 * abs(found - missing - fine)


def test_power_that_is_not_seen() -> None:
    """A fifth of the slip that the largest pressure makes on the spot, under what leading slip zones take."""
    scene = steel(Mesh((1.0, 1.0), (32, 32)), counterbody=None, friction=0.3, creepage=Creepage(0.0, 0.0002))
    contact = AlignedContact(solve_normal(scene))
    found = contact.unseen_slip(solve_rolling(contact, scene), 0.3)
    slip = abs(contact.influence.slip_under_pressure) * float(contact.pressure.max())
    assert found.force > 0.0
    assert found.power == pytest.approx(0.2 * slip * found.force, rel=1e-12)


def test_bars_take_in_all_that_is_hidden() -> None:
    """Each part of `Hidden` in the bars of what it concerns, over parts that others state, and in no other's."""
    scene = steel(Mesh((1.0, 1.0), (24, 24)), counterbody=None, friction=0.5, creepage=Creepage(0.003, 0.004, 0.01))
    scene = replace(scene, discretisation="aligned", coupling="full")
    level = dict.fromkeys(ESTIMATED, 1.0) | {"contact_area": 2.0, "slip_area": 0.8, "pressure_max": 100.0}
    level |= {"traction_max": 40.0, "contact_radius": 0.8, "approach": 3.0}
    per_radius = math.sqrt(314 / math.pi)

    def more(hidden: Hidden) -> dict[str, float]:
        without, bars = (error_estimates(scene, 314, [level] * 3, h) for h in (Hidden(), hidden))
        difference = {name: bars[f"{name}_error"] - without[f"{name}_error"] for name in ESTIMATED}
        return {name: value for name, value in difference.items() if value > 1e-12}

    slip = Unseen(force_x=-0.01, force_y=0.02, force=0.03, moment_z=-0.004, area=0.05, missing=0.01, power=0.006)
    fastest = 0.005 + 0.01 * 0.8
    assert more(Hidden(slip=slip)) == pytest.approx(
        {
            "force_x": 1.3 * 0.01,
            "force_y": 1.3 * 0.02,
            "moment_z": 1.3 * 0.004,
            "friction_power": 1.3 * (0.03 * fastest + 0.006),
            "traction_max": 0.5 * 0.03 / 2.0,
            "slip_area": 0.4 * 0.05,
        },
        rel=1e-9,
    )
    assert more(Hidden(lift=-0.2)) == pytest.approx({"approach": 0.03 / per_radius * 0.2 * 3.0}, rel=1e-9)
    assert more(Hidden(cusp_of_pressure=0.1)) == pytest.approx({"pressure_max": 0.075 / per_radius * 100.0}, rel=1e-9)
    assert more(Hidden(cusp_of_tractions=0.1)) == pytest.approx({"traction_max": 0.04 / per_radius * 40.0}, rel=1e-9)
    softly = more(Hidden(softly=0.01))
    assert set(softly) == {"contact_area", "contact_radius", "slip_area", "pressure_max", "approach"}
    assert softly["contact_area"] == pytest.approx(0.0045 * 2.0, rel=1e-9)
    assert softly["contact_radius"] == pytest.approx(0.00225 * 0.8, rel=1e-9)
    assert softly["pressure_max"] == pytest.approx(4e-4 * 100.0, rel=1e-9)
    assert softly["approach"] == pytest.approx(2.5e-4 * 3.0, rel=1e-9)
