"""Figure 16: the tool's acceleration after the stop, and the residual vibration derived from it."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tvist_lab.figures.recorded import Recorded
from tvist_lab.figures.style import INK, OF_SHAPED, OF_UNSHAPED, Series, explain, legend, note, panels, title
from tvist_lab.metrics.residual import Residual, residual
from tvist_lab.metrics.vibration import amplitude, tool_acceleration

BEFORE = 0.1
"""Time shown before the unshaped reference stops [s]."""
AFTER = 0.4
"""Time shown after the shaped reference stops [s]."""
REST = 0.2
"""Time at the end of the recorded rest that tells the noise [s]."""
LOUD = 1.2
"""Height over the largest noise from which a peak is one of a vibration [-]; a decay needs two of them."""
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
        panel.set_ylabel(r"$|\alpha|$ (m/s²)")
        read = [
            _draw(panel, recorded, style, label)
            for recorded, style, label in ((unshaped, OF_UNSHAPED, "Unshaped"), (shaped, OF_SHAPED, "Shaped"))
        ]
        stops = [
            recording.time[m.shaped_stop] - recording.time[m.start] for recording, m in (unshaped, shaped)
        ]
        panel.set_xlim(stops[0] - BEFORE, stops[1] + AFTER)
        panel.set_ylim(0.0, 1.35 * max(rv.value for rv, _ in read))
        for row, ((rv, stands_out), style) in enumerate(zip(read, (OF_UNSHAPED, OF_SHAPED), strict=True)):
            note(
                panel,
                f"RV {rv.value:.2f} m/s²{_how(rv, stands_out=stands_out)}",
                (0.985, 0.95 - 0.14 * row),
                xycoords="axes fraction",
                ha="right",
                va="top",
                color=style.color,
            )
    axes[0].plot([], [], color=INK, linewidth=1.4, linestyle=DASHES, label="Decay fitted to the peaks")
    axes[-1].set_xlabel("Time (s)")
    legend(figure, axes[0])
    explain(
        figure,
        {
            r"$|\alpha|$": "acceleration of the tool, without gravity",
            "$t_b$, $t_b^*$": "stop of the reference and of the shaped one",
            "RV": "residual vibration, |α| of the fit at the stop",
        },
    )
    return figure


def _draw(panel: Axes, recorded: Recorded, style: Series, label: str) -> tuple[Residual, bool]:
    """Draw one recording; return the residual vibration derived from it, and whether its decay is not just noise."""
    recording, motion = recorded
    color, start = style.color, recording.time[motion.start]
    rv = residual(recording, motion)
    alpha = amplitude(tool_acceleration(recording))
    rows = slice(motion.start, motion.end)
    panel.plot(recording.time[rows] - start, alpha[rows], **style.line(1.1, label=label))
    stands_out = bool(np.count_nonzero(rv.peaks > LOUD * np.max(alpha[_rest(recorded)])) > 1)
    if stands_out:
        panel.plot(rv.peak_times - start, rv.peaks, **style.points(3.5, markerfacecolor="white", zorder=3))
    if rv.fitted and stands_out:
        time = np.linspace(rv.stop, rv.peak_times[-1], 100)
        panel.plot(time - start, rv.curve(time), color=color, linewidth=1.4, linestyle=DASHES, zorder=3)
    panel.axvline(rv.stop - start, color=color, linewidth=0.9, linestyle=":")
    panel.plot([rv.stop - start], [rv.value], "D", color=color, markersize=4.5)
    note(
        panel,
        "$t_b$" if style is OF_UNSHAPED else "$t_b^*$",
        (rv.stop - start, 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(3, -2),
        textcoords="offset points",
        va="top",
        color=color,
    )
    return rv, stands_out


def _rest(recorded: Recorded) -> slice:
    """Rows at the end of the recorded rest, when nothing but the sensor's noise is left."""
    recording, motion = recorded
    first = int(np.searchsorted(recording.time, recording.time[motion.end - 1] - REST))
    return slice(max(first, motion.shaped_stop + 1), motion.end)


def _how(rv: Residual, *, stands_out: bool) -> str:
    """How the value was found, where it is not from a decay that is drawn."""
    if not rv.fitted:
        return ", largest value"
    return "" if stands_out else ", fitted to noise"
