"""Columns for the settings in which the cases of a list differ, besides layers and creepages.

Loads and friction come from the cube, settings that it does not store for every case from the text of its study; those
are left empty if that is not understood.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

from rcstudy.grids import default_label, labelled_scenes
from rcstudy.quantities import number_text
from rcstudy.report.cells import Column, Value
from rcstudy.report.views import CaseView, GridView
from rcstudy.spec import SceneSpec

_STORED = (
    Column("load_N", "Load (N)", form=".12g", digits=12),
    Column("friction", "Friction", form=".12g", digits=12),
)


@dataclass(frozen=True)
class _Setting:
    """A setting of the scene at a dotted `path`, its column, and its value in words."""

    path: str
    column: Column
    text: Callable[[SceneSpec], str]


def _counterbody_modulus(scene: SceneSpec) -> str:
    other = scene.counterbody
    return "rigid" if other is None else number_text(other.E.resolve(scene.substrate.E))


def _window(scene: SceneSpec) -> str:
    return default_label(scene.mesh.size, 0) if scene.mesh.size else f"auto, margin {number_text(scene.mesh.margin)}"


_SETTINGS = (
    _Setting("radius", Column("radius_mm", "Radius (mm)"), lambda s: default_label(s.radius, 0)),
    _Setting("substrate.E", Column("substrate_E_MPa", "Substrate E (MPa)"), lambda s: number_text(s.substrate.E)),
    _Setting(
        "substrate.nu",
        Column("substrate_nu", "Substrate nu", r"Substrate $\nu$"),
        lambda s: number_text(s.substrate.nu),
    ),
    _Setting("counterbody.E", Column("counterbody_E_MPa", "Counterbody E (MPa)"), _counterbody_modulus),
    _Setting(
        "counterbody.nu",
        Column("counterbody_nu", "Counterbody nu", r"Counterbody $\nu$"),
        lambda s: number_text(s.counterbody.nu) if s.counterbody else "",
    ),
    _Setting("mesh.size", Column("window_mm", "Window (mm)"), _window),
    _Setting("mesh.cells", Column("cells", "Cells"), lambda s: default_label(s.mesh.cells, 0)),
    _Setting("coupling", Column("coupling", "Coupling"), lambda s: s.coupling),
    _Setting("method", Column("method", "Method"), lambda s: s.method),
    _Setting("discretisation", Column("discretisation", "Discretisation"), lambda s: s.discretisation),
    _Setting("spin_point", Column("spin_point_cells", "Spin point (cells)"), lambda s: number_text(s.spin_point)),
    _Setting(
        "tolerance.normal",
        Column("tolerance_normal", "Tolerance of the pressure"),
        lambda s: number_text(s.tolerance.normal),
    ),
    _Setting(
        "tolerance.tangential",
        Column("tolerance_tangential", "Tolerance of the tractions"),
        lambda s: number_text(s.tolerance.tangential),
    ),
)


def listed_settings(found: Sequence[GridView]) -> tuple[list[Column], list[dict[str, Value]]]:
    """Columns of the settings that differ within a list of cases, and their values in each case of all grids."""
    if not any("case" in grid.axes for grid in found):
        return [], [{}] * sum(math.prod(grid.shape) for grid in found)
    rows: list[dict[str, Value]] = []
    differ: set[str] = set()
    for grid in found:
        own = list(_rows(grid))
        rows += own
        if "case" in grid.axes:
            differ |= {key for key in own[0] if len({row[key] for row in own}) > 1}
    columns = [c for c in (*_STORED, *(setting.column for setting in _SETTINGS)) if c.key in differ]
    return columns, rows


def _rows(grid: GridView) -> Iterator[dict[str, Value]]:
    """The settings of each case of a grid, by the keys of their columns."""
    scene, varied = grid.starting

    @cache
    def scenes(axis: str) -> Mapping[str, SceneSpec]:
        return labelled_scenes(grid.study_text, grid.name, axis, frozenset(map(str, grid.small(axis).values)))

    def written(case: CaseView, setting: _Setting) -> str:
        top, _, name = setting.path.rpartition(".")
        at = dict(zip(grid.axes, case.index, strict=True))
        axis = "case" if "case" in at else top
        if scene is None:
            return ""
        if setting.path in varied and name in at:
            return grid.written(name, at[name])
        if not varied & {setting.path, top}:
            return setting.text(scene)
        own = scenes(axis).get(grid.written(axis, at[axis])) if axis in at else None
        return setting.text(own) if own else ""

    for case in grid.cases():
        yield {
            "load_N": case.stored("load"),
            "friction": case.stored("friction"),
            **{setting.column.key: written(case, setting) for setting in _SETTINGS},
        }
