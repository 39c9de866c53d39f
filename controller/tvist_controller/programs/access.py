"""The robot's interface for functions of programs."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from tvist_controller.cell.live_cell import LiveCell
from tvist_controller.events import Emit
from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.instruments.tool_forces import ToolForces
from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.motion.force_control import ForceControl
from tvist_controller.motion.guidance import Guidance
from tvist_controller.planning.plan import Plan, Plans
from tvist_controller.refusal import RefusalError
from tvist_plant.description import RobotDescription
from tvist_protocol.commands import Command
from tvist_protocol.io import Io
from tvist_protocol.replies import Reply
from tvist_protocol.stream import State
from tvist_protocol.values import Payload
from tvist_urscript import Fault

OWN_TOKEN = "program"  # noqa: S105  the lease was checked when the program was played
"""Token in commands of programs; it is never sent to clients."""


@contextmanager
def refusals_as_faults() -> Iterator[None]:
    """End the program with an error if the robot refuses a command."""
    try:
        yield
    except RefusalError as refusal:
        raise Fault(refusal.reply.why) from refusal


@dataclass(frozen=True)
class Access:
    """One robot as its programs access it."""

    description: RobotDescription
    motion: MotionControl
    guidance: Guidance
    peripherals: Peripherals
    emit: Emit
    send: Callable[[Command, Plan | None], Reply | None]
    """Carries out a command, optionally with an existing plan; raises `RefusalError`."""
    plans: Plans  # access to plans
    latest: Callable[[], State]  # state of the last tick
    io: Callable[[], Io]  # terminals, registers and settings, as published
    declared: Callable[[], Payload]  # declared payload
    force: ForceControl  # force mode, freedrive and contacts
    forces: ToolForces  # forces and torques on the arm in the last tick
    shape_guided: bool = False  # whether guided motions of programs that start at rest are shaped
    cell: LiveCell | None = None  # the cell around the robot; None for none
