"""Solves batches of cases on a running Dask cluster: workers on any machines, each solving one case at a time.

This process distributes the work itself, in parcels (batches that are sent together), for two reasons. Dask would retry
a task that ends its worker on four workers in all before it reports the failure, and the work that Dask holds must stay
bounded. A worker therefore has at most two parcels, one being solved and one to follow, each submitted to that worker
only. When a worker is lost, it is known which parcel it was solving. The cases of that parcel are tried once more, each
alone: a case that ends its worker again gets status ERROR, the others are solved.

The machines communicate by Dask's protocol, which trusts all participants: whoever can reach the scheduler can run code
on the workers and in this process.
"""

from __future__ import annotations

import contextlib
import functools
import json
import logging
import queue
import sys
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcstudy.errors import UserError, cannot_be_read
from rcstudy.result import Result, Status
from rcstudy.workers.batch import LARGEST_BATCH, SMALLEST_BATCH
from rcstudy.workers.pool import ATTEMPTS
from rcstudy.workers.remote import differences, examine, notes_on, paused_workers, solve_parcel

if TYPE_CHECKING:
    from rcstudy.cases import Case
    from rcstudy.mechanics.scene import Scene

_CONNECT_SECONDS = 15.0
_FETCH_SECONDS = 1.0  # wait for results before checking that their worker is still there; doubled each time
_LOOK_SECONDS = 0.5  # between checks of which workers there are
_PARCELS_HELD = 2  # at most by a worker: the one being solved and the next one
_SHARES = 4  # parcels left for each worker, at least, so that all workers end at about the same time
_WAITING = "no worker"  # key of what is told once until there is one
_PARCEL_CELLS = 64 * 64 * 64  # most cells of all cases of a parcel (some 0.1 s of work), unless it is a single case


@dataclass(frozen=True)
class Scheduler:
    """Where a running Dask scheduler is: its `address`, such as tcp://node17:8786, or the `file` it wrote."""

    address: str = ""
    file: Path | None = None

    def find(self) -> str:
        """The scheduler's address. Raises UserError if the file is missing or holds none."""
        if self.file is None:
            return self.address
        try:
            address = json.loads(self.file.read_text(encoding="utf-8"))["address"]
        except OSError as error:
            raise cannot_be_read(self.file, error) from error
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise UserError(f"{self.file}: not a scheduler file: it names no address") from error
        if not isinstance(address, str):
            raise UserError(f"{self.file}: not a scheduler file: its address is not text")
        return address


def scheduler_at(address: str | None, file: Path | None) -> Scheduler | None:
    """The scheduler of the options --scheduler and --scheduler-file; None without either, UserError with both."""
    if address is not None and file is not None:
        raise UserError("--scheduler and --scheduler-file: one of them, not both")
    return None if address is None and file is None else Scheduler(address or "", file)


def check(scheduler: Scheduler) -> str:
    """The address of `scheduler`. Raises UserError when it cannot be found out, or when Dask is not installed."""
    try:
        import distributed  # noqa: F401
    except ImportError as error:
        raise UserError(
            "a Dask cluster needs the extra `cluster`: pip install '.[cluster]' in a checkout of rcstudy, "
            f"as README.md installs it ({error})"
        ) from error
    return scheduler.find()


def solve_on_cluster(
    batches: Iterable[Sequence[Case]],
    scheduler: Scheduler,
    solve: Callable[[Sequence[Scene]], Iterator[Any]],
    *,
    tell: Callable[[str], None] = lambda text: print(text, file=sys.stderr),
) -> Iterator[tuple[Case, Any]]:
    """Solve `batches` (cases sharing a normal problem) on the cluster of `scheduler`; yield results as they come.

    A result is what `solve` yields for the case, or a Result with status ERROR if it ended its workers. `solve` must
    be importable by name on the workers. Workers may come and go; while there is none, this waits for one. `tell` is
    called with messages for the user. Closing the iterator withdraws queued work.

    Raises UserError when Dask is not installed, the scheduler cannot be reached or is lost, or its workers run other
    code than this process.
    """
    with _connected(scheduler) as client:
        yield from _Distribution(client, solve, batches, tell).run()


