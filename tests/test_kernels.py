"""Every compiled kernel against a naive twin, and the rules that kernels keep.

Twins of a line or two stand in the tests, the others in `naive.py`. Tolerances are a few units of rounding unless the
test says otherwise. The kernels are called with arrays as the mechanics lay them out. Those of moved rows have a file
of their own, `test_kernels_rows.py`.
"""

from __future__ import annotations

import ast
import builtins
import dis
import math
from pathlib import Path
from types import CodeType

import naive
import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

import rcstudy
from rcstudy.mechanics.kernels import arrays, coefficients, coupled, gmres, meshes, pressure, tractions
from rcstudy.mechanics.scene import Layer, Material

STEEL = Material(210000.0, 0.3)
PARITIES = [(1, 1), (1, -1), (-1, 1), (-1, -1)]
TORI = [(1, 1), (1, 6), (7, 1), (2, 2), (4, 5), (5, 4), (8, 6), (3, 9)]


def random_complex(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Normal real and imaginary parts."""
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


# --- arrays ---


@pytest.mark.parametrize("parity", PARITIES)
@pytest.mark.parametrize("padded", TORI)
def test_unfold(padded: tuple[int, int], parity: tuple[int, int]) -> None:
    quadrant = np.random.default_rng(1).normal(size=(padded[0] // 2 + 1, padded[1] // 2 + 1))
    out = np.full(padded, np.nan)
    arrays.unfold(quadrant, *parity, out)
    np.testing.assert_array_equal(out, naive.torus(quadrant, parity, padded))


@pytest.mark.parametrize("parity", PARITIES)
@pytest.mark.parametrize("padded", TORI)
def test_upwind_difference(padded: tuple[int, int], parity: tuple[int, int]) -> None:
    quadrant = np.random.default_rng(2).normal(size=(padded[0] // 2 + 2, padded[1] // 2 + 1))
    out = np.full(padded, np.nan)
    arrays.upwind_difference(quadrant, *parity, 0.3, out)
    np.testing.assert_allclose(out, naive.torus_difference(quadrant, parity, 0.3, padded), rtol=1e-14)


@pytest.mark.parametrize("share", [0.0, 0.02, 0.1, 0.7])
@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (12, 7)])
def test_bounds(shape: tuple[int, int], share: float) -> None:
    rng = np.random.default_rng([*shape, int(100 * share)])
    for _ in range(20):
        mask = rng.random(shape) < share
        i0, i1, j0, j1 = arrays.bounds(mask)
        if mask.any():
            i, j = np.nonzero(mask)
            assert (i0, i1, j0, j1) == (i.min(), i.max() + 1, j.min(), j.max() + 1)
        else:
            assert i1 == j1 == 0


@pytest.mark.parametrize("torus", TORI)
def test_multiply_packed(torus: tuple[int, int]) -> None:
    """A symmetric matrix of convolutions of two real arrays, by their real transforms."""
    rng = np.random.default_rng([*torus, 3])
    a, b = rng.normal(size=(2, *torus))
    k = np.fft.rfft2(rng.normal(size=(3, *torus)))
    of_pair = np.ascontiguousarray(k.transpose(0, 2, 1))
    packed = np.full_like(of_pair, np.nan)
    arrays.packed_symbol(of_pair, packed)
    hat = np.ascontiguousarray(np.fft.fft2(a + 1j * b).T)
    arrays.multiply_packed(hat, packed)
    found = np.fft.ifft2(hat.T)
    of_a, of_b = np.fft.rfft2(a), np.fft.rfft2(b)
    size = np.abs(k).max() * max(np.abs(a).max(), np.abs(b).max())
    np.testing.assert_allclose(found.real, np.fft.irfft2(k[0] * of_a + k[1] * of_b, s=torus), atol=1e-13 * size)
    np.testing.assert_allclose(found.imag, np.fft.irfft2(k[1] * of_a + k[2] * of_b, s=torus), atol=1e-13 * size)


@pytest.mark.parametrize("torus", [(1, 1), (4, 3), (3, 4), (5, 6)])
def test_scale_packed(torus: tuple[int, int]) -> None:
    """One convolution of both of two real arrays, by their real transforms; the same for waves along +y and -y."""
    rng = np.random.default_rng([*torus, 4])
    a, b = rng.normal(size=(2, *torus))
    k = np.fft.fft2(rng.normal(size=torus))
    k = 0.5 * (k + np.roll(k[:, ::-1], 1, axis=1))
    hat = np.ascontiguousarray(np.fft.fft2(a + 1j * b).T)
    arrays.scale_packed(hat, np.ascontiguousarray(k.T[: torus[1] // 2 + 1]))
    found = np.fft.ifft2(hat.T)
    for part, expected in ((found.real, a), (found.imag, b)):
        np.testing.assert_allclose(part, np.fft.ifft2(k * np.fft.fft2(expected)).real, atol=1e-13 * np.abs(k).max())


def test_inverse_symbol() -> None:
    rng = np.random.default_rng(4)
    pair = rng.normal(size=(3, 4, 3)) + 1j * rng.normal(size=(3, 4, 3))
    out = np.full_like(pair, np.nan)
    arrays.inverse_symbol(pair, 0.7, 5.0, out)
    matrix = np.moveaxis(pair[[0, 1, 1, 2]].reshape(2, 2, 4, 3), (0, 1), (2, 3)) + 0.7 * np.eye(2)
    expected = np.linalg.inv(matrix) / 25.0
    np.testing.assert_allclose(
        out, np.stack([expected[..., 0, 0], expected[..., 0, 1], expected[..., 1, 1]]), rtol=1e-12
    )


@pytest.mark.parametrize("shape", [(1, 1), (4, 3), (3, 5)])
def test_multiply_2x2(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(4)
    k, hat = rng.normal(size=(3, *shape)), random_complex(rng, 2, *shape)
    expected = np.einsum("abij,bij->aij", np.array([[k[0], k[1]], [k[1], k[2]]]), hat)
    arrays.multiply_2x2(hat.view(np.float64), np.repeat(k, 2, axis=2))
    np.testing.assert_allclose(hat, expected, rtol=1e-13)


@pytest.mark.parametrize("shape", [(1, 1), (4, 3), (3, 5)])
def test_scale_real(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(5)
    hat, symbol = random_complex(rng, *shape), rng.normal(size=shape)
    expected = hat * symbol
    arrays.scale_real(hat, symbol)
    np.testing.assert_allclose(hat, expected, rtol=1e-15)


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (6, 5)])
def test_norm2(shape: tuple[int, int]) -> None:
    a = np.random.default_rng(6).normal(size=shape)
    assert arrays.norm2(a) == pytest.approx(np.linalg.norm(a), rel=1e-14)


# --- coefficients ---

Matrix = tuple[float, float, float, float]


def random_matrix(seed: int) -> Matrix:
    a, b, c, d = np.random.default_rng(seed).normal(size=4).tolist()
    return a, b, c, d


def square(m: Matrix) -> np.ndarray:
    return np.array(m).reshape(2, 2)


def modes(nu: float, sign: float) -> np.ndarray:
    """(U, W, X, Z) of the modes A and B, decaying ones with sign 1, growing ones with -1; see `layered.py`."""
    first = [-1.0, -1.0, 1.0, 1.0] if sign > 0.0 else [-1.0, 1.0, -1.0, 1.0]
    return np.array([first, [0.0, -(3.0 - 4.0 * nu), 1.0 - 2.0 * nu, sign * 2.0 * (1.0 - nu)]]).T


def test_product_and_adjugate() -> None:
    a, b = random_matrix(1), random_matrix(2)
    np.testing.assert_allclose(square(coefficients.product(a, b)), square(a) @ square(b), rtol=1e-14)
    adjugate, determinant = coefficients.adjugate(a)
    assert determinant == pytest.approx(np.linalg.det(square(a)), rel=1e-14)
    np.testing.assert_allclose(square(adjugate) / determinant, np.linalg.inv(square(a)), rtol=1e-13)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_at_interface(sign: float, nu: float) -> None:
    a, b, c, h = 0.7, 0.2, 0.9, 0.31
    displacement, stress = np.split(modes(nu, sign), 2)
    expected = h * displacement + np.array([[c, -b], [-b, a]]) @ stress
    np.testing.assert_allclose(square(coefficients.at_interface(sign, nu, h, (a, b, c))), expected, rtol=1e-14)


def test_carried_up() -> None:
    r, zeta = random_matrix(3), 0.8
    down, up = np.array([[1.0, zeta], [0.0, 1.0]]), np.array([[1.0, -zeta], [0.0, 1.0]])
    found = square(coefficients.carried_up(r, zeta, 0.37))
    np.testing.assert_allclose(found, 0.37 * up @ square(r) @ down, rtol=1e-14)


def test_tractions_at_top() -> None:
    t, nu = random_matrix(4), 0.3
    expected = modes(nu, 1.0)[2:] + modes(nu, -1.0)[2:] @ square(t)
    np.testing.assert_allclose(square(coefficients.tractions_at_top(nu, t)), expected, rtol=1e-14)


def test_reflected() -> None:
    """With the growing modes that a layer reflects, what is below it is as compliant as it should be."""
    nu, h, zeta, (a, b, c) = 0.3, 0.31, 0.8, (0.7, 0.2, 0.9)
    e2 = math.exp(-2.0 * zeta)
    carried = square(coefficients.reflected(nu, h, zeta, e2, (a, b, c)))
    back, fro = np.array([[1.0, zeta], [0.0, 1.0]]), np.array([[1.0, -zeta], [0.0, 1.0]])
    at_bottom = modes(nu, 1.0) + modes(nu, -1.0) @ (back @ carried @ fro / e2)
    displacement, stress = h * at_bottom[:2], at_bottom[2:]
    np.testing.assert_allclose(displacement, -np.array([[c, -b], [-b, a]]) @ stress, rtol=1e-13)


STACKS = {
    "soft": (Layer(105000.0, 0.35, 0.06),),
    "stiff": (Layer(840000.0, 0.1, 0.03),),
    "two": (Layer(420000.0, 0.25, 0.03), Layer(70000.0, 0.45, 0.05)),
    "four": tuple(Layer(10.0 ** (4 + i % 3), 0.1 * (i + 1), 0.02) for i in range(4)),
}


@pytest.mark.parametrize("name", STACKS)
def test_layered_response(name: str) -> None:
    """1e-12 of the top material's response: the twin subtracts, the kernel does not."""
    layers = STACKS[name]
    alpha = np.geomspace(1e-3, 15.0, 12) / sum(layer.thickness for layer in layers)
    out = np.full((4, alpha.size), np.nan)
    of_layers = (np.array([getattr(layer, key) for layer in layers]) for key in ("E", "nu", "thickness"))
    own = np.array([naive.scaled_response(Material(layer.E, layer.nu), (), 1.0) for layer in layers])
    coefficients.layered_response(alpha, *of_layers, own, naive.scaled_response(STEEL, (), 1.0), out)
    bare = naive.scaled_response(Material(layers[0].E, layers[0].nu), (), 1.0)
    expected = np.array([naive.scaled_response(STEEL, layers, k) - bare for k in alpha]).T
    assert np.abs(out - expected).max() <= 1e-12 * np.abs(expected).max()


def test_layered_response_without_layers_is_nothing() -> None:
    out = np.full((4, 2), np.nan)
    none = *np.zeros((3, 0)), np.zeros((0, 4))
    coefficients.layered_response(np.array([1.0, 5.0]), *none, np.array([3.0, 1.0, 3.0, 4.0]), out)
    assert not out.any()


def half_space_constants(one: Material, two: Material | None) -> tuple[float, float, float]:
    """The factors of `half_spaces` for body one on body two."""
    bodies = [(one, 1.0)] + ([(two, -1.0)] if two is not None else [])
    return (
        sum((1.0 - m.nu) / (2.0 * math.pi * m.G) for m, _ in bodies),
        sum(m.nu / (2.0 * math.pi * m.G) for m, _ in bodies),
        sum(sign * (1.0 - 2.0 * m.nu) / (4.0 * math.pi * m.G) for m, sign in bodies),
    )


@pytest.mark.parametrize("counterbody", [None, Material(70000.0, 0.2), STEEL])
@pytest.mark.parametrize(("shape", "spacing"), [((1, 1), (0.1, 0.1)), ((1, 6), (0.02, 0.05)), ((7, 5), (0.05, 0.03))])
def test_half_spaces(shape: tuple[int, int], spacing: tuple[float, float], counterbody: Material | None) -> None:
    """1e-13 of the largest of the component, or of a hundredth of zz where that is nothing."""
    offsets = np.argwhere(np.ones(shape, dtype=bool))
    expected = naive.Bodies(STEEL, (), counterbody, spacing).coefficients(offsets).reshape(6, *shape)
    more = expected[0].max() * np.random.default_rng(7).normal(size=(6, *shape))
    out = np.full((6, *shape), np.nan)
    coefficients.half_spaces(*spacing, *half_space_constants(STEEL, counterbody), 0, 0, more, out)
    for have in ((1, 1), (shape[0] - 1, shape[1]), (shape[0], shape[1] - 1), (3, 2)):
        grown = np.full((6, *shape), np.nan)
        known = (slice(None), slice(have[0]), slice(have[1]))
        grown[known] = out[known]
        coefficients.half_spaces(*spacing, *half_space_constants(STEEL, counterbody), *have, more, grown)
        np.testing.assert_array_equal(grown, out)
    for component in range(6):
        scale = max(np.abs(expected[component]).max(), 1e-2 * expected[0].max())
        assert np.abs(out[component] - more[component] - expected[component]).max() <= 1e-13 * scale


@pytest.mark.parametrize("spacing", [(0.05, 0.03), (0.02, 0.06)])
@pytest.mark.parametrize("cell", [(0, 0), (1, 0), (0, 1), (1, 1), (3, 2)])
def test_half_spaces_by_quadrature(cell: tuple[int, int], spacing: tuple[float, float]) -> None:
    """1e-10 of the cell's largest coefficient: the quadrature's error. Checks the twin's closed form as well."""
    body = Material(2.6, 0.3)  # G = 1, for the quadrature's sake
    out = np.full((6, 4, 3), np.nan)
    coefficients.half_spaces(*spacing, *half_space_constants(body, None), 0, 0, np.zeros(out.shape), out)
    for component in range(6):

        def green(x: float, y: float, component: int = component) -> float:
            return naive.half_space_green(body, x, y)[component]

        expected = naive.cell_integral(green, *cell, spacing)
        assert abs(out[component, *cell] - expected) <= 1e-10 * out[0, *cell]


@pytest.mark.parametrize("nodes", [8, 9, 15])
def test_interpolate4(nodes: int) -> None:
    """Random values, so that only the right eight nodes will do; 1e-11 where the weights are largest, at the ends."""
    table = np.random.default_rng(8).normal(size=(nodes, 4))
    log_r0, step, powers = -3.0, 0.2, (0, 2, 1, 3)
    out = np.full(4, np.nan)
    for t in (-5.0, -0.1, 0.0, 0.3, 1.7, 3.5, 0.5 * nodes + 0.1, nodes - 3.6, nodes - 1.2):
        coefficients.interpolate4(table, log_r0, step, powers, math.exp(log_r0 + step * t), out)
        expected = naive.interpolated(table, t) if t > 0.0 else table[0] * math.exp(step * t) ** np.array(powers)
        np.testing.assert_allclose(out, expected, atol=1e-11)
    # a step that is a power of two, and r = 1: the place is a node to the last bit
    coefficients.interpolate4(table, -1.25, 0.25, powers, 1.0, out)
    np.testing.assert_array_equal(out, table[5])


def radial(r: float) -> np.ndarray:
    """Stand-ins for s, d, g, p: smooth, with their behaviour at the origin (1, 1, r^2, r)."""
    return np.array([math.exp(-r * r), 1.0 / (1.0 + r * r), r * r * math.exp(-r * r), r * math.exp(-r)])


def radial_primitive(r: float) -> np.ndarray:
    """Their integrals r dr from 0 to r."""
    small = r**4 / 4.0 if r < 1e-2 else 0.5 - 0.5 * (1.0 + r * r) * math.exp(-r * r)
    tiny = r**3 / 3.0 - r**4 / 4.0 if r < 1e-2 else 2.0 - math.exp(-r) * (r * r + 2.0 * r + 2.0)
    return np.array([-0.5 * math.expm1(-r * r), 0.5 * math.log1p(r * r), small, tiny])


LOG_R0, LOG_STEP = math.log(1e-4), 0.025
RADII = np.exp(LOG_R0 + LOG_STEP * np.arange(480))
KERNEL = np.array([radial(r) for r in RADII])
PRIMITIVE = np.array([radial_primitive(r) for r in RADII])
GAUSS = tuple(0.5 * part for part in np.polynomial.legendre.leggauss(20))
MIDPOINT = (np.zeros(1), np.ones(1))


def radial_green(component: int) -> naive.Field:
    """A Green's function of the stand-ins, of the place of the source as seen from the origin."""

    def f(x: float, y: float) -> float:
        return float(naive.directed(*radial(math.hypot(x, y)), math.atan2(y, x))[component])

    return f


def rectangle_integrals(x: float, y: float) -> np.ndarray:
    """Means of the six Green's functions over [0, x] x [0, y]."""

    def f(u: float, v: float, component: int) -> float:
        return radial_green(component)(x * u, y * v)

    unit = (0.0, 1.0), (0.0, 1.0)
    return np.array([naive.over_rectangle(lambda u, v, k=k: f(u, v, k), *unit) for k in range(6)])


@pytest.mark.parametrize(("x", "y"), [(0.5, 0.5), (0.4, 1.5), (2.0, 0.3), (0.02, 0.03)])
@pytest.mark.parametrize("longest", [0.4, 9.0])
def test_corner_integrals(x: float, y: float, longest: float) -> None:
    """1e-9: the interpolation in the table and the primitives' series leave that."""
    out = np.full(6, np.nan)
    coefficients.corner_integrals(PRIMITIVE, LOG_R0, LOG_STEP, x, y, *GAUSS, longest, out)
    np.testing.assert_allclose(out / (x * y), rectangle_integrals(x, y), rtol=0.0, atol=1e-9)


def test_corner_integrals_in_pieces_that_are_short_enough() -> None:
    """Of sides that are alike, whose triangles both have asinh(1) to go: with one point in a piece each one counts."""
    top, out = math.asinh(1.0), np.zeros((3, 6))
    for k, longest in enumerate((top / 1.9, top / 2.0, top / 1.0)):
        coefficients.corner_integrals(PRIMITIVE, LOG_R0, LOG_STEP, 0.5, 0.5, *MIDPOINT, longest, out[k])
    np.testing.assert_array_equal(out[0], out[1])
    assert (np.abs(out[0] - out[2]) > 1e-5).all()


def test_corner_integrals_below_the_table() -> None:
    """The functions' first powers are used: each right to a fraction of the order of r0 = 1e-4."""
    x, y, longest = 6e-5, 5e-5, 9.0
    out = np.full(6, np.nan)
    coefficients.corner_integrals(PRIMITIVE, LOG_R0, LOG_STEP, x, y, *GAUSS, longest, out)
    np.testing.assert_allclose(out / (x * y), rectangle_integrals(x, y), rtol=2e-4)


@pytest.mark.parametrize(
    ("near", "spacing"), [((1, 1), (0.5, 0.4)), ((3, 2), (0.3, 0.7)), ((1, 4), (0.6, 0.2)), ((2, 3), (0.4, 0.4))]
)
def test_near_cells(near: tuple[int, int], spacing: tuple[float, float]) -> None:
    """1e-8 of the largest (as `test_corner_integrals`, differences); cells beyond are left alone."""
    out = np.full((6, near[0] + 2, near[1] + 1), 7.0)
    coefficients.near_cells(PRIMITIVE, LOG_R0, LOG_STEP, *spacing, *near, *GAUSS, 1.0, out)
    scale = math.prod(spacing)
    for i, j in np.ndindex(out.shape[1:]):
        for f in range(6):
            inside = i < near[0] and j < near[1]
            expected = naive.cell_integral(radial_green(f), i, j, spacing) if inside else 7.0
            assert out[f, i, j] == pytest.approx(expected, abs=1e-8 * scale if inside else 0.0, rel=0.0)


@pytest.mark.parametrize("cell", [(1, 0), (0, 2), (3, 1)])
def test_far_cell(cell: tuple[int, int]) -> None:
    """1e-9 of the cell's area: the interpolation in the table."""
    dx, dy = 0.5, 0.25
    place = cell[0] * dx, cell[1] * dy
    found = np.full(6, np.nan)
    coefficients.far_cell(KERNEL, LOG_R0, LOG_STEP, *place, dx, dy, *GAUSS, np.empty(4), found)
    expected = [naive.cell_integral(radial_green(f), *cell, (dx, dy)) for f in range(6)]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9 * dx * dy)


