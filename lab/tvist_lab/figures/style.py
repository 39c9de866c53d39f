"""What figures are drawn with: series that differ to the colour-blind, and words that explain every axis.

A figure is drawn within `with house_style():`, whose style sheet has its sizes and colours. Each colour has
dashes and a marker of its own. Dashed lines are drawn over full ones, so that both are seen where they coincide,
and nothing that stands for data is transparent.
"""

from collections.abc import Mapping, Sequence
from string import ascii_lowercase
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import Formatter
from numpy.typing import NDArray

from tvist_lab.figures.sheets import headed, in_print

SHAPED, UNSHAPED, THIRD = "C0", "C1", "C2"
"""Colours of what is shaped, of what is not, and of a third series, as places in the style sheet's cycle."""
INK = "#1F2933"
"""Colour of text and axes."""
FAINT = "#8A8A8A"
"""Colour of limits and other auxiliary lines."""
MUTED = "#5B6670"
"""Colour of less important text."""
LIMIT = (0, (4, 3))
"""Dashes of limits and other auxiliary lines."""
ALPHA = r"$|\alpha|$ (m/s²)"
"""Label of the axis of the tool's acceleration."""
OF_ALPHA = {r"$|\alpha|$": "acceleration of the tool, without gravity"}
"""What its symbol means."""
USUAL = {"lines.linewidth": 1.4, "lines.markersize": 4.0, "font.size": 8.0}
"""Sizes of the usual style, to which those in this package are relative [pt]."""
NEAR = 0.035
"""Points that are closer than this share of the axis share a name [-]."""


class Series(NamedTuple):
    """How one of several curves is drawn."""

    cycled: str
    """Its colour, as a place in the style sheet's."""
    dashes: Any
    """Line style of matplotlib."""
    marker: str

    @property
    def color(self) -> str:
        """Its colour in the style sheet that is in use, as #rrggbb."""
        return to_hex(self.cycled)

    def line(self, width: float = USUAL["lines.linewidth"], **more: Any) -> dict[str, Any]:
        """Return the arguments of `plot` for a curve of this width in the usual style [pt]."""
        above = 2.0 if self.dashes == "-" else 2.5
        wide = width * _scale("lines.linewidth")
        return {"color": self.color, "linestyle": self.dashes, "linewidth": wide, "zorder": above, **more}

    def points(self, size: float = USUAL["lines.markersize"], **more: Any) -> dict[str, Any]:
        """Return the arguments of `plot` for points of this size in the usual style [pt], without a line."""
        large = size * _scale("lines.markersize")
        return {"color": self.color, "linestyle": "none", "marker": self.marker, "markersize": large, **more}


SERIES = (
    Series(SHAPED, "-", "o"),
    Series(UNSHAPED, (0, (5, 1.5)), "s"),
    Series(THIRD, (0, (1, 1)), "^"),
    Series("C3", (0, (6, 1.5, 1, 1.5)), "D"),
    Series("C4", (0, (9, 2)), "v"),
    Series("C5", (0, (3, 1, 1, 1, 1, 1)), "P"),
    Series("C6", (0, (2, 2)), "X"),
    Series("C7", (0, (8, 2, 3, 2)), "*"),
)
"""Styles of curves, in the order in which they are used."""
OF_SHAPED, OF_UNSHAPED, OF_THIRD = SERIES[:3]
"""Styles of what is shaped, of what is not, and of a third one."""


def _scale(name: str) -> float:
    """How much larger a size of the style sheet is than in the usual one [-]."""
    settings: Any = rcParams
    return float(settings[name]) / USUAL[name]


def tint(color: str, share: float = 0.2) -> str:
    """Mix a share of a colour with white, to fill areas without being transparent."""
    red, green, blue = (share * part + 1.0 - share for part in to_rgb(color))
    return to_hex((red, green, blue))


def panels(
    rows: int,
    height: float,
    *,
    columns: int = 1,
    share_x: bool = True,
    share_y: bool = False,
    ratios: Sequence[float] | None = None,
) -> tuple[Figure, list[Axes]]:
    """Create a figure of panels, as wide as the style sheet says.

    Args:
        rows: Number of rows.
        height: Height of the figure in the usual style [inch]; larger type makes it higher.
        columns: Number of panels side by side.
        share_x: Whether all panels of a column share the lowest one's axis.
        share_y: Whether all panels of a row share the leftmost one's axis.
        ratios: Relative heights of the rows.

    Returns:
        The figure, and its panels row by row.
    """
    size = rcParams["figure.figsize"][0], height * _scale("font.size") ** 0.5
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    shared: Any = {"sharex": "col" if share_x else False, "sharey": "row" if share_y else False}
    grid: Any = figure.subplots(rows, columns, squeeze=False, height_ratios=ratios, **shared)
    axes = list(grid.ravel())
    for panel in axes:
        for axis in (panel.xaxis, panel.yaxis):
            axis.label.set_wrap(True)
    if share_x:
        figure.align_ylabels(axes)
    return figure, axes


