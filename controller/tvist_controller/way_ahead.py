"""The rest of what moves: whether it stays clear, and how long it lasts."""

import numpy as np

from tvist_controller.ahead import resting_after
from tvist_controller.collision import CLEARANCE, CollisionModel, Meeting
from tvist_controller.control.differentiator import Floats
from tvist_controller.cycle import ControlCycle
from tvist_controller.look_ahead import LookAhead
from tvist_controller.outlook import Outlook
from tvist_controller.refusal import RefusalError
from tvist_controller.safety import StreamTorqueRoom
from tvist_controller.stops import StopPlan
from tvist_controller.trajectory import JointStop, Way
from tvist_plant.description import Payload
from tvist_plant.plant import PERIOD
from tvist_shaping.base import Filter


class WayAhead:
    """Looks at what the control line is going to do.

    Args:
        cycle: The control line.
        outlook: On it.
        collisions: Collision model of the arm.
    """

    def __init__(self, cycle: ControlCycle, outlook: Outlook, collisions: CollisionModel) -> None:
        self._cycle, self._collisions = cycle, collisions
        self._outlook = outlook
        room = StreamTorqueRoom(cycle.description, cycle.inverse_dynamics)
        self._guard = LookAhead(collisions, outlook.stops, room)

    @property
    def met(self) -> Meeting | None:
        """What the last reference that was not played would have led to."""
        return self._guard.met

    def begin(self) -> None:
        """Watch a stream that begins from rest."""
        self._guard.begin(self._cycle.newest)
        self._cycle.guard = self._guard

    def until_rest(self, plan: StopPlan | None = None) -> tuple[float | None, float | None]:
        """How long it takes until the shaped reference rests [s], and how far the joint that turns most turns [rad].

        Args:
            plan: A stop that has begun; None for whatever is under way.

        Returns:
            None and None where it is too far ahead to say.
        """
        if plan is not None:
            return plan.duration, plan.way
        ahead = self._outlook.foresee()
        if ahead is None:
            return None, None
        last = resting_after(ahead)
        return max(last - 1, 0) * PERIOD, float(np.abs(ahead[-1] - ahead[1]).max())

    def after_stream(self, end: JointStop) -> Meeting | None:
        """What would meet while a stream comes to rest through the filter.

        Args:
            end: Its reference.
        """
        if self._tail_is_spacious(end):
            return None
        return self._on(self._outlook.foresee(trajectory=end))

    def rest_of_way(self, tvist: Filter | None) -> Meeting | None:
        """What would meet on the rest of what moves; of a stream, in the quickest stop from here.

        Args:
            tvist: A filter to come; None for the present one.
        """
        cycle, collisions = self._cycle, self._collisions
        if cycle.at_rest:
            return None
        trajectory = cycle.trajectory
        if not trajectory.foreseeable:
            stop = self._outlook.stops.by_joints(cycle.newest, None, self._guard.clear)
            if stop is None:
                return self._guard.met
            self._guard.take(cycle.newest, stop)
            return None
        forecast = trajectory.forecast
        if forecast is None:
            return self._on(self._outlook.foresee(tvist))
        found = collisions.on_way(forecast.path.way(cycle.along.position, forecast.end))
        return None if found is None else found[1]

    def check_payload(self, payload: Payload, tvist: Filter | None) -> None:
        """Check the rest of what moves with another payload, and put it into the collision model.

        Args:
            payload: What the controller is to believe that the arm carries.
            tvist: Filter that comes with it; None for the present one.

        Raises:
            RefusalError: Something would meet; nothing has changed.
        """
        collisions, q = self._collisions, self._cycle.position
        before = collisions.carried
        escaping = self._cycle.at_rest or collisions.meeting(q) is not None
        collisions.carry(payload)
        met = None if escaping else collisions.meeting(q)
        met = met or self.rest_of_way(tvist)
        if met is not None:
            collisions.carry(before)
            why = f"{met} on the rest of the path with this payload"
            raise RefusalError("collision", "com", why, CLEARANCE)

    def check_filter(self, tvist: Filter) -> None:
        """Check the rest of what comes to rest through the filter off any line, with another filter.

        Raises:
            RefusalError: Something would meet.
        """
        cycle = self._cycle
        if cycle.guard is None or cycle.stopping or not cycle.trajectory.foreseeable:
            return
        met = self.rest_of_way(tvist)
        if met is not None:
            raise RefusalError("collision", "name", f"{met} on the rest of the way", CLEARANCE)

    def _tail_is_spacious(self, end: JointStop) -> bool:
        """Whether there is room for whatever a filter makes of the references that it may still read."""
        cycle = self._cycle
        if cycle.tvist.peak > 1.0:
            return False
        q = cycle.position
        window = np.abs(cycle.line_filter.window() - q).max(axis=0)
        _, qd, qdd = end.at(0.0)
        return self._guard.is_spacious(q, window + self._guard.turned(qd, qdd, end.acceleration, end.jerk))

    def _on(self, ahead: Floats | None) -> Meeting | None:
        """The first pair that meets on references that are known, one a tick, shape (k, n)."""
        if ahead is None:
            return None
        steps = np.abs(np.diff(ahead, axis=0)).max(axis=0)
        last = len(ahead) - 1
        found = self._collisions.on_way(Way(lambda share: ahead[round(share * last)], steps * last))
        return None if found is None else found[1]
