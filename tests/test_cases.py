"""From a study to cases: coordinates, hashes, order; and the plan."""

import dataclasses
import hashlib
import itertools
import json
import math
import pickle
import subprocess
import sys

import numpy as np
import pytest
from studies import BASE, CONFIGS, load_text

from rcstudy import cases as cases_module
from rcstudy import plan
from rcstudy.cases import case_key, expand, layer_set, normal_problem, scene_record
from rcstudy.mechanics.exact import contact_modulus, hertz_contact
from rcstudy.mechanics.normal import estimated_contact
from rcstudy.mechanics.scene import Creepage, Layer, Material, Mesh, Scene, Tolerance
from rcstudy.plan import (
    CASE_BYTES,
    CASE_FIELD_BYTES,
    CASE_SCALAR_BYTES,
    COUPLED_CELL_BYTES,
    EMPTY,
    FIELD_BYTES,
    FULL_COUPLING_FACTOR,
    GROUP_BYTES,
    LAYERS_CELL_SECONDS,
    LAYERS_SECONDS,
    PAPER_CG_FACTOR,
    PRESSURE_CELL_BYTES,
    PRESSURE_CELL_SECONDS,
    PRESSURE_SECONDS,
    PROCESS_BYTES,
    SCALAR_BYTES,
    TRACTION_CELL_BYTES,
    WINDOW_CELL_BYTES,
    contact_cells,
    estimate,
    plan_report,
)
from rcstudy.result import VARIABLES, Status
from rcstudy.solve import solve_group, solve_scene
from rcstudy.study import load_study, scene_from_mapping
from rcstudy.studyfile import build
from rcstudy.sweep import run


@pytest.fixture
def study(tmp_path):
    """Loads grids under the shared scene above."""

    return lambda text: load_text(tmp_path, BASE + text)


@pytest.fixture
def coords(study):
    """Coordinates of the first axis of a one-grid study: name -> (values, units)."""

    def of_axis(text, axis=0):
        (grid,) = expand(study(f"  g: {{{text}}}\n")).grids
        found = grid.axes[axis].coords
        assert next(iter(found)) == grid.axes[axis].name
        assert all(len(coord.values) == grid.axes[axis].size and coord.long_name for coord in found.values())
        return {name: (list(coord.values), coord.units) for name, coord in found.items()}

    return of_axis


A = (0.75 * 100 * 50 * (1 - 0.3**2) / 210000) ** (1 / 3)  # Hertz radius of the shared scene


# coordinates


def test_lengths_and_moduli_have_absolute_and_relative_coordinates(coords):
    text = "axes: {thickness: [0.25 a, 0.1], modulus: [0.5 Es, 420000]}"
    assert coords(text) == {
        "thickness": ([0.25 * A, 0.1], "mm"),
        "thickness_ratio": ([0.25, 0.1 / A], "1"),
    }
    assert coords(text, 1) == {"modulus": ([105000.0, 420000.0], "MPa"), "modulus_ratio": ([0.5, 2.0], "1")}


def test_relative_axis_is_its_own_coordinate_where_the_scale_varies(coords):
    text = "axes: {thickness: [0.5 a, 1 a], modulus: [2 Es], load: [100, 50], substrate.E: [1.0e5, 2.0e5]}"
    assert coords(text) == {"thickness": ([0.5, 1.0], "1")}
    assert coords(text, 1) == {"modulus": ([2.0], "1")}
    assert coords(text, 2) == {"load": ([100.0, 50.0], "N")}
    assert coords(text, 3) == {"E": ([1e5, 2e5], "MPa")}
    text = "axes: {thickness: [0.5, 1], load: [100, 50], modulus: [1 Es]}"
    assert coords(text) == {"thickness": ([0.5, 1.0], "mm")}
    text = "axes: {thickness: [0.5 a, 1], load: [100, 50], modulus: [1 Es]}"
    assert coords(text) == {"thickness": (["0.5 a", "1 mm"], "1")}


def test_creepage_has_a_coordinate_for_each_component(coords):
    assert coords("axes: {creepage: [{label: p, longitudinal: 0.1}, {lateral: 0.2, spin: 0.3}]}") == {
        "creepage": (["p", "b"], "1"),
        "longitudinal": ([0.1, 0.0], "1"),
        "lateral": ([0.0, 0.2], "1"),
        "spin": ([0.0, 0.3], "rad mm-1"),
    }


def test_pairs_are_labelled_with_a_coordinate_each_way(coords):
    assert coords("axes: {mesh.cells: [[8, 16], [4, 4]]}") == {
        "cells": (["8 x 16", "4 x 4"], "1"),
        "cells_x": ([8, 4], "1"),
        "cells_y": ([16, 4], "1"),
    }
    assert coords('axes: {mesh.size: [[2, 3], ["4 a", 2]]}') == {
        "size": (["2 x 3", "4 a x 2"], "1"),
        "size_x": ([2.0, 4 * A], "mm"),
        "size_x_ratio": ([2.0 / A, 4.0], "1"),
        "size_y": ([3.0, 2.0], "mm"),
        "size_y_ratio": ([3.0 / A, 2.0 / A], "1"),
    }
    assert coords("axes: {radius: [50, 60]}") == {"radius": ([50.0, 60.0], "mm")}
    assert coords("axes: {radius: [50, [50, 60]]}") == {
        "radius": (["50", "50 x 60"], "1"),
        "radius_x": ([50.0, 50.0], "mm"),
        "radius_y": ([50.0, 60.0], "mm"),
    }


