"""Maps of the first mode over the workspace, as it is identified and as it is."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator

from tvist_lab.figures.style import INK, explain, note, panels, title
from tvist_lab.recordings import Floats
from tvist_lab.studies.workspace_map import WorkspaceMap

LABELS = {
    "f_d_hz": ("$f_d$", "damped frequency of the lowest mode", "Hz"),
    "zeta": (r"$\zeta$", "damping ratio of the lowest mode", "–"),
    "delay_ms": (r"$\Delta$", "delay of the shaper", "ms"),
}
"""Key of a map to its symbol, its meaning and its unit."""
LEVELS = 9
"""Largest number of levels of a map."""


def workspace_map_figure(found: WorkspaceMap, key: str, words: str, columns: int = 2) -> Figure:
    """Draw one quantity as identified, as it truly is, and the error.

    The three maps are side by side over two columns of a journal, and one below the other over one. White areas are
    left out, because the arm would touch itself or the floor there.

    Args:
        found: The maps.
        key: "f_d_hz", "zeta" or "delay_ms".
        words: What they are of, for the heading.
        columns: Columns of the journal.
    """
    symbol, meaning, unit = LABELS[key]
    figure, axes = (
        panels(1, 3.0, columns=3, share_x=False, share_y=True)
        if columns == 2
        else panels(3, 8.4, share_x=True)
    )
    both = np.array([found.identified[key], found.true[key]])
    levels = _levels(float(np.nanmin(both)), float(np.nanmax(both)))
    error = np.abs(found.error(key))
    for panel, values, heading in zip(axes, both, ("Identified", "True"), strict=False):
        drawn = _map(panel, found, values, levels)
        title(panel, heading)
    _bar(figure, drawn, list(axes[:2]), f"{symbol} ({unit})")
    drawn = _map(axes[2], found, error, _levels(0.0, float(np.nanmax(error))))
    title(axes[2], "Size of the error")
    _bar(figure, drawn, [axes[2]], "Error (%)")
    rows, across = (name.replace("_", " ").capitalize() for name in found.names)
    for panel in axes if columns == 2 else axes[-1:]:
        panel.set_xlabel(f"{across} (°)")
    for panel in axes if columns == 1 else axes[:1]:
        panel.set_ylabel(f"{rows} (°)")
    explain(figure, {symbol: f"{meaning}; {words}"})
    return figure


def _map(panel: Axes, found: WorkspaceMap, values: Floats, levels: Floats) -> QuadContourSet:
    """Filled contours, with lines between them that are labelled."""
    rows, across = (np.degrees(angles) for angles in found.angles)
    panel.grid(visible=False)
    drawn = panel.contourf(across, rows, values, levels=levels, cmap="cividis", extend="neither")
    inner = levels[1:-1]
    # White on the dark half of the colours, ink on the light one.
    colors = ["white" if place < 0.6 * len(inner) else INK for place in range(len(inner))]
    lines = panel.contour(across, rows, values, levels=inner, colors=colors, linewidths=0.7)
    panel.clabel(lines, list(inner[::2]), fmt=_short, fontsize=7)
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(MultipleLocator(60.0))
    if np.isnan(values).all():
        note(panel, "no free configuration", (0.5, 0.5), xycoords="axes fraction", ha="center")
    return drawn


def _levels(low: float, high: float) -> Floats:
    """Round levels that include a range."""
    return np.asarray(MaxNLocator(LEVELS).tick_values(low, max(high, low + 1e-3 * abs(low) + 1e-6)))


def _short(value: float) -> str:
    return f"{value:.3g}"


def _bar(figure: Figure, drawn: QuadContourSet, axes: list[Axes], words: str) -> None:
    bar = figure.colorbar(drawn, ax=axes, pad=0.02, aspect=25.0, format=lambda value, _: _short(value))
    bar.set_label(words, fontsize=9, color=INK)
    bar.ax.tick_params(labelsize=8, colors=INK)
