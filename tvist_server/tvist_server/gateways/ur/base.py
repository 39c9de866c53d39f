"""Common parts of UR's interfaces. A session is one client's connection to one interface, without its socket."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Protocol

from tvist_controller.instruments.snapshot import Snapshot
from tvist_protocol.commands import Command
from tvist_protocol.replies import Reply
from tvist_protocol.stream import Event

Send = Callable[[bytes], None]
"""Sends an answer; answers are never dropped."""
Then = Callable[[Reply], None]
"""Takes the controller's reply to a command, at a later time."""


class ControllerAccess(Protocol):
    """How one connection sends commands to the controller; `change` first takes control if it is free."""

    peer: str
    """The client and its interface, as a phrase for messages to people."""
    host: str
    """IP address of the client."""

    def change(self, command: Callable[[str], Command], then: Then) -> None:
        """Send a command that needs control; take control first if no client has it.

        Args:
            command: Creates the command from the token of the lease.
            then: Called exactly once; with a refusal if another client has control.
        """

    def ask(self, command: Command, then: Then) -> None:
        """Send a command that does not need control."""

    def lasting(self) -> "ControllerAccess":
        """Return another access for the same host, which lasts until its own `leave`, not only for the connection."""

    def leave(self) -> None:
        """Give back control, if this access held it."""

    @property
    def held_by_other(self) -> bool:
        """Whether another client is known to have control, so that commands that change something are refused."""


class PortSession(ABC):
    """One connection. All methods are called from one thread and do not block.

    The methods do not raise, whatever bytes arrive: errors are answered in the interface's own way.
    """

    over = False
    """Whether the client has asked to end the connection, which is then closed."""
    client_begins = False
    """Whether nothing is sent to a client that requests nothing, so that it may be disconnected to make room."""

    @property
    def served(self) -> bool:
        """Whether the client is being sent what it requested; it may then be silent for any time, but has to read."""
        return False

    @property
    def waiting(self) -> int:
        """Number of received requests that wait for others to be carried out; many of them pause reading."""
        return 0

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

    def closed(self) -> None:  # noqa: B027  not every session has to
        """Give back what the connection held, after it was closed."""
