"""Words on figures: labels of a study letter for letter and within the page, values as the study wrote them."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.text import Text
from studies import BASE, load_text
from synthetic import (
    CREEPAGES,
    RADIUS,
    SCENE,
    assemble,
    case_axis,
    creepage_axis,
    grid_cases,
    made_up_result,
    make_grid,
    make_study,
    modulus_axis,
    number_axis,
    several,
    synthetic_tree,
    thickness_axis,
)
from workers import made_up

from rcstudy.cases import Axis, Case, Coord, Grid
from rcstudy.cube import open_cube
from rcstudy.mechanics.scene import Creepage, Layer
from rcstudy.report import layout
from rcstudy.report.labels import KEEP, literal, shortened, wrapped
from rcstudy.report.layers import _numbered, abridged, layers_text, thickness_text
from rcstudy.report.layout import conditions
from rcstudy.report.overview import _counts, _scale_values, case_maps, geometric, overview_figure
from rcstudy.report.quantities import CHOICES, QUANTITIES, has_bars, numbers, vanishes
from rcstudy.report.style import LINES, style
from rcstudy.report.views import GridView, grids
from rcstudy.result import Status
from rcstudy.settings import unit_as_written
from rcstudy.sweep import run
from rcstudy.tables import case_table

HELD = """\
study: s
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  load: 20
  mesh: {size: [2, 2], cells: [32, 32]}
grids:
  films:
    axes:
      layers: [{label: bare, layers: []}, {label: film, layers: [{E: 5000, nu: 0.4, thickness: 0.05}]}]
      load: [10, 40]
      creepage: [{label: tangent, longitudinal: 0.001}, {label: curve, spin: 0.002}]
      friction: [0.3, 0.4, 0.5]
"""


def test_captions_tell_of_the_cases_shown_alone(tmp_path: Path) -> None:
    """Of a label held fixed, not of the others; and what is the same at the one load that is shown."""
    run(load_text(tmp_path, HELD), tmp_path / "s.nc", workers=1, solve=made_up)
    with open_cube(tmp_path / "s.nc") as tree, style():
        caption = caption_of(overview_figure(grids(tree)["films"]))
    assert r"Shown for load = 10 N, creepage = tangent. Creepage: $\xi_x = 0.001$. Layers: bare: no" in caption
    assert "curve" not in caption and "$P$ = 10 N, Hertz's $a$ = 0.1176 mm, $p_0$ = 345.4 MPa, cells of" in caption


DOLLARS = (r"cost $5\frac$", "two $1 and $2 coats", "a|b_$x$")


def labelled(monkeypatch: pytest.MonkeyPatch, labels: tuple[str, ...]) -> Axis:
    """An axis of creepages with these labels."""
    named = {label: list(CREEPAGES.values())[i % 6] for i, label in enumerate(labels)}
    monkeypatch.setattr("synthetic.CREEPAGES", named)
    return creepage_axis(named)


@contextmanager
def opened(folder: Path, grid: Grid, **fixed: Any) -> Iterator[GridView]:
    with synthetic_tree(folder, assemble(make_study(), (grid, grid_cases(grid, SCENE, **fixed)))) as tree:
        yield grids(tree)[grid.name]


def texts(figure: Figure) -> str:
    """All texts of a figure, drawn before so that what cannot be drawn fails."""
    figure.set_layout_engine(None)  # placed nowhere in particular
    figure.draw_without_rendering()
    return "\n".join(text.get_text() for text in figure.findobj(Text))


@pytest.mark.parametrize(("values", "every"), [(30, 1), (31, 2), (101, 4)])
def test_markers_and_bars_of_long_curves_do_not_hide_one_another(tmp_path: Path, values: int, every: int) -> None:
    """Of a hundred values panels were black; a case between gaps has a marker nevertheless, as no line shows it."""
    grid = make_grid("g", number_axis("load", np.linspace(50.0, 100.0, values).tolist(), "N"))
    made = assemble(make_study(), (grid, grid_cases(grid, SCENE)))
    for k in (4, 6):
        case = made.results[k][0]
        made.results[k] = (case, made_up_result(case.scene, Status.NOT_CONVERGED))
    with synthetic_tree(tmp_path, made) as tree, style():
        figure = overview_figure(grids(tree)["g"])
        words = texts(figure)
        line = figure.axes[1].lines[0]
        (bars,) = [c for c in figure.axes[1].collections if isinstance(c, LineCollection)]
    marked = line.get_markevery()
    assert set(marked) == {*range(0, values, every), 5} and len(line.get_xdata()) == values
    assert len(bars.get_segments()) == len(marked)
    assert ("One point in" in words) is (every > 1)
    assert every == 1 or f"One point in {every} has a marker. Estimated discretisation errors as bars at" in words


@pytest.mark.parametrize("first", [True, False])
def test_dollars_of_labels_are_letters_everywhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, first: bool
) -> None:
    axes = (labelled(monkeypatch, DOLLARS), number_axis("load", [50.0, 100.0], "N"))
    with opened(tmp_path, make_grid("g", *(axes if first else axes[::-1]))) as grid, style():
        for figure in (overview_figure(grid), case_maps(grid)):
            assert figure is not None
            drawn = texts(figure)
            assert all(label.replace("$", r"\$") in drawn for label in DOLLARS)


def test_dollars_of_a_label_in_a_caption_leave_its_mathematics(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    words = Axis("method", 2, {"method": Coord(["newton", "paper-cg"], "1", "")}, ("newton", "paper-cg"))
    axes = (number_axis("load", [50.0, 100.0], "N"), words)
    with opened(tmp_path, make_grid("g", *axes, labelled(monkeypatch, DOLLARS[1:]))) as grid, style():
        figure = overview_figure(grid)
        texts(figure)
    (caption,) = [t.get_text() for t in figure.texts if t.get_gid() == "caption"]
    assert r"creepage = two \$1 and \$2 coats" in caption.replace("\n", " ") and r"$\mu$ = 1" in caption


def test_lines_break_neither_inside_mathematics_nor_at_kept_spaces() -> None:
    text = rf"{literal('cost $5')} and $a = b + c$ with 100{KEEP}N or more"
    assert wrapped(text, 14) == [r"cost \$5 and", "$a = b + c$ with", "100 N or more"]
    assert wrapped("abcdefgh", 5) == ["abcde", "fgh"]


def test_lines_are_as_long_as_what_is_drawn() -> None:
    formula = r"$E_1 = 10\,\mathrm{MPa}$"  # 11 letters
    assert wrapped(f"a: {formula}, b", 15) == [f"a: {formula},", "b"]
    assert wrapped(f"a: {formula}, b", 18) == [f"a: {formula}, b"]
    assert wrapped(r"$\nu$$\varphi$ $2\times10^{-7}$ x", 10) == [r"$\nu$$\varphi$ $2\times10^{-7}$", "x"]
    assert wrapped("of \ue000 and $a$", 40) == ["of ? and $a$"]
    # long words beside a formula were not broken: names of grids ran out of narrow figures
    assert wrapped(f"abcdefgh {formula} ij", 5) == ["abcde", "fgh", formula, "ij"]
    assert wrapped(f"{formula}bcdefgh ij kl", 5) == [f"{formula}bcdefgh", "ij kl"]


def test_forces_that_symmetry_makes_zero_have_no_panel(tmp_path: Path) -> None:
    grid = make_grid("g", number_axis("load", [50.0, 100.0], "N"), creepage_axis({"a": CREEPAGES["a"]}))
    made = assemble(make_study(), (grid, grid_cases(grid, SCENE)))
    for name in ("force_x", "force_y", "moment_z"):
        for least, shown in ((1e-5, False), (1e-3, True)):
            for case, result in made.results:
                result.scalars |= {"force_x": 40.0, "force_y": 40.0, "moment_z": 5.0, name: least * case.index[0]}
            folder = tmp_path / f"{name}{shown}"
            folder.mkdir()
            with synthetic_tree(folder, made) as tree, style():
                figure = overview_figure(grids(tree)["g"])
            symbol = QUANTITIES[name].split(" (")[0]
            assert (QUANTITIES[name] in [ax.get_ylabel() for ax in figure.axes if ax.get_visible()]) is shown
            assert (f"Zero in all cases shown: {symbol}." in texts(figure)) is not shown


@pytest.mark.parametrize(("radius", "zero"), [(0.1, False), (10.0, True)])
def test_moments_are_zero_against_friction_at_the_radius_of_the_contact(
    tmp_path: Path, radius: float, zero: bool
) -> None:
    """Cases that are not solved have no part in that, wherever they stand."""
    grid = make_grid("g", number_axis("load", [50.0, 100.0, 200.0], "N"), creepage_axis({"a": CREEPAGES["a"]}))
    cases = grid_cases(grid, SCENE)
    made = assemble(make_study(), (grid, cases), failing={cases[0].key: Status.ERROR})
    for case, result in made.results[1:]:
        moment = 1e-6 * SCENE.friction * case.scene.load
        result.scalars |= {"contact_radius": radius, "moment_z": -moment}
    with synthetic_tree(tmp_path, made) as tree:
        assert vanishes(list(grids(tree)["g"].cases()), "moment_z") is zero


def test_panels_show_the_quantities_that_are_chosen(tmp_path: Path) -> None:
    """Forces over the load with their bars, in the order of the list; where nothing is left the figure says so."""
    grid = make_grid("g", number_axis("load", [50.0, 100.0], "N"), creepage_axis({"a": CREEPAGES["a"]}))
    made = assemble(make_study(), (grid, grid_cases(grid, SCENE)))
    for case, result in made.results:
        load = case.scene.load
        result.scalars |= {"force_x": -0.2 * load, "force_x_error": 0.01 * load, "moment_z": 0.0}
    with synthetic_tree(tmp_path, made) as tree, style():
        view = grids(tree)["g"]
        chosen = "friction_power", "force_x/load", "moment_z"
        figure, empty = (overview_figure(view, "", names) for names in (chosen, ("moment_z",)))
    first, second = [ax for ax in figure.axes if ax.get_visible()]
    assert [ax.get_ylabel() for ax in (first, second)] == [CHOICES["friction_power"], CHOICES["force_x/load"]]
    np.testing.assert_allclose(second.lines[0].get_ydata(), -0.2, rtol=1e-12)
    (bars,) = second.collections
    np.testing.assert_allclose([piece[:, 1] for piece in bars.get_segments()], [[-0.21, -0.19]] * 2, rtol=1e-12)
    assert "Zero in all cases shown: $M_z$." in texts(figure)
    assert "no quantity to show" in texts(empty)


@pytest.mark.parametrize("name", sorted(CHOICES.keys() - QUANTITIES.keys()))
def test_every_quantity_has_numbers_and_bars(tmp_path: Path, name: str) -> None:
    grid = make_grid("g", number_axis("load", [50.0, 100.0], "N"), creepage_axis({"f": CREEPAGES["f"]}))
    made, stored = assemble(make_study(), (grid, grid_cases(grid, SCENE))), name.removesuffix("/load")
    for case, result in made.results:
        result.scalars |= {stored: 3.0 + case.index[0], f"{stored}_error": 0.5 + 0.1 * case.index[0]}
    with synthetic_tree(tmp_path, made) as tree:
        view = grids(tree)["g"]
        cases = list(view.cases())
        values, bars = numbers(cases, name)
        assert has_bars(view, name) and not vanishes(cases, name)
        unit = [50.0, 100.0] if stored != name else [1.0, 1.0]
        assert values.tolist() == [case.number(stored) / u for case, u in zip(cases, unit, strict=True)]
        assert bars.tolist() == [[case.number(f"{stored}_error") / u for case, u in zip(cases, unit, strict=True)]] * 2


def test_forces_that_are_zero_in_what_is_shown_have_no_panel(tmp_path: Path) -> None:
    """Though they are not at the other values of an axis that the figure holds at its first one."""
    axes = (number_axis("load", [50.0, 100.0], "N"), number_axis("friction", [0.5, 1.0]), creepage_axis())
    made = assemble(make_study(), (grid := make_grid("g", *axes), grid_cases(grid, SCENE)))
    for case, result in made.results:
        result.scalars |= {"force_x": 40.0, "force_y": 40.0 * case.index[1], "moment_z": 5.0}
    with synthetic_tree(tmp_path, made) as tree, style():
        view = grids(tree)["g"]
        figures = [overview_figure(view), overview_figure(view, "friction")]
    labels = [[ax.get_ylabel() for ax in figure.axes if ax.get_visible()] for figure in figures]
    assert [QUANTITIES["force_y"] in shown for shown in labels] == [False, True]
    assert ["Zero in all cases shown: $F_y$. Shown for friction = 0.5." in texts(figure) for figure in figures] == [
        True,
        False,
    ]


def test_lines_of_equal_values_are_all_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Markers are open and of different sizes; over labels, where they are not joined, they are beside each other."""
    loads = number_axis("load", [50.0, 100.0, 200.0], "N")
    words = Axis("method", 2, {"method": Coord(["newton", "paper-cg"], "1", "")}, ("newton", "paper-cg"))
    numbers, labels = make_grid("numbers", loads, creepage_axis()), make_grid("labels", creepage_axis(), words)
    made = assemble(make_study(), *((grid, grid_cases(grid, SCENE)) for grid in (numbers, labels)))
    with synthetic_tree(tmp_path, made) as tree, style():
        views = grids(tree)
        on_numbers, on_labels = (overview_figure(views[name]).axes[0].lines for name in ("numbers", "labels"))
    for lines in (on_numbers, [line for line in on_labels if line.get_marker() != "None"]):
        drawn = [line for line in lines if len(line.get_xdata()) > 1]
        assert len(drawn) > 1 and {line.get_markerfacecolor() for line in drawn} == {"none"}
        sizes = [line.get_markersize() for line in drawn]
        assert all(one - other > 0.5 for one, other in pairwise(sizes))
    assert all((line.get_xdata() == [50.0, 100.0, 200.0]).all() for line in on_numbers)
    one, other = (np.asarray(line.get_xdata()) for line in on_labels)
    np.testing.assert_allclose(other - one, 0.09)
    np.testing.assert_allclose(one + other, 2.0 * np.arange(6), atol=1e-12)


