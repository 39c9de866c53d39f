"""Commands that move, stop and power the arm."""

from typing import Any

from tvist_controller.dispatch.robot import Robot
from tvist_controller.planning.command_row import Call, Row
from tvist_controller.planning.move_planner import MovePlanner, PlannedMove
from tvist_controller.planning.path_planner import PathPlanner
from tvist_controller.planning.plan import Planning
from tvist_controller.planning.snapshot import MOTION
from tvist_controller.refusal import SLOWEST, check_joints, check_motion, check_pace
from tvist_controller.trajectory import MotionLimits
from tvist_plant.description import RobotDescription
from tvist_protocol import commands as c
from tvist_protocol.channels import tag
from tvist_protocol.motions import JointSegment, MoveC, MoveL, MovePath
from tvist_protocol.replies import Accepted, Reply

_STRAIGHT = Planning(MOTION, MovePlanner, MovePlanner.move, MovePlanner.move_within_tick)
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


def _move(robot: Robot, call: Call[Any]) -> Reply:
    robot.motion.check(tag(type(call.command)))
    planned: PlannedMove = call.planned()
    limited = None if planned.limited is None else planned.limited[1]
    return Accepted(id=robot.motion.move(planned), limited=limited)


def _servo_start(robot: Robot, call: Call[c.ServoStart]) -> None:
    command = call.command
    limits = MotionLimits(command.velocity, command.acceleration, command.jerk)
    robot.motion.follow(command.period, limits, call.now)


def _stop(robot: Robot, call: Call[c.Stop]) -> None:
    why = "a stop was commanded"
    robot.programs.stop_moving(why)
    robot.motion.stop(call.command.deceleration, why)


def _pause(robot: Robot, _: Call[c.Pause]) -> None:
    robot.motion.pause()
    robot.safety.stay_paused()


def _power_off(robot: Robot, _: Call[c.PowerOff]) -> None:
    why = "power_off was commanded"
    robot.programs.end(why)
    robot.motion.end("power_off", why, category=1)


ROWS: tuple[Row, ...] = (
    Row(c.MoveJ, _move, check=_check_move, plan=_STRAIGHT),
    Row(MoveL, _move, check=_check_tool_move, plan=_ALONG_PATH),
    Row(MoveC, _move, check=_check_tool_move, plan=_ALONG_PATH),
    Row(MovePath, _move, check=_check_path, plan=_ALONG_PATH, long=True),
    Row(c.ServoStart, _servo_start, check=_check_limits),
    Row(c.ServoStop, lambda robot, _: robot.motion.end_stream()),
    Row(c.Stop, _stop, lease="if named", stops=True),
    Row(c.Pause, _pause),
    Row(c.Resume, lambda robot, _: robot.motion.resume()),
    Row(
        c.SetSpeed,
        lambda robot, call: robot.motion.motions.set_speed(call.command.fraction),
        changes_io=True,
    ),
    Row(c.PowerOn, lambda robot, call: robot.safety.power_on(release_brakes=call.command.release_brakes)),
    Row(c.PowerOff, _power_off, stops=True),
    Row(c.UnlockProtectiveStop, lambda robot, _: robot.safety.unlock()),
    Row(c.RestartSafety, lambda robot, _: robot.motion.safety.restart()),
)
"""The commands."""
