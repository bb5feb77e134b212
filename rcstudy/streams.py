"""Set-up of standard output and error for a command, so that no message can make it fail."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from typing import Any


def prepare_streams() -> None:
    """Escape what a stream cannot encode, and drop messages that cannot be written to standard error.

    Standard streams that are closed are opened on the null device: else the next file that is opened, perhaps a cube,
    would get their number, and libraries would write their error messages into it.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    encoding = sys.stderr.encoding if sys.stderr is not None else "utf-8"
    buffered = io.BufferedWriter(_IgnoringErrors(2, "w", closefd=False))
    sys.stderr = io.TextIOWrapper(buffered, encoding, "backslashreplace", line_buffering=True)


class _IgnoringErrors(io.FileIO):
    """A file that ignores errors of writing: on a full disk, or when nobody reads any more."""

    def write(self, data: Any, /) -> int:
        with contextlib.suppress(OSError):
            super().write(data)
        return len(data)
