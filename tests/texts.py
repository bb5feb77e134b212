"""Texts of figures: which there are, and whether they are within the figure and apart."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from matplotlib.figure import Figure
from matplotlib.text import Text


def texts_of(figure: Figure) -> Iterator[Text]:
    """All texts that are drawn: titles, numbers and labels of axes, legends, remarks, caption."""
    yield from figure.texts
    legends = [*figure.legends, *(ax.get_legend() for ax in figure.axes if ax.get_legend())]
    yield from itertools.chain.from_iterable(legend.get_texts() for legend in legends)
    for ax in (ax for ax in figure.axes if ax.get_visible()):
        yield from (ax.title, ax._left_title, *ax.texts)  # type: ignore[attr-defined]
        for axis, (low, high) in ((ax.xaxis, sorted(ax.get_xlim())), (ax.yaxis, sorted(ax.get_ylim()))):
            yield from (axis.label, axis.get_offset_text())
            yield from (tick.label1 for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high)


def check_texts(figure: Figure) -> None:
    """Assert that all texts are within the figure, to a hundredth of an inch, and none over another."""
    figure.canvas.draw()
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts_of(figure) if text.get_text().strip()]
    near = 0.01 * figure.dpi
    for words, box in boxes:
        inside = min(box.x0, box.y0, figure.bbox.width - box.x1, figure.bbox.height - box.y1)
        assert inside > -near, (words, box)
    for (words, one), (others, other) in itertools.combinations(boxes, 2):
        across = min(one.x1, other.x1) - max(one.x0, other.x0)
        along = min(one.y1, other.y1) - max(one.y0, other.y0)
        assert not (across > near and along > 3 * near), (words, others)
