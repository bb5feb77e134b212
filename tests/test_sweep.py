"""Sweeps: every case gets a result, whatever happens to the solver, the workers or the terminal."""

from __future__ import annotations

import contextlib
import ctypes
import io
import multiprocessing
import os
import pickle
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
import workers
import xarray as xr
from studies import BASE, CASES, OLD, SWEPT, load_text

from rcstudy import plan, provenance, store, sweep, threads
from rcstudy.cases import Case, expand
from rcstudy.compare import compare
from rcstudy.cube import case_table, open_cube
from rcstudy.errors import UserError
from rcstudy.mechanics.scene import Scene
from rcstudy.progress import Bar, Lines, counted, duration, for_stream, in_bytes
from rcstudy.result import Result, Status
from rcstudy.storage.steady import interrupts_held, interrupts_remembered
from rcstudy.storage.units import read_unit, unit_paths
from rcstudy.study import Study, load_study
from rcstudy.threads import THREAD_VARIABLES
from rcstudy.workers import pool
from rcstudy.workers.batch import warm_up_scenes


@pytest.fixture
def study(tmp_path: Path) -> Study:
    """14 cases in 6 normal problems."""
    path = tmp_path / "study.yaml"
    path.write_text(SWEPT)
    return load_study(path)


class Told:
    """Keeps what a sweep tells of its progress."""

    def __init__(self) -> None:
        self.told: list[object] = []

    def begin(self, total: int) -> None:
        self.told.append(total)

    def advance(self, *, failed: bool) -> None:
        self.told.append(failed)

    def end(self) -> None:
        self.told.append("end")


def files(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir() if entry.name != "study.yaml")


@pytest.mark.parametrize("processes", [1, 2])
def test_all_cases_are_solved_and_told(study: Study, tmp_path: Path, processes: int) -> None:
    told = Told()
    done = sweep.run(study, tmp_path / "c.nc", workers=processes, progress=told, solve=workers.made_up)
    assert (done.cases, done.solved, done.failed) == (CASES, CASES, 0)
    assert told.told == [CASES, *[False] * CASES, "end"]
    assert files(tmp_path) == ["c.nc"]
    with open_cube(tmp_path / "c.nc") as tree:
        table = case_table(tree)
        assert len(table) == CASES
        assert (table.status == Status.SOLVED).all()
        assert set(table.case_key) == {case.key for case in expand(study).cases}
    assert multiprocessing.active_children() == []


def test_workers_change_no_number(study: Study, tmp_path: Path) -> None:
    for count in (1, 2):
        sweep.run(study, tmp_path / f"{count}.nc", workers=count, solve=workers.made_up)
    with xr.open_datatree(tmp_path / "1.nc") as one, xr.open_datatree(tmp_path / "2.nc") as two:
        for name in one.children:
            xr.testing.assert_identical(one[name].to_dataset(inherit=False), two[name].to_dataset(inherit=False))
    with open_cube(tmp_path / "1.nc") as one, open_cube(tmp_path / "2.nc") as two:
        assert compare(one, two).same


def test_provenance_is_in_the_cube(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["/somewhere/rcstudy", "sweep", "a study.yaml"])
    sweep.run(study, tmp_path / "c.nc", workers=1, solve=workers.made_up)
    with open_cube(tmp_path / "c.nc") as tree:
        attrs = tree.attrs
        assert attrs["study_text"] == SWEPT
        assert attrs["study_sha256"] == study.sha256
        assert attrs["command"] == "rcstudy sweep 'a study.yaml'"
        for name in ("numpy", "scipy", "numba", "pyfftw", "h5py", "xarray", "python", "hdf5"):
            assert attrs[f"{name}_version"][0].isdigit(), name
        for name in ("created", "solver_version", "rcstudy_version", "machine_cpu", "machine_os"):
            assert attrs[name], name
        assert attrs["machine_cores"] >= 1
        assert attrs["wall_seconds"] > 0


