"""Simulation of future references, as far as the caller needs."""

from functools import cached_property

import numpy as np

from tvist_controller.line.differentiator import STILL, Floats, rests_at
from tvist_controller.line.line_filter import LineFilter
from tvist_controller.line.shaped_reference import ShapedReference
from tvist_controller.trajectory import Trajectory
from tvist_plant.plant import PERIOD

MAX_AHEAD = 4000  # largest number of ticks simulated to find the end of a motion


class LineSimulation:
    """A control line without its arm, simulated ahead; it consumes its arguments. A stop has no filter."""

    def __init__(
        self, trajectory: Trajectory, line_filter: LineFilter | None, shaped: ShapedReference
    ) -> None:
        self._trajectory, self._line_filter, self._shaped = trajectory, line_filter, shaped
        self.samples: list[Floats] = [shaped.along.published.q, shaped.along.position]
        """Samples of the shaped reference, one per entry of `references`: path parameters or joint positions."""
        self.references: list[Floats] = [shaped.joints.published.q, shaped.position]
        """The last two shaped references played, then the future ones per tick, each of shape (n,) [rad]."""
        self.rests = False  # whether the last reference is at rest, so that no more follow

    def until(self, ticks: int) -> None:
        """Simulate until this many future references are known or they come to rest."""
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
    """Return the index of the last of references (k, n), one per tick, that moved; 0 if none."""
    moves = np.flatnonzero(np.abs(np.diff(references, axis=0)).max(axis=1) > STILL)
    return int(moves[-1]) + 1 if len(moves) else 0
