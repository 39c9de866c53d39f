"""Commands that move, guide, stop and power the arm, and force control."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from tvist_controller.dispatch.robot import RobotParts
from tvist_controller.line.differentiator import Floats
from tvist_controller.planning.move_planner import MovePlanner, PlannedMove
from tvist_controller.planning.path_planner import PathPlanner
from tvist_controller.planning.plan import CommandCall, CommandRow, Planning
from tvist_controller.planning.snapshot import MOTION
from tvist_controller.planning.trajectory_planner import TrajectoryPlanner, check_points
from tvist_controller.refusal import (
    SLOWEST,
    RefusalError,
    check_acceleration,
    check_joints,
    check_motion,
    check_pace,
    check_speeds,
)
from tvist_controller.trajectory import ForceTask, MotionLimits
from tvist_plant.description import RobotDescription
from tvist_protocol import commands as c
from tvist_protocol import forces as f
from tvist_protocol import motions as m
from tvist_protocol.channels import tag
from tvist_protocol.replies import Accepted, Code, Reply
from tvist_protocol.transitions import Activity

_STRAIGHT = Planning(MOTION, MovePlanner, MovePlanner.move, partial(MovePlanner.move, at_once=True))
_ALONG_PATH = Planning(MOTION, PathPlanner, PathPlanner.plan)
_THROUGH_POINTS = Planning(MOTION, TrajectoryPlanner, TrajectoryPlanner.plan)


def _check_limits(command: c.MoveJ | c.ServoStart, description: RobotDescription) -> None:
    check_motion(command.velocity, command.acceleration, command.jerk, description)


def _check_move(command: c.MoveJ, description: RobotDescription) -> None:
    check_joints(command.q, description)
    _check_limits(command, description)


def _check_tool_move(command: m.MoveL | m.MoveC, _: RobotDescription) -> None:
    check_pace(command.velocity, command.acceleration, command.jerk)


def _check_path(command: m.MovePath, description: RobotDescription) -> None:
    for number, segment in enumerate(command.segments):
        where = f"segments[{number}]."
        if isinstance(segment, m.JointSegment):
            check_joints(segment.q, description, f"{where}q")
            check_motion(
                segment.velocity, segment.acceleration, min(description.limits.jerk), description, where
            )
        else:
            check_pace(segment.velocity, segment.acceleration, command.jerk, where)
    check_pace(SLOWEST["velocity"], SLOWEST["acceleration"], command.jerk)


def _move(robot: RobotParts, call: CommandCall[Any]) -> Reply:
    robot.motion.check(tag(type(call.command)))
    planned: PlannedMove = call.planned()
    limited = None if planned.limited is None else planned.limited[1]
    return Accepted(id=robot.motion.move(planned), limited=limited)


def _servo_start(robot: RobotParts, call: CommandCall[c.ServoStart]) -> None:
    command = call.command
    limits = MotionLimits(command.velocity, command.acceleration, command.jerk)
    robot.motion.follow(command.period, limits, call.now)


def _stop(robot: RobotParts, call: CommandCall[c.Stop]) -> None:
    why = "a stop was commanded"
    robot.programs.stop_moving(why)
    robot.motion.stop(call.command.deceleration, why)


def _pause(robot: RobotParts, _: CommandCall[c.Pause]) -> None:
    robot.motion.pause()
    robot.safety.stay_paused()


def _power_off(robot: RobotParts, _: CommandCall[c.PowerOff]) -> None:
    why = "power_off was commanded"
    robot.programs.end(why)
    robot.motion.end("power_off", why, category=1)


# ---------------------------------------------------------------------- guided motions and force control


def _check_speed(command: m.SpeedJ, description: RobotDescription) -> None:
    check_speeds(command.qd, description)
    check_acceleration(command.acceleration, description)


def _begun(begin: Callable[[RobotParts, Any], int]) -> Callable[[RobotParts, CommandCall[Any]], Reply]:
    """Return the handler of a command that begins a motion; its reply contains the motion's number."""
    return lambda robot, call: Accepted(id=begin(robot, call.command))


def _floats(values: Sequence[float]) -> Floats:
    return np.array(values, dtype=float)


def _servo_j(robot: RobotParts, command: m.ServoJ) -> int:
    return robot.guidance.servo(_floats(command.q), command.lookahead, command.gain, shaped=command.shaped)


