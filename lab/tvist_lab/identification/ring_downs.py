"""Ring-downs after stops, from recordings of this controller and from logs of others: which can be used, and why not.

A ring-down counts from where the arm is not driven any more until it moves again, if nothing shaped the motion and the
vibration stands out of the noise.
"""

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
from tvist_plant.plant import PERIOD
from tvist_protocol.values import Payload

BEGINS = 7 * PERIOD
"""Time after a stop that a ring-down leaves out, since the end of the deceleration ramp is not a ring-down [s]."""
LONGEST, SHORTEST = 0.4, 0.2
"""Longest and shortest ring-down that is used [s]."""
SLOWEST = 0.01
"""Longest time between samples that show an arm's vibration [s]."""
LEAST_NOISE = 0.01
"""Smallest assumed noise, since no model is more accurate than that [m/s^2]."""
QUIET = 1.15
"""A ring-down whose rms is less than this times its noise contains no information [-]."""
BEFORE = 0.15
"""Time before a motion in which the noise is looked for [s]."""
INEXACT = 0.1
"""Share of an everyday ring-down that no linear model explains, since friction and gears are not linear [-]."""
UNSHAPED = 1.5
"""Number of ticks by which an unshaped reference may seem longer than it is."""
CONTRADICTS = "it contradicts the others"
"""Reason of a stop whose ring-down no springs and drives explain together with the others'."""


Progress = Callable[[str], None]
"""Called before each step of an identification with what it does."""


class IdentificationError(ClientError):
    """The robot could not be identified; the message says what to do."""


@dataclass(frozen=True)
class Ringing:
    """Acceleration of the tool at a configuration after a stop."""

    q: Floats
    """Configuration, shape (n,) [rad]."""
    payload: int
    """Index of the carried payload."""
    force: Floats
    """Specific force, beginning shortly after the stop, shape (T, 3) [m/s^2]."""
    noise: float
    """Noise of the force at rest, rms per axis [m/s^2]."""
    time: Floats
    """Times of the samples from the first on, shape (T,) [s]."""
    inexact: float = 0.0
    """What a linear model may leave of it beside the noise, rms per axis [m/s^2]."""
    driven: tuple[complex, ...] = ()
    """Poles with which the set-point still comes to rest, one of each pair [1/s]; empty if it rests."""
    softening: float = 0.0
    """Share by which the gears' hysteresis softens the springs, over the tool's amplitude [1/m]."""

    @property
    def rms(self) -> float:
        """Return the rms of the force without its mean, per axis [m/s^2]."""
        return self.rms_after(0.0)

    def rms_after(self, late: float) -> float:
        """Return the same some time after the first sample [m/s^2]."""
        rest = self.force[self.time >= late]
        return float(np.sqrt(np.mean((rest - rest.mean(axis=0)) ** 2)))


@dataclass(frozen=True)
class Log:
    """A recording of a robot, or a log of one, and how the ring-downs in it are to be read."""

    name: str
    """What people call it: the name of its file, or the number of a jog."""
    recording: Recording
    payload: Payload | None = None
    """What the arm carried; None for what the recording says."""
    begins: float = BEGINS
    """Time after a stop that a ring-down leaves out [s]."""
    inexact: float = INEXACT
    """Share of a ring-down that no linear model explains [-]."""
    driven: tuple[complex, ...] = ()
    """Poles with which the set-point still comes to rest, one of each pair [1/s]."""

    def carried(self, row: int) -> Payload:
        """Return what the arm carried, or was said to carry, in a row.

        Raises:
            RecordingError: Nobody says it.
        """
        recording = self.recording
        if self.payload is not None:
            return self.payload
        if "payload" in recording and np.isfinite(recording["payload"][row]):
            mass = float(recording["payload"][row])
            com = recording["payload_cog"][row] if "payload_cog" in recording else np.zeros(3)
            x, y, z = com.tolist()
            return Payload(mass=mass, com=(x, y, z), inertia=ball(mass))
        if recording.info is not None:
            return cast("Payload", recording.info.payload)
        raise RecordingError(
            f"{self.name} does not say what the arm carried: give --payload MASS, 0 for nothing"
        )


