"""The rim of contacts under plates: what eliminating it does and saves, and what is done where it cannot be had."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from contacts import STEEL
from scipy.linalg import eigh

from rcstudy.mechanics import normal, rim
from rcstudy.mechanics.contact import influence_of, solve_normal
from rcstudy.mechanics.convolution import Box
from rcstudy.mechanics.exact import contact_modulus, hertz_contact
from rcstudy.mechanics.normal import initial_gap, solve_pressure
from rcstudy.mechanics.normal_operator import NormalOperator
from rcstudy.mechanics.rim import RimSolver
from rcstudy.mechanics.scene import Layer, Material, Mesh, Scene, Tolerance

A = hertz_contact((50.0, 50.0), 100.0, contact_modulus(STEEL, None)).a[0]
STACK = tuple(Layer(3.0**n * STEEL.E, 0.3, 0.02 * A) for n in (6, 5, 4, 3, 2, 1))
RUBBER = Material(1.0, 0.3)
PLATE = (Layer(100.0 * STEEL.E, 0.3, 0.1 * A),)


def pressed(layers: tuple[Layer, ...], half: float, cells: int, tolerance: float = 1e-6, **more: tuple) -> Scene:
    """Steel under `layers`, in a window of `half` a each side of the centre."""
    size = 2.0 * half * A
    scene = Scene(STEEL, (50.0, 50.0), 100.0, Mesh((size, size), (cells, cells)), layers=layers)
    return replace(scene, tolerance=Tolerance(tolerance, tolerance), **more)


CONTACTS = {
    "plate": pressed(PLATE, 1.4, 32),
    "stack": pressed(STACK, 1.9, 32),
    "elongated": pressed(PLATE, 2.1, 32, radius=(150.0, 50.0)),
}


def matrix(coefficients: np.ndarray, cells: np.ndarray) -> np.ndarray:
    offsets = np.abs(cells[:, None] - cells[None, :])
    found: np.ndarray = coefficients[offsets[..., 0], offsets[..., 1]]
    return found


@pytest.mark.parametrize("name", CONTACTS)
def test_without_its_rim_a_contact_is_as_easy_as_on_a_half_space(name: str) -> None:
    """Eigenvalues of the preconditioned operator, with and without the rim's cells eliminated."""
    scene = CONTACTS[name]
    influence = influence_of(scene)
    solution = solve_pressure(scene, influence, initial_gap(scene))
    assert solution.converged and not solution.edge
    touched = solution.p > 0.0
    box = Box.around(touched)
    assert normal._bends(influence, box.shape)
    operator = NormalOperator.of(influence, box.shape)
    cells = np.argwhere(touched[box.slices])
    a = matrix(operator.coefficients, cells)
    inverse = np.fft.irfft2(operator.inverse.T, operator.padded)
    b = matrix(inverse * np.prod(operator.padded), cells)
    inside = rim._Rim(operator, touched[box.slices]).interior[tuple(cells.T)]
    outer = ~inside
    assert 0 < outer.sum() < 0.4 * len(cells)
    cross = a[np.ix_(inside, outer)]
    reduced = a[np.ix_(inside, inside)] - cross @ np.linalg.solve(a[np.ix_(outer, outer)], cross.T)
    whole = eigh(a, np.linalg.inv(b), eigvals_only=True)
    without = eigh(0.5 * (reduced + reduced.T), np.linalg.inv(b[np.ix_(inside, inside)]), eigvals_only=True)
    assert whole.max() > 30.0
    assert without.min() > 0.6 and without.max() < 1.7


@pytest.mark.heavy
@pytest.mark.parametrize("tolerance", [1e-6, 1e-10])
@pytest.mark.parametrize("layers, half", [(STACK, 1.9), (PLATE, 1.4), ((Layer(1000.0 * STEEL.E, 0.3, 0.01 * A),), 1.2)])
def test_products_hardly_grow_with_the_mesh(layers: tuple[Layer, ...], half: float, tolerance: float) -> None:
    """Without the rim 30 to 380 products at 1e-6, and more than 400 steps at 1e-10."""
    for cells in (32, 64, 128):
        solution = solve_normal(pressed(layers, half, cells, tolerance)).solution
        assert solution.converged and not solution.edge
        assert solution.products <= (45 if tolerance == 1e-6 else 60), cells