def test_words_and_mappings(coords):
    assert coords("axes: {method: [newton, paper-cg]}") == {"method": (["newton", "paper-cg"], "1")}
    found = coords("axes: {counterbody: [rigid, {label: steel, E: 1 Es, nu: 0.3}]}")
    assert found.pop("counterbody") == (["rigid", "steel"], "1")
    for name, value in (("counterbody_E", 210000.0), ("counterbody_E_ratio", 1.0), ("counterbody_nu", 0.3)):
        (rigid, steel), _ = found.pop(name)
        assert math.isnan(rigid)
        assert steel == value
    assert found == {}
    assert coords("axes: {layers: [[], {label: one, layers: [{E: 1 Es, nu: 0.3, thickness: 1}]}]}") == {
        "layers": (["a", "one"], "1")
    }
    assert coords("cases: [{label: x}, {label: 0.50}]") == {"case": (["x", "0.50"], "1")}
    assert coords("coating: {thickness: 1, modulus: 1}, axes: {layer_count: [0, 2]}") == {"layer_count": ([0, 2], "1")}


def test_grids_keep_order_shape_and_labels(study):
    expansion = expand(
        study("  h: {axes: {load: [1, 2, 3], friction: [1, 2]}}\n  g: {description: d, cases: [{label: x}]}\n")
    )
    assert [(g.name, g.description, g.shape) for g in expansion.grids] == [("h", "", (3, 2)), ("g", "d", (1,))]
    assert expansion.grids[0].axes[1].labels == ("1", "2")


def test_coordinates_of_what_differs_in_a_list(coords):
    found = coords(
        "cases: [{label: one, load: 50}, {label: two, counterbody: rigid, radius: [10, 20], coupling: full}, "
        "{label: three, counterbody: {E: 2 Es, nu: 0.2}, substrate: {E: 1e5, nu: 0.3}, tolerance: {tangential: 1e-6}, "
        "mesh: {size: [2, 1], cells: [20, 10]}, spin_point: 0.25}]"
    )
    names = [
        "case",
        "substrate_E",
        "counterbody_E",
        "counterbody_nu",
        "radius_x",
        "radius_y",
        "mesh_size_x",
        "mesh_size_y",
        "mesh_cells_x",
        "mesh_cells_y",
        "coupling",
        "spin_point",
        "tolerance_tangential",
    ]
    assert list(found) == names
    assert found["substrate_E"] == ([210000.0, 210000.0, 1e5], "MPa")
    np.testing.assert_array_equal(found["counterbody_E"][0][1:], [math.nan, 2e5])
    assert found["counterbody_nu"][1] == "1"
    assert found["radius_x"] == ([50.0, 10.0, 50.0], "mm")
    assert found["radius_y"] == ([50.0, 20.0, 50.0], "mm")
    assert found["mesh_size_x"][0][2] == 2.0
    assert found["mesh_size_y"][0][2] == 1.0
    assert found["mesh_cells_x"][0][2] == 20
    assert found["mesh_cells_y"][0][2] == 10
    assert found["coupling"] == (["one-way", "full", "one-way"], "1")
    assert found["spin_point"][0][2] == 0.25
    assert found["tolerance_tangential"][0][2] == 1e-6
    assert coords("cases: [{label: one, radius: 10}, {label: two}]")["radius"] == ([10.0, 50.0], "mm")


# cases


def test_every_index_has_its_scene(study):
    plan = study("  g: {axes: {load: [100, 150], friction: [0.1, 0.2, 0.3], creepage.spin: [0, 0.01]}}\n")
    expansion = expand(plan)
    found = {case.index: case.scene for case in expansion.cases}
    assert len(expansion.cases) == len(found) == 12
    for (i, load), (j, friction), (k, spin) in itertools.product(
        enumerate((100, 150)), enumerate((0.1, 0.2, 0.3)), enumerate((0, 0.01))
    ):
        scene = found[i, j, k]
        assert (scene.load, scene.friction, scene.creepage) == (load, friction, Creepage(spin=spin))


def test_layers_of_a_coating_have_the_substrates_nu_unless_they_have_one(study):
    grid = "{{coating: {{thickness: 0.1, modulus: 2 Es{}}}, axes: {{substrate.nu: [0.2, 0.4]}}}}"
    plan = study(f"  g: {grid.format('')}\n  h: {grid.format(', layer_nu: 0.45')}\n")
    assert [case.scene.layers[0].nu for case in expand(plan).cases] == [0.2, 0.4, 0.45, 0.45]


