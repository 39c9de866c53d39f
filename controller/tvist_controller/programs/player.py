"""The loaded program and its progress, and secondary programs."""

from dataclasses import dataclass

from tvist_controller.programs.access import Access
from tvist_controller.programs.arguments import readable
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.compiling import StoredProgram, StoredPrograms, built_in
from tvist_controller.programs.functions.group import FunctionContext
from tvist_controller.programs.indicators import MissedTurns, Popups, RunstateOutputs, Watchdogs
from tvist_controller.programs.interpreter import StatementQueue
from tvist_controller.programs.kinematics import ProgramKinematics
from tvist_controller.programs.library import MOVING, functions
from tvist_controller.programs.sockets import Sockets
from tvist_controller.refusal import RefusalError
from tvist_controller.safety.safety_control import SafetyControl
from tvist_protocol.modes import RobotMode
from tvist_protocol.programs import ProgramLabel, ProgramState
from tvist_protocol.stream import Event
from tvist_protocol.transitions import Activity
from tvist_urscript import EVALUATIONS, Machine, Script, ScriptError

TOLD_EVERY = 50  # ticks between updates of the line in `io`; the line changes almost every tick
GUIDED = 100  # evaluations charged to a tick's budget for a guided motion of the program
MAX_BESIDE = 8  # largest number of concurrent secondary programs


@dataclass(frozen=True, eq=False)
class _Running:
    name: str
    machine: Machine
    origin: str | None  # address of the machine that both sent and started it; None if unknown or different


