r"""Frequency response of the surface of a layered elastic half-space.

Along a wave vector of length alpha the surface displacements follow from the surface stresses by
four functions of alpha (convention of ``tests/reference/frf.json``): for p cos(alpha x), u_z = a p cos(alpha x) and
u_x = -b p sin(alpha x); for q sin(alpha x) in the plane, u_x = c q sin(alpha x) (and u_z = -b q cos(alpha x) by
reciprocity); across the plane u = d q. Any number of layers, from the surface down, on a half-space.

In each layer the in-plane field is a sum of four modes, Papkovich-Neuber potentials phi = e^(-kz) cos kx and
psi = e^(-kz) cos kx and their growing twins e^(+k(z - h)) (the paper's Eqs 11 to 16, with one potential less: only
two are needed):

    2G u = grad(phi) + grad(z psi) - 4 (1 - nu) psi e_z.

With (U, W) the amplitudes of 2G u_x (sin), 2G u_z (cos) and (X, Z) those of sigma_xz, sigma_zz over k, the modes at
their own origin are the columns

    decaying: A0 = (-1, -1,  1, 1),  B0 = (0, -(3 - 4nu), 1 - 2nu,  2(1 - nu)),
    growing:  A1 = (-1,  1, -1, 1),  B1 = (0, -(3 - 4nu), 1 - 2nu, -2(1 - nu)),

and moving the origin by the thickness h turns B0 into B0 + kh A0 and B1 (growing, upwards) into B1 - kh A1, times
e^(-kh). At the bottom of a layer (Eq. 17) the compliance of everything below, u = Y/k t, fixes the growing modes by the
decaying ones, g = R d with a 2x2 matrix R that does not depend on k; at its top R appears as
e^(-2kh) [1, -kh; 0, 1] R [1, kh; 0, 1]. So only decaying exponentials occur, nothing is divided by 1 - 2nu, and the
*difference* between the layered and the homogeneous response is obtained without cancellation.
"""

from __future__ import annotations

import numpy as np

from rcstudy.mechanics.kernels.coefficients import layered_response
from rcstudy.mechanics.scene import Layer, Material


def response_difference(substrate: Material, layers: tuple[Layer, ...], alpha: np.ndarray) -> np.ndarray:
    """alpha times (a, b, c, d) of the layered body less that of a half-space of its top material.

    `alpha` [n] (1/mm), positive. Returns [4, n] (1/MPa); decays like exp(-2 alpha h1), zero without layers.
    """
    stack: tuple[Material, ...] = (*layers, substrate)
    out = np.zeros((4, alpha.size))
    if layers:
        layered_response(
            np.ascontiguousarray(alpha, dtype=float),
            np.array([m.E for m in stack], dtype=float),
            np.array([m.nu for m in stack], dtype=float),
            np.array([layer.thickness for layer in layers], dtype=float),
            out,
        )
    return out


def half_space_response(material: Material) -> np.ndarray:
    """alpha times (a, b, c, d) of a homogeneous half-space (1/MPa): constants.

    a = c = (1 - nu)/G, b = (1 - 2nu)/(2G), d = 1/G (Johnson 1985, section 3.2, transformed).
    """
    nu, g = material.nu, material.G
    return np.array([(1.0 - nu) / g, (1.0 - 2.0 * nu) / (2.0 * g), (1.0 - nu) / g, 1.0 / g])


def frequency_response(substrate: Material, layers: tuple[Layer, ...], alpha: np.ndarray) -> np.ndarray:
    """Frequency responses a, b, c, d (mm/MPa) of the layered half-space at `alpha` [n] (1/mm): array [4, n]."""
    alpha = np.asarray(alpha, dtype=float)
    top = layers[0] if layers else substrate
    scaled = half_space_response(top)[:, None] + response_difference(substrate, layers, alpha)
    result: np.ndarray = scaled / alpha
    return result
