"""The state between two ticks that plans depend on."""

from typing import NamedTuple

import numpy as np
from msgspec import Struct

from tvist_controller.line.differentiator import Floats
from tvist_controller.planning.course import Course
from tvist_controller.sources.mode_source import ModeSource
from tvist_plant.description import Payload as Body
from tvist_protocol.values import Payload
from tvist_urscript import Script


class FilterBasis(NamedTuple):
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


class MotionBasis(Struct, frozen=True, eq=False, gc=False):
    """The state that a point-to-point motion depends on; it exists only while such a motion may begin."""

    q: Floats
    """Joint angles at which the reference is at rest, shape (n,) [rad]."""
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
    declared_body: Body
    """Payload in the collision model."""
    bodies: tuple[Floats, ...]
    """Possible inertial parameters of the last link, see `InverseDynamics.bodies`."""
    filter: FilterBasis
    after: Course | None = None
    """The running motion that it goes on from; None for a motion from rest."""
    until: float = 0.0
    """Time of that motion up to which it stays the same [s]."""

    def agrees(self, other: "MotionBasis") -> bool:
        """Return whether a plan made on one basis holds on the other."""
        return (
            np.array_equal(self.q, other.q)
            and (self.speed, self.slowest, self.excess, self.surplus)
            == (other.speed, other.slowest, other.excess, other.surplus)
            and self.tcp == other.tcp
            and self.declared_body is other.declared_body
            and len(self.bodies) == len(other.bodies)
            and all(own is another for own, another in zip(self.bodies, other.bodies, strict=True))
            and self.filter == other.filter
            and self.after is other.after
            and self.until >= other.until
        )


class ToolBasis(NamedTuple):
    """The state that answers about the tool's kinematics depend on."""

    tcp: tuple[float, ...]
    """Tool centre point in the flange frame: x y z [m] and rotation vector [rad]."""
    q: Floats
    """The present reference, shape (n,) [rad]: an answer may be about one that has passed meanwhile."""


class ScriptBasis(NamedTuple):
    """The state that the text of a program depends on: none."""


class StatementBasis(NamedTuple):
    """The state that a statement for a running program depends on."""

    after: Script | None
    """The program, or the last statement that was added to it; None if no program takes statements."""


class PlanBasis(NamedTuple):
    """The state that any plan depends on."""

    filter: FilterBasis
    motion: MotionBasis | None
    """Basis of a planned motion; None while none may begin."""
    tool: ToolBasis
    statement: StatementBasis = StatementBasis(None)
    script: ScriptBasis = ScriptBasis()
