"""Style of the figures: series that differ to the colour-blind, few lines, units on every axis.

Each colour has dashes and a marker of its own; for print they are exchanged for ones that differ in grey. Dashed lines
are drawn over full ones, so that both are seen where they coincide, and nothing that stands for data is transparent.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import Formatter
from numpy.typing import NDArray

from tvist_lab.figures.own_style import own

UNSHAPED = "#D55E00"
"""Vermilion (Okabe and Ito), of medium lightness."""
SHAPED = "#0072B2"
"""Blue (Okabe and Ito)."""
THIRD = "#009E73"
"""Bluish green (Okabe and Ito)."""
IN_PRINT = {SHAPED: "#0B4A85", THIRD: "#5FBF9A"}
"""Colours that a journal prints instead: a darker blue and a lighter green, which also differ in grey."""
INK = "#1F2933"
"""Colour of text and axes."""
FAINT = "#8A8A8A"
"""Colour of limits and other auxiliary lines."""
MUTED = "#5B6670"
"""Colour of less important text."""
WIDTH = 183.0 / 25.4
"""Width of every figure as it is drawn, two columns of a journal [inch]."""
COLUMN = 89.0 / 25.4
"""Width of one column [inch]."""
DPI = 150
"""Resolution of bitmaps unless a style file has another one [dots per inch]."""
LIMIT = (0, (4, 3))
"""Dashes of limits and other auxiliary lines."""
ALPHA = r"$|\alpha|$ (m/s²)"
"""Label of the axis of the tool's acceleration."""
OF_ALPHA = {r"$|\alpha|$": "acceleration of the tool, without gravity"}
"""What its symbol means."""
WIDTH_OF_LINES = 1.4
"""Width of curves [pt]."""
NEAR = 0.035
"""Points that are closer than this share of the axis share a name [-]."""


HOUSE = {
    "axes.spines.top": False, "axes.spines.right": False, "axes.edgecolor": INK, "axes.labelcolor": INK,
    "axes.axisbelow": True, "axes.titleweight": "bold", "axes.grid": True, "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "xtick.color": INK, "ytick.color": INK, "xtick.major.size": 3.0, "ytick.major.size": 3.0,
}  # fmt: skip
"""Matplotlib's settings of these figures, without the sizes of text."""


class Series(NamedTuple):
    """How one of several curves is drawn."""

    color: str
    dashes: Any
    """Line style of matplotlib."""
    marker: str

    def line(self, width: float = WIDTH_OF_LINES, **more: Any) -> dict[str, Any]:
        """Return the arguments of `plot` for a curve; dashed ones lie over full ones.

        Args:
            width: Width of the line [pt].
            more: Further arguments of `plot`.
        """
        above = 2.0 if self.dashes == "-" else 2.5
        width *= float(own().get("lines.linewidth", WIDTH_OF_LINES)) / WIDTH_OF_LINES
        return {"color": self.color, "linestyle": self.dashes, "linewidth": width, "zorder": above, **more}

    def points(self, size: float = 4.0, **more: Any) -> dict[str, Any]:
        """Return the arguments of `plot` for points without a line.

        Args:
            size: Size of the markers [pt].
            more: Further arguments of `plot`.
        """
        return {"color": self.color, "linestyle": "none", "marker": self.marker, "markersize": size, **more}


SERIES = (
    Series(SHAPED, "-", "o"),
    Series(UNSHAPED, (0, (5, 1.5)), "s"),
    Series(THIRD, (0, (1, 1)), "^"),
    Series(INK, (0, (6, 1.5, 1, 1.5)), "D"),
    Series("#CC79A7", (0, (9, 2)), "v"),
    Series("#E69F00", (0, (3, 1, 1, 1, 1, 1)), "P"),
    Series("#56B4E9", (0, (2, 2)), "X"),
    Series(FAINT, (0, (8, 2, 3, 2)), "*"),
)
"""Styles of curves, in the order in which they are used."""
OF_SHAPED, OF_UNSHAPED, OF_THIRD = SERIES[:3]
"""Styles of what is shaped, of what is not, and of a third one."""


def width() -> float:
    """Return the width of every figure as it is written [inch]: that of a style file, or two columns of a journal."""
    return float(own().get("figure.figsize", (WIDTH,))[0])


def rules() -> dict[str, Any]:
    """Return matplotlib's settings of these figures: the house's, unless a file of one's own has others."""
    base = float(own().get("font.size", 8.0))
    sizes = {"font.size": 1.0, "xtick.labelsize": 1.0, "ytick.labelsize": 1.0, "axes.labelsize": 9.0 / 8.0,
             "axes.titlesize": 9.5 / 8.0, "legend.fontsize": 8.5 / 8.0}  # fmt: skip
    return {**HOUSE, **{name: share * base for name, share in sizes.items()}, **own()}


def tint(color: str, share: float = 0.2) -> str:
    """Mix a colour with white, to fill areas without being transparent.

    Args:
        color: The colour, as #RRGGBB.
        share: Share of the colour [-].
    """
    parts = (int(color[place : place + 2], 16) for place in (1, 3, 5))
    return "#" + "".join(f"{round(share * part + (1.0 - share) * 255.0):02X}" for part in parts)


