"""Cubes: what they hold, how they open, and that nothing but a whole one ever stands under its name."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
import synthetic
import xarray as xr

import rcstudy
from rcstudy import cube as cube_module
from rcstudy import cube_writer, publish
from rcstudy.cube import case_dims, case_table, grids, open_cube, to_dataset, write_cube
from rcstudy.errors import UserError
from rcstudy.layout import MISSING, SCHEMA_ATTRIBUTE
from rcstudy.mechanics.scene import Mesh
from rcstudy.publish import replacing
from rcstudy.result import VARIABLES, CellState, Result, Status
from rcstudy.steady import SteadyFile

ENGINES = ("h5netcdf", "netcdf4")
TESTS = Path(__file__).parent


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
    monkeypatch.setattr(cube_module, "_engine", lambda: request.param)
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
                assert table.loc[(case.grid, case.index), name] == value, name
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
    refused(tmp_path / "text.nc", "not a readable rcstudy cube")
    (tmp_path / "empty.nc").write_bytes(b"")
    refused(tmp_path / "empty.nc", "not a readable rcstudy cube")
    whole = single.read_bytes()
    (tmp_path / "cut.nc").write_bytes(whole[: len(whole) // 2])
    refused(tmp_path / "cut.nc", "not a readable rcstudy cube")
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
        assert list(grids(tree)) == ["product", "pressure_only", "listed"]


def test_chunks_need_dask(several: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cube_module, "find_spec", lambda name: None if name == "dask" else True)
    with pytest.raises(UserError, match="install dask"):
        rcstudy.open(several, chunked=True)


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
    bare = to_dataset(replace(synthetic.SCENE, creepage=None), Result(Status.REFUSED, "why"))
    assert "traction_x" not in bare
    assert np.isnan(bare.pressure).all()
    assert bare.pressure.shape == synthetic.MESH.cells
    assert str(bare.status_reason.values) == "why"
    assert int(bare.iterations_normal) == MISSING


def test_the_package_is_light_and_its_functions_stay_functions() -> None:
    code = (
        "import sys, rcstudy, rcstudy.cli\n"
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


# crashes

MOMENTS = ["layout", "result 0", "result 4", "result 8", "scalars", "table", "close", "sync", "rename"]


def die(*arguments: object, **keywords: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def start_writer(path: Path, moment: str = "") -> int:
    """A process that writes `synthetic.several` to `path`, and kills itself at `moment`; its number."""
    process = os.fork()
    if process:
        return process
    try:
        made = synthetic.several()

        def results() -> Iterator:
            for k, pair in enumerate(made.results):
                if moment == f"result {k}":
                    die()
                yield pair

        sync = publish.sync
        for name, place, attribute, action in (
            ("layout", cube_writer._Group, "_create", die),
            ("scalars", cube_writer._Group, "finish", die),
            ("table", cube_writer._Group, "fill_from", die),
            ("close", h5py.File, "close", die),
            ("sync", publish, "sync", die),
            ("rename", Path, "replace", die),
            ("renamed", publish, "sync", lambda p: die() if p.is_dir() else sync(p)),
        ):
            if name == moment:
                setattr(place, attribute, action)
        write_cube(path, made.study, made.expansion, results(), {"command": "killed"})
    finally:
        os._exit(0)  # nothing of the test run may go on in here


def ended_by(process: int) -> int:
    """The signal that ended a process; 0 when it came to its own end."""
    _, status = os.waitpid(process, 0)
    return os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0


@pytest.fixture(scope="module")
def old_cube(single: Path) -> bytes:
    """What stands at the place of a cube before a writer comes."""
    return single.read_bytes()


@pytest.mark.parametrize(
    ("moment", "there"), [*((moment, True) for moment in MOMENTS), ("result 4", False), ("rename", False)]
)
def test_killed_before_the_rename_changes_nothing(tmp_path: Path, old_cube: bytes, moment: str, there: bool) -> None:
    path = tmp_path / "c.nc"
    if there:
        path.write_bytes(old_cube)
    assert ended_by(start_writer(path, moment)) == signal.SIGKILL
    assert path.exists() == there
    if there:
        assert path.read_bytes() == old_cube
    assert len(leftovers(tmp_path)) == 1
    with replacing(path) as temporary:
        temporary.write_bytes(b"the next one")
    assert [entry.name for entry in tmp_path.iterdir()] == ["c.nc"]


def test_killed_after_the_rename_leaves_the_new_cube_whole(tmp_path: Path, old_cube: bytes) -> None:
    path = tmp_path / "c.nc"
    path.write_bytes(old_cube)
    assert ended_by(start_writer(path, "renamed")) == signal.SIGKILL
    check_whole(path)
    assert leftovers(tmp_path) == []


def test_killed_at_any_moment(tmp_path: Path, old_cube: bytes) -> None:
    """Kills spread over a whole write: under the name stands the old cube, byte for byte, or the new one, whole."""
    path = tmp_path / "c.nc"
    begun = time.monotonic()
    assert ended_by(start_writer(tmp_path / "other.nc")) == 0
    whole = time.monotonic() - begun
    killed = 0
    for fraction in np.linspace(0.02, 1.0, 10):
        path.write_bytes(old_cube)
        process = start_writer(path)
        time.sleep(whole * fraction)
        os.kill(process, signal.SIGKILL)
        killed += ended_by(process) == signal.SIGKILL
        if path.read_bytes() != old_cube:
            check_whole(path)
    assert killed > 0


def check_whole(path: Path) -> None:
    """The cube at `path` is that of `synthetic.several`, complete."""
    made = synthetic.several()
    with open_cube(path) as tree:
        found = grids(tree)
        assert len(case_table(tree)) == len(made.results)
        for case, result in made.results:
            at = dict(zip(case_dims(found[case.grid]), case.index, strict=True))
            np.testing.assert_array_equal(found[case.grid]["pressure"].isel(at), result.fields["pressure"])


def test_leftovers_of_the_living_and_of_others_stay(tmp_path: Path) -> None:
    target = tmp_path / "c.nc"
    with replacing(target) as temporary:
        host = temporary.name.removeprefix("c.nc.tmp-").rsplit("-", 2)[0]
        temporary.write_bytes(b"first")
        names = {
            "living": f"c.nc.tmp-{host}-{os.getppid()}-1",
            "elsewhere": "c.nc.tmp-elsewhere-99999999-1",
            "of another cube": f"d.nc.tmp-{host}-99999999-1",
            "no temporary name": "c.nc.tmp-mine",
        }
        for name in names.values():
            (tmp_path / name).write_bytes(b"")
        dead = tmp_path / f"c.nc.tmp-{host}-99999999-1"
        dead.write_bytes(b"")
        earlier = tmp_path / f"c.nc.tmp-{host}-{os.getpid()}-0"  # the number of a process before this one
        earlier.write_bytes(b"")
    with replacing(target) as temporary:
        temporary.write_bytes(b"second")
        assert not dead.exists()
        assert not earlier.exists()
    assert target.read_bytes() == b"second"
    for what, name in names.items():
        assert (tmp_path / name).exists(), what


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    link = tmp_path / "c.nc"
    link.symlink_to(tmp_path / "data" / "real.nc")
    with replacing(link) as temporary:
        temporary.write_bytes(b"new")
    assert link.is_symlink()
    assert (tmp_path / "data" / "real.nc").read_bytes() == b"new"


def test_places_that_cannot_be_written_to(tmp_path: Path) -> None:
    made = synthetic.small()
    asked = []

    def results() -> Iterator:
        asked.append(True)
        yield from made.results

    (tmp_path / "file").write_text("")
    (tmp_path / "folder").mkdir()
    for path in (tmp_path / "file" / "c.nc", tmp_path / "folder"):
        with pytest.raises(UserError, match=path.name):
            write_cube(path, made.study, made.expansion, results(), {})
    assert not asked, "nothing may be computed for a cube that cannot be written"


def test_a_full_disk_leaves_the_old_cube(tmp_path: Path) -> None:
    path = synthetic.write(tmp_path / "c.nc", synthetic.small())
    before = path.read_bytes()
    code = (
        "import resource, signal, sys\n"
        "sys.path.insert(0, sys.argv[1])\n"
        "import synthetic\n"
        "from pathlib import Path\n"
        "from rcstudy.errors import UserError\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[3]), int(sys.argv[3])))\n"
        "try:\n"
        "    synthetic.write(Path(sys.argv[2]), synthetic.several())\n"
        "except UserError as error:\n"
        "    assert 'c.nc: cannot be written' in str(error), error\n"
        "    sys.exit(7)\n"
    )
    for limit in (0, 150_000):
        command = [sys.executable, "-c", code, str(TESTS), str(path), str(limit)]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (7, "")
        assert path.read_bytes() == before
        assert leftovers(tmp_path) == []


def test_an_interrupt_leaves_the_old_cube(tmp_path: Path) -> None:
    made = synthetic.small()
    path = synthetic.write(tmp_path / "c.nc", made)
    before = path.read_bytes()

    def results() -> Iterator:
        yield from made.results[:3]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_cube(path, made.study, made.expansion, results(), {})
    assert path.read_bytes() == before
    assert leftovers(tmp_path) == []


def test_an_interrupt_inside_hdf5_waits_for_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C while HDF5 writes through Python code: seen once the write is over, and nothing is broken by it."""
    made = synthetic.small()
    path = synthetic.write(tmp_path / "c.nc", made)
    before = path.read_bytes()
    write, calls = SteadyFile.write, []

    def interrupted(self: SteadyFile, data: memoryview) -> int:
        calls.append(len(data))
        if len(calls) % 5 == 0:
            os.kill(os.getpid(), signal.SIGINT)
        return write(self, data)

    monkeypatch.setattr(SteadyFile, "write", interrupted)
    with pytest.raises(KeyboardInterrupt):
        synthetic.write(path, made)
    assert len(calls) > 5
    monkeypatch.undo()
    assert path.read_bytes() == before
    assert leftovers(tmp_path) == []