@dataclass(frozen=True)
class Stop:
    """A motion's stop, and the ring-down after it if it can be used."""

    log: str
    """Name of the log."""
    motion: int
    """Number of the motion in the log, from 1."""
    ringing: Ringing | None
    """The ring-down; None if it cannot be used."""
    reason: str = ""
    """Why it cannot be used: words that stops of the same kind share."""


def stops_of(logs: Sequence[Log]) -> tuple[list[Stop], tuple[Payload, ...]]:
    """Return the stops of all motions, and the payloads that their ring-downs refer to.

    Raises:
        RecordingError: A log has no joint angles, or does not say what the arm carried.
    """
    payloads: dict[Payload, int] = {}
    stops = []
    for log in logs:
        for number, motion in enumerate(motions(log.recording), 1):
            index = payloads.setdefault(log.carried(motion.shaped_stop), len(payloads))
            stops.append(_stop(log, number, motion, index))
    return stops, tuple(payloads)


def unused(stops: Sequence[Stop]) -> dict[str, int]:
    """Return each reason with the number of stops that were not used for it, the most frequent first."""
    return dict(Counter(stop.reason for stop in stops if stop.ringing is None).most_common())


def objection(recording: Recording, motion: MotionRows) -> str:
    """Return why the arm's acceleration after a motion says little of the arm; empty if it may say something."""
    if SENSOR not in recording:
        return f"the log has no {SENSOR}"
    if recording.period > SLOWEST:
        return (
            f"the log has a row every {1e3 * recording.period:.0f} ms, {1e3 * SLOWEST:.0f} ms show vibration"
        )
    if motion.stopped:
        return "the motion was stopped before its target"
    shaped = "reference_q" in recording and motion.delay(recording) > UNSHAPED * recording.period
    if shaped or (
        "shaper_delay" in recording and np.any(recording["shaper_delay"][motion.start : motion.end] > 0.0)
    ):
        return "the motion was shaped"
    return ""


def _stop(log: Log, number: int, motion: MotionRows, payload: int) -> Stop:
    recording = log.recording
    reason = objection(recording, motion)
    if reason:
        return Stop(log.name, number, None, reason)
    stop, begin = motion.arm_stop(recording), log.begins
    if recording.foreign:
        begin = max(begin, still_driven(recording, motion.start, stop))
    seen, time = fresh(recording), recording.time
    after = time[seen] - time[stop] - begin + 1e-9
    rows = seen[(after >= 0.0) & (after < LONGEST) & (seen < motion.end)]
    rows = rows[np.isfinite(recording[SENSOR][rows]).all(axis=1)]
    if len(rows) < 2 or time[rows[-1]] - time[rows[0]] < SHORTEST - 1.5 * recording.period:
        return Stop(
            log.name, number, None, f"the arm rested for less than {SHORTEST:g} s, or states were lost"
        )
    q = recording["target_q" if "target_q" in recording else "actual_q"][stop]
    late = time[rows] - time[rows[0]]
    ringing = Ringing(
        q, payload, recording[SENSOR][rows], noise_of(recording, motion), late, driven=log.driven
    )
    if ringing.rms < QUIET * ringing.noise:
        return Stop(log.name, number, None, "the vibration does not stand out of the noise")
    return Stop(log.name, number, replace(ringing, inexact=log.inexact * ringing.rms))


def fresh(recording: Recording) -> NDArray[np.intp]:
    """Indices of the rows with new measurements: a robot that sends fewer than it gets repeats the one before."""
    return np.flatnonzero(np.append(True, np.any(np.diff(recording[SENSOR], axis=0) != 0.0, axis=1)))


def noise_of(recording: Recording, motion: MotionRows) -> float:
    """Noise of the accelerometer, rms per axis [m/s^2].

    It is the smaller of two measures: the spread before the motion, if the arm was at rest by then, and what remains of
    the whole motion's third differences, which a vibration of a tenth of the sampling rate hardly enters. Rows that
    repeat the one before say nothing of it.
    """
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
