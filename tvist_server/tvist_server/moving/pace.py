"""When control periods begin: with the robot's rows, by its clock; by ours while it is silent."""

import math

from tvist_plant.plant import PERIOD

SILENT = 0.08
"""Time without a row after which the robot counts as silent; its program has begun to brake long since [s]."""
MOST = 50
"""Most periods that are made up for after a gap: time that was longer away has passed by our clock."""


class Pace:
    """Counts the periods of one robot."""

    def __init__(self) -> None:
        self.tick = 0
        """Number of the present period, by the robot's time."""
        self.owed = 0
        """Number of periods that have begun with the last row, and are yet to be computed."""
        self._heard, self._due = -math.inf, 0.0

    def silent(self, now: float) -> bool:
        """Return whether the robot is silent; takes our time, as all that follows [s]."""
        return now - self._heard > SILENT

    def until(self, now: float) -> float:
        """Return how long to wait for a row [s], until a period of our own begins or the robot counts as silent."""
        return max(0.0, (self._due if self.silent(now) else self._heard + SILENT) - now)

    def row(self, tick: int, now: float) -> bool:
        """Take a row; return whether it begins a period. One that is made up for by our clock does not."""
        self._heard = now
        passed = tick - self.tick
        if passed <= 0:
            return False
        self.owed = passed if passed <= MOST else 1
        self.tick = tick - self.owed
        return self.next(now)

    def next(self, now: float) -> bool:
        """Begin the next period, if one is owed or it is time for one of our own; return whether it begins."""
        if self.owed:
            self.owed -= 1
        elif self.silent(now) and now >= self._due:
            self._due = max(self._due + PERIOD, now - PERIOD)
        else:
            return False
        self.tick += 1
        return True
