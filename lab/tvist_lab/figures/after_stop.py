"""One motion at a glance: how the tool shakes after it, without and with shaping."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tvist_lab.figures.recorded import Recorded
from tvist_lab.figures.style import (
    FAINT,
    INK,
    LIMIT,
    MUTED,
    OF_SHAPED,
    OF_UNSHAPED,
    SHAPED,
    UNSHAPED,
    Series,
    note,
    panels,
    tint,
    title,
)
from tvist_lab.metrics import (
    NotMeasurableError,
    amplitude,
    best_tool_acceleration,
    peak_after_stop,
    still_after,
)
from tvist_lab.metrics.common_clock import AFTER_STOP, STILL
from tvist_lab.recordings import Floats

SHOWN = (-0.05, 0.35)
"""Time shown before and after the end of the unshaped motion's reference [s]."""
HEADROOM = 1.6
"""Height of the axis over the larger peak [-]: the end of the braking shows, and the peaks are not small."""
WORDS_AT = 0.1
"""Where the curves' names begin [s]."""


@dataclass(frozen=True)
class _Curve:
    """What is drawn of one recording; times count from the end of the unshaped reference."""

    time: Floats
    """Shape (T,) [s]."""
    alpha: Floats
    """|α|, shape (T,) [m/s²]."""
    counts: NDArray[np.bool_]
    """Rows later than 10 ms after the end of the shaped reference, shape (T,)."""
    peak: float
    """Largest |α| of these [m/s²]."""
    at: float
    """Time of the peak [s]."""
    still: float | None
    """Last time |α| exceeds 0.1 m/s² [s]; None where it still does when the recording ends."""


def after_stop_figure(unshaped: Recorded, shaped: Recorded, what: str) -> Figure:
    """|α| of the tool around the end of one motion, without and with shaping, on one clock.

    Time is zero where the reference without shaping ends.

    Args:
        unshaped: The motion without shaping.
        shaped: The same motion with shaping.
        what: The motion in words, for the heading.

    Raises:
        RecordingError: The true acceleration was not recorded.
        NotMeasurableError: Nothing was recorded after a stop.
    """
    motion = unshaped[1]
    length = unshaped[0].time[motion.reference_stop] - unshaped[0].time[motion.start]
    before, after = (_curve(recorded, length) for recorded in (unshaped, shaped))
    figure, (panel,) = panels(1, 3.9)
    title(panel, f"{what}: the tool's vibration after the same motion, without and with shaping")
    for curve, style in ((before, OF_UNSHAPED), (after, OF_SHAPED)):
        _draw(panel, curve, style)
    top = HEADROOM * max(before.peak, after.peak, STILL)
    panel.set(
        xlim=(1e3 * SHOWN[0], 1e3 * SHOWN[1]),
        ylim=(0.0, top),
        xlabel="Time after the unshaped motion's end (ms)",
        ylabel="Acceleration of the tool (m/s²)",
    )
    _name(panel, before, f"without shaping: {before.peak:.2f} m/s²", 0.90 * top, UNSHAPED)
    words = f"with shaping: {after.peak:.2f} m/s², {_change(before.peak, after.peak)}"
    _name(panel, after, words, 0.76 * top, SHAPED)
    panel.axhline(STILL, color=FAINT, linewidth=0.9, linestyle=LIMIT)
    _compare_rest(panel, before.still, after.still)
    note(panel, "braking", (1e3 * SHOWN[0] + 5.0, 0.90 * top), color=MUTED)
    return figure


def _draw(panel: Axes, curve: _Curve, style: Series) -> None:
    """A curve, with what counts as shaking filled."""
    panel.plot(1e3 * curve.time, curve.alpha, **style.line(1.8))
    shakes = curve.time[curve.counts], curve.alpha[curve.counts]
    panel.fill_between(1e3 * shakes[0], shakes[1], color=tint(style.color), linewidth=0.0)
    panel.plot([1e3 * curve.at], [curve.peak], "o", color=style.color, markersize=6, zorder=5)


def _name(panel: Axes, curve: _Curve, words: str, height: float, color: str) -> None:
    """Words in the curve's colour, with a line to its peak."""
    panel.annotate(
        words,
        (1e3 * curve.at, curve.peak),
        xytext=(1e3 * WORDS_AT, height),
        va="center",
        color=color,
        fontsize=11,
        fontweight="bold",
        arrowprops={"arrowstyle": "-", "color": color, "linewidth": 0.9, "shrinkB": 4, "relpos": (0.0, 0.5)},
    )


def _change(before: float, after: float) -> str:
    percent = 100.0 * (after / before - 1.0)
    return f"{abs(percent):.0f} % {'less' if percent <= 0.0 else 'more'}"


def _compare_rest(panel: Axes, before: float | None, after: float | None) -> None:
    """The two moments from which the tool is at rest, and the time between them."""
    limit = f"the tool is at rest (below {STILL:g} m/s²)"
    at = 1e3 * SHOWN[1]
    if before is None or after is None:
        note(panel, limit, (at, STILL), xytext=(0, 3), textcoords="offset points", ha="right", color=MUTED)
        return
    for moment, color in ((before, UNSHAPED), (after, SHAPED)):
        panel.plot([1e3 * moment], [STILL], "|", color=color, markersize=14, markeredgewidth=2.2, zorder=5)
    # Words are empty: the arrow goes to the first point from the second.
    arrow = {"arrowstyle": "->", "color": INK, "linewidth": 1.3, "shrinkA": 2, "shrinkB": 2}
    panel.annotate("", (1e3 * after, STILL), (1e3 * before, STILL), arrowprops=arrow, zorder=5)
    gained = 1e3 * (before - after)
    words = f"{abs(gained):.0f} ms {'earlier' if gained >= 0.0 else 'later'} with shaping"
    note(panel, f"{limit}\n{words}", (at, STILL), xytext=(0, 5), textcoords="offset points", ha="right")


def _curve(recorded: Recorded, length: float) -> _Curve:
    recording, motion = recorded
    rows = slice(motion.start, motion.end)
    time = recording.time[rows] - recording.time[motion.start] - length
    alpha = amplitude(best_tool_acceleration(recording)[rows])
    stop = time[motion.shaped_stop - motion.start]
    counts = time >= stop + AFTER_STOP + 1e-9
    peak = peak_after_stop(recording, motion)
    at = float(time[counts][np.argmax(alpha[counts])])
    try:
        still: float | None = still_after(recording, motion) - length
    except NotMeasurableError:
        still = None
    return _Curve(time, alpha, counts, peak, at, still)
