"""Kernels on the disk: several processes that miss one do not all compile it."""

import errno
import gc
import multiprocessing
import os
import subprocess
import sys
import time

import numba
import pytest

from rcstudy.mechanics import jit

compiled = pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")

KERNELS = """
import os, sys, time
import numpy as np
from rcstudy.mechanics.kernels.arrays import bounds, norm2, unfold
open(sys.argv[1] + str(os.getpid()), "w").close()
while len(os.listdir(os.path.dirname(sys.argv[1]))) < int(sys.argv[2]):
    time.sleep(0.001)  # all begin at once
assert norm2(np.ones((2, 2))) == 2.0
assert bounds(np.ones((2, 3), dtype=bool)) == (0, 2, 0, 3)
print(*(sum(kernel.stats.cache_misses.values()) for kernel in (norm2, bounds)))
"""


@compiled
def test_processes_that_start_together_compile_each_kernel_once(tmp_path):
    here = tmp_path / "here"
    here.mkdir()
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    command = [sys.executable, "-c", KERNELS, f"{here}{os.sep}", "3"]
    processes = [subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) for _ in range(3)]
    misses = [process.communicate(timeout=120)[0].split() for process in processes]
    assert [process.returncode for process in processes] == [0, 0, 0]
    assert [sum(int(of[k]) for of in misses) for k in (0, 1)] == [1, 1]


def hold(folder, pipe):
    assert jit._CompileLock(folder).take()
    pipe.send("taken")
    pipe.recv()


@pytest.fixture
def holder(tmp_path):
    """A process that has its turn."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=hold, args=(str(tmp_path), theirs))
    process.start()
    assert ours.recv() == "taken"
    yield process
    process.kill()
    process.join()


def test_a_process_that_is_killed_loses_its_turn(tmp_path, holder):
    turn = jit._CompileLock(str(tmp_path))
    assert not turn.take()
    holder.kill()
    holder.join()
    assert turn.take()
    turn.give_back()


def test_a_kernel_that_another_process_takes_too_long_for_is_compiled(tmp_path, holder, monkeypatch):
    files = jit._CheckedFiles(str(tmp_path), "kernel", 0)
    monkeypatch.setattr(jit, "_PATIENCE", 0.2)
    begun = time.monotonic()
    assert files.load("signature") is None  # Numba then compiles
    assert time.monotonic() - begun >= 0.2
    files.save("signature", "machine code")
    assert files.load("signature") == "machine code"
    assert holder.is_alive()


def test_machine_code_of_an_earlier_version_is_never_taken_for_that_of_the_index(tmp_path, monkeypatch):
    """Numba writes the index first: on a disk that was full then, later runs took the file of the version before."""

    def failing(*_):
        raise OSError(errno.ENOSPC, "full")

    for stamp, version in ((2, numba.__version__), (1, "0.1")):
        earlier = jit._CheckedFiles(str(tmp_path), "kernel", 1)
        earlier.save("signature", "earlier code")
        now = jit._CheckedFiles(str(tmp_path), "kernel", stamp)
        now._version = version
        with monkeypatch.context() as full:
            full.setattr(now, "_save_data", failing)
            now.save("signature", "code")
        assert now.load("signature") is None
        now.give_back()
        now.save("signature", "code")
        assert now.load("signature") == "code"
        assert earlier.load("signature") is None
        earlier.give_back()
        now._save_index({"another signature": now._load_index()["signature"]})  # two processes saved at once
        assert now.load("another signature") is None
        now.give_back()


MADE = """
import sys
import numpy as np
from rcstudy.mechanics import jit
jit._FLAGS.update(fastmath="fastmath" in sys.argv)
if "llvmlite" in sys.argv:
    sys.modules["llvmlite"].__version__ = "0.1"
