"""A second program for steady rolling contact of layered bodies, dense and slow: tests hold rcstudy against it.

It was written from the description of the problem (the paper's Eqs 1-6 and Kalker's difference for the slip) without a
look at the solver. It imports nothing of rcstudy and takes other ways: transfer matrices in long double for the
response of layers, contour integrals for half-spaces, a 2-D Fourier integral for what layers add, a dense active set
for the pressure, a dense projection Newton method for the tractions, and both in turn for full coupling.

Over 977 random and 285 chosen scenes it agreed with rcstudy (`discretisation: kalker`, tolerances 1e-12) to 1e-10 of
the natural scale of each field and scalar, with all cells in the same state.

Scenes are mappings with the keys of a study's `scene:` and plain numbers, in N, mm, MPa and rad. Body 1 fills z > 0 and
carries the layers; pressure and tractions act on it. Rolling is towards +x. Cells are numbered ix * ny + iy. Fields
along the surface are arrays [2 n]: the x components of all cells, then the y components.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, Literal, NamedTuple

import numpy as np

WIDE = np.longdouble
# influence coefficients: displacement (z, x, y) by pressure or traction, and their parities in x and in y
ZZ, XX, YY, XY, XP, YP = range(6)
PARITIES = ((1, 1), (1, 1), (1, 1), (-1, -1), (-1, 1), (1, -1))
NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)


class Material(NamedTuple):
    """Young's modulus (MPa) and Poisson's ratio; a layer's thickness (mm)."""

    E: float
    nu: float
    thickness: float = math.inf

    @property
    def G(self) -> Any:
        """Shear modulus (MPa), in long double."""
        return WIDE(self.E) / (2 * (1 + WIDE(self.nu)))


def in_plane(material: Material, unit: Any) -> np.ndarray:
    """Matrix A [4, 4] of dv/d(kz) = A v for v = (k U, k W, T, S), stresses in units of `unit` (MPa).

    u_x = U e^(ikx), u_z = i W e^(ikx), sigma_xz = T e^(ikx), sigma_zz = i S e^(ikx). The first two rows are Hooke's
    law, the others equilibrium, with sigma_xx expressed by U and S.
    """
    g, nu = material.G / unit, WIDE(material.nu)
    ratio, softness = nu / (1 - nu), (1 - 2 * nu) / (2 * g * (1 - nu))
    return np.array([[0, 1, 1 / g, 0], [-ratio, 0, 0, softness], [2 * g / (1 - nu), 0, 0, ratio], [0, 0, -1, 0]], WIDE)


def anti_plane(material: Material, unit: Any) -> np.ndarray:
    """The same [2, 2] for v = (k V, T): u_y = V e^(ikx), sigma_yz = T e^(ikx)."""
    return np.array([[0, unit / material.G], [material.G / unit, 0]], WIDE)


