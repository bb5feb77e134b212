"""Cusps of the pressure at the border of the stick zone, under full coupling (`mechanics/subcell/cusps.py`)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from contacts import STEEL, solved, steel

from rcstudy.mechanics import contact
from rcstudy.mechanics.contact import solve_normal, solve_rolling
from rcstudy.mechanics.scene import Creepage, Layer, Material, Mesh, Scene, Tolerance
from rcstudy.mechanics.subcell.cusps import (
    Rise,
    by_room,
    difference,
    pressure_at_borders,
    squares_with_cusps,
    within_reach,
)


def test_differences_are_over_the_larger_value() -> None:
    assert difference(3.0, 4.0) == difference(4.0, 3.0) == 0.25
    assert difference(0.0, 0.0) == 0.0


def test_what_tractions_of_a_strip_do_to_the_pressure() -> None:
    """The Hilbert transform of Carter's tractions (Johnson 1985, 8.3): a root behind the border, smooth ahead of it."""
    half, n = 0.6, 400_000  # half the length of the stick zone, at the leading end of a strip from -1 to 1
    ends = np.linspace(-1.0, 1.0, n + 1)
    s = 0.5 * (ends[1:] + ends[:-1])
    border = 1.0 - 2.0 * half
    stick = half * np.sqrt(np.maximum(1.0 - ((s - 1.0 + half) / half) ** 2, 0.0))
    q = np.sqrt(1.0 - s**2) - stick

    def transform(x: float) -> float:
        """(1/pi) int q/(x - s) ds as a principal value, q being constant in the cells between `ends`; at a centre."""
        x = s[np.argmin(np.abs(s - x))]
        return float(np.sum(q * np.log(np.abs((x - ends[:-1]) / (x - ends[1:]))))) / math.pi

    growth = math.sqrt(2.0 * half)  # C: the stick zone's part is C sqrt(x - border) close to the border
    at_border = transform(border)
    for distance in (0.001, 0.004):
        assert np.interp(border + distance, s, stick) == pytest.approx(growth * math.sqrt(distance), rel=5e-3)
        behind, ahead = (transform(border + step) - at_border for step in (-distance, distance))
        assert abs(behind) == pytest.approx(growth * math.sqrt(distance), rel=0.15)
        assert abs(ahead) < 0.15 * abs(behind)


def test_pressure_at_borders_of_cells() -> None:
    """Of Hertz's pressure it is that halfway between cells; in rows that do not slip behind it there is none."""
    x, y = np.meshgrid(np.arange(24.0), np.arange(24.0), indexing="ij")
    p = np.sqrt(np.maximum(1.0 - ((x - 11.5) / 10.3) ** 2 - ((y - 11.2) / 10.3) ** 2, 0.0))
    touched = p > 0.0

    def largest(slip: np.ndarray) -> float:
        return pressure_at_borders(p, np.full_like(p, math.inf), slip & touched, 1.0, math.inf)

    for first in (6.0, 8.0, 13.0):
        expected = 1.0 - ((first - 0.5 - 11.5) / 10.3) ** 2 - (0.2 / 10.3) ** 2
        assert largest(x < first) ** 2 == pytest.approx(expected, rel=1e-12)
    assert largest(x < 0.0) == 0.0  # all sticks
    assert largest(x >= 0.0) == 0.0  # all slips
    assert largest(x > 15.0) == 0.0  # slip ahead of the stick zone only
    assert largest(y > 15.0) == 0.0  # beside it


def test_cusps_are_no_larger_than_coupling_makes_them() -> None:
    """p changes by no more than 0.4 of the rise within a cell; nothing does where nothing is coupled."""
    smooth = np.array([4.0, 4.0, 4.0, 4.0])
    cusped = np.array([4.1, 9.0, 3.9, 0.0])
    inside = np.full(4, math.inf)
    assert within_reach(cusped, smooth, Rise(0.0, inside)) == pytest.approx(smooth)
    assert within_reach(cusped, smooth, Rise(0.2, inside)) == pytest.approx([4.1, 4.0 * 1.08**2, 3.9, 4.0 * 0.92**2])
    assert within_reach(cusped, smooth, Rise(3.0, inside)) == pytest.approx(cusped)
    assert within_reach(cusped, smooth, Rise(3.0, np.zeros(4))) == pytest.approx(smooth)
    by_cells = Rise(0.2, np.array([0.01, 0.3, math.inf, 0.25]))
    assert within_reach(cusped, smooth, by_cells) == pytest.approx([2.004**2, 2.12**2, 3.9, 1.9**2])


