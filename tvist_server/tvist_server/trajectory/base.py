"""What every source of references is."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

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


class Trajectory(ABC):
    """A reference, one position a tick."""

    @abstractmethod
    def next(self) -> Floats:
        """Reference of the next tick, shape (n,) [rad]. Not to be written to."""

    @property
    @abstractmethod
    def finished(self) -> bool:
        """Whether the last reference was the final one: from now on it stays where it is."""


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
