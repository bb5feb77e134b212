"""Hankel transforms on logarithmic grids against scipy's, closed forms and quadrature."""

import numpy as np
import pytest
from scipy.fft import fht
from scipy.special import loggamma

from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.numerics.hankel import hankel_transforms, log_gamma, running_integral
from rcstudy.mechanics.scene import Layer, Material

STEP = 0.06
BIAS = -0.5


def log_grid(n):
    return np.log(2e4) + STEP * np.arange(1 - n, 1)


@pytest.mark.parametrize("real", [0.25, 0.75, 1.25, 1.75, 3.0])
def test_log_gamma(real):
    """The gamma functions themselves, to what rounding of an argument of up to 200 leaves."""
    z = real + 1j * np.linspace(0.0, 60.0, 400)
    assert np.abs(np.exp(log_gamma(z) - loggamma(z)) - 1.0).max() <= 1e-12


def test_closed_forms():
    """1e-10 of the largest, over five decades of r: the ends of the grid leave 1e-12, amplified like r^1/2."""
    log_k = log_grid(1120)
    k = np.exp(log_k)
    functions = np.stack([np.exp(-k), np.exp(-k), np.exp(-k), k * np.exp(-k)])
    log_r, found = hankel_transforms(functions, log_k, STEP, (0, 1, 2, 0), BIAS, 300)
    r = np.exp(log_r)
    d = np.hypot(1.0, r)
    # (d - 1)/r without cancellation
    tangent = r / (d + 1.0)
    expected = np.stack([1.0 / d, tangent / d, tangent**2 / d, d**-3])
    assert found.shape == (4, 300)
    np.testing.assert_allclose(log_r, -log_k[::-1][:300], rtol=0.0, atol=0.0)
    assert np.abs(found - expected).max() <= 1e-10


@pytest.mark.parametrize("order", [0, 1, 2])
def test_the_same_as_scipy(order):
    log_k = log_grid(960)
    f = np.exp(-np.exp(log_k)) * np.cos(3.0 * np.exp(log_k))
    log_r, found = hankel_transforms(f[None], log_k, STEP, (order,), BIAS, 250)
    expected = fht(f, STEP, order, bias=BIAS)[:250] * np.exp(-log_r)
    assert np.abs(found[0] - expected).max() <= 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("n", [8, 9, 30])
def test_running_integral_of_polynomials(n):
    """Degree 7 exactly, from the first node to the last."""
    t = 0.1 * np.arange(n)
    powers = np.arange(8)
    values = (powers + 1) * t[:, None] ** powers
    found = running_integral(values, 0.1)
    np.testing.assert_allclose(found, t[:, None] ** (powers + 1), rtol=1e-13, atol=1e-15)


def test_running_integral_converges():
    """An eighth order method: half the step, a hundredth of the error at the least."""
    errors = []
    for step in (0.2, 0.1):
        t = np.arange(0.0, 4.0 + 0.5 * step, step)
        errors.append(np.abs(running_integral(np.sin(3.0 * t)[:, None], step)[:, 0] - (1 - np.cos(3.0 * t)) / 3).max())
    assert errors[1] <= 1e-2 * errors[0] <= 1e-6


@pytest.mark.heavy
@pytest.mark.parametrize("spacing", [(0.03, 0.03), (0.03, 0.02)])
def test_coefficients_do_not_depend_on_what_else_was_asked_for(spacing):
    """Grown in any order or made at once, wide or long: the same bits."""

    def influence():
        return Influence(Material(210000.0, 0.3), (Layer(105000.0, 0.3, 0.06),), None, spacing, 5.0)

    whole = influence().quadrant(40, 40)
    grown = influence()
    for shape in ((3, 4), (8, 12), (20, 7), (13, 40), (40, 40)):
        part = grown.quadrant(*shape)
        np.testing.assert_array_equal(part, whole[:, : part.shape[1], : part.shape[2]])
    for shape in ((40, 2), (2, 40), (6, 30), (30, 6)):
        np.testing.assert_array_equal(influence().quadrant(*shape), whole[:, : shape[0], : shape[1]])


@pytest.mark.parametrize(("padded", "shape"), [((8, 9), (5, 5)), ((1, 6), (1, 4))])
def test_coefficients_around_a_torus(padded, shape):
    """Up to the offset half way round, `ahead` along x only."""
    influence = Influence(Material(210000.0, 0.3), (), None, (0.03, 0.03), 5.0)
    assert influence.around(padded).shape[1:] == shape
    assert influence.around(padded, ahead=1).shape[1:] == (shape[0] + 1, shape[1])


@pytest.mark.heavy
@pytest.mark.parametrize("shape", [(40, 40), (3, 30), (30, 3)])
def test_square_cells_are_like_cells_that_are_nearly_square(shape):
    """Square cells are taken from their mirror images, others are not: 1e-8 of the largest.

    That is by how much the two ways of integration differ where they meet: five cells away, or six.
    """
    bodies = Material(210000.0, 0.3), (Layer(4e5, 0.2, 0.1),), None
    square = Influence(*bodies, (0.03, 0.03), 5.0).quadrant(*shape)
    nearly = Influence(*bodies, (0.03, 0.03 * (1.0 + 1e-13)), 5.0).quadrant(*shape)
    error = np.abs(square - nearly).max(axis=(1, 2))
    assert (error <= 1e-8 * np.abs(nearly).max(axis=(1, 2))).all()
