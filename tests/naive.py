"""Naive twins of the mechanics: dense, slow, written from the mathematics and not from the kernels.

Nothing here comes from rcstudy but the records that hold moduli. Stresses and displacements, their order and signs are
those of tests/reference/README.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.integrate import dblquad
from scipy.interpolate import BarycentricInterpolator
from scipy.linalg import null_space
from scipy.special import j0, j1

from rcstudy.mechanics.scene import Layer, Material

Field = Callable[[float, float], float]


# --- half-spaces ---


def half_space_green(material: Material, x: float, y: float) -> list[float]:
    """Surface displacements at x, y by unit forces at the origin: Johnson (1985), Eqs 3.18, 3.75."""
    nu = material.nu
    front = 1.0 / (2.0 * math.pi * material.G)
    r = math.hypot(x, y)
    return [
        front * (1.0 - nu) / r,
        front * ((1.0 - nu) / r + nu * x * x / r**3),
        front * ((1.0 - nu) / r + nu * y * y / r**3),
        front * nu * x * y / r**3,
        -front * (0.5 - nu) * x / r**2,
        -front * (0.5 - nu) * y / r**2,
    ]


def half_space_coefficients(material: Material, offsets: np.ndarray, spacing: tuple[float, float]) -> np.ndarray:
    """Coefficients [6, n] at `offsets` [n, 2] of any sign: the Green's functions' primitives at the cells' corners."""
    nu = material.nu
    front = 1.0 / (2.0 * math.pi * material.G)
    total = np.zeros((6, len(offsets)))
    for end_x in (-0.5, 0.5):
        for end_y in (-0.5, 0.5):
            x, y = (offsets[:, 0] + end_x) * spacing[0], (offsets[:, 1] + end_y) * spacing[1]
            r = np.hypot(x, y)
            # mixed derivatives d2/dxdy of these are x^2/r^3, y^2/r^3, xy/r^3, x/r^2, y/r^2
            of_xx, of_yy, of_xy = y * np.log(x + r), x * np.log(y + r), -r
            of_x, of_y = y * np.log(r) + x * np.arctan(y / x), x * np.log(r) + y * np.arctan(x / y)
            inverse = of_xx + of_yy
            total += (
                np.sign(end_x * end_y)
                * front
                * np.array(
                    [
                        (1.0 - nu) * inverse,
                        (1.0 - nu) * inverse + nu * of_xx,
                        (1.0 - nu) * inverse + nu * of_yy,
                        nu * of_xy,
                        -(0.5 - nu) * of_x,
                        -(0.5 - nu) * of_y,
                    ]
                )
            )
    return total


def over_rectangle(f: Field, x: tuple[float, float], y: tuple[float, float]) -> float:
    """Integral of `f`, of order 1, over a rectangle that does not hold the origin inside."""
    return float(dblquad(lambda v, u: f(u, v), *x, *y, epsabs=1e-13, epsrel=1e-11)[0])


def over_own_cell(f: Field, spacing: tuple[float, float]) -> float:
    """Integral over the cell around the origin of `f`, which may go like 1/r there: four triangles, polar coordinates.

    `f` at odd points of the cell is integrated as it is, no symmetry being assumed.
    """
    total = 0.0
    for side, height, half_base in (
        (0, spacing[0] / 2, spacing[1] / 2),
        (1, spacing[1] / 2, spacing[0] / 2),
        (2, spacing[0] / 2, spacing[1] / 2),
        (3, spacing[1] / 2, spacing[0] / 2),
    ):
        end = math.atan(half_base / height)

        def polar(r: float, angle: float, turn: float = side * math.pi / 2) -> float:
            return r * f(r * math.cos(angle + turn), r * math.sin(angle + turn))

        def top(angle: float, height: float = height) -> float:
            return height / math.cos(angle)

        total += dblquad(polar, -end, end, 0.0, top, epsabs=1e-13, epsrel=1e-11)[0]
    return total


