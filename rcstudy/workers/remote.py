"""What runs on the workers of a cluster: the solution of a parcel of batches, and a report on versions before that."""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcstudy.mechanics import SOLVER_VERSION
from rcstudy.provenance import version

if TYPE_CHECKING:
    from rcstudy.mechanics.scene import Scene

_LIBRARIES = ("numpy", "scipy", "numba", "pyfftw")  # those that affect the numbers
_THREADS = "OMP_NUM_THREADS"
_NUMBERS = "mechanics/**/*.py", "bars/**/*.py", "solve.py", "result.py"  # files of the package that make results


def solve_parcel(solve: Callable[[Sequence[Scene]], Iterator[Any]], batches: Sequence[Sequence[Scene]]) -> list[Any]:
    """Solve `batches` on a worker; returns what `solve` yields, in order.

    Stops early, with an incomplete list that nobody reads, when the task has been cancelled.
    """
    results: list[Any] = []
    for scenes in batches:
        for result in solve(scenes):
            results.append(result)
            if not _wanted():
                return results
    return results


def _wanted() -> bool:
    """Whether the task of this thread has not been cancelled."""
    from distributed.worker import get_worker, thread_state

    task = get_worker().state.tasks.get(thread_state.key)
    return task is not None and task.state in ("executing", "long-running")


def examine() -> dict[str, str]:
    """What the results of the calling process depend on: versions of solver, code and libraries; number of threads."""
    return {
        "solver": SOLVER_VERSION,
        "rcstudy": version("rcstudy"),
        "code": _digest_of_numbers(),
        "python": platform.python_version(),
        **{name: version(name) for name in _LIBRARIES},
        _THREADS: os.environ.get(_THREADS, "not set"),
    }


def paused_workers(dask_scheduler: Any = None) -> set[str]:
    """Addresses of the workers that Dask has paused, on the scheduler that calls this: they start nothing new."""
    return {address for address, worker in dask_scheduler.workers.items() if worker.status.name == "paused"}


def _digest_of_numbers() -> str:
    """SHA-256 (hex) of the code that results come from: checkouts of one version may have been edited."""
    package = Path(__file__).parent.parent
    digest = hashlib.sha256()
    for path in sorted(path for name in _NUMBERS for path in package.glob(name)):
        digest.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def differences(ours: Mapping[str, str], theirs: Mapping[str, str] | Exception) -> str:
    """Why a process that was examined must not solve for this one; "" if it may."""
    if isinstance(theirs, Exception):
        # Dask passes some exceptions on as objects, others as text
        if isinstance(theirs, ImportError) or "ModuleNotFoundError" in str(theirs) or "ImportError" in str(theirs):
            return f"it cannot import rcstudy: {theirs}; install the same version with the extra `cluster` there"
        return f"it cannot be examined: {type(theirs).__name__}: {theirs}"
    if theirs["solver"] != ours["solver"]:
        return f"its solver is version {theirs['solver']}, here it is {ours['solver']}: install the same rcstudy"
    if theirs["rcstudy"] != ours["rcstudy"]:
        return f"its rcstudy is version {theirs['rcstudy']}, here it is {ours['rcstudy']}"
    return ""


def notes_on(ours: Mapping[str, str], theirs: Mapping[str, str], threads: int) -> Iterator[str]:
    """Warnings on a worker with so many `threads` that may solve nevertheless."""
    if theirs.get("code") != ours["code"]:
        yield "the files of its rcstudy are others than here, of the same version: numbers may differ"
    for name in ("python", *_LIBRARIES):
        if theirs[name] != ours[name]:
            yield f"{name} {theirs[name]}, here {ours[name]}: last digits may differ"
    if threads > 1:
        yield f"{threads} threads, of which one is used: start workers with --nthreads 1 --nworkers {threads}"
    if theirs[_THREADS] != "1":
        yield f"{_THREADS} is {theirs[_THREADS]}: set it to 1, or numerical libraries may start threads of their own"
