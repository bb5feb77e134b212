"""The documents say what the code does: tables made from it, examples that load, messages as they are printed.

``python tests/test_docs.py`` rewrites the tables.
"""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rcstudy import provenance
from rcstudy.errors import UserError
from rcstudy.mechanics.literature import PUBLICATIONS
from rcstudy.result import VARIABLES, CellState, Status
from rcstudy.storage.layout import CASE_KEY, LABEL, LAYER_SETTINGS, REFERENCES, SCHEMA_ATTRIBUTE, SETTINGS
from rcstudy.storage.units import FORMAT
from rcstudy.study import MAX_CASES, load_study
from rcstudy.studyfile import yamlfile, yamltree
from rcstudy.studyfile.grids import AXIS_PATHS, MAX_AXES
from rcstudy.studyfile.spec import (
    RESERVED_NAMES,
    CoatingSpec,
    GridSpec,
    SceneSpec,
    Spec,
    StudySpec,
    allowed_at,
    submodel,
)
from rcstudy.tolerances import TOLERABLE, Tolerances, load_tolerances

ROOT = Path(__file__).parent.parent
STUDY, CUBE = ROOT / "docs" / "study.md", ROOT / "docs" / "cube.md"
MECHANICS = ROOT / "docs" / "mechanics.md"


def table(kind: str) -> list[str]:
    """Rows of the table of docs/cube.md or docs/mechanics.md that stands between the marks of this name."""
    if kind == "publications":
        return [f"| {one.name} | {one.reference} | {one.purpose} |" for one in PUBLICATIONS]
    if kind == "settings":
        rows = [(name, "", s.units, s.long_name) for name, s in SETTINGS.items()]
        return [*_rows(rows), *_rows((n, "`layer`", u, words) for n, (u, words, _) in LAYER_SETTINGS.items())]
    chosen = {name: v for name, v in VARIABLES.items() if (v.kind == "field") == (kind == "fields")}
    if kind == "proof":
        return [*_rows((n, "", v.units, v.long_name) for n, v in chosen.items() if n.startswith("proof_"))]
    rows = [
        (name, "yes" if v.tangential else "", v.units, v.long_name)
        for name, v in chosen.items()
        if not name.startswith("proof_")
    ]
    return [*_rows(rows)]


def _rows(cells: Iterator[tuple[str, str, str, str]] | list[tuple[str, str, str, str]]) -> Iterator[str]:
    for name, second, units, words in cells:
        yield f"| `{name}` | {second} | {units} | {words.replace('|', chr(92) + '|')} |"


KINDS = ("fields", "scalars", "proof", "settings")  # tables of docs/cube.md
DOCUMENTS = {CUBE: KINDS, MECHANICS: ("publications",)}


def pattern(kind: str) -> str:
    """Finds a table by its marks: what comes before its rows, the rows, and what comes after."""
    return rf"(<!-- {kind} -->\n\|[^\n]*\n\|[^\n]*\n)(.*?)(<!-- end -->)"


@pytest.mark.parametrize(("document", "kind"), [(path, kind) for path, kinds in DOCUMENTS.items() for kind in kinds])
def test_tables_are_those_of_the_code(document: Path, kind: str) -> None:
    found = re.search(pattern(kind), document.read_text(encoding="utf-8"), re.DOTALL)
    assert found, "there is no such table"
    assert found[2].splitlines() == table(kind), "run python tests/test_docs.py"


def test_every_variable_is_in_a_table() -> None:
    rows = [row for kind in KINDS for row in table(kind)]
    for name in (*VARIABLES, *SETTINGS, *LAYER_SETTINGS):
        assert sum(row.startswith(f"| `{name}` |") for row in rows) == 1, name


def test_cube_document_names_what_has_a_tolerance() -> None:
    found = re.search(r"These variables have a tolerance: (.*?)\. ", CUBE.read_text(encoding="utf-8"), re.DOTALL)
    assert found and tuple(re.findall(r"`(\w+)`", found[1])) == TOLERABLE


def test_cube_document_names_enumerations_and_attributes() -> None:
    text = CUBE.read_text(encoding="utf-8")
    for member in (*Status, *CellState):
        assert f"| {member.value} | {member.name.lower()} |" in text, member
    for name in (*provenance.collect(), SCHEMA_ATTRIBUTE, REFERENCES, LABEL, CASE_KEY, "study_text", "study_sha256"):
        assert f"`{name}`" in text or name.endswith("_version"), name


