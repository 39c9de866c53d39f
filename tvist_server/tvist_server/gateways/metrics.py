"""Prometheus figures of the robots over HTTP, read-only.

`python -m tvist_server.gateways.metrics > docs/reference/generated/metrics.md` writes the page that lists them.
"""

import contextlib
import socket
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING

from tvist_controller.instruments.report import Topic
from tvist_protocol.stream import Event, State, Telemetry
from tvist_server.gateways.base import Gateway, GatewayError, Message

if TYPE_CHECKING:
    from prometheus_client.metrics_core import Metric
    from prometheus_client.registry import Collector
else:
    Collector = object  # the library is imported when figures are requested

LABELS = ("namespace", "robot")


class MetricsGateway(Gateway):
    """Keeps a robot's newest messages for Prometheus; `newest` returns the newest state, from any thread."""

    wanted_topics: Collection[Topic] = frozenset[Topic]({"event", "telemetry"})

    def __init__(self, namespace: str, robot: str, newest: Callable[[], State | None]) -> None:
        self.labels = (namespace, robot)
        self._newest = newest
        self.state: State | None = None
        self.telemetry: Telemetry | None = None
        self.events: Counter[str] = Counter()  # number of events by kind
        self.warnings: Counter[str] = Counter()  # number of warnings by code; empty: no code

    def publish(self, topic: Topic, message: Message, payload: bytes) -> None:  # noqa: ARG002  every gateway gets it
        if isinstance(message, Telemetry):
            self.telemetry = message
        elif isinstance(message, Event):
            self.events[message.kind] += 1
            if message.kind == "warning":
                self.warnings[message.code or ""] += 1

    def look(self) -> None:
        """Fetch the newest state, before the figures are read."""
        self.state = self._newest() or self.state


class Metrics(Collector):
    """HTTP server for Prometheus, which computes figures on request; GatewayError if it cannot listen at `address`."""

    def __init__(self, address: str) -> None:
        host, port = place(address)
        try:
            from prometheus_client import CollectorRegistry, start_http_server
        except ImportError as error:
            raise GatewayError(
                "metrics needs the package prometheus-client: pip install 'tvist[server]'"
            ) from error
        registry = CollectorRegistry()
        self._robots: list[MetricsGateway] = []
        registry.register(self)
        try:
            self._server, self._thread = start_http_server(port, host, registry)
        except (OSError, socket.gaierror) as error:
            why = error.strerror or error
            raise GatewayError(
                f"cannot publish metrics on {address}: {why}; give another port or address"
            ) from error
        self.page = f"http://{f'[{host}]' if ':' in host else host}:{self._server.server_port}/metrics"
        """URL of the page with the figures."""

    def add(self, gateway: MetricsGateway) -> MetricsGateway:
        """Also publish the figures of this robot."""
        self._robots.append(gateway)
        return gateway

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._server.shutdown()
            self._server.server_close()

    def collect(self) -> "Iterator[Metric]":
        """Yield the figures of all robots; a robot without telemetry has only those of its state."""
        from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily

        for robot in self._robots:
            robot.look()
        families = {"counter": CounterMetricFamily, "gauge": GaugeMetricFamily}
        for kind, name, what, label, values_of in _figures():
            family = families[kind](f"tvist_{name}", what, labels=(*LABELS, label) if label else LABELS)
            for robot in self._robots:
                for value, number in values_of(robot).items():
                    family.add_metric((*robot.labels, value) if label else robot.labels, number)
            yield family


Figure = tuple[str, str, str, str, Callable[[MetricsGateway], Mapping[str, float]]]
"""Prometheus type, name without `tvist_`, meaning, name of a further label or "", and values by label."""


def _figures() -> Iterator[Figure]:
    for source, figures in FIGURES.items():
        for kind, field, what in figures:
            yield kind, NAMES.get(field, field), what, "", partial(_fields, source, {"": field}, 1.0)
    what = "Lateness of the ticks of the last second, by `quantile`: 0.5, 0.99, and 1 for the largest."
    lateness = partial(_fields, "telemetry", QUANTILES, 1e-6)
    yield "gauge", "tick_lateness_seconds", what, "quantile", lateness
    yield "counter", "events", "Events, by `kind`.", "kind", lambda robot: robot.events.copy()
    what = "Warnings, by `code`, which is empty for those without one."
    yield "counter", "warnings", what, "code", lambda robot: robot.warnings.copy()


