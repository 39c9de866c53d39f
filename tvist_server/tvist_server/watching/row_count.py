"""Counts the rows of a robot by its own clock: which control period each belongs to, and which are missing."""

from typing import NamedTuple

from tvist_plant.plant import PERIOD
from tvist_server.rtde.client import RtdeError

SAME_CLOCK = 1.0
"""Largest lead of a row over those before it, and difference of the clocks over a lost connection [s]."""


class Counted(NamedTuple):
    """A row that is new."""

    tick: int
    """Number of its control period; it increases from row to row."""
    missing: int
    """Number of rows that are missing before it."""
    anew: bool
    """Whether the robot's clock has begun anew, so that `missing` is by our clock."""


class RowCount:
    """Numbers rows by the robot's time, as the number of control periods since its clock began.

    If that clock begins anew, as after a restart, the numbers go on by as much as our clock says.

    Args:
        interval: Number of control periods between two rows: 1 at 500 Hz, 4 at 125 Hz.
    """

    def __init__(self, interval: int) -> None:
        self._interval = interval
        self._own: int | None = None
        self._offset, self._heard, self._ahead = 0, 0.0, 0.0
        self.tick = 0
        """Number of the last row; 0 before the first."""
        self.rows = self.missing = self.doubled = 0
        """Numbers of rows since the first one: those taken, those missing, and those left out since they came twice."""

    def take(self, timestamp: float, now: float, *, reconnected: bool = False) -> Counted | None:
        """Take a row; return None if it is the last one again.

        Args:
            timestamp: The robot's time [s].
            now: Our time [s].
            reconnected: Whether the connection was lost before it. If not, time that does not go on as ours does, or
                goes back, raises `RtdeError`.
        """
        own, before = round(timestamp / PERIOD), self._own
        if own == before:
            self.doubled += 1
            return None
        missing, anew, ahead = 0, False, timestamp - now
        if before is not None and not reconnected:
            if own < before or ahead > self._ahead + SAME_CLOCK:
                raise RtdeError(f"the robot's timestamp goes from {before * PERIOD:g} to {timestamp:g} s")
            ahead = max(ahead, self._ahead)
        if before is not None:
            passed, elapsed = own - before, round((now - self._heard) / PERIOD)
            anew = passed < 0 or (reconnected and abs(passed - elapsed) > SAME_CLOCK / PERIOD)
            if anew:
                passed = max(1, elapsed)
                self._offset = self.tick + passed - own
            missing = max(0, round(passed / self._interval) - 1)
        self._own, self._heard, self._ahead = own, now, ahead
        self.tick = max(own + self._offset, self.tick + 1)
        self.rows += 1
        self.missing += missing
        return Counted(self.tick, missing, anew)

    def silence(self) -> int:
        """Return the number of a control period without a row, in which the robot was lost."""
        self.tick += 1
        return self.tick