def _speed_j(robot: RobotParts, command: m.SpeedJ) -> int:
    return robot.guidance.move_joints(_floats(command.qd), command.acceleration, shaped=command.shaped)


def _speed_l(robot: RobotParts, command: m.SpeedL) -> int:
    return robot.guidance.move_tool(_floats(command.xd), *_accelerations(command), shaped=command.shaped)


def _accelerations(command: m.SpeedL | m.StopL) -> tuple[float, float]:
    angular = command.angular_acceleration
    return command.acceleration, command.acceleration if angular is None else angular


def _stop_j(robot: RobotParts, call: CommandCall[m.StopJ]) -> None:
    robot.programs.stop_moving("stop_j was commanded")
    robot.guidance.stop_joints(call.command.acceleration)


def _stop_l(robot: RobotParts, call: CommandCall[m.StopL]) -> None:
    robot.programs.stop_moving("stop_l was commanded")
    robot.guidance.stop_tool(*_accelerations(call.command))


def _force_mode(robot: RobotParts, command: f.ForceMode) -> int:
    compliant, wrench, limits = map(_floats, (command.compliant, command.wrench, command.limits))
    task = ForceTask(compliant, wrench, limits, command.damping, command.gain)
    return robot.force_control.begin(task, command.frame or "base", command.frame_type)


def _end_force_mode(robot: RobotParts, _: CommandCall[f.EndForceMode]) -> None:
    if robot.guidance.compliant is None:
        code: Code = "busy" if robot.motion.activity is Activity.GUIDED else "wrong_mode"
        raise RefusalError(code, "", "neither force_mode nor freedrive is on: there is nothing to end")
    robot.force_control.end()


def _zero(robot: RobotParts, _: CommandCall[f.ZeroFtsensor]) -> None:
    robot.force_control.check_sensor()
    robot.forces.zero()


ROWS: tuple[CommandRow, ...] = (
    CommandRow(c.MoveJ, _move, check=_check_move, plan=_STRAIGHT),
    CommandRow(m.MoveL, _move, check=_check_tool_move, plan=_ALONG_PATH),
    CommandRow(m.MoveC, _move, check=_check_tool_move, plan=_ALONG_PATH),
    CommandRow(m.MovePath, _move, check=_check_path, plan=_ALONG_PATH, long=True),
    CommandRow(m.MoveTrajectory, _move, check=check_points, plan=_THROUGH_POINTS, long=True),
    CommandRow(c.ServoStart, _servo_start, check=_check_limits),
    CommandRow(c.ServoStop, lambda robot, _: robot.motion.end_stream()),
    CommandRow(c.Stop, _stop, lease="if named", stops=True),
    CommandRow(c.Pause, _pause),
    CommandRow(c.Resume, lambda robot, _: robot.motion.resume()),
    CommandRow(
        c.SetSpeed, lambda robot, call: robot.motion.motions.set_speed(call.command.fraction), changes_io=True
    ),
    CommandRow(
        c.PowerOn, lambda robot, call: robot.safety.power_on(release_brakes=call.command.release_brakes)
    ),
    CommandRow(c.PowerOff, _power_off, stops=True),
    CommandRow(c.UnlockProtectiveStop, lambda robot, _: robot.safety.unlock()),
    CommandRow(c.RestartSafety, lambda robot, _: robot.motion.safety.restart()),
    CommandRow(
        m.ServoJ, _begun(_servo_j), check=lambda command, description: check_joints(command.q, description)
    ),
    CommandRow(m.SpeedJ, _begun(_speed_j), check=_check_speed),
    CommandRow(m.SpeedL, _begun(_speed_l)),
    CommandRow(m.StopJ, _stop_j, stops=True),
    CommandRow(m.StopL, _stop_l, stops=True),
    CommandRow(f.ForceMode, _begun(_force_mode)),
    CommandRow(
        f.Freedrive,
        _begun(lambda robot, command: robot.force_control.free(_floats(command.free), command.frame)),
    ),
    CommandRow(f.EndForceMode, _end_force_mode, stops=True),
    CommandRow(f.ZeroFtsensor, _zero, changes_io=True),
    CommandRow(
        f.SetExternalWrench,
        lambda robot, call: robot.force_control.external.sense(_floats(call.command.wrench)),
    ),
)
