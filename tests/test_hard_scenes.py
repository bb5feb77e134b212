"""Scenes that once failed, or that are meant to break the method; and error bars held against finer meshes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from contacts import STEEL, TIGHT, hertz_of, solved, steel, window

from rcstudy.estimate import ALIGNED, FITS, error_estimates
from rcstudy.mechanics.exact import hertz_contact, thin_layer_contact
from rcstudy.mechanics.scene import Creepage, Layer, Material, Mesh, Scene, Tolerance
from rcstudy.result import ESTIMATED, VARIABLES, Status
from rcstudy.solve import solve_scene
from rcstudy.study import scene_from_mapping


@pytest.mark.parametrize("creepage", [1e-3, 1e-5, 1e-6])
@pytest.mark.parametrize("tolerance", [Tolerance(), TIGHT])
def test_vanishing_creepage(creepage, tolerance):
    """The residual is relative to the tractions, not to a bound they never reach."""
    a = hertz_of().a[0]
    solved(steel(window((a, a), (24, 24)), creepage=Creepage(creepage), tolerance=tolerance))


@pytest.mark.parametrize("ratio", [1 + 1e-8, 1 + 1e-9, 1 + 1e-11])
def test_nearly_round_ellipse(ratio):
    h = hertz_contact((20.0, 20.0 * ratio), 100.0, 1e5)
    c = hertz_contact((20.0, 20.0), 100.0, 1e5)
    assert h.approach == pytest.approx(c.approach, rel=1e-8)
    assert h.a == pytest.approx(c.a, rel=2e-8)


@pytest.mark.parametrize("ratio", [1e3, 1e5])
def test_very_thick_layer(ratio):
    """A layer of 1e3 to 1e5 radii is its own half-space, but for the far field that settles the approach (1/ratio)."""
    a = hertz_of(counterbody=None).a[0]
    mesh = window((a, a), (20, 20), 6)
    scene = steel(mesh, counterbody=None, substrate=Material(105000.0, 0.35), creepage=Creepage(0.002, 0.001, 0.01))
    top = solved(scene)
    layered = solved(replace(scene, substrate=STEEL, layers=(Layer(105000.0, 0.35, ratio * a),)))
    difference = np.abs(layered.fields["pressure"] - top.fields["pressure"]).max()
    assert difference <= (3.0 / ratio**3 + 1e-8) * top.scalars["pressure_max"]
    assert 1 - layered.scalars["approach"] / top.scalars["approach"] == pytest.approx(0.357 / ratio, rel=0.02)


@pytest.mark.parametrize("cells", [(128, 8), (64, 4)])
def test_elongated_cells(cells):
    h = hertz_of((20.0, 20000.0))
    creepage = Creepage(0.3 * 0.3 * h.a[0] / 20.0)
    solved(steel(window(h.a, cells), radius=(20.0, 20000.0), friction=0.3, creepage=creepage))


@pytest.mark.heavy
@pytest.mark.parametrize("cells", [(12, 128), (8, 256)])
def test_elongated_cells_under_a_soft_layer(cells):
    """Slip that turns round within a Newton step: without `turned` in `classify` 2000 products, and no end."""
    layers = (Layer(52500.0, 0.4, 0.0507),)
    mesh = Mesh((0.726, 0.726), cells)
    creepage = Creepage(0.002, 0.001, 0.01)
    tolerance = Tolerance(1e-6, 1e-6)
    result = solved(steel(mesh, counterbody=None, layers=layers, creepage=creepage, tolerance=tolerance))
    assert result.scalars["operator_products"] <= 250


@pytest.mark.heavy
@pytest.mark.parametrize("cells", [24, 96])
@pytest.mark.parametrize("tolerance", [Tolerance(), TIGHT])
def test_thin_layer(cells, tolerance):
    """133 thicknesses to the radius: tractions pile up along a row to far more than one cell's slip would make."""
    layer = Layer(21.0, 0.25, 0.002)
    th = thin_layer_contact(50.0, 1.0, layer, 0.002)
    stated = {"substrate": Material(2.1e7, 0.3), "counterbody": None, "layers": (layer,), "load": 1.0}
    for xi, mu in ((5e-4, 0.3), (1e-4, 1.0)):
        solved(steel(window(th.a, (cells, cells)), **stated, friction=mu, creepage=Creepage(xi), tolerance=tolerance))


