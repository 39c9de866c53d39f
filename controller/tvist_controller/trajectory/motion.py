"""Planned motions: a time law along a path, with a time rate for speed slider, pause and resume."""

import copy
from collections.abc import Sequence
from typing import Self

import numpy as np
import ruckig

from tvist_controller.trajectory.base import BrakingForecast, Floats, MotionLimits, Path, TimeLaw, Trajectory
from tvist_controller.trajectory.points import PointLaw
from tvist_controller.trajectory.spline import SplineCurve
from tvist_plant.plant import PERIOD

QUICKEST = 20.0  # largest change of the rate; from standstill to full speed takes at least 1/20 s [1/s]


class TimeScaling:
    """Time rate r of a trajectory, 0 to 1, whose changes keep the motion's limits.

    Along a path q(s) with ṡ = r the acceleration is q̈ = q'' r² + q' ṙ. ṙ may have any value that keeps |q̈| within
    every joint's limit, so near the limits the rate does not change until the curve leaves room. The rate approaches
    its target time-optimally within that room, with limited jerk (ruckig).
    """

    def __init__(self, limits: MotionLimits, rate: float) -> None:
        self.limits = limits
        self.acceleration = limits.acceleration
        """Acceleration limit of every joint, the motion's or less [rad/s^2]."""
        self.rate, self._slope = rate, 0.0
        self._open()

    def _open(self) -> None:
        self._generator = ruckig.Ruckig(1, PERIOD)
        self._request, self._result = ruckig.InputParameter(1), ruckig.OutputParameter(1)
        self._request.control_interface = ruckig.ControlInterface.Velocity

    def fork(self) -> Self:
        """Return an independent copy."""
        other = copy.copy(self)
        other._open()  # noqa: SLF001  one of its own kind
        return other

    def steady(self, target: float) -> bool:
        """Return whether the rate has reached the target and stays there."""
        return self.rate == target and self._slope == 0.0

    def advance(self, target: float, curve: Sequence[Floats]) -> float:
        """Advance by one tick towards a target rate [-]; return the time that passes on the path [s].

        `curve` has q' [rad/s] and q'' [rad/s^2], each (2, n), at the present point and just ahead; the change
        of rate must keep the limits at both points, since the motion passes from one to the other in a tick.
        """
        rooms = [self._room(qd, qdd) for qd, qdd in curve]
        # ruckig requires limits on both sides of zero, so leave a little room in both directions.
        lowest = min(max(room[0] for room in rooms), -1e-3)
        highest = max(min(room[1] for room in rooms), 1e-3)
        request = self._request
        request.current_position, request.current_velocity = [0.0], [self.rate]
        request.current_acceleration = [min(max(self._slope, lowest), highest)]
        request.target_velocity, request.target_acceleration = [target], [0.0]
        request.max_acceleration, request.min_acceleration = [highest], [lowest]
        fastest = max(float(np.abs(qd).max()) for qd, _ in curve)
        request.max_jerk = [self.limits.jerk / max(fastest, 0.05)]
        self._generator.update(request, self._result)
        self.rate = min(max(self._result.new_velocity[0], 0.0), 1.0)
        self._slope = self._result.new_acceleration[0]
        if abs(self.rate - target) < 1e-9 and abs(self._slope) < 1e-6:
            self.rate, self._slope = target, 0.0
        return max(float(self._result.new_position[0]), 0.0)

    def _room(self, qd: Floats, qdd: Floats) -> tuple[float, float]:
        """Return the range of ṙ that keeps every joint within its acceleration [1/s]."""
        lowest, highest = -QUICKEST, QUICKEST
        for velocity, acceleration in zip(qd.tolist(), (qdd * self.rate**2).tolist(), strict=True):
            if abs(velocity) < 1e-9:
                continue
            ends = sorted((sign * self.acceleration - acceleration) / velocity for sign in (-1.0, 1.0))
            lowest, highest = max(lowest, ends[0]), min(highest, ends[1])
        return lowest, highest


LOOK_AHEAD = 2.0  # ticks that a rate change looks ahead on the path
LONGEST_LOOK = 1500  # ticks over which a motion is compared with its pause; longer ones are not about to end
SOONER = 25  # ticks that a pause must save to be worthwhile

SURELY = 0.12
"""If the motion brakes later than this plus the pause's extra time, the pause is certainly sooner [s]."""


