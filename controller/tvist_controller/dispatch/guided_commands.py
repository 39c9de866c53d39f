"""Commands that guide the arm, those that let it give way to forces, and the stops of URScript."""

from typing import ClassVar

import numpy as np

from tvist_controller.commands.refusal import RefusalError, check_acceleration, check_joints, check_speeds
from tvist_controller.instruments.tool_forces import ToolForces
from tvist_controller.motion.force_control import ForceControl
from tvist_controller.motion.guidance import Guidance
from tvist_controller.planning.command_row import Call, Row
from tvist_controller.programs.player import ProgramPlayer
from tvist_controller.trajectory import ForceTask
from tvist_plant.description import RobotDescription
from tvist_protocol import forces as f
from tvist_protocol import motions as m
from tvist_protocol.replies import Accepted, Reply
from tvist_protocol.transitions import Activity


def _check_speed(command: m.SpeedJ, description: RobotDescription) -> None:
    check_speeds(command.qd, description)
    check_acceleration(command.acceleration, description)


class GuidedCommands:
    """Handlers of the commands for guided motions."""

    def __init__(self, guidance: Guidance, programs: ProgramPlayer) -> None:
        self._guidance, self._programs = guidance, programs

    def _servo_j(self, call: Call[m.ServoJ]) -> Reply:
        command = call.command
        q = np.array(command.q, dtype=float)
        number = self._guidance.servo(q, command.lookahead, command.gain, shaped=command.shaped)
        return Accepted(id=number)

    def _speed_j(self, call: Call[m.SpeedJ]) -> Reply:
        command = call.command
        qd = np.array(command.qd, dtype=float)
        return Accepted(id=self._guidance.move_joints(qd, command.acceleration, shaped=command.shaped))

    def _speed_l(self, call: Call[m.SpeedL]) -> Reply:
        command = call.command
        twist = np.array(command.xd, dtype=float)
        accelerations = _accelerations(command)
        return Accepted(id=self._guidance.move_tool(twist, *accelerations, shaped=command.shaped))

    def _stop_j(self, call: Call[m.StopJ]) -> None:
        self._programs.stop_moving("stop_j was commanded")
        self._guidance.stop_joints(call.command.acceleration)

    def _stop_l(self, call: Call[m.StopL]) -> None:
        self._programs.stop_moving("stop_l was commanded")
        self._guidance.stop_tool(*_accelerations(call.command))

    rows: ClassVar[tuple[Row, ...]] = (
        Row(m.ServoJ, _servo_j, check=lambda command, description: check_joints(command.q, description)),
        Row(m.SpeedJ, _speed_j, check=_check_speed),
        Row(m.SpeedL, _speed_l),
        Row(m.StopJ, _stop_j, stops=True),
        Row(m.StopL, _stop_l, stops=True),
    )


def _accelerations(command: m.SpeedL | m.StopL) -> tuple[float, float]:
    """Acceleration [m/s^2] and angular acceleration [rad/s^2] of the tool."""
    angular = command.angular_acceleration
    return command.acceleration, command.acceleration if angular is None else angular


class ForceCommands:
    """Handlers of these commands."""

    def __init__(self, control: ForceControl, forces: ToolForces) -> None:
        self._control, self._forces = control, forces

    def _force_mode(self, call: Call[f.ForceMode]) -> Reply:
        command = call.command
        task = ForceTask(
            np.array(command.compliant, dtype=float),
            np.array(command.wrench, dtype=float),
            np.array(command.limits, dtype=float),
            command.damping,
            command.gain,
        )
        return Accepted(id=self._control.begin(task, command.frame or "base", command.frame_type))

    def _freedrive(self, call: Call[f.Freedrive]) -> Reply:
        return Accepted(id=self._control.free(np.array(call.command.free, dtype=float), call.command.frame))

    def _end(self, _: Call[f.EndForceMode]) -> None:
        if self._control.compliant is None:
            activity = self._control.guidance.motion.activity
            why = "neither force_mode nor freedrive is on"
            raise RefusalError("busy" if activity is Activity.GUIDED else "wrong_mode", "", why)
        self._control.end()

    def _zero(self, _: Call[f.ZeroFtsensor]) -> None:
        self._control.check_sensor()
        self._forces.zero()

    def _sense(self, call: Call[f.SetExternalWrench]) -> None:
        self._control.external.sense(np.array(call.command.wrench, dtype=float))

    rows: ClassVar[tuple[Row, ...]] = (
        Row(f.ForceMode, _force_mode),
        Row(f.Freedrive, _freedrive),
        Row(f.EndForceMode, _end, stops=True),
        Row(f.ZeroFtsensor, _zero, changes_io=True),
        Row(f.SetExternalWrench, _sense),
    )
