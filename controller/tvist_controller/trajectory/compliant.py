"""A reference that gives way to forces at the tool, while another one moves it in the other directions."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.pose import turn, turned
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
LEVER = 0.22
"""Length by which a turn of 1 rad counts as a way: virtual inertias and dampings are its square times those [m]."""
MASS = 70.0
"""Virtual mass M [kg]. M/D is the time constant that keeps what the arm's elasticity adds out of the loop."""
FREE_DAMPING = 2000.0
"""Damping in free space at a damping parameter of 1 [N s/m]."""
CONTACT_DAMPING = 1500.0
"""Least damping in contact, which the stiffest surface needs [N s/m]."""
CONTACT = 8.0
"""Force from which on an axis counts as being in contact, and torque times 1/`LEVER` [N]."""
RELEASE = 3.0, 3.0 / LEVER
"""Deceleration of an axis that is no longer compliant [m/s², rad/s²]."""

Frame = Callable[[tuple[Floats, Floats], Floats], Floats]
"""Axes of the task as columns in the base frame, shape (3, 3), from the tool's pose and its velocity, shape (3,)."""


@dataclass(frozen=True)
class ForceTask:
    """What force control is to reach, by axes of its frame: three directions, then the turns about them."""

    compliant: Floats
    """1 for an axis along or about which the arm gives way, else 0, shape (6,)."""
    wrench: Floats
    """Force and torque that the arm exerts on its environment, shape (6,) [N, N m]."""
    limits: Floats
    """Largest speed of a compliant axis [m/s, rad/s], largest deviation of any other [m, rad], shape (6,)."""
    damping: float = 0.005
    """How quickly the arm slows down where nothing touches it, 0 (keeps its speed) to 1 [-]."""
    gain: float = 1.0
    """Factor of the difference between wanted and felt wrench, 0 to 2 [-]."""
    mass: float = MASS
    """Virtual mass [kg]."""
    contact_damping: float = CONTACT_DAMPING
    """Least damping of an axis in contact [N s/m]."""


def free_damping(parameter: float) -> float:
    """Damping of an axis that feels nothing, from the damping parameter, 0 to 1 [N s/m].

    The fourth root spreads the useful part of the range: 0.005 gives a quarter of the whole, 0 none.
    """
    return FREE_DAMPING * math.sqrt(math.sqrt(parameter))


def compliant_velocity(task: ForceTask, velocity: Floats, felt: Floats, period: float) -> Floats:
    """Velocity of the axes of the frame a tick later, shape (6,) [m/s, rad/s].

    Each compliant axis is a virtual mass with damping, M v̇ = g (w + f) - D v, with the wanted wrench w, the
    one f that is felt from the environment, shape (6,) [N, N m], and the gain g; it is integrated implicitly,
    so no damping is too large for a tick. Where a force is felt, D is at least that of contact. An axis that
    is not compliant loses the speed it had when it was.
    """
    scale = np.repeat([1.0, LEVER * LEVER], 3)
    touched = np.minimum(np.abs(felt) / np.repeat([CONTACT, CONTACT * LEVER], 3), 1.0)
    free = free_damping(task.damping)
    damping = free + max(task.contact_damping - free, 0.0) * touched
    push = task.gain * (task.wrench + felt) / (scale * task.mass)
    moved = (velocity + period * push) / (1.0 + period * damping / task.mass)
    moved = np.clip(moved, -task.limits, task.limits)
    most = period * np.repeat(RELEASE, 3)
    released = velocity - np.clip(velocity, -most, most)
    result: Floats = np.where(task.compliant > 0.0, moved, released)
    return result


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
        inner: Guided,  # moves the tool otherwise, and continues from the same state
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
        nominal, moving, _ = self.inner.state
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
        return self.inner.state[0]

    def take(self, inner: Guided) -> None:
        """Move the tool by another reference, which continues from where the present one is."""
        self.inner = inner
        inner.pace(*self._speed)

    def adopt(self, limits: MotionLimits) -> None:
        """See `Guided.adopt`."""
        super().adopt(abrupt(limits, self._period))

    def pace(self, speed: float, slowest: float | None) -> None:
        """Set the speed of the inner reference, and the velocity limit of all."""
        self._speed = speed, slowest
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
