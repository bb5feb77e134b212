"""A cube in words."""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import h5py
import numpy as np
import pytest
import synthetic
from studies import BASE, load_text
from typer.testing import CliRunner

from rcstudy import check, cli
from rcstudy.check import _cells_among
from rcstudy.cube import grids as grids_of
from rcstudy.cube import open_cube
from rcstudy.errors import EXIT_BAD_INPUT
from rcstudy.mechanics.scene import Scene
from rcstudy.result import Result, Status
from rcstudy.show import summary
from rcstudy.solve import solve_group
from rcstudy.sweep import run


def shown(folder: Path, grids: str, **options: object) -> list[str]:
    """Lines of the summary of a study's cube; `grids` under the shared scene."""
    run(load_text(folder, BASE + grids), folder / "s.nc", workers=1, **options)  # type: ignore[arg-type]
    with open_cube(folder / "s.nc") as tree:
        return summary(tree).splitlines()


def line(lines: list[str], word: str) -> str:
    """The one line that begins with a word, its spaces made single."""
    (found,) = [text for text in lines if text.split()[:1] == [word]]
    return " ".join(found.split())


def test_cells_where_the_mesh_varies(tmp_path: Path) -> None:
    lines = shown(tmp_path, "  g: {axes: {mesh.cells: [[24, 16], [32, 32]]}}\n")
    assert line(lines, "g:") == "g: cells 2; 24 x 16 and 32 x 32 cells"


def test_cells_of_many_meshes_are_a_range(tmp_path: Path) -> None:
    lines = shown(tmp_path, "  g: {axes: {mesh.cells: [[24, 16], [20, 20], [16, 16], [26, 16], [28, 24]]}}\n")
    assert line(lines, "g:") == "g: cells 5; 16 x 16 to 28 x 24 cells"


def test_cells_of_fitted_windows(tmp_path: Path) -> None:
    lines = shown(tmp_path, "  g: {scene: {mesh: {size: auto}}, axes: {load: [100, 200]}}\n")
    assert line(lines, "g:") == "g: load 2; 32 x 32 cells"


