"""Style of the figures: colours that colour-blind readers can distinguish, files that are equal from run to run."""

from __future__ import annotations

import logging
import re
import threading
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rcstudy.errors import UserError
from rcstudy.storage.publish import replacing

if TYPE_CHECKING:
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure

log = logging.getLogger("rcstudy")

DPI = 200
WIDTH = 7.2
"""Width of a figure in inches: both columns of a journal page."""

COLOURS = ("#000000", "#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#D55E00", "#CC79A7")
"""Okabe and Ito's colours (Color Universal Design, 2008)."""

BLACK, ORANGE, SKY, GREEN, _, BLUE, VERMILLION, PURPLE = COLOURS

LINES: tuple[dict[str, Any], ...] = (
    {"color": BLUE, "linestyle": "-", "marker": "o"},
    {"color": ORANGE, "linestyle": (0, (5, 1.5)), "marker": "s"},
    {"color": GREEN, "linestyle": (0, (3, 1, 1, 1)), "marker": "^"},
    {"color": VERMILLION, "linestyle": (0, (6, 1, 1, 1, 1, 1)), "marker": "D"},
    {"color": PURPLE, "linestyle": (0, (1, 1)), "marker": "v"},
    {"color": SKY, "linestyle": (0, (8, 2)), "marker": "P"},
    {"color": BLACK, "linestyle": (0, (2, 1)), "marker": "X"},
)
"""Lines that differ in colour, dash and marker: each of the three is enough to distinguish them."""

STYLE: Any = {
    "font.family": "DejaVu Sans",
    "mathtext.fontset": "dejavusans",
    "font.size": 7.5,
    "axes.titlesize": 7.5,
    "axes.labelsize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "lines.linewidth": 1.0,
    "lines.markersize": 2.6,
    "axes.grid": False,
    "axes.formatter.useoffset": False,
    "pdf.fonttype": 42,
    "svg.hashsalt": "rcstudy",
}

_METADATA: dict[str, dict[str, None]] = {
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    "svg": {"Date": None, "Creator": None},
}

FORMATS = ("png", *_METADATA)
_PASSES = 10  # of the layout, at most
_MOVED = 2e-3  # part of the figure's size by which its panels may still move in the last pass
_DRAWING = threading.RLock()


@contextmanager
def style() -> Iterator[None]:
    """Set Matplotlib's defaults and this style, whatever the user's settings, which are restored at the end.

    Threads take turns, as Matplotlib's settings are those of the process.
    """
    import matplotlib

    with _DRAWING, matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        with _missing_letters_told():
            yield


_LACKING = "(?s).*(missing from font|does not support .* natively)"  # warnings; the second kind before Matplotlib 3.11


@contextmanager
def _missing_letters_told() -> Iterator[None]:
    """Log one line if the font lacks letters, in place of Matplotlib's for every letter each time it is drawn."""
    in_mathematics: list[str] = []

    def kept(record: logging.LogRecord) -> bool:
        """Whether to pass on a message of Matplotlib's mathtext, which also draws words on a line with mathematics."""
        if "does not have a glyph" not in (message := record.getMessage()):
            return True
        in_mathematics.append(message)
        return False

    mathematics = logging.getLogger("matplotlib.mathtext")
    mathematics.addFilter(kept)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.filterwarnings("always", _LACKING)
            yield
    finally:
        mathematics.removeFilter(kept)
    others = [w for w in caught if not re.match(_LACKING, str(w.message))]
    if len(others) < len(caught) or in_mathematics:
        log.warning("labels have letters that the font of the figures lacks: they are drawn as boxes")
    for w in others:
        warnings.warn_explicit(w.message, w.category, w.filename, w.lineno)


def map_colours() -> Colormap:
    """Viridis from light to dark without its darkest quarter, so that black markers stay visible on it."""
    import matplotlib
    from matplotlib.colors import ListedColormap

    return ListedColormap(matplotlib.colormaps["viridis_r"](np.linspace(0.0, 0.75, 256)), name="map")


