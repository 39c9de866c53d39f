"""Reduction of vibration and delay of each shaper of a sweep, in each of its settings."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from tvist_lab.figures.style import FAINT, SHAPED, THIRD, UNSHAPED, panels, title

COLORS = (SHAPED, UNSHAPED, THIRD, "#E69F00", "#CC79A7", "#56B4E9")
MARKERS = "osD^v<>P*"
"""Colours and markers of the shapers, in their order; they repeat at different lengths."""
IN_A_LINE = 4
"""Largest number of shapers in a line of the legend."""
EACH = 0.22
"""Height of a setting [inch]."""


def sweep_figure(entries: Sequence[dict[str, Any]], settings: Sequence[str]) -> Figure:
    """Draw the median of the reduction with a line down to its 5th percentile, and the median of the delay.

    Args:
        entries: Entries of `tvist_lab.sweep.summary.summary`.
        settings: Name of the setting of each entry.
    """
    names = list(dict.fromkeys(settings))
    shapers = list(dict.fromkeys(entry["shaper"] for entry in entries))
    height = 1.9 + EACH * (1.0 + 0.3 * len(shapers)) * len(names)
    figure, (less, late) = panels(2, 2.0 * height, share_x=False)
    for place, shaper in enumerate(shapers):
        color, marker = COLORS[place % len(COLORS)], MARKERS[place % len(MARKERS)]
        offset = 0.6 * ((place + 0.5) / len(shapers) - 0.5)
        mine = [(one, name) for one, name in zip(entries, settings, strict=True) if one["shaper"] == shaper]
        y = np.array([names.index(name) + offset for _, name in mine])
        median, p5, delay = (
            np.array([np.nan if one[key][share] is None else one[key][share] for one, _ in mine], dtype=float)
            for key, share in (
                ("reduction_percent", "median"),
                ("reduction_percent", "p5"),
                ("delay_ms", "median"),
            )
        )
        less.hlines(y, p5, median, color=color, linewidth=1.0)
        less.plot(p5, y, "|", color=color, markersize=5)
        less.plot(median, y, marker, color=color, markersize=4, label=shaper)
        late.plot(delay, y, marker, color=color, markersize=4, label=shaper, clip_on=False)
    less.axvline(0.0, color=FAINT, linewidth=0.8)
    for panel, words in (
        (less, "Reduction: median, line to 5th percentile"),
        (late, "Delay: median"),
    ):
        panel.set_yticks(range(len(names)), names, fontsize=7)
        panel.set_ylim(len(names) - 0.5, -0.5)
        title(panel, words)
    less.set(xlabel="Reduction (%)")
    late.set(xlabel="Delay (ms)")
    late.set_xlim(left=0.0)
    handles, labels = less.get_legend_handles_labels()
    columns = min(len(labels), IN_A_LINE)
    figure.legend(handles, labels, loc="outside upper right", ncols=columns, fontsize=8, frameon=False)
    return figure
