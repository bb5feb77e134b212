"""Words on figures: a study's own are drawn letter for letter, and all are fitted to the room there is."""

from __future__ import annotations

import re
import textwrap

KEEP = "\N{NO-BREAK SPACE}"
"""A space at which `wrapped` breaks no line."""


def literal(text: str) -> str:
    """`text` for matplotlib to draw as it stands: no `$` of a study's label begins mathematics."""
    return text.replace("$", r"\$")


def wrapped(text: str, width: int) -> list[str]:
    """Lines of about `width` letters, broken neither at `KEEP` nor inside mathematics.

    Mathematics is taken to be as wide as its source without commands. Words longer than a line are broken where
    the text has no mathematics.
    """
    parts = re.split(r"(?<!\\)\$", text)  # an escaped one is a letter
    glued = "$".join(part.replace(" ", KEEP) if i % 2 else part for i, part in enumerate(parts))
    return [line.replace(KEEP, " ") for line in textwrap.wrap(glued, width, break_long_words=len(parts) == 1)]
