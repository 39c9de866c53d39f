"""Figures 15 and 16: what the paper's metrics mean, on recorded motions."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tvist_lab.figures.recorded import Recorded
from tvist_lab.figures.style import (
    ALPHA,
    INK,
    MUTED,
    OF_SHAPED,
    OF_UNSHAPED,
    Series,
    dashed,
    dotted,
    legend,
    note,
    panels,
    remark,
    tint,
    title,
)
from tvist_lab.metrics import NotMeasurableError
from tvist_lab.metrics.residual import Residual, residual
from tvist_lab.metrics.settling import REPEATABILITY, Settling, distance, settling
from tvist_lab.metrics.vibration import amplitude, tool_acceleration

BEFORE, AFTER = 0.06, 0.15
"""Time shown in figure 15 before the stop of the unshaped reference and after the last of the marked times [s]."""
SYMBOLS = {
    "$E$": "distance of the tool from where it comes to rest",
    r"$t_b$, $t_b^*$": "stop of the reference and of the shaped one",
    r"$\Delta$": "delay",
    r"$t_\mathrm{enter}$": "first time below the limit",
    r"$t_\mathrm{cycle}$": "last time above it",
    r"$t_\mathrm{stb}$": "stabilisation time",
    r"$e_\mathrm{os}$": "overshoot",
}
LEAD = 0.1
"""Time shown in figure 16 before the unshaped reference stops [s]."""
TAIL = 0.4
"""Time shown in figure 16 after the shaped reference stops [s]."""
QUIET = 0.2
"""Time at the end of the recorded rest that tells the noise [s]."""
LOUD = 1.2
"""Height over the largest noise from which a peak is one of a vibration [-]; a decay needs two of them."""
DASHES = (0, (4, 2))
"""Dash pattern of a fitted curve."""


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
    dashed(panel, limit, width=0.9, label=f"Limit, {limit:g} mm")
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
        dotted(panel, stop, color=style.color)
        note(panel, words, (stop, 0.70 * top), (3, 0), color=style.color)
    _span(panel, stops[0], stops[1], 0.64 * top, r"$\Delta$")
    if found is not None:
        _mark(panel, unshaped, found, top)
    legend(figure, panel, SYMBOLS)
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
        note(panel, words, (moment, 0.94 * top), (away, 0), ha=side, va="top")
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
    note(panel, words, (time[peak], E[peak]), (10, 0), va="bottom")


def _span(panel: Axes, left: float, right: float, height: float, words: str) -> None:
    """An arrow over a span of time, with words over it."""
    arrow = {"arrowstyle": "<->", "color": INK, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    panel.annotate("", (left, height), (right, height), arrowprops=arrow, zorder=5)
    note(
        panel,
        words,
        (0.5 * (left + right), height),
        (0, 3),
        ha="center",
        va="bottom",
        bbox={"boxstyle": "square,pad=0.1", "facecolor": tint(INK, 0.0), "edgecolor": "none"},
    )


def figure_16(motions: Mapping[str, tuple[Recorded, Recorded]]) -> Figure:
    """|α| around the stop of each motion, unshaped and shaped, with the fitted decay from t_b on.

    Time is zero when the reference starts.

    Args:
        motions: Name to the recording and motion without and with shaping.

    Raises:
        NotMeasurableError: Less than 0.3 s were recorded after a stop.
    """
    figure, axes = panels(len(motions), 0.6 + 2.0 * len(motions), share_x=False)
    for panel, (name, (unshaped, shaped)) in zip(axes, motions.items(), strict=True):
        title(panel, name)
        panel.set_ylabel(ALPHA)
        read = [
            _draw(panel, recorded, style, label)
            for recorded, style, label in ((unshaped, OF_UNSHAPED, "Unshaped"), (shaped, OF_SHAPED, "Shaped"))
        ]
        stops = [
            recording.time[m.shaped_stop] - recording.time[m.start] for recording, m in (unshaped, shaped)
        ]
        panel.set_xlim(stops[0] - LEAD, stops[1] + TAIL)
        panel.set_ylim(0.0, 1.35 * max(rv.value for rv, _ in read))
        for row, ((rv, stands_out), style) in enumerate(zip(read, (OF_UNSHAPED, OF_SHAPED), strict=True)):
            remark(
                panel,
                f"RV {rv.value:.2f} m/s²{_how(rv, stands_out=stands_out)}",
                (0.985, 0.95 - 0.14 * row),
                ha="right",
                va="top",
                color=style.color,
            )
    axes[0].plot([], [], color=INK, linewidth=1.4, linestyle=DASHES, label="Decay fitted to the peaks")
    axes[-1].set_xlabel("Time (s)")
    legend(
        figure,
        axes[0],
        {
            r"$|\alpha|$": "acceleration of the tool, without gravity",
            "$t_b$, $t_b^*$": "stop of the reference and of the shaped one",
            "RV": "residual vibration, |α| of the fit at the stop",
        },
    )
    return figure


def _draw(panel: Axes, recorded: Recorded, style: Series, label: str) -> tuple[Residual, bool]:
    """Draw one recording; return the residual vibration derived from it, and whether its decay is not just noise."""
    recording, motion = recorded
    color, start = style.color, recording.time[motion.start]
    rv = residual(recording, motion)
    alpha = amplitude(tool_acceleration(recording))
    rows = slice(motion.start, motion.end)
    panel.plot(recording.time[rows] - start, alpha[rows], **style.line(1.1, label=label))
    stands_out = bool(np.count_nonzero(rv.peaks > LOUD * np.max(alpha[_rest(recorded)])) > 1)
    if stands_out:
        panel.plot(rv.peak_times - start, rv.peaks, **style.points(3.5, markerfacecolor="white", zorder=3))
    if rv.fitted and stands_out:
        time = np.linspace(rv.stop, rv.peak_times[-1], 100)
        panel.plot(time - start, rv.curve(time), color=color, linewidth=1.4, linestyle=DASHES, zorder=3)
    dotted(panel, rv.stop - start, color=color)
    panel.plot([rv.stop - start], [rv.value], "D", color=color, markersize=4.5)
    note(
        panel,
        "$t_b$" if style is OF_UNSHAPED else "$t_b^*$",
        (rv.stop - start, 1.0),
        (3, -2),
        xycoords=("data", "axes fraction"),
        va="top",
        color=color,
    )
    return rv, stands_out


def _rest(recorded: Recorded) -> slice:
    """Rows at the end of the recorded rest, when nothing but the sensor's noise is left."""
    recording, motion = recorded
    first = int(np.searchsorted(recording.time, recording.time[motion.end - 1] - QUIET))
    return slice(max(first, motion.shaped_stop + 1), motion.end)


def _how(rv: Residual, *, stands_out: bool) -> str:
    """How the value was found, where it is not from a decay that is drawn."""
    if not rv.fitted:
        return ", largest value"
    return "" if stands_out else ", fitted to noise"
