"""A hidden robot behind a position interface, in this process: what the bridge's control line sees of a robot of UR's.

Its controller follows set-points with the lag of `servoj` and drives its arm by the robot file; the arm is a hidden
one. Set-points arrive late by the link and the buffer of the uploaded program, measurements by the link. At 125 Hz
the robot takes every fourth set-point and sends every fourth measurement.
"""

from collections import deque

import numpy as np

from tvist_controller.api.line import ControlCycle
from tvist_controller.line.limits import GuidedTorqueRoom, arm_limits
from tvist_controller.line.line_mode import LineMode
from tvist_controller.trajectory import Servo, Trajectory
from tvist_lab.recordings import Floats
from tvist_lab.study.line import Unchanged
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import PERIOD, Measurement
from tvist_plant.variants import hidden_variant

LATE = 3
"""Ticks by which a set-point is played late: the link, rounded up, and the program's buffer."""
BACK = 1
"""Ticks by which measurements come late."""


class PositionedRobot:
    """A hidden robot that takes positions; it stands where it is told to at first.

    Args:
        description: The robot file.
        declared: Payload that the robot was told it carries.
        hidden: Seed of the hidden robot.
        q: Where it stands, shape (n,) [rad].
        seed: Seed of its noise.
        interval: Control periods between two set-points, and between two measurements.
        lookahead: Lookahead time of `servoj` [s].
        gain: Gain of `servoj`.
    """

    def __init__(
        self,
        description: RobotDescription,
        declared: Payload,
        hidden: int,
        q: Floats,
        *,
        seed: int = 0,
        interval: int = 1,
        lookahead: float = 0.03,
        gain: float = 2000.0,
    ) -> None:
        self.arm = hidden_variant(hidden).make(description, declared, seed)
        self.payload = declared
        self._cycle = ControlCycle(
            description, Unchanged(description.joints), q=q, declared=declared, carried=declared, seed=seed,
            plant=self.arm,
        )  # fmt: skip
        room = GuidedTorqueRoom(description, self._cycle.line.dynamics)
        reach = np.array(description.limits.position)
        still = np.zeros_like(q)
        self._servo = Servo((q, still, still), arm_limits(description), reach, room, PERIOD)
        self._cycle.begin(_Following(self._servo), LineMode.SHAPED)
        self._interval, self._how = interval, (lookahead, gain)
        self._due = deque([q.copy()] * LATE, maxlen=LATE)
        self._felt = deque([self._cycle.sample.measured] * (1 + BACK), maxlen=1 + BACK)
        self._ticks = 0
        self._seen = self._felt[0]

    def measure(self) -> Measurement:
        """Return where the robot stands by its own target, and what it measured."""
        return self._seen

    def step(self, command: DriveCommand) -> Measurement:
        """Send a set-point, and return what has come back."""
        if self._ticks % self._interval == 0:
            self._servo.aim(self._due[0], *self._how)
        self._due.append(command.q.copy())
        self._felt.append(self._cycle.step().measured)
        if self._ticks % self._interval == 0:
            self._seen = self._felt[0]
        self._ticks += 1
        return self._seen


class _Following(Trajectory):
    """The servo's motion as one that never ends."""

    def __init__(self, servo: Servo) -> None:
        self._servo = servo

    def next(self) -> Floats:
        """Return the position of the next tick."""
        return self._servo.next()

    @property
    def finished(self) -> bool:
        """Whether it ends: it does not."""
        return False
