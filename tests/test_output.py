"""What a command may write over, and what becomes of output that nobody takes."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import synthetic
import workers
import xarray as xr
from studies import BASE, SWEPT, load_text

from rcstudy import solve, store, sweep
from rcstudy.cube import open_cube
from rcstudy.errors import UserError, first_line
from rcstudy.mechanics.scene import Scene
from rcstudy.result import Result
from rcstudy.status import report
from rcstudy.storage import publish
from rcstudy.storage.earlier import is_replaced, refuse_cube, state_of
from rcstudy.workers import pool

LOADS = f"{BASE}  g:\n    axes: {{load: [50, 100]}}\n"


def interrupted_after(most: int) -> pool.Solve:
    """A solver that solves so many cases and is interrupted then."""
    left = iter(range(most))

    def solve_some(scenes: Sequence[Scene]) -> Iterator[Result]:
        for scene in scenes:
            if next(left, None) is None:
                raise KeyboardInterrupt
            yield synthetic.made_up_result(scene)

    return solve_some


def run(folder: Path, shell: str) -> subprocess.CompletedProcess[str]:
    """The command in a shell, `$R` standing for it."""
    command = f"set -o pipefail; R='{sys.executable} -m rcstudy'; {shell}"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent.parent)}
    words = ["bash", "-c", command]
    return subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, timeout=120, check=False)


@pytest.mark.parametrize("name", ["s.yaml", "text.nc", "link.nc"])
def test_nothing_but_a_cube_is_replaced(name: str, tmp_path: Path) -> None:
    """A study that was given as its own output was gone, with exit code 0."""
    study = load_text(tmp_path, SWEPT)
    (tmp_path / "text.nc").write_text("case_key, status_reason, hertz_radius: in all cubes\n", encoding="utf-8")
    (tmp_path / "link.nc").symlink_to("text.nc")
    before = (tmp_path / name).read_bytes()
    with pytest.raises(UserError, match=r"exists and is not an rcstudy cube \(.*\); not overwritten"):
        sweep.run(study, tmp_path / name, workers=1, solve=workers.made_up)
    assert "will be replaced" not in report(study, tmp_path / name)
    assert (tmp_path / name).read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.nc", "s.yaml", "text.nc"]


@pytest.mark.parametrize("kind", ["a folder", "text", "a file in place of the units", "nothing"])
def test_status_tells_what_a_sweep_refuses(kind: str, tmp_path: Path) -> None:
    """It said nothing, or that no cases are taken."""
    study, output = load_text(tmp_path, SWEPT), tmp_path / "c.nc"
    if kind == "a folder":
        output.mkdir()
    elif kind != "nothing":
        place = output if kind == "text" else store.units_folder(output)
        place.write_text("mine\n", encoding="utf-8")
    text = report(study, output)
    if kind == "nothing":
        assert "refused" not in text
        return
    with pytest.raises(UserError) as refusal:
        sweep.run(study, output, workers=1, solve=workers.made_up)
    assert f"a sweep will be refused: {refusal.value}" in text.splitlines()


def test_an_empty_file_is_replaced(tmp_path: Path) -> None:
    """As the documentation says: it holds nothing, and may be what mktemp or a crash has left."""
    study, told = load_text(tmp_path, SWEPT), []
    (tmp_path / "empty.nc").touch()
    assert "will be replaced" in report(study, tmp_path / "empty.nc")
    sweep.run(study, tmp_path / "empty.nc", workers=1, solve=workers.made_up, tell=told.append)
    assert any("empty.nc: no cases are taken from it: " in line and "it will be replaced" in line for line in told)
    assert (tmp_path / "empty.nc").stat().st_size > 0
    text = (Path(__file__).parent.parent / "docs" / "cube.md").read_text(encoding="utf-8")
    assert "An empty file is replaced: " in text


def test_foreign_files_of_hdf5_are_not_replaced(tmp_path: Path) -> None:
    study = load_text(tmp_path, SWEPT)
    with h5py.File(tmp_path / "other.nc", "w") as file:
        file["numbers"] = [1.0, 2.0]
    with pytest.raises(UserError, match="is not an rcstudy cube"):
        sweep.run(study, tmp_path / "other.nc", workers=1, solve=workers.made_up)


@pytest.mark.parametrize("fresh", [False, True])
@pytest.mark.parametrize("damaged", [False, True])
@pytest.mark.parametrize("kind", ["one solution", "part of a cube", "with a variable more"])
def test_what_another_program_saved_is_not_replaced(kind: str, damaged: bool, fresh: bool, tmp_path: Path) -> None:
    """Such files have the attributes of cubes; they were replaced, and with them what their owner had added."""
    study, output = load_text(tmp_path, SWEPT), tmp_path / "c.nc"
    sweep.run(study, output, workers=1, solve=workers.made_up)
    if kind == "one solution":
        scene = {"substrate": {"E": 210000, "nu": 0.3}, "radius": 50, "load": 100}
        solve({**scene, "mesh": {"size": [1, 1], "cells": [16, 16]}}).to_netcdf(output)
    elif kind == "part of a cube":
        part = open_cube(output)["loads"].to_dataset()[["load"]].load().assign(mine=("q", [1.0]))
        output.unlink()
        part.assign_attrs(rcstudy_schema=3).to_netcdf(output, engine="h5netcdf")
    else:
        xr.Dataset({"mine": ("q", [1.0, 2.0])}).to_netcdf(output, mode="a", engine="h5netcdf")
    before = output.read_bytes()[: -100 if damaged else None]
    output.write_bytes(before)
    with pytest.raises(UserError, match="is not an rcstudy cube"):
        sweep.run(study, output, workers=1, solve=workers.made_up, fresh=fresh)
    assert output.read_bytes() == before
    assert "will be replaced" not in report(study, output)


def test_what_an_older_program_added_is_not_replaced(tmp_path: Path) -> None:
    """h5netcdf before 1.7.1 does not sign a file that it adds a variable to, as another engine may."""
    study, output = load_text(tmp_path, SWEPT), tmp_path / "c.nc"
    sweep.run(study, output, workers=1, solve=workers.made_up)
    with h5py.File(output, "r+") as file:
        file["q"], file["mine"] = np.zeros(2, dtype=">f4"), [1.0, 2.0]
        file["q"].make_scale("This is a netCDF dimension but not a netCDF variable.         2")
        file["mine"].dims[0].attach_scale(file["q"])
        for name in ("q", "mine"):
            file[name].attrs["_Netcdf4Dimid"] = np.int32(8)
    with pytest.raises(UserError, match="is not an rcstudy cube"):
        sweep.run(study, output, workers=1, solve=workers.made_up, fresh=True)


@pytest.mark.parametrize("value", [1.0, "text", ((), 2.0, {"units": "mm"})])
@pytest.mark.parametrize("group", [None, "loads", "of_its_own"])
def test_a_cube_with_a_variable_more_that_has_no_dimensions_is_not_replaced(
    value: Any, group: str | None, tmp_path: Path
) -> None:
    """h5netcdf signs nothing that it adds without dimensions; it was gone without a word."""
    study, output = load_text(tmp_path, SWEPT), tmp_path / "c.nc"
    sweep.run(study, output, workers=1, solve=workers.made_up)
    xr.Dataset({"mine": value}).to_netcdf(output, mode="a", engine="h5netcdf", group=group)
    before = output.read_bytes()
    for fresh in (False, True):
        with pytest.raises(UserError, match=r"/mine has no dimensions: .*not overwritten"):
            sweep.run(study, output, workers=1, solve=workers.made_up, fresh=fresh)
    assert output.read_bytes() == before
    assert not is_replaced(output, study.name)


def test_a_cube_of_no_study_is_not_replaced(tmp_path: Path) -> None:
    study, output = load_text(tmp_path, SWEPT), tmp_path / "c.nc"
    sweep.run(study, output, workers=1, solve=workers.made_up)
    with h5py.File(output, "r+") as file:
        del file.attrs["study"]
    with pytest.raises(UserError, match=r"is not an rcstudy cube \(it names no study\); not overwritten"):
        sweep.run(study, output, workers=1, solve=workers.made_up)


@pytest.mark.parametrize("kind", ["text", "the cube of another study", "the same cube, touched"])
def test_what_comes_to_be_there_during_a_sweep(kind: str, tmp_path: Path) -> None:
    """It was replaced at the end; results are kept, and go into the cube once there is room for it."""
    study, output = load_text(tmp_path, SWEPT), tmp_path / "c.nc"
    other = tmp_path / "other.nc"
    sweep.run(load_text(tmp_path, SWEPT.replace("E: 210000", "E: 200000")), other, workers=1, solve=workers.made_up)
    if kind == "the same cube, touched":
        sweep.run(study, output, workers=1, solve=workers.made_up)
    changed = load_text(tmp_path, f"{SWEPT}    # edited\n")

    def solve_meanwhile(scenes: Sequence[Scene]) -> Iterator[Result]:
        for scene in scenes:
            if kind == "text":
                output.write_text("notes", encoding="utf-8")
            elif kind == "the cube of another study":
                output.write_bytes(other.read_bytes().replace(b"swept", b"SWEPT"))
            else:
                output.touch()
            yield synthetic.made_up_result(scene)

    if kind == "the same cube, touched":
        assert sweep.run(changed, output, workers=1, solve=solve_meanwhile, fresh=True).solved == changed.size
        return
    with pytest.raises(UserError, match="not overwritten: choose another --output") as error:
        sweep.run(changed, output, workers=1, solve=solve_meanwhile)
    assert "cases are kept" in str(error.value)
    assert output.read_bytes() == (b"notes" if kind == "text" else other.read_bytes().replace(b"swept", b"SWEPT"))
    output.unlink()
    done = sweep.run(changed, output, workers=1, solve=workers.made_up)
    assert (done.kept, done.solved) == (changed.size, changed.size)


def test_what_comes_to_be_there_before_the_first_case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It counted as what had been there from the beginning, and was replaced."""
    study, output, locked = load_text(tmp_path, SWEPT), tmp_path / "c.nc", store.locked

    @contextlib.contextmanager
    def locked_late(*arguments: Any, **options: Any) -> Iterator[None]:
        with locked(*arguments, **options):
            output.write_text("notes", encoding="utf-8")
            yield

    monkeypatch.setattr(store, "locked", locked_late)
    with pytest.raises(UserError, match="not overwritten: choose another --output"):
        sweep.run(study, output, workers=1, solve=workers.made_up)
    assert output.read_text(encoding="utf-8") == "notes"


