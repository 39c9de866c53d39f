"""Velocities of the tool, approached with constant acceleration while the tool goes straight."""

from typing import Protocol

import numpy as np

from tvist_controller.trajectory.guided import StuckError
from tvist_controller.trajectory.limiter import TorqueRoom
from tvist_controller.trajectory.limits import Floats, MotionLimits
from tvist_controller.trajectory.speed import (
    HALVINGS,
    STEADY,
    Speed,
    fitting_rates,
    part_of,
    rise_within,
)

BENT_SHARE = 0.5
"""Share of the joints' acceleration that the curvature of their way may use up at a constant speed [-]."""
USED = 0.95
"""Share of the joints' acceleration that is planned with; the rest is for the curvature within a tick [-]."""
MORE = 1e-6
"""Share by which rounding may exceed a limit [-]."""
LOOK = 5.0
"""Ticks over which that curvature is measured, ahead of the tool."""
FARTHEST_LOOK = 0.05
"""Largest angle of a joint over which it is measured [rad]."""
SLOWEST = 0.01
"""Share of the commanded speed below which the tool counts as stuck [-]."""
LOST = 1e-4
"""Singular value of the Jacobian below which the joints cannot move the tool in its direction [m or rad per rad]."""
CORRECTIONS = 4
"""Largest number of Newton steps with a kept Jacobian."""
ACCURATE = 1e-11
"""Error of the tool's pose at which they end [m or rad]."""
OFF = 1e-7
"""Error of the tool's pose that is not permitted [m or rad]."""


class ToolKinematics(Protocol):
    """Kinematics of the tool centre point, in the base frame."""

    def pose(self, q: Floats) -> tuple[Floats, Floats]:
        """Return its rotation matrix, shape (3, 3), and its position, shape (3,) [m]."""

    def jacobian(self, q: Floats) -> Floats:
        """Return the Jacobian of its velocity [m/s] and angular velocity [rad/s], shape (6, n)."""

    def turned(self, rotation: Floats, angle: Floats) -> Floats:
        """Return a rotation matrix turned about the base frame's axes by a rotation vector, shape (3,) [rad]."""

    def turn(self, start: Floats, end: Floats) -> Floats:
        """Return the rotation vector that turns one rotation matrix into another, shape (3,) [rad]."""


