"""Paths of planned motions: joint positions as a function of a parameter."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tvist_controller.trajectory.limits import Floats, MotionLimits
from tvist_shaping.base import Posture


class CheckedMotion(NamedTuple):
    """Motion to check for collisions."""

    at: Callable[[float], Floats]
    """Function from a fraction of the way, 0 to 1, to joint positions (n,) [rad]."""
    turned: Floats
    """Bound of each joint's turn, proportional for a part of the way, shape (n,) [rad]."""


class Path(ABC):
    """Joint positions q(x) as a function of a parameter x.

    Time laws, the TVIST filter and stops act on the parameter, so results stay on any path. The parameter has
    shape (m,) and goes straight from `start` to `end`, in radians for a straight line in joint space, in
    metres for a tool path.
    """

    posture_of: Posture | None
    """Function from parameter to joint positions; None if they are the same."""

    def __init__(self, start: Floats, end: Floats) -> None:
        self.start, self.end = start, np.array(end, dtype=float)
        """Parameter at start and end, each of shape (m,)."""
        way = self.end - start
        farthest = float(np.abs(way).max())
        self.direction = way / farthest if farthest > 0.0 else np.zeros(len(start))
        """Direction from start to end with a largest entry of ±1, or zeros if equal, shape (m,)."""
        self.leading = int(np.argmax(np.abs(self.direction)))  # index of the entry that moves farthest
        self._sign = float(self.direction[self.leading])

    @abstractmethod
    def states(self, x: Floats, xd: Floats, xdd: Floats) -> tuple[Floats, Floats, Floats]:
        """Return q, q̇ and q̈, (n,) or (k, n) [rad, s], for x, ẋ [1/s] and ẍ [1/s^2], (m,) or (k, m)."""

    @abstractmethod
    def paced(self, x: Floats, xd: Floats, xdd: Floats, acceleration: float) -> Floats:
        """Return velocities and accelerations for rate changes, shape (2, k).

        They are scaled so that `acceleration`, the parameter's limit [1/s^2], applies to every column. ẋ
        [1/s] and ẍ [1/s^2] are those at full rate, each of shape (m,).
        """

    @abstractmethod
    def keeping(self, limits: MotionLimits, velocity: float, x: Floats) -> MotionLimits | None:
        """Return the parameter's limits in a stop from x, (m,), at up to `velocity` [1/s]; None for none."""

    @abstractmethod
    def way(self, start: Floats, end: Floats) -> CheckedMotion:
        """Return the part between two parameters, shape (m,), for collision checks."""

    @property
    def whole(self) -> CheckedMotion:
        """The whole path for collision checks."""
        return self.way(self.start, self.end)

    def forwards(self, values: Floats) -> float:
        """Return the leading entry of a velocity, acceleration or step (m,), positive towards the end."""
        return self._sign * float(values[self.leading])

    def posture(self, x: Floats) -> Floats:
        """Return the joint positions at a parameter, shape (n,) [rad]."""
        return x if self.posture_of is None else self.posture_of(x)


class JointLine(Path):
    """Straight line between two postures in joint space, shape (n,) [rad]; the parameter is the posture."""

    posture_of = None

    def states(self, x: Floats, xd: Floats, xdd: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the parameter's states unchanged."""
        return x, xd, xdd

    def paced(self, x: Floats, xd: Floats, xdd: Floats, acceleration: float) -> Floats:  # noqa: ARG002  one limit for all
        """Return the parameter's derivatives."""
        return np.array((xd, xdd))

    def keeping(self, limits: MotionLimits, velocity: float, x: Floats) -> MotionLimits:  # noqa: ARG002  no curvature
        """Return the joints' limits unchanged."""
        return limits

    def way(self, start: Floats, end: Floats) -> CheckedMotion:
        """Return the straight line between two postures."""
        way = end - start
        return CheckedMotion(lambda share: start + share * way, way)
