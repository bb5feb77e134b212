"""One table in three forms: CSV for programs, Markdown for reading here, LaTeX (booktabs) for a paper."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from rcstudy.report.cells import Column, Value, cell, csv_cells
from rcstudy.report.latex import latex_table
from rcstudy.storage.publish import replacing


def write_table(
    out: Path, stem: str, caption: str, columns: Sequence[Column], rows: Sequence[Mapping[str, Value]]
) -> list[Path]:
    """Write `rows` as out/stem.csv, .md and .tex; missing numbers (NaN, absent keys) are left empty.

    Numbers have nine significant digits in the CSV, unless `Column.digits` says otherwise, their errors three, and
    numbers are 0 below a millionth of their error. Elsewhere they have the form `Column.form` or, if their error is
    known, as many decimals as two digits of the error take, whatever the size of the number. If these are more than
    eight, a power of ten follows both: `(2.19400 ± 0.00060)e-06`. Columns that are `csv_only` are in the CSV alone.
    Returns the three paths. UserError when a file cannot be written.
    """
    shown = [c for c in columns if not c.csv_only]
    texts = {"csv": None, "md": _markdown(caption, shown, rows), "tex": latex_table(stem, caption, shown, rows)}
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
                writer.writerows([[text for c in columns for text in csv_cells(row, c)] for row in rows])
        paths.append(path)
    return paths


def _markdown(caption: str, columns: Sequence[Column], rows: Sequence[Mapping[str, Value]]) -> str:
    cells = [[_plain(*cell(row, c)) for c in columns] for row in rows]
    return "\n".join([caption, "", *markdown_lines([c.title for c in columns], cells)]) + "\n"


def markdown_lines(titles: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a table in Markdown; text of the cells is shown as it is."""
    return [_bar(titles), "|" + " --- |" * len(titles), *(_bar(map(markdown_text, row)) for row in rows)]


_EATEN = re.compile(
    r"[|`$]|\\(?=[!-/:-@\[-`{-~])|[*~](?=\S)|(?<=\S)[*~]|(?<![^\W_])_(?=\S)|(?<=\S)_(?![^\W_])"
    r"|<(?=[A-Za-z/!?])|&(?=#?\w+;)|\[(?=.*\]\()"
)
"""Signs that Markdown takes for its own where they stand like this; an _ within a word is not one of them."""


def markdown_text(text: str) -> str:
    """`text` as Markdown that shows it."""
    return _EATEN.sub(r"\\\g<0>", text)


def _plain(text: str, power: int) -> str:
    return f"{text}e{power:+03d}" if power else text


def _bar(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cells) + " |"
