"""Output queue of one robot: states, events and replies wait here, in order, for the thread that hands them on.

The controller's thread only appends to the queue. If the network is slow, the queue grows to its limit. Then states
are dropped and counted in real time; in lockstep, where no state may be lost, the controller waits. What no gateway
takes is not queued, so that it need not be made.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence

from tvist_controller.instruments.report import Report, Sink, Topic
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

Announced = Event | Truth | Telemetry | Io
TOPICS: Mapping[type[Report | Message], Topic] = {
    Report: "state",
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
        self.waiting: deque[Report | Announced | Callable[[], None]] = deque()
        """Messages and answers that wait to be handed on."""
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
        waiting = self.waiting
        for _ in range(len(waiting)):
            item = waiting.popleft()
            if self._lossless and len(waiting) <= LEAD // 2:
                self._room.set()
            try:
                self._publish(item)
            except Exception:
                log.exception("could not hand on a message")

    def report(self, report: Report) -> None:
        """Queue a tick's state."""
        self._offer(report)

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

    def repeat(self, report: Report, io: Io) -> None:
        """Publish the present state, inputs, outputs and registers again, for new clients."""
        self._put(io)
        self._put(report)

    def _offer(self, message: Report | Truth | Io) -> None:
        """Queue a message of a tick, if somebody takes it and there is room."""
        topic = TOPICS[type(message)]
        for gateway in self._gateways:
            if topic in gateway.takes:
                break
        else:
            return
        if self._lossless and len(self.waiting) >= LEAD:
            self._wait_for_room()
        if len(self.waiting) < MAX_WAITING:
            self._put(message)
        else:
            self.dropped += 1

    def _wait_for_room(self) -> None:
        """Wait until half of the room is free: waking up for each message would cost more than the message."""
        while self._lossless and len(self.waiting) > LEAD // 2:
            self._room.clear()
            self._room.wait(PAUSE)

    def _put(self, item: Report | Announced | Callable[[], None]) -> None:
        self.waiting.append(item)
        self._wake()

    def _publish(self, item: Report | Announced | Callable[[], None]) -> None:
        if isinstance(item, Report):
            for gateway in self._gateways:
                if "state" in gateway.takes:
                    gateway.report(item)
        elif isinstance(item, Announced):
            topic = TOPICS[type(item)]
            takers = [gateway for gateway in self._gateways if topic in gateway.takes]
            # Encoded once for all gateways, and here rather than in the tick thread, whose time is short (decision 14).
            data = encode(item) if takers else b""
            for gateway in takers:
                gateway.publish(topic, item, data)
        else:
            item()


def _nobody() -> None:
    pass
