"""What approaches of a velocity have in common: how far a change goes in a tick, and at which rates it keeps limits."""

import math
from collections.abc import Iterator

import numpy as np

from tvist_controller.trajectory.guided import Guided
from tvist_controller.trajectory.limiter import TorqueRoom
from tvist_controller.trajectory.limits import Floats, MotionLimits

HALVINGS = 8
"""Number of times that a change of velocity may be halved if the torque or the joints do not permit it."""
TRIES = 4
"""Number of these halvings that are tried in one tick, from twice the share of the tick before on."""
STANDING = 1e-6
"""Velocity below which all joints count as standing where a motion is taken over [rad/s]."""
STEADY = 1e-12
"""Velocity below which a motion whose time hardly passes counts as being at rest [rad/s or m/s]."""
FLAT = 1e-12
"""Factor of a rate that counts as zero."""
ROUNDING = 1e-9
"""Share of a tick by which rounding may delay the end of a change [-]."""


class Speed(Guided):
    """Base of the trajectories that approach a velocity.

    Each has a time of its own, in which the velocity approaches its goal with constant acceleration; the reference has
    that velocity times the rate of this time. So at a constant rate r, velocities are multiplied by r and accelerations
    by r². The rate changes as quickly as the acceleration permits.

    Args:
        state: Position [rad], velocity [rad/s] and acceleration [rad/s^2] to continue from, each of shape (n,).
        limits: Limits of every joint; the jerk is that of stops.
        torque: Motion that the torque permits.
        period: Tick [s].
        rate: Rate of its time, 0 to 1 [-]; more if the joints are too fast for it at the start.
    """

    def __init__(
        self,
        state: tuple[Floats, Floats, Floats],
        limits: MotionLimits,
        torque: TorqueRoom,
        period: float,
        *,
        rate: float = 1.0,
    ) -> None:
        self._q, self._qd, self._qdd = (np.array(values, dtype=float) for values in state)
        self._torque, self._period = torque, period
        self.adopt(limits)
        fastest = float(np.abs(self._qd).max())
        self._stands = fastest <= STANDING
        if self._stands:
            self._qd = np.zeros_like(self._q)
        self.rate = max(rate, min(fastest / limits.velocity, 1.0))
        self._speed, self._slowest = rate, limits.velocity
        self._share = 1.0
        """Share of the acceleration that was tried last [-]."""
        self._goal = np.zeros_like(self._q)

    def come_to_rest(self) -> None:
        """Approach zero, with the acceleration of the last command, until another one comes."""
        self._goal = np.zeros_like(self._goal)

    def adopt(self, limits: MotionLimits) -> None:
        """See `Guided.adopt`. The jerk is that of the acceleration changing its sign within a tick."""
        self._arm = limits
        self.limits = MotionLimits(
            limits.velocity, limits.acceleration, 2.0 * limits.acceleration / self._period
        )

    def _shares(self, most: float = 1.0) -> Iterator[float]:
        """Shares of the acceleration to try in a tick, at last none: no tick may take long [-]."""
        top = min(max(2.0 * self._share, 0.5**HALVINGS), 1.0)
        for halved in range(TRIES):
            self._share = top * 0.5**halved
            yield min(top, most) * 0.5**halved
        self._share = 0.0
        yield 0.0

    @property
    def state(self) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration of the reference, each of shape (n,)."""
        return self._q, self._qd, self._qdd


def part_of(duration: float, time: float) -> float:
    """Return the part of a change that is made in some time; exactly 1 if the time suffices.

    Args:
        duration: Time that the whole change takes [s].
        time: Available time [s].
    """
    return 1.0 if duration <= time * (1.0 + ROUNDING) else time / duration


def fitting_rates(x: Floats, y: Floats, low: Floats, high: Floats) -> tuple[float, float]:
    """Return the lowest and the highest r with low ≤ x + r y ≤ high in every entry; the first is larger if none fits.

    Args:
        x: Constant part, shape (n,).
        y: Factor of r, shape (n,).
        low: Lower limits, shape (n,).
        high: Upper limits, shape (n,).
    """
    lowest, highest = -math.inf, math.inf
    for own, slope, least, most in zip(x.tolist(), y.tolist(), low.tolist(), high.tolist(), strict=True):
        if abs(slope) < FLAT:
            if not least <= own <= most:
                return math.inf, -math.inf
            continue
        ends = (least - own) / slope, (most - own) / slope
        lowest, highest = max(lowest, min(ends)), min(highest, max(ends))
    return lowest, highest


def rise_within(speed: Floats, limits: MotionLimits, period: float) -> Floats:
    """Return the acceleration at which each joint may get faster, so that a stop keeps its velocity limit.

    A stop ends the present acceleration with the limit's jerk, and the joint gets faster until it has. Two ticks are
    reserved, since the acceleration of the newest reference is known as the mean of two ticks.

    Args:
        speed: Present speed of each joint, shape (n,) [rad/s].
        limits: Limits of the joints.
        period: Tick [s].
    """
    left, two = np.maximum(limits.velocity - speed, 0.0), 2.0 * period
    rise: Floats = np.minimum(
        limits.jerk * (np.sqrt(two * two + 2.0 * left / limits.jerk) - two), limits.acceleration
    )
    return rise
