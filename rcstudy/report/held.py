"""What the cases of a grid have in common, in words for a caption: creepages, layers, bodies, radii, coupling.

Numbers of the cases come from the cube. Settings that the cube does not store for every case (radii, bodies, coupling)
are read from the text of its study; if that is not understood, they are left out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from rcstudy.progress import counted
from rcstudy.report.labels import KEEP, literal, power_of_ten, shortened
from rcstudy.report.layers import NAMED, abridged, layers_text, moduli_text, ratios_text, thickness_text
from rcstudy.report.views import CaseView, GridView, creepage_text, creepages_text, given_text
from rcstudy.settings import LENGTH
from rcstudy.studyfile.axis_labels import labelled_scenes
from rcstudy.studyfile.quantities import Quantity, number_text
from rcstudy.studyfile.spec import SceneSpec

_LABELLED = ("creepage", "layers", "case")
"""Axes whose values are names of settings that the cube stores, which a caption spells out."""

_OF_LAYERS = ("layers", "layer_count")
"""Axes some of whose values may give no layer at all."""

_Text = Callable[[SceneSpec, frozenset[str]], str]

_SPELT = 12  # values of such an axis, at most
_LETTERS = 40  # of a label


def held(grid: GridView) -> str:
    """Sentences on what all cases of `grid` share besides `layout.conditions`, and on what its labels stand for."""
    return _sentences([_creepages(grid), abridged(_layers(grid)), _graded(grid), *_numbers(grid), *_written(grid)])


def settings(grid: GridView) -> str:
    """The sentences of `held`, but for creepages and the layers' moduli and thickness, of a figure that names these.

    Of more than `layers.NAMED` layers it names the modulus of one alone: how the others follow from it is told.
    """
    ratios = _of_all_with_layers(grid, _ratios)
    graded = _graded(grid) if max(len(case.layers) for case in grid.cases()) > NAMED else ""
    return _sentences([abridged(f"layers: {ratios}") if ratios else "", graded, *_written(grid)])


def _sentences(texts: Iterable[str]) -> str:
    return " ".join(f"{text[0].upper()}{text[1:]}{'' if text.endswith('...') else '.'}" for text in texts if text)


def _lines(grid: GridView, axis: str) -> Iterator[list[CaseView]]:
    """The cases along `axis`, all others at their first value; an axis of layers at each of its values in turn.

    Of layers the first case of a grid may have none: nothing that other axes change of them would show there.
    """
    at, count = grid.axes.index(axis), len(grid.axes)
    layers = [k for k, name in enumerate(grid.axes) if name in _OF_LAYERS and k != at]  # at most one
    for place in range(grid.shape[layers[0]]) if layers else (0,):
        yield [
            grid.case(*(i if k == at else place if k in layers else 0 for k in range(count)))
            for i in range(grid.shape[at])
        ]


def _differs_along(grid: GridView, text: Callable[[CaseView], str]) -> list[str]:
    """The axes along which `text` differs, all others as in `_lines`.

    No setting depends on two axes but layers, which are described by several (number, modulus, thickness).
    """
    return [axis for axis in grid.axes if any(len(set(map(text, line))) > 1 for line in _lines(grid, axis))]


def _shared_text(grid: GridView, text: Callable[[CaseView], str]) -> str:
    """The `text` that all cases share, or, if it depends on one axis of labels, that of each label; else empty."""
    axes = _differs_along(grid, text)
    if not axes:
        return text(grid.first)
    if len(axes) > 1 or axes[0] not in _LABELLED:
        return ""
    return _spelt(grid, axes[0], [text(case) for case in grid.along(axes[0])[:_SPELT]])


def _spelt(grid: GridView, axis: str, texts: Sequence[str]) -> str:
    """What the first values of the labelled `axis` stand for, `texts`, each with its label: `a: ...; b: ...`.

    Words that stand for themselves (`rigid`) are left out.
    """
    labels = shortened(grid.axis_values(axis)[: len(texts)], _LETTERS)
    told = [f"{literal(label)}: {text}" for label, text in zip(labels, texts, strict=True) if label != text]
    return "; ".join(told) + ("; ..." if told and grid.dataset.sizes[axis] > len(texts) else "")


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
    for words, thick in product((_moduli_and_ratios, _moduli), (True, False)):

        def layers(case: CaseView, words: Callable[[CaseView], str] = words, thick: bool = thick) -> str:
            text = words(case)
            return _with_thickness(case, text) if thick else text

        if text := _shared_text(grid, layers):
            return text if text == "no layer" else f"layers{_from_surface(text)}: {text}"
        if text := _of_all_with_layers(grid, layers):  # others have none
            return f"layers{_from_surface(text)}, where there are any: {text}"
    texts = []
    if not _differs_along(grid, _count):
        texts = [_count(grid.first)]
    if thickness := _of_all_with_layers(grid, _thickness):
        each = f"thickness of each layer: {thickness}"
        texts = [_with_thickness(grid.first, texts[0])] if texts else [each]
    if ratios := _of_all_with_layers(grid, _ratios):
        texts += [ratios if texts else f"layers' {ratios}"]
    return ", ".join(texts)


def _from_surface(text: str) -> str:
    """That layers are numbered from the surface down, if `text` has numbers of several."""
    return " (1 at the surface)" if "E_2" in text else ""


def _graded(grid: GridView) -> str:
    """How moduli go on from layer to layer of a coating, if it has several layers, whose moduli or number vary."""
    varied = {"modulus", "layer_count"} & set(_differs_along(grid, _moduli))
    several = [case.layers for axis in varied for line in _lines(grid, axis) for case in line if len(case.layers) > 1]
    if not several:
        return ""
    factor, what = power_of_ten(f"{several[0][-2][0] / several[0][-1][0]:.6g}"), ""
    factor = f"({factor})" if "times" in factor else factor
    if "modulus" in varied:
        factor, what = "m", r"modulus $m\,E_s$ is that of the layer next to the substrate: "
    return rf"{what}the $k$-th layer above the substrate has ${factor}^k\,E_s$"


def _of_all_with_layers(grid: GridView, text: Callable[[CaseView], str]) -> str:
    """The `text` of all cases that have layers, as far as one axis at a time shows; empty if it differs."""
    texts = {text(case) for axis in grid.axes for line in _lines(grid, axis) for case in line if case.layers}
    return texts.pop() if len(texts) == 1 else ""


def _numbers(grid: GridView) -> list[str]:
    """Load and friction where they depend on a label."""
    told = []
    for name, symbol, unit in (("load", "$P$", f"{KEEP}N"), ("friction", r"$\mu$", "")):

        def text(case: CaseView, name: str = name, unit: str = unit) -> str:
            return number_text(case.stored(name)) + unit

        if _differs_along(grid, text) and (words := _shared_text(grid, text)):
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
    return ratios_text(case, math=True, every=True)


def _moduli(case: CaseView) -> str:
    return moduli_text(case, math=True)


def _moduli_and_ratios(case: CaseView) -> str:
    return layers_text(case, math=True, every=True)


def _written(grid: GridView) -> list[str]:
    """Sentences on radii, bodies, coupling, method, discretisation, mesh and tolerances as the study wrote them.

    The first one has what all cases share, but for the mesh, and for what is as it is by default; the others what
    labels stand for.
    """
    scene, varied = grid.starting
    if scene is None:
        return []
    shared, told = [], []
    for key, text in _WRITTEN.items():
        if key in _OF_TRACTIONS and "force_x" not in grid:
            continue
        texts = _texts_of_labels(grid, key, text) if key in varied else [text(scene, varied)]
        if len(set(texts)) == 1 and key != "mesh":
            default = scene.model_copy(update={key: SceneSpec.model_fields[key].default})
            if texts[0] and not (key in _USUAL and texts[0] == text(default, varied)):
                shared.append(_in_words(key, texts[0]))
        elif key in varied and texts and (words := _spelt(grid, _labels_of(grid, key), texts)):
            told.append(f"{key.replace('_', ' ')}: {words}")
    return [
        sentence.replace(" = ", f"{KEEP}={KEEP}").replace(" mm", f"{KEEP}mm").replace(" MPa", f"{KEEP}MPa")
        for sentence in (", ".join(shared), *told)
    ]


def _labels_of(grid: GridView, key: str) -> str:
    """The axis of labels along which the setting `key` of the scene varies; empty if it has none."""
    if "case" in grid.axes:
        return "case"
    return key if key in grid.axes and key in _MAPPINGS else ""


def _texts_of_labels(grid: GridView, key: str, text: _Text) -> list[str]:
    """The `text` of the setting `key` for each of its first labels; empty if these are not found in the study."""
    axis = _labels_of(grid, key)
    labels = grid.axis_values(axis)[:_SPELT] if axis else []
    scenes = labelled_scenes(grid.study_text, grid.name, axis, labels)
    return [text(scenes[label], frozenset()) for label in labels] if set(labels) <= scenes.keys() else []


def _in_words(key: str, text: str) -> str:
    """What all cases share: `rigid counterbody`, or `counterbody` with its numbers."""
    return text if key == "radius" else f"{key.replace('_', ' ')} {text}" if text.startswith("$") else f"{text} {key}"


def _radius(scene: SceneSpec, varied: frozenset[str]) -> str:
    x, y = map(number_text, scene.radius)
    return f"$R$ = {x} mm" if x == y else f"$R_x$ = {x} mm, $R_y$ = {y} mm"


def _substrate(scene: SceneSpec, varied: frozenset[str]) -> str:
    return _material("substrate", f"$E_s$ = {number_text(scene.substrate.E)} MPa", scene.substrate.nu, varied)


def _counterbody(scene: SceneSpec, varied: frozenset[str]) -> str:
    other = scene.counterbody
    if other is None:  # its numbers may all be axes
        return "" if varied & {"counterbody.E", "counterbody.nu"} else "rigid"
    return _material("counterbody", f"$E$ = {_quantity(other.E, 'MPa')}", other.nu, varied)


def _material(body: str, modulus: str, nu: float, varied: frozenset[str]) -> str:
    """Modulus and Poisson's ratio of a body, but for what cases set themselves."""
    parts = {f"{body}.E": modulus, f"{body}.nu": f"$\\nu$ = {number_text(nu)}"}
    return ", ".join(text for path, text in parts.items() if path not in varied)


