"""Path of a planned motion, independent of time: joint positions as a function of a parameter."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tvist_controller.trajectory.limits import Floats, MotionLimits
from tvist_shaping.base import Posture


class Way(NamedTuple):
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

    def keeping(self, limits: MotionLimits, velocity: float, x: Floats) -> MotionLimits:  # noqa: ARG002  no curvature
        """Return the limits of the joints unchanged."""
        return limits

    def way(self, start: Floats, end: Floats) -> Way:
        """Return the straight line from one posture to the other."""
        way = end - start
        return Way(lambda share: start + share * way, way)
