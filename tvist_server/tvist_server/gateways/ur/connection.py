"""Listening sockets, the clients' sockets with their sessions, and the limit of connections."""

import asyncio
import contextlib
import errno
import logging
import os
import socket
import sys
from collections.abc import Callable, Iterator
from typing import Final, cast

from tvist_controller.instruments.snapshot import Snapshot
from tvist_protocol.stream import Event
from tvist_server.allowed_hosts import ip_of
from tvist_server.gateways.base import GatewayError
from tvist_server.gateways.ur.base import MAX_COMMANDS, PortSession, Send
from tvist_server.gateways.ur.lease import ConnectionControl, HostLease
from tvist_server.ur_ports import InterfaceName

log = logging.getLogger(__name__)

PIECE = 256  # bytes read from a client at a time, so that a flood does not delay the others
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

SEND_BUFFER = 32_768  # system's send buffer for a client [bytes]: 0.1 s of samples; more would only add delay
PROBES = (10, 5, 3)
"""TCP keepalive: idle time before the first probe [s], time between probes [s], and number of unanswered
probes after which a client counts as disconnected and loses control, as when its machine has lost power."""
REASONS = {
    errno.EADDRINUSE: "the port is in use: stop the program that uses it, or choose another port with --ur-port",
    errno.EADDRNOTAVAIL: "this machine does not have this address; it has 127.0.0.1 to 127.255.255.254",
    errno.EACCES: "that is not permitted: choose a port above 1023",
}


