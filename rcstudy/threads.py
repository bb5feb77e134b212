"""Processors and memory that a process may use, and one thread per process.

Cases run side by side in processes, so threads of numerical libraries only slow them down. The variables are read when
the libraries are first imported, so they are set before that: in the command line's entry, and in the environment in
which worker processes start. Importing rcstudy as a library sets nothing.
"""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Iterator
from pathlib import Path

_GROUP = Path("/sys/fs/cgroup")  # limits of a container; "max" where there is none
THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def available_cores() -> int:
    """Number of processors this process may use: the machine's, those it is bound to, or its group's share of time.

    A share of one and a half counts as two.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    with contextlib.suppress(OSError, ValueError):
        quota, period = (float(time) for time in (_GROUP / "cpu.max").read_text().split())
        cores = min(cores, max(math.ceil(quota / period), 1))
    return cores


def available_memory() -> float:
    """Memory (bytes) that processes here may have in all: the machine's, or their group's limit; inf if not known."""
    limits = [math.inf]
    with contextlib.suppress(AttributeError, ValueError, OSError):  # not on every system
        limits.append(float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")))
    with contextlib.suppress(OSError, ValueError):
        limits.append(float((_GROUP / "memory.max").read_text()))
    return min(limit for limit in limits if limit > 0.0)


def limit_threads() -> None:
    """Set the variables for this process and those it starts."""
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))


@contextlib.contextmanager
def limited_threads() -> Iterator[None]:
    """Set the variables for processes started inside the block."""
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