def test_a_file_whose_writes_fail_reads_back_what_was_written(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    steady, plain = SteadyFile(tmp_path / "steady"), io.BytesIO()

    def both(action: str, *arguments: object) -> None:
        assert getattr(steady, action)(*arguments) == getattr(plain, action)(*arguments), action

    def some() -> None:
        for _ in range(60):
            for action, argument in (
                ("seek", int(rng.integers(0, 900))),
                ("write", rng.bytes(int(rng.integers(1, 90)))),
            ):
                both(action, argument)
            both("seek", int(rng.integers(0, 400)))
            both("read", int(rng.integers(0, 500)))
            both("tell")

    with steady:
        some()
        both("truncate", 700)
        steady.check()
        before = (tmp_path / "steady").read_bytes()
        os.close(steady._file.fileno())
        replacement = os.open(tmp_path / "steady", os.O_RDONLY)  # writes to it fail
        assert replacement == steady._file.fileno()
        some()
        both("seek", 0)
        both("read", 2000)
        with pytest.raises(OSError, match="descriptor"):
            steady.check()
    assert (tmp_path / "steady").read_bytes() == before


def test_results_are_taken_one_at_a_time(tmp_path: Path) -> None:
    """The writer keeps no fields: a result's arrays are gone once the next one is asked for."""
    import weakref

    mesh = Mesh((2.0, 2.0), (16, 16))
    grid = synthetic.make_grid("many", synthetic.number_axis("load", list(np.linspace(50, 100, 20)), "N"))
    cases = synthetic.grid_cases(grid, replace(synthetic.SCENE, mesh=mesh))
    study = SimpleNamespace(**vars(synthetic.make_study()))
    alive: list[weakref.ref] = []

    def results() -> Iterator:
        for case in cases:
            assert sum(ref() is not None for ref in alive) <= 1
            result = synthetic.made_up_result(case.scene)
            alive.append(weakref.ref(result.fields["pressure"]))
            yield case, result
            del result

    expansion = synthetic.assemble(study, (grid, cases)).expansion
    write_cube(tmp_path / "c.nc", study, expansion, results(), {})
    assert len(alive) == 20
