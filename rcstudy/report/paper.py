"""The paper's figures: which grid of the cube holds which figure, and which case is which panel.

The paper: rolling contact with one or two elastic layers, Tribology Letters 69:139 (2021), Figures 3 to 10.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise, product

from rcstudy.report.layers import coating_text
from rcstudy.report.views import CaseView, GridView, creepage_text
from rcstudy.studyfile.axis_labels import letters

AXES: dict[str, frozenset[str]] = {
    "figure_3": frozenset({"layer_count", "thickness", "modulus"}),
    "figure_4": frozenset({"creepage"}),
    "figure_5": frozenset({"thickness", "modulus", "creepage"}),
    "figure_6": frozenset({"thickness", "modulus", "creepage"}),
    "figure_7": frozenset({"modulus", "creepage"}),
    "figure_8": frozenset({"modulus", "creepage"}),
    "figure_9": frozenset({"modulus", "creepage"}),
    "figure_10": frozenset({"modulus", "creepage"}),
}
"""Axes that a grid must have to be drawn as the paper's figure; other grids are drawn like those of any study."""

BARE = "figure_3_bare"
"""The uncoated case of Figure 3: one case, pressure only."""

MAPS = (7, 8, 9, 10)
"""The figures of section 3.3, which the paper's Tables 1 and 2 describe."""

LATERAL, SPIN = 1, 2
"""Places in a case's `creepage`."""


@dataclass(frozen=True)
class PaperCase:
    """A case of the paper: its figure number, its panel's letter, and its place among the others.

    `kind` is that of the layers, see `_kind`; `moduli` are theirs in MPa from the surface down, `thickness` is that of
    each over Hertz's radius; `creepage` is (longitudinal, lateral, spin), zeros where only the pressure was wanted.
    """

    view: CaseView
    figure: int
    panel: str
    kind: str
    moduli: tuple[float, ...]
    thickness: float
    creepage: tuple[float, float, float]

    @property
    def name(self) -> str:
        """Figure and panel, such as `7a`."""
        return f"{self.figure}{self.panel}"


Pair = tuple[PaperCase, PaperCase]


def paper_grids(found: Mapping[str, GridView]) -> dict[str, GridView]:
    """Those of a cube's grids that are the paper's, by their names and axes.

    One named as the uncoated case of Figure 3 is if it has a single case, and if no grid that is not the paper's is
    named `figure_3`.
    """
    papers = {name: grid for name, grid in found.items() if name in AXES and frozenset(grid.axes) == AXES[name]}
    bare = found.get(BARE)
    alone = "figure_3" in papers or "figure_3" not in found
    if bare is not None and alone and (bare.axes, bare.shape) == (("case",), (1,)):
        papers[BARE] = bare
    return {name: grid for name, grid in found.items() if name in papers}


def figure_number(grid: GridView) -> int:
    """Number of the paper's figure that `grid` belongs to."""
    return int(grid.name.split("_")[1])


def panel_letter(case: CaseView) -> str:
    """Letter of the panel that shows `case`, as the paper counts them; empty for the uncoated case of Figure 3.

    Figure 3: a one layer, b two layers. Figure 4: the creepage's own label (a, c, e, g; b, d, f, h are the
    paper's comparison method). Figures 5 and 6: by modulus, then thickness. Figures 7 to 10: by modulus,
    then creepage.
    """
    grid = case.grid
    if grid.name == BARE:
        return ""
    at = dict(zip(grid.axes, case.index, strict=True))
    size = dict(zip(grid.axes, grid.shape, strict=True))
    match figure_number(grid):
        case 3:
            return letters(at["layer_count"])
        case 4:
            return str(case.at("creepage"))
        case 5 | 6:
            return letters(at["modulus"] * size["thickness"] + at["thickness"])
        case _:
            return letters(at["modulus"] * size["creepage"] + at["creepage"])


def paper_cases(grids: Mapping[str, GridView]) -> list[PaperCase]:
    """All cases of the paper's figures in the cube, figure by figure."""
    return [_paper_case(view) for grid in paper_grids(grids).values() for view in grid.cases()]


def _paper_case(view: CaseView) -> PaperCase:
    layers = view.layers
    thickness = layers[0][1] / view.stored("hertz_radius") if layers else 0.0
    creepage = tuple(0.0 if value != value else value for value in view.creepage)
    return PaperCase(
        view,
        figure_number(view.grid),
        panel_letter(view),
        _kind(view),
        tuple(E for E, _ in layers),
        round(thickness, 9),
        creepage,  # type: ignore[arg-type]
    )