def test_cases_of_one_normal_problem_are_adjacent_across_grids():
    expansion = expand(load_study(CONFIGS / "paper.yaml"))
    for of in (normal_problem, layer_set):
        runs = [key for key, _ in itertools.groupby(of(case.scene) for case in expansion.cases)]
        assert len(runs) == len(set(runs)) == 13
    groups = list(expansion.groups())
    assert [case for group in groups for case in group] == list(expansion.cases)
    assert len(groups) == 13
    assert {case.grid for case in groups[0]} == {"figure_3_bare", "figure_4"}
    sizes = {len({normal_problem(case.scene) for case in group}) for group in groups}
    assert sizes == {1}


SCENE = Scene(
    substrate=Material(210000.0, 0.3),
    radius=(50.0, 60.0),
    load=100.0,
    mesh=Mesh((2.0, 3.0), (8, 16)),
    creepage=Creepage(0.001, 0.002, 0.003),
)

CHANGES = {
    "substrate": Material(210000.0, 0.31),
    "radius": (50.0, 61.0),
    "load": np.nextafter(100.0, 101.0),
    "mesh": Mesh((2.0, 3.0), (8, 17)),
    "layers": (Layer(1.0, 0.0, 1.0),),
    "counterbody": Material(1.0, 0.0),
    "friction": 0.9,
    "creepage": None,
    "coupling": "full",
    "method": "paper-cg",
    "discretisation": "aligned",
    "spin_point": 0.25,
    "tolerance": Tolerance(1e-5, 2e-7),
}
FELT_BY_TRACTIONS_ONLY = {"friction", "creepage", "method", "spin_point", "tolerance"}


def test_changes_cover_every_field_of_a_scene():
    assert set(CHANGES) == {field.name for field in dataclasses.fields(Scene)}


@pytest.mark.parametrize("name", CHANGES)
def test_keys_follow_the_scene(name):
    changed = dataclasses.replace(SCENE, **{name: CHANGES[name]})
    assert case_key(changed) != case_key(SCENE)
    assert (normal_problem(changed) == normal_problem(SCENE)) == (name in FELT_BY_TRACTIONS_ONLY)


@pytest.mark.parametrize("name", sorted(set(CHANGES) - {"mesh"}))
def test_windows_are_fitted_to_the_scene(name, monkeypatch):
    """A new setting was dropped in silence; those that are without effect share a window."""
    seen = []
    monkeypatch.setattr(build, "_extents", lambda scene: seen.append(scene) or ((1.0, 1.0), (1.0, 1.0)))
    for scene in (SCENE, dataclasses.replace(SCENE, **{name: CHANGES[name]})):
        build.fitted_size(scene, 1.5, (32, 32))
    assert (seen[0] == seen[1]) == (name in FELT_BY_TRACTIONS_ONLY | {"discretisation"})


@pytest.mark.parametrize("name", sorted(FELT_BY_TRACTIONS_ONLY))
def test_full_coupling_makes_every_setting_part_of_the_normal_problem(name):
    full = dataclasses.replace(SCENE, coupling="full")
    changed = dataclasses.replace(full, **{name: CHANGES[name]})
    assert normal_problem(changed) != normal_problem(full)


@pytest.mark.parametrize("counterbody", [Material(100000.0, 0.2), Material(210000.0, 0.3)])
def test_full_coupling_of_bodies_that_do_not_feel_it_shares_a_pressure(counterbody):
    """Equal bodies, and scenes without creepage; unlike bodies have one for each creepage."""
    bare = dataclasses.replace(SCENE, layers=(), coupling="full", counterbody=counterbody)
    alike = counterbody == SCENE.substrate
    other = dataclasses.replace(bare, creepage=Creepage(0.002, 0.0, 0.0))
    assert (normal_problem(other) == normal_problem(bare)) == alike
    assert other.is_coupled is not alike
    still = dataclasses.replace(bare, creepage=None)
    assert normal_problem(dataclasses.replace(still, friction=0.2)) == normal_problem(still)
    if alike:
        one, two = solve_group([bare, other])
        (alone,) = solve_group([other])
        assert (one.status, two.scalars["force_x"]) == (Status.SOLVED, alone.scalars["force_x"])


def test_normal_tolerance_is_part_of_the_normal_problem():
    finer = dataclasses.replace(SCENE, tolerance=Tolerance(1e-6, 1e-7))
    assert normal_problem(finer) != normal_problem(SCENE)


def test_key_is_the_hash_of_a_text_that_stays_the_same(monkeypatch):
    """Keys name cases on the disk: it must not change with the library that writes it."""
    monkeypatch.setattr(cases_module, "SOLVER_VERSION", "1")
    monkeypatch.setattr(cases_module, "CASE_SCHEMA", 7)
    scene = Scene(
        Material(210000.0, 0.3),
        (50.0, 1234567.0),
        0.1 + 0.2,
        Mesh((2.0, 1e-300), (8, 16)),
        layers=(Layer(52500.0, 0.25, 1.0 / 3.0),),
        creepage=Creepage(2e-3, -0.0, 1e-7),
        tolerance=Tolerance(1e-6, 1e-12),
    )
    text = (
        '{"scene":{"substrate":{"E":210000.0,"nu":0.3},'
        '"layers":[{"E":52500.0,"nu":0.25,"thickness":0.3333333333333333}],"counterbody":"rigid",'
        '"radius":[50.0,1234567.0],"load":0.30000000000000004,"friction":1.0,'
        '"creepage":{"longitudinal":0.002,"lateral":-0.0,"spin":1e-7},'
        '"mesh":{"size":[2.0,1e-300],"cells":[8,16]},"coupling":"one-way","method":"newton",'
        '"discretisation":"kalker","spin_point":0.0,"tolerance":{"normal":1e-6,"tangential":1e-12}},'
        '"schema":7,"solver":"1"}'
    )
    assert case_key(scene) == hashlib.sha256(text.encode()).hexdigest()


