"""Solves batches of cases in worker processes: single-threaded, spawned, replaced when they die.

All workers start at once, but the others wait for the first one to compile the kernels, if that has to be done. Each
holds one batch at a time and sends its results every tenth of a second. Once a worker has died, and the cases it held
go to others, all send a result as soon as they have one, so that it is known which case a worker dies of. That case is
tried once more; if its worker dies again it gets status ERROR, and the rest of its batch goes on in another worker.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from typing import TYPE_CHECKING, Any

from rcstudy.errors import UserError
from rcstudy.result import Result, Status
from rcstudy.threads import limited_threads

if TYPE_CHECKING:
    from rcstudy.cases import Case
    from rcstudy.mechanics.scene import Scene

Solve = Callable[[Sequence["Scene"]], Iterator[Result]]
"""Solves scenes that share a normal problem, a result each, in order; importable by name, so that workers find it."""

ATTEMPTS = 2
"""Times a case is tried before the death of its worker is laid at its door."""

_FAILED_STARTS = 3
_PATIENCE = 0.1  # seconds that results may wait for others to be sent with


@dataclass
class _Worker:
    process: Any
    connection: Connection
    compiles: bool  # has scenes to warm up with, for which others wait
    ready: bool = False
    batch: deque[Case] = field(default_factory=deque)  # whose results are not here yet
    at_once: bool = False  # sends each result as it has it: the first case of the batch is the one being solved


def solve_in_processes(
    batches: Iterable[Sequence[Case]],
    workers: int,
    solve: Callable[[Sequence[Scene]], Iterator[Any]],
    warm_up: Sequence[Scene] = (),
    meanwhile: Callable[[], None] = lambda: None,
) -> Iterator[tuple[Case, Any]]:
    """Solve `batches` (cases sharing a normal problem) in `workers` processes; yield results as they come.

    A result is what `solve` yields for the case, or a Result with status ERROR if it ended its workers.
    The first worker solves the scenes of `warm_up` before the others begin, so that kernels are compiled once.
    `meanwhile` is called while workers start. Closing the iterator ends the workers. Raises UserError when worker
    processes do not start.
    """
    pool = _Pool(solve, deque(list(batch) for batch in batches))
    try:
        yield from pool.run(workers, warm_up, meanwhile)
    finally:
        pool.stop()


class _Pool:
    def __init__(self, solve: Callable[[Sequence[Scene]], Iterator[Any]], waiting: deque[list[Case]]) -> None:
        self.solve = solve
        self.waiting = waiting
        self.workers: list[_Worker] = []
        self.deaths: dict[tuple[str, tuple[int, ...]], int] = {}
        self.failed_starts = 0
        self.patience = _PATIENCE

    def run(self, workers: int, warm_up: Sequence[Scene], meanwhile: Callable[[], None]) -> Iterator[tuple[Case, Any]]:
        for k in range(min(workers, len(self.waiting))):
            self._start(() if k else warm_up)
        meanwhile()
        while self.waiting or any(worker.batch for worker in self.workers):
            for connection in wait([worker.connection for worker in self.workers]):
                worker = next(w for w in self.workers if w.connection is connection)
                try:
                    message = worker.connection.recv()
                except (EOFError, OSError):
                    yield from self._bury(worker)
                    continue
                if message is None:
                    worker.ready = True
                    worker.compiles = False
                    self.failed_starts = 0
                solved = [(worker.batch.popleft(), result) for result in message or ()]
                self._give_all()  # first, so that they need not wait
                yield from solved
            while len(self.workers) < min(workers, len(self.workers) + len(self.waiting)):
                self._start(())

    def _start(self, warm_up: Sequence[Scene]) -> None:
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=_work, args=(theirs, self.solve, list(warm_up)), daemon=True)
        # Ctrl-C goes to every process of the terminal: it is this one's to handle. Starting multiprocessing's own
        # helper lets interrupts through again, so that comes first.
        resource_tracker.ensure_running()
        with limited_threads(), _interrupts_held():
            process.start()
        theirs.close()
        self.workers.append(_Worker(process, ours, compiles=bool(warm_up)))

    def _give_all(self) -> None:
        """Give batches to all workers that have none, unless kernels are still being compiled."""
        if not any(worker.compiles for worker in self.workers):
            for worker in self.workers:
                if worker.ready and not worker.batch and self.waiting:
                    self._give(worker)

    def _give(self, worker: _Worker) -> None:
        batch = self.waiting.popleft()
        worker.batch = deque(batch)
        worker.at_once = self.patience == 0.0
        # a worker that has just died is found out at the next wait
        with contextlib.suppress(OSError):
            worker.connection.send(([case.scene for case in batch], self.patience))

    def _bury(self, worker: _Worker) -> Iterator[tuple[Case, Result]]:
        """Deal with a dead worker: its case again or given up, the rest of its batch to others."""
        self.workers.remove(worker)
        worker.connection.close()
        worker.process.join()
        how = _how_it_died(worker.process.exitcode)
        self.patience = 0.0
        if not worker.ready:
            self.failed_starts += 1
            if self.failed_starts >= _FAILED_STARTS and not any(w.ready for w in self.workers):
                raise UserError(
                    f"worker processes do not start ({how}); in a script, call rcstudy under "
                    'if __name__ == "__main__", or use one worker'
                )
        if worker.batch and worker.at_once:
            case = worker.batch[0]
            deaths = self.deaths[case.grid, case.index] = self.deaths.get((case.grid, case.index), 0) + 1
            if deaths >= ATTEMPTS:
                worker.batch.popleft()
                yield case, Result(Status.ERROR, f"the worker process died {deaths} times at this case: {how}")
        if worker.batch:
            self.waiting.appendleft(list(worker.batch))
        self._give_all()  # those that waited for this one

    def stop(self) -> None:
        """End all workers. They hold nothing that is wanted, and to leave by themselves would take them a while."""
        for worker in self.workers:
            worker.process.terminate()
        deadline = time.monotonic() + 1.0
        for worker in self.workers:
            worker.process.join(max(0.0, deadline - time.monotonic()))
            if worker.process.is_alive():
                worker.process.kill()
                worker.process.join()
            worker.connection.close()
        self.workers.clear()


def _work(connection: Connection, solve: Callable[[Sequence[Scene]], Iterator[Any]], warm_up: list[Scene]) -> None:
    """A worker's life: ready, then a batch in, its results out, until it is ended or the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where they could not be held back from the start
    for scenes in ([], *([scene] for scene in warm_up)):  # with no scene, what solves is loaded
        for _ in solve(scenes):
            pass
    try:
        connection.send(None)
        while True:
            scenes, patience = connection.recv()
            results, sent = [], time.monotonic()
            for result in solve(scenes):
                results.append(result)
                if time.monotonic() - sent >= patience:
                    connection.send(results)
                    results, sent = [], time.monotonic()
            if results:
                connection.send(results)
    except (EOFError, OSError):
        pass  # the parent has gone, and with it whoever wanted the results


def _how_it_died(code: int | None) -> str:
    if code is not None and code < 0:
        try:
            return f"killed by {signal.Signals(-code).name}"
        except ValueError:
            return f"killed by signal {-code}"
    return f"exit code {code}"


@contextlib.contextmanager
def _interrupts_held() -> Iterator[None]:
    """Hold Ctrl-C back in the block; processes started in it never see one, this one does afterwards."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
