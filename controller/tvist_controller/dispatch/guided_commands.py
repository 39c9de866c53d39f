"""Commands that guide the arm, those that let it give way to forces, and the stops of URScript."""

import numpy as np

from tvist_controller.dispatch.robot import Robot
from tvist_controller.planning.command_row import Call, Row
from tvist_controller.refusal import RefusalError, check_acceleration, check_joints, check_speeds
from tvist_controller.trajectory import ForceTask
from tvist_plant.description import RobotDescription
from tvist_protocol import forces as f
from tvist_protocol import motions as m
from tvist_protocol.replies import Accepted, Reply
from tvist_protocol.transitions import Activity


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
    """Acceleration [m/s^2] and angular acceleration [rad/s^2] of the tool."""
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
    if robot.force_control.compliant is None:
        why = "neither force_mode nor freedrive is on"
        guided = robot.motion.activity is Activity.GUIDED
        raise RefusalError("busy" if guided else "wrong_mode", "", why)
    robot.force_control.end()


def _zero(robot: Robot, _: Call[f.ZeroFtsensor]) -> None:
    robot.force_control.check_sensor()
    robot.forces.zero()


ROWS: tuple[Row, ...] = (
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
"""The commands."""
