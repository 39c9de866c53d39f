"""E, the distance to the attained position, and the paper's metrics based on it (after ISO 9283)."""

from dataclasses import dataclass

import numpy as np

from tvist_lab.metrics.errors import NotMeasurableError
from tvist_lab.metrics.motion import MotionRows
from tvist_lab.recordings import Floats, Recording

REPEATABILITY = 3.0e-5  # repeatability of the UR5e: half-width of the band around the attained position [m]
TAIL = 0.2  # time at the end of the recorded rest whose mean is the attained position [s]


@dataclass(frozen=True)
class Settling:
    """Settling of a motion; times count from the start of the reference before shaping."""

    attained: Floats
    """Attained position of the tool [m], shape (3,)."""
    enter: float
    """t_enter: time at which E first falls below the repeatability [s]."""
    cycle: float
    """t_cycle: last time at which E is above the repeatability [s]."""
    stabilisation: float
    """t_stb = t_cycle - t_enter [s]; zero if E never leaves the band again."""
    overshoot: float
    """e_os: largest E after t_enter, zero if that is within the repeatability [m]."""


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


def settling(recording: Recording, motion: MotionRows, band: float = REPEATABILITY) -> Settling:
    """Return t_enter, t_stb, t_cycle and e_os as in section 4.2 of the paper, interpolated between ticks.

    At least a second of rest should follow the motion, since integrators creep. `band` is the half-width of
    the band [m].
    """
    E = distance(recording, motion)
    time = recording.time[motion.start : motion.end] - recording.time[motion.start]
    outside = np.greater(E, band)
    if not outside.any():
        raise NotMeasurableError(f"the tool moved by less than the {1e3 * band:g} mm band")
    last = int(np.flatnonzero(outside)[-1])
    if last >= _tail(recording, motion).start - motion.start:
        raise NotMeasurableError(f"the tool had not settled within {1e3 * band:g} mm when the rest ended")
    departed = int(np.argmax(outside))
    first = departed + int(np.argmin(outside[departed:]))
    enter = _crossing(time, E, first - 1, band)
    cycle = _crossing(time, E, last, band)
    overshoot = float(np.max(E[first:]))
    return Settling(
        attained=attained_position(recording, motion),
        enter=enter,
        cycle=cycle,
        stabilisation=cycle - enter,
        overshoot=overshoot if overshoot > band else 0.0,
    )


def _crossing(time: Floats, E: Floats, row: int, band: float) -> float:
    """Return the time at which E crosses the band between a row and the next."""
    share = (E[row] - band) / (E[row] - E[row + 1])
    return float(time[row] + share * (time[row + 1] - time[row]))


def _tail(recording: Recording, motion: MotionRows) -> slice:
    """Return the rows whose mean is the attained position; raise NotMeasurableError if the rest was too short."""
    first = int(np.searchsorted(recording.time, recording.time[motion.end - 1] - TAIL + 1e-9))
    if first <= motion.shaped_stop:
        raise NotMeasurableError(f"the tool was recorded at rest for less than {TAIL} s")
    return slice(first, motion.end)
