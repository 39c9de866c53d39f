"""The shaped reference: what the filter gave, the joint positions that it stands for, and how both move."""

import copy
from typing import Self

from tvist_controller.control.differentiator import Differentiator, Floats, Target
from tvist_shaping.base import Posture


class ShapedReference:
    """From samples of the filter to targets.

    Samples are joint positions, or the parameter of a path on which they are to stay.

    Args:
        q: Joint positions at rest to start from, shape (n,) [rad].
        period: Tick [s].
    """

    def __init__(self, q: Floats, period: float) -> None:
        self._period = period
        self.joints = Differentiator(q, period)
        """State of motion of the joints."""
        self.reset(q)

    def reset(self, q: Floats) -> None:
        """Start anew at rest; samples are joint positions."""
        self.joints.reset(q)
        self.enter(None, q)

    def enter(self, posture_of: Posture | None, sample: Floats) -> None:
        """Take samples of another kind from now on; the joints go on where they are.

        Args:
            posture_of: From samples to joint positions; None: they are joint positions.
            sample: Value at which the path's parameter rests, shape (m,) [rad].
        """
        self.posture_of = posture_of
        """From samples to joint positions; None: they are joint positions."""
        self.along = self.joints if posture_of is None else Differentiator(sample, self._period)
        """State of motion of the samples: without a path the joints' own."""

    def posture(self, sample: Floats) -> Floats:
        """Joint positions that a sample stands for, shape (n,) [rad]."""
        return sample if self.posture_of is None else self.posture_of(sample)

    def update(self, sample: Floats) -> Target:
        """Take the sample of this tick; target of the tick before."""
        if self.posture_of is None:
            return self.joints.update(sample)
        self.along.update(sample)
        return self.joints.update(self.posture_of(sample))

    def fork(self) -> Self:
        """An independent copy that goes on from here."""
        other = copy.copy(self)
        other.joints = self.joints.fork()
        other.along = other.joints if self.posture_of is None else self.along.fork()
        return other
