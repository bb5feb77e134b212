"""The command ``rcstudy``, also as ``python -m rcstudy``.

Worker processes import the module that their parent was started with, so it imports nothing that they do not need.
"""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from rcstudy.errors import EXIT_BAD_INPUT, EXIT_BROKEN_PIPE, EXIT_INTERRUPTED, is_interrupt
from rcstudy.streams import prepare_streams
from rcstudy.threads import limit_threads

if TYPE_CHECKING:
    from types import FrameType

    from rcstudy.workers.pool import Pool


def main() -> None:
    """Entry point of the command; limits threads before anything numerical is imported.

    Ends the process at once when all is done and closed: freeing ten thousand cases one by one takes 0.2 s.
    """
    limit_threads()
    gc.set_threshold(50_000, 20, 50)  # modules and figures are many objects that stay: a tenth of the time of `show`
    os.environ["MPLBACKEND"] = "agg"  # figures go into files; a backend set for a screen may not be installed
    prepare_streams()
    heed_terminations()
    code: str | int | None = EXIT_INTERRUPTED
    try:
        with _workers(sys.argv[1:]) as processes:
            code = _run(processes)
            _ignore_interrupts()
    except (KeyboardInterrupt, RuntimeError) as error:  # before or after the command line could handle it
        if not is_interrupt(error):
            raise
        print("interrupted", file=sys.stderr)
    if isinstance(code, int):
        # Also for Ctrl-C inside exec() of text (any dataclass being made): it stays "unhandled" to CPython even
        # when it was caught, and `python -m` would then end by SIGINT in place of this code.
        os._exit(_flushed(code))
    sys.exit(code)


def heed_terminations() -> None:
    """Handle SIGTERM (batch systems) and SIGHUP (a terminal that closes) like Ctrl-C, so that no solved case is lost.

    Where they are ignored (`nohup`) they stay so, and so does Ctrl-C (jobs in the background of a script). One signal
    alone raises KeyboardInterrupt itself, so that one handler has to be replaced to hold interrupts back
    (`storage/steady.py`).
    """
    leading = signal.SIGINT if callable(signal.getsignal(signal.SIGINT)) else None

    def as_leading(_: int, frame: FrameType | None) -> None:
        assert leading is not None
        handler = signal.getsignal(leading)  # the current one
        if callable(handler):
            handler(leading, frame)

    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) == signal.SIG_DFL:
            signal.signal(number, as_leading if leading is not None else signal.default_int_handler)
            leading = leading or number


def _ignore_interrupts() -> None:
    """From now on: all is done and told, and only workers are left to end. A second Ctrl-C would change the code."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)


def _flushed(code: int) -> int:
    """Flush standard output and error; returns the exit code: `code` unless that fails."""
    for stream in (sys.stdout, sys.stderr):
        try:
            if stream is not None:  # None: closed by the parent process
                stream.flush()
        except BrokenPipeError:
            code = EXIT_BROKEN_PIPE
        except OSError as error:
            code = _lost(error)
    return code


def _lost(error: OSError) -> int:
    """Report that output cannot be written; returns the exit code."""
    with contextlib.suppress(OSError):
        os.write(2, f"output: {error.strerror or error}\n".encode())
    return EXIT_BAD_INPUT


@contextlib.contextmanager
def _workers(words: Sequence[str]) -> Iterator[Pool | None]:
    """A pool of the workers that a command line asks for, or None; they load while it and the study are being read."""
    wanted = workers_wanted(words)
    if wanted < 2:
        yield None
        return
    from rcstudy.workers.pool import Pool

    with Pool("rcstudy.solve") as processes:
        with contextlib.suppress(FileNotFoundError):  # the current folder is gone, as the command will find
            processes.start_early(wanted)
        yield processes


def workers_wanted(words: Sequence[str]) -> int:
    """How many workers a command line asks for, 0 if it does not. The option is validated later, in `cli.py`.

    It is parsed here as well, by hand, so that workers start while `cli.py` is imported and typer parses the command
    line, which takes as long as their start.
    """
    if words[:1] != ["sweep"] or {"-h", "--help"} & set(words):
        return 0
    for word, following in zip(words, [*words[1:], ""], strict=True):
        name, equals, value = word.partition("=")
        number = value if equals else following
        if name == "--workers" and number.isascii() and number.isdecimal() and len(number) < 5:
            return int(number)
    return 0


def _run(processes: Pool | None) -> str | int | None:
    """Run the command line, a sweep with `processes`; its exit code."""
    from rcstudy.cli import app

    try:
        app(obj=processes)
    except SystemExit as leaving:
        # interrupted while it parses the command line, typer exits without a message; commands print their own
        cause: BaseException | None = leaving
        while cause is not None and not isinstance(cause, KeyboardInterrupt | BrokenPipeError):
            cause = cause.__cause__ or cause.__context__
        if isinstance(cause, KeyboardInterrupt):
            print("interrupted", file=sys.stderr)
        return EXIT_BROKEN_PIPE if isinstance(cause, BrokenPipeError) else leaving.code
    except OSError as error:  # while typer prints help or the version; commands handle their own
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # else flushing the rest would fail once more
        return _lost(error)
    return 0


if __name__ == "__main__":
    main()
