"""Threads of a process take turns at solving, as buffers for transforms and for linear systems are shared by all."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

_TURN = threading.RLock()
# A process forked meanwhile would have the lock, but not the thread that holds it, and wait for ever.
if hasattr(os, "register_at_fork"):  # not on every system
    os.register_at_fork(before=_TURN.acquire, after_in_parent=_TURN.release, after_in_child=_TURN.release)


@contextmanager
def one_at_a_time() -> Iterator[None]:
    """Solve in the block: other threads wait, and so do forks of this process.

    What underflows is nil, as some terms of layers do, even if the process is to raise errors (`numpy.seterr`).
    """
    with _TURN, np.errstate(under="ignore"):
        yield
