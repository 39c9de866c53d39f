"""Files of figures: their format, their resolution, and their width."""

import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text

from tvist_lab.figures.own_style import own
from tvist_lab.figures.print_style import for_print, is_below
from tvist_lab.figures.style import COLUMN, DPI, WIDTH, width

FORMATS = ("png", "pdf", "svg")
"""Formats of figures: one bitmap, two of lines."""
SMALLER = 0.8
"""Size of text and lines over one column, as a share of that over two [-]."""
LARGER = 1.4
"""Size of text and lines on slides, as a share of the usual one [-]."""
LOWER = 0.84
"""Height over one column, as a share of that over two [-]."""
STABLE = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
"""Metadata without the date and the program's version, so that equal figures give equal files."""
FONTS: Any = {"pdf.fonttype": 42, "svg.fonttype": "path", "svg.hashsalt": "tvist"}
"""TrueType in PDF, which journals ask for; outlines in SVG, which look the same without the font."""
STYLES = ("paper", "slides")
"""Styles besides the usual one: headings and explanations in a text beside the figure, and larger type."""


@dataclass(frozen=True)
class FigureFiles:
    """A folder for figures, and how they are written."""

    folder: Path
    format: str = "png"
    """One of `FORMATS`."""
    style: str = ""
    """One of `STYLES`, or empty for the usual one."""

    def write(self, figure: Figure, name: str) -> Path:
        """Write a figure; see `save`.

        Args:
            figure: The figure.
            name: Name of the file without its suffix.
        """
        return save(figure, self.folder / f"{name}.{self.format}", style=self.style)


def save(figure: Figure, path: str | Path, *, style: str = "") -> Path:
    """Write a figure; the suffix determines the format, and missing folders are created.

    Width and resolution are those of a style file, if one is used. In the style `paper`, what its headings and
    explanations said is written beside it, as NAME.txt.

    Args:
        figure: The figure. It is resized to that width, and its text with it.
        path: File to write.
        style: One of `STYLES`, or empty for the usual one.

    Returns:
        Path of the file.
    """
    file = Path(path)
    file.parent.mkdir(parents=True, exist_ok=True)
    # The label remembers that a figure has its style already, so that it can be written twice.
    if style == "paper":
        figure.set_label(str(figure.get_label()) or for_print(figure))
        file.with_suffix(".txt").write_text(f"{figure.get_label()}\n", encoding="utf-8")
    elif style == "slides" and not figure.get_label():
        figure.set_label(style)
        _scale(figure, LARGER)
        figure.set_size_inches(figure.get_figwidth(), LARGER**0.5 * figure.get_figheight())
    fit(figure, width())
    dpi = own().get("savefig.dpi", DPI)
    with mpl.rc_context(FONTS):
        figure.savefig(file, dpi=dpi, metadata=STABLE.get(file.suffix))
    return file


def fit(figure: Figure, wide: float) -> None:
    """Give a figure a width [inch], with text that remains readable and within its panel.

    A figure that has this width already keeps its size.
    """
    now, height = figure.get_size_inches()
    if abs(wide - now) > 1e-6:
        lower, smaller = (np.interp(wide, (COLUMN, WIDTH), (share, 1.0)) for share in (LOWER, SMALLER))
        figure.set_size_inches(wide, height * float(lower))
        if "font.size" not in own():  # else the reader's file says how large text is, whatever the width
            _scale(figure, float(smaller))
    for box in list(figure.legends):
        _narrow(figure, box)
    # Words that are still too long must not push the panels aside.
    notes = [text for panel in figure.axes for text in panel.texts]
    for text in notes:
        text.set_in_layout(False)
    figure.draw_without_rendering()
    for panel in figure.axes:
        _wrap_in(panel)
    for text in notes:
        text.set_in_layout(True)


def _scale(figure: Figure, factor: float) -> None:
    """Change the size of text, lines and markers by a factor."""
    for panel in figure.axes:
        for axis in (panel.xaxis, panel.yaxis):
            for which in ("major", "minor"):
                size = axis.get_tick_params(which=which).get("labelsize", 8.0)
                axis.set_tick_params(which=which, labelsize=factor * float(size))
    ticks = {id(label) for panel in figure.axes for label in _tick_labels(panel)}
    for text in figure.findobj(Text):
        if isinstance(text, Text) and id(text) not in ticks:
            text.set_fontsize(factor * float(text.get_fontsize()))
    for panel in figure.axes:
        for line in panel.findobj(Line2D):
            if isinstance(line, Line2D):
                line.set_linewidth(factor * line.get_linewidth())
                line.set_markersize(factor * line.get_markersize())


def _tick_labels(panel: Axes) -> Iterator[Text]:
    for axis in (panel.xaxis, panel.yaxis):
        for minor in (False, True):
            yield from axis.get_ticklabels(minor=minor)


def _narrow(figure: Figure, box: Legend) -> None:
    """Put a figure's legend into as many columns as there is room for."""
    texts = box.get_texts()
    room = 0.98 * figure.bbox.width
    entries = len(texts)
    if not entries:
        return
    for text in texts:
        _wrap(text, 0.9 * room, text.get_window_extent().width)
    for count in range(entries, 0, -1):
        if box.get_window_extent().width <= room or entries == 1:
            return
        size = texts[0].get_fontsize()
        handles = [handle for handle in box.legend_handles if handle is not None]
        labels = [text.get_text() for text in texts]
        above = not is_below(box)
        how: dict[str, Any] = {"fontsize": size, "labelcolor": texts[0].get_color()}
        how |= {
            name: getattr(box, name)
            for name in ("handlelength", "handletextpad", "columnspacing", "labelspacing")
        }
        box.remove()
        box = figure.legend(
            handles,
            labels,
            loc="outside upper right" if above else "outside lower left",
            ncols=max(count - 1, 1),
            frameon=False,
            **how,
        )
        texts = box.get_texts()


def _wrap_in(panel: Axes) -> None:
    """Break text that is longer than its panel."""
    wide, high = panel.bbox.width, panel.bbox.height
    for text in (child for child in panel.get_children() if isinstance(child, Text)):
        extent, room = text.get_window_extent(), 0.98 * wide
        if extent.x1 > panel.figure.bbox.width and text in panel.texts:
            room = min(room, panel.bbox.x1 - extent.x0)
        _wrap(text, room, extent.width)
    for label in (panel.xaxis.label, panel.yaxis.label):
        extent = label.get_window_extent()
        along = label is panel.xaxis.label
        _wrap(label, 1.1 * (wide if along else high), extent.width if along else extent.height)


def _wrap(text: Text, room: float, length: float) -> None:
    """Break text between words; a number stays with its unit."""
    words = text.get_text()
    if length <= room or room <= 0.0:
        return
    longest = max(len(line) for line in words.split("\n"))
    characters = max(int(longest * room / length), 8)
    lines = re.sub(r"(?<=\d) (?=[^\W\d]|%)| (?=\()", "\N{NO-BREAK SPACE}", words).split("\n")
    broken = [
        textwrap.fill(line, characters, break_long_words=False, break_on_hyphens=False) for line in lines
    ]
    text.set_text("\n".join(broken).replace("\N{NO-BREAK SPACE}", " "))
