"""Errors against converged references: numbers checked apart from the code that reports them."""

import csv
import re
import shutil
from dataclasses import asdict, replace
from importlib import import_module
from itertools import pairwise, product
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
import xarray as xr
from contacts import STEEL
from studies import BASE, CONFIGS, load_text
from texts import check_texts
from typer.testing import CliRunner
from workers import made_up

from rcstudy import accuracy, cli, sweep
from rcstudy.cube import open_cube
from rcstudy.errors import UserError
from rcstudy.mechanics.contact import influence_of
from rcstudy.mechanics.scene import Mesh, Scene, Tolerance
from rcstudy.report import precision_summary
from rcstudy.report.precision import QUANTITIES, REFERENCE, BothTolerances, Cells, Row, Setting, schemes, settings
from rcstudy.report.precision_figures import quantities_figure, tolerances_figure, work_precision
from rcstudy.report.precision_summary import errors_table, mesh_table, settings_table, summary_text
from rcstudy.report.style import DPI, style
from rcstudy.result import Result, Status
from rcstudy.solve import solve_scene
from rcstudy.storage.layout import CASE_KEY
from rcstudy.study import load_study

STUDY = """\
study: tiny
scene:
  substrate: {E: 210000, nu: 0.3}
  counterbody: {E: 1 Es, nu: 0.3}
  radius: 50
  load: 100
  creepage: {longitudinal: 0.0006, lateral: 0.0002}
  mesh: {size: [0.8, 0.8], cells: [12, 12]}
grids:
  meshes:
    axes:
      mesh.cells: [[12, 12], [18, 18]]
      tolerance:
        - {label: loose, normal: 1.0e-4, tangential: 1.0e-4}
        - {label: tight, normal: 1.0e-9, tangential: 1.0e-9}
  aligned:
    scene: {discretisation: aligned, tolerance: {normal: 1.0e-9, tangential: 1.0e-9}}
    axes:
      mesh.cells: [[12, 12], [18, 18]]
  finest:
    scene: {discretisation: aligned, mesh: {cells: [24, 24]}, tolerance: {normal: 1.0e-9, tangential: 1.0e-9}}
    axes: {method: [newton]}
  paper_cg:
    scene: {method: paper-cg}
    axes:
      mesh.cells: [[12, 12]]
"""


@pytest.fixture(scope="module")
def reported(tmp_path_factory):
    """Folder of a report, and the study it is of."""
    folder = tmp_path_factory.mktemp("accuracy")
    path = folder / "tiny.yaml"
    path.write_text(STUDY.replace("method: paper-cg}", "method: paper-cg, tolerance: {tangential: 1.0e-2}}"))
    study = load_study(path)
    accuracy.run(study, folder / "report", formats=("png",))
    return study, folder / "report"


@pytest.mark.heavy
def test_errors_are_those_of_solutions_compared_by_hand(reported):
    study, folder = reported
    scenes = {case.scene.mesh.cells[0]: case.scene for case in accuracy.expand(study).cases if case.grid == "meshes"}
    tight = Tolerance(1e-9, 1e-9)
    aligned = replace(scenes[12], tolerance=tight, discretisation="aligned")
    fine, middle = (solve_scene(replace(aligned, mesh=Mesh((0.8, 0.8), (n, n)))) for n in (24, 18))
    own = solve_scene(replace(scenes[12], tolerance=Tolerance(1e-4, 1e-4)))
    same = solve_scene(replace(scenes[12], tolerance=tight))

    def stacked(result):
        return np.stack([result.fields["traction_x"], result.fields["traction_y"]])

    means = stacked(fine).reshape(2, 12, 2, 12, 2).mean(axis=(2, 4))
    force = np.hypot(fine.scalars["force_x"], fine.scalars["force_y"])
    fx, fy = (own.scalars[k] - fine.scalars[k] for k in ("force_x", "force_y"))

    def relative(name, one=own, other=fine):
        return abs(one.scalars[name] / other.scalars[name] - 1.0)

    with xr.open_datatree(folder / "accuracy.nc") as tree:
        case = tree["meshes"].to_dataset().isel(cells=0, tolerance=0).load()
        exact = tree["finest"].to_dataset().load()
    wanted = {
        "error_traction": np.linalg.norm(stacked(own) - means) / np.linalg.norm(means),
        "error_force": np.hypot(fx, fy) / force,
        "error_moment": relative("moment_z"),
        "error_slip_area": relative("slip_area"),
        "error_traction_max": relative("traction_max"),
        "error_friction_power": relative("friction_power"),
        "error_pressure_max": relative("pressure_max"),
        "reference_error_friction_power": relative("friction_power", middle),
        "solver_error_traction": np.linalg.norm(stacked(own) - stacked(same)) / np.linalg.norm(stacked(same)),
    }
    for name, value in wanted.items():
        # the reference's own residual is all that two solves can differ by
        assert float(case[name]) == pytest.approx(value, rel=1e-6, abs=1e-12), name
    assert 0.001 < wanted["error_traction"] < 0.3
    assert 0.0 < wanted["solver_error_traction"] < 1e-2
    assert np.isnan(exact["error_traction"]).all()  # the reference has no error of its own
    assert abs(fine.scalars["moment_z"]) > 0.1  # lateral creepage has a moment, so that there is an error of it
    assert "pressure" not in case  # errors only: the fields stay in the other cube


@pytest.mark.heavy
def test_paper_cg_is_measured_against_newton(reported):
    _, folder = reported
    with xr.open_datatree(folder / "accuracy.nc") as tree:
        own = tree["paper_cg"].to_dataset().load()
    assert float(own["solver_error_traction"].squeeze()) > 0.02
    assert float(own["solver_error_pressure"].squeeze()) < 1e-3
    assert "## Method paper-cg" in (folder / "summary.md").read_text()


