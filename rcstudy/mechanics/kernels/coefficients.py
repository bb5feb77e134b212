"""Frequency responses of layered bodies and integrals over cells (`layered.py`, `influence.py`).

Compliances (displacements times alpha, per stress) are in 1/MPa; x, y, r and sides of cells dx, dy in mm; `kernel`
[n, 4] in mm/N and `primitive` [n, 4], its integrals over areas, in mm/MPa, both at exp(log_r0 + k step) for k < n;
influence coefficients `out` in mm/MPa. nodes, weights [g]: of Gauss and Legendre on [-1/2, 1/2].
"""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def product(
    a: tuple[float, float, float, float], b: tuple[float, float, float, float]
) -> tuple[float, float, float, float]:
    """a b; matrices here and below are (m00, m01, m10, m11)."""
    a00, a01, a10, a11 = a
    b00, b01, b10, b11 = b
    return a00 * b00 + a01 * b10, a00 * b01 + a01 * b11, a10 * b00 + a11 * b10, a10 * b01 + a11 * b11


@jit
def adjugate(a: tuple[float, float, float, float]) -> tuple[tuple[float, float, float, float], float]:
    """The adjugate of a, which is its inverse times its determinant, and that determinant."""
    a00, a01, a10, a11 = a
    return (a11, -a01, -a10, a00), a00 * a11 - a01 * a10


@jit
def at_interface(
    sign: float, nu: float, half_over_g: float, y: tuple[float, float, float]
) -> tuple[float, float, float, float]:
    """Displacement of the modes of a layer plus what y yields under their stresses; a mode in each column.

    sign: 1 for the decaying modes A0, B0, -1 for the growing ones A1, B1, whose (U, W, X, Z) `layered.py` gives; nu and
    half_over_g = 1/(2G) (1/MPa): of the layer; y: compliances a, b, c (1/MPa), times alpha, of what meets it there.
    """
    a, b, c = y
    kappa, p, q = 3.0 - 4.0 * nu, 1.0 - 2.0 * nu, sign * 2.0 * (1.0 - nu)
    # u = U/(2G) + c X - b Z, w = W/(2G) - b X + a Z, with A = (-1, -sign, sign, 1), B = (0, -kappa, p, q)
    return (
        -half_over_g + sign * c - b,
        c * p - b * q,
        -sign * half_over_g - sign * b + a,
        -kappa * half_over_g - b * p + a * q,
    )


@jit
def carried_up(r: tuple[float, float, float, float], zeta: float, e2: float) -> tuple[float, float, float, float]:
    """Reflection r at the bottom of a layer of thickness zeta/alpha, as it appears at its top.

    That is e2 [1, -zeta; 0, 1] r [1, zeta; 0, 1], e2 being e^(-2 zeta).
    """
    r00, r01, r10, r11 = r
    s00, s01 = r00 - zeta * r10, r01 - zeta * r11
    return e2 * s00, e2 * (s01 + zeta * s00), e2 * r10, e2 * (r11 + zeta * r10)


