"""Check of the remaining motion: its clearance and duration."""

from collections.abc import Sequence

import numpy as np

from tvist_controller.foresight.collision import CLEARANCE, CollisionModel, Meeting
from tvist_controller.foresight.line_copy import resting_after
from tvist_controller.foresight.stop_guard import StreamGuard
from tvist_controller.foresight.stopper import Stopper
from tvist_controller.foresight.stops import StopPlan
from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.limits import StreamTorqueMargin
from tvist_controller.refusal import RefusalError
from tvist_controller.trajectory import CheckedMotion, JointStop, PlannedMotion
from tvist_plant.description import Payload
from tvist_plant.plant import PERIOD
from tvist_shaping.base import Filter


class RemainingMotion:
    """Checks the future motion of the control line."""

    def __init__(self, cycle: ControlCycle, stopper: Stopper, collisions: CollisionModel) -> None:
        self._cycle, self._collisions = cycle, collisions
        self._stopper = stopper
        room = StreamTorqueMargin(cycle.description, cycle.dynamics)
        self._guard = StreamGuard(collisions, stopper.stops, room)
        reach = np.array(cycle.description.limits.position)
        self._guide_guard = StreamGuard(collisions, stopper.stops, room, reach=reach)

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
        """Return time [s] and largest joint angle [rad] until rest, by `plan` if given; None if too far ahead."""
        if plan is not None:
            return plan.duration, plan.way
        ahead = self._stopper.foresee()
        if ahead is None:
            return None, None
        last = resting_after(ahead)
        return max(last - 1, 0) * PERIOD, float(np.abs(ahead[-1] - ahead[1]).max())

    def after_stream(self, end: JointStop) -> Meeting | None:
        """Return the first meeting while the end of a stream runs through the filter, else None."""
        if self._tail_is_spacious(end):
            return None
        return self._on(self._stopper.foresee(trajectory=end))

    def rest_of_way(self, tvist: Filter | None, parts: Sequence[PlannedMotion]) -> Meeting | None:
        """Return the first meeting on the rest of a motion with a new filter; if unknown, in a stop."""
        cycle = self._cycle
        coming = [part.path.whole for part in parts]
        if cycle.mode.at_rest:
            return self._first(coming)
        trajectory = cycle.trajectory
        if (forecast := trajectory.forecast) is not None:
            return self._first([forecast.path.way(cycle.along.position, forecast.end), *coming])
        if trajectory.foreseeable and (ahead := self._stopper.foresee(tvist)) is not None:
            return self._on(ahead)
        guard = self._guide_guard if cycle.guard is self._guide_guard else self._guard
        stop = self._stopper.stops.by_joints(cycle.newest, None, guard.clear)
        if stop is None:
            return guard.met
        guard.take(cycle.newest, stop)
        return None

    def _first(self, ways: Sequence[CheckedMotion]) -> Meeting | None:
        return next((found[1] for way in ways if (found := self._collisions.on_way(way))), None)

    def check_payload(self, payload: Payload, tvist: Filter | None, parts: Sequence[PlannedMotion]) -> None:
        """Put another payload into the collision model, or raise RefusalError if the rest would collide."""
        collisions, q = self._collisions, self._cycle.position
        before = collisions.declared
        escaping = self._cycle.mode.at_rest or collisions.meeting(q) is not None
        collisions.declare(payload)
        met = None if escaping else collisions.meeting(q)
        met = met or self.rest_of_way(tvist, parts)
        if met is not None:
            collisions.declare(before)
            why = f"{met} on the rest of the path with this payload"
            raise RefusalError("collision", "com", why, CLEARANCE)

    def check_filter(self, tvist: Filter) -> None:
        """Raise RefusalError if the rest of a stream or guided motion would collide with another filter."""
        cycle = self._cycle
        if not (cycle.mode.guarded and cycle.trajectory.foreseeable):
            return
        met = self.rest_of_way(tvist, ())  # a stream or a guided motion has no parts
        if met is not None:
            raise RefusalError("collision", "name", f"{met} on the rest of the way", CLEARANCE)

    def _tail_is_spacious(self, end: JointStop) -> bool:
        """Return whether any filter output from the references still in use is clear."""
        cycle = self._cycle
        if cycle.tvist.peak > 1.0:
            return False
        q = cycle.position
        window = np.abs(cycle.filter.window() - q).max(axis=0)
        _, qd, qdd = end.at(0.0)
        return self._collisions.is_spacious(
            q, window + self._guard.turned(qd, qdd, end.acceleration, end.jerk)
        )

    def _on(self, ahead: Floats | None) -> Meeting | None:
        """Return the first meeting along known references, one per tick, shape (k, n), else None."""
        if ahead is None:
            return None
        steps = np.abs(np.diff(ahead, axis=0)).max(axis=0)
        last = len(ahead) - 1
        found = self._collisions.on_way(CheckedMotion(lambda share: ahead[round(share * last)], steps * last))
        return None if found is None else found[1]
