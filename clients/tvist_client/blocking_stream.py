"""Messages for a program without `await`."""

from collections.abc import Iterator
from typing import Generic, TypeVar

from tvist_client import stream as asynchronous_stream
from tvist_client.portal import Portal

M = TypeVar("M")


class Stream(Iterator[M], Generic[M]):
    """Messages as an iterator; see `tvist_client.stream.Stream`."""

    def __init__(self, portal: Portal, stream: asynchronous_stream.Stream[M]) -> None:
        self._portal = portal
        self._stream = stream

    @property
    def dropped(self) -> int:
        """Number of messages that were dropped because the reader was too slow."""
        return self._stream.dropped

    def __next__(self) -> M:
        try:
            return self._portal.call(self._stream.__anext__)
        except StopAsyncIteration:
            raise StopIteration from None
