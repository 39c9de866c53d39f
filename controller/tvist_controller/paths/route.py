"""Paths of several legs: blends, and stops where there are none."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from tvist_controller.paths.legs import BlendJunction, JointCurve, Leg, LegSpeed, meetings
from tvist_controller.paths.tool_curves import EvenBlend, ToolBlend, ToolCurve, ToolPart, ToolState, evenly
from tvist_controller.paths.tracking import Tracker, TrackingError
from tvist_controller.trajectory.base import Floats
from tvist_controller.trajectory.spline import Knots, SplineCurve

INSIDE, CLOSE = 1.0 + 1e-9, 1e-6
"""Tolerance of a blend's radius for rounding [-] and for the joints' interpolation [m]."""
SMALLEST, SLIVER = 2e-4, 5e-4
"""Smallest blend radius, and shortest remainder between two blends; rounding would slow shorter ones [m]."""
SAME = 1e-9  # posture differences below this are rounding errors [rad]
SHARPEST = 0.15
"""Smallest ratio of a blend's chord to its radius used for its length; it is 0 for a reversal [-]."""
BETWEEN = 8  # places per knot of a blend at which its distance from the corner is checked
SHRINK, TRIES = 0.85, 12
"""Factor by which a blend that leaves its radius is shortened, and number of attempts."""


@dataclass(frozen=True)
class Piece:
    """A leg without its blended parts, or a blend."""

    knots: Knots  # the joints' motion
    pacing: LegSpeed
    bent: ToolBlend | EvenBlend | None  # tool blend whose curvature affects acceleration
    by_joints: bool  # whether acceleration refers to the joints rather than the tool
    where: str  # field of the command


Run = list[Piece]  # pieces without stops between them


@dataclass(frozen=True)
class _Cut:
    before: float  # length of the first leg replaced [m]
    after: float  # length of the second leg replaced [m]
    piece: Piece
    curve: ToolCurve | None  # curve of the tool; None if the joints blend


@dataclass(frozen=True)
class Branch:
    """Point of a run from which further legs may change the rest."""

    s: float  # length of the run up to the point [m]
    legs: tuple[Leg, ...]  # legs from the point on
    begun: float  # length of the first of these legs before the point [m]
    q: Floats  # joint positions there, shape (n,) [rad]
    bend: Floats | None = None  # curvature of two blends that meet there, see `BlendJunction`; else None


class Route(NamedTuple):
    """A path divided into runs, which end at rest."""

    runs: list[Run]
    skipped: list[str]  # message for each omitted blend
    branches: list[Branch]  # points of the last run at which further legs may change it, in order


def route_of(legs: Sequence[Leg], tracker: Tracker, start: Branch | None = None) -> Route:
    """Divide a path into runs at stops from `start` (default: first leg's); raise TrackingError if impossible."""
    route, last = Route([Run()], [], []), len(legs) - 1
    meets = meetings(legs)
    here = start
    for number, leg in enumerate(legs):
        if here is None:
            here = Branch(0.0, (leg,), 0.0, leg.q)
        elif here.bend is not None:
            meets[number] = BlendJunction(here.begun, here.bend)
        cut = _cut_at(number, legs, meets, here, route, tracker)
        if number == last:
            route.branches.append(replace(here, s=length_of(route.runs[-1])))
        end, q = leg.way.length - (0.0 if cut is None else cut.before), here.q
        if end - here.begun > 1e-9 * leg.way.length:
            route.runs[-1].append(_rest_of(leg, here.begun, end, here.q, tracker))
            q = route.runs[-1][-1].knots.q[-1]
        if number == last:
            break
        if cut is None:
            route.runs.append(Run())
            route.branches.clear()
            here = Branch(0.0, (legs[number + 1],), 0.0, q)
            continue
        if number == last - 1:
            meeting = meets[number]
            bend = None if meeting is None else meeting.bend
            route.branches.append(Branch(length_of(route.runs[-1]), tuple(legs[number:]), end, q, bend))
        cut = _from(q, cut, tracker)
        route.runs[-1].append(cut.piece)
        here = Branch(0.0, (legs[number + 1],), cut.after, cut.piece.knots.q[-1])
    _check_joined(route.runs, tracker)
    return route._replace(runs=[run for run in route.runs if run])


