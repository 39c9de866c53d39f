"""Planning of stops: which are permitted (docs/explanations/design-notes.md says why), and the quickest of them."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TypeVar

import numpy as np

from tvist_controller.foresight.line_copy import LineSimulation
from tvist_controller.line.differentiator import Floats, Target
from tvist_controller.line.inverse_dynamics import InverseDynamics
from tvist_controller.line.limits import GENTLEST_STOP, StopTorque, torque_along
from tvist_controller.trajectory import AnyStop, Forecast, JointStop, MotionLimits, PathStop, SlowedStop
from tvist_plant.description import RobotDescription

S = TypeVar("S", JointStop, PathStop, SlowedStop)

STEP = 0.8
"""Ratio of one tried deceleration to the previous one [-]."""
HARDER = 1.05
"""A stop that brakes harder than the motion by this factor is never ahead of it, although a filter that varies may
brake a little harder than its reference [-].
"""
SLOW = 3e-3
"""Speed below which a shaped motion may turn back slightly because of interpolation [rad/s]."""
SOON = 0.02
"""A motion that starts braking later than this is ahead of a stop by then [s]."""
COUNTED = 0.9
"""Share of its present velocity that a motion is assumed to keep until it brakes [-]."""
ROUNDING = 1e-12
"""Differences between positions below this are rounding errors [rad]."""


@dataclass(frozen=True)
class StopPlan:
    """A stop and its limits."""

    trajectory: AnyStop | None
    """Trajectory of the stop; None if the present motion runs out by itself."""
    acceleration: float | None
    """Acceleration limit of the stop [rad/s^2]; None for the motion's own."""
    limited: bool
    """Whether the limit differs from the requested one."""
    duration: float | None
    """Time until rest [s]; None if it is too far ahead to tell."""
    way: float | None
    """Angle until rest of the joint that turns most [rad]; None if it is too far ahead to tell."""


