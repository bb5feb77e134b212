"""Sweeps on a Dask cluster: a real scheduler, real workers over TCP, some of them killed."""

from __future__ import annotations

import contextlib
import dataclasses
import gc
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import distributed
import pytest
import workers
import xarray as xr
from test_sweep import Told

from rcstudy import cli, sweep
from rcstudy.cases import Case, expand
from rcstudy.cube import case_table, open_cube
from rcstudy.errors import UserError
from rcstudy.result import Result, Status
from rcstudy.study import Study, load_study
from rcstudy.workers import cluster, remote
from rcstudy.workers.cluster import Scheduler, solve_on_cluster

TESTS = Path(__file__).parent
STUDY = """
study: far_away
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  mesh: {size: [1, 1], cells: [24, 20]}
grids:
  loads:
    axes:
      load: [10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120]
      creepage:
        - {label: a, longitudinal: 0.001}
        - {label: b, lateral: 0.002}
        - {label: c, spin: 0.01}
        - {label: d, longitudinal: 0.002, spin: 0.01}
  bare:
    axes: {load: [20, 40]}
"""
CASES = 50


@pytest.fixture
def study(tmp_path: Path) -> Study:
    """50 cases in 14 normal problems."""
    path = tmp_path / "study.yaml"
    path.write_text(STUDY)
    return load_study(path)


@dataclasses.dataclass
class Running:
    """A cluster of processes of this machine."""

    file: Path
    scheduler: subprocess.Popen[bytes]
    workers: list[subprocess.Popen[bytes]]
    solved: Path

    @property
    def at(self) -> Scheduler:
        return Scheduler(file=self.file)


