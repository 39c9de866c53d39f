"""A posture that is followed with a lag."""

import copy
import math
from typing import Self

import numpy as np

from tvist_controller.trajectory.guided import Following
from tvist_controller.trajectory.limiter import TorqueRoom
from tvist_controller.trajectory.limits import Floats, MotionLimits

LOOKAHEAD = (0.03, 0.2)
"""Range of the time constant [s]."""
GAIN = (100.0, 2000.0)
"""Range of the gain [1/s^2]."""
DAMPED = 3.0
"""Smallest gain times the square of the lag [-]: damping of 0.87, with an overshoot of 0.4 %."""
DELAY = 1.5
"""Ticks by which T exceeds the lookahead: with them, and half a tick for each posture is held for one, `target_q`
follows two ticks later than the lookahead, since the differentiator takes a tick, too.
"""
THERE = 1e-7
"""Distance from the posture, and change within a tick, below which the posture is reached [rad]."""


class Servo(Following):
    """Follows the posture p of the latest command as a damped spring would: q̈ = k (p - q - T q̇).

    A posture that moves with constant velocity is followed with a lag of T, whatever the gain k. T is the lookahead
    plus 1.5 ticks, so that `target_q` follows commands with a lag of lookahead plus two ticks. The gain decides how
    quickly the velocity changes: with a high one, the posture is approached with the time constant T from the start;
    with a low one, the motion begins and ends more gently. A gain below 3/T² would overshoot, and is raised to that.
    """

    def __init__(
        self,
        state: tuple[Floats, Floats, Floats],
        limits: MotionLimits,
        reach: Floats,
        torque: TorqueRoom,
        period: float,
    ) -> None:
        super().__init__(state, limits, reach, torque, period)
        self._q, self._qd = np.array(state[0]), np.array(state[1])
        self.aim(self._q, LOOKAHEAD[0], GAIN[0])

    def aim(self, posture: Floats, lookahead: float, gain: float) -> None:
        """Follow another posture; time constant [s] and gain [1/s^2] are clipped to `LOOKAHEAD` and `GAIN`."""
        self._posture = np.array(posture, dtype=float)
        lag = min(max(lookahead, LOOKAHEAD[0]), LOOKAHEAD[1]) + DELAY * self._period
        k = max(min(max(gain, GAIN[0]), GAIN[1]), DAMPED / lag**2)
        self._step = _step(k, k * lag, self._period)

    def fork(self) -> Self:
        """Return an independent copy of the present state."""
        other = copy.copy(self)
        other._limiter = copy.copy(self._limiter)  # noqa: SLF001  one of its own kind
        return other

    def next(self) -> Floats:
        """Advance by one tick and return the position."""
        ahead = self._q - self._posture
        (a, b), (c, d) = self._step
        ahead, self._qd = a * ahead + b * self._qd, c * ahead + d * self._qd
        if max(np.abs(ahead).max(), self._period * np.abs(self._qd).max()) <= THERE:
            self._q, self._qd = self._posture, np.zeros_like(self._qd)
        else:
            self._q = self._posture + ahead
        return self._limiter.follow(self._q, self._qd)

    @property
    def finished(self) -> bool:
        """Whether it rests at the posture."""
        return bool((self._limiter.q == self._posture).all()) and self._limiter.resting


def _step(k: float, damping: float, h: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Transition of distance and velocity over one tick of ẍ = -k x - damping ẋ, exactly."""
    decay, square = 0.5 * damping, 0.25 * damping**2 - k
    if square > 0.0:
        root = math.sqrt(square)
        even, odd = math.cosh(root * h), math.sinh(root * h) / root
    elif square < 0.0:
        root = math.sqrt(-square)
        even, odd = math.cos(root * h), math.sin(root * h) / root
    else:
        even, odd = 1.0, h
    shrunk = math.exp(-decay * h)
    return (
        (shrunk * (even + decay * odd), shrunk * odd),
        (-shrunk * k * odd, shrunk * (even - decay * odd)),
    )
