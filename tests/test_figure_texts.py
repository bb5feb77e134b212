"""Texts of figures: within the figure, none over another, whatever layers, labels and numbers a study has."""

from __future__ import annotations

from pathlib import Path

import pytest
from matplotlib.figure import Figure
from studies import load_text
from texts import check_texts
from workers import made_up

from rcstudy.cube import open_cube
from rcstudy.report.labels import fitted, width_of
from rcstudy.report.overview import case_maps, overview_figure
from rcstudy.report.paper import paper_grids
from rcstudy.report.paper_figures import paper_figure
from rcstudy.report.style import save, style
from rcstudy.report.views import grids
from rcstudy.result import Result, Status
from rcstudy.sweep import run
from rcstudy.workers.pool import Solve

SCENE = """
study: s
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: RADIUS
  load: 100
  mesh: {size: auto, cells: [16, 16]}
grids:
"""
THREE = "creepage: [{longitudinal: 0.001}, {longitudinal: 0.002, lateral: 0.00123456, spin: 0.01}, {lateral: 0.002}]"


def drawn(tmp_path: Path, grid: str, kind: str, radius: str = "50", solve: Solve = made_up) -> Figure:
    """The figure of `grid`, the only one of a study: the paper's of that name, or an overview, or maps."""
    study = load_text(tmp_path, f"{SCENE.replace('RADIUS', radius)}  {grid}\n")
    run(study, tmp_path / "s.nc", workers=1, solve=solve)
    with open_cube(tmp_path / "s.nc") as tree, style():
        views = grids(tree)
        (view,) = views.values()
        if kind == "paper":
            figure = paper_figure(view.name, paper_grids(views))
        else:
            figure = overview_figure(view) if kind == "overview" else case_maps(view)
            assert figure is not None
        save(figure, tmp_path, "figure", ())  # laid out, not drawn: that takes the longest
    return figure


@pytest.mark.parametrize(
    ("grid", "kind"),
    [
        ("figure_3: {axes: {layer_count: [1, 2], thickness: [0.5 a], modulus: [105000, 420000]}}", "paper"),
        (
            "figure_3: {axes: {layer_count: [2, 5], thickness: [0.05 a, 1 a, 0.2], modulus: [0.5 Es, 300000]}}",
            "paper",
        ),
        (
            f"figure_7: {{coating: {{layer_count: 3, thickness: 0.5 a}}, axes: {{modulus: [0.25 Es], {THREE}}}}}",
            "paper",
        ),
        (f"figure_8: {{coating: {{layer_count: 2, thickness: 0.1}}, axes: {{modulus: [105000], {THREE}}}}}", "paper"),
        (
            "figure_6: {coating: {layer_count: 2}, axes: {thickness: [0.05 a, 0.1 a, 0.2 a], modulus: [105000, 2 Es], "
            "creepage: [{longitudinal: 0.001}]}}",
            "paper",
        ),
        (
            "g: {scene: {creepage: {longitudinal: 0.002, lateral: 0.001, spin: 0.01}}, "
            "axes: {tolerance.tangential: [1.0e-5, 1.0e-7]}}",
            "overview",
        ),
        (
            "figure_5: {coating: {layer_count: 0}, axes: {thickness: [1 a], modulus: [2 Es], "
            "creepage: [{longitudinal: 0.001}]}}",
            "paper",
        ),
        ("g: {axes: {creepage.longitudinal: [-2.0e-5, 0, 2.0e-5]}}", "overview"),
        ("g: {axes: {substrate.E: [1.0e+6, 2.0e+6, 3.0e+6, 4.0e+6]}}", "overview"),
    ],
)
def test_texts_are_whole_and_apart(tmp_path: Path, grid: str, kind: str) -> None:
    """Legends of Figure 3 and titles of Figures 5 to 10 ran into each other, and powers of ten into labels of axes."""
    figure = drawn(tmp_path, grid, kind)
    check_texts(figure)
    widths = [ax.get_window_extent().width for ax in figure.axes if ax.get_visible()]
    assert min(widths) > 1.4 * figure.dpi


def test_titles_of_a_low_map_are_whole(tmp_path: Path) -> None:
    """The layout was taken to be settled once numbers at axes stayed the same, while panels were still moving."""
    grid = "g: {cases: [{label: a coating of three layers on a rail as measured in March before}]}"
    check_texts(drawn(tmp_path, grid, "maps", "[400, 50]"))


def test_captions_of_many_layers_tell_how_their_moduli_go_on(tmp_path: Path) -> None:
    """Titles name that at the surface alone."""
    grid = f"figure_7: {{coating: {{layer_count: 3, thickness: 0.5 a}}, axes: {{modulus: [1.0e-3 Es, 2 Es], {THREE}}}}}"
    figure = drawn(tmp_path, grid, "paper")
    (caption,) = [text.get_text().replace("\n", " ") for text in figure.texts if text.get_gid() == "caption"]
    assert r"the $k$-th layer above the substrate has $m^k\,E_s$" in caption
    titles = [ax.get_title(loc="left") for ax in figure.axes]
    assert titles[0].startswith("(a) $E_1 = 1\\times10^{-9}\\,E_s$, $0.5\\,a$\n$\\xi_x = 0.001$")


@pytest.mark.parametrize("width", [1.0, 1.5, 2.5, 9.0])
def test_fitted_text_is_whole_and_narrow(width: float) -> None:
    parts = [rf"$E_{k} = {k}05000\,\mathrm{{MPa}}$," for k in range(1, 6)]
    text = " ".join(("(a)", *parts, r"$0.5\,a$"))
    with style():
        lines = fitted(text, width)
        assert " ".join(lines) == text
        assert len(lines) == {1.0: 7, 1.5: 5, 2.5: 3, 9.0: 1}[width]
        if width > 1.0:  # of which one number with its letter is wider
            assert width_of(lines, math=True) <= width


def test_figures_without_any_number_at_their_axes_are_laid_out(tmp_path: Path) -> None:
    """Where no case is solved."""
    grid = "g: {axes: {creepage: [{spin: 1}, {spin: 2}]}}"
    check_texts(drawn(tmp_path, grid, "maps", solve=lambda scenes: (Result(Status.ERROR, "none") for _ in scenes)))
