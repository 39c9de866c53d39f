"""The state between ticks that plans depend on, and running motions that can be extended."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from msgspec import Struct

from tvist_controller.line.differentiator import Floats
from tvist_controller.paths.pacing import PathLimits
from tvist_controller.paths.route import Branch
from tvist_controller.sources.mode_source import ModeSource
from tvist_controller.trajectory.retiming import RetimedLaw
from tvist_controller.trajectory.spline import Knots, SplineCurve
from tvist_plant.description import Payload as Body
from tvist_protocol.values import Payload
from tvist_urscript import Script

KEPT = 1.2  # part of a motion kept behind the arm [s]; filters keep up to a second
SAME = 1e-9  # distance below which two knots are one [m]


@dataclass(frozen=True)
class ExtensionEdges:
    """Edges at which a time law is cut for an extension."""

    first: int  # first edge that is kept
    known: int  # edge up to which the law stays unchanged
    branch: int  # edge behind which the path may change


@dataclass(frozen=True, eq=False)
class ExtendableMotion:
    """A motion to the end of the known moves, and where it can be extended."""

    curve: SplineCurve  # the joints' motion
    ground: PathLimits  # limits along the curve
    law: RetimedLaw
    branches: tuple[Branch, ...]  # points of the curve at which further moves may change it, in order
    segments: int  # number of moves so far
    window: float  # longest shaper delay for which the motion was planned [s]

    @property
    def end(self) -> Floats:
        """Joint positions at the motion's end, shape (n,) [rad]."""
        return self.curve.posture(self.curve.end)

    def branch(self, until: float) -> tuple[ExtensionEdges, Branch] | None:
        """Return cuts and point of the motion's first possible change after a time [s]; None if too late."""
        law, edges = self.law, self.law.edges
        moment = until * law.rate
        known = int(np.searchsorted(law.times, moment))
        if known >= len(edges) - 1:
            return None
        first = max(int(np.searchsorted(law.times, moment - law.ramp - KEPT)) - 1, 0)
        for branch in self.branches:
            at = int(np.argmin(np.abs(edges - branch.s)))
            if at >= known:
                return ExtensionEdges(first, known, at), replace(branch, s=float(edges[at]))
        last, s = self.branches[-1], float(edges[known])
        begun = last.begun + s - last.s  # the arm is already on the last leg
        return ExtensionEdges(first, known, known), Branch(
            s, last.legs, begun, self.curve.posture(np.array([s]))
        )

    def knots(self, cuts: ExtensionEdges) -> Knots:
        """Return the knots of the part kept, up to the branch."""
        s, old = self.law.edges, self.curve.knots
        kept = slice(
            max(int(np.searchsorted(old.s, s[cuts.first], side="right")) - 1, 0),
            int(np.searchsorted(old.s, s[cuts.branch] - SAME)),
        )
        end = self.curve.derivatives(s[cuts.branch : cuts.branch + 1])
        ends = (s[cuts.branch : cuts.branch + 1], *end)
        return Knots(*(np.concatenate((each[kept], one)) for each, one in zip(old, ends, strict=True)))


class FilterState(NamedTuple):
    """State that a new filter depends on."""

    name: str  # name of the present filter
    modes: int  # number of modes that it uses
    source: ModeSource  # source of the modes
    declared: Payload  # payload for its modes
    given: Payload  # payload declared by a client; differs from it if the robot has learnt another


class PlanningState(Struct, frozen=True, eq=False, gc=False):
    """State that plans depend on."""

    filter: FilterState
    movable: bool  # whether a planned motion may start or be extended
    q: Floats  # joint angles of the present reference, or of the end to be extended, shape (n,) [rad]
    speed: float  # programmed speed fraction [-]
    slowest: float | None  # velocity limit of reduced mode; None if inactive [rad/s]
    excess: float  # `Filter.excess` of the filter: relative excess of acceleration [-]
    excess_at_limits: tuple[float, float]
    """`Filter.excess_at_limits`: relative excess of velocity and acceleration at the arm's limits [-]."""
    tcp: tuple[float, ...]  # tool centre point in the flange frame: x y z [m] and rotation vector [rad]
    body: Body  # payload in the collision model
    bodies: tuple[Floats, ...]  # possible inertial parameters of the last link, see `InverseDynamics.bodies`
    after: ExtendableMotion | None = None  # running motion to be extended; None for a motion from rest
    until: float = 0.0  # time up to which that motion stays unchanged [s]
    script: Script | None = None
    """The program or its last added statement; None if no program accepts statements."""


FILTER = ("filter",)  # fields that a filter depends on
MOTION = (
    "movable", "q", "speed", "slowest", "excess", "excess_at_limits",
    "tcp", "body", "bodies", "filter", "after",
)  # fmt: skip
"""Fields that a motion depends on."""
TOOL = ("tcp",)  # fields that an answer about tool kinematics depends on; the arm may move on meanwhile
SCRIPT = ("script",)  # fields that a statement for a running program depends on
