"""Every axis that a grid may have, down to the cube: values, labels and coordinates."""

from __future__ import annotations

from pathlib import Path

import pytest
import workers
from studies import BASE, load_text, refusal

from rcstudy import sweep
from rcstudy.cases import expand
from rcstudy.cube import case_table, open_cube
from rcstudy.studyfile.grids import AXIS_PATHS

COATING = "    coating: {thickness: 0.1, modulus: 2 Es}\n"
VALUES = {
    "layer_count": ["[0, 1, 2]"],
    "thickness": ["[0.1, 0.5 a, a]", "[0.5 a, a]"],
    "modulus": ["[1000, 2 Es]", "[2 Es, 0.5 Es]"],
    "layer_nu": ["[0.2, 0.4]"],
    "substrate": ["[{E: 210000, nu: 0.3}, {label: soft, E: 100000, nu: 0.4}]"],
    "substrate.E": ["[100000, 210000]"],
    "substrate.nu": ["[0.2, 0.3]"],
    "layers": [
        "[{label: none, layers: []}, {label: one, layers: [{E: 2 Es, nu: 0.3, thickness: 0.1}]}]",
        "[[], [{E: 2 Es, nu: 0.3, thickness: 0.1}]]",
    ],
    "counterbody": ["[rigid, {label: steel, E: 210000, nu: 0.3}]", "[{E: 2 Es, nu: 0.3}, rigid]", "[rigid]"],
    "counterbody.E": ["[100000, Es]"],
    "counterbody.nu": ["[0.2, 0.3]"],
    "radius": ["[30, 50]", "[50, [30, 60]]", "[[30, 60], [60, 30]]"],
    "load": ["[50, 100]"],
    "friction": ["[0.1, 1]"],
    "creepage": ["[{label: a, longitudinal: 0.001}, {label: b, spin: 0.01}]"],
    "creepage.longitudinal": ["[0.001, 0.002]"],
    "creepage.lateral": ["[0.001, 0.002]"],
    "creepage.spin": ["[-0.01, 0.01]"],
    "mesh": [
        "[{label: fine, size: [2, 2], cells: [8, 8]}, {label: close, size: auto, cells: [8, 6], margin: 1.5}]",
        "[{size: auto, cells: [8, 8]}, {size: [4 a, 8 a], cells: [8, 8]}]",
        "[{size: auto, cells: [8, 8]}, {size: auto, cells: [6, 6]}]",
    ],
    "mesh.size": ["[auto, [2, 2]]", "[[2, 2], auto]", "[auto]", "[[2, 2], [8 a, 2]]"],
    "mesh.cells": ["[[8, 8], [6, 8]]"],
    "mesh.margin": ["[1.2, 1.5]"],
    "coupling": ["[one-way, full]"],
    "method": ["[newton, paper-cg]"],
    "discretisation": ["[kalker, aligned]"],
    "spin_point": ["[0, 0.25]", "[0, 1/6, 1/3]"],
    "tolerance": ["[{label: loose, normal: 1e-3}, {tangential: 1e-5}]"],
    "tolerance.normal": ["[1e-3, 1e-4]"],
    "tolerance.tangential": ["[1e-3, 1e-4]"],
}


def study(path: str, values: str) -> str:
    """A study of one grid with this axis."""
    coating = COATING if path in ("layer_count", "thickness", "modulus", "layer_nu") else ""
    body = "  counterbody: {E: 210000, nu: 0.3}\n" if path.startswith("counterbody.") else ""
    return (
        "study: s\nscene:\n  substrate: {E: 210000, nu: 0.3}\n  radius: 50\n  load: 100\n"
        f"  mesh: {{size: {'auto' if path == 'mesh.margin' else '[2, 2]'}, cells: [8, 8]}}\n{body}"
        f"grids:\n  g:\n{coating}    axes:\n      {path}: {values}\n"
    )


def test_every_axis_is_here() -> None:
    assert tuple(VALUES) == AXIS_PATHS


@pytest.mark.parametrize(("path", "values"), [(path, values) for path, all_of in VALUES.items() for values in all_of])
def test_axis_becomes_a_dimension(path: str, values: str, tmp_path: Path) -> None:
    plan = load_text(tmp_path, study(path, values))
    assert len({case.key for case in expand(plan).cases}) == plan.size  # each value reaches the scenes
    sweep.run(plan, tmp_path / "c.nc", workers=1, solve=workers.made_up)
    with open_cube(tmp_path / "c.nc") as cube:
        dimension = path.split(".")[-1]
        assert cube.sizes[dimension] == plan.size
        assert dimension in cube.coords
        assert len(case_table(cube)) == plan.size


