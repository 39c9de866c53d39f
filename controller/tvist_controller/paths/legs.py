"""Parts of a path as they were asked for: from one point to the next, without blends."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tvist_controller.paths.poses import Placement
from tvist_controller.paths.tool_curves import PER_RADIAN, ToolWay
from tvist_controller.trajectory.limits import Floats
from tvist_controller.trajectory.spline import Knots

LOOKS, HALVINGS = 64, 40
"""Places of a way at which its distance from an end is looked at, and halvings of the step in which it passes one."""


@dataclass(frozen=True)
class JointWay:
    """Straight way of the joints from one posture to another."""

    start: Floats
    """Joint positions at the start, shape (n,) [rad]."""
    end: Floats
    """Joint positions at the end, shape (n,) [rad]."""

    @property
    def length(self) -> float:
        """Its length [m]."""
        return PER_RADIAN * float(np.abs(self.end - self.start).max())

    def at(self, s: float) -> tuple[Floats, Floats, Floats]:
        """Return q, dq/ds and d²q/ds² at a length from the start [m], each of shape (n,)."""
        slope = (self.end - self.start) / self.length
        return self.start + s * slope, slope, np.zeros_like(slope)

    def within(self, radius: float, position_at: Callable[[Floats], Floats], *, from_end: bool) -> float:
        """Return the length from one end within which the tool is no farther from that end than a radius [m].

        `position_at` returns the position of the tool centre point at joint positions.
        """

        def at(s: float) -> Floats:
            return position_at(self.at(self.length - s if from_end else s)[0])

        corner, inner = at(0.0), 0.0
        for outer in np.linspace(0.0, self.length, LOOKS + 1)[1:].tolist():
            if np.linalg.norm(at(outer) - corner) >= radius:
                break
            inner = outer
        else:
            return np.inf
        for _ in range(HALVINGS):
            middle = 0.5 * (inner + outer)
            inner, outer = (
                (middle, outer) if np.linalg.norm(at(middle) - corner) < radius else (inner, middle)
            )
        return inner

    def part(self, start: float, end: float) -> Knots:
        """Return the part between two lengths [m]."""
        ends = [self.at(s) for s in (start, end)]
        return Knots(np.array([0.0, end - start]), *(np.array(pair) for pair in zip(*ends, strict=True)))


@dataclass(frozen=True)
class Pacing:
    """How fast a part of a path may be."""

    velocity: float
    """Largest speed [m/s]."""
    acceleration: float
    """Largest acceleration [m/s^2]."""
    duration: float | None = None
    """Duration instead of both [s]."""
    even: bool = False
    """Whether the speed of the tool stays the same in blends, so that only the joints limit their acceleration."""

    def meeting(self, other: "Pacing") -> "Pacing":
        """Return the pacing of a blend between two parts."""
        return replace(
            self,
            velocity=min(self.velocity, other.velocity),
            acceleration=min(self.acceleration, other.acceleration),
            even=self.even and other.even,
        )


@dataclass(frozen=True)
class Leg:
    """One part of a path, as it was asked for."""

    way: ToolWay | JointWay
    knots: Knots
    """The joints' way along all of it."""
    corner: Placement
    """Pose of the tool at its end."""
    pacing: Pacing
    blend: float
    """Radius of the blend at its end [m]."""
    where: str
    """Field of the command that it comes from, for messages."""

    @property
    def q(self) -> Floats:
        """Joint positions at its start, shape (n,) [rad]."""
        start: Floats = self.knots.q[0]
        return start