class ClientConnection(asyncio.BufferedProtocol):
    """One client's connection to one interface; if `lossless` (lockstep), samples wait for a slow client."""

    def __init__(
        self,
        make: Callable[[ConnectionControl, Send], PortSession],  # creates the client's session
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
        self._transport: asyncio.Transport
        self._piece = bytearray(PIECE)
        self._admitted = False  # whether the client has got a place
        self._behind = False  # whether the client has more than `ANSWERS` bytes unread
        self._took = 0.0  # time of the last sample that the socket accepted [s, loop's clock]
        self.session: PortSession  # of a client that has a place
        self.peer = "a client"  # description of the client and its interface, for messages
        self.heard = 0.0  # when the client last sent something, or connected [s of the loop's clock]
        self.dropped = 0  # number of samples dropped because the client is slow

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start a session, unless all places are taken."""
        self._transport = stream = cast("asyncio.Transport", transport)
        (host, port), (own, own_port) = (stream.get_extra_info(end)[:2] for end in ("peername", "sockname"))
        self.peer = f"the client {host}:{port} of port {own_port}"
        if not self._limit.make_room(self.peer, local=host == own or ip_of(host).is_loopback):
            stream.abort()
            return
        stream.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if not self._lossless:
            stream.set_write_buffer_limits(ANSWERS)
        self._control = ConnectionControl(self._lease(host), self._deliver, self.peer)
        self.session = self._make(self._control, self.send)
        self._limit.taken.add(self)
        self._admitted = True
        self.heard = asyncio.get_running_loop().time()
        with self._guard():
            self.session.opened()

    def get_buffer(self, sizehint: int) -> bytearray:  # noqa: ARG002  the size is fixed
        return self._piece

    def buffer_updated(self, nbytes: int) -> None:
        self.heard = asyncio.get_running_loop().time()
        with self._guard():
            self.session.receive(bytes(self._piece[:nbytes]))
        self._listen()

    def pause_writing(self) -> None:
        self._behind = True
        self._listen()

    def resume_writing(self) -> None:
        self._behind = False
        self._listen()

    def _deliver(self, answer: Callable[[], None]) -> None:
        with self._guard():
            answer()
        self._listen()

    def _listen(self) -> None:
        """Pause or resume reading, or close the connection if its session is over."""
        if self._transport.is_closing():
            return
        session, commands = self.session, self._control.unanswered
        if session.over:
            self._transport.close()
        elif self._behind or commands >= MAX_COMMANDS or session.waiting >= session.most_waiting:
            self._transport.pause_reading()
        else:
            self._transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:
        if not self._admitted:
            return
        if isinstance(exc, ConnectionError):
            with self._guard():
                self.session.receive(_left_in(self._transport))
        self._limit.taken.discard(self)
        if self.dropped:
            log.warning("a client of a UR interface read too slowly: %d samples were dropped", self.dropped)
        try:
            self.session.closed()
        except Exception:
            log.exception("a UR interface could not close a session")
            self._control.leave()

    def send(self, data: bytes) -> None:
        """Send an answer; disconnect a client that leaves too many bytes unread."""
        if not self._transport.is_closing():
            self._transport.write(data)
            if self._transport.get_write_buffer_size() > self._most_unread:
                log.warning("a client of a UR interface was disconnected because it does not read")
                self._transport.abort()

    def tell(self, message: bytes) -> None:
        """Send a message that goes to all clients; in real time, a client that does not read misses it."""
        if self._lossless or self._transport.get_write_buffer_size() < HEARS:
            self.send(message)

    def sample(self, snapshot: Snapshot) -> bytes:
        """Return the sample of a tick for `put`; empty if there is none."""
        if self._transport.is_closing():
            return b""
        data = b""
        with self._guard():
            data = self.session.sample(snapshot)
        if self.session.over:
            self._transport.close()
        return data

    def put(self, sample: bytes) -> None:
        """Send a sample; in real time it is dropped, not queued, if earlier bytes are still waiting."""
        transport, now = self._transport, asyncio.get_running_loop().time()
        if self._lossless:
            self.send(sample)
        elif not transport.get_write_buffer_size():
            self._took = now
            transport.write(sample)
        else:
            self.dropped += 1
            if self.session.served and now - self._took > UNREAD_FOR:
                log.warning("%s was disconnected: it has not read for %.0f s", self.peer, UNREAD_FOR)
                self.disconnect()

    def event(self, event: Event) -> None:
        with self._guard():
            self.session.event(event)

    @property
    def dispensable(self) -> bool:
        return self.session.only_answers and not self.session.served

    def disconnect(self) -> None:
        """Close the connection at once, even if data is still unsent."""
        self._transport.abort()

    def close(self) -> None:
        self._transport.close()

    @contextlib.contextmanager
    def _guard(self) -> Iterator[None]:
        """Log an exception and end only this connection."""
        try:
            yield
        except Exception:
            log.exception("a UR interface failed and disconnected its client")
            self._transport.abort()


class ConnectionLimit:
    """Decides which clients may connect, so that a flood of new clients does not disturb those that work.

    When 90 % of the places are taken, each new client displaces the dispensable one that has been silent for
    longest: a dashboard client, or an RTDE client that has not started or has paused its outputs.
    """

    def __init__(self, now: Callable[[], float], note: Callable[[str], None]) -> None:
        self.taken: set[ClientConnection] = set()  # clients that have a place; each adds and removes itself
        self._now, self._note = now, note

    def make_room(self, peer: str, *, local: bool) -> bool:
        """Return whether a new client may connect; disconnect another one for it if necessary."""
        if len(self.taken) >= SCARCE * MAX_CONNECTIONS:
            self._send_one_away(peer)
        kept = 0 if local else LOCAL_PLACES
        if len(self.taken) < MAX_CONNECTIONS - kept:
            return True
        self._note(
            f"{peer} was refused: {len(self.taken)} of {MAX_CONNECTIONS} connections are in use"
            + (f", and {LOCAL_PLACES} are kept for this machine" if kept else "")
        )
        return False

    def _send_one_away(self, newcomer: str) -> None:
        silent = min((one for one in self.taken if one.dispensable), key=lambda one: one.heard, default=None)
        if silent is None:
            return
        taken = len(self.taken)
        silent.disconnect()
        self.taken.discard(silent)
        self._note(
            f"{silent.peer}, silent for {self._now() - silent.heard:.0f} s, was closed to make room for {newcomer}: "
            f"{taken} of {MAX_CONNECTIONS} connections were in use"
        )


def _left_in(transport: asyncio.Transport) -> bytes:
    """Return received data of a reset connection: a client may send a script and close with states unread."""
    left = bytearray()
    with (
        socket.socket(fileno=os.dup(transport.get_extra_info("socket").fileno())) as stream,
        contextlib.suppress(OSError),  # the reset itself
    ):
        stream.setblocking(False)
        while len(left) < LAST_WORDS and (data := stream.recv(LAST_WORDS - len(left))):
            left += data
    return bytes(left)


def listen(address: str, port: int, interface: InterfaceName) -> socket.socket:
    """Return a socket that listens for clients of an interface; raise GatewayError if that is impossible."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    bound = socket.socket(family, socket.SOCK_STREAM)
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        # Accepted sockets inherit these options.
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        if sys.platform == "linux":
            options = (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT)
            for option, value in zip(options, PROBES, strict=True):
                bound.setsockopt(socket.IPPROTO_TCP, option, value)
        bound.bind((address, port))
        bound.listen(32)
    except OSError as error:
        bound.close()
        reason = REASONS.get(error.errno or 0, error.strerror or str(error))
        raise GatewayError(f"cannot listen on {address} port {port} for {interface}: {reason}") from error
    bound.setblocking(False)
    return bound
