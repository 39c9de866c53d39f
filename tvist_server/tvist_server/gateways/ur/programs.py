"""The controller's program as UR's interfaces present it: by path, key message and runtime exception."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import PurePosixPath
from typing import Protocol

from tvist_controller.instruments.snapshot import Snapshot
from tvist_controller.programs.built_in import ProgramLine
from tvist_protocol.io import Io
from tvist_protocol.programs import ProgramLoad, ProgramPause, ProgramPlay, ProgramState, ProgramStop
from tvist_protocol.replies import Refused, Reply
from tvist_protocol.stream import Event
from tvist_server.gateways.ur import messages
from tvist_server.gateways.ur.base import ControllerAccess

FOLDER = "/programs"
"""Folder in which a controller keeps programs; every other folder is accepted too."""

Heard = Callable[[bool], None]
"""Takes whether the request succeeded."""


class ProgramRobot(Protocol):
    """Access to the robot, as far as the program's messages need it."""

    @property
    def latest(self) -> Snapshot | None:
        """Snapshot of the last tick; None before the first."""

    def tell(self, message: bytes) -> None:
        """Send a robot message to all clients that get them."""


class Programs:
    """Asks the controller to load, play, pause and stop a program, and reports its state to clients.

    It learns the program's state from replies and from `io`, which arrive in the controller's order.

    Args:
        host: Access to the robot.
        known: Programs that can be loaded: name to moves.
    """

    def __init__(self, host: ProgramRobot, known: Mapping[str, Sequence[ProgramLine]]) -> None:
        self._host = host
        self._known = known
        self.path: str | None = None
        """Path of the loaded program; None before the first."""
        self.state: ProgramState = "STOPPED"
        self._control: ControllerAccess | None = None
        """Access of the client that plays the program. It lasts as long as the program, even after the client
        disconnects.
        """

    @property
    def name(self) -> str | None:
        """File name of the loaded program."""
        return None if self.path is None else PurePosixPath(self.path).name

    @property
    def playing(self) -> bool:
        """Whether a program runs."""
        return self.state == "PLAYING"

    @property
    def paused(self) -> bool:
        """Whether a program is paused."""
        return self.state == "PAUSED"

    @property
    def moves(self) -> bool:
        """Whether a program that moves the arm is running or paused."""
        return self.state != "STOPPED" and bool(self._known.get(self.name or ""))

    def has(self, path: str) -> bool:
        """Return whether there is such a file; the folders in its path are ignored."""
        return PurePosixPath(path).name in self._known

    def load(self, path: str, control: ControllerAccess, heard: Heard) -> None:
        """Load a program, and stop the running one.

        Args:
            path: Path of the file; its folders are ignored.
            control: Access of the client that loads it.
            heard: Called once.
        """
        name = PurePosixPath(path).name

        def then(reply: Reply) -> None:
            loaded = not isinstance(reply, Refused)
            if loaded:
                self._become("STOPPED")
                self.path = path if "/" in path else f"{FOLDER}/{name}"
            heard(loaded)

        control.ask(ProgramLoad(name=name), then)

    def play(self, control: ControllerAccess, heard: Heard) -> None:
        """Start the loaded program, or resume a paused one.

        Args:
            control: Access of the client that plays it.
            heard: Called once, as soon as the program runs or has failed to start.
        """
        if self.path is None or control.held_by_other:
            heard(False)
            return
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
        """Stop the program and any motion; no control is needed.

        Args:
            control: Access of the client that stops it.
            heard: Called once.
        """
        control.ask(ProgramStop(), self._changed("STOPPED", heard))

    def io(self, io: Io) -> None:
        """Take over the program's state from the controller."""
        if io.program is not None and io.program != self.name:
            self._become("STOPPED")  # the previous program, under its own name
            self.path = f"{FOLDER}/{io.program}"
        self._become(io.program_state)

    def event(self, event: Event) -> None:
        """Handle an event of the robot."""
        if event.line is not None:
            stamp = messages.stamp(self._host.latest)
            self._host.tell(messages.runtime_exception(stamp, event.line, 1, event.why or ""))

    def _changed(self, state: ProgramState, heard: Heard) -> Callable[[Reply], None]:
        def then(reply: Reply) -> None:
            done = not isinstance(reply, Refused)
            if done:
                self._become(state)
            heard(done)

        return then

    def _become(self, state: ProgramState) -> None:
        before, self.state = self.state, state
        if state == "STOPPED":
            self._hold(None)
        if "STOPPED" in {before, state} and before != state:
            self._say("PROGRAM_XXX_STOPPED" if state == "STOPPED" else "PROGRAM_XXX_STARTED")

    def _hold(self, control: ControllerAccess | None) -> None:
        before, self._control = self._control, control
        if before is not None:
            before.leave()

    def _say(self, title: str) -> None:
        stamp = messages.stamp(self._host.latest)
        self._host.tell(messages.key(stamp, title, (self.name or "").removesuffix(".urp")))