def check_formats(formats: Sequence[str]) -> None:
    """UserError unless every format is one that is written the same in every run."""
    unknown = [f or '""' for f in formats if f not in FORMATS]
    if unknown or not formats:
        raise UserError(f"figure format {', '.join(unknown) or '(none)'}: allowed are {', '.join(FORMATS)}")


def _laid_out(figure: Figure) -> tuple[list[str], np.ndarray]:
    """The numbers at all axes of the figure, and where these are, over its size."""
    shown = [ax for ax in figure.axes if ax.get_visible()]
    numbers = [label.get_text() for ax in shown for axis in (ax.xaxis, ax.yaxis) for label in axis.get_ticklabels()]
    return numbers, np.array([ax.get_position().bounds for ax in shown])


def save(figure: Figure, out: Path, stem: str, formats: Sequence[str]) -> list[Path]:
    """Write `figure` as out/stem.<format> without dates or versions, so that equal data give equal files.

    UserError when a file cannot be written.
    """
    engine = figure.get_layout_engine()
    assert engine is not None
    before: tuple[list[str], np.ndarray] | None = None
    for _ in range(_PASSES):
        # in the first pass square panels are not yet where the room for titles is computed from, nor have all axes the
        # numbers that room was made for: in panels of another size they may have more digits
        engine.execute(figure)
        found = _laid_out(figure)
        if before and found[0] == before[0] and np.allclose(found[1], before[1], rtol=0.0, atol=_MOVED):
            break
        before = found
    figure.set_layout_engine(None)  # placed once: the same in every format; with "none" each is drawn twice
    paths = []
    for kind in formats:
        path = out / f"{stem}.{kind}"
        drawn = BytesIO()  # not the file: on a full disk Matplotlib does not always raise OSError
        if kind == "png":
            _save_png(figure, drawn)
        else:
            figure.savefig(drawn, format=kind, dpi=DPI, metadata=_METADATA[kind])
        with replacing(path) as temporary:
            temporary.write_bytes(drawn.getvalue())
        paths.append(path)
    return paths


def _save_png(figure: Figure, file: BytesIO) -> None:
    """Write a PNG of 256 colours: a third of the size, and no difference to the eye."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    canvas = figure.canvas  # the one that the layout has measured the text with: not measured again
    assert isinstance(canvas, FigureCanvasAgg)
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[..., :3]
    palette = _palette(pixels)
    red, green, blue = np.moveaxis(pixels.astype(np.uint32), -1, 0)
    codes = red << 16 | green << 8 | blue
    number = np.zeros(1 << 24, np.uint8)  # of each colour in the palette
    number[codes] = 1
    shades = np.flatnonzero(number)
    colours = np.stack([shades >> 16, shades >> 8 & 255, shades & 255], axis=1).astype(np.float32)
    of_palette = palette.astype(np.float32)  # whole numbers below 2^24: exact
    distance = (of_palette**2).sum(axis=1) - 2 * colours @ of_palette.T  # and the colour's own, the same for all
    number[shades] = np.argmin(distance, axis=1)
    image = Image.frombytes("P", pixels.shape[1::-1], number[codes].tobytes())
    image.putpalette(palette.ravel().tolist())
    image.save(file, "PNG", optimize=True, dpi=(DPI, DPI))


def _palette(pixels: np.ndarray) -> np.ndarray:
    """White, the style's own colours, 128 of the map's, and the picture's commonest for the rest, [256, 3].

    The first three are fixed, so that small patches do not lose their colour to the many shades of text and edges.
    """
    from matplotlib.colors import to_rgb
    from PIL import Image

    of_style = [[255 * c for c in to_rgb(name)] for name in ("white", *COLOURS)]
    of_map = 255 * map_colours()(np.linspace(0.0, 1.0, 128))[:, :3]
    rest = 256 - len(of_style) - len(of_map)
    common = Image.fromarray(pixels.copy()).quantize(rest, method=Image.Quantize.MEDIANCUT).getpalette() or []
    return np.concatenate([np.round([*of_style, *of_map]).astype(int), np.reshape(common, (-1, 3))])
