"""References guided by a client, each command of which replaces the previous one."""

import copy
import math
from abc import abstractmethod
from collections.abc import Callable
from typing import Self

import numpy as np

from tvist_controller.trajectory.base import Floats, MotionLimits, Trajectory
from tvist_controller.trajectory.limiter import Limiter, TorqueMargin
from tvist_plant.plant import PERIOD

LOOKAHEAD = (0.03, 0.2)  # range of the time constant [s]
GAIN = (100.0, 2000.0)  # range of the gain [1/s^2]
DAMPED = 3.0  # smallest gain times squared lag: damping 0.87, overshoot 0.4 % [-]
DELAY = 1.5
"""Ticks by which T exceeds the lookahead. Each posture is held for a tick, which adds half a tick. So
`target_q` lags by the lookahead plus two ticks, one of which is the differentiator's."""
THERE = 1e-7  # distance, and change per tick, below which the posture is reached [rad]


class StuckError(Exception):
    """The commanded reference cannot continue; the message states the reason."""


class Guided(Trajectory):
    """A reference that follows the latest command."""

    limits: MotionLimits
    foreseeable = False
    rate: float  # time rate [-]

    @property
    @abstractmethod
    def state(self) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration of the reference, each of shape (n,)."""

    @abstractmethod
    def adopt(self, limits: MotionLimits) -> None:
        """Set other joint limits; call `pace` afterwards."""

    def adapt(self, reduced_limits: Callable[[MotionLimits | None], MotionLimits]) -> None:
        """See `Trajectory.adapt`."""
        self.adopt(reduced_limits(None))

    @abstractmethod
    def pace(self, speed: float, slowest: float | None) -> None:
        """Set the programmed speed fraction [-] and the velocity limit of reduced mode, if active [rad/s]."""


class LimitedFollower(Guided):
    """Passes a signal, timed by its client, through a `Limiter`; reduced mode limits only velocity."""

    def __init__(
        self,
        state: tuple[Floats, Floats, Floats],  # to continue from, q, q̇ and q̈, each of shape (n,)
        limits: MotionLimits,
        reach: Floats,  # largest |q| of each joint, shape (n,) [rad]
        torque: TorqueMargin | None,  # None for no limit
    ) -> None:
        self.limits = self._arm = limits
        self._reach, self._torque = reach, torque
        self.rate = 1.0
        self._follow(state)

    def _follow(self, state: tuple[Floats, Floats, Floats]) -> None:
        self._limiter = Limiter(state, self.limits, self._reach, self._torque)

    @property
    def state(self) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration of the reference, each of shape (n,)."""
        return self._limiter.state

    def adopt(self, limits: MotionLimits) -> None:
        """See `Guided.adopt`."""
        self.limits = self._arm = limits
        self._follow(self.state)

    def pace(self, speed: float, slowest: float | None) -> None:
        """Set the speed that is only reported, and the velocity limit."""
        self.rate = speed
        velocity = self._arm.velocity if slowest is None else min(slowest, self._arm.velocity)
        if velocity != self.limits.velocity:
            self.limits = MotionLimits(velocity, self._arm.acceleration, self._arm.jerk)
            self._follow(self.state)


class ServoFollower(LimitedFollower):
    """Follows the posture p of the latest command like a damped spring: q̈ = k (p - q - T q̇).

    At constant velocity the lag is T for any gain k. T is the lookahead plus 1.5 ticks, so that `target_q`
    lags commands by the lookahead plus two ticks. A high gain approaches with time constant T from the start;
    a low one starts and ends more gently. Gains below 3/T² would overshoot and are raised to that.
    """

    def __init__(
        self,
        state: tuple[Floats, Floats, Floats],
        limits: MotionLimits,
        reach: Floats,
        torque: TorqueMargin,
    ) -> None:
        super().__init__(state, limits, reach, torque)
        self._q, self._qd = np.array(state[0]), np.array(state[1])
        self.aim(self._q, LOOKAHEAD[0], GAIN[0])

    def aim(self, posture: Floats, lookahead: float, gain: float) -> None:
        """Follow another posture; lookahead [s] and gain [1/s^2] are clipped to their ranges."""
        self._posture = np.array(posture, dtype=float)
        lag = min(max(lookahead, LOOKAHEAD[0]), LOOKAHEAD[1]) + DELAY * PERIOD
        k = max(min(max(gain, GAIN[0]), GAIN[1]), DAMPED / lag**2)
        self._step = _step(k, k * lag)

    def fork(self) -> Self:
        """Return an independent copy."""
        other = copy.copy(self)
        other._limiter = copy.copy(self._limiter)  # noqa: SLF001  one of its own kind
        return other

    def next(self) -> Floats:
        """Advance by one tick and return the position."""
        ahead = self._q - self._posture
        (a, b), (c, d) = self._step
        ahead, self._qd = a * ahead + b * self._qd, c * ahead + d * self._qd
        if max(np.abs(ahead).max(), PERIOD * np.abs(self._qd).max()) <= THERE:
            self._q, self._qd = self._posture, np.zeros_like(self._qd)
        else:
            self._q = self._posture + ahead
        return self._limiter.follow(self._q, self._qd)

    @property
    def finished(self) -> bool:
        """Whether the reference rests at the posture."""
        return bool((self._limiter.q == self._posture).all()) and self._limiter.resting


def _step(k: float, damping: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the exact transition of distance and velocity over a tick of ẍ = -k x - damping ẋ."""
    h, decay, square = PERIOD, 0.5 * damping, 0.25 * damping**2 - k
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
