"""Newton steps for the tractions (`rolling.py`).

Vectors of unknowns have the shape [2 m] for m cells: entries 2 i and 2 i + 1 belong to cell i. In a stick cell they are
(qx, qy); in a slip cell (a/unit, tau), a being the component along the direction n = (nx, ny) of the bound and tau that
across it, along (-ny, nx) (called m in `rolling.py`). The equation of a/unit is the identity, as the size of the
traction is known. cells [m, 2]: i, j in the box; places [m]: indices of the cells in flattened arrays.

Of the cells, here and in `centring.py` and `coupled.py`: tractions q [m, 2] and their bound mu p [m] (MPa), slips s
[m, 2], flags of slip cells slip [m], directions of the bound normal [m, 2] (unit vectors n), share [m] (c of
`rolling.py`). diagonal (1/MPa): its b; unit, rho (MPa): of the unknown a/unit, and of slips in q - rho s; damping [m],
root [m]: of `slip_damping`; dx (mm): length of the cells.
"""

from __future__ import annotations

import math

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def rigid_slip(
    x: np.ndarray, y: np.ndarray, longitudinal: float, lateral: float, spin: float, ahead: float, out: np.ndarray
) -> None:
    """Rigid slip at x, y [m] (mm), its spin part taken `ahead` (mm) of x, into out [m, 2]."""
    for m in range(x.size):
        out[m, 0] = longitudinal - spin * y[m]
        out[m, 1] = lateral + spin * (x[m] + ahead)


@jit
def traction_of(v: np.ndarray, m: int, slip: np.ndarray, normal: np.ndarray, unit: float) -> tuple[float, float]:
    """Traction of cell number m by a vector of unknowns v.

    slip [m]: whether a cell is a slip cell; normal [m, 2]: direction of the bound there; unit: see above.
    """
    if not slip[m]:
        return v[2 * m], v[2 * m + 1]
    a = unit * v[2 * m]
    return normal[m, 0] * a - normal[m, 1] * v[2 * m + 1], normal[m, 1] * a + normal[m, 0] * v[2 * m + 1]


@jit
def scatter_traction(
    v: np.ndarray, places: np.ndarray, slip: np.ndarray, normal: np.ndarray, unit: float, out: np.ndarray
) -> None:
    """Tractions by `traction_of` of a vector of unknowns v [2 m] into two padded arrays out [2, n], zeros elsewhere."""
    out[:, :] = 0.0
    for m in range(places.size):
        k = places[m]
        out[0, k], out[1, k] = traction_of(v, m, slip, normal, unit)


@jit
def add_cross_slip(
    v: np.ndarray,
    cells: np.ndarray,
    slip: np.ndarray,
    normal: np.ndarray,
    unit: float,
    part: np.ndarray,
    ahead: np.ndarray,
    field: np.ndarray,
) -> None:
    """Add part [n] q_y to the slips along x and part q_x to those along y of cells [n] (numbers), in place.

    q: tractions by `traction_of`; field [2, size]: displacements. The slip of a cell is its own displacement less that
    of the cell ahead, so the latter is reduced. ahead [n]: places of these cells, whose own slips are not used.
    """
    for k in range(cells.size):
        x, y = traction_of(v, cells[k], slip, normal, unit)
        field[0, ahead[k]] -= part[k] * y
        field[1, ahead[k]] -= part[k] * x


@jit
def slip_row(x: float, y: float, nx: float, ny: float, c: float, b: float, tau: float) -> float:
    """Row c m.s + (1 - c) b tau of a slip cell, from its slip s = (x, y) and the direction nx, ny of its bound."""
    return c * (nx * y - ny * x) + (1.0 - c) * b * tau


