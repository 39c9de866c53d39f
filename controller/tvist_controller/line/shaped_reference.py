"""The shaped reference: filter samples, corresponding joint positions, and derivatives."""

import copy
from typing import Self

from tvist_controller.line.differentiator import Differentiator, Floats, Target
from tvist_shaping.base import Posture


class ShapedReference:
    """Converts filter samples (joint positions or a path's parameter) to targets, from rest."""

    def __init__(self, q: Floats, period: float) -> None:
        self._period = period
        self.joints = Differentiator(q, period)  # state of the joints
        self.reset(q)

    def reset(self, q: Floats) -> None:
        """Restart at rest with joint positions as samples."""
        self.joints.reset(q)
        self.references = self.joints.window
        """The last three unshaped references, as `Differentiator.window`; during a bypass, the shaped ones."""
        self.enter(None, q)

    def enter(self, posture_of: Posture | None, sample: Floats) -> None:
        """Accept samples of another kind, at rest; the joints keep their position."""
        self.posture_of = posture_of
        """Function from samples to joint positions; None if samples are joint positions."""
        self.along = self.joints if posture_of is None else Differentiator(sample, self._period)
        """State of the samples; without a path, of the joints."""

    @property
    def position(self) -> Floats:
        """The newest joint positions, shape (n,) [rad]."""
        return self.joints.position

    @property
    def newest(self) -> Target:
        """State of the joints, see `Differentiator.newest`."""
        return self.joints.newest

    def take(self, x: Floats, x_star: Floats) -> Floats:
        """Take this tick's samples, equal objects without a filter; return the unshaped joint positions."""
        q, q_star, posture_of = x, x_star, self.posture_of
        if posture_of is not None:
            q = posture_of(x)
            q_star = q if x_star is x else posture_of(x_star)
            self.along.push(x_star)
        self.joints.push(q_star)
        if x_star is x:  # what bypasses the filter continues the shaped reference: the reference may jump
            self.references = self.joints.window
        else:
            _, middle, last = self.references
            self.references = (middle, last, q)
        return q

    def posture(self, sample: Floats) -> Floats:
        """Return the joint positions of a sample, shape (n,) [rad]."""
        return sample if self.posture_of is None else self.posture_of(sample)

    def fork(self) -> Self:
        """Return an independent copy."""
        other = copy.copy(self)
        other.joints = self.joints.fork()
        other.along = other.joints if self.posture_of is None else self.along.fork()
        return other
