"""What a sweep costs besides solving, how well two workers share it, and how much memory it takes.

    python scripts/pipeline.py [--cases 500] [--memory 10000]

Pipeline: processor time of a sweep by one process that the solver does not take, on layered cases of 64 x 64 cells with
fields. Efficiency: wall time with one worker over twice that with two; it
needs a machine with nothing else to do. Memory: the largest sum of resident memory (as /proc tells it, what processes
share counted once for each) of a sweep of that many cases with two workers.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

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
  mesh: {{size: [2, 2], cells: [{cells}, {cells}]}}
grids:
  coated:
    axes:
      thickness: [{thickness}]
      modulus: [0.5 Es, 2 Es]
      creepage: [{creepage}]
"""
CREEPAGES = 25


def study_text(cases: int, cells: int = 64) -> str:
    """A study of about so many layered cases: 25 creepages a pressure."""
    count = max(1, round(cases / (2 * CREEPAGES)))
    return STUDY.format(
        cells=cells,
        thickness=", ".join(f"{0.25 + 0.75 * k / max(count - 1, 1):.6f} a" for k in range(count)),
        creepage=", ".join(
            f"{{longitudinal: {0.0004 * (k % 5 + 1):.4f}, lateral: {0.0005 * (k // 5):.4f}, "
            f"spin: {0.002 * (k % 3):.3f}}}"
            for k in range(CREEPAGES)
        ),
    )


def processor_seconds() -> float:
    """Of this process and of its children that have ended."""
    found = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in found)


class Solver:
    """The solver, with a clock for the processor time that it takes itself."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def __call__(self, scenes: Sequence[Scene]) -> Iterator[Result]:
        """Results of scenes that share a normal problem."""
        from rcstudy.sweep import solve_batch

        results = solve_batch(scenes)
        while True:
            begun = time.process_time()
            result = next(results, None)
            self.seconds += time.process_time() - begun
            if result is None:
                return
            yield result


def sweep_seconds(path: Path, workers: int, solve: Solver | None = None) -> tuple[float, float]:
    """Processor and wall time of a whole sweep, from the study file to the cube."""
    from rcstudy import sweep
    from rcstudy.study import load_study

    begun, wall = processor_seconds(), time.perf_counter()
    done = sweep.run(load_study(path), path.with_suffix(".nc"), workers=workers, solve=solve, fresh=True)
    if done.failed:
        raise SystemExit(f"{done.failed} of {done.cases} cases failed")
    return processor_seconds() - begun, time.perf_counter() - wall


def measured(path: Path, cases: int) -> tuple[float, float, float, float]:
    """Milliseconds a case: of the solver, of the whole sweep by one process, and wall time with one and two.

    All by the difference of two sweeps, one three times as large, so that the start of processes and what a cube
    costs once are left out; the least of three.
    """
    found = []
    for count in (cases, 3 * cases):
        path.write_text(study_text(count), encoding="utf-8")
        runs = []
        for _ in range(3):
            solver = Solver()
            cpu, wall = sweep_seconds(path, 1, solver)
            runs.append((solver.seconds, cpu - solver.seconds, wall, sweep_seconds(path, 2)[1]))
        found.append([min(values) for values in zip(*runs, strict=True)])
    few, many = found
    solver, pipeline, one, two = ((m - f) / (2 * cases) * 1e3 for f, m in zip(few, many, strict=True))
    return solver, pipeline, one, two


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
    command = [sys.executable, "-m", "rcstudy", "sweep", path, "-o", path.with_suffix(".nc"), "--fresh", "-q"]
    begun, peak = time.perf_counter(), 0
    process = subprocess.Popen([*map(str, command), "--workers", str(workers)])
    while process.poll() is None:
        peak = max(peak, resident(process.pid))
        time.sleep(0.05)
    if process.returncode:
        raise SystemExit(f"exit code {process.returncode}")
    return peak / 1e6, time.perf_counter() - begun


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=500)
    parser.add_argument("--memory", type=int, default=0, help="cases of the sweep whose memory is measured")
    options = parser.parse_args()
    limit_threads()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "pipeline.yaml"
        path.write_text(study_text(50), encoding="utf-8")
        sweep_seconds(path, 1)  # compiles, loads
        solver, pipeline, one, two = measured(path, options.cases)
        print(f"{options.cases} and {3 * options.cases} cases, 64 x 64 cells; load {os.getloadavg()[0]:.1f}")
        print(f"solver      {solver:6.2f} ms a case")
        print(f"pipeline    {pipeline:6.2f} ms a case: {pipeline / (solver + pipeline):.1%} of the whole")
        print(f"wall time   {one:6.2f} ms a case with one process, {two:.2f} with two: efficiency {one / two / 2:.2f}")
        if options.memory:
            path.write_text(study_text(options.memory), encoding="utf-8")
            peak, seconds = peak_memory(path, 2)
            size = path.with_suffix(".nc").stat().st_size / 1e6
            sizes = f"{options.memory} cases in {seconds:.0f} s, cube {size:.0f} MB"
            print(f"memory      {peak:.0f} MB in all at most: {sizes}")


if __name__ == "__main__":
    main()
