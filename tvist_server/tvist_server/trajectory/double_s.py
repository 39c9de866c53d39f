"""Point to point with a double-S velocity profile."""

import copy
from collections.abc import Iterator
from typing import Self

import numpy as np
import ruckig

from tvist_server.trajectory.base import Floats, Limits, Line, Trajectory
from tvist_server.trajectory.pace import Pace

LOOK_AHEAD = 2.0
"""Ticks by which the path is looked ahead of when its pace changes."""

LONGEST_LOOK = 1500
"""Ticks for which a motion is compared with its pause: one that lasts longer is not about to end."""
SOONER = 25
"""Ticks by which a pause must be over sooner than the motion, to be worth it."""

SURELY = 0.12
"""So long before the motion brakes, and as much more as it lasts longer, a pause is sooner for certain [s]."""


class DoubleS(Trajectory):
    """Time-optimal motion at rest to rest, all joints in phase: a straight line in joint space.

    Velocity, acceleration and jerk limits hold for every joint; the joint with the longest way sets the pace
    (Biagiotti and Melchiorri 2008, ch. 3.4). With the paper's limits of 1.5 rad/s, 2.0 rad/s² and 100 rad/s³
    the acceleration ramps last 20 ms.

    Args:
        start: Joint positions at rest, shape (n,) [rad].
        target: Joint positions at rest, shape (n,) [rad].
        limits: For every joint.
        period: Tick [s].
        speed: Rate of its time against the clock's to start with [-].

    Raises:
        ValueError: There is no such motion within these limits, or it would last for hours.
    """

    def __init__(
        self, start: Floats, target: Floats, limits: Limits, period: float, speed: float = 1.0
    ) -> None:
        n = len(start)
        request = ruckig.InputParameter(n)
        request.current_position, request.target_position = start.tolist(), target.tolist()
        request.max_velocity = [limits.velocity] * n
        request.max_acceleration = [limits.acceleration] * n
        request.max_jerk = [limits.jerk] * n
        request.synchronization = ruckig.Synchronization.Phase
        self._trajectory = ruckig.Trajectory(n)
        try:
            ruckig.Ruckig(n).calculate(request, self._trajectory)
        except (ruckig.RuckigError, ValueError) as error:  # beyond 7600 s its result is one it cannot name
            raise ValueError(
                f"no motion goes from {start.tolist()} to {target.tolist()} in less than two hours within "
                f"velocity {limits.velocity:g}, acceleration {limits.acceleration:g}, jerk {limits.jerk:g}"
            ) from error
        self.target = np.array(target, dtype=float)
        """Where it ends, shape (n,) [rad]."""
        way = self.target - start
        farthest = float(np.abs(way).max())
        self._direction = way / farthest if farthest > 0.0 else np.zeros(n)
        # From rest to rest it is the same forwards and backwards: it brakes for as long as it accelerates.
        leading = self._trajectory.profiles[0][int(np.argmax(np.abs(way)))]
        self._brakes_at = self.duration - sum(leading.t[:3])
        self._period = period
        self.limits = limits
        """Limits it keeps."""
        self.speed = speed
        """Rate that its time is to go at, 0 to 1 [-]."""
        self._pace = Pace(limits, period, speed)
        # Time on the path: whole ticks at an even rate since the rate last changed, so that nothing adds up.
        self._since, self._ticks = 0.0, 0

    @property
    def duration(self) -> float:
        """From rest to rest [s]."""
        return float(self._trajectory.duration)

    def time_at(self, share: float) -> float:
        """When a share of the way, 0 to 1, is behind it [s]; the way is straight, so every joint agrees."""
        start, end = (np.array(self._trajectory.at_time(time)[0]) for time in (0.0, self.duration))
        joint = int(np.argmax(np.abs(end - start)))
        early, late = 0.0, self.duration
        for _ in range(40):
            middle = 0.5 * (early + late)
            done = (self._trajectory.at_time(middle)[0][joint] - start[joint]) / (end[joint] - start[joint])
            early, late = (middle, late) if done < share else (early, middle)
        return late

    def states(self, count: int) -> Iterator[tuple[Floats, Floats, Floats]]:
        """Position, velocity and acceleration at some moments of the whole motion at full speed, each of shape (n,)."""
        for time in np.linspace(0.0, self.duration, count).tolist():
            q, qd, qdd = (np.array(values) for values in self._trajectory.at_time(time)[:3])
            yield q, qd, qdd

    def next(self) -> Floats:
        """Position one tick further; the target exactly from the first tick at or after the end."""
        if self.steady:
            self._ticks += 1
        else:
            time = self.time
            ends = (time, time + LOOK_AHEAD * self._period)
            curve = [np.array(self._trajectory.at_time(end)[1:3]) for end in ends]
            step = self._pace.advance(self.speed, curve)
            self._since, self._ticks = time + step, 0
        if self.finished:
            return self.target
        return np.array(self._trajectory.at_time(self.time)[0])

    @property
    def rate(self) -> float:
        """Rate at which its time goes [-]."""
        return self._pace.rate

    @property
    def standing(self) -> bool:
        """Whether it has reached its target, or is paused and has come to a standstill."""
        return self.finished or (self.rate == 0.0 and self.steady)

    @property
    def line(self) -> Line:
        """Its way; how soon it brakes is known where its rate does not change."""
        time, rate = self.time, self._pace.rate
        known = rate > 0.0 and self.steady
        return Line(
            self._direction,
            self.target,
            self.limits.acceleration,
            self.limits.jerk,
            max(self._brakes_at - time, 0.0) / rate if known else 0.0,
        )

    @property
    def steady(self) -> bool:
        """Whether its rate is what it is to be."""
        return self._pace.steady(self.speed)

    @property
    def velocity(self) -> float:
        """Of the joint that turns most, now [rad/s]."""
        return float(np.abs(self._trajectory.at_time(self.time)[1]).max()) * self._pace.rate

    def hold(self, acceleration: float) -> bool:
        """Pause, where that lets it stand noticeably sooner than if it were let go on.

        Near its end there is hardly any acceleration left to pause with: a pause would only draw the end out.

        Args:
            acceleration: Limit for every joint while it slows down, no more than the motion's own [rad/s^2].

        Returns:
            Whether it pauses.
        """
        paused = self.fork()
        paused.speed, paused._pace.acceleration = 0.0, acceleration  # noqa: SLF001  one of its own kind
        most, line = self.limits.acceleration, self.line
        longer = self.velocity * (1.0 / acceleration - 1.0 / most) + 2.0 * most / self.limits.jerk
        if line.steady == 0.0 and self.rate == 1.0 and self.steady:
            return False  # it brakes as hard as it may
        if line.steady < longer + SURELY and not _stands_sooner(paused, self.fork()):
            return False
        self.speed, self._pace.acceleration = 0.0, acceleration
        return True

    def release(self, speed: float) -> None:
        """Go on after a pause, at a rate [-]."""
        self.speed, self._pace.acceleration = speed, self.limits.acceleration

    def fork(self) -> Self:
        """An independent copy that goes on from here, with a pace of its own."""
        other = copy.copy(self)
        other._pace = self._pace.fork()  # noqa: SLF001  one of its own kind
        return other

    @property
    def time(self) -> float:
        """How much of it has passed, at full speed [s]."""
        return self._since + self._ticks * self._pace.rate * self._period

    @property
    def finished(self) -> bool:
        """Whether the target was reached."""
        return self.time >= self.duration


def _stands_sooner(paused: DoubleS, free: DoubleS) -> bool:
    """Whether the one stands noticeably sooner than the other, and is at no tick further on its way."""
    for _ in range(LONGEST_LOOK):
        if paused.standing or free.standing:
            break
        paused.next()
        free.next()
        if paused.time > free.time + 1e-12:
            return False
    for _ in range(SOONER):
        free.next()
    return not free.standing