def test_keys_tell_creepages_of_either_sign_apart():
    signs = itertools.product((0.01, -0.01), repeat=3)
    assert len({case_key(dataclasses.replace(SCENE, creepage=Creepage(*of))) for of in signs}) == 8


def test_key_follows_solver_and_schema_versions(monkeypatch):
    key = case_key(SCENE)
    monkeypatch.setattr(cases_module, "SOLVER_VERSION", cases_module.SOLVER_VERSION + "x")
    changed = case_key(SCENE)
    monkeypatch.setattr(cases_module, "CASE_SCHEMA", cases_module.CASE_SCHEMA + 1)
    assert len({key, changed, case_key(SCENE)}) == 3


def test_key_does_not_depend_on_how_a_number_is_written(study):
    one, other = (
        expand(study(f"  g: {{axes: {{load: [{text}], creepage.spin: [{zero}]}}}}\n")).cases[0]
        for text, zero in (("100", "0"), ("1.0e2", "-0.0"))
    )
    assert one.key == other.key
    assert len(one.key) == 64
    assert set(one.key) <= set("0123456789abcdef")


def test_record_of_a_scene_gives_the_scene_back():
    for case in expand(load_study(CONFIGS / "small.yaml")).cases:
        record = json.loads(json.dumps(scene_record(case.scene)))
        assert scene_from_mapping(record) == case.scene
    bare = dataclasses.replace(SCENE, counterbody=Material(1e5, 0.2), creepage=None)
    assert scene_from_mapping(scene_record(bare)) == bare


# plan


def test_plan_counts_and_names(study):
    plan = study(
        "  g: {description: words, axes: {load: [100, 150], friction: [0.1, 0.2, 0.3], creepage.spin: [0.01]}}\n"
        "  h: {cases: [{label: x}]}\n"
    )
    report = plan_report(plan)
    for words in (
        "7 cases in 2 grids",
        "grid g: words",
        "6 cases, 2 normal problems, 1 layer set",
        "100 N, 150 N",
        "1  0.01 rad/mm",
    ):
        assert words in report
    assert "pressure only, 32 x 32 cells" in report
    total = estimate(plan, expand(plan))
    assert (total.cases, total.distinct, total.normal_problems, total.layer_sets) == (7, 7, 2, 1)


def test_plan_leaves_out_what_a_value_has_not(study):
    """The modulus of a rigid counterbody, the size of a fitted window."""
    report = plan_report(
        study(
            "  g: {axes: {counterbody: [rigid, {label: steel, E: 210000, nu: 0.3}], mesh.size: [auto, [2, 2]]}}\n",
        )
    )
    assert "2  rigid, steel (counterbody_E 210000 MPa, counterbody_nu 0.3)" in report
    assert "2  auto, 2 x 2 (size_x 2 mm, size_y 2 mm)" in report
    assert "nan" not in report


def test_plan_gives_numbers_of_cells_once(study):
    report = plan_report(study("  g: {axes: {mesh.cells: [[16, 16], [32, 24]], friction: [1, 2]}}\n"))
    assert "  cells       2  16 x 16, 32 x 24\n  friction    2  1, 2\n" in report


@pytest.mark.parametrize(
    ("grid", "line"),
    [
        ("axes: {friction: [1, 2]}", "contact after Hertz: radius 0.2533 mm, largest pressure 744.2 MPa"),
        (
            "coating: {modulus: 2 Es}, axes: {load: [100, 800], thickness: [0.1]}",
            "contact after Hertz, without layers: radius 0.2533 to 0.5066 mm, largest pressure 744.2 to 1488 MPa",
        ),
        (
            "cases: [{label: a, radius: [50, 200]}, {label: b, radius: 50}]",
            "contact after Hertz: semi-axes 0.1967 to 0.2533 mm (x), 0.2533 to 0.492 mm (y), "
            "largest pressure 493.3 to 744.2 MPa",
        ),
        (
            "scene: {substrate: {E: 210}, mesh: {size: auto}}, axes: {friction: [1]}",
            "contact after Hertz: radius 2.533 mm, largest pressure 7.442 MPa",
        ),
    ],
)
def test_plan_gives_the_size_of_contacts(study, grid, line):
    """GPa for MPa, or m for mm, were seen in the results alone. (3 P R / 4 E*)^(1/3) = 0.2533 mm, 1.5 P / pi a^2."""
    assert f"cells {line} " in " ".join(plan_report(study(f"  g: {{{grid}}}\n")).split())


