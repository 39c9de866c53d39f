"""The controller's program as clients of UR's interfaces know it: by paths, key messages and runtime exceptions."""

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
"""Folder in which a controller keeps programs; every other folder is accepted as well."""

Heard = Callable[[bool], None]
"""Takes whether it was done."""


class ProgramRobot(Protocol):
    """What the program's messages need of its robot."""

    @property
    def latest(self) -> Snapshot | None:
        """The last tick; None before the first."""

    def tell(self, message: bytes) -> None:
        """Send a robot message to all clients that get them."""


class Programs:
    """Asks the controller to load, play, pause and stop, and tells clients what becomes of it.

    What it knows it has from replies and from `io`, which come in the controller's order.

    Args:
        host: The robot.
        known: Programs that can be loaded, by name: their moves.
    """

    def __init__(self, host: ProgramRobot, known: Mapping[str, Sequence[ProgramLine]]) -> None:
        self._host = host
        self._known = known
        self.path: str | None = None
        """Path of the loaded program; None before the first."""
        self.state: ProgramState = "STOPPED"
        self._control: ControllerAccess | None = None
        """Control of the client that plays the program; it lasts as long as the program, even without the client."""

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
        """Whether one was paused."""
        return self.state == "PAUSED"

    @property
    def moves(self) -> bool:
        """Whether one runs, or is paused, that moves the arm."""
        return self.state != "STOPPED" and bool(self._known.get(self.name or ""))

    def has(self, path: str) -> bool:
        """Whether there is such a file; folders before its name make no difference."""
        return PurePosixPath(path).name in self._known

    def load(self, path: str, control: ControllerAccess, heard: Heard) -> None:
        """Load a program, and stop the one that runs.

        Args:
            path: Path of the file; folders before its name make no difference.
            control: Control of the client that loads it.
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
        """Start the loaded program, or go on with a paused one.

        Args:
            control: Control of the client that plays it.
            heard: Called once, as soon as it runs or cannot.
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
        """Hold the program that runs.

        Args:
            control: Control of the client that pauses it.
            heard: Called once.
        """
        if not self.playing or control.held_by_other:
            heard(False)
        else:
            control.change(lambda token: ProgramPause(token=token), self._changed("PAUSED", heard))

    def stop(self, control: ControllerAccess, heard: Heard) -> None:
        """End the program, and whatever moves: anyone may.

        Args:
            control: Control of the client that stops it.
            heard: Called once.
        """
        control.ask(ProgramStop(), self._changed("STOPPED", heard))

    def io(self, io: Io) -> None:
        """The controller says how it stands."""
        if io.program is not None and io.program != self.name:
            self._become("STOPPED")  # the one before, under its own name
            self.path = f"{FOLDER}/{io.program}"
        self._become(io.program_state)

    def event(self, event: Event) -> None:
        """Something happened at the robot."""
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
