"""Commands that move, guide, stop and power the arm, and force control."""

from functools import partial
from typing import Any

import numpy as np

from tvist_controller.dispatch.robot import Robot
from tvist_controller.planning.command_row import Call, Row
from tvist_controller.planning.move_planner import MovePlanner, PlannedMove
from tvist_controller.planning.path_planner import PathPlanner
from tvist_controller.planning.plan import Planning
from tvist_controller.planning.snapshot import MOTION
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
from tvist_protocol.motions import JointSegment, MoveC, MoveL, MovePath
from tvist_protocol.replies import Accepted, Reply
from tvist_protocol.transitions import Activity

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


# ---------------------------------------------------------------------- guided motions and force control


def _check_speed(command: m.SpeedJ, description: RobotDescription) -> None:
    check_speeds(command.qd, description)
    check_acceleration(command.acceleration, description)


def _servo_j(robot: Robot, call: Call[m.ServoJ]) -> Reply:
    command = call.command
    q = np.array(command.q, dtype=float)
    return Accepted(id=robot.guidance.servo(q, command.lookahead, command.gain, shaped=command.shaped))


def _speed_j(robot: Robot, call: Call[m.SpeedJ]) -> Reply:
    command = call.command
    qd = np.array(command.qd, dtype=float)
    return Accepted(id=robot.guidance.move_joints(qd, command.acceleration, shaped=command.shaped))


def _speed_l(robot: Robot, call: Call[m.SpeedL]) -> Reply:
    command = call.command
    twist = np.array(command.xd, dtype=float)
    return Accepted(id=robot.guidance.move_tool(twist, *_accelerations(command), shaped=command.shaped))


def _accelerations(command: m.SpeedL | m.StopL) -> tuple[float, float]:
    angular = command.angular_acceleration
    return command.acceleration, command.acceleration if angular is None else angular


def _stop_j(robot: Robot, call: Call[m.StopJ]) -> None:
    robot.programs.stop_moving("stop_j was commanded")
    robot.guidance.stop_joints(call.command.acceleration)


def _stop_l(robot: Robot, call: Call[m.StopL]) -> None:
    robot.programs.stop_moving("stop_l was commanded")
    robot.guidance.stop_tool(*_accelerations(call.command))


def _force_mode(robot: Robot, call: Call[f.ForceMode]) -> Reply:
    command = call.command
    compliant, wrench, limits = (
        np.array(value, dtype=float) for value in (command.compliant, command.wrench, command.limits)
    )
    task = ForceTask(compliant, wrench, limits, command.damping, command.gain)
    return Accepted(id=robot.force_control.begin(task, command.frame or "base", command.frame_type))


def _freedrive(robot: Robot, call: Call[f.Freedrive]) -> Reply:
    return Accepted(id=robot.force_control.free(np.array(call.command.free, dtype=float), call.command.frame))


def _end_force_mode(robot: Robot, _: Call[f.EndForceMode]) -> None:
    if robot.guidance.compliant is None:
        why = "neither force_mode nor freedrive is on"
        guided = robot.motion.activity is Activity.GUIDED
        raise RefusalError("busy" if guided else "wrong_mode", "", why)
    robot.force_control.end()


def _zero(robot: Robot, _: Call[f.ZeroFtsensor]) -> None:
    robot.force_control.check_sensor()
    robot.forces.zero()


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
    Row(m.ServoJ, _servo_j, check=lambda command, description: check_joints(command.q, description)),
    Row(m.SpeedJ, _speed_j, check=_check_speed),
    Row(m.SpeedL, _speed_l),
    Row(m.StopJ, _stop_j, stops=True),
    Row(m.StopL, _stop_l, stops=True),
    Row(f.ForceMode, _force_mode),
    Row(f.Freedrive, _freedrive),
    Row(f.EndForceMode, _end_force_mode, stops=True),
    Row(f.ZeroFtsensor, _zero, changes_io=True),
    Row(
        f.SetExternalWrench,
        lambda robot, call: robot.force_control.external.sense(np.array(call.command.wrench, dtype=float)),
    ),
)
