"""Building blocks of figures: panels, series that colour-blind readers can tell apart, legends and notes.

Draw a figure within `with house_style():`, whose style sheet sets sizes and colours. Each colour has its own dashes
and marker. Dashed lines lie over solid ones, so that both show where they coincide; no data is transparent.
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
"""Colours of shaped, unshaped and a third series, as places in the style sheet's cycle."""
INK = "#1F2933"  # colour of text and axes
FAINT = "#8A8A8A"  # colour of limits and other auxiliary lines
MUTED = "#5B6670"  # colour of secondary text
LIMIT = (0, (4, 3))  # dashes of limits and other auxiliary lines
ALPHA = r"$|\alpha|$ (m/s²)"  # axis label for the tool's acceleration
OF_ALPHA = {r"$|\alpha|$": "acceleration of the tool, without gravity"}
USUAL = {"lines.linewidth": 1.4, "lines.markersize": 4.0, "font.size": 8.0}
"""Sizes of the default style, to which those in this package are relative [pt]."""
SHARED_LABEL_DISTANCE = 0.035  # share of the axis below which neighbouring points share a name [-]


class Series(NamedTuple):
    """Style of one curve among several."""

    cycled: str
    dashes: Any
    marker: str

    @property
    def color(self) -> str:
        """Colour in the present style sheet, as #rrggbb."""
        return to_hex(self.cycled)

    def line(self, width: float = USUAL["lines.linewidth"], **more: Any) -> dict[str, Any]:
        """Return the arguments of `plot` for a curve, with its width in the default style [pt]."""
        above = 2.0 if self.dashes == "-" else 2.5
        wide = width * _scale("lines.linewidth")
        return {"color": self.color, "linestyle": self.dashes, "linewidth": wide, "zorder": above, **more}

    def points(self, size: float = USUAL["lines.markersize"], **more: Any) -> dict[str, Any]:
        """Return the arguments of `plot` for points without a line, with their size in the default style [pt]."""
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
OF_SHAPED, OF_UNSHAPED, OF_THIRD = SERIES[:3]


def _scale(name: str) -> float:
    """Return the ratio of a size in the style sheet to the default [-]."""
    settings: Any = rcParams
    return float(settings[name]) / USUAL[name]


def tint(color: str, share: float = 0.2) -> str:
    """Mix a share of a colour with white, to fill areas without transparency."""
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
    """Create a figure as wide as the style sheet says; return it and its panels row by row.

    `height` is in inches in the default style; larger type makes the figure higher. With `share_x`, panels of
    a column share the lowest axis; with `share_y`, panels of a row share the leftmost; `ratios` are the
    heights of the rows.
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
    """Label logarithmic axes "x" or "y" in plain numbers: 1, 2, 5 per decade, or all digits within one."""
    for name in axes:
        axis = panel.xaxis if name == "x" else panel.yaxis
        axis.set_major_formatter(lambda value, _: f"{value:g}")
        axis.set_minor_formatter(_Digits())


class _Digits(Formatter):
    """Tick labels between powers of ten."""

    def __call__(self, x: float, pos: int | None = None) -> str:  # noqa: ARG002  the interface's
        low, high = (1.0, 1.0) if self.axis is None else self.axis.get_view_interval()
        short = low > 0.0 and high < 10.0 * low
        return f"{x:g}" if short or f"{x:e}"[0] in "25" else ""


def title(panel: Axes, words: str) -> None:
    """Write a panel's heading; for print it becomes part of the caption, and letters name several panels."""
    if not in_print.get():
        panel.set_title(words, wrap=True)
        return
    panel.set_label(words)
    several = headed(panel.figure)
    for letter, one in zip(ascii_lowercase, several if len(several) > 1 else (), strict=False):
        one.set_title(letter)


def legend(figure: Figure, panel: Axes, symbols: Mapping[str, str] | None = None) -> None:
    """Draw one legend above all panels with the entries of `panel`, and explain symbols below, see `explain`."""
    handles, labels = panel.get_legend_handles_labels()
    for columns in range(len(labels), 0, -1):
        box = figure.legend(handles, labels, loc="outside upper right", ncols=columns)
        if columns == 1 or box.get_window_extent().width <= 0.98 * figure.bbox.width:
            break
        box.remove()
    if symbols:
        explain(figure, symbols)


def explain(figure: Figure, symbols: Mapping[str, str]) -> None:
    """Explain the symbols on the axes below the panels; for print in the caption."""
    said = [f"{symbol}: {meaning}" for symbol, meaning in symbols.items()]
    if in_print.get():
        figure.set_label(". ".join(said))
    else:
        figure.supxlabel("\u2003 ".join(said), x=0.01, ha="left", color=MUTED, wrap=True)


def literal(words: str) -> str:
    """Escape words for matplotlib, such as a file name with $."""
    plain = words.replace("$", r"\$")
    return f" {plain}" if plain.startswith("_") else plain


def dashed(panel: Axes, height: float, *, color: str = INK, width: float = 0.8, **how: Any) -> None:
    """Draw a limit: a dashed line across a panel."""
    panel.axhline(height, color=color, linewidth=width, linestyle=LIMIT, **how)


def dotted(panel: Axes, at: float, *, color: str = FAINT, width: float = 0.9) -> None:
    """Draw a moment: a dotted vertical line through a panel."""
    panel.axvline(at, color=color, linewidth=width, linestyle=":")


def note(
    panel: Axes, words: str, at: tuple[float, float], offset: tuple[float, float] | None = None, **how: Any
) -> Text:
    """Write small text at a point in data coordinates, unless `xycoords` names others, with an offset [pt]."""
    backing = {"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.8}
    if offset is not None:
        how |= {"xytext": offset, "textcoords": "offset points"}
    return panel.annotate(words, at, **{"bbox": backing, "zorder": 6.0, "wrap": True, **how})


def remark(panel: Axes, words: str, at: tuple[float, float], **how: Any) -> Text:
    """Write small text at a place given as shares of a panel's width and height; see `note`."""
    return note(panel, words, at, xycoords="axes fraction", **how)


def name_over(
    panel: Axes, x: NDArray[np.float64], highest: NDArray[np.float64], names: Sequence[str]
) -> None:
    """Write names upwards from the highest point at each x, both of shape (N,); close names share a line."""
    near = SHARED_LABEL_DISTANCE * float(np.ptp(x))
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
