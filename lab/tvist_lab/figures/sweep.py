"""Reduction of vibration and delay of each shaper of a sweep, in each of its settings."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from tvist_lab.figures.style import FAINT, SERIES, legend, panels, title

EACH = 0.22
"""Height of a setting [inch]."""


def sweep_figure(entries: Sequence[dict[str, Any]], settings: Sequence[str]) -> Figure:
    """Draw the median of the reduction with a line down to its 5th percentile, and the median of the delay.

    Args:
        entries: Entries of `tvist_lab.studies.sweep.sweep.summary`.
        settings: Name of the setting of each entry.
    """
    names = list(dict.fromkeys(settings))
    shapers = list(dict.fromkeys(entry["shaper"] for entry in entries))
    height = 1.9 + EACH * (1.0 + 0.3 * len(shapers)) * len(names)
    figure, (less, late) = panels(2, 2.0 * height, share_x=False)
    for place, shaper in enumerate(shapers):
        style = SERIES[place % len(SERIES)]
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
        less.hlines(y, p5, median, color=style.color, linewidth=1.0)
        less.plot(p5, y, "|", color=style.color, markersize=5)
        less.plot(median, y, **style.points(), label=shaper)
        late.plot(delay, y, **style.points(), clip_on=False)
    less.axvline(0.0, color=FAINT, linewidth=0.8)
    for panel, words in (
        (less, "Reduction: median, line to 5th percentile"),
        (late, "Delay: median"),
    ):
        panel.set_yticks(range(len(names)), names, fontsize=8)
        panel.set_ylim(len(names) - 0.5, -0.5)
        title(panel, words)
    less.set(xlabel="Reduction (%)")
    late.set(xlabel="Delay (ms)")
    late.set_xlim(left=0.0)
    legend(figure, less)
    return figure
