"""What the cases of a grid have in common, in words for a caption: creepages, layers, bodies, radii, coupling.

Numbers of the cases come from the cube. Settings that the cube does not store (radii, bodies, coupling) are read from
the text of its study; if that is not understood, they are left out.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np

from rcstudy.progress import counted
from rcstudy.quantities import number_text
from rcstudy.report.labels import KEEP, literal, shortened
from rcstudy.report.layers import layers_text, moduli_text, ratios_text, thickness_text
from rcstudy.report.views import CaseView, GridView, creepage_text, creepages_text

_LABELLED = ("creepage", "layers", "case")
"""Axes whose values are names of settings, which a caption spells out."""

_SPELT = 12  # values of such an axis, at most
_LETTERS = 40  # of a label


def held(grid: GridView) -> str:
    """Sentences on what all cases of `grid` share besides `layout.conditions`, and on what its labels stand for."""
    sentences = [_creepages(grid), _layers(grid), *_numbers(grid), ", ".join(_written(grid))]
    return " ".join(f"{text[0].upper()}{text[1:]}." for text in sentences if text)


def _differs_along(grid: GridView, text: Callable[[CaseView], str]) -> list[str]:
    """The axes along which `text` differs, all others at their first value: no setting depends on two axes."""
    return [axis for axis in grid.axes if len({text(case) for case in grid.along(axis)}) > 1]


def _shared_text(grid: GridView, text: Callable[[CaseView], str]) -> str:
    """The `text` that all cases share, or, if it depends on one axis of labels, that of each label; else empty."""
    axes = _differs_along(grid, text)
    if not axes:
        return text(grid.first)
    if len(axes) > 1 or axes[0] not in _LABELLED:
        return ""
    cases = grid.along(axes[0])[:_SPELT]
    labels = shortened(grid.axis_values(axes[0])[: len(cases)], _LETTERS)
    more = "; ..." if grid.dataset.sizes[axes[0]] > _SPELT else ""
    return "; ".join(f"{literal(label)}: {text(case)}" for label, case in zip(labels, cases, strict=True)) + more


def _creepages(grid: GridView) -> str:
    if "longitudinal" not in grid:
        return ""
    text = _shared_text(grid, lambda case: creepage_text(case, math=True, units=True))
    if not text:  # the components that all cases share
        shared = [
            np.nan if _differs_along(grid, lambda case, k=k: str(case.creepage[k])) else grid.first.creepage[k]  # type: ignore[misc]
            for k in range(3)
        ]
        text = creepages_text(shared, math=True, units=True)
    return text if not text or text == "no creepage" else f"creepage: {text}"


def _layers(grid: GridView) -> str:
    # also without Poisson's ratios, and without thickness, as these may be what is varied
    for words, thick in product((layers_text, moduli_text), (True, False)):

        def layers(case: CaseView, words: Callable[..., str] = words, thick: bool = thick) -> str:
            text = words(case, math=True)
            return _with_thickness(case, text) if thick else text

        if text := _shared_text(grid, layers):
            return text if text == "no layer" else f"layers: {text}"
    texts = []
    if not _differs_along(grid, _count):
        texts = [_count(grid.first)]
    if not _differs_along(grid, _thickness):
        each = f"thickness of each layer: {_thickness(grid.first)}"
        texts = [_with_thickness(grid.first, texts[0])] if texts else [each]
    if not _differs_along(grid, _ratios) and _ratios(grid.first):
        texts += [f"layers' {_ratios(grid.first)}"]
    return ", ".join(texts)


def _numbers(grid: GridView) -> list[str]:
    """Load and friction where they depend on a label."""
    told = []
    for name, symbol, unit in (("load", "$P$", f"{KEEP}N"), ("friction", r"$\mu$", "")):

        def text(case: CaseView, name: str = name, unit: str = unit) -> str:
            return number_text(case.stored(name)) + unit

        if name in grid and _differs_along(grid, text) and (words := _shared_text(grid, text)):
            told.append(f"{symbol} of {words}")
    return told


def _with_thickness(case: CaseView, words: str) -> str:
    """`words` on a case's layers, with how thick they are."""
    if not (thickness := _thickness(case)):
        return words
    each = "each " if len(case.layers) > 1 and ", " not in thickness else ""
    return f"{words}, {each}{thickness} thick"


def _count(case: CaseView) -> str:
    return counted(len(case.layers), "layer")


def _thickness(case: CaseView) -> str:
    return thickness_text(case, math=True)


def _ratios(case: CaseView) -> str:
    return ratios_text(case, math=True)


def _written(grid: GridView) -> list[str]:
    """Bodies, radii, coupling and discretisation as written in the study, as far as all cases share them."""
    scene, varied = grid.starting
    if scene is None:
        return []
    texts = []
    if "radius" not in varied:
        x, y = map(number_text, scene.radius)
        texts += [f"$R$ = {x} mm"] if x == y else [f"$R_x$ = {x} mm", f"$R_y$ = {y} mm"]
    if "substrate" not in varied:
        texts.append(
            f"substrate $E_s$ = {number_text(scene.substrate.E)} MPa, $\\nu$ = {number_text(scene.substrate.nu)}"
        )
    if "counterbody" not in varied:
        other = scene.counterbody
        words = "rigid counterbody"
        if other is not None:
            modulus = f"${number_text(other.E.value)}\\,E_s$" if other.E.scale else f"{other.E} MPa"
            words = f"counterbody $E$ = {modulus}, $\\nu$ = {number_text(other.nu)}"
        texts.append(words)
    if "force_x" in grid and "coupling" not in varied:
        texts.append(f"{scene.coupling} coupling")
    if "discretisation" not in varied:
        texts.append(f"{scene.discretisation} discretisation")
    return [
        text.replace(" = ", f"{KEEP}={KEEP}").replace(" mm", f"{KEEP}mm").replace(" MPa", f"{KEEP}MPa")
        for text in texts
    ]