def _mesh(scene: SceneSpec, varied: frozenset[str]) -> str:
    size, (nx, ny) = scene.mesh.size, scene.mesh.cells
    cells = f"{nx} × {ny} cells"
    if size is None:
        return f"{cells} in a window {number_text(scene.mesh.margin)} times as wide as the contact"
    return f"{cells} in {' × '.join(_quantity(side, 'mm') for side in size)}"


def _spin_point(scene: SceneSpec, varied: frozenset[str]) -> str:
    if scene.discretisation == "aligned" and "discretisation" not in varied:
        return "of no effect"
    return f"${number_text(scene.spin_point)}$ cells ahead of the centre"


def _tolerance(scene: SceneSpec, varied: frozenset[str]) -> str:
    parts = {"normal": (scene.tolerance.normal, "pressure"), "tangential": (scene.tolerance.tangential, "tractions")}
    return ", ".join(
        f"${given_text(value, math=True)}$ ({what})"
        for key, (value, what) in parts.items()
        if f"tolerance.{key}" not in varied
    )


def _quantity(value: Quantity, units: str) -> str:
    """A length or modulus as it is written, with its `units` unless it is relative."""
    if not value.scale:
        return f"{value} {units}"
    return rf"${given_text(value.value, math=True)}\,{'a' if value.scale == LENGTH else 'E_s'}$"


_MAPPINGS = ("substrate", "counterbody", "mesh", "tolerance")
"""Settings of the scene whose values along an axis are labelled mappings that the cube does not store as one."""

_OF_TRACTIONS = ("coupling", "method", "spin_point")
"""Settings without effect where only the pressure is computed."""

_USUAL = ("method", "spin_point", "tolerance")
"""Settings that a caption tells of only where they differ, or are not as they are by default."""

_WRITTEN: Mapping[str, _Text] = {
    "radius": _radius,
    "substrate": _substrate,
    "counterbody": _counterbody,
    "coupling": lambda scene, _: scene.coupling,
    "method": lambda scene, _: scene.method,
    "discretisation": lambda scene, _: scene.discretisation,
    "spin_point": _spin_point,
    "mesh": _mesh,
    "tolerance": _tolerance,
}
"""Settings of the scene that the cube does not store for every case, and the words for each.

The words leave out what is at the paths that cases set themselves.
"""
