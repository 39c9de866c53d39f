"""Deadlines of robots' ticks: each robot has its own deadlines, and one thread ticks all robots."""

import math
from heapq import heapreplace

CATCH_UP = 50
"""Largest number of periods made up for after a delay; the others are skipped to limit the burst of ticks."""


class ExternalTicks:
    """Ticks that the arm starts itself, `period` apart [s]; with `counts` False, the arm counts its missed ticks."""

    due = math.inf  # time from which the next tick may start: unknown

    def __init__(self, period: float, start: float, *, counts: bool = True) -> None:
        self._period, self._before, self._counts = period, start, counts

    def begin(self, now: float) -> tuple[int, float, int]:
        """Take the next tick, which starts now; see `Schedule.begin`."""
        gap, self._before = now - self._before, now
        missed = max(0, int(gap / self._period) - 1) if self._counts else 0
        return 0, max(0.0, gap - self._period), missed


class Schedule:
    """Absolute deadlines, a period apart for each robot; the thread wakes up once a period.

    Waking up with cold caches costs a good part of a tick, so all robots whose deadlines follow within a
    period tick one after another. The deadlines are spread evenly, so a robot is late only if those before it
    took more than their share; a tick before its deadline is not late. A tick that starts a period late or
    more is counted as missed and made up for at once. Deadlines never move, so there is no drift. `start` is
    the present time; the first tick is due a period later [s].
    """

    def __init__(self, robots: int, period: float, start: float) -> None:
        self._period = period
        # A sorted list is a valid heap.
        self._deadlines = [(start + period * (1.0 + robot / robots), robot) for robot in range(robots)]
        # Half a share less than a period, so that the first robot's next tick waits for its deadline.
        self._together = period * (1.0 - 0.5 / robots)
        self.due = self._deadlines[0][0]  # time from which the next tick may start [s]

    def begin(self, now: float) -> tuple[int, float, int]:
        """Take the next tick, which starts now; return the robot's index, the lateness [s] and its missed ticks."""
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
