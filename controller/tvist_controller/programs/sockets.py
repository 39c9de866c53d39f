"""Sockets of programs: received data and waiting readers.

The host has the network: it takes orders after the programs' turns and reports `SocketEvent` before a tick.
The journal contains the news, so that a replay gets the same bytes. A cell's gripper is simulated; it answers
a tick later.
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

MAX_SOCKETS = 16  # largest number of open sockets per program

T = TypeVar("T")
Take = Callable[[bytes], tuple[T, int] | None]
"""Returns the value at the beginning of the received bytes and its length; None while incomplete."""


class SocketEvent(NamedTuple):
    """An event of a socket."""

    number: int
    """Number of the socket; with `expired`, of the wait."""
    change: SocketChange
    data: bytes = b""
    """Received data."""

    @classmethod
    def of(cls, entry: Entry) -> "SocketEvent":
        """Return the news in a journal entry."""
        if entry.socket is None or entry.change is None:
            raise ValueError(
                f"the journal's socket entry before tick {entry.tick} has no number or no change"
            )
        return cls(entry.socket, entry.change, entry.data or b"")


class Open(NamedTuple):
    """Connect a socket; answered by `opened` or `failed`."""

    socket: int  # unique number of the socket
    origin: str | None  # address of the machine that sent and started the program; None if unknown
    address: str  # name or IP address of the machine to connect to
    port: int


class Send(NamedTuple):
    """Send bytes over a socket."""

    socket: int
    data: bytes


class Close(NamedTuple):
    """Close a socket and ignore its later news."""

    socket: int


class Taken(NamedTuple):
    """A program has read received bytes, which makes room for more."""

    socket: int
    amount: int


class Wait(NamedTuple):
    """A program starts to wait for a socket."""

    wait: int  # unique number of the wait
    socket: int


class Waited(NamedTuple):
    """A wait is over; its time no longer matters."""

    wait: int


class Expire(NamedTuple):
    """Report `expired` after `seconds` of wall time since the wait began; robot time has passed already."""

    wait: int
    socket: int
    seconds: float


SocketOrder = Open | Send | Close | Taken | Wait | Waited | Expire


class SocketPorts:
    """Network of one robot's programs; this base class has none, so no socket can be opened.

    Later events reach the host by `Host.socket`.
    """

    def carry_out(self, orders: Sequence[SocketOrder]) -> Sequence[SocketEvent]:
        """Carry out orders without blocking; return news known at once, which count after this tick."""
        return [SocketEvent(order.socket, "failed") for order in orders if isinstance(order, Open)]


@dataclass
class _Socket:
    number: int
    received: bytearray = field(default_factory=bytearray)
    connected: bool | None = None  # true after opening, False after failing, None in between
    open: bool = False  # whether the socket is connected
    requests: Requests | None = None  # parser of requests to the cell's gripper; None for a network socket

    def shut(self) -> None:
        """Mark the socket as closed or failed."""
        self.connected, self.open = bool(self.connected), False


class Sockets:
    """The sockets of one robot's programs; each program has its own, by name.

    `owner` returns the running program, `origin` the machine that sent and started it, if known.
    """

    def __init__(
        self,
        emit: Emit,
        owner: Callable[[], Machine],
        origin: Callable[[], str | None],
        cell: LiveCell | None,
    ) -> None:
        self._emit, self._owner, self._origin, self._cell = emit, owner, origin, cell
        self.orders: list[SocketOrder] = []  # orders for the network, in order; the host removes them
        self._named: dict[tuple[Machine, str], _Socket] = {}
        self._numbered: dict[int, _Socket] = {}
        self._last = self._last_wait = 0
        self._answers: list[tuple[_Socket, bytes]] = []  # gripper answers for the next tick
        self._waits: dict[int, bool] = {}  # present waits, and whether the wall time of each has also expired

    def hear(self, news: SocketEvent) -> None:
        """Take news about a socket or a wait."""
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
        """Deliver the gripper's answers of the last tick."""
        for socket, data in self._answers:
            socket.received += data
        self._answers.clear()

    # ------------------------------------------------------------------ for programs

    def connect(self, name: str, address: str, port: int) -> Generator[None, None, bool]:
        """Connect a socket, replacing one of this name, and wait for it; return whether it is open."""
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
        """Close the program's socket of this name, if any."""
        if (self._owner(), name) in self._named:
            self._drop(self._owner(), name)

    def is_open(self, name: str) -> bool:
        """Return whether a socket of the program is open."""
        socket = self._named.get((self._owner(), name))
        return socket is not None and socket.open

    def send(self, name: str, data: bytes) -> None:
        """Send bytes if the socket is open."""
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
        """Read from a socket what `take` finds; wait until that has arrived completely.

        Incomplete data stays for the next call. A read fails on timeout or if the socket was closed before;
        it returns None after at least a tick, so that loops let time pass. The timeout [s] is over when both
        robot and wall time have passed; 0 or less means none. `meanwhile` is called before each further tick
        with the ticks waited.
        """
        if (socket := self._named.get((self._owner(), name))) is None:
            yield
            return None
        if (found := self._take(socket, take)) is not None:
            return found[0]
        last = ceil(timeout / PERIOD - 1e-9)
        waited = 0
        with self._waiting(socket) as wait:
            while True:
                yield
                waited += 1
                if (found := self._take(socket, take)) is not None:
                    return found[0]
                if not socket.open or self._waits[wait]:
                    return None
                if waited == last:
                    if socket.requests is not None:
                        return None
                    self.orders.append(Expire(wait, socket.number, timeout))
                meanwhile(waited)

    def close(self, owner: Machine) -> None:
        """Close all sockets of a program that has ended."""
        for one, name in tuple(self._named):
            if one is owner:
                self._drop(one, name)

    # ------------------------------------------------------------------ parts

    def _take(self, socket: _Socket, take: Take[T]) -> tuple[T, int] | None:
        found = take(bytes(socket.received)) if socket.received else None
        if found is not None:
            del socket.received[: found[1]]
            self._owner().progress()
            if socket.number in self._numbered:  # another thread may have closed it
                self._order(socket, Taken(socket.number, found[1]))
        return found

    @contextmanager
    def _waiting(self, socket: _Socket) -> Iterator[int]:
        """Context in which a program waits for a socket; yields the number of the wait."""
        self._last_wait = wait = self._last_wait + 1
        self._waits[wait] = False
        self._order(socket, Wait(wait, socket.number))
        try:
            yield wait
        finally:
            del self._waits[wait]
            self._order(socket, Waited(wait))

    def _order(self, socket: _Socket, order: SocketOrder) -> None:
        """Order something from the network, unless the socket is the gripper's."""
        if socket.requests is None:
            self.orders.append(order)

    def _drop(self, owner: Machine, name: str) -> None:
        socket = self._named.pop((owner, name))
        del self._numbered[socket.number]
        socket.shut()
        self._order(socket, Close(socket.number))