def cell_integral(f: Field, i: int, j: int, spacing: tuple[float, float]) -> float:
    """Integral of `f` over the cell i, j (a displacement at the origin's centre, seen from the loaded cell)."""
    if i == j == 0:
        return over_own_cell(f, spacing)
    dx, dy = spacing
    return over_rectangle(f, ((i - 0.5) * dx, (i + 0.5) * dx), ((j - 0.5) * dy, (j + 0.5) * dy))


# --- layers ---


def scaled_response(substrate: Material, layers: Iterable[Layer], alpha: float) -> np.ndarray:
    """alpha times a, b, c, d of a layered half-space (definitions: reference README), by shooting; nu < 1/2.

    u_x = U(z) sin kx, u_z = W(z) cos kx, sigma_xz = X(z) sin kx, sigma_zz = Z(z) cos kx: Hooke's law and equilibrium
    are d/dz (U, W, X, Z) = A (U, W, X, Z). The substrate takes the fields that decay; layers carry them to the surface.
    """

    def plane(m: Material) -> np.ndarray:
        g = m.G / unit
        lame = 2.0 * g * m.nu / (1.0 - 2.0 * m.nu)
        stiff = lame + 2.0 * g
        return np.array(
            [
                [0.0, 1.0, 1.0 / g, 0.0],  # X = G (U' - W)
                [-lame / stiff, 0.0, 0.0, 1.0 / stiff],  # Z = stiff W' + lame U
                [stiff - lame**2 / stiff, 0.0, 0.0, lame / stiff],  # X' = sigma_xx
                [0.0, 0.0, -1.0, 0.0],  # Z' = -X
            ]
        )

    def across(m: Material) -> np.ndarray:
        return np.array([[0.0, unit / m.G], [m.G / unit, 0.0]])

    def exponential(a: np.ndarray, z: float) -> np.ndarray:
        # a^2 = 1 + n with n^2 = 0: cosh and sinh of the matrix end after the first power of n
        one = np.eye(len(a))
        n = a @ a - one
        sinh, cosh = math.sinh(z), math.cosh(z)
        return cosh * one + 0.5 * z * sinh * n + (sinh * one + 0.5 * (z * cosh - sinh) * n) @ a

    # k = 1: depths in 1/k, stresses in units of G k
    unit = substrate.G
    result = []
    for matrix in (plane, across):
        a = matrix(substrate)
        fields = null_space(np.linalg.matrix_power(a + np.eye(len(a)), len(a) // 2), rcond=1e-9)
        for layer in reversed(list(layers)):
            fields = exponential(matrix(layer), -alpha * layer.thickness) @ fields
            fields /= np.abs(fields).max()
        half = len(a) // 2
        # displacements by the stresses on the surface's outward side, p = -Z and q = -X or -Y
        result.append(-fields[:half] @ np.linalg.inv(fields[half:]) / unit)
    (ux_by_q, ux_by_p), (_, uz_by_p) = result[0]
    return np.array([uz_by_p, -ux_by_p, ux_by_q, result[1][0, 0]])


class LayeredGreen:
    """What layers add to the Green's functions of a half-space of the top layer's material.

    With D the difference of `scaled_response`, an inverse Fourier transform in the plane leaves sums over one wave
    number: u_z by p is int Da J0(alpha r) d alpha/(2 pi), and so on; u_x by q holds (m^2 c + n^2 d)/alpha^2, that is
    (c + d)/2 + (c - d)/2 cos 2 phi, of which the second part transforms with -J2 cos 2 theta.
    """

    def __init__(self, substrate: Material, layers: tuple[Layer, ...]) -> None:
        # D falls like exp(-2 alpha h1): 1e-16 is reached at 18.5; so many of Legendre's points resolve J to r = 15 h1
        nodes, weights = np.polynomial.legendre.leggauss(300)
        top = 18.5 / layers[0].thickness
        self.alpha = 0.5 * top * (nodes + 1.0)
        bare = scaled_response(Material(layers[0].E, layers[0].nu), (), 1.0)
        d = np.array([scaled_response(substrate, layers, alpha) - bare for alpha in self.alpha])
        self.weighted = d * (0.5 * top * weights)[:, None] / (2.0 * math.pi)

    def radial(self, r: np.ndarray) -> np.ndarray:
        """s, d, g, p [4, n] at `r` [n]."""
        a, b, c, d = self.weighted.T
        t = r[:, None] * self.alpha
        zeroth, first = j0(t), j1(t)
        second = 2.0 * first / t - zeroth
        return np.array([zeroth @ a, zeroth @ (0.5 * (c + d)), second @ (0.5 * (c - d)), first @ b])

    def __call__(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Green's functions [6, n] at x, y [n]."""
        r, theta = np.hypot(x, y), np.arctan2(y, x)
        s, d, g, p = self.radial(r)
        return directed(s, d, g, p, theta)

    def coefficients(self, offsets: np.ndarray, spacing: tuple[float, float]) -> np.ndarray:
        """Coefficients [6, n] by 12 x 12 Gauss points: the functions are smooth on the scale of the layer."""
        nodes, weights = np.polynomial.legendre.leggauss(12)
        total = np.zeros((6, len(offsets)))
        for u, wu in zip(nodes / 2.0, weights / 2.0, strict=True):
            for v, wv in zip(nodes / 2.0, weights / 2.0, strict=True):
                x, y = (offsets[:, 0] + u) * spacing[0], (offsets[:, 1] + v) * spacing[1]
                total += wu * wv * spacing[0] * spacing[1] * self(x, y)
        return total


@cache
def layered_green(substrate: Material, layers: tuple[Layer, ...]) -> LayeredGreen:
    """The same for all meshes."""
    return LayeredGreen(substrate, layers)


def directed(s: np.ndarray, d: np.ndarray, g: np.ndarray, p: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Six Green's functions [6, ...] in the direction `theta` of a source's field, from four radial functions."""
    return np.array(
        [
            s,
            d - g * np.cos(2.0 * theta),
            d + g * np.cos(2.0 * theta),
            -g * np.sin(2.0 * theta),
            -p * np.cos(theta),
            -p * np.sin(theta),
        ]
    )


# --- two bodies on a mesh, dense ---


@dataclass(frozen=True)
class Bodies:
    """Body 1, `layers` on `substrate`, against body 2, a half-space or rigid (None), on cells of `spacing` dx, dy."""

    substrate: Material
    layers: tuple[Layer, ...]
    counterbody: Material | None
    spacing: tuple[float, float]

    def coefficients(self, offsets: np.ndarray) -> np.ndarray:
        """Coefficients [6, n] of u1 - u2 (u_z: of the approach) at signed `offsets` [n, 2]."""
        top = self.layers[0] if self.layers else self.substrate
        total = half_space_coefficients(top, offsets, self.spacing)
        if self.layers:
            total += layered_green(self.substrate, self.layers).coefficients(offsets, self.spacing)
        if self.counterbody is not None:
            # tractions on body 2 are the opposite ones; its pressure is the same, its z points the other way
            sign = np.array([1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
            total += sign[:, None] * half_space_coefficients(self.counterbody, offsets, self.spacing)
        return total

    def matrices(self, to: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Matrices [6, len(to), len(cells)]: displacements in the cells `to` [., 2] by stresses on `cells`."""
        offsets = (to[:, None, :] - cells[None, :, :]).reshape(-1, 2)
        distinct, which = np.unique(offsets, axis=0, return_inverse=True)
        return self.coefficients(distinct)[:, which.reshape(-1)].reshape(6, len(to), len(cells))

    def slips(self, cells: np.ndarray) -> np.ndarray:
        """Matrices [6, m, m] of the slip (u_i - u_(i+1))/dx; the cell ahead need not be in contact."""
        ahead = cells + np.array([1, 0])
        return (self.matrices(cells, cells) - self.matrices(ahead, cells)) / self.spacing[0]

    def slip_by_tractions(self, cells: np.ndarray) -> np.ndarray:
        """Matrix [2 m, 2 m] from (qx of all cells, qy of all cells) to the slips in the same order."""
        _, xx, yy, xy, _, _ = self.slips(cells)
        return np.block([[xx, xy], [xy, yy]])


def signed(quadrant: np.ndarray, parity: tuple[int, int], i: int, j: int) -> float:
    """Coefficient at any offset from those at offsets >= 0 and the parity in x and in y."""
    value = float(quadrant[abs(i), abs(j)])
    return value * (parity[0] if i < 0 else 1) * (parity[1] if j < 0 else 1)


def offset_of(index: int, length: int) -> int:
    """The offset of least size that an index on a circle stands for; half the circle counts as ahead."""
    return index if 2 * index <= length else index - length


def torus(quadrant: np.ndarray, parity: tuple[int, int], padded: tuple[int, int]) -> np.ndarray:
    """Coefficients on a torus: at half its length, where two offsets meet, the mean of both."""
    out = np.empty(padded)
    for i in range(padded[0]):
        for j in range(padded[1]):
            a, b = offset_of(i, padded[0]), offset_of(j, padded[1])
            ends_a = (a, -a) if 2 * a == padded[0] else (a,)
            ends_b = (b, -b) if 2 * b == padded[1] else (b,)
            out[i, j] = np.mean([signed(quadrant, parity, m, n) for m in ends_a for n in ends_b])
    return out


def torus_difference(quadrant: np.ndarray, parity: tuple[int, int], dx: float, padded: tuple[int, int]) -> np.ndarray:
    """(C(i, j) - C(i + 1, j))/dx on a torus; means at half its length in y only, where x has no neighbour to lose."""
    out = np.empty(padded)
    for i in range(padded[0]):
        for j in range(padded[1]):
            a, b = offset_of(i, padded[0]), offset_of(j, padded[1])
            ends = (b, -b) if 2 * b == padded[1] else (b,)
            out[i, j] = np.mean(
                [(signed(quadrant, parity, a, n) - signed(quadrant, parity, a + 1, n)) / dx for n in ends]
            )
    return out


def direct_convolution(quadrant: np.ndarray, parity: tuple[int, int], field: np.ndarray) -> np.ndarray:
    """sum over all cells of the coefficient at the offset times the field: four loops, no transform."""
    nx, ny = field.shape
    out = np.zeros((nx, ny))
    for i in range(nx):
        for j in range(ny):
            for k in range(nx):
                for m in range(ny):
                    out[i, j] += signed(quadrant, parity, i - k, j - m) * field[k, m]
    return out


def direct_difference(quadrant: np.ndarray, parity: tuple[int, int], dx: float, field: np.ndarray) -> np.ndarray:
    """(u_i - u_(i+1))/dx of the displacements u of `direct_convolution`, by loops over one more row of cells."""
    longer = np.zeros((field.shape[0] + 1, field.shape[1]))
    longer[:-1] = field
    u = direct_convolution(quadrant, parity, longer)
    return (u[:-1] - u[1:]) / dx


# --- interpolation ---


def interpolated(values: np.ndarray, t: float) -> np.ndarray:
    """Rows of `values` [n, ...] at the places 0..n-1 interpolated at `t` through the eight nodes about it."""
    first = min(max(math.floor(t) - 3, 0), len(values) - 8)
    nodes = np.arange(first, first + 8)
    return np.asarray(BarycentricInterpolator(nodes, values[nodes])(t))


def from_twice_the_size(
    values: np.ndarray, mask: np.ndarray, cells: np.ndarray, window: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray]:
    """Bilinear interpolation to `cells` [m, 2] of `window` from cells of twice the size about the same centre.

    Every coarse cell in `mask` counts by its two hat functions at the fine cell's centre. Means [m, k] of `values`
    [k, nx, ny] by these weights (zero without any), and the weights' sum [m].
    """
    out, weight = np.zeros((len(cells), len(values))), np.zeros(len(cells))
    for m, (i, j) in enumerate(cells):
        for a, b in np.argwhere(mask):
            x = abs((i - 0.5 * (window[0] - 1)) - 2.0 * (a - 0.5 * (mask.shape[0] - 1)))
            y = abs((j - 0.5 * (window[1] - 1)) - 2.0 * (b - 0.5 * (mask.shape[1] - 1)))
            hat = max(0.0, 1.0 - 0.5 * x) * max(0.0, 1.0 - 0.5 * y)
            weight[m] += hat
            out[m] += hat * values[:, a, b]
        if weight[m] > 0.0:
            out[m] /= weight[m]
    return out, weight


# --- solvers ---


def pressure_by_active_set(a: np.ndarray, gap: np.ndarray, total: float) -> tuple[np.ndarray, float]:
    """p >= 0, gap + a p - approach >= 0, one of them zero in each cell, sum(p) = total: p [m] and the approach.

    Linear systems for a guessed contact, from which cells in tension leave and which cells that overlap join.
    """
    contact = np.ones(len(gap), dtype=bool)
    for _ in range(200):
        n = int(contact.sum())
        system = np.zeros((n + 1, n + 1))
        system[:n, :n] = a[np.ix_(contact, contact)]
        system[:n, n] = -1.0
        system[n, :n] = 1.0
        solution = np.linalg.solve(system, np.append(-gap[contact], total))
        p = np.zeros(len(gap))
        p[contact] = solution[:n]
        approach = float(solution[n])
        overlaps = gap + a @ p < approach
        new = np.where(contact, p > 0.0, overlaps)
        if (new == contact).all():
            return p, approach
        contact = new
    raise ArithmeticError("the active set does not settle")


def tractions_by_newton(b: np.ndarray, bound: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coulomb's law on m cells: tractions and slips [m, 2] from the slip matrix `b` [2 m, 2 m].

    Zero of F(q) = q - Proj(q - rho (w + b q)), Proj onto discs of radius `bound` [m], by Newton's method with the exact
    derivative of F and dense solves; a step that does not make F smaller is halved.
    """
    m = len(bound)
    rho = 1.0 / b.diagonal().min()
    wide = w.T.reshape(-1)

    def f(q: np.ndarray) -> np.ndarray:
        t = (q - rho * (wide + b @ q)).reshape(2, m)
        return q - (t * np.minimum(1.0, bound / np.maximum(np.hypot(*t), 1e-300))).reshape(-1)

    def derivative(q: np.ndarray) -> np.ndarray:
        t = q - rho * (wide + b @ q)
        of_t = np.eye(2 * m) - rho * b
        of_f = np.eye(2 * m)
        for c in range(m):
            pair = [c, m + c]
            size = float(np.hypot(*t[pair]))
            disc = np.eye(2)
            if size > bound[c]:
                disc = bound[c] / size * (disc - np.outer(t[pair], t[pair]) / size**2)
            of_f[pair] -= disc @ of_t[pair]
        return of_f

    q = np.zeros(2 * m)
    for _ in range(100):
        value = f(q)
        size = np.linalg.norm(value)
        if size <= 1e-13 * np.linalg.norm(bound):
            return q.reshape(2, m).T, (wide + b @ q).reshape(2, m).T
        step = np.linalg.solve(derivative(q), value)
        part = 1.0
        while part > 1e-3 and np.linalg.norm(f(q - part * step)) >= size:
            part *= 0.5
        q = q - part * step
    raise ArithmeticError("Newton's method does not settle")


def coupled_by_turns(
    bodies: Bodies, cells: np.ndarray, gap: np.ndarray, w: np.ndarray, friction: float, total: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Pressure [n] and tractions [n, 2] on all `cells` [n, 2] of a window that are consistent, and the approach.

    In turn: the pressure with the gap [n] changed by the tractions, the tractions under that pressure (Panagiotopoulos
    1975), until neither changes. u_z by q is u_x by p with the cells exchanged (Betti). w [n, 2]: rigid slip.
    """
    zz, _, _, _, xp, yp = bodies.matrices(cells, cells)
    _, xx, yy, xy, slip_xp, slip_yp = bodies.slips(cells)
    p, q = np.zeros(len(cells)), np.zeros((len(cells), 2))
    for _ in range(300):
        before = p, q
        p, approach = pressure_by_active_set(zz, gap + xp.T @ q[:, 0] + yp.T @ q[:, 1], total)
        inside = np.flatnonzero(p)
        own = np.ix_(inside, inside)
        by_pressure = np.stack([slip_xp @ p, slip_yp @ p], axis=1)
        b = np.block([[xx[own], xy[own]], [xy[own], yy[own]]])
        q = np.zeros((len(cells), 2))
        q[inside] = tractions_by_newton(b, friction * p[inside], (w + by_pressure)[inside])[0]
        if max(np.abs(p - before[0]).max(), np.abs(q - before[1]).max()) <= 1e-12 * p.max():
            return p, q, approach
    raise ArithmeticError("pressure and tractions do not settle")


def least_squares_krylov(a: np.ndarray, preconditioner: np.ndarray, b: np.ndarray, steps: int) -> np.ndarray:
    """The x with the smallest residual in M span(b, A M b, ..., (A M)^(steps - 1) b): what GMRES computes."""
    basis = np.empty((len(b), 0))
    vector = b
    for _ in range(steps):
        basis = np.linalg.qr(np.column_stack([basis, vector / np.linalg.norm(vector)]))[0]
        vector = a @ (preconditioner @ basis[:, -1])
    space = preconditioner @ basis
    solution: np.ndarray = space @ np.linalg.lstsq(a @ space, b, rcond=None)[0]
    return solution


def papers_iteration(
    u: np.ndarray, u_ahead: np.ndarray, bound: np.ndarray, w: np.ndarray, cells: np.ndarray, dx: float, tolerance: float
) -> tuple[np.ndarray, int]:
    """The paper's Eqs 9 and 18 to 23 with dense matrices: tractions [m, 2] and the number of iterations.

    `u` [2 m, 2 m]: displacements by tractions; `u_ahead` the same in each cell's neighbour at +x. Eq. 8 in its integral
    form: u in a cell differs from u ahead of its row's first cell by minus the integral of w between their centres.
    What lies behind a gap in a row is a row of its own.
    """
    m = len(cells)
    at = {tuple(cell): k for k, cell in enumerate(cells.tolist())}
    leader = list(range(m))
    wanted = np.zeros((m, 2))
    for k, (i, j) in enumerate(cells.tolist()):
        while (i, j) in at:
            leader[k] = at[i, j]
            wanted[k] -= dx * w[leader[k]]
            i += 1

    def times(matrix: np.ndarray, q: np.ndarray) -> np.ndarray:
        return (matrix @ q.T.reshape(-1)).reshape(2, m).T

    q, t = np.zeros((m, 2)), np.zeros((m, 2))
    old = change = math.inf
    iterations = 0
    while change > tolerance:
        r = times(u, q) - times(u_ahead, q)[leader] - wanted
        square = sum(float(r[k] @ r[k]) for k in range(m) if np.hypot(*q[k]) < bound[k] * (1.0 - 1e-12))
        if square < old:
            t = r + (0.0 if math.isinf(old) else square / old) * t
        new = q - square / float((t * times(u, t)).sum()) * t
        for k in range(m):
            new[k] *= min(1.0, bound[k] / np.hypot(*new[k]))
        change = float(np.linalg.norm(new - q) / np.linalg.norm(new))
        q, old = new, square
        iterations += 1
    return q, iterations
