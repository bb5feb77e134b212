"""Compares a cube with a reference: structure and status exactly, numbers relative to a scale in each case.

The scale of a field is its largest magnitude in the case, that of a scalar its own magnitude in the case. Scalars that
may be small beside related ones have larger scales: forces and moment (over Hertz's radius) the largest of them, the
slip area the contact area, the friction power that force times the creepage. Each case has its own scales, so one under
a small load is compared as strictly as one under a thousand times that load. A scale is at least 1e-6 of the quantity's
natural size (friction times load for forces; for slip the creepage, or the approach over Hertz's radius, by which
pressure alone tilts surfaces, if that is more), so that rounding is not taken for a difference where a quantity
vanishes, such as the lateral traction under purely longitudinal creepage, or slip where all sticks without creepage.
Solver diagnostics (iterations, residuals, proof, error estimates, seconds) must be present; their values are not
compared.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
import xarray as xr

from rcstudy.cube import case_dims, grids
from rcstudy.errors import UserError
from rcstudy.progress import counted
from rcstudy.result import VARIABLES, CellState, Status
from rcstudy.scales import natural_scales, shared_scales
from rcstudy.storage.layout import CASE_KEY, GRID, LABEL, LAYER_SETTINGS, SETTINGS, as_floats
from rcstudy.structure import (
    COORDINATE_RTOL,
    align,
    holds_windows,
    in_order,
    settings_that_differ,
    variables_in_both,
)
from rcstudy.studyfile.yamltree import suggest
from rcstudy.tolerances import TOLERABLE, Tolerances

TABLE = "table of all cases"
"""Name, in reports, of the root table of a cube of several grids."""

_FLOOR = 1e-6  # of a quantity's natural size: the smallest scale
_IN_BOTH = " in both cubes"  # ends the note on a case that is not solved in either
_BLOCK = 32  # cases whose fields are in memory at a time


@dataclass(frozen=True)
class Difference:
    """The difference of one variable in one case.

    `value` and the tolerance `allowed` are relative to `scale`; `value` is infinite where there is no number to give,
    for instance where only one cube has a value. `note` explains.
    """

    grid: str
    label: str
    variable: str
    value: float
    allowed: float
    scale: float
    note: str = ""

    @property
    def excess(self) -> float:
        """`value` over `allowed`; above 1 is too much."""
        if self.value == 0.0:
            return 0.0
        return self.value / self.allowed if self.allowed > 0 else np.inf

    @property
    def unsolved(self) -> bool:
        """Whether it is no difference but a case that is not solved in either cube, with the same status."""
        return self.note.endswith(_IN_BOTH)

    @property
    def bad(self) -> bool:
        """Whether it is more than allowed."""
        return not self.value <= self.allowed


@dataclass
class Comparison:
    """Outcome of a comparison: differences in structure and in numbers.

    `structure`: differences other than in numbers, in words; `bad`: differences beyond their tolerance; `worst`: the
    largest difference of each variable by name; `cases`: number of cases compared; `flips`: cells whose states were
    allowed to differ; `unmatched`: patterns of tolerances that match no case; `settings`: where these differ, settings
    that the studies differ in, in words.
    """

    structure: list[str] = field(default_factory=list)
    bad: list[Difference] = field(default_factory=list)
    worst: dict[str, Difference] = field(default_factory=dict)
    cases: int = 0
    flips: int = 0
    unmatched: list[str] = field(default_factory=list)
    settings: list[str] = field(default_factory=list)

    @property
    def same(self) -> bool:
        """Whether the cube agrees with the reference."""
        return not self.structure and not self.bad and self.cases > 0

    def add(self, difference: Difference) -> None:
        """Record one difference."""
        if difference.bad:
            self.bad.append(difference)
        before = self.worst.get(difference.variable)
        if before is None or difference.excess > before.excess:
            self.worst[difference.variable] = difference

    def text(self, limit: int = 20) -> str:
        """The outcome for a person to read, at most `limit` lines of each kind."""
        lines = [f"structure: {text}" for text in self.structure[:limit]]
        if len(self.structure) > limit:
            lines.append(f"structure: {len(self.structure) - limit} more differences")
        lines += self.settings[:limit]
        if self.bad:
            lines.append("differences beyond their tolerance, worst first:")
            ordered = sorted(self.bad, key=lambda d: -d.excess)
            lines += [f"  {_line(d)}" for d in ordered[:limit]]
            if len(ordered) > limit:
                lines.append(f"  {len(ordered) - limit} more")
        within = sorted((d for d in self.worst.values() if d.value > 0 and not d.bad), key=lambda d: -d.excess)
        if within:
            lines.append("largest differences within their tolerance:")
            lines += [f"  {_line(d)}" for d in within[:limit]]
        if self.flips:
            lines.append(f"{self.flips} cells at the bound stick in one cube and slip in the other (allowed)")
        if unsolved := sum(d.unsolved for d in self.bad):
            lines.append(
                f"{counted(unsolved, 'case')} with the same failure in both cubes: --allow-unsolved accepts it"
            )
        lines += [f"no case matches {pattern}: its tolerances are not used" for pattern in self.unmatched]
        found = "same" if self.same else "DIFFERENT"
        beyond = f"{counted(len(self.bad), 'value')} beyond tolerance"
        lines.append(f"{found}: {counted(self.cases, 'case')} compared, {beyond}")
        return "\n".join(lines)


def _line(d: Difference) -> str:
    size = "" if not np.isfinite(d.value) else f" {d.value:.2e} of {d.scale:.4g} (allowed {d.allowed:.1e})"
    note = f" {d.note}" if d.note else ""
    return f"{d.variable}:{size}{note} [{d.grid}: {d.label}]"


def compare(
    cube: xr.DataTree, reference: xr.DataTree, tolerances: Tolerances | None = None, *, allow_unsolved: bool = False
) -> Comparison:
    """Compare `cube` with `reference`, both from :func:`rcstudy.open`.

    Cases are matched by the coordinates of their axes; whatever is in one cube only is a difference, and so is a case
    that is not solved, unless `allow_unsolved`. Fields are read a few cases at a time.

    Raises UserError when a tolerance is given for a variable that the reference does not have.
    """
    tolerances = tolerances or Tolerances()
    outcome = Comparison()
    ours, theirs = grids(cube), grids(reference)
    known = {str(name) for grid in theirs.values() for name in grid.variables}
    for name in sorted(tolerances.named()):
        if name not in known:
            there = suggest(name, [variable for variable in TOLERABLE if variable in known])
            raise UserError(f"a tolerance is given for {name}, which the reference does not have: {there}")
        if name not in TOLERABLE:
            raise UserError(f"a tolerance is given for {name}; only these have one: {', '.join(TOLERABLE)}")
    outcome.structure += [f"{name}: missing in the cube" for name in theirs if name not in ours]
    outcome.structure += [f"{name}: not in the reference" for name in ours if name not in theirs]
    outcome.unmatched = tolerances.unmatched([f"{n}/{label}" for n in theirs for label in theirs[n][LABEL].values.flat])
    slack: dict[str, float] = {}
    whole = functools.cache(lambda: holds_windows(cube) and holds_windows(reference))
    compared = functools.partial(
        _compare_grid, tolerances=tolerances, outcome=outcome, allow_unsolved=allow_unsolved, slack=slack, whole=whole
    )
    for name in theirs:
        if name in ours:
            outcome.cases += compared(name, ours[name], theirs[name])
    if outcome.cases == 0:
        labels = [_cases(tree) for tree in (ours, theirs)]
        why = "no case is in both cubes" if labels[0].isdisjoint(labels[1]) else "cases cannot be matched"
        outcome.structure.append(f"{why}: nothing was compared")
    if (GRID in cube.dataset) != (GRID in reference.dataset):
        outcome.structure.append("one cube has a table of all cases, the other has not")
    elif GRID in cube.dataset and not outcome.structure and not outcome.bad:
        # it repeats the grids' scalars: it is compared only once these agree, else differences would be listed twice
        compared(TABLE, _table(cube), _table(reference))
    if not outcome.same:
        outcome.settings = settings_that_differ(cube, reference, [name for name in theirs if name in ours])
    return outcome


def _cases(tree: Mapping[str, xr.Dataset]) -> set[tuple[str, ...]]:
    """The cases of all grids by grid and label, whatever the order of the axes in labels."""
    return {(name, *sorted(str(x).split(", "))) for name, grid in tree.items() for x in grid[LABEL].values.flat}


def _table(tree: xr.DataTree) -> xr.Dataset:
    table = tree.to_dataset().assign_attrs(axes="entry")
    names = [f"{grid}: {label}" for grid, label in zip(table[GRID].values, table[LABEL].values, strict=True)]
    return table.assign_coords(entry=("entry", names))


def _compare_grid(
    name: str,
    ours: xr.Dataset,
    theirs: xr.Dataset,
    tolerances: Tolerances,
    outcome: Comparison,
    allow_unsolved: bool,
    slack: dict[str, float],
    whole: Callable[[], bool],
) -> int:
    """Compare one grid; returns the number of cases that are in both. `slack`: see `_Grid`; `whole`: see `align`."""
    dims = case_dims(theirs)
    aligned, problems = align(ours, theirs, case_dims(ours), dims, whole)
    outcome.structure += [f"{name}: {problem}" for problem in problems]
    if aligned is None or any(aligned[1].sizes[d] == 0 for d in dims):
        return 0
    problems, names = variables_in_both(*aligned, dims)
    outcome.structure += [f"{name}: {problem}" for problem in problems]
    here, there = (in_order(grid, dims) for grid in aligned)
    grid = _Grid(name, here, there, dims, tolerances, outcome, slack)
    grid.compare_status(allow_unsolved)
    fields = [variable for variable in names if {"x", "y"} <= set(there[variable].dims)]
    for variable in fields:
        if variable == "state":
            grid.compare_state()
        else:
            grid.compare_field(variable)
    for variable in names:
        if variable not in fields:
            grid.compare_scalar(variable)
    return int(grid.labels.size)


class _Grid:
    """One grid of both cubes, reduced to the cases that are in both.

    `slack`: by case, the area (mm2) of the cells whose states were allowed to differ; the slip area may differ by it.
    """

    def __init__(
        self,
        name: str,
        ours: xr.Dataset,
        theirs: xr.Dataset,
        dims: tuple[str, ...],
        tolerances: Tolerances,
        outcome: Comparison,
        slack: dict[str, float],
    ) -> None:
        self.name, self.ours, self.theirs, self.dims = name, ours, theirs, dims
        self.outcome, self.slack = outcome, slack
        self.shape = tuple(theirs.sizes[d] for d in dims)
        self.labels = theirs[LABEL].values.reshape(self.shape)
        grids_of = theirs[GRID].values if GRID in theirs else None
        self.rules = np.empty(self.shape, dtype=object)
        for index in np.ndindex(*self.shape):
            grid = name if grids_of is None else str(grids_of[index])
            self.rules[index] = tolerances.of_case(grid, str(self.labels[index]))
        self.natural = natural_scales(theirs, dims)
        self.together = shared_scales(theirs, dims, self.natural)

    def _case(self, index: tuple[int, ...]) -> str:
        label = str(self.labels[index])
        return f"{self.theirs[GRID].values[index]}: {label}" if GRID in self.theirs else f"{self.name}: {label}"

    def _add(
        self, index: tuple[int, ...], variable: str, value: float, allowed: float, scale: float, note: str
    ) -> None:
        label = str(self.labels[index])
        self.outcome.add(Difference(self.name, label, variable, float(value), float(allowed), float(scale), note))

    def compare_status(self, allow_unsolved: bool) -> None:
        """Status must be the same and, unless `allow_unsolved`, solved."""
        if "status" not in self.theirs or "status" not in self.ours:
            return
        ours, theirs = self.ours["status"].values, self.theirs["status"].values
        for index in np.ndindex(*self.shape):
            here, there = _status_word(int(ours[index])), _status_word(int(theirs[index]))
            if here != there:
                self._add(index, "status", np.inf, 0.0, 1.0, f"is {here}, in the reference {there}")
            elif here != Status.SOLVED.words and not allow_unsolved:
                self._add(index, "status", np.inf, 0.0, 1.0, f"is {here}{_IN_BOTH}")

    def compare_scalar(self, name: str) -> None:
        """Compare one number (or text, or number per layer) per case; of solver diagnostics only their presence."""
        if name in ("status", "status_reason", CASE_KEY):
            return
        own_work = name in VARIABLES and name not in TOLERABLE
        a, b = self.ours[name].values, self.theirs[name].values
        if b.dtype.kind not in "fiu":
            for index in zip(*np.nonzero(a.astype(str) != b.astype(str)), strict=True):
                if name == LABEL and _same_words(str(a[index]), str(b[index])):
                    continue
                note = f"is {str(a[index])!r}, not {str(b[index])!r}"
                self._add(index[: len(self.dims)], name, np.inf, 0.0, 1.0, note)
            return
        a, b = as_floats(a), as_floats(b)
        if own_work and not _difference(a, b)[1]:
            return
        setting = name in SETTINGS or name in LAYER_SETTINGS
        for index in _worth_a_look(a, b, len(self.shape)):
            here, there = np.atleast_1d(a[index]), np.atleast_1d(b[index])
            scale = _largest(there)
            if not setting and name in self.natural:
                scale = max(scale, float(self.together[name][index]), _FLOOR * float(self.natural[name][index]))
            rtol = COORDINATE_RTOL if setting else self.rules[index].rtol(name)
            difference, note = _difference(here, there)
            if setting and there.size > 1 and np.isfinite(difference):
                difference, scale = _worst(here, there)
            if own_work and np.isfinite(difference):
                continue
            if name == "slip_area":
                difference = max(0.0, difference - self.slack.get(self._case(index), 0.0))
            part = _relative(difference, scale)
            if not note and np.ndim(a[index]) == 0:
                note = _in_words(float(a[index]), float(b[index]), exactly=part > rtol)
            self._add(index, name, part, rtol, scale, note)

    def compare_field(self, name: str) -> None:
        """Compare a field, cell by cell."""
        for index, a, b in self._pairs(name):
            a, b = as_floats(a), as_floats(b)
            scale = _largest(b)
            if name in self.natural:
                scale = max(scale, _FLOOR * float(self.natural[name][index]))
            difference, note = _difference(a, b)
            value = _relative(difference, scale)
            rtol = self.rules[index].rtol(name)
            if not note and value > rtol:
                count = int(np.count_nonzero(np.abs(a - b) > rtol * scale))
                note = f"in {count} of {b.size} cells"
            self._add(index, name, value, rtol, scale, note)

    def compare_state(self) -> None:
        """Compare the states of cells, all but a few at the bound that stick in one cube and slip in the other."""
        for index, a, b in self._pairs("state"):
            different = a != b
            count = int(np.count_nonzero(different))
            if count == 0:
                self._add(index, "state", 0.0, 0.0, 1.0, "")
                continue
            rule = self.rules[index]
            between = ((a == CellState.STICK) & (b == CellState.SLIP)) | (
                (a == CellState.SLIP) & (b == CellState.STICK)
            )
            at_bound = between & self._at_bound(index, np.where(a == CellState.STICK, 0, 1), rule.state_bound)
            if np.array_equal(at_bound, different) and count <= rule.state_flips:
                self.outcome.flips += count
                self.slack[self._case(index)] = count * self._cell_area(index)
                continue
            note = f"differs in {count} of {b.size} cells"
            if np.any(between):
                note += (
                    f"; {np.count_nonzero(between)} of them stick here and slip there, "
                    f"{np.count_nonzero(at_bound)} at the bound (allowed {rule.state_flips})"
                )
            self._add(index, "state", np.inf, 0.0, 1.0, note)

    def _at_bound(self, index: tuple[int, ...], sticks_in: np.ndarray, tolerance: float) -> np.ndarray:
        """Whether each cell's traction is within `tolerance` of mu p in the cube in which the cell sticks: [nx, ny].

        `sticks_in` [nx, ny]: 0 for the cube, 1 for the reference. False everywhere if a cube lacks the fields.
        """
        at = dict(zip(self.dims, index, strict=True))
        found = []
        for grid in (self.ours, self.theirs):
            fields = ("pressure", "traction_x", "traction_y")
            if any(name not in grid for name in (*fields, "friction")):
                return np.zeros(sticks_in.shape, dtype=bool)
            one = grid[[*fields, "friction"]].isel({d: i for d, i in at.items() if d in grid.dims})
            bound = float(one["friction"]) * one["pressure"].values
            size = np.hypot(one["traction_x"].values, one["traction_y"].values)
            found.append(np.abs(size - bound) <= tolerance * bound)
        ours, theirs = found
        return np.where(sticks_in == 0, ours, theirs)

    def _pairs(self, name: str) -> Iterator[tuple[tuple[int, ...], np.ndarray, np.ndarray]]:
        """Index and the field `name` of both cubes, [nx, ny] each, case by case; read in blocks of cases."""
        whole, inner = len(self.shape) - 1, 1  # axes behind `whole` are read whole: so many cases at a time
        while whole > 0 and inner * self.shape[whole] <= _BLOCK:
            inner *= self.shape[whole]
            whole -= 1
        step, order = max(_BLOCK // inner, 1), (*self.dims[whole:], "x", "y")
        both = [grid[name].variable for grid in (self.ours, self.theirs)]  # without coordinates, which take time
        for lead in np.ndindex(*self.shape[:whole]):
            for start in range(0, self.shape[whole], step):
                at = dict(zip(self.dims, (*lead, slice(start, start + step)), strict=False))
                a, b = (variable.isel(at).transpose(*order).values for variable in both)
                for k, *rest in np.ndindex(*b.shape[:-2]):
                    yield (*lead, start + k, *rest), a[k, *rest], b[k, *rest]

    def _cell_area(self, index: tuple[int, ...]) -> float:
        """Area of a cell (mm2) of one case."""
        area = 1.0
        for dim in ("x", "y"):
            centres = (
                self.theirs[dim].values if dim in self.theirs.coords else self.theirs[f"{dim}_centre"].values[index]
            )
            area *= float(centres[1] - centres[0]) * (1.0 + 1e-9)
        return area


def _status_word(value: int) -> str:
    return Status(value).words if value in set(Status) else f"unknown ({value})"


def _worth_a_look(a: np.ndarray, b: np.ndarray, dims: int) -> Iterator[tuple[int, ...]]:
    """The first case, by which the variable is known, and those whose numbers are not the same in both cubes.

    Cases are along the first `dims` dimensions. One by one a million that are the same would take minutes.
    """
    same = (a == b) | (np.isnan(a) & np.isnan(b))
    differ = ~same.all(axis=tuple(range(dims, same.ndim)))
    differ.flat[:1] = True
    yield from map(tuple, np.argwhere(differ).tolist())


def _largest(values: np.ndarray) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(finite.max()) if finite.size else 0.0


def _difference(a: np.ndarray, b: np.ndarray) -> tuple[float, str]:
    """Largest absolute difference, and a note; infinite where only one array has a value or where infinities differ."""
    missing = np.isnan(a) != np.isnan(b)
    if np.any(missing):
        here = int(np.count_nonzero(missing & np.isnan(a)))
        there = int(np.count_nonzero(missing)) - here
        where = [f"{n} values missing in {name}" for n, name in ((here, "the cube"), (there, "the reference")) if n]
        return np.inf, " and ".join(where)
    if not np.array_equal(np.isinf(a) * np.sign(a), np.isinf(b) * np.sign(b), equal_nan=True):
        return np.inf, "is infinite in one cube only"
    finite = np.isfinite(b)
    return (float(np.abs(a[finite] - b[finite]).max()) if np.any(finite) else 0.0), ""


def _worst(a: np.ndarray, b: np.ndarray) -> tuple[float, float]:
    """Difference and magnitude of the value (of one layer, say) that differs most over its own magnitude."""
    pairs = [(float(abs(x - y)), float(abs(y))) for x, y in zip(a, b, strict=True) if np.isfinite(y)]
    return max(pairs, key=lambda pair: _relative(*pair), default=(0.0, 0.0))


def _in_words(one: float, other: float, *, exactly: bool) -> str:
    """Two different numbers with nine digits; if these are the same, `exactly` with all, else nothing."""
    alike = f"{one:.9g}" == f"{other:.9g}"
    digits = ".17g" if alike else ".9g"
    return "" if alike and not exactly else f"{one:{digits}}, not {other:{digits}}"


def _same_words(one: str, other: str) -> bool:
    """Whether labels such as `load=50, a` are alike, their numbers within what coordinates may differ by."""
    parts, others = (re.split(r"(\d+(?:\.\d+)?(?:e[-+]?\d+)?)", text) for text in (one, other))
    return len(parts) == len(others) and all(
        a == b or (at % 2 == 1 and math.isclose(float(a), float(b), rel_tol=COORDINATE_RTOL))
        for at, (a, b) in enumerate(zip(parts, others, strict=True))
    )


def _relative(difference: float, scale: float) -> float:
    if difference == 0.0:
        return 0.0
    return difference / scale if scale > 0 else np.inf
