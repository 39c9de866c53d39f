"""A time law with piecewise constant jerk, given by its velocities at even steps of time."""

import math

import numpy as np

from tvist_controller.trajectory.limits import Floats, MotionLimits


class QuietLaw:
    """Time law of a straight line in joint space, from rest to rest; a `TimeLaw`.

    With the velocities c_i as coefficients of quadratic B-splines at steps h, the acceleration at a step is
    (c_i - c_{i-1})/h and linear between steps, and the jerk is constant there. If all velocities, differences and
    second differences keep their limits, so does the law at every time.

    Args:
        start: Parameter at the start, shape (m,) [rad].
        end: Parameter at the end, shape (m,) [rad].
        velocities: c_1 … c_{N-2} of the leading entry for N steps; the others are zero, shape (N - 2,) [rad/s].
        step: h [s].
        limits: Limits that it keeps.
    """

    def __init__(
        self, start: Floats, end: Floats, velocities: Floats, step: float, limits: MotionLimits
    ) -> None:
        self.limits = limits
        """Limits that it keeps."""
        self.begins = 0.0
        """Time from which on it is known [s]."""
        self._start, self._end, self._step = start, end, step
        self._count = len(velocities) + 2
        self.duration = self._count * step
        """Duration from rest to rest [s]."""
        c = np.concatenate(([0.0, 0.0], velocities, [0.0, 0.0]))
        share = step * c.sum()
        self._velocity = 0.5 * (c[:-1] + c[1:]) / share
        self._acceleration = np.diff(c) / (step * share)
        means = (c[:-2] + 4.0 * c[1:-1] + c[2:]) / 6.0
        self._share = np.concatenate(([0.0], np.cumsum(means))) * (step / share)
        slows = np.flatnonzero(self._acceleration < -1e-6 * np.abs(self._acceleration).max())
        self.brakes_at = step * max(int(slows[0]) - 1, 0)
        """Time at which it begins to slow down [s]."""
        self.moments: Floats = np.linspace(0.0, self.duration, self._count + 1)
        """Times at which the jerk changes [s]."""

    def at(self, time: float) -> tuple[list[float], list[float], list[float]]:
        """Parameter [rad], its velocity [rad/s] and its acceleration [rad/s^2] at a time [s], with m numbers each."""
        place = min(max(time / self._step, 0.0), float(self._count))
        if abs(place - round(place)) < 1e-9:
            place = float(round(place))
        i = min(math.floor(place), self._count - 1)
        t = (place - i) * self._step
        a, jerk = self._acceleration[i], (self._acceleration[i + 1] - self._acceleration[i]) / self._step
        v, s = self._velocity[i], self._share[i]
        way = self._end - self._start
        share = s + t * (v + t * (0.5 * a + t * jerk / 6.0)) if place < self._count else 1.0
        return (
            (self._start + share * way).tolist(),
            ((v + t * (a + 0.5 * t * jerk)) * way).tolist(),
            ((a + t * jerk) * way).tolist(),
        )

    def shares(self) -> tuple[Floats, Floats, Floats]:
        """Shares of the way, and their first and second derivatives, at all steps; each of shape (N + 1,)."""
        return self._share, self._velocity, self._acceleration
