"""The controller's programs as UR's interfaces present them: path, key message, popup and runtime exception."""

import re
from collections.abc import Callable
from pathlib import PurePosixPath
from typing import Final, Protocol

from tvist_controller.instruments.snapshot import Snapshot
from tvist_protocol.io import Io
from tvist_protocol.programs import (
    Interpreter,
    ProgramClosePopup,
    ProgramLabel,
    ProgramLoad,
    ProgramPause,
    ProgramPlay,
    ProgramRun,
    ProgramState,
    ProgramStop,
)
from tvist_protocol.replies import Refused, Reply
from tvist_protocol.stream import Event
from tvist_protocol.values import PATTERN_MEANINGS, PROGRAM_NAME_PATTERN
from tvist_server.gateways.ur import messages
from tvist_server.gateways.ur.external_control import ExternalControl
from tvist_server.gateways.ur.lease import ConnectionControl

FOLDER: Final = "/programs"  # folder in which a controller keeps programs; every other folder is accepted too
_SAVED: Final = (".urp", ".script")
"""Endings of file names. A script that a client has sent has a name without ending."""
_PLACE: Final = re.compile(r"text:(\d+):(\d+)")


class ProgramHost(Protocol):
    """The parts of the robot that messages about its programs need."""

    latest: Snapshot | None
    tell: Callable[[bytes], None]


