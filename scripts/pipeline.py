"""What a sweep costs besides solving, how well two workers share it, and how much memory it takes.

    python scripts/pipeline.py [--cases 1000] [--memory 10000]

Pipeline: seconds of processor time of a whole sweep (this process and its workers) over those of the solver alone, on
the same layered cases of 64 x 64 cells with fields. Efficiency: wall time with one worker over twice that with two; it
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
from pathlib import Path

from rcstudy.threads import limit_threads

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


def solver_seconds(path: Path) -> float:
    """Processor time of solving all cases of a study, results thrown away."""
    from rcstudy.cases import expand
    from rcstudy.study import load_study
    from rcstudy.sweep import make_batches, solve_batch

    batches = make_batches(expand(load_study(path)).cases, 1)
    begun = processor_seconds()
    for batch in batches:
        for _ in solve_batch([case.scene for case in batch]):
            pass
    return processor_seconds() - begun


def sweep_seconds(path: Path, workers: int) -> tuple[float, float]:
    """Processor and wall time of a whole sweep, from the study file to the cube; starting processes left out."""
    from rcstudy import sweep
    from rcstudy.study import load_study

    begun, wall = processor_seconds(), time.perf_counter()
    done = sweep.run(load_study(path), path.with_suffix(".nc"), workers=workers, fresh=True)
    if done.failed:
        raise SystemExit(f"{done.failed} of {done.cases} cases failed")
    return processor_seconds() - begun, time.perf_counter() - wall


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
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--memory", type=int, default=0, help="cases of the sweep whose memory is measured")
    options = parser.parse_args()
    limit_threads()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "pipeline.yaml"
        path.write_text(study_text(50), encoding="utf-8")
        sweep_seconds(path, 1)  # compiles, loads
        path.write_text(study_text(options.cases), encoding="utf-8")
        runs = [(solver_seconds(path), *sweep_seconds(path, 1)) for _ in range(3)]
        solver, cpu, wall = (min(values) for values in zip(*runs, strict=True))
        count = round(options.cases / (2 * CREEPAGES)) * 2 * CREEPAGES
        print(f"{count} cases, 64 x 64 cells; load {os.getloadavg()[0]:.1f}; least of three")
        print(f"solver alone   {solver / count * 1e3:6.2f} ms a case")
        print(f"whole sweep    {cpu / count * 1e3:6.2f} ms a case: pipeline {(cpu - solver) / cpu:.1%} of it")
        two_cpu, two_wall = (min(values) for values in zip(*(sweep_seconds(path, 2) for _ in range(3)), strict=True))
        print(f"two workers    {two_cpu / count * 1e3:6.2f} ms of processor time a case")
        efficiency = wall / two_wall / 2
        print(f"wall time      {wall:.2f} s with one process, {two_wall:.2f} s with two: efficiency {efficiency:.2f}")
        if options.memory:
            path.write_text(study_text(options.memory), encoding="utf-8")
            peak, seconds = peak_memory(path, 2)
            size = path.with_suffix(".nc").stat().st_size / 1e6
            sizes = f"{options.memory} cases in {seconds:.0f} s, cube {size:.0f} MB"
            print(f"memory         {peak:.0f} MB in all at most: {sizes}")


if __name__ == "__main__":
    main()
