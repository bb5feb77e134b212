"""Processors and memory that a process may use, and one thread per process.

Cases run side by side in processes, so threads of numerical libraries only slow them down. The variables are read when
the libraries are first imported, so they are set before that: in the command line's entry, and in the environment in
which worker processes start. Importing rcstudy as a library sets nothing.
"""

from __future__ import annotations

import contextlib
import math
import os
import threading
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

_GROUP = Path("/sys/fs/cgroup")  # limits of groups of processes, such as a container's or a batch job's
_MEMBERSHIP = Path("/proc/self/cgroup")  # which groups this process is in
_NO_LIMIT = 2**62  # bytes: version 1 writes about 2**63 where there is no limit
THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_LIMITING = threading.RLock()


def available_cores() -> int:
    """Number of processors this process may use: the machine's, those it is bound to, or its groups' share of time.

    A share of one and a half counts as two.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    for folder in _groups("cpu"):
        for files in (["cpu.max"], ["cpu.cfs_quota_us", "cpu.cfs_period_us"]):  # of version 2, of version 1
            share = _numbers(folder, *files)
            if len(share) == 2 and min(share) > 0:
                cores = min(cores, -(-share[0] // share[1]))
    return cores


def available_memory() -> float:
    """Memory (bytes) that processes here may have in all: the machine's, or their groups' limit; inf if not known."""
    limits = [math.inf]
    with contextlib.suppress(AttributeError, ValueError, OSError):  # not on every system
        limits.append(float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")))
    for folder in _groups("memory"):
        for file in ("memory.max", "memory.limit_in_bytes"):
            limit = _numbers(folder, file)
            if len(limit) == 1 and limit[0] < _NO_LIMIT:
                limits.append(float(limit[0]))
    return min(limit for limit in limits if limit > 0.0)


def _groups(controller: str) -> set[Path]:
    """Folders that may hold limits for this process: of its groups and all groups these are in, of either version.

    Some may not exist: a container sees its own group as the root, under the path that the group has outside.
    """
    found = {_GROUP, _GROUP / controller}
    with contextlib.suppress(OSError, ValueError):
        for line in _MEMBERSHIP.read_text().splitlines():
            _, controllers, path = line.split(":", 2)  # no controllers: version 2, one tree for all
            if controller in controllers.split(",") or not controllers:
                group = PurePosixPath(path.lstrip("/"))
                for root in {_GROUP / controllers, _GROUP / controller} if controllers else {_GROUP}:
                    found.update(root / part for part in (group, *group.parents) if ".." not in part.parts)
    return found


def _numbers(folder: Path, *files: str) -> list[int]:
    """The numbers in these files; none if any cannot be read or holds anything else, such as "max"."""
    try:
        return [int(word) for file in files for word in (folder / file).read_text().split()]
    except (OSError, ValueError):
        return []


def limit_threads() -> None:
    """Set the variables for this process and those it starts."""
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))


@contextlib.contextmanager
def limited_threads() -> Iterator[None]:
    """Set the variables for processes started inside the block; other threads wait with theirs."""
    with _LIMITING:
        before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
        limit_threads()
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    os.environ.pop(name, None)
                else:
                    os.environ[name] = value
