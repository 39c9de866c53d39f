"""A reference that complies with forces at the tool in some axes; the other axes follow another reference."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.pose import turn, turned
from tvist_controller.trajectory.base import Floats, MotionLimits
from tvist_controller.trajectory.guided import Guided, LimitedFollower, StuckError
from tvist_controller.trajectory.limiter import TorqueMargin
from tvist_controller.trajectory.speed import abrupt
from tvist_plant.plant import PERIOD

NEWTON = 3  # Newton steps from tool pose to joint angles; two suffice for the travel of a tick
OFF = 1e-5  # pose error in a stiff direction above which the motion cannot continue [m or rad]
FASTEST = 0.5  # fraction of joint velocity available to compliance [-]
CRAWL = 0.05  # fraction of the force law's velocity below which a singular posture nearly blocks the arm [-]
LEVER = 0.22  # length equivalent to a turn by 1 rad; its square scales virtual inertias and dampings [m]
MASS = 70.0  # virtual mass M [kg]; the time constant M/D keeps the arm's elasticity out of the loop
FREE_DAMPING = 2000.0  # damping in free space at damping parameter 1 [N s/m]
CONTACT_DAMPING = 1500.0  # least damping in contact, as needed by the stiffest surface [N s/m]
CONTACT = 8.0  # force above which an axis counts as in contact, or torque divided by `LEVER` [N]
RELEASE = 3.0, 3.0 / LEVER  # deceleration of an axis after its compliance ends [m/s², rad/s²]

Frame = Callable[[tuple[Floats, Floats], Floats], Floats]
"""Function from tool pose and velocity (3,) to the task's axes in the base frame, columns (3, 3)."""


@dataclass(frozen=True)
class ForceTask:
    """Goal of force control per axis of its frame: three directions, then three rotations."""

    compliant: Floats  # 1 for compliant axes, 0 for stiff ones, shape (6,)
    wrench: Floats  # wanted force and torque of the arm on its environment, shape (6,) [N, N m]
    limits: Floats
    """Largest speed of compliant axes [m/s, rad/s], largest deviation of stiff ones [m, rad], shape (6,)."""
    damping: float = 0.005  # damping parameter in free space: 0 (keeps its speed) to 1 [-]
    gain: float = 1.0  # factor of the difference between wanted and measured wrench, 0 to 2 [-]
    mass: float = MASS  # virtual mass [kg]
    contact_damping: float = CONTACT_DAMPING  # least damping in contact [N s/m]


def compliant_velocity(task: ForceTask, velocity: Floats, felt: Floats) -> Floats:
    """Return the velocity of the frame's axes a tick later, shape (6,) [m/s, rad/s].

    A compliant axis is a virtual mass with damping, M v̇ = g (w + f) - D v, with wanted wrench w, measured
    wrench f (6,) [N, N m] and gain g, integrated implicitly, so any damping is stable. In contact, D rises to
    at least `contact_damping`. An axis that has become stiff loses its earlier compliant velocity gradually.
    """
    scale = np.repeat([1.0, LEVER * LEVER], 3)
    touched = np.minimum(np.abs(felt) / np.repeat([CONTACT, CONTACT * LEVER], 3), 1.0)
    # The fourth root spreads the useful range: 0.005 gives a quarter of the whole, 0 none.
    free = FREE_DAMPING * math.sqrt(math.sqrt(task.damping))
    damping = free + max(task.contact_damping - free, 0.0) * touched
    push = task.gain * (task.wrench + felt) / (scale * task.mass)
    moved = (velocity + PERIOD * push) / (1.0 + PERIOD * damping / task.mass)
    moved = np.clip(moved, -task.limits, task.limits)
    most = PERIOD * np.repeat(RELEASE, 3)
    released = velocity - np.clip(velocity, -most, most)
    return np.where(task.compliant > 0.0, moved, released)


