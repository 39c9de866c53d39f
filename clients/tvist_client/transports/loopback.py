"""A robot in this process: no network, no thread; a command is carried out while it is sent."""

import asyncio
from collections.abc import Callable
from typing import Protocol

from tvist_client.errors import NotConnectedError
from tvist_client.transports.base import Topic, Transport


class InProcessRobot(Protocol):
    """What a robot in process offers. A `simulation.step` ticks it, and callbacks run, before it returns."""

    def request(self, client: str, data: bytes) -> bytes:
        """Carry out an encoded command; its encoded reply."""

    def put_setpoint(self, client: str, data: bytes) -> None:
        """Take an encoded set-point."""

    def subscribe(self, topic: Topic, callback: Callable[[bytes], None]) -> Callable[[], None]:
        """Have every message of a topic, first of all the present `state` or `io`; the function returned ends that."""

    def info(self) -> bytes:
        """Encoded `info`."""


class LoopbackTransport(Transport):
    """A way to a robot in process.

    Args:
        host: The robot.
        client: Name under which the host knows this client.
    """

    def __init__(self, host: InProcessRobot, client: str = "client") -> None:
        self._host = host
        self._client = client
        self._unsubscribe: list[Callable[[], None]] = []
        self._closed = False

    async def request(self, data: bytes, timeout_s: float) -> bytes:  # noqa: ARG002  it computes, it never waits
        """Carry out a command."""
        self._check_open()
        reply = self._host.request(self._client, data)
        # Whoever iterates over the states gets a turn between two commands.
        await asyncio.sleep(0)
        return reply

    def put_setpoint(self, data: bytes) -> None:
        """Hand over a set-point."""
        self._check_open()
        self._host.put_setpoint(self._client, data)

    async def info(self) -> bytes:
        """Ask what the robot is."""
        self._check_open()
        return self._host.info()

    def subscribe(self, topic: Topic, callback: Callable[[bytes], None]) -> None:
        """Have every message of a topic, while the command runs that causes it."""
        self._check_open()
        self._unsubscribe.append(self._host.subscribe(topic, callback))

    def on_lost(self, callback: Callable[[NotConnectedError], None]) -> None:
        """Do nothing: a robot in this process does not go away."""

    async def announce(self, client: str) -> None:
        """Do nothing: a client in this process does not go away either."""

    async def withdraw(self, client: str) -> None:
        """Do nothing."""

    async def close(self) -> None:
        """Unsubscribe."""
        self._closed = True
        while self._unsubscribe:
            self._unsubscribe.pop()()

    def _check_open(self) -> None:
        if self._closed:
            raise NotConnectedError("this transport is closed: open another one")
