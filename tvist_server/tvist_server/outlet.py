"""The way out of one robot: states, events and replies wait here, in their order, for the thread that hands them on.

The controller's thread only puts into a queue. Where the network is slow the queue grows to its bound; then states
are dropped and counted in real time, and the controller waits in lockstep, where every state counts.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from tvist_protocol.codec import encode
from tvist_protocol.io import Io
from tvist_protocol.journal import Entry
from tvist_protocol.stream import Event, State, Telemetry, Truth
from tvist_server.gateways.base import Gateway, Message, Reply, Topic

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


class Recorder(Protocol):
    """What a recorder offers."""

    def state(self, state: State) -> None:
        """Record a state."""

    def event(self, event: Event) -> None:
        """Record an event."""

    def truth(self, truth: Truth) -> None:
        """Record what no robot can know."""

    def journal(self, entry: Entry) -> None:
        """Record what reached the controller."""


class Outlet:
    """A `host.Sink` that others empty.

    Args:
        recorder: Records everything, where there is one.
        lossless: Whether the controller waits rather than drop a state.
    """

    def __init__(self, recorder: Recorder | None, *, lossless: bool) -> None:
        self._recorder = recorder
        self._lossless = lossless
        self._gateways: Sequence[Gateway] = ()
        self._wake: Callable[[], None] = _nobody
        self._queue: deque[Message | tuple[Reply, bytes]] = deque()
        self._room = threading.Event()
        self._io: Io | None = None
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
        """Queue a state; the recorder's own queue takes it at once."""
        if self._recorder is not None:
            self._recorder.state(state)
        self._offer(state)

    def event(self, event: Event) -> None:
        """Queue an event."""
        if self._recorder is not None:
            self._recorder.event(event)
        self._put(event)

    def truth(self, truth: Truth) -> None:
        """Queue what no robot can know."""
        if self._recorder is not None:
            self._recorder.truth(truth)
        self._offer(truth)

    def io(self, io: Io) -> None:
        """Queue inputs, outputs and registers."""
        self._io = io
        self._offer(io)

    def journal(self, entry: Entry) -> None:
        """Record what reached the controller."""
        if self._recorder is not None:
            self._recorder.journal(entry)

    def telemetry(self, telemetry: Telemetry) -> None:
        """Queue the server's own figures, and tell inputs, outputs and registers again."""
        if self._io is not None:
            self._put(self._io)
        self._put(telemetry)

    def reply(self, reply: Reply, data: bytes) -> None:
        """Queue a reply, behind the states that came before it."""
        self._put((reply, data))

    def repeat(self, state: State, io: Io) -> None:
        """Tell the present state, inputs, outputs and registers again, for those who come late."""
        self._io = io
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

    def _put(self, item: Message | tuple[Reply, bytes]) -> None:
        self._queue.append(item)
        self._wake()

    def _publish(self, item: Message | tuple[Reply, bytes]) -> None:
        if isinstance(item, tuple):
            reply, data = item
            reply(data)
            return
        topic, data = TOPICS[type(item)], encode(item)
        for gateway in self._gateways:
            gateway.publish(topic, item, data)


def _nobody() -> None:
    pass
