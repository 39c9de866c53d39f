"""Commands from clients of the primary, secondary or real-time interface."""

from collections.abc import Callable
from typing import Final

from tvist_protocol.replies import Refused
from tvist_server.gateways.ur import messages, power
from tvist_server.gateways.ur.base import ControllerAccess
from tvist_server.gateways.ur.messages import ErrorLevel
from tvist_server.gateways.ur.primary.scripts import LONGEST, Unit
from tvist_server.gateways.ur.robot import UrRobot

NOT_RUN: Final = "program_not_run: this controller does not run URScript programs yet"
TOO_LONG: Final = f"program_too_long: it has more than {LONGEST} bytes and was thrown away"
READ_ONLY: Final = (
    "this interface is read-only: somebody else controls the robot, or the port takes no commands"
)


class Orders:
    """Carries out units of script text: a few commands that are not URScript programs; it declines all others.

    The outcome of each unit is also reported on the server's console, since few clients show their answers.

    Args:
        robot: Robot that carries out the commands.
        control: Access to its controller.
        answer: Sends a robot message to the client, or to the clients that receive its messages.
    """

    def __init__(self, robot: UrRobot, control: ControllerAccess, answer: Callable[[bytes], None]) -> None:
        self._robot = robot
        self._control = control
        self._answer = answer

    def carry_out(self, unit: Unit) -> None:
        """Carry out a unit."""
        if unit.too_long:
            self._except(unit, TOO_LONG)
            self._report(unit, f"was refused: it has more than {LONGEST} bytes")
            return
        words = unit.words if len(unit.text) < 1000 else ""
        robot, control = self._robot, self._control

        def outcome(refused: Refused | None) -> None:
            self._refused(words, refused)
            self._report(unit, "was run" if refused is None else f"was refused: {refused.why}")

        match words:
            case "power on":
                power.power_on(robot, control, outcome)
            case "power off":
                power.power_off(control, outcome)
            case "set robotmode run":
                power.release_brakes(robot, control, outcome)
            case "set unlock protective stop":
                power.unlock(robot, control, outcome)
            case "stop program":
                robot.programs.stop(
                    control, lambda done: self._report(unit, "was run" if done else "was refused")
                )
            case "set sim" | "set real":
                self._report(unit, "changes nothing: the arm is simulated")
            case _:
                self._except(unit, NOT_RUN)
                self._report(unit, "was not run: URScript programs are not simulated")

    def leave(self, unit: Unit) -> None:
        """Report that the client disconnected before a unit was complete."""
        self._report(unit, "was not run: the connection ended before its last line feed")

    def decline(self, unit: Unit) -> None:
        """Report that this interface accepts no commands."""
        self._read_only()
        self._report(unit, "was refused: this port is read-only")

    def _read_only(self) -> None:
        stamp = messages.stamp(self._robot.latest)
        self._answer(messages.error_code(stamp, messages.READ_ONLY, 0, ErrorLevel.VIOLATION, READ_ONLY))

    def _except(self, unit: Unit, what: str) -> None:
        stamp = messages.stamp(self._robot.latest)
        self._robot.tell(messages.runtime_exception(stamp, unit.line, unit.column, what))

    def _refused(self, words: str, refused: Refused | None) -> None:
        if refused is None:
            return
        if refused.code in {"no_control", "stale_token"}:
            self._read_only()
        else:
            stamp = messages.stamp(self._robot.latest)
            self._answer(messages.text(stamp, f"{words} was refused: {refused.why}"))

    def _report(self, unit: Unit, what: str) -> None:
        self._robot.report(f'the script "{unit.title}" of {self._control.peer} {what}')
