"""Protection of HDF5 against failed writes and interrupts.

After a failed write HDF5 keeps the data, tries to write them again at every later step, and finally crashes the
process. It is therefore given a file whose writes never fail and which reports the failure when `check` is called.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any, Self

_TOGETHER = 2**20  # bytes that are collected before they are written
_AGAIN_SECONDS = 0.02  # delay before an interrupt that came during code of llvmlite is repeated


class SteadyFile:
    """A new file at `path`, to be passed to h5py in place of a name.

    HDF5 writes little at a time, so consecutive writes are combined. After a first error (disk full, quota, lost mount)
    all data go to memory and are read back from there, so that HDF5 finds its file as it left it; :meth:`check` raises
    that error. It should be called often, as the memory is not limited.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("w+b", buffering=0)
        self._position = 0
        self._size = 0
        self._error: OSError | None = None
        self._kept: list[tuple[int, bytes]] = []
        self._waiting = bytearray()  # not written yet, at _waiting_at
        self._waiting_at = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._write_waiting()
        self._file.close()

    def check(self) -> None:
        """Raise the OSError of the first write that failed, if one has."""
        self._write_waiting()
        if self._error is not None:
            raise self._error

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a position."""
        if whence != os.SEEK_SET:  # HDF5, which calls this thousands of times a second, never does so
            offset += self._position if whence == os.SEEK_CUR else self._size
        self._position = offset
        return offset

    def tell(self) -> int:
        """The position."""
        return self._position

    def read(self, size: int) -> bytes:
        """Read up to `size` bytes at the position."""
        buffer = bytearray(size)
        return bytes(buffer[: self.readinto(memoryview(buffer))])

    def readinto(self, buffer: memoryview) -> int:
        """Fill `buffer` from the position; returns the number of bytes read."""
        self._write_waiting()
        start, size = self._position, max(0, min(len(buffer), self._size - self._position))
        done = 0
        while done < size:
            self._file.seek(start + done)
            count = self._file.readinto(buffer[done:size])
            if not count:
                break
            done += count
        buffer[done:size] = bytes(size - done)
        for offset, data in self._kept:
            low, high = max(offset, start), min(offset + len(data), start + size)
            if low < high:
                buffer[low - start : high - start] = data[low - offset : high - offset]
        self._position += size
        return size

    def write(self, data: memoryview | bytes) -> int:
        """Write `data` at the position and return the number of bytes; never fails."""
        if self._position != self._waiting_at + len(self._waiting) or len(self._waiting) >= _TOGETHER:
            self._write_waiting()
            self._waiting_at = self._position
        self._waiting += data
        size = self._waiting_at + len(self._waiting) - self._position
        self._position += size
        if self._position > self._size:
            self._size = self._position
        return size

    def _write_waiting(self) -> None:
        """Write the collected bytes to the file; never fails."""
        size, done = len(self._waiting), 0
        if not size:
            return
        if self._error is None:
            try:
                while done < size:
                    self._file.seek(self._waiting_at + done)
                    done += self._file.write(self._waiting[done:] if done else self._waiting)
            except OSError as error:
                self._error = error
        if done < size:
            self._kept.append((self._waiting_at + done, bytes(self._waiting[done:])))
        self._waiting = bytearray()

    def truncate(self, size: int) -> int:
        """Make the file `size` bytes long."""
        self._write_waiting()
        if self._error is None:
            try:
                self._file.truncate(size)
            except OSError as error:
                self._error = error
        self._kept = [(offset, data[: size - offset]) for offset, data in self._kept if offset < size]
        self._size = size
        return size

    def flush(self) -> None:
        """Write the collected bytes to the file."""
        self._write_waiting()


def _leading() -> tuple[int, Callable[[int, FrameType | None], Any]] | None:
    """The signal that interrupts and its handler: Ctrl-C's or, where that is ignored, that of the first other one.

    All others call this handler (`heed_terminations` of the command). None where nothing is interrupted: in a thread
    other than the main one, and without any handler in Python.
    """
    if threading.current_thread() is not threading.main_thread():
        return None
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if callable(handler := signal.getsignal(number)):
            return number, handler
    return None


@contextlib.contextmanager
def interrupts_held() -> Iterator[None]:
    """Delay interrupts until the block ends: Python code called by HDF5 must not raise."""
    leading = _leading()
    if leading is None:
        yield
        return
    number, before = leading
    held: list[FrameType | None] = []
    signal.signal(number, lambda _, frame: held.append(frame))
    try:
        yield
    finally:
        signal.signal(number, before)
        if held:
            before(number, held[0])


@contextlib.contextmanager
def interrupts_remembered() -> Iterator[Callable[[], None]]:
    """Yield a function that raises KeyboardInterrupt again if one raised by a signal in the block was lost.

    Python drops exceptions raised inside weakref callbacks, finalizers and callbacks of ctypes, and C extensions drop
    those raised during imports: of 150 interrupts while numba and scipy were being loaded, 2 were lost. The message
    that Python prints about such a loss is suppressed, as the interrupt is raised again. Code of llvmlite, which loads
    kernels, is not interrupted, since incomplete objects of it print errors when they are deleted; the interrupt is
    repeated until that code is done, milliseconds later.
    """
    leading = _leading()
    if leading is None:
        yield lambda: None
        return
    signalled, before = leading
    seen = False
    again: list[threading.Timer] = []

    def handler(number: int, frame: FrameType | None) -> None:
        nonlocal seen
        if _in_llvmlite(frame):
            again.append(threading.Timer(_AGAIN_SECONDS, signal.pthread_kill, (threading.main_thread().ident, number)))
            again[-1].daemon = True
            again[-1].start()
            return
        try:
            before(number, frame)
        except KeyboardInterrupt:  # which not every handler of SIGTERM raises
            seen = True
            raise

    def check() -> None:
        if seen:
            raise KeyboardInterrupt

    told = sys.unraisablehook

    def tell(lost: sys.UnraisableHookArgs) -> None:
        if not (seen and issubclass(lost.exc_type, KeyboardInterrupt)):
            told(lost)

    signal.signal(signalled, handler)
    sys.unraisablehook = tell
    try:
        yield check
    finally:
        for timer in again:
            timer.cancel()
        sys.unraisablehook = told
        signal.signal(signalled, before)


def _in_llvmlite(frame: FrameType | None) -> bool:
    """Whether a frame, or one of its callers, runs code of llvmlite."""
    while frame is not None:
        if str(frame.f_globals.get("__name__", "")).startswith("llvmlite."):
            return True
        frame = frame.f_back
    return False
