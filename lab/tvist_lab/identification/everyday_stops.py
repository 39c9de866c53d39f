"""Ring-downs after the stops of everyday motions, from recordings and from logs of other controllers.

Such a stop was not planned to tell anything. Its ring-down counts from where the arm is not driven any more until it
moves again, if nothing shaped the motion and the vibration stands out of the noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from tvist_lab.identification.payload import ball
from tvist_lab.identification.ring_downs import LEAST_NOISE, SAMPLES, SKIPPED, Ringing
from tvist_lab.identification.servo_response import fresh
from tvist_lab.metrics import MotionRows, motions, still_driven
from tvist_lab.metrics.vibration import SENSOR
from tvist_lab.recordings import Floats, Recording, RecordingError
from tvist_plant.plant import PERIOD
from tvist_protocol.values import Payload

SHORTEST = 0.2
"""Shortest ring-down that is used [s]."""
SLOWEST = 0.01
"""Longest time between samples that show an arm's vibration [s]."""
QUIET = 1.15
"""A ring-down whose rms is less than this times its noise contains no information [-]."""
BEFORE = 0.15
"""Time before a motion in which the noise is looked for [s]."""
INEXACT = 0.1
"""Share of a ring-down that no linear model explains, since friction and gears are not linear [-]."""
UNSHAPED = 1.5
"""Number of ticks by which an unshaped reference may seem longer than it is."""
CONTRADICTS = "it contradicts the other stops"
"""Reason of a stop whose ring-down no springs and drives explain together with the others'."""


@dataclass(frozen=True)
class Log:
    """A recording of a robot, or a log of one."""

    name: str
    """What people call it: the name of its file."""
    recording: Recording
    payload: Payload | None = None
    """What the arm carried; None for what the recording says."""

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
    stop = motion.arm_stop(recording)
    begin = SKIPPED * PERIOD
    if recording.foreign:
        begin = max(begin, still_driven(recording, motion.start, stop))
    time = recording.time
    first, past = np.searchsorted(time, time[stop] + np.array([begin, begin + SAMPLES * PERIOD]) - 1e-9)
    rows = np.arange(first, min(past, motion.end))
    rows = rows[np.isfinite(recording[SENSOR][rows]).all(axis=1)]
    if len(rows) < 2 or time[rows[-1]] - time[rows[0]] < SHORTEST - 1.5 * recording.period:
        return Stop(log.name, number, None, f"the arm rested for less than {SHORTEST:g} s")
    name = "target_q" if "target_q" in recording else "actual_q"
    force = recording[SENSOR][rows]
    q, late = recording[name][stop], time[rows] - time[rows[0]]
    ringing = Ringing(q, payload, force, noise_of(recording, motion), late)
    if ringing.rms < QUIET * ringing.noise:
        return Stop(log.name, number, None, "the vibration does not stand out of the noise")
    return Stop(log.name, number, replace(ringing, inexact=INEXACT * ringing.rms))


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
