"""The commands for many cases: resuming, shards, merge, status, failures; what they print and their exit codes."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import cubes
import pytest
import synthetic
import workers
from typer.testing import CliRunner, Result

from rcstudy import cli, provenance, sweep
from rcstudy.mechanics.scene import Scene
from rcstudy.result import Result as Outcome
from rcstudy.result import Status
from rcstudy.storage import lock

STUDY = """
study: many
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  mesh: {size: [0.8, 0.8], cells: [12, 16]}
  load: 60
grids:
  loads:
    axes:
      load: [20, 40, 60, 80]
      creepage: [{label: a, longitudinal: 0.001}, {label: b, spin: 0.01}]
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the study `many.yaml`, made the current one; results are made up."""
    (tmp_path / "many.yaml").write_text(STUDY)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sweep, "solve_batch", workers.made_up)
    return tmp_path


def run(*arguments: str, code: int = 0) -> Result:
    found = CliRunner().invoke(cli.app, list(arguments))
    assert found.exit_code == code, found.output
    assert "Traceback" not in found.output
    return found


def solve(monkeypatch: pytest.MonkeyPatch, *, fails: float = 0.0, interrupt: float = 0.0) -> None:
    """Have a solver that fails at one load and is interrupted at another."""

    def solver(scenes: Sequence[Scene]) -> Iterator[Outcome]:
        for scene in scenes:
            if scene.load == interrupt:
                raise KeyboardInterrupt
            status = Status.NOT_CONVERGED if scene.load == fails else Status.SOLVED
            yield synthetic.made_up_result(scene, status)

    monkeypatch.setattr(sweep, "solve_batch", solver)


def test_interrupted_and_resumed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    solve(monkeypatch, interrupt=60.0)
    found = run("sweep", "many.yaml", "--workers", "1", code=cli.EXIT_INTERRUPTED)
    words = "interrupted: many.nc was not written; 4 of 8 cases are kept: rerun the same command to resume"
    assert found.stderr.splitlines()[-1] == words
    assert found.stdout == ""
    assert "loads         8         4         0         4" in run("status", "many.yaml").stdout
    solve(monkeypatch)
    found = run("sweep", "many.yaml", "--workers", "1")
    assert found.stderr.splitlines()[:2] == ["4 of 8 cases are solved already and kept", "solving 4 cases"]
    assert "8 of 8 cases solved in " in found.stdout
    assert ", 4 of them before; many.nc: " in found.stdout
    found = run("sweep", "many.yaml")
    assert found.stderr == ""
    assert ", 8 of them before; many.nc: " in found.stdout
    assert "solving 8 cases" in run("sweep", "many.yaml", "--fresh").stderr
    assert "8         8         0         0" in run("status", "many.yaml").stdout


def test_cases_of_another_revision_are_told(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of cubes, which name the revision that wrote them; within one version of the solver that is no fault."""
    solve(monkeypatch, fails=40.0)
    monkeypatch.setattr(provenance, "revision", lambda: f"{'1' * 40}+changes")
    run("sweep", "many.yaml", "--workers", "1", code=cli.EXIT_FAILED_CASES)
    solve(monkeypatch)
    monkeypatch.setattr(provenance, "revision", lambda: "2" * 40)
    words = ", 6 of them before (6 in a cube that revision 1111111+changes of rcstudy wrote); many.nc: "
    assert words in run("sweep", "many.yaml", "--workers", "1").stdout
    assert ", 8 of them before; many.nc: " in run("sweep", "many.yaml").stdout
    for other, told in (("3" * 40, " (8 in a cube that revision 2222222 of rcstudy wrote)"), (None, "")):
        monkeypatch.setattr(provenance, "revision", lambda own=other: own)
        assert f", 8 of them before{told}; many.nc: " in run("sweep", "many.yaml").stdout


