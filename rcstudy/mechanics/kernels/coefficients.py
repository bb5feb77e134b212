"""Frequency responses of layered bodies and integrals over cells (`layered.py`, `influence.py`)."""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def layered_response(
    alpha: np.ndarray, young: np.ndarray, poisson: np.ndarray, thickness: np.ndarray, out: np.ndarray
) -> None:
    """Surface response of a layered half-space less that of a half-space of its top material, times alpha.

    alpha [n] (1/mm) > 0; young (MPa), poisson [m] from the surface down, the last one the substrate; thickness [m-1]
    (mm); out [4, n]: alpha times the differences of a, b, c, d (1/MPa). The derivation is in `layered.py`.
    """
    n = alpha.size
    m = young.size
    for i in range(n):
        k = alpha[i]
        # surface compliance, times alpha, of what lies below the layer in hand: starts as the substrate
        g = young[m - 1] / (2.0 * (1.0 + poisson[m - 1]))
        ya = (1.0 - poisson[m - 1]) / g
        yb = (1.0 - 2.0 * poisson[m - 1]) / (2.0 * g)
        yc = ya
        yd = 1.0 / g
        da = db = dc = dd = 0.0
        for layer in range(m - 2, -1, -1):
            nu = poisson[layer]
            g = young[layer] / (2.0 * (1.0 + nu))
            kappa = 3.0 - 4.0 * nu
            p = 1.0 - 2.0 * nu
            q = 2.0 * (1.0 - nu)
            zeta = k * thickness[layer]
            e2 = math.exp(-2.0 * zeta)
            h = 0.5 / g
            # anti-plane (SH): one reflection coefficient at the lower interface
            rho = (yd * g - 1.0) / (yd * g + 1.0)
            dd = 2.0 / g * rho * e2 / (1.0 - rho * e2)
            yd = 1.0 / g + dd
            # in-plane (P-SV), Eq. 17 at the interface below
            # rows of M: displacement (U, W) + compliance below * stress (X, Z); columns: the two modes
            # decaying modes A0 = (-1, -1, 1, 1), B0 = (0, -kappa, p, q); growing A1 = (-1, 1, -1, 1), B1 = (0,
            # -kappa, p, -q)
            md00 = -h + yc - yb
            md01 = yc * p - yb * q
            md10 = -h - yb + ya
            md11 = -kappa * h - yb * p + ya * q
            mg00 = -h - yc - yb
            mg01 = yc * p + yb * q
            mg10 = h + yb + ya
            mg11 = -kappa * h - yb * p - ya * q
            det = mg00 * mg11 - mg01 * mg10
            r00 = -(mg11 * md00 - mg01 * md10) / det
            r01 = -(mg11 * md01 - mg01 * md11) / det
            r10 = -(mg00 * md10 - mg10 * md00) / det
            r11 = -(mg00 * md11 - mg10 * md01) / det
            # carried to the top of the layer: e^(-2 zeta) [1, -zeta; 0, 1] R [1, zeta; 0, 1]
            s00 = r00 - zeta * r10
            s01 = r01 - zeta * r11
            t00 = e2 * s00
            t01 = e2 * (s01 + zeta * s00)
            t10 = e2 * r10
            t11 = e2 * (r11 + zeta * r10)
            # N = -(stress of decaying modes + stress of growing modes * T): surface tractions per decaying mode
            n00 = -(1.0 - t00 + p * t10)
            n01 = -(p - t01 + p * t11)
            n10 = -(1.0 + t00 - q * t10)
            n11 = -(q + t01 - q * t11)
            # growing modes' displacement + (half-space compliance of this layer) * their stress
            ha = (1.0 - nu) / g
            hb = p * h
            w00 = -h - ha - hb
            w01 = ha * p + hb * q
            w10 = h + hb + ha
            w11 = -kappa * h - hb * p - ha * q
            v00 = w00 * t00 + w01 * t10
            v01 = w00 * t01 + w01 * t11
            v10 = w10 * t00 + w11 * t10
            v11 = w10 * t01 + w11 * t11
            det = n00 * n11 - n01 * n10
            dc = (v00 * n11 - v01 * n10) / det
            db = -0.5 * ((v01 * n00 - v00 * n01) + (v10 * n11 - v11 * n10)) / det
            da = (v11 * n00 - v10 * n01) / det
            ya = ha + da
            yb = hb + db
            yc = ha + dc
        out[0, i] = da
        out[1, i] = db
        out[2, i] = dc
        out[3, i] = dd


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
    primitives over its corners (Love 1929; Cerruti). Cells with i < have_x and j < have_y are left alone.
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
                found[:] = out[:, j, i]
            else:
                x, y = (j * dx, i * dy) if mirrored else (i * dx, j * dy)
                rule = 0
                while rule + 1 < beyond.size and math.hypot(x, y) >= beyond[rule + 1]:
                    rule += 1
                nodes, weights = rules[rule]
                far_cell(kernel, log_r0, step, x, y, dx, dy, nodes, weights, value, found)
            if mirrored:
                found[1], found[2], found[4], found[5] = found[2], found[1], found[5], found[4]
            out[:, i, j] = found


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
