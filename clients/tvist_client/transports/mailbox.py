"""Mailbox that passes messages from the network's threads to the event loop."""

import asyncio
import logging
from collections import deque
from collections.abc import Callable

log = logging.getLogger(__name__)

Callback = Callable[[bytes], None]

MAX_WAITING = 10_000
"""Messages that may wait while the loop does something else: 20 s of states, about 10 MB."""


class Mailbox:
    """Hands messages to callbacks on the loop, in the order in which they came.

    One mailbox for all topics, since their order counts: events of a tick come before its state. The loop is
    woken once for all that has come, not once a message.

    Args:
        loop: The event loop.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.dropped = 0
        """Messages that found no room."""
        self._loop = loop
        self._waiting: deque[tuple[Callback, bytes]] = deque()
        self._woken = False

    def put(self, callback: Callback, data: bytes, *, droppable: bool) -> None:
        """Take a message. From any thread; never waits.

        Args:
            callback: Called with the message on the loop.
            data: The message.
            droppable: Whether it may be dropped where there is no room: a state may, an event may not.
        """
        if droppable and len(self._waiting) >= MAX_WAITING:
            if not self.dropped:
                log.warning("the event loop has been busy for too long: messages are being dropped")
            self.dropped += 1
            return
        self._waiting.append((callback, data))
        # Two threads may both wake the loop, which does no harm; that neither does is impossible, since the
        # flag is taken down before the queue is emptied.
        if not self._woken:
            self._woken = True
            wake(self._loop, self._deliver)

    def _deliver(self) -> None:
        self._woken = False
        for _ in range(len(self._waiting)):
            callback, data = self._waiting.popleft()
            callback(data)


def wake(loop: asyncio.AbstractEventLoop, callback: Callable[[], None]) -> None:
    """Run a callback on the loop, from any thread; nowhere once the loop is closed."""
    try:
        loop.call_soon_threadsafe(callback)
    except RuntimeError:
        if not loop.is_closed():
            raise
