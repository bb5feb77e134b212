"""Cubes: nothing but a whole one ever stands under its name, whatever happens to the process and to the disk."""

from __future__ import annotations

import errno
import gc
import io
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest
import synthetic
from cubes import write_cube

from rcstudy.cube import case_dims, case_table, grids, open_cube
from rcstudy.errors import UserError
from rcstudy.mechanics.scene import Mesh
from rcstudy.storage import cube_writer, publish
from rcstudy.storage.publish import replacing
from rcstudy.storage.steady import SteadyFile

TESTS = Path(__file__).parent


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cube of one grid."""
    return synthetic.write(tmp_path_factory.mktemp("single") / "single.nc", synthetic.small())


def leftovers(folder: Path) -> list[str]:
    """Names of temporary files in `folder`."""
    return [entry.name for entry in folder.iterdir() if ".tmp-" in entry.name]


MOMENTS = ["layout", "result 0", "result 4", "result 8", "scalars", "table", "close", "sync", "rename"]


def die(*arguments: object, **keywords: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def start_writer(path: Path, moment: str = "") -> int:
    """A process that writes `synthetic.several` to `path`, and kills itself at `moment`; its number."""
    process = os.fork()
    if process:
        return process
    try:
        made = synthetic.several()

        def results() -> Iterator:
            for k, pair in enumerate(made.results):
                if moment == f"result {k}":
                    die()
                yield pair

        sync = publish.sync
        for name, place, attribute, action in (
            ("layout", cube_writer._Group, "_create", die),
            ("scalars", cube_writer._Group, "finish", die),
            ("table", cube_writer._Group, "fill_from", die),
            ("close", h5py.File, "close", die),
            ("sync", publish, "sync", die),
            ("rename", Path, "replace", die),
            ("renamed", publish, "sync", lambda p: die() if p.is_dir() else sync(p)),
        ):
            if name == moment:
                setattr(place, attribute, action)
        write_cube(path, made.study, made.expansion, results(), {"command": "killed"})
    finally:
        os._exit(0)  # nothing of the test run may go on in here


def ended_by(process: int) -> int:
    """The signal that ended a process; 0 when it came to its own end."""
    _, status = os.waitpid(process, 0)
    return os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0


@pytest.fixture(scope="module")
def old_cube(single: Path) -> bytes:
    """What stands at the place of a cube before a writer comes."""
    return single.read_bytes()


@pytest.mark.parametrize(
    ("moment", "there"), [*((moment, True) for moment in MOMENTS), ("result 4", False), ("rename", False)]
)
def test_killed_before_the_rename_changes_nothing(tmp_path: Path, old_cube: bytes, moment: str, there: bool) -> None:
    path = tmp_path / "c.nc"
    if there:
        path.write_bytes(old_cube)
    assert ended_by(start_writer(path, moment)) == signal.SIGKILL
    assert path.exists() == there
    if there:
        assert path.read_bytes() == old_cube
    assert len(leftovers(tmp_path)) == 1
    with replacing(path) as temporary:
        temporary.write_bytes(b"the next one")
    assert [entry.name for entry in tmp_path.iterdir()] == ["c.nc"]


def test_killed_after_the_rename_leaves_the_new_cube_whole(tmp_path: Path, old_cube: bytes) -> None:
    path = tmp_path / "c.nc"
    path.write_bytes(old_cube)
    assert ended_by(start_writer(path, "renamed")) == signal.SIGKILL
    check_whole(path)
    assert leftovers(tmp_path) == []


def test_killed_at_any_moment(tmp_path: Path, old_cube: bytes) -> None:
    """Kills spread over a whole write: under the name stands the old cube, byte for byte, or the new one, whole."""
    path = tmp_path / "c.nc"
    begun = time.monotonic()
    assert ended_by(start_writer(tmp_path / "other.nc")) == 0
    whole = time.monotonic() - begun
    killed = 0
    for fraction in np.linspace(0.02, 1.0, 10):
        path.write_bytes(old_cube)
        process = start_writer(path)
        time.sleep(whole * fraction)
        os.kill(process, signal.SIGKILL)
        killed += ended_by(process) == signal.SIGKILL
        if path.read_bytes() != old_cube:
            check_whole(path)
    assert killed > 0


def check_whole(path: Path) -> None:
    """The cube at `path` is that of `synthetic.several`, complete."""
    made = synthetic.several()
    with open_cube(path) as tree:
        found = grids(tree)
        assert len(case_table(tree)) == len(made.results)
        for case, result in made.results:
            at = dict(zip(case_dims(found[case.grid]), case.index, strict=True))
            np.testing.assert_array_equal(found[case.grid]["pressure"].isel(at), result.fields["pressure"])


def test_leftovers_of_the_living_and_of_others_stay(tmp_path: Path) -> None:
    target = tmp_path / "c.nc"
    with replacing(target) as temporary:
        host = temporary.name.removeprefix("c.nc.tmp-").rsplit("-", 2)[0]
        temporary.write_bytes(b"first")
        assert publish.remove_leftovers(tmp_path) == []  # it is in use
        names = {
            "living": f"c.nc.tmp-{host}-{os.getppid()}-1",
            "elsewhere": "c.nc.tmp-elsewhere-99999999-1",
            "in another container": f"c.nc.tmp-{socket.gethostname()}-1-99999999-1",
            "of another cube": f"d.nc.tmp-{host}-99999999-1",
            "no temporary name": "c.nc.tmp-mine",
        }
        for name in names.values():
            (tmp_path / name).write_bytes(b"")
        dead = tmp_path / f"c.nc.tmp-{host}-99999999-1"
        dead.write_bytes(b"")
        none = tmp_path / f"c.nc.tmp-{host}-{10**25}-1"  # no process has such a number
        none.write_bytes(b"")
        earlier = tmp_path / f"c.nc.tmp-{host}-{os.getpid()}-0"  # the number of a process before this one
        earlier.write_bytes(b"")
    with replacing(target) as temporary:
        temporary.write_bytes(b"second")
        assert not [path for path in (dead, none, earlier) if path.exists()]
    assert target.read_bytes() == b"second"
    for what, name in names.items():
        assert (tmp_path / name).exists(), what


def test_leftovers_of_all_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no name is asked for. A process that belongs to somebody else cannot be asked, but runs."""

    def not_permitted(pid: int, signal: int) -> None:
        raise PermissionError

    left = {tmp_path / f"{name}.tmp-{publish.host()}-99999999-1" for name in ("c.nc", "d.nc")}
    for path in left:
        path.touch()
    with monkeypatch.context() as patched:
        patched.setattr(publish.os, "kill", not_permitted)
        assert publish.remove_leftovers(tmp_path) == []
    assert set(publish.remove_leftovers(tmp_path)) == left
    assert not any(tmp_path.iterdir())


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    link = tmp_path / "c.nc"
    link.symlink_to(tmp_path / "data" / "real.nc")
    with replacing(link) as temporary:
        temporary.write_bytes(b"new")
    assert link.is_symlink()
    assert (tmp_path / "data" / "real.nc").read_bytes() == b"new"


