"""To rest on a path, never leaving it."""

import math

import numpy as np
import ruckig

from tvist_controller.trajectory.base import Forecast, Trajectory
from tvist_controller.trajectory.limits import Floats
from tvist_controller.trajectory.path import Path


class PathStop(Trajectory):
    """Shortest stop along a path within limits of acceleration and jerk of its parameter.

    Its samples are the parameter: so it stays on the path, and on a straight joint line all joints in phase.
    Nothing that comes to rest on the same path from the same state, within the same limits and without turning
    back, is slower at any moment or rests sooner: there the acceleration is the lowest there is until it has to be
    taken back. So a stop that is at least as hard as anything the motion itself would have done never gets ahead of
    the motion.

    Its first step brakes already, by as much jerk as it may: the second difference b of the positions last played
    becomes b - jerk·h, and the state of motion that it goes on from is that of central differences with this step.
    What hardly moves, so that the limits let it stand at once, does.

    Args:
        path: Path of the stop.
        x: Newest sample, shape (m,) [rad].
        step: By which it is ahead of the one before, along the path's direction, shape (m,) [rad].
        xdd: Second difference of the last three, likewise, shape (m,) [rad/s^2].
        acceleration: Limit that the joints keep in it [rad/s^2].
        braking: Limit for the parameter's acceleration, with which they do [rad/s^2].
        jerk: Limit for the parameter's jerk [rad/s^3].
        period: Tick [s].
    """

    path: Path

    def __init__(
        self,
        path: Path,
        x: Floats,
        step: Floats,
        xdd: Floats,
        *,
        acceleration: float,
        braking: float,
        jerk: float,
        period: float,
    ) -> None:
        self.path, self._origin = path, x
        self.acceleration = acceleration
        """Limit that the joints keep [rad/s^2]."""
        self.braking = braking
        """Limit that the parameter keeps [rad/s^2]."""
        self.jerk = jerk
        """Limit that the parameter keeps [rad/s^3]."""
        before = path.forwards(xdd)
        most, present = jerk * period, max(path.forwards(step) / period, 0.0)
        # The hardest from which the velocity still comes to nothing without turning back.
        turning = jerk * (0.5 * period - math.sqrt(0.25 * period**2 + 2.0 * present / jerk))
        gentle = before > -braking
        bend = max(before - most, -braking, turning) if gentle else min(before + most, -braking)
        goes_on = -jerk if bend > -braking else 0.0
        speed = present + 0.5 * period * bend - period * period * goes_on / 6.0
        halt = -present / period  # the second difference if the next step is none
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
        """From its beginning until it rests [s]."""
        return float(self._trajectory.duration)

    def share(self, time: float) -> float:
        """How far forwards the parameter has come at a time after the beginning [rad]."""
        return float(self._trajectory.at_time(min(time, self.duration))[0][0])

    def states(self, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration of the joints at k moments after the beginning.

        Args:
            times: Shape (k,) [s].

        Returns:
            Three arrays of shape (k, n).
        """
        duration, at_time, along = self.duration, self._trajectory.at_time, self.path.direction
        states = [at_time(min(time, duration)) for time in times.tolist()]
        x, xd, xdd = (np.array([state[order][0] for state in states])[:, None] * along for order in range(3))
        return self.path.states(self._origin + x, xd, xdd)

    def next(self) -> Floats:
        """Parameter one tick further."""
        self._ticks += 1
        return self._at(self._ticks * self._period)

    @property
    def finished(self) -> bool:
        """Whether it rests."""
        return self._ticks * self._period >= self.duration

    @property
    def forecast(self) -> Forecast:
        """Its way: it brakes from the beginning."""
        return Forecast(self.path, self._at(self.duration), self.braking, self.jerk, 0.0)

    @property
    def end(self) -> Floats:
        """Joint positions at which the stop ends, shape (n,) [rad]."""
        return self.path.posture(self._at(self.duration))

    def _at(self, time: float) -> Floats:
        return self._origin + self.share(time) * self.path.direction
