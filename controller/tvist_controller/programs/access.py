"""What the functions of programs may use of the robot."""

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
"""Token in the commands that a program makes, which are not sent to clients."""


@contextmanager
def refusals_as_faults() -> Iterator[None]:
    """End the program with an error where the robot refuses what it asks for."""
    try:
        yield
    except RefusalError as refusal:
        raise Fault(refusal.reply.why) from refusal


@dataclass(frozen=True)
class Access:
    """One robot, as its programs reach it."""

    description: RobotDescription
    motion: MotionControl
    guidance: Guidance
    peripherals: Peripherals
    emit: Emit
    send: Callable[[Command, Plan | None], Reply | None]
    """Carries out a command, with a plan that was made before or without one; raises `RefusalError`."""
    plans: Plans
    """The way to plans."""
    latest: Callable[[], State]
    """State of the last tick."""
    io: Callable[[], Io]
    """Terminals, registers and settings, as published."""
    declared: Callable[[], Payload]
    """Declared payload."""
    force: ForceControl
    """Force mode, freedrive and contacts."""
    forces: ToolForces
    """Forces and torques on the arm in the last tick."""
    shape_guided: bool = False
    """Whether guided motions of programs that begin at rest are shaped."""
    cell: LiveCell | None = None
    """What stands around the robot; None for nothing."""