class DoubleS(TimeLaw):
    """Time-optimal motion from rest to rest within limits, shape (m,) [rad], all entries in phase.

    The entry with the longest distance determines the duration (Biagiotti and Melchiorri 2008, ch. 3.4). With
    the paper's 1.5 rad/s, 2.0 rad/s² and 100 rad/s³, acceleration ramps last 20 ms. Raise ValueError if the
    motion would last for hours.
    """

    def __init__(self, start: Floats, end: Floats, limits: MotionLimits) -> None:
        m = len(start)
        request = ruckig.InputParameter(m)
        request.current_position, request.target_position = start.tolist(), end.tolist()
        request.max_velocity = [limits.velocity] * m
        request.max_acceleration = [limits.acceleration] * m
        request.max_jerk = [limits.jerk] * m
        request.synchronization = ruckig.Synchronization.Phase
        self._trajectory = ruckig.Trajectory(m)
        try:
            ruckig.Ruckig(m).calculate(request, self._trajectory)
        except (ruckig.RuckigError, ValueError) as error:  # ruckig fails above 7600 s
            raise ValueError(
                f"no motion goes from {start.tolist()} to {end.tolist()} in less than two hours within "
                f"velocity {limits.velocity:g}, acceleration {limits.acceleration:g}, jerk {limits.jerk:g}"
            ) from error
        self.limits = limits
        self.duration = float(self._trajectory.duration)  # duration from rest to rest [s]
        # Motion from rest to rest is symmetric in time.
        leading = self._trajectory.profiles[0][int(np.argmax(np.abs(end - start)))]
        self.brakes_at = self.duration - sum(leading.t[:3])  # time at which the motion starts braking [s]
        self.moments = np.cumsum(leading.t)  # times at which the jerk changes [s]

    def at(self, time: float) -> tuple[list[float], list[float], list[float]]:
        """Return the parameter [rad], its velocity and acceleration [rad, s] at a time [s], m each."""
        position, velocity, acceleration = self._trajectory.at_time(time)[:3]
        return position, velocity, acceleration


