"""What cells make of a straight edge: against SciPy's quadrature, strips, and contacts on many more cells."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import get_args

import numpy as np
import pytest
from contacts import steel
from scipy.integrate import quad

from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.contact import solve_normal
from rcstudy.mechanics.half_line import HALF_SPACE, OF_NO_LAYERS, for_pressure, for_tractions, wave_numbers
from rcstudy.mechanics.kernels import rows
from rcstudy.mechanics.layered import frequency_response
from rcstudy.mechanics.scene import Coupling, Creepage, Discretisation, Layer, Mesh, Scene
from rcstudy.result import Status
from rcstudy.solve import solve_scene

STEEL = steel(Mesh((1.0, 1.0), (8, 8)), counterbody=None).substrate
PERIOD = 2**14  # of a strip's influence coefficients

STACKS: dict[str, tuple[Layer, ...]] = {
    "none": (),
    "soft": (Layer(52500.0, 0.3, 0.05),),
    "stiff": (Layer(630000.0, 0.25, 0.05),),
    "two": (Layer(420000.0, 0.3, 0.02), Layer(30000.0, 0.4, 0.04)),
    "film": (Layer(2100.0, 0.45, 0.01),),
}


def responses(layers: tuple[Layer, ...], c: int = 0) -> Callable[[np.ndarray], np.ndarray]:
    """Response number `c` of `frequency_response`: 0 to pressure, 2 to tractions along the waves."""
    return lambda k: np.asarray(frequency_response(STEEL, layers, k)[c])


def by_cells(response: Callable[[np.ndarray], np.ndarray], t: np.ndarray) -> np.ndarray:
    """What cells of length 1 yield to waves of `t` a cell: the sum over 60 aliases to either side."""
    n = np.arange(-60, 61)
    k = t[:, None] + 2.0 * np.pi * n
    terms = response(np.abs(k).ravel()).reshape(k.shape) * np.sin(0.5 * k) / (0.5 * k)
    return np.asarray(0.5 * (terms.sum(axis=1) + terms[:, 1:-1].sum(axis=1)))


# --- the numbers ---


@pytest.mark.heavy
@pytest.mark.parametrize("tractions", [False, True])
@pytest.mark.parametrize("spacing", [0.02, 0.1])
@pytest.mark.parametrize("name", STACKS)
def test_half_line_by_quadrature(name: str, spacing: float, tractions: bool) -> None:
    """The Fourier series of log B and the shift, by SciPy; point sources are what aligned cells are without layers."""
    bodies = responses(STACKS[name], 2 if tractions else 0)

    def response(k: np.ndarray) -> np.ndarray:
        return bodies(k / spacing) / (1e-6 * bodies(np.array([1e-6 / spacing]))[0])

    @cache  # asked for at the same places for each term
    def log_b(t: float) -> float:
        t_ = np.array([t])
        of_points = by_cells(lambda k: 1.0 / k, t_)[0] if tractions else 0.5 / math.sin(0.5 * t)
        return math.log(by_cells(response, t_)[0] / of_points)

    def log_g(k: float) -> float:
        return math.log(k * response(np.array([k]))[0])

    c = [quad(lambda t, n=n: log_b(t) * math.cos(n * t), 0.0, math.pi, epsabs=1e-7)[0] / math.pi for n in range(3)]
    small = 1e-2  # below it both terms cancel but for a constant
    near = quad(lambda t: log_b(t) / (4.0 * math.sin(0.5 * t) ** 2) - log_g(t) / t**2, small, math.pi, epsabs=1e-7)[0]
    near += small * (log_b(small) / (4.0 * math.sin(0.5 * small) ** 2) - log_g(small) / small**2)
    far = quad(lambda s: log_g(math.pi / s) / math.pi, 0.0, 1.0, epsabs=1e-8)[0]
    line = (for_tractions if tractions else for_pressure)(bodies(wave_numbers(spacing)))
    expected = (
        c[1],
        c[2] + 0.5 * c[1] ** 2,
        math.exp(-0.5 * c[0]),
        (0.0 if tractions else -0.25) - (near - far) / math.pi,
    )
    np.testing.assert_allclose(line[:4], expected, atol=2e-4)


def test_a_half_space_has_the_numbers_of_point_sources() -> None:
    """Cells of tractions are those, and half of 1/24 is what pressures are too concentrated by."""
    np.testing.assert_allclose(for_tractions(3.0 / wave_numbers(0.2))[:4], [0.0, 0.0, 1.0, 0.0], atol=1e-12)
    assert OF_NO_LAYERS[:4] == (0.0, 0.0, 1.0, 0.0)
    assert for_pressure(3.0 / wave_numbers(0.2)) == pytest.approx(HALF_SPACE, abs=1e-12)
    assert HALF_SPACE.excess == pytest.approx(1.0 / 48.0, rel=0.1)


@pytest.mark.parametrize("ratio", [0.25, 4.0])
def test_a_layer_much_thinner_than_a_cell_moves_the_edge(ratio: float) -> None:
    """By its thickness times a number that does not depend on it, out if it is soft, but for a logarithm."""
    shifts = [
        for_pressure(responses((Layer(ratio * STEEL.E, 0.3, h),))(wave_numbers(1.0))).shift - HALF_SPACE.shift
        for h in (1e-3, 1e-4)
    ]
    assert math.copysign(1.0, shifts[0]) == math.copysign(1.0, 1.0 - ratio)
    assert 5.0 < shifts[0] / shifts[1] < 10.0


# --- strips ---


def strip(
    response: Callable[[np.ndarray], np.ndarray], half: float, offset: float, cells: int = 1, period: int = PERIOD
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and pressures of the cells of a strip's contact: parabolic, under half pi `half`^2, `cells` in a unit.

    Without layers its half width is `half`, and the pressure sqrt(half^2 - x^2). Cells are moved by `offset` of one.
    """
    n = round((1.6 * half + 3) * cells)
    x = (np.arange(-n, n + 1) + offset) / cells
    t = 2.0 * np.pi * np.fft.rfftfreq(period * cells)
    # the mean displacement makes no difference: the load is given
    symbol = np.concatenate([[0.0], by_cells(lambda k: response(k * cells) * cells, t[1:])])
    coefficients = np.fft.irfft(symbol)
    matrix = 2.0 * coefficients[np.abs(np.arange(x.size)[:, None] - np.arange(x.size))] / cells
    load, active = 0.5 * np.pi * half**2 * cells, np.abs(x) < half
    for _ in range(60):
        k = np.flatnonzero(active)
        system = np.block([[matrix[np.ix_(k, k)], -np.ones((k.size, 1))], [np.ones((1, k.size)), np.zeros((1, 1))]])
        solution = np.linalg.solve(system, np.append(-(x[k] ** 2), load))
        p = np.zeros(x.size)
        p[k] = solution[:-1]
        overlap = solution[-1] - x**2 - matrix @ p
        now = (active & (p > 0.0)) | (~active & (overlap > 1e-9))
        if (now == active).all():
            break
        active = now
    return x, p