def test_cube_document_names_the_format_of_units() -> None:
    assert f"`{FORMAT}`" in CUBE.read_text(encoding="utf-8")


def keys(model: type[Spec], prefix: str = "") -> Iterator[tuple[str, str, str]]:
    """Every key of a model, dotted, with what is allowed and its default, both in words."""
    for name, info in model.model_fields.items():
        inner = submodel(model, name)
        several = "[]" if name == "layers" else ""
        default = "required" if info.is_required() else DEFAULTS.get(f"{prefix}{name}", plain(info.default))
        yield f"{prefix}{name}", allowed_at(model, name), default
        if inner is not None:
            yield from keys(inner, f"{prefix}{name}{several}.")


DEFAULTS = {"counterbody": "`rigid`", "creepage": "`none`", "layers": "`[]`", "layer_nu": "the substrate's"}


def plain(value: Any) -> str:
    """A default as it would be written in a study; nothing where there is none to write."""
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, int | float):
        return f"`{value:g}`"
    return f"`{value}`" if value and isinstance(value, str) else ""


def key_rows(path: Path) -> list[tuple[str, str, str]]:
    """Rows of all tables of keys in a document: the key, what is allowed, its default."""
    return re.findall(
        r"^\| `([^`]+)` \| [^|]+ \| ([^|]*) \| ([^|]*) \|$", path.read_text(encoding="utf-8"), re.MULTILINE
    )


@pytest.mark.parametrize("model", [StudySpec, SceneSpec, CoatingSpec, GridSpec])
def test_study_document_has_every_key_with_what_is_allowed_and_its_default(model: type[Spec]) -> None:
    rows = key_rows(STUDY)
    for expected in keys(model):
        assert expected in rows


def test_study_document_names_every_axis() -> None:
    text = STUDY.read_text(encoding="utf-8")
    for path in AXIS_PATHS:
        assert f"`{path}`" in text, path


def test_study_document_names_what_no_grid_may_be_called() -> None:
    """The variables are in the tables that it points to."""
    text = STUDY.read_text(encoding="utf-8")
    for name in RESERVED_NAMES - set(VARIABLES):
        assert f"`{name}`" in text, name