# Full Newton steps alone cycle between active sets in these (found among 2260 random scenes) and in the last one.
CYCLING = [
    Scene(
        Material(41600.0, 0.0475),
        (48.8, 102.0),
        100.0,
        Mesh((2.13, 3.48), (53, 39)),
        (Layer(336000.0, 0.215, 0.127),),
        friction=1.59,
        creepage=Creepage(0.0, 0.000649, 0.0),
        spin_point=1 / 6,
    ),
    Scene(
        Material(146000.0, 0.125),
        (150.0, 12.7),
        100.0,
        Mesh((3.24, 0.648), (42, 57)),
        (Layer(1100000.0, 0.0143, 0.5),),
        friction=0.497,
        creepage=Creepage(),
    ),
    Scene(
        Material(112000.0, 0.359),
        (3.29, 227.0),
        100.0,
        Mesh((0.221, 3.23), (67, 56)),
        (Layer(53400.0, 0.404, 2.66),),
        Material(111000.0, 0.0269),
        0.145,
        Creepage(0.0, -0.00077, -0.000702),
    ),
    Scene(
        Material(63600.0, 0.0148),
        (67.9, 6.69),
        100.0,
        Mesh((4.25, 0.935), (60, 76)),
        counterbody=Material(15800.0, 0.431),
        friction=0.7,
        creepage=Creepage(0.0, 0.000625, -0.00447),
    ),
    Scene(
        Material(10600.0, 0.408),
        (242.0, 3.95),
        100.0,
        Mesh((8.02, 0.589), (45, 60)),
        friction=0.648,
        creepage=Creepage(-0.000984, -0.00242, 0.00628),
        spin_point=1 / 6,
    ),
    Scene(
        STEEL,
        (1581.1388300841895, 50.0),
        100.0,
        Mesh((4.031922148774373, 0.43996271818672805), (48, 48)),
        (Layer(50000.0, 0.4, 0.05066),),
        creepage=Creepage(0.0, 0.0, 0.02),
        tolerance=Tolerance(1e-6, 1e-6),
    ),
]


@pytest.mark.heavy
@pytest.mark.parametrize("scene", CYCLING)
def test_cycling_active_sets(scene):
    solved(scene)


def test_every_estimated_scalar_has_a_fit_and_a_variable():
    assert set(FITS) == set(ESTIMATED)
    for name in ESTIMATED:
        assert VARIABLES[f"{name}_error"].units == VARIABLES[name].units


def test_estimate_is_stated_as_documented():
    """One level: k0 scale/N. Two: c |S(h) - S(2h)| and the staircase in quadrature. Three: half a difference counts."""
    a = hertz_of().a[0]
    scene = steel(window((a, a), (24, 24)), creepage=Creepage(0.002), tolerance=Tolerance(1e-7, 1e-7))
    fit = FITS["pressure_max"]
    levels = [{"pressure_max": p, "contact_radius": 0.3} for p in (100.0, 101.0, 111.0)]
    per_radius = 10.0
    cells = round(np.pi * per_radius**2)
    per_radius = np.sqrt(cells / np.pi)
    floor = 1e-7 * 100.0
    staircase = fit.k * per_radius**-1.5 * 100.0
    one, two, three = (error_estimates(scene, cells, levels[:n])["pressure_max_error"] for n in (1, 2, 3))
    assert one == pytest.approx(fit.k0 / per_radius * 100.0 + floor, rel=1e-12)
    assert two == pytest.approx(np.hypot(fit.c * 1.0, staircase) + floor, rel=1e-12)
    assert three == pytest.approx(np.hypot(fit.c * 5.0, staircase) + floor, rel=1e-12)