def test_a_cube_keeps_its_permissions(tmp_path: Path) -> None:
    """A private one was readable to all after the next sweep."""
    study, output = load_text(tmp_path, SWEPT), tmp_path / "c.nc"
    sweep.run(study, output, workers=1, solve=workers.made_up)
    for mode in (0o600, 0o664):
        output.chmod(mode)
        sweep.run(study, output, workers=1, solve=workers.made_up, fresh=True)
        assert output.stat().st_mode & 0o777 == mode


def test_a_file_that_another_program_writes_to_is_not_replaced(tmp_path: Path) -> None:
    """Be it the study's own cube or none at all: such a file cannot be opened, which does not make it a damaged one."""
    study = load_text(tmp_path, SWEPT)
    sweep.run(study, tmp_path / "own.nc", workers=1, solve=workers.made_up)
    for name in ("own.nc", "foreign.nc"):
        output = tmp_path / name
        code = (
            f"file = h5py.File({str(output)!r}, 'a'); file['n'] = 1; file.flush(); print(flush=True); sys.stdin.read()"
        )
        words = [sys.executable, "-c", f"import h5py, sys; {code}; sys.stdin.read()"]
        with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
            assert other.stdout is not None
            other.stdout.readline()
            before = output.read_bytes()
            with pytest.raises(UserError, match="another program has it open for writing"):
                sweep.run(study, output, workers=1, solve=workers.made_up)
            assert output.read_bytes() == before
            words = "another program has it open for writing"
            with pytest.raises(UserError, match=f"not a readable rcstudy cube: {words}$"):
                open_cube(output)
            assert f"{output}: no cases are taken from it: {words}" in report(study, output).splitlines()
            other.communicate()