def test_plan_says_what_relative_values_are_over(study):
    """Where Es differs from case to case a multiple of it is all there is."""
    steel = "{label: steel, E: 2 Es, nu: 0.3}"
    report = plan_report(study(f"  g: {{axes: {{substrate.E: [2e5, 1e5], counterbody: [rigid, {steel}]}}}}\n"))
    assert "2  rigid, steel (counterbody_E 2 Es, counterbody_nu 0.3)" in report
    axes = "{load: [100, 50], thickness: [0.5 a, 1 a], modulus: [2 Es]}"
    assert "2  0.5 a, 1 a\n" in plan_report(study(f"  g: {{axes: {axes}}}\n"))
    axes = "{load: [100, 50], thickness: [0.5 a, 0.1], modulus: [2 Es]}"
    assert "2  0.5 a, 0.1 mm\n" in plan_report(study(f"  g: {{axes: {axes}}}\n"))  # the number was without its unit


def test_plan_gives_relative_and_absolute_values_of_one_axis(study):
    """They were left out, and the coordinate of what has no such value was `nan MPa`."""
    bodies = "[rigid, {label: steel, E: 210000, nu: 0.3}, {label: other, E: 2 Es, nu: 0.2}]"
    plan = study(
        f"  g: {{axes: {{substrate.E: [2e5, 1e5], counterbody: {bodies}}}}}\n"
        "  h: {axes: {load: [50, 100], mesh.size: [auto, [8 a, 8 a], [2, 2]]}}\n"
    )
    report = " ".join(plan_report(plan).split())
    steel = "steel (counterbody_E 210000 MPa, counterbody_nu 0.3), other (counterbody_E 2 Es, counterbody_nu 0.2)"
    assert f"counterbody 3 rigid, {steel}" in report
    assert "size 3 auto, 8 a x 8 a, 2 x 2 (size_x 2 mm, size_y 2 mm)" in report
    of_bodies, of_windows = (grid.axes[1].coords for grid in expand(plan).grids)
    assert of_bodies["counterbody_E"].values == ["", "210000 MPa", "2 Es"]
    assert of_windows["size_x"].values == of_windows["size_y"].values == ["", "8 a", "2 mm"]


def test_plan_says_whose_modulus_an_axis_is(study):
    """Both were `E`."""
    other = "{counterbody: {E: 1e5, nu: 0.3}}"
    axes = [f"{{axes: {{{body}.E: [2e5, 1e5]}}, scene: {other}}}" for body in ("substrate", "counterbody")]
    report = plan_report(study(f"  g: {axes[0]}\n  h: {axes[1]}\n"))
    assert "  substrate E    2  200000 MPa" in report and "  counterbody E    2  200000 MPa" in report


def test_plan_counts_the_time_of_equal_cases_once(study):
    """As the sweep solves them."""
    axes = "{axes: {creepage.spin: [0.001, 0.002, 0.003]}}"
    one, three = (study("".join(f"  g{k}: {axes}\n" for k in range(n))) for n in (1, 3))
    assert estimate(three, expand(three)).distinct == estimate(one, expand(one)).distinct == 3
    assert estimate(three, expand(three)).seconds == pytest.approx(estimate(one, expand(one)).seconds)


def test_plan_and_sweep_say_when_memory_may_not_do(study, monkeypatch):
    """Of 43 GB on a machine of 23 GB nothing was said."""
    large = study("  g: {axes: {mesh.cells: [[64, 64], [1024, 512]]}}\n")
    expansion = expand(large)
    needed = estimate(large, expansion).worker_bytes
    for memory, workers, said in ((needed, 1, False), (0.99 * needed, 1, True), (2.0 * needed, 2, False)):
        monkeypatch.setattr(plan, "available_memory", lambda memory=memory: memory)
        assert bool(plan.lack_of_memory(expansion.cases, workers)) is said
    monkeypatch.setattr(plan, "available_memory", lambda: 1.9 * needed)
    assert "for each of 2 workers, and there are" in plan.lack_of_memory(expansion.cases, 2)
    assert "the largest cases need" not in plan_report(large)
    monkeypatch.setattr(plan, "available_memory", lambda: 3e8)
    words = " ".join(plan_report(large).split())
    assert "the largest cases need about" in words and "of memory, and there are 300 MB" in words


def test_plan_breaks_no_line_within_a_word(study):
    meshes = [f"{{label: {'wide ' * 12}{k}, size: [{3 + k}.25 a, 9.125 a], cells: [32, 30]}}" for k in range(2)]
    report = plan_report(study(f"  g: {{axes: {{mesh: [{', '.join(meshes)}]}}}}\n"))
    lines = report.splitlines()
    assert max(map(len, lines)) <= 130
    words = {word.strip("(),") for line in lines for word in line.split()}
    assert {"mesh_size_x", "mesh_size_y", "mesh_cells_x", "mesh_cells_y"} <= words


