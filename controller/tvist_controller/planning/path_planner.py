"""Planning of motions of the tool and of paths of several parts."""

from collections.abc import Iterator

import numpy as np

from tvist_controller.commands.refusal import RefusalError
from tvist_controller.foresight.collision import CLEARANCE
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.limits import arm_limits, rate_of
from tvist_controller.paths.legs import JointWay, Leg, Pacing
from tvist_controller.paths.pacing import JointLimits, fastest, joined, law_of, timed
from tvist_controller.paths.poses import Placement, placement
from tvist_controller.paths.route import Piece, Run, runs_of
from tvist_controller.paths.tool_curves import PER_RADIAN, SHORTEST, ToolArc, ToolLine, ToolWay
from tvist_controller.paths.tracking import Tracker, WayError
from tvist_controller.planning.asked_speed import slower_than_asked
from tvist_controller.planning.basis import MotionBasis
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.planning.fitting import Fitted, Slower
from tvist_controller.planning.move_planner import MovePlanner, PlannedMove, limited
from tvist_controller.planning.reachable import Reachable
from tvist_controller.setup import Setup
from tvist_controller.trajectory import JointLine, MotionLimits, PlannedMotion, at_least, quickest_motion
from tvist_controller.trajectory.spline import Knots, SplineCurve
from tvist_plant.plant import PERIOD
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
from tvist_protocol.replies import Code
from tvist_shaping.base import Filter

POSTURES = 9
"""Number of postures of a run at which the shaper's delay is looked up."""
SPARED = 0.99
"""Share of the joints' limits that paths use: a shaper whose weights vary may exceed its reference a little [-]."""
LEAST_WINDOW = 0.08
"""Delay of a shaper for which a path has room in any case, so that few changes of the shaper slow it down [s]."""
AGILE = MotionLimits(0.25, 1.2, 60.0)
"""Limits of pauses and changes of the speed for motions that are slower by themselves: those of `move_l` by default."""
VARIATION = 1.1
"""Factor by which the delay may be longer between them [-]."""


