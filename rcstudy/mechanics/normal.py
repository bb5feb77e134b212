"""Pressure of a frictionless contact under a given load.

Find p >= 0 with gap = h + A p - approach >= 0, p gap = 0 and sum(p) dx dy = load (the paper's Eqs 1 to 4). The
equivalent quadratic programme is solved by conjugate gradients that keep p >= 0 and the load (Polonsky and Keer 1999),
preconditioned by the inverse symbol of the operator (Vollebregt 2014, NormCG), on a box around the contact. Under
layers that bend like plates they converge slowly; the rim of the contact is then eliminated directly (`rim.py`).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from rcstudy.mechanics.convolution import Box, transform
from rcstudy.mechanics.exact import contact_modulus, hertz_contact
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.kernels import arrays, pressure
from rcstudy.mechanics.layered import BeyondRounding, frequency_response, half_space_response
from rcstudy.mechanics.normal_operator import NormalOperator, NormalSolution
from rcstudy.mechanics.rim import RimSolver
from rcstudy.mechanics.scene import Layer, Material, Scene
from rcstudy.mechanics.stopping import pressure_residual

_MAX_ITERATIONS = 400
_MARGIN = 1.35  # half the sides of the first box, over the estimated semi-axes
LEAST_TOLERANCE = 0.1  # over `attainable`: for less no step is taken (residuals end at 0.1 to 20 of it)
_PLATE = 5.0  # compliance to long waves over that to short ones from which on the rim is eliminated directly


def initial_gap(scene: Scene) -> np.ndarray:
    """Undeformed distance h = x^2/(2 Rx) + y^2/(2 Ry) at the cell centres (mm), [nx, ny].

    Johnson 1985, section 4.1.
    """
    x, y = scene.mesh.centres
    gap: np.ndarray = (x**2 / (2.0 * scene.radius[0]))[:, None] + (y**2 / (2.0 * scene.radius[1]))[None, :]
    return gap


def estimated_contact(scene: Scene) -> tuple[float, float]:
    """Semi-axes (mm) of the contact by Hertz's theory with an equivalent modulus (`_estimate`); a first guess only.

    BeyondRounding if rounding leaves no positive compliance of the layers.
    """
    return _estimate(scene.substrate, scene.layers, scene.counterbody, scene.radius, scene.load)


def semi_axes_in_cells(scene: Scene) -> tuple[float, float]:
    """Semi-axes of `estimated_contact` over the sides of a cell of `scene`."""
    (ax, ay), (dx, dy) = estimated_contact(scene), scene.mesh.spacing
    return ax / dx, ay / dy


@lru_cache(maxsize=256)
def _estimate(
    substrate: Material,
    layers: tuple[Layer, ...],
    counterbody: Material | None,
    radius: tuple[float, float],
    load: float,
) -> tuple[float, float]:
    """Semi-axes (mm) of the contact by Hertz's theory, with the bodies' modulus for waves of the contact's own size.

    A half-space has a(alpha) = 2/(E* alpha). For a layered body this defines an E* at alpha = 2/size, size being the
    geometric mean of the semi-axes, which is found by iteration from that on the bare substrate. BeyondRounding if
    rounding leaves no positive compliance. Exact without layers. With them it is a first guess only: errors are 6 % in
    95 of 100 contacts and 17 % at most with layers of a fifth to five times the substrate's modulus, 29 and 36 % with
    incompressible ones of 1e-5 to 0.3 of it (too small), 25 and 54 % with stiff plates of 3 to 1000 times it.
    """
    extra = half_space_response(counterbody)[0] if counterbody is not None else 0.0
    semi_axes = hertz_contact(radius, load, contact_modulus(substrate, counterbody)).a
    size = math.sqrt(semi_axes[0] * semi_axes[1])
    for _ in range(60):
        alpha = np.array([2.0 / size])
        compliance = frequency_response(substrate, layers, alpha)[0] + extra / alpha
        if not compliance[0] > 0.0:
            raise BeyondRounding
        modulus = float(2.0 / (compliance * alpha)[0])
        semi_axes = hertz_contact(radius, load, modulus).a
        previous, size = size, math.sqrt(semi_axes[0] * semi_axes[1])
        if abs(size - previous) < 1e-3 * size:
            break
    return semi_axes


def solve_pressure(
    scene: Scene, influence: Influence, gap: np.ndarray, guess: np.ndarray | None = None
) -> NormalSolution:
    """Pressure and approach of `scene`, on its window, to the tolerance `scene.tolerance.normal`.

    `influence`: the bodies' coefficients on the scene's mesh; `gap` [nx, ny]: undeformed distance (mm), including
    any displacement by tractions; `guess` [nx, ny] (MPa): a pressure to start from, by default a Hertzian one within
    `estimated_contact`.
    """
    nx, ny = scene.mesh.cells
    dx, dy = scene.mesh.spacing
    x, y = scene.mesh.centres
    if guess is None:
        ax, ay = estimated_contact(scene)
        guess = np.sqrt(np.clip(1.0 - ((x / ax) ** 2)[:, None] - ((y / ay) ** 2)[None, :], 0.0, None))
        inside = (np.abs(x) <= _MARGIN * ax + 2 * dx)[:, None] & (np.abs(y) <= _MARGIN * ay + 2 * dy)[None, :]
        box = Box.around(inside)
        if not guess.any():  # a contact smaller than a cell: start from the cells nearest to its centre
            guess = (gap <= gap.min() * (1.0 + 1e-12)).astype(float)
    else:
        box = Box.around(guess > 0.0)
        box = box.wider(16, (nx, ny))
    p = guess * (scene.load / (guess.sum() * dx * dy))
    found: NormalSolution | None = None
    while True:
        found = _on_box(scene, influence, box, gap[box.slices], np.ascontiguousarray(p[box.slices])).after(found)
        p = np.zeros((nx, ny))
        p[box.slices] = found.p
        touched = Box.around(p > 0.0)
        if clear_of_sides(touched, box, (nx, ny)):
            break
        box = touched.wider(2, (nx, ny))
    return replace(found, p=p, edge=at_edge(touched, (nx, ny)))


def clear_of_sides(touched: Box, box: Box, window: tuple[int, int]) -> bool:
    """Whether the cells in contact, bounded by `touched`, stay clear of the sides of `box` inside the window."""
    nx, ny = window
    return (
        (touched.i0 > box.i0 or box.i0 == 0)
        and (touched.i1 < box.i1 or box.i1 == nx)
        and (touched.j0 > box.j0 or box.j0 == 0)
        and (touched.j1 < box.j1 or box.j1 == ny)
    )


def at_edge(touched: Box, window: tuple[int, int]) -> bool:
    """Whether the cells in contact, bounded by `touched`, reach the edge of a window of `window` cells."""
    return touched.i0 == 0 or touched.j0 == 0 or touched.i1 == window[0] or touched.j1 == window[1]


def _on_box(scene: Scene, influence: Influence, box: Box, gap: np.ndarray, p: np.ndarray) -> NormalSolution:
    """The pressure on one box, starting from `p`: with the rim eliminated under plates, else by conjugate gradients."""
    total = scene.load / (scene.mesh.spacing[0] * scene.mesh.spacing[1])
    tolerance = scene.tolerance.normal
    operator = NormalOperator.of(influence, box.shape)
    first: NormalSolution | None = None
    if influence.once(("bends", box.shape), lambda: _bends(influence, box.shape)):
        solver = RimSolver(operator, gap, p, total)
        if tolerance >= LEAST_TOLERANCE * solver.attainable:
            first = solver.solve(pressure_residual(tolerance, solver.attainable, int(np.count_nonzero(p))))
            if first.converged or tolerance < first.attainable:
                return first
            p = first.p
    return _conjugate_gradients(operator, gap, p, total, tolerance).after(first)


def _bends(influence: Influence, shape: tuple[int, int]) -> bool:
    """Whether layers bend like plates under pressure, on a box of `shape` cells."""
    return influence.contrast(shape, influence.normal_response) > _PLATE


def _conjugate_gradients(
    operator: NormalOperator, gap: np.ndarray, p: np.ndarray, total: float, tolerance: float
) -> NormalSolution:
    """Pressures of sum `total` (MPa) on one box by bound-constrained conjugate gradients from pressures `p`."""
    shape = gap.shape
    plan = transform(operator.padded, 1, shape[0])
    mask = np.zeros(shape, dtype=np.bool_)
    r, r_old, d = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    p = p * (total / p.sum())
    g = gap + operator.displacement(p)
    products = 1
    inside = p > 0.0
    approach = float(g[inside].mean())
    attainable = operator.attainable(gap, g, p)
    stop = pressure_residual(tolerance, attainable, int(np.count_nonzero(inside)))
    zr = 0.0
    residual = np.inf
    converged = False
    iteration = 0
    steps = _MAX_ITERATIONS if tolerance >= LEAST_TOLERANCE * attainable else 0
    while iteration < steps:
        approach, entered = pressure.normal_residual(p, g, approach, mask, r, r_old, plan.real[0])
        plan.forward()
        arrays.scale_real(plan.hat[0], operator.inverse)
        plan.backward()
        products += 1
        zr, z_norm = pressure.normal_direction(plan.real[0], mask, r, r_old, d, zr)
        residual = z_norm / arrays.norm2(p)
        # in a contact of few cells the last change of the approach may bring another cell into contact
        overlap = operator.overlap(tolerance, approach, p)
        converged = bool(residual <= tolerance and entered == 0 and not (g[~mask] < approach - overlap).any())
        if converged and residual <= stop:
            break
        plan.forward()
        arrays.scale_real(plan.hat[0], operator.real)
        plan.backward()
        products += 1
        cut, scale = pressure.normal_step(p, g, d, plan.real[0], r, total)
        iteration += 1
        if cut:
            g = gap + operator.displacement(p)
            products += 1
        elif scale != 1.0:
            g = gap + scale * (g - gap)
    return NormalSolution(p, approach, residual, iteration, products, converged, attainable)
