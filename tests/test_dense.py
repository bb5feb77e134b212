"""What stands on the kernels, convolutions to solvers, against dense twins (`naive.py`) on small contacts."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import naive
import numpy as np
import pytest

from rcstudy.mechanics import cascade, influence
from rcstudy.mechanics.contact import NormalContact, solve_normal, solve_rolling
from rcstudy.mechanics.convolution import (
    Box,
    PairOperator,
    PairTransform,
    ShiftedTransform,
    Transform,
    convolve,
    difference_symbols,
    good_length,
    padded_around,
    padded_shape,
    real_symbols,
    symbols,
    traction_quadrants,
    transform,
)
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.kernels import arrays, tractions
from rcstudy.mechanics.normal import clear_of_sides, estimated_contact, initial_gap, solve_pressure
from rcstudy.mechanics.numerics.krylov import gmres
from rcstudy.mechanics.paper_cg import solve_paper_cg
from rcstudy.mechanics.rolling import NewtonSystem, rigid_slip, solve_tractions
from rcstudy.mechanics.scene import Creepage, Layer, Material, Mesh, Scene, Tolerance
from rcstudy.mechanics.slip_operator import SlipOperator, from_leading_edge
from rcstudy.mechanics.wrapped import _principal, _responses, positive_tractions

STEEL = Material(210000.0, 0.3)
SOFT = Material(70000.0, 0.2)
COATED = (Layer(105000.0, 0.35, 0.06), Layer(420000.0, 0.25, 0.03))
PLATE = (Layer(4200000.0, 0.25, 0.03), Layer(1050000.0, 0.3, 0.02))
COMPONENTS = ("zz", "xx", "yy", "xy", "xp", "yp")  # of influence coefficients, p: by pressure
PARITIES = [(1, 1), (1, -1), (-1, 1), (-1, -1)]
SHAPES = [(1, 1), (1, 7), (6, 1), (5, 4), (7, 6), (2, 9)]


def influence_of(bodies: naive.Bodies) -> Influence:
    """The coefficients under test of the twin's bodies."""
    return Influence(bodies.substrate, bodies.layers, bodies.counterbody, bodies.spacing, 4.0)


# --- convolutions ---


def test_good_length() -> None:
    """Factors 2, 3, 5, 7 and nothing else; no shorter than asked, and longer by a quarter, or four, at most."""
    for n in range(1, 700):
        rest = good_length(n)
        assert n <= rest <= max(n + 4, 1.25 * n)
        for factor in (2, 3, 5, 7):
            while rest % factor == 0:
                rest //= factor
        assert rest == 1


