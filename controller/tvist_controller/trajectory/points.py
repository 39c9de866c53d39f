"""Motions through points at given times, interpolated as ROS 2's `joint_trajectory_controller` does."""

import math

import numpy as np

from tvist_controller.trajectory.base import Floats, MotionLimits, TimeLaw
from tvist_controller.trajectory.spline import between, evaluate, hermite
from tvist_plant.plant import PERIOD

LEAST = (1e-3, 1e-2, 0.1)
"""Velocity, acceleration and jerk of a motion that hardly moves, as limits for changes of its rate [rad/s, ...]."""
STANDING = 2  # number of samples at rest before the start, and after the end


class PointLaw(TimeLaw):
    """Joint positions through points at given times.

    At each tick they are on straight lines between points without velocities, on cubics between points with
    velocities, on quintics with accelerations too. Between ticks, which play only while the time rate is not 1, they
    are on a cubic through the positions at the ticks: only those are checked.
    """

    def __init__(
        self,
        times: Floats,  # rising from 0, shape (k,) [s]
        q: Floats,  # shape (k, n) [rad]
        qd: Floats | None = None,  # shape (k, n) [rad/s]
        qdd: Floats | None = None,  # only with velocities, shape (k, n) [rad/s^2]
    ) -> None:
        lasts = np.diff(times)[:, None]
        mean = np.diff(q, axis=0) / lasts
        start, end = (mean, mean) if qd is None else (qd[:-1], qd[1:])
        # The second derivatives of a cubic at its ends; they are 0 if it is a straight line.
        begun, ended = 6.0 * mean - 4.0 * start - 2.0 * end, 2.0 * start + 4.0 * end - 6.0 * mean
        bends = (begun / lasts, ended / lasts) if qdd is None else (qdd[:-1], qdd[1:])
        coefficients = np.moveaxis(hermite(lasts, (q[:-1], start, bends[0]), (q[1:], end, bends[1])), 0, 1)
        number = math.ceil(float(times[-1]) / PERIOD - 1e-9)
        ticks, curve = np.arange(1.0, number), np.empty((4, number - 1, q.shape[1]))
        evaluate(times, np.ascontiguousarray(coefficients), ticks * PERIOD, curve)
        self.samples: Floats = np.concatenate(([q[0]] * (STANDING + 1), curve[0], [q[-1]] * (STANDING + 1)))
        """Positions at each tick, and some at rest before and after, shape (t, n) [rad]."""
        self.moments, self.duration = times, number * PERIOD
        rates = (np.abs(np.diff(self.samples, order, axis=0)).max() / PERIOD**order for order in (1, 2, 3))
        self.limits = MotionLimits(
            *(max(float(rate), least) for rate, least in zip(rates, LEAST, strict=True))
        )

    def at(self, time: float) -> tuple[list[float], list[float], list[float]]:
        """Return joint positions [rad], velocities and accelerations at a time [s], n each."""
        ticks = min(time, self.duration) / PERIOD
        first = int(ticks) + STANDING - 1
        before, start, end, then = self.samples[first : first + 4]
        q, qd, qdd = between(before, start, end, then, ticks - int(ticks))
        return q.tolist(), (qd / PERIOD).tolist(), (qdd / PERIOD**2).tolist()

    def position(self, time: float) -> Floats:
        """Return the joint positions at a time [s], at ticks without interpolation, shape (n,) [rad]."""
        ticks = time / PERIOD
        number = round(ticks)
        at_tick = abs(ticks - number) < 1e-6
        return self.samples[STANDING + number] if at_tick else super().position(time)

    def after(self, time: float) -> Floats:
        """Return the positions from a time on [s], one per tick, shape (k, n) [rad]."""
        return self.samples[STANDING + int(time / PERIOD) :]