@contextlib.contextmanager
def running(folder: Path, *options: str, count: int = 2) -> Iterator[Running]:
    """A scheduler and `count` workers, started with `options`, that talk over TCP; all ended at the end."""
    file, log = folder / "scheduler.json", folder / "solved"
    path = os.pathsep.join([str(TESTS), str(TESTS.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, "PYTHONPATH": path, "SOLVED": str(log), "OMP_NUM_THREADS": "1"}

    def start(kind: str, *more: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", "--no-dashboard", *more]
        # a session of its own, so that a nanny's worker can be ended with it
        with (folder / f"{kind}.log").open("a") as told:
            return subprocess.Popen(command, env=environment, stdout=told, stderr=told, start_new_session=True)

    each = ["--scheduler-file", str(file), "--nthreads", "1", "--local-directory", str(folder), *options]
    started = [start("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))]
    started += [start("worker", *each) for _ in range(count)]
    try:
        deadline = time.monotonic() + 60
        while not (file.exists() and file.read_text().strip().endswith("}")):
            assert time.monotonic() < deadline, (folder / "scheduler.log").read_text()
            time.sleep(0.05)
        yield Running(file, started[0], started[1:], log)
    finally:
        for process in started:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def wait_for_workers(at: Scheduler, count: int) -> None:
    """Wait until the scheduler has so many workers."""
    with distributed.Client(at.find(), set_as_default=False) as client:
        client.wait_for_workers(count, timeout=60)


def tasks_of(at: Scheduler) -> int:
    """Tasks that the scheduler knows of."""
    with distributed.Client(at.find(), set_as_default=False) as client:
        return int(client.run_on_scheduler(count_tasks))


def count_tasks(dask_scheduler: distributed.Scheduler) -> int:
    return len(dask_scheduler.tasks)


def assert_same(one: Path, other: Path) -> None:
    """Two cubes are the same to the last bit."""
    with xr.open_datatree(one) as a, xr.open_datatree(other) as b:
        assert set(a.children) == set(b.children)
        for name in a.children:
            xr.testing.assert_identical(a[name].to_dataset(inherit=False), b[name].to_dataset(inherit=False))


class Killing(Told):
    """Kills a process once so many cases are done, and so many of them by itself, as the file `log` tells."""

    def __init__(self, process: subprocess.Popen[bytes], after: int, own: int, log: Path) -> None:
        super().__init__()
        self.process, self.after, self.own, self.log = process, after, own, log

    def advance(self, *, failed: bool) -> None:
        super().advance(failed=failed)
        if self.told.count(False) >= self.after and self.done_itself() >= self.own:
            self.process.kill()

    def done_itself(self) -> int:
        return sum(line.startswith(f"{self.process.pid} ") for line in self.log.read_text().splitlines())


def test_a_worker_killed_in_the_middle_costs_what_it_held_only(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep.run(study, tmp_path / "here.nc", workers=1, solve=workers.made_up)
    with running(tmp_path, "--no-nanny") as there:
        wait_for_workers(there.at, 2)
        told = Killing(there.workers[0], after=11, own=4, log=there.solved)
        safe: set[str] = set()  # what had come back before the kill

        def watched(*args: Any, **kwargs: Any) -> Iterator[tuple[Case, Any]]:
            for case, result in solve_on_cluster(*args, **kwargs):
                if there.workers[0].poll() is None:
                    safe.add(workers.told_as(case.scene))
                yield case, result

        monkeypatch.setattr(cluster, "solve_on_cluster", watched)
        done = sweep.run(study, tmp_path / "there.nc", scheduler=there.at, progress=told, solve=workers.slow)
        assert there.workers[0].wait(timeout=60) == -signal.SIGKILL
        assert (done.cases, done.failures) == (CASES, [])
        assert told.told == [CASES, *[False] * CASES, "end"]
        assert_same(tmp_path / "here.nc", tmp_path / "there.nc")
        solved = [line.split(" ", 1) for line in there.solved.read_text().splitlines()]
        by = Counter(int(process) for process, _ in solved)
        assert set(by) == {process.pid for process in there.workers}
        assert by[there.workers[0].pid] >= 4
        times = Counter(what for _, what in solved)
        assert len(times) == CASES
        assert set(times.values()) <= {1, 2}
        # what was solved twice is what the dead worker held: two parcels of one normal problem, four cases, each, and
        # at most as many that it had solved and not yet passed on
        twice = {what for what, count in times.items() if count == 2}
        assert len(safe) >= 11
        assert not twice & safe
        assert len(twice) <= 16


def test_a_case_that_ends_its_worker_twice_is_given_up(study: Study, tmp_path: Path) -> None:
    with running(tmp_path, "--nanny") as there:
        wait_for_workers(there.at, 2)  # a sweep waits for ever for those that cannot be started
        done = sweep.run(study, tmp_path / "c.nc", scheduler=there.at, solve=workers.dies)
        (failure,) = done.failures
        assert (failure.label, failure.status) == ("load=60, creepage=b", Status.ERROR)
        assert "worker process died 2 times at this case: worker tcp://" in failure.reason
        with open_cube(tmp_path / "c.nc") as tree:
            assert int((case_table(tree).status == Status.SOLVED).sum()) == CASES - 1
        # and one whose result cannot be sent is an error, that of the others not
        done = sweep.run(study, tmp_path / "d.nc", scheduler=there.at, solve=workers.fails_to_travel)
        (failure,) = done.failures
        assert (failure.label, failure.status) == ("load=60, creepage=b", Status.ERROR)
        assert failure.reason.startswith(("TypeError: ", "AttributeError: "))


def test_leaving_early_takes_back_what_was_sent(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    batches = sweep.make_batches(expand(study).cases, 1)
    with running(tmp_path, "--no-nanny") as there:
        wait_for_workers(there.at, 2)
        results = solve_on_cluster(batches, there.at, workers.slow)
        for _ in range(3):
            next(results)
        begun = time.monotonic()
        results.close()
        assert time.monotonic() - begun < 2.0
        assert tasks_of(there.at) == 0
        time.sleep(0.3)
        solved = there.solved.read_text()
        time.sleep(0.2)
        assert there.solved.read_text() == solved  # workers do not go on with it
        assert solved.count("\n") < CASES

        # at no time has the scheduler more than two parcels a worker, and as many whose results are being taken
        counts = []
        with distributed.Client(there.at.find(), set_as_default=False) as client:
            for _ in solve_on_cluster(batches, there.at, workers.made_up):
                counts.append(client.run_on_scheduler(count_tasks))
        assert len(counts) == CASES
        assert 1 <= max(counts) <= 8

        # when the scheduler goes, so does the sweep, with a message
        results = solve_on_cluster(batches, there.at, workers.slow)
        next(results)
        there.scheduler.kill()
        with pytest.raises(UserError, match=r"tcp://127.0.0.1:\d+: the scheduler is gone: .*; run again"):
            list(results)
        monkeypatch.setattr(cluster, "_CONNECT_SECONDS", 1.0)
        with pytest.raises(UserError, match="no Dask scheduler can be reached there"):
            list(solve_on_cluster(batches, there.at, workers.slow))


def pause(dask_worker: distributed.Worker) -> None:
    dask_worker.status = distributed.Status.paused


def test_a_paused_worker_keeps_no_work(study: Study, tmp_path: Path) -> None:
    """Dask pauses one whose memory is nearly full, perhaps for good, and what it held was waited for."""
    batches, told = sweep.make_batches(expand(study).cases, 1), []
    with (
        running(tmp_path, "--no-nanny", "--memory-limit", "0") as there,  # of which Dask ends no pause by itself
        distributed.Client(there.at.find(), set_as_default=False) as client,
    ):
        client.wait_for_workers(2, timeout=60)
        results = solve_on_cluster(batches, there.at, workers.slow, tell=told.append)
        solved = [next(results)]
        paused, other = sorted(client.nthreads())
        client.run(pause, workers=[paused])
        solved += results
        assert {result.status for _, result in solved} == {Status.SOLVED}
        assert sorted(case.key for case, _ in solved) == sorted(case.key for batch in batches for case in batch)
        words = f"worker {paused}: paused by Dask, as its memory is nearly full: it gets no work meanwhile"
        assert told == [words]

        # nor does it get any at the start, and without another one the sweep says what it waits for
        last = "all workers are gone or paused: waiting for new ones"

        def tell(text: str) -> None:
            told.append(text)
            if text == last:
                there.scheduler.kill()

        results = solve_on_cluster(batches, there.at, workers.slow, tell=tell)
        next(results)
        client.run(pause, workers=[other])
        with pytest.raises(UserError, match="the scheduler is gone"):
            list(results)
        assert told[1:] == [words, words.replace(paused, other), last]


@pytest.mark.heavy
def test_the_command_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The solver, on the cluster and here: the same bits but for the seconds; Ctrl-C ends it with 130."""
    path = tmp_path / "study.yaml"
    path.write_text(STUDY.replace("[10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120]", "[20, 60]"))
    command = [sys.executable, "-m", "rcstudy", "sweep", str(path), "-o"]
    here, there = tmp_path / "here.nc", tmp_path / "there.nc"
    monkeypatch.setenv("PYTHONPATH", str(TESTS.parent))
    with running(tmp_path, "--no-nanny") as dask:
        subprocess.run([*command, str(here), "--workers", "1"], check=True, capture_output=True)
        far = [*command, str(there), "--scheduler", dask.at.find()]
        done = subprocess.run(far, check=True, capture_output=True, text=True)
        assert "10 of 10 cases solved" in done.stdout
        assert "10/10 cases" in done.stderr
        with xr.open_datatree(here) as a, xr.open_datatree(there) as b:
            for name in ("loads", "bare"):
                one, other = (tree[name].to_dataset(inherit=False).drop_vars("solve_seconds") for tree in (a, b))
                xr.testing.assert_identical(one.drop_attrs(deep=False), other.drop_attrs(deep=False))
        for process in dask.workers:
            process.kill()
        before = there.read_bytes()
        process = subprocess.Popen(
            [*command, str(there), "--fresh", "--scheduler-file", str(dask.file)] if "--fresh" in _help() else far,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert process.stderr is not None
        told = ""
        while "waiting for workers" not in told:
            told += process.stderr.readline()
            assert process.poll() is None, told
        begun = time.monotonic()
        process.send_signal(signal.SIGINT)
        assert process.wait(10) == 130
        assert time.monotonic() - begun < 2.0
        assert there.read_bytes() == before


def _help() -> str:
    done = subprocess.run([sys.executable, "-m", "rcstudy", "sweep", "--help"], capture_output=True, text=True)
    return done.stdout


# what needs no cluster


def one_batch(study: Study) -> list[list[Case]]:
    return [list(expand(study).cases[:1])]


def refusal(study: Study, at: Scheduler) -> str:
    with pytest.raises(UserError) as error:
        list(solve_on_cluster(one_batch(study), at, workers.made_up))
    return str(error.value)


def test_schedulers_that_are_none(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "_CONNECT_SECONDS", 1.0)
    for address in ("tcp://127.0.0.1:1", "127.0.0.1:1", "nonsense://x", "tcp://", "", "tcp://127.0.0.1:99999", "a\0b"):
        assert "no Dask scheduler can be reached there" in refusal(study, Scheduler(address)), address
        # one that is not closed would be when it is collected, and wait for itself in the midst of another one's start
        assert {client.status for client in gc.get_objects() if type(client) is distributed.Client} <= {"closed"}
    file = tmp_path / "scheduler.json"
    assert refusal(study, Scheduler(file=file)) == f"{file}: cannot be read: No such file or directory"
    for text in (b"", b"[]", b"{}", b"\xff", b'{"address": 1}', b"[" * 100_000):
        file.write_bytes(text)
        assert "not a scheduler file" in refusal(study, Scheduler(file=file)), text
    assert threading.main_thread() is threading.current_thread()


@pytest.mark.parametrize(
    ("said", "ends"),
    [
        (b"HTTP/1.0 400 Bad request\r\n\r\n", True),  # as at the dashboard's port: asked for exabytes, Dask has no room
        (b"SSH-2.0-OpenSSH_9.2\r\n", False),
        (bytes(64), False),
        (b"".join(n.to_bytes(8, "little") for n in (24, 1, 8)) + b"\xc1" * 8, False),
        (b"", True),
        (b"", False),  # nothing at all, as a scheduler that is stopped
    ],
)
def test_another_service_in_place_of_a_scheduler(
    study: Study, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, said: bytes, ends: bool
) -> None:
    """It answers in a way of its own, which is told in a line, or never does; it was a traceback, or waited for."""
    monkeypatch.setattr(cluster, "_CONNECT_SECONDS", 1.0)
    with socket.create_server(("127.0.0.1", 0)) as listening, contextlib.ExitStack() as held:

        def answer() -> None:
            with contextlib.suppress(OSError):
                while True:
                    connection, _ = listening.accept()
                    connection.sendall(said)
                    held.push(connection)
                    if ends:
                        connection.close()

        threading.Thread(target=answer, daemon=True).start()
        address = "tcp://{}:{}".format(*listening.getsockname())
        told = refusal(study, Scheduler(address))
        assert told.startswith(f"{address}: no Dask scheduler can be reached there: ")
        assert "\n" not in told
        assert {client.status for client in gc.get_objects() if type(client) is distributed.Client} <= {"closed"}
        listening.shutdown(socket.SHUT_RDWR)
    assert caplog.text == ""


def test_without_dask(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert "pip install '.[cluster]' in a checkout" in refusal(study, Scheduler("tcp://127.0.0.1:1"))


def test_a_scheduler_that_cannot_be_used_is_told_of_before_anything_begins(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was told of behind "solving 6000 cases"."""
    begun: list[int] = []
    reporter = SimpleNamespace(begin=begun.append, advance=None, end=lambda: None)
    for scheduler in (Scheduler(file=tmp_path / "none.json"), Scheduler("tcp://127.0.0.1:1")):
        with pytest.raises(UserError):
            sweep.run(study, tmp_path / "c.nc", scheduler=scheduler, progress=reporter)
        assert begun == []
        monkeypatch.setitem(sys.modules, "distributed", None)


def test_options_that_exclude_each_other(study: Study, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for options in (
        ["--scheduler", "tcp://x:1", "--scheduler-file", "f"],
        ["--scheduler", "tcp://x:1", "--workers", "2"],
    ):
        with pytest.raises(SystemExit) as left:
            cli.app(["sweep", str(study.path), "-o", str(tmp_path / "c.nc"), *options])
        assert left.value.code == 2
    said = capsys.readouterr().err.splitlines()
    assert said[0] == "--scheduler and --scheduler-file: one of them, not both"
    assert said[1].startswith("choose local workers or a scheduler")


def test_a_missing_scheduler_file_is_told_even_if_nothing_is_left(study: Study, tmp_path: Path) -> None:
    """The mistake showed only once there was something to solve."""
    sweep.run(study, tmp_path / "c.nc", workers=1)
    with pytest.raises(UserError, match=r"lost\.json: cannot be read: No such file"):
        sweep.run(study, tmp_path / "c.nc", scheduler=Scheduler(file=tmp_path / "lost.json"))


def test_a_scheduler_that_cannot_import_rcstudy_is_refused(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    """It would give each case the error that its task cannot be read."""

    def fails(function: object) -> None:
        raise ModuleNotFoundError("No module named 'rcstudy'")

    client = FakeClient({})
    monkeypatch.setattr(client, "run_on_scheduler", fails, raising=False)
    with pytest.raises(UserError, match="the scheduler Dask cluster: it cannot import rcstudy: No module named"):
        list(cluster._Distribution(client, workers.made_up, one_batch(study), print).run())


class FakeClient:
    """What `_Distribution` asks a client for, answered without a cluster."""

    status = "running"
    scheduler = None

    def __init__(self, answers: dict[str, object], threads: int = 1) -> None:
        self.answers, self.threads = answers, threads

    def nthreads(self) -> dict[str, int]:
        return dict.fromkeys(self.answers, self.threads)

    def run_on_scheduler(self, function: object) -> set[str]:
        return set()  # none is paused

    def run(self, function: object, workers: list[str], on_error: str) -> dict[str, object]:
        return {address: self.answers[address] for address in workers}


def test_workers_with_other_code_are_refused(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    ours = remote.examine()
    for answer, said in (
        ({**ours, "solver": "0"}, f"its solver is version 0, here it is {ours['solver']}"),
        ({**ours, "rcstudy": "9.9"}, f"its rcstudy is version 9.9, here it is {ours['rcstudy']}"),
        (ModuleNotFoundError("No module named 'rcstudy'"), "it cannot import rcstudy: No module named 'rcstudy'"),
        (Exception("ModuleNotFoundError('rcstudy')"), "it cannot import rcstudy: ModuleNotFoundError"),
        (MemoryError("full"), "it cannot be examined: MemoryError: full"),
    ):
        client = FakeClient({"tcp://a:1": ours, "tcp://b:1": answer})
        with pytest.raises(UserError, match="worker tcp://b:1: ") as error:
            cluster._Distribution(client, workers.made_up, one_batch(study), print)._update_workers()
        assert said in str(error.value)
        # one that joins later is left out, and told of once
        client = FakeClient({"tcp://a:1": ours})
        told: list[str] = []
        deal = cluster._Distribution(client, workers.made_up, one_batch(study), told.append)
        deal._update_workers()
        client.answers["tcp://b:1"] = answer
        for _ in range(2):
            deal.next_look = 0.0
            deal._update_workers()
        assert list(deal.workers) == ["tcp://a:1"]
        assert len(told) == 1
        assert said in told[0]


@pytest.mark.parametrize(("error", "reason"), [(OSError("nobody there"), "nobody there"), (OSError(), "OSError")])
def test_without_an_address_no_workers_are_started(
    monkeypatch: pytest.MonkeyPatch, error: OSError, reason: str
) -> None:
    """Dask, asked for none, starts a scheduler and workers of its own on this computer."""
    asked: list[str] = []

    def refused(client: distributed.Client, address: str, **_others: Any) -> None:
        asked.append(address)
        raise error

    monkeypatch.setattr(distributed.Client, "__init__", refused)
    monkeypatch.setattr(distributed.Client, "__del__", lambda client: None)
    words = rf"^\(no address\): no Dask scheduler can be reached there: {reason}$"
    with pytest.raises(UserError, match=words), cluster._connected(Scheduler("")):
        pass
    assert len(asked) == 1 and asked[0]


def test_workers_that_are_not_quite_right_are_told_of_once(study: Study) -> None:
    ours = {**remote.examine(), "OMP_NUM_THREADS": "1"}
    theirs = {**ours, "numpy": "1.0", "code": "0", "OMP_NUM_THREADS": "not set"}
    client = FakeClient({"tcp://a:1": theirs, "tcp://b:1": theirs}, threads=4)
    told: list[str] = []
    deal = cluster._Distribution(client, workers.made_up, one_batch(study), told.append)
    deal.ours = ours
    deal._update_workers()
    assert len(deal.workers) == 2
    assert told == [
        "note on worker tcp://a:1: the files of its rcstudy are others than here, of the same version: numbers may"
        " differ",
        f"note on worker tcp://a:1: numpy 1.0, here {ours['numpy']}: last digits may differ",
        "note on worker tcp://a:1: 4 threads, of which one is used: start workers with --nthreads 1 --nworkers 4",
        "note on worker tcp://a:1: OMP_NUM_THREADS is not set: set it to 1, or numerical libraries may start threads of"
        " their own",
    ]


def test_checkouts_of_one_version_that_were_edited_are_told_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(remote, "__file__", str(tmp_path / "workers" / "remote.py"))
    (tmp_path / "mechanics" / "kernels").mkdir(parents=True)
    (tmp_path / "bars").mkdir()
    found = {remote.examine()["code"]}
    for name in ("mechanics/kernels/a.py", "bars/a.py", "solve.py", "result.py"):
        for text in ("a = 1", "a = 2"):
            (tmp_path / name).write_text(text)
            found.add(remote.examine()["code"])
    assert len(found) == 9
    (tmp_path / "cli.py").write_text("a = 1")  # no number comes from it
    assert len(found | {remote.examine()["code"]}) == 9
    (tmp_path / "bars" / "b.py").write_text("b = 1")
    code, listed = remote.examine()["code"], Path.glob
    monkeypatch.setattr(Path, "glob", lambda path, name: reversed(list(listed(path, name))))
    assert remote.examine()["code"] == code  # folders are listed in any order


def test_parcels_get_smaller_and_lose_nothing(study: Study) -> None:
    cases = expand(study).cases
    for count, batches in ((2, sweep.make_batches(cases, 1)), (3, [list(cases)]), (1, [[case] for case in cases])):
        deal = cluster._Distribution(None, workers.made_up, batches, print)
        deal.workers = {str(k): [] for k in range(count)}
        parcels = []
        while (parcel := deal._next_parcel()) is not None:
            parcels.append(parcel)
        assert deal.left == 0
        assert [case for parcel in parcels for case in parcel.cases] == list(cases)
        sizes = [len(parcel.cases) for parcel in parcels]
        assert max(sizes) <= max(8, -(-CASES // (4 * count)))
        assert sizes[0] >= sizes[-1]
    # a mesh of 1024 x 1024 cells goes case by case
    mesh = dataclasses.replace(cases[0].scene.mesh, cells=(1024, 1024))
    large = [dataclasses.replace(case, scene=dataclasses.replace(case.scene, mesh=mesh)) for case in cases]
    deal = cluster._Distribution(None, workers.made_up, [large], print)
    deal.workers = {"a": []}
    parcel = deal._next_parcel()
    assert parcel is not None
    assert len(parcel.cases) == 1


@pytest.mark.parametrize("told", ["finished", "lost"])
def test_results_of_a_dead_worker_that_had_finished_are_fetched_again_from_another(study: Study, told: str) -> None:
    """Its parcel is put back without a death, and so is the one that waited behind another."""

    class Future:
        key = "k"

        def __init__(self, status: str) -> None:
            self.status = status

        def cancel(self) -> None:
            self.status = "cancelled"

    batches = sweep.make_batches(expand(study).cases, 1)
    deal = cluster._Distribution(FakeClient({}), workers.made_up, batches, print)
    deal.workers = {"tcp://a:1": []}
    for status in (told, "pending", "pending"):
        parcel = deal._next_parcel()
        assert parcel is not None
        parcel.future = Future(status)
        deal.workers["tcp://a:1"].append(parcel)
    one, two, three = deal.workers["tcp://a:1"]
    left = deal.left
    deal._take_back("tcp://a:1")
    assert deal.left == left + len(one.cases) + len(three.cases)
    assert [parcel.cases for parcel in deal.suspects] == [[case] for case in two.cases]
    assert {parcel.deaths for parcel in deal.suspects} == {0}
    suspect = deal.suspects.popleft()
    deal._died(suspect, "how")
    assert deal.given == []
    deal._died(deal.suspects.pop(), "how")
    ((case, result),) = deal.given
    assert case == suspect.cases[0]
    assert result == Result(Status.ERROR, "the worker process died 2 times at this case: how")


def test_a_case_whose_parcel_failed_has_met_no_death(study: Study) -> None:
    """Of its first one it was said to be the second."""
    (batch, *_) = sweep.make_batches(expand(study).cases, 1)
    deal = cluster._Distribution(FakeClient({}), workers.made_up, [], print)
    parcel = cluster._Parcel([batch], future=SimpleNamespace(status="error", key="k"))
    assert len(parcel.cases) > 1
    deal._failed(parcel, RuntimeError("made up"))
    alone = deal.suspects.popleft()
    assert (len(alone.cases), alone.suspect, alone.deaths) == (1, True, 0)
    deal._died(alone, "how")
    assert deal.given == []
    deal._died(deal.suspects.pop(), "how")
    assert [result.reason for _, result in deal.given] == ["the worker process died 2 times at this case: how"]


def test_cases_whose_worker_came_back_too_often_are_tried_again_one_by_one(study: Study) -> None:
    """As Dask tells of a parcel that ended its worker as often as it allows: a death of none of its cases alone."""

    class KilledWorker(Exception):
        pass

    (batch, *_) = sweep.make_batches(expand(study).cases, 1)
    deal = cluster._Distribution(FakeClient({}), workers.made_up, [], print)
    deal._failed(cluster._Parcel([batch], future=SimpleNamespace(status="error", key="k")), KilledWorker("made up"))
    assert [(parcel.cases, parcel.deaths) for parcel in deal.suspects] == [([case], 0) for case in batch]
    deal._failed(deal.suspects.popleft(), KilledWorker("made up"))
    assert deal.given == []
    deal._failed(deal.suspects.pop(), KilledWorker("made up"))
    ((case, result),) = deal.given
    assert case == batch[0]
    assert result.reason == "the worker process died 2 times at this case: its worker came back and died again"


@pytest.mark.parametrize("status", ["error", "finished"])
def test_a_time_limit_that_the_task_itself_ran_into_is_its_error(study: Study, status: str) -> None:
    """Put back, as results lost with their worker are, it would be tried for ever."""
    (batch, *_) = sweep.make_batches(expand(study).cases, 1)
    deal = cluster._Distribution(FakeClient({}), workers.made_up, [], print)
    deal._failed(cluster._Parcel([batch[:1]], future=SimpleNamespace(status=status, key="k")), TimeoutError("too long"))
    if status == "error":
        assert deal.given == [(batch[0], Result(Status.ERROR, "TimeoutError: too long"))]
        assert deal.left == 0
    else:
        assert deal.given == []
        assert deal.left == 1


def test_results_that_cannot_be_unpacked_are_not_asked_for_again(study: Study) -> None:
    """They are there and will be the same each time."""
    (batch, *_) = sweep.make_batches(expand(study).cases, 1)
    deal = cluster._Distribution(FakeClient({}), workers.made_up, [], print)
    ended = SimpleNamespace(status="finished", key="k")
    deal._failed(cluster._Parcel([batch[:1]], future=ended), AttributeError("made up"))
    assert deal.given == [(batch[0], Result(Status.ERROR, "AttributeError: made up"))]
    assert deal.left == 0
