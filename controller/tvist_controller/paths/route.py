"""Paths of several legs: blends between them, and stops where there are none."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from tvist_controller.paths.by_length import EvenBlend, evenly
from tvist_controller.paths.legs import JointWay, Leg, Pacing
from tvist_controller.paths.tool_curves import ToolBlend, ToolCurve, ToolPart, ToolState
from tvist_controller.paths.tracking import Tracker, WayError
from tvist_controller.trajectory.limits import Floats
from tvist_controller.trajectory.spline import Knots, SplineCurve

INSIDE, CLOSE = 1.0 + 1e-9, 1e-6
"""Factor by which rounding, and length by which the joints' interpolation, may exceed a blend's radius [-, m]."""
SMALLEST, SLIVER = 2e-4, 5e-4
"""Smallest radius of a blend, and shortest rest of a part between two: rounding would slow shorter ones down [m]."""
SAME = 1e-9
"""Difference between postures that is rounding [rad]."""
SHARPEST = 0.15
"""Smallest ratio of a blend's chord to its radius for its length; it is 0 where the tool goes back as it came [-]."""
BETWEEN = 8
"""Number of places for each knot of a blend at which its distance from the corner is looked at."""
SHRINK, TRIES = 0.85, 12
"""Factor by which a blend that leaves its radius begins closer to the corner, and how often that is tried."""


@dataclass(frozen=True)
class Piece:
    """A leg without what its blends replace, or a blend."""

    knots: Knots
    """The joints' way."""
    pacing: Pacing
    bent: ToolBlend | EvenBlend | None
    """Blend of the tool whose curvature counts for the acceleration."""
    by_joints: bool
    """Whether the joints' acceleration counts rather than the tool's."""
    where: str
    """Field of the command that it comes from."""


Run = list[Piece]
"""Pieces without a stop between them."""


@dataclass(frozen=True)
class _Cut:
    """A blend between two legs."""

    before: float
    """Length of the first leg that it replaces [m]."""
    after: float
    """Length of the second leg that it replaces [m]."""
    piece: Piece
    curve: ToolCurve | None
    """Way of the tool; None if the joints' way is the blend."""


@dataclass(frozen=True)
class Branch:
    """Place of a run behind which further legs may change it."""

    s: float
    """Length of the run up to there [m]."""
    legs: tuple[Leg, ...]
    """The legs from there on."""
    begun: float
    """Length of the first of them that lies before the place [m]."""
    q: Floats
    """Joint positions there, shape (n,) [rad]."""


class Route(NamedTuple):
    """A path, divided into runs."""

    runs: list[Run]
    skipped: list[str]
    """A sentence for each blend that is left out."""
    branches: tuple[Branch, ...]
    """Places at which its last run may go on otherwise than to the end of the last leg, in their order."""


def route_of(legs: Sequence[Leg], tracker: Tracker, begun: float = 0.0, here: Floats | None = None) -> Route:
    """Divide a path into runs.

    Args:
        legs: The path.
        tracker: Kinematics of the arm.
        begun: Length of the first leg that lies before the path [m].
        here: Joint positions at the start, shape (n,) [rad]; None for those of the first leg.

    Raises:
        WayError: The joints cannot follow the path; beside a singular posture two ways lead on from it.
    """
    runs, skipped, branches = [Run()], list[str](), list[Branch]()
    cut: _Cut | None
    if here is None:
        here = legs[0].q if legs else np.empty(0)
    for number, leg in enumerate(legs):
        cut, length = None, leg.way.length
        if leg.blend > 0.0 and number + 1 < len(legs):
            found = _cut(leg, legs[number + 1], length - begun, tracker)
            if isinstance(found, str):
                skipped.append(
                    f"{leg.where}: the arm stops there, since the blend of {leg.blend:g} m {found}"
                )
            else:
                cut = found
        end = length - (0.0 if cut is None else cut.before)
        if number == len(legs) - 1:
            branches.append(Branch(length_of(runs[-1]), (leg,), begun, here))
        if end - begun > 1e-9 * length:
            runs[-1].append(_rest_of(leg, begun, end, here, tracker))
            here = runs[-1][-1].knots.q[-1]
        if cut is None:
            if number < len(legs) - 1:
                runs.append(Run())
            begun = 0.0
            continue
        if number == len(legs) - 2:
            branches.append(Branch(length_of(runs[-1]), tuple(legs[number:]), end, here))
        cut = _from(here, cut, tracker)
        here = cut.piece.knots.q[-1]
        runs[-1].append(cut.piece)
        begun = cut.after
    for run in runs:
        for one, other in pairwise(run):
            if np.abs(one.knots.q[-1] - other.knots.q[0]).max() > SAME:
                raise WayError(0.0, tracker.pose(one.knots.q[-1]), one.knots.q[-1])
    return Route([run for run in runs if run], skipped, tuple(branches))


def length_of(run: Run) -> float:
    """Length of a run [m]."""
    return sum(float(piece.knots.s[-1]) for piece in run)