def test_add_components() -> None:
    value, theta, before = np.array([0.7, -0.4, 0.3, 0.9]), 2.2, np.arange(6.0)
    out = before.copy()
    coefficients.add_components(value, math.cos(theta), math.sin(theta), 0.5, out)
    np.testing.assert_allclose(out - before, 0.5 * np.array(naive.directed(*value, theta)), atol=1e-14)


@pytest.mark.parametrize(
    ("skip", "shape"), [((0, 1), (4, 3)), ((2, 1), (4, 3)), ((1, 3), (4, 3)), ((1, 1), (3, 4)), ((2, 1), (2, 4))]
)
@pytest.mark.parametrize("spacing", [(0.25, 0.25), (0.5, 0.25)])
def test_far_cells(spacing: tuple[float, float], skip: tuple[int, int], shape: tuple[int, int]) -> None:
    """Quadrature nearer than `distant`, the mid-point at and beyond it, another one farther away, a corner left alone.

    1e-9 of the cell's area: the interpolation in the table.
    """
    dx, dy = spacing
    distant, farther = math.hypot(2.0 * dx, dy), math.hypot(3.0 * dx, dy)
    out = np.full((6, *shape), 7.0)
    beyond, rules = np.array([0.0, distant, farther]), (GAUSS, MIDPOINT, (np.zeros(1), np.array([2.0])))
    coefficients.far_cells(KERNEL, LOG_R0, LOG_STEP, dx, dy, *skip, beyond, rules, out)
    for i, j in np.ndindex(out.shape[1:]):
        for f in range(6):
            if i < skip[0] and j < skip[1]:
                assert out[f, i, j] == 7.0
            elif i == j == 0:
                continue  # not what Gauss points are for
            elif math.hypot(i * dx, j * dy) < distant:
                expected = naive.cell_integral(radial_green(f), i, j, spacing)
                assert out[f, i, j] == pytest.approx(expected, abs=1e-9 * dx * dy, rel=0.0)
            else:
                expected = dx * dy * radial_green(f)(i * dx, j * dy)
                expected *= 4.0 if math.hypot(i * dx, j * dy) >= farther else 1.0
                assert out[f, i, j] == pytest.approx(expected, abs=1e-9 * dx * dy, rel=0.0)


