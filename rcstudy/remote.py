"""What a worker of a cluster runs: a few batches of cases after one another; and what it tells of itself before."""

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

_LIBRARIES = ("numpy", "scipy", "numba", "pyfftw")  # those that numbers come from
_THREADS = "OMP_NUM_THREADS"


def solve_parcel(solve: Callable[[Sequence[Scene]], Iterator[Any]], batches: Sequence[Sequence[Scene]]) -> list[Any]:
    """Solve `batches` on a worker: what `solve` yields, in order.

    Ends early, with what is of no more use, when nobody wants the results any longer.
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
    """What results depend on, of the process that calls this: solver, code, libraries, threads."""
    return {
        "solver": SOLVER_VERSION,
        "rcstudy": version("rcstudy"),
        "mechanics": _digest_of_mechanics(),
        "python": platform.python_version(),
        **{name: version(name) for name in _LIBRARIES},
        _THREADS: os.environ.get(_THREADS, "not set"),
    }


def _digest_of_mechanics() -> str:
    """Hash (hex) of the code that numbers come from: a checkout may have been edited since."""
    package = Path(__file__).parent / "mechanics"
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        digest.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def differences(ours: Mapping[str, str], theirs: Mapping[str, str] | Exception) -> str:
    """Why a process that was examined must not solve for this one; "" if it may."""
    if isinstance(theirs, Exception):
        # Dask passes some exceptions on as themselves, others as words
        if isinstance(theirs, ImportError) or "ModuleNotFoundError" in str(theirs) or "ImportError" in str(theirs):
            return f"it cannot import rcstudy: {theirs}; install the same version with the extra `cluster` there"
        return f"it cannot be examined: {type(theirs).__name__}: {theirs}"
    if theirs["solver"] != ours["solver"]:
        return f"its solver is version {theirs['solver']}, here it is {ours['solver']}: install the same rcstudy"
    if theirs["rcstudy"] != ours["rcstudy"]:
        return f"its rcstudy is version {theirs['rcstudy']}, here it is {ours['rcstudy']}"
    return ""


def notes_on(ours: Mapping[str, str], theirs: Mapping[str, str], threads: int) -> Iterator[str]:
    """What a person should know of a worker with so many threads, which may solve all the same."""
    if theirs["mechanics"] != ours["mechanics"]:
        yield "the files of its rcstudy/mechanics are others than here, of the same version: numbers may differ"
    for name in ("python", *_LIBRARIES):
        if theirs[name] != ours[name]:
            yield f"{name} {theirs[name]}, here {ours[name]}: last digits may differ"
    if threads > 1:
        yield f"{threads} threads, of which one is used: start workers with --nthreads 1 --nworkers {threads}"
    if theirs[_THREADS] != "1":
        yield f"{_THREADS} is {theirs[_THREADS]}: set it to 1, or numerical libraries may start threads of their own"
