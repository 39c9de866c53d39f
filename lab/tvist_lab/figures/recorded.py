"""Figures 12 to 14: everything recorded of a motion, unshaped and shaped on one clock."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from tvist_lab.figures.style import (
    ALPHA,
    FAINT,
    MUTED,
    OF_SHAPED,
    OF_UNSHAPED,
    Series,
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

LEAD = 0.1
"""Time shown before the reference starts [s]."""
REST = 1.0
"""Time shown after the shaped reference has stopped [s]."""
NEAR = 0.15
"""Largest distance to the attained position on the axis [mm]; five times the repeatability."""
SYMBOLS = {
    r"$\ddot q^*$": "acceleration of the shaped reference",
    "$E$": "distance of the tool from where it comes to rest",
    r"$|\alpha|$": "acceleration of the tool, without gravity",
}
"""What the symbols on the axes mean."""


MODE = {
    "estimated_f_d": ("$f_d$", "damped frequency", "Hz", (5.0, 16.0), 5.0),
    "estimated_zeta": (r"$\zeta$", "damping ratio", "–", (0.1, 0.4), 0.1),
}
"""Columns of the shaper's mode: symbol, meaning, unit, what the axis shows at least, and the distance of its ticks."""

Recorded = tuple[Recording, MotionRows]
"""A recording and one of its motions."""


def motion_figure(name: str, unshaped: Recorded, shaped: Recorded) -> Figure:
    """Accelerations of the reference, E, |α|, and the mode that the shaper uses, against time.

    Time is zero when the reference starts.

    Args:
        name: Name of the motion, used as the heading.
        unshaped: The motion without shaping.
        shaped: Recording of the same motion with shaping.

    Raises:
        NotMeasurableError: The attained position cannot be determined, because too little rest was recorded.
    """
    return _figure(name, ((unshaped, OF_UNSHAPED, "Unshaped"), (shaped, OF_SHAPED, "Shaped")))


def observed_figure(name: str, recorded: Recorded) -> Figure:
    """Draw the same panels for one motion of any recording.

    Args:
        name: Name of the motion, used as the heading.
        recorded: The motion.

    Raises:
        NotMeasurableError: The attained position cannot be determined, because too little rest was recorded.
    """
    return _figure(name, ((recorded, OF_SHAPED, "Recorded"),))


def _figure(name: str, drawn: Sequence[tuple[Recorded, Series, str]]) -> Figure:
    """Draw the panels from recordings with their styles and names; a mode that is constant has none."""
    shown = [column for column in MODE if _varies([recorded for recorded, _, _ in drawn], column)]
    heights = (1.25, 1.0, 1.25, *(0.85 for _ in shown))
    figure, axes = panels(len(heights), 8.6 * sum(heights) / 5.2, ratios=heights)
    for recorded, style, label in drawn:
        _draw(axes, recorded, style, label, shown)
    accelerations, errors, alphas, *modes = axes
    _name_joints(accelerations, drawn[0][0])
    title(accelerations, name)
    dashed(errors, 1e3 * REPEATABILITY, color=FAINT, width=0.9)
    note(
        errors,
        f"repeatability, {1e3 * REPEATABILITY:g} mm",
        (0.0, 1e3 * REPEATABILITY),
        (3, 2),
        xycoords=("axes fraction", "data"),
        color=MUTED,
    )
    accelerations.set_ylabel(r"$\ddot q^*$ (rad/s²)")
    errors.set(ylabel=r"$E$ (mm)", ylim=(0.0, NEAR), yticks=np.linspace(0.0, NEAR, 4))
    alphas.set_ylabel(ALPHA)
    alphas.set_ylim(bottom=0.0)
    symbols = dict(SYMBOLS)
    for panel, column in zip(modes, shown, strict=True):
        symbol, meaning, unit, (low, high), step = MODE[column]
        symbols[symbol] = meaning
        bottom, top = panel.get_ylim()
        panel.set(ylabel=f"Estimated {symbol} ({unit})", ylim=(min(bottom, low), max(top, high)))
        panel.yaxis.set_major_locator(MultipleLocator(step))
    ends = [recording.time[m.shaped_stop] - recording.time[m.start] for (recording, m), _, _ in drawn]
    axes[-1].set(xlabel="Time (s)", xlim=(-LEAD, max(ends) + REST))
    legend(figure, accelerations, symbols)
    return figure


def _varies(drawn: Sequence[Recorded], column: str) -> bool:
    """Whether a mode changes during a motion, by more than a part in a thousand."""
    return any(
        np.any(np.ptp(values, axis=0) > 1e-3 * np.abs(values[0]))
        for recording, motion in drawn
        if len(values := recording[column][motion.start : motion.shaped_stop + 1])
    )


def _draw(axes: Sequence[Axes], recorded: Recorded, style: Series, label: str, shown: Sequence[str]) -> None:
    """Draw one recording into the panels."""
    recording, motion = recorded
    start = recording.time[motion.start]
    first = int(np.searchsorted(recording.time, start - LEAD))
    past = min(
        int(np.searchsorted(recording.time, recording.time[motion.shaped_stop] + REST)) + 1, motion.end
    )
    rows = slice(first, past)
    time = recording.time[rows] - start
    accelerations, errors, alphas, *modes = axes
    how = style.line(1.1)
    # Dashes of equal curves would fill each other's gaps.
    for number, (qdd, _) in enumerate(_alike(recording["target_qdd"][rows])):
        accelerations.plot(time, qdd, label=label if number == 0 else None, **how)
    E = distance(recording, motion)
    errors.plot(recording.time[motion.start : motion.end] - start, 1e3 * E, **how)
    alphas.plot(time, amplitude(tool_acceleration(recording))[rows], **{**how, "linewidth": 0.8})
    for panel, column in zip(modes, shown, strict=True):
        for values in recording[column][rows].T:
            panel.plot(time, values, **{**how, "linewidth": 1.5})


def _name_joints(panel: Axes, recorded: Recorded) -> None:
    """Write names of joints beside their accelerations; joints that move alike share a line and its label."""
    recording, motion = recorded
    qdd = recording["target_qdd"][motion.start : motion.shaped_stop + 2]
    largest = float(np.max(np.abs(qdd)))
    groups = _alike(qdd)
    plateau = int(np.argmax(np.max(np.abs(qdd), axis=1) > 0.98 * largest))
    length = float(recording.time[motion.shaped_stop] - recording.time[motion.start])
    at = float(recording.time[motion.start + plateau] - recording.time[motion.start]) + 0.05 * length
    for values, joints in groups:
        words = ", ".join(rf"$\ddot q^*_{joint}$" for joint in joints)
        height = float(values[plateau])
        note(panel, words, (at, height), (0, -3 if height > 0 else 3), va="top" if height > 0.0 else "bottom")


def _alike(qdd: Floats) -> list[tuple[Floats, list[int]]]:
    """Accelerations that differ, shape (T,) [rad/s²], each with the joints that have it."""
    largest = float(np.max(np.abs(qdd)))
    groups: list[tuple[Floats, list[int]]] = []
    for joint, values in enumerate(qdd.T):
        for other, joints in groups:
            if np.max(np.abs(values - other)) <= 0.02 * largest:
                joints.append(joint)
                break
        else:
            groups.append((values, [joint]))
    return groups
