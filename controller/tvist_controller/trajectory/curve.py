"""Paths that are curved in joint space, such as lines, arcs and blends of the tool."""

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from tvist_controller.trajectory.limits import Floats, MotionLimits
from tvist_controller.trajectory.path import Path, Way

CURVED_SHARE = 0.5
"""Largest share of the joints' acceleration and jerk that the curve itself may use up during a motion [-]."""
ROUNDING = 1e-9
"""Largest error of a slope of 1 by rounding [-]."""


@dataclass(frozen=True)
class Bends:
    """Upper bounds of a curve's derivatives with respect to its parameter s [rad], for the whole curve."""

    slope: Floats
    """|dq/ds| of each joint, shape (n,) [-]; none above 1."""
    second: float
    """|d²q/ds²| of any joint [1/rad]."""
    third: float
    """|d³q/ds³| of any joint [1/rad^2]."""


class Curve(Path):
    """A path with one parameter s, from 0 to its length.

    Interpolation may pass either end by a thousandth of a tick's step, so the curve has to continue smoothly beyond
    them.

    With ṡ, s̈ and s⃛ the joints have

        q̇ = q' ṡ,    q̈ = q' s̈ + q'' ṡ²,    q⃛ = q' s⃛ + 3 q'' ṡ s̈ + q''' ṡ³,

    so bounds of the derivatives, and |q'| ≤ 1, convert limits of the joints into limits of s.

    Args:
        length: Value of s at the end [rad], above 0.
        bends: Bounds of the derivatives.

    Raises:
        ValueError: An argument is out of range.
    """

    def __init__(self, length: float, bends: Bends) -> None:
        if not 0.0 < length < np.inf:
            raise ValueError(f"length is {length}: must be more than 0")
        if not float(bends.slope.max()) <= 1.0 + ROUNDING:
            raise ValueError(
                f"slope is {bends.slope.tolist()}: no joint may turn farther than the curve's parameter"
            )
        if not (0.0 <= bends.second < np.inf and 0.0 <= bends.third < np.inf):
            raise ValueError(f"second is {bends.second} and third {bends.third}: both must be finite")
        super().__init__(np.zeros(1), np.array([length]))
        self.bends = bends
        """Bounds of its derivatives."""
        self.posture_of = self._posture

    @abstractmethod
    def derivatives(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        """Evaluate the curve at k points.

        Args:
            s: Parameters, shape (k,) [rad].

        Returns:
            q [rad], dq/ds [-] and d²q/ds² [1/rad], each of shape (k, n).
        """

    def _posture(self, x: Floats) -> Floats:
        q: Floats = self.derivatives(x)[0][0]
        return q

    def states(self, x: Floats, xd: Floats, xdd: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the joints' state of motion, by the chain rule."""
        q, slope, second = self.derivatives(x.reshape(-1))
        xd, xdd = xd.reshape(-1, 1), xdd.reshape(-1, 1)
        qd, qdd = slope * xd, slope * xdd + second * xd**2
        return (q[0], qd[0], qdd[0]) if x.ndim == 1 else (q, qd, qdd)

    def planned(self, limits: MotionLimits) -> MotionLimits:
        """Return limits with one velocity for the whole curve; its tightest bend then uses a share of the limits."""
        second, third = max(self.bends.second, 1e-12), max(self.bends.third, 1e-12)
        velocity = min(
            limits.velocity,
            np.sqrt(CURVED_SHARE * limits.acceleration / second),
            np.cbrt(0.5 * CURVED_SHARE * limits.jerk / third),
            0.5 * CURVED_SHARE * limits.jerk / (3.0 * second * limits.acceleration),
        )
        kept = self.keeping(limits, float(velocity))
        assert kept is not None, "this velocity leaves room for acceleration and jerk"
        return kept

    def keeping(self, limits: MotionLimits, velocity: float) -> MotionLimits | None:
        """Return the limits that the curve leaves at this velocity; the acceleration leaves a share of the jerk."""
        second, third = self.bends.second, self.bends.third
        acceleration = limits.acceleration - second * velocity**2
        bent = CURVED_SHARE * limits.jerk - third * velocity**3
        if 3.0 * second * velocity * acceleration > bent:
            acceleration = bent / (3.0 * second * velocity)
        if acceleration <= 0.0:
            return None
        jerk = limits.jerk - third * velocity**3 - 3.0 * second * velocity * acceleration
        return MotionLimits(velocity, acceleration, jerk)

    def way(self, start: Floats, end: Floats) -> Way:
        """Return the part of the curve between two parameters."""
        along = end - start
        return Way(lambda share: self.posture(start + share * along), abs(float(along[0])) * self.bends.slope)
