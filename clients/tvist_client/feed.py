"""One topic of a robot, decoded once and distributed to all listeners in this process."""

import asyncio
import logging
import weakref
from collections import deque
from collections.abc import AsyncIterator, Callable
from typing import Generic, TypeVar

from tvist_client.errors import AnswerTimeoutError, ArgumentError, ClientError, NotConnectedError
from tvist_client.transports.base import Topic, Transport
from tvist_client.values import whole
from tvist_protocol import Event, Io, State, Telemetry, Truth
from tvist_protocol.codec import decode
from tvist_protocol.errors import ProtocolError, quoted

log = logging.getLogger(__name__)


M = TypeVar("M", bound=State | Event | Truth | Telemetry | Io)
Item = TypeVar("Item")


class Stream(AsyncIterator[Item], Generic[Item]):
    """Messages in order, from the creation of this iterator on.

    If the reader is slower than the robot, the oldest messages are dropped and counted, so that no message is
    older than the buffer. The iterator ends when the robot's connection is closed.
    """

    def __init__(self, size: int) -> None:
        self.dropped = 0
        """Number of messages dropped because the reader was too slow."""
        self._waiting: deque[Item] = deque(maxlen=size)
        self._news = asyncio.Event()
        self._error: ClientError | None = None
        self._finished = False

    @property
    def ready(self) -> bool:
        """Whether reading the iterator would not wait: a message or the end is already there."""
        return bool(self._waiting) or self._finished or self._error is not None

    def push(self, message: Item) -> None:
        """Add a message; if the buffer is full, drop and count the oldest."""
        if len(self._waiting) == self._waiting.maxlen:
            self.dropped += 1
        self._waiting.append(message)
        self._news.set()

    def end(self, error: ClientError | None) -> None:
        """Let the reader get waiting messages, then raise `error` once, or end iteration if it is None."""
        self._error, self._finished = error or self._error, error is None
        self._news.set()

    async def __anext__(self) -> Item:
        while not self._waiting:
            if self._error is not None:
                error, self._error = self._error, None
                raise error
            if self._finished:
                raise StopAsyncIteration
            self._news.clear()
            await self._news.wait()
        return self._waiting.popleft()


class Feed(Generic[M]):
    """Messages of a topic. The first listener subscribes. With `once_a_tick`, repeated ticks are dropped."""

    def __init__(self, transport: Transport, topic: Topic, kind: type[M], *, once_a_tick: bool) -> None:
        self.latest: M | None = None
        """Newest message since the subscription; None before the first."""
        self.malformed = 0
        """Number of messages dropped because they do not follow this protocol."""
        self._transport, self._kind, self._once_a_tick = transport, kind, once_a_tick
        self._topic: Topic = topic
        self._subscribed = self._finished = False
        self._listeners: list[Callable[[M], object]] = []
        self._streams: weakref.WeakSet[Stream[M]] = weakref.WeakSet()
        self._waiting: dict[asyncio.Future[M], Callable[[M], bool]] = {}

    def subscribe(self) -> None:
        """Subscribe to the topic; from then on `latest` is updated."""
        if self._finished:
            raise NotConnectedError("the connection is closed: open another one")
        if not self._subscribed:
            self._transport.subscribe(self._topic, self._on_message)
            self._subscribed = True

    def listen(self, callback: Callable[[M], object]) -> Callable[[], None]:
        """Call a function with every message; the returned function ends this."""
        if not callable(callback):
            raise ArgumentError(
                "callback", f"callback is {quoted(callback)}: must be a function of one {self._topic} message"
            )
        self.subscribe()
        self._listeners.append(callback)
        return lambda: self._listeners.remove(callback)

    def stream(self, buffer: int) -> Stream[M]:
        """Return an iterator over all messages from now on; the feed only keeps a weak reference to it."""
        stream = Stream[M](whole(buffer, "buffer", 1))
        self.subscribe()
        self._streams.add(stream)
        return stream

    async def next(self, wanted: Callable[[M], bool], timeout_s: float) -> M:
        """Return the next message that satisfies a condition."""
        self.subscribe()
        message: asyncio.Future[M] = asyncio.get_running_loop().create_future()
        self._waiting[message] = wanted
        try:
            async with asyncio.timeout(timeout_s):
                return await message
        except TimeoutError:
            raise AnswerTimeoutError(
                f"no {self._topic} came within {timeout_s:g} s: check the robot with tvist check"
            ) from None
        finally:
            self._waiting.pop(message, None)

    def end(self, error: ClientError, *, closed: bool = False) -> None:
        """Raise `error` in waits and streams; if `closed`, streams just end. Later ticks may start again."""
        self._finished = closed
        self.latest = None
        for stream in tuple(self._streams):
            stream.end(None if closed else error)
        for message in tuple(self._waiting):
            if not message.done():
                message.set_exception(error)

    def _on_message(self, data: bytes) -> None:
        try:
            message = decode(self._kind, data)
        except ProtocolError as error:
            if not self.malformed:
                log.warning("an invalid %s: %s", self._topic, error)
            self.malformed += 1
            return
        if self._once_a_tick and self.latest is not None and message.tick <= self.latest.tick:
            return
        self.latest = message
        for listener in tuple(self._listeners):
            try:
                listener(message)
            except Exception as error:  # noqa: BLE001  a user's function may raise anything
                asyncio.get_running_loop().call_exception_handler(
                    {"message": f"a callback for {self._topic} raised", "exception": error}
                )
        # Checked first, because iterating over an empty weak set takes longer than decoding a state.
        if self._streams:
            for stream in tuple(self._streams):
                stream.push(message)
        for waiting, wanted in tuple(self._waiting.items()):
            if not waiting.done() and wanted(message):
                waiting.set_result(message)
