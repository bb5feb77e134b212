"""What the README shows is run as it stands there: its study, its commands, its Python; its tables are the results'.

``python tests/test_readme.py`` rewrites the tables.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
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


def lines_under(path: Path, heading: str) -> list[str]:
    """Rows of the table under a heading of a Markdown file."""
    _, found, section = path.read_text(encoding="utf-8").partition(f"\n{heading}\n")
    assert found, f"{path.name} has no {heading}"
    return [line for line in section.partition("\n## ")[0].splitlines() if line.startswith("|")]


def errors_by_mesh() -> list[str]:
    """The table of the summary for one-way coupling."""
    return lines_under(ROOT / "results" / "accuracy" / "summary.md", "## Errors by mesh, one-way coupling")


# what scripts/error_bars.py calls them
CONTACTS = {
    "mild": "up to three layers, any bodies",
    "alike": "steel on steel, no layers, round to long",
    "full": "up to three layers, full coupling",
    "engineering": "coatings on balls, rail-like ellipses",
    "films": "soft films, also incompressible or under skins",
    "unlike": "rigid or elastic ball, friction 0.05 to 0.3",
    "few": "of the first and fourth kind, on 1 to 6 cells a radius",
    "fewest": "of the first three kinds and the sixth, 1 to 12 cells across",
    "coarse": "of the first, fourth and sixth kind, on 3 to 12 cells a radius",
    "sticking": "contacts that hardly slip",
    "sliding": "near full slip",
    "wild": "extreme: ellipses to 1000:1, six layers, skins",
    "rubber": "nearly incompressible films of 1 MPa to 1 GPa on stiff bodies",
    "between": "soft films thinner than a cell between wheel and rail or other bodies",
    "pulled": "rigid ball, friction of 0.4 to 7, full coupling",
    "pressed": "no creepage: slip by pressure alone, films and up to three layers",
    "long": "2 to 12 times as long one way, no layers, pole of spin inside",
    "oblong": "1.5 to 10 times as long one way, up to two layers, long cells",
    "skinned": "skins thinner than a cell, stiffer than what they lie on",
}


def error_bars() -> list[str]:
    """From least to most, over the scalars, of two columns of each table of the error bars."""
    published = ROOT / "results" / "error_bars.md"
    titles = [f"`{name}`: within, % | estimate / true error, median" for name in ("aligned", "kalker")]
    rows = [f"| contacts | {' | '.join(titles)} |", "| --- |" + " --- |" * 4]
    for name, words in CONTACTS.items():
        cells = [words]
        for discretisation in ("aligned", "kalker"):
            start = f"## `--discretisation {discretisation} --contacts {name} "
            (heading,) = [line for line in published.read_text(encoding="utf-8").splitlines() if line.startswith(start)]
            heads, _, *scalars = (row.strip("| ").split(" | ") for row in lines_under(published, heading))
            for head, form in (("within estimate, %", "g"), ("estimate / true error, median", ".2g")):
                numbers = [float(scalar[heads.index(head)]) for scalar in scalars]
                cells.append(f"{min(numbers):{form}} to {max(numbers):{form}}")
        rows.append(f"| {' | '.join(cells)} |")
    return rows


TABLES: dict[str, Callable[[], list[str]]] = {"errors by mesh": errors_by_mesh, "error bars": error_bars}


def test_the_published_error_bars_have_the_heads_that_the_script_prints() -> None:
    printed = "".join(re.findall(r'^ +"(\|.*\|?)"$', (ROOT / "scripts" / "error_bars.py").read_text(), re.MULTILINE))
    published = (ROOT / "results" / "error_bars.md").read_text(encoding="utf-8").splitlines()
    assert {line for line in published if line.startswith("| scalar |")} == {printed}


def pattern(name: str) -> str:
    """Finds a table by its marks: the first, the rows, the second."""
    return rf"(<!-- {name} -->\n)(.*?)(<!-- end -->)"


@pytest.mark.parametrize("name", TABLES)
def test_tables_are_those_of_the_results(name: str) -> None:
    found = re.search(pattern(name), README, re.DOTALL)
    assert found, "there is no such table"
    assert found[2].splitlines() == TABLES[name](), "run python tests/test_readme.py"


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


def main() -> None:
    """Rewrite the tables."""
    text = README
    for name, table in TABLES.items():
        rows = "".join(f"{row}\n" for row in table())
        text = re.sub(pattern(name), lambda found, rows=rows: f"{found[1]}{rows}{found[3]}", text, flags=re.DOTALL)
    (ROOT / "README.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
