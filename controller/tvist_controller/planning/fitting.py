"""Motions as quick as asked, or as much slower as the limits of the joints and of their torques require.

Near a limit, a motion is shaped ahead.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tvist_controller.foresight.line_copy import MAX_AHEAD, LineSimulation
from tvist_controller.line.differentiator import Floats, central_differences
from tvist_controller.line.inverse_dynamics import InverseDynamics
from tvist_controller.line.line_filter import LineFilter
from tvist_controller.line.shaped_reference import ShapedReference
from tvist_controller.planning.slower import Binding, Limited, lasts, limit_of
from tvist_controller.planning.snapshot import Snapshot
from tvist_controller.setup import Setup, body
from tvist_controller.trajectory import JointLine, MotionLimits, PlannedMotion, quickest_motion
from tvist_plant.plant import PERIOD
from tvist_shaping.base import Filter

EASY = MotionLimits(velocity=1.5, acceleration=2.0, jerk=100.0)
"""Limits up to which a filter's `excess` is sure, since it was determined there."""
KEEPING_TRIES = 4
"""Number of motions that are tried to keep the acceleration that was asked for."""
SHARE = 1.0 - 1e-4
"""Share of the limit that is aimed at [-], since the peak changes a little with the motion."""
TRIES = 10
"""Number of motions that are tried before each further one is slower by a share that doubles."""
HASTE = 0.001
"""The first such share [-]."""
SPLIT = 6
"""Number of tries in which either the velocity or the acceleration is reduced, before both are."""
LOOKS = 64
"""Number of evenly spaced moments at which a motion is looked at that is not shaped ahead, beside those of its law."""
BLUNTED = 1.05
"""Largest ratio of the shaped motion's torque to that of the unshaped motion, behind which it lags [-]."""
ROUNDING = 1e-6
"""Share by which rounding may exceed a limit [-]."""
LEAST = 0.01
"""Smallest share of a motion's own torque that is worth trying [-]: with less, gravity is what exceeds the limit."""


class Slower(NamedTuple):
    """Factors of a motion's velocity and acceleration, at most 1 [-]."""

    velocity: float = 1.0
    acceleration: float = 1.0

    @property
    def rate(self) -> float:
        """Rate at which the whole motion keeps both [-]."""
        return min(self.velocity, math.sqrt(self.acceleration))


AS_ASKED = Slower()


class Need(NamedTuple):
    """How much slower a motion has to be, and for which limit."""

    slower: Slower
    binding: Binding
    """That limit."""
    q: Floats
    """Posture in which it would be exceeded most, shape (n,) [rad]."""
    exceeds: str | None = None
    """By how much it exceeds a torque limit at any speed, in words; None if it does not."""


class Fitted(NamedTuple):
    """A motion within the limits."""

    motion: PlannedMotion
    slower: Slower = AS_ASKED
    """How much slower it is than asked."""
    limited: Limited | None = None
    """What makes it slower than asked, or what it exceeds; see `PlannedMove.limited`."""
    q: Floats | None = None
    """Posture that made it slower, shape (n,) [rad]; None if none did."""


