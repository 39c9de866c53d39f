"""ShaperBench's figure: settling time of the arm against the residual vibration after the shaped stop."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from tvist_lab.figures.style import (
    FAINT,
    INK,
    OF_SHAPED,
    OF_UNSHAPED,
    decades,
    legend,
    name_over,
    note,
    panels,
    title,
)

NOTICEABLE = 1.01
"""Largest peak over its limit that still counts as keeping it [-]; a filter's own ripple stays below."""


def pareto_figure(rows: Sequence[dict[str, Any]]) -> Figure:
    """Draw the medians of each ranked shaper over arms, moves and payload errors, and the Pareto front as a line."""
    # A triangle marks a shaper that exceeds a limit of the motion by more than 1 %, with its largest peak
    # over the limit.
    figure, (panel,) = panels(1, 4.6)
    panel.set_yscale("log")
    placed: list[tuple[float, float, bool]] = []
    for place, row in enumerate(sorted(rows, key=_point)):
        y, x = _point(row)
        excess = _excess(row)
        exceeds = excess > NOTICEABLE
        best = row["pareto"]
        color, filled = (OF_UNSHAPED.color, "white") if exceeds else (OF_SHAPED.color, OF_SHAPED.color)
        panel.plot(
            x,
            y,
            "^" if exceeds else "o",
            color=color,
            markersize=5.5,
            markerfacecolor=filled if best or exceeds else "white",
        )
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
    panel.plot(
        [0.0, longest],
        [0.0, longest],
        color=INK,
        linewidth=0.9,
        linestyle=":",
        label="Still when the reference stops",
    )
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
    """Return the 90th percentile of the settling time [ms], or the median if over a tenth never settle."""
    slow = row["time_until_still_ms_p90"]
    return float(row["time_until_still_ms_median"] if slow is None else slow)


def _excess(row: dict[str, Any]) -> float:
    """Return the largest peak of acceleration or velocity over its limit [-]."""
    return max(float(row[f"reference_{kind}_ratio_max"]) for kind in ("acceleration", "velocity"))


def _point(row: dict[str, Any]) -> tuple[float, float]:
    """Return residual vibration [m/s²] and settling time [ms]."""
    return row["residual_m_s2_median"], row["time_until_still_ms_median"]


def _beside(place: int, point: tuple[float, float], points: Sequence[tuple[float, float]]) -> bool:
    """Whether to put a name on the right: away from a neighbour of similar height, else alternately."""
    x, y = point
    level = [other for other, height in points if abs(math.log(y / height)) < 0.12]
    if any(0.0 < other - x < 45.0 for other in level):
        return False
    if any(0.0 < x - other < 45.0 for other in level):
        return True
    return place % 2 == 1
