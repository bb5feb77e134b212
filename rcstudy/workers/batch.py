"""Batches of cases that share a normal problem: making them, solving them, and compiling kernels for them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from rcstudy.mechanics.scene import Mesh, quasi_identical

if TYPE_CHECKING:
    from rcstudy.cases import Case
    from rcstudy.mechanics.scene import Scene
    from rcstudy.result import Result
    from rcstudy.study import Study
    from rcstudy.studyfile.grid_plan import GridPlan

_BATCHES_PER_WORKER = 4  # so that workers end at about the same time
SMALLEST_BATCH, LARGEST_BATCH = 8, 64  # cases; each part of a split batch solves for its pressure again


def make_batches(cases: Sequence[Case], workers: int) -> list[list[Case]]:
    """Batches of consecutive cases with the same normal problem, small enough to keep `workers` busy to the end.

    Those that are too many for one batch are divided evenly: of large batches and small rests in turn, every n-th would
    be large ones alone or rests alone, and shards would have very different shares.
    """
    from rcstudy.cases import normal_problem

    if workers == 1:
        limit = len(cases)
    else:
        share = -(-len(cases) // (_BATCHES_PER_WORKER * workers))
        limit = min(max(share, SMALLEST_BATCH), LARGEST_BATCH)
    batches: list[list[Case]] = []
    for _, alike in itertools.groupby(cases, key=lambda case: normal_problem(case.scene)):
        shared = list(alike)
        parts = -(-len(shared) // limit)
        size = -(-len(shared) // parts)
        batches += [shared[start : start + size] for start in range(0, len(shared), size)]
    return batches


def solve_batch(scenes: Sequence[Scene], *, series: bool = False) -> Iterator[Result]:
    """As :func:`rcstudy.solve.solve_group`, whose module is only loaded where cases are solved."""
    from rcstudy.solve import solve_group

    return solve_group(scenes, series=series)


def solve_series(scenes: Sequence[Scene]) -> Iterator[Result]:
    """As `solve_batch`; each scene starts from the tractions of the nearest creepage solved before, if near enough."""
    return solve_batch(scenes, series=True)


def warm_up_scenes(study: Study) -> list[Scene]:
    """Small scenes, one of each kind in `study`, whose solution compiles the kernels that its cases will use.

    A few that only contacts on many cells need may be left. The scenes do not share a normal problem, so each has to be
    solved by itself.
    """
    found: dict[tuple[object, ...], Scene] = {}
    for grid in study.grids:
        for index in _of_each_kind(grid):
            scene = grid.scene(index)
            found.setdefault(_kind(scene), _small(scene))
    return list(found.values())


def _small(scene: Scene) -> Scene:
    """A scene of the kind of `scene` on few cells; its layers, if any, are of another material than what is below."""
    if scene.layers and not scene.joined.layers:
        scene = replace(scene, layers=tuple(replace(layer, E=2.0 * layer.E) for layer in scene.layers))
    return replace(scene, mesh=Mesh(scene.mesh.size, (32, 32)))


def _kind(scene: Scene) -> tuple[object, ...]:
    """The properties of `scene` that determine which code solves it.

    They include whether its bodies are quasi-identical, even with layers, where that does not matter, and whether there
    are layers, even of the substrate's material. Each axis of a grid can therefore be examined by itself, whatever the
    values on the others.
    """
    other = scene.counterbody
    return (
        scene.method,
        scene.coupling,
        scene.discretisation,
        scene.creepage is None,
        bool(scene.layers),
        other is None,
        quasi_identical(scene.substrate, other),
    )


def _of_each_kind(grid: GridPlan) -> Iterator[tuple[int, ...]]:
    """Indices of a few cases of `grid`, at least one of every kind that it has.

    Each axis is examined by itself, with the others at their first values, as there may be a million cases.
    """
    from rcstudy.studyfile.build import build_without_mesh

    first = (0,) * len(grid.axes)
    chosen = []
    for k, n in enumerate(grid.shape):
        kinds: dict[tuple[object, ...], int] = {}
        for i in range(n):
            kinds.setdefault(_kind(build_without_mesh(grid.parts((*first[:k], i, *first[k + 1 :])))), i)
        chosen.append(kinds.values())
    return itertools.product(*chosen)
