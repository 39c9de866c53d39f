"""Figures of studies: medians over their axes, shapers side by side, and every move as a point."""

import math
from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tvist_lab.figures.style import (
    FAINT,
    INK,
    MUTED,
    OF_SHAPED,
    OF_UNSHAPED,
    SERIES,
    SHAPED,
    decades,
    legend,
    name_over,
    note,
    panels,
    tint,
    title,
)
from tvist_lab.phrases import QUANTILES_FROM
from tvist_lab.study.measures import WORTH
from tvist_lab.study.work import Row

EACH = 0.22
"""Height for each setting of a sweep [inch]."""
LONG_NAME = 16  # length from which a name takes two lines [letters]
FLOOR = 1e-4  # smaller peaks are drawn at this value [m/s²]
NOTICEABLE = 1.01  # largest ratio of peak to limit that counts as within, due to a filter's ripple [-]


def study_figure(
    summary: Sequence[dict[str, Any]], by: Sequence[str], show: Sequence[str], *, few: bool
) -> Figure:
    """Draw medians with a band from the 5th to the 95th percentile; with few rows, from minimum to maximum."""
    # If the first axis is numeric, draw lines with bands, else dots with bars. Names show the other axes
    # and the method.
    places = list(dict.fromkeys(entry[by[0]] if by else "" for entry in summary))
    lines: dict[str, list[dict[str, Any]]] = {}
    for entry in summary:
        more = [f"{name} {entry[name]}" for name in (*by[1:], "arm") if name in entry]
        lines.setdefault(", ".join([entry["shaper"], *more]), []).append(entry)
    numbers = bool(by) and all(isinstance(place, int | float) for place in places)
    shares = ("min", "min", "max") if few else ("p5", "median", "p95")
    figure, axes = panels(len(show), 2.6 * len(show))
    for panel, name in zip(axes, show, strict=True):
        keys = [f"{name}_{share}" for share in shares]
        title(panel, name)
        if not numbers:
            found = {
                line: {one[by[0]] if by else "": [one[key] for key in keys] for one in mine}
                for line, mine in lines.items()
            }
            rows = [(line, [one.get(each, [None] * 3) for each in places]) for line, one in found.items()]
            _dots(panel, list(map(str, places)), rows, both=few)
            continue
        for (line, mine), style in zip(lines.items(), cycle(SERIES), strict=False):
            low, middle, high = np.array([[one[key] for key in keys] for one in mine], dtype=float).T
            x = [one[by[0]] for one in mine]
            panel.fill_between(x, low, high, color=tint(style.color), linewidth=0, zorder=1.0)
            for y, label in ((middle, line), (high, None)) if few else ((middle, line),):
                panel.plot(x, y, **style.line(1.4, marker=style.marker, markersize=3.0, label=label))
    if numbers:
        axes[-1].set(xlabel=by[0])
    legend(figure, axes[0])
    return figure


def _dots(
    panel: Axes,
    names: Sequence[str],
    series: Sequence[tuple[str, Sequence[Sequence[float | None]]]],
    *,
    both: bool = False,
) -> None:
    """Draw values with bars, one line per name; each series has low, middle and high of every name."""
    for number, (label, values) in enumerate(series):
        style = SERIES[number % len(SERIES)]
        y = np.arange(len(names)) + 0.65 * ((number + 0.5) / len(series) - 0.5)
        low, middle, high = np.array(values, dtype=float).T
        panel.hlines(y, low, high, color=style.color, linewidth=1.0)
        panel.plot(middle, y, **style.points(3.5, label=label))
        if both:
            panel.plot(high, y, **style.points(3.5))
    panel.set_yticks(range(len(names)), names, fontsize=8)
    panel.set_ylim(len(names) - 0.5, -0.5)


def sweep_figure(entries: Sequence[dict[str, Any]], settings: Sequence[str]) -> Figure:
    """Draw the median reduction with a bar to its 5th percentile, and the median delay, for each setting."""
    names = list(dict.fromkeys(settings))
    shapers = list(dict.fromkeys(entry["shaper"] for entry in entries))
    height = 1.9 + EACH * (1.0 + 0.3 * len(shapers)) * len(names)
    figure, axes = panels(2, 2.0 * height, share_x=False)
    found = {(one["shaper"], name): one for one, name in zip(entries, settings, strict=True)}
    reduction = ("reduction_percent_p5", *["reduction_percent_median"] * 2)
    for panel, words, keys in (
        (axes[0], "Reduction: median, bar to 5th percentile", reduction),
        (axes[1], "Delay: median", ("delay_ms_median",) * 3),
    ):
        cells = {one: [found.get((one, name), {}) for name in names] for one in shapers}
        _dots(
            panel,
            names,
            [(one, [[cell.get(key) for key in keys] for cell in own]) for one, own in cells.items()],
        )
        title(panel, words)
    axes[0].axvline(0.0, color=FAINT, linewidth=0.8)
    axes[0].set(xlabel="Reduction (%)")
    axes[1].set(xlabel="Delay (ms)", xlim=(0.0, None))
    legend(figure, axes[0])
    return figure


