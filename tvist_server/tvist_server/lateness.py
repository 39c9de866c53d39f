"""Lateness of a robot's ticks."""

import time
from dataclasses import dataclass

import numpy as np

KEPT = 4096  # largest number of ticks kept: eight seconds, while they are read every second


@dataclass(frozen=True)
class LatenessMonitor:
    """Statistics of the ticks between two calls of `look`."""

    ticks: int
    seconds: float
    p50_us: float
    p99_us: float
    max_us: float
    load: float  # share of the time spent in ticks and the jobs between them [-]


class Lateness:
    """Record of lateness, written by one thread and read by another."""

    def __init__(self) -> None:
        self._late = np.zeros(KEPT)
        self._count = 0
        self._worked = 0.0
        self._looked, self._looked_at = 0, time.monotonic()

    def note(self, late: float, worked: float) -> None:
        """Add a tick's lateness, and the duration of the tick and the jobs before it [s]."""
        self._late[self._count % KEPT] = late
        self._count += 1
        self._worked += worked

    def look(self) -> LatenessMonitor:
        """Return the lateness since the last call."""
        count, now = self._count, time.monotonic()
        late = self._late[np.arange(max(self._looked, count - KEPT), count) % KEPT] * 1e6
        seconds, ticks = now - self._looked_at, count - self._looked
        self._looked, self._looked_at = count, now
        worked, self._worked = self._worked, 0.0  # a tick that ends just between is not counted
        load = worked / seconds if seconds > 0.0 else 0.0
        if not len(late):
            return LatenessMonitor(0, seconds, 0.0, 0.0, 0.0, load)
        p50, p99 = np.percentile(late, (50, 99))
        return LatenessMonitor(ticks, seconds, float(p50), float(p99), float(late.max()), load)