def _cut_at(
    number: int,
    legs: Sequence[Leg],
    meets: list[BlendJunction | None],
    here: Branch,
    route: Route,
    tracker: Tracker,
) -> _Cut | None:
    """Return the blend after a leg, or None. If a requested blend is impossible, record the reason."""
    leg = legs[number]
    if leg.blend == 0.0 or number + 1 == len(legs):
        return None
    try:
        return _cut(leg, legs[number + 1], (meets[number], meets[number + 1]), here, tracker)
    except _NoBlendError as error:
        why = f"{leg.where}: the arm stops there, since the blend of {leg.blend:g} m {error}"
        route.skipped.append(why)
        meets[number + 1] = None
        return None


class _NoBlendError(Exception):
    """A blend is impossible; the message states the reason."""


def _check_joined(runs: list[Run], tracker: Tracker) -> None:
    for run in runs:
        for one, other in pairwise(run):
            if np.abs(one.knots.q[-1] - other.knots.q[0]).max() > SAME:
                raise TrackingError(0.0, tracker.pose(one.knots.q[-1]), one.knots.q[-1])


def length_of(run: Run) -> float:
    """Return the length of a run [m]."""
    return sum(float(piece.knots.s[-1]) for piece in run)


def _from(q: Floats, cut: _Cut, tracker: Tracker) -> _Cut:
    """Let a tool blend start at actual posture q, which on redundant arms may differ from the planned one."""
    piece = cut.piece
    if cut.curve is None or np.abs(piece.knots.q[0] - q).max() <= SAME:
        return cut
    return replace(cut, piece=replace(piece, knots=tracker.follow(cut.curve, q)))


def _rest_of(leg: Leg, start: float, end: float, q: Floats, tracker: Tracker) -> Piece:
    """Return the part of a leg between its blends, starting at posture q."""
    if start == 0.0 and end == leg.way.length and (q == leg.q).all():
        return Piece(leg.knots, leg.pacing, None, isinstance(leg.way, JointCurve), leg.where)
    if isinstance(leg.way, JointCurve):
        way = leg.way if start > 0.0 else JointCurve(q, leg.way.end)
        return Piece(way.part(start, min(end, way.length)), leg.pacing, None, True, leg.where)
    return Piece(tracker.follow(ToolPart(leg.way, start, end), q), leg.pacing, None, False, leg.where)


def _cut(
    leg: Leg,
    then: Leg,
    meets: tuple[BlendJunction | None, BlendJunction | None],
    here: Branch,
    tracker: Tracker,
) -> _Cut:
    """Return the blend between two legs, or raise _NoBlendError."""
    radius, left = leg.blend, leg.way.length - here.begun
    if radius < SMALLEST:
        raise _NoBlendError(f"is below the smallest one of {SMALLEST:g} m: give a larger radius")
    for _ in range(TRIES):
        before = _within(leg, radius, tracker, from_end=True)
        after = _within(then, radius, tracker, from_end=False)
        if np.isinf(before) or np.isinf(after):
            raise _NoBlendError("is larger than the part before or after it: give a smaller radius")
        if before > left * INSIDE or after > then.way.length * INSIDE:
            raise _NoBlendError("overlaps the blend beside it: give a smaller radius to one of them")
        before, after = min(before, left), min(after, then.way.length)
        if meets[0] is None and 1e-9 * left < left - before < SLIVER and before > SLIVER:
            radius *= 1.0 - (SLIVER - (left - before)) / before
            continue
        before = before if meets[0] is None else leg.way.length - meets[0].s
        after = after if meets[1] is None else meets[1].s
        try:
            piece, curve = _blend(leg, then, (before, after), meets, here.q, tracker)
        except TrackingError as error:
            why = "passes a singular posture: give a smaller radius, or move the corner"
            raise _NoBlendError(why) from error
        if meets != (None, None):
            return _Cut(before, after, piece, curve)
        s = np.linspace(0.0, piece.knots.s[-1], BETWEEN * (len(piece.knots.s) - 1) + 1)
        postures = SplineCurve(piece.knots).derivatives(s)[0]
        off = [np.linalg.norm(tracker.pose(q).position - leg.corner.position) for q in postures]
        if max(off) <= leg.blend * INSIDE + CLOSE:
            return _Cut(before, after, piece, curve)
        radius *= SHRINK
    raise _NoBlendError("would leave the sphere of its radius: give a smaller one")


