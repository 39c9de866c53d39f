"""UR's interpreter mode, port 30020: statements for a waiting program, each answered with one line."""

from dataclasses import dataclass, field
from functools import partial
from typing import Final, Literal

from msgspec.structs import replace

from tvist_protocol.programs import MAX_SCRIPT, Interpreter, ProgramInterpret, ProgramSkip
from tvist_protocol.replies import Accepted, Refused
from tvist_server.gateways.ur.base import InTurnSession, LineSplitter

STATES: Final = {
    "statelastexecuted": "executed",
    "statelastinterpreted": "interpreted",
    "statelastcleared": "cleared",
    "stateunexecuted": "waiting",
}
"""Field of `Interpreter` that answers each question."""
SKIPS: Final[dict[str, Literal["statements", "move"]]] = {"skipbuffer": "statements", "abort": "move"}
"""What each command skips; these commands are carried out at once."""
LONGEST: Final = MAX_SCRIPT
"""Longest line [bytes]."""
ECHO: Final = 4096  # characters of a line that its answer repeats
TOO_LONG: Final = "Statement is too long"  # reason of a `discard`; the others are UR's


@dataclass(eq=False)
class InterpreterSession(InTurnSession[tuple[str, bool]]):
    """One client of the interpreter mode; a blank line is ignored.

    A line of statements is answered by `ack: NUMBER: line` or `discard: REASON: line`, a question by
    `state: NUMBER: question`.
    """

    _lines: LineSplitter = field(default_factory=partial(LineSplitter, LONGEST + 1), init=False)

    def receive(self, data: bytes) -> None:
        for line in self._lines.feed(data):
            too_long = len(line) > LONGEST
            text = (line[:ECHO] if too_long else line).decode(errors="replace").strip()
            if text:
                self._add((text, too_long))

    async def _do(self, item: tuple[str, bool]) -> None:
        line, too_long = item
        programs = self._robot.programs
        if too_long:
            self._answer("discard", f"{TOO_LONG}: it has more than {LONGEST} bytes", line)
            return
        if line in STATES:
            self._answer("state", getattr(programs.interpreter, STATES[line]), line)
            return
        if what := SKIPS.get(line):
            reply = await self._control.change(lambda token: ProgramSkip(token=token, what=what))
            if what == "statements" and not isinstance(reply, Refused):
                programs.interpreter = replace(programs.interpreter, waiting=0)
        else:
            reply = await self._control.change(lambda token: ProgramInterpret(token=token, text=line))
            if isinstance(reply, Accepted) and reply.id is not None:
                known = programs.interpreter if reply.id > 1 else Interpreter()
                programs.interpreter = replace(known, interpreted=reply.id, waiting=known.waiting + 1)
        if isinstance(reply, Refused):
            self._answer("discard", _reason(reply), line)
        else:
            self._answer("ack", programs.interpreter.interpreted, line)

    def _answer(self, kind: str, what: object, line: str) -> None:
        if not self.over:
            text = f"{kind}: {what}: {line[:ECHO]}"
            self._send("".join([letter if letter.isprintable() else "?" for letter in text]).encode() + b"\n")


def _reason(refused: Refused) -> str:
    """Return the reason of a refusal as UR gives it, with the column if the line is invalid."""
    why, reason = refused.why, ""
    if refused.code == "script_error":
        reason = "Syntax error" if why.startswith("syntax_error") else "Compile error"
        why = f"column {refused.where.rpartition(':')[2]}, {why}"
    elif refused.code == "wrong_mode":
        reason = "Program is in an invalid state"
    elif (refused.code, refused.where) == ("busy", "text"):
        reason = "Too many interpreted messages"
    return f"{reason}: {why}" if reason else why
