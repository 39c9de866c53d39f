"""What the robot learns from its motions: it takes lessons at rest, and a client may undo them."""

from collections.abc import Callable
from typing import Any, ClassVar

from tvist_controller.commands.events import Emit
from tvist_controller.commands.refusal import RefusalError
from tvist_controller.experience.motion_record import Beliefs
from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.motion.filter_control import Filters
from tvist_controller.planning.command_row import Call, Row
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.planning.plan import Plan, Planning
from tvist_controller.planning.snapshot import FILTER, FilterState
from tvist_controller.safety.declared_payload import DeclaredPayload
from tvist_protocol.commands import Forget
from tvist_protocol.lessons import PayloadLesson
from tvist_protocol.modes import RobotMode


class Lessons:
    """Lessons that a robot has taken.

    Args:
        motion: The arm's motion, and with it the control line.
        filters: The control line's filter.
        payload: The declared payload, and the one that is assumed.
        peripherals: Tells clients what is assumed.
        plan: Plans what a lesson changes.
        emit: Emits events.
    """

    def __init__(
        self,
        motion: MotionControl,
        filters: Filters,
        payload: DeclaredPayload,
        peripherals: Peripherals,
        plan: Callable[[PayloadLesson, FilterState], Plan],
        emit: Emit,
    ) -> None:
        self._motion, self._filters, self._payload = motion, filters, payload
        self._peripherals, self._plan, self._emit = peripherals, plan, emit

    @property
    def held(self) -> bool:
        """Whether the drives hold or move the arm, so that its motions teach something."""
        return self._motion.robot_mode is RobotMode.RUNNING

    def beliefs(self) -> Beliefs:
        """Return what the robot takes its arm for."""
        return Beliefs(self._payload.assumed, self._filters.present)

    def learn(self, lesson: PayloadLesson, plan: Plan | None = None) -> None:
        """Take a lesson at rest, which changes how the robot moves from now on.

        Args:
            lesson: The lesson.
            plan: Plan for it, if it was made beforehand; it is used if it still holds.
        """
        present = self._filters.present
        if plan is None or plan.state != {"filter": present}:
            plan = self._plan(lesson, present)
        found: Any = plan.found
        if isinstance(found, RefusalError):
            self._emit("warning", why=f"{lesson.why}; it is not assumed: {found.reply.why}")
            return
        self._payload.learn(lesson.payload, found, lesson.why, beyond=lesson.beyond)
        self._peripherals.changed = True

    def _forget(self, call: Call[Forget]) -> None:
        """Assume what was declared again."""
        if self._payload.assumed != self._payload.payload:
            self._payload.forget(call.planned())

    rows: ClassVar[tuple[Row, ...]] = (
        Row(
            Forget,
            _forget,
            changes_io=True,
            plan=Planning(
                FILTER,
                FilterPlanner,
                lambda planner, _, now: planner.with_payload(now.filter.given, now.filter),
            ),
        ),
    )
