"""Compilation of kernels by Numba: its flags, and a cache on disk that several processes can share.

``fastmath`` and ``parallel`` stay off: they change the last bits of results, and active sets amplify such changes.
``cache`` keeps the machine code between processes. Numba recompiles a kernel only if its own file has changed; kernels
never call kernels in another file, so an edited callee cannot leave a stale caller in the cache. Numba does not check
its cache files. Here each has a checksum, and a damaged file counts as missing; a file that cannot be written is left
out. Code made with other flags, other settings of Numba (NUMBA_OPT) or by another llvmlite counts as missing, too,
which Numba does not see to. If several processes miss the same kernel, one compiles it and the others wait. Where Numba
finds no folder that can be written to, every process compiles what it needs, and says so.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import logging
import os
import pickle
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.runtime import rtsys

from rcstudy.mechanics.collecting import nothing_collected

log = logging.getLogger("rcstudy")

F = TypeVar("F", bound=Callable[..., Any])
_DIGEST = hashlib.sha256().digest_size
_FORMAT = b"2"  # part of the checksum: files that other versions of this module have written otherwise count as damaged
_PATIENCE = 60.0  # seconds to wait for another process to compile a kernel, before compiling it here as well
_POLL_SECONDS = 0.1  # seconds between two attempts to load it meanwhile
_FLAGS: dict[str, Any] = {"nogil": True, "fastmath": False, "error_model": "numpy"}
# Numba's settings that change machine code, as the environment variables NUMBA_... have them
_SETTINGS = ("OPT", "BOUNDSCHECK", "DEBUGINFO_DEFAULT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "USING_SVML")


class _CompileLock:
    """A lock on the compilation of kernels cached in `folder`: one process at a time holds it.

    Compiling a kernel includes compiling the kernels that it calls, so the lock is re-entrant: a process may take it
    several times, and has to give it back as often.
    """

    def __init__(self, folder: str) -> None:
        self._path = Path(folder) / "compiling.lock"
        self._depth = 0
        self._file = -1

    def take(self) -> bool:
        """Take the lock; False if another process holds it. Where there are no file locks, all processes get it."""
        if self._depth == 0:
            try:
                import fcntl  # not available on every system

                self._path.parent.mkdir(parents=True, exist_ok=True)
                self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                self._close()
                return False
            except (ImportError, OSError):
                self._close()
        self._depth += 1
        return True

    def give_back(self) -> None:
        """Undo one `take`, if there was one; the system releases the lock of a process that ends."""
        self._depth = max(0, self._depth - 1)
        if self._depth == 0:
            self._close()

    def _close(self) -> None:
        if self._file >= 0:
            os.close(self._file)
        self._file = -1


_locks: dict[str, _CompileLock] = {}


class _CheckedFiles(IndexDataCacheFile):
    """Cache files of a kernel, an index and the machine code for each signature, each with its SHA-256 at the end."""

    _taken = 0  # how often the lock was taken for this kernel and not yet given back

    def load(self, key: Any) -> Any:
        """What was saved under `key`; None if there is nothing intact, and this process has to compile the kernel.

        It then holds the lock, unless it waited `_PATIENCE` seconds in vain. Numba compiles and saves what it could not
        load, at once and in the same thread; `give_back` is called when that has succeeded or failed.
        """
        found = self._loaded(key)
        if found is not None:
            return found
        turn, until = self._turn(), time.monotonic() + _PATIENCE
        while not (taken := turn.take()) and time.monotonic() < until:
            time.sleep(_POLL_SECONDS)
            found = self._loaded(key)
            if found is not None:
                return found
        self._taken += taken
        return self._loaded(key)  # another process may have saved it just before this one got the lock

    def save(self, key: Any, data: Any) -> None:
        """Save `data` under `key`. If that fails it is left out, and the next process compiles the kernel again."""
        with contextlib.suppress(OSError):
            super().save(key, (*self._of(key), data))

    def give_back(self) -> None:
        """Give the lock back as often as it was taken for this kernel."""
        while self._taken > 0:
            self._taken -= 1
            self._turn().give_back()

    def _turn(self) -> _CompileLock:
        return _locks.setdefault(self._cache_path, _CompileLock(self._cache_path))

    def _of(self, key: Any) -> tuple[Any, ...]:
        """What machine code is of; it stands in the file with it, as Numba writes the index first.

        Until the code is written, for ever if that fails (a full disk), the index names a file of an earlier version.
        """
        return self._version, self._source_stamp, key

    def _loaded(self, key: Any) -> Any:
        try:
            *found, data = super().load(key)
        except Exception:  # nothing is found; files of another version may make pickle raise anything
            return None
        return data if tuple(found) == self._of(key) else None

    def _load_index(self) -> Any:
        try:
            stamp, overloads = pickle.loads(_checked(self._index_path))
        except Exception:
            return {}
        return overloads if stamp == (self._version, self._source_stamp) else {}

    def _save_index(self, overloads: Any) -> None:
        self._write(self._index_path, ((self._version, self._source_stamp), overloads))

    def _load_data(self, name: str) -> Any:
        return pickle.loads(_checked(self._data_path(name)))

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), data)

    def _write(self, path: str, content: Any) -> None:
        data = self._dump(content)
        with self._open_for_write(path) as file:
            file.write(data + _checksum(data))


def _checksum(data: bytes) -> bytes:
    return hashlib.sha256(_FORMAT + data).digest()


def _checked(path: str) -> bytes:
    """The content of a file without the checksum at its end. Raises OSError if the checksum does not match."""
    content = Path(path).read_bytes()
    if _checksum(content[:-_DIGEST]) != content[-_DIGEST:]:
        raise OSError(f"{path}: damaged")
    return content[:-_DIGEST]


class _Quick(FunctionCache):
    """Numba's cache of a function, but kernels are loaded without importing the compiler, which takes 0.25 s."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The machine code for a signature; None if there is none, and Numba then initialises its compiler itself."""
        rtsys.initialize(target_context)  # the runtime that counts references to arrays made in kernels
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