@jit
def gather_slip(
    field: np.ndarray,
    v: np.ndarray,
    places: np.ndarray,
    ahead: int,
    slip: np.ndarray,
    normal: np.ndarray,
    share: np.ndarray,
    diagonal: float,
    s: np.ndarray,
    out: np.ndarray,
) -> None:
    """Rows out [2 m] of the Newton system, s in stick cells, c m.s + (1 - c) b tau in slip cells, from displacements.

    field [2, n]: these, in cells, in two padded arrays; the slip of a cell is its own displacement less that of the
    cell ahead, whose place is larger by `ahead`. v [2 m]: the unknowns that cause them; share [m]: c, and diagonal: b,
    see `rolling.py`; s [2 m]: filled with the slips, for later use.
    """
    for m in range(places.size):
        k = places[m]
        x, y = field[0, k] - field[0, k + ahead], field[1, k] - field[1, k + ahead]
        s[2 * m] = x
        s[2 * m + 1] = y
        if slip[m]:
            out[2 * m] = v[2 * m]
            out[2 * m + 1] = slip_row(x, y, normal[m, 0], normal[m, 1], share[m], diagonal, v[2 * m + 1])
        else:
            out[2 * m] = x
            out[2 * m + 1] = y


@jit
def gather_slips(field: np.ndarray, places: np.ndarray, ahead: int, out: np.ndarray) -> None:
    """Slips at the cells from displacements as in `gather_slip`, into out [2 m]."""
    for m in range(places.size):
        k = places[m]
        out[2 * m] = field[0, k] - field[0, k + ahead]
        out[2 * m + 1] = field[1, k] - field[1, k + ahead]


@jit
def classify(
    q: np.ndarray,
    s: np.ndarray,
    bound: np.ndarray,
    rho: float,
    slip: np.ndarray,
    normal: np.ndarray,
    share: np.ndarray,
) -> tuple[int, float, float]:
    """Classify cells as stick or slip by t = q - rho s against the bound, and set the coefficients of the Newton step.

    q, s [m, 2] (MPa, -), bound mu p [m] (MPa), rho (MPa). A cell slips if |t| > bound; then normal = t/|t| and
    share = bound/|t|. Where t is opposite to q, the slip has passed through zero, and the cell is taken to stick.
    Returns the number of slip cells and the squared norms of q - Proj(t) and of q.
    """
    # least component of q along t in slip, over the bound. Without this rule cells ten times longer than wide and
    # stiff films took thousands of products, and some did not converge; 0 to 0.5 work as well
    turned = -0.1
    slipping = 0
    residual = square = 0.0
    for m in range(q.shape[0]):
        tx = q[m, 0] - rho * s[m, 0]
        ty = q[m, 1] - rho * s[m, 1]
        size = math.sqrt(tx * tx + ty * ty)
        outside = size > bound[m]
        slips = outside and tx * q[m, 0] + ty * q[m, 1] > turned * bound[m] * size
        slip[m] = slips
        if slips:
            slipping += 1
            normal[m, 0] = tx / size
            normal[m, 1] = ty / size
            share[m] = bound[m] / size
        if outside:
            tx *= bound[m] / size
            ty *= bound[m] / size
        residual += (q[m, 0] - tx) ** 2 + (q[m, 1] - ty) ** 2
        square += q[m, 0] ** 2 + q[m, 1] ** 2
    return slipping, residual, square


@jit
def gather_centred_slip(
    field: np.ndarray,
    v: np.ndarray,
    places: np.ndarray,
    ahead: int,
    slip: np.ndarray,
    normal: np.ndarray,
    share: np.ndarray,
    diagonal: float,
    weight: np.ndarray,
    s: np.ndarray,
    out: np.ndarray,
) -> None:
    """As `gather_slip`, but rows of slip cells take the slip at their centres, by weights [3, m] of `centring.centre`.

    s [2 m]: filled with the slips half a cell ahead.
    """
    for m in range(places.size):
        k = places[m]
        x, y = field[0, k] - field[0, k + ahead], field[1, k] - field[1, k + ahead]
        s[2 * m] = x
        s[2 * m + 1] = y
        if slip[m]:
            for one, steps in enumerate((1, -1, 2)):  # the cells ahead, behind and second ahead
                if weight[one, m] != 0.0:  # that of a neighbour that does not exist is zero
                    n = k + steps * ahead
                    x += weight[one, m] * (field[0, n] - field[0, n + ahead] - s[2 * m])
                    y += weight[one, m] * (field[1, n] - field[1, n + ahead] - s[2 * m + 1])
            out[2 * m] = v[2 * m]
            out[2 * m + 1] = slip_row(x, y, normal[m, 0], normal[m, 1], share[m], diagonal, v[2 * m + 1])
        else:
            out[2 * m] = x
            out[2 * m + 1] = y


