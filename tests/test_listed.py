"""Columns of the table of results for settings in which cases differ, and for numbers of axes."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from studies import BASE, load_text
from workers import made_up

from rcstudy.cube import open_cube
from rcstudy.report.listed import listed_settings
from rcstudy.report.views import GridView, grids
from rcstudy.sweep import run
from rcstudy.tables import make_tables

SCENE = BASE.removesuffix("grids:\n")
CREEPAGES = ["longitudinal", "lateral", "spin_rad_per_mm"]
PAIRS = (("radius", "_mm"), ("window", "_mm"), ("cells", ""))


def columns_of(folder: Path, text: str) -> dict[str, list[str]]:
    """Columns of results.csv of the study of this text, from the names of cases to the last before `status`."""
    run(load_text(folder, text), folder / "s.nc", workers=1, solve=made_up)
    with open_cube(folder / "s.nc") as tree:
        make_tables(tree, folder)
    with (folder / "results.csv").open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    return {head[k]: [row[k] for row in rows] for k in range(1, head.index("status"))}


def titles(folder: Path) -> str:
    return (folder / "results.md").read_text(encoding="utf-8").splitlines()[2]


def test_settings_that_differ_between_grids_have_columns(tmp_path: Path) -> None:
    """Neither load nor radius was in any table, as no grid is a list of cases in which they differ."""
    text = f"""{SCENE}
grids:
  a:
    scene: {{radius: 20}}
    axes: {{friction: [0.2, 0.4], creepage.longitudinal: [0.001]}}
  b:
    scene: {{load: 500, creepage: {{longitudinal: 0.001}}}}
    axes: {{spin_point: [0, 0.1]}}
"""
    found = columns_of(tmp_path, text)
    names = ["load_N", "friction", "radius_mm", "spin_point_cells"]
    assert list(found) == ["case", *names, "layers", "creepage", *CREEPAGES]
    assert [found[name] for name in names] == [
        ["100", "100", "500", "500"],
        ["0.2", "0.4", "1", "1"],
        ["20", "20", "50", "50"],
        ["0", "0", "0", "0.1"],
    ]
    shown = "| Grid | Case | Load (N) | Friction | Radius (mm) | Spin point (cells) | Layers | Creepage | Status |"
    assert titles(tmp_path).startswith(shown)
    latex = (tmp_path / "results.tex").read_text(encoding="utf-8")
    assert r"\rotatebox{90}{Radius (mm)} & \rotatebox{90}{Spin point (cells)} & \rotatebox{90}{Layers}" in latex


def test_numbers_of_axes_are_in_the_csv_alone(tmp_path: Path) -> None:
    """They were in words alone. Over a that differs from case to case, a thickness has no coordinate in mm.

    Every case with layers has the numbers, also one of a grid that varies others.
    """
    text = f"""{SCENE}
grids:
  coated:
    coating: {{layer_count: 1}}
    axes: {{thickness: [0.5 a, 0.3], modulus: [2 Es, 3000], layer_nu: [0.4], load: [100, 800]}}
  stacks:
    coating: {{thickness: 0.1, modulus: 3000}}
    axes: {{layer_count: [0, 2], layer_nu: [0.25]}}
  rolling: {{axes: {{creepage: [{{label: curve, lateral: -0.001, spin: 0.25}}]}}}}
"""
    found = columns_of(tmp_path, text)
    names = [*CREEPAGES, "layer_count", "thickness_mm", "modulus_MPa", "layer_nu"]
    assert list(found) == ["case", "load_N", "layers", "creepage", *names]
    assert found["load_N"] == ["100", "800"] * 4 + ["100"] * 3
    # a = (3 P R / 4 E*)^(1/3) = (3 x 100 x 50 x 0.91 / (4 x 210000))^(1/3) mm, and twice that under 800 N
    a = (3 * 100 * 50 * 0.91 / (4 * 210000)) ** (1 / 3)
    thickness = [float(text or "nan") for text in found["thickness_mm"]]
    assert thickness[:8] == pytest.approx([a / 2, a] * 2 + [0.3] * 4, rel=1e-11)
    assert found["thickness_mm"][8:] == ["", "0.1", ""]
    assert found["modulus_MPa"] == ["420000", "420000", "3000", "3000"] * 2 + ["", "3000", ""]
    assert found["layer_nu"] == ["0.4"] * 8 + ["", "0.25", ""]  # nor has a case without layers any
    assert found["layer_count"] == ["1"] * 8 + ["0", "2", "0"]
    assert [found[name] for name in CREEPAGES] == [[""] * 10 + [text] for text in ("0", "-0.001", "0.25")]
    assert found["layers"][0] == "E1 = 2 Es, nu = 0.4, 0.5 a"
    assert "| Load (N) | Layers | Creepage | Status |" in titles(tmp_path)


def test_layers_that_lists_of_cases_and_axes_give_whole_have_numbers(tmp_path: Path) -> None:
    """They were in words alone."""
    text = f"""{SCENE}
