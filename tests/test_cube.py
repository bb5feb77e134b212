"""Cubes: what they hold and how they open."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import synthetic
import xarray as xr
from cubes import write_cube

import rcstudy
from rcstudy import cube as cube_module
from rcstudy.cube import case_dims, case_table, grids, open_cube, to_dataset
from rcstudy.errors import UserError
from rcstudy.mechanics.scene import Mesh
from rcstudy.result import VARIABLES, CellState, Result, Status
from rcstudy.storage import layout
from rcstudy.storage.layout import MISSING, SCHEMA_ATTRIBUTE
from rcstudy.studyfile.build import scene_hertz
from rcstudy.studyfile.spec import RESERVED_NAMES

ENGINES = ("h5netcdf", "netcdf4")


@pytest.fixture(scope="module")
def several(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cube of three grids."""
    return synthetic.write(tmp_path_factory.mktemp("several") / "several.nc", synthetic.several())


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cube of one grid."""
    return synthetic.write(tmp_path_factory.mktemp("single") / "single.nc", synthetic.small())


def leftovers(folder: Path) -> list[str]:
    """Names of temporary files in `folder`."""
    return [entry.name for entry in folder.iterdir() if ".tmp-" in entry.name]


@pytest.fixture(params=ENGINES)
def engine_in_use(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """`open_cube` with either engine."""
    monkeypatch.setattr(cube_module, "engine", lambda path: request.param)
    return request.param


@pytest.mark.parametrize("engine", ENGINES)
def test_one_grid_is_the_root(single: Path, engine: str) -> None:
    with xr.open_dataset(single, engine=engine) as cube:
        assert cube.pressure.dims == ("modulus", "creepage", "x", "y")
        assert cube.force_x.dims == ("modulus", "creepage")
        assert dict(cube.sizes) == {"modulus": 2, "creepage": 3, "layer": 1, "x": 32, "y": 24}
        assert list(cube.creepage.values) == ["a", "c", "f"]
        assert cube.spin.dims == ("creepage",)
        assert "spin" in cube.coords
        assert "modulus_ratio" in cube.coords
        assert cube.modulus.attrs["units"] == "MPa"
        np.testing.assert_allclose(np.diff(cube.x), 2.0 / 32)
        assert float(cube.x.mean()) == pytest.approx(0.0, abs=1e-15)
        assert not [dim for dim in cube.dims if str(dim).startswith("phony")]


@pytest.mark.parametrize("engine", ENGINES)
def test_several_grids_are_groups_under_a_table(several: Path, engine: str) -> None:
    made = synthetic.several()
    with xr.open_dataset(several, engine=engine) as table:
        assert table.sizes == {"entry": 9}
        assert list(table.grid.values) == ["product"] * 4 + ["pressure_only"] * 3 + ["listed"] * 2
        assert table.label.values[0] == "thickness=0.25 a, modulus=0.5 Es, creepage=a"
        assert table.label.values[-1] == "soft"
        assert table.attrs["study_text"] == made.study.text
        assert np.isnan(table.force_x.values[4:7]).all()
        assert np.isfinite(table.force_x.values[:4]).all()
    with xr.open_datatree(several, engine=engine) as tree:
        assert set(tree.children) == {"product", "pressure_only", "listed"}
        assert tree["product"]["pressure"].dims == ("thickness", "modulus", "creepage", "x", "y")
        assert list(tree["listed"]["case"].values) == ["bare", "soft"]
        assert tree["listed"]["layer_modulus"].values[1, 0] == 105000.0
        assert np.isnan(tree["listed"]["layer_modulus"].values[0, 0])
        np.testing.assert_array_equal(tree["pressure_only"]["load"], [50.0, 100.0, 150.0])


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("which", ["several", "single"])
def test_every_variable_has_units_and_a_name(which: str, engine: str, request: pytest.FixtureRequest) -> None:
    with xr.open_datatree(request.getfixturevalue(which), engine=engine) as tree:
        count = 0
        for node in tree.subtree:
            for name, variable in node.to_dataset(inherit=False).variables.items():
                assert variable.attrs.get("units"), name
                assert variable.attrs.get("long_name"), name
                count += 1
            for attribute, value in node.attrs.items():
                assert isinstance(value, str | int | float | np.integer | np.floating), attribute
        assert count > 40


@pytest.mark.parametrize("engine", ENGINES)
def test_enumerations_stay_small_integers(single: Path, engine: str) -> None:
    with xr.open_dataset(single, engine=engine) as cube:
        assert cube.state.dtype == np.int8
        assert cube.status.dtype == np.int8
        meanings = dict(zip(cube.state.attrs["flag_values"], cube.state.attrs["flag_meanings"].split(), strict=True))
        assert meanings == {-1: "not_computed", 0: "exterior", 1: "stick", 2: "slip"}
        values, names = cube.status.attrs["flag_values"], cube.status.attrs["flag_meanings"].split()
        assert list(values) == [status.value for status in Status]
        assert names == [status.name.lower() for status in Status]
        assert set(np.unique(cube.state)) == {CellState.EXTERIOR, CellState.STICK, CellState.SLIP}


def test_every_number_is_where_it_belongs(tmp_path: Path, engine_in_use: str) -> None:
    made = synthetic.several()
    path = tmp_path / "shuffled.nc"
    write_cube(path, made.study, made.expansion, synthetic.shuffled(made.results), {})
    with open_cube(path) as tree:
        found = grids(tree)
        table = case_table(tree).set_index(["grid", "index"])
        for case, result in made.results:
            grid = found[case.grid]
            at = dict(zip(case_dims(grid), case.index, strict=True))
            for name, values in result.fields.items():
                np.testing.assert_array_equal(grid[name].isel(at).values, values, err_msg=name)
            for name, value in result.scalars.items():
                assert float(grid[name].isel(at)) == value, name
                assert table.at[(case.grid, case.index), name] == value, name
            assert str(grid["case_key"].isel(at).values) == case.key


def test_provenance_text_is_kept_to_the_letter(tmp_path: Path) -> None:
    made = synthetic.small()
    write_cube(
        tmp_path / "c.nc", made.study, made.expansion, iter(made.results), {"machine_cores": 2, "command": "x y"}
    )
    for engine in ENGINES:
        with xr.open_dataset(tmp_path / "c.nc", engine=engine) as cube:
            assert cube.attrs["study_text"] == made.study.text
            assert cube.attrs["study_sha256"] == made.study.sha256
            assert cube.attrs["machine_cores"] == 2
            assert cube.attrs["command"] == "x y"
            assert cube.attrs["wall_seconds"] >= 0


def test_pressure_only_grids_have_nothing_tangential(several: Path) -> None:
    with open_cube(several) as tree:
        tangential = {name for name, variable in VARIABLES.items() if variable.tangential}
        assert not tangential & set(tree["pressure_only"].data_vars)
        assert tangential <= set(tree["product"].data_vars)
        assert "longitudinal" not in tree["pressure_only"].variables


@pytest.mark.parametrize("odd", [0, 1, 2])
def test_centres_are_stored_for_each_case_if_a_single_one_has_another_mesh(odd: int) -> None:
    grid = synthetic.make_grid("loads", synthetic.number_axis("load", [50.0, 100.0, 150.0], "N"))
    cases, other = synthetic.grid_cases(grid, synthetic.SCENE), Mesh((2.0, 1.0), (5, 4))
    cases[odd] = replace(cases[odd], scene=replace(cases[odd].scene, mesh=other))
    found = layout.grid_layout(grid, cases, fields=True, precision="float64")
    for k, dim in enumerate("xy"):
        values = found[f"{dim}_centre"].values
        assert values is not None
        for case in cases:
            centres = case.scene.mesh.centres[k]
            np.testing.assert_array_equal(values[case.index][: centres.size], centres)
            assert np.isnan(values[case.index][centres.size :]).all()


def test_centres_are_stored_once_if_all_cases_have_the_same_mesh() -> None:
    grid = synthetic.make_grid("loads", synthetic.number_axis("load", [50.0, 100.0], "N"))
    found = layout.grid_layout(grid, synthetic.grid_cases(grid, synthetic.SCENE), fields=True, precision="float64")
    for dim, centres in zip("xy", synthetic.SCENE.mesh.centres, strict=True):
        assert found[dim].values is not None
        np.testing.assert_array_equal(found[dim].values, centres)
        assert f"{dim}_centre" not in {item.name for item in found.items}


def test_cells_of_centres() -> None:
    """Neighbours among the window's, to a part of themselves and of the cells' length, which is 1/4 here."""
    window, off = np.linspace(-1.0, 1.0, 9), 1e-8
    for factor in (1.0, 1.0 + 0.9 * off, 1.0 - 0.9 * off):
        assert layout.cells_of_centres(factor * window[1:6], window, off) == (1, 6)
    for shift in (0.9 * off, -0.9 * off):
        assert layout.cells_of_centres(window[4:5] + 0.25 * shift, window, off) == (4, 5)
        assert layout.cells_of_centres(window[4:5] + 0.5 * shift, window, off) is None
        assert layout.cells_of_centres(window[1:6] * (1.0 + 0.5 * shift), window) is None
    assert layout.cells_of_centres(np.append(window[2:4], [np.nan, np.nan]), np.append(window, np.nan)) == (2, 4)
    for centres in ([], [np.nan, -0.5], window[::2], [*window[6:], 1.25]):
        assert layout.cells_of_centres(np.array(centres), window, off) is None


def test_what_no_axis_has_is_stored_with_each_case(several: Path) -> None:
    """Creepages of a list of cases; of layers their numbers, from the surface down, from one on."""
    with open_cube(several) as tree:
        listed, expected = tree["listed"].dataset, synthetic.SCENE.creepage
        assert expected is not None
        for name in ("longitudinal", "lateral", "spin"):
            assert listed[name].values.tolist() == [getattr(expected, name)] * 2
        assert tree["product"]["layer"].values.tolist() == [1, 2]


def test_cases_that_failed_have_their_reason_and_no_numbers(tmp_path: Path) -> None:
    made = synthetic.small()
    case = made.results[1][0]
    failing = {case.key: Status.ERROR}
    made = synthetic.assemble(made.study, (made.expansion.grids[0], list(made.expansion.cases)), failing=failing)
    with xr.open_dataset(synthetic.write(tmp_path / "c.nc", made)) as cube:
        at = dict(zip(("modulus", "creepage"), case.index, strict=True))
        one = cube.isel(at)
        assert int(one.status) == Status.ERROR
        assert str(one.status_reason.values) == "made up to fail"
        assert np.isnan(one.pressure).all()
        assert (one.state == MISSING).all()
        assert np.isnan(one.force_x)
        assert int(one.iterations_normal) == MISSING
        assert int((cube.status == Status.SOLVED).sum()) == 5
        assert np.isfinite(cube.pressure).sum() == 5 * 32 * 24


def test_fields_in_single_precision_or_not_at_all(tmp_path: Path) -> None:
    exact = synthetic.small()
    single = synthetic.write(tmp_path / "single.nc", synthetic.small(precision="float32"))
    scalars = synthetic.write(tmp_path / "scalars.nc", synthetic.small(fields=False))
    with xr.open_dataset(single) as cube:
        assert cube.pressure.dtype == np.float32
        assert cube.force_x.dtype == np.float64
        assert cube.state.dtype == np.int8
        np.testing.assert_array_equal(cube.pressure[0, 0], exact.results[0][1].fields["pressure"].astype("f4"))
    with xr.open_dataset(scalars) as cube:
        assert not {"x", "y"} & set(cube.dims)
        assert "pressure" not in cube
        assert float(cube.force_x[0, 0]) == exact.results[0][1].scalars["force_x"]


def test_meshes_that_vary(tmp_path: Path) -> None:
    labels = ["16 x 12", "32 x 24"]
    grid = synthetic.make_grid("meshes", replace(synthetic.case_axis(labels), name="cells"))
    axis = grid.axes[0]
    grid = replace(grid, axes=(replace(axis, coords={"cells": axis.coords["case"]}),))
    made = synthetic.assemble(synthetic.make_study(), (grid, synthetic.grid_cases(grid, synthetic.SCENE)))
    for engine in ENGINES:
        with xr.open_dataset(synthetic.write(tmp_path / "c.nc", made), engine=engine) as cube:
            assert cube.pressure.shape == (2, 32, 24)
            assert "x" not in cube.coords
            assert cube.x_centre.dims == ("cells", "x")
            np.testing.assert_allclose(cube.x_centre[0, :16], (np.arange(16) - 7.5) * 2.0 / 16)
            assert np.isnan(cube.x_centre[0, 16:]).all()
            assert np.isnan(cube.pressure[0, 16:]).all()
            assert (cube.state[0, :, 12:] == MISSING).all()
            np.testing.assert_array_equal(cube.pressure[0, :16, :12], made.results[0][1].fields["pressure"])
            np.testing.assert_array_equal(cube.pressure[1], made.results[1][1].fields["pressure"])


def test_a_chunk_is_one_field_of_one_case(single: Path) -> None:
    with h5py.File(single) as file:
        for name in ("pressure", "state", "slip_y"):
            assert file[name].chunks == (1, 1, 32, 24)
            assert file[name].compression == "gzip"
            assert not file[name].shuffle


def test_cubes_open_lazily_with_dask(single: Path) -> None:
    with xr.open_dataset(single, chunks={}) as cube:
        assert cube.pressure.data.chunksize == (1, 1, 32, 24)


def test_results_must_fit_the_study(tmp_path: Path) -> None:
    made = synthetic.small()
    path = synthetic.write(tmp_path / "c.nc", made)
    before = path.read_bytes()

    def refused(results: list, words: str) -> None:
        with pytest.raises(ValueError, match=words):
            write_cube(path, made.study, made.expansion, iter(results), {})
        assert path.read_bytes() == before
        assert leftovers(tmp_path) == []

    case, result = made.results[0]
    refused(made.results[1:], "1 of 6 cases have no result")
    refused([*made.results, made.results[0]], "two results")
    refused([(case, replace(result, scalars={"force": 1.0})), *made.results[1:]], r"unknown variables \['force'\]")
    turned = {**result.fields, "pressure": result.fields["pressure"].T}
    refused([(case, replace(result, fields=turned)), *made.results[1:]], r"shape \(24, 32\)")


def test_names_that_the_cube_uses_are_reserved() -> None:
    """So that a grid or a label of such a name is refused where the study is read, not when the cube is laid out."""
    own = {layout.ENTRY, layout.LAYER, layout.LABEL, layout.GRID, layout.CASE_KEY, "x", "y"}
    assert {*VARIABLES, *layout.SETTINGS, *layout.LAYER_SETTINGS, *own} <= RESERVED_NAMES


def test_names_that_would_hide_each_other_are_refused(tmp_path: Path) -> None:
    made = synthetic.several()
    grid = replace(made.expansion.grids[0], name="friction")
    cases = [replace(case, grid="friction") for case in made.expansion.cases if case.grid == "product"]
    other = (made.expansion.grids[2], [case for case in made.expansion.cases if case.grid == "listed"])
    clash = synthetic.assemble(made.study, (grid, cases), other)
    with pytest.raises(UserError, match="grid friction: is also the name of a variable"):
        synthetic.write(tmp_path / "c.nc", clash)
    axis = synthetic.number_axis("approach", [1.0])
    grid = synthetic.make_grid("g", axis)
    with pytest.raises(UserError, match="axis approach: is also the name of a variable"):
        synthetic.write(
            tmp_path / "c.nc",
            synthetic.assemble(made.study, (grid, synthetic.grid_cases(grid, synthetic.SCENE))),
        )
    assert list(tmp_path.iterdir()) == []


def test_opening_what_is_no_cube(tmp_path: Path, single: Path, engine_in_use: str) -> None:
    def refused(path: Path, words: str) -> None:
        with pytest.raises(UserError, match=words):
            rcstudy.open(path)

    refused(tmp_path / "missing.nc", "missing.nc: no such file")
    refused(tmp_path, "not a file")
    (tmp_path / "text.nc").write_text("not HDF5")
    refused(tmp_path / "text.nc", "not a readable rcstudy cube: it is no file of HDF5, or damaged")
    (tmp_path / "empty.nc").write_bytes(b"")
    refused(tmp_path / "empty.nc", "not a readable rcstudy cube: it is no file of HDF5, or damaged")
    whole = single.read_bytes()
    (tmp_path / "cut.nc").write_bytes(whole[: len(whole) // 2])
    refused(tmp_path / "cut.nc", "not a readable rcstudy cube: it is no file of HDF5, or damaged")
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(tmp_path / "foreign.nc", engine="h5netcdf")
    refused(tmp_path / "foreign.nc", "not an rcstudy cube: ")
    for schema, words in ((99, "layout 99"), ("new", "layout new")):
        (tmp_path / "newer.nc").write_bytes(whole)
        with h5py.File(tmp_path / "newer.nc", "r+") as file:
            file.attrs[SCHEMA_ATTRIBUTE] = schema
        refused(tmp_path / "newer.nc", words)


def test_opening_reads_nothing_and_in_chunks_a_case_at_a_time(several: Path, engine_in_use: str) -> None:
    with rcstudy.open(several) as tree:
        assert not tree["product"]["pressure"].variable._in_memory
        assert tree["product"]["pressure"].chunks is None
    with rcstudy.open(several, chunked=True) as tree:
        pressure = tree["product"]["pressure"]
        assert pressure.data.chunksize == (1, 1, 1, 32, 24)
        assert float(pressure.isel(thickness=1, modulus=0, creepage=0).max()) > 0
        for grid in grids(tree).values():  # chunks that agree with each other
            assert {size for dim, sizes in grid.chunksizes.items() if dim not in ("x", "y") for size in sizes} == {1}
        assert not tree["product"]["force_x"].variable._in_memory
        assert float(tree["product"].to_dataset().map_blocks(lambda part: part[["pressure"]]).pressure.max()) > 0
        assert list(grids(tree)) == ["product", "pressure_only", "listed"]


def test_chunks_need_dask(several: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cube_module, "find_spec", lambda name: None if name == "dask" else True)
    with pytest.raises(UserError, match="install dask"):
        rcstudy.open(several, chunked=True)
    with rcstudy.open(several) as tree:  # and nothing else does
        assert list(grids(tree)) == ["product", "pressure_only", "listed"]


def test_grids_come_in_the_order_of_the_study(several: Path, single: Path) -> None:
    with open_cube(several) as tree:
        assert list(grids(tree)) == ["product", "pressure_only", "listed"]
    with open_cube(single) as tree:
        assert list(grids(tree)) == ["tiny"]


def test_table_of_cases(several: Path, engine_in_use: str) -> None:
    with open_cube(several) as tree:
        table = case_table(tree)
    assert len(table) == 9
    row = table[(table.grid == "product") & (table.label == "thickness=1 a, modulus=2 Es, creepage=a")].iloc[0]
    assert row["index"] == (1, 1, 0)
    assert row.thickness == pytest.approx(synthetic.RADIUS)
    assert row.thickness_ratio == 1.0
    assert row.modulus == 420000.0
    assert row.longitudinal == 0.002
    assert "pressure" not in table
    assert "layer_modulus" not in table


def test_one_result_as_a_dataset() -> None:
    result = synthetic.made_up_result(synthetic.SCENE)
    dataset = to_dataset(synthetic.SCENE, result)
    assert dataset.traction_x.dims == ("x", "y")
    np.testing.assert_array_equal(dataset.traction_x, result.fields["traction_x"])
    assert float(dataset.force_x) == result.scalars["force_x"]
    assert dataset.state.dtype == np.int8
    assert dataset.pressure.attrs["units"] == "MPa"
    assert int(dataset.status) == Status.SOLVED
    assert float(dataset.hertz_radius) == pytest.approx(scene_hertz(synthetic.SCENE).radius)
    assert float(dataset.hertz_pressure) == pytest.approx(scene_hertz(synthetic.SCENE).p0)
    assert dataset.hertz_pressure.attrs["units"] == "MPa"
    bare = to_dataset(replace(synthetic.SCENE, creepage=None), Result(Status.REFUSED, "why"))
    assert "traction_x" not in bare
    assert np.isnan(bare.pressure).all()
    assert bare.pressure.shape == synthetic.MESH.cells
    assert str(bare.status_reason.values) == "why"
    assert int(bare.iterations_normal) == MISSING


@pytest.mark.parametrize("tangential", [True, False])
def test_datasets_are_those_made_one_by_one(tangential: bool) -> None:
    """The naive twin: every variable from the catalogue. A refused case has none of its numbers."""
    scene = synthetic.SCENE if tangential else replace(synthetic.SCENE, creepage=None)
    for result in (synthetic.made_up_result(scene), Result(Status.REFUSED, "why"), synthetic.made_up_result(scene)):
        values = {**result.scalars, **result.fields, "status": int(result.status), "status_reason": result.reason}
        variables = {}
        for name, variable in VARIABLES.items():
            if tangential or not variable.tangential:
                dims, shape = (("x", "y"), scene.mesh.cells) if variable.kind == "field" else ((), ())
                kind = object if variable.dtype == "str" else variable.dtype
                data = np.full(shape, np.nan if kind == "f8" else MISSING, dtype=kind)
                data[...] = values.get(name, data)
                variables[name] = (dims, data, layout.variable_attrs(variable))
        contact = scene_hertz(scene)
        for name, value, unit in (("hertz_radius", contact.radius, "mm"), ("hertz_pressure", contact.p0, "MPa")):
            variables[name] = ((), value, {"long_name": layout.SETTINGS[name].long_name, "units": unit})
        coords = {
            dim: (dim, np.linspace(-0.5, 0.5, 2 * n + 1)[1::2] * size, layout.CENTRE_ATTRS[dim])
            for dim, n, size in zip("xy", scene.mesh.cells, scene.mesh.size, strict=True)
        }
        expected, found = xr.Dataset(variables, coords), to_dataset(scene, result)
        xr.testing.assert_allclose(found, expected, rtol=1e-14, atol=1e-14)
        for name, variable in expected.variables.items():
            assert str(found[name].attrs) == str(variable.attrs)


def test_changing_a_dataset_changes_no_other() -> None:
    """They are copies of one: of its numbers where a result has none, its attributes and its indexes."""
    failed = Result(Status.REFUSED, "why")
    one, untouched = to_dataset(synthetic.SCENE, failed), to_dataset(synthetic.SCENE, failed).copy(deep=True)
    for variable in one.data_vars.values():
        if variable.dtype.kind != "O":
            variable.values[...] = 7
        variable.attrs["units"] = "furlong"
    one.x.attrs.clear()
    one.attrs.clear()
    one.state.attrs["flag_values"][0] = 9
    one.pressure.to_pandas().index.name = "x (mm)"
    another = to_dataset(synthetic.SCENE, failed)
    xr.testing.assert_identical(another, untouched)
    assert another.pressure.to_pandas().index.name == "x"


def test_threads_and_odd_paths_open_cubes_with_h5netcdf(tmp_path: Path, single: Path) -> None:
    """netCDF4 crashes where two threads open files, and does not find those whose names are not valid."""
    assert cube_module.engine(single) == "netcdf4"
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(cube_module.engine, single).result() == "h5netcdf"
        with pool.submit(open_cube, single).result() as tree:
            assert len(grids(tree)) == 1
    odd = tmp_path / os.fsdecode(b"gr\xf6n")
    try:
        odd.mkdir()
    except OSError:
        pytest.skip("this file system has no such names")
    path = odd / "single.nc"
    path.write_bytes(single.read_bytes())
    assert cube_module.engine(path) == "h5netcdf"
    with open_cube(path) as tree:
        assert len(grids(tree)) == 1


def test_the_package_is_light_and_its_functions_stay_functions() -> None:
    code = (
        "import sys, rcstudy, rcstudy.__main__\n"
        "assert 'typer' not in sys.modules  # workers import the module their parent started with\n"
        "import rcstudy.cli\n"
        "heavy = {'numpy', 'xarray', 'numba', 'h5py', 'matplotlib', 'pydantic'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
        "import os; assert 'OMP_NUM_THREADS' not in os.environ\n"
        "import rcstudy.solve\n"
        "from rcstudy.solve import solve_group\n"
        "assert type(rcstudy.solve).__name__ == 'function', rcstudy.solve\n"
        "assert rcstudy.__version__\n"
    )
    environment = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)


def test_whole_numbers_that_are_missing_are_no_numbers() -> None:
    np.testing.assert_array_equal(layout.as_floats(np.array([layout.MISSING, 0, 3], dtype="i1")), [np.nan, 0.0, 3.0])
    np.testing.assert_array_equal(layout.as_floats(np.array([255, 3], dtype="u1")), [255.0, 3.0])
    np.testing.assert_array_equal(layout.as_floats(np.array([-1.0, np.nan], dtype="f4")), [-1.0, np.nan])
