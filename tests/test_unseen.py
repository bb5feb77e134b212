"""What slip zones narrower than a cell hide, and bars that know of it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from contacts import STEEL, steel

from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.contact import influence_of, solve_normal, solve_rolling
from rcstudy.mechanics.kernels import leading_slip
from rcstudy.mechanics.scene import Creepage, Layer, Material, Mesh, Scene
from rcstudy.mechanics.subcell import leading_zone
from rcstudy.mechanics.subcell.moved_rows import RowTable
from rcstudy.mechanics.subcell.unseen import Unseen, UnseenSlip, part_within
from rcstudy.solve import solve_scene

HARDLY_SLIPPING = pytest.mark.parametrize(
    ("counterbody", "friction", "creepage"),
    [(None, 0.3, Creepage(0.0, 0.0002)), (None, 0.3, Creepage(-0.0003)), (Material(70000.0, 0.33), 0.1, Creepage())],
)


def test_dundurs_constant() -> None:
    """(1 - 2 nu)/(2 (1 - nu)) of a body on a rigid one, none of bodies alike, that of the layer where it is thick."""

    def beta(scene: Scene) -> float:
        return solve_normal(scene).influence.slip_by_pressure_over_tractions

    scene = steel(Mesh((1.0, 1.0), (20, 20)), counterbody=None)
    assert beta(scene) == pytest.approx(0.4 / 1.4, rel=1e-12)
    assert beta(replace(scene, counterbody=scene.substrate)) == pytest.approx(0.0, abs=1e-15)
    assert beta(replace(scene, layers=(Layer(90000.0, 0.2, 0.6),))) == pytest.approx(0.6 / 1.6, rel=1e-3)


def test_constant_at_the_surface_of_a_thin_layer() -> None:
    """That of the layer and the counterbody; its difference from that on the scale of a cell, where it is thinner."""
    scene = steel(Mesh((1.0, 1.0), (20, 20)))
    assert influence_of(scene).skin_at_edge == (0.0, 0.0)
    film = Material(21000.0, 0.2)
    steel_part = 0.1 * 1.3 / 1.2  # 1/G of the substrate's material over that of the film
    on_steel = (0.6 - 0.4 * steel_part) / (1.6 + 1.4 * steel_part)
    for counterbody, surface in ((None, 0.6 / 1.6), (film, 0.0), (scene.substrate, on_steel)):
        for thickness in (1e-7, 0.01, 0.2):
            scene = replace(scene, counterbody=counterbody, layers=(Layer(film.E, film.nu, thickness),))
            influence = influence_of(scene)
            difference, width = influence.skin_at_edge
            most = abs(surface - influence.slip_by_pressure_over_tractions) * min(thickness, 0.05)
            assert 0.3 * most <= difference * width <= 10.0 * min(thickness, 0.05)
            assert width <= 0.05


def test_what_a_thin_top_layer_hides_goes_by_no_one_layer() -> None:
    """One that is told as two, or a film under an even thinner one, which hid it: the top layer alone counted."""

    def hidden(*layers: tuple[float, float]) -> float:
        scene = steel(Mesh((1.0, 1.0), (20, 20)))
        scene = replace(scene, layers=tuple(Layer(modulus * 210000.0, 0.2, depth) for modulus, depth in layers))
        return math.prod(influence_of(scene).skin_at_edge)

    assert hidden((0.1 * (1.0 + 1e-9), 0.001), (0.1, 0.009)) == pytest.approx(hidden((0.1, 0.01)), rel=0.01)
    assert hidden((1.0, 0.0001), (0.1, 0.01)) > 0.9 * hidden((0.1, 0.01))


def test_how_far_layers_are_as_half_spaces() -> None:
    """Over as many cells as responses to waves as long as these, times wave numbers, are those to waves of one cell."""
    scene = steel(Mesh((1.0, 1.0), (50, 50)), counterbody=None)
    assert influence_of(scene).as_half_space(15, 0.02) == 15
    for modulus, thickness, found in (
        (420000.0, 0.16, 2),  # 8 cells
        (420000.0, 0.64, 8),
        (21000.0, 0.02, 1),
        (210210.0, 0.02, 15),  # a thousandth stiffer than the substrate
        (220500.0, 0.16, 4),
    ):
        influence = influence_of(replace(scene, layers=(Layer(modulus, 0.3, thickness),)))
        assert influence.as_half_space(15, 0.02) == found
        assert influence.as_half_space(1, 0.02) == 1
        along = [alpha * influence.traction_responses(np.array([alpha]))[0, 0] for alpha in 50.0 / np.arange(1, 16)]
        assert found <= next((n for n, value in enumerate(along) if abs(value - along[0]) > 0.02 * along[0]), 15)


def test_bodies_alike_hide_nothing() -> None:
    scene = replace(steel(Mesh((1.0, 1.0), (32, 32)), creepage=Creepage(0.0005)), discretisation="aligned")
    contact = AlignedContact(solve_normal(scene))
    assert contact.unseen_slip(solve_rolling(contact, scene), scene.friction) == Unseen()


def turned_by_spin(nu: float, *, finer: int = 1) -> Scene:
    """A long contact with a stick zone ahead of which most rows slip, as spin turns the traction there."""
    mesh = Mesh((1.54, 0.252), (22 * finer, 44 * finer))
    scene = steel(mesh, radius=(130.0, 8.0), friction=0.134, creepage=Creepage(0.0, -0.0016, 0.0036))
    return replace(scene, counterbody=Material(210000.0, nu), discretisation="aligned")


def rows_ahead_of_stick(scene: Scene) -> tuple[float, Unseen]:
    """Area (mm^2) of half a cell of each row that slips ahead of a stick zone, and what the contact says is unseen."""
    contact = AlignedContact(solve_normal(scene))
    rolling = solve_rolling(contact, scene)
    rows = leading_slip.detached_rows(contact.rows.index, contact.rows.count, rolling.slip)
    assert rows > 8
    return 0.5 * rows * math.prod(scene.mesh.spacing), contact.unseen_slip(rolling, scene.friction)


def test_half_a_cell_ahead_of_stick_is_no_slip() -> None:
    """Between bodies that are alike, and that are nearly so: the slip area does not depend on which."""
    area, unseen = rows_ahead_of_stick(turned_by_spin(0.3))
    assert unseen == Unseen(missing=-area)
    nearly, of_nearly = rows_ahead_of_stick(turned_by_spin(0.3 - 1e-7))
    assert nearly == area
    assert of_nearly.missing == pytest.approx(-area, rel=1e-3)
    alike, other = (solve_scene(turned_by_spin(nu)).scalars["slip_area"] for nu in (0.3, 0.3 - 1e-7))
    assert alike == pytest.approx(other, rel=1e-5)


@pytest.mark.heavy
@pytest.mark.parametrize("nu", [0.3, 0.295])
def test_slip_areas_are_closer_without_that_half_of_a_cell(nu: float) -> None:
    area, _ = rows_ahead_of_stick(turned_by_spin(nu))
    found = solve_scene(turned_by_spin(nu)).scalars["slip_area"]
    fine = solve_scene(turned_by_spin(nu, finer=6)).scalars["slip_area"]
    assert abs(found - fine) < 0.45 * abs(found + area - fine)


@pytest.mark.heavy
@pytest.mark.parametrize("cells", [24, 32, 48])
@HARDLY_SLIPPING
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


@pytest.mark.heavy
@pytest.mark.parametrize("cells", [24, 32])
@pytest.mark.parametrize(
    ("friction", "creepage"),
    [(0.3, Creepage(-0.0003)), (0.3, Creepage(0.0, 0.0002)), (0.15, Creepage(0.0, 0.0, 0.001))],
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


@pytest.mark.heavy
@pytest.mark.parametrize("cells", [24, 32])
@HARDLY_SLIPPING
def test_forces_are_freed_of_what_leading_cells_make_too_large(
    counterbody: Material | None, friction: float, creepage: Creepage, cells: int
) -> None:
    """Of what sums of tractions are off a seventh is left, and less."""
    scene = steel(Mesh((1.0, 1.0), (cells, cells)), counterbody=counterbody, friction=friction, creepage=creepage)
    scene = replace(scene, discretisation="aligned")
    contact = AlignedContact(solve_normal(scene))
    rolling = solve_rolling(contact, scene)
    unseen = contact.unseen_slip(rolling, scene.friction)
    found = solve_scene(scene).scalars
    summed, *_ = contact.resultant(rolling, scene.friction)
    assert found["force_x"] == pytest.approx(summed - unseen.force_x, rel=1e-4)
    fine = solve_scene(replace(scene, mesh=Mesh((1.0, 1.0), (256, 256)))).scalars
    assert abs(found["force_x"] - fine["force_x"]) < 0.2 * abs(summed - fine["force_x"])


def test_what_slip_takes_from_tractions() -> None:
    """In a strip the zone ends at 4 e^-2 of where stick reaches the bound, and tractions fall by w/2 r^(-1/2)."""
    w = 4.0 * np.exp(-2.0)  # of w0
    angle = (np.arange(20000) + 0.5) * np.pi / 40000  # r = w sin^2, for roots at both ends
    r, weight = w * np.sin(angle) ** 2, np.pi / 40000 * 2.0 * np.sqrt(w) * np.sin(angle)  # dr/sqrt(w - r)
    slope = (0.5 * np.log(1.0 / r) - 1.0) / np.sqrt(r)
    assert np.sum(slope * weight) == pytest.approx(0.0, abs=2e-4)
    assert np.sum(np.sqrt(r) * np.log(1.0 / r) * weight) / np.pi == pytest.approx(0.5 * w, rel=1e-4)


@pytest.mark.parametrize("counterbody", [None, Material(70000.0, 0.2)])
def test_hidden_force_is_across_the_edge_on_oblong_cells(counterbody: Material | None) -> None:
    """An edge at 45 degrees, no tractions behind it: of a row that sticks all along, pi/2 of what is in doubt.

    The power in doubt is that of a fifth of the slip by the pressure. It is taken, never given, whichever body yields
    more along the surface.
    """
    influence = influence_of(steel(Mesh((1.0, 2.0), (50, 50)), counterbody=counterbody))
    assert (influence.slip_under_pressure > 0.0) == (counterbody is None)
    rows = 6
    index, number = np.arange(rows)[None], np.arange(rows, dtype=float)
    ends, normals = (
        np.array([2.0 * number - 0.4, 2.0 * number + 0.748]),
        np.array([[1.0], [-1.0]]) * np.full(rows, 0.5**0.5),
    )
    pressure = np.linspace(100.0, 200.0, rows)
    zones = leading_zone.numbers(3, 0.748, 0.0264)
    of_rows = RowTable(index, ends[1] - 0.748, np.ones(rows, dtype=int), ends), normals, (number, number)
    by_pressure = np.full((rows, 2), (1e-3, 3e-3))
    unseen = UnseenSlip(*of_rows, pressure, by_pressure, 0.748, zones, 1.0, influence)
    found = unseen.of(np.zeros((rows, 2)), np.zeros(rows, dtype=bool), 1.5)
    assert found.force_y == pytest.approx(-found.force_x, rel=1e-12, abs=0.0)
    assert np.hypot(found.force_x, found.force_y) == pytest.approx(
        0.5 * np.pi * found.doubtful_force, rel=1e-12, abs=0.0
    )
    assert found.doubtful_power == pytest.approx(
        0.2 * found.doubtful_force * abs(influence.slip_under_pressure) * 200.0, rel=1e-12, abs=0.0
    )
    assert found.work == pytest.approx(1.5 * (1e-3 * found.force_x + 3e-3 * found.force_y), rel=1e-12, abs=0.0)
    assert found.missing == pytest.approx(0.85 * found.doubtful_area, rel=1e-12, abs=0.0)
    # slip that is partly along the edge is resisted less along it: across waves bodies are more compliant
    n, along_edge = np.array([1.0, -1.0]) * 0.5**0.5, np.array([1.0, 1.0]) * 0.5**0.5
    turned = unseen.of(0.6 * 0.5 * pressure[:, None] * along_edge, np.zeros(rows, dtype=bool), 0.5)
    force, bodies = np.array([turned.force_x, turned.force_y]), [STEEL, counterbody] if counterbody else [STEEL]
    compliance = sum((1.0 - body.nu) / body.G for body in bodies) / sum(1.0 / body.G for body in bodies)
    slip = 0.6 / math.copysign(0.8, influence.slip_under_pressure)  # along over across the edge
    assert force @ along_edge == pytest.approx(compliance * slip * (force @ n), rel=1e-9, abs=0.0)
    assert force @ n != 0.0


@pytest.mark.parametrize(
    ("layers", "most"),
    [
        ((), 6),  # what the table has
        ((Layer(21000.0, 0.3, 0.02),), 2),
        ((Layer(220500.0, 0.3, 0.16),), 4),
        ((Layer(420000.0, 0.3, 0.64),), 6),
    ],
)
def test_zones_are_freed_of_what_they_hide_where_the_layer_is_as_a_half_space(
    layers: tuple[Layer, ...], most: int
) -> None:
    """Up to so many slip cells, and up to two over any layer."""
    influence = influence_of(steel(Mesh((1.0, 1.0), (50, 50)), counterbody=None, layers=layers))
    cells, ends = np.arange(12), np.array([[-0.4], [11.748]])
    table = RowTable(cells[:, None], np.array([11.0]), np.array([12]), ends)
    of_row = table, np.array([[1.0], [0.0]]), (11.0 - cells, 0.0 * cells)
    zones = leading_zone.numbers(7, 0.748, 0.0264)
    unseen = UnseenSlip(*of_row, np.sqrt(cells + 1.0), np.zeros((12, 2)), 0.748, zones, 1.0, influence)
    found = [unseen.of(np.zeros((12, 2)), cells < slips, 0.1).force_x for slips in range(9)]
    assert [force != 0.0 for force in found] == [slips <= most for slips in range(9)]


@pytest.mark.parametrize("friction", [0.003, 0.01, 0.03])
@pytest.mark.parametrize("direction", [(0.75, 0.0), (0.0, 1.0)])
def test_no_force_exceeds_that_of_friction(friction: float, direction: tuple[float, float]) -> None:
    """Slip zones that a few cells do not show, in a contact 5 x 2 cells wide: up to 4 times it without this limit."""
    creepage = Creepage(*(1e-3 * friction * along for along in direction))
    scene = replace(steel(Mesh((1.379, 1.4345), (14, 5)), counterbody=None), friction=friction, creepage=creepage)
    found = solve_scene(replace(scene, discretisation="aligned")).scalars
    assert 0.5 < math.hypot(found["force_x"], found["force_y"]) / (friction * scene.load) < 1.0 + 1e-9


def test_part_of_a_correction_that_friction_allows() -> None:
    """All of it where it stays within the circle, else what reaches it; none from outside outwards."""
    assert part_within(1.0, (0.2, 0.0), (0.7, 0.0)) == 1.0
    assert part_within(1.0, (0.2, 0.0), (1.6, 0.0)) == pytest.approx(0.5)
    assert part_within(1.0, (0.6, 0.0), (0.0, 1.6)) == pytest.approx(0.5)
    assert part_within(1.0, (0.6, 0.0), (-3.2, 0.0)) == pytest.approx(0.5)
    assert part_within(1.0, (0.0, 0.5), (0.0, 0.6)) == pytest.approx(5.0 / 6.0)
    assert part_within(1.0, (1.001, 0.0), (0.1, 0.0)) == 0.0
    assert part_within(1.0, (0.5, 0.5), (0.0, 0.0)) == 1.0
