"""What every filter is: a delay line, an estimator, and weights that follow the modes."""

import copy
from abc import ABC, abstractmethod
from typing import Self

import numpy as np
import numpy.typing as npt

from tvist_shaping._types import Floats
from tvist_shaping.delay_line import DelayLine
from tvist_shaping.errors import FilterError, ShaperFailureError
from tvist_shaping.estimators.base import Estimator


class Filter(ABC):
    """Time-varying shaping of a sampled reference, one filter for all joints.

    Attributes:
        name: What it is called: of a shaper, or of a design.
        estimator: The modes as functions of q.
        joints: Entries of a sample.
        period: h [s].
        f_d: Damped frequencies it works with [Hz], shape (modes,).
        zeta: Damping ratios it works with [-], shape (modes,).
        excess: By what share the shaped acceleration may exceed the reference's, as far as it is known and kept
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
            joints: Entries of a sample, >= 1.
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
        """How many of the newest samples any weights may read."""
        self._q_star: Floats = np.zeros(joints)

    @property
    @abstractmethod
    def delay(self) -> float:
        """Time of the last weight of the last tick [s]: how much later the shaped reference ends."""

    @property
    @abstractmethod
    def mean_delay(self) -> float:
        """Of the weights of the last tick [s]: how far the shaped reference trails one of constant velocity."""

    @property
    def peak(self) -> float:
        """By what factor the velocity and acceleration may exceed the reference's while the weights stay as they are.

        The sum of the weights' magnitudes [-], 1 where none is negative.
        """
        return 1.0

    @abstractmethod
    def _start(self) -> None:
        """Weights for the modes at the last shaped reference, nothing remembered."""

    @abstractmethod
    def _weigh(self) -> None:
        """Weights of the next tick, and with them the next shaped reference."""

    @abstractmethod
    def with_estimator(self, estimator: Estimator) -> Self:
        """The same filter with another estimator, that goes on where this one is; this one is left as it is.

        Raises:
            FilterError: The two do not fit.
        """

    def reset(self, q: npt.ArrayLike) -> None:
        """Start anew at rest: the reference has been at q for ever.

        Args:
            q: Joint angles [rad], shape (joints,), finite.

        Raises:
            ShapingError: q has another shape.
        """
        self._line.fill(q)
        self._q_star[:] = q
        self._start()

    def aim(self, q: npt.ArrayLike | None) -> None:  # noqa: B027  most filters do not care
        """Hear where the motion that begins now will end; the reference must be at rest.

        Args:
            q: Joint angles at the end [rad], shape (joints,); None: it is not known, as in a stream.
        """

    def filter(self, q_ref: npt.ArrayLike) -> Floats:
        """Shape one sample.

        Args:
            q_ref: Reference x_i [rad], shape (joints,), finite.

        Returns:
            Shaped reference x*_i [rad], shape (joints,), the caller's own.

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
        """Samples of the reference that it may still read, the oldest first, shape (k, joints) [rad]."""
        return self._line.newest(self._line.capacity)

    def _modes(self) -> tuple[Floats, Floats]:
        """Modes at the last shaped reference: followed in motion, anew where any weights give the same.

        Where the line holds one sample as far as weights may reach, and did a tick ago, so that the shaped reference
        rests on it.
        """
        if self.settled:
            return self.estimator.settle(self._q_star)
        return self.estimator.estimate(self._q_star)

    def _check_made(self) -> None:
        """Refuse a shaper that fails at once: there are no weights yet to go on with.

        Raises:
            ShaperFailureError: It fails.
        """
        if self.fault is not None:
            raise ShaperFailureError(self.name, self.fault)

    def take_over(self, other: "Filter") -> None:
        """Go on where another filter is: with the reference it was given, from the shaped one it gave.

        Args:
            other: The filter to go on from; it is left as it is.

        Raises:
            ShapingError: It has other joints.
        """
        self._line.take_over(other._line)  # noqa: SLF001  one of its own kind
        self._q_star[:] = other._q_star  # noqa: SLF001  likewise
        self._start()
