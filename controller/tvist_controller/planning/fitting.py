"""Motions as quick as asked, or as much slower as the limits of the joints and of their torques require."""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tvist_controller.line.differentiator import Floats, central_differences
from tvist_controller.line.inverse_dynamics import InverseDynamics
from tvist_controller.line.limits import largest_torque
from tvist_controller.planning.keeping import SHARE, shaped_ahead
from tvist_controller.planning.slower import Binding, Limited, acceleration_of, lasts, torque_of, velocity_of
from tvist_controller.planning.snapshot import Snapshot
from tvist_controller.setup import Setup, body
from tvist_controller.trajectory import JointLine, MotionLimits, PlannedMotion
from tvist_plant.plant import PERIOD
from tvist_shaping.base import Filter

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


@dataclass(frozen=True)
class Need:
    """How much slower a motion has to be, and for which limit."""

    slower: Slower
    binding: Binding
    """That limit."""
    q: Floats
    """Posture in which it would be exceeded most, shape (n,) [rad]."""


@dataclass(frozen=True)
class Fitted:
    """A motion within the limits."""

    motion: PlannedMotion
    slower: Slower = AS_ASKED
    """How much slower it is than asked."""
    need: Need | None = None
    """The limit that made it slower; None if it is as quick as asked."""
    asked: float = 0.0
    """Duration of the motion as asked, at full rate [s]."""
    exceeds: str | None = None
    """By how much it exceeds a torque limit nevertheless, in words; None if it does not."""

    def limited(self, asked: MotionLimits | None = None) -> Limited | None:
        """Say what makes it slower than asked, or what it exceeds; see `PlannedMove.limited`.

        `asked` are the limits that were asked for; None if something else determines its speed.
        """
        if self.exceeds is not None:
            return "limit_torque", self.exceeds
        if self.need is None:
            return None
        velocity, acceleration = self.slower
        if asked is None:
            what = lasts(self.motion.duration, self.asked)
        elif velocity <= acceleration:
            what = f"velocity is {asked.velocity * velocity:.4g} of {asked.velocity:.4g} rad/s"
        else:
            what = (
                f"acceleration is {asked.acceleration * acceleration:.4g} of {asked.acceleration:.4g} rad/s²"
            )
        return self.need.binding.makes(what)


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
    ) -> Fitted:
        """Plan a motion, and anew as much slower as it exceeds a limit.

        Near a limit the motion is shaped ahead by the filter that `tvist` creates. If that would take too long, it is
        None, and the filter's `surplus` is spared.
        """
        self._dynamics.believe(now.bodies)
        asked, need, slower = make(AS_ASKED), None, AS_ASKED
        motion = asked
        for number in itertools.count():
            found = self._need(motion, now, tvist)
            if isinstance(found, str):
                return Fitted(asked, exceeds=found)
            if found is None:
                break
            by = found.slower
            need = found if need is None else min(need, found, key=lambda each: each.slower.rate)
            if number >= SPLIT:
                # The spread of the impulses stays, so a slower motion may use more of a limit than the last one.
                most = 1.0 - min(HASTE * 2.0 ** (number - TRIES), 0.5) if number >= TRIES else 1.0
                rate = min(by.rate, most)
                by = Slower(rate, rate**2)
            slower = Slower(slower.velocity * by.velocity, slower.acceleration * by.acceleration)
            motion = make(slower)
        return Fitted(motion, slower, need, asked.duration)

    def _need(
        self, motion: PlannedMotion, now: Snapshot, tvist: Callable[[], Filter] | None
    ) -> Need | str | None:
        """How much slower a motion has to be; in words, by how much it exceeds a torque limit at any speed."""
        fast, heavy = self._may_be_fast(motion, now), self._may_be_heavy(motion, now)
        if not (fast or heavy):
            return None
        ahead = None if tvist is None else shaped_ahead(motion, tvist())
        if ahead is None:
            q, qd, qdd = _states(motion)
            faster, harder = (1.0 + more for more in now.surplus)
            kinematic, blunted = self._kinematic(q, faster * qd, harder * qdd), max(BLUNTED, harder)
        else:
            q, qd, qdd = central_differences(ahead, PERIOD)
            kinematic, blunted = self._kinematic(q, np.diff(ahead, axis=0) / PERIOD, qdd), 1.0
        torque = self._dynamic(q, qd, qdd, blunted, now)
        if isinstance(torque, str):
            return torque
        found = [need for need in (kinematic, torque) if need is not None]
        return min(found, key=lambda need: need.slower.rate, default=None)

    def _may_be_fast(self, motion: PlannedMotion, now: Snapshot) -> bool:
        """Return whether the shaped motion may exceed a joint's velocity or acceleration."""
        more_velocity, more_acceleration = now.surplus
        if isinstance(motion.path, JointLine):
            share = np.abs(motion.path.direction)
            fastest, hardest = share * motion.limits.velocity, share * motion.limits.acceleration
        else:
            fastest, hardest = (np.abs(values).max(axis=0) for values in _states(motion)[1:])
        return bool(
            (fastest * (1.0 + more_velocity) > self._velocity * (1.0 + ROUNDING)).any()
            or (hardest * (1.0 + more_acceleration) > self._acceleration * (1.0 + ROUNDING)).any()
        )

    def _may_be_heavy(self, motion: PlannedMotion, now: Snapshot) -> bool:
        """Return whether the shaped motion may exceed a torque limit."""
        dynamics, limits, (velocity, acceleration) = self._dynamics, motion.limits, now.surplus
        bound = largest_torque(
            dynamics,
            motion.path,
            limits.velocity * (1.0 + velocity),
            limits.acceleration * (1.0 + acceleration),
        )
        if (BLUNTED * bound <= self._torque).all():
            return False
        effort, states = np.zeros_like(self._torque), _states(motion)
        for believed in now.bodies:
            dynamics.believe((believed,))
            effort = np.maximum(effort, np.abs(dynamics.torques(*states)).max(axis=0))
        dynamics.believe(now.bodies)
        return bool((max(BLUNTED, 1.0 + acceleration) * effort > self._torque).any())

    def _kinematic(self, q: Floats, qd: Floats, qdd: Floats) -> Need | None:
        """How much slower a motion has to be for the joints' velocities and accelerations."""
        fast = np.abs(qd).max(axis=0, initial=0.0) / self._velocity
        hard = np.abs(qdd).max(axis=0, initial=0.0) / self._acceleration
        factors = [SHARE / float(most) if most > 1.0 + ROUNDING else 1.0 for most in (fast.max(), hard.max())]
        slower = Slower(*factors)
        if slower == AS_ASKED:
            return None
        if slower.velocity <= math.sqrt(slower.acceleration):
            joint = int(np.argmax(fast))
            return Need(slower, velocity_of(joint, self._description), _place(qd[:, joint], q))
        joint = int(np.argmax(hard))
        return Need(slower, acceleration_of(joint, self._description), _place(qdd[:, joint], q))

    def _dynamic(
        self, q: Floats, qd: Floats, qdd: Floats, blunted: float, now: Snapshot
    ) -> Need | str | None:
        """How much slower a motion has to be for the torques, at which gravity stays as it is.

        Where a torque is mainly that of the velocities, these are reduced, elsewhere the acceleration.
        """
        dynamics, limits, factors = self._dynamics, self._torque, [1.0, 1.0]
        worst, need, at = 1.0, None, q[0]
        for believed in now.bodies:
            dynamics.believe((believed,))
            gravity, turning = dynamics.gravities(q), dynamics.torques(q, qd, np.zeros_like(qdd))
            turning -= gravity
            moving = blunted * (dynamics.torques(q, qd, qdd) - gravity)
            effort = np.abs(gravity + moving)
            beyond = effort > limits * (1.0 + ROUNDING)
            if not beyond.any():
                continue
            share = np.where(
                beyond, (limits - np.sign(moving) * gravity) / np.maximum(np.abs(moving), LEAST), 1.0
            )
            joint = int(np.argmin(share.min(axis=0)))
            least = float(share.min())
            if least < LEAST:
                name, limit, most = (
                    self._description.robot.joints[joint],
                    limits[joint],
                    float(effort[:, joint].max()),
                )
                dynamics.believe(now.bodies)
                return (
                    f"torque of joint {name} will reach {most:.0f} N m, {most - limit:.1f} beyond its limit of "
                    f"{limit:g}, since gravity alone takes it: choose another way, or a lighter payload"
                )
            steady = 2.0 * np.abs(turning) > np.abs(moving)
            for number, which in enumerate((steady, ~steady)):
                lowest = float(np.where(beyond & which, share, 1.0).min())
                factors[number] = min(
                    factors[number], SHARE * (lowest ** (0.5, 1.0)[number]) if lowest < 1.0 else 1.0
                )
            if least < worst:
                at = q[int(np.argmin(share[:, joint]))]
                worst, need = least, torque_of(joint, self._description)
        dynamics.believe(now.bodies)
        return None if need is None else Need(Slower(*factors), need, at)


def _place(values: Floats, q: Floats) -> Floats:
    """Posture, of those in shape (k, n), in which a value is largest; there may be one more value."""
    at: Floats = q[min(int(np.argmax(np.abs(values))), len(q) - 1)]
    return at


def _states(motion: PlannedMotion) -> tuple[Floats, Floats, Floats]:
    """Positions, velocities and accelerations of a motion before it is shaped, each of shape (k, n).

    A short acceleration may lie between evenly spaced moments, so those at which the law changes are added.
    """
    moments = motion.law.moments
    known = (moments > motion.law.begins) & (moments < motion.duration)
    return motion.states(np.union1d(motion.evenly(LOOKS), moments[known]))