def test_a_damaged_file_of_hdf5_that_was_no_cube_is_not_replaced(tmp_path: Path) -> None:
    study, output = load_text(tmp_path, SWEPT), tmp_path / "other.nc"
    with h5py.File(output, "w") as file:
        file["numbers"] = file["status_reason"] = file["hertz_radius"] = [1.0, 2.0]  # two names that cubes have as well
    output.write_bytes(output.read_bytes()[:-100])
    with pytest.raises(UserError, match="is not an rcstudy cube"):
        sweep.run(study, output, workers=1, solve=workers.made_up)


def test_the_state_of_a_file_tells_whether_it_is_still_the_same(tmp_path: Path) -> None:
    """Written to again, or another file of the same size and date in its place."""
    path, other = tmp_path / "c.nc", tmp_path / "d.nc"
    assert state_of(path) == ()
    for file in (path, other):
        file.write_bytes(b"as many")
        os.utime(file, ns=(7, 7))
    before = state_of(path)
    assert before == state_of(path)
    os.utime(path, ns=(7, 8))
    assert state_of(path) != before
    other.replace(path)
    assert state_of(path) != before
    path.write_bytes(b"some more")
    os.utime(path, ns=(7, 7))
    assert state_of(path) != before


def test_the_longest_name_of_a_file(tmp_path: Path) -> None:
    """Whatever is written beside it on the way has a name that is short enough, and what is left over is found."""
    output = tmp_path / f"{'ü' * 120}{'n' * 6}.nc"  # 249 bytes: units need six more
    done = sweep.run(load_text(tmp_path, SWEPT), output, workers=1, solve=workers.made_up)
    assert done.solved == done.cases
    with pytest.raises(ValueError, match="stop"), publish.replacing(output) as temporary:
        temporary.write_bytes(b"half")
        pid = str(os.getpid())
        dead = temporary.with_name(temporary.name.replace(f"-{pid}-", f"-{'9' * len(pid)}-"))  # as good as none
        dead.write_bytes(b"half")
        raise ValueError("stop")
    assert publish.remove_leftovers(tmp_path, output.name) == [dead]
    assert not temporary.exists()