def panels(
    rows: int,
    height: float,
    *,
    columns: int = 1,
    share_x: bool = True,
    share_y: bool = False,
    ratios: Sequence[float] | None = None,
) -> tuple[Figure, list[Axes]]:
    """Create a figure of panels in this style.

    Args:
        rows: Number of rows.
        height: Height of the figure [inch].
        columns: Number of panels side by side.
        share_x: Whether all panels of a column share the lowest one's axis.
        share_y: Whether all panels of a row share the leftmost one's axis.
        ratios: Relative heights of the rows.

    Returns:
        The figure, and its panels row by row.
    """
    look: Any = rules()
    with mpl.rc_context(look):
        figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout="constrained")
        FigureCanvasAgg(figure)
        grid: np.ndarray[Any, Any] = figure.subplots(
            rows,
            columns,
            sharex="col" if share_x else False,
            sharey="row" if share_y else False,
            squeeze=False,
            height_ratios=ratios,
        )
    axes = list(grid.ravel())
    for panel in axes:
        _plain(panel, look)
    if share_x:
        figure.align_ylabels(axes)
    return figure, axes


def _plain(panel: Axes, look: Mapping[str, Any]) -> None:
    """Style grid and ticks of a panel, which matplotlib makes later: tick labels of one size on every scale."""
    panel.grid(visible=look["axes.grid"], **({"color": look["grid.color"], "linewidth": look["grid.linewidth"]}
                                             if look["axes.grid"] else {}))  # fmt: skip
    for axis in ("x", "y"):
        color, size, length = (look[f"{axis}tick.{name}"] for name in ("color", "labelsize", "major.size"))
        panel.tick_params(axis, which="both", colors=color, labelsize=size, length=length)


def decades(panel: Axes, *axes: str) -> None:
    """Label an axis with a logarithmic scale in plain numbers of one size: 1, 2 and 5 of each decade.

    If an axis is shorter than a decade, every digit is labelled.

    Args:
        panel: The panel, with its scale set.
        axes: "x" and "y", which of its axes to label.
    """
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
    """Write a heading at a panel's upper left."""
    look = rules()
    size, weight = look["axes.titlesize"], look["axes.titleweight"]
    panel.set_title(words, loc="left", fontsize=size, color=INK, fontweight=weight)


def legend(figure: Figure, panel: Axes, symbols: Mapping[str, str] | None = None) -> None:
    """Draw one legend for the whole figure above its panels, with the entries of one panel.

    Args:
        figure: The figure.
        panel: The panel.
        symbols: Symbols to explain below the panels, see `explain`.
    """
    handles, labels = panel.get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc="outside upper right",
        ncols=len(labels),
        fontsize=rules()["legend.fontsize"],
        frameon=False,
        labelcolor=INK,
        handlelength=2.4,
    )
    if symbols:
        explain(figure, symbols)


def legend_beside(panel: Axes, color: str | None = None) -> None:
    """Draw a panel's legend on its right."""
    panel.legend(
        loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=rules()["font.size"], frameon=False, labelcolor=color,
        handlelength=3.0,
    )  # fmt: skip


def color_bar(figure: Figure, drawn: Any, axes: Axes | Sequence[Axes], words: str, **how: Any) -> None:
    """Draw the scale of a coloured area beside its panels."""
    bar = figure.colorbar(drawn, ax=axes, **how)
    look = rules()
    bar.set_label(words, fontsize=look["axes.labelsize"], color=INK)
    bar.ax.tick_params(labelsize=look["ytick.labelsize"], colors=INK)


def explain(figure: Figure, symbols: Mapping[str, str]) -> None:
    """Write what the symbols on the axes mean below the panels.

    Args:
        figure: The figure.
        symbols: Symbol to its meaning.
    """
    figure.legend(
        [Line2D([], [], linestyle="none") for _ in symbols],
        [f"{symbol}: {meaning}" for symbol, meaning in symbols.items()],
        loc="outside lower left",
        ncols=len(symbols),
        fontsize=rules()["font.size"],
        frameon=False,
        labelcolor=MUTED,
        handlelength=0.0,
        handletextpad=0.0,
        columnspacing=1.6,
    )


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
    *,
    color: str = INK,
    **how: Any,
) -> Text:
    """Write small text within a panel.

    Args:
        panel: The panel.
        words: The text.
        at: Point, in data coordinates unless `xycoords` names others.
        offset: Distance of the text from the point [pt].
        color: Colour of the text.
        how: Further arguments of `annotate`.
    """
    backing = {"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.8}
    if offset is not None:
        how |= {"xytext": offset, "textcoords": "offset points"}
    return panel.annotate(
        words, at, **{"color": color, "fontsize": rules()["font.size"], "bbox": backing, "zorder": 6.0, **how}
    )


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
        note(panel, words, at, (0, 6), rotation=90, ha="center", va="bottom", bbox=None)
