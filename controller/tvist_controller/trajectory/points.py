"""Motions through points at given times, interpolated as ROS 2's `joint_trajectory_controller` does."""

import math

import numpy as np

from tvist_controller.trajectory.base import Floats, MotionLimits
from tvist_controller.trajectory.spline import evaluate, hermite
from tvist_plant.plant import PERIOD

LEAST = (1e-3, 1e-2, 0.1)
"""Velocity, acceleration and jerk of a motion that hardly moves, as limits for changes of its rate [rad/s, ...]."""
STANDING = 2  # number of samples at rest before the start, and after the end


class PointLaw:
    """Joint positions as polynomials of time between points.

    Without velocities they are straight lines, with velocities cubics, with accelerations too quintics. All are
    evaluated as quintics, of which lines and cubics are special cases.
    """

    begins = 0.0
    brakes_at = 0.0  # not known

    def __init__(
        self,
        times: Floats,  # rising from 0, shape (k,) [s]
        q: Floats,  # shape (k, n) [rad]
        qd: Floats | None = None,  # shape (k, n) [rad/s]
        qdd: Floats | None = None,  # only with velocities, shape (k, n) [rad/s^2]
    ) -> None:
        self.moments, self.duration = times, float(times[-1])
        lasts = np.diff(times)[:, None]
        mean = np.diff(q, axis=0) / lasts
        start, end = (mean, mean) if qd is None else (qd[:-1], qd[1:])
        # Those of a cubic, which are 0 on a straight line.
        begun, ended = 6.0 * mean - 4.0 * start - 2.0 * end, 2.0 * start + 4.0 * end - 6.0 * mean
        bends = (begun / lasts, ended / lasts) if qdd is None else (qdd[:-1], qdd[1:])
        coefficients = hermite(lasts, (q[:-1], start, bends[0]), (q[1:], end, bends[1]))
        self._times = np.ascontiguousarray(times)
        self._coefficients = np.ascontiguousarray(np.moveaxis(coefficients, 0, 1))
        ticks: Floats = np.arange(1, math.ceil(self.duration / PERIOD - 1e-9), dtype=float)
        self.samples: Floats = np.concatenate(
            ([q[0]] * (STANDING + 1), self._evaluate(ticks * PERIOD)[0], [q[-1]] * (STANDING + 1))
        )
        """Positions at each tick, and some at rest before and after, shape (t, n) [rad]."""
        rates = (np.abs(np.diff(self.samples, order, axis=0)).max() / PERIOD**order for order in (1, 2, 3))
        self.limits = MotionLimits(
            *(max(float(rate), least) for rate, least in zip(rates, LEAST, strict=True))
        )

    def at(self, time: float) -> tuple[list[float], list[float], list[float]]:
        """Return joint positions [rad], velocities and accelerations at a time [s], n each."""
        q, qd, qdd, _ = self._evaluate(np.array([min(time, self.duration)]))
        return q[0].tolist(), qd[0].tolist(), qdd[0].tolist()

    def after(self, time: float) -> Floats:
        """Return the positions from a time on [s], one per tick, shape (k, n) [rad]."""
        return self.samples[STANDING + int(time / PERIOD) :]

    def _evaluate(self, times: Floats) -> Floats:
        out = np.empty((4, len(times), self._coefficients.shape[2]))
        evaluate(self._times, self._coefficients, times, out)
        return out
