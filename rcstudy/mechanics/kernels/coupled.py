"""Newton steps for pressure and tractions together (`coupled.py`; Alart and Curnier 1991).

Stresses and responses are three arrays on the box, [3, nx, ny]: (qx, qy, p) and (slip x, slip y, gap). Vectors of
unknowns are [3 m]: the pressures of the m cells in contact, then two numbers for each cell as in `tractions.py`.

Stresses, and pressures p [m] and tractions q [m, 2] of the cells in contact, are in MPa, gaps in mm; cells [m, 2], slip
[m], normal [m, 2] and unit (MPa): as in `tractions.py`.
"""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def multiply_3x3(hat: np.ndarray, pair: np.ndarray, along: np.ndarray, dx: float, gap: np.ndarray) -> None:
    """Displacements by stresses: multiply hat [3, py//2+1, 2 px] = (qx, qy, p), in place, wave by wave by a matrix.

    The matrix is [[xx, xy, i x], [xy, yy, i y], [-i dx x, -i dx y, z]]. hat: real and imaginary parts side by side; xx,
    xy, yy: pair [3, py//2+1, 2 px], each number twice, displacements along the surface by tractions; x, y: along
    [2, py//2+1, px], the same by pressure; both in cells of length dx. By reciprocity u_z by tractions is the negative
    of the displacement by pressure. z: gap [py//2+1, px], u_z by pressure.
    """
    for i in range(hat.shape[1]):
        for j in range(gap.shape[1]):
            r = 2 * j
            a, b, c = hat[0, i, r], hat[1, i, r], hat[2, i, r]
            u, v, w = hat[0, i, r + 1], hat[1, i, r + 1], hat[2, i, r + 1]
            xx, xy, yy = pair[0, i, r], pair[1, i, r], pair[2, i, r]
            x, y, z = along[0, i, j], along[1, i, j], gap[i, j]
            hat[0, i, r] = xx * a + xy * b - x * w
            hat[0, i, r + 1] = xx * u + xy * v + x * c
            hat[1, i, r] = xy * a + yy * b - y * w
            hat[1, i, r + 1] = xy * u + yy * v + y * c
            hat[2, i, r] = dx * (x * u + y * v) + z * c
            hat[2, i, r + 1] = z * w - dx * (x * a + y * b)


@jit
def touching_cells(
    stress: np.ndarray, response: np.ndarray, overlap: float, cells: np.ndarray
) -> tuple[int, int, float]:
    """Find the cells in contact: those under pressure, and those where the surfaces overlap without it.

    stress (MPa), response [3, nx, ny]: as in the module's description, the gaps (mm) without the approach. The approach
    is the mean gap under pressure; cells [nx ny, 2]: filled with i, j, ordered by i, then by j. Returns the number of
    cells in contact, how many of them bear no pressure yet but overlap by more than `overlap` times the approach, and
    the approach (mm).
    """
    nx, ny = stress.shape[1], stress.shape[2]
    total = 0.0
    count = 0
    for i in range(nx):
        for j in range(ny):
            if stress[2, i, j] > 0.0:
                total += response[2, i, j]
                count += 1
    approach = total / max(count, 1)
    m = deep = 0
    for i in range(nx):
        for j in range(ny):
            inside = stress[2, i, j] > 0.0
            if inside or response[2, i, j] < approach:
                cells[m, 0] = i
                cells[m, 1] = j
                m += 1
                if not inside and response[2, i, j] < approach - overlap * abs(approach):
                    deep += 1
    return m, deep, approach


@jit
def gather_contact(
    stress: np.ndarray, response: np.ndarray, cells: np.ndarray, p: np.ndarray, q: np.ndarray, s: np.ndarray
) -> None:
    """Pressures p [m], tractions q (MPa) and slips s [m, 2] at the cells [m, 2], of stress, response [3, nx, ny]."""
    for m in range(cells.shape[0]):
        i, j = cells[m, 0], cells[m, 1]
        p[m] = stress[2, i, j]
        q[m, 0] = stress[0, i, j]
        q[m, 1] = stress[1, i, j]
        s[m, 0] = response[0, i, j]
        s[m, 1] = response[1, i, j]


