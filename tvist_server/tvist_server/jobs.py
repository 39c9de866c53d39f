"""What waits to be done by the thread that owns a controller."""

from collections import deque
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import NamedTuple

Do = Callable[[], None]


class _Job(NamedTuple):
    do: Do
    client: str | None


class Jobs:
    """Jobs in the order in which they came.

    One of them may be a client's step, which takes long. What other clients send meanwhile is done within it, between
    two ticks; what the stepping client sends waits until its step has ended, so that its own commands keep their order.
    """

    def __init__(self) -> None:
        self._new: SimpleQueue[_Job] = SimpleQueue()
        self._behind: deque[_Job] = deque()
        """What waits for the end of a step; it came before all that is new."""

    def post(self, do: Do, client: str | None = None) -> None:
        """Add a job. From any thread; never waits.

        Args:
            do: What is to be done.
            client: Client that sent it; None if it is unknown or there is none.
        """
        self._new.put(_Job(do, client))

    def do_waiting(self) -> None:
        """Do what waits now; what comes meanwhile waits for the next time, lest a flood hold up a tick."""
        for _ in range(self._new.qsize()):
            self._new.get().do()

    def do_next(self, timeout: float) -> bool:
        """Do the next job; False where none came in time.

        Args:
            timeout: How long to wait for it [s].
        """
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
        """Within a client's step, do what others wait for, and put aside what that client has sent.

        Args:
            stepper: The client.
        """
        for _ in range(self._new.qsize()):
            job = self._new.get()
            if job.client is not None and job.client == stepper:
                self._behind.append(job)
            else:
                job.do()
