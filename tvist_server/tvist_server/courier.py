"""Thread that hands on the messages waiting in publishers."""

import threading
from collections.abc import Sequence
from queue import SimpleQueue

from tvist_server.publisher import Publisher

CLOSE_WAIT = 0.2
"""Longest time to deliver the last messages at close [s]; a client that has stopped reading blocks them for 5 s."""


class Courier:
    """Makes publishers hand on their waiting messages whenever it is woken.

    Args:
        publishers: Publishers, one for each robot.
    """

    def __init__(self, publishers: Sequence[Publisher]) -> None:
        self._publishers = publishers
        self._running = True
        self._calls: SimpleQueue[None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="tvist-publisher", daemon=True)

    def start(self) -> None:
        """Start to hand on messages; wake-ups from before are not lost."""
        self._thread.start()

    def wake(self) -> None:
        """Have the waiting messages handed on, if there are any. May be called from any thread; does not block."""
        for publisher in self._publishers:
            if publisher.waiting:
                if self._calls.empty():  # otherwise a wake-up is pending
                    self._calls.put(None)
                return

    def close(self) -> None:
        """Hand on the messages still waiting, unless that takes longer than `CLOSE_WAIT`, and end the thread."""
        self._running = False
        self._calls.put(None)
        if self._thread.is_alive():
            self._thread.join(CLOSE_WAIT)

    @property
    def ended(self) -> bool:
        """Whether the thread has ended."""
        return not self._thread.is_alive()

    def _run(self) -> None:
        while self._running:
            self._calls.get()
            for publisher in self._publishers:
                publisher.hand_on()
