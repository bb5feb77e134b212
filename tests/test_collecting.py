"""Pauses of the garbage collector: none runs meanwhile, and afterwards it is as it was before."""

from __future__ import annotations

import gc
import sys
from types import FrameType
from typing import Any

import pytest

from rcstudy.mechanics import collecting
from rcstudy.mechanics.collecting import nothing_collected


def test_pauses_end_however_their_blocks_do() -> None:
    assert gc.isenabled()
    with nothing_collected():
        with pytest.raises(KeyError), nothing_collected():
            raise KeyError(gc.isenabled())
        assert not gc.isenabled()
    assert gc.isenabled()


def test_functions_may_be_pauses_again_and_again() -> None:
    @nothing_collected()
    def collecting() -> bool:
        return gc.isenabled()

    assert [collecting(), collecting(), gc.isenabled()] == [False, False, True]


def test_a_collector_that_does_not_run_is_left_alone() -> None:
    gc.disable()
    try:
        with nothing_collected():
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()


def test_interrupts_at_any_line_leave_the_collector_running() -> None:
    """At each line that a pause runs, in turn."""

    def interrupted(line: int) -> bool:
        """Whether a pause came to an end by an interrupt at its `line`-th line."""
        left = line

        def trace(frame: FrameType, event: str, _: Any) -> Any:
            nonlocal left
            if frame.f_code.co_filename != collecting.__file__:
                return None
            if event == "line":
                left -= 1
                if left == 0:
                    raise KeyboardInterrupt
            return trace

        previous = sys.gettrace()
        sys.settrace(trace)
        try:
            with nothing_collected():
                pass
        except KeyboardInterrupt:
            return True
        finally:
            sys.settrace(previous)
        return False

    line = 1
    while interrupted(line):
        assert gc.isenabled(), line
        line += 1
    assert gc.isenabled() and line > 6
