"""Corrections of motions that are made again: what the motors add, behind all feed-forward, before a stop.

A correction is a sum of bumps of the first three joints' positions, each a B-spline of degree four, so that position,
velocity and acceleration are zero at both ends: once begun it goes on to its end, whatever becomes of the motion, and
never jumps. It is added to what the drives get, behind the lead of `elastic_lead`. That is an inverse of the arm: of a
correction in front of it, the lead would make the motors' motion with which the tool makes just that one and does not
ring. A bump that has ended before the stop would then leave nothing after it, so that no vibration could be cancelled,
and learning would ask for ever larger bumps.
"""

from collections.abc import Callable
from hashlib import blake2b

import numpy as np
from msgspec import Struct

from tvist_controller.line.differentiator import Floats
from tvist_controller.trajectory import PlannedMotion, Trajectory
from tvist_plant.description import RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import PERIOD
from tvist_protocol.lessons import Bumps, MotionLesson

BUMPS, STEP = 10, 10
"""Number of bumps of a joint, and of ticks from one to the next."""
LENGTH = (BUMPS + 4) * STEP
"""Number of ticks of a correction."""
JOINTS = 3
"""Number of joints that are corrected: the first ones, which move the whole arm."""
MOST = 0.35
"""Largest acceleration of a correction [rad/s^2]."""
FARTHEST = 1e-3
"""Largest angle of a correction [rad]."""
KEPT = 100
"""Number of motions that have a correction; the one that was made longest ago is dropped."""
LOOKS = 16
"""Number of places at which two motions are compared."""
ALIKE = 1e-9
"""Difference of angles that counts as none [rad]."""


def _bumps() -> Floats:
    """Position, velocity and acceleration of each bump, shape (10, 3, 140), of a largest acceleration of 1 rad/s²."""
    x = np.arange(LENGTH) / STEP - np.arange(BUMPS)[:, np.newaxis]  # in steps since each began
    weights = (1.0, -5.0, 10.0, -10.0, 5.0, -1.0)  # of a B-spline, as truncated powers

    def derivative(power: int) -> Floats:
        return np.array(sum(w * np.maximum(x - k, 0.0) ** power for k, w in enumerate(weights)))

    tick = STEP * PERIOD
    shapes = np.stack((derivative(4) / 12.0, derivative(3) / (3.0 * tick), derivative(2) / tick**2), axis=1)
    shapes[np.broadcast_to(((x < 0.0) | (x > 5.0))[:, np.newaxis], shapes.shape)] = 0.0
    return np.asarray(shapes / np.abs(shapes[:, 2]).max())


SHAPES = _bumps()
"""The bumps, see `_bumps`."""


def course(bumps: Floats) -> Floats:
    """Return position, velocity and acceleration of a correction, shape (140, 3, 3), from heights of shape (10, 3)."""
    return np.asarray(np.einsum("kj,kdt->tdj", bumps, SHAPES))


def bounded(bumps: Floats) -> Floats:
    """Return a correction, scaled down where it is larger than permitted; none if it is no number.

    Args:
        bumps: Heights, shape (10, 3) [rad/s^2].
    """
    if not np.isfinite(bumps).all():
        return np.zeros_like(bumps)
    largest = np.abs(course(bumps)).max(axis=(0, 2))
    return np.asarray(bumps / max(1.0, largest[0] / FARTHEST, largest[2] / MOST))


class Repetition(Struct, frozen=True, eq=False, gc=False):
    """A motion that can be made again, as it is being made."""

    move: str
    """What tells it from all others."""
    corrected: MotionLesson | None
    """The correction that it gets; None without one."""


