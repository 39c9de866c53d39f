"""Check of streams of set-points and of guided motions: a reference is played only if a clear stop exists from it."""

import numpy as np

from tvist_controller.foresight.collision import CollisionModel, Meeting
from tvist_controller.foresight.stops import StopPlanner
from tvist_controller.line.differentiator import Floats, Target
from tvist_controller.line.guard import Guard, Obstacle
from tvist_controller.line.limits import GENTLEST_STOP, TorqueRoom
from tvist_controller.trajectory import JointStop, Way

MARGIN = 0.8
"""Share of the acceleration that the torque permits at the start of a stop, which the stop uses, since the permitted
acceleration changes on the way [-].
"""


class StreamGuard(Guard):
    """Checks the stop from the state of motion that a reference would lead to.

    As long as that stop is clear along its whole way, the reference may be played. Otherwise the stop from the
    previous state is made. It was checked a tick earlier, so there is always a clear stop.

    If bounds prove the stop to be clear, which takes microseconds, it is made only when it is needed. Stops
    keep the joints within their reach, unless the references keep clear of it by themselves, as those of
    streams do.
    """

    def __init__(
        self,
        collisions: CollisionModel,
        stops: StopPlanner,
        room: TorqueRoom,
        *,
        reach: Floats | None = None,  # shape (n,) [rad]
    ) -> None:
        self._reach = reach
        self._collisions, self._stops, self._torque = collisions, stops, room
        self._before: tuple[Target, float | JointStop] | None = None
        self.met: Meeting | None = None
        """Meeting on the way of the latest stop that is not clear; None if it leaves the joints' range."""
        self.obstacle = Obstacle("", "collision")
        """Why the latest reference was refused."""

    def begin(self, state: Target) -> None:
        """Start from rest."""
        self._before, self.met = (state, GENTLEST_STOP), None

    def __call__(self, state: Target) -> JointStop | None:
        """Decide whether a reference that leads to this state may be played; see `Guard`."""
        found = self._permitted(state)
        if found is None:
            return self.fallback()
        self._before = state, found
        return None

    def take(self, state: Target, stop: JointStop) -> None:
        """Set the stop from the state of the newest reference, which is known to be clear."""
        self._before = state, stop

    def fallback(self) -> JointStop:
        """Return the stop from the state of the last reference played, which is known to be clear."""
        assert self._before is not None, "begin comes first"
        state, stop = self._before
        return stop if isinstance(stop, JointStop) else self._stops.stop(state, stop)

    def give_up(self, why: str) -> JointStop:
        """Return the stop as in `fallback`, since no reference follows for this reason."""
        self.obstacle = Obstacle(why, "singular")
        return self.fallback()

    def clear(self, stop: JointStop) -> bool:
        """Return whether the whole way of a stop is clear."""
        q, qd, qdd = stop.at(0.0)
        turned = self.turned(qd, qdd, stop.acceleration)
        if not self._is_inside(q, turned) and (beyond := self._beyond(stop)) is not None:
            self.obstacle = Obstacle(beyond, "limit_position")
            return False
        if self._collisions.is_spacious(q, turned):
            return True
        before = None if self._before is None else self._before[0].q
        way = Way(
            lambda share: stop.at(share * stop.duration)[0], _fastest(qd, qdd, stop.jerk) * stop.duration
        )
        found = self._collisions.on_way(way, before=before)
        if found is None:
            return True
        self.met = found[1]
        self.obstacle = Obstacle(str(self.met), "collision")
        return False

    def _permitted(self, state: Target) -> float | JointStop | None:
        """Return a clear stop, or the acceleration of one that is made when it is needed; None if there is none."""
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
        """Return whether the joints can certainly turn by these angles around q inside their range."""
        return self._reach is None or bool((np.abs(q) + turned <= self._reach).all())

    def _beyond(self, stop: JointStop) -> str | None:
        """Return which joint leaves its range on the way of a stop, if one does, in words."""
        assert self._reach is not None, "only a range can be left"
        beyond = stop.farthest - self._reach
        joint = int(np.argmax(beyond))
        if beyond[joint] <= 0.0:
            return None
        return f"joint {joint} would pass the end of its range, ±{self._reach[joint]:g} rad"

    def turned(self, qd: Floats, qdd: Floats, acceleration: float, jerk: float | None = None) -> Floats:
        """Upper bound of each joint's turn in a stop, by default with the joints' jerk, shape (n,) [rad]."""
        jerk = self._stops.jerk if jerk is None else jerk
        fastest = _fastest(qd, qdd, jerk)
        ramps = (acceleration + np.abs(qdd)) / jerk
        turned: Floats = fastest * (fastest / (2.0 * acceleration) + ramps + self._stops.period)
        return turned


def _fastest(qd: Floats, qdd: Floats, jerk: float) -> Floats:
    """Upper bound of each joint's velocity by the time its acceleration has been reduced to zero [rad/s]."""
    fastest: Floats = np.abs(qd) + qdd * qdd / (2.0 * jerk)
    return fastest
