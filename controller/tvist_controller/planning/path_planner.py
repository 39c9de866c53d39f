"""Planning of tool motions and of paths of several parts."""

from dataclasses import replace

import numpy as np

from tvist_controller.foresight.collision import CLEARANCE
from tvist_controller.line.limits import arm_limits, rate_of
from tvist_controller.paths.legs import Leg
from tvist_controller.paths.pacing import (
    JointLimits,
    PathLimits,
    fastest,
    going_on,
    ground_of,
    joined,
    law_of,
)
from tvist_controller.paths.route import Branch, Route, Run, length_of, route_of
from tvist_controller.paths.tracking import Tracker, TrackingError
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.planning.fitting import Fitted, SlowdownFactors
from tvist_controller.planning.kinematic_planner import KinematicPlanner
from tvist_controller.planning.move_planner import MovePlanner, PlannedMove
from tvist_controller.planning.slower import Limited, slower_path
from tvist_controller.planning.snapshot import ExtendableMotion, PlanningState
from tvist_controller.refusal import RefusalError
from tvist_controller.setup import Setup
from tvist_controller.trajectory import (
    CheckedMotion,
    JointLine,
    MotionLimits,
    PlannedMotion,
    at_least,
    quickest_motion,
)
from tvist_controller.trajectory.retiming import RetimedLaw
from tvist_controller.trajectory.spline import Knots, SplineCurve
from tvist_protocol.motions import MoveC, MoveL, MovePath
from tvist_shaping.base import Filter

POSTURES = 9  # number of postures of a run at which the shaper's delay is computed
SAMPLES = 1000  # number of places of a run searched for the posture in which a limit applies
SPARED = 0.99
"""Fraction of joint limits that paths use; a shaper with varying weights may exceed its reference a little [-]."""
LEAST_WINDOW = 0.08
"""Shaper delay for which a path always has room, so that few changes of shaper slow it down [s]."""
AGILE = MotionLimits(0.25, 1.2, 60.0)
"""Limits of pauses and speed changes for slower motions: the defaults of `move_l`."""
VARIATION = 1.1  # factor by which the shaper's delay may be longer between these `POSTURES` [-]


