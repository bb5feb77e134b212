"""Speed against error: the cases as rows of the report, and the settings that reach a target."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import total_ordering

import numpy as np

TARGETS = (0.01, 0.001, 0.0001)
"""The errors for which settings are looked up."""

_WORDS = {
    "pressure": ("pressure (L2)", "pressure, L2, over that of the pressure"),
    "pressure_max": ("largest pressure", "largest pressure, relative"),
    "traction": ("tractions (L2)", "tractions, L2, over that of the tractions"),
    "traction_max": ("largest traction", "largest traction, relative"),
    "force": ("force", "tangential force (vector), over its magnitude"),
    "moment": ("moment", "spin moment, relative"),
    "friction_power": ("friction power", "friction power, relative"),
    "slip_area": ("slip area", "slip area, relative"),
}

QUANTITIES = {name: short for name, (short, _) in _WORDS.items()}
"""The errors reported and their names in tables and figures."""

ERRORS = {name: words for name, (_, words) in _WORDS.items()}
"""The same, all dimensionless, with what each is relative to (the reference's)."""

SOLVER = "solver_"
"""Prefix of the errors against the same mesh's tightest solution."""

REFERENCE = "reference_"
"""Prefix of the reference's own error, as its difference from the next coarser mesh."""

SHOWN = ("force", "moment", "friction_power", "slip_area", "traction_max", "traction")
"""Quantities whose errors are drawn over the time of solutions."""

_UNCERTAIN = 3.0
"""Factor by which extrapolated numbers of cells may be uncertain."""

LEAST = 1e-5
"""Relative error below which errors are small by chance, and smaller than those of the references."""


@total_ordering
@dataclass(frozen=True)
class BothTolerances:
    """The tolerances of pressure and tractions (`normal`, `tangential`, -) of a case. The looser ones are the greater.

    The looser of the two decides, as it bounds the error of the tractions; then the tighter one, then that of the
    pressure, whose errors reach both fields. So no two that differ are equally tight.
    """

    normal: float
    tangential: float

    def __lt__(self, other: BothTolerances) -> bool:
        return self._looseness < other._looseness

    def __str__(self) -> str:
        """`1e-05`, or `1e-05/1e-07` (pressure/tractions) where they differ."""
        return "/".join(map(tolerance_text, (self.normal, self.tangential)[: 1 + self.differ]))

    @property
    def differ(self) -> bool:
        """Whether the two are not the same."""
        return self.normal != self.tangential

    @property
    def _looseness(self) -> tuple[float, float, float]:
        return max(self.normal, self.tangential), min(self.normal, self.tangential), self.normal


def tolerance_text(tolerance: float) -> str:
    """A tolerance with as many digits as it has: `1e-05`, `1.5e-05`."""
    short = f"{tolerance:.0e}"
    return short if float(short) == tolerance else f"{tolerance:g}"


def explained(tolerances: Iterable[BothTolerances | None]) -> str:
    """A sentence, after a space, on what stands on either side of a stroke in these tolerances; empty if none has one.

    None, which stands for no tolerances, is passed over.
    """
    if any(tolerance is not None and tolerance.differ for tolerance in tolerances):
        return " Two tolerances, as in 1e-05/1e-07, are those of pressure/tractions."
    return ""


@total_ordering
@dataclass(frozen=True)
class Cells:
    """Numbers of cells of a mesh along x and y; of two meshes the one with fewer cells in all is the lesser."""

    x: int
    y: int

    def __lt__(self, other: Cells) -> bool:
        return (self.x * self.y, self.x) < (other.x * other.y, other.x)

    def __str__(self) -> str:
        """`32 x 16`."""
        return f"{self.x} x {self.y}"

    @property
    def short(self) -> str:
        """`32`, the cells along a side, if there are as many along both, else as `str`."""
        return f"{self.x}" if self.x == self.y else str(self)

    @property
    def along_side(self) -> float:
        """Cells along a side; the geometric mean of both numbers."""
        return math.sqrt(self.x * self.y)


@dataclass(frozen=True)
class Row:
    """One case: what it is, what it cost, and its errors.

    `problem` numbers the problems; `radius`: cells per contact radius, of oblong cells by the side of a square of the
    same area; `products` of the traction solver on all meshes; `seconds` of the whole solve. Errors are by QUANTITIES,
    and with the prefixes SOLVER and REFERENCE; each may be absent. `reference`: whether the case is the reference of
    its problem.
    """

    grid: str
    label: str
    problem: int
    method: str
    discretisation: str
    coupling: str
    cells: Cells
    radius: float
    tolerance: BothTolerances
    status: str
    products: float
    iterations_normal: float
    iterations_tangential: float
    seconds: float
    errors: dict[str, float] = field(default_factory=dict)
    reference: bool = False

    @property
    def solved(self) -> bool:
        """Whether the case converged and its proof holds."""
        return self.status == "solved"

    @property
    def scheme(self) -> str:
        """Discretisation of a Newton case, method of another."""
        return self.discretisation if self.method == "newton" else self.method

    @property
    def compared(self) -> bool:
        """Whether the case has errors; cases on the mesh of the reference have none."""
        return np.isfinite(self.error("pressure")).item()

    @property
    def shown(self) -> bool:
        """Whether figures and tables may show the case: it is solved, unless its method is not Newton's.

        Few cases of other methods pass their proof; those are shown for comparison, and figures say how many do.
        """
        return self.solved or self.method != "newton"

    @property
    def counts(self) -> bool:
        """Whether figures and tables of errors show the case."""
        return self.compared and self.shown

    def error(self, name: str) -> float:
        """The error `name`, NaN if there is none."""
        return self.errors.get(name, float("nan"))

    def bound(self, name: str) -> float:
        """The error `name` plus the reference's own, which is its difference from the next coarser mesh.

        Infinite if the case is not solved; NaN if there is no such error.
        """
        doubt = self.error(REFERENCE + name)
        return self.error(name) + (doubt if np.isfinite(doubt) else 0.0) if self.solved else np.inf


@dataclass(frozen=True)
class Setting:
    """The coarsest mesh with the loosest tolerances whose worst error is within `target`, and what it costs.

    `cells` and `tolerance` are None if no mesh that was tried reaches the target. Then `needed` is the number of cells
    along a side by a power law of order `order` through all meshes, meaningful if larger than `finest`, that of the
    finest mesh tried. The power law is fitted without the reference's own error, which is the same on all meshes and
    would lower the order.
    """

    coupling: str
    discretisation: str
    quantity: str
    target: float
    cells: Cells | None = None
    radius: tuple[float, float] = (0.0, 0.0)
    tolerance: BothTolerances | None = None
    worst: float = float("nan")
    products: float = float("nan")
    seconds: float = float("nan")
    needed: float = float("nan")
    order: float = float("nan")
    finest: float = 0.0


Groups = dict[tuple[Cells, BothTolerances], list[Row]]
"""Cases by cells and tolerances."""


def settings(rows: Sequence[Row], quantities: Iterable[str] = tuple(QUANTITIES)) -> list[Setting]:
    """For each coupling, discretisation, quantity and target the coarsest setting that reaches it in every problem.

    Only cases of the Newton method are considered, and only quantities that have an error: one that is zero by symmetry
    has none. A setting counts if all problems are solved with it, and if all finer meshes with these tolerances reach
    the target too (errors of coarse meshes can be small by chance). The reference's own error is added to each error.
    """
    newton = [r for r in rows if r.method == "newton" and r.compared]
    found = []
    for coupling in sorted({r.coupling for r in newton}, reverse=True):
        own = [r for r in newton if r.coupling == coupling]
        problems = {r.problem for r in own}
        for discretisation in schemes(own):
            groups: Groups = {}
            for r in own:
                if r.discretisation == discretisation:
                    groups.setdefault((r.cells, r.tolerance), []).append(r)
            whole = {key: group for key, group in groups.items() if {r.problem for r in group} == problems}
            for quantity in quantities:
                if not any(np.isfinite(r.error(quantity)) for r in own):
                    continue
                found += [_setting(Setting(coupling, discretisation, quantity, t), whole) for t in TARGETS]
    return found


def schemes(rows: Iterable[Row]) -> list[str]:
    """The discretisations of Newton cases, kalker first, then other methods."""
    is_other = {r.scheme: r.method != "newton" for r in rows}
    return sorted(is_other, key=lambda name: (is_other[name], name != "kalker", name))


def _setting(asked: Setting, whole: Groups) -> Setting:
    """`asked` completed by the setting found; `whole`: cases by cells and tolerances, where every problem has one."""
    worst = {key: worst_bound(group, asked.quantity) for key, group in whole.items()}
    worst = {key: value for key, value in worst.items() if not np.isnan(value)}
    asked = replace(asked, finest=max((cells.along_side for cells, _ in worst), default=0.0))
    good = [
        (cells, tolerance)
        for cells, tolerance in worst
        if all(worst[n, t] <= asked.target for n, t in worst if t == tolerance and n >= cells)
    ]
    if not good:
        return _extrapolated(asked, whole)
    coarsest = min(cells for cells, _ in good)
    key = coarsest, max(tolerance for cells, tolerance in good if cells == coarsest)
    group = whole[key]
    return replace(
        asked,
        cells=key[0],
        radius=(min(r.radius for r in group), max(r.radius for r in group)),
        tolerance=key[1],
        worst=worst[key],
        products=median(r.products for r in group),
        seconds=median(r.seconds for r in group),
    )


def worst_bound(rows: Iterable[Row], quantity: str) -> float:
    """Largest bound of an error, infinite if a case is not solved; NaN if no case has this error."""
    bounds = [r.bound(quantity) for r in rows]
    return max((b for b in bounds if not np.isnan(b)), default=float("nan"))


def _extrapolated(none: Setting, whole: Groups) -> Setting:
    """`none` completed by the cells that its target takes, by a power law through all meshes at the tightest one.

    Not where errors do not fall, or scatter so much about the law that the cells are uncertain by more than a factor
    `_UNCERTAIN` (one standard error of a straight line's fit, to first order).
    """
    tightest = min((tolerance for _, tolerance in whole), default=None)
    worst = {
        cells: worst_of(r.error(none.quantity) if r.solved else np.inf for r in group)
        for (cells, tolerance), group in whole.items()
        if tolerance == tightest and all(r.solved for r in group)
    }
    points = [(cells.along_side, error) for cells, error in worst.items() if error > 0.0]
    if len(points) < 3:
        return none
    x, y = np.log(points).T
    slope, start = np.polyfit(x, y, 1)
    if slope > -0.1:
        return none
    needed = (np.log(none.target) - start) / slope
    variance = np.sum((y - start - slope * x) ** 2) / (x.size - 2)
    spread = variance * (1.0 / x.size + (needed - x.mean()) ** 2 / np.sum((x - x.mean()) ** 2)) / slope**2
    if spread > np.log(_UNCERTAIN) ** 2:
        return none
    return replace(none, needed=float(np.exp(needed)), order=-float(slope))


def of_both(rows: Iterable[Row]) -> tuple[list[Row], list[Row]]:
    """The cases of `kalker` and those of `aligned` among `rows` that are of problems with cases of both."""
    own: dict[str, list[Row]] = {"kalker": [], "aligned": []}
    for r in rows:
        own.setdefault(r.scheme, []).append(r)
    both = {r.problem for r in own["kalker"]} & {r.problem for r in own["aligned"]}
    kalker, aligned = ([r for r in own[name] if r.problem in both] for name in ("kalker", "aligned"))
    return kalker, aligned


def some_lack(rows: Sequence[Row]) -> bool:
    """Whether some of the problems of `rows` lack a case on a mesh where others have one, by the same scheme."""
    found: dict[tuple[Cells, str], set[int]] = {}
    for r in rows:
        found.setdefault((r.cells, r.scheme), set()).add(r.problem)
    return any(of != {r.problem for r in rows} for of in found.values())


OF_FEWER = " (of fewer where not all have a solved case)"
"""What is added to a number of problems where `some_lack` a case."""


def proven(rows: Iterable[Row]) -> str:
    """A sentence for each method but Newton's on how many of its cases pass their proof; empty without such."""
    others: dict[str, list[bool]] = {}
    for r in rows:
        if r.method != "newton":
            others.setdefault(r.method, []).append(r.solved)
    return " ".join(f"{sum(of)} of {len(of)} cases shown of {name} pass their proof." for name, of in others.items())


def median(values: Iterable[float]) -> float:
    """Median of the finite values, NaN if there are none."""
    known = [v for v in values if np.isfinite(v)]
    return float(np.median(known)) if known else float("nan")


def worst_of(values: Iterable[float]) -> float:
    """Largest of the finite values, NaN if there are none."""
    known = [v for v in values if np.isfinite(v)]
    return max(known) if known else float("nan")


def shown_tolerance(rows: Iterable[Row]) -> BothTolerances | None:
    """The loosest tolerances but one: of those that count, what is enough for all meshes. None if there are none."""
    found = sorted({r.tolerance for r in rows}, reverse=True)
    return found[min(1, len(found) - 1)] if found else None


def shown_tolerances(rows: Sequence[Row]) -> dict[str, BothTolerances | None]:
    """The `shown_tolerance` of each scheme that `rows` have."""
    return {name: shown_tolerance(r for r in rows if r.scheme == name) for name in schemes(rows)}


def shown_coupling(rows: Iterable[Row]) -> str:
    """The coupling of figures that show one only: one-way, where there are such cases."""
    return min({r.coupling for r in rows}, key=lambda coupling: coupling != "one-way", default="one-way")


def costs_of_aligned(rows: Iterable[Row]) -> list[float]:
    """Ratios of times, `aligned` to `kalker`: for each mesh the median over the problems and tolerances of both."""
    seconds: dict[Cells, dict[tuple[int, BothTolerances], dict[str, float]]] = {}
    for r in rows:
        seconds.setdefault(r.cells, {}).setdefault((r.problem, r.tolerance), {})[r.scheme] = r.seconds
    costs = []
    for of_mesh in seconds.values():
        pairs = [of["aligned"] / of["kalker"] for of in of_mesh.values() if {"aligned", "kalker"} <= of.keys()]
        if pairs:
            costs.append(median(pairs))
    return costs


def marks(rows: Iterable[Row]) -> tuple[str, str]:
    """Words for what the figure of errors over time has beside its lines: numbers, and dots; empty where it has none.

    Numbers are beside the line of aligned cells, one-way, in the panel of friction power; dots are one-way cases.
    """
    counted = [r for r in rows if r.counts]
    used = shown_tolerances(counted)
    one_way = [r for r in counted if r.coupling == "one-way" and r.tolerance == used[r.scheme]]
    numbers = any(r.scheme == "aligned" and r.error("friction_power") > 0.0 for r in one_way)
    dots = any(r.error(quantity) >= LEAST for r in one_way for quantity in SHOWN)
    return (
        " (numbers: cells along a side)" if numbers else "",
        "; dots: each problem with one-way coupling" if dots else "",
    )
