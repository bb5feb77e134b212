"""The store of a sweep by itself: what it knows of results that are on their way."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest
import workers
from disks import give_room_for
from studies import SWEPT

from rcstudy import store, sweep
from rcstudy.cases import Case, expand
from rcstudy.record import Packed
from rcstudy.study import study_from_text
from rcstudy.units import unit_paths


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
        found.flush()
        assert len(unit_paths(found.folder)) == 1
        assert found._waiting == sum(len(result.body) for result in results[1:3]) / 100_000
