"""The cases of a cube that are not solved, each as a study of its own, to find out what is wrong with it."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rcstudy.cases import scene_record
from rcstudy.cube import grids, open_cube
from rcstudy.errors import UserError
from rcstudy.mechanics.scene import Scene
from rcstudy.result import Status
from rcstudy.storage.layout import LABEL
from rcstudy.storage.publish import make_folder, replacing
from rcstudy.study import study_from_text
from rcstudy.studyfile.grid_plan import GridPlan
from rcstudy.studyfile.spec import MAX_NAME


class FailedCase(NamedTuple):
    """A case that was not solved: `name` fit for a file, and `study`, a study of it alone, with how it ended."""

    name: str
    study: str


def failed_cases(path: Path) -> list[FailedCase]:
    """All cases of the cube at `path` that are not solved, in the order of its grids.

    Raises UserError when the cube cannot be read, or has such cases of a study that this version does not understand.
    """
    with open_cube(path) as tree:
        name = _plain(str(tree.attrs.get("study", "study")))
        found: list[FailedCase] = []
        plans: dict[str, GridPlan] = {}
        for grid, dataset in grids(tree).items():
            for index in zip(*(dataset["status"].values != Status.SOLVED).nonzero(), strict=True):
                place = tuple(int(i) for i in index)
                if not plans:
                    plans = _plans(str(tree.attrs.get("study_text", "")), path)
                if grid not in plans or not plans[grid].has(place):
                    raise UserError(f"{path}: its study has no case {place} of grid {grid}")
                label, status, reason = (dataset[n].values[index] for n in (LABEL, "status", "status_reason"))
                own = _name(name, grid, place, len(found))
                heading = f"{grid}: {label}: {Status(int(status)).words}: {reason}"
                # this scene alone, not those of what may be a million others
                found.append(FailedCase(own, _study(own, heading, plans[grid].scene(place))))
    return found


def _name(study: str, grid: str, place: tuple[int, ...], before: int) -> str:
    """Name of a study of one case, by that of its `study`, its grid and place, or how many others are listed before.

    The last where a place on many axes leaves no room in what a name may have.
    """
    tail = f"-{grid}-{'-'.join(str(i + 1) for i in place)}"
    if len(tail) >= MAX_NAME:
        tail = f"-{grid}-case-{before + 1}"
    return study[: MAX_NAME - len(tail)] + tail


def _plain(name: str) -> str:
    """`name`, which a cube gives, made fit for a file and for a study."""
    return re.sub(r"[^A-Za-z0-9_.-]", "_", name).lstrip("_.-") or "study"


def _plans(text: str, path: Path) -> dict[str, GridPlan]:
    """The grids of the study as it is written in the cube, by name."""
    try:
        study = study_from_text(text, path)
    except UserError as error:
        raise UserError(f"{path}: its study is not understood by this version:\n{error}") from error
    return {grid.name: grid for grid in study.grids}


def _study(name: str, heading: str, scene: Scene) -> str:
    """A study file of one case; `heading` becomes a comment."""
    lines = [f"# {line}" for line in textwrap.wrap("".join(c if c.isprintable() else " " for c in heading), 110)]
    lines += [f"study: {name}", "scene:"]
    # JSON is YAML, too, and keeps floats to their last bit
    lines += [f"  {key}: {json.dumps(value)}" for key, value in scene_record(scene).items()]
    lines += ["grids:", "  failed:", "    cases:", "      - {label: failed}"]
    return "\n".join(lines) + "\n"


def listing(found: Sequence[FailedCase]) -> str:
    """The studies one after another, as documents of one YAML stream."""
    return "---\n".join(case.study for case in found)


def write_studies(found: Sequence[FailedCase], folder: Path) -> list[Path]:
    """A file for each study in `folder`. Raises UserError when they cannot be written."""
    if found:
        make_folder(folder)
    paths = []
    for case in found:
        path = folder / f"{case.name}.yaml"
        with replacing(path) as temporary:
            temporary.write_text(case.study, encoding="utf-8")
        paths.append(path)
    return paths
