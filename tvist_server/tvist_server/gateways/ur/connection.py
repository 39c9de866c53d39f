"""One client's socket with its session, and the limit of connections."""

import asyncio
import contextlib
import ipaddress
import logging
import os
import socket
from collections.abc import Callable
from typing import Final, cast

from tvist_controller.instruments.snapshot import Snapshot
from tvist_protocol.stream import Event
from tvist_server.gateways.ur.base import PortSession, Send
from tvist_server.gateways.ur.lease import ConnectionControl, HostLease

log = logging.getLogger(__name__)

PIECE = 256  # bytes read from a client at a time, so that a flood does not delay the others
MAX_COMMANDS = 32
"""Largest number of a client's unanswered commands; more pause reading, because one tick carries all of them out."""
MAX_UNREAD = 1_000_000  # unread bytes at which a client is disconnected
HEARS = MAX_UNREAD // 4  # in real time, unread bytes above which a client misses messages to all clients
ANSWERS = MAX_UNREAD // 2  # in real time, unread bytes above which reading from a client pauses
MAX_UNREAD_LOCKSTEP = 64_000_000  # `MAX_UNREAD` in lockstep, where samples wait as well: one minute of them

LAST_WORDS = 65_536
"""Largest amount still read from a client that has reset its connection [bytes]; longer than any known program."""

UNREAD_FOR = 10.0  # in real time, time without a successful sample after which a client is disconnected [s]

MAX_CONNECTIONS: Final = 256  # largest number of connections to all interfaces of a robot
LOCAL_PLACES: Final = 8
"""Number of places reserved for clients on this machine, so that a local user can always connect."""
SCARCE: Final = 0.9  # share of places in use above which each new client displaces another [-]

MakeSession = Callable[[ConnectionControl, Send], PortSession]
"""Creates an interface's session from its access to the controller and its send function."""


