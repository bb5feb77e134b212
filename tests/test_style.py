"""How figures are written: the same whatever else is, and as Matplotlib and brute force do it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from rcstudy.report import layout
from rcstudy.report.style import _METADATA, DPI, FORMATS, _palette, map_colours, save, style


@pytest.fixture
def styled() -> Iterator[None]:
    with style():
        yield


def drawn() -> Figure:
    """A square panel in many colours beside one of lines, small."""
    figure, axes = layout.panels(1, 2, 1.2, width=2.0)
    axes[0, 0].imshow(np.arange(64).reshape(8, 8), cmap=map_colours())
    axes[0, 0].set(aspect="equal", title="$p/p_0$")
    axes[0, 1].loglog([1.0, 10.0, 1000.0], [3.0, 1.0, 2.0], marker="o")
    axes[0, 1].set(xlabel=r"$\xi_x$", ylabel="force (N)")
    return figure


@pytest.mark.usefixtures("styled")
def test_a_file_does_not_depend_on_the_formats_written_before_it(tmp_path: Path) -> None:
    for kind in FORMATS:
        save(drawn(), tmp_path, "alone", (kind,))
    for order in (FORMATS, FORMATS[::-1]):
        for path in save(drawn(), tmp_path, "among", order):
            assert path.read_bytes() == path.with_stem("alone").read_bytes(), order


@pytest.mark.usefixtures("styled")
@pytest.mark.parametrize("kind", [kind for kind in FORMATS if kind != "png"])
def test_vectors_are_as_matplotlib_saves_them(kind: str, tmp_path: Path) -> None:
    figure = drawn()
    (path,) = save(figure, tmp_path, "figure", (kind,))
    assert isinstance(figure.canvas, FigureCanvasAgg) and figure.dpi == DPI
    figure.savefig(tmp_path / "matplotlibs", format=kind, metadata=_METADATA[kind])
    assert path.read_bytes() == (tmp_path / "matplotlibs").read_bytes()
    assert path.stat().st_size > 5000


@pytest.mark.usefixtures("styled")
def test_every_pixel_has_the_nearest_colour_of_the_palette(tmp_path: Path) -> None:
    figure = drawn()
    (path,) = save(figure, tmp_path, "figure", ("png",))
    assert isinstance(figure.canvas, FigureCanvasAgg)
    figure.canvas.draw()
    before = np.asarray(figure.canvas.buffer_rgba())[..., :3]
    palette = _palette(before)
    found = np.asarray(Image.open(path).convert("RGB"))
    assert found.shape == before.shape == (round(1.2 * DPI), round(2.0 * DPI), 3)
    for row, expected in zip(found, before.astype(int), strict=True):
        away = ((expected[:, None] - palette) ** 2).sum(axis=2)
        np.testing.assert_array_equal(row, palette[np.argmin(away, axis=1)])


def test_threads_draw_in_turns_and_leave_the_users_settings() -> None:
    before = matplotlib.rcParams["svg.hashsalt"]

    def draw(first: float) -> str:
        time.sleep(first)
        with style():
            time.sleep(0.1)
            return str(matplotlib.rcParams["svg.hashsalt"])

    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(draw, (0.0, 0.05))) == ["rcstudy"] * 2
    assert matplotlib.rcParams["svg.hashsalt"] == before != "rcstudy"
