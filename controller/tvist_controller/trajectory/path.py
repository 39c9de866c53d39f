"""Path of a planned motion, independent of time: joint positions as a function of a parameter."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tvist_controller.trajectory.limits import Floats, MotionLimits
from tvist_shaping.base import Posture

CURVED_SHARE = 0.5
"""Largest share of the joints' acceleration and jerk that the curve itself may use up during a motion [-]."""
LOOKS = 12
"""Number of times that the range of a stop is widened before the whole rest of the curve is taken."""


@dataclass(frozen=True)
class Way:
    """Motion to be checked for collisions."""

    at: Callable[[float], Floats]
    """Returns the joint positions at a share of the way, 0 to 1, shape (n,) [rad]."""
    turned: Floats
    """Bound of the angle that each joint turns, shape (n,) [rad]; for a part of the way, times its share."""


class Path(ABC):
    """Joint positions q(x) as a function of a parameter x.

    Time laws, the TVIST filter and stops act on the parameter, so their results stay on the path, however it curves.
    The parameter has shape (m,) and moves straight from `start` to `end`. Its unit is that of the path: radians for a
    straight line in joint space, metres for a path of the tool.
    """

    posture_of: Posture | None
    """Converts the parameter to joint positions; None if the parameter is the joint positions."""

    def __init__(self, start: Floats, end: Floats) -> None:
        self.start, self.end = start, np.array(end, dtype=float)
        """Parameter at the start and at the end, each of shape (m,)."""
        way = self.end - start
        farthest = float(np.abs(way).max())
        self.direction = way / farthest if farthest > 0.0 else np.zeros(len(start))
        """Direction from start to end, with a largest entry of 1 or -1, or all 0 if start equals end; shape (m,)."""
        self.leading = int(np.argmax(np.abs(self.direction)))
        """Index of the leading entry, which moves farthest."""
        self._sign = float(self.direction[self.leading])

    @abstractmethod
    def states(self, x: Floats, xd: Floats, xdd: Floats) -> tuple[Floats, Floats, Floats]:
        """Return q, q̇ and q̈, shape (n,) or (k, n) [rad, s], for one or k states of the parameter.

        Those are x, its velocity [1/s] and its acceleration [1/s^2], each of shape (m,) or (k, m).
        """

    @abstractmethod
    def paced(self, x: Floats, xd: Floats, xdd: Floats, acceleration: float) -> Floats:
        """Return velocities and accelerations for a change of the motion's rate, shape (2, k).

        They are scaled so that `acceleration`, the limit of the parameter's [1/s^2], is that of every column.
        Velocity and acceleration of the parameter x are those at full rate, each of shape (m,) [1/s, 1/s^2].
        """

    @abstractmethod
    def planned(self, limits: MotionLimits) -> MotionLimits:
        """Return limits for the parameter of a motion that keep every joint within its own limits on the whole path."""

    @abstractmethod
    def keeping(self, limits: MotionLimits, velocity: float, x: Floats) -> MotionLimits | None:
        """Return the parameter's limits in a stop; None if the curve alone uses up those of the joints.

        The stop begins at x, shape (m,), and is never faster than `velocity` [1/s]; that of the joints'
        limits is ignored.
        """

    @abstractmethod
    def way(self, start: Floats, end: Floats) -> Way:
        """Return the part of the path between two parameters, shape (m,), to be checked for collisions."""

    @property
    def whole(self) -> Way:
        """The whole path, to be checked for collisions."""
        return self.way(self.start, self.end)

    def forwards(self, values: Floats) -> float:
        """Leading entry of a velocity, acceleration or step of the parameter, shape (m,); positive towards the end."""
        return self._sign * float(values[self.leading])

    def posture(self, x: Floats) -> Floats:
        """Return the joint positions at a parameter, shape (n,) [rad]."""
        return x if self.posture_of is None else self.posture_of(x)


