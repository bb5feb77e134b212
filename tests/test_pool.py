"""Which worker holds what: one batch that it solves, and the next one where batches are short."""

import multiprocessing
import os
import socket
import sys
import threading
import time
from collections import deque
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import workers
import xarray as xr

from rcstudy import sweep
from rcstudy.__main__ import workers_wanted
from rcstudy.cases import expand
from rcstudy.errors import UserError
from rcstudy.progress import Silent
from rcstudy.result import Status
from rcstudy.study import study_from_text
from rcstudy.workers import pool
from rcstudy.workers.batch import make_batches

STUDY = """
study: pool
scene: {substrate: {E: 210000, nu: 0.3}, radius: 50, mesh: {size: [2, 2], cells: [16, 16]}}
grids:
  loads:
    axes:
      load: [10, 20, 30, 40, 50, 70, 80, 90]
      creepage: [{longitudinal: 0.001}, {longitudinal: 0.002}, {longitudinal: 0.003}]
"""


@pytest.fixture(scope="module")
def batches():
    made = make_batches(expand(study_from_text(STUDY, "pool.yaml")).cases, 1)
    assert [len(batch) for batch in made] == [3] * 8
    return made


def held(batches, processes, solve):
    """The most batches that a worker held at once, and the cases in the order of their results."""
    most, order = 0, []
    with pool.Pool() as those:
        for case, result in those.solve(batches, processes, solve):
            assert result.status == 0
            order.append(case)
            most = max(most, *(len(worker.batches) for worker in those._workers))
        assert all(not worker.batches for worker in those._workers)
    assert len(order) == 3 * len(batches)
    assert {case.key for case in order} == {case.key for batch in batches for case in batch}
    return most, order


def test_the_next_batch_waits_in_the_worker(batches):
    most, order = held(batches, 1, workers.made_up)
    assert most == 2
    assert order == [case for batch in batches for case in batch]


@pytest.mark.parametrize(("part", "quick"), [(0.9, True), (1.1, False)])
def test_time_counts_from_a_batch_to_its_last_result(part, quick, monkeypatch):
    """Of a worker without a batch from when it is given one, else from the last result of the one before."""
    now = 1000.0
    monkeypatch.setattr(pool, "time", SimpleNamespace(monotonic=lambda: now))
    worker = pool._Worker(None, None)
    worker.give(pool._Batch(deque("ab"), False))
    now += 0.5 * part * pool._AHEAD_SECONDS
    worker.give(pool._Batch(deque("c"), False))
    assert (worker.solved(), worker.quick) == ("a", False)
    for case in "bc":
        worker.quick = not quick
        now += (0.5 if case == "b" else 1.0) * part * pool._AHEAD_SECONDS
        assert (worker.solved(), worker.quick) == (case, quick)


@pytest.mark.skipif(sys.platform != "linux", reason="as far as the system allows")
def test_results_need_not_wait_until_they_are_read():
    """The buffer of a connection is enlarged."""
    ours, theirs = multiprocessing.Pipe()
    with ours, theirs, socket.socket(fileno=os.dup(ours.fileno())) as end:
        before = end.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF)
        pool._widen(ours)
        assert end.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF) > before


class Sent(list):
    """What a worker's results are sent into: a list of all messages."""

    def send(self, results):
        self.append(results)


def test_results_wait_for_those_that_come_soon(monkeypatch):
    """As long as they may; one that may not wait takes those before it along."""
    sent, asleep, awake, waits = Sent(), threading.Event(), threading.Event(), []

    def sleep(seconds):
        waits.append(seconds)
        asleep.set()
        awake.wait(10.0)

    monkeypatch.setattr(pool, "time", SimpleNamespace(sleep=sleep))
    outbox = pool._Outbox(sent)
    outbox.add("a", 0.25)
    assert asleep.wait(10.0)
    outbox.add("b", 0.25)
    assert (sent, waits) == ([], [0.25])
    outbox.add("c", 0.0)
    assert sent == [["a", "b", "c"]]
    awake.set()


def test_a_long_batch_is_not_sent_ahead(batches, monkeypatch):
    monkeypatch.setattr(pool, "_AHEAD_BYTES", 100)
    assert held(batches, 1, workers.made_up)[0] == 1


def test_no_batch_waits_in_a_worker_that_takes_long(batches, monkeypatch):
    monkeypatch.setattr(pool, "_AHEAD_SECONDS", 0.0)
    assert held(batches, 1, workers.slowly)[0] == 1


def test_the_last_batches_are_for_those_that_have_none(batches):
    assert held(batches[:3], 2, workers.slowly)[0] == 1


def test_a_batch_sent_ahead_to_a_worker_that_died_is_solved_by_another(batches, tmp_path, monkeypatch):
    monkeypatch.setenv("DEATHS", str(tmp_path))
    assert held(batches, 1, workers.dies_early)[0] == 2
    assert (tmp_path / "died").exists()


def test_a_result_arrives_while_the_next_case_is_being_solved(batches, tmp_path, monkeypatch):
    """The next case ends only when it has arrived. It came with the next one before, however long that took."""
    monkeypatch.setenv("ARRIVED", str(tmp_path))
    start = time.monotonic()
    with pool.Pool() as those:
        solved = those.solve(batches[:1], 1, workers.waits_for_the_first)
        assert next(solved)[0] == batches[0][0]
        (tmp_path / "first").touch()
        assert [case for case, _ in solved] == batches[0][1:]
    assert time.monotonic() - start < 55.0


