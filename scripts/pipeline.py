"""Costs of a sweep: time besides solving, efficiency of two workers, and memory.

    python scripts/pipeline.py [--cases 2000] [--repeats 3] [--memory 10000]

Pipeline: time of a sweep by one process without that of the solver, per additional case and in all, as wall time (a
thread writes units beside the solver) and as processor time; layered cases of 64 x 64 cells with fields. Efficiency:
wall time of the whole command with one worker over twice that with two, for that many cases; beside it what the machine
itself allows: two commands at once, which share nothing, with half of the cases each. Memory: the largest sum of
resident memory (from /proc; memory that processes share is counted once for each) of a sweep of that many cases with
two workers.
"""

from __future__ import annotations

import argparse
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rcstudy.threads import limit_threads

if TYPE_CHECKING:
    from rcstudy.mechanics.scene import Scene
    from rcstudy.result import Result

STUDY = """\
study: pipeline
scene:
  substrate: {{E: 210000, nu: 0.3}}
  radius: 50
  load: 100
  mesh: {{size: [2, 2], cells: [64, 64]}}
grids:
  coated:
    axes:
      thickness: [{thickness}]
      modulus: [0.5 Es, 2 Es]
      creepage: [{creepage}]
"""
CREEPAGES = 25


def study_text(cases: int, part: slice = slice(None)) -> str:
    """A study of about so many layered cases, 25 creepages per pressure, or a `part` of it."""
    count = max(1, round(cases / (2 * CREEPAGES)))
    return STUDY.format(
        thickness=", ".join(f"{0.25 + 0.75 * k / max(count - 1, 1):.6f} a" for k in range(count)[part]),
        creepage=", ".join(
            f"{{longitudinal: {0.0004 * (k % 5 + 1):.4f}, lateral: {0.0005 * (k // 5):.4f}, "
            f"spin: {0.002 * (k % 3):.3f}}}"
            for k in range(CREEPAGES)
        ),
    )


class Times(NamedTuple):
    """Seconds of wall and of processor time: of the solver, and of the rest of a sweep."""

    solver_wall: float
    solver_processor: float
    rest_wall: float
    rest_processor: float


class Solver:
    """The solver of a sweep, which measures its own wall and processor time."""

    def __init__(self) -> None:
        self.wall = self.processor = 0.0

    def __call__(self, scenes: Sequence[Scene]) -> Iterator[Result]:
        """Results of scenes that share a normal problem."""
        from rcstudy.sweep import solve_batch

        results = solve_batch(scenes)
        while True:
            wall, processor = time.perf_counter(), time.thread_time()
            result = next(results, None)
            self.wall += time.perf_counter() - wall
            self.processor += time.thread_time() - processor
            if result is None:
                return
            yield result


def sweep_seconds(path: Path, cases: int) -> Times:
    """Times of a sweep in this process, from study file to cube."""
    from rcstudy import sweep
    from rcstudy.study import load_study

    path.write_text(study_text(cases), encoding="utf-8")
    solver, wall, processor = Solver(), time.perf_counter(), time.process_time()
    done = sweep.run(load_study(path), path.with_suffix(".nc"), workers=1, solve=solver, fresh=True)
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    if done.failed:
        raise SystemExit(f"{done.failed} of {done.cases} cases failed")
    return Times(solver.wall, solver.processor, wall - solver.wall, processor - solver.processor)


def commands_seconds(studies: Sequence[Path], workers: int) -> float:
    """Wall time (s) of ``rcstudy sweep`` of some studies at once, from the first process's start to the last's end."""
    begun = time.perf_counter()
    processes = [subprocess.Popen(sweep_command(path, workers), stdout=subprocess.DEVNULL) for path in studies]
    codes = [process.wait() for process in processes]
    if any(codes):
        raise SystemExit("a sweep failed")
    return time.perf_counter() - begun


def sweep_command(path: Path, workers: int) -> list[str]:
    """``rcstudy sweep`` of the study at `path`, started over."""
    words = ["-m", "rcstudy", "sweep", path, "-o", path.with_suffix(".nc"), "--fresh", "-q", "--workers", workers]
    return [sys.executable, *map(str, words)]


