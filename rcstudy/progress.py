"""Progress of a sweep: a bar on a terminal, plain lines now and then elsewhere."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Protocol, TextIO

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress
    from rich.progress import TaskID


_SETTLED_SECONDS, _SETTLED_CASES = 4.0, 3  # after the first case, before a rate and the time left are shown
LATE_SECONDS = 2.0  # after which a slow step is announced


class Progress(Protocol):
    """Receiver of the progress of a sweep."""

    def begin(self, total: int) -> None:
        """`total` cases are to be solved."""

    def advance(self, *, failed: bool) -> None:
        """One more case is done."""

    def end(self) -> None:
        """No more cases: all are done, or the sweep was broken off."""


def for_stream(stream: TextIO | None = None) -> Progress:
    """A bar if `stream` (standard error by default) is a terminal, else plain lines."""
    stream = sys.stderr if stream is None else stream
    return Bar() if stream.isatty() else Lines(stream)


class Silent:
    """Shows nothing."""

    def begin(self, total: int) -> None:
        """Do nothing."""

    def advance(self, *, failed: bool) -> None:
        """Do nothing."""

    def end(self) -> None:
        """Do nothing."""


@contextlib.contextmanager
def announced_if_slow(tell: Callable[[str], None], text: str) -> Iterator[None]:
    """Have `tell` say `text`, from a thread of its own, if the block takes longer than LATE_SECONDS."""
    timer = threading.Timer(LATE_SECONDS, tell, [text])
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


class _Pace:
    """Rate at which cases are done, without the first one, before which kernels are loaded or compiled."""

    def __init__(self) -> None:
        self.done = 0
        self._first = 0.0

    def advance(self, now: float) -> None:
        """One more is done."""
        if self.done == 0:
            self._first = now
        self.done += 1

    def seconds_per_case(self, now: float) -> float | None:
        """Seconds from one case to the next; None while too few are done."""
        since = now - self._first
        if self.done <= _SETTLED_CASES or since < _SETTLED_SECONDS:
            return None
        return since / (self.done - 1)


# Parts of the bar's line, and the least width of each but the number done; those left out first where there is no room.
_WIDTHS = {"solving": 7, "bar": 10, "rate": 12, "failed": 8, "elapsed": 7, "left": 12}
_LEFT_OUT = "bar", "rate", "elapsed", "solving", "failed", "left"


def _parts(room: int, total: int) -> list[str]:
    """The parts of the line, of those in `_WIDTHS`, that fit into `room` characters beside the number of `total`."""
    kept, number = list(_WIDTHS), 2 * len(str(total)) + 1
    for name in _LEFT_OUT:
        if number + sum(1 + _WIDTHS[part] for part in kept) <= room:
            break
        kept.remove(name)
    return kept


class Bar:
    """A bar with the number done, rate, time left and number failed, on standard error; on narrow terminals less."""

    def __init__(self) -> None:
        self._bar: RichProgress | None = None
        self._task: TaskID | None = None
        self._failed = 0
        self._pace = _Pace()

    def begin(self, total: int) -> None:
        """Show the bar."""
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            ProgressColumn,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )
        from rich.progress import Progress as RichProgress

        console = Console(stderr=True)
        columns: dict[str, list[ProgressColumn]] = {
            "solving": [TextColumn("solving")],
            "bar": [BarColumn()],
            "number": [MofNCompleteColumn()],
            "rate": [TextColumn("{task.fields[rate]}")],
            "failed": [TextColumn("failed {task.fields[failed]}")],
            "elapsed": [TimeElapsedColumn()],
            "left": [TextColumn("left"), TimeRemainingColumn()],
        }
        kept = {*_parts(console.width, total), "number"}
        self._bar = RichProgress(
            *(column for name, found in columns.items() if name in kept for column in found), console=console
        )
        self._bar.start()
        self._task = self._bar.add_task("solving", total=total, failed=0, rate="")

    def advance(self, *, failed: bool) -> None:
        """Move the bar."""
        assert self._bar is not None
        assert self._task is not None
        self._failed += failed
        now = time.monotonic()
        self._pace.advance(now)
        each = self._pace.seconds_per_case(now)
        self._bar.update(self._task, advance=1, failed=self._failed, rate="" if each is None else _rate(each))

    def end(self) -> None:
        """Leave the bar as it stands."""
        if self._bar is not None:
            self._bar.stop()


class Lines:
    """A line at the start, one every `interval` seconds, one at the end.

    The rate and the time left are those of the cases after the first, once there are some; at the end the rate of all.
    """

    def __init__(self, stream: TextIO, interval: float = 10.0) -> None:
        self._stream = stream
        self._interval = interval
        self._total = self._failed = 0
        self._pace = _Pace()
        self._started = self._told = 0.0

    def begin(self, total: int) -> None:
        """Say how many."""
        self._total = total
        self._started = self._told = time.monotonic()
        self._print(f"solving {counted(total, 'case')}")

    def advance(self, *, failed: bool) -> None:
        """Say how far, if the last line is `interval` seconds old or this was the last case."""
        self._failed += failed
        now = time.monotonic()
        self._pace.advance(now)
        done = self._pace.done
        if now - self._told < self._interval and done < self._total:
            return
        self._told = now
        parts = [f"{done}/{self._total} cases"]
        if done == self._total:
            parts.append(_rate((now - self._started) / done))
        elif (each := self._pace.seconds_per_case(now)) is not None:
            parts += [_rate(each), f"{duration(each * (self._total - done))} left"]
        self._print(", ".join([*parts, f"{self._failed} failed"]))

    def end(self) -> None:
        """Do nothing: the last case's line has been printed."""

    def _print(self, text: str) -> None:
        print(text, file=self._stream, flush=True)


def _rate(seconds: float) -> str:
    rate = 1.0 / max(seconds, 1e-9)
    return f"{rate:.1f} cases/s" if rate >= 1 else f"{seconds:.1f} s/case"


def counted(number: int, thing: str) -> str:
    """So many of a thing: ``1 case``, ``2 cases``."""
    return f"{number} {thing}" + ("" if number == 1 else "s")


def not_solved(number: int) -> str:
    """So many cases, not solved: ``1 case is not solved``, ``2 cases are not solved``."""
    return f"{counted(number, 'case')} {'is' if number == 1 else 'are'} not solved"


def in_bytes(number: float) -> str:
    """A number of bytes as a person writes it: ``512 B``, ``42.3 kB``, ``1.2 GB``."""
    for unit in ("B", "kB", "MB", "GB"):
        if number < 999.5:
            return f"{number:.3g} {unit}"
        number /= 1000.0
    return f"{number:.3g} TB"


def duration(seconds: float) -> str:
    """Seconds as a person writes them: ``0.42 s``, ``37 s``, ``4 min 05 s``, ``3 h 12 min``."""
    if seconds < 10:
        return f"{seconds:.2g} s"
    if round(seconds) < 60:
        return f"{seconds:.0f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes} min {rest:02d} s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min"
