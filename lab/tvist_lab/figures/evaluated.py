"""Figures of hundreds of moves: the residual vibration of each, and one of them against time."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from tvist_lab.figures.style import (
    FAINT,
    MUTED,
    OF_SHAPED,
    OF_UNSHAPED,
    SHAPED,
    decades,
    explain,
    legend,
    note,
    panels,
    title,
)
from tvist_lab.metrics import amplitude, best_tool_acceleration, motions
from tvist_lab.recordings import Recording
from tvist_lab.study.measures import WORTH
from tvist_lab.study.work import Row

FLOOR = 1e-4
"""Smaller peaks are drawn at this value [m/s²]."""


def residual_by_move_figure(rows: Sequence[Row]) -> Figure:
    """Peak |α| after the stop, shaped against unshaped, one point per row; and the distribution of the reductions."""
    reductions = np.sort([row["reduction_percent"] for row in rows if row["reduction_percent"] is not None])
    several = reductions.size > 1
    figure, (above, *rest) = panels(
        2 if several else 1,
        6.0 if several else 3.6,
        share_x=False,
        ratios=(3, 2) if several else None,
    )
    above.set(xscale="log", yscale="log")
    for counts, color, marker, label in (
        (True, SHAPED, "o", "Move"),
        (False, FAINT, "x", f"Below {WORTH:g} m/s² unshaped, not counted"),
    ):
        chosen = [row for row in rows if (row["reduction_percent"] is not None) is counts]
        before, after = ([max(peak, FLOOR) for peak in peaks] for peaks in (
            [row["unshaped_peak_m_s2"] for row in chosen], [row["shaped_peak_m_s2"] for row in chosen]
        ))  # fmt: skip
        if chosen:
            above.plot(before, after, marker, color=color, markersize=3.0, label=label)
    low, high = above.get_xlim()
    for share, words in ((1.0, "as unshaped"), (0.1, "−90 %"), (0.01, "−99 %")):
        above.plot([low, high], [share * low, share * high], color=FAINT, linewidth=0.8)
        note(above, words, (high, share * high), color=MUTED, ha="right", va="center")
    decades(above, "x", "y")
    above.set(xlabel="Peak unshaped (m/s²)", ylabel="Peak shaped (m/s²)", xlim=(low, high))
    title(above, "Peak acceleration of the tool after the stop")
    for below in rest:
        below.plot(reductions, 100.0 * (np.arange(reductions.size) + 0.5) / reductions.size, color=SHAPED)
        below.set(xlabel="Reduction (%)", ylabel="Moves with less (%)", ylim=(0, 100))
    legend(figure, above)
    return figure


def vibration_figure(unshaped: Recording, shaped: Recording, number: int) -> Figure:
    """|α| of one move around its stop, unshaped and shaped; time is zero when the unshaped reference stops."""
    figure, (panel,) = panels(1, 2.8)
    for recording, style, label in ((unshaped, OF_UNSHAPED, "Unshaped"), (shaped, OF_SHAPED, "Shaped")):
        motion = motions(recording)[0]
        time = 1e3 * (recording.time - recording.time[motion.reference_stop])
        panel.plot(time, amplitude(best_tool_acceleration(recording)), **style.line(1.2, label=label))
        panel.axvline(time[motion.shaped_stop], color=style.color, linewidth=0.9, linestyle=":")
    panel.plot([], [], color=FAINT, linewidth=0.9, linestyle=":", label="Stop of the reference")
    panel.set(
        xlim=(-150, 450),
        xlabel="Time after the unshaped reference's stop (ms)",
        ylabel=r"$|\alpha|$ (m/s²)",
    )
    title(panel, f"Move {number}")
    legend(figure, panel)
    explain(figure, {r"$|\alpha|$": "acceleration of the tool, without gravity"})
    return figure
