"""Stops from any state of motion, with independent joints."""

import numpy as np
import ruckig

from tvist_controller.trajectory.base import Trajectory
from tvist_controller.trajectory.limits import Floats


class JointStop(Trajectory):
    """Shortest stop within limits of acceleration and jerk; every joint stops as soon as it can."""

    def __init__(
        self, q: Floats, qd: Floats, qdd: Floats, *, acceleration: float, jerk: float, period: float
    ) -> None:
        n = len(q)
        request = ruckig.InputParameter(n)
        request.control_interface = ruckig.ControlInterface.Velocity
        request.synchronization = ruckig.Synchronization.No
        request.current_position, request.current_velocity = q.tolist(), qd.tolist()
        request.current_acceleration = qdd.tolist()
        request.target_velocity, request.target_acceleration = [0.0] * n, [0.0] * n
        request.max_acceleration, request.max_jerk = [acceleration] * n, [jerk] * n
        self._trajectory = ruckig.Trajectory(n)
        ruckig.Ruckig(n).calculate(request, self._trajectory)
        self.acceleration = acceleration
        """Acceleration limit [rad/s^2]."""
        self.jerk = jerk
        """Jerk limit [rad/s^3]."""
        self._period = period
        self._ticks = 0

    @property
    def duration(self) -> float:
        """Time until every joint is at rest [s]."""
        return float(self._trajectory.duration)

    def at(self, time: float) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration at a time after the start [s], each of shape (n,)."""
        position, velocity, acceleration = self._trajectory.at_time(min(time, self.duration))[:3]
        return np.array(position), np.array(velocity), np.array(acceleration)

    def states(self, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Evaluate `at` at k times, shape (k,) [s]; each result has shape (k, n)."""
        duration, at_time = self.duration, self._trajectory.at_time
        states = [at_time(min(time, duration)) for time in times.tolist()]
        position, velocity, acceleration = (
            np.array([state[order] for state in states]) for order in range(3)
        )
        return position, velocity, acceleration

    @property
    def end(self) -> Floats:
        """Position at which the stop ends, shape (n,) [rad]."""
        return self.at(self.duration)[0]

    @property
    def farthest(self) -> Floats:
        """Largest absolute position of each joint on the way, shape (n,) [rad]."""
        return np.array([max(-bound.min, bound.max) for bound in self._trajectory.position_extrema])

    def next(self) -> Floats:
        """Advance by one tick and return the position."""
        self._ticks += 1
        return self.at(self._ticks * self._period)[0]

    @property
    def velocity(self) -> Floats:
        """Velocity at the last reference, shape (n,) [rad/s]."""
        return self.at(self._ticks * self._period)[1]

    @property
    def finished(self) -> bool:
        """Whether every joint is at rest."""
        return self._ticks * self._period >= self.duration
