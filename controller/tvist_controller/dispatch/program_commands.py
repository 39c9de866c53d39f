"""Commands that load, play, pause, stop and extend programs."""

from tvist_controller.dispatch.robot import RobotParts
from tvist_controller.planning.plan import CommandCall, CommandRow, Planning
from tvist_controller.planning.snapshot import SCRIPT
from tvist_controller.programs.compiling import ScriptCompiler, StoredProgram
from tvist_controller.refusal import RefusalError, out_of_turn, wrong_mode
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


def _load(robot: RobotParts, call: CommandCall[p.ProgramLoad]) -> None:
    name, script, kept = call.command.name, call.planned(), robot.programs.kept
    if call.command.text is not None:
        kept.keep(name, StoredProgram(script, call.origin))
    loaded = kept.find(name) if script is None else StoredProgram(script, call.origin)
    robot.programs.load(name, loaded, "another program was loaded")


def _run(robot: RobotParts, call: CommandCall[p.ProgramRun]) -> None:
    script, activity = call.planned(), robot.motion.activity
    if activity.robot_mode is not RobotMode.RUNNING or activity.protective:
        raise out_of_turn("program.run", activity)
    robot.motion.safety.check("move_j", activity)
    if script.secondary:
        robot.programs.play_beside(script, call.origin)
    else:
        robot.programs.load(script.name, StoredProgram(script, call.origin), "another program was started")
        robot.programs.play(call.origin)


def _play(robot: RobotParts, call: CommandCall[p.ProgramPlay]) -> None:
    programs, motion = robot.programs, robot.motion
    if programs.loaded is None:
        raise wrong_mode("no program is loaded: send program.load first")
    if programs.state == "PLAYING":
        raise RefusalError("busy", "", f"program {programs.name} is playing: stop it first")
    if programs.state == "PAUSED" and motion.activity is Activity.PAUSED:
        motion.resume()
    else:
        motion.check("move_j")
    if programs.state == "PAUSED":
        programs.go_on(call.tick)
    else:
        # If another machine plays the program than sent it, the program may reach neither.
        programs.play(call.origin if call.origin == programs.loaded.origin else None)


def _pause(robot: RobotParts, _: CommandCall[p.ProgramPause]) -> None:
    if robot.programs.state != "PLAYING":
        raise wrong_mode("no program is playing: there is nothing to pause")
    robot.programs.hold()


def _stop(robot: RobotParts, _: CommandCall[p.ProgramStop]) -> None:
    why = "the program was stopped"
    robot.programs.end(why)
    robot.motion.stop(None, why)


ROWS: tuple[CommandRow, ...] = (
    CommandRow(p.ProgramLoad, _load, lease="if named", changes_io=True, plan=_COMPILED, long=True),
    CommandRow(p.ProgramRun, _run, changes_io=True, plan=_COMPILED, long=True),
    CommandRow(p.ProgramPlay, _play, changes_io=True),
    CommandRow(p.ProgramPause, _pause, changes_io=True),
    CommandRow(p.ProgramStop, _stop, lease="if named", changes_io=True, stops=True),
    CommandRow(p.ProgramClosePopup, lambda robot, _: robot.programs.popups.close(), lease="none"),
    CommandRow(
        p.ProgramInterpret,
        lambda robot, call: Accepted(id=robot.programs.statements.interpret(call.planned())),
        changes_io=True,
        plan=_COMPILED_AFTER,
        long=True,
    ),
    CommandRow(
        p.ProgramSkip, lambda robot, call: robot.programs.statements.skip(call.command.what), changes_io=True
    ),
)