class ClientConnection(asyncio.BufferedProtocol):
    """One client at one interface; if it is lossless (lockstep), samples wait for a slow client."""

    def __init__(
        self,
        make: MakeSession,
        lease: Callable[[str], HostLease],
        limit: "ConnectionLimit",
        *,
        lossless: bool,
    ) -> None:
        self._make = make
        self._lease = lease
        self._limit = limit
        self._lossless = lossless
        self._most_unread = MAX_UNREAD_LOCKSTEP if lossless else MAX_UNREAD
        self._transport: asyncio.Transport | None = None
        self._piece = bytearray(PIECE)
        self._behind = False  # whether the client has left many answers unread
        self._took = 0.0  # when the socket last accepted a sample [s of the loop's clock]
        self.session: PortSession | None = None
        self.peer = "a client"  # description of the client and its interface, for messages
        self.heard = 0.0  # when the client last sent something, or connected [s of the loop's clock]
        self.dropped = 0  # number of samples dropped because the client is slow

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start a session, unless all places are taken."""
        stream = cast("asyncio.Transport", transport)
        (host, port), (own, own_port) = (stream.get_extra_info(end)[:2] for end in ("peername", "sockname"))
        self.peer = f"the client {host}:{port} of port {own_port}"
        if not self._limit.make_room(self.peer, local=host == own or _is_loopback(host)):
            stream.abort()
            return
        self._transport = stream
        stream.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if not self._lossless:
            stream.set_write_buffer_limits(ANSWERS)
        self._control = ConnectionControl(self._lease(host), self._hear, self.peer)
        self.session = self._make(self._control, self.send)
        self._limit.taken.add(self)
        self.heard = asyncio.get_running_loop().time()
        self._guarded(self.session.opened)

    def get_buffer(self, sizehint: int) -> bytearray:  # noqa: ARG002  the size is fixed
        return self._piece

    def buffer_updated(self, nbytes: int) -> None:
        session = self.session
        self.heard = asyncio.get_running_loop().time()
        if session is not None:
            data = bytes(self._piece[:nbytes])
            self._guarded(lambda: session.receive(data))
            self._listen()

    def pause_writing(self) -> None:
        self._behind = True
        self._listen()

    def resume_writing(self) -> None:
        self._behind = False
        self._listen()

    def _hear(self, answer: Callable[[], None]) -> None:
        self._guarded(answer)
        self._listen()

    def _listen(self) -> None:
        """Pause or resume reading, or close the connection if its session is over."""
        session, transport = self.session, self._transport
        if session is None or transport is None or transport.is_closing():
            return
        if session.over:
            transport.close()
        elif self._behind or self._control.unanswered + session.waiting >= MAX_COMMANDS:
            transport.pause_reading()
        else:
            transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:
        session, transport = self.session, self._transport
        if isinstance(exc, ConnectionError) and session is not None and transport is not None:
            left = _left_in(transport)
            self._guarded(lambda: session.receive(left))
        self.session = self._transport = None
        self._limit.taken.discard(self)
        if self.dropped:
            log.warning("a client of a UR interface read too slowly: %d samples were dropped", self.dropped)
        if session is not None:
            try:
                session.closed()
            except Exception:
                log.exception("a UR interface could not close a session")
                self._control.leave()

    def send(self, data: bytes) -> None:
        """Send an answer; disconnect a client that leaves too many bytes unread."""
        transport = self._transport
        if transport is not None and not transport.is_closing():
            transport.write(data)
            if transport.get_write_buffer_size() > self._most_unread:
                log.warning("a client of a UR interface was disconnected because it does not read")
                transport.abort()

    def tell(self, message: bytes) -> None:
        """Send a message that goes to all clients; in real time, a client that does not read misses it."""
        transport = self._transport
        if transport is not None and (self._lossless or transport.get_write_buffer_size() < HEARS):
            self.send(message)

    def sample(self, snapshot: Snapshot) -> bytes:
        """Return the sample of a tick for `put`; empty if there is none."""
        session, transport = self.session, self._transport
        if session is None or transport is None or transport.is_closing():
            return b""
        try:
            data = session.sample(snapshot)
        except Exception:
            log.exception("a UR interface failed and disconnected its client")
            transport.abort()
            return b""
        if session.over:
            transport.close()
        return data

    def put(self, sample: bytes) -> None:
        """Send a sample; in real time it is dropped, not queued, if earlier bytes are still waiting."""
        transport, now = self._transport, asyncio.get_running_loop().time()
        if self._lossless:
            self.send(sample)
        elif transport is not None and not transport.get_write_buffer_size():
            self._took = now
            transport.write(sample)
        else:
            self.dropped += 1
            if self.session is not None and self.session.served and now - self._took > UNREAD_FOR:
                log.warning("%s was disconnected: it has not read for %.0f s", self.peer, UNREAD_FOR)
                self.disconnect()

    def event(self, event: Event) -> None:
        session = self.session
        if session is not None:
            self._guarded(lambda: session.event(event))

    @property
    def dispensable(self) -> bool:
        session = self.session
        return session is not None and session.client_begins and not session.served

    def disconnect(self) -> None:
        """Close the connection at once, even if data is still unsent."""
        if self._transport is not None:
            self._transport.abort()

    def close(self) -> None:
        if self._transport is not None:
            self._transport.close()

    def _guarded(self, action: Callable[[], None]) -> None:
        """Call a function; log an exception and end only this connection."""
        try:
            action()
        except Exception:
            log.exception("a UR interface failed and disconnected its client")
            if self._transport is not None:
                self._transport.abort()


class ConnectionLimit:
    """Decides which clients may connect, so that a flood of new ones does not disturb those at work.

    When 90 % of the places are taken, each new client displaces the dispensable one that has been silent for
    longest: a dashboard client, or an RTDE client outside the time from its start to its pause.
    """

    def __init__(
        self, now: Callable[[], float], note: Callable[[str], None], most: int = MAX_CONNECTIONS
    ) -> None:
        self.taken: set[ClientConnection] = set()  # clients that have a place; each adds and removes itself
        self._now = now
        self._note = note
        self._most = most

    def make_room(self, peer: str, *, local: bool) -> bool:
        """Return whether a new client may connect; disconnect another one for it if necessary."""
        if len(self.taken) >= SCARCE * self._most:
            self._send_one_away(peer)
        kept = 0 if local else LOCAL_PLACES
        if len(self.taken) < self._most - kept:
            return True
        self._note(
            f"{peer} was refused: {len(self.taken)} of {self._most} connections are in use"
            + (f", and {LOCAL_PLACES} are kept for this machine" if kept else "")
        )
        return False

    def _send_one_away(self, newcomer: str) -> None:
        silent = min(
            (one for one in self.taken if one.dispensable),
            key=lambda one: one.heard,
            default=None,
        )
        if silent is None:
            return
        taken = len(self.taken)
        silent.disconnect()
        self.taken.discard(silent)
        self._note(
            f"{silent.peer}, silent for {self._now() - silent.heard:.0f} s, was closed to make room for {newcomer}: "
            f"{taken} of {self._most} connections were in use"
        )


def _left_in(transport: asyncio.Transport) -> bytes:
    """Return unread data of a connection that its client has reset, as after sending a script with states unread."""
    left = bytearray()
    with (
        socket.socket(fileno=os.dup(transport.get_extra_info("socket").fileno())) as stream,
        contextlib.suppress(OSError),  # the reset itself
    ):
        stream.setblocking(False)
        while len(left) < LAST_WORDS and (data := stream.recv(LAST_WORDS - len(left))):
            left += data
    return bytes(left)


def _is_loopback(host: str) -> bool:
    address = ipaddress.ip_address(host)
    if isinstance(address, ipaddress.IPv6Address) and address.ipv4_mapped is not None:
        address = address.ipv4_mapped
    return address.is_loopback
