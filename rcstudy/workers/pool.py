"""Solves batches of cases in worker processes: single-threaded, spawned, replaced when they die.

All workers start at once, if wanted before it is known what there is to solve. Each solves one batch at a time, holds
the next one where batches are short, and sends a result within a tenth of a second, however long the next one takes.
When a worker dies, its cases go to others. From then on every result is sent as soon as it is there, so that the case
at which a worker dies is known. That case is tried once more; if its worker dies again, it gets status ERROR, and the
other cases go to another worker.
"""

from __future__ import annotations

import contextlib
import importlib
import logging
import multiprocessing
import os
import signal
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from rcstudy.errors import UserError
from rcstudy.threads import available_cores, limited_threads

if TYPE_CHECKING:
    from rcstudy.cases import Case
    from rcstudy.mechanics.scene import Scene
    from rcstudy.result import Result

Solve = Callable[[Sequence["Scene"]], Iterator[Any]]
"""Solves scenes that share a normal problem, a result each, in order; importable by name, so that workers find it."""

ATTEMPTS = 2
"""Attempts before a worker's death is blamed on its case."""

_FAILED_STARTS = 3
# signals that end a sweep; terminals and batch systems send them to all its processes, but only the parent handles them
_ENDS = signal.SIGINT, signal.SIGTERM, signal.SIGHUP
_PATIENCE = 0.1  # seconds that results may wait for others to be sent with
_SEND_BYTES = 2**21  # buffer for results, several times those of 0.1 s
# A worker is sent its next batch while it is still solving one, so that it need not wait, on two conditions: the
# message fits into the buffer of a pipe, and its last batch took no longer than this (else others wait for it at the
# end).
_AHEAD_BYTES = 8000
_AHEAD_SECONDS = 1.0


@dataclass
class _Batch:
    cases: deque[Case]  # those without a result yet
    at_once: bool  # each result is sent as soon as it is there: the first case is the one being solved


@dataclass
class _Worker:
    process: Any
    connection: Connection
    told: bool = False  # has been sent the function that solves
    ready: bool = False  # has loaded it
    batches: deque[_Batch] = field(default_factory=deque)  # the one being solved, and the next one
    quick: bool = False  # solved its last batch within _AHEAD_SECONDS
    since: float = 0.0  # when it began its present batch (monotonic)

    def give(self, batch: _Batch) -> None:
        """Note that a batch is sent to it."""
        if not self.batches:
            self.since = time.monotonic()
        self.batches.append(batch)

    def solved(self) -> Case:
        """The case that the next result belongs to; it is removed from the cases that are awaited."""
        case = self.batches[0].cases.popleft()
        if not self.batches[0].cases:
            self.batches.popleft()
            now = time.monotonic()
            self.quick, self.since = now - self.since <= _AHEAD_SECONDS, now
        return case


