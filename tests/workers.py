"""Stand-ins for the solver that worker processes import by name."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import synthetic

from rcstudy.mechanics.scene import Scene
from rcstudy.result import Result, Status
from rcstudy.threads import THREAD_VARIABLES

DEADLY_LOAD = 60.0


def made_up(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Made-up results."""
    for scene in scenes:
        yield synthetic.made_up_result(scene)


def by_kernels(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Made-up results, if a few kernels give what they should."""
    from rcstudy.mechanics.kernels import outline, rows, stick

    for scene in scenes:
        found = stick.border_ahead(1.0, 2.0), outline.sector(1.0, 0.0, 0.0, 1.0), rows.to_root(3.0, -2.0, -1.0)
        if not np.allclose(found, (1.0 / 3.0, np.pi / 4.0, 1.0), rtol=1e-14):
            raise ArithmeticError(f"kernels give {found}")
        yield synthetic.made_up_result(scene)


def slowly(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Made-up results, 10 ms each."""
    for scene in scenes:
        time.sleep(0.01)
        yield synthetic.made_up_result(scene)


def waits_for_the_first(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Made-up results; the second takes until the folder ARRIVED holds a file, or a minute."""
    until = time.monotonic() + 60.0
    for k, scene in enumerate(scenes):
        while k == 1 and not any(Path(os.environ["ARRIVED"]).iterdir()) and time.monotonic() < until:
            time.sleep(0.01)
        yield synthetic.made_up_result(scene)


def never(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Ends its process: it should not have been called."""
    os._exit(77)


def dies(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Kills its process at a load of DEADLY_LOAD with a lateral creepage."""
    for scene in scenes:
        if scene.load == DEADLY_LOAD and scene.creepage.lateral and scene.mesh.cells != (16, 16):
            os.kill(os.getpid(), signal.SIGKILL)
        yield synthetic.made_up_result(scene)


def dies_once(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Kills its process at a load of DEADLY_LOAD the first time; the folder DEATHS tells."""
    for scene in scenes:
        mark = Path(os.environ["DEATHS"]) / "died"
        if scene.load == DEADLY_LOAD and scene.mesh.cells != (16, 16) and not mark.exists():
            mark.touch()
            os._exit(9)
        yield synthetic.made_up_result(scene)


def dies_early(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Kills its process at a load of 30 the first time, in the third batch or so; the folder DEATHS tells."""
    for scene in scenes:
        mark = Path(os.environ["DEATHS"]) / "died"
        if scene.load == 30.0 and not mark.exists():
            mark.touch()
            os._exit(9)
        yield synthetic.made_up_result(scene)


def notes(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Made-up results; leaves a file for each process and load in the folder NOTES."""
    for scene in scenes:
        (Path(os.environ["NOTES"]) / f"{os.getpid()} {scene.load}").touch()
        yield synthetic.made_up_result(scene)


def notes_groups(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Made-up results; leaves a file with the number of scenes given at once, and their couplings, in NOTES."""
    if scenes:
        (Path(os.environ["NOTES"]) / f"{len(scenes)} {scenes[0].coupling}").touch()
    for scene in scenes:
        yield synthetic.made_up_result(scene)


def tells_environment(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Fails with the process's number, thread variables and parent as the reason."""
    for _ in scenes:
        threads = ",".join(os.environ.get(name, "unset") for name in THREAD_VARIABLES)
        yield Result(Status.ERROR, f"{os.getpid()} {threads}")


def tells_interrupts(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Fails with the process's number and whether interrupts are held back from it as the reason."""
    for _ in scenes:
        held = signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, set())
        yield Result(Status.ERROR, f"{os.getpid()} {'held' if held else 'open'}")


class Unloadable:
    """A solver that no worker can load."""

    def __call__(self, scenes: Sequence[Scene]) -> Iterator[Result]:
        raise AssertionError("never called")

    def __reduce__(self) -> tuple[object, tuple[int]]:
        return os._exit, (5,)


def slow(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Made-up results after 20 ms; the file SOLVED tells which process solved what."""
    for scene in scenes:
        time.sleep(0.02)
        with Path(os.environ["SOLVED"]).open("a") as log:
            log.write(f"{os.getpid()} {told_as(scene)}\n")
        yield synthetic.made_up_result(scene)


def told_as(scene: Scene) -> str:
    """What `slow` writes of a scene."""
    return f"{scene.load} {scene.creepage}"


def fails_to_travel(scenes: Sequence[Scene]) -> Iterator[Result]:
    """A result at DEADLY_LOAD that cannot be sent anywhere."""
    for scene in scenes:
        result = synthetic.made_up_result(scene)
        if scene.load == DEADLY_LOAD and scene.creepage.lateral:
            result.reason = threading.Lock()  # type: ignore[assignment]
        yield result


def gone(group: int) -> bool:
    """Whether all processes of a group come to an end; multiprocessing's own helper takes a moment to notice."""
    for _ in range(100):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False