def test_far_cells_below_the_table() -> None:
    """Cells so small that all lie where only the first powers are left, by their mid-points."""
    dx, dy, table = 2e-6, 3e-6, np.array([[0.7, -0.4, 0.3, 0.9]] * 8)
    out = np.full((6, 4, 3), np.nan)
    coefficients.far_cells(table, LOG_R0, LOG_STEP, dx, dy, 1, 1, np.zeros(1), (MIDPOINT,), out)
    for i, j in np.ndindex(out.shape[1:]):
        if i or j:
            ratio, theta = math.hypot(i * dx, j * dy) / 1e-4, math.atan2(j * dy, i * dx)
            s, d, g, p = table[0] * np.array([1.0, 1.0, ratio**2, ratio])
            np.testing.assert_allclose(out[:, i, j] / (dx * dy), naive.directed(s, d, g, p, theta), atol=1e-13)


# --- pressure ---

BOXES = [(1, 1), (1, 6), (5, 1), (6, 7), (5, 4)]


def padded_like(shape: tuple[int, int]) -> np.ndarray:
    """A work array [nx, py] with py > ny, full of leftovers."""
    return np.full((shape[0], 2 * shape[1] + 1), np.nan)


def in_corner(field: np.ndarray) -> np.ndarray:
    """`field` in the corner of a padded array, leftovers elsewhere."""
    out = padded_like(field.shape)
    out[:, : field.shape[1]] = field
    return out


def check_padded(out: np.ndarray, field: np.ndarray) -> None:
    """`out` is `field` padded with zeros."""
    np.testing.assert_allclose(out[:, : field.shape[1]], field, rtol=1e-13, atol=1e-13)
    assert not out[:, field.shape[1] :].any()


