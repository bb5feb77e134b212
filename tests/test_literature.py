"""Results name the publications that their equations and methods come from, and no others."""

from dataclasses import replace
from pathlib import Path

import pytest
from studies import BASE, load_text

import rcstudy
from rcstudy.cube import open_cube
from rcstudy.mechanics.literature import PUBLICATIONS, behind, listed
from rcstudy.mechanics.scene import Creepage, Layer, Material, Mesh, Scene
from rcstudy.show import summary
from rcstudy.sweep import run

STEEL = Material(E=210000.0, nu=0.3)
PRESSURE = Scene(
    substrate=STEEL, radius=(50.0, 50.0), load=100.0, mesh=Mesh(size=(1.0, 1.0), cells=(8, 8)), counterbody=STEEL
)
ROLLING = replace(PRESSURE, creepage=Creepage(longitudinal=0.001))
SOFT, STIFF = Layer(E=70000.0, nu=0.3, thickness=0.1), Layer(E=400000.0, nu=0.2, thickness=0.1)
OF_PRESSURE = {"Tribology Letters 2021", "Johnson 1985", "Love 1929", "Polonsky and Keer 1999", "Vollebregt 2014"}
OF_NEWTON = {"Kalker 1990", "Saad 1993", "Eisenstat and Walker 1996", "Wiener and Hopf 1931"}
OF_ALIGNED = {"Kalker 1967", "Haines and Ollerton 1963", "Morozov 1966"}
OF_STIFF = {"Hamilton 2000", "Hintermüller, Ito and Kunisch 2003"}
OF_TURNS = {"Panagiotopoulos 1975", "Anderson 1965", "Walker and Ni 2011"}


@pytest.mark.parametrize(
    ("scene", "added"),
    [
        (PRESSURE, set()),
        (replace(PRESSURE, radius=(50.0, 20.0)), {"Carlson 1995"}),
        (replace(PRESSURE, layers=(SOFT,)), {"Hamilton 2000"}),
        (replace(PRESSURE, layers=(SOFT, STIFF)), OF_STIFF),
        (replace(PRESSURE, layers=(Layer(210000.0, 0.3, 0.1),)), set()),  # of the substrate's own material
        (replace(PRESSURE, discretisation="aligned"), {"Wiener and Hopf 1931"}),  # edge of the contact
        (replace(PRESSURE, coupling="full", counterbody=None), set()),  # without tractions
        (ROLLING, OF_NEWTON),
        (replace(ROLLING, method="paper-cg"), {"Kalker 1990"}),
        (replace(ROLLING, discretisation="aligned"), OF_NEWTON | OF_ALIGNED),
        (replace(ROLLING, coupling="full"), OF_NEWTON),  # bodies alike: tractions do not act on the pressure
        (replace(ROLLING, coupling="full", counterbody=None), OF_NEWTON | OF_TURNS | {"Alart and Curnier 1991"}),
        # a stiff skin on a soft layer, both softer than the substrate
        (replace(PRESSURE, layers=(SOFT, replace(SOFT, E=70.0))), OF_STIFF),
        (
            replace(ROLLING, coupling="full", counterbody=None, layers=(STIFF,)),
            OF_NEWTON | OF_STIFF | OF_TURNS | {"Alart and Curnier 1991", "Rice 1968"},
        ),
        (
            replace(ROLLING, coupling="full", counterbody=None, discretisation="aligned"),
            OF_NEWTON | OF_ALIGNED | OF_TURNS | {"Alart and Curnier 1991"},
        ),
    ],
)
def test_publications_behind_a_scene(scene: Scene, added: set[str]) -> None:
    assert {one.name for one in behind([scene])} == OF_PRESSURE | added


def test_publications_behind_several_scenes_are_those_of_each_once_in_order() -> None:
    scenes = [ROLLING, PRESSURE, replace(PRESSURE, layers=(SOFT,)), ROLLING]
    found = behind(scenes)
    assert {one.name for one in found} == OF_PRESSURE | OF_NEWTON | {"Hamilton 2000"}
    assert list(found) == [one for one in PUBLICATIONS if one in found]
    assert behind([]) == ()


def test_names_end_with_the_year_of_the_reference() -> None:
    for one in PUBLICATIONS:
        assert f"({one.name.split()[-1]})" in one.reference


def test_results_name_them() -> None:
    scene = {
        "substrate": {"E": 210000, "nu": 0.3},
        "radius": 50,
        "load": 100,
        "mesh": {"size": [1, 1], "cells": [8, 8]},
    }
    assert rcstudy.solve(scene).attrs["references"] == listed(behind([replace(PRESSURE, counterbody=None)]))


def test_cubes_name_those_of_all_cases_and_their_summary_is_short(tmp_path: Path) -> None:
    study = load_text(
        tmp_path, BASE + "  g: {scene: {creepage: {longitudinal: 0.001}}, axes: {discretisation: [kalker, aligned]}}\n"
    )
    run(study, tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree:
        names = [text.partition(":")[0] for text in tree.attrs["references"].splitlines()]
        shown = " ".join(summary(tree).split())
        older = tree.copy()
    assert set(names) >= OF_PRESSURE | OF_NEWTON | OF_ALIGNED
    assert f"based on {'; '.join(names)} (in full: attribute references)" in shown
    del older.attrs["references"]
    assert "based on" not in summary(older)
