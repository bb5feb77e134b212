"""What the README shows is run as it stands there: its study, its commands, its Python."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """Code blocks of the README in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.DOTALL | re.MULTILINE)


def commands() -> list[list[str]]:
    """The lines of all shell blocks as words, comments left out."""
    return [shlex.split(line, comments=True) for block in blocks("sh") for line in block.splitlines() if line]


def run(folder: Path, *words: str) -> str:
    """Standard output of this Python in `folder`; it has to succeed."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_scripts_are_there_and_executable() -> None:
    named = [words for words in commands() if words[0] != "rcstudy"]
    assert [words[0] for words in named] == ["scripts/paper", "scripts/test"]
    for name in ("scripts/paper", "scripts/test", "scripts/lock", ".ci/run"):
        assert os.access(ROOT / name, os.X_OK), name
    for name in ("scripts/paper", "scripts/test", "scripts/lock", "scripts/common.sh", ".ci/run"):
        subprocess.run(["sh", "-n", str(ROOT / name)], check=True)


def test_links_and_pictures_are_there() -> None:
    targets = re.findall(r"\]\(([^)#]+)\)|src=\"([^\"]+)\"", README)
    assert len(targets) > 5
    for link, picture in targets:
        assert (ROOT / (link or picture)).exists(), link or picture


@pytest.mark.heavy
def test_study_commands_and_python_run(tmp_path: Path) -> None:
    (study,) = blocks("yaml")
    (tmp_path / "coatings.yaml").write_text(study, encoding="utf-8")
    shown = [words for words in commands() if words[0] == "rcstudy"]
    assert [words[1] for words in shown] == ["plan", "sweep", "show", "figures", "tables", "compare"]
    printed = {}
    for words in shown:
        if words[1] == "compare":
            shutil.copy(tmp_path / "coatings.nc", tmp_path / "reference.nc")
        printed[words[1]] = run(tmp_path, "-m", *words)
    assert "8 cases" in printed["plan"]
    assert "8 of 8 cases solved" in printed["sweep"]
    assert list((tmp_path / "figures").glob("*.png"))
    assert list((tmp_path / "tables").glob("*.csv"))
    opened, solved = blocks("python")
    lines = run(tmp_path, "-c", opened)
    assert float(re.search(r"^slip: (.*)$", lines, re.MULTILINE)[1]) > 0.0
    force, unit = run(tmp_path, "-c", solved).split()
    assert float(force) < 0.0
    assert unit == "N"