class PlannedMotion(Trajectory):
    """A planned motion from rest to rest.

    Samples are the path's parameter; on a straight line in joint space, these are joint positions. Rate
    changes may use `agility`, or at least the limits of the law, which may itself be slow.
    """

    path: Path
    limits: MotionLimits

    def __init__(
        self,
        path: Path,
        law: TimeLaw,  # from the path's start to its end
        speed: float = 1.0,  # initial rate of its time relative to the clock's [-]
        agility: MotionLimits | None = None,  # of a change of the rate; None for those of the law
    ) -> None:
        self.path, self.law = path, law
        self.agility = law.limits if agility is None else agility  # limits of a rate change
        self.limits, self.duration = law.limits, law.duration  # duration at full speed [s]
        self.speed = speed  # target time rate, 0 to 1 [-]
        self._pace = TimeScaling(self.agility, speed)
        # Time on the path, as whole ticks since the rate last changed, so that rounding errors do not add up.
        self._since, self._ticks = 0.0, 0

    def time_at(self, share: float) -> float:
        """Return the time [s], at full speed, when the motion has covered a fraction of the way, 0 to 1."""
        early, late = self.law.begins, self.duration
        for _ in range(40):
            middle = 0.5 * (early + late)
            early, late = (middle, late) if self._share_at(middle) < share else (early, middle)
        return late

    def _share_at(self, time: float) -> float:
        start, now, end = map(self.law.position, (self.law.begins, time, self.duration))
        leading = self.path.leading
        way = end[leading] - start[leading]
        return float(now[leading] - start[leading]) / way if way != 0.0 else 1.0

    def states(self, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Return joint positions, velocities and accelerations at k times at full speed [s], each (k, n)."""
        return self.path.states(
            *(np.array(values) for values in zip(*map(self.law.at, times.tolist()), strict=True))
        )

    def next(self) -> Floats:
        """Advance one tick and return the parameter; from the end time on, this is exactly the path's end."""
        if self._pace.steady(self.speed):
            self._ticks += 1
        else:
            time = self.time
            most, ends = self.agility.acceleration, (time, time + LOOK_AHEAD * PERIOD)
            states = (np.array(self.law.at(end)) for end in ends)
            curve = [self.path.paced(x, xd, xdd, most) for x, xd, xdd in states]
            self._since, self._ticks = time + self._pace.advance(self.speed, curve), 0
        time = self.time
        return self.path.end if time >= self.duration else self.law.position(time)

    def go_on(self, longer: "PlannedMotion") -> None:
        """Continue as a longer motion along a `SplineCurve` that is equal until some ticks from now."""
        assert isinstance(self.path, SplineCurve)
        assert isinstance(longer.path, SplineCurve)
        self.path.become(longer.path)
        self.law, self.agility = longer.law, longer.agility
        self.limits, self.duration = longer.limits, longer.duration
        self._pace.limits = self.agility

    @property
    def rate(self) -> float:
        """Present time rate [-]."""
        return self._pace.rate

    @property
    def standing(self) -> bool:
        """Whether the motion has reached its end, or is paused and stands still."""
        return self.finished or (self.rate == 0.0 and self.steady)

    @property
    def forecast(self) -> BrakingForecast | None:
        """Forecast of the motion; the time of braking is known only at constant rate."""
        limits = self.limits if self.steady else self.agility
        return BrakingForecast(self.path, self.path.end, limits.acceleration, limits.jerk, self._unbraked)

    @property
    def _unbraked(self) -> float:
        """Time before the motion starts braking; 0 if the rate changes [s]."""
        known = self.rate > 0.0 and self.steady
        return max(self.law.brakes_at - self.time, 0.0) / self.rate if known else 0.0

    @property
    def steady(self) -> bool:
        """Whether the rate has reached its target."""
        return self._pace.steady(self.speed)

    @property
    def velocity(self) -> float:
        """Present velocity of the leading entry of the parameter [rad/s]."""
        return float(np.abs(self.law.at(self.time)[1]).max()) * self._pace.rate

    def bearing(self, q: Floats) -> Floats:
        """Return a vector along the coming way from the parameter q, shape (m,)."""
        return self.path.end - q

    def hold(self, acceleration: float) -> bool:
        """Pause the motion if it then stands noticeably sooner; return whether it pauses.

        Near its end a motion already brakes and leaves little acceleration for a pause, which would take
        longer. Every entry of the parameter slows down with at most `acceleration`, which must not exceed
        that of `agility`.
        """
        paused = self.fork()
        paused.speed, paused._pace.acceleration = 0.0, acceleration  # noqa: SLF001  one of its own kind
        if not self._pays(paused, acceleration):
            return False
        self.speed, self._pace.acceleration = 0.0, acceleration
        return True

    def _pays(self, paused: Self, acceleration: float) -> bool:
        """Return whether the motion stands noticeably sooner if it is paused."""
        most = self.limits.acceleration  # of the motion's own braking
        longer = self.velocity * (1.0 / acceleration - 1.0 / most) + 2.0 * most / self.limits.jerk
        hardest = self.agility.acceleration <= most
        if self._unbraked == 0.0 and self.rate == 1.0 and self.steady and hardest:
            return False  # the motion already brakes as hard as it can
        return self._unbraked >= longer + SURELY or _stands_sooner(paused, self.fork())

    def release(self, speed: float) -> None:
        """Resume after a pause at a rate [-]."""
        self.speed, self._pace.acceleration = speed, self.agility.acceleration

    def fork(self) -> Self:
        """Return an independent copy."""
        other = copy.copy(self)
        other._pace = self._pace.fork()  # noqa: SLF001  one of its own kind
        return other

    def paced_at(self, rate: float) -> Self:
        """Return a copy of a motion that has not started, at another rate [-]."""
        other = self.fork()
        other.speed, other._pace = rate, TimeScaling(self.agility, rate)  # noqa: SLF001  one of its own kind
        return other

    @property
    def time(self) -> float:
        """Elapsed time at full speed [s]."""
        return self._since + self._ticks * self._pace.rate * PERIOD

    @property
    def finished(self) -> bool:
        """Whether the motion has reached its end."""
        return self.time >= self.duration


class TimedMotion(PlannedMotion):
    """A planned motion on a curve that only its law knows; filter and stops act on each joint, as on a line."""

    law: PointLaw
    forecast = None

    def bearing(self, q: Floats) -> Floats:  # noqa: ARG002  the law knows the way
        """Return the velocity of the law."""
        return np.array(self.law.at(self.time)[1])

    def _pays(self, paused: Self, acceleration: float) -> bool:
        """Return whether the motion ends later than a pause even from its largest velocity, or if simulated."""
        longest = self.limits.velocity / acceleration + SURELY
        return self.time + self.rate * longest < self.duration or _stands_sooner(paused, self.fork())


def quickest_motion(
    path: Path, limits: MotionLimits, speed: float = 1.0, agility: MotionLimits | None = None
) -> PlannedMotion:
    """Return the double-S motion along a path from rest to rest within limits of its parameter.

    For `speed` and `agility` see `PlannedMotion`. Raise ValueError if the motion would last for hours.
    """
    return PlannedMotion(path, DoubleS(path.start, path.end, limits), speed, agility)


def _stands_sooner(paused: PlannedMotion, free: PlannedMotion) -> bool:
    """Return whether the paused motion stands noticeably sooner than the free one and is never ahead."""
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


def at_least(limits: MotionLimits, acceleration: float, jerk: float) -> MotionLimits:
    """Return limits with at least this acceleration and jerk."""
    return MotionLimits(limits.velocity, max(limits.acceleration, acceleration), max(limits.jerk, jerk))
