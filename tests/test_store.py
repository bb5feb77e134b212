"""The store of a sweep by itself: what it knows of results that are on their way."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from threading import Event
from time import monotonic, sleep

import pytest
import workers
from disks import give_room_for
from studies import SWEPT

from rcstudy import store, sweep
from rcstudy.cases import Case, expand
from rcstudy.result import Result, Status
from rcstudy.storage.record import Packed
from rcstudy.storage.units import unit_paths
from rcstudy.study import study_from_text


@contextmanager
def opened(folder: Path) -> Iterator[tuple[store.Store, Sequence[Case], list[Packed]]]:
    """A store, its first cases, and results of these."""
    study = study_from_text(SWEPT, "swept.yaml")
    cases, keep = expand(study).cases[:4], sweep.keep_of(study.outputs)
    results = list(sweep.Packing(workers.made_up, keep)([case.scene for case in cases]))
    with store.opened(folder / "c.nc", study.name, cases, keep, tell=print) as found:
        yield found, cases, results


def test_what_a_disk_could_not_take_still_waits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By its number and by its size."""
    give_room_for(1, monkeypatch)
    monkeypatch.setattr(store, "UNIT_SECONDS", (1e9,))
    monkeypatch.setattr(store, "UNIT_BYTES", 100_000)
    with opened(tmp_path) as (found, cases, results):
        for case, result in zip(cases[:3], results, strict=False):
            found.add(case.key, result)
        found._write(0.0)
        assert len(unit_paths(found.folder)) == 1
        assert found._waiting == sum(len(result.body) for result in results[1:3]) / 100_000


def test_of_two_units_with_a_case_the_later_one_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also when they are read again; a failure never replaces a solution."""
    monkeypatch.setattr(store, "UNIT_SECONDS", (1e9,))
    with opened(tmp_path) as (found, cases, _results):
        scene = cases[0].scene
        made = next(workers.made_up([scene]))
        later = replace(made, scalars=made.scalars | {"force_x": 7.0})
        failed = Result(Status.ERROR, "no", {}, {})
        pack = sweep.keep_of(study_from_text(SWEPT, "swept.yaml").outputs)
        for result in (made, later, failed):
            (packed,) = sweep.Packing(lambda scenes, result=result: iter([result]), pack)([scene])
            found.add(cases[0].key, packed)
            found._write(0.0)
        assert len(unit_paths(found.folder)) == 3
        assert found.index.record(cases[0].key).scalars["force_x"] == 7.0
    with opened(tmp_path) as (found, cases, _results):
        assert found.index.record(cases[0].key).scalars["force_x"] == 7.0


def test_less_than_a_unit_waits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a full unit's write finds left of it, once the one before has ended, is not written by itself."""
    monkeypatch.setattr(store, "UNIT_SECONDS", (1e9,))
    with opened(tmp_path) as (found, cases, results):
        found.add(cases[0].key, results[0])
        found._write(1.0)
        assert not unit_paths(found.folder)
        found._write(found._waiting)
        assert len(unit_paths(found.folder)) == 1


@pytest.mark.parametrize("failed", [False, True])
def test_a_store_with_nothing_to_write_sleeps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failed: bool) -> None:
    """As one does that could not write what it has; its thread kept a core busy otherwise."""
    monkeypatch.setattr(store, "UNIT_SECONDS", (50.0,))
    sleeps: list[float] = []

    class Noted(Event):
        def wait(self, timeout: float | None = None) -> bool:
            sleeps.append(timeout or 0.0)
            return super().wait(max(timeout or 0.0, 0.05))

    with opened(tmp_path) as (found, cases, results):
        before, found._wake = found._wake, Noted()
        if failed:
            found.add(cases[0].key, results[0])
            found._error = OSError("no room")
        found._since -= 100.0
        before.set()
        assert happens(lambda: sleeps)
        assert sleeps[0] == 50.0


def test_no_more_than_two_units_of_results_wait_in_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a disk so slow that the store's thread writes none meanwhile, who adds the last of them writes them."""
    monkeypatch.setattr(store, "UNIT_SECONDS", (1e9,))
    monkeypatch.setattr(store, "UNIT_CASES", 2)
    with opened(tmp_path) as (found, cases, results):
        found._closing = True
        found._wake.set()
        found._writer.join()
        for case, result in zip(cases[:3], results, strict=False):
            found.add(case.key, result)
        assert not unit_paths(found.folder) and found._waiting == 1.5
        found.add(cases[3].key, results[3])
        assert unit_paths(found.folder) and found._waiting == 0.0


def happens(condition: Callable[[], object]) -> bool:
    """Whether the condition holds within half a minute."""
    end = monotonic() + 30.0
    while not condition() and monotonic() < end:
        sleep(0.01)
    return bool(condition())


def test_results_wait_for_a_unit_no_longer_than_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The store's thread sleeps for what is left of the time. It looked every fifth of the time: up to a fifth late."""
    monkeypatch.setattr(store, "UNIT_SECONDS", (50.0,))
    sleeps: list[float] = []

    class Noted(Event):
        def wait(self, timeout: float | None = None) -> bool:
            sleeps.append(timeout or 0.0)
            return super().wait(timeout)

    with opened(tmp_path) as (found, cases, results):
        before, found._wake = found._wake, Noted()
        found.add(cases[0].key, results[0])
        found._since -= 20.0  # as if it had waited so long
        before.set()
        assert happens(lambda: sleeps)
        assert 0.0 < sleeps[0] <= 30.0
        assert not unit_paths(found.folder)
        found._since -= 30.0
        found._wake.set()
        assert happens(lambda: found._waiting == 0.0)
        assert len(unit_paths(found.folder)) == 1
