"""Curves in joint space: quintic splines through known derivatives."""

from typing import NamedTuple

import numpy as np

from tvist_controller._compiled import compiled
from tvist_controller.trajectory.base import CheckedMotion, Floats, MotionLimits, Path

SAMPLES = np.linspace(0.0, 1.0, 9)  # places in each interval at which derivatives are sampled for bounds
ENOUGH = 1.05  # factor from a derivative's largest sample to its bound [-]
CURVED_SHARE = 0.5
"""Largest fraction of joint acceleration and jerk that the curve itself may use in a motion [-]."""
MAX_WIDENINGS = 12  # number of times a stop's range is widened before the whole rest of the curve is used


class DerivativeBounds(NamedTuple):
    """Bounds of derivatives with respect to s on a part of a curve."""

    slope: Floats  # |dq/ds| of each joint, shape (n,) [rad per unit of s]
    second: float  # |d²q/ds²| of any joint
    third: float  # |d³q/ds³| of any joint


class Knots(NamedTuple):
    """Points of a curve with first and second derivatives."""

    s: Floats  # parameters, rising, from 0 for a part of a path, shape (k,)
    q: Floats  # joint positions, shape (k, n) [rad]
    slope: Floats  # dq/ds, shape (k, n)
    second: Floats  # d²q/ds², shape (k, n)


def hermite(
    length: float | Floats, start: tuple[Floats, Floats, Floats], end: tuple[Floats, Floats, Floats]
) -> Floats:
    """Return the quintic with given values and first two derivatives (..., m) at both ends.

    The ends are `length` apart, an array for several polynomials. Coefficients of rising powers have shape (6, ..., m).
    """
    h = length
    p0, v0, a0 = start
    d0 = end[0] - p0 - v0 * h - 0.5 * a0 * h * h
    d1 = (end[1] - v0 - a0 * h) * h
    d2 = (end[2] - a0) * h * h
    c3 = 10.0 * d0 - 4.0 * d1 + 0.5 * d2
    c4 = -15.0 * d0 + 7.0 * d1 - d2
    c5 = 6.0 * d0 - 3.0 * d1 + 0.5 * d2
    return np.stack((p0, v0, 0.5 * a0, c3 / h**3, c4 / h**4, c5 / h**5))


def between(
    before: Floats, start: Floats, end: Floats, then: Floats, t: float | Floats
) -> tuple[Floats, Floats, Floats]:
    """Return a cubic and its first two derivatives at t, 0 to 1, between the middle two of four even samples."""
    change, own, next_ = end - start, 0.5 * (end - before), 0.5 * (then - start)
    bend, twist = 3.0 * change - 2.0 * own - next_, own + next_ - 2.0 * change
    q = start + t * (own + t * (bend + t * twist))
    return q, own + t * (2.0 * bend + 3.0 * t * twist), 2.0 * bend + 6.0 * t * twist


@compiled
def evaluate(
    knots: Floats, coefficients: Floats, s: Floats, out: Floats
) -> None:  # pragma: no cover  compiled
    """Evaluate a spline and its first three derivatives, shape (4, p, n), at p parameters.

    The k intervals end at the knots (k + 1,); beyond them the outermost polynomials continue. Coefficients of
    rising powers have shape (k, 6, n).
    """
    last = len(knots) - 2
    joints = coefficients.shape[2]
    for number in range(len(s)):
        x = s[number]
        low, high = 0, last + 1
        while high - low > 1:
            middle = (low + high) // 2
            if knots[middle] <= x:
                low = middle
            else:
                high = middle
        u = x - knots[low]
        for joint in range(joints):
            c0, c1, c2 = coefficients[low, 0, joint], coefficients[low, 1, joint], coefficients[low, 2, joint]
            c3, c4, c5 = coefficients[low, 3, joint], coefficients[low, 4, joint], coefficients[low, 5, joint]
            out[0, number, joint] = c0 + u * (c1 + u * (c2 + u * (c3 + u * (c4 + u * c5))))
            out[1, number, joint] = c1 + u * (2.0 * c2 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))
            out[2, number, joint] = 2.0 * c2 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5))
            out[3, number, joint] = 6.0 * c3 + u * (24.0 * c4 + u * 60.0 * c5)


