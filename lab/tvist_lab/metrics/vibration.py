"""α, the acceleration of the tool measured by its accelerometer, without gravity."""

from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

from tvist_lab.recordings import Floats, Recording
from tvist_lab.recordings.checks import LONG_GAP
from tvist_plant.tool_acceleration import tool_acceleration as without_gravity

BAND = (3.0, 60.0)  # frequency range of an arm's vibrations [Hz]
SENSOR = "actual_tool_accelerometer"
TRUTH = "truth_tool_acceleration"
TRUE_POSE = "truth_flange_pose"
FILLED = 10  # largest factor by which filling gaps may extend a part of a log, to bound the memory
ALL = slice(None)


class NotMeasurableError(ValueError):
    """A metric cannot be computed from this recording; the message gives the reason."""


def tool_acceleration(recording: Recording, *, truth: bool = False, rows: slice = ALL) -> Floats:
    """Return the acceleration α of the flange in its own frame, shape (T, 3) [m/s²].

    The sensor measures the specific force; at rest, this is the reaction to gravity, which follows from
    `actual_TCP_pose`. `truth` selects the noise-free truth channel, with the flexible arm's orientation if
    recorded. Raises RecordingError if a column is missing, NotMeasurableError if it has gaps in these rows.
    """
    name = TRUTH if truth else SENSOR
    force = recording[name][rows]
    if not np.isfinite(force).all():
        raise NotMeasurableError(f"{name} is missing at some ticks")
    pose = recording[TRUE_POSE if truth and TRUE_POSE in recording else "actual_TCP_pose"]
    return without_gravity(force, Rotation.from_rotvec(pose[rows, 3:6]).inv().apply([0.0, 0.0, 1.0]))


def best_tool_acceleration(recording: Recording, rows: slice = ALL) -> Floats:
    """Return α from the truth channel if recorded, else from the sensor below 60 Hz [m/s²], shape (T, 3)."""
    # White noise of 0.03 m/s² per axis alone exceeds 0.1 m/s² in one tick of a hundred, so the raw sensor
    # cannot show the last time above a threshold.
    if TRUTH in recording:
        return tool_acceleration(recording, truth=True, rows=rows)
    return low_pass(tool_acceleration(recording), recording.period)[rows]


def amplitude(alpha: Floats) -> Floats:
    """Return |α| [m/s²], shape (T,)."""
    return np.asarray(np.linalg.norm(alpha, axis=1), dtype=np.float64)


def low_pass(signal: Floats, period: float, cut_off: float = BAND[1]) -> Floats:
    """Low-pass filter a signal with zero phase (Butterworth, forwards and backwards), below 0.45 of its rate."""
    cut_off = min(cut_off, 0.45 / period)
    return _both_ways(_designed(4, cut_off, "lowpass", 1.0 / period), signal)


def low_pass_at(time: Floats, signal: Floats, period: float, cut_off: float = BAND[1]) -> Floats:
    """Low-pass filter samples with gaps; missing samples are interpolated first, and left out of the result.

    Parts separated by a long gap are filtered separately to bound the memory. `time` [s] has shape (T,),
    `signal` (T, k); `period` [s] is that without gaps, `cut_off` in Hz.
    """
    filtered = np.array(signal)
    for rows in parts(time):
        if len(own := time[rows]) > 1:
            step = max(period, float(own[-1] - own[0]) / (FILLED * len(own)))
            grid = np.arange(own[0], own[-1] + 0.5 * step, step)
            below = low_pass(
                np.column_stack([np.interp(grid, own, axis) for axis in signal[rows].T]), step, cut_off
            )
            filtered[rows] = np.column_stack([np.interp(own, grid, axis) for axis in below.T])
    return filtered


def parts(time: Floats) -> list[slice]:
    """Return the rows between the long gaps of increasing times."""
    ends = [0, *(np.flatnonzero(np.diff(time) > LONG_GAP) + 1).tolist(), len(time)]
    return [slice(first, past) for first, past in pairwise(ends)]


def band_pass(signal: Floats, period: float) -> Floats:
    """Band-pass filter a signal with zero phase (Butterworth, forwards and backwards)."""
    return _both_ways(_designed(2, (BAND[0], min(BAND[1], 0.45 / period)), "bandpass", 1.0 / period), signal)


@lru_cache(maxsize=16)
def _designed(order: int, ends: float | tuple[float, float], kind: str, rate: float) -> Floats:
    """Return the sections of a Butterworth filter; cached, since the design takes as long as filtering a motion."""
    return np.asarray(butter(order, ends, kind, fs=rate, output="sos"))


def _both_ways(sos: Floats, signal: Floats) -> Floats:
    padding = min(3 * (2 * len(sos) + 1), len(signal) - 1)
    return np.asarray(sosfiltfilt(sos, signal, axis=0, padlen=padding), dtype=np.float64)
