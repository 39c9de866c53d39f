"""Passes messages from the network's threads to the event loop."""

import asyncio
import logging
from collections import deque
from collections.abc import Callable

log = logging.getLogger(__name__)

Callback = Callable[[bytes], None]

MAX_WAITING = 10_000  # number of messages that may wait while the loop is busy: 20 s of states, about 10 MB


class Inbox:
    """One queue of all topics' messages to callbacks on the loop: a tick's events must precede its state."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.dropped = 0
        """Number of messages dropped for lack of room."""
        self._loop = loop
        self._waiting: deque[tuple[Callback, bytes]] = deque()
        self._woken = False

    def put(self, callback: Callback, data: bytes, *, droppable: bool) -> None:
        """Add a message, from any thread; a full queue drops it if `droppable` (states, not events)."""
        if droppable and len(self._waiting) >= MAX_WAITING:
            if not self.dropped:
                log.warning("the event loop has been busy for too long: messages are being dropped")
            self.dropped += 1
            return
        self._waiting.append((callback, data))
        # Two threads may both wake the loop. At least one does: the flag is cleared before the queue is emptied.
        if not self._woken:
            self._woken = True
            wake(self._loop, self._deliver)

    def _deliver(self) -> None:
        self._woken = False
        for _ in range(len(self._waiting)):
            callback, data = self._waiting.popleft()
            callback(data)


def wake(loop: asyncio.AbstractEventLoop, callback: Callable[[], None]) -> None:
    """Run a callback on the loop, from any thread; do nothing if the loop is closed."""
    try:
        loop.call_soon_threadsafe(callback)
    except RuntimeError:
        if not loop.is_closed():
            raise