from rcstudy.mechanics.kernels.arrays import norm2
assert norm2(np.ones((2, 2))) == 2.0
print(sum(norm2.stats.cache_misses.values()))
"""


@compiled
def test_machine_code_that_was_made_otherwise_is_compiled_anew(tmp_path):
    """With NUMBA_OPT=0, once, all later runs took seven times as long; trying fastmath left its rounding behind."""
    misses = []
    for arguments, settings in (
        ([], {}),
        ([], {}),
        (["fastmath"], {}),
        (["llvmlite"], {}),
        ([], {}),
        ([], {"NUMBA_OPT": "0"}),
        ([], {}),
        ([], {"NUMBA_BOUNDSCHECK": "1"}),
        ([], {"NUMBA_DEBUGINFO": "1"}),
    ):
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), **settings}
        command = [sys.executable, "-c", MADE, *arguments]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=120)
        misses.append(int(done.stdout))
    assert misses == [1, 0, 1, 1, 1, 1, 1, 1, 1]


def test_a_turn_is_held_until_it_has_been_given_back_as_often_as_taken(tmp_path):
    outer, other = jit._CompileLock(str(tmp_path)), jit._CompileLock(str(tmp_path))
    assert outer.take()
    assert outer.take()
    outer.give_back()
    assert not other.take()
    other.give_back()  # what it has not
    assert not other.take()
    outer.give_back()
    assert other.take()
    assert not outer.take()
    other.give_back()


FAILS = """
import numpy as np
import pytest
from numba.core import caching, event
from rcstudy.mechanics import jit
from rcstudy.mechanics.kernels.arrays import bounds, norm2

class Interrupt(event.Listener):
    def on_start(self, event):
        raise KeyboardInterrupt

    def on_end(self, event):
        pass

with event.install_listener("numba:compile", Interrupt()), pytest.raises(KeyboardInterrupt):
    norm2(np.ones((2, 2)))
[turn] = jit._locks.values()
other = jit._CompileLock(turn._path.parent)
assert other.take()
other.give_back()
check, caching.CompileResultCacheImpl.check_cachable = caching.CompileResultCacheImpl.check_cachable, lambda *_: False
assert norm2(np.ones((2, 2))) == 2.0  # compiled and not saved
caching.CompileResultCacheImpl.check_cachable = check
assert other.take()
other.give_back()
assert bounds(np.ones((2, 3), dtype=bool)) == (0, 2, 0, 3)
assert sum(bounds.stats.cache_misses.values()) == 1
"""


@compiled
def test_a_process_that_fails_to_compile_or_save_a_kernel_gives_its_turn_back(tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", FAILS], env=environment, check=True, timeout=120)


def test_everyone_has_a_turn_where_nothing_can_be_written(tmp_path):
    (tmp_path / "cache").write_text("a file")
    assert jit._CompileLock(str(tmp_path / "cache")).take()
    assert jit._CompileLock(str(tmp_path / "cache")).take()


NOTHING_TO_WRITE_TO = """
import numpy as np
from numba.core import caching

caching.CompileResultCacheImpl._locator_classes = []
from rcstudy.mechanics.jit import seconds_of_compiling
from rcstudy.mechanics.kernels.arrays import bounds, norm2

assert seconds_of_compiling() == 0.0
assert norm2(np.ones((2, 2))) == 2.0
first = seconds_of_compiling()
assert first > 0.0
assert norm2(np.ones((2, 2))) == 2.0
assert seconds_of_compiling() == first
assert bounds(np.ones((2, 3), dtype=bool)) == (0, 2, 0, 3)
"""


@compiled
def test_kernels_are_compiled_where_they_cannot_be_kept_and_that_is_told_once():
    """In a container without a home, from a package that only root may write to, every sweep ended in a traceback."""
    done = subprocess.run(
        [sys.executable, "-c", NOTHING_TO_WRITE_TO], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    (line,) = done.stderr.splitlines()
    assert line.startswith("compiled kernels cannot be kept") and "NUMBA_CACHE_DIR" in line


def test_time_of_kernels_that_kernels_call_counts_once(monkeypatch):
    clock, now = jit._Clock(), iter([1.0, 2.0, 7.0, 20.0, 23.0])
    monkeypatch.setattr(jit.time, "perf_counter", lambda: next(now))
    with clock.running(), clock.running():  # from 1 and, within that, from 2
        pass
    assert clock.seconds == 6.0
    with clock.running():
        pass
    assert clock.seconds == 9.0


def test_no_garbage_is_collected_while_a_kernel_is_compiled():
    """But afterwards as before, also where a kernel that it calls is compiled meanwhile or compiling fails."""
    seen = []

    def failing(signature):
        seen.append(gc.isenabled())
        raise ValueError(signature)

    def calling(signature):
        with pytest.raises(ValueError, match="inner"):
            jit._in_turn(failing, None)("inner")
        seen.append(gc.isenabled())
        return signature

    assert gc.isenabled()
    assert jit._in_turn(calling, None)("outer") == "outer"
    assert (seen, gc.isenabled()) == ([False, False], True)
    gc.disable()
    try:
        jit._in_turn(calling, None)("outer")
        assert not gc.isenabled()
    finally:
        gc.enable()