class PathPlanner:
    """Plans one robot's motions along paths."""

    def __init__(
        self, setup: Setup, filters: FilterPlanner, moves: MovePlanner, kinematic: KinematicPlanner
    ) -> None:
        self._description, self._filters, self._moves = setup.description, filters, moves
        self._kinematic = kinematic

    def plan(self, command: MoveL | MoveC | MovePath, now: PlanningState) -> PlannedMove | None:
        """Plan a motion from rest, or an extension (None: too late); raise RefusalError if impossible."""
        tracker = Tracker(self._description, now.tcp)
        legs = list(self._kinematic.legs(command, tracker, now))
        count = len(command.segments) if isinstance(command, MovePath) else 1
        if now.after is not None:
            return self._further(command.jerk, legs, count, tracker, now)
        route = self._route(legs, tracker, now)
        runs = route.runs or [[]]
        length = sum(map(length_of, runs))
        tvist, done, moves = self._filters.like(now.filter), 0.0, list[PlannedMove]()
        for run in runs:
            goes_on = run is runs[-1] and bool(legs) and legs[-1].blend > 0.0
            several = len(legs) > 1
            move = self._along(run, route, command.jerk, tvist, now, count, goes_on=goes_on, several=several)
            self._check_clear(move.parts[0].path.whole, run, (done, length), now)
            moves.append(move)
            done += length_of(run)
        told = next((move.limited for move in moves if move.limited is not None), None)
        return _joined(moves, route, told, range(count))

    def _route(
        self, legs: list[Leg], tracker: Tracker, now: PlanningState, start: Branch | None = None
    ) -> Route:
        try:
            return route_of(legs, tracker, start)
        except TrackingError as error:
            raise self._kinematic.refusal(error, "segments", 1.0, legs[-1].corner, now.tcp) from error

    def _further(
        self, jerk: float, legs: list[Leg], count: int, tracker: Tracker, now: PlanningState
    ) -> PlannedMove | None:
        """Plan the extension of a motion to further legs; None if the arm is too near the motion's end."""
        before, tvist = now.after, self._filters.like(now.filter)
        assert before is not None
        if (found := before.branch(now.until)) is None:
            return None
        cuts, branch = found
        route = self._route([*branch.legs, *legs], tracker, now, branch)
        run, *coming = route.runs
        if len(branch.legs) + len(legs) > 1 and cuts.branch == cuts.known and coming:
            return None  # the arm is so near the end that no blend fits
        curve, joints = self._curve(joined(run, before.knots(cuts)), run, tvist, now)
        ground = before.ground.then(cuts.first, cuts.branch, run, curve)
        delay = max(self._delay(curve, tvist), before.window)

        def make(slower: SlowdownFactors) -> PlannedMotion:
            edges = cuts.first, cuts.known - cuts.first
            law = going_on(before.law, edges, ground, curve, joints, jerk, delay, slower.rate)
            if law is None:
                raise _TooLateError
            return self._planned(curve, law, 1.0)

        try:
            fitted = self._moves.fit(make, now, None)
        except _TooLateError:
            return None
        self._check_clear(curve.way(np.array([branch.s]), curve.end), run, (0.0, length_of(run)), now)
        law = fitted.motion.law
        assert isinstance(law, RetimedLaw)
        told, count = _told(fitted, run, branch.s), before.segments + count
        extendable = None if coming else _extendable(run, route, curve, ground, law, count, delay, branch.s)
        velocity = fastest(law, curve)
        planned = PlannedMove((fitted.motion,), velocity, told, window=delay, peak=tvist.peak)
        moves = [planned._replace(extendable=extendable)]
        for further in coming:
            move = self._along(further, route, jerk, tvist, now, count)
            self._check_clear(move.parts[0].path.whole, further, (0.0, length_of(further)), now)
            moves.append(move)
        return _joined(moves, route, told, range(before.segments - 1, count), branch.s)

    def _check_clear(
        self, way: CheckedMotion, run: Run, part: tuple[float, float], now: PlanningState
    ) -> None:
        """Refuse a colliding path; `part`: where the run starts on the whole path, and the path's length."""
        if (found := self._moves.meeting(way, now)) is None:
            return
        share, meeting = found
        covered, where = share * length_of(run), run[-1].where
        for piece, end in zip(run, np.cumsum([piece.knots.s[-1] for piece in run]), strict=True):
            if end >= covered:
                where = piece.where
                break
        where = where or "pose"
        whole = 100.0 * (part[0] + covered) / part[1]
        why = f"{where}: {meeting} after {whole:.0f} % of the way"
        raise RefusalError("collision", where, why, CLEARANCE)

    # ------------------------------------------------------------------ time

    def _along(
        self,
        run: Run,
        route: Route,
        jerk: float,
        tvist: Filter,
        now: PlanningState,
        count: int,
        *,
        goes_on: bool = False,
        several: bool = True,  # whether reasons for slowing down name the part of the path
    ) -> PlannedMove:
        """Plan a motion from rest along a run of a route with `count` segments."""
        if not run:  # already there
            limits = arm_limits(self._description)
            motion = quickest_motion(JointLine(now.q, now.q), limits, now.speed)
            return PlannedMove((motion,), 0.0, None, window=0.0, peak=tvist.peak)
        curve, joints = self._curve(joined(run), run, tvist, now)
        delay, ground = self._delay(curve, tvist), ground_of(run, curve)
        law = law_of(run, curve, ground, joints, jerk, delay, goes_on=goes_on)
        alone = not goes_on and all(piece.where == run[0].where for piece in run)
        slower = slower_path(run, curve, law, joints, self._description) if alone else None
        if slower is not None and several:
            slower = slower[0], f"{run[0].where}: {slower[1]}"
        highest = fastest(law, curve)
        rate = rate_of(now.speed, highest, now.slowest)

        def make(slower: SlowdownFactors) -> PlannedMotion:
            return self._planned(curve, law.slowed(law.duration / slower.rate), rate)

        fitted = self._moves.fit(make, now, lambda: self._filters.like(now.filter))
        kept, last = fitted.motion.law, run is route.runs[-1]
        assert isinstance(kept, RetimedLaw)
        extendable = _extendable(run, route, curve, ground, kept, count, delay) if last else None
        velocity, told = highest * fitted.slower.rate, _told(fitted, run) or slower
        planned = PlannedMove((fitted.motion,), velocity, told, window=delay, peak=tvist.peak)
        return planned._replace(extendable=extendable)

    def _curve(
        self, knots: Knots, run: Run, tvist: Filter, now: PlanningState
    ) -> tuple[SplineCurve, JointLimits]:
        """Return the joints' motion along a run, checked for range, and the joints' limits."""
        self._kinematic.check_range(knots.s / knots.s[-1], knots.q, run[0].where)
        limits, peak = self._description.limits, tvist.peak
        acceleration = np.array(limits.acceleration) * (1.0 - now.excess)
        velocity = SPARED * np.array(limits.velocity) / peak
        joints = JointLimits(velocity, SPARED * acceleration / peak**2, min(limits.jerk))
        return SplineCurve(knots, acceleration), joints

    @staticmethod
    def _planned(curve: SplineCurve, law: RetimedLaw, rate: float) -> PlannedMotion:
        return PlannedMotion(curve, law, rate, at_least(law.limits, AGILE.acceleration, AGILE.jerk))

    @staticmethod
    def _delay(curve: SplineCurve, tvist: Filter) -> float:
        found = []
        for s in np.linspace(float(curve.start[0]), float(curve.end[0]), POSTURES):
            tvist.reset(curve.posture(np.array([s])))
            found.append(tvist.delay)
        return max(VARIATION * max(found), LEAST_WINDOW)


