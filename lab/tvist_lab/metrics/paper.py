"""The paper's metrics: E, the distance to the attained position (after ISO 9283), and RV, the residual."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import find_peaks

from tvist_lab.metrics.common_clock import acceleration_of
from tvist_lab.metrics.motion import MotionRows
from tvist_lab.metrics.vibration import NotMeasurableError, amplitude
from tvist_lab.recordings import Floats, Recording

REPEATABILITY = 3.0e-5  # repeatability of the UR5e: half-width of the band around the attained position [m]
TAIL = 0.2  # time at the end of the recorded rest whose mean is the attained position [s]
WINDOW = 0.3  # time after the stop in which peaks are sought [s]
PROMINENCE = 0.1  # smallest prominence of a peak [m/s²]: three times the sensor's noise


@dataclass(frozen=True)
class Settling:
    """Settling of a motion; times count from the start of the reference before shaping."""

    enter: float
    """t_enter: time at which E first falls below the repeatability [s]."""
    cycle: float
    """t_cycle: last time at which E is above the repeatability [s]."""
    stabilisation: float
    """t_stb = t_cycle - t_enter [s]; zero if E stays within the repeatability after t_enter."""
    overshoot: float
    """e_os: largest E after t_enter [m]; zero if it is within the repeatability."""


def attained_position(recording: Recording, motion: MotionRows) -> Floats:
    """Return the tool's mean position over the last 0.2 s before the next motion [m], shape (3,).

    As in the paper, it is the forward kinematics of the joint angles, without the bending of links.
    """
    rows = _tail(recording, motion)
    return np.asarray(np.mean(recording["actual_TCP_pose"][rows, :3], axis=0), dtype=np.float64)


def distance(recording: Recording, motion: MotionRows) -> Floats:
    """Return E, the distance of the tool from its attained position [m], for all rows of the motion."""
    position = recording["actual_TCP_pose"][motion.start : motion.end, :3]
    if not np.isfinite(position).all():
        raise NotMeasurableError("actual_TCP_pose is empty in some rows")
    return np.asarray(
        np.linalg.norm(position - attained_position(recording, motion), axis=1), dtype=np.float64
    )


def settling(recording: Recording, motion: MotionRows) -> Settling:
    """Return t_enter, t_stb, t_cycle and e_os as in section 4.2 of the paper, interpolated between ticks.

    At least a second of rest should follow the motion, since integrators creep.
    """
    E = distance(recording, motion)
    time = recording.time[motion.start : motion.end] - recording.time[motion.start]
    outside = np.greater(E, REPEATABILITY)
    if not outside.any():
        raise NotMeasurableError(f"the tool moved by less than the {1e3 * REPEATABILITY:g} mm band")
    last = int(np.flatnonzero(outside)[-1])
    if last >= _tail(recording, motion).start - motion.start:
        raise NotMeasurableError(
            f"the tool had not settled within {1e3 * REPEATABILITY:g} mm when the rest ended"
        )
    departed = int(np.argmax(outside))
    first = departed + int(np.argmin(outside[departed:]))
    enter, cycle = (_crossing(time, E, row) for row in (first - 1, last))
    overshoot = float(np.max(E[first:]))
    return Settling(enter, cycle, cycle - enter, overshoot if overshoot > REPEATABILITY else 0.0)


def _crossing(time: Floats, E: Floats, row: int) -> float:
    """Return the time at which E crosses the band between a row and the next."""
    share = (E[row] - REPEATABILITY) / (E[row] - E[row + 1])
    return float(time[row] + share * (time[row + 1] - time[row]))


def _tail(recording: Recording, motion: MotionRows) -> slice:
    """Return the rows whose mean is the attained position; raise NotMeasurableError if the rest was too short."""
    first = int(np.searchsorted(recording.time, recording.time[motion.end - 1] - TAIL + 1e-9))
    if first <= motion.shaped_stop:
        raise NotMeasurableError(f"the tool was recorded at rest for less than {TAIL} s")
    return slice(first, motion.end)


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
    first = motion.arm_stop(recording)
    stop = float(recording.time[first])
    past = int(np.searchsorted(recording.time, stop + WINDOW - 1e-9)) + 1
    if past > motion.end:
        seen = recording.time[motion.end - 1] - stop
        raise NotMeasurableError(f"only {seen:.3f} s were recorded after the stop, {WINDOW} s are needed")
    # In the tick of the stop the reference still decelerates, so the measurement there is not a ring-down.
    time, alpha_xyz = acceleration_of(recording, motion, slice(first + 1, past))
    alpha = amplitude(alpha_xyz)
    at, _ = find_peaks(alpha, prominence=PROMINENCE)
    if len(at) < 2:
        return Residual(float(np.max(alpha)), float("nan"), stop, time[at], alpha[at], fitted=False)
    value, decay = _exponential(time[at] - stop, alpha[at])
    return Residual(value, decay, stop, time[at], alpha[at], fitted=True)


def _exponential(t: Floats, y: Floats) -> tuple[float, float]:
    """Return value at t = 0 and rate of the decaying exponential closest to the points, on a linear scale."""
    slope, log_value = np.polyfit(t, np.log(y), 1)
    # Start the search inside its bounds, since it is slow to leave a bound.
    fit = least_squares(
        lambda p: p[0] * np.exp(-p[1] * t) - y,
        [float(np.exp(log_value)), max(-float(slope), 1.0)],
        jac=lambda p: np.column_stack([np.exp(-p[1] * t), -p[0] * t * np.exp(-p[1] * t)]),
        bounds=([0.0, 0.0], [np.inf, np.inf]),
        x_scale=[1.0, 10.0],
    )
    return float(fit.x[0]), float(fit.x[1])
