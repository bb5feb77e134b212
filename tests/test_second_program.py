"""rcstudy's solutions against those of a program written from the description alone (`second_program.py`)."""

from __future__ import annotations

import ast
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import second_program
from second_program import XP, XX, XY, YP, YY, ZZ, Material, Problem, scaled_response

import rcstudy
from rcstudy.result import ESTIMATED, VARIABLES

FIELDS = tuple(name for name, variable in VARIABLES.items() if variable.kind == "field")
STEEL = {"E": 210000.0, "nu": 0.3}
ALUMINIUM = {"E": 70000.0, "nu": 0.33}
CLOSE = 1e-9  # of the natural scale of each number


def scene(size: tuple[float, float], cells: tuple[int, int], **more: Any) -> dict[str, Any]:
    """Steel under a rigid ball of 50 mm and 100 N, contact radius about 0.26 mm; `more` is added or replaces."""
    stated = {"substrate": STEEL, "radius": 50.0, "load": 100.0, "friction": 0.3}
    return stated | {"mesh": {"size": list(size), "cells": list(cells)}} | more


def layer(modulus: float, nu: float, thickness: float) -> dict[str, float]:
    """A layer with `modulus` times that of steel; its thickness in mm."""
    return {"E": modulus * STEEL["E"], "nu": nu, "thickness": thickness}


SCENES = {
    "bare, bodies unlike": scene(
        (0.95, 0.95), (12, 12), counterbody=ALUMINIUM, creepage={"longitudinal": 1e-3, "lateral": -6e-4, "spin": 2e-3}
    ),
    "soft layer": scene((0.8, 0.8), (11, 12), layers=[layer(0.25, 0.4, 0.15)], creepage={"longitudinal": -2e-3}),
    "stiff layer": scene(
        (0.7, 0.7), (12, 11), layers=[layer(4.0, 0.2, 0.1)], counterbody=STEEL, creepage={"lateral": 1e-3}
    ),
    "three layers": scene(
        (0.95, 0.95),
        (12, 12),
        layers=[layer(0.5, 0.49, 0.1), layer(2.0, 0.1, 0.12), layer(0.7, 0.45, 0.2)],
        counterbody=ALUMINIUM,
        creepage={"longitudinal": 1.2e-3, "lateral": 5e-4},
    ),
    "unequal radii, oblong cells, odd numbers": scene(
        (0.6, 1.2), (13, 9), radius=[30.0, 120.0], layers=[layer(0.6, 0.3, 0.2)], creepage={"lateral": -1.5e-3}
    ),
    "spin, ahead by 1/6": scene(
        (0.85, 0.85), (13, 12), counterbody=STEEL, creepage={"lateral": 7e-4, "spin": 3e-3}, spin_point=1.0 / 6.0
    ),
    "spin the other way, ahead by 1/4": scene(
        (0.75, 0.7),
        (12, 13),
        layers=[layer(0.5, 0.35, 0.15)],
        creepage={"lateral": 9e-4, "spin": -8e-3},
        spin_point=0.25,
    ),
    "nearly full slip": scene(
        (0.8, 0.75),
        (12, 11),
        layers=[layer(1.5, 0.25, 0.2)],
        counterbody=STEEL,
        friction=0.05,
        creepage={"longitudinal": 2.5e-4, "spin": 2.5e-4},
    ),
    "hardly any creepage": scene(
        (0.85, 0.85), (11, 11), counterbody=STEEL, creepage={"longitudinal": 2e-7, "lateral": 1e-7, "spin": -3e-7}
    ),
    "rolling without creepage": scene(
        (1.0, 1.0), (12, 12), layers=[layer(0.4, 0.45, 0.2)], counterbody=ALUMINIUM, creepage={}
    ),
    "pressure only": scene((1.0, 0.6), (14, 11), radius=[90.0, 25.0], layers=[layer(0.3, 0.48, 0.12)]),
    "full coupling, layers": scene(
        (0.85, 0.85),
        (12, 12),
        layers=[layer(0.5, 0.3, 0.12), layer(1.6, 0.25, 0.1)],
        coupling="full",
        creepage={"longitudinal": 1e-3, "lateral": 8e-4, "spin": -2e-3},
    ),
    "full coupling, much friction": scene(
        (0.7, 0.75), (12, 13), coupling="full", friction=2.0, creepage={"longitudinal": -4e-3, "lateral": 2e-3}
    ),
    "moduli nearly equal": scene(
        (0.75, 0.75),
        (12, 12),
        layers=[layer(1.0001, 0.3, 0.1), layer(0.9999, 0.3001, 0.2)],
        counterbody={"E": 210010.0, "nu": 0.3001},
        creepage={"longitudinal": 8e-4, "spin": 1e-3},
    ),
}


