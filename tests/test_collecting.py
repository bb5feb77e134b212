"""Pauses of the garbage collector: none runs meanwhile, and afterwards it is as it was before."""

from __future__ import annotations

import gc

import pytest

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