def edge_of(x: np.ndarray, p: np.ndarray, line: tuple[float, ...]) -> float:
    """Where a strip's contact ends, on the side of larger x."""
    outer = int(np.flatnonzero(p > 0.0)[-1])
    three = (float(p[outer]), float(p[outer - 1]), float(p[outer - 2]))
    return float(x[outer] + rows.beyond_centre(three, line) * (x[1] - x[0]))


@pytest.mark.parametrize("half", [6.0, 40.0])
def test_edges_and_pressures_of_a_cylinder(half: float) -> None:
    """Edges to 1e-3 of a cell wherever they fall, in the mean to 1e-4; the second cell's pressure likewise."""
    off, second = [], []
    for offset in np.arange(-0.45, 0.5, 0.1):
        x, p = strip(lambda k: 1.0 / k, half, offset)
        off.append(edge_of(x, p, HALF_SPACE) - half)
        outer = np.flatnonzero(p > 0.0)[[-1, -2, -3]]
        found = rows.pressure_at_second_centre(tuple(p[outer]), half - x[outer[0]], HALF_SPACE, HALF_SPACE)
        second.append(found / math.sqrt(half**2 - x[outer[1]] ** 2) - 1.0)
    assert abs(np.mean(off)) < 5e-4
    assert np.abs(off).max() < 0.02 / half
    assert np.abs(second).max() < 2e-3 / half**0.5


@pytest.mark.heavy
@pytest.mark.parametrize("thickness", [0.15, 0.7, 2.5])
@pytest.mark.parametrize("modulus", [0.1, 0.5, 3.0])
def test_edges_of_strips_on_layers(modulus: float, thickness: float) -> None:
    """On cells a fraction as long as the layer to some times so: as on cells an eighth as long, to 0.01 of a cell.

    A half-space's numbers, for all that layers do, leave them up to 0.2 off.
    """
    substrate, layers = STEEL, (Layer(modulus * STEEL.E, 0.3, thickness),)

    def response(k: np.ndarray) -> np.ndarray:
        far = frequency_response(substrate, (), np.array([1.0]))[0, 0]
        return np.asarray(frequency_response(substrate, layers, k)[0] / far)

    period = 2**12  # moves edges by 3e-5
    x, p = strip(response, 9.0, 0.2, 8, period)
    exact = edge_of(x, p, for_pressure(response(wave_numbers(0.125))))
    off, as_half_space = [], []
    for offset in (-0.4, -0.1, 0.25, 0.45):
        x, p = strip(response, 9.0, offset, 1, period)
        off.append(edge_of(x, p, for_pressure(response(wave_numbers(1.0)))) - exact)
        as_half_space.append(edge_of(x, p, HALF_SPACE) - exact)
    assert np.abs(off).max() < 0.012
    assert np.abs(off).max() < np.abs(as_half_space).max()


