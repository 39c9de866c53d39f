"""The sockets of a robot's programs as TCP sockets of this machine."""

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable, Collection, Sequence
from functools import partial
from typing import Final

from tvist_controller.instruments.report import Topic
from tvist_controller.programs.sockets import (
    Close,
    Expire,
    Open,
    Send,
    SocketEvent,
    SocketOrder,
    SocketPorts,
    Taken,
    Wait,
    Waited,
)
from tvist_protocol.journal import SocketChange
from tvist_server.allowed_hosts import AllowedHosts
from tvist_server.gateways.base import Gateway

log = logging.getLogger(__name__)

CONNECT_WITHIN: Final = 2.0  # longest time to connect, including name resolution [s]; as on UR's controllers
PATIENCE: Final = 1.0  # wall time for which a step waits for a socket that a program reads [s]
MAX_UNREAD: Final = 65_536  # number of unread bytes (plus one piece) above which the sender is paused
FLUSH_WITHIN: Final = 5.0  # longest time to flush a closed socket [s]
MAX_UNSENT: Final = 262_144  # number of unsent bytes above which the peer is disconnected


class _Link(asyncio.Protocol):
    """One socket, used in the network's thread; `tell` reports its events to the controller."""

    def __init__(self, number: int, tell: Callable[[SocketEvent], None]) -> None:
        self._number, self._tell = number, tell
        self._transport: asyncio.Transport | None = None
        self._received = 0
        self.taken = 0  # number of bytes that the program has read; written in the controller's thread
        self.paused = False  # whether the sender is paused, because the program has much to read
        self.ended = False  # whether the socket has ended; later events are not reported
        self.connecting: asyncio.Task[None] | None = None  # task that connects it; None before it starts

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        if self.ended:
            transport.abort()
        else:
            self._transport = transport
            self._say("opened")

    def data_received(self, data: bytes) -> None:
        self._received += len(data)
        self._say("received", data)
        self.look()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002  the program only learns that the socket ended
        self._transport = None
        self.end("closed")

    def look(self) -> None:
        transport = self._transport
        if transport is None or transport.is_closing():
            return
        self.paused = True  # set before checking, so that a concurrent read triggers another check
        if self._received - self.taken > MAX_UNREAD:
            transport.pause_reading()
        else:
            self.paused = False
            transport.resume_reading()

    def send(self, data: bytes) -> None:
        """Send bytes; disconnect a peer that leaves too many bytes unread."""
        transport = self._transport
        if transport is None or transport.is_closing():
            return
        transport.write(data)
        if transport.get_write_buffer_size() > MAX_UNSENT:
            log.warning("a socket of a program was closed because the other side does not read")
            transport.abort()

    def end(self, change: SocketChange | None = None) -> None:
        """End the socket, and report `change` to the controller; None: the controller ended the socket."""
        if change is not None:
            self._say(change)
        elif self.connecting is not None:
            self.connecting.cancel()
        self.ended = True
        if self._transport is not None:
            self._transport.close()
            asyncio.get_running_loop().call_later(FLUSH_WITHIN, self._transport.abort)

    def _say(self, change: SocketChange, data: bytes = b"") -> None:
        if not self.ended:
            self._tell(SocketEvent(self._number, change, data))


