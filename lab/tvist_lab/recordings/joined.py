"""Join the logs of a robot and of a sensor at its tool into one recording on the robot's clock."""

from pathlib import Path

import numpy as np

from tvist_lab.phrases import counted
from tvist_lab.recordings.checks import ACCELEROMETER, GYROSCOPE, TIME
from tvist_lab.recordings.read import read
from tvist_lab.recordings.recording import Floats, Recording, RecordingError
from tvist_lab.recordings.table import SENSOR, ticks_of
from tvist_lab.recordings.two_clocks import RATE, BodyFrameSignal, Clocks, at_flange, by_sensor, fits
from tvist_plant.description import DescriptionError, RobotDescription, load, robots
from tvist_plant.user_file import UserFileError

CORRELATED = 0.9  # smallest correlation between both signals [-]
AS_WELL = 0.3  # a second fit makes a join ambiguous if it explains this share of what the best explains [-]
ALIKE = 3.0  # ... and leaves unexplained at most this multiple of what the best leaves [-]
NOISE = 2e-3  # share of any fit that noise leaves unexplained [-]
OFFSET, DRIFT = 2.5e-3, 2e-4  # largest half intervals of the offset [s] and of the drift [-]
MOVED = {
    False: (0.3, "the flange turns by {:.2g} rad in all"),
    True: (3.0, "its force changes by {:.2g} m/s² in all"),
}  # smallest motion of a log and its description, for rotation (False) and force (True)
SIZES = (0.8, 1.25)  # range of the ratio of the joints' motion to the sensor's [-]
DEFAULT = "ur5e"
REMEDY = (
    "record both at once for 20 s or more, the sensor fixed to the tool: fast motions of several joints, others at the "
    "end than at the beginning, and 5 s of rest before and after them"
)  # advice that makes a join possible


class JoinError(RecordingError):
    """Two logs cannot be joined reliably; the message tells what to record instead."""


def joined(
    recording: Recording, imu: Path, imu_columns: str | None = None, robot: str | None = None
) -> Recording:
    """Put a sensor's rows on the robot's clock, and interpolate the robot's columns there.

    Offset and drift are those with which the gyroscope, or else the accelerometer, agrees best with the
    forward kinematics of the joint angles. `robot` is a name or file, by default that of the recording, or a
    UR5e. Rows are the sensor's within the robot's time; notes describe the clocks. Raises JoinError if the
    result would be unreliable.
    """
    sensor = read(imu, imu_columns, SENSOR)
    arm, assumed = _robot(recording, robot)
    name = "actual_q" if "actual_q" in recording and np.isfinite(recording["actual_q"]).any() else "target_q"
    q = recording[name]
    if q.shape[1] != arm.joints:
        raise JoinError(
            f"the log has {q.shape[1]} joints, a {arm.robot.model} has {arm.joints}: give the robot with --robot"
        )
    force = GYROSCOPE not in sensor or not np.isfinite(sensor[GYROSCOPE]).any()
    clocks, size = _told(imu, at_flange(arm, recording.time, q, force=force), sensor, force=force)
    at = clocks.first(sensor.time)
    kept = (at >= recording.time[0]) & (at <= recording.time[-1])
    columns = {key: _between(recording.time, column, at[kept]) for key, column in recording.columns.items()}
    columns |= {TIME: at[kept], ACCELEROMETER: sensor[ACCELEROMETER][kept]}
    if not force:
        columns[GYROSCOPE] = size * sensor[GYROSCOPE][kept]
    columns["tick"], gaps = ticks_of(at[kept])
    own = (f"{imu}: {note}" for note in sensor.notes)
    notes = [*recording.notes, *own, _said(imu, clocks, force=force), *assumed]
    if size != 1.0:
        notes.append(f"{imu}: {GYROSCOPE} is taken as deg/s")
    if name == "target_q":
        notes.append(
            "the log has no actual_q: the sensor is put on the target's time, which the arm follows later"
        )
    if ACCELEROMETER in recording:
        notes.append(f"{ACCELEROMETER} is that of {imu}, not the log's own")
    if outside := int(np.count_nonzero(~kept)):
        notes.append(f"{counted(outside, 'row')} of {imu} outside of the robot's time left out")
    return Recording(columns, info=recording.info, notes=(*notes, *gaps), foreign=True)


