"""Text on figures: labels of a study are drawn literally, and long text is wrapped or shortened to fit."""

from __future__ import annotations

import itertools
import re
import textwrap
from collections.abc import Callable, Sequence
from functools import partial

KEEP = "\N{NO-BREAK SPACE}"
"""A space at which `wrapped` breaks no line."""


def literal(text: str) -> str:
    """`text` for matplotlib to draw as it stands: no `$` of a study's label begins mathematics."""
    return text.replace("$", r"\$")


def power_of_ten(number: str) -> str:
    """A number as mathematics: of `1e-07` it is `1\\times10^{-7}`, others stay as they are."""
    digits, _, power = number.partition("e")
    return rf"{digits}\times10^{{{int(power)}}}" if power else number


def wrapped(text: str, width: int) -> list[str]:
    """Lines of about `width` letters, broken neither at `KEEP` nor inside mathematics.

    Mathematics counts as many letters as are drawn of it. Words longer than a line are broken if they have none.
    """
    text = _ONE_STAND_IN.sub("?", text)  # no font has them
    parts = re.split(r"(?<!\\)\$", text)  # an escaped one is a letter
    formulas = parts[1::2]
    stand_ins = [_STAND_IN[i % 2] * max(1, _drawn(formula)) for i, formula in enumerate(formulas)]
    parts[1::2] = stand_ins
    lines = textwrap.wrap("".join(parts), width, break_long_words=not formulas)
    # long words beside formulas
    parted = ([line] if _ONE_STAND_IN.search(line) else textwrap.wrap(line, width) for line in lines)
    lines = list(itertools.chain.from_iterable(parted))
    left = iter(formulas)
    return [_ONE_STAND_IN.sub(lambda _: f"${next(left)}$", line).replace(KEEP, " ") for line in lines]


_STAND_IN = "\ue000", "\ue001"  # by turns, as one formula may follow another
_ONE_STAND_IN = re.compile(f"{_STAND_IN[0]}+|{_STAND_IN[1]}+")


def _drawn(formula: str) -> int:
    """About the number of letters that are drawn of a formula."""
    text = re.sub(r"\\(?:mathrm|text|mathit|left|right)\b|[{}_^]", "", formula)
    return len(re.sub(r"\\(?:[a-zA-Z]+ ?|.)", "x", text))


def shortened(texts: Sequence[str], most: int) -> list[str]:
    """`texts` of at most `most` letters each, an ellipsis in the middle of longer ones.

    Where some are then alike, the words that all end with are left out, or these and those that all begin with; if that
    does not tell them apart, they get numbers, from 1 on.
    """
    for whole in (texts, _without_common_words(texts), _without_common_words(texts, start=True)):
        short = [_shortened(text, most) for text in whole]
        if len(set(short)) == len(set(texts)):
            return short
    return [f"{i}: {_shortened(text, most - 5)}" for i, text in enumerate(texts, 1)]


def _without_common_words(texts: Sequence[str], *, start: bool = False) -> list[str]:
    """`texts` with an ellipsis in place of the words that all end with; with `start` also of those all begin with."""
    words = [text.split(" ") for text in texts]
    first = _alike(words) if start else 0
    last = _alike([each[first:][::-1] for each in words])
    return ["…" * (first > 0) + " ".join(each[first : len(each) - last]) + "…" * (last > 0) for each in words]


def _alike(lists: Sequence[Sequence[str]]) -> int:
    """How many words all these lists begin with."""
    return sum(1 for _ in itertools.takewhile(lambda found: len(set(found)) == 1, zip(*lists, strict=False)))


def _shortened(text: str, most: int) -> str:
    if len(text) <= most:
        return text
    tail = (most - 1) // 2
    return f"{text[: most - 1 - tail].rstrip()}…{text[-tail:].lstrip()}"


_FEWEST = 12  # letters of a line of a title


def fitted(text: str, width: float) -> list[str]:
    """Lines of `text`, which may hold mathematics, as a title of at most `width` inches, as far as it can be broken."""
    return narrowed(partial(wrapped, text), len(text), width, math=True)


def narrowed(lines_of: Callable[[int], list[str]], letters: int, width: float, *, math: bool = False) -> list[str]:
    """Lines of a title: `lines_of` as many letters, `letters` or fewer, as are at most `width` inches wide, if any are.

    `math`: whether dollars begin mathematics.
    """
    while width_of(lines := lines_of(letters), math=math) > width and letters > _FEWEST:
        letters -= 2
    return lines


def width_of(lines: Sequence[str], *, math: bool) -> float:
    """Width of the widest of these lines, with mathematics or without it, in a panel's title, inches."""
    from matplotlib import rcParams
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(family=rcParams["font.family"], size=rcParams["axes.titlesize"])
    widths = (float(text_to_path.get_text_width_height_descent(line, font, math)[0]) for line in lines)
    return max(widths, default=0.0) / 72
