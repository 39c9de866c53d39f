"""The state between two ticks that plans depend on."""

from typing import NamedTuple

from msgspec import Struct

from tvist_controller.line.differentiator import Floats
from tvist_controller.planning.course import Course
from tvist_controller.sources.mode_source import ModeSource
from tvist_plant.description import Payload as Body
from tvist_protocol.values import Payload
from tvist_urscript import Script


class FilterState(NamedTuple):
    """The state that a new filter depends on."""

    name: str
    """Name of the present filter."""
    modes: int
    """Number of modes that it uses."""
    source: ModeSource
    """Source of the modes."""
    declared: Payload
    """Payload that its modes are computed with."""
    given: Payload
    """Payload that a client has declared: another one if the robot has found out what it carries."""


class Snapshot(Struct, frozen=True, eq=False, gc=False):
    """The state that any plan depends on."""

    filter: FilterState
    movable: bool
    """Whether a planned motion may begin, or go on from the running one."""
    q: Floats
    """Joint angles of the present reference, or of the end that a motion goes on from, shape (n,) [rad]."""
    speed: float
    """Programmed speed fraction [-]."""
    slowest: float | None
    """Velocity limit of reduced speed [rad/s]; None if the speed is not reduced."""
    excess: float
    """Share by which the filter may exceed the reference's acceleration, see `Filter.excess` [-]."""
    surplus: tuple[float, float]
    """Shares by which it may exceed velocity and acceleration at the arm's limits, see `Filter.surplus` [-]."""
    tcp: tuple[float, ...]
    """Tool centre point in the flange frame: x y z [m] and rotation vector [rad]."""
    body: Body
    """Payload in the collision model."""
    bodies: tuple[Floats, ...]
    """Possible inertial parameters of the last link, see `InverseDynamics.bodies`."""
    after: Course | None = None
    """The running motion that it goes on from; None for a motion from rest."""
    until: float = 0.0
    """Time of that motion up to which it stays the same [s]."""
    script: Script | None = None
    """The program, or the last statement that was added to it; None if no program takes statements."""


FILTER = ("filter",)
"""Fields that a filter depends on."""
MOTION = ("movable", "q", "speed", "slowest", "excess", "surplus", "tcp", "body", "bodies", "filter", "after")
"""Fields that a motion depends on."""
TOOL = ("tcp",)
"""Fields that an answer about the tool depends on: it may be about a reference that has passed meanwhile."""
SCRIPT = ("script",)
"""Fields that a statement for a running program depends on."""
