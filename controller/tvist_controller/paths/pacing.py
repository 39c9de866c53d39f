"""The quickest time law of a path between stops, within limits of tool and joints."""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from tvist_controller.paths.legs import LegSpeed
from tvist_controller.paths.route import Piece, Run
from tvist_controller.paths.tool_curves import PER_RADIAN
from tvist_controller.trajectory.base import Floats
from tvist_controller.trajectory.retiming import Cells, RetimedLaw, RetimingLimits, longer_law, quickest_law
from tvist_controller.trajectory.spline import Knots, SplineCurve

FINEST, CELLS = 5e-4, 400  # smallest cell length [m], and largest number of cells of a run
MARGIN = 1.01  # factor by which a derivative may exceed its samples within a cell [-]
FASTEST = 1e3  # largest speed-up factor for a requested duration; joint limits apply long before [-]
JOLT_SHARE = 0.3  # fraction of joint jerk available to each of the two jerk terms of the curve's shape [-]
BRIEFEST = 1e-3  # shortest duration planned for [s]
TRIES = 4  # attempts to plan an extended motion more slowly after slightly exceeding limits
MOMENTS = 500  # number of moments at which a motion's velocity is checked
MIN_DERIVATIVE = 1e-3  # smallest derivative by which a speed is divided [-]
CLOSE = 1e-6  # permitted relative error of a duration [-]


@dataclass(frozen=True)
class JointLimits:
    """Limits of each joint on a path."""

    velocity: Floats  # shape (n,) [rad/s]
    acceleration: Floats  # shape (n,) [rad/s^2]
    jerk: float  # smallest over all joints [rad/s^3]


def joined(run: Run, before: Knots | None = None) -> Knots:
    """Return the knots of a run, optionally behind other knots."""
    first, *rest = ([] if before is None else [before]) + [piece.knots for piece in run]
    s, parts = [first.s], list[tuple[Floats, ...]]([first[1:]])
    for knots in rest:
        s.append(s[-1][-1] + knots.s[1:])
        parts.append(tuple(values[1:] for values in knots[1:]))
    return Knots(np.concatenate(s), *(np.concatenate(values) for values in zip(*parts, strict=True)))


def law_of(
    run: Run,
    curve: SplineCurve,  # the joints' motion along the run
    ground: "PathLimits",
    limits: JointLimits,
    jerk: float,  # largest along the path [m/s^3]
    window: float,  # time over which the shaper mixes moments of the motion [s]
    *,
    goes_on: bool = False,  # whether another run may continue this one
) -> RetimedLaw:
    """Return the quickest time law of a run, or the one with the requested duration."""
    asked = [piece.pacing.duration for piece in run]
    if all(asked):
        jerk = FASTEST * limits.jerk  # with a duration, only the joints limit the jerk
    law = quickest_law(ground.way(limits, 1.0), jerk, window, goes_on=goes_on)
    if all(asked):
        wanted, hurry = sum({piece.where: piece.pacing.duration or 0.0 for piece in run}.values()), 1.0
        while law.duration > wanted * (1.0 + CLOSE) and hurry < FASTEST:
            hurry = min(1.05 * hurry * law.duration / wanted, FASTEST)
            law = quickest_law(ground.way(limits, hurry), jerk, window)
        law = law.slowed(wanted)
    # Between samples the law may exceed limits by some per mille; slow it down by that.
    return law.slowed(law.duration * max(_excess(law, law.moments, curve, limits), 1.0))


def going_on(
    before: RetimedLaw,
    edges: tuple[int, int],  # edge of `before` at which the law begins, and number of equal edges behind it
    ground: "PathLimits",  # limits from that edge on
    curve: SplineCurve,
    limits: JointLimits,
    jerk: float,
    window: float,
    slower: float,  # factor of the law's speed, at most 1 [-]
) -> RetimedLaw | None:
    """Return the quickest law that extends another; see `longer_law`, other arguments as in `law_of`."""
    first, known = edges
    for _ in range(TRIES):
        slowed = JointLimits(
            limits.velocity * slower, limits.acceleration * slower**2, limits.jerk * slower**3
        )
        law = longer_law(ground.way(slowed, slower), jerk, window, before, first, known)
        if law is None:
            return None
        moments = law.moments
        excess = _excess(law, moments[moments >= law.times[known] / law.rate], curve, limits)
        if excess <= 1.0:
            return law
        slower /= excess * MARGIN
    return None


def _excess(law: RetimedLaw, moments: Floats, curve: SplineCurve, limits: JointLimits) -> float:
    """Return the largest ratio, at some moments, of speed to the speed that would keep joint limits [-]."""
    velocity, acceleration = shares(law, moments, curve, limits)
    return max(float(velocity.max()), float(np.sqrt(acceleration.max())))


def shares(
    law: RetimedLaw, moments: Floats, curve: SplineCurve, limits: JointLimits
) -> tuple[Floats, Floats]:
    """Return each joint's largest velocity and acceleration relative to its limits, each (n,) [-]."""
    s, sd, sdd = law.states(moments)
    _, slope, second = curve.derivatives(s)
    qd = np.abs(slope * sd[:, None])
    qdd = np.abs(slope * sdd[:, None] + second * (sd**2)[:, None])
    return qd.max(axis=0) / limits.velocity, qdd.max(axis=0) / limits.acceleration


def fastest(law: RetimedLaw, curve: SplineCurve) -> float:
    """Return the largest joint velocity of a motion at full rate [rad/s]."""
    s, sd, _ = law.states(np.linspace(law.begins, law.duration, MOMENTS))
    return float(np.abs(curve.derivatives(s)[1] * sd[:, None]).max())