class JointLine(Path):
    """The straight line between two postures in joint space, each of shape (n,) [rad].

    Its parameter is the posture itself, so shaping the parameter shapes the posture.
    """

    posture_of = None

    def states(self, x: Floats, xd: Floats, xdd: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the states of the parameter unchanged."""
        return x, xd, xdd

    def paced(self, x: Floats, xd: Floats, xdd: Floats, acceleration: float) -> Floats:  # noqa: ARG002  one limit for all
        """Return the derivatives of the parameter."""
        return np.array((xd, xdd))

    def planned(self, limits: MotionLimits) -> MotionLimits:
        """Return the limits of the joints unchanged."""
        return limits

    def keeping(self, limits: MotionLimits, velocity: float, x: Floats) -> MotionLimits:  # noqa: ARG002  no curvature
        """Return the limits of the joints unchanged."""
        return limits

    def way(self, start: Floats, end: Floats) -> Way:
        """Return the straight line from one posture to the other."""
        way = end - start
        return Way(lambda share: start + share * way, way)


@dataclass(frozen=True)
class Bends:
    """Upper bounds of a curve's derivatives with respect to its parameter s, on a part of it."""

    slope: Floats
    """|dq/ds| of each joint, shape (n,) [rad per unit of s]."""
    second: float
    """|d²q/ds²| of any joint."""
    third: float
    """|d³q/ds³| of any joint."""


class Curve(Path):
    """A path with one parameter s, from 0 or another start to an end above that, in any unit.

    Interpolation may pass either end by a thousandth of a tick's step, so the curve has to continue smoothly beyond
    them.

    With ṡ, s̈ and s⃛ the joints have

        q̇ = q' ṡ,    q̈ = q' s̈ + q'' ṡ²,    q⃛ = q' s⃛ + 3 q'' ṡ s̈ + q''' ṡ³,

    so bounds of the derivatives convert limits of the joints into limits of s. `most` limits the acceleration
    of each joint while the motion's rate changes, shape (n,) [rad/s^2]; None if the limit of the parameter
    suffices.

    Raises:
        ValueError: An argument is out of range.
    """

    def __init__(self, end: float, bends: Bends, most: Floats | None = None, *, start: float = 0.0) -> None:
        if not start < end < np.inf:
            raise ValueError(f"length is {end - start}: must be more than 0")
        if not 0.0 < float(bends.slope.max()) < np.inf:
            raise ValueError(f"slope is {bends.slope.tolist()}: must be finite, and of one joint more than 0")
        if not (0.0 <= bends.second < np.inf and 0.0 <= bends.third < np.inf):
            raise ValueError(f"second is {bends.second} and third {bends.third}: both must be finite")
        super().__init__(np.array([start]), np.array([end]))
        self.bends = bends
        """Bounds of its derivatives."""
        self._most = most
        self.posture_of = self._posture

    @abstractmethod
    def derivatives(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        """Evaluate the curve at k points: q [rad], dq/ds and d²q/ds², each of shape (k, n)."""

    def bends_within(self, start: float, end: float) -> Bends:  # noqa: ARG002  the same everywhere unless overridden
        """Bounds of the derivatives between two parameters; by default those of the whole curve."""
        return self.bends

    def _posture(self, x: Floats) -> Floats:
        q: Floats = self.derivatives(x)[0][0]
        return q

    def states(self, x: Floats, xd: Floats, xdd: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the joints' state of motion, by the chain rule."""
        q, slope, second = self.derivatives(x.reshape(-1))
        xd, xdd = xd.reshape(-1, 1), xdd.reshape(-1, 1)
        qd, qdd = slope * xd, slope * xdd + second * xd**2
        return (q[0], qd[0], qdd[0]) if x.ndim == 1 else (q, qd, qdd)

    def paced(self, x: Floats, xd: Floats, xdd: Floats, acceleration: float) -> Floats:
        """Return the parameter's derivatives and, if they are limited, those of the joints."""
        own = np.array((xd, xdd))
        if self._most is None:
            return own
        _, qd, qdd = self.states(x, xd, xdd)
        return np.concatenate((own, np.array((qd, qdd)) * (acceleration / self._most)), axis=1)

    def planned(self, limits: MotionLimits) -> MotionLimits:
        """Return limits with one velocity for the whole curve; its tightest bend then uses a share of the limits."""
        slope = float(self.bends.slope.max())
        second, third = max(self.bends.second, 1e-12), max(self.bends.third, 1e-12)
        velocity = min(
            limits.velocity / slope,
            np.sqrt(CURVED_SHARE * limits.acceleration / second),
            np.cbrt(0.5 * CURVED_SHARE * limits.jerk / third),
            0.5 * CURVED_SHARE * limits.jerk * slope / (3.0 * second * limits.acceleration),
        )
        kept = _kept(self.bends, limits, float(velocity))
        assert kept is not None, "this velocity leaves room for acceleration and jerk"
        return kept

    def keeping(self, limits: MotionLimits, velocity: float, x: Floats) -> MotionLimits | None:
        """Return the limits that the curve leaves at this velocity, from x on for as far as a stop takes."""
        start, end = float(x[0]), float(self.end[0])
        span = 0.1 * velocity
        for look in range(LOOKS):
            to = start + span if look < LOOKS - 1 else end
            kept = _kept(self.bends_within(start, to), limits, velocity)
            if kept is None or to >= end:
                return kept
            needed = velocity * (0.5 * velocity / kept.acceleration + 2.0 * kept.acceleration / kept.jerk)
            if needed <= span:
                return kept
            span = 1.25 * needed
        raise AssertionError("the last look reaches the end")

    def way(self, start: Floats, end: Floats) -> Way:
        """Return the part of the curve between two parameters."""
        along = end - start
        slope = self.bends_within(float(start[0]), float(end[0])).slope
        return Way(lambda share: self.posture(start + share * along), abs(float(along[0])) * slope)


def _kept(bends: Bends, limits: MotionLimits, velocity: float) -> MotionLimits | None:
    """Limits that a part of a curve leaves at a velocity; the acceleration leaves a share of the jerk."""
    slope, second, third = float(bends.slope.max()), bends.second, bends.third
    acceleration = (limits.acceleration - second * velocity**2) / slope
    bent = CURVED_SHARE * limits.jerk - third * velocity**3
    if 3.0 * second * velocity * acceleration > bent:
        acceleration = bent / (3.0 * second * velocity)
    if acceleration <= 0.0:
        return None
    jerk = (limits.jerk - third * velocity**3 - 3.0 * second * velocity * acceleration) / slope
    return MotionLimits(velocity, acceleration, jerk)
