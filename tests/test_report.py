"""Figures, tables and statements, against numbers computed here from the same cube."""

from __future__ import annotations

import csv
import itertools
import logging
import math
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib
import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from PIL import Image
from studies import CONFIGS, load_text
from synthetic import (
    CREEPAGES,
    RADIUS,
    SCENE,
    TABLE_2,
    Synthetic,
    assemble,
    creepage_axis,
    grid_cases,
    made_up_result,
    make_grid,
    make_study,
    modulus_axis,
    number_axis,
    paper,
    several,
    small,
    synthetic_tree,
    thickness_axis,
)
from workers import made_up

from rcstudy import tables as tables_module
from rcstudy.cases import Axis, Coord
from rcstudy.cube import case_table, open_cube
from rcstudy.errors import UserError
from rcstudy.figures import make_figures
from rcstudy.report import maps, measures
from rcstudy.report.cells import Column, text_of, without_empty
from rcstudy.report.draw import Window, bound_line, pressure_line, traction_line
from rcstudy.report.latex import escape
from rcstudy.report.overview import case_maps, overview_figure
from rcstudy.report.paper import AXES, paper_cases
from rcstudy.report.paper_figures import paper_figure
from rcstudy.report.paper_statements import STATEMENTS
from rcstudy.report.statements import Comparison, judged, numbers, statements_table, verdict
from rcstudy.report.style import LINES, save, style
from rcstudy.report.views import CaseView, GridView, grids
from rcstudy.report.writers import write_table
from rcstudy.result import ESTIMATED, CellState, Status
from rcstudy.studyfile.axis_labels import letters
from rcstudy.sweep import run
from rcstudy.tables import creepage_table, make_tables

CELLS = (32, 28)
UNSOLVED = {("figure_7", (0, 1)), ("figure_5", (1, 0, 2)), ("figure_3", (0, 0, 0))}
"""Cases of the second made-up cube that did not converge; their fields are in the cube all the same."""


def papers() -> Synthetic:
    """The paper's grids with small errors of all numbers, of areas so large that maps give slip in whole per cent."""
    made = paper(CELLS)
    for _, result in made.results:
        known = {name: abs(result.scalars[name]) for name in ESTIMATED if name in result.scalars}
        part = {"slip_area": 0.03, "contact_area": 0.03}
        result.scalars |= {f"{name}_error": part.get(name, 1e-6) * value for name, value in known.items()}
    return made


def with_failures() -> Synthetic:
    made = papers()
    for i, (case, _) in enumerate(made.results):
        if (case.grid, case.index) in UNSOLVED:
            made.results[i] = (case, made_up_result(case.scene, Status.NOT_CONVERGED))
    return made


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Iterator[xr.DataTree]:
    with synthetic_tree(tmp_path_factory.mktemp("solved"), papers()) as opened:
        yield opened


@pytest.fixture(scope="module")
def failing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[xr.DataTree]:
    with synthetic_tree(tmp_path_factory.mktemp("failing"), with_failures()) as opened:
        yield opened


def draw(tree: xr.DataTree, name: str) -> Figure:
    with style():
        return paper_figure(name, grids(tree))


def panels(figure: Figure) -> list[Any]:
    """Axes of a figure's panels (the colour bar is not one)."""
    return [ax for ax in figure.axes if ax.get_label() != "<colorbar>" and ax.get_visible()]


def markers(ax: Any, state: str) -> Any:
    return next(c for c in ax.collections if c.get_gid() == state)


def remarks(ax: Any) -> str:
    return " ".join(t.get_text().replace("\n", " ") for t in ax.texts if t.get_gid() == "remark")


def caption_of(figure: Figure) -> str:
    return " ".join(t.get_text().replace("\n", " ") for t in figure.texts if t.get_gid() == "caption")


def lines(ax: Any) -> dict[str, Any]:
    return {str(line.get_label()): line for line in ax.lines}


