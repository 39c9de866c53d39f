"""An in-process server without network, thread or clock; time advances when a client steps it."""

from collections.abc import Callable
from typing import cast

from tvist_controller.controller import Controller
from tvist_controller.host import Host
from tvist_controller.instruments.report import Report, Sink, Topic
from tvist_controller.safety.payload_learning import PayloadLearning, payload_learning_of
from tvist_controller.setup import Setup
from tvist_plant.plant import Plant
from tvist_protocol.channels import tag
from tvist_protocol.codec import encode
from tvist_protocol.io import Io
from tvist_protocol.journal import Entry
from tvist_protocol.stream import Event, Truth


class LoopbackHost(Sink):
    """A robot in the caller's thread, as fast as it computes; every message still passes through the codec.

    Args:
        setup: Initial setup with the clock `free` or `lockstep`.
        plant: Plant to control; None for the setup's flexible arm.
        learning: Learning from the robot's motions; None for the setup's choice.

    Raises:
        ValueError: The setup is invalid, or the plant does not fit it.
    """

    def __init__(
        self, setup: Setup, plant: Plant | None = None, learning: PayloadLearning | None = None
    ) -> None:
        self.controller = Controller(setup, plant)
        self.entries: list[Entry] = []  # inputs of the controller; a replay needs only these and the setup
        self._host = Host(self.controller, self, learning=learning or payload_learning_of(setup))
        self._callbacks: dict[Topic, list[Callable[[bytes], object]]] = {}

    def request(self, client: str, data: bytes) -> bytes:  # noqa: ARG002  the network does not name its clients either
        """Carry out a command and return the encoded reply."""
        return encode(self._host.request(data))

    def put_setpoint(self, client: str, data: bytes) -> None:  # noqa: ARG002
        """Take a set-point."""
        self._host.setpoint(data)

    def info(self) -> bytes:
        """Return the encoded description of the controller."""
        return self._host.info()

    def subscribe(self, topic: Topic, callback: Callable[[bytes], object]) -> Callable[[], None]:
        """Call a function with a topic's messages, first present state or io; return a function to end it."""
        callbacks = self._callbacks.setdefault(topic, [])
        callbacks.append(callback)
        if topic == "state":
            callback(self.controller.report.encoded)
        elif topic == "io":
            callback(encode(self.controller.io()))
        return lambda: callbacks.remove(callback)

    def report(self, report: Report) -> None:
        """Pass on a state, which is encoded only for subscribers."""
        for callback in tuple(self._callbacks.get("state", ())):
            callback(report.encoded)

    def publish(self, message: Event | Truth | Io) -> None:
        """Pass on a message other than a state."""
        callbacks = tuple(self._callbacks.get(cast("Topic", tag(type(message))), ()))
        data = encode(message) if callbacks else b""
        for callback in callbacks:
            callback(data)

    event = truth = io = publish

    def journal(self, entry: Entry) -> None:
        """Store an entry."""
        self.entries.append(entry)