def test_a_cusp_rises_as_tractions_grow_in_the_stick_zone() -> None:
    """By C beta per root of a cell, from whichever cell C is taken; by nothing where that cell slips."""
    distance = np.array([1.0, 1.5, 1.9])
    assert by_room(3.0 * np.sqrt(distance), distance, 0.25) == pytest.approx(0.75)
    assert by_room(np.array([0.0, -1e-9]), np.array([1.5, 1.5]), 0.25).tolist() == [0.0, 0.0]


def test_cusps_of_cells_reach_as_far_as_tractions_say() -> None:
    """By the room of the second stick cell, 1.5 cells ahead of the border."""
    p = np.tile(np.array([0.4, 1.0, 1.4, 1.3, 1.2, 1.0, 0.9, 0.6, 0.3])[:, None], (1, 3))
    slip = np.arange(9)[:, None] < np.array([2, 2, 2])
    whole = math.sqrt(np.polyval(np.polyfit([1.5, 2.5, 3.5, 4.5], p[3:7, 0] ** 2, 2), 0.0))
    none = math.sqrt(0.5 * (1.0 + 1.4**2))
    assert whole > none + 0.01
    room = np.full_like(p, 1e9)
    for beta, expected in ((0.0, none), (10.0, whole)):
        assert pressure_at_borders(p, room, slip, 1.0, beta) == pytest.approx(expected)
        for beyond in (1, 2, 3):  # cells ahead of the contact, as all but the longest rows have
            longer = [np.pad(values, ((0, beyond), (0, 0))) for values in (p, room, slip)]
            assert pressure_at_borders(*longer, 1.0, beta) == pytest.approx(expected)
    room[3] = 0.0
    assert pressure_at_borders(p, room, slip, 1.0, 10.0) == pytest.approx(none)
    room[3, 1] = 0.3
    assert pressure_at_borders(p, room, slip, 1.0, 0.2) == pytest.approx(none + 0.4 * 0.2 * 0.3 / math.sqrt(1.5))


def test_cusps_of_cells_never_lower_the_largest_pressure(monkeypatch: pytest.MonkeyPatch) -> None:
    """That of cells elsewhere may be larger than the one at the border."""
    scene = steel(Mesh((0.7, 0.7), (12, 12)), counterbody=None, friction=0.3, creepage=Creepage(0.001))
    cells = solve_normal(scene)
    rolling = solve_rolling(cells, scene)
    zone = cells.slip_zone(rolling, scene.friction)
    for part, expected in ((2.0, 0.5), (0.8, 0.0)):
        monkeypatch.setattr(contact, "pressure_at_borders", lambda *_, part=part: part * zone.pressure)
        found = cells.cusps(zone, rolling, scene.friction)
        assert found.of_pressure == pytest.approx(expected, abs=1e-15)
        border = part * scene.friction * zone.pressure
        assert found.of_traction == pytest.approx(difference(border, zone.traction))


@pytest.mark.parametrize(("width", "expected"), [(4.9, 4.0), (5.1, 0.5 * (4.0 + 1.0))])
def test_cusps_that_point_downwards_count_behind_wide_slip_zones_only(width: float, expected: float) -> None:
    """Half of them: p^2 falls to 1 in the stick zone, and is 4 at the border by the cells beside it."""
    border = 7.5
    p = np.sqrt(1.0 + 0.2 * np.abs(np.arange(20.0) - border))[:, None]
    edges = np.array([[border - width], [19.5]])
    zone = np.array([[border, 0.0]]), np.array([0]), np.array([12.0])
    found = squares_with_cusps(p, np.array([19]), edges, zone, np.array([4.0]), Rise(10.0, np.array([math.inf])))
    assert found == pytest.approx([expected])


