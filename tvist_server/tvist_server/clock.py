"""Who lets time pass for a served robot: the wall clock, or a client's steps.

Either way one thread owns the controller; jobs from elsewhere reach it through a queue.
"""

import logging
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from queue import Empty, SimpleQueue

import numpy as np

from tvist_server.host import Host

log = logging.getLogger(__name__)

Job = Callable[[], None]

CATCH_UP = 50
"""Periods that are made up for after a delay; what is more is left out, so that no burst lasts longer than that."""


@dataclass(frozen=True)
class Punctuality:
    """Lateness of the ticks since the last look."""

    ticks: int
    seconds: float
    p50_us: float
    p99_us: float
    max_us: float


class Clock(ABC):
    """A thread that runs jobs and ticks.

    Args:
        host: The controller to drive.
    """

    def __init__(self, host: Host) -> None:
        self.host = host
        self._jobs: SimpleQueue[Job] = SimpleQueue()
        self._running = True
        self._thread = threading.Thread(target=self._guarded, name="tvist-tick", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def post(self, job: Job) -> None:
        """Run a job in the controller's thread before its next tick. From any thread; never waits."""
        self._jobs.put(job)

    def close(self) -> None:
        """End, after the jobs that are waiting."""
        self._running = False
        self.post(_nothing)
        if self._thread.is_alive():
            self._thread.join()

    def punctuality(self) -> Punctuality | None:
        """Lateness since the last look; None where time does not pass by itself."""
        return None

    def _guarded(self) -> None:
        try:
            self._run()
        except Exception:
            log.exception("the controller's thread ended")
            self.host.failure = "the controller's thread ended by an error: see the log"

    @abstractmethod
    def _run(self) -> None: ...


class Lockstep(Clock):
    """Time passes when a client steps; the last state is told again once a second for those who come late."""

    def __init__(self, host: Host, repeat: Job) -> None:
        super().__init__(host)
        self._repeat = repeat

    def _run(self) -> None:
        while self._running:
            try:
                self._jobs.get(timeout=1.0)()
            except Empty:
                self._repeat()


class Realtime(Clock):
    """A tick at every period of the monotonic clock, by absolute deadlines.

    A tick that begins more than a period late is counted as missed, made up for at once, and the deadlines stay
    where they were: after a week it is still on time.

    Args:
        host: The controller to drive.
        period: Tick [s].
        speed: Of its time against the clock's [-].
    """

    def __init__(self, host: Host, period: float, speed: float = 1.0) -> None:
        super().__init__(host)
        self._period = period / speed
        self._late = np.zeros(4096)
        self._count = 0
        self._looked, self._looked_at = 0, time.monotonic()

    def _run(self) -> None:
        jobs, host, period = self._jobs, self.host, self._period
        deadline = time.monotonic()
        while self._running:
            deadline += period
            wait = deadline - time.monotonic()
            if wait > 0.0:
                time.sleep(wait)
            late = time.monotonic() - deadline
            self._late[self._count % len(self._late)] = late
            self._count += 1
            if late >= period:
                host.missed(1)
                if late > CATCH_UP * period:
                    left_out = int(late / period) - CATCH_UP
                    host.missed(left_out)
                    deadline += left_out * period
            while not jobs.empty():
                jobs.get()()
            host.tick()
        while not jobs.empty():
            jobs.get()()

    def punctuality(self) -> Punctuality | None:
        """Lateness since the last look."""
        count, now = self._count, time.monotonic()
        first = max(self._looked, count - len(self._late))
        late = self._late[np.arange(first, count) % len(self._late)] * 1e6
        seconds, ticks = now - self._looked_at, count - self._looked
        self._looked, self._looked_at = count, now
        if not len(late):
            return Punctuality(0, seconds, 0.0, 0.0, 0.0)
        p50, p99 = np.percentile(late, (50, 99))
        return Punctuality(ticks, seconds, float(p50), float(p99), float(late.max()))


def _nothing() -> None:
    pass