@pytest.mark.parametrize("values", ["[auto, [2, 2]]", "[[2, 2], auto]"])
def test_window_that_fits_itself_is_called_so(values: str, tmp_path: Path) -> None:
    """Wherever it stands; its size is that of its cases, not of the axis."""
    sweep.run(load_text(tmp_path, study("mesh.size", values)), tmp_path / "c.nc", workers=1, solve=workers.made_up)
    with open_cube(tmp_path / "c.nc") as cube:
        assert set(cube["size"].values.tolist()) == {"auto", "2 x 2"}
        assert float(cube["size_x"].sel(size="2 x 2")) == 2.0
        assert bool(cube["size_y"].sel(size="auto").isnull())


@pytest.mark.parametrize("values", ["[null, 0.2]", "[0.2, null]"])
def test_no_poissons_ratio_is_no_value_of_an_axis(values: str, tmp_path: Path) -> None:
    (message,) = refusal(tmp_path, study("layer_nu", values))
    assert "a number from 0 to 0.5" in message


def test_axes_named_like_keywords_of_xarray_are_selected_by_a_mapping(tmp_path: Path) -> None:
    """As the documents say: `tolerance` and `method` alone are taken as those keywords."""
    tolerances = "[{normal: 1.0e-5, tangential: 1.0e-7}, {label: loose, normal: 1.0e-3, tangential: 1.0e-3}]"
    axes = f"{{tolerance: {tolerances}, method: [newton, paper-cg]}}"
    study = load_text(tmp_path, f"{BASE}  g: {{scene: {{creepage: {{spin: 0.01}}}}, axes: {axes}}}\n")
    sweep.run(study, tmp_path / "g.nc", workers=1, solve=workers.made_up)
    with open_cube(tmp_path / "g.nc") as tree:
        cube = tree.to_dataset()
        case = cube.sel({"tolerance": "loose", "method": "newton"})
        assert str(case.label.values) == "tolerance=loose, method=newton"
        assert cube.sel(tolerance="loose").label.shape == (2, 2)
        assert cube.sel(method="newton").label.shape == (2, 2)


def test_two_axes_whose_last_word_is_the_same(tmp_path: Path) -> None:
    """The way out that docs/study.md names."""
    text = " ".join((Path(__file__).parent.parent / "docs" / "study.md").read_text(encoding="utf-8").split())
    one, other = "substrate.nu: [0.25, 0.3]", "counterbody: [{E: 210000, nu: 0.3}, {E: 210000, nu: 0.4}]"
    assert f"`{one}` beside `{other}`" in text
    axes = f"  g:\n    axes:\n      {one}\n      {{}}\n"
    refused = refusal(tmp_path, BASE + axes.format("counterbody.nu: [0.3, 0.4]"))
    assert any("two axes may not have the same name" in line for line in refused)
    sweep.run(load_text(tmp_path, BASE + axes.format(other)), tmp_path / "c.nc", workers=1, solve=workers.made_up)
    with open_cube(tmp_path / "c.nc") as cube:
        assert cube["nu"].values.tolist() == [0.25, 0.3]
        assert cube["counterbody_nu"].dims == ("counterbody",)
        assert cube["counterbody_nu"].values.tolist() == [0.3, 0.4]


def test_the_size_of_a_fitted_window_in_a_list_is_that_which_was_fitted(tmp_path: Path) -> None:
    """As docs/cube.md says of `mesh_size_x`."""
    cases = "[{label: fixed}, {label: fitted, mesh: {size: auto}}]"
    study = load_text(tmp_path, BASE + f"  g: {{cases: {cases}}}\n")
    sweep.run(study, tmp_path / "c.nc", workers=1, solve=workers.made_up)
    with open_cube(tmp_path / "c.nc") as cube:
        for dim in "xy":
            centres = cube[f"{dim}_centre"].values
            fitted = centres.shape[1] * (centres[1, 1] - centres[1, 0])
            assert cube[f"mesh_size_{dim}"].values.tolist() == pytest.approx([2.0, fitted])
            assert fitted < 2.0
