"""Checks of coming motion: guard of streams and guided motions, collisions in the rest of a motion."""

from collections.abc import Sequence

import numpy as np

from tvist_controller.foresight.collision import CLEARANCE, CloseBodies, CollisionModel
from tvist_controller.foresight.stopper import Stopper
from tvist_controller.foresight.stops import StopPlan, StopPlanner, resting_after
from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.differentiator import Floats, Target
from tvist_controller.line.limits import GENTLEST_STOP, StreamTorqueMargin
from tvist_controller.line.line_mode import Guard, Obstacle
from tvist_controller.refusal import RefusalError
from tvist_controller.trajectory import CheckedMotion, JointStop, PlannedMotion, TimedMotion
from tvist_plant.description import Payload
from tvist_plant.plant import PERIOD
from tvist_shaping.base import Filter

FORESEEN = 2000  # ticks of a rest up to which it is checked shaped, too; shaping may cut bends of longer ones
MARGIN = 0.8
"""Fraction of the acceleration that torque permits at the start of a stop; the margin is for changes on the way [-]."""


class StreamGuard(Guard):
    """Decides whether a reference may be played: only if the arm can then stop without collision.

    If the whole stop from the new state is clear, the reference is played. Otherwise the arm stops from the
    previous state; that stop was checked a tick earlier, so a clear stop always exists. Bounds take
    microseconds. If they prove a stop clear, it is computed only when needed. `reach` is the joints' range,
    which streams keep by themselves.
    """

    def __init__(
        self,
        collisions: CollisionModel,
        stops: StopPlanner,
        torque: StreamTorqueMargin,
        *,
        reach: Floats | None = None,  # shape (n,) [rad]
    ) -> None:
        self._reach = reach
        self._collisions, self._stops, self._torque = collisions, stops, torque
        self._before: tuple[Target, float | JointStop] | None = None
        self.met: CloseBodies | None = None
        """Bodies that come close during the latest stop that is not clear; None if it leaves the joints' range."""
        self.obstacle = Obstacle("", "collision")  # reason for refusing the latest reference

    def begin(self, state: Target) -> None:
        """Start from rest."""
        self._before, self.met = (state, GENTLEST_STOP), None

    def __call__(self, state: Target) -> JointStop | None:
        """Return the stop to use if a reference that leads to this state must not be played, else None."""
        if (found := self._permitted(state)) is None:
            return self.fallback()
        self._before = state, found
        return None

    def take(self, state: Target, stop: JointStop) -> None:
        """Store a clear stop from the state of the newest reference, for `fallback`."""
        self._before = state, stop

    def fallback(self) -> JointStop:
        """Return the clear stop from the state of the last reference played."""
        assert self._before is not None, "begin comes first"
        state, stop = self._before
        return stop if isinstance(stop, JointStop) else self._stops.stop(state, stop)

    def give_up(self, why: str) -> JointStop:
        """Return the stop of `fallback`, because no reference follows for this reason."""
        self.obstacle = Obstacle(why, "singular")
        return self.fallback()

    def clear(self, stop: JointStop) -> bool:
        """Return whether a whole stop is clear."""
        q, qd, qdd = stop.at(0.0)
        turned = self.turned(qd, qdd, stop.acceleration)
        if not self._is_inside(q, turned) and (beyond := self._beyond(stop)) is not None:
            self.obstacle = Obstacle(beyond, "limit_position")
            return False
        if self._collisions.is_spacious(q, turned):
            return True
        before = None if self._before is None else self._before[0].q
        way = CheckedMotion(
            lambda share: stop.at(share * stop.duration)[0], _fastest(qd, qdd, stop.jerk) * stop.duration
        )
        if (found := self._collisions.on_way(way, before=before)) is None:
            return True
        self.met = found[1]
        self.obstacle = Obstacle(str(self.met), "collision")
        return False

    def _permitted(self, state: Target) -> float | JointStop | None:
        """Return a clear stop, or its acceleration to compute the stop later; None if no stop is clear."""
        stops = self._stops
        allowed = MARGIN * self._torque.acceleration(state.q, state.qd)
        acceleration = min(max(allowed, GENTLEST_STOP), stops.highest)
        inside = self._reach is None or self._is_inside(
            state.q, self.turned(state.qd, state.qdd, acceleration)
        )
        if inside and self._collisions.stop_is_spacious(state, acceleration, stops.jerk):
            return acceleration
        stop = stops.stop(state, acceleration)
        return stop if self.clear(stop) else stops.by_joints(state, None, self.clear)

    def _is_inside(self, q: Floats, turned: Floats) -> bool:
        """Return whether all joints certainly stay in range while turning by up to these angles around q."""
        return self._reach is None or bool((np.abs(q) + turned <= self._reach).all())

    def _beyond(self, stop: JointStop) -> str | None:
        """Return a message about a joint that leaves its range during a stop, else None."""
        assert self._reach is not None, "only a range can be left"
        beyond = stop.farthest - self._reach
        joint = int(np.argmax(beyond))
        if beyond[joint] <= 0.0:
            return None
        return f"joint {joint} would pass the end of its range, ±{self._reach[joint]:g} rad"

    def turned(self, qd: Floats, qdd: Floats, acceleration: float, jerk: float | None = None) -> Floats:
        """Return upper bounds of joint turns in a stop, (n,) [rad]; `jerk` is by default that of stops."""
        jerk = self._stops.jerk if jerk is None else jerk
        fastest = _fastest(qd, qdd, jerk)
        ramps = (acceleration + np.abs(qdd)) / jerk
        return np.asarray(fastest * (fastest / (2.0 * acceleration) + ramps + PERIOD))