def transfer(a: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """exp(-A depth) e^(-depth) [n, m, m]: from the bottom of a layer to its top; `depth` [n] is k h.

    A^2 = 1 + N with N^2 = 0, so series in N of cosh and sinh end after its first power. The factor keeps both in range.
    """
    one = np.eye(len(a), dtype=WIDE)
    n = a @ a - one
    x = depth[:, None, None]
    cosh, sinh = (1 + np.exp(-2 * x)) / 2, -np.expm1(-2 * x) / 2
    return cosh * one + x * sinh / 2 * n - sinh * a - (x * cosh - sinh) / 2 * (a @ n)


def orthonormal(fields: np.ndarray) -> np.ndarray:
    """The columns of `fields` [n, m, k] made orthonormal (Gram-Schmidt), which leaves the space they span.

    Across a layer all columns grow like its fastest growing field; without this they would become parallel.
    """
    columns: list[np.ndarray] = []
    for column in np.moveaxis(fields, 2, 0):
        for other in columns:
            column = column - (column * other).sum(axis=1, keepdims=True) * other
        columns.append(column / np.sqrt((column**2).sum(axis=1, keepdims=True)))
    return np.stack(columns, axis=2)


def inverse(m: np.ndarray) -> np.ndarray:
    """Inverses of matrices [n, 2, 2]; NumPy has none in long double."""
    determinant = m[:, 0, 0] * m[:, 1, 1] - m[:, 0, 1] * m[:, 1, 0]
    adjugate = np.array([[m[:, 1, 1], -m[:, 0, 1]], [-m[:, 1, 0], m[:, 0, 0]]])
    return np.moveaxis(adjugate, 2, 0) / determinant[:, None, None]


def scaled_response(substrate: Material, layers: Sequence[Material], k: np.ndarray) -> np.ndarray:
    """Frequency responses a, b, c, d of a layered half-space times the wave number `k` [n] (1/mm): [4, n] (1/MPa).

    Along the wave u_z = a p, u_x = c q_x, and u_x = i b p for p e^(ikx); across it u_y = d q_y. Fields that decay in
    the substrate are the columns of (A - 1)^2, as (A + 1)^2 (A - 1)^2 = N^2 = 0; in the anti-plane case of A - 1. The
    layers' transfer matrices take them to the surface, where p = -sigma_zz and q = -sigma_xz, -sigma_yz.
    """
    unit = substrate.G
    surface = []
    for matrix, half in ((in_plane, 2), (anti_plane, 1)):
        decaying = np.linalg.matrix_power(matrix(substrate, unit) - np.eye(2 * half, dtype=WIDE), half)[:, :half]
        fields = orthonormal(np.broadcast_to(decaying, (len(k), 2 * half, half)))
        for layer in reversed(layers):
            fields = orthonormal(transfer(matrix(layer, unit), WIDE(layer.thickness) * k) @ fields)
        surface.append(fields)
    along, across = surface[0][:, :2] @ inverse(surface[0][:, 2:]), surface[1][:, 0, 0] / surface[1][:, 1, 0]
    return np.array([-along[:, 1, 1], along[:, 0, 1], -along[:, 0, 0], -across]) / unit


def half_space_coefficients(material: Material, x: np.ndarray, y: np.ndarray, spacing: np.ndarray) -> np.ndarray:
    """Displacements [6, nx, ny] (mm/MPa) at x [nx, 1], y [1, ny] by unit stresses on the cell around the origin.

    The kernels (Boussinesq, Cerruti; Johnson 1985, Eqs 3.18, 3.75) are homogeneous of degree -1, K = div(K r), so that
    their integrals over a cell are those of K r.n around it. On an edge r.n is constant, and K has a primitive.
    """

    def along(d: np.ndarray, t: np.ndarray) -> list[np.ndarray]:
        """Primitives in t of d times 1/r, d^2/r^3, t^2/r^3, d t/r^3, d/r^2, t/r^2 on an edge at the distance d."""
        r, log = np.hypot(d, t), np.arcsinh(t / np.abs(d))
        return [d * log, d * t / r, d * (log - t / r), -d * d / r, d * np.arctan(t / d), d * np.log(r)]

    total = np.zeros((6, x.size, y.size))
    for sign, i, j in ((1, 1, 1), (-1, 1, -1), (-1, -1, 1), (1, -1, -1)):
        corner_x, corner_y = x + 0.5 * i * spacing[0], y + 0.5 * j * spacing[1]
        total += sign * np.array(along(corner_x, corner_y))  # the edge along y, then that along x
        total += sign * np.array(along(corner_y, corner_x))[[0, 2, 1, 3, 5, 4]]
    inverse_r, xx, yy, xy, of_x, of_y = total / (2 * math.pi * float(material.G))
    nu = material.nu
    same, by_pressure = (1 - nu) * inverse_r, nu - 0.5
    return np.array([same, same + nu * xx, same + nu * yy, nu * xy, by_pressure * of_x, by_pressure * of_y])


def wave_number_panels(substrate: Material, layers: Sequence[Material], reach: float) -> list[float]:
    """Bounds (1/mm) of the panels in wave number that are integrated by 24 Gauss points each; `reach` in mm.

    Layers begin to be felt where k H is like the ratio of moduli, and what they add ends like exp(-2 k h) of the top
    layer. In between panels double, but stay short enough for waves at the distance `reach` and for that exponential.
    """
    moduli = [body.E for body in (substrate, *layers)]
    top, thickness = layers[0].thickness, sum(layer.thickness for layer in layers)
    bounds, last = [0.0, 1e-3 * min(moduli) / max(moduli) / max(thickness, reach)], 24.0 / top
    while bounds[-1] < last:
        bounds.append(min(2 * bounds[-1], bounds[-1] + 12.0 / reach, bounds[-1] + 4.0 / top, last))
    return bounds


def layer_coefficients(substrate: Material, layers: Sequence[Material], *place: np.ndarray) -> np.ndarray:
    """What layers add to `half_space_coefficients` of the top layer's material [6, nx, ny] at the same x, y, spacing.

    Inverse Fourier transform in polar coordinates: Gauss points in wave number, equidistant angles, which are exact
    once they outnumber the orders of Bessel functions that count. The integrand's parities leave one quarter.
    """
    x, y, (dx, dy) = place
    reach = math.hypot(x.max() + dx, y.max() + dy)
    total = np.zeros((6, x.size, y.size))
    for low, high in pairwise(wave_number_panels(substrate, layers, reach)):
        k = low + 0.5 * (high - low) * (NODES + 1)
        added = scaled_response(substrate, layers, k) - scaled_response(layers[0], (), k)
        a, b, c, d = added.astype(float)[:, :, None]
        count = math.ceil((1.15 * high * reach + 60) / 4)
        angle = (np.arange(count) + 0.5) * math.pi / (2 * count)
        cos, sin = np.cos(angle), np.sin(angle)
        along_x, along_y = np.outer(k, cos), np.outer(k, sin)
        cell = dx * dy * np.sinc(along_x * dx / (2 * math.pi)) * np.sinc(along_y * dy / (2 * math.pi))
        # each angle stands for four, one in each quarter
        weight = cell * (0.5 * (high - low) * WEIGHTS)[:, None] * (2 * math.pi / count) / (2 * math.pi) ** 2
        x_waves, y_waves = x * along_x.ravel(), along_y.ravel()[:, None] * y
        even_x, odd_x, even_y, odd_y = np.cos(x_waves), np.sin(x_waves), np.cos(y_waves), np.sin(y_waves)
        for component, response, along, across in (
            (ZZ, a, even_x, even_y),
            (XX, c * cos**2 + d * sin**2, even_x, even_y),
            (YY, c * sin**2 + d * cos**2, even_x, even_y),
            (XY, (d - c) * cos * sin, odd_x, odd_y),
            (XP, -b * cos, odd_x, even_y),
            (YP, -b * sin, even_x, odd_y),
        ):
            total[component] += (along * (weight * response).ravel()) @ across
    return total


def coefficients(scene: Mapping[str, Any]) -> np.ndarray:
    """Coefficients [6, nx + 1, ny] (mm/MPa) of u1 - u2, u_z of the approach, by the cells' offset in x and in y."""
    spacing = np.divide(scene["mesh"]["size"], scene["mesh"]["cells"])
    nx, ny = scene["mesh"]["cells"]
    place = (np.arange(nx + 1) * spacing[0])[:, None], (np.arange(ny) * spacing[1])[None, :], spacing
    substrate = Material(**scene["substrate"])
    layers = [Material(**layer) for layer in scene.get("layers", ())]
    total = half_space_coefficients([*layers, substrate][0], *place)
    if layers:
        total += layer_coefficients(substrate, layers, *place)
    if scene.get("counterbody", "rigid") != "rigid":
        # opposite tractions act on body 2; its pressure is the same, its z points the other way
        sign = np.array([1, 1, 1, 1, -1, -1])[:, None, None]
        total += sign * half_space_coefficients(Material(**scene["counterbody"]), *place)
    return total


class Problem:
    """The equations of a scene on n cells; lengths in mm, stresses in MPa."""

    def __init__(self, scene: Mapping[str, Any]) -> None:
        values = coefficients(scene)
        nx, ny = scene["mesh"]["cells"]
        dx, dy = np.divide(scene["mesh"]["size"], scene["mesh"]["cells"])

        def displacement(component: int, ahead: int = 0) -> np.ndarray:
            """Of all cells, or of those `ahead` of them, by stresses on all cells [n, n] (mm/MPa)."""
            i = (np.arange(nx) + ahead)[:, None, None, None] - np.arange(nx)[:, None]
            j = np.arange(ny)[:, None, None] - np.arange(ny)
            signs = np.where(i < 0, PARITIES[component][0], 1) * np.where(j < 0, PARITIES[component][1], 1)
            return (signs * values[component][np.abs(i), np.abs(j)]).reshape(nx * ny, nx * ny)

        self.load, self.friction = scene["load"], scene["friction"]
        self.is_coupled = scene.get("coupling") == "full"
        self.cell_area = dx * dy
        self.x = np.repeat((np.arange(nx) - (nx - 1) / 2) * dx, ny)
        self.y = np.tile((np.arange(ny) - (ny - 1) / 2) * dy, nx)
        rx, ry = np.broadcast_to(scene["radius"], 2)
        self.gap = self.x**2 / (2 * rx) + self.y**2 / (2 * ry)  # undeformed: Johnson 1985, 4.1
        self.normal = displacement(ZZ)  # P Eq. 3
        # reciprocity: u_z by q_x is u_x by p with the offset reversed
        self.lift = -np.hstack([displacement(XP), displacement(YP)])
        # slip (u_i - u_(i+1))/dx: Kalker 1990
        xx, yy, xy, xp, yp = ((displacement(c) - displacement(c, ahead=1)) / dx for c in (XX, YY, XY, XP, YP))
        self.slip_by_tractions = np.block([[xx, xy], [xy, yy]])
        self.slip_by_pressure = np.vstack([xp, yp])
        self.rolls = scene.get("creepage", "none") != "none"
        if self.rolls:
            xi_x, xi_y, phi = (scene["creepage"].get(key, 0) for key in ("longitudinal", "lateral", "spin"))
            lever = self.x + scene.get("spin_point", 0) * dx
            self.rigid_slip = np.concatenate([xi_x - phi * self.y, xi_y + phi * lever])  # P Eq. 5

    def known_slip(self, p: np.ndarray) -> np.ndarray:
        """Slip without tractions [2 n]."""
        return self.rigid_slip + self.slip_by_pressure @ p


def solve_pressure(problem: Problem, gap: np.ndarray) -> tuple[np.ndarray, float]:
    """Pressure [n] and approach of P Eqs 1-4 for an undeformed `gap` [n]: closed where p > 0, open elsewhere."""
    scale = problem.normal[0, 0]
    contact = np.ones(len(gap), bool)
    for _ in range(100):
        # u_z + gap - approach = 0 in contact, sum of p = load; all entries of order 1, refined once
        m = np.count_nonzero(contact)
        system = np.block([[problem.normal[np.ix_(contact, contact)] / scale, -np.ones((m, 1))], [np.ones(m), 0]])
        right = np.append(-gap[contact] / scale, problem.load / problem.cell_area)
        unknowns = np.linalg.solve(system, right)
        unknowns += np.linalg.solve(system, right - system @ unknowns)
        p, approach = np.zeros(len(gap)), unknowns[-1] * scale
        p[contact] = unknowns[:-1]
        overlap = gap + problem.normal @ p - approach < -1e-14 * approach
        if not (p < 0).any() and not (overlap & ~contact).any():
            return p, approach
        contact = p > 0 if (p < 0).any() else contact | overlap
    raise RuntimeError("the set of cells in contact does not settle")


def solve_tractions(problem: Problem, p: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tractions [2 n] under the pressure `p` [n] from the guess `start` [2 n], and which cells slip [n].

    Stick, s = 0 and |q| <= mu p, or slip, |q| = mu p and q opposite to s (P Eq. 6, Kalker 1990), are together
    q = Proj(q - rho s) with the projection on |q| <= mu p for any rho > 0: Newton's method, steps halved if needed.
    """
    contact = p > 0
    both, m = np.tile(contact, 2), np.count_nonzero(contact)
    matrix, known = problem.slip_by_tractions[np.ix_(both, both)], problem.known_slip(p)[both]
    bound, rho = problem.friction * p[contact], 0.5 / matrix[0, 0]

    def project(q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Residual [2 m] at `q`, what is projected [2, m], and the part of it that is kept [m]."""
        trial = (q - rho * (matrix @ q + known)).reshape(2, m)
        kept = np.minimum(1.0, bound / np.hypot(*trial))
        return (kept * trial).ravel() - q, trial, kept

    q = start[both]
    residual, trial, kept = project(q)
    for _ in range(100):
        # derivative of the projection: 1 in stick cells; in slip cells `kept` times the part across the traction
        radial = np.where(kept < 1, kept, 0) * trial[:, None] * trial / np.hypot(*trial) ** 2
        blocks = kept * np.eye(2)[:, :, None] - radial
        change = (np.eye(2 * m) - rho * matrix).reshape(2, m, 2 * m)
        jacobian = np.einsum("abm,bmk->amk", blocks, change).reshape(2 * m, 2 * m) - np.eye(2 * m)
        step, before = np.linalg.solve(jacobian, -residual), np.linalg.norm(residual)
        for length in 0.5 ** np.arange(10):
            residual, trial, kept = project(q + length * step)
            if np.linalg.norm(residual) < (1 - 1e-4 * length) * before:
                break
        q = q + length * step
        if np.linalg.norm(residual) <= 1e-13 * np.linalg.norm(q):
            tractions, slips = np.zeros(len(both)), np.zeros(len(p), bool)
            tractions[both], slips[contact] = q, kept < 1
            return tractions, slips
    raise RuntimeError("no tractions found")


def solve(problem: Problem, start: Literal["no traction", "slip everywhere"] = "no traction") -> dict[str, Any]:
    """Fields [n] and scalars of the solution by rcstudy's names, in its units; tractions are found from `start`."""
    p, approach = solve_pressure(problem, problem.gap)
    if not problem.rolls:
        return numbers(problem, p, approach)
    known = problem.known_slip(p).reshape(2, -1)
    q = (-problem.friction * p * known / np.hypot(*known)).ravel() * (start == "slip everywhere")
    for _ in range(200):
        q, slips = solve_tractions(problem, p, q)
        before = p
        if problem.is_coupled:
            p, approach = solve_pressure(problem, problem.gap + problem.lift @ q)
        if np.linalg.norm(p - before) <= 1e-13 * np.linalg.norm(p):
            return numbers(problem, p, approach, q, slips)
    raise RuntimeError("pressure and tractions do not settle")


def numbers(problem: Problem, p: np.ndarray, approach: float, *rolling: np.ndarray) -> dict[str, Any]:
    """Fields and scalars; with `rolling`, the tractions [2 n] and which cells slip [n], those of rolling as well."""
    area = np.count_nonzero(p) * problem.cell_area
    found = {"pressure": p, "pressure_max": p.max(), "contact_area": area, "approach": approach}
    found["contact_radius"] = math.sqrt(area / math.pi)
    if not rolling:
        return found
    q, slips = rolling
    s = problem.known_slip(p) + problem.slip_by_tractions @ q
    (qx, qy), (sx, sy) = q.reshape(2, -1), s.reshape(2, -1) * (p > 0)
    state = np.where(slips, 2, p > 0)  # 0 exterior, 1 stick, 2 slip
    found |= {"traction_x": qx, "traction_y": qy, "slip_x": sx, "slip_y": sy, "state": state}
    found["traction_max"] = np.hypot(qx, qy).max()
    sums = np.array([qx, qy, problem.x * qy - problem.y * qx, -(qx * sx + qy * sy), slips]).sum(axis=1)
    names = ("force_x", "force_y", "moment_z", "friction_power", "slip_area")
    return found | dict(zip(names, sums * problem.cell_area, strict=True))
