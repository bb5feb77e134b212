"""The paper's figures: which grid of the cube holds which figure, and which case is which panel.

The paper: rolling contact with one or two elastic layers, Tribology Letters 69:139 (2021), Figures 3 to 10.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from rcstudy.grids import letters
from rcstudy.report.views import CaseView, GridView

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


@dataclass(frozen=True)
class PaperCase:
    """A case of the paper: its figure number, its panel's letter, and its place among the others.

    `kind` is `none`, `compliant` or `stiff`; `thickness` is that of each layer over Hertz's radius;
    `creepage` is (longitudinal, lateral, spin), zeros where only the pressure was wanted.
    """

    view: CaseView
    figure: int
    panel: str
    kind: str
    layer_count: int
    thickness: float
    creepage: tuple[float, float, float]

    @property
    def name(self) -> str:
        """Figure and panel, such as `7a`."""
        return f"{self.figure}{self.panel}"


def is_paper_grid(grid: GridView) -> bool:
    """Whether `grid` is one of the paper's, by its name and its axes."""
    if grid.name == BARE:
        return True
    return grid.name in AXES and frozenset(grid.axes) == AXES[grid.name]


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
    return [_paper_case(view) for grid in grids.values() if is_paper_grid(grid) for view in grid.cases()]


def _paper_case(view: CaseView) -> PaperCase:
    layers = view.layers
    kind = "none"
    if layers:
        kind = "compliant" if layers[0][0] < view.substrate_modulus else "stiff"
    thickness = layers[0][1] / view.stored("hertz_radius") if layers else 0.0
    creepage = tuple(0.0 if value != value else value for value in view.creepage)
    return PaperCase(
        view,
        figure_number(view.grid),
        panel_letter(view),
        kind,
        len(layers),
        round(thickness, 9),
        creepage,  # type: ignore[arg-type]
    )


def select(cases: Iterable[PaperCase], figures: Iterable[int], *, panels: str = "", kind: str = "") -> list[PaperCase]:
    """Cases of these figures, of these panels (all if empty) and of this kind of layer (any if empty)."""
    wanted = frozenset(figures)
    return [
        c for c in cases if c.figure in wanted and (not panels or c.panel in panels) and (not kind or c.kind == kind)
    ]


def along_thickness(cases: Iterable[PaperCase]) -> Iterator[tuple[PaperCase, PaperCase]]:
    """Pairs of cases that differ in thickness alone, (thinner, thicker), neighbours in thickness.

    Thickness varies within Figures 3, 5 and 6, and from Figure 7 to 8 and from 9 to 10.
    """
    family = {8: 7, 10: 9}
    return _neighbours(
        cases,
        lambda c: (family.get(c.figure, c.figure), c.layer_count, c.kind, c.creepage),
        lambda c: c.thickness,
    )


def along_creepage(cases: Iterable[PaperCase]) -> Iterator[tuple[PaperCase, PaperCase]]:
    """Pairs of cases that differ in longitudinal creepage alone, (smaller, larger), neighbours."""
    return _neighbours(cases, lambda c: (c.figure, c.kind, c.thickness, c.creepage[1:]), lambda c: c.creepage[0])


def compliant_and_stiff(cases: Iterable[PaperCase]) -> Iterator[tuple[PaperCase, PaperCase]]:
    """Pairs (compliant, stiff) of cases that differ in the layers' moduli alone."""
    groups: dict[object, dict[str, PaperCase]] = {}
    for c in cases:
        groups.setdefault((c.figure, c.layer_count, c.thickness, c.creepage), {})[c.kind] = c
    return ((g["compliant"], g["stiff"]) for g in groups.values() if {"compliant", "stiff"} <= g.keys())


def _neighbours(
    cases: Iterable[PaperCase], group: Callable[[PaperCase], object], order: Callable[[PaperCase], Any]
) -> Iterator[tuple[PaperCase, PaperCase]]:
    groups: dict[object, list[PaperCase]] = {}
    for c in cases:
        groups.setdefault(group(c), []).append(c)
    for members in groups.values():
        ranked = sorted(members, key=order)
        yield from ((a, b) for a, b in pairwise(ranked) if order(a) < order(b))