def _fields(source: str, fields: Mapping[str, str], unit: float, of: MetricsGateway) -> dict[str, float]:
    """Return known values of a message times `unit`, by keys that `fields` maps to the message's fields."""
    message = getattr(of, source)
    found = {key: getattr(message, field) for key, field in fields.items() if message is not None}
    return {key: unit * value for key, value in found.items() if value is not None}


FIGURES = {
    "state": (
        ("counter", "tick", "Control periods begun. If it stands still, the robot does."),
        ("gauge", "robot_mode", "Robot mode as in RTDE: 7 is RUNNING."),
        ("gauge", "safety_mode", "Safety mode as in RTDE: 1 is NORMAL, 3 is PROTECTIVE_STOP."),
    ),
    "telemetry": (
        ("gauge", "ticks_per_second", "Control periods begun in the last second: 500 at full rate."),
        ("gauge", "load", "Share of the last second that the ticks of this robot took; missing in lockstep."),
        ("gauge", "overloaded", "1 while the robot is overloaded, otherwise 0."),
        ("counter", "due_ticks",
         "Control periods that were due: those begun and those left out; missing in lockstep."),
        ("counter", "missed_ticks",
         "Of the due control periods, those that began a period late or more, or were left out."),
        ("counter", "commands", "Commands received."),
        ("counter", "refused", "Commands refused."),
        ("counter", "setpoints_received", "Set-points received."),
        ("counter", "setpoints_refused",
         "Set-points that belonged to no stream or were no posture of the arm."),
        ("counter", "setpoints_late", "Set-points dropped because a newer one had been played."),
        ("counter", "setpoints_lost", "Set-points that had not arrived when they were due."),
        ("counter", "setpoints_limited", "Set-points that exceeded a limit and were limited."),
        ("counter", "dropped_states", "States dropped because the network did not take them in time."),
        ("counter", "recorder_dropped", "Messages dropped because the recorder's queue was full."),
    ),
}  # fmt: skip
"""Type, field and meaning of each figure, by the message that has the field."""
NAMES = {
    "tick": "ticks", "load": "load_ratio", "refused": "commands_refused",
    "dropped_states": "states_dropped",
}  # fmt: skip
"""Names, without `tvist_`, of the figures whose names differ from their fields'."""
QUANTILES = {"0.5": "late_p50_us", "0.99": "late_p99_us", "1": "late_max_us"}


def place(address: str) -> tuple[str, int]:
    """Split `ADDRESS:PORT`, or `PORT` of the loopback interface; raise GatewayError if it is neither."""
    host, _, port = address.rpartition(":")
    if not (port.isascii() and port.isdigit() and len(port) < 6 and int(port) < 65536):
        raise GatewayError(
            f"metrics is {address!r}: must be ADDRESS:PORT, or PORT for 127.0.0.1, such as 9447"
        )
    return host.removeprefix("[").removesuffix("]") or "127.0.0.1", int(port)


PAGE = """\
# Metrics

`tvist serve --metrics 9447` publishes these figures for Prometheus on `http://127.0.0.1:9447/metrics`. With an address,
as in `--metrics 0.0.0.0:9447`, other machines can read them, too. The page is not encrypted; nothing can be changed
through it.

Each figure has the labels `namespace`, which may be empty, and `robot`. Counters count from the start of the server.
The number of ticks and the modes are read when you ask, events and warnings are counted as they occur, and all others
change once a second. [Operate many robots](../../how-to/operate-many-robots.md#what-the-words-mean) says what *due*,
*missed*, *load* and *overloaded* mean. This page is made by `python -m tvist_server.gateways.metrics`.

| figure | type | meaning |
|---|---|---|
"""


def page() -> str:
    """Return the reference page that lists all figures."""
    metrics = Metrics("0")
    families = list(metrics.collect())
    metrics.close()
    names = (f"{one.name}_total" if one.type == "counter" else one.name for one in families)
    rows = zip(names, families, strict=True)
    return PAGE + "".join(f"| `{name}` | {one.type} | {one.documentation} |\n" for name, one in rows)


if __name__ == "__main__":
    print(page(), end="")  # noqa: T201  its purpose
