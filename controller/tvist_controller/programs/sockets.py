"""Sockets of programs: what they have received, and what waits for more.

The network is the host's: it gets orders after programs had their turn. What happened it reports before a tick, as
`SocketNews`, which the journal contains. So a replay gets the same bytes at the same ticks. The gripper of a cell needs
no network: it is part of the simulation, and answers a tick later.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import ceil
from typing import NamedTuple, TypeVar

from tvist_controller.cell.gripper import Requests
from tvist_controller.cell.live_cell import LiveCell
from tvist_controller.events import Emit
from tvist_controller.programs.arguments import readable
from tvist_plant.plant import PERIOD
from tvist_protocol.journal import Entry, SocketChange
from tvist_urscript import Fault, Machine

MAX_SOCKETS = 16
"""Most sockets of a program at a time."""

T = TypeVar("T")
Take = Callable[[bytes], tuple[T, int] | None]
"""Finds what a program reads at the beginning of the received bytes: its value and its length in bytes; None as long
as it has not arrived completely.
"""


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


class SocketPorts:
    """Carries the sockets of one robot's programs; this one has no network, so no socket can be opened.

    What happens to them later reaches the host by `Host.socket`.
    """

    def carry_out(self, orders: Sequence[SocketOrder]) -> Sequence[SocketNews]:
        """Carry out orders without blocking; return news that are known at once, which count after this tick."""
        return [SocketNews(order.socket, "failed") for order in orders if isinstance(order, Open)]


@dataclass
class _Socket:
    number: int
    received: bytearray = field(default_factory=bytearray)
    connected: bool | None = None
    """True once it was opened, False if it could not be, None while it is being opened."""
    open: bool = False
    """True while it is connected."""
    requests: Requests | None = None
    """What the program has sent to the gripper of the cell; None for a socket of the network."""

    def shut(self) -> None:
        """Note that it is open no more, or that it could not be opened."""
        self.connected, self.open = bool(self.connected), False


class Sockets:
    """The sockets of one robot's programs. Each program has its own, by name.

    `owner` returns the program that runs now, `origin` the address of the machine that sent and started it, if it
    is known. The gripper of the cell is reached by programs, too.
    """

    def __init__(
        self,
        emit: Emit,
        owner: Callable[[], Machine],
        origin: Callable[[], str | None],
        cell: LiveCell | None = None,
    ) -> None:
        self._emit, self._owner, self._origin, self._cell = emit, owner, origin, cell
        self.orders: list[SocketOrder] = []
        """Orders for the network, in their order, which the host takes away."""
        self._named: dict[tuple[Machine, str], _Socket] = {}
        self._numbered: dict[int, _Socket] = {}
        self._last = self._last_wait = 0
        self._answers: list[tuple[_Socket, bytes]] = []
        """Answers of the gripper that programs get in the next tick."""
        self._waits: dict[int, bool] = {}
        """Present waits, and whether the time of each is over on the wall, too."""

    def hear(self, news: SocketNews) -> None:
        """Take what happened to a socket or to a wait for one."""
        if news.change == "expired":
            if news.number in self._waits:
                self._waits[news.number] = True
            return
        socket = self._numbered.get(news.number)
        if socket is None:  # closed meanwhile
            return
        match news.change:
            case "opened":
                socket.connected = socket.open = True
            case "received":
                socket.received += news.data
            case _:
                socket.shut()

    def answer(self) -> None:
        """Pass on what the gripper has answered in the last tick."""
        for socket, data in self._answers:
            socket.received += data
        self._answers.clear()

    # ------------------------------------------------------------------ what programs call

    def connect(self, name: str, address: str, port: int) -> Generator[None, None, bool]:
        """Connect a socket, and wait until the network has opened it or failed to; return whether it is open.

        One of the same name is closed first.
        """
        self.disconnect(name)
        owner = self._owner()
        if sum(one is owner for one, _ in self._named) >= MAX_SOCKETS:
            raise Fault(f"the program has {MAX_SOCKETS} open sockets: close one first")
        self._last += 1
        socket = self._named[owner, name] = self._numbered[self._last] = _Socket(self._last)
        if self._cell is not None and self._cell.reaches(address, port):
            socket.requests = Requests()
            socket.connected = socket.open = True
            yield
            return True
        self.orders.append(Open(socket.number, self._origin(), address, port))
        try:
            with self._waiting(socket):
                while socket.connected is None:
                    yield
        finally:
            if not socket.connected and self._named.get((owner, name)) is socket:
                self._drop(owner, name)
        if socket.connected:
            return True
        why = f'socket_open: "{name[:60]}" has no connection to {address[:60]} port {port}'
        self._emit("warning", why=readable(why))
        return False

    def disconnect(self, name: str) -> None:
        """Close a socket of the program; nothing happens if there is none of this name."""
        if (self._owner(), name) in self._named:
            self._drop(self._owner(), name)

    def is_open(self, name: str) -> bool:
        """Return whether a socket of the program is open."""
        socket = self._named.get((self._owner(), name))
        return socket is not None and socket.open

    def send(self, name: str, data: bytes) -> None:
        """Send bytes; nothing happens if the socket is not open."""
        socket = self._named.get((self._owner(), name))
        if socket is None or not socket.open:
            return
        if socket.requests is not None and self._cell is not None:
            for request in socket.requests.cut(data):
                self._answers.append((socket, self._cell.answer(request)))
        self._order(socket, Send(socket.number, data))

    def read(
        self, name: str, take: Take[T], timeout: float, meanwhile: Callable[[int], None]
    ) -> Generator[None, None, T | None]:
        """Read from a socket what `take` finds, and wait until it has arrived.

        What has arrived incompletely stays for the next call. A read that fails takes at least a tick, so that a loop
        of them lets time pass; it returns None if the time is over, or if the socket was closed before.
        The time-out [s] is counted in robot time, but not less on the wall; it is for ever if it is not above 0.
        `meanwhile` is called with the number of ticks that have passed, before each further one.
        """
        socket = self._named.get((self._owner(), name))
        if socket is None:
            yield
            return None
        found = self._take(socket, take)
        if found is not None:
            return found[0]
        last = ceil(timeout / PERIOD - 1e-9)
        waited = 0
        with self._waiting(socket) as wait:
            while True:
                yield
                waited += 1
                found = self._take(socket, take)
                if found is not None:
                    return found[0]
                if not socket.open or self._waits[wait]:
                    return None
                if waited == last:
                    if socket.requests is not None:
                        return None
                    self.orders.append(Expire(wait, socket.number, timeout))
                meanwhile(waited)

    def close(self, owner: Machine) -> None:
        """Close all sockets of a program, which has ended."""
        for one, name in tuple(self._named):
            if one is owner:
                self._drop(one, name)

    # ------------------------------------------------------------------ parts

    def _take(self, socket: _Socket, take: Take[T]) -> tuple[T, int] | None:
        """Remove what is read from the received bytes."""
        found = take(bytes(socket.received)) if socket.received else None
        if found is not None:
            del socket.received[: found[1]]
            self._owner().progress()
            if socket.number in self._numbered:  # another thread may have closed it
                self._order(socket, Taken(socket.number, found[1]))
        return found

    @contextmanager
    def _waiting(self, socket: _Socket) -> Iterator[int]:
        """Wait for a socket; the number of the wait is returned."""
        self._last_wait = wait = self._last_wait + 1
        self._waits[wait] = False
        self._order(socket, Wait(wait, socket.number))
        try:
            yield wait
        finally:
            del self._waits[wait]
            self._order(socket, Waited(wait))

    def _order(self, socket: _Socket, order: SocketOrder) -> None:
        """Give an order to the network, unless the socket is one of the gripper."""
        if socket.requests is None:
            self.orders.append(order)

    def _drop(self, owner: Machine, name: str) -> None:
        socket = self._named.pop((owner, name))
        del self._numbered[socket.number]
        socket.shut()
        self._order(socket, Close(socket.number))
