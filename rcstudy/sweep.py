"""Runs a study: solves its cases, in batches that share a normal problem, here or in other processes, into a cube.

Results are written to the disk as they come (:mod:`rcstudy.store`); cases that are solved there are not solved again.
The cube is made from them, in the study's order, while other cases are still being solved (:mod:`rcstudy.assemble`).
"""

from __future__ import annotations

import contextlib
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rcstudy import provenance, threads
from rcstudy.assemble import Assembly
from rcstudy.errors import UserError, is_interrupt
from rcstudy.progress import Progress, Silent, announced_if_slow, counted
from rcstudy.result import Result, Status
from rcstudy.storage.layout import case_label, lay_out
from rcstudy.storage.record import DamagedRecord, Keep, Packed, Packer, Packing
from rcstudy.storage.steady import interrupts_remembered
from rcstudy.store import DISK_FULL, Store, opened
from rcstudy.workers import cluster, pool
from rcstudy.workers.batch import make_batches, solve_batch, solve_series, warm_up_scenes

if TYPE_CHECKING:
    from rcstudy.cases import Case, Expansion
    from rcstudy.storage.index import Index
    from rcstudy.study import Study
    from rcstudy.studyfile.spec import OutputsSpec

_SECONDS_TO_JUDGE = 1.0  # of solving, before the time that is left is estimated
_SECONDS_WORTH_WORKERS = 15.0  # estimated to be left for one process: with more, workers are started
_LATE = "no case is solved yet: kernels not used here before are compiled first, for up to a minute"
_LATE_ON_CLUSTER = (
    "no case is solved yet: waiting for the scheduler and its workers, where kernels not used before are compiled first"
)


@dataclass(frozen=True)
class Failure:
    """A case that was not solved: where, its name, how it ended and why."""

    grid: str
    label: str
    status: Status
    reason: str


