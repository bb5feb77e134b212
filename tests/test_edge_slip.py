"""What cells make too much of slip by pressure at a leading edge, against strips of cells an eighth as long."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from contacts import STEEL, steel

from rcstudy.mechanics import edge_slip
from rcstudy.mechanics.half_line import HALF_SPACE, HalfLine, for_pressure, wave_numbers
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.layered import frequency_response, half_space_response
from rcstudy.mechanics.scene import Creepage, Layer, Mesh, Scene
from rcstudy.mechanics.subcell.moved_rows import EDGE
from rcstudy.result import Status
from rcstudy.solve import solve_scene

Responses = Callable[[np.ndarray], np.ndarray]  # a, b, c, d [4, n] (mm/MPa) at wave numbers [n] (1/mm)

FINER = 8
WIDTH = 30  # of the strip under pressure, in cells; tractions stick over twice as much
ALIASES = 12

# layers on steel (E over that of steel, nu, thickness in cells), and whether the other body is of steel or rigid
STACKS: dict[str, tuple[list[tuple[float, float, float]], bool]] = {
    "none": ([], False),
    "film": ([(0.02, 0.4, 0.33)], True),
    "film of a cell": ([(0.02, 0.4, 1.0)], True),
    "incompressible film": ([(0.02, 0.49, 0.3)], True),
    "soft": ([(0.25, 0.3, 2.5)], False),
    "stiff": ([(4.0, 0.3, 2.5)], False),
    "skin": ([(10.0, 0.3, 0.2)], True),
    "skin on a film": ([(2.0, 0.3, 0.15), (0.05, 0.4, 0.4)], True),
}


def responses_of(name: str) -> Responses:
    """The responses of both bodies together; cells are 1 mm long."""
    layers, both_steel = STACKS[name]
    stack = tuple(Layer(E * STEEL.E, nu, thickness) for E, nu, thickness in layers)

    def both(k: np.ndarray) -> np.ndarray:
        out = frequency_response(STEEL, stack, k)
        if both_steel:
            out += (np.array([1.0, -1.0, 1.0, 1.0]) * half_space_response(STEEL))[:, None] / k
        return out

    return both


def strip(responses: Responses, h: float, n: int, kind: str) -> np.ndarray:
    """Matrix [n, n] of cells of length `h` (mm): u_z by pressure ("p"), or slopes du/dx of u_x half a cell ahead.

    Slopes by tractions ("q"), or by pressure ("s"), of displacements that are differences over a cell, sharpened as
    `convolution.point_factor` does. Cells are counted from the leading one, on a long period.
    """
    period = 1 << int(np.ceil(np.log2(16 * n)))
    k = 2.0 * np.pi / period * np.arange(period // 2 + 1)
    symbol = np.zeros(k.size, dtype=complex)
    for alias in range(-ALIASES, ALIASES + 1):
        wave, weight = k + 2.0 * np.pi * alias, 0.5 if abs(alias) == ALIASES else 1.0
        seen = np.sinc(wave / (2.0 * np.pi))
        a, b, c = np.zeros((3, k.size))
        there = wave != 0.0
        a[there], b[there], c[there], _ = responses(np.abs(wave[there]) / h)
        alpha = np.abs(wave) / h
        if kind == "p":
            symbol += weight * a * seen
        else:
            slope = 1j * np.sign(wave) * alpha * c if kind == "q" else -alpha * b
            symbol += weight * slope * seen**2 * np.exp(-0.5j * wave)
    if kind != "p":
        symbol *= 1.0 + (1.0 - np.cos(k)) / 6.0
    symbol[-1] = symbol[-1].real
    kernel = np.fft.irfft(symbol, period)
    return kernel[np.arange(n)[:, None] - np.arange(n)]


def pressure_of_parabola(matrix: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Pressure [n] of a parabola on cells at x [n], the contact being the middle WIDTH cells of the coarse mesh."""
    held = np.abs(x) < 0.5 * WIDTH
    flat, bent = np.zeros((2, x.size))
    flat[held] = np.linalg.solve(matrix[np.ix_(held, held)], np.ones(held.sum()))
    bent[held] = np.linalg.solve(matrix[np.ix_(held, held)], 0.5 * x[held] ** 2)
    outermost = int(np.argmax(held))
    approach = bent[outermost] / flat[outermost]
    for _ in range(50):
        p = np.zeros(x.size)
        p[held] = np.linalg.solve(matrix[np.ix_(held, held)], approach - 0.5 * x[held] ** 2)
        overlap = matrix @ p < approach * (1.0 - 1e-12) - 0.5 * x**2
        after = np.where(held, p > 0.0, overlap)
        if np.array_equal(after, held):
            return p
        held = after
    raise AssertionError("no contact found")


