"""A cube that is made while its cases are being solved is the one that is made at the end."""

from __future__ import annotations

import errno
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import cubes
import pytest
import synthetic
import workers

from rcstudy import assemble, store, sweep
from rcstudy.cube import open_cube
from rcstudy.errors import UserError
from rcstudy.mechanics.scene import Scene
from rcstudy.report.views import grids
from rcstudy.result import Result, Status
from rcstudy.storage import cube_writer
from rcstudy.storage.units import Unit, unit_paths
from rcstudy.study import Study, study_from_text

STUDY = """
study: assembled
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  mesh: {size: [1, 1], cells: [24, 20]}
  load: 100
outputs: {crop: none}
grids:
  loads:
    axes:
      load: [20, 40, 60, 80]
      creepage: [{longitudinal: 0.001}, {lateral: 0.002}, {spin: 0.01}]
  bare:
    axes: {radius: [30, 40]}
"""
CASES = 14


@pytest.fixture
def study(monkeypatch: pytest.MonkeyPatch) -> Study:
    """A study of 14 cases; units of two cases, which go to the cube one by one."""
    monkeypatch.setattr(store, "UNIT_CASES", 2)
    monkeypatch.setattr(assemble, "AT_ONCE", 1)
    return study_from_text(STUDY, "s.yaml")


@pytest.fixture
def at_the_end(study: Study, tmp_path: Path) -> Path:
    """Its cube, made when all cases were solved."""
    path = tmp_path / "end" / "c.nc"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(assemble.Assembly, "go_on", lambda _: None)
        sweep.run(study, path, workers=1, solve=workers.made_up)
    return path