@jit
def slip_damping(
    share: np.ndarray, slip: np.ndarray, held: float, damping: np.ndarray, root: np.ndarray
) -> tuple[float, int]:
    """Factor damping [m] by which displacements pass slip cells, and root [m] of their share c.

    share [m]: c; held: b dx over a displacement by unit tau (`SlipOperator`). Slip cells with c below 1/3 pass none;
    the others hardly slip, which the preconditioner takes for stick across their bounds (`rolling.py`). Returns the
    sum of c over slip cells, and the number of those that hardly slip.
    """
    total, near = 0.0, 0
    for m in range(share.size):
        if slip[m]:
            c = share[m]
            total += c
            root[m] = math.sqrt(c)
            damping[m] = 0.0
            if 3.0 * c >= 1.0:
                damping[m] = 1.0 / (1.0 + held * (1.0 / c - 1.0))
                near += 1
    return total, near


@jit
def newton_residual(
    s: np.ndarray,
    q: np.ndarray,
    slip: np.ndarray,
    normal: np.ndarray,
    share: np.ndarray,
    diagonal: float,
    bound: np.ndarray,
    unit: float,
    out: np.ndarray,
) -> None:
    """Right-hand side [2 m] of the Newton step (`rolling.py`), in units of slip (-), into out.

    -s in stick cells; in slip cells (bound - n.q)/unit and, with c = share and b = diagonal, -(c m.s + (1 - c) b m.q).
    s, q, normal [m, 2]: slips, tractions (MPa), directions n; slip, share, bound [m]: flags, c, mu p (MPa); diagonal
    (1/MPa): of the operator; unit (MPa): of the unknown a/unit.
    """
    for m in range(q.shape[0]):
        if slip[m]:
            nx, ny = normal[m, 0], normal[m, 1]
            out[2 * m] = (bound[m] - nx * q[m, 0] - ny * q[m, 1]) / unit
            out[2 * m + 1] = -slip_row(s[m, 0], s[m, 1], nx, ny, share[m], diagonal, nx * q[m, 1] - ny * q[m, 0])
        else:
            out[2 * m] = -s[m, 0]
            out[2 * m + 1] = -s[m, 1]


@jit
def add_step(
    q: np.ndarray, change: np.ndarray, slip: np.ndarray, normal: np.ndarray, unit: float, out: np.ndarray
) -> None:
    """Tractions q [m, 2] (MPa) plus the unknowns' change [2 m], into out [m, 2].

    slip [m]: cells whose unknowns are along normal [m, 2], in units of `unit` (MPa), and across it.
    """
    for m in range(q.shape[0]):
        x, y = change[2 * m], change[2 * m + 1]
        if slip[m]:
            x, y = normal[m, 0] * unit * x - normal[m, 1] * y, normal[m, 1] * unit * x + normal[m, 0] * y
        out[m, 0] = q[m, 0] + x
        out[m, 1] = q[m, 1] + y


@jit
def put_on_bound(q: np.ndarray, slip: np.ndarray, normal: np.ndarray, bound: np.ndarray, out: np.ndarray) -> None:
    """Tractions q [m, 2] (MPa) scaled back to the bound [m] (MPa), those of slip cells that fall short of it put on it.

    The latter point along normal [m, 2], unit vectors; slip [m]: flags. Result in out [m, 2].
    """
    for m in range(q.shape[0]):
        x, y = q[m, 0], q[m, 1]
        size = math.sqrt(x * x + y * y)
        if size > bound[m] * (1.0 + 1e-15):
            x *= bound[m] / size
            y *= bound[m] / size
        elif slip[m] and size < bound[m] * (1.0 - 1e-12):
            x = bound[m] * normal[m, 0]
            y = bound[m] * normal[m, 1]
        out[m, 0] = x
        out[m, 1] = y


