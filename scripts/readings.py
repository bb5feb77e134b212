"""How the verdicts on the paper's statements depend on what the paper leaves open.

Usage: python scripts/readings.py [--output results/paper/readings.md]; it takes about a minute.

Solves configs/paper_fine.yaml as it is and with one reading at a time replaced by another, judges all statements on
each, as `rcstudy tables` does, and writes a table of those whose verdicts or counts differ.
"""

from __future__ import annotations

import argparse
import re
import tempfile
from pathlib import Path

import numpy as np

from rcstudy import sweep
from rcstudy.cube import open_cube
from rcstudy.report.paper import PaperCase, paper_cases
from rcstudy.report.paper_statements import STATEMENTS
from rcstudy.report.statements import judged, statements_table
from rcstudy.report.views import grids
from rcstudy.report.writers import markdown_lines
from rcstudy.storage.publish import replacing
from rcstudy.study import study_from_text

ROOT = Path(__file__).resolve().parents[1]
STUDY = ROOT / "configs" / "paper_fine.yaml"
PUBLISHED, MIRROR = "as published", "mirror image"

READINGS: dict[str, tuple[str, str]] = {
    PUBLISHED: ("", ""),
    "elastic counterbody": (r"^  counterbody: rigid$", "  counterbody: {E: 1 Es, nu: 0.3}"),
    "friction 0.5": (r"^  friction: 1$", "  friction: 0.5"),
    "full coupling": (r"^  coupling: one-way$", "  coupling: full"),
    MIRROR: (r"\b(lateral|spin): (?=0\.)", r"\1: -"),
    "spin negated alone": (r"\bspin: (?=0\.)", "spin: -"),
}
"""Name of each reading, and what it replaces in the study's text: a pattern, and what stands in its place."""

UNCHANGED = ("force_x", "slip_area", "contact_area", "traction_max", "friction_power")
"""Numbers that a mirror image does not change."""

WORDS = """\
# How the verdicts depend on the readings

Made by `scripts/readings.py` on 256 x 256 aligned cells (`configs/paper_fine.yaml`): each column replaces one reading
of what the paper leaves open by another, and the rows are the statements whose verdicts or counts then differ;
those on the other {others} are the same in all columns. Elastic counterbody: `{{E: 1 Es, nu: 0.3}}`. Mirror image:
lateral creepage and spin negated, which is the published study seen from the other side; it serves as a check (largest
difference of forces along x, areas, largest traction and friction power: {difference:.0e} of their values), and changes
only statements that tell y > 0 from y < 0. Spin negated alone is another problem where there is lateral creepage, with
other slip ratios. The creepages of Figures 5 and 6 are per cent in all columns.
"""


def read_as(text: str, name: str) -> str:
    """The study's text with the reading `name`."""
    pattern, words = READINGS[name]
    changed, count = re.subn(pattern, words, text, flags=re.MULTILINE) if pattern else (text, 1)
    if not count:
        raise SystemExit(f"{STUDY}: nothing to replace for the reading: {name}")
    return changed


def verdicts(cases: list[PaperCase]) -> list[str]:
    """The verdict on each statement."""
    _, _, rows = statements_table(judged(STATEMENTS, cases), cases)
    return [str(row["verdict"]) for row in rows]


def numbers(cases: list[PaperCase]) -> np.ndarray:
    """UNCHANGED of each rolling case, [cases, numbers]."""
    return np.array([[c.view.number(name) for name in UNCHANGED] for c in cases if any(c.creepage)])


def table(of: dict[str, list[str]]) -> tuple[list[str], int]:
    """Lines of a table in Markdown of the verdicts that are not the same in all readings; how many others are."""
    rows = []
    for number, (statement, *found) in enumerate(zip(STATEMENTS, *of.values(), strict=True), 1):
        if len(set(found)) > 1:
            cells = [found[0], *("same" if text == found[0] else text for text in found[1:])]
            rows.append([str(number), statement.quote, *cells])
    return markdown_lines(["No.", "The paper says", *of], rows), len(STATEMENTS) - len(rows)


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=ROOT / "results" / "paper" / "readings.md")
    options = parser.parse_args()
    text = STUDY.read_text(encoding="utf-8")
    studies = {name: study_from_text(read_as(text, name), STUDY) for name in READINGS}
    of: dict[str, list[str]] = {}
    measured: dict[str, np.ndarray] = {}
    with tempfile.TemporaryDirectory() as folder:
        cube = Path(folder) / "paper_fine.nc"
        for name, study in studies.items():
            done = sweep.run(study, cube, fresh=True)
            print(f"{name}: {done.cases - len(done.failures)} of {done.cases} cases solved in {done.seconds:.0f} s")
            with open_cube(cube) as tree:
                cases = paper_cases(grids(tree))
                of[name], measured[name] = verdicts(cases), numbers(cases)
    difference = np.abs(measured[MIRROR] / measured[PUBLISHED] - 1.0).max()
    lines, others = table(of)
    words = WORDS.format(others=others, difference=difference)
    with replacing(options.output) as temporary:
        temporary.write_text("\n".join([words, *lines, ""]), encoding="utf-8")


if __name__ == "__main__":
    main()