@jit
def scatter_contact(p: np.ndarray, q: np.ndarray, cells: np.ndarray, out: np.ndarray) -> None:
    """Pressures p [m] and tractions q [m, 2] into out [3, nx, ny], zeros elsewhere."""
    out[:, :, :] = 0.0
    for m in range(cells.shape[0]):
        i, j = cells[m, 0], cells[m, 1]
        out[0, i, j] = q[m, 0]
        out[1, i, j] = q[m, 1]
        out[2, i, j] = p[m]


@jit
def scatter_unknowns(
    v: np.ndarray,
    cells: np.ndarray,
    slip: np.ndarray,
    normal: np.ndarray,
    friction: float,
    unit: float,
    out: np.ndarray,
) -> None:
    """Stresses of a vector of unknowns v [3 m] into out [3, nx, py], zeros elsewhere; slip cells' bounds change with p.

    slip [m]: whether the cell is a slip cell; normal [m, 2]: direction of the bound there; unit: of tractions along it.
    """
    out[:, :, :] = 0.0
    n = cells.shape[0]
    for m in range(n):
        i, j = cells[m, 0], cells[m, 1]
        p, x, y = v[m], v[n + 2 * m], v[n + 2 * m + 1]
        if slip[m]:
            along = friction * p + unit * x
            x, y = along * normal[m, 0] - y * normal[m, 1], along * normal[m, 1] + y * normal[m, 0]
        out[0, i, j] = x
        out[1, i, j] = y
        out[2, i, j] = p


@jit
def mean_at(field: np.ndarray, cells: np.ndarray) -> float:
    """Mean of field over the cells [m, 2]."""
    total = 0.0
    for m in range(cells.shape[0]):
        total += field[cells[m, 0], cells[m, 1]]
    return total / cells.shape[0]


@jit
def spread_uneven(gap: np.ndarray, cells: np.ndarray, factor: float, out: np.ndarray) -> None:
    """factor (gap - its mean over the cells [m, 2]) into out [nx, py], zeros elsewhere. gap, out: may be padded."""
    mean = mean_at(gap, cells)
    out[:, :] = 0.0
    for m in range(cells.shape[0]):
        i, j = cells[m, 0], cells[m, 1]
        out[i, j] = factor * (gap[i, j] - mean)


@jit
def gather_uneven(field: np.ndarray, cells: np.ndarray, out: np.ndarray) -> None:
    """Values of field at the cells [m, 2] less their mean, into out [m]."""
    mean = mean_at(field, cells)
    for m in range(cells.shape[0]):
        out[m] = field[cells[m, 0], cells[m, 1]] - mean


@jit
def move_contact(
    change: np.ndarray,
    slip: np.ndarray,
    normal: np.ndarray,
    friction: float,
    unit: float,
    total: float,
    p: np.ndarray,
    q: np.ndarray,
) -> None:
    """Pressures p [m] and tractions q [m, 2] after the change [3 m] of the unknowns, in place.

    Pressures are cut at zero and scaled to the sum `total`; slip cells are put on their new bounds; cells without
    pressure get no traction.
    """
    n = p.size
    new_total = 0.0
    for m in range(n):
        new_total += max(p[m] + change[m], 0.0)
    scale = total / new_total
    for m in range(n):
        old = friction * p[m]
        p[m] = max(p[m] + change[m], 0.0) * scale
        if p[m] == 0.0:
            q[m, 0] = 0.0
            q[m, 1] = 0.0
        elif slip[m]:
            bound = friction * p[m]
            along, tau = bound - old + unit * change[n + 2 * m], change[n + 2 * m + 1]
            x = q[m, 0] + along * normal[m, 0] - tau * normal[m, 1]
            y = q[m, 1] + along * normal[m, 1] + tau * normal[m, 0]
            size = math.sqrt(x * x + y * y)
            shrink = bound / size if size > 0.0 else 1.0
            q[m, 0] = x * shrink
            q[m, 1] = y * shrink
        else:
            q[m, 0] += change[n + 2 * m]
            q[m, 1] += change[n + 2 * m + 1]
