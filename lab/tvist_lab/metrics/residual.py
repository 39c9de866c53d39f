"""RV, the residual vibration of the arm after its reference has stopped."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import find_peaks

from tvist_lab.metrics.errors import NotMeasurableError
from tvist_lab.metrics.felt import acceleration_of
from tvist_lab.metrics.motion import MotionRows
from tvist_lab.metrics.vibration import amplitude
from tvist_lab.recordings import Floats, Recording

WINDOW = 0.3  # time after the stop in which peaks are sought [s]
PROMINENCE = 0.1  # smallest prominence of a peak [m/s²]: three times the sensor's noise


@dataclass(frozen=True)
class Residual:
    """RV as defined in the paper."""

    value: float
    """RV: the fitted decay at the stop, or the largest |α| if nothing could be fitted [m/s²]."""
    decay: float
    """Rate λ of the fitted exponential [1/s]; NaN if there is none."""
    stop: float
    """Time t_b at which the shaped reference stops, or in a foreign log the arm itself [s]."""
    peak_times: Floats
    """Times of the peaks [s], shape (P,)."""
    peaks: Floats
    """|α| at the peaks [m/s²], shape (P,)."""
    fitted: bool
    """False if there were fewer than two peaks, so that the value is the largest |α| in the window."""

    def curve(self, time: Floats) -> Floats:
        """Return the fitted decay at given times [m/s²]; constant if nothing was fitted."""
        rate = self.decay if self.fitted else 0.0
        return np.asarray(self.value * np.exp(-rate * (time - self.stop)), dtype=np.float64)


def residual(recording: Recording, motion: MotionRows) -> Residual:
    """Return RV as in section 4.2 of the paper.

    Local maxima of the sensor's |α| in the 0.3 s after the shaped reference stops, with a prominence of at
    least 0.1 m/s², are fitted by RV·exp(-λ(t - t_b)), λ ≥ 0, with least squares on a linear scale. Noise
    raises the later peaks and flattens the fit: at 0.03 m/s² of noise, RV has a floor of about 0.07 m/s².
    """
    window = _window(recording, motion, WINDOW)
    stop = float(recording.time[window][0])
    # In the tick of the stop the reference still decelerates, so the measurement there is not a ring-down.
    time, alpha_xyz = acceleration_of(recording, motion, slice(window.start + 1, window.stop))
    alpha = amplitude(alpha_xyz)
    at, _ = find_peaks(alpha, prominence=PROMINENCE)
    if len(at) < 2:
        return Residual(float(np.max(alpha)), float("nan"), stop, time[at], alpha[at], fitted=False)
    value, decay = _exponential(time[at] - stop, alpha[at])
    return Residual(value, decay, stop, time[at], alpha[at], fitted=True)


def _exponential(t: Floats, y: Floats) -> tuple[float, float]:
    """Return value at t = 0 and rate of the decaying exponential closest to the points, on a linear scale."""
    slope, log_value = np.polyfit(t, np.log(y), 1)
    # A search that starts at its bound is slow to leave it.
    start = [float(np.exp(log_value)), max(-float(slope), 1.0)]
    fit = least_squares(
        lambda p: p[0] * np.exp(-p[1] * t) - y,
        start,
        jac=lambda p: np.column_stack([np.exp(-p[1] * t), -p[0] * t * np.exp(-p[1] * t)]),
        bounds=([0.0, 0.0], [np.inf, np.inf]),
        x_scale=[1.0, 10.0],
    )
    return float(fit.x[0]), float(fit.x[1])


def _window(recording: Recording, motion: MotionRows, length: float) -> slice:
    """Return the rows of a given duration from the stop; raise NotMeasurableError if they were not recorded."""
    first = motion.arm_stop(recording)
    past = int(np.searchsorted(recording.time, recording.time[first] + length - 1e-9)) + 1
    if past > motion.end:
        seen = recording.time[motion.end - 1] - recording.time[first]
        raise NotMeasurableError(f"only {seen:.3f} s were recorded after the stop, {length} s are needed")
    return slice(first, past)
