"""When robots' ticks are due: each robot has deadlines of its own, and one thread serves all of them."""

import math
from heapq import heapreplace

CATCH_UP = 50
"""Number of periods made up for after a delay; further ones are skipped, which limits the length of the burst."""


class Followed:
    """Ticks that begin when the arm says so; those that it has left out are counted.

    Args:
        period: Period of its ticks [s].
        start: Present time [s].
        counts: Whether those left out are to be counted; False if the arm counts them itself, by its own clock.
    """

    due = math.inf
    """Time from which the next tick may begin: nobody knows it."""

    def __init__(self, period: float, start: float, *, counts: bool = True) -> None:
        self._period, self._before, self._counts = period, start, counts

    def begin(self, now: float) -> tuple[int, float, int]:
        """Take the next tick, which begins now; see `Schedule.begin`."""
        gap, self._before = now - self._before, now
        missed = max(0, int(gap / self._period) - 1) if self._counts else 0
        return 0, max(0.0, gap - self._period), missed


class Schedule:
    """Absolute deadlines, a period apart for each robot, for which the thread wakes up once a period.

    To wake up, with cold caches, costs a good part of a tick. So those robots whose deadlines follow within a period
    tick one after another in the same go. Their deadlines are spread evenly over the period, so that a robot is late
    only if those before it took more than their share; one that comes before its deadline is not late. A tick that
    begins a period late or more is counted as missed and made up for at once, and the deadlines stay where they were,
    so there is no drift even after a week.

    Args:
        robots: Number of robots.
        period: Period of each robot's ticks [s].
        start: Present time; the first tick is due a period later [s].
    """

    def __init__(self, robots: int, period: float, start: float) -> None:
        self._period = period
        # A sorted list is a valid heap.
        self._deadlines = [(start + period * (1.0 + robot / robots), robot) for robot in range(robots)]
        # Half a share short of a period: the first robot's next tick waits for its deadline.
        self._together = period * (1.0 - 0.5 / robots)
        self.due = self._deadlines[0][0]
        """Time from which the next tick may begin [s]."""

    def begin(self, now: float) -> tuple[int, float, int]:
        """Take the next tick, which begins now.

        Returns:
            Index of the robot whose tick it is, how late it begins [s], and how many of the robot's ticks were
            missed.
        """
        deadline, robot = self._deadlines[0]
        period = self._period
        late = max(0.0, now - deadline)
        missed = left_out = 0
        if late >= period:
            left_out = max(0, int(late / period) - CATCH_UP)
            missed = 1 + left_out
        heapreplace(self._deadlines, (deadline + period * (1 + left_out), robot))
        following = self._deadlines[0][0]
        if following >= self.due + self._together:
            self.due = following
        return robot, late, missed