class ProgramSockets(Gateway, SocketPorts):
    """Opens sockets to the machines that programs may connect to; `tell` and `warn` run in any thread."""

    wanted_topics: Collection[Topic] = ()

    def __init__(
        self, tell: Callable[[SocketEvent], None], warn: Callable[[str], None], allowed: AllowedHosts
    ) -> None:
        self._tell_controller, self._warn, self._allowed = tell, warn, allowed
        self._loop: asyncio.AbstractEventLoop | None = None
        self._early: list[Callable[[], object]] | None = []
        """Actions that wait for the network's thread to start; None from then on."""
        # The controller's thread alone uses the following fields.
        self._links: dict[int, _Link] = {}
        self._waits: dict[int, tuple[int, float]] = {}  # socket and start time of each present wait
        self._moved: set[int] = set()  # sockets with news since the last tick
        self._silent: set[int] = set()  # sockets for which a step has waited without receiving data

    # The following methods run in the controller's thread.

    def carry_out(self, orders: Sequence[SocketOrder]) -> Sequence[SocketEvent]:
        """Carry out orders; the results are reported later."""
        now = time.monotonic()
        for order in orders:
            match order:
                case Open():
                    link = self._links[order.socket] = _Link(order.socket, self._tell_controller)
                    self._soon(partial(self._begin, order, link))
                case Send():
                    self._soon(partial(self._links[order.socket].send, order.data))
                case Close():
                    self._silent.discard(order.socket)
                    self._soon(self._links.pop(order.socket).end)
                case Taken():
                    link = self._links[order.socket]
                    link.taken += order.amount
                    if link.paused:
                        self._soon(link.look)
                case Wait():
                    self._waits[order.wait] = order.socket, now
                case Waited():
                    del self._waits[order.wait]
                case Expire():
                    left = self._waits[order.wait][1] + order.seconds - now
                    # Through the network's thread, so that data that came earlier is reported first.
                    self._soon(partial(self._later, left, SocketEvent(order.wait, "expired")))
        return ()

    def note(self, news: SocketEvent) -> None:
        """Note that the controller gets this news before its next tick."""
        if news.change == "expired":
            if news.number in self._waits:
                self._moved.add(self._waits[news.number][0])
        else:
            self._moved.add(news.number)
            self._silent.discard(news.number)

    def patience(self) -> float:
        """Return a step's longest wait for sockets being read [s]; after a vain wait, 0 until data comes."""
        waits = [(socket, begun) for socket, begun in self._waits.values() if socket not in self._silent]
        if not waits or not self._moved.isdisjoint(socket for socket, _ in waits):
            self._moved.clear()
            return 0.0
        now = time.monotonic()
        self._silent.update(socket for socket, begun in waits if begun + PATIENCE <= now)
        return max(0.0, max(begun for _, begun in waits) + PATIENCE - now)

    def _soon(self, action: Callable[[], object]) -> None:
        if self._loop is not None:
            with contextlib.suppress(RuntimeError):  # the loop is closed at shutdown
                self._loop.call_soon_threadsafe(action)
        elif self._early is not None:
            self._early.append(action)

    # The following methods run in the network's thread.

    async def open(self) -> None:
        self._loop = asyncio.get_running_loop()
        early, self._early = self._early or [], None
        for action in early:
            action()

    async def shut(self) -> None:
        self._loop = None
        for link in tuple(self._links.values()):
            link.end()
        await asyncio.sleep(0)  # lets the connections end

    def close(self) -> None:
        self._loop = self._early = None

    def _later(self, seconds: float, news: SocketEvent) -> None:
        asyncio.get_running_loop().call_later(max(0.0, seconds), self._tell_controller, news)

    def _begin(self, order: Open, link: _Link) -> None:
        link.connecting = asyncio.ensure_future(self._connect(order, link))

    async def _connect(self, order: Open, link: _Link) -> None:
        loop = asyncio.get_running_loop()
        with contextlib.suppress(Exception):  # any failure must be reported to the program
            async with asyncio.timeout(CONNECT_WITHIN):
                for address in await self._addresses(order):
                    with contextlib.suppress(OSError):
                        await loop.create_connection(lambda: link, address, order.port)
                        return
        link.end("failed")

    async def _addresses(self, order: Open) -> list[str]:
        """Return the addresses of a machine that the program may connect to; warn if all are forbidden."""
        loop = asyncio.get_running_loop()
        found = await loop.getaddrinfo(order.address, order.port, proto=6)
        addresses = list(dict.fromkeys(str(one[4][0]) for one in found))
        allowed = [one for one in addresses if self._allowed.allows(order.address, one, order.origin)]
        if not allowed:
            sender = "it is not known which" if order.origin is None else order.origin
            self._warn(
                f"a program may not connect to {order.address}: it may to the machine that sent it ({sender}), and to "
                f"those of tvist serve --ur-allow {order.address}"
            )
        return allowed
