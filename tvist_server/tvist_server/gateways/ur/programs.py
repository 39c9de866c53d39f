"""The program that is loaded, and its player."""

from collections.abc import Callable
from enum import StrEnum
from pathlib import PurePosixPath
from typing import Protocol

from tvist_plant.description import RobotDescription
from tvist_protocol.commands import Command, MoveJ, Pause, Resume, Stop
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.replies import Accepted, Refused, Reply
from tvist_protocol.stream import Event
from tvist_server.gateways.ur.base import Control
from tvist_server.gateways.ur.built_in import Move, built_in
from tvist_server.gateways.ur.primary import messages
from tvist_server.instruments.snapshot import Snapshot

FOLDER = "/programs"
"""Where a controller keeps programs; every other folder will do as well."""

Heard = Callable[[bool], None]
"""Takes whether it was done."""

_NOT_NOW = {"no_control", "stale_token", "wrong_mode", "busy"}
"""Why a program does not start at all; for any other reason it fails at its first line."""


class Host(Protocol):
    """What a program needs of its robot."""

    @property
    def description(self) -> RobotDescription:
        """The robot."""

    @property
    def latest(self) -> Snapshot | None:
        """The last tick; None before the first."""

    def tell(self, message: bytes) -> None:
        """Send a robot message to all clients that get them."""


class ProgramState(StrEnum):
    """As the dashboard names it."""

    STOPPED = "STOPPED"
    PLAYING = "PLAYING"
    PAUSED = "PAUSED"


