"""Prometheus figures of the robots over HTTP, read-only.

`python -m tvist_server.gateways.metrics > docs/reference/generated/metrics.md` writes the page that lists them.
"""

import contextlib
import socket
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from typing import TYPE_CHECKING, Any

from tvist_controller.instruments.report import Topic
from tvist_protocol.stream import Event, State, Telemetry
from tvist_server.gateways.base import Gateway, GatewayError, Message

if TYPE_CHECKING:
    from prometheus_client.metrics_core import Metric
    from prometheus_client.registry import Collector
else:
    Collector = object  # the library is imported when figures are requested

LABELS = ("namespace", "robot")
MICRO = 1e-6


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
            self.count(message)

    def count(self, event: Event) -> None:
        self.events[event.kind] += 1
        if event.kind == "warning":
            self.warnings[event.code or ""] += 1

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
            raise GatewayError(f"cannot publish metrics on {address}: {error.strerror or error}") from error
        self.page = f"http://{f'[{host}]' if ':' in host else host}:{self._server.server_port}/metrics"
        """URL of the page with the figures."""

    def gateway(self, namespace: str, robot: str, newest: Callable[[], State | None]) -> MetricsGateway:
        """Create the gateway of a robot; arguments as for `MetricsGateway`."""
        gateway = MetricsGateway(namespace, robot, newest)
        self.add(gateway)
        return gateway

    def add(self, gateway: MetricsGateway) -> None:
        self._robots.append(gateway)

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._server.shutdown()
            self._server.server_close()

    def collect(self) -> "Iterator[Metric]":
        """Yield the figures of all robots; a robot without telemetry has only those of its state."""
        from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily

        for robot in self._robots:
            robot.look()
        for of, make, figures in (("state", CounterMetricFamily, TICKS), ("state", GaugeMetricFamily, MODES)):
            yield from (self._family(make, of, *figure) for figure in figures)
        late = GaugeMetricFamily(
            "tvist_tick_lateness_seconds",
            "Lateness of the ticks of the last second, by `quantile`: 0.5, 0.99, and 1 for the largest.",
            labels=(*LABELS, "quantile"),
        )
        for robot in self._robots:
            for quantile, field in QUANTILES.items() if robot.telemetry is not None else ():
                late.add_metric((*robot.labels, quantile), getattr(robot.telemetry, field) * MICRO)
        yield late
        for make, figures in ((GaugeMetricFamily, GAUGES), (CounterMetricFamily, COUNTERS)):
            yield from (self._family(make, "telemetry", *figure) for figure in figures)
        yield self._counted("tvist_events", "Events, by `kind`.", "kind")
        yield self._counted(
            "tvist_warnings", "Warnings, by `code`, which is empty for those without one.", "code"
        )

    def _family(self, make: "Callable[..., Metric]", of: str, name: str, what: str, field: str) -> "Metric":
        """Return a figure of the robots' states or telemetry; a robot that lacks it is left out."""
        family: Any = make(name, what, labels=LABELS)
        for robot in self._robots:
            value = getattr(getattr(robot, of), field, None)
            if value is not None:
                family.add_metric(robot.labels, value)
        return family  # type: ignore[no-any-return]

    def _counted(self, name: str, what: str, label: str) -> "Metric":
        """Return the number of events or warnings for each kind or code."""
        from prometheus_client.core import CounterMetricFamily

        family = CounterMetricFamily(name, what, labels=(*LABELS, label))
        for robot in self._robots:
            counted = robot.events if label == "kind" else robot.warnings
            for value, count in counted.copy().items():
                family.add_metric((*robot.labels, value), count)
        return family


Figures = tuple[tuple[str, str, str], ...]  # name, meaning, field
TICKS: Figures = (("tvist_ticks", "Control periods begun. If it stands still, the robot does.", "tick"),)
MODES: Figures = (
    ("tvist_robot_mode", "Robot mode as in RTDE: 7 is RUNNING.", "robot_mode"),
    ("tvist_safety_mode", "Safety mode as in RTDE: 1 is NORMAL, 3 is PROTECTIVE_STOP.", "safety_mode"),
)
QUANTILES = {"0.5": "late_p50_us", "0.99": "late_p99_us", "1": "late_max_us"}
GAUGES: Figures = (
    (
        "tvist_ticks_per_second",
        "Control periods begun in the last second: 500 at full rate.",
        "ticks_per_second",
    ),
    (
        "tvist_load_ratio",
        "Share of the last second that the ticks of this robot took; missing in lockstep.",
        "load",
    ),
    ("tvist_overloaded", "1 while the robot is overloaded, otherwise 0.", "overloaded"),
)
COUNTERS: Figures = (
    (
        "tvist_due_ticks",
        "Control periods that were due: those begun and those left out; missing in lockstep.",
        "due_ticks",
    ),
    (
        "tvist_missed_ticks",
        "Of the due control periods, those that began a period late or more, or were left out.",
        "missed_ticks",
    ),
    ("tvist_commands", "Commands received.", "commands"),
    ("tvist_commands_refused", "Commands refused.", "refused"),
    ("tvist_setpoints_received", "Set-points received.", "setpoints_received"),
    (
        "tvist_setpoints_refused",
        "Set-points that belonged to no stream or were no posture of the arm.",
        "setpoints_refused",
    ),
    ("tvist_setpoints_late", "Set-points dropped because a newer one had been played.", "setpoints_late"),
    ("tvist_setpoints_lost", "Set-points that had not arrived when they were due.", "setpoints_lost"),
    ("tvist_setpoints_limited", "Set-points that exceeded a limit and were limited.", "setpoints_limited"),
    (
        "tvist_states_dropped",
        "States dropped because the network did not take them in time.",
        "dropped_states",
    ),
    ("tvist_recorder_dropped", "Messages dropped because the recorder's queue was full.", "recorder_dropped"),
)


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
