"""The way out: one thread that hands states, events and replies to gateways and recorder, in their order.

The controller's thread only puts into a queue. Where the network is slow the queue grows to its bound; then states
are dropped and counted in real time, and the controller waits in lockstep, where every state counts.
"""

import logging
import threading
from collections.abc import Callable, Sequence
from queue import SimpleQueue
from typing import Protocol

from tvist_protocol.codec import encode
from tvist_protocol.journal import Entry
from tvist_protocol.stream import Event, State, Telemetry, Truth
from tvist_server.gateways.base import Gateway, Topic

log = logging.getLogger(__name__)

MAX_WAITING = 2048
"""Messages that may wait, four seconds of states."""


CLOSE_WAIT = 0.2
"""How long the last messages may take at close [s]; a client that has stopped reading holds them up for 5 s."""


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
    """A `host.Sink` with a thread behind it.

    Args:
        recorder: Records everything, where there is one.
        lossless: Whether the controller waits rather than drop a state.
    """

    def __init__(self, recorder: Recorder | None, *, lossless: bool) -> None:
        self._recorder = recorder
        self._lossless = lossless
        self._gateways: Sequence[Gateway] = ()
        self._queue: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._room = threading.Semaphore(MAX_WAITING)
        self._last: State | None = None
        self.dropped = 0
        """Messages of a tick that found no room."""
        self._thread = threading.Thread(target=self._run, name="tvist-outlet", daemon=True)

    def start(self, gateways: Sequence[Gateway]) -> None:
        """Begin to hand on."""
        self._gateways = gateways
        self._thread.start()

    def hurry(self) -> None:
        """Wait for nobody from now on: the robot is about to end, and a client may have stopped reading."""
        self._lossless = False
        self._room.release()  # whoever waits for room

    def close(self) -> None:
        """Hand on what is waiting, as far as that is quick, and end."""
        self._queue.put(None)
        if self._thread.is_alive():
            self._thread.join(CLOSE_WAIT)

    def state(self, state: State) -> None:
        """Queue a state; the recorder's own queue takes it at once."""
        self._last = state
        if self._recorder is not None:
            self._recorder.state(state)
        self._offer("state", state)

    def event(self, event: Event) -> None:
        """Queue an event."""
        if self._recorder is not None:
            self._recorder.event(event)
        self._queue.put(lambda: self._publish("event", event))

    def truth(self, truth: Truth) -> None:
        """Queue what no robot can know."""
        if self._recorder is not None:
            self._recorder.truth(truth)
        self._offer("truth", truth)

    def journal(self, entry: Entry) -> None:
        """Record what reached the controller."""
        if self._recorder is not None:
            self._recorder.journal(entry)

    def telemetry(self, telemetry: Telemetry) -> None:
        """Queue the server's own figures."""
        self._queue.put(lambda: self._publish("telemetry", telemetry))

    def reply(self, reply: Callable[[bytes], None], data: bytes) -> None:
        """Queue a reply, behind the states that came before it."""
        self._queue.put(lambda: reply(data))

    def repeat(self) -> None:
        """Tell the last state again, for those who come late."""
        if self._last is not None:
            state = self._last
            self._queue.put(lambda: self._publish("state", state))

    def _offer(self, topic: Topic, message: State | Truth) -> None:
        """Queue a message of every tick, where there is room."""
        if not self._room.acquire(blocking=self._lossless):
            self.dropped += 1
            return

        def hand_on() -> None:
            self._room.release()
            self._publish(topic, message)

        self._queue.put(hand_on)

    def _publish(self, topic: Topic, message: State | Event | Truth | Telemetry) -> None:
        data = encode(message)
        for gateway in self._gateways:
            gateway.publish(topic, data)

    def _run(self) -> None:
        while (job := self._queue.get()) is not None:
            try:
                job()
            except Exception:
                log.exception("could not hand on a message")
