"""The same body in other words: layers of one material, and of the substrate's own, are one with it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from contacts import STEEL, solved, steel
from studies import BASE, load_text

from rcstudy.cases import expand, layer_set, normal_problem
from rcstudy.mechanics.scene import Creepage, Layer, Material, Mesh, Scene

HARD, SOFT = Material(420000.0, 0.3), Material(70000.0, 0.2)


def layers(*of: tuple[Material, float]) -> tuple[Layer, ...]:
    return tuple(Layer(material.E, material.nu, thickness) for material, thickness in of)


def coated(**more: Any) -> Scene:
    stated: dict[str, Any] = {"counterbody": None, "creepage": Creepage(-0.0005, 0.0002, 0.001), "friction": 0.2}
    return steel(Mesh((1.0, 1.0), (24, 24)), **(stated | more))


@pytest.mark.parametrize(
    ("told", "joined"),
    [
        (layers((STEEL, 0.1)), ()),
        (layers((STEEL, 0.1), (STEEL, 0.2)), ()),
        (layers((HARD, 0.1), (HARD, 0.2), (STEEL, 0.3)), layers((HARD, 0.1 + 0.2))),
        (layers((STEEL, 0.1), (HARD, 0.2)), layers((STEEL, 0.1), (HARD, 0.2))),  # not at the bottom
        (layers((HARD, 0.1), (SOFT, 0.2), (HARD, 0.3)), layers((HARD, 0.1), (SOFT, 0.2), (HARD, 0.3))),
        (layers((STEEL, 0.1), (STEEL, 0.2), (SOFT, 0.1)), layers((STEEL, 0.1 + 0.2), (SOFT, 0.1))),
        (layers((Material(STEEL.E, 0.2), 0.1)), layers((Material(STEEL.E, 0.2), 0.1))),
        ((), ()),
    ],
)
def test_joined(told: tuple[Layer, ...], joined: tuple[Layer, ...]) -> None:
    scene = coated(layers=told)
    assert scene.joined == replace(scene, layers=joined)
    assert (scene.joined is scene) == (told == joined)
    assert normal_problem(scene) == normal_problem(scene.joined)
    assert layer_set(scene) == layer_set(scene.joined)


@pytest.mark.heavy
@pytest.mark.parametrize("coupling", ["one-way", "full"])
@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
@pytest.mark.parametrize("counterbody", [None, STEEL])
def test_results_are_those_of_the_body(counterbody: Material | None, discretisation: str, coupling: str) -> None:
    """A layer of the substrate's own material moved forces by a fifth, and their bars to a thirtieth."""
    scene = coated(counterbody=counterbody, discretisation=discretisation, coupling=coupling, friction=0.08)
    for plain, told in (
        ((), layers((STEEL, 0.05), (STEEL, 0.08))),
        (layers((HARD, 0.03 + 0.05)), layers((HARD, 0.03), (HARD, 0.05), (STEEL, 0.2))),
    ):
        one, other = (solved(replace(scene, layers=of)) for of in (plain, told))
        numbers = one.scalars.keys() - {"solve_seconds"}
        assert {name: one.scalars[name] for name in numbers} == {name: other.scalars[name] for name in numbers}
        for name, values in one.fields.items():
            np.testing.assert_array_equal(values, other.fields[name])
    assert not replace(scene, counterbody=STEEL, coupling="full", layers=layers((STEEL, 0.1))).is_coupled


@pytest.mark.heavy
@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
def test_results_go_over_into_those_of_the_body(discretisation: str) -> None:
    """A thousandth stiffer, a layer of whatever thickness changes forces as little."""
    scene = coated(discretisation=discretisation, friction=0.08)
    bare = solved(scene).scalars
    for thickness in (0.01, 0.05, 0.13):
        found = solved(replace(scene, layers=(Layer(1.001 * STEEL.E, STEEL.nu, thickness),))).scalars
        for name in ("force_x", "force_y", "force_x_error", "slip_area_error"):
            assert found[name] == pytest.approx(bare[name], rel=0.02)


def test_windows_are_those_of_the_body(tmp_path: Any) -> None:
    """So are the cases that share a pressure; what the study says of layers is kept."""
    text = BASE.replace("mesh: {size: [2, 2]", "mesh: {size: auto")
    own = "[{E: 210000, nu: 0.3, thickness: 0.05}, {E: 210000, nu: 0.3, thickness: 0.1}]"
    study = load_text(tmp_path, text + f"  g: {{axes: {{layers: [[], {own}]}}}}\n")
    bare, told = (case.scene for case in expand(study).cases)
    assert told.mesh == bare.mesh
    assert normal_problem(told) == normal_problem(bare)
    assert len(told.layers) == 2