class _Clock:
    """Time that this process has spent on loading and compiling kernels (s), including those that kernels call."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self._depth = 0

    @contextlib.contextmanager
    def running(self) -> Iterator[None]:
        """Count the time in the block, once if blocks are nested."""
        begun = time.perf_counter()
        self._depth += 1
        try:
            yield
        finally:
            self._depth -= 1
            if self._depth == 0:
                self.seconds += time.perf_counter() - begun


_clock = _Clock()


def seconds_of_compiling() -> float:
    """Wall time (s) that this process has spent so far on loading or compiling kernels: no part of any solve."""
    return _clock.seconds


def _in_turn(compiling: Callable[[Any], Any], files: _CheckedFiles | None) -> Callable[[Any], Any]:
    """A version of `compiling`, which loads a kernel from `files` or compiles it, that gives the lock back at its end.

    Saving is not the place to do so: it is not reached if compiling is interrupted, and all other processes would then
    wait for this one. The time is counted (`seconds_of_compiling`), and no garbage is collected meanwhile.
    """

    def compiling_in_turn(signature: Any) -> Any:
        try:
            with _clock.running(), nothing_collected():
                return compiling(signature)
        finally:
            if files is not None:
                files.give_back()

    return compiling_in_turn


@functools.cache
def _tell_that_nothing_is_kept() -> None:
    """Warn, once in a process, that it has to compile all kernels that it needs."""
    log.warning(
        "compiled kernels cannot be kept, so each process compiles them, which takes up to a minute: "
        "set NUMBA_CACHE_DIR to a folder that can be written to"
    )


def jit(function: F) -> F:
    """Compile `function` in nopython mode, cached on disk, with strict IEEE arithmetic, releasing the GIL."""
    try:
        compiled: Any = numba.njit(cache=True, **_FLAGS)(function)
    except RuntimeError:  # neither NUMBA_CACHE_DIR nor the package's folder nor the user's can be written to
        _tell_that_nothing_is_kept()
        compiled = numba.njit(**_FLAGS)(function)
    cache = getattr(compiled, "_cache", None)
    if type(cache) is FunctionCache:
        cache.__class__ = _Quick
    files = getattr(cache, "_cache_file", None)
    if type(files) is IndexDataCacheFile:
        files.__class__ = _CheckedFiles
        settings = [getattr(numba.config, name, None) for name in _SETTINGS]
        llvmlite = sys.modules["llvmlite"].__version__  # Numba has imported it, and takes any of a series
        files._version = repr((files._version, llvmlite, sorted(_FLAGS.items()), settings))
    if hasattr(compiled, "compile"):  # not with the JIT disabled
        compiled.compile = _in_turn(compiled.compile, files if isinstance(files, _CheckedFiles) else None)
    return cast(F, compiled)
