"""Base of all sources of references, and those that do not compute anything."""

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Self

from tvist_controller.trajectory.limits import Floats, MotionLimits
from tvist_controller.trajectory.path import Path


@dataclass(frozen=True)
class Forecast:
    """How soon and how hard a trajectory along a path will brake, as far as is known without simulating it.

    All values refer to the path's parameter, which for a straight line in joint space is the posture.
    """

    path: Path
    """Path of the trajectory."""
    end: Floats
    """Parameter at its end if it is not interrupted, shape (m,) [rad]."""
    braking: float
    """Largest future deceleration of the leading entry [rad/s^2]."""
    jerk: float
    """Largest future jerk of the leading entry [rad/s^3]."""
    steady: float
    """Time before it begins to slow down [s]; 0 if that is not known."""
    turns: bool = False
    """Whether it may turn back on its path."""


class Trajectory(ABC):
    """A reference with one sample for each tick: the parameter of its path, or joint positions if it has no path."""

    path: Path | None = None
    """Path of the trajectory; None if all joints move independently, as in streams and in stops of each joint."""
    limits: MotionLimits | None = None
    """Limits that its samples keep; None if it bypasses the filter or is at rest."""
    acceleration: float = 0.0
    """Limit that every joint keeps in a stop [rad/s^2]; 0 for other trajectories."""
    foreseeable: bool = True
    """Whether it can be simulated ahead; False if it depends on external input."""

    @abstractmethod
    def next(self) -> Floats:
        """Return the sample of the next tick, shape (m,) or (n,) [rad]. It must not be modified."""

    @property
    @abstractmethod
    def finished(self) -> bool:
        """Whether the last sample was the final one, after which all samples are equal."""

    def adapt(self, spared: Callable[[MotionLimits | None], MotionLimits]) -> None:  # noqa: B027  most need not
        """Leave room for a filter that comes into use now; only references without a plan have to.

        `spared` returns the limits of a reference whose shaped reference keeps the given limits and those of
        the arm; for None, only the latter.
        """

    @property
    def standing(self) -> bool:
        """Whether its samples stay equal until a command comes: it is finished, or paused."""
        return self.finished

    @property
    def forecast(self) -> Forecast | None:
        """Forecast of its motion; None if it has no path."""
        return None

    def fork(self) -> Self:
        """Return an independent copy of the present state, to simulate this trajectory ahead."""
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


class Known(Trajectory):
    """At least one position, shape (n,) [rad], one a tick of `period` seconds; the last is kept."""

    def __init__(self, positions: Sequence[Floats], period: float) -> None:
        self._positions, self._period = positions, period
        self._ticks = -1

    @property
    def duration(self) -> float:
        """Time until the last position [s]."""
        return len(self._positions) * self._period

    @property
    def end(self) -> Floats:
        """The last position, shape (n,) [rad]."""
        return self._positions[-1]

    def next(self) -> Floats:
        """Return the next position."""
        self._ticks = min(self._ticks + 1, len(self._positions) - 1)
        return self._positions[self._ticks]

    @property
    def finished(self) -> bool:
        """Whether it has reached the last position."""
        return self._ticks == len(self._positions) - 1
