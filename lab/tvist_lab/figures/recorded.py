"""Figures 12 to 16: recorded motions, unshaped and shaped, and the paper's metrics explained on them."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from tvist_lab.figures.style import (
    ALPHA,
    FAINT,
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
from tvist_lab.metrics.motion import MotionRows
from tvist_lab.metrics.paper import REPEATABILITY, Residual, Settling, distance, residual, settling
from tvist_lab.metrics.vibration import amplitude, tool_acceleration
from tvist_lab.recordings import Floats, Recording

LEAD, REST = 0.1, 1.0  # time shown before the reference's start and after the shaped reference's stop [s]
POSITION_RANGE_MM = 0.15  # largest distance on the axis: five times the repeatability [mm]
SYMBOLS = {
    r"$\ddot q^*$": "acceleration of the shaped reference",
    "$E$": "distance of the tool from where it comes to rest",
} | OF_ALPHA
MODE = {
    "estimated_f_d": ("$f_d$", "damped frequency", "Hz", (5.0, 16.0), 5.0),
    "estimated_zeta": (r"$\zeta$", "damping ratio", "–", (0.1, 0.4), 0.1),
}
"""Columns of the shaper's mode: symbol, meaning, unit, smallest range of the axis, distance of its ticks."""

Recorded = tuple[Recording, MotionRows]
BEFORE_MS, AFTER_MS = 60.0, 150.0
"""Time shown in figure 15 before the unshaped reference's stop and after the last mark [ms]."""
STOPS = {"$t_b$, $t_b^*$": "stop of the reference and of the shaped one"}
OF_DISTANCE = {
    "$E$": "distance of the tool from where it comes to rest",
    **STOPS,
    r"$\Delta$": "delay",
    r"$t_\mathrm{enter}$": "first time below the limit",
    r"$t_\mathrm{cycle}$": "last time above it",
    r"$t_\mathrm{stb}$": "stabilisation time",
    r"$e_\mathrm{os}$": "overshoot",
}
BEFORE_STOP, AFTER_STOP = 0.1, 0.4
"""Time shown in figure 16 before the unshaped reference's stop and after the shaped one's [s]."""
NOISE_TIME = 0.2  # time at the end of the recorded rest from which the noise is found [s]
LOUD = 1.2  # ratio to the largest noise above which a peak belongs to a vibration [-]
DASHES = (0, (4, 2))
ARROW = {"arrowstyle": "<->", "color": INK, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
BOTH = {"Unshaped": (OF_UNSHAPED, "$t_b$"), "Shaped": (OF_SHAPED, "$t_b^*$")}
"""Style of each recording, and the symbol of its stop."""


def motion_figure(name: str, *recorded: Recorded) -> Figure:
    """Draw accelerations of the reference, E, |α| and, unless it is constant, the shaper's mode over time.

    `recorded` is one motion, or the same motion without and with shaping; time 0 is the start of the
    reference. Raises NotMeasurableError if too little rest was recorded.
    """
    styles = {"Unshaped": OF_UNSHAPED, "Shaped": OF_SHAPED} if len(recorded) > 1 else {"Recorded": OF_SHAPED}
    varying = [column for column in MODE if any(_varies(*one, column) for one in recorded)]
    heights = (1.25, 1.0, 1.25, *(0.85 for _ in varying))
    figure, axes = panels(len(heights), 8.6 * sum(heights) / 5.2, ratios=heights)
    accelerations, errors, alphas, *modes = axes
    for (recording, motion), (label, style) in zip(recorded, styles.items(), strict=True):
        start = recording.time[motion.start]
        ends = np.searchsorted(recording.time, (start - LEAD, recording.time[motion.shaped_stop] + REST))
        rows = slice(int(ends[0]), min(int(ends[1]) + 1, motion.end))
        time = recording.time[rows] - start
        how = style.line(1.1)
        # Dashes of equal curves would fill each other's gaps and look solid.
        for number, (qdd, _) in enumerate(_alike(recording["target_qdd"][rows])):
            accelerations.plot(time, qdd, label=None if number else label, **how)
        E = 1e3 * distance(recording, motion)
        errors.plot(recording.time[motion.start : motion.end] - start, E, **how)
        alphas.plot(time, amplitude(tool_acceleration(recording))[rows], **style.line(0.8))
        for panel, column in zip(modes, varying, strict=True):
            panel.plot(time, recording[column][rows], **style.line(1.5))
    _name_joints(accelerations, *recorded[0])
    title(accelerations, name)
    limit = 1e3 * REPEATABILITY
    dashed(errors, limit, color=FAINT, width=0.9)
    where = {"xycoords": ("axes fraction", "data"), "color": MUTED}
    note(errors, f"repeatability, {limit:g} mm", (0.0, limit), (3, 2), **where)
    accelerations.set_ylabel(r"$\ddot q^*$ (rad/s²)")
    errors.set(
        ylabel=r"$E$ (mm)", ylim=(0.0, POSITION_RANGE_MM), yticks=np.linspace(0.0, POSITION_RANGE_MM, 4)
    )
    alphas.set(ylabel=ALPHA, ylim=(0.0, None))
    symbols = dict(SYMBOLS)
    for panel, column in zip(modes, varying, strict=True):
        symbol, meaning, unit, (low, high), step = MODE[column]
        symbols[symbol] = meaning
        bottom, top = panel.get_ylim()
        panel.set(ylabel=f"Estimated {symbol} ({unit})", ylim=(min(bottom, low), max(top, high)))
        panel.yaxis.set_major_locator(MultipleLocator(step))
    latest = max(one.time[motion.shaped_stop] - one.time[motion.start] for one, motion in recorded)
    axes[-1].set(xlabel="Time (s)", xlim=(-LEAD, latest + REST))
    legend(figure, accelerations, symbols)
    return figure


def _varies(recording: Recording, motion: MotionRows, column: str) -> bool:
    """Whether a mode changes during a motion by more than 0.1 %."""
    values = recording[column][motion.start : motion.shaped_stop + 1]
    return bool(len(values) and np.any(np.ptp(values, axis=0) > 1e-3 * np.abs(values[0])))


def _name_joints(panel: Axes, recording: Recording, motion: MotionRows) -> None:
    """Label the accelerations with joint names; joints that move alike share a line and a label."""
    qdd = recording["target_qdd"][motion.start : motion.shaped_stop + 2]
    size = np.max(np.abs(qdd), axis=1)
    plateau = int(np.argmax(size > 0.98 * size.max()))
    time = recording.time[motion.start :] - recording.time[motion.start]
    at = float(time[plateau] + 0.05 * time[motion.shaped_stop - motion.start])
    for values, joints in _alike(qdd):
        words = ", ".join(rf"$\ddot q^*_{joint}$" for joint in joints)
        height = float(values[plateau])
        note(panel, words, (at, height), (0, -3 if height > 0 else 3), va="top" if height > 0.0 else "bottom")


def _alike(qdd: Floats) -> list[tuple[Floats, list[int]]]:
    """Return the distinct accelerations, shape (T,) [rad/s²], each with the joints that share it."""
    near = 0.02 * float(np.max(np.abs(qdd)))
    groups: list[tuple[Floats, list[int]]] = []
    for joint, values in enumerate(qdd.T):
        alike = (joints for other, joints in groups if np.max(np.abs(values - other)) <= near)
        joints = next(alike, None)
        if joints is None:
            groups.append((values, [joint]))
        else:
            joints.append(joint)
    return groups


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
    panel.set(xlim=(min(stops[0], *stops[2:3]) - BEFORE_MS, max(stops) + AFTER_MS), ylim=(0.0, top))
    panel.set(xlabel="Time after the start of the reference (ms)", ylabel="Distance $E$ (mm)")
    legend(figure, panel, OF_DISTANCE)
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
        panel.set(
            xlim=(stops[0] - BEFORE_STOP, stops[1] + AFTER_STOP), ylim=(0.0, 1.35 * max(values)), ylabel=ALPHA
        )
    axes[0].plot([], [], color=INK, linestyle=DASHES, label="Decay fitted to the peaks")
    axes[-1].set_xlabel("Time (s)")
    legend(figure, axes[0], OF_ALPHA | STOPS | {"RV": "residual vibration, |α| of the fit at the stop"})
    return figure


def _draw(panel: Axes, recorded: Recorded, style: Series, label: str) -> tuple[Residual, str]:
    """Draw one recording; return its residual vibration, and a remark unless that starts the drawn decay."""
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
