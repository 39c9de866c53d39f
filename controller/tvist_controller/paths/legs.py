"""Requested parts of a path, without blends, and points where two blends meet.

If points are so close that almost no line is left between two blends, curvature that returns to 0 there would
slow the arm down. The adjacent blends are then extended to meet on the line with common curvature; the tool
leaves it by at most `OFF`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from tvist_controller.kinematics.pose import Placement
from tvist_controller.paths.tool_curves import PER_RADIAN, BlendableCurve, ToolLine
from tvist_controller.trajectory.base import Floats
from tvist_controller.trajectory.spline import Knots

LOOKS, HALVINGS = 64, 40
"""Places at which a distance from an end is checked, and bisections of the step in which it is exceeded."""
OFF = 1e-5  # largest deviation from a line where two blends meet, outside their radii [m]
SHALLOW = 0.3  # largest turn of the path at a corner whose blend may be extended to meet another [rad]
STEEPER = 1.5  # largest ratio of the curvature where two blends meet to the smaller one of the blends [-]


@dataclass(frozen=True)
class JointCurve:
    """Straight line in joint space."""

    start: Floats  # joint positions at the start, shape (n,) [rad]
    end: Floats  # joint positions at the end, shape (n,) [rad]

    @property
    def length(self) -> float:
        """Length [m]."""
        return PER_RADIAN * float(np.abs(self.end - self.start).max())

    def at(self, s: float) -> tuple[Floats, Floats, Floats]:
        """Return q, dq/ds and d²q/ds² at a length from the start [m], each of shape (n,)."""
        slope = (self.end - self.start) / self.length
        return self.start + s * slope, slope, np.zeros_like(slope)

    def within(self, radius: float, position_at: Callable[[Floats], Floats], *, from_end: bool) -> float:
        """Return the length from one end within which the tool stays within a radius of that end [m]."""

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
class LegSpeed:
    """Speed limits of a part of a path."""

    velocity: float  # largest speed [m/s]
    acceleration: float  # largest acceleration [m/s^2]
    duration: float | None = None  # duration that replaces both limits [s]
    even: bool = False  # whether blends keep the tool's speed, so that only the joints limit acceleration

    def meeting(self, other: "LegSpeed") -> "LegSpeed":
        """Return the speed limits of a blend between two parts."""
        return replace(
            self,
            velocity=min(self.velocity, other.velocity),
            acceleration=min(self.acceleration, other.acceleration),
            even=self.even and other.even,
        )


@dataclass(frozen=True)
class Leg:
    """One requested part of a path."""

    way: BlendableCurve | JointCurve
    knots: Knots  # the joints' motion along the whole part
    corner: Placement  # pose of the tool at its end
    pacing: LegSpeed
    blend: float  # radius of the blend at its end [m]
    where: str  # field of the command, for messages

    @property
    def q(self) -> Floats:
        """Joint positions at the start of the leg, shape (n,) [rad]."""
        return np.asarray(self.knots.q[0])


class BlendJunction(NamedTuple):
    """Point of a leg where the blends before and behind it meet."""

    s: float  # length from the leg's start [m]
    bend: Floats  # second derivatives of the tool's position and turn, shape (6,) [1/m, rad/m^2]


def meetings(legs: Sequence[Leg]) -> list[BlendJunction | None]:
    """Return for each leg the point where its blends meet, or None."""
    corners = [_corner(*pair) for pair in pairwise(legs)]
    found: list[BlendJunction | None] = [None] * len(legs)
    for number in range(1, len(legs) - 1):
        before, behind = corners[number - 1], corners[number]
        if before is not None and behind is not None:
            found[number] = _meeting(legs[number], legs[number - 1].blend, before, behind)
    return found


def _corner(leg: Leg, then: Leg) -> Floats | None:
    """Return the mean curvature around a shallow corner of two lines, shape (6,), else None."""
    if not (isinstance(leg.way, ToolLine) and isinstance(then.way, ToolLine) and leg.blend > 0.0):
        return None
    change = then.way.first - leg.way.first
    if _size(change) > SHALLOW:
        return None
    return np.asarray(2.0 * change / (leg.way.length + then.way.length))


def _meeting(leg: Leg, blend: float, before: Floats, behind: Floats) -> BlendJunction | None:
    assert isinstance(leg.way, ToolLine)
    way = leg.way
    start, end = way.within(blend), way.length - way.within(leg.blend)
    gap = end - start
    if not 0.0 <= gap < np.inf or max(_size(before), _size(behind)) * gap**2 > 8.0 * OFF:
        return None
    bend = np.concatenate([_between(before[part], behind[part]) for part in (slice(3), slice(3, 6))])
    along = way.first[:3]
    speed = float(along @ along)
    if speed > 0.0:  # keep only the part across the path: the blends meet with curvature but constant speed
        bend[:3] -= (bend[:3] @ along / speed) * along
    return BlendJunction(0.5 * (start + end), bend)


def _between(one: Floats, other: Floats) -> Floats:
    """Return a curvature between two: their mean, limited by the smaller; 0 if they bend opposite ways."""
    if one @ other <= 0.0:
        return np.zeros_like(one)
    mean = 0.5 * (one + other)
    most = STEEPER * min(float(np.linalg.norm(one)), float(np.linalg.norm(other)))
    return np.asarray(mean * min(most / float(np.linalg.norm(mean)), 1.0))


def _size(change: Floats) -> float:
    return max(float(np.linalg.norm(change[:3])), PER_RADIAN * float(np.linalg.norm(change[3:])))
