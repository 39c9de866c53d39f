"""Stops: of independent joints, along a path, and by slowing a known motion down."""

import math
from collections.abc import Sequence

import numpy as np
import ruckig

from tvist_controller.trajectory.base import BrakingForecast, Floats, Path, Trajectory
from tvist_controller.trajectory.spline import between
from tvist_plant.plant import PERIOD


class StopTrajectory(Trajectory):
    """Shortest way to rest of joints or entries of a path's parameter within acceleration and jerk limits."""

    def __init__(
        self,
        start: Sequence[Sequence[float]],  # positions, velocities and accelerations, n each
        acceleration: float,
        jerk: float,
    ) -> None:
        self._slowing = _slowing(start, acceleration, jerk)
        self.acceleration, self.jerk = acceleration, jerk
        """Limits of joint acceleration [rad/s^2] and of the entries' jerk [rad/s^3]."""
        self._ticks = 0

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return float(self._slowing.duration)

    def at(self, time: float) -> tuple[Floats, Floats, Floats]:
        """Return position, velocity and acceleration at a time after the start [s], each of shape (n,)."""
        position, velocity, acceleration = self._slowing.at_time(min(time, self.duration))[:3]
        return np.array(position), np.array(velocity), np.array(acceleration)

    def states(self, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Evaluate `at` at k times, shape (k,) [s]; each result has shape (k, n)."""
        duration, at_time = self.duration, self._slowing.at_time
        states = [at_time(min(time, duration)) for time in times.tolist()]
        position, velocity, acceleration = (
            np.array([state[order] for state in states]) for order in range(3)
        )
        return position, velocity, acceleration

    def next(self) -> Floats:
        """Advance by one tick and return the sample."""
        self._ticks += 1
        return self._sample(self._ticks * PERIOD)

    def _sample(self, time: float) -> Floats:
        return self.at(time)[0]

    @property
    def finished(self) -> bool:
        """Whether the stop has come to rest."""
        return self._ticks * PERIOD >= self.duration


class JointStop(StopTrajectory):
    """Shortest stop within limits of acceleration and jerk; each joint stops as soon as it can."""

    def __init__(self, q: Floats, qd: Floats, qdd: Floats, *, acceleration: float, jerk: float) -> None:
        super().__init__((q.tolist(), qd.tolist(), qdd.tolist()), acceleration, jerk)

    @property
    def end(self) -> Floats:
        """Final position, shape (n,) [rad]."""
        return self.at(self.duration)[0]

    @property
    def farthest(self) -> Floats:
        """Largest absolute position of each joint on the way, shape (n,) [rad]."""
        return np.array([max(-bound.min, bound.max) for bound in self._slowing.position_extrema])

    @property
    def velocity(self) -> Floats:
        """Velocity at the last reference, shape (n,) [rad/s]."""
        return self.at(self._ticks * PERIOD)[1]


class PathStop(StopTrajectory):
    """Shortest stop along a path within limits of its parameter's acceleration and jerk.

    Samples are the parameter, so the stop stays on the path. No other motion on the path from the same state,
    within the same limits and without turning back, is slower at any moment or rests sooner: the stop always
    has the lowest possible acceleration until that must return to zero. A stop that brakes at least as hard
    as the motion ever would is therefore never ahead of the motion.

    The stop brakes with full jerk from the first step: the second difference b of the last positions becomes
    b - jerk·h, and the stop continues from the state that central differences give for this step. If the
    limits allow standing still at once, the stop does so.
    """

    path: Path

    def __init__(
        self,
        path: Path,
        x: Floats,  # newest sample, shape (m,) [rad]
        step: Floats,  # step from the previous sample to x, along the path's direction, shape (m,) [rad]
        xdd: Floats,  # acceleration from the last 3 samples, along the path's direction, shape (m,) [rad/s^2]
        *,
        acceleration: float,  # limit for the joints [rad/s^2]
        braking: float,  # corresponding limit for the parameter [rad/s^2]
        jerk: float,  # limit for the parameter [rad/s^3]
    ) -> None:
        before, period = path.forwards(xdd), PERIOD
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
        super().__init__(([0.0], [speed], [bend]), braking, jerk)
        self.path, self._origin, self.acceleration = path, x, acceleration
        self.braking = braking  # acceleration limit of the parameter [rad/s^2]

    def share(self, time: float) -> float:
        """Return the distance covered by the parameter at a time after the start [rad]."""
        return float(self._slowing.at_time(min(time, self.duration))[0][0])

    def states(self, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Return joint position, velocity and acceleration at k times after the start, shape (k, n)."""
        x, xd, xdd = (each * self.path.direction for each in super().states(times))
        return self.path.states(self._origin + x, xd, xdd)

    @property
    def forecast(self) -> BrakingForecast:
        """BrakingForecast of its motion, which brakes from the start."""
        return BrakingForecast(self.path, self._sample(self.duration), self.braking, self.jerk, 0.0)

    @property
    def end(self) -> Floats:
        """Final joint positions, shape (n,) [rad]."""
        return self.path.posture(self._sample(self.duration))

    def _sample(self, time: float) -> Floats:
        return self._origin + self.share(time) * self.path.direction


class SlowedStop(Trajectory):
    """A motion whose time slows down until it stands.

    If tight bends lie ahead, the motion itself slows down for them, and no stop within constant limits suits
    them. A `SlowedStop` passes the bends as the motion would, but later: on the path, never ahead of the
    motion, and no faster.
    """

    path: Path

    def __init__(
        self,
        path: Path,
        ahead: Floats,  # parameter at the last two ticks and the coming ones, shape (k, m), k >= 4
        *,
        acceleration: float,  # largest that the slowing of time may cause at any joint [rad/s^2]
        jerk: float,  # largest that the slowing of time may cause at any joint [rad/s^3]
        fastest: float,  # largest velocity of any joint now [rad/s]
    ) -> None:
        self.path, self.acceleration, self.jerk = path, acceleration, jerk
        slowing = _slowing(([0.0], [1.0], [0.0]), acceleration / fastest, jerk / fastest)
        self.duration = float(slowing.duration)  # duration [s]
        self._ticks = 0
        ticks = np.arange(int(np.ceil(self.duration / PERIOD)) + 1)
        times = [float(slowing.at_time(min(tick * PERIOD, self.duration))[0][0]) for tick in ticks.tolist()]
        self._samples = _between(ahead, np.array(times) / PERIOD)
        """Samples, beginning with the motion's newest one."""
        joints = np.array([path.posture(x) for x in (ahead[0], *self._samples, self._samples[-1])])
        self._states = (
            joints[1:-1],
            0.5 * (joints[2:] - joints[:-2]) / PERIOD,
            np.diff(joints, 2, axis=0) / PERIOD**2,
        )

    @property
    def hardest(self) -> float:
        """Largest acceleration of any joint [rad/s^2]."""
        return float(np.abs(self._states[2]).max())

    def share(self, time: float) -> float:
        """Return the distance covered by the parameter at a time after the start."""
        return self.path.forwards(self._samples[self._number(time)] - self._samples[0])

    def states(self, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Return joint position, velocity and acceleration at k times after the start, each (k, n)."""
        numbers = np.minimum(np.rint(times / PERIOD).astype(int), len(self._samples) - 1)
        q, qd, qdd = (each[numbers] for each in self._states)
        return q, qd, qdd

    def next(self) -> Floats:
        """Advance by one tick and return the parameter."""
        self._ticks += 1
        return np.asarray(self._samples[min(self._ticks, len(self._samples) - 1)])

    @property
    def finished(self) -> bool:
        """Whether the stop has come to rest."""
        return self._ticks >= len(self._samples) - 1

    @property
    def forecast(self) -> BrakingForecast | None:
        """BrakingForecast of its motion, which brakes from the start; None on a curve of each joint."""
        if self.path.posture_of is None:
            return None
        along = self._samples[:, self.path.leading]
        braking, jerk = (
            float(np.abs(np.diff(along, order)).max(initial=0.0)) / PERIOD**order for order in (2, 3)
        )
        return BrakingForecast(self.path, self._samples[-1], braking, jerk, 0.0)

    @property
    def end(self) -> Floats:
        """Final joint positions, shape (n,) [rad]."""
        return np.asarray(self._states[0][-1])

    def _number(self, time: float) -> int:
        return min(round(time / PERIOD), len(self._samples) - 1)


def _between(ahead: Floats, ticks: Floats) -> Floats:
    """Interpolate a motion by cubic splines at times in ticks, which count from the second sample."""
    last = len(ahead) - 1
    number = np.minimum(ticks.astype(int), last - 1) + 1
    t = (ticks - (number - 1))[:, None]
    before, start, end, then = (ahead[np.minimum(number + step, last)] for step in (-1, 0, 1, 2))
    return between(before, start, end, then, t)[0]


def _slowing(start: Sequence[Sequence[float]], acceleration: float, jerk: float) -> ruckig.Trajectory:
    request = ruckig.InputParameter(n := len(start[0]))
    request.control_interface = ruckig.ControlInterface.Velocity
    request.synchronization = ruckig.Synchronization.No
    request.current_position, request.current_velocity, request.current_acceleration = start
    request.target_velocity = request.target_acceleration = [0.0] * n
    request.max_acceleration, request.max_jerk = [acceleration] * n, [jerk] * n
    found = ruckig.Trajectory(n)
    ruckig.Ruckig(n).calculate(request, found)
    return found
