"""Time laws of runs: the limits of tool and joints along a run, and the quickest law within them."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tvist_controller.paths.legs import Pacing
from tvist_controller.paths.route import Piece, Run
from tvist_controller.paths.tool_curves import PER_RADIAN
from tvist_controller.trajectory.limits import Floats
from tvist_controller.trajectory.retiming import Cells, RetimedLaw, Way, quickest_law
from tvist_controller.trajectory.spline import Knots, SplineCurve

FINEST, CELLS = 5e-4, 400
"""Smallest length of a cell [m], and the number of cells that a run is divided into if they are not smaller."""
MARGIN = 1.01
"""Factor by which a derivative may exceed its samples within a cell [-]."""
FASTEST = 1e3
"""Factor beyond which a motion is not hurried for its duration, since the joints limit it by far [-]."""
JOLT_SHARE = 0.3
"""Share of the joints' jerk that each effect of the curve may use [-]."""
BRIEFEST = 1e-3
"""Shortest duration that is planned for: shorter ones are as impossible [s]."""
MOMENTS = 500
"""Number of moments at which a motion's velocity is looked at."""
LEAST = 1e-3
"""Smallest derivative that a speed is divided by [-]."""
CLOSE = 1e-6
"""Share by which a duration may be missed [-]."""


@dataclass(frozen=True)
class JointLimits:
    """Limits of each joint on a path."""

    velocity: Floats
    """Shape (n,) [rad/s]."""
    acceleration: Floats
    """Shape (n,) [rad/s^2]."""
    jerk: float
    """Smallest of all joints [rad/s^3]."""


def joined(run: Run) -> Knots:
    """Return the knots of a whole run."""
    first, *rest = (piece.knots for piece in run)
    s, parts = [first.s], list[tuple[Floats, ...]]([first[1:]])
    for knots in rest:
        s.append(s[-1][-1] + knots.s[1:])
        parts.append(tuple(values[1:] for values in knots[1:]))
    return Knots(np.concatenate(s), *(np.concatenate(values) for values in zip(*parts, strict=True)))


def law_of(run: Run, curve: SplineCurve, limits: JointLimits, jerk: float, window: float) -> RetimedLaw:
    """Return the quickest time law of a run, or the one of the duration that was asked for.

    Args:
        run: The run.
        curve: The joints' way along it.
        limits: Limits of the joints.
        jerk: Largest jerk along the path [m/s^3].
        window: Time over which the shaper mixes moments of the motion [s].
    """
    asked = [piece.pacing.duration for piece in run]
    if all(asked):
        jerk = FASTEST * limits.jerk  # durations leave the jerk to the joints
    ground = _ground(run, curve)
    law = quickest_law(ground.way(limits, 1.0), jerk, window)
    if all(asked):
        wanted, hurry = sum({piece.where: piece.pacing.duration or 0.0 for piece in run}.values()), 1.0
        while law.duration > wanted * (1.0 + CLOSE) and hurry < FASTEST:
            hurry = min(1.05 * hurry * law.duration / wanted, FASTEST)
            law = quickest_law(ground.way(limits, hurry), jerk, window)
        law = law.slowed(wanted)
    return _kept(law, curve, limits)


def _kept(law: RetimedLaw, curve: SplineCurve, limits: JointLimits) -> RetimedLaw:
    """The law, slowed down by the per mille by which limits may be exceeded between the samples of a cell."""
    s, sd, sdd = law.states(law.moments)
    _, slope, second = curve.derivatives(s)
    qd = np.abs(slope * sd[:, None])
    qdd = np.abs(slope * sdd[:, None] + second * (sd**2)[:, None])
    excess = max(float((qd / limits.velocity).max()), float(np.sqrt((qdd / limits.acceleration).max())))
    return law.slowed(law.duration * max(excess, 1.0))


def fastest(law: RetimedLaw, curve: SplineCurve) -> float:
    """Largest velocity of any joint in a motion at full rate [rad/s]."""
    s, sd, _ = law.states(np.linspace(0.0, law.duration, MOMENTS))
    return float(np.abs(curve.derivatives(s)[1] * sd[:, None]).max())


