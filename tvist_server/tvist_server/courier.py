"""The thread that hands on what waits in outlets."""

import threading
from collections.abc import Sequence
from queue import SimpleQueue

from tvist_server.outlet import Outlet

CLOSE_WAIT = 0.2
"""How long the last messages may take at close [s]; a client that has stopped reading holds them up for 5 s."""


class Courier:
    """Empties outlets whenever it is woken.

    Args:
        outlets: Of one robot or several.
    """

    def __init__(self, outlets: Sequence[Outlet]) -> None:
        self._outlets = outlets
        self._running = True
        self._calls: SimpleQueue[None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="tvist-outlet", daemon=True)

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
            for outlet in self._outlets:
                outlet.hand_on()
