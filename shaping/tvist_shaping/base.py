"""What every filter is: a delay line, an estimator, and weights that follow the modes."""

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Self

import numpy as np
import numpy.typing as npt

from tvist_shaping._types import Floats
from tvist_shaping.delay_line import DelayLine
from tvist_shaping.errors import FilterError, ShaperFailureError, ShapingError
from tvist_shaping.estimators.base import Estimator

Posture = Callable[[Floats], Floats]
"""Function from a sample, shape (width,), to the joint angles that it represents, shape (joints,) [rad]."""


class Filter(ABC):
    """Time-varying shaping of a sampled reference, one filter for all joints.

    A sample is the joint angles, or the parameter of a path that the joints go along (`reset`): then the shaped
    parameter stays a parameter, and the shaped reference on its path however that curves. The modes are always those
    at the joint angles that the shaped sample stands for.

    Attributes:
        name: What it is called: of a shaper, or of a design.
        estimator: The modes as functions of q.
        joints: How many joints the arm has: entries of a sample, unless samples are parameters of a path.
        period: h [s].
        f_d: Damped frequencies it works with [Hz], shape (modes,).
        zeta: Damping ratios it works with [-], shape (modes,).
        excess: Share by which the shaped acceleration may exceed the reference's, as far as it is known and kept
            small: who makes the reference can stay that much below a limit [-].
        clipped: Whether it could not do what it should at the last tick: a delay was beyond what it holds, or a mode
            beyond what its estimator believes.
        fault: Why the shaper's function failed when it was asked last; None: it did not. A filter in the middle of a
            motion cannot stop dead, so it goes on with the last weights it had, and somebody should stop the motion.
    """

    name: str
    estimator: Estimator
    joints: int
    period: float
    f_d: Floats
    zeta: Floats
    excess: float
    clipped: bool
    fault: str | None

    def __init__(self, name: str, estimator: Estimator, joints: int, period: float, capacity: int) -> None:
        """The parts that all filters have; a filter of its own kind then calls `reset`.

        Args:
            name: What it is called.
            estimator: The estimator.
            joints: Joints of the arm, >= 1.
            period: Time between two samples h [s], > 0.
            capacity: Samples to keep.

        Raises:
            FilterError: A number is out of range.
        """
        if joints < 1:
            raise FilterError("joints", joints, "at least 1")
        if not 0.0 < period < np.inf:
            raise FilterError("period", period, "a finite number of seconds above 0")
        self.name, self.estimator = name, estimator
        self.joints, self.period = joints, period
        self.excess, self.clipped, self.fault = 0.0, False, None
        self._line = DelayLine(joints, capacity)
        self._reach = capacity
        """Number of the newest samples that weights may use."""
        self._posture: Posture | None = None
        self._q_star: Floats = np.zeros(joints)
        """Shaped sample of the last tick."""

    @property
    @abstractmethod
    def delay(self) -> float:
        """Time of the last weight of the last tick [s]: how much later the shaped reference ends."""

    @property
    @abstractmethod
    def mean_delay(self) -> float:
        """Mean delay of the weights of the last tick [s]: the lag behind a reference of constant velocity."""

    @property
    def peak(self) -> float:
        """Factor by which the velocity and acceleration may exceed the reference's while the weights stay as they are.

        The sum of the weights' magnitudes [-], 1 where none is negative.
        """
        return 1.0

    @abstractmethod
    def _start(self) -> None:
        """Weights for the modes at the last shaped reference, nothing remembered."""

    @abstractmethod
    def _weigh(self) -> None:
        """Weights of the next tick, and with them the next shaped reference."""

    @property
    def width(self) -> int:
        """Entries of a sample."""
        return self._line.joints

    def reset(self, q: npt.ArrayLike, posture: Posture | None = None) -> None:
        """Start anew at rest: the reference has been at q for ever.

        Args:
            q: First sample, finite: joint angles [rad], shape (joints,); or a parameter of a path, shape (width,).
            posture: Function from a parameter to the joint angles there; None: samples are joint angles.

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

    def aim(self, q: npt.ArrayLike | None) -> None:  # noqa: B027  most filters do not care
        """Hear where the motion that begins now will end; the reference must be at rest.

        Args:
            q: Sample at the end, shape (width,); None: it is not known, as in a stream.
        """

    def filter(self, q_ref: npt.ArrayLike) -> Floats:
        """Shape one sample.

        Args:
            q_ref: Reference x_i, shape (width,), finite: joint angles [rad], or the parameter of a path.

        Returns:
            Shaped reference x*_i, shape (width,), the caller's own.

        Raises:
            ShapingError: q_ref has another shape.
        """
        self._line.push(q_ref)
        self._weigh()
        return self._q_star.copy()

    def fork(self) -> Self:
        """An independent copy that goes on from here.

        For the same samples it gives the same bits as this filter, and whatever it is given changes nothing here:
        so one can run ahead to see what this one is going to do.

        Returns:
            The copy, with an estimator of its own; use it in the thread of the original.
        """
        other = copy.copy(self)
        other._part()  # noqa: SLF001  one of its own kind
        return other

    def _part(self) -> None:
        """Replace what is changed in place by copies: a new copy of the filter shares it still."""
        self.estimator, self._line = self.estimator.fork(), self._line.fork()
        self._q_star = self._q_star.copy()

    @property
    def settled(self) -> bool:
        """Whether all that it may still read is one sample, so that its output rests."""
        return self._line.still > self._reach

    def window(self) -> Floats:
        """Samples of the reference that it may still read, the oldest first, shape (k, width)."""
        return self._line.newest(self._line.capacity)

    def _modes(self) -> tuple[Floats, Floats]:
        """Modes at the last shaped reference: followed in motion, anew where any weights give the same.

        Where the line holds one sample as far as weights may reach, and did a tick ago, so that the shaped reference
        rests on it.
        """
        q = self._angles(self._q_star)
        return self.estimator.settle(q) if self.settled else self.estimator.estimate(q)

    def _angles(self, sample: Floats) -> Floats:
        """Joint angles that a sample stands for, shape (joints,) [rad]."""
        return sample if self._posture is None else self._posture(sample)

    def _widen(self, width: int) -> None:
        """Take samples of another width from now on."""
        self._line, self._q_star = DelayLine(width, self._line.capacity), np.zeros(width)

    def _check_made(self) -> None:
        """Refuse a shaper that fails at once: there are no weights yet to go on with.

        Raises:
            ShaperFailureError: The shaper fails.
        """
        if self.fault is not None:
            raise ShaperFailureError(self.name, self.fault)

    def take_over(self, other: "Filter") -> None:
        """Go on where another filter is: with the reference it was given, from the shaped one it gave.

        Args:
            other: The filter to go on from; it is left as it is.

        Raises:
            ShapingError: The other filter has a different number of joints.
        """
        if self.joints != other.joints:
            raise ShapingError(f"a filter of {self.joints} joints cannot go on from one of {other.joints}")
        if self.width != other.width:
            self._widen(other.width)
        self._posture = other._posture  # noqa: SLF001  one of its own kind
        self._line.take_over(other._line)  # noqa: SLF001  likewise
        self._q_star[:] = other._q_star  # noqa: SLF001  likewise
        self._start()
