"""Common parts of UR's interfaces. A session is one client's connection to one interface, without its socket."""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from tvist_controller.instruments.snapshot import Snapshot
from tvist_protocol.stream import Event
from tvist_server.gateways.ur.later import begin
from tvist_server.gateways.ur.lease import ConnectionControl
from tvist_server.gateways.ur.robot import UrRobot

Send = Callable[[bytes], None]
"""Sends an answer; answers are never dropped."""
Item = TypeVar("Item")


class PortSession(ABC):
    """One connection. All methods are called from one thread and do not block.

    The methods do not raise, whatever bytes arrive: errors are answered in the interface's own way.
    """

    over = False
    """True if the client has asked to end the connection, or if that is closed."""
    client_begins = False
    """Whether nothing is sent to a client that requests nothing, so that it may be disconnected to make room."""
    served = False
    """Whether the client is being sent what it requested; it may then be silent for any time, but has to read."""

    @property
    def waiting(self) -> int:
        """Number of received requests that are not answered; many of them pause reading."""
        return 0

    def __init__(self, robot: UrRobot, control: ConnectionControl, send: Send) -> None:
        self._robot, self._control, self._send = robot, control, send

    def opened(self) -> None:  # noqa: B027  not every session has to
        """Send the greeting, if any, to a client that has just connected."""

    @abstractmethod
    def receive(self, data: bytes) -> None:
        """Take data that arrived; it may be split anywhere."""

    def sample(self, snapshot: Snapshot) -> bytes:  # noqa: ARG002  many sessions send nothing
        """Return the data that this tick sends to the client, or nothing. It is dropped if the client is slow."""
        return b""

    def event(self, event: Event) -> None:  # noqa: B027  not every session has to
        """Handle an event of the robot."""

    def closed(self) -> None:
        """Give back what the connection held, after it was closed."""
        self.over = True
        self._control.leave()


class InTurnSession(PortSession, Generic[Item]):
    """Does what its client sends one after the other: the next begins when the previous one is done.

    What has arrived is done even if the client disconnects, which keeps its control until then.
    """

    def __init__(self, robot: UrRobot, control: ConnectionControl, send: Send) -> None:
        super().__init__(robot, control, send)
        self._items = deque[Item]()
        self._busy = False
        """True while an item is being processed."""

    @property
    def waiting(self) -> int:
        return len(self._items) + self._busy

    @abstractmethod
    async def _do(self, item: Item) -> None:
        """Do one thing."""

    def _add(self, item: Item, *, stop: bool = False) -> None:
        """Do something in its turn; if it stops the arm and has to wait, stop the arm also at once."""
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
        except Exception as error:  # noqa: BLE001  `hear` logs it and ends the connection
            raised = error
        finally:
            self._busy = False

        def done() -> None:
            if raised is not None:
                raise raised

        self._control.hear(done)
        if self.over:
            self._control.leave()

    def closed(self) -> None:
        self.over = True
        if not self._busy:
            self._control.leave()


class Lines:
    """Cuts a client's stream, which may be split anywhere, into lines, of which `longest` bytes are kept."""

    def __init__(self, longest: int) -> None:
        self._longest = longest
        self.rest = bytearray()
        """Beginning of an incomplete line."""

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
