"""What stiff skins gather at the contact's rim: which layers make it, how much of it is missing, what bars say."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from contacts import STEEL, solved

from rcstudy.mechanics.plates import beyond_rim, missing_at_rim, most_by_plate, skin
from rcstudy.mechanics.scene import Creepage, Layer, Material, Mesh, Scene

HARD = Layer(100.0 * STEEL.E, 0.3, 0.01)


def disc(*rings: float) -> np.ndarray:
    """Pressures around a cell: of it, of its four neighbours, of theirs, and so on."""
    steps = np.abs(np.arange(-len(rings), len(rings) + 1))
    return np.array([*rings, *np.zeros(len(rings) + 1)])[steps[:, None] + steps]


@pytest.mark.parametrize(
    ("rings", "side", "missing"),
    [
        ((1.0, 1.0, 0.9), 0.005, 0.0),  # 0.7 + 0.2 x 1.3 is less than the largest
        ((1.0, 1.0, 0.9), 0.03, 0.48),  # 0.7 + 0.2 x 1.3 x 3 - 1
        ((1.0, 1.0, 1.0), 0.01, 0.09),
        ((1.0, 1.0, 1.0), 1.0, 0.7 + 0.3 * 1.3 * 8.0 - 1.0),  # no more than eight times
        ((2.0, 1.5, 1.0, 0.9), 0.03, 0.0),  # 0.7 + 0.2 x 1.3 x 3 is less than 2
        ((4.0, 3.0, 2.0), 1.0, 0.0),  # as smooth contacts end, or more smoothly
        ((1.0, 1.0), 0.03, 0.87),  # 0.7 + 0.3 x 1.3 x 3 - 1
        ((1.0,), 0.03, 0.0),  # none behind the rim
    ],
)
def test_missing_at_rim(rings: tuple[float, ...], side: float, missing: float) -> None:
    """What rim cells carry beyond 0.7 of those behind them the skin spreads over its thickness, not the cell's."""
    assert missing_at_rim(disc(*rings), [HARD], STEEL, side) == pytest.approx(missing, abs=1e-12)


def test_of_cells_behind_the_rim_the_largest_pressure_counts() -> None:
    """The smaller ones, as in an oblong contact, leave what the rim carries beyond it as it is."""
    p = disc(1.0, 1.0, 0.9)
    p[2, 3] = 0.5
    assert missing_at_rim(p, [HARD], STEEL, 0.03) == pytest.approx(0.48, abs=1e-12)


@pytest.mark.parametrize(
    ("rings", "beyond"),  # from the centre outwards
    [
        ((0.5, 0.7, 0.8, 1.0, 0.9), 0.3),  # the second ring over the fourth
        ((0.6, 0.8, 0.6, 1.0, 1.2), 0.5),  # the outermost over the third, which is less than the fourth
        ((0.5, 0.7, 1.0, 0.9, 0.8), 0.0),  # the largest is in the third ring
        ((1.0, 0.9, 0.7, 0.6, 0.5), 0.0),
        ((0.7, 1.0, 0.9), 0.3),  # no more than three rings
        ((1.0, 0.9), 0.0),  # none farther in
        ((1.0,), 0.0),
    ],
)
def test_beyond_rim(rings: tuple[float, ...], beyond: float) -> None:
    assert beyond_rim(disc(*rings)) == pytest.approx(beyond, abs=1e-12)
    assert beyond_rim(np.pad(disc(*rings), ((0, 0), (0, 5)))) == pytest.approx(beyond, abs=1e-12)
    side = slice(1, -1)  # up to the sides of the box
    assert beyond_rim(disc(*rings)[side, side]) == pytest.approx(beyond, abs=1e-12)


@pytest.mark.heavy
@pytest.mark.parametrize("cells", [32, 56, 64])
def test_bars_of_pressures_in_the_outermost_cells(cells: int) -> None:
    """Under full coupling with high friction; the limit is that of `kalker` on 768 cells. They were too small."""
    mesh = Mesh((1.45, 1.45), (cells, cells))
    scene = Scene(Material(1000.0, 0.0), (10.0, 10.0), 5.0, mesh, friction=5.0, creepage=Creepage(-0.5, 0.0, 0.02))
    found = solved(replace(scene, coupling="full", discretisation="aligned"))
    for name, limit in (("pressure_max", 17.634), ("traction_max", 5.0 * 17.634)):
        off = abs(found.scalars[name] - limit)
        assert 0.2 * limit < off < found.scalars[f"{name}_error"] < 2.0 * off


@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
def test_bars_of_pressures_in_the_outermost_of_few_cells(discretisation: Any) -> None:
    """Five cells across, three rings, under a skin as thick as a cell; the limit is that on 144 x 144 cells."""
    layers = (Layer(140000.0, 0.3, 0.3),)
    scene = Scene(Material(10000.0, 0.5), (50.0, 50.0), 330.0, Mesh((2.8, 2.8), (9, 9)), layers)
    found = solved(replace(scene, discretisation=discretisation)).scalars
    off = found["pressure_max"] - 248.93
    assert 20.0 < off < found["pressure_max_error"] < 2.5 * off


