"""To rest on a straight line, all joints in phase."""

import math

import numpy as np
import ruckig

from tvist_server.trajectory.base import Floats, Line, Trajectory


class LineStop(Trajectory):
    """Shortest stop along a straight line within limits of acceleration and jerk.

    Nothing that comes to rest on the same line from the same state, within the same limits and without turning
    back, is slower at any moment or rests sooner: there the acceleration is the lowest there is until it has to be
    taken back. So a stop that is at least as hard as anything the motion itself would have done never gets ahead of
    the motion.

    Its first step brakes already, by as much jerk as it may: the second difference b of the positions last played
    becomes b - jerk·h, and the state of motion that it goes on from is that of central differences with this step.
    What hardly moves, so that the limits let it stand at once, does.

    Args:
        q: Newest reference, shape (n,) [rad].
        step: By which it is ahead of the one before, along the line, shape (n,) [rad].
        qdd: Second difference of the last three, along the line, shape (n,) [rad/s^2].
        direction: Of the line; its largest entry is 1 or -1, shape (n,).
        acceleration: Limit for the joint that turns most [rad/s^2].
        jerk: Limit for the joint that turns most [rad/s^3].
        period: Tick [s].
    """

    def __init__(
        self,
        q: Floats,
        step: Floats,
        qdd: Floats,
        direction: Floats,
        *,
        acceleration: float,
        jerk: float,
        period: float,
    ) -> None:
        self._origin, self._direction = q, direction
        self.acceleration = acceleration
        """Limit that it keeps [rad/s^2]."""
        self.jerk = jerk
        """Limit that it keeps [rad/s^3]."""
        leading = int(np.argmax(np.abs(direction)))
        sign = float(direction[leading])
        before = sign * float(qdd[leading])
        most, present = jerk * period, max(sign * float(step[leading]) / period, 0.0)
        # The hardest from which the velocity still comes to nothing without turning back.
        turning = jerk * (0.5 * period - math.sqrt(0.25 * period**2 + 2.0 * present / jerk))
        if before > -acceleration:
            bend = max(before - most, -acceleration, turning)
        else:
            bend = min(before + most, -acceleration)
        goes_on = -jerk if bend > -acceleration else 0.0
        speed = present + 0.5 * period * bend - period * period * goes_on / 6.0
        halt = -present / period  # the second difference if the next step is none
        if abs(halt - before) <= most and halt >= -acceleration:
            speed = bend = 0.0
        request = ruckig.InputParameter(1)
        request.control_interface = ruckig.ControlInterface.Velocity
        request.current_position, request.current_velocity = [0.0], [speed]
        request.current_acceleration = [bend]
        request.target_velocity, request.target_acceleration = [0.0], [0.0]
        request.max_acceleration, request.max_jerk = [acceleration], [jerk]
        self._trajectory = ruckig.Trajectory(1)
        ruckig.Ruckig(1).calculate(request, self._trajectory)
        self._period = period
        self._ticks = 0

    @property
    def duration(self) -> float:
        """From its beginning until it rests [s]."""
        return float(self._trajectory.duration)

    def share(self, time: float) -> float:
        """How far the joint that turns most has turned at a time after the beginning [rad]."""
        return float(self._trajectory.at_time(min(time, self.duration))[0][0])

    def at(self, time: float) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration at a time after the beginning [s], each of shape (n,)."""
        position, velocity, acceleration = self._trajectory.at_time(min(time, self.duration))[:3]
        along = self._direction
        return self._origin + position[0] * along, velocity[0] * along, acceleration[0] * along

    def states(self, times: Floats) -> tuple[Floats, Floats, Floats]:
        """As `at` at k moments, shape (k,) [s]; each of shape (k, n)."""
        duration, at_time, along = self.duration, self._trajectory.at_time, self._direction
        states = [at_time(min(time, duration)) for time in times.tolist()]
        position, velocity, acceleration = (
            np.array([state[order][0] for state in states])[:, None] * along for order in range(3)
        )
        return self._origin + position, velocity, acceleration

    def next(self) -> Floats:
        """Position one tick further."""
        self._ticks += 1
        return self.at(self._ticks * self._period)[0]

    @property
    def finished(self) -> bool:
        """Whether it rests."""
        return self._ticks * self._period >= self.duration

    @property
    def line(self) -> Line:
        """Its way: it brakes from the beginning."""
        return Line(self._direction, self.end, self.acceleration, self.jerk, 0.0)

    @property
    def end(self) -> Floats:
        """Where it rests, shape (n,) [rad]."""
        return self.at(self.duration)[0]