def test_failures(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    solve(monkeypatch, fails=40.0)
    found = run("sweep", "many.yaml", "--workers", "1", code=cli.EXIT_FAILED_CASES)
    assert "loads: load=40, creepage=a: not converged: made up not to converge" in found.stderr
    assert "rcstudy failures many.nc lists the unsolved cases" in found.stderr
    command = "sweep", "many.yaml", "--workers", "1", "-o", "two words.nc"
    assert "rcstudy failures 'two words.nc' lists" in run(*command, code=cli.EXIT_FAILED_CASES).stderr
    found = run("failures", "many.nc")
    assert found.stderr == "2 cases are not solved\n"
    assert found.stdout.count("\n---\n") == 1
    assert (
        "# loads: load=40, creepage=b: not converged: made up not to converge\nstudy: many-loads-2-2\n" in found.stdout
    )
    found = run("failures", "many.nc", "-o", "failed")
    assert found.stdout.split() == ["failed/many-loads-2-1.yaml", "failed/many-loads-2-2.yaml"]
    run("sweep", "failed/many-loads-2-1.yaml", "--workers", "1", code=cli.EXIT_FAILED_CASES)
    solve(monkeypatch)
    found = run("sweep", "failed/many-loads-2-1.yaml", "--workers", "1")
    assert "1 of 1 cases solved" in found.stdout
    assert "8 of 8 cases solved" in run("sweep", "many.yaml", "--workers", "1").stdout
    assert run("failures", "many.nc").stderr == "all cases are solved\n"


def test_shards_and_merge(folder: Path) -> None:
    for i in (1, 2, 3):
        found = run("sweep", "many.yaml", "--shard", f"{i}/3", "--workers", "1")
        assert found.stdout.startswith(f"shard {i}/3: ")
        assert found.stdout.endswith("; run rcstudy merge once all shards are done\n")
        if i == 2:
            found = run("merge", "many.yaml", code=cli.EXIT_BAD_INPUT)
            assert "many.nc: 2 of 8 cases are missing; rcstudy sweep solves them:" in found.stderr
    assert "8 of 8 cases solved in " in run("merge", "many.yaml").stdout
    run("sweep", "many.yaml", "-o", "whole.nc", "--workers", "1")
    cubes.assert_same(folder / "many.nc", folder / "whole.nc")
    assert sorted(entry.name for entry in folder.iterdir()) == ["many.nc", "many.yaml", "whole.nc"]


def test_merge_of_failed_cases(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    solve(monkeypatch, fails=40.0)
    for i in (1, 2):
        code = cli.EXIT_FAILED_CASES if i == 2 else 0
        found = run("sweep", "many.yaml", "--shard", f"{i}/2", "--workers", "1", "-o", f"{i}.nc", code=code)
    assert "load=40" in found.stderr
    found = run("merge", "many.yaml", "1.nc.units", "2.nc.units", code=cli.EXIT_FAILED_CASES)
    line = r"6 of 8 cases solved in [0-9.]+ s, 6 of them before; many\.nc: [0-9.]+ kB\n"
    assert re.fullmatch(line, found.stdout), found.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["sweep", "many.yaml", "--shard", "3"], "--shard: 3: I/N"),
        (["sweep", "many.yaml", "--shard", "3/2"], "--shard: 3/2: I/N"),
        (["sweep", "many.yaml", "--shard", "0/2"], "--shard: 0/2: I/N"),
        (["sweep", "many.yaml", "--shard", f"1/{'9' * 5000}"], "--shard: 1/9999"),
        (["sweep", "many.yaml", "--shard", "1/2", "--fresh"], "--fresh cannot be used with --shard"),
        (["merge", "many.yaml"], "8 of 8 cases are missing"),
        (["merge", "many.yaml", "nowhere"], "nowhere: does not exist, nor does nowhere.units"),
        (["merge", "none.yaml"], "none.yaml"),
        (["status", "none.yaml"], "none.yaml"),
        (["failures", "none.nc"], "none.nc: no such file"),
        (["sweep", "many.yaml", "-o", "/"], "--output: must have the name of a file, such as many.nc"),
        (["status", "many.yaml", "-o", "."], "--output: must have the name of a file, such as many.nc"),
        (["failures", "many.yaml"], "not a readable rcstudy cube"),
    ],
)
def test_bad_input(folder: Path, arguments: list[str], words: str) -> None:
    found = run(*arguments, code=cli.EXIT_BAD_INPUT)
    assert words in found.stderr
    assert sorted(entry.name for entry in folder.iterdir()) == ["many.yaml"]


def test_the_second_sweep_is_refused(folder: Path) -> None:
    with lock.locked(folder / "many.nc.units"):
        for command in ("sweep", "merge"):
            found = run(command, "many.yaml", code=cli.EXIT_BAD_INPUT)
            assert "is at work on this output: wait until it has finished, or choose another --output" in found.stderr
        assert "at work: process " in run("status", "many.yaml").stdout
    run("sweep", "many.yaml", "--workers", "1")


def test_all_who_are_at_work_are_named(folder: Path) -> None:
    units = folder / "many.nc.units"
    with lock.locked(units, (1, 3)), lock.locked(units, (2, 3)):
        found = run("sweep", "many.yaml", code=cli.EXIT_BAD_INPUT)
    assert re.search(
        r"\(shard 1 of 3\) and process .* \(shard 2 of 3\) are at work on this output: wait until they have finished",
        found.stderr,
    )


def test_another_machines_lock(folder: Path) -> None:
    (folder / "many.nc.units").mkdir()
    text = '{"host": "elsewhere", "boot": "b", "pid": 1, "started": 1}'
    (folder / "many.nc.units" / "lock").write_text(text)
    assert "add --unlock" in run("sweep", "many.yaml", code=cli.EXIT_BAD_INPUT).stderr
    run("sweep", "many.yaml", "--workers", "1", "--unlock")


def test_a_cube_of_a_study_that_is_not_understood(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import h5py

    solve(monkeypatch, fails=40.0)
    run("sweep", "many.yaml", "--workers", "1", code=cli.EXIT_FAILED_CASES)
    with h5py.File("many.nc", "r+") as file:
        file.attrs["study_text"] = "study: many\nshoe: 1\n"
    assert "not understood by this version" in run("failures", "many.nc", code=cli.EXIT_BAD_INPUT).stderr
    with h5py.File("many.nc", "r+") as file:
        file.attrs["study_text"] = STUDY.replace("loads:", "others:")
    assert "its study has no case" in run("failures", "many.nc", code=cli.EXIT_BAD_INPUT).stderr


def test_columns_of_the_status_stand_below_each_other(folder: Path) -> None:
    (folder / "many.yaml").write_text(f"{STUDY}  loads_of_a_grid_with_a_long_name: {{axes: {{load: [20, 40]}}}}\n")
    lines = run("status", "many.yaml").stdout.splitlines()
    (first,) = [k for k, line in enumerate(lines) if line.startswith("grid ")]
    assert [line.split()[0] for line in lines[first : first + 4]] == [
        "grid",
        "loads",
        "loads_of_a_grid_with_a_long_name",
        "total",
    ]
    assert len({len(line) for line in lines[first : first + 4]}) == 1
