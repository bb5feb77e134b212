"""Pauses of Python's garbage collector, where many objects are made that are no garbage."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def nothing_collected() -> Iterator[None]:
    """Keep the garbage collector from running in the block, or the function decorated; then it is as it was before.

    To look through all objects again and again takes an eighth of the time of compiling kernels, a third of that of
    making cases. What garbage there is stays until the next collection.
    """
    resume = gc.enable if gc.isenabled() else gc.disable
    try:  # twice, as an interrupt may come where the first one ends
        try:
            gc.disable()
            yield
        finally:
            resume()
    finally:
        resume()
