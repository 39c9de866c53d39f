"""Stops that stay on a path."""

import math

import numpy as np
import ruckig

from tvist_controller.trajectory.base import Forecast, Trajectory
from tvist_controller.trajectory.limits import Floats
from tvist_controller.trajectory.path import Path


class PathStop(Trajectory):
    """Shortest stop along a path within limits of acceleration and jerk of its parameter.

    Its samples are the parameter, so it stays on the path; on a straight line in joint space, all joints stay in
    phase. No other motion on the same path, from the same state and within the same limits, that does not turn back
    is slower at any moment or comes to rest sooner: the stop always has the lowest possible acceleration, until the
    acceleration has to return to zero. A stop that brakes at least as hard as the motion would ever have done is
    therefore never ahead of the motion.

    It brakes from its first step with full jerk: the second difference b of the positions played last becomes b -
    jerk·h, and the stop continues from the state of motion that central differences give with this step. If the
    motion is so slow that the limits let it stand at once, it does.
    """

    path: Path

    def __init__(
        self,
        path: Path,
        x: Floats,  # newest sample, shape (m,) [rad]
        step: Floats,  # from the sample before, along the path's direction, shape (m,) [rad]
        xdd: Floats,  # second difference of the last three, likewise, shape (m,) [rad/s^2]
        *,
        acceleration: float,  # limit for the joints [rad/s^2]
        braking: float,  # corresponding one for the parameter [rad/s^2]
        jerk: float,  # limit for the parameter [rad/s^3]
        period: float,  # tick [s]
    ) -> None:
        self.path, self._origin = path, x
        self.acceleration = acceleration
        """Acceleration limit for the joints [rad/s^2]."""
        self.braking = braking
        """Acceleration limit for the parameter [rad/s^2]."""
        self.jerk = jerk
        """Jerk limit for the parameter [rad/s^3]."""
        before = path.forwards(xdd)
        most, present = jerk * period, max(path.forwards(step) / period, 0.0)
        # The hardest braking from which the velocity can still reach zero without turning back.
        turning = jerk * (0.5 * period - math.sqrt(0.25 * period**2 + 2.0 * present / jerk))
        gentle = before > -braking
        bend = max(before - most, -braking, turning) if gentle else min(before + most, -braking)
        goes_on = -jerk if bend > -braking else 0.0
        speed = present + 0.5 * period * bend - period * period * goes_on / 6.0
        halt = -present / period  # the second difference if the next step is zero
        if abs(halt - before) <= most and halt >= -braking:
            speed = bend = 0.0
        request = ruckig.InputParameter(1)
        request.control_interface = ruckig.ControlInterface.Velocity
        request.current_position, request.current_velocity = [0.0], [speed]
        request.current_acceleration = [bend]
        request.target_velocity, request.target_acceleration = [0.0], [0.0]
        request.max_acceleration, request.max_jerk = [braking], [jerk]
        self._trajectory = ruckig.Trajectory(1)
        ruckig.Ruckig(1).calculate(request, self._trajectory)
        self._period = period
        self._ticks = 0

    @property
    def duration(self) -> float:
        """Time from its start until rest [s]."""
        return float(self._trajectory.duration)

    def share(self, time: float) -> float:
        """Distance that the parameter has covered at a time after the start [rad]."""
        return float(self._trajectory.at_time(min(time, self.duration))[0][0])

    def states(self, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration of the joints at k times after the start, shape (k, n)."""
        duration, at_time, along = self.duration, self._trajectory.at_time, self.path.direction
        states = [at_time(min(time, duration)) for time in times.tolist()]
        x, xd, xdd = (np.array([state[order][0] for state in states])[:, None] * along for order in range(3))
        return self.path.states(self._origin + x, xd, xdd)

    def next(self) -> Floats:
        """Advance by one tick and return the parameter."""
        self._ticks += 1
        return self._at(self._ticks * self._period)

    @property
    def finished(self) -> bool:
        """Whether it has come to rest."""
        return self._ticks * self._period >= self.duration

    @property
    def forecast(self) -> Forecast:
        """Forecast of its motion, which brakes from the start."""
        return Forecast(self.path, self._at(self.duration), self.braking, self.jerk, 0.0)

    @property
    def end(self) -> Floats:
        """Joint positions at which the stop ends, shape (n,) [rad]."""
        return self.path.posture(self._at(self.duration))

    def _at(self, time: float) -> Floats:
        return self._origin + self.share(time) * self.path.direction
