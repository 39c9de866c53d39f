"""The newest set-points, as they go to the robot: each package repeats those before, in case their own comes late."""

from collections import deque
from collections.abc import Sequence

from tvist_server.moving.registers import JOINTS, KEPT, MOST


class Window:
    """Numbers set-points from 1 on, one for each control period of the robot, and keeps those of the next package."""

    def __init__(self) -> None:
        self.number = 0
        """Number of the newest set-point; 0 before the first."""
        self._kept = deque[Sequence[float]](maxlen=KEPT)

    @property
    def newest(self) -> Sequence[float] | None:
        """The newest set-point, shape (6,) [rad]; None before the first."""
        return self._kept[0] if self._kept else None

    def add(self, setpoint: Sequence[float]) -> None:
        """Add the next set-point, joint angles of shape (6,) [rad]. Before the first one, the arm counts as there."""
        self.number = self.number % MOST + 1
        self._kept.extendleft([setpoint] * (1 if self._kept else KEPT))

    def values(self, order: int) -> tuple[float, ...]:
        """Return the values of an input package, in the order of `registers.INPUTS`; zeros before the first set-point.

        Args:
            order: Number of the run that is to follow; its negative to end it.
        """
        kept = self._kept or [(0.0,) * JOINTS] * KEPT
        return self.number, order, *(angle for one in kept for angle in one)
