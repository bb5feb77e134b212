"""Batches of cases that share a normal problem: how they are made, and solved, here or in another process."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from rcstudy.mechanics.scene import Mesh
from rcstudy.result import Result, Status

if TYPE_CHECKING:
    from rcstudy.cases import Case
    from rcstudy.mechanics.scene import Scene

_BATCHES_PER_WORKER = 4  # so that workers end at about the same time
SMALLEST_SPLIT, LARGEST_BATCH = 8, 64  # cases; a batch that is split has its pressure solved again


def make_batches(cases: Sequence[Case], workers: int) -> list[list[Case]]:
    """Neighbouring cases with the same normal problem, in batches small enough to keep `workers` busy to the end."""
    from rcstudy.cases import normal_problem

    if workers == 1:
        limit = len(cases)
    else:
        share = -(-len(cases) // (_BATCHES_PER_WORKER * workers))
        limit = min(max(share, SMALLEST_SPLIT), LARGEST_BATCH)
    batches: list[list[Case]] = []
    last = None
    for case in cases:
        key = normal_problem(case.scene)
        if key != last or len(batches[-1]) >= limit:
            batches.append([])
        batches[-1].append(case)
        last = key
    return batches


def solve_batch(scenes: Sequence[Scene], *, series: bool = False) -> Iterator[Result]:
    """Solve scenes that share a normal problem: a result each, in order, whatever the solver does.

    `series`: see :func:`rcstudy.solve.solve_group`.
    """
    from rcstudy.solve import solve_group

    done = 0
    while done < len(scenes):
        reason = "the solver gave no result"
        try:
            for result in solve_group(scenes[done:], series=series):
                done += 1
                yield result
        except Exception as error:  # not the solver's own: it turns those into results
            reason = f"{type(error).__name__}: {error}"
        if done < len(scenes):
            done += 1
            yield Result(Status.ERROR, reason)


def solve_series(scenes: Sequence[Scene]) -> Iterator[Result]:
    """The same, those of close creepages starting from one another."""
    return solve_batch(scenes, series=True)


def warm_up_scenes(scenes: Iterable[Scene]) -> list[Scene]:
    """A few tiny scenes, one of each kind among `scenes`, that have every kernel compiled that those will use.

    They do not share a normal problem: each is to be solved by itself.
    """
    kinds: dict[tuple[object, ...], Scene] = {}
    for s in scenes:
        kind = (
            *(s.method, s.coupling, s.discretisation),
            *(s.counterbody is None, bool(s.layers), s.moves_by_pressure, s.creepage is None),
        )
        if kind not in kinds:
            kinds[kind] = replace(s, mesh=Mesh(s.mesh.size, (16, 16)))
    return list(kinds.values())
