"""The way out of one robot: states, events and replies wait here, in their order, for the thread that hands them on.

The controller's thread only puts into a queue. Where the network is slow the queue grows to its bound; then states
are dropped and counted in real time, and the controller waits in lockstep, where every state counts.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence

from tvist_controller.sink import Sink, Topic
from tvist_protocol.codec import encode
from tvist_protocol.io import Io
from tvist_protocol.stream import Event, State, Telemetry, Truth
from tvist_server.gateways.base import Gateway, Message

log = logging.getLogger(__name__)

MAX_WAITING = 2048
"""Messages that may wait, four seconds of states."""
LEAD = 50
"""Messages that may wait in lockstep, a tenth of a second of states: the further a step runs ahead of what is told, the
later a client's answer to a state comes."""
PAUSE = 0.02
"""How long the controller waits at most, where it does, before it looks for room again [s]."""

TOPICS: Mapping[type[Message], Topic] = {
    State: "state",
    Event: "event",
    Truth: "truth",
    Telemetry: "telemetry",
    Io: "io",
}


class Publisher(Sink):
    """A sink that others empty.

    Args:
        lossless: Whether the controller waits rather than drop a state.
    """

    def __init__(self, *, lossless: bool) -> None:
        self._lossless = lossless
        self._gateways: Sequence[Gateway] = ()
        self._wake: Callable[[], None] = _nobody
        self._queue: deque[Message | Callable[[], None]] = deque()
        self._room = threading.Event()
        self.dropped = 0
        """Messages of a tick that found no room."""

    def open(self, gateways: Sequence[Gateway], wake: Callable[[], None] | None = None) -> None:
        """Say where messages go to.

        Args:
            gateways: They get everything.
            wake: Called with every message, where nobody looks by himself.
        """
        self._gateways = gateways
        self._wake = wake or _nobody

    def hurry(self) -> None:
        """Wait for nobody from now on: the robot is about to end, and a client may have stopped reading."""
        self._lossless = False
        self._room.set()  # whoever waits for room

    def hand_on(self) -> None:
        """Hand on what waits now; what comes meanwhile is the next round's, lest other robots wait for ever."""
        queue = self._queue
        for _ in range(len(queue)):
            item = queue.popleft()
            if self._lossless and len(queue) <= LEAD // 2:
                self._room.set()
            try:
                self._publish(item)
            except Exception:
                log.exception("could not hand on a message")

    def state(self, state: State) -> None:
        """Queue a state."""
        self._offer(state)

    def event(self, event: Event) -> None:
        """Queue an event."""
        self._put(event)

    def truth(self, truth: Truth) -> None:
        """Queue what no robot can know."""
        self._offer(truth)

    def io(self, io: Io) -> None:
        """Queue inputs, outputs and registers."""
        self._offer(io)

    def telemetry(self, telemetry: Telemetry, io: Io) -> None:
        """Queue the server's own figures, and tell the present inputs, outputs and registers again."""
        self._put(io)
        self._put(telemetry)

    def answer(self, call: Callable[[], None]) -> None:
        """Queue a call that answers a client, behind the states that came before it."""
        self._put(call)

    def repeat(self, state: State, io: Io) -> None:
        """Tell the present state, inputs, outputs and registers again, for those who come late."""
        self._put(io)
        self._put(state)

    def _offer(self, message: State | Truth | Io) -> None:
        """Queue a message of every tick, where there is room."""
        if self._lossless and len(self._queue) >= LEAD:
            self._wait_for_room()
        if len(self._queue) < MAX_WAITING:
            self._put(message)
        else:
            self.dropped += 1

    def _wait_for_room(self) -> None:
        """Wait until half of the room is free: to be woken for each message would cost more than the message."""
        while self._lossless and len(self._queue) > LEAD // 2:
            self._room.clear()
            self._room.wait(PAUSE)

    def _put(self, item: Message | Callable[[], None]) -> None:
        self._queue.append(item)
        self._wake()

    def _publish(self, item: Message | Callable[[], None]) -> None:
        if not isinstance(item, Message):
            item()
            return
        topic, data = TOPICS[type(item)], encode(item)
        for gateway in self._gateways:
            gateway.publish(topic, item, data)


def _nobody() -> None:
    pass
