"""How to come to rest: what decision 13 calls a permitted stop, and the quickest of them."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Protocol, TypeVar

import numpy as np

from tvist_plant.description import RobotDescription
from tvist_server.control.differentiator import Floats, Target
from tvist_server.control.inverse_dynamics import InverseDynamics
from tvist_server.safety import GENTLEST_STOP, StopTorque, torque_along
from tvist_server.trajectory import Line, LineStop, Stop

S = TypeVar("S", Stop, LineStop)

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

    references: list[Floats]
    """The two shaped references played last and those to come that are known, one a tick, each of shape (n,) [rad]."""
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

    trajectory: Stop | LineStop | None
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

    def on_line(
        self, state: Target, newest: Floats, line: Line, wanted: float | None, *, certain: bool = True
    ) -> LineStop | None:
        """The quickest stop along the line of a motion that is certain to be permitted.

        Never ahead of the motion, and never later at rest, is a stop that brakes harder than the motion ever will,
        with more jerk; and a gentler one that is over before the motion, braking as hard as it may, could be.

        Args:
            state: A tick before the newest shaped reference.
            newest: That, shape (n,) [rad].
            line: What is known of the motion.
            wanted: Deceleration asked for [rad/s^2]; None for as much as possible.
            certain: False: take the quickest that keeps the torque, for a motion that will not rest for long.

        Returns:
            None where none is certain, or the motion is about to rest by itself.
        """
        leading = int(np.argmax(np.abs(line.direction)))
        sign = float(np.sign(line.direction[leading]))
        speed, rise = sign * float(state.qd[leading]), sign * float(state.qdd[leading])
        in_time = line.steady + COUNTED * max(speed, 0.0) / line.braking
        # What hardly moves may turn back a little, what brakes with as much jerk as a stop may be as quick, and what is
        # about to rest is quicker than anything within the limits.
        creeps = speed < SLOW
        jerks = HARDER * line.jerk > self.jerk and line.steady < SOON
        rests = rise < 0.0 and speed <= 1.1 * rise * rise / (2.0 * self.jerk)
        if certain and (creeps or jerks or rests or line.turns):
            return None

        def permitted(stop: LineStop) -> bool:
            return not certain or stop.acceleration >= HARDER * line.braking or stop.duration <= in_time

        return self._quickest_on_line(state, newest, line, wanted, np.zeros_like(state.q), permitted)

    def under(
        self,
        ahead: References,
        state: Target,
        line: Line,
        wanted: float | None,
        asked: Floats | None = None,
    ) -> LineStop | None:
        """The quickest stop along the line of a motion that is run ahead.

        Args:
            ahead: The motion; it is run ahead as far as a stop lasts. One that may turn back is known until it rests.
            state: As in `on_line`.
            line: As in `on_line`.
            wanted: As in `on_line`.
            asked: Largest torques that the motion itself would ask for from now on, shape (n,) [N m]; None: they are
                not known, and a stop may ask for its share alone.

        Returns:
            None where none is permitted but to let the motion run out.
        """
        leading = int(np.argmax(np.abs(line.direction)))
        sign, newest = float(np.sign(line.direction[leading])), ahead.references[1]
        along: list[float] = []  # how far it has come at each tick that is known

        def permitted(stop: LineStop) -> bool:
            ticks = math.ceil(stop.duration / self.period)
            ahead.until(ticks + 1)
            news = ahead.references[2 + len(along) :]
            along.extend(sign * float(q[leading] - newest[leading]) for q in news)
            if ahead.rests and ticks > ahead.last - 1:
                return False
            shares = (stop.share((number + 1) * self.period) for number in range(len(along)))
            return all(share <= limit + ROUNDING for share, limit in zip(shares, along, strict=True))

        none = np.zeros_like(newest) if asked is None else asked
        return self._quickest_on_line(state, newest, line, wanted, none, permitted)

    def asked(self, ahead: Floats) -> Floats:
        """Largest torques that a motion asks for from now on, shape (n,) [N m].

        Args:
            ahead: Its `References`, shape (k, n) [rad].
        """
        return torque_along(self._dynamics, ahead, self.period)

    def by_joints(self, state: Target, wanted: float | None, clear: Callable[[Stop], bool]) -> Stop | None:
        """The quickest stop of every joint by itself that is clear all along and keeps the torque.

        Args:
            state: Of the newest shaped reference.
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

    def stop(self, state: Target, acceleration: float) -> Stop:
        """A stop of every joint by itself within an acceleration [rad/s^2], whatever it asks for."""
        return Stop(
            state.q, state.qd, state.qdd, acceleration=acceleration, jerk=self.jerk, period=self.period
        )

    def _quickest_on_line(
        self,
        state: Target,
        newest: Floats,
        line: Line,
        wanted: float | None,
        asked: Floats,
        permitted: Callable[[LineStop], bool],
    ) -> LineStop | None:
        torque = StopTorque(self._dynamics, state, self._torque, asked)
        stops = (
            LineStop(
                newest, newest - state.q, state.qdd, line.direction,
                acceleration=acceleration, jerk=self.jerk, period=self.period,
            )
            for acceleration in self._ladder(wanted)
        )  # fmt: skip
        return _first(filter(permitted, stops), lambda stop, rebound: torque.holds(stop, rebound=rebound))

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
