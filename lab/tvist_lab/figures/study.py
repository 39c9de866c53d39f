"""What a study of one's own shows: each measure over its first axis, a line for each method."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from tvist_lab.figures.style import SERIES, legend, panels, title


def study_figure(summary: Sequence[dict[str, Any]], by: Sequence[str], show: Sequence[str]) -> Figure:
    """Draw medians, with a band from the 5th to the 95th percentile.

    Args:
        summary: Entries of `tvist_lab.study.study.Study.summary`.
        by: Axes that they distinguish; the first is drawn to the right, the others are named with the method.
        show: Measures to draw.
    """
    figure, axes = panels(len(show), 2.6 * len(show))
    places = list(dict.fromkeys(_place(entry, by) for entry in summary))
    numbers = all(isinstance(place, int | float) for place in places)
    lines = list(dict.fromkeys(_line(entry, by) for entry in summary))
    for panel, name in zip(axes, show, strict=True):
        for number, line in enumerate(lines):
            style = SERIES[number % len(SERIES)]
            mine = [entry for entry in summary if _line(entry, by) == line]
            x = [_place(entry, by) if numbers else places.index(_place(entry, by)) for entry in mine]
            median, low, high = (
                np.array([entry[name][share] for entry in mine], dtype=float)
                for share in ("median", "p5", "p95")
            )
            panel.plot(x, median, **style.line(1.4, marker=style.marker, markersize=3.0), label=line)
            panel.fill_between(x, low, high, color=style.color, alpha=0.15, linewidth=0)
        title(panel, name)
    if not numbers:
        axes[-1].set_xticks(range(len(places)), [str(place) for place in places])
    axes[-1].set(xlabel=by[0] if by else "")
    legend(figure, axes[0])
    return figure


def _place(entry: dict[str, Any], by: Sequence[str]) -> Any:
    return entry[by[0]] if by else 0


def _line(entry: dict[str, Any], by: Sequence[str]) -> str:
    more = [f"{name} {entry[name]}" for name in (*by[1:], "arm") if name in entry]
    return ", ".join([entry["shaper"], *more])
