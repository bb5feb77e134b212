"""Cubes made to do harm, or damaged: an error with exit code 2, nothing read from elsewhere, no memory to speak of."""

from __future__ import annotations

import errno
import re
import shutil
import struct
import tempfile
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import synthetic
import xarray as xr
from cubes import write_cube
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from studies import BASE
from synthetic import write

from rcstudy import cli, cube
from rcstudy.cases import expand
from rcstudy.cube import engine, open_cube
from rcstudy.errors import UserError
from rcstudy.mechanics.scene import Mesh
from rcstudy.report import overview
from rcstudy.result import Result, Status
from rcstudy.storage.earlier import EarlierCube, other_study, refuse_foreign
from rcstudy.storage.heaps import _HEAD, _heaps, damaged_heap
from rcstudy.storage.screen import foreign_content
from rcstudy.study import load_study


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cube of one grid."""
    path: Path = tmp_path_factory.mktemp("good") / "good.nc"
    write(path, synthetic.small())
    return path


def run(*arguments: object) -> int:
    """Exit code of the command; whatever else it raises comes through."""
    try:
        cli.app([str(argument) for argument in arguments])
    except SystemExit as left:
        return int(left.code or 0)
    return 0


def replaced(file: h5py.File, name: str, **how: object) -> None:
    """Put another variable in the place of `name`."""
    del file[name]
    file.create_dataset(name, **how)


def external_link(file: h5py.File) -> None:
    del file["force_x"]
    file["force_x"] = h5py.ExternalLink("secret.nc", "/force_x")


def external_group(file: h5py.File) -> None:
    file["more"] = h5py.ExternalLink("/etc/passwd", "/")


def soft_link(file: h5py.File) -> None:
    file["again"] = h5py.SoftLink("/force_x")


def endless_groups(file: h5py.File) -> None:
    file.create_group("more")["more"] = file["/"]


def external_storage(file: h5py.File) -> None:
    replaced(file, "load", shape=(100,), dtype="u1", external=[("/etc/passwd", 0, 100)])


def virtual(file: h5py.File) -> None:
    layout = h5py.VirtualLayout((2, 3), "f8")
    layout[...] = h5py.VirtualSource("secret.nc", "force_x", (2, 3))
    del file["force_x"]
    file.create_virtual_dataset("force_x", layout)


def references(file: h5py.File) -> None:
    replaced(file, "force_x", shape=(2, 3), dtype=h5py.ref_dtype)


def compound(file: h5py.File) -> None:
    replaced(file, "force_x", data=np.zeros((2, 3), dtype=[("a", "f8"), ("b", "i4")]))


def opaque(file: h5py.File) -> None:
    replaced(file, "force_x", data=np.zeros((2, 3), dtype="V16"))


def ragged(file: h5py.File) -> None:
    replaced(file, "force_x", shape=(2, 3), dtype=h5py.vlen_dtype("f8"))


def named_type(file: h5py.File) -> None:
    file["type"] = np.dtype("f8")


def unknown_filter(file: h5py.File) -> None:
    replaced(file, "force_x", data=np.zeros((2, 3)), chunks=(1, 1), compression="lzf")


def huge_and_empty(file: h5py.File) -> None:
    replaced(file, "force_x", shape=(10**6, 10**6), dtype="f8")


def long_and_empty(file: h5py.File) -> None:
    replaced(file, "force_x", shape=(10**6, 10**5), dtype="i1", chunks=(1, 10**5))


def huge_chunks(file: h5py.File) -> None:
    replaced(file, "pressure", shape=(2, 3, 10**5, 10**5), dtype="i1", chunks=(1, 1, 60_000, 60_000))


def empty(file: h5py.File) -> None:
    replaced(file, "force_x", data=h5py.Empty("f8"))


def large_number_of_a_dimension(file: h5py.File) -> None:
    file["modulus"].attrs["_Netcdf4Dimid"] = np.int32(65_536)


def word_for_a_dimension(file: h5py.File) -> None:
    file["modulus"].attrs["_Netcdf4Dimid"] = "first"


def number_for_dimensions(file: h5py.File) -> None:
    file["force_x"].attrs["DIMENSION_LIST"] = 3


def fewer_dimensions_than_sides(file: h5py.File) -> None:
    lists = file["force_x"].attrs["DIMENSION_LIST"]
    file["force_x"].attrs.create("DIMENSION_LIST", lists[:1], dtype=lists.dtype)


def number_for_references(file: h5py.File) -> None:
    file["modulus"].attrs["REFERENCE_LIST"] = 3


def number_for_a_class(file: h5py.File) -> None:
    file["modulus"].attrs["CLASS"] = 3


def attribute_in_rows(file: h5py.File) -> None:
    file["force_x"].attrs["more"] = np.zeros((2, 2))


def compound_attribute(file: h5py.File) -> None:
    file.attrs["more"] = np.zeros(2, dtype=[("a", "f8"), ("b", "i4")])


FOREIGN: dict[Callable[[h5py.File], None], str] = {
    external_link: "/force_x is a link to elsewhere",
    external_group: "/more is a link to elsewhere",
    soft_link: "/again is a link to elsewhere",
    endless_groups: "/more/more is a group within a group",
    external_storage: "/load keeps its data elsewhere",
    virtual: "/force_x keeps its data elsewhere",
    references: "/force_x holds neither numbers nor text",
    compound: "/force_x holds neither numbers nor text",
    opaque: "/force_x holds neither numbers nor text",
    ragged: "/force_x holds neither numbers nor text",
    named_type: "/type is neither a group nor a variable",
    unknown_filter: "/force_x is compressed in an unknown way",
    huge_and_empty: "/force_x declares 8e+03 GB and holds 0 bytes",
    long_and_empty: "/force_x declares 100 GB and holds 0 bytes",
    huge_chunks: "/pressure has chunks larger than any case's field",
    empty: "/force_x holds nothing",
    large_number_of_a_dimension: "/modulus has no proper number of a dimension",
    word_for_a_dimension: "/modulus has no proper number of a dimension",
    number_for_dimensions: "/force_x has no proper list of dimensions",
    fewer_dimensions_than_sides: "/force_x has no proper list of dimensions",
    number_for_references: "/modulus has no proper list of references",
    number_for_a_class: "/modulus is no proper dimension",
    attribute_in_rows: "/force_x has an attribute more that is neither numbers nor text",
    compound_attribute: "/ has an attribute more that is neither numbers nor text",
}


@pytest.mark.parametrize("harm", FOREIGN, ids=lambda harm: harm.__name__)
def test_what_no_cube_holds_is_refused_unread(
    good: Path, tmp_path: Path, harm: Callable[[h5py.File], None], capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "c.nc"
    shutil.copy(good, path)
    shutil.copy(good, tmp_path / "secret.nc")
    with h5py.File(path, "r+") as file:
        harm(file)
    tracemalloc.start()
    try:
        for command in (["show", path], ["compare", good, path], ["tables", path, "-o", tmp_path / "t"]):
            assert run(*command) == 2
            assert capsys.readouterr().err == f"{path}: not an rcstudy cube: {FOREIGN[harm]}\n"
        assert tracemalloc.get_traced_memory()[1] < 50e6
    finally:
        tracemalloc.stop()
    assert not (tmp_path / "t").exists()


Cut = Callable[[xr.Dataset], xr.Dataset]


def saved(good: Path, path: Path, cut: Cut = lambda cube: cube, engine: Any = "netcdf4") -> Path:
    """A cube, or what is made of it, as xarray saves it."""
    with xr.open_dataset(good) as cube:
        cut(cube.load()).to_netcdf(path, engine=engine)
    return path


@pytest.mark.parametrize("engine", ["netcdf4", "h5netcdf"])
def test_a_cube_that_xarray_saved_is_read_and_not_replaced(
    good: Path, tmp_path: Path, engine: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was refused everywhere, and with it every part of a cube that somebody had cut out."""
    path = saved(good, tmp_path / "c.nc", engine=engine)
    with open_cube(path) as ours, open_cube(good) as theirs:
        xr.testing.assert_equal(ours.to_dataset(), theirs.to_dataset())
    assert run("compare", path, good) == run("compare", good, path) == run("show", path) == 0
    assert run("tables", path, "-o", tmp_path / "t") == 0
    assert "checksum" not in capsys.readouterr().err
    with pytest.raises(UserError, match="was saved by another program, such as xarray: only files that sweep or merge"):
        refuse_foreign(path)


