"""The two figures of an advice: the worst stop with and without the shaper, and what each shaper leaves for its time.

Their text is large, since they are made to be posted and seen on a phone.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text

from tvist_lab.advice import Advice, Option
from tvist_lab.advice.options import impulses_of
from tvist_lab.advice.slower import smoothed
from tvist_lab.figures.style import (
    FAINT,
    MUTED,
    OF_SHAPED,
    OF_UNSHAPED,
    THIRD,
    dashed,
    decades,
    note,
    panels,
    title,
)
from tvist_lab.metrics import amplitude
from tvist_lab.metrics.common_clock import STILL

LARGE = 1.65
"""Size of text over the usual one [-]."""
SHOWN = (-0.1, 1.0)
"""Time shown before and after the stop [s]."""
NAMED = 4
"""Number of shapers on the front that are named beside the recommended one."""
LEAST = 0.5
"""Lowest share that is drawn [%]."""
OTHERS = np.linspace(0.01, 1.0, 30)
"""Times of smoothing that are drawn, as shares of the longest shaper's [-]."""


def worst_stop_figure(advice: Advice) -> Figure:
    """|α| around the stop that rings most, as recorded, and as predicted with the recommended shaper.

    Args:
        advice: An advice that recommends a shaper.
    """
    assert advice.best is not None
    stop = max(advice.best.left, key=lambda one: one.unshaped.rms)
    impulses = impulses_of(advice.best.shaper, advice.best.aim.judged[stop])
    shaped = amplitude(stop.after(np.asarray(impulses.A), np.asarray(impulses.tau)))
    figure, (panel,) = panels(1, 4.4)
    ms = 1e3 * stop.time
    panel.plot(ms, amplitude(stop.alpha), **OF_UNSHAPED.line(1.8, label="recorded"))
    panel.plot(ms, shaped, **OF_SHAPED.line(2.2, label=f"predicted with {advice.best.shaper}"))
    dashed(panel, STILL, color=FAINT, width=0.9)
    highest = float(np.max(amplitude(stop.alpha)[(stop.time > 0.0) & (stop.time < SHOWN[1])]))
    ends = 1e3 * SHOWN[0], min(1e3 * SHOWN[1], float(ms[-1]))
    panel.set(xlim=ends, ylim=(0.0, 1.25 * highest))
    panel.set(xlabel="Time after the stop (ms)", ylabel="Shake of the tool (m/s²)")
    title(panel, f"The worst stop: {advice.best.percent[stop]:.0f} % is left")
    return _large(figure, panel)


def cost_figure(advice: Advice) -> Figure:
    """What each shaper leaves against the time that it adds, medians over the stops that ring.

    Args:
        advice: An advice with options.
    """
    figure, (panel,) = panels(1, 4.8)
    fair = [one for one in advice.options if one.keeps_limits]
    longest = max(one.added_s for one in fair)
    times = longest * OTHERS
    means = [[smoothed(stop, float(time)) for stop in advice.ringing] for time in times]
    line = [np.median([value for value in each if value is not None] or [np.nan]) for each in means]
    panel.plot(1e3 * times, line, color=MUTED, linewidth=1.4, linestyle=(0, (5, 2)), label="smoothing alone")
    for count, color, marker in ((1, OF_SHAPED.color, "o"), (2, THIRD, "s")):
        of_count = [one for one in fair if one.count == count]
        if of_count:
            x, y = [1e3 * one.added_s for one in of_count], [one.left_percent for one in of_count]
            panel.plot(
                x, y, marker, color=color, markersize=6, label=f"{count} mode{'s' if count > 1 else ''}"
            )
    for option in _front(fair, advice.best):
        note(
            panel,
            _short(option),
            (1e3 * option.added_s, option.left_percent),
            (-3, -9),
            ha="right",
            bbox=None,
        )
    if advice.best is not None:
        best = advice.best
        at = 1e3 * best.added_s, best.left_percent
        panel.plot(
            *at, "o", color="none", markeredgecolor=OF_UNSHAPED.color, markersize=15, markeredgewidth=2.4
        )
        note(
            panel,
            _short(best),
            at,
            (0, -24),
            color=OF_UNSHAPED.color,
            fontweight="bold",
            ha="center",
            bbox=None,
        )
    panel.set_yscale("log")
    lowest = 0.7 * max(min(one.left_percent for one in fair), LEAST)
    panel.set(xlim=(0.0, 1.05e3 * longest), ylim=(lowest, 110.0))
    panel.set(xlabel="Time added to a motion (ms)", ylabel="Shake that is left (%)")
    decades(panel, "y")
    title(panel, "What each shaper leaves, and costs")
    return _large(figure, panel)


def _short(option: Option) -> str:
    return option.shaper if option.count == 1 else f"{option.shaper} ×{option.count}"


def _front(fair: list[Option], best: Option | None) -> list[Option]:
    """Some of the shapers that no shorter one beats, apart from the recommended one."""
    front, least = [], np.inf
    for one in sorted(fair, key=lambda one: (one.added_s, one.left_percent)):
        if one.left_percent < 0.8 * least:
            front.append(one)
            least = one.left_percent
    return [one for one in front if one is not best and (best is None or one.shaper != best.shaper)][:NAMED]


def _large(figure: Figure, panel: Axes) -> Figure:
    """Enlarge all text, and put the legend into the panel."""
    panel.legend(frameon=False, loc="upper right")
    for text in figure.findobj(Text):
        text.set_fontsize(LARGE * float(text.get_fontsize()))
    return figure