class ToolSpeed(Speed):
    """Accelerates the tool to a velocity and an angular velocity, and keeps these.

    As in `JointSpeed`, the trajectory has a time of its own, in which the twist u of the tool approaches its goal with
    constant acceleration, and the tool has the twist V = r u, with the rate r of that time. The pose is integrated
    from the mean of the twists at the beginning and the end of a tick, and the joints follow it by Newton's method, so
    the tool does not drift.

    The rate is reduced where a joint's limits require it. Near a singular posture the joints' way q(s) has a large
    second derivative with respect to the tool's way, so q'' ṡ² may use up only a share of the joints' acceleration.
    This slows the tool down before it gets there.

    Args:
        state: Position [rad], velocity [rad/s] and acceleration [rad/s^2] to continue from, each of shape (n,).
        limits: Limits of every joint; the jerk is that of stops.
        kinematics: Kinematics of the tool centre point.
        torque: Motion that the torque permits.
        period: Tick [s].
        rate: Rate of its time, 0 to 1 [-]; more if the joints are too fast for it at the start.
    """

    def __init__(
        self,
        state: tuple[Floats, Floats, Floats],
        limits: MotionLimits,
        kinematics: ToolKinematics,
        torque: TorqueRoom,
        period: float,
        *,
        rate: float = 1.0,
    ) -> None:
        super().__init__(state, limits, torque, period, rate=rate)
        # The present step is the one that was made, even if the joints count as standing.
        self._step = period * (np.array(state[1], dtype=float) - 0.5 * period * self._qdd)
        self.kinematics = kinematics
        """Kinematics of the tool centre point."""
        self._rotation, self._position = kinematics.pose(self._q)
        self._u = kinematics.jacobian(self._q) @ self._qd
        if not self._stands:
            self._u = self._u / self.rate
        self._goal, self._most = self._u, np.full(6, np.inf)

    def aim(self, twist: Floats, acceleration: float, angular_acceleration: float) -> None:
        """Approach another velocity.

        Args:
            twist: Velocity [m/s] and angular velocity [rad/s] in the base frame, shape (6,).
            acceleration: Acceleration [m/s^2].
            angular_acceleration: Angular acceleration [rad/s^2].
        """
        self._goal = np.array(twist, dtype=float)
        self._most = np.repeat([acceleration, angular_acceleration], 3)

    def pace(self, speed: float, slowest: float | None) -> None:
        """Set the speed; the present one is kept until the next tick."""
        self._speed, self._slowest = speed, self._arm.velocity if slowest is None else slowest
        if not self._u.any():
            self.rate = speed

    @property
    def duration(self) -> float:
        """Time until the velocities are reached at full speed [s]."""
        return float(_sizes((self._goal - self._u) / self._most).max())

    def next(self) -> Floats:
        """Advance by one tick and return the position of the joints.

        Raises:
            StuckError: The joints cannot move the tool on in its direction.
        """
        if self.finished:
            self._step = self._qd = self._qdd = np.zeros_like(self._q)
            return self._q
        share, found = 1.0, None
        for attempt in range(HALVINGS + 1):
            candidate = self._after(share if attempt < HALVINGS else 0.0)
            if candidate is not None:
                found = candidate
                q, _, _ = found
                h = self._period
                qdd = (q - self._q - self._step) / (h * h)
                if self._torque.allows(self._q, self._step / h, qdd):
                    break
            share *= 0.5
        if found is None:
            raise StuckError("the joints' limits do not let the tool continue in its direction")
        self._take(*found)
        return self._q

    def _take(self, q: Floats, u: Floats, rate: float) -> None:
        h, mean = self._period, 0.5 * (self.rate * self._u + rate * u)
        self._position = self._position + h * mean[:3]
        self._rotation = self.kinematics.turned(self._rotation, h * mean[3:])
        step = q - self._q
        self._qdd = (step - self._step) / (h * h)
        self._qd = step / h + 0.5 * h * self._qdd
        self._q, self._step, self._u, self.rate = q, step, u, rate
        if not self._goal.any() and float(np.abs(rate * u).max()) <= STEADY:
            self._u = np.zeros(6)

    def _after(self, share: float) -> tuple[Floats, Floats, float] | None:
        """Joints, twist in its own time and rate a tick later, with a share of the acceleration; None if impossible."""
        h, goal, arm = self._period, self._goal, self._arm
        part = part_of(self.duration, share * self.rate * h)
        u = goal if part == 1.0 else self._u + part * (goal - self._u)
        middle = self._q + 0.5 * self._step
        inverse = _inverse(self.kinematics.jacobian(middle))
        before, after = inverse @ (0.5 * h * self.rate * self._u), inverse @ (0.5 * h * u)
        # Joints: the step before + r after is within the velocity, and its change within the acceleration.
        speed = np.abs(self._qd)
        rise = rise_within(speed, arm, h)
        most = USED * arm.acceleration
        up = np.where(self._qd > 0.0, np.minimum(rise, most), most) * h * h
        down = np.where(self._qd < 0.0, np.minimum(rise, most), most) * h * h
        lowest, highest = fitting_rates(before - self._step, after, -down, up)
        if lowest > min(highest, max(self.rate, self._speed)) or highest < 0.0:
            return None
        rate = min(self._wanted(u, share, after / (0.5 * h)), highest)
        rate = max(rate, lowest, 0.0)
        q = self._solve(self._q + before + rate * after, 0.5 * (self.rate * self._u + rate * u), inverse)
        if q is None:
            return None
        step = q - self._q
        too_fast = np.abs(step) > (1.0 + MORE) * h * np.maximum(arm.velocity, speed)
        too_hard = np.abs(step - self._step) > (1.0 + MORE) * h * h * arm.acceleration
        return None if (too_fast | too_hard).any() else (q, u, rate)

    def _wanted(self, u: Floats, share: float, slope: Floats) -> float:
        """Rate that the tool's acceleration and the curvature of the joints' way permit.

        Args:
            u: Twist in its own time, shape (6,).
            share: Share of the acceleration that may be used [-].
            slope: Velocity of the joints for that twist, shape (n,) [rad/s].

        Raises:
            StuckError: It is too low.
        """
        change = share * self._most * self._period
        lowest, highest = _tool_rates(self._u * self.rate, u, change)
        rate = min(max(self._speed, lowest), highest)
        fastest = float(np.abs(slope).max())
        if fastest == 0.0:
            return rate
        ahead = min(LOOK * self._period * max(rate, SLOWEST), FARTHEST_LOOK / fastest)
        later = _inverse(self.kinematics.jacobian(self._q + ahead * slope)) @ u
        bend = max(float(np.abs(later - slope).max()) / ahead, 1e-9)
        permitted = min(
            np.sqrt(BENT_SHARE * self._arm.acceleration / bend),
            self._slowest / max(fastest, float(np.abs(later).max())),
        )
        if permitted < SLOWEST:
            raise StuckError("the tool cannot continue in its direction near a singular posture")
        return min(rate, float(permitted))

    def _solve(self, q: Floats, mean: Floats, inverse: Floats) -> Floats | None:
        """Correct the joints until the tool is where its mean twist leads in this tick; None if that fails."""
        h, kinematics = self._period, self.kinematics
        position = self._position + h * mean[:3]
        rotation = kinematics.turned(self._rotation, h * mean[3:])
        for correction in range(CORRECTIONS + 1):
            present, place = kinematics.pose(q)
            error = np.concatenate((position - place, kinematics.turn(present, rotation)))
            off = float(np.abs(error).max())
            if off <= ACCURATE or correction == CORRECTIONS:
                break
            q = q + inverse @ error
        return q if off <= OFF else None

    @property
    def finished(self) -> bool:
        """Whether the tool has come to rest as commanded."""
        return not (self._goal.any() or self._u.any())


def _inverse(jacobian: Floats) -> Floats:
    """Pseudo-inverse of a Jacobian, which leaves out the directions that are lost, shape (n, 6)."""
    left, values, right = np.linalg.svd(jacobian, full_matrices=False)
    kept = values > LOST
    inverse: Floats = (right[kept].T / values[kept]) @ left[:, kept].T
    return inverse


def _sizes(twist: Floats) -> Floats:
    """Lengths of the linear and the angular part, shape (2,)."""
    return np.array((np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:])))


def _tool_rates(present: Floats, u: Floats, change: Floats) -> tuple[float, float]:
    """Rates at which no component of the twist differs from the present one by more than its permitted change."""
    return fitting_rates(-present, u, -change, change)