grids:
  listed:
    cases:
      - {{label: bare}}
      - {{label: film, layers: [{{E: 300000, nu: 0.3, thickness: 0.01}}]}}
      - {{label: two, coating: {{layer_count: 2, thickness: 0.1, modulus: 3000}}, load: 200}}
  sets: {{axes: {{layers: [{{label: x, layers: [{{E: 1000, nu: 0.2, thickness: 0.02}}]}}, []]}}}}
  same: {{axes: {{layers: [{{label: x, layers: [{{E: 1000, nu: 0.2, thickness: 0.02}}]}}]}}}}
  loads: {{cases: [{{label: a}}, {{label: b, load: 300}}]}}
"""
    found = columns_of(tmp_path, text)
    assert list(found)[-4:] == ["layer_count", "thickness_mm", "modulus_MPa", "layer_nu"]
    assert found["layer_count"] == ["0", "1", "2", "1", "0", "1", "0", "0"]
    assert found["thickness_mm"] == ["", "0.01", "0.1", "0.02", "", "0.02", "", ""]
    assert found["modulus_MPa"] == ["", "300000", "3000", "1000", "", "1000", "", ""]
    assert found["layer_nu"] == ["", "0.3", "0.3", "0.2", "", "0.2", "", ""]


def test_layers_that_differ_between_grids_have_numbers(tmp_path: Path) -> None:
    """Two grids of other coatings were told apart by words alone."""
    text = f"""{SCENE}
grids:
  thin: {{coating: {{thickness: 0.01, modulus: 1000, layer_nu: 0.2}}, axes: {{load: [100, 200]}}}}
  thick: {{coating: {{thickness: 0.05, modulus: 1000, layer_nu: 0.4}}, axes: {{load: [100]}}}}
"""
    found = columns_of(tmp_path, text)
    assert list(found)[-2:] == ["thickness_mm", "layer_nu"]
    assert found["thickness_mm"] == ["0.01", "0.01", "0.05"]
    assert found["layer_nu"] == ["0.2", "0.2", "0.4"]


def test_the_caption_has_what_all_cases_share(tmp_path: Path) -> None:
    """Neither bodies nor discretisation were in any table of results."""
    text = f"""{SCENE}
grids:
  a: {{scene: {{discretisation: aligned, spin_point: 1/6}}, axes: {{load: [100, 200]}}}}
  b: {{scene: {{counterbody: {{E: 1 Es, nu: 0.3}}, spin_point: 1/6}}, axes: {{load: [300]}}}}
"""
    columns_of(tmp_path, text)
    caption = (tmp_path / "results.md").read_text(encoding="utf-8").splitlines()[0]
    shared = caption[caption.index("In all cases") :].partition(". p0")[0]
    assert shared.startswith(
        "In all cases: friction 1, radius 50 mm, substrate E 210000 MPa, substrate nu 0.3, window "
    )
    assert shared.endswith(
        ", coupling one-way, method newton, spin point 0.166666666667 cells, tolerance of the pressure 1e-05, "
        "tolerance of the tractions 1e-07"
    )


def test_pairs_have_their_numbers_along_x_and_y(tmp_path: Path) -> None:
    """Radii of ellipses, windows and cells were in words alone."""
    text = f"""{SCENE}
