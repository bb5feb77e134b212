"""Sweeps that go on: what is solved is kept, what is missing, failed or changed is solved, and the cube is the same."""

from __future__ import annotations

import contextlib
import fcntl
import functools
import io
import json
import os
import shutil
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import cubes
import h5py
import numpy as np
import pytest
import synthetic
import workers
from disks import fill_up, give_room_for
from studies import CASES, SWEPT
from test_sweep import Told

from rcstudy import assemble, failures, progress, status, store, sweep
from rcstudy.cases import expand, scene_record
from rcstudy.cube import case_table, grids, open_cube
from rcstudy.errors import UserError
from rcstudy.failures import failed_cases, listing, write_studies
from rcstudy.mechanics import SOLVER_VERSION
from rcstudy.mechanics.scene import Scene
from rcstudy.merge import merge
from rcstudy.result import Result, Status
from rcstudy.status import report
from rcstudy.storage import index, lock, publish, record, units
from rcstudy.storage.cube_writer import checksum
from rcstudy.storage.units import read_unit, unit_paths, write_unit
from rcstudy.store import units_folder
from rcstudy.study import Study, load_study, study_from_text
from rcstudy.workers import cluster

REPLACED = "; it will be replaced: to keep it, choose another --output"


class Solver:
    """Made-up results; keeps the scenes it was given, fails those that `fails` says, is interrupted after `most`."""

    def __init__(self, most: int = 10**9, fails: Sequence[float] = ()) -> None:
        self.most = most
        self.fails = fails
        self.solved: list[Scene] = []

    def __call__(self, scenes: Sequence[Scene]) -> Iterator[Result]:
        for scene in scenes:
            if len(self.solved) >= self.most:
                raise KeyboardInterrupt
            self.solved.append(scene)
            failed = scene.load in self.fails
            yield synthetic.made_up_result(scene, Status.NOT_CONVERGED if failed else Status.SOLVED)


@functools.cache
def read_once(text: str) -> Study:
    """To read a study takes longer than most of these sweeps."""
    return study_from_text(text, "study.yaml")


class Sweeps:
    """Sweeps of one study in one folder, each with a solver and what it was told."""

    def __init__(self, folder: Path, in_one_go: Callable[[str], Path]) -> None:
        self.folder = folder
        self.in_one_go = in_one_go
        self.output = folder / "c.nc"
        self.units = units_folder(self.output)
        self.told: list[str] = []
        self.write(SWEPT)

    def write(self, text: str) -> None:
        (self.folder / "study.yaml").write_text(text)

    @property
    def study(self) -> Study:
        path = self.folder / "study.yaml"
        return replace(read_once(path.read_text()), path=path)

    def run(self, most: int = 10**9, fails: Sequence[float] = (), **options: object) -> list[Scene]:
        """The scenes that were solved; an interrupt comes after `most`."""
        solver = Solver(most, fails)
        self.told.clear()
        try:
            self.done = sweep.run(self.study, self.output, workers=1, solve=solver, tell=self.told.append, **options)
        except sweep.Interrupted as interrupt:
            self.interrupt = interrupt
        return solver.solved

    def uninterrupted(self) -> Path:
        """The cube of the study as it is now, made in one go elsewhere; not to be changed."""
        return self.in_one_go(self.study.text)


@pytest.fixture
def sweeps(tmp_path: Path, in_one_go: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch) -> Sweeps:
    monkeypatch.setattr(store, "UNIT_SECONDS", (1e9,))  # else a busy machine makes more units than a quick one
    return Sweeps(tmp_path, in_one_go)