@dataclass(frozen=True)
class _Ground:
    """What limits a run, cell by cell, before it is hurried."""

    places: Floats
    """Ends of the cells, shape (c + 1,) [m]."""
    speed: Floats
    """Speed of the tool that was asked for, shape (c,) [m/s]."""
    p: Floats
    """Share of its acceleration per unit of s̈, shape (c,) [s^2/m]."""
    q: Floats
    """Share of its acceleration per unit of ṡ², shape (c,) [s^2/m^2]."""
    slope: Floats
    """Bound of |dq/ds|, shape (c, n) [rad/m]."""
    second: Floats
    """Bound of |d²q/ds²|, shape (c, n) [rad/m^2]."""
    third: Floats
    """Bound of |d³q/ds³| of any joint, shape (c,) [rad/m^3]."""

    def way(self, limits: JointLimits, hurry: float) -> Way:
        """Return the limits of the motion that is faster than asked for by a factor."""
        # Joints jerk by the third derivative times ṡ³, by 3 q'' ṡ s̈, and by q' s⃛: the first two take a share each.
        smooth = np.cbrt(JOLT_SHARE * limits.jerk / np.maximum(self.third, LEAST))
        even = np.minimum(hurry * self.speed, smooth)
        fastest = (limits.velocity / np.maximum(self.slope, LEAST)).min(axis=1)
        bent = 3.0 * self.second.max(axis=1) * np.minimum(even, fastest) / (JOLT_SHARE * limits.jerk)
        return Way(
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


def _ground(run: Run, curve: SplineCurve) -> _Ground:
    largest = max(float(curve.end[0]) / CELLS, FINEST)
    starts = np.concatenate(([0.0], np.cumsum([piece.knots.s[-1] for piece in run])))
    edges, tool = [np.zeros(1)], []
    for piece, (start, end) in zip(run, pairwise(starts.tolist()), strict=True):
        count = max(int(np.ceil((end - start) / largest)), 2)
        places = np.linspace(0.0, end - start, count + 1)
        edges.append(start + places[1:])
        along, bent = _joints(curve, start + places) if piece.by_joints else _tool(piece, places)
        pacing = piece.pacing
        tool.append((pacing.velocity / along, along / pacing.acceleration, bent / pacing.acceleration))
    places = np.concatenate(edges)
    looks = _looks(places)
    slope, second = (_largest(np.abs(values)) for values in curve.derivatives(looks)[1:])
    third = _largest(np.abs(curve.third(looks))).max(axis=1)
    speed, p, q = (np.concatenate(values) for values in zip(*tool, strict=True))
    return _Ground(places, speed, p, q, slope, second, third)


def _tool(piece: Piece, places: Floats) -> tuple[Floats, Floats]:
    """Speed and curvature of the tool per unit of the parameter in each cell: on legs 1 and 0."""
    count = len(places) - 1
    if piece.bent is None:
        return np.ones(count), np.zeros(count)
    along, bent = (_largest(values[:, None])[:, 0] for values in piece.bent.shape(_looks(places)))
    return np.maximum(along, LEAST), bent


def _joints(curve: SplineCurve, places: Floats) -> tuple[Floats, Floats]:
    """The same for the joints' way, in the lengths that turns count as."""
    _, slope, second = curve.derivatives(_looks(places))
    along, bent = (PER_RADIAN * _largest(np.abs(values)).max(axis=1) for values in (slope, second))
    return np.maximum(along, LEAST), bent


def _looks(places: Floats) -> Floats:
    """Both ends and the middle of each cell, shape (2 c + 1,)."""
    looks = np.empty(2 * len(places) - 1)
    looks[::2], looks[1::2] = places, 0.5 * (places[:-1] + places[1:])
    return looks


def _largest(values: Floats) -> Floats:
    """Bounds of values sampled at `_looks`, for each cell, shape (c, m)."""
    ends = np.maximum(values[:-1:2], values[2::2])
    found: Floats = MARGIN * np.maximum(ends, values[1::2])
    return found


def timed(pacing: Pacing, length: float) -> Pacing:
    """Return the pacing of a leg; for a duration, that of a trapezoid which speeds up and brakes for a third of it."""
    if pacing.duration is None:
        return pacing
    duration = max(pacing.duration, BRIEFEST)
    velocity = 1.5 * length / duration
    return Pacing(velocity, 3.0 * velocity / duration, duration, pacing.even)