def test_cells_are_those_of_the_mesh_where_less_is_stored(tmp_path: Path) -> None:
    """A cube that is cropped to its contacts showed the box as the mesh."""
    crop = BASE.replace("grids:", "outputs: {crop: contact}\ngrids:")
    grids = "  g: {axes: {load: [50, 100]}}\n  h: {axes: {mesh.cells: [[24, 16], [32, 28]]}}\n"
    run(load_text(tmp_path, crop + grids), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree:
        lines = summary(tree).splitlines()
        sizes = {name: f"{grid.sizes['x']} x {grid.sizes['y']}" for name, grid in grids_of(tree).items()}
    assert sizes["g"] != "32 x 32"
    assert line(lines, "g:") == f"g: load 2; 32 x 32 cells, {sizes['g']} of them stored"
    assert line(lines, "h:").startswith("h: cells 2; 24 x 16 and 32 x 28 cells, ")


def test_cells_of_listed_cases_where_less_is_stored(tmp_path: Path) -> None:
    """A case that gives the window's size alone had the stored cells taken for the mesh of all."""
    text = BASE.replace("grids:", "outputs: {crop: contact}\ngrids:")
    text += "  g: {cases: [{label: a, load: 80}, {label: b, mesh: {size: [2.5, 2.5]}}]}\n"
    run(load_text(tmp_path, text), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree:
        lines = summary(tree).splitlines()
    assert re.fullmatch(r"g: case 2; 32 x 32 cells, \d+ x \d+ and \d+ x \d+ of them stored", line(lines, "g:"))


def test_relative_axes_say_over_what(tmp_path: Path) -> None:
    lines = shown(
        tmp_path,
        "  g: {axes: {load: [50, 100], thickness: [0.25 a, 0.5 a], modulus: [1 Es, 2 Es], mesh.margin: [1.3, 1.5]}}\n"
        "  h: {coating: {modulus: 2 Es, thickness: 0.1 a}, axes: {substrate.E: [2e5, 1e5], layer_count: [1, 2]}}\n",
    )
    assert line(lines, "thickness") == "thickness 0.25, 0.5 a"
    assert line(lines, "modulus") == "modulus 210000, 420000 MPa"
    assert line(lines, "load") == "load 50, 100 N"
    assert line(lines, "margin") == "margin 1.3, 1.5"
    assert line(lines, "layer_count") == "layer_count 1, 2"


def test_pairs_have_the_unit_of_their_numbers(tmp_path: Path) -> None:
    lines = shown(
        tmp_path,
        "  g: {axes: {radius: [50, [40, 50]], mesh.cells: [[24, 16], [32, 32]]}}\n"
        "  h: {axes: {mesh.size: [[2, 2], [1.5, 2]]}}\n"
        "  i: {axes: {mesh.size: [[2, 2], ['9 a', 2]]}}\n",
    )
    assert line(lines, "radius") == "radius 50, 40 x 50 mm"
    assert line(lines, "cells") == "cells 24 x 16, 32 x 32"
    sizes = [" ".join(text.split()) for text in lines if text.split()[:1] == ["size"]]
    assert sizes == ["size 2 x 2, 1.5 x 2 mm", "size 2 x 2, 9 a x 2"]


def test_descriptions_of_several_lines(tmp_path: Path) -> None:
    """The first line alone was moved to the right, and an empty one followed."""
    grid = "  g:\n    description: |\n      of the grid\n\n      at length\n    axes: {load: [100]}\n"
    run(load_text(tmp_path, f"description: |\n  of it all\n    more\n{BASE}{grid}"), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree:
        lines = summary(tree).splitlines()
    indent = " " * 12
    assert lines[1:4] == [f"{indent}of it all", f"{indent}  more", lines[3]]
    assert lines[3].startswith("created ")
    first = lines.index("g: load 1; 32 x 32 cells")
    assert lines[first + 1 : first + 5] == ["  of the grid", "", "  at length", "  load             100 N"]


def test_rounding_is_shown_as_nothing(tmp_path: Path) -> None:
    """A force that symmetry makes zero, in one case and in all."""
    lines = shown(
        tmp_path,
        "  g: {axes: {creepage: [{label: a, longitudinal: 0.001}, {label: b, lateral: 0.001}]}}\n"
        "  h: {axes: {creepage: [{label: a, longitudinal: 0.001}]}}\n",
        solve=rounded,
    )
    forces = [" ".join(text.partition(", ±")[0].split()) for text in lines if text.split()[:1] == ["force_y"]]
    assert forces == ["force_y -77 to 0 N", "force_y 0 N"]
    # of the scale of moments, friction times load times Hertz's radius of 0.253 mm: 25.3 N mm
    moments = [" ".join(text.partition(", ±")[0].split()) for text in lines if text.split()[:1] == ["moment_z"]]
    assert moments == ["moment_z 0 to 3e-08 N mm", "moment_z 0 N mm"]


def test_small_loads_have_forces_too(tmp_path: Path) -> None:
    """Forces of 0.0009 N were shown as nothing beside those under a load of 1e6 N."""
    axes = "load: [0.001, 1.0e+6], mesh.size: [[4 a, 4 a]], creepage: [{lateral: 0.001}]"
    lines = shown(tmp_path, f"  g: {{axes: {{{axes}}}}}\n", solve=of_load)
    assert line(lines, "force_y").startswith("force_y -5e+05 to -0.0005 N")
    assert line(lines, "moment_z").startswith("moment_z 0 N mm")


def test_labels_with_commas_are_told_apart(tmp_path: Path) -> None:
    """Two labels read as three."""
    stack = "[{E: 1 Es, nu: 0.3, thickness: 1 a}]"
    sets = f"[{{label: 'soft, thick', layers: {stack}}}, {{label: bare, layers: []}}]"
    lines = shown(tmp_path, f"  g: {{axes: {{layers: {sets}, load: [50, 60]}}}}\n")
    assert line(lines, "layers") == "layers soft, thick; bare"
    assert line(lines, "load").startswith("load 50, 60")


def of_load(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Results whose lateral force is half of the load; moments are rounding."""
    for scene, result in zip(scenes, solve_group(scenes), strict=True):
        result.scalars["force_y"] = -0.5 * scene.load
        result.scalars["moment_z"] = 1e-15 * scene.load
        yield result


def test_numbers_that_are_written_alike_are_no_range(tmp_path: Path) -> None:
    """-30 to -30 N, it said."""
    lines = shown(tmp_path, "  g: {axes: {load: [100, 100.0001, 100.0002]}}\n", solve=as_large_as_loads)
    assert line(lines, "pressure_max") == "pressure_max 100 MPa"


def rounded(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Results whose lateral force and moment are rounding wherever there is no lateral creepage."""
    for scene, result in zip(scenes, solve_group(scenes), strict=True):
        lateral = scene.creepage and scene.creepage.lateral
        result.scalars["force_y"] = -77.0 if lateral else -1.3e-15
        result.scalars["moment_z"] = 3e-8 if lateral else 2e-8
        yield result


@pytest.mark.parametrize(("count", "words"), [(1, "1 case is not solved:"), (2, "2 cases are not solved:")])
def test_failures_are_counted(tmp_path: Path, count: int, words: str) -> None:
    lines = shown(tmp_path, f"  g: {{axes: {{load: {[50, 60][:count]}}}}}\n", solve=failing)
    assert words in lines


def test_ten_failures_are_told_and_how_many_more_there_are(tmp_path: Path) -> None:
    lines = shown(tmp_path, "  g: {axes: {load: {first: 50, last: 61, count: 12}}}\n", solve=failing)
    told = lines[lines.index("12 cases are not solved:") + 1 :]
    assert [one.strip() for one in told[9:]] == ["g: load=59: not converged: out of patience", "2 more"]


def test_numbers_are_of_solved_cases_and_proofs_the_worst(tmp_path: Path) -> None:
    lines = shown(tmp_path, "  g: {axes: {load: [50, 100, 70, 200]}}\n", solve=as_large_as_loads)
    assert line(lines, "pressure_max") == "pressure_max 50 to 100 MPa"
    assert line(lines, "proof_load") == "proof_load 1.0e-07 g: load=100"


def as_large_as_loads(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Numbers in proportion to the load; above 100 N nothing is solved."""
    for scene in scenes:
        status = Status.SOLVED if scene.load <= 100.0 else Status.NOT_CONVERGED
        yield Result(status, "", {"pressure_max": scene.load, "proof_load": 1e-9 * scene.load})


def failing(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Nothing is solved."""
    for _ in scenes:
        yield Result(Status.NOT_CONVERGED, "out of patience")


@pytest.mark.parametrize(
    ("command", "change"),
    [("show", "number"), ("show", "status"), ("show", "key"), ("compare", "key"), ("tables", "number")],
)
def test_changed_numbers_are_told(tmp_path: Path, command: str, change: str) -> None:
    """By the checksum of each grid, where there are several; the cube as it was written is told nothing of."""
    path = synthetic.write(tmp_path / "c.nc", synthetic.several())
    words = [command, str(path), *([str(path)] if command == "compare" else [])]
    words += ["-o", str(tmp_path / "out")] if command == "tables" else []
    assert "checksum" not in CliRunner().invoke(cli.app, words).output
    with open_cube(path) as tree:
        name = list(grids_of(tree))[1]
    with h5py.File(path, "r+") as file:
        dataset = file[name][{"number": "pressure_max", "status": "status", "key": "case_key"}[change]]
        first = (0,) * len(dataset.shape)
        dataset[first] = {"number": 1e300, "status": 1, "key": "0" * 64}[change]
    told = CliRunner().invoke(cli.app, words).output
    assert f"{path}: grid {name}: checksum mismatch: its numbers were changed after writing" in told


def remove(*names: str) -> Callable[[h5py.File], None]:
    """Damage: variables or groups are gone."""

    def damage(file: h5py.File) -> None:
        for name in names:
            del file[name]

    return damage


def change(name: str, value: object, place: int = 0) -> Callable[[h5py.File], None]:
    """Damage: the first value of a variable, or that at `place` along each dimension, is another."""

    def damage(file: h5py.File) -> None:
        file[name][(place,) * file[name].ndim] = value

    return damage


def change_text(file: h5py.File) -> None:
    """Damage: the study's text is another."""
    file.attrs["study_text"] = file.attrs["study_text"].replace("load: 100", "load: 200")


def describe(name: str, attribute: str, value: str | None) -> Callable[[h5py.File], None]:
    """Damage: an attribute is another, or missing."""

    def damage(file: h5py.File) -> None:
        if value is None:
            del file[name].attrs[attribute]
        else:
            file[name].attrs[attribute] = value

    return damage


CHECKED = (
    BASE
    + """\
  g: {axes: {load: [50, 100], creepage: [{label: a, longitudinal: 0.001}]}}
  h: {coating: {thickness: 0.5 a}, axes: {modulus: [0.5 Es, 2 Es]}}
"""
)


@pytest.fixture(scope="module")
def checked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cube of two grids."""
    folder = tmp_path_factory.mktemp("checked")
    run(load_text(folder, CHECKED), folder / "s.nc", workers=1)
    return folder / "s.nc"


TABLE, SUM = "table of all cases: ", "checksum mismatch: its numbers were changed after writing"
UNCHECKED = "missing: what depends on its study is not checked"
LIKE, STATED = "not as in the grids, changed after writing", "not as its study states, changed after writing"


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (change("force_x", 5.0), [f"{TABLE}force_x: {LIKE}"]),
        (change("status", 1), [f"{TABLE}status: {LIKE}"]),
        (change("label", "x"), [f"{TABLE}label: {LIKE}"]),
        (change("grid", "x"), [f"{TABLE}grid: {LIKE}"]),
        (remove("force_x"), [f"{TABLE}force_x: {LIKE}", f"{TABLE}force_x: missing"]),
        (remove("h"), [f"{TABLE}grid: {LIKE}", "grid h: missing"]),
        (change("g/force_x", 5.0), [f"grid g: {SUM}", f"{TABLE}force_x: {LIKE}"]),
        (remove("g/force_x"), [f"grid g: {SUM}", "grid g: force_x: missing"]),
        (remove("g/slip_x", "g/state"), ["grid g: slip_x, state: missing"]),
        (remove("h/pressure"), ["grid h: pressure: missing"]),
        (change("g/friction", 5.0), [f"{TABLE}friction: {LIKE}", f"grid g: friction: {STATED}"]),
        (change("h/layer_modulus", 5.0), [f"grid h: layer_modulus: {STATED}"]),
        (change("g/x", 5.0), [f"grid g: x: {STATED}"]),
        (change("g/y", math.nan), [f"grid g: y: {STATED}"]),
        (change("g/y", math.nan, -1), [f"grid g: y: {STATED}"]),
        (change("g/label", "x"), [f"{TABLE}label: {LIKE}", f"grid g: label: {STATED}"]),
        (change("g/creepage", "x"), [f"grid g: creepage: {STATED}"]),
        (change_text, ["the text of its study was changed after writing"]),
        (describe("/", "study_text", None), [f"attributes study_text: {UNCHECKED}"]),
        (describe("/", "study", None), [f"attributes study: {UNCHECKED}"]),
        (describe("/", "study", "another"), [f"attributes study: {STATED}"]),
        (describe("g/force_x", "units", "kN"), ["grid g: units of force_x: changed after writing"]),
        (describe("h/modulus", "units", None), ["grid h: units of modulus: changed after writing"]),
        (describe("force_x", "units", "kN"), [f"{TABLE}units of force_x: changed after writing"]),
        (describe("g/state", "flag_meanings", "a b"), ["grid g: flag_meanings of state: changed after writing"]),
    ],
)
def test_damage_that_can_be_read(
    checked: Path, tmp_path: Path, damage: Callable[[h5py.File], None], told: list[str]
) -> None:
    """Of the table of all cases nothing was said, and the code was 0 for what was told."""
    path = shutil.copy(checked, tmp_path / "c.nc")
    with h5py.File(path, "r+") as file:
        damage(file)
    found = CliRunner().invoke(cli.app, ["show", str(path), "--check"])
    *lines, repair = found.stderr.splitlines()
    assert found.exit_code == EXIT_BAD_INPUT
    assert lines == [f"{path}: {line}" for line in told]
    again = "solves all cases again" if SUM in found.stderr else "writes the cube again"
    if f"attributes study: {UNCHECKED}" in told:
        again = "does not replace a cube that names no study"
    assert repair.startswith(f"rcstudy sweep {again}")


@pytest.mark.parametrize(
    ("name", "place", "value"),
    [("x_centre", (0, 0), 5.0), ("x_centre", (1, -1), math.nan), ("y_centre", (0, 0, -1), math.nan)],
)
def test_centres_of_cells_of_several_meshes(tmp_path: Path, name: str, place: tuple[int, ...], value: float) -> None:
    """Those of smaller windows end in nan, the same for all cases with such a window."""
    text = BASE + "  g: {axes: {mesh.cells: [[12, 16], [16, 12]], load: [50, 100]}}\n"
    run(load_text(tmp_path, text), tmp_path / "c.nc", workers=1)
    show = ["show", str(tmp_path / "c.nc"), "--check"]
    assert CliRunner().invoke(cli.app, show).exit_code == 0
    with h5py.File(tmp_path / "c.nc", "r+") as file:
        file[name][place] = value
    found = CliRunner().invoke(cli.app, show)
    assert (found.exit_code, f"grid g: {name}: {STATED}" in found.stderr) == (EXIT_BAD_INPUT, True)


def test_centres_of_cropped_meshes_that_are_alike_along_one_side(tmp_path: Path) -> None:
    """Their contacts, and so their crops, differ along that side too, which was told as damage."""
    text = BASE.replace("grids:", "outputs: {crop: contact}\ngrids:")
    text += "  g: {axes: {mesh.cells: [[128, 8], [128, 64]], load: [50, 100]}}\n"
    run(load_text(tmp_path, text), tmp_path / "c.nc", workers=1)
    show = ["show", str(tmp_path / "c.nc"), "--check"]
    found = CliRunner().invoke(cli.app, show)
    assert (found.exit_code, found.stderr) == (0, "")
    with h5py.File(tmp_path / "c.nc", "r+") as file:
        coarse, fine = file["x_centre"][0, 0], file["x_centre"][1, 0]
        assert np.count_nonzero(np.isfinite(coarse)) < fine.size
        file["x_centre"][1, 1] += fine[1] - fine[0]  # neighbours still, but not those of the other case
    found = CliRunner().invoke(cli.app, show)
    assert (found.exit_code, f"grid g: x_centre: {STATED}" in found.stderr) == (EXIT_BAD_INPUT, True)


@pytest.mark.parametrize("name", ["label", "case"])
def test_labels_of_a_single_grid(tmp_path: Path, name: str) -> None:
    """No checksum holds them, and no table repeats them: they passed."""
    path = tmp_path / "c.nc"
    run(load_text(tmp_path, BASE + "  g: {cases: [{label: light, load: 50}, {label: heavy}]}\n"), path, workers=1)
    show = ["show", str(path), "--check"]
    assert CliRunner().invoke(cli.app, show).exit_code == 0
    with h5py.File(path, "r+") as file:
        assert file[name][0] == b"light"
        file[name][0] = "heavy"
    found = CliRunner().invoke(cli.app, show)
    assert found.exit_code == EXIT_BAD_INPUT
    assert found.stderr.splitlines()[0] == f"{path}: grid g: {name}: {STATED}"


def test_a_changed_table_is_repaired_by_a_sweep(checked: Path, tmp_path: Path) -> None:
    """As the message says: from the cube's own cases, once the study is edited."""
    path = shutil.copy(checked, tmp_path / "c.nc")
    with h5py.File(path, "r+") as file:
        file["force_x"][0] = 5.0
    study = load_text(tmp_path, CHECKED + "# edited\n")
    assert run(study, path, workers=1).kept == 4
    assert CliRunner().invoke(cli.app, ["show", str(path), "--check"]).exit_code == 0


def test_a_cube_as_it_was_written_has_no_damage(checked: Path) -> None:
    found = CliRunner().invoke(cli.app, ["show", str(checked), "--check"])
    assert (found.exit_code, found.stderr) == (0, "")
    assert "read, none is damaged" in found.stdout


def test_figures_and_tables_of_changed_numbers_come_with_a_warning(checked: Path, tmp_path: Path) -> None:
    """The altered number is in the table, and the code is 0."""
    path = shutil.copy(checked, tmp_path / "c.nc")
    with h5py.File(path, "r+") as file:
        file["g/force_x"][0, 0] = 123.456
    found = CliRunner().invoke(cli.app, ["tables", str(path), "-o", str(tmp_path / "t")])
    assert found.exit_code == 0
    assert f"{path}: grid g: {SUM}" in found.stderr
    assert any("123.4" in table.read_text() for table in (tmp_path / "t").glob("*.csv"))


@pytest.mark.parametrize(
    ("starts", "counts", "meshes", "among"),
    [
        ((2, 2), (4, 4), "aa", True),
        ((2, 3), (4, 4), "aa", False),  # of one mesh the same cells are stored
        ((2, 3), (4, 4), "ab", True),
        ((2, 3), (4, 3), "ab", True),
        ((2, 3), (3, 3), "ab", False),  # nothing is at the last place
    ],
)
def test_cells_that_are_stored_are_neighbours(
    starts: Sequence[int], counts: Sequence[int], meshes: str, among: bool
) -> None:
    whole = np.tile(np.arange(8.0), (2, 1))
    stored = np.full((2, 4), np.nan)
    for row, start, count in zip(stored, starts, counts, strict=True):
        row[:count] = np.arange(start, start + count)
    assert _cells_among(stored, whole, [mesh.encode() for mesh in meshes], 1e-12) == among
    assert not _cells_among(stored[:1], whole, [b"a"], 1e-12)
    assert not _cells_among(stored.astype(str), whole, [b"a", b"b"], 1e-12)
    assert not _cells_among(stored[:, :0], whole, [b"a", b"b"], 1e-12)


@pytest.mark.parametrize(("faults", "shown", "rest"), [(20, 20, []), (22, 20, ["  2 more"])])
def test_twenty_faults_are_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, faults: int, shown: int, rest: list[str]
) -> None:
    path = synthetic.write(tmp_path / "c.nc", synthetic.small())
    monkeypatch.setattr(check, "illegible", lambda path: [f"field {k}" for k in range(faults)])
    with open_cube(path) as tree:
        lines = check.damage(path, tree, [])
    first = lines.index(f"{path}: damaged, cannot be read:") + 1
    assert lines[first:-1] == [f"  field {k}" for k in range(shown)] + rest