class Compliant(LimitedFollower):
    """Moves the tool by force control in compliant axes, and as an inner reference does in stiff axes.

    A pose P is integrated from velocities along the task's axes: in compliant axes the force law's, in stiff
    axes the inner reference's. The joints follow P by Newton's method and a `Limiter`. If joint limits or
    singular postures prevent a compliant motion, it is removed from P, so that nothing is caught up later.
    """

    finished = False  # a compliant motion ends by a command

    def __init__(
        self,
        state: tuple[Floats, Floats, Floats],
        limits: MotionLimits,
        reach: Floats,
        torque: TorqueMargin,
        *,
        tool: Callable[[], Arm],  # of the tool centre point, which may change at any time
        inner: Guided,  # moves the tool otherwise, and continues from the same state
        felt: Callable[[], Floats],  # on the tool centre point in the last tick, base frame [N, N m]
    ) -> None:
        super().__init__(state, abrupt(limits), reach, torque)
        self._tool, self.inner = tool, inner  # reference that moves the tool in stiff axes
        self._felt = felt
        self._speed: tuple[float, float | None] = (1.0, None)
        self._task: ForceTask | None = None
        self._frame: Frame = lambda _pose, _velocity: np.eye(3)
        self.axes = np.eye(3)  # axes of the task in the base frame, columns (3, 3)
        self.hindered = 1.0
        """Fraction of the force law's velocity that a singular posture allowed in the last tick [-]."""
        self._begin(tool())

    def _begin(self, kinematics: Arm) -> None:
        """Start compliance of a tool from the joints' present motion."""
        q, qd, _ = self.state
        self.kinematics = kinematics
        self._pose = kinematics.pose(q)
        self._twist = kinematics.inverse(q)[0] @ qd
        nominal, moving, _ = self.inner.state
        self._nominal, self._moved = kinematics.pose(nominal), kinematics.inverse(nominal)[0] @ moving
        """Velocity of the inner reference's tool [m/s, rad/s]."""
        self._given = self._twist - self._moved
        """Velocity of the force law in the base frame, added to the inner reference's in stiff axes."""

    def aim(self, task: ForceTask, frame: Frame) -> None:
        """Set another task; the velocity continues under the law."""
        self._frame = frame
        self.axes = axes = frame(self._pose, self._twist[:3])
        before = np.zeros(6) if self._task is None else self._task.compliant
        joined = (task.compliant - before) * _into(axes, self._moved)
        self._given, self._task = self._given + _out(axes, joined), task

    @property
    def task(self) -> ForceTask:
        """The present task."""
        assert self._task is not None, "it is aimed before it moves"
        return self._task

    @property
    def nominal(self) -> Floats:
        """Joint positions of the inner reference, shape (n,) [rad]."""
        return self.inner.state[0]

    def take(self, inner: Guided) -> None:
        """Replace the inner reference by one that continues from its state."""
        self.inner = inner
        inner.pace(*self._speed)

    def adopt(self, limits: MotionLimits) -> None:
        """See `Guided.adopt`."""
        super().adopt(abrupt(limits))

    def pace(self, speed: float, slowest: float | None) -> None:
        """Set the speed of the inner reference, and the velocity limit of inner and compliant reference."""
        self._speed = speed, slowest
        self.inner.pace(speed, slowest)
        super().pace(speed, slowest)

    def next(self) -> Floats:
        """Advance by one tick and return the joint positions; raise StuckError if it cannot continue."""
        task, felt = self.task, self._felt()
        if not np.isfinite(felt).all():
            raise StuckError("the force at the tool is not a finite number")
        if (tool := self._tool()) is not self.kinematics:
            self._task = None
            self._begin(tool)
            self.aim(task, self._frame)
        moved = self._move_inner()
        self.axes = axes = self._frame(self._pose, self._twist[:3])
        given = compliant_velocity(task, _into(axes, self._given), _into(axes, felt))
        kept = np.where(task.compliant > 0.0, 0.0, _into(axes, moved))
        q, present = self._limiter.q, self._pose
        inverse = self.kinematics.inverse(q)[1]
        slope = np.abs(inverse @ _out(axes, given)).max()
        self.hindered = share = min(1.0, FASTEST * self.limits.velocity / max(slope, 1e-12))
        for part in (share, 0.0):  # a singular posture may forbid all of the wanted change
            self._given = _out(axes, part * given)
            self._twist = _out(axes, kept) + self._given
            self._pose = self._shifted(present, PERIOD * self._twist)
            found, error = self.kinematics.near(self._pose, q, inverse, NEWTON)
            if np.abs(error).max() <= OFF:
                break
        else:
            if not np.abs(np.where(task.compliant > 0.0, 0.0, _into(axes, error))).max() <= OFF:
                raise StuckError("the joints cannot move the tool further while it controls its force")
            self._drop(found, axes)
        reached = self._limiter.follow(found, (found - q) / PERIOD)
        if self._limiter.limited:
            self._drop(reached, axes)
        return reached

    def _move_inner(self) -> Floats:
        """Advance the inner reference by a tick; return the tool velocity that it commands, shape (6,)."""
        if self.inner.finished:
            self._moved = np.zeros(6)
            return self._moved
        rotation, position = self._nominal
        self._nominal = there = self.kinematics.pose(self.inner.next())
        self._moved = np.concatenate((there[1] - position, turn(rotation, there[0]))) / PERIOD
        return self._moved

    def _shifted(self, pose: tuple[Floats, Floats], way: Floats) -> tuple[Floats, Floats]:
        return turned(pose[0], way[3:]), pose[1] + way[:3]

    def _drop(self, q: Floats, axes: Floats) -> None:
        """Remove from the tracked pose the compliant motion that the joints did not follow."""
        rotation, position = self.kinematics.pose(q)
        off = np.concatenate((self._pose[1] - position, turn(rotation, self._pose[0])))
        lost = np.where(self.task.compliant > 0.0, _into(axes, off), 0.0)
        self._pose = self._shifted(self._pose, -_out(axes, lost))
        kept = np.where(self.task.compliant > 0.0, 0.0, _into(axes, self._given))
        self._given = _out(axes, kept)


def _into(axes: Floats, base: Floats) -> Floats:
    return np.concatenate((base[:3] @ axes, base[3:] @ axes))


def _out(axes: Floats, own: Floats) -> Floats:
    return np.concatenate((axes @ own[:3], axes @ own[3:]))