def _told(fitted: Fitted, run: Run, start: float = 0.0) -> Limited | None:
    """Return what slowed a motion, and where; `start` is where the run starts on the motion's curve [m]."""
    told, q, path = fitted.limited, fitted.q, fitted.motion.path
    if told is None or q is None or not isinstance(path, SplineCurve) or not run[0].where:
        return told
    s = np.linspace(start, float(path.end[0]), SAMPLES)
    at = float(s[int(np.argmin(np.abs(path.derivatives(s)[0] - q).max(axis=1)))])
    ends = start + np.cumsum([piece.knots.s[-1] for piece in run])
    piece = run[min(int(np.searchsorted(ends, at)), len(run) - 1)]
    return told[0], f"{told[1]}: on {piece.where}, {at:.3f} m from the start of this part of the path"


class _TooLateError(Exception):
    """A running motion can no longer be extended."""


def _joined(
    moves: list[PlannedMove], route: Route, told: Limited | None, segments: range, start: float = 0.0
) -> PlannedMove:
    """Join the motions of a path; `start` is where the first run starts on its motion's curve [m]."""
    return moves[-1]._replace(
        parts=tuple(part for move in moves for part in move.parts),
        velocity=max(move.velocity for move in moves),
        limited=told,
        skipped=tuple(route.skipped),
        window=max(move.window for move in moves),
        marks=marks_of(route.runs or [[]], segments, start),
    )


def _extendable(
    run: Run,  # the last one of the route
    route: Route,
    curve: SplineCurve,
    ground: PathLimits,
    law: RetimedLaw,
    segments: int,
    window: float,
    start: float = 0.0,  # where the run begins on the curve [m]
) -> ExtendableMotion | None:
    """Return the state from which a motion can be extended; None if its duration was requested."""
    if any(piece.pacing.duration is not None for piece in run):
        return None
    branches = tuple(replace(branch, s=start + branch.s) for branch in route.branches)
    return ExtendableMotion(curve, ground, law, branches, segments, window)


def marks_of(runs: list[Run], segments: range, start: float = 0.0) -> tuple[tuple[int, float], ...]:
    """Return where each segment's end blend begins, see `PlannedMove.marks`; `start` as in `_joined`."""
    marks = dict[int, tuple[int, float]]()
    for part, run in enumerate(runs):
        ends = ((0.0 if part else start) + np.cumsum([piece.knots.s[-1] for piece in run])).tolist()
        for number, piece in enumerate(run):
            # Before another segment, the last piece is the blend.
            last = run[-1].where == piece.where
            segment = int(piece.where[len("segments[") : -1]) if piece.where else 0
            marks[segment] = part, ends[number] - (0.0 if last else float(piece.knots.s[-1]))
    found, here = [], (0, start)
    for segment in segments:
        here = marks.get(segment, here)
        found.append(here)
    return tuple(found)