def test_workers_that_wait_for_work_solve_what_they_are_given_and_discard_it(batches, tmp_path, monkeypatch):
    monkeypatch.setenv("NOTES", str(tmp_path))
    with pool.Pool("rcstudy.solve") as those:
        those.start(2)
        those.prepare(workers.notes, [batches[0][0].scene])
        until = time.monotonic() + 60.0
        while len(list(tmp_path.iterdir())) < 2 and time.monotonic() < until:
            time.sleep(0.01)
        solved = [case for case, _ in those.solve(batches[1:], 2, workers.notes)]
        pids = {worker.process.pid for worker in those._workers}
    assert {case.key for case in solved} == {case.key for batch in batches[1:] for case in batch}
    first = batches[0][0].scene.load
    assert {path.name for path in tmp_path.glob(f"* {first}")} == {f"{pid} {first}" for pid in pids}


def test_scenes_to_warm_up_with_are_solved_one_by_one(batches, tmp_path, monkeypatch):
    """They have no pressure in common, as those of a group have."""
    monkeypatch.setenv("NOTES", str(tmp_path))
    scene = batches[0][0].scene
    with pool.Pool() as those:
        those.start(1)
        those.prepare(workers.notes_groups, [scene, replace(scene, coupling="full")])
        assert len(list(those.solve(batches[1:2], 1, workers.notes_groups))) == 3
    assert {path.name for path in tmp_path.iterdir()} == {"1 one-way", "1 full", "3 one-way"}


def test_workers_of_a_sweep_that_was_broken_off_solve_as_the_next_one_asks(tmp_path):
    """They went on as the first had told them: the second cube had no fields, and no case of it counted as failed."""

    class Ends(Silent):
        def advance(self, *, failed):
            raise RuntimeError("broken off")

    without_fields = study_from_text(f"{STUDY}outputs: {{fields: false}}\n", "pool.yaml")
    study, two = study_from_text(STUDY, "pool.yaml"), {"workers": 2, "solve": workers.slowly}
    with pool.Pool() as those:
        with pytest.raises(RuntimeError, match="broken off"):
            sweep.run(without_fields, tmp_path / "1.nc", processes=those, progress=Ends(), **two)
        assert those._workers
        done = sweep.run(study, tmp_path / "2.nc", processes=those, **two)
    assert (done.cases, done.failed) == (24, 0)
    with xr.open_dataset(tmp_path / "2.nc") as cube:
        assert np.isfinite(cube.pressure).all()


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        ("sweep a.yaml --workers 3", 3),
        ("sweep --workers=3 a.yaml -q", 3),
        ("sweep a.yaml", 0),
        ("sweep a.yaml --workers", 0),
        ("sweep a.yaml --workers -1", 0),
        ("sweep a.yaml --workers 3.5", 0),
        ("sweep a.yaml --workers 9999999", 0),
        ("sweep a.yaml --workers 3 --help", 0),
        ("plan a.yaml --workers 3", 0),
        ("", 0),
    ],
)
def test_workers_that_a_command_line_asks_for(words, wanted):
    assert workers_wanted(words.split()) == wanted


def test_the_case_that_was_being_solved_is_blamed_not_the_batch_sent_ahead(monkeypatch):
    """Each result is sent at once, as after a death; the worker that dies is quick, and holds two batches."""
    monkeypatch.setattr(pool, "_PATIENCE", 0.0)
    text = STUDY.replace("[16, 16]", "[18, 16]").replace("40, 50", "60, 50")
    text = text.replace("{longitudinal: 0.003}", "{lateral: 1}")
    batches = make_batches(expand(study_from_text(text, "pool.yaml")).cases, 1)
    told = []
    with pool.Pool() as those:
        found = {case.key: result for case, result in those.solve(batches, 1, workers.dies, told.append)}
    assert len(found) == 24
    (failed,) = [result for result in found.values() if result.status != Status.SOLVED]
    assert "died 2 times at this case" in failed.reason
    assert len(told) == 2


def test_daemonic_processes_have_no_workers(monkeypatch, tmp_path):
    """Python allows them none: what asks for some is told so, what leaves the choice goes on in the process itself."""
    monkeypatch.setitem(multiprocessing.current_process()._config, "daemon", True)
    assert not pool.may_start()
    with pool.Pool() as those, pytest.raises(UserError, match="do not start in daemonic processes"):
        those.start(1)
    study = study_from_text(STUDY, "pool.yaml")
    with pytest.raises(UserError, match="daemonic"):
        sweep.run(study, tmp_path / "two.nc", workers=2, solve=workers.made_up)
    monkeypatch.setattr(sweep, "_SECONDS_TO_JUDGE", 0.0)
    monkeypatch.setattr(sweep, "_SECONDS_WORTH_WORKERS", 0.0)
    assert sweep.run(study, tmp_path / "own.nc", solve=workers.made_up).solved == 24


@pytest.mark.parametrize(("others", "raises"), [([], [2]), ([True], []), ([False, False], [2])])
def test_workers_that_do_not_start_end_a_sweep_where_no_other_one_has(others, raises):
    """After three in a row: one that runs out of memory at its start is replaced."""
    ended = SimpleNamespace(join=lambda: None, exitcode=1)
    those = pool.Pool()
    found = []
    for k in range(4):
        dead = pool._Worker(ended, SimpleNamespace(close=lambda: None))
        those._workers = [dead, *(SimpleNamespace(ready=ready) for ready in others)]
        try:
            assert list(those._handle_death(dead)) == []
        except UserError as error:
            assert "worker processes do not start (exit code 1)" in str(error)
            found.append(k)
            break
    assert found == raises
