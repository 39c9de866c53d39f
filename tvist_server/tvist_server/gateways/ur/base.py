"""What UR's interfaces have in common: a session is one client's connection to one of them, without its socket."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Protocol

from tvist_controller.instruments.snapshot import Snapshot
from tvist_protocol.commands import Command
from tvist_protocol.replies import Reply
from tvist_protocol.stream import Event

Send = Callable[[bytes], None]
"""Sends an answer, which is never dropped."""
Then = Callable[[Reply], None]
"""Takes the controller's reply to a command, later."""


class ControllerAccess(Protocol):
    """The way of one connection to the controller."""

    peer: str
    """The client and the interface it uses, in words."""

    def change(self, command: Callable[[str], Command], then: Then) -> None:
        """Send a command that needs control, and take control first where nobody has it.

        Args:
            command: Makes the command with the token of the lease.
            then: Called exactly once; with the refusal where somebody else holds control.
        """

    def ask(self, command: Command, then: Then) -> None:
        """Send a command that needs none."""

    def lasting(self) -> "ControllerAccess":
        """Another one for the same host, that does not end with the connection but by its own `leave`."""

    def leave(self) -> None:
        """Give back what was held by it."""

    @property
    def held_by_other(self) -> bool:
        """Whether somebody else holds control, as far as is known: commands that change something are refused."""


class PortSession(ABC):
    """One connection. Everything is called in one thread, and nothing waits.

    Whatever bytes come, nothing here raises: what is wrong is answered in the interface's own way.
    """

    over = False
    """Whether the client has said that it goes: close the connection."""
    client_begins = False
    """Whether the interface has nothing for a client that asks for nothing. Such a client has to say something soon
    after it came, and may have to give up its place later."""

    @property
    def served(self) -> bool:
        """Whether the client is being sent what it asked for: it may well be silent meanwhile."""
        return False

    def opened(self) -> None:  # noqa: B027  not every one has to
        """The client is there: send what it is greeted with."""

    @abstractmethod
    def receive(self, data: bytes) -> None:
        """Take what arrived, cut anywhere."""

    def sample(self, snapshot: Snapshot) -> bytes:  # noqa: ARG002  many have none
        """What this tick has for the client; empty for nothing. It is dropped where the client is slow."""
        return b""

    def event(self, event: Event) -> None:  # noqa: B027  not every one has to
        """Something happened at the robot."""

    def closed(self) -> None:  # noqa: B027  not every one has to
        """The connection is gone: give back what it held."""