class Programs:
    """Loads, runs, plays, pauses and stops programs, and reports them; their state comes from replies and `io`."""

    def __init__(self, host: ProgramHost, external: ExternalControl) -> None:
        self._host, self._external = host, external
        self.path: str | None = None
        """Path of the loaded program, or name of a script that a client has sent; None before the first."""
        self.state: ProgramState = "STOPPED"
        self.interpreter = Interpreter()
        """Statements of the interpreter mode, including those accepted since the last `io`."""
        self._label: ProgramLabel | None = None
        self._control: ConnectionControl | None = None
        """Access of the client that plays the program, kept as long as the program, even if it disconnects."""
        self._starting_controls: list[ConnectionControl] = []
        """Accesses of clients whose secondary programs are accepted but not started."""
        self._secondary_controls: list[ConnectionControl] = []
        """Accesses of clients whose secondary programs run; kept until no secondary program runs."""
        self._running_secondary = 0
        self._asked: object | None = None
        """Pending request to play, while the text is being found; None: no request."""

    @property
    def name(self) -> str | None:
        """File name of the loaded program, or the name of the script."""
        return None if self.path is None else PurePosixPath(self.path).name

    @property
    def saved(self) -> bool:
        return self.path is not None and self.path.endswith(_SAVED)

    @property
    def playing(self) -> bool:
        return self.state == "PLAYING"

    async def load(self, path: str, control: ConnectionControl) -> Refused | None:
        """Load a program by its path, whose folders are ignored, and stop the running one."""
        name, self._asked = PurePosixPath(path).name, None
        if not re.match(PROGRAM_NAME_PATTERN, name):
            why = f"the path does not name a file, which has {PATTERN_MEANINGS[PROGRAM_NAME_PATTERN]}"
            return Refused(code="out_of_range", where="name", why=why)
        text = await self._external.find(name)
        reply = await control.ask(ProgramLoad(name=name, text=text))
        if isinstance(reply, Refused):
            return reply
        self._become("STOPPED")
        self.path = path if "/" in path else _path_of(name)
        return None

    async def run(self, text: str, control: ConnectionControl, *, secondary: bool) -> Refused | None:
        """Start a client's script: beside the running program if the script is secondary, else instead."""
        lasting = control.lasting()
        reply = await lasting.change(lambda token: ProgramRun(token=token, text=text))
        if isinstance(reply, Refused):
            lasting.leave()
            self._report_script_error(reply)
            return reply
        if secondary:
            self._starting_controls.append(lasting)
        else:
            self._keep_control(lasting)
        return None

    async def play(self, control: ConnectionControl) -> bool:
        """Start the loaded program, or resume a paused one; return whether it runs."""
        name, state, asked = self.name, self.state, object()
        if name is None or control.held_by_other:
            return False
        self._asked = asked

        def wanted() -> bool:
            """Return False if meanwhile the program was stopped, or another program was loaded or started."""
            return self._asked is asked and (self.name, self.state) == (name, state)

        text = await self._external.find(name)
        if text is not None and state == "STOPPED" and wanted():
            whole = await self._external.complete(text, control.host)
            if whole is None or not wanted():
                return False
            reply = await control.ask(ProgramLoad(name=name, text=whole))
            if isinstance(reply, Refused):
                self._report_script_error(reply)
                return False
        if not wanted():
            return False
        lasting = control.lasting()
        if isinstance(await lasting.change(lambda token: ProgramPlay(token=token)), Refused):
            lasting.leave()
            return False
        self._keep_control(lasting)
        self._become("PLAYING")
        return True

    async def pause(self, control: ConnectionControl) -> bool:
        """Pause the running program; return whether that succeeded."""
        if not self.playing or control.held_by_other:
            return False
        return self._changed("PAUSED", await control.change(lambda token: ProgramPause(token=token)))

    async def stop(self, control: ConnectionControl) -> bool:
        """Stop all programs and any motion, without control; return whether that was accepted."""
        self._asked = None
        return self._changed("STOPPED", await control.ask(ProgramStop()))

    async def close_popup(self, control: ConnectionControl) -> bool:
        """Close a program's popup without control; return whether that was accepted."""
        return not isinstance(await control.ask(ProgramClosePopup()), Refused)

    def io(self, io: Io) -> None:
        """Take over the program's state from the controller."""
        if io.program is not None and io.program != self.name:
            self.path = _path_of(io.program)
        self._become(io.program_state)
        if io.program_label != self._label:
            self._label = io.program_label
            if self._label is not None:
                self._host.tell(messages.label(self._host.latest, self._label.number, self._label.name))
        self.interpreter = io.interpreter or Interpreter()

    def event(self, event: Event) -> None:
        now, why = self._host.latest, event.why or ""
        title = (event.program or "").removesuffix(".urp").removesuffix(".script")
        match event.kind:
            case "program_started" | "program_stopped" if event.secondary:
                self._count_secondary(started=event.kind == "program_started")
            case "program_started":
                self._host.tell(messages.key(now, "PROGRAM_XXX_STARTED", title))
            case "program_stopped":
                self._host.tell(messages.key(now, "PROGRAM_XXX_STOPPED", title))
            case "text":
                self._host.tell(messages.text(now, why))
            case "popup":
                blocking = bool(event.blocking)
                self._host.tell(
                    messages.popup(now, event.title or "", why, level=event.level, blocking=blocking)
                )
            case "warning" if event.line is not None:
                self._host.tell(messages.runtime_exception(now, event.line, event.column or 1, why))

    def _report_script_error(self, refused: Refused) -> None:
        """Report to all clients where the text of a program is invalid."""
        place = _PLACE.fullmatch(refused.where)
        if refused.code == "script_error" and place is not None:
            line, column = map(int, place.groups())
            self._host.tell(messages.runtime_exception(self._host.latest, line, column, refused.why))

    def _changed(self, state: ProgramState, reply: Reply) -> bool:
        done = not isinstance(reply, Refused)
        if done:
            self._become(state)
        return done

    def _become(self, state: ProgramState) -> None:
        self.state = state
        if state == "STOPPED":
            self._keep_control(None)

    def _keep_control(self, control: ConnectionControl | None) -> None:
        before, self._control = self._control, control
        if before is not None:
            before.leave()

    def _count_secondary(self, *, started: bool) -> None:
        """Count running secondary programs; when the last one has ended, release control for all of them."""
        if started:
            self._running_secondary += 1
            self._secondary_controls += self._starting_controls
            self._starting_controls = []
            return
        self._running_secondary = max(self._running_secondary - 1, 0)
        if self._running_secondary == 0:
            ended, self._secondary_controls = self._secondary_controls, []
            for control in ended:
                control.leave()


def _path_of(name: str) -> str:
    """Return the path reported to clients: a file's path, or only the name of a script."""
    return f"{FOLDER}/{name}" if name.endswith(_SAVED) else name