@jit
def tractions_at_top(nu: float, t: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """Stresses (X, Z) at the top of a layer for each decaying mode A0, B0, with the growing ones t times these."""
    t00, t01, t10, t11 = t
    p, q = 1.0 - 2.0 * nu, 2.0 * (1.0 - nu)
    return 1.0 - t00 + p * t10, p - t01 + p * t11, 1.0 + t00 - q * t10, q + t01 - q * t11


@jit
def reflected(
    nu: float, half_over_g: float, zeta: float, e2: float, below: tuple[float, float, float]
) -> tuple[float, float, float, float]:
    """Growing modes at the top of a layer over the decaying ones, as what is below reflects them (the paper's Eq. 17).

    nu, half_over_g = 1/(2G) (1/MPa): of the layer, zeta and e2: as of `carried_up`; below: as `y` of `at_interface`.
    """
    scaled_inverse, det = adjugate(at_interface(-1.0, nu, half_over_g, below))
    r00, r01, r10, r11 = product(scaled_inverse, at_interface(1.0, nu, half_over_g, below))
    return carried_up((-r00 / det, -r01 / det, -r10 / det, -r11 / det), zeta, e2)


@jit
def layered_response(
    alpha: np.ndarray,
    young: np.ndarray,
    poisson: np.ndarray,
    thickness: np.ndarray,
    homogeneous: np.ndarray,
    substrate: np.ndarray,
    out: np.ndarray,
) -> None:
    """Surface response of a layered half-space less that of a half-space of its top material, times alpha.

    alpha [n] (1/mm) > 0; young (MPa), poisson, thickness (mm) [m]: of the layers, from the surface down; homogeneous
    [m, 4] and substrate [4]: alpha times a, b, c, d (1/MPa) of a half-space of each, and of what they lie on; out
    [4, n]: alpha times the differences of a, b, c, d (1/MPa). The derivation, from the paper's Eqs 11 to 17, is in
    `layered.py`.
    """
    for i in range(alpha.size):
        below, d = (substrate[0], substrate[1], substrate[2]), substrate[3]  # of what lies below the layer in hand
        da = db = dc = dd = 0.0
        for layer in range(young.size - 1, -1, -1):
            nu = poisson[layer]
            g = young[layer] / (2.0 * (1.0 + nu))
            half_over_g = 0.5 / g
            own = homogeneous[layer, 0], homogeneous[layer, 1], homogeneous[layer, 2]
            zeta = alpha[i] * thickness[layer]
            e2 = math.exp(-2.0 * zeta)
            # across the wave (SH): one reflection coefficient at the lower interface
            rho = (d * g - 1.0) / (d * g + 1.0)
            dd = 2.0 / g * rho * e2 / (1.0 - rho * e2)
            d = homogeneous[layer, 3] + dd
            # in its plane (P-SV): what growing modes yield beyond a half-space of the layer under the same tractions
            t = reflected(nu, half_over_g, zeta, e2, below)
            scaled_inverse, det = adjugate(tractions_at_top(nu, t))
            yielding = product(at_interface(-1.0, nu, half_over_g, own), t)
            c00, c01, c10, c11 = product(yielding, scaled_inverse)
            da, db, dc = -c11 / det, 0.5 * (c01 + c10) / det, -c00 / det
            below = own[0] + da, own[1] + db, own[2] + dc
        out[0, i], out[1, i], out[2, i], out[3, i] = da, db, dc, dd


@jit
def half_spaces(
    dx: float,
    dy: float,
    normal: float,
    shear: float,
    dilation: float,
    have_x: int,
    have_y: int,
    more: np.ndarray,
    out: np.ndarray,
) -> None:
    """Influence coefficients of two half-spaces plus `more`: out [6, nx, ny] = zz, xx, yy, xy, xp, yp at (i dx, j dy).

    normal, shear (1/MPa): sums of the bodies' (1-nu)/(2 pi G) and nu/(2 pi G); dilation (1/MPa): difference of their
    (1-2nu)/(4 pi G). Integrals of 1/r, x^2/r^3, y^2/r^3, x y/r^3, x/r^2, y/r^2 over the cell, as differences of their
    primitives over its corners (Love 1929; Johnson 1985, Eqs 3.18 and 3.75; Cerruti). Cells with i < have_x and
    j < have_y are left alone.
    """
    nx, ny = out.shape[1], out.shape[2]
    # corner values of two rows of corners (fixed x) at a time
    low = np.zeros((5, ny + 1))
    high = np.zeros((5, ny + 1))
    for i in range(nx + 1):
        x = (i - 0.5) * dx
        for j in range(have_y if i < have_x else 0, ny + 1):
            y = (j - 0.5) * dy
            r = math.sqrt(x * x + y * y)
            # asinh(x/|y|) = log((x + r)/|y|); x and y are negative in the first row and column only
            high[0, j] = y * math.copysign(math.log((abs(x) + r) / abs(y)), x)
            high[1, j] = x * math.copysign(math.log((abs(y) + r) / abs(x)), y)
            high[2, j] = -r
            if dilation != 0.0:
                log_r = math.log(r)
                angle = math.atan(y / x)
                high[3, j] = y * log_r + x * angle
                high[4, j] = x * log_r + y * (math.copysign(0.5 * math.pi, y / x) - angle)
        if i > 0:
            for j in range(have_y if i - 1 < have_x else 0, ny):
                xx = high[0, j + 1] - high[0, j] - low[0, j + 1] + low[0, j]
                yy = high[1, j + 1] - high[1, j] - low[1, j + 1] + low[1, j]
                xy = high[2, j + 1] - high[2, j] - low[2, j + 1] + low[2, j]
                xp = high[3, j + 1] - high[3, j] - low[3, j + 1] + low[3, j]
                yp = high[4, j + 1] - high[4, j] - low[4, j + 1] + low[4, j]
                out[0, i - 1, j] = more[0, i - 1, j] + normal * (xx + yy)
                out[1, i - 1, j] = more[1, i - 1, j] + normal * (xx + yy) + shear * xx
                out[2, i - 1, j] = more[2, i - 1, j] + normal * (xx + yy) + shear * yy
                out[3, i - 1, j] = more[3, i - 1, j] + shear * xy
                out[4, i - 1, j] = more[4, i - 1, j] - dilation * xp
                out[5, i - 1, j] = more[5, i - 1, j] - dilation * yp
        low, high = high, low


@jit
def interpolate4(
    table: np.ndarray, log_r0: float, step: float, powers: tuple[int, int, int, int], r: float, out: np.ndarray
) -> None:
    """Four tabulated functions of log r at `r`, by Lagrange polynomials of degree 7 through the nearest 8 nodes.

    table [n, 4] at log r = log_r0 + step * (0..n-1); out [4]. Below the table the functions go as r to the `powers`.
    """
    n = table.shape[0]
    t = (math.log(r) - log_r0) / step
    if t <= 0.0:
        ratio = math.exp(t * step)
        for f in range(4):
            out[f] = table[0, f] * ratio ** powers[f]
        return
    i = min(max(int(t) - 3, 0), n - 8)
    u = t - i
    for f in range(4):
        out[f] = 0.0
    # barycentric form with the weights of 8 equidistant nodes: (-1)^k binomial(7, k)
    weight = 1.0
    total = 0.0
    for k in range(8):
        d = u - k
        if d == 0.0:
            for f in range(4):
                out[f] = table[i + k, f]
            return
        w = weight / d
        total += w
        for f in range(4):
            out[f] += w * table[i + k, f]
        weight = -weight * (7.0 - k) / (k + 1.0)
    for f in range(4):
        out[f] /= total


@jit
def add_components(value: np.ndarray, c: float, s: float, weight: float, out: np.ndarray) -> None:
    """Add weight times zz, xx, yy, xy, xp, yp of kernels value [4] (s, d, g, p: `influence.py`) in the direction c, s.

    c, s: its cosine and sine; out [6].
    """
    turned = value[2] * (c * c - s * s)
    out[0] += weight * value[0]
    out[1] += weight * (value[1] - turned)
    out[2] += weight * (value[1] + turned)
    out[3] -= weight * value[2] * 2.0 * s * c
    out[4] -= weight * value[3] * c
    out[5] -= weight * value[3] * s


@jit
def far_cell(
    kernel: np.ndarray,
    log_r0: float,
    step: float,
    x0: float,
    y0: float,
    dx: float,
    dy: float,
    nodes: np.ndarray,
    weights: np.ndarray,
    value: np.ndarray,
    out: np.ndarray,
) -> None:
    """Integrals of four radial kernels over the cell dx dy around (x0, y0), by Gauss-Legendre points on [-1/2, 1/2].

    kernel [n, 4]: the functions s, d, g, p of log r (see `influence.py`); value [4]: work array; out [6]: as from
    `add_components`.
    """
    out[:] = 0.0
    for a in range(nodes.size):
        x = x0 + nodes[a] * dx
        for b in range(nodes.size):
            y = y0 + nodes[b] * dy
            w = weights[a] * weights[b] * dx * dy
            r = math.sqrt(x * x + y * y)
            interpolate4(kernel, log_r0, step, (0, 0, 2, 1), r, value)
            add_components(value, x / r, y / r, w, out)


@jit
def far_cells(
    kernel: np.ndarray,
    log_r0: float,
    step: float,
    dx: float,
    dy: float,
    skip_x: int,
    skip_y: int,
    beyond: np.ndarray,
    rules: tuple[tuple[np.ndarray, np.ndarray], ...],
    out: np.ndarray,
) -> None:
    """Cell integrals of four radial kernels away from the origin, by Gauss-Legendre points.

    out [6, nx, ny]: zz, xx, yy, xy, xp, yp; cells with i < skip_x and j < skip_y are left alone. `rules` [k]: nodes and
    weights on [-1/2, 1/2], for cells at least beyond[k] (mm, rising from 0) from the origin; other arguments as in
    `far_cell`.

    Square cells (i, j) and (j, i) are mirror images. Those with j > i are always taken from the other one, so that no
    number depends on which others are computed.
    """
    nx, ny = out.shape[1], out.shape[2]
    value, found = np.empty(4), np.empty(6)
    for i in range(nx - 1, -1, -1):  # backwards: the mirror image comes first
        for j in range(skip_y if i < skip_x else 0, ny):
            mirrored = dx == dy and j > i
            if mirrored and j < nx and (j >= skip_x or i >= skip_y):
                for f in range(6):
                    found[f] = out[f, j, i]
            else:
                x, y = (j * dx, i * dy) if mirrored else (i * dx, j * dy)
                rule = 0
                while rule + 1 < beyond.size and math.hypot(x, y) >= beyond[rule + 1]:
                    rule += 1
                nodes, weights = rules[rule]
                far_cell(kernel, log_r0, step, x, y, dx, dy, nodes, weights, value, found)
            if mirrored:
                found[1], found[2], found[4], found[5] = found[2], found[1], found[5], found[4]
            for f in range(6):
                out[f, i, j] = found[f]


@jit
def corner_integrals(
    primitive: np.ndarray,
    log_r0: float,
    step: float,
    x: float,
    y: float,
    nodes: np.ndarray,
    weights: np.ndarray,
    longest: float,
    out: np.ndarray,
) -> None:
    """Integrals of four radial kernels over the rectangle [0, x] x [0, y], x, y > 0, in polar coordinates.

    primitive [n, 4]: integrals of (s, d, g, p) r dr from 0 to r. The rectangle is two triangles, r < x/cos(theta) and
    r < y/sin(theta); with y = x sinh u the angle's integrand is smooth at any aspect ratio. It is integrated over u, by
    `nodes` and `weights` on [-1/2, 1/2] of pieces no longer than `longest`. out [6]: zz, xx, yy, xy, xp, yp.
    """
    value = np.empty(4)
    for f in range(6):
        out[f] = 0.0
    for triangle in range(2):
        side, other = (x, y) if triangle == 0 else (y, x)
        top = math.asinh(other / side)
        pieces = math.ceil(top / longest)
        for a in range(nodes.size * pieces):
            u = (a // nodes.size + nodes[a % nodes.size] + 0.5) * top / pieces
            ch = math.cosh(u)
            along, across = 1.0 / ch, math.tanh(u)
            c, s = (along, across) if triangle == 0 else (across, along)
            interpolate4(primitive, log_r0, step, (2, 2, 4, 3), side * ch, value)
            w = weights[a % nodes.size] * top / pieces / ch
            add_components(value, c, s, w, out)


@jit
def near_cells(
    primitive: np.ndarray,
    log_r0: float,
    step: float,
    dx: float,
    dy: float,
    near_x: int,
    near_y: int,
    nodes: np.ndarray,
    weights: np.ndarray,
    longest: float,
    out: np.ndarray,
) -> None:
    """Cell integrals of four radial kernels near the origin, as differences of corner integrals.

    Layers may be of any thickness. Fills out[:, :near_x, :near_y]; the arguments are those of `far_cells` and
    `corner_integrals`.
    """
    corner = np.empty((near_x + 1, near_y + 1, 6))
    for i in range(near_x, 0, -1):  # backwards: of square cells, as in `far_cells`, the mirror image comes first
        for j in range(1, near_y + 1):
            mirrored = dx == dy and j > i
            c = corner[i, j]
            if mirrored and j <= near_x:
                for f in range(6):
                    c[f] = corner[j, i, f]
            else:
                m, n = (j, i) if mirrored else (i, j)
                corner_integrals(primitive, log_r0, step, (m - 0.5) * dx, (n - 0.5) * dy, nodes, weights, longest, c)
            if mirrored:
                c[1], c[2], c[4], c[5] = c[2], c[1], c[5], c[4]
    # corners at -dx/2, -dy/2 by parity: an integral from the axis is odd where the kernel is even and vice versa
    for f in range(6):
        sign_x = 1.0 if f == 3 or f == 4 else -1.0
        sign_y = 1.0 if f == 3 or f == 5 else -1.0
        for j in range(1, near_y + 1):
            corner[0, j, f] = sign_x * corner[1, j, f]
        for i in range(near_x + 1):
            corner[i, 0, f] = sign_y * corner[i, 1, f]
        for i in range(near_x):
            for j in range(near_y):
                out[f, i, j] = corner[i + 1, j + 1, f] - corner[i, j + 1, f] - corner[i + 1, j, f] + corner[i, j, f]
