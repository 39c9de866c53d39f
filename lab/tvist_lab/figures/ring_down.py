"""A ring-down: how the tool vibrates after a stop, at which frequencies, and how they die away."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.signal import spectrogram

from tvist_lab.figures.recorded import Recorded
from tvist_lab.figures.style import (
    OF_SHAPED,
    OF_UNSHAPED,
    color_bar,
    dotted,
    legend,
    note,
    panels,
    remark,
    tint,
    title,
)
from tvist_lab.metrics import NotMeasurableError
from tvist_lab.metrics.felt import felt
from tvist_lab.metrics.ring_down import WINDOWS, RingDown
from tvist_lab.metrics.table import ring_down_of
from tvist_lab.recordings import Floats

BEFORE, AFTER = 0.1, 0.7
"""Time shown before and after the stop [s]."""
BLOCK = 0.2
"""Duration of the data of one spectrum of the spectrogram [s]: what changes faster is smeared over it."""
HIGHEST = 45.0
"""Largest frequency shown [Hz]."""
RANGE = 40.0
"""Levels shown below the largest one [dB]."""
LINES = 4096
"""Number of samples to which the ring-down is padded for its spectrum."""


def ring_down_figure(name: str, recorded: Recorded) -> Figure:
    """Draw the tool's acceleration after a stop, the mode fitted to it, its spectrum and its spectrogram.

    Top: the acceleration along the axis in which the tool vibrates most, with the envelope of the fit. Middle: the
    spectrum of all three axes together after the stop. Bottom: levels of all axes relative to the largest, over time.

    Args:
        name: Name of the motion, used as the heading.
        recorded: The motion, from a recording or a log that shows its ring-down.

    Raises:
        NotMeasurableError: The accelerometer was not recorded, or less rest than a fit needs.
    """
    recording, motion = recorded
    period = recording.period
    stop = float(recording.time[motion.arm_stop(recording)])
    time, alpha = _even(*felt(recording, motion, slice(motion.start, motion.end)), stop, period)
    after = time >= -0.5 * period
    ring = alpha[after]
    if len(ring) * period < WINDOWS[0]:
        raise NotMeasurableError(
            f"only {len(ring) * period:.3f} s were recorded after the stop, {WINDOWS[0]} s are needed"
        )
    fit = ring_down_of(recording, motion)
    figure, (course, spectrum, levels) = panels(3, 6.6, share_x=False, ratios=(1.0, 1.0, 1.4))
    title(course, name)
    _draw_course(course, time, alpha - ring.mean(axis=0), after, fit)
    _draw_spectrum(spectrum, ring, period, fit)
    _draw_levels(figure, levels, (time, alpha), period, fit)
    legend(
        figure,
        course,
        {
            r"$\alpha$": "acceleration of the tool, without gravity",
            "$f_d$": "damped frequency",
            r"$\zeta$": "damping ratio",
            **({} if fit.ok else {"No mode": fit.reason}),
            "0 dB": f"largest level; a spectrum is of {1e3 * BLOCK:.0f} ms",
        },
    )
    return figure


def _even(time: Floats, alpha: Floats, stop: float, period: float) -> tuple[Floats, Floats]:
    """Samples at even times around the stop; missing ones are interpolated."""
    late = time - stop
    grid = period * np.arange(
        round(max(late[0], -BEFORE - BLOCK) / period), round(min(late[-1], AFTER) / period) + 1
    )
    return grid, np.column_stack([np.interp(grid, late, axis) for axis in alpha.T])


def _draw_course(panel: Axes, time: Floats, alpha: Floats, after: NDArray[np.bool_], fit: RingDown) -> None:
    """The acceleration along its strongest axis, and the envelope of the fit."""
    along = alpha @ np.linalg.svd(alpha[after], full_matrices=False)[2][0]
    panel.plot(1e3 * time, along, **OF_SHAPED.line(1.1, label="Along its strongest axis"))
    words = "no mode is fitted"
    if fit.ok:
        late = np.linspace(0.0, time[-1], 200)
        sigma = 2.0 * np.pi * fit.f_d * fit.zeta / np.sqrt(1.0 - fit.zeta**2)
        envelope = fit.amplitude * np.exp(-sigma * late)
        panel.plot(1e3 * late, envelope, **OF_UNSHAPED.line(1.2, label="Envelope of the fit"))
        panel.plot(1e3 * late, -envelope, **OF_UNSHAPED.line(1.2))
        low, high = fit.zeta_interval
        words = f"$f_d$ = {fit.f_d:.2f} Hz, $\\zeta$ = {fit.zeta:.3f} (95 %: {low:.3f} to {high:.3f})"
    loudest = 1.3 * float(np.max(np.abs(along[after])))
    dotted(panel, 0.0)
    panel.set(
        xlabel="Time after the stop (ms)", ylabel=r"$\alpha$ (m/s²)", ylim=(-loudest, loudest),
        xlim=(-1e3 * BEFORE, 1e3 * time[-1]),
    )  # fmt: skip
    remark(panel, words, (0.99, 0.95), ha="right", va="top")


def _draw_spectrum(panel: Axes, ring: Floats, period: float, fit: RingDown) -> None:
    """The amplitude spectrum of all axes together, and the frequencies of all modes with their intervals."""
    frequencies = np.fft.rfftfreq(LINES, period)
    size = np.linalg.norm(np.fft.rfft(ring - ring.mean(axis=0), LINES, axis=0), axis=1) * period
    shown = frequencies <= HIGHEST
    panel.plot(frequencies[shown], size[shown], **OF_SHAPED.line(1.3))
    for mode in fit.found if fit.ok else ():
        strongest = mode.f_d == fit.f_d
        panel.axvspan(*mode.f_d_interval, color=tint(OF_UNSHAPED.color), linewidth=0.0)
        panel.axvline(mode.f_d, **OF_UNSHAPED.line(1.2 if strongest else 0.6))
        weight = "bold" if strongest else "normal"
        note(
            panel,
            f"{mode.f_d:.1f}",
            (mode.f_d, 1.0),
            (3, -9),
            xycoords=("data", "axes fraction"),
            weight=weight,
        )
    panel.set(xlabel="Frequency (Hz)", ylabel=r"Spectrum of $\alpha$ (m/s)", xlim=(0.0, HIGHEST))
    panel.set_ylim(bottom=0.0)


def _draw_levels(
    figure: Figure, panel: Axes, felt_at: tuple[Floats, Floats], period: float, fit: RingDown
) -> None:
    """The spectrogram of all axes together."""
    time, alpha = felt_at
    moments, frequencies, power = _power(alpha, period)
    moments = moments + time[0]
    loudest = float(power[:, moments >= 0.0].max())
    shown = frequencies <= HIGHEST
    drawn = panel.pcolormesh(
        1e3 * moments,
        frequencies[shown],
        10.0 * np.log10(power[shown] / loudest + 1e-12),
        cmap="cividis",
        vmin=-RANGE,
        vmax=0.0,
        shading="nearest",
        rasterized=True,
    )
    dotted(panel, 0.0)
    if fit.ok:
        panel.axhline(fit.f_d, color="white", linewidth=1.2, linestyle=(0, (5, 3)))
        note(panel, "$f_d$", (1.0, fit.f_d), (-3, 3), xycoords=("axes fraction", "data"), ha="right")
    panel.grid(visible=False)
    panel.set(
        xlabel="Time after the stop (ms)",
        ylabel="Frequency (Hz)",
        ylim=(0.0, HIGHEST),
        xlim=(-1e3 * BEFORE, 1e3 * (time[-1] - 0.5 * BLOCK)),
    )
    color_bar(figure, drawn, panel, "Level (dB)", pad=0.01)


def _power(alpha: Floats, period: float) -> tuple[Floats, Floats, Floats]:
    """Times of the spectra from the first row on [s], frequencies [Hz], and power of all axes together."""
    size = min(round(BLOCK / period), len(alpha))
    frequencies, moments, power = spectrogram(
        alpha.T,
        1.0 / period,
        window="hann",
        nperseg=size,
        noverlap=size - max(size // 50, 1),
        nfft=max(512, 8 * size),
        detrend="constant",
    )
    return moments, frequencies, power.sum(axis=0)
