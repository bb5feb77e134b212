"""The one place that states the Numba flags.

``fastmath`` and ``parallel`` stay off: they change last bits, and active sets amplify them. ``cache`` keeps the
machine code between processes; all kernels live in a package whose files do not call each other, so an edited callee
can never leave a stale caller behind. Numba trusts its files; here each has a checksum, and one that was damaged, or
cannot be written, is as good as none.
"""

from __future__ import annotations

import contextlib
import hashlib
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from rcstudy.mechanics.later import put_off

# no kernel calls BLAS; numba looks for scipy's, which takes a tenth of a second to load, when it loads the first kernel
with put_off("scipy.linalg.cython_blas"):
    import numba
    import numba.np.arraymath
    from numba.core.caching import IndexDataCacheFile

F = TypeVar("F", bound=Callable[..., Any])
_DIGEST = hashlib.sha256().digest_size


class _CheckedFiles(IndexDataCacheFile):
    """A kernel's files on the disk, an index and machine code for each signature, with their SHA-256 at their ends."""

    def load(self, key: Any) -> Any:
        """What was saved under `key`; None if there is nothing, or nothing whole."""
        try:
            return super().load(key)
        except Exception:  # whatever pickle makes of files of another version
            return None

    def save(self, key: Any, data: Any) -> None:
        """Save, unless that fails: then the next process compiles once more."""
        with contextlib.suppress(OSError):
            super().save(key, data)

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


def jit(function: F) -> F:
    """Compile `function` in nopython mode, cached on disk, with strict IEEE arithmetic, releasing the GIL."""
    compiled = numba.njit(cache=True, nogil=True, fastmath=False, error_model="numpy")(function)
    files = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if type(files) is IndexDataCacheFile:
        files.__class__ = _CheckedFiles
    return cast(F, compiled)