def edge_of(p: np.ndarray, line: HalfLine) -> float:
    """Distance, in cells, of the edge ahead of the centre of the first of the pressures `p`, by the half-line."""
    q0, q1, q2 = p[0], p[1] + line.b1 * p[0], p[2] + line.b1 * p[1] + line.b2 * p[0]
    gamma, rise = q2 - 1.5 * q1 + 0.375 * q0, -0.5 * q2 + 1.75 * q1 - 0.6875 * q0
    return line.shift + min(np.roots([0.5 * gamma, -rise, q0]).real, key=abs)


def forces(responses: Responses, h: float, far_field: float, x: np.ndarray, p: np.ndarray) -> tuple[float, float]:
    """Sum of the tractions (N/mm) that answer to slip by the pressure `p` [n] at `x` [n], on cells of length `h` (mm).

    Also by how much that sum changes for a slip in the first cell that is its pressure, times 1/MPa. Cells begin EDGE
    cells behind `far_field`; the slip fades over the contact, so that only the leading edge counts.
    """
    n = round(2 * WIDTH / h)
    centres = far_field + (EDGE + np.arange(n)) * h
    within = x[1] - x[0]
    load = np.concatenate(([0.0], np.cumsum(p) * within))
    ends = np.append(centres - 0.5 * h, centres[-1] + 0.5 * h)
    up_to = np.interp(ends, np.append(x - 0.5 * within, x[-1] + 0.5 * within), load)
    up_to[0] = 0.0  # the first cell carries what is ahead of it
    means = np.diff(up_to) / h
    slip = -strip(responses, h, n, "s") @ means
    behind = (centres - 0.5 * h - far_field) / WIDTH
    slip *= np.cos(0.5 * np.pi * np.clip((behind - 0.05) / 0.85, 0.0, 1.0)) ** 2
    weights = np.linalg.solve(strip(responses, h, n, "q").T, np.ones(n)) * h
    return float(weights @ slip), float(weights[0] * means[0])


def shift_of(responses: Responses, h: float) -> float:
    """Distance (mm) of the far-field edge behind the actual one, for cells of length `h` (mm)."""
    return (for_pressure(responses(wave_numbers(h))[0]).shift - HALF_SPACE.shift) * h