def test_plan_of_the_paper_lists_every_grid_and_value():
    study = load_study(CONFIGS / "paper.yaml")
    report = plan_report(study)
    assert all(f"grid {grid.name}: {grid.description}" in report for grid in study.grids)
    assert "0.25 a (0.0633225 mm), 0.5 a (0.126645 mm), 1 a (0.25329 mm)" in report
    assert "c (longitudinal 0.002, spin 0.005 rad/mm)" in report
    assert max(map(len, report.splitlines())) <= 130


def test_estimated_size_is_that_of_the_fields(study):
    def bytes_of(outputs):
        plan = study("  g: {axes: {friction: [1, 2], creepage.spin: [0.01]}}\n  h: {axes: {friction: [1]}}\n" + outputs)
        expansion = expand(plan)
        total = estimate(plan, expansion)
        filled = contact_cells(expansion.cases[0].scene) / 32**2 * total.field_bytes
        with_fields = total.field_bytes > 0
        besides = 0.0
        for cases, tangential in ((2, True), (1, False)):
            stored = [v.kind == "field" for v in VARIABLES.values() if tangential or not v.tangential]
            fields, scalars = with_fields * stored.count(True), stored.count(False)
            besides += GROUP_BYTES + scalars * SCALAR_BYTES + fields * FIELD_BYTES
            besides += cases * (CASE_BYTES + scalars * CASE_SCALAR_BYTES + fields * CASE_FIELD_BYTES)
        assert total.file_bytes == pytest.approx(filled + EMPTY * total.field_bytes + besides)
        return total.field_bytes

    cells = 32 * 32
    assert bytes_of("") == 2 * cells * (5 * 8 + 1) + cells * 8
    assert bytes_of("outputs: {precision: float32}\n") == 2 * cells * (5 * 4 + 1) + cells * 4
    assert bytes_of("outputs: {fields: false}\n") == 0


def test_estimated_size_of_a_grid_has_tractions_if_any_case_has(study):
    plan = study("  g: {cases: [{label: still}, {label: rolls, creepage: {spin: 0.01}}]}\n")
    assert estimate(plan, expand(plan)).field_bytes == 2 * (32 * 32) * (5 * 8 + 1)


def test_estimated_size_of_padded_fields_is_that_of_the_largest_mesh_along_each_axis(study):
    plan = study("  g: {axes: {mesh.cells: [[16, 64], [32, 32]]}}\n")
    assert estimate(plan, expand(plan)).field_bytes == 2 * (32 * 64) * 8


def test_estimated_size_of_cropped_fields_is_that_of_a_box_around_the_contacts(study):
    """That of the whole window was given, and of a wide one ten times the size of the cube."""
    plan = study(
        "  g: {scene: {mesh: {size: [20, 20], cells: [512, 512]}}, axes: {load: [50, 100], creepage.spin: [0.01]}}\n"
        "outputs: {crop: contact}\n"
    )
    expansion = expand(plan)
    most = max(contact_cells(case.scene) for case in expansion.cases)
    assert estimate(plan, expansion).field_bytes == pytest.approx(2 * (4 / math.pi) * most * (5 * 8 + 1))


@pytest.mark.heavy
@pytest.mark.parametrize("outputs", ["{}", "{precision: float32}", "{crop: contact}"])
@pytest.mark.parametrize("size", ["[2, 2]", "[1, 0.8]", "auto"])
def test_estimated_size_is_that_of_the_cube(study, tmp_path, size, outputs):
    """Whether the contact fills 3 % of the window or half of it, with and without layers."""
    plan = study(
        f"  g: {{scene: {{mesh: {{size: {size}, cells: [64, 64]}}, creepage: {{longitudinal: 0.001}}}},\n"
        "      axes: {layers: [[], [{E: 4 Es, nu: 0.3, thickness: 0.5 a}], [{E: 0.25 Es, nu: 0.3, thickness: 1 a}]],\n"
        f"      creepage.spin: [0, 0.01, 0.02, 0.04]}}}}\noutputs: {outputs}\n"
    )
    cube = tmp_path / "cube.nc"
    assert run(plan, cube, workers=1).failed == 0
    found = estimate(plan, expand(plan)).file_bytes / cube.stat().st_size
    assert 0.6 < found < 1.7


@pytest.mark.heavy
@pytest.mark.parametrize("creepage", ["none", "{longitudinal: 0.001}"])
@pytest.mark.parametrize("outputs", ["{fields: false}", "{}"])
@pytest.mark.parametrize("grids", [1, 6])
def test_estimated_size_is_that_of_cubes_of_few_cases(study, tmp_path, grids, outputs, creepage):
    """Of pressures alone, without fields, it was three to four times that of the cube."""
    each = f"{{scene: {{mesh: {{cells: [16, 16]}}, creepage: {creepage}}}, axes: {{load: [50, 100]}}}}"
    plan = study("".join(f"  g{k}: {each}\n" for k in range(grids)) + f"outputs: {outputs}\n")
    cube = tmp_path / "cube.nc"
    assert run(plan, cube, workers=1).failed == 0
    assert 0.7 < estimate(plan, expand(plan)).file_bytes / cube.stat().st_size < 1.4


