"""Tables in LaTeX (booktabs) that fit the page: broad ones are set across it, in parts if need be."""

from __future__ import annotations

import functools
import math
import re
import unicodedata
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from rcstudy.report.cells import Column, Value, cell
from rcstudy.report.labels import power_of_ten

LONG = 40
"""Tables of more rows become a longtable."""

BROAD = 8
"""Tables of more columns are set small and across the page, with titles upright."""

# Widths on an A4 page of the class `article`, in pt. Across the page: the usable width, the width of a digit in
# \\scriptsize, and the space between columns; upright the same in the size of the text. Texts of more letters than
# _WRAPPED wrap, and longer words may be broken.
_PAGE, _LETTER, _BETWEEN = 590.0, 4.0, 4.0
_UPRIGHT, _UPRIGHT_LETTER, _UPRIGHT_BETWEEN = 345.0, 5.0, 12.0
_WRAPPED = 24
_LINE = 2  # height of an upright title's line, in digits
_SENTENCES = 0.6  # share of the width that columns of sentences may have in an upright table


def _greek(letter: str) -> str:
    name = unicodedata.name(letter).split()[-1].replace("LAMDA", "LAMBDA")  # as Unicode spells it
    return rf"$\{name.lower() if letter.islower() else name.capitalize()}$"


_GREEK = {letter: _greek(letter) for letter in "αβγδεζηθικλμνξπρστυφχψωΓΔΘΛΞΠΣΥΦΨΩ"}
_APART = "\N{WORD JOINER}"
_LATEX = _GREEK | {
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
    "≈": r"$\approx$",
    "∞": r"$\infty$",
    "×": r"$\times$",
    "−": "$-$",
    "±": r"$\pm$",
    "–": "--",
    "\N{ZERO WIDTH SPACE}": r"\hspace{0pt}",
    _APART: "{}",
}
_SOURCE = str.maketrans(_LATEX)
_MINUS = re.compile(r"(?<![\w.)-])-(?=\.?\d)")  # of a number in words
_LIGATURE = re.compile("(?<=-)(?=-)|(?<=[`?!])(?=`)|(?<=')(?=')|(?<=,)(?=,)")  # between signs that become another
_LAST_KNOWN = "\N{LATIN SMALL LETTER LONG S}"  # of the letters that pdfLaTeX has, but for signs and those in _LATEX
_SIGNS = set("—‘’“”„…•†‡€")  # that it has, too


def latex_table(stem: str, caption: str, columns: Sequence[Column], rows: Sequence[Mapping[str, Value]]) -> str:
    """The table in LaTeX, with what it needs in its first lines.

    Narrow columns and few rows make a `table`, others a `longtable`. More columns than `BROAD`, and such as are broader
    than the page, are set small across it, in as many parts as that takes, all of which begin with the columns that
    name the rows.
    """
    titles = [column.latex or escape(column.title) for column in columns]
    cells = [[_typeset(row, column) for column in columns] for row in rows]
    sentences = sum(column.wide for column in columns)
    broad = len(columns) > BROAD
    least = [_LINE] * len(columns) if broad else map(_letters, titles)
    widths = [_Widths.of([row[k] for row in cells]).at_least(letters) for k, letters in enumerate(least)]
    upright = sum(_UPRIGHT_LETTER * width.natural + _UPRIGHT_BETWEEN for width in widths)
    if broad:
        titles = [rf"\rotatebox{{90}}{{{title}}}" for title in titles]
    if broad or (not sentences and upright > _UPRIGHT):
        lines = _across(stem, caption, columns, titles, cells, widths)
    elif sentences > _SENTENCES:
        lines = [r"\begin{landscape}", r"\footnotesize\setlength{\tabcolsep}{4pt}"]
        lines += [*_longtable(_caption(stem, caption), _shares(columns), titles, cells), r"\end{landscape}"]
    else:
        lines = _upright(stem, caption, columns, titles, cells)
    return "\n".join([*_needs(lines), *lines]) + "\n"


def _needs(lines: Sequence[str]) -> list[str]:
    """Comments on what the lines need: packages, and another program where pdfLaTeX lacks letters."""
    text = "\n".join(lines)
    users = {
        "array": r"\arraybackslash",
        "booktabs": r"\toprule",
        "graphicx": r"\rotatebox",
        "longtable": r"\begin{longtable}",
        "pdflscape": r"\begin{landscape}",
    }
    packages = ",".join(package for package, macro in users.items() if macro in text)
    letters = "".join(sorted({letter for letter in text if letter > _LAST_KNOWN} - _SIGNS))
    lacking = [f"% pdfLaTeX lacks these letters: {letters} (use XeLaTeX or LuaLaTeX, and a font that has them)"]
    return [rf"% needs \usepackage{{{packages}}}", *(lacking if letters else [])]


# upright


def _upright(
    stem: str, caption: str, columns: Sequence[Column], titles: Sequence[str], cells: Sequence[Sequence[str]]
) -> list[str]:
    title, spec = _caption(stem, caption), _shares(columns)
    if len(cells) > LONG or any(c.wide for c in columns):
        return [r"\begingroup\footnotesize", *_longtable(title, spec, titles, cells), r"\endgroup"]
    head = [r"\begin{table}", r"\centering", title, r"\smallskip", rf"\begin{{tabular}}{{{spec}}}", r"\toprule"]
    return [*head, _line(titles), r"\midrule", *map(_line, cells), r"\bottomrule", r"\end{tabular}", r"\end{table}"]


