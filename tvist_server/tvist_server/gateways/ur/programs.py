"""The controller's programs as UR's interfaces present them: by path, key message, popup and runtime exception."""

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
from tvist_server.gateways.ur.base import ControllerAccess
from tvist_server.gateways.ur.external_control import ExternalControl

FOLDER: Final = "/programs"
"""Folder in which a controller keeps programs; every other folder is accepted too."""
_SAVED: Final = (".urp", ".script")
"""How the names of files end. The name of a script that a client has sent has no ending."""
_PLACE: Final = re.compile(r"text:(\d+):(\d+)")

Heard = Callable[[bool], None]
"""Takes whether the request succeeded."""
Outcome = Callable[[Refused | None], None]
"""Takes the refusal, or None if the request succeeded."""


class ProgramRobot(Protocol):
    """Access to the robot, as far as the program's messages need it."""

    @property
    def latest(self) -> Snapshot | None:
        """Snapshot of the last tick; None before the first."""

    def tell(self, message: bytes) -> None:
        """Send a robot message to all clients that get them."""


class Programs:
    """Asks the controller to load, run, play, pause and stop programs, and reports to clients what they do.

    It learns the program's state from replies and from `io`, which arrive in the controller's order.

    Args:
        host: Access to the robot.
        external: Completes programs that get a part of their text from the client that plays them.
    """

    def __init__(self, host: ProgramRobot, external: ExternalControl) -> None:
        self._host, self._external = host, external
        self.path: str | None = None
        """Path of the loaded program; only its name if a client has sent it as a script; None before the first."""
        self.state: ProgramState = "STOPPED"
        self.interpreter = Interpreter()
        """Statements of the interpreter mode, with those that were accepted since the robot has told of them."""
        self._label: ProgramLabel | None = None
        """Label that the clients were told last."""
        self._control: ControllerAccess | None = None
        """Access of the client that plays the program. It lasts as long as the program, even after the client
        disconnects.
        """
        self._beginning: list[ControllerAccess] = []
        """Accesses of clients whose secondary programs were accepted, before `program_started` tells of them."""
        self._beside: list[ControllerAccess] = []
        """Accesses of clients whose secondary programs run. They last until no secondary program runs."""
        self._running_beside = 0
        self._asked: object | None = None
        """The request to play a program whose text is being found; None if there is none."""

    @property
    def name(self) -> str | None:
        """File name of the loaded program, or the name of the script."""
        return None if self.path is None else PurePosixPath(self.path).name

    @property
    def saved(self) -> bool:
        """Whether the loaded program is a file."""
        return self.path is not None and self.path.endswith(_SAVED)

    @property
    def playing(self) -> bool:
        """Whether a program runs and is not paused."""
        return self.state == "PLAYING"

    # ------------------------------------------------------------------ requests

    def load(self, path: str, control: ControllerAccess, outcome: Outcome) -> None:
        """Load a program, and stop the running one.

        Args:
            path: Path of the file; its folders are ignored.
            control: Access of the client that loads it.
            outcome: Called once.
        """
        name, self._asked = PurePosixPath(path).name, None

        def then(reply: Reply) -> None:
            refused = reply if isinstance(reply, Refused) else None
            if refused is None:
                self._become("STOPPED")
                self.path = path if "/" in path else _path_of(name)
            outcome(refused)

        if re.match(PROGRAM_NAME_PATTERN, name):
            self._external.find(name, lambda text: control.ask(ProgramLoad(name=name, text=text), then))
        else:
            why = f"the path does not name a file, which has {PATTERN_MEANINGS[PROGRAM_NAME_PATTERN]}"
            outcome(Refused(code="out_of_range", where="name", why=why))

    def run(self, text: str, control: ControllerAccess, outcome: Outcome, *, secondary: bool) -> None:
        """Start a script that a client has sent.

        Args:
            text: Its text in URScript.
            control: Access of the client, which has to last until the reply.
            outcome: Called once, as soon as the script has started or was refused.
            secondary: Whether it runs beside the program, and does not replace it.
        """
        lasting = control.lasting()

        def then(reply: Reply) -> None:
            refused = reply if isinstance(reply, Refused) else None
            if refused is not None:
                lasting.leave()
                self._except(refused)
            elif secondary:
                self._beginning.append(lasting)
            else:
                self._hold(lasting)
            outcome(refused)

        lasting.change(lambda token: ProgramRun(token=token, text=text), then)

    def play(self, control: ControllerAccess, heard: Heard) -> None:
        """Start the loaded program, or resume a paused one.

        Args:
            control: Access of the client that plays it.
            heard: Called once, as soon as the program runs or has failed to start.
        """
        name, state, asked = self.name, self.state, object()
        if name is None or control.held_by_other:
            heard(False)
            return
        self._asked = asked

        def wanted() -> bool:
            """Return False if it was stopped meanwhile, or another program was loaded or started."""
            return self._asked is asked and (self.name, self.state) == (name, state)

        def found(text: str | None) -> None:
            if not wanted():
                heard(False)
            elif text is None or state != "STOPPED":
                self._play(control, heard)
            else:
                self._external.complete(text, control.host, completed)

        def completed(whole: str | None) -> None:
            if whole is None or not wanted():
                heard(False)
            else:
                control.ask(ProgramLoad(name=name, text=whole), loaded)

        def loaded(reply: Reply) -> None:
            if isinstance(reply, Refused):
                self._except(reply)
                heard(False)
            else:
                found(None)

        self._external.find(name, found)

    def _play(self, control: ControllerAccess, heard: Heard) -> None:
        lasting = control.lasting()

        def then(reply: Reply) -> None:
            played = not isinstance(reply, Refused)
            if played:
                self._hold(lasting)
                self._become("PLAYING")
            else:
                lasting.leave()
            heard(played)

        lasting.change(lambda token: ProgramPlay(token=token), then)

    def pause(self, control: ControllerAccess, heard: Heard) -> None:
        """Pause the running program.

        Args:
            control: Access of the client that pauses it.
            heard: Called once.
        """
        if not self.playing or control.held_by_other:
            heard(False)
        else:
            control.change(lambda token: ProgramPause(token=token), self._changed("PAUSED", heard))

    def stop(self, control: ControllerAccess, heard: Heard) -> None:
        """Stop all programs and any motion; no control is needed.

        Args:
            control: Access of the client that stops it.
            heard: Called once.
        """
        self._asked = None
        control.ask(ProgramStop(), self._changed("STOPPED", heard))

    def close_popup(self, control: ControllerAccess, heard: Heard) -> None:
        """Close the popup of a program, which may be waiting for that; no control is needed.

        Args:
            control: Access of the client that closes it.
            heard: Called once.
        """
        control.ask(ProgramClosePopup(), lambda reply: heard(not isinstance(reply, Refused)))

    # ------------------------------------------------------------------ what the robot tells

    def io(self, io: Io) -> None:
        """Take over the program's state from the controller."""
        if io.program is not None and io.program != self.name:
            self.path = _path_of(io.program)
        self._become(io.program_state)
        if io.program_label != self._label:
            self._label = io.program_label
            if self._label is not None:
                stamp = messages.stamp(self._host.latest)
                self._host.tell(messages.label(stamp, self._label.number, self._label.name))
        self.interpreter = io.interpreter or Interpreter()

    def event(self, event: Event) -> None:
        """Handle an event of the robot: tell the clients if it concerns a program."""
        stamp, program = messages.stamp(self._host.latest), event.program or ""
        match event.kind:
            case "program_started" | "program_stopped" if event.secondary:
                self._count_beside(started=event.kind == "program_started")
            case "program_started":
                self._host.tell(messages.key(stamp, "PROGRAM_XXX_STARTED", _title(program)))
            case "program_stopped":
                self._host.tell(messages.key(stamp, "PROGRAM_XXX_STOPPED", _title(program)))
            case "text":
                self._host.tell(messages.text(stamp, event.why or ""))
            case "popup":
                shown = messages.popup(
                    stamp,
                    event.title or "",
                    event.why or "",
                    warning=event.level == "warning",
                    error=event.level == "error",
                    blocking=bool(event.blocking),
                )
                self._host.tell(shown)
            case "warning" if event.line is not None:
                why = event.why or ""
                self._host.tell(messages.runtime_exception(stamp, event.line, event.column or 1, why))

    def _except(self, refused: Refused) -> None:
        """Tell all clients where the text of a program is not valid."""
        place = _PLACE.fullmatch(refused.where)
        if refused.code == "script_error" and place is not None:
            line, column = map(int, place.groups())
            stamp = messages.stamp(self._host.latest)
            self._host.tell(messages.runtime_exception(stamp, line, column, refused.why))

    # ------------------------------------------------------------------ state and control

    def _changed(self, state: ProgramState, heard: Heard) -> Callable[[Reply], None]:
        def then(reply: Reply) -> None:
            done = not isinstance(reply, Refused)
            if done:
                self._become(state)
            heard(done)

        return then

    def _become(self, state: ProgramState) -> None:
        self.state = state
        if state == "STOPPED":
            self._hold(None)

    def _hold(self, control: ControllerAccess | None) -> None:
        before, self._control = self._control, control
        if before is not None:
            before.leave()

    def _count_beside(self, *, started: bool) -> None:
        """Count the secondary programs, and leave the accesses of those that have ended."""
        if started:
            self._running_beside += 1
            self._beside += self._beginning
            self._beginning = []
            return
        self._running_beside = max(self._running_beside - 1, 0)
        if self._running_beside == 0:
            ended, self._beside = self._beside, []
            for control in ended:
                control.leave()


def _path_of(name: str) -> str:
    """Path that clients are told: that of a file, or only the name of a script."""
    return f"{FOLDER}/{name}" if name.endswith(_SAVED) else name


def _title(name: str) -> str:
    """Name of a program in key messages."""
    for ending in _SAVED:
        name = name.removesuffix(ending)
    return name
