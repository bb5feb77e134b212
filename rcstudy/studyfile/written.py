"""What a study's text, such as that stored in a cube, says of the scene that one of its grids starts from."""

from __future__ import annotations

from functools import lru_cache

from rcstudy.errors import UserError
from rcstudy.studyfile.spec import SceneSpec, validate
from rcstudy.studyfile.yamlfile import parse
from rcstudy.studyfile.yamltree import Node, Problems, from_python, merge, with_entry

# stands for required settings of a scene that only the axes of a grid give
_ANY_BODY = {"E": 1, "nu": 0}
_ANY = {"substrate": _ANY_BODY, "radius": 1, "load": 1, "mesh": {"size": "auto", "cells": [4, 4]}}


@lru_cache(maxsize=2)
def _read(text: str) -> Node | None:
    """The tree of a study's text, remembered, as of another, for its many grids; None if it cannot be parsed."""
    try:
        return parse(text, Problems(""))
    except UserError:
        return None


def written_grid(text: str, name: str) -> tuple[Node, Node] | None:
    """The trees of the scene that grid `name` of the study `text` starts from, and of the grid itself.

    None where the text is not understood, which may happen with the text in a cube. The values of settings that only
    the cases give are arbitrary.
    """
    root = _read(text)
    grid = root.value.get("grids") if root is not None and root.is_mapping else None
    grid = grid.value.get(name) if grid is not None and grid.is_mapping else None
    if root is None or grid is None or not grid.is_mapping:
        return None
    scene = from_python(_ANY)
    for place in (root, grid):
        given = place.value.get("scene")
        scene = scene if given is None else merge(scene, given)
    body = scene.value.get("counterbody")
    if body is not None and body.is_mapping:  # else it is rigid
        scene = with_entry(scene, ("counterbody",), merge(from_python(_ANY_BODY), body))
    return scene, grid


@lru_cache(maxsize=64)
def starting_scene(text: str, name: str) -> tuple[SceneSpec | None, frozenset[str]]:
    """The scene that grid `name` of the study `text` starts from, and the dotted paths that its cases set themselves.

    Of a mapping in a list of cases these are its key, and the paths of what it holds.

    The scene is None where `written_grid` is, or where it is not valid.
    """
    written = written_grid(text, name)
    if written is None:
        return None, frozenset()
    scene, grid = written
    axes, cases = grid.value.get("axes"), grid.value.get("cases")
    varied = set(axes.value) if axes is not None and axes.is_mapping else set()
    for case in cases.value if cases is not None and cases.is_list else ():
        for key, node in case.value.items() if case.is_mapping else ():
            varied |= {key, *(f"{key}.{part}" for part in (node.value if node.is_mapping else ()))}
    return validate(SceneSpec, scene, Problems("")), frozenset(varied)
