"""A reference whose positions are known in advance."""

from collections.abc import Sequence

from tvist_controller.trajectory.base import Trajectory
from tvist_controller.trajectory.limits import Floats


class Known(Trajectory):
    """A sequence of positions, one for each tick.

    Args:
        positions: At least one position, each of shape (n,) [rad]; the last one is kept.
        period: Tick [s].
    """

    def __init__(self, positions: Sequence[Floats], period: float) -> None:
        self._positions, self._period = positions, period
        self._ticks = -1

    @property
    def duration(self) -> float:
        """Time until the last position [s]."""
        return len(self._positions) * self._period

    @property
    def end(self) -> Floats:
        """The last position, shape (n,) [rad]."""
        return self._positions[-1]

    def next(self) -> Floats:
        """Return the next position."""
        self._ticks = min(self._ticks + 1, len(self._positions) - 1)
        return self._positions[self._ticks]

    @property
    def finished(self) -> bool:
        """Whether it has reached the last position."""
        return self._ticks == len(self._positions) - 1
