"""Tables in LaTeX (booktabs) that fit the page: those of many columns are set across it, in parts if need be."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from rcstudy.report.cells import Column, Value, cell
from rcstudy.report.labels import power_of_ten

LONG = 40
"""Tables of more rows become a longtable."""

BROAD = 8
"""Tables of more columns are set small and across the page, with titles upright."""

# Tables across an A4 page, in pt: the usable width, the largest width of a letter or digit in \\scriptsize, and the
# space between columns. Texts of more letters than _WRAPPED wrap.
_PAGE, _LETTER, _BETWEEN = 590.0, 4.0, 4.0
_WRAPPED = 24

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


def latex_table(stem: str, caption: str, columns: Sequence[Column], rows: Sequence[Mapping[str, Value]]) -> str:
    """The table in LaTeX, with what it needs in its first line.

    Narrow columns and few rows make a `table`, others a `longtable`. More columns than `BROAD` are set small across
    the page, in as many parts as that takes, all of which begin with the columns that name the rows.
    """
    cells = [[_typeset(row, column) for column in columns] for row in rows]
    if len(columns) <= BROAD:
        return "\n".join([r"% needs \usepackage{booktabs,longtable}", *_upright(stem, caption, columns, cells)]) + "\n"
    letters = [_letters([row[k] for row in cells]) for k in range(len(columns))]
    parts = _parts(columns, [_LETTER * n + _BETWEEN for n, _ in letters])
    lines = [r"% needs \usepackage{booktabs,graphicx,longtable,pdflscape}", r"\begin{landscape}"]
    lines += [r"\scriptsize\setlength{\tabcolsep}{2pt}"]
    for n, part in enumerate(parts, 1):
        words = f"{caption} (Part {n} of {len(parts)}.)" if len(parts) > 1 else caption
        spec = "".join(f"p{{{_LETTER * letters[k][0]:g}pt}}" if letters[k][1] else "l" for k in part)
        titles = [rf"\rotatebox{{90}}{{{columns[k].latex or escape(columns[k].title)}}}" for k in part]
        body = [[row[k] for k in part] for row in cells]
        lines += _longtable(_caption(stem if n == 1 else f"{stem}_{n}", words), spec, titles, body)
    return "\n".join([*lines, r"\end{landscape}"]) + "\n"


def _upright(stem: str, caption: str, columns: Sequence[Column], cells: Sequence[Sequence[str]]) -> list[str]:
    # the column's share of the width includes the space on both of its sides
    wide = r"p{{\dimexpr{:g}\textwidth-2\tabcolsep\relax}}"
    spec = "".join(wide.format(c.wide) if c.wide else "l" for c in columns)
    titles, title = [c.latex or escape(c.title) for c in columns], _caption(stem, caption)
    if len(cells) > LONG or any(c.wide for c in columns):
        return _longtable(title, spec, titles, cells)
    head = [r"\begin{table}", r"\centering", title, rf"\begin{{tabular}}{{{spec}}}", r"\toprule", _line(titles)]
    return [*head, r"\midrule", *map(_line, cells), r"\bottomrule", r"\end{tabular}", r"\end{table}"]


def _longtable(title: str, spec: str, titles: Sequence[str], cells: Sequence[Sequence[str]]) -> list[str]:
    head = [rf"\begin{{longtable}}{{{spec}}}", title + r" \\", r"\toprule", _line(titles), r"\midrule", r"\endhead"]
    return [*head, *map(_line, cells), r"\bottomrule", r"\end{longtable}"]


def _line(cells: Sequence[str]) -> str:
    return " & ".join(cells) + r" \\"


def _caption(stem: str, words: str) -> str:
    return rf"\caption{{{escape(words)}}}\label{{tab:{stem.replace('_', '-')}}}"


def _letters(cells: Sequence[str]) -> tuple[int, bool]:
    """Approximate width of a column of such cells, in letters and digits, and whether its text wraps."""
    signs = [re.sub(r" ?\\(pm|times) ?", "~~", text) for text in cells]  # ± and × stay within one word
    plain = [re.sub(r"\\[a-z]+ ?|[${}\\^]", "", text) for text in signs]
    most = max(map(len, plain), default=1)
    words = [len(word) for text in plain for word in text.split()]
    wraps = most > _WRAPPED and any(" " in text for text in plain)
    return (max(_WRAPPED, *words) if wraps else most), wraps


def _parts(columns: Sequence[Column], widths: Sequence[float]) -> list[list[int]]:
    """Numbers of the columns in each part: those that name rows in all, as many others as the page has room for."""
    names = [k for k, column in enumerate(columns) if column.names]
    room = _PAGE - sum(widths[k] for k in names)
    parts: list[list[int]] = [[]]
    left = room
    for k, width in enumerate(widths):
        if k in names:
            continue
        if parts[-1] and width > left:
            parts.append([])
            left = room
        parts[-1].append(k)
        left -= width
    return [names + part for part in parts]


def _typeset(row: Mapping[str, Value], column: Column) -> str:
    """A cell: numbers with a sign, an error or a power of ten as mathematics."""
    text, power = cell(row, column)
    if not text or not isinstance(row.get(column.key), int | float):
        return escape(text)
    number = power_of_ten(text).replace("±", r"\pm")
    number += rf"\times10^{{{power}}}" if power else ""
    return number if number == text and "-" not in text else f"${number}$"


def escape(text: str) -> str:
    """`text` as LaTeX source that prints it."""
    return "".join(_LATEX.get(letter, letter) for letter in text)