@pytest.mark.heavy
def test_estimated_contact_is_that_of_the_pressure(study):
    plan = study(
        "  g: {scene: {mesh: {size: [3, 3], cells: [96, 96]}}, coating: {layer_nu: 0.3}, axes: {layer_count: [1, 3],\n"
        "    thickness: [0.1 a, 0.5 a, 1 a], modulus: [0.5 Es, 1 Es, 2 Es],\n"
        "    counterbody: [rigid, {E: 210000, nu: 0.3}], radius: [50, [30, 80]]}}\n"
    )
    for case in expand(plan).cases:
        cells = np.count_nonzero(solve_scene(case.scene).fields["pressure"])
        assert 0.7 < contact_cells(case.scene) / cells < 1.6, case


@pytest.mark.parametrize("counterbody", [None, Material(70000.0, 0.33)])
@pytest.mark.parametrize("radius", [(5.0, 5.0), (50.0, 900.0)])
def test_estimated_contact_of_bodies_without_layers_is_hertzs(counterbody, radius):
    scene = dataclasses.replace(SCENE, layers=(), counterbody=counterbody, radius=radius)
    hertz = hertz_contact(radius, scene.load, contact_modulus(scene.substrate, counterbody))
    assert estimated_contact(scene) == pytest.approx(hertz.a, rel=1e-12)


@pytest.mark.parametrize("modulus", [5.0, 2e6])
def test_estimated_contact_of_bodies_a_thousand_times_as_large(modulus):
    scene = dataclasses.replace(SCENE, layers=(Layer(modulus, 0.3, 0.01),))
    large = dataclasses.replace(
        scene, radius=tuple(1e3 * r for r in scene.radius), load=1e6 * scene.load, layers=(Layer(modulus, 0.3, 10.0),)
    )
    assert estimated_contact(large) == pytest.approx([1e3 * a for a in estimated_contact(scene)], rel=1e-9)


@pytest.mark.parametrize("thickness", [1e-9, 0.1, 1e9])
@pytest.mark.parametrize("modulus", [1e-150, 1e-9, 3.7e21, 1e150])
@pytest.mark.parametrize("count", [1, 5])
def test_estimated_contact_of_extreme_layers_is_a_number_of_cells(thickness, modulus, count):
    scene = dataclasses.replace(SCENE, layers=(Layer(modulus, 0.3, thickness),) * count)
    assert 0 <= contact_cells(scene) <= math.prod(scene.mesh.cells)


def test_estimated_time_grows_with_cells_in_contact_and_method(study):
    def seconds(scene, friction="1"):
        plan = study(f"  g: {{scene: {{{scene}}}, axes: {{friction: [{friction}]}}}}\n")
        return estimate(plan, expand(plan)).seconds

    pressure = seconds("")
    newton = seconds("creepage: {spin: 0.1}")
    assert 0 < pressure < newton
    assert seconds("creepage: {spin: 0.1}", "1, 2, 3") - pressure == pytest.approx(3 * (newton - pressure))
    assert seconds("creepage: {spin: 0.1}, method: paper-cg") - pressure == pytest.approx(
        PAPER_CG_FACTOR * (newton - pressure)
    )
    assert seconds("creepage: {spin: 0.1}, coupling: full") - pressure == pytest.approx(
        FULL_COUPLING_FACTOR * (newton - pressure)
    )
    assert seconds("mesh: {size: [4, 4], cells: [64, 64]}") == pytest.approx(pressure)
    assert seconds("mesh: {cells: [64, 64]}") - PRESSURE_SECONDS == pytest.approx(4 * (pressure - PRESSURE_SECONDS))
    # more than 30 000 cells in contact on both: 4 times as many take 4^0.4 times as long each
    many, more = (seconds(f"mesh: {{size: auto, cells: [{n}, {n}]}}") - PRESSURE_SECONDS for n in (1024, 2048))
    assert more / many == pytest.approx(4.0**1.4)


def test_estimated_seconds_count_each_set_of_layers_once(study):
    """They were left out, which take longer than the pressure under them."""
    stacks = (
        "[{E: 2 Es, nu: 0.3, thickness: 0.1}], [{E: 2 Es, nu: 0.3, thickness: 0.2}], [{E: 1 Es, nu: 0.3, thickness: 1}]"
    )
    plan = study(f"  g: {{axes: {{load: [50, 100], layers: [{stacks}]}}}}\n")
    cells = [contact_cells(case.scene) for case in expand(plan).cases]
    bare = sum(PRESSURE_SECONDS + PRESSURE_CELL_SECONDS * count for count in cells)
    layers = estimate(plan, expand(plan)).seconds - bare
    # the last is none; the contact of either load may be the one that counts
    assert layers == pytest.approx(2 * LAYERS_SECONDS + LAYERS_CELL_SECONDS * sum(cells[:2]), rel=0.01)


