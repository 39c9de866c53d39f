"""Velocities of the joints, approached with constant acceleration."""

import numpy as np

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


class JointSpeed(Speed):
    """Accelerates all joints in phase to velocities, and keeps these.

    In each tick the position advances by the mean of the velocities at its beginning and at its end.
    There is no jerk limit. If the torque does not suffice, the joints accelerate less, still in phase. The arguments
    are those of `Speed`.
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
        super().__init__(state, limits, torque, period, rate=rate)
        self._u = self._qd if self._stands else self._qd / self.rate
        self._goal, self._most = self._u, limits.acceleration

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
        return float(np.abs(self._goal - self._u).max()) / min(self._most, self._arm.acceleration)

    def next(self) -> Floats:
        """Advance by one tick and return the position."""
        if self.finished:
            self._qdd = np.zeros_like(self._q)
            return self._q
        h, present = self._period, self._qd
        u, rate = self._after(1.0)
        rising = np.sign(present) * (rate * u - present) / h
        permitted = rise_within(np.abs(present), self._arm, h)
        most = 1.0
        if (rising > permitted).any():
            over = rising > permitted
            most = max(float((permitted[over] / rising[over]).min()), 0.5**HALVINGS)
        for share in self._shares(most):
            u, rate = self._after(share)
            if self._torque.allows(self._q, present, (rate * u - present) / h):
                break
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
        most = np.full(len(u), share * min(self._most, self._arm.acceleration) * h)
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
