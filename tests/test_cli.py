"""The command line: what each command prints, and the exit codes others rely on."""

from __future__ import annotations

import csv
import errno
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
import synthetic
from studies import OLD
from typer.testing import CliRunner, Result
from workers import gone

from rcstudy import __main__ as main_module
from rcstudy import accuracy, cli, cube, plan, progress, sweep, threads
from rcstudy.cube import case_table, open_cube
from rcstudy.errors import EXIT_BAD_INPUT, EXIT_BROKEN_PIPE, EXIT_INTERRUPTED, UserError, is_interrupt
from rcstudy.report import overview
from rcstudy.report.quantities import CHOICES
from rcstudy.result import Status
from rcstudy.sweep import Failure, Summary

ROOT = Path(__file__).parent.parent

STUDY = """
study: quick
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  mesh: {size: [0.8, 0.8], cells: [16, 16]}
  load: 60
grids:
  quick:
    axes:
      creepage: [{label: a, longitudinal: 0.001}, {label: b, spin: 0.01}]
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the study `quick.yaml`, made the current one."""
    (tmp_path / "quick.yaml").write_text(STUDY)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(cli.app, [str(argument) for argument in arguments])


def process(*arguments: str, **options: object) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"}
    command = [sys.executable, "-m", "rcstudy", *arguments]
    return subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options
    )


@pytest.mark.parametrize(
    "command", ["sweep", "merge", "status", "failures", "plan", "show", "compare", "figures", "tables"]
)
def test_help(command: str) -> None:
    assert command in run("--help").output
    found = run(command, "--help")
    assert found.exit_code == 0
    assert "Usage" in found.output


def test_help_of_sweep_has_its_exit_codes() -> None:
    words = run("sweep", "--help").output
    for code in (0, EXIT_BAD_INPUT, cli.EXIT_FAILED_CASES, EXIT_INTERRUPTED, EXIT_BROKEN_PIPE):
        assert re.search(rf"\b{code}\b", words.partition("Exit codes")[2].partition("Options")[0]), code


def test_version() -> None:
    found = run("--version")
    assert found.exit_code == 0
    assert found.output.startswith("rcstudy ")


@pytest.mark.heavy
def test_sweep_show_and_compare(folder: Path) -> None:
    found = run("sweep", "quick.yaml", "--workers", "1")
    assert found.exit_code == 0, found.output
    assert "2 of 2 cases solved" in found.output
    assert "quick.nc" in found.output
    assert sorted(entry.name for entry in folder.iterdir()) == ["quick.nc", "quick.yaml"]
    shown = run("show", "quick.nc")
    assert shown.exit_code == 0
    for words in (
        "study       quick",
        "cases       2: 2 solved, 0 not",
        "quick: creepage 2; 16 x 16 cells",
        "proof_stick",
    ):
        assert words in shown.output
    again = run("sweep", "quick.yaml", "-o", folder / "new" / "again.nc", "--workers", "1", "--quiet")
    assert again.exit_code == 0
    assert "solving" not in again.output
    same = run("compare", "quick.nc", "new/again.nc")
    assert same.exit_code == 0, same.output
    assert "same: 2 cases compared, 0 values beyond tolerance" in same.output


@pytest.mark.heavy
def test_a_whole_sweep_from_outside(folder: Path) -> None:
    """Its own processes, plain lines, a name with a dot; the provenance has the command."""
    sweep = process("sweep", "quick.yaml", "-o", "out.put.nc", "--workers", "2", cwd=folder)
    out, err = sweep.communicate(timeout=300)
    assert (sweep.returncode, out.startswith("2 of 2 cases solved")) == (0, True), err
    assert err.splitlines()[0] == "solving 2 cases"
    with open_cube(folder / "out.put.nc") as tree:
        assert tree.attrs["command"] == "python -m rcstudy sweep quick.yaml -o out.put.nc --workers 2"