def _blend(
    leg: Leg,
    then: Leg,
    lengths: tuple[float, float],
    meets: tuple[BlendJunction | None, BlendJunction | None],
    q: Floats,
    tracker: Tracker,
) -> tuple[Piece, ToolCurve | None]:
    """Return a blend replacing `lengths` of two legs, and the tool curve if any; q is the present posture."""
    pacing, (before, after) = leg.pacing.meeting(then.pacing), lengths
    start = leg.way.length - before
    if isinstance(leg.way, JointCurve) or isinstance(then.way, JointCurve):
        ends = (_joints(leg, start, tracker, from_end=True), _joints(then, after, tracker, from_end=False))
        s = np.array([0.0, before + after])
        knots = Knots(s, *(np.array(pair) for pair in zip(*ends, strict=True)))
        return Piece(knots, pacing, None, True, leg.where), None
    first, last = (
        state if meeting is None else state._replace(second=meeting.bend)
        for state, meeting in zip((leg.way.at(start), then.way.at(after)), meets, strict=True)
    )
    drawn_out = meets != (None, None)
    share = _rounding(leg, first, last, drawn_out=drawn_out)
    blend = ToolBlend(first, last, leg.corner.rotation, share * (before + after))
    curve = blend if drawn_out else evenly(blend)  # an extended blend already has nearly constant speed
    if meets[0] is None:
        q, _, _ = _joints(leg, start, tracker, from_end=True)
    return Piece(tracker.follow(curve, q), pacing, None if pacing.even else curve, False, leg.where), curve


def _rounding(leg: Leg, start: ToolState, end: ToolState, *, drawn_out: bool) -> float:
    """Return a blend's parameter length relative to replaced lengths, for least curvature of its polynomial.

    Fitted to corners of 20° to 170°: the largest curvature is 1.1 to 1.2 times that of an arc. A blend
    extended to meet another has the length of an arc.
    """
    places = [state.pose.position for state in (start, end)]
    away = sum(float(np.linalg.norm(place - leg.corner.position)) for place in places)
    chord = float(np.linalg.norm(places[1] - places[0]))
    if away <= 0.0:
        return 1.0
    if drawn_out:
        return float((chord / away) ** (2.0 / 3.0))
    ratio = max(2.0 * chord / away, SHARPEST)
    return float(0.625 * ratio**0.55)


def _joints(leg: Leg, s: float, tracker: Tracker, *, from_end: bool) -> tuple[Floats, Floats, Floats]:
    """Return joint positions and derivatives at s on a leg, tracked from the posture at its start or end."""
    if isinstance(leg.way, JointCurve):
        return leg.way.at(s)
    corner, near, sign = (leg.way.length, leg.knots.q[-1], -1.0) if from_end else (0.0, leg.knots.q[0], 1.0)
    knots = tracker.follow(ToolPart(leg.way, corner, s), near)
    return knots.q[-1], sign * knots.slope[-1], knots.second[-1]


def _within(leg: Leg, radius: float, tracker: Tracker, *, from_end: bool) -> float:
    if isinstance(leg.way, JointCurve):
        return leg.way.within(radius, lambda q: tracker.pose(q).position, from_end=from_end)
    return leg.way.within(radius)
