"""Commands and programs from clients of the primary, secondary or real-time interface."""

from collections.abc import Callable
from typing import Final

from tvist_protocol.replies import Refused
from tvist_server.gateways.ur import messages, power
from tvist_server.gateways.ur.base import ControllerAccess
from tvist_server.gateways.ur.in_turn import Done, InTurn
from tvist_server.gateways.ur.messages import ErrorLevel
from tvist_server.gateways.ur.primary.scripts import LONGEST, Unit
from tvist_server.gateways.ur.robot import UrRobot

TOO_LONG: Final = f"program_too_long: it has more than {LONGEST} bytes and was thrown away"
SHORT: Final = 1000
"""Length of none of the interface's own commands."""
READ_ONLY: Final = (
    "this interface is read-only: somebody else controls the robot, or the port takes no commands"
)


class Orders:
    """Carries out units of script text in their order: the next begins when the previous one was answered.

    A few commands are the interface's own; everything else is a program for the controller. The outcome of each unit
    is also reported on the server's console, since few clients show their answers.

    Args:
        robot: Robot that carries out the units.
        control: Access to its controller.
        answer: Sends a robot message to the client, or to the clients that receive its messages.
    """

    def __init__(self, robot: UrRobot, control: ControllerAccess, answer: Callable[[bytes], None]) -> None:
        self._robot = robot
        self._control = control
        self._answer = answer
        self._units = InTurn(self._begin, self._idle)
        self._lasting: ControllerAccess | None = None
        """Access for what is left to do after the connection was closed."""

    @property
    def waiting(self) -> int:
        """Number of units that are not yet answered."""
        return self._units.waiting

    def carry_out(self, unit: Unit) -> None:
        """Carry out a unit in its turn; one that stops the arm also at once."""
        if self.waiting and len(unit.text) < SHORT and unit.words == "stop program":
            self._robot.programs.stop(self._control, lambda _: None)
        self._units.add(unit)

    def leave(self, unfinished: Unit | None) -> None:
        """Take note that the connection was closed; its complete units are still carried out.

        Args:
            unfinished: Beginning of a unit that did not arrive completely, which is reported.
        """
        if unfinished is not None:
            self._report(unfinished, "was not run: the connection ended before its last line feed")
        if self.waiting:
            self._control = self._lasting = self._control.lasting()

    def decline(self, unit: Unit) -> None:
        """Report that this interface accepts no commands."""
        self._read_only()
        self._report_refusal(unit, "this port is read-only")

    def _idle(self) -> None:
        """Give back control that lasted longer than the connection."""
        if self._lasting is not None:
            self._lasting.leave()
            self._lasting = None

    def _begin(self, unit: Unit, done: Done) -> None:
        if unit.too_long:
            stamp = messages.stamp(self._robot.latest)
            self._robot.tell(messages.runtime_exception(stamp, unit.line, unit.column, TOO_LONG))
            self._report_refusal(unit, f"it has more than {LONGEST} bytes")
            done()
        elif len(unit.text) >= SHORT or not self._command(unit, done):
            self._run(unit, done)

    def _command(self, unit: Unit, done: Done) -> bool:
        """Carry out one of the interface's own commands; return whether the unit is one."""
        robot, control = self._robot, self._control

        def report(what: str) -> None:
            self._report(unit, what)
            done()

        outcome = self._outcome(unit, done)
        match unit.words:
            case "power on":
                power.power_on(robot, control, outcome)
            case "power off":
                power.power_off(control, outcome)
            case "set robotmode run":
                power.release_brakes(robot, control, outcome)
            case "set unlock protective stop":
                power.unlock(robot, control, outcome)
            case "stop program":
                robot.programs.stop(control, lambda well: report("was run" if well else "was refused"))
            case "set sim" | "set real":
                report("changes nothing: the arm is simulated")
            case _:
                return False
        return True

    def _outcome(self, unit: Unit, done: Done) -> Callable[[Refused | None], None]:
        """Takes what became of one of the interface's own commands."""

        def outcome(refused: Refused | None) -> None:
            if refused is None:
                self._report(unit, "was run")
            else:
                self._tell_refused(unit.words, refused)
                self._report_refusal(unit, refused.why)
            done()

        return outcome

    def _run(self, unit: Unit, done: Done) -> None:
        """Have the controller run a program."""

        def outcome(refused: Refused | None) -> None:
            if refused is None:
                self._report(unit, "was started")
            elif refused.code == "script_error":  # all clients have got the exception
                _, line, column = refused.where.split(":")
                self._report_refusal(unit, f"line {line}, column {column}: {refused.why}")
            else:
                self._tell_refused(unit.title, refused)
                self._report_refusal(unit, refused.why)
            done()

        self._robot.programs.run(unit.text, self._control, outcome, secondary=unit.secondary)

    def _tell_refused(self, what: str, refused: Refused) -> None:
        """Tell the client why something was refused."""
        if refused.code in {"no_control", "stale_token"}:
            self._read_only()
        else:
            stamp = messages.stamp(self._robot.latest)
            self._answer(messages.text(stamp, f"{what} was refused: {refused.why}"))

    def _read_only(self) -> None:
        stamp = messages.stamp(self._robot.latest)
        self._answer(messages.error_code(stamp, messages.READ_ONLY, 0, ErrorLevel.VIOLATION, READ_ONLY))

    def _report(self, unit: Unit, what: str) -> None:
        self._robot.report(f'the script "{unit.title}" of {self._control.peer} {what}')

    def _report_refusal(self, unit: Unit, why: str) -> None:
        self._robot.report_refusal(f'the script "{unit.title}" of {self._control.peer} was refused: {why}')