@pytest.mark.parametrize(
    ("creepages", "along", "expected"),
    [
        ((0.001, 0.002, 0.003), "", "longitudinal creepage"),
        ((0.001, 0.002), "", "load (N)"),  # no curve
        ((0.001, 0.002), "longitudinal", "longitudinal creepage"),
        ((0.001, 0.002, 0.003), "load", "load (N)"),
        ((0.001, 0.002, 0.003), "spin", "longitudinal creepage"),  # an axis of another grid
    ],
)
def test_curves_are_along_a_creepage_or_what_is_asked_for(
    tmp_path: Path, creepages: tuple[float, ...], along: str, expected: str
) -> None:
    axes = (number_axis("load", [50.0, 60.0, 70.0, 80.0], "N"), number_axis("longitudinal", list(creepages)))
    with opened(tmp_path, make_grid("g", *axes)) as grid, style():
        assert overview_figure(grid, along).axes[0].get_xlabel() == expected


def test_maps_show_cases_of_all_values_of_the_first_axes(tmp_path: Path) -> None:
    """The first twelve of layers and many creepages had one layer only."""
    loads, frictions = number_axis("load", [50.0, 100.0], "N"), number_axis("friction", list(np.arange(1.0, 17.0)))
    with opened(tmp_path, make_grid("g", loads, frictions)) as grid, style():
        figure = case_maps(grid)
        assert figure is not None
        titles = [ax.get_title(loc="left") for ax in figure.axes if ax.get_title(loc="left")]
        assert titles == [f"load={load} N, friction={mu}" for load in (50, 100) for mu in (1, 4, 7, 10, 13, 16)]
        assert "12 of 32 cases, evenly chosen: 2 of 2 values of load, 6 of 16 values of friction. " in caption_of(
            figure
        )
        every = case_maps(grid.held_at("friction", "4"))  # type: ignore[arg-type]
        assert "evenly" not in caption_of(every)


@pytest.mark.parametrize(
    ("shape", "counts"),
    [
        ((2, 16), [2, 6]),
        ((16, 2), [6, 2]),
        ((3, 3, 12), [3, 2, 2]),
        ((40,), [12]),
        ((3, 4), [3, 4]),
        ((1, 9, 1), [1, 9, 1]),
    ],
)
def test_maps_are_spread_over_all_axes(shape: tuple[int, ...], counts: list[int]) -> None:
    assert _counts(shape) == counts


