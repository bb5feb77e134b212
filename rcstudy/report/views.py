"""Reading a cube for the report: grids, their cases, and the words that name a case.

A :class:`GridView` is one grid of a study (any number of named axes); a :class:`CaseView` is one of its
cases. Numbers and fields of a case that was not solved are never handed out: `number` gives NaN and
`field` raises, so that no figure or table can show them as results.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

from rcstudy.cube import case_dims, unit_text, value_text
from rcstudy.cube import grids as cube_grids
from rcstudy.errors import UserError
from rcstudy.report.labels import power_of_ten
from rcstudy.result import CellState, Status
from rcstudy.settings import name_with_body, unit_of
from rcstudy.storage.layout import LABEL, MISSING
from rcstudy.studyfile.quantities import as_quantity, number_text
from rcstudy.studyfile.spec import SceneSpec
from rcstudy.studyfile.written import starting_scene

_WITH_UNIT = re.compile(r"([-+.\de]+) (mm|MPa)")
_AS_ASKED = re.compile(r"([-+.\de]+) ?(mm|MPa)?")
_EVEN = 1e-3  # relative difference of the steps between cells: rounding in single precision is less


class GridView:
    """One grid of a cube: `name`, `axes` (names, in order), `shape`, its cases, and the text of the whole study."""

    def __init__(self, name: str, dataset: xr.Dataset, study_text: str = "") -> None:
        self.name = name
        self.study_text = study_text
        self.dataset = dataset
        self.axes = case_dims(dataset)
        self.shape = tuple(dataset.sizes[d] for d in self.axes)
        self._loaded: dict[str, xr.DataArray] = {}
        self._placed: dict[str, tuple[np.ndarray, tuple[int | None, ...]]] = {}
        self._names = frozenset(dataset.variables)

    def __contains__(self, name: str) -> bool:
        return name in self._names

    def small(self, name: str) -> xr.DataArray:
        """Variable or coordinate `name` loaded whole; for everything that is not a field."""
        if name not in self._loaded:
            self._loaded[name] = self.dataset[name].load()
        return self._loaded[name]

    def placed(self, name: str) -> tuple[np.ndarray, tuple[int | None, ...]]:
        """The values of `small`, and the number of the axis that each dimension is, None if it is none.

        Kept, as tables ask for some hundred numbers of each case, and xarray would take most of their time.
        """
        if name not in self._placed:
            array = self.small(name)
            axes = tuple(self.axes.index(str(d)) if d in self.axes else None for d in array.dims)
            self._placed[name] = array.values, axes
        return self._placed[name]

    def case(self, *index: int) -> CaseView:
        """The case at `index` (one integer per axis)."""
        return CaseView(self, index)

    def cases(self) -> Iterator[CaseView]:
        """All cases, last axis fastest."""
        return (CaseView(self, index) for index in np.ndindex(*self.shape))

    @cached_property
    def substrate_nu(self) -> float | None:
        """Poisson's ratio of the substrate, from the study's text: NaN where cases differ, None if not understood."""
        scene, varied = self.starting
        if scene is None:
            return None
        return float("nan") if varied & {"substrate", "substrate.nu"} else scene.substrate.nu

    @cached_property
    def starting(self) -> tuple[SceneSpec | None, frozenset[str]]:
        """The scene that the cases start from, and the dotted paths of its settings that cases set themselves.

        From the study's text; the scene is None if that is not understood.
        """
        return starting_scene(self.study_text, self.name)

    @property
    def first(self) -> CaseView:
        """The first case."""
        return self.case(*(0 for _ in self.axes))

    def along(self, axis: str) -> list[CaseView]:
        """The cases along `axis`, at the first value of all others."""
        at = self.axes.index(axis)
        return [self.case(*(i if k == at else 0 for k in range(len(self.axes)))) for i in range(self.shape[at])]

    def held_at(self, axis: str, text: str) -> GridView | None:
        """This grid with the one value `text` of `axis`, as the study wrote it, with its unit or not, or as a number.

        None if it has no such axis, or no such value. A number may be off by 1e-6 if none is the same.
        """
        if axis not in self.axes:
            return None
        asked = {text, str(as_quantity(text) or text)}  # `a` is `1 a`
        for i in range(self.dataset.sizes[axis]):
            names = {self.written(axis, i), self.value(axis, i)}
            if asked & (names | {name.replace(" ", "") for name in names}):
                return self.at({axis: [i]})
        if not self.numeric(axis):
            return self._held_beside_relative_ones(axis, text)
        values = self.small(axis).values.astype(float)
        off = np.abs(values - number_in(text.removesuffix(self.units(axis))))
        i = int(np.argmin(off))
        return self.at({axis: [i]}) if off[i] <= 1e-6 * abs(values[i]) else None

    def _held_beside_relative_ones(self, axis: str, text: str) -> GridView | None:
        """As `held_at`, of the numbers with a unit on an axis of words, however `text` writes the number."""
        asked = _AS_ASKED.fullmatch(text)
        for i in range(self.dataset.sizes[axis]):
            found = _WITH_UNIT.fullmatch(self.written(axis, i))
            if asked and found and number_in(asked[1]) == number_in(found[1]) and asked[2] in (None, found[2]):
                return self.at({axis: [i]})
        return None

    def at(self, places: Mapping[str, Sequence[int]]) -> GridView:
        """This grid with the values at `places` of these axes only."""
        dataset = self.dataset.isel({axis: list(which) for axis, which in places.items()})
        return GridView(self.name, dataset, self.study_text)

    def axis_values(self, axis: str) -> list[str]:
        """The values of `axis` as the study wrote them, with units: `0.25 a`, `460 x 300 mm`, or a label."""
        return [self.value(axis, i) for i in range(self.dataset.sizes[axis])]

    def value(self, axis: str, i: int) -> str:
        """Value `i` of `axis` as the study wrote it, with units."""
        text, units = self.written(axis, i), self.units(axis)
        return f"{text} {units}" if units and text[-1:].isdigit() else text

    def name_of(self, axis: str) -> str:
        """The name of `axis` for people; `E` and `nu` with the body that they belong to: `substrate E`."""
        return name_with_body(axis, str(self.dataset[axis].attrs.get("long_name", ""))) if axis in self else axis

    def units(self, axis: str) -> str:
        """Units of the numbers, or pairs of numbers, along `axis` as people write them; empty if they have none."""
        name = axis if self.numeric(axis) else f"{axis}_x"
        return unit_text(self.dataset[name]) if name in self else ""

    def numeric(self, axis: str) -> bool:
        """Whether the values of `axis` are single numbers, not words or labels."""
        return axis in self and self.small(axis).dtype.kind in "if"

    def written(self, axis: str, i: int) -> str:
        """Value `i` of `axis` as the study wrote it, without units: `0.25 a`, `0.05`, or a label.

        A coordinate holds numbers in mm or MPa alone; how they were written is found in the labels of cases.
        """
        if axis in self and not self.numeric(axis):
            return str(self.small(axis).values[i])
        index = tuple(i if name == axis else 0 for name in self.axes)
        parts = []
        for name, k in zip(self.axes, index, strict=True):
            words = "" if self.numeric(name) or name not in self else f"{re.escape(str(self.small(name).values[k]))}|"
            value = f"{words}[^,]*"
            parts.append(f"{name}=({value})" if name == axis else f"{name}=(?:{value})")
        found = re.fullmatch(", ".join(parts), str(self.small(LABEL).values[index]))
        if found:
            return found[1]
        return value_text(self.small(axis).values[i]) if axis in self else str(i)


def number_in(text: str) -> float:
    """The number that a text is; NaN if it is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan


