"""The layers of a case in words: their moduli, Poisson's ratios and thickness."""

from __future__ import annotations

import re
from itertools import groupby

import numpy as np

from rcstudy.report.labels import power_of_ten
from rcstudy.report.views import CaseView, given_text, set_as
from rcstudy.settings import LENGTH, MODULUS
from rcstudy.studyfile.quantities import number_text

_SCALES = (f" {LENGTH}", f" {MODULUS}")

ROUND = 1e-12
"""Relative difference from a number of six digits below which one is taken to have been written with those."""


NAMED = 2
"""Layers whose moduli the paper's figures name in titles and legends, at most; of more, that at the surface alone."""

_GIVEN = 9  # digits of a number that a study gives, at most

_SPELT, _SHOWN = 6, 3  # numbers of a kind that a caption spells out, at most, and those shown of more, with the last
_KINDS = re.compile(r"(\$E_)|(\$\\nu_)|((?:mm|a\$)(?: thick)?$)")  # of numbers: moduli, Poisson's ratios, thickness


def abridged(text: str) -> str:
    """A caption's `text` on layers, with no more than the first and the last of many numbers of a kind."""
    return "; ".join(_abridged_list(part) for part in text.split("; "))


def _abridged_list(text: str) -> str:
    def kind(part: str) -> int:
        found = _KINDS.search(part)
        return found.lastindex or 0 if found else 0

    parts: list[str] = []
    for number, run in groupby(text.split(", "), kind):
        those = list(run)
        parts += _ends_of(those) if number else those
    return ", ".join(" = ".join(_ends_of(part.split(" = "))) for part in parts)


def _ends_of(numbers: list[str]) -> list[str]:
    return numbers if len(numbers) <= _SPELT else [*numbers[:_SHOWN], "...", numbers[-1]]


def layers_text(case: CaseView, *, math: bool = False, every: bool = False) -> str:
    """Moduli of a case's layers, and Poisson's ratios that are not the substrate's: `E1 = 0.5 Es, nu = 0.49`.

    `no layer` without one. `math` gives matplotlib/LaTeX mathematics, here and below; `every` Poisson's ratios that are
    the substrate's, too.
    """
    return ", ".join(filter(None, (moduli_text(case, math=math), ratios_text(case, math=math, every=every))))


def moduli_text(case: CaseView, *, math: bool) -> str:
    """The moduli of a case's layers: as the paper writes them, `E1 = 0.5 E2 = 0.25 Es`, or `no layer`.

    Each in MPa, `E1 = 3000 MPa, E2 = 105000 MPa`, where the study wrote them so or the cube does not give Es.
    """
    if not case.layers:
        return "no layer"
    moduli = [E for E, _ in case.layers]
    space = r"\," if math else " "
    names = [_numbered("E", k, math) for k in range(len(moduli))]
    base = case.substrate_modulus
    if not np.isfinite(base) or not _relative_modulus(case):
        unit = r"\mathrm{MPa}" if math else "MPa"
        # those that follow from another layer's are no round numbers: six digits are enough
        given = [E if _digits(number_text(E)) <= _GIVEN else float(f"{E:.6g}") for E in moduli]
        texts = [f"{name} = {given_text(E, math=math)}{space}{unit}" for name, E in zip(names, given, strict=True)]
    else:
        ratios = [_ratio(moduli[0] / E, math) + space for E in (*moduli[1:], base)]
        steps = [ratio + symbol for ratio, symbol in zip(ratios, (*names[1:], "E_s" if math else "Es"), strict=True)]
        texts = [" = ".join((names[0], *steps))]
    return ", ".join(set_as(text, math=math) for text in texts)


def ratios_text(case: CaseView, *, math: bool, every: bool) -> str:
    """Poisson's ratios of a case's layers, `nu = 0.49` or `nu1 = 0.3, nu2 = 0.49`; empty without layers.

    Empty, too, unless `every` is set, if all are the substrate's, or if that is not known because the study's text is
    not understood.
    """
    ratios, substrate = case.layer_nu, case.grid.substrate_nu
    if not case.layers or not (every or (substrate is not None and not set(ratios) <= {substrate})):
        return ""
    symbol = r"\nu" if math else "nu"
    names = [symbol] if len(set(ratios)) == 1 else [_numbered(symbol, k, math) for k in range(len(ratios))]
    texts = [f"{name} = {given_text(nu, math=math)}" for name, nu in zip(names, ratios, strict=False)]
    return ", ".join(set_as(text, math=math) for text in texts)


def thickness_text(case: CaseView, *, math: bool = False) -> str:
    """Thickness of each layer: `0.5 a` or `0.05 mm`, or of all in order where they differ, `0.25 a, 0.05 mm, 0.25 a`.

    Empty without layers. A round multiple of Hertz's radius a is taken to have been written as one, since a itself is
    no round number; others are in mm, and so are those that are rounder in mm: 0.01 mm may by chance be a multiple of a
    to six digits.
    """
    a = case.stored("hertz_radius")
    texts = []
    for _, h in case.layers:
        ratio, length = f"{h / a:.6g}", f"{h:.6g}"
        rounder = _is_round(length, h) and _digits(length) < _digits(ratio)
        if _is_round(ratio, h, a) and not rounder:
            texts.append(rf"${power_of_ten(ratio)}\,a$" if math else f"{ratio} a")
        else:
            texts.append(f"{length} mm")
    return ", ".join(texts if len(set(texts)) > 1 else texts[:1])


def coating_text(case: CaseView, *, math: bool = False) -> str:
    """The layers' moduli, ratios and thickness: `E1 = 0.5 Es, 0.25 a`; `no layer` without any."""
    return ", ".join(filter(None, (layers_text(case, math=math), thickness_text(case, math=math))))


def _ratio(value: float, math: bool) -> str:
    """A computed ratio in six digits."""
    return power_of_ten(f"{value:.6g}") if math else f"{value:.6g}"


def _is_round(text: str, value: float, unit: float = 1.0) -> bool:
    return abs(float(text) * unit - value) <= ROUND * value


def _digits(text: str) -> int:
    """Number of digits of a number in words, without zeros that only give its size."""
    return len(text.partition("e")[0].replace(".", "").strip("0"))


def _numbered(symbol: str, layer: int, math: bool) -> str:
    number = f"{layer + 1}"
    if not math:
        return f"{symbol}{number}"
    return f"{symbol}_{number}" if len(number) == 1 else f"{symbol}_{{{number}}}"


def _relative_modulus(case: CaseView) -> bool:
    """Whether the study wrote the modulus of the case's coating as a multiple of Es, not in MPa."""
    axes = case.grid.axes
    return "modulus" not in axes or case.grid.written("modulus", case.index[axes.index("modulus")]).endswith(_SCALES)