class ProgramPlayer:
    """Runs a program and secondary ones with the rights of the client that played them.

    Motions of programs have numbers and events like those of clients. A client may pause a motion; stopping
    it ends the program. A protective stop pauses the program; after unlocking, playing resumes with the
    interrupted move.
    """

    def __init__(self, access: Access, safety: SafetyControl) -> None:
        self._access, self._motion, self._safety, self._emit = access, access.motion, safety, access.emit
        self.arm = ProgramArm(access, self._thread, self._lives, lambda work: self._machine().charge(work))
        self._missed_turns = MissedTurns(self.arm, access)
        self.popups = Popups(access.emit, self._machine)
        self._watchdogs = Watchdogs(access.peripherals)
        self.sockets = Sockets(
            access.emit, self._machine, lambda: self._now.origin if self._now else None, access.cell
        )
        self.statements = StatementQueue(self._machine, self.arm, access.peripherals, access.emit)
        self._runstate = RunstateOutputs(access.peripherals)
        kinematics = ProgramKinematics(access.description, access.motion, self.arm.spend)
        self._functions = functions(
            FunctionContext(
                access, self.arm, kinematics, self.popups, self._watchdogs, self.sockets, self.statements,
                self._runstate,
            )
        )  # fmt: skip
        self.kept = StoredPrograms(built_in(access.description))  # programs that can be loaded
        self.name: str | None = None  # name of the loaded program; None without one
        self.state: ProgramState = "STOPPED"
        self.loaded: StoredProgram | None = None
        self._main: _Running | None = None
        self._all: list[_Running] = []  # programs, oldest first
        self._starved: set[_Running] = set()  # programs that got none of the last tick's evaluations
        self.idle = True
        """Whether no program runs and no evaluations are owed, so that `advance` is not needed."""
        self._told: tuple[object, ...] = ()
        self._left = EVALUATIONS
        """Evaluations left by the last tick; a negative number is a debt to be paid first."""
        self._now: _Running | None = None  # the program whose turn it is
        self._failed = False  # whether the program ends by an error or a stop
        self.raised: list[Exception] = []  # unexpected exceptions of functions, until logged
        self.line = 0  # present line, or the one at which playing would resume, from 1; 0 for none
        self.label: ProgramLabel | None = None  # label passed by the program at that line; None for none

    @property
    def present_line(self) -> int:
        """Line of the main thread in this tick (`line` is updated only at intervals); 0 for none."""
        return 0 if self._main is None else self._main.machine.line

    @property
    def published(self) -> dict[str, object]:
        """All fields of the program in `io`."""
        return {
            "program": self.name, "program_state": self.state, "program_line": self.line,
            "program_label": self.label, "interpreter": self.statements.published,
            "watched": self._watchdogs.names,
        }  # fmt: skip

    # ------------------------------------------------------------------ ticks and events

    def advance(self, tick: int) -> None:
        """Give every thread its turn; called first in every tick unless idle."""
        self._give_turns(tick)
        self.idle = not self._all and self._left >= EVALUATIONS
        now = self.name, self.state, self.line, self.label
        if now != self._told:
            self._told, self._access.peripherals.changed = now, True

    def _give_turns(self, tick: int) -> None:
        # Count evaluations instead of time, so that live, lockstep and replayed runs are equal. Excess is subtracted
        # from the next ticks.
        self.sockets.answer()
        left = self._left = min(self._left, 0) + EVALUATIONS
        if not self._all:
            return
        if self.state == "PLAYING":
            self._watch(tick)
        if self._main is not None and not self._held:
            self._now = self._main  # actions behind a blend belong to this program
            self.arm.advance()
            self._now = None
        left -= GUIDED if self.arm.guides else 0
        # Threads that got no evaluations in the last tick come first, then the oldest.
        for running in sorted(self._all, key=lambda one: one not in self._starved) if left > 0 else ():
            if running not in self._all or (running is self._main and self._held):
                continue
            if left > 0:
                left = self._resume(running, left)
                self._starved.discard(running)
            else:
                self._starved.add(running)
        self._left = left
        if not self._held:
            self._missed_turns.look({one.machine for one in self._starved})
        self.arm.settle()
        if self._main is not None and (self.line == 0 or tick % TOLD_EVERY == 0):
            self._find_line(self._main.machine)

    def _find_line(self, machine: Machine) -> None:
        self.line = machine.line
        self.label = (
            None if machine.label is None else ProgramLabel(number=machine.label[0], name=machine.label[1])
        )

    @property
    def _held(self) -> bool:
        """Whether the program must wait: paused, safeguard stop active, or drives not ready yet."""
        motion = self._motion
        unready = motion.robot_mode is RobotMode.RUNNING and not motion.ready
        return self.state != "PLAYING" or motion.safety.safeguard or unready

    def _resume(self, running: _Running, left: int) -> int:
        """Give a program its turn; return the remaining evaluations."""
        self._now = running
        try:
            running.machine.resume(left)
        except ScriptError as error:
            self._fail(running, error)
        self._now = None
        if not running.machine.running:
            self._finish(running)
        return running.machine.left

    def hear(self, event: Event) -> None:
        """Handle an event of the robot."""
        if not self._all:
            return
        against = self.arm.hear(event)
        if event.kind == "protective_stop" and self._main is not None:
            self._wait(failed=True)
        elif (event.kind == "safety_stop" and event.category != 2) or (against and self._main is not None):
            self._failed = True
            self.end(event.why or event.kind)

    def end(self, why: str) -> None:
        """End all programs without stopping motion."""
        for running in tuple(self._all):
            self._close(running, why)

    def stop_moving(self, why: str) -> None:
        """End a program that may move the arm, so that no motion follows a stop."""
        if self.state == "PLAYING" and self.loaded is not None and self.loaded.script.used & MOVING:
            self.end(why)

    def _watch(self, tick: int) -> None:
        expired = self._watchdogs.expired(tick)
        if expired is None or self._main is None:
            return
        action, name = expired
        why = f"nobody wrote {name} as often as the program's watchdog asks: {action}"
        self._emit("warning", why=why)
        if action == "stop":
            self.end(why)
            self._motion.stop(None, "a watchdog of the program stopped it")
        elif self.state == "PLAYING":
            self.hold()

    def _fail(self, running: _Running, error: ScriptError) -> None:
        self._failed |= running is self._main
        if error.internal is not None:
            self.raised.append(error.internal)
        self._emit(
            "warning", why=readable(error.text), line=error.line, column=error.column, program=running.name
        )

    def _finish(self, running: _Running) -> None:
        """Handle the end of a program: stop its motion; if it has called `halt`, end all programs."""
        if running not in self._all:
            return
        halts = running.machine.halted
        moves = (halts or running is self._main) and (self.arm.moves or self.arm.guides)
        self._close(running)
        if halts:
            self.end(f"{running.name} has halted")
        if moves:
            self._motion.stop(None, "the program has ended")

    def _close(self, running: _Running, why: str | None = None) -> None:
        self._all.remove(running)
        self._starved.discard(running)
        try:
            running.machine.end()
        except ScriptError as error:
            self._fail(running, error)
        self.popups.close(running.machine)
        self.sockets.close(running.machine)
        secondary = running.machine.script.secondary or None
        self._emit("program_stopped", program=running.name, why=why, secondary=secondary)
        if running is self._main:
            self._main, self.state, self.line, self.label = None, "STOPPED", 0, None
            self._access.peripherals.changed = True
            self._runstate.tell(runs=False, failed=self._failed)
            self._watchdogs.clear()
            self.statements.close()
            self.arm.forget()
        if self._main is None:
            self._access.force.external.use(None)

    def _machine(self) -> Machine:
        assert self._now is not None, "only programs call their functions"
        return self._now.machine

    def _thread(self) -> tuple[Machine, int]:
        machine = self._machine()
        return machine, machine.thread

    def _lives(self, thread: object) -> bool:
        return any(
            (running.machine, number) == thread for running in self._all for number in running.machine.living
        )

    # ------------------------------------------------------------------ for commands

    def load(self, name: str, program: StoredProgram, why: str) -> None:
        """Load the program to play next; end a running one and stop the arm."""
        if self._main is not None:
            self._close(self._main, why)
            self._motion.stop(None, why)
        self.name, self.loaded = name, program

    def play(self, origin: str | None) -> None:
        """Start the loaded program; `origin` is the machine that both sent and plays it, if known."""
        assert self.loaded is not None, "a program is loaded before it is played"
        self._main = self._begin(self.loaded.script, self.name or self.loaded.script.name, origin)
        self.state, self.line, self._failed = "PLAYING", 1, False
        self._runstate.tell(runs=True)
        self._missed_turns.clear()
        self.statements.open(self._main.machine)

    def play_beside(self, script: Script, origin: str | None) -> None:
        """Start a secondary program; `origin` as in `play`."""
        if sum(running is not self._main for running in self._all) >= MAX_BESIDE:
            why = f"{MAX_BESIDE} secondary programs are running: wait until one of them has ended"
            raise RefusalError("busy", "", why, MAX_BESIDE)
        self._begin(script, script.name, origin)

    def _begin(self, script: Script, name: str, origin: str | None) -> _Running:
        running = _Running(name, Machine(script, self._functions, finish=self.arm.finish), origin)
        self._all.append(running)
        self.idle = False
        self._emit("program_started", program=name, secondary=script.secondary or None)
        return running

    def go_on(self, tick: int) -> None:
        """Resume the paused program from this tick."""
        self._watchdogs.begin_anew(tick)
        self.state = "PLAYING"
        self._runstate.tell(runs=True)

    def hold(self) -> None:
        """Pause the program; planned motion pauses on its path, guided motion stops."""
        self._safety.stay_paused()
        if self._motion.activity is Activity.MOVING and self.arm.moves:
            self._motion.pause()
        elif self._motion.activity is Activity.GUIDED and self.arm.guides:
            self.arm.brake(lambda: self._motion.stop(None, "the program was paused"), wholly=True)
        self._wait()

    def _wait(self, *, failed: bool = False) -> None:
        """Pause the program; its threads get no turns from this tick on."""
        self.state = "PAUSED"
        self._runstate.tell(runs=False, failed=failed)
        if self._main is not None:
            self._find_line(self._main.machine)
            self._main.machine.hold()