@pytest.mark.usefixtures("undrawn")
@pytest.mark.heavy
def test_report_has_every_case_and_a_cube_serves_again(reported, tmp_path):
    study, folder = reported
    with (folder / "errors.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == study.size
    with open_cube(folder / "solutions.nc") as tree:
        written = accuracy.run(study, tmp_path, tree, formats=("png",))
    assert tmp_path / "solutions.nc" not in written
    assert {p.name for p in written} >= {"accuracy.nc", "errors.csv", "settings.md", "work_precision.png", "summary.md"}
    for name in ("errors.csv", "summary.md"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


@pytest.mark.heavy
def test_cube_of_another_study_is_refused(reported, tmp_path):
    _, folder = reported
    path = tmp_path / "other.yaml"
    path.write_text(STUDY.replace("load: 100", "load: 90"))
    with (
        open_cube(folder / "solutions.nc") as tree,
        pytest.raises(UserError, match=r"/solutions\.nc: is not of the study .*other\.yaml as it is now: run without"),
    ):
        accuracy.run(load_study(path), tmp_path / "report", tree)
    assert not (tmp_path / "report").exists()  # an empty folder was left


@pytest.mark.heavy
def test_a_cropped_cube_is_refused(tmp_path: Path) -> None:
    """A report without any error was written, and none of its settings could be chosen.

    As many cells are stored of each mesh as of the finest one, here more than the whole window of the coarser one has.
    """
    grid = "grids:\n  g: {axes: {mesh.cells: [[8, 8], [32, 32]]}}\n"
    study = f"{BASE.partition('grids:')[0]}  creepage: {{longitudinal: 0.001}}\n{grid}"
    cropped = load_text(tmp_path, f"outputs: {{crop: contact}}\n{study}")
    sweep.run(cropped, tmp_path / "c.nc", workers=1)
    whole = load_text(tmp_path, study)
    words = r"stores parts of the fields, .*: run without --cube$"
    with open_cube(tmp_path / "c.nc") as cube, pytest.raises(UserError, match=words):
        accuracy.run(whole, tmp_path / "out", cube)
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("undrawn")
@pytest.mark.heavy
def test_a_cube_that_somebody_changed_is_reported(reported, tmp_path, monkeypatch):
    """As by the other commands: by its checksum; a missing variable is one message, and no files are written."""
    _, folder = reported
    monkeypatch.chdir(tmp_path)
    words = ["accuracy", str(folder.parent / "tiny.yaml"), "--cube", "changed.nc", "--output", "report"]
    shutil.copy(folder / "solutions.nc", "changed.nc")
    assert "checksum" not in CliRunner().invoke(cli.app, words).output
    with h5py.File("changed.nc", "r+") as file:
        file["meshes/force_x"][...] = 1.0
    done = CliRunner().invoke(cli.app, words)
    assert done.exit_code == 0
    assert "changed.nc: grid meshes: " in done.stderr
    assert "checksum" in done.stderr
    shutil.rmtree("report")
    with h5py.File("changed.nc", "r+") as file:
        del file["aligned/contact_radius"]
    done = CliRunner().invoke(cli.app, words)
    assert done.exit_code == 2
    assert "changed.nc: has no contact_radius in grid aligned: run without --cube" in done.stderr
    assert "Traceback" not in done.stderr
    assert not Path("report").exists()


@pytest.mark.usefixtures("undrawn")
@pytest.mark.heavy
def test_a_run_that_was_broken_off_goes_on(tmp_path, monkeypatch):
    """With what it had solved; one that was not solves and times all again. No cube of another study is replaced."""
    path = tmp_path / "tiny.yaml"
    path.write_text(STUDY)
    study, solved, timed = load_study(path), [], accuracy.timed

    def broken_off(scenes):
        for scene, result in zip(scenes, timed(scenes), strict=True):
            if len(solved) == most:
                raise KeyboardInterrupt
            solved.append(scene)
            yield result

    monkeypatch.setattr(accuracy, "warm_up_scenes", lambda study: [])
    monkeypatch.setattr(accuracy, "timed", broken_off)
    most = 2
    with pytest.raises(KeyboardInterrupt):
        accuracy.run(study, tmp_path / "report", formats=("png",))
    most = 10**9
    for times in (1, 2):
        accuracy.run(study, tmp_path / "report", formats=("png",))
        assert len(solved) == times * study.size
    path.write_text(STUDY.replace("study: ", "study: other-"))
    with pytest.raises(UserError, match="is the cube of another study, "):
        accuracy.run(load_study(path), tmp_path / "report", formats=("png",))


def test_a_cube_is_not_replaced_by_errors(tmp_path):
    """Not even the one that is read: `accuracy.nc` is also what a sweep of accuracy.yaml calls its cube."""
    path = tmp_path / "accuracy.yaml"
    path.write_text(STUDY, encoding="utf-8")
    study, cube = load_study(path), tmp_path / "accuracy.nc"
    sweep.run(study, cube, workers=1, solve=made_up)
    before = cube.read_bytes()
    for opened in (None, open_cube(cube)):
        with pytest.raises(UserError, match=r"accuracy\.nc: is a cube; not overwritten: choose another --output"):
            accuracy.run(study, tmp_path, opened, formats=("png",))
    assert cube.read_bytes() == before


def test_a_study_without_creepage_is_refused_with_the_reason(tmp_path):
    """It was told that its meshes were one."""
    path = tmp_path / "still.yaml"
    path.write_text(BASE + "  g: {axes: {mesh.cells: [[12, 12], [18, 18]]}}\n", encoding="utf-8")
    with pytest.raises(UserError, match=r"still\.yaml: no problem of rolling \(with creepage\) is solved with more"):
        accuracy.run(load_study(path), tmp_path / "report")


def test_equal_cases_of_two_grids_are_no_two_meshes(tmp_path):
    """They were taken for a problem with a reference, and a report said that none could be chosen."""
    path = tmp_path / "twice.yaml"
    grid = "{scene: {creepage: {longitudinal: 0.001}}, axes: {load: [50, 100]}}"
    path.write_text(BASE + f"  g: {grid}\n  h: {grid}\n", encoding="utf-8")
    with pytest.raises(UserError, match=r"twice\.yaml: no problem of rolling \(with creepage\) is solved with more"):
        accuracy.run(load_study(path), tmp_path / "report")
    assert not (tmp_path / "report").exists()


def test_of_both_discretisations_on_the_finest_mesh_aligned_cells_are_the_reference(tmp_path):
    """Whichever comes first, those of the tightest tolerance; the summary names it."""
    tight = "{normal: 1.0e-4, tangential: 1.0e-4}, {normal: 1.0e-9, tangential: 1.0e-9}"
    axes = f"mesh.cells: [[12, 12], [18, 18]], discretisation: [kalker, aligned], tolerance: [{tight}]"
    path = tmp_path / "both.yaml"
    path.write_text(f"{STUDY.partition('grids:')[0]}grids:\n  both:\n    axes: {{{axes}}}\n")
    study = load_study(path)
    sweep.run(study, tmp_path / "both.nc", workers=1, solve=made_up)
    with open_cube(tmp_path / "both.nc") as tree:
        rows = accuracy.report_rows(accuracy.measured(study, tree))
    of_reference = [(r.cells.x, r.discretisation, r.tolerance) for r in rows if r.reference]
    assert of_reference == [(18, "aligned", BothTolerances(1e-9, 1e-9))]
    text = " ".join(summary_text(rows, settings(rows), []).split())
    assert "(18 cells along a side, `aligned`, 1e-09)" in text
    assert "8 cases of 1 problem. " in text
    rows += [row(16, 1e-5, 0.01, problem=1, reference=True), row(16, 1e-5, 0.01, problem=2)]
    words = (
        "(18 cells along a side, `aligned`, 1e-09 for 1 of them; 16 cells along a side, `kalker`, 1e-05 for 1 of them; "
    )
    assert f"{words}none for 1 of them)" in " ".join(summary_text(rows, settings(rows), []).split())


def measured_rows(tmp_path, axes, change=lambda result: result, scene=""):
    """Rows of a report on made-up solutions, each changed by `change`, of a grid with these `axes`."""
    path = tmp_path / "few.yaml"
    top = STUDY.partition("grids:")[0]
    path.write_text(f"{top}grids:\n  g:\n    scene: {{{scene}}}\n    axes: {{{axes}}}\n")
    study = load_study(path)

    def solve(scenes):
        yield from (change(scene, result) for scene, result in zip(scenes, made_up(scenes), strict=True))

    sweep.run(study, tmp_path / "few.nc", workers=1, solve=solve, fresh=True)
    with open_cube(tmp_path / "few.nc") as tree:
        return accuracy.report_rows(accuracy.measured(study, tree))


def by_tolerance(scene, result):
    """A force that differs by the cells and by each tolerance, so that every choice of a reference shows."""
    result.scalars["force_x"] = 1.0 + 1.0 / scene.mesh.cells[0] + 10.0 * scene.tolerance.normal
    result.scalars["force_x"] += scene.tolerance.tangential
    result.scalars["force_y"] = 0.0
    return result


@pytest.mark.parametrize("varied", ["tangential", "normal"])
@pytest.mark.parametrize("values", [(1e-3, 1e-4, 1e-7), (1e-7, 1e-4, 1e-3), (1e-4, 1e-7, 1e-3)])
def test_the_reference_is_the_tightest_by_both_tolerances_in_any_order(varied, values, tmp_path):
    """Where one of them varies below the other; its error is its difference from another mesh, not from another case.

    The looser of the two alone is the same in all cases: the first or the last was taken, and the error was zero.
    """
    other = {"tangential": "normal", "normal": "tangential"}[varied]
    axes = (
        f"mesh.cells: [[18, 18], [12, 12], [24, 24]], tolerance.{varied}: [{', '.join(map('{:.0e}'.format, values))}]"
    )
    rows = measured_rows(tmp_path, axes, by_tolerance, f"tolerance: {{{other}: 1.0e-3}}")
    (reference,) = [r for r in rows if r.reference]
    tightest = BothTolerances(**{varied: 1e-7, other: 1e-3})
    assert (reference.cells.x, reference.tolerance) == (24, tightest)
    force = {r.cells.x: 1.0 + 1.0 / r.cells.x for r in rows}
    scale = force[24] + (10.0 if other == "normal" else 1.0) * 1e-3
    for r in rows:
        assert np.isfinite(r.error("force")) == (r.cells.x != 24)
        if r.cells.x != 24:
            assert r.error(REFERENCE + "force") == pytest.approx((force[18] - force[24]) / scale, rel=1e-3)
        assert np.isfinite(r.error("solver_force")) == (r.tolerance != tightest)


def test_the_next_coarser_mesh_has_the_spin_point_of_the_reference(tmp_path):
    def change(scene, result):
        result.scalars |= {"force_x": 1.0 + 1.0 / scene.mesh.cells[0] + scene.spin_point, "force_y": 0.0}
        return result

    rows = measured_rows(tmp_path, "mesh.cells: [[12, 12], [18, 18]], spin_point: [0.25, 0]", change)
    errors = [r.error(REFERENCE + "force") for r in rows if r.cells.x == 12]
    assert errors == pytest.approx([(1 / 12 - 1 / 18) / (1 + 1 / 18)] * 2)


def test_a_case_that_two_grids_share_is_not_the_next_coarser_mesh(tmp_path):
    path = tmp_path / "twice.yaml"
    axes = "axes: {mesh.cells: [[12, 12], [18, 18]]}"
    path.write_text(f"{STUDY.partition('grids:')[0]}grids:\n  one: {{{axes}}}\n  other: {{{axes}}}\n")
    study = load_study(path)

    def solve(scenes):
        yield from (by_tolerance(scene, result) for scene, result in zip(scenes, made_up(scenes), strict=True))

    sweep.run(study, tmp_path / "twice.nc", workers=1, solve=solve)
    with open_cube(tmp_path / "twice.nc") as tree:
        rows = accuracy.report_rows(accuracy.measured(study, tree))
    assert [(r.grid, r.cells.x) for r in rows if r.reference] == [("one", 18)]
    assert all(r.error(REFERENCE + "force") > 0.02 for r in rows if r.cells.x == 12)


def test_tolerances_are_told_apart_and_said_in_full():
    """The looser of the two counts first; where they differ both are named, and what they are is explained."""
    pairs = [(1e-3, 1e-3), (1e-3, 1e-5), (1e-5, 1e-3), (1e-5, 1e-5), (1e-5, 1.5e-7)]
    assert [str(both(pair)) for pair in pairs] == ["1e-03", "1e-03/1e-05", "1e-05/1e-03", "1e-05", "1e-05/1.5e-07"]
    assert sorted(map(both, reversed(pairs)), reverse=True) == [both(pair) for pair in pairs]
    rows = [row(n, pair, 0.1 / n + pair[1]) for n in (16, 32) for pair in pairs]
    words = "Two tolerances, as in 1e-05/1e-07, are those of pressure/tractions."
    text = " ".join(summary_text(rows, settings(rows), []).split())
    assert words in text
    for pair in pairs:
        assert f"| {both(pair)} | kalker | 2 of 2 |" in text
    with style():
        told = [" ".join(text.get_text() for text in draw(rows).texts) for draw in (work_precision, tolerances_figure)]
    assert all(words in text.replace("\n", " ") for text in told)
    plain = [row(16, 1e-3, 0.1), row(32, 1e-5, 0.1)]
    assert "Two tolerances" not in summary_text(plain, settings(plain), [])


def test_a_tolerance_with_an_unsolved_case_of_one_discretisation_keeps_nothing():
    """That of the other discretisation, all of whose cases were solved, was said to hold for every case."""
    rows = [row(16, t, 1e-5, discretisation=name) for t in (1e-3, 1e-5) for name in ("kalker", "aligned")]
    said = "Tolerance that keeps both fields of every case within it: 1 %: "
    assert f"{said}1e-03;" in summary_text(rows, [], [])
    for failed in range(2):
        some = [replace(r, status="not converged") if k == failed else r for k, r in enumerate(rows)]
        assert f"{said}1e-05;" in summary_text(some, [], [])


def test_the_settings_name_both_tolerances_where_they_differ():
    rows = [row(16, (1e-5, 1e-7), 0.001), row(16, (1e-5, 1e-6), 0.001), row(16, (1e-5, 1e-5), 0.02)]
    found = chosen(rows, 0.01)
    assert found.tolerance == both((1e-5, 1e-6))
    _, columns, (listed, *_) = settings_table([found])
    titles = {c.key: c.title for c in columns if c.key.startswith("tolerance")}
    assert titles == {"tolerance_normal": "Tolerance, pressure", "tolerance_tangential": "Tolerance, tractions"}
    assert (listed["tolerance_normal"], listed["tolerance_tangential"]) == (1e-5, 1e-6)
    _, columns, (listed, *_) = settings_table([replace(found, tolerance=both(1e-5))])
    assert [c.title for c in columns if c.key.startswith("tolerance")] == ["Tolerance"]
    assert listed["tolerance"] == 1e-5


def test_meshes_in_fitted_windows_are_one_problem(tmp_path):
    """Of few cells, too, whose windows are wider; those were problems of their own, without errors."""
    axes = "mesh.cells: [[8, 8], [10, 10], [24, 24], [48, 48]], mesh.margin: [1.25, 1.5]"
    rows = measured_rows(tmp_path, axes, by_tolerance, "mesh: {size: auto}")
    assert [(r.cells.x, r.problem) for r in rows if r.reference] == [(48, 0), (48, 1)]
    assert [r.problem for r in rows] == [0, 1] * 4
    assert all(np.isfinite(r.error("force")) for r in rows if r.cells.x != 48)
    path = tmp_path / "few.yaml"
    cases = accuracy.expand(load_study(path)).cases
    sizes = {case.scene.mesh.size for case in cases if case.index[1] == 0}
    assert len(sizes) > 2  # or this test says nothing


@pytest.mark.usefixtures("undrawn")
@pytest.mark.heavy
def test_fields_in_windows_of_different_size_are_compared_where_they_are(tmp_path):
    """On 8 cells in a window wider than that of the reference: its share of each cell, nothing outside, by hand."""
    path = tmp_path / "fitted.yaml"
    text = STUDY.partition("grids:")[0].replace("size: [0.8, 0.8]", "size: auto")
    path.write_text(f"{text}grids:\n  g: {{axes: {{mesh.cells: [[8, 8], [36, 36]]}}}}\n")
    study = load_study(path)
    accuracy.run(study, tmp_path / "report", formats=("png",))
    coarse, fine = sorted((case.scene for case in accuracy.expand(study).cases), key=lambda s: s.mesh.cells)
    own, reference = solve_scene(coarse).fields["pressure"], solve_scene(fine).fields["pressure"]
    assert coarse.mesh.size[0] > 1.1 * fine.mesh.size[0]
    # by brute force: 200 points in each of the coarse cells along either axis, and in which fine cell they lie
    points = ((np.arange(1600) + 0.5) / 1600 - 0.5) * coarse.mesh.size[0]
    places = np.floor((points / fine.mesh.size[0] + 0.5) * 36).astype(int)
    inside = (places >= 0) & (places < 36)
    padded = np.where(inside[:, None] & inside, reference[np.ix_(places % 36, places % 36)], 0.0)
    means = padded.reshape(8, 200, 8, 200).mean(axis=(1, 3))
    with xr.open_datatree(tmp_path / "report" / "accuracy.nc") as tree:
        error = float(tree["g"]["error_pressure"].sel(cells="8 x 8"))
    assert error == pytest.approx(np.linalg.norm(own - means) / np.linalg.norm(means), rel=1e-2)
    assert 0.01 < error < 0.2


@pytest.mark.parametrize(("fine", "coarse"), [(24, 12), (18, 12), (7, 5), (16, 16)])
def test_means_over_cells_conserve_and_are_exact(fine, coarse):
    rng = np.random.default_rng(3)
    values = rng.standard_normal((2, fine, fine + 1))
    means = accuracy.averaged(values, Mesh((0.8, 1.2), (fine, fine + 1)), Mesh((0.8, 1.2), (coarse, coarse)))
    # by brute force: both divisions refined until they share cells
    both = np.repeat(np.repeat(values, coarse, axis=1), coarse, axis=2)
    brute = both.reshape(2, coarse, fine, coarse, fine + 1).mean(axis=(2, 4))
    np.testing.assert_allclose(means, brute, rtol=1e-12, atol=1e-14)


def test_means_over_a_larger_window_count_what_is_outside_as_nothing():
    means = accuracy.averaged(np.ones((4, 4)), Mesh((1.0, 1.0), (4, 4)), Mesh((2.0, 2.0), (4, 4)))
    np.testing.assert_allclose(means, np.pad(np.ones((2, 2)), 1))


def test_problem_is_what_remains_without_the_way_of_solving():
    scene = Scene(STEEL, (50.0, 50.0), 100.0, Mesh((1.0, 1.0), (16, 16)))
    other = replace(scene, mesh=Mesh((1.0, 1.0), (64, 64)), tolerance=Tolerance(1e-9, 1e-9), method="paper-cg")
    assert accuracy.problem(scene) == accuracy.problem(other)
    assert accuracy.problem(scene) == accuracy.problem(replace(scene, discretisation="aligned", spin_point=0.5))
    assert accuracy.problem(scene) != accuracy.problem(replace(scene, coupling="full"))
    assert accuracy.problem(scene) != accuracy.problem(replace(scene, load=99.0))
    # a fitted window is what was asked for, not what came of it
    wider = replace(scene, mesh=Mesh((1.2, 1.2), (8, 8)))
    assert accuracy.problem(scene) != accuracy.problem(wider)
    assert accuracy.problem(scene, 1.25) == accuracy.problem(wider, 1.25) != accuracy.problem(wider, 1.5)


def test_times_are_those_of_whole_solves(monkeypatch):
    """The influence coefficients, too, are made in each."""
    calls, made = [], []

    def solve(scene):
        calls.append(scene)
        made.append(influence_of(scene))
        return Result(Status.SOLVED)

    monkeypatch.setattr(import_module("rcstudy.solve"), "solve_scene", solve)
    scene = Scene(STEEL, (50.0, 50.0), 100.0, Mesh((1.0, 1.0), (16, 16)))
    results = list(accuracy.timed([scene, scene]))
    assert len(calls) == 2 * accuracy._REPEATS  # nothing is solved in no time: as often as it may
    assert len(set(map(id, made))) == len(calls)
    assert all(0.0 <= r.scalars["solve_seconds"] < 0.1 for r in results)


def test_of_several_solves_the_fastest_time_counts(monkeypatch):
    """Times of 0.05, 0.02 and 0.3 s, whichever is the last."""
    monkeypatch.setattr(import_module("rcstudy.solve"), "solve_scene", lambda scene: Result(Status.SOLVED))
    clock = iter([0.0, 0.05, 1.0, 1.02, 2.0, 2.3])
    monkeypatch.setattr(accuracy.time, "process_time", lambda: next(clock))
    (result,) = accuracy.timed([Scene(STEEL, (50.0, 50.0), 100.0, Mesh((1.0, 1.0), (16, 16)))])
    assert result.scalars["solve_seconds"] == pytest.approx(0.02)


def test_a_slow_spell_of_the_machine_makes_no_case_slow(monkeypatch):
    """Of four cases that are solved in turns each has a solve outside a spell of eight slow ones."""
    monkeypatch.setattr(import_module("rcstudy.solve"), "solve_scene", lambda scene: Result(Status.SOLVED))
    seconds = [0.02] * 12 + [0.06] * 8 + [0.02] * 100
    clock = iter([t for duration in seconds for t in (0.0, duration)])
    monkeypatch.setattr(accuracy.time, "process_time", lambda: next(clock))
    scenes = [Scene(STEEL, (50.0, 50.0), load, Mesh((1.0, 1.0), (16, 16))) for load in (10.0, 20.0, 30.0, 40.0)]
    assert [result.scalars["solve_seconds"] for result in accuracy.timed(scenes)] == [0.02] * 4


def test_results_come_in_the_order_of_their_scenes(monkeypatch):
    """Whatever the number of scenes, those in turns and the rest after them."""

    def solve(scene):
        return Result(Status.SOLVED, scalars={"load": scene.load})

    monkeypatch.setattr(import_module("rcstudy.solve"), "solve_scene", solve)
    loads = [float(k) for k in range(1, 2 * accuracy._IN_TURN + 4)]
    scenes = [Scene(STEEL, (50.0, 50.0), load, Mesh((1.0, 1.0), (16, 16))) for load in loads]
    assert [result.scalars["load"] for result in accuracy.timed(scenes)] == loads
    assert list(accuracy.timed([])) == []


def entry(scene, **values):
    """A case of which nothing is known but its scene and scalars."""
    return accuracy.Entry(SimpleNamespace(scene=scene), None, values)


def test_numbers_that_are_nothing_but_rounding_have_no_error():
    """A moment of 1e-12 of friction times load times radius; one of 1e-6 of that has."""
    scene = Scene(STEEL, (50.0, 50.0), 100.0, Mesh((1.0, 1.0), (2, 2)), friction=0.5)
    stress = np.ones((3, 2, 2))
    known = ("pressure_max", "traction_max", "force_x", "force_y", "friction_power", "slip_area")
    for part, found in ((1e-12, np.nan), (1e-6, 0.5)):
        moment = part * 0.5 * 100.0 * 0.01
        one, other = (
            entry(scene, contact_radius=0.01, moment_z=m, **dict.fromkeys(known, 1.0)) for m in (1.5 * moment, moment)
        )
        errors = accuracy._differences(one, stress, other, stress)
        assert errors["moment"] == pytest.approx(found, nan_ok=True)
        assert errors["force"] == errors["pressure"] == 0.0


def test_a_reference_without_slip_gives_no_error_of_the_friction_power():
    """The error was 9e6: of a power that the solver's tolerance had left of nothing."""
    scene = Scene(STEEL, (50.0, 50.0), 100.0, Mesh((1.0, 1.0), (2, 2)), friction=0.5)
    stress = np.ones((3, 2, 2))
    known = dict.fromkeys(("pressure_max", "traction_max", "force_x", "force_y", "moment_z", "contact_radius"), 1.0)
    own = entry(scene, friction_power=1e-3, slip_area=0.1, **known)
    for slip_area, found in ((0.0, np.nan), (0.2, 1.0)):
        reference = entry(scene, friction_power=5e-4, slip_area=slip_area, **known)
        errors = accuracy._differences(own, stress, reference, stress)
        assert errors["friction_power"] == pytest.approx(found, nan_ok=True)
        assert np.isnan(errors["slip_area"]) == np.isnan(found)


def test_couplings_are_compared_on_one_mesh_only():
    """References of both whose meshes are not the same."""
    scene = Scene(STEEL, (50.0, 50.0), 100.0, Mesh((1.0, 1.0), (16, 16)))
    couplings = [entry(scene), entry(replace(scene, coupling="full", mesh=Mesh((1.0, 1.0), (12, 12))))]
    for e in couplings:
        e.reference = True
    assert accuracy.coupling_errors(couplings) == []


def test_a_case_is_held_where_the_cube_has_its_key():
    """Not by a cube of other axes, by none, at a place that it has not, nor under another key."""
    grid = xr.Dataset({CASE_KEY: (("load", "cells"), [["a", "b"]])}, attrs={"axes": "load cells"})

    def held(dataset, key, *index):
        return bool(accuracy._holds(dataset, SimpleNamespace(index=index, key=key)))

    assert held(grid, "b", 0, 1)
    assert not (held(grid, "a", 0, 1) or held(grid, "b", 1, 1) or held(grid, "a", 0) or held(None, "a", 0, 0))


def test_products_and_tolerances_of_a_case():
    """Products on coarser meshes count where there are such (NaN: none)."""
    scene = Scene(STEEL, (50.0, 50.0), 100.0, Mesh((1.0, 1.0), (16, 16)), tolerance=Tolerance(1e-4, 1e-6))
    assert entry(scene, operator_products=5.0, coarse_products=2.0).products == 7.0
    assert entry(scene, operator_products=5.0, coarse_products=np.nan).products == 5.0
    assert entry(scene, operator_products=5.0).products == 5.0
    assert entry(scene).tolerance == BothTolerances(1e-4, 1e-6)


def both(tolerance):
    """The same tolerance for pressure and tractions, or two."""
    return BothTolerances(*(tolerance if isinstance(tolerance, tuple) else (tolerance, tolerance)))


def square(cells):
    """As many cells along both sides; a mesh stays as it is."""
    return cells if isinstance(cells, Cells) else Cells(cells, cells)


def row(cells, tolerance, error, **others):
    """A case of a one-way problem with the same error in everything, one tolerance or two, and `others`."""
    case = {
        "grid": "g",
        "label": f"cells={cells}",
        "problem": 0,
        "method": "newton",
        "discretisation": "kalker",
        "coupling": "one-way",
        "cells": square(cells),
        "radius": square(cells).along_side / 4,
        "tolerance": both(tolerance),
        "status": "solved",
        "products": 80.0,
        "iterations_normal": 5.0,
        "iterations_tangential": 3.0,
        "seconds": 1.0,
        "errors": dict.fromkeys((*QUANTITIES, "solver_traction", "solver_pressure"), error),
    }
    return Row(**(case | others))


def chosen(rows, target, discretisation="kalker", coupling="one-way"):
    asked = (target, discretisation, coupling)
    return next(s for s in settings(rows, ["force"]) if (s.target, s.discretisation, s.coupling) == asked)


def test_the_cheapest_setting_that_keeps_every_problem_within_the_target_is_chosen():
    rows = [row(16, 1e-5, 0.02), row(32, 1e-5, 0.008, seconds=4.0), row(64, 1e-5, 0.0009, seconds=9.0)]
    assert (chosen(rows, 0.01).cells, chosen(rows, 0.01).seconds) == (square(32), 4.0)
    assert chosen(rows, 0.001).cells == square(64)
    # none keeps to 0.01 %: by the line through the three points on paper, slope log(0.0009/0.02)/log(64/16)
    none = chosen(rows, 0.0001)
    slope = np.log(0.0009 / 0.02) / np.log(4)
    centre = np.log([0.02, 0.008, 0.0009]).mean()
    expected = Setting("one-way", "kalker", "force", 0.0001, needed=none.needed, order=none.order, finest=64)
    np.testing.assert_equal(asdict(none), asdict(expected))  # nan is equal to itself here
    assert none.order == pytest.approx(-slope)
    assert none.needed == pytest.approx(32 * np.exp((np.log(0.0001) - centre) / slope))
    # another problem that needs the finer mesh
    rows += [row(16, 1e-5, 0.1, problem=1), row(32, 1e-5, 0.02, problem=1), row(64, 1e-5, 0.005, problem=1)]
    assert chosen(rows, 0.01).cells == square(64)


def test_what_the_reference_may_be_off_by_does_not_bend_the_law_of_the_errors():
    """It is the same on all meshes: added to errors of first order it made them look like order 0.6."""
    rows = [
        row(n, 1e-5, 0.16 / n, errors={"pressure": 0.1, "force": 0.16 / n, "reference_force": 0.002})
        for n in (16, 32, 64)
    ]
    none = chosen(rows, 0.0001)
    assert (none.order, none.needed) == (pytest.approx(1.0), pytest.approx(1600.0))
    assert chosen(rows, 0.01).cells == square(32)


@pytest.mark.parametrize("errors", [(0.02, 0.02, 0.02), (0.02, 0.021, 0.0195), (0.01, 0.02, 0.04)])
def test_errors_that_do_not_fall_have_no_law(errors):
    """No number of cells is said to do: extrapolated along a line that is flat, or rises, it would be any number."""
    none = chosen([row(n, 1e-5, error) for n, error in zip((16, 32, 64), errors, strict=True)], 0.0001)
    assert none.cells is None
    assert np.isnan([none.needed, none.order]).all()


def test_errors_that_scatter_about_their_law_have_none():
    """5900 cells along a side were said to reach 0.01 % where errors were 0.018, 0.066 and 0.014 %."""
    scattered = (0.00018, 0.00066, 0.00014)
    none = chosen([row(n, 1e-5, error) for n, error in zip((16, 32, 64), scattered, strict=True)], 0.0001)
    assert none.cells is None
    assert np.isnan([none.needed, none.order]).all()
    # by a line through their logarithms the cells are 344 and uncertain by a factor of 2.94, or 346 and 3.07
    for middle, known in ((0.00153, True), (0.00156, False)):
        errors = (0.0018, middle, 0.00045)
        none = chosen([row(n, 1e-5, error) for n, error in zip((16, 32, 64), errors, strict=True)], 0.0001)
        assert np.isfinite(none.needed) == known
    steady = (0.0018, 0.0010, 0.0004)
    assert chosen([row(n, 1e-5, error) for n, error in zip((16, 32, 64), steady, strict=True)], 0.0001).needed > 64


def test_errors_that_fall_slowly_have_a_law():
    none = chosen([row(n, 1e-5, 0.02 * (16 / n) ** 0.3) for n in (16, 32, 64)], 0.001)
    assert (none.order, none.needed) == (pytest.approx(0.3), pytest.approx(16 * 20 ** (1 / 0.3)))


def test_errors_small_by_chance_and_unsolved_cases_do_not_count():
    rows = [row(16, 1e-5, 0.001), row(32, 1e-5, 0.02), row(64, 1e-5, 0.005)]
    assert chosen(rows, 0.01).cells == square(64)
    rows = [row(64, 1e-3, 0.001, status="proof failed"), row(64, 1e-5, 0.001, seconds=2.0)]
    assert chosen(rows, 0.01).tolerance == both(1e-5)
    assert "proof failed: 1" in summary_text(rows, settings(rows), [])


def test_work_of_another_method_is_that_at_its_tightest_tolerance():
    """Its forces as well; its tractions are as far off whatever the tolerance."""
    rows = [row(16, 1e-5, 0.02)]
    for n, tolerance, error, products in (
        (16, 1e-3, 0.3, 20.0),
        (16, 1e-5, 0.1, 300.0),
        (32, 1e-5, 0.1, 340.0),
        (48, 1e-5, 0.2, 900.0),
    ):
        errors = {"solver_traction": 0.4, "solver_force": error}
        rows.append(row(n, tolerance, 0.0, method="paper-cg", errors=errors, products=products))
    said = " ".join(summary_text(rows, [], []).partition("## Method paper-cg")[2].split())
    assert "differ by 40 % (L2)" in said
    assert "its forces, at 1e-05, by 10 to 20 %, after 340 products (median). 4 of 4 cases pass" in said


def test_cases_that_are_not_solved_are_counted_by_how_they_ended():
    """Of the Newton method alone: the paper's fail their proof by nature. Where all are solved nothing is said."""
    rows = [row(16, t, 0.02) for t in (1e-3, 1e-5)] + [row(16, 1e-5, 0.4, method="paper-cg", status="proof failed")]
    assert "Not solved" not in summary_text(rows, [], [])
    rows += [row(32, t, 0.02, status="not converged", label="a") for t in (1e-5, 1e-3)]
    rows += [row(32, 1e-7, 0.02, status="refused", label="b")]
    said = summary_text(rows, [], []).partition("## Not solved")[2].splitlines()
    assert [line for line in said if line.startswith("- ")] == [
        "- not converged: 2 (tolerance 1e-03, 1e-05): g, a and the like",
        "- refused: 1 (tolerance 1e-07): g, b and the like",
    ]


def test_unsolved_cases_have_no_part_in_figures_and_tables_of_errors():
    """Their errors of 50 % are in the table of all cases alone, next to their status."""
    rows = [row(n, tolerance, 0.16 / n) for n in (16, 32, 64) for tolerance in (1e-3, 1e-5)]
    rows += [row(n, tolerance, 0.01 / n, discretisation="aligned") for n in (16, 32, 64) for tolerance in (1e-3, 1e-5)]
    schemes_ = product((1e-3, 1e-5), ("kalker", "aligned"))
    failed = [row(32, t, 0.5, problem=1, status="not converged", discretisation=d) for t, d in schemes_]
    text = summary_text(rows + failed, [], [])
    assert text.count("| 50 |") == 0 and "5.0e-01" not in text
    assert mesh_table(rows + failed, "one-way") == mesh_table(rows, "one-way")
    for draw in (work_precision, quantities_figure, tolerances_figure):
        with style():
            plain, figure = draw(rows), draw(rows + failed)
        drawn = [[line.get_xydata().tolist() for ax in f.axes for line in ax.lines] for f in (plain, figure)]
        assert drawn[0] == drawn[1], draw.__name__


def test_figures_say_how_many_cases_of_another_method_are_proven():
    rows = [row(n, 1e-5, 0.16 / n) for n in (16, 32)]
    rows += [row(n, 1e-5, 0.4, method="paper-cg", status="proof failed") for n in (16, 32)]
    for draw in (work_precision, tolerances_figure):
        with style():
            figure = draw(rows)
        assert "0 of 2 cases shown of paper-cg pass their proof." in " ".join(
            text.get_text().replace("\n", " ") for text in figure.texts
        )
    with style():
        words = " ".join(text.get_text().replace("\n", " ") for text in quantities_figure(rows).texts)
    assert "relative to its own value" in words and "paper-cg" not in words


def test_a_single_tolerance_has_points_and_no_lines():
    """The caption spoke of lines, and of numbers that were not there."""
    papers = [row(n, 1e-5, 0.4, method="paper-cg", status="proof failed") for n in (16, 32)]
    rows = [*papers, *(row(n, 1e-5, 0.16 / n) for n in (16, 32))]
    for drawn, said in (
        (papers, "A point for each mesh, tolerance: 1e-05"),
        (rows, "A point for each mesh (numbers: cells along a side), tolerance: 1e-05"),
        ([*rows, row(32, 1e-3, 0.16)], "A line for each mesh (numbers: cells along a side), its points from"),
    ):
        with style():
            words = " ".join(text.get_text().replace("\n", " ") for text in tolerances_figure(drawn).texts)
        assert said in words


@pytest.mark.parametrize(
    ("outputs", "said"),
    [
        ("fields: false", "outputs.fields: false: errors of pressure and tractions need the fields: true"),
        ("crop: contact", "outputs.crop: contact: errors of pressure and tractions need the whole window: none"),
    ],
)
def test_a_study_that_stores_too_little_is_refused_where_it_says_so(tmp_path, outputs, said):
    study = load_text(tmp_path, f"outputs: {{{outputs}}}\n{BASE}  g: {{axes: {{load: [1]}}}}\n")
    with pytest.raises(UserError, match=rf"\.yaml:1:{11 + outputs.index(' ') + 1}: {said}$"):
        accuracy.run(study, tmp_path / "out")


def test_a_quantity_without_errors_has_no_line_in_the_legend():
    """As the moment without spin, which is zero by symmetry."""
    errors = dict.fromkeys(QUANTITIES, 0.01) | {"moment": np.nan}
    with style():
        figure = quantities_figure([row(n, 1e-5, 0.0, errors=errors) for n in (16, 32)])
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert len(names) == len(QUANTITIES) - 1 and QUANTITIES["moment"] not in names


def test_lines_of_quantities_go_through_the_worst_error_on_each_mesh():
    rows = [row(16, 1e-5, 0.03), row(16, 1e-5, 0.02, problem=1), row(32, 1e-5, 0.005), row(32, 1e-5, 0.01, problem=1)]
    with style():
        figure = quantities_figure(rows)
    for line in figure.axes[0].lines:
        assert (line.get_xdata().tolist(), line.get_ydata().tolist()) == ([4.0, 8.0], [0.03, 0.01])


def test_settings_that_no_two_problems_share_are_said_to_be_none():
    """Their targets were not reached, whatever the errors."""
    rows = [row(n, 1e-5, 1e-6) for n in (16, 32)] + [row(n, 1e-6, 1e-6, problem=1) for n in (16, 32)]
    text = " ".join(summary_text(rows, settings(rows, ["force"]), []).split())
    assert "`kalker`: not reached: force: no mesh and tolerance that all problems share." in text


def test_each_discretisation_and_coupling_has_settings_of_its_own():
    aligned = {"discretisation": "aligned"}
    rows = [row(16, 1e-5, 0.02), row(32, 1e-5, 0.008, seconds=4.0), row(16, 1e-5, 0.004, seconds=2.0, **aligned)]
    full = {"coupling": "full", "problem": 1}
    rows += [row(16, 1e-5, 0.03, **full), row(32, 1e-5, 0.02, **full), row(32, 1e-5, 0.009, **full, **aligned)]
    assert chosen(rows, 0.01).cells == square(32)
    assert (chosen(rows, 0.01, "aligned").cells, chosen(rows, 0.01, "aligned").seconds) == (square(16), 2.0)
    assert chosen(rows, 0.01, coupling="full").cells is None
    assert chosen(rows, 0.01, "aligned", "full").cells == square(32)
    text = " ".join(summary_text(rows, settings(rows, ["force"]), []).split())
    assert "`kalker`: **force**: 32 x 32 cells (8 per contact radius), tolerance 1e-05, 80 products, 4e+03 ms" in text
    assert "`aligned`: **force**: 16 x 16 cells" in text
    assert "`kalker`: not reached: force: no estimate" in text
    # on 16 x 16 cells 0.02/0.004 and 2/1 s; on 32 x 32 there are no aligned cells one-way
    assert "; force 5.0; moment" in text
    assert "`aligned` costs 2 times the time." in text
    _, _, listed = settings_table(settings(rows, ["force"]))
    found = [(r["coupling"], r["discretisation"], r["cells"]) for r in listed if r["target"] == 0.01]
    assert found == [
        ("one-way", "kalker", "32 x 32"),
        ("one-way", "aligned", "16 x 16"),
        ("full", "kalker", "none"),
        ("full", "aligned", "32 x 32"),
    ]
    assert [r["scheme"] for r in errors_table(rows)[2]] == [r.discretisation for r in rows]


def test_quantities_out_of_reach_are_listed_by_the_cells_that_they_need():
    """Those that are reached or of unknown need, between them, do not change their order."""
    asked = Setting("one-way", "kalker", "force", 0.01, finest=64)
    needs = {"force": 900.0, "moment": np.nan, "slip_area": 300.0, "friction_power": np.nan, "traction_max": 100.0}
    chosen = [replace(asked, quantity=name, needed=needed) for name, needed in needs.items()]
    chosen[3] = replace(chosen[3], cells=square(32), tolerance=both(1e-5), radius=(8.0, 8.0))
    words = precision_summary._sentence(chosen).partition("not reached: ")[2]
    names = [QUANTITIES[name] for name in ("traction_max", "slip_area", "force", "moment")]
    assert names == [text.partition(":")[0] for text in words.split("; ")]


@pytest.mark.parametrize(
    ("needed", "finest", "words"),
    [
        (128.4, 128, "about 130 along a side"),  # one digit: 100, which 128 shows to be too few
        (131.0, 128, "about 140 along a side"),
        (1600.0, 128, "about 1600 along a side"),
        (1601.0, 128, "about 1700 along a side"),
        (99.5, 64, "about 100 along a side"),
        (7.2, 7, "about 8 along a side"),
        (100.0, 128, "more than 128 along a side"),
        (1e5, 128, "far out of reach"),
    ],
)
def test_extrapolated_cells_are_rounded_up(needed, finest, words):
    asked = Setting("one-way", "kalker", "force", 0.01, finest=finest, needed=needed)
    assert precision_summary._needed(asked) == words


def test_meshes_with_as_many_cells_along_x_only_are_not_one_mesh():
    """They were: 32 x 8 cells then hid what 32 x 32 reach, and 64 x 64 was recommended where 64 x 32 was tried."""
    meshes = {Cells(32, 8): 0.08, Cells(32, 32): 0.009, Cells(64, 32): 0.0009}
    rows = [row(cells, 1e-5, error) for cells, error in meshes.items()]
    found = settings(rows, ["force"])
    assert [s.cells for s in found[:2]] == [Cells(32, 32), Cells(64, 32)]
    assert [r["cells"] for r in settings_table(found)[2][:2]] == ["32 x 32", "64 x 32"]
    text = " ".join(summary_text([*rows, row(Cells(96, 64), 1e-5, 0.0, reference=True)], found, []).split())
    assert "64 x 32 cells (11 per contact radius)" in text
    assert "(96 x 64 cells, `kalker`, 1e-05)" in text
    assert ("extrapolated by a power law" in text) is any(np.isfinite(s.needed) for s in found if s.cells is None)
    reached = [setting for setting in found if setting.cells is not None]
    assert "extrapolated" not in summary_text([*rows, row(Cells(96, 64), 1e-5, 0.0, reference=True)], reached, [])
    assert "| 32 x 8 (4) | 32 (8) | 64 x 32 (11) | 96 x 64 (20) |" in text


def test_cells_per_radius_of_oblong_cells_and_what_refused_cases_lack(tmp_path):
    """By the side of a square of their area (by x there are twice as many); a case without numbers has no counts."""
    axes = "mesh.cells: [[12, 12], [12, 4], [24, 6]]"

    def solve(scene, result):
        return Result(Status.REFUSED, "too few") if scene.mesh.cells == (12, 4) else result

    of_squares, refused, oblong = measured_rows(tmp_path, axes, solve)
    assert (of_squares.cells, refused.cells, oblong.cells) == (Cells(12, 12), Cells(12, 4), Cells(24, 6))
    assert np.isnan([refused.products, refused.iterations_normal, refused.iterations_tangential]).all()
    assert oblong.radius == pytest.approx(of_squares.radius, rel=0.1)


def test_what_the_reference_may_be_off_by_counts():
    errors = dict.fromkeys(QUANTITIES, 0.007)
    rows = [row(16, 1e-5, 0.007), row(32, 1e-5, 0.0, errors=errors | {REFERENCE + "force": 0.004})]
    assert chosen(rows, 0.01).cells is None
    rows = [row(16, 1e-5, 0.007), row(32, 1e-5, 0.0, errors=errors | {REFERENCE + "force": 0.002})]
    assert chosen(rows, 0.01).worst == pytest.approx(0.007)
    assert "force 0.2 %" in summary_text(rows, settings(rows), [])


def test_a_quantity_that_is_nil_in_one_problem_is_judged_by_the_others():
    nil = {name: 0.002 for name in QUANTITIES if name != "moment"}
    rows = [row(16, 1e-5, 0.0, errors=nil), row(16, 1e-5, 0.005, problem=1)]
    (found,) = [s for s in settings(rows, ["moment"]) if s.target == 0.01]
    assert (found.cells, found.worst) == (square(16), 0.005)


def test_a_quantity_that_is_nil_in_all_problems_is_left_out():
    """It was listed as not reached, with a row of nan."""
    nil = {name: 0.02 for name in QUANTITIES if name != "moment"}
    doubts = {REFERENCE + name: 1e-4 for name in nil}
    rows = [row(n, 1e-5, 0.0, errors=nil | doubts) for n in (28, 32, 36)]
    assert {s.quantity for s in settings(rows)} == nil.keys()
    text = summary_text(rows, settings(rows), [])
    assert "nan" not in text
    assert not any("moment" in line for line in text.splitlines() if line.startswith(("|", "  - ")))
    assert "| cells along a side (per contact radius) | 28 (7) | 32 (8) | 36 (9) |" in text


def test_worst_errors_stand_side_by_side():
    rows = [row(n, 1e-5, e, seconds=0.01 * n) for n, e in ((16, 0.0534), (32, 0.02))]
    rows += [row(n, 1e-5, e / 10, discretisation="aligned") for n, e in ((16, 0.0534), (32, 0.02))]
    rows += [row(16, 1e-5, 0.1, coupling="full", problem=1), row(16, 1e-5, 0.4, problem=2)]
    table = mesh_table(rows, "one-way")
    assert "| cells along a side (per contact radius) | 16 (4) | 32 (8) |" in table
    assert "| force, % | 40 / 0.53 | 2 / 0.2 |" in table
    assert "| processor time, ms | 580 / 1000 | 320 / 1000 |" in table


def test_worst_errors_are_compared_over_the_problems_that_both_discretisations_have():
    """The 8 % of a problem that aligned lacks counted against it: a factor of 80 was reported."""
    rows = [row(16, 1e-5, e, discretisation=d) for d, e in (("kalker", 0.01), ("aligned", 0.001))]
    rows += [row(16, 1e-5, 0.08, problem=1)]
    text = summary_text(rows, [], [])
    factors = text[text.index("worst errors of `kalker` over") : text.index("`aligned` costs")]
    assert "force 10.0;" in factors and "80" not in factors
    heads = [line for line in text.splitlines() if line.startswith("Worst of")]
    fewer = "(of fewer where not all have a solved case)"
    assert heads == [f"Worst of 2 problems {fewer} at tolerance 1e-05, kalker / aligned:"]
    with style():
        words = " ".join(text.get_text() for text in quantities_figure(rows).texts).replace("\n", " ")
    assert f"coupling {fewer} at" in words
    assert mesh_table(rows[:2], "one-way")[0] == "Worst of 1 problem at tolerance 1e-05, kalker / aligned:"


@pytest.mark.parametrize(
    ("case", "numbers", "dots"),
    [
        ({}, False, True),
        ({"discretisation": "aligned"}, True, True),
        ({"discretisation": "aligned", "coupling": "full"}, False, False),
        ({"coupling": "full"}, False, False),
        ({"discretisation": "aligned", "errors": dict.fromkeys(QUANTITIES, 1e-7)}, True, False),
        (
            {"discretisation": "aligned", "errors": {**dict.fromkeys(QUANTITIES, 0.01), "friction_power": 0.0}},
            False,
            True,
        ),
    ],
)
def test_what_is_beside_lines_is_told_where_it_is_drawn(case, numbers, dots):
    """Numbers of cells and dots were told of in figures without any."""
    rows = [row(n, 1e-5, 0.01, **case) for n in (16, 32)]
    with style():
        figure = work_precision(rows)
    (panel,) = [ax for ax in figure.axes if "power" in ax.get_title(loc="left")]
    assert ({"16", "32"} <= {text.get_text() for text in panel.texts}) is numbers
    assert (
        any(line.get_linestyle() == "None" and line.get_xdata().size for ax in figure.axes for line in ax.lines) is dots
    )
    (words,) = [text.get_text() for text in figure.texts if text.get_gid() == "caption"]
    for text in (words, summary_text(rows, [], [])):
        assert ("numbers:" in text) is numbers
        assert ("dots:" in text) is dots


def test_ratios_of_errors_that_are_rounding_are_left_out():
    """Factors of 0.0 by which errors were larger."""
    rows = [row(16, 1e-5, e, discretisation=d) for d, e in (("kalker", 1e-8), ("aligned", 1e-7))]
    assert "of `aligned` on the same mesh: about the same." in " ".join(summary_text(rows, [], []).split())


def test_meshes_of_one_discretisation_have_a_dash_for_the_other():
    rows = [row(16, 1e-5, 0.01), row(16, 1e-5, 0.001, discretisation="aligned"), row(32, 1e-5, 0.005)]
    assert "| force, % | 1 / 0.1 | 0.5 / - |" in mesh_table(rows, "one-way")


def test_figures_are_as_fine_as_they_say_and_tell_their_tolerances():
    rows = [row(n, t, 0.1 / n + t, seconds=n) for n in (16, 32, 64) for t in (1e-3, 1e-5, 1e-7)]
    with style():
        for draw in (work_precision, tolerances_figure, quantities_figure):
            figure = draw(rows)
            assert figure.dpi == DPI
            texts = " ".join(text.get_text() for text in figure.texts if text.get_gid() == "caption").replace("\n", " ")
            assert {
                work_precision: "Tolerance: 1e-05.",
                tolerances_figure: ": 1e-03, 1e-05, 1e-07. Medians",
                quantities_figure: "",
            }[draw] in texts


def test_the_tolerances_of_all_meshes_are_told():
    """Only those of the finest mesh were: 1e-05."""
    rows = [row(16, t, t) for t in (1e-3, 1e-5)] + [row(32, 1e-5, 1e-5)]
    with style():
        words = " ".join(text.get_text() for text in tolerances_figure(rows).texts).replace("\n", " ")
    assert "the reference's: 1e-03, 1e-05. Medians" in words


def test_meshes_are_named_where_their_tolerance_is_the_loosest():
    rows = [row(n, t, t / n, seconds=n / t) for n in (16, 32) for t in (1e-7, 1e-3, 1e-5)]
    with style():
        named = {text.get_text(): text.xy for text in tolerances_figure(rows).axes[0].texts}
    assert named == {"16": (16e3, 1e-3 / 16), "32": (32e3, 1e-3 / 32)}


def test_quantities_without_errors_leave_no_empty_panels():
    """They had axes, and without errors of the force there was no legend."""
    errors = dict.fromkeys(QUANTITIES, 0.01) | {"force": 0.0, "moment": np.nan}
    with style():
        figure = work_precision([row(n, 1e-5, 0.0, errors=errors) for n in (16, 32)])
        assert work_precision([row(n, 1e-5, 0.0, errors={"pressure": 0.01}) for n in (16, 32)]) is None
    remarks = [[text.get_text() for text in ax.texts if text.get_gid() == "remark"] for ax in figure.axes]
    assert remarks == [["no errors"], ["zero by symmetry"], [], [], [], []]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["kalker, one-way"]


def test_times_within_a_decade_have_labels_that_do_not_overlap():
    """They were 3, 4 and 6 times powers of ten, one over the other."""
    rows = [row(n, t, 0.1 / n + t, seconds=0.0002 * n) for n in (16, 32, 64, 128) for t in (1e-3, 1e-5)]
    with style():
        for draw in (work_precision, tolerances_figure, quantities_figure):
            figure = draw(rows)
            figure.draw_without_rendering()
            ax = figure.axes[-1]
            low, high = ax.get_xlim()
            ticks = zip(ax.get_xticks(), ax.get_xticklabels(), strict=True)
            labels = [label for tick, label in ticks if low <= tick <= high]
            boxes = [label.get_window_extent() for label in labels]
            assert len(boxes) > 1
            assert not ax.get_xticklabels(minor=True)
            assert all(one.x1 < other.x0 for one, other in pairwise(boxes))


@pytest.mark.parametrize("seconds", [(0.00142, 0.0101), (0.0015, 0.0103), (0.0013, 0.002), (0.012, 0.055)])
def test_labels_of_times_in_narrow_panels_do_not_overlap(seconds):
    """Equal steps over nearly a decade crowd at its upper end, in panels a third of the figure wide."""
    rows = [row(n, 1e-5, 0.1 / n, seconds=s) for n, s in zip((16, 32), seconds, strict=True)]
    with style():
        check_texts(work_precision(rows))


def test_figures_show_each_discretisation_once():
    rows = [
        row(n, t, e * (1 + k), discretisation=d, coupling=c, problem=k)
        for d, e in (("kalker", 0.02), ("aligned", 0.004))
        for k, c in enumerate(("one-way", "full"))
        for n in (16, 32)
        for t in (1e-3, 1e-5)
    ]
    rows += [row(16, 1e-3, 0.2, method="paper-cg", status="not converged")]
    assert schemes(rows) == ["kalker", "aligned", "paper-cg"]

    def names(figure):
        return [text.get_text() for text in figure.legends[0].get_texts()]

    lines = ["kalker, one-way", "kalker, full", "aligned, one-way", "aligned, full", "paper-cg"]
    assert names(work_precision(rows)) == lines
    assert names(tolerances_figure(rows)) == ["kalker", "aligned", "paper-cg"]
    figure = quantities_figure(rows)
    assert names(figure) == list(QUANTITIES.values())
    assert [ax.get_title(loc="left") for ax in figure.axes] == ["(a) kalker", "(b) aligned"]
    # medians: of the one-way problem at the loosest tolerance but one
    force = work_precision(rows).axes[0].get_lines()
    (line,) = [line for line in force if line.get_label() == "aligned, one-way"]
    np.testing.assert_allclose(line.get_ydata(), 0.004)


def test_a_tolerance_without_errors_leaves_panels_empty():
    """Those of the tolerance that is shown are all exact."""
    rows = [row(n, t, e) for n in (16, 32) for t, e in ((1e-3, 0.0), (1e-5, 0.0), (1e-7, 0.1))]
    figure = work_precision(rows)
    assert [text.get_text() for ax in figure.axes for text in ax.texts] == ["no errors"] * 6
    assert figure.axes[0].get_ylim() == pytest.approx((0.2e-5, 1.0))


def test_no_line_leaves_its_panel():
    """Be its errors ever so small, or ever so large."""
    rows = [row(n, 1e-3, e) for n, e in ((8, 18.0), (16, 1e-2), (32, 3e-7))]
    for ax in work_precision(rows).axes:
        low, high = ax.get_ylim()
        assert all(low < y < high for line in ax.get_lines() for y in line.get_ydata())
    assert work_precision([row(16, 1e-3, 1e-2)]).axes[0].get_ylim() == pytest.approx((0.2e-5, 1.0))


def test_the_published_study_has_a_reference_for_every_problem():
    cases = accuracy.expand(load_study(CONFIGS / "accuracy.yaml")).cases
    problems = {accuracy.problem(c.scene) for c in cases}
    referred = {accuracy.problem(c.scene) for c in cases if c.grid.endswith("_reference")}
    assert problems == referred
    newton = [c.scene for c in cases if c.scene.method == "newton" and not c.grid.endswith("_reference")]
    assert {s.mesh.cells[0] for s in newton} == {16, 32, 64, 128, 256}
    assert {s.tolerance.tangential for s in newton} == {1e-3, 1e-5, 1e-7, 1e-9}
    layered = {(s.coupling, s.discretisation, s.creepage.spin > 0.0) for s in newton if s.layers}
    assert layered == set(product(("one-way", "full"), ("kalker", "aligned"), (False, True)))
    assert {s.discretisation for s in newton if not s.layers} == {"kalker", "aligned"}
    assert {c.scene.discretisation for c in cases if c.grid.endswith("_reference")} == {"aligned"}
    assert all(s.spin_point == pytest.approx(1.0 / 6.0) for s in newton)  # kalker's errors are the smallest with it


@pytest.mark.usefixtures("undrawn")
@pytest.mark.heavy
def test_what_one_way_coupling_neglects_is_told(tmp_path):
    """References of one problem with both couplings, one against the other."""
    path = tmp_path / "both.yaml"
    path.write_text(
        "study: both\n"
        "scene: {substrate: {E: 210000, nu: 0.3}, radius: 50, load: 100, friction: 0.5,\n"
        "  creepage: {longitudinal: 0.0006},\n"
        "  mesh: {size: [0.8, 0.8], cells: [16, 16]}, tolerance: {normal: 1.0e-8, tangential: 1.0e-8}}\n"
        "grids:\n  both: {axes: {coupling: [one-way, full], mesh.cells: [[8, 8], [16, 16]]}}\n"
    )
    study = load_study(path)
    accuracy.run(study, tmp_path / "report", formats=("png",))
    scenes = (case.scene for case in accuracy.expand(study).cases)
    one, full = (solve_scene(scene) for scene in scenes if scene.mesh.cells == (16, 16))
    p, q = (solution.fields["pressure"] for solution in (one, full))
    with xr.open_datatree(tmp_path / "report" / "solutions.nc") as tree:
        ((name, errors),) = accuracy.coupling_errors(accuracy.measured(study, tree))
    assert name.startswith("both: ")
    assert errors["pressure"] == pytest.approx(np.linalg.norm(p - q) / np.linalg.norm(q), rel=1e-5)
    assert f"{100.0 * errors['pressure']:.2g}" in (tmp_path / "report" / "summary.md").read_text()


@pytest.mark.usefixtures("undrawn")
@pytest.mark.heavy
@pytest.mark.parametrize(
    ("scene", "axes", "figures"),
    [
        ("", "tolerance: [{normal: 1.0e-3, tangential: 1.0e-3}, {normal: 1.0e-6, tangential: 1.0e-6}]", ["tolerances"]),
        ("coupling: full, ", "mesh.cells: [[8, 8], [12, 12], [16, 16]]", ["work_precision", "quantities"]),
        ("", "method: [newton, paper-cg]", ["tolerances"]),
    ],
    ids=["one mesh", "full coupling", "two methods"],
)
def test_figures_without_cases_are_neither_drawn_nor_linked(scene, axes, figures, tmp_path):
    path = tmp_path / "few.yaml"
    path.write_text(
        "study: few\nscene: {substrate: {E: 210000, nu: 0.3}, radius: 50, load: 100,\n"
        "  creepage: {longitudinal: 0.001},\n"
        f"  {scene}mesh: {{size: [0.8, 0.8], cells: [16, 16]}}}}\ngrids: {{g: {{axes: {{{axes}}}}}}}\n"
    )
    written = accuracy.run(load_study(path), tmp_path / "report", formats=("png",))
    assert [p.stem for p in written if p.suffix == ".png"] == figures
    summary = (tmp_path / "report" / "summary.md").read_text()
    assert re.findall(r"!\[.*\]\((.*)\.png\)", summary) == figures
    assert ("## Tolerance" in summary) is axes.startswith("tolerance:")  # else it was a table without rows
    one_mesh = "mesh" not in axes
    for text in (summary, (tmp_path / "report" / "settings.md").read_text()):
        assert ("None can be chosen: no case of method newton has numbers on another mesh" in text) is one_mesh


def test_a_study_of_which_no_reference_is_solved_is_refused(tmp_path):
    def unsolved(scene, result):
        return replace(result, status=Status.NOT_CONVERGED) if scene.method == "newton" else result

    with pytest.raises(UserError, match=r"few\.yaml: no problem has a solved case of method newton to serve as"):
        measured_rows(tmp_path, "mesh.cells: [[12, 12], [18, 18]]", unsolved)


TWO_GRIDS = """\
  rolls: {axes: {mesh.cells: [[12, 12], [18, 18]]}}
  still: {scene: {creepage: none}, axes: {load: [50, 100]}}
"""


def test_grids_without_creepage_have_no_errors(tmp_path):
    path = tmp_path / "few.yaml"
    path.write_text(f"{STUDY.partition('grids:')[0]}grids:\n{TWO_GRIDS}", encoding="utf-8")
    study = load_study(path)
    sweep.run(study, tmp_path / "few.nc", workers=1, solve=made_up)
    with open_cube(tmp_path / "few.nc") as tree:
        accuracy.run(study, tmp_path / "report", tree, formats=("png",))
    with xr.open_datatree(tmp_path / "report" / "accuracy.nc") as errors:
        assert list(errors.children) == ["rolls"]
        assert "error_force" in errors["rolls"]
