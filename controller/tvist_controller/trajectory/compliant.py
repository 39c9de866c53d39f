"""A reference that gives way to forces at the tool, while another one moves it in the other directions."""

from collections.abc import Callable

import numpy as np

from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.rotation import turn, turned
from tvist_controller.trajectory.base import Rest
from tvist_controller.trajectory.force_law import ForceTask, compliant_velocity
from tvist_controller.trajectory.guided import Following, Guided, StuckError
from tvist_controller.trajectory.limiter import TorqueRoom
from tvist_controller.trajectory.limits import Floats, MotionLimits
from tvist_controller.trajectory.speed import abrupt

NEWTON = 3
"""Newton steps from the tool's pose to the joints' angles; two suffice for what the tool moves in a tick."""
OFF = 1e-5
"""Error of the tool's pose in a direction that does not give way above which the motion cannot go on [m or rad]."""
FASTEST = 0.5
"""Share of the joints' velocity that giving way may use up [-]."""
CRAWL = 0.05
"""Share of it below which giving way counts as hindered by a singular posture [-]."""


Frame = Callable[[tuple[Floats, Floats], Floats], Floats]
"""Axes of the task as columns in the base frame, shape (3, 3), from the tool's pose and its velocity, shape (3,)."""


class Compliant(Following):
    """Moves the tool by the law of force control in compliant axes, and as another reference does in all others.

    The pose P that is followed is integrated from twists: in the axes of the task, the law's velocity where these are
    compliant, and the velocity of the inner reference's tool elsewhere. The joints follow P by Newton's method through
    a `Limiter`. Whatever giving way is kept from, by the joints' limits or near a singular posture, is dropped from P,
    so that nothing is caught up with later.
    """

    def __init__(
        self,
        state: tuple[Floats, Floats, Floats],
        limits: MotionLimits,
        reach: Floats,
        torque: TorqueRoom,
        period: float,
        *,
        tool: Callable[[], Arm],  # of the tool centre point, which another one may replace at any time
        inner: Guided | Rest,  # moves the tool otherwise, and continues from the same state
        felt: Callable[[], Floats],  # on the tool centre point in the last tick, base frame [N, N m]
    ) -> None:
        super().__init__(state, abrupt(limits, period), reach, torque, period)
        self._tool, self.inner = tool, inner
        """The reference that moves the tool otherwise."""
        self._felt = felt
        self._speed: tuple[float, float | None] = (1.0, None)
        self._task: ForceTask | None = None
        self._frame: Frame = lambda _pose, _velocity: np.eye(3)
        self.axes = np.eye(3)
        """Axes of the task, as columns in the base frame, shape (3, 3)."""
        self.hindered = 1.0
        """Share of the law's velocity that a singular posture permits, of the last tick [-]."""
        self._begin(tool())

    def _begin(self, kinematics: Arm) -> None:
        """Let a tool centre point give way from the joints' present motion on."""
        q, qd, _ = self.state
        self.kinematics = kinematics
        """Kinematics of the tool centre point."""
        self._pose = kinematics.pose(q)
        self._twist = kinematics.inverse(q)[0] @ qd
        nominal, moving = self.nominal, self.inner.state[1] if isinstance(self.inner, Guided) else 0.0 * qd
        self._nominal, self._moved = kinematics.pose(nominal), kinematics.inverse(nominal)[0] @ moving
        """Velocity of the inner reference's tool [m/s, rad/s]."""
        self._given = self._twist - self._moved
        """Velocity by the law in the base frame, beside that of the inner reference in axes that are not compliant."""

    def aim(self, task: ForceTask, frame: Frame) -> None:
        """Control the force by another task from now on; the velocity stays and changes by the law."""
        self._frame = frame
        self.axes = axes = frame(self._pose, self._twist[:3])
        before = np.zeros(6) if self._task is None else self._task.compliant
        joined = (task.compliant - before) * _into(axes, self._moved)
        self._given, self._task = self._given + _out(axes, joined), task

    @property
    def task(self) -> ForceTask:
        """What is to be reached."""
        assert self._task is not None, "it is aimed before it moves"
        return self._task

    @property
    def finished(self) -> bool:
        """Never: it gives way until a command ends it."""
        return False

    @property
    def nominal(self) -> Floats:
        """Position of the joints by the inner reference, shape (n,) [rad]."""
        return self.inner.state[0] if isinstance(self.inner, Guided) else self.inner.next()

    def take(self, inner: Guided | Rest) -> None:
        """Move the tool by another reference, which continues from where the present one is."""
        self.inner = inner
        if isinstance(inner, Guided):
            inner.pace(*self._speed)

    def adopt(self, limits: MotionLimits) -> None:
        """See `Guided.adopt`."""
        super().adopt(abrupt(limits, self._period))

    def pace(self, speed: float, slowest: float | None) -> None:
        """Set the speed of the inner reference, and the velocity limit of all."""
        self._speed = speed, slowest
        if isinstance(self.inner, Guided):
            self.inner.pace(speed, slowest)
        super().pace(speed, slowest)

    def next(self) -> Floats:
        """Advance by one tick and return the position of the joints.

        Raises:
            StuckError: The inner reference cannot go on, the joints cannot follow it, or the force is no number.
        """
        h, task, felt = self._period, self.task, self._felt()
        if not np.isfinite(felt).all():
            raise StuckError("the force at the tool is no number")
        if (tool := self._tool()) is not self.kinematics:
            self._task = None
            self._begin(tool)
            self.aim(task, self._frame)
        moved = self._move_inner()
        self.axes = axes = self._frame(self._pose, self._twist[:3])
        given = compliant_velocity(task, _into(axes, self._given), _into(axes, felt), h)
        kept = np.where(task.compliant > 0.0, 0.0, _into(axes, moved))
        q, present = self._limiter.q, self._pose
        inverse = self.kinematics.inverse(q)[1]
        slope = np.abs(inverse @ _out(axes, given)).max()
        self.hindered = share = min(1.0, FASTEST * self.limits.velocity / max(slope, 1e-12))
        for part in (share, 0.0):  # a singular posture may forbid all of what the law wants
            self._given = _out(axes, part * given)
            self._twist = _out(axes, kept) + self._given
            self._pose = self._shifted(present, h * self._twist)
            found, error = self.kinematics.near(self._pose, q, inverse, NEWTON)
            if np.abs(error).max() <= OFF:
                break
        else:
            if not np.abs(np.where(task.compliant > 0.0, 0.0, _into(axes, error))).max() <= OFF:
                raise StuckError("the joints cannot move the tool on beside the force that it controls")
            self._drop(found, axes)
        reached = self._limiter.follow(found, (found - q) / h)
        if self._limiter.limited:
            self._drop(reached, axes)
        return reached

    def _move_inner(self) -> Floats:
        """Let the inner reference advance by a tick; return the velocity of its tool, shape (6,)."""
        if self.inner.finished:
            self._moved = np.zeros(6)
            return self._moved
        rotation, position = self._nominal
        self._nominal = there = self.kinematics.pose(self.inner.next())
        way = np.concatenate((there[1] - position, turn(rotation, there[0])))
        self._moved = way / self._period
        return self._moved

    def _shifted(self, pose: tuple[Floats, Floats], way: Floats) -> tuple[Floats, Floats]:
        return turned(pose[0], way[3:]), pose[1] + way[:3]

    def _off(self, q: Floats) -> Floats:
        """What the pose lacks to the one that is followed, shape (6,) [m, rad]."""
        rotation, position = self.kinematics.pose(q)
        return np.concatenate((self._pose[1] - position, turn(rotation, self._pose[0])))

    def _drop(self, q: Floats, axes: Floats) -> None:
        """Give up, in the compliant axes, what the joints have not followed."""
        lost = np.where(self.task.compliant > 0.0, _into(axes, self._off(q)), 0.0)
        self._pose = self._shifted(self._pose, -_out(axes, lost))
        kept = np.where(self.task.compliant > 0.0, 0.0, _into(axes, self._given))
        self._given = _out(axes, kept)


def _into(axes: Floats, base: Floats) -> Floats:
    """Components of a twist or wrench along axes, from those in the base frame."""
    return np.concatenate((base[:3] @ axes, base[3:] @ axes))


def _out(axes: Floats, own: Floats) -> Floats:
    """Components in the base frame, from those along axes."""
    return np.concatenate((axes @ own[:3], axes @ own[3:]))