@pytest.mark.heavy
def test_failed_cases(folder: Path) -> None:
    """A method that stops short of its tolerance: exit code 3, and the cube says so."""
    text = STUDY.replace("load: 60", "load: 60\n  method: paper-cg\n  friction: 0.3")
    (folder / "strict.yaml").write_text(text)
    found = run("sweep", "strict.yaml", "--workers", "1")
    assert found.exit_code == cli.EXIT_FAILED_CASES, found.output
    assert "quick: creepage=a: not converged: " in found.output
    with open_cube("strict.nc") as tree:
        table = case_table(tree)
        assert (table.status != Status.SOLVED).all()
        assert (table.status_reason != "").all()
    shown = run("show", "strict.nc")
    assert shown.exit_code == 0
    assert "2 cases are not solved:" in shown.output
    assert run("compare", "strict.nc", "strict.nc").exit_code == cli.EXIT_DIFFERENT
    assert run("compare", "strict.nc", "strict.nc", "--allow-unsolved").exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["sweep", "none.yaml"], "none.yaml"),
        (["plan", "none.yaml"], "none.yaml"),
        (["show", "none.nc"], "none.nc: no such file"),
        (["show", "quick.yaml"], "not a readable rcstudy cube"),
        (["compare", "none.nc", "none.nc"], "none.nc: no such file"),
        (["figures", "none.nc"], "none.nc: no such file"),
        (["tables", "quick.yaml"], "not a readable rcstudy cube"),
        (["sweep", "bad.yaml"], "bad.yaml:1:1: shoe"),
        (["sweep", "quick.yaml", "-o", "quick.yaml/c.nc"], "cannot be written"),
        (["sweep", "quick.yaml", "--workers", "0"], "--workers: 0: must be a whole number of at least 1"),
        (["sweep", "quick.yaml", "--workers", "two"], "--workers: two: must be a whole number of at least 1"),
        (["sweep"], "SPEC"),
        (["swoop"], "swoop"),
        (["compare", "none.nc", "none.nc", "--rtol", "force_x"], "VARIABLE=VALUE"),
        (["compare", "none.nc", "none.nc", "--tolerances", "none.yaml"], "none.yaml"),
    ],
)
def test_bad_input(folder: Path, arguments: list[str], words: str) -> None:
    (folder / "bad.yaml").write_text("shoe: 1\n")
    found = run(*arguments)
    assert found.exit_code == cli.EXIT_BAD_INPUT, found.output
    assert words in found.output
    assert "Traceback" not in found.output
    assert found.exception is None or isinstance(found.exception, SystemExit)


def test_compare_options(tmp_path: Path) -> None:
    reference = synthetic.write(tmp_path / "reference.nc", synthetic.small())
    made = synthetic.small()
    for _, result in made.results:
        result.scalars["force_x"] *= 1.001
    other = synthetic.write(tmp_path / "other.nc", made)
    found = run("compare", other, reference)
    assert found.exit_code == cli.EXIT_DIFFERENT
    assert "force_x: 1.00e-03" in found.output
    assert run("compare", other, reference, "--rtol", "force_x=0.01").exit_code == 0
    (tmp_path / "t.yaml").write_text("variables: {force_x: 1e-2}\n")
    assert run("compare", other, reference, "--tolerances", tmp_path / "t.yaml").exit_code == 0
    tight = ("--tolerances", tmp_path / "t.yaml", "--rtol", "force_x=1e-9", "--state-flips", "0")
    assert run("compare", other, reference, *tight).exit_code == cli.EXIT_DIFFERENT
    assert run("compare", other, reference, "--rtol", "shoe=1").exit_code == cli.EXIT_BAD_INPUT
    for flips in (-1, 1001, "1e3"):
        found = run("compare", other, reference, "--state-flips", flips)
        assert found.exit_code == cli.EXIT_BAD_INPUT
        assert f"--state-flips: {flips}: a whole number from 0 to 1000" in found.output


def test_plan(folder: Path) -> None:
    found = run("plan", "quick.yaml")
    assert found.exit_code == 0, found.output
    assert "2" in found.output
    assert sorted(entry.name for entry in folder.iterdir()) == ["quick.yaml"]


