"""Scenes in absolute units from validated settings: resolves relative quantities, builds coatings, checks windows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from rcstudy.mechanics.exact import Hertz, contact_bounds, contact_modulus, hertz_contact
from rcstudy.mechanics.scene import (
    Creepage,
    Layer,
    Material,
    Mesh,
    Scene,
    Tolerance,
)
from rcstudy.studyfile.quantities import Quantity, number_text
from rcstudy.studyfile.spec import CoatingSpec, LayerSpec, SceneSpec

COATING_KEYS = ("layer_count", "thickness", "modulus", "layer_nu")

BOTH_COATINGS = "layers and coating are both given: only one of them may be"
"""Reason why a scene with both is refused."""

# Validated settings of one scene: the keys of SceneSpec, mappings as dicts, and "coating" (None for no coating).
Parts = dict[str, Any]


_WIDER = 1.05  # largest expected width of the contact on a finer mesh over that on the coarse one
_ROOM = 1.19  # width within the outermost cells, over that of the contact on the coarse mesh, that holds any contact
_STEP = 1.03  # width of a window over that of one that was found too small
_STEPS = 24  # largest number of those: to twice the width
_THINNEST = 1e-9  # layers thinner than this part of the Hertz radius change less than rounding does (the approach)
_THICKEST = 1e100  # mm: squares of all lengths are to be in the range of floating point numbers
_ANY_MESH = Mesh((1.0, 1.0), (1, 1))  # placeholder for a mesh that is not known yet
# settings that do not affect fitted windows (but for friction and coupling of bodies that feel both), by default
_WITHOUT_EFFECT: dict[str, Any] = {
    name: getattr(Scene, name)
    for name in ("friction", "creepage", "coupling", "method", "discretisation", "spin_point", "tolerance")
}


class BuildError(ValueError):
    """Raised for settings that are each allowed but together give no scene; `conflicts`: reasons by key of `Scene`."""

    def __init__(self, reason: str, conflicts: Mapping[str, str] | None = None) -> None:
        super().__init__(reason)
        self.conflicts = conflicts or {}


def parts_of(scene: SceneSpec, coating: CoatingSpec | None) -> Parts:
    """The settings in `scene` and `coating`."""
    parts: Parts = {name: getattr(scene, name) for name in SceneSpec.model_fields}
    for name in ("substrate", "counterbody", "creepage", "mesh", "tolerance"):
        parts[name] = None if parts[name] is None else dict(parts[name])
    parts["coating"] = None if coating is None else dict(coating)
    return parts


def keys_to(path: str) -> tuple[str, ...]:
    """Keys in Parts under which the value of the axis `path` is stored."""
    return ("coating", path) if path in COATING_KEYS else tuple(path.split("."))


def part(parts: Parts, path: str) -> Any:
    """The value in `parts` of the setting that the axis `path` varies."""
    value: Any = parts
    for key in keys_to(path):
        value = value[key]
    return value


def with_part(parts: Parts, path: str, value: Any) -> Parts:
    """A copy of `parts` with the setting of the axis `path` replaced."""
    head, *rest = keys_to(path)
    changed = dict(parts)
    changed[head] = {**(parts[head] or {}), rest[0]: value} if rest else value
    return changed


@lru_cache(maxsize=16384)  # checks of a study, estimates and report of a plan ask for each of its contacts in turn
def uncoated_hertz(radius: tuple[float, float], load: float, body: Material, counterbody: Material | None) -> Hertz:
    """Hertz contact of the uncoated pair. Raises BuildError if it exceeds the range of floating point numbers."""
    try:
        with np.errstate(divide="raise", over="raise", invalid="raise"):
            contact = hertz_contact(radius, load, contact_modulus(body, counterbody))
    except (ArithmeticError, ValueError) as error:
        raise BuildError("radius, load and moduli too extreme for a Hertz contact") from error
    if not all(math.isfinite(v) and v > 0.0 for v in (*contact.a, contact.p0, contact.approach, contact.radius)):
        raise BuildError("radius, load and moduli too extreme for a Hertz contact")
    return contact


def scene_hertz(scene: Scene) -> Hertz:
    """Hertz contact of the uncoated pair of `scene`, cached for scenes that share it."""
    return uncoated_hertz(scene.radius, scene.load, scene.substrate, scene.counterbody)


@lru_cache(maxsize=4096)
def _coating(count: int, thickness: float, modulus: float, nu: float, es: float) -> tuple[Layer, ...]:
    """`count` layers from the surface down; the k-th above the substrate has E = (modulus/Es)^k Es.

    For k = 1 that is `modulus` itself, to the last bit: a single layer is then the same case if given as `layers`.
    """
    ratio = modulus / es
    try:
        layers = tuple(Layer(modulus if k == 1 else ratio**k * es, nu, thickness) for k in range(count, 0, -1))
    except OverflowError as error:
        raise BuildError("modulus too extreme for so many layers") from error
    return tuple(map(_checked, layers))


def _checked(layer: Layer) -> Layer:
    if not (0.0 < layer.E < math.inf and 0.0 < layer.thickness < math.inf):
        raise BuildError("a layer's modulus or thickness is beyond the range of floating point numbers")
    return layer


def _layer(spec: LayerSpec, es: float, a: float) -> Layer:
    return _checked(Layer(spec.E.resolve(es), spec.nu, spec.thickness.resolve(a)))


@lru_cache(maxsize=4096)
def _extents(scene: Scene) -> tuple[tuple[float, float], tuple[float, float]]:
    """Widths (mm) along x and y of the contact of `scene` without friction, and of one window for full sliding."""
    # imported here because they import the compiled kernels, which only studies with fitted windows need
    from rcstudy.mechanics.window import contact_extent, sliding_extent

    extent = contact_extent(scene)
    return extent, sliding_extent(scene, extent) if scene.coupling == "full" else extent


@lru_cache(maxsize=4096)
def _widened(scene: Scene) -> tuple[float, float]:
    """Sides (mm) of the window of `scene`, widened until the contact without friction leaves a cell free on each side.

    That is needed under thin soft layers, whose contacts reach farther than they do on the coarse mesh.
    """
    from rcstudy.mechanics.window import reached_sides  # as in `_extents`

    x, y = scene.mesh.size
    for _ in range(_STEPS):
        along_x, along_y = reached_sides(replace(scene, mesh=Mesh((x, y), scene.mesh.cells)))
        if not (along_x or along_y):
            break
        x, y = x * (_STEP if along_x else 1.0), y * (_STEP if along_y else 1.0)
    return x, y


def fitted_size(scene: Scene, margin: float, cells: tuple[int, int]) -> tuple[float, float]:
    """Sides (mm) of a window of `cells` that is `margin` times as wide as the contact (`mesh.size: auto`).

    The contact is that without friction. With full coupling the window also holds the contact in full sliding. It is
    wider where that is needed for a free cell on either side.
    """
    # what does not affect the window is left out, so that all cases with one pressure have the same window
    bare = replace(scene.joined, mesh=_ANY_MESH, **_WITHOUT_EFFECT)
    moved = replace(bare, friction=scene.friction, coupling="full") if scene.is_coupled else bare
    free, in_sliding = _extents(moved)
    # on few cells one cell has to be free on either side, whatever the margin
    least = [_WIDER * n / (n - 2) for n in cells]
    x, y = (
        max(max(margin, wider) * width, wider * sliding)
        for wider, width, sliding in zip(least, free, in_sliding, strict=True)
    )
    # the solver refuses a contact in the outermost cells; most margins leave room enough
    inside = (size * (n - 2) / n for size, n in zip((x, y), cells, strict=True))
    if bare.layers and any(width < _ROOM * own for width, own in zip(inside, free, strict=True)):
        return _widened(replace(bare, mesh=Mesh((x, y), cells)))
    return x, y


def build(parts: Parts) -> Scene:
    """The scene of `parts`. Raises BuildError if the settings together give none."""
    scene = build_without_mesh(parts)
    cells = parts["mesh"]["cells"]
    size: tuple[Quantity, Quantity] | None = parts["mesh"]["size"]
    if size is not None:
        a = scene_hertz(scene).radius
        return replace(scene, mesh=Mesh((size[0].resolve(a), size[1].resolve(a)), cells))
    try:
        with np.errstate(all="ignore"):
            fitted = fitted_size(scene, parts["mesh"]["margin"], cells)
        if not 0.0 < math.prod(fitted) < math.inf:
            raise ArithmeticError
    except (ArithmeticError, LookupError, ValueError):
        raise BuildError("materials, radius or load too extreme for a window to be fitted to the contact") from None
    return replace(scene, mesh=Mesh(fitted, cells))


def build_without_mesh(parts: Parts) -> Scene:
    """The scene of `parts` with a placeholder for its mesh. Raises BuildError if the settings together give none."""
    substrate = Material(parts["substrate"]["E"], parts["substrate"]["nu"])
    es = substrate.E
    counterbody = None
    if (other := parts["counterbody"]) is not None:
        counterbody = Material(other["E"].resolve(es), other["nu"])
    radius: tuple[float, float] = parts["radius"]
    a = uncoated_hertz(radius, parts["load"], substrate, counterbody).radius
    if (coating := parts["coating"]) is not None:
        if parts["layers"]:
            raise BuildError(BOTH_COATINGS)
        nu = substrate.nu if coating["layer_nu"] is None else coating["layer_nu"]
        thickness, modulus = coating["thickness"].resolve(a), coating["modulus"].resolve(es)
        layers = _coating(coating["layer_count"], thickness, modulus, nu, es)
    else:
        layers = tuple(_layer(spec, es, a) for spec in parts["layers"])
    if reason := _thickness_problem(layers, a):
        raise BuildError(reason, {"layers": reason} if parts["layers"] else None)
    creepage = parts["creepage"]
    scene = Scene(
        substrate=substrate,
        radius=radius,
        load=parts["load"],
        mesh=_ANY_MESH,
        layers=layers,
        counterbody=counterbody,
        friction=parts["friction"],
        creepage=None if creepage is None else Creepage(**creepage),
        coupling=parts["coupling"],
        method=parts["method"],
        discretisation=parts["discretisation"],
        spin_point=parts["spin_point"],
        tolerance=Tolerance(**parts["tolerance"]),
    )
    if scene.conflicts:
        raise BuildError("; ".join(scene.conflicts.values()), scene.conflicts)
    return scene


def _thickness_problem(layers: tuple[Layer, ...], a: float) -> str:
    """What is wrong with the thickness of a layer under a contact of Hertz radius `a` (mm); "" if nothing."""
    for h in (layer.thickness for layer in layers):
        if h < _THINNEST * a:
            least = f"{_THINNEST:g} of the Hertz radius, {_THINNEST * a:.2g} mm"
            return f"a layer of {h:.6g} mm: must not be thinner than {least}"
        if h > _THICKEST:
            return f"a layer of {h:.6g} mm: must not be thicker than {_THICKEST:g} mm"
    return ""


def _what_sizes(scene: Scene) -> str:
    """What the size of the contact of `scene` follows from, in words: a slip in a unit shows there."""
    radius = " x ".join(map(number_text, dict.fromkeys(scene.radius)))
    moduli = f"{number_text(scene.substrate.E)} MPa"
    if scene.counterbody is not None:
        moduli += f" (counterbody {number_text(scene.counterbody.E)} MPa)"
    given = f"load {number_text(scene.load)} N, radius {radius} mm"
    return f"{given}, E {moduli} and its layers" if scene.layers else f"{given} and E {moduli}"


def window_problem(parts: Parts, scene: Scene) -> tuple[str, str]:
    """Reason why the mesh cannot suit the contact, from bounds of the contact's size; ("", "") if it may.

    Returns the key of the mesh at fault ("size" or "cells") and what is allowed for it.

    This check precedes any solution; the solver refuses contacts that actually reach the edge of the window. Fitted
    windows always pass.
    """
    if parts["mesh"]["size"] is None:
        return "", ""
    try:
        least, most = contact_bounds(scene) if scene.joined.layers else (scene_hertz(scene).a,) * 2
    except ArithmeticError:  # a layer so stiff or so compliant that the contact has no size in double precision
        return "size", "layers must be less extreme: the contact has no size in double precision"
    for axis, low, high, size, step in zip("xy", least, most, scene.mesh.size, scene.mesh.spacing, strict=True):
        if not 2.0 * low < size < math.inf:
            width = f"is about {2.0 * low:.4g} mm along {axis}"
            return "size", f"must be larger than the contact, which for {_what_sizes(scene)} {width}"
        if 2.0 * high < step:
            return (
                "cells",
                f"must be more: each smaller than the contact, which is about {2.0 * high:.4g} mm along {axis}",
            )
    return "", ""
