"""Tool acceleration α of one motion, for recordings of this controller and logs of others."""

import numpy as np
from numpy.typing import NDArray

from tvist_lab.metrics.errors import NotMeasurableError
from tvist_lab.metrics.motion import MotionRows
from tvist_lab.metrics.vibration import SENSOR, best_tool_acceleration, low_pass_at, tool_acceleration
from tvist_lab.recordings import Floats, Recording

REST = (0.2, 1.0)  # shortest and longest time at the end of a rest from which gravity is found [s]


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
