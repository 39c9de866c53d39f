"""The payload: what a client declares, what the robot has learnt, and what is assumed therefore."""

from collections.abc import Callable
from typing import Any

from tvist_controller.commands.events import Emit
from tvist_controller.commands.refusal import RefusalError
from tvist_controller.experience.motion_record import Beliefs
from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.line.inverse_dynamics import SLEW
from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.motion.filter_control import Filters
from tvist_controller.planning.plan import Plan
from tvist_controller.planning.snapshot import FilterState
from tvist_controller.safety.payload_monitor import PayloadMonitor
from tvist_controller.setup import body
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import SetPayload
from tvist_protocol.lessons import PayloadLesson
from tvist_protocol.modes import RobotMode
from tvist_protocol.values import Payload
from tvist_shaping.base import Filter


def payload_of(command: SetPayload) -> Payload:
    """Return the payload that a command declares."""
    return Payload(mass=command.mass, com=command.com, inertia=command.inertia)


class PayloadControl:
    """The payload of a robot, and everything that depends on it.

    Args:
        payload: Initial payload.
        motion: The arm's motion, and with it the control line.
        filters: The control line's filter.
        peripherals: Tells clients what is assumed.
        plan: Plans what a lesson changes.
        emit: Emits events.
        follows: Whether the robot follows its payload.
    """

    def __init__(
        self,
        payload: Payload,
        motion: MotionControl,
        filters: Filters,
        peripherals: Peripherals,
        plan: Callable[[PayloadLesson, FilterState], Plan],
        emit: Emit,
        *,
        follows: bool,
    ) -> None:
        self.declared = payload
        """Declared payload."""
        self.assumed = payload
        """Payload that dynamics and modes are computed with: the declared one, or what the robot has learnt."""
        self._motion, self._filters, self._peripherals = motion, filters, peripherals
        self._plan, self._emit = plan, emit
        self.monitor = PayloadMonitor(motion.cycle.description, body(payload), follows=follows)
        """Compares it with what the drives feel."""

    @property
    def held(self) -> bool:
        """Whether the drives hold or move the arm, so that a payload can be learnt from its motions."""
        return self._motion.robot_mode is RobotMode.RUNNING

    def beliefs(self) -> Beliefs:
        """Return what the robot takes its arm for."""
        return Beliefs(self.assumed, self._filters.present)

    def learn(self, lesson: PayloadLesson, plan: Plan | None = None) -> None:
        """Take a lesson at rest; a plan that was made for it beforehand is used if it still holds."""
        present = self._filters.present
        if plan is None or plan.state != {"filter": present}:
            plan = self._plan(lesson, present)
        found: Any = plan.found
        if isinstance(found, RefusalError):
            self._emit("warning", why=f"{lesson.why}; it is not assumed: {found.reply.why}")
            return
        self._assume(lesson.payload, found, SLEW, told=lesson.beyond)
        self._emit("learnt", why=lesson.why)
        if lesson.beyond:
            self._emit("warning", code="payload_mismatch", why=lesson.why)
        self._peripherals.changed = True

    def declare(self, command: SetPayload, tvist: Filter | None) -> None:
        """Take another payload, with the filter that is planned for it."""
        payload = payload_of(command)
        self._clear_with(payload, tvist)
        self.declared = payload
        self._assume(payload, tvist, max(round(command.transition_time / PERIOD), SLEW))

    def forget(self, planned: Callable[[], Any]) -> None:
        """Assume what was declared again, with the filter that is planned for it."""
        if self.assumed == self.declared:
            return
        tvist = planned()
        self._clear_with(self.declared, tvist)
        self._assume(self.declared, tvist, SLEW)
        self._emit("learnt", why=f"the declared {self.declared.mass:g} kg are assumed again")

    def _clear_with(self, payload: Payload, tvist: Filter | None) -> None:
        """Put a payload into the collision model, unless the rest of the motion would not be clear with it."""
        self._motion.ahead.check_payload(body(payload), tvist, self._motion.motions.coming)

    def _assume(self, payload: Payload, tvist: Filter | None, ticks: int, *, told: bool = False) -> None:
        """Compute dynamics and modes with a payload.

        Args:
            payload: The payload.
            tvist: Filter for it; None if its modes are not known to differ.
            ticks: Number of ticks in which it is phased in.
            told: Whether a warning tells that the arm carries more, which is above its rating.
        """
        self.assumed, carried = payload, body(payload)
        self._motion.cycle.dynamics.declare(carried, ticks)
        found = payload is not self.declared
        self._filters.declare(payload, tvist, found=found)
        self.monitor.declare(carried, ticks, found=found, told=told)
