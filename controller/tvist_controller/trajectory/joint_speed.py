"""Velocities of the joints, approached with constant acceleration."""

import numpy as np

from tvist_controller.trajectory.guided import Guided
from tvist_controller.trajectory.limiter import TorqueRoom
from tvist_controller.trajectory.limits import Floats, MotionLimits
from tvist_controller.trajectory.speed import (
    HALVINGS,
    STANDING,
    STEADY,
    fitting_rates,
    part_of,
    rise_within,
)


class JointSpeed(Guided):
    """Accelerates all joints in phase to velocities, and keeps these.

    The trajectory has a time of its own. In that time, the velocities u approach their goal with constant
    acceleration; the joints have q̇ = r u, where r is the rate of that time. So at a constant rate, velocities are
    multiplied by r and accelerations by r². The rate changes as quickly as the acceleration permits. In each tick the
    position advances by the mean of the velocities at its beginning and at its end.

    There is no jerk limit. If the torque does not suffice, the joints accelerate less, still in phase.

    Args:
        state: Position [rad], velocity [rad/s] and acceleration [rad/s^2] to continue from, each of shape (n,).
        limits: Limits of every joint; the jerk is that of stops.
        torque: Motion that the torque permits.
        period: Tick [s].
        rate: Rate of its time, 0 to 1 [-]; more if the velocities at the start would exceed the limits otherwise.
    """

    def __init__(
        self,
        state: tuple[Floats, Floats, Floats],
        limits: MotionLimits,
        torque: TorqueRoom,
        period: float,
        *,
        rate: float = 1.0,
    ) -> None:
        q, qd, qdd = (np.array(values, dtype=float) for values in state)
        self._q, self._qd, self._qdd = q, qd, qdd
        self._arm, self._torque, self._period = limits, torque, period
        self.limits = MotionLimits(limits.velocity, limits.acceleration, 2.0 * limits.acceleration / period)
        """Limits of the reference; the jerk is that of the acceleration changing its sign within a tick."""
        fastest = float(np.abs(qd).max())
        if fastest <= STANDING:
            self._qd = qd = np.zeros_like(q)
        self.rate = max(rate, min(fastest / limits.velocity, 1.0))
        self._u = qd / self.rate if fastest > STANDING else qd
        self._goal, self._most = self._u, limits.acceleration
        self._speed, self._slowest = rate, limits.velocity

    def aim(self, qd: Floats, acceleration: float) -> None:
        """Approach other velocities.

        Args:
            qd: Velocities, shape (n,) [rad/s].
            acceleration: Acceleration of the joint whose velocity changes most [rad/s^2].
        """
        self._goal, self._most = np.array(qd, dtype=float), acceleration

    def pace(self, speed: float, slowest: float | None) -> None:
        """Set the speed; the present one is kept until the next tick."""
        self._speed, self._slowest = speed, self._arm.velocity if slowest is None else slowest
        if not self._u.any():
            self.rate = self._wanted_rate

    @property
    def _wanted_rate(self) -> float:
        fastest = max(float(np.abs(self._goal).max()), float(np.abs(self._u).max()))
        return self._speed if fastest <= self._slowest else min(self._speed, self._slowest / fastest)

    @property
    def duration(self) -> float:
        """Time until the velocities are reached at full speed [s]."""
        return float(np.abs(self._goal - self._u).max()) / self._most

    @property
    def state(self) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration of the reference, each of shape (n,)."""
        return self._q, self._qd, self._qdd

    def next(self) -> Floats:
        """Advance by one tick and return the position."""
        if self.finished:
            self._qdd = np.zeros_like(self._q)
            return self._q
        h, present = self._period, self._qd
        u, rate = self._after(1.0)
        rising = np.sign(present) * (rate * u - present) / h
        permitted = rise_within(np.abs(present), self._arm, h)
        share = 1.0
        if (rising > permitted).any():
            over = rising > permitted
            share = max(float((permitted[over] / rising[over]).min()), 0.5**HALVINGS)
            u, rate = self._after(share)
        for _ in range(HALVINGS):
            if self._torque.allows(self._q, present, (rate * u - present) / h):
                break
            share *= 0.5
            u, rate = self._after(share)
        qd = rate * u
        if not self._goal.any() and float(np.abs(qd).max()) <= STEADY:
            u = qd = np.zeros_like(qd)
        self._u, self.rate = u, rate
        self._q = self._q + 0.5 * h * (present + qd)
        self._qd, self._qdd = qd, (qd - present) / h
        return self._q

    def _after(self, share: float) -> tuple[Floats, float]:
        """Velocities in its own time and its rate a tick later, with a share of the acceleration."""
        h, goal = self._period, self._goal
        part = part_of(self.duration, share * self.rate * h)
        u = goal if part == 1.0 else self._u + part * (goal - self._u)
        most = np.full(len(u), share * self._most * h)
        lowest, highest = fitting_rates(-self._qd, u, -most, most)
        # The present rate is among them, but for rounding.
        wanted = self._wanted_rate
        if wanted == self.rate or lowest > highest:
            return u, self.rate
        return u, min(max(wanted, lowest), highest)

    @property
    def finished(self) -> bool:
        """Whether the joints have come to rest as commanded."""
        return not (self._goal.any() or self._u.any())