class Fitter:
    """Plans motions within the limits of one robot's joints."""

    def __init__(self, setup: Setup) -> None:
        self._dynamics = InverseDynamics(setup.description, body(setup.payload))
        self._description, limits = setup.description, setup.description.limits
        self._velocity, self._acceleration = np.array(limits.velocity), np.array(limits.acceleration)
        self._torque = np.array(limits.torque)

    def fit(
        self,
        make: Callable[[Slower], PlannedMotion],
        now: Snapshot,
        tvist: Callable[[], Filter] | None,
        limits: MotionLimits | None = None,
    ) -> Fitted:
        """Plan a motion, and anew as much slower as it exceeds a limit.

        Near a limit the motion is shaped ahead by the filter that `tvist` creates. If that would take too long, it is
        None, and the filter's `surplus` is spared. `limits` are those that were asked for; None if something else
        determines its speed.
        """
        asked, need, slower = make(AS_ASKED), None, AS_ASKED
        motion = asked
        for number in itertools.count():
            found = self._need(motion, now, tvist)
            if found is None:
                break
            if found.exceeds is not None:
                return Fitted(asked, limited=("limit_torque", found.exceeds))
            by = found.slower
            need = found if need is None else min(need, found, key=lambda each: each.slower.rate)
            if number >= SPLIT:
                # The spread of the impulses stays, so a slower motion may use more of a limit than the last one.
                most = 1.0 - min(HASTE * 2.0 ** (number - TRIES), 0.5) if number >= TRIES else 1.0
                rate = min(by.rate, most)
                by = Slower(rate, rate**2)
            slower = Slower(slower.velocity * by.velocity, slower.acceleration * by.acceleration)
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

    def _need(self, motion: PlannedMotion, now: Snapshot, tvist: Callable[[], Filter] | None) -> Need | None:
        """How much slower a motion has to be; first as its filter may exceed it most, then as it does."""
        q, qd, qdd = _states(motion)
        faster, harder = (1.0 + more for more in now.surplus)
        qd, qdd = faster * qd, harder * qdd
        found = self._exceeded(q, qd, qdd, qd, now, BLUNTED)
        ahead = None if found is None or tvist is None else shaped_ahead(motion, tvist())
        if ahead is None:
            return found
        q, qd, qdd = central_differences(ahead, PERIOD)
        return self._exceeded(q, qd, qdd, np.diff(ahead, axis=0) / PERIOD, now, 1.0)

    def _exceeded(
        self, q: Floats, qd: Floats, qdd: Floats, speeds: Floats, now: Snapshot, blunted: float
    ) -> Need | None:
        """How much slower a motion has to be for any limit; `speeds` are its velocities between the ticks."""
        needs = self._kinematic(q, speeds, qdd), self._dynamic(q, qd, qdd, blunted, now)
        found = [need for need in needs if need is not None]
        return min(found, key=lambda need: need.slower.rate, default=None)

    def _kinematic(self, q: Floats, qd: Floats, qdd: Floats) -> Need | None:
        """How much slower a motion has to be for the joints' velocities and accelerations."""
        fast = np.abs(qd).max(axis=0, initial=0.0) / self._velocity
        hard = np.abs(qdd).max(axis=0, initial=0.0) / self._acceleration
        factors = [SHARE / float(most) if most > 1.0 + ROUNDING else 1.0 for most in (fast.max(), hard.max())]
        slower = Slower(*factors)
        if slower == AS_ASKED:
            return None
        by_velocity = slower.velocity <= math.sqrt(slower.acceleration)
        joint = int(np.argmax(fast if by_velocity else hard))
        values = (qd if by_velocity else qdd)[:, joint]
        binding = limit_of("velocity" if by_velocity else "acceleration", joint, self._description)
        return Need(slower, binding, q[min(int(np.argmax(np.abs(values))), len(q) - 1)])

    def _dynamic(self, q: Floats, qd: Floats, qdd: Floats, blunted: float, now: Snapshot) -> Need | None:
        """How much slower a motion has to be for the torques, at which gravity stays as it is.

        Where a torque is mainly that of the velocities, these are reduced, elsewhere the acceleration.
        """
        dynamics, limits, factors = self._dynamics, self._torque, [1.0, 1.0]
        worst, need = 1.0, None
        for believed in now.bodies:
            dynamics.believe((believed,))
            gravity = dynamics.gravities(q)
            moving = blunted * (dynamics.torques(q, qd, qdd) - gravity)
            effort = np.abs(gravity + moving)
            beyond = effort > limits * (1.0 + ROUNDING)
            if not beyond.any():
                continue
            share = np.where(
                beyond, (limits - np.sign(moving) * gravity) / np.maximum(np.abs(moving), LEAST), 1.0
            )
            least, joint = float(share.min()), int(np.argmin(share.min(axis=0)))
            if least < worst:
                worst, which = least, limit_of("torque", joint, self._description)
                need = Need(AS_ASKED, which, q[int(np.argmin(share[:, joint]))])
            if need is not None and least < LEAST:
                limit, most = limits[joint], float(effort[:, joint].max())
                exceeds = (
                    f"torque of joint {self._description.robot.joints[joint]} will reach {most:.0f} N m, "
                    f"{most - limit:.1f} beyond its limit of {limit:g}, since gravity alone takes it: "
                    "choose another way, or a lighter payload"
                )
                return need._replace(slower=Slower(0.0, 0.0), exceeds=exceeds)
            turning = dynamics.torques(q, qd, np.zeros_like(qdd)) - gravity
            steady = 2.0 * np.abs(turning) > np.abs(moving)
            for number, part in enumerate((steady, ~steady)):
                lowest = float(np.where(beyond & part, share, 1.0).min())
                if lowest < 1.0:
                    factors[number] = min(factors[number], SHARE * lowest ** (0.5, 1.0)[number])
        return None if need is None else need._replace(slower=Slower(*factors))


