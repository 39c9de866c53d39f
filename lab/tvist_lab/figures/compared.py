"""The same motion in several recordings: how the tool vibrates around the stop."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from tvist_lab.figures.recorded import Recorded
from tvist_lab.figures.style import FAINT, LIMIT, SERIES, explain, legend, note, panels, title
from tvist_lab.metrics.common_clock import STILL
from tvist_lab.metrics.felt import felt
from tvist_lab.metrics.vibration import amplitude

BEFORE, AFTER = 0.1, 0.6
"""Time shown before and after the stop in the first recording [s]."""


def compared_figure(name: str, recorded: Sequence[tuple[str, Recorded]]) -> Figure:
    """|α| of one motion in up to eight recordings, on one clock that begins with the motion.

    Args:
        name: Name of the motion, used as the heading.
        recorded: Name of each recording, and its motion.

    Raises:
        NotMeasurableError: The accelerometer was not recorded, or too little of the rest.
    """
    figure, (panel,) = panels(1, 3.2)
    title(panel, name)
    first, motion = recorded[0][1]
    stop = float(first.time[motion.arm_stop(first)] - first.time[motion.start])
    highest = STILL
    for (label, (recording, its)), look in zip(recorded, SERIES, strict=False):
        time, alpha = felt(recording, its, slice(its.start, its.end), smooth=True)
        time = time - recording.time[its.start] - stop
        size = amplitude(alpha)
        panel.plot(time, size, **look.line(label=label))
        highest = max(highest, float(np.max(size[(time > 0.0) & (time < AFTER)], initial=0.0)))
    panel.axhline(STILL, color=FAINT, linewidth=0.9, linestyle=LIMIT)
    note(panel, f"{STILL:g} m/s²", (AFTER, STILL), xytext=(-2, 2), textcoords="offset points", ha="right")
    panel.set(
        xlim=(-BEFORE, AFTER), ylim=(0.0, 1.25 * highest), xlabel=f"Time after the stop in {recorded[0][0]} (s)",
        ylabel=r"$|\alpha|$ (m/s²)",
    )  # fmt: skip
    legend(figure, panel)
    explain(figure, {r"$|\alpha|$": "acceleration of the tool, without gravity"})
    return figure
