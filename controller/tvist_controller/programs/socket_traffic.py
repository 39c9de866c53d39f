"""What passes between the sockets of programs and the network, which the host connects.

Orders go out after programs had their turn; news come in before a tick.
"""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from tvist_protocol.journal import Entry, SocketChange


class SocketNews(NamedTuple):
    """Something that happened to a socket."""

    number: int
    """Number of the socket; with `expired`, that of the wait."""
    change: SocketChange
    data: bytes = b""
    """What it has received."""

    @classmethod
    def of(cls, entry: Entry) -> "SocketNews":
        """Return the news that an entry of the journal contains."""
        if entry.socket is None or entry.change is None:
            raise ValueError(
                f"the journal's socket entry before tick {entry.tick} has no number or no change"
            )
        return cls(entry.socket, entry.change, entry.data or b"")


class Open(NamedTuple):
    """Connect a socket; `opened` or `failed` is the answer."""

    socket: int
    """Number of the socket; no number comes twice."""
    origin: str | None
    """Address of the machine that sent and started the program; None if it is unknown."""
    address: str
    """Name or IP address of the machine to connect to."""
    port: int


class Send(NamedTuple):
    """Send bytes over a socket."""

    socket: int
    data: bytes


class Close(NamedTuple):
    """Close a socket; nothing that comes from it later counts."""

    socket: int


class Taken(NamedTuple):
    """A program has read bytes that a socket had received, so there is room for more."""

    socket: int
    amount: int


class Wait(NamedTuple):
    """A program begins to wait for a socket."""

    wait: int
    """Number of the wait; no number comes twice."""
    socket: int


class Waited(NamedTuple):
    """A wait is over, so that no time has to be kept for it any more."""

    wait: int


class Expire(NamedTuple):
    """Tell the program by `expired` when so much wall time has passed since it began to wait; robot time has passed."""

    wait: int
    socket: int
    seconds: float


SocketOrder = Open | Send | Close | Taken | Wait | Waited | Expire


class SocketPorts(Protocol):
    """Carries the sockets of one robot's programs. What happens to them reaches the host by `Host.socket`."""

    def carry_out(self, orders: Sequence[SocketOrder]) -> Sequence[SocketNews]:
        """Carry out orders without blocking; return news that are known at once, which count after this tick."""


class NoPorts(SocketPorts):
    """No network: sockets cannot be opened."""

    def carry_out(self, orders: Sequence[SocketOrder]) -> Sequence[SocketNews]:
        """Report that a socket could not be opened."""
        return [SocketNews(order.socket, "failed") for order in orders if isinstance(order, Open)]
