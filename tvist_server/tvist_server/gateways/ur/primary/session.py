"""Sessions of the primary and secondary interface, and their common base with the real-time interface."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from tvist_controller.instruments.snapshot import Snapshot
from tvist_protocol.replies import Refused
from tvist_protocol.stream import Event
from tvist_server.gateways.ur import messages, power
from tvist_server.gateways.ur.base import InTurnSession
from tvist_server.gateways.ur.power import Change
from tvist_server.gateways.ur.primary.packages import robot_state
from tvist_server.gateways.ur.primary.scripts import LONGEST, ScriptReader, Unit

STATE_TICKS: Final = 50  # ticks between two robot states: 10 Hz
TOO_LONG: Final = f"program_too_long: it has more than {LONGEST} bytes and was thrown away"
SHORT: Final = 1000  # minimum length of text that is not one of the interface's own commands
READ_ONLY: Final = (
    "this interface is read-only: somebody else controls the robot, or the port takes no commands"
)
STOP: Final = "stop program"
CHANGES: Final[Mapping[str, Change]] = {
    "power on": power.power_on,
    "power off": power.power_off,
    "set robotmode run": power.release_brakes,
    "set unlock protective stop": power.unlock,
}
"""The interface's own commands that change the robot's mode."""


@dataclass(eq=False)
class ScriptSession(InTurnSession[Unit]):
    """Carries out the interface's commands and runs other scripts as programs; the console shows results."""

    read_only: bool = field(default=False, kw_only=True)  # whether commands are refused
    _reader: ScriptReader = field(default_factory=ScriptReader, init=False)

    def receive(self, data: bytes) -> None:
        for unit in self._reader.feed(data):
            self._add(unit, stop=not self.read_only and len(unit.text) < SHORT and unit.words == STOP)

    def closed(self) -> None:
        unfinished = self._reader.unfinished
        if unfinished is not None:
            self._report(unfinished, "was not run: the connection ended before its last line feed")
        super().closed()

    def _tell(self, message: bytes) -> None:
        self._robot.tell(message)

    async def _do(self, unit: Unit) -> None:
        words = unit.words if len(unit.text) < SHORT else ""
        if self.read_only:
            self._tell_read_only()
            self._report_refusal(unit, "this port is read-only")
        elif unit.too_long:
            exception = messages.runtime_exception(self._robot.latest, unit.line, unit.column, TOO_LONG)
            self._robot.tell(exception)
            self._report_refusal(unit, f"it has more than {LONGEST} bytes")
        elif words == STOP:
            stopped = await self._robot.programs.stop(self._control)
            self._report(unit, "was run" if stopped else "was refused")
        elif words in {"set sim", "set real"}:
            self._report(unit, "changes nothing: the arm is simulated")
        elif words in CHANGES:
            refused = await CHANGES[words](self._robot, self._control)
            if refused is None:
                self._report(unit, "was run")
            else:
                self._tell_refused(unit, words, refused)
        else:
            refused = await self._robot.programs.run(unit.text, self._control, secondary=unit.secondary)
            if refused is None:
                self._report(unit, "was started")
            elif refused.code == "script_error":  # all clients have already received the exception
                _, line, column = refused.where.split(":")
                self._report_refusal(unit, f"line {line}, column {column}: {refused.why}")
            else:
                self._tell_refused(unit, unit.title, refused)

    def _tell_refused(self, unit: Unit, what: str, refused: Refused) -> None:
        if refused.code in {"no_control", "stale_token"}:
            self._tell_read_only()
        else:
            self._tell(messages.text(self._robot.latest, f"{what} was refused: {refused.why}"))
        self._report_refusal(unit, refused.why)

    def _tell_read_only(self) -> None:
        number, level = messages.READ_ONLY, messages.VIOLATION
        self._tell(messages.error_code(self._robot.latest, number, level, READ_ONLY))

    def _report(self, unit: Unit, what: str) -> None:
        self._robot.report(f'the script "{unit.title}" of {self._control.peer} {what}')

    def _report_refusal(self, unit: Unit, why: str) -> None:
        self._robot.report_refusal(f'the script "{unit.title}" of {self._control.peer} was refused: {why}')


@dataclass(eq=False)
class PrimarySession(ScriptSession):
    """Sends state and messages to a client and takes commands; the secondary interface sends no messages."""

    informed: bool = field(default=True, kw_only=True)
    _errors: list[bytes] = field(default_factory=list, init=False)  # sent after the state of the tick
    _due: int = field(default=0, init=False)  # tick of the next robot state
    _safety_mode: int | None = field(default=None, init=False)  # last sent to the client

    def opened(self) -> None:
        """Send the version; the first robot state follows with the next tick."""
        self._send(messages.version())

    def _tell(self, message: bytes) -> None:
        if self.informed:
            self._send(message)

    def sample(self, snapshot: Snapshot) -> bytes:
        """Return the robot state ten times a second, and at once when the safety mode changes, before error codes."""
        mode = snapshot.safety_mode
        if mode != self._safety_mode:
            if self._safety_mode is not None:
                self._tell(messages.safety_mode(snapshot))
                self._send(robot_state(self._robot.description, snapshot))
            self._safety_mode = mode
        for error in self._errors:
            self._tell(error)
        self._errors.clear()
        tick = snapshot.state.tick
        if tick < self._due:
            return b""
        first, self._due = self._due == 0, (tick // STATE_TICKS + 1) * STATE_TICKS
        state = robot_state(self._robot.description, snapshot)
        if not first:
            return state
        self._send(state)  # the client waits for it, so it must not be dropped
        return b""

    def event(self, event: Event) -> None:
        """Send a protective stop as an error, other safety stops and warnings as text; `Programs` reports programs."""
        now, why = self._robot.latest, event.why or ""
        if event.kind == "protective_stop":
            number, level = messages.PROTECTIVE_STOP, messages.WARNING
            self._errors.append(messages.error_code(now, number, level, why))
        elif event.kind == "safety_stop" or (event.kind == "warning" and event.line is None):
            self._tell(messages.text(now, why))