class SplineCurve(Path):
    """A curve through knots with known positions and first two derivatives.

    The parameter s rises from any start, in any unit. Samples may lie beyond either end by a thousandth of a
    tick's step; the outermost polynomials continue there. With ṡ, s̈ and s⃛ the joints have

        q̇ = q' ṡ,    q̈ = q' s̈ + q'' ṡ²,    q⃛ = q' s⃛ + 3 q'' ṡ s̈ + q''' ṡ³,

    so bounds of the derivatives convert joint limits to limits of s. `most` limits each joint's acceleration
    during rate changes, shape (n,) [rad/s^2]; None if the parameter's limit suffices. Raise ValueError if
    knots are not finite or do not move any joint.
    """

    def __init__(self, knots: Knots, most: Floats | None = None) -> None:
        self.knots = knots
        self._knots = np.ascontiguousarray(knots.s)
        ends = [
            (knots.q[part], knots.slope[part], knots.second[part]) for part in (slice(-1), slice(1, None))
        ]
        lengths = np.diff(knots.s)
        coefficients = hermite(lengths[:, None], ends[0], ends[1])
        self._coefficients = np.ascontiguousarray(np.moveaxis(coefficients, 0, 1))
        self._one = np.empty((4, 1, knots.q.shape[1]))
        s = (knots.s[:-1, None] + lengths[:, None] * SAMPLES * (1.0 - 1e-9)).reshape(-1)
        sizes = np.abs(self._evaluate(s)).reshape(4, len(lengths), len(SAMPLES), -1).max(axis=2)
        self._slope = ENOUGH * sizes[1]
        self._second, self._third = ENOUGH * sizes[2].max(axis=1), ENOUGH * sizes[3].max(axis=1)
        start, end = float(knots.s[0]), float(knots.s[-1])
        if not start < end < np.inf:
            raise ValueError(f"length is {end - start}: must be more than 0")
        self.bends = self._bends(0, len(lengths))
        slope, second, third = self.bends
        if not 0.0 < float(slope.max()) < np.inf:
            raise ValueError(f"slope is {slope.tolist()}: must be finite, and of one joint more than 0")
        if not (second < np.inf and third < np.inf):
            raise ValueError(f"second is {second} and third {third}: both must be finite")
        super().__init__(np.array([start]), np.array([end]))
        self._most, self.posture_of = most, self._posture

    def become(self, other: "SplineCurve") -> None:
        """Continue as another curve that is equal between the present point and this one's end."""
        posture_of = self.posture_of  # filter and shaped reference hold this function, bound to this object
        self.__dict__.update(other.__dict__)
        self.posture_of = posture_of
        self._one = np.empty_like(self._one)

    def third(self, s: Floats) -> Floats:
        """Return d³q/ds³ at k points, shape (k, n), with possible steps at knots."""
        return np.asarray(self._evaluate(s)[3])

    def derivatives(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        """Return q and its first two derivatives at k points, each of shape (k, n)."""
        q, slope, second, _ = self._evaluate(s)
        return q, slope, second

    def bends_within(self, start: float, end: float) -> DerivativeBounds:
        """Return bounds of the derivatives on the part between two parameters."""
        last = len(self._slope)
        low = min(max(int(np.searchsorted(self._knots, start, side="right")) - 1, 0), last - 1)
        high = min(max(int(np.searchsorted(self._knots, end, side="left")), low + 1), last)
        return self._bends(low, high)

    def states(self, x: Floats, xd: Floats, xdd: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the joints' state by the chain rule."""
        q, slope, second = self.derivatives(x.reshape(-1))
        xd, xdd = xd.reshape(-1, 1), xdd.reshape(-1, 1)
        qd, qdd = slope * xd, slope * xdd + second * xd**2
        return (q[0], qd[0], qdd[0]) if x.ndim == 1 else (q, qd, qdd)

    def paced(self, x: Floats, xd: Floats, xdd: Floats, acceleration: float) -> Floats:
        """Return the parameter's derivatives and, if limited, those of the joints."""
        own = np.array((xd, xdd))
        if self._most is None:
            return own
        _, qd, qdd = self.states(x, xd, xdd)
        return np.concatenate((own, np.array((qd, qdd)) * (acceleration / self._most)), axis=1)

    def keeping(self, limits: MotionLimits, velocity: float, x: Floats) -> MotionLimits | None:
        """Return the limits that the curve leaves at this velocity for a stop from x."""
        start, end = float(x[0]), float(self.end[0])
        span = 0.1 * velocity
        for look in range(MAX_WIDENINGS):
            to = start + span if look < MAX_WIDENINGS - 1 else end
            kept = kept_by(self.bends_within(start, to), limits, velocity)
            if kept is None or to >= end:
                return kept
            needed = velocity * (0.5 * velocity / kept.acceleration + 2.0 * kept.acceleration / kept.jerk)
            if needed <= span:
                return kept
            span = 1.25 * needed
        raise AssertionError("the last look reaches the end")

    def way(self, start: Floats, end: Floats) -> CheckedMotion:
        """Return the part of the curve between two parameters."""
        along = end - start
        slope = self.bends_within(float(start[0]), float(end[0])).slope
        return CheckedMotion(lambda share: self.posture(start + share * along), abs(float(along[0])) * slope)

    def _posture(self, x: Floats) -> Floats:
        assert x.shape == (1,), "a parameter is one number, and compiled code does not check"
        evaluate(self._knots, self._coefficients, x, self._one)
        return np.array(self._one[0, 0])

    def _evaluate(self, s: Floats) -> Floats:
        out = np.empty((4, len(s), self._coefficients.shape[2]))
        evaluate(self._knots, self._coefficients, np.ascontiguousarray(s), out)
        return out

    def _bends(self, low: int, high: int) -> DerivativeBounds:
        return DerivativeBounds(
            self._slope[low:high].max(axis=0),
            float(self._second[low:high].max()),
            float(self._third[low:high].max()),
        )


def kept_by(bends: DerivativeBounds, limits: MotionLimits, velocity: float) -> MotionLimits | None:
    """Return parameter limits that keep joint limits on part of a curve; `acceleration` has room for jerk."""
    slope, second, third = float(bends.slope.max()), bends.second, bends.third
    acceleration = (limits.acceleration - second * velocity**2) / slope
    bent = CURVED_SHARE * limits.jerk - third * velocity**3
    if 3.0 * second * velocity * acceleration > bent:
        acceleration = bent / (3.0 * second * velocity)
    if acceleration <= 0.0:
        return None
    jerk = (limits.jerk - third * velocity**3 - 3.0 * second * velocity * acceleration) / slope
    return MotionLimits(velocity, acceleration, jerk)