class StopPlanner:
    """Finds the quickest permitted stop."""

    def __init__(self, description: RobotDescription, dynamics: InverseDynamics, period: float) -> None:
        limits = description.limits
        self._dynamics = dynamics
        self._torque, self._position = np.array(limits.torque), np.array(limits.position)
        self.highest, self.jerk = min(limits.acceleration), min(limits.jerk)
        """Largest acceleration and jerk of any stop [rad/s^2, rad/s^3]."""
        self.period = period
        """Tick [s]."""

    def on_path(
        self,
        state: Target,  # of the path's parameter, a tick before `newest`
        newest: Floats,  # parameter of the newest shaped reference, shape (m,) [rad]
        forecast: Forecast,
        wanted: float | None,  # requested deceleration [rad/s^2]; None for the largest possible
        *,
        certain: bool = True,
    ) -> PathStop | None:
        """Return the quickest stop along a motion's path that is certain to be permitted, if there is one.

        Two kinds of stops are never ahead of the motion and never come to rest later: those that brake harder
        than the motion ever will, with more jerk; and gentler ones that end before the motion could, even if
        it braked as hard as possible. There is none for a motion that is about to come to rest by itself. For
        one that will not rest for long, a stop within the torque limits is enough, and need not be `certain`.
        """
        speed, rise = forecast.path.forwards(state.qd), forecast.path.forwards(state.qdd)
        hardest = self._keeping(state, forecast, self.highest)
        if hardest is None:
            return None
        in_time = forecast.steady + COUNTED * max(speed, 0.0) / forecast.braking
        # A motion that is very slow may turn back a little, one that brakes with as much jerk as a stop may be as
        # quick, and one that is about to rest is quicker than anything within the limits.
        creeps = speed < SLOW
        jerks = HARDER * forecast.jerk > hardest.jerk and forecast.steady < SOON
        rests = rise < 0.0 and speed <= 1.1 * rise * rise / (2.0 * hardest.jerk)
        if certain and (creeps or jerks or rests or forecast.turns):
            return None

        def permitted(stop: PathStop) -> bool:
            return not certain or stop.braking >= HARDER * forecast.braking or stop.duration <= in_time

        return self._quickest_on_path(state, newest, forecast, wanted, permitted)

    def under(
        self,
        ahead: LineSimulation,  # simulated for as long as a stop lasts; until rest if the motion may turn back
        state: Target,  # for this and the next two see `on_path`
        forecast: Forecast,
        wanted: float | None,
        asked: Floats | None = None,  # largest torques of the uninterrupted motion, shape (n,) [N m]
    ) -> PathStop | None:
        """Return the quickest stop along the path of a motion that is simulated ahead, if there is one.

        If the torques of the uninterrupted motion are not known, a stop may only use its share.
        Without a stop, the motion has to run out.
        """
        newest = ahead.samples[1]
        along: list[float] = []  # distance of the motion at each known tick

        def permitted(stop: PathStop) -> bool:
            ticks = math.ceil(stop.duration / self.period)
            ahead.until(ticks + 1)
            news = ahead.samples[2 + len(along) :]
            along.extend(forecast.path.forwards(x - newest) for x in news)
            return not (ahead.rests and ticks > ahead.last - 1) and self._behind(stop, along)

        return self._quickest_on_path(state, newest, forecast, wanted, permitted, asked)

    def slowed(
        self,
        ahead: LineSimulation,
        state: Target,
        forecast: Forecast,
        wanted: float | None,
        asked: Floats | None,
    ) -> SlowedStop | None:
        """Return the quickest stop that plays a motion more and more slowly, see `SlowedStop`; arguments as of `under`.

        It is None if none keeps the torques and the acceleration of stops.
        """
        samples, path = np.array(ahead.samples), forecast.path
        joints = Target(*path.states(state.q, state.qd, state.qdd))
        fastest = float(np.abs(joints.qd).max())
        if fastest < SLOW or len(samples) < 4:
            return None
        torque = StopTorque(
            self._dynamics, joints, self._torque, np.zeros_like(joints.q) if asked is None else asked
        )
        along = [path.forwards(x - samples[1]) for x in samples[2:]]

        def permitted(stop: SlowedStop) -> bool:
            return self._behind(stop, along) and stop.hardest <= self.highest

        stops = (
            SlowedStop(
                path,
                samples,
                acceleration=acceleration,
                jerk=0.5 * self.jerk,
                fastest=fastest,
                period=self.period,
            )
            for acceleration in self._ladder(wanted)
        )
        return _first(filter(permitted, stops), lambda stop, rebound: torque.holds(stop, rebound=rebound))

    def _behind(self, stop: PathStop | SlowedStop, along: Sequence[float]) -> bool:
        """Return whether a stop is never ahead of a motion, of which the distance at each tick is known."""
        shares = (stop.share(number * self.period) for number in range(1, len(along) + 1))
        return all(share <= limit + ROUNDING for share, limit in zip(shares, along, strict=True))

    def asked(self, ahead: Floats) -> Floats:
        """Largest torques that a motion needs for its future references, shape (k, n): shape (n,) [N m]."""
        return torque_along(self._dynamics, ahead, self.period)

    def by_joints(
        self, state: Target, wanted: float | None, clear: Callable[[JointStop], bool]
    ) -> JointStop | None:
        """Return the quickest stop with independent joints that is clear and within the torque limits.

        `wanted` is the requested deceleration [rad/s^2], None for the largest possible.
        """
        torque = StopTorque(self._dynamics, state, self._torque)
        stops = (self.stop(state, acceleration) for acceleration in self._ladder(wanted))
        within = (stop for stop in stops if (np.abs(stop.end) <= self._position).all())
        fits = cache(clear)
        return _first(within, lambda stop, rebound: torque.holds(stop, rebound=rebound) and fits(stop))

    def stop(self, state: Target, acceleration: float) -> JointStop:
        """Return a stop with independent joints within an acceleration [rad/s^2], whatever torque it needs."""
        return JointStop(
            state.q, state.qd, state.qdd, acceleration=acceleration, jerk=self.jerk, period=self.period
        )

    def _quickest_on_path(
        self,
        state: Target,
        newest: Floats,
        forecast: Forecast,
        wanted: float | None,
        permitted: Callable[[PathStop], bool],
        asked: Floats | None = None,
    ) -> PathStop | None:
        path = forecast.path
        joints = Target(*path.states(state.q, state.qd, state.qdd))
        none = np.zeros_like(joints.q) if asked is None else asked
        torque = StopTorque(self._dynamics, joints, self._torque, none)
        stops = (
            PathStop(
                path, newest, newest - state.q, state.qdd,
                acceleration=acceleration, braking=kept.acceleration, jerk=kept.jerk, period=self.period,
            )
            for acceleration in self._ladder(wanted)
            if (kept := self._keeping(state, forecast, acceleration)) is not None
        )  # fmt: skip
        return _first(filter(permitted, stops), lambda stop, rebound: torque.holds(stop, rebound=rebound))

    def _keeping(self, state: Target, forecast: Forecast, acceleration: float) -> MotionLimits | None:
        """Limits for a stop's parameter that keep all joints within an acceleration [rad/s^2] and the jerk of stops.

        The velocity is the highest that can occur in the stop while the present acceleration is reduced.
        """
        speed, rise = abs(forecast.path.forwards(state.qd)), abs(forecast.path.forwards(state.qdd))
        fastest = speed + self.period * rise + rise * rise / self.jerk
        return forecast.path.keeping(MotionLimits(fastest, acceleration, self.jerk), fastest, state.q)

    def _ladder(self, wanted: float | None) -> Iterator[float]:
        """Decelerations in the order in which they are tried: down from the requested one, then up from it."""
        first = self.highest if wanted is None else min(max(wanted, GENTLEST_STOP), self.highest)
        down = first
        while down > GENTLEST_STOP:
            yield down
            down *= STEP
        yield GENTLEST_STOP
        up = first / STEP
        while up < self.highest:
            yield up
            up /= STEP
        if first < self.highest:
            yield self.highest


def _first(stops: Iterable[S], holds: Callable[[S, bool], bool]) -> S | None:
    """The first stop that holds with the rebound, else the first that holds without it; each is created once."""
    made = []
    for stop in stops:
        if holds(stop, True):
            return stop
        made.append(stop)
    return next((stop for stop in made if holds(stop, False)), None)