def robustness_figure(
    cells: Mapping[str, Sequence[dict[str, Any]]], errors: Mapping[str, Sequence[float]]
) -> Figure:
    """Draw each shaper's reduction for each error size: median with a bar to the 5th percentile, worse sign.

    `cells` are entries by kind of error, ordered by delay; see `tvist_lab.studies.robustness`.
    """
    sizes = {kind: sorted({abs(error) for error in those}) for kind, those in errors.items()}
    every = {(kind, one["shaper"], one["error"]): one for kind, those in cells.items() for one in those}
    delays = {one["shaper"]: one["delay_ms_median"] for those in cells.values() for one in those}
    names = [f"{_label(name)}, {delay:.0f} ms" for name, delay in delays.items()]
    figure, axes = panels(
        1, 1.6 + (0.1 + 0.1 * max(map(len, sizes.values()))) * len(delays), columns=2, share_y=True
    )

    def worse(kind: str, shaper: str, size: float, share: str) -> float | None:
        found = [
            every[kind, shaper, f"{100.0 * sign * size + 0.0:+.0f} %"][f"reduction_percent_{share}"]
            for sign in (1, -1)
        ]
        return None if None in found else min(found)

    for panel, kind in zip(axes, errors, strict=True):
        shares = ("p5", "median", "median")
        rows = [
            (
                f"±{100.0 * size:.0f} %",
                [[worse(kind, one, size, share) for share in shares] for one in delays],
            )
            for size in sizes[kind]
        ]
        _dots(panel, names, rows)
        panel.set(xlabel="Reduction (%)")
        title(panel, f"Wrong {kind}")
    fullest = max(axes, key=lambda panel: len(panel.get_legend_handles_labels()[1]))
    legend(figure, fullest, {"dot": "median, the worse of ±", "bar": "to the 5th percentile"})
    return figure


def _label(name: str) -> str:
    """Break a long shaper name into two lines."""
    words = name.split("_")
    half = (len(words) + 1) // 2
    return name if len(name) < LONG_NAME else "_".join(words[:half]) + "_\n" + "_".join(words[half:])


def residual_by_move_figure(rows: Sequence[Row]) -> Figure:
    """Draw peak |α| after the stop, shaped against unshaped, by move, and the distribution of the reductions."""
    reductions = np.sort([row["reduction_percent"] for row in rows if row["reduction_percent"] is not None])
    several = reductions.size >= QUANTILES_FROM
    rows_of, height, ratios = (2, 6.0, (3, 2)) if several else (1, 3.6, None)
    figure, (above, *rest) = panels(rows_of, height, share_x=False, ratios=ratios)
    above.set(xscale="log", yscale="log")
    for counts, color, marker, label in (
        (True, SHAPED, "o", "Move"),
        (False, FAINT, "x", f"Below {WORTH:g} m/s² unshaped, not counted"),
    ):
        chosen = [row for row in rows if (row["reduction_percent"] is not None) is counts]
        if chosen:
            both = (
                [max(row[f"{kind}_peak_m_s2"], FLOOR) for row in chosen] for kind in ("unshaped", "shaped")
            )
            above.plot(*both, marker, color=color, markersize=3.0, label=label)
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