@pytest.mark.parametrize("kind", ["cube", "part of one", "empty"])
def test_cubes_are_replaced_whole_or_damaged(kind: str, tmp_path: Path) -> None:
    study, output = load_text(tmp_path, SWEPT), tmp_path / "c.nc"
    sweep.run(study, output, workers=1, solve=workers.made_up)
    if kind != "cube":
        output.write_bytes(output.read_bytes()[: -100 if kind == "part of one" else 0])
    done = sweep.run(study, output, workers=1, solve=workers.made_up)
    assert done.solved == done.cases


def test_the_cube_of_another_study_is_replaced_only_on_demand(tmp_path: Path) -> None:
    """Two studies in files of the same name would have had one cube; a study that was edited keeps its own."""
    output = tmp_path / "c.nc"
    first = sweep.run(load_text(tmp_path, SWEPT), output, workers=1, solve=workers.made_up)
    renamed = SWEPT.replace("study: ", "study: other-")
    assert sweep.run(load_text(tmp_path, renamed), output, workers=1, solve=workers.made_up).kept == first.cases
    other = load_text(tmp_path, SWEPT.replace("E: 210000", "E: 200000"))
    before = output.read_bytes()
    with pytest.raises(UserError, match="is the cube of another study, "):
        sweep.run(other, output, workers=1, solve=workers.made_up)
    assert output.read_bytes() == before
    assert "the cube is of another study, " in report(other, output)
    assert is_replaced(output, "other-swept")
    assert not is_replaced(output, "swept")
    assert "another study" not in report(load_text(tmp_path, renamed), output)
    # nor where units of the other study are there from elsewhere
    with pytest.raises(sweep.Interrupted):
        sweep.run(other, tmp_path / "d.nc", workers=1, solve=interrupted_after(3))
    (tmp_path / "d.nc.units").rename(tmp_path / "c.nc.units")
    with pytest.raises(UserError, match="is the cube of another study, "):
        sweep.run(other, output, workers=1, solve=workers.made_up)
    assert output.read_bytes() == before
    done = sweep.run(other, output, workers=1, solve=workers.made_up, fresh=True)
    assert (done.kept, done.solved) == (0, done.cases)