def _shares(columns: Sequence[Column]) -> str:
    """Columns of sentences at their shares of the width, which include the space on both of their sides."""
    width = r"\dimexpr{:g}\linewidth-2\tabcolsep\relax"
    return "".join(_paragraphs(width.format(column.wide)) if column.wide else "l" for column in columns)


# across the page


def _across(
    stem: str,
    caption: str,
    columns: Sequence[Column],
    titles: Sequence[str],
    cells: Sequence[Sequence[str]],
    widths: Sequence[_Widths],
) -> list[str]:
    parts = _parts(columns, [_LETTER * width.least + _BETWEEN for width in widths])
    lines = [r"\begin{landscape}", r"\scriptsize\setlength{\tabcolsep}{2pt}"]
    for n, part in enumerate(parts, 1):
        words = f"{caption} (Part {n} of {len(parts)}.)" if len(parts) > 1 else caption
        own = [widths[k] for k in part]
        letters = _spread(own, (_PAGE - len(part) * _BETWEEN) / _LETTER)
        pairs = zip(own, letters, strict=True)
        spec = "".join(_paragraphs(f"{_LETTER * most:g}pt") if most < width.natural else "l" for width, most in pairs)
        body = [[row[k] for k in part] for row in cells]
        title = _caption(stem if n == 1 else f"{stem}_{n}", words)
        lines += _longtable(title, spec, [titles[k] for k in part], body)
    return [*lines, r"\end{landscape}"]


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


class _Widths(NamedTuple):
    """Approximate widths of a column, in digits: of its longest text in one line, and where its texts wrap."""

    natural: int
    least: int

    @classmethod
    def of(cls, cells: Sequence[str]) -> _Widths:
        """The widths of a column of these typeset cells."""
        natural = max(map(_letters, cells), default=1)
        if natural <= _WRAPPED:
            return cls(natural, natural)
        words = {word for text in cells for word in re.split(r" |\\hspace\{0pt\}", text)}
        return cls(natural, min(natural, max(_WRAPPED, *map(_letters, words))))

    def at_least(self, letters: int) -> _Widths:
        """Widths that have room for a title of so many letters."""
        return _Widths(max(self.natural, letters), max(self.least, letters))


def _spread(widths: Sequence[_Widths], room: float) -> list[int]:
    """Letters for each column: what is left of the room goes to columns that wrap, as far as it helps."""
    letters = [width.least for width in widths]
    left = room - sum(letters)
    wrapping = sorted((k for k, w in enumerate(widths) if w.natural > w.least), key=lambda k: widths[k].natural)
    for done, k in enumerate(wrapping):
        more = min(widths[k].natural - widths[k].least, int(max(left, 0.0) / (len(wrapping) - done)))
        letters[k] += more
        left -= more
    return letters


def _letters(text: str) -> int:
    """Approximate width of a typeset text, in digits."""
    text = re.sub(r" ?\\(pm|times) ?", "~~", text)  # ± and × stay within one word
    text = re.sub(r"\\[A-Za-z]+ ?", "x", text.replace(r"\hspace{0pt}", ""))
    return math.ceil(sum(map(_width, re.sub(r"\\,|[${}\\^]", "", text))))


@functools.cache
def _width(letter: str) -> float:
    if unicodedata.east_asian_width(letter) in "WF":
        return 2.0
    return 2.0 if letter in "MW@%" else 1.4 if letter in "mw" or letter.isupper() else 1.0


# what both have in common


def _longtable(title: str, spec: str, titles: Sequence[str], cells: Sequence[Sequence[str]]) -> list[str]:
    """A table that goes on on further pages, where its number stands for the caption."""
    head = [r"\toprule", _line(titles), r"\midrule"]
    later = rf"\multicolumn{{{len(titles)}}}{{l}}{{\tablename~\thetable, continued}} \\"
    first = [r"\setlength{\LTcapwidth}{\linewidth}", rf"\begin{{longtable}}{{{spec}}}", title + r" \\", *head]
    start = [*first, r"\endfirsthead", later, *head, r"\endhead", r"\bottomrule", r"\endfoot"]
    return [*start, *map(_line, cells), r"\end{longtable}"]


def _paragraphs(width: str) -> str:
    return rf">{{\raggedright\arraybackslash}}p{{{width}}}"


def _line(cells: Sequence[str]) -> str:
    line = " & ".join(cells) + r" \\"
    return f"{{}}{line}" if line[0] in "[*" else line  # the line above ends in \\, which takes them for its own


def _caption(stem: str, words: str) -> str:
    return rf"\caption{{{escape(words)}}}\label{{tab:{stem.replace('_', '-')}}}"


def _typeset(row: Mapping[str, Value], column: Column) -> str:
    """A cell: numbers with a sign, an error or a power of ten as mathematics."""
    if text := row.get(column.math):
        return str(text)
    text, power = cell(row, column)
    if not text or not isinstance(row.get(column.key), int | float):
        return escape(" ".join(map(_breakable, text.split(" "))))
    number = power_of_ten(text).replace("±", r"\pm")
    number += rf"\times10^{{{power}}}" if power else ""
    return number if number == text and "-" not in text else f"${number}$"


def _breakable(word: str) -> str:
    """A long word, with places where it may be broken: behind signs if there are any."""
    if len(word) <= _WRAPPED:
        return word
    pieces = re.findall(rf".{{1,{_WRAPPED - 1}}}[_=,/:;-]|.{{1,{_WRAPPED}}}", word)
    return "\N{ZERO WIDTH SPACE}".join(pieces)


def escape(text: str) -> str:
    """`text` as LaTeX source that prints it."""
    return _LIGATURE.sub(_APART, _MINUS.sub("−", text)).translate(_SOURCE)
