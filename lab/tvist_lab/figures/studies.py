"""What studies show: medians over their axes, shapers beside each other, and every move as a point."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from tvist_lab.figures.style import (
    FAINT,
    MUTED,
    SERIES,
    SHAPED,
    decades,
    legend,
    note,
    panels,
    tint,
    title,
)
from tvist_lab.studies.robustness import ERRORS
from tvist_lab.study.measures import WORTH
from tvist_lab.study.work import Row
from tvist_lab.words import MANY

EACH = 0.22
"""Height of a setting of a sweep [inch]."""
LONG = 16
"""Number of letters from which on a name takes two lines."""
FLOOR = 1e-4
"""Smaller peaks are drawn at this value [m/s²]."""


def study_figure(summary: Sequence[dict[str, Any]], by: Sequence[str], show: Sequence[str]) -> Figure:
    """Draw medians, with a band from the 5th to the 95th percentile; of few rows, from the least to the most.

    They are lines with bands if the first axis is numeric, otherwise dots with bars.

    Args:
        summary: Entries of `tvist_lab.study.study.Study.summary`.
        by: Axes that they distinguish; the first is drawn to the right, the others are named with the method.
        show: Measures to draw.
    """
    figure, axes = panels(len(show), 2.6 * len(show))
    places = list(dict.fromkeys(_place(entry, by) for entry in summary))
    numbers = bool(by) and all(isinstance(place, int | float) for place in places)
    lines = list(dict.fromkeys(_line(entry, by) for entry in summary))
    for panel, name in zip(axes, show, strict=True):
        for number, line in enumerate(lines):
            style = SERIES[number % len(SERIES)]
            mine = [entry for entry in summary if _line(entry, by) == line]
            aside = 0.6 * ((number + 0.5) / len(lines) - 0.5)
            x = [_place(entry, by) if numbers else places.index(_place(entry, by)) + aside for entry in mine]
            few = "least" in mine[0][name]
            shares = ("least", "most", "least") if few else ("p5", "p95", "median")
            low, high, middle = (
                np.array([entry[name][share] for entry in mine], dtype=float) for share in shares
            )
            if numbers:
                panel.fill_between(x, low, high, color=tint(style.color), linewidth=0, zorder=1.0)
                panel.plot(x, middle, **style.line(1.4, marker=style.marker, markersize=3.0, label=line))
                if few:
                    panel.plot(x, high, **style.line(1.4, marker=style.marker, markersize=3.0))
            else:
                panel.vlines(x, low, high, color=style.color, linewidth=1.2)
                panel.plot(x, middle, **style.points(label=line))
                if few:
                    panel.plot(x, high, **style.points())
        title(panel, name)
    if not numbers:
        axes[-1].set_xticks(range(len(places)), [str(place) for place in places] if by else [""])
    axes[-1].set(xlabel=by[0] if by else "")
    legend(figure, axes[0])
    return figure


def _place(entry: dict[str, Any], by: Sequence[str]) -> Any:
    return entry[by[0]] if by else 0


def _line(entry: dict[str, Any], by: Sequence[str]) -> str:
    more = [f"{name} {entry[name]}" for name in (*by[1:], "arm") if name in entry]
    return ", ".join([entry["shaper"], *more])


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


def robustness_figure(rows: Sequence[dict[str, Any]]) -> Figure:
    """Draw the median of the reduction with a bar to its 5th percentile, each the worse of ± an error, by shaper.

    Args:
        rows: Rows of `robustness_report`, ordered by delay.
    """
    sizes = {kind: sorted({abs(error) for error in errors}) for kind, errors in ERRORS.items()}
    most = max(map(len, sizes.values()))
    figure, axes = panels(1, 1.6 + (0.1 + 0.1 * most) * len(rows), columns=2, share_y=True)
    for panel, (kind, errors) in zip(axes, ERRORS.items(), strict=True):
        for place, (size, style) in enumerate(zip(sizes[kind], SERIES, strict=False)):
            names = [f"{100.0 * error:+.0f} %" for error in errors if abs(error) == size]
            y = np.arange(len(rows)) + 0.7 * ((place + 0.5) / most - 0.5)
            median, p5 = (
                [min(_known(row[kind][error]["reduction_percent"][share]) for error in names) for row in rows]
                for share in ("median", "p5")
            )
            panel.hlines(y, p5, median, color=style.color, linewidth=1.0)
            panel.plot(median, y, **style.points(3.5, label=f"±{100.0 * size:.0f} %"))
        panel.set(xlabel="Reduction (%)", ylim=(len(rows) - 0.5, -0.5))
        panel.set_yticks(
            range(len(rows)), [f"{_label(row['name'])}, {row['delay_ms']:.0f} ms" for row in rows]
        )
        title(panel, f"Wrong {kind}")
    legend(figure, max(axes, key=lambda panel: len(panel.get_legend_handles_labels()[1])),
           {"dot": "median, the worse of ±", "bar": "to the 5th percentile"})  # fmt: skip
    return figure


def _label(name: str) -> str:
    """A shaper's name in two lines if it is long."""
    words = name.split("_")
    half = (len(words) + 1) // 2
    return name if len(name) < LONG else "_".join(words[:half]) + "_\n" + "_".join(words[half:])


def _known(value: float | None) -> float:
    return float("nan") if value is None else value


def residual_by_move_figure(rows: Sequence[Row]) -> Figure:
    """Peak |α| after the stop, shaped against unshaped, one point per row; and the distribution of the reductions."""
    reductions = np.sort([row["reduction_percent"] for row in rows if row["reduction_percent"] is not None])
    several = reductions.size >= MANY
    figure, (above, *rest) = panels(
        2 if several else 1,
        6.0 if several else 3.6,
        share_x=False,
        ratios=(3, 2) if several else None,
    )
    above.set(xscale="log", yscale="log")
    for counts, color, marker, label in (
        (True, SHAPED, "o", "Move"),
        (False, FAINT, "x", f"Below {WORTH:g} m/s² unshaped, not counted"),
    ):
        chosen = [row for row in rows if (row["reduction_percent"] is not None) is counts]
        before, after = ([max(peak, FLOOR) for peak in peaks] for peaks in (
            [row["unshaped_peak_m_s2"] for row in chosen], [row["shaped_peak_m_s2"] for row in chosen]
        ))  # fmt: skip
        if chosen:
            above.plot(before, after, marker, color=color, markersize=3.0, label=label)
    low, high = above.get_xlim()
    for share, words in ((1.0, "as unshaped"), (0.1, "−90 %"), (0.01, "−99 %")):
        above.plot([low, high], [share * low, share * high], color=FAINT, linewidth=0.8)
        note(above, words, (high, share * high), color=MUTED, ha="right", va="center")
    decades(above, "x", "y")
    above.set(xlabel="Peak unshaped (m/s²)", ylabel="Peak shaped (m/s²)", xlim=(low, high))
    title(above, "Peak acceleration of the tool after the stop")
    for below in rest:
        below.plot(reductions, 100.0 * (np.arange(reductions.size) + 0.5) / reductions.size, color=SHAPED)
        below.set(xlabel="Reduction (%)", ylabel="Moves with less (%)", ylim=(0, 100))
    legend(figure, above)
    return figure