def _fastest(qd: Floats, qdd: Floats, jerk: float) -> Floats:
    """Return upper bounds of joint velocity while the acceleration decays to zero [rad/s]."""
    return np.asarray(np.abs(qd) + qdd * qdd / (2.0 * jerk))


class RemainingMotion:
    """Checks the future motion of the control line."""

    def __init__(self, cycle: ControlCycle, stopper: Stopper, collisions: CollisionModel) -> None:
        self._cycle, self._collisions = cycle, collisions
        self._stopper = stopper
        torque = StreamTorqueMargin(cycle.description, cycle.dynamics)
        self._guard = StreamGuard(collisions, stopper.stops, torque)
        reach = np.array(cycle.description.limits.position)
        self._guide_guard = StreamGuard(collisions, stopper.stops, torque, reach=reach)

    def guard_of_stream(self) -> StreamGuard:
        """Return the guard of a stream that starts from rest."""
        self._guard.begin(self._cycle.newest)
        return self._guard

    def guard_of_guided(self) -> StreamGuard:
        """Return the guard of a guided motion from the present state; raise RefusalError without a clear stop."""
        cycle, guard, stops = self._cycle, self._guide_guard, self._stopper.stops
        state = cycle.newest
        guard.begin(state)
        if not cycle.mode.at_rest:
            stop = stops.by_joints(state, None, guard.clear)
            if stop is None and not guard.clear(stops.stop(state, stops.highest)):
                why, code = guard.obstacle
                raise RefusalError(code, "", f"the arm cannot leave its path here: {why}")
            guard.take(state, stops.stop(state, stops.highest) if stop is None else stop)
        return guard

    def until_rest(self, plan: StopPlan | None = None) -> tuple[float | None, float | None]:
        """Return time [s] and largest joint turn [rad] to rest, of `plan` if given; None if too far ahead."""
        if plan is not None:
            return plan.duration, plan.way
        if (ahead := self._stopper.simulate_until_rest()) is None:
            return None, None
        return max(resting_after(ahead) - 1, 0) * PERIOD, float(np.abs(ahead[-1] - ahead[1]).max())

    def after_stream(self, end: JointStop) -> CloseBodies | None:
        """Return bodies that come too close as a stream's final stop runs through the filter, else None."""
        if self._tail_is_spacious(end):
            return None
        return self._on(self._stopper.simulate_until_rest(trajectory=end))

    def rest_of_way(self, tvist: Filter | None, parts: Sequence[PlannedMotion]) -> CloseBodies | None:
        """Return bodies that get too close with a new filter in the rest of a motion (if unknown, a stop)."""
        cycle = self._cycle
        coming = [part.path.whole for part in parts]
        if cycle.mode.at_rest:
            return self._first(coming)
        trajectory = cycle.trajectory
        if (forecast := trajectory.forecast) is not None:
            return self._first([forecast.path.way(cycle.along.position, forecast.end), *coming])
        if isinstance(trajectory, TimedMotion):
            going_on = trajectory.fork()
            going_on.release(1.0)  # a pause may end
            left = trajectory.law.after(max(trajectory.time - cycle.tvist.delay, 0.0))
            met = self._on(left)
            if met is None and len(left) < FORESEEN:
                met = self._on(self._stopper.simulate_until_rest(tvist, going_on))
            return met
        if trajectory.foreseeable and (ahead := self._stopper.simulate_until_rest(tvist)) is not None:
            return self._on(ahead)
        guard = self._guide_guard if cycle.guard is self._guide_guard else self._guard
        stop = self._stopper.stops.by_joints(cycle.newest, None, guard.clear)
        if stop is None:
            return guard.met
        guard.take(cycle.newest, stop)
        return None

    def _first(self, ways: Sequence[CheckedMotion]) -> CloseBodies | None:
        return next((found[1] for way in ways if (found := self._collisions.on_way(way))), None)

    def check_payload(self, payload: Payload, tvist: Filter | None, parts: Sequence[PlannedMotion]) -> None:
        """Put another payload into the collision model, or raise RefusalError if the rest would collide."""
        collisions, q = self._collisions, self._cycle.position
        before = collisions.declared
        escaping = self._cycle.mode.at_rest or collisions.meeting(q) is not None
        collisions.declare(payload)
        try:
            met = None if escaping else collisions.meeting(q)
            met = met or self.rest_of_way(tvist, parts)
        finally:
            collisions.declare(before)
        if met is not None:
            why = f"{met} on the rest of the path with this payload"
            raise RefusalError("collision", "com", why, CLEARANCE)
        collisions.declare(payload)

    def check_filter(self, tvist: Filter) -> None:
        """Raise RefusalError if the rest of a motion whose joints are shaped would collide with another filter."""
        cycle, trajectory = self._cycle, self._cycle.trajectory
        curved = trajectory.path is not None and trajectory.forecast is None
        if not ((cycle.mode.guarded or curved) and trajectory.foreseeable):
            return
        met = self.rest_of_way(tvist, ())  # such motions have no parts
        if met is not None:
            raise RefusalError("collision", "name", f"{met} on the rest of the way", CLEARANCE)

    def _tail_is_spacious(self, end: JointStop) -> bool:
        """Return whether bounds prove that the end of a stream is clear behind the filter."""
        cycle = self._cycle
        if cycle.tvist.peak > 1.0:
            return False
        q = cycle.position
        window = np.abs(cycle.filter.window() - q).max(axis=0)
        _, qd, qdd = end.at(0.0)
        return self._collisions.is_spacious(
            q, window + self._guard.turned(qd, qdd, end.acceleration, end.jerk)
        )

    def _on(self, ahead: Floats | None) -> CloseBodies | None:
        """Return the first bodies too close along references, one per tick, shape (k, n), else None."""
        if ahead is None or len(ahead) < 2:
            return None
        found = self._collisions.on_way(CheckedMotion.through(ahead))
        return None if found is None else found[1]
