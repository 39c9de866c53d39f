"""Path of a planned motion, independent of time: joint positions as a function of a parameter."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tvist_controller.trajectory.limits import Floats, MotionLimits
from tvist_shaping.base import Posture


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

    Args:
        start: Parameter at the start, shape (m,).
        end: Parameter at the end, shape (m,).
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
        """Return the joints' state of motion for a state of the parameter.

        Args:
            x: Parameter, shape (m,), or (k, m) for k states.
            xd: Its velocity, same shape [1/s].
            xdd: Its acceleration, same shape [1/s^2].

        Returns:
            q [rad], q̇ [rad/s] and q̈ [rad/s^2], each of shape (n,) or (k, n).
        """

    @abstractmethod
    def paced(self, x: Floats, xd: Floats, xdd: Floats, acceleration: float) -> Floats:
        """Return the velocities and accelerations that a change of the motion's rate has to consider.

        Args:
            x: Parameter, shape (m,).
            xd: Its velocity at full rate, same shape [1/s].
            xdd: Its acceleration at full rate, same shape [1/s^2].
            acceleration: Limit of the parameter's acceleration [1/s^2].

        Returns:
            Array of shape (2, k), scaled so that this limit is that of every column.
        """

    @abstractmethod
    def planned(self, limits: MotionLimits) -> MotionLimits:
        """Return limits for the parameter of a motion that keep every joint within its own limits on the whole path."""

    @abstractmethod
    def keeping(self, limits: MotionLimits, velocity: float, x: Floats) -> MotionLimits | None:
        """Return limits for the parameter's acceleration and jerk in a stop.

        Args:
            limits: Limits for every joint; the velocity is ignored.
            velocity: Largest velocity of the parameter in the stop [1/s].
            x: Parameter at which the stop begins, shape (m,).

        Returns:
            None if the curve alone uses up the limits of the joints.
        """

    @abstractmethod
    def way(self, start: Floats, end: Floats) -> Way:
        """Return a part of the path, to be checked for collisions.

        Args:
            start: Parameter at the start, shape (m,).
            end: Parameter at the end, shape (m,).
        """

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
    """The straight line between two postures in joint space.

    Its parameter is the posture itself, shape (n,), so shaping the parameter shapes the posture.

    Args:
        start: Joint positions at the start, shape (n,) [rad].
        end: Joint positions at the end, shape (n,) [rad].
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
