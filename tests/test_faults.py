"""Faults: killed at any moment, workers killed, disks full, folders read-only, caches corrupt, clocks turned back.

After each of them the same command goes on, and the cube is that of a sweep nothing happened to, bit for bit.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import cubes
import h5py
import numpy as np
import pytest
import workers
import xarray as xr
from disks import give_room_for
from workers import gone

from rcstudy import check, cli, status, store, sweep
from rcstudy.cases import expand
from rcstudy.cube import open_cube
from rcstudy.errors import UserError
from rcstudy.storage import cube_writer, lock, publish, units
from rcstudy.storage.publish import write_whole
from rcstudy.storage.units import read_unit, unit_paths
from rcstudy.store import units_folder
from rcstudy.study import load_study

TESTS = Path(__file__).parent
ROOT = TESTS.parent

STUDY = """
study: faults
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  mesh: {size: [1, 1], cells: [12, 10]}
  load: 100
grids:
  loads:
    axes:
      load: [LOADS]
      creepage: [{longitudinal: 0.001}, {spin: 0.01}]
"""
CASES = 60

# A sweep with made-up results that take a while, by rcstudy's own command line; units of a few cases
SWEEP = """
import sys, time
sys.path.insert(0, {tests!r})
import workers
from rcstudy import cli, store, sweep
from rcstudy.threads import limit_threads
store.UNIT_CASES, store._PUT_TOGETHER = 3, 3
if __name__ == "__main__":
    limit_threads()
    sweep.solve_batch = getattr(workers, {solver!r})
    sys.argv[1:] = {arguments!r}
    cli.app()
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the study `s.yaml` of 60 cases, and the cube `good.nc` of a sweep nothing happened to."""
    folder = tmp_path_factory.mktemp("good")
    (folder / "s.yaml").write_text(STUDY.replace("LOADS", ", ".join(str(50 + k) for k in range(CASES // 2))))
    sweep.run(load_study(folder / "s.yaml"), folder / "good.nc", workers=1, solve=workers.made_up)
    return folder


@pytest.fixture
def folder(tmp_path: Path, made: Path) -> Path:
    """A folder of its own with `s.yaml` and `good.nc`."""
    for name in ("s.yaml", "good.nc"):
        shutil.copy(made / name, tmp_path / name)
    return tmp_path


def start(folder: Path, *arguments: str, solver: str = "made_up", **options: object) -> subprocess.Popen[str]:
    """``rcstudy sweep s.yaml`` with made-up results, one process, in a process group of its own."""
    words = ["sweep", "s.yaml", "--workers", "1", *arguments]
    script = folder / "run.py"
    script.write_text(SWEEP.format(tests=str(TESTS), solver=solver, arguments=words))
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **options.pop("env", {})}
    return subprocess.Popen(
        [sys.executable, str(script)],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        **options,
    )


def finished(process: subprocess.Popen[str], seconds: float = 120.0) -> tuple[int, str, str]:
    """Exit code, output and errors of a process, which must come to its end and show no traceback."""
    try:
        out, err = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        raise
    assert "Traceback" not in err, err
    return process.returncode, out, err


def kept(folder: Path, name: str = "c.nc") -> int:
    """Cases in whole units."""
    return sum(len(read_unit(path)[0].entries) for path in unit_paths(units_folder(folder / name)))


# SIGKILL


def test_killed_at_fifty_moments(folder: Path) -> None:
    """One sweep, killed again and again wherever it is, also while its cube is written, until it is done.

    Children are forked from this process once everything is imported, so that moments fall into the sweep itself.
    """
    study = load_study(folder / "s.yaml")
    output = folder / "c.nc"
    rng = np.random.default_rng(7)
    begun = time.monotonic()
    assert ended(forked(lambda: sweep.run(study, folder / "once.nc", workers=1, solve=workers.slowly))) == 0
    whole = time.monotonic() - begun

    def one_sweep() -> None:
        store.UNIT_CASES, store._PUT_TOGETHER = 2, 3
        sweep.run(study, output, workers=1, solve=workers.slowly)

    def check_published() -> None:
        cubes.assert_same(output, folder / "good.nc")

    kills = {"solving": 0, "assembling": 0}
    most = 0
    for _ in range(200):
        if sum(kills.values()) >= 50:
            break
        process = forked(one_sweep)
        # short ones, so that many fall into one sweep; some as long as it takes to the end
        time.sleep(float(rng.uniform(0.0, 0.3 * whole if rng.random() < 0.8 else whole)))
        os.kill(process, signal.SIGKILL)
        if ended(process) == 0:
            check_published()  # done before the kill: once more from the start
            output.unlink()
            most = 0
            continue
        assembling = any(entry.name.startswith("c.nc.tmp-") for entry in folder.iterdir())
        kills["assembling" if assembling else "solving"] += 1
        if output.exists():
            check_published()
        else:
            assert kept(folder) >= most, "something was lost"
            most = kept(folder)
    assert sum(kills.values()) == 50, kills
    assert ended(forked(one_sweep)) == 0
    check_published()
    assert not units_folder(output).exists()


def forked(action: object) -> int:
    """A process that does `action`; its number."""
    process = os.fork()
    if process:
        return process
    code = 1
    try:
        action()
        code = 0
    finally:
        os._exit(code)  # nothing of the test run may go on in here


def ended(process: int) -> int:
    """The exit code of a process, or minus the signal that ended it."""
    _, status = os.waitpid(process, 0)
    return os.waitstatus_to_exitcode(status)


MOMENTS = ["unit written", "unit renamed", "cube laid out", "cube closed", "cube renamed", "mark gone", "units going"]


@pytest.mark.parametrize("moment", MOMENTS)
def test_killed_at_the_worst_moments(folder: Path, moment: str) -> None:
    """Between any two steps that must not come apart, at the first sweep and at one that starts over."""

    def die(*arguments: object) -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    def after(function: object, times: int = 1) -> object:
        calls = []

        def wrapped(*arguments: object, **keywords: object) -> object:
            result = function(*arguments, **keywords)
            calls.append(1)
            if len(calls) == times:
                die()
            return result

        return wrapped

    unlink = Path.unlink
    study = load_study(folder / "s.yaml")

    def doomed(fresh: bool) -> None:
        store.UNIT_CASES, store._PUT_TOGETHER = 7, 3
        if moment == "unit written":
            publish.os.fsync = after(os.fsync, 3)
        elif moment == "unit renamed":
            units.write_whole = after(units.write_whole, 3)
        elif moment == "cube laid out":
            cube_writer._Group.add = after(cube_writer._Group.add, 40)
        elif moment == "cube closed":
            cube_writer._Group.finish = after(cube_writer._Group.finish)
        elif moment == "cube renamed":
            store.Store.clear = die
        elif moment == "mark gone":
            store.Store.clear = lambda self: (unlink(self.folder / "fresh", missing_ok=True), die())
        else:
            Path.unlink = after(unlink, 5)
        sweep.run(study, folder / "c.nc", workers=1, solve=workers.made_up, fresh=fresh)

    for fresh in (False, True):
        assert ended(forked(lambda fresh=fresh: doomed(fresh))) == -signal.SIGKILL
        assert sweep.run(study, folder / "c.nc", workers=1, solve=workers.made_up).solved == CASES
        cubes.assert_same(folder / "c.nc", folder / "good.nc")
        assert not units_folder(folder / "c.nc").exists()


def test_a_sweep_with_workers_killed(folder: Path) -> None:
    """The process that deals out the work: its workers leave, and the next one goes on from its units."""
    for _ in range(2):
        process = start(folder, "-o", "c.nc", "--workers", "2", solver="slowly")
        deadline = time.monotonic() + 60.0
        before = kept(folder)
        while process.poll() is None and kept_now(folder) <= before and time.monotonic() < deadline:
            time.sleep(0.02)
        os.kill(process.pid, signal.SIGKILL)
        process.communicate(timeout=60)
        assert gone(process.pid), "a worker is left"
        if not (folder / "c.nc").exists():
            assert kept(folder) > before
    code, _, err = finished(start(folder, "-o", "c.nc", "--workers", "2"))
    assert code == 0, err
    assert "cases are solved already and kept" in err
    cubes.assert_same(folder / "c.nc", folder / "good.nc")


def kept_now(folder: Path) -> int:
    """`kept`, of a sweep that may be putting units together right now."""
    try:
        return kept(folder)
    except FileNotFoundError:
        return 0


def test_a_worker_killed(folder: Path) -> None:
    """Once: its case is tried again, and nothing is missing."""
    environment = {"DEATHS": str(folder)}
    code, out, err = finished(start(folder, "-o", "c.nc", "--workers", "2", solver="dies_once", env=environment))
    assert (folder / "died").exists()
    assert (code, out[:21]) == (0, "60 of 60 cases solved"), err
    assert err.count("a worker process died (") == 1
    assert "; its cases go to other workers" in err
    cubes.assert_same(folder / "c.nc", folder / "good.nc")


# interrupts


@pytest.mark.parametrize("processes", ["1", "2"])
def test_ctrl_c_ends_within_two_seconds_and_keeps_all(folder: Path, processes: str) -> None:
    process = start(folder, "-o", "c.nc", "--workers", processes, solver="slowly")
    deadline = time.monotonic() + 60.0
    while not kept_now(folder) and time.monotonic() < deadline:
        time.sleep(0.02)
    begun = time.monotonic()
    os.killpg(process.pid, signal.SIGINT)
    code, out, err = finished(process)
    seconds = time.monotonic() - begun
    assert (code, out) == (cli.EXIT_INTERRUPTED, ""), err
    count = kept(folder)
    last = f"interrupted: c.nc was not written; {count} of 60 cases are kept: rerun the same command to resume"
    assert err.splitlines()[-1] == last
    assert 0 < count < CASES
    assert seconds < 2.0 + 0.5 * os.getloadavg()[0]  # 2 s on a machine that is free
    code, out, err = finished(start(folder, "-o", "c.nc", "--workers", processes))
    assert f"{count} of 60 cases are solved already and kept" in err
    assert f", {count} of them before" in out
    cubes.assert_same(folder / "c.nc", folder / "good.nc")


# the order in which things reach the disk


def test_units_go_once_the_mark_of_a_fresh_start_is_on_the_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else the old cube would count again. Once the new one is there the mark goes first, else the old units would."""
    for number in (1, 2):
        units.write_unit(tmp_path, number, [], "s")
    seen, unlink = [], Path.unlink

    def note() -> None:
        seen.append((store.starts_over(tmp_path, "s"), len(unit_paths(tmp_path))))

    def written(path: Path, parts: list[bytes]) -> None:
        write_whole(path, parts)  # on the disk when it returns
        note()

    def noted(path: Path, missing_ok: bool = False) -> None:
        note()
        unlink(path, missing_ok)

    monkeypatch.setattr(store, "write_whole", written)
    store._start_over(tmp_path, "s")
    assert (seen, unit_paths(tmp_path), store.starts_over(tmp_path, "s")) == ([(True, 2), (True, 0)], [], True)
    units.write_unit(tmp_path, 3, [], "s")
    seen.clear()
    monkeypatch.setattr(Path, "unlink", noted)
    store.Store.clear(SimpleNamespace(folder=tmp_path))
    assert (seen, unit_paths(tmp_path)) == ([(True, 1), (False, 1)], [])


