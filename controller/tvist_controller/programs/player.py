"""The loaded program and its progress."""

from collections.abc import Callable

from tvist_controller.command_row import Call, Row
from tvist_controller.events import Emit
from tvist_controller.motion import MotionControl
from tvist_controller.programs.built_in import ProgramLine, built_in
from tvist_controller.refusal import RefusalError
from tvist_controller.safety_control import SafetyControl
from tvist_plant.description import RobotDescription
from tvist_protocol.commands import MoveJ
from tvist_protocol.programs import ProgramLoad, ProgramPause, ProgramPlay, ProgramState, ProgramStop
from tvist_protocol.stream import Event
from tvist_protocol.transitions import Activity

_OWN_TOKEN = "program"  # noqa: S105  the lease was checked when the program was played
"""Token in the commands that a program generates, which are not sent to clients."""


class ProgramPlayer:
    """Carries out one program at a time, line by line, with the rights of the client that played it.

    Its motions are ordinary motions: they have numbers and events, and a client may pause them; stopping one ends the
    program. A protective stop pauses the program: after the stop is unlocked, playing resumes with the line that was
    stopped.

    Args:
        description: The robot.
        motion: The robot's motion.
        safety: The safety system's stops.
        move: Plans and starts a motion, and returns its number; raises `RefusalError`.
        emit: Emits events.
    """

    def __init__(
        self,
        description: RobotDescription,
        motion: MotionControl,
        safety: SafetyControl,
        move: Callable[[MoveJ], int],
        emit: Emit,
    ) -> None:
        self._motion, self._safety, self._move, self._emit = motion, safety, move, emit
        self.known = built_in(description)
        """Programs that can be loaded, by name."""
        self.name: str | None = None
        """Name of the loaded program; None if there is none."""
        self.state: ProgramState = "STOPPED"
        self._next = 0
        """Index of the present line, or of the next one between two lines."""
        self._moving: int | None = None
        """Number of the present line's motion."""
        self.rows = (
            Row(ProgramLoad, self._load, lease="if named", changes_io=True),
            Row(ProgramPlay, self._play, changes_io=True),
            Row(ProgramPause, self._pause, changes_io=True),
            Row(ProgramStop, self._stop, lease="if named", changes_io=True),
        )

    @property
    def line(self) -> int:
        """Present line, or the one with which playing would resume, counted from 1; 0 if there is none."""
        return 0 if self.state == "STOPPED" or self._next >= len(self._lines) else self._next + 1

    @property
    def progress(self) -> tuple[str | None, ProgramState, int]:
        """Fields of the program in `io`: its name, its state and its line."""
        return self.name, self.state, self.line

    def advance(self) -> None:
        """Begin the next line if it is due; called first in every tick."""
        # If a safeguard stop comes between two lines, there is no motion to pause, so the next line waits.
        if self.state != "PLAYING" or self._motion.safety.safeguard:
            return
        lines = self._lines
        if self._moving is not None or not lines:
            return
        if self._next == len(lines):
            self.end()
            return
        line = lines[self._next]
        try:
            self._moving = self._move(MoveJ(token=_OWN_TOKEN, q=line.q))
        except RefusalError as refusal:
            why = f"move to {line.pose} was refused: {refusal.reply.why}"
            self._emit("warning", code=refusal.reply.code, why=why, line=self._next + 1)
            self.end()

    def hear(self, event: Event) -> None:
        """Handle an event of the robot."""
        if event.kind == "protective_stop" and self.state != "STOPPED":
            self.state, self._moving = "PAUSED", None
        elif event.kind == "safety_stop" and event.category != 2:
            self.end()
        elif event.id is None or event.id != self._moving:
            return
        elif event.kind == "motion_done":
            self._moving = None
            self._next += 1
        # A failure of the plant is followed by a protective stop, which pauses the program.
        elif event.kind == "motion_stopped" and event.code != "plant_failure":
            self.end()

    def end(self) -> None:
        """End the program without stopping its motion."""
        self.state, self._next, self._moving = "STOPPED", 0, None

    def stop_moving(self) -> None:
        """End a program that moves the arm, even between two motions, so that none begins after a stop."""
        if self.state == "PLAYING" and self._lines:
            self.end()

    @property
    def _lines(self) -> tuple[ProgramLine, ...]:
        return self.known.get(self.name or "", ())

    def _load(self, call: Call[ProgramLoad]) -> None:
        name = call.command.name
        if name not in self.known:
            why = f"name is {name!r}: must be one of {', '.join(sorted(self.known))}"
            raise RefusalError("out_of_range", "name", why)
        if self.state != "STOPPED":
            self.end()
            self._motion.stop(None, "another program was loaded")
        self.name = name

    def _play(self, _: Call[ProgramPlay]) -> None:
        if self.name is None:
            raise RefusalError("wrong_mode", "", "no program is loaded: send program.load first")
        if self.state == "PLAYING":
            raise RefusalError("busy", "", f"program {self.name} is playing")
        if self.state == "PAUSED" and self._moving is not None:
            if self._motion.activity is Activity.PAUSED:
                self._motion.resume()
        else:
            self._motion.check("move_j")
        self.state = "PLAYING"

    def _pause(self, _: Call[ProgramPause]) -> None:
        if self.state != "PLAYING":
            raise RefusalError("wrong_mode", "", "no program is playing: there is nothing to pause")
        # Between two lines there is no motion to pause, so the next line waits.
        if self._moving is not None:
            self._motion.pause()
            self._safety.stay_paused()
        self.state = "PAUSED"

    def _stop(self, _: Call[ProgramStop]) -> None:
        self.end()
        self._motion.stop(None, "the program was stopped")
