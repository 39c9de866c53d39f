"""When the ticks of robots are due: each has deadlines of its own, and one thread keeps them all."""

from heapq import heapreplace

CATCH_UP = 50
"""Periods that are made up for after a delay; what is more is left out, so that no burst lasts longer than that."""
MOMENTS = 4
"""Number of moments of a period at which robots are due. Waking up costs half as much as a tick, since caches are cold
then: more moments would mean fewer robots."""


class Schedule:
    """Absolute deadlines, a period apart for each robot, staggered so that robots do not wait for each other.

    Of up to `MOMENTS` robots one is due every N-th part of a period, so that what one does delays the next only
    where it takes longer than that; of more, those of a moment tick one after another. A tick that begins a
    period late or more is counted as missed and made up for at once, and the deadlines stay where they were:
    after a week they are still on time.

    Args:
        robots: Number of robots.
        period: Period of each robot's ticks [s].
        start: Now; the first tick is due a period later [s].
    """

    def __init__(self, robots: int, period: float, start: float) -> None:
        self._period = period
        moments = min(robots, MOMENTS)
        # Sorted, hence a heap.
        self._due = sorted(
            (start + period * (1.0 + robot % moments / moments), robot) for robot in range(robots)
        )

    @property
    def due(self) -> float:
        """When the next tick is due [s]."""
        return self._due[0][0]

    def begin(self, now: float) -> tuple[int, float, int]:
        """Take the next tick, which begins now.

        Returns:
            Number of the robot whose tick it is, how late it begins [s], and how many ticks of its were missed.
        """
        deadline, robot = self._due[0]
        period = self._period
        late = now - deadline
        missed = left_out = 0
        if late >= period:
            left_out = max(0, int(late / period) - CATCH_UP)
            missed = 1 + left_out
        heapreplace(self._due, (deadline + period * (1 + left_out), robot))
        return robot, late, missed
