"""A socket of a door, and the session behind it."""

import asyncio
import logging
import socket
from collections.abc import Callable
from typing import cast

from tvist_protocol.stream import Event
from tvist_server.gateways.ur.base import Send, Session
from tvist_server.gateways.ur.lease import ConnectionControl, HostLease
from tvist_server.instruments.snapshot import Snapshot

log = logging.getLogger(__name__)

PIECE = 256
"""Bytes taken of a client at once: one that floods its door is served in turn with all others."""
MOST_COMMANDS = 32
"""Commands of a client that may wait for the controller's answers before more is taken of it: a tick does them all."""
MOST_UNREAD = 1_000_000
"""Bytes that may wait for a client that does not read them; then it is cut off."""
HEARS = MOST_UNREAD // 4
"""Where more waits, it is told no more of what everybody is told, in real time."""
ANSWERS = MOST_UNREAD // 2
"""Where more waits, no more is taken of it, in real time, until it has read."""
MOST_UNREAD_LOCKSTEP = 64_000_000
"""The same in lockstep, where samples wait, too: a minute of them."""

MakeSession = Callable[[ConnectionControl, Send], Session]
"""Makes a door's session: the way to the controller, and the way back."""


class Connection(asyncio.BufferedProtocol):
    """One client at one door.

    Args:
        make: Its session.
        lease: Control for a host.
        members: All connections of the robot; this one is in it as long as it lives.
        most: How many there may be.
        lossless: Whether samples wait for a client that is slow: where a client lets time pass.
    """

    def __init__(
        self,
        make: MakeSession,
        lease: Callable[[str], HostLease],
        members: "set[Connection]",
        most: int,
        *,
        lossless: bool,
    ) -> None:
        self._make = make
        self._lease = lease
        self._members = members
        self._most = most
        self._lossless = lossless
        self._most_unread = MOST_UNREAD_LOCKSTEP if lossless else MOST_UNREAD
        self._transport: asyncio.Transport | None = None
        self._piece = bytearray(PIECE)
        self._behind = False
        """Whether the client leaves its answers unread."""
        self.session: Session | None = None
        self.dropped = 0
        """Samples that a slow client did not get."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client came."""
        stream = cast("asyncio.Transport", transport)
        if len(self._members) >= self._most:
            log.warning("a client of a UR door was turned away: there are %d connections", self._most)
            stream.abort()
            return
        self._transport = stream
        stream.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if not self._lossless:
            stream.set_write_buffer_limits(ANSWERS)
        self._control = ConnectionControl(self._lease(stream.get_extra_info("peername")[0]), self._hear)
        self.session = self._make(self._control, self.send)
        self._members.add(self)
        self._guarded(self.session.opened)

    def get_buffer(self, sizehint: int) -> bytearray:  # noqa: ARG002  it is always the same
        """Where the next piece goes."""
        return self._piece

    def buffer_updated(self, nbytes: int) -> None:
        """The client sent something."""
        session = self.session
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
        elif self._behind or self._control.unanswered >= MOST_COMMANDS:
            transport.pause_reading()
        else:
            transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002  however it ended
        """The client went, or was cut off."""
        session, self.session = self.session, None
        self._transport = None
        self._members.discard(self)
        if self.dropped:
            log.warning("a client of a UR door read too slowly: %d samples were dropped", self.dropped)
        if session is not None:
            try:
                session.closed()
            except Exception:
                log.exception("a UR door could not close a session")
            self._control.leave()

    def send(self, data: bytes) -> None:
        """Send an answer; a client that does not read is cut off when too much waits."""
        transport = self._transport
        if transport is not None and not transport.is_closing():
            transport.write(data)
            if transport.get_write_buffer_size() > self._most_unread:
                log.warning("a client of a UR door was cut off: it does not read")
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
            log.exception("a UR door failed, its client is cut off")
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

    def close(self) -> None:
        """End it; what waits for a client that reads is still sent."""
        if self._transport is not None:
            self._transport.close()

    def _guarded(self, action: Callable[[], None]) -> None:
        """One client's fault is no other's: an error of ours ends its connection, loudly."""
        try:
            action()
        except Exception:
            log.exception("a UR door failed, its client is cut off")
            if self._transport is not None:
                self._transport.abort()