def test_estimated_memory_grows_with_cells_in_contact_coupling_and_window(study):
    def held(scene):
        plan = study(f"  g: {{scene: {{{scene}}}, axes: {{friction: [1, 2]}}}}\n")
        return estimate(plan, expand(plan)).worker_bytes - PROCESS_BYTES

    scene = expand(study("  g: {axes: {friction: [1, 2]}}\n")).cases[0].scene
    cells, (nx, ny) = contact_cells(scene), scene.mesh.cells
    pressure = held("")
    assert pressure == pytest.approx(PRESSURE_CELL_BYTES * cells + WINDOW_CELL_BYTES * nx * ny)
    assert held("creepage: {spin: 0.1}") - pressure == pytest.approx(TRACTION_CELL_BYTES * cells)
    coupled = held("creepage: {spin: 0.1}, coupling: full")
    assert coupled - pressure == pytest.approx(COUPLED_CELL_BYTES * cells)
    # a window four times as large with as many cells in contact
    wide = held("mesh: {size: [4, 4], cells: [64, 64]}")
    assert wide - pressure == pytest.approx(WINDOW_CELL_BYTES * (64 * 64 - nx * ny))


@pytest.mark.heavy
@pytest.mark.parametrize("coupling", ["one-way", "full"])
def test_estimated_memory_is_about_what_a_worker_takes(study, coupling):
    """Within a factor of 2, the largest of a process that solves one case on 256 cells along a side."""
    plan = study(
        f"  g: {{scene: {{creepage: {{spin: 0.01, lateral: 0.001}}, coupling: {coupling}, "
        "mesh: {size: auto, cells: [256, 256]}}, axes: {friction: [0.3]}}\n"
    )
    scene = expand(plan).cases[0].scene
    code = (
        "import pickle, sys\nfrom pathlib import Path\nfrom rcstudy.solve import solve_scene\n"
        "assert solve_scene(pickle.loads(sys.stdin.buffer.read())).status == 0\n"
        # not that of getrusage, which a process takes over from the one that starts it
        "print(Path('/proc/self/status').read_text().partition('VmHWM:')[2].split()[0])"
    )
    done = subprocess.run([sys.executable, "-c", code], input=pickle.dumps(scene), capture_output=True, check=True)
    estimated = estimate(plan, expand(plan)).worker_bytes
    assert estimated / 2.0 < 1024.0 * float(done.stdout) < 2.0 * estimated


def test_long_axes_are_shortened(study):
    report = plan_report(study(f"  g: {{axes: {{friction: {list(range(1, 101))}}}}}\n"))
    assert "1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, ..., 100" in report


def test_a_label_longer_than_a_line_is_not_broken(study):
    long = "x" * 100
    report = plan_report(study(f"  g: {{cases: [{{label: short}}, {{label: {long}}}, {{label: last}}]}}\n"))
    assert f" {long}," in report


def test_plan_says_what_layers_are(study):
    text = (
        "  g: {axes: {layers: [[{E: 1 Es, nu: 0.3, thickness: 0.02}], "
        "{label: graded, layers: [{E: 1e5, nu: 0.3, thickness: 0.1}, {E: 2e5, nu: 0.2, thickness: 0.2}, "
        "{E: 3e5, nu: 0.2, thickness: 0.3}, {E: 4e5, nu: 0.2, thickness: 0.3}]}, {label: none, layers: []}], "
        "load: [50, 100]}}\n"
    )
    words = " ".join(plan_report(study(text)).split())
    assert "layers 3 a (0.02 mm of 210000 MPa), graded (0.1 mm of 100000 MPa, 0.2 mm of 200000 MPa, " in words
    assert "0.3 mm of 300000 MPa, 1 more), none (no layers) load 2 50 N, 100 N" in words
    relative = text.replace("thickness: 0.02", "thickness: 0.5 a")  # and a depends on the load
    assert "layers 3 a, graded (0.1 mm" in " ".join(plan_report(study(relative)).split())


def test_plan_indents_what_goes_on_in_the_next_line(tmp_path):
    loads = [1000 + k for k in range(40)]
    grid = f"  g: {{axes: {{load: {loads}, radius: [[50.5, 80.25], [60.75, 90.125]]}}}}\n"
    lines = plan_report(load_text(tmp_path, BASE + grid)).splitlines()
    begin = lines.index("grid g")
    first, second, radius, other, cases, contact, more, empty = lines[begin + 1 : begin + 9]
    column = first.index("1000")
    assert radius.startswith("  radius") and cases.startswith("  80 cases")
    assert all(line[:column].isspace() and line[column].isdigit() for line in (second, other))
    assert contact.startswith("  contact after Hertz") and more.startswith("    ") and not empty


def test_memory_is_that_of_the_largest_of_the_cases_that_share_a_pressure(study):
    still, rolls = "{scene: {creepage: none}, axes: {friction: [0.3]}}", "{axes: {creepage.spin: [0.001]}}"
    both, one = (study(text) for text in (f"  g: {still}\n  h: {rolls}\n", f"  h: {rolls}\n"))
    assert estimate(both, expand(both)).normal_problems == 1
    assert estimate(both, expand(both)).worker_bytes == estimate(one, expand(one)).worker_bytes