def test_the_same_study_in_a_cube_that_another_program_saved(tmp_path: Path) -> None:
    """netCDF's library stores text of attributes otherwise: it is of no use, but of no other study."""
    study, output = load_text(tmp_path, SWEPT), tmp_path / "c.nc"
    sweep.run(study, output, workers=1, solve=workers.made_up)
    with h5py.File(output, "r+") as file:
        file.attrs["study"] = np.bytes_(study.name)
        del file["loads"].attrs["numbers_sha256"]
    done = sweep.run(study, output, workers=1, solve=workers.made_up)
    assert (done.kept, done.solved) == (0, done.cases)


@pytest.mark.parametrize(
    ("error", "line"),
    [(ValueError("one\ntwo"), "one"), (ValueError(" \n one \n"), "one"), (IndexError(), "IndexError")],
)
def test_errors_are_told_by_their_first_line_or_their_type(error: Exception, line: str) -> None:
    assert first_line(error) == line


def test_a_file_in_place_of_the_units(tmp_path: Path) -> None:
    """It was the cube that could not be written."""
    (tmp_path / "c.nc.units").touch()
    with pytest.raises(UserError, match=r"/c\.nc\.units: is a file, not a folder$"):
        sweep.run(load_text(tmp_path, SWEPT), tmp_path / "c.nc", workers=1, solve=workers.made_up)


