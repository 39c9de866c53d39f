"""What a robot publishes, as its clients receive it: states, events, truth, telemetry, inputs and outputs."""

from collections.abc import Callable

from tvist_client.feed import Feed
from tvist_client.stream import Stream
from tvist_client.transports.base import Transport
from tvist_protocol.codec import decode_event, decode_io, decode_state, decode_telemetry, decode_truth
from tvist_protocol.io import Io
from tvist_protocol.stream import Event, State, Telemetry, Truth

BUFFER = 5000
"""Number of messages that an iterator buffers: 10 s of states."""
STATE_S = 5.0
"""Longest pause between two states [s]; in lockstep the last one is repeated every second."""


class Published:
    """The part of `Robot` that receives messages.

    Args:
        transport: Transport that delivers them.
    """

    def __init__(self, transport: Transport) -> None:
        self._states: Feed[State] = Feed(transport, "state", decode_state, once_a_tick=True)
        self._events: Feed[Event] = Feed(transport, "event", decode_event, once_a_tick=False)
        self._truths: Feed[Truth] = Feed(transport, "truth", decode_truth, once_a_tick=True)
        self._telemetries: Feed[Telemetry] = Feed(transport, "telemetry", decode_telemetry, once_a_tick=False)
        self._ios: Feed[Io] = Feed(transport, "io", decode_io, once_a_tick=False)
        self._feeds = (self._states, self._events, self._truths, self._telemetries, self._ios)

    def states(self, buffer: int = BUFFER) -> Stream[State]:
        """Iterate over every state from now on, one per tick. If the reader is slow, the oldest are dropped.

        Args:
            buffer: Number of messages that may wait; those dropped are counted in `Stream.dropped`.
        """
        return self._states.stream(buffer)

    def events(self, buffer: int = BUFFER) -> Stream[Event]:
        """Iterate over every event from now on."""
        return self._events.stream(buffer)

    def on_state(self, callback: Callable[[State], object]) -> Callable[[], None]:
        """Call a function, which must not block, with every state; the function returned ends that."""
        return self._states.listen(callback)

    def on_event(self, callback: Callable[[Event], object]) -> Callable[[], None]:
        """Call a function with every event; see `on_state`."""
        return self._events.listen(callback)

    def on_truth(self, callback: Callable[[Truth], object]) -> Callable[[], None]:
        """Call a function with every truth message, if the server publishes them; see `on_state`."""
        return self._truths.listen(callback)

    def on_telemetry(self, callback: Callable[[Telemetry], object]) -> Callable[[], None]:
        """Call a function with every telemetry message, once a second; see `on_state`."""
        return self._telemetries.listen(callback)

    def on_io(self, callback: Callable[[Io], object]) -> Callable[[], None]:
        """Call a function with every message about inputs, outputs, registers and tool; see `on_state`."""
        return self._ios.listen(callback)

    async def io(self) -> Io:
        """Return inputs, outputs, registers and tool: the latest known values, else the next ones within about 1 s.

        Raises:
            AnswerTimeoutError: No message arrived within `STATE_S`.
        """
        self._ios.subscribe()
        return self._ios.latest or await self._ios.next(lambda _: True, STATE_S)

    async def _next_state(self) -> State:
        return await self._states.next(lambda _: True, STATE_S)