@pytest.mark.parametrize("cells", [32, 40, 44])
def test_largest_tractions_of_bodies_that_are_nearly_alike(cells: int) -> None:
    """They are those of bodies alike: a modulus that differs by 1e-9 changed them by up to 4 %."""
    scene = steel(Mesh((0.7, 0.7), (cells, cells)), friction=0.3, creepage=Creepage(2e-5, 1e-5))
    scene = replace(scene, discretisation="aligned", tolerance=Tolerance(1e-7, 1e-8), counterbody=STEEL)
    alike = solved(scene).scalars
    nearly = solved(replace(scene, coupling="full", counterbody=replace(STEEL, E=(1.0 + 1e-9) * STEEL.E))).scalars
    for name in ("traction_max", "pressure_max"):
        assert nearly[name] == pytest.approx(alike[name], rel=1e-6)


COMBINED = steel(
    Mesh((0.875, 0.875), (48, 48)),
    counterbody=None,
    friction=1.0,
    creepage=Creepage(0.002, 0.001, 0.01),
    coupling="full",
    discretisation="aligned",
    tolerance=Tolerance(1e-6, 1e-6),
)
STRAIGHT = replace(COMBINED, friction=0.6, creepage=Creepage(0.002), mesh=Mesh((0.7, 0.7), (48, 48)))
STIFF = replace(
    COMBINED,
    friction=0.6,
    creepage=Creepage(0.001, 0.0, 0.005),
    layers=(Layer(388000.0, 0.2, 0.072),),
    mesh=Mesh((0.75, 0.75), (48, 48)),
)


@pytest.mark.heavy
@pytest.mark.parametrize(("scene", "rel"), [(COMBINED, 2e-3), (STRAIGHT, 4e-3), (STIFF, 6e-3)])
def test_largest_values_at_the_cusp_are_those_of_fine_meshes(scene: Scene, rel: float) -> None:
    """And equal the bound there. Those of cells are 0.8 to 3 % too small on 48 cells, as bars say."""
    found = solved(scene).scalars
    fine = solved(replace(scene, mesh=Mesh(scene.mesh.size, (256, 256)))).scalars
    cells = solved(replace(scene, discretisation="kalker")).scalars
    assert found["traction_max"] == pytest.approx(scene.friction * found["pressure_max"], rel=1e-12)
    for name in ("pressure_max", "traction_max"):
        assert found[name] == pytest.approx(fine[name], rel=rel)
        assert abs(found[name] - fine[name]) <= found[f"{name}_error"]
        assert cells[name] < (1.0 - 8e-3) * fine[name]
        assert fine[name] - cells[name] <= cells[f"{name}_error"]


@pytest.mark.heavy
def test_tractions_on_very_fine_cells_of_the_other_kind_agree() -> None:
    """Whose error falls with the root of their size: from 96 and 384 cells the limit follows."""
    found = solved(COMBINED).scalars["pressure_max"]
    coarse, fine = (
        solved(replace(COMBINED, discretisation="kalker", mesh=Mesh(COMBINED.mesh.size, (n, n)))).scalars[
            "traction_max"
        ]
        for n in (96, 384)
    )
    assert 2.0 * fine - coarse == pytest.approx(found, rel=1.5e-2)
    assert fine == pytest.approx(found, rel=2.5e-2) and fine < (1.0 - 1e-2) * found


@pytest.mark.heavy
def test_without_full_coupling_there_is_none() -> None:
    """And so no correction: largest values are those of smooth pressures."""
    zone = solved(replace(COMBINED, coupling="one-way")).scalars
    assert zone["pressure_max"] == pytest.approx(744.0, rel=1e-3)
    alike = solved(replace(COMBINED, counterbody=Material(210000.0, 0.3), coupling="full")).scalars
    assert alike["pressure_max"] == pytest.approx(469.0, rel=1e-3)
