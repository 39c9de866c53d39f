"""Spectrogram of a ring-down: at which frequencies the tool vibrates after a stop, and how they die away."""

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import spectrogram

from tvist_lab.figures.recorded import Recorded
from tvist_lab.figures.style import FAINT, INK, OF_SHAPED, OF_UNSHAPED, explain, legend, note, panels, title
from tvist_lab.metrics import NotMeasurableError
from tvist_lab.metrics.ring_down import WINDOWS, fit_ring_down
from tvist_lab.metrics.vibration import tool_acceleration
from tvist_lab.recordings import Floats

BEFORE, AFTER = 0.1, 0.7
"""Time shown before and after the stop of the shaped reference [s]."""
BLOCK = 0.2
"""Duration of the data of one spectrum [s]: what changes faster is smeared over it."""
HIGHEST = 45.0
"""Largest frequency shown [Hz]."""
RANGE = 40.0
"""Levels shown below the largest one [dB]."""


def ring_down_figure(name: str, recorded: Recorded) -> Figure:
    """Draw the tool's acceleration after a stop, the mode fitted to it, and its spectrogram.

    Top: the acceleration along the axis in which the tool vibrates most, with the envelope of the fit. Bottom: levels
    of all three axes together relative to the largest, with the fitted damped frequency.

    Args:
        name: Name of the motion, used as the heading.
        recorded: The motion, from a recording that shows its ring-down.

    Raises:
        NotMeasurableError: Less rest was recorded than a fit needs.
    """
    recording, motion = recorded
    period = recording.period
    alpha = tool_acceleration(recording)
    ring = alpha[motion.shaped_stop : min(motion.end, motion.shaped_stop + round(AFTER / period))]
    if len(ring) * period < WINDOWS[0]:
        raise NotMeasurableError(
            f"only {len(ring) * period:.3f} s were recorded after the stop, {WINDOWS[0]} s are needed"
        )
    fit = fit_ring_down(ring, period)
    first = max(motion.start, motion.shaped_stop - round((BEFORE + BLOCK) / period))
    rows = slice(first, motion.shaped_stop + len(ring))
    time = recording.time[rows] - recording.time[motion.shaped_stop]
    axis = _strongest(ring)
    figure, (above, below) = panels(2, 4.8, ratios=(1.0, 1.5))
    title(above, name)
    above.plot(
        1e3 * time,
        (alpha[rows] - ring.mean(axis=0)) @ axis,
        **OF_SHAPED.line(1.1, label="Along its strongest axis"),
    )
    words = "no mode is fitted"
    if fit.ok:
        late = np.linspace(0.0, len(ring) * period, 200)
        sigma = 2.0 * np.pi * fit.f_d * fit.zeta / np.sqrt(1.0 - fit.zeta**2)
        envelope = fit.amplitude * np.exp(-sigma * late)
        above.plot(1e3 * late, envelope, **OF_UNSHAPED.line(1.2, label="Envelope of the fit"))
        above.plot(1e3 * late, -envelope, **OF_UNSHAPED.line(1.2))
        words = f"$f_d$ = {fit.f_d:.2f} Hz, $\\zeta$ = {fit.zeta:.3f}"
    loudest = 1.3 * float(np.max(np.abs(ring @ axis - float(np.mean(ring @ axis)))))
    above.set(ylabel=r"$\alpha$ (m/s²)", ylim=(-loudest, loudest))
    note(above, words, (0.99, 0.95), xycoords="axes fraction", ha="right", va="top")
    for panel in (above, below):
        panel.axvline(0.0, color=FAINT, linewidth=0.9, linestyle=":")

    moments, frequencies, level = _levels(alpha[rows], period)
    shown = frequencies <= HIGHEST
    drawn = below.pcolormesh(
        1e3 * (moments + time[0]),
        frequencies[shown],
        level[shown],
        cmap="cividis",
        vmin=-RANGE,
        vmax=0.0,
        shading="nearest",
        rasterized=True,
    )
    if fit.ok:
        below.axhline(fit.f_d, color="white", linewidth=1.2, linestyle=(0, (5, 3)))
        note(
            below,
            "$f_d$",
            (1.0, fit.f_d),
            xycoords=("axes fraction", "data"),
            xytext=(-3, 3),
            textcoords="offset points",
            ha="right",
        )
    below.grid(visible=False)
    below.set(
        xlabel="Time after the stop of the shaped reference (ms)",
        ylabel="Frequency (Hz)",
        ylim=(0.0, HIGHEST),
        xlim=(-1e3 * BEFORE, 1e3 * (time[-1] - 0.5 * BLOCK)),
    )
    bar = figure.colorbar(drawn, ax=below, pad=0.01)
    bar.set_label("Level (dB)", fontsize=9, color=INK)
    bar.ax.tick_params(labelsize=8, colors=INK)
    legend(figure, above)
    explain(
        figure,
        {
            r"$\alpha$": "acceleration of the tool, without gravity",
            "$f_d$": "damped frequency",
            r"$\zeta$": "damping ratio",
            **({} if fit.ok else {"No mode": fit.reason}),
            "0 dB": f"largest level; a spectrum is of {1e3 * BLOCK:.0f} ms",
        },
    )
    return figure


def _strongest(ring: Floats) -> Floats:
    """Unit vector along which the tool vibrates most, shape (3,)."""
    return np.asarray(np.linalg.svd(ring - ring.mean(axis=0), full_matrices=False)[2][0])


def _levels(alpha: Floats, period: float) -> tuple[Floats, Floats, Floats]:
    """Times of the spectra from the first row on [s], frequencies [Hz], and levels of all axes together [dB]."""
    size = round(BLOCK / period)
    frequencies, moments, power = spectrogram(
        alpha.T,
        1.0 / period,
        window="hann",
        nperseg=size,
        noverlap=size - 2,
        nfft=8 * size,
        detrend="constant",
    )
    total = power.sum(axis=0)
    return moments, frequencies, 10.0 * np.log10(total / total.max() + 1e-12)