class Pool:
    """Worker processes; they end with the ``with`` block.

    They may be started before it is known what there is to solve, and load the module `preload` meanwhile.
    """

    def __init__(self, preload: str = "") -> None:
        self._preload = preload
        self._solve: Solve | None = None
        self._waiting: deque[list[Case]] = deque()
        self._workers: list[_Worker] = []
        self._deaths: dict[tuple[str, tuple[int, ...]], int] = {}
        self._failed_starts = 0
        self._patience = _PATIENCE
        self._next: memoryview | None = None  # the first waiting batch, pickled

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start_early(self, workers: int | None) -> None:
        """Start the workers asked for, at most one per processor, while it is not known yet what there is to do."""
        if workers is not None and workers > 1:
            self.start(min(workers, available_cores()))

    def prepare(self, solve: Solve, scenes: Sequence[Scene]) -> None:
        """Have the workers that are there solve `scenes`, each by itself, and discard the results.

        That loads the kernels that others will use.
        """
        self._take(solve)
        self._tell_all()
        message = ForkingPickler.dumps((scenes, None))
        for worker in self._workers:
            self._send(worker, message)

    def start(self, workers: int) -> None:
        """Start workers until there are at least so many."""
        while len(self._workers) < workers:
            self._start()

    def solve(
        self,
        batches: Iterable[Sequence[Case]],
        workers: int,
        solve: Solve,
        tell: Callable[[str], None] | None = None,
    ) -> Iterator[tuple[Case, Any]]:
        """Solve `batches` (cases sharing a normal problem) in so many processes; yield results as they come.

        A result is what `solve` yields for the case, or a Result with status ERROR if it ended its workers.
        `tell` gets a line on each worker that dies.
        Raises UserError when worker processes do not start.
        """
        self._take(solve)
        self._waiting, self._next = deque(list(batch) for batch in batches), None
        self.start(min(workers, len(self._waiting)))
        self._give_all()
        while self._waiting or any(worker.batches for worker in self._workers):
            for connection in wait([worker.connection for worker in self._workers]):
                worker = next(w for w in self._workers if w.connection is connection)
                try:
                    message = worker.connection.recv()
                except (EOFError, OSError):
                    had = len(worker.batches)
                    yield from self._handle_death(worker)
                    if tell is not None and had:
                        how = _how_it_died(worker.process.exitcode)
                        tell(f"a worker process died ({how}); its cases go to other workers")
                    continue
                if message is None:
                    worker.ready = True
                    self._failed_starts = 0
                solved = [(worker.solved(), result) for result in message or ()]
                self._give_all()  # first, so that workers need not wait
                yield from solved
            self.start(min(workers, len(self._workers) + len(self._waiting)))
            self._give_all()

    def _take(self, solve: Solve) -> None:
        """Have `solve` solve from now on. Workers that were told another, and may still be at it, are replaced."""
        if self._solve not in (None, solve):
            self.stop()
            self._deaths.clear()
        self._solve = solve

    def _start(self) -> None:
        if not may_start():
            raise UserError(
                "worker processes do not start in daemonic processes (multiprocessing.Pool's): use one worker"
            )
        Path.cwd()  # FileNotFoundError if it was removed: Python 3.13's resource tracker would print a traceback
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        _widen(theirs)
        process = context.Process(target=_work, args=(theirs, self._preload, bool(self._workers)), daemon=True)
        # Ctrl-C goes to every process of the terminal, and only this one is to handle it. Starting multiprocessing's
        # resource tracker unblocks interrupts again, so that comes first.
        resource_tracker.ensure_running()
        with limited_threads(), _interrupts_held():
            process.start()
        theirs.close()
        self._workers.append(_Worker(process, ours))

    def _give_all(self) -> None:
        """Give batches to workers that are ready: one to each that has none, then one to solve next."""
        self._tell_all()
        for held in (0, 1):
            for worker in self._workers:
                # near the end no batch waits behind another one, as a free worker could solve it
                wanted = len(self._waiting) > held * len(self._workers) and (held == 0 or worker.quick)
                if worker.ready and len(worker.batches) == held and wanted:
                    self._give(worker)

    def _tell_all(self) -> None:
        for worker in self._workers:
            if not worker.told:
                worker.told = True
                self._send(worker, ForkingPickler.dumps(self._solve))

    def _give(self, worker: _Worker) -> None:
        """Send the next batch, unless the worker has one already and the message exceeds the pipe's buffer."""
        if self._next is None:
            self._next = ForkingPickler.dumps(([case.scene for case in self._waiting[0]], self._patience))
        if not worker.batches or len(self._next) <= _AHEAD_BYTES:
            worker.give(_Batch(deque(self._waiting.popleft()), self._patience == 0.0))
            self._send(worker, self._next)
            self._next = None

    def _send(self, worker: _Worker, message: memoryview) -> None:
        # a worker that has just died is noticed at the next wait
        with contextlib.suppress(OSError):
            worker.connection.send_bytes(message)

    def _handle_death(self, worker: _Worker) -> Iterator[tuple[Case, Result]]:
        """Deal with a dead worker: its case is tried again or given up, its other cases go to other workers."""
        from rcstudy.result import Result, Status

        self._workers.remove(worker)
        worker.connection.close()
        worker.process.join()
        how = _how_it_died(worker.process.exitcode)
        self._patience, self._next = 0.0, None
        if not worker.ready:
            self._failed_starts += 1
            if self._failed_starts >= _FAILED_STARTS and not any(w.ready for w in self._workers):
                killed = (worker.process.exitcode or 0) < 0
                in_script = 'in a script, which must be a file, call rcstudy under if __name__ == "__main__"'
                hint = "perhaps out of memory: use fewer workers" if killed else f"{in_script}, or use one worker"
                raise UserError(f"worker processes do not start ({how}); {hint}")
        if worker.batches and worker.batches[0].at_once:
            case = worker.batches[0].cases[0]
            deaths = self._deaths[case.grid, case.index] = self._deaths.get((case.grid, case.index), 0) + 1
            if deaths >= ATTEMPTS:
                worker.solved()
                yield case, Result(Status.ERROR, f"the worker process died {deaths} times at this case: {how}")
        self._waiting.extendleft(list(batch.cases) for batch in reversed(worker.batches))

    def stop(self) -> None:
        """Kill all workers: they hold nothing of use, and an orderly exit would take longer."""
        for worker in self._workers:
            worker.process.kill()
        for worker in self._workers:
            worker.process.join()
            worker.connection.close()
        self._workers.clear()