class Corrections:
    """Knows motions again, and adds what was learnt of them.

    A correction begins only if its motion goes as planned until then: from rest, shaped, with time at full rate.

    Args:
        description: The robot, for its rotors and torque limits.
    """

    def __init__(self, description: RobotDescription) -> None:
        n = self._joints = min(JOINTS, description.joints)
        self._rotor = np.array(description.drives.rotor_inertia)[:n]
        self._torque = np.array(description.limits.torque)[:n]
        self._known: dict[str, MotionLesson] = {}
        self.beliefs: Callable[[], bytes] | None = None
        """Returns all that was believed of the arm, with which a motion has to be learnt anew; None to know none."""
        self._repetition: Repetition | None = None
        self._motion: PlannedMotion | None = None
        self._ticks, self._duration = 0, 0.0
        self._course: Floats | None = None
        self._played = 0
        self.acceleration: Floats = np.zeros(n)
        """Acceleration of the last correction, of the joints that have one [rad/s^2]."""

    @property
    def repetition(self) -> Repetition | None:
        """The motion in progress, or the one that has just ended; None if it did not go as planned so far."""
        return self._repetition

    @property
    def idle(self) -> bool:
        """Whether there is nothing to do in a tick."""
        return self._motion is None and self._course is None

    def learn(self, lesson: MotionLesson) -> None:
        """Correct a motion from its next repetition on, or no longer."""
        self._known.pop(lesson.move, None)
        if lesson.bumps:
            self._known[lesson.move] = lesson
        if len(self._known) > KEPT:
            del self._known[next(iter(self._known))]

    def forget(self) -> bool:
        """Forget all corrections; return whether there were any."""
        known, self._known = self._known, {}
        return bool(known)

    def begin(self, trajectory: Trajectory | None) -> None:
        """Take notice of a shaped motion that begins at rest; None for any other one."""
        self._repetition = self._motion = None
        if self.beliefs is None or not isinstance(trajectory, PlannedMotion):
            return
        if trajectory.rate != 1.0 or not trajectory.steady:
            return
        move = identity(trajectory, self.beliefs())
        known = self._known.pop(move, None)
        if known is not None:
            self._known[move] = known
        self._repetition = Repetition(move, known)
        self._motion, self._duration, self._ticks = trajectory, trajectory.duration, 0

    def drop(self) -> None:
        """Drop all that is under way, since the arm was placed elsewhere."""
        self._repetition = self._motion = self._course = None

    def add(
        self, command: DriveCommand, trajectory: Trajectory, *, shaped: bool, rests: bool
    ) -> DriveCommand:
        """Return a command with its correction.

        Args:
            command: The command.
            trajectory: What is followed.
            shaped: Whether it is a planned motion that is shaped.
            rests: Whether the arm rests, so that the motion has ended.
        """
        if self._motion is not None:
            self._follow(self._motion, trajectory, shaped=shaped, rests=rests)
        if self._course is None:
            return command
        more, n = self._course[self._played], self._joints
        self._played += 1
        if self._played == len(self._course):
            self._course = None
        q, qd, torque = command.q.copy(), command.qd.copy(), command.torque.copy()
        q[:n] += more[0]
        qd[:n] += more[1]
        room = np.maximum(self._torque - np.abs(torque[:n]), 0.0)
        torque[:n] += np.minimum(np.maximum(self._rotor * more[2], -room), room)
        self.acceleration = more[2]
        return DriveCommand(q, qd, torque)

    def _follow(self, motion: PlannedMotion, trajectory: Trajectory, *, shaped: bool, rests: bool) -> None:
        """Count a tick of the motion, and begin its correction in time."""
        if rests:  # it has gone as planned
            self._motion = None
            return
        self._ticks += 1
        planned = trajectory is motion and shaped and motion.duration == self._duration
        if not planned or abs(motion.time - self._ticks * PERIOD) > 0.5 * PERIOD:
            self._repetition = self._motion = None
            return
        corrected = None if self._repetition is None else self._repetition.corrected
        if corrected is None or self._ticks != corrected.begins:
            return
        if self._course is not None:  # that of the motion before goes on to its end
            self._repetition = self._motion = None
            return
        self._course, self._played = course(heights(corrected.bumps))[:, :, : self._joints], 0


def heights(bumps: Bumps) -> Floats:
    """Return the heights of a correction within its bounds, shape (10, 3) [rad/s^2]."""
    given = np.zeros((BUMPS, JOINTS))
    if bumps:
        given[: len(bumps)] = bumps
    return bounded(given)


def identity(motion: PlannedMotion, beliefs: bytes) -> str:
    """Return what tells a motion from all others: a digest of its way, its duration, and the beliefs."""
    postures = motion.states(motion.evenly(LOOKS))[0]
    seen = blake2b(beliefs, digest_size=8)
    seen.update(np.rint(postures / ALIKE).astype(np.int64).tobytes())
    seen.update(np.float64(motion.duration).tobytes())
    return seen.hexdigest()
