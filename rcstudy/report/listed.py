"""Columns for the settings in which the listed cases differ, besides layers and creepages, and for numbers of axes.

Loads and friction come from the cube, settings that it does not store for every case from the text of its study; those
are left empty if that is not understood.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from rcstudy.report.cells import Column, Value
from rcstudy.report.views import CaseView, GridView, number_in
from rcstudy.settings import unit_of
from rcstudy.studyfile.axis_labels import PAIR, default_label, labelled_scenes
from rcstudy.studyfile.quantities import as_quantity, number_text
from rcstudy.studyfile.spec import SceneSpec

CREEPAGES = (
    Column("longitudinal", "xi_x", r"$\xi_x$"),
    Column("lateral", "xi_y", r"$\xi_y$"),
    Column("spin_rad_per_mm", f"phi ({unit_of('spin')})", rf"$\varphi$ ({unit_of('spin')})"),
)
"""Columns of the numbers of a case's `creepage`."""

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
    return "rigid" if other is None else str(other.E)


def _window(scene: SceneSpec) -> str:
    return default_label(scene.mesh.size, 0) if scene.mesh.size else _FITTED


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


_FITTED = "auto"
_SPIN_POINT = "spin_point_cells"
_STORED_KEYS = tuple(column.key for column in _STORED)
_MARGIN = _Setting("mesh.margin", Column("margin", "Margin"), lambda s: number_text(s.mesh.margin))

_PATHS = {
    "load": _STORED[0],
    "friction": _STORED[1],
    **{setting.path: setting.column for setting in _SETTINGS},
}
"""Columns of settings, by the dotted paths of these."""

_PAIRS = ("radius_mm", "window_mm", "cells")
"""Columns whose values may be pairs of numbers, along x and y."""


def listed_settings(cases: Sequence[CaseView]) -> tuple[list[Column], list[dict[str, Value]]]:
    """Columns of the settings in which these cases differ, of whatever grids they are, and the values of each case.

    Lengths are in mm, moduli in MPa, also those that the study gives over Es; windows are given in words. Settings that
    do not differ have a column in the CSV alone if their numbers are an axis.
    """
    found = {id(case.grid): case.grid for case in cases}
    readers = {key: _reader(grid) for key, grid in found.items()}
    rows = [readers[id(case.grid)](case) for case in cases]
    # as text, since one NaN is no other; a setting that is not known of a case has no key
    differ = {c.key for c in _PATHS.values() if len({str(row[c.key]) for row in rows if c.key in row}) > 1}
    along = {column.key for path, column in _PATHS.items() if any(_is_axis(path, grid) for grid in found.values())}
    columns = [c if c.key in differ else replace(c, csv_only=True) for c in _PATHS.values() if c.key in differ | along]
    return columns, rows


def shared_settings(rows: Sequence[Mapping[str, Value]]) -> str:
    """A sentence on the settings that all cases share, `In all cases: load 100 N, friction 1, ...`; may be empty.

    `rows`: what `listed_settings` returns of the cases. Settings that are not known of a case are left out, and so is a
    spin point at the cells' centres.
    """
    parts = []
    for column in _PATHS.values():
        values = {str(row.get(column.key, "")) for row in rows}
        value = values.pop() if len(values) == 1 else ""
        if column.key in _STORED_KEYS and value:
            value = number_text(float(value))
        if not value or value == "nan" or (column.key == _SPIN_POINT and value == "0"):
            continue
        name, _, unit = column.title.removesuffix(")").partition(" (")
        measured = unit and value[0].isdigit() and value[-1].isdigit()
        parts.append(f"{name[0].lower()}{name[1:]} {value}" + (f" {unit}" if measured else ""))
    return f"In all cases: {', '.join(parts)}." if parts else ""


def listed_pairs(
    columns: Sequence[Column], rows: Sequence[Mapping[str, Value]]
) -> tuple[list[Column], list[dict[str, Value]]]:
    """Columns in the CSV alone of the numbers along x and y where values of these settings are pairs (`20 x 30`).

    `columns`, `rows`: what `listed_settings` returns. A single number is that of either direction; NaN (written empty)
    for a window that is fitted or given over a.
    """
    found: list[Column] = []
    split: list[dict[str, Value]] = [{} for _ in rows]
    for column in columns:
        words = [str(row.get(column.key)) for row in rows]
        if column.key not in _PAIRS or not any(PAIR in text for text in words):
            continue
        name, _, unit = column.key.partition("_")
        keys = [f"{name}_{direction}_{unit}".rstrip("_") for direction in "xy"]
        found += [replace(column, key=key, csv_only=True, digits=12) for key in keys]
        for text, numbers in zip(words, split, strict=True):
            first, _, second = text.partition(PAIR)
            # NaN: of a fitted window, or of one that is given over a
            numbers.update(zip(keys, map(number_in, (first, second or first)), strict=True))
    return found, split


