"""Errors a user can fix, which carry a message fit to print, never a traceback; and the exit codes of commands."""

from __future__ import annotations

from pathlib import Path
from traceback import extract_tb

EXIT_DIFFERENT = 1
"""Exit code of `compare` where cubes differ."""

EXIT_BAD_INPUT = 2
"""Exit code of a command with input that it cannot use."""

EXIT_FAILED_CASES = 3
"""Exit code of a sweep or merge some of whose cases are not solved."""

EXIT_INTERRUPTED = 130
"""Exit code of a command that Ctrl-C ended."""

EXIT_BROKEN_PIPE = 141
"""Exit code of a command whose output pipe was closed by its reader, like that of a program ended by SIGPIPE."""


class UserError(Exception):
    """Bad input (exit code 2): the message says where, what, and what is allowed."""


def first_line(error: Exception) -> str:
    """The first line of an error's message, or its type if it has none."""
    return (str(error).strip() or type(error).__name__).splitlines()[0]


def place_of(error: BaseException) -> str:
    """File and line of this package that the error comes from: `report/overview.py, line 117`."""
    package = Path(__file__).parent
    last = [frame for frame in extract_tb(error.__traceback__) if package in Path(frame.filename).parents][-1]
    return f"{Path(last.filename).relative_to(package).as_posix()}, line {last.lineno}"


def cannot_be_read(place: object, error: OSError) -> UserError:
    """The error that says that the file or folder `place` cannot be read, and why."""
    return UserError(f"{place}: cannot be read: {error.strerror or error}")


def is_folder_gone() -> bool:
    """Whether the current folder was removed: paths in it fail with an error that names none."""
    try:
        Path.cwd()
    except FileNotFoundError:
        return True
    return False


def is_interrupt(error: BaseException) -> bool:
    """Whether `error` is a Ctrl-C, also one that comes while a class is being made (imports): Python 3.11 wraps it."""
    return isinstance(error, KeyboardInterrupt) or (
        isinstance(error, RuntimeError) and isinstance(error.__cause__, KeyboardInterrupt)
    )