@jit
def near_residual(
    v: np.ndarray,
    places: np.ndarray,
    slip: np.ndarray,
    normal: np.ndarray,
    share: np.ndarray,
    damping: np.ndarray,
    out: np.ndarray,
) -> None:
    """Residuals v [2 m] as slips into out [px py, 2]: of stick cells and, across the bound, of those that hardly slip.

    The latter have a damping [m] above zero (`slip_damping`); their rows are share [m] times slips. Zero elsewhere.
    """
    out[:, :] = 0.0
    for m in range(places.size):
        if not slip[m]:
            out[places[m], 0] = v[2 * m]
            out[places[m], 1] = v[2 * m + 1]
        elif damping[m] > 0.0:
            out[places[m], 0] = -normal[m, 1] * v[2 * m + 1] / share[m]
            out[places[m], 1] = normal[m, 0] * v[2 * m + 1] / share[m]


@jit
def integrate_rows(
    slips: np.ndarray,
    cells: np.ndarray,
    places: np.ndarray,
    slip: np.ndarray,
    normal: np.ndarray,
    damping: np.ndarray,
    dx: float,
    edge: np.ndarray,
    out: np.ndarray,
) -> None:
    """Displacements that invert the upwind difference: sums of dx slips from each row's leading edge on.

    slips [px py, 2]: residuals (`near_residual`); cells are ordered by i, so that going backwards leads from the
    leading edge to the trailing one. At a slip cell only the displacement across the bound is carried on, times damping
    [m]. Result in the cells' places of out [px py, 2], which may be slips itself; edge [py, 2]: work array.
    """
    edge[:, :] = 0.0
    for m in range(cells.shape[0] - 1, -1, -1):
        k, j = places[m], cells[m, 1]
        x, y = edge[j, 0] + dx * slips[k, 0], edge[j, 1] + dx * slips[k, 1]
        if slip[m]:
            tx, ty = -normal[m, 1], normal[m, 0]
            t = (tx * x + ty * y) * damping[m]
            x, y = t * tx, t * ty
        edge[j, 0] = out[k, 0] = x
        edge[j, 1] = out[k, 1] = y


@jit
def store_near(
    field: np.ndarray,
    v: np.ndarray,
    places: np.ndarray,
    slip: np.ndarray,
    normal: np.ndarray,
    damping: np.ndarray,
    unit: float,
    out: np.ndarray,
    known: np.ndarray,
) -> None:
    """Unknowns out [2 m] of stick cells and tau of those that hardly slip from field [px py, 2]; a/unit from v [2 m].

    The equation of a/unit is the identity, so it equals its residual; tau of other slip cells is set to zero. damping
    [m]: as in `near_residual`. The same tractions, as vectors, go into known [px py, 2] at the cells' places.
    """
    for m in range(places.size):
        k = places[m]
        x, y = field[k, 0], field[k, 1]
        if slip[m]:
            nx, ny = normal[m, 0], normal[m, 1]
            a, tau = unit * v[2 * m], 0.0
            if damping[m] > 0.0:
                tau = nx * y - ny * x
            out[2 * m] = v[2 * m]
            out[2 * m + 1] = tau
            x, y = a * nx - tau * ny, a * ny + tau * nx
        else:
            out[2 * m] = x
            out[2 * m + 1] = y
        known[k, 0] = x
        known[k, 1] = y


@jit
def slip_residual(
    field: np.ndarray,
    v: np.ndarray,
    places: np.ndarray,
    slip: np.ndarray,
    normal: np.ndarray,
    root: np.ndarray,
    diagonal: float,
    found: np.ndarray,
    out: np.ndarray,
) -> None:
    """Residuals v of slip cells across the bound, as vectors, less what unknowns found [2 m] contribute to them.

    field [px py, 2]: slips by the tractions found; diagonal: b. The residuals are divided by root [m], the root of the
    cell's share, and go into the cells of out [px py, 2], zero in stick cells.
    """
    for m in range(places.size):
        k = places[m]
        if slip[m]:
            tx, ty, c = -normal[m, 1], normal[m, 0], root[m] * root[m]
            by_found = c * (tx * field[k, 0] + ty * field[k, 1]) + (1.0 - c) * diagonal * found[2 * m + 1]
            rest = (v[2 * m + 1] - by_found) / root[m]
            out[k, 0] = rest * tx
            out[k, 1] = rest * ty
        else:
            out[k, 0] = 0.0
            out[k, 1] = 0.0


