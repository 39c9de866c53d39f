"""What every source of references is."""

import copy
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Limits:
    """One number each, for every joint."""

    velocity: float
    """[rad/s]."""
    acceleration: float
    """[rad/s^2]."""
    jerk: float
    """[rad/s^3]."""


@dataclass(frozen=True)
class Line:
    """What is known of a trajectory along a straight line without running it: how soon and how hard it will brake."""

    direction: Floats
    """Of the line in joint space; its largest entry is 1 or -1, shape (n,)."""
    end: Floats
    """Where the trajectory ends if it is let go on, shape (n,) [rad]."""
    braking: float
    """Largest deceleration to come, of the joint that turns most [rad/s^2]."""
    jerk: float
    """Largest jerk to come, of that joint [rad/s^3]."""
    steady: float
    """Time for which it does not slow down yet [s]; 0 where that is not known."""
    turns: bool = False
    """Whether it may turn back on its way."""


class Trajectory(ABC):
    """A reference, one position a tick."""

    @abstractmethod
    def next(self) -> Floats:
        """Reference of the next tick, shape (n,) [rad]. Not to be written to."""

    @property
    @abstractmethod
    def finished(self) -> bool:
        """Whether the last reference was the final one: from now on it stays where it is."""

    @property
    def standing(self) -> bool:
        """Whether it stays where it is until it is told otherwise: finished, or paused."""
        return self.finished

    @property
    def line(self) -> Line | None:
        """The straight line that it goes along; None where it goes along none."""
        return None

    def fork(self) -> Self:
        """An independent copy that goes on from here, to see what this one is going to do."""
        return copy.copy(self)


class Rest(Trajectory):
    """No motion.

    Args:
        q: Where to stay, shape (n,) [rad].
    """

    def __init__(self, q: Floats) -> None:
        self._q = q

    def next(self) -> Floats:
        """Where the arm stays."""
        return self._q

    @property
    def finished(self) -> bool:
        """Always."""
        return True