def _robot(recording: Recording, robot: str | None) -> tuple[RobotDescription, list[str]]:
    """Return the robot for the kinematics, and a note if neither the log nor the user names a robot."""
    assumed = []
    if robot is None and recording.info is not None:
        robot = str(recording.info.model).lower()
        if robot not in robots():
            raise JoinError(f"the log is of a {recording.info.model}: give its robot file with --robot")
    elif robot is None:
        robot = DEFAULT
        assumed = ["the log does not name its robot: a UR5e's kinematics count, unless --robot names another"]
    try:
        return load(robot), assumed
    except (DescriptionError, UserFileError) as error:
        raise JoinError(str(error)) from error


def _told(imu: Path, felt: BodyFrameSignal, sensor: Recording, *, force: bool) -> tuple[Clocks, float]:
    """Return the relation of the clocks, and the factor that converts the gyroscope's readings to SI."""
    least, moved = MOVED[force]
    if (amount := float(felt.change.sum()) / RATE) < least:
        raise JoinError(f"{imu} cannot be joined: {moved.format(amount)}, which is too little: {REMEDY}")
    found, size = list[Clocks](), 1.0
    for size in (1.0,) if force else (1.0, np.pi / 180.0):
        vector = sensor[ACCELEROMETER] if force else size * sensor[GYROSCOPE]
        found = fits(felt, by_sensor(sensor.time, vector, force=force))
        if found and found[0].correlation >= CORRELATED and SIZES[0] < found[0].scale < SIZES[1]:
            break
    else:
        most = f"{found[0].correlation:.2f} at best" if found else "none"
        raise JoinError(
            f"{imu} cannot be joined: its motion is not that of the joint angles (correlation {most}, needed "
            f"{CORRELATED:g}). Is --robot right, and are the units? If so, {REMEDY}"
        )
    best, *others = found
    for other in others:
        as_well = 1.0 - other.correlation**2 <= ALIKE * (1.0 - best.correlation**2) + NOISE
        if as_well and other.explained >= AS_WELL * best.explained:
            apart = abs(other.offset(best.middle) - best.offset(best.middle))
            raise JoinError(
                f"{imu} cannot be joined: the motions repeat, so its clock may be off by {apart:.2f} s: {REMEDY}"
            )
    offset, drift = best.half
    if offset > OFFSET or drift > DRIFT:
        raise JoinError(
            f"{imu} cannot be joined: the clocks' offset is known to {1e3 * offset:.1f} ms and their drift to "
            f"{100.0 * drift:.3f} %, needed are {1e3 * OFFSET:g} ms and {100.0 * DRIFT:g} %: {REMEDY}"
        )
    return best, size


def _said(imu: Path, clocks: Clocks, *, force: bool) -> str:
    ahead, (offset, drift) = clocks.offset(clocks.span[0]), clocks.half
    return (
        f"{imu} joined by its {'accelerometer' if force else 'gyroscope'}: at {clocks.span[0]:.3f} s of the robot its "
        f"clock is {abs(ahead):.4f} s {'ahead' if ahead > 0.0 else 'behind'} (± {1e3 * offset:.1f} ms), and it runs "
        f"{100.0 * abs(clocks.drift):.3f} % (± {100.0 * drift:.3f} %) {'fast' if clocks.drift > 0.0 else 'slow'}; "
        f"correlation {clocks.correlation:.3f}"
    )


def _between(time: Floats, column: Floats, at: Floats) -> Floats:
    """Return a column at other times; whole numbers such as modes are held, others interpolated."""
    known = column[np.isfinite(column)]
    if np.array_equal(known, np.round(known)):
        return column[np.searchsorted(time, at, side="right") - 1]
    if column.ndim == 1:
        return np.interp(at, time, column)
    return np.column_stack([np.interp(at, time, axis) for axis in column.T])