@pytest.mark.parametrize("fault", ["no factor", "no rim in one piece", "sets go round"])
def test_where_the_rim_does_not_help_conjugate_gradients_do(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = pressed(PLATE, 1.4, 24, 1e-9)
    gap, influence = initial_gap(scene), influence_of(scene)
    expected = solve_pressure(scene, influence, gap)
    if fault == "no factor":
        monkeypatch.setattr(rim.pressure, "displacement_matrix", lambda coefficients, cells, out: out.fill(-1.0))
    elif fault == "no rim in one piece":
        monkeypatch.setattr(rim, "_LONGEST", 0)
        monkeypatch.setattr(rim, "_ANY_RIM", 0)
    else:
        monkeypatch.setattr(rim, "_MAX_SETS", 2)
    found = solve_pressure(scene, influence, gap)
    assert found.converged
    assert found.iterations > expected.iterations and found.products > expected.products
    np.testing.assert_allclose(found.p, expected.p, atol=1e-7 * expected.p.max())
    assert found.approach == pytest.approx(expected.approach, rel=1e-8)


@pytest.mark.heavy
@pytest.mark.parametrize("cells", [20, 24, 28, 32])
def test_contacts_that_fall_into_pieces_become_whole(cells: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A steel sheet on soft rubber: with short rims alone three of these are not solved in 1200 products."""
    a = hertz_contact((10.0, 10.0), 0.01, contact_modulus(RUBBER, None)).a[0]
    sheet = (Layer(1.93e4, 0.3, 0.0363 * a),)
    scene = Scene(RUBBER, (10.0, 10.0), 0.01, Mesh((a, a), (cells, cells)), layers=sheet)
    influence, gap = influence_of(scene), initial_gap(scene)
    found = solve_pressure(scene, influence, gap)
    assert found.converged and not found.edge and found.products < 120
    if cells == 24:
        monkeypatch.setattr(rim, "_ANY_RIM", 0)
        short = solve_pressure(scene, influence, gap)
        assert not short.converged and short.products > 1000


def test_further_than_rounding_allows_is_not_converged(monkeypatch: pytest.MonkeyPatch) -> None:
    """No step if the tolerance is hopeless; as far as it goes if it is nearly so."""
    scene = pressed(PLATE, 1.4, 20, 1e-30)
    gap, influence = initial_gap(scene), influence_of(scene)
    refused = solve_pressure(scene, influence, gap)
    assert not refused.converged and refused.iterations == 0
    monkeypatch.setattr(normal, "LEAST_TOLERANCE", 0.0)
    found = solve_pressure(scene, influence, gap)
    assert found.residual < 10.0 * found.attainable < 1e-10
    assert found.converged == (found.residual <= 1e-30)


@pytest.mark.parametrize("off, matters", [(0.5, False), (2.0, True)])
def test_cells_out_of_place_matter_beyond_the_tolerance(off: float, matters: bool) -> None:
    """Tension over the largest pressure as well as overlap over what pressures close, each for itself.

    Overlap counts over the approach, too, where that is less.
    """
    scene = CONTACTS["plate"]
    gap = initial_gap(scene)
    solver = RimSolver(NormalOperator.of(influence_of(scene), gap.shape), gap, np.ones(gap.shape), 1e5)
    cell, none = gap == gap[0, 0], np.zeros(gap.shape, dtype=bool)
    solver.p = np.where(cell, -off * 1e-4 * 300.0, 300.0)
    closed = float(np.linalg.norm(solver.p)) / solver.operator.stiffness
    assert 0.0 < closed < 0.02
    for solver.approach, part in ((0.02, closed), (0.5 * closed, 0.5 * closed)):
        solver.g = np.where(cell, solver.approach - off * 1e-4 * part, solver.approach + 0.01)
        assert solver._matters(cell, none, 1e-4) == solver._matters(none, cell, 1e-4) == matters
    assert not solver._matters(none, none, 1e-4)


def test_what_did_not_get_to_its_tolerance_is_not_converged(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rim, "_MAX_STEPS", 2)
    scene = CONTACTS["plate"]
    influence, gap = influence_of(scene), initial_gap(scene)
    near = solve_pressure(scene, influence, gap)
    operator = NormalOperator.of(influence, gap.shape)
    found = RimSolver(operator, gap, near.p, float(near.p.sum())).solve(1e-12)
    assert found.residual > 1e-12 and not found.converged


@pytest.mark.heavy
def test_load_is_kept_and_nothing_pulls() -> None:
    """Also where the pressures to start from are far from it: one cell, or all."""
    scene = CONTACTS["plate"]
    operator = NormalOperator.of(influence_of(scene), scene.mesh.cells)
    gap = initial_gap(scene)
    total = 1e5
    expected = RimSolver(operator, gap, np.maximum(1.0 - gap / gap.max(), 0.0), total).solve(1e-10)
    for start in (np.ones(gap.shape), (gap == gap.min()).astype(float)):
        found = RimSolver(operator, gap, start, total).solve(1e-10)
        assert found.converged
        assert (found.p >= 0.0).all()
        assert found.p.sum() == pytest.approx(total, rel=1e-12)
        np.testing.assert_allclose(found.p, expected.p, atol=1e-8 * expected.p.max())
        rough = RimSolver(operator, gap, start, total).solve(0.1)  # some cells pull, by less than that
        assert rough.converged and (rough.p >= 0.0).all()
        assert rough.p.sum() == pytest.approx(total, rel=1e-12)


def test_no_cell_is_left_out_whose_pressure_matters() -> None:
    """Overlaps small beside the approach were left open: pressures up to 30 times their tolerance off."""
    scene = pressed((Layer(159.24 * STEEL.E, 0.3, 0.09448 * A),), 1.72829, 63, 1e-4)
    influence, gap = influence_of(scene), initial_gap(scene)
    found = solve_pressure(scene, influence, gap)
    true = solve_pressure(replace(scene, tolerance=Tolerance(1e-11, 1e-11)), influence, gap)
    assert np.linalg.norm(found.p - true.p) <= 1e-4 * np.linalg.norm(true.p)
