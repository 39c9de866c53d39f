"""Velocities of the tool, approached with constant acceleration while the tool goes straight."""

import numpy as np

from tvist_controller.kinematics.arm import Arm
from tvist_controller.trajectory.guided import StuckError
from tvist_controller.trajectory.limiter import TorqueRoom
from tvist_controller.trajectory.limits import Floats, MotionLimits
from tvist_controller.trajectory.speed import (
    STEADY,
    Speed,
    part_of,
    rise_within,
)

USED = 0.95
"""Share of the joints' acceleration that is planned with; the rest is for the curvature within a tick [-]."""
LOST_SHARE = 1e-3
"""Share of a twist in lost directions above which joints that stand cannot begin it [-]."""
FOUND, _, SINGULAR = range(3)


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
        kinematics: Arm,
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
        h, arm, joints = self._period, self._arm, np.stack((self._q, self._step))
        jacobian, inverse = self.kinematics.inverse(self._q + 0.5 * self._step)
        if not self._u.any() and _exceeds(self._goal - jacobian @ (inverse @ self._goal), self._goal):
            raise StuckError("the joints cannot move the tool in its direction from this singular posture")
        # A joint may get faster, but for the way to zero only what lets a stop keep its velocity.
        speed, most = np.abs(self._qd), USED * arm.acceleration
        rise = np.minimum(rise_within(speed, arm, h), most)
        up, down = np.where(self._qd > 0.0, rise, most), np.where(self._qd < 0.0, rise, most)
        ranges = np.stack((-down * (h * h), up * (h * h), h * np.maximum(arm.velocity, speed)))
        duration, present = self.duration, (self._rotation, self._position)
        found = None
        for share in self._shares():
            part = part_of(duration, share * self.rate * h)
            u = self._goal if part == 1.0 else self._u + part * (self._goal - self._u)
            status, rate, q, place = self.kinematics.straight(
                inverse, joints, np.stack((self._u, u)), ranges, share * h * self._most,
                self.rate, self._speed, self._slowest, arm.acceleration, h, present,
            )  # fmt: skip
            if status == SINGULAR:
                raise StuckError("the tool cannot continue in its direction near a singular posture")
            if status == FOUND:
                found = q, u, rate, place
                if self._torque.allows(self._q, self._step / h, (q - self._q - self._step) / (h * h)):
                    break
        if found is None:
            raise StuckError("the joints' limits do not let the tool continue in its direction")
        self._take(*found)
        return self._q

    def _take(self, q: Floats, u: Floats, rate: float, place: tuple[Floats, Floats]) -> None:
        h = self._period
        self._rotation, self._position = place
        step = q - self._q
        self._qdd = (step - self._step) / (h * h)
        self._qd = step / h + 0.5 * h * self._qdd
        self._q, self._step, self._u, self.rate = q, step, u, rate
        if not self._goal.any() and float(np.abs(rate * u).max()) <= STEADY:
            self._u = np.zeros(6)

    @property
    def finished(self) -> bool:
        """Whether the tool has come to rest as commanded."""
        return not (self._goal.any() or self._u.any())


def _sizes(twist: Floats) -> Floats:
    """Lengths of the linear and the angular part, shape (2,)."""
    return np.array((np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:])))


def _exceeds(lost: Floats, twist: Floats) -> bool:
    """Return whether what is lost of a twist is more than rounding and what a nearly singular posture costs."""
    return float(np.abs(lost).max()) > LOST_SHARE * float(np.abs(twist).max())
