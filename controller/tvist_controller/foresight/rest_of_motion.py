"""Check of the remaining motion: whether it stays clear, and how long it lasts."""

from collections.abc import Sequence

import numpy as np

from tvist_controller.foresight.collision import CLEARANCE, CollisionModel, Meeting
from tvist_controller.foresight.line_copy import resting_after
from tvist_controller.foresight.stop_guard import StreamGuard
from tvist_controller.foresight.stopper import Stopper
from tvist_controller.foresight.stops import StopPlan
from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.limits import TorqueRoom
from tvist_controller.refusal import RefusalError
from tvist_controller.trajectory import JointStop, PlannedMotion, Way
from tvist_plant.description import Payload
from tvist_plant.plant import PERIOD
from tvist_shaping.base import Filter


class RemainingMotion:
    """Examines the future motion of the control line."""

    def __init__(self, cycle: ControlCycle, outlook: Stopper, collisions: CollisionModel) -> None:
        self._cycle, self._collisions = cycle, collisions
        self._outlook = outlook
        room = TorqueRoom(cycle.description, cycle.dynamics)
        self._guard = StreamGuard(collisions, outlook.stops, room)
        reach = np.array(cycle.description.limits.position)
        self._guide_guard = StreamGuard(collisions, outlook.stops, room, reach=reach)

    def guard_of_stream(self) -> StreamGuard:
        """Return the guard of a stream that begins from rest."""
        self._guard.begin(self._cycle.newest)
        return self._guard

    def guard_of_guided(self) -> StreamGuard:
        """Return the guard of a guided motion from the present state of motion, whatever that is.

        Raises:
            RefusalError: There is no clear stop from here, as on a narrow path; nothing has changed.
        """
        cycle, guard, stops = self._cycle, self._guide_guard, self._outlook.stops
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
        """Time until the shaped reference rests [s], and the angle that the joint that turns most still turns [rad].

        They are those of the plan of a stop that has begun, or else of the present motion; None and None if
        rest is too far ahead to tell.
        """
        if plan is not None:
            return plan.duration, plan.way
        ahead = self._outlook.foresee()
        if ahead is None:
            return None, None
        last = resting_after(ahead)
        return max(last - 1, 0) * PERIOD, float(np.abs(ahead[-1] - ahead[1]).max())

    def after_stream(self, end: JointStop) -> Meeting | None:
        """Return the meeting that would occur while the end of a stream runs through the filter, if any."""
        if self._tail_is_spacious(end):
            return None
        return self._on(self._outlook.foresee(trajectory=end))

    def rest_of_way(self, tvist: Filter | None, parts: Sequence[PlannedMotion]) -> Meeting | None:
        """Return the meeting that would occur on the rest of the motion, if any; if that is unknown, in a stop.

        The rest has a new filter, if there is one, and the parts of the motion that have not begun.
        """
        cycle = self._cycle
        coming = [part.path.whole for part in parts]
        if cycle.mode.at_rest:
            return self._first(coming)
        trajectory = cycle.trajectory
        if (forecast := trajectory.forecast) is not None:
            return self._first([forecast.path.way(cycle.along.position, forecast.end), *coming])
        if trajectory.foreseeable and (ahead := self._outlook.foresee(tvist)) is not None:
            return self._on(ahead)
        guard = self._guide_guard if cycle.guard is self._guide_guard else self._guard
        stop = self._outlook.stops.by_joints(cycle.newest, None, guard.clear)
        if stop is None:
            return guard.met
        guard.take(cycle.newest, stop)
        return None

    def _first(self, ways: Sequence[Way]) -> Meeting | None:
        """Return the first meeting on several ways, one after the other."""
        return next((found[1] for way in ways if (found := self._collisions.on_way(way))), None)

    def check_payload(self, payload: Payload, tvist: Filter | None, parts: Sequence[PlannedMotion]) -> None:
        """Check the rest of the motion with another payload, and put that into the collision model; see `rest_of_way`.

        Raises:
            RefusalError: There would be a collision; nothing has changed.
        """
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
        """Check with another filter the rest of a motion that comes to rest through the filter and is not on a path.

        Raises:
            RefusalError: There would be a collision.
        """
        cycle = self._cycle
        if not (cycle.mode.guarded and cycle.trajectory.foreseeable):
            return
        met = self.rest_of_way(tvist, ())  # a stream or a guided motion has no parts
        if met is not None:
            raise RefusalError("collision", "name", f"{met} on the rest of the way", CLEARANCE)

    def _tail_is_spacious(self, end: JointStop) -> bool:
        """Return whether there is room for any output of a filter from the references that it may still use."""
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
        """Return the first pair of bodies that meets along known references, one for each tick, shape (k, n)."""
        if ahead is None:
            return None
        steps = np.abs(np.diff(ahead, axis=0)).max(axis=0)
        last = len(ahead) - 1
        found = self._collisions.on_way(Way(lambda share: ahead[round(share * last)], steps * last))
        return None if found is None else found[1]
