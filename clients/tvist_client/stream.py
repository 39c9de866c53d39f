"""Messages as an asynchronous iterator with a limited buffer."""

import asyncio
from collections import deque
from collections.abc import AsyncIterator
from typing import Generic, TypeVar

from tvist_client.errors import ClientError

M = TypeVar("M")


class Stream(AsyncIterator[M], Generic[M]):
    """Messages in order, from the creation of this iterator on.

    If the reader is slower than the robot, the oldest messages are dropped and counted, so that messages are never
    older than the buffer. The iterator ends when the robot's connection is closed.

    Args:
        size: Number of messages that may wait.
    """

    def __init__(self, size: int) -> None:
        self.dropped = 0
        """Number of messages that were dropped because the reader was too slow."""
        self._waiting: deque[M] = deque(maxlen=size)
        self._news = asyncio.Event()
        self._error: ClientError | None = None
        self._finished = False

    @property
    def ready(self) -> bool:
        """True if the next message, or the end, is there already."""
        return bool(self._waiting) or self._finished or self._error is not None

    def push(self, message: M) -> None:
        """Add a message; if the buffer is full, the oldest is dropped and counted."""
        if len(self._waiting) == self._waiting.maxlen:
            self.dropped += 1
        self._waiting.append(message)
        self._news.set()

    def fail(self, error: ClientError) -> None:
        """Raise an error in the reader, once, after the waiting messages."""
        self._error = error
        self._news.set()

    def finish(self) -> None:
        """End after the waiting messages."""
        self._finished = True
        self._news.set()

    async def __anext__(self) -> M:
        while not self._waiting:
            if self._error is not None:
                error, self._error = self._error, None
                raise error
            if self._finished:
                raise StopAsyncIteration
            self._news.clear()
            await self._news.wait()
        return self._waiting.popleft()
