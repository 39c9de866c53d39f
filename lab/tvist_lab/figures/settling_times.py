"""Figure 15: what delay, stabilisation time, cycle time and overshoot mean, on a recorded motion."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tvist_lab.figures.recorded import Recorded
from tvist_lab.figures.style import (
    INK,
    LIMIT,
    MUTED,
    OF_SHAPED,
    OF_UNSHAPED,
    explain,
    legend,
    note,
    panels,
    tint,
    title,
)
from tvist_lab.metrics import NotMeasurableError
from tvist_lab.metrics.settling import REPEATABILITY, Settling, distance, settling

BEFORE, AFTER = 0.06, 0.15
"""Time shown before the stop of the unshaped reference and after the last of the marked times [s]."""
SYMBOLS = {
    "$E$": "distance of the tool from where it comes to rest",
    r"$t_b$, $t_b^*$": "stop of the reference and of the shaped one",
    r"$\Delta$": "delay",
    r"$t_\mathrm{enter}$": "first time below the limit",
    r"$t_\mathrm{cycle}$": "last time above it",
    r"$t_\mathrm{stb}$": "stabilisation time",
    r"$e_\mathrm{os}$": "overshoot",
}


def figure_15(name: str, unshaped: Recorded, shaped: Recorded) -> Figure:
    """Draw E of one motion around its stop, unshaped and shaped, with the times and the overshoot of the unshaped one.

    Where E never settles, its curves are drawn without these marks.

    Args:
        name: Name of the motion, used as the heading.
        unshaped: The motion without shaping.
        shaped: The same motion with shaping.

    Raises:
        NotMeasurableError: The attained position cannot be determined, because too little rest was recorded.
    """
    figure, (panel,) = panels(1, 3.9)
    title(panel, f"{name}: marks of the unshaped motion")
    stops = []
    for (recording, motion), style, label in (
        (unshaped, OF_UNSHAPED, "Unshaped"),
        (shaped, OF_SHAPED, "Shaped"),
    ):
        time = recording.time[motion.start : motion.end] - recording.time[motion.start]
        panel.plot(1e3 * time, 1e3 * distance(recording, motion), **style.line(1.4, label=label))
        stops.append(1e3 * (recording.time[motion.shaped_stop] - recording.time[motion.start]))
    limit = 1e3 * REPEATABILITY
    panel.axhline(limit, color=INK, linewidth=0.9, linestyle=LIMIT, label=f"Limit, {limit:g} mm")
    try:
        found: Settling | None = settling(*unshaped)
    except NotMeasurableError:
        found = None
    top = 1.7 * max(1e3 * found.overshoot if found else 0.0, 4.0 * limit)
    end = max(1e3 * found.cycle if found else 0.0, stops[1]) + 1e3 * AFTER
    panel.set(
        xlim=(min(stops[0], 1e3 * found.enter if found else stops[0]) - 1e3 * BEFORE, end),
        ylim=(0.0, top),
        xlabel="Time after the start of the reference (ms)",
        ylabel="Distance $E$ (mm)",
    )
    for stop, words, style in zip(stops, ("$t_b$", "$t_b^*$"), (OF_UNSHAPED, OF_SHAPED), strict=True):
        panel.axvline(stop, color=style.color, linewidth=0.9, linestyle=":")
        note(panel, words, (stop, 0.70 * top), xytext=(3, 0), textcoords="offset points", color=style.color)
    _span(panel, stops[0], stops[1], 0.64 * top, r"$\Delta$")
    if found is not None:
        _mark(panel, unshaped, found, top)
    legend(figure, panel)
    explain(figure, SYMBOLS)
    return figure


def _mark(panel: Axes, unshaped: Recorded, found: Settling, top: float) -> None:
    """Mark t_enter, t_cycle, t_stb and e_os."""
    enter, cycle = 1e3 * found.enter, 1e3 * found.cycle
    for moment, words, side in (
        (enter, r"$t_\mathrm{enter}$", "right"),
        (cycle, r"$t_\mathrm{cycle}$", "left"),
    ):
        panel.plot(
            [moment], [1e3 * REPEATABILITY], "o", color=INK, markersize=5.0, markerfacecolor="white", zorder=5
        )
        panel.plot([moment] * 2, [1e3 * REPEATABILITY, 0.93 * top], color=MUTED, linewidth=0.8, linestyle=":")
        away = -4 if side == "right" else 4
        note(
            panel,
            words,
            (moment, 0.94 * top),
            xytext=(away, 0),
            textcoords="offset points",
            ha=side,
            va="top",
        )
    _span(panel, enter, cycle, 0.84 * top, rf"$t_\mathrm{{stb}}$ = {1e3 * found.stabilisation:.0f} ms")
    recording, motion = unshaped
    E = 1e3 * distance(recording, motion)
    time = 1e3 * (recording.time[motion.start : motion.end] - recording.time[motion.start])
    late = np.flatnonzero(time >= enter)
    if not found.overshoot:
        return
    peak = late[int(np.argmax(E[late]))]
    arrow = {"arrowstyle": "<->", "color": INK, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    panel.annotate("", (time[peak], 0.0), (time[peak], E[peak]), arrowprops=arrow, zorder=5)
    words = rf"$e_\mathrm{{os}}$ = {1e3 * found.overshoot:.2f} mm"
    note(panel, words, (time[peak], E[peak]), xytext=(10, 0), textcoords="offset points", va="bottom")


def _span(panel: Axes, left: float, right: float, height: float, words: str) -> None:
    """An arrow over a span of time, with words over it."""
    arrow = {"arrowstyle": "<->", "color": INK, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    panel.annotate("", (left, height), (right, height), arrowprops=arrow, zorder=5)
    note(
        panel,
        words,
        (0.5 * (left + right), height),
        xytext=(0, 3),
        textcoords="offset points",
        ha="center",
        va="bottom",
        bbox={"boxstyle": "square,pad=0.1", "facecolor": tint(INK, 0.0), "edgecolor": "none"},
    )
