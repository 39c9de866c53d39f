"""Thread that hands on the messages waiting in publishers."""

import threading
from collections.abc import Callable, Sequence
from queue import SimpleQueue

CLOSE_WAIT = 0.2
"""Longest time to deliver the last messages at close [s]; a client that has stopped reading blocks them for 5 s."""


class Courier:
    """Makes robots hand on their waiting messages whenever it is woken.

    Args:
        hand_on: Functions that hand on the waiting messages, one for each robot.
    """

    def __init__(self, hand_on: Sequence[Callable[[], None]]) -> None:
        self._hand_on = hand_on
        self._running = True
        self._calls: SimpleQueue[None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="tvist-publisher", daemon=True)

    def start(self) -> None:
        """Start to hand on messages; wake-ups from before are not lost."""
        self._thread.start()

    def wake(self) -> None:
        """Have the waiting messages handed on. May be called from any thread; does not block."""
        if self._calls.empty():  # otherwise a wake-up is pending
            self._calls.put(None)

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
            for hand_on in self._hand_on:
                hand_on()
