"""Study file -> validated Study: every error found before anything is computed, each with file, line and column.

A study is a shared scene and named grids; a grid overrides the shared scene key by key and is either the product of its
axes or a list of labelled cases. Lengths and moduli may be relative (`0.25 a`, `2 Es`); they are resolved per case.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Never

from rcstudy.errors import UserError
from rcstudy.mechanics.scene import Scene
from rcstudy.studyfile.build import BuildError, build, parts_of, window_problem
from rcstudy.studyfile.grid_plan import GridPlan
from rcstudy.studyfile.grids import GridReader
from rcstudy.studyfile.spec import (
    OutputsSpec,
    SceneSpec,
    StudySpec,
    by_meaning,
    grid_name_problem,
    lacks,
    report_missing,
    validate,
)
from rcstudy.studyfile.yamlfile import parse, read_text
from rcstudy.studyfile.yamltree import Node, Problems, find, from_python

MAX_CASES = 2_000_000  # of one study


@dataclass(frozen=True)
class Study:
    """A validated study; `text` is the file as read, `sha256` the hash of its UTF-8 bytes (hex)."""

    name: str
    description: str
    text: str
    path: Path
    sha256: str
    outputs: OutputsSpec
    grids: tuple[GridPlan, ...]

    @property
    def size(self) -> int:
        """Number of cases of all grids."""
        return sum(grid.size for grid in self.grids)

    def refuse(self, *location: str, allowed: str) -> Never:
        """Raise UserError: a command cannot use the value at this `location` (keys); `allowed` says what it can."""
        problems = Problems(str(self.path))
        problems.add(find(parse(self.text, problems), location), allowed)
        problems.check()
        raise AssertionError  # never reached: there is a problem


def load_study(path: str | Path) -> Study:
    """Read and validate the study file `path`.

    UserError lists everything found wrong, one line each: `file:line:column: key: value: what is allowed`.
    """
    return study_from_text(read_text(path), path)


def study_from_text(text: str, path: str | Path) -> Study:
    """Validate the `text` of a study file; `path` is what messages call it. UserError as for `load_study`."""
    problems = Problems(str(path))
    root = parse(text, problems)
    spec = validate(StudySpec, root, problems)
    grids: list[GridPlan] = []
    if root.is_mapping:
        inside = by_meaning(StudySpec, root)
        shared = inside.get("scene", Node({}, "scene", "", root.line, root.column))
        if shared.is_mapping:
            validate(SceneSpec, shared, problems, partial=True)
            listed = inside.get("grids")
            grids = _read_grids(listed, shared, problems) if listed is not None and listed.is_mapping else []
    problems.check()
    assert spec is not None  # or there are problems
    return Study(
        name=spec.study,
        description=spec.description,
        text=text,
        path=Path(path),
        sha256=hashlib.sha256(text.encode()).hexdigest(),
        outputs=spec.outputs,
        grids=tuple(grids),
    )


def scene_from_mapping(mapping: Mapping[str, Any]) -> Scene:
    """The scene of a mapping with the keys of a study's `scene:`; UserError, with key paths, if it is none."""
    problems = Problems()
    if not isinstance(mapping, Mapping):
        raise UserError(f"a scene is a mapping, not {type(mapping).__name__}")
    node = from_python(mapping)
    spec = validate(SceneSpec, node, problems)
    problems.check()
    assert spec is not None  # or there are problems
    try:
        parts = parts_of(spec, None)
        scene = build(parts)
    except BuildError as error:
        for key, reason in error.conflicts.items():
            problems.add(find(node, (key,)), reason)
        problems.check()
        raise UserError(str(error)) from error
    key, reason = window_problem(parts, scene)
    if reason:
        problems.add(find(node, ("mesh", key)), reason)
    problems.check()
    return scene


def _read_grids(listed: Node, shared: Node, problems: Problems) -> list[GridPlan]:
    grids = []
    readers = []
    cases = 0
    for name, node in listed.value.items():
        if reason := grid_name_problem(name):
            problems.add(node.at_key(), reason, value="name of a grid")
        reader = GridReader(name, node, shared, problems)
        cases += reader.count()
        if cases > MAX_CASES:
            problems.add(node.at_key(), f"at most {MAX_CASES} cases in a study", value=f"{cases} cases so far")
            break
        readers.append(reader)
        grid = reader.read()
        if grid is not None:
            grids.append(grid)
    _tell_lacking(readers, shared, problems)
    return grids


def _tell_lacking(readers: Sequence[GridReader], shared: Node, problems: Problems) -> None:
    """Report what the scenes of grids lack: at the `shared` scene, once, what it and all of them lack."""
    readers = [reader for reader in readers if reader.trees]
    for location in dict.fromkeys(location for reader in readers for location in reader.lacking):
        of = [reader.scene for reader in readers if location in reader.lacking]
        everywhere = len(of) == len(readers) and lacks(shared, location)
        for scene in [shared] if everywhere else of:
            report_missing(SceneSpec, scene, location, problems)