def test_revision_only_of_rcstudy_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    elsewhere = tmp_path / "provenance.py"
    elsewhere.touch()
    monkeypatch.setattr(provenance, "__file__", str(elsewhere))
    assert "git_revision" not in provenance.collect()


def test_what_git_says_in_no_known_encoding_is_no_failure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a checkout that is somebody else's it tells the folder, byte by byte; the sweep ended with a traceback."""
    git = tmp_path / "git"
    git.write_bytes(b"#!/bin/sh\nprintf 'dubious ownership in caf\\351' | tee /dev/stderr\nexit 128\n")
    git.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.setattr(provenance, "__file__", str(tmp_path / "provenance.py"))
    assert "git_revision" not in provenance.collect()


def test_a_name_of_a_process_that_ends_within_a_letter_is_no_failure() -> None:
    """The kernel keeps fifteen bytes of it."""
    script = (
        "import ctypes, os; from rcstudy.storage import lock; started = lock._started(os.getpid()); "
        "ctypes.CDLL(None).prctl(15, b'etude-de-roul\\xc3', 0, 0, 0); assert lock._started(os.getpid()) == started > 0"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


def test_a_worker_that_dies_costs_its_case_only(study: Study, tmp_path: Path) -> None:
    """One case in the middle of a batch kills its worker each time; the others are solved, and nothing hangs."""
    done = sweep.run(study, tmp_path / "c.nc", workers=2, solve=workers.dies)
    assert done.cases == CASES
    (failure,) = done.failures
    assert (failure.label, failure.status) == ("load=60, creepage=b", Status.ERROR)
    assert "worker process died 2 times at this case: killed by SIGKILL" in failure.reason
    with open_cube(tmp_path / "c.nc") as tree:
        assert int((case_table(tree).status == Status.SOLVED).sum()) == CASES - 1
    assert multiprocessing.active_children() == []


def test_a_case_gets_a_second_chance(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DEATHS", str(tmp_path))
    done = sweep.run(study, tmp_path / "c.nc", workers=2, solve=workers.dies_once)
    assert (tmp_path / "died").exists()
    assert done.solved == CASES


def test_workers_that_do_not_start(study: Study, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"worker processes do not start \(exit code 5\)"):
        sweep.run(study, tmp_path / "c.nc", workers=2, solve=workers.Unloadable())
    assert files(tmp_path) == []
    assert multiprocessing.active_children() == []


def test_workers_have_one_thread_and_this_process_keeps_its_own(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    done = sweep.run(study, tmp_path / "c.nc", workers=2, solve=workers.tells_environment)
    told = [failure.reason.split() for failure in done.failures]
    assert {threads for _, threads in told} == {",".join("1" for _ in THREAD_VARIABLES)}
    assert str(os.getpid()) not in {process for process, _ in told}
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ


def processes_of(done: sweep.Summary) -> list[int]:
    """The processes that solved the cases, for `workers.tells_environment`."""
    return [int(failure.reason.split()[0]) for failure in done.failures]


def test_short_sweeps_start_no_workers(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "available_cores", lambda: 2)
    done = sweep.run(study, tmp_path / "c.nc", solve=workers.tells_environment)
    assert processes_of(done) == [os.getpid()] * CASES


def test_long_sweeps_are_handed_over(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "available_cores", lambda: 2)
    monkeypatch.setattr(sweep, "_SECONDS_TO_JUDGE", 0.0)
    monkeypatch.setattr(sweep, "_SECONDS_WORTH_WORKERS", 0.0)
    done = sweep.run(study, tmp_path / "c.nc", solve=workers.tells_environment)
    first = [process == os.getpid() for process in processes_of(done)]
    assert first == [True] * 6 + [False] * (CASES - 6)
    monkeypatch.setattr(threads, "available_cores", lambda: 1)
    done = sweep.run(study, tmp_path / "c.nc", solve=workers.tells_environment)
    assert processes_of(done) == [os.getpid()] * CASES


def test_every_worker_is_kept_from_interrupts(study: Study, tmp_path: Path) -> None:
    """In a process of its own: only the first worker it ever starts was once left out."""
    code = (
        "import sys\n"
        "sys.path.insert(0, sys.argv[1])\n"
        "import workers\n"
        "from rcstudy import sweep\n"
        "from rcstudy.study import load_study\n"
        "if __name__ == '__main__':\n"
        "    done = sweep.run(load_study(sys.argv[2]), sys.argv[3], workers=2, solve=workers.tells_interrupts)\n"
        "    print(*[failure.reason for failure in done.failures], sep='\\n')\n"
    )
    (tmp_path / "run.py").write_text(code)
    command = [sys.executable, tmp_path / "run.py", Path(__file__).parent, study.path, tmp_path / "c.nc"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    told = [line.split() for line in done.stdout.splitlines()]
    assert len(told) == CASES
    assert {held for _, held in told} == {"held"}


class Interrupting(Told):
    """Ctrl-C after five cases."""

    def advance(self, *, failed: bool) -> None:
        super().advance(failed=failed)
        if len(self.told) > 5:
            raise KeyboardInterrupt


@pytest.mark.parametrize("processes", [1, 2])
def test_an_interrupt_leaves_the_old_cube_and_no_workers(study: Study, tmp_path: Path, processes: int) -> None:
    (tmp_path / "c.nc").write_bytes(OLD)
    told = Interrupting()
    with pytest.raises(KeyboardInterrupt):
        sweep.run(study, tmp_path / "c.nc", workers=processes, progress=told, solve=workers.made_up)
    assert told.told[-1] == "end"
    assert (tmp_path / "c.nc").read_bytes() == OLD
    assert files(tmp_path) == ["c.nc", "c.nc.units"]
    assert multiprocessing.active_children() == []


def test_what_was_taken_away_meanwhile_is_not_kept(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Units are on the disk when an interrupt comes, but where the user has moved them."""
    monkeypatch.setattr(store, "UNIT_CASES", 1)

    class Moving(Interrupting):
        def advance(self, *, failed: bool) -> None:
            if len(self.told) == 5:
                while sum(len(read_unit(path)[0].entries) for path in unit_paths(tmp_path / "c.nc.units")) < 5:
                    time.sleep(0.01)
                (tmp_path / "c.nc.units").rename(tmp_path / "elsewhere")
            super().advance(failed=failed)

    for told, count in ((Interrupting(), 5), (Moving(), 0)):
        with pytest.raises(sweep.Interrupted, match=f"^{count} of {CASES} cases are kept"):
            sweep.run(study, tmp_path / "c.nc", workers=1, progress=told, solve=workers.made_up, fresh=True)


def test_interrupts_can_be_sent_to_other_processes() -> None:
    sent = pickle.loads(pickle.dumps(sweep.Interrupted(3, 8)))
    assert isinstance(sent, sweep.Interrupted)
    assert (str(sent), sent.solved, sent.cases) == ("3 of 8 cases are kept", 3, 8)


def test_an_interrupt_that_is_lost_on_the_way_still_counts(study: Study, tmp_path: Path) -> None:
    """As in a weakref callback or an import inside a C extension, where Python itself drops the exception."""
    (tmp_path / "c.nc").write_bytes(OLD)
    told = Told()

    def loses_it(scenes: Sequence[Scene]) -> Iterator[Result]:
        for scene in scenes:
            if len(told.told) == 4:
                with contextlib.suppress(KeyboardInterrupt):
                    signal.raise_signal(signal.SIGINT)
            yield from workers.made_up([scene])

    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        sweep.run(study, tmp_path / "c.nc", workers=1, progress=told, solve=loses_it)
    assert told.told == [CASES, False, False, False, "end"]
    assert (tmp_path / "c.nc").read_bytes() == OLD
    assert files(tmp_path) == ["c.nc", "c.nc.units"]
    assert signal.getsignal(signal.SIGINT) is before


def test_an_interrupt_that_python_drops_is_not_printed(capfd: pytest.CaptureFixture[str]) -> None:
    """In a callback of ctypes, as LLVM has them: remembered all the same. Other lost exceptions are told as ever."""

    @ctypes.CFUNCTYPE(None)
    def interrupted() -> None:
        signal.raise_signal(signal.SIGINT)

    @ctypes.CFUNCTYPE(None)
    def broken() -> None:
        raise ValueError("told")

    told: list[object] = []
    before, sys.unraisablehook = sys.unraisablehook, lambda lost: told.append(lost.exc_type)
    try:
        with interrupts_remembered() as check:
            check()
            interrupted()
            with pytest.raises(KeyboardInterrupt):
                check()
            broken()
        assert told == [ValueError]
    finally:
        sys.unraisablehook = before
    assert "Traceback" not in capfd.readouterr().err


def test_a_termination_is_held_back_where_ctrl_c_is_ignored() -> None:
    """As in the background of a script; a handler that does not interrupt is called, and that is all."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    told: list[int] = []
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        steps = 0
        with pytest.raises(KeyboardInterrupt), interrupts_held():
            signal.raise_signal(signal.SIGTERM)
            steps += 1
        assert steps == 1
        with interrupts_remembered() as check:
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(signal.SIGTERM)
            with pytest.raises(KeyboardInterrupt):
                check()
        signal.signal(signal.SIGTERM, lambda number, _: told.append(number))
        with interrupts_remembered() as check:
            signal.raise_signal(signal.SIGTERM)
            check()
        assert told == [signal.SIGTERM]
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def test_llvmlite_is_not_interrupted_in_the_middle() -> None:
    """Its code goes on to its end; the interrupt comes right after it."""
    place: dict[str, object] = {"__name__": "llvmlite.made_up", "signal": signal, "time": time, "steps": []}
    exec("def load():\n    signal.raise_signal(signal.SIGINT)\n    time.sleep(0.1)\n    steps.append('done')\n", place)
    with interrupts_remembered():
        with pytest.raises(KeyboardInterrupt):
            place["load"]()
            time.sleep(5.0)
            pytest.fail("no interrupt")
        assert place["steps"] == ["done"]


def test_nothing_is_solved_for_a_cube_that_cannot_be_written(study: Study, tmp_path: Path) -> None:
    told = Told()
    (tmp_path / "file").touch()
    for target in (tmp_path, tmp_path / "file" / "c.nc"):
        with pytest.raises(UserError):
            sweep.run(study, target, workers=1, progress=told, solve=workers.made_up)
    assert told.told == []
    with pytest.raises(UserError, match="workers: 0"):
        sweep.run(study, tmp_path / "c.nc", workers=0)


def test_batches_share_their_pressure_and_keep_workers_busy(study: Study) -> None:
    cases = expand(study).cases

    def sizes(processes: int, given: Sequence[Case] = cases) -> list[int]:
        return [len(batch) for batch in sweep.make_batches(given, processes)]

    assert sizes(1) == [3, 3, 3, 3, 1, 1]
    assert sizes(2) == [3, 3, 3, 3, 1, 1]
    one_pressure = [cases[0]] * 1000
    assert sizes(1, one_pressure) == [1000]
    assert sizes(2, one_pressure) == [63] * 15 + [55]
    assert sizes(2, one_pressure[:40]) == [8] * 5
    joined = [case for batch in sweep.make_batches(cases, 2) for case in batch]
    assert joined == list(cases)


def test_shards_have_like_shares_where_pressures_have_more_cases_than_a_batch(tmp_path: Path) -> None:
    """Of 10 cases a pressure, batches of 8 and 2 in turn would give every other shard four times as many."""
    axes = "{load: {first: 50, last: 100, count: 8}, creepage.spin: {first: 0.01, last: 0.1, count: 10}}"
    cases = expand(load_text(tmp_path, BASE + f"  g: {{axes: {axes}}}\n")).cases
    for n in (2, 4, 8):
        assert {len(sweep.shard_of(cases, (i, n))) for i in range(1, n + 1)} == {80 // n}


def test_warm_up_has_each_kind_once_on_a_small_mesh(study: Study) -> None:
    scenes = warm_up_scenes(study)
    assert [scene.creepage is None for scene in scenes] == [False, True]
    assert {scene.mesh.cells for scene in scenes} == {(32, 32)}


KINDS = """
study: kinds
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  load: 100
  mesh: {size: [2, 2], cells: [64, 64]}
  creepage: {longitudinal: 0.001}
grids:
  product:
    axes:
      discretisation: [kalker, aligned]
      coupling: [one-way, full]
      counterbody: [rigid, {E: 1 Es, nu: 0.3}, {E: 2 Es, nu: 0.3}, {E: 3 Es, nu: 0.3}]
      load: [90, 100, 110]
  coated:
    coating: {thickness: 0.5 a, modulus: 2 Es}
    axes: {layer_count: [0, 1, 2], method: [newton, paper-cg]}
  own_material: # a layer of the substrate's own is none: only both axes together show that there are others
    scene: {discretisation: aligned}
    coating: {thickness: 0.5 a}
    axes: {layer_count: [0, 1], modulus: [1 Es, 2 Es]}
  pressed: # layers first: whether bodies are alike matters without them only
    scene: {creepage: none}
    axes:
      layers: [{label: soft, layers: [{E: 0.5 Es, nu: 0.3, thickness: 0.1}]}, {label: bare, layers: []}]
      counterbody: [{E: 2 Es, nu: 0.3}, {E: 1 Es, nu: 0.3}]
  listed:
    cases:
      - {label: one, load: 10}
      - {label: two, layers: [{E: 1000, nu: 0.3, thickness: 0.1}], load: 10}
      - {label: three, load: 20, creepage: none}
"""


def test_workers_warm_up_with_every_kind_of_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whichever value of an axis it takes, or place in a list; a kind that several grids have once only."""
    path = tmp_path / "study.yaml"
    path.write_text(KINDS)
    study, given = load_study(path), []

    def prepare(_: pool.Pool, solve: object, scenes: Sequence[Scene]) -> None:
        given.extend(scenes)
        raise UserError("enough")

    monkeypatch.setattr(pool.Pool, "prepare", prepare)
    with pytest.raises(UserError, match="enough"):
        sweep.run(study, tmp_path / "c.nc", workers=1)

    def kinds(scenes: list[Scene]) -> list[tuple[object, ...]]:
        return [
            (s.method, s.discretisation, s.is_coupled, s.moves_by_pressure, bool(s.joined.layers), s.creepage is None)
            for s in scenes
        ]

    assert set(kinds(given)) == set(kinds([case.scene for case in expand(study).cases]))
    assert len(given) == 2 * 2 * 3 + 3 + 1 + 4 + 1  # the last grid's first two are in the others


@pytest.mark.heavy
def test_with_the_solver_itself(tmp_path: Path) -> None:
    path = tmp_path / "study.yaml"
    path.write_text(SWEPT.replace("load: [20, 40, 60, 80]", "load: [20, 60]"))
    done = sweep.run(load_study(path), tmp_path / "c.nc", workers=2)
    assert done.failures == []
    with open_cube(tmp_path / "c.nc") as tree:
        table = case_table(tree)
        loads = table.load.to_numpy(dtype=float)
        proofs = [name for name in table if name.startswith("proof_")]
        assert len(proofs) >= 6
        grid = tree["loads"]
        dx, dy = (float(grid[d][1] - grid[d][0]) for d in "xy")
        pressed = grid["pressure"].sum(("x", "y")).values * dx * dy
        assert abs(pressed - loads[:6].reshape(2, 3)).max() < 1e-9 * 60


# progress


def test_lines_where_there_is_no_terminal() -> None:
    stream = io.StringIO()
    lines = for_stream(stream)
    assert isinstance(lines, Lines)
    lines.begin(3)
    for failed in (False, True, False):
        lines.advance(failed=failed)
    lines.end()
    first, last = stream.getvalue().splitlines()
    assert first == "solving 3 cases"
    assert last.startswith("3/3 cases, ")
    assert last.endswith("1 failed")


def test_lines_come_now_and_then() -> None:
    stream = io.StringIO()
    lines = Lines(stream, interval=0.0)
    lines.begin(4)
    for _ in range(4):
        lines.advance(failed=False)
    told = stream.getvalue().splitlines()
    assert len(told) == 5
    assert told[1] == "1/4 cases, 0 failed"


def told_of(total: int, waits: Iterable[float], monkeypatch: pytest.MonkeyPatch, *, begun: float = 0.0) -> list[str]:
    """Lines of progress of a sweep of `total` cases, of which one is solved after each of `waits` (s)."""
    now = begun
    monkeypatch.setattr(time, "monotonic", lambda: now)
    stream = io.StringIO()
    lines = Lines(stream, interval=1.0)
    lines.begin(total)
    for wait in waits:
        now += wait
        lines.advance(failed=False)
    return stream.getvalue().splitlines()


def test_the_time_left_is_told_once_it_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """28 s of compiling before the first of 6000 cases made it 47 h of a sweep that took 80 s."""
    told = told_of(6000, [28.1, *[0.01] * 500], monkeypatch)
    assert told[1] == "1/6000 cases, 0 failed"
    assert not any("left" in line for line in told[:4])
    assert told[-1] == "401/6000 cases, 100.0 cases/s, 56 s left, 0 failed"


def test_the_last_line_tells_the_rate_of_all_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    """With what came before the first one."""
    assert told_of(4, [5.0, 0.5, 0.5, 2.0], monkeypatch, begun=1000.0)[-1] == "4/4 cases, 2.0 s/case, 0 failed"


def test_the_time_left_is_not_told_after_few_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    """However long they took: what three of them tell is mostly how the first of each worker fared."""
    told = told_of(10, [10.0] * 4, monkeypatch)
    assert told[1:] == ["1/10 cases, 0 failed", "2/10 cases, 0 failed", "3/10 cases, 0 failed", told[-1]]
    assert told[-1] == "4/10 cases, 10.0 s/case, 1 min 00 s left, 0 failed"


def test_no_more_workers_want_memory_than_there_are_cases(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A container with 8 GB on a machine of 64 cores was warned of a study of one case."""
    cases = len(expand(study).cases)
    monkeypatch.setattr(threads, "available_cores", lambda: 2000)
    said: list[int] = []

    def noted(pending: Sequence[object], workers: int) -> str:
        said.append(workers)
        return ""

    monkeypatch.setattr(plan, "lack_of_memory", noted)
    sweep.run(study, tmp_path / "c.nc", solve=workers.made_up)
    assert said == [cases]


def test_a_lack_of_memory_is_told(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan, "lack_of_memory", lambda pending, workers: "made up")
    told: list[str] = []
    sweep.run(study, tmp_path / "c.nc", workers=1, solve=workers.made_up, tell=told.append)
    assert told == ["made up"]


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("width", "shown", "left_out"),
    [
        (120, ["solving", "\u2501" * 10, "failed 1", "0:00:00", "left"], []),
        (66, ["solving", "failed 1", "0:00:00", "left"], ["\u2501"]),
        (40, ["solving", "failed 1", "left"], ["\u2501", "0:00:00"]),
        (20, ["left"], ["solving", "failed"]),
        (5, ["1/75"], ["left"]),
    ],
)
def test_a_bar_on_a_narrow_terminal(
    width: int, shown: list[str], left_out: list[str], capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At 40 columns it read ``solving ... 0... failed 0 0:... left -:--...``."""
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", f"{width}")
    bar = for_stream(Terminal())
    bar.begin(75)
    bar.advance(failed=True)
    bar.end()
    last = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", capsys.readouterr().err).rstrip().splitlines()[-1]
    assert "1/75" in last
    assert "\u2026" not in last
    assert [word for word in shown if word not in last] == [word for word in left_out if word in last] == []


def test_a_bar_on_a_terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "120")
    bar = for_stream(Terminal())
    assert isinstance(bar, Bar)
    bar.begin(2)
    bar.advance(failed=True)
    bar.advance(failed=False)
    bar.end()
    shown = capsys.readouterr().err
    assert "2/2" in shown
    assert "failed 1" in shown
    assert "left" in shown


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.0421, "0.042 s"),
        (9.99, "10 s"),
        (59.4, "59 s"),
        (59.7, "1 min 00 s"),
        (65, "1 min 05 s"),
        (3599.9, "1 h 00 min"),
        (7500, "2 h 05 min"),
    ],
)
def test_durations(seconds: float, words: str) -> None:
    assert duration(seconds) == words


def test_sizes_of_files() -> None:
    """Less than 0.1 MB was told as 0.0 MB."""
    sizes = (512, 999.4, 42_345, 999_600, 15.7e6, 1.2e9, 3e12)
    assert [in_bytes(size) for size in sizes] == ["512 B", "999 B", "42.3 kB", "1 MB", "15.7 MB", "1.2 GB", "3 TB"]


def test_how_a_process_died() -> None:
    assert pool._how_it_died(-9) == "killed by SIGKILL"
    assert pool._how_it_died(-250) == "killed by signal 250"
    assert pool._how_it_died(3) == "exit code 3"


def test_one_case_is_no_cases() -> None:
    assert [counted(n, "case") for n in (0, 1, 2)] == ["0 cases", "1 case", "2 cases"]


def test_the_time_that_a_sweep_took_is_told(tmp_path: Path) -> None:
    begun = time.monotonic()
    done = sweep.run(load_text(tmp_path, SWEPT), tmp_path / "c.nc", workers=1, solve=workers.made_up)
    assert 0.0 < done.seconds <= time.monotonic() - begun


@pytest.mark.parametrize("changed", [False, True])
def test_revision_of_a_checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, changed: bool) -> None:
    def git(*words: str) -> str:
        who = ("-c", "user.name=n", "-c", "user.email=n@example.org", "-c", "commit.gpgsign=false")
        return subprocess.run(["git", *who, *words], cwd=tmp_path, check=True, capture_output=True, text=True).stdout

    own = tmp_path / "provenance.py"
    own.write_text("one\n")
    git("init")
    git("add", own.name)
    git("commit", "-m", "first")
    own.write_text("two\n" if changed else "one\n")
    (tmp_path / "untracked").touch()
    monkeypatch.setattr(provenance, "__file__", str(own))
    expected = git("rev-parse", "HEAD").strip() + ("+changes" if changed else "")
    assert provenance.collect()["git_revision"] == expected


def test_a_sweep_may_run_in_a_thread(tmp_path: Path) -> None:
    """There no signal can be handled, and none has to be held."""
    with ThreadPoolExecutor(1) as pool:
        done = pool.submit(sweep.run, load_text(tmp_path, SWEPT), tmp_path / "c.nc", workers=1, solve=workers.made_up)
    assert done.result().failures == []
    with open_cube(tmp_path / "c.nc") as tree:
        assert case_table(tree)["status"].tolist() == [Status.SOLVED] * CASES
