"""RV, the residual vibration of the arm after its reference has stopped."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import find_peaks

from tvist_lab.metrics.errors import NotMeasurableError
from tvist_lab.metrics.felt import felt
from tvist_lab.metrics.motion import MotionRows
from tvist_lab.metrics.vibration import amplitude, tool_acceleration
from tvist_lab.recordings import Floats, Recording

WINDOW = 0.3
"""Time after the stop in which peaks are searched [s]."""
PROMINENCE = 0.1
"""Smallest prominence of a peak [m/s²]: three times the sensor's noise."""
SETTLE = 0.012
"""Time after the stop before modes are fitted [s], since the end of the deceleration ramp is not a ring-down."""


@dataclass(frozen=True)
class Residual:
    """RV as defined in the paper."""

    value: float
    """RV: the fitted decay at the stop, or the largest |α| if it could not be fitted [m/s²]."""
    decay: float
    """Rate λ of the fitted exponential [1/s]; NaN if there is none."""
    stop: float
    """Time t_b at which the shaped reference stops, or in a log the arm itself [s]."""
    peak_times: Floats
    """Times of the peaks [s], shape (P,)."""
    peaks: Floats
    """|α| at the peaks [m/s²], shape (P,)."""
    fitted: bool
    """False if there were fewer than two peaks, so that the value is the largest |α| in the window."""

    def curve(self, time: Floats) -> Floats:
        """The fitted decay at given times [m/s²]; constant if nothing was fitted."""
        rate = self.decay if self.fitted else 0.0
        return np.asarray(self.value * np.exp(-rate * (time - self.stop)), dtype=np.float64)


@dataclass(frozen=True)
class ModalResidual:
    """RV by linear least squares on known modes."""

    value: float
    """Amplitude of the vibration at the stop, all modes together [m/s²]."""
    amplitudes: Floats
    """Amplitude of each mode at the stop [m/s²], shape (M,). Nearly equal modes divide theirs arbitrarily."""
    rms: float
    """rms of the part that the modes do not explain, over all axes [m/s²]."""


def residual(recording: Recording, motion: MotionRows) -> Residual:
    """RV as in section 4.2 of the paper.

    Local maxima of |α| (from the sensor, without gravity) in the 0.3 s after the shaped reference stops, with a
    prominence of at least 0.1 m/s², are fitted by RV·exp(-λ(t - t_b)), λ ≥ 0, with least squares on a linear scale.
    Noise raises the later peaks and flattens the fit: small values have a floor of about 0.07 m/s² at 0.03 m/s² of
    noise.

    Raises:
        NotMeasurableError: The recording ends, or the next motion starts, within the window.
    """
    window = _window(recording, motion, WINDOW)
    stop = float(recording.time[window][0])
    # In the tick of the stop the reference still decelerates, so the measurement there is not a ring-down.
    time, alpha_xyz = felt(recording, motion, slice(window.start + 1, window.stop))
    alpha = amplitude(alpha_xyz)
    at, _ = find_peaks(alpha, prominence=PROMINENCE)
    if len(at) < 2:
        return Residual(float(np.max(alpha)), float("nan"), stop, time[at], alpha[at], fitted=False)
    value, decay = _exponential(time[at] - stop, alpha[at])
    return Residual(value, decay, stop, time[at], alpha[at], fitted=True)


def _exponential(t: Floats, y: Floats) -> tuple[float, float]:
    """Value at t = 0 and rate of the decaying exponential closest to the points, on a linear scale."""
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


def residual_by_modes(
    recording: Recording,
    motion: MotionRows,
    f_d: Floats | list[float],
    zeta: Floats | list[float],
    *,
    truth: bool = False,
) -> ModalResidual:
    """RV by linear least squares of α's three axes on e^(-σt)(cos ω_d t, sin ω_d t) of known modes.

    It uses every sample from 12 ms after the stop on, and is not biased by noise. Use it to rank shapers, and
    `residual` to compare with the paper. At the stop the modes add up to α = Re z, z = Σ (c - i s) in each axis; the
    value is the largest |α| of the ellipse that z describes in one turn.

    Args:
        recording: The recording.
        motion: One of its motions.
        f_d: Damped frequency of each mode at the end pose [Hz], shape (M,).
        zeta: Damping ratio of each mode [-], shape (M,).
        truth: Whether to use the truth channel, which is free of noise.

    Raises:
        NotMeasurableError: The recording ends, or the next motion starts, within the window.
    """
    window = _window(recording, motion, WINDOW)
    time = recording.time[window] - recording.time[motion.shaped_stop]
    alpha = tool_acceleration(recording, truth=truth, rows=window)
    late = time >= SETTLE - 1e-9
    omega = 2.0 * np.pi * np.asarray(f_d, dtype=np.float64)
    damping = np.asarray(zeta, dtype=np.float64)
    sigma = omega * damping / np.sqrt(1.0 - damping**2)
    decay = np.exp(-np.outer(time[late], sigma))
    phase = np.outer(time[late], omega)
    basis = np.hstack([decay * np.cos(phase), decay * np.sin(phase)])
    weights, *_ = np.linalg.lstsq(basis, alpha[late])
    unexplained = alpha[late] - basis @ weights
    cosine, sine = weights[: len(omega)], weights[len(omega) :]
    amplitudes = np.array([_major_axis(c, s) for c, s in zip(cosine, sine, strict=True)])
    return ModalResidual(
        value=_major_axis(cosine.sum(axis=0), sine.sum(axis=0)),
        amplitudes=amplitudes,
        rms=float(np.sqrt(np.mean(unexplained**2))),
    )


def _major_axis(cosine: Floats, sine: Floats) -> float:
    """Largest norm of c cos φ + s sin φ over φ."""
    return float(np.linalg.norm(np.column_stack([cosine, sine]), ord=2))


def _window(recording: Recording, motion: MotionRows, length: float) -> slice:
    """Rows of a given duration, beginning at the stop."""
    first = motion.arm_stop(recording)
    past = int(np.searchsorted(recording.time, recording.time[first] + length - 1e-9)) + 1
    if past > motion.end:
        seen = recording.time[motion.end - 1] - recording.time[first]
        raise NotMeasurableError(f"only {seen:.3f} s were recorded after the stop, {length} s are needed")
    return slice(first, past)