def _from(q: Floats, cut: _Cut, tracker: Tracker) -> _Cut:
    """A blend of the tool that begins where the joints are: a redundant arm may come there in other postures."""
    piece = cut.piece
    if cut.curve is None or np.abs(piece.knots.q[0] - q).max() <= SAME:
        return cut
    return replace(cut, piece=replace(piece, knots=tracker.follow(cut.curve, q)))


def _rest_of(leg: Leg, start: float, end: float, q: Floats, tracker: Tracker) -> Piece:
    """The part of a leg that its blends leave, from where the joints are."""
    if start == 0.0 and end == leg.way.length and (q == leg.q).all():
        return Piece(leg.knots, leg.pacing, None, isinstance(leg.way, JointWay), leg.where)
    if isinstance(leg.way, JointWay):
        way = leg.way if start > 0.0 else JointWay(q, leg.way.end)
        return Piece(way.part(start, min(end, way.length)), leg.pacing, None, True, leg.where)
    return Piece(tracker.follow(ToolPart(leg.way, start, end), q), leg.pacing, None, False, leg.where)


def _cut(leg: Leg, then: Leg, left: float, tracker: Tracker) -> _Cut | str:
    """The blend between two legs, or why there is none."""
    radius = leg.blend
    if radius < SMALLEST:
        return f"is below the smallest one of {SMALLEST:g} m: give a larger radius"
    for _ in range(TRIES):
        before = _within(leg, radius, tracker, from_end=True)
        after = _within(then, radius, tracker, from_end=False)
        if np.isinf(before) or np.isinf(after):
            return "is larger than the part before or after it: give a smaller radius"
        if before > left * INSIDE or after > then.way.length * INSIDE:
            return "overlaps the blend beside it: give a smaller radius to one of them"
        before, after = min(before, left), min(after, then.way.length)
        if 1e-9 * left < left - before < SLIVER and before > SLIVER:
            radius *= 1.0 - (SLIVER - (left - before)) / before
            continue
        try:
            piece, curve = _blend(leg, then, before, after, tracker)
        except WayError:
            return "passes a singular posture: give a smaller radius, or move the corner"
        postures = _middle(piece.knots)
        off = [np.linalg.norm(tracker.pose(q).position - leg.corner.position) for q in postures]
        if max(off) <= leg.blend * INSIDE + CLOSE:
            return _Cut(before, after, piece, curve)
        radius *= SHRINK
    return "would leave the sphere of its radius: give a smaller one"


def _blend(
    leg: Leg, then: Leg, before: float, after: float, tracker: Tracker
) -> tuple[Piece, ToolCurve | None]:
    pacing, start = leg.pacing.meeting(then.pacing), leg.way.length - before
    if isinstance(leg.way, JointWay) or isinstance(then.way, JointWay):
        ends = (_joints(leg, start, tracker, from_end=True), _joints(then, after, tracker, from_end=False))
        s = np.array([0.0, before + after])
        knots = Knots(s, *(np.array(pair) for pair in zip(*ends, strict=True)))
        return Piece(knots, pacing, None, True, leg.where), None
    states = leg.way.at(start), then.way.at(after)
    curve = evenly(ToolBlend(*states, leg.corner.rotation, _rounding(leg, *states) * (before + after)))
    q, _, _ = _joints(leg, start, tracker, from_end=True)
    return Piece(tracker.follow(curve, q), pacing, None if pacing.even else curve, False, leg.where), curve


def _rounding(leg: Leg, start: ToolState, end: ToolState) -> float:
    """Length of a blend, as a share of what it replaces, with which its polynomial is curved least.

    Found by trial for corners of 20° to 170°: its largest curvature is then 1.1 to 1.2 times that of an arc.
    """
    places = [state.pose.position for state in (start, end)]
    away = sum(float(np.linalg.norm(place - leg.corner.position)) for place in places)
    chord = float(np.linalg.norm(places[1] - places[0]))
    if away <= 0.0:
        return 1.0
    ratio = max(2.0 * chord / away, SHARPEST)
    return float(0.625 * ratio**0.55)


def _joints(leg: Leg, s: float, tracker: Tracker, *, from_end: bool) -> tuple[Floats, Floats, Floats]:
    """Joint positions on a leg and their derivatives, followed from the posture at one of its ends."""
    if isinstance(leg.way, JointWay):
        return leg.way.at(s)
    corner, near, sign = (leg.way.length, leg.knots.q[-1], -1.0) if from_end else (0.0, leg.knots.q[0], 1.0)
    knots = tracker.follow(ToolPart(leg.way, corner, s), near)
    return knots.q[-1], sign * knots.slope[-1], knots.second[-1]


def _within(leg: Leg, radius: float, tracker: Tracker, *, from_end: bool) -> float:
    if isinstance(leg.way, JointWay):
        return leg.way.within(radius, lambda q: tracker.pose(q).position, from_end=from_end)
    return leg.way.within(radius)


def _middle(knots: Knots) -> Floats:
    """Postures at the knots and between them, shape (k, n)."""
    return SplineCurve(knots).derivatives(np.linspace(0.0, knots.s[-1], BETWEEN * (len(knots.s) - 1) + 1))[0]
