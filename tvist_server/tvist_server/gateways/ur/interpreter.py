"""UR's interpreter mode, port 30020: statements for the program that waits for them, each answered with one line."""

from typing import Final

from msgspec.structs import replace

from tvist_protocol.programs import MAX_SCRIPT, Interpreter, ProgramInterpret, ProgramSkip
from tvist_protocol.replies import Accepted, Refused, Reply
from tvist_server.gateways.ur.base import ControllerAccess, PortSession, Send
from tvist_server.gateways.ur.in_turn import Done, InTurn
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
LONGEST: Final = MAX_SCRIPT
"""Longest line [bytes]."""
ECHO: Final = 4096
"""Characters of a line that its answer repeats."""
NO_PROGRAM, TOO_MANY, SYNTAX, COMPILATION, TOO_LONG = (
    "Program is in an invalid state",
    "Too many interpreted messages",
    "Syntax error",
    "Compile error",
    "Statement is too long",
)
"""UR's words with which a `discard` begins, by which clients know the reason; the last is not UR's."""


class InterpreterSession(PortSession):
    """One client of the interpreter mode.

    A line is a statement, or several. It is answered by `ack: NUMBER: line`, or by `discard: REASON: line`; a question
    by `state: NUMBER: question`. Blank lines are ignored.

    Args:
        robot: The robot.
        control: Access to its controller.
        send: Sends data to the client.
    """

    def __init__(self, robot: UrRobot, control: ControllerAccess, send: Send) -> None:
        self._programs, self._control, self._send = robot.programs, control, send
        self._rest = bytearray()
        """Beginning of an incomplete line; the beginning of its beginning if it is too long."""
        self._too_long = False
        self._lines = InTurn[tuple[str, bool]](self._begin, self._idle)
        self._lasting: ControllerAccess | None = None
        """Access for what is left to do after the connection was closed."""

    @property
    def waiting(self) -> int:
        """Number of lines that are not yet answered."""
        return self._lines.waiting

    def receive(self, data: bytes) -> None:
        """Add the lines that are complete with these bytes to those that wait for their turn."""
        *whole, rest = data.split(b"\n")
        for piece in whole:
            self._keep(piece)
            line = self._rest.decode(errors="replace").strip()
            if line:
                self._lines.add((line, self._too_long))
            self._rest.clear()
            self._too_long = False
        self._keep(rest)

    def closed(self) -> None:
        """Answer nothing any more; complete lines are still passed on."""
        self.over = True
        if self.waiting:
            self._control = self._lasting = self._control.lasting()

    def _keep(self, piece: bytes) -> None:
        if len(self._rest) + len(piece) > LONGEST:
            self._too_long = True
        self._rest += piece
        if self._too_long:
            del self._rest[ECHO:]

    def _idle(self) -> None:
        """Give back control that lasted longer than the connection."""
        if self._lasting is not None:
            self._lasting.leave()
            self._lasting = None

    def _begin(self, item: tuple[str, bool], done: Done) -> None:
        line, too_long = item
        programs, control = self._programs, self._control
        if too_long:
            self._answer("discard", f"{TOO_LONG}: it has more than {LONGEST} bytes", line)
            done()
        elif line in STATES:
            self._answer("state", getattr(programs.interpreter, STATES[line]), line)
            done()
        elif line in SKIPS:

            def skipped(reply: Reply) -> None:
                if line == "skipbuffer" and not isinstance(reply, Refused):
                    programs.interpreter = replace(programs.interpreter, waiting=0)
                self._hear(reply, line)
                done()

            what = SKIPS[line]
            control.change(lambda token: ProgramSkip(token=token, what=what), skipped)  # type: ignore[arg-type]
        else:

            def heard(reply: Reply) -> None:
                if isinstance(reply, Accepted) and reply.id is not None:
                    known = programs.interpreter if reply.id > 1 else Interpreter()
                    programs.interpreter = replace(known, interpreted=reply.id, waiting=known.waiting + 1)
                self._hear(reply, line)
                done()

            control.change(lambda token: ProgramInterpret(token=token, text=line), heard)

    def _hear(self, reply: Reply, line: str) -> None:
        if isinstance(reply, Refused):
            self._answer("discard", _reason(reply), line)
        else:
            self._answer("ack", self._programs.interpreter.interpreted, line)

    def _answer(self, kind: str, what: object, line: str) -> None:
        if not self.over:
            text = f"{kind}: {what}: {line[:ECHO]}"
            self._send("".join([letter if letter.isprintable() else "?" for letter in text]).encode() + b"\n")


def _reason(refused: Refused) -> str:
    """Why a line was refused, with the column if it is not valid."""
    why = refused.why
    if refused.code == "script_error":
        column = refused.where.rpartition(":")[2]
        words = SYNTAX if why.startswith("syntax_error") else COMPILATION
        return f"{words}: column {column}, {why}"
    if refused.code == "wrong_mode":
        return f"{NO_PROGRAM}: {why}"
    if (refused.code, refused.where) == ("busy", "text"):
        return f"{TOO_MANY}: {why}"
    return why
