"""Bases of references: limits, paths of planned motions, trajectories, and the simplest trajectories."""

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from tvist_plant.plant import PERIOD
from tvist_shaping.base import Posture

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class MotionLimits:
    """Limits of each joint, or each entry of a path's parameter."""

    velocity: float
    """Velocity limit [rad/s]."""
    acceleration: float
    """Acceleration limit [rad/s^2]."""
    jerk: float
    """Jerk limit [rad/s^3]."""


class CheckedMotion(NamedTuple):
    """Motion to check for collisions."""

    at: Callable[[float], Floats]
    """Function from a fraction of the way, 0 to 1, to joint positions (n,) [rad]."""
    turned: Floats
    """Bound of each joint's turn, proportional for a part of the way, shape (n,) [rad]."""

    @classmethod
    def through(cls, samples: Floats) -> Self:
        """Return the motion through at least two samples, one per tick, shape (k, n) [rad]."""
        last, steps = len(samples) - 1, np.abs(np.diff(samples, axis=0)).max(axis=0)
        return cls(lambda share: samples[round(share * last)], steps * last)


class Path(ABC):
    """Joint positions q(x) as a function of a parameter x.

    Time laws, the TVIST filter and stops act on the parameter, so their results stay on the path. The
    parameter has shape (m,) and goes straight from `start` to `end`, in radians for a straight line in joint
    space, in metres for a tool path.
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
        """Return velocities and accelerations that limit changes of the time rate, shape (2, k).

        They are scaled so that `acceleration`, the parameter's limit [1/s^2], is the limit of every column.
        `xd` [1/s] and `xdd` [1/s^2] are ẋ and ẍ at full rate, each of shape (m,).
        """

    @abstractmethod
    def keeping(self, limits: MotionLimits, velocity: float, x: Floats) -> MotionLimits | None:
        """Return the parameter's limits, if any, for a stop from x, (m,), at up to `velocity` [1/s]."""

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


class TimeLaw(ABC):
    """A path's parameter as a function of time."""

    limits: MotionLimits  # largest velocity, acceleration and jerk of any entry
    duration: float  # time at which the motion rests [s]
    begins = 0.0  # time from which the law is known [s]
    brakes_at = 0.0  # time at which the motion starts braking; 0 if unknown [s]
    moments: Floats  # times at which velocity or acceleration may be largest [s]

    @abstractmethod
    def at(self, time: float) -> tuple[list[float], list[float], list[float]]:
        """Return the parameter, its velocity and its acceleration at a time [s], m each."""

    def position(self, time: float) -> Floats:
        """Return the parameter at a time [s], shape (m,)."""
        return np.array(self.at(time)[0])


@dataclass(frozen=True)
class BrakingForecast:
    """When and how hard a trajectory will brake, in its path's parameter, as known without simulation."""

    path: Path  # path of the trajectory
    end: Floats  # parameter at its uninterrupted end, shape (m,) [rad]
    braking: float  # largest future deceleration of the leading entry [rad/s^2]
    jerk: float  # largest future jerk of the leading entry [rad/s^3]
    steady: float  # time before the trajectory starts braking, 0 if unknown [s]
    turns: bool = False  # whether the trajectory may turn back on its path


class Trajectory(ABC):
    """A reference with one sample per tick: the parameter of its path or, without a path, joint positions."""

    path: Path | None = None
    """Path of the trajectory; None if joints move independently, as in streams and joint stops."""
    limits: MotionLimits | None = None
    """Limits of its samples; None if it bypasses the filter or is at rest."""
    acceleration: float = 0.0
    """Acceleration limit of every joint in a stop; 0 for other trajectories [rad/s^2]."""
    foreseeable: bool = True  # whether it can be simulated ahead; False with external input

    @abstractmethod
    def next(self) -> Floats:
        """Return the sample of the next tick, shape (m,) or (n,) [rad]; do not modify it."""

    @property
    @abstractmethod
    def finished(self) -> bool:
        """Whether the last sample was the final one; all later ones are equal."""

    def adapt(self, reduced_limits: Callable[[MotionLimits | None], MotionLimits]) -> None:  # noqa: B027  most need not
        """Reduce the limits for a new filter; only references without a plan need this.

        `reduced_limits(limits)` returns limits for the reference with which the shaped reference keeps
        `limits` (None: no such limits) and the arm's limits.
        """

    @property
    def standing(self) -> bool:
        """True if the reference rests until the next command: the trajectory has finished or is paused."""
        return self.finished

    @property
    def forecast(self) -> BrakingForecast | None:
        """Forecast of the motion; None without a path, or on a curve of each joint."""
        return None

    def fork(self) -> Self:
        """Return an independent copy, for simulating ahead."""
        return copy.copy(self)


class Rest(Trajectory):
    """No motion."""

    finished = True

    def __init__(self, q: Floats) -> None:
        self._q = q

    def next(self) -> Floats:
        """Return the constant position."""
        return self._q


class SampledPositions(Trajectory):
    """A list of positions, shape (n,) [rad], one per tick; keeps the last."""

    def __init__(self, positions: Sequence[Floats]) -> None:
        self._positions = positions
        self._ticks = -1

    @property
    def duration(self) -> float:
        """Time until the last position [s]."""
        return len(self._positions) * PERIOD

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
        """Whether the last position has been reached."""
        return self._ticks == len(self._positions) - 1
