"""Parts of a path, as commands ask for them, with the joints' way along each."""

from collections.abc import Iterator

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_controller.paths.legs import JointWay, Leg, Pacing
from tvist_controller.paths.pacing import timed
from tvist_controller.paths.poses import Placement, placement
from tvist_controller.paths.tool_curves import PER_RADIAN, SHORTEST, ToolArc, ToolLine, ToolWay
from tvist_controller.paths.tracking import Tracker, WayError
from tvist_controller.planning.reachable import Reachable
from tvist_controller.planning.snapshot import Snapshot
from tvist_controller.refusal import RefusalError
from tvist_controller.trajectory.spline import Knots
from tvist_plant.description import RobotDescription
from tvist_protocol.motions import (
    ArcSegment,
    JointSegment,
    LineSegment,
    MoveC,
    MoveL,
    MovePath,
    ProcessSegment,
    Segment,
)


class PathLegs:
    """Makes the parts of one robot's paths; `reachable` says why one cannot be followed."""

    def __init__(self, description: RobotDescription, reachable: Reachable) -> None:
        self._description, self._reachable = description, reachable

    def of(self, command: MoveL | MoveC | MovePath, tracker: Tracker, now: Snapshot) -> Iterator[Leg]:
        """Return the parts of a command's path that move the arm, one after the other.

        Raises:
            RefusalError: The arm cannot follow one.
        """
        frame, q = placement(command.frame), now.q
        before = 0 if now.after is None else now.after.segments
        for segment, where in _segments(command, before):
            start = tracker.pose(q)
            way: ToolWay | JointWay
            match segment:
                case JointSegment():
                    way = JointWay(q, np.array(segment.q, dtype=float))
                case ArcSegment() | MoveC():
                    via = frame @ placement(segment.via)
                    end = frame @ placement(segment.pose)
                    way = self._arc(start, via.position, end, segment, where)
                case _:
                    way = ToolLine(start, frame @ placement(segment.pose))
            if way.length < SHORTEST:
                continue
            knots = self._along(way, q, tracker, where, now)
            q = way.end if isinstance(way, JointWay) else knots.q[-1]
            pacing = timed(_pacing(segment), way.length)
            blend = 0.0 if isinstance(segment, MoveL | MoveC) else segment.blend
            yield Leg(way, knots, tracker.pose(q), pacing, blend, where)

    @staticmethod
    def _arc(
        start: Placement, via: Floats, end: Placement, segment: ArcSegment | MoveC, where: str
    ) -> ToolArc:
        try:
            return ToolArc(start, via, end, tangent=segment.orientation == "tangent")
        except ValueError as error:
            field = f"{where}.via".removeprefix(".")
            why = f"{field}: no arc leads from the present position through it to pose: {error}"
            raise RefusalError("out_of_range", field, why) from error

    def _along(
        self, way: ToolWay | JointWay, q: Floats, tracker: Tracker, where: str, now: Snapshot
    ) -> Knots:
        """The joints' way along a leg, which is within their range."""
        if isinstance(way, JointWay):
            return way.part(0.0, way.length)
        field = f"{where}.pose".removeprefix(".")
        try:
            knots = tracker.follow(way, q)
        except WayError as error:
            goal, share = way.at(way.length).pose, error.s / way.length
            raise self._reachable.refusal(error, field, share, goal, now.tcp) from error
        self.check_range(knots.s / way.length, knots.q, field)
        return knots

    def check_range(self, shares: Floats, q: Floats, field: str) -> None:
        """Refuse joint positions beyond their range, shape (k, n) [rad], to which a field of the command leads.

        They are at these shares of the way, shape (k,) [-].

        Raises:
            RefusalError: A joint is beyond its range.
        """
        most = np.array(self._description.limits.position)
        beyond = np.abs(q) > most
        if not beyond.any():
            return
        first = int(np.flatnonzero(beyond.any(axis=1))[0])
        joint = int(np.flatnonzero(beyond[first])[0])
        name = self._description.robot.joints[joint]
        why = (
            f"{field}: joint {name} would be at {q[first, joint]:.3f} rad after {100.0 * shares[first]:.0f} % of the "
            f"way; it goes to ±{most[joint]:g}"
        )
        raise RefusalError("limit_position", field, why, float(most[joint]))


def _segments(
    command: MoveL | MoveC | MovePath, before: int
) -> Iterator[tuple[MoveL | MoveC | Segment, str]]:
    if not isinstance(command, MovePath):
        yield command, ""
        return
    for number, segment in enumerate(command.segments):
        yield segment, f"segments[{before + number}]"


def _pacing(segment: MoveL | MoveC | Segment) -> Pacing:
    match segment:
        case JointSegment():
            return Pacing(PER_RADIAN * segment.velocity, PER_RADIAN * segment.acceleration, segment.duration)
        case LineSegment() | MoveL():
            return Pacing(segment.velocity, segment.acceleration, segment.duration)
        case ProcessSegment() | ArcSegment() | MoveC():
            return Pacing(segment.velocity, segment.acceleration, even=True)
