"""The state between two ticks that plans depend on, and running motions that may go on behind their end."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from msgspec import Struct

from tvist_controller.line.differentiator import Floats
from tvist_controller.paths.pacing import Ground
from tvist_controller.paths.route import Branch
from tvist_controller.sources.mode_source import ModeSource
from tvist_controller.trajectory.retiming import RetimedLaw
from tvist_controller.trajectory.spline import Knots, SplineCurve
from tvist_plant.description import Payload as Body
from tvist_protocol.values import Payload
from tvist_urscript import Script

KEPT = 1.2
"""Time of a motion that is kept behind the arm [s]: filters keep samples of up to a second."""
SAME = 1e-9
"""Distance below which two knots are one [m]."""


@dataclass(frozen=True)
class Cuts:
    """Edges of a law."""

    first: int
    """The first one that is kept."""
    known: int
    """The last one up to which the law stays the same."""
    branch: int
    """The one behind which the path may change."""


@dataclass(frozen=True, eq=False)
class Course:
    """A motion to the end of the moves that are known, and where it may go on to further ones."""

    curve: SplineCurve
    """The joints' way."""
    ground: Ground
    """What limits the motion along it."""
    law: RetimedLaw
    branches: tuple[Branch, ...]
    """Places of the curve at which further moves may change it, in their order."""
    segments: int
    """Number of the path's moves so far."""
    window: float
    """Longest delay of a shaper for which it was planned [s]."""

    @property
    def end(self) -> Floats:
        """Joint positions at its end, shape (n,) [rad]."""
        return self.curve.posture(self.curve.end)

    def branch(self, until: float) -> tuple[Cuts, Branch] | None:
        """Return the first place at which it may change, and what stays the same there; None if that comes too soon.

        Args:
            until: Time before which it stays the same [s].
        """
        law, edges = self.law, self.law.edges
        moment = until * law.rate
        known = int(np.searchsorted(law.times, moment))
        if known >= len(edges) - 1:
            return None
        first = max(int(np.searchsorted(law.times, moment - law.ramp - KEPT)) - 1, 0)
        for branch in self.branches:
            at = int(np.argmin(np.abs(edges - branch.s)))
            if at >= known:
                return Cuts(first, known, at), replace(branch, s=float(edges[at]))
        last, s = self.branches[-1], float(edges[known])
        begun = last.begun + s - last.s  # the arm is on its last leg already
        return Cuts(first, known, known), Branch(s, last.legs, begun, self.curve.posture(np.array([s])))

    def knots(self, cuts: Cuts) -> Knots:
        """The knots of the part that is kept: up to where it branches."""
        s, old = self.law.edges, self.curve.knots
        kept = slice(
            max(int(np.searchsorted(old.s, s[cuts.first], side="right")) - 1, 0),
            int(np.searchsorted(old.s, s[cuts.branch] - SAME)),
        )
        end = self.curve.derivatives(s[cuts.branch : cuts.branch + 1])
        ends = (s[cuts.branch : cuts.branch + 1], *end)
        return Knots(*(np.concatenate((each[kept], one)) for each, one in zip(old, ends, strict=True)))


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
