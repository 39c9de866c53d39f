"""Style of the figures: colours for colour-blind readers, few lines, units on every axis."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

UNSHAPED = "#D55E00"
"""Vermilion (Okabe and Ito)."""
SHAPED = "#0072B2"
"""Blue."""
THIRD = "#009E73"
"""Bluish green."""
INK = "#333333"
"""Colour of text and axes."""
FAINT = "#8A8A8A"
"""Colour of limits and other auxiliary lines."""
MUTED = "#5A5A5A"
"""Colour of less important text."""
DPI = 150
"""Resolution of saved bitmaps [dpi]; 6.4 inches are 960 pixels."""
WIDTH = 6.4
"""Width of every figure [inch]."""


def panels(
    rows: int, height: float, *, share_x: bool = True, ratios: Sequence[float] | None = None
) -> tuple[Figure, list[Axes]]:
    """Create a figure of stacked panels in this style.

    Args:
        rows: Number of panels.
        height: Height of the figure [inch].
        share_x: Whether all panels share the lowest one's axis.
        ratios: Relative heights of the panels.
    """
    figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    grid: np.ndarray[Any, Any] = figure.subplots(rows, 1, sharex=share_x, squeeze=False, height_ratios=ratios)
    axes = [row[0] for row in grid]
    for panel in axes:
        _plain(panel)
    figure.align_ylabels(axes)
    return figure, axes


def _plain(panel: Axes) -> None:
    """Style a panel: open frame, faint grid."""
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        panel.spines[side].set_color(INK)
    panel.grid(visible=True, color="#E4E4E4", linewidth=0.6)
    panel.set_axisbelow(True)
    panel.tick_params(colors=INK, labelsize=8, length=3)
    panel.xaxis.label.set(color=INK, fontsize=9)
    panel.yaxis.label.set(color=INK, fontsize=9)


def title(panel: Axes, words: str) -> None:
    """Write a heading at a panel's upper left."""
    panel.set_title(words, loc="left", fontsize=9.5, color=INK, fontweight="bold")


def legend(figure: Figure, panel: Axes) -> None:
    """Draw one legend for the whole figure above its panels, with the entries of one panel."""
    handles, labels = panel.get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc="outside upper right",
        ncols=len(labels),
        fontsize=8.5,
        frameon=False,
        labelcolor=INK,
        handlelength=1.8,
    )


def note(panel: Axes, words: str, at: tuple[float, float], *, color: str = INK, **how: Any) -> None:
    """Write small text within a panel, at a point in data coordinates."""
    backing = {"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.8}
    panel.annotate(words, at, color=color, fontsize=8, bbox=backing, **how)


def save(figure: Figure, path: str | Path) -> Path:
    """Write a figure; the suffix determines the format, and missing folders are created.

    Returns:
        Path of the file.
    """
    file = Path(path)
    file.parent.mkdir(parents=True, exist_ok=True)
    # Without the date, equal figures give equal files.
    metadata = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    figure.savefig(file, dpi=DPI, metadata=metadata.get(file.suffix))
    return file