@pytest.fixture(scope="module")
def in_one_go(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Makes the cube of a study's text, once for all tests."""
    folder = tmp_path_factory.mktemp("elsewhere")

    @functools.cache
    def made(text: str) -> Path:
        study = read_once(text)
        path = folder / f"{study.sha256}.nc"
        sweep.run(study, path, workers=1, solve=workers.made_up)
        return path

    return made


# resuming


@pytest.mark.parametrize("most", [1, 5, 13])
def test_interrupted_and_resumed(sweeps: Sweeps, most: int) -> None:
    assert len(sweeps.run(most)) == most
    assert (sweeps.interrupt.solved, sweeps.interrupt.cases) == (most, CASES)
    assert not sweeps.output.exists()
    rest = sweeps.run()
    assert len(rest) == CASES - most
    assert (sweeps.done.cases, sweeps.done.solved, sweeps.done.kept) == (CASES, CASES, most)
    assert f"{most} of {CASES} cases are solved already and kept" in sweeps.told
    assert not sweeps.units.exists()
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


@pytest.mark.parametrize("what", ["folder", "unit"])
def test_units_that_cannot_be_read_are_named(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    """The cube was said to be what cannot be written; the superuser may read all, hence no modes of files."""
    sweeps.run(most=5)
    (unit,) = unit_paths(sweeps.units)
    place, (owner, name) = (sweeps.units, (os, "scandir")) if what == "folder" else (unit, (Path, "read_bytes"))
    look = getattr(owner, name)

    def refused(path: Path) -> object:
        if path == place:
            raise PermissionError(13, "Permission denied", str(path))
        return look(path)

    monkeypatch.setattr(owner, name, refused)
    for command in (lambda: sweeps.run(), lambda: merge(sweeps.study, sweeps.output)):
        with pytest.raises(UserError) as refusal:
            command()
        assert str(refusal.value) == f"{place}: cannot be read: Permission denied"
    monkeypatch.undo()
    assert unit_paths(sweeps.units) == [unit]


def test_interrupted_again_and_again(sweeps: Sweeps) -> None:
    solved = []
    for _ in range(CASES):
        solved += sweeps.run(1)
    assert len(solved) == len({id(scene) for scene in solved}) == CASES
    assert sweeps.run() == []
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


def test_nothing_is_left_to_do(sweeps: Sweeps) -> None:
    sweeps.run()
    before = sweeps.output.read_bytes()
    assert sweeps.run() == []
    assert (sweeps.done.cases, sweeps.done.kept, sweeps.done.failures) == (CASES, CASES, [])
    assert sweeps.output.read_bytes() == before
    assert not sweeps.units.exists()


def test_interrupted_before_the_first_case_leaves_nothing(sweeps: Sweeps) -> None:
    sweeps.run(0)
    assert sweeps.interrupt.solved == 0
    assert not sweeps.units.exists()


def test_failed_cases_are_solved_again(sweeps: Sweeps) -> None:
    sweeps.run(fails=(40.0,))
    assert [f.label for f in sweeps.done.failures] == [f"load=40, creepage={c}" for c in "abc"]
    again = sweeps.run(fails=(40.0,))
    assert [scene.load for scene in again] == [40.0] * 3
    assert sweeps.done.failed == 3
    again = sweeps.run(2)
    assert (len(again), sweeps.interrupt.solved) == (2, CASES - 1)
    with open_cube(sweeps.output) as tree:  # the old one, still
        assert int((case_table(tree).status != Status.SOLVED).sum()) == 3
    assert [scene.load for scene in sweeps.run()] == [40.0]
    assert sweeps.done.failures == []
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


def test_failed_cases_in_more_units_than_files_stay_open(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(index, "_OPEN_FILES", 1)
    monkeypatch.setattr(store, "UNIT_CASES", 1)
    monkeypatch.setattr(store, "_PUT_TOGETHER", 100)
    sweeps.run(fails=(20.0, 80.0))
    assert [f.reason for f in sweeps.done.failures] == ["made up not to converge"] * 6


@pytest.mark.parametrize("most", [6, CASES])
def test_an_edited_study_solves_what_has_changed(sweeps: Sweeps, most: int) -> None:
    """Whether the others are in units or in the cube; whatever grid they stand in now."""
    sweeps.run(most)
    sweeps.write(SWEPT.replace("[20, 40, 60, 80]", "[80, 20, 50]").replace("bare", "plain"))
    found = sweeps.run()
    kept = {6: {20.0}, CASES: {20.0, 80.0}}[most]
    assert sorted({scene.load for scene in found if scene.creepage}) == sorted({20.0, 50.0, 80.0} - kept)
    assert sum(scene.creepage is None for scene in found) == (2 if most == 6 else 0)
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


def test_a_study_whose_words_alone_change(sweeps: Sweeps) -> None:
    sweeps.run()
    sweeps.write(SWEPT.replace("study: swept", "study: swept\ndescription: another"))
    assert sweeps.run() == []
    with open_cube(sweeps.output) as tree:
        assert tree.attrs["description"] == "another"
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


ALL, CROP, SINGLE, NONE = "{}", "{crop: contact}", "{precision: float32}", "{fields: false}"
BOTH = "{crop: contact, precision: float32}"


@pytest.mark.parametrize(
    ("most", "before", "after"),
    [
        (7, ALL, CROP),
        (CASES, CROP, ALL),
        (CASES, ALL, BOTH),
        (7, CROP, BOTH),
        (CASES, BOTH, SINGLE),
        (7, SINGLE, BOTH),
        (7, ALL, NONE),
        (CASES, CROP, NONE),
        (CASES, SINGLE, ALL),
        (7, BOTH, CROP),
        (CASES, NONE, ALL),
        (7, NONE, NONE),
    ],
)
def test_outputs_that_hold_less_are_made_of_those_that_hold_more(
    sweeps: Sweeps, before: str, after: str, most: int
) -> None:
    sweeps.write(f"{SWEPT}outputs: {before}\n")
    sweeps.run(most)
    sweeps.write(f"{SWEPT}outputs: {after}\n")
    ranks = [0 if "fields" in text else 1 if "float32" in text else 2 for text in (before, after)]
    assert len(sweeps.run()) == (CASES - most if ranks[0] >= ranks[1] else CASES)
    # all were solved again without a word why
    told = [text for text in sweeps.told if "cannot be taken: outputs asks for fields in " in text]
    assert len(told) == (most == CASES and ranks[0] < ranks[1])
    assert not any("will not contain" in text for text in sweeps.told) or most == CASES  # that is said of cubes alone
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


def test_cropped_fields_are_cut_to_all_contacts_of_the_grid(sweeps: Sweeps) -> None:
    sweeps.run()
    sweeps.write(f"{SWEPT}outputs: {{crop: contact}}\n")
    with open_cube(sweeps.output) as tree:
        whole = {name: grid.load() for name, grid in grids(tree).items()}
    sweeps.run(fresh=True)
    with open_cube(sweeps.output) as tree:
        for name, grid in grids(tree).items():
            assert grid.sizes["x"] < whole[name].sizes["x"]
            part = whole[name].sel(x=grid.x, y=grid.y)
            np.testing.assert_array_equal(grid.pressure, part.pressure)
            touched = (whole[name].pressure > 0).any([d for d in whole[name].pressure.dims if d not in "xy"])
            assert grid.sizes["x"] == int(touched.any("y").sum())
            assert grid.sizes["y"] == int(touched.any("x").sum())


def test_cropped_fields_of_several_meshes(sweeps: Sweeps) -> None:
    text = SWEPT.replace("axes: {radius: [30, 40]}", "axes: {mesh.cells: [[24, 20], [30, 40]], load: [30, 60]}")
    sweeps.write(f"{text}outputs: {{crop: contact}}\n")
    sweeps.run(13)
    sweeps.run()
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())
    before = grid_of(sweeps.output, "bare")
    assert before.x_centre.dims == ("cells", "load", "x")
    assert int(before.pressure.isel(cells=0, load=0).notnull().sum()) < before.sizes["x"] * before.sizes["y"]
    # taken out of the padded, cropped cube again
    sweeps.write(text)
    assert sweeps.run() == []
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


def test_cropped_fields_of_an_edited_study_are_cut_to_the_contacts_that_are_left(sweeps: Sweeps) -> None:
    """Taken from the cube, they kept the box that held the contacts of the cases that had gone as well."""
    loads = f"{SWEPT}outputs: {{crop: contact}}\n".replace("axes: {radius: [30, 40]}", "axes: {load: [2, 60]}")
    sweeps.write(loads)
    sweeps.run()
    before = grid_of(sweeps.output, "bare")
    sweeps.write(loads.replace("[2, 60]", "[2, 3]"))
    assert len(sweeps.run()) == 1
    assert grid_of(sweeps.output, "bare").sizes["x"] < before.sizes["x"]
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


def grid_of(path: Path, name: str):
    with open_cube(path) as tree:
        return grids(tree)[name].load()


def test_cases_that_are_the_same_are_solved_once(sweeps: Sweeps) -> None:
    sweeps.write(
        SWEPT.replace("axes: {radius: [30, 40]}", "axes: {radius: [30, 40]}\n  again:\n    axes: {radius: [40, 30]}")
    )
    told = Told()
    found = sweeps.run(progress=told)
    assert len(found) == CASES
    assert sweeps.done.cases == CASES + 2
    assert told.told == [CASES + 2, *[False] * (CASES + 2), "end"]
    with open_cube(sweeps.output) as tree:
        both = grids(tree)
        np.testing.assert_array_equal(both["bare"].pressure, both["again"].pressure[::-1])


def test_starting_over(sweeps: Sweeps) -> None:
    sweeps.run()
    assert len(sweeps.run(fresh=True)) == CASES
    sweeps.run(4, fresh=True)
    assert sweeps.interrupt.solved == 4
    # the old cube does not count until the new one is there
    assert len(sweeps.run(3)) == 3
    assert len(sweeps.run()) == CASES - 7
    assert sweeps.run() == []
    sweeps.run(4, fresh=True)
    assert len(sweeps.run(fresh=True)) == CASES


def test_a_broken_off_fresh_start_leaves_the_cube_to_its_study(sweeps: Sweeps) -> None:
    """The sweep of any other study then replaced it, without --fresh."""
    sweeps.run()
    sweeps.run(0, fresh=True)
    before, own = sweeps.output.read_bytes(), sweeps.study.text
    sweeps.write(f"{SWEPT.replace('study: ', 'study: other-')}    # as new\n".replace("E: 210000", "E: 200000"))
    assert "the cube is of another study" in report(sweeps.study, sweeps.output)
    with pytest.raises(UserError, match="is the cube of another study"):
        sweeps.run()
    assert sweeps.output.read_bytes() == before
    sweeps.write(own)
    assert len(sweeps.run()) == CASES


def be_the_next_version(patched: pytest.MonkeyPatch) -> None:
    """Keys of cases and units are those of a solver of version `next`."""
    for module in ("cases", "storage.units"):
        patched.setattr(f"rcstudy.{module}.SOLVER_VERSION", "next")


def test_another_solver_version_solves_all_again(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    sweeps.run(5)
    be_the_next_version(monkeypatch)
    assert len(sweeps.run()) == CASES
    assert f"of solver version {SOLVER_VERSION}, this is next; set aside" in sweeps.told[0]


def test_a_shard_leaves_units_of_another_solver_version(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    """It set them aside, though the shard that wrote them with that version might go on to merge them."""
    mine = len(sweeps.run(shard=(1, 2)))
    (path,) = unit_paths(sweeps.units)
    with monkeypatch.context() as patched:
        be_the_next_version(patched)
        assert len(sweeps.run(shard=(2, 2))) == CASES - mine
        assert f"{path}: of solver version {SOLVER_VERSION}, this is next; left where it is" in sweeps.told[0]
    assert path in unit_paths(sweeps.units)
    assert len(sweeps.run()) == CASES - mine
    assert "of solver version next, this is" in sweeps.told[0]
    assert not unit_paths(sweeps.units)


@pytest.mark.parametrize("seconds", [(0.1,), store.UNIT_SECONDS, (0.1, 0.1, 1e9), (0.1, 1e9)])
def test_what_is_solved_reaches_the_disk_in_time(
    sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch, seconds: tuple[float, ...]
) -> None:
    """Also while one case takes long: by a thread of its own, the first results sooner than others."""
    monkeypatch.setattr(store, "UNIT_SECONDS", seconds)
    seen = []

    def slow(scenes: Sequence[Scene]) -> Iterator[Result]:
        for scene in scenes:
            if scene.load == 60.0 and not seen:
                begun = time.monotonic()  # what was solved before has its own time
                deadline = begun + 20.0
                while not unit_paths(sweeps.units) and time.monotonic() < deadline:
                    time.sleep(0.01)
                seen.append(sum(len(read_unit(path)[0].entries) for path in unit_paths(sweeps.units)))
                assert time.monotonic() - begun < 4.0
            yield synthetic.made_up_result(scene)

    sweep.run(sweeps.study, sweeps.output, workers=1, solve=slow)
    assert seen[0] > 0


def test_small_units_are_put_together(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three of a kind into one: 14 cases, one by one, end as 9 + 3 + 1 + 1."""
    monkeypatch.setattr(store, "_PUT_TOGETHER", 3)
    cases = expand(sweeps.study).cases
    keep = sweep.keep_of(sweeps.study.outputs)
    packer = sweep.Packer(keep)

    def sizes() -> list[int]:
        return [len(read_unit(path)[0].entries) for path in unit_paths(sweeps.units)]

    with store.opened(sweeps.output, "s", cases, keep, tell=sweeps.told.append) as opened:
        for k, case in enumerate(cases):
            if k == 5:
                assert sizes() == [3, 1, 1]
            opened.add(case.key, packer.pack(synthetic.made_up_result(case.scene), case.scene.mesh.cells))
            opened.flush()
    assert sizes() == [9, 3, 1, 1]
    assert sweeps.run() == []
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


# damage


def one_unit(sweeps: Sweeps) -> Path:
    sweeps.run(9)
    (path,) = unit_paths(sweeps.units)
    return path


def test_a_unit_that_is_listed_but_not_there_hides_no_others(sweeps: Sweeps) -> None:
    """A link to nothing: the status is that without it, and a sweep keeps what is there."""
    path = one_unit(sweeps)
    before = report(sweeps.study, sweeps.output)
    path.with_name("000000-000000000000.unit").symlink_to("nowhere")
    assert report(sweeps.study, sweeps.output) == before
    assert len(sweeps.run()) == CASES - 9


@pytest.mark.parametrize("damage", ["truncated", "emptied", "flipped", "foreign", "renamed cube", "longer"])
def test_a_damaged_unit_is_set_aside(sweeps: Sweeps, damage: str) -> None:
    path = one_unit(sweeps)
    data = bytearray(path.read_bytes())
    if damage == "truncated":
        del data[len(data) // 2 :]
    elif damage == "emptied":
        data.clear()
    elif damage == "flipped":
        data[len(data) // 3] ^= 16
    elif damage == "longer":
        data += b"\0"
    else:
        data = bytearray(b"\x89HDF\r\n" if damage == "renamed cube" else os.urandom(300))
    path.write_bytes(data)
    assert "a sweep will set it aside" in report(sweeps.study, sweeps.output)
    assert len(sweeps.run()) == CASES
    assert str(path) in sweeps.told[0]
    assert "set aside" in sweeps.told[0]
    assert [entry.name for entry in sweeps.units.iterdir()] == [f"{path.name}.set-aside"]
    assert path.with_name(f"{path.name}.set-aside").read_bytes() == bytes(data)
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())
    assert sweeps.run() == []
    assert f"\n{progress.in_bytes(len(data))} in 1 unit set aside, which sweep --fresh removes\n" in report(
        sweeps.study, sweeps.output
    )
    assert len(sweeps.run(fresh=True)) == CASES
    assert not sweeps.units.exists()
    assert "set aside" not in report(sweeps.study, sweeps.output)


def test_a_folder_called_like_a_unit_is_left_alone(sweeps: Sweeps) -> None:
    """The cube, it was said, could not be written: is a directory."""
    sweeps.run(5)
    inside = sweeps.units / "000000-aaaaaaaaaaaa.unit" / "inside"
    inside.parent.mkdir()
    inside.touch()
    assert "total        14         5         0         9" in report(sweeps.study, sweeps.output)
    assert len(sweeps.run()) == CASES - 5
    assert inside.exists()
    assert sweeps.run() == []
    assert len(sweeps.run(fresh=True)) == CASES


def test_every_flipped_bit_is_found(sweeps: Sweeps) -> None:
    path = one_unit(sweeps)
    data = path.read_bytes()
    rng = np.random.default_rng(11)
    for at in rng.integers(0, len(data), 200):
        bad = bytearray(data)
        bad[at] ^= 1 << int(rng.integers(0, 8))
        path.write_bytes(bad)
        with pytest.raises(index.BadUnit):
            read_unit(path)


def test_a_unit_that_is_whole_and_improper(sweeps: Sweeps) -> None:
    """Someone else made it, with a right checksum: cells of another mesh, bytes that are no record."""
    sweeps.run(3)
    key = expand(sweeps.study).cases[5].key
    other = synthetic.made_up_result(synthetic.SCENE)
    wrong_mesh = sweep.Packer(sweep.keep_of(sweeps.study.outputs)).pack(other, synthetic.MESH.cells).body
    for number, body in ((5, wrong_mesh), (6, b"\x05\0\0\0[[[[["), (7, b"")):
        write_unit(sweeps.units, number, [(key, body)], "swept")
    assert len(sweeps.run()) == CASES - 3
    assert sum("set aside" in text for text in sweeps.told) == 3
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


def test_a_damaged_cube_is_no_source(sweeps: Sweeps) -> None:
    """A flipped bit anywhere in it: found where it matters, and never taken over."""
    sweeps.run()
    whole = sweeps.output.read_bytes()
    sweeps.write(SWEPT.replace("80]", "80, 90]"))
    good = sweeps.uninterrupted()
    rng = np.random.default_rng(3)
    solved = []
    for at in rng.integers(0, len(whole), 8):
        bad = bytearray(whole)
        bad[at] ^= 1 << int(rng.integers(0, 8))
        sweeps.output.write_bytes(bad)
        solved.append(len(sweeps.run()))
        cubes.assert_same(sweeps.output, good)
    assert min(solved) == 3
    assert max(solved) > 3


def test_cases_of_a_cube_are_looked_into_once(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    """When they are checked; then they are copied. Looking twice made taking them cost nearly as much as solving."""
    sweeps.run()
    sweeps.write(SWEPT.replace("80]", "80, 90]"))
    streams: list[bytes] = []
    decompress = record.decompress
    monkeypatch.setattr(record, "decompress", lambda stream, size: streams.append(stream) or decompress(stream, size))
    assert len(sweeps.run()) == 3
    assert len(streams) == 12 * 6 + 2  # fields of rolling contacts, and pressures of the others
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


def test_a_long_look_at_a_cube_is_told(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing was shown meanwhile; nor is it if progress is not wanted."""
    sweeps.run()
    monkeypatch.setattr(progress, "LATE_SECONDS", 0.0)
    check = index.Index.check_cube
    monkeypatch.setattr(index.Index, "check_cube", lambda self: (time.sleep(0.2), check(self))[1])
    text = f"reading {CASES} cases in {sweeps.output} that are solved already"
    for quiet in (True, False):
        sweeps.write(SWEPT + f"# edited {quiet}\n")
        sweeps.run(progress=progress.Silent() if quiet else progress.Lines(io.StringIO()))
        assert (text in sweeps.told) is not quiet


@pytest.mark.parametrize(("quiet", "late", "told"), [(False, 0.0, True), (False, 60.0, False), (True, 0.0, False)])
def test_a_first_case_that_takes_long_is_told(
    sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch, quiet: bool, late: float, told: bool
) -> None:
    """Kernels are compiled for up to a minute on a new machine, and nothing was shown meanwhile."""
    monkeypatch.setattr(progress, "LATE_SECONDS", late)
    said: list[str] = []

    def slow(scenes: Sequence[Scene]) -> Iterator[Result]:
        time.sleep(0.2)
        yield from map(synthetic.made_up_result, scenes)

    shown = progress.Silent() if quiet else progress.Lines(io.StringIO())
    sweep.run(sweeps.study, sweeps.output, workers=1, solve=slow, tell=said.append, progress=shown)
    assert sum(line.startswith("no case is solved yet") for line in said) == told


def test_a_scheduler_that_is_waited_for_is_told(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels were said to be compiled while no scheduler answered."""
    monkeypatch.setattr(progress, "LATE_SECONDS", 0.0)
    monkeypatch.setattr(cluster, "check", lambda scheduler: scheduler.address)

    def unreachable(*args: object, **options: object) -> Iterator[object]:
        time.sleep(0.2)
        raise UserError("no scheduler")
        yield

    monkeypatch.setattr(cluster, "solve_on_cluster", unreachable)
    said: list[str] = []
    options = {"scheduler": cluster.Scheduler("tcp://127.0.0.1:1"), "progress": progress.Lines(io.StringIO())}
    with pytest.raises(UserError, match="no scheduler"):
        sweep.run(sweeps.study, sweeps.output, tell=said.append, **options)
    (line,) = (line for line in said if line.startswith("no case is solved yet"))
    assert line.startswith("no case is solved yet: waiting for the scheduler and its workers")


@pytest.mark.parametrize(
    ("gone", "solved", "edited"),
    [
        ("loads/slip_x", 12, False),
        ("loads/slip_x", 12, True),
        ("loads/state", 12, False),
        ("bare/pressure", 2, False),
        ("bare/pressure", 2, True),
        ("loads/x", 12, False),
        ("loads/creepage", 0, False),
        ("loads/longitudinal", 0, True),
        ("bare/label", 0, False),
        ("grid", 0, True),
    ],
)
def test_what_a_cube_has_lost_is_made_again(sweeps: Sweeps, gone: str, solved: int, edited: bool) -> None:
    """Also when the study is as it was; solved again is what is lost for each case, but no other."""
    sweeps.run()
    with h5py.File(sweeps.output, "r+") as file:
        del file[gone]
    if edited:
        sweeps.write(SWEPT + "# edited\n")
    assert len(sweeps.run()) == solved
    # without its pressure a case is not taken at all
    assert edited or gone == "bare/pressure" or f"{gone} missing in the cube, which is rebuilt" in sweeps.told[0]
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())
    assert sweeps.run() == []


@pytest.mark.parametrize(("name", "solved"), [("force_y", 12), ("approach_error", CASES)])
@pytest.mark.parametrize("edited", [False, True])
def test_cases_of_a_cube_older_than_a_scalar_are_solved_again(
    sweeps: Sweeps, name: str, solved: int, edited: bool
) -> None:
    """They were taken over as solved, without a number; two cases have no tractions, and no forces either."""
    sweeps.run()
    with h5py.File(sweeps.output, "r+") as file:
        for group in (file["loads"], file["bare"]):
            group.pop(name, None)
            names = ("case_key", "status_reason", "status", *(n for n in record.SCALARS if n in group))
            texts = {n: np.asarray(group[n].asstr()[...], dtype=object).reshape(-1) for n in names[:2]}
            group.attrs["numbers_sha256"] = checksum({**texts, **{n: group[n][...].reshape(-1) for n in names[2:]}})
    if edited:
        sweeps.write(SWEPT + "# edited\n")
    told = f"{sweeps.output}: {solved} solved cases in it cannot be taken: they have no {name}"
    assert told in report(sweeps.study, sweeps.output).splitlines()
    assert len(sweeps.run()) == solved
    assert told in sweeps.told
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


def test_units_older_than_a_scalar_are_solved_again(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    older = tuple("of_yesterday" if name == "force_y" else name for name in record.SCALARS)
    with monkeypatch.context() as yesterday:
        yesterday.setattr(units, "FORM", record.Form(older))
        sweeps.run(most=13)
    assert len(sweeps.run()) == CASES - 1
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


@pytest.mark.parametrize("chunk", [1, 2])
def test_fields_that_are_stored_otherwise_are_no_source(sweeps: Sweeps, chunk: int) -> None:
    """Their bytes would be taken for those of a case: with two cases in a chunk, or sorted before compression."""
    sweeps.run()
    with h5py.File(sweeps.output, "r+") as file:
        values, chunks = file["bare/pressure"][...], file["bare/pressure"].chunks
        del file["bare/pressure"]
        chunks, filters = (chunk, *chunks[1:]), {"compression": "gzip", "shuffle": chunk == 1}
        file["bare"].create_dataset("pressure", data=values, chunks=chunks, **filters)
    assert len(sweeps.run()) == CASES
    assert any("its fields are not stored as this version stores them" in text for text in sweeps.told)
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


def test_fields_in_other_places_are_no_source(sweeps: Sweeps) -> None:
    """The coordinates in the cube are not those of the mesh."""
    sweeps.run()
    with h5py.File(sweeps.output, "r+") as file:
        file["bare/x"][...] *= 1.5
        cases = file["bare/status"].size
    sweeps.write(SWEPT + "# edited\n")
    assert len(sweeps.run()) == cases
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


def test_an_earlier_cube_without_checksums(sweeps: Sweeps) -> None:
    sweeps.run()
    with h5py.File(sweeps.output, "r+") as file:
        del file["bare"].attrs["numbers_sha256"]
    sweeps.write(SWEPT + "# edited\n")
    assert len(sweeps.run()) == CASES
    reason = "the checksum of its numbers does not match"
    assert sweeps.told == [f"{sweeps.output}: no cases are taken from it: {reason}{REPLACED}"]


@pytest.mark.parametrize(("name", "value"), [("solver_version", "25"), ("rcstudy_schema", 99)])
def test_a_cube_of_another_version_is_replaced_with_a_warning(sweeps: Sweeps, name: str, value: object) -> None:
    """That its results would be gone was not told, nor how to keep them."""
    sweeps.run()
    with h5py.File(sweeps.output, "r+") as file:
        file.attrs[name] = value
    warning = f"{sweeps.output}: no cases are taken from it: it is no cube of this version and its solver{REPLACED}"
    assert warning in report(sweeps.study, sweeps.output).splitlines()
    assert len(sweeps.run()) == CASES
    assert sweeps.told == [warning]
    # that of another study is not replaced
    with h5py.File(sweeps.output, "r+") as file:
        file.attrs[name] = value
    sweeps.write(SWEPT.replace("study: ", "study: other-"))
    with pytest.raises(
        UserError, match=r"is the cube of another study, .* or remove it \(rcstudy sweep --fresh replaces it\)$"
    ):
        sweeps.run()
    assert sweeps.told == [warning.removesuffix(REPLACED)]


# locks


def test_the_second_sweep_is_refused(sweeps: Sweeps) -> None:
    refused = []

    def solve(scenes: Sequence[Scene]) -> Iterator[Result]:
        if not refused:
            with pytest.raises(UserError) as error:
                sweep.run(sweeps.study, sweeps.output, workers=1, solve=workers.made_up)
            refused.append(str(error.value))
            assert f"at work: process {os.getpid()} on {socket.gethostname()}" in report(sweeps.study, sweeps.output)
            with pytest.raises(UserError, match="at work on this output"):
                merge(sweeps.study, sweeps.output)
        yield from workers.made_up(scenes)

    done = sweep.run(sweeps.study, sweeps.output, workers=1, solve=solve)
    assert done.solved == CASES
    words = f"process {os.getpid()} on {socket.gethostname()} is at work on this output: wait until it has finished"
    assert words in refused[0]
    assert "no sweep is at work" in report(sweeps.study, sweeps.output)


def leave_lock(folder: Path, **changes: object) -> None:
    """A lock file as a process leaves it that dies; by default this one."""
    folder.mkdir(exist_ok=True)
    here = lock.Owner.here()
    record = {"host": here.host, "boot": here.boot, "pid": here.pid, "started": here.started, **changes}
    (folder / "lock").write_text(json.dumps(record))


@pytest.mark.parametrize(
    "changes",
    [{}, {"pid": 1, "started": 1}, {"pid": 2**22 + 1}, {"boot": "before the machine was restarted"}],
)
def test_a_dead_lock_is_recognised(sweeps: Sweeps, changes: dict[str, object]) -> None:
    """The kernel has freed it: its owner is dead, whoever has its number now."""
    leave_lock(sweeps.units, **changes)
    assert len(sweeps.run()) == CASES
    assert not sweeps.units.exists()


@pytest.mark.parametrize("content", [b"", b"{", b"[1]", b'{"host": 1}', b"\xff" * 50])
def test_a_lock_that_was_not_finished(sweeps: Sweeps, content: bytes) -> None:
    sweeps.units.mkdir()
    (sweeps.units / "lock").write_bytes(content)
    assert len(sweeps.run()) == CASES


def test_a_lock_of_another_machine_needs_a_word(sweeps: Sweeps) -> None:
    leave_lock(sweeps.units, host="elsewhere", boot="another")
    with pytest.raises(UserError, match=f"process {os.getpid()} on elsewhere is at work.*\n.*--unlock"):
        sweeps.run()
    assert len(sweeps.run(take_over=True)) == CASES
    assert not sweeps.units.exists()


def test_a_merge_needs_a_word_for_a_lock_of_another_machine_too(sweeps: Sweeps) -> None:
    sweeps.run()
    leave_lock(sweeps.units, host="elsewhere", boot="another")
    with pytest.raises(UserError, match=f"process {os.getpid()} on elsewhere is at work"):
        merge(sweeps.study, sweeps.output)
    assert merge(sweeps.study, sweeps.output, take_over=True).solved == CASES


def test_without_locks_of_the_file_system(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    """Number and start of the owner decide: of this process, of one with the same number that started later."""

    def unsupported(descriptor: int, kind: int) -> None:
        raise OSError(38, "Function not implemented")

    monkeypatch.setattr(lock.fcntl, "flock", unsupported)
    leave_lock(sweeps.units)
    with pytest.raises(UserError, match="is at work on this output"):
        sweeps.run()
    leave_lock(sweeps.units, started=7)
    assert len(sweeps.run()) == CASES


@pytest.mark.parametrize("has_flock", [True, False])
def test_a_lock_of_another_container(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch, has_flock: bool) -> None:
    """Of one kernel, with processes that cannot be looked up here: this one's number may be anyone's there, or free."""

    def unsupported(descriptor: int, kind: int) -> None:
        raise OSError(38, "Function not implemented")

    if not has_flock:
        monkeypatch.setattr(lock.fcntl, "flock", unsupported)
    leave_lock(sweeps.units, space="1", pid=2**22 + 1)
    with held(sweeps.units / "lock") if has_flock else contextlib.nullcontext():
        assert lock.holders(sweeps.units) == [f"process {2**22 + 1} on {socket.gethostname()}"]
    if not has_flock:
        with pytest.raises(UserError, match=f"process {2**22 + 1} on .* is at work.*\n.*--unlock"):
            sweeps.run()
    assert len(sweeps.run(take_over=not has_flock)) == CASES
    assert not sweeps.units.exists()


@contextlib.contextmanager
def held(path: Path, kind: int = fcntl.LOCK_EX) -> Iterator[None]:
    """Hold the kernel's lock of a file, as another process would."""
    with path.open("rb") as file:
        fcntl.flock(file, kind)
        yield


@pytest.mark.parametrize("name", ["lock", "lock-2-of-3"])
@pytest.mark.parametrize("boot", ["this", "that before a restart"])
def test_who_was_killed_in_another_container_is_not_at_work(sweeps: Sweeps, name: str, boot: str) -> None:
    """It was at work for ever: it cannot be looked up here, but the kernel has freed its lock."""
    leave_lock(sweeps.units, space="1", pid=1, **({} if boot == "this" else {"boot": boot}))
    (sweeps.units / "lock").rename(sweeps.units / name)
    with held(sweeps.units / name):
        assert f"at work: process 1 on {socket.gethostname()}" in report(sweeps.study, sweeps.output)
    before = (sweeps.units / name).stat()
    assert report(sweeps.study, sweeps.output).endswith("no sweep is at work")
    after = (sweeps.units / name).stat()
    assert (after.st_ino, after.st_mtime_ns, after.st_size) == (before.st_ino, before.st_mtime_ns, before.st_size)


def test_a_look_at_a_lock_refuses_no_sweep(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    """`status` holds it for an instant, and a sweep that starts then tries again."""
    leave_lock(sweeps.units)
    look, waited = contextlib.ExitStack(), []

    def sleep(seconds: float) -> None:
        waited.append(seconds)
        if len(waited) == 2:
            look.close()

    monkeypatch.setattr(lock, "time", SimpleNamespace(sleep=sleep))
    look.enter_context(held(sweeps.units / "lock", fcntl.LOCK_SH))
    assert len(sweeps.run()) == CASES
    assert len(waited) == 2


def test_file_systems_of_one_machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file of the kernel's own is on none that is known as one."""
    with Path("/proc/self/status").open("rb") as file:
        assert not lock._is_on_one_machine(file.fileno())
        monkeypatch.setattr(lock, "_ONE_MACHINE", ("proc",))
        assert lock._is_on_one_machine(file.fileno())
        (tmp_path / "file").touch()
        with (tmp_path / "file").open("rb") as other:
            assert not lock._is_on_one_machine(other.fileno())
    assert not lock._is_on_one_machine(2**20)


LEFTOVERS = {
    "elsewhere": "c.nc.tmp-elsewhere-4026531836-7-1f",
    "another container": f"c.nc.tmp-{socket.gethostname()}-1-7-1f",
    "number in use": f"c.nc.tmp-{publish.host()}-{os.getppid()}-1f",
}
NO_LEFTOVERS = ("d.nc.tmp-elsewhere-4026531836-7-1f", "c.nc.tmp-mine", "c.nc.tmp", "figure.pdf.tmp-elsewhere-1-7-1f")


@pytest.fixture
def killed(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> Sweeps:
    """Sweeps of a cube, of which others were killed while they wrote it, on a file system of one machine."""
    monkeypatch.setattr(lock, "_is_on_one_machine", lambda descriptor: True)
    for name in (*LEFTOVERS.values(), *NO_LEFTOVERS):
        (sweeps.folder / name).write_bytes(b"1234567")
    return sweeps


def left(sweeps: Sweeps) -> set[str]:
    """Names of the files beside the cube that might be taken for leftovers."""
    return {path.name for path in sweeps.folder.iterdir() if ".tmp" in path.name}


def test_unfinished_cubes_of_the_killed_are_gone_when_a_sweep_starts(killed: Sweeps) -> None:
    """Whoever wrote them, and before there are results. Those of other containers stayed for ever."""
    assert killed.run(0) == []
    assert left(killed) == set(NO_LEFTOVERS)


def test_locks_of_killed_shards_do_not_keep_the_folder(killed: Sweeps) -> None:
    killed.units.mkdir()
    (killed.units / "lock-1-of-8").write_text("{}")
    killed.run()
    assert not killed.units.exists()


def test_a_merge_removes_unfinished_cubes_of_the_killed(killed: Sweeps) -> None:
    with pytest.raises(UserError, match="cases are missing"):
        merge(killed.study, killed.output)
    assert left(killed) == set(NO_LEFTOVERS)


def test_unfinished_cubes_by_way_of_a_link(killed: Sweeps) -> None:
    link = killed.folder / "links" / "l.nc"
    link.parent.mkdir()
    link.symlink_to(killed.output)
    killed.output = link
    assert killed.run(0) == []
    assert left(killed) == set(NO_LEFTOVERS)


@pytest.mark.parametrize("why", ["a shard", "locks may not reach others", "there are no locks"])
def test_unfinished_cubes_stay_where_their_writers_may_live(
    killed: Sweeps, monkeypatch: pytest.MonkeyPatch, why: str
) -> None:
    def unsupported(descriptor: int, kind: int) -> None:
        raise OSError(38, "Function not implemented")

    if why == "locks may not reach others":
        monkeypatch.setattr(lock, "_is_on_one_machine", lambda descriptor: False)
    if why == "there are no locks":
        monkeypatch.setattr(lock.fcntl, "flock", unsupported)
    killed.run(shard=(1, 2) if why == "a shard" else None)
    assert left(killed) == {*LEFTOVERS.values(), *NO_LEFTOVERS}


def test_an_unfinished_cube_that_cannot_be_removed(killed: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    """As somebody else's in a folder where each may remove their own: the sweep goes on."""
    unlink = Path.unlink

    def refused(path: Path, missing_ok: bool = False) -> None:
        if path.name in LEFTOVERS.values():
            raise PermissionError
        unlink(path, missing_ok=missing_ok)

    monkeypatch.setattr(Path, "unlink", refused)
    assert len(killed.run()) == CASES
    assert left(killed) == {*LEFTOVERS.values(), *NO_LEFTOVERS}


def test_status_lists_what_the_killed_have_left(killed: Sweeps) -> None:
    killed.units.mkdir()
    unit = killed.units / "000009-0123456789ab.unit.tmp-elsewhere-1-7-1f"
    unit.write_bytes(b"12345")
    paths = [*sorted(killed.folder / name for name in LEFTOVERS.values()), unit]
    lines = report(killed.study, killed.output).splitlines()
    assert lines[-5] == "no sweep is at work"
    assert lines[-4:] == [f"{path.stat().st_size} B left over by a sweep that was killed: {path}" for path in paths]
    with lock.locked(killed.units, (1, 3)):
        assert "left over" not in report(killed.study, killed.output)


def test_status_lists_no_file_that_a_sweep_has_just_finished(killed: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    def ends(folder: Path) -> list[str]:
        for name in LEFTOVERS.values():
            (killed.folder / name).unlink()
        return []

    monkeypatch.setattr(status, "holders", ends)
    assert "left over" not in report(killed.study, killed.output)


def test_shards_work_side_by_side_and_keep_others_out(sweeps: Sweeps) -> None:
    with lock.locked(sweeps.units, (1, 3)), lock.locked(sweeps.units, (2, 3)):
        for shard in ((1, 3), None):
            with pytest.raises(UserError, match=r"process \d+ on .* \(shard 1 of 3\)"):
                sweeps.run(shard=shard)
        assert len(sweeps.run(shard=(3, 3))) > 0
    assert unit_paths(sweeps.units)
    with lock.locked(sweeps.units), pytest.raises(UserError, match="at work"):
        sweeps.run(shard=(3, 3))


# shards


@pytest.mark.parametrize("n", [1, 2, 3, 8])
def test_shards_and_their_merge(sweeps: Sweeps, n: int) -> None:
    solved = []
    for i in range(1, n + 1):
        solved.append(len(sweeps.run(shard=(i, n))))
        assert sweeps.done.cases == solved[-1]
        assert sweeps.run(shard=(i, n)) == []
        assert not sweeps.output.exists()
    assert sum(solved) == CASES
    done = merge(sweeps.study, sweeps.output)
    assert (done.cases, done.solved) == (CASES, CASES)
    assert not sweeps.units.exists()
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


def test_a_merge_names_five_cases_that_are_missing(sweeps: Sweeps) -> None:
    """And says how many there are besides."""
    missing, met = CASES, []
    for i in range(1, 6):
        missing -= len(sweeps.run(shard=(i, 7)))
        met.append(missing)
        with pytest.raises(UserError, match=f"{missing} of {CASES} cases are missing") as refused:
            merge(sweeps.study, sweeps.output)
        _, *names = str(refused.value).splitlines()
        assert len(names[:5]) == min(missing, 5)
        assert names[5:] == ([f"  and {missing - 5} more"] if missing > 5 else [])
    assert max(met) > 5
    assert 5 in met


def test_shards_in_folders_of_their_own(sweeps: Sweeps, tmp_path: Path) -> None:
    for i in (1, 2):
        sweep.run(sweeps.study, tmp_path / f"{i}.nc", workers=1, solve=workers.made_up, shard=(i, 2))
    with pytest.raises(
        UserError, match=r"c.nc: \d of 14 cases are missing; rcstudy sweep solves them:\n  loads: load="
    ):
        merge(sweeps.study, sweeps.output, [tmp_path / "1.nc.units"])
    assert not sweeps.output.exists()
    merge(sweeps.study, sweeps.output, [tmp_path / "1.nc", tmp_path / "2.nc.units"])
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())
    assert unit_paths(tmp_path / "1.nc.units")  # others' units are not removed


def spoil(field: h5py.Dataset, place: tuple[int, ...]) -> None:
    """Change the bytes of a case's field."""
    _, stream = field.id.read_direct_chunk(place)
    field.id.write_direct_chunk(place, stream[:-1] + bytes([stream[-1] ^ 1]))


def test_a_shard_without_other_work_solves_what_is_damaged_in_the_cube(sweeps: Sweeps) -> None:
    """It said that all its cases were solved, a merge that one was missing, however often both were run."""
    sweeps.run()
    sweeps.write(SWEPT.replace("80]", "80, 90]"))
    with h5py.File(sweeps.output, "r+") as file:
        spoil(file["bare/pressure"], (0, 0, 0))
    assert sum(len(sweeps.run(shard=(i, 7))) for i in range(1, 8)) == 4
    merge(sweeps.study, sweeps.output)
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


def test_a_merge_takes_from_units_what_is_damaged_in_the_cube(sweeps: Sweeps, tmp_path: Path) -> None:
    """It was refused, and the unit was said to be damaged."""
    sweeps.run()
    sweep.run(sweeps.study, tmp_path / "part.nc", workers=1, solve=workers.made_up, shard=(1, 1))
    with h5py.File(sweeps.output, "r+") as file:
        spoil(file["bare/pressure"], (0, 0, 0))
    told: list[str] = []
    merge(sweeps.study, sweeps.output, [tmp_path / "part.nc"], tell=told.append)
    assert told == [f"{sweeps.output}: 1 case not taken from it: damaged"]
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


@pytest.mark.parametrize("outputs", ["{}", "{crop: contact}"])
def test_a_merge_with_a_damaged_failure_in_the_cube(sweeps: Sweeps, outputs: str) -> None:
    """With crop: contact it ended with a traceback, as failures are not taken by sweeps and were not looked at."""
    sweeps.write(f"{SWEPT}outputs: {outputs}\n")
    sweeps.run(fails=(40.0,))
    with h5py.File(sweeps.output, "r+") as file:
        spoil(file["loads/slip_x"], (1, 0, 0, 0))
    with pytest.raises(UserError, match=r"1 of 14 cases are missing.*\n  loads: load=40, creepage=a$"):
        merge(sweeps.study, sweeps.output)


@pytest.mark.parametrize("outputs", ["{}", "{crop: contact}"])
@pytest.mark.parametrize("fails", [(), (40.0,)])
def test_units_that_are_taken_away(
    sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch, outputs: str, fails: tuple[float, ...]
) -> None:
    """Of cropped fields, and of cases that failed, an error of the system was raised, without what is kept."""
    sweeps.write(f"{SWEPT}outputs: {outputs}\n")
    flush = store.Store.flush
    gone: list[Path] = []
    lost: list[str] = []

    def flush_and_lose(self: store.Store) -> None:
        flush(self)
        if not gone:
            gone.append(unit_paths(self.folder)[0])
            lost.extend(key for key, _, _ in read_unit(gone[0])[0].entries)
            gone[0].unlink()

    monkeypatch.setattr(assemble.Assembly, "go_on", lambda self: None)
    monkeypatch.setattr(store, "UNIT_CASES", 5)
    monkeypatch.setattr(store.Store, "flush", flush_and_lose)
    with pytest.raises(UserError, match=r"\d of 14 cases are kept; rerun") as error:
        sweeps.run(fails=fails)
    assert f"can no longer be read: {gone[0]}: No such file or directory" in str(error.value)
    assert fails or f"{CASES - len(lost)} of 14 cases are kept" in str(error.value)
    monkeypatch.undo()
    sweeps.run()
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


def test_equal_cases_are_in_one_shard(sweeps: Sweeps, tmp_path: Path) -> None:
    """Two shards solved them, in series from different starts, and what they gave was not merged."""
    axis = "{axes: {creepage.longitudinal: {first: 0.0005, last: 0.002, count: 11}}}"
    sweeps.write(f"{SWEPT.partition('  loads')[0]}  first: {axis}\n  again: {axis}\n")
    solved = []
    for i in (1, 2):
        solver = Solver()
        done = sweep.run(sweeps.study, tmp_path / f"{i}.nc", workers=1, solve=solver, shard=(i, 2))
        assert done.cases == 2 * len(solver.solved)
        solved += solver.solved
    assert len(solved) == len(set(solved)) == 11
    assert merge(sweeps.study, sweeps.output, [tmp_path / f"{i}.nc" for i in (1, 2)]).cases == 22


def test_units_of_another_study_are_not_removed(sweeps: Sweeps) -> None:
    """They were, without a word, by any sweep at the same output; a study that was edited tells what goes with it."""
    sweeps.run(5)
    mine, kept = sweeps.study, [path.read_bytes() for path in unit_paths(sweeps.units)]
    sweeps.write(SWEPT.replace("study: ", "study: other-").replace("E: 210000", "E: 200000"))
    for shard in (None, (1, 2)):
        with pytest.raises(UserError, match=r"results of another study, .* \(rcstudy sweep --fresh deletes them\)$"):
            sweeps.run(shard=shard)
        assert [path.read_bytes() for path in unit_paths(sweeps.units)] == kept
    sweeps.write(SWEPT.replace("E: 210000", "E: 200000"))
    assert len(sweeps.run()) == CASES
    assert any("the new cube will not contain 5 solved cases" in text for text in sweeps.told)
    assert sweep.run(mine, sweeps.output, workers=1, solve=workers.made_up).kept == 0


def test_units_of_another_study_serve_with_the_cases_that_it_shares(sweeps: Sweeps) -> None:
    sweeps.run(5)
    sweeps.write(SWEPT.replace("study: ", "study: other-").replace("[20, ", "[30, "))
    assert len(sweeps.run()) == CASES - 2


def test_only_cases_of_the_study_are_said_to_lack_fields(sweeps: Sweeps) -> None:
    """Of the cube of another study it was said how many of its cases cannot be taken, before it was refused."""
    sweeps.write(f"{SWEPT}outputs: {NONE}\n")
    sweeps.run()
    sweeps.write(SWEPT.replace("study: ", "study: other-").replace("E: 210000", "E: 200000"))
    with pytest.raises(UserError, match="is the cube of another study"):
        sweeps.run()
    sweeps.write(SWEPT.replace("E: 210000", "E: 200000"))
    sweeps.run()
    assert not any("cannot be taken" in text for text in sweeps.told)


def test_a_single_case_that_goes_is_one_case(sweeps: Sweeps) -> None:
    sweeps.run(1)
    sweeps.write(SWEPT.replace("E: 210000", "E: 200000"))
    sweeps.run()
    assert any("will not contain 1 solved case that the study no longer has" in text for text in sweeps.told)


def test_only_solved_cases_that_go_are_counted(sweeps: Sweeps) -> None:
    sweeps.run(fails=(20.0,))
    sweeps.write(SWEPT.replace("E: 210000", "E: 200000"))
    sweeps.run()
    assert any(f"will not contain {CASES - 3} solved cases that" in text for text in sweeps.told)


DIGITS, CELLS = "fields in float64 (precision: float32)", "cells outside the contacts (crop: contact)"


@pytest.mark.parametrize(
    ("before", "after", "lost"),
    [
        (ALL, SINGLE, DIGITS),
        (ALL, CROP, CELLS),
        (ALL, BOTH, f"{DIGITS} and {CELLS}"),
        (SINGLE, BOTH, CELLS),
        (CROP, BOTH, DIGITS),
        (ALL, NONE, "all fields"),
        (CROP, ALL, ""),
        (BOTH, SINGLE, ""),
        (NONE, NONE, ""),
    ],
)
def test_outputs_that_hold_less_tell_what_goes(sweeps: Sweeps, before: str, after: str, lost: str) -> None:
    """Only of fields that go altogether was anything said; nothing is said twice."""
    sweeps.write(f"{SWEPT}outputs: {before}\n")
    sweeps.run()
    sweeps.write(f"{SWEPT}outputs: {after}\n# edited\n")
    for told in ([lost] if lost else [], []):
        sweeps.run()
        words = [text.partition(" will not contain ")[2] for text in sweeps.told if "will not contain" in text]
        assert words == [f"{what}; to keep them, choose another --output" for what in told]
        sweeps.write(f"{SWEPT}outputs: {after}\n# edited again\n")


def test_a_merge_tells_what_goes(sweeps: Sweeps, tmp_path: Path) -> None:
    sweeps.run()
    sweeps.write(SWEPT.replace("E: 210000", "E: 200000"))
    for i in (1, 2):
        sweep.run(sweeps.study, sweeps.output, workers=1, solve=workers.made_up, shard=(i, 2))
    told: list[str] = []
    merge(sweeps.study, sweeps.output, tell=told.append)
    assert any(f"the new cube will not contain {CASES} solved cases" in text for text in told)


def test_interrupted_at_the_first_result(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    """When versions and machine are looked up and the cube is begun: the result, perhaps of minutes, was lost."""

    def interrupted() -> dict[str, str]:
        raise KeyboardInterrupt

    monkeypatch.setattr(sweep.provenance, "collect", interrupted)
    assert len(sweeps.run()) == 1
    assert sweeps.interrupt.solved == 1


def test_interrupted_when_the_cube_is_there(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    """While units were being removed, which takes seconds if there are many, '0 of 14 cases are kept' was told."""
    clear = store.Store.clear

    def interrupted(self: store.Store) -> None:
        clear(self)
        raise KeyboardInterrupt

    monkeypatch.setattr(store.Store, "clear", interrupted)
    with pytest.raises(KeyboardInterrupt) as interrupt:
        sweep.run(sweeps.study, sweeps.output, workers=1, solve=workers.made_up)
    assert not isinstance(interrupt.value, sweep.Interrupted)
    monkeypatch.undo()
    assert sweeps.run() == []
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


@pytest.mark.parametrize("shard", [None, (1, 2)])
def test_a_lock_in_a_folder_made_anew_is_not_removed(sweeps: Sweeps, shard: tuple[int, int] | None) -> None:
    """The folder was taken away under a sweep, whose end then removed the next one's lock, and its folder."""
    with lock.locked(sweeps.units, shard):
        shutil.rmtree(sweeps.units)
        second = contextlib.ExitStack()
        second.enter_context(lock.locked(sweeps.units))
    with second, pytest.raises(UserError, match="at work"):
        sweeps.run()
    assert not sweeps.units.exists()


def test_locks_taken_while_others_leave(tmp_path: Path) -> None:
    """The last owner removes the folder, perhaps between two looks that the next one takes at it."""
    troubles: list[BaseException] = []

    def work() -> None:
        end = time.monotonic() + 1.0
        while time.monotonic() < end:
            try:
                with lock.locked(tmp_path / "units"):
                    pass
            except UserError:
                pass
            except BaseException as error:
                troubles.append(error)
                return

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert troubles == []


def test_half_of_what_a_disk_cannot_hold(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of results that do not fit together those that do are kept: else the next sweep would keep none, either."""
    give_room_for(2, monkeypatch)
    sweeps.run(9)
    kept = sweeps.interrupt.solved
    assert sum(len(read_unit(path)[0].entries) for path in unit_paths(sweeps.units)) >= 2
    monkeypatch.undo()
    assert len(sweeps.run()) <= CASES - 2
    assert kept <= 9


def test_a_shard_on_a_full_disk_says_so(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    """It said that all cases were solved when half of the last ones were on the disk, and lost the others."""
    fill_up(9, monkeypatch)
    with pytest.raises(UserError, match=rf"No space left on device\n9 of {CASES} cases are kept"):
        sweeps.run(shard=(1, 1))
    assert sum(len(read_unit(path)[0].entries) for path in unit_paths(sweeps.units)) == 9


def test_of_what_is_not_kept_nothing_is_said(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    """No advice to resume where there is nothing to go on with."""
    fill_up(0, monkeypatch)
    with pytest.raises(UserError, match=r"cannot be written: No space left on device$"):
        sweeps.run(shard=(1, 1))


def test_a_merge_refuses_what_does_not_belong(sweeps: Sweeps, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"none: does not exist, nor does .*none\.units$"):
        merge(sweeps.study, sweeps.output, [tmp_path / "none"])
    (tmp_path / "empty").mkdir()
    with pytest.raises(UserError, match="empty: no units in it"):
        merge(sweeps.study, sweeps.output, [tmp_path / "empty"])
    sweeps.run(8)
    other = tmp_path / "other.yaml"
    other.write_text(SWEPT.replace("[20, 40,", "[20, 41,"))
    path = tmp_path / "other.nc"
    sweep.run(load_study(other), path, workers=1, solve=workers.made_up, shard=(1, 1))
    with pytest.raises(UserError, match="3 of its 14 cases are not of this study"):
        merge(sweeps.study, sweeps.output, [path])
    (unit,) = unit_paths(units_folder(path))
    unit.write_bytes(unit.read_bytes()[:-1])
    with pytest.raises(UserError, match="damaged: its checksum does not match"):
        merge(sweeps.study, sweeps.output, [path])


@pytest.mark.parametrize("solved", [0, 8])
def test_a_merge_looks_into_the_fields_of_units_from_elsewhere(sweeps: Sweeps, tmp_path: Path, solved: int) -> None:
    """Whole, with a right checksum, and made of what was damaged before, be the case solved here as well or not."""
    if solved:
        sweeps.run(solved)
    case = expand(sweeps.study).cases[5]
    found = synthetic.made_up_result(case.scene)
    body = bytearray(sweep.Packer(sweep.keep_of(sweeps.study.outputs)).pack(found, case.scene.mesh.cells).body)
    body[-1] ^= 1
    (tmp_path / "elsewhere").mkdir()
    write_unit(tmp_path / "elsewhere", 1, [(case.key, bytes(body))], "swept")
    with pytest.raises(UserError, match=f"case {case.key[:12]}: "):
        merge(sweeps.study, sweeps.output, [tmp_path / "elsewhere"])
    (unit,) = unit_paths(tmp_path / "elsewhere")
    unit.unlink()
    unit.symlink_to(tmp_path / "nothing")  # which cannot be read
    with pytest.raises(UserError, match=f"{unit.name}: "):
        merge(sweeps.study, sweeps.output, [tmp_path / "elsewhere"])


def test_duplicates_must_agree(sweeps: Sweeps, tmp_path: Path) -> None:
    def otherwise(scenes: Sequence[Scene]) -> Iterator[Result]:
        for result in workers.made_up(scenes):
            result.scalars["solve_seconds"] *= 2
            if changed:
                result.fields["pressure"][12, 10] *= 1 + 1e-15
            yield result

    sweeps.run(8)
    for changed in (False, True):
        path = tmp_path / f"{changed}.nc"
        sweep.run(sweeps.study, path, workers=1, solve=otherwise, shard=(1, 1))
    with pytest.raises(UserError, match=r"has another result in .* \(pressure differs\): remove one of them"):
        merge(sweeps.study, sweeps.output, [tmp_path / "True.nc"])
    merge(sweeps.study, sweeps.output, [tmp_path / "False.nc"])
    cubes.assert_same(sweeps.output, sweeps.uninterrupted())


def test_duplicates_in_one_folder_must_agree(sweeps: Sweeps) -> None:
    sweeps.run()
    for case in expand(sweeps.study).cases[:1]:
        result = synthetic.made_up_result(case.scene)
        result.scalars["approach"] *= 2
        packed = sweep.Packer(sweep.keep_of(sweeps.study.outputs)).pack(result, case.scene.mesh.cells)
        sweeps.units.mkdir()
        write_unit(sweeps.units, 1, [(case.key, packed.body)], "swept")
        good = synthetic.made_up_result(case.scene)
        packed = sweep.Packer(sweep.keep_of(sweeps.study.outputs)).pack(good, case.scene.mesh.cells)
        write_unit(sweeps.units, 2, [(case.key, packed.body)], "swept")
    with pytest.raises(UserError, match=r"\(approach differs\)"):
        merge(sweeps.study, sweeps.output)


@pytest.mark.parametrize("shard", [(0, 2), (3, 2)])
def test_shards_that_are_none(sweeps: Sweeps, shard: tuple[int, int]) -> None:
    with pytest.raises(UserError, match="a number from 1 to 2"):
        sweeps.run(shard=shard)
    with pytest.raises(UserError, match="--fresh cannot be used with --shard"):
        sweeps.run(shard=(1, 2), fresh=True)


# status and failures


def test_status(sweeps: Sweeps) -> None:
    text = report(sweeps.study, sweeps.output)
    assert "c.nc (not there yet)" in text
    assert "total        14         0         0        14" in text
    sweeps.run(9, fails=(40.0,))
    text = report(sweeps.study, sweeps.output)
    assert "loads        12         6         3         3" in text
    assert "in 1 unit in" in text
    sweeps.run()
    text = report(sweeps.study, sweeps.output)
    assert "total        14        14         0         0" in text
    assert "14 of them are in the cube" in text
    assert "another study" not in text
    sweeps.run(2, fresh=True)
    assert "total        14         2         0        12" in report(sweeps.study, sweeps.output)
    sweeps.run(2)
    sizes = [path.stat().st_size for path in unit_paths(sweeps.units)]
    assert f"{progress.in_bytes(sum(sizes))} in {len(sizes)} units in" in report(sweeps.study, sweeps.output)


def test_status_reads_all_units_again_if_one_is_gone(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    """As where a sweep puts small ones together meanwhile."""
    sweeps.run(9)
    original, seen = status.read_unit, []

    def gone_at_first(path: Path) -> object:
        seen.append(path)
        if len(seen) == 1:
            raise FileNotFoundError
        return original(path)

    monkeypatch.setattr(status, "read_unit", gone_at_first)
    assert "total        14         9         0         5" in report(sweeps.study, sweeps.output)
    assert len(seen) == 1 + len(unit_paths(sweeps.units))


@pytest.mark.parametrize("fresh", [False, True])
@pytest.mark.parametrize("name", ["starts_over", "take_cube", "unit_paths", "read_unit"])
def test_status_while_the_cube_is_published(
    sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch, name: str, fresh: bool
) -> None:
    """After any look at the disk: no case is missing that was solved before."""
    if fresh:
        sweeps.run()
    sweeps.run(9, fresh=fresh)
    original = getattr(status, name)

    def publishing(*arguments: object) -> object:
        found = original(*arguments)
        monkeypatch.setattr(status, name, original)
        sweeps.run()
        return found

    monkeypatch.setattr(status, name, publishing)
    text = report(sweeps.study, sweeps.output)
    assert any(f"total        14        {solved}         0" in text for solved in (" 9", "14")), text


def test_a_grid_may_be_named_as_the_row_of_all(sweeps: Sweeps) -> None:
    """Its own row was replaced by that of all grids."""
    sweeps.write(SWEPT.replace("loads:", "total:"))
    rows = [line.split() for line in report(sweeps.study, sweeps.output).splitlines()]
    assert ["total", "12", "0", "0", "12"] in rows and ["all", "grids", "14", "0", "0", "14"] in rows


def test_failures_are_listed_with_a_study_each(sweeps: Sweeps, tmp_path: Path) -> None:
    sweeps.run()
    assert failed_cases(sweeps.output) == []
    sweeps.run(fails=(40.0, 80.0), fresh=True)
    found = failed_cases(sweeps.output)
    places = [f"load={p}, creepage={c}" for p in (40, 80) for c in "abc"]
    headings = [f"# loads: {place}: not converged: made up not to converge" for place in places]
    assert [line for line in listing(found).splitlines() if line.startswith("#")] == headings
    cases = {case.index: case for case in expand(sweeps.study).cases if case.grid == "loads"}
    paths = write_studies(found, tmp_path / "studies")
    assert len(paths) == 6
    for path, index_ in zip(paths, [(i, j) for i in (1, 3) for j in range(3)], strict=True):
        (alone,) = expand(load_study(path)).cases
        assert scene_record(alone.scene) == scene_record(cases[index_].scene)
        assert alone.key == cases[index_].key


def test_studies_of_failures_are_not_written_into_a_file(sweeps: Sweeps, tmp_path: Path) -> None:
    """What is wrong is said of the folder that was asked for, not of the first study in it."""
    sweeps.run(fails=(40.0,))
    (tmp_path / "studies").touch()
    with pytest.raises(UserError, match=r"studies: is a file, not a folder$"):
        write_studies(failed_cases(sweeps.output), tmp_path / "studies")


def test_failures_of_every_kind_of_scene_are_ready_to_run(tmp_path: Path) -> None:
    text = """
study: kinds
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: [50, 30]
  load: 33.333333333333336
  mesh: {size: [1, 1.1], cells: [24, 20]}
grids:
  kinds:
    cases:
      - {label: "odd: # name", counterbody: {E: 70000, nu: 0.33}, creepage: {spin: 1.0e-17}, coupling: full}
      - {label: coated, coating: {layer_count: 2, thickness: 1e-5 a, modulus: 3 Es}, friction: 0.1, spin_point: 0.25}
      - {label: strict, method: paper-cg, creepage: {lateral: 0.002}, tolerance: {normal: 1e-9, tangential: 1e-11}}
"""
    study = study_from_text(text, "kinds.yaml")
    path = tmp_path / "c.nc"

    def fails(scenes: Sequence[Scene]) -> Iterator[Result]:
        yield from (Result(Status.ERROR, "first line\nsecond: {line} # " + "long " * 60) for _ in scenes)

    sweep.run(study, path, workers=1, solve=fails)
    found = failed_cases(path)
    assert len(found) == 3
    keys = {case.key for case in expand(study).cases}
    assert {expand(study_from_text(case.study, case.name)).cases[0].key for case in found} == keys


def test_failures_of_a_study_with_a_long_name_have_names_of_their_own(tmp_path: Path) -> None:
    """The longest a study may have: cut, so that the case still tells them apart."""
    name = "n" * 100

    def fails(scenes: Sequence[Scene]) -> Iterator[Result]:
        yield from (Result(Status.ERROR, "made up") for _ in scenes)

    sweep.run(study_from_text(SWEPT.replace("swept", name), "s.yaml"), tmp_path / "c.nc", workers=1, solve=fails)
    found = failed_cases(tmp_path / "c.nc")
    names = {path.stem for path in write_studies(found, tmp_path / "studies")}
    assert len(names) == len(found) == 14
    assert "n" * (100 - len("-loads-1-2")) + "-loads-1-2" in names
    assert all(load_study(path).size == 1 for path in (tmp_path / "studies").iterdir())


def test_the_name_of_a_failure_on_many_axes_has_room() -> None:
    """It was longer than a study's may be, and the study written was refused."""
    names = {failures._name("study", "g" * 64, (0,) * 12 + place, k) for k, place in enumerate([(9,) * 4, (10,) * 4])}
    assert names == {f"study-{'g' * 64}-case-{k}" for k in (1, 2)}
    assert failures._name("n" * 100, "g" * 64, (0,) * 16, 0) == f"nnn-{'g' * 64}-{'-'.join('1' * 16)}"


# the mechanics keep their word


@pytest.mark.heavy
def test_a_result_does_not_depend_on_its_neighbours() -> None:
    """Solved alone, in any part of its group and in any order, after other groups: the same bits.

    Groups of one layer set share coefficients, cases of one pressure the coarser meshes' contacts.
    """
    from rcstudy.solve import solve_group

    text = """
study: neighbours
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  mesh: {size: [1, 1], cells: [40, 40]}
  SETTINGS
grids:
  coated:
    coating: {modulus: 2 Es}
    axes:
      thickness: [0.3 a, 0.8 a]
      load: [20, 60]
      tolerance.tangential: [0.3, 1.0e-7] # 0.3: than coarser meshes are solved to
      creepage:
        - {label: a, longitudinal: 0.002}
        - {label: b, lateral: 0.001, spin: 0.01}
        - {label: c, spin: 0.02}
        - {label: d, longitudinal: 0.0004, lateral: 0.0002}
"""

    def bits(result: Result) -> object:
        scalars = {name: value for name, value in result.scalars.items() if name not in cubes.TIMINGS}
        return result.status, scalars, {name: values.tobytes() for name, values in result.fields.items()}

    for settings in ("", "coupling: full", "discretisation: aligned"):
        study = study_from_text(text.replace("SETTINGS", settings), "neighbours.yaml")
        groups = [[case.scene for case in group] for group in expand(study).groups()]
        together = [bits(result) for group in groups for result in solve_group(group)]
        scenes = [scene for group in groups for scene in group]
        alone = [bits(result) for scene in reversed(scenes) for result in solve_group([scene])][::-1]
        assert alone == together
        rng = np.random.default_rng(1)
        by_scene = dict(zip(scenes, together, strict=True))
        for group in groups:
            part = [group[i] for i in rng.permutation(len(group))[: max(1, len(group) - 1)]]
            assert [bits(result) for result in solve_group(part)] == [by_scene[scene] for scene in part]


def test_leftovers_of_dead_writers_are_removed(sweeps: Sweeps) -> None:
    sweeps.run(3)
    host = publish.host()
    dead = sweeps.units / f"000009-0123456789ab.unit.tmp-{host}-99999999-1f"
    living = sweeps.units / f"000009-0123456789ab.unit.tmp-{host}-{os.getppid()}-1f"
    dead.write_bytes(b"half")
    living.write_bytes(b"half")
    sweeps.run(0, shard=(1, 1))
    assert (dead.exists(), living.exists()) == (False, True)
    sweeps.run()  # alone: nobody else can be writing it, and that number is another process's
    assert not sweeps.units.exists()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize("failing_last", [False, True])
def test_a_merge_takes_solutions_before_failures(sweeps: Sweeps, tmp_path: Path, failing_last: bool) -> None:
    paths = [tmp_path / "failing.nc", tmp_path / "solved.nc"]
    for path, solver in zip(paths, (Solver(fails=(20.0, 80.0)), Solver(fails=(60.0, 80.0))), strict=True):
        sweep.run(sweeps.study, path, workers=1, solve=solver, shard=(1, 1))
    done = merge(sweeps.study, sweeps.output, paths[::-1] if failing_last else paths)
    assert [f.label for f in done.failures] == [f"load=80, creepage={c}" for c in "abc"]
    assert (done.cases, done.kept) == (CASES, CASES - 3)


def test_small_units_put_together_know_who_failed(sweeps: Sweeps, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "_PUT_TOGETHER", 3)
    cases = expand(sweeps.study).cases[:6]
    keep = sweep.keep_of(sweeps.study.outputs)
    statuses = [Status.NOT_CONVERGED, Status.SOLVED] * 3
    with store.opened(sweeps.output, "s", cases, keep, tell=sweeps.told.append) as opened:
        for case, status_ in zip(cases, statuses, strict=True):
            result = synthetic.made_up_result(case.scene, status_)
            opened.add(case.key, sweep.Packer(keep).pack(result, case.scene.mesh.cells))
            if status_ == Status.SOLVED:  # two cases in each unit
                opened.flush()
        assert len(unit_paths(sweeps.units)) == 1
        assert [opened.index.status(case.key) for case in cases] == statuses