def heeding() -> None:
    """What started the tests may have been told to ignore a signal, as `nohup` does."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def in_the_background() -> None:
    """A shell without job control has what it starts with & ignore Ctrl-C."""
    heeding()
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def start_long_sweep(folder: Path, workers: str, prepare: Callable[[], None] = heeding) -> subprocess.Popen[str]:
    """A sweep of 800 cases over an old cube `long.nc`, in a process group of its own, at its first cases."""
    loads = ", ".join(str(load) for load in range(20, 420))
    text = STUDY.replace("    axes:\n", f"    axes:\n      load: [{loads}]\n").replace("0.8, 0.8", "3, 3")
    (folder / "long.yaml").write_text(text)
    (folder / "long.nc").write_bytes(OLD)
    sweep = process("sweep", "long.yaml", "--workers", workers, cwd=folder, start_new_session=True, preexec_fn=prepare)
    assert sweep.stderr is not None
    first = sweep.stderr.readline()
    if first.startswith("long.nc: no cases are taken from it"):
        first = sweep.stderr.readline()
    if first != "solving 800 cases\n":
        sweep.kill()
        out, err = sweep.communicate(timeout=60)
        pytest.fail(f"no sweep: exit code {sweep.returncode}, output {out!r}, errors {first + err!r}")
    time.sleep(0.3)  # into the imports, the warm-up or the first cases
    return sweep


@pytest.mark.parametrize(
    ("workers", "prepare", "end"),
    [
        ("1", heeding, signal.SIGINT),
        ("1", heeding, signal.SIGHUP),
        ("1", in_the_background, signal.SIGTERM),
        ("2", heeding, signal.SIGINT),
        ("2", heeding, signal.SIGTERM),
        ("2", in_the_background, signal.SIGHUP),
    ],
)
def test_ctrl_c(tmp_path: Path, workers: str, prepare: Callable[[], None], end: signal.Signals) -> None:
    """To the whole process group, as terminals and batch systems do it, once the sweep says that it solves."""
    sweep = start_long_sweep(tmp_path, workers, prepare)
    os.killpg(sweep.pid, end)
    out, err = sweep.communicate(timeout=60)
    assert sweep.returncode == cli.EXIT_INTERRUPTED, err
    assert out == ""
    told = re.fullmatch(
        r"interrupted: long.nc is as it was; (\d+) of 800 cases are kept: rerun the same command to resume",
        err.splitlines()[-1],
    )
    assert told, err
    assert "Traceback" not in err
    assert (tmp_path / "long.nc").read_bytes() == OLD
    units = ["long.nc.units"] if int(told[1]) else []
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["long.nc", *units, "long.yaml"]
    assert gone(sweep.pid), "a worker is left"


def test_ctrl_c_while_a_class_is_being_made() -> None:
    """As in imports, where Python 3.11 wraps the exception; other errors of that kind are none."""

    class Interrupting:
        def __set_name__(self, owner: type, name: str) -> None:
            raise KeyboardInterrupt

    with pytest.raises((KeyboardInterrupt, RuntimeError)) as raised:
        type("Made", (), {"attribute": Interrupting()})
    assert is_interrupt(raised.value)
    assert is_interrupt(KeyboardInterrupt())
    assert not is_interrupt(RuntimeError())
    with pytest.raises(sweep.Interrupted), sweep._interrupts([], Mock()):
        raise raised.value
    with pytest.raises(RuntimeError, match="other"), sweep._interrupts([], Mock()):
        raise RuntimeError("other")


@pytest.mark.parametrize(("told", "words"), [(False, "interrupted\n"), (True, "")])
def test_ctrl_c_while_the_command_line_is_read(
    told: bool, words: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """typer leaves without a word then; commands that were at work have said theirs."""

    def app(**_: object) -> None:
        if told:
            raise SystemExit(cli.EXIT_INTERRUPTED)
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as error:
            raise SystemExit(cli.EXIT_INTERRUPTED) from error

    monkeypatch.setattr(cli, "app", app)
    assert main_module._run(None) == cli.EXIT_INTERRUPTED
    assert capsys.readouterr().err == words


def test_ends_that_are_ignored_stay_so() -> None:
    """`nohup`, and jobs in the background of a script, which Ctrl-C does not reach."""
    for ignored in ("HUP", "INT"):
        words = f"trap '' {ignored}; exec {sys.executable} -c"
        code = (
            "import signal; from rcstudy.__main__ import heed_terminations; heed_terminations(); "
            "print([callable(signal.getsignal(s)) for s in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)])"
        )
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        command = ["bash", "-c", f'{words} "{code}"']
        # whatever this process itself ignores, as under nohup
        ran = subprocess.run(
            command, env=environment, capture_output=True, text=True, check=True, timeout=60, preexec_fn=heeding
        )
        assert ran.stdout == {"HUP": "[True, True, False]\n", "INT": "[False, True, True]\n"}[ignored]


def test_a_study_that_is_refused_leaves_no_workers(tmp_path: Path) -> None:
    """They start before the study is read."""
    (tmp_path / "bad.yaml").write_text("study: bad\nscene: 5\n")
    command = [sys.executable, "-m", "rcstudy", "sweep", "bad.yaml", "--workers", "2"]
    sweep = subprocess.Popen(
        command,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    out, err = sweep.communicate(timeout=60)
    assert (sweep.returncode, out) == (cli.EXIT_BAD_INPUT, "")
    assert "bad.yaml:2:8: scene: 5: a mapping of scene keys" in err
    assert "Traceback" not in err
    assert gone(sweep.pid), "a worker is left"
    assert [entry.name for entry in tmp_path.iterdir()] == ["bad.yaml"]


def test_ctrl_c_while_kernels_are_loaded_to_read_a_study(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Windows are fitted by solving pressures: LLVM, interrupted in a callback, left half a kernel and a traceback."""
    place: dict[str, Any] = {"__name__": "llvmlite.made_up", "signal": signal, "time": time, "steps": []}
    exec("def load():\n    signal.raise_signal(signal.SIGINT)\n    time.sleep(0.1)\n    steps.append('done')\n", place)
    monkeypatch.setattr("rcstudy.study.load_study", lambda path: (place["load"](), time.sleep(5.0)))
    done = run("plan", "quick.yaml")
    assert (done.exit_code, done.stderr, place["steps"]) == (EXIT_INTERRUPTED, "interrupted\n", ["done"])


