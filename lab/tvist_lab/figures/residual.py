"""Figure 16: the tool's acceleration after the stop, and the residual vibration derived from it."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tvist_lab.figures.recorded import Recorded
from tvist_lab.figures.style import INK, SHAPED, UNSHAPED, legend, note, panels, title
from tvist_lab.metrics.residual import WINDOW, Residual, residual
from tvist_lab.metrics.vibration import amplitude, tool_acceleration

BEFORE = 0.1
"""Time shown before the unshaped reference stops [s]."""
AFTER = 0.4
"""Time shown after the shaped reference stops [s]."""
DASHES = (0, (4, 2))
"""Dash pattern of a fitted curve."""


def figure_16(motions: Mapping[str, tuple[Recorded, Recorded]]) -> Figure:
    """|α| around the stop of each motion, unshaped and shaped, with the fitted decay from t_b on.

    Time is zero when the reference starts.

    Args:
        motions: Name to the recording and motion without and with shaping.

    Raises:
        NotMeasurableError: Less than 0.3 s were recorded after a stop.
    """
    figure, axes = panels(len(motions), 0.6 + 2.0 * len(motions), share_x=False)
    for panel, (name, (unshaped, shaped)) in zip(axes, motions.items(), strict=True):
        title(panel, name)
        panel.set_ylabel(r"$|\alpha|$ (m/s$^2$)")
        read = [
            _draw(panel, recorded, color, label)
            for recorded, color, label in ((unshaped, UNSHAPED, "Unshaped"), (shaped, SHAPED, "Shaped"))
        ]
        stops = [
            recording.time[m.shaped_stop] - recording.time[m.start] for recording, m in (unshaped, shaped)
        ]
        panel.set_xlim(stops[0] - BEFORE, stops[1] + AFTER)
        panel.set_ylim(0.0, 1.35 * max(rv.value for rv in read))
        for row, (rv, color) in enumerate(zip(read, (UNSHAPED, SHAPED), strict=True)):
            note(
                panel,
                f"RV {rv.value:.2f} m/s²" + ("" if rv.fitted else ", largest value"),
                (0.985, 0.95 - 0.14 * row),
                xycoords="axes fraction",
                ha="right",
                va="top",
                color=color,
            )
    axes[0].plot([], [], color=INK, linewidth=1.4, linestyle=DASHES, label="Decay fitted to the peaks")
    axes[-1].set_xlabel("Time (s)")
    legend(figure, axes[0])
    return figure


def _draw(panel: Axes, recorded: Recorded, color: str, label: str) -> Residual:
    """Draw one recording; return the residual vibration derived from it."""
    recording, motion = recorded
    start = recording.time[motion.start]
    rv = residual(recording, motion)
    alpha = amplitude(tool_acceleration(recording))
    rows = slice(motion.start, motion.end)
    panel.plot(recording.time[rows] - start, alpha[rows], color=color, linewidth=1.1, alpha=0.9, label=label)
    panel.plot(rv.peak_times - start, rv.peaks, "o", color=color, markersize=3.5, markerfacecolor="white")
    if rv.fitted:
        time = np.linspace(rv.stop, rv.stop + WINDOW, 100)
        panel.plot(time - start, rv.curve(time), color=color, linewidth=1.4, linestyle=DASHES)
    panel.axvline(rv.stop - start, color=color, linewidth=0.9, linestyle=":")
    panel.plot([rv.stop - start], [rv.value], "D", color=color, markersize=4.5)
    note(
        panel,
        r"$t_b$",
        (rv.stop - start, 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(3, -2),
        textcoords="offset points",
        va="top",
        color=color,
    )
    return rv
