"""Find modes in the log of an accelerometer alone, from ring-downs and frequency sweeps."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import correlate
from scipy.stats import spearmanr

from tvist_lab.metrics.ring_down import FREQUENCIES, fit_ring_down
from tvist_lab.metrics.vibration import SENSOR, NotMeasurableError, parts
from tvist_lab.recordings import Floats, Recording

LEVEL = 0.05  # time over which the level of a vibration is averaged [s]
LOUD = 4.0  # level that counts as vibration, relative to the level of the quietest tenth of a log [-]
ONSET = 0.25  # longest time from the start of a vibration to its peak in a ring-down [s]
SWEEP, BLOCK = 3.0, 0.5  # shortest sweep, and duration of its parts, each with one frequency [s]
RISING = 0.8  # smallest rank correlation of a sweep's frequencies with time [-]
EDGE = 1.1  # smallest ratio of a mode to the ends of a sweep [-]
EXPLAINED = 0.8  # smallest share of the energy that damped sines must explain [-]
SCALED = 15.0  # frequency to which the strongest is scaled, in the middle of the fit's range [Hz]


@dataclass(frozen=True)
class FreeVibration:
    """The strongest mode of one ring-down or sweep."""

    kind: str
    start_s: float  # time at which it starts [s]
    f_d_hz: float  # damped frequency [Hz]
    zeta: float  # damping ratio [-]
    f_d_interval_hz: tuple[float, float] | None = None
    """95 % interval of the frequency [Hz]; None for a sweep."""
    zeta_interval: tuple[float, float] | None = None
    """95 % interval of the damping ratio [-]; None for a sweep."""


def free_vibrations(recording: Recording) -> list[FreeVibration]:
    """Measure the ring-downs and sweeps in an accelerometer's log, in order."""
    found = []
    for rows in parts(recording.time):
        seen = np.isfinite(recording[SENSOR][rows]).all(axis=1)
        time, force = recording.time[rows][seen], recording[SENSOR][rows][seen]
        if len(time) * recording.period > 4.0 * LEVEL:
            found += _in_part(time, force - np.median(force, axis=0), recording.period)
    if not found:
        raise NotMeasurableError(
            "neither a ring-down nor a sweep of frequencies stands out of the accelerometer's noise: record the sensor "
            "at rest for half a second, then a knock or a stop, and nothing else until it is at rest again"
        )
    return found


def _in_part(time: Floats, alpha: Floats, period: float) -> list[FreeVibration]:
    level = np.sqrt(uniform_filter1d(np.sum(alpha**2, axis=1), max(round(LEVEL / period), 1)))
    loud = np.flatnonzero(level > LOUD * np.percentile(level, 10))
    runs = np.split(loud, np.flatnonzero(np.diff(loud) * period > LEVEL) + 1) if loud.size else []
    firsts = [int(run[0]) for run in runs if len(run) * period > LEVEL]
    spans = (slice(first, past) for first, past in pairwise([*firsts, len(time)]))
    return [one for rows in spans if (one := _measured(time[rows], alpha[rows], period)) is not None]


def _measured(time: Floats, alpha: Floats, period: float) -> FreeVibration | None:
    peak = int(np.argmax(np.sum(alpha**2, axis=1)))
    if time[peak] - time[0] <= ONSET:
        return _fitted("ring-down", float(time[peak]), alpha[peak:], time[peak:] - time[peak], period)
    count = int((time[-1] - time[0]) / BLOCK)
    if time[-1] - time[0] < SWEEP:
        return None
    frequencies = [_strongest(block, period) for block in np.array_split(alpha, count)]
    if abs(float(spearmanr(range(count), frequencies).statistic)) < RISING:
        return None
    inside = (EDGE * min(frequencies), max(frequencies) / EDGE)
    # If the excitation has a flat spectrum, the autocorrelation decays like the free vibration.
    decay = np.column_stack([correlate(axis, axis, "full", "fft")[len(axis) - 1 :] for axis in alpha.T])
    decay = decay[: len(decay) // 4]
    found = _fitted("sweep", float(time[0]), decay, period * np.arange(len(decay), dtype=np.float64), period)
    return found if found is not None and inside[0] < found.f_d_hz < inside[1] else None


def _fitted(kind: str, start: float, alpha: Floats, late: Floats, period: float) -> FreeVibration | None:
    """Fit a mode of any frequency; time is scaled so that the strongest one lies in the range of the fit."""
    scale = max(_strongest(alpha, period), FREQUENCIES[0]) / SCALED
    fit = fit_ring_down(alpha, scale * period, modes=2, time=scale * late, offset=True)
    if not fit.ok or fit.r_squared < EXPLAINED:
        return None
    if kind == "sweep":  # the errors of an autocorrelation are not those of noise
        return FreeVibration(kind, start, scale * fit.f_d, fit.zeta)
    low, high = fit.f_d_interval
    return FreeVibration(
        kind, start, scale * fit.f_d, fit.zeta, (scale * low, scale * high), fit.zeta_interval
    )


def _strongest(alpha: Floats, period: float) -> float:
    size = 4 * len(alpha)
    power = np.sum(np.abs(np.fft.rfft(alpha - alpha.mean(axis=0), size, axis=0)) ** 2, axis=1)
    return float(np.fft.rfftfreq(size, period)[np.argmax(power)])
