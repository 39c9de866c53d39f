"""Figures of a robot of another process for Prometheus, from the messages that it publishes."""

import zenoh
from zenoh.handlers import Callback, RingChannel

from tvist_protocol import keys
from tvist_protocol.codec import decode
from tvist_protocol.stream import Event, State, Telemetry
from tvist_server.gateways.metrics import MetricsGateway


class DistantMetrics(MetricsGateway):
    """Keeps the newest messages of a robot that another process serves.

    Args:
        session: The router to which that process is connected, in the namespace.
        namespace: Namespace of the robot; empty if it has none.
        robot: Name of the robot.
    """

    def __init__(self, session: zenoh.Session, namespace: str, robot: str) -> None:
        super().__init__(namespace, robot, self._arrived)
        # Nobody looks at 500 states a second: Zenoh keeps the newest, without a call of Python for each.
        newest: RingChannel[zenoh.Sample] = RingChannel(1)
        self._states = session.declare_subscriber(keys.key(robot, "state"), newest)
        session.declare_subscriber(keys.key(robot, "event"), Callback(self._on_event, indirect=False))
        session.declare_subscriber(keys.key(robot, "telemetry"), Callback(self._on_telemetry, indirect=False))

    def _arrived(self) -> State | None:
        """Newest state that has arrived over the network since the last call."""
        sample = self._states.try_recv()
        return None if sample is None else decode(State, sample.payload.to_bytes())

    def _on_event(self, sample: zenoh.Sample) -> None:
        self.count(decode(Event, sample.payload.to_bytes()))

    def _on_telemetry(self, sample: zenoh.Sample) -> None:
        self.telemetry = decode(Telemetry, sample.payload.to_bytes())
