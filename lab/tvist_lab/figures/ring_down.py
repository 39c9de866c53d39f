"""Figure of a ring-down: vibration after a stop, its frequencies, and their decay."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.signal import spectrogram

from tvist_lab.figures.recorded import Recorded
from tvist_lab.figures.style import (
    OF_SHAPED,
    OF_UNSHAPED,
    dotted,
    legend,
    note,
    panels,
    remark,
    tint,
    title,
)
from tvist_lab.metrics import NotMeasurableError
from tvist_lab.metrics.felt import acceleration_of
from tvist_lab.metrics.ring_down import WINDOWS, RingDown
from tvist_lab.metrics.table import ring_down_of
from tvist_lab.recordings import Floats

BEFORE, AFTER = 0.1, 0.7  # time shown before and after the stop [s]
BLOCK = 0.2  # duration of the data of one spectrum of the spectrogram [s]; faster changes are smeared over it
HIGHEST = 45.0  # largest frequency shown [Hz]
RANGE = 40.0  # levels shown below the largest one [dB]
LINES = 4096  # number of samples to which the ring-down is padded for its spectrum


def ring_down_figure(name: str, recorded: Recorded) -> Figure:
    """Draw the tool's acceleration after a stop, the mode fitted to it, its spectrum and its spectrogram.

    Top: the axis that vibrates most, with the envelope of the fit. Middle: spectrum of all axes after the stop.
    Bottom: levels relative to the largest. Raises NotMeasurableError without accelerometer or enough rest.
    """
    recording, motion = recorded
    period = recording.period
    late, alpha = acceleration_of(recording, motion, slice(motion.start, motion.end))
    late = late - float(recording.time[motion.arm_stop(recording)])
    # Resample at even times around the stop, which fills in missing samples.
    ends = max(late[0], -BEFORE - BLOCK), min(late[-1], AFTER)
    time: Floats = period * np.arange(round(ends[0] / period), round(ends[1] / period) + 1)
    alpha = np.column_stack([np.interp(time, late, axis) for axis in alpha.T])
    after = time >= -0.5 * period
    ring = alpha[after] - alpha[after].mean(axis=0)
    if len(ring) * period < WINDOWS[0]:
        raise NotMeasurableError(
            f"only {len(ring) * period:.3f} s were recorded after the stop, {WINDOWS[0]} s are needed"
        )
    fit = ring_down_of(recording, motion)
    figure, (course, spectrum, levels) = panels(3, 6.6, share_x=False, ratios=(1.0, 1.0, 1.4))
    title(course, name)

    strongest = np.linalg.svd(alpha[after], full_matrices=False)[2][0]
    along = (alpha - alpha[after].mean(axis=0)) @ strongest
    course.plot(1e3 * time, along, **OF_SHAPED.line(1.1, label="Along its strongest axis"))
    words = "no mode is fitted"
    if fit.ok:
        decay = np.linspace(0.0, time[-1], 200)
        sigma = 2.0 * np.pi * fit.f_d * fit.zeta / np.sqrt(1.0 - fit.zeta**2)
        envelope = fit.amplitude * np.exp(-sigma * decay)
        course.plot(1e3 * decay, envelope, **OF_UNSHAPED.line(1.2, label="Envelope of the fit"))
        course.plot(1e3 * decay, -envelope, **OF_UNSHAPED.line(1.2))
        low, high = fit.zeta_interval
        words = f"$f_d$ = {fit.f_d:.2f} Hz, $\\zeta$ = {fit.zeta:.3f} (95 %: {low:.3f} to {high:.3f})"
    loudest = 1.3 * float(np.max(np.abs(along[after])))
    course.set(xlabel="Time after the stop (ms)", ylabel=r"$\alpha$ (m/s²)", ylim=(-loudest, loudest))
    course.set_xlim(-1e3 * BEFORE, 1e3 * time[-1])
    remark(course, words, (0.99, 0.95), ha="right", va="top")

    frequencies = np.fft.rfftfreq(LINES, period)
    size = np.linalg.norm(np.fft.rfft(ring, LINES, axis=0), axis=1) * period
    shown = frequencies <= HIGHEST
    spectrum.plot(frequencies[shown], size[shown], **OF_SHAPED.line(1.3))
    for mode in fit.found if fit.ok else ():
        weight, width = ("bold", 1.2) if mode.f_d == fit.f_d else ("normal", 0.6)
        spectrum.axvspan(*mode.f_d_interval, color=tint(OF_UNSHAPED.color), linewidth=0.0)
        spectrum.axvline(mode.f_d, **OF_UNSHAPED.line(width))
        top = {"xycoords": ("data", "axes fraction"), "weight": weight}
        note(spectrum, f"{mode.f_d:.1f}", (mode.f_d, 1.0), (3, -9), **top)
    spectrum.set(xlabel="Frequency (Hz)", ylabel=r"Spectrum of $\alpha$ (m/s)", xlim=(0.0, HIGHEST))
    spectrum.set_ylim(bottom=0.0)

    _draw_levels(levels, time, alpha, fit)
    levels.set_xlim(-1e3 * BEFORE, 1e3 * (time[-1] - 0.5 * BLOCK))
    for panel in (course, levels):
        dotted(panel, 0.0)
    symbols = {
        r"$\alpha$": "acceleration of the tool, without gravity",
        "$f_d$": "damped frequency",
        r"$\zeta$": "damping ratio",
    }
    symbols |= {} if fit.ok else {"No mode": fit.reason}
    legend(figure, course, symbols | {"0 dB": f"largest level; a spectrum is of {1e3 * BLOCK:.0f} ms"})
    return figure


def _draw_levels(panel: Axes, time: Floats, alpha: Floats, fit: RingDown) -> None:
    period = float(time[1] - time[0])
    size = min(round(BLOCK / period), len(alpha))
    overlap, padded = size - max(size // 50, 1), max(512, 8 * size)
    frequencies, moments, each = spectrogram(
        alpha.T, 1.0 / period, window="hann", nperseg=size, noverlap=overlap, nfft=padded, detrend="constant"
    )
    moments, power = moments + time[0], each.sum(axis=0)
    shown = frequencies <= HIGHEST
    level = 10.0 * np.log10(power[shown] / float(power[:, moments >= 0.0].max()) + 1e-12)
    how: Any = {"cmap": "cividis", "vmin": -RANGE, "vmax": 0.0, "shading": "nearest", "rasterized": True}
    drawn = panel.pcolormesh(1e3 * moments, frequencies[shown], level, **how)
    if fit.ok:
        panel.axhline(fit.f_d, color="white", linewidth=1.2, linestyle=(0, (5, 3)))
        note(panel, "$f_d$", (1.0, fit.f_d), (-3, 3), xycoords=("axes fraction", "data"), ha="right")
    panel.grid(visible=False)
    panel.set(xlabel="Time after the stop (ms)", ylabel="Frequency (Hz)", ylim=(0.0, HIGHEST))
    panel.figure.colorbar(drawn, ax=panel, label="Level (dB)", pad=0.01)
