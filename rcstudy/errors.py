"""Errors a user can fix, which carry a message fit to print, never a traceback; and the exit codes of commands."""

from __future__ import annotations

EXIT_DIFFERENT = 1
"""Of `compare` where cubes differ."""

EXIT_BAD_INPUT = 2
"""Of a command that was given what it cannot use."""

EXIT_FAILED_CASES = 3
"""Of a sweep or merge some of whose cases are not solved."""

EXIT_INTERRUPTED = 130
"""Of a command that Ctrl-C ended."""

EXIT_UNHEARD = 141
"""Of a command whose output pipe was closed by its reader, as of a program that a broken pipe ended."""


class UserError(Exception):
    """Bad input (exit code 2): the message says where, what, and what is allowed."""


def first_line(error: Exception) -> str:
    """What an error says in its first line, its type if it says nothing."""
    return (str(error).strip() or type(error).__name__).splitlines()[0]
