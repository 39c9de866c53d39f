"""Figures 12 to 14: all recorded signals of a motion, unshaped and shaped."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from tvist_lab.figures.style import (
    ALPHA,
    FAINT,
    MUTED,
    OF_ALPHA,
    OF_SHAPED,
    OF_UNSHAPED,
    dashed,
    legend,
    note,
    panels,
    title,
)
from tvist_lab.metrics.motion import MotionRows
from tvist_lab.metrics.settling import REPEATABILITY, distance
from tvist_lab.metrics.vibration import amplitude, tool_acceleration
from tvist_lab.recordings import Floats, Recording

LEAD, REST = 0.1, 1.0  # time shown before the reference's start and after the shaped reference's stop [s]
POSITION_RANGE_MM = 0.15
"""Largest distance to the final position on the axis [mm]; five times the repeatability."""
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
    alphas.set_ylabel(ALPHA)
    alphas.set_ylim(bottom=0.0)
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
    """Return the distinct accelerations, shape (T,) [rad/s²], each with its joints."""
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
