"""The shaped reference: the filter's samples, the joint positions that they stand for, and their derivatives."""

import copy
from typing import Self

from tvist_controller.line.differentiator import Differentiator, Floats, Target
from tvist_shaping.base import Posture


class ShapedReference:
    """Converts samples of the filter into targets, from rest at joint positions.

    Samples are joint positions, or the parameter of a path on which the joints have to stay.
    """

    def __init__(self, q: Floats, period: float) -> None:
        self._period = period
        self.joints = Differentiator(q, period)
        """State of motion of the joints."""
        self.reset(q)

    def reset(self, q: Floats) -> None:
        """Restart at rest; from now on samples are joint positions."""
        self.joints.reset(q)
        self.references = self.joints.window
        """The last three references before shaping, as `Differentiator.window`; since a bypass, the shaped ones."""
        self.enter(None, q)

    def enter(self, posture_of: Posture | None, sample: Floats) -> None:
        """Accept samples of another kind, at rest now; the joints continue from their present position."""
        self.posture_of = posture_of
        """Converts samples to joint positions; None if they are joint positions."""
        self.along = self.joints if posture_of is None else Differentiator(sample, self._period)
        """State of motion of the samples; without a path it is that of the joints."""

    @property
    def position(self) -> Floats:
        """The newest joint positions, shape (n,) [rad]."""
        return self.joints.position

    @property
    def newest(self) -> Target:
        """State of motion of the joints there, see `Differentiator.newest`."""
        return self.joints.newest

    def take(self, x: Floats, x_star: Floats) -> Floats:
        """Take the samples of this tick, and return the joint positions before shaping, shape (n,) [rad].

        Without a filter, both samples are the same object.
        """
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
        """Return the joint positions that a sample stands for, shape (n,) [rad]."""
        return sample if self.posture_of is None else self.posture_of(sample)

    def fork(self) -> Self:
        """Return an independent copy of the present state."""
        other = copy.copy(self)
        other.joints = self.joints.fork()
        other.along = other.joints if self.posture_of is None else self.along.fork()
        return other
