"""How the tool shakes after a motion: without and with shaping, and in several recordings."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tvist_lab.change import Change
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
    legend,
    note,
    panels,
    remark,
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
"""Time shown before and after the stop of the first of several curves [s]."""


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
    change = Change(before.peak, after.peak, None, None)
    words = f"with shaping: {after.peak:.2f} m/s², {change.less()}"
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


class Shown(NamedTuple):
    """A panel of `compared_figure`."""

    name: str
    """The motion, for the heading."""
    curves: Mapping[str, Recorded]
    """Name of each curve to what was recorded."""
    said: str = ""
    """Words written into the panel."""


def compared_figure(motions: Sequence[Shown], unshaped: Sequence[str] = ()) -> Figure:
    """|α| of several motions, a panel for each, all to one scale; each on a clock that begins with the motion.

    Args:
        motions: The motions; those that cannot be drawn are left out, and of more than eight names of curves the rest.
        unshaped: Names of the curves that are drawn in the colour of what is not shaped.

    Raises:
        NotMeasurableError: None of them has an accelerometer, or enough rest.
    """
    drawn = [(one, curves) for one in motions if (curves := _around_stop(one.curves))]
    if not drawn:
        raise NotMeasurableError("no motion has an acceleration to draw")
    columns = min(len(drawn), 2 if len(drawn) in (2, 4) else 3)
    rows = -(-len(drawn) // columns)
    figure, axes = panels(rows, 0.9 + 2.1 * rows, columns=columns, share_x=False, share_y=True)
    names = list(dict.fromkeys(name for _, curves in drawn for name in curves))
    # What is not shaped has the colour of its own, unless it is compared with its like.
    plain = [name for name in names if name in unshaped]
    names = plain + [name for name in names if name not in plain] if len(plain) == 1 else names
    styles = (OF_UNSHAPED, OF_SHAPED, *SERIES[2:]) if len(plain) == 1 else SERIES
    looks = dict(zip(names, styles, strict=False))
    highest = max(peak for _, curves in drawn for _, _, peak in curves.values())
    for place, (panel, (one, curves)) in enumerate(zip(axes, drawn, strict=False)):
        title(panel, one.name)
        for name in filter(curves.__contains__, looks):
            time, size, _ = curves[name]
            panel.plot(1e3 * time, size, **looks[name].line())
        dashed(panel, STILL, color=FAINT, width=0.9)
        panel.set(
            xlim=(-1e3 * BEFORE, 1e3 * AFTER),
            ylim=(0.0, HEADROOM * highest),
            xlabel="Time after the stop (ms)",
        )
        panel.set_ylabel(ALPHA if place % columns == 0 else "")
        if one.said:
            remark(panel, one.said, (0.97, 0.95), ha="right", va="top")
    for panel in axes[len(drawn) :]:
        panel.remove()
    for name, look in looks.items():
        axes[0].plot([], [], **look.line(label=name))
    legend(figure, axes[0], OF_ALPHA | {"dashed": f"at rest, {STILL:g} m/s²"})
    return figure


def _around_stop(recorded: Mapping[str, Recorded]) -> dict[str, tuple[Floats, Floats, float]]:
    """Time after the stop of the first curve [s], |α|, and its peak after the curve's own stop and 10 ms [m/s²]."""
    curves = {}
    (first, motion), *_ = recorded.values()
    stop = float(first.time[motion.arm_stop(first)] - first.time[motion.start])
    for name, (recording, its) in recorded.items():
        with suppress(NotMeasurableError):
            time, alpha = felt(recording, its, slice(its.start, its.end), smooth=True)
            size, rests = amplitude(alpha), time >= recording.time[its.arm_stop(recording)] + AFTER_STOP
            late = time - recording.time[its.start] - stop
            curves[name] = (late, size, float(np.max(size[rests], initial=STILL)))
    return curves


def vibration_figure(unshaped: Recording, shaped: Recording, number: int) -> Figure:
    """|α| of one move around its stop, unshaped and shaped."""
    curves = {name: (one, motions(one)[0]) for name, one in (("Unshaped", unshaped), ("Shaped", shaped))}
    return compared_figure([Shown(f"Move {number}", curves)], ["Unshaped"])