def read(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def tables(tree: xr.DataTree, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the tables of the solved cube."""
    out = tmp_path_factory.mktemp("tables")
    make_tables(tree, out)
    return out


# maps


def test_maps_have_one_marker_a_cell_filled_where_it_slips(tree: xr.DataTree) -> None:
    data = tree["figure_9"].to_dataset()
    shown = panels(draw(tree, "figure_9"))
    assert len(shown) == 12
    for ax, (m, c) in zip(shown, np.ndindex(2, 6), strict=True):
        state = data.state.isel(modulus=m, creepage=c).values
        for name, value, filled in (("slip", 2, True), ("stick", 1, False)):
            circles = markers(ax, name)
            i, j = np.nonzero(state == value)
            expected = {(x, y) for x, y in zip(data.x.values[i], data.y.values[j], strict=True)}
            assert {tuple(o) for o in np.asarray(circles.get_offsets())} == expected
            assert len(circles.get_offsets()) == i.size
            face = circles.get_facecolor()
            assert (len(face) > 0 and tuple(face[0]) == to_rgba("black")) is filled


def test_fine_meshes_have_a_circle_for_several_cells(tree: xr.DataTree, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rcstudy.report.draw.CIRCLES", 6)
    data = tree["figure_4"].to_dataset()
    figure = draw(tree, "figure_4")
    ax = panels(figure)[2]
    extent = ax.get_xlim()[1]
    across = 2 * extent / min(2.0 / n for n in CELLS)
    assert 6 < across < 12
    drawn = [tuple(o) for state in ("slip", "stick") for o in np.asarray(markers(ax, state).get_offsets())]
    spaces = np.unique(np.diff(sorted({x for x, _ in drawn})).round(9))
    np.testing.assert_allclose(spaces, 3 * 2.0 / CELLS[0])
    for name, value in (("slip", 2), ("stick", 1)):
        for x, y in np.asarray(markers(ax, name).get_offsets()):
            assert int(data.state.isel(creepage=2).sel(x=x, y=y)) == value
    texts = [t.get_text() for legend in figure.legends for t in legend.get_texts()]
    assert "slip cell (one of 3 × 3 where fine)" in texts


ELLIPSES = """\
study: s
scene:
  substrate: {E: 210000, nu: 0.28}
  load: 12345
  friction: 0.3
  mesh: {size: auto, cells: [48, 48]}
  creepage: {longitudinal: 0.0005, lateral: 0.0003, spin: 0.0004}
  radius: 460
grids:
  long: {axes: {radius: [[460, 300], [460, 80], [460, 30]]}}
  thin: {axes: {radius: [[1000, 10]]}}
  broad: {axes: {radius: [[150, 460]]}}
  narrow: {axes: {radius: [[10, 1000]]}}
"""


def test_maps_of_ellipses_have_marks_equally_far_apart_both_ways(tmp_path: Path) -> None:
    """Cells of windows that fit are as oblong as contacts; panels are no squares, and only extreme ones stretched."""
    run(load_text(tmp_path, ELLIPSES), tmp_path / "s.nc", workers=1)
    stretched = {}
    with open_cube(tmp_path / "s.nc") as tree, style():
        for name, grid in grids(tree).items():
            figure = case_maps(grid)
            assert figure is not None
            for ax, case in zip(panels(figure), grid.cases(), strict=True):
                stretched[name] = ax.get_aspect()
                (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
                assert 0.45 <= ax.get_aspect() * (top - bottom) / (right - left) <= 1.2501
                i, j = np.nonzero(case.field("state"))
                half = np.array([np.abs(case.x[i]).max(), np.abs(case.y[j]).max()])
                assert (half < (right, top)).all() and (half[0] > 0.4 * right or half[1] > 0.4 * top)
                scale = np.array([1.0, ax.get_aspect()])
                circles = np.concatenate([markers(ax, state).get_offsets() for state in ("slip", "stick")])
                arrows = markers(ax, "direction")
                for marks, most in ((circles, 1.8), (arrows.get_offsets(), 1.8)):
                    x, y = ((np.unique(np.asarray(marks)[:, k].round(9)) * scale[k]) for k in (0, 1))
                    distances = np.diff(x).min(), np.diff(y).min()
                    assert max(distances) < most * min(distances), (name, case.label, distances)
                lengths = np.hypot(arrows.U, arrows.V)
                assert 0.4 * max(distances) < lengths.min() and lengths.max() < min(distances)
                assert arrows.units == "x" and arrows.width * arrows.headlength < 0.6 * lengths.min()  # a shaft is left
            assert ("times as large" in caption_of(figure)) is (ax.get_aspect() != 1.0)
    assert stretched["long"] == stretched["broad"] == 1.0
    assert stretched["thin"] > 3.0 and stretched["narrow"] < 0.4


def test_narrow_contacts_in_wide_panels_have_arrows(tmp_path: Path) -> None:
    """Marks of an even number of cells are half a step beside the axis: there was no contact, and no arrow."""
    grid = "  both: {axes: {radius: [[2000, 50], [50, 2000]]}}\n"
    run(load_text(tmp_path, ELLIPSES[: ELLIPSES.index("  long:")] + grid), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree, style():
        figure = case_maps(grids(tree)["both"])
        assert figure is not None
        for ax, along in zip(panels(figure), (0, 1), strict=True):
            places = np.asarray(markers(ax, "direction").get_offsets()).round(9)
            assert len(np.unique(places[:, along])) >= 4 and len(np.unique(places[:, 1 - along])) >= 2


FITTED = """\
study: s
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  creepage: {longitudinal: 0.001}
  mesh: {size: auto, cells: [48, 48], margin: 1.3}
grids:
  loads: {axes: {load: [20, 100]}}
  meshes: {scene: {load: 100}, axes: {mesh.cells: [[16, 16], [96, 96]]}}
"""


@pytest.mark.parametrize("crop", ["none", "contact"])
def test_contacts_of_as_many_cells_have_as_many_circles(tmp_path: Path, crop: str) -> None:
    """However large they are: the largest one had one in each cell, the others in one of 3 x 3. Few cells keep all."""
    run(load_text(tmp_path, f"{FITTED}outputs: {{crop: {crop}}}\n"), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree, style():
        found = {}
        for name, grid in grids(tree).items():
            figure = case_maps(grid)
            assert figure is not None
            found[name] = []
            for ax, case in zip(panels(figure), grid.cases(), strict=True):
                x = np.concatenate([markers(ax, state).get_offsets() for state in ("slip", "stick")])[:, 0]
                found[name].append(round(float(np.diff(np.unique(x.round(9))).min() / case.spacing[0])))
            words = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
            assert "slip cell (one of 3 × 3 where fine)" in words
    assert found == {"loads": [3, 3], "meshes": [1, 3]}


LINES_ON_AXIS = """\
study: s
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  load: 100
  mesh: {size: [2, 2], cells: [20, 20]}
  creepage: {longitudinal: 0.001}
grids:
  figure_3: {axes: {layer_count: [1], thickness: [1 a], modulus: [0.5 Es, 2 Es]}}
  figure_5: {axes: {thickness: [1 a], modulus: [0.5 Es, 2 Es], creepage: [{longitudinal: 0.001}]}}
"""


@pytest.mark.parametrize("name", ["figure_3", "figure_5"])
def test_lines_come_down_to_zero_whatever_part_of_the_window_is_stored(tmp_path: Path, name: str) -> None:
    """With `crop: contact` those of the largest contact ended at its last cell."""
    drawn = []
    for crop in ("none", "contact"):
        cube = tmp_path / f"{crop}.nc"
        run(load_text(tmp_path, f"{LINES_ON_AXIS}outputs: {{crop: {crop}}}\n"), cube, workers=1)
        with open_cube(cube) as tree, style():
            figure = paper_figure(name, grids(tree))
            drawn.append([np.stack(line.get_data()) for ax in panels(figure) for line in ax.lines])
    for whole, part in zip(*drawn, strict=True):
        assert part == pytest.approx(whole, abs=1e-12)


LOADS = """\
study: s
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  mesh: {size: [1, 1], cells: [64, 64]}
  creepage: {longitudinal: 0.001}
grids:
  loads: {axes: {load: [1, 100]}}
"""


def test_arrows_are_no_shorter_in_small_contacts(tmp_path: Path) -> None:
    """Than 5 % of the panel: shorter ones cannot be seen."""
    run(load_text(tmp_path, LOADS), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree, style():
        figure = case_maps(grids(tree)["loads"])
        assert figure is not None
        for ax in panels(figure):
            arrows = markers(ax, "direction")
            assert len(arrows.U) >= 4
            assert np.hypot(arrows.U, arrows.V).min() > 0.05 * np.ptp(ax.get_xlim())


PRESSURES = """\
study: s
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: [500, 5]
  mesh: {size: auto, cells: [24, 24]}
grids:
  loads: {axes: {load: [1, 1000], tolerance.normal: [1.0e-5, 1.0e-16]}}
  refused: {scene: {load: 1}, axes: {tolerance.normal: [1.0e-16]}}
"""


def test_pressures_alone_have_maps_of_the_pressure(tmp_path: Path) -> None:
    run(load_text(tmp_path, PRESSURES), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree, style():
        figure, refused = (case_maps(grid) for grid in grids(tree).values())
        data = tree["loads"].to_dataset()
        words = caption_of(figure)
        shown = panels(figure)
        for k, ax in enumerate(shown[::2]):
            p = data.pressure.values[k, 0]
            (image,) = ax.get_images()
            drawn = image.get_array()
            np.testing.assert_array_equal(drawn.compressed(), p.T[p.T > 0])
            # ten times the other's: in the colours of the larger one it would have no shape
            assert image.norm.vmax == data.pressure_max.values[k, 0] and image.norm.vmin == 0
            i, j = np.nonzero(p > 0)
            dx, dy = (np.diff(data[f"{axis}_centre"].values[k, 0])[0] for axis in "xy")
            edges = [data.x_centre.values[k, 0][i.min()] - dx / 2, data.y_centre.values[k, 0][j.max()] + dy / 2]
            np.testing.assert_allclose([image.get_extent()[0], image.get_extent()[3]], edges)
            texts = {text.get_gid(): text.get_text() for text in ax.texts}
            assert texts == {"pressure-max": f"{data.pressure_max.values[k, 0]:.4g} MPa"}
        assert [bool(remarks(ax)) for ax in shown] == [False, True] * 2
        assert [ax.get_xlabel() for ax in shown[2:]] == ["$x$ (mm)"] * 2  # nothing rolls
        assert figure.axes[-1].get_xlabel() == "$p$ / largest $p$"
        assert "its largest value, to which its colours refer." in words
        assert "Pressure $p$." in words and "traction" not in words and "arrows" not in words
        assert "Each panel has its own scale" in words and "as large along $y$ as along $x$." in words
        assert remarks(panels(refused)[0]) and "Pressure" not in caption_of(refused)


def test_pressures_that_differ_little_have_one_colour_scale(tmp_path: Path) -> None:
    """It holds the largest pressure, which with aligned cells may lie between their centres."""
    grid = "loads: {scene: {discretisation: aligned}, axes: {load: [1, 100]}}"
    text = PRESSURES.partition("grids:")[0] + f"grids: {{{grid}}}\n"
    run(load_text(tmp_path, text), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree, style():
        figure = case_maps(next(iter(grids(tree).values())))
        largest = float(tree.to_dataset().pressure_max.max())
        assert largest > float(tree.to_dataset().pressure.max())
        assert [ax.get_images()[0].norm.vmax for ax in panels(figure)] == [largest] * 2
        assert figure.axes[-1].get_xlabel() == "$p$ (MPa)" and "refer" not in caption_of(figure)


ROLLING = """\
study: s
scene:
  substrate: {E: 210000, nu: 0.3}
  counterbody: {E: 210000, nu: 0.3}
  load: 100
  radius: 50
  creepage: {longitudinal: 0.001, spin: 0.01}
  mesh: {size: auto, cells: [20, 20]}
grids:
  much: {axes: {creepage.longitudinal: [0, 0.00001, 0.01], creepage.spin: [0]}}
  less: {axes: {friction: [0.2, 0.3]}}
"""


def test_tractions_that_differ_much_have_colours_of_their_own(tmp_path: Path) -> None:
    """A hundred times smaller ones were of one colour. Without creepage there are none, which is no scale."""
    run(load_text(tmp_path, ROLLING), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree, style():
        much, less = (case_maps(grid) for grid in grids(tree).values())
        assert much is not None and less is not None
        data = tree["much"].to_dataset()
        q = np.hypot(data.traction_x.values, data.traction_y.values).max(axis=(-2, -1)).ravel()
        assert q[0] == 0.0 and q[2] > 5.0 * q[1] > 0.0
        assert [ax.get_images()[0].norm.vmax for ax in panels(much)[:3]] == [1.0, q[1], q[2]]
        texts = [next(t.get_text() for t in ax.texts if t.get_gid() == "slip-ratio") for ax in panels(much)[:3]]
        assert [text.partition("\n")[2] for text in texts] == [f"{value:.4g} MPa" for value in q]
        assert much.axes[-1].get_xlabel() == "$|q|$ / largest $|q|$"
        assert "and the largest $|q|$ of a cell, to which its colours refer." in caption_of(much)
        assert len({ax.get_images()[0].norm.vmax for ax in panels(less)}) == 1
        assert less.axes[-1].get_xlabel() == "$|q|$ (MPa)" and "refer" not in caption_of(less)


@pytest.mark.parametrize(
    ("ratio", "error", "words"),
    [
        (1.0, 0.0, "100 %"),
        (0.9996, 0.02, "> 99 %"),
        (0.9996, 0.001, "> 99.9 %"),
        (0.9984, 0.001, "99.8 %"),
        (0.532, 0.001, "53.2 %"),
        (0.532, 0.02, "53 %"),
        (0.0, 0.02, "0 %"),
    ],
)
def test_nearly_all_is_not_all(ratio: float, error: float, words: str) -> None:
    """Maps with cells that stick said that 100 % slip."""
    assert maps._per_cent(ratio, error) == words


@pytest.mark.parametrize("half", [0.302, 0.42, 0.06, 51.0])
def test_no_number_is_at_the_end_of_a_panel(half: float) -> None:
    """It ran into the first number of the panel beside."""
    ax = Figure(figsize=(2.2, 2.2)).add_axes((0.0, 0.0, 1.0, 1.0))
    Window(half, half).on(ax)
    shown = [tick for tick in ax.get_xticks() if abs(tick) <= half]
    assert len(shown) >= 3
    assert max(map(abs, shown)) < 0.92 * half


CUT = """\
study: s
scene:
  substrate: {E: 206000, nu: 0.28}
  counterbody: {E: 206000, nu: 0.28}
  radius: [460, 240]
  load: 80000
  mesh: {size: auto, cells: [20, 18], margin: 1.3}
  creepage: {longitudinal: 0.001}
grids:
  g:
    axes:
      layers:
        - {label: bare, layers: []}
        - {label: soft, layers: [{E: 0.5 Es, nu: 0.3, thickness: 0.5 a}]}
        - {label: two, layers: [{E: 2 Es, nu: 0.3, thickness: 0.2 a}, {E: 0.5 Es, nu: 0.3, thickness: 0.5 a}]}
      counterbody: [rigid, {label: steel, E: 210000, nu: 0.3}]
      friction: [0.2, 0.4]
"""


def test_no_label_is_cut_off_at_the_edge(tmp_path: Path) -> None:
    """Room was made for the numbers of panels of another size, which have fewer digits: of a label a half was left."""
    run(load_text(tmp_path, CUT), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree, style():
        figure = case_maps(next(iter(grids(tree).values())))
        assert figure is not None
        save(figure, tmp_path, "maps", ("png",))
        labels = [ax.yaxis.label for ax in panels(figure) if ax.get_ylabel()]
        assert len(labels) == 4
        assert min(label.get_window_extent().x0 for label in labels) > 0.0


def test_tables_of_pressures_alone_have_no_columns_of_tractions(tmp_path: Path) -> None:
    run(load_text(tmp_path, PRESSURES), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree:
        make_tables(tree, tmp_path)
    titles = {name: (tmp_path / f"{name}.md").read_text(encoding="utf-8") for name in ("results", "solver")}
    assert "Peak pressure (MPa)" in titles["results"] and "Products, pressure" in titles["solver"]
    for absent in ("Largest traction", "Friction power", "forces and moment"):
        assert absent not in titles["results"]
    assert "Products, tractions" not in titles["solver"] and "Iterations, tractions" not in titles["solver"]
    assert "force_x_N" in read(tmp_path / "results.csv")[0]  # programs find the same columns everywhere


SIZES = """\
study: s
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  creepage: {longitudinal: 0.001, spin: 0.01}
  mesh: {size: auto, cells: [24, 24]}
grids:
  much: {axes: {load: [10, 1000], tolerance.normal: [1.0e-5, 1.0e-16]}}
  less: {axes: {load: [5, 100]}}
  few: {scene: {mesh: {cells: [6, 6]}}, axes: {load: [50, 100]}}
"""


def test_marks_are_readable_in_contacts_of_any_size(tmp_path: Path) -> None:
    """Small contacts thinned out the circles of large ones: eight black discs, and had no arrows themselves."""
    run(load_text(tmp_path, SIZES), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree, style():
        figures = {name: case_maps(grid) for name, grid in grids(tree).items()}
        for name, figure in figures.items():
            assert figure is not None
            for ax in (ax for ax in panels(figure) if not remarks(ax)):
                side = np.ptp(ax.get_xlim())
                x = np.concatenate([markers(ax, state).get_offsets() for state in ("slip", "stick")])[:, 0]
                assert len(np.unique(x.round(9))) >= (4 if name == "few" else 6)
                assert markers(ax, "slip")._widths[0] * 2 <= 0.0801 * side
                arrows = markers(ax, "direction")
                assert len(arrows.U) >= 4 and 0.05 * side < np.hypot(arrows.U, arrows.V).max() < 0.121 * side
        much, less = (panels(figures[name]) for name in ("much", "less"))  # type: ignore[arg-type]
        one, other = much[0].get_xlim()[1], much[2].get_xlim()[1]
        assert other / one == pytest.approx(100 ** (1 / 3), rel=0.05)
        assert [bool(ax.get_xticklabels()[0].get_visible()) for ax in much[::2]] == [True, True]
        assert much[1].get_xticks().size == 0  # nothing is drawn there to a scale
        assert len({ax.get_xlim() for ax in less}) == 1
        assert ["Each panel has its own scale" in caption_of(f) for f in figures.values() if f] == [True, False, False]


def test_maps_show_the_magnitude_of_the_traction_on_one_scale(tree: xr.DataTree) -> None:
    data = tree["figure_7"].to_dataset()
    figure = draw(tree, "figure_7")
    q = np.hypot(data.traction_x.values, data.traction_y.values)
    for ax, (m, c) in zip(panels(figure), np.ndindex(2, 6), strict=True):
        (image,) = ax.images
        left, right, bottom, top = image.get_extent()
        dx, dy = 2.0 / CELLS[0], 2.0 / CELLS[1]
        inside_x = (data.x.values > left) & (data.x.values < right)
        inside_y = (data.y.values > bottom) & (data.y.values < top)
        np.testing.assert_array_equal(image.get_array().filled(0.0).T, q[m, c][np.ix_(inside_x, inside_y)])
        assert (right - left, top - bottom) == pytest.approx((inside_x.sum() * dx, inside_y.sum() * dy))
        contact = data.state.values[m, c] != 0
        assert contact.sum() == np.sum(~np.ma.getmaskarray(image.get_array()))
        assert (image.norm.vmin, image.norm.vmax) == (0.0, pytest.approx(q.max()))
        assert ax.get_aspect() == 1.0
        x, y = (
            np.abs(centres[(data.state != 0).any(("modulus", "creepage", other)).values]).max()
            for centres, other in ((data.x.values, "y"), (data.y.values, "x"))
        )
        assert ax.get_xlim() == pytest.approx((-1.15 * (x + dx / 2), 1.15 * (x + dx / 2)))
        assert ax.get_ylim() == pytest.approx((-1.15 * (y + dy / 2), 1.15 * (y + dy / 2)))
    (bar,) = [ax for ax in figure.axes if ax.get_label() == "<colorbar>"]
    assert bar.get_xlabel() == "$|q|$ (MPa)"


def test_arrows_point_along_the_traction(tree: xr.DataTree) -> None:
    data = tree["figure_7"].to_dataset().isel(modulus=1, creepage=5)
    ax = panels(draw(tree, "figure_7"))[11]
    arrows = markers(ax, "direction")
    assert 4 <= len(arrows.U) <= 80
    assert all(arrows.get_zorder() > markers(ax, state).get_zorder() for state in ("slip", "stick"))  # discs hide them
    for (x, y), u, v in zip(arrows.get_offsets(), arrows.U, arrows.V, strict=True):
        qx, qy = (float(data[name].sel(x=x, y=y)) for name in ("traction_x", "traction_y"))
        assert u * qy - v * qx == pytest.approx(0.0, abs=1e-9 * np.hypot(qx, qy))
        assert u * qx + v * qy > 0


def test_maps_name_panels_layers_creepages_axes_and_slip(tree: xr.DataTree) -> None:
    shown = panels(draw(tree, "figure_9"))
    titles = [ax.get_title(loc="left") for ax in shown]
    assert [t[:3] for t in titles] == [f"({c})" for c in "abcdefghijkl"]
    assert titles[5] == (
        r"(f) $E_1 = 0.5\,E_2 = 0.25\,E_s$, $0.25\,a$"
        "\n"
        r"$\xi_x = 0.002$, $\xi_y = 0.001$, $\varphi = 0.01$"
    )
    assert r"$E_1 = 2\,E_2 = 4\,E_s$" in titles[6]
    assert all("mm" in ax.get_xlabel() and "rolling" in ax.get_xlabel() for ax in shown[-3:])
    assert all(ax.get_ylabel() == "$y$ (mm)" for ax in shown[::3])
    data = tree["figure_9"].to_dataset()
    ratio = (data.state.values[0, 3] == 2).sum() / (data.state.values[0, 3] != 0).sum()
    assert [t.get_text() for t in shown[3].texts if t.get_gid() == "slip-ratio"] == [f"slip {100 * ratio:.0f} %"]


def test_figure_4_has_four_panels_with_the_papers_letters(tree: xr.DataTree) -> None:
    figure = draw(tree, "figure_4")
    assert [ax.get_title(loc="left")[:12] for ax in panels(figure)] == [f"({c}) no layer" for c in "aceg"]
    (caption,) = [t.get_text() for t in figure.texts if t.get_gid() == "caption"]
    for words in (
        "Fig. 4.",
        "b, d, f and h",
        "$P$ = 100 N",
        r"$\mu$ = 1",
        "$a$ = 0.2533 mm",
        "$p_0$ = 744.2 MPa",
        "0.0625 mm",
    ):
        assert words in caption.replace("\n", " ")


# lines


def mean_of_middle_rows(field: np.ndarray) -> np.ndarray:
    n = field.shape[1]
    return (field[:, n // 2 - 1] + field[:, n // 2]) / 2


def test_figure_5_lines_are_the_traction_next_to_the_x_axis(tree: xr.DataTree) -> None:
    data = tree["figure_5"].to_dataset()
    shown = panels(draw(tree, "figure_5"))
    assert len(shown) == 6
    a = float(data.hertz_radius.values.flat[0])
    for position, ax in enumerate(shown):
        m, t = divmod(position, 3)
        drawn = lines(ax)
        assert len(drawn) == 7
        for c in range(5):
            line = drawn[rf"$\xi_x = {0.002 * (c + 1):.4g}$"]
            expected = -mean_of_middle_rows(data.traction_x.isel(thickness=t, modulus=m, creepage=c).values)
            at = dict(zip(data.x.values / a, expected, strict=True))
            digits = 1e-6 * np.abs(expected).max()
            np.testing.assert_allclose(line.get_ydata(), [at[x] for x in line.get_xdata()], rtol=0.0, atol=digits)
            assert sum(line.get_ydata()) == pytest.approx(sum(expected))
        bound = drawn[r"bound $\pm\mu p$"]
        other = drawn[""]
        np.testing.assert_array_equal(other.get_ydata(), -bound.get_ydata())  # cells at the leading edge may slip there
        assert ax.get_ylim()[0] > 0.5 * min(other.get_ydata())
        pressure = mean_of_middle_rows(data.pressure.isel(thickness=t, modulus=m, creepage=0).values)
        assert sum(bound.get_ydata()) == pytest.approx(sum(pressure))
        assert bound.get_linestyle() == "--"
    assert {ax.get_xlabel() for ax in shown[3:]} == {"$x/a$"}
    assert {ax.get_ylabel() for ax in shown[::3]} == {"$-q_x$ (MPa)"}
    assert shown[5].get_title(loc="left") == r"(f) $E_1 = 2\,E_s$, $1\,a$"


def test_captions_of_figure_5_say_whose_bounds_are_drawn(tree: xr.DataTree, tmp_path: Path) -> None:
    """With full coupling those of one creepage were said to be those of all."""
    usual = caption_of(draw(tree, "figure_5"))
    assert "under longitudinal creepage alone" in usual and r"the bounds $\pm\mu p$. Rolling" in usual
    made = papers()
    for case, result in made.results:
        if case.grid == "figure_5" and case.index[-1] == 4:
            result.fields["pressure"] *= 1.01
    with synthetic_tree(tmp_path, made) as other:
        assert r"$\pm\mu p$ of the last creepage, on which the pressure depends. Rolling" in caption_of(
            draw(other, "figure_5")
        )


def test_figure_5_tells_of_spin(tmp_path: Path) -> None:
    """It said `under longitudinal creepage alone`."""
    grid = make_grid("figure_5", thickness_axis(), modulus_axis(), creepage_axis({"d": CREEPAGES["d"]}))
    with synthetic_tree(tmp_path, assemble(make_study(), (grid, grid_cases(grid, SCENE, layer_count=1)))) as tree:
        caption = caption_of(draw(tree, "figure_5"))
    assert "traction on the x-axis, shown" in caption and r"spin $\varphi$ in rad/mm. Rolling" in caption


def test_figure_3_shows_pressure_over_hertz_with_the_uncoated_case_in_both_panels(tree: xr.DataTree) -> None:
    data, bare = tree["figure_3"].to_dataset(), tree["figure_3_bare"].to_dataset()
    figure = draw(tree, "figure_3")
    shown = panels(figure)
    assert [ax.get_title(loc="left")[:3] for ax in shown] == ["(a)", "(b)"]
    p0, a = float(bare.hertz_pressure.values[0]), float(bare.hertz_radius.values[0])
    for count, ax in enumerate(shown):
        drawn = lines(ax)
        assert len(drawn) == 8
        plain = drawn["no layer, computed"]
        assert sum(plain.get_ydata()) == pytest.approx(mean_of_middle_rows(bare.pressure.values[0]).sum() / p0)
        for t, m in np.ndindex(3, 2):
            name = ((r"0.5\,E_s", r"2\,E_s"), (r"0.5\,E_2 = 0.25\,E_s", r"2\,E_2 = 4\,E_s"))[count][m]
            line = drawn[rf"$E_1 = {name}$, ${(0.25, 0.5, 1)[t]:g}\,a$"]
            pressure = mean_of_middle_rows(data.pressure.values[count, t, m])
            assert max(line.get_ydata()) == pytest.approx(pressure.max() / p0)
            reach = np.abs(data.x.values[pressure > 0]).max() + 2.0 / CELLS[0]
            assert max(line.get_xdata()) == pytest.approx(reach / a)
        in_grey = {
            (line.get_marker(), str(line.get_linestyle()), line.get_markerfacecolor() == "white")
            for line in drawn.values()
        }
        assert len(in_grey) == len(drawn)
        assert (ax.get_xlabel(), ax.get_ylim()[0]) == ("$x/a$", 0.0)
    assert "the mean of the two rows" in " ".join(t.get_text() for t in figure.texts).replace("\n", " ")


def test_figure_3_takes_any_numbers_of_layers(tmp_path: Path) -> None:
    """A panel each, two side by side; names of more than two layers would be wider than that."""
    counts = Axis("layer_count", 4, {"layer_count": Coord([0, 1, 2, 5], "1", "layers")}, ("0", "1", "2", "5"))
    grid = make_grid("figure_3", counts, thickness_axis(), modulus_axis((0.5, 0.75, 2.0)))
    made = assemble(make_study(), (grid, grid_cases(grid, replace(SCENE, creepage=None))))
    with synthetic_tree(tmp_path, made) as tree, warnings.catch_warnings(), style():
        warnings.simplefilter("error")
        figure = paper_figure("figure_3", grids(tree))
        save(figure, tmp_path, "figure_3", ["png"])
    shown = panels(figure)
    words = [
        "no layer",
        "one layer",
        "two layers, each of the thickness given",
        "5 layers, each of the thickness given",
    ]
    assert [ax.get_title(loc="left") for ax in shown] == [f"({'abcd'[k]}) {text}" for k, text in enumerate(words)]
    assert len(lines(shown[0])) == 2 and len(lines(shown[3])) == 10
    assert r"$E_1 = 32\,E_s$, $0.5\,a$" in lines(shown[3])
    looks = {(line.get_color(), str(line.get_linestyle()), line.get_marker()) for line in shown[3].lines}
    assert len(looks) == len(shown[3].lines)
    boxes = [ax.get_legend().get_window_extent() for ax in shown]
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


def test_other_panels_of_figure_4_are_named_only_where_they_are_not_drawn(tmp_path: Path) -> None:
    grid = make_grid("figure_4", creepage_axis({"a": CREEPAGES["a"], "b": CREEPAGES["b"]}))
    with synthetic_tree(tmp_path, assemble(make_study(), (grid, grid_cases(grid, SCENE)))) as tree:
        assert "b, d, f and h" not in caption_of(draw(tree, "figure_4"))


def test_figure_4_has_no_coated_body(tree: xr.DataTree) -> None:
    told = {name: caption_of(draw(tree, name)) for name in ("figure_4", "figure_7")}
    assert "traction on the substrate. " in told["figure_4"] and "traction on the coated body. " in told["figure_7"]


def test_captions_keep_numbers_with_their_units_and_name_what_is_shown(tree: xr.DataTree) -> None:
    for number in range(3, 11):
        figure = draw(tree, f"figure_{number}")
        (caption,) = [t.get_text() for t in figure.texts if t.get_gid() == "caption"]
        assert "$P$ = 100 N" in caption and "0.0625 mm × 0.07143 mm" in caption
        assert (r"$\mu$" in caption) is (number != 3)  # pressure does not depend on it


def test_captions_of_the_papers_figures_name_bodies_and_discretisation(tmp_path: Path) -> None:
    """And the symbols that are shown: no second layer's modulus where there is one layer."""
    made = paper(CELLS)
    study = SimpleNamespace(**vars(made.study) | {"text": (CONFIGS / "paper.yaml").read_text(encoding="utf-8")})
    with synthetic_tree(tmp_path, Synthetic(study, made.expansion, made.results)) as tree:
        captions = {number: caption_of(draw(tree, f"figure_{number}")) for number in range(3, 11)}
    bodies = r"$R$ = 50 mm, substrate $E_s$ = 210000 MPa, $\nu$ = 0.3, rigid counterbody, "
    for number, caption in captions.items():
        coupling = "" if number == 3 else "one-way coupling, "
        assert f"{bodies}{coupling}kalker discretisation. $P$ = 100 N, " in caption
        assert (r"Layers: $\nu = 0.3$. $R$" in caption) is (number != 4)
        assert ("$E_2$" in caption) is (number in (3, 6, 9, 10))
        assert ("$E_1$, $E_s$: moduli of the layer and the substrate" in caption) is (number in (5, 7, 8))


def test_panels_beyond_z_come_after_it(tmp_path: Path) -> None:
    ratios = tuple(0.25 * (k + 1) for k in range(14))
    grid = make_grid("figure_5", thickness_axis(ratios), modulus_axis(), creepage_axis({"a": CREEPAGES["a"]}))
    with synthetic_tree(tmp_path, assemble(make_study(), (grid, grid_cases(grid, SCENE)))) as opened:
        titles = [ax.get_title(loc="left") for ax in panels(draw(opened, "figure_5"))]
    assert [t.split()[0] for t in titles] == [f"({letters(k)})" for k in range(28)]


def test_on_the_x_axis_is_the_middle_row_or_the_mean_of_two() -> None:
    field = np.array([[1.0, 2.0, 4.0], [3.0, 5.0, 9.0]])
    np.testing.assert_array_equal(measures.on_x_axis(field, np.array([-0.1, 0.0, 0.1])), [2.0, 5.0])
    for y in (np.array([-0.05, 0.05]), np.array([-0.05, np.nextafter(0.05, 1.0)])):
        np.testing.assert_array_equal(measures.on_x_axis(field[:, 1:], y), [3.0, 7.0])


def test_line_looks_differ_in_colour_dash_and_marker() -> None:
    for key in ("color", "linestyle", "marker"):
        assert len({str(look[key]) for look in LINES}) == len(LINES)


# cases that were not solved


def test_unsolved_map_says_so_and_draws_nothing(failing: xr.DataTree) -> None:
    shown = panels(draw(failing, "figure_7"))
    assert remarks(shown[1]) == "not solved: not converged: made up not to converge"
    assert not shown[1].images and not shown[1].collections
    solved = failing["figure_7"].to_dataset()
    q = np.hypot(solved.traction_x.values, solved.traction_y.values)
    q[0, 1] = 0.0
    assert shown[0].images[0].norm.vmax == pytest.approx(q.max())
    assert all(ax.images and not remarks(ax) for k, ax in enumerate(shown) if k != 1)


def test_unsolved_line_is_not_drawn(failing: xr.DataTree) -> None:
    ax = panels(draw(failing, "figure_5"))[1]
    assert r"$\xi_x = 0.006$" not in lines(ax) and len(lines(ax)) == 6
    assert r"not solved: $\xi_x = 0.006$: not converged" in remarks(ax)
    ax = panels(draw(failing, "figure_3"))[0]
    assert len(lines(ax)) == 7 and "not solved" in remarks(ax)


def test_every_estimated_number_has_a_column_of_results() -> None:
    """But for areas: that of contact is told by its radius, that of slip over that of contact."""
    stored = {column.variable for column in tables_module.RESULTS if column.variable}
    assert stored == set(ESTIMATED) - {"contact_area", "slip_area"}


def test_a_number_without_a_unit_has_its_column(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It was left out in silence: numbers were found by name and unit, `name_`."""
    column = tables_module._stored("residual_normal", "Residual", form=".1e")
    monkeypatch.setattr(tables_module, "RESULTS", (*tables_module.RESULTS, column))
    with synthetic_tree(tmp_path, small()) as cube:
        make_tables(cube, tmp_path)
        stored = case_table(cube)["residual_normal"]
    with (tmp_path / "results.csv").open(encoding="utf-8", newline="") as file:
        assert [float(row["residual_normal"]) for row in csv.DictReader(file)] == stored.tolist()


def test_unsolved_cases_have_no_numbers_in_tables_and_decide_nothing(failing: xr.DataTree, tmp_path: Path) -> None:
    make_tables(failing, tmp_path)
    rows = read(tmp_path / "results.csv")
    (row,) = [r for r in rows if (r["figure"], r["panel"]) == ("7", "b")]
    assert row["status"] == "not converged: made up not to converge"
    # of the case, not of its result
    given = {"spin_rad_per_mm": "0", "thickness_mm": "0.126644925478", "modulus_MPa": "105000"}
    assert {k: row[k] for k in given} == given
    of_case = {"figure", "panel", "status", "layer_count", "layers", "creepage", "longitudinal", "lateral", *given}
    of_result = row.keys() - of_case
    assert {"approach_mm", "force_x_N", "moment_z_N_mm", "pressure_max_MPa", "slip_ratio_error"} < of_result
    assert {k: row[k] for k in of_result if row[k]} == {}
    assert sum(r["status"] == "solved" for r in rows) == len(rows) - len(UNSOLVED)
    comparisons = [r for r in read(tmp_path / "statements_comparisons.csv") if "7b:" in r["cases"]]
    assert comparisons and all(r["holds"].startswith("undecided") for r in comparisons)


def test_lines_none_of_which_is_solved_have_no_scales(tmp_path: Path) -> None:
    made = papers()
    made.results[:] = [
        (case, made_up_result(case.scene, Status.NOT_CONVERGED) if case.grid == "figure_5" else result)
        for case, result in made.results
    ]
    with synthetic_tree(tmp_path, made) as tree:
        figure = draw(tree, "figure_5")
    assert not figure.legends
    for ax in panels(figure):
        assert "not solved" in remarks(ax)
        assert ax.get_xticks().size == ax.get_yticks().size == 0


def test_field_of_an_unsolved_case_is_refused(failing: xr.DataTree) -> None:
    case = grids(failing)["figure_7"].case(0, 1)
    assert np.isnan(case.number("force_x"))
    with pytest.raises(UserError, match="not solved: not converged"):
        case.field("traction_x")


# what make_figures writes


@pytest.mark.usefixtures("undrawn")
def test_only_figures_the_cube_has_are_made_and_the_rest_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    made = paper(CELLS)
    kept = {"figure_4", "figure_3_bare"}
    parts = [(g, [c for c in made.expansion.cases if c.grid == g.name]) for g in made.expansion.grids if g.name in kept]
    with (
        synthetic_tree(tmp_path, assemble(make_study(), *parts)) as tree,
        caplog.at_level(logging.WARNING, logger="rcstudy"),
    ):
        paths = make_figures(tree, tmp_path / "out", formats=("png",))
    assert [p.name for p in paths] == ["figure_3.png", "figure_4.png"]
    skipped = {record.message.split(" skipped")[0] for record in caplog.records}
    assert skipped == {name.replace("_", " ") for name in AXES if name not in ("figure_3", "figure_4")}


NAMED_LIKE_THE_PAPERS = """\
study: s
scene: {substrate: {E: 210000, nu: 0.3}, radius: 50, load: 100, mesh: {size: [2, 2], cells: [8, 8]}}
grids:
  figure_3_bare: {cases: [{label: plain}]}
  figure_3: {axes: {load: [50, 100]}}
  figure_4: {axes: {creepage: [{label: a, longitudinal: 0.001}]}}
  figure_5: {axes: {creepage.spin: [0.001, 0.002]}}
"""


@pytest.mark.usefixtures("undrawn")
def test_grids_with_the_papers_names_but_other_axes_are_those_of_any_study(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The case without layers was the paper's by its name alone: not drawn, or without what tells its cases apart."""
    run(load_text(tmp_path, NAMED_LIKE_THE_PAPERS), tmp_path / "s.nc", workers=1, solve=made_up)
    with open_cube(tmp_path / "s.nc") as tree:
        make_tables(tree, tmp_path)
        with caplog.at_level(logging.WARNING, logger="rcstudy"):
            paths = make_figures(tree, tmp_path / "out", formats=("png",))
    assert [row["figure"] for row in read(tmp_path / "results.csv")] == ["4"]
    others = [(row["grid"], row["case"]) for row in read(tmp_path / "results_of_other_grids.csv")]
    loads = [("figure_3", "load=50"), ("figure_3", "load=100")]
    assert others == [("figure_3_bare", "plain"), *loads, ("figure_5", "spin=0.001"), ("figure_5", "spin=0.002")]
    overviews = {f"{grid}{kind}" for grid in ("figure_3_bare", "figure_3", "figure_5") for kind in ("", "_maps")}
    assert {p.stem for p in paths} == {"figure_4", *overviews}
    assert "figure 5 skipped: the cube has no grid figure_5 like the paper's, with axes creepage, mod" in caplog.text
    several = NAMED_LIKE_THE_PAPERS.replace("[{label: plain}]", "[{label: one}, {label: two, load: 50}]")
    run(load_text(tmp_path, several.replace("  figure_3: ", "  loads: ")), tmp_path / "t.nc", workers=1, solve=made_up)
    with open_cube(tmp_path / "t.nc") as tree:
        make_tables(tree, tmp_path)
    assert [row["case"] for row in read(tmp_path / "results_of_other_grids.csv")][:2] == ["one", "two"]


def test_files_do_not_depend_on_the_run_or_on_the_users_style(tmp_path: Path) -> None:
    with synthetic_tree(tmp_path, small()) as tree:
        first = make_figures(tree, tmp_path / "one")
        assert [p.name for p in first] == ["tiny.png", "tiny.pdf", "tiny_maps.png", "tiny_maps.pdf"]
        with matplotlib.rc_context({"font.size": 33, "axes.facecolor": "red"}):
            second = make_figures(tree, tmp_path / "two")
            assert matplotlib.rcParams["font.size"] == 33
    for a, b in zip(first, second, strict=True):
        assert a.read_bytes() == b.read_bytes()
        assert b"CreationDate" not in a.read_bytes() and b"Matplotlib" not in a.read_bytes()
        assert a.stat().st_size < 300_000
    picture = Image.open(first[2])
    shades = {colour for _, colour in picture.convert("RGB").getcolors(1 << 24)}
    assert len(shades) <= 256 and {(255, 255, 255), (0, 0, 0)} <= shades
    assert picture.info["dpi"] == pytest.approx((200, 200), rel=1e-3)


def test_lines_do_not_show_the_rounding_of_a_machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three of the paper's PDFs differed in the last digit of a marker's place."""
    read_field, rng = CaseView.field, np.random.default_rng(1)
    lines = []
    with synthetic_tree(tmp_path, papers()) as tree:
        case = next(case for case in grids(tree)["figure_5"].cases() if case.solved)
        for noise in (0.0, 1e-13):

            def noisy(case: CaseView, name: str, noise: float = noise) -> np.ndarray:
                field = read_field(case, name)
                return field * (1.0 + noise * rng.standard_normal(field.shape))

            monkeypatch.setattr(CaseView, "field", noisy)
            ax = Figure().add_subplot()
            pressure_line(ax, case, "p", {})
            traction_line(ax, case, "q", {})
            bound_line(ax, case)
            lines.append(np.concatenate([line.get_xydata() for line in ax.lines]))
    assert np.array_equal(*lines)
    assert np.abs(lines[0][:, 1]).max() > 10.0


@pytest.mark.usefixtures("undrawn")
def test_a_grid_may_be_named_as_the_maps_of_another(tmp_path: Path) -> None:
    """Its overview took the place of these maps; as did the row of a grid `all` that of all grids."""
    loads = number_axis("load", [50.0, 100.0], "N")
    grids = [make_grid(name, loads) for name in ("a", "a_maps", "all")]
    made = assemble(make_study(), *((grid, grid_cases(grid, SCENE)) for grid in grids))
    with synthetic_tree(tmp_path, made) as tree:
        names = [path.name for path in make_figures(tree, tmp_path, formats=("png",))]
        make_tables(tree, tmp_path)
    assert names == ["a.png", "a_maps_.png", "a_maps.png", "a_maps_maps.png", "all.png", "all_maps.png"]
    rows = read(tmp_path / "solver_summary.csv")
    assert [row["grid"] for row in rows] == ["a", "a_maps", "all", "all grids"]
    assert [row["cases"] for row in rows] == ["2", "2", "2", "6"]
    assert [": " in row["most_case"] for row in rows] == [False, False, False, True]


def test_cube_without_fields_cannot_be_drawn(tmp_path: Path) -> None:
    made = papers()
    bare = Synthetic(make_study(fields=False), made.expansion, made.results)
    with synthetic_tree(tmp_path, bare) as tree:
        with pytest.raises(UserError, match="no grid but the paper's"):
            make_figures(tree, tmp_path / "out", ("png",), quantities=("approach",))
        with pytest.raises(UserError, match="nothing to draw"):
            make_figures(tree, tmp_path)
        make_tables(tree, tmp_path)
    rows = read(tmp_path / "statements.csv")
    assert statement(rows, "thicker the layer thickness, the larger")["verdict"] == "borne out (4 of 4)"
    assert statement(rows, "symmetric with respect to the x-axis")["verdict"] == "undecided (2 of 2)"
    assert "stored without fields" in statement(rows, "symmetric with respect to the x-axis")["remark"]


def test_unknown_format_is_refused(tree: xr.DataTree, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="jpeg: allowed are png, pdf, svg"):
        make_figures(tree, tmp_path, formats=("jpeg",))


@pytest.mark.parametrize("option", [{"at": {"modulus": "2 Es"}}, {"along": "modulus"}])
def test_an_axis_of_the_papers_figures_alone_is_no_choice(tree: xr.DataTree, tmp_path: Path, option: Any) -> None:
    """It was said that no grid has this axis, and that these are allowed: none."""
    with pytest.raises(UserError, match=r"modulus is an axis of the paper's figures alone, which show all of it$"):
        make_figures(tree, tmp_path / "out", **option)
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("undrawn")
def test_a_format_named_twice_is_written_once(tmp_path: Path) -> None:
    with synthetic_tree(tmp_path, small()) as tree:
        assert [p.name for p in make_figures(tree, tmp_path, formats=("png", "png"))] == ["tiny.png", "tiny_maps.png"]


def test_matplotlib_is_not_imported_before_it_is_needed() -> None:
    code = "import rcstudy.figures, rcstudy.tables, sys; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# any other study


def test_overview_of_a_product_has_a_line_per_second_axis(tmp_path: Path) -> None:
    with synthetic_tree(tmp_path, small()) as tree:
        grid = grids(tree)["tiny"]
        with style():
            figure = overview_figure(grid)
            maps = case_maps(grid)
        shown = {ax.get_ylabel(): ax for ax in panels(figure)}
        data = tree.to_dataset()
        for k, line in enumerate(shown["$F_x$ (N)"].lines):
            np.testing.assert_array_equal(line.get_xdata(), data.modulus.values)
            np.testing.assert_array_equal(line.get_ydata(), data.force_x.values[:, k])
        assert len(shown["$F_x$ (N)"].lines) == 3
        bars = [bar for ax in shown.values() for bar in ax.collections]
        assert bars and all(bar.get_segments() for bar in bars)
        assert [ax.get_title(loc="left") for ax in shown.values()] == [f"({c})" for c in "abcdef"[: len(shown)]]
        ratio = shown["slip area / contact area"].lines[2].get_ydata()
        np.testing.assert_allclose(ratio, (data.slip_area / data.contact_area).values[:, 2])
        assert shown["contact radius (mm)"].get_xlabel() == "modulus (MPa)"
        assert maps is not None and len(panels(maps)) == 6
        assert panels(maps)[0].get_title(loc="left").replace("\n", ", ") == grid.case(0, 0).label


@pytest.mark.usefixtures("undrawn")
def test_studies_of_several_grids_get_overviews_and_results(tmp_path: Path) -> None:
    with synthetic_tree(tmp_path, several()) as tree:
        names = [p.name for p in make_figures(tree, tmp_path, formats=("png",))]
        make_tables(tree, tmp_path)
        expected = [f"{grid}{kind}.png" for grid in ("product", "pressure_only", "listed") for kind in ("", "_maps")]
        assert names == expected
        rows = read(tmp_path / "results.csv")
        assert len(rows) == 4 + 3 + 2
        assert [r["grid"] for r in rows[4:]] == ["pressure_only"] * 3 + ["listed"] * 2
        forces = tree["product"].to_dataset().force_x.values.ravel()
        np.testing.assert_allclose([float(r["force_x_N"]) for r in rows[:4]], forces, rtol=1e-8)
        assert {r["creepage"] for r in rows[4:7]} == {"none (pressure only)"}
        assert not any(r["force_x_N"] for r in rows[4:7])
        assert rows[8]["layers"] == "E1 = 105000 MPa, 0.1 mm"


def test_overview_leaves_gaps_for_unsolved_cases(tmp_path: Path) -> None:
    made = small()
    for k in range(3):  # all of the first modulus
        case = made.results[k][0]
        made.results[k] = (case, made_up_result(case.scene, Status.NOT_CONVERGED))
    with synthetic_tree(tmp_path, made) as tree, style():
        figure = overview_figure(grids(tree)["tiny"])
    drawn = panels(figure)[0].lines[0].get_ydata()
    assert np.isnan(drawn[0]) and np.isfinite(drawn[1])
    left, right = panels(figure)[0].get_xlim()
    assert left < made.results[0][0].scene.layers[0].E < right  # at the end of the axis, too
    assert "3 of 6 cases not solved (gaps)" in " ".join(t.get_text() for t in figure.texts)


def test_figures_of_cases_none_of_which_is_solved_have_no_scales(tmp_path: Path) -> None:
    made = small()
    made.results[:] = [(case, made_up_result(case.scene, Status.NOT_CONVERGED)) for case, _ in made.results]
    with synthetic_tree(tmp_path, made) as tree, style():
        grid = grids(tree)["tiny"]
        overview, maps = overview_figure(grid), case_maps(grid)
    assert maps is not None
    for figure, remarked in ((overview, "none of these cases is solved"), (maps, "not solved: not converged")):
        words = [text.get_text() for text in figure.texts]
        assert not any("errors as bars" in text or "Magnitude" in text for text in words)
        assert len(figure.axes) == len(panels(figure))  # no colour bar
        for ax in panels(figure):
            assert remarked in remarks(ax)
            assert ax.get_xticks().size == ax.get_yticks().size == 0


# tables


def test_table_1_is_the_papers(tree: xr.DataTree, tables: Path) -> None:
    rows = [tuple(r.values()) for r in read(tables / "table_1.csv")]
    one, two = ("E1 = 0.5 Es", "E1 = 2 Es"), ("E1 = 0.5 E2 = 0.25 Es", "E1 = 2 E2 = 4 Es")
    assert rows == [
        ("7a-7f", one[0], "0.5 a"),
        ("7g-7l", one[1], "0.5 a"),
        ("8a-8f", one[0], "1 a"),
        ("8g-8l", one[1], "1 a"),
        ("9a-9f", two[0], "0.25 a"),
        ("9g-9l", two[1], "0.25 a"),
        ("10a-10f", two[0], "0.5 a"),
        ("10g-10l", two[1], "0.5 a"),
    ]
    typeset = (tables / "table_1.tex").read_text(encoding="utf-8")
    assert r"9a-9f & $E_1 = 0.5\,E_2 = 0.25\,E_s$ & $0.25\,a$ \\" in typeset
    creepages = [tuple(r.values()) for r in read(tables / "table_2.csv")]
    assert [r[0] for r in creepages] == ["(a/g)", "(b/h)", "(c/i)", "(d/j)", "(e/k)", "(f/l)"]
    stored = tree["figure_8"].to_dataset()
    for row, name in ((1, "longitudinal"), (2, "lateral"), (3, "spin")):
        assert [float(r[row]) for r in creepages] == pytest.approx(stored[name].values.reshape(-1)[:6])


def test_letters_of_other_creepages_in_other_figures_name_these() -> None:
    known = ((7, "a", 0.002), (8, "a", 0.001), (7, "b", 0.003), (8, "b", 0.003))
    cases: Any = [SimpleNamespace(figure=k, panel=panel, creepage=(xi, 0.0, 0.0)) for k, panel, xi in known]
    assert [row["panels"] for row in creepage_table(cases)[2]] == ["(a of 7)", "(a of 8)", "(b)"]


def test_results_are_those_of_the_fields(tree: xr.DataTree, tables: Path) -> None:
    rows = read(tables / "results.csv")
    assert len(rows) == 1 + 12 + 4 + 30 + 30 + 4 * 12
    (row,) = [r for r in rows if (r["figure"], r["panel"]) == ("10", "l")]
    data = tree["figure_10"].to_dataset().isel(modulus=1, creepage=5)
    cell = 2.0 / CELLS[0] * 2.0 / CELLS[1]
    p, qx, qy, state = (data[n].values for n in ("pressure", "traction_x", "traction_y", "state"))
    expected = {
        "contact_radius_mm": np.sqrt((p > 0).sum() * cell / np.pi),
        "pressure_max_MPa": p.max(),
        "pressure_ratio": p.max() / float(data.hertz_pressure),
        "slip_ratio": (state == 2).sum() / (p > 0).sum(),
        "force_x_N": qx.sum() * cell,
        "force_y_N": qy.sum() * cell,
        "moment_z_N_mm": ((data.x.values[:, None] * qy) - (data.y.values[None] * qx)).sum() * cell,
        "traction_max_MPa": np.hypot(qx, qy).max(),
        "proof_worst": 2e-6,
    }
    assert {k: float(row[k]) for k in expected} == pytest.approx(expected, rel=1e-8)
    of_ratio = 1e-6 * p.max() / float(data.hertz_pressure)
    assert float(row["pressure_ratio_error"]) == pytest.approx(of_ratio, rel=0.05)  # two digits
    assert (row["proof_name"], row["layers"]) == ("proof_gap", "E1 = 2 E2 = 4 Es, 0.5 a")
    assert row["creepage"] == "xi_x = 0.002, xi_y = 0.001, phi = 0.01 rad/mm"
    given = ["longitudinal", "lateral", "spin_rad_per_mm", "layer_count", "thickness_mm", "modulus_MPa"]
    assert [row[k] for k in given] == ["0.002", "0.001", "0.01", "2", "0.126644925478", "420000"]
    assert list(row)[2:11] == ["layers", "creepage", *given, "status"]


LISTED = """\
study: s
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: [50, 80]
  load: 100
  mesh: {size: [2, 2], cells: [16, 16]}
grids:
  product:
    scene: {counterbody: {nu: 0.2}}
    axes: {counterbody.E: [0.5 Es, 70000], mesh.cells: [[16, 16], [18, 20]]}
  bodies: {axes: {counterbody: [rigid, {label: steel, E: 1 Es, nu: 0.28}]}}
  listed:
    scene: {friction: 0.3}
    cases:
      - {label: plain}
      - {label: 7, load: 12345.678, counterbody: {E: 2 Es, nu: 0.25}, mesh: {size: [12 a, 14], cells: [18, 16]}}
      - {label: fit, radius: 40, mesh: {size: auto}, tolerance: {tangential: 1.0e-3}}
"""


def test_results_have_the_settings_in_which_listed_cases_differ(tmp_path: Path) -> None:
    """Of all grids, where the study or the cube says."""
    run(load_text(tmp_path, LISTED), tmp_path / "s.nc", workers=1, solve=made_up)
    with open_cube(tmp_path / "s.nc") as tree:
        make_tables(tree, tmp_path)
    rows = read(tmp_path / "results.csv")
    keys = list(rows[0])
    assert keys[2 : keys.index("layers")] == [
        "load_N",
        "friction",
        "radius_mm",
        "counterbody_E_MPa",
        "counterbody_nu",
        "window_mm",
        "cells",
        "tolerance_tangential",
    ]
    assert [list(row.values())[1 : keys.index("layers")] for row in rows] == [
        ["E=0.5 Es, cells=16 x 16", "100", "1", "50 x 80", "105000", "0.2", "2 x 2", "16 x 16", "1e-07"],
        ["E=0.5 Es, cells=18 x 20", "100", "1", "50 x 80", "105000", "0.2", "2 x 2", "18 x 20", "1e-07"],
        ["E=70000, cells=16 x 16", "100", "1", "50 x 80", "70000", "0.2", "2 x 2", "16 x 16", "1e-07"],
        ["E=70000, cells=18 x 20", "100", "1", "50 x 80", "70000", "0.2", "2 x 2", "18 x 20", "1e-07"],
        ["counterbody=rigid", "100", "1", "50 x 80", "rigid", "", "2 x 2", "16 x 16", "1e-07"],
        ["counterbody=steel", "100", "1", "50 x 80", "210000", "0.28", "2 x 2", "16 x 16", "1e-07"],
        ["plain", "100", "0.3", "50 x 80", "rigid", "", "2 x 2", "16 x 16", "1e-07"],
        ["7", "12345.678", "0.3", "50 x 80", "420000", "0.25", "12 a x 14", "18 x 16", "1e-07"],
        ["fit", "100", "0.3", "40", "rigid", "", "auto, margin 1.25", "16 x 16", "0.001"],
    ]
    markdown = (tmp_path / "results.md").read_text()
    assert "| Case | Load (N) | Friction | Radius (mm) | Counterbody E (MPa) |" in markdown
    assert "| 7 | 12345.678 |" in markdown


def test_three_forms_of_a_table_have_the_same_rows(tables: Path) -> None:
    paths = sorted(tables.iterdir())
    assert {p.suffix for p in paths} == {".csv", ".md", ".tex"}
    for path in (p for p in paths if p.suffix == ".csv"):
        rows = read(path)
        markdown = path.with_suffix(".md").read_text().splitlines()
        assert len(markdown) == len(rows) + 4
        # a table in parts: the columns that name the rows stand in each
        tex = path.with_suffix(".tex").read_text()
        parts = tex.split(r"\end{longtable}" if "longtable}" in tex else r"\bottomrule")[:-1]
        names = {"grid", "case", "figure", "panel"} & set(rows[0]) if len(parts) > 1 else set()
        columns = len(names)
        for part in parts:
            lines_ = [line for line in part.split(r"\midrule")[-1].splitlines() if line.endswith(r"\\")]
            assert len(lines_) == len(rows)
            (in_part,) = {line.count(" & ") + 1 for line in lines_}
            columns += in_part - len(names)
        errors = sum(key.endswith("_error") and key.removesuffix("_error") in rows[0] for key in rows[0])
        numbers = {"longitudinal", "lateral", "spin_rad_per_mm", "layer_count", "thickness_mm", "modulus_MPa"}
        # what the made-up results lack
        empty = {key for key in rows[0] if key != "reason" and not any(row[key] for row in rows)} - numbers
        assert len(empty) == (2 if path.stem == "solver" else 0)
        given = len(numbers & set(rows[0])) if path.stem == "results" else 0
        assert columns == len(rows[0]) - errors - given - len(empty)


def test_writer_escapes_and_rounds(tmp_path: Path) -> None:
    columns = (Column("a_b", "A_b|"), Column("n", "N", r"$N$", form=".2f"))
    write_table(tmp_path, "t", "50 % of x_y", columns, [{"a_b": "p|q & 5 % → _", "n": -1e-9}, {"n": float("nan")}])
    assert (tmp_path / "t.csv").read_text() == "a_b,n\np|q & 5 % → _,-1e-09\n,\n"
    markdown = (tmp_path / "t.md").read_text().splitlines()
    assert markdown[4:] == [r"| p\|q & 5 % → _ | 0.00 |", "|  |  |"]
    latex = (tmp_path / "t.tex").read_text()
    assert r"p$|$q \& 5 \% $\to$ \_ & 0.00 \\" in latex and r"\caption{50 \% of x\_y}" in latex
    assert r"A\_b$|$ & $N$ \\" in latex
    assert escape("~^\\{}#$<") == r"\textasciitilde{}\textasciicircum{}\textbackslash{}\{\}\#\$$<$"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("|pipe| <b>html</b> `x`", r"\|pipe\| \<b>html\</b> \`x\`"),
        ("*star* ~til~ __init__ - [a](b) &amp;", r"\*star\* \~til\~ \_\_init\_\_ - \[a](b) \&amp;"),
        (r"a$b_c^2$ %&#{}\x \*", r"a\$b_c^2\$ %&#{}\x \\\*"),
        ("2 * 3 < 7, xi_x = 0.1 [mm], a ~ b", "2 * 3 < 7, xi_x = 0.1 [mm], a ~ b"),
        ("\\|", r"\\\|"),
    ],
)
def test_markdown_shows_labels_as_they_are(tmp_path: Path, text: str, expected: str) -> None:
    write_table(tmp_path, "t", "c", [Column("a", "A")], [{"a": text}])
    assert (tmp_path / "t.md").read_text().splitlines()[4] == f"| {expected} |"


def test_tables_in_latex_are_no_wider_than_the_page(tmp_path: Path) -> None:
    """Sentences share the width with the space between columns; tables of many columns are set across the page."""
    row = {f"c{k}": float(k) for k in range(12)}
    columns = [Column(f"c{k}", f"C{k}", wide=0.2 if k < 2 else 0.0) for k in range(12)]
    write_table(tmp_path, "few", "few", columns[:4], [row])
    write_table(tmp_path, "many", "many", columns, [row])
    few, many = ((tmp_path / f"{name}.tex").read_text() for name in ("few", "many"))
    wide = r">{\raggedright\arraybackslash}p{\dimexpr0.2\linewidth-2\tabcolsep\relax}"
    assert rf"\begin{{longtable}}{{{wide}{wide}ll}}" in few and "landscape" not in few
    assert many.index(r"\begin{landscape}") < many.index(r"\begin{longtable}") < many.index(r"\rotatebox{90}{C11} \\")
    assert many.index(r"\end{longtable}") < many.index(r"\end{landscape}") and "pdflscape" in many.splitlines()[0]


def test_tables_in_latex_are_set_in_parts_that_fit_the_page(tmp_path: Path) -> None:
    """Parts are no wider than the page; long texts wrap; columns that name the rows stand in all."""
    columns = [Column("name", "Name", names=True), *(Column(f"c{k}", f"C{k}", error=f"c{k}_error") for k in range(16))]
    numbers = {f"c{k}": -1234.5 for k in range(16)} | {f"c{k}_error": 0.0123 for k in range(16)}
    words = "for ever, and some words that go on and on, and on"
    write_table(tmp_path, "wide_one", "c", columns, [numbers | {"name": words}] * 2)
    latex = (tmp_path / "wide_one.tex").read_text()
    assert [f"(Part {k} of 3.)" in latex for k in (1, 2, 3)] == [True] * 3
    assert all(rf"\label{{tab:wide-one{end}}}" in latex for end in ("", "-2", "-3"))
    specs = [line.split("longtable}")[1] for line in latex.splitlines() if line.startswith(r"\begin{longtable}")]
    wraps = r">{\raggedright\arraybackslash}p{108pt}"  # as much as the numbers leave; in the last part all it needs
    assert specs == [f"{{{wraps}lllllll}}", f"{{{wraps}lllllll}}", "{lll}"]
    # a number with its error is 16 letters wide here, the sign counting as two
    assert 112.0 + 68.0 * specs[0].count("l", len(wraps)) < 598.0
    assert latex.count(r"some words that go on and on, and on & $-1234.500 \pm 0.012$") == 6


def test_rounding_is_not_written_as_a_number(tmp_path: Path) -> None:
    """It differs between processors. A number within its error is a number; of proofs two digits are the same."""
    columns = [Column("n", "N", error="n_error"), Column("p", "P", digits=2)]
    rows = [
        {"n": -4.5890012e-15, "n_error": 0.001, "p": 1.49387187e-07},
        {"n": 2.3456789e-8, "n_error": 0.001, "p": math.nan},
        {"n": -4.5890012e-15, "n_error": math.inf, "p": 0.0},
        {"n": -4.5890012e-15},
    ]
    write_table(tmp_path, "t", "c", columns, rows)
    assert (tmp_path / "t.csv").read_text().splitlines()[1:] == [
        "0,0.001,1.5e-07",
        "2.3456789e-08,0.001,",
        "-4.5890012e-15,inf,0",
        "-4.5890012e-15,,",
    ]


def test_numbers_with_their_errors(tmp_path: Path) -> None:
    """As many decimals as two digits of the error have, with a power of ten if those are many; else its own form."""
    column = Column("n", "N", form=".2f", error="n_error")
    rows = [
        {"n": 53.1866577, "n_error": 0.1279},
        {"n": -1234.56, "n_error": 234.5},
        {"n": 0.00136910686, "n_error": 1.0587e-06},
        {"n": -1e-17, "n_error": 0.067},
        {"n": -1e-12, "n_error": 3e-11},
        {"n": 2.19404e-06, "n_error": 6.04e-10},
        {"n": 0.000172495, "n_error": 4.5e-08},
        {"n": -1e-17, "n_error": 9.96e-11},
        {"n": 12.3456789012, "n_error": 4.5e-08},
        {"n": 3e-310, "n_error": 2e-312},
        {"n": 2.0, "n_error": 0.0},
        {"n": 2.0},
        {"n": math.nan, "n_error": math.nan},
    ]
    write_table(tmp_path, "t", "c", [column], rows)
    assert (tmp_path / "t.csv").read_text().splitlines()[:3] == ["n,n_error", "53.1866577,0.128", "-1234.56,234"]
    cells = [line.strip("| ") for line in (tmp_path / "t.md").read_text().splitlines()[4:]]
    assert cells[:3] == ["53.19 ± 0.13", "-1235 ± 234", "0.0013691 ± 0.0000011"]
    assert cells[3:5] == ["0.000 ± 0.067", "(-0.1 ± 3.0)e-11"]
    assert cells[5:8] == ["(2.19404 ± 0.00060)e-06", "(1.72495 ± 0.00045)e-04", "(0.0 ± 10.0)e-11"]
    assert cells[8:] == ["12.345678901 ± 0.000000045", "(3.000 ± 0.020)e-310", "2.00", "2.00", ""]
    latex = (tmp_path / "t.tex").read_text()
    assert r"$53.19 \pm 0.13$ \\" in latex and r"$-1235 \pm 234$ \\" in latex
    assert r"$(2.19404 \pm 0.00060)\times10^{-6}$ \\" in latex


def test_letters_go_on_after_z() -> None:
    assert [letters(i) for i in (0, 11, 25, 26, 53, 702)] == ["a", "l", "z", "aa", "bb", "aaa"]


# statements


def statement(rows: list[dict[str, str]], words: str) -> dict[str, str]:
    (row,) = [r for r in rows if words in r["statement"]]
    return row


def test_statements_count_what_the_cube_says(tree: xr.DataTree, tables: Path) -> None:
    rows = read(tables / "statements.csv")
    assert [int(r["number"]) for r in rows] == list(range(1, len(rows) + 1))
    radius = tree["figure_3"].to_dataset().contact_radius.values
    growing = np.diff(radius[:, :, 0], axis=1)
    row = statement(rows, "the thicker the layer thickness, the larger the contact radius")
    assert growing.size == 4 and (growing > 0).all()
    assert row["verdict"] == "borne out (4 of 4)"
    assert row["numbers"] == f"changes from {growing.min():+.3g} to {growing.max():+.3g}"

    held = []
    for name in ("figure_5", "figure_6"):  # thickness, modulus, creepage
        data = tree[name].to_dataset()
        for measure in (np.hypot(data.force_x, data.force_y), data.slip_area / data.contact_area):
            held += [(measure.values.min(axis=2) < 0.9 * measure.values.max(axis=2)).ravel()]
    row = statement(rows, "the longitudinal creepage is a significant factor")
    assert 0 < np.sum(held) <= np.size(held) == 24
    assert row["verdict"] == f"borne out ({np.sum(held)} of 24)"

    change, margin = [], []
    for number in range(5, 11):
        data = tree[f"figure_{number}"].to_dataset().transpose("modulus", ...)
        ratio = (data.slip_area / data.contact_area).values
        cells = (data.contact_area.values / (2.0 / CELLS[0] * 2.0 / CELLS[1])).round()
        change += np.diff(ratio, axis=0).ravel().tolist()
        margin += np.where((ratio == 1).all(axis=0), np.inf, (2 / cells).sum(axis=0)).ravel().tolist()
    decided = np.abs(change) > np.multiply(margin, 1 + 1e-9)
    growing, n = int((np.array(change)[decided] > 0).sum()), int(decided.sum())
    assert 0 < growing == n < len(change) == 54
    row = statement(rows, "the slip zones are more predominated for hard coating layers")
    assert row["verdict"] == f"borne out ({n} of {n}); {54 - n} undecided"


@pytest.mark.parametrize(("error", "verdict_of_all"), [(1e-9, "decided"), (1.0, "undecided"), (np.nan, "undecided")])
def test_aligned_cells_decide_by_their_estimated_errors(tmp_path: Path, error: float, verdict_of_all: str) -> None:
    made = paper(CELLS)
    for k, (_, result) in enumerate(made.results):  # areas that are not whole numbers of cells
        for name, factor in (("contact_area", 0.98765), ("slip_area", 0.98 + 1e-5 * k)):  # and no two ratios the same
            if name in result.scalars:
                result.scalars |= {name: result.scalars[name] * factor, f"{name}_error": error}
    with synthetic_tree(tmp_path, made) as tree:
        make_tables(tree, tmp_path)
    words = "the ratio of slip zones is decreasing with increasing layer thickness for the stiff"
    row = statement(read(tmp_path / "statements.csv"), words)
    compared = [r["holds"] for r in read(tmp_path / "statements_comparisons.csv") if r["number"] == row["number"]]
    assert len(compared) == 10
    compared = [holds for holds in compared if holds != "undecided: both slip everywhere"]
    reasons = {"decided": {"yes", "no"}, "undecided": {"undecided"}}[verdict_of_all]
    assert {holds.split(":")[0] for holds in compared} <= reasons
    reason = "no estimate of their errors" if np.isnan(error) else "differ by less than the estimated error in each"
    assert (reason in " ".join(compared)) is (verdict_of_all == "undecided")


def test_verdicts_without_fields_are_by_estimated_errors_and_say_so(tree: xr.DataTree, tmp_path: Path) -> None:
    """Areas counted in cells were said to be compared within two cells, which a cube without fields does not give."""
    made = papers()
    made.study.outputs.fields = False
    with synthetic_tree(tmp_path, made) as bare:
        found = [paper_cases(grids(opened)) for opened in (tree, bare)]
        told = [statements_table(judged(STATEMENTS, cases), cases)[0] for cases in found]
    assert ["2 cells" in caption for caption in told] == [True, False]
    assert ["stored without the fields" in caption for caption in told] == [False, True]


def test_comparisons_in_latex_name_their_cases_in_mathematics(tables: Path) -> None:
    """As the table of results does; spin keeps its unit, which no title gives here."""
    source = (tables / "statements_comparisons.tex").read_text(encoding="utf-8")
    layer = r"$E_1 = 0.5\,E_s$, $0.5\,a$, $\xi_x = 0.002$, $\xi_y = 0.001$"
    assert rf" & 7c: {layer} $\to$ 7f: {layer}, $\varphi = 0.01$ rad/mm & " in source and r"xi\_x" not in source
    assert any("xi_y = 0.001, phi = 0.01 rad/mm" in r["cases"] for r in read(tables / "statements_comparisons.csv"))


def test_statements_that_need_other_data_are_not_judged(tables: Path) -> None:
    rows = read(tables / "statements.csv")
    assert statement(rows, "LCP method")["verdict"] == "not tested: needs the results of the LCP method"


def test_verdicts_in_words() -> None:
    yes, no = Comparison("a", 1.0, 2.0, True), Comparison("b", 2.0, 1.0, False)
    unknown = Comparison("c", 1.0, 1.0, None, "both slip everywhere")
    assert verdict([]) == "no such cases in the cube"
    assert verdict([yes, yes]) == "borne out (2 of 2)"
    assert verdict([no]) == "not borne out (0 of 1)"
    assert verdict([yes, no, unknown]) == "borne out in 1 of 2 cases; 1 undecided"
    assert verdict([unknown]) == "undecided (1 of 1)"
    assert numbers([yes, no, unknown]) == "1 → 2; 2 → 1"


def test_numbers_compared_by_a_factor_are_ratios() -> None:
    assert (
        numbers([Comparison("a", 4.0, 2.0, True, by=0.9), Comparison("b", 4.0, 3.5, True, by=0.9)])
        == "ratio 0.5 to 0.875"
    )


@pytest.fixture(scope="module")
def edited(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., dict[str, str]]:
    """Verdicts by statement on the paper's maps with these moduli and creepages, in this order."""

    def verdicts(moduli: tuple[float, ...], letters_: str) -> dict[str, str]:
        sets = {letter: TABLE_2[letter] for letter in letters_}
        parts = []
        for name, count, ratio in (("figure_7", 1, 0.5), ("figure_8", 1, 1.0), ("figure_9", 2, 0.25)):
            grid = make_grid(name, modulus_axis(moduli), creepage_axis(sets))
            cases = grid_cases(grid, SCENE, layer_count=count, thickness=ratio * RADIUS)
            cases = [replace(c, scene=replace(c.scene, creepage=list(sets.values())[c.index[1]])) for c in cases]
            parts.append((grid, cases))
        with synthetic_tree(tmp_path_factory.mktemp("edited"), assemble(make_study(), *parts)) as tree:
            cases_ = paper_cases(grids(tree))
            return {f"{s.where}{s.quote}": verdict(list(s.judge(cases_))) for s in STATEMENTS}

    return verdicts


def test_verdicts_do_not_depend_on_the_order_of_the_study(edited: Callable[..., dict[str, str]]) -> None:
    plain = edited((0.5, 2.0), "abcdef")
    assert edited((2.0, 0.5), "cbfdae") == plain
    lacking = edited((0.5, 2.0), "cdef")
    assert lacking[next(s for s in lacking if "For larger lateral creepage" in s)] == "no such cases in the cube"


def test_layers_as_stiff_as_the_substrate_are_neither_compliant_nor_stiff(
    edited: Callable[..., dict[str, str]],
) -> None:
    assert edited((0.5, 1.0, 2.0), "abcdef") == edited((0.5, 2.0), "abcdef")


# measures, on a contact drawn by hand


def by_hand(rows: list[str], qx: np.ndarray | None = None, qy: np.ndarray | None = None) -> Any:
    """A case from a picture: s slip, o stick, . exterior; the top row is at the largest y, x runs to the right."""
    codes = {".": CellState.EXTERIOR, "o": CellState.STICK, "s": CellState.SLIP}
    state = np.array([[codes[c] for c in row] for row in rows[::-1]]).T
    n, m = state.shape
    fields = {"traction_x": qx, "traction_y": qy}
    return SimpleNamespace(
        mapped=True,
        x=np.arange(n) - (n - 1) / 2,
        y=np.arange(m) - (m - 1) / 2,
        state=state,
        field=fields.__getitem__,
        number={"contact_radius": 2.0}.__getitem__,
    )


def test_slip_behind_stick_counts_rows_with_stick() -> None:
    case = by_hand(["ss..", "sso.", "soos", "sooo"])
    assert measures.slip_behind_stick(case) == pytest.approx(4 / 5)
    assert measures.slip_behind_stick(by_hand(["soso"])) == pytest.approx(1 / 2)  # behind all of them


@pytest.mark.parametrize(("slip_error", "expected"), [(0.02, 0.0), (0.05, 0.025), (math.nan, math.nan)])
def test_ratios_of_one_are_uncertain_by_what_may_stick_unseen(slip_error: float, expected: float) -> None:
    """Errors of both areas cancel only where they are the same."""
    numbers_ = {"slip_area": 2.0, "contact_area": 2.0, "slip_area_error": slip_error, "contact_area_error": 0.02}
    case: Any = SimpleNamespace(number=numbers_.__getitem__)
    assert measures.slip_ratio_error(case) == pytest.approx(expected, nan_ok=True)


def test_errors_of_mean_pressure_and_force_are_those_of_their_parts() -> None:
    errors = {"contact_area": 2.0, "contact_area_error": 0.1, "force_x_error": 3.0, "force_y_error": 4.0}
    case: Any = SimpleNamespace(number=errors.__getitem__, stored={"load": 100.0}.__getitem__)
    assert measures.mean_pressure_error(case) == pytest.approx(2.5)
    assert measures.tangential_force_error(case) == 5.0


def test_slip_centre_and_quarters() -> None:
    case = by_hand(["so..", "sooo", "oooo", "oooo"])
    assert measures.slip_centre(case) == pytest.approx((-0.75, 0.5))
    assert np.isnan([measures.slip_centre(by_hand([row, "...."])) for row in ("oooo", "ssss")]).all()
    assert measures.trailing_slip(case, upper=True) == pytest.approx(2 / 4)
    assert measures.trailing_slip(case, upper=False) == 0.0
    assert measures.trailing_slip(by_hand([".s..", "sooo", "oooo", "oooo"]), upper=True) == pytest.approx(2 / 3)


def test_asymmetry_is_what_has_no_mirror_image() -> None:
    """Of a mirror image about the x-axis q_x and |q| are even in y, and q_y is odd."""
    even = np.array([[1.0, 2.0, 2.0, 1.0]] * 3)
    odd = np.array([[-1.0, -3.0, 3.0, 1.0]] * 3)
    picture = ["ooo"] * 4
    assert measures.vector_asymmetry(by_hand(picture, even, odd)) == 0.0
    assert measures.vector_asymmetry(by_hand(picture, odd, even)) == pytest.approx(1.0)
    part = measures.vector_asymmetry(by_hand(picture, even, 2 * even))
    assert part == pytest.approx(2 / np.hypot(1, 2))
    assert (
        measures.asymmetry(by_hand(picture, even, 2 * even)) == measures.asymmetry(by_hand(picture, even, odd)) == 0.0
    )
    one_sided = np.array([[0.0, 0.0, 2.0, 1.0]] * 3)
    assert measures.asymmetry(by_hand(picture, one_sided, 0 * odd)) == pytest.approx(np.sqrt(0.5))


@pytest.mark.parametrize(
    ("value", "form", "text"),
    [(0.0, ".0e", "0"), (-0.0, ".1e", "0"), (-1e-9, ".2f", "0.00"), (-0.0, ".3g", "0"), (-2e-7, ".0e", "-2e-07")],
)
def test_zero_has_neither_sign_nor_power(value: float, form: str, text: str) -> None:
    """A proof of zero was 0e+00 in Markdown, and zero times ten to the power of zero in LaTeX."""
    assert text_of(value, form) == text


def test_asymmetry_of_slip_is_the_share_of_cells_without_a_mirror_image() -> None:
    assert measures.slip_asymmetry(by_hand(["ss.", "soo", "ooo", "so."])) == pytest.approx(2 / 4)
    assert np.isnan(measures.slip_asymmetry(by_hand(["ooo", "ooo"])))


def test_mirror_images_are_about_the_axis_whatever_part_of_the_window_is_stored() -> None:
    """With `crop: contact` stored rows do not lie evenly about y = 0 where full coupling shifts the contact along y."""
    rows = ["...", "...", "oo.", "ooo", "sso", "ss."]
    whole = by_hand(rows, *np.random.default_rng(0).normal(size=(2, 3, 6)) * (np.array(list("001111")) == "1")[::-1])
    part = by_hand(rows[2:], *(whole.field(name)[:, :4] for name in ("traction_x", "traction_y")))
    part.y = whole.y[:4]
    for measure in (measures.asymmetry, measures.vector_asymmetry, measures.slip_asymmetry):
        assert measure(part) == pytest.approx(measure(whole))
    assert measures.slip_asymmetry(part) == 1.0


def test_slip_on_the_axis_is_counted_in_the_rows_next_to_it() -> None:
    case = by_hand(["ssss", "ssoo", "sooo", "ssss"])
    assert (measures.slip_on_axis(case), measures.cell_on_axis(case)) == (3 / 8, 2 / 8)
    case = by_hand(["ssss", "soo.", "ssss"])
    assert (measures.slip_on_axis(case), measures.cell_on_axis(case)) == pytest.approx((1 / 3, 1 / 3))
    case.mapped = False  # not solved, of pressure only, or stored without fields
    assert np.isnan([measures.slip_on_axis(case), measures.cell_on_axis(case)]).all()


def test_views_of_a_grid_with_varying_mesh_keep_to_the_case() -> None:
    """Cells beyond a case's own mesh are padding and are not handed out."""
    nan = np.nan
    data = xr.Dataset(
        {
            "status": ("cells", [0, 0]),
            "pressure": (("cells", "x", "y"), np.arange(18.0).reshape(2, 3, 3)),
            "label": ("cells", ["a", "b"]),
        },
        {
            "x_centre": (("cells", "x"), [[-0.5, 0.5, nan], [-1.0, 0.0, 1.0]]),
            "y_centre": (("cells", "y"), [[-0.5, 0.5, nan], [-1.0, 0.0, 1.0]]),
        },
        {"axes": "cells"},
    )
    case: CaseView = GridView("g", data).case(0)
    np.testing.assert_array_equal(case.field("pressure"), [[0, 1], [3, 4]])
    assert case.spacing == (1.0, 1.0)
    assert GridView("g", data).case(1).field("pressure").shape == (3, 3)


def test_a_table_without_any_number_keeps_its_columns() -> None:
    columns = (Column("case", "Case"), Column("force_x", "Fx"), Column("approach", "Approach"))
    rows: list[dict[str, Any]] = [{"case": "a", "force_x": math.nan, "approach": math.nan}]
    table = "caption", columns, rows
    assert without_empty(table) is table
    rows.append({"case": "b", "force_x": math.nan, "approach": 0.1})
    assert [column.csv_only for column in without_empty(table)[1]] == [False, True, False]