def pareto_figure(rows: Sequence[dict[str, Any]]) -> Figure:
    """Draw the medians of each ranked shaper over arms, moves and payload errors, and the Pareto front as a line."""
    # A triangle marks a shaper that exceeds a limit of the motion by more than 1 %, with its largest peak
    # over the limit.
    figure, (panel,) = panels(1, 4.6)
    panel.set_yscale("log")
    placed: list[tuple[float, float, bool]] = []
    for place, row in enumerate(sorted(rows, key=_point)):
        y, x = _point(row)
        excess = max(row[f"reference_{kind}_ratio_max"] for kind in ("acceleration", "velocity"))
        exceeds = excess > NOTICEABLE
        style = OF_UNSHAPED if exceeds else OF_SHAPED
        filled = style.color if row["pareto"] and not exceeds else "white"
        how: dict[str, Any] = {"color": style.color, "markersize": 5.5, "markerfacecolor": filled}
        panel.plot(x, y, "^" if exceeds else "o", **how)
        right = _beside(place, (x, y), [_point(other)[::-1] for other in rows])
        raised = any(
            abs(x - near) < 2.0 and abs(math.log(y / level)) < 0.1 and side == right
            for near, level, side in placed
        )
        placed.append((x, y, right))
        where: dict[str, Any] = {
            "xytext": (6 if right else -6, 9 if raised else 0),
            "ha": "left" if right else "right",
        }
        words = f"{row['shaper']} ({excess:.1f}×)" if exceeds else row["shaper"]
        note(panel, words, (x, y), textcoords="offset points", va="center", **where)
    front = sorted(_point(row)[::-1] for row in rows if row["pareto"])
    if front:
        panel.plot(*zip(*front, strict=True), color=FAINT, linewidth=1.0, zorder=0)
    panel.plot([], [], "o", color=OF_SHAPED.color, label="Keeps the limits within 1 %, and is on the front")
    panel.plot([], [], "o", color=OF_SHAPED.color, markerfacecolor="white", label="Keeps them")
    panel.plot([], [], "^", color=OF_UNSHAPED.color, markerfacecolor="white", label="Exceeds one (times)")
    decades(panel, "y")
    panel.set(xlabel="Still after the unshaped reference's stop (ms)", ylabel="Residual, 3 to 60 Hz (m/s²)")
    panel.margins(x=0.35)
    title(panel, "Settling against residual vibration")
    legend(figure, panel)
    return figure


def settling_figure(rows: Sequence[dict[str, Any]]) -> Figure:
    """Draw median and 90th percentile of the settling time against each shaper's delay."""
    # On the diagonal, the arm is at rest as soon as its shaped reference stops.
    figure, (panel,) = panels(1, 4.2)
    known = [row for row in rows if row["time_until_still_ms_median"] is not None]
    for place, row in enumerate(sorted(known, key=lambda row: float(row["declared_delay_ms_median"]))):
        x, still, high = row["declared_delay_ms_median"], row["time_until_still_ms_median"], _slowest(row)
        panel.plot([x, x], [still, high], color=FAINT, linewidth=1.0, zorder=1)
        panel.plot([x], [still], **OF_SHAPED.points(4.5, label="Median" if place == 0 else None))
        panel.plot([x], [high], **OF_UNSHAPED.points(3.0, label="90th percentile" if place == 0 else None))
    longest = max((float(row["declared_delay_ms_median"]) for row in known), default=1.0)
    diagonal: dict[str, Any] = {"color": INK, "linewidth": 0.9, "linestyle": ":"}
    panel.plot([0.0, longest], [0.0, longest], label="Still when the reference stops", **diagonal)
    panel.set(xlabel="Delay of the shaper (ms)", ylabel="Still after the unshaped stop (ms)")
    if known:
        ends = [(row["declared_delay_ms_median"], _slowest(row)) for row in known]
        delays, highest = np.array(ends, dtype=np.float64).T
        name_over(panel, delays, highest, [row["shaper"] for row in known])
        panel.set_ylim(0.0, 1.9 * float(highest.max()))
    panel.margins(x=0.06)
    legend(figure, panel)
    return figure


def _slowest(row: dict[str, Any]) -> float:
    """Return the 90th percentile of the settling time [ms]; if over a tenth never settle, the median."""
    slow = row["time_until_still_ms_p90"]
    return float(row["time_until_still_ms_median"] if slow is None else slow)


def _point(row: dict[str, Any]) -> tuple[float, float]:
    """Return residual vibration [m/s²] and settling time [ms]."""
    return row["residual_m_s2_median"], row["time_until_still_ms_median"]


def _beside(place: int, point: tuple[float, float], points: Sequence[tuple[float, float]]) -> bool:
    """Whether to write a name on the right of its point: away from a close neighbour, else alternately."""
    x, y = point
    away = [other - x for other, height in points if abs(math.log(y / height)) < 0.12]
    if any(0.0 < other < 45.0 for other in away):
        return False
    return place % 2 == 1 or any(-45.0 < other < 0.0 for other in away)
