"""Acceleration of the tool in a motion, and metrics with times from the unshaped reference's start."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.signal import hilbert

from tvist_lab.metrics.motion import DIFFERENTIATOR_TICKS, MotionRows
from tvist_lab.metrics.ring_down import fit_ring_down
from tvist_lab.metrics.vibration import (
    SENSOR,
    NotMeasurableError,
    amplitude,
    band_pass,
    best_tool_acceleration,
    low_pass_at,
    tool_acceleration,
)
from tvist_lab.recordings import Floats, Recording

STILL = 0.1  # |α| below which an arm counts as at rest [m/s²]
AFTER_STOP = 0.010  # time after the stop from which the deceleration no longer shows [s]

NOISE_PEAK = 5.0  # largest |α| of noise within some seconds, relative to its rms in one axis [-]
NOISE_TAIL = 0.2  # time at the end of a rest in which the sensor shows its noise [s]
RINGS = 0.5  # share of a signal's energy explained by one mode from which it is vibration, not noise [-]

REST = (0.2, 1.0)  # shortest and longest time at the end of a rest from which gravity is found [s]

Kinematics = Callable[[Floats], tuple[Floats, Floats]]
"""Converts joint angles, shape (n,) [rad], to the flange's position, shape (3,) [m], and rotation, shape (3, 3)."""


def acceleration_of(
    recording: Recording, motion: MotionRows, rows: slice, *, smooth: bool = False
) -> tuple[Floats, Floats]:
    """Return times, shape (T,) [s], and the tool's acceleration without gravity, shape (T, 3) [m/s²], in some rows.

    In a log of another controller, the tool's mounting is unknown, so gravity is the sensor's mean at the end
    of the rest; rows without sensor values are left out. `smooth` uses the truth channel if there is one,
    else the sensor below 60 Hz.
    """
    if not recording.foreign:
        if smooth:
            return recording.time[rows], best_tool_acceleration(recording, rows)
        return recording.time[rows], tool_acceleration(recording, rows=rows)
    if SENSOR not in recording:
        raise NotMeasurableError(f"the log has no {SENSOR}")
    shown = np.asarray(np.isfinite(recording[SENSOR]).all(axis=1))
    gravity = _gravity(recording, motion, shown)
    if not smooth:
        kept = shown[rows]
        return recording.time[rows][kept], (recording[SENSOR][rows] - gravity)[kept]
    whole = np.flatnonzero(shown[motion.start : motion.end]) + motion.start
    alpha = low_pass_at(recording.time[whole], recording[SENSOR][whole] - gravity, recording.period)
    chosen = (whole >= rows.start) & (whole < rows.stop)
    return recording.time[whole[chosen]], alpha[chosen]


def _gravity(recording: Recording, motion: MotionRows, shown: NDArray[np.bool_]) -> Floats:
    """Return the sensor's mean in the last half of a rest, at most a second [m/s²], shape (3,)."""
    end = float(recording.time[motion.end - 1])
    rest = end - float(recording.time[motion.arm_stop(recording)])
    if rest < 1.5 * REST[0]:
        raise NotMeasurableError(
            f"only {rest:.3f} s of rest were recorded after the stop; {1.5 * REST[0]:g} s show gravity"
        )
    length = min(max(0.5 * rest, REST[0]), REST[1])
    first = int(np.searchsorted(recording.time, end - length))
    at_rest = recording[SENSOR][first : motion.end][shown[first : motion.end]]
    if not len(at_rest):
        raise NotMeasurableError(f"{SENSOR} is empty in the rest after the stop")
    return np.asarray(at_rest.mean(axis=0))


def vibration_after_stop(recording: Recording, motion: MotionRows) -> tuple[float, float]:
    """Return the largest |α| and envelope after the unshaped stop plus the declared delay [m/s²]."""
    # In a log of another controller, take values later than 10 ms after the arm's own stop.
    _, alpha = acceleration_of(recording, motion, _after_declared_stop(recording, motion), smooth=True)
    if len(alpha) < 2:
        raise NotMeasurableError("nothing was recorded after the stop")
    return float(np.max(amplitude(alpha))), float(np.max(envelope(alpha, recording.period)))


def still_after(recording: Recording, motion: MotionRows, threshold: float = STILL) -> float:
    """Return the last time when |α| exceeds a threshold [m/s²], from the unshaped reference's start [s]."""
    # Use the truth channel if there is one, otherwise the sensor below 60 Hz.
    time, alpha_xyz = acceleration_of(recording, motion, slice(motion.start, motion.end), smooth=True)
    alpha = amplitude(alpha_xyz)
    if recording.foreign and (noise := _noise(time, alpha_xyz)) * NOISE_PEAK > threshold:
        tail = time >= time[-1] - 2.0 * NOISE_TAIL
        window = {"time": time[tail] - time[tail][0], "skip": 0.0, "window": 2.0 * NOISE_TAIL}
        rings = (
            fit_ring_down(alpha_xyz[tail], recording.period, modes=2, offset=True, **window).r_squared > RINGS
        )
        raise NotMeasurableError(
            f"the arm still rang with {noise:.3f} m/s² rms when the rest ended"
            if rings
            else f"the sensor's noise of {noise:.3f} m/s² rms alone exceeds {threshold:g} m/s²"
        )
    loud = np.flatnonzero(alpha > threshold)
    if not loud.size:
        return 0.0
    if loud[-1] == len(alpha) - 1:
        raise NotMeasurableError(f"|α| still exceeded {threshold:g} m/s² when the rest ended")
    return float(time[loud[-1]] - recording.time[motion.start])


