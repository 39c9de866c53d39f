"""(f_d, ζ) from an accelerometer alone, whatever has shaken it: a blow, a stop or a sweep."""

import numpy as np

from tvist_lab.metrics.ring_down import SIGNIFICANT, WINDOWS, RingDown, fit_ring_down, not_measurable
from tvist_lab.metrics.vibration import SENSOR, band_pass, parts
from tvist_lab.recordings import Recording

SKIPPED = 0.02
"""Time over which what shakes an arm is like itself, as of a sweep over 50 Hz [s]."""


def fit_autocorrelation(recording: Recording) -> RingDown:
    """Fit damped sines to the autocorrelation of what the accelerometer felt in the longest part without a gap.

    Beyond the time over which the excitation is like itself, the autocorrelation of a response decays as a ring-down
    does (James, Carne and Lauffer, SAND92-1666, 1993). The errors of the fit are too small, since noise is correlated
    in it: medians of the true ones are 0.5 % of f_d and a tenth of ζ where noise is a tenth.
    """
    shown = np.flatnonzero(np.isfinite(recording[SENSOR]).all(axis=1))
    rows = shown[max(parts(recording.time[shown]), key=lambda part: part.stop - part.start)]
    time, period = recording.time[rows], recording.period
    grid = np.arange(time[0], time[-1], period) if len(time) else time
    if len(grid) * period < 2.0 * WINDOWS[1]:
        return not_measurable(f"fewer than {2.0 * WINDOWS[1]:g} s were recorded without a gap")
    felt = np.column_stack([np.interp(grid, time, axis) for axis in recording[SENSOR][rows].T])
    power = np.abs(np.fft.rfft(band_pass(felt - felt.mean(axis=0), period), 2 * len(grid), axis=0)) ** 2
    lags = np.fft.irfft(power, axis=0)[: round(WINDOWS[1] / period)] / len(grid)
    if not (size := float(np.sqrt(np.sum(lags[0])))) > 0.0:
        return not_measurable("the accelerometer shows the same value throughout")
    return fit_ring_down(lags / size, period, modes=3, skip=SKIPPED, offset=True, evidence=SIGNIFICANT)
