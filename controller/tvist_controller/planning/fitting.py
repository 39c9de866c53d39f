"""Planning of motions as quick as requested, or as limits permit; near limits, by shaping them in advance."""

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tvist_controller.foresight.stops import MAX_AHEAD, LineSimulation
from tvist_controller.kinematics.arm import InverseDynamics
from tvist_controller.line.differentiator import Floats, ShapedReference, central_differences
from tvist_controller.line.line_filter import LineFilter
from tvist_controller.planning.slower import Binding, Limited, lasts, limit_of
from tvist_controller.planning.snapshot import PlanningState
from tvist_controller.setup import Setup, body
from tvist_controller.trajectory import JointLine, MotionLimits, PlannedMotion, quickest_motion
from tvist_plant.plant import PERIOD
from tvist_shaping.base import Filter

EASY = MotionLimits(velocity=1.5, acceleration=2.0, jerk=100.0)
"""Limits up to which a filter's `excess` was determined and holds."""
KEEPING_TRIES = 4  # number of trial motions to keep the requested acceleration
SHARE = 1.0 - 1e-4  # fraction of the limit to aim at; the peak varies slightly with the motion [-]
TRIES = 10  # number of trial motions before each further one is slower by a fraction that doubles
HASTE = 0.001  # the first of these fractions [-]
SPLIT = 6  # number of trials that reduce velocity or acceleration alone; further ones reduce both
SAMPLES = 64
"""Number of evenly spaced moments checked, in addition to those of the law, if not shaped in advance."""
BLUNTED = 1.05  # largest ratio of the shaped motion's torque to the unshaped motion's, due to the lag [-]
ROUNDING = 1e-6  # relative excess of a limit that counts as rounding [-]
MIN_TORQUE_SHARE = 0.01
"""Smallest usable fraction of a motion's own torque; below it, gravity alone exceeds the limit [-]."""


class SlowdownFactors(NamedTuple):
    """Factors of a motion's velocity and acceleration, at most 1 [-]."""

    velocity: float = 1.0
    acceleration: float = 1.0

    @property
    def rate(self) -> float:
        """Time rate at which the motion keeps both factors [-]."""
        return min(self.velocity, math.sqrt(self.acceleration))


AS_ASKED = SlowdownFactors()


class RequiredSlowdown(NamedTuple):
    """How much slower a motion must be, and the limit that requires it."""

    slower: SlowdownFactors
    binding: Binding  # the limit
    q: Floats  # posture at which it would be exceeded most, shape (n,) [rad]
    exceeds: str | None = None  # message if a torque limit is exceeded at any speed; else None


class Fitted(NamedTuple):
    """A motion within the limits."""

    motion: PlannedMotion
    slower: SlowdownFactors = AS_ASKED  # how much slower the motion is than requested
    limited: Limited | None = None  # limit that slows it down, or that it exceeds; see `PlannedMove.limited`
    q: Floats | None = None  # posture in which the limit applies, shape (n,) [rad]; None without one