def pipeline_lines(path: Path, cases: int, repeats: int) -> Iterator[str]:
    """Times of the pipeline, as text: the least of `repeats` runs, each with a quarter of the cases and with all."""
    counts = (cases // 4, cases)
    runs = [[sweep_seconds(path, count) for count in counts] for _ in range(repeats)]
    few, many = (Times(*map(min, zip(*(run[k] for run in runs), strict=True))) for k in (0, 1))
    each = Times(*((m - f) / (counts[1] - counts[0]) * 1e3 for f, m in zip(few, many, strict=True)))
    for solver, rest, what in ((0, 2, "wall"), (1, 3, "processor")):
        share, of_all = each[rest] / (each[solver] + each[rest]), many[rest] / (many[solver] + many[rest])
        yield f"{what:<11} solver {each[solver]:.2f} ms a case, pipeline {each[rest]:.2f} ms: {share:.1%} of both"
        yield f"            pipeline {many[rest]:.1f} of {many[solver] + many[rest]:.1f} s in all: {of_all:.1%}"


def efficiency_lines(path: Path, cases: int, rounds: int) -> Iterator[str]:
    """Efficiency of two workers, as text: medians of ratios of commands that took turns."""
    whole, halves = [path], [path.with_stem(f"{path.stem}_{k}") for k in (1, 2)]
    path.write_text(study_text(cases), encoding="utf-8")
    for k, half in enumerate(halves):
        half.write_text(study_text(cases, part=slice(k, None, 2)), encoding="utf-8")
    ways = [(whole, 1), (whole, 2), (halves, 1)]  # studies, workers of each
    runs = []
    for turn in range(rounds):
        forward = 1 if turn % 2 == 0 else -1  # so that disturbances affect all alike
        runs.append([commands_seconds(*way) for way in ways[::forward]][::forward])
    texts = "; ".join(" / ".join(f"{seconds:.1f}" for seconds in run) for run in runs)
    yield f"commands    seconds with one worker / two workers / two commands, half of the cases each: {texts}"
    for k, what in ((1, "workers"), (2, "commands")):
        found = sorted(run[0] / run[k] / 2 for run in runs)
        yield f"            two {what}: efficiency {statistics.median(found):.2f} ({found[0]:.2f} to {found[-1]:.2f})"


def resident(pid: int) -> int:
    """Bytes of resident memory of a process and all its descendants."""
    total = 0
    try:
        for line in Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith("VmRSS"):
                total += int(line.split()[1]) * 1024
        for task in Path(f"/proc/{pid}/task").iterdir():
            total += sum(resident(int(child)) for child in (task / "children").read_text().split())
    except OSError:
        pass  # it has just ended
    return total


def peak_memory(path: Path, workers: int) -> tuple[float, float]:
    """Peak of all resident memory (MB) and seconds of ``rcstudy sweep`` with so many workers."""
    begun, peak = time.perf_counter(), 0
    process = subprocess.Popen(sweep_command(path, workers), stdout=subprocess.DEVNULL)
    while process.poll() is None:
        peak = max(peak, resident(process.pid))
        time.sleep(0.05)
    if process.returncode:
        raise SystemExit(f"exit code {process.returncode}")
    return peak / 1e6, time.perf_counter() - begun


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=2000, help="rounded to a multiple of 200")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--memory", type=int, default=0, help="cases of the sweep whose memory is measured")
    options = parser.parse_args()
    least = 2 * CREEPAGES  # of a study of `study_text`, which has a multiple of it; a quarter of all is one, too
    options.cases = 4 * least * max(1, round(options.cases / (4 * least)))
    options.memory = least * math.ceil(options.memory / least)
    limit_threads()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "pipeline.yaml"
        sweep_seconds(path, 50)  # compiles, loads
        print(f"{options.cases} cases, 64 x 64 cells, fields; load {os.getloadavg()[0]:.1f} before", flush=True)
        for lines in (pipeline_lines, efficiency_lines):
            for line in lines(path, options.cases, options.repeats):
                print(line, flush=True)
        if options.memory:
            path.write_text(study_text(options.memory), encoding="utf-8")
            peak, seconds = peak_memory(path, 2)
            size = path.with_suffix(".nc").stat().st_size / 1e6
            sizes = f"{options.memory} cases in {seconds:.0f} s, cube {size:.0f} MB"
            print(f"memory      {peak:.0f} MB in all at most: {sizes}")


if __name__ == "__main__":
    main()
