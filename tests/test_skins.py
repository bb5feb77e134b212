"""What skins thinner than cells hide: cusps behind stick, where tractions begin, load along the rim; their bars."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from contacts import MIDDLING, STEEL, hertz_of, solved, steel

from rcstudy.bars import skins
from rcstudy.bars.estimate import error_estimates
from rcstudy.bars.hidden import Hidden
from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.contact import solve_normal
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.scene import Creepage, Layer, Material, Mesh, Scene
from rcstudy.mechanics.skins import rise_at_cusp
from rcstudy.study import scene_from_mapping

PEEK = Material(3500.0, 0.38)
# a polymer under 1 um of diamond-like carbon and a rigid ball, some of which slips
COATED: dict[str, Any] = {
    "substrate": {"E": 3500, "nu": 0.38},
    "layers": [{"E": 150000, "nu": 0.22, "thickness": 0.001}],
    "counterbody": "rigid",
    "radius": 50,
    "load": 5,
    "friction": 0.5,
    "creepage": {"longitudinal": 0.0008},
    "coupling": "full",
}


def on_cells(mapping: dict[str, Any], size: list[float], cells: int, **more: Any) -> Scene:
    return scene_from_mapping(mapping | more | {"mesh": {"size": size, "cells": [cells, cells]}})


def stepped(beta: float, times: float, thickness: float) -> Any:
    """Responses of bodies that are `times` as stiff to waves shorter than 1/`thickness`; beta is the same for all."""

    def responses(alpha: np.ndarray) -> np.ndarray:
        along = np.where(alpha > 1.0 / thickness, 1.0 / times, 1.0) / alpha
        return np.stack([along, beta * along, along, along])

    return responses


@pytest.mark.parametrize("times", [1.0, 4.0, 100.0])
def test_rise_at_cusps(times: float) -> None:
    """The integral over waves shorter than cells, in closed form: tractions are the root of `times` as steep."""
    side, thickness, radius = 0.1, 0.002, 3.0
    expected = 2.0 * 0.3 * (math.sqrt(times) - 1.0) * (1.0 - math.sqrt(0.1)) * math.sqrt(thickness / radius)
    found = rise_at_cusp(stepped(0.3, times, thickness), side, radius, thickness)
    assert found == pytest.approx(expected, rel=0.05, abs=1e-4)


def test_rise_at_cusps_by_soft_covers() -> None:
    """Tractions change less steeply within them, and cells, which do not see them, have them too steep."""
    assert rise_at_cusp(stepped(0.3, 0.01, 0.002), 0.1, 3.0, 0.002) == 0.0


@pytest.mark.parametrize(
    ("layers", "counterbody", "least", "most"),
    [
        ((), None, 0.0, 0.0),
        ((Layer(3500.0, 0.38, 0.001),), None, 0.0, 1e-9),  # of the substrate's material
        ((Layer(150000.0, 0.22, 0.001),), None, 1.2, 1.3),
        ((Layer(150000.0, 0.22, 0.001),), Material(150000.0, 0.22), 0.5, 0.7),  # its stiff counterbody yields as little
        ((Layer(150000.0, 0.22, 0.2),), None, 0.0, 1e-3),  # eight cells thick: these see it
        ((Layer(350.0, 0.38, 0.001),), None, 0.0, 0.0),
    ],
)
def test_cusps_within_layers(
    layers: tuple[Layer, ...], counterbody: Material | None, least: float, most: float
) -> None:
    influence = Influence(PEEK, layers, counterbody, (0.025, 0.025), 1.0)
    assert least <= influence.cusp_in_skin(0.35) <= most


def aligned_contact(layers: tuple[Layer, ...], substrate: Material, cells: int) -> AlignedContact:
    scene = steel(Mesh((0.4, 0.4), (cells, cells)), substrate=substrate, counterbody=None, layers=layers)
    scene = replace(scene, radius=(3.0, 3.0), load=3.0, discretisation="aligned", creepage=Creepage(0.001))
    return AlignedContact(solve_normal(scene))


def test_second_moments_of_rows() -> None:
    """Those of pressures that end like a root, and of ones that skins bear along the rim, which rows move inwards."""
    smooth = aligned_contact((Layer(1700.0, 0.39, 0.001),), Material(1700.0, 0.39), 46)
    assert smooth.moved_inwards < 0.0005
    plate = aligned_contact((Layer(234000.0, 0.22, 0.0062),), Material(1700.0, 0.39), 46)
    window, (dx, dy) = plate.scene.mesh.centres, plate.scene.mesh.spacing
    x, y = plate.levers
    on_rows = float((x**2 + y**2) @ plate.pressure) * dx * dy / plate.scene.load
    p = plate.solution.p
    on_cells = float(np.sum((window[0][:, None] ** 2 + window[1] ** 2) * p)) * dx * dy / plate.scene.load
    assert on_rows < on_cells
    assert plate.moved_inwards == pytest.approx((on_cells - on_rows) * math.pi / plate.area, rel=1e-3)
    assert 0.01 < plate.moved_inwards < 0.03


def test_second_moments_without_layers() -> None:
    assert aligned_contact((), STEEL, 20).moved_inwards == 0.0


def test_where_tractions_begin() -> None:
    """Within the edge under stiff skins, by the same length on all cells; not without layers or under soft ones."""
    skin, soft = Layer(1e6, 0.3, 1e-5), Layer(20000.0, 0.4, 0.1)
    coarse, fine = (aligned_contact((skin, soft), STEEL, n) for n in (24, 48))
    lengths = [c.edge_of_tractions * math.sqrt(c.area / math.pi) for c in (coarse, fine)]
    assert 2e-4 < lengths[1] < lengths[0] < 2.0 * lengths[1]  # the length times log(dx/length)
    for layers in ((), (Layer(20000.0, 0.4, 0.001),)):
        assert aligned_contact(layers, STEEL, 24).edge_of_tractions == 0.0


@pytest.mark.parametrize(
    ("discretisation", "pressure", "traction"), [("kalker", 0.9 * 1.1 - 1.0, 0.06), ("aligned", 0.9 * 1.15 - 1.0, 0.11)]
)
def test_bars_of_cusps(discretisation: str, pressure: float, traction: float) -> None:
    """As far as the pressure at a border, with its rise, exceeds the largest one; nothing without a border."""
    hidden = Hidden(cusp_in_skin=0.5, at_borders=0.9)
    assert skins.at_cusp(hidden, discretisation) == pytest.approx((max(pressure, 0.0), traction), rel=1e-9)
    assert skins.at_cusp(hidden._replace(at_borders=0.0), discretisation) == (0.0, 0.0)
    assert skins.at_cusp(hidden._replace(at_borders=1.0), discretisation)[0] == pytest.approx(
        {"kalker": 0.1, "aligned": 0.15}[discretisation], rel=1e-9
    )


@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
def test_bars_by_creepages_that_are_rounding(discretisation: Any) -> None:
    """Of forces and moments that vanish without them: no more than they cause where all sticks."""
    scene = steel(Mesh((1.2, 1.2), (24, 24)), creepage=Creepage(0.001), discretisation=discretisation)
    none = solved(scene).scalars
    for parts in ((0.001, 1e-15, 0.0), (0.001, 0.0, 1e-15)):
        found = solved(replace(scene, creepage=Creepage(*parts))).scalars
        for name in ("force_y_error", "moment_z_error"):
            assert found[name] == pytest.approx(none[name], rel=1e-3)
    across = solved(replace(scene, creepage=Creepage(0.0, 0.001))).scalars["force_x_error"]
    found = solved(replace(scene, creepage=Creepage(1e-15, 0.001))).scalars
    assert found["force_x_error"] == pytest.approx(across, rel=1e-3)
    little = solved(replace(scene, creepage=Creepage(0.001, 1e-7))).scalars
    sticking = scene.load * 1e-7 * 50.0 / min(little["contact_radius"], hertz_of().radius)
    assert little["force_y_error"] - none["force_y_error"] == pytest.approx(4.0 * sticking, rel=1e-6)
    assert little["moment_z_error"] - none["moment_z_error"] == pytest.approx(
        4.0 * sticking * little["contact_radius"], rel=1e-6
    )


def test_bars_at_edges() -> None:
    """By the edge where some sticks, by the rim beyond what smooth contacts have; in quadrature."""
    edge, rim = Hidden(edge_of_tractions=0.01), Hidden(moved_inwards=0.02 + 0.03 / 64.0)
    for name, part in (("force_x", 0.5), ("force_y", 0.6), ("moment_z", 0.35), ("slip_area", 2.0)):
        assert skins.at_edges(edge, name, 0.75, 16.0) == pytest.approx(part * 0.01 * 0.5)
        assert skins.at_edges(edge, name, 1.0, 16.0) == 0.0
    for name, part in (("force_x", 0.2), ("force_y", 0.2), ("moment_z", 1.0), ("friction_power", 0.5)):
        assert skins.at_edges(rim, name, 1.0, 16.0) == pytest.approx(part * 0.02)
        assert skins.at_edges(rim, name, 0.0, 16.0) == pytest.approx(0.5 * part * 0.02)
    assert skins.at_edges(Hidden(moved_inwards=0.03 / 64.0), "moment_z", 1.0, 16.0) == 0.0
    both = skins.at_edges(Hidden(edge_of_tractions=0.01, moved_inwards=0.02 + 0.03 / 64.0), "moment_z", 0.75, 16.0)
    assert both == pytest.approx(math.hypot(0.35 * 0.01 * 0.5, 1.0 * 0.02 * 0.875))
    assert skins.at_edges(Hidden(moved_inwards=0.5, edge_of_tractions=0.5), "pressure_max", 0.5, 16.0) == 0.0


@pytest.mark.usefixtures("whole_bars")
def test_bars_have_what_skins_hide() -> None:
    """Cusps are added, what lies at edges in quadrature."""
    scene = steel(Mesh((1.0, 1.0), (24, 24)), creepage=Creepage(0.003, 0.004, 0.01), counterbody=None, coupling="full")
    scene = replace(scene, discretisation="aligned")
    level = MIDDLING | {"force_x": -40.0, "force_y": 20.0, "moment_z": 3.0, "friction_power": 0.2, "approach": 0.03}
    hidden = Hidden(cusp_in_skin=0.1, at_borders=1.0, edge_of_tractions=0.05, slips_at_top=False)
    plain, found = (error_estimates(scene, 314, [level] * 2, h) for h in (Hidden(slips_at_top=False), hidden))
    assert found["pressure_max_error"] - plain["pressure_max_error"] == pytest.approx(0.3 * 0.1 * 100.0)
    assert found["traction_max_error"] - plain["traction_max_error"] == pytest.approx(0.22 * 0.1 * 50.0)
    tolerance = max(scene.tolerance.normal, scene.tolerance.tangential) * scene.friction * scene.load
    before, after = plain["force_y_error"] - tolerance, found["force_y_error"] - tolerance
    added = 0.6 * 0.05 * math.sqrt(0.8) * scene.friction * scene.load
    assert after == pytest.approx(math.hypot(before, added), rel=1e-6)
    assert found["contact_area_error"] == plain["contact_area_error"]


@pytest.mark.heavy
@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
def test_cusps_in_skins_are_within_the_bars(discretisation: str) -> None:
    """Cells of 25 um miss a twentieth of the largest pressure, which rises within 1 um."""
    own = solved(on_cells(COATED, [1.0, 1.0], 40, discretisation=discretisation)).scalars
    fine = solved(on_cells(COATED, [1.0, 1.0], 480, discretisation="aligned")).scalars
    for name in ("pressure_max", "traction_max"):
        missed = fine[name] - own[name]
        assert 0.015 * own[name] < missed < own[f"{name}_error"] < 0.2 * own[name], name


@pytest.mark.heavy
@pytest.mark.parametrize("coupling", ["one-way", "full"])
def test_moments_under_plates_are_within_the_bars(coupling: str) -> None:
    """Rows of `aligned` have the load of the rim farther inside: moments are 6 % too small where all slips."""
    mapping = COATED | {
        "substrate": {"E": 1700, "nu": 0.39},
        "layers": [{"E": 234000, "nu": 0.22, "thickness": 0.0062}],
        "radius": 3,
        "load": 3.15,
        "friction": 0.054,
        "creepage": {"longitudinal": 0.0019, "lateral": 0.00258, "spin": 0.0426},
    }
    scenes = (on_cells(mapping, [0.3928, 0.3928], n, coupling=coupling, discretisation="aligned") for n in (46, 184))
    own, fine = (solved(scene).scalars for scene in scenes)
    missed = abs(own["moment_z"] - fine["moment_z"])
    assert 0.04 * abs(fine["moment_z"]) < missed < own["moment_z_error"]


@pytest.mark.heavy
def test_forces_under_membranes_are_within_the_bars() -> None:
    """Skins of 10 nm on a soft layer move the beginning of tractions by far more than they are thick.

    Against cells four times finer, which miss a part of it, too.
    """
    mapping = COATED | {
        "substrate": {"E": 210000, "nu": 0.3},
        "layers": [{"E": 1e6, "nu": 0.3, "thickness": 1e-5}, {"E": 20000, "nu": 0.4, "thickness": 0.1}],
        "load": 100,
        "friction": 0.3,
        "creepage": {"longitudinal": 0.001, "lateral": 0.0005, "spin": 0.005},
        "coupling": "one-way",
        "discretisation": "aligned",
    }
    own, fine = (solved(on_cells(mapping, [1.2, 1.2], n)).scalars for n in (48, 192))
    for name in ("force_x", "force_y", "slip_area"):
        missed = abs(own[name] - fine[name])
        assert 0.001 * abs(fine[name]) < missed < own[f"{name}_error"], name
