"""Messages as an asynchronous iterator, with a buffer that has an end."""

import asyncio
from collections import deque
from collections.abc import AsyncIterator
from typing import Generic, TypeVar

from tvist_client.errors import ClientError

M = TypeVar("M")


class Stream(AsyncIterator[M], Generic[M]):
    """Messages from the moment this was made, in order.

    Where the reader is slower than the robot the oldest are dropped and counted, so that what is read is
    never older than the buffer. It ends when the robot's connection is closed.

    Args:
        size: Number of messages that may wait.
    """

    def __init__(self, size: int) -> None:
        self.dropped = 0
        """Messages the reader was too slow for."""
        self._waiting: deque[M] = deque(maxlen=size)
        self._news = asyncio.Event()
        self._error: ClientError | None = None
        self._finished = False

    def push(self, message: M) -> None:
        """Add a message."""
        if len(self._waiting) == self._waiting.maxlen:
            self.dropped += 1
        self._waiting.append(message)
        self._news.set()

    def fail(self, error: ClientError) -> None:
        """Raise an error at the reader, once, behind the messages that wait."""
        self._error = error
        self._news.set()

    def finish(self) -> None:
        """End behind the messages that wait."""
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
