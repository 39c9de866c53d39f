"""References that are still to come, run ahead as far as somebody wants to know them."""

from functools import cached_property

import numpy as np

from tvist_controller.control.differentiator import Floats
from tvist_controller.control.shaped_reference import ShapedReference
from tvist_controller.cycle import STILL, rests
from tvist_controller.line_filter import LineFilter
from tvist_controller.trajectory import Trajectory

MAX_AHEAD = 4000
"""Ticks that a motion is run ahead at most to see how it will end."""


class Ahead:
    """A control line without its arm, run ahead of itself.

    Args:
        trajectory: What is followed; it is used up.
        line_filter: What shapes it, used up likewise; None for a stop, which bypasses it.
        shaped: Shaped reference, consumed in the same way.
    """

    def __init__(
        self, trajectory: Trajectory, line_filter: LineFilter | None, shaped: ShapedReference
    ) -> None:
        self._trajectory, self._line_filter, self._shaped = trajectory, line_filter, shaped
        self.samples: list[Floats] = [shaped.along.published.q, shaped.along.position]
        """Samples of the shaped reference: the parameter of its path, or as `references`; as many as these."""
        self.references: list[Floats] = [shaped.joints.published.q, shaped.joints.position]
        """The two shaped references played last and those to come, one a tick, each of shape (n,) [rad]."""
        self.rests = False
        """True once the last of them is at rest: no more will follow."""

    def until(self, ticks: int) -> None:
        """Run on until so many references to come are known, or they rest."""
        trajectory, line_filter = self._trajectory, self._line_filter
        while not self.rests and len(self.references) < ticks + 2:
            x = trajectory.next()
            x_star = x if line_filter is None else line_filter.filter(x)
            target = self._shaped.update(x_star)
            self.samples.append(x_star)
            self.references.append(self._shaped.joints.position)
            settled = line_filter is None or line_filter.settled
            self.rests = trajectory.standing and settled and rests(self._shaped.posture(x), target)

    @cached_property
    def last(self) -> int:
        """Index of the last reference that has moved, for those that rest; 0: none has."""
        return resting_after(np.array(self.references))


def resting_after(references: Floats) -> int:
    """Index of the last of some references, one a tick and of shape (k, n), that has moved; 0: none has."""
    moves = np.flatnonzero(np.abs(np.diff(references, axis=0)).max(axis=1) > STILL)
    return int(moves[-1]) + 1 if len(moves) else 0
