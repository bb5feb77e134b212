"""Progress of a sweep: a bar on a terminal, plain lines now and then elsewhere."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Protocol, TextIO

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress
    from rich.progress import TaskID


class Progress(Protocol):
    """What a sweep tells of itself."""

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
    """Tells nothing."""

    def begin(self, total: int) -> None:
        """Nothing."""

    def advance(self, *, failed: bool) -> None:
        """Nothing."""

    def end(self) -> None:
        """Nothing."""


class Bar:
    """A bar with the number done, rate, time left and number failed, on standard error."""

    def __init__(self) -> None:
        self._bar: RichProgress | None = None
        self._task: TaskID | None = None
        self._failed = 0
        self._done = 0
        self._started = 0.0

    def begin(self, total: int) -> None:
        """Show the bar."""
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
        from rich.progress import Progress as RichProgress

        self._bar = RichProgress(
            TextColumn("solving"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]}"),
            TextColumn("failed {task.fields[failed]}"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
        )
        self._bar.start()
        self._started = time.monotonic()
        self._task = self._bar.add_task("solving", total=total, failed=0, rate="")

    def advance(self, *, failed: bool) -> None:
        """Move the bar."""
        if self._bar is None or self._task is None:
            return
        self._done += 1
        self._failed += failed
        rate = _rate(self._done, time.monotonic() - self._started)
        self._bar.update(self._task, advance=1, failed=self._failed, rate=rate)

    def end(self) -> None:
        """Leave the bar as it stands."""
        if self._bar is not None:
            self._bar.stop()


class Lines:
    """A line at the start, one every `interval` seconds, one at the end."""

    def __init__(self, stream: TextIO, interval: float = 10.0) -> None:
        self._stream = stream
        self._interval = interval
        self._total = self._done = self._failed = 0
        self._started = self._told = 0.0

    def begin(self, total: int) -> None:
        """Say how many."""
        self._total = total
        self._started = self._told = time.monotonic()
        self._print(f"solving {counted(total, 'case')}")

    def advance(self, *, failed: bool) -> None:
        """Say how far, if the last line is `interval` seconds old or this was the last case."""
        self._done += 1
        self._failed += failed
        now = time.monotonic()
        if now - self._told < self._interval and self._done < self._total:
            return
        self._told = now
        elapsed = now - self._started
        left = elapsed / self._done * (self._total - self._done)
        self._print(
            f"{self._done}/{self._total} cases, {_rate(self._done, elapsed)}, {duration(left)} left, "
            f"{self._failed} failed"
        )

    def end(self) -> None:
        """Nothing: the last case's line has been printed."""

    def _print(self, text: str) -> None:
        print(text, file=self._stream, flush=True)


def _rate(done: int, seconds: float) -> str:
    rate = done / max(seconds, 1e-9)
    return f"{rate:.1f} cases/s" if rate >= 1 else f"{1 / rate:.1f} s/case"


def counted(number: int, thing: str) -> str:
    """So many of a thing: ``1 case``, ``2 cases``."""
    return f"{number} {thing}" + ("" if number == 1 else "s")


def not_solved(number: int) -> str:
    """That so many cases are not: ``1 case is not solved``, ``2 cases are not solved``."""
    return f"{counted(number, 'case')} {'is' if number == 1 else 'are'} not solved"


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