@contextlib.contextmanager
def _connected(scheduler: Scheduler) -> Iterator[Any]:
    """A client of the scheduler; tasks that it still waits for are released at the end."""
    address = check(scheduler)
    import distributed

    with _dask_silenced():
        client = distributed.Client.__new__(distributed.Client)
        # Dask sets no limit to the time in which what has taken a connection greets
        client.start = functools.partial(  # type: ignore[method-assign]
            client.start, callback_timeout=2 * _CONNECT_SECONDS
        )
        try:
            distributed.Client.__init__(
                client, address or " ", timeout=_CONNECT_SECONDS, set_as_default=False, name="rcstudy"
            )
        except Exception as error:  # of any type, where another service answers: MemoryError at what a web server says
            # else it closes itself when it is garbage collected: during the start of another client that is a deadlock
            with contextlib.suppress(Exception):
                client.close(timeout=2)
            reason = str(error).strip() or type(error).__name__
            raise UserError(f"{address or '(no address)'}: no Dask scheduler can be reached there: {reason}") from error
        try:
            yield client
        finally:
            client.close(timeout=2)


@contextlib.contextmanager
def _dask_silenced() -> Iterator[None]:
    """Suppress Dask's messages on conditions that are handled here: lost workers, differing versions."""
    logger = logging.getLogger("distributed")
    children = [logging.getLogger(f"distributed.{name}") for name in ("client", "comm", "core", "batched", "utils")]
    before = [(one, one.level) for one in (logger, *children)]
    for one, _ in before:
        one.setLevel(logging.CRITICAL + 1)  # what is not Dask's protocol is critical, with a traceback
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", module="distributed")
            yield
    finally:
        for one, level in before:
            one.setLevel(level)


@dataclass(eq=False)
class _Parcel:
    """Batches sent to one worker together. A `suspect` is one case, alone, of a parcel whose worker died or failed."""

    batches: list[list[Case]]
    deaths: int = 0
    suspect: bool = False
    worker: str = ""
    future: Any = None

    @property
    def cases(self) -> list[Case]:
        return [case for batch in self.batches for case in batch]