def may_start() -> bool:
    """Whether this process may start others: those of `multiprocessing.Pool`, which are daemonic, may not."""
    return not multiprocessing.current_process().daemon


def _widen(connection: Connection) -> None:
    """Enlarge the send buffer of a connection, so that a worker need not wait until its results are read.

    As far as the system allows; the default buffer is filled by the results of a twentieth of a second.
    """
    with contextlib.suppress(OSError), socket.socket(fileno=os.dup(connection.fileno())) as end:  # not on every system
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BYTES)


class _Outbox:
    """Sends a worker's results to the parent, each with those that come soon after it.

    A thread does so, as the next result may take long; it sleeps while there is nothing to send.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._results: list[Any] = []
        self._patience = 0.0
        self._lock = threading.Lock()
        self._wake = threading.Event()
        threading.Thread(target=self._send_in_time, name="rcstudy results", daemon=True).start()

    def add(self, result: Any, patience: float) -> None:
        """Take a result, which may wait so many seconds for others. Raises OSError when the parent has gone."""
        with self._lock:
            self._results.append(result)
        if patience == 0.0:
            self.send()
        else:
            self._patience = patience
            self._wake.set()

    def send(self) -> None:
        """Send all results that wait. Raises OSError when the parent has gone."""
        with self._lock:
            if self._results:
                self._connection.send(self._results)
                self._results = []

    def _send_in_time(self) -> None:
        with contextlib.suppress(OSError):  # the parent has gone, which the worker notices as well
            while True:
                self._wake.wait()
                self._wake.clear()
                time.sleep(self._patience)
                self.send()


def _work(connection: Connection, preload: str, quiet: bool) -> None:
    """Main loop of a worker: receives `solve`, then scenes, sends results; until it is killed or the parent is gone.

    `quiet`: another worker warns of what concerns all of them.
    """
    if quiet:
        logging.getLogger("rcstudy").setLevel(logging.ERROR)
    for number in _ENDS:  # where they could not be blocked from the start
        signal.signal(number, signal.SIG_IGN)
    if preload:
        importlib.import_module(preload)
    try:
        solve = connection.recv()
        for _ in solve([]):  # nothing to solve, but its modules are loaded
            pass
        connection.send(None)
        outbox = _Outbox(connection)
        while True:
            scenes, patience = connection.recv()
            if patience is None:  # warm-up: results are discarded, and scenes need not share a normal problem
                for scene in scenes:
                    for _ in solve([scene]):
                        pass
                continue
            for result in solve(scenes):
                outbox.add(result, patience)
            outbox.send()
    except (EOFError, OSError):
        pass  # the parent has gone, and with it the need for results


def _how_it_died(code: int | None) -> str:
    if code is not None and code < 0:
        try:
            return f"killed by {signal.Signals(-code).name}"
        except ValueError:
            return f"killed by signal {-code}"
    return f"exit code {code}"


@contextlib.contextmanager
def _interrupts_held() -> Iterator[None]:
    """Block the signals that end a sweep; processes started in the block never get them, this one does afterwards."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _ENDS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
