"""How to come to rest: what decision 13 calls a permitted stop, and the quickest of them."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Protocol, TypeVar

import numpy as np

from tvist_controller.control.differentiator import Floats, Target
from tvist_controller.control.inverse_dynamics import InverseDynamics
from tvist_controller.safety import GENTLEST_STOP, StopTorque, torque_along
from tvist_controller.trajectory import Forecast, JointStop, MotionLimits, PathStop
from tvist_plant.description import RobotDescription

S = TypeVar("S", JointStop, PathStop)

STEP = 0.8
"""From one deceleration that is tried to the next [-]."""
HARDER = 1.05
"""A stop that is harder than the motion's own braking by this is ahead of it nowhere, although a filter that varies
may brake a little harder than its reference [-]."""
SLOW = 3e-3
"""Below this a shaped motion may turn back by what interpolation undershoots [rad/s]."""
SOON = 0.02
"""A motion that brakes no sooner than this is behind a stop by then [s]."""
COUNTED = 0.9
"""Share of the present velocity that a motion is counted on to keep until it brakes [-]."""
ROUNDING = 1e-12
"""Difference of two positions that is none [rad]."""


class References(Protocol):
    """References of a motion that are still to come."""

    samples: list[Floats]
    """The path's parameter at the two shaped references played last and at those to come that are known, one a tick,
    each of shape (m,) [rad]."""
    rests: bool
    """Whether they are known until they rest."""

    def until(self, ticks: int) -> None:
        """See that so many references to come are known, or all until they rest."""

    @property
    def last(self) -> int:
        """Index of the last one that has moved, for those that rest; 0: none has."""


@dataclass(frozen=True)
class StopPlan:
    """A stop and what limits it."""

    trajectory: JointStop | PathStop | None
    """None: what is under way runs out by itself."""
    acceleration: float | None
    """Limit it keeps [rad/s^2]; None: the motion's own."""
    limited: bool
    """Whether that is not what was wanted."""
    duration: float | None
    """Until it rests [s]; None where that is too far ahead to say."""
    way: float | None
    """Until it rests, of the joint that turns most [rad]; likewise."""


class StopPlanner:
    """Finds the quickest permitted stop.

    Args:
        description: The robot.
        dynamics: Its inverse dynamics with the declared payload.
        period: Tick [s].
    """

    def __init__(self, description: RobotDescription, dynamics: InverseDynamics, period: float) -> None:
        limits = description.limits
        self._dynamics = dynamics
        self._torque, self._position = np.array(limits.torque), np.array(limits.position)
        self.highest, self.jerk = min(limits.acceleration), min(limits.jerk)
        """Limits that no stop exceeds [rad/s^2, rad/s^3]."""
        self.period = period
        """Tick [s]."""

    def on_path(
        self, state: Target, newest: Floats, forecast: Forecast, wanted: float | None, *, certain: bool = True
    ) -> PathStop | None:
        """The quickest stop along the path of a motion that is certain to be permitted.

        Never ahead of the motion, and never later at rest, is a stop that brakes harder than the motion ever will,
        with more jerk; and a gentler one that is over before the motion, braking as hard as it may, could be.

        Args:
            state: State of the path's parameter, a tick before the newest shaped reference.
            newest: The parameter there, shape (m,) [rad].
            forecast: What is known of the motion.
            wanted: Deceleration asked for [rad/s^2]; None for as much as possible.
            certain: False: take the quickest that keeps the torque, for a motion that will not rest for long.

        Returns:
            None where none is certain, or the motion is about to rest by itself.
        """
        speed, rise = forecast.path.forwards(state.qd), forecast.path.forwards(state.qdd)
        hardest = self._keeping(state, forecast, self.highest)
        if hardest is None:
            return None
        in_time = forecast.steady + COUNTED * max(speed, 0.0) / forecast.braking
        # What hardly moves may turn back a little, what brakes with as much jerk as a stop may be as quick, and what is
        # about to rest is quicker than anything within the limits.
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
        ahead: References,
        state: Target,
        forecast: Forecast,
        wanted: float | None,
        asked: Floats | None = None,
    ) -> PathStop | None:
        """The quickest stop along the path of a motion that is run ahead.

        Args:
            ahead: The motion; it is run ahead as far as a stop lasts. One that may turn back is known until it rests.
            state: State, see `on_path`.
            forecast: Forecast, see `on_path`.
            wanted: Requested stop, see `on_path`.
            asked: Largest torques that the motion itself would ask for from now on, shape (n,) [N m]; None: they are
                not known, and a stop may ask for its share alone.

        Returns:
            None where none is permitted but to let the motion run out.
        """
        newest = ahead.samples[1]
        along: list[float] = []  # how far it has come at each tick that is known

        def permitted(stop: PathStop) -> bool:
            ticks = math.ceil(stop.duration / self.period)
            ahead.until(ticks + 1)
            news = ahead.samples[2 + len(along) :]
            along.extend(forecast.path.forwards(x - newest) for x in news)
            if ahead.rests and ticks > ahead.last - 1:
                return False
            shares = (stop.share((number + 1) * self.period) for number in range(len(along)))
            return all(share <= limit + ROUNDING for share, limit in zip(shares, along, strict=True))

        return self._quickest_on_path(state, newest, forecast, wanted, permitted, asked)

    def asked(self, ahead: Floats) -> Floats:
        """Largest torques that a motion asks for from now on, shape (n,) [N m].

        Args:
            ahead: Its `References`, shape (k, n) [rad].
        """
        return torque_along(self._dynamics, ahead, self.period)

    def by_joints(
        self, state: Target, wanted: float | None, clear: Callable[[JointStop], bool]
    ) -> JointStop | None:
        """The quickest stop of every joint by itself that is clear all along and keeps the torque.

        Args:
            state: State of the newest shaped reference.
            wanted: Deceleration asked for [rad/s^2]; None for as much as possible.
            clear: Whether nothing meets on its way.

        Returns:
            None where there is none.
        """
        torque = StopTorque(self._dynamics, state, self._torque)
        stops = (self.stop(state, acceleration) for acceleration in self._ladder(wanted))
        within = (stop for stop in stops if (np.abs(stop.end) <= self._position).all())
        fits = cache(clear)
        return _first(within, lambda stop, rebound: torque.holds(stop, rebound=rebound) and fits(stop))

    def stop(self, state: Target, acceleration: float) -> JointStop:
        """A stop of every joint by itself within an acceleration [rad/s^2], whatever it asks for."""
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
        """Limits of a stop's parameter with which no joint passes an acceleration [rad/s^2], nor the jerk of any stop.

        The velocity is the highest that the stop may have, while it takes the present acceleration back.
        """
        speed, rise = abs(forecast.path.forwards(state.qd)), abs(forecast.path.forwards(state.qdd))
        fastest = speed + self.period * rise + rise * rise / self.jerk
        return forecast.path.keeping(MotionLimits(fastest, acceleration, self.jerk), fastest)

    def _ladder(self, wanted: float | None) -> Iterator[float]:
        """Decelerations in the order in which they are tried: down from the wanted one, then up from it."""
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
    """The first stop that holds counting the rebound, else the first that holds without; each is made once."""
    made = []
    for stop in stops:
        if holds(stop, True):
            return stop
        made.append(stop)
    return next((stop for stop in made if holds(stop, False)), None)
