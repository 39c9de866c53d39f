"""A session that robots of this process publish over, and a client in another process that reads it."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import zenoh

from tvist_client.transports.session import close_session
from tvist_lab.served import free_endpoint
from tvist_protocol import keys
from tvist_server.gateways.network import REALTIME, open_router

NAME = "ur5e"


class Published:
    """Publishes encoded states.

    Args:
        publisher: Publisher of the robot's states.
    """

    def __init__(self, publisher: zenoh.Publisher) -> None:
        self._publisher = publisher

    def put(self, state: bytes) -> None:
        """Publish a state."""
        self._publisher.put(state)


@contextmanager
def published() -> Iterator[Published]:
    """Open the session as a server in real time does, with one client that reads every state."""
    endpoint = free_endpoint()
    session = open_router([endpoint], (), REALTIME, None)
    try:
        publisher = session.declare_publisher(
            keys.state(NAME),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.DATA_LOW,
        )
        words = [sys.executable, "-m", "tvist_lab.benchmark.observers", endpoint, NAME, "1"]
        pipe = subprocess.PIPE
        with subprocess.Popen(words, stdin=pipe, stdout=pipe) as reader:  # noqa: S603  our own module
            assert reader.stdout is not None
            reader.stdout.readline()  # it reads now
            yield Published(publisher)
            reader.communicate(b"")  # the end of its stdin ends it
    finally:
        close_session(session)