def _states(motion: PlannedMotion) -> tuple[Floats, Floats, Floats]:
    """Positions, velocities and accelerations of a motion before it is shaped, each of shape (k, n).

    A short acceleration may lie between evenly spaced moments, so those at which the law changes are added.
    """
    moments = motion.law.moments
    known = (moments > motion.law.begins) & (moments < motion.duration)
    return motion.states(np.union1d(motion.evenly(LOOKS), moments[known]))


def keeping_motion(
    path: JointLine,
    limits: MotionLimits,
    tvist: Filter,
    speed: float = 1.0,
    agility: MotionLimits | None = None,
) -> PlannedMotion:
    """Return the quickest motion whose shaped reference keeps the limits.

    A filter whose weights change with the arm's posture adds the change of their spread to the acceleration, at most
    its `excess` at easy limits. Beyond these the motion is shaped ahead, and planned anew with as much less
    acceleration as it had too much.

    The limits are those of the shaped reference, for every joint; `speed` is the initial rate of the motion's time
    relative to the clock's [-]. The filter is not changed.

    Raises:
        ValueError: There is no such motion.
    """
    easy = tvist.excess == 0.0 or not (
        limits.velocity > EASY.velocity or limits.acceleration > EASY.acceleration or limits.jerk > EASY.jerk
    )
    share = 1.0 - tvist.excess
    for _ in range(KEEPING_TRIES):
        spared = replace(limits, acceleration=limits.acceleration * share)
        motion = quickest_motion(path, spared, PERIOD, speed, agility)
        if easy:
            break
        ahead = shaped_ahead(motion, tvist)
        if ahead is None:
            break
        most = float(np.abs(np.diff(ahead, 2, axis=0)).max(initial=0.0)) / PERIOD**2
        if most <= limits.acceleration:
            break
        share *= SHARE * limits.acceleration / most
    return motion


def shaped_ahead(motion: PlannedMotion, tvist: Filter) -> Floats | None:
    """References of the shaped motion at full rate, shape (k, n) [rad]; None if it lasts too long to simulate.

    Neither the motion, which has not begun, nor the filter is changed.
    """
    path, mine = motion.path, tvist.fork()
    shaped = ShapedReference(path.posture(path.start), PERIOD)
    shaped.enter(path.posture_of, path.start)
    line_filter = LineFilter(mine, motion.limits)
    line_filter.begin(mine, path.start, path.posture_of)
    mine.aim(path.end)
    ahead = LineSimulation(motion.paced_at(1.0), line_filter, shaped)
    ahead.until(MAX_AHEAD)
    return np.array(ahead.references) if ahead.rests else None
