"""The table of commands: the rows of all parts of a robot, and what carries them out.

The rows are known without a robot, since admission and planning need them in other threads.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any, ClassVar, Protocol

from tvist_controller.authority.rights import Authority
from tvist_controller.commands.refusal import check_body, check_joints
from tvist_controller.dispatch.force_commands import ForceCommands
from tvist_controller.dispatch.guided_commands import GuidedCommands
from tvist_controller.dispatch.lessons import Lessons
from tvist_controller.dispatch.motion_commands import MotionCommands
from tvist_controller.dispatch.program_commands import ProgramCommands
from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.motion.filter_control import Filters
from tvist_controller.planning.command_row import Call, Row
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.planning.plan import Planning
from tvist_controller.planning.reachable import Reachable
from tvist_controller.planning.snapshot import FILTER, TOOL
from tvist_controller.safety.declared_payload import DeclaredPayload
from tvist_controller.safety.faults import Faults
from tvist_plant.description import RobotDescription
from tvist_protocol.commands import Command
from tvist_protocol.kinematics import ForwardKinematics, InverseKinematics
from tvist_protocol.replies import Reply
from tvist_protocol.simulation import SimulationReset, SimulationStep


def _check_reset(command: SimulationReset, description: RobotDescription) -> None:
    if command.q is not None:
        check_joints(command.q, description)
    if command.payload is not None:
        check_body(command.payload, "payload")


class Part(Protocol):
    """Part of a robot that carries out commands."""

    rows: ClassVar[tuple[Row, ...]]
    """Its commands."""


class WholeRobot(ABC):
    """Commands that concern all parts of a robot; the controller, which knows these, carries them out."""

    @abstractmethod
    def place(self, call: Call[SimulationReset]) -> Reply:
        """Place the simulated arm somewhere at rest."""

    @abstractmethod
    def check_step(self, call: Call[SimulationStep]) -> Reply:
        """Check that a client may advance time; the host then does so."""

    rows: ClassVar[tuple[Row, ...]] = (
        Row(
            SimulationReset,
            lambda self, call: self.place(call),
            check=_check_reset,
            plan=Planning(FILTER, FilterPlanner, lambda planner, command, now: None if command.shaper is None
                          else planner.choose(command.shaper, 1, now.filter.source, now.filter.declared)),
        ),
        Row(SimulationStep, lambda self, call: self.check_step(call), lease="none", long=True),
        Row(InverseKinematics, lambda _, call: call.planned(), lease="none",
            plan=Planning(TOOL, Reachable, Reachable.posture)),
        Row(ForwardKinematics, lambda _, call: call.planned(), lease="none",
            plan=Planning(TOOL, Reachable, Reachable.pose)),
    )  # fmt: skip


_PARTS: tuple[type[Part], ...] = (
    Authority, MotionCommands, GuidedCommands, ForceCommands, Filters, DeclaredPayload, Peripherals, Faults, Lessons,
    ProgramCommands, WholeRobot,
)  # fmt: skip
COMMANDS: dict[type[Command], Row] = {row.message: row for part in _PARTS for row in part.rows}
"""The row of each command."""
HARMLESS: frozenset[type[Command]] = frozenset(
    row.message
    for part in (Authority, Filters, WholeRobot)
    for row in part.rows
    if part is not WholeRobot or row.asks
)
"""Commands that do not concern the arm, so that a robot that is only watched takes them."""


class CommandTable:
    """Carries out the commands of one robot.

    Args:
        parts: Its parts, one of each kind that has commands.
        description: The robot.
    """

    def __init__(self, parts: Iterable[Part], description: RobotDescription) -> None:
        self._description = description
        self._parts = {row.message: part for part in parts for row in part.rows}

    def carry_out(self, call: Call[Any]) -> Reply | None:
        """Carry out a command between two ticks; return None if its reply is `Done`.

        Raises:
            RefusalError: It cannot be carried out, and has changed nothing.
            NoControlError: Its sender may not send it.
        """
        row = COMMANDS[type(call.command)]
        if row.check is not None:
            row.check(call.command, self._description)
        return row.handle(self._parts[row.message], call)
