"""Base of the sessions of UR's interfaces: one client's connection, without its socket."""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from tvist_controller.instruments.snapshot import Snapshot
from tvist_protocol.stream import Event
from tvist_server.gateways.ur.deferred import begin
from tvist_server.gateways.ur.lease import ConnectionControl
from tvist_server.gateways.ur.robot import UrRobot

MAX_COMMANDS = 32
"""Number of a client's unanswered commands at which reading pauses, since one tick carries all of them out."""

Send = Callable[[bytes], None]  # sends an answer, which is never dropped
Item = TypeVar("Item")


@dataclass(eq=False)
class PortSession(ABC):
    """One connection. Methods do not block and, whatever bytes arrive, do not raise: errors are answered."""

    _robot: UrRobot
    _control: ConnectionControl
    _send: Send
    over = False  # whether the connection is closed, or the client has asked to close it
    only_answers = False
    """Whether the client only gets what it requests. Unless `served`, it may be disconnected to make room."""
    served = False
    """Whether the client is receiving data that it subscribed to: it may then be silent, but must read."""
    most_waiting = MAX_COMMANDS
    """Number of waiting requests at which reading pauses."""

    @property
    def waiting(self) -> int:
        """Number of received requests without an answer."""
        return 0

    def opened(self) -> None:  # noqa: B027  not every session has to
        """Send a greeting, if any, to the new client."""

    @abstractmethod
    def receive(self, data: bytes) -> None:
        """Handle received bytes, which may begin and end anywhere in a request."""

    def sample(self, snapshot: Snapshot) -> bytes:  # noqa: ARG002  many sessions send nothing
        """Return this tick's data for the client, if any. If the client is slow, the data is dropped."""
        return b""

    def event(self, event: Event) -> None:  # noqa: B027  not every session has to
        """Handle an event of the robot."""

    def closed(self) -> None:
        """Release control after the connection was closed."""
        self.over = True
        self._control.leave()


@dataclass(eq=False)
class InTurnSession(PortSession, Generic[Item]):
    """Handles requests one by one. If the client disconnects, control is released after its last request."""

    _items: deque[Item] = field(default_factory=deque, init=False)
    _busy: bool = field(default=False, init=False)

    @property
    def waiting(self) -> int:
        return len(self._items) + self._busy

    @abstractmethod
    async def _do(self, item: Item) -> None:
        """Handle one item."""

    def _add(self, item: Item, *, stop: bool = False) -> None:
        """Queue an item. If it is a `stop` and has to wait, also stop the arm at once."""
        if stop and self._busy:
            begin(self._robot.programs.stop(self._control))
        self._items.append(item)
        if not self._busy:
            begin(self._work())

    async def _work(self) -> None:
        self._busy, raised = True, None
        try:
            while self._items:
                await self._do(self._items.popleft())
        except Exception as error:  # noqa: BLE001  `deliver` logs it and ends the connection
            raised = error
        finally:
            self._busy = False

        def done() -> None:
            if raised is not None:
                raise raised

        self._control.deliver(done)
        if self.over:
            self._control.leave()

    def closed(self) -> None:
        self.over = True
        if not self._busy:
            self._control.leave()


class LineSplitter:
    """Splits a client's stream into lines; only the first `longest` bytes of each are kept."""

    def __init__(self, longest: int) -> None:
        self._longest = longest
        self.rest = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """Take a piece and return the lines that it completes, without their line feeds."""
        lines: list[bytes] = []
        *whole, rest = data.split(b"\n")
        for piece in whole:
            self._keep(piece)
            lines.append(bytes(self.rest))
            self.rest.clear()
        self._keep(rest)
        return lines

    def _keep(self, piece: bytes) -> None:
        self.rest += piece[: self._longest - len(self.rest)]