@cache
def problem_of(name: str) -> Problem:
    """The second program's problem of a scene."""
    return Problem(SCENES[name])


@cache
def solved_twice(name: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """The second program's solutions, by either start of the tractions."""
    first, other = (second_program.solve(problem_of(name), start) for start in ("no traction", "slip everywhere"))
    return first, other


@cache
def solved_by_rcstudy(name: str) -> dict[str, Any]:
    """Fields [n] and scalars of rcstudy's solution, for all that a scene has."""
    result = rcstudy.solve(SCENES[name] | {"tolerance": {"normal": 1e-12, "tangential": 1e-12}})
    assert int(result["status"]) == 0, str(result["status_reason"].values)
    found = {key: result[key].values.ravel() for key in FIELDS if key in result}
    return found | {key: float(result[key]) for key in ESTIMATED if key in result}


def natural_scales(problem: Problem, numbers: dict[str, Any]) -> dict[str, float]:
    """What errors of each number are measured by: largest pressure, traction and known slip, forces of all cells."""
    scales = {name: numbers[name] for name in ("pressure_max", "contact_area", "contact_radius", "approach")}
    scales["pressure"] = numbers["pressure_max"]
    if "traction_x" not in numbers:
        return scales
    traction = np.hypot(numbers["traction_x"], numbers["traction_y"])
    known = np.hypot(*problem.known_slip(numbers["pressure"]).reshape(2, -1))
    slip = known[numbers["pressure"] > 0].max()
    force = traction.sum() * problem.cell_area
    moment = (traction * np.hypot(problem.x, problem.y)).sum() * problem.cell_area
    scales |= {"traction_x": traction.max(), "traction_y": traction.max(), "traction_max": traction.max()}
    scales |= {"slip_x": slip, "slip_y": slip, "force_x": force, "force_y": force, "moment_z": moment}
    return scales | {"friction_power": force * slip, "slip_area": numbers["contact_area"], "state": 1.0}


def differences(problem: Problem, expected: dict[str, Any], found: dict[str, Any]) -> dict[str, float]:
    """Largest difference of each field and scalar, of its natural scale."""
    assert expected.keys() == found.keys()
    scales = natural_scales(problem, expected)
    return {name: float(np.abs(found[name] - expected[name]).max() / scales[name]) for name in expected}


def wrong(problem: Problem, expected: dict[str, Any], found: dict[str, Any]) -> dict[str, float]:
    """The fields and scalars that differ by more than CLOSE, or are no numbers, with their differences."""
    return {name: value for name, value in differences(problem, expected, found).items() if not value <= CLOSE}


@pytest.mark.heavy
@pytest.mark.parametrize("name", SCENES)
def test_solutions_agree(name: str) -> None:
    """All that rcstudy gives, cells in the same state. (Largest difference found: 6e-12.)"""
    expected = solved_twice(name)[0]
    rolls = "creepage" in SCENES[name]
    assert expected.keys() == {key for key in (*FIELDS, *ESTIMATED) if rolls or not VARIABLES[key].tangential}
    assert not wrong(problem_of(name), expected, solved_by_rcstudy(name))


# --- the second program by itself, and what the comparison would find ---


@pytest.mark.parametrize("name", [name for name in SCENES if "creepage" in SCENES[name]])
def test_both_starts_lead_to_one_solution(name: str) -> None:
    """No traction, and slip everywhere. (Largest difference found: 2e-13.)"""
    assert not wrong(problem_of(name), *solved_twice(name))


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.499, 0.5])
def test_layers_of_one_material_respond_like_a_half_space(nu: float) -> None:
    """From waves much longer than the layers to much shorter ones: Johnson 1985, 3.2, 3.6.

    Of the largest response 3e-16 are found, where long double is no wider than double 8e-13.
    """
    body = Material(210000.0, nu)
    layers = [body._replace(thickness=thickness) for thickness in (0.1, 0.02, 0.5)]
    expected = np.array([1.0 - nu, 0.5 - nu, 1.0 - nu, 1.0]) / float(body.G)
    found = scaled_response(body, layers, np.geomspace(1e-6, 1e3, 40))
    assert np.abs(found - expected[:, None]).max() <= 1e-11 * expected.max()


