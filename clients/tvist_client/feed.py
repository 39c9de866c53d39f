"""One topic of a robot: decoded once, handed to everybody here who listens."""

import asyncio
import logging
import weakref
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from tvist_client.errors import AnswerTimeoutError, ClientError, NotConnectedError
from tvist_client.stream import Stream
from tvist_client.transports.base import Topic, Transport
from tvist_protocol.errors import ProtocolError

log = logging.getLogger(__name__)


class Ticked(Protocol):
    """A message that says of which tick it is."""

    @property
    def tick(self) -> int:
        """Number of the control period."""


M = TypeVar("M", bound=Ticked)


class Feed(Generic[M]):
    """Messages of one topic. Subscribes when somebody first listens.

    Args:
        transport: Transport that delivers the messages.
        topic: Topic to subscribe to.
        decode: Bytes to message.
        once_a_tick: Whether there is one a tick; then what is not newer than the last one is a repetition.
    """

    def __init__(
        self, transport: Transport, topic: Topic, decode: Callable[[bytes], M], *, once_a_tick: bool
    ) -> None:
        self.latest: M | None = None
        """Newest message since somebody listens."""
        self.malformed = 0
        """Messages left out since they are none of this protocol."""
        self._transport = transport
        self._topic: Topic = topic
        self._decode = decode
        self._once_a_tick = once_a_tick
        self._subscribed = False
        self._finished = False
        self._listeners: list[Callable[[M], object]] = []
        self._streams: weakref.WeakSet[Stream[M]] = weakref.WeakSet()
        self._waiting: dict[asyncio.Future[M], Callable[[M], bool]] = {}

    def subscribe(self) -> None:
        """Begin to listen; from then on `latest` is kept.

        Raises:
            NotConnectedError: The connection is closed.
        """
        if self._finished:
            raise NotConnectedError("the connection is closed: open another one")
        if not self._subscribed:
            self._transport.subscribe(self._topic, self._on_message)
            self._subscribed = True

    def listen(self, callback: Callable[[M], object]) -> Callable[[], None]:
        """Have every message handed to a callback; the function returned ends that."""
        self.subscribe()
        self._listeners.append(callback)
        return lambda: self._listeners.remove(callback)

    def stream(self, size: int) -> Stream[M]:
        """Every message from now on; forgotten when nobody holds it any more."""
        self.subscribe()
        stream: Stream[M] = Stream(size)
        self._streams.add(stream)
        return stream

    async def next(self, wanted: Callable[[M], bool], timeout_s: float) -> M:
        """The next message that is wanted.

        Raises:
            AnswerTimeoutError: None came in time.
            NotConnectedError: The robot went away.
        """
        self.subscribe()
        message: asyncio.Future[M] = asyncio.get_running_loop().create_future()
        self._waiting[message] = wanted
        try:
            async with asyncio.timeout(timeout_s):
                return await message
        except TimeoutError:
            why = f"no {self._topic} came within {timeout_s:g} s: the robot does not tick, or the connection is broken"
            raise AnswerTimeoutError(why) from None
        finally:
            self._waiting.pop(message, None)

    def fail(self, error: ClientError) -> None:
        """Tell everybody that the robot went away; one that comes back may count its ticks anew."""
        self.latest = None
        for stream in tuple(self._streams):
            stream.fail(error)
        for message in tuple(self._waiting):
            if not message.done():
                message.set_exception(error)

    def finish(self) -> None:
        """The connection was closed: end every stream, and tell whoever waits."""
        self._finished = True
        self.latest = None
        for stream in tuple(self._streams):
            stream.finish()
        for message in tuple(self._waiting):
            if not message.done():
                message.set_exception(NotConnectedError("the connection was closed"))

    def _on_message(self, data: bytes) -> None:
        try:
            message = self._decode(data)
        except ProtocolError as error:
            if not self.malformed:
                log.warning("an invalid %s: %s", self._topic, error)
            self.malformed += 1
            return
        if self._once_a_tick and self.latest is not None and message.tick <= self.latest.tick:
            return
        self.latest = message
        for listener in tuple(self._listeners):
            self._call(listener, message)
        # Asked first, since going through an empty weak set takes longer than decoding a state.
        if self._streams:
            for stream in tuple(self._streams):
                stream.push(message)
        for waiting, wanted in tuple(self._waiting.items()):
            if not waiting.done() and wanted(message):
                waiting.set_result(message)

    def _call(self, listener: Callable[[M], object], message: M) -> None:
        """A listener's error is its own: it stops neither the robot nor the others."""
        try:
            listener(message)
        except Exception as error:  # noqa: BLE001  anything may go wrong in what a user wrote
            asyncio.get_running_loop().call_exception_handler(
                {"message": f"a callback for {self._topic} raised", "exception": error}
            )