def listed_numbers(cases: Sequence[CaseView]) -> tuple[list[Column], list[dict[str, Value]]]:
    """Columns in the CSV alone of the cases' creepages, and of axes that are no column of `listed_settings`.

    The values of each case are longitudinal and lateral creepage (-) and spin (rad/mm); thickness (mm), modulus (MPa;
    of the layer next to the substrate) and Poisson's ratio of its layers, their number, and the margin of its window,
    each if that is an axis of a grid or differs between cases; thickness, modulus and number also where cases of a
    list, or values of an axis `layers`, have other layers. NaN (written empty) where a case has no creepage, no layers
    or no such margin.
    """
    of_grid: dict[int, list[CaseView]] = {}
    for case in cases:
        of_grid.setdefault(id(case.grid), []).append(case)
    given = set[str]().union(*map(_given, of_grid.values()), _differing(cases))
    along = [numbers for name, numbers in _ALONG.items() if name in given]
    columns = [*CREEPAGES, *(column for column, _ in along)]
    rows: list[dict[str, Value]] = []
    for case in cases:
        row: dict[str, Value] = dict(zip((c.key for c in CREEPAGES), case.creepage, strict=True))
        rows.append(row | {column.key: number(case) for column, number in along})
    return [replace(column, csv_only=True, digits=12) for column in columns], rows


def _given(cases: Sequence[CaseView]) -> set[str]:
    """Which of `_ALONG` are axes of the one grid of these cases, or told by labels of layers."""
    axes = set(cases[0].grid.axes)
    differ = bool(axes & {"case", "layers"}) and len({tuple(case.layers) for case in cases}) > 1
    return axes & _ALONG.keys() | (_OF_LAYERS if differ else set())


def _differing(cases: Sequence[CaseView]) -> set[str]:
    """Which numbers of layers differ among those of these cases that have layers."""
    return {
        name for name in (*_OF_LAYERS, "layer_nu") if len({_ALONG[name][1](case) for case in cases if case.layers}) > 1
    }


# a coating's thickness and modulus are read from its layers: coordinates of axes may be over a or Es, or words
_ALONG: dict[str, tuple[Column, Callable[[CaseView], float]]] = {
    "layer_count": (Column("layer_count", "Layers"), lambda case: len(case.layers)),
    "thickness": (Column("thickness_mm", "Thickness (mm)"), lambda case: _next_to_substrate(case)[1]),
    "modulus": (Column("modulus_MPa", "Modulus (MPa)"), lambda case: _next_to_substrate(case)[0]),
    "layer_nu": (
        Column("layer_nu", "Layer nu"),
        lambda case: case.layer_nu[-1] if case.layers else math.nan,
    ),
    "margin": (_MARGIN.column, lambda case: case.stored("margin")),
}
"""Columns of axes that are no settings of `_PATHS`, and what a case has there."""

_OF_LAYERS = {"layer_count", "thickness", "modulus"}
"""Those of them that sets of layers differ in that are given whole."""


def _next_to_substrate(case: CaseView) -> tuple[float, float]:
    """Modulus (MPa) and thickness (mm) of the layer on the substrate; NaN without layers."""
    return case.layers[-1] if case.layers else (math.nan, math.nan)


def _is_axis(path: str, grid: GridView) -> bool:
    """Whether an axis of the grid has the numbers of the setting at `path`."""
    name = path.rpartition(".")[2]
    return path in grid.starting[1] and name in grid.axes and grid.numeric(name)


def _reader(grid: GridView) -> Callable[[CaseView], dict[str, Value]]:
    """Gives the settings of a case of the grid by the keys of their columns, without those that are not known."""
    scene, varied = grid.starting
    shared = {}
    if scene is not None:
        shared = {s.path: s.text(scene) for s in (*_SETTINGS, _MARGIN) if not varied & {s.path, _top(s.path)}}

    @cache
    def scenes(axis: str) -> Mapping[str, SceneSpec]:
        return labelled_scenes(grid.study_text, grid.name, axis, frozenset(map(str, grid.small(axis).values)))

    @cache
    def written(setting: _Setting, axis: str, i: int) -> str | None:
        """The value of a setting at `i` of the axis that sets it; None if that is not understood."""
        if setting.path in varied and axis != "case":
            return grid.written(axis, i)
        own = scenes(axis).get(grid.written(axis, i))
        return setting.text(own) if own else None

    def text(case: CaseView, setting: _Setting) -> str | None:
        if scene is None or setting.path in shared:
            return shared.get(setting.path)
        at = dict(zip(grid.axes, case.index, strict=True))
        name = setting.path.rpartition(".")[2]
        axis = "case" if "case" in at else name if setting.path in varied else _top(setting.path)
        return written(setting, axis, at[axis]) if axis in at else None

    def row(case: CaseView) -> dict[str, Value]:
        texts = {setting.column.key: text(case, setting) for setting in _SETTINGS}
        # what is relative to other settings may differ where they do
        texts["counterbody_E_MPa"] = _in_MPa(texts["counterbody_E_MPa"], texts["substrate_E_MPa"])
        if texts["window_mm"] == _FITTED:
            texts["window_mm"] = f"{_FITTED}, margin {text(case, _MARGIN)}"
        known = {key: value for key, value in texts.items() if value is not None}
        return {"load_N": case.stored("load"), "friction": case.stored("friction"), **known}

    return row


def _top(path: str) -> str:
    """The path of the mapping that the setting at `path` is a key of; empty if it is none's."""
    return path.rpartition(".")[0]


def _in_MPa(modulus: str | None, es: str | None) -> str | None:
    """A modulus in MPa, both as text, of one in MPa or over Es (MPa); other words as they are."""
    quantity = as_quantity(modulus)
    if quantity is None or not quantity.scale:
        return modulus
    return None if es is None else number_text(quantity.resolve(float(es)))
