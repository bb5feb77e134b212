"""Tables in LaTeX: what is set how, and, where there is a LaTeX, that it sets the published ones without complaint."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from rcstudy.report.cells import Column, Value
from rcstudy.report.latex import escape, latex_table

ROOT = Path(__file__).parents[1]
PUBLISHED = sorted((ROOT / "results").rglob("*.tex"))


def table(*texts: str, title: str = "A") -> str:
    """A table of one column with these texts."""
    rows: list[dict[str, Value]] = [{"a": text} for text in texts]
    return latex_table("t", "Words.", [Column("a", title)], rows)


@pytest.mark.parametrize(
    ("text", "source"),
    [
        ("from -0.5 to -.5, 1e-07, 2-3, a-1, (-1), - 2", "from $-$0.5 to $-$.5, 1e-07, 2-3, a-1, ($-$1), - 2"),
        ("a -- b --- c", "a -{}- b -{}-{}- c"),
        ("``x'', ,,y, ?` !`", "`{}`x'{}', ,{},y, ?{}` !{}`"),
        ("ξx = 2 λ, Ω – φ", r"$\xi$x = 2 $\lambda$, $\Omega$ -- $\phi$"),
        ("ümlaut ł 5 µm", "ümlaut ł 5 µm"),
    ],
)
def test_text_is_printed_as_it_stands(text: str, source: str) -> None:
    assert escape(text) == source


def test_each_label_is_defined_once_and_later_pages_name_the_table() -> None:
    """A head that is set again on each page must not define the label again."""
    source = table(*("words" for _ in range(50)))
    first, later = source.split(r"\endfirsthead")
    assert r"\caption{Words.}\label{tab:t} \\" in first and r"\label" not in later and r"\caption" not in later
    assert r"\multicolumn{1}{l}{\tablename~\thetable, continued} \\" in later.split(r"\endhead")[0]
    assert later.count("words") == 50 and r"\setlength{\LTcapwidth}{\linewidth}" in first


def test_a_row_does_not_begin_with_what_the_line_above_takes_for_its_own() -> None:
    source = table("[2pt]", "*star*", "plain")
    assert "{}[2pt] \\\\\n{}*star* \\\\\nplain \\\\" in source


def test_letters_that_pdflatex_lacks_are_told() -> None:
    assert "lacks" not in table("ξ ü → ± “5 €”")
    assert table("日本 🙂 日").splitlines()[1].startswith("% pdfLaTeX lacks these letters: 日本🙂 (")


def test_packages_are_those_that_are_used() -> None:
    assert table("a").splitlines()[0] == r"% needs \usepackage{booktabs}"
    assert table("words " * 30).splitlines()[0] == r"% needs \usepackage{array,booktabs,longtable,pdflscape}"


def test_a_table_that_is_too_broad_for_the_text_is_set_across_the_page() -> None:
    """Its texts wrap at what the page has room for, and long words may be broken, behind signs if they have any."""
    assert r"\begin{table}" in table("x" * 24) and r"\begin{table}" in table("ab " * 20)
    source = table("words " * 40)
    assert r"\begin{landscape}" in source and r"{>{\raggedright\arraybackslash}p{584pt}}" in source
    source = table("a_name_that_is_longer_than_24_letters" + 60 * "x", title="A title, upright")
    assert r"a\_name\_that\_is\_longer\_\hspace{0pt}than\_24\_\hspace{0pt}lettersx" in source
    assert r"\rotatebox" not in source and r"A title, upright \\" in source


def test_columns_of_sentences_share_the_width() -> None:
    row: dict[str, Value] = {"a": "some words", "b": "others"}

    def spec(*shares: float) -> tuple[bool, str]:
        columns = [Column(key, key, wide=share) for key, share in zip("ab", shares, strict=True)]
        source = latex_table("t", "Words.", columns, [row])
        return "landscape" in source, re.findall(r"\\begin{longtable}{(.*)}", source)[0]

    part = r">{{\raggedright\arraybackslash}}p{{\dimexpr{:g}\linewidth-2\tabcolsep\relax}}".format
    assert spec(0.3, 0.2) == (False, part(0.3) + part(0.2))
    assert spec(0.4, 0.4) == (True, part(0.4) + part(0.4))


def test_mathematics_replaces_words_where_the_row_has_both() -> None:
    columns = [Column("a", "A", math="a_math")]
    source = latex_table("t", "Words.", columns, [{"a": "xi_x = 1", "a_math": r"$\xi_x = 1$"}, {"a": "xi_x = 2"}])
    assert r"$\xi_x = 1$ \\" in source and r"xi\_x = 2 \\" in source and r"xi\_x = 1" not in source


def test_published_results_name_layers_and_creepages_in_mathematics() -> None:
    source = (ROOT / "results/paper/results.tex").read_text(encoding="utf-8")
    assert r"$\xi_x = 0.002$, $\xi_y = 0.001$, $\varphi = 0.01$ rad/mm" in source
    assert r"$E_1 = 0.5\,E_2 = 0.25\,E_s$, $0.25\,a$" in source and "lacks" not in source


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="needs pdflatex")
@pytest.mark.parametrize("path", PUBLISHED, ids=lambda path: "-".join(path.relative_to(ROOT / "results").parts))
def test_latex_sets_the_published_tables_without_complaint(tmp_path: Path, path: Path) -> None:
    """No error, no label twice, nothing broader than the page."""
    text = path.read_text(encoding="utf-8")
    needs = text.splitlines()[0].removeprefix("% needs ")
    lines = [r"\documentclass[a4paper]{article}", needs, r"\begin{document}", text, r"\end{document}"]
    (tmp_path / "t.tex").write_text("\n".join(lines), encoding="utf-8")
    for _ in range(3):  # columns of long tables are as broad as the run before found them
        done = subprocess.run(["pdflatex", "-interaction=nonstopmode", "t"], cwd=tmp_path, capture_output=True)
    log = (tmp_path / "t.log").read_text(encoding="utf-8", errors="replace")
    assert done.returncode == 0 and re.findall(r"^(?:!|Overfull|LaTeX Warning).*", log, re.MULTILINE) == []