class Fitter:
    """Plans motions within one robot's joint limits."""

    def __init__(self, setup: Setup) -> None:
        self._dynamics = InverseDynamics(setup.description, body(setup.payload))
        self._description, limits = setup.description, setup.description.limits
        self._velocity, self._acceleration = np.array(limits.velocity), np.array(limits.acceleration)
        self._torque = np.array(limits.torque)

    def fit(
        self,
        make: Callable[[SlowdownFactors], PlannedMotion],
        now: PlanningState,
        tvist: Callable[[], Filter] | None,
        limits: MotionLimits | None = None,
    ) -> Fitted:
        """Plan a motion; while it exceeds a limit, plan it again more slowly.

        Near a limit, the motion is shaped in advance by the filter from `tvist`. With None, to save time, the
        filter's `excess_at_limits` is kept free instead. `limits` are the requested ones; None if something
        else sets the speed.
        """
        asked, need, slower = make(AS_ASKED), None, AS_ASKED
        motion = asked
        for number in itertools.count():
            if (found := self._need(motion, now, tvist)) is None:
                break
            if found.exceeds is not None:
                return Fitted(asked, limited=("limit_torque", found.exceeds))
            by = found.slower
            need = found if need is None else min(need, found, key=lambda each: each.slower.rate)
            if number >= SPLIT:
                # A shaper's duration is constant, so a slower motion may use more of a limit than the last.
                most = 1.0 - min(HASTE * 2.0 ** (number - TRIES), 0.5) if number >= TRIES else 1.0
                rate = min(by.rate, most)
                by = SlowdownFactors(rate, rate**2)
            slower = SlowdownFactors(slower.velocity * by.velocity, slower.acceleration * by.acceleration)
            motion = make(slower)
        if need is None:
            return Fitted(motion)
        if limits is None:
            what = lasts(motion.duration, asked.duration)
        else:
            fast = slower.velocity <= slower.acceleration
            which, unit = ("velocity", "rad/s") if fast else ("acceleration", "rad/s²")
            most = getattr(limits, which)
            what = f"{which} is {most * getattr(slower, which):.4g} of {most:.4g} {unit}"
        return Fitted(motion, slower, need.binding.makes(what), need.q)

    def _need(
        self, motion: PlannedMotion, now: PlanningState, tvist: Callable[[], Filter] | None
    ) -> RequiredSlowdown | None:
        """Return how much to slow a motion: by a bound with `excess_at_limits` or, if too much, as shaped."""
        q, qd, qdd = _states(motion)
        faster, harder = (1.0 + more for more in now.excess_at_limits)
        qd, qdd = faster * qd, harder * qdd
        found = self._exceeded(q, qd, qdd, qd, now, BLUNTED)
        ahead = None if found is None or tvist is None else shaped_ahead(motion, tvist())
        if ahead is None:
            return found
        q, qd, qdd = central_differences(ahead)
        return self._exceeded(q, qd, qdd, np.diff(ahead, axis=0) / PERIOD, now, 1.0)

    def _exceeded(
        self, q: Floats, qd: Floats, qdd: Floats, speeds: Floats, now: PlanningState, blunted: float
    ) -> RequiredSlowdown | None:
        """Return how much slower a motion must be for all limits; `speeds` are the velocities to check."""
        needs = self._kinematic(q, speeds, qdd), self._dynamic(q, qd, qdd, blunted, now)
        found = [need for need in needs if need is not None]
        return min(found, key=lambda need: need.slower.rate, default=None)

    def _kinematic(self, q: Floats, qd: Floats, qdd: Floats) -> RequiredSlowdown | None:
        """Return how much slower a motion must be for joint velocities and accelerations."""
        fast = np.abs(qd).max(axis=0, initial=0.0) / self._velocity
        hard = np.abs(qdd).max(axis=0, initial=0.0) / self._acceleration
        factors = [SHARE / float(most) if most > 1.0 + ROUNDING else 1.0 for most in (fast.max(), hard.max())]
        slower = SlowdownFactors(*factors)
        if slower == AS_ASKED:
            return None
        by_velocity = slower.velocity <= math.sqrt(slower.acceleration)
        joint = int(np.argmax(fast if by_velocity else hard))
        values = (qd if by_velocity else qdd)[:, joint]
        binding = limit_of("velocity" if by_velocity else "acceleration", joint, self._description)
        return RequiredSlowdown(slower, binding, q[min(int(np.argmax(np.abs(values))), len(q) - 1)])

    def _dynamic(
        self, q: Floats, qd: Floats, qdd: Floats, blunted: float, now: PlanningState
    ) -> RequiredSlowdown | None:
        """Return how much slower a motion must be for torques: in acceleration, velocity or both."""
        dynamics, limits, factors = self._dynamics, self._torque, [1.0, 1.0]
        worst, need = 1.0, None
        for parameters in now.bodies:
            dynamics.use_bodies((parameters,))
            gravity = dynamics.gravities(q)
            moving = blunted * (dynamics.torques(q, qd, qdd) - gravity)
            effort = np.abs(gravity + moving)
            beyond = effort > limits * (1.0 + ROUNDING)
            if not beyond.any():
                continue
            share = np.where(
                beyond,
                (limits - np.sign(moving) * gravity) / np.maximum(np.abs(moving), MIN_TORQUE_SHARE),
                1.0,
            )
            least, joint = float(share.min()), int(np.argmin(share.min(axis=0)))
            if least < worst:
                worst, which = least, limit_of("torque", joint, self._description)
                need = RequiredSlowdown(AS_ASKED, which, q[int(np.argmin(share[:, joint]))])
            if need is not None and least < MIN_TORQUE_SHARE:
                limit, most = limits[joint], float(effort[:, joint].max())
                exceeds = (
                    f"torque of joint {self._description.robot.joints[joint]} will reach {most:.0f} N m, "
                    f"{most - limit:.1f} beyond its limit of {limit:g}, since gravity alone takes it: "
                    "choose another way, or a lighter payload"
                )
                return need._replace(slower=SlowdownFactors(0.0, 0.0), exceeds=exceeds)
            turning = dynamics.torques(q, qd, np.zeros_like(qdd)) - gravity
            steady = 2.0 * np.abs(turning) > np.abs(moving)
            for number, part in enumerate((steady, ~steady)):
                lowest = float(np.where(beyond & part, share, 1.0).min())
                if lowest < 1.0:
                    factors[number] = min(factors[number], SHARE * lowest ** (0.5, 1.0)[number])
        return None if need is None else need._replace(slower=SlowdownFactors(*factors))


