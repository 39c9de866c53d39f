"""Base of all sources of references, and the trivial ones."""

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Self

from tvist_controller.trajectory.limits import Floats, MotionLimits
from tvist_controller.trajectory.path import Path


@dataclass(frozen=True)
class BrakingForecast:
    """When and how hard a trajectory will brake, in its path's parameter, as known without simulation."""

    path: Path
    """Path of the trajectory."""
    end: Floats
    """Parameter at its uninterrupted end, shape (m,) [rad]."""
    braking: float
    """Largest future deceleration of the leading entry [rad/s^2]."""
    jerk: float
    """Largest future jerk of the leading entry [rad/s^3]."""
    steady: float
    """Time before it starts braking, 0 if unknown [s]."""
    turns: bool = False
    """Whether it may turn back on its path."""


class Trajectory(ABC):
    """A reference with one sample per tick: its path's parameter, or joint positions without a path."""

    path: Path | None = None
    """Path of the trajectory; None if joints move independently, as in streams and joint stops."""
    limits: MotionLimits | None = None
    """Limits of its samples; None if it bypasses the filter or is at rest."""
    acceleration: float = 0.0
    """Acceleration limit of every joint in a stop; 0 for other trajectories [rad/s^2]."""
    foreseeable: bool = True
    """Whether it can be simulated ahead; False with external input."""

    @abstractmethod
    def next(self) -> Floats:
        """Return the sample of the next tick, shape (m,) or (n,) [rad]; do not modify it."""

    @property
    @abstractmethod
    def finished(self) -> bool:
        """Whether the last sample was the final one; all later ones are equal."""

    def adapt(self, spared: Callable[[MotionLimits | None], MotionLimits]) -> None:  # noqa: B027  most need not
        """Leave room for a new filter; needed only by references without a plan.

        `spared(limits)` returns limits of a reference whose shaped reference keeps these and the arm's limits
        (None: only the arm's).
        """

    @property
    def standing(self) -> bool:
        """Whether samples stay equal until a command: finished or paused."""
        return self.finished

    @property
    def forecast(self) -> BrakingForecast | None:
        """Forecast of its motion; None without a path."""
        return None

    def fork(self) -> Self:
        """Return an independent copy, for simulating ahead."""
        return copy.copy(self)


class Rest(Trajectory):
    """No motion."""

    def __init__(self, q: Floats) -> None:
        self._q = q

    def next(self) -> Floats:
        """Return the constant position."""
        return self._q

    @property
    def finished(self) -> bool:
        """Always True."""
        return True


class SampledPositions(Trajectory):
    """A list of positions, shape (n,) [rad], one per tick of `period` seconds; keeps the last."""

    def __init__(self, positions: Sequence[Floats], period: float) -> None:
        self._positions, self._period = positions, period
        self._ticks = -1

    @property
    def duration(self) -> float:
        """Time until the last position [s]."""
        return len(self._positions) * self._period

    @property
    def end(self) -> Floats:
        """Last position, shape (n,) [rad]."""
        return self._positions[-1]

    def next(self) -> Floats:
        """Return the next position."""
        self._ticks = min(self._ticks + 1, len(self._positions) - 1)
        return self._positions[self._ticks]

    @property
    def finished(self) -> bool:
        """Whether it has reached the last position."""
        return self._ticks == len(self._positions) - 1
