"""References that a client guides: each of its commands replaces the one before."""

import copy
import math
from abc import abstractmethod
from collections.abc import Callable
from typing import Self

import numpy as np

from tvist_controller.trajectory.base import Trajectory
from tvist_controller.trajectory.limiter import Limiter, TorqueRoom
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


class StuckError(Exception):
    """No reference follows that keeps to what was commanded; the message gives the reason."""


class Guided(Trajectory):
    """A reference that follows the latest command until another one comes."""

    limits: MotionLimits
    foreseeable = False
    rate: float
    """Rate of its time relative to the clock's [-]."""

    @property
    @abstractmethod
    def state(self) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration of the reference, each of shape (n,)."""

    @abstractmethod
    def adopt(self, limits: MotionLimits) -> None:
        """Keep other limits of the joints from now on; `pace` must follow."""

    def adapt(self, spared: Callable[[MotionLimits | None], MotionLimits]) -> None:
        """See `Trajectory.adapt`."""
        self.adopt(spared(None))

    @abstractmethod
    def pace(self, speed: float, slowest: float | None) -> None:
        """Set the programmed speed fraction [-] and the velocity limit of reduced speed, if it is reduced [rad/s]."""


class Following(Guided):
    """Passes a signal through a `Limiter`: within the arm's limits, the joints' range and the available torque.

    The client determines the timing of the signal, so the speed slider has no effect on it; reduced speed limits the
    velocity.
    """

    def __init__(
        self,
        state: tuple[Floats, Floats, Floats],  # to continue from, q, q̇ and q̈, each of shape (n,)
        limits: MotionLimits,
        reach: Floats,  # largest |q| of each joint, shape (n,) [rad]
        torque: TorqueRoom | None,  # None for no limit
        period: float,  # tick [s]
    ) -> None:
        self.limits = self._arm = limits
        self._reach, self._torque, self._period = reach, torque, period
        self.rate = 1.0
        self._follow(state)

    def _follow(self, state: tuple[Floats, Floats, Floats]) -> None:
        self._limiter = Limiter(state, self.limits, self._period, self._reach, self._torque)

    @property
    def state(self) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration of the reference, each of shape (n,)."""
        return self._limiter.state

    def adopt(self, limits: MotionLimits) -> None:
        """See `Guided.adopt`."""
        self.limits = self._arm = limits
        self._follow(self.state)

    def pace(self, speed: float, slowest: float | None) -> None:
        """Set the speed that is reported, and the velocity limit."""
        self.rate = speed
        velocity = self._arm.velocity if slowest is None else min(slowest, self._arm.velocity)
        if velocity != self.limits.velocity:
            self.limits = MotionLimits(velocity, self._arm.acceleration, self._arm.jerk)
            self._follow(self.state)


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
