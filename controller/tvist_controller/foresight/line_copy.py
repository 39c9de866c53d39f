"""Future references, simulated as far ahead as the caller needs them."""

from functools import cached_property

import numpy as np

from tvist_controller.line.differentiator import STILL, Floats, rests_at
from tvist_controller.line.line_filter import LineFilter
from tvist_controller.line.shaped_reference import ShapedReference
from tvist_controller.trajectory import Trajectory
from tvist_plant.plant import PERIOD

MAX_AHEAD = 4000
"""Largest number of ticks that a motion is simulated ahead to find its end."""


class LineSimulation:
    """A control line without its arm, simulated ahead of time; what it is made of is consumed.

    A stop has no filter, since it bypasses that.
    """

    def __init__(
        self, trajectory: Trajectory, line_filter: LineFilter | None, shaped: ShapedReference
    ) -> None:
        self._trajectory, self._line_filter, self._shaped = trajectory, line_filter, shaped
        self.samples: list[Floats] = [shaped.along.published.q, shaped.along.position]
        """Samples of the shaped reference, one for each entry of `references`: path parameters, or else joint
        positions.
        """
        self.references: list[Floats] = [shaped.joints.published.q, shaped.position]
        """The last two shaped references played and the future ones, one for each tick, each of shape (n,) [rad]."""
        self.rests = False
        """True once the last reference is at rest, so that no more will follow."""

    def until(self, ticks: int) -> None:
        """Simulate until this many future references are known, or they come to rest."""
        trajectory, line_filter = self._trajectory, self._line_filter
        while not self.rests and len(self.references) < ticks + 2:
            x = trajectory.next()
            x_star = x if line_filter is None else line_filter.filter(x)
            self._shaped.take(x_star, x_star)
            self.samples.append(x_star)
            self.references.append(self._shaped.position)
            settled, shaped = line_filter is None or line_filter.settled, self._shaped
            standing = trajectory.standing and settled
            self.rests = standing and rests_at(shaped.posture(x), shaped.joints.published, PERIOD)

    @cached_property
    def last(self) -> int:
        """Index of the last reference that moved, if they come to rest; 0 if none moved."""
        return resting_after(np.array(self.references))


def resting_after(references: Floats) -> int:
    """Return the index of the last one of references of shape (k, n), one for each tick, that moved; 0 if none did."""
    moves = np.flatnonzero(np.abs(np.diff(references, axis=0)).max(axis=1) > STILL)
    return int(moves[-1]) + 1 if len(moves) else 0