def test_one_map_fills_its_page(tmp_path: Path) -> None:
    with opened(tmp_path, make_grid("g", case_axis(["one"]))) as grid, style():
        figure = case_maps(grid)
        assert figure is not None
        (panel, *_) = sizes(figure)
        assert panel[0] > 0.75 * figure.get_figwidth()


def sizes(figure: Figure) -> list[tuple[float, float]]:
    """Width and height of each panel once it is placed, inches; what leaves the page or warns fails."""
    engine = figure.get_layout_engine()
    assert engine is not None
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(2):
            engine.execute(figure)
        figure.set_layout_engine(None)  # as `save` does
        figure.draw_without_rendering()
    for legend in figure.legends:
        box = legend.get_window_extent()
        assert box.x0 >= 0.0 and box.x1 <= figure.bbox.width and box.y1 <= figure.bbox.height
    boxes = [ax.get_window_extent() for ax in figure.axes if ax.get_visible()]
    return [(box.width / figure.dpi, box.height / figure.dpi) for box in boxes]


LONG = tuple(f"{k} {'of a hundred letters ' * 5}"[:99] + str(k) for k in range(7))


def test_long_labels_and_many_stay_on_the_page_and_leave_panels_their_size(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    placed = []
    for used in (tuple("abcdefg"), LONG, tuple(f"{'W' * 30}{k}" for k in range(7))):
        axis = labelled(monkeypatch, used)
        along, lines = make_grid("along", axis), make_grid("lines", number_axis("load", [50.0, 100.0], "N"), axis)
        folder = tmp_path / str(len(placed))
        folder.mkdir()
        made = assemble(make_study(), *((grid, grid_cases(grid, SCENE)) for grid in (along, lines)))
        with synthetic_tree(folder, made) as tree, style():
            views = grids(tree)
            figures = (overview_figure(views["along"]), overview_figure(views["lines"]), case_maps(views["along"]))
            placed.append([sizes(figure) for figure in figures if figure is not None])
    for short, *long in zip(*placed, strict=True):
        for panels_of_long in long:
            np.testing.assert_allclose(panels_of_long, short, rtol=0.12)


def test_shortened_texts_stay_apart() -> None:
    assert shortened(["short", "abcdefghijklmno"], 9) == ["short", "abcd…lmno"]
    assert shortened(["abcde1vwxyz", "abcde2vwxyz"], 10) == ["1: ab…yz", "2: ab…yz"]


@pytest.mark.parametrize(
    ("form", "most", "shown"),
    [
        ("abcde {} vwxyz", 11, "abcde {}…"),
        ("specimen {} of batch A", 18, "specimen {}…"),
        ("specimen_of_batch A, {} of many", 12, "specim…A, {}…"),
        ("specimen of batch A{}BCDEFG", 12, "…A{}BCDEFG"),
    ],
)
def test_words_that_all_texts_share_are_left_out_where_others_tell_them_apart(form: str, most: int, shown: str) -> None:
    """They had numbers, which began with 1 where the labels' own began with 0."""
    values = ("0", "1", "2")
    assert shortened([form.format(value) for value in values], most) == [shown.format(value) for value in values]


def test_the_overview_is_along_the_numbers_with_most_values_and_its_lines_are_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = labelled(monkeypatch, ("one", "other"))
    axes = (words, number_axis("friction", [0.5, 1.0]), number_axis("load", [100.0, 50.0, 75.0], "N"))
    with opened(tmp_path, make_grid("g", *axes)) as grid, style():
        figure = overview_figure(grid)
        ax = next(ax for ax in figure.axes if ax.get_ylabel() == QUANTITIES["pressure_max"])
        assert ax.get_xlabel() == "load (N)"
        pressures = grid.small("pressure_max").values
    for k, line in enumerate(ax.lines):
        np.testing.assert_array_equal(line.get_xdata(), [50.0, 75.0, 100.0])
        np.testing.assert_array_equal(line.get_ydata(), pressures[k, 0, [1, 2, 0]])
    assert [t.get_text() for t in figure.legends[0].get_texts()] == ["creepage = one", "creepage = other"]
    assert "Shown for friction = 0.5." in texts(figure)


def test_values_stand_as_the_study_wrote_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    thickness = replace(thickness_axis((0.1, 0.05 / RADIUS, 0.002 / RADIUS)), labels=("0.1 a", "0.05", "0.002"))
    modulus = replace(modulus_axis((0.5, 2.0)), labels=("105000", "2 Es"))
    words = labelled(monkeypatch, ("one, thickness=3, modulus=4", "other"))
    with opened(tmp_path, make_grid("g", words, thickness, modulus)) as grid:
        assert grid.axis_values("thickness") == ["0.1 a", "0.05 mm", "0.002 mm"]
        assert grid.axis_values("modulus") == ["105000 MPa", "2 Es"]
        assert grid.axis_values("creepage") == ["one, thickness=3, modulus=4", "other"]
        shown = [(layers_text(case), thickness_text(case)) for case in grid.cases()][:6]
    assert shown == [
        ("E1 = 105000 MPa", "0.1 a"),
        ("E1 = 2 Es", "0.1 a"),
        ("E1 = 105000 MPa", "0.05 mm"),
        ("E1 = 2 Es", "0.05 mm"),
        ("E1 = 105000 MPa", "0.002 mm"),
        ("E1 = 2 Es", "0.002 mm"),
    ]


def caption_of(figure: Figure | None) -> str:
    assert figure is not None
    (caption,) = [t.get_text() for t in figure.texts if t.get_gid() == "caption"]
    return caption.replace("\n", " ")


@pytest.mark.parametrize(("load", "shown"), [(12345.0, "12345"), (80000.0, "80000"), (99.123456789, "99.123456789")])
def test_given_numbers_keep_their_digits(tmp_path: Path, load: float, shown: str) -> None:
    scene = replace(SCENE, load=load, friction=0.31234, creepage=Creepage(0.00212345))
    grid = make_grid("g", case_axis(["one"]))
    with synthetic_tree(tmp_path, assemble(make_study(), (grid, [Case("g", (0,), scene, "0" * 64)]))) as tree, style():
        caption = caption_of(overview_figure(grids(tree)["g"]))
    assert f"$P$ = {shown} N, " in caption and r"$\mu$ = 0.31234" in caption and r"$\xi_x = 0.00212345$" in caption


STUDY = """\
study: s
scene:
  substrate: {E: 210000, nu: 0.3}
  counterbody: {E: 1 Es, nu: 0.28}
  radius: [460, 300]
  load: 100
  mesh: {size: auto, cells: [20, 20]}
  creepage: {longitudinal: 0.001, spin: 0.02}
grids:
  loads:
    axes: {load: [50, 100]}
  slides:
    scene: {layers: [{E: 2 Es, nu: 0.3, thickness: 0.05}, {E: 4 Es, nu: 0.3, thickness: 0.1}], coupling: full}
    axes: {creepage.longitudinal: [0.001, 0.002]}
  labels:
    scene: {creepage: none, counterbody: rigid}
    coating: {thickness: 0.5 a, layer_count: 2}
    axes:
      modulus: [0.5 Es, 2 Es]
      creepage: [{label: straight, longitudinal: 0.002}, {label: curve, longitudinal: 0.002, spin: 0.01}]
  nothing:
    cases:
      - {label: one, load: 10, radius: 20, friction: 0.5, substrate: {E: 1e5}, counterbody: rigid, coupling: full}
      - {label: other, load: 20, radius: [10, 20], discretisation: aligned, creepage: {spin: 0.2}}
"""


def test_captions_say_what_is_held_fixed_and_what_labels_stand_for(tmp_path: Path) -> None:
    run(load_text(tmp_path, STUDY), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree, style():
        views = grids(tree)
        captions = {name: caption_of(overview_figure(grid)) for name, grid in views.items()}
        assert captions["loads"].split(". ", 1)[1] in caption_of(case_maps(views["loads"]))
        assert overview_figure(views["slides"]).axes[0].get_xlabel() == "longitudinal creepage"
        titles = [ax.get_title(loc="left") for ax in case_maps(views["loads"]).axes[:2]]  # type: ignore[union-attr]
    bodies = r"substrate $E_s$ = 210000 MPa, $\nu$ = 0.3"
    other = r"counterbody $E$ = $1\,E_s$, $\nu$ = 0.28"
    radii, end = "$R_x$ = 460 mm, $R_y$ = 300 mm", "kalker discretisation."
    assert captions["loads"] == (
        "loads: Estimated discretisation errors as bars. "
        r"Creepage: $\xi_x = 0.001$, $\varphi = 0.02$ rad/mm. No layer. "
        rf"{radii}, {bodies}, {other}, one-way coupling, {end} $\mu$ = 1."
    )
    assert titles == ["load=50 N", "load=100 N"]
    assert r"Creepage: $\varphi = 0.02$ rad/mm. Layers (1 at the surface): $E_1 = 420000\," in captions["slides"]
    assert f"0.05 mm, 0.1 mm thick. {radii}" in captions["slides"] and "full coupling" in captions["slides"]
    assert (
        r"Creepage: straight: $\xi_x = 0.002$; curve: $\xi_x = 0.002$, $\varphi = 0.01$ rad/mm. "
        r"2 layers, each $0.5\,a$ thick, $\nu = 0.3$. Modulus $m\,E_s$ is that of the layer next to the substrate: "
        rf"the $k$-th layer above the substrate has $m^k\,E_s$. {radii}, {bodies}, rigid counterbody"
    ) in captions["labels"]
    assert (
        r"surface): $E_1 = 420000\,\mathrm{MPa}$, $E_2 = 840000\,\mathrm{MPa}$, $\nu = 0.3$, 0.05" in captions["slides"]
    )
    # nothing but layers and what labels stand for is shared: no stray full stop
    assert captions["nothing"].endswith(
        r"other: $\xi_x = 0.001$, $\varphi = 0.2$ rad/mm. No layer. "
        r"$P$ of one: 10 N; other: 20 N. $\mu$ of one: 0.5; other: 1. "
        r"Radius: one: $R$ = 20 mm; other: $R_x$ = 10 mm, $R_y$ = 20 mm. "
        r"Substrate: one: $E_s$ = 100000 MPa, $\nu$ = 0.3; other: $E_s$ = 210000 MPa, $\nu$ = 0.3. "
        r"Counterbody: one: rigid; other: $E$ = $1\,E_s$, $\nu$ = 0.28. "
        r"Coupling: one: full; other: one-way. Discretisation: one: kalker; other: aligned."
    )


SMALL_BALL = """
study: s
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  load: 20
  mesh: {size: auto, cells: [16, 16]}
  creepage: {longitudinal: 0.01}
grids:
"""

LABELS = (
    SMALL_BALL
    + """\
  bodies:
    axes:
      counterbody: [rigid, {label: steel, E: 210000, nu: 0.28}, {E: 1 Es, nu: 0.25}]
      substrate: [{E: 210000, nu: 0.3}, {label: soft, E: 70000, nu: 0.33}]
  meshes:
    axes:
      mesh: [{size: [8 a, 1], cells: [40, 44]}, {label: fit, size: auto, cells: [16, 18], margin: 1.5}]
      tolerance: [{normal: 1.0e-5, tangential: 1.0e-7}, {label: loose, normal: 1.0e-3, tangential: 1.0e-3}]
  loads:
    axes:
      load: [10, 20, 30]
      friction: [0.3, 0.4]
      radius: [20, 30]
      counterbody.nu: [0.3, 0.4]
    scene: {counterbody: {E: 1 Es, nu: 0.3}}
"""
)


def test_captions_explain_labels_of_bodies_meshes_and_tolerances(tmp_path: Path) -> None:
    run(load_text(tmp_path, LABELS), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree, style():
        views = grids(tree)
        captions = {name: caption_of(overview_figure(grid)) for name, grid in views.items()}
        steel = caption_of(overview_figure(views["bodies"].held_at("counterbody", "steel")))  # type: ignore[arg-type]
    c = r"c: $E$ = $1\,E_s$, $\nu$ = 0.25"
    assert (
        r"Substrate: a: $E_s$ = 210000 MPa, $\nu$ = 0.3; soft: $E_s$ = 70000 MPa, $\nu$ = 0.33. "
        rf"Counterbody: steel: $E$ = 210000 MPa, $\nu$ = 0.28; {c}. "
    ) in captions["bodies"]
    assert r"counterbody $E$ = 210000 MPa, $\nu$ = 0.28, one-way" in steel and c not in steel
    assert (
        r"kalker discretisation. Mesh: a: 40 × 44 cells in $8\,a$ × 1 mm; "
        r"fit: 16 × 18 cells in a window 1.5 times as wide as the contact. "
        r"Tolerance: a: $1\times10^{-5}$ (pressure), $1\times10^{-7}$ (tractions); "
        r"loose: $0.001$ (pressure), $0.001$ (tractions). "
    ) in captions["meshes"]
    assert not any(word in captions["loads"] for word in ("Radius:", "Counterbody", "Mesh", "Tolerance"))


BODIES = (
    SMALL_BALL
    + """\
  substrates: {scene: {layers: [{E: 1000, nu: 0.3, thickness: 1}]}, axes: {substrate.E: [70000, 210000]}}
  ratios: {axes: {substrate.nu: [0.2, 0.3]}}
  others:
    scene: {counterbody: {nu: 0.28}}
    axes: {counterbody.E: [0.5 Es, 1 Es]}
  given: {axes: {counterbody.E: [70000, 210000], counterbody.nu: [0.2, 0.3]}}
"""
)


def test_moduli_of_substrate_and_counterbody_are_told_apart(tmp_path: Path) -> None:
    """Both were `E`, and of a body with one number varied the caption told nothing."""
    run(load_text(tmp_path, BODIES), tmp_path / "s.nc", workers=1, solve=made_up)
    with open_cube(tmp_path / "s.nc") as tree, style():
        views = grids(tree)
        figures = {name: overview_figure(grid) for name, grid in views.items()}
        labels = {name: figure.axes[0].get_xlabel() for name, figure in figures.items()}
        captions = {name: caption_of(figure) for name, figure in figures.items()}
        lines = [text.get_text() for text in figures["given"].legends[0].get_texts()]
        assert views["substrates"].first.settings == ["substrate E=70000 MPa"]
        assert layers_text(views["substrates"].first) == "E1 = 1000 MPa"  # and the substrate's nu
    assert labels == {
        "substrates": "substrate E (MPa)",
        "ratios": "substrate nu",
        "others": "counterbody E (MPa)",
        "given": "counterbody E (MPa)",
    }
    assert lines == ["counterbody nu = 0.2", "counterbody nu = 0.3"]
    assert r"$R$ = 50 mm, substrate $\nu$ = 0.3, rigid counterbody" in captions["substrates"]
    assert r"$R$ = 50 mm, substrate $E_s$ = 210000 MPa, rigid counterbody" in captions["ratios"]
    assert r"substrate $E_s$ = 210000 MPa, $\nu$ = 0.3, counterbody $\nu$ = 0.28, one-way" in captions["others"]
    assert r"$\nu$ = 0.3, one-way" in captions["given"] and "rigid" not in captions["given"]


SOLVERS = (
    SMALL_BALL
    + """\
  usual: {scene: {tolerance: {normal: 1.0e-5}}, axes: {load: [10, 20]}}
  given:
    scene: {method: paper-cg, spin_point: 0.125, tolerance: {normal: 1.0e-3}}
    axes: {tolerance.tangential: [0.1, 0.01]}
  aligned: {scene: {discretisation: aligned, spin_point: 0.125, tolerance: {tangential: 0.001}}, axes: {load: [10, 20]}}
  listed:
    cases:
      - {label: one, method: paper-cg}
      - {label: other, spin_point: 0.125}
  either:
    scene: {discretisation: aligned, spin_point: 0.125}
    cases:
      - {label: one}
      - {label: other, discretisation: kalker}
  pressures: {scene: {creepage: none, method: paper-cg}, axes: {load: [10, 20]}}
"""
)


def test_captions_name_solvers_that_are_not_the_usual_ones(tmp_path: Path) -> None:
    run(load_text(tmp_path, SOLVERS), tmp_path / "s.nc", workers=1, solve=made_up)
    with open_cube(tmp_path / "s.nc") as tree, style():
        captions = {name: caption_of(overview_figure(grid)) for name, grid in grids(tree).items()}
    parts = {name: re.split(r"ounterbody, | \$P\$| \$\\mu\$", caption)[1] for name, caption in captions.items()}
    assert parts == {
        "usual": "one-way coupling, kalker discretisation.",
        "given": "one-way coupling, paper-cg method, kalker discretisation, "
        "spin point $0.125$ cells ahead of the centre, tolerance $0.001$ (pressure).",
        "aligned": "one-way coupling, aligned discretisation, "
        r"tolerance $1\times10^{-5}$ (pressure), $0.001$ (tractions).",
        "listed": "one-way coupling, kalker discretisation. Method: one: paper-cg; other: newton. "
        "Spin point: one: $0$ cells ahead of the centre; other: $0.125$ cells ahead of the centre.",
        "either": "one-way coupling, spin point $0.125$ cells ahead of the centre. "
        "Discretisation: one: aligned; other: kalker.",
        "pressures": "kalker discretisation.",
    }


def test_what_no_solved_case_has_has_no_panel(tmp_path: Path) -> None:
    """Forces had empty panels with scales where only a case without creepage is solved."""
    scenes = [replace(SCENE, creepage=None), SCENE]
    cases = [Case("g", (k,), scene, f"{k:064x}") for k, scene in enumerate(scenes)]
    made = assemble(
        make_study(),
        (make_grid("g", case_axis(["still", "rolls"])), cases),
        failing={f"{1:064x}": Status.NOT_CONVERGED},
    )
    with synthetic_tree(tmp_path, made) as tree, style():
        figure = overview_figure(grids(tree)["g"])
    labels = [ax.get_ylabel() for ax in figure.axes if ax.get_visible()]
    assert labels == [QUANTITIES["contact_radius"], QUANTITIES["pressure_max"]]
    assert "1 of 2 cases not solved (gaps)." in caption_of(figure)


GRADED = (
    SMALL_BALL
    + """\
  one: {coating: {thickness: 0.1}, axes: {modulus: [0.5 Es, 420000]}}
  several: {coating: {layer_count: 10, thickness: 0.1}, axes: {modulus: [0.9 Es, 231000]}}
  counts: {coating: {modulus: 2 Es, thickness: 0.1}, axes: {layer_count: [0, 1, 3]}}
  held: {coating: {layer_count: 2, thickness: 0.1}, axes: {modulus: [0.5 Es, 2 Es], load: [10, 20, 40]}}
"""
)


def test_captions_say_which_modulus_of_several_layers_is_varied(tmp_path: Path) -> None:
    """All ten layers were taken to have it."""
    run(load_text(tmp_path, GRADED), tmp_path / "s.nc", workers=1, solve=made_up)
    with open_cube(tmp_path / "s.nc") as tree, style():
        views = grids(tree)
        captions = {name: caption_of(overview_figure(grid)) for name, grid in views.items()}
        maps = caption_of(case_maps(views["several"]))
        (view,) = (views["several"].held_at("modulus", "231000"),)
        assert view is not None
        surface, (E, _) = view.first.layers[0][0], view.first.layers[-1]
    words = r" The $k$-th layer above the substrate has $2^k\,E_s$. $R$"
    which = r"Modulus $m\,E_s$ is that of the layer next to the substrate: the $k$-th layer above the substrate has $"
    assert "above the substrate" not in captions["one"]
    assert f"thick, $\\nu = 0.3$. {which}" in captions["several"] and which in maps
    assert (E, surface) == (pytest.approx(231000.0), pytest.approx(210000.0 * 1.1**10))
    assert words in captions["counts"]
    assert "Shown for load" not in captions["held"] and which in captions["held"]


@pytest.mark.parametrize(
    ("grid", "axis", "text", "label"),
    [
        ("one", "thickness", "a", "1 a"),
        ("one", "modulus", "Es", "1 Es"),
        ("one", "modulus", "420000 MPa", "2 Es"),
        ("one", "load", "100.00001", "100.00001"),
        ("one", "load", "100.00001 N", "100.00001"),
        ("one", "load", "100", "100"),
        ("one", "load", "99.99999", "100"),
        ("mixed", "thickness", "0.1", "0.1"),
        ("mixed", "thickness", "0.1 mm", "0.1"),
        ("mixed", "thickness", "0.25a", "0.25 a"),
        ("one", "load", "100.1", None),
        ("mixed", "thickness", "0.100", "0.1"),
        ("mixed", "thickness", "1e-1 mm", "0.1"),
        ("mixed", "thickness", "0.100mm", "0.1"),
        ("mixed", "thickness", "0.100 MPa", None),
        ("mixed", "thickness", "0.25", None),
        ("mixed", "thickness", "mm", None),
    ],
)
def test_a_value_is_found_as_the_study_or_the_cube_writes_it(
    tmp_path: Path, grid: str, axis: str, text: str, label: str | None
) -> None:
    """Not found were `a`, numbers beside relative ones, and of two close ones the second."""
    study = SMALL_BALL + (
        "  one: {axes: {thickness: [0.5 a, a], modulus: [Es, 2 Es], load: [100, 100.00001, 200]}}\n"
        "  mixed: {coating: {modulus: 2 Es}, axes: {thickness: [0.25 a, 0.1], load: [50, 100]}}\n"
    )
    run(load_text(tmp_path, study), tmp_path / "s.nc", workers=1, solve=made_up)
    with open_cube(tmp_path / "s.nc") as tree:
        held = grids(tree)[grid].held_at(axis, text)
        assert (held is None) is (label is None)
        if held is not None:
            assert f"{axis}={label}" in held.first.label.split(", ")


def test_each_sentence_of_a_caption_begins_with_a_capital(tmp_path: Path) -> None:
    """Where load, friction and Hertz's contact differ the last one is on the cells alone."""
    axes = (number_axis("load", [50.0, 100.0], "N"), number_axis("friction", [0.5, 1.0]))
    with opened(tmp_path, make_grid("g", *axes)) as grid:
        assert conditions(grid).replace(KEEP, " ") == "Cells of 0.0625 mm × 0.08333 mm."


RUBBER = (
    SMALL_BALL
    + """\
  rubber:
    coating: {thickness: 1, modulus: 20, layer_nu: 0.49}
    axes: {friction: [0.3, 0.5]}
  two:
    scene: {layers: [{E: 20, nu: 0.45, thickness: 0.5}, {E: 1 Es, nu: 0.3, thickness: 0.1}]}
    axes: {friction: [0.3, 0.5]}
  ratios:
    coating: {thickness: 1, modulus: 20}
    axes: {layer_nu: [0.4, 0.49], friction: [0.3, 0.5]}
"""
)


def test_poissons_ratios_of_layers_are_told(tmp_path: Path) -> None:
    run(load_text(tmp_path, RUBBER), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree, style():
        views = grids(tree)
        captions = {name: caption_of(overview_figure(grid)) for name, grid in views.items()}
        words = {name: layers_text(grid.first) for name, grid in views.items()}
    assert words == {
        "rubber": "E1 = 20 MPa, nu = 0.49",
        "two": "E1 = 20 MPa, E2 = 210000 MPa, nu1 = 0.45, nu2 = 0.3",
        "ratios": "E1 = 20 MPa, nu = 0.4",
    }
    assert r"Layers: $E_1 = 20\,\mathrm{MPa}$, $\nu = 0.49$, 1 mm thick." in captions["rubber"]
    assert r"$E_2 = 210000\,\mathrm{MPa}$, $\nu_1 = 0.45$, $\nu_2 = 0.3$, 0.5 mm, 0.1 mm thick." in captions["two"]
    assert r"Layers: $E_1 = 20\,\mathrm{MPa}$, 1 mm thick." in captions["ratios"]


def test_titles_of_maps_keep_commas_within_labels(tmp_path: Path) -> None:
    label = "no coating at all, just the wheel, as delivered"
    with opened(tmp_path, make_grid("g", case_axis([label]))) as grid, style():
        figure = case_maps(grid)
        assert figure is not None
        assert figure.axes[0].get_title(loc="left").replace("\n", " ") == label


def test_small_numbers_in_captions_have_a_power_of_ten(tmp_path: Path) -> None:
    scene = replace(SCENE, creepage=Creepage(2e-5, 0.0, 0.0))
    grid = make_grid("g", case_axis(["one"]))
    with synthetic_tree(tmp_path, assemble(make_study(), (grid, [Case("g", (0,), scene, "0" * 64)]))) as tree, style():
        assert r"Creepage: $\xi_x = 2\times10^{-5}$" in caption_of(overview_figure(grids(tree)["g"]))


@pytest.mark.parametrize(
    ("values", "least", "most", "whole"),
    [
        ((1.0, 2.0), 2, 3, True),
        ((0.1011, 0.2022, 0.3033), 2, 4, False),
        ((0.0001011, 0.0002022, 0.0003033), 2, 4, False),
        ((0.1, 0.2, 0.3), 2, 99, False),
        (tuple(np.linspace(0.0001, 0.003, 15)), 4, 6, False),  # long numbers, but not those of the ticks
    ],
)
def test_linear_axes_have_few_ticks_for_long_numbers_and_whole_ones_for_whole(
    tmp_path: Path, values: tuple[float, ...], least: int, most: int, *, whole: bool
) -> None:
    with opened(tmp_path, make_grid("g", number_axis("friction", list(values)))) as grid, style():
        ax = overview_figure(grid).axes[0]
        ticks = [tick for tick in ax.get_xticks() if ax.get_xlim()[0] <= tick <= ax.get_xlim()[1]]
    assert least <= len(ticks) <= most and (not whole or all(tick == round(tick) for tick in ticks))


def test_values_have_units_in_labels_and_titles(tmp_path: Path) -> None:
    axes = (
        "{radius: [[60, 50], 40], creepage.spin: [0.01, 0.02], load: {first: 20, last: 20000, count: 4, spacing: log}}"
    )
    study = f"{BASE}  g:\n    scene: {{mesh: {{size: auto}}}}\n    axes: {axes}\n"
    run(load_text(tmp_path, study), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree, style():
        grid = grids(tree)["g"]
        assert grid.axis_values("radius") == ["60 x 50 mm", "40 mm"]
        assert grid.axis_values("spin") == ["0.01 rad/mm", "0.02 rad/mm"]
        assert ", ".join(grid.case(0, 1, 0).settings) == "radius=60 x 50 mm, spin=0.02 rad/mm, load=20 N"
        figure = overview_figure(grid)
        ax = figure.axes[0]
        assert (ax.get_xlabel(), ax.get_xscale()) == ("load (N)", "log")
        assert [t.get_text() for t in figure.legends[0].get_texts()] == ["radius = 60 x 50 mm", "radius = 40 mm"]
        assert "Shown for spin = 0.01 rad/mm." in caption_of(figure)
    assert unit_as_written("1", "thickness of each layer over the Hertz radius a") == "a"


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ((20.0, 63.2456, 200.0), True),  # equal factors
        ((0.01, 0.0118921, 0.0141421, 0.0168179, 0.02), True),
        ((1.0, 2.0, 5.0, 10.0, 20.0, 50.0), True),  # about equal ones
        ((1.0, 2.0, 3.0), False),
        ((1.0, 1.001, 1.002), False),
        ((0.001, 0.1, 10.0, 1000.0, 1e5, 1e6), True),  # over more than three decades, with the last factor smaller
        ((1.0, 2.0, 5.0, 1000.0, 10000.0), True),
        ((10.0, 1000.0), False),
        ((10.0, 10000.0), False),
        ((10.0, 11000.0), True),
        ((-11000.0, -10.0), True),
        ((0.0, 11000.0), False),
        ((5.0,), False),
        ((1.0, 2.0, 5.0), False),
        ((0.0, 1.0, 10.0, 100.0), False),
        ((-100.0, -10.0, -1.0), True),
        ((-3.0, -2.0, -1.0), False),
        ((-100.0, -10.0, 0.0), False),
        ((-10.0, -1.0, 1.0, 10.0), False),
        ((1e-300, 1.0, 1e300), False),  # more than can be drawn
    ],
)
def test_numbers_that_go_on_by_factors_have_a_logarithmic_axis(values: tuple[float, ...], *, expected: bool) -> None:
    assert geometric(np.array(values)) is expected


@pytest.mark.parametrize(
    ("values", "shown"),
    [
        ((1e-4, 1e-3, 1e-2, 1e-1), ["-10^{-1}", "-10^{-2}", "-10^{-3}", "-10^{-4}"]),
        ((0.001, 0.0021, 0.0045, 0.0095, 0.02), ["−0.02", "−0.01", "−0.005", "−0.001"]),
        ((0.5, 1.0, 2.0, 4.0), ["−4", "−2", "−1", "−0.5"]),
    ],
)
def test_axes_of_negative_numbers_are_the_mirror_image(
    tmp_path: Path, values: tuple[float, ...], shown: list[str]
) -> None:
    """They were linear, with most of the values on top of one another."""
    negative = sorted(-value for value in values)
    axes = {"down": number_axis("spin", negative), "up": number_axis("spin", list(values))}
    at, ticks = {}, []
    for name, axis in axes.items():
        with opened(tmp_path, make_grid(name, axis)) as grid, style():
            figure = overview_figure(grid)
            figure.draw_without_rendering()
            ax = figure.axes[0]
            low, high = ax.get_xlim()
            at[name] = ax.transAxes.inverted().transform(
                ax.transData.transform([(x, 0.0) for x in np.sort(axis.coords["spin"].values)])
            )[:, 0]
            if name == "down":
                places = zip(ax.get_xticks(), ax.get_xticklabels(), strict=True)
                ticks = [label.get_text() for place, label in sorted(places, key=itemgetter(0)) if low < place < high]
    np.testing.assert_allclose(at["down"], 1.0 - at["up"][::-1], atol=1e-9)
    assert [tick.removeprefix(r"$\mathdefault{").removesuffix("}$") for tick in ticks] == shown


@pytest.mark.parametrize(
    ("values", "scale", "limits"),
    [
        ((3.0, 4000.0, np.nan), "log", (2.0, 6000.0)),
        ((-3.0, -4000.0), "symlog", (-6000.0, -2.0)),
        ((3.0, 3000.0), "linear", None),
        ((-1e-3, 3000.0), "linear", None),
        ((0.0, 3000.0), "linear", None),
        ((1e-300, 1.0), "linear", None),  # more than can be drawn
        ((np.nan, np.nan), "linear", None),
        ((), "linear", None),
    ],
)
def test_values_of_many_decades_have_a_logarithmic_axis(
    values: tuple[float, ...], scale: str, limits: tuple[float, float] | None
) -> None:
    """Bars that reach nearly to zero, or across it, make it no longer."""
    with style():
        ax = layout.panels(1, 1, 2.0)[1][0, 0]
        drawn = np.array(values)
        ax.errorbar(np.arange(len(values)), drawn, 0.999999 * np.abs(drawn))
        _scale_values(ax, drawn)
        assert ax.get_yscale() == scale
        low, high = ax.get_ylim()
        if limits is not None:
            assert limits[0] < low < drawn[np.isfinite(drawn)].min()
            assert drawn[np.isfinite(drawn)].max() < high < limits[1]
            ax.figure.canvas.draw()
            shown = [label.get_text() for label in ax.get_yticklabels()]
            assert any("10^{3}" in text and ("-" in text) == (high < 0.0) for text in shown), shown


def test_ratios_have_error_bars_within_0_and_1(tmp_path: Path) -> None:
    grid = make_grid("g", number_axis("load", [50.0, 100.0, 150.0], "N"))
    made = assemble(make_study(), (grid, grid_cases(grid, SCENE)))
    for case, result in made.results:
        area = result.scalars["contact_area"]
        slip = (0.01, 0.5, 0.99)[case.index[0]] * area
        result.scalars |= {"slip_area": slip, "slip_area_error": 0.05 * area, "contact_area_error": 0.0}
    with synthetic_tree(tmp_path, made) as tree, style():
        figure = overview_figure(grids(tree)["g"])
    (ax,) = [ax for ax in figure.axes if ax.get_ylabel() == QUANTITIES["slip_area"]]
    ends = [segment[:, 1] for segment in ax.collections[0].get_segments()]
    np.testing.assert_allclose(ends, [(0.0, 0.06), (0.45, 0.55), (0.94, 1.0)], atol=1e-12)


@pytest.mark.parametrize(
    ("depths", "expected"),
    [
        ((0.5, 0.5), "0.5 a"),
        ((0.5, 1.0, 0.5), "0.5 a, 1 a, 0.5 a"),
        ((0.5, 0.5, 1.0), "0.5 a, 0.5 a, 1 a"),
    ],
)
def test_stacks_that_differ_read_differently(tmp_path: Path, depths: tuple[float, ...], expected: str) -> None:
    """One thickness stands for all layers only where all have it."""
    scene = replace(SCENE, layers=tuple(Layer(105000.0, 0.3, depth * RADIUS) for depth in depths))
    grid = make_grid("g", case_axis(["one"]))
    with synthetic_tree(tmp_path, assemble(make_study(), (grid, [Case("g", (0,), scene, "0" * 64)]))) as tree:
        assert thickness_text(grids(tree)["g"].case(0)) == expected


def test_letters_that_the_font_lacks_are_told_once(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    recwarn: pytest.WarningsRecorder,
) -> None:
    with opened(tmp_path, make_grid("g", labelled(monkeypatch, ("接触", "नमस्ते")))) as grid, style():
        texts(overview_figure(grid))
        warnings.warn("another", stacklevel=1)
    assert caplog.messages == ["labels have letters that the font of the figures lacks: they are drawn as boxes"]
    assert [str(warning.message) for warning in recwarn] == ["another"]


def test_captions_of_maps_tell_the_labels_that_are_drawn(tmp_path: Path) -> None:
    """Of 30 cases twelve are drawn; the first twelve were told of. Wide letters ran out of the figure."""
    labels = [f"MWMWM {k}" for k in range(30)]
    cases = "".join(
        f"      - {{label: {label}, creepage: {{longitudinal: {(k + 1) / 1000}}}}}\n" for k, label in enumerate(labels)
    )
    study = load_text(tmp_path, f"{BASE}  listed:\n    cases:\n{cases}")
    run(study, tmp_path / "c.nc", workers=1, solve=made_up)
    with open_cube(tmp_path / "c.nc") as tree, style():
        figure = case_maps(grids(tree)["listed"])
        caption = caption_of(figure)
        assert figure is not None
        drawn = [ax.get_title(loc="left") for ax in figure.axes if ax.get_title(loc="left")]
        (text,) = [t for t in figure.texts if t.get_gid() == "caption"]
        assert text.get_window_extent().width < figure.bbox.width
    assert len(drawn) == 12
    told = [label for label in labels if f"{label}: " in caption]
    assert told == drawn
    assert "..." not in caption


def test_numbers_of_ten_layers_and_more_stand_below() -> None:
    """`E_10` is E with a small 1, and 0."""
    assert [_numbered("E", k, True) for k in (0, 8, 9, 11)] == ["E_1", "E_9", "E_{10}", "E_{12}"]
    assert _numbered("E", 9, False) == "E10"


BARE_FIRST = (
    SMALL_BALL
    + """\
  one:
    coating: {thickness: 0.1 a, modulus: 0.8 Es}
    axes: {layer_count: [0, 1], load: [10, 20]}
  depths:
    coating: {modulus: 0.8 Es}
    axes: {layer_count: [0, 1, 2], thickness: [0.1 a, 0.5 a]}
  moduli:
    coating: {thickness: 0.1 a}
    axes: {layer_count: [0, 2], modulus: [0.5 Es, 2 Es]}
  bodies:
    axes:
      layers: [[], {label: soft, layers: [{E: 0.5 Es, nu: 0.3, thickness: 0.1 a}]}]
      substrate.E: [100000, 200000]
"""
)


def test_captions_look_beyond_a_first_case_without_layers(tmp_path: Path) -> None:
    """What other axes change of layers does not show in a case without any: one of their values was told for all."""
    run(load_text(tmp_path, BARE_FIRST), tmp_path / "s.nc", workers=1, solve=made_up)
    with open_cube(tmp_path / "s.nc") as tree, style():
        captions = {name: caption_of(overview_figure(grid)) for name, grid in grids(tree).items()}
    told = r"Layers, where there are any: $E_1 = 168000\,\mathrm{MPa}$, $\nu = 0.3$, $0.1\,a$ thick. "
    assert told in captions["one"]
    assert "thick" not in captions["depths"].lower() and r"$0.8^k\,E_s$" in captions["depths"]
    assert r"$m^k\,E_s$" in captions["moduli"] and "0.5^k" not in captions["moduli"]
    assert "soft" not in captions["bodies"] and r"each layer: $0.1\,a$" in captions["bodies"]


@pytest.mark.parametrize(
    ("thickness", "a", "expected"),
    [
        (0.01, 0.20870247583747087, "0.01 mm"),  # 0.0479151 a, to the last bit
        (0.5 * 0.20870247583747087, 0.20870247583747087, "0.5 a"),
        (0.0479151 * 0.2, 0.2, "0.0479151 a"),
        (0.1, 0.2, "0.5 a"),  # both are as round
        (0.0123457, 0.2533, "0.0123457 mm"),
    ],
)
def test_round_lengths_are_in_mm_though_they_are_multiples_of_a_by_chance(
    tmp_path: Path, thickness: float, a: float, expected: str
) -> None:
    """One case in a thousand was."""
    scene = replace(SCENE, layers=(Layer(105000.0, 0.3, thickness),))
    grid = make_grid("g", case_axis(["one"]))
    with synthetic_tree(tmp_path, assemble(make_study(), (grid, [Case("g", (0,), scene, "0" * 64)]))) as tree:
        view = grids(tree)["g"]
        view.small("hertz_radius").values[:] = a
        assert thickness_text(view.case(0)) == expected


WORDS = (
    SMALL_BALL
    + """\
  pressures:
    scene: {creepage: none, layers: [{E: 20000, nu: 0.3, thickness: 0.1}]}
    axes: {load: [10, 20]}
  bare:
    axes: {load: [10, 20]}
  stack:
    scene: {layers: [{E: 20000, nu: 0.3, thickness: 0.1}, {E: 50000, nu: 0.3, thickness: 0.1}]}
    axes: {load: [10, 20]}
"""
)


def test_captions_have_no_coated_body_nor_friction_where_there_is_none(tmp_path: Path) -> None:
    run(load_text(tmp_path, WORDS), tmp_path / "s.nc", workers=1, solve=made_up)
    with open_cube(tmp_path / "s.nc") as tree, style():
        views = grids(tree)
        captions = {name: caption_of(overview_figure(grid)) for name, grid in views.items()}
        maps = {name: caption_of(case_maps(views[name])) for name in ("bare", "stack")}
        notes = {name: case_table([grid])[0] for name, grid in views.items()}
    assert [r"$\mu$" in captions[name] for name in views] == [False, True, True]
    assert "traction on the substrate. " in maps["bare"] and "traction on the coated body. " in maps["stack"]
    assert ["1 at the surface" in captions[name] for name in views] == [False, False, True]
    assert ["layer 1 is at the surface; " in notes[name] for name in views] == [False, False, True]
    assert ["act on the substrate, " in notes[name] for name in views] == [False, True, False]


def test_numbers_along_maps_of_small_contacts_do_not_overlap(tmp_path: Path) -> None:
    """Of three decimals and more, `-0.0005` and `-0.00025`, five ran into each other."""
    text = f"{SMALL_BALL}  g: {{axes: {{load: [1e-6, 1e-3, 1, 1000], creepage.longitudinal: [1e-6, 1e-5, 1e-4]}}}}\n"
    run(load_text(tmp_path, text), tmp_path / "s.nc", workers=1)
    with open_cube(tmp_path / "s.nc") as tree, style():
        figure = case_maps(grids(tree)["g"])
        assert figure is not None
        figure.draw_without_rendering()
        for ax in (ax for ax in figure.axes if ax.get_title(loc="left")):
            boxes = [label.get_window_extent() for label in ax.get_xticklabels() if label.get_text()]
            inside = sorted((box.x0, box.x1) for box in boxes if ax.bbox.x0 <= (box.x0 + box.x1) / 2 <= ax.bbox.x1)
            assert len(inside) >= 3 and all(end < start for (_, end), (start, _) in pairwise(inside))


def test_few_numbers_on_a_short_logarithmic_axis_have_a_tick_each(tmp_path: Path) -> None:
    """There were ticks at 0.2, 0.4, 0.6 and 0.8, and none near the first number."""
    with opened(tmp_path, make_grid("g", number_axis("friction", [0.1, 0.2, 0.4, 0.8]))) as grid, style():
        ax = overview_figure(grid).axes[0]
        assert ax.get_xscale() == "log"
        assert [label.get_text() for label in ax.get_xticklabels()] == ["0.1", "0.2", "0.4", "0.8"]


@pytest.mark.parametrize(
    "values",
    [
        [63000.0, 92070.9, 134556.0, 196647.0, 287388.0, 420000.0],
        [20000.0, 60000.0, 180000.0, 540000.0, 1.62e6],
        [0.00012, 0.00018, 0.00027, 0.000405, 0.0006075],
        [0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2],
    ],
)
def test_long_numbers_on_a_logarithmic_axis_do_not_overlap(tmp_path: Path, values: list[float]) -> None:
    """As `3e+05` and `4e+05`."""
    with opened(tmp_path, make_grid("g", number_axis("friction", values))) as grid, style():
        figure = overview_figure(grid)
        figure.draw_without_rendering()
        for ax in (ax for ax in figure.axes if ax.get_visible()):
            assert ax.get_xscale() == "log"
            boxes = [label.get_window_extent() for label in ax.get_xticklabels()]
            assert len(boxes) > 1 and all(one.x1 < other.x0 for one, other in pairwise(boxes))


@pytest.mark.parametrize("quantities", ["force_x", "force_x,force_y", "force_x,force_y,moment_z,friction_power"])
def test_long_numbers_between_short_ones_do_not_overlap(tmp_path: Path, quantities: str) -> None:
    """As `0.0025` and `0.0050`, in wide panels."""
    with opened(tmp_path, make_grid("g", number_axis("spin", [0.0, 0.002, 0.006, 0.02]))) as grid, style():
        figure = overview_figure(grid, quantities=quantities.split(","))
        figure.draw_without_rendering()
        for ax in (ax for ax in figure.axes if ax.get_visible()):
            boxes = [label.get_window_extent() for label in ax.get_xticklabels()]
            assert len(boxes) > 3 and all(one.x1 < other.x0 for one, other in pairwise(boxes))


def test_ticks_on_a_logarithmic_axis_are_at_decades_first_and_plain_numbers(tmp_path: Path) -> None:
    """They were `2e+04`, `5e+04` and `2e+05`, with none at 100000."""
    with opened(tmp_path, make_grid("g", number_axis("friction", [2e4, 6e4, 1.8e5, 5.4e5]))) as grid, style():
        texts = [label.get_text() for label in overview_figure(grid).axes[0].get_xticklabels()]
    assert "100000" in texts and not any("e" in text for text in texts)


def test_moduli_that_follow_from_others_have_six_digits(tmp_path: Path) -> None:
    """`E1 = 76530.6122449 MPa, E2 = 107142.857143 MPa`."""
    text = (
        f"{SMALL_BALL}  g: {{coating: {{layer_count: 3, thickness: 0.1, modulus: 150000}}, axes: {{load: [10, 20]}}}}\n"
    )
    run(load_text(tmp_path, text), tmp_path / "s.nc", workers=1, solve=made_up)
    with open_cube(tmp_path / "s.nc") as tree:
        assert layers_text(grids(tree)["g"].first) == "E1 = 76530.6 MPa, E2 = 107143 MPa, E3 = 150000 MPa"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("layers: a: $E_1 = 1$, $E_2 = 2$, 0.1 mm thick; b, c: no layer",) * 2,
        (", ".join(f"$E_{k} = {k}$" for k in range(1, 7)),) * 2,
        (", ".join(f"$E_{k} = {k}$" for k in range(1, 8)), "$E_1 = 1$, $E_2 = 2$, $E_3 = 3$, ..., $E_7 = 7$"),
        (
            "a: " + ", ".join(rf"$\nu_{k} = 0.{k}$" for k in range(1, 8)),
            r"a: $\nu_1 = 0.1$, $\nu_2 = 0.2$, $\nu_3 = 0.3$, "
            r"..., $\nu_7 = 0.7$",
        ),
        (", ".join(f"{k} mm" for k in range(1, 9)) + " thick; b: 1 mm", "1 mm, 2 mm, 3 mm, ..., 8 mm thick; b: 1 mm"),
        (", ".join(rf"${k}\,a$" for k in range(1, 8)), r"$1\,a$, $2\,a$, $3\,a$, ..., $7\,a$"),
        ("$E_1 = 1 = 2 = 3 = 4 = 5 = 6$", "$E_1 = 1 = 2 = ... = 6$"),
    ],
)
def test_captions_spell_out_few_layers(text: str, shown: str) -> None:
    """Of fifty layers that differ a caption was taller than its plots."""
    assert abridged(text) == shown


def test_the_caption_of_a_graded_coating_is_short_and_its_table_whole(tmp_path: Path) -> None:
    """Two that differ in a layer that is not shown are not taken for one."""
    stacks = [[f"{{E: {1000 * k}, nu: 0.3, thickness: 0.01}}" for k in range(1, 21)] for _ in "ab"]
    stacks[1][9] = stacks[1][8]
    sets = ", ".join(f"{{label: {x}, layers: [{', '.join(stack)}]}}" for x, stack in zip("ab", stacks, strict=True))
    run(load_text(tmp_path, f"{SMALL_BALL}  g: {{axes: {{layers: [{sets}]}}}}\n"), tmp_path / "s.nc", solve=made_up)
    with open_cube(tmp_path / "s.nc") as tree, style():
        caption = caption_of(overview_figure(grids(tree)["g"]))
        table = layers_text(grids(tree)["g"].first)
    ends = r"$E_1 = 1000\,\mathrm{MPa}$, $E_2 = 2000\,\mathrm{MPa}$, $E_3 = 3000\,\mathrm{MPa}$, ..., $E_{20} = 20000"
    assert caption.count(ends) == 2 and "E_4" not in caption
    assert table.count("MPa") == 20


@pytest.mark.parametrize(("creepage", "share"), [(Creepage(), 1.0), (Creepage(0.001), 0.9)])
def test_the_colours_of_maps_reach_from_zero_to_the_largest_traction_drawn(
    tmp_path: Path, creepage: Creepage, share: float
) -> None:
    """Without any traction the bar went from -0.1 to 0.1 MPa; stored ones may exceed `traction_max`, and were cut."""
    grid = make_grid("g", case_axis(["one"]))
    made = assemble(make_study(), (grid, [Case("g", (0,), replace(SCENE, creepage=creepage), "0" * 64)]))
    scalars = made.results[0][1].scalars
    largest = scalars["traction_max"]
    scalars["traction_max"] *= share
    with synthetic_tree(tmp_path, made) as tree, style():
        figure = case_maps(grids(tree)["g"])
    assert figure is not None
    norms = [ax.images[0].norm for ax in figure.axes if ax.images]
    assert [(norm.vmin, norm.vmax) for norm in norms] == [(0.0, largest or 1.0)]
    assert bool(largest) is (creepage != Creepage())


def test_more_values_than_lines_have_looks_are_counted_in_the_caption(tmp_path: Path) -> None:
    grid = make_grid(
        "g", modulus_axis(tuple(1.0 + k for k in range(len(LINES) + 2))), number_axis("load", [50.0, 100.0])
    )
    study = assemble(make_study(), (grid, grid_cases(grid, SCENE)))
    with synthetic_tree(tmp_path, study) as tree, style():
        view = grids(tree)["g"]
        along_loads, along_moduli = overview_figure(view, "load"), overview_figure(view, "modulus")
        assert f"{len(LINES)} of {len(LINES) + 2} values of modulus." in caption_of(along_loads)
        assert len({line.get_color() for line in along_loads.axes[0].lines}) == len(LINES)
        assert "values of" not in caption_of(along_moduli)


def test_without_fields_there_are_no_maps(tmp_path: Path) -> None:
    with synthetic_tree(tmp_path, several(fields=False)) as tree, style():
        assert [case_maps(grid) for grid in grids(tree).values()] == [None] * 3