def test_nothing_is_missing_without_a_stiff_skin() -> None:
    """Bare, under layers that are softer than what is below, or of one piece with it."""
    p = disc(1.0, 1.0, 0.9)
    for layers in ((), (Layer(0.5 * STEEL.E, 0.3, 0.01),), (Layer(STEEL.E, 0.3, 0.01),)):
        assert missing_at_rim(p, layers, STEEL, 0.1) == 0.0


def layers_of(*moduli_and_thicknesses: tuple[float, float]) -> list[Layer]:
    """From the surface down, moduli over the substrate's."""
    return [Layer(modulus * STEEL.E, 0.3, thickness) for modulus, thickness in moduli_and_thicknesses]


@pytest.mark.parametrize(
    ("layers", "thickness"),
    [
        (layers_of((10.0, 0.02)), 0.02),
        (layers_of((10.0, 0.2)), 0.1),  # no thinner than a cell
        (layers_of((0.1, 0.02), (10.0, 0.03)), 0.05),  # a film on it belongs to it
        (layers_of((10.0, 0.01), (0.1, 0.02), (5.0, 0.04)), 0.06957),  # the first bends less
        (layers_of((30.0, 0.01), (0.1, 0.02), (10.0, 0.02)), 0.04896),  # stretches less than the other, but bends more
        (layers_of((10.0, 0.01), (0.1, 0.02), (5.0, 0.08)), 0.09978),
        (layers_of((4.0, 0.03), (2.0, 0.03)), (2.0 * 0.03**4 + 0.06**4) / (2.0 * 0.03**3 + 0.06**3)),
        (layers_of((4.0 + 4e-9, 0.001), (4.0, 0.059)), 0.06),  # in one piece, to rounding
        (layers_of((0.1, 0.02), (0.5, 0.2)), 0.0),
    ],
)
def test_skin(layers: list[Layer], thickness: float) -> None:
    """Mean depth of the bottoms of layers that are stiffer than what is below, weighted with how little they bend."""
    assert skin(layers, STEEL, 0.1) == pytest.approx(thickness, rel=1e-3)


def test_most_by_plate() -> None:
    """Half-spaces of their own are no plates; the same plate in parts, or over softer and stiffer layers."""
    assert most_by_plate([], STEEL, 0.5) == 0.0
    assert most_by_plate(layers_of((0.5, 0.1), (1.0, 0.2)), STEEL, 0.5) == 0.0
    one = most_by_plate(layers_of((10.0, 0.05)), STEEL, 0.5)
    assert one == pytest.approx(3.0 * 0.1 * (9.0 / 3.0) ** (2.0 / 3.0))
    for parts in (((10.0, 0.02), (10.0, 0.03)), ((10.0, 0.05), (1.0, 0.3))):
        assert most_by_plate(layers_of(*parts), STEEL, 0.5) == pytest.approx(one)
    on_soft = most_by_plate(layers_of((10.0, 0.05), (0.01, 0.1)), STEEL, 0.5)
    assert on_soft == pytest.approx(3.0 * 0.1 * (9.99 / 0.03) ** (2.0 / 3.0))
    under_film = most_by_plate(layers_of((0.01, 0.01), (10.0, 0.04)), STEEL, 0.5)
    assert under_film == pytest.approx(one)  # a film on it belongs to it, softer than anything below
    assert most_by_plate(layers_of((10.0, 5.0)), STEEL, 0.5) == pytest.approx(3.0 * (9.0 / 3.0) ** (2.0 / 3.0))


def test_skins_too_weak_to_bear_a_load_widen_no_bars() -> None:
    """Where the rim is steep by full coupling. The bar was the largest pressure and more, and 1.8 MPa without a layer.

    On layers with the substrate's own modulus, nearly, and on thin ones little stiffer than it.
    """
    mesh = Mesh((0.75, 0.75), (32, 32))
    scene = Scene(STEEL, (50.0, 50.0), 100.0, mesh, (), None, 3.0, Creepage(0.05), coupling="full")
    scene = replace(scene, discretisation="aligned")
    bare = solved(scene).scalars
    for layer, factor in ((Layer((1.0 + 1e-6) * STEEL.E, 0.3, 3e-9), 1.01), (Layer(1.1 * STEEL.E, 0.3, 0.0015), 2.0)):
        found = solved(replace(scene, layers=(layer,))).scalars
        for name in ("pressure_max_error", "traction_max_error"):
            assert bare[name] / factor < found[name] < bare[name] * factor


@pytest.mark.heavy
@pytest.mark.parametrize("discretisation", ["kalker", "aligned"])
def test_bars_of_the_largest_pressure_under_a_stiff_skin(discretisation: Any) -> None:
    """On 24 to 48 cells it is that of the middle, the same on all; on 192 cells a larger one is found at the rim."""
    layers = (Layer(365.0 * STEEL.E, 0.3, 0.003),)
    scene = Scene(STEEL, (50.0, 50.0), 100.0, Mesh((0.64, 0.64), (192, 192)), layers, discretisation="aligned")
    largest = solved(scene).scalars["pressure_max"]
    for cells in (24, 32, 48):
        coarse = solved(replace(scene, mesh=Mesh((0.64, 0.64), (cells, cells)), discretisation=discretisation)).scalars
        assert 0.1 * largest < largest - coarse["pressure_max"] < coarse["pressure_max_error"] < 1.2 * largest
