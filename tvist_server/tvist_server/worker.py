"""A process that serves robots or the router: it obeys the first process and ends with that."""

import asyncio
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

import zenoh
from zenoh.handlers import Callback, RingChannel

from tvist_plant.user_file import UserFileError
from tvist_protocol import keys
from tvist_protocol.codec import decode
from tvist_protocol.stream import Event, State, Telemetry
from tvist_server.assembly import Share
from tvist_server.config import ServeConfig
from tvist_server.gateways.base import GatewayError, Starting, topic_of
from tvist_server.gateways.metrics import Metrics, MetricsGateway
from tvist_server.gateways.network import Network
from tvist_server.option_values import StartError
from tvist_server.recording import RecorderError
from tvist_server.server import RecordingResult, Server
from tvist_server.shutdown import Shutdown, limit_shutdown
from tvist_server.ur_ports import InterfaceName

END = 3.5  # longest wait for a process to close its recordings and end [s]; then it is killed
REACHED = 15.0  # longest wait until clients reach all robots [s]


@dataclass(frozen=True)
class WorkerRefused:
    """The robots cannot be served."""

    why: str
    misuse: bool  # whether an option is wrong


@dataclass(frozen=True)
class WorkerMade:
    """The robots exist but do not tick yet."""

    ur: list[tuple[str, dict[InterfaceName, int]]]  # address and ports of each robot's UR interfaces
    page: str | None = None  # address of the page with figures for Prometheus


@dataclass(frozen=True)
class WorkerReady:
    """The robots tick and answer, or clients reach all of them."""


@dataclass(frozen=True)
class WorkerEnded:
    """The robots have stopped, and their recordings are closed."""

    failure: str | None  # why a robot had stopped ticking before
    recordings: list[RecordingResult]


News = WorkerRefused | WorkerMade | WorkerReady | WorkerEnded


@dataclass(frozen=True)
class ParentPipe:
    """Connection of a process to the first process."""

    pipe: Connection
    died: Callable[[], None]  # cleans up after the first process

    def receive(self) -> Any:
        """Await the first process's message; return False if that died or the message ends this process."""
        try:
            return self.pipe.recv()
        except (EOFError, OSError):
            self.died()
            return False

    def send(self, news: News) -> None:
        """Send news to the first process, unless that has died."""
        try:
            self.pipe.send(news)
        except OSError:
            self.died()


class DistantMetrics(MetricsGateway):
    """Keeps the newest messages of a robot that another process serves; `session` connects to that process's router."""

    def __init__(self, session: zenoh.Session, namespace: str, robot: str) -> None:
        super().__init__(namespace, robot, self._arrived)
        # Nobody reads 500 states a second: Zenoh keeps the newest one without a Python call for each.
        newest: RingChannel[zenoh.Sample] = RingChannel(1)
        self._states = session.declare_subscriber(keys.key(robot, "state"), newest)
        for kind, topic in ((Event, keys.key(robot, "event")), (Telemetry, keys.key(robot, "telemetry"))):
            session.declare_subscriber(topic, Callback(partial(self._on_message, kind), indirect=False))

    def _arrived(self) -> State | None:
        sample = self._states.try_recv()
        return None if sample is None else decode(State, sample.payload.to_bytes())

    def _on_message(self, kind: type[Event | Telemetry], sample: zenoh.Sample) -> None:
        message = decode(kind, sample.payload.to_bytes())
        self.publish(topic_of(message), message, b"")


def serve_router(
    config: ServeConfig,
    names: Sequence[str],
    listen: Sequence[str],
    guard: Mapping[str, Any],
    parent: ParentPipe,
) -> None:
    """Run the process that clients connect to: a router, which also answers for robots that are starting.

    It reports `WorkerMade`, then `WorkerReady` once it reaches all robots, and `WorkerEnded` at the end.
    """
    place, starting = config.namespace or "", Starting()
    try:
        network = Network(
            listen,
            guard,
            lockstep=config.clock != "realtime",
            connect=config.connect,
            security=config.security,
            namespace=place,
        )
        network.expect(names, starting, here=False)
        metrics = None if config.metrics is None else Metrics(config.metrics)
    except GatewayError as error:
        parent.send(WorkerRefused(str(error), misuse=False))
        return
    if metrics is not None:
        for name in names:
            metrics.add(DistantMetrics(network.session, place, name))
    parent.send(WorkerMade([], None if metrics is None else metrics.page))
    awaited, reached = set(names), threading.Event()

    def on_token(sample: zenoh.Sample) -> None:
        awaited.discard(str(sample.key_expr).split("/")[1])
        if not awaited:
            reached.set()

    network.session.liveliness().declare_subscriber(
        keys.ANY_ALIVE, Callback(on_token, indirect=False), history=True
    )
    while word := parent.receive():
        if word is not True:
            starting.note(*word)
            continue
        if not config.connect:  # otherwise clients reach them through another router
            reached.wait(REACHED)
        network.stop_answering_for_workers()
        parent.send(WorkerReady())
    if metrics is not None:
        metrics.close()
    network.close()
    parent.send(WorkerEnded(None, []))


def serve_robots(config: ServeConfig, share: Share, parent: ParentPipe) -> None:
    """Serve robots until the first process ends it or dies.

    It creates its robots and sends `WorkerMade`; after the first message, it starts them and sends
    `WorkerReady`; after the last, it sends `WorkerEnded`. Only the first process reacts to signals, which a
    terminal sends to all.
    """
    ending = Shutdown()
    ending.close()  # ignores signals
    try:
        server = Server(config, share=share)
    except (StartError, UserFileError, GatewayError, RecorderError) as error:
        parent.send(WorkerRefused(str(error), isinstance(error, StartError)))
        return
    parent.send(WorkerMade(server.ur))
    if not parent.receive():
        server.discard()
        return

    def ready() -> None:
        parent.send(WorkerReady())
        threading.Thread(target=end, name="tvist-end", daemon=True).start()

    def end() -> None:
        parent.receive()
        limit_shutdown()  # the process that would kill this one may have died
        ending.request()

    asyncio.run(server.run(ready, ending))
    parent.send(WorkerEnded(server.failure, server.recordings))
    if not server.left:  # Zenoh would wait for ten seconds
        os._exit(0)
