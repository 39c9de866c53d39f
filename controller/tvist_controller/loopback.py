"""An in-process server without network, thread or clock; time advances when a client steps it."""

from collections.abc import Callable

from tvist_controller.controller import Controller
from tvist_controller.host import Host
from tvist_controller.instruments.report import Report, Sink, Topic
from tvist_controller.safety.payload_learning import PayloadLearning, payload_learning_of
from tvist_controller.setup import Setup
from tvist_plant.plant import Plant
from tvist_protocol.codec import encode
from tvist_protocol.io import Io
from tvist_protocol.journal import Entry
from tvist_protocol.stream import Event, Truth


class LoopbackHost(Sink):
    """A robot in the caller's thread, as fast as it computes; every message still passes through the codec.

    Args:
        setup: Initial setup with the clock `free` or `lockstep`.
        plant: Plant to control; None for the setup's flexible arm.
        learning: What the robot learns from its motions; None for the setup's choice.

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
        """Call a function with each message of a topic, first the present state or io; return its end."""
        callbacks = self._callbacks.setdefault(topic, [])
        callbacks.append(callback)
        if topic == "state":
            callback(self.controller.report.encoded)
        elif topic == "io":
            callback(encode(self.controller.io()))
        return lambda: callbacks.remove(callback)

    def report(self, report: Report) -> None:
        """Pass on a state."""
        self._put("state", lambda: report.encoded)

    def event(self, event: Event) -> None:
        """Pass on an event."""
        self._put("event", lambda: encode(event))

    def truth(self, truth: Truth) -> None:
        """Pass on what a real robot cannot measure."""
        self._put("truth", lambda: encode(truth))

    def io(self, io: Io) -> None:
        """Pass on inputs, outputs and registers."""
        self._put("io", lambda: encode(io))

    def journal(self, entry: Entry) -> None:
        """Store an entry."""
        self.entries.append(entry)

    def _put(self, topic: Topic, encoded: Callable[[], bytes]) -> None:
        callbacks = self._callbacks.get(topic)
        if callbacks:
            data = encoded()
            for callback in tuple(callbacks):
                callback(data)