@dataclass(frozen=True)
class CaseView:
    """One case of a grid; `index` is its position along the grid's axes."""

    grid: GridView
    index: tuple[int, ...]

    def at(self, name: str) -> np.ndarray:
        """Variable or coordinate `name` at this case; shape: that of its dimensions other than the grid's axes."""
        values, axes = self.grid.placed(name)
        return np.asarray(values[tuple([slice(None) if axis is None else self.index[axis] for axis in axes])])

    @property
    def status(self) -> Status:
        """How the case ended."""
        return Status(int(self.at("status")))

    @property
    def rolling(self) -> bool:
        """Whether the case is solved and has tractions (not the pressure alone)."""
        return bool(np.isfinite(self.number("force_x")))

    @property
    def mapped(self) -> bool:
        """Whether the case is solved and its tractions are stored cell by cell."""
        return self.rolling and "state" in self.grid

    @property
    def solved(self) -> bool:
        """Whether the case's numbers are results."""
        return self.status is Status.SOLVED

    @property
    def failure(self) -> str:
        """Why there is no result, such as `not converged: 300 steps`; empty if there is one."""
        if self.solved:
            return ""
        word = self.status.words
        reason = str(self.at("status_reason")) if "status_reason" in self.grid else ""
        return f"{word}: {reason}" if reason else word

    def number(self, name: str) -> float:
        """Scalar `name`; NaN where the case was not solved or the cube has no such variable."""
        return self.stored(name) if self.solved else float("nan")

    def stored(self, name: str) -> float:
        """Scalar `name` as the cube has it, whether the case was solved or not; NaN if absent."""
        return float(self.at(name)) if name in self.grid else float("nan")

    def recorded(self, name: str) -> float:
        """Scalar `name` whether the case was solved or not: for diagnostics of the solver, never for results.

        NaN where the solver did not get that far or the cube has no such variable.
        """
        value = self.stored(name)
        counts = name in self.grid and self.grid.small(name).dtype.kind == "i"
        return float("nan") if counts and value == MISSING else value

    def field(self, name: str) -> np.ndarray:
        """Field `name`, [nx, ny]; UserError if the case was not solved or the cube stores no such field, or not all."""
        if not self.solved:
            raise UserError(f"{self.grid.name}: {self.label}: not solved: {self.failure}")
        if name not in self.grid:
            raise UserError(f"{self.grid.name}: the cube stores no {name}")
        where = {d: i for d, i in zip(self.grid.axes, self.index, strict=True) if d in self.grid.dataset[name].dims}
        field = np.asarray(self.grid.dataset[name].isel(where).transpose("x", "y").values)[: self.x.size, : self.y.size]
        if np.isnan(field).any():
            hint = "if cubes cropped to their contacts were joined, then without zeros around these (docs/cube.md)"
            raise UserError(f"{self.grid.name}: {self.label}: {name} has cells without a value: {hint}")
        return field

    @cached_property
    def state(self) -> np.ndarray:
        """Field `state`, [nx, ny]; read once, as the paper's statements ask for that of each case some twenty times."""
        return self.field("state")

    @cached_property
    def contact(self) -> np.ndarray:
        """Whether cells are in contact, [nx, ny]."""
        # pressures alone have no states of cells
        return self.state != CellState.EXTERIOR if self.mapped else self.field("pressure") > 0.0

    @cached_property
    def half_sides(self) -> tuple[float, float]:
        """Largest |x| and |y| of a contact cell's outer edge, mm."""
        i, j = np.nonzero(self.contact)
        dx, dy = self.spacing
        return float(np.abs(self.x[i]).max() + dx / 2), float(np.abs(self.y[j]).max() + dy / 2)

    @cached_property
    def x(self) -> np.ndarray:
        """Cell centres along x (rolling direction), mm, [nx]."""
        return self._centres("x")

    @cached_property
    def y(self) -> np.ndarray:
        """Cell centres along y, mm, [ny]."""
        return self._centres("y")

    def _centres(self, dim: str) -> np.ndarray:
        # a grid whose cases have different meshes keeps centres per case, padded with NaN
        centres = self.at(f"{dim}_centre") if f"{dim}_centre" in self.grid else self.at(dim)
        centres = centres[np.isfinite(centres)]
        steps = np.diff(centres)
        if steps.size and not (steps.min() > 0.0 and np.ptp(steps) < _EVEN * steps.max()):
            hint = "as where cubes of different cells or windows were joined (docs/cube.md)"
            raise UserError(f"{self.grid.name}: {self.label}: {dim} does not ascend in equal steps, {hint}")
        return centres

    @property
    def spacing(self) -> tuple[float, float]:
        """Cell sizes dx, dy in mm."""
        return float(self.x[1] - self.x[0]), float(self.y[1] - self.y[0])

    @property
    def label(self) -> str:
        """The case in words, as the cube names it: `thickness=0.25 a, modulus=0.5 Es, creepage=a`."""
        return str(self.at(LABEL))

    @property
    def settings(self) -> list[str]:
        """The case in words with units, one for each axis: `thickness=0.05 mm`; its label in a list of cases."""
        values = [(axis, self.grid.value(axis, i)) for axis, i in zip(self.grid.axes, self.index, strict=True)]
        return [value if axis == "case" else f"{self.grid.name_of(axis)}={value}" for axis, value in values]

    @cached_property
    def layers(self) -> list[tuple[float, float]]:
        """Layers from the surface down as (E in MPa, thickness in mm)."""
        return list(zip(self._of_layers("layer_modulus"), self._of_layers("layer_thickness"), strict=True))

    @property
    def layer_nu(self) -> list[float]:
        """Poisson's ratios of the layers, from the surface down."""
        return self._of_layers("layer_nu")

    def _of_layers(self, name: str) -> list[float]:
        # cases of fewer layers than others of the grid have NaN beyond theirs
        values = np.atleast_1d(self.at(name)) if name in self.grid else np.empty(0)
        return [float(value) for value in values if np.isfinite(value)]

    @property
    def creepage(self) -> tuple[float, float, float]:
        """Longitudinal, lateral creepage (-) and spin (rad/mm); NaN where the cube does not say."""
        return self.stored("longitudinal"), self.stored("lateral"), self.stored("spin")

    @cached_property
    def substrate_modulus(self) -> float:
        """Es in MPa, from the coating's modulus axis: the layer on the substrate has `modulus_ratio` times Es.

        NaN where the grid has no such axis, its values are words (`0.5 Es` beside MPa), or the case has no layers.
        """
        name = "modulus_ratio" if "modulus_ratio" in self.grid else "modulus"
        units = self.grid.dataset[name].attrs.get("units") if name in self.grid else None
        if units != "1" or not self.layers or not self.grid.numeric(name):
            return float("nan")
        return self.layers[-1][0] / self.stored(name)


