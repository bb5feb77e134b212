"""What gets installed: the locks name all that pyproject.toml asks for, and the wheel holds all of the package."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
LOCKS = ("requirements.lock", "requirements-test.lock")


def locked(lock: str) -> list[Requirement]:
    """The requirements of a lock; the same name may stand there twice, for different versions of Python."""
    text = (ROOT / lock).read_text(encoding="utf-8").replace("\\\n", " ")
    return [Requirement(line.split("--hash")[0]) for line in text.splitlines()]


def test_locks_have_names_versions_and_hashes_only() -> None:
    line = re.compile(r"[a-z0-9-]+==[\w.]+( ; [\w .<>=!']+)? \\|    --hash=sha256:[0-9a-f]{64}( \\)?")
    for lock in LOCKS:
        for written in (ROOT / lock).read_text(encoding="utf-8").splitlines():
            assert line.fullmatch(written), written


def test_locks_hold_what_the_project_asks_for() -> None:
    asked = [*PROJECT["build-system"]["requires"], *PROJECT["project"]["dependencies"]]
    for lock, wanted in zip(LOCKS, (asked, asked + PROJECT["project"]["optional-dependencies"]["test"]), strict=True):
        for requirement in map(Requirement, wanted):
            name = canonicalize_name(requirement.name)
            versions = [str(r.specifier).removeprefix("==") for r in locked(lock) if r.name == name]
            assert versions, f"{lock}: {name} is missing: run scripts/lock"
            assert all(requirement.specifier.contains(v) for v in versions), f"{lock}: {name}: run scripts/lock"


def test_lock_of_tests_has_the_versions_of_the_other_one() -> None:
    tests = {str(requirement) for requirement in locked("requirements-test.lock")}
    assert {str(requirement) for requirement in locked("requirements.lock")} <= tests


def test_wheel_holds_the_package(tmp_path: Path) -> None:
    least = Requirement(PROJECT["build-system"]["requires"][0])
    if not least.specifier.contains(metadata.version("setuptools")):
        pytest.skip(f"needs {least}, has {metadata.version('setuptools')}")
    # from a copy: building writes into the folder of the source
    source = tmp_path / "source"
    source.mkdir()
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    shutil.copytree(ROOT / "rcstudy", source / "rcstudy", ignore=shutil.ignore_patterns("__pycache__"))
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*command, "--wheel-dir", str(tmp_path), "."], cwd=source, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    held = {name for name in zipfile.ZipFile(wheel).namelist() if name.startswith("rcstudy/")}
    assert held == {path.relative_to(source).as_posix() for path in source.glob("rcstudy/**/*") if path.is_file()}