@jit
def of_line_ahead(weight: np.ndarray, m: int) -> float:
    """Weight of the cell ahead, from weight [3, m] of `centring.centre`; the second one is extrapolated linearly."""
    return weight[0, m] + 2.0 * weight[2, m]


@jit
def centred_slip_residual(
    field: np.ndarray,
    v: np.ndarray,
    places: np.ndarray,
    slip: np.ndarray,
    normal: np.ndarray,
    root: np.ndarray,
    diagonal: float,
    found: np.ndarray,
    neighbours: np.ndarray,
    weight: np.ndarray,
    work: np.ndarray,
    out: np.ndarray,
) -> None:
    """As `slip_residual` for rows with slips at the cells' centres, with the effect of the centring removed.

    Rows of slip cells are c m.C s + (1 - c) b tau, C being the centring, s = B q. The residuals that remain are divided
    by 1 + c (C - 1), tridiagonal along each row of cells: as B is locally close to b, rows become
    c m.s + (1 - c) b tau, for which the inverse of B + d is meant. neighbours [2, m], weight [3, m]: as in
    `centring.centre`, the slip of the second cell ahead being extrapolated linearly; the cells are ordered from the
    trailing ends of rows to the leading ones; work [2, m]: remaining residuals and pivots of slip cells.
    """
    rest, pivot = work[0], work[1]
    for m in range(places.size):
        if not slip[m]:
            continue
        k, ahead, behind = places[m], neighbours[0, m], neighbours[1, m]
        c, of_ahead, of_behind = root[m] * root[m], of_line_ahead(weight, m), weight[1, m]
        x, y = field[k, 0], field[k, 1]
        i, n = places[ahead], places[behind]
        x += of_ahead * (field[i, 0] - field[k, 0]) + of_behind * (field[n, 0] - field[k, 0])
        y += of_ahead * (field[i, 1] - field[k, 1]) + of_behind * (field[n, 1] - field[k, 1])
        rest[m] = v[2 * m + 1] - c * (normal[m, 0] * y - normal[m, 1] * x) - (1.0 - c) * diagonal * found[2 * m + 1]
        pivot[m] = 1.0 - c * (of_ahead + of_behind)
        if behind != m and slip[behind]:
            turned = normal[m, 0] * normal[behind, 0] + normal[m, 1] * normal[behind, 1]
            factor = c * of_behind * turned / pivot[behind]
            rest[m] -= factor * rest[behind]
            pivot[m] -= factor * turned * root[behind] * root[behind] * of_line_ahead(weight, behind)
    for m in range(places.size - 1, -1, -1):
        k = places[m]
        if slip[m]:
            ahead = neighbours[0, m]
            if ahead != m and slip[ahead]:
                turned = normal[m, 0] * normal[ahead, 0] + normal[m, 1] * normal[ahead, 1]
                rest[m] -= root[m] * root[m] * of_line_ahead(weight, m) * turned * rest[ahead]
            rest[m] /= pivot[m]
            out[k, 0] = -normal[m, 1] * rest[m] / root[m]
            out[k, 1] = normal[m, 0] * rest[m] / root[m]
        else:
            out[k, 0] = 0.0
            out[k, 1] = 0.0


@jit
def gather_slip_traction(
    field: np.ndarray, places: np.ndarray, slip: np.ndarray, normal: np.ndarray, root: np.ndarray, out: np.ndarray
) -> None:
    """Component across the bound of field [px py, 2], times root [m], added to the tau of slip cells in out [2 m]."""
    for m in range(places.size):
        if slip[m]:
            k = places[m]
            out[2 * m + 1] += root[m] * (normal[m, 0] * field[k, 1] - normal[m, 1] * field[k, 0])