def test_folders_are_made(tmp_path: Path) -> None:
    with replacing(tmp_path / "one" / "in another" / "c.nc") as temporary:
        temporary.write_bytes(b"new")
    assert (tmp_path / "one" / "in another" / "c.nc").read_bytes() == b"new"


def test_places_that_cannot_be_written_to(tmp_path: Path) -> None:
    made = synthetic.small()
    asked = []

    def results() -> Iterator:
        asked.append(True)
        yield from made.results

    (tmp_path / "file").write_text("")
    (tmp_path / "folder").mkdir()
    for path in (tmp_path / "file" / "c.nc", tmp_path / "folder"):
        with pytest.raises(UserError, match=path.name):
            write_cube(path, made.study, made.expansion, results(), {})
    assert not asked, "nothing may be computed for a cube that cannot be written"


def test_a_full_disk_leaves_the_old_cube(tmp_path: Path) -> None:
    path = synthetic.write(tmp_path / "c.nc", synthetic.small())
    before = path.read_bytes()
    code = (
        "import resource, signal, sys\n"
        "sys.path.insert(0, sys.argv[1])\n"
        "import synthetic\n"
        "from pathlib import Path\n"
        "from rcstudy.errors import UserError\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[3]), int(sys.argv[3])))\n"
        "try:\n"
        "    synthetic.write(Path(sys.argv[2]), synthetic.several())\n"
        "except UserError as error:\n"
        "    assert 'c.nc: cannot be written' in str(error), error\n"
        "    sys.exit(7)\n"
    )
    for limit in (0, 150_000):
        command = [sys.executable, "-c", code, str(TESTS), str(path), str(limit)]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (7, "")
        assert path.read_bytes() == before
        assert leftovers(tmp_path) == []