def _states(motion: PlannedMotion) -> tuple[Floats, Floats, Floats]:
    """Return unshaped positions, velocities and accelerations, each (k, n), also at the law's `moments`."""
    begins, moments = motion.law.begins, motion.law.moments
    known = moments[(moments > begins) & (moments < motion.duration)]
    return motion.states(np.union1d(np.linspace(begins, motion.duration, SAMPLES), known))


def keeping_motion(
    path: JointLine,
    limits: MotionLimits,  # of the shaped reference for every joint
    tvist: Filter,  # which is not changed
    speed: float = 1.0,  # initial time rate [-]
    agility: MotionLimits | None = None,  # of pauses and speed changes; None for `limits`
) -> PlannedMotion:
    """Return the quickest motion whose shaped reference keeps the limits.

    If a filter's weights vary with posture, it adds to the acceleration: within the limits `EASY`, at most
    the share `excess`. Beyond `EASY`, the motion is shaped in advance, and planned again with less
    acceleration if necessary. Raise ValueError if there is no such motion.
    """
    easy = tvist.excess == 0.0 or not (
        limits.velocity > EASY.velocity or limits.acceleration > EASY.acceleration or limits.jerk > EASY.jerk
    )
    share = 1.0 - tvist.excess
    for _ in range(KEEPING_TRIES):
        reduced = replace(limits, acceleration=limits.acceleration * share)
        motion = quickest_motion(path, reduced, speed, agility)
        if easy:
            break
        if (ahead := shaped_ahead(motion, tvist)) is None:
            break
        most = float(np.abs(np.diff(ahead, 2, axis=0)).max(initial=0.0)) / PERIOD**2
        if most <= limits.acceleration:
            break
        share *= SHARE * limits.acceleration / most
    return motion


def shaped_ahead(motion: PlannedMotion, tvist: Filter) -> Floats | None:
    """Return the shaped references at full rate, (k, n) [rad], None if too many; arguments stay unchanged."""
    path, mine = motion.path, tvist.fork()
    shaped = ShapedReference(path.posture(path.start))
    shaped.enter(path.posture_of, path.start)
    line_filter = LineFilter(mine, motion.limits)
    line_filter.begin(mine, path.start, path.posture_of)
    mine.aim(path.end)
    ahead = LineSimulation(motion.paced_at(1.0), line_filter, shaped)
    ahead.until(MAX_AHEAD)
    return np.array(ahead.references) if ahead.rests else None