def peak_after_stop(recording: Recording, motion: MotionRows) -> float:
    """Return the largest true |α| later than 10 ms after the shaped reference's stop [m/s²], for `evaluate`."""
    return peak_later_than(recording, motion, recording.time[motion.shaped_stop] + AFTER_STOP)


def peak_later_than(recording: Recording, motion: MotionRows, moment: float) -> float:
    """Return the largest true |α| later than a time of the recording [m/s²]."""
    rows = _later_than(recording, motion, moment)
    return float(np.max(amplitude(tool_acceleration(recording, truth=True, rows=rows))))


def peak_acceleration(recording: Recording, motion: MotionRows) -> float:
    """Return the largest |q̈*| of any joint during the motion [rad/s²]."""
    return float(np.max(np.abs(recording["target_qdd"][motion.start : motion.shaped_stop + 2])))


def peak_velocity(recording: Recording, motion: MotionRows) -> float:
    """Return the largest |q̇*| of any joint during the motion [rad/s]."""
    return float(np.max(np.abs(recording["target_qd"][motion.start : motion.shaped_stop + 2])))


def envelope(alpha: Floats, period: float) -> Floats:
    """Return the envelope of a ring-down within 3 to 60 Hz [m/s²]: the norm of its axes' analytic signals.

    `alpha` [m/s²], shape (T, 3), is mirrored at both ends before filtering, to exclude the motion before it.
    The filter needs several cycles: depending on phase, the peak is 90 to 100 % of the amplitude at ζ = 0.03,
    40 to 85 % at ζ = 0.34.
    """
    rows = len(alpha)
    analytic = hilbert(band_pass(np.concatenate([alpha[:0:-1], alpha, alpha[-2::-1]]), period), axis=0)
    return np.asarray(np.linalg.norm(np.abs(analytic), axis=1)[rows - 1 : 2 * rows - 1], dtype=np.float64)


def rigid_acceleration(recording: Recording, motion: MotionRows, kinematics: Kinematics) -> Floats:
    """Return the acceleration of a rigid arm's flange along the shaped reference, in its frame [m/s²].

    It is the second central difference of the position at `target_q`, for each row from the motion's start to
    its shaped stop, shape (N, 3).
    """
    first, past = max(motion.start, 1), min(motion.shaped_stop + 1, len(recording) - 1)
    if np.any(np.diff(recording["tick"][first - 1 : past + 1]) != 1.0):
        raise NotMeasurableError("ticks are missing in the motion")
    poses = [kinematics(q) for q in recording["target_q"][first - 1 : past + 1]]
    position = np.array([pose[0] for pose in poses])
    rotation = np.array([pose[1] for pose in poses])[1:-1]
    world = (position[2:] - 2.0 * position[1:-1] + position[:-2]) / recording.period**2
    return np.asarray(np.einsum("tji,tj->ti", rotation, world), dtype=np.float64)


def in_motion_rms(recording: Recording, motion: MotionRows, rigid: Floats) -> float:
    """Return the rms of |α - `rigid`|, see `rigid_acceleration`, until the shaped reference stops [m/s²]."""
    first = max(motion.start, 1)
    alpha = best_tool_acceleration(recording)[first : first + len(rigid)]
    return float(np.sqrt(np.mean(np.sum((alpha - rigid) ** 2, axis=1))))


def _noise(time: Floats, alpha: Floats) -> float:
    """Return the largest rms of an axis at the end of the rest [m/s²]."""
    tail = alpha[time >= time[-1] - NOISE_TAIL] if len(time) else alpha
    return float(np.max(np.std(tail, axis=0))) if len(tail) else 0.0


def _after_declared_stop(recording: Recording, motion: MotionRows) -> slice:
    """Return the rows after the unshaped stop plus the delay that the shaper declares at that time."""
    if recording.foreign:
        return _later_than(recording, motion, recording.time[motion.arm_stop(recording)] + AFTER_STOP)
    delay = float(np.nan_to_num(recording["shaper_delay"][motion.reference_stop]))
    published = DIFFERENTIATOR_TICKS * recording.period
    return _later_than(recording, motion, recording.time[motion.reference_stop] + delay + published)


def _later_than(recording: Recording, motion: MotionRows, moment: float) -> slice:
    """Return the motion's rows later than a given time; raise NotMeasurableError if there is none."""
    first = int(np.searchsorted(recording.time, moment + 1e-9))
    if first >= motion.end:
        raise NotMeasurableError("nothing was recorded after the stop")
    return slice(first, motion.end)
