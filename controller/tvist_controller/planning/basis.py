"""What plans depend on, as it is between two ticks."""

from typing import NamedTuple

import numpy as np
from msgspec import Struct

from tvist_controller.control.differentiator import Floats
from tvist_controller.mode_source import ModeSource
from tvist_plant.description import Payload as Body
from tvist_protocol.values import Payload


class FilterBasis(NamedTuple):
    """What another filter depends on."""

    name: str
    """Name of the present filter."""
    modes: int
    """Number of modes that it uses."""
    source: ModeSource
    """Source of the modes."""
    declared: Payload
    """What the controller believes that the arm carries."""


class MotionBasis(Struct, frozen=True, eq=False, gc=False):
    """What a point-to-point motion depends on; there is one only while such a motion may begin."""

    q: Floats
    """Joint angles at which the reference rests, shape (n,) [rad]."""
    speed: float
    """Share of the programmed speed that was set [-]."""
    slowest: float | None
    """Velocity that reduced speed leaves [rad/s]; None where it is not reduced."""
    excess: float
    """By what share the filter may exceed the reference's acceleration, see `Filter.excess` [-]."""
    carried: Body
    """What the collision model counts on."""
    bodies: tuple[Floats, ...]
    """Inertial parameters of the last link that may be in force, see `InverseDynamics.bodies`."""
    filter: FilterBasis

    def agrees(self, other: "MotionBasis") -> bool:
        """Whether what was planned on one holds on the other."""
        return (
            np.array_equal(self.q, other.q)
            and (self.speed, self.slowest, self.excess) == (other.speed, other.slowest, other.excess)
            and self.carried is other.carried
            and len(self.bodies) == len(other.bodies)
            and all(own is another for own, another in zip(self.bodies, other.bodies, strict=True))
            and self.filter == other.filter
        )


class PlanBasis(NamedTuple):
    """What any plan depends on."""

    filter: FilterBasis
    motion: MotionBasis | None
    """None while no point-to-point motion may begin."""
