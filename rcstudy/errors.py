"""Errors a user can mend: they carry a message fit to print, never a traceback."""

from __future__ import annotations

EXIT_INTERRUPTED = 130
"""Of a command that Ctrl-C ended."""


class UserError(Exception):
    """Bad input (exit code 2): the message says where, what, and what is allowed."""