class PathPlanner:
    """Plans the motions of one robot along paths.

    Args:
        setup: Initial setup.
        filters: Creates its filters.
        moves: Plans its point-to-point motions, and checks motions of any kind.
        reachable: Says why a path cannot be followed.
    """

    def __init__(
        self, setup: Setup, filters: FilterPlanner, moves: MovePlanner, reachable: Reachable
    ) -> None:
        self._description, self._filters, self._moves = setup.description, filters, moves
        self._reachable = reachable

    def rehearse(self) -> None:
        """Compile what plans use, before any is needed."""
        q = np.zeros(self._description.joints)
        tracker = Tracker(self._description, (0.0,) * 6)
        tracker.pose(q)
        tracker.rates(q, ToolLine(*[tracker.pose(q)] * 2).at(0.0))
        run = [Piece(JointWay(q, q + 0.1).part(0.0, 0.1 * PER_RADIAN), Pacing(1.0, 1.0), None, True, "")]
        limits = self._description.limits
        joints = JointLimits(np.array(limits.velocity), np.array(limits.acceleration), min(limits.jerk))
        law_of(run, SplineCurve(joined(run)), joints, 60.0, LEAST_WINDOW)

    def plan(self, command: MoveL | MoveC | MovePath, basis: MotionBasis) -> PlannedMove:
        """Plan a motion from rest; the command's content has been checked.

        Raises:
            RefusalError: There is no such motion, or it would lead to a collision.
        """
        tracker = Tracker(self._description, basis.tcp)
        legs = list(self._legs(command, tracker, basis))
        try:
            runs, skipped = runs_of(legs, tracker)
        except WayError as error:
            raise self._reachable.refusal(error, "segments", 1.0, legs[-1].corner, basis.tcp) from error
        if not runs:
            runs = [[]]
        length = sum(map(_length, runs))
        tvist, done, motions = self._filters.present(basis.filter), 0.0, list[PlannedMotion]()
        window, velocity, told = 0.0, 0.0, None
        for run in runs:
            fitted, delay, highest, slower = self._motion(run, command.jerk, tvist, basis)
            if slower is not None and len(legs) > 1:
                slower = slower[0], f"{run[0].where}: {slower[1]}"
            motion, told = fitted.motion, told or limited(fitted) or slower
            velocity = max(velocity, highest)
            self._check_clear(motion, run, (done, length), basis)
            motions.append(motion)
            window = max(window, delay)
            done += _length(run)
        return PlannedMove(
            tuple(motions),
            velocity,
            told,
            tuple(skipped),
            window,
            marks_of(runs, len(command.segments) if isinstance(command, MovePath) else 1),
            tvist.peak,
        )

    # ------------------------------------------------------------------ geometry

    def _legs(self, command: MoveL | MoveC | MovePath, tracker: Tracker, basis: MotionBasis) -> Iterator[Leg]:
        frame, q = placement(command.frame), basis.q
        for segment, where in _segments(command):
            start = tracker.pose(q)
            way: ToolWay | JointWay
            match segment:
                case JointSegment():
                    way = JointWay(q, np.array(segment.q, dtype=float))
                case ArcSegment():
                    via = frame @ placement(segment.via)
                    end = frame @ placement(segment.pose)
                    way = self._arc(start, via.position, end, segment, where)
                case _:
                    way = ToolLine(start, frame @ placement(segment.pose))
            if way.length < SHORTEST:
                continue
            knots = self._along(way, q, tracker, where, basis)
            q = way.end if isinstance(way, JointWay) else knots.q[-1]
            pacing = timed(_pacing(segment), way.length)
            yield Leg(way, knots, tracker.pose(q), pacing, segment.blend, where)

    @staticmethod
    def _arc(start: Placement, via: Floats, end: Placement, segment: ArcSegment, where: str) -> ToolArc:
        try:
            return ToolArc(start, via, end, tangent=segment.orientation == "tangent")
        except ValueError as error:
            field = f"{where}.via".removeprefix(".")
            why = f"{field}: no arc leads from the present position through it to pose: {error}"
            raise RefusalError("out_of_range", field, why) from error

    def _along(
        self, way: ToolWay | JointWay, q: Floats, tracker: Tracker, where: str, basis: MotionBasis
    ) -> Knots:
        """The joints' way along a leg, which is within their range."""
        if isinstance(way, JointWay):
            return way.part(0.0, way.length)
        field = f"{where}.pose".removeprefix(".")
        try:
            knots = tracker.follow(way, q)
        except WayError as error:
            goal, share = way.at(way.length).pose, error.s / way.length
            raise self._reachable.refusal(error, field, share, goal, basis.tcp) from error
        self._check_range(knots.s / way.length, knots.q, field)
        return knots

    def _check_range(self, shares: Floats, q: Floats, field: str) -> None:
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

    def _check_clear(
        self, motion: PlannedMotion, run: Run, part: tuple[float, float], basis: MotionBasis
    ) -> None:
        """Refuse a motion that something is in the way of; `part` is its start on the whole path and that's length."""
        found = self._moves.meeting(motion, basis)
        if found is None:
            return
        share, meeting = found
        covered, where = share * _length(run), _field(run[-1].where)
        for piece, end in zip(run, np.cumsum([piece.knots.s[-1] for piece in run]), strict=True):
            if end >= covered:
                where = _field(piece.where)
                break
        whole = 100.0 * (part[0] + covered) / part[1]
        why = f"{where}: {meeting} after {whole:.0f} % of the way"
        raise RefusalError("collision", where, why, CLEARANCE)

    # ------------------------------------------------------------------ time

    def _motion(
        self, run: Run, jerk: float, tvist: Filter, basis: MotionBasis
    ) -> tuple[Fitted, float, float, tuple[Code, str] | None]:
        """A motion, and what is known of it.

        Returns:
            The motion, the delay of the shaper on it [s], the largest velocity of any joint [rad/s], and of a run along
            one segment what makes it slower than asked, see `slower_than_asked`.
        """
        limits, spared = self._description.limits, 1.0 - basis.excess
        if not run:  # the arm is there already
            still = JointLine(basis.q, basis.q)
            motion = quickest_motion(still, arm_limits(self._description), PERIOD, basis.speed)
            return Fitted(motion), 0.0, 0.0, None
        knots = joined(run)
        self._check_range(knots.s / knots.s[-1], knots.q, run[0].where)
        acceleration = np.array(limits.acceleration) * spared
        curve = SplineCurve(knots, acceleration)
        delay = self._delay(curve, tvist)
        peak = tvist.peak
        joints = JointLimits(
            SPARED * np.array(limits.velocity) / peak, SPARED * acceleration / peak**2, min(limits.jerk)
        )
        law = law_of(run, curve, joints, jerk, delay)
        alone = all(piece.where == run[0].where for piece in run)
        slower = slower_than_asked(run, curve, law, joints, self._description) if alone else None
        highest = fastest(law, curve)
        rate = rate_of(basis.speed, highest, basis.slowest)

        def make(slower: Slower) -> PlannedMotion:
            kept = law.slowed(law.duration / slower.rate)
            return PlannedMotion(
                curve, kept, PERIOD, rate, at_least(kept.limits, AGILE.acceleration, AGILE.jerk)
            )

        fitted = self._moves.fitter.fit(make, basis, lambda: self._filters.present(basis.filter))
        return fitted, delay, highest * fitted.slower.rate, slower

    @staticmethod
    def _delay(curve: SplineCurve, tvist: Filter) -> float:
        """Longest delay of a shaper on a curve [s]."""
        found = []
        for s in np.linspace(0.0, float(curve.end[0]), POSTURES):
            tvist.reset(curve.posture(np.array([s])))
            found.append(tvist.delay)
        return max(VARIATION * max(found), LEAST_WINDOW)


