"""Jobs for the thread that owns a controller."""

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import NamedTuple

Do = Callable[[], object]


class _Job(NamedTuple):
    do: Do
    client: str | None


class Jobs:
    """Jobs in order of arrival. During a client's step, others' run between ticks, its own after the step."""

    def __init__(self) -> None:
        self._new: SimpleQueue[_Job] = SimpleQueue()
        self._behind: deque[_Job] = deque()  # jobs that wait for the end of a step; they precede all new ones

    def post(self, do: Do, client: str | None = None) -> None:
        """Add a job, from any thread, without blocking; `client` sent it, if known."""
        self._new.put(_Job(do, client))

    def do_waiting(self) -> None:
        """Do the jobs that wait now; later ones wait for the next call, so that a flood cannot delay a tick."""
        for _ in range(self._new.qsize()):
            self._new.get().do()

    def do_next(self, timeout: float) -> bool:
        """Do the next job; return False if none arrives within `timeout` [s]."""
        if self._behind:
            self._behind.popleft().do()
            return True
        try:
            job = self._new.get(timeout=timeout)
        except Empty:
            return False
        job.do()
        return True

    def do_others(self, stepper: str | None) -> None:
        """Between ticks of a step, do other clients' waiting jobs; set aside those of the stepping client."""
        for _ in range(self._new.qsize()):
            self._do_other(self._new.get(), stepper)

    def do_next_other(self, stepper: str | None, timeout: float) -> None:
        """Like `do_others` for one job; wait for it up to `timeout` [s]."""
        with suppress(Empty):
            self._do_other(self._new.get(timeout=timeout), stepper)

    def _do_other(self, job: _Job, stepper: str | None) -> None:
        if job.client is not None and job.client == stepper:
            self._behind.append(job)
        else:
            job.do()
