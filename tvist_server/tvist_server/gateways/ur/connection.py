"""A socket of an interface, and the session behind it."""

import asyncio
import ipaddress
import logging
import socket
from collections.abc import Callable
from typing import cast

from tvist_controller.instruments.snapshot import Snapshot
from tvist_protocol.stream import Event
from tvist_server.gateways.ur.base import PortSession, Send
from tvist_server.gateways.ur.lease import ConnectionControl, HostLease
from tvist_server.gateways.ur.notices import Notices
from tvist_server.gateways.ur.places import Places

log = logging.getLogger(__name__)

PIECE = 256
"""Bytes read from a client at a time, so that one that floods its interface waits its turn."""
MAX_COMMANDS = 32
"""Commands of a client that may wait for the controller's answers before more is taken of it: a tick does them all."""
MAX_UNREAD = 1_000_000
"""Bytes that may wait for a client that does not read them; then it is cut off."""
HEARS = MAX_UNREAD // 4
"""Unread bytes above which, in real time, a client gets no messages that go to all clients."""
ANSWERS = MAX_UNREAD // 2
"""Unread bytes above which, in real time, nothing more is read from a client until it has read."""
MAX_UNREAD_LOCKSTEP = 64_000_000
"""Limit in lockstep, where samples wait as well: a minute of them."""

FIRST_WORD = 30.0
"""Time in which a client has to say something where it has to begin [s]."""

MakeSession = Callable[[ConnectionControl, Send], PortSession]
"""Makes an interface's session: the way to the controller, and the way back."""


