"""How the tool shakes after a motion: without and with shaping, and in several recordings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tvist_lab.figures.recorded import Recorded
from tvist_lab.figures.style import (
    ALPHA,
    FAINT,
    INK,
    MUTED,
    OF_ALPHA,
    OF_SHAPED,
    OF_UNSHAPED,
    SERIES,
    SHAPED,
    UNSHAPED,
    Series,
    dashed,
    dotted,
    legend,
    note,
    panels,
    tint,
    title,
)
from tvist_lab.metrics import (
    NotMeasurableError,
    amplitude,
    best_tool_acceleration,
    motions,
    peak_after_stop,
    still_after,
)
from tvist_lab.metrics.common_clock import AFTER_STOP, STILL
from tvist_lab.metrics.felt import felt
from tvist_lab.recordings import Floats, Recording

SHOWN = (-0.05, 0.35)
"""Time shown before and after the end of the unshaped motion's reference [s]."""
HEADROOM = 1.6
"""Height of the axis over the larger peak [-]: the end of the braking shows, and the peaks are not small."""
WORDS_AT = 0.1
"""Where the curves' names begin [s]."""
BEFORE, AFTER = 0.1, 0.6
"""Time shown before and after the stop in the first of several recordings [s]."""


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
    dashed(panel, STILL, color=FAINT, width=0.9)
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
        note(panel, limit, (at, STILL), (0, 3), ha="right", color=MUTED)
        return
    for moment, color in ((before, UNSHAPED), (after, SHAPED)):
        panel.plot([1e3 * moment], [STILL], "|", color=color, markersize=14, markeredgewidth=2.2, zorder=5)
    # Words are empty: the arrow goes to the first point from the second.
    arrow = {"arrowstyle": "->", "color": INK, "linewidth": 1.3, "shrinkA": 2, "shrinkB": 2}
    panel.annotate("", (1e3 * after, STILL), (1e3 * before, STILL), arrowprops=arrow, zorder=5)
    gained = 1e3 * (before - after)
    words = f"{abs(gained):.0f} ms {'earlier' if gained >= 0.0 else 'later'} with shaping"
    note(panel, f"{limit}\n{words}", (at, STILL), (0, 5), ha="right")


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
    dashed(panel, STILL, color=FAINT, width=0.9)
    note(panel, f"{STILL:g} m/s²", (AFTER, STILL), (-2, 2), ha="right")
    panel.set(
        xlim=(-BEFORE, AFTER), ylim=(0.0, 1.25 * highest), xlabel=f"Time after the stop in {recorded[0][0]} (s)",
        ylabel=ALPHA,
    )  # fmt: skip
    legend(figure, panel, OF_ALPHA)
    return figure


def vibration_figure(unshaped: Recording, shaped: Recording, number: int) -> Figure:
    """|α| of one move around its stop, unshaped and shaped; time is zero when the unshaped reference stops."""
    figure, (panel,) = panels(1, 2.8)
    for recording, style, label in ((unshaped, OF_UNSHAPED, "Unshaped"), (shaped, OF_SHAPED, "Shaped")):
        motion = motions(recording)[0]
        time = 1e3 * (recording.time - recording.time[motion.reference_stop])
        panel.plot(time, amplitude(best_tool_acceleration(recording)), **style.line(1.2, label=label))
        dotted(panel, time[motion.shaped_stop], color=style.color)
    panel.plot([], [], color=FAINT, linewidth=0.9, linestyle=":", label="Stop of the reference")
    panel.set(
        xlim=(-150, 450),
        xlabel="Time after the unshaped reference's stop (ms)",
        ylabel=ALPHA,
    )
    title(panel, f"Move {number}")
    legend(figure, panel, OF_ALPHA)
    return figure
