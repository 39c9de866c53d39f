"""The declared payload, which a client sets and the drives' torques may contradict."""

from typing import ClassVar

from tvist_controller.commands.events import Emit
from tvist_controller.commands.refusal import check_body
from tvist_controller.line.inverse_dynamics import SLEW
from tvist_controller.line.sample import Sample
from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.motion.filter_control import Filters
from tvist_controller.planning.command_row import Call, Row
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.planning.plan import Planning
from tvist_controller.planning.snapshot import FILTER
from tvist_controller.safety.payload_monitor import PayloadMonitor
from tvist_controller.setup import body
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import SetPayload
from tvist_protocol.modes import RobotMode
from tvist_protocol.values import Payload
from tvist_shaping.base import Filter


def _payload_of(command: SetPayload) -> Payload:
    return Payload(mass=command.mass, com=command.com, inertia=command.inertia)


def _check(command: SetPayload, description: RobotDescription) -> None:
    check_body(_payload_of(command), rated=description.limits.payload)


class DeclaredPayload:
    """The declared payload, and everything that depends on it.

    Args:
        payload: Initial payload.
        motion: The arm's motion, and with it the control line.
        filters: The control line's filter.
        emit: Emits events.
        follows: Whether the robot follows its payload.
    """

    def __init__(
        self, payload: Payload, motion: MotionControl, filters: Filters, emit: Emit, *, follows: bool
    ) -> None:
        self.payload = payload
        """Declared payload."""
        self.assumed = payload
        """Payload that dynamics and modes are computed with: the declared one, or what the robot has learnt."""
        self._motion, self._filters, self._emit = motion, filters, emit
        self._description = motion.cycle.description
        self._monitor = PayloadMonitor(self._description, body(payload), follows=follows)
        self._held = False
        """Whether the brakes have held the arm since the last measurement of the drives."""

    def watch(self, sample: Sample) -> None:
        """Warn if the arm does not carry the declared payload, which cannot be checked while the brakes hold it."""
        if self._motion.robot_mode is not RobotMode.RUNNING:
            self._held = True
            return
        if self._held:
            self.begin_anew()
        why = self._monitor.update(
            sample.signals, sample.command.torque, sample.measured.moment, at_rest=sample.mode.at_rest
        )
        if why is not None:
            self._emit("warning", code="payload_mismatch", why=why)

    def begin_anew(self) -> None:
        """Discard past measurements, since the arm was placed elsewhere or its power was off."""
        self._held = False
        self._monitor.reset()

    def _declare(self, call: Call[SetPayload]) -> None:
        payload = _payload_of(call.command)
        tvist = call.planned()
        carried = body(payload)
        self._motion.ahead.check_payload(carried, tvist)
        self.payload = payload
        self._assume(payload, tvist, max(round(call.command.transition_time / PERIOD), SLEW))

    def forget(self, tvist: Filter | None) -> None:
        """Assume the declared payload again; `tvist` is the filter for it."""
        self._motion.ahead.check_payload(body(self.payload), tvist)
        self.learn(self.payload, tvist, f"the declared {self.payload.mass:g} kg are assumed again")

    def learn(self, payload: Payload, tvist: Filter | None, why: str, *, beyond: bool = False) -> None:
        """Assume a payload, found or declared, in dynamics and modes only.

        Args:
            payload: The payload.
            tvist: Filter for it; None if its modes are not known to differ.
            why: What was learnt, in words.
            beyond: Whether the arm carries more, which is above its rating.
        """
        self._assume(payload, tvist, SLEW, beyond=beyond)
        self._emit("learnt", why=why)
        if beyond:
            self._emit("warning", code="payload_mismatch", why=why)

    def _assume(self, payload: Payload, tvist: Filter | None, ticks: int, *, beyond: bool = False) -> None:
        self.assumed, carried = payload, body(payload)
        self._motion.cycle.line.dynamics.declare(carried, ticks)
        found = payload is not self.payload
        self._filters.declare(payload, tvist, found=found)
        self._monitor.declare(carried, found=found, told=beyond)
        self._held = False

    rows: ClassVar[tuple[Row, ...]] = (
        Row(
            SetPayload,
            _declare,
            changes_io=True,
            check=_check,
            plan=Planning(
                FILTER,
                FilterPlanner,
                lambda planner, command, now: planner.with_payload(_payload_of(command), now.filter),
            ),
        ),
    )
