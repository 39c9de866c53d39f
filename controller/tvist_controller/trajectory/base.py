"""What every source of references is."""

import copy
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Self

from tvist_controller.trajectory.limits import Floats, MotionLimits
from tvist_controller.trajectory.path import Path


@dataclass(frozen=True)
class Forecast:
    """What is known of a trajectory along a path without running it: how soon and how hard it will brake.

    All of it is said of the path's parameter, which for a straight joint line is the posture.
    """

    path: Path
    """The path that it goes along."""
    end: Floats
    """Parameter where it ends if it is let go on, shape (m,) [rad]."""
    braking: float
    """Largest deceleration to come, of the entry that goes farthest [rad/s^2]."""
    jerk: float
    """Largest jerk to come, of that entry [rad/s^3]."""
    steady: float
    """Time for which it does not slow down yet [s]; 0 where that is not known."""
    turns: bool = False
    """Whether it may turn back on its way."""


class Trajectory(ABC):
    """A reference, one sample a tick: the parameter of its path, or where it has none the joint positions."""

    path: Path | None = None
    """The path that it goes along; None where every joint goes by itself: in streams, and stops of every joint."""
    limits: MotionLimits | None = None
    """What its samples keep; None: it bypasses the filter, or rests."""
    acceleration: float = 0.0
    """Limit that every joint keeps in a stop [rad/s^2]; 0 for other trajectories."""
    foreseeable: bool = True
    """Whether it can be run ahead; False: somebody leads it from outside."""

    @abstractmethod
    def next(self) -> Floats:
        """Sample of the next tick, shape (m,) or (n,) [rad]. Not to be written to."""

    @property
    @abstractmethod
    def finished(self) -> bool:
        """Whether the last sample was the final one: from now on it stays where it is."""

    @property
    def standing(self) -> bool:
        """Whether it stays where it is until it is told otherwise: finished, or paused."""
        return self.finished

    @property
    def forecast(self) -> Forecast | None:
        """What is known of its way; None where it has no path."""
        return None

    def fork(self) -> Self:
        """An independent copy that goes on from here, to see what this one is going to do."""
        return copy.copy(self)


class Rest(Trajectory):
    """No motion.

    Args:
        q: Joint angles to stay at, shape (n,) [rad].
    """

    def __init__(self, q: Floats) -> None:
        self._q = q

    def next(self) -> Floats:
        """Return the position at which the arm stays."""
        return self._q

    @property
    def finished(self) -> bool:
        """Always."""
        return True