class PathLimits(NamedTuple):
    """Limits of a run, cell by cell, without a speed-up factor."""

    places: Floats  # cell boundaries, shape (c + 1,) [m]
    speed: Floats  # requested tool speed, shape (c,) [m/s]
    p: Floats  # fraction of the tool's acceleration limit per unit of s̈, shape (c,) [s^2/m]
    q: Floats  # fraction of the tool's acceleration limit per unit of ṡ², shape (c,) [s^2/m^2]
    slope: Floats  # bound of |dq/ds|, shape (c, n) [rad/m]
    second: Floats  # bound of |d²q/ds²|, shape (c, n) [rad/m^2]
    third: Floats  # bound of |d³q/ds³| of any joint, shape (c,) [rad/m^3]

    def then(self, first: int, last: int, run: Run, curve: SplineCurve) -> "PathLimits":
        """Return the limits of the part between edges `first` and `last`, followed by a run, on a curve."""
        further = ground_of(run, curve, float(self.places[last]))
        places = np.concatenate((self.places[first : last + 1], further.places[1:]))
        pairs = zip(self[1:], further[1:], strict=True)
        ground = PathLimits(places, *(np.concatenate((own[first:last], other)) for own, other in pairs))
        if last > first:  # a spline's third derivative at a knot is that behind it, which has changed here
            looks = _looks(self.places[last - 1 : last + 1])
            ground.third[last - first - 1] = _largest(np.abs(curve.third(looks))).max()
        return ground

    def way(self, limits: JointLimits, hurry: float) -> RetimingLimits:
        """Return the limits of the motion sped up by the factor `hurry`."""
        # Joint jerk: q''' ṡ³ + 3 q'' ṡ s̈ + q' s⃛; each of the first two terms gets a share of the limit.
        smooth = np.cbrt(JOLT_SHARE * limits.jerk / np.maximum(self.third, MIN_DERIVATIVE))
        even = np.minimum(hurry * self.speed, smooth)
        fastest = (limits.velocity / np.maximum(self.slope, MIN_DERIVATIVE)).min(axis=1)
        bent = 3.0 * self.second.max(axis=1) * np.minimum(even, fastest) / (JOLT_SHARE * limits.jerk)
        return RetimingLimits(
            self.places,
            Cells(fastest, self.slope / limits.acceleration, self.second / limits.acceleration),
            Cells(
                even,
                np.column_stack((self.p / hurry**2, bent)),
                np.column_stack((self.q / hurry**2, np.zeros(len(bent)))),
            ),
            self.slope.max(axis=1),
            (1.0 - 2.0 * JOLT_SHARE) * limits.jerk,
        )


def ground_of(run: Run, curve: SplineCurve, start: float = 0.0) -> PathLimits:
    """Return the limits of a run whose first point is at length `start` of a curve [m]."""
    largest = max((float(curve.end[0]) - start) / CELLS, FINEST)
    starts = start + np.concatenate(([0.0], np.cumsum([piece.knots.s[-1] for piece in run])))
    edges, tool = [np.array([start])], []
    for piece, (here, end) in zip(run, pairwise(starts.tolist()), strict=True):
        cells = max(int(np.ceil((end - here) / largest)), 2)
        places = np.linspace(0.0, end - here, cells + 1)
        edges.append(here + places[1:])
        along, bent = _joints(curve, here + places) if piece.by_joints else _tool(piece, places)
        pacing = piece.pacing
        tool.append((pacing.velocity / along, along / pacing.acceleration, bent / pacing.acceleration))
    places = np.concatenate(edges)
    looks = _looks(places)
    slope, second = (_largest(np.abs(values)) for values in curve.derivatives(looks)[1:])
    third = _largest(np.abs(curve.third(looks))).max(axis=1)
    speed, p, q = (np.concatenate(values) for values in zip(*tool, strict=True))
    return PathLimits(places, speed, p, q, slope, second, third)


def _tool(piece: Piece, places: Floats) -> tuple[Floats, Floats]:
    """Return the tool's speed and second derivative per unit of parameter in each cell; 1 and 0 on legs."""
    count = len(places) - 1
    if piece.bent is None:
        return np.ones(count), np.zeros(count)
    along, bent = (_largest(values[:, None])[:, 0] for values in piece.bent.shape(_looks(places)))
    return np.maximum(along, MIN_DERIVATIVE), bent


def _joints(curve: SplineCurve, places: Floats) -> tuple[Floats, Floats]:
    """Return the same as `_tool` for the joints' motion, with turns counted as lengths (`PER_RADIAN`)."""
    _, slope, second = curve.derivatives(_looks(places))
    along, bent = (PER_RADIAN * _largest(np.abs(values)).max(axis=1) for values in (slope, second))
    return np.maximum(along, MIN_DERIVATIVE), bent


def _looks(places: Floats) -> Floats:
    """Return the places where limits are sampled: both ends and the middle of each cell, shape (2 c + 1,)."""
    looks = np.empty(2 * len(places) - 1)
    looks[::2], looks[1::2] = places, 0.5 * (places[:-1] + places[1:])
    return looks


def _largest(values: Floats) -> Floats:
    """Return bounds for each cell of values sampled at `_looks`, shape (c, m)."""
    ends = np.maximum(values[:-1:2], values[2::2])
    return np.asarray(MARGIN * np.maximum(ends, values[1::2]))


def timed(pacing: LegSpeed, length: float) -> LegSpeed:
    """Return a leg's speed limits; for a duration, those of a trapezoid whose two ramps take a third each."""
    if pacing.duration is None:
        return pacing
    duration = max(pacing.duration, BRIEFEST)
    velocity = 1.5 * length / duration
    return LegSpeed(velocity, 3.0 * velocity / duration, duration, pacing.even)
