"""Closed forms: Hertz contacts, bounds for the size of layered contacts, Carter's rolling cylinder, a thin layer on a
rigid base.

They are used for relative lengths in a study ("0.25 a"), for checking its windows, for the first guess of the pressure
solver, and in tests.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rcstudy.mechanics.scene import Material, Scene


@dataclass(frozen=True)
class Hertz:
    """Semi-axes `a` = (ax, ay) (mm), largest pressure `p0` (MPa) and `approach` (mm) of a Hertzian contact."""

    a: tuple[float, float]
    p0: float
    approach: float

    @property
    def radius(self) -> float:
        """Radius of the circle of the same area (mm): the length "a" of a study."""
        return math.sqrt(self.a[0] * self.a[1])


def contact_modulus(body: Material, counterbody: Material | None) -> float:
    """E* (MPa) of two half-spaces, 1/E* = sum (1 - nu^2)/E; a rigid counterbody (None) adds nothing.

    Johnson 1985, section 4.2.
    """
    return 1.0 / (body.compliance + (0.0 if counterbody is None else counterbody.compliance))


def hertz_contact(radius: tuple[float, float], load: float, modulus: float) -> Hertz:
    """Contact of a paraboloid x^2/(2 Rx) + y^2/(2 Ry) pressed by `load` (N) on a half-space of E* = `modulus` (MPa).

    `radius`: Rx, Ry (mm).

    Johnson (1985), section 4.2, with complete elliptic integrals, no approximation.
    """
    rx, ry = radius
    if math.isclose(rx, ry, rel_tol=1e-12):
        a = (0.75 * load * rx / modulus) ** (1.0 / 3.0)
        return Hertz((a, a), 1.5 * load / (math.pi * a * a), a * a / rx)
    r_major, r_minor = max(rx, ry), min(rx, ry)  # the longer semi-axis lies along the larger radius
    ratio, k, r_d = _ellipse(r_major / r_minor)
    major = (load * r_major / (math.pi * modulus) * r_d) ** (1.0 / 3.0)
    minor = ratio * major
    p0 = 1.5 * load / (math.pi * major * minor)
    semi_axes = (major, minor) if rx > ry else (minor, major)
    return Hertz(semi_axes, p0, p0 * minor * k / modulus)


@lru_cache(maxsize=4096)
def _ellipse(curvature_ratio: float) -> tuple[float, float, float]:
    """Ratio b/a of the semi-axes, K(m) and R_D(0, 1 - m, 1) = 3 (K - E)/m, m = 1 - (b/a)^2, by R_major/R_minor > 1.

    Johnson 1985, section 4.2; they do not depend on load and moduli.
    """
    # imported here, as circular contacts, the common case, do not need them
    from scipy.optimize import brentq
    from scipy.special import ellipk, elliprd

    def mismatch(log_ratio: float) -> float:
        # (E/ratio^2 - K)/(K - E) without cancellation near a circle (Carlson 1995)
        square = math.exp(log_ratio) ** 2
        return math.log(elliprd(0.0, 1.0, square) / elliprd(0.0, square, 1.0)) - math.log(curvature_ratio)

    # b/a lies near (R_minor/R_major)^(2/3) (Johnson, Eq. 4.28 ff.)
    guess = -2.0 / 3.0 * math.log(curvature_ratio)
    ratio = math.exp(brentq(mismatch, 2.0 * guess - 1e-6, 0.25 * guess, xtol=1e-15, rtol=1e-14))
    return ratio, float(ellipk(1.0 - ratio * ratio)), float(elliprd(0.0, ratio * ratio, 1.0))


def _of_moduli(bodies: Sequence[Material], extreme: Callable[[Iterable[float]], float]) -> Material:
    """Material with the `extreme` (`max` or `min`) shear modulus and the extreme bulk modulus of `bodies`."""
    shear = extreme(m.G for m in bodies)
    bulk = extreme(m.E / (3.0 * (1.0 - 2.0 * m.nu)) if m.nu < 0.5 else math.inf for m in bodies)
    nu = (3.0 - 2.0 * shear / bulk) / (6.0 + 2.0 * shear / bulk)
    return Material(2.0 * shear * (1.0 + nu), nu)


def contact_bounds(scene: Scene) -> tuple[tuple[float, float], tuple[float, float]]:
    """Lower and upper bounds (mm) for the semi-axes of the frictionless contact: (ax, ay) each.

    These are Hertz contacts of half-spaces with the largest, and with the smallest, shear and bulk moduli of substrate
    and layers. A layered body lies between the two under any load, as a body softer in both moduli yields no less. So
    does the area of the contact, and each semi-axis if it is round. Elliptic contacts under plates become longer and
    narrower, down to 0.44 times the bound on 36 plates of all kinds; with layers their bounds are therefore widened by
    a factor of 5.
    """
    bodies = scene.substrate, *scene.layers
    least, most = (
        hertz_contact(scene.radius, scene.load, contact_modulus(_of_moduli(bodies, extreme), scene.counterbody)).a
        for extreme in (max, min)
    )
    if scene.layers and scene.radius[0] != scene.radius[1]:
        least = 0.2 * least[0], 0.2 * least[1]
        most = 5.0 * most[0], 5.0 * most[1]
    return least, most


def carter_traction(
    x: np.ndarray, half_width: float, pressure: float, friction: float, creepage: float, radius: float
) -> np.ndarray:
    """Carter's traction (MPa) of rolling cylinders of equal material at `x` (mm), rolling in +x.

    `half_width` a (mm) and `pressure` p0 (MPa) of the line contact, `creepage` (-) of either sign, `radius` R (mm) of
    relative curvature. Stick reaches from the leading edge x = a back to x = a - 2 c with
    c/a = 1 - R |creepage| / (mu a); for full slip c = 0. Johnson (1985), Eqs 8.4 to 8.8, signs as in this package
    (positive creepage gives negative traction on the coated body).
    """
    full = friction * pressure * np.sqrt(np.clip(1.0 - (x / half_width) ** 2, 0.0, None))
    c = half_width * max(0.0, 1.0 - radius * abs(creepage) / (friction * half_width))
    if c > 0.0:
        inner = (
            (c / half_width)
            * friction
            * pressure
            * np.sqrt(np.clip(1.0 - ((x - (half_width - c)) / c) ** 2, 0.0, None))
        )
        full = full - inner
    return -math.copysign(1.0, creepage) * full


def thin_layer_contact(radius: float, load: float, layer: Material, thickness: float) -> Hertz:
    """Contact of a sphere with a thin compressible layer on a rigid base: p = M/h (delta - r^2/(2R)).

    M is the oedometric modulus, h the `thickness` (mm). Johnson (1985), section 5.8 (elastic foundation). Returns
    radius (mm), largest pressure (MPa) and approach (mm).
    """
    m = layer.E * (1.0 - layer.nu) / ((1.0 + layer.nu) * (1.0 - 2.0 * layer.nu))
    # load = pi * (M/h) * a^4 / (4 R)
    a = (4.0 * radius * load * thickness / (math.pi * m)) ** 0.25
    approach = a * a / (2.0 * radius)
    return Hertz((a, a), m / thickness * approach, approach)
