"""Figures 15 and 16: the paper's metrics, explained on recorded motions."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tvist_lab.figures.recorded import Recorded
from tvist_lab.figures.style import (
    ALPHA,
    INK,
    MUTED,
    OF_ALPHA,
    OF_SHAPED,
    OF_UNSHAPED,
    Series,
    dashed,
    dotted,
    legend,
    note,
    panels,
    remark,
    title,
)
from tvist_lab.metrics import NotMeasurableError
from tvist_lab.metrics.residual import Residual, residual
from tvist_lab.metrics.settling import REPEATABILITY, Settling, distance, settling
from tvist_lab.metrics.vibration import amplitude, tool_acceleration
from tvist_lab.recordings import Floats

BEFORE, AFTER = 60.0, 150.0
"""Time shown in figure 15 before the unshaped reference's stop and after the last mark [ms]."""
STOPS = {"$t_b$, $t_b^*$": "stop of the reference and of the shaped one"}
SYMBOLS = {
    "$E$": "distance of the tool from where it comes to rest",
    **STOPS,
    r"$\Delta$": "delay",
    r"$t_\mathrm{enter}$": "first time below the limit",
    r"$t_\mathrm{cycle}$": "last time above it",
    r"$t_\mathrm{stb}$": "stabilisation time",
    r"$e_\mathrm{os}$": "overshoot",
}
LEAD, TAIL = 0.1, 0.4
"""Time shown in figure 16 before the unshaped reference's stop and after the shaped one's [s]."""
NOISE_TIME = 0.2  # time at the end of the recorded rest from which the noise is found [s]
LOUD = 1.2
"""Ratio to the largest noise above which a peak belongs to a vibration [-]; a decay needs two such peaks."""
DASHES = (0, (4, 2))
ARROW = {"arrowstyle": "<->", "color": INK, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
BOTH = {"Unshaped": (OF_UNSHAPED, "$t_b$"), "Shaped": (OF_SHAPED, "$t_b^*$")}
"""Style of each recording, and the symbol of its stop."""


def figure_15(name: str, unshaped: Recorded, shaped: Recorded) -> Figure:
    """Draw E of one motion around its stop, unshaped and shaped, with the unshaped motion's times and overshoot.

    If E never settles, the marks are missing. Raises NotMeasurableError if too little rest was recorded.
    """
    figure, (panel,) = panels(1, 3.9)
    title(panel, f"{name}: marks of the unshaped motion")
    limit = 1e3 * REPEATABILITY
    try:
        found: Settling | None = settling(*unshaped)
    except NotMeasurableError:
        found = None
    top = 1.7 * max(1e3 * found.overshoot if found else 0.0, 4.0 * limit)
    stops = []
    for (recording, motion), (label, (style, words)) in zip((unshaped, shaped), BOTH.items(), strict=True):
        time = 1e3 * (recording.time[motion.start : motion.end] - recording.time[motion.start])
        panel.plot(time, 1e3 * distance(recording, motion), **style.line(label=label))
        stop = float(time[motion.shaped_stop - motion.start])
        dotted(panel, stop, color=style.color)
        note(panel, words, (stop, 0.70 * top), (3, 0), color=style.color)
        stops.append(stop)
    dashed(panel, limit, width=0.9, label=f"Limit, {limit:g} mm")
    _span(panel, stops, 0.64 * top, r"$\Delta$")
    if found is not None:
        _mark(panel, np.asarray(panel.get_lines()[0].get_xydata()), found, top)
        stops += [1e3 * found.enter, 1e3 * found.cycle]
    panel.set(xlim=(min(stops[0], *stops[2:3]) - BEFORE, max(stops) + AFTER), ylim=(0.0, top))
    panel.set(xlabel="Time after the start of the reference (ms)", ylabel="Distance $E$ (mm)")
    legend(figure, panel, SYMBOLS)
    return figure


def _mark(panel: Axes, curve: Floats, found: Settling, top: float) -> None:
    """Mark t_enter, t_cycle, t_stb and e_os on a curve of E [mm] over time [ms]."""
    limit, enter, cycle = 1e3 * REPEATABILITY, 1e3 * found.enter, 1e3 * found.cycle
    for moment, name, away, side in ((enter, "enter", -4, "right"), (cycle, "cycle", 4, "left")):
        panel.plot([moment], [limit], "o", color=INK, markersize=5.0, markerfacecolor="white", zorder=5)
        panel.plot([moment] * 2, [limit, 0.93 * top], color=MUTED, linewidth=0.8, linestyle=":")
        note(panel, rf"$t_\mathrm{{{name}}}$", (moment, 0.94 * top), (away, 0), ha=side, va="top")
    _span(panel, (enter, cycle), 0.84 * top, rf"$t_\mathrm{{stb}}$ = {1e3 * found.stabilisation:.0f} ms")
    if found.overshoot:
        late = curve[curve[:, 0] >= enter]
        time, peak = late[np.argmax(late[:, 1])]
        panel.annotate("", (time, 0.0), (time, peak), arrowprops=ARROW, zorder=5)
        words = rf"$e_\mathrm{{os}}$ = {1e3 * found.overshoot:.2f} mm"
        note(panel, words, (time, peak), (10, 0), va="bottom")


def _span(panel: Axes, ends: Sequence[float], height: float, words: str) -> None:
    panel.annotate("", (ends[0], height), (ends[1], height), arrowprops=ARROW, zorder=5)
    note(panel, words, (0.5 * (ends[0] + ends[1]), height), (0, 3), ha="center", va="bottom")


def figure_16(motions: Mapping[str, tuple[Recorded, Recorded]]) -> Figure:
    """Draw |α| around the stop of each motion, unshaped and shaped, with the decay fitted from t_b.

    Time 0 is the start of the reference. Raises NotMeasurableError if less than 0.3 s were recorded after a stop.
    """
    figure, axes = panels(len(motions), 0.6 + 2.0 * len(motions), share_x=False)
    for panel, (name, both) in zip(axes, motions.items(), strict=True):
        title(panel, name)
        stops, values = [], []
        for row, (recorded, (label, (style, symbol))) in enumerate(zip(both, BOTH.items(), strict=True)):
            rv, how = _draw(panel, recorded, style, label)
            recording, motion = recorded
            stop = rv.stop - recording.time[motion.start]
            dotted(panel, stop, color=style.color)
            panel.plot([stop], [rv.value], "D", color=style.color, markersize=4.5)
            at_top = {"xycoords": ("data", "axes fraction"), "va": "top", "color": style.color}
            note(panel, symbol, (stop, 1.0), (3, -2), **at_top)
            at_right = {"ha": "right", "va": "top", "color": style.color}
            remark(panel, f"RV {rv.value:.2f} m/s²{how}", (0.985, 0.95 - 0.14 * row), **at_right)
            stops.append(recording.time[motion.shaped_stop] - recording.time[motion.start])
            values.append(rv.value)
        panel.set(xlim=(stops[0] - LEAD, stops[1] + TAIL), ylim=(0.0, 1.35 * max(values)), ylabel=ALPHA)
    axes[0].plot([], [], color=INK, linestyle=DASHES, label="Decay fitted to the peaks")
    axes[-1].set_xlabel("Time (s)")
    meaning = "residual vibration, |α| of the fit at the stop"
    legend(figure, axes[0], OF_ALPHA | STOPS | {"RV": meaning})
    return figure


def _draw(panel: Axes, recorded: Recorded, style: Series, label: str) -> tuple[Residual, str]:
    """Draw one recording; return its residual vibration, and the method if it was not a drawn decay."""
    recording, motion = recorded
    start, rv = recording.time[motion.start], residual(recording, motion)
    alpha = amplitude(tool_acceleration(recording))
    rows = slice(motion.start, motion.end)
    panel.plot(recording.time[rows] - start, alpha[rows], **style.line(1.1, label=label))
    # At the end of the recorded rest, only the sensor's noise is left.
    quiet = int(np.searchsorted(recording.time, recording.time[motion.end - 1] - NOISE_TIME))
    noise = np.max(alpha[max(quiet, motion.shaped_stop + 1) : motion.end])
    if np.count_nonzero(rv.peaks > LOUD * noise) <= 1:
        return rv, ", fitted to noise" if rv.fitted else ", largest value"
    panel.plot(rv.peak_times - start, rv.peaks, **style.points(3.5, markerfacecolor="white", zorder=3))
    if not rv.fitted:
        return rv, ", largest value"
    time = np.linspace(rv.stop, rv.peak_times[-1], 100)
    panel.plot(time - start, rv.curve(time), color=style.color, linestyle=DASHES, zorder=3)
    return rv, ""
