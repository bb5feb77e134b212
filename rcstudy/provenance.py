"""Where a cube comes from: versions, machine, revision, command, time; as attributes a netCDF file can hold."""

from __future__ import annotations

import functools
import platform
import shlex
import subprocess
import sys
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

from rcstudy.mechanics import SOLVER_VERSION
from rcstudy.threads import available_cores

REVISION = "git_revision"
"""Attribute of a cube: the revision that wrote it."""

_LIBRARIES = ("numpy", "scipy", "numba", "pyfftw", "h5py", "h5netcdf", "xarray")


def collect() -> dict[str, str | int | float]:
    """Provenance of a run started now, by this process's command line.

    A revision is given only when rcstudy itself runs from a git checkout, with ``+changes`` when files differ from it.
    """
    found: dict[str, str | int | float] = {
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": _command(),
        "rcstudy_version": version("rcstudy"),
        "solver_version": SOLVER_VERSION,
        "python_version": platform.python_version(),
    }
    found |= {f"{name}_version": version(name) for name in _LIBRARIES}
    found |= {
        "hdf5_version": _hdf5_version(),
        "machine_cpu": _cpu(),
        "machine_cores": available_cores(),
        "machine_os": platform.platform(),
    }
    if own := revision():
        found[REVISION] = own
    return found


def revision() -> str | None:
    """The revision of the checkout that rcstudy runs from, as in :func:`collect`; None if it runs from none."""
    return _git_revision(Path(__file__).resolve().parent)


@functools.cache  # found by reading files of each package anew, 10 ms for a sweep
def version(distribution: str) -> str:
    """Installed version of a distribution, or "unknown" (as when rcstudy runs from a plain checkout)."""
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return "unknown"


def _command() -> str:
    program = Path(sys.argv[0]).name
    words = shlex.join([*(["python", "-m", "rcstudy"] if program == "__main__.py" else [program]), *sys.argv[1:]])
    return words.encode(errors="backslashreplace").decode()  # names of files need not be UTF-8, attributes do


def _hdf5_version() -> str:
    import h5py

    return str(h5py.version.hdf5_version)


def _cpu() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine() or "unknown"


@functools.cache  # that of the modules as they were loaded, three processes of git
def _git_revision(package: Path) -> str | None:
    def git(*arguments: str) -> str | None:
        try:
            done = subprocess.run(["git", "-C", str(package), *arguments], capture_output=True, timeout=10, check=False)
        except (OSError, subprocess.TimeoutExpired):
            return None
        # what it says of a failure may name a folder in any encoding
        return done.stdout.decode("utf-8", "replace").strip() if done.returncode == 0 else None

    # an installed copy inside some other project's checkout is not that project's revision
    if git("ls-files", "--error-unmatch", "provenance.py") is None:
        return None
    revision = git("rev-parse", "HEAD")
    if not revision:
        return None
    return f"{revision}+changes" if git("status", "--porcelain", "--untracked-files=no", "--", ".") else revision