@pytest.mark.heavy
@pytest.mark.parametrize("name", STACKS)
def test_forces_as_on_finer_cells(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Less this slip in its first cell, a strip on coarse cells has the force of one on fine ones.

    That is so for the slip with the effect of the tractions' shifted edge, which the function leaves out otherwise.
    """
    monkeypatch.setattr(edge_slip, "_SHIFTED", 1e-9)
    responses, h = responses_of(name), 1.0 / FINER
    n = round(1.3 * WIDTH / h)
    x = (np.arange(n) - 0.5 * (n - 1)) * h
    p = pressure_of_parabola(strip(responses, h, n, "p"), x)
    first = int(np.argmax(p > 0.0))
    edge = x[first] - edge_of(p[first : first + 3], for_pressure(responses(wave_numbers(h))[0])) * h
    fine, of_first = forces(responses, h, edge + shift_of(responses, h), x, p)
    # a layer is thick on the fine cells, which behave as half-spaces
    fine -= edge_slip.OF_HALF_SPACE * responses(np.array([1.0 / h]))[1, 0] / h * of_first
    coarse, of_first = forces(responses, 1.0, edge + shift_of(responses, 1.0), x, p)
    waves = np.geomspace(0.1, 1e3, 60)
    largest = np.abs(waves * responses(waves)[1]).max()
    at = edge_slip.wave_numbers(1.0)
    part = edge_slip.exaggeration(responses(at)[:3], 1.0, shift_of(responses, 1.0))
    assert (coarse - fine) / of_first == pytest.approx(part, abs=0.007 * largest)


def test_a_factor_that_is_known() -> None:
    """(1 + k^2)/(4 + k^2), constant at both ends as responses are, has (1 + z)/(2 + z)."""
    k = edge_slip._K
    phase = edge_slip._PHASE @ np.log((1.0 + k**2) / (4.0 + k**2))
    np.testing.assert_allclose(phase, np.arctan(k) - np.arctan(0.5 * k), atol=2e-4)


@pytest.mark.parametrize("end", [0, -1])
def test_a_factor_that_is_constant_beyond_an_end_only(end: int) -> None:
    """It changes up to there: the phase is int (f(v + t) - f(v - t))/sinh t dt/(2 pi), f being its logarithm."""
    v, side = edge_slip._V, 1.0 if end == 0 else -1.0
    t = 0.002 * (np.arange(10_000) + 0.5)

    def logarithm(at: np.ndarray) -> np.ndarray:
        return np.asarray(np.exp(-0.5 * np.maximum(side * (at - v[end]), 0.0) ** 2))

    phase = edge_slip._PHASE @ logarithm(v)
    for n in (2, 3, 6, 9) if end == 0 else (-3, -4, -7, -10):
        expected = np.sum((logarithm(v[n] + t) - logarithm(v[n] - t)) / np.sinh(t)) * 0.001 / np.pi
        assert phase[n] == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize("name", ["film", "incompressible film", "skin", "soft"])
def test_the_shift_of_the_tractions_edge_counts_in_part(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Waves about as long as a cell keep it, longer ones do not: the slip is between those with all and none of it."""
    at, shift = edge_slip.wave_numbers(1.0), shift_of(responses_of(name), 1.0)
    found = []
    for shifted in (1e-9, edge_slip._SHIFTED, 1e9):
        monkeypatch.setattr(edge_slip, "_SHIFTED", shifted)
        found.append(edge_slip.exaggeration(responses_of(name)(at)[:3], 1.0, shift))
    assert min(found[::2]) < found[1] < max(found[::2])


def test_thick_layers_are_half_spaces() -> None:
    """Of layers many cells thick the part is that of a half-space, and without layers it is so exactly."""
    spacing = 0.02, 0.02
    alone = Influence(STEEL, (), None, spacing, 1.0)
    assert alone.exaggerated_slip == edge_slip.OF_HALF_SPACE * alone.slip_under_pressure
    for E in (0.2, 5.0):
        thick = Influence(STEEL, (Layer(E * STEEL.E, 0.3, 4.0),), None, spacing, 1.0)
        part = thick.exaggerated_slip / (edge_slip.OF_HALF_SPACE * thick.slip_under_pressure)
        assert part == pytest.approx(1.0, abs=0.06)


def test_does_not_depend_on_units() -> None:
    """Ten times larger cells and layers, and moduli a hundred times as large: the slip is as much smaller."""
    layers = (Layer(0.1 * STEEL.E, 0.4, 0.01), Layer(3.0 * STEEL.E, 0.25, 0.02))
    own = Influence(STEEL, layers, None, (0.02, 0.02), 1.0).exaggerated_slip
    larger = tuple(Layer(100.0 * layer.E, layer.nu, 10.0 * layer.thickness) for layer in layers)
    stiff = replace(STEEL, E=100.0 * STEEL.E)
    assert 100.0 * Influence(stiff, larger, None, (0.2, 0.2), 10.0).exaggerated_slip == pytest.approx(
        own, rel=1e-9, abs=0.0
    )


@pytest.mark.heavy
@pytest.mark.parametrize("cells", [40, 56])
def test_forces_on_films_a_third_of_a_cell_thick(cells: int) -> None:
    """Forces between steel bodies with a soft film: with the slip on the spot instead they are 1.8 and 2.5 % off."""

    def force(n: int) -> float:
        scene = film_between_steel(Mesh((18.4, 18.4), (n, n)))
        result = solve_scene(scene)
        assert result.status == Status.SOLVED, result.reason
        return result.scalars["force_x"]

    assert force(cells) == pytest.approx(force(224), rel=0.013)


def film_between_steel(mesh: Mesh) -> Scene:
    """A steel ball and half-space with a film of a fiftieth of their modulus, 0.1 mm thick, that hardly slips."""
    scene = replace(steel(mesh, counterbody=STEEL), layers=(Layer(0.02 * STEEL.E, 0.4, 0.1),), radius=(370.0, 370.0))
    return replace(scene, load=80000.0, friction=0.4, creepage=Creepage(0.0006, 0.0, 0.0), discretisation="aligned")
