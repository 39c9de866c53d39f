"""Base class of all filters: a delay line, an estimator, and weights that depend on the modes."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from tvist_shaping._types import Floats, Forkable
from tvist_shaping.delay_line import DelayLine
from tvist_shaping.errors import FilterError, ShaperFailureError, ShapingError, check_positive
from tvist_shaping.estimators.base import Estimator

FeedForward: TypeAlias = Literal["rigid", "elastic", "elastic-position"]
"""What a controller feeds forward to the drives.

"rigid": torques of the rigid arm; "elastic": positions, velocities and torques with which an elastic arm follows its
reference; "elastic-position": only the positions and velocities of these.
"""
Posture = Callable[[Floats], Floats]
"""Function from a sample, shape (width,), to the joint angles that it represents, shape (joints,) [rad]."""


class Filter(Forkable, ABC):
    """Time-varying shaping of a sampled reference, one filter for all joints.

    A sample consists of the joint angles, or of the parameter of a path that the joints follow (see `reset`). In the
    second case the shaped sample is also a parameter, so the shaped reference stays on the path, whatever its
    curvature. The modes are always evaluated at the joint angles that the shaped sample represents.

    Attributes:
        name: Name of the filter's shaper or design.
        estimator: The modes as functions of q.
        joints: Number of joints of the arm, and of entries of a sample unless samples are parameters of a path.
        period: Sampling period h [s].
        f_d: Damped frequencies in use [Hz], shape (modes,).
        zeta: Damping ratios in use [-], shape (modes,).
        peak: Factor by which velocity and acceleration may exceed the reference's while the weights are constant: the
            sum of their magnitudes, which is 1 if none is negative [-].
        excess: Share by which the shaped acceleration may exceed the reference's, if such a bound is known and small
            [-]. The generator of the reference can stay below its limit by this share.
        excess_at_limits: Largest shares by which shaped velocity and acceleration exceed those of a reference at the
            arm's limits [-]. Only the caller, who knows the arm, can set them; see `mean_delay_of`.
        clipped: Whether at the last tick a delay exceeded the buffer, or a mode the estimator's bounds.
        feed_forward: Feed-forward that the drives need for the filter to work as designed.
        fault: Why the shaper's function failed in its last call; None if it did not. A filter cannot stop abruptly
            during a motion, so it continues with its last weights, and the caller should stop the motion.
    """

    f_d: Floats
    zeta: Floats

    def __init__(
        self, name: str, estimator: Estimator, joints: int, period: float, capacity: int, peak: float
    ) -> None:
        """Initialize what all filters have in common; a derived class then calls `reset`."""
        if joints < 1:
            raise FilterError("joints", joints, "at least 1")
        check_positive(FilterError, "seconds", period=period)
        self.name, self.estimator = name, estimator
        self.joints, self.period, self.peak = joints, period, peak
        self.excess, self.excess_at_limits, self.clipped = 0.0, (0.0, 0.0), False
        self.fault: str | None = None
        self.feed_forward: FeedForward = "rigid"
        self._line = DelayLine(joints, capacity)
        self._reach = capacity
        """Number of newest samples that the weights may use."""
        self._posture: Posture | None = None
        self._q_star: Floats = np.zeros(joints)
        """Shaped sample of the last tick."""

    @property
    @abstractmethod
    def delay(self) -> float:
        """Longest delay with a weight at the last tick [s]; the shaped reference ends later by this time."""

    @property
    @abstractmethod
    def mean_delay(self) -> float:
        """Mean delay of the last tick's weights [s]: the lag behind a reference of constant velocity."""

    def mean_delay_of(self, f_d: Floats, zeta: Floats) -> float | None:  # noqa: ARG002  unless overridden
        """Mean delay of the weights for given modes [s]; None if it does not depend on the modes.

        While the mean delay changes at a rate Ḋ, the shaped velocity is 1 - Ḋ times the reference's.

        Args:
            f_d: Damped frequencies [Hz], shape (modes,).
            zeta: Damping ratios [-], shape (modes,).
        """
        return None

    @abstractmethod
    def _start(self) -> None:
        """Compute the weights for the modes at the last shaped reference, without any history."""

    @abstractmethod
    def _weigh(self) -> None:
        """Compute the weights of the next tick, and from them the next shaped reference."""

    @property
    def width(self) -> int:
        """Number of entries of a sample."""
        return self._line.joints

    def reset(self, q: npt.ArrayLike, posture: Posture | None = None) -> None:
        """Restart at rest, as if the reference had always been at q.

        Args:
            q: First sample, finite: joint angles [rad], shape (joints,); or a parameter of a path, shape (width,).
            posture: Function from a parameter to the joint angles; None if samples are joint angles.

        Raises:
            ShapingError: q has another shape.
        """
        sample = np.asarray(q, dtype=float)
        width = self.joints if posture is None else sample.size
        if width != self.width:
            self._widen(width)
        self._posture = posture
        self._line.fill(sample)
        self._q_star[:] = sample
        self._start()

    def aim(self, q: npt.ArrayLike | None) -> None:
        """Set where the motion that starts now will end; the reference must be at rest.

        Args:
            q: Sample at the end, shape (width,); None if it is unknown, as in a stream.
        """

    def filter(self, q_ref: npt.ArrayLike) -> Floats:
        """Shape one sample; return the shaped reference x*_i, shape (width,), as a new array.

        Args:
            q_ref: Reference x_i, shape (width,), finite: joint angles [rad], or the parameter of a path.

        Raises:
            ShapingError: q_ref has another shape.
        """
        self._line.push(q_ref)
        self._weigh()
        return self._q_star.copy()

    def filter_all(self, q_ref: npt.ArrayLike) -> Floats:
        """Shape many samples one by one, as `filter` does, with the same bits; return x*_i, shape (T, width).

        Args:
            q_ref: References x_i, one for each tick, shape (T, width), finite.

        Raises:
            ShapingError: The samples have another shape.
        """
        samples = np.asarray(q_ref, dtype=float)
        if samples.ndim != 2:
            raise ShapingError(f"q_ref has shape {samples.shape}: must be (T, {self.width})")
        return np.array([self.filter(sample) for sample in samples]).reshape(samples.shape)

    @property
    def settled(self) -> bool:
        """Whether all samples that the filter may still use are equal, so that its output is constant."""
        return self._line.still > self._reach

    def window(self) -> Floats:
        """Samples of the reference that the filter may still use, the oldest first, shape (k, width)."""
        return self._line.newest(self._line.capacity)

    def _modes(self) -> tuple[Floats, Floats]:
        """Return the modes at the last shaped reference: followed during motion, computed anew at rest.

        The reference counts as at rest if the part of the delay line that weights may use contains a single value, and
        did so one tick ago.
        """
        q = self._angles(self._q_star)
        return self.estimator.settle(q) if self.settled else self.estimator.estimate(q)

    def _angles(self, sample: Floats) -> Floats:
        """Return the joint angles that a sample represents, shape (joints,) [rad]."""
        return sample if self._posture is None else self._posture(sample)

    def _widen(self, width: int) -> None:
        """Accept samples of another width from now on."""
        self._line, self._q_star = DelayLine(width, self._line.capacity), np.zeros(width)

    def _check_made(self) -> None:
        """Raise ShaperFailureError if the shaper fails at the start, when no weights exist to continue with."""
        if self.fault is not None:
            raise ShaperFailureError(self.name, self.fault)

    def take_over(self, other: "Filter") -> None:
        """Continue from another filter's delay line and last shaped sample.

        Args:
            other: Filter to continue from; it is not changed.

        Raises:
            ShapingError: The other filter has a different number of joints.
        """
        if self.joints != other.joints:
            raise ShapingError(
                f"joints is {other.joints}: must be {self.joints}, as in the filter that takes over"
            )
        if self.width != other.width:
            self._widen(other.width)
        self._posture = other._posture  # noqa: SLF001  one of its own kind
        self._line.take_over(other._line)  # noqa: SLF001  likewise
        self._q_star[:] = other._q_star  # noqa: SLF001  likewise
        self._start()
