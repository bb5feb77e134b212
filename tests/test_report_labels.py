"""Words on figures: labels of a study letter for letter and within the page, values as the study wrote them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from synthetic import (
    CREEPAGES,
    SCENE,
    assemble,
    creepage_axis,
    grid_cases,
    make_grid,
    make_study,
    number_axis,
    synthetic_tree,
)

from rcstudy.cases import Axis, Grid
from rcstudy.report.labels import KEEP, literal, wrapped
from rcstudy.report.overview import QUANTITIES, case_maps, overview_figure
from rcstudy.report.style import style
from rcstudy.report.views import GridView, grids

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
    figure.draw_without_rendering()
    return "\n".join(text.get_text() for text in figure.findobj(Text))


@pytest.mark.parametrize("first", [True, False])
def test_dollars_of_labels_are_letters_everywhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, first: bool
) -> None:
    axes = (labelled(monkeypatch, DOLLARS), number_axis("load", [50.0, 100.0], "N"))
    with opened(tmp_path, make_grid("g", *(axes if first else axes[::-1]))) as grid, style():
        for figure in (overview_figure(grid), case_maps(grid)):
            assert figure is not None
            assert all(label.replace("$", r"\$") in texts(figure) for label in DOLLARS)


def test_dollars_of_a_label_in_a_caption_leave_its_mathematics(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    axes = (number_axis("load", [50.0, 100.0], "N"), number_axis("spin_point", [0.0, 0.5]))
    with opened(tmp_path, make_grid("g", *axes, labelled(monkeypatch, DOLLARS[1:]))) as grid, style():
        figure = overview_figure(grid)
        texts(figure)
    (caption,) = [t.get_text() for t in figure.texts if t.get_gid() == "caption"]
    assert r"creepage = two \$1 and \$2 coats" in caption.replace("\n", " ") and r"$\mu$ = 1" in caption


def test_lines_break_neither_inside_mathematics_nor_at_kept_spaces() -> None:
    text = rf"{literal('cost $5')} and $a = b + c$ with 100{KEEP}N or more"
    assert wrapped(text, 14) == [r"cost \$5 and", "$a = b + c$", "with 100 N or", "more"]
    assert wrapped("abcdefgh", 5) == ["abcde", "fgh"]


def test_forces_that_symmetry_makes_nil_have_no_panel(tmp_path: Path) -> None:
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
            assert (f"Nil in all cases: {symbol}." in texts(figure)) is not shown