def test_study_document_names_the_limits() -> None:
    refused = " ".join(STUDY.read_text(encoding="utf-8").partition("## What is refused")[2].split())
    for limit, words in (
        (yamlfile.MAX_BYTES // 1_000_000, "MB of text"),
        (yamlfile.MAX_VALUES, "keys and values"),
        (yamlfile.MAX_ALIASED, "more by aliases"),
        (yamltree.MAX_DEPTH, "levels of nesting"),
        (MAX_AXES, "axes in a grid"),
        (MAX_CASES, "cases"),
    ):
        assert f"{limit:,} {words}".replace(",", " ") in refused


def blocks(path: Path, language: str) -> list[str]:
    """Code blocks of a document in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", path.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("text", blocks(STUDY, "yaml"))
def test_examples_load(text: str, tmp_path: Path) -> None:
    """Examples are whole studies, or the grids of one."""
    path = tmp_path / "example.yaml"
    path.write_text(text if text.startswith("study:") else START + text, encoding="utf-8")
    assert load_study(path).size > 0


START = """\
study: example
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  load: 100
  mesh: {size: [2, 2], cells: [64, 64]}
"""


@pytest.mark.heavy
def test_recipes_run(tmp_path: Path) -> None:
    """The Python and the commands of docs/how_to.md, in their order."""
    text = (ROOT / "docs" / "how_to.md").read_text(encoding="utf-8")
    script = ["import subprocess, sys"]
    for language, code in re.findall(r"^```(python|sh)\n(.*?)^```", text, re.DOTALL | re.MULTILINE):
        lines = code.splitlines()
        if language == "sh":
            lines = [f"subprocess.run([sys.executable, '-m', *{line.split()!r}], check=True)" for line in lines]
        script += lines
    run = subprocess.run(
        [sys.executable, "-c", "\n".join(script)],
        cwd=tmp_path,
        env=os.environ | {"MPLBACKEND": "agg"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    assert "C11 = 4.1" in run.stdout
    assert "same: 4 cases compared" in run.stdout
    assert (tmp_path / "fields.csv").stat().st_size > 10_000


def test_tolerances_of_the_cube_document_load(tmp_path: Path) -> None:
    """Its example is read, means what the text says, and its table has every key."""
    (text,) = blocks(CUBE, "yaml")
    path = tmp_path / "tolerances.yaml"
    path.write_text(text, encoding="utf-8")
    found = load_tolerances(path)
    assert found.of_case("coated", "thickness=1 a, creepage=straight").rtol("traction_x") == 1e-5
    both = found.of_case("coated", "thickness=0.25 a, creepage=curve")
    assert (both.rtol("traction_x"), both.rtol("pressure"), both.state_flips) == (1e-4, 1e-5, 4)
    rows = key_rows(CUBE)
    for key, allowed, default in keys(Tolerances):
        if not key.startswith("cases.") or key == "cases.match":  # the others are the same again
            assert (key.replace("cases.", "cases[]."), allowed, default) in rows


def test_messages_are_those_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The example of a study that is refused, and what is said of it."""
    (example,) = blocks(STUDY, "yaml refused")
    (printed,) = blocks(STUDY, "text")
    (tmp_path / "wrong.yaml").write_text(example, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError) as error:
        load_study("wrong.yaml")
    assert str(error.value) == printed.rstrip("\n")


def named_in_equations() -> list[str]:
    """Code in the last column of the tables of docs/mechanics.md: `module.name` or a file."""
    rows = re.findall(r"^\|.*\| ([^|]*) \|$", MECHANICS.read_text(encoding="utf-8").replace(r"\|", ""), re.MULTILINE)
    return sorted({name for row in rows for name in re.findall(r"`([\w/]+\.[\w.]+)`", row)})


@pytest.mark.parametrize("name", named_in_equations())
def test_the_table_of_equations_names_code_that_exists(name: str) -> None:
    if name.endswith(".py"):
        assert any((folder / name).is_file() for folder in (ROOT, ROOT / "rcstudy" / "mechanics"))
        return
    module, *parts = name.split(".")
    found: Any = importlib.import_module("rcstudy.mechanics." + module.replace("/", "."))
    for part in parts:
        found = getattr(found, part)


ROW = re.compile(r"^\|[^|]*\|[^|]*\|([^|]*)\|([^|]*)\|$", re.MULTILINE)
AUTHORS = r"[A-ZÄÖÜ][a-zäöüß]+"
CITATION = re.compile(rf"((?:{AUTHORS}(?:, | and | & ))*{AUTHORS}),? \(?((?:18|19|20)\d\d)\b")
OF_PAPER = re.compile(r"\bEqs?\.? (\d+(?:(?:, | and | to |–)\d+)*)\b(?!\.\d)")


def sources(text: str) -> set[str]:
    """Publications that a text cites by their short names, and the equations of the paper, such as "Eq. 5"."""
    found = {f"{names.replace('&', 'and')} {year}" for names, year in CITATION.findall(" ".join(text.split()))}
    for numbers in OF_PAPER.findall(" ".join(text.split())):
        for part in re.split(r", | and ", numbers):
            first, *last = map(int, re.split(r" to |–", part))
            found |= {f"Eq. {n}" for n in range(first, (last or [first])[0] + 1)}
    return found


def cited_by(name: str) -> set[str]:
    """Sources in the docstrings of a module and, if a name in it is given, of that; the whole text of a file."""
    if name.endswith(".py"):
        found = next(path for folder in (ROOT, ROOT / "rcstudy" / "mechanics") if (path := folder / name).is_file())
        return sources(found.read_text(encoding="utf-8"))
    module, *parts = name.split(".")
    found = importlib.import_module("rcstudy.mechanics." + module.replace("/", "."))
    text = found.__doc__ or ""
    for part in parts:
        found = getattr(found, part)
        text += f" {getattr(found, '__doc__', '') or ''}"
    return sources(text)


def rows_with_sources() -> list[tuple[str, set[str]]]:
    """Code that a row of the table of equations names, and the sources that the row gives for it."""
    found = []
    for source, code in ROW.findall(MECHANICS.read_text(encoding="utf-8").replace(r"\|", "")):
        beside = ""
        for name in re.findall(r"`([\w/.]+)`", code):
            whole = name if "." in name else f"{beside}.{name}"  # of the same module or class as the one before
            beside = whole.rpartition(".")[0]
            found += [(whole, sources(source))] if sources(source) else []
    return found


@pytest.mark.parametrize(("name", "of_row"), rows_with_sources())
def test_code_cites_what_the_table_of_equations_gives_as_its_source(name: str, of_row: set[str]) -> None:
    assert of_row - cited_by(name) == set()


def test_sources_are_found_in_texts() -> None:
    text = "Polonsky & Keer 1999; (the paper's Eqs 1–4 and 6), Eq. 9; Johnson 1985, Eqs 3.18, 3.75; its Eqs 18 to\n20"
    numbers = {f"Eq. {n}" for n in (1, 2, 3, 4, 6, 9, 18, 19, 20)}
    assert sources(text) == {"Polonsky and Keer 1999", "Johnson 1985"} | numbers
    assert len(rows_with_sources()) > 20


def test_every_module_has_tests_of_its_name_or_named_in_the_table() -> None:
    table = (ROOT / "docs" / "changing.md").read_text(encoding="utf-8").partition("| module | tests |")[2]
    rows = table.partition("\n\n")[0].splitlines()[2:]
    named = {name for row in rows for name in re.findall(r"`([\w/*.]+)`", row.split("|")[1])}
    assert "bars/*" in named and "layered.py" in named
    modules = [path for path in (ROOT / "rcstudy").rglob("*.py") if path.stem != "__init__"]
    files = {path.name for path in (ROOT / "tests").iterdir()}
    for module in modules:
        assert f"test_{module.name}" in files or named & {module.name, f"{module.parent.name}/*"}, module
    folders = {f"{module.parent.name}/*" for module in modules}
    assert named <= folders | {module.name for module in modules}


def test_files_that_are_named_exist() -> None:
    """In documents and in the code, by their paths or, beside it, by their names."""
    code = [path for folder in ("rcstudy", "tests", "scripts") for path in (ROOT / folder).rglob("*.py")]
    files = [*code, ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    folders = {ROOT} | {path.parent for path in code}
    for path in files:
        for name in set(re.findall(r"`([\w/]+\.py)`", path.read_text(encoding="utf-8"))):
            assert any((folder / name).is_file() for folder in folders), (path.name, name)


def constants() -> list[tuple[str, float]]:
    """Names and values in the table of measured constants of docs/mechanics.md."""
    text = MECHANICS.read_text(encoding="utf-8").partition("### Constants that are measured")[2].partition("\n#")[0]
    return [(name, float(value)) for name, value in re.findall(r"^\| `([\w./]+)` \| ([\d.]+) \|", text, re.MULTILINE)]


def test_the_table_of_constants_has_their_values() -> None:
    found = constants()
    assert len(found) == 10
    for name, value in found:
        module, _, constant = name.replace("/", ".").rpartition(".")
        assert getattr(importlib.import_module(f"rcstudy.mechanics.{module}"), constant) == value, name


NOT_CITED = {"Color Universal Design 2008", "Tribology Letters 2021"}
"""What looks like a citation of authors but is none; the latter is the paper, "P" in the documents."""


def cited() -> dict[str, list[str]]:
    """Names and year of each citation in package and documents, such as "Love 1929", and the files it is in."""
    author = r"[A-ZÄÖÜ][a-zäöüß]+"
    citation = re.compile(rf"((?:{author}(?:, | and | & | ))*{author}),? \(?((?:18|19|20)\d\d)\b")
    files = [*(ROOT / "rcstudy").rglob("*.py"), *(ROOT / "docs").glob("*.md"), ROOT / "README.md"]
    found: dict[str, list[str]] = {}
    for path in files:
        if path.name == "literature.py":
            continue
        text = re.sub(pattern("publications"), "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        for names, year in citation.findall(" ".join(text.replace("#", " ").split())):
            found.setdefault(f"{names.replace('&', 'and')} {year}", []).append(path.name)
    return {name: paths for name, paths in found.items() if name not in NOT_CITED}


def test_what_is_cited_is_listed_and_what_is_listed_is_cited() -> None:
    found = cited()
    names = {one.name for one in PUBLICATIONS}
    assert {name: paths for name, paths in found.items() if name not in names} == {}
    assert names - set(found) == {"Tribology Letters 2021"}


def main() -> None:
    """Rewrite the tables of docs/cube.md and docs/mechanics.md."""
    for path, kinds in DOCUMENTS.items():
        text = path.read_text(encoding="utf-8")
        for kind in kinds:
            rows = "".join(f"{row}\n" for row in table(kind))
            text = re.sub(pattern(kind), lambda found, rows=rows: f"{found[1]}{rows}{found[3]}", text, flags=re.DOTALL)
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
