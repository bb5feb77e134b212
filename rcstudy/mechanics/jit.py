"""The one place that states the Numba flags.

``fastmath`` and ``parallel`` stay off: they change last bits, and active sets amplify them. ``cache`` keeps the
machine code between processes; all kernels live in a package whose files do not call each other, so an edited callee
can never leave a stale caller behind. Numba trusts its files; here each has a checksum, and one that was damaged, or
cannot be written, is as good as none. Processes that miss the same kernel do not all compile it: one does, the others
wait for it.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.runtime import rtsys

F = TypeVar("F", bound=Callable[..., Any])
_DIGEST = hashlib.sha256().digest_size
_PATIENCE = 60.0  # seconds to wait for another process to compile a kernel, before doing so as well
_LOOK = 0.1  # seconds between two looks for it


class _Turn:
    """The right to compile kernels kept in a folder: of one process at a time.

    A kernel that calls another one is compiled around it, so the right is taken and given back in layers.
    """

    def __init__(self, folder: str) -> None:
        self._path = Path(folder) / "compiling.lock"
        self._depth = 0
        self._file = -1

    def take(self) -> bool:
        """Take it, unless another process has it; where no such rights can be kept everyone has it."""
        if self._depth == 0:
            try:
                import fcntl  # not on every system

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
        """Let others have it, if it was taken; the system does so when a process ends."""
        self._depth = max(0, self._depth - 1)
        if self._depth == 0:
            self._close()

    def _close(self) -> None:
        if self._file >= 0:
            os.close(self._file)
        self._file = -1


_turns: dict[str, _Turn] = {}


class _CheckedFiles(IndexDataCacheFile):
    """A kernel's files on the disk, an index and machine code for each signature, with their SHA-256 at their ends."""

    _taken = 0  # turns for this kernel that were not given back yet

    def load(self, key: Any) -> Any:
        """What was saved under `key`; None if there is nothing, or nothing whole: then it is this process's to compile.

        Numba compiles and saves what it could not load, at once and in one thread; `give_back` is for when it has, or
        has failed to.
        """
        found = self._loaded(key)
        if found is not None:
            return found
        turn, until = self._turn(), time.monotonic() + _PATIENCE
        while not (taken := turn.take()) and time.monotonic() < until:
            time.sleep(_LOOK)
            found = self._loaded(key)
            if found is not None:
                return found
        self._taken += taken
        return self._loaded(key)  # somebody may have saved it just before this process had its turn

    def save(self, key: Any, data: Any) -> None:
        """Save, unless that fails: then the next process compiles once more."""
        with contextlib.suppress(OSError):
            super().save(key, data)

    def give_back(self) -> None:
        """Give back the turns that were taken for this kernel."""
        while self._taken > 0:
            self._taken -= 1
            self._turn().give_back()

    def _turn(self) -> _Turn:
        return _turns.setdefault(self._cache_path, _Turn(self._cache_path))

    def _loaded(self, key: Any) -> Any:
        try:
            return super().load(key)
        except Exception:  # whatever pickle makes of files of another version
            return None

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
            file.write(data + hashlib.sha256(data).digest())


def _checked(path: str) -> bytes:
    """The bytes of a file before its checksum. Raises OSError if that does not match."""
    content = Path(path).read_bytes()
    if hashlib.sha256(content[:-_DIGEST]).digest() != content[-_DIGEST:]:
        raise OSError(f"{path}: damaged")
    return content[:-_DIGEST]


class _Quick(FunctionCache):
    """Loads kernels without all that Numba would need to compile them, a quarter of a second's worth of modules."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The machine code for a signature; None if there is none, and Numba makes itself ready to compile."""
        rtsys.initialize(target_context)  # counts references to arrays that kernels make
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


def _in_turn(compiling: Callable[[Any], Any], files: _CheckedFiles) -> Callable[[Any], Any]:
    """`compiling`, which loads a kernel from `files` or compiles it; the turn taken for that ends with it.

    Not with saving: that is not reached if compiling is interrupted, and all others would wait for this process.
    """

    def compiling_in_turn(signature: Any) -> Any:
        try:
            return compiling(signature)
        finally:
            files.give_back()

    return compiling_in_turn


def jit(function: F) -> F:
    """Compile `function` in nopython mode, cached on disk, with strict IEEE arithmetic, releasing the GIL."""
    compiled: Any = numba.njit(cache=True, nogil=True, fastmath=False, error_model="numpy")(function)
    cache = getattr(compiled, "_cache", None)
    if type(cache) is FunctionCache:
        cache.__class__ = _Quick
    files = getattr(cache, "_cache_file", None)
    if type(files) is IndexDataCacheFile:
        files.__class__ = _CheckedFiles
        compiled.compile = _in_turn(compiled.compile, cast(_CheckedFiles, files))
    return cast(F, compiled)