class Connection(asyncio.BufferedProtocol):
    """One client at one interface.

    Args:
        make: Its session.
        lease: Control for a host.
        places: Places of the robot; the connection occupies one as long as it lives.
        notices: Tells the server's console what was done with whom.
        lossless: Whether samples wait for a client that is slow: where a client lets time pass.
    """

    def __init__(
        self,
        make: MakeSession,
        lease: Callable[[str], HostLease],
        places: "Places[Connection]",
        notices: Notices,
        *,
        lossless: bool,
    ) -> None:
        self._make = make
        self._lease = lease
        self._places = places
        self._notices = notices
        self._lossless = lossless
        self._most_unread = MAX_UNREAD_LOCKSTEP if lossless else MAX_UNREAD
        self._transport: asyncio.Transport | None = None
        self._piece = bytearray(PIECE)
        self._behind = False
        """Whether the client leaves its answers unread."""
        self._first_word: asyncio.TimerHandle | None = None
        """What ends the connection of a client that says nothing."""
        self.session: PortSession | None = None
        self.peer = "a client"
        """The client and the interface it uses, in words."""
        self.heard = 0.0
        """When it last sent something, or came [s of the loop's clock]."""
        self.dropped = 0
        """Samples that a slow client did not get."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client came."""
        stream = cast("asyncio.Transport", transport)
        (host, port), (own, own_port) = (stream.get_extra_info(end)[:2] for end in ("peername", "sockname"))
        self.peer = f"the client {host}:{port} of port {own_port}"
        if not self._places.make_room(self.peer, local=host == own or _is_loopback(host)):
            stream.abort()
            return
        self._transport = stream
        stream.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if not self._lossless:
            stream.set_write_buffer_limits(ANSWERS)
        self._control = ConnectionControl(self._lease(host), self._hear, self.peer)
        self.session = self._make(self._control, self.send)
        self._places.taken.add(self)
        loop = asyncio.get_running_loop()
        self.heard = loop.time()
        if self.session.client_begins:
            self._first_word = loop.call_later(FIRST_WORD, self._said_nothing)
        self._guarded(self.session.opened)

    def get_buffer(self, sizehint: int) -> bytearray:  # noqa: ARG002  it is always the same
        """Return the buffer for the next piece of data."""
        return self._piece

    def buffer_updated(self, nbytes: int) -> None:
        """The client sent something."""
        session = self.session
        self.heard = asyncio.get_running_loop().time()
        if self._first_word is not None:
            self._first_word.cancel()
            self._first_word = None
        if session is not None:
            data = bytes(self._piece[:nbytes])
            self._guarded(lambda: session.receive(data))
            self._listen()

    def pause_writing(self) -> None:
        """The client does not read what it asked for."""
        self._behind = True
        self._listen()

    def resume_writing(self) -> None:
        """It has read."""
        self._behind = False
        self._listen()

    def _hear(self, answer: Callable[[], None]) -> None:
        """The controller has answered."""
        self._guarded(answer)
        self._listen()

    def _listen(self) -> None:
        """Take more of the client, unless it has to wait, or goes."""
        session, transport = self.session, self._transport
        if session is None or transport is None or transport.is_closing():
            return
        if session.over:
            transport.close()
        elif self._behind or self._control.unanswered >= MAX_COMMANDS:
            transport.pause_reading()
        else:
            transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002  however it ended
        """The client went, or was cut off."""
        session, self.session = self.session, None
        self._transport = None
        self._places.taken.discard(self)
        if self._first_word is not None:
            self._first_word.cancel()
        if self.dropped:
            log.warning("a client of a UR interface read too slowly: %d samples were dropped", self.dropped)
        if session is not None:
            try:
                session.closed()
            except Exception:
                log.exception("a UR interface could not close a session")
            self._control.leave()

    def send(self, data: bytes) -> None:
        """Send an answer; a client that does not read is cut off when too much waits."""
        transport = self._transport
        if transport is not None and not transport.is_closing():
            transport.write(data)
            if transport.get_write_buffer_size() > self._most_unread:
                log.warning("a client of a UR interface was disconnected because it does not read")
                transport.abort()

    def tell(self, message: bytes) -> None:
        """Send what everybody is told; whoever does not read loses it, in real time."""
        transport = self._transport
        if transport is not None and (self._lossless or transport.get_write_buffer_size() < HEARS):
            self.send(message)

    def sample(self, snapshot: Snapshot) -> None:
        """Send what a tick has for the client; in real time what finds bytes still waiting is dropped, never queued."""
        session, transport = self.session, self._transport
        if session is None or transport is None or transport.is_closing():
            return
        try:
            data = session.sample(snapshot)
        except Exception:
            log.exception("a UR interface failed and disconnected its client")
            transport.abort()
            return
        if session.over:
            transport.close()
        if not data:
            return
        if self._lossless:
            self.send(data)
        elif transport.get_write_buffer_size():
            self.dropped += 1
        else:
            transport.write(data)

    def event(self, event: Event) -> None:
        """Tell of an event."""
        session = self.session
        if session is not None:
            self._guarded(lambda: session.event(event))

    @property
    def dispensable(self) -> bool:
        """Whether it may have to go for a newcomer."""
        session = self.session
        return session is not None and session.client_begins and not session.served

    def cut_off(self) -> None:
        """End it at once, whatever still waits to be read."""
        if self._transport is not None:
            self._transport.abort()

    def _said_nothing(self) -> None:
        self._first_word = None
        self._notices.tell(f"{self.peer} was closed: it said nothing for {FIRST_WORD:.0f} s")
        self.cut_off()

    def close(self) -> None:
        """End it; what waits for a client that reads is still sent."""
        if self._transport is not None:
            self._transport.close()

    def _guarded(self, action: Callable[[], None]) -> None:
        """One client's fault is no other's: an error of ours ends its connection, loudly."""
        try:
            action()
        except Exception:
            log.exception("a UR interface failed and disconnected its client")
            if self._transport is not None:
                self._transport.abort()


def _is_loopback(host: str) -> bool:
    address = ipaddress.ip_address(host)
    if isinstance(address, ipaddress.IPv6Address) and address.ipv4_mapped is not None:
        address = address.ipv4_mapped
    return address.is_loopback
