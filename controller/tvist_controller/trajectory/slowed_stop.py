"""Stops in which a known motion becomes slower and slower, with its own time."""

import numpy as np
import ruckig

from tvist_controller.trajectory.base import Forecast, Trajectory
from tvist_controller.trajectory.limits import Floats
from tvist_controller.trajectory.path import Path


class SlowedStop(Trajectory):
    """A motion whose time passes ever more slowly until it stands.

    Where the path has tight bends ahead, for which the motion slows down by itself, a stop that knows only the path's
    curvature finds no limits that suit all of them. This one passes them as the motion would have, only later: it is
    on the path, never ahead of the motion, and no faster.
    """

    path: Path

    def __init__(
        self,
        path: Path,
        ahead: Floats,  # parameter at the last two ticks and the coming ones, shape (k, m), k >= 4
        *,
        acceleration: float,  # that the slowing of time may cause at any joint [rad/s^2]
        jerk: float,  # that it may cause [rad/s^3]
        fastest: float,  # largest velocity of any joint now [rad/s]
        period: float,  # tick [s]
    ) -> None:
        self.path, self.acceleration, self.jerk = path, acceleration, jerk
        request = ruckig.InputParameter(1)
        request.control_interface = ruckig.ControlInterface.Velocity
        request.current_position, request.current_velocity = [0.0], [1.0]
        request.current_acceleration = [0.0]
        request.target_velocity, request.target_acceleration = [0.0], [0.0]
        request.max_acceleration, request.max_jerk = [acceleration / fastest], [jerk / fastest]
        slowing = ruckig.Trajectory(1)
        ruckig.Ruckig(1).calculate(request, slowing)
        self.duration = float(slowing.duration)
        """Time from its start until rest [s]."""
        self._period, self._ticks = period, 0
        ticks = np.arange(int(np.ceil(self.duration / period)) + 1)
        times = [float(slowing.at_time(min(tick * period, self.duration))[0][0]) for tick in ticks.tolist()]
        self._samples = _between(ahead, np.array(times) / period)
        """Its samples, of which the first is the newest one of the motion."""
        joints = np.array([path.posture(x) for x in (ahead[0], *self._samples, self._samples[-1])])
        self._states = (
            joints[1:-1],
            0.5 * (joints[2:] - joints[:-2]) / period,
            np.diff(joints, 2, axis=0) / period**2,
        )

    @property
    def hardest(self) -> float:
        """Largest acceleration of any joint in it [rad/s^2]."""
        return float(np.abs(self._states[2]).max())

    def share(self, time: float) -> float:
        """Distance that the parameter has covered at a time after the start."""
        return self.path.forwards(self._samples[self._number(time)] - self._samples[0])

    def states(self, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration of the joints at k times after the start, each of shape (k, n)."""
        numbers = [self._number(time) for time in times.tolist()]
        q, qd, qdd = (each[numbers] for each in self._states)
        return q, qd, qdd

    def next(self) -> Floats:
        """Advance by one tick and return the parameter."""
        self._ticks += 1
        x: Floats = self._samples[min(self._ticks, len(self._samples) - 1)]
        return x

    @property
    def finished(self) -> bool:
        """Whether it has come to rest."""
        return self._ticks >= len(self._samples) - 1

    @property
    def forecast(self) -> Forecast:
        """Forecast of its motion, which brakes from the start."""
        along = self._samples[:, self.path.leading]
        braking, jerk = (
            float(np.abs(np.diff(along, order)).max(initial=0.0)) / self._period**order for order in (2, 3)
        )
        return Forecast(self.path, self._samples[-1], braking, jerk, 0.0)

    @property
    def end(self) -> Floats:
        """Joint positions at which the stop ends, shape (n,) [rad]."""
        end: Floats = self._states[0][-1]
        return end

    def _number(self, time: float) -> int:
        return min(round(time / self._period), len(self._samples) - 1)


def _between(ahead: Floats, ticks: Floats) -> Floats:
    """Samples of a motion between its ticks, which count from the second: cubic splines through four of them."""
    last = len(ahead) - 1
    number = np.minimum(ticks.astype(int), last - 1) + 1
    t = (ticks - (number - 1))[:, None]
    before, start, end, then = (ahead[np.minimum(number + step, last)] for step in (-1, 0, 1, 2))
    own, next_ = 0.5 * (end - before), 0.5 * (then - start)
    change = end - start
    found: Floats = start + t * (
        own + t * (3.0 * change - 2.0 * own - next_ + t * (own + next_ - 2.0 * change))
    )
    return found
