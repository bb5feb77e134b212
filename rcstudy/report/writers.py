"""One table in three forms: CSV for programs, Markdown for reading here, LaTeX (booktabs) for a paper."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rcstudy.publish import replacing

Value = str | float | int

_DECIMALS = 8  # of a number below 1 with its error, at most; with more a power of ten stands behind both
LONG = 40
"""Tables of more rows become a longtable in LaTeX."""

BROAD = 8
"""Tables of more columns are set small and across the page in LaTeX, with titles upright."""

_LATEX = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"$<$",
    ">": r"$>$",
    "|": r"$|$",
    "→": r"$\to$",
    "≥": r"$\ge$",
    "≤": r"$\le$",
    "×": r"$\times$",
    "−": "$-$",
    "±": r"$\pm$",
    "–": "--",
}


@dataclass(frozen=True)
class Column:
    """A column: its key in the rows and in the CSV header, its titles, and the form of its numbers for people.

    `form` is a format specification (`.4g`, `.2f`). `wide` columns hold sentences and wrap in LaTeX at that
    share of the text's width; `latex` is the title in LaTeX (default: `title`, escaped). `error` is the key of the
    estimated error of the numbers: a column of its own in the CSV, behind a ± elsewhere.
    """

    key: str
    title: str
    latex: str = ""
    form: str = ".4g"
    wide: float = 0.0
    error: str = ""


Table = tuple[str, Sequence[Column], list[dict[str, Value]]]
"""Caption, columns, rows."""


def write_table(
    out: Path, stem: str, caption: str, columns: Sequence[Column], rows: Sequence[Mapping[str, Value]]
) -> list[Path]:
    """Write `rows` as out/stem.csv, .md and .tex; missing numbers (NaN, absent keys) are left empty.

    Numbers have nine significant digits in the CSV; elsewhere the form `Column.form`, or, where their error is known,
    as many decimals as two digits of that have, whatever the size of the number beside it. Where those are more than
    eight a power of ten stands behind both: `(2.19400 ± 0.00060)e-06`.
    Returns the three paths. UserError when a file cannot be written.
    """
    texts = {"csv": None, "md": _markdown(caption, columns, rows), "tex": _latex(stem, caption, columns, rows)}
    paths = []
    for kind, text in texts.items():
        path = out / f"{stem}.{kind}"
        with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
            if text is not None:
                file.write(text)
            else:
                writer = csv.writer(file, lineterminator="\n")
                keys = [key for c in columns for key in (c.key, c.error) if key]
                writer.writerow(keys)
                writer.writerows([[_text(row.get(key, ""), ".9g") for key in keys] for row in rows])
        paths.append(path)
    return paths


def _text(value: Value, form: str) -> str:
    if not isinstance(value, float):
        return str(value)
    if math.isnan(value):
        return ""
    text = format(value, form)
    return text.removeprefix("-") if float(text) == 0.0 else text


def _cell(row: Mapping[str, Value], column: Column) -> tuple[str, int]:
    """The number or text of a column as people read it, with its error if that is known, and a power of ten.

    That is 0 but for small numbers with small errors, which stand in brackets: both are to be multiplied by it.
    """
    value, error = row.get(column.key, ""), row.get(column.error, math.nan)
    if not isinstance(value, float) or not isinstance(error, float) or math.isnan(value) or not 0.0 < error < math.inf:
        return _text(value, column.form), 0
    decimals, power = 1 - _power(error), 0
    if decimals > _DECIMALS and (most := max(abs(value), error)) < 1.0:
        power = _power(most)
        value, error = _over_power(value, power), _over_power(error, power)
        decimals += power
    decimals = min(max(decimals, 0), 15)  # a number has no more
    text = f"{_text(value, f'.{decimals}f')} ± {error:.{decimals}f}"
    return (f"({text})" if power else text), power


def _power(value: float) -> int:
    """The power of ten of a number above 0."""
    return int(f"{value:.16e}".partition("e")[2])


def _over_power(value: float, power: int) -> float:
    """`value` over a power of ten, which may be too small to be a number itself."""
    mantissa, _, exponent = f"{value:.16e}".partition("e")
    return float(f"{mantissa}e{int(exponent) - power}")


def _markdown(caption: str, columns: Sequence[Column], rows: Sequence[Mapping[str, Value]]) -> str:
    cells = [[_plain(*_cell(row, c)).replace("|", r"\|") for c in columns] for row in rows]
    return "\n".join([caption, "", *markdown_lines([c.title for c in columns], cells)]) + "\n"


def markdown_lines(titles: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a table in Markdown, of cells in which a | is escaped already."""
    return [_bar(titles), "|" + " --- |" * len(titles), *map(_bar, rows)]


def _plain(text: str, power: int) -> str:
    return f"{text}e{power:+03d}" if power else text


def _bar(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _latex(stem: str, caption: str, columns: Sequence[Column], rows: Sequence[Mapping[str, Value]]) -> str:
    # of that share of the width the space on both sides of the column is a part
    wide = r"p{{\dimexpr{:g}\textwidth-2\tabcolsep\relax}}"
    spec = "".join(wide.format(c.wide) if c.wide else "l" for c in columns)
    broad = len(columns) > BROAD
    titles = [c.latex or escape(c.title) for c in columns]
    if broad:
        titles = [rf"\rotatebox{{90}}{{{title}}}" for title in titles]
    head = [r"\toprule", " & ".join(titles) + r" \\", r"\midrule"]
    body = [" & ".join(_typeset(*_cell(row, c)) for c in columns) + r" \\" for row in rows]
    title = rf"\caption{{{escape(caption)}}}\label{{tab:{stem.replace('_', '-')}}}"
    if broad or len(rows) > LONG or any(c.wide for c in columns):
        lines = [rf"\begin{{longtable}}{{{spec}}}", title + r" \\", *head, r"\endhead", *body, r"\bottomrule"]
        lines += [r"\end{longtable}"]
        if broad:
            small = r"\tiny\setlength{\tabcolsep}{2pt}"
            lines = [r"\begin{landscape}", small, *lines, r"\end{landscape}"]
    else:
        lines = [r"\begin{table}", r"\centering", title, rf"\begin{{tabular}}{{{spec}}}", *head, *body]
        lines += [r"\bottomrule", r"\end{tabular}", r"\end{table}"]
    packages = "booktabs,graphicx,longtable,pdflscape" if broad else "booktabs,longtable"
    return "\n".join([rf"% needs \usepackage{{{packages}}}", *lines]) + "\n"


def _typeset(text: str, power: int) -> str:
    return escape(text) + (rf"$\times10^{{{power}}}$" if power else "")


def escape(text: str) -> str:
    """`text` as LaTeX source that prints it."""
    return "".join(_LATEX.get(letter, letter) for letter in text)
