"""Figures of an advice: the worst stop with and without the shaper, and vibration left against added time."""

from typing import Any

import numpy as np
from matplotlib import rc_context, rcParams
from matplotlib.figure import Figure

from tvist_lab.advice import Advice, Option
from tvist_lab.advice.options import impulses_of, smoothed
from tvist_lab.figures.style import (
    FAINT,
    MUTED,
    OF_SHAPED,
    OF_THIRD,
    OF_UNSHAPED,
    dashed,
    decades,
    note,
    panels,
    title,
)
from tvist_lab.metrics import amplitude
from tvist_lab.metrics.common_clock import STILL

LARGE = 1.65  # factor on the usual size of text [-]: these figures are often viewed on a phone
SHOWN = (-100.0, 1000.0)  # time shown before and after the stop [ms]
NAMED = 4  # number of shapers on the Pareto front that are named besides the recommended one
MIN_DRAWN_PERCENT = 0.5  # lowest share that is drawn [%]
OTHERS = np.linspace(0.01, 1.0, 30)  # durations of smoothing, as shares of the longest shaper's [-]


def advice_figures(advice: Advice) -> tuple[Figure, Figure]:
    """Return the figures of an advice that recommends a shaper: its worst stop, and the cost of each shaper."""
    with rc_context({"font.size": LARGE * rcParams["font.size"]}):
        return _worst_stop(advice), _costs(advice)


def _worst_stop(advice: Advice) -> Figure:
    """Draw |α| around the stop with most vibration, as recorded and as predicted with the advised shaper."""
    assert advice.best is not None
    stop = max(advice.best.left, key=lambda one: one.unshaped.rms)
    impulses = impulses_of(advice.best.shaper, advice.best.aim.judged[stop])
    recorded, shaped = (amplitude(alpha) for alpha in (stop.alpha, stop.after(impulses)))
    figure, (panel,) = panels(1, 3.4)
    ms = 1e3 * stop.time
    panel.plot(ms, recorded, **OF_UNSHAPED.line(1.8, label="recorded"))
    panel.plot(ms, shaped, **OF_SHAPED.line(2.2, label=f"predicted with {advice.best.shaper}"))
    dashed(panel, STILL, color=FAINT, width=0.9)
    highest = float(np.max(recorded[(ms > 0.0) & (ms < SHOWN[1])]))
    panel.set(xlim=(SHOWN[0], min(SHOWN[1], float(ms[-1]))), ylim=(0.0, 1.25 * highest))
    panel.set(xlabel="Time after the stop (ms)", ylabel="Shake of the tool (m/s²)")
    title(panel, f"The worst stop: {advice.best.percent[stop]:.0f} % is left")
    panel.legend(loc="upper right")
    return figure


def _costs(advice: Advice) -> Figure:
    """Draw each shaper's remaining vibration against its added time, as medians over stops with vibration."""
    figure, (panel,) = panels(1, 3.7)
    fair = [one for one in advice.options if one.keeps_limits]
    longest = max(one.added_s for one in fair)
    times = longest * OTHERS
    means = [[smoothed(stop, float(time)) for stop in advice.ringing] for time in times]
    line = [np.median([value for value in each if value is not None] or [np.nan]) for each in means]
    panel.plot(1e3 * times, line, color=MUTED, linestyle=(0, (5, 2)), label="smoothing alone")
    for count, style, words in ((1, OF_SHAPED, "1 mode"), (2, OF_THIRD, "2 modes")):
        if of_count := [_place(one) for one in fair if one.count == count]:
            panel.plot(*np.transpose(of_count), **style.points(6.0, label=words))
    for option in _front(fair, advice.best):
        note(panel, _short(option), _place(option), (-3, -9), ha="right", bbox=None)
    if advice.best is not None:
        color = OF_UNSHAPED.color
        ring: Any = {"color": "none", "markeredgecolor": color, "markersize": 15, "markeredgewidth": 2.4}
        panel.plot(*_place(advice.best), "o", **ring)
        strong = {"color": color, "fontweight": "bold", "ha": "center", "bbox": None}
        note(panel, _short(advice.best), _place(advice.best), (0, -24), **strong)
    lowest = 0.7 * max(min(one.left_percent for one in fair), MIN_DRAWN_PERCENT)
    panel.set(yscale="log", xlim=(0.0, 1.05e3 * longest), ylim=(lowest, 110.0))
    panel.set(xlabel="Time added to a motion (ms)", ylabel="Shake that is left (%)")
    decades(panel, "y")
    title(panel, "What each shaper leaves, and costs")
    panel.legend(loc="upper right")
    return figure


def _place(option: Option) -> tuple[float, float]:
    """Return the time that a shaper adds [ms], and the vibration that it leaves [%]."""
    return 1e3 * option.added_s, option.left_percent


def _short(option: Option) -> str:
    return option.shaper if option.count == 1 else f"{option.shaper} ×{option.count}"


def _front(fair: list[Option], best: Option | None) -> list[Option]:
    """Return some shapers on the Pareto front (no shorter one leaves less), without the recommended one."""
    front, least = [], np.inf
    for one in sorted(fair, key=lambda one: (one.added_s, one.left_percent)):
        if one.left_percent < 0.8 * least:
            front.append(one)
            least = one.left_percent
    return [one for one in front if one is not best and (best is None or one.shaper != best.shaper)][:NAMED]
