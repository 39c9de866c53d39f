"""Gateways: the ways clients reach a robot, and what a gateway asks of the robot."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Protocol

from tvist_controller.sink import Topic
from tvist_protocol.commands import Command
from tvist_protocol.io import Io
from tvist_protocol.replies import Reply
from tvist_protocol.stream import Event, State, Telemetry, Truth

Message = State | Event | Truth | Telemetry | Io
Answer = Callable[[Reply], None]
"""Takes the reply to a command, once, from any thread."""


class GatewayError(Exception):
    """A gateway cannot open; the sentence says why and what to do."""


class Desk(Protocol):
    """Receives what arrives at a gateway. Callable from any thread; nothing here may wait."""

    def request(self, data: bytes, answer: Answer) -> None:
        """Take an encoded command; `answer` is called once: at once if it is turned away, else from another thread."""

    def command(self, command: Command, answer: Answer) -> None:
        """Take a command that the gateway made itself; `answer` as for `request`."""

    def setpoint(self, data: bytes) -> None:
        """Take an encoded set-point."""

    def info(self, answer: Callable[[bytes], None]) -> None:
        """Take a question for `info`; `answer` is called once with the encoded message, from another thread."""

    def client_seen(self, client: str, session: str = "") -> None:
        """Note that a client's liveliness token is there.

        Args:
            client: Its name.
            session: Session that it is of; empty where the token does not say.
        """

    def client_gone(self, client: str, session: str = "") -> None:
        """Note that a client's liveliness token is gone, or its session."""

    def session_gone(self, session: str) -> None:
        """Note that a session has ended, whoever else holds its clients' liveliness tokens."""

    def holder(self) -> str | None:
        """Client that has control; None: nobody."""


class Gateway(ABC):
    """One way in and out."""

    setpoints_refused: int
    """Set-points that never reached the desk: put on a key with a wildcard, or too large."""
    dropped = 0
    """States that found too many waiting."""

    @abstractmethod
    def publish(self, topic: Topic, message: Message, payload: bytes) -> None:
        """Put a message, which is there encoded, too. Called from one thread; raises nothing for the network's sake."""

    async def open(self) -> None:  # noqa: B027  not every one waits for something
        """Let clients in. The robot ticks."""

    async def shut(self) -> None:  # noqa: B027  likewise
        """Let nobody in any more, and everybody out."""

    @abstractmethod
    def close(self) -> None:
        """Stop listening. What arrives meanwhile is left unanswered; a second call does nothing."""