def test_a_device_is_no_output(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A socket stands for one: /dev/null itself would be gone if this were not refused, and root ran it."""
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as device, pytest.raises(UserError, match="is a device or the like, not a file"):
        device.bind("c.nc")
        sweep.run(load_text(tmp_path, SWEPT), tmp_path / "c.nc", workers=1, solve=workers.made_up)


@pytest.mark.heavy
def test_output_that_nobody_takes(tmp_path: Path) -> None:
    """A reader that has seen enough, a full disk, a stream that is closed: no traceback, no word of a damaged cube."""
    study = load_text(tmp_path, SWEPT)
    sweep.run(study, tmp_path / "c.nc", workers=1, solve=workers.made_up)
    for shell, code, said in (
        ("$R show c.nc | head -1", 0, ""),
        ("$R plan s.yaml > /dev/full", 2, "output: No space left on device\n"),
        ("$R show c.nc > /dev/full", 2, "output: No space left on device\n"),
        ("$R plan s.yaml >&-", 0, ""),
        ("$R tables c.nc -o s.yaml", 2, "s.yaml: is a file, not a folder\n"),
    ):
        done = run(tmp_path, shell)
        assert done.returncode in (code, 141) if "head" in shell else done.returncode == code, (shell, done)
        assert done.stderr == said, shell


@pytest.mark.parametrize("words", ["--help", "sweep --help", "--version"])
def test_help_that_nobody_takes(words: str, tmp_path: Path) -> None:
    """What typer prints itself ended in a traceback, or in exit code 1 where a reader had seen enough."""
    for unbuffered in ("", "1"):
        done = run(tmp_path, f"PYTHONUNBUFFERED={unbuffered} $R {words} > /dev/full")
        assert (done.returncode, done.stderr) == (2, "output: No space left on device\n")
    done = run(tmp_path, f"( sleep 1; $R {words} ) | true")
    assert (done.returncode, done.stderr) == (141, "")


def test_help_for_a_command_without_words_is_an_error(tmp_path: Path) -> None:
    done = run(tmp_path, "$R > /dev/full")
    assert done.returncode == 2
    assert done.stderr.startswith("Usage: ")
    assert "Traceback" not in done.stderr


@pytest.mark.heavy
def test_text_that_an_output_cannot_encode(tmp_path: Path) -> None:
    """Labels and names of files in other scripts, or in none: escaped, with the exit code of what was done."""
    load_text(tmp_path, f"{BASE}  g:\n    cases: [{{label: 5 €}}]\n")
    for shell, said in (
        ("$R sweep s.yaml --workers 1 -q -o ü.nc", r"; \xfc.nc: "),
        ("$R show ü.nc", r"5 \u20ac"),
        ("cp s.yaml $'caf\\xe9.yaml' && $R sweep $'caf\\xe9.yaml' --workers 1 -q", r"; caf\udce9.nc: "),
    ):
        done = run(tmp_path, f"export PYTHONIOENCODING=ascii; {shell}")
        assert (done.returncode, done.stderr) == (0, ""), shell
        assert said in done.stdout, shell
    with h5py.File(tmp_path / os.fsdecode(b"caf\xe9.nc")) as file:
        assert file.attrs["command"] == r"python -m rcstudy sweep 'caf\udce9.yaml' --workers 1 -q"


@pytest.mark.heavy
@pytest.mark.parametrize("elsewhere", ["2>&-", "2>/dev/full", ">&- 2>&- <&-"])
def test_messages_that_nobody_takes_change_nothing(elsewhere: str, tmp_path: Path) -> None:
    hard = "{method: paper-cg, creepage: {longitudinal: 0.001}, tolerance: {tangential: 1.0e-12}}"
    load_text(tmp_path, f"{LOADS}  h:\n    scene: {hard}\n    axes: {{load: [50]}}\n")
    assert run(tmp_path, f"$R sweep s.yaml --workers 1 {elsewhere}").returncode == 3
    load_text(tmp_path, LOADS)
    assert run(tmp_path, f"$R sweep s.yaml --workers 2 --fresh {elsewhere}").returncode == 0
    assert run(tmp_path, f"$R sweep none.yaml --workers 1 {elsewhere}").returncode == 2


@pytest.mark.heavy
@pytest.mark.parametrize("command", ["tables", "figures --formats png", "figures --formats pdf"])
def test_a_disk_that_is_full(command: str, tmp_path: Path) -> None:
    """It is the output that is at fault, and nothing is left of it; files are limited to a kilobyte in its place."""
    study = load_text(tmp_path, LOADS)
    sweep.run(study, tmp_path / "c.nc", workers=1, solve=workers.made_up)
    done = run(tmp_path, f"ulimit -f 1; $R {command} c.nc -o out")
    assert done.returncode == 2
    said = done.stderr.splitlines()[-1]  # the first figures of a machine say that fonts are not cached either
    assert said.startswith("out/")
    assert said.endswith(": cannot be written: File too large")
    assert not [path for path in (tmp_path / "out").iterdir() if path.stat().st_size in (0, 1024)]


def test_figures_need_no_backend_for_screens(tmp_path: Path) -> None:
    """One that is set and not there was taken for damage of the cube."""
    study = load_text(tmp_path, LOADS)
    sweep.run(study, tmp_path / "c.nc", workers=1, solve=workers.made_up)
    done = run(tmp_path, "MPLBACKEND=nowhere $R figures c.nc -o figures --formats png")
    assert (done.returncode, done.stderr) == (0, "")
    assert list((tmp_path / "figures").glob("*.png"))


def test_a_cube_is_refused_where_none_is_to_be_written(tmp_path: Path) -> None:
    path = tmp_path / "c.nc"
    refuse_cube(path)  # nothing there
    with h5py.File(path, "w") as file:
        file["numbers"] = [1.0, 2.0]
    refuse_cube(path)
    with h5py.File(path, "r+") as file:
        file.attrs["rcstudy_schema"] = 1
    with pytest.raises(UserError, match="is a cube; not overwritten"):
        refuse_cube(path)
