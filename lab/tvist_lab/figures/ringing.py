"""How the tool rings after a motion: |α|, its spectrum and its spectrogram."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.signal import ShortTimeFFT
from scipy.signal.windows import hann

from tvist_lab.figures.recorded import Recorded
from tvist_lab.figures.style import INK, MUTED, SHAPED, UNSHAPED, note, panels, title
from tvist_lab.metrics import MotionResult, MotionRows, amplitude, measure
from tvist_lab.metrics.felt import felt
from tvist_lab.recordings import Floats, Recording

BEFORE, AFTER = 0.1, 0.9
"""Time shown before and after the stop [s]."""
HIGHEST = 60.0
"""Highest frequency shown [Hz]."""
WINDOW = 0.16
"""Length of a window of the spectrogram [s]: a compromise between a frequency's width, 6 Hz, and a moment's."""
RANGE = 30.0
"""Range of the spectrogram's colours below the largest value after the stop [dB]."""
LINES = 4096
"""Number of points of a spectrum."""


def ringing_figure(name: str, recorded: Recorded) -> Figure:
    """|α| around the stop, its spectrum after the stop with the fitted mode, and the spectrogram.

    Args:
        name: Name of the motion, used as the heading.
        recorded: The motion.

    Raises:
        NotMeasurableError: The accelerometer was not recorded, or too little of the rest.
    """
    recording, motion = recorded
    result = measure(recording, motion)
    first = motion.arm_stop(recording)
    stop = float(recording.time[first])
    time, alpha = felt(recording, motion, slice(motion.start, motion.end))
    time, alpha = _even(time - stop, alpha, recording.period)
    figure, (course, spectrum, spectrogram) = panels(3, 7.2, share_x=False, ratios=(1, 1, 1.1))
    title(course, name)
    _draw_course(course, time, alpha, _stop_before(recording, motion, stop))
    _draw_spectrum(spectrum, alpha[time >= 0.0], recording.period, result)
    _draw_spectrogram(figure, spectrogram, time, alpha, recording.period)
    return figure


def _stop_before(recording: Recording, motion: MotionRows, stop: float) -> float | None:
    """Time of the target's stop before the arm's own [s]; None if they are one."""
    return float(recording.time[motion.shaped_stop] - stop) if motion.lag else None


def _even(time: Floats, alpha: Floats, period: float) -> tuple[Floats, Floats]:
    """Samples at even times around the stop; missing ones are interpolated."""
    grid = np.arange(max(time[0], -BEFORE), min(time[-1], AFTER), period)
    return grid, np.column_stack([np.interp(grid, time, axis) for axis in alpha.T])


def _draw_course(panel: Axes, time: Floats, alpha: Floats, target_stop: float | None) -> None:
    panel.plot(time, amplitude(alpha), color=SHAPED, linewidth=1.1)
    panel.axvline(0.0, color=INK, linewidth=1.0, linestyle=":", label="The arm stops")
    if target_stop is not None:
        panel.axvline(target_stop, color=MUTED, linewidth=1.0, linestyle="--", label="Its target stops")
    panel.legend(loc="upper right", fontsize=8, frameon=False, labelcolor=INK)
    after = amplitude(alpha)[time > 0.0]
    panel.set(
        xlim=(-BEFORE, time[-1]), ylim=(0.0, 1.5 * float(np.max(after, initial=0.1))), xlabel="Time after the stop (s)",
        ylabel=r"$|\alpha|$ (m/s$^2$)",
    )  # fmt: skip


def _draw_spectrum(panel: Axes, alpha: Floats, period: float, result: MotionResult) -> None:
    frequency = np.fft.rfftfreq(LINES, period)
    lines = np.linalg.norm(np.fft.rfft(alpha - alpha.mean(axis=0), LINES, axis=0), axis=1) * period
    shown = frequency <= HIGHEST
    panel.plot(frequency[shown], lines[shown], color=SHAPED, linewidth=1.3)
    if result.f_d_hz is not None and result.f_d_interval_hz is not None and result.zeta_interval is not None:
        panel.axvspan(*result.f_d_interval_hz, color=UNSHAPED, alpha=0.25, linewidth=0.0)
        panel.axvline(result.f_d_hz, color=UNSHAPED, linewidth=1.2, linestyle="--")
        low, high = result.zeta_interval
        words = f"$f_d$ = {result.f_d_hz:.2f} Hz, ζ = {result.zeta:.3f} ({low:.3f} to {high:.3f})"
    else:
        words = result.notes.get("f_d_hz", "no mode was fitted")
    note(panel, words, (0.99, 0.95), xycoords="axes fraction", ha="right", va="top")
    panel.set(
        xlim=(0.0, min(HIGHEST, 0.5 / period)), ylim=(0.0, None), xlabel="Frequency (Hz)",
        ylabel="Spectrum of $α$ (m/s)",
    )  # fmt: skip


def _draw_spectrogram(figure: Figure, panel: Axes, time: Floats, alpha: Floats, period: float) -> None:
    length = max(round(WINDOW / period), 8)
    transform = ShortTimeFFT(
        hann(length, sym=False), hop=max(length // 16, 1), fs=1.0 / period, mfft=max(512, length)
    )
    power = sum(transform.spectrogram(axis) for axis in (alpha - alpha[time >= 0.0].mean(axis=0)).T)
    level = 10.0 * np.log10(np.maximum(power, 1e-12))
    moments = transform.t(len(alpha)) + time[0]
    loudest = float(level[:, moments >= 0.0].max())
    mesh = panel.pcolormesh(
        moments, transform.f, level, cmap="cividis", vmin=loudest - RANGE, vmax=loudest, rasterized=True,
        shading="nearest",
    )  # fmt: skip
    panel.axvline(0.0, color="white", linewidth=0.9, linestyle=":")
    panel.set(
        xlim=(-BEFORE, time[-1]), ylim=(0.0, min(HIGHEST, 0.5 / period)), xlabel="Time after the stop (s)",
        ylabel="Frequency (Hz)",
    )  # fmt: skip
    panel.grid(visible=False)
    bar = figure.colorbar(mesh, ax=panel, pad=0.01)
    bar.set_label("Power of $α$ (dB)", fontsize=8, color=INK)
    bar.ax.tick_params(labelsize=7, colors=INK)