def test_layers_of_one_material_change_no_coefficient() -> None:
    bare = scene((0.8, 0.6), (7, 9), counterbody=ALUMINIUM)
    expected = second_program.coefficients(bare)
    found = second_program.coefficients(bare | {"layers": [layer(1.0, 0.3, 0.1), layer(1.0, 0.3, 0.2)]})
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-11 * expected.max())


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("component", "i", "j"), [(ZZ, 1, 0), (XX, 1, 0), (YY, 0, 1), (XY, 1, 1), (XP, 1, 0), (YP, 0, 1)]
)
def test_one_coefficient_that_is_off_is_found(component: int, i: int, j: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """By 1e-7: then some number is off by 7e-9 to 3e-8."""
    name = "three layers"
    values = second_program.coefficients(SCENES[name])
    values[component, i, j] *= 1.0 + 1e-7
    monkeypatch.setattr(second_program, "coefficients", lambda _: values)
    assert wrong(problem_of(name), second_program.solve(Problem(SCENES[name])), solved_by_rcstudy(name))


@pytest.mark.heavy
@pytest.mark.parametrize("entry", range(4))
def test_a_response_that_is_off_is_found(entry: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """By 1e-7 in a, b, c or d of the layered body: then some number is off by 1e-8 to 4e-8."""
    name = "three layers"

    def off(substrate: Material, layers: Sequence[Material], k: np.ndarray) -> np.ndarray:
        response = scaled_response(substrate, layers, k)
        response[entry] *= 1.0 + 1e-7 * bool(layers)
        return response

    monkeypatch.setattr(second_program, "scaled_response", off)
    assert wrong(problem_of(name), second_program.solve(Problem(SCENES[name])), solved_by_rcstudy(name))


@pytest.mark.heavy
def test_another_material_is_found() -> None:
    """A layer's Poisson's ratio of 0.41 in place of 0.4 changes these by more than 1e-4 of their scales."""
    name = "soft layer"
    other = Problem(SCENES[name] | {"layers": [layer(0.25, 0.41, 0.15)]})
    found = differences(other, second_program.solve(other), solved_by_rcstudy(name))
    changed = {key for key, value in found.items() if value > 1e-4}
    assert changed >= {"pressure", "approach", "traction_x", "traction_y", "slip_x", "force_x", "friction_power"}


def test_nothing_of_rcstudy_is_shared() -> None:
    tree = ast.parse(Path(second_program.__file__).read_text(encoding="utf-8"))
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
    names = {alias.name for node in imports if isinstance(node, ast.Import) for alias in node.names}
    names |= {str(node.module) for node in imports if isinstance(node, ast.ImportFrom)}
    assert {name.partition(".")[0] for name in names} <= {*sys.stdlib_module_names, "numpy", "scipy"}
