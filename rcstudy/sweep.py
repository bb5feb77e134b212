"""Runs a study: cases in batches that share a normal problem, solved here or in worker processes, into a cube."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from rcstudy import cluster, pool, provenance
from rcstudy.errors import UserError
from rcstudy.layout import case_label
from rcstudy.mechanics.scene import Mesh, Scene
from rcstudy.progress import Progress, Silent
from rcstudy.result import Result, Status
from rcstudy.steady import interrupts_remembered

if TYPE_CHECKING:
    from rcstudy.cases import Case, Expansion
    from rcstudy.study import Study

_BATCHES_PER_WORKER = 4  # so that workers end at about the same time
_SECONDS_TO_JUDGE = 1.0  # of solving, before the time of the whole is guessed
_SECONDS_WORTH_WORKERS = 15.0  # left to solve by one process
_SMALLEST_SPLIT, _LARGEST_BATCH = 8, 64  # cases; a batch that is split has its pressure solved again


@dataclass(frozen=True)
class Failure:
    """A case that was not solved: where, its name, how it ended and why."""

    grid: str
    label: str
    status: Status
    reason: str


@dataclass
class Summary:
    """What a sweep did: number of `cases`, which of them failed, `seconds` of wall time, the cube at `output`."""

    output: Path
    cases: int = 0
    seconds: float = 0.0
    failures: list[Failure] = field(default_factory=list)

    @property
    def failed(self) -> int:
        """Number of cases that are not solved."""
        return len(self.failures)

    @property
    def solved(self) -> int:
        """Number of solved cases."""
        return self.cases - self.failed


def run(
    study: Study,
    output: Path | str,
    *,
    workers: int | None = None,
    scheduler: cluster.Scheduler | None = None,
    progress: Progress | None = None,
    command: str | None = None,
    solve: pool.Solve | None = None,
) -> Summary:
    """Solve all cases of `study` and write the cube `output`, which is replaced only when all is done.

    `workers` is the number of processes that solve, 1 being this one alone. By default this one begins, and hands
    over to as many workers as there are processors if what is left is worth their start; with `scheduler` the workers
    of a Dask cluster solve all instead. `progress` is told of each case; `command` goes to the provenance; `solve`
    takes the place of :func:`rcstudy.solve.solve_group`. A case that fails gets its status and reason, and the batch
    goes on.

    Raises UserError when the cube cannot be written, KeyboardInterrupt when interrupted; the cube that was there
    before then stays as it was.
    """
    from rcstudy.cases import expand
    from rcstudy.cube_writer import write_cube

    started = time.monotonic()
    if workers is not None and workers < 1:
        raise UserError(f"workers: {workers}: a number of at least 1")
    if workers is not None and scheduler is not None:
        raise UserError("either workers of this machine or a scheduler, whose workers are started by themselves")
    expansion = expand(study)
    summary = Summary(Path(output))
    reporter = progress or Silent()
    with (
        interrupts_remembered() as check_interrupts,
        contextlib.closing(_results(expansion, workers, scheduler, solve or solve_batch)) as results,
    ):
        told = _told(results, expansion, summary, reporter, check_interrupts)
        write_cube(output, study, expansion, told, provenance.collect(command))
    summary.seconds = time.monotonic() - started
    return summary


def _told(
    results: Iterator[tuple[Case, Result]],
    expansion: Expansion,
    summary: Summary,
    reporter: Progress,
    check_interrupts: Callable[[], None],
) -> Iterator[tuple[Case, Result]]:
    """Pass results on, keeping the summary and the progress up to date."""
    grids = {grid.name: grid for grid in expansion.grids}
    reporter.begin(len(expansion.cases))
    try:
        for case, result in results:
            check_interrupts()
            summary.cases += 1
            failed = result.status != Status.SOLVED
            if failed:
                label = case_label(grids[case.grid], case.index)
                summary.failures.append(Failure(case.grid, label, Status(result.status), result.reason))
            reporter.advance(failed=failed)
            yield case, result
    finally:
        reporter.end()


def _results(
    expansion: Expansion, workers: int | None, scheduler: cluster.Scheduler | None, solve: pool.Solve
) -> Generator[tuple[Case, Result], None, None]:
    if scheduler is not None:
        yield from cluster.solve_on_cluster(make_batches(expansion.cases, 1), scheduler, solve)
        return
    wanted = workers or provenance.available_cores()
    batches = make_batches(expansion.cases, wanted)
    warm_up: Sequence[Scene] = ()
    if workers is None or wanted == 1:
        batches = yield from _solved_here(batches, solve, hand_over=wanted > 1)
    else:
        warm_up = warm_up_scenes(expansion.cases)
    if batches:
        yield from pool.solve_in_processes(batches, min(wanted, len(batches)), solve, warm_up)


def _solved_here(
    batches: list[list[Case]], solve: pool.Solve, *, hand_over: bool
) -> Generator[tuple[Case, Result], None, list[list[Case]]]:
    """Solve batches in this process; with `hand_over`, return those that are left once workers are worth starting.

    A worker takes seconds to start, more than many a whole study: it must have more than that to do.
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


def make_batches(cases: Sequence[Case], workers: int) -> list[list[Case]]:
    """Neighbouring cases with the same normal problem, in batches small enough to keep `workers` busy to the end."""
    from rcstudy.cases import normal_problem

    if workers == 1:
        limit = len(cases)
    else:
        share = -(-len(cases) // (_BATCHES_PER_WORKER * workers))
        limit = min(max(share, _SMALLEST_SPLIT), _LARGEST_BATCH)
    batches: list[list[Case]] = []
    last = None
    for case in cases:
        key = normal_problem(case.scene)
        if key != last or len(batches[-1]) >= limit:
            batches.append([])
        batches[-1].append(case)
        last = key
    return batches


def solve_batch(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Solve scenes that share a normal problem: a result each, in order, whatever the solver does."""
    from rcstudy.solve import solve_group

    done = 0
    while done < len(scenes):
        reason = "the solver gave no result"
        try:
            for result in solve_group(scenes[done:]):
                done += 1
                yield result
        except Exception as error:  # not the solver's own: it turns those into results
            reason = f"{type(error).__name__}: {error}"
        if done < len(scenes):
            done += 1
            yield Result(Status.ERROR, reason)


def warm_up_scenes(cases: Sequence[Case]) -> list[Scene]:
    """A few tiny scenes, one of each kind among `cases`, that have every kernel compiled that the cases will use."""
    kinds: dict[tuple[object, ...], Scene] = {}
    for case in cases:
        s = case.scene
        kind = (s.method, s.coupling, s.discretisation, s.counterbody is None, bool(s.layers), s.creepage is None)
        if kind not in kinds:
            kinds[kind] = replace(s, mesh=Mesh(s.mesh.size, (16, 16)))
    return list(kinds.values())