@dataclass
class Summary:
    """What a sweep did: number of `cases`, which of them failed, `seconds` of wall time, the cube at `output`.

    `kept` of the cases had been solved before; `otherwise`: how many of these in a cube that another revision of
    rcstudy wrote, and which, (0, "") if none is known to be. A shard of a sweep counts its own cases alone.
    """

    output: Path
    cases: int = 0
    seconds: float = 0.0
    failures: list[Failure] = field(default_factory=list)
    kept: int = 0
    otherwise: tuple[int, str] = (0, "")

    @property
    def failed(self) -> int:
        """Number of cases that are not solved."""
        return len(self.failures)

    @property
    def solved(self) -> int:
        """Number of solved cases."""
        return self.cases - self.failed


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a sweep; `solved` of its `cases` are kept, and the same command resumes from there."""

    def __init__(self, solved: int, cases: int) -> None:
        super().__init__(f"{solved} of {cases} cases are kept")
        self.solved = solved
        self.cases = cases

    def __reduce__(self) -> tuple[type[Interrupted], tuple[int, int]]:
        """With both numbers, so that it can be sent to another process."""
        return Interrupted, (self.solved, self.cases)


@dataclass(frozen=True)
class _Means:
    """How a sweep solves its cases, and whom it tells: arguments of :func:`run`."""

    workers: int | None
    scheduler: cluster.Scheduler | None
    processes: pool.Pool
    solve: Packing
    progress: Progress
    say: Callable[[str], None]

    @property
    def most_at_once(self) -> int:
        """How many processes of this machine may solve."""
        return self.workers or (threads.available_cores() if pool.may_start() else 1)

    def patiently(self, text: str) -> contextlib.AbstractContextManager[None]:
        """Say `text` if the block is slow, but only if progress is reported."""
        return contextlib.nullcontext() if isinstance(self.progress, Silent) else announced_if_slow(self.say, text)


def run(
    study: Study,
    output: Path | str,
    *,
    workers: int | None = None,
    processes: pool.Pool | None = None,
    scheduler: cluster.Scheduler | None = None,
    progress: Progress | None = None,
    solve: pool.Solve | None = None,
    fresh: bool = False,
    series: bool = False,
    shard: tuple[int, int] | None = None,
    take_over: bool = False,
    tell: Callable[[str], None] | None = None,
) -> Summary:
    """Solve all cases of `study` and write the cube `output`, which is replaced only when all is done.

    Cases that an earlier run solved, for this study or for an earlier version of its file, are taken over; failed ones
    are solved again. `fresh`: none are taken over. `series`: a case starts from the solution for a close creepage,
    which is faster in dense series; results then depend on the order of cases: with `kalker` within the tolerance, with
    `aligned` see docs/scaling.md. `shard` (i, n): solve the i-th of n parts only and leave the results for
    :func:`rcstudy.merge.merge`; no cube is written. `take_over`: go on even if another machine left its lock.

    `workers` is the number of processes that solve; 1 is this process alone. By default this process begins, and hands
    over to one worker per processor if what is left is worth starting them and it is not a daemonic process, which can
    have none; with `scheduler` the workers of a Dask cluster solve all cases instead. `processes`: a pool whose workers
    may have been started already. `progress` is told of each case, `tell` is called with messages for the user; `solve`
    takes the place of :func:`rcstudy.workers.batch.solve_batch`. A case that fails gets its status and reason, and the
    batch goes on.

    Raises UserError when the cube cannot be written or another process is at work on it, Interrupted when
    interrupted. A cube that was there before then stays as it was, and the results so far are kept beside it.
    """
    from rcstudy.cases import expand

    started = time.monotonic()
    if workers is not None and workers < 1:
        raise UserError(f"workers: {workers}: a number of at least 1")
    if workers is not None and scheduler is not None:
        raise UserError("choose local workers or a scheduler, not both")
    if fresh and shard is not None:
        raise UserError("--fresh cannot be used with --shard: delete the units folder first")
    if scheduler is not None:
        cluster.check(scheduler)
    say = tell or (lambda text: None)
    packing = Packing(solve or (solve_series if series else solve_batch), keep_of(study.outputs))
    with contextlib.ExitStack() as stack:
        if processes is None:
            processes = stack.enter_context(pool.Pool())
            processes.start_early(workers)
        processes.prepare(packing, warm_up_scenes(study))
        expansion = expand(study)
        cases = expansion.cases if shard is None else shard_of(expansion.cases, shard)
        summary = Summary(Path(output), len(cases))
        store = stack.enter_context(
            opened(
                summary.output,
                study.name,
                expansion.cases,
                packing.keep,
                tell=say,
                fresh=fresh,
                shard=shard,
                take_over=take_over,
            )
        )
        pending = unsolved(cases, store.index)
        if pending or not _is_done(store, study, expansion, None if shard is None else cases, say):
            means = _Means(workers, scheduler, processes, packing, progress or Silent(), say)
            pending = _left(pending, summary, cases, store, means, whole=shard is None)
            _complete(pending, summary, cases, store, means, study, expansion, started, whole=shard is None)
        else:
            _count_kept(summary, cases, pending, store.index)
    summary.seconds = time.monotonic() - started
    return summary


def _left(
    pending: list[Case], summary: Summary, cases: Sequence[Case], store: Store, means: _Means, *, whole: bool
) -> list[Case]:
    """Those of `cases` that are to be solved: `pending`, and damaged ones of the cube.

    Says what is kept, and, of a `whole` study, what an earlier cube loses.
    """
    from rcstudy.plan import lack_of_memory

    known = counted(store.index.in_cube_count, "case")
    with means.patiently(f"reading {known} in {summary.output} that are solved already"):
        damaged = store.index.check_cube()
    if damaged:
        means.say(f"{summary.output}: {damaged} of its cases are damaged and solved again")
        pending = unsolved(cases, store.index)
    if whole:
        store.tell_losses(summary.output, means.say)
    _count_kept(summary, cases, pending, store.index)
    if summary.kept:
        means.say(f"{summary.kept} of {len(cases)} cases are solved already and kept")
    at_work = min(means.most_at_once, max(len(pending), 1))
    if means.scheduler is None and (lacking := lack_of_memory(pending, at_work)):
        means.say(lacking)
    return pending


def _complete(
    pending: Sequence[Case],
    summary: Summary,
    cases: Sequence[Case],
    store: Store,
    means: _Means,
    study: Study,
    expansion: Expansion,
    started: float,
    *,
    whole: bool,
) -> None:
    """Solve the `pending` ones of `cases`, and write the cube of a `whole` study, begun at `started`."""
    store.expect(case.key for case in pending)
    with _interrupts(cases, store) as check_interrupts, contextlib.ExitStack() as making:
        cube = making.enter_context(Assembly(summary.output, study, expansion, store)) if whole else None
        late = means.patiently(_LATE if means.scheduler is None else _LATE_ON_CLUSTER)
        with contextlib.closing(_announced(_results(pending, means), late)) as results:
            attributes = _keep_all(results, pending, store, means.progress, check_interrupts, cube)
        summary.failures = failures(expansion, cases, store.index)
        if cube is not None:
            with means.patiently(f"writing {summary.output}"):
                cube.finish(attributes, started, check_interrupts)
    if cube is not None:
        store.clear()


def _count_kept(summary: Summary, cases: Sequence[Case], pending: Sequence[Case], index: Index) -> None:
    """Note how many of `cases` are not `pending`, and how many of them a cube by another revision has, and which."""
    summary.kept = len(cases) - len(pending)
    written = "" if index.cube is None else index.cube.revision
    count = sum(index.in_cube(case.key) and index.status(case.key) == Status.SOLVED for case in cases) if written else 0
    own = provenance.revision() if count else None
    if own is not None and own != written:
        summary.otherwise = count, written


def keep_of(outputs: OutputsSpec) -> Keep:
    """What is kept of each result, according to the `outputs` of a study."""
    return Keep(outputs.fields, outputs.precision, outputs.crop == "contact")


def unsolved(cases: Sequence[Case], index: Index) -> list[Case]:
    """Those of `cases` that have no solution yet, whether missing or failed."""
    return [case for case in cases if index.status(case.key) != Status.SOLVED]


def shard_of(cases: Sequence[Case], shard: tuple[int, int]) -> list[Case]:
    """The cases of shard (i, n), 1 <= i <= n: every n-th batch that shares a normal problem, and all cases like these.

    Were equal cases of several grids in different shards, each would solve them, in series with different results.
    UserError if i is not one of 1 to n.
    """
    i, n = shard
    if not 1 <= i <= n:
        raise UserError(f"shard {i}/{n}: a number from 1 to {n}, and how many there are")
    unlike = list({case.key: case for case in cases}.values())
    chosen = {case.key for batch in make_batches(unlike, max(n, 2))[i - 1 :: n] for case in batch}
    return [case for case in cases if case.key in chosen]


def failures(expansion: Expansion, cases: Sequence[Case], index: Index) -> list[Failure]:
    """Those of `cases` that have a result but are not solved, in their order.

    UserError if the result of one can no longer be read.
    """
    grids = {grid.name: grid for grid in expansion.grids}
    found = []
    for case in cases:
        status = index.status(case.key)
        if status is not None and status != Status.SOLVED:
            label = case_label(grids[case.grid], case.index)
            try:
                reason = index.record(case.key).reason
            except DamagedRecord as error:
                raise UserError(f"{case.grid}: {label}: its result can no longer be read: {error}") from error
            found.append(Failure(case.grid, label, status, reason))
    return found


def _is_done(
    store: Store, study: Study, expansion: Expansion, shard: Sequence[Case] | None, say: Callable[[str], None]
) -> bool:
    """Whether the cube is of exactly this study and complete, and no units are left.

    The cube's values are not read. Missing variables are reported to `say`. A `shard`, given by its cases, has no cube
    to write, but has to read those in a cube, as damaged ones would be missing when shards are merged.
    """
    cube = store.index.cube
    if shard is not None:
        return not any(store.index.in_cube(case.key) for case in shard)
    if cube is None or cube.sha256 != study.sha256:
        return False
    if not store.is_empty or not all(store.index.in_cube(case.key) for case in expansion.cases):
        return False
    layouts, root = lay_out(expansion, fields=study.outputs.fields, precision=study.outputs.precision)
    missing = cube.missing({"": layouts[0]} if root is None else {"": root, **{own.name: own for own in layouts}})
    if missing:
        say(f"{', '.join(missing)} missing in the cube, which is rebuilt")
    return not missing


@contextlib.contextmanager
def _interrupts(cases: Sequence[Case], store: Store) -> Iterator[Callable[[], None]]:
    """Turn Ctrl-C in the block into Interrupted, once all results are on the disk; a UserError says what is kept."""

    def kept() -> int:
        with contextlib.suppress(UserError):
            store.flush()
        return store.index.kept(case.key for case in cases)

    try:
        with interrupts_remembered() as check:
            yield check
    except (KeyboardInterrupt, RuntimeError) as error:
        if not is_interrupt(error):
            raise
        raise Interrupted(kept(), len(cases)) from None
    except UserError as error:
        count = kept()
        if not count:
            raise
        message = f"{error}\n{count} of {len(cases)} cases are kept; rerun the same command to resume"
        if isinstance(error.__cause__, OSError) and error.__cause__.errno in DISK_FULL:
            message += " when there is room (rcstudy plan tells how much a cube needs)"
        raise UserError(message) from error


def _keep_all(
    results: Iterator[tuple[Case, Result | Packed]],
    pending: Sequence[Case],
    store: Store,
    reporter: Progress,
    check_interrupts: Callable[[], None],
    cube: Assembly | None,
) -> dict[str, str | int | float]:
    """Put all results into the store, and from there into the cube; report progress. Returns the run's provenance.

    This is collected, and the cube begun, after the first result, when the workers are busy.
    """

    def begun() -> dict[str, str | int | float]:
        collected = provenance.collect()
        if cube is not None:
            cube.begin()
        return collected

    def kept(write: Callable[[], None]) -> None:
        try:
            write()
        except UserError:  # results take precedence over the cube, which can be made again
            if cube is None or not cube.give_way():
                raise
            store.try_again()

    packer = Packer(store.index.keep)
    like = Counter(case.key for case in pending)
    reporter.begin(len(pending))
    attributes: dict[str, str | int | float] = {}
    try:
        for case, result in results:
            packed = packer.pack(result, case.scene.mesh.cells) if isinstance(result, Result) else result
            kept(partial(store.add, case.key, packed))
            check_interrupts()  # once the result is kept
            attributes = attributes or begun()
            for _ in range(like[case.key]):
                reporter.advance(failed=packed.status != Status.SOLVED)
            if cube is not None:
                cube.go_on()
        attributes = attributes or begun()
        kept(store.flush)
    finally:
        reporter.end()
    return attributes


def _announced(
    results: Generator[tuple[Case, Result | Packed], None, None], late: contextlib.AbstractContextManager[None]
) -> Generator[tuple[Case, Result | Packed], None, None]:
    """The `results`; `late`, held until the first one is there, says why it takes long, if it does."""
    with contextlib.closing(results):
        with late:
            first = next(results, None)
        if first is not None:
            yield first
            yield from results


def _results(pending: Sequence[Case], means: _Means) -> Generator[tuple[Case, Result | Packed], None, None]:
    """Each case with its result, as they come; of cases with the same key only one is solved."""
    cases = list({case.key: case for case in pending}.values())
    if means.scheduler is not None:
        yield from cluster.solve_on_cluster(make_batches(cases, 1), means.scheduler, means.solve, tell=means.say)
        return
    wanted = means.most_at_once
    batches = make_batches(cases, wanted)
    if means.workers is None or wanted == 1:
        batches = yield from _solved_here(batches, means.solve, hand_over=wanted > 1)
    yield from means.processes.solve(batches, wanted, means.solve, means.say)


def _solved_here(
    batches: list[list[Case]], solve: Packing, *, hand_over: bool
) -> Generator[tuple[Case, Packed], None, list[list[Case]]]:
    """Solve batches in this process; with `hand_over`, return those that are left once workers are worth starting.

    A worker takes seconds to start, longer than many whole studies take, so enough work must be left.
    """
    left = sum(len(batch) for batch in batches)
    done = 0
    begun = time.monotonic()
    for k, batch in enumerate(batches):
        yield from zip(batch, solve([case.scene for case in batch]), strict=True)
        left -= len(batch)
        if k == 0:
            begun = time.monotonic()  # the first batch loads or compiles the kernels
            continue
        done += len(batch)
        seconds = time.monotonic() - begun
        if hand_over and seconds >= _SECONDS_TO_JUDGE and left * seconds / done > _SECONDS_WORTH_WORKERS:
            return batches[k + 1 :]
    return []