def test_an_interrupt_leaves_the_old_cube(tmp_path: Path) -> None:
    made = synthetic.small()
    path = synthetic.write(tmp_path / "c.nc", made)
    before = path.read_bytes()

    def results() -> Iterator:
        yield from made.results[:3]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_cube(path, made.study, made.expansion, results(), {})
    assert path.read_bytes() == before
    assert leftovers(tmp_path) == []


def test_an_interrupt_inside_hdf5_waits_for_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C while HDF5 writes through Python code: seen once the write is over, and nothing is broken by it."""
    made = synthetic.small()
    path = synthetic.write(tmp_path / "c.nc", made)
    before = path.read_bytes()
    write, calls = SteadyFile.write, []

    def interrupted(self: SteadyFile, data: memoryview) -> int:
        calls.append(len(data))
        if len(calls) % 5 == 0:
            os.kill(os.getpid(), signal.SIGINT)
        return write(self, data)

    monkeypatch.setattr(SteadyFile, "write", interrupted)
    with pytest.raises(KeyboardInterrupt):
        synthetic.write(path, made)
    assert len(calls) > 5
    monkeypatch.undo()
    assert path.read_bytes() == before
    assert leftovers(tmp_path) == []


def test_an_interrupt_while_hdf5_makes_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """The file was left open, and written to when it was collected, after what it is stored in had been closed."""
    made = synthetic.small()
    file = h5py.File

    def interrupted(*arguments: object) -> h5py.File:
        found = file(*arguments)
        os.kill(os.getpid(), signal.SIGINT)
        return found

    monkeypatch.setattr(cube_writer.h5py, "File", interrupted)
    with pytest.raises(KeyboardInterrupt) as interrupt:
        synthetic.write(tmp_path / "c.nc", made)
    del interrupt
    gc.collect()
    assert capfd.readouterr().err == ""
    assert list(tmp_path.iterdir()) == []


def test_a_file_whose_writes_fail_reads_back_what_was_written(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    steady, plain = SteadyFile(tmp_path / "steady"), io.BytesIO()

    def both(action: str, *arguments: object) -> None:
        assert getattr(steady, action)(*arguments) == getattr(plain, action)(*arguments), action

    def some() -> None:
        for _ in range(60):
            for action, argument in (
                ("seek", int(rng.integers(0, 900))),
                ("write", rng.bytes(int(rng.integers(1, 90)))),
            ):
                both(action, argument)
            both("seek", int(rng.integers(0, 400)))
            both("read", int(rng.integers(0, 500)))
            both("tell")
        for offset, whence in ((-9, os.SEEK_END), (4, os.SEEK_CUR), (50, os.SEEK_END)):  # to beyond the end
            both("seek", offset, whence)
            both("read", 30)
            both("tell")

    with steady:
        some()
        both("truncate", 700)
        steady.check()
        before = (tmp_path / "steady").read_bytes()
        os.close(steady._file.fileno())
        replacement = os.open(tmp_path / "steady", os.O_RDONLY)  # writes to it fail
        assert replacement == steady._file.fileno()
        some()
        both("seek", 0)
        both("read", 2000)
        both("seek", 0)
        filled, other = bytearray(b"x" * 2000), bytearray(b"x" * 2000)
        assert steady.readinto(memoryview(filled)) == plain.readinto(other)
        assert filled == other
        for action, argument in (("truncate", 800), ("seek", 950), ("write", b"end"), ("seek", 0), ("read", 2000)):
            both(action, argument)
        with pytest.raises(OSError, match="descriptor"):
            steady.check()
    assert (tmp_path / "steady").read_bytes() == before


class Grudging(io.FileIO):
    """A file that takes seven bytes at a time, as long as there is room."""

    room = 1000

    def write(self, data: Any) -> int:
        if not self.room:
            raise OSError(errno.ENOSPC, "full")
        taken = super().write(memoryview(data)[: min(7, self.room)])
        self.room -= taken
        return taken

    def truncate(self, size: int | None = None) -> int:
        raise OSError(errno.EIO, "not that")


def test_a_file_that_is_written_in_parts(tmp_path: Path) -> None:
    """What was written before the disk was full is not kept in memory, and all is read back."""
    data = bytes(range(100))
    with SteadyFile(tmp_path / "steady") as steady:
        steady._file.close()
        file = steady._file = Grudging(tmp_path / "steady", "w+b")
        steady.write(data[:40])
        steady.check()
        assert (tmp_path / "steady").read_bytes() == data[:40]
        file.room = 25
        steady.write(data[40:])
        steady.seek(0)
        assert steady.read(200) == data
        assert (tmp_path / "steady").read_bytes() == data[:65]
        with pytest.raises(OSError, match="full"):
            steady.check()


def test_a_file_that_cannot_be_cut(tmp_path: Path) -> None:
    with SteadyFile(tmp_path / "steady") as steady:
        steady._file.close()
        steady._file = Grudging(tmp_path / "steady", "w+b")
        steady.write(bytes(range(40)))
        steady.truncate(20)
        steady.seek(0)
        assert steady.read(200) == bytes(range(20))
        with pytest.raises(OSError, match="not that"):
            steady.check()


def test_results_are_taken_one_at_a_time(tmp_path: Path) -> None:
    """The writer keeps no fields: a result's arrays are gone once the next one is asked for."""
    import weakref

    mesh = Mesh((2.0, 2.0), (16, 16))
    grid = synthetic.make_grid("many", synthetic.number_axis("load", list(np.linspace(50, 100, 20)), "N"))
    cases = synthetic.grid_cases(grid, replace(synthetic.SCENE, mesh=mesh))
    study = SimpleNamespace(**vars(synthetic.make_study()))
    alive: list[weakref.ref] = []

    def results() -> Iterator:
        for case in cases:
            assert sum(ref() is not None for ref in alive) <= 1
            result = synthetic.made_up_result(case.scene)
            alive.append(weakref.ref(result.fields["pressure"]))
            yield case, result
            del result

    expansion = synthetic.assemble(study, (grid, cases)).expansion
    write_cube(tmp_path / "c.nc", study, expansion, results(), {})
    assert len(alive) == 20


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_fill_values_are_of_their_variables_types(tmp_path: Path, precision: str) -> None:
    """As netCDF asks."""
    path = synthetic.write(tmp_path / "c.nc", synthetic.small(precision=precision))
    with h5py.File(path) as file:
        filled = {name: node for name, node in file.items() if "_FillValue" in node.attrs}
        assert "pressure" in filled
        assert {name: node.attrs["_FillValue"].dtype for name, node in filled.items()} == {
            name: node.dtype for name, node in filled.items()
        }