def test_ctrl_c_before_a_sweep_solves_says_how_to_resume(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Large studies, and cubes with many solved cases, are read for seconds."""
    monkeypatch.setattr("rcstudy.sweep._left", Mock(side_effect=KeyboardInterrupt))
    done = run("sweep", "quick.yaml", "--workers", "1")
    assert (done.exit_code, done.stderr) == (EXIT_INTERRUPTED, "interrupted: rerun the same command to resume\n")
    assert [entry.name for entry in folder.iterdir()] == ["quick.yaml"]


def test_ctrl_c_inside_text_that_is_executed(folder: Path) -> None:
    """As when dataclasses are made: CPython then forgets that it was dealt with, and `python -m` dies of SIGINT."""
    (folder / "sitecustomize.py").write_text(
        "import rcstudy.study\n"
        "def interrupted(path):\n"
        "    exec('raise KeyboardInterrupt')\n"
        "rcstudy.study.load_study = interrupted\n"
    )
    environment = {**os.environ, "PYTHONPATH": f"{folder}{os.pathsep}{ROOT}"}
    command = [sys.executable, "-m", "rcstudy", "plan", "quick.yaml"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (cli.EXIT_INTERRUPTED, "interrupted\n")


def test_ctrl_c_when_all_is_done(folder: Path) -> None:
    """A second one, or one too late, while workers are ended: the code was 130, and 'interrupted' was told again."""
    (folder / "sitecustomize.py").write_text(
        "import os, signal, rcstudy.workers.pool\n"
        "stop = rcstudy.workers.pool.Pool.stop\n"
        "rcstudy.workers.pool.Pool.stop = lambda pool: (os.kill(os.getpid(), signal.SIGINT), stop(pool))\n"
    )
    environment = {**os.environ, "PYTHONPATH": f"{folder}{os.pathsep}{ROOT}"}
    command = [sys.executable, "-m", "rcstudy", "sweep", "none.yaml", "--workers", "2"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, len(done.stderr.splitlines())) == (cli.EXIT_BAD_INPUT, 1), done.stderr


def test_killed_in_the_middle(tmp_path: Path) -> None:
    """The old cube stays, the workers leave by themselves, and the next writer clears up."""
    sweep = start_long_sweep(tmp_path, "2")
    sweep.kill()
    sweep.communicate(timeout=60)
    assert (tmp_path / "long.nc").read_bytes() == OLD
    assert gone(sweep.pid), "a worker is left"
    # the new cube was in the making
    names = sorted(entry.name for entry in tmp_path.iterdir() if not entry.name.startswith("long.nc.tmp-"))
    assert names == ["long.nc", "long.nc.units", "long.yaml"]
    synthetic.write(tmp_path / "long.nc", synthetic.small())
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["long.nc", "long.nc.units", "long.yaml"]


def test_tables_of_moduli_in_words_and_of_pressures_among_tractions(tmp_path: Path) -> None:
    """An axis of `0.5 Es` beside MPa has no numbers; a case without creepage among others has none of its own."""
    path = tmp_path / "words.yaml"
    path.write_text(
        "study: words\n"
        "scene: {substrate: {E: 210000, nu: 0.3}, radius: 50, load: 100, mesh: {size: [1.2, 1.2], cells: [8, 8]}}\n"
        "grids:\n"
        "  g: {coating: {layer_count: 1, layer_nu: 0.3, thickness: 0.1 a},\n"
        "    axes: {modulus: [0.5 Es, 200000], substrate.E: [210000, 100000]}}\n"
        "  l: {cases: [{label: p}, {label: q, creepage: {longitudinal: 0.001}}]}\n"
    )
    assert run("sweep", path, "-o", tmp_path / "words.nc", "-q").exit_code == 0
    written = run("tables", tmp_path / "words.nc", "-o", tmp_path / "tables")
    assert written.exit_code == 0, written.output
    with (tmp_path / "tables" / "results.csv").open() as file:
        found = {row["case"]: row["creepage"] for row in csv.DictReader(file) if row["grid"] == "l"}
    assert found == {"p": "none (pressure only)", "q": "xi_x = 0.001"}


def test_figures_and_tables(tmp_path: Path) -> None:
    path = synthetic.write(tmp_path / "c.nc", synthetic.small())
    drawn = run("figures", path, "-o", tmp_path / "figures", "--formats", "png")
    assert drawn.exit_code == 0, drawn.output
    assert {entry.suffix for entry in (tmp_path / "figures").iterdir()} == {".png"}
    written = run("tables", path, "-o", tmp_path / "tables")
    assert written.exit_code == 0, written.output
    assert {".csv", ".md", ".tex"} <= {entry.suffix for entry in (tmp_path / "tables").iterdir()}
    for command in ("figures", "tables"):
        for folder in (path, path / "within"):
            refused = run(command, path, "-o", folder)
            assert refused.exit_code == 2
            assert (
                f"{folder}: is a file, not a folder" in refused.output or f"{folder}: cannot be made" in refused.output
            )
    wrong = run("figures", path, "-o", tmp_path / "more", "--formats", "shoe")
    assert wrong.exit_code == cli.EXIT_BAD_INPUT, wrong.output


def test_a_reader_that_goes_away(tmp_path: Path) -> None:
    path = synthetic.write(tmp_path / "c.nc", synthetic.several())
    show = process("show", str(path))
    assert show.stdout is not None
    show.stdout.close()
    assert show.stderr is not None
    assert "Traceback" not in show.stderr.read()
    show.wait(60)


def test_more_workers_than_processors_are_warned_of(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """40 on two cores took six times as long, without a word."""
    monkeypatch.setattr(threads, "available_cores", lambda: 2)
    assert "usable" not in run("sweep", "quick.yaml", "--workers", "2").output
    assert "99999999999: only 2 processors" in run("sweep", "quick.yaml", "--workers", "99999999999").output
    done = run("sweep", "quick.yaml", "--workers", "40")
    assert done.exit_code == 0
    words = "--workers: {}: only 2 processors are usable here: more workers than that make a sweep slower"
    assert words.format(40) + "; 4 are started, the most allowed\n" in done.output
    assert words.format(4) + "\n" in run("sweep", "quick.yaml", "--workers", "4").output


@pytest.mark.parametrize(("asked", "given"), [("1", 1), ("2", 2), ("4", 4), ("5", 4), ("1000", 4)])
def test_workers_are_at_most_two_for_each_processor(
    folder: Path, monkeypatch: pytest.MonkeyPatch, asked: str, given: int
) -> None:
    """1000 on two cores started more than a hundred processes and took a hundred times as long."""
    monkeypatch.setattr(threads, "available_cores", lambda: 2)
    wanted: list[object] = []
    monkeypatch.setattr(sweep, "run", lambda *_, workers, **__: wanted.append(workers) or sweep.Summary(folder / "c"))
    (folder / "c").touch()
    run("sweep", "quick.yaml", "--workers", asked)
    assert wanted == [given]


@pytest.mark.parametrize("name", ["x.csv", "x.txt", "x.yaml", "x.YML", "x.json", "x.png", "x.pdf", "x.tex", "x.nc.gz"])
def test_names_of_other_formats_are_refused(folder: Path, name: str) -> None:
    """A cube was written into x.csv."""
    for command in ("sweep", "merge", "status"):
        done = run(command, "quick.yaml", "-o", name)
        assert done.exit_code == EXIT_BAD_INPUT
        assert (
            done.output.strip()
            == f"--output: {name}: a cube is a netCDF file: its name must not end with {Path(name).suffix}"
        )
    assert not Path(name).exists()


@pytest.mark.parametrize(
    "words",
    ["plan s.yaml", "show s.nc", "compare s.nc s.nc", "compare s.nc s.nc --tolerances s.yaml", "accuracy s.yaml"],
)
def test_a_file_that_may_not_be_read_is_told_in_a_line(
    folder: Path, monkeypatch: pytest.MonkeyPatch, words: str
) -> None:
    """It was told as a wrong use of the command, in four lines; reading is what finds that it may not be."""

    def refuse(*_: Any, **__: Any) -> Any:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    for name in ("s.yaml", "s.nc"):
        Path(name).write_bytes(b"")
    monkeypatch.setattr(os, "access", lambda *_, **__: False)
    monkeypatch.setattr(Path, "open", refuse)
    monkeypatch.setattr(cube, "unsafe_content", refuse)
    done = run(*words.split())
    assert done.exit_code == EXIT_BAD_INPUT
    assert re.fullmatch(r"s\.(yaml: cannot be read|nc: not a readable rcstudy cube): Permission denied\n", done.output)


@pytest.mark.parametrize("command", ["sweep", "merge", "status", "accuracy", "figures", "tables", "failures"])
def test_an_empty_output_is_refused(folder: Path, command: str) -> None:
    """Files were written into the current folder, as by an unset variable of a script."""
    run("sweep", "quick.yaml")
    before = sorted(folder.iterdir())
    done = run(command, "quick.nc" if command in ("figures", "tables", "failures") else "quick.yaml", "-o", "")
    assert done.exit_code == EXIT_BAD_INPUT
    assert "'-o' / '--output': must not be empty: give the name of a file or folder" in done.output
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize(
    "words",
    [
        *(f"{command} EMPTY" for command in ("sweep", "merge", "status", "plan", "accuracy", "show", "figures")),
        "compare EMPTY c.nc",
        "compare c.nc EMPTY",
        "compare c.nc c.nc --tolerances EMPTY",
        "merge quick.yaml EMPTY",
        "sweep quick.yaml --scheduler-file EMPTY",
        "accuracy quick.yaml --cube EMPTY",
    ],
)
def test_an_empty_name_of_input_is_called_so(folder: Path, words: str) -> None:
    """It was told to be the current folder."""
    done = run(*("" if word == "EMPTY" else word for word in words.split()))
    assert done.exit_code == EXIT_BAD_INPUT
    assert "must not be empty: give the name of a file or folder" in done.output
    with pytest.raises(UserError, match="the name of a cube must not be empty"):
        open_cube("")


@pytest.mark.parametrize("command", ["sweep", "merge", "status"])
def test_a_cube_is_not_named_as_a_folder(folder: Path, command: str) -> None:
    """`-o new/` made a cube without an extension, named as the folder that was to hold it."""
    done = run(command, "quick.yaml", "-o", "new/")
    assert done.exit_code == EXIT_BAD_INPUT
    assert "'-o' / '--output': new/: is the name of a folder: give that of a file" in done.output
    assert not (folder / "new").exists()


@pytest.mark.parametrize("words", [(), ("--workers", "2")])
def test_a_current_folder_that_is_gone_is_told(folder: Path, words: tuple[str, ...]) -> None:
    """It was called output, or a traceback was shown."""
    (folder / "gone").mkdir()
    command = [sys.executable, "-m", "rcstudy", "sweep", str(folder / "quick.yaml"), *words]
    done = subprocess.run(
        ["sh", "-c", 'cd gone && rmdir ../gone && exec "$@"', "sh", *command],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert (done.returncode, done.stdout) == (EXIT_BAD_INPUT, "")
    assert done.stderr == "the current folder: No such file or directory\n"


@pytest.mark.parametrize("command", ["sweep", "merge", "status", "accuracy", "figures", "tables", "failures"])
def test_the_standard_output_is_no_file(folder: Path, command: str) -> None:
    """A file or folder called - was written."""
    run("sweep", "quick.yaml")
    done = run(command, "quick.nc" if command in ("figures", "tables", "failures") else "quick.yaml", "-o", "-")
    assert done.exit_code == EXIT_BAD_INPUT
    assert "Usage: " in done.output
    assert "'-o' / '--output': -: does not stand for the standard output here: give the name" in done.output
    assert not Path("-").exists()


def test_a_folder_that_is_made_is_told(folder: Path) -> None:
    made = "nonexist: a new folder, which is made for the cube"
    assert run("sweep", "quick.yaml", "-o", "nonexist/x").output.splitlines()[0] == made
    assert made not in run("sweep", "quick.yaml", "-o", "nonexist/x").output
    assert Path("nonexist/x").exists()


def test_a_folder_that_is_not_made_is_not_told(folder: Path) -> None:
    """It was told before the study was read, and before it turned out that there is no making it."""
    Path("faulty.yaml").write_text("study: [")
    for study, target in (("faulty.yaml", "other/x.nc"), ("quick.yaml", "quick.yaml/other/x.nc")):
        done = run("sweep", study, "-o", target)
        assert done.exit_code == EXIT_BAD_INPUT
        assert "a new folder" not in done.output
        assert not Path("other").exists()


def test_a_long_plan_says_what_it_is_at(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "to count them" not in run("plan", "quick.yaml").output
    report = plan.plan_report
    monkeypatch.setattr(progress, "LATE_SECONDS", 0.0)
    monkeypatch.setattr(plan, "plan_report", lambda study: (time.sleep(0.2), report(study))[1])
    assert run("plan", "quick.yaml").stderr == "quick.yaml: making its cases, to count them\n"


def test_an_accuracy_report_that_is_interrupted_says_that_it_resumes(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise sweep.Interrupted(3, 8)

    monkeypatch.setattr(accuracy, "run", interrupted)
    done = run("accuracy", "quick.yaml")
    assert done.exit_code == EXIT_INTERRUPTED
    assert done.output == "interrupted: 3 of 8 cases are kept: rerun the same command to resume\n"


def test_options_given_twice_or_half(folder: Path) -> None:
    """One of two tolerances was ignored, and an empty format let pass."""
    done = run("compare", "a.nc", "b.nc", "--rtol", "pressure=1e-3", "--rtol", "pressure=1e-4")
    assert done.exit_code == EXIT_BAD_INPUT
    assert done.output == "--rtol: pressure=1e-4: pressure has a tolerance already, 0.001: one is allowed\n"
    run("sweep", "quick.yaml")
    done = run("figures", "quick.nc", "--formats", "png,")
    assert done.exit_code == EXIT_BAD_INPUT
    assert done.output == 'figure format "": allowed are png, pdf, svg\n'
    assert run("figures", "quick.nc", "--formats", "png, png").output == "2 files in figures\n"


def test_help_is_for_people(folder: Path) -> None:
    for command in ("sweep", "merge", "figures"):
        shown = run(command, "--help").output
        assert "<bool>" not in shown
        assert "Study file (YAML).  [required]" in shown or "Cube written by sweep (.nc).  [required]" in shown
    assert "of png, pdf and svg" in shown


@pytest.mark.usefixtures("undrawn")
def test_figures_of_another_value_of_an_axis(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of further axes only the first value was to be had."""
    drawn: list[str] = []
    monkeypatch.setattr(overview, "caption", lambda figure, text: drawn.append(text))
    synthetic.write(folder / "c.nc", synthetic.several())
    assert run("figures", "c.nc", "--formats", "png").exit_code == 0
    first = next(text for text in drawn if text.startswith("product: "))
    drawn.clear()
    for value in ("420000", "2 Es", "2Es"):
        done = run("figures", "c.nc", "--formats", "png", "--at", f"modulus={value}")
        assert done.exit_code == 0, done.output
    found = [text for text in drawn if text.startswith("product: ")]
    assert first not in found
    for words, said in (
        (["--at", "modulus=3"], "--at: modulus=3: modulus must be a value of a grid (product: "),
        (["--at", "modulu=3"], "--at: modulu=3: no grid has this axis: did you mean modulus? allowed: "),
        (["--at", "modulus"], "--at: modulus: must be AXIS=VALUE, such as 'modulus=2 Es', and once for an axis"),
        (["--at", "modulus=1", "--at", "modulus=2"], "--at: modulus=2: must be AXIS=VALUE"),
        (["--at", "load=5", "--at", "load = 6"], "--at: load = 6: must be AXIS=VALUE once for an axis: load is given "),
    ):
        done = run("figures", "c.nc", *words)
        assert done.exit_code == EXIT_BAD_INPUT
        assert done.output.startswith(said)


@pytest.mark.usefixtures("undrawn")
def test_figures_of_other_quantities(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[str] = []
    shown = overview.numbers
    monkeypatch.setattr(overview, "numbers", lambda cases, name: drawn.append(name) or shown(cases, name))
    synthetic.write(folder / "c.nc", synthetic.several())
    done = run("figures", "c.nc", "--formats", "png", "--quantities", "traction_max, approach,approach")
    assert done.exit_code == 0, done.output
    assert set(drawn) == {"traction_max", "approach"}
    allowed = f"allowed: {', '.join(CHOICES)}\n"
    for words, said in (
        ("approah", f"--quantities: approah: no such quantity: did you mean approach? {allowed}"),
        ("approach,", f"--quantities: must not be empty: {allowed}"),
    ):
        done = run("figures", "c.nc", "--quantities", words)
        assert (done.exit_code, done.output) == (EXIT_BAD_INPUT, said)


@pytest.mark.usefixtures("undrawn")
def test_figures_along_another_axis(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[str] = []
    monkeypatch.setattr(overview, "_label_axis", lambda ax, grid, axis: drawn.append(f"{grid.name} {axis}"))
    synthetic.write(folder / "c.nc", synthetic.several())
    for words, axis in (([], "thickness"), (["--along", "modulus"], "modulus")):
        drawn.clear()
        done = run("figures", "c.nc", "--formats", "png", *words)
        assert done.exit_code == 0, done.output
        assert {f"product {axis}", "pressure_only load", "listed case"} == set(drawn)
    for words, said in (
        (
            ["modulu"],
            "--along: modulu: no grid has this axis: did you mean modulus? allowed: thickness, modulus, load\n",
        ),
        ([""], "--along: must not be empty: give the name of an axis\n"),
        (["case"], "--along: case: not an axis of numbers: allowed: thickness, modulus, load\n"),
        (
            ["modulus", "--at", "modulus=2 Es"],
            "--along: modulus: --at gives it a single value: only one of the two may name an axis\n",
        ),
    ):
        done = run("figures", "c.nc", "--along", *words)
        assert (done.exit_code, done.output) == (EXIT_BAD_INPUT, said)


def test_without_a_command_all_are_listed() -> None:
    found = CliRunner().invoke(cli.app, [])
    assert found.exit_code == 2
    assert "Commands" in found.output and "sweep" in found.output


@pytest.mark.parametrize(("failed", "shown", "rest"), [(10, 10, []), (12, 10, ["... and 2 more that are not solved"])])
def test_ten_failures_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], failed: int, shown: int, rest: list[str]
) -> None:
    (tmp_path / "c.nc").touch()
    failures = [Failure("g", f"case {k}", Status.ERROR, "made up") for k in range(failed)]
    assert cli._outcome(Summary(tmp_path / "c.nc", failed, 1.0, failures)) == cli.EXIT_FAILED_CASES
    told = capsys.readouterr().err.splitlines()
    assert told[:shown] == [f"g: case {k}: {Status.ERROR.words}: made up" for k in range(shown)]
    assert told[shown:-1] == rest