def test_units_put_together_go_once_the_whole_is_there(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a disk that has no room for both nothing is lost."""
    study, output = load_study(folder / "s.yaml"), folder / "c.nc"
    cases, keep = expand(study).cases[:3], sweep.keep_of(study.outputs)
    give_room_for(2, monkeypatch)
    monkeypatch.setattr(store, "_PUT_TOGETHER", 3)
    with store.opened(output, study.name, cases, keep, tell=lambda text: None) as opened:
        for case, packed in zip(cases, sweep.Packing(workers.made_up, keep)([c.scene for c in cases]), strict=True):
            opened.add(case.key, packed)
            with contextlib.nullcontext() if case is not cases[2] else pytest.raises(UserError, match="No space left"):
                opened.flush()
    assert kept(folder) == 3


# disks


@pytest.mark.parametrize("limit", [0, 3_000, 20_000])
def test_a_full_disk(folder: Path, limit: int) -> None:
    """By a limit to the size of files: of the lock, of units, of the cube."""
    import resource

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    code, out, err = finished(start(folder, "-o", "c.nc", preexec_fn=limited, env={"NUMBA_DISABLE_JIT": "1"}))
    assert (code, out) == (cli.EXIT_BAD_INPUT, "")
    assert "cannot be written: File too large" in err
    assert not (folder / "c.nc").exists()
    assert [entry.name for entry in folder.iterdir() if ".tmp-" in entry.name] == []
    count = kept(folder)
    assert (count == CASES) == (limit == 20_000)
    assert ("60 of 60 cases are kept; rerun the same command to resume" in err) == (limit == 20_000)
    assert finished(start(folder, "-o", "c.nc"))[0] == 0
    cubes.assert_same(folder / "c.nc", folder / "good.nc")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 256 kB."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(disk)], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("this user cannot mount a small tmpfs")
    try:
        yield disk
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=False)


def test_a_small_disk_runs_full(folder: Path, small_disk: Path) -> None:
    """Units fit, the cube does not; with more room the same command makes it without solving anything."""
    (small_disk / "ballast").write_bytes(bytes(40_000))
    code, _, err = finished(start(folder, "-o", "disk/c.nc"))
    assert code == cli.EXIT_BAD_INPUT
    assert "cannot be written: No space left on device" in err
    count = kept(small_disk)
    assert f"{count} of 60 cases are kept" in err
    subprocess.run(["mount", "-o", "remount,size=4m", str(small_disk)], check=True)
    code, out, _ = finished(start(folder, "-o", "disk/c.nc"))
    assert code == 0
    assert f", {count} of them before" in out
    cubes.assert_same(small_disk / "c.nc", folder / "good.nc")


def test_a_place_that_cannot_be_written_to(folder: Path) -> None:
    """Found before anything is solved; /proc refuses even root."""
    places = ["/proc/c.nc", "s.yaml/c.nc"]
    if os.geteuid():
        (folder / "locked").mkdir(mode=0o555)
        places.append("locked/c.nc")
    for place in places:
        code, out, err = finished(start(folder, "-o", place, solver="never"))
        assert (code, out) == (cli.EXIT_BAD_INPUT, ""), place
        assert f"{place}: cannot be written: " in err


def test_a_disk_that_becomes_read_only(folder: Path, small_disk: Path) -> None:
    assert finished(start(folder, "-o", "disk/c.nc", "--shard", "1/2"))[0] == 0
    before = kept(small_disk)
    assert before
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    code, _, err = finished(start(folder, "-o", "disk/c.nc"))
    assert code == cli.EXIT_BAD_INPUT
    assert "cannot be written: Read-only file system" in err
    status = subprocess.run(
        [sys.executable, "-m", "rcstudy", "status", "s.yaml", "-o", "disk/c.nc"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert str(before) in status.stdout


# clocks and caches


def test_clocks_do_not_matter(folder: Path) -> None:
    """Files from the future and from 1970, and a clock that was turned back between two runs."""
    process = start(folder, "-o", "c.nc", solver="slowly")
    deadline = time.monotonic() + 60.0
    while kept_now(folder) < 6 and time.monotonic() < deadline:
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate(timeout=60)
    for k, path in enumerate(sorted(units_folder(folder / "c.nc").iterdir())):
        stamp = 4e9 if k % 2 else 0.0
        os.utime(path, (stamp, stamp))
    count = kept(folder)
    assert count >= 6
    script = folder / "sitecustomize.py"
    script.write_text("import time\nreal = time.time\ntime.time = lambda: real() - 1e8\n")
    code, out, err = finished(start(folder, "-o", "c.nc", env={"PYTHONPATH": f"{folder}{os.pathsep}{ROOT}"}))
    assert code == 0, err
    assert f", {count} of them before" in out
    cubes.assert_same(folder / "c.nc", folder / "good.nc")


@pytest.mark.heavy
def test_a_corrupt_cache_of_compiled_kernels(folder: Path) -> None:
    """Numba's files cut, emptied or overwritten, indices and machine code: recompiled, or the cases are solved."""
    cache = folder / "cache"
    environment = {"NUMBA_CACHE_DIR": str(cache)}
    assert finished(start(folder, "-o", "first.nc", solver="by_kernels", env=environment))[0] == 0
    for suffix in (".nbc", ".nbi"):  # machine code under whole indices, then these
        files = sorted(cache.rglob(f"*{suffix}"))
        assert len(files) >= 3
        for n, path in enumerate(files):
            data = path.read_bytes()
            path.write_bytes((data[: len(data) // 2], b"", os.urandom(len(data)))[n % 3])
        code, _, err = finished(start(folder, "-o", "c.nc", "--fresh", solver="by_kernels", env=environment))
        assert code == 0, err
        cubes.assert_same(folder / "c.nc", folder / "good.nc")
    shutil.rmtree(cache)


# failing calls of the system, found by failing each of them and killing at each


def other_study(folder: Path) -> bytes:
    """Put the cube of another study at `c.nc`; its bytes."""
    text = (
        (folder / "s.yaml").read_text().replace("study: faults", "study: other").replace("load: [50,", "load: [49.5,")
    )
    loads = text.index("load: [49.5")
    (folder / "other.yaml").write_text(text[:loads] + "load: [49.5]" + text[text.index("]", loads) + 1 :])
    sweep.run(load_study(folder / "other.yaml"), folder / "c.nc", workers=1, solve=workers.made_up)
    return (folder / "c.nc").read_bytes()


class Opening:
    """In place of h5py.File: the opening number `number` of a file for reading fails, or all do."""

    def __init__(self, number: int, error: int, *, always: bool = False) -> None:
        self.number, self.error, self.always, self.count = number, error, always, 0

    def __call__(self, name: object, mode: str = "r", **options: object) -> h5py.File:
        if mode == "r":
            self.count += 1
            if self.always or self.count == self.number:
                text = os.strerror(self.error)
                raise OSError(self.error, f"Unable to open file (errno = {self.error}, error message = '{text}')")
        return FILE(name, mode, **options)


FILE = h5py.File


@pytest.mark.parametrize("error", [errno.EIO, errno.EMFILE, errno.ESTALE])
def test_a_cube_that_cannot_be_read_for_a_moment_is_not_replaced(
    folder: Path, monkeypatch: pytest.MonkeyPatch, error: int
) -> None:
    """Neither that of another study, nor that of an earlier version of this one, whose cases would be solved again."""
    study, output = load_study(folder / "s.yaml"), folder / "c.nc"
    before = other_study(folder)
    for number in range(1, 7):
        monkeypatch.setattr(h5py, "File", Opening(number, error))
        with pytest.raises(UserError, match=f"{os.strerror(error)}|is the cube of another study"):
            sweep.run(study, output, workers=1, solve=workers.made_up)
        assert output.read_bytes() == before, number
    monkeypatch.setattr(h5py, "File", FILE)
    output.write_bytes((folder / "good.nc").read_bytes())
    (folder / "s.yaml").write_text((folder / "s.yaml").read_text().replace("[50,", "[49.5, 50,"))
    edited = load_study(folder / "s.yaml")
    for number in (1, 3):
        monkeypatch.setattr(h5py, "File", Opening(number, error))
        with pytest.raises(UserError, match=f"c.nc: cannot be read: {os.strerror(error)}"):
            sweep.run(edited, output, workers=1, solve=workers.made_up)
        assert output.read_bytes() == (folder / "good.nc").read_bytes()
    monkeypatch.setattr(h5py, "File", FILE)
    assert sweep.run(edited, output, workers=1, solve=workers.made_up).kept == CASES


def test_status_tells_of_a_cube_that_cannot_be_read(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once, beside all else that it tells."""
    (folder / "c.nc").write_bytes((folder / "good.nc").read_bytes())
    for always in (False, True):
        monkeypatch.setattr(h5py, "File", Opening(1, errno.EIO, always=always))
        report = status.report(load_study(folder / "s.yaml"), folder / "c.nc")
        said = f"a sweep will be refused: {folder}/c.nc: cannot be read: {os.strerror(errno.EIO)}"
        assert report.count(said) == report.count("cannot be read") == 1
        assert "no sweep is at work" in report and "another study" not in report


@pytest.mark.parametrize("error", [errno.ENOLCK, errno.EOPNOTSUPP, errno.EINVAL])
def test_a_file_system_without_locks(folder: Path, monkeypatch: pytest.MonkeyPatch, error: int) -> None:
    """HDF5 then opens files only if it is told to do without: as for `flock`, a sweep goes on."""
    unlocked = set()

    def without_locks(name: object, mode: str = "r", locking: object = None, **options: object) -> h5py.File:
        if mode == "r" and locking is not False:
            text = f"unable to lock file, errno = {error}, error message = '{os.strerror(error)}'"
            if unlocked and any(unlocked):
                raise OSError("Unable to synchronously open file (file locking flag values don't match)")
            raise OSError(error, f"Unable to synchronously open file ({text})")
        file = FILE(name, mode, locking=locking, **options)
        if mode == "r":
            unlocked.add(file)
        return file

    output = folder / "c.nc"
    before = other_study(folder)
    monkeypatch.setattr(h5py, "File", without_locks)
    with pytest.raises(UserError, match="is the cube of another study"):
        sweep.run(load_study(folder / "s.yaml"), output, workers=1, solve=workers.made_up)
    assert output.read_bytes() == before
    output.write_bytes((folder / "good.nc").read_bytes())
    (folder / "s.yaml").write_text((folder / "s.yaml").read_text().replace("[50,", "[49.5, 50,"))
    assert sweep.run(load_study(folder / "s.yaml"), output, workers=1, solve=workers.made_up).kept == CASES


def test_a_fresh_start_killed_among_the_old_units_takes_none_of_them(folder: Path) -> None:
    study, output = load_study(folder / "s.yaml"), folder / "c.nc"
    for i in (1, 2, 3):
        sweep.run(study, output, workers=1, solve=workers.made_up, shard=(i, 3))
    assert kept(folder) == CASES

    def doomed() -> None:
        unlink, calls = Path.unlink, []

        def noted(path: Path, missing_ok: bool = False) -> None:
            unlink(path, missing_ok)
            calls.extend([path] if path.suffix == units.SUFFIX else [])
            if calls:
                os.kill(os.getpid(), signal.SIGKILL)

        Path.unlink = noted
        sweep.run(study, output, workers=1, solve=workers.made_up, fresh=True)

    assert ended(forked(doomed)) == -signal.SIGKILL
    assert 0 < kept(folder) < CASES
    with pytest.raises(UserError, match="a sweep that started over was killed"):
        sweep.run(study, output, workers=1, solve=workers.made_up, shard=(1, 3))
    assert sweep.run(study, output, workers=1, solve=workers.made_up).kept == 0
    cubes.assert_same(output, folder / "good.nc")
    assert not units_folder(output).exists()


def test_the_mark_of_a_fresh_start_is_gone_from_the_disk_before_units_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a power failure might leave it alone, and the cube that was just written would not count."""
    (tmp_path / "fresh").write_bytes(b"s")
    units.write_unit(tmp_path, 1, [], "s")
    seen = []
    monkeypatch.setattr(
        store, "sync", lambda path: seen.append((store.starts_over(tmp_path, "s"), unit_paths(tmp_path)))
    )
    store.Store.clear(SimpleNamespace(folder=tmp_path))
    assert [(mark, len(left)) for mark, left in seen] == [(False, 1)]
    assert unit_paths(tmp_path) == []


def test_an_unfinished_unit_of_another_container_goes(folder: Path) -> None:
    """Where nobody else can be at work, as an unfinished cube does; else the folder would stay for good."""
    output = folder / "c.nc"
    units_folder(output).mkdir()
    left = units_folder(output) / f"000001-0123456789ab.unit.tmp-node-1-{os.getpid()}-7f01"
    left.write_bytes(b"some")
    sweep.run(load_study(folder / "s.yaml"), output, workers=1, solve=workers.made_up)
    assert not units_folder(output).exists()


def test_a_small_unit_that_cannot_be_removed_ends_no_sweep(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    unlink, failed = Path.unlink, []

    def fails_once(path: Path, missing_ok: bool = False) -> None:
        if path.suffix == units.SUFFIX and path.name.startswith("000002-") and not failed:
            failed.append(path)
            raise OSError(errno.EIO, os.strerror(errno.EIO), str(path))
        unlink(path, missing_ok)

    add = store.Store.add

    def at_once(self: store.Store, *arguments: object) -> None:
        add(self, *arguments)
        self.flush()

    monkeypatch.setattr(store.Store, "add", at_once)
    monkeypatch.setattr(store, "_PUT_TOGETHER", 3)
    monkeypatch.setattr(Path, "unlink", fails_once)
    assert sweep.run(load_study(folder / "s.yaml"), folder / "c.nc", workers=1, solve=workers.made_up).solved == CASES
    assert failed
    cubes.assert_same(folder / "c.nc", folder / "good.nc")
    assert not units_folder(folder / "c.nc").exists()


def test_a_new_folder_is_forced_to_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else a power failure may take it with all units in it, though each of these was forced to the disk."""
    seen = []
    monkeypatch.setattr(publish, "sync", lambda path: seen.append(path))
    with lock.locked(tmp_path / "a" / "c.nc.units"):
        assert set(seen) == {tmp_path, tmp_path / "a"}

    def refused(path: Path) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))

    monkeypatch.setattr(publish, "sync", refused)  # of a folder that may be written to, but not read
    with lock.locked(tmp_path / "b" / "c.nc.units"):
        assert (tmp_path / "b" / "c.nc.units").is_dir()


def test_a_cube_that_was_read_and_cannot_be_closed_ends_no_sweep(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its cases are taken all the same."""

    class Unclosing(h5py.File):
        def close(self) -> None:
            super().close()
            if self.opened_to_read:
                raise RuntimeError("Can't decrement id ref count (unable to close file, errno = 5)")

        def __init__(self, name: object, mode: str = "r", **options: object) -> None:
            self.opened_to_read = mode == "r"
            super().__init__(name, mode, **options)

        def __exit__(self, *error: object) -> None:
            super().close()

    output = folder / "c.nc"
    output.write_bytes((folder / "good.nc").read_bytes())
    (folder / "s.yaml").write_text((folder / "s.yaml").read_text().replace("[50,", "[49.5, 50,"))
    monkeypatch.setattr(h5py, "File", Unclosing)
    edited = load_study(folder / "s.yaml")
    assert sweep.run(edited, output, workers=1, solve=workers.made_up).kept == CASES


def test_a_lock_that_cannot_be_closed_hides_no_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    close = os.close

    def fails(descriptor: int) -> None:
        close(descriptor)
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    with pytest.raises(UserError, match="what went wrong"), lock.locked(tmp_path / "c.nc.units"):
        monkeypatch.setattr(lock.os, "close", fails)
        raise UserError("what went wrong")


@pytest.mark.parametrize("limit", [0, 3_000, 20_000])
def test_a_full_disk_under_the_errors_of_a_report(tmp_path: Path, limit: int) -> None:
    """Told as such: it was a traceback or, where a cube was given, that one was said to be damaged."""
    import resource

    errors, values = tmp_path / "accuracy.nc", np.arange(10_000.0)
    datasets = {"/": xr.Dataset(attrs={"study": "s"}), "/g": xr.Dataset({"error": ("load", values)})}

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        with pytest.raises(UserError, match=r"accuracy\.nc: cannot be written: File too large"):
            cube_writer.write_datasets(errors, datasets)

    for before in ([], [errors]):
        assert ended(forked(limited)) == 0
        assert list(tmp_path.iterdir()) == before
        assert not before or errors.read_bytes() == b"earlier"
        errors.write_bytes(b"earlier")
    cube_writer.write_datasets(errors, datasets)
    for engine in ("netcdf4", "h5netcdf"):
        with xr.open_datatree(errors, engine=engine) as tree:
            assert tree.attrs == datasets["/"].attrs
            assert tree["g"].to_dataset().identical(datasets["/g"])


def test_a_cube_that_hdf5_fails_to_read_for_a_moment_is_not_called_damaged(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By `show --check`, which named nothing that was, and promised that a sweep solves it again."""
    output = folder / "good.nc"
    with open_cube(output) as tree:
        monkeypatch.setattr(h5py, "File", Opening(1, errno.EIO))
        said = f"{output}: HDF5 fails to read it as a whole: an error of the disk, or damage: try again"
        assert check.damage(output, tree, ()) == [said]
        assert check.damage(output, tree, ()) == []


def test_a_link_to_a_folder_that_is_not_there(tmp_path: Path) -> None:
    """It is made, as for the cube of a sweep; the link was called a file."""
    (tmp_path / "link").symlink_to("a/b")
    publish.make_folder(tmp_path / "link")
    assert (tmp_path / "a" / "b").is_dir()
    assert (tmp_path / "link").is_symlink()
