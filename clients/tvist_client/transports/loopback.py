"""A robot in this process, without network or thread; a command is carried out while it is sent."""

import asyncio
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Protocol

from tvist_client.errors import NotConnectedError
from tvist_client.transports.base import Topic, Transport


class InProcessRobot(Protocol):
    """Interface of a robot in this process. A `simulation.step` ticks it and runs the callbacks before it returns."""

    def request(self, client: str, data: bytes) -> bytes:
        """Carry out an encoded command and return its encoded reply."""

    def put_setpoint(self, client: str, data: bytes) -> None:
        """Take an encoded set-point."""

    def subscribe(self, topic: Topic, callback: Callable[[bytes], None]) -> Callable[[], None]:
        """Call a function with a topic's messages, first the present one; the returned function ends this."""

    def info(self) -> bytes:
        """Return the encoded `info`."""


class LoopbackTransport(Transport):
    """A connection to the robot `host` in this process, with `client` as this client's name."""

    def __init__(self, host: InProcessRobot, client: str = "client") -> None:
        self._host = host
        self._client = client
        self._unsubscribe: list[Callable[[], None]] = []
        self._closed = False

    async def request(self, data: bytes, timeout_s: float) -> bytes:  # noqa: ARG002  it computes, it never waits
        self._check_open()
        reply = self._host.request(self._client, data)
        # Let tasks that iterate over the states run between two commands.
        await asyncio.sleep(0)
        return reply

    def put_setpoint(self, data: bytes) -> None:
        self._check_open()
        self._host.put_setpoint(self._client, data)

    async def info(self) -> bytes:
        self._check_open()
        return self._host.info()

    def subscribe(self, topic: Topic, callback: Callable[[bytes], None]) -> None:
        """Call a function with every message of a topic, during the command that causes it."""
        self._check_open()
        self._unsubscribe.append(self._host.subscribe(topic, callback))

    def on_lost(self, callback: Callable[[NotConnectedError], None]) -> None:
        """Do nothing: a robot in this process does not disconnect."""

    def presence(self, client: str) -> AbstractContextManager[object]:  # noqa: ARG002  no network
        """Do nothing: a client in this process does not disconnect either."""
        return nullcontext()

    async def close(self) -> None:
        self._closed = True
        while self._unsubscribe:
            self._unsubscribe.pop()()

    def _check_open(self) -> None:
        if self._closed:
            raise NotConnectedError("this transport is closed: open another one")