class Programs:
    """The one program that is loaded, and its player.

    It has no clock and waits for nothing: the controller's replies and events carry it from line to line.

    Args:
        host: The robot.
    """

    def __init__(self, host: Host) -> None:
        self._host = host
        self.known = built_in(host.description)
        """What can be loaded."""
        self.path: str | None = None
        """Of the loaded program; None before the first."""
        self.state = ProgramState.STOPPED
        self._begun = False
        """Whether clients were told that it runs."""
        self._control: Control | None = None
        self._line = 0
        """Of the move that runs, or comes next; 0 the first."""
        self._asked = 0
        """Moves asked for since the start: a reply to an earlier one is of no interest."""
        self._awaited = False
        """Whether the reply to the newest one is still to come."""
        self._motion: int | None = None
        """Number of the motion that runs."""
        self._ended: dict[int, str] = {}
        """How motions ended that ended before the reply which names them came."""

    @property
    def name(self) -> str | None:
        """File name of the loaded program."""
        return None if self.path is None else PurePosixPath(self.path).name

    @property
    def playing(self) -> bool:
        """Whether a program runs."""
        return self.state is ProgramState.PLAYING

    @property
    def paused(self) -> bool:
        """Whether one was paused."""
        return self.state is ProgramState.PAUSED

    @property
    def standing(self) -> bool:
        """Whether nothing of it moves, or is about to."""
        return self._motion is None and not self._awaited

    def load(self, path: str, control: Control, heard: Heard) -> None:
        """Load a program, and end the one that runs.

        Args:
            path: Of its file; folders before its name make no difference.
            control: Of who loads it.
            heard: Called once; with False where there is no such file.
        """
        name = PurePosixPath(path).name
        if name not in self.known:
            heard(False)
            return
        running = self.state is not ProgramState.STOPPED
        self._end()
        self.path = path if "/" in path else f"{FOLDER}/{name}"
        if running:
            self.stop(control, heard)
        else:
            heard(True)

    # ------------------------------------------------------------------ play, pause, stop

    def play(self, control: Control, heard: Heard) -> None:
        """Start the loaded program, or go on with a paused one.

        Args:
            control: Of who plays it; its moves go the same way.
            heard: Called once, as soon as it runs or cannot.
        """
        if self.paused:
            self._resume(control, heard)
        elif self.playing or not self._ready() or control.held_by_other:
            heard(False)
        else:
            self.state, self._line = ProgramState.PLAYING, 0
            self._hold(control)
            if self._moves:
                self._move(heard)
            else:
                self._start()
                heard(True)

    def pause(self, control: Control, heard: Heard) -> None:
        """Hold the program that runs.

        Args:
            control: Of who pauses it.
            heard: Called once.
        """
        if not self.playing or control.held_by_other:
            heard(False)
            return
        self.state = ProgramState.PAUSED
        if self.standing:
            heard(True)
            return

        def then(reply: Reply) -> None:
            # A motion that has just ended cannot be paused, and the next one waits for the program.
            held = not _refused_control(reply)
            if not held and self.paused:
                self.state = ProgramState.PLAYING
                self._go_on()
            heard(held)

        control.change(lambda token: Pause(token=token), then)

    def stop(self, control: Control, heard: Heard) -> None:
        """End the program, and whatever moves: anyone may.

        Args:
            control: Of who stops it.
            heard: Called once.
        """
        self._end()
        control.ask(Stop(), lambda reply: heard(not isinstance(reply, Refused)))

    def watch(self, snapshot: Snapshot) -> None:
        """A tick: no program survives an arm without power, whoever took it."""
        if self.state is not ProgramState.STOPPED and snapshot.robot_mode != RobotMode.RUNNING:
            self.interrupt()

    def interrupt(self) -> None:
        """The arm can move no longer: the program ends."""
        self._end()

    def event(self, event: Event) -> None:
        """Something happened at the robot."""
        # A stop of category 2 pauses the motion, and the program waits with it.
        powerless = event.kind == "safety_stop" and event.category != 2
        if powerless or event.kind in {"protective_stop", "lease_lost"}:
            self.interrupt()
        if event.kind not in {"motion_done", "motion_stopped"} or event.id is None:
            return
        if event.id == self._motion:
            self._arrive(event.kind)
        elif self._awaited:
            self._ended[event.id] = event.kind

    # ------------------------------------------------------------------ from line to line

    @property
    def _moves(self) -> tuple[Move, ...]:
        return self.known.get(self.name or "", ())

    def _ready(self) -> bool:
        """Whether a program is loaded and the arm may move."""
        latest = self._host.latest
        if self.path is None or latest is None:
            return False
        safe = latest.safety_mode in {SafetyMode.NORMAL, SafetyMode.REDUCED}
        return safe and latest.robot_mode == RobotMode.RUNNING

    def _resume(self, control: Control, heard: Heard) -> None:
        if control.held_by_other:
            heard(False)
            return
        self.state = ProgramState.PLAYING
        self._hold(control)
        if self.standing:
            self._go_on()
            heard(True)
            return

        def then(reply: Reply) -> None:
            held = not _refused_control(reply)
            if not held and self.playing:
                self.state = ProgramState.PAUSED
            heard(held)

        control.change(lambda token: Resume(token=token), then)

    def _go_on(self) -> None:
        """Do the line that comes next, if nothing moves."""
        if not self.standing or not self._moves:
            return
        if self._line < len(self._moves):
            self._move()
        else:
            self._end()

    def _move(self, heard: Heard | None = None) -> None:
        """Ask for the motion of the present line.

        Args:
            heard: Whoever waits to hear whether the program has begun.
        """
        move, control = self._moves[self._line], self._control
        if control is None:
            return
        self._asked += 1
        asked, self._awaited = self._asked, True

        def command(token: str) -> Command:
            return MoveJ(token=token, q=move.q)

        def then(reply: Reply) -> None:
            if asked != self._asked or not self._awaited:  # stopped since, and the motion with it
                if heard is not None:
                    heard(False)
                return
            self._awaited = False
            if heard is not None:
                self._begin(reply, heard)
            if isinstance(reply, Accepted) and reply.id is not None:
                self._motion = reply.id
                ended, self._ended = self._ended.get(reply.id), {}
                if ended is not None:
                    self._arrive(ended)
            elif self.state is not ProgramState.STOPPED:
                self._fail(move, reply)

        control.change(command, then)

    def _begin(self, reply: Reply, heard: Heard) -> None:
        """The first line was answered: say whether the program runs."""
        if isinstance(reply, Refused) and reply.code in _NOT_NOW:
            self._forget()
            heard(False)
        else:
            self._start()
            heard(not isinstance(reply, Refused))

    def _arrive(self, how: str) -> None:
        """The motion of the present line has ended."""
        self._motion = None
        if how != "motion_done":
            self._end()
            return
        self._line += 1
        if self.playing:
            self._go_on()

    def _fail(self, move: Move, reply: Reply) -> None:
        """A line cannot be carried out: the program ends there."""
        why = reply.why if isinstance(reply, Refused) else "it was not answered with a motion"
        text = f"move to {move.pose} was refused: {why}"
        stamp = messages.stamp(self._host.latest)
        self._host.tell(messages.runtime_exception(stamp, self._line + 1, 1, text))
        self._end()

    def _start(self) -> None:
        self._begun = True
        self._say("PROGRAM_XXX_STARTED")

    def _end(self) -> None:
        begun = self._begun
        self._forget()
        if begun:
            self._say("PROGRAM_XXX_STOPPED")

    def _hold(self, control: Control | None) -> None:
        """Play with the control of whoever plays: it lasts as long as the program, its client may go."""
        before, self._control = self._control, None if control is None else control.lasting()
        if before is not None:
            before.leave()

    def _forget(self) -> None:
        self.state, self._begun = ProgramState.STOPPED, False
        self._hold(None)
        self._motion, self._awaited, self._ended = None, False, {}

    def _say(self, title: str) -> None:
        stamp = messages.stamp(self._host.latest)
        name = (self.name or "").removesuffix(".urp")
        self._host.tell(messages.key(stamp, title, name))


def _refused_control(reply: Reply) -> bool:
    return isinstance(reply, Refused) and reply.code in {"no_control", "stale_token"}
