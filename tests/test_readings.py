"""The script that judges the paper's statements under other readings, and what it last wrote."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import pytest

from rcstudy.cases import expand
from rcstudy.report.paper_statements import STATEMENTS
from rcstudy.report.statements import judged, statements_table
from rcstudy.study import study_from_text

ROOT = Path(__file__).resolve().parents[1]
SCRIPT = runpy.run_path(str(ROOT / "scripts" / "readings.py"))


@pytest.mark.parametrize("name", SCRIPT["READINGS"])
def test_a_reading_changes_what_it_names_and_nothing_else(name: str) -> None:
    text = SCRIPT["STUDY"].read_text(encoding="utf-8")
    plain, read = (
        [case.scene for case in expand(study_from_text(t, "study.yaml")).cases]
        for t in (text, SCRIPT["read_as"](text, name))
    )
    changed: set[str] = set()
    for one, other in zip(plain, read, strict=True):
        changed |= {key for key, value in vars(one).items() if value != vars(other)[key]}
        if one.creepage and name in ("mirror image", "spin negated alone"):
            sign = -1 if name == "mirror image" else 1
            assert other.creepage is not None
            assert (other.creepage.lateral, other.creepage.spin) == (sign * one.creepage.lateral, -one.creepage.spin)
    expected: dict[str, set[str]] = {
        "as published": set(),
        "elastic counterbody": {"counterbody", "layers"},  # thickness is a multiple of a
        "friction 0.5": {"friction"},
        "full coupling": {"coupling"},
    }
    assert changed == expected.get(name, {"creepage"})


def test_only_statements_with_other_verdicts_are_listed() -> None:
    same, other = ["borne out (1 of 1)"] * len(STATEMENTS), ["borne out (1 of 1)"] * len(STATEMENTS)
    other[3] = "undecided (1 of 1)"
    lines, others = SCRIPT["table"]({"a": same, "b": other, "c": same})
    assert others == len(STATEMENTS) - 1
    assert lines[2:] == [f"| 4 | {STATEMENTS[3].quote} | borne out (1 of 1) | undecided (1 of 1) | same |"]


def test_published_readings_have_the_statements_numbers() -> None:
    rows = [line.split(" | ") for line in (ROOT / "results" / "paper" / "readings.md").read_text().splitlines()]
    listed: list[Any] = [(int(row[0].strip("| ")), row[1]) for row in rows if len(row) > 4 and row[0][2:].isdigit()]
    assert listed and all(STATEMENTS[number - 1].quote == quote for number, quote in listed)
    negated = [row[-1].strip("| ") for row in rows if len(row) > 4 and row[0][2:].isdigit()]
    assert [text for text in negated if text != "same"] == ["borne out (4 of 4)"] * 4  # as the README says


@pytest.mark.parametrize("folder", ["paper", "paper/fine"])
def test_published_statements_say_which_pairs_they_compare(folder: str) -> None:
    """All pairs of spins were said to be neighbours."""
    caption, *_ = statements_table(judged(STATEMENTS, []), [])
    assert "neighbouring values of the parameter named (of spin, at x < 0, any two)" in caption
    published = (ROOT / "results" / folder / "statements.md").read_text(encoding="utf-8")
    shared = "In all cases: load 100 N, friction 1, radius 50 mm, substrate E 210000 MPa, "
    assert published.splitlines()[0].startswith(f"{caption} {shared}")