grids:
  ellipses: {{axes: {{radius: [40, [30, 50.5]]}}}}
  windows:
    cases:
      - {{label: given, mesh: {{size: [2, 3], cells: [32, 48]}}}}
      - {{label: over a, mesh: {{size: [4 a, 5 a], cells: [48, 48]}}}}
      - {{label: fitted, mesh: {{size: auto, cells: [32, 32]}}}}
"""
    found = columns_of(tmp_path, text)
    pairs = [f"{name}_{direction}{unit}" for name, unit in PAIRS for direction in "xy"]
    assert list(found)[1:] == ["radius_mm", "window_mm", "cells", "layers", "creepage", *CREEPAGES, *pairs]
    assert found["radius_mm"] == ["40", "30 x 50.5", "50", "50", "50"]
    assert (found["radius_x_mm"], found["radius_y_mm"]) == (
        ["40", "30", "50", "50", "50"],
        ["40", "50.5", "50", "50", "50"],
    )
    assert (found["window_x_mm"], found["window_y_mm"]) == (["2", "2", "2", "", ""], ["2", "2", "3", "", ""])
    assert (found["cells_x"], found["cells_y"]) == (["32", "32", "32", "48", "32"], ["32", "32", "48", "48", "32"])
    assert "| Radius (mm) | Window (mm) | Cells | Layers |" in titles(tmp_path)


def test_an_axis_of_one_number_is_in_the_csv_alone(tmp_path: Path) -> None:
    text = f"{SCENE}grids: {{g: {{axes: {{load: [70], radius: [12.5], coupling: [full], friction: [0.1, 0.2]}}}}}}\n"
    found = columns_of(tmp_path, text)
    assert list(found) == ["case", "load_N", "friction", "radius_mm", "layers", "creepage", *CREEPAGES]
    assert (found["load_N"], found["radius_mm"]) == (["70", "70"], ["12.5", "12.5"])
    assert "| Case | Friction | Layers |" in titles(tmp_path)


def test_moduli_over_es_and_margins_are_those_of_each_case(tmp_path: Path) -> None:
    """They were those of the scene that the grid starts from."""
    text = f"""{SCENE}
grids:
  product:
    scene: {{counterbody: {{E: 2 Es, nu: 0.3}}, mesh: {{size: auto}}}}
    axes: {{substrate.E: [1000, 3000], mesh.margin: [1.5, 2]}}
  meshes:
    axes:
      mesh: [{{label: wide, size: auto, margin: 3, cells: [32, 32]}}, {{label: given, size: [4, 4], cells: [32, 32]}}]
      counterbody.E: [0.5 Es]
    scene: {{counterbody: {{nu: 0.3}}}}
  listed:
    scene: {{counterbody: {{E: 2 Es, nu: 0.3}}}}
    cases:
      - {{label: as it is}}
      - {{label: soft, substrate: {{E: 30000}}}}
"""
    found = columns_of(tmp_path, text)
    assert found["substrate_E_MPa"] == ["1000", "1000", "3000", "3000", "210000", "210000", "210000", "30000"]
    assert found["counterbody_E_MPa"] == ["2000", "2000", "6000", "6000", "105000", "105000", "420000", "60000"]
    fitted = [f"auto, margin {margin}" for margin in ("1.5", "2", "1.5", "2", "3")]
    assert found["window_mm"] == [*fitted, "4 x 4", "2 x 2", "2 x 2"]
    assert found["margin"] == ["1.5", "2", "1.5", "2", "", "", "", ""]
    assert "Margin" not in titles(tmp_path)


def test_settings_of_a_study_that_is_not_understood_are_left_out(tmp_path: Path) -> None:
    text = f"{SCENE}grids: {{g: {{axes: {{load: [50, 100], radius: [20, 30]}}}}}}\n"
    columns_of(tmp_path, text)
    with open_cube(tmp_path / "s.nc") as tree:
        (grid,) = grids(tree).values()
        known = listed_settings(list(grid.cases()))
        unknown = listed_settings(list(GridView("g", grid.dataset, "grids: [").cases()))
    assert [column.key for column in known[0]] == ["load_N", "radius_mm"]
    assert [column.key for column in unknown[0]] == ["load_N"]
    assert unknown[1] == [{"load_N": load, "friction": 1.0} for load in (50.0, 50.0, 100.0, 100.0)]
