"""Labels of the values of axes: those that a study gives, those made from the values, and what labels stand for."""

from __future__ import annotations

import string
from collections.abc import Collection
from typing import Any

from rcstudy.studyfile.quantities import Quantity, number_text
from rcstudy.studyfile.spec import SceneSpec, validate
from rcstudy.studyfile.written import written_grid
from rcstudy.studyfile.yamltree import Problems, find, merge, with_entry, without

PAIR = " x "
"""Between the two numbers of a pair, such as the radii of an ellipse: `20 x 30`."""


def default_label(value: Any, position: int) -> str:
    """Label of the axis value at `position` that has none of its own: the value itself, or a letter."""
    if isinstance(value, str):
        return value
    if isinstance(value, Quantity):
        return str(value)
    if isinstance(value, int | float):
        return number_text(value)
    if isinstance(value, tuple) and value and isinstance(value[0], int | float | Quantity):
        one, other = (default_label(v, 0) for v in value)
        return one if isinstance(value[0], float) and one == other else f"{one}{PAIR}{other}"
    return letters(position)


def labelled_scenes(text: str, name: str, axis: str, labels: Collection[str]) -> dict[str, SceneSpec]:
    """The scenes of grid `name` of the study `text` with the values of `axis` that have these `labels`, by label.

    `axis`: a key of the scene whose values are labelled mappings or words, or `case` for a list of cases. All else is
    as in the scene that the grid starts from. Values that are not found or not understood are left out.
    """
    written = written_grid(text, name)
    if written is None:
        return {}
    start, grid = written
    values = find(grid, ("cases",) if axis == "case" else ("axes", axis))
    found = {}
    for i, node in enumerate(values.value if values.is_list else ()):
        own = node.value.get("label") if node.is_mapping else node
        label = letters(i) if own is None else own.text
        if label not in labels:
            continue
        value = without(node, ("label", "coating")) if node.is_mapping else node
        scene = validate(
            SceneSpec, merge(start, value) if axis == "case" else with_entry(start, (axis,), value), Problems()
        )
        if scene is not None:
            found[label] = scene
    return found


def letters(position: int) -> str:
    """a, b, ... z, aa, ab, ... for 0, 1, 2, ..."""
    head, tail = divmod(position, 26)
    return (letters(head - 1) if head else "") + string.ascii_lowercase[tail]
