"""Columns of a table, and the text of their numbers: with as many digits as their errors leave."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

Value = str | float | int

_NIL = 1e-6  # of its estimated error: a number below is zero but for rounding, which differs between processors
_DECIMALS = 8  # at most of a number below 1 with its error; if more are needed, both are given times a power of ten


@dataclass(frozen=True)
class Column:
    """A column: its key in the rows and in the CSV header, its titles, and the form of its numbers for people.

    `form` is a format specification (`.4g`, `.2f`). `wide` columns hold sentences and wrap in LaTeX at that
    share of the line's width; `latex` is the title in LaTeX (default: `title`, escaped). `error` is the key of the
    estimated error of the numbers: a column of its own in the CSV, behind a ± elsewhere. `names`: the column identifies
    the row, and is repeated in each part of a table that LaTeX sets in parts. `digits`: significant digits in the CSV.
    `csv_only`: the column is for programs, and left out elsewhere. `math`: the key of the same text with mathematics,
    which LaTeX shows instead. `variable`: the scalar of the cube that the column shows as it is stored.
    """

    key: str
    title: str
    latex: str = ""
    form: str = ".4g"
    wide: float = 0.0
    error: str = ""
    names: bool = False
    digits: int = 9
    csv_only: bool = False
    math: str = ""
    variable: str = ""


Table = tuple[str, Sequence[Column], list[dict[str, Value]]]
"""Caption, columns, rows."""


def without_empty(table: Table) -> Table:
    """The table, with columns that have nothing in any row in the CSV alone; as it is if no column has numbers.

    Such are forces where tractions are not solved. Empty words are something.
    """
    caption, columns, rows = table
    known = {
        key: value
        for row in rows
        for key, value in row.items()
        if not isinstance(value, float) or not math.isnan(value)
    }
    if not any(isinstance(value, float) for value in known.values()):
        return table
    return caption, [column if column.key in known else replace(column, csv_only=True) for column in columns], rows


def text_of(value: Value, form: str) -> str:
    """A value as a table shows it, in this form if it is a number; NaN is left empty, and there is no -0 or 0e+00."""
    if not isinstance(value, float):
        return str(value)
    if math.isnan(value):
        return ""
    text = format(value, form)
    if float(text) != 0.0:
        return text
    return "0" if "e" in text else text.removeprefix("-")


def csv_cells(row: Mapping[str, Value], column: Column) -> list[str]:
    """What the CSV has of one cell: the number, 0 if it is nothing beside its error, and the error if it has one."""
    value, error = row.get(column.key, ""), row.get(column.error, "")
    if isinstance(value, float) and isinstance(error, float) and abs(value) < _NIL * error < math.inf:
        value = 0.0
    texts = [text_of(value, f".{column.digits}g")]
    return [*texts, text_of(error, ".3g")] if column.error else texts


def cell(row: Mapping[str, Value], column: Column) -> tuple[str, int]:
    """Text of one cell, the number with its error if that is known, and a power of ten k.

    k is 0, or, where number and error are both small, the text is `(number ± error)` and stands for that times 10^k.
    """
    value, error = row.get(column.key, ""), row.get(column.error, math.nan)
    if not isinstance(value, float) or not isinstance(error, float) or math.isnan(value) or not 0.0 < error < math.inf:
        return text_of(value, column.form), 0
    decimals, power = 1 - _power(error), 0
    if decimals > _DECIMALS and (most := max(abs(value), error)) < 1.0:
        power = _power(most)
        value, error = _over_power(value, power), _over_power(error, power)
        decimals += power
    decimals = min(max(decimals, 0), 15)  # a double has no more
    text = f"{text_of(value, f'.{decimals}f')} ± {error:.{decimals}f}"
    return (f"({text})" if power else text), power


def _power(value: float) -> int:
    """The power of ten of a number above 0."""
    return int(f"{value:.16e}".partition("e")[2])


def _over_power(value: float, power: int) -> float:
    """`value` / 10^`power`, computed without the power of ten, which may underflow."""
    mantissa, _, exponent = f"{value:.16e}".partition("e")
    return float(f"{mantissa}e{int(exponent) - power}")
