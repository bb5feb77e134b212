"""Threads of a process take turns at solving; forks wait for their turn, and what NumPy does about errors is given."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from typing import Any

import numpy as np
import pytest
from contacts import solved, steel

from rcstudy.mechanics.contact import forget_influence
from rcstudy.mechanics.scene import Creepage, Layer, Mesh
from rcstudy.mechanics.turns import one_at_a_time


def test_threads_take_turns() -> None:
    inside: list[int] = []

    def take_a_turn(k: int) -> None:
        with one_at_a_time(), one_at_a_time():  # a thread may take another one within its turn
            inside.append(k)
            time.sleep(0.01)
            inside.append(k)

    threads = [threading.Thread(target=take_a_turn, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(inside[::2]) == [0, 1, 2, 3]
    assert inside[::2] == inside[1::2]


FORK = """
import os, threading, time
from rcstudy.mechanics.turns import one_at_a_time

held = threading.Event()
ended = []

def hold():
    with one_at_a_time():
        held.set()
        time.sleep(0.2)
        ended.append(True)

threading.Thread(target=hold).start()
held.wait()
child = os.fork()
with one_at_a_time():
    if child == 0:
        os._exit(7 if ended else 1)
until = time.monotonic() + 20.0
while (found := os.waitpid(child, os.WNOHANG))[0] == 0 and time.monotonic() < until:
    time.sleep(0.01)
if found[0] == 0:
    os.kill(child, 9)
print(os.waitstatus_to_exitcode(found[1]) if found[0] else "it waits for ever")
other = threading.Thread(target=hold, daemon=True)
other.start()
other.join(20.0)
print(len(ended))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no forks on this system")
def test_a_process_forked_during_a_turn_can_have_its_own() -> None:
    """It is forked when the turn has ended, so that nothing is half done there; afterwards other threads have turns."""
    command = [sys.executable, "-W", "ignore", "-c", FORK]
    assert subprocess.run(command, capture_output=True, text=True, timeout=60).stdout == "7\n2\n"


@pytest.mark.parametrize("coupling", ["one-way", "full"])
def test_results_do_not_depend_on_what_numpy_does_about_errors(coupling: Any) -> None:
    """Influence coefficients of layers have terms that underflow."""
    scene = steel(
        Mesh((2.0, 2.0), (24, 24)),
        layers=(Layer(105000.0, 0.3, 0.2),),
        creepage=Creepage(0.002, 0.001, 0.0),
        coupling=coupling,
    )
    expected = solved(scene)
    forget_influence()
    with np.errstate(all="raise"):
        found = solved(scene)
    assert found.scalars == {**expected.scalars, "solve_seconds": found.scalars["solve_seconds"]}