def test_estimate_of_the_slip_area():
    """On aligned cells its noise goes with the root of what slips; where all slips it is the contact's area."""
    scene = steel(Mesh((1.0, 1.0), (24, 24)), creepage=Creepage(0.002), tolerance=Tolerance(1e-7, 1e-7))
    scene = replace(scene, discretisation="aligned")

    def estimates(area: float) -> dict[str, float]:
        levels = [{"contact_area": 2.0, "contact_radius": 0.8, "slip_area": area}] * 2
        return error_estimates(scene, 314, levels)

    small, large = (estimates(area)["slip_area_error"] - 2e-7 for area in (0.1, 0.4))
    assert large == pytest.approx(2.0 * small, rel=1e-12)
    assert large == pytest.approx(ALIGNED["slip_area"].k * (314 / np.pi) ** -0.75 * 2.0 * np.sqrt(0.2), rel=1e-12)
    everything = estimates(2.0)
    assert everything["slip_area_error"] == everything["contact_area_error"] < large


@pytest.mark.heavy
def test_error_bars_hold_on_some_contacts():
    """True errors against a mesh four times finer lie within the bars, bar the one in ten that may stray.

    `scripts/error_bars.py` does this on 64 random contacts: 94 to 100 %.
    """
    layer = Layer(105000.0, 0.3, 0.1)
    strayed = count = 0
    for n, layers, creepage, friction in (
        (12, (), Creepage(0.002, 0.001, 0.0), 1.0),
        (15, (layer,), Creepage(0.002, 0.0, 0.01), 1.0),
        (18, (), Creepage(0.0, 0.0, 0.01), 0.5),
        (21, (layer, layer), Creepage(0.001, 0.002, 0.005), 0.6),
        (24, (Layer(420000.0, 0.3, 0.05),), Creepage(0.002, 0.001, 0.01), 1.0),
    ):
        a = hertz_of().a[0]
        scene = steel(window((a, a), (n, n), n), layers=layers, creepage=creepage, friction=friction)
        scene = replace(scene, tolerance=Tolerance(1e-6, 1e-6))
        mesh = scene.mesh
        fine = solved(replace(scene, mesh=Mesh(mesh.size, (4 * mesh.cells[0], 4 * mesh.cells[1]))))
        own = solved(scene)
        for name in ESTIMATED:
            count += 1
            strayed += abs(own.scalars[name] - fine.scalars[name]) > own.scalars[f"{name}_error"]
    assert strayed <= count // 10


def test_the_papers_method_is_refused_on_aligned_cells():
    a = hertz_of().a[0]
    scene = steel(window((a, a), (12, 12)), creepage=Creepage(0.002), discretisation="aligned", method="paper-cg")
    result = solve_scene(scene)
    assert result.status == Status.REFUSED
    assert "paper-cg" in result.reason


FITTED = {
    "bare": {},
    "soft": {"layers": [{"E": "0.001 Es", "nu": 0.45, "thickness": "0.1 a"}]},
    "plate": {"layers": [{"E": "1000 Es", "nu": 0.3, "thickness": "0.1 a"}]},
    "ellipse": {"radius": [1500, 50], "layers": [{"E": "0.5 Es", "nu": 0.3, "thickness": "0.5 a"}]},
}


@pytest.mark.heavy
@pytest.mark.parametrize("name", FITTED)
@pytest.mark.parametrize("margin", [1.1, 1.25, 2.0])
def test_fitted_window(name, margin):
    """`size: auto`: the contact fills 1/margin of the window's width, to a cell and the 3 % its width is known to."""
    cells = 40
    scene = scene_from_mapping(
        {
            "substrate": {"E": 210000, "nu": 0.3},
            "radius": 50,
            "load": 100,
            "mesh": {"size": "auto", "cells": [cells, cells], "margin": margin},
            **FITTED[name],
        }
    )
    touched = solved(scene).fields["pressure"] > 0.0
    for axis in (0, 1):
        filled = touched.any(axis=axis).sum() / cells
        assert filled == pytest.approx(1.0 / margin, abs=1.5 / cells + 0.03)


@pytest.mark.parametrize("load", [338.0, 339.0])
def test_few_cells_let_another_in(load):
    """Seven cells across: the last change of the approach lets a cell overlap that the active set had left out."""
    solved(Scene(STEEL, (50.0, 50.0), load, Mesh((3.0, 3.0), (16, 16)), creepage=Creepage(0.002)))
    solved(Scene(STEEL, (50.0, 50.0), load, Mesh((3.0, 3.0), (16, 16)), counterbody=STEEL, creepage=Creepage(0.002)))
