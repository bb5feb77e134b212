r"""Frequency response of the surface of a layered elastic half-space.

For a wave vector of length alpha along x, four functions of alpha give the surface displacements by the surface
stresses (the paper's Eqs 11 to 17, rearranged; convention of ``tests/reference/frf.json``): for a pressure p cos(alpha
x), u_z = a p cos(alpha x) and u_x = -b p sin(alpha x); for a traction q sin(alpha x) along x, u_x = c q sin(alpha x)
(and u_z = -b q cos(alpha x) by reciprocity); for a traction q across the wave vector, u = d q. Any number of layers,
listed from the surface down, lie on a half-space.

In each layer the in-plane field is a sum of four modes (k stands for alpha): the Papkovich-Neuber potentials phi =
e^(-kz) cos(kx)/k and psi = e^(-kz) cos kx, which decay with depth, and their growing counterparts with e^(+k(z - h))
(the paper's Eqs 11 to 15 with one potential less, as only two are needed):

    2G u = grad(phi) + grad(z psi) - 4 (1 - nu) psi e_z.

With (U, W) the amplitudes of 2G u_x (of sin kx) and 2G u_z (of cos kx), and (X, Z) those of sigma_xz and sigma_zz
over k, the modes (U, W, X, Z) at their own origin are

    decaying: A0 = (-1, -1,  1, 1),  B0 = (0, -(3 - 4nu), 1 - 2nu,  2(1 - nu)),
    growing:  A1 = (-1,  1, -1, 1),  B1 = (0, -(3 - 4nu), 1 - 2nu, -2(1 - nu)),

and moving the origin by the thickness h turns B0 into B0 + kh A0 and B1 (growing, upwards) into B1 - kh A1, times
e^(-kh). At the bottom of a layer (the paper's Eq. 17) the compliance of everything below, u = Y/k t, fixes the growing
modes by the decaying ones, g = R d with a 2x2 matrix R that depends on k only through Y; at its top R appears as
e^(-2kh) [1, -kh; 0, 1] R [1, kh; 0, 1]. So only decaying exponentials occur, nothing is divided by 1 - 2nu, and the
*difference* between the layered and the homogeneous response is obtained without cancellation.
"""

from __future__ import annotations

import numpy as np

from rcstudy.mechanics.kernels.coefficients import layered_response
from rcstudy.mechanics.scene import Layer, Material


class BeyondRounding(ArithmeticError):
    """Raised for layers so unlike what is below them that rounding leaves nothing of their response."""

    def __init__(self) -> None:
        super().__init__("moduli so far apart that rounding leaves nothing of what the layers yield")


def response_difference(substrate: Material, layers: tuple[Layer, ...], alpha: np.ndarray) -> np.ndarray:
    """alpha times (a, b, c, d) of the layered body minus that of a half-space of its top material.

    `alpha` [n] (1/mm), positive. Returns [4, n] (1/MPa); decays like exp(-2 alpha h1), h1 being the thickness of the
    top layer; zero without layers. Raises BeyondRounding where it is no finite number.
    """
    out = np.zeros((4, alpha.size))
    if layers:
        with np.errstate(all="ignore"):  # what is no number is found below; without the JIT NumPy would warn of it
            layered_response(
                np.ascontiguousarray(alpha, dtype=float),
                np.array([layer.E for layer in layers], dtype=float),
                np.array([layer.nu for layer in layers], dtype=float),
                np.array([layer.thickness for layer in layers], dtype=float),
                np.array([half_space_response(layer) for layer in layers]),
                half_space_response(substrate),
                out,
            )
        if not np.isfinite(out).all():
            raise BeyondRounding
    return out


def half_space_response(material: Material) -> np.ndarray:
    """alpha times (a, b, c, d) of a homogeneous half-space (1/MPa): four constants [4].

    a = c = (1 - nu)/G, b = (1 - 2nu)/(2G), d = 1/G (Johnson 1985, sections 3.2 and 3.6, transformed).
    """
    nu, g = material.nu, material.G
    return np.array([(1.0 - nu) / g, (1.0 - 2.0 * nu) / (2.0 * g), (1.0 - nu) / g, 1.0 / g])


def frequency_response(substrate: Material, layers: tuple[Layer, ...], alpha: np.ndarray) -> np.ndarray:
    """Frequency responses a, b, c, d (mm/MPa) of the layered half-space at `alpha` [n] (1/mm): array [4, n].

    Raises BeyondRounding where what layers add to half-spaces (:func:`response_difference`) is no finite number.
    """
    alpha = np.asarray(alpha, dtype=float)
    top = layers[0] if layers else substrate
    scaled = half_space_response(top)[:, None] + response_difference(substrate, layers, alpha)
    result: np.ndarray = scaled / alpha
    return result
