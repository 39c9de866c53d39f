"""Reachability: joint positions at a pose, joint motion along parts of a path, and reasons for failure."""

from collections.abc import Iterator, Sequence

import numpy as np

from tvist_controller.kinematics.inverse import InverseKinematics, InverseKinematicsError
from tvist_controller.kinematics.pose import Placement, placement
from tvist_controller.line.differentiator import Floats
from tvist_controller.paths.legs import JointCurve, Leg, LegSpeed
from tvist_controller.paths.pacing import timed
from tvist_controller.paths.tool_curves import PER_RADIAN, SHORTEST, BlendableCurve, ToolArc, ToolLine
from tvist_controller.paths.tracking import Tracker, TrackingError
from tvist_controller.planning.snapshot import PlanningState
from tvist_controller.refusal import RefusalError, check_joints
from tvist_controller.trajectory.spline import Knots
from tvist_plant.description import RobotDescription
from tvist_protocol import kinematics as k
from tvist_protocol import motions as m
from tvist_protocol.replies import Posture, ToolPose


class KinematicPlanner:
    """Answers kinematic queries and creates the parts of paths for one robot."""

    def __init__(self, description: RobotDescription) -> None:
        self._description = description
        self._inverse = InverseKinematics(description)

    def posture(self, question: k.InverseKinematics, now: PlanningState) -> Posture:
        """Return the nearest joint positions for a tool pose; raise RefusalError without any in range."""
        near = now.q
        if question.near is not None:
            check_joints(question.near, self._description, "near")
            near = np.array(question.near, dtype=float)
        goal = placement(question.frame) @ placement(question.pose)
        tcp = now.tcp if question.tcp_offset is None else question.tcp_offset
        flange = goal @ placement(tcp).inverse
        try:
            q = self._inverse.solve(flange.rotation, flange.position, near)
        except InverseKinematicsError as error:
            raise RefusalError(error.code, "pose", f"pose {_shown(goal)}: {error}", error.limit) from error
        return Posture(q=tuple(q.tolist()))

    def pose(self, question: k.ForwardKinematics, now: PlanningState) -> ToolPose:
        """Return the tool pose at joint positions; raise RefusalError if invalid or out of range."""
        q = now.q
        if question.q is not None:
            check_joints(question.q, self._description)
            q = np.array(question.q, dtype=float)
        tcp = now.tcp if question.tcp_offset is None else question.tcp_offset
        found = placement(question.frame).inverse @ Tracker(self._description, tcp).pose(q)
        return ToolPose(pose=found.vector)

    def refusal(
        self, error: TrackingError, field: str, share: float, goal: Placement, tcp: Sequence[float]
    ) -> RefusalError:
        """Return the refusal of a path possible up to a share of the way, 0 to 1; `field`: the command's."""
        at = f"{field}: after {100.0 * share:.0f} % of the way, at {_shown(error.pose)}"
        for pose, where in ((goal, f"{field} {_shown(goal)}"), (error.pose, at)):
            flange = pose @ placement(tcp).inverse
            try:
                self._inverse.solve(flange.rotation, flange.position, error.q)
            except InverseKinematicsError as unreachable:
                return RefusalError(unreachable.code, field, f"{where}: {unreachable}", unreachable.limit)
        if share == 0.0:
            why = f"{field}: the arm is in a singular posture, from which it cannot move the tool so: use move_j first"
            return RefusalError("singular", field, why)
        near = ", ".join(f"{angle:.2f}" for angle in error.q)
        why = f"{at}, the arm passes a singular posture (near [{near}] rad): go round it, or move there with move_j"
        return RefusalError("singular", field, why)

    def legs(
        self, command: m.MoveL | m.MoveC | m.MovePath, tracker: Tracker, now: PlanningState
    ) -> Iterator[Leg]:
        """Yield the parts of a command's path that move the arm; raise RefusalError if impossible."""
        frame, q = placement(command.frame), now.q
        for segment, where in _segments(command, 0 if now.after is None else now.after.segments):
            start = tracker.pose(q)
            way: BlendableCurve | JointCurve
            match segment:
                case m.JointSegment():
                    way = JointCurve(q, np.array(segment.q, dtype=float))
                case m.ArcSegment() | m.MoveC():
                    via = frame @ placement(segment.via)
                    end = frame @ placement(segment.pose)
                    try:
                        way = ToolArc(start, via.position, end, tangent=segment.orientation == "tangent")
                    except ValueError as error:
                        field = f"{where}.via".removeprefix(".")
                        why = f"{field}: no arc leads from the present position through it to pose: {error}"
                        raise RefusalError("out_of_range", field, why) from error
                case _:
                    way = ToolLine(start, frame @ placement(segment.pose))
            if way.length < SHORTEST:
                continue
            knots = self._along(way, q, tracker, where, now)
            q = way.end if isinstance(way, JointCurve) else knots.q[-1]
            pacing = timed(_pacing(segment), way.length)
            blend = 0.0 if isinstance(segment, m.MoveL | m.MoveC) else segment.blend
            yield Leg(way, knots, tracker.pose(q), pacing, blend, where)

    def _along(
        self, way: BlendableCurve | JointCurve, q: Floats, tracker: Tracker, where: str, now: PlanningState
    ) -> Knots:
        """Return the joints' motion along a leg, checked for range."""
        if isinstance(way, JointCurve):
            return way.part(0.0, way.length)
        field = f"{where}.pose".removeprefix(".")
        try:
            knots = tracker.follow(way, q)
        except TrackingError as error:
            goal, share = way.at(way.length).pose, error.s / way.length
            raise self.refusal(error, field, share, goal, now.tcp) from error
        self.check_range(knots.s / way.length, knots.q, field)
        return knots

    def check_range(self, shares: Floats, q: Floats, field: str) -> None:
        """Refuse a path with joint positions (k, n) [rad] out of range; `shares` are their places on it."""
        most = np.array(self._description.limits.position)
        beyond = np.abs(q) > most
        if not beyond.any():
            return
        first = int(np.flatnonzero(beyond.any(axis=1))[0])
        joint = int(np.flatnonzero(beyond[first])[0])
        name = self._description.robot.joints[joint]
        why = (
            f"{field}: joint {name} would be at {q[first, joint]:.3f} rad after {100.0 * shares[first]:.0f} % of the "
            f"way: must be within ±{most[joint]:g} rad"
        )
        raise RefusalError("limit_position", field, why, float(most[joint]))


def _shown(pose: Placement) -> str:
    return "[" + ", ".join(f"{value:.3f}" for value in pose.vector) + "]"


def _segments(
    command: m.MoveL | m.MoveC | m.MovePath, before: int
) -> Iterator[tuple[m.MoveL | m.MoveC | m.Segment, str]]:
    if not isinstance(command, m.MovePath):
        yield command, ""
        return
    for number, segment in enumerate(command.segments):
        yield segment, f"segments[{before + number}]"


def _pacing(segment: m.MoveL | m.MoveC | m.Segment) -> LegSpeed:
    match segment:
        case m.JointSegment():
            return LegSpeed(
                PER_RADIAN * segment.velocity, PER_RADIAN * segment.acceleration, segment.duration
            )
        case m.LineSegment() | m.MoveL():
            return LegSpeed(segment.velocity, segment.acceleration, segment.duration)
        case m.ProcessSegment() | m.ArcSegment() | m.MoveC():
            return LegSpeed(segment.velocity, segment.acceleration, even=True)