def decades(panel: Axes, *axes: str) -> None:
    """Label logarithmic axes, "x" or "y", in plain numbers: 1, 2, 5 of a decade, or all digits of a part."""
    for name in axes:
        axis = panel.xaxis if name == "x" else panel.yaxis
        axis.set_major_formatter(lambda value, _: f"{value:g}")
        axis.set_minor_formatter(_Digits())


class _Digits(Formatter):
    """Labels of the ticks between powers of ten."""

    def __call__(self, x: float, pos: int | None = None) -> str:  # noqa: ARG002  the interface's
        low, high = (1.0, 1.0) if self.axis is None else self.axis.get_view_interval()
        short = low > 0.0 and high < 10.0 * low
        return f"{x:g}" if short or f"{x:e}"[0] in "25" else ""


def title(panel: Axes, words: str) -> None:
    """Write a panel's heading; in print, it is for the caption, and letters name several panels."""
    if not in_print.get():
        panel.set_title(words, wrap=True)
        return
    panel.set_label(words)
    several = headed(panel.figure)
    for letter, one in zip(ascii_lowercase, several if len(several) > 1 else (), strict=False):
        one.set_title(letter)


def legend(figure: Figure, panel: Axes, symbols: Mapping[str, str] | None = None) -> None:
    """Draw one legend for the whole figure above its panels, with the entries of one panel.

    Args:
        figure: The figure.
        panel: The panel.
        symbols: Symbols to explain below the panels, see `explain`.
    """
    handles, labels = panel.get_legend_handles_labels()
    for columns in range(len(labels), 0, -1):
        box = figure.legend(handles, labels, loc="outside upper right", ncols=columns)
        if columns == 1 or box.get_window_extent().width <= 0.98 * figure.bbox.width:
            break
        box.remove()
    if symbols:
        explain(figure, symbols)


def explain(figure: Figure, symbols: Mapping[str, str]) -> None:
    """Write below the panels what the symbols on the axes mean; in print, it is for the caption."""
    said = [f"{symbol}: {meaning}" for symbol, meaning in symbols.items()]
    if in_print.get():
        figure.set_label(". ".join(said))
    else:
        figure.supxlabel("\u2003 ".join(said), x=0.01, ha="left", color=MUTED, wrap=True)


def literal(words: str) -> str:
    """Return words that matplotlib writes as they are, whatever a user called a file."""
    plain = words.replace("$", r"\$")
    return f" {plain}" if plain.startswith("_") else plain


def dashed(panel: Axes, height: float, *, color: str = INK, width: float = 0.8, **how: Any) -> None:
    """Draw a limit: a dashed line across a panel."""
    panel.axhline(height, color=color, linewidth=width, linestyle=LIMIT, **how)


def dotted(panel: Axes, at: float, *, color: str = FAINT, width: float = 0.9) -> None:
    """Draw a moment: a dotted line from the bottom to the top of a panel."""
    panel.axvline(at, color=color, linewidth=width, linestyle=":")


def note(
    panel: Axes,
    words: str,
    at: tuple[float, float],
    offset: tuple[float, float] | None = None,
    **how: Any,
) -> Text:
    """Write small text within a panel.

    Args:
        panel: The panel.
        words: The text.
        at: Point, in data coordinates unless `xycoords` names others.
        offset: Distance of the text from the point [pt].
        how: Further arguments of `annotate`.
    """
    backing = {"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.8}
    if offset is not None:
        how |= {"xytext": offset, "textcoords": "offset points"}
    return panel.annotate(words, at, **{"bbox": backing, "zorder": 6.0, "wrap": True, **how})


def remark(panel: Axes, words: str, at: tuple[float, float], **how: Any) -> Text:
    """Write small text at a place of a panel, as shares of its width and height; see `note`."""
    return note(panel, words, at, xycoords="axes fraction", **how)


def name_over(
    panel: Axes, x: NDArray[np.float64], highest: NDArray[np.float64], names: Sequence[str]
) -> None:
    """Write names upwards from the highest point at each place; names of places that are close share a line.

    Args:
        panel: The panel.
        x: Places, shape (N,).
        highest: Highest point at each place, shape (N,).
        names: N names.
    """
    near = NEAR * float(np.ptp(x))
    groups: list[list[int]] = []
    for place in map(int, np.argsort(x, kind="stable")):
        if groups and x[place] - x[groups[-1][0]] <= near:
            groups[-1].append(place)
        else:
            groups.append([place])
    for group in groups:
        words = ", ".join(names[place] for place in group)
        at = float(x[group].mean()), float(highest[group].max())
        note(panel, words, at, (0, 6), rotation=90, ha="center", va="bottom", bbox=None, wrap=False)