@dataclass
class _Distribution:
    """State of the distribution: what waits and what each worker holds. `given`: results of cases that are given up."""

    client: Any
    solve: Callable[[Sequence[Scene]], Iterator[Any]]
    batches: Iterable[Sequence[Case]]
    tell: Callable[[str], None]
    workers: dict[str, list[_Parcel]] = field(default_factory=dict)  # by address: what each holds, in order
    refused: set[str] = field(default_factory=set)
    suspects: deque[_Parcel] = field(default_factory=deque)
    flying: dict[str, _Parcel] = field(default_factory=dict)  # by the key of the future
    finished: queue.SimpleQueue[str] = field(default_factory=queue.SimpleQueue)
    given: list[tuple[Case, Result]] = field(default_factory=list)
    told: set[str] = field(default_factory=set)
    next_look: float = 0.0
    had_workers: bool = False

    def __post_init__(self) -> None:
        self.waiting = deque(list(batch) for batch in self.batches)
        self.left = sum(map(len, self.waiting))  # cases in `waiting`
        self.ours = examine()

    def run(self) -> Iterator[tuple[Case, Any]]:
        """Distribute all the work; yield each case with its result.

        UserError if the scheduler is gone or cannot import rcstudy, or if its workers run other versions.
        """
        if not self.waiting:
            return
        self._examine_scheduler()
        while self.waiting or self.suspects or self.flying:
            self._update_workers()
            self._hand_out()
            for parcel in self._ended():
                yield from self._opened(parcel)
            yield from self.given
            self.given.clear()

    # workers

    def _update_workers(self) -> None:
        """Update the workers: take back the work of lost ones, examine new ones."""
        # always done before a suspect is sent, which else could be blamed for an earlier death of its worker
        if time.monotonic() < self.next_look and not self.suspects:
            return
        present = self._ask(self.client.nthreads)
        paused = self._ask(self.client.run_on_scheduler, paused_workers)
        for address in self.workers.keys() - present.keys():
            self._take_back(address)
        for address in sorted(paused - self.refused):
            self._pass_on(address)
        self.refused &= present.keys()
        new = present.keys() - self.workers.keys() - self.refused - paused
        if new:
            self._examine_workers({address: present[address] for address in new})
        if not self.workers:
            gone = "all workers are gone or paused" if paused else "all workers are gone"
            self._tell_once(f"{gone}: waiting for new ones" if self.had_workers else "waiting for workers", _WAITING)
        else:
            self.told.discard(_WAITING)
        self.next_look = time.monotonic() + _LOOK_SECONDS

    def _examine_scheduler(self) -> None:
        """Raise UserError if the scheduler cannot import rcstudy, which it needs as it inspects tasks."""
        try:
            self.client.run_on_scheduler(examine)
        except Exception as error:
            self._ask(lambda: None)
            raise UserError(f"the scheduler {self._address()}: {differences({}, error)}") from error

    def _ask(self, question: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
        """The scheduler's answer. Raises UserError when it is gone."""
        try:
            if self.client.status == "running":
                return question(*args, **kwargs)
            reason = "the connection is lost"
        except (OSError, AttributeError, RuntimeError) as error:  # a client that has just been closed has no attributes
            reason = str(error) or type(error).__name__
        raise UserError(f"{self._address()}: the scheduler is gone: {reason}; run again once there is one")

    def _address(self) -> str:
        return str(getattr(self.client.scheduler, "address", "Dask cluster"))

    def _examine_workers(self, threads: dict[str, int]) -> None:
        """Examine new workers: one with other code ends the sweep if no worker was accepted yet, else is left out."""
        answers = self._ask(self.client.run, examine, workers=sorted(threads), on_error="return")
        for address, answer in sorted(answers.items()):
            if isinstance(answer, OSError):  # gone again
                continue
            problem = differences(self.ours, answer)
            if problem and not self.had_workers:
                raise UserError(f"worker {address}: {problem}")
            if problem:
                self.refused.add(address)
                self._tell_once(f"left out: worker {address}: {problem}")
                continue
            self.workers[address] = []
            for note in notes_on(self.ours, answer, threads[address]):
                self._tell_once(f"note on worker {address}: {note}", note)
        self.had_workers = self.had_workers or bool(self.workers)

    def _tell_once(self, text: str, key: str = "") -> None:
        if (key or text) not in self.told:
            self.told.add(key or text)
            self.tell(text)

    def _take_back(self, address: str) -> None:
        """Take back the parcels of a lost worker; the death counts only for the one that was being solved."""
        held = self.workers.pop(address)
        at_work = True
        for parcel in held:
            solved = parcel.future.status in ("finished", "lost")  # its results went with the worker
            self._call_back(parcel)  # from now on its status is "cancelled"
            if solved:
                self._put_back(parcel)
            elif at_work:
                at_work = False
                self._died(parcel, f"worker {address} is gone")
            else:
                self._put_back(parcel)

    def _pass_on(self, address: str) -> None:
        """Take back what a paused worker has not solved: it may stay paused for good; if it does not, it is as new."""
        self._tell_once(f"worker {address}: paused by Dask, as its memory is nearly full: it gets no work meanwhile")
        for parcel in self.workers.pop(address, ()):
            if parcel.future.status == "pending":
                self._call_back(parcel)
                self._put_back(parcel)

    def _died(self, parcel: _Parcel, how: str) -> None:
        """Count the death of a worker at `parcel`: its cases are tried again one by one, or its only case given up.

        A death at several cases counts for none of them: most are as good as those of any other parcel.
        """
        deaths = parcel.deaths + 1 if len(parcel.cases) == 1 else 0
        if deaths < ATTEMPTS:
            self.suspects.extend(_Parcel([[case]], deaths, suspect=True) for case in parcel.cases)
            return
        reason = f"the worker process died {deaths} times at this case: {how}"
        self.given.append((parcel.cases[0], Result(Status.ERROR, reason)))

    # work

    def _hand_out(self) -> None:
        """Send parcels to workers that may hold more, first to those that hold none."""
        held_at_most = 1 if self.suspects else _PARCELS_HELD
        for level in range(held_at_most):
            for address, held in self.workers.items():
                if len(held) != level or any(parcel.suspect for parcel in held):
                    continue
                parcel = self.suspects.popleft() if self.suspects else self._next_parcel()
                if parcel is None:
                    return
                self._send(parcel, address)

    def _next_parcel(self) -> _Parcel | None:
        """The next parcel: some batches or a part of one, smaller towards the end of the work; None if none waits."""
        if not self.waiting:
            return None
        cells = max(1, _PARCEL_CELLS // _cells(self.waiting[0][0]))
        room = max(1, min(LARGEST_BATCH, cells, self.left // (_SHARES * len(self.workers))))
        first = self.waiting.popleft()
        split = min(max(room, SMALLEST_BATCH), cells)
        if len(first) > split:
            self.waiting.appendleft(first[split:])
            first = first[:split]
        parcel = _Parcel([first])
        size = len(first)
        while self.waiting and size + len(self.waiting[0]) <= room:
            if _cells(self.waiting[0][0]) != _cells(first[0]):
                break
            size += len(self.waiting[0])
            parcel.batches.append(self.waiting.popleft())
        self.left -= size
        return parcel

    def _send(self, parcel: _Parcel, address: str) -> None:
        scenes = [[case.scene for case in batch] for batch in parcel.batches]
        parcel.worker = address
        parcel.future = self._ask(
            self.client.submit, solve_parcel, self.solve, scenes, workers=[address], pure=False, key=_key()
        )
        self.workers[address].append(parcel)
        self.flying[parcel.future.key] = parcel
        parcel.future.add_done_callback(lambda future: self.finished.put(future.key))

    def _call_back(self, parcel: _Parcel) -> None:
        self.flying.pop(parcel.future.key, None)
        with contextlib.suppress(Exception):  # a lost scheduler is reported by the next `_ask`
            parcel.future.cancel()

    def _put_back(self, parcel: _Parcel) -> None:
        if parcel.suspect:
            self.suspects.append(parcel)
            return
        self.waiting.extendleft(reversed(parcel.batches))
        self.left += len(parcel.cases)

    def _ended(self) -> list[_Parcel]:
        """Parcels that have ended; waits for the first one, _LOOK_SECONDS at most."""
        keys = []
        with contextlib.suppress(queue.Empty):
            keys.append(self.finished.get(timeout=_LOOK_SECONDS))
            while len(keys) < _PARCELS_HELD * len(self.workers):
                keys.append(self.finished.get_nowait())
        landed = [self.flying.pop(key) for key in keys if key in self.flying]
        for parcel in landed:
            if parcel in self.workers.get(parcel.worker, ()):
                self.workers[parcel.worker].remove(parcel)
        self._hand_out()  # first, so that workers do not wait while results are written to the disk
        return landed

    def _opened(self, parcel: _Parcel) -> Iterator[tuple[Case, Any]]:
        """Each case of an ended parcel with its result; none if it failed, which `_failed` then deals with."""
        try:
            results = self._fetched(parcel)
        except Exception as error:
            self._failed(parcel, error)
            return
        finally:
            self._call_back(parcel)
        yield from zip(parcel.cases, results, strict=True)

    def _fetched(self, parcel: _Parcel) -> list[Any]:
        """The results that the worker sends. Raises TimeoutError if it died before that, or the error of the task."""
        seconds = _FETCH_SECONDS
        while True:
            try:
                fetched: list[Any] = parcel.future.result(timeout=seconds)
            except TimeoutError:
                if parcel.future.status == "error" or parcel.worker not in self._ask(self.client.nthreads):
                    raise
                seconds *= 2
            else:
                return fetched

    def _failed(self, parcel: _Parcel, error: Exception) -> None:
        """Deal with a parcel without results: they were lost, its workers died, or the task raised an error."""
        self._ask(lambda: None)
        how = f"{type(error).__name__}: {error}"
        if type(error).__name__ == "KilledWorker":  # a worker restarted at its address, as often as Dask allows
            self._died(parcel, "its worker came back and died again")
        elif parcel.future.status in ("cancelled", "lost", "pending") or (
            isinstance(error, TimeoutError) and parcel.future.status != "error"
        ):
            self._put_back(parcel)  # solved, but the worker died before it could pass the results on
        elif len(parcel.cases) > 1:
            self.suspects.extend(_Parcel([[case]], parcel.deaths, suspect=True) for case in parcel.cases)
        else:
            self.given.append((parcel.cases[0], Result(Status.ERROR, how)))


def _cells(case: Case) -> int:
    nx, ny = case.scene.mesh.cells
    return nx * ny


def _key() -> str:
    import uuid

    return f"rcstudy-{uuid.uuid4().hex}"