def _segments(command: MoveL | MoveC | MovePath) -> Iterator[tuple[Segment, str]]:
    match command:
        case MoveL():
            yield (
                LineSegment(
                    pose=command.pose,
                    velocity=command.velocity,
                    acceleration=command.acceleration,
                    duration=command.duration,
                ),
                "",
            )
        case MoveC():
            yield (
                ArcSegment(
                    via=command.via,
                    pose=command.pose,
                    orientation=command.orientation,
                    velocity=command.velocity,
                    acceleration=command.acceleration,
                ),
                "",
            )
        case MovePath():
            for number, segment in enumerate(command.segments):
                yield segment, f"segments[{number}]"


def marks_of(runs: list[Run], segments: int) -> tuple[tuple[int, float], ...]:
    """Where the blend at the end of each segment begins, see `PlannedMove.marks`."""
    marks = dict[int, tuple[int, float]]()
    for part, run in enumerate(runs):
        ends = np.cumsum([piece.knots.s[-1] for piece in run]).tolist()
        for number, piece in enumerate(run):
            # On the way to another segment, the last piece of one is its blend.
            last = run[-1].where == piece.where
            marks[_number(piece.where)] = (
                part,
                ends[number] if last else ends[number] - float(piece.knots.s[-1]),
            )
    found, here = [], (0, 0.0)
    for segment in range(segments):
        here = marks.get(segment, here)
        found.append(here)
    return tuple(found)


def _pacing(segment: Segment) -> Pacing:
    match segment:
        case JointSegment():
            return Pacing(PER_RADIAN * segment.velocity, PER_RADIAN * segment.acceleration, segment.duration)
        case LineSegment():
            return Pacing(segment.velocity, segment.acceleration, segment.duration)
        case ProcessSegment() | ArcSegment():
            return Pacing(segment.velocity, segment.acceleration, even=True)


def _length(run: Run) -> float:
    return sum(float(piece.knots.s[-1]) for piece in run)


def _number(where: str) -> int:
    """Number of the segment that a part of the path comes from."""
    return int(where[len("segments[") : -1]) if where else 0


def _field(where: str) -> str:
    """Field of the command for a part of the path: a segment, or the pose of a command for one part."""
    return where or "pose"