def grids(tree: xr.DataTree) -> dict[str, GridView]:
    """The grids of an opened cube by name, in the study's order."""
    text = str(tree.attrs.get("study_text", ""))
    return {name: GridView(name, dataset, text) for name, dataset in cube_grids(tree).items()}


def short_number(value: float) -> str:
    """A computed number as people write it: `0.5`, `0.002`, `15820`, `0` (four significant digits)."""
    text = f"{value:.4g}"
    return f"{float(text):.0f}" if 1e4 <= abs(value) < 1e6 else text


def given_text(value: float, *, math: bool) -> str:
    """A given number as people write it: `0.25`, `1e-07`, or that as mathematics."""
    return power_of_ten(number_text(value)) if math else number_text(value)


def set_as(text: str, *, math: bool) -> str:
    """`text` as it is, or between the signs that make it mathematics."""
    return f"${text}$" if math else text


def creepage_text(case: CaseView, *, math: bool = False, units: bool | None = None) -> str:
    """The creepages that are not zero, `xi_x = 0.002, phi = 0.01 rad/mm`; or that all are zero, or none is given.

    `units`: whether to write rad/mm; by default unless `math`.
    """
    if all(map(np.isnan, case.creepage)):
        return "none (pressure only)"
    return creepages_text(case.creepage, math=math, units=not math if units is None else units) or "no creepage"


def creepages_text(creepages: Sequence[float], *, math: bool, units: bool) -> str:
    """Longitudinal, lateral creepage (-) and spin (rad/mm) in words, but for those that are zero or NaN."""
    names = (r"\xi_x", r"\xi_y", r"\varphi") if math else ("xi_x", "xi_y", "phi")
    parts = []
    for name, value, key in zip(names, creepages, ("longitudinal", "lateral", "spin"), strict=True):
        if value and not np.isnan(value):
            unit = f" {unit_of(key)}".rstrip() if units else ""
            parts.append(set_as(f"{name} = {given_text(value, math=math)}", math=math) + unit)
    return ", ".join(parts)
