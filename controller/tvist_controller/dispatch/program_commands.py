"""Commands that load, play, pause and stop programs, and that add statements to one."""

from typing import ClassVar

from tvist_controller.commands.refusal import RefusalError, out_of_turn
from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.planning.command_row import Call, Row
from tvist_controller.planning.plan import Planning
from tvist_controller.planning.snapshot import SCRIPT
from tvist_controller.programs.compiling import ScriptCompiler
from tvist_controller.programs.kept import Kept
from tvist_controller.programs.player import ProgramPlayer
from tvist_protocol import programs as p
from tvist_protocol.modes import RobotMode
from tvist_protocol.replies import Accepted
from tvist_protocol.transitions import Activity

_COMPILED = Planning((), ScriptCompiler, lambda compiler, command, _: compiler.compile(command))
_COMPILED_AFTER = Planning(
    SCRIPT,
    ScriptCompiler,
    lambda compiler, command, now: compiler.compile_statement(command.text, now.script),
)


class ProgramCommands:
    """Handlers of the commands for programs.

    Args:
        programs: Carries them out.
        motion: The robot's motion.
    """

    def __init__(self, programs: ProgramPlayer, motion: MotionControl) -> None:
        self._programs, self._motion = programs, motion

    def _load(self, call: Call[p.ProgramLoad]) -> None:
        name, script, kept = call.command.name, call.planned(), self._programs.kept
        if call.command.text is not None:
            kept.keep(name, Kept(script, call.origin))
        loaded = kept.find(name) if script is None else Kept(script, call.origin)
        self._programs.load(name, loaded, "another program was loaded")

    def _run(self, call: Call[p.ProgramRun]) -> None:
        script = call.planned()
        self._check_power("program.run")
        if script.secondary:
            self._programs.play_beside(script, call.origin)
        else:
            self._programs.load(script.name, Kept(script, call.origin), "another program was started")
            self._programs.play(call.origin)

    def _play(self, call: Call[p.ProgramPlay]) -> None:
        programs, motion = self._programs, self._motion
        if programs.loaded is None:
            raise RefusalError("wrong_mode", "", "no program is loaded: send program.load first")
        if programs.state == "PLAYING":
            raise RefusalError("busy", "", f"program {programs.name} is playing")
        if programs.state == "PAUSED" and motion.activity is Activity.PAUSED:
            motion.resume()
        else:
            motion.check("move_j")
        if programs.state == "PAUSED":
            programs.go_on(call.tick)
        else:
            # Whoever plays a program does not lend it what only their own programs may reach.
            programs.play(call.origin if call.origin == programs.loaded.origin else None)

    def _pause(self, _: Call[p.ProgramPause]) -> None:
        if self._programs.state != "PLAYING":
            raise RefusalError("wrong_mode", "", "no program is playing: there is nothing to pause")
        self._programs.hold()

    def _stop(self, _: Call[p.ProgramStop]) -> None:
        why = "the program was stopped"
        self._programs.end(why)
        self._motion.stop(None, why)

    def _close_popup(self, _: Call[p.ProgramClosePopup]) -> None:
        self._programs.popups.dismiss()

    def _interpret(self, call: Call[p.ProgramInterpret]) -> Accepted:
        return Accepted(id=self._programs.statements.interpret(call.planned()))

    def _skip(self, call: Call[p.ProgramSkip]) -> None:
        self._programs.statements.skip(call.command.what)

    def _check_power(self, command: str) -> None:
        """Refuse to start a program where the arm has no power or is in a protective stop."""
        activity = self._motion.activity
        if activity.robot_mode is not RobotMode.RUNNING or activity.protective:
            raise out_of_turn(command, activity)
        self._motion.safety.check("move_j", activity)

    rows: ClassVar[tuple[Row, ...]] = (
        Row(p.ProgramLoad, _load, lease="if named", changes_io=True, plan=_COMPILED, long=True),
        Row(p.ProgramRun, _run, changes_io=True, plan=_COMPILED, long=True),
        Row(p.ProgramPlay, _play, changes_io=True),
        Row(p.ProgramPause, _pause, changes_io=True),
        Row(p.ProgramStop, _stop, lease="if named", changes_io=True, stops=True),
        Row(p.ProgramClosePopup, _close_popup, lease="none"),
        Row(p.ProgramInterpret, _interpret, changes_io=True, plan=_COMPILED_AFTER, long=True),
        Row(p.ProgramSkip, _skip, changes_io=True),
    )
