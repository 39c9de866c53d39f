"""Guard of streams and guided motions: a reference is played only if a clear stop exists from it."""

import numpy as np

from tvist_controller.foresight.collision import CollisionModel, Meeting
from tvist_controller.foresight.stops import StopPlanner
from tvist_controller.line.differentiator import Floats, Target
from tvist_controller.line.guard import Guard, Obstacle
from tvist_controller.line.limits import GENTLEST_STOP, StreamTorqueMargin
from tvist_controller.trajectory import CheckedMotion, JointStop

MARGIN = 0.8
"""Fraction of the acceleration that torque permits at the start of a stop; the margin is for changes on the way [-]."""


class StreamGuard(Guard):
    """Checks the stop from the state that a reference would lead to.

    A reference may be played if that whole stop is clear. Otherwise the stop from the previous state is used, which was
    checked a tick earlier, so a clear stop always exists. If bounds, which take microseconds, prove a stop clear, it is
    computed only when needed. `reach` keeps stops within the joints' range; references of streams keep it themselves.
    """

    def __init__(
        self,
        collisions: CollisionModel,
        stops: StopPlanner,
        room: StreamTorqueMargin,
        *,
        reach: Floats | None = None,  # shape (n,) [rad]
    ) -> None:
        self._reach = reach
        self._collisions, self._stops, self._torque = collisions, stops, room
        self._before: tuple[Target, float | JointStop] | None = None
        self.met: Meeting | None = None
        """Meeting during the latest stop that is not clear; None if it leaves the joints' range."""
        self.obstacle = Obstacle("", "collision")  # reason for refusing the latest reference

    def begin(self, state: Target) -> None:
        """Start from rest."""
        self._before, self.met = (state, GENTLEST_STOP), None

    def __call__(self, state: Target) -> JointStop | None:
        """Return the stop to use if a reference that leads to this state must not be played, else None."""
        found = self._permitted(state)
        if found is None:
            return self.fallback()
        self._before = state, found
        return None

    def take(self, state: Target, stop: JointStop) -> None:
        """Set the clear stop from the state of the newest reference."""
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
        found = self._collisions.on_way(way, before=before)
        if found is None:
            return True
        self.met = found[1]
        self.obstacle = Obstacle(str(self.met), "collision")
        return False

    def _permitted(self, state: Target) -> float | JointStop | None:
        """Return a clear stop, or the acceleration of one to be computed later; None if none is clear."""
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
        """Return whether turning the joints by these angles around q certainly stays in range."""
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
        """Return upper bounds of the joints' turns in a stop, default jerk as in stops, shape (n,) [rad]."""
        jerk = self._stops.jerk if jerk is None else jerk
        fastest = _fastest(qd, qdd, jerk)
        ramps = (acceleration + np.abs(qdd)) / jerk
        turned: Floats = fastest * (fastest / (2.0 * acceleration) + ramps + self._stops.period)
        return turned


def _fastest(qd: Floats, qdd: Floats, jerk: float) -> Floats:
    """Return upper bounds of joint velocity while the acceleration decays to zero [rad/s]."""
    fastest: Floats = np.abs(qd) + qdd * qdd / (2.0 * jerk)
    return fastest
