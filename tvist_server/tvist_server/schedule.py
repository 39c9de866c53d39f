"""When robots' ticks are due: each robot has deadlines of its own, and one thread serves all of them."""

from heapq import heapreplace

CATCH_UP = 50
"""Number of periods made up for after a delay; further ones are skipped, which limits the length of the burst."""
MOMENTS = 4
"""Number of moments within a period at which robots are due. Waking up with cold caches costs half as much as a tick,
so more moments would allow fewer robots.
"""


class Followed:
    """Ticks that begin when the arm says so; those that it has left out are counted.

    Args:
        period: Period of its ticks [s].
        start: Present time [s].
    """

    def __init__(self, period: float, start: float) -> None:
        self._period, self._before = period, start

    def begin(self, now: float) -> tuple[int, float, int]:
        """Take the next tick, which begins now; see `Schedule.begin`."""
        gap, self._before = now - self._before, now
        return 0, max(0.0, gap - self._period), max(0, int(gap / self._period) - 1)


class Schedule:
    """Absolute deadlines, a period apart for each robot, and staggered so that robots do not wait for each other.

    Up to `MOMENTS` robots are spread evenly over the period, so that a slow tick of one robot delays the next robot
    only if it takes longer than that distance. With more robots, those with the same moment tick one after another. A
    tick that begins a period late or more is counted as missed and made up for at once, and the deadlines stay where
    they were, so there is no drift even after a week.

    Args:
        robots: Number of robots.
        period: Period of each robot's ticks [s].
        start: Present time; the first tick is due a period later [s].
    """

    def __init__(self, robots: int, period: float, start: float) -> None:
        self._period = period
        moments = min(robots, MOMENTS)
        # A sorted list is a valid heap.
        self._due = sorted(
            (start + period * (1.0 + robot % moments / moments), robot) for robot in range(robots)
        )

    @property
    def due(self) -> float:
        """Time at which the next tick is due [s]."""
        return self._due[0][0]

    def begin(self, now: float) -> tuple[int, float, int]:
        """Take the next tick, which begins now.

        Returns:
            Index of the robot whose tick it is, how late it begins [s], and how many of the robot's ticks were
            missed.
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
