"""Commands that let the arm give way to forces."""

from typing import ClassVar

import numpy as np

from tvist_controller.commands.refusal import RefusalError
from tvist_controller.instruments.tool_forces import ToolForces
from tvist_controller.motion.force_control import ForceControl
from tvist_controller.planning.command_row import Call, Row
from tvist_controller.trajectory import ForceTask
from tvist_protocol import forces as m
from tvist_protocol.replies import Accepted, Reply
from tvist_protocol.transitions import Activity


class ForceCommands:
    """Handlers of these commands.

    Args:
        control: Begins and ends force mode.
        forces: The force at the tool.
    """

    def __init__(self, control: ForceControl, forces: ToolForces) -> None:
        self._control, self._forces = control, forces

    def _force_mode(self, call: Call[m.ForceMode]) -> Reply:
        command = call.command
        task = ForceTask(
            np.array(command.compliant, dtype=float),
            np.array(command.wrench, dtype=float),
            np.array(command.limits, dtype=float),
            command.damping,
            command.gain,
        )
        return Accepted(id=self._control.begin(task, command.frame or "base", command.frame_type))

    def _freedrive(self, call: Call[m.Freedrive]) -> Reply:
        return Accepted(id=self._control.free(np.array(call.command.free, dtype=float), call.command.frame))

    def _end(self, _: Call[m.EndForceMode]) -> None:
        if self._control.compliant is None:
            activity = self._control.guidance.motion.activity
            why = "neither force_mode nor freedrive is on"
            raise RefusalError("busy" if activity is Activity.GUIDED else "wrong_mode", "", why)
        self._control.end()

    def _zero(self, _: Call[m.ZeroFtsensor]) -> None:
        self._control.check_sensor()
        self._forces.zero()

    def _sense(self, call: Call[m.SetExternalWrench]) -> None:
        self._control.external.sense(np.array(call.command.wrench, dtype=float))

    rows: ClassVar[tuple[Row, ...]] = (
        Row(m.ForceMode, _force_mode),
        Row(m.Freedrive, _freedrive),
        Row(m.EndForceMode, _end, stops=True),
        Row(m.ZeroFtsensor, _zero, changes_io=True),
        Row(m.SetExternalWrench, _sense),
    )
