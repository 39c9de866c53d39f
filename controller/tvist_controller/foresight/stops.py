"""Simulation of future references, and planning of stops: which are permitted, and the quickest.

See docs/reference/stops.md.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import starmap
from typing import TypeVar

import numpy as np

from tvist_controller.kinematics.arm import InverseDynamics
from tvist_controller.line.differentiator import STILL, Floats, ShapedReference, Target, rests_at
from tvist_controller.line.limits import GENTLEST_STOP, StopTorque, torque_along
from tvist_controller.line.line_filter import LineFilter
from tvist_controller.trajectory import (
    AnyStop,
    BrakingForecast,
    JointStop,
    MotionLimits,
    Path,
    PathStop,
    SlowedStop,
    Trajectory,
)
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD

MAX_AHEAD = 4000  # largest number of ticks simulated to find the end of a motion


class LineSimulation:
    """A line simulated ahead without arm, by advancing its arguments; `line_filter` is None for a stop."""

    def __init__(
        self, trajectory: Trajectory, line_filter: LineFilter | None, shaped: ShapedReference
    ) -> None:
        self._trajectory, self._line_filter, self._shaped = trajectory, line_filter, shaped
        self.samples: list[Floats] = [shaped.along.published.q, shaped.along.position]
        """Samples of the shaped reference, one per entry of `references`: path parameters or joint positions."""
        self.references: list[Floats] = [shaped.joints.published.q, shaped.joints.position]
        """The last two shaped references played, then the future ones per tick, each of shape (n,) [rad]."""
        self.rests = False  # whether the last reference is at rest, so that no more follow

    def until(self, ticks: int) -> None:
        """Simulate until this many future references are known, or the references come to rest."""
        trajectory, line_filter = self._trajectory, self._line_filter
        while not self.rests and len(self.references) < ticks + 2:
            x = trajectory.next()
            x_star = x if line_filter is None else line_filter.filter(x)
            self._shaped.take(x_star, x_star)
            self.samples.append(x_star)
            self.references.append(self._shaped.joints.position)
            settled, shaped = line_filter is None or line_filter.settled, self._shaped
            standing = trajectory.standing and settled
            self.rests = standing and rests_at(shaped.posture(x), shaped.joints.published)

    @cached_property
    def last(self) -> int:
        """Index of the last reference that moved, if the references come to rest; 0 if none moved."""
        return resting_after(np.array(self.references))


def resting_after(references: Floats) -> int:
    """Return the index of the last of references (k, n), one per tick, that moved; 0 if none."""
    moves = np.flatnonzero(np.abs(np.diff(references, axis=0)).max(axis=1) > STILL)
    return int(moves[-1]) + 1 if len(moves) else 0


S = TypeVar("S", JointStop, PathStop, SlowedStop)

DECELERATION_RATIO = 0.8  # ratio of consecutive trial decelerations [-]
HARDER = 1.05
"""Factor by which a stop must brake harder than the motion to be never ahead of it, since a varying filter
may brake slightly harder than its reference [-]."""
TURN_BACK_SPEED = 3e-3  # speed below which interpolation may turn a shaped motion back slightly [rad/s]
SLOW = 0.05  # least speed in calculations of stops on a curve, so that no slow motion stops abruptly [rad/s]
LONG_STOP = 0.2  # duration above which a quicker stop is sought with more calculation [s]
LONGEST = 0.6  # largest time to slow down that is tried on a curve, unless a deceleration is requested [s]
SOFT = (20.0, 10.0)  # jerks of the last stops tried, which torque at its limit still permits [rad/s^3]
SOON = 0.02  # a motion that brakes later than this is by then ahead of a stop [s]
COUNTED = 0.9  # fraction of its velocity that a motion is assumed to keep until it brakes [-]
ROUNDING = 1e-12  # position differences below this are rounding errors [rad]


@dataclass(frozen=True)
class StopPlan:
    """A stop and its limits."""

    trajectory: AnyStop | None  # trajectory of the stop; None if the present motion runs to its end
    acceleration: float | None  # acceleration limit of the stop, None for the motion's own [rad/s^2]
    limited: bool  # whether the limit differs from the requested one
    duration: float | None  # time until rest, None if too far ahead [s]
    way: float | None  # largest joint angle until rest, None if too far ahead [rad]


class StopPlanner:
    """Finds the quickest permitted stop."""

    def __init__(self, description: RobotDescription, dynamics: InverseDynamics) -> None:
        limits = description.limits
        self._dynamics = dynamics
        self._torque, self._position = np.array(limits.torque), np.array(limits.position)
        self.highest, self.jerk = min(limits.acceleration), min(limits.jerk)
        """Largest acceleration and jerk of any stop [rad/s^2, rad/s^3]."""

    def on_path(
        self,
        state: Target,  # of the path's parameter, a tick before `newest`
        newest: Floats,  # parameter of the newest shaped reference, shape (m,) [rad]
        forecast: BrakingForecast,
        wanted: float | None,  # requested deceleration [rad/s^2]; None for the largest possible
        *,
        certain: bool = True,
    ) -> PathStop | None:
        """Return the quickest stop along a motion's path that is certain to be permitted, else None.

        A permitted stop is never ahead of the motion and rests no later. This is certain if the stop brakes
        harder, and with more jerk, than the motion ever will, or if the stop ends before the motion could
        end. If the motion is about to rest, no stop qualifies. If `certain` is False, the motion lasts so
        long that any stop within the torque limits is permitted.
        """
        speed, rise = forecast.path.forwards(state.qd), forecast.path.forwards(state.qdd)
        if (hardest := self._keeping(state, forecast, self.highest)) is None:
            return None
        in_time = forecast.steady + COUNTED * max(speed, 0.0) / forecast.braking
        # A very slow motion may turn back a little; braking with a stop's jerk may end as soon as the stop; and a
        # motion about to rest ends sooner than any stop within the limits.
        creeps = speed < TURN_BACK_SPEED
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
        forecast: BrakingForecast,
        wanted: float | None,
        asked: Floats | None = None,  # largest torques of the uninterrupted motion, shape (n,) [N m]
    ) -> PathStop | None:
        """Return the quickest stop along the path of a motion simulated ahead; None if no stop is quicker."""
        newest = ahead.samples[1]
        along: list[float] = []  # distance of the motion at each known tick

        def permitted(stop: PathStop) -> bool:
            ticks = math.ceil(stop.duration / PERIOD)
            ahead.until(ticks + 1)
            news = ahead.samples[2 + len(along) :]
            along.extend(forecast.path.forwards(x - newest) for x in news)
            return not (ahead.rests and ticks > ahead.last - 1) and self._behind(stop, along)

        return self._quickest_on_path(state, newest, forecast, wanted, permitted, asked)

    def slowed(
        self,
        ahead: LineSimulation,
        state: Target,
        forecast: BrakingForecast,
        wanted: float | None,
        asked: Floats | None,
    ) -> SlowedStop | None:
        """Return the quickest `SlowedStop` that keeps the limits of torque and acceleration, else None."""
        samples, path = np.array(ahead.samples), forecast.path
        joints = Target(*path.states(state.q, state.qd, state.qdd))
        fastest = float(np.abs(joints.qd).max())
        if fastest < TURN_BACK_SPEED or len(samples) < 4:
            return None
        torque = StopTorque(
            self._dynamics, joints, self._torque, np.zeros_like(joints.q) if asked is None else asked
        )
        along = [path.forwards(x - samples[1]) for x in samples[2:]]

        def permitted(stop: SlowedStop) -> bool:
            return self._behind(stop, along) and stop.hardest <= self.highest

        stops = (
            SlowedStop(path, samples, acceleration=acceleration, jerk=0.5 * self.jerk, fastest=fastest)
            for acceleration in self._ladder(wanted)
        )
        return _first(filter(permitted, stops), lambda stop, rebound: torque.holds(stop, rebound=rebound))

    def on_curve(
        self, ahead: LineSimulation, state: Target, path: Path, wanted: float | None
    ) -> SlowedStop | None:
        """Return the quickest `SlowedStop` within the limits, else the one that exceeds them least.

        None for a motion about to rest. Arguments as in `under`; the motion is simulated as far as the stops need it.
        """
        fastest = max(float(np.abs(state.qd).max()), SLOW)
        asked, *others = self._ladder(wanted)
        ladder = [asked, *(acceleration for acceleration in others if fastest <= LONGEST * acceleration)]
        tries = [(acceleration, 0.5 * self.jerk) for acceleration in ladder]
        tries += [(min(asked, math.sqrt(fastest * jerk)), jerk) for jerk in SOFT]
        torque = StopTorque(self._dynamics, state, self._torque)
        peaks = cache(torque.peaks)

        @cache
        def stop(acceleration: float, jerk: float) -> SlowedStop:
            reached = min(acceleration, math.sqrt(fastest * jerk))
            ahead.until(math.ceil((fastest / reached + reached / jerk) / PERIOD) + 2)
            samples = np.array(ahead.samples)
            return SlowedStop(path, samples, acceleration=acceleration, jerk=jerk, fastest=fastest)

        def quickest(torque: StopTorque) -> SlowedStop | None:
            stops = (made for made in starmap(stop, tries) if made.hardest <= self.highest)
            within = (made for made in stops if torque.excess(peaks(made)) <= 1.0)
            return _first(within, lambda made, rebound: torque.holds(made, rebound=rebound))

        ahead.until(2)
        if len(ahead.samples) < 4:
            return None
        found = quickest(torque)
        if found is not None and found.duration <= LONG_STOP:
            return found
        needed = torque_along(self._dynamics, np.array(ahead.references))
        relaxed = StopTorque(self._dynamics, state, self._torque, needed)
        return quickest(relaxed) or min(starmap(stop, tries), key=lambda made: relaxed.excess(peaks(made)))

    def _behind(self, stop: PathStop | SlowedStop, along: Sequence[float]) -> bool:
        """Return whether a stop is never ahead of a motion; `along` is the motion's distance at each tick."""
        shares = (stop.share(number * PERIOD) for number in range(1, len(along) + 1))
        return all(share <= limit + ROUNDING for share, limit in zip(shares, along, strict=True))

    def by_joints(
        self, state: Target, wanted: float | None, clear: Callable[[JointStop], bool]
    ) -> JointStop | None:
        """Return a clear stop of independent joints within torque limits; try `wanted` [rad/s^2] first."""
        torque = StopTorque(self._dynamics, state, self._torque)
        stops = (self.stop(state, acceleration) for acceleration in self._ladder(wanted))
        within = (stop for stop in stops if (np.abs(stop.end) <= self._position).all())
        fits = cache(clear)
        return _first(within, lambda stop, rebound: torque.holds(stop, rebound=rebound) and fits(stop))

    def stop(self, state: Target, acceleration: float) -> JointStop:
        """Return a stop with independent joints at an acceleration [rad/s^2], without checking torque."""
        return JointStop(state.q, state.qd, state.qdd, acceleration=acceleration, jerk=self.jerk)

    def _quickest_on_path(
        self,
        state: Target,
        newest: Floats,
        forecast: BrakingForecast,
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
                acceleration=acceleration, braking=kept.acceleration, jerk=kept.jerk,
            )
            for acceleration in self._ladder(wanted)
            if (kept := self._keeping(state, forecast, acceleration)) is not None
        )  # fmt: skip
        return _first(filter(permitted, stops), lambda stop, rebound: torque.holds(stop, rebound=rebound))

    def _keeping(self, state: Target, forecast: BrakingForecast, acceleration: float) -> MotionLimits | None:
        """Return limits of a path's parameter with which a stop keeps joint acceleration and jerk limits."""
        speed, rise = abs(forecast.path.forwards(state.qd)), abs(forecast.path.forwards(state.qdd))
        fastest = speed + PERIOD * rise + rise * rise / self.jerk
        return forecast.path.keeping(MotionLimits(fastest, acceleration, self.jerk), fastest, state.q)

    def _ladder(self, wanted: float | None) -> Iterator[float]:
        """Yield trial decelerations: from the requested down to the gentlest, then harder ones, rising."""
        first = self.highest if wanted is None else min(max(wanted, GENTLEST_STOP), self.highest)
        down = first
        while down > GENTLEST_STOP:
            yield down
            down *= DECELERATION_RATIO
        yield GENTLEST_STOP
        up = first / DECELERATION_RATIO
        while up < self.highest:
            yield up
            up /= DECELERATION_RATIO
        if first < self.highest:
            yield self.highest


def _first(stops: Iterable[S], holds: Callable[[S, bool], bool]) -> S | None:
    """Return the first stop with `holds(stop, True)`, else the first with `holds(stop, False)`, else None."""
    made = []
    for stop in stops:
        if holds(stop, True):
            return stop
        made.append(stop)
    return next((stop for stop in made if holds(stop, False)), None)