def random_pressure(rng: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    """Pressures, about a third of them zero."""
    return np.maximum(rng.uniform(-0.5, 1.0, size=shape), 0.0)


@pytest.mark.parametrize("shape", BOXES)
def test_normal_residual(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(9)
    p, g, r = random_pressure(rng, shape), rng.normal(size=shape), rng.normal(size=shape)
    approach = 0.2
    g[-1, -1] = approach  # touching without overlap does not join
    p[-1, -1] = 0.0 if p.size > 1 else 1.0
    before = r.copy()
    mask, r_old, out = np.ones(shape, dtype=np.bool_), np.full(shape, np.nan), padded_like(shape)
    mean, entered = pressure.normal_residual(p, g, approach, mask, r, r_old, out)
    active = (p > 0.0) | (g < approach)
    np.testing.assert_array_equal(mask, active)
    assert entered == (active & (p == 0.0)).sum()
    assert mean == pytest.approx(g[active].mean(), rel=1e-13)
    np.testing.assert_array_equal(r_old, before)
    np.testing.assert_allclose(r, np.where(active, g[active].mean() - g, 0.0), atol=1e-14)
    check_padded(out, r)


def test_normal_residual_of_no_cell() -> None:
    shape = (2, 3)
    mask, r, out = np.ones(shape, dtype=np.bool_), np.ones(shape), padded_like(shape)
    found = pressure.normal_residual(np.zeros(shape), np.ones(shape), 0.5, mask, r, np.zeros(shape), out)
    assert found == (0.5, 0)
    assert not mask.any()
    assert not out.any()


@pytest.mark.parametrize("zr_old", [0.0, 0.7, 1e-3])
@pytest.mark.parametrize("shape", BOXES)
def test_normal_direction(shape: tuple[int, int], zr_old: float) -> None:
    rng = np.random.default_rng(10)
    z, r, r_old, d = (rng.normal(size=shape) for _ in range(4))
    mask = rng.random(shape) < 0.7
    mask[0, 0] = True
    r[~mask] = 0.0
    centred = np.where(mask, z - z[mask].mean(), 0.0)
    change = float((centred * (r - r_old)).sum())
    beta = max(change / zr_old, 0.0) if zr_old > 0.0 else 0.0
    expected = np.where(mask, centred + beta * d, 0.0)
    work = in_corner(z)
    zr, size = pressure.normal_direction(work, mask, r, r_old, d, zr_old)
    assert zr == pytest.approx(float((centred * r).sum()), abs=1e-13)
    assert size == pytest.approx(np.linalg.norm(centred), abs=1e-13)
    np.testing.assert_allclose(d, expected, rtol=1e-12, atol=1e-12 * max(1.0, beta))
    check_padded(work, d)


def test_normal_direction_never_goes_back() -> None:
    """Polak and Ribiere's factor changes its sign with r - r_old: the direction is used, and then it is not."""
    shape = (3, 4)
    rng = np.random.default_rng(11)
    z, r, d = (rng.normal(size=shape) for _ in range(3))
    mask = np.ones(shape, dtype=np.bool_)
    centred = z - z.mean()
    for sign in (1.0, -1.0):
        r_old = r - sign * centred
        new = d.copy()
        pressure.normal_direction(in_corner(z), mask, r, r_old, new, 0.5)
        beta = float((centred**2).sum()) / 0.5 if sign > 0.0 else 0.0
        np.testing.assert_allclose(new, centred + beta * d, rtol=1e-12, atol=1e-13)


def test_normal_step_without_a_direction() -> None:
    """The pressures are scaled, and that is all: no 0/0."""
    shape = (3, 2)
    p, g = np.array([[1.0, 0.0], [2.0, 0.0], [0.0, 1.0]]), np.ones(shape)
    nothing = np.zeros(shape)
    found = pressure.normal_step(p, g, nothing, in_corner(nothing), np.ones(shape), 6.0)
    assert found == (0, 1.5)
    np.testing.assert_array_equal(p, [[1.5, 0.0], [3.0, 0.0], [0.0, 1.5]])
    np.testing.assert_array_equal(g, 1.0)


@pytest.mark.parametrize("definite", [True, False])
@pytest.mark.parametrize("shape", BOXES)
def test_normal_step(shape: tuple[int, int], definite: bool) -> None:
    """A step to the minimum along d, cut at zero and scaled to the total; none if d A d is not positive."""
    rng = np.random.default_rng(12)
    p, g, r = random_pressure(rng, shape), rng.normal(size=shape), rng.normal(size=shape)
    p[0, 0] = 1.0
    d = rng.normal(size=shape) * (rng.random(shape) < 0.8)
    d[0, 0] = 0.3
    image = (0.5 if definite else -0.5) * d
    r *= np.sign((r * d).sum())  # forwards, so that the first cell keeps its pressure
    step = float((r * d).sum() / (d * image).sum()) if definite else 0.0
    raw = p + step * d
    stopped = (raw <= 0.0) & ((p > 0.0) | (d != 0.0))
    expected = np.maximum(raw, 0.0)
    scale = 3.0 / expected.sum()
    expected_g = g + step * image
    found = pressure.normal_step(p, g, d, in_corner(image), r, 3.0)
    assert found[0] == stopped.sum()
    assert found[1] == pytest.approx(scale, rel=1e-12)
    np.testing.assert_allclose(p, scale * expected, rtol=1e-12)
    np.testing.assert_allclose(g, expected_g, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("shape", BOXES)
def test_displacements_of_single_cells(shape: tuple[int, int]) -> None:
    """Between cells, and by pressures on some of them, from coefficients at offsets >= 0."""
    rng = np.random.default_rng(14)
    coefficients = rng.normal(size=(shape[0] + 1, shape[1] + 2))
    p = random_pressure(rng, shape)
    cells = np.argwhere(rng.random(shape) < 0.7)
    offsets = np.abs(cells[:, None] - cells[None, :])
    matrix = np.full((len(cells), len(cells)), np.nan)
    pressure.displacement_matrix(coefficients, cells, matrix)
    upper = np.triu(np.ones(matrix.shape, dtype=bool))
    np.testing.assert_array_equal(matrix[upper], coefficients[offsets[..., 0], offsets[..., 1]][upper])
    assert np.isnan(matrix[~upper]).all()
    before = rng.normal(size=len(cells))
    out = before.copy()
    loaded = np.argwhere(p)
    pressure.add_displacement(coefficients, p, loaded, cells, out)
    offsets = np.abs(cells[:, None] - loaded[None, :])
    expected = before + coefficients[offsets[..., 0], offsets[..., 1]] @ p[p > 0.0]
    np.testing.assert_allclose(out, expected, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 9, 40])
def test_factorise(n: int) -> None:
    """As NumPy does, from the upper triangle alone; what is below stays as it is."""
    rng = np.random.default_rng(16)
    root = rng.normal(size=(n, n)) + n * np.eye(n)
    matrix = root @ root.T
    lower = np.tril(np.ones((n, n), dtype=bool), -1)
    found = np.where(lower, np.nan, matrix)
    assert pressure.factorise(found)
    np.testing.assert_allclose(found[~lower], np.linalg.cholesky(matrix).T[~lower], rtol=1e-12, atol=1e-12 * n)
    assert np.isnan(found[lower]).all()


@pytest.mark.parametrize("wrong", [0.0, -1.0, np.nan])
@pytest.mark.parametrize("place", [0, 2, 6])
def test_factorise_what_is_not_positive(wrong: float, place: int) -> None:
    matrix = np.eye(7)
    matrix[place, place] = wrong
    assert not pressure.factorise(matrix)
    indefinite = np.full((7, 7), 2.0) - np.eye(7)
    assert not pressure.factorise(indefinite)


@pytest.mark.parametrize("n", [1, 2, 9])
def test_solve_factorised(n: int) -> None:
    rng = np.random.default_rng(15)
    root = rng.normal(size=(n, n)) + n * np.eye(n)
    matrix, x = root @ root.T, rng.normal(size=n)
    solution = x.copy()
    pressure.solve_factorised(np.ascontiguousarray(np.linalg.cholesky(matrix).T), solution)
    np.testing.assert_allclose(matrix @ solution, x, rtol=1e-11, atol=1e-12)


# --- tractions ---


class Contact:
    """Random cells in a box, some of them slip cells, with directions of the bound and two padded arrays."""

    def __init__(self, shape: tuple[int, int], seed: int = 0) -> None:
        self.rng = rng = np.random.default_rng([*shape, seed])
        inside = rng.random(shape) < 0.75
        inside[0, 0] = True
        self.cells = np.ascontiguousarray(np.argwhere(inside))
        self.m = m = len(self.cells)
        self.slip = rng.random(m) < 0.5
        angle = rng.uniform(-math.pi, math.pi, size=m)
        self.normal = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        self.across = np.stack([-np.sin(angle), np.cos(angle)], axis=1)
        self.share, self.diagonal = rng.uniform(0.01, 1.0, size=m), 0.8
        self.v = rng.normal(size=2 * m)
        self.unit = 0.7
        self.field = rng.normal(size=(2, shape[0], shape[1] + 3))
        self.places = self.cells @ np.array([shape[1] + 3, 1])

    def flat(self, field: np.ndarray) -> np.ndarray:
        """Two padded arrays whose rows lie one after the other."""
        return field.reshape(2, -1)

    def empty(self) -> np.ndarray:
        """Two padded arrays of leftovers."""
        return np.full(self.field.shape, np.nan)

    def at(self, field: np.ndarray) -> np.ndarray:
        """Pairs [m, 2] of two padded arrays at the cells."""
        return np.array([[field[0, i, j], field[1, i, j]] for i, j in self.cells])

    def vectors(self, unknowns: np.ndarray) -> np.ndarray:
        """Vectors [m, 2] of unknowns: slip cells' are along the bound's direction, in units, and across it."""
        pairs = unknowns.reshape(-1, 2)
        turned = self.unit * pairs[:, :1] * self.normal + pairs[:, 1:] * self.across
        return np.where(self.slip[:, None], turned, pairs)

    def elsewhere(self, field: np.ndarray) -> np.ndarray:
        """What the arrays hold outside the cells."""
        mask = np.ones(field.shape[1:], dtype=bool)
        mask[self.cells[:, 0], self.cells[:, 1]] = False
        return field[:, mask]


def test_rigid_slip() -> None:
    """The paper's Eq. 5, its spin part a little ahead."""
    rng = np.random.default_rng(8)
    x, y = rng.normal(size=(2, 5))
    out = np.full((5, 2), np.nan)
    tractions.rigid_slip(x, y, 0.3, -0.2, 1.7, 0.1, out)
    np.testing.assert_allclose(out, np.stack([0.3 - 1.7 * y, 1.7 * (x + 0.1) - 0.2], axis=1), rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("shape", BOXES)
def test_scatter_traction(shape: tuple[int, int]) -> None:
    c = Contact(shape)
    out = c.empty()
    tractions.scatter_traction(c.v, c.places, c.slip, c.normal, c.unit, c.flat(out))
    np.testing.assert_allclose(c.at(out), c.vectors(c.v), rtol=1e-13, atol=1e-15)
    assert not c.elsewhere(out).any()


@pytest.mark.parametrize("shape", BOXES)
def test_slip_across_leading_tractions(shape: tuple[int, int]) -> None:
    """Tractions of some cells add to the slip across them, by displacements of the cells ahead."""
    c = Contact(shape)
    leading = np.flatnonzero(c.rng.random(c.m) < 0.4)
    part, q = c.rng.normal(size=leading.size), c.vectors(c.v)
    for m in range(c.m):
        assert tractions.traction_of(c.v, m, c.slip, c.normal, c.unit) == pytest.approx(tuple(q[m]), rel=1e-13)
    field = c.rng.normal(size=(2, shape[0] + 1, shape[1] + 3))
    after, ahead = field.copy(), c.places[leading] + shape[1] + 3
    tractions.add_cross_slip(c.v, leading, c.slip, c.normal, c.unit, part, ahead, c.flat(after))
    expected = np.zeros((c.m, 2))
    expected[leading] = part[:, None] * q[leading, ::-1]
    change = (after - field)[:, 1:, :]
    np.testing.assert_allclose(-c.at(change), expected, atol=1e-13)
    assert not c.elsewhere(change).any()
    assert not (after - field)[:, 0].any()


def test_slip_row() -> None:
    """Slip along the bound's direction counts for nothing, slip across it as c, a traction across it as (1 - c) b."""
    nx, ny = math.cos(0.7), math.sin(0.7)
    assert tractions.slip_row(nx, ny, nx, ny, 0.3, 2.0, 0.0) == pytest.approx(0.0, abs=1e-15)
    assert tractions.slip_row(-ny, nx, nx, ny, 0.3, 2.0, 0.0) == pytest.approx(0.3, rel=1e-15)
    assert tractions.slip_row(0.0, 0.0, nx, ny, 0.3, 2.0, 5.0) == pytest.approx(0.7 * 2.0 * 5.0, rel=1e-15)


@pytest.mark.parametrize("shape", BOXES)
def test_gather_slip(shape: tuple[int, int]) -> None:
    """Cells ahead in the next row, as they lie on cells that are not moved."""
    c = Contact(shape)
    out, slips, alone = (np.full(2 * c.m, np.nan) for _ in range(3))
    field = c.rng.normal(size=(2, shape[0] + 1, shape[1] + 3))
    flat, ahead = field.reshape(2, -1), shape[1] + 3
    tractions.gather_slip(flat, c.v, c.places, ahead, c.slip, c.normal, c.share, c.diagonal, slips, out)
    pairs, s = c.v.reshape(-1, 2), c.at(field[:, :-1] - field[:, 1:])
    np.testing.assert_array_equal(slips.reshape(-1, 2), s)
    across = c.share * (c.across * s).sum(axis=1) + (1.0 - c.share) * c.diagonal * pairs[:, 1]
    expected = np.where(c.slip[:, None], np.stack([pairs[:, 0], across], axis=1), s)
    np.testing.assert_allclose(out.reshape(-1, 2), expected, rtol=1e-13, atol=1e-14)
    tractions.gather_slips(flat, c.places, ahead, alone)
    np.testing.assert_array_equal(alone, slips)


@pytest.mark.parametrize("m", [1, 7, 30])
def test_classify(m: int) -> None:
    """Some cells stick, some slip, one is just at the bound, some have slip that would turn them round: these stick.

    What belongs to slip cells stays as it was in others.
    """
    rng = np.random.default_rng(m)
    q, s, bound, rho = rng.normal(size=(m, 2)), rng.normal(size=(m, 2)), rng.uniform(1.0, 3.0, size=m), 0.6
    q[0], s[0], bound[0] = (3.0, 4.0), (0.0, 0.0), 5.0
    for k in range(1, m, 3):
        s[k] = rng.uniform(2.0, 9.0) * q[k]
    slip = rng.random(m) < 0.5
    normal, share = np.full((m, 2), 7.0), np.full(m, 7.0)
    slipping, square, of_q = tractions.classify(q, s, bound, rho, slip, normal, share)
    expected_square = 0.0
    for k in range(m):
        t = q[k] - rho * s[k]
        size = np.linalg.norm(t)
        reversed_by = -float(t @ q[k]) / (size * bound[k])
        assert slip[k] == (size > bound[k] and reversed_by < 0.1)
        projected = t * min(1.0, bound[k] / size)
        expected_square += float(((q[k] - projected) ** 2).sum())
        np.testing.assert_allclose(normal[k], t / size if slip[k] else [7.0, 7.0], rtol=1e-13)
        assert share[k] == (pytest.approx(bound[k] / size, rel=1e-13) if slip[k] else 7.0)
    assert not slip[0]
    if m == 30:
        rest = q - rho * s
        turned = (np.hypot(*rest.T) > bound) & ~slip
        assert turned.any()
        assert slip.any()
    assert slipping == slip.sum()
    assert square == pytest.approx(expected_square, rel=1e-12)
    assert of_q == pytest.approx(np.sum(q**2), rel=1e-14)


def test_slip_damping() -> None:
    """From a share of all to next to nothing; what passes stops at a third. What belongs to stick cells stays."""
    share = np.array([1.0, 0.9, 0.34, 1.0 / 3.0, 0.32, 1e-7, 0.5])
    slip = np.array([False, True, True, True, True, True, False])
    damping, root = np.full((2, 7), 7.0)
    total, near = tractions.slip_damping(share, slip, 0.7, damping, root)
    assert total == pytest.approx(share[slip].sum(), rel=1e-15)
    assert near == 3
    passing = np.where(share > 0.33, 1.0 / (1.0 + 0.7 * (1.0 / share - 1.0)), 0.0)
    np.testing.assert_allclose(damping, np.where(slip, passing, 7.0), rtol=1e-15)
    np.testing.assert_allclose(root, np.where(slip, np.sqrt(share), 7.0), rtol=1e-15)
    assert tractions.slip_damping(share, np.zeros(7, dtype=np.bool_), 0.7, damping, root) == (0.0, 0)


@pytest.mark.parametrize("shape", BOXES)
def test_newton_residual(shape: tuple[int, int]) -> None:
    c = Contact(shape)
    s, q, out = c.rng.normal(size=(c.m, 2)), c.rng.normal(size=(c.m, 2)), np.full(2 * c.m, np.nan)
    bound = c.rng.uniform(0.5, 2.0, size=c.m)
    tractions.newton_residual(s, q, c.slip, c.normal, c.share, c.diagonal, bound, c.unit, out)
    along = ((c.normal * q).sum(axis=1) - bound) / c.unit
    share = c.share[:, None]
    across = (c.across * (share * s + (1.0 - share) * c.diagonal * q)).sum(axis=1)
    rows = np.where(c.slip[:, None], np.stack([along, across], axis=1), s)
    np.testing.assert_allclose(out.reshape(-1, 2), -rows, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("shape", BOXES)
def test_add_step(shape: tuple[int, int]) -> None:
    c = Contact(shape)
    q, out = c.rng.normal(size=(c.m, 2)), np.full((c.m, 2), np.nan)
    tractions.add_step(q, c.v, c.slip, c.normal, c.unit, out)
    np.testing.assert_allclose(out, q + c.vectors(c.v), rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("m", [1, 40])
def test_put_on_bound(m: int) -> None:
    """Stick cells within, slip cells on it, what misses it by rounding alone as it is: once more changes nothing."""
    rng = np.random.default_rng(m)
    q, bound, slip = rng.normal(size=(m, 2)), rng.uniform(0.5, 2.0, size=m), rng.random(m) < 0.5
    angle = rng.uniform(-math.pi, math.pi, size=m)
    normal = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    q[0], slip[0] = (bound[0] * (1.0 - 1e-14), 0.0), True
    out, again = np.full((m, 2), np.nan), np.full((m, 2), np.nan)
    tractions.put_on_bound(q, slip, normal, bound, out)
    size = np.hypot(*q.T)
    expected = np.where((size > bound)[:, None], q * (bound / size)[:, None], q)
    short = slip & (size < bound * (1.0 - 1e-13))
    expected[short] = bound[short, None] * normal[short]
    np.testing.assert_allclose(out, expected, rtol=1e-14)
    np.testing.assert_array_equal(out[0], q[0])
    assert (np.hypot(*out.T) <= bound * (1.0 + 1e-15)).all()
    tractions.put_on_bound(out, slip, normal, bound, again)
    np.testing.assert_array_equal(again, out)


class Torus(Contact):
    """The same with arrays of pairs, [px, py, 2], in place of two padded ones."""

    def __init__(self, shape: tuple[int, int], seed: int = 0) -> None:
        super().__init__(shape, seed)
        self.pairs = np.ascontiguousarray(np.moveaxis(self.field, 0, -1))

    def empty(self) -> np.ndarray:
        return np.full(self.pairs.shape, 7.0)

    def flat(self, field: np.ndarray) -> np.ndarray:
        return field.reshape(-1, 2)

    def at(self, field: np.ndarray) -> np.ndarray:
        return super().at(np.moveaxis(field, -1, 0))

    def elsewhere(self, field: np.ndarray) -> np.ndarray:
        return super().elsewhere(np.moveaxis(field, -1, 0))

    def damping(self) -> np.ndarray:
        """Factors [m] by which displacements pass cells: stick cells' mean nothing, half of the others pass none."""
        passing = self.rng.random(self.m) < 0.5
        return np.where(self.slip & ~passing, 0.0, self.rng.uniform(0.1, 1.0, size=self.m))


@pytest.mark.parametrize("shape", BOXES)
def test_near_residual(shape: tuple[int, int]) -> None:
    c = Torus(shape)
    damping, out = c.damping(), c.empty()
    tractions.near_residual(c.v, c.places, c.slip, c.normal, c.share, damping, c.flat(out))
    across = (np.where(damping > 0.0, c.v[1::2] / c.share, 0.0))[:, None] * c.across
    expected = np.where(c.slip[:, None], across, c.v.reshape(-1, 2))
    np.testing.assert_allclose(c.at(out), expected, rtol=1e-14)
    assert not c.elsewhere(out).any()


@pytest.mark.parametrize("shape", BOXES)
@pytest.mark.parametrize("in_place", [False, True])
def test_integrate_rows(shape: tuple[int, int], in_place: bool) -> None:
    c = Torus(shape)
    damping, dx = c.damping(), 0.3
    slips, edge = c.pairs.copy(), np.full((c.pairs.shape[1], 2), np.nan)
    out = slips if in_place else c.empty()
    of_rows = c.cells, c.places, c.slip, c.normal, damping, dx, edge
    tractions.integrate_rows(c.flat(slips), *of_rows, c.flat(out))
    expected, of_cells = np.full((c.m, 2), np.nan), c.at(c.pairs)
    for j in range(shape[1]):
        u = np.zeros(2)
        for i in reversed(range(shape[0])):
            for k in np.flatnonzero((c.cells == (i, j)).all(axis=1)):
                u = u + dx * of_cells[k]
                u = damping[k] * (c.across[k] @ u) * c.across[k] if c.slip[k] else u
                expected[k] = u
    np.testing.assert_allclose(c.at(out), expected, rtol=1e-12, atol=1e-14)
    np.testing.assert_array_equal(c.elsewhere(out), c.elsewhere(c.pairs if in_place else c.empty()))


@pytest.mark.parametrize("shape", BOXES)
def test_store_near(shape: tuple[int, int]) -> None:
    c = Torus(shape)
    damping = c.damping()
    tau = np.where(damping > 0.0, (c.across * c.at(c.pairs)).sum(axis=1), 0.0)
    out, known = np.full(2 * c.m, np.nan), c.empty()
    tractions.store_near(c.flat(c.pairs), c.v, c.places, c.slip, c.normal, damping, c.unit, out, c.flat(known))
    expected = np.where(c.slip[:, None], np.stack([c.v[0::2], tau], axis=1), c.at(c.pairs))
    np.testing.assert_allclose(out.reshape(-1, 2), expected, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(c.at(known), c.vectors(out), rtol=1e-14, atol=1e-15)
    assert (c.elsewhere(known) == 7.0).all()


@pytest.mark.parametrize("shape", BOXES)
def test_slip_residual(shape: tuple[int, int]) -> None:
    c = Torus(shape)
    found, out = c.rng.normal(size=2 * c.m), c.empty()
    rest = c.v[1::2] - c.share * (c.across * c.at(c.pairs)).sum(axis=1)
    rest -= (1.0 - c.share) * c.diagonal * found[1::2]
    root = np.sqrt(c.share)
    tractions.slip_residual(c.flat(c.pairs), c.v, c.places, c.slip, c.normal, root, c.diagonal, found, c.flat(out))
    expected = np.where(c.slip[:, None], (rest / root)[:, None] * c.across, 0.0)
    np.testing.assert_allclose(c.at(out), expected, rtol=1e-12, atol=1e-14)
    assert (c.elsewhere(out) == 7.0).all()


@pytest.mark.parametrize("shape", BOXES)
def test_gather_slip_traction(shape: tuple[int, int]) -> None:
    """Stick cells' unknowns stay."""
    c = Torus(shape)
    before = c.rng.normal(size=2 * c.m)
    out = before.copy()
    tractions.gather_slip_traction(c.flat(c.pairs), c.places, c.slip, c.normal, c.share, out)
    tau = np.where(c.slip, c.share * (c.across * c.at(c.pairs)).sum(axis=1), 0.0)
    np.testing.assert_array_equal(out[0::2], before[0::2])
    np.testing.assert_allclose(out[1::2], before[1::2] + tau, rtol=1e-12, atol=1e-14)


def place_of(window: tuple[int, int], coarse: tuple[int, int]) -> tuple[float, float]:
    """Where the centre of a window's first cell is in coarse cells, the centres of both windows being one point."""
    x, y = (0.5 * (0.0 - 0.5 * (fine - 1)) + 0.5 * (n - 1) for fine, n in zip(window, coarse, strict=True))
    return x, y


def test_spread_fractions() -> None:
    c = Contact((5, 6))
    values, mask = np.zeros((2, 5, 6)), np.zeros((5, 6), dtype=np.bool_)
    q, bound = c.rng.normal(size=(c.m, 2)), c.rng.uniform(0.5, 2.0, size=c.m)
    meshes.spread_fractions(q, bound, c.cells, values, mask)
    places = {(i, j): m for m, (i, j) in enumerate(c.cells.tolist())}
    for i in range(5):
        for j in range(6):
            m = places.get((i, j))
            assert mask[i, j] == (m is not None)
            assert values[:, i, j].tolist() == ([0.0, 0.0] if m is None else (q[m] / bound[m]).tolist())


@pytest.mark.parametrize("window", [(1, 1), (2, 2), (1, 7), (6, 1), (7, 8), (10, 9)])
def test_interpolate_cells(window: tuple[int, int]) -> None:
    """Coarse cells are missing in every combination; odd windows shift one mesh by half a cell against the other."""
    c = Contact(window)
    coarse = (window[0] + 1) // 2, (window[1] + 1) // 2
    mask = c.rng.random(coarse) < 0.6
    mask[-1, -1] = True
    values = c.rng.normal(size=(3, *coarse))
    out, weight = np.zeros((c.m, 3)), np.zeros(c.m)
    meshes.interpolate_cells(values, mask, c.cells, *place_of(window, coarse), out, weight)
    expected_out, expected_weight = naive.from_twice_the_size(values, mask, c.cells, window)
    np.testing.assert_allclose(weight, expected_weight, atol=1e-15)
    np.testing.assert_allclose(out, expected_out, atol=1e-14)


@pytest.mark.parametrize("window", [(8, 6), (9, 7), (7, 10)])
def test_interpolate_cells_inside(window: tuple[int, int]) -> None:
    """Cells between coarse centres, all of which count: SciPy's bilinear interpolation."""
    rng = np.random.default_rng(13)
    coarse = (window[0] + 1) // 2, (window[1] + 1) // 2
    values = rng.normal(size=(2, *coarse))
    cells = np.argwhere(np.ones((window[0] - 2, window[1] - 2), dtype=bool)) + 1
    out, weight = np.zeros((len(cells), 2)), np.zeros(len(cells))
    meshes.interpolate_cells(values, np.ones(coarse, dtype=np.bool_), cells, *place_of(window, coarse), out, weight)
    centres = [2.0 * (np.arange(n) - 0.5 * (n - 1)) for n in coarse]
    at = cells - 0.5 * (np.array(window) - 1.0)
    for k in range(2):
        np.testing.assert_allclose(out[:, k], RegularGridInterpolator(centres, values[k])(at), atol=1e-14)
    np.testing.assert_allclose(weight, 1.0, rtol=1e-15)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 7, 13])
def test_arnoldi_step_and_gmres_update(n: int) -> None:
    """Directions that are no images of each other, as in flexible GMRES; residuals and solutions by least squares."""
    rng = np.random.default_rng(n)
    a, start = rng.normal(size=(n, n)), rng.normal(size=n)
    steps = min(n, 6)
    beta = float(np.linalg.norm(start))
    v, h = np.full((steps + 1, n), np.nan), np.zeros((steps + 1, steps))
    rotation, g = np.zeros((2, steps)), np.zeros(steps + 1)
    v[0], g[0] = start / beta, beta
    z = rng.normal(size=(steps, n))
    for k in range(steps):
        w = np.append(a @ z[k], 99.0)  # rows that are no part of the system may follow
        residual = gmres.arnoldi_step(v, k, w, h, rotation, g)
        np.testing.assert_array_equal(w, np.append(a @ z[k], 99.0))
        images = (a @ z[: k + 1].T)[:, : k + 1]
        y, *_ = np.linalg.lstsq(images, start, rcond=None)
        assert residual == pytest.approx(np.linalg.norm(start - images @ y), abs=1e-10 * beta)
        x = np.full(n, np.nan)
        gmres.gmres_update(h, g, z, z, k + 1, x, np.empty(0))
        np.testing.assert_allclose(x, z[: k + 1].T @ y, rtol=1e-8, atol=1e-8)
        if k + 1 < n:
            np.testing.assert_allclose(v[: k + 2] @ v[: k + 2].T, np.eye(k + 2), atol=1e-12)
            # the images lie in the span of the basis: v^T images is the Hessenberg matrix, and h its R
            hessenberg = v[: k + 2] @ images
            np.testing.assert_allclose(v[: k + 2].T @ hessenberg, images, atol=1e-11)
            assert np.abs(np.tril(hessenberg, -2)).max(initial=0.0) <= 1e-11
            triangle = np.linalg.qr(hessenberg)[1]
            triangle *= np.sign(triangle.diagonal())[:, None]
            np.testing.assert_allclose(h[: k + 1, : k + 1], triangle, atol=1e-10)


def test_arnoldi_step_ends_when_the_space_is_exhausted() -> None:
    """An image that lies in the basis: residual zero, the next vector zero and not a number by 0/0."""
    v, h = np.full((2, 3), np.nan), np.zeros((2, 1))
    rotation, g = np.zeros((2, 1)), np.array([2.0, 0.0])
    v[0] = (0.0, 1.0, 0.0)
    assert gmres.arnoldi_step(v, 0, np.array([0.0, 5.0, 0.0]), h, rotation, g) == 0.0
    np.testing.assert_array_equal(v[1], 0.0)
    np.testing.assert_array_equal(h, [[5.0], [0.0]])
    np.testing.assert_array_equal(g, [2.0, 0.0])


def test_arnoldi_step_of_no_image() -> None:
    """Where the image of a direction is zero, so is its column, and the residual stays; nothing is 0/0."""
    v, h = np.full((2, 3), np.nan), np.zeros((2, 1))
    rotation, g = np.zeros((2, 1)), np.array([2.0, 0.0])
    v[0] = (0.0, 1.0, 0.0)
    gmres.arnoldi_step(v, 0, np.zeros(3), h, rotation, g)
    np.testing.assert_array_equal(v[1], 0.0)
    np.testing.assert_array_equal(h, 0.0)
    np.testing.assert_array_equal(rotation, [[1.0], [0.0]])
    np.testing.assert_array_equal(g, [2.0, 0.0])


@pytest.mark.parametrize("k", [1, 2, 5])
def test_gmres_update(k: int) -> None:
    """A triangular solve that looks at nothing below the diagonal or beyond k; an empty column counts for nothing."""
    rng = np.random.default_rng(k)
    h, g, z = rng.normal(size=(k + 3, k + 2)), rng.normal(size=k + 3), rng.normal(size=(k + 2, 9))
    h[np.arange(k), np.arange(k)] += 3.0
    w, more = rng.normal(size=(k + 2, 13)), np.full(4, np.nan)
    x = np.full(9, np.nan)
    y = np.linalg.solve(np.triu(h[:k, :k]), g[:k])
    gmres.gmres_update(h, g, z, w, k, x, more)
    np.testing.assert_allclose(x, z[:k].T @ y, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(more, w[:k, 9:].T @ y, rtol=1e-12, atol=1e-12)
    h[k - 1, k - 1] = 0.0
    gmres.gmres_update(h, g, z, w, k, x, np.empty(0))
    assert np.isfinite(x).all()
    rest = np.linalg.solve(np.triu(h[: k - 1, : k - 1]), g[: k - 1])
    np.testing.assert_allclose(x, z[: k - 1].T @ rest, rtol=1e-12, atol=1e-12)


# --- pressure and tractions together ---


def test_multiply_3x3() -> None:
    """Displacements along the surface by pressure are odd, so imaginary; u_z by tractions is their mirror image."""
    rng = np.random.default_rng(31)
    hat = random_complex(rng, 3, 4, 3)
    pair, along, gap, dx = rng.normal(size=(3, 4, 3)), rng.normal(size=(2, 4, 3)), rng.normal(size=(4, 3)), 0.3
    x, y = 1j * along
    matrix = np.array([[pair[0], pair[1], x], [pair[1], pair[2], y], [-dx * x, -dx * y, gap]])
    expected = np.einsum("abij,bij->aij", matrix, hat)
    coupled.multiply_3x3(hat.view(np.float64), np.repeat(pair, 2, axis=2), along, dx, gap)
    np.testing.assert_allclose(hat, expected, rtol=1e-13)


@pytest.mark.parametrize("shape", BOXES)
def test_touching_cells(shape: tuple[int, int]) -> None:
    """Under pressure, or overlapping without it; the approach may be negative."""
    rng = np.random.default_rng(33)
    for sign in (1.0, -1.0):
        stress, response = rng.normal(size=(3, *shape)), sign * rng.uniform(0.5, 1.5, size=(3, *shape))
        stress[2] = random_pressure(rng, shape)
        stress[2, 0, 0] = 1.0
        inside = stress[2] > 0.0
        mean = response[2][inside].mean()
        cells = np.full((inside.size, 2), -1)
        m, deep, approach = coupled.touching_cells(stress, response, 0.2, cells)
        assert approach == pytest.approx(mean, rel=1e-13)
        np.testing.assert_array_equal(cells[:m], np.argwhere(inside | (response[2] < mean)))
        assert deep == (~inside & (response[2] < mean - 0.2 * abs(mean))).sum()


@pytest.mark.parametrize("shape", BOXES)
def test_gather_and_scatter_contact(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(34)
    c = Contact(shape)
    stress, response = rng.normal(size=(3, *shape)), rng.normal(size=(3, *shape))
    p, q, s = np.empty(c.m), np.empty((c.m, 2)), np.empty((c.m, 2))
    coupled.gather_contact(stress, response, c.cells, p, q, s)
    i, j = c.cells.T
    np.testing.assert_array_equal(p, stress[2, i, j])
    np.testing.assert_array_equal(q.T, stress[:2, i, j])
    np.testing.assert_array_equal(s.T, response[:2, i, j])
    out = np.full(stress.shape, np.nan)
    coupled.scatter_contact(p, q, c.cells, out)
    inside = np.zeros(shape, dtype=bool)
    inside[i, j] = True
    np.testing.assert_array_equal(out, np.where(inside, stress, 0.0))


@pytest.mark.parametrize("shape", BOXES)
def test_scatter_unknowns(shape: tuple[int, int]) -> None:
    """In slip cells the traction has mu p and the unknown along the bound's direction, and the unknown across it."""
    c = Contact(shape)
    v = np.random.default_rng(35).normal(size=3 * c.m)
    out = np.full((3, *c.field.shape[1:]), np.nan)
    coupled.scatter_unknowns(v, c.cells, c.slip, c.normal, 0.4, c.unit, out)
    p = v[: c.m]
    expected = c.vectors(v[c.m :]) + np.where(c.slip, 0.4 * p, 0.0)[:, None] * c.normal
    np.testing.assert_allclose(c.at(out[:2]), expected, rtol=1e-13, atol=1e-14)
    np.testing.assert_array_equal(out[2][c.cells[:, 0], c.cells[:, 1]], p)
    assert not c.elsewhere(out).any()


@pytest.mark.parametrize("shape", BOXES)
def test_uneven_parts(shape: tuple[int, int]) -> None:
    """What is left without the mean over the cells, spread into a larger array and gathered."""
    c = Contact(shape)
    i, j = c.cells.T
    mean = c.field[0][i, j].mean()
    assert coupled.mean_at(c.field[0], c.cells) == pytest.approx(mean, abs=1e-14)
    values = c.field[0][i, j] - mean
    out = np.full((shape[0] + 2, shape[1] + 1), np.nan)
    coupled.spread_uneven(c.field[0], c.cells, 1.7, out)
    np.testing.assert_allclose(out[i, j], 1.7 * values, rtol=1e-12, atol=1e-14)
    out[i, j] = 0.0
    assert not out.any()
    found = np.full(c.m, np.nan)
    coupled.gather_uneven(c.field[0], c.cells, found)
    np.testing.assert_allclose(found, values, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("shape", BOXES)
def test_move_contact(shape: tuple[int, int]) -> None:
    """Pressures cut and scaled to the load; slip cells on their new bounds; no traction where no pressure is left."""
    rng = np.random.default_rng(36)
    c = Contact(shape)
    mu, total = 0.4, 7.0
    p = rng.uniform(0.0, 1.0, size=c.m)
    q = np.where(c.slip[:, None], mu * p[:, None] * c.normal + rng.normal(size=(c.m, 1)) * c.across, 0.3)
    change = rng.normal(size=3 * c.m)
    change[0] = 1.0
    raw = np.maximum(p + change[: c.m], 0.0)
    new_p = raw * total / raw.sum()
    moved = q + mu * (new_p - p)[:, None] * c.normal + c.vectors(change[c.m :])
    on_bound = moved * (mu * new_p / np.hypot(*moved.T))[:, None]
    expected = np.where(c.slip[:, None], on_bound, q + change[c.m :].reshape(-1, 2))
    expected[new_p == 0.0] = 0.0
    coupled.move_contact(change, c.slip, c.normal, mu, c.unit, total, p, q)
    np.testing.assert_allclose(p, new_p, rtol=1e-13)
    np.testing.assert_allclose(q, expected, rtol=1e-11, atol=1e-13)


def test_move_contact_of_a_slip_cell_without_traction() -> None:
    """It has no direction yet: it stays without, and is no 0/0."""
    p, q, normal = np.array([1.0, 2.0]), np.zeros((2, 2)), np.array([[1.0, 0.0], [0.0, 1.0]])
    coupled.move_contact(np.zeros(6), np.array([True, False]), normal, 0.4, 1.0, 3.0, p, q)
    np.testing.assert_array_equal(p, [1.0, 2.0])
    np.testing.assert_array_equal(q, 0.0)


# --- rules ---

PACKAGE = Path(rcstudy.__file__).parent
KERNELS = sorted((PACKAGE / "mechanics" / "kernels").glob("[!_]*.py"))


def names_read(code: CodeType) -> set[str]:
    """Global names that a function reads, functions inside it included."""
    names = {step.argval for step in dis.get_instructions(code) if step.opname in ("LOAD_GLOBAL", "LOAD_NAME")}
    return names.union(*(names_read(inner) for inner in code.co_consts if isinstance(inner, CodeType)))


def broken_rules(source: str) -> list[str]:
    """What in a kernel file breaks the rules: functions under `jit` alone, reading math, np and each other alone."""
    broken = []
    tree = ast.parse(source)
    kernels = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            if [ast.unparse(decorator) for decorator in node.decorator_list] != ["jit"]:
                broken.append(f"{node.name}: not decorated with jit alone")
        elif isinstance(node, ast.Import | ast.ImportFrom):
            if ast.unparse(node) not in (
                "from __future__ import annotations",
                "import math",
                "import numpy as np",
                "from rcstudy.mechanics.jit import jit",
            ):
                broken.append(ast.unparse(node))
        elif not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
            broken.append(f"line {node.lineno}: neither import nor function")
    allowed = {"math", "np"} | kernels | set(dir(builtins))
    for code in compile(source, "kernels", "exec").co_consts:
        if isinstance(code, CodeType):
            broken += [f"{code.co_name} reads {name}" for name in sorted(names_read(code) - allowed)]
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.Lambda) and node not in tree.body:
            broken.append(f"line {node.lineno}: a function inside another")
        if isinstance(node, ast.Global | ast.Nonlocal):
            broken.append(f"line {node.lineno}: assigns a global")
        if isinstance(node, ast.Import | ast.ImportFrom) and node not in tree.body:
            broken.append(f"line {node.lineno}: import inside a function")
    return broken


@pytest.mark.parametrize("path", KERNELS, ids=lambda path: path.stem)
def test_kernel_files_keep_the_rules(path: Path) -> None:
    """No call leaves the file (Numba's cache would not notice a change there), and no state comes in."""
    assert broken_rules(path.read_text(encoding="utf-8")) == []


HEAD = "import numpy as np\nfrom rcstudy.mechanics.jit import jit\n"


@pytest.mark.parametrize(
    ("source", "complaint"),
    [
        ("def f(x):\n    return x\n", "f: not decorated with jit alone"),
        ("@jit\n@jit\ndef f(x):\n    return x\n", "f: not decorated with jit alone"),
        ("@jit(cache=False)\ndef f(x):\n    return x\n", "f: not decorated with jit alone"),
        ("from rcstudy.mechanics.kernels import arrays\n", "from rcstudy.mechanics.kernels import arrays"),
        ("import numba\n", "import numba"),
        ("SIZE = 3\n", "line 3: neither import nor function"),
        ("@jit\ndef f(x):\n    return norm2(x)\n", "f reads norm2"),
        ("@jit\ndef f(x):\n    return [a * SIZE for a in x]\n", "f reads SIZE"),
        ("@jit\ndef f(x):\n    import os\n", "line 5: import inside a function"),
        ("@jit\ndef f(x):\n    return (lambda y: y)(x)\n", "line 5: a function inside another"),
        ("@jit\ndef f(x):\n    global y\n    y = 1\n", "line 5: assigns a global"),
    ],
)
def test_broken_rules_are_seen(source: str, complaint: str) -> None:
    assert broken_rules(HEAD + source) == [complaint]
    assert broken_rules(HEAD + "@jit\ndef g(x):\n    return np.abs(x)\n\n@jit\ndef f(x):\n    return g(len(x))\n") == []


def numba_imports(source: str) -> list[int]:
    """Lines that import numba or part of it."""
    lines = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            lines += [node.lineno for alias in node.names if alias.name.split(".")[0] == "numba"]
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "numba":
            lines.append(node.lineno)
    return lines


def test_numba_is_imported_in_one_place() -> None:
    """So that its flags are stated once."""
    found = [path for path in sorted(PACKAGE.rglob("*.py")) if numba_imports(path.read_text(encoding="utf-8"))]
    assert found == [PACKAGE / "mechanics" / "jit.py"]
    assert numba_imports("import os\ndef f():\n    from numba import njit\n    import numba.core as core\n") == [3, 4]


def test_every_kernel_has_a_test_here() -> None:
    """Or in a file beside this one, `test_kernels_rows.py`."""
    called = {
        (node.func.value.id, node.func.attr)
        for path in Path(__file__).parent.glob("test_kernels*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and isinstance(node.func.value, ast.Name)
    }
    kernels = {
        (path.stem, node.name)
        for path in KERNELS
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef)
    }
    assert len(kernels) > 20
    assert kernels - called == set()