@pytest.mark.parametrize(
    ("window", "held"),
    [
        ((12, 9), Box(4, 8, 3, 7)),
        ((12, 9), Box(0, 3, 6, 9)),  # in a corner
        ((7, 10), Box(0, 7, 0, 10)),
        ((9, 8), Box(5, 6, 2, 3)),
        ((1, 5), Box(0, 1, 1, 3)),
        ((1, 1), Box(0, 1, 0, 1)),
    ],
)
def test_padded_around_holds_a_convolution_of_what_is_not_zero(window: tuple[int, int], held: Box) -> None:
    rng = np.random.default_rng(3)
    source = np.zeros(window)
    source[held.slices] = rng.standard_normal(held.shape)
    padded = padded_around(held, Box(0, window[0], 0, window[1]))
    quadrant = rng.standard_normal((padded[0] // 2 + 2, padded[1] // 2 + 2))
    found = convolve(symbols([(quadrant, (1, 1))], padded)[0], padded, source)
    expected = np.zeros(window)
    for i, j in np.argwhere(source != 0.0):
        offsets = np.ix_(abs(np.arange(window[0]) - i), abs(np.arange(window[1]) - j))
        expected += source[i, j] * quadrant[offsets]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * abs(expected).max())


@pytest.mark.parametrize("box", [(1, 1), (1, 6), (13, 20), (64, 31)])
def test_padded_shape_holds_a_linear_convolution(box: tuple[int, int]) -> None:
    assert padded_shape(box) == (good_length(2 * box[0] - 1), good_length(2 * box[1] - 1))


@pytest.mark.parametrize(
    ("padded", "fields", "rows"),
    [((8, 6), 1, 5), ((9, 7), 2, 4), ((6, 8), 3, 6), ((5, 1), 1, 2), ((1, 4), 2, 1), ((12, 9), 2, 1)],
)
def test_transform(padded: tuple[int, int], fields: int, rows: int) -> None:
    """Forward and backward against NumPy's, over and over: nothing of one product is left for the next."""
    rng = np.random.default_rng(1)
    plan = Transform(padded, fields, rows)
    for _ in range(3):
        real = rng.normal(size=(fields, rows, padded[1]))
        plan.real[:] = real
        plan.forward()
        np.testing.assert_allclose(plan.hat, np.fft.rfft2(real, s=padded).transpose(0, 2, 1), atol=1e-12)
        other = rng.normal(size=(fields, *padded))
        plan.hat[:] = np.fft.rfft2(other).transpose(0, 2, 1)
        plan.backward()
        np.testing.assert_allclose(plan.real, math.prod(padded) * other[:, :rows], atol=1e-11)


@pytest.mark.parametrize("torus", [(1, 1), (4, 5), (6, 4)])
def test_pair_transform(torus: tuple[int, int]) -> None:
    """Forward and backward against NumPy's, over and over; what went forward is still there."""
    rng = np.random.default_rng(1)
    plan = PairTransform(torus)
    for _ in range(3):
        a, b = rng.normal(size=(2, *torus))
        pairs = np.stack([a, b], axis=-1).reshape(-1, 2)
        plan.field[:] = pairs
        plan.forward()
        np.testing.assert_allclose(plan.hat, np.fft.fft2(a + 1j * b).T, atol=1e-12)
        np.testing.assert_array_equal(plan.field, pairs)
        plan.hat[:] = np.fft.fft2(b + 1j * a).T
        plan.backward()
        np.testing.assert_allclose(plan.result, math.prod(torus) * pairs[:, ::-1], atol=1e-11)
        np.testing.assert_array_equal(plan.field, pairs)


def test_places_of_cells() -> None:
    """Where each plan has a cell's numbers: rows of constant x, or of constant y, one after the other."""
    cells = np.array([[0, 0], [0, 2], [3, 1], [4, 0]])
    i, j = cells.T
    numbers = np.random.default_rng(3).normal(size=(2, 6, 7))
    plan, moved, pairs = Transform((9, 7), 2, 6), ShiftedTransform((9, 8), 2, 7), PairTransform((6, 7))
    plan.real[:], moved.by_cell[:, :6, :] = numbers, numbers
    pairs.field[:] = numbers.reshape(2, -1).T
    for found in (
        plan.flat[:, plan.places(cells)],
        moved.flat[:, moved.places(cells)],
        pairs.field[pairs.places(cells)].T,
    ):
        np.testing.assert_array_equal(found, numbers[:, i, j])


@pytest.mark.parametrize("padded", [(1, 1), (4, 5), (5, 4), (8, 6), (9, 1)])
def test_symbols(padded: tuple[int, int]) -> None:
    rng = np.random.default_rng(2)
    quadrants = [(rng.normal(size=(padded[0] // 2 + 2, padded[1] // 2 + 1)), parity) for parity in PARITIES]
    plain, differenced = symbols(quadrants, padded), difference_symbols(quadrants, padded, 0.3)
    for k, (quadrant, parity) in enumerate(quadrants):
        expected = np.fft.rfft2(naive.torus(quadrant, parity, padded)) / math.prod(padded)
        np.testing.assert_allclose(plain[k].T, expected, atol=1e-14)
        expected = np.fft.rfft2(naive.torus_difference(quadrant, parity, 0.3, padded)) / math.prod(padded)
        np.testing.assert_allclose(differenced[k].T, expected, atol=1e-14)


@pytest.mark.parametrize("parity", PARITIES)
@pytest.mark.parametrize("shape", SHAPES)
def test_convolve(shape: tuple[int, int], parity: tuple[int, int]) -> None:
    """Linear, not circular: four loops over the cells, with and without the upwind difference."""
    rng = np.random.default_rng(3)
    padded = padded_shape(shape)
    quadrant = rng.normal(size=(padded[0] // 2 + 2, padded[1] // 2 + 1))
    if parity[0] < 0:
        quadrant[0] = 0.0
    if parity[1] < 0:
        quadrant[:, 0] = 0.0
    for _ in range(2):
        field = rng.normal(size=shape)
        found = convolve(symbols([(quadrant, parity)], padded)[0], padded, field)
        np.testing.assert_allclose(found, naive.direct_convolution(quadrant, parity, field), atol=1e-12)
        found = convolve(difference_symbols([(quadrant, parity)], padded, 0.3)[0], padded, field)
        np.testing.assert_allclose(found, naive.direct_difference(quadrant, parity, 0.3, field), atol=1e-12)


# --- influence coefficients ---

BODIES = {
    "rigid": naive.Bodies(STEEL, (), None, (0.05, 0.05)),
    "equal": naive.Bodies(STEEL, (), STEEL, (0.04, 0.06)),
    "unequal": naive.Bodies(STEEL, (), SOFT, (0.05, 0.03)),
    "layered": naive.Bodies(STEEL, COATED, None, (0.05, 0.04)),
    "layered, unequal": naive.Bodies(STEEL, COATED, SOFT, (0.04, 0.05)),
    # kernels that fall off within a few cells: 1e-8 off with the points that serve others
    "soft on stiff": naive.Bodies(STEEL, (Layer(2100.0, 0.499, 0.04), Layer(1e7, 0.3, 0.2)), None, (0.04, 0.04)),
    "stiff on soft": naive.Bodies(STEEL, (Layer(1e7, 0.499, 0.08), Layer(2100.0, 0.499, 0.05)), None, (0.02, 0.12)),
}


@pytest.mark.parametrize("name", BODIES)
def test_influence(name: str) -> None:
    """Nothing is shared with the twin, down to the frequency responses. 2e-10 of the largest of each (found: 5e-11)."""
    bodies = BODIES[name]
    offsets = np.argwhere(np.ones((8, 9), dtype=bool))
    expected = bodies.coefficients(offsets).reshape(6, 8, 9)
    found = influence_of(bodies).quadrant(8, 9)[:, :8, :9]
    off = {}
    for component, values, wanted in zip(COMPONENTS, found, expected, strict=True):
        off[component] = float(np.abs(values - wanted).max() / max(np.abs(wanted).max(), 1e-3 * expected[0].max()))
    assert not {component: worst for component, worst in off.items() if not worst <= 2e-10}


def thin_and_soft(rng: np.random.Generator) -> np.ndarray:
    """Coefficients [6, 20, 20] of one to four layers, down to a hundredth of a cell and of Es, on cells up to 10:1."""
    layers = tuple(
        Layer(STEEL.E * 10.0 ** rng.uniform(-2, 2), float(rng.choice([0, 0.3, 0.499, 0.5])), 10.0 ** rng.uniform(-2, 1))
        for _ in range(rng.integers(1, 5))
    )
    spacing = 1.0, float(rng.choice([0.1, 0.3, 1.0, 3.0, 10.0]))
    return Influence(STEEL, layers, None, spacing, 30.0 * math.hypot(*spacing)).quadrant(20, 20)


@pytest.mark.heavy
def test_influence_of_thin_and_soft_layers_by_more_points(monkeypatch: pytest.MonkeyPatch) -> None:
    """Too much for the naive twin. 1e-9 of the largest, by finer tables and two to four times as many points.

    By 3 x 3 points and 16 angles in all some were 1e-5 off.
    """
    found = [thin_and_soft(np.random.default_rng(seed)) for seed in range(40)]
    monkeypatch.setattr(influence, "_LOG_STEP", 0.02)
    monkeypatch.setattr(influence, "_PIECE", 0.4)
    monkeypatch.setattr(influence, "_RINGS", {0.0: 12, 8.0: 8})
    for seed, few in enumerate(found):
        many = thin_and_soft(np.random.default_rng(seed))
        assert np.abs(few - many).max() <= 1e-9 * many[:3].max(axis=(1, 2)).min()


@pytest.mark.heavy
@pytest.mark.parametrize("nu", [0.3, 0.5])
@pytest.mark.parametrize("counterbody", [None, STEEL])
def test_influence_far_from_very_soft_films(nu: float, counterbody: Material | None) -> None:
    """1e-6 of the stiffness, 1e-3 of a cell thick: pressure 20 to 180 cells away acts as without it.

    The layers' contribution cancels nearly all that of half-spaces of their own; 1e-4 to 1e-3 were off with as many
    points as are enough elsewhere.
    """
    film = Layer(1e-6 * STEEL.E, nu, 1e-5)
    found, bare = (
        Influence(STEEL, layers, counterbody, (0.01, 0.01), 2.0).quadrant(128, 128)[0, 20:128, :128]
        for layers in ((film,), ())
    )
    np.testing.assert_allclose(found, bare, rtol=5e-5)  # rounding errors of what cancels


@pytest.mark.parametrize("name", ["unequal", "layered"])
@pytest.mark.parametrize("requests", [[(2, 3), (4, 3), (4, 9), (9, 9)], [(9, 2), (1, 9)], [(1, 1), (6, 7), (9, 9)]])
def test_influence_grows_without_a_trace(name: str, requests: list[tuple[int, int]]) -> None:
    """To the last bit, whatever was asked for before; arrays handed out earlier stay as they were."""
    at_once = influence_of(BODIES[name]).quadrant(9, 9)
    assert at_once.shape == (6, 9, 9)
    grown = influence_of(BODIES[name])
    for request in requests:
        part = grown.quadrant(*request)
        copy = part.copy()
        grown.coarser().quadrant(3, 3)
        nx, ny = part.shape[1:]
        assert nx >= request[0]
        assert ny >= request[1]
        np.testing.assert_array_equal(part, at_once[:, :nx, :ny])
    np.testing.assert_array_equal(grown.quadrant(9, 9), at_once)
    np.testing.assert_array_equal(part, copy)


@pytest.mark.parametrize("name", ["unequal", "layered, unequal"])
def test_coarser_influence(name: str) -> None:
    """Cells of twice and four times the size; 1e-11: where the radial tables end depends on the cell's size."""
    bodies = BODIES[name]
    dx, dy = bodies.spacing
    base = influence_of(bodies)
    for factor, coarse in ((2.0, base.coarser()), (4.0, base.coarser().coarser())):
        assert coarse.spacing == (factor * dx, factor * dy)
        expected = influence_of(replace(bodies, spacing=coarse.spacing)).quadrant(5, 4)
        np.testing.assert_allclose(coarse.quadrant(5, 4), expected, rtol=0.0, atol=1e-11 * expected.max())
    np.testing.assert_array_equal(base.quadrant(3, 3), influence_of(bodies).quadrant(3, 3))


class Interrupting:
    """Components whose number is asked for in vain: Ctrl-C comes first."""

    def __len__(self) -> int:
        raise KeyboardInterrupt


def test_an_interrupt_leaves_no_coarser_influence_half_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """It would be taken for whole, and belong to cells of two sizes."""
    base = influence_of(BODIES["layered, unequal"])
    base.quadrant(5, 4)
    with monkeypatch.context() as interrupted, pytest.raises(KeyboardInterrupt):
        interrupted.setattr(influence, "COMPONENTS", Interrupting())
        base.coarser()
    expected = influence_of(BODIES["layered, unequal"]).coarser().quadrant(5, 4)
    np.testing.assert_array_equal(base.coarser().quadrant(5, 4), expected)
    assert base.coarser() is base.coarser()


# --- Krylov ---


class Counted:
    """A dense product that counts its calls."""

    def __init__(self, matrix: np.ndarray) -> None:
        self.matrix = matrix
        self.calls = 0

    def __call__(self, v: np.ndarray, out: np.ndarray) -> None:
        self.calls += 1
        out[:] = self.matrix @ v


@pytest.mark.parametrize("steps", [1, 2, 5, 9])
def test_gmres_minimises_over_the_krylov_space(steps: int) -> None:
    rng = np.random.default_rng(4)
    n = 12
    a, m = np.eye(n) + 0.4 * rng.normal(size=(n, n)), np.eye(n) + 0.2 * rng.normal(size=(n, n))
    b = rng.normal(size=n)
    apply, precondition = Counted(a), Counted(m)
    found, _ = gmres(apply, b, precondition, 0.0, steps)
    assert (apply.calls, precondition.calls) == (steps, steps)
    np.testing.assert_allclose(found, naive.least_squares_krylov(a, m, b, steps), rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize(("n", "steps"), [(40, 17), (40, 39), (90, 80)])
def test_gmres_finds_room_for_many_steps(n: int, steps: int) -> None:
    """More steps than it makes room for at first, once and twice over: the solution all the same."""
    rng = np.random.default_rng(6)
    a = np.diag(np.linspace(1.0, 1.2, n)) + 0.01 * rng.normal(size=(n, n))
    m = np.diag(rng.choice([0.05, 1.0, 20.0], size=n))  # so bad that all of the steps are needed
    b = rng.normal(size=n)
    apply = Counted(a)
    found, _ = gmres(apply, b, Counted(m), 0.0, steps)
    expected = naive.least_squares_krylov(a, m, b, steps)
    assert apply.calls == steps
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())


def test_gmres_gives_more_rows_of_its_products() -> None:
    """Rows beyond the system's: their product with the solution; in the same room system after system."""
    rng = np.random.default_rng(7)
    for n, extra, steps in ((40, 3, 39), (40, 3, 5), (40, 0, 5), (30, 4, 20)):
        a, m = np.eye(n) + 0.1 * rng.normal(size=(n, n)), np.diag(rng.choice([0.05, 1.0, 20.0], size=n))
        rows, b = rng.normal(size=(extra, n)), rng.normal(size=n)
        x, more = gmres(Counted(np.vstack([a, rows])), b, Counted(m), 0.0, steps, extra)
        alone, _ = gmres(Counted(a), b, Counted(m), 0.0, steps)
        np.testing.assert_allclose(x, alone, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(more, rows @ x, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("relative", [0.5, 1e-2, 1e-9])
def test_gmres_stops_in_time(relative: float) -> None:
    """At the first residual that is small enough for the right-hand side, by the residuals themselves."""
    rng = np.random.default_rng(5)
    n = 14
    a, m = np.eye(n) + 0.3 * rng.normal(size=(n, n)), np.eye(n) + 0.2 * rng.normal(size=(n, n))
    b = 40.0 * rng.normal(size=n)
    apply = Counted(a)
    gmres(apply, b, Counted(m), relative, n)
    residuals = [np.linalg.norm(b - a @ naive.least_squares_krylov(a, m, b, k)) for k in range(1, n)]
    enough = relative * np.linalg.norm(b)
    assert apply.calls == next((k for k, r in enumerate(residuals, start=1) if r <= enough), n)


def test_gmres_of_nothing_is_nothing() -> None:
    apply, precondition = Counted(np.eye(5)), Counted(np.eye(5))
    x, more = gmres(apply, np.zeros(5), precondition, 1e-3, 5, extra=3)
    np.testing.assert_array_equal(x, np.zeros(5))
    np.testing.assert_array_equal(more, np.zeros(3))
    assert (apply.calls, precondition.calls) == (0, 0)


# --- pressure ---

NORMAL = {
    "sphere": Scene(STEEL, (50.0, 50.0), 100.0, Mesh((0.8, 0.8), (14, 14))),
    "odd, oblong cells": Scene(STEEL, (50.0, 30.0), 80.0, Mesh((0.7, 0.75), (13, 11)), counterbody=SOFT),
    "layered": Scene(STEEL, (40.0, 50.0), 60.0, Mesh((0.6, 0.7), (12, 13)), layers=COATED),
    "layered on soft": Scene(STEEL, (40.0, 50.0), 60.0, Mesh((0.6, 0.7), (11, 12)), layers=COATED, counterbody=SOFT),
    "one row": Scene(STEEL, (50.0, 50.0), 5.0, Mesh((0.8, 0.05), (15, 1))),
    "one column": Scene(STEEL, (50.0, 50.0), 5.0, Mesh((0.05, 0.8), (1, 15))),
    "one cell": Scene(STEEL, (50.0, 50.0), 1.0, Mesh((0.05, 0.05), (1, 1))),
    "plate": Scene(STEEL, (40.0, 50.0), 60.0, Mesh((0.5, 0.55), (14, 13)), layers=PLATE),
    "one row of a plate": Scene(STEEL, (50.0, 50.0), 5.0, Mesh((0.8, 0.05), (15, 1)), layers=PLATE),
    "four cells of many": Scene(STEEL, (50.0, 50.0), 0.001, Mesh((2.0, 2.0), (12, 12))),
    "over the edge": Scene(STEEL, (50.0, 50.0), 100.0, Mesh((0.4, 0.36), (9, 8))),
}


@cache
def window_matrix(name: str) -> np.ndarray:
    """u_z by p on all the window's cells."""
    scene = NORMAL[name]
    cells = np.argwhere(np.ones(scene.mesh.cells, dtype=bool))
    bodies = naive.Bodies(scene.substrate, scene.layers, scene.counterbody, scene.mesh.spacing)
    matrix: np.ndarray = bodies.matrices(cells, cells)[0]
    return matrix


@pytest.mark.parametrize("sides", [(2, 9, 4, 8), (0, 9, 4, 8), (2, 12, 4, 8), (2, 9, 0, 8), (2, 9, 4, 10)])
def test_a_contact_that_reaches_any_side_of_its_box_needs_a_larger_one(sides: tuple[int, int, int, int]) -> None:
    """Unless that is a side of the window, beyond which there are no cells."""
    i0, i1, j0, j1 = sides
    box, window = Box(*sides), (12, 10)
    assert clear_of_sides(Box(i0 + 1, i1 - 1, j0 + 1, j1 - 1), box, window)
    for k, at_window in enumerate((i0 == 0, i1 == 12, j0 == 0, j1 == 10)):
        touched = [i0 + 1, i1 - 1, j0 + 1, j1 - 1]
        touched[k] = sides[k]
        assert clear_of_sides(Box(*touched), box, window) == at_window


def check_pressure(name: str, gap: np.ndarray, guess: np.ndarray | None = None) -> None:
    """The same cells in contact; pressure and approach to 1e-7: coefficients agree to 2e-8, the tolerance is 1e-10."""
    scene = replace(NORMAL[name], tolerance=Tolerance(1e-10, 1e-10))
    bodies = naive.Bodies(scene.substrate, scene.layers, scene.counterbody, scene.mesh.spacing)
    total = scene.load / math.prod(scene.mesh.spacing)
    p, approach = naive.pressure_by_active_set(window_matrix(name), gap.reshape(-1), total)
    solution = solve_pressure(scene, influence_of(bodies), gap, guess)
    assert solution.converged
    assert solution.residual <= 1e-10
    assert solution.products > solution.iterations >= 0
    np.testing.assert_array_equal(solution.p > 0.0, p.reshape(gap.shape) > 0.0)
    assert np.abs(solution.p - p.reshape(gap.shape)).max() <= 1e-7 * p.max()
    assert solution.approach == pytest.approx(approach, rel=1e-7)
    at_edge = np.pad(np.zeros((max(0, gap.shape[0] - 2), max(0, gap.shape[1] - 2))), 1, constant_values=1.0)
    at_edge = at_edge[: gap.shape[0], : gap.shape[1]]
    assert solution.edge == bool((solution.p * at_edge).any())


@pytest.mark.parametrize("name", NORMAL)
def test_pressure(name: str) -> None:
    """From the estimate, and from a guess that is wrong in place and size."""
    scene = NORMAL[name]
    gap = initial_gap(scene)
    x, y = scene.mesh.centres
    np.testing.assert_allclose(gap[-1, 0], x[-1] ** 2 / (2 * scene.radius[0]) + y[0] ** 2 / (2 * scene.radius[1]))
    check_pressure(name, gap)
    wrong = np.zeros(gap.shape)
    wrong[:2, -1:] = 1.0
    check_pressure(name, gap, wrong)


@pytest.mark.parametrize("name", ["sphere", "layered", "plate"])
def test_pressure_on_a_rough_gap(name: str) -> None:
    """Spots of contact, some of a single cell, far outside the estimate's box."""
    gap = initial_gap(NORMAL[name])
    gap += np.abs(np.random.default_rng(7).normal(scale=2.0 * gap.max(), size=gap.shape))
    check_pressure(name, gap)


@pytest.mark.parametrize("cells", [32, 64, pytest.param(256, marks=pytest.mark.heavy)])
@pytest.mark.parametrize("layers", [(), pytest.param((Layer(840000.0, 0.3, 0.1),), marks=pytest.mark.heavy)])
def test_steps_of_the_pressure(layers: tuple[Layer, ...], cells: int) -> None:
    """At most 12 at 1e-5 on meshes of any size. (Found: 5 to 10.)

    With the diagonal as preconditioner the solution is as good, after 18 steps on 64 cells and 40 on 256.
    """
    scene = Scene(STEEL, (50.0, 50.0), 100.0, Mesh((1.0, 1.0), (cells, cells)), layers, tolerance=Tolerance(1e-5, 1e-5))
    solution = solve_normal(scene).solution
    assert solution.converged and solution.iterations <= 12, f"{solution.iterations} steps"


# --- tractions ---


@cache
def twin(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cells [m, 2], their pressure [m] and the slip matrices [6, m, m] of an entry of CONTACTS."""
    bodies, shape, holes = CONTACTS[name]
    i, j = np.indices(shape)
    p = np.sqrt(np.clip(1.0 - ((2 * i + 1) / shape[0] - 1) ** 2 - ((2 * j + 1) / shape[1] - 1) ** 2, 0.0, None))
    p *= np.random.default_rng(8).random(shape) >= holes
    cells = np.argwhere(p > 0.0)
    return cells, 700.0 * p[p > 0.0], BODIES[bodies].slips(cells)


CONTACTS = {
    "round": ("rigid", (10, 10), 0.0),
    "oblong": ("unequal", (12, 8), 0.0),
    "equal": ("equal", (8, 11), 0.0),
    "layered": ("layered", (9, 10), 0.0),
    "layered on soft": ("layered, unequal", (10, 8), 0.0),
    "with holes": ("rigid", (11, 10), 0.3),
    "one row": ("layered", (12, 1), 0.0),
    "one column": ("rigid", (1, 9), 0.0),
    "one cell": ("unequal", (1, 1), 0.0),
}
CREEPAGES = {
    "longitudinal": Creepage(0.0006),
    "lateral": Creepage(0.0, -0.0006),
    "mixed": Creepage(0.0004, 0.0003, 0.002),
    "spin": Creepage(0.0, 0.0, 0.006),
    "full slip": Creepage(0.02, 0.01, 0.05),
    "full slip by spin": Creepage(0.0, 0.0, -2.0),
    "hardly any": Creepage(1e-6, 1e-6, 1e-6),
    "none": Creepage(),
}
FRICTION = 0.35


@cache
def operator_of(name: str) -> SlipOperator:
    """The slip operator of an entry of CONTACTS, which has to ask for all the coefficients it reads."""
    bodies, shape, _ = CONTACTS[name]
    return SlipOperator.of(influence_of(BODIES[bodies]), shape)


@cache
def dense_case(name: str, creep: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Bound [m], rigid slip with that by pressure [m, 2], and the twin's q, s [m, 2]."""
    creepage = CREEPAGES[creep]
    cells, p, matrices = twin(name)
    dx, dy = BODIES[CONTACTS[name][0]].spacing
    # the origin does not sit at the middle, so that nothing vanishes by symmetry
    x, y = (cells[:, 0] - 3.7) * dx, (cells[:, 1] - 4.1) * dy
    w = np.stack([creepage.longitudinal - creepage.spin * y, creepage.lateral + creepage.spin * (x + dx / 6.0)], axis=1)
    np.testing.assert_allclose(rigid_slip(x, y, creepage, dx / 6.0), w, rtol=1e-14, atol=1e-18)
    w += np.stack([matrices[4] @ p, matrices[5] @ p], axis=1)
    _, xx, yy, xy, _, _ = matrices
    q, s = naive.tractions_by_newton(np.block([[xx, xy], [xy, yy]]), FRICTION * p, w)
    return FRICTION * p, w, q, s


@pytest.mark.parametrize("creep", CREEPAGES)
@pytest.mark.parametrize("name", CONTACTS)
def test_tractions(name: str, creep: str) -> None:
    """Tractions and slips to 1e-8 of the bound and of the largest slip; the same cells slip.

    Coefficients agree to 2e-8 and better, the tolerance is 1e-11. Newton's method takes some five steps.
    """
    cells, _, _ = twin(name)
    shape = CONTACTS[name][1]
    bound, w, q, s = dense_case(name, creep)
    solution = solve_tractions(operator_of(name), cells, bound, w, 1e-11)
    assert solution.converged
    assert solution.residual <= 1e-11
    assert solution.iterations <= 10
    check_tractions(solution.q, solution.s, solution.slip, bound, w, q, s)
    if creep.startswith("full"):
        assert solution.slip.all()
    elif min(shape) > 1 and creep in ("longitudinal", "lateral", "mixed", "spin"):
        assert 0.1 < solution.slip.mean() < 0.9


def check_tractions(
    q: np.ndarray,
    s: np.ndarray,
    slip: np.ndarray,
    bound: np.ndarray,
    w: np.ndarray,
    q_twin: np.ndarray,
    s_twin: np.ndarray,
) -> None:
    """A solution against its twin's."""
    assert np.abs(q - q_twin).max() <= 1e-8 * bound.max()
    assert np.abs(s - s_twin).max() <= 1e-8 * np.abs(w).max()
    # by the size of the slip; near the limit of both a cell is free to be called either
    speed = np.hypot(*s_twin.T) / max(np.abs(w).max(), 1e-300)
    room = 1.0 - np.hypot(*q_twin.T) / bound
    np.testing.assert_array_equal(slip[speed > 1e-7], True)
    np.testing.assert_array_equal(slip[room > 1e-7], False)


@pytest.mark.parametrize("name", ["oblong", "layered", "one row"])
def test_tractions_do_not_depend_on_the_guess(name: str) -> None:
    """From tractions far off, some beyond the bound; the guess is left as it was."""
    cells, _, _ = twin(name)
    bound, w, q, s = dense_case(name, "mixed")
    guess = 2.0 * bound[:, None] * np.random.default_rng(9).uniform(-1.0, 1.0, size=q.shape)
    copy = guess.copy()
    solution = solve_tractions(operator_of(name), cells, bound, w, 1e-11, guess)
    assert solution.converged
    check_tractions(solution.q, solution.s, solution.slip, bound, w, q, s)
    np.testing.assert_array_equal(guess, copy)
    again = solve_tractions(operator_of(name), cells, bound, w, 1e-8, solution.q)
    assert again.iterations == 0
    np.testing.assert_array_equal(again.q, solution.q)


def newton_system(name: str, slipping: float, beyond: float = 0.1) -> tuple[NewtonSystem, np.ndarray]:
    """A Newton system in which the trailing `slipping` share of the rows slips, and its matrix by the twin.

    `beyond`: by how much q - rho s exceeds the bound at least, of the bound.
    """
    cells, _, matrices = twin(name)
    shape = CONTACTS[name][1]
    m = len(cells)
    system = NewtonSystem(operator_of(name), cells, np.ones(m), np.zeros((m, 2)))
    rng = np.random.default_rng(10)
    size = np.where(cells[:, 0] < slipping * shape[0], 1.0 + beyond * rng.uniform(1.0, 5.0, size=m), 0.5)
    angle = rng.uniform(0.3, 0.8, size=m)
    normal = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    system.classify(size[:, None] * normal, np.zeros((m, 2)))
    np.testing.assert_array_equal(system.slip, size > 1.0)
    _, xx, yy, xy, _, _ = matrices
    # unknowns and rows: x, y in stick cells; in slip cells an unknown along the bound's direction, whose row is the
    # identity, and one across it, whose row is (1 - c)/rho times it and c times the slip
    rows, columns = np.zeros((2, m, 2, m, 2))
    alone = np.zeros((m, 2))
    for c in range(m):
        across = np.array([-normal[c, 1], normal[c, 0]])
        rows[c, :, c, :] = [[0.0, 0.0], across / size[c]] if size[c] > 1.0 else np.eye(2)
        columns[c, :, c, :] = [system.unit * normal[c], across] if size[c] > 1.0 else np.eye(2)
        alone[c] = [1.0, (1.0 - 1.0 / size[c]) / system.rho] if size[c] > 1.0 else [0.0, 0.0]
    pairs = np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=1).reshape(2 * m, 2 * m)
    matrix = rows.reshape(2 * m, 2 * m) @ pairs @ columns.reshape(2 * m, 2 * m).T + np.diag(alone.reshape(-1))
    return system, matrix


@pytest.mark.parametrize("name", ["oblong", "layered on soft", "with holes", "one row", "one cell"])
@pytest.mark.parametrize("slipping", [0.0, 0.4, 1.0])
def test_newton_system(name: str, slipping: float) -> None:
    """The product with the system's matrix, to 1e-7 of its largest entry (the coefficients, see above)."""
    system, matrix = newton_system(name, slipping)
    for v in np.random.default_rng(11).normal(size=(3, len(matrix))):
        out = np.full(2 * len(matrix), np.nan)
        system.apply(v, out)
        rows, slips = out.reshape(2, -1)
        np.testing.assert_allclose(rows, matrix @ v, rtol=0.0, atol=1e-7 * np.abs(matrix).max())
        # the same slips by the tractions themselves
        q = np.full((v.size // 2, 2), np.nan)
        tractions.add_step(np.zeros(q.shape), v, system.slip, system.normal, system.unit, q)
        np.testing.assert_allclose(slips, system.slips(q).reshape(-1), rtol=0.0, atol=1e-14 * np.abs(slips).max())


@pytest.mark.parametrize("name", ["oblong", "layered on soft", "with holes", "one row"])
@pytest.mark.parametrize(("slipping", "beyond"), [(0.0, 0.1), (1.0, 0.1), (1.0, 30.0)])
def test_preconditioner_leaves_out_what_nothing_needs(
    name: str, slipping: float, beyond: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where no cell slips, none sticks, or none even nearly: the same numbers as by all of it.

    Nothing is left of the last product.
    """
    system, matrix = newton_system(name, slipping, beyond)
    assert (system._slipping == 0) == (slipping == 0.0)
    assert (system._near == 0) == (beyond == 30.0)
    for v in np.random.default_rng(13).normal(size=(2, len(matrix))):
        found, expected = np.full((2, v.size), np.nan)
        with monkeypatch.context() as patch:
            patch.setattr(system, "_slipping", 1)
            patch.setattr(system, "_near", 1)
            system.precondition(v, expected)
        system.operator.torus_plan.field[:] = 7.0
        system.precondition(v, found)
        np.testing.assert_array_equal(found, expected)


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("slipping", "beyond", "share"), [(0.0, 0.1, 0.3), (0.5, 0.1, 0.24), (1.0, 0.1, 0.24), (1.0, 30.0, 0.8)]
)
@pytest.mark.parametrize("name", ["round", "layered"])
def test_preconditioner_saves_steps(name: str, slipping: float, beyond: float, share: float) -> None:
    """Of GMRES, to 1e-6: what is left of the steps it takes without.

    (0.24, 0.20, 0.19, 0.67. Without slip cells that hardly slip in part 1: 0.24, 0.32, 0.47, 0.67; with d = 2 b the
    last one 2.3.)
    """
    system, matrix = newton_system(name, slipping, beyond)
    solution = np.random.default_rng(12).normal(size=(len(matrix) // 2, 2))
    solution[system.slip, 0] *= 0.01 / system.unit  # iterates are nearer to the bound than to the solution along it
    right = matrix @ solution.reshape(-1)
    steps = []
    for precondition in (system.precondition, Counted(np.eye(len(matrix)))):
        product = Counted(matrix)
        gmres(product, right, precondition, 1e-6, len(right))
        steps.append(product.calls)
    assert steps[0] <= share * steps[1]


@pytest.mark.parametrize("torus", [(72, 1), (72, 5), (75, 8)])
def test_inverse_on_rows_that_end(torus: tuple[int, int]) -> None:
    """A convolution on rows that end at i = 40, and are endless on the other side: its equations are met there.

    The inverse of the whole plane, cut there, misses them by a fourteenth of the right-hand side.
    """
    px, py = torus
    x, y = (2.0 * np.pi * np.fft.fftfreq(n) for n in torus)
    symbol = 1.0 / (1.6 - np.cos(x)[:, None] * (1.0 + 0.3 * np.cos(y)))
    inverse = np.zeros((3, py // 2 + 1, px), dtype=np.complex128)
    inverse[0] = 1.0 / (px * py * symbol.T[: py // 2 + 1])
    before, after = from_leading_edge(inverse, torus)
    right = np.zeros((2, *torus))
    right[:, 31:41] = np.random.default_rng(14).normal(size=(2, 10, py))

    def product(pair: np.ndarray, packed: np.ndarray | None) -> np.ndarray:
        """Of a pair and a symbol of both, or of the pair and `before`; of what is left at i <= 40."""
        hat = np.ascontiguousarray(np.fft.fft2(pair[0] + 1j * pair[1]).T)
        arrays.scale_packed(hat, before) if packed is None else arrays.multiply_packed(hat, packed)
        found = np.fft.ifft2(hat.T) * px * py
        return np.where(np.arange(px)[:, None] <= 40, np.stack([found.real, found.imag]), 0.0)

    missed = []
    for found in (product(product(right, None), after), product(right, inverse)):
        met = np.fft.ifft2(symbol * np.fft.fft2(found)).real
        missed.append(np.abs((met - right)[:, :41]).max() / np.abs(right).max())
    assert missed[0] < 1e-8
    assert missed[1] > 0.05


@pytest.mark.heavy
@pytest.mark.parametrize(
    "creepage",
    [Creepage(0.002, 0.0, 0.0), Creepage(0.002, 0.001, 0.01), Creepage(0.0, 0.0, 0.02), Creepage(0.02, 0.0, 0.0)],
)
@pytest.mark.parametrize(
    ("layers", "most", "times"),
    [((), 28, 1.5), ((Layer(105000.0, 0.3, 0.06),), 28, 1.5), ((Layer(1000.0, 0.3, 0.02),), 38, 2.8)],
)
def test_products_hardly_grow_with_the_mesh(
    layers: tuple[Layer, ...], most: int, times: float, creepage: Creepage
) -> None:
    """From 20 to 160 cells across, partial slip to full: 7 to 23 products, then 7 to 27; on a film 13 to 15, then 35.

    Without slip cells that hardly slip in part 1 of the preconditioner spin alone takes 41, 43 and 103 in the end.
    """
    products = []
    for cells in (32, 256):
        mesh, tolerance = Mesh((0.9, 0.9), (cells, cells)), Tolerance(1e-6, 1e-6)
        scene = Scene(
            STEEL, (50.0, 50.0), 100.0, mesh, layers=layers, creepage=creepage, friction=1.0, tolerance=tolerance
        )
        rolling = solve_rolling(solve_normal(scene), scene)
        assert rolling.converged
        products.append(rolling.products)
    assert products[1] < times * products[0]
    assert products[1] <= most


@pytest.mark.parametrize("spacing", [(0.1, 0.1), (0.4, 0.05), (0.02, 0.1)])
def test_displacement_of_cells_that_hardly_slip(spacing: tuple[float, float]) -> None:
    """By the twin of `SlipOperator.held`: tractions of every second row summed, on a torus of 12 x 8 cells."""
    operator = SlipOperator(Influence(STEEL, (), None, spacing, 4.0), (11, 7))
    _, xx, yy, *_ = Influence(STEEL, (), None, spacing, 4.0).around((12, 8), ahead=1)
    of_rows = 0.0
    for coefficients in (xx, yy):
        displacement = sum((-1) ** j * coefficients[min(i, 12 - i), min(j, 8 - j)] for i in range(12) for j in range(8))
        of_rows += 0.5 / displacement
    taken = (1.5 / of_rows) ** 2 / xx[0, 0]
    assert operator.held == pytest.approx(operator.diagonal * spacing[0] / taken, rel=1e-12)
    least, most = {0.1: (0.7, 0.9), 0.4: (0.0, 0.3), 0.02: (2.0, np.inf)}[spacing[0]]
    assert least < taken / xx[0, 0] < most


def test_slip_operators_are_kept() -> None:
    """One for all contacts of a shape; another for another shape or other cells."""
    influence = influence_of(BODIES["equal"])
    one = SlipOperator.of(influence, (5, 4))
    assert SlipOperator.of(influence, (5, 4)) is one
    assert SlipOperator.of(influence, (4, 5)) is not one
    assert SlipOperator.of(influence, (5, 4), sharp=True) is not one
    assert SlipOperator.of(influence.coarser(), (5, 4)).spacing == (0.08, 0.12)
    assert influence.coarser() is influence.coarser()


@pytest.mark.parametrize("length", [1, 7, 10, 15])
def test_sharp_slip_operators(length: int) -> None:
    """Displacements as of others, 7/6 of each less 1/12 of those on either side of it, up to the cell ahead."""
    influence = influence_of(BODIES["layered"])
    sharp, plain = SlipOperator.of(influence, (length, 3), sharp=True), SlipOperator.of(influence, (length + 4, 3))
    q = np.random.default_rng(length).normal(size=(2, length, 3))
    for operator, by_cell, first in ((sharp, sharp.plan.by_cell, 0), (plain, plain.plan.real, 2)):  # type: ignore[attr-defined]
        by_cell[:] = 0.0
        by_cell[:, first : first + length, :3] = q
        operator.multiply()
    near = plain.plan.real[:, 1 : length + 4, :3]
    expected = 7.0 / 6.0 * near[:, 1:-1] - (near[:, :-2] + near[:, 2:]) / 12.0
    found = sharp.plan.by_cell[:, : length + 1, :3]  # type: ignore[attr-defined]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
    cells = np.argwhere(np.ones((length, 3), dtype=bool))
    ahead = sharp.plan.flat[:, sharp.plan.places(cells) + sharp.ahead]
    np.testing.assert_array_equal(ahead, found[:, 1:].reshape(2, -1))


# --- one contact ---


@cache
def layered_contact() -> tuple[NormalContact, naive.Bodies]:
    """A layered contact on a rigid body, cells oblong, the box off the window's middle by nothing but its numbers."""
    bodies = naive.Bodies(STEEL, COATED, None, (0.05, 0.04))
    scene = Scene(STEEL, (40.0, 50.0), 60.0, Mesh((0.75, 0.64), (15, 16)), layers=COATED)
    return solve_normal(scene), bodies


@pytest.mark.heavy
def test_displacements_of_a_contact() -> None:
    """Slip by pressure, displacement by tractions along and across the surface: to 1e-7 (the coefficients)."""
    contact, bodies = layered_contact()
    cells, m = contact.cells, len(contact.cells)
    np.testing.assert_array_equal(cells, np.argwhere(contact.solution.p[contact.box.slices] > 0.0))
    np.testing.assert_array_equal(contact.gather(contact.spread(contact.pressure)), contact.pressure)
    matrices = bodies.slips(cells)
    expected = np.stack([matrices[4] @ contact.pressure, matrices[5] @ contact.pressure], axis=1)
    assert np.abs(contact.slip_by_pressure - expected).max() <= 1e-7 * np.abs(expected).max()

    q = np.random.default_rng(13).normal(size=(m, 2))
    longer = np.argwhere(np.ones((contact.box.shape[0] + 1, contact.box.shape[1]), dtype=bool))
    _, xx, yy, xy, _, _ = bodies.matrices(longer, cells)
    expected = np.stack([xx @ q[:, 0] + xy @ q[:, 1], xy @ q[:, 0] + yy @ q[:, 1]])
    found = contact.displacement.on_box(q, cells).reshape(2, -1)
    assert np.abs(found - expected).max() <= 1e-7 * np.abs(expected).max()

    # u_z here by q there is u_x there by p here
    box = contact.box.grown(2, 1, contact.scene.mesh.cells)
    here = np.argwhere(np.ones(box.shape, dtype=bool)) - np.array([contact.box.i0 - box.i0, contact.box.j0 - box.j0])
    by_pressure = bodies.matrices(cells, here)
    lift = (by_pressure[4].T @ q[:, 0] + by_pressure[5].T @ q[:, 1]).reshape(box.shape)
    rolling = solve_tractions(contact.operator, cells, contact.pressure, np.zeros((m, 2)), 1.0)
    rolling.q = q
    assert np.abs(contact.lift(rolling.q, box) - lift).max() <= 1e-7 * np.abs(lift).max()


def test_moves_by_pressure() -> None:
    """All pairs but those of equal (1 - 2 nu)/G: 0 of incompressible bodies and of rigid ones."""
    like_steel = Material(2.0 * 1.2 * STEEL.G * 0.6 / 0.4, 0.2)
    expected = [
        (STEEL, (), None, True),
        (STEEL, (), STEEL, False),
        (STEEL, (), SOFT, True),
        (STEEL, (), like_steel, False),
        (Material(1e5, 0.5), (), Material(3e3, 0.5), False),
        (Material(1e5, 0.5), (), None, False),
        (Material(1e5, 0.5), COATED, None, True),
        (STEEL, COATED, STEEL, True),
    ]
    for substrate, layers, counterbody, moves in expected:
        scene = Scene(substrate, (50.0, 50.0), 1.0, Mesh((1.0, 1.0), (8, 8)), layers, counterbody)
        assert scene.moves_by_pressure is moves


def test_boxes() -> None:
    window = (7, 9)
    rng = np.random.default_rng(14)
    for _ in range(20):
        mask = rng.random(window) < 0.1
        mask[tuple(rng.integers(0, window))] = True
        box = Box.around(mask)
        inside = np.zeros(window, dtype=bool)
        inside[box.slices] = True
        assert inside.shape == window
        assert mask[box.slices].shape == box.shape
        assert not mask[~inside].any()
        edges = mask[box.slices]
        assert edges[0].any() and edges[-1].any() and edges[:, 0].any() and edges[:, -1].any()
        larger = box.grown(1, 2, window)
        rows, columns = np.indices(window)
        near = (rows >= box.i0 - 1) & (rows <= box.i1) & (columns >= box.j0 - 2) & (columns <= box.j1 + 1)
        grown = np.zeros(window, dtype=bool)
        grown[larger.slices] = True
        np.testing.assert_array_equal(grown, near)
        assert larger.holds(box)
        assert box.holds(larger) == (grown == inside).all()


def test_waves_that_the_seam_spoils_take_what_the_bodies_answer():
    """Under a skin 600 times as stiff: along and across such waves what tractions make, averaged over a cell.

    The answer is looked up in a table, which is good to some 1e-5.
    """
    spacing, torus = (0.012, 0.015), (66, 60)
    bodies = Influence(Material(2000.0, 0.3), (Layer(1.2e6, 0.3, 0.0032),), None, spacing, 4.0)
    pair = symbols(traction_quadrants(bodies.around(torus)), torus)
    found = positive_tractions(pair, bodies, torus)
    kx, ky = np.broadcast_arrays(
        2.0 * np.pi * np.fft.fftfreq(torus[0], spacing[0]), 2.0 * np.pi * np.fft.rfftfreq(torus[1], spacing[1])[:, None]
    )
    spoilt = (found != pair).any(axis=0)
    assert 100 < np.count_nonzero(spoilt & (kx * ky != 0.0)) < 0.5 * spoilt.size
    kx, ky, (xx, xy, yy) = kx[spoilt], ky[spoilt], found[:, spoilt].real
    k = np.hypot(kx, ky)
    mean = np.sinc(kx * spacing[0] / (2.0 * np.pi)) * np.sinc(ky * spacing[1] / (2.0 * np.pi)) / (torus[0] * torus[1])
    along, across = bodies.traction_responses(k) * mean
    np.testing.assert_allclose([xx * kx + xy * ky, xy * kx + yy * ky], along * [kx, ky], rtol=1e-4, atol=1e-20)
    np.testing.assert_allclose([-xx * ky + xy * kx, -xy * ky + yy * kx], across * [-ky, kx], rtol=1e-4, atol=1e-20)


# --- cascade ---


@pytest.mark.parametrize("window", [(8, 8), (9, 6), (7, 11)])
def test_interpolation_between_meshes(window: tuple[int, int]) -> None:
    """Constants wherever anything counts, linear functions wherever everything does."""
    coarse = (window[0] + 1) // 2, (window[1] + 1) // 2
    cells = np.argwhere(np.ones(window, dtype=bool))
    mask = np.random.default_rng(15).random(coarse) < 0.85
    at_coarse = [2.0 * (np.arange(n) - 0.5 * (n - 1)) for n in coarse]
    at_fine = cells - 0.5 * (np.array(window) - 1.0)
    linear = 1.0 + 0.3 * at_coarse[0][:, None] - 0.7 * at_coarse[1][None, :]
    values = np.stack([np.full(coarse, 2.5), linear])
    out, weight = cascade.interpolate(values, mask, cells, cascade.place_among_coarser(window, coarse))
    np.testing.assert_allclose(weight, naive.from_twice_the_size(values, mask, cells, window)[1], atol=1e-15)
    np.testing.assert_allclose(out[:, 0], np.where(weight > 0.0, 2.5, 0.0), rtol=1e-14)
    whole = weight > 1.0 - 1e-12
    assert whole.any()
    assert not whole.all()
    np.testing.assert_allclose(out[whole, 1], (1.0 + at_fine @ [0.3, -0.7])[whole], rtol=1e-13)


@pytest.mark.parametrize("window", [(16, 14), (15, 17)])
def test_interpolated_pressure(window: tuple[int, int]) -> None:
    """Of p^2, by the twin; of a paraboloid in p^2 it is right to the interpolation's second order."""
    coarse = (window[0] + 1) // 2, (window[1] + 1) // 2

    def squares(shape: tuple[int, int], size: float) -> np.ndarray:
        x, y = (size * (np.arange(n) - 0.5 * (n - 1)) for n in shape)
        return np.clip(1.0 - (x**2)[:, None] / 36.0 - (y**2)[None, :] / 30.0, 0.0, None)

    p = np.sqrt(squares(coarse, 2.0))
    guess = cascade.interpolated_pressure(p, window)
    cells = np.argwhere(np.ones(window, dtype=bool))
    out, weight = naive.from_twice_the_size((p * p)[None], p > 0.0, cells, window)
    np.testing.assert_allclose(guess, np.where(weight >= 0.5, np.sqrt(out[:, 0]), 0.0).reshape(window), atol=1e-14)
    inside = (weight == 1.0).reshape(window)
    # h^2/8 times the second derivatives, h = 2: reached half-way between the coarse centres of odd windows
    limit = 0.5 * (2.0 / 36.0 + 2.0 / 30.0) * (1.0 + 1e-12)
    assert np.abs(guess**2 - squares(window, 1.0))[inside].max() <= limit


@pytest.mark.parametrize("seed", range(12))
def test_interpolated_pressure_looks_far_enough(seed: int) -> None:
    """The cells around those in contact are all that can be under pressure: the same as on the whole window."""
    rng = np.random.default_rng(seed)
    window = tuple(int(n) for n in rng.integers(2, 24, 2))
    coarse = (window[0] + 1) // 2, (window[1] + 1) // 2
    p = rng.random(coarse) * (rng.random(coarse) < rng.choice([0.05, 0.5]))
    p[rng.integers(coarse[0]), rng.integers(coarse[1])] = 1.0
    cells = np.argwhere(np.ones(window, dtype=bool))
    out, weight = naive.from_twice_the_size((p * p)[None], p > 0.0, cells, window)
    expected = np.where(weight >= 0.5, np.sqrt(out[:, 0]), 0.0).reshape(window)
    np.testing.assert_allclose(cascade.interpolated_pressure(p, window), expected, atol=1e-14)


def test_contacts_of_few_cells_along_one_axis_have_no_coarser_mesh():
    """Five cells across are too few, however many there are along the other axis."""
    a = estimated_contact(Scene(STEEL, (50.0, 50.0), 100.0, Mesh((1.0, 1.0), (8, 8))))[0]
    for cells, found in (((8, 8), True), ((30, 6), False), ((6, 30), False)):
        scene = Scene(STEEL, (50.0, 50.0), 100.0, Mesh((2.5 * a, 2.5 * a), cells))
        assert (cascade.coarser_scene(scene) is not None) == found


def test_tolerances_on_coarser_meshes():
    """No tighter than engineering asks for, nor than that on the mesh itself."""
    assert cascade.coarser_tolerance(Tolerance(1e-8, 1e-8)) == cascade.coarser_tolerance(Tolerance(1e-3, 1e-3))
    assert cascade.coarser_tolerance(Tolerance(0.02, 0.05)) == Tolerance(0.02, 0.05)


@pytest.mark.parametrize("cells", [(28, 26), (27, 25)])
def test_coarser_scene(cells: tuple[int, int]) -> None:
    """Cells of twice the size about the same centre, so long as there are enough of them in the contact."""
    scene = Scene(STEEL, (50.0, 50.0), 100.0, Mesh((0.02 * cells[0], 0.021 * cells[1]), cells), layers=COATED)
    coarse = cascade.coarser_scene(scene)
    assert coarse is not None
    assert coarse.mesh.cells == ((cells[0] + 1) // 2, (cells[1] + 1) // 2)
    assert coarse.mesh.spacing == pytest.approx((0.04, 0.042), rel=1e-13)
    assert replace(coarse, mesh=scene.mesh, tolerance=scene.tolerance) == scene
    assert coarse.tolerance.normal >= scene.tolerance.normal
    assert coarse.tolerance.tangential >= scene.tolerance.tangential


@pytest.mark.parametrize(
    ("cells", "coarser"),
    [(11, []), (12, [6]), (20, [10]), (40, [20]), (80, [40, 20]), (104, [52, 26]), (200, [100, 50, 25])],
)
def test_how_coarse_meshes_get(cells: int, coarser: list[int]) -> None:
    """One where contacts, here half the window, are 6 cells across, another while it has 12, others while 24."""
    scene = Scene(STEEL, (50.0, 50.0), 100.0, Mesh((1.0, 1.0), (cells, cells)))
    a = estimated_contact(scene)[0]
    scene = replace(scene, mesh=Mesh((4.0 * a, 4.0 * a), (cells, cells)))
    found: list[int] = []
    while (coarse := cascade.coarser_scene(scene, len(found))) is not None:
        scene = coarse
        found.append(coarse.mesh.cells[0])
    assert found == coarser


@pytest.mark.parametrize("creep", ["mixed", "full slip"])
def test_cascade_solves_the_stated_equations(creep: str) -> None:
    """By way of coarser meshes: the dense solution's pressure and tractions, by fewer products than from nothing.

    In full slip, where there is little to know in advance, by no more but that for the slips of the first guess.
    """
    scene = Scene(
        STEEL,
        (50.0, 30.0),
        90.0,
        Mesh((0.72, 0.63), (24, 21)),
        counterbody=SOFT,
        friction=FRICTION,
        creepage=CREEPAGES[creep],
        tolerance=Tolerance(1e-11, 1e-11),
    )
    contact = solve_normal(scene)
    assert contact.coarser is not None
    bodies = naive.Bodies(STEEL, (), SOFT, scene.mesh.spacing)
    every = np.argwhere(np.ones(scene.mesh.cells, dtype=bool))
    a = bodies.matrices(every, every)[0]
    p, _ = naive.pressure_by_active_set(a, initial_gap(scene).reshape(-1), scene.load / math.prod(scene.mesh.spacing))
    np.testing.assert_array_equal(contact.solution.p.reshape(-1) > 0.0, p > 0.0)
    assert np.abs(contact.solution.p.reshape(-1) - p).max() <= 1e-8 * p.max()
    rolling = solve_rolling(contact, scene)
    assert rolling.coarser is not None
    w = contact.rigid_slip(CREEPAGES[creep], 0.0) + contact.slip_by_pressure
    np.testing.assert_array_equal(contact.known_slip(scene), w)
    with pytest.raises(ValueError, match="no slip"):
        contact.known_slip(replace(scene, creepage=None))
    bound = FRICTION * contact.pressure
    q, s = naive.tractions_by_newton(bodies.slip_by_tractions(contact.cells), bound, w)
    check_tractions(rolling.q, rolling.s, rolling.slip, bound, w, q, s)
    from_nothing = solve_tractions(contact.operator, contact.cells, bound, w, 1e-11).products
    assert rolling.products <= from_nothing + 1 if creep == "full slip" else rolling.products < from_nothing


# --- the paper's method ---


@cache
def displacements(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Matrices [2 m, 2 m] of the displacements in the cells, and in those ahead of them, by tractions."""
    cells = twin(name)[0]
    out = []
    for to in (cells, cells + np.array([1, 0])):
        _, xx, yy, xy, _, _ = BODIES[CONTACTS[name][0]].matrices(to, cells)
        out.append(np.block([[xx, xy], [xy, yy]]))
    return out[0], out[1]


@pytest.mark.heavy
@pytest.mark.parametrize("name", ["oblong", "equal", "with holes", "layered", "one row"])
@pytest.mark.parametrize("tolerance", [1e300, 0.3, 0.1, 0.03])
def test_papers_method(name: str, tolerance: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Iterate by iterate the twin's: one step along the integral of the rigid slip, and some more.

    1e-5 of the bound: the iteration is not a contraction, and the coefficients' 1e-8 grow in it.
    """
    cells = twin(name)[0]
    bodies, shape, _ = CONTACTS[name]
    dx = BODIES[bodies].spacing[0]
    bound, w, _, _ = dense_case(name, "mixed")
    here, ahead = displacements(name)
    q, iterations = naive.papers_iteration(here, ahead, bound, w, cells, dx, tolerance)
    longer = shape[0] + 1, shape[1]
    padded = padded_shape(longer)
    quadrant = influence_of(BODIES[bodies]).around(padded)
    displacement = PairOperator(
        real_symbols(traction_quadrants(quadrant), padded), longer, transform(padded, 2, longer[0])
    )
    calls: list[np.ndarray] = []
    monkeypatch.setattr(
        displacement, "on_box", lambda q, at: calls.append(q) or PairOperator.on_box(displacement, q, at)
    )
    found = solve_paper_cg(displacement, cells, bound, w, dx, tolerance)
    assert found.iterations == iterations
    assert found.products == 2 * iterations + 1 == len(calls)
    assert found.converged
    assert np.abs(found.q - q).max() <= 1e-5 * bound.max()
    slip = w + (((here - ahead) / dx) @ found.q.T.reshape(-1)).reshape(2, -1).T
    assert np.abs(found.s - slip).max() <= 1e-6 * np.abs(w).max()
    np.testing.assert_array_equal(found.slip, np.hypot(*found.q.T) >= bound * (1.0 - 1e-12))


def test_principal_values() -> None:
    xx, xy, yy = pair = np.random.default_rng(1).normal(size=(3, 7))
    expected = np.linalg.eigvalsh(np.stack([xx, xy, xy, yy], axis=-1).reshape(-1, 2, 2))
    np.testing.assert_allclose(np.stack(_principal(pair), axis=-1), expected, rtol=1e-12)


@pytest.mark.parametrize("padded", [(1, 8), (8, 1), (1, 1)])
def test_responses_along_one_row_of_cells(padded: tuple[int, int]) -> None:
    influence = Influence(STEEL, (Layer(1e7, 0.3, 0.1),), STEEL, (0.125, 0.125), 4.0)
    found = _responses(influence, padded, influence.normal_response)
    assert found.shape == (1, padded[1] // 2 + 1, padded[0])
    assert np.all(np.isfinite(found) & (found > 0.0))
