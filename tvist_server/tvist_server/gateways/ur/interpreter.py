"""UR's interpreter mode, port 30020: statements for the program that waits for them, each answered with one line."""

from typing import Final

from tvist_protocol.programs import Interpreter, ProgramInterpret, ProgramSkip
from tvist_protocol.replies import Accepted, Refused, Reply
from tvist_server.gateways.ur.base import ControllerAccess, PortSession, Send
from tvist_server.gateways.ur.in_turn import Done, InTurn
from tvist_server.gateways.ur.primary.scripts import Intake, Unit
from tvist_server.gateways.ur.robot import UrRobot

STATES: Final = {
    "statelastexecuted": "executed",
    "statelastinterpreted": "interpreted",
    "statelastcleared": "cleared",
    "stateunexecuted": "waiting",
}
"""Questions, and the field of `Interpreter` that answers each."""
SKIPS: Final = {"skipbuffer": "statements", "abort": "move"}
"""Commands that are carried out at once, and what each skips."""
ECHO: Final = 200
"""Characters of a statement that its answer repeats."""


class InterpreterSession(PortSession):
    """One client of the interpreter mode.

    Statements are answered by `ack: NUMBER: statement`, or `discard: REASON: statement`; questions by `state: NUMBER:
    question`.

    Args:
        robot: The robot.
        control: Access to its controller.
        send: Sends data to the client.
    """

    def __init__(self, robot: UrRobot, control: ControllerAccess, send: Send) -> None:
        self._robot, self._control, self._send = robot, control, send
        self._intake = Intake()
        self._units = InTurn(self._begin)

    @property
    def waiting(self) -> int:
        """Number of statements that are not yet answered."""
        return self._units.waiting

    def receive(self, data: bytes) -> None:
        """Take statements."""
        for unit in self._intake.feed(data):
            self._units.add(unit)

    def closed(self) -> None:
        """Drop what was not yet passed on."""
        self.over = True
        self._units.drop()

    def _begin(self, unit: Unit, done: Done) -> None:
        words = unit.words if len(unit.text) < ECHO else ""

        def heard(reply: Reply) -> None:
            if isinstance(reply, Refused):
                self._answer("discard", _reason(reply), unit)
            else:
                number = reply.id if isinstance(reply, Accepted) else self._state.interpreted
                self._answer("ack", number, unit)
            done()

        if words in STATES:
            self._answer("state", getattr(self._state, STATES[words]), unit)
            done()
        elif unit.too_long:
            self._answer("discard", "the statement is too long", unit)
            done()
        elif words in SKIPS:
            what = SKIPS[words]
            self._control.change(lambda token: ProgramSkip(token=token, what=what), heard)  # type: ignore[arg-type]
        else:
            self._control.change(lambda token: ProgramInterpret(token=token, text=unit.text), heard)

    @property
    def _state(self) -> Interpreter:
        """State of the statements, as published with the last tick."""
        latest = self._robot.latest
        return (None if latest is None else latest.io.interpreter) or Interpreter()

    def _answer(self, kind: str, what: object, unit: Unit) -> None:
        if not self.over:
            echo = " ".join(unit.text.split())
            text = f"{kind}: {what}: {echo[:ECHO]}"
            self._send("".join([letter if letter.isprintable() else "?" for letter in text]).encode() + b"\n")


def _reason(refused: Refused) -> str:
    """Why a statement was refused, with its place if its text is not valid."""
    place = refused.where.removeprefix("text:") if refused.code == "script_error" else ""
    line, _, column = place.partition(":")
    return f"line {line}, column {column}, {refused.why}" if place else refused.why
