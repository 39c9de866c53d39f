"""Find usable ring-downs: after stops, not driven, without a shaper, and with vibration above the noise."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from tvist_client.errors import ClientError
from tvist_lab.identification.unknowns import ball
from tvist_lab.metrics import MotionRows, motions, still_driven
from tvist_lab.metrics.vibration import SENSOR
from tvist_lab.recordings import Floats, Recording, RecordingError
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_protocol.info import Info
from tvist_protocol.values import Payload

BEGINS = 7 * PERIOD  # time after a stop that is ignored, since the deceleration has not ended [s]
LONGEST, SHORTEST = 0.4, 0.2  # longest and shortest ring-down used [s]
SLOWEST = 0.01  # longest sampling period that shows an arm's vibration [s]
LEAST_NOISE = 0.01  # smallest assumed noise, since no model is more accurate [m/s²]
SIGNAL_TO_NOISE = 1.15  # smallest ratio of rms to noise of a usable ring-down [-]
BEFORE = 0.15  # time before a motion in which the noise is measured [s]
INEXACT = 0.1  # share of an everyday ring-down that no linear model explains [-]
UNSHAPED = 1.5  # number of ticks by which an unshaped reference may seem longer than it is
CONTRADICTS = "it contradicts the others"
"""Reason for a ring-down that no springs and drives explain together with the others."""


Progress = Callable[[str], None]  # receives a description before each step of an identification


class IdentificationError(ClientError):
    """The robot could not be identified; the message tells what to do."""


def check_model(info: Info, description: RobotDescription) -> None:
    """Check that a robot file is of the robot that is connected."""
    if info.model != description.robot.model:
        raise IdentificationError(
            f"the robot is a {info.model}, its description of a {description.robot.model}: name its file"
        )


@dataclass(frozen=True)
class RingDownData:
    """Acceleration of the tool at a configuration after a stop."""

    q: Floats  # configuration, shape (n,) [rad]
    payload: int
    force: Floats  # specific force from shortly after the stop, shape (T, 3) [m/s²]
    noise: float  # noise of the force at rest, rms per axis [m/s²]
    time: Floats  # times of the samples after the first, shape (T,) [s]
    inexact: float = 0.0  # residual of a linear model beyond the noise, rms per axis [m/s²]
    driven: tuple[complex, ...] = ()
    """Poles with which the set-point settles after the stop, one per pair [1/s]; empty if it is at rest."""
    softening: float = 0.0  # share by which hysteresis softens the springs, per amplitude of the tool [1/m]

    def rms(self, late: float = 0.0) -> float:
        """Return the rms of the force without its mean, per axis, after a time [s] from the start [m/s²]."""
        rest = self.force[self.time >= late]
        return float(np.sqrt(np.mean((rest - rest.mean(axis=0)) ** 2)))


@dataclass(frozen=True)
class Log:
    """A recording of this controller or a log of another, and how to read its ring-downs."""

    name: str  # name for users: that of the file, or the number of a jog
    recording: Recording
    payload: Payload | None = None  # the carried payload; None means as recorded
    begins: float = BEGINS  # time after a stop that a ring-down ignores [s]
    inexact: float = INEXACT  # share of a ring-down that no linear model explains [-]
    driven: tuple[complex, ...] = ()
    """Poles with which the set-point still comes to rest, one of each pair [1/s]."""

    def carried(self, row: int) -> Payload:
        """Return the given, recorded or declared payload at a row; raise RecordingError if it is unknown."""
        if self.payload is not None:
            return self.payload
        recording = self.recording
        if "payload" in recording and np.isfinite(recording["payload"][row]):
            mass = float(recording["payload"][row])
            com = recording["payload_cog"][row] if "payload_cog" in recording else np.zeros(3)
            x, y, z = com.tolist()
            return Payload(mass=mass, com=(x, y, z), inertia=ball(mass))
        if recording.info is not None:
            return cast("Payload", recording.info.payload)
        raise RecordingError(f"{self.name} has no payload: give --payload MASS, 0 for none")


@dataclass(frozen=True)
class RingDownStop:
    """A motion's stop, and the ring-down after it if it is usable."""

    log: str
    motion: int  # number of the motion in the log, from 1
    ring_down: RingDownData | None
    reason: str = ""  # why the ring-down is not usable; equal for stops with the same problem


