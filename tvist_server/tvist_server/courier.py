"""The thread that hands on what waits in publishers."""

import threading
from collections.abc import Callable, Sequence
from queue import SimpleQueue

CLOSE_WAIT = 0.2
"""How long the last messages may take at close [s]; a client that has stopped reading holds them up for 5 s."""


class Courier:
    """Has robots hand on what waits whenever it is woken.

    Args:
        hand_on: Hands on what waits of one robot; one for each.
    """

    def __init__(self, hand_on: Sequence[Callable[[], None]]) -> None:
        self._hand_on = hand_on
        self._running = True
        self._calls: SimpleQueue[None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="tvist-publisher", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def wake(self) -> None:
        """Hand on what waits. From any thread; never waits."""
        if self._calls.empty():  # otherwise it is being woken
            self._calls.put(None)

    def close(self) -> None:
        """Hand on what is waiting, as far as that is quick, and end."""
        self._running = False
        self._calls.put(None)
        if self._thread.is_alive():
            self._thread.join(CLOSE_WAIT)

    @property
    def ended(self) -> bool:
        """Whether nothing is handed on any more."""
        return not self._thread.is_alive()

    def _run(self) -> None:
        while self._running:
            self._calls.get()
            for hand_on in self._hand_on:
                hand_on()