@pytest.fixture
def taken(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Cases in the order in which cubes take them: their grid and index."""
    found = []
    add = cube_writer.CubeWriter.add

    def noted(self: cube_writer.CubeWriter, some: Sequence) -> None:
        found.extend(f"{case.grid} {case.index}" for case, _ in some)
        add(self, some)

    monkeypatch.setattr(cube_writer.CubeWriter, "add", noted)
    return found


def order(study: Study) -> list[str]:
    from rcstudy.cases import expand

    return [f"{case.grid} {case.index}" for case in expand(study).cases]


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir() if path.is_file())


def noting(seen: list[int], taken: list[str]) -> Callable[[Sequence[Scene]], Iterator[Result]]:
    """A solver that puts into `seen` how many cases are in the cube when each result is asked for."""

    def solve(scenes: Sequence[Scene]) -> Iterator[Result]:
        for scene in scenes:
            seen.append(len(taken))
            yield synthetic.made_up_result(scene)

    return solve


def test_most_of_it_is_there_when_the_last_case_is_solved(
    study: Study, at_the_end: Path, tmp_path: Path, taken: list[str]
) -> None:
    seen: list[int] = []
    solve = noting(seen, taken)
    sweep.run(study, tmp_path / "c.nc", workers=1, solve=solve)
    # two by two, as their units are written; before the last result is asked for, those before it were taken
    assert seen[-1] >= CASES - 4
    assert seen == sorted(seen)
    assert taken == order(study)
    cubes.assert_same(tmp_path / "c.nc", at_the_end)
    assert files(tmp_path) == ["c.nc"]


def test_a_case_that_failed_before_waits_for_its_result(
    study: Study, at_the_end: Path, tmp_path: Path, taken: list[str]
) -> None:
    """The failure that stands in a unit is not what goes into the cube."""

    def first(scenes: Sequence[Scene]) -> Iterator[Result]:
        for scene in scenes:
            if scene.radius[0] == 40.0:  # the last
                raise KeyboardInterrupt
            yield synthetic.made_up_result(scene, Status.REFUSED if scene.load == 40.0 else Status.SOLVED)

    with pytest.raises(sweep.Interrupted):
        sweep.run(study, tmp_path / "c.nc", workers=1, solve=first)
    assert files(tmp_path) == []
    taken.clear()
    done = sweep.run(study, tmp_path / "c.nc", workers=1, solve=workers.made_up)
    assert (done.kept, done.failed) == (CASES - 4, 0)
    assert taken == order(study)
    cubes.assert_same(tmp_path / "c.nc", at_the_end)


def test_a_cube_that_cannot_be_written_meanwhile_is_made_at_the_end(
    study: Study, at_the_end: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk is full while cases are solved: their results have the room, and there is some at the end."""
    add = cube_writer.CubeWriter.add
    seen = []

    def full(self: cube_writer.CubeWriter, some: Sequence) -> None:
        add(self, some)
        if len(seen) < 5:
            seen.append(files(tmp_path))
            if len(seen) == 5:
                raise OSError(errno.ENOSPC, "No space left on device")

    def solve(scenes: Sequence[Scene]) -> Iterator[Result]:
        for scene in scenes:
            if len(seen) == 5:
                seen.append(files(tmp_path))
            yield synthetic.made_up_result(scene)

    monkeypatch.setattr(cube_writer.CubeWriter, "add", full)
    sweep.run(study, tmp_path / "c.nc", workers=1, solve=solve)
    assert all(len(names) == 1 and names[0].startswith("c.nc.tmp-") for names in seen[:5])
    assert seen[5] == []
    cubes.assert_same(tmp_path / "c.nc", at_the_end)


def test_a_cube_that_cannot_be_written_at_all(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: cube_writer.CubeWriter, some: Sequence) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(cube_writer.CubeWriter, "add", full)
    with pytest.raises(UserError, match="No space left on device\n14 of 14 cases are kept") as caught:
        sweep.run(study, tmp_path / "c.nc", workers=1, solve=workers.made_up)
    assert str(caught.value).endswith("resume when there is room (rcstudy plan tells how much a cube needs)")
    assert files(tmp_path) == []
    assert unit_paths(store.units_folder(tmp_path / "c.nc"))


def test_fields_cut_to_the_contact_need_all_cases_first(study: Study, tmp_path: Path, taken: list[str]) -> None:
    cropped = study_from_text(STUDY.replace("crop: none", "crop: contact"), "s.yaml")
    seen: list[int] = []
    solve = noting(seen, taken)
    sweep.run(cropped, tmp_path / "c.nc", workers=1, solve=solve)
    assert set(seen) == {0}
    assert taken == order(study)


def test_units_are_filled_though_they_are_written_behind_the_sweep(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While one is being written others come; they wait until they fill the next one, or until it is the end."""
    sizes = []
    write = store.write_unit

    def slowly(folder: Path, number: int, cases: Sequence[tuple[str, bytes]], study: str) -> Unit:
        sizes.append(len(cases))
        time.sleep(0.05)
        return write(folder, number, cases, study)

    monkeypatch.setattr(store, "write_unit", slowly)
    monkeypatch.setattr(store, "UNIT_CASES", 4)
    monkeypatch.setattr(store, "UNIT_SECONDS", (60.0,))  # none because it has waited for long
    monkeypatch.setattr(store, "_PUT_TOGETHER", 100)
    sweep.run(study, tmp_path / "c.nc", workers=1, solve=workers.slowly)
    assert sum(sizes) == CASES
    assert all(4 <= size <= 8 for size in sizes[:-1])


def test_crops_to_contacts_of_a_single_cell_keep_its_size(tmp_path: Path) -> None:
    """Two cells each way are stored: figures and comparisons tell a cell's size by them."""
    text = STUDY
    for one, other in (("none", "contact"), ("cells: [24, 20]", "cells: [7, 7]"), ("[20, 40, 60, 80]", "[3]")):
        text = text.replace(one, other)
    sweep.run(study_from_text(text, "s.yaml"), tmp_path / "c.nc", workers=1)
    with open_cube(tmp_path / "c.nc") as tree:
        loads = tree["loads"]
        assert (loads.status == Status.SOLVED).all()
        assert (loads.pressure > 0.0).sum() == 3  # three cases of one cell
        assert (loads.sizes["x"], loads.sizes["y"]) == (2, 2)
        (view, *_) = grids(tree)["loads"].cases()
        assert view.spacing == pytest.approx((1 / 7, 1 / 7))


def test_results_go_before_the_cube_on_a_disk_that_is_full(
    study: Study, at_the_end: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Units that find no room while the cube is being made take its place; it is made once all is solved."""
    refused, write = [], store.write_unit

    def no_room(*arguments: Any) -> Unit:
        if list(tmp_path.glob("c.nc.tmp-*")):
            refused.append(1)
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(*arguments)

    monkeypatch.setattr(store, "write_unit", no_room)
    monkeypatch.setattr(store, "UNIT_CASES", 4)
    done = sweep.run(study, tmp_path / "c.nc", workers=1, solve=workers.made_up)
    assert refused
    assert done.solved == CASES
    cubes.assert_same(tmp_path / "c.nc", at_the_end)
    assert files(tmp_path) == ["c.nc"]
