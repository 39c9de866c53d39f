"""Commands that move, stop and power the arm."""

from functools import partial
from typing import Any, ClassVar

from tvist_controller.commands.refusal import SLOWEST, check_joints, check_motion, check_pace
from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.planning.command_row import Call, Row
from tvist_controller.planning.move_planner import MovePlanner, PlannedMove
from tvist_controller.planning.path_planner import PathPlanner
from tvist_controller.planning.plan import Planning
from tvist_controller.planning.snapshot import MOTION
from tvist_controller.programs.player import ProgramPlayer
from tvist_controller.safety.safety_control import SafetyControl
from tvist_controller.trajectory import MotionLimits
from tvist_plant.description import RobotDescription
from tvist_protocol import commands as c
from tvist_protocol.channels import tag
from tvist_protocol.motions import JointSegment, MoveC, MoveL, MovePath
from tvist_protocol.replies import Accepted, Reply

_STRAIGHT = Planning(MOTION, MovePlanner, MovePlanner.move, partial(MovePlanner.move, at_once=True))
_ALONG_PATH = Planning(MOTION, PathPlanner, PathPlanner.plan)


def _check_limits(command: c.MoveJ | c.ServoStart, description: RobotDescription) -> None:
    check_motion(command.velocity, command.acceleration, command.jerk, description)


def _check_move(command: c.MoveJ, description: RobotDescription) -> None:
    check_joints(command.q, description)
    _check_limits(command, description)


def _check_tool_move(command: MoveL | MoveC, _: RobotDescription) -> None:
    check_pace(command.velocity, command.acceleration, command.jerk)


def _check_path(command: MovePath, description: RobotDescription) -> None:
    for number, segment in enumerate(command.segments):
        where = f"segments[{number}]."
        if isinstance(segment, JointSegment):
            check_joints(segment.q, description, f"{where}q")
            check_motion(
                segment.velocity, segment.acceleration, min(description.limits.jerk), description, where
            )
        else:
            check_pace(segment.velocity, segment.acceleration, command.jerk, where)
    check_pace(SLOWEST["velocity"], SLOWEST["acceleration"], command.jerk)


class MotionCommands:
    """Handlers of the commands for motion."""

    def __init__(self, motion: MotionControl, safety: SafetyControl, programs: ProgramPlayer) -> None:
        self._motion, self._safety, self._programs = motion, safety, programs

    def _move(self, call: Call[Any]) -> Reply:
        self._motion.check(tag(type(call.command)))
        planned: PlannedMove = call.planned()
        limited = None if planned.limited is None else planned.limited[1]
        return Accepted(id=self._motion.move(planned), limited=limited)

    def _servo_start(self, call: Call[c.ServoStart]) -> None:
        command = call.command
        limits = MotionLimits(command.velocity, command.acceleration, command.jerk)
        self._motion.follow(command.period, limits, call.now)

    def _stop(self, call: Call[c.Stop]) -> None:
        why = "a stop was commanded"
        self._programs.stop_moving(why)
        self._motion.stop(call.command.deceleration, why)

    def _pause(self, _: Call[c.Pause]) -> None:
        self._motion.pause()
        self._safety.stay_paused()

    def _set_speed(self, call: Call[c.SetSpeed]) -> None:
        self._motion.motions.set_speed(call.command.fraction)

    def _power_on(self, call: Call[c.PowerOn]) -> None:
        self._safety.power_on(release_brakes=call.command.release_brakes)

    def _power_off(self, _: Call[c.PowerOff]) -> None:
        why = "power_off was commanded"
        self._programs.end(why)
        self._motion.end("power_off", why, category=1)

    rows: ClassVar[tuple[Row, ...]] = (
        Row(c.MoveJ, _move, check=_check_move, plan=_STRAIGHT),
        Row(MoveL, _move, check=_check_tool_move, plan=_ALONG_PATH),
        Row(MoveC, _move, check=_check_tool_move, plan=_ALONG_PATH),
        Row(MovePath, _move, check=_check_path, plan=_ALONG_PATH, long=True),
        Row(c.ServoStart, _servo_start, check=_check_limits),
        Row(c.ServoStop, lambda self, _: self._motion.end_stream()),
        Row(c.Stop, _stop, lease="if named", stops=True),
        Row(c.Pause, _pause),
        Row(c.Resume, lambda self, _: self._motion.resume()),
        Row(c.SetSpeed, _set_speed, changes_io=True),
        Row(c.PowerOn, _power_on),
        Row(c.PowerOff, _power_off, stops=True),
        Row(c.UnlockProtectiveStop, lambda self, _: self._safety.unlock()),
        Row(c.RestartSafety, lambda self, _: self._motion.safety.restart()),
    )
