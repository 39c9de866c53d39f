"""Parts of a path as they were asked for, from one point to the next without blends, and where two blends meet on one.

Between points so close that next to nothing of a line is left between two blends, curvature that rises from 0 and falls
back to 0 at each of these points would be what slows the arm down. So the blends on both sides of such a line are drawn
out to meet on it, with one curvature for both, and the tool leaves the line by at most `OFF`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from tvist_controller.paths.poses import Placement
from tvist_controller.paths.tool_curves import PER_RADIAN, ToolLine, ToolWay
from tvist_controller.trajectory.limits import Floats
from tvist_controller.trajectory.spline import Knots

LOOKS, HALVINGS = 64, 40
"""Places of a way at which its distance from an end is looked at, and halvings of the step in which it passes one."""
OFF = 1e-5
"""Largest distance from a line where two blends meet on it, outside their radii [m]."""
SHALLOW = 0.3
"""Largest turn of the tool's way at a corner next to such a line [rad]."""
STEEPER = 1.5
"""Largest ratio of the curvature where two blends meet to the smaller one of both [-]."""


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


class Meeting(NamedTuple):
    """Place of a leg at which the blends before and behind it meet."""

    s: float
    """Length from the leg's start [m]."""
    bend: Floats
    """Second derivatives of the tool's position and turn there, shape (6,) [1/m, rad/m^2]."""


def meetings(legs: Sequence[Leg]) -> list[Meeting | None]:
    """Return for each leg where the blends before and behind it meet, if they do."""
    corners = [_corner(*pair) for pair in pairwise(legs)]
    found: list[Meeting | None] = [None] * len(legs)
    for number in range(1, len(legs) - 1):
        before, behind = corners[number - 1], corners[number]
        if before is not None and behind is not None:
            found[number] = _meeting(legs[number], legs[number - 1].blend, before, behind)
    return found


def _corner(leg: Leg, then: Leg) -> Floats | None:
    """Mean curvature of the way around a corner, shape (6,); None if it is no shallow one between two lines."""
    if not (isinstance(leg.way, ToolLine) and isinstance(then.way, ToolLine) and leg.blend > 0.0):
        return None
    change = then.way.first - leg.way.first
    if _size(change) > SHALLOW:
        return None
    bend: Floats = 2.0 * change / (leg.way.length + then.way.length)
    return bend


def _meeting(leg: Leg, blend: float, before: Floats, behind: Floats) -> Meeting | None:
    assert isinstance(leg.way, ToolLine)
    way = leg.way
    start, end = way.within(blend), way.length - way.within(leg.blend)
    gap = end - start
    if not 0.0 <= gap < np.inf or max(_size(before), _size(behind)) * gap**2 > 8.0 * OFF:
        return None
    bend = np.concatenate([_between(before[part], behind[part]) for part in (slice(3), slice(3, 6))])
    along = way.first[:3]
    speed = float(along @ along)
    if speed > 0.0:  # the way is curved there, and not hurried
        bend[:3] -= (bend[:3] @ along / speed) * along
    return Meeting(0.5 * (start + end), bend)


def _between(one: Floats, other: Floats) -> Floats:
    """Curvature between two: their mean, or less if it would exceed the smaller one by far; 0 if they turn apart."""
    if one @ other <= 0.0:
        return np.zeros_like(one)
    mean = 0.5 * (one + other)
    most = STEEPER * min(float(np.linalg.norm(one)), float(np.linalg.norm(other)))
    found: Floats = mean * min(most / float(np.linalg.norm(mean)), 1.0)
    return found


def _size(change: Floats) -> float:
    return max(float(np.linalg.norm(change[:3])), PER_RADIAN * float(np.linalg.norm(change[3:])))
