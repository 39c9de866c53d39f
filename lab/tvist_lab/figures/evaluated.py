"""Figures of hundreds of moves: the residual vibration of each, and one of them against time."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from tvist_lab.evaluation.evaluate import JudgedMove
from tvist_lab.figures.style import FAINT, SHAPED, UNSHAPED, legend, panels, title
from tvist_lab.metrics import amplitude, best_tool_acceleration, motions
from tvist_lab.recordings import Recording

FLOOR = 1e-4
"""Smaller peaks are drawn at this value [m/s²]."""


def residual_by_move_figure(judged: Sequence[JudgedMove]) -> Figure:
    """Peak |α| after the stop, shaped against unshaped, one point per move; and the distribution of the reductions."""
    figure, (above, below) = panels(2, 6.0, share_x=False, ratios=(3, 2))
    for counts, color, label in (
        (True, SHAPED, "Move"),
        (False, FAINT, "Below 0.2 m/s² unshaped, not counted"),
    ):
        chosen = [one for one in judged if one.counts is counts]
        before, after = ([max(peak, FLOOR) for peak in peaks] for peaks in (
            [one.unshaped.peak for one in chosen], [one.shaped.peak for one in chosen]
        ))  # fmt: skip
        above.loglog(before, after, "o", color=color, markersize=2.5, alpha=0.7, label=label)
    low, high = above.get_xlim()
    for share in (1.0, 0.1, 0.01):
        above.loglog([low, high], [share * low, share * high], color=FAINT, linewidth=0.8)
        above.annotate(
            f"−{100 * (1 - share):.0f} %", (high, share * high), color=FAINT, fontsize=7, ha="right"
        )
    above.set(xlabel="Peak unshaped (m/s²)", ylabel="Peak shaped (m/s²)", xlim=(low, high))
    title(above, "Peak acceleration of the tool after the stop")
    reductions = np.sort([one.reduction(one.shaped) for one in judged if one.counts])
    if reductions.size:
        below.plot(reductions, 100.0 * (np.arange(reductions.size) + 0.5) / reductions.size, color=SHAPED)
    below.set(xlabel="Reduction (%)", ylabel="Moves with less (%)", ylim=(0, 100))
    legend(figure, above)
    return figure


def vibration_figure(unshaped: Recording, shaped: Recording, number: int) -> Figure:
    """|α| of one move around its stop, unshaped and shaped; time is zero when the unshaped reference stops."""
    figure, (panel,) = panels(1, 2.8)
    for recording, color, label in ((unshaped, UNSHAPED, "Unshaped"), (shaped, SHAPED, "Shaped")):
        motion = motions(recording)[0]
        time = 1e3 * (recording.time - recording.time[motion.reference_stop])
        panel.plot(
            time, amplitude(best_tool_acceleration(recording)), color=color, linewidth=1.1, label=label
        )
        panel.axvline(time[motion.shaped_stop], color=color, linewidth=0.9, linestyle=":")
    panel.set(
        xlim=(-150, 450),
        xlabel="Time after the unshaped reference's stop (ms)",
        ylabel=r"$|\alpha|$ (m/s$^2$)",
    )
    title(panel, f"Move {number}")
    legend(figure, panel)
    return figure