# --- contacts ---


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("modulus", "thickness"), [(30000.0, 0.006), (60000.0, 0.02), (800000.0, 0.005), (1.2e6, 0.01)]
)
def test_areas_of_contacts_with_skins(modulus: float, thickness: float) -> None:
    """A fifth of a cell to a whole one thick: seen from afar areas are 0.5 to 4 % too small or large."""
    scene = steel(
        Mesh((0.68, 0.68), (26, 26)), counterbody=None, layers=(Layer(modulus, 0.3, thickness),), creepage=None
    )
    scene = replace(scene, discretisation="aligned")
    fine = AlignedContact(solve_normal(replace(scene, mesh=Mesh((0.68, 0.68), (416, 416))))).area
    contact = AlignedContact(solve_normal(scene))
    far_field = abs(contact.area - contact.area_by_layers - fine) / fine
    assert 0.004 < far_field < 0.04
    assert abs(contact.area - fine) / fine < 0.3 * far_field
    result = solve_scene(scene)
    assert abs(result.scalars["contact_area"] - fine) <= result.scalars["contact_area_error"]


@pytest.mark.heavy
@pytest.mark.parametrize("discretisation", get_args(Discretisation))
def test_areas_on_films_that_keep_their_volume(discretisation: Discretisation) -> None:
    """Thinner than a cell they made areas 9 % too large, and bars of 0.1 % beside that."""
    layers = (Layer(2.763, 0.4977, 0.047),)
    found, fine = (
        solve_scene(
            Scene(STEEL, (50.0, 54.4), 100.0, Mesh((3.55, 3.7), (n, n)), layers, STEEL, discretisation=discretisation)
        ).scalars
        for n in (32, 256)
    )
    for name in ("contact_area", "contact_radius", "pressure_max", "approach"):
        assert abs(found[name] - fine[name]) <= found[f"{name}_error"]
    assert found["contact_area"] == pytest.approx(
        fine["contact_area"], rel=0.01 if discretisation == "aligned" else 0.06
    )


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("cells", "modulus", "thickness"),
    [(28, 0.01, 3.0), (56, 0.003, 2.0), (56, 0.03, 1.5), (64, 0.03, 1.5), (64, 0.01, 2.0)],
)
def test_areas_on_soft_layers_a_few_cells_thick(cells: int, modulus: float, thickness: float) -> None:
    layers = (Layer(modulus * STEEL.E, 0.4, thickness * 2.4 / cells),)
    scene = steel(Mesh((2.4, 2.4), (cells, cells)), counterbody=None, layers=layers, creepage=None)
    scene = replace(scene, discretisation="aligned")
    found = solve_scene(scene).scalars
    fine = solve_scene(replace(scene, mesh=Mesh((2.4, 2.4), (4 * cells, 4 * cells)))).scalars["contact_area"]
    assert abs(found["contact_area"] - fine) <= found["contact_area_error"]
    assert found["contact_area"] == pytest.approx(fine, rel=4e-3)


@pytest.mark.heavy
@pytest.mark.parametrize("coupling", get_args(Coupling))
def test_plates_on_a_few_cells(coupling: Coupling) -> None:
    """Thousands of times as stiff and a tenth of a cell to a cell thick: edges that layers move crossed once."""
    for modulus, thickness in ((4000.0, 0.07), (7000.0, 0.047), (1800.0, 0.0175)):
        layers = (Layer(modulus * STEEL.E, 0.3, thickness),)
        scene = steel(Mesh((1.2, 1.0), (8, 7)), counterbody=None, layers=layers, creepage=Creepage(0.001))
        for load in (0.3, 20.0):
            scene = replace(scene, load=load, discretisation="aligned", coupling=coupling)
            result = solve_scene(scene)
            assert result.status in (Status.SOLVED, Status.REFUSED)
            if result.status == Status.SOLVED:
                assert result.scalars["contact_area"] > 0.5 * (1.2 / 8) * (1.0 / 7)
                assert all(map(math.isfinite, result.scalars.values()))