def stops_of(logs: Sequence[Log]) -> tuple[list[RingDownStop], tuple[Payload, ...]]:
    """Return the stops of all motions, and the payloads to which the ring-downs refer by index.

    Raises RecordingError if a log has no joint angles, or if its payload is unknown.
    """
    payloads: dict[Payload, int] = {}
    stops = []
    for log in logs:
        for number, motion in enumerate(motions(log.recording), 1):
            index = payloads.setdefault(log.carried(motion.shaped_stop), len(payloads))
            stops.append(_stop(log, number, motion, index))
    return stops, tuple(payloads)


def unused(stops: Sequence[RingDownStop]) -> dict[str, int]:
    """Return the number of unused stops for each reason, the most frequent first."""
    return dict(Counter(stop.reason for stop in stops if stop.ring_down is None).most_common())


def objection(recording: Recording, motion: MotionRows) -> str:
    """Return why the acceleration after a motion cannot be used; empty if no reason is known."""
    if SENSOR not in recording:
        return f"the log has no {SENSOR}"
    if recording.period > SLOWEST:
        return (
            f"the log has a row every {1e3 * recording.period:.0f} ms, {1e3 * SLOWEST:.0f} ms show vibration"
        )
    if motion.stopped:
        return "the motion was stopped before its target"
    if ("reference_q" in recording and motion.delay(recording) > UNSHAPED * recording.period) or (
        "shaper_delay" in recording and np.any(recording["shaper_delay"][motion.start : motion.end] > 0.0)
    ):
        return "the motion was shaped"
    return ""


def _stop(log: Log, number: int, motion: MotionRows, payload: int) -> RingDownStop:
    recording = log.recording
    if reason := objection(recording, motion):
        return RingDownStop(log.name, number, None, reason)
    stop, begin = motion.arm_stop(recording), log.begins
    if recording.foreign:
        begin = max(begin, still_driven(recording, motion.start, stop))
    seen, time = fresh(recording), recording.time
    after = time[seen] - time[stop] - begin + 1e-9
    rows = seen[(after >= 0.0) & (after < LONGEST) & (seen < motion.end)]
    rows = rows[np.isfinite(recording[SENSOR][rows]).all(axis=1)]
    if len(rows) < 2 or time[rows[-1]] - time[rows[0]] < SHORTEST - 1.5 * recording.period:
        return RingDownStop(
            log.name, number, None, f"the arm rested for less than {SHORTEST:g} s, or states were lost"
        )
    q = recording["target_q" if "target_q" in recording else "actual_q"][stop]
    late = time[rows] - time[rows[0]]
    ring_down = RingDownData(
        q, payload, recording[SENSOR][rows], noise_of(recording, motion), late, driven=log.driven
    )
    if ring_down.rms() < SIGNAL_TO_NOISE * ring_down.noise:
        return RingDownStop(log.name, number, None, "the vibration does not stand out of the noise")
    return RingDownStop(log.name, number, replace(ring_down, inexact=log.inexact * ring_down.rms()))


def fresh(recording: Recording) -> NDArray[np.intp]:
    """Return the rows with new measurements; other rows repeat the measurements of the row before."""
    return np.flatnonzero(np.append(True, np.any(np.diff(recording[SENSOR], axis=0) != 0.0, axis=1)))


def noise_of(recording: Recording, motion: MotionRows) -> float:
    """Return the noise of the accelerometer, rms per axis [m/s²]."""
    # Take the smaller of two measures: the spread before the motion, if the arm was at rest, and the third
    # differences of the whole motion, which hardly contain vibration at a tenth of the sampling rate.
    # Repeated rows are ignored.
    first = int(np.searchsorted(recording.time, recording.time[motion.start] - BEFORE))
    before = _finite(recording[SENSOR][first : motion.start])
    seen = fresh(recording)
    whole = _finite(recording[SENSOR][seen[(seen >= motion.start) & (seen < motion.end)]])
    found = []
    if len(whole) > 3:
        typical = np.median(np.abs(np.diff(whole, 3, axis=0)), axis=0)
        found.append(float(np.sqrt(np.mean(typical**2) / 20.0)) / 0.6745)
    if len(before) > 0.5 * BEFORE / recording.period:
        found.append(float(np.sqrt(np.mean((before - before.mean(axis=0)) ** 2))))
    return max(min(found, default=0.0), LEAST_NOISE)


def _finite(values: Floats) -> Floats:
    return np.asarray(values[np.isfinite(values).all(axis=1)])
