"""Path of a planned motion, independent of time: joint positions as a function of a parameter."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tvist_controller.trajectory.limits import Floats, MotionLimits
from tvist_shaping.base import Posture


@dataclass(frozen=True)
class Way:
    """A way to be checked for collisions."""

    at: Callable[[float], Floats]
    """Joint positions at a share of the way, 0 to 1, shape (n,) [rad]."""
    turned: Floats
    """How far each joint turns on it at most, and on a part of it at most this times the share, shape (n,) [rad]."""


class Path(ABC):
    """Joint positions q(x) over a parameter x.

    Time laws, the TVIST filter and stops work on the parameter; what comes of them is on the path, however it curves.
    The parameter has shape (m,) and goes straight from `start` to `end`. No joint turns farther than the farthest
    entry of the parameter goes, so that its unit is that of the joint which turns most [rad].

    Args:
        start: Parameter where the path begins, shape (m,) [rad].
        end: Parameter where it ends, shape (m,) [rad].
    """

    posture_of: Posture | None
    """From the parameter to joint positions; None: the parameter is the joint positions."""

    def __init__(self, start: Floats, end: Floats) -> None:
        self.start, self.end = start, np.array(end, dtype=float)
        """Parameter where it begins and where it ends, each of shape (m,) [rad]."""
        way = self.end - start
        farthest = float(np.abs(way).max())
        self.direction = way / farthest if farthest > 0.0 else np.zeros(len(start))
        """Direction from start to end; its largest entry is 1 or -1 (all are 0 if start equals end), shape (m,)."""
        self.leading = int(np.argmax(np.abs(self.direction)))
        """Number of the entry that goes farthest."""
        self._sign = float(self.direction[self.leading])

    @abstractmethod
    def states(self, x: Floats, xd: Floats, xdd: Floats) -> tuple[Floats, Floats, Floats]:
        """Motion of the joints where the parameter moves.

        Args:
            x: Parameter, shape (m,), or (k, m) for k states [rad].
            xd: Its velocity, likewise [rad/s].
            xdd: Its acceleration, likewise [rad/s^2].

        Returns:
            q [rad], q̇ [rad/s] and q̈ [rad/s^2], each of shape (n,) or (k, n).
        """

    @abstractmethod
    def planned(self, limits: MotionLimits) -> MotionLimits:
        """Limits for the parameter of a motion, with which every joint keeps its own on the whole path."""

    @abstractmethod
    def keeping(self, limits: MotionLimits, velocity: float) -> MotionLimits | None:
        """Limits for the parameter's acceleration and jerk while its velocity is no more than this [rad/s].

        Args:
            limits: That every joint is to keep; the velocity is not looked at.
            velocity: Velocity of the parameter [rad/s].

        Returns:
            None where the curve alone takes all that the joints may.
        """

    @abstractmethod
    def way(self, start: Floats, end: Floats) -> Way:
        """A part of the path, as a way to be checked.

        Args:
            start: Parameter, shape (m,) [rad].
            end: Parameter at the end, shape (m,) [rad].
        """

    @property
    def whole(self) -> Way:
        """All of it, to be checked."""
        return self.way(self.start, self.end)

    def forwards(self, values: Floats) -> float:
        """Leading entry of a velocity, acceleration or step of the parameter, shape (m,): positive towards the end."""
        return self._sign * float(values[self.leading])

    def posture(self, x: Floats) -> Floats:
        """Joint positions at a parameter, shape (n,) [rad]."""
        return x if self.posture_of is None else self.posture_of(x)


class JointLine(Path):
    """The straight line between two postures.

    Its parameter is the posture itself, shape (n,): to shape the one is to shape the other.

    Args:
        start: Joint positions at the start, shape (n,) [rad].
        end: Joint positions at the end, shape (n,) [rad].
    """

    posture_of = None

    def states(self, x: Floats, xd: Floats, xdd: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the states of the parameter unchanged."""
        return x, xd, xdd

    def planned(self, limits: MotionLimits) -> MotionLimits:
        """Return the limits of the joints unchanged."""
        return limits

    def keeping(self, limits: MotionLimits, velocity: float) -> MotionLimits:  # noqa: ARG002  a straight line takes nothing
        """Return the limits of the joints unchanged."""
        return limits

    def way(self, start: Floats, end: Floats) -> Way:
        """Straight from one posture to the other."""
        way = end - start
        return Way(lambda share: start + share * way, way)