def _kind(view: CaseView) -> str:
    """`none` without layers, `compliant` or `stiff` by the layer at the surface, against the substrate.

    Empty where that is as stiff as the substrate, or the cube does not give the substrate's modulus: neither of both.
    """
    if not view.layers:
        return "none"
    ratio = view.layers[0][0] / view.substrate_modulus
    if abs(ratio - 1.0) < 1e-9:
        return ""
    return "compliant" if ratio < 1.0 else "stiff" if ratio > 1.0 else ""


def words(case: PaperCase, *, math: bool = False) -> str:
    """A case in words: figure and panel, layers, creepage (`7a: E1 = 0.5 Es, 0.5 a, xi_x = 0.002`).

    `math`: layers and creepage as mathematics of LaTeX.
    """
    text = f"{case.name}: {coating_text(case.view, math=math)}"
    return f"{text}, {creepage_text(case.view, math=math, units=True)}" if any(case.creepage) else text


def select(
    cases: Iterable[PaperCase],
    figures: Iterable[int],
    kind: str = "",
    *,
    lateral: bool | None = None,
    spin: bool | None = None,
) -> list[PaperCase]:
    """Cases of these figures, of this kind of layer (any if empty), with or without lateral creepage and spin.

    Not by letters of panels, which say where a case stands in the study and not what it is.
    """
    wanted = frozenset(figures)
    return [
        c
        for c in cases
        if c.figure in wanted
        and (not kind or c.kind == kind)
        and (lateral is None or bool(c.creepage[LATERAL]) is lateral)
        and (spin is None or bool(c.creepage[SPIN]) is spin)
    ]


def along_thickness(cases: Iterable[PaperCase]) -> Iterator[Pair]:
    """Pairs of cases that differ in thickness alone, (thinner, thicker), neighbours in thickness.

    Thickness varies within Figures 3, 5 and 6, and from Figure 7 to 8 and from 9 to 10.
    """
    family = {8: 7, 10: 9}
    groups = _grouped(cases, lambda c: (family.get(c.figure, c.figure), c.moduli, c.creepage))
    return _neighbours(groups, lambda c: c.thickness)


def along_creepage(cases: Iterable[PaperCase], component: int) -> Iterator[Pair]:
    """Pairs of cases that differ in one creepage alone, (smaller, larger) by magnitude, neighbours.

    `component` is LATERAL or SPIN.
    """
    return _neighbours(_but_for(cases, component), lambda c: abs(c.creepage[component]))


def with_more_spin(cases: Iterable[PaperCase]) -> Iterator[Pair]:
    """All pairs of cases that differ in spin alone, (less, more) by magnitude."""
    for members in _but_for(cases, SPIN):
        ranked = sorted(members, key=lambda c: abs(c.creepage[SPIN]))
        yield from ((a, b) for a, b in combinations(ranked, 2) if abs(a.creepage[SPIN]) < abs(b.creepage[SPIN]))


def compliant_and_stiff(cases: Iterable[PaperCase]) -> Iterator[Pair]:
    """Pairs (compliant, stiff) of cases that differ in the layers' moduli alone, each with each."""
    for members in _grouped(cases, lambda c: (c.figure, len(c.moduli), c.thickness, c.creepage)):
        yield from product(*([c for c in members if c.kind == kind] for kind in ("compliant", "stiff")))


def same_layers(cases: Iterable[PaperCase]) -> list[list[PaperCase]]:
    """The cases in groups that have a figure and its layers in common, and differ in creepage."""
    return _grouped(cases, lambda c: (c.figure, c.moduli, c.thickness))


def same_creepage(cases: Iterable[PaperCase]) -> list[list[PaperCase]]:
    """The cases in groups that have their creepages in common."""
    return _grouped(cases, lambda c: c.creepage)


def _but_for(cases: Iterable[PaperCase], component: int) -> list[list[PaperCase]]:
    def rest(c: PaperCase) -> object:
        return c.figure, c.moduli, c.thickness, c.creepage[:component], c.creepage[component + 1 :]

    return _grouped(cases, rest)


def _grouped(cases: Iterable[PaperCase], key: Callable[[PaperCase], object]) -> list[list[PaperCase]]:
    groups: dict[object, list[PaperCase]] = {}
    for c in cases:
        groups.setdefault(key(c), []).append(c)
    return list(groups.values())


def _neighbours(groups: Iterable[Sequence[PaperCase]], order: Callable[[PaperCase], float]) -> Iterator[Pair]:
    for members in groups:
        ranked = sorted(members, key=order)
        yield from ((a, b) for a, b in pairwise(ranked) if order(a) < order(b))
