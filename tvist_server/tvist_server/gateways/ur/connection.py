"""One client's socket with the session behind it, and how many clients may be connected."""

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

PIECE = 256
"""Bytes read from a client at a time, so that a client that floods its interface does not delay the others."""
MAX_COMMANDS = 32
"""Commands of a client that may wait for answers before reading from it pauses, since one tick carries out all of
them.
"""
MAX_UNREAD = 1_000_000
"""Unread bytes at which a client is disconnected."""
HEARS = MAX_UNREAD // 4
"""Unread bytes above which, in real time, a client no longer gets messages that are sent to all clients."""
ANSWERS = MAX_UNREAD // 2
"""Unread bytes above which, in real time, reading from a client pauses until it has read."""
MAX_UNREAD_LOCKSTEP = 64_000_000
"""Limit in lockstep, where samples wait as well: a minute of samples."""

LAST_WORDS = 65_536
"""Most bytes that are still taken from a client that has reset its connection: the longest known program and more."""

UNREAD_FOR = 10.0
"""Time after which a client is disconnected, in real time, to which no sample of what it requested can be sent [s]."""

MOST: Final = 256
"""Largest number of connections to all interfaces of a robot together."""
KEPT: Final = 8
"""Number of places kept for clients on this machine, so that a local user can always connect."""
SCARCE: Final = 0.9
"""Share of the places above which each new client displaces another [-]."""

MakeSession = Callable[[ConnectionControl, Send], PortSession]
"""Creates an interface's session from its access to the controller and the function that sends to the client."""


class Connection(asyncio.BufferedProtocol):
    """One client at one interface.

    Args:
        make: Creates its session.
        lease: Returns the lease of a host.
        limit: Limit of the robot, to which the connection counts until it is closed.
        lossless: Whether samples wait for a slow client, because a client advances time.
    """

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
        self._behind = False
        """Whether the client has left many answers unread."""
        self._took = 0.0
        """When a sample was last passed to the socket, which had sent the one before [s of the loop's clock]."""
        self.session: PortSession | None = None
        self.peer = "a client"
        """The client and its interface, as a phrase for messages to people."""
        self.heard = 0.0
        """When the client last sent something, or connected [s of the loop's clock]."""
        self.dropped = 0
        """Number of samples that were dropped because the client is slow."""

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
        """Return the buffer for the next piece of data."""
        return self._piece

    def buffer_updated(self, nbytes: int) -> None:
        """Pass received data to the session."""
        session = self.session
        self.heard = asyncio.get_running_loop().time()
        if session is not None:
            data = bytes(self._piece[:nbytes])
            self._guarded(lambda: session.receive(data))
            self._listen()

    def pause_writing(self) -> None:
        """Note that the client has stopped reading, and pause reading from it."""
        self._behind = True
        self._listen()

    def resume_writing(self) -> None:
        """Note that the client has caught up, and resume reading from it."""
        self._behind = False
        self._listen()

    def _hear(self, answer: Callable[[], None]) -> None:
        """Handle an answer of the controller."""
        self._guarded(answer)
        self._listen()

    def _listen(self) -> None:
        """Resume or pause reading from the client, or close the connection if its session is over."""
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
        """Clean up after the connection was closed by either side."""
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
        """Return the sample of a tick, which `put` sends; empty if there is none."""
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
        """Send a sample; in real time it is dropped if earlier bytes are still waiting, never queued."""
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
        """Pass an event to the session."""
        session = self.session
        if session is not None:
            self._guarded(lambda: session.event(event))

    @property
    def dispensable(self) -> bool:
        """Whether the client may be disconnected to make room for another."""
        session = self.session
        return session is not None and session.client_begins and not session.served

    def disconnect(self) -> None:
        """Close the connection at once, even if the client has yet to read something."""
        if self._transport is not None:
            self._transport.abort()

    def close(self) -> None:
        """Close the connection after sending what a client that reads still has to get."""
        if self._transport is not None:
            self._transport.close()

    def _guarded(self, action: Callable[[], None]) -> None:
        """Call a function; log an error in it and end only this connection, so that other clients are not affected."""
        try:
            action()
        except Exception:
            log.exception("a UR interface failed and disconnected its client")
            if self._transport is not None:
                self._transport.abort()


class ConnectionLimit:
    """Decides which clients may connect.

    When nine places of ten are taken, each new client displaces the dispensable client that has been silent for
    longest. Dispensable are clients of the dashboard, and clients of RTDE that are not being served: RTDE serves a
    client from its start to its pause, and during this time the client may only read. Clients that are being served
    stay connected, and so do those that read from the other interfaces. A new client is turned away only if such
    clients take all places, so a flood of new clients does not disturb those that are working.

    Args:
        now: Returns the time on the same clock as `Connection.heard` [s].
        note: Takes a sentence for the server's console.
        most: Largest number of connections.
    """

    def __init__(self, now: Callable[[], float], note: Callable[[str], None], most: int = MOST) -> None:
        self.taken: set[Connection] = set()
        """Clients that have a place; each adds and removes itself."""
        self._now = now
        self._note = note
        self._most = most

    def make_room(self, peer: str, *, local: bool) -> bool:
        """Return whether a new client, on this machine or another, may connect; disconnect one for it if necessary."""
        if len(self.taken) >= SCARCE * self._most:
            self._send_one_away(peer)
        kept = 0 if local else KEPT
        if len(self.taken) < self._most - kept:
            return True
        self._note(
            f"{peer} was refused: {len(self.taken)} of {self._most} connections are in use"
            + (f", and {KEPT} are kept for this machine" if kept else "")
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
    """What has arrived on a connection that was reset before it was read.

    A client that sends a script and closes at once, with states unread, resets its connection. If the server writes
    before it reads, it gets to know of the reset first.
    """
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