def scaled(cube: xr.Dataset) -> xr.Dataset:
    return cube.assign(traction_x=cube.traction_x.copy(data=1.01 * cube.traction_x))


@pytest.mark.parametrize(
    ("cut", "told"),
    [
        (scaled, "traction_x: 1.00e-02 of"),
        (lambda cube: cube.isel(creepage=[0, 2]), "missing in the cube"),
        (lambda cube: cube.isel(modulus=slice(1, None)), "missing in the cube"),
        (lambda cube: cube.rename(traction_x="tx"), "variable traction_x: missing in the cube"),
        (lambda cube: cube.transpose(..., "y", "x"), "traction_x: dimensions are (modulus, creepage, y, x), in the"),
        (lambda cube: cube.rename(x="y", y="x"), "dimension x: 24, in the reference 32"),
        (lambda cube: cube.transpose("creepage", ...), "variable force_x: dimensions are (creepage, modulus), in"),
        (lambda cube: cube.assign(state=cube.state.roll(x=1)), "state: differs in"),
    ],
)
def test_what_xarray_made_of_a_cube_differs(
    good: Path, tmp_path: Path, cut: Cut, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("compare", saved(good, tmp_path / "c.nc", cut), good) == 1
    assert told in capsys.readouterr().out


def test_other_orders_of_dimensions_are_compared_alike(good: Path, tmp_path: Path) -> None:
    path = saved(good, tmp_path / "c.nc", lambda cube: cube.transpose("x", "y", "creepage", "modulus", ...))
    assert run("compare", path, path) == 0
    assert run("compare", path, saved(path, tmp_path / "d.nc", scaled)) == 1


def test_an_axis_that_a_selection_removed_is_told(
    good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("show", saved(good, tmp_path / "c.nc", lambda cube: cube.isel(modulus=0))) == 2
    words = "grid tiny: modulus is no dimension any more; a list of one value keeps it: ds.sel(modulus=[...])\n"
    assert capsys.readouterr().err.endswith(words)


@pytest.mark.parametrize(
    "cut",
    [
        lambda cube: cube.isel(y=slice(None, None, -1)),
        lambda cube: xr.concat([cube, cube.assign_coords(x=1.1 * cube.x)], dim="modulus", join="outer"),
        lambda cube: cube.isel(x=[0, 1, 3, 4]),
    ],
)
def test_cells_that_do_not_ascend_evenly_are_refused(
    good: Path, tmp_path: Path, cut: Cut, capsys: pytest.CaptureFixture[str]
) -> None:
    """Maps of joined windows were combs, and those of y turned round "a mistake in rcstudy itself"."""
    path = saved(good, tmp_path / "c.nc", lambda cube: cut(cube.drop_vars("state")))
    assert run("figures", path, "-o", tmp_path / "f") == 2
    assert " does not ascend in equal steps, as where cubes of different cells" in capsys.readouterr().err


def test_cropped_cubes_are_joined_with_zeros(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without these all maps were drawn in one colour."""
    with xr.open_dataset(good) as cube:
        one, other = cube.load().isel(modulus=[0], x=slice(8, 24), y=slice(6, 18)), cube.isel(modulus=slice(1, None))
        zeros = {name: 0 for name in one.data_vars if "x" in one[name].dims}
        assert zeros
        whole = xr.concat([one, other], dim="modulus", join="outer", fill_value=zeros)
        xr.concat([one, other], dim="modulus", join="outer").drop_vars("state").to_netcdf(tmp_path / "holes.nc")
        xr.testing.assert_equal(whole.pressure > 0.0, cube.pressure > 0.0)
        whole.to_netcdf(tmp_path / "whole.nc")
    assert run("figures", tmp_path / "holes.nc", "-o", tmp_path / "f") == 2
    assert "has cells without a value: if cubes cropped" in capsys.readouterr().err
    assert run("compare", tmp_path / "whole.nc", good) == 0
    assert run("figures", tmp_path / "whole.nc", "-o", tmp_path / "f", "--formats", "png") == 0


def test_a_dimension_that_is_gone_is_told(good: Path, tmp_path: Path) -> None:
    shutil.copy(good, tmp_path / "c.nc")
    with h5py.File(tmp_path / "c.nc", "r+") as file:
        del file["creepage"]
    with pytest.raises(UserError, match=r"not a readable rcstudy cube: damaged: a dimension of it may be missing$"):
        open_cube(tmp_path / "c.nc")


def test_damage_is_told_in_words_of_cubes(
    good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not by what Python calls it."""
    monkeypatch.chdir(tmp_path)
    for name, told in (
        ("grid", "c.nc: not a whole rcstudy cube: it has no attribute grid\n"),
        ("axes", "c.nc: not a whole rcstudy cube: it has no grids, or grids without labels of cases\n"),
        ("label", "c.nc: not a whole rcstudy cube: it has no grids, or grids without labels of cases\n"),
        ("status", "c.nc: damaged, or not as rcstudy writes cubes: 99 is no status of a case\n"),
    ):
        shutil.copy(good, "c.nc")
        with h5py.File("c.nc", "r+") as file:
            if name in ("grid", "axes"):
                del file.attrs[name]
            elif name == "label":
                del file["label"]
            else:
                file["status"][...] = 99
        assert run("show", "c.nc") == 2
        assert capsys.readouterr().err.endswith(told)


def test_where_a_mistake_may_be_our_own_is_told(
    good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a cube without a fault nothing but damage was told, and not where; one with another number is at fault."""

    def mistaken(*_: object) -> None:
        raise IndexError("string index out of range")

    monkeypatch.setattr(overview, "_label_axis", mistaken)
    path = tmp_path / "c.nc"
    shutil.copy(good, path)
    words = f"{path}: damaged, or not as rcstudy writes cubes"
    place = r", or a mistake in rcstudy itself \(report/overview\.py, line \d+\)"
    what = ": IndexError: string index out of range"
    for found in (place, ""):
        assert run("figures", path, "-o", tmp_path / "f") == 2
        said = capsys.readouterr().err.splitlines()[-1]  # the first tells the checksum
        assert re.fullmatch(re.escape(words) + found + re.escape(what), said)
        with h5py.File(path, "r+") as file:
            file["force_x"][...] *= 2.0


def damage_a_field(good: Path, path: Path, name: str) -> None:
    """A copy of a cube in which a field of its first case cannot be decompressed."""
    content = bytearray(good.read_bytes())
    with h5py.File(good) as file:
        stored = file[name].id.get_chunk_info(0)
    for at in range(stored.byte_offset + 10, stored.byte_offset + stored.size - 4):
        content[at] ^= 0x55
    path.write_bytes(content)


def test_a_damaged_field_is_found_by_show_and_solved_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """`show` was content, and so was a sweep with nothing left to solve, which left it."""
    monkeypatch.chdir(tmp_path)
    Path("s.yaml").write_text(f"{BASE}  g:\n    axes: {{load: [50, 100], creepage: [{{longitudinal: 0.001}}]}}\n")
    assert run("sweep", "s.yaml", "--workers", 1) == 0
    assert run("show", "s.nc") == 0
    assert "fields      not read: show --check reads them all" in capsys.readouterr().out
    assert run("show", "s.nc", "--check") == 0
    assert "fields      read, none is damaged" in capsys.readouterr().out
    Path("s.nc").rename("good.nc")
    damage_a_field(Path("good.nc"), Path("s.nc"), "slip_x")
    assert run("show", "s.nc", "--check") == 2
    said = capsys.readouterr().err.splitlines()
    assert said[:2] == ["s.nc: damaged, cannot be read:", "  slip_x [g: load=50, creepage=a]"]
    assert run("sweep", "s.yaml", "--workers", 1) == 0
    assert run("show", "s.nc", "--check") == 2
    with Path("s.yaml").open("a") as file:
        file.write("# as the message says\n")
    assert run("sweep", "s.yaml", "--workers", 1) == 0
    assert "s.nc: 1 of its cases are damaged and solved again" in capsys.readouterr().err
    assert run("show", "s.nc", "--check") == 0
    assert run("compare", "s.nc", "good.nc") == 0


def test_the_cube_that_is_damaged_is_told_of_two(
    good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One or the other was."""
    path = tmp_path / "c.nc"
    damage_a_field(good, path, "pressure")
    for cubes in ((path, good), (good, path), (path, path)):
        assert run("compare", *cubes) == 2
        said = capsys.readouterr().err
        assert said.startswith(f"{path}: pressure [tiny: modulus=")
        assert "damaged" in said


def test_cubes_hold_nothing_foreign(good: Path, tmp_path: Path) -> None:
    assert foreign_content(good) == ""
    write(tmp_path / "several.nc", synthetic.several())
    assert foreign_content(tmp_path / "several.nc") == ""


def heaps(cube: bytes) -> list[int]:
    """Where the global heaps of a cube are."""
    return [found.start() for found in re.finditer(b"GCOL\x01", cube)]


def test_zeros_among_texts_are_damage(good: Path, tmp_path: Path) -> None:
    """The HDF5 library never ended at an object without size, and no signal but SIGKILL ended the process."""
    whole = good.read_bytes()
    assert len(heaps(whole)) > 1
    for number, heap in enumerate(heaps(whole)):
        path = tmp_path / f"{number}.nc"  # a name of its own: HDF5 may keep a damaged file open and locked
        length = int.from_bytes(whole[heap + 24 : heap + 32], "little")  # of the first text
        second = heap + 32 + -(-length // 8) * 8
        path.write_bytes(whole[:second] + bytes(16) + whole[second + 16 :])
        with pytest.raises(OSError, match="damaged"):
            foreign_content(path)
        with pytest.raises(UserError, match="not a readable rcstudy cube: it is no file of HDF5, or damaged"):
            open_cube(path)
        assert other_study(path, "of another name") is None  # so that it may be replaced
        with pytest.raises(ValueError, match="damaged"):
            EarlierCube(path)  # no case is taken from it


@pytest.mark.parametrize(
    ("size", "damaged"),
    [(4096, False), (4095, True), (4104, True), (2**40, True), (15, True), (0, True)],
)
def test_heaps_have_an_end(tmp_path: Path, size: int, damaged: bool) -> None:
    """A heap of an object of 3 bytes, which take up 8, an empty one, and what is free; its size may be another."""
    objects = struct.pack("<HHIQ8s", 1, 1, 0, 3, b"abc") + struct.pack("<HHIQ", 2, 1, 0, 0)
    head = b"GCOL\x01\0\0\0"
    heap = head + struct.pack("<Q", size) + objects + struct.pack("<HHIQ", 0, 0, 0, 4040)
    path = tmp_path / "heaps"
    for before in (b"", b"some " + head + bytes(3), head[:4] + bytes(4)):  # no heaps: at no multiple of 8, no version
        path.write_bytes(before + heap + bytes(4096 - len(heap)))
        assert damaged_heap(path, []) == damaged
        # data of variables are none, whatever they look like
        assert not damaged_heap(path, [(0, 100), (len(before), 4096)])


def test_file_systems_without_memory_maps_have_cubes(good: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(errno.ENODEV, "No such device")

    monkeypatch.setattr("mmap.mmap", refuse)
    assert foreign_content(good) == ""


@pytest.mark.parametrize("name", ["../../x", "/tmp/x", "a/b", "", "x\n", "x" * 65, "pressure"])
def test_names_of_grids_lead_nowhere(good: Path, tmp_path: Path, name: str) -> None:
    """They are part of the names of figures."""
    path = tmp_path / "c.nc"
    shutil.copy(good, path)
    with h5py.File(path, "r+") as file:
        file.attrs["grid"] = name
    assert run("figures", path, "-o", tmp_path / "deep" / "figures") == 2
    with pytest.raises(UserError, match=r"a grid's name|another name, as the cube has its own pressure"):
        open_cube(path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["c.nc"]


def test_studies_of_failed_cases_hold_nothing_of_the_cube_but_the_case(tmp_path: Path) -> None:
    """What a hostile cube is called, and why its cases failed, becomes neither a path nor a key."""
    text = (
        "study: s\nscene: {substrate: {E: 1000, nu: 0.3}, radius: 50, load: 1, mesh: {size: [2, 2], cells: [8, 8]}}\n"
    )
    (tmp_path / "s.yaml").write_text(text + "grids: {g: {cases: [{label: a}]}}\n")
    study = load_study(tmp_path / "s.yaml")
    refused = Result(Status.REFUSED, "why\nscene: {load: 2}\x85grids: 1\u2028study: 2")
    path = tmp_path / "c.nc"
    write_cube(path, study, expand(study), [(expand(study).cases[0], refused)], {})
    with h5py.File(path, "r+") as file:
        file.attrs["study"] = "../../x\nscene: {load: 2}"
    assert run("failures", path, "-o", tmp_path / "studies") == 0
    (written,) = (tmp_path / "studies").iterdir()
    assert load_study(written).size == 1
    assert expand(load_study(written)).cases[0].scene == expand(study).cases[0].scene


@pytest.mark.parametrize(
    ("name", "how", "said"),
    [
        ("force_x", {"data": np.array([[b"a", b"b", b"c"]] * 2)}, "force_x is of type"),
        ("force_x", {"data": np.zeros((2, 3), dtype="i4")}, "force_x is of type int32"),
        ("force_x", {"data": np.zeros((3, 2))}, "force_x has other dimensions than modulus, creepage"),
        ("status", {"data": np.zeros((2, 3))}, "status is of type float64"),
        ("label", {"data": np.zeros(5)}, "its cases have no labels"),
        ("pressure", {"data": np.zeros((2, 3))}, "pressure has other dimensions than modulus, creepage, x, y"),
    ],
)
def test_variables_that_are_not_what_they_are_called(
    good: Path, tmp_path: Path, name: str, how: dict[str, object], said: str
) -> None:
    path = tmp_path / "c.nc"
    shutil.copy(good, path)
    with h5py.File(path, "r+") as file:
        replaced(file, name, **how)
        if file[name].shape == (2, 3):
            for axis, dim in enumerate(("modulus", "creepage")):
                file[name].dims[axis].attach_scale(file[dim])
    with pytest.raises(UserError, match="not an rcstudy cube: grid tiny: ") as error:
        open_cube(path)
    assert said in str(error.value)


@pytest.mark.parametrize(("cells", "said"), [(4096, ""), (4097, "more than 4096 cells")])
def test_no_cube_has_more_cells_than_a_study_may_ask_for(cells: int, said: str) -> None:
    fields = xr.Dataset({"label": ("case", ["a"])}, {"x": np.arange(cells, dtype=float)}, {"axes": "case"})
    assert cube._problem_of_grid("g", fields) == said


ATTRIBUTES: list[object] = [
    "",
    "x",
    "../x",
    -1,
    1e400,
    b"\xff",
    np.zeros(3),
    "days since 0",
    "axes",
    "{}",
    "[" * 9999,
]


@settings(
    max_examples=25, deadline=None, phases=[Phase.generate], derandomize=True, suppress_health_check=list(HealthCheck)
)
@given(data=st.data())
def test_mutated_cubes(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], data: st.DataObject) -> None:
    """Variables gone, of another type or size, attributes gone or changed, the end missing.

    Not single bytes: the HDF5 library itself does not survive that at all times.
    """
    # a name of its own: HDF5 may keep a damaged file open and locked
    folder = Path(tempfile.mkdtemp(dir=tmp_path))
    path = folder / "c.nc"
    shutil.copy(good, path)
    kind = data.draw(st.sampled_from(["drop", "type", "shape", "values", "attribute", "no attribute", "cut"]))
    if kind == "cut":
        content = path.read_bytes()
        path.write_bytes(content[: data.draw(st.integers(0, len(content) - 1))])
    else:
        with h5py.File(path, "r+") as file:
            name = data.draw(st.sampled_from(sorted(file)))
            shape = file[name].shape
            if kind == "drop":
                del file[name]
            elif kind == "type":
                dtype = data.draw(st.sampled_from(["f4", "i8", "u1", "S5", h5py.string_dtype(), "i1"]))
                replaced(file, name, shape=shape, dtype=dtype)
            elif kind == "shape":
                shape = data.draw(st.sampled_from([(), (1,), (0,), (2, 3), (7,), (2, 3, 4, 5, 6)]))
                replaced(file, name, shape=shape, dtype="f8")
            elif kind == "values":
                bad = data.draw(st.sampled_from([np.nan, np.inf, -1e308, 117, -5]))
                if file[name].dtype.kind in "fi":
                    file[name][...] = bad if file[name].dtype.kind == "f" or abs(bad) < 128 else 127
            else:
                owner = data.draw(st.sampled_from([file, file[name]]))
                if owner.attrs:
                    attribute = data.draw(st.sampled_from(sorted(owner.attrs)))
                    del owner.attrs[attribute]
                    if kind == "attribute":
                        owner.attrs[attribute] = data.draw(st.sampled_from(ATTRIBUTES))
    commands: tuple[list[object], ...] = (
        ["show", path],
        ["compare", path, good],
        ["compare", good, path],
        ["failures", path],
        ["tables", path, "-o", folder / "tables"],
    )
    for command in data.draw(st.permutations(commands))[:2]:
        code = run(*command)
        said = capsys.readouterr()
        assert code in ((0, 1, 2) if command[0] == "compare" else (0, 2)), command
        assert "Traceback" not in said.out + said.err
        assert code != 2 or str(path) in said.err
    assert {entry.name for entry in folder.iterdir()} <= {"c.nc", "tables"}


def test_fields_of_many_unsolved_cases_take_no_room(tmp_path: Path) -> None:
    """21 MB of each field are declared, and none stored: this is no sign of a hostile cube."""
    scene = replace(synthetic.SCENE, mesh=Mesh((2.0, 2.0), (256, 256)), creepage=None)
    grid = synthetic.make_grid("g", synthetic.number_axis("load", [float(n) for n in range(1, 42)], "N"))
    cases = synthetic.grid_cases(grid, scene)
    failing = {case.key: Status.REFUSED for case in cases}
    made = synthetic.assemble(synthetic.make_study(), (grid, cases), failing=failing)
    with open_cube(synthetic.write(tmp_path / "c.nc", made)) as tree:
        assert tree.to_dataset().pressure.nbytes > 21e6


def test_the_netcdf_library_reads_no_cube_that_others_signed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = synthetic.write(tmp_path / "own.nc", synthetic.small())
    with xr.open_dataset(path) as own:
        own.load().to_netcdf(tmp_path / "saved.nc", engine="h5netcdf")
    opened, engines = xr.open_datatree, []

    def noted(path: Path, engine: Any = None, **how: Any) -> xr.DataTree:
        engines.append(engine)
        return opened(path, engine=engine, **how)

    monkeypatch.setattr(xr, "open_datatree", noted)
    for name in ("own", "saved"):
        with open_cube(tmp_path / f"{name}.nc"):
            pass
    assert engines == [engine(path), "h5netcdf"]


def test_heaps_are_sought_outside_of_chunks_whatever_their_order() -> None:
    data = bytearray(5 * 4096)
    for at in (256, 8192, 12288 + 8):  # the first one is of a chunk's numbers
        data[at : at + len(_HEAD)] = _HEAD
    chunks = [(16384, 4096), (0, 4096)]
    for order in (chunks, chunks[::-1]):
        assert list(_heaps(bytes(data), order)) == [8192, 12296]  # type: ignore[arg-type]
