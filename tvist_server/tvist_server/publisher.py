"""Output queue of one robot: states, events and replies wait here, in order, for the thread that hands them on.

The controller's thread only appends to the queue. If the network is slow, the queue grows to its limit. Then states
are dropped and counted in real time; in lockstep, where no state may be lost, the controller waits.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence

from tvist_controller.reporting.sink import Sink, Topic
from tvist_protocol.codec import encode
from tvist_protocol.io import Io
from tvist_protocol.stream import Event, State, Telemetry, Truth
from tvist_server.gateways.base import Gateway, Message

log = logging.getLogger(__name__)

MAX_WAITING = 2048
"""Number of messages that may wait: four seconds of states."""
LEAD = 50
"""Number of messages that may wait in lockstep: a tenth of a second of states. The further a step runs ahead of the
published states, the later a client's reaction to a state arrives.
"""
PAUSE = 0.02
"""Longest wait of the controller between two checks for room [s]."""

TOPICS: Mapping[type[Message], Topic] = {
    State: "state",
    Event: "event",
    Truth: "truth",
    Telemetry: "telemetry",
    Io: "io",
}


class Publisher(Sink):
    """A sink that another thread empties.

    Args:
        lossless: Whether the controller waits instead of dropping a state.
    """

    def __init__(self, *, lossless: bool) -> None:
        self._lossless = lossless
        self._gateways: Sequence[Gateway] = ()
        self._wake: Callable[[], None] = _nobody
        self._queue: deque[Message | Callable[[], None]] = deque()
        self._room = threading.Event()
        self.dropped = 0
        """Number of messages of a tick that were dropped for lack of room."""

    def want_truth(self, wanted: bool) -> None:
        """Note whether somebody subscribes to what a real robot cannot measure; from any thread."""
        self.wants_truth = wanted

    def open(self, gateways: Sequence[Gateway], wake: Callable[[], None] | None = None) -> None:
        """Set the gateways that messages go to.

        Args:
            gateways: Gateways; each gets every message.
            wake: Called for every message, if no thread checks the queue regularly.
        """
        self._gateways = gateways
        self._wake = wake or _nobody

    def hurry(self) -> None:
        """Stop waiting for room: the robot is about to end, and a client may have stopped reading."""
        self._lossless = False
        self._room.set()  # releases a thread that waits for room

    def hand_on(self) -> None:
        """Hand on the messages waiting now; later ones wait for the next call, so that other robots get their turn."""
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
        self._offer(state)

    def event(self, event: Event) -> None:
        self._put(event)

    def truth(self, truth: Truth) -> None:
        self._offer(truth)

    def io(self, io: Io) -> None:
        self._offer(io)

    def telemetry(self, telemetry: Telemetry, io: Io) -> None:
        """Queue the server's own figures, and publish the present inputs, outputs and registers again."""
        self._put(io)
        self._put(telemetry)

    def answer(self, call: Callable[[], None]) -> None:
        """Queue a call that answers a client, behind the states that precede it."""
        self._put(call)

    def repeat(self, state: State, io: Io) -> None:
        """Publish the present state, inputs, outputs and registers again, for new clients."""
        self._put(io)
        self._put(state)

    def _offer(self, message: State | Truth | Io) -> None:
        """Queue a message of a tick, if there is room."""
        if self._lossless and len(self._queue) >= LEAD:
            self._wait_for_room()
        if len(self._queue) < MAX_WAITING:
            self._put(message)
        else:
            self.dropped += 1

    def _wait_for_room(self) -> None:
        """Wait until half of the room is free: waking up for each message would cost more than the message."""
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
        # Encoded once for all gateways, and here rather than in the tick thread, whose time is short (decision 14).
        topic, data = TOPICS[type(item)], encode(item)
        for gateway in self._gateways:
            gateway.publish(topic, item, data)


def _nobody() -> None:
    pass
