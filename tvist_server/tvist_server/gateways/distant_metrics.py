"""Prometheus figures of a robot in another process, from the messages that it publishes."""

import zenoh
from zenoh.handlers import Callback, RingChannel

from tvist_protocol import keys
from tvist_protocol.codec import decode
from tvist_protocol.stream import Event, State, Telemetry
from tvist_server.gateways.metrics import MetricsGateway


class DistantMetrics(MetricsGateway):
    """Keeps the newest messages of a robot that another process serves; `session` connects to that process's router."""

    def __init__(self, session: zenoh.Session, namespace: str, robot: str) -> None:
        super().__init__(namespace, robot, self._arrived)
        # Nobody reads 500 states a second: Zenoh keeps the newest one without a Python call for each.
        newest: RingChannel[zenoh.Sample] = RingChannel(1)
        self._states = session.declare_subscriber(keys.key(robot, "state"), newest)
        session.declare_subscriber(keys.key(robot, "event"), Callback(self._on_event, indirect=False))
        session.declare_subscriber(keys.key(robot, "telemetry"), Callback(self._on_telemetry, indirect=False))

    def _arrived(self) -> State | None:
        sample = self._states.try_recv()
        return None if sample is None else decode(State, sample.payload.to_bytes())

    def _on_event(self, sample: zenoh.Sample) -> None:
        self.count(decode(Event, sample.payload.to_bytes()))

    def _on_telemetry(self, sample: zenoh.Sample) -> None:
        self.telemetry = decode(Telemetry, sample.payload.to_bytes())
